//! Claims about friction with memory: what rests, what slides, what rolls.

use super::cube_tests::cubes;
use super::wall_tests::{MATERIAL, RADIUS, TANK, alone, first, plane, run};
use super::*;
use crate::contact::{ContactParams, FrictionLaw, PairParams, RollingLaw, TwistingLaw};
use crate::math::Quat;
use crate::shape::{Cylinder, Sphere};
use crate::wall::Motion;

const EDGE: f64 = 5e-3;
const DT: f64 = 1e-5;

fn model(statics: f64, kinetic: f64, restitution: f64) -> ContactModel {
    let pair =
        PairParams { restitution, friction_static: statics, friction_kinetic: kinetic, ..MATERIAL.pair };
    ContactModel { friction: FrictionLaw::Mindlin, ..ContactParams { pair, ..MATERIAL }.into() }
}

/// A body on a floor at the height `z` (m) under a gravity whose direction is that of an incline.
fn on_an_incline(shape: Arc<dyn Shape>, z: f64, slope: f64, contact: ContactModel) -> Native {
    lies_on_an_incline(shape, (z, Quat::identity()), slope, contact)
}

/// The same with an orientation.
fn lies_on_an_incline(
    shape: Arc<dyn Shape>,
    (z, orientation): (f64, Quat),
    slope: f64,
    contact: ContactModel,
) -> Native {
    let gravity = Vec3::new(slope, 0.0, -1.0).normalize() * 9.81;
    let mut body = Particle::at(0, 0, Vec3::new(6e-3, 6e-3, z));
    body.set_orientation(&orientation);
    let floor = plane("incline", Vec3::zeros(), Vec3::z());
    let templates: Arc<[Template]> = [Template { shape, density: 2500.0, material: 0 }].into();
    alone(TANK, contact, vec![floor], gravity, templates, &[body])
}

/// Acceleration down the incline (m/s^2) between two times.
fn acceleration(engine: &mut Native, steps: usize, dt: f64) -> f64 {
    let before = first(engine).velocity[0];
    run(engine, steps, dt);
    (first(engine).velocity[0] - before) / (steps as f64 * dt)
}

#[test]
fn a_cube_and_a_cylinder_on_its_face_rest_on_an_incline_below_the_angle_of_friction_for_10_seconds() {
    let cylinder = Arc::new(Cylinder::new(2e-3, 2e-3).unwrap());
    let seconds = 10;
    for (what, shape, z) in
        [("a cube", cubes(EDGE)[0].shape.clone(), 0.5 * EDGE), ("a cylinder on its face", cylinder, 1e-3)]
    {
        let mut engine = on_an_incline(shape, z, 0.199, model(0.5, 0.4, 0.5));
        run(&mut engine, 50_000, DT);
        let from = first(&engine).position();
        run(&mut engine, seconds * 100_000, DT);
        let crept = (first(&engine).position() - from).norm();
        println!("{what}: {crept:.1e} m in {seconds} s");
        assert!(crept < 1e-10 * seconds as f64, "{what}");
    }
}

#[test]
fn a_cylinder_on_its_side_rests_on_an_incline_if_it_resists_rolling_and_twisting() {
    for axis in [Vec3::x_axis(), Vec3::y_axis()] {
        let pair = PairParams {
            rolling_friction: 0.3,
            restitution: 0.5,
            friction_static: 0.5,
            friction_kinetic: 0.4,
            ..MATERIAL.pair
        };
        let contact = ContactModel {
            friction: FrictionLaw::Mindlin,
            rolling: RollingLaw::ElasticPlastic,
            twisting: TwistingLaw::Marshall,
            ..ContactParams { pair, ..MATERIAL }.into()
        };
        let turn = Quat::from_axis_angle(&axis, std::f64::consts::FRAC_PI_2);
        let shape = Arc::new(Cylinder::new(1e-3, 3e-3).unwrap());
        let mut engine = lies_on_an_incline(shape, (1e-3, turn), 0.199, contact);
        run(&mut engine, 50_000, DT);
        let from = first(&engine).position();
        run(&mut engine, 100_000, DT);
        let crept = (first(&engine).position() - from).norm();
        assert!(crept < 1e-12, "{axis:?}: {crept:.1e}");
    }
}

#[test]
fn above_the_angle_of_friction_a_cube_slides_as_coulomb_has_it() {
    for (slope, kinetic) in [(0.6, 0.4), (1.0, 0.5)] {
        let mut engine =
            on_an_incline(cubes(EDGE)[0].shape.clone(), 0.5 * EDGE, slope, model(0.5, kinetic, 0.5));
        run(&mut engine, 20_000, 1e-6);
        let measured = acceleration(&mut engine, 40_000, 1e-6);
        let expected = 9.81 * (slope - kinetic) / slope.hypot(1.0);
        println!("slope {slope}: {measured:.5} for {expected:.5} m/s^2");
        assert!((measured / expected - 1.0).abs() < 0.005);
    }
}

#[test]
fn a_sphere_rolls_down_an_incline_with_five_sevenths_of_the_acceleration_and_without_slip() {
    let slope: f64 = 0.3;
    let mut engine = on_an_incline(Arc::new(Sphere { radius: RADIUS }), RADIUS, slope, model(0.5, 0.5, 0.5));
    run(&mut engine, 2000, DT);
    let measured = acceleration(&mut engine, 2000, DT);
    let expected = 5.0 / 7.0 * 9.81 * slope / slope.hypot(1.0);
    let sphere = first(&engine);
    let slip = sphere.velocity[0] - sphere.angular_velocity[1] * RADIUS;
    println!("{measured:.5} for {expected:.5} m/s^2, slip {:.1e} of the velocity", slip / sphere.velocity[0]);
    assert!((measured / expected - 1.0).abs() < 0.002);
    assert!((slip / sphere.velocity[0]).abs() < 0.002);
}

