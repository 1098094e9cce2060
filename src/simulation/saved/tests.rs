//! A run that is taken apart and put together again continues as if nothing had happened.

use super::*;
use crate::case::{Setup, from_text};
use crate::comm::on_threads;
use crate::domain::Decomposition;
use crate::fluid::Precision;

/// Spheres and light cubes, close to each other and to the walls, in a box that is closed in one direction.
const CASE: &str = r#"
[domain]
size = { diameters = [4, 4.5, 5] }
periodic = [true, true, false]
faces = { "z+" = { velocity = [0.02, 0.01, 0.0] } }
[fluid]
density = 1000.0
archimedes = 1000
[lattice]
cells_per_diameter = 6
relaxation_time = 0.55
[[particles]]
shape = { sphere = { diameter = 1.5e-3 } }
density = 3300.0
count = 20
[[particles]]
shape = { cube = { edge = 1.2e-3 } }
density = 400.0
count = 15
[contact]
substeps = 2
[driving]
gravity = [2.0, -3.0, -9.0]
[run]
end = { steps = 500 }
"#;

fn setup(text: &str) -> Setup {
    let mut setup = from_text(text, "saved", &[]).unwrap();
    let speed = (setup.fluid.as_ref()).map_or(0.1, |fluid| fluid.scales.stokes_velocity);
    for (n, particle) in (1_u32..).zip(&mut setup.particles) {
        let part = |k: u32| f64::from(n * k % 37) / 18.5 - 1.0;
        particle.velocity = [part(5), part(11), part(17)].map(|v| 0.5 * v * speed);
        particle.angular_velocity = [part(7), part(13), part(29)].map(|w| 50.0 * w);
    }
    setup
}

fn advance(simulation: &mut Simulation, steps: u64) {
    for _ in 0..steps {
        simulation.step().unwrap();
    }
}

/// State that a rank leaves: its block, its populations and the rest.
struct Left {
    block: Block,
    planes: Vec<Vec<u8>>,
    state: SavedState,
}

fn leave(simulation: &Simulation, block: Block) -> Left {
    let planes = (block.lo[2]..block.hi[2]).map(|z| {
        let mut plane = Vec::new();
        simulation.save_plane(z, &mut plane);
        plane
    });
    Left { block, planes: planes.collect(), state: simulation.save().unwrap() }
}

fn take_up(simulation: &mut Simulation, step: u64, left: &[&Left]) -> Result<()> {
    let saved_bytes = simulation.saved_bytes();
    let engines: Vec<_> = left.iter().map(|left| left.state.engine.clone()).collect();
    let couplings: Vec<_> = left.iter().map(|left| left.state.coupling.clone()).collect();
    let states = [engines, couplings].map(|parts| SavedParts::divided(&simulation.comm, &parts));
    simulation.restore(step, (left[0].state.driving, None), &states, |mine, visit| {
        for left in left {
            let saved = left.block;
            let lo: [usize; 3] = std::array::from_fn(|a| mine.lo[a].max(saved.lo[a]));
            let hi: [usize; 3] = std::array::from_fn(|a| mine.hi[a].min(saved.hi[a]));
            if (0..3).any(|a| lo[a] >= hi[a]) {
                continue;
            }
            let size = saved_bytes;
            for z in lo[2]..hi[2] {
                for y in lo[1]..hi[1] {
                    let row = (y - saved.lo[1]) * saved.size()[0];
                    let at = |x: usize| (row + x - saved.lo[0]) * size;
                    let bytes = &left.planes[z - saved.lo[2]][at(lo[0])..at(hi[0])];
                    let cells = Block { lo: [lo[0], y, z], hi: [hi[0], y + 1, z + 1] };
                    visit(cells, bytes).map_err(Error::Input)?;
                }
            }
        }
        Ok(())
    })
}

/// Forces and torques of the fluid on all particles, the same on all ranks.
fn loads(simulation: &Simulation) -> Vec<u8> {
    let own = simulation.system.iter().flat_map(|system| system.coupling.last_loads());
    let own: Vec<[u64; 7]> = own
        .map(|(particle, load)| {
            let [x, y, z]: [f64; 3] = load.force.into();
            let [a, b, c]: [f64; 3] = load.torque.into();
            let bits = [x, y, z, a, b, c].map(f64::to_bits);
            std::array::from_fn(|i| if i == 0 { particle.id } else { bits[i - 1] })
        })
        .collect();
    let all = simulation.comm.all_gather(bytemuck::cast_slice(&own).to_vec());
    let mut all: Vec<[u64; 7]> = bytemuck::pod_collect_to_vec(&all.concat());
    all.sort_unstable();
    bytemuck::cast_slice(&all).to_vec()
}

