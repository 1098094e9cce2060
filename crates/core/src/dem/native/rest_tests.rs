//! Claims about contacts at rest: by every law they come to rest, bear the weight, and are as deep as the elastic force says.

use super::cube_tests::cubes;
use super::wall_tests::{GRAVITY, MATERIAL, TANK, alone, floor, run};
use super::*;
use crate::contact::{ContactParams, DampingLaw, ElasticLaw, PairParams};
use crate::shape::Sphere;

const RADIUS: f64 = 1e-3;
const EDGE: f64 = 1e-3;

fn spheres() -> Arc<[Template]> {
    [Template { shape: Arc::new(Sphere { radius: RADIUS }), density: 2500.0, material: 0 }].into()
}

/// Static depth (m) of a body under a force (N), of spheres by Hertz: `d = (F / ((4/3) E* sqrt(R_e)))^(2/3)`.
fn static_depth(law: &PairLaw, is_sphere: bool, force: f64, radius: f64, mass: f64, dt: f64) -> f64 {
    match law.elastic {
        ElasticLaw::OverlapVolume if !is_sphere => {
            3.0 * std::f64::consts::PI.sqrt() * force / (4.0 * law.modulus * EDGE)
        }
        // Its face is as stiff as the sub-step resolves.
        ElasticLaw::OverlapEnergy if !is_sphere => 4.0 * force / mass * dt * dt,
        _ => (force / (4.0 / 3.0 * law.modulus * radius.sqrt())).powf(2.0 / 3.0),
    }
}

/// A pile of `count` spheres or cubes on the floor, each as deep in the one below as `deep` says in parts of the static depth: of
/// each contact, from the floor up, the least and the greatest force of the last of `steps` steps over its load, and the
/// depth at the end over the static one.
fn pile(contact: ContactParams, is_sphere: bool, count: u64, deep: f64, steps: usize) -> Vec<[f64; 3]> {
    let dt = 5e-6;
    let (templates, half) = if is_sphere { (spheres(), RADIUS) } else { (cubes(EDGE), 0.5 * EDGE) };
    let (mass, radius) = (templates[0].mass(), 0.5 * templates[0].shape.equivalent_diameter());
    let law = PairLaw::new(&contact.into(), 0, 0);
    // By contact, from the floor up: load and static depth.
    let loads: Vec<[f64; 2]> = (0..count)
        .map(|n| {
            let load = (count - n) as f64 * mass * 9.81;
            let part = if n == 0 { 1.0 } else { 0.5 };
            [load, static_depth(&law, is_sphere, load, part * radius, part * mass, dt)]
        })
        .collect();
    let mut height = -half;
    let all: Vec<Particle> = (0..count)
        .map(|n| {
            height += 2.0 * half - deep * loads[n as usize][1];
            Particle::at(n, 0, Vec3::new(3.1e-3, 4.2e-3, height))
        })
        .collect();
    let mut engine = alone(TANK, contact.into(), vec![floor()], GRAVITY, templates, &all);
    run(&mut engine, steps, dt);
    let mut rows = vec![[f64::INFINITY, 0.0, 0.0]; count as usize];
    for _ in 0..100 {
        run(&mut engine, 1, dt);
        let mut states = engine.contact_states(&Comm::Solo);
        states.sort_by(|a, b| a.point[2].total_cmp(&b.point[2]));
        for (n, row) in rows.iter_mut().enumerate() {
            let (force, depth) =
                states.get(n).map_or((0.0, 0.0), |state| (Vec3::from(state.force).norm(), state.depth));
            let force = force / loads[n][0];
            *row = [row[0].min(force), row[1].max(force), depth / loads[n][1]];
        }
    }
    rows
}

/// All laws with this restitution.
fn laws(restitution: f64) -> impl Iterator<Item = ContactParams> {
    let pair = PairParams { restitution, ..MATERIAL.pair };
    [ElasticLaw::OverlapVolume, ElasticLaw::OverlapEnergy, ElasticLaw::Hertz]
        .into_iter()
        .flat_map(|law| [DampingLaw::HuntCrossley, DampingLaw::Tsuji].map(|damping| (law, damping)))
        .map(move |(law, damping)| ContactParams { pair, law, damping, ..MATERIAL })
}

