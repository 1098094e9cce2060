//! Claims about the contact force.

use super::*;
use crate::contact::{ContactParams, FrictionLaw, Geometry, PairParams, sphere_sphere};

impl PairLaw {
    /// Normal force (N), positive if it pushes the bodies apart.
    fn normal_force(&self, overlap: &Overlap, pair: &PairProperties, damping: f64, approach: f64) -> f64 {
        self.normal(overlap, pair, damping, approach)[0]
    }
}

const GLASS: ContactParams = ContactParams {
    material: Material { youngs_modulus: 5e6, poisson_ratio: 0.25 },
    pair: PairParams {
        restitution: 0.5,
        friction_static: 0.32,
        friction_kinetic: 0.16,
        transition_velocity: 1e-3,
        rolling_friction: 0.0,
        work_of_adhesion: 0.0,
        cohesion_density: 0.0,
    },
    enlargement: 0.0,
    geometry: Geometry::Exact,
    law: ElasticLaw::OverlapVolume,
    damping: DampingLaw::HuntCrossley,
};

/// The spheres of [`lens`].
const EQUAL: PairProperties = PairProperties { radii: [1e-3; 2], masses: [1e-5; 2], dt: 1e-9 };

/// Bodies of these radii (m) and of unlike masses.
fn pair(radii: [f64; 2]) -> PairProperties {
    PairProperties { radii, masses: [1e-5, if radii[1] < 1.0 { 3e-5 } else { f64::INFINITY }], dt: 1e-9 }
}

fn law() -> PairLaw {
    PairLaw::new(&GLASS.into(), 0, 0)
}

fn energy_law() -> PairLaw {
    let law = ElasticLaw::OverlapEnergy;
    PairLaw::new(&ContactParams { law, ..GLASS }.into(), 0, 0)
}

fn hertz(damping: DampingLaw) -> PairLaw {
    let law = ElasticLaw::Hertz;
    PairLaw::new(&ContactParams { law, damping, ..GLASS }.into(), 0, 0)
}

/// A steady velocity (m/s).
fn moving(velocity: Vec3) -> RelativeMotion {
    RelativeMotion { velocity, before: velocity, elapsed: 1e-9, ..RelativeMotion::default() }
}

/// Force on the first of two spheres.
fn force(overlap: &Overlap, velocity: Vec3) -> Vec3 {
    let offset = Vec3::new(2e-3 - overlap.depth, 0.0, 0.0);
    law().act(overlap, offset, &EQUAL, &moving(velocity), &mut [UNSET]).force
}

fn lens(depth: f64) -> Overlap {
    sphere_sphere::overlap(1e-3, 1e-3, Vec3::new(2e-3 - depth, 0.0, 0.0)).unwrap()
}

#[test]
fn a_static_force_is_the_lens_law() {
    let (radius, depth): (f64, f64) = (1e-3, 1e-4);
    let distance = 2.0 * radius - depth;
    let d = 2.0 * radius - distance;
    let volume = PI * d * d * (distance + 4.0 * radius) / 12.0;
    let modulus = 5e6 / (2.0 * (1.0 - 0.0625));
    let expected = 4.0 / (3.0 * PI.sqrt()) * modulus * (volume * d).sqrt();
    let force = force(&lens(depth), Vec3::zeros());
    println!("off the lens law by {:.1e}", -force.x / expected - 1.0);
    assert!((-force.x / expected - 1.0).abs() < 1e-12);
    assert!(force.y.abs() + force.z.abs() < 1e-30);
}

#[test]
fn a_small_overlap_of_spheres_follows_hertz() {
    for (depth, tolerance) in [(1e-6, 1e-3), (1e-8, 1e-5)] {
        let hertz: f64 = 4.0 / 3.0 * law().modulus * (0.5e-3_f64).sqrt() * f64::powf(depth, 1.5);
        for law in [law(), energy_law()] {
            let force = law.normal_force(&lens(depth), &EQUAL, UNSET, 0.0);
            println!("depth {depth:e} m: off Hertz by {:.1e}", force / hertz - 1.0);
            assert!((force / hertz - 1.0).abs() < tolerance, "{}", force / hertz);
        }
    }
}