/// Runs `before` steps on three ranks, takes the state apart, and continues for `after` steps with it on these numbers of ranks;
/// the hashes are those of the run that was left alone.
fn continues(setup: &Setup, before: u64, after: u64, on: &[usize]) {
    let cut = Decomposition::new(setup.domain, 3).unwrap();
    let runs = on_threads(3, |comm| {
        let block = cut.block(comm.rank());
        let mut simulation = Simulation::new(setup, &cut, comm).unwrap();
        advance(&mut simulation, before);
        let left = leave(&simulation, block);
        let now = (simulation.state_hash(), loads(&simulation));
        advance(&mut simulation, after);
        (left, now, simulation.state_hash(), (simulation.mean_flow().velocity, simulation.control_record()))
    });
    let left: Vec<&Left> = runs.iter().map(|run| &run.0).collect();
    for &ranks in on {
        let cut = Decomposition::new(setup.domain, ranks).unwrap();
        on_threads(ranks, |comm| {
            let mut simulation = Simulation::new(setup, &cut, comm).unwrap();
            // What it was before does not matter.
            advance(&mut simulation, ranks as u64);
            take_up(&mut simulation, before, &left).unwrap();
            assert!(
                (simulation.state_hash(), loads(&simulation)) == runs[0].1,
                "at step {before} on {ranks} ranks"
            );
            advance(&mut simulation, after);
            assert_eq!(simulation.state_hash(), runs[0].2, "after step {before} on {ranks} ranks");
            assert_eq!((simulation.mean_flow().velocity, simulation.control_record()), runs[0].3);
        });
    }
}

#[test]
fn a_suspension_between_walls_continues_to_the_bit_on_any_ranks() {
    let setup = setup(CASE);
    for before in [0, 1, 13, 40] {
        continues(&setup, before, 30, &[1, 2, 4]);
    }
}

#[test]
fn partially_saturated_cells_go_on_to_the_bit_on_any_ranks() {
    let setup =
        setup(&CASE.replace("relaxation_time = 0.55", "relaxation_time = 0.55\ncoupling = \"saturated\""));
    for before in [0, 1, 13] {
        continues(&setup, before, 30, &[1, 2, 4]);
    }
}

#[test]
fn double_precision_and_a_controlled_flux_go_on_to_the_bit() {
    let periodic = CASE.replace("periodic = [true, true, false]", "").replace("faces =", "#");
    let mut setup = setup(&periodic);
    setup.plan.precision = Precision::F64;
    assert_eq!(setup.expect_fluid().net_flux, [Some(0.0); 3]);
    continues(&setup, 20, 30, &[1, 5]);
    let cut = Decomposition::new(setup.domain, 1).unwrap();
    let mut simulation = Simulation::new(&setup, &cut, crate::comm::Comm::Solo).unwrap();
    advance(&mut simulation, 50);
    let record = simulation.control_record();
    assert!(record.largest > 0.0 && record.mean(50).norm() <= record.largest);
}

#[test]
fn populations_in_16_bits_go_on_to_the_bit_on_any_ranks() {
    let mut setup = setup(CASE);
    setup.plan.precision = Precision::F16;
    continues(&setup, 13, 30, &[1, 4]);
}

#[test]
fn a_dry_run_continues_to_the_bit() {
    let (before, after) = (CASE.find("[fluid]").unwrap(), CASE.find("[[particles]]").unwrap());
    let dry = format!("{}[dry]\ntime_step = 2e-5\n{}", &CASE[..before], &CASE[after..]);
    let setup = setup(&dry.replace("diameters = [4, 4.5, 5]", "diameters = [5, 6, 7]"));
    continues(&setup, 60, 60, &[1, 4]);
}

/// Cuts a run of these steps on three ranks anew again and again, into blocks of all kinds; the state is that of the run that is left alone.
fn is_cut_anew(setup: &Setup, steps: u64) {
    let whole = Decomposition::new(setup.domain, 3).unwrap();
    let [x, y, z] = setup.domain.cells;
    let along = |axis: usize, at: [usize; 2]| {
        let mut cuts = setup.domain.cells.map(|n| vec![0, n]);
        cuts[axis] = vec![0, at[0], at[1], setup.domain.cells[axis]];
        Decomposition::with_cuts(setup.domain, cuts)
    };
    let cuts = [
        along(2, [4, 9]),
        along(0, [5, x - 4]),
        along(2, [z - 9, z - 4]),
        along(1, [7, y - 6]),
        whole.clone(),
    ];
    let run = |anew: bool| {
        on_threads(3, |comm| {
            let mut simulation = Simulation::new(setup, &whole, comm).unwrap();
            for cut in &cuts {
                if anew {
                    simulation.cut_anew(setup, cut.clone()).unwrap();
                    assert_eq!(simulation.block, cut.block(simulation.comm.rank()));
                }
                advance(&mut simulation, steps);
            }
            let contacts =
                simulation.comm.all_gather(bytemuck::cast_slice(&simulation.contact_states()).to_vec());
            let mut contacts: Vec<crate::dem::ContactState> =
                bytemuck::pod_collect_to_vec(&contacts.concat());
            contacts.sort_by_key(crate::dem::ContactState::key);
            (
                simulation.state_hash(),
                loads(&simulation),
                contacts,
                simulation.mean_flow(),
                simulation.counts().to_vec(),
            )
        })
    };
    let (alone, anew) = (run(false), run(true));
    assert!(alone == anew);
    assert!(!alone[0].2.is_empty());
}

