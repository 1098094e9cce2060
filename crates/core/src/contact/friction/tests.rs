//! Claims about friction with a spring.

use super::*;
use crate::contact::tests::{random, random_direction};
use crate::contact::{ContactModel, DampingLaw, PairLaw, sphere_sphere};
use rand::Rng;
use std::f64::consts::{FRAC_PI_2, LN_2, PI};

const RADIUS: f64 = 1e-3;
const PAIR: PairProperties = PairProperties { radii: [RADIUS; 2], masses: [1e-5; 2], dt: 1e-6 };
const GLASS: Material = Material { youngs_modulus: 5e6, poisson_ratio: 0.25 };

fn law(friction: FrictionLaw, restitution: f64) -> PairLaw {
    let pair = PairParams {
        restitution,
        friction_static: 0.5,
        friction_kinetic: 0.3,
        transition_velocity: 1e-3,
        rolling_friction: 0.0,
        work_of_adhesion: 0.0,
        cohesion_density: 0.0,
    };
    let model = ContactModel {
        materials: vec![GLASS],
        pairs: vec![pair],
        law: ElasticLaw::Hertz,
        damping: DampingLaw::Tsuji,
        friction,
        ..ContactModel::default()
    };
    PairLaw::new(&model, 0, 0)
}

/// A contact across x of a depth (m).
fn lens(depth: f64) -> Overlap {
    sphere_sphere::overlap(RADIUS, RADIUS, Vec3::x() * (2.0 * RADIUS - depth)).unwrap()
}

/// The first body slides by `way` (m) in a sub-step.
fn slide(way: Vec3) -> RelativeMotion {
    let before = way / PAIR.dt;
    RelativeMotion { velocity: before, before, elapsed: PAIR.dt, ..RelativeMotion::default() }
}

/// Force (N) on the first body across the normal.
fn held(law: &PairLaw, depth: f64, motion: &RelativeMotion, memory: &mut [f64]) -> Vec3 {
    let offset = Vec3::x() * (2.0 * RADIUS - depth);
    let force = law.act(&lens(depth), offset, &PAIR, motion, memory).force;
    Vec3::new(0.0, force.y, force.z)
}

/// Normal force (N) and `8 G* a` (N/m) at a depth (m).
fn stiffness(depth: f64) -> [f64; 2] {
    let radius = 0.5 * RADIUS;
    let modulus = 5e6 / (2.0 * (1.0 - 0.0625));
    // G / (2 (2 - nu)), G = E / (2 (1 + nu)).
    let shear = 5e6 / (4.0 * 1.25 * 1.75);
    [4.0 / 3.0 * modulus * radius.sqrt() * depth.powf(1.5), 8.0 * shear * (radius * depth).sqrt()]
}

#[test]
fn a_contact_that_sticks_is_a_spring_of_mindlins_stiffness_and_lets_go_where_the_way_is_undone() {
    let depth = 1e-6;
    let [_, k] = stiffness(depth);
    for friction in [FrictionLaw::Mindlin, FrictionLaw::MindlinDisplacement] {
        let (law, mut memory) = (law(friction, 1.0), [0.0; 4]);
        let way = Vec3::new(0.0, 3e-9, -4e-9);
        for n in 1..=3 {
            let force = held(&law, depth, &slide(way), &mut memory);
            assert!((force + way * (k * f64::from(n))).norm() < 1e-12 * k * way.norm(), "{friction:?}");
        }
        let force = held(&law, depth, &slide(way * -3.0), &mut memory);
        assert!(force.norm() < 1e-12 * k * way.norm());
    }
}

#[test]
fn a_contact_sticks_up_to_the_static_coefficient_and_slides_with_the_kinetic_one_until_it_turns_round() {
    let depth = 1e-6;
    let [normal, k] = stiffness(depth);
    let (law, mut memory) = (law(FrictionLaw::Mindlin, 1.0), [0.0; 4]);
    let mut pull =
        |part: f64| held(&law, depth, &slide(Vec3::y() * (part * normal / k)), &mut memory).y / normal;
    let same = |value: f64, expected: f64| assert!((value - expected).abs() < 1e-12, "{value} {expected}");
    same(pull(0.499), -0.499);
    same(pull(0.01), -0.3);
    same(pull(0.05), -0.3);
    same(pull(-0.1), -0.2);
    same(pull(0.25), -0.45);
    same(pull(0.1), -0.3);
}