/// Height of the cap that a plane cuts off a sphere (m).
fn cap(radius: f64, depth: f64) -> Overlap {
    Overlap {
        volume: PI * depth * depth * (3.0 * radius - depth) / 3.0,
        depth,
        point: Vec3::z() * -radius,
        normal: -Vec3::z(),
        area: PI * depth * (2.0 * radius - depth),
        moment: Vec3::zeros(),
    }
}

#[test]
fn a_small_cap_cut_off_by_a_wall_follows_hertz_by_all_laws() {
    let (radius, depth): (f64, f64) = (1e-3, 1e-8);
    for law in [law(), energy_law(), hertz(DampingLaw::Tsuji)] {
        let hertz = 4.0 / 3.0 * law.modulus * radius.sqrt() * f64::powf(depth, 1.5);
        let pair = pair([radius, f64::INFINITY]);
        let force = law.normal_force(&cap(radius, depth), &pair, UNSET, 0.0);
        assert!((force / hertz - 1.0).abs() < 1e-5, "{}", force / hertz);
    }
}

#[test]
fn the_hertz_law_is_the_closed_form_of_the_depth_for_equal_and_unlike_spheres_and_planes() {
    let soft = Material { youngs_modulus: 1e4, poisson_ratio: 0.4 };
    let mut model = ContactModel::from(ContactParams { law: ElasticLaw::Hertz, ..GLASS });
    model.materials.push(soft);
    model.pairs = vec![GLASS.pair; 4];
    let mut off = 0.0_f64;
    for (radii, radius) in
        [([1e-3, 1e-3], 0.5e-3_f64), ([1e-3, 0.4e-3], 1e-3 * 0.4 / 1.4), ([1e-3, f64::INFINITY], 1e-3)]
    {
        for (a, b) in [(0, 0), (0, 1), (1, 1)] {
            let law = PairLaw::new(&model, a, b);
            let modulus = effective_modulus(&model.materials[a], &model.materials[b]);
            for ratio in [1e-8, 1e-6, 1e-4, 1e-2, 1e-1] {
                let depth = ratio * 1e-3;
                let closed = 4.0 / 3.0 * modulus * radius.sqrt() * f64::powf(depth, 1.5);
                let force = law.normal_force(&cap(1e-3, depth), &pair(radii), UNSET, 0.0);
                off = off.max((force / closed - 1.0).abs());
            }
        }
    }
    println!("off by {off:.1e}");
    assert!(off < 1e-15);
}

#[test]
fn the_papers_law_over_hertz_is_the_ratio_of_a_lens_or_cap_to_its_limit() {
    let hertz = hertz(DampingLaw::HuntCrossley);
    for d in [1e-4, 1e-3, 1e-2, 1e-1_f64] {
        let (radius, depth) = (1e-3, d * 1e-3);
        let ratio = |overlap: &Overlap, pair: &PairProperties| {
            let [paper, depth] = [&law(), &hertz].map(|law| law.normal_force(overlap, pair, UNSET, 0.0));
            paper / depth
        };
        let equal = ratio(&lens(depth), &EQUAL);
        assert!((equal / (1.0 - d / 6.0).sqrt() - 1.0).abs() < 1e-11, "spheres, {d}");
        let plane = ratio(&cap(radius, depth), &pair([radius, f64::INFINITY]));
        assert!((plane / (1.0 - d / 3.0).sqrt() - 1.0).abs() < 1e-13, "plane, {d}");
        // Radii R and 0.6 R: V = pi d^2 (D^2 + 2 D s - 3 (a - b)^2) / (12 D), R_e = 0.375 R.
        let unlike = sphere_sphere::overlap(radius, 0.6e-3, Vec3::x() * (1.6e-3 - depth)).unwrap();
        let distance = 1.6 - d;
        let lens = (distance * (distance + 3.2) - 3.0 * 0.16) / (12.0 * distance) / 0.375;
        let measured = ratio(&unlike, &pair([radius, 0.6e-3]));
        println!("d/R {d:e}: {equal:.9} {measured:.9} {plane:.9}");
        assert!((measured / lens.sqrt() - 1.0).abs() < 1e-11, "unlike spheres, {d}");
    }
}

