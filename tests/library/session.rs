//! Simulations that other threads call, and particles that the caller moves.

use turbid::dem::Load;
use turbid::math::Vec3;
use turbid::particle::Particle;
use turbid::simulation::Session;
use turbid::{Builder, Error, Particles, Result, Setup};

/// Three spheres in a closed box, with gravity.
fn setup(threads: usize) -> Setup {
    let spheres =
        Particles::spheres(1e-3, 2500.0).at([2e-3, 2e-3, 6e-3]).at([4e-3, 3e-3, 4e-3]).at([2e-3, 4e-3, 2e-3]);
    let case = Builder::new([6e-3, 6e-3, 8e-3]).periodic([true, true, false]).fluid(1000.0, 1e-5);
    case.lattice(4.0, 0.6).particles(spheres).threads(threads).setup().unwrap()
}

/// Moves particles as a caller does, semi-implicitly, over `steps` steps.
fn drive(session: &Session, steps: u64) -> Result<()> {
    let (templates, gravity) = (&session.setup().templates, session.setup().gravity);
    let dt = session.setup().time_step;
    let mut states = session.particles()?;
    for _ in 0..steps {
        session.advance(1)?;
        for (state, load) in states.iter_mut().zip(session.loads()?) {
            let Particle { template, .. } = *state;
            let velocity =
                state.velocity() + (load.force / templates[template as usize].mass() + gravity) * dt;
            state.velocity = velocity.into();
            state.position = (state.position() + velocity * dt).into();
        }
        session.set_particles(states.clone())?;
    }
    Ok(())
}

#[test]
fn spheres_that_the_caller_moves_settle_like_those_of_the_native_engine_on_1_and_2_ranks() {
    let native = Session::new(setup(1)).unwrap();
    native.advance(60).unwrap();
    let native = native.particles().unwrap();
    let driven = [1, 2].map(|threads| {
        let session = Session::caller_driven(setup(threads)).unwrap();
        drive(&session, 60).unwrap();
        session.particles().unwrap()
    });
    assert_eq!(driven[0], driven[1], "to the bit on any number of ranks");
    for (own, other) in driven[0].iter().zip(&native) {
        let (own, other) = (own.velocity().z, other.velocity().z);
        assert!((own / other - 1.0).abs() < 0.01, "{own} m/s instead of {other} m/s");
    }
}

#[test]
fn states_set_to_what_they_are_change_no_bit_on_1_and_3_ranks() {
    let hash = |threads, sets| {
        let session = Session::new(setup(threads)).unwrap();
        for _ in 0..5 {
            session.advance(8).unwrap();
            if sets {
                session.set_particles(session.particles().unwrap()).unwrap();
            }
        }
        session.on_ranks(|simulation| Ok(simulation.state_hash())).unwrap()[0]
    };
    assert_eq!(hash(1, false), hash(1, true));
    assert_eq!(hash(1, false), hash(3, true));
}

#[test]
fn a_session_has_the_same_bits_as_a_simulation_and_the_fields_of_all_ranks() {
    let mut simulation = turbid::Simulation::solo(&setup(1)).unwrap();
    simulation.advance(20).unwrap();
    let session = Session::new(setup(2)).unwrap();
    session.advance(20).unwrap();
    assert_eq!(session.particles().unwrap(), simulation.particles());
    assert_eq!(session.fields().unwrap(), simulation.fields().unwrap());
    let loads: Vec<Load> = simulation.loads().map(|(_, load)| load).collect();
    assert_eq!(session.loads().unwrap(), loads);
}

#[test]
fn external_loads_of_a_session_act_on_2_ranks_as_on_1() {
    let pulled = |threads| {
        let session = Session::new(setup(threads)).unwrap();
        let load = |n: f64| Load { force: Vec3::new(n * 1e-6, 0.0, 0.0), torque: Vec3::zeros() };
        session.set_external_loads(vec![load(0.0), load(1.0), load(2.0)]).unwrap();
        session.advance(8).unwrap();
        session.particles().unwrap()
    };
    let alone = pulled(1);
    assert_eq!(alone, pulled(2));
    assert!(alone[2].velocity().x > alone[1].velocity().x && alone[1].velocity().x > 1e-6);
}

