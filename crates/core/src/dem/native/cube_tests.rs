//! Claims about cubes: how deep they rest, how they bounce off edges and corners, how they creep.

use super::wall_tests::{GRAVITY, MATERIAL, TANK, alone, first, floor, plane, run};
use super::*;
use crate::contact::{ContactParams, ElasticLaw, Geometry, Material, PairParams};
use crate::math::Quat;
use crate::shape::Cuboid;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

const EDGE: f64 = 1e-3;

pub(super) fn cubes(edge: f64) -> Arc<[Template]> {
    [Template { shape: Arc::new(Cuboid::new(Vec3::repeat(edge)).unwrap()), density: 2500.0, material: 0 }]
        .into()
}

/// Smooth and elastic.
const SMOOTH: PairParams =
    PairParams { restitution: 1.0, friction_static: 0.0, friction_kinetic: 0.0, ..MATERIAL.pair };

fn model(pair: PairParams, law: ElasticLaw) -> ContactModel {
    stiff(pair, law, MATERIAL.material.youngs_modulus)
}

fn stiff(pair: PairParams, law: ElasticLaw, youngs_modulus: f64) -> ContactModel {
    let material = Material { youngs_modulus, ..MATERIAL.material };
    ContactParams { material, pair, law, ..MATERIAL }.into()
}

/// Translational and rotational energy (J).
fn kinetic_energy(engine: &Native) -> f64 {
    let store = engine.particles();
    let of = |p: &Particle| {
        let turning = Vec3::from(p.angular_momentum).dot(&p.angular_velocity());
        0.5 * (store.template(p).mass() * p.velocity().norm_squared() + turning)
    };
    store.owned().iter().map(of).sum()
}

/// Turned about y, then about x (degrees).
fn tilted(about_y: f64, about_x: f64) -> Quat {
    Quat::from_axis_angle(&Vec3::x_axis(), about_x.to_radians())
        * Quat::from_axis_angle(&Vec3::y_axis(), about_y.to_radians())
}

/// Depth of a cube that lies on its face over that of a linear spring, by the paper's law
///
/// ```text
/// F = k E* sqrt(V d) = k E* L d,   k = 4 / (3 sqrt(pi)),   so   d = 3 sqrt(pi) m g / (4 E* L)
/// ```
fn depth_at_rest(geometry: Geometry) -> f64 {
    let edge = 1.209e-3;
    let soft = Material { youngs_modulus: 5e3, ..MATERIAL.material };
    let mass = cubes(edge)[0].mass();
    let model = ContactParams {
        material: soft,
        pair: PairParams { restitution: 0.8, ..MATERIAL.pair },
        geometry,
        ..MATERIAL
    };
    let modulus = PairLaw::new(&model.into(), 0, 0).modulus;
    let depth = 3.0 * std::f64::consts::PI.sqrt() * mass * 9.81 / (4.0 * modulus * edge);
    let placed = Particle::at(0, 0, Vec3::new(3.1e-3, 4.2e-3, 0.5 * edge));
    let mut engine = alone(TANK, model.into(), vec![floor()], GRAVITY, cubes(edge), &[placed]);
    let period = std::f64::consts::TAU * (depth / 9.81).sqrt();
    run(&mut engine, 30 * 100, period / 100.0);
    // The mean of some periods, as samples come and go.
    let steps = 500;
    let mut mean = 0.0;
    for _ in 0..steps {
        run(&mut engine, 1, period / 100.0);
        mean += (0.5 * edge - first(&engine).position[2]) / f64::from(steps);
    }
    let tilt = first(&engine).orientation().angle();
    assert!(tilt < 0.01, "flat: {tilt}");
    println!("{geometry:?}: {:.4} of the depth {depth:.3e} m", mean / depth);
    mean / depth
}

#[test]
fn a_cube_lies_on_its_face_as_deep_as_a_linear_spring_says() {
    assert!((depth_at_rest(Geometry::Exact) - 1.0).abs() < 0.01);
    assert!((depth_at_rest(Geometry::Sampled { samples: 8 }) - 1.0).abs() < 0.1);
}

