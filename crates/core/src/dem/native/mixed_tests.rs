//! Claims about a crowd of unlike bodies between walls that move: the same bits on any number of ranks.

use super::cube_tests::cubes;
use super::wall_tests::{MATERIAL, plane};
use super::*;
use crate::comm::on_threads;
use crate::contact::ContactParams;
use crate::math::Quat;
use crate::shape::Sphere;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;

/// Closed in y and z.
pub(super) const CHANNEL: Domain =
    Domain { faces: Domain::faces([true, false, false]), cells: [20, 12, 8], dx: 1e-3 };
const STEPS: usize = 300;
pub(super) const DT: f64 = 2e-5;

/// A turning plate below, a belt on one side, and a ramp that rises.
fn walls() -> Vec<Wall> {
    let size = CHANNEL.size();
    let mut plate = plane("z-", Vec3::zeros(), Vec3::z());
    plate.motion.angular_velocity = (Vec3::z() * 100.0).into();
    plate.motion.pivot = Vec3::new(6e-3, 6e-3, 0.0);
    let mut belt = plane("y-", Vec3::zeros(), Vec3::y());
    belt.motion.velocity = Vec3::new(-0.8, 0.0, 0.0).into();
    let mut ramp = plane("ramp", Vec3::new(6e-3, size.y, 0.0), Vec3::new(0.0, -1.0, 0.4));
    ramp.motion.velocity = Vec3::new(0.0, -0.05, 0.1).into();
    ramp.motion.angular_velocity = Vec3::new(-20.0, 0.0, 0.0).into();
    ramp.motion.pivot = Vec3::new(6e-3, size.y, 0.0);
    ramp.material = 1;
    let side = plane("y+", Vec3::y() * size.y, -Vec3::y());
    let lid = plane("z+", Vec3::z() * size.z, -Vec3::z());
    vec![plate, belt, side, lid, ramp]
}

pub(super) fn templates() -> Arc<[Template]> {
    let sphere =
        |radius, material| Template { shape: Arc::new(Sphere { radius }), density: 2500.0, material };
    [sphere(0.8e-3, 0), sphere(0.5e-3, 1), cubes(1e-3)[0].clone()].into()
}

pub(super) fn params() -> NativeParams {
    let one: ContactModel = ContactParams { enlargement: 0.02e-3, ..MATERIAL }.into();
    let pairs =
        [0.4, 0.3, 0.3, 0.5].map(|restitution| crate::contact::PairParams { restitution, ..MATERIAL.pair });
    NativeParams {
        contact: Some(ContactModel { materials: vec![MATERIAL.material; 2], pairs: pairs.into(), ..one }),
        walls: walls(),
        // Strong, so that they soon slide along the walls.
        gravity: Vec3::new(0.0, 100.0, -500.0),
        substeps: 2,
        ..NativeParams::default()
    }
}

/// Two layers, thrown down and along the channel.
pub(super) fn crowd() -> Vec<Particle> {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    (0..40_u64)
        .map(|n| {
            let mut noise = |size: f64| Vec3::from_fn(|_, _| random.random_range(-size..size));
            let place =
                Vec3::new((n % 5) as f64 * 4.0, (n / 5 % 4) as f64 * 2.5 + 1.6, (n / 20) as f64 * 2.0 + 1.5);
            let position = CHANNEL.wrap(place * 1e-3 + noise(0.2e-3));
            let mut particle = Particle::at(1000 - 7 * n, (n % 3) as usize, position);
            let turn = noise(1.0);
            particle.set_orientation(&integrator::turned(&Quat::identity(), turn, 1.0));
            particle.velocity = (noise(0.5) + Vec3::new(1.5, 0.3, -0.8)).into();
            particle.angular_velocity = noise(200.0).into();
            particle
        })
        .collect()
}

