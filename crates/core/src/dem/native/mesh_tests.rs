//! Claims about bodies on meshes.

use super::cube_tests::cubes;
use super::wall_tests::{GRAVITY, MATERIAL, RADIUS, alone, floor, run};
use super::*;
use crate::comm::on_threads;
use crate::contact::{ContactParams, DampingLaw, ElasticLaw, FrictionLaw, PairParams};
use crate::math::Quat;
use crate::shape::Sphere;
use crate::wall::mesh::tests::{Parts, cuboid, placed, plate, tube};
use crate::wall::{FreeSide, Motion, Surface};

/// Closed, 60 mm wide.
const BOX: Domain = Domain { faces: Domain::faces([false; 3]), cells: [60, 60, 60], dx: 1e-3 };

fn spheres() -> Arc<[Template]> {
    [Template { shape: Arc::new(Sphere { radius: RADIUS }), density: 2500.0, material: 0 }].into()
}

fn model(pair: PairParams) -> ContactModel {
    let law = ElasticLaw::Hertz;
    let contact: ContactModel =
        ContactParams { pair, law, damping: DampingLaw::HuntCrossley, ..MATERIAL }.into();
    ContactModel { friction: FrictionLaw::Mindlin, ..contact }
}

fn mesh(name: &str, parts: Parts, free: Option<FreeSide>, position: Vec3) -> Wall {
    let mut placed = placed(parts, free);
    placed.position = position;
    Wall { name: name.into(), surface: Surface::Mesh(placed), motion: Motion::default(), material: 0 }
}

fn moving(position: Vec3, velocity: Vec3) -> Particle {
    let mut particle = Particle::at(0, 0, position);
    particle.velocity = velocity.into();
    particle
}

#[test]
fn a_sphere_rolls_over_a_thousand_coplanar_facets_without_a_change_of_its_velocity() {
    // In its resting depth, at the spin of rolling, without rolling resistance: nothing acts along the plane.
    let contact = model(MATERIAL.pair);
    let law = PairLaw::new(&contact, 0, 0);
    let mass = spheres()[0].mass();
    let depth = (mass * 9.81 / (4.0 / 3.0 * law.modulus * RADIUS.sqrt())).powf(2.0 / 3.0);
    let speed = 0.5;
    let mut ball = moving(Vec3::new(4.7e-3, 5.3e-3, RADIUS - depth), Vec3::x() * speed);
    // The point of contact lies in the middle of the depth.
    ball.angular_velocity = [0.0, speed / (RADIUS - 0.5 * depth), 0.0];
    let floor = mesh("floor", plate([50e-3, 10e-3], [1250, 3]), None, Vec3::zeros());
    let mut engine = alone(BOX, contact, vec![floor], GRAVITY, spheres(), &[ball]);
    let (mut seen, mut worst) = (std::collections::BTreeSet::new(), 0.0_f64);
    for _ in 0..4000 {
        run(&mut engine, 2, 1e-5);
        let states = engine.contact_states(&Comm::Solo);
        assert_eq!(states.len(), 1);
        seen.insert(states[0].parts[1]);
        let velocity = engine.particles().particles[0].velocity();
        worst = worst.max((velocity.x / speed - 1.0).abs()).max(velocity.y.abs() / speed);
    }
    assert!(seen.len() > 1000, "{}", seen.len());
    assert!(worst < 1e-12, "{worst}");
    assert_eq!(engine.contacts().begun, 1);
}