#[test]
fn the_spring_of_liggghts_has_one_coefficient_and_no_dashpot_where_it_slides() {
    let depth = 1e-6;
    let [normal, k] = stiffness(depth);
    let (law, mut memory) = (law(FrictionLaw::MindlinDisplacement, 0.5), [0.0; 4]);
    let normal_force =
        |motion: &RelativeMotion, memory: &mut [f64]| held(&law, depth, motion, memory).y / normal;
    let sticks = normal_force(&slide(Vec3::y() * (0.2 * normal / k)), &mut memory);
    assert!(sticks < -0.2 - 1e-3, "with its dashpot: {sticks}");
    let slides = normal_force(&slide(Vec3::y() * (0.2 * normal / k)), &mut memory);
    assert!((slides + 0.3).abs() < 1e-12, "{slides}");
}

#[test]
fn no_cycle_of_loads_and_slips_gains_energy_but_one_of_the_spring_of_liggghts_may() {
    let spring_of_liggghts = law(FrictionLaw::MindlinDisplacement, 1.0);
    let (mut random, law) = (random(5), law(FrictionLaw::Mindlin, 1.0));
    let mut least = f64::INFINITY;
    for _ in 0..300 {
        let (mut memory, mut work, mut slid) = ([0.0; 4], 0.0, Vec3::zeros());
        let mut depth = 1e-6_f64;
        for step in 0..200 {
            let turn = if step % 20 == 19 { random.random_range(0.2..5.0) } else { 1.0 };
            depth = (depth * turn).clamp(1e-8, 1e-5);
            let way = if step == 199 { -slid } else { random_direction(&mut random) * 2e-9 };
            let way = Vec3::new(0.0, way.y, way.z);
            slid += way;
            work -= held(&law, depth, &slide(way), &mut memory).dot(&way);
        }
        least = least.min(work);
    }
    println!("least work of a cycle: {least:.2e} J");
    assert!(least >= 0.0);
    // Slid by s, then loaded: it comes back with the greater stiffness.
    let law = spring_of_liggghts;
    let (mut memory, way) = ([0.0; 4], Vec3::y() * 1e-9);
    let there = held(&law, 1e-7, &slide(way), &mut memory).y;
    let back = held(&law, 4e-7, &slide(Vec3::zeros()), &mut memory).y;
    assert!((back / there - 2.0).abs() < 1e-9, "the same way, twice the force");
}

#[test]
fn a_spring_turns_with_the_bodies_as_one_rigid_body_does() {
    for friction in [FrictionLaw::Mindlin, FrictionLaw::MindlinDeresiewicz] {
        let (law, mut memory, depth) = (law(friction, 1.0), [0.0; 11], 1e-6);
        held(&law, depth, &slide(Vec3::zeros()), &mut memory);
        let start = held(&law, depth, &slide(Vec3::y() * 1e-9), &mut memory);
        let (axis, steps) = (Vec3::new(0.6, 0.48, 0.64), 1000);
        let spin = axis * (FRAC_PI_2 / (f64::from(steps) * PAIR.dt));
        let turn = |angle: f64| crate::math::Quat::from_scaled_axis(axis * angle);
        for n in 1..=steps {
            let turned = turn(FRAC_PI_2 * f64::from(n) / f64::from(steps));
            let mut overlap = lens(depth);
            overlap.normal = turned * overlap.normal;
            overlap.point = turned * overlap.point;
            let offset = turned * (Vec3::x() * (2.0 * RADIUS - depth));
            let motion = RelativeMotion { spin, elapsed: PAIR.dt, ..RelativeMotion::default() };
            let action = law.act(&overlap, offset, &PAIR, &motion, &mut memory);
            if n == steps {
                let across = action.force - overlap.normal * action.force.dot(&overlap.normal);
                let off = (across - turned * start).norm() / start.norm();
                println!("{friction:?}: a quarter turn in {steps} steps: the force is off by {off:.1e}");
                assert!(start.norm() > 0.0 && off < 2e-3);
            }
        }
    }
}

#[test]
fn a_contact_that_slips_at_its_edge_has_mindlins_stiffness_at_first_and_slides_with_the_kinetic_coefficient()
{
    let depth = 1e-6;
    let [normal, k] = stiffness(depth);
    let (law, mut memory) = (law(FrictionLaw::MindlinDeresiewicz, 1.0), [0.0; 11]);
    held(&law, depth, &slide(Vec3::zeros()), &mut memory);
    let mut pull =
        |part: f64| held(&law, depth, &slide(Vec3::y() * (part * normal / k)), &mut memory).y / normal;
    assert!((pull(1e-6) / -1e-6 - 1.0).abs() < 1e-4);
    // Cattaneo and Mindlin, at half the way of 1.5 mu N / k after which it slides.
    assert!((pull(0.225 - 1e-6) + 0.3 * (1.0 - 0.5_f64.powf(1.5))).abs() < 1e-5);
    assert!((pull(0.3) + 0.3).abs() < 1e-9);
}