#[test]
fn a_run_whose_box_is_cut_anew_continues_to_the_bit() {
    is_cut_anew(&setup(CASE), 13);
    is_cut_anew(
        &setup(&CASE.replace("relaxation_time = 0.55", "relaxation_time = 0.55\ncoupling = \"saturated\"")),
        5,
    );
    let held = CASE.replace("substeps = 2", "substeps = 2\nlaw = \"hertz\"\nfriction = \"mindlin\"");
    is_cut_anew(&setup(&held), 20);
}

#[test]
fn a_dry_run_whose_box_is_cut_anew_continues_to_the_bit() {
    let (before, after) = (CASE.find("[fluid]").unwrap(), CASE.find("[[particles]]").unwrap());
    let dry = format!("{}[dry]\ntime_step = 2e-5\n{}", &CASE[..before], &CASE[after..]);
    is_cut_anew(&setup(&dry), 60);
}

#[test]
fn a_state_has_its_own_particles_whatever_number_of_them_the_case_starts_with() {
    let (one, other) = (setup(CASE), setup(&CASE.replace("count = 15", "count = 14")));
    let cut = Decomposition::new(one.domain, 1).unwrap();
    let mut simulation = Simulation::new(&one, &cut, crate::comm::Comm::Solo).unwrap();
    advance(&mut simulation, 3);
    let left = leave(&simulation, cut.block(0));
    let mut resumed = Simulation::new(&other, &cut, crate::comm::Comm::Solo).unwrap();
    take_up(&mut resumed, 3, &[&left]).unwrap();
    assert_eq!((resumed.counts(), resumed.state_hash()), (&[20, 15][..], simulation.state_hash()));
}

#[test]
fn numbers_that_no_run_has_are_refused_with_the_part_and_the_field_that_has_them() {
    let setup = setup(CASE);
    let cut = Decomposition::new(setup.domain, 1).unwrap();
    let mut simulation = Simulation::new(&setup, &cut, crate::comm::Comm::Solo).unwrap();
    advance(&mut simulation, 3);
    let sound = leave(&simulation, cut.block(0));
    let mut refused = |spoil: &dyn Fn(&mut Left), words: &[&str]| {
        let mut left = Left {
            block: sound.block,
            planes: sound.planes.clone(),
            state: SavedState {
                engine: sound.state.engine.clone(),
                coupling: sound.state.coupling.clone(),
                ..sound.state
            },
        };
        spoil(&mut left);
        let error = take_up(&mut simulation, 3, &[&left]).unwrap_err();
        let text = error.to_string();
        assert!(words.iter().all(|word| text.contains(word)), "{words:?} in {text}");
        assert_eq!(error.exit_code(), 2);
    };
    // Where the first particle of the coupling has its numbers.
    let number = |at: usize, x: f64| {
        move |left: &mut Left| left.state.coupling[at..at + 8].copy_from_slice(&x.to_ne_bytes())
    };
    let part = "part 1 of the coupling: ";
    refused(&number(16, f64::NAN), &[part, "position of particle 0 is not finite"]);
    refused(&number(32, 1e3), &[part, "position of particle 0 is not in the box"]);
    refused(&number(40, 0.1), &[part, "orientation of particle 0"]);
    refused(&number(72, 1e300), &[part, "velocity or angular velocity of particle 0"]);
    refused(&number(8, 99.0), &[part, "which is none"]);
    refused(&|left| left.state.coupling.extend_from_within(..), &[part, "particle 0 is in it twice"]);
    for population in [f32::NAN, f32::INFINITY, 600.0] {
        refused(
            &|left| left.planes[2][4..8].copy_from_slice(&population.to_ne_bytes()),
            &["the population 1 of the cell (0, 0, 2)"],
        );
    }
    refused(&|left| left.state.driving.0.velocity.x = 1e9, &["mean velocity"]);
    refused(&|left| left.state.driving.0.kinetic_energy = f64::NAN, &["energy"]);
    take_up(&mut simulation, 3, &[&sound]).unwrap();
}
