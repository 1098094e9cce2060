//! Contents of the files of a short run: a sphere that falls, in a fluid and without one.

use crate::common::column;
use crate::common::vtk::{point_data, polygons};
use std::path::Path;
use turbid::case::Setup;
use turbid::domain::Domain;
use turbid::math::Vec3;
use turbid::output::OutputFiles;
use turbid::output::directory::{CONTACTS, PARTICLES};
use turbid::simulation::RunOptions;
use turbid::wall::{Motion, Surface, Wall};

/// The smallest case: a sphere that falls.
const FALLING: &str = r"
        [domain]
        size = { diameters = [4, 4, 6] }
        [fluid]
        density = 1000.0
        archimedes = 100
        [lattice]
        cells_per_diameter = 4
        relaxation_time = 0.6
        [[particles]]
        shape = { sphere = { diameter = 1e-3 } }
        density = 2000.0
        list = [[2e-3, 2e-3, 0.6e-3]]
        [run]
        end = { steps = 40 }
        [output]
        series_every = { steps = 1 }
        particles_every = { steps = 20 }
        picture_every = { steps = 40 }
";

/// A sphere that falls onto a floor: the smallest case, changed to what it is to show.
fn falling_sphere(root: &Path, change: impl FnOnce(&mut Setup)) -> serde_json::Value {
    let mut setup = turbid::case::from_text(FALLING, "falling", &[]).unwrap();
    setup.plan.output.directory = root.join("out");
    change(&mut setup);
    let options = RunOptions::default();
    turbid::simulation::run(&setup, &options).unwrap();
    let summary = std::fs::read_to_string(OutputFiles::new(root.join("out")).summary()).unwrap();
    serde_json::from_str(&summary).unwrap()
}

/// Closes the box in z by a floor and a lid.
fn close(setup: &mut Setup) {
    setup.domain.faces = Domain::faces([true, true, false]);
    let size = setup.domain.size();
    for (name, point, normal) in [("z-", Vec3::zeros(), Vec3::z()), ("z+", size, -Vec3::z())] {
        setup.walls.push(Wall {
            name: name.to_owned(),
            surface: Surface::Plane { point, normal },
            motion: Motion::default(),
            material: 0,
        });
    }
}

#[test]
fn a_dry_run_tells_of_walls_and_paths_and_of_no_fluid() {
    let root = tempfile::tempdir().unwrap();
    let summary = falling_sphere(root.path(), |setup| {
        close(setup);
        setup.fluid = None;
        setup.plan.output.fields_every = 0;
        setup.time_step = 1e-3;
    });
    let files = OutputFiles::new(root.path().join("out"));
    for absent in ["fields.pvd", "settling_velocity.png"] {
        assert!(!files.directory().join(absent).exists(), "{absent}");
    }
    let picture = files.directory().join("pictures/view_0000000000.png");
    for present in [files.walls(), picture, files.collection(CONTACTS)] {
        assert!(present.exists(), "{}", present.display());
    }
    for nothing in ["settling_velocity_over_stokes", "mach", "collision", "coupling", "force_balance"] {
        assert!(summary[nothing].is_null(), "{nothing}");
    }
    assert_eq!(summary["dry"], true);
    assert_eq!(summary["walls"][1]["name"], "z+");
    assert_eq!(summary["shapes"][0]["kind"], "sphere");
    assert_eq!(summary["shapes"][0]["count"], 1);
    // What the floor receives is what stops the fall: the momentum changes by weight and floor alone.
    let weight = -2000.0 * std::f64::consts::PI / 6.0 * 1e-9 * 9.80665;
    let momentum = column(&files.series(), "momentum_z");
    let on_walls: f64 = column(&files.series(), "wall_force_z").iter().sum();
    assert!(on_walls < 20.0 * weight, "it hits the floor: {on_walls}");
    let change = momentum.last().unwrap() - momentum[0];
    let impulse = 1e-3 * (40.0 * weight - on_walls);
    assert!((change - impulse).abs() < 0.02 * 1e-3 * on_walls.abs(), "{change} {impulse}");
    let path = column(&files.particle_series(), "z (m)");
    assert_eq!((path.len(), path[0]), (41, 0.6e-3));
    let energy = column(&files.series(), "gravitational_energy");
    assert!((energy[0] / (-weight * 0.6e-3) - 1.0).abs() < 1e-12);
}

/// A vector of the only particle of a file.
fn vector(path: &Path, name: &str) -> Vec3 {
    Vec3::from_row_slice(&point_data(&polygons(path)[0], name))
}

#[test]
fn the_forces_in_the_file_of_particles_and_the_weight_are_what_a_particle_is_accelerated_by() {
    let root = tempfile::tempdir().unwrap();
    falling_sphere(root.path(), |setup| setup.plan.output.particles_every = 39);
    let files = OutputFiles::new(root.path().join("out"));
    assert_eq!(vector(&files.file(PARTICLES, 0), "hydrodynamic_force"), Vec3::zeros());
    let [before, after] = [39, 40].map(|step| files.file(PARTICLES, step));
    let mass = 2000.0 * std::f64::consts::PI / 6.0 * 1e-9;
    let times = column(&files.series(), "t (s)");
    let change = (vector(&after, "velocity") - vector(&before, "velocity")) / (times[40] - times[39]);
    let force = vector(&after, "hydrodynamic_force") + mass * Vec3::new(0.0, 0.0, -9.80665);
    assert_eq!(vector(&after, "contact_force"), Vec3::zeros());
    assert!(force.z < 0.0 && (mass * change - force).norm() < 1e-9 * force.norm(), "{change} {force}");
}

#[test]
fn surfaces_are_written_by_default_for_few_particles_and_else_if_asked_for() {
    for (count, options, every) in [
        (312, vec![], 20),
        (313, vec![], 0),
        (313, vec!["output.surfaces_every={ steps = 40 }"], 40),
        (1, vec!["output.surfaces_every=never"], 0),
        (1, vec!["output.particles_every=never"], 0),
    ] {
        let places: Vec<String> = (0..count)
            .map(|i| format!("[{}e-3, {}e-3, {}e-3]", i % 7 + 1, i / 7 % 7 + 1, i / 49 + 1))
            .collect();
        let list = format!("particles.0.list=[{}]", places.join(", "));
        let size = "domain.size={ diameters = [8, 8, 8] }".to_owned();
        let options = options.into_iter().map(str::to_owned).chain([list, size]);
        let setup = turbid::case::from_text(FALLING, "case", &options.collect::<Vec<_>>()).unwrap();
        assert_eq!(setup.plan.output.surfaces_every, every, "{count}");
    }
}

#[test]
fn light_particles_settle_upwards_and_their_velocity_is_positive() {
    let root = tempfile::tempdir().unwrap();
    let summary = falling_sphere(root.path(), |setup| {
        let mut light = setup.templates.to_vec();
        light[0].density = 500.0;
        setup.templates = light.into();
    });
    assert!(summary["settling_velocity_over_stokes"].as_f64().unwrap() > 0.0);
    assert!(summary["mach"].as_f64().unwrap() > 0.0);
}

#[test]
fn in_a_closed_tank_there_is_no_mean_of_the_settling_velocity() {
    let root = tempfile::tempdir().unwrap();
    let summary = falling_sphere(root.path(), close);
    assert!(summary["settling_velocity_over_stokes"].is_null() && summary["drift"].is_null());
    assert!(OutputFiles::new(root.path().join("out")).settling_plot().exists());
}