fn assert_at_rest(contact: &ContactParams, is_sphere: bool, rows: &[[f64; 3]]) {
    let (law, damping, restitution) = (contact.law, contact.damping, contact.pair.restitution);
    let what = format!("{} {law:?} {damping:?} {restitution}", if is_sphere { "sphere" } else { "cube" });
    println!("{what}: {rows:.6?}");
    // An energy of the volume alone lets a face tilt by its depth, a tenth of a millionth of its edge, and no dashpot damps that.
    let tilts = law == ElasticLaw::OverlapEnergy && !is_sphere;
    let (of_force, of_depth) = if tilts { (1e-2, 0.5) } else { (1e-6, 2e-3) };
    for [least, greatest, depth] in rows {
        assert!((least - 1.0).abs() < of_force && (greatest - 1.0).abs() < of_force, "{what}: {rows:?}");
        assert!((depth - 1.0).abs() < of_depth, "{what}: {rows:?}");
    }
}

#[test]
fn a_pile_that_just_touches_comes_to_rest_under_its_weight_by_every_law_and_restitution() {
    for is_sphere in [true, false] {
        for (restitution, steps) in
            [(0.05, 20_000), (0.1, 20_000), (0.3, 20_000), (0.5, 20_000), (0.65, 20_000), (0.9, 60_000)]
        {
            for contact in laws(restitution) {
                assert_at_rest(&contact, is_sphere, &pile(contact, is_sphere, 2, 0.0, steps));
            }
        }
    }
}

#[test]
fn a_body_in_equilibrium_stays_at_rest_also_if_nothing_damps_it() {
    for is_sphere in [true, false] {
        for contact in laws(1.0) {
            // Spheres are Hertz's but for a part of 3e-4 of the depth, about which they oscillate.
            let rows = pile(contact, is_sphere, 1, 1.0, 2000);
            println!("{is_sphere} {:?}: {rows:?}", contact.law);
            let [least, greatest, depth] = rows[0];
            assert!(least > 0.999 && greatest < 1.001 && (depth - 1.0).abs() < 1e-3, "{rows:?}");
        }
    }
}

#[test]
fn a_cube_that_rocks_on_its_face_keeps_three_quarters_of_its_energy_where_bouncing_ends() {
    let pair = PairParams { restitution: 0.5, ..MATERIAL.pair };
    for damping in [DampingLaw::HuntCrossley, DampingLaw::Tsuji] {
        let contact = ContactParams { pair, damping, ..MATERIAL };
        let dt = 1e-6;
        let law = PairLaw::new(&contact.into(), 0, 0);
        let mass = cubes(EDGE)[0].mass();
        let depth = static_depth(&law, false, mass * 9.81, 0.0, mass, dt);
        let at = Vec3::new(3.1e-3, 4.2e-3, 0.5 * EDGE - depth);
        let mut energies = Vec::new();
        for rocks in [false, true] {
            let mut cube = Particle::at(0, 0, at);
            // So slow that the whole face stays in contact.
            let speed = 0.1 * depth * (9.81_f64 / depth).sqrt();
            if rocks {
                cube.angular_velocity = [speed / (0.5 * EDGE), 0.0, 0.0];
            } else {
                cube.velocity = [0.0, 0.0, speed];
            }
            let mut engine = alone(TANK, contact.into(), vec![floor()], GRAVITY, cubes(EDGE), &[cube]);
            let period = std::f64::consts::TAU * (depth / 9.81).sqrt();
            let steps = (period / dt).ceil() as usize;
            let peak = |engine: &mut Native| {
                (0..steps)
                    .map(|_| {
                        run(engine, 1, dt);
                        let body = &engine.particles().particles[0];
                        if rocks {
                            body.angular_velocity().x.abs() * 0.5 * EDGE
                        } else {
                            body.velocity().z.abs()
                        }
                    })
                    .fold(0.0, f64::max)
            };
            let first = peak(&mut engine);
            for _ in 0..8 {
                peak(&mut engine);
            }
            let last = peak(&mut engine);
            println!(
                "{damping:?}, rocks {rocks}: {first:.3e} m/s at first, {last:.3e} nine periods of {period:.2e} s later"
            );
            energies.push((last / first).powi(2));
        }
        println!("energy left: {energies:.3?}");
        assert!(energies[0] < 1e-9 && (0.7..0.8).contains(&energies[1]), "{energies:?}");
    }
}