#[test]
fn the_dashpot_on_hertz_is_that_of_liggghts() {
    // LIGGGHTS, normal_model_hertz.h: gamma_n = 2 sqrt(5/6) b sqrt(S_n m*), S_n = 2 E* sqrt(R* d).
    let law = hertz(DampingLaw::Tsuji);
    let decay = 0.5_f64.ln();
    let square = PI * PI + decay * decay;
    let b = -decay / square.sqrt();
    for (radii, radius, mass) in
        [([1e-3, 0.4e-3], 1e-3 * 0.4 / 1.4_f64, 0.75e-5_f64), ([1e-3, f64::INFINITY], 1e-3, 1e-5)]
    {
        for (depth, approach) in [(1e-8, 0.3), (1e-5, -0.7), (1e-4, 1e-3)] {
            let stiffness = 2.0 * law.modulus * (radius * depth).sqrt();
            let dashpot = 2.0 * (5.0_f64 / 6.0).sqrt() * b * (stiffness * mass).sqrt() * approach;
            let [still, moving] =
                [0.0, approach].map(|v| law.normal_force(&cap(1e-3, depth), &pair(radii), UNSET, v));
            assert!(((moving - still) / dashpot - 1.0).abs() < 1e-9, "{moving} {still} {dashpot}");
        }
    }
}

#[test]
fn a_dashpot_pulls_at_parting_bodies_and_friction_follows_the_magnitude() {
    let (law, overlap) = (hertz(DampingLaw::Tsuji), lens(1e-6));
    let offset = Vec3::new(2e-3 - overlap.depth, 0.0, 0.0);
    let action = law.act(&overlap, offset, &EQUAL, &moving(Vec3::new(-0.5, 3.0, 0.0)), &mut [UNSET]);
    assert!(action.force.x > 0.0, "pulled to the second body: {:?}", action.force);
    assert!((action.force.y / action.force.x + 0.16).abs() < 1e-6);
}

#[test]
fn a_dashpot_remembers_nothing_and_is_nothing_without_overlap_or_dissipation() {
    let law = hertz(DampingLaw::Tsuji);
    law.act(&lens(1e-6), Vec3::x() * 2e-3, &EQUAL, &moving(Vec3::x()), &mut []);
    let nothing = Overlap { volume: 0.0, area: 0.0, ..cap(1e-3, 0.0) };
    for elastic in [ElasticLaw::OverlapVolume, ElasticLaw::OverlapEnergy, ElasticLaw::Hertz] {
        let law = PairLaw { elastic, ..law };
        assert!(law.normal_force(&nothing, &EQUAL, UNSET, 0.3).abs() < 1e-300);
        let law = PairLaw { dashpot_number: dashpot_number(1.0), ..law };
        let [still, moving] = [0.0, 0.3].map(|v| law.normal_force(&lens(1e-6), &EQUAL, UNSET, v));
        assert_eq!(still.to_bits(), moving.to_bits());
    }
}

