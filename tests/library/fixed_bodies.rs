//! Flow through fixed bodies: drag without buoyancy, and what the summary makes of it.

use crate::common::in_tree;
use turbid::case;
use turbid::output::{OutputFiles, SeriesTable, Summary};
use turbid::simulation::{self, RunOptions, Simulation};

/// Drag factor of a simple-cubic array at the volume fraction 0.125, doi:10.1017/S0022112082000627.
const ZICK_HOMSY: f64 = 4.292;

/// The array of `cases/sphere_array.toml` with half the resolution, averaged over the end of the run.
fn array(options: &[&str]) -> (SeriesTable, Summary) {
    let place = tempfile::tempdir().unwrap();
    let path = in_tree("cases/sphere_array.toml");
    let usual = ["lattice.cells_per_diameter=6.2035", "run.average_from.time=0.12"];
    let never = ["fields", "particles", "picture"].map(|kind| format!("output.{kind}_every=\"never\""));
    let options = usual.iter().chain(options).map(ToString::to_string).chain(never);
    let mut setup = case::load(&path, &options.collect::<Vec<_>>()).unwrap_or_else(|e| panic!("{e}"));
    setup.plan.output.directory = place.path().join("out");
    let summary = simulation::run(&setup, &RunOptions::default()).unwrap().unwrap();
    (SeriesTable::read(&OutputFiles::new(&setup.plan.output.directory).series()).unwrap(), summary)
}

fn last(series: &SeriesTable, name: &str) -> f64 {
    *series.get(name).unwrap_or_else(|| panic!("{name}")).last().unwrap()
}

#[test]
fn the_drag_on_fixed_bodies_is_the_same_with_and_without_gravity() {
    let [(with, heavy), (without, light)] =
        ["driving.gravity=9.80665", "driving.gravity=0.0"].map(|gravity| array(&[gravity]));
    let [of, to] = [&with, &without].map(|series| last(series, "drag_particles.0_z"));
    assert!((of / to - 1.0).abs() < 1e-6 && to > 1e-7, "{of} {to}");
    let buoyancy = 1000.0 * 9.80665 * 0.125 * 64e-9;
    let more = last(&with, "hydrodynamic_force_particles.0_z") - of;
    assert!((more / buoyancy - 1.0).abs() < 1e-3, "{more} {buoyancy}");
    assert_eq!(
        heavy.drag_over_stokes.map(|k| (1e6 * k).round()),
        light.drag_over_stokes.map(|k| (1e6 * k).round())
    );
}

#[test]
fn the_summary_of_an_array_has_the_drag_of_the_literature_and_its_permeability() {
    let (_, summary) = array(&[]);
    let factor = summary.drag_over_stokes.unwrap();
    assert!((factor / ZICK_HOMSY - 1.0).abs() < 0.03, "{factor}");
    // In the steady state the drag of all bodies is the mean pressure gradient times the volume.
    let drag = summary.drag.unwrap();
    assert!((drag / (1000.0 * 2e-3 * 64e-9) - 1.0).abs() < 1e-2, "{drag}");
    let [from, to] = summary.averaged_over_time.unwrap();
    assert!((from - 0.12).abs() < 2e-3 && (to - 0.15).abs() < 2e-3, "{from} {to}");
    // Darcy's law: k = V / (n 6 pi R K).
    let permeability = 8e-9 / (3.0 * std::f64::consts::PI * 1.2407e-3 * factor);
    assert!((summary.permeability.unwrap() / permeability - 1.0).abs() < 1e-2, "{:?}", summary.permeability);
    assert!(summary.superficial_velocity_standard_error.is_some() && summary.drift.unwrap().abs() < 0.01);
}

#[test]
fn fixed_bodies_in_a_gravity_field_are_said_to_have_buoyancy_in_the_force_of_the_fluid() {
    let path = in_tree("cases/sphere_array.toml");
    let notes = |gravity: &str| case::load(&path, &[gravity.to_string()]).unwrap().provenance.notes;
    let said = notes("driving.gravity=9.80665");
    assert!(said.len() == 1 && said[0].contains("`particles.0`") && said[0].contains("`drag`"), "{said:?}");
    assert!(notes("driving.gravity=0.0").is_empty());
}

