//! Claims about what a case resolves to.

use super::*;
use crate::contact::Geometry;
use crate::math::Vec3;

const TEXT: &str = r"
    [domain]
    size = { diameters = [4, 5, 6] }
    [fluid]
    density = 1000
    archimedes = 1000
    [lattice]
    cells_per_diameter = 8
    relaxation_time = 0.55
    [[particles]]
    shape = { sphere = { diameter = 1.5e-3 } }
    density = 3300
    volume_fraction = 0.1
    [run]
    end = { stokes_times = 30 }
";

fn setup(options: &[&str]) -> Setup {
    let options: Vec<String> = options.iter().map(ToString::to_string).collect();
    let source = Source::new("case.toml".to_string(), TEXT.to_string(), &options);
    resolve(&source, "case", Path::new("")).unwrap_or_else(|e| panic!("{e}"))
}

fn close(a: f64, b: f64) {
    assert!((a / b - 1.0).abs() < 1e-12, "{a} is not {b}");
}

#[test]
fn all_ways_to_give_the_viscosity_and_the_time_step_agree() {
    let one = setup(&[]);
    close(
        one.scales.viscosity,
        (9.80665 * 2.3 * 1.5e-3_f64.powi(3) / 1000.0).sqrt(),
    );
    close(
        setup(&["fluid.galileo=31.622776601683793"]).scales.viscosity,
        one.scales.viscosity,
    );
    let two = setup(&[
        &format!("fluid.viscosity={:?}", one.scales.viscosity),
        &format!("lattice.time_step={:?}", one.units.dt),
    ]);
    close(two.scales.archimedes, 1000.0);
    close(two.relaxation_time, 0.55);
}

#[test]
fn the_box_in_metres_is_that_in_diameters_and_any_rounding_is_said() {
    let one = setup(&[]);
    assert_eq!(one.domain.cells, [32, 40, 48]);
    let metres = setup(&["domain.size=[6e-3, 7.5e-3, 9e-3]"]);
    assert_eq!((metres.domain, metres.warnings.len()), (one.domain, 0));
    let rounded = setup(&["domain.size=[6.05e-3, 7.5e-3, 9e-3]"]);
    assert_eq!(rounded.domain, one.domain);
    assert!(
        rounded.warnings[0].contains("32 x 40 x 48"),
        "{}",
        rounded.warnings[0]
    );
}

#[test]
fn lengths_of_time_become_steps() {
    let one = setup(&[]);
    let per_stokes_time = one.scales.stokes_time / one.units.dt;
    assert_eq!(one.end_step, (30.0 * per_stokes_time).round() as u64);
    assert_eq!(one.average_from_step, one.end_step / 3);
    assert_eq!(one.output.fields_every, one.end_step / 5);
    let seconds = format!("run.end.time={:?}", 1000.0 * one.units.dt);
    let two = setup(&[
        &seconds,
        "output.series_every.steps=7",
        "output.fields_every=never",
        "run.average_from.steps=0",
    ]);
    assert_eq!((two.end_step, two.average_from_step), (1000, 0));
    assert_eq!((two.output.series_every, two.output.fields_every), (7, 0));
    assert_eq!(two.output.directory, Path::new("out/case"));
}

#[test]
fn a_case_without_weight_has_no_stokes_time_and_still_resolves() {
    let setup = setup(&["driving.gravity=0", "fluid.viscosity=1e-6", "run.end.steps=10"]);
    assert!(setup.scales.stokes_time.is_infinite() && setup.scales.schiller_naumann_velocity == 0.0);
    assert_eq!(setup.output.picture_every, 1);
}

#[test]
fn kinds_of_particles_share_the_box_without_overlap_and_have_numbers_of_their_own() {
    let kind = "{ shape = { sphere = { diameter = 0.75e-3 } }, density = 2500, count = 40, seed = 5 }";
    let moving = "[[1e-3, 1e-3, 1e-3], { position = [3e-3, 3e-3, 9e-3], velocity = [0, 0, -0.1], \
                  angular_velocity = [2, 0, 0] }]";
    let listed = format!("{{ shape.sphere.diameter = 1.5e-3, density = 3300, list = {moving} }}");
    let setup = setup(&[&format!("particles=[{listed}, {kind}]")]);
    assert_eq!(setup.particles.len(), 42);
    for (i, p) in setup.particles.iter().enumerate() {
        assert_eq!((p.id, p.template), (i as u64, u64::from(i >= 2)));
        let radius =
            |p: &crate::particle::Particle| setup.templates[p.template as usize].shape.circumradius();
        for q in &setup.particles[..i] {
            let apart = setup.domain.nearest_image(p.position() - q.position()).norm();
            assert!(apart > radius(p) + radius(q));
        }
    }
    let spinning = &setup.particles[1];
    close(spinning.angular_momentum[0], 2.0 * setup.templates[0].inertia().x);
    assert_eq!(spinning.velocity(), Vec3::new(0.0, 0.0, -0.1));
    let offset = setup
        .domain
        .nearest_image(spinning.position() - Vec3::new(3e-3, 3e-3, 0.0));
    assert!(offset.norm() < 1e-12, "the upper face is the lower one");
}

#[test]
fn contacts_can_be_left_out_and_are_those_of_the_paper_otherwise() {
    assert!(setup(&["contact.enabled=false"]).contact.is_none());
    let contact = setup(&["contact.geometry=sampled"]).contact.unwrap();
    assert_eq!(contact.geometry, Geometry::Sampled { samples: 8 });
    close(contact.enlargement, 0.2 * 1.5e-3 / 8.0);
    close(contact.pairs[0].restitution, 0.926);
}
