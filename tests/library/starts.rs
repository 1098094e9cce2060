//! Flows with which a run starts, and constant forces.

use turbid::case::from_text;
use turbid::math::Vec3;
use turbid::simulation::Simulation;

/// A fluid in cells of 0.1 mm with a viscosity of 1e-6 m^2/s, and the rest of its case.
fn simulation(fluid: &str, rest: &str, options: &[&str]) -> Simulation {
    let text = format!(
        "domain = {{ size = [3.2e-3, 3.2e-3, 8e-4] }}\n\
         fluid = {{ density = 1000, viscosity = 1e-6, precision = \"f64\"{fluid} }}\n\
         lattice = {{ cells_per_diameter = 4, relaxation_time = 0.8 }}\n\
         run.end.steps = 100\n{rest}\n"
    );
    let options: Vec<String> = options.iter().map(ToString::to_string).collect();
    let setup = from_text(&text, "start", &options).unwrap_or_else(|e| panic!("{e}"));
    Simulation::solo(&setup).unwrap_or_else(|e| panic!("{e}"))
}

const NONE: &str =
    "driving.gravity = 0\nparticles = [{ shape.sphere.diameter = 4e-4, density = 1000, list = [] }]";

#[test]
fn vortices_start_with_their_stress_and_decay_at_the_viscous_rate_from_the_first_step() {
    let mut run = simulation(", start = { taylor_green = { velocity = 2e-3 } }", NONE, &[]);
    let start = run.measure().mean.kinetic_energy;
    let exact = 1000.0 * 3.2e-3 * 3.2e-3 * 8e-4 * 4e-6 / 4.0;
    assert!((start / exact - 1.0).abs() < 1e-6, "{start} is not {exact}");
    let wave = std::f64::consts::TAU / 3.2e-3;
    for _ in 0..10 {
        run.step().unwrap();
        let decayed = (-4.0 * 1e-6 * wave * wave * run.time()).exp();
        // Without its stress the energy is off by 1 % from the third step on.
        let off = run.measure().mean.kinetic_energy / start / decayed - 1.0;
        assert!(off.abs() < 2e-4, "{off} after {} steps", run.steps_done());
    }
}

#[test]
fn a_flow_between_plates_that_starts_as_it_is_driven_stays_as_it_is() {
    let rest = format!("{NONE}\ndriving.body_acceleration = [1.2e-2, 0, 0]");
    // U = a H^2 / (12 nu).
    let start = ", start = { poiseuille = { velocity = [6.4e-4, 0, 0] } }";
    let mut run = simulation(start, &rest, &["domain.periodic=[true, true, false]"]);
    for _ in 0..20 {
        run.step().unwrap();
        let flux = run.measure().mean.velocity.x;
        // The mean over 8 cells of a parabola is 0.8 % more than that of the curve; with half an acceleration it would be 1.7 %.
        assert!((flux / 6.4e-4 - 1.0).abs() < 0.01, "{flux} after {} steps", run.steps_done());
    }
}

#[test]
fn a_force_moves_a_body_as_its_weight_does_and_a_torque_turns_it() {
    let body = |more: &str| {
        format!(
            "particles = [{{ shape.sphere.diameter = 4e-4, density = 2000, list = [[1e-3, 1e-3, 4e-4]]{more} }}]"
        )
    };
    let drive = "driving = { zero_net_flux = false, gravity =";
    let weight = simulation("", &format!("{}\n{drive} [0.5, 0, 0] }}", body("")), &[]);
    let excess = 1000.0 * std::f64::consts::PI / 6.0 * 6.4e-11;
    let force = body(&format!(", force = [{:e}, 0, 0]", 0.5 * excess));
    let [weight, force, torque] = [
        weight,
        simulation("", &format!("{force}\n{drive} 0 }}"), &[]),
        simulation("", &format!("{}\n{drive} 0 }}", body(", torque = [0, 0, 1e-12]")), &[]),
    ]
    .map(|mut run| {
        run.advance(100).unwrap();
        run.particles()[0]
    });
    assert!(weight.velocity().x > 1e-4, "{}", weight.velocity());
    let difference = weight.velocity() - force.velocity();
    assert!(difference.norm() < 1e-9 * weight.velocity().norm(), "{difference}");
    // Near that of Stokes, T / (8 pi mu R^3).
    let spin = torque.angular_velocity();
    let stokes = 1e-12 / (8.0 * std::f64::consts::PI * 1e-3 * 8e-12);
    assert!(spin.z > 0.5 * stokes && spin.z < 1.2 * stokes, "{spin}");
    assert!((spin - Vec3::z() * spin.z).norm() < 1e-3 * spin.z);
}