#[test]
fn the_drag_on_a_square_array_of_endless_cylinders_is_that_of_the_literature_along_each_axis() {
    // Force per length over viscosity and superficial velocity, Sangani and Acrivos (1982), doi:10.1016/0301-9322(82)90029-5.
    for (fraction, expected, axis) in [(0.2_f64, 51.53, "z"), (0.2, 51.53, "x"), (0.4, 217.89, "y")] {
        let cells = 24.0_f64;
        let diameter = cells * 2.0 * (fraction / std::f64::consts::PI).sqrt();
        let along = ["x", "y", "z"].iter().position(|name| *name == axis).unwrap();
        let flow = (along + 1) % 3;
        let (mut size, mut drive) = ([cells * 1e-4; 3], [0.0; 3]);
        (size[along], drive[flow]) = (4e-4, 1e-3);
        let text = format!(
            "domain.size = {size:?}\n\
             fluid = {{ density = 1000, viscosity = 1e-5, precision = \"f64\" }}\n\
             lattice = {{ cells_per_diameter = 10, relaxation_time = 0.8 }}\n\
             driving = {{ gravity = 0, force_balance = \"fluid_only\", zero_net_flux = false, body_acceleration = {drive:?} }}\n\
             run.end.steps = 6000\n\
             [[particles]]\n\
             shape.sphere.diameter = 1e-3\n\
             density = 1000\n\
             count = 0\n\
             [[particles]]\n\
             shape.cylinder = {{ diameter = {:e}, length = 4e-4 }}\n\
             density = 1000\n\
             through = \"{axis}\"\n\
             motion = \"fixed\"\n\
             list = [[1e-4, 2e-4, 3e-4]]\n",
            diameter * 1e-4
        );
        let setup = case::from_text(&text, "cylinders", &[]).unwrap_or_else(|e| panic!("{e}"));
        assert!((setup.volume_fraction - fraction).abs() < 1e-6, "{}", setup.volume_fraction);
        let mut run = Simulation::solo(&setup).unwrap();
        run.advance(6000).unwrap();
        let velocity = run.mean_flow().velocity[flow];
        let drag = 1e-3 * (cells * 1e-4).powi(2) / (1e-5 * velocity);
        println!("{fraction} along {axis}: {drag:.2} for {expected}");
        assert!((drag / expected - 1.0).abs() < 0.02, "{fraction} along {axis}: {drag} for {expected}");
    }
}

#[test]
fn a_free_disc_settles_in_a_square_cell_as_the_drag_of_the_literature_says_upright_and_without_turning() {
    // Force per length over viscosity and velocity, with no net flux: Sangani and Acrivos (1982) as above, by the superficial velocity.
    let (cells, fraction, expected) = (24.0_f64, 0.2_f64, 51.53);
    let diameter = cells * 2.0 * (fraction / std::f64::consts::PI).sqrt() * 1e-4;
    let text = format!(
        "domain.size = [{0}, {0}, 4e-4]\n\
         fluid = {{ density = 1000, viscosity = 1e-5, precision = \"f64\" }}\n\
         lattice = {{ cells_per_diameter = 10, relaxation_time = 0.8 }}\n\
         driving = {{ gravity = [1e-3, 0, 0], force_balance = \"mixture\", zero_net_flux = true }}\n\
         run.end.steps = 6000\n\
         [[particles]]\n\
         shape.sphere.diameter = 1e-3\n\
         density = 1000\n\
         count = 0\n\
         [[particles]]\n\
         shape.cylinder = {{ diameter = {diameter:e}, length = 4e-4 }}\n\
         density = 2000\n\
         through = \"z\"\n\
         list = [[1e-4, 2e-4, 3e-4]]\n",
        cells * 1e-4
    );
    let setup = case::from_text(&text, "disc", &[]).unwrap_or_else(|e| panic!("{e}"));
    let mut run = Simulation::solo(&setup).unwrap();
    run.advance(6000).unwrap();
    let disc = run.particles()[0];
    // Weight less buoyancy per length, the force that drives the fluid of an array at rest, too.
    let weight = 1000.0 * 1e-3 * std::f64::consts::PI / 4.0 * diameter * diameter;
    let drag = weight / (1000.0 * 1e-5 * disc.velocity[0]);
    println!("{drag:.2} for {expected}");
    assert!((drag / expected - 1.0).abs() < 0.02, "{drag} for {expected}");
    assert!(disc.angular_velocity[0].abs().max(disc.angular_velocity[1].abs()) < 1e-15);
    assert!(disc.velocity[1].abs().max(disc.velocity[2].abs()) < 1e-6 * disc.velocity[0]);
}