/// Rigid impulse theory of a smooth impact on a plane, speed `v` downwards, the point of contact `r` from the centre:
/// the speed of the point is reversed (times e) by an impulse `J` along z,
///
/// ```text
/// J = (1 + e) m v / (1 + m |r x z|^2 / I),   v' = J / m - v,   w' = (r x z) J / I,   I = m L^2 / 6
/// ```
fn rigid_impact(speed: f64, restitution: f64, arm: Vec3) -> (f64, Vec3) {
    let lever = arm.cross(&Vec3::z());
    let specific = EDGE * EDGE / 6.0;
    let impulse = (1.0 + restitution) * speed / (1.0 + lever.norm_squared() / specific);
    (impulse - speed, lever * (impulse / specific))
}

/// Drops a cube on an edge or a corner and stops when it parts. Energy ratio, speed upwards, angular velocity, the
/// same by rigid theory, and the impulse of the wall.
struct Bounce {
    energy: f64,
    velocity: Vec3,
    spin: Vec3,
    expected: (f64, Vec3),
    impulse: Vec3,
}

fn bounce(law: ElasticLaw, modulus: f64, restitution: f64, orientation: Quat) -> Bounce {
    let half = 0.5 * EDGE;
    let corners = (0..8).map(|n| {
        let corner = Vec3::from_fn(|i, _| if n >> i & 1 == 0 { -half } else { half });
        orientation.transform_vector(&corner)
    });
    let corners: Vec<Vec3> = corners.collect();
    let lowest = corners.iter().map(|c| c.z).fold(f64::INFINITY, f64::min);
    // The middle of the lowest corners: of one, or of the two of an edge.
    let low: Vec<_> = corners.iter().filter(|c| c.z < lowest + 1e-9).collect();
    let arm = low.iter().copied().sum::<Vec3>() / low.len() as f64;
    let speed = 0.1;
    let mut falling = Particle::at(0, 0, Vec3::new(3e-3, 4e-3, -lowest));
    falling.set_orientation(&orientation);
    falling.velocity = [0.0, 0.0, -speed];
    let pair = PairParams { restitution, ..SMOOTH };
    let mut engine =
        alone(TANK, stiff(pair, law, modulus), vec![floor()], Vec3::zeros(), cubes(EDGE), &[falling]);
    let before = kinetic_energy(&engine);
    let (dt, mut impulse, mut steps) = (1e-7 * (1e7 / modulus).sqrt(), Vec3::zeros(), 0);
    loop {
        run(&mut engine, 1, dt);
        steps += 1;
        assert!(steps < 100_000, "it sticks");
        if steps > 3 && engine.contacts().count == 0 {
            break;
        }
        impulse += Vec3::from(first(&engine).contact_force) * dt;
    }
    // The predicted velocity needs one step without contact.
    run(&mut engine, 1, dt);
    Bounce {
        energy: kinetic_energy(&engine) / before,
        velocity: first(&engine).velocity(),
        spin: first(&engine).angular_velocity(),
        expected: rigid_impact(speed, restitution, arm),
        impulse: impulse / cubes(EDGE)[0].mass(),
    }
}

/// Cubes on an edge, then on a corner.
fn tilts() -> Vec<(&'static str, Quat)> {
    let edges = [15.0, 30.0, 40.0, 45.0].map(|angle| ("edge", tilted(angle, 0.0)));
    let corners = [(30.0, 20.0), (45.0, 35.264), (20.0, 40.0), (40.0, 10.0)];
    edges.into_iter().chain(corners.map(|(y, x)| ("corner", tilted(y, x)))).collect()
}

