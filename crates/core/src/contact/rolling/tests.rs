//! Claims about torques of contacts.

use super::*;
use crate::contact::{DampingLaw, ElasticLaw, FrictionLaw, Material, PairLaw, sphere_sphere};

const RADIUS: f64 = 1e-3;
const DEPTH: f64 = 1e-6;
const PAIR: PairProperties = PairProperties { radii: [RADIUS; 2], masses: [1e-5; 2], dt: 1e-6 };
const MU: f64 = 0.1;

fn law(rolling: RollingLaw, twisting: TwistingLaw) -> (PairLaw, Vec<f64>) {
    let model = ContactModel {
        materials: vec![Material { youngs_modulus: 5e6, poisson_ratio: 0.25 }],
        pairs: vec![PairParams {
            restitution: 1.0,
            friction_static: 0.5,
            friction_kinetic: 0.3,
            transition_velocity: 1e-3,
            rolling_friction: MU,
            ..PairParams::default()
        }],
        law: ElasticLaw::Hertz,
        damping: DampingLaw::Tsuji,
        friction: FrictionLaw::Mindlin,
        rolling,
        twisting,
        ..ContactModel::default()
    };
    (PairLaw::new(&model, 0, 0), vec![0.0; model.memory()])
}

/// Torque (N m) on the first of two spheres along x that turns by `angle` (rad) in a sub-step.
fn held(law: &PairLaw, angle: Vec3, memory: &mut [f64]) -> Vec3 {
    let offset = Vec3::x() * (2.0 * RADIUS - DEPTH);
    let overlap = sphere_sphere::overlap(RADIUS, RADIUS, offset).unwrap();
    let turning = angle / PAIR.dt;
    let motion = RelativeMotion { turning, elapsed: PAIR.dt, ..RelativeMotion::default() };
    let action = law.act(&overlap, offset, &PAIR, &motion, memory);
    assert!((action.torques[0] + action.torques[1]).norm() <= 1e-15 * action.torques[0].norm(), "opposite");
    action.torques[0]
}

/// Normal force (N).
fn normal() -> f64 {
    4.0 / 3.0 * 5e6 / (2.0 * (1.0 - 0.0625)) * (0.5 * RADIUS).sqrt() * DEPTH.powf(1.5)
}

#[test]
fn a_constant_torque_is_mu_r_times_the_normal_force_against_the_rolling_and_leaves_twisting_alone() {
    let (law, mut memory) = law(RollingLaw::ConstantTorque, TwistingLaw::None);
    let torque = held(&law, Vec3::new(5.0, 3e-9, -4e-9), &mut memory);
    let expected = Vec3::new(0.0, -0.6, 0.8) * (MU * 0.5 * RADIUS * normal());
    assert!((torque - expected).norm() < 1e-12 * expected.norm(), "{torque} {expected}");
}

#[test]
fn a_rolling_spring_winds_up_with_the_stiffness_of_ai_and_gives_way_at_mu_r_times_the_normal_force() {
    let (law, mut memory) = law(RollingLaw::ElasticPlastic, TwistingLaw::None);
    let arm = MU * 0.5 * RADIUS;
    let (stiffness, most) = (2.25 * arm * arm * normal() / DEPTH, arm * normal());
    let dashpot = 0.6 * (0.5 * 1.4 * 1e-5 * RADIUS * RADIUS * stiffness).sqrt();
    let angle = 0.4 * most / stiffness;
    let torque = held(&law, Vec3::y() * angle, &mut memory).y;
    let expected = -(0.4 * most + dashpot * angle / PAIR.dt);
    assert!((torque / expected - 1.0).abs() < 1e-9, "{torque} {expected}");
    let still = held(&law, Vec3::zeros(), &mut memory).y;
    assert!((still / most + 0.4).abs() < 1e-9, "it holds: {still}");
    let rolls = held(&law, Vec3::y() * (2.0 * angle), &mut memory).y;
    assert!((rolls / most + 1.0).abs() < 1e-12, "{rolls}");
    let back = held(&law, Vec3::zeros(), &mut memory).y;
    assert!((back / most + 1.0).abs() < 1e-12, "wound up to the limit and no further: {back}");
}

#[test]
fn a_twisting_spring_has_half_the_square_of_the_contact_radius_times_that_of_friction() {
    let (law, mut memory) = law(RollingLaw::None, TwistingLaw::Marshall);
    let radius = (0.5 * RADIUS * DEPTH).sqrt();
    let stiffness = 8.0 * 5e6 / (4.0 * 1.25 * 1.75) * radius;
    let most = 2.0 / 3.0 * radius * 0.3 * normal();
    let angle = 0.4 * most / (0.5 * stiffness * radius * radius);
    let torque = held(&law, Vec3::x() * angle, &mut memory).x;
    assert!((torque / most + 0.4).abs() < 1e-9, "{torque}");
    let slips = held(&law, Vec3::x() * (2.0 * angle), &mut memory).x;
    assert!((slips / most + 1.0).abs() < 1e-9, "{slips}");
}
