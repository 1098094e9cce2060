//! Claims about a run that is saved on some ranks and resumed on others.

use super::mixed_tests::{CHANNEL, DT, crowd, params, templates};
use super::*;
use crate::comm::on_threads;
use crate::contact::lubrication::Unresolved;
use crate::contact::{CohesionLaw, DampingLaw, ElasticLaw, FrictionLaw, Lubrication};

/// Laws of contacts.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Laws {
    /// Those of the crowd.
    Plain,
    /// With films and partial slip.
    Films,
    /// By which spheres that have touched hold on to each other.
    Necks,
}

/// A crowd with friction, between moving walls, in two sub-steps.
fn engine(laws: Laws, comm: &Comm, all: &[Particle]) -> Native {
    let mut params = params();
    if let Some(contact) = &mut params.contact {
        contact.damping = if laws == Laws::Films { DampingLaw::Tsuji } else { DampingLaw::HuntCrossley };
        if laws == Laws::Necks {
            (contact.law, contact.cohesion) = (ElasticLaw::Hertz, CohesionLaw::Jkr);
            contact.friction = FrictionLaw::Mindlin;
            contact.pairs.iter_mut().for_each(|pair| pair.work_of_adhesion = 5.0);
        }
        if laws == Laws::Films {
            let unresolved = Unresolved { range: 0.5, ..Unresolved::saturated() };
            let film = Lubrication { viscosity: 1e-3, roughness: 1e-6, cell: CHANNEL.dx, unresolved };
            contact.lubrication = Some(film);
            contact.friction = FrictionLaw::MindlinDeresiewicz;
        }
    }
    let cut = Decomposition::new(CHANNEL, comm.size()).unwrap();
    Native::new(params, cut, comm.rank(), templates(), all).unwrap()
}

/// Advances by steps `from..to` under loads that depend on the particle and the step.
fn advance(engine: &mut Native, comm: &Comm, (from, to): (u64, u64)) {
    for step in from..to {
        let stirred = |p: &Particle| Load {
            force: Vec3::new(1e-4, -2e-4, 1e-4) * ((p.id + step) % 7) as f64,
            torque: Vec3::new(1e-8, 0.0, -1e-8) * ((p.id + step) % 5) as f64,
        };
        let loads: Vec<Load> = engine.particles().owned().iter().map(stirred).collect();
        engine.advance(comm, &loads, DT).unwrap();
    }
}

/// Everything there is to know of the run, by all ranks: particles, memories, contacts, numbers.
#[derive(Debug, PartialEq)]
struct Whole {
    particles: Vec<Particle>,
    records: Records,
    states: Vec<ContactState>,
    begun: u64,
    count: usize,
    max_depth: u64,
    substep: u64,
}

fn gathered(engine: &Native, comm: &Comm) -> Whole {
    let all = |own: &[u8]| comm.all_gather(own.to_vec()).concat();
    let mut particles: Vec<Particle> =
        bytemuck::pod_collect_to_vec(&all(bytemuck::cast_slice(engine.particles().owned())));
    particles.sort_unstable_by_key(|p| p.id);
    let records = Records::from_bytes(engine.context.params.memory(), &all(engine.records().bytes()));
    let records = History::new(records).records().clone();
    let states = engine.contact_states(&Comm::Solo);
    assert!(states.is_sorted_by_key(ContactState::key));
    let mut states: Vec<ContactState> = bytemuck::pod_collect_to_vec(&all(bytemuck::cast_slice(&states)));
    states.sort_by_key(ContactState::key);
    let summary = engine.contacts();
    let mut sums = [summary.begun as i64, summary.count as i64];
    comm.sum(&mut sums);
    let mut deepest = [summary.max_depth];
    comm.max(&mut deepest);
    Whole {
        particles,
        records,
        states,
        begun: sums[0] as u64,
        count: sums[1] as usize,
        max_depth: deepest[0].to_bits(),
        substep: engine.substep(),
    }
}

/// A run on some ranks.
struct Written {
    /// Step at which it was saved first: after 100, when at least three pairs of particles touch, and some have a neck if any can.
    step: u64,
    /// The parts and the state then, and some steps later.
    parts: [Vec<Vec<u8>>; 2],
    states: [Whole; 2],
}

/// Steps from one save to the next.
const ON: u64 = 30;

fn written(laws: Laws, ranks: usize) -> Written {
    let results = on_threads(ranks, |comm| {
        let mut engine = engine(laws, &comm, &crowd());
        let mut step = 100;
        advance(&mut engine, &comm, (0, step));
        let pairs = |whole: &Whole| (whole.states.iter()).filter(|s| s.wall().is_none()).count();
        let necks = |whole: &Whole| whole.states.iter().filter(|s| s.depth < 0.0).count();
        let least = usize::from(laws == Laws::Necks);
        while pairs(&gathered(&engine, &comm)) < 3 || necks(&gathered(&engine, &comm)) < least {
            advance(&mut engine, &comm, (step, step + 1));
            step += 1;
            assert!(step < 400, "pairs touch now and then");
        }
        let parts = comm.all_gather(engine.save(&comm).unwrap());
        let middle = gathered(&engine, &comm);
        assert!(middle.states.len() > pairs(&middle) + 5, "and walls: {middle:?}");
        advance(&mut engine, &comm, (step, step + ON));
        let later = comm.all_gather(engine.save(&comm).unwrap());
        let end = gathered(&engine, &comm);
        assert!(end.begun > middle.begun, "contacts begin and end");
        Written { step, parts: [parts, later], states: [middle, end] }
    });
    results.into_iter().next().unwrap()
}

