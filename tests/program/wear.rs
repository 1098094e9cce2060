//! `output.wear_every`: contact force and work of friction by facet of a mesh, summed over time.

use crate::common::case::octahedron;
use crate::common::vtk::{piece, point_data};
use crate::common::{Place, column};
use std::fmt::Write;

/// Spheres that fall onto an octahedron, in a box whose floor is far below; without friction where `friction` is 0.
fn case(friction: f64) -> String {
    let mut list = String::new();
    for n in 0..25 {
        let (x, y) = (0.008 + 0.0035 * f64::from(n % 5), 0.008 + 0.0034 * f64::from(n / 5));
        let _ = write!(list, "[{x}, {y}, {}],", 0.0247 + 1e-5 * f64::from(n));
    }
    format!(
        "[domain]\nsize = [0.03, 0.03, 0.03]\nperiodic = [false, false, false]\n[dry]\ntime_step = 4e-5\n\
         [[walls]]\nname = \"rock\"\nmesh = {{ file = \"octahedron.obj\", unit = \"mm\", position = [0.015, 0.015, 0.015] }}\n\
         [[particles]]\nshape = {{ sphere = {{ diameter = 3e-3 }} }}\ndensity = 2500\nlist = [{list}]\n\
         [contact]\nyoungs_modulus = 5e5\npoisson_ratio = 0.25\nrestitution = 0.8\n\
         friction_static = {friction}\nfriction_kinetic = {friction}\n[driving]\ngravity = 9.81\n\
         [run]\nend = {{ steps = 1000 }}\n[output]\ndirectory = \"out\"\nseries_every = {{ steps = 1 }}\n\
         particles_every = \"never\"\npicture_every = \"never\"\nwear_every = {{ steps = 500 }}\n"
    )
}

#[test]
fn the_impulses_of_all_facets_are_the_force_on_the_wall_over_time() {
    let place = Place::new(&case(0.4));
    place.write("octahedron.obj", octahedron(8));
    place.well(&["run", "case.toml", "--quiet"]);
    let file = piece(&place.path("out/wear/wear_0000001000.vtp"));
    assert!(place.path("out/wear.pvd").exists() && place.path("out/wear/wear_0000000000.vtp").exists());
    let impulses = point_data(&file, "contact_impulse");
    assert_eq!(impulses.len(), 3 * 3 * 8, "three numbers at the three corners of eight facets");
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        // The first row is that before any step.
        let force = column(&place.path("out/series.csv"), &format!("contact_force_rock_{name}"));
        let expected: f64 = force[1..].iter().sum::<f64>() * 4e-5;
        let found: f64 = impulses.chunks(9).map(|facet| facet[axis]).sum();
        assert!((found - expected).abs() < 1e-5 * impulses[2].abs().max(1e-5), "{name}: {found} {expected}");
    }
    let [work, pressure] = ["friction_work", "mean_pressure"].map(|name| point_data(&file, name));
    // The four facets that look up, and none of the others.
    for n in 0..8 {
        let is_hit = n % 2 == 0;
        assert_eq!([work[3 * n] > 0.0, pressure[3 * n] > 0.0], [is_hit; 2], "facet {n}: {work:?}");
    }
    let area = 0.25 * 3.0_f64.sqrt() * 2.0 * 8e-3 * 8e-3;
    let normal = point_data(&file, "normal_impulse")[0];
    assert!((normal / (area * 0.04) / pressure[0] - 1.0).abs() < 1e-5);
}

#[test]
fn without_friction_no_facet_wears_and_without_meshes_there_is_none() {
    let place = Place::new(&case(0.0));
    place.write("octahedron.obj", octahedron(8));
    place.well(&["run", "case.toml", "--quiet", "--threads", "3"]);
    let work = point_data(&piece(&place.path("out/wear/wear_0000001000.vtp")), "friction_work");
    assert!(work.iter().all(|work| work.abs() < 1e-15), "{work:?}");
    place.write(
        "case.toml",
        case(0.0).replace("mesh = {", "plane = { point = [0, 0, 0], normal = [0, 0, 1] }#"),
    );
    place.refused(
        &["run", "case.toml"],
        &["case.toml", "output.wear_every", "walls from meshes", "leave the key out"],
    );
}