#[test]
fn spheres_and_cubes_move_on_a_plate_of_facets_as_on_a_plane() {
    let contact = model(PairParams { restitution: 0.3, ..MATERIAL.pair });
    for (templates, size) in [(spheres(), RADIUS), (cubes(2e-3), 1e-3)] {
        let mut body = moving(Vec3::new(30e-3, 30e-3, 1.9 * size), Vec3::new(0.3, 0.1, -0.2));
        body.set_orientation(&Quat::from_euler_angles(0.3, 0.2, 0.1));
        body.angular_velocity = [20.0, -30.0, 10.0];
        let floors = [floor(), mesh("z-", plate([60e-3, 60e-3], [61, 47]), None, Vec3::zeros())];
        let mut engines =
            floors.map(|floor| alone(BOX, contact.clone(), vec![floor], GRAVITY, templates.clone(), &[body]));
        let mut facets = std::collections::BTreeSet::new();
        for _ in 0..5000 {
            for engine in &mut engines {
                run(engine, 1, 1e-5);
            }
            facets.extend(engines[1].contact_states(&Comm::Solo).iter().map(|state| state.parts[1]));
        }
        let [plane, mesh] = [0, 1].map(|n| engines[n].particles().particles[0]);
        let apart = (plane.position() - mesh.position()).norm();
        println!("{apart} m after {} facets", facets.len());
        assert!(facets.len() > 5 && apart < 1e-9 * 60e-3, "{apart} {}", facets.len());
        assert!((plane.velocity() - mesh.velocity()).norm() < 1e-9);
        assert_eq!(engines[0].contacts().begun, engines[1].contacts().begun);
    }
}

#[test]
fn a_sphere_rests_in_a_concave_corner_and_on_a_convex_edge_as_statics_says() {
    // Friction would leave the forces undetermined.
    let (friction_static, friction_kinetic) = (0.0, 0.0);
    let contact = model(PairParams { restitution: 0.3, friction_static, friction_kinetic, ..MATERIAL.pair });
    let weight = spheres()[0].mass() * 9.81;
    // Two planes at 45 degrees each carry the weight over the square root of 2.
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let valley = mesh("valley", cuboid(Vec3::repeat(20e-3)), Some(FreeSide::Inside), Vec3::repeat(20e-3));
    let Surface::Mesh(mut turned) = valley.surface.clone() else { unreachable!() };
    turned.orientation = Quat::from_axis_angle(&Vec3::y_axis(), std::f64::consts::FRAC_PI_4);
    let valley = Wall { surface: Surface::Mesh(turned.clone()), ..valley };
    // In its frame the corner is the edge x = 0, z = 0, seen at 45 degrees; gravity points into it.
    let down = turned.orientation * Vec3::new(-half, 0.0, -half);
    let start = turned.to_world(&Vec3::new(RADIUS, 10e-3, RADIUS));
    let mut engine =
        alone(BOX, contact.clone(), vec![valley], down * 9.81, spheres(), &[moving(start, Vec3::zeros())]);
    run(&mut engine, 20_000, 1e-5);
    let states = engine.contact_states(&Comm::Solo);
    assert_eq!(states.len(), 2);
    for state in &states {
        let force = Vec3::from(state.force).norm() / weight;
        assert!((force - half).abs() < 1e-6, "{force}");
    }
    // On the edge of a block, balanced along the diagonal.
    let block = mesh("block", cuboid(Vec3::repeat(20e-3)), None, Vec3::repeat(10e-3));
    let out = Vec3::new(half, 0.0, half);
    let start = Vec3::new(30e-3, 20e-3, 30e-3) + out * RADIUS;
    let mut engine =
        alone(BOX, contact, vec![block], out * -9.81, spheres(), &[moving(start, Vec3::zeros())]);
    run(&mut engine, 6000, 1e-5);
    let states = engine.contact_states(&Comm::Solo);
    assert_eq!(states.len(), 1);
    assert!((Vec3::from(states[0].force) - out * weight).norm() < 1e-3 * weight, "{:?}", states[0].force);
}

#[test]
fn nothing_goes_through_a_thin_sheet_from_either_side_or_through_its_seams() {
    let contact = model(MATERIAL.pair);
    let sheet = mesh("sheet", plate([60e-3, 60e-3], [7, 5]), None, Vec3::z() * 30e-3);
    let mut all = Vec::new();
    for n in 0..60_u64 {
        let side = if n % 2 == 0 { 1.0 } else { -1.0 };
        // Above corners, edges and faces.
        let (x, y) = ((n % 6 + 1) as f64 * 60e-3 / 7.0, (n / 6 + 1) as f64 * 5e-3 + 1e-9);
        let mut ball = moving(Vec3::new(x, y, 30e-3 + side * 1.5e-3), Vec3::new(0.01, 0.02, -side));
        ball.id = n;
        all.push(ball);
    }
    let mut engine = alone(BOX, contact, vec![sheet], Vec3::zeros(), spheres(), &all);
    run(&mut engine, 1500, 2e-6);
    assert_eq!(engine.contacts().begun, 60);
    for ball in engine.particles().owned() {
        let side = if ball.id % 2 == 0 { 1.0 } else { -1.0 };
        assert!(side * (ball.position[2] - 30e-3) > RADIUS && side * ball.velocity[2] > 0.5, "{ball:?}");
    }
}

