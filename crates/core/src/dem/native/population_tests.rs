//! Claims about particles that come and go between two steps.

use super::mixed_tests::{CHANNEL, DT, crowd, params, templates};
use super::*;
use crate::comm::on_threads;
use crate::dem::population::{known, numbered};

fn engine(comm: &Comm) -> Native {
    let cut = Decomposition::new(CHANNEL, comm.size()).unwrap();
    Native::new(params(), cut, comm.rank(), templates(), &crowd()).unwrap()
}

fn advance(engine: &mut Native, comm: &Comm, steps: u64) {
    for _ in 0..steps {
        let pull = |p: &Particle| Load { force: Vec3::repeat(1e-5 * (p.id % 5) as f64), ..Load::default() };
        let loads: Vec<Load> = engine.particles().owned().iter().map(pull).collect();
        engine.advance(comm, &loads, DT).unwrap();
    }
}

/// Inserts four spheres above the crowd, of which each rank hands over some.
fn insert(engine: &mut Native, comm: &Comm) {
    let new = |n: usize| Particle {
        velocity: [0.5, 0.0, -1.0],
        ..Particle::at(0, 1, Vec3::new(3e-3 + 5e-3 * n as f64, 2e-3, 7e-3))
    };
    let own: Vec<Particle> = (0..4).map(new).skip(comm.rank()).step_by(comm.size()).collect();
    let (all, _) = numbered(comm, &own, engine.next_id().unwrap());
    engine.insert(&all, 0.0).unwrap();
}

/// Particles with their loads, and records, of all ranks.
type Whole = (Vec<(Particle, [[f64; 3]; 2])>, Records, Option<u64>);

fn whole(engine: &Native, comm: &Comm) -> Whole {
    let owned = engine.particles().owned();
    let loads: Vec<[[f64; 3]; 2]> =
        engine.loads().iter().map(|load| [load.force.into(), load.torque.into()]).collect();
    assert_eq!(owned.len(), loads.len());
    let of: Vec<Particle> =
        bytemuck::pod_collect_to_vec(&comm.all_gather(bytemuck::cast_slice(owned).to_vec()).concat());
    let loads: Vec<[[f64; 3]; 2]> =
        bytemuck::pod_collect_to_vec(&comm.all_gather(bytemuck::cast_slice(&loads).to_vec()).concat());
    let mut particles: Vec<_> = of.into_iter().zip(loads).collect();
    particles.sort_unstable_by_key(|(particle, _)| particle.id);
    let records = Records::from_bytes(1, &comm.all_gather(engine.records().bytes().to_vec()).concat());
    (particles, History::new(records).records().clone(), engine.next_id())
}

#[test]
fn particles_that_come_and_go_leave_the_same_bits_on_1_to_4_ranks_and_after_a_resume_on_others() {
    let run = |ranks: usize| {
        on_threads(ranks, |comm| {
            let mut engine = engine(&comm);
            advance(&mut engine, &comm, 100);
            insert(&mut engine, &comm);
            advance(&mut engine, &comm, 20);
            let gone = known(&comm, &[1000, 993, 1001], engine.particles().owned()).unwrap();
            engine.remove(&gone).unwrap();
            let (parts, middle) = (comm.all_gather(engine.save(&comm).unwrap()), whole(&engine, &comm));
            advance(&mut engine, &comm, 100);
            (parts, [middle, whole(&engine, &comm)])
        })
        .swap_remove(0)
    };
    let (_, alone) = run(1);
    assert_eq!((alone[0].0.len(), alone[0].2), (41, Some(1005)), "40 + 4 - 3, and no id twice");
    for ranks in [2, 4] {
        let (parts, states) = run(ranks);
        assert!(states == alone, "{ranks} ranks");
        for readers in [1, 3] {
            on_threads(readers, |comm| {
                let mut engine = engine(&comm);
                engine.restore(&comm, &SavedParts::divided(&comm, &parts)).unwrap();
                assert!(whole(&engine, &comm) == alone[0], "from {ranks} to {readers} ranks");
                advance(&mut engine, &comm, 100);
                assert!(whole(&engine, &comm) == alone[1], "from {ranks} to {readers} ranks");
            });
        }
    }
}

#[test]
fn nothing_is_remembered_of_the_contacts_of_a_particle_that_leaves_on_2_ranks() {
    on_threads(2, |comm| {
        let mut engine = engine(&comm);
        let mut touching = Records::default();
        for _ in 0..400 {
            advance(&mut engine, &comm, 1);
            touching = whole(&engine, &comm).1;
            touching.retain(|key, _| ContactState::wall_of(key.second).is_none());
            if !touching.is_empty() {
                break;
            }
        }
        let gone = touching.iter().next().unwrap().0.second;
        engine.remove(&[gone]).unwrap();
        let ids = |state: &ContactState| [state.first, state.second];
        assert!(engine.contact_states(&Comm::Solo).iter().all(|state| !ids(state).contains(&gone)));
        assert!(engine.records().iter().all(|(key, _)| ![key.first, key.second].contains(&gone)));
        advance(&mut engine, &comm, 10);
    });
}

#[test]
fn a_particle_that_is_too_large_for_its_images_is_refused() {
    let sphere =
        |radius| Template { shape: Arc::new(crate::shape::Sphere { radius }), density: 1.0, material: 0 };
    let domain = Domain { faces: Domain::faces([true; 3]), cells: [8; 3], dx: 1e-3 };
    let params = NativeParams { walls: Vec::new(), ..params() };
    let cut = Decomposition::new(domain, 1).unwrap();
    let templates = [sphere(1.8e-3), sphere(5.7e-3)].into();
    let first = [Particle::at(0, 0, Vec3::zeros())];
    let mut engine = Native::new(params, cut, 0, templates, &first).unwrap();
    let refused = engine.insert(&[Particle::at(1, 1, Vec3::repeat(4e-3))], 0.0).unwrap_err().to_string();
    assert!(refused.contains("for the periodic images"), "{refused}");
    engine.insert(&[Particle::at(1, 0, Vec3::repeat(4e-3))], 0.0).unwrap();
    assert_eq!((engine.particles().owned, engine.next_id()), (2, Some(2)));
}