#[test]
fn a_cube_on_a_turning_disc_turns_with_it_and_does_not_lag() {
    // Within the angle of friction: omega^2 r = 0.02 g.
    let omega = 10.0;
    let centre = Vec3::new(6e-3, 6e-3, 0.0);
    let mut disc = plane("disc", Vec3::zeros(), Vec3::z());
    disc.motion = Motion { angular_velocity: (Vec3::z() * omega).into(), pivot: centre, ..Motion::default() };
    let mut cube = Particle::at(0, 0, centre + Vec3::new(2e-3, 0.0, 0.5e-3));
    cube.velocity = [0.0, omega * 2e-3, 0.0];
    cube.angular_velocity = [0.0, 0.0, omega];
    let mut engine = alone(TANK, model(0.5, 0.5, 0.5), vec![disc], Vec3::z() * -9.81, cubes(1e-3), &[cube]);
    let lag = |engine: &Native, time: f64| {
        let way = first(engine).position() - centre;
        let angle = libm::atan2(way.y, way.x) - omega * time;
        (angle / std::f64::consts::TAU - (angle / std::f64::consts::TAU).round()) * std::f64::consts::TAU
    };
    run(&mut engine, 20_000, DT);
    let before = lag(&engine, 0.2);
    run(&mut engine, 200_000, DT);
    let after = lag(&engine, 2.2);
    println!("lag {before:.2e} rad after 2 radians, {after:.2e} after 22");
    assert!((after - before).abs() < 1e-4);
}

#[test]
fn a_sphere_whose_contact_slips_at_its_edge_rests_on_an_incline() {
    let mut contact = model(0.5, 0.5, 0.5);
    (contact.friction, contact.rolling) = (FrictionLaw::MindlinDeresiewicz, RollingLaw::ElasticPlastic);
    contact.pairs[0].rolling_friction = 0.3;
    let mut engine = on_an_incline(Arc::new(Sphere { radius: RADIUS }), RADIUS, 0.199, contact);
    run(&mut engine, 50_000, DT);
    let from = first(&engine).position();
    run(&mut engine, 200_000, DT);
    let crept = (first(&engine).position() - from).norm();
    println!("{crept:.1e} m in 2 s");
    assert!(crept < 1e-10);
}

#[test]
fn rough_elastic_spheres_never_gain_energy_and_keep_momentum_and_angular_momentum() {
    for friction in [FrictionLaw::Mindlin, FrictionLaw::MindlinDeresiewicz] {
        rough_spheres(ContactModel { friction, ..model(0.5, 0.3, 1.0) });
    }
}

fn rough_spheres(contact: ContactModel) {
    use rand::{Rng, SeedableRng};
    let domain = Domain { faces: Domain::faces([false; 3]), cells: [40, 40, 40], dx: 1e-3 };
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(11);
    let mut vector = |size: f64| Vec3::from_fn(|_, _| size * random.random_range(-1.0..1.0));
    // A cluster that flies together.
    let centre = Vec3::repeat(20e-3);
    let all: Vec<Particle> = (0..27)
        .map(|n| {
            let place = Vec3::from([n % 3, n / 3 % 3, n / 9].map(|i| (i as f64 - 1.0) * 3e-3));
            let mut sphere = Particle::at(n, 0, centre + place + vector(0.2e-3));
            sphere.velocity = (place * -20.0 + vector(0.02)).into();
            sphere.angular_velocity = vector(50.0).into();
            sphere
        })
        .collect();
    let templates: Arc<[Template]> =
        [Template { shape: Arc::new(Sphere { radius: RADIUS }), density: 2500.0, material: 0 }].into();
    let (mass, inertia) = (templates[0].mass(), templates[0].inertia().x);
    let mut engine = alone(domain, contact, Vec::new(), Vec3::zeros(), templates, &all);
    let sums = |engine: &Native| {
        let (mut energy, mut momentum, mut angular) = (0.0, Vec3::zeros(), Vec3::zeros());
        for sphere in engine.particles().owned() {
            let (v, w) = (sphere.velocity(), sphere.angular_velocity());
            energy += 0.5 * (mass * v.norm_squared() + inertia * w.norm_squared());
            momentum += v * mass;
            angular += (sphere.position() - centre).cross(&v) * mass + w * inertia;
        }
        (energy, momentum, angular)
    };
    let (start, _, angular) = sums(&engine);
    let (mut most, mut contacts) = (0.0_f64, 0);
    for _ in 0..300 {
        run(&mut engine, 100, 1e-6);
        contacts = engine.contacts().begun;
        most = most.max(sums(&engine).0 / start);
    }
    let (energy, momentum, turned) = sums(&engine);
    let scale = (mass * start).sqrt();
    println!(
        "{contacts} contacts, energy at most {most:.6}, at the end {:.3}; momentum off by {:.1e}, angular by {:.1e}",
        energy / start,
        (momentum - momentum_of(&all, mass)).norm() / scale,
        (turned - angular).norm() / angular.norm()
    );
    assert!(contacts > 30 && most < 1.0 + 1e-4 && energy < 0.98 * start);
    assert!((momentum - momentum_of(&all, mass)).norm() < 1e-12 * scale);
    assert!((turned - angular).norm() < 1e-9 * angular.norm());
}

fn momentum_of(all: &[Particle], mass: f64) -> Vec3 {
    all.iter().map(|sphere| sphere.velocity() * mass).sum()
}