#[test]
fn an_elastic_impact_on_an_edge_or_corner_follows_rigid_impulse_theory() {
    // A soft corner goes deep and turns meanwhile, most with the energy law; stiffer ones come nearer to the theory.
    for (law, modulus, energies, tolerance) in [
        (ElasticLaw::OverlapVolume, 1e7, 0.97..=1.005, 0.03),
        (ElasticLaw::OverlapVolume, 1e9, 0.99..=1.001, 0.015),
        (ElasticLaw::OverlapEnergy, 1e7, 0.999..=1.001, 0.13),
        (ElasticLaw::OverlapEnergy, 1e8, 0.999..=1.001, 0.06),
        (ElasticLaw::OverlapEnergy, 1e9, 0.999..=1.001, 0.035),
    ] {
        for (what, orientation) in tilts() {
            let bounce = bounce(law, modulus, 1.0, orientation);
            let (up, spin) = bounce.expected;
            let off = (bounce.velocity.z - up) / 0.1;
            let off_spin = (bounce.spin - spin).norm() / (spin.norm() + 0.1 / EDGE);
            println!(
                "{law:?} {modulus:e} Pa, {what}: energy {:.5}, v' {:.4} for {up:.4}, off by {off:.4}, w' {:.2} for {:.2}, off by {off_spin:.4}",
                bounce.energy,
                bounce.velocity.z,
                bounce.spin.norm(),
                spin.norm()
            );
            assert!(energies.contains(&bounce.energy), "{}", bounce.energy);
            assert!(off.abs() < tolerance && off_spin < tolerance);
            assert!(bounce.velocity.xy().norm() < 1e-15, "a smooth wall pushes along its normal");
            let gained = bounce.velocity + Vec3::z() * 0.1;
            assert!((gained - bounce.impulse).norm() < 1e-10, "{gained:?} {:?}", bounce.impulse);
        }
    }
}

#[test]
fn the_set_restitution_holds_for_edges_and_corners() {
    for law in [ElasticLaw::OverlapVolume, ElasticLaw::OverlapEnergy] {
        for (what, orientation) in tilts() {
            let bounce = bounce(law, 1e9, 0.7, orientation);
            let (up, spin) = bounce.expected;
            let off = (bounce.velocity.z - up) / 0.1;
            let off_spin = (bounce.spin - spin).norm() / (spin.norm() + 0.1 / EDGE);
            println!("{law:?}, {what}: v' off by {off:.4}, w' by {off_spin:.4}");
            assert!(off.abs() < 0.02 && off_spin < 0.02);
        }
    }
}

#[test]
fn a_cube_on_an_incline_creeps_at_the_speed_at_which_friction_holds_it() {
    // Eq. 7 of the paper: mu(a) = tan(slope) at the creep speed a u_k, far below u_k; nothing ever sticks.
    let slope: f64 = 0.1;
    let pair = PairParams { restitution: 0.8, ..MATERIAL.pair };
    let law = PairLaw::new(&model(pair, ElasticLaw::OverlapVolume), 0, 0);
    let (mut low, mut high) = (0.0, pair.transition_velocity);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if law.friction.coefficient(middle) < slope {
            low = middle;
        } else {
            high = middle;
        }
    }
    assert!((low / pair.transition_velocity - 0.41).abs() < 0.01, "{low}");
    let down = Vec3::new(1.0, 0.0, -slope).normalize();
    let incline = plane("incline", Vec3::new(6e-3, 6e-3, 6e-3), Vec3::new(slope, 0.0, 1.0));
    let angle = slope.atan();
    let mut cube = Particle::at(
        0,
        0,
        Vec3::new(6e-3, 6e-3, 6e-3) + Vec3::new(angle.sin(), 0.0, angle.cos()) * 0.5 * EDGE,
    );
    cube.set_orientation(&Quat::from_axis_angle(&Vec3::y_axis(), angle));
    let mut engine =
        alone(TANK, model(pair, ElasticLaw::OverlapVolume), vec![incline], GRAVITY, cubes(EDGE), &[cube]);
    run(&mut engine, 50_000, 2e-6);
    let from = first(&engine).position();
    run(&mut engine, 50_000, 2e-6);
    let speed = (first(&engine).position() - from).dot(&down) / 0.1;
    println!("creeps at {:.4} of the speed of Eq. 7, {low:.3e} m/s", speed / low);
    assert!((speed / low - 1.0).abs() < 0.02, "{speed} {low}");
    assert!(first(&engine).angular_velocity().norm() * EDGE < 0.01 * low, "it does not tip");
}

#[test]
fn a_soft_edge_or_corner_never_gains_more_than_two_per_cent_and_nothing_by_the_energy_law() {
    for modulus in [1e5, 1e6] {
        for (what, orientation) in tilts() {
            let [paper, energy] = [ElasticLaw::OverlapVolume, ElasticLaw::OverlapEnergy]
                .map(|law| bounce(law, modulus, 1.0, orientation).energy);
            println!("{modulus:e} Pa, {what}: {paper:.4} by the paper's law, {energy:.5} by the energy law");
            assert!(paper < 1.02 && (energy - 1.0).abs() < 1e-3);
        }
    }
}