/// All particles in order of id, contacts begun, how often a contact with a wall changed its rank, and all contacts.
pub(super) fn shaken(ranks: usize, templates: &Arc<[Template]>) -> (Vec<u8>, i64, usize, Vec<u8>) {
    let all = crowd();
    let results = on_threads(ranks, |comm| {
        let cut = Decomposition::new(CHANNEL, ranks).unwrap();
        let mut engine = Native::new(params(), cut, comm.rank(), templates.clone(), &all).unwrap();
        let (mut owners, mut handed) = (BTreeMap::new(), 0);
        let mut contacts = Vec::new();
        for step in 0..STEPS {
            let loads = vec![Load::default(); engine.particles().owned];
            engine.advance(&comm, &loads, DT).unwrap();
            let states = comm.all_gather(bytemuck::cast_slice(&engine.contact_states(&comm)).to_vec());
            let mut states: Vec<ContactState> = bytemuck::pod_collect_to_vec(&states.concat());
            states.sort_by_key(ContactState::key);
            contacts.extend_from_slice(bytemuck::cast_slice(&states));
            let records = comm.all_gather(engine.records().bytes().to_vec());
            for (rank, records) in records.iter().enumerate() {
                for (key, _) in Records::from_bytes(1, records).iter() {
                    let before = owners.insert((key.first, key.second), (rank, step));
                    let wall = ContactState::wall_of(key.second).is_some();
                    let handed_over = |(owner, last)| owner != rank && step == last + 1;
                    handed += usize::from(wall && before.is_some_and(handed_over));
                }
            }
        }
        let own: Vec<u8> = bytemuck::cast_slice(engine.particles().owned()).to_vec();
        let mut particles: Vec<Particle> = bytemuck::pod_collect_to_vec(&comm.all_gather(own).concat());
        particles.sort_unstable_by_key(|p| p.id);
        let mut begun = [engine.contacts().begun as i64];
        comm.sum(&mut begun);
        (bytemuck::cast_slice(&particles).to_vec(), begun[0], handed, contacts)
    });
    results.into_iter().next().unwrap()
}

#[test]
fn spheres_and_cubes_between_moving_walls_move_to_the_same_bits_on_1_2_3_4_and_8_ranks() {
    let (alone, begun, handed, contacts) = shaken(1, &templates());
    assert_eq!(alone.len(), 40 * size_of::<Particle>());
    let walls: std::collections::BTreeSet<_> = bytemuck::pod_collect_to_vec::<u8, ContactState>(&contacts)
        .iter()
        .filter_map(ContactState::wall)
        .collect();
    println!("{begun} contacts, of walls {walls:?}");
    assert!(begun > 100 && walls.len() >= 3 && handed == 0);
    for ranks in [2, 3, 4, 8] {
        let (together, theirs, handed, their_contacts) = shaken(ranks, &templates());
        println!("{ranks} ranks: {handed} contacts with walls changed rank");
        assert_eq!(theirs, begun, "contacts on {ranks} ranks");
        assert!(together == alone && their_contacts == contacts, "{ranks} ranks differ");
        assert!(ranks < 4 || handed > 3, "{handed} handed over");
    }
}

#[test]
fn a_run_between_moving_walls_resumed_half_way_continues_to_the_same_bits_on_1_2_and_4_ranks() {
    let all = crowd();
    let advance = |engine: &mut Native, comm: &Comm, steps: usize| {
        for _ in 0..steps {
            let loads = vec![Load::default(); engine.particles().owned];
            engine.advance(comm, &loads, DT).unwrap();
        }
    };
    let gathered = |engine: &Native, comm: &Comm| {
        let own: Vec<u8> = bytemuck::cast_slice(engine.particles().owned()).to_vec();
        let mut all: Vec<Particle> = bytemuck::pod_collect_to_vec(&comm.all_gather(own).concat());
        all.sort_unstable_by_key(|p| p.id);
        all
    };
    let engine = |ranks: usize, comm: &Comm, all: &[Particle]| {
        let cut = Decomposition::new(CHANNEL, ranks).unwrap();
        Native::new(params(), cut, comm.rank(), templates(), all).unwrap()
    };
    let whole = on_threads(2, |comm| {
        let mut engine = engine(2, &comm, &all);
        advance(&mut engine, &comm, 150);
        let middle = gathered(&engine, &comm);
        let records = comm.all_gather(engine.records().bytes().to_vec()).concat();
        let (substep, begun) = (engine.substep(), engine.contacts().begun);
        advance(&mut engine, &comm, 30);
        (middle, records, substep, begun, gathered(&engine, &comm))
    });
    let (middle, records, substep, begun, end) = &whole[0];
    let records = Records::from_bytes(1, records);
    let walls = records.iter().filter(|(key, _)| ContactState::wall_of(key.second).is_some()).count();
    assert!(walls > 5, "{walls} of {}", records.len());
    for ranks in [1, 2, 4] {
        on_threads(ranks, |comm| {
            let mut engine = engine(ranks, &comm, middle);
            engine.resume(&records, *substep, *begun);
            advance(&mut engine, &comm, 30);
            assert!(gathered(&engine, &comm) == *end, "{ranks} ranks");
        });
    }
}