#[test]
fn the_force_of_the_energy_law_is_the_derivative_of_its_energy() {
    // Two spheres of unlike size: the energy E = K V^(5/4) against their distance, by central differences.
    let (law, radii) = (energy_law(), [1e-3, 0.4e-3]);
    let at = |distance: f64| sphere_sphere::overlap(radii[0], radii[1], Vec3::x() * distance).unwrap();
    let radius = 1.0 / (1.0 / radii[0] + 1.0 / radii[1]);
    let pi = PI;
    let energy = |distance: f64| {
        8.0 / 15.0
            * law.modulus
            * f64::powf(radius, -0.75)
            * f64::powf(pi, -1.25)
            * f64::powf(at(distance).volume, 1.25)
    };
    for distance in [1.399e-3, 1.35e-3, 1.1e-3] {
        let step = 1e-9;
        let slope = (energy(distance + step) - energy(distance - step)) / (2.0 * step);
        let force = law.normal_force(&at(distance), &pair(radii), UNSET, 0.0);
        assert!((force / -slope - 1.0).abs() < 1e-5, "{force} {slope}");
    }
}

#[test]
fn the_torques_of_all_laws_keep_the_angular_momentum_of_the_pair() {
    let overlap = Overlap {
        volume: 1e-11,
        depth: 1e-4,
        point: Vec3::new(0.5e-3, 0.2e-3, -0.1e-3),
        normal: Vec3::new(0.6, 0.0, 0.8),
        area: 1e-7,
        moment: Vec3::new(2e-11, -3e-11, 1e-11),
    };
    let offset = Vec3::new(1e-3, 0.3e-3, 0.1e-3);
    let dashpot = DampingLaw::Tsuji;
    let pulled = [law(), energy_law()].map(|law| PairLaw { damping: dashpot, ..law });
    for law in [law(), energy_law(), hertz(dashpot)].into_iter().chain(pulled) {
        let action = law.act(&overlap, offset, &EQUAL, &moving(Vec3::new(0.3, -0.2, 0.5)), &mut [0.1]);
        let total = action.torques[0] + action.torques[1] + offset.cross(&-action.force);
        assert!(total.norm() < 1e-14 * action.torques[0].norm());
    }
}

#[test]
fn the_damping_number_nearly_solves_the_restitution_condition() {
    for e in [0.926, 0.9, 0.7, 0.5] {
        let y = damping_number(e);
        assert!(((1.0 + e) * y - ((1.0 + y) / (1.0 - e * y)).ln()).abs() < 2e-3, "{e}");
    }
    assert!(damping_number(1.0).abs() < 1e-15);
}

#[test]
fn the_force_never_pulls() {
    let fast = law().latch(UNSET, 1e-3);
    for approach in [-1e-3, -1.0, -1e9] {
        assert!(law().normal_force(&lens(1e-5), &EQUAL, fast, approach) >= 0.0);
    }
}

#[test]
fn a_head_on_impact_has_the_resulting_restitution_whatever_is_asked_for() {
    for (asked, known) in
        [(0.05, 0.0929), (0.1, 0.1289), (0.3, 0.3040), (0.5, 0.5002), (0.926, 0.926), (1.0, 1.0)]
    {
        let pair = PairParams { restitution: asked, ..GLASS.pair };
        let (mut distance, mut approach, mass, dt) = (0.0, 0.1, 5e-6, 2e-8);
        let law = PairLaw::new(&ContactParams { pair, ..GLASS }.into(), 0, 0);
        let damping = law.latch(UNSET, approach);
        // Verlet; the speed that the damping depends on is half a step old.
        distance += approach * dt;
        while distance > 0.0 {
            let force = law.normal_force(&lens(distance), &EQUAL, damping, approach);
            approach -= force / mass * dt;
            distance += approach * dt;
        }
        let (came_out, expected) = (-approach / 0.1, resulting_restitution(law.damping_number));
        println!("{asked}: {came_out:.5}, expected {expected:.5}");
        assert!((came_out - expected).abs() < 1e-3, "{asked}: {came_out} {expected}");
        assert!((expected - known).abs() < 1e-4, "{asked}: {expected}");
    }
}