#[test]
fn a_cube_placed_in_touching_rest_on_face_edge_or_corner_never_gains_energy() {
    // Energy above the one it starts with, in weights times edges.
    for orientation in [tilted(0.0, 0.0), tilted(45.0, 0.0), tilted(20.0, 30.0)] {
        let lowest = (0..8)
            .map(|n| Vec3::from_fn(|i, _| if n >> i & 1 == 0 { -0.5 * EDGE } else { 0.5 * EDGE }))
            .map(|corner| orientation.transform_vector(&corner).z)
            .fold(f64::INFINITY, f64::min);
        let mut placed = Particle::at(0, 0, Vec3::new(4e-3, 4e-3, -lowest));
        placed.set_orientation(&orientation);
        let mut engine = alone(
            TANK,
            model(MATERIAL.pair, ElasticLaw::OverlapVolume),
            vec![floor()],
            GRAVITY,
            cubes(EDGE),
            &[placed],
        );
        let weight = cubes(EDGE)[0].mass() * 9.81;
        let mut most = 0.0_f64;
        for _ in 0..50_000 {
            run(&mut engine, 1, 1e-6);
            let height = first(&engine).position[2] + lowest;
            most = most.max(height / EDGE + kinetic_energy(&engine) / (weight * EDGE));
        }
        let left = kinetic_energy(&engine) / (weight * EDGE);
        println!("at most {most:.1e}, in the end {left:.1e} m g L");
        assert!(most < 1e-5, "{most:e}");
    }
}

#[test]
fn an_elastic_collision_of_two_cubes_keeps_momentum_and_by_the_energy_law_energy() {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let open = Domain { faces: Domain::faces([true; 3]), ..TANK };
    let mut ratios = [[1.0_f64; 2]; 2];
    for _ in 0..20 {
        let mut noise = |size: f64| Vec3::from_fn(|_, _| random.random_range(-size..size));
        let (aside, spin) = (noise(0.3e-3), noise(50.0));
        let offset = Vec3::new(0.9e-3, aside.y, aside.z);
        let turns = [noise(1.0), noise(1.0)];
        for (n, law) in [ElasticLaw::OverlapVolume, ElasticLaw::OverlapEnergy].into_iter().enumerate() {
            let middle = Vec3::repeat(6e-3);
            let mut pair = [Particle::at(0, 0, middle - offset), Particle::at(1, 0, middle + offset)];
            for (cube, turn) in pair.iter_mut().zip(&turns) {
                cube.set_orientation(&integrator::turned(&Quat::identity(), *turn, 2.0));
            }
            pair[0].velocity = [0.1, 0.01, -0.02];
            pair[1].velocity = [-0.1, 0.0, 0.0];
            pair[0].angular_velocity = spin.into();
            let mut engine = alone(open, model(SMOOTH, law), vec![], Vec3::zeros(), cubes(EDGE), &pair);
            let before = (kinetic_energy(&engine), momenta(&engine, middle));
            run(&mut engine, 60_000, 2e-7);
            assert!(engine.contacts().begun > 0 && engine.contacts().count == 0, "met and parted");
            let after = (kinetic_energy(&engine), momenta(&engine, middle));
            let ratio = after.0 / before.0;
            ratios[n] = [ratios[n][0].min(ratio), ratios[n][1].max(ratio)];
            for i in 0..2 {
                let (a, b) = (after.1[i], before.1[i]);
                assert!((a - b).norm() < 1e-10 * before.1[i].norm(), "{a:?} {b:?}");
            }
        }
    }
    let [[least, most], energy_law] = ratios;
    println!(
        "energy after over before: {least:.4} to {most:.4} by the paper's law, {energy_law:?} by the energy law"
    );
    assert!(least > 0.8 && most < 1.05);
    assert!(energy_law.iter().all(|ratio| (ratio - 1.0).abs() < 1e-3));
}

/// Linear and angular momentum, the latter about `origin`.
fn momenta(engine: &Native, origin: Vec3) -> [Vec3; 2] {
    let store = engine.particles();
    let each = |p: &Particle| {
        let linear = p.velocity() * store.template(p).mass();
        [linear, (p.position() - origin).cross(&linear) + Vec3::from(p.angular_momentum)]
    };
    let [a, b] = [0, 1].map(|i| each(&store.particles[i]));
    [a[0] + b[0], a[1] + b[1]]
}