#[test]
fn a_sphere_that_is_pressed_into_a_block_ends_the_run() {
    let contact = model(MATERIAL.pair);
    let block = mesh("block", cuboid(Vec3::repeat(20e-3)), None, Vec3::repeat(10e-3));
    for depth in [0.6, 1.5] {
        let ball = moving(Vec3::new(20e-3, 20e-3, 30e-3 + (1.0 - depth) * RADIUS), Vec3::zeros());
        let mut engine = alone(BOX, contact.clone(), vec![block.clone()], Vec3::zeros(), spheres(), &[ball]);
        let loads = [Load::default()];
        let said = engine.advance(&Comm::Solo, &loads, 1e-6).unwrap_err().to_string();
        assert!(said.contains("wall `block`"), "{said}");
    }
}

/// Spheres in a turning drum on this number of ranks: the states of the engines after some steps from the start or a state.
fn drum(ranks: usize, steps: usize, from: Option<&[Vec<u8>]>) -> (Vec<Vec<u8>>, Vec<Particle>) {
    let middle = Vec3::new(30e-3, 10e-3, 30e-3);
    let mut wall = mesh("drum", tube(12e-3, 40e-3, 64), None, middle);
    let Surface::Mesh(placed) = &mut wall.surface else { unreachable!() };
    placed.orientation = Quat::from_axis_angle(&-Vec3::x_axis(), std::f64::consts::FRAC_PI_2);
    wall.motion.angular_velocity = (Vec3::y() * 8.0).into();
    wall.motion.pivot = middle;
    let all: Vec<Particle> = (0..120)
        .map(|n| {
            let [i, j, k] = [n % 5, n / 5 % 8, n / 40].map(|i| i as f64);
            let at = Vec3::new(24e-3 + 2.3e-3 * i + 0.1e-3 * k, 15e-3 + 2.3e-3 * j, 27e-3 + 2.4e-3 * k);
            Particle { id: n, ..moving(at, Vec3::new(0.1, 0.05 * k, -0.3)) }
        })
        .collect();
    let params = NativeParams {
        contact: Some(model(MATERIAL.pair)),
        walls: vec![wall],
        gravity: GRAVITY,
        substeps: 1,
        ..NativeParams::default()
    };
    let cut = Decomposition::new(BOX, ranks).unwrap();
    let ended = on_threads(ranks, |comm| {
        let mut engine = Native::new(params.clone(), cut.clone(), comm.rank(), spheres(), &all).unwrap();
        if let Some(parts) = from {
            engine.restore(&comm, &SavedParts::divided(&comm, parts)).unwrap();
        }
        for _ in 0..steps {
            let loads = vec![Load::default(); engine.particles().owned];
            engine.advance(&comm, &loads, 1e-5).unwrap();
        }
        (engine.save(&Comm::Solo).unwrap(), engine.particles().owned().to_vec())
    });
    let (states, particles): (Vec<_>, Vec<_>) = ended.into_iter().unzip();
    let mut particles = particles.concat();
    particles.sort_by_key(|particle| particle.id);
    (states, particles)
}

#[test]
fn spheres_in_a_turning_drum_have_the_same_bits_on_1_and_4_ranks_and_from_a_state_and_stay_in_it() {
    let (half, _) = drum(3, 1700, None);
    let (_, one) = drum(1, 3000, None);
    assert_eq!(one, drum(4, 3000, None).1);
    assert_eq!(one, drum(2, 1300, Some(&half)).1);
    for ball in &one {
        let across = Vec3::new(ball.position[0] - 30e-3, 0.0, ball.position[2] - 30e-3).norm();
        assert!(across < 12e-3 - 0.9 * RADIUS, "{across}");
    }
    assert!(one.iter().any(|ball| ball.velocity().norm() > 0.01));
}