#[test]
fn damping_is_latched_on_approach_and_then_stays() {
    let law = law();
    let mut damping = UNSET;
    for approach in [0.0, -0.3] {
        damping = law.latch(damping, approach);
        assert!(damping < 0.0, "nothing to latch at {approach}");
    }
    damping = law.latch(damping, 0.2);
    assert!((damping * 0.2 / damping_number(0.5) - 1.0).abs() < 1e-14);
    assert_eq!(law.latch(damping, 7.0).to_bits(), damping.to_bits());
}

#[test]
fn a_contact_made_almost_at_rest_is_damped_as_by_the_slowest_impact_that_goes_as_deep() {
    let law = law();
    let elastic = law.normal_force(&lens(1e-5), &EQUAL, UNSET, 0.0);
    let slowest = (2.0 / 3.0 * elastic * 1e-5 / EQUAL.mass()).sqrt();
    for first in [1e-12, 1e-300, f64::from_bits(1)] {
        let damping = law.latch(UNSET, first);
        for (speed, factor) in [(0.0, 0.0), (1e-3, 1e-3), (-1e-3, -1e-3), (0.5, 0.5), (1.0, 1.0), (30.0, 1.0)]
        {
            let pushed = law.normal_force(&lens(1e-5), &EQUAL, damping, speed * slowest) / elastic;
            let expected = (1.0 + law.damping_number * factor).max(0.0);
            assert!((pushed - expected).abs() < 1e-12, "{first} {speed}: {pushed} {expected}");
        }
    }
}

#[test]
fn no_damping_and_no_face_of_the_energy_law_is_stiffer_than_a_sub_step_resolves() {
    for dt in [1e-9, 1e-6, 1e-4] {
        let pair = PairProperties { dt, ..EQUAL };
        let (law, overlap) = (law(), lens(1e-5));
        let elastic = law.normal_force(&overlap, &pair, UNSET, 0.0);
        let pushed = law.normal_force(&overlap, &pair, law.latch(UNSET, 1e-12), 1e-9) - elastic;
        assert!(pushed / 1e-9 <= 0.5 * pair.mass() / dt * (1.0 + 1e-6), "{dt}: {pushed}");
        // A face of a cube of 1 mm.
        for depth in [1e-20, 1e-12, 1e-8, 1e-5] {
            let face = Overlap { volume: 1e-6 * depth, area: 1e-6, ..cap(1e-3, depth) };
            let force = energy_law().normal_force(&face, &pair, UNSET, 0.0);
            let free = energy_law().normal_force(&face, &PairProperties { dt: 0.0, ..pair }, UNSET, 0.0);
            let stiffest = 0.25 * pair.mass() * depth / (dt * dt);
            assert!(
                (force / free.min(stiffest) - 1.0).abs() < 1e-12,
                "{dt} {depth}: {force} {free} {stiffest}"
            );
        }
    }
}

#[test]
fn no_impact_of_its_own_energy_is_damped_by_anything_but_its_speed() {
    // Elastic forces F = k d^p from a flat face to a corner, by Verlet: the greatest u_d over u0 of an elastic impact.
    for power in [0.25, 1.0, 1.5, 2.0] {
        let (mut depth, mut approach, dt, mut most) = (0.0_f64, 1.0, 1e-5, 0.0_f64);
        while approach > 0.0 {
            depth += approach * dt;
            let force = f64::powf(depth, power);
            approach -= force * dt;
            most = most.max((2.0 / 3.0 * force * depth).sqrt());
        }
        let exact = ((power + 1.0) / 3.0_f64).sqrt();
        println!("{power}: {most:.4}, {exact:.4}");
        assert!((most - exact).abs() < 1e-3 && exact <= 1.0, "{power}: {most} {exact}");
    }
}

