//! Claims about the native engine: impacts first, then ranks.

use super::*;
use crate::comm::on_threads;
use crate::contact::{ContactParams, DampingLaw, ElasticLaw, Geometry, Material, PairParams};
use crate::domain::Domain;
use crate::shape::Sphere;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

const MATERIAL: ContactParams = ContactParams {
    material: Material { youngs_modulus: 5e6, poisson_ratio: 0.25 },
    pair: PairParams {
        restitution: 0.926,
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

/// No gravity, no walls, one sub-step.
pub(super) fn dry(contact: ContactParams) -> NativeParams {
    NativeParams { contact: Some(contact.into()), substeps: 1, ..NativeParams::default() }
}

/// [`MATERIAL`] with another coefficient of restitution.
pub(super) fn restitution(restitution: f64) -> ContactParams {
    let pair = PairParams { restitution, ..MATERIAL.pair };
    ContactParams { pair, ..MATERIAL }
}

const BOX: Domain = Domain { faces: Domain::faces([true; 3]), cells: [16, 16, 16], dx: 1e-3 };
pub(super) const RADIUS: f64 = 1e-3;

pub(super) fn templates() -> Arc<[Template]> {
    [RADIUS, 0.7e-3]
        .map(|radius| Template { shape: Arc::new(Sphere { radius }), material: 0, density: 2500.0 })
        .into()
}

pub(super) fn engine(params: NativeParams, ranks: usize, rank: usize, all: &[Particle]) -> Native {
    let cut = Decomposition::new(BOX, ranks).unwrap();
    Native::new(params, cut, rank, templates(), all).unwrap()
}

/// Advances with no loads.
pub(super) fn advance(engine: &mut Native, comm: &Comm, dt: f64) -> Result<()> {
    let loads = vec![Load::default(); engine.particles().owned];
    engine.advance(comm, &loads, dt)
}

/// Advances on one rank for some steps.
fn run(params: NativeParams, all: &[Particle], steps: usize, dt: f64) -> Native {
    let mut engine = engine(params, 1, 0, all);
    for _ in 0..steps {
        advance(&mut engine, &Comm::Solo, dt).unwrap();
    }
    engine
}

fn moving(id: u64, template: usize, position: Vec3, velocity: Vec3) -> Particle {
    let mut particle = Particle::at(id, template, position);
    particle.velocity = velocity.into();
    particle
}

/// Two equal spheres about to meet head-on at `speed`, with a gap of `gap`, and the duration of their Hertz impact.
pub(super) fn head_on(speed: f64, gap: f64) -> ([Particle; 2], f64) {
    let middle = Vec3::repeat(8e-3);
    let half = Vec3::new(RADIUS + 0.5 * gap, 0.0, 0.0);
    let velocity = Vec3::new(0.5 * speed, 0.0, 0.0);
    let pair = [moving(0, 0, middle - half, velocity), moving(1, 0, middle + half, -velocity)];
    // Hertz: T = 2.943 (m_e^2 / (k^2 u0))^(1/5) (15/16)^(2/5) with F = (4/3) E* sqrt(R_e) d^1.5.
    let mass = 0.5 * templates()[0].mass();
    let stiffness = 16.0 / 15.0 * PairLaw::new(&MATERIAL.into(), 0, 0).modulus * (0.5 * RADIUS).sqrt();
    (pair, 2.943_275_184_724_703 * (mass / stiffness).powf(0.4) * speed.powf(-0.2))
}

/// Linear momentum, and angular momentum about `origin` with nearest images.
fn momenta(engine: &Native, origin: Vec3) -> (Vec3, Vec3) {
    let store = engine.particles();
    let (mut linear, mut angular) = (Vec3::zeros(), Vec3::zeros());
    for particle in &store.particles {
        let momentum = particle.velocity() * store.template(particle).mass();
        let lever = BOX.nearest_image(particle.position() - origin);
        linear += momentum;
        angular += lever.cross(&momentum) + Vec3::from(particle.angular_momentum);
    }
    (linear, angular)
}

#[test]
fn a_dry_head_on_impact_gives_the_set_restitution() {
    for (set, expected) in [(0.5, 0.50017), (0.926, 0.926), (1.0, 1.0)] {
        let params = dry(restitution(set));
        let (pair, duration) = head_on(0.1, 1e-8);
        let engine = run(params, &pair, 200, duration / 100.0);
        assert_eq!(engine.contacts().count, 0, "they have parted");
        let [a, b] = [0, 1].map(|i| engine.particles().particles[i].velocity[0]);
        let measured = (b - a) / 0.1;
        println!("restitution set {set}, expected {expected}, measured {measured:.5}");
        assert!((measured - expected).abs() < 0.002, "set {set}, measured {measured}");
    }
}

#[test]
fn an_impact_lasts_as_long_and_goes_as_deep_as_hertz_says() {
    let params = dry(restitution(1.0));
    let (pair, duration) = head_on(0.01, 0.0);
    let mut engine = engine(params, 1, 0, &pair);
    let (mut contact, mut deepest) = (0, 0.0_f64);
    for _ in 0..600 {
        advance(&mut engine, &Comm::Solo, duration / 400.0).unwrap();
        contact += engine.contacts().count;
        deepest = deepest.max(engine.contacts().max_depth);
    }
    println!(
        "duration over Hertz {:.4}, depth over Hertz {:.4}",
        contact as f64 / 400.0,
        deepest / (duration * 0.01 / 2.943)
    );
    assert!((contact as f64 / 400.0 - 1.0).abs() < 0.01, "{contact} of 400 steps");
    // T = 2.943 d_max / u0.
    assert!((deepest / (duration * 0.01 / 2.943) - 1.0).abs() < 0.01);
}

#[test]
fn an_oblique_frictional_impact_conserves_momentum_and_angular_momentum_inside_and_across_the_box() {
    let size = BOX.size().x;
    // Inside, through a face, an edge, and a corner.
    for middle in [
        Vec3::repeat(0.5 * size),
        Vec3::new(0.0, 0.3 * size, 0.4 * size),
        Vec3::new(0.0, size, 0.4 * size),
        Vec3::new(0.0, size, 0.0),
    ] {
        let towards = Vec3::new(0.6, 0.5, 0.62).normalize();
        let aside = towards.cross(&Vec3::z()).normalize();
        let half = towards * (0.85e-3 + 1e-7);
        let velocity = towards * 0.05 + aside * 0.03;
        let mut pair = [
            moving(0, 0, BOX.wrap(middle - half), velocity),
            moving(1, 1, BOX.wrap(middle + half), -velocity * 2.0),
        ];
        pair[0].angular_velocity = [10.0, -3.0, 50.0];
        let engine = run(dry(MATERIAL), &pair, 0, 1.0);
        let origin = BOX.wrap(middle);
        let (linear, angular) = momenta(&engine, origin);
        let (_, duration) = head_on(0.15, 0.0);
        let engine = run(dry(MATERIAL), &pair, 600, duration / 200.0);
        assert_eq!((engine.contacts().begun, engine.contacts().count), (1, 0));
        let (linear_after, angular_after) = momenta(&engine, origin);
        println!(
            "momentum off by {:.1e}, angular momentum by {:.1e}",
            (linear_after - linear).norm() / linear.norm(),
            (angular_after - angular).norm() / angular.norm()
        );
        assert!((linear_after - linear).norm() < 1e-12 * linear.norm(), "{middle:?}");
        assert!((angular_after - angular).norm() < 1e-12 * angular.norm(), "{middle:?}");
        let spin = Vec3::from(engine.particles().particles[1].angular_velocity);
        assert!(spin.norm() > 1.0, "friction spins the second sphere: {spin:?}");
    }
}

#[test]
fn an_impact_through_a_corner_is_the_impact_inside_the_box() {
    let (pair, duration) = head_on(0.1, 1e-7);
    let shifted = pair.map(|mut p| {
        p.position = BOX.wrap(p.position() + Vec3::repeat(8e-3)).into();
        p
    });
    let [inside, corner] = [pair, shifted].map(|pair| run(dry(MATERIAL), &pair, 300, duration / 100.0));
    for i in 0..2 {
        let [a, b] = [&inside, &corner].map(|e| e.particles().particles[i].velocity());
        assert!((a - b).norm() < 1e-9 * a.norm());
    }
}

#[test]
fn a_pressed_pair_repels_with_the_lens_law_of_its_depth() {
    for depth in [1e-5, 1e-4] {
        let (pair, _) = head_on(0.0, -depth);
        let engine = run(dry(MATERIAL), &pair, 1, 1e-12);
        let (a, b) = (&engine.particles().particles[0], &engine.particles().particles[1]);
        let distance = pair[1].position[0] - pair[0].position[0];
        let d = 2.0 * RADIUS - distance;
        let volume = std::f64::consts::PI * d * d * (distance + 4.0 * RADIUS) / 12.0;
        let modulus = 5e6 / (2.0 * (1.0 - 0.0625));
        let lens = 4.0 / (3.0 * std::f64::consts::PI.sqrt()) * modulus * (volume * d).sqrt();
        println!("depth {depth:e} m: off the lens law by {:.1e}", b.contact_force[0] / lens - 1.0);
        assert!((b.contact_force[0] / lens - 1.0).abs() < 1e-12);
        assert!((a.contact_force[0] / -lens - 1.0).abs() < 1e-12);
    }
}

#[test]
fn gross_sliding_is_resisted_with_the_kinetic_coefficient_times_the_normal_force() {
    let (mut pair, _) = head_on(0.0, -1e-5);
    pair[0].velocity = [0.0, 0.5, 0.0];
    pair[1].velocity = [0.0, -0.5, 0.0];
    let engine = run(dry(MATERIAL), &pair, 1, 1e-12);
    let [x, y, _] = engine.particles().particles[0].contact_force;
    assert!((y / x - 0.16).abs() < 1e-5, "against the motion: {y} to {x}");
}

#[test]
fn damping_is_latched_on_approach_only() {
    // Two overlapping spheres part while a load pushes them together again.
    let (mut pair, _) = head_on(0.0, -1e-6);
    pair[0].velocity = [-1e-3, 0.0, 0.0];
    pair[1].velocity = [1e-3, 0.0, 0.0];
    let mut engine = engine(dry(MATERIAL), 1, 0, &pair);
    let loads = [0.2, -0.2].map(|force| Load { force: Vec3::new(force, 0.0, 0.0), torque: Vec3::zeros() });
    let mut latched = None;
    for _ in 0..400 {
        let approach = engine.particles().particles[0].velocity[0];
        engine.advance(&Comm::Solo, &loads, 1e-7).unwrap();
        let damping = engine.records().iter().next().unwrap().1[0];
        match latched {
            None if approach <= 0.0 => assert!(damping < 0.0, "still parting"),
            None => latched = Some(damping),
            Some(before) => assert!((damping - before).abs() < 1e-300, "latched once"),
        }
    }
    assert!(latched.is_some_and(|damping| damping > 0.0), "they did turn round");
}

#[test]
fn gravity_alone_gives_free_fall_from_the_first_step_on() {
    let params = NativeParams { gravity: Vec3::new(0.0, 0.0, -9.81), substeps: 4, ..dry(MATERIAL) };
    let all = [Particle::at(3, 0, Vec3::repeat(8e-3))];
    let engine = run(params, &all, 20, 1e-3);
    let fallen = engine.particles().particles[0];
    assert!((fallen.position[2] - (8e-3 - 0.5 * 9.81 * 4e-4)).abs() < 1e-15);
    assert!((fallen.velocity[2] + 9.81 * 0.02).abs() < 1e-14);
}

#[test]
fn free_flight_under_loads_that_jump_is_a_chain_of_exact_parabolas_for_1_and_10_substeps() {
    for substeps in [1, 10] {
        let gravity = Vec3::new(0.0, 0.0, -9.81);
        let params = NativeParams { gravity, substeps, ..dry(MATERIAL) };
        let (mass, moment) = (templates()[0].mass(), templates()[0].inertia().x);
        let mut engine = engine(params, 1, 0, &[Particle::at(0, 0, Vec3::repeat(8e-3))]);
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let dt = 1e-4;
        let (mut x, mut v, mut spin) = (Vec3::repeat(8e-3), Vec3::zeros(), Vec3::zeros());
        let mut impulse = Vec3::zeros();
        let (mut off, mut furthest) = (0.0_f64, 0.0_f64);
        for _ in 0..1000 {
            let mut jump = || Vec3::from_fn(|_, _| random.random_range(-1.0..1.0));
            let load = Load { force: jump() * (20.0 * mass), torque: jump() * 1e-9 };
            engine.advance(&Comm::Solo, &[load], dt).unwrap();
            let acceleration = load.force / mass + gravity;
            x += v * dt + acceleration * (0.5 * dt * dt);
            v += acceleration * dt;
            impulse += (load.force + gravity * mass) * dt;
            spin += load.torque * (dt / moment);
            furthest = furthest.max(x.norm());
            let particle = engine.particles().particles[0];
            let apart = BOX.nearest_image(particle.position() - BOX.wrap(x)).norm();
            off = off.max(apart / furthest);
            off = off.max((particle.velocity() - v).norm() / v.norm());
            off = off.max((particle.velocity() * mass - impulse).norm() / impulse.norm());
            off = off.max((particle.angular_velocity() - spin).norm() / spin.norm());
        }
        println!("{substeps} sub-steps: off by {off:.1e}, {furthest:.2} m");
        assert!(furthest > 2.0 * BOX.size().x, "it went round");
        assert!(off < 1e-12, "{substeps} sub-steps: {off:e}");
    }
}

#[test]
fn sampled_contacts_bounce_much_like_exact_ones() {
    let params = dry(ContactParams { geometry: Geometry::Sampled { samples: 8 }, ..MATERIAL });
    let (pair, duration) = head_on(0.1, 1e-7);
    let engine = run(params, &pair, 60, duration / 30.0);
    let [a, b] = [0, 1].map(|i| engine.particles().particles[i].velocity[0]);
    assert!(((b - a) / 0.1 - 0.926).abs() < 0.1, "{}", (b - a) / 0.1);
}

#[test]
fn what_leaves_the_range_of_the_method_is_reported_by_its_rank_and_no_rank_hangs_on_4_ranks() {
    let good = Particle::at(1, 0, Vec3::new(2e-3, 2e-3, 2e-3));
    let at = Vec3::new(13e-3, 13e-3, 13e-3);
    let fast = moving(17, 0, at, Vec3::new(20.0, 0.0, 0.0));
    let cases: [(&[Particle], &str); 4] = [
        (&[good, fast], "particle 17 at (1.3"),
        (&[good, moving(17, 0, at, Vec3::repeat(f64::NAN))], "not finite"),
        (&[good, Particle::at(17, 0, at), Particle::at(18, 1, at)], "particle 18: overlap"),
        (
            &[good, Particle::at(17, 0, at), Particle::at(18, 1, at + Vec3::y() * 0.3e-3)],
            "deep, more than a quarter",
        ),
    ];
    for (all, words) in cases {
        let outcomes = on_threads(4, |comm| {
            let mut engine = engine(dry(MATERIAL), 4, comm.rank(), all);
            let outcome = advance(&mut engine, &comm, 1e-4);
            let finite = engine.particles().owned().iter().all(|p| p.position().amax() < 1.0);
            assert!(finite, "every position stays usable");
            outcome.err().map(|error| (error.exit_code(), error.to_string()))
        });
        let failed: Vec<_> = outcomes.into_iter().flatten().collect();
        assert_eq!(failed.len(), 1, "one rank knows: {failed:?}");
        assert!(failed[0].0 == 3 && failed[0].1.contains(words), "{failed:?}");
    }
}

/// Bytes of all particles in order of id.
pub(super) fn gathered(comm: &Comm, engine: &Native) -> Vec<u8> {
    let own: Vec<u8> = bytemuck::cast_slice(engine.particles().owned()).to_vec();
    let mut all: Vec<Particle> = comm
        .all_gather(own)
        .iter()
        .flat_map(|bytes| bytemuck::pod_collect_to_vec::<u8, Particle>(bytes))
        .collect();
    all.sort_unstable_by_key(|p| p.id);
    bytemuck::cast_slice(&all).to_vec()
}

pub(super) const CROWDED: Domain = Domain { faces: Domain::faces([true; 3]), cells: [12, 12, 12], dx: 1e-3 };

fn crowd(ranks: usize, rank: usize, all: &[Particle]) -> Native {
    let cut = Decomposition::new(CROWDED, ranks).unwrap();
    Native::new(shaken(), cut, rank, templates(), all).unwrap()
}

/// Touching spheres of two sizes on a shaken lattice that fills the box, drifting through its corners.
pub(super) fn cluster() -> Vec<Particle> {
    let mut random = ChaCha8Rng::seed_from_u64(11);
    (0..6 * 6 * 6_u64)
        .map(|n| {
            let place = Vec3::new((n % 6) as f64, (n / 6 % 6) as f64, (n / 36) as f64) * 2e-3;
            let mut noise = |size: f64| Vec3::from_fn(|_, _| random.random_range(-size..size));
            let position = CROWDED.wrap(place + noise(0.15e-3));
            let mut particle = moving(2000 - 5 * n, (n % 3 / 2) as usize, position, noise(0.8));
            particle.velocity[0] += 1.0;
            particle.velocity[1] -= 0.7;
            particle.velocity[2] += 0.8;
            particle.angular_velocity = noise(300.0).into();
            particle
        })
        .collect()
}

/// Enlarged bodies under gravity, three sub-steps.
pub(super) fn shaken() -> NativeParams {
    NativeParams {
        gravity: Vec3::new(0.0, 0.0, -9.81),
        substeps: 3,
        ..dry(ContactParams { enlargement: 0.05e-3, ..MATERIAL })
    }
}

/// A load that depends on the particle only.
fn stirring(particle: &Particle) -> Load {
    Load {
        force: Vec3::new(1e-4, -1e-4, 1e-4) * (particle.id % 7) as f64,
        torque: Vec3::new(1e-8, 0.0, -1e-8) * (particle.id % 5) as f64,
    }
}

pub(super) fn shake(engine: &mut Native, comm: &Comm, steps: usize) {
    for _ in 0..steps {
        let loads: Vec<Load> = engine.particles().owned().iter().map(stirring).collect();
        engine.advance(comm, &loads, 4.5e-5).unwrap();
    }
}

#[test]
fn a_cluster_that_crosses_faces_edges_and_corners_moves_to_the_same_bits_on_1_to_8_ranks() {
    let all = cluster();
    let steps = 120;
    let shaken = |ranks: usize| {
        let results = on_threads(ranks, |comm| {
            let mut engine = crowd(ranks, comm.rank(), &all);
            shake(&mut engine, &comm, steps);
            let mut numbers = [engine.contacts().begun as i64, engine.contacts().count as i64];
            comm.sum(&mut numbers);
            (gathered(&comm, &engine), numbers)
        });
        results.into_iter().next().unwrap()
    };
    let (alone, numbers) = shaken(1);
    assert_eq!(alone.len(), all.len() * size_of::<Particle>());
    assert!(numbers[0] > 400 && numbers[1] > 50, "a lively cluster: {numbers:?}");
    let travelled = 1.0 * 4.5e-5 * steps as f64;
    assert!(travelled > 5.0 * CROWDED.dx, "through blocks and box");
    for ranks in [2, 3, 4, 6, 8] {
        let (together, theirs) = shaken(ranks);
        assert_eq!(theirs, numbers, "contacts on {ranks} ranks");
        assert!(together == alone, "{ranks} ranks differ");
    }
}

#[test]
fn a_run_resumed_on_another_number_of_ranks_continues_to_the_same_bits_on_1_2_and_4_ranks() {
    let all = cluster();
    let whole = on_threads(2, |comm| {
        let mut engine = crowd(2, comm.rank(), &all);
        shake(&mut engine, &comm, 15);
        let middle = gathered(&comm, &engine);
        let records = comm.all_gather(engine.records().bytes().to_vec()).concat();
        shake(&mut engine, &comm, 15);
        (middle, records, gathered(&comm, &engine))
    });
    let (middle, records, end) = &whole[0];
    let middle: Vec<Particle> = bytemuck::pod_collect_to_vec(middle);
    let records = Records::from_bytes(1, records);
    assert!(records.len() > 50);
    for ranks in [1, 2, 4] {
        on_threads(ranks, |comm| {
            let mut engine = crowd(ranks, comm.rank(), &middle);
            engine.resume(&records, 45, 0);
            shake(&mut engine, &comm, 15);
            assert!(gathered(&comm, &engine) == *end, "{ranks} ranks");
        });
    }
}

#[test]
fn a_contact_keeps_its_damping_when_its_bodies_change_ranks_on_8_ranks() {
    // A slow impact in a fast frame: the pair crosses several blocks while it touches.
    let (mut pair, duration) = head_on(0.02, 1e-9);
    for particle in &mut pair {
        particle.velocity[0] += 36.0;
        particle.velocity[1] += 27.0;
        particle.velocity[2] -= 30.0;
    }
    let dt = duration / 200.0;
    assert!(duration * 27.0 > 8.0 * BOX.dx, "crosses blocks during the contact");
    let seen = on_threads(8, |comm| {
        let mut engine = engine(dry(MATERIAL), 8, comm.rank(), &pair);
        let mut seen = Vec::new();
        for _ in 0..240 {
            advance(&mut engine, &comm, dt).unwrap();
            let records = comm.all_gather(engine.records().bytes().to_vec());
            let owners: Vec<usize> = (0..8).filter(|&r| !records[r].is_empty()).collect();
            let all = Records::from_bytes(1, &records.concat());
            assert!(all.len() <= 1, "kept once");
            seen.extend(all.iter().next().map(|(_, memory)| (owners[0], memory[0])));
        }
        let mut begun = [engine.contacts().begun as i64];
        comm.sum(&mut begun);
        assert_eq!(begun, [1], "one contact, begun once");
        seen
    });
    let seen = &seen[0];
    let ranks: std::collections::BTreeSet<_> = seen.iter().map(|(rank, _)| *rank).collect();
    assert!(ranks.len() >= 3, "responsibility moved: {ranks:?}");
    for (_, damping) in seen {
        assert_eq!(damping.to_bits(), seen[0].1.to_bits());
    }
    let expected = crate::contact::law::damping_number(0.926) / 0.02;
    assert!((seen[0].1 / expected - 1.0).abs() < 1e-6);
}