#[test]
fn the_radius_of_a_contact_is_that_of_hertz_for_spheres_and_of_the_area_for_a_flat_face() {
    let depth = 1e-8;
    let hertz = (0.5 * RADIUS * depth).sqrt();
    for elastic in [ElasticLaw::Hertz, ElasticLaw::OverlapVolume, ElasticLaw::OverlapEnergy] {
        let radius = contact_radius(&lens(depth), elastic, &PAIR);
        assert!((radius / hertz - 1.0).abs() < 1e-5, "{elastic:?} {radius}");
    }
    let face = Overlap { volume: 4e-6 * depth, area: 4e-6, depth, ..lens(depth) };
    let radius = contact_radius(&face, ElasticLaw::OverlapVolume, &PAIR);
    assert!((radius / (4e-6 * FRAC_1_PI).sqrt() - 1.0).abs() < 1e-14);
    let nothing = Overlap { volume: 0.0, depth: 0.0, ..face };
    assert!(contact_radius(&nothing, ElasticLaw::OverlapVolume, &PAIR).abs() < 1e-300);
}

#[test]
fn a_dashpot_is_beside_the_spring_but_both_together_never_exceed_coulombs_force() {
    let (depth, restitution) = (1e-6, 0.5);
    let [normal, k] = stiffness(depth);
    let (elastic, damped) = (law(FrictionLaw::Mindlin, 1.0), law(FrictionLaw::Mindlin, restitution));
    let b = LN_2 / PI.hypot(LN_2);
    let dashpot = 2.0 * (5.0 / 6.0_f64).sqrt() * b * (k * 0.5e-5).sqrt();
    let way = Vec3::y() * (0.001 * normal / k);
    let forces = [&elastic, &damped].map(|law| held(law, depth, &slide(way), &mut [0.0; 4]).y);
    assert!(((forces[0] - forces[1]) / (dashpot * way.y / PAIR.dt) - 1.0).abs() < 1e-6);
    let fast = slide(Vec3::y() * (0.4 * normal / k));
    let held = held(&damped, depth, &fast, &mut [0.0; 4]).y;
    assert!((held / normal + 0.5).abs() < 1e-12, "{held}");
}

/// Way (m) in each of some cycles in which the depth swings by a part about its mean, of a contact under a constant force (N) along its surface.
fn creep(friction: FrictionLaw, (mean, part): (f64, f64), load: f64, cycles: usize) -> Vec<f64> {
    let (law, mut memory) = (law(friction, 1.0), [0.0; 11]);
    let steps = 2000;
    let mut depth = mean;
    // The way at which the spring bears the load: by the secant of a spring of the present stiffness.
    let settle = |depth: f64, memory: &mut [f64]| {
        let mut way = 0.0;
        let [_, k] = stiffness(depth);
        held(&law, depth, &slide(Vec3::zeros()), memory);
        for _ in 0..40 {
            let next = (load + held(&law, depth, &slide(Vec3::zeros()), memory).y) / k;
            held(&law, depth, &slide(Vec3::y() * next), memory);
            way += next;
        }
        way
    };
    settle(depth, &mut memory);
    (0..cycles)
        .map(|_| {
            (0..steps)
                .map(|step| {
                    let turn = 2.0 * PI * f64::from(step + 1) / f64::from(steps);
                    depth = mean * (1.0 + part * turn.sin());
                    settle(depth, &mut memory)
                })
                .sum()
        })
        .collect()
}

#[test]
fn a_loaded_contact_creeps_in_each_cycle_of_its_normal_force_unless_it_slips_at_its_edge() {
    let (depth, part) = (1e-6, 0.1);
    let [normal, k] = stiffness(depth);
    // Half of what makes it slide.
    let load = 0.5 * 0.3 * normal;
    let ways = creep(FrictionLaw::Mindlin, (depth, part), load, 3);
    // Each unloading takes its part of the force: T / (8 G*) (1 / a_least - 1 / a_largest).
    let [low, high] = [1.0 - part, 1.0 + part].map(|at: f64| 1.0 / at.sqrt());
    let expected = load / k * (low - high);
    println!(
        "per cycle: {:.4e} m, expected {expected:.4e} m, {:.4} of mu N / k",
        ways[1],
        expected * k / (0.3 * normal)
    );
    for way in &ways[1..] {
        assert!((way / expected - 1.0).abs() < 0.01);
    }
    let ways = creep(FrictionLaw::MindlinDeresiewicz, (depth, part), load, 3);
    println!("with slip at the edge: {:.2e} m", ways[2]);
    assert!(ways[2].abs() < 0.02 * expected, "{ways:?}");
}