#[test]
fn impossible_states_are_refused_with_the_reason_and_change_nothing_on_2_ranks() {
    let session = Session::caller_driven(setup(2)).unwrap();
    session.advance(1).unwrap();
    let before = session.particles().unwrap();
    let refused = |change: &dyn Fn(&mut Vec<Particle>), why: &str| {
        let mut states = before.clone();
        change(&mut states);
        let error = session.set_particles(states).unwrap_err();
        assert!(matches!(&error, Error::Input(text) if text.contains(why)), "{error}");
    };
    refused(&|all| all.truncate(2), "that of particle 2 is missing");
    refused(&|all| all.swap(0, 1), "the ids must ascend, but 0 follows 1");
    refused(&|all| all.push(Particle { id: 9, ..all[0] }), "there is no particle 9");
    refused(&|all| all[1].template = 5, "particle 1 is of kind 0, not 5");
    refused(&|all| all[1].position[2] = -1.0, "the position of particle 1 is not in the box");
    refused(&|all| all[1].velocity[0] = f64::NAN, "the velocity of particle 1 is not finite");
    refused(&|all| all[1].orientation = [0.0; 4], "the orientation of particle 1 has the length 0");
    refused(&|all| all[1].velocity[0] = 1e3, "particle 1 would move by");
    refused(&|all| all[1].angular_velocity[0] = 1e300, "particle 1 would turn by");
    refused(&|all| all[1].position[0] = 1e300, "particle 1 is 1e300 m away");
    refused(&|all| all[1].position = all[0].position, "particle 1 is 12.000 cells from where it was");
    refused(&|all| all[1].position[0] += 3e-4, "particle 1 is 1.200 cells from where it was");
    assert_eq!(session.particles().unwrap(), before);
    let count = session.set_external_loads(Vec::new()).unwrap_err();
    assert_eq!(count.to_string(), "there are 3 particles, but 0 loads");
}

#[test]
fn bodies_are_placed_freely_before_the_first_step_but_not_in_each_other_or_in_walls() {
    for session in [Session::caller_driven(setup(1)), Session::new(setup(1))] {
        let session = session.unwrap();
        let start = session.particles().unwrap();
        let set = |position: [f64; 3]| {
            let mut states = start.clone();
            states[1].position = position;
            session.set_particles(states).map_err(|error| error.to_string())
        };
        // Half a radius is a quarter of the thickness.
        set([2e-3, 2e-3, 5.24e-3]).unwrap();
        let said = set([2e-3, 2e-3 + 6e-3, 5.26e-3]).unwrap_err();
        assert!(said.contains("particle 0 would overlap particle 1 by 2.600e-4 m"), "{said}");
        set([1e-3, 5e-3, 0.26e-3]).unwrap();
        let said = set([1e-3, 5e-3, 0.24e-3]).unwrap_err();
        assert!(said.contains("particle 1 would overlap the wall `z-` by 2.600e-4 m"), "{said}");
    }
}

#[test]
fn a_body_gets_no_further_than_a_cell_in_a_step_however_often_it_is_set() {
    for session in [Session::caller_driven(setup(1)), Session::new(setup(1))] {
        let session = session.unwrap();
        session.advance(2).unwrap();
        let mut states = session.particles().unwrap();
        // 0.8 cells.
        states[1].position[0] += 2e-4;
        session.set_particles(states.clone()).unwrap();
        states[1].position[0] += 2e-4;
        let said = session.set_particles(states.clone()).unwrap_err().to_string();
        assert!(said.contains("particle 1 is 1.600 cells from where it was"), "{said}");
        session.advance(1).unwrap();
        session.set_particles(states).unwrap();
    }
}

#[test]
fn long_boxes_overlap_others_and_walls_along_their_whole_length() {
    let boxes = Particles::cuboids([1e-3, 1e-3, 2e-3], 2500.0).at([2e-3, 2e-3, 5e-3]).at([2e-3, 2e-3, 2e-3]);
    let case = Builder::new([6e-3, 6e-3, 8e-3]).periodic([true, true, false]).fluid(1000.0, 1e-5);
    let setup = case.lattice(4.0, 0.6).particles(boxes).threads(1).setup().unwrap();
    let session = Session::caller_driven(setup).unwrap();
    let start = session.particles().unwrap();
    let set = |height: f64, turn: [f64; 4]| {
        let mut states = start.clone();
        (states[1].position[2], states[1].orientation) = (height, turn);
        session.set_particles(states).map_err(|error| error.to_string())
    };
    let (upright, across) = ([0.0, 0.0, 0.0, 1.0], [0.5_f64.sqrt(), 0.0, 0.0, 0.5_f64.sqrt()]);
    set(3.2e-3, upright).unwrap();
    let said = set(3.4e-3, upright).unwrap_err();
    assert!(said.contains("particle 0 would overlap particle 1 by 4.000e-4 m"), "{said}");
    set(3.4e-3, across).unwrap();
    let said = set(6e-4, upright).unwrap_err();
    assert!(said.contains("particle 1 would overlap the wall `z-` by 4.000e-4 m"), "{said}");
    set(6e-4, across).unwrap();
}