#[test]
fn a_run_saved_on_1_to_4_ranks_continues_on_1_to_4_ranks_to_the_same_bits() {
    for laws in [Laws::Plain, Laws::Films, Laws::Necks] {
        for writers in 1..=4 {
            let Written { step, parts, states } = written(laws, writers);
            for readers in 1..=4 {
                let what = format!("{laws:?}, from {writers} to {readers} ranks");
                on_threads(readers, |comm| {
                    let mut engine = engine(laws, &comm, &crowd());
                    // Whatever it did before is forgotten.
                    advance(&mut engine, &comm, (0, 2));
                    engine.restore(&comm, &SavedParts::divided(&comm, &parts[0])).unwrap();
                    for (n, (parts, state)) in parts.iter().zip(&states).enumerate() {
                        advance(&mut engine, &comm, (step, step + ON * n as u64));
                        assert_eq!(gathered(&engine, &comm), *state, "{what}");
                        let same = readers != writers || engine.save(&comm).unwrap() == parts[comm.rank()];
                        assert!(same, "{what}: other bytes");
                    }
                });
            }
        }
    }
}

#[test]
fn a_state_saved_on_1_to_8_ranks_is_the_same_on_1_to_8_others() {
    for writers in [1, 2, 5, 8] {
        let Written { parts: [parts, _], states: [state, _], .. } = written(Laws::Films, writers);
        for readers in [1, 2, 3, 4, 5, 6, 8] {
            on_threads(readers, |comm| {
                let mut engine = engine(Laws::Films, &comm, &crowd());
                engine.restore(&comm, &SavedParts::divided(&comm, &parts)).unwrap();
                assert_eq!(gathered(&engine, &comm), state, "from {writers} to {readers} ranks");
                let here = |key: &ContactKey| {
                    let ContactContext { near, local, .. } = &engine.context;
                    evaluating_rank_of(key, near, local) == Some(comm.rank())
                };
                assert!(engine.records().iter().all(|(key, _)| here(&key)));
            });
        }
    }
}

#[test]
fn a_rank_reads_and_sends_its_share_of_a_state_and_no_more_on_8_ranks() {
    let domain = Domain { faces: Domain::faces([true; 3]), cells: [400, 6, 6], dx: 1e-3 };
    let sphere =
        Template { shape: Arc::new(crate::shape::Sphere { radius: 1e-3 }), material: 0, density: 1e3 };
    // Two rows of spheres that touch.
    let at = |n: u64| Vec3::new(5e-4 + 1.995e-3 * (n / 2) as f64, 1e-3 + 3e-3 * (n % 2) as f64, 3e-3);
    let all: Vec<Particle> = (0..400).map(|n| Particle::at(n, 0, at(n))).collect();
    let engine = |comm: &Comm| {
        let params = NativeParams { walls: Vec::new(), ..params() };
        let cut = Decomposition::with_grid(domain, [8, 1, 1]);
        Native::new(params, cut, comm.rank(), Arc::new([sphere.clone()]), &all).unwrap()
    };
    let parts = on_threads(8, |comm| {
        let mut engine = engine(&comm);
        let loads = vec![Load::default(); engine.particles().owned];
        engine.advance(&comm, &loads, 1e-9).unwrap();
        assert!(engine.records().len() > 40);
        engine.save(&comm).unwrap()
    });
    // Read by others than those that wrote them.
    let parts = [&parts[3..], &parts[..3]].concat();
    on_threads(8, |comm| {
        let mut engine = engine(&comm);
        let own = SavedParts::divided(&comm, &parts);
        let read = own.own[0].1.len() as u64;
        assert_eq!(own.own.len(), 1);
        let before = comm.traffic();
        engine.restore(&comm, &own).unwrap();
        let sent = comm.traffic() - before;
        assert!(sent.exchange.bytes < 2 * read, "{} bytes of {read}", sent.exchange.bytes);
        assert!(sent.collective.bytes < 150 * 8, "{} bytes to all", sent.collective.bytes);
    });
}

#[test]
fn an_engine_that_refuses_what_was_saved_says_so_on_every_rank_and_continues_as_before_on_3_ranks() {
    let Written { step, parts, states } = written(Laws::Plain, 2);
    let ([parts, _], [_, end]) = (parts, states);
    let mut damaged = parts.clone();
    damaged[1][1000] ^= 1;
    let cut = vec![parts[0][..500].to_vec(), parts[1].clone()];
    let words = on_threads(3, |comm| {
        let mut engine = engine(Laws::Plain, &comm, &crowd());
        engine.restore(&comm, &SavedParts::divided(&comm, &parts)).unwrap();
        let refused = [&damaged, &cut, &parts[..1].to_vec(), &Vec::new()].map(|bad| {
            let error = engine.restore(&comm, &SavedParts::divided(&comm, bad)).unwrap_err();
            assert_eq!(error.exit_code(), 2);
            error.to_string()
        });
        advance(&mut engine, &comm, (step, step + ON));
        assert_eq!(gathered(&engine, &comm), end);
        refused
    });
    assert!(words.iter().all(|theirs| *theirs == words[0]), "all ranks say the same");
    for (said, part) in
        words[0].iter().zip(["part 2 of 2", "part 1 of 2", "a part of it is missing", "no part of it"])
    {
        assert!(said.contains("saved state of the native engine") && said.contains(part), "{said}");
    }
}