#[test]
fn friction_is_static_at_the_transition_speed_and_kinetic_in_gross_sliding() {
    let law = law();
    let at = |a: f64| law.friction.coefficient(a * 1e-3);
    assert!((at(1.0) - 0.32 * (1.0 - 0.09 / 16.0)).abs() < 1e-14);
    assert!((at(1.09) - 0.3216).abs() < 1e-4, "the maximum");
    assert!((at(1e4) - 0.16).abs() < 1e-8);
    assert!(at(1e200).is_finite() && at(1e-200).abs() < 1e-30 && at(0.0).abs() < 1e-30);
}

#[test]
fn gross_sliding_is_resisted_with_the_kinetic_coefficient_against_the_motion() {
    let overlap = lens(1e-5);
    let force = force(&overlap, Vec3::new(0.0, 3.0, -4.0));
    let normal = law().normal_force(&overlap, &EQUAL, UNSET, 0.0);
    assert!((force.yz().norm() / (0.16 * normal) - 1.0).abs() < 1e-6);
    assert!((force.y / force.z + 0.75).abs() < 1e-12 && force.y < 0.0);
}

#[test]
fn bodies_of_unlike_stiffness_compress_like_springs_in_series() {
    let glass = GLASS.material;
    let soft = Material { youngs_modulus: 1e3, ..glass };
    let (a, b) = (effective_modulus(&glass, &soft), effective_modulus(&soft, &glass));
    assert!((a / b - 1.0).abs() < 1e-15);
    assert!((a / (1e3 / (1.0 - 0.0625)) - 1.0).abs() < 1e-3);
}

#[test]
fn a_law_depends_on_the_parameters_that_it_reads_and_on_no_others() {
    let changed = |params: &ContactParams, which: usize| {
        let mut changed = *params;
        let Material { youngs_modulus, poisson_ratio } = &mut changed.material;
        let PairParams { restitution, friction_static, friction_kinetic, transition_velocity, .. } =
            &mut changed.pair;
        let fields = [
            ("youngs_modulus", youngs_modulus),
            ("poisson_ratio", poisson_ratio),
            ("restitution", restitution),
            ("friction_static", friction_static),
            ("friction_kinetic", friction_kinetic),
            ("transition_velocity", transition_velocity),
        ];
        let (name, number) = fields.into_iter().nth(which)?;
        *number *= 1.1;
        Some((name, changed))
    };
    // Over times in which a spring sticks, and slides.
    let forces = |params: ContactParams, friction: FrictionLaw| -> Vec<Vec3> {
        let model = ContactModel { friction, ..params.into() };
        let (law, overlap) = (PairLaw::new(&model, 0, 0), lens(1e-5));
        let offset = Vec3::new(2e-3 - overlap.depth, 0.0, 0.0);
        let act = |n: u32| {
            let elapsed = 1e-9 * 1.05_f64.powi(n as i32);
            let motion = RelativeMotion { elapsed, ..moving(Vec3::new(0.1, 1e-3, 0.0)) };
            let mut memory = vec![0.0; model.memory()];
            law.begin(&mut memory);
            law.act(&overlap, offset, &EQUAL, &motion, &mut memory).force
        };
        (0..400).map(act).collect()
    };
    for law in [ElasticLaw::OverlapVolume, ElasticLaw::OverlapEnergy, ElasticLaw::Hertz] {
        for damping in [DampingLaw::HuntCrossley, DampingLaw::Tsuji] {
            for friction in
                [FrictionLaw::Mindlin, FrictionLaw::MindlinDisplacement, FrictionLaw::NassauerKuna]
            {
                let params = ContactParams { law, damping, ..GLASS };
                let model = ContactModel { friction, ..params.into() };
                for (name, changed) in (0..).map_while(|which| changed(&params, which)) {
                    let differs = forces(changed, friction) != forces(params, friction);
                    let read = model.parameters().contains(&name);
                    assert_eq!(differs, read, "{law:?} {damping:?} {friction:?} {name}");
                }
            }
        }
    }
}