#[test]
fn bodies_that_overlap_move_as_one_and_never_against_each_other_on_2_ranks() {
    let bed = Particles::spheres(1e-3, 2500.0).at([2e-3, 2e-3, 2e-3]).at([2.6e-3, 2e-3, 2e-3]).fixed();
    let case = Builder::new([6e-3, 6e-3, 8e-3]).fluid(1000.0, 1e-5).lattice(4.0, 0.6);
    let session = Session::caller_driven(case.particles(bed).threads(2).setup().unwrap()).unwrap();
    let start = session.particles().unwrap();
    let dt = session.setup().time_step;
    // A tenth of a cell per step, and a turn about the first sphere.
    let (velocity, spin) = (Vec3::new(0.0, 0.0, 2.5e-5 / dt), 1e-3 / dt);
    let mut states = start.clone();
    for step in 1..20 {
        session.advance(1).unwrap();
        let angle = 1e-3 * f64::from(step);
        let arm = Vec3::new(angle.cos(), angle.sin(), 0.0) * 6e-4;
        for (n, (state, first)) in states.iter_mut().zip(&start).enumerate() {
            let arm = if n == 0 { Vec3::zeros() } else { arm };
            let centre = start[0].position() + velocity * dt * f64::from(step);
            state.position = (centre + arm).into();
            state.orientation = [0.0, 0.0, (0.5 * angle).sin(), (0.5 * angle).cos()];
            state.velocity = (velocity + Vec3::z().cross(&arm) * spin).into();
            state.angular_velocity = [0.0, 0.0, spin];
            assert_eq!(first.id, state.id);
        }
        session.set_particles(states.clone()).unwrap();
    }
    states[1].position[0] -= 1e-6;
    let said = session.set_particles(states).unwrap_err().to_string();
    assert!(said.contains("particle 0 would overlap particle 1 by 4.010e-4 m"), "{said}");
}

#[test]
fn a_session_that_has_failed_returns_its_first_error_for_ever_on_2_ranks() {
    let session = Session::new(setup(2)).unwrap();
    session.advance(1).unwrap();
    let pull = Load { force: Vec3::new(1.0, 0.0, 0.0), torque: Vec3::zeros() };
    session.set_external_loads(vec![pull; 3]).unwrap();
    let first = session.advance(1).unwrap_err().to_string();
    assert!(first.starts_with("diverged at step 1: particle"), "{first}");
    session.set_external_loads(vec![Load::default(); 3]).unwrap();
    for later in [session.advance(1), session.advance(20), session.run_until(1.0), session.check()] {
        assert_eq!(later.unwrap_err().to_string(), first);
    }
    assert_eq!((session.steps_done().unwrap(), session.particles().unwrap().len()), (2, 3));
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path().to_owned();
    let saves = move |simulation: &mut turbid::Simulation| {
        let setup = setup(2);
        simulation.write_checkpoint(&at, &setup, b"")
    };
    assert_eq!(session.on_ranks(saves).unwrap_err().to_string(), first, "a checkpoint");
}

#[test]
fn a_turned_spinning_cube_gets_the_angular_momentum_of_its_spin() {
    let cube = Particles::cuboids([1e-3, 1e-3, 2e-3], 2500.0).at([2e-3; 3]);
    let setup =
        Builder::new([6e-3; 3]).dry(1e-6).particles(cube).gravity([0.0; 3]).threads(1).setup().unwrap();
    let session = Session::new(setup).unwrap();
    let mut states = session.particles().unwrap();
    states[0].orientation = [0.0, 0.6, 0.0, 0.8];
    states[0].angular_velocity = [1.0, 2.0, 3.0];
    states[0].position[0] += 6e-3;
    session.set_particles(states).unwrap();
    session.advance(1).unwrap();
    let after = session.particles().unwrap()[0];
    assert!((after.angular_velocity() - Vec3::new(1.0, 2.0, 3.0)).norm() < 1e-4, "{after:?}");
    assert!((after.position() - Vec3::repeat(2e-3)).norm() < 1e-12, "wrapped: {after:?}");
}

#[test]
fn a_panic_on_one_of_2_ranks_ends_the_session_and_is_passed_on() {
    let session = Session::new(setup(2)).unwrap();
    let panics = || {
        session.on_ranks(
            |simulation| if simulation.comm().rank() == 1 { panic!("ours") } else { simulation.step() },
        )
    };
    assert!(std::panic::catch_unwind(std::panic::AssertUnwindSafe(panics)).is_err());
    assert!(session.advance(1).unwrap_err().to_string().contains("has ended"));
}

#[test]
fn a_case_without_memory_or_room_for_its_ranks_is_an_error_of_new() {
    let error = Session::new(setup(500)).map(|_| ()).unwrap_err();
    assert!(error.to_string().contains("500 threads are too many"), "{error}");
}
