use crate::case::{Setup, from_text};
use crate::contact::{Body, GrownShape, intersects};
use crate::error::Result;
use crate::math::Vec3;
use crate::particle::Particle;
use crate::simulation::Simulation;
use std::path::Path;

/// Spheres of two sizes and cubes come into a box of grains that fly without gravity, and go at one end.
const DRY: &str = "
    domain = { size = [0.03, 0.03, 0.06], periodic = [true, true, false] }
    dry.time_step = 2e-5
    driving.gravity = 0
    contact = { youngs_modulus = 1e7, substeps = 2 }
    run.end.steps = 800
    output.directory = \"out\"
    [[particles]]
    shape.sphere.diameter = 3e-3
    density = 2500.0
    count = 30
    sizes = [{ scale = 1, share = 1 }, { scale = 0.5, share = 1 }]
    granular_temperature = 1e-2
    [[particles]]
    shape.cube.edge = 2e-3
    density = 1200.0
    count = 0
    [[insertion]]
    region = { lower = [0, 0, 0.05], upper = [0.03, 0.03, 0.05] }
    particle_rate = 2000
    velocity = [0, 0, -1.5]
    velocity_spread = [0.1, 0.1, 0]
    [[insertion]]
    kind = 1
    region = { lower = [0, 0, 0.02], upper = [0.03, 0.03, 0.04] }
    mass_rate = 0.01
    start.time = 4e-3
    end.time = 8e-3
    count = 60
    seed = 5
    [[removal]]
    plane = { point = [0, 0, 0.01], normal = [0, 0, 1] }
";

/// Spheres that an inlet lets in settle to an outlet, where they go.
const WET: &str = "
    domain.size = [4e-3, 4e-3, 8e-3]
    domain.periodic = [true, true, false]
    domain.faces = { z- = { outlet = {} }, \"z+\" = { inlet = { velocity = [0, 0, -4e-3] } } }
    fluid = { density = 1000, viscosity = 1e-5 }
    lattice = { cells_per_diameter = 4, relaxation_time = 0.6 }
    run.end.steps = 240
    [[particles]]
    shape.sphere.diameter = 1e-3
    density = 2500.0
    list = [[1e-3, 1e-3, 1e-3], [2.6e-3, 1e-3, 4e-3]]
    [[particles]]
    shape.sphere.diameter = 1e-3
    density = 400.0
    count = 0
    [[insertion]]
    region = { lower = [0, 0, 5e-3], upper = [4e-3, 4e-3, 7e-3] }
    particle_rate = 600
    velocity = [0, 0, -1e-2]
    every.steps = 16
    [[insertion]]
    kind = 1
    region = { lower = [0, 0, 2.5e-3], upper = [4e-3, 4e-3, 4.5e-3] }
    particle_rate = 200
    count = 4
    every.steps = 30
    [[removal]]
    outlet = \"z-\"
";

fn setup(text: &str, options: &[&str], threads: usize) -> Setup {
    let options: Vec<String> = options.iter().map(ToString::to_string).collect();
    let mut setup = from_text(text, "case", &options).unwrap_or_else(|e| panic!("{e}"));
    setup.plan.threads = threads;
    setup
}

/// Hash, and the numbers by template of those that are there, have come and have gone.
type State = (u64, [Vec<i64>; 3]);

fn state(simulation: &mut Simulation) -> State {
    let [come, gone] = simulation.come_and_gone().map(<[i64]>::to_vec);
    (simulation.state_hash(), [simulation.counts().to_vec(), come, gone])
}

/// States after a third and all of the steps; a checkpoint is written at a third.
fn run(setup: &Setup, folder: &Path) -> Result<[State; 2]> {
    let steps = setup.plan.end_step;
    Simulation::on_ranks(setup, |mut simulation| {
        simulation.advance(steps / 3)?;
        simulation.write_checkpoint(folder, setup, b"")?;
        let middle = state(&mut simulation);
        simulation.advance(steps - steps / 3)?;
        Ok([middle, state(&mut simulation)])
    })
}

#[test]
fn particles_come_and_go_to_the_same_bits_on_1_to_8_ranks_and_from_a_checkpoint_in_between() {
    let homogenised = ["lattice.coupling=homogenised"];
    for (text, options) in [(DRY, &[][..]), (WET, &[]), (WET, &homogenised)] {
        let folder = tempfile::tempdir().unwrap();
        let path = |ranks: usize| folder.path().join(ranks.to_string());
        let alone = run(&setup(text, options, 1), &path(1)).unwrap();
        for (_, [_, come, gone]) in &alone[1..] {
            assert!(come.iter().all(|count| *count > 0) && gone.iter().any(|count| *count > 0), "{alone:?}");
        }
        assert!((0..2).all(|n| alone[0].1[1][n] < alone[1].1[1][n]), "in the middle of insertion: {alone:?}");
        for ranks in [2, 4, 8] {
            assert_eq!(run(&setup(text, options, ranks), &path(ranks)).unwrap(), alone, "{ranks} ranks");
        }
        for (writers, readers) in [(1, 4), (4, 1), (8, 2)] {
            let setup = setup(text, options, readers);
            let resumed = Simulation::on_ranks(&setup, |mut simulation| {
                simulation.read_checkpoint(&path(writers), &setup)?;
                let middle = state(&mut simulation);
                simulation.advance(setup.plan.end_step - simulation.steps_done())?;
                Ok([middle, state(&mut simulation)])
            });
            assert_eq!(resumed.unwrap(), alone, "from {writers} to {readers} ranks");
        }
    }
}

/// Number, mass and momentum of all particles.
fn all(setup: &Setup, simulation: &Simulation) -> (usize, f64, Vec3) {
    let particles = simulation.particles();
    let mass = |template: u64| setup.templates[template as usize].mass();
    let momentum = particles.iter().map(|p| mass(p.template) * p.velocity()).sum();
    (particles.len(), particles.iter().map(|p| mass(p.template)).sum(), momentum)
}

#[test]
fn number_mass_and_momentum_are_those_at_the_start_and_of_the_particles_that_came() {
    let options = ["removal=[]", "insertion.0.velocity_spread=[0, 0, 0]", "particles.0.count=4"];
    let setup = setup(DRY, &options, 1);
    let mut simulation = Simulation::solo(&setup).unwrap();
    let start = all(&setup, &simulation);
    for _ in 0..8 {
        simulation.advance(50).unwrap();
        let (number, mass, momentum) = all(&setup, &simulation);
        let come = simulation.come_and_gone()[0];
        let each = |n: usize| come[n] as f64 * setup.templates[n].mass();
        assert_eq!(number as i64, start.0 as i64 + come.iter().sum::<i64>());
        let came: f64 = (0..3).map(each).sum();
        assert!((mass - start.1 - came).abs() < 1e-12 * mass, "{mass}");
        // Impacts conserve it, and no wall is reached.
        let brought = Vec3::new(0.0, 0.0, -1.5 * (each(0) + each(1)));
        assert!((momentum - start.2 - brought).norm() < 1e-12 * brought.norm(), "{momentum} {brought}");
    }
    assert_eq!(simulation.come_and_gone()[0][..2].iter().sum::<i64>(), 16, "2000 per second, in 8 ms");
}

#[test]
fn the_momentum_of_fluid_and_particles_is_that_which_inserted_ones_bring() {
    // As after any impulsive start (docs/limits.md).
    for (coupling, error) in [("saturated", 4e-3), ("homogenised", 4e-2)] {
        let text = "domain.size = [4e-3, 4e-3, 4e-3]
            fluid = { density = 1000, viscosity = 1e-5 }
            lattice = { cells_per_diameter = 8, relaxation_time = 0.8 }
            driving = { gravity = 0, zero_net_flux = false }
            run.end.steps = 80
            particles = [{ shape.sphere.diameter = 1e-3, density = 2500, count = 0 }]
            insertion = [{ region = { lower = [0, 0, 0], upper = [4e-3, 4e-3, 4e-3] }, volume_fraction = 0.05, velocity = [0, 0, 1e-2] }]";
        let setup = setup(text, &[&format!("lattice.coupling={coupling}")], 1);
        let mut simulation = Simulation::solo(&setup).unwrap();
        simulation.advance(80).unwrap();
        let template = &setup.templates[0];
        let excess = template.mass() - 1000.0 * template.shape.volume();
        let flow = simulation.measure().mean.velocity * (1000.0 * simulation.fluid_volume());
        let momentum = flow + excess * simulation.particles().iter().map(Particle::velocity).sum::<Vec3>();
        let brought = Vec3::z() * (6.0 * template.mass() * 1e-2);
        assert_eq!(simulation.come_and_gone()[0], [6]);
        assert!((momentum - brought).norm() < error * brought.norm(), "{coupling}: {momentum} {brought}");
    }
}

#[test]
fn inserted_particles_overlap_nothing() {
    let setup = setup(DRY, &["run.end.steps=1", "contact.enabled=false"], 1);
    let mut simulation = Simulation::solo(&setup).unwrap();
    let shapes: Vec<GrownShape> =
        setup.templates.iter().map(|template| GrownShape::new(template.shape.clone(), 0.0)).collect();
    let mut known = simulation.particles().len();
    for _ in 0..400 {
        // As they were when they came: no longer ago than a step.
        simulation.step().unwrap();
        let particles = simulation.particles();
        let back = |n: usize| particles[n].position() - particles[n].velocity() * setup.time_step;
        let body = |n: usize| {
            let shape = &shapes[particles[n].template as usize];
            Body { grown: shape, orientation: particles[n].orientation() }
        };
        for new in
            particles.iter().position(|p| p.id >= known as u64).unwrap_or(particles.len())..particles.len()
        {
            for other in (0..particles.len()).filter(|other| *other != new) {
                let offset = setup.domain.nearest_image(back(other) - back(new));
                assert!(!intersects(&body(new), &body(other), offset), "{new} {other}");
            }
        }
        known = particles.last().map_or(0, |last| last.id as usize + 1);
    }
    assert!(known > 45, "{known}");
}

#[test]
fn a_region_is_filled_up_to_its_volume_fraction_and_no_further() {
    let fill = "insertion=[{ region = { lower = [0, 0, 0.02], upper = [0.03, 0.03, 0.04] }, volume_fraction = 0.25 }]";
    let options = [fill, "removal=[]", "particles.0.count=0"];
    let setup = setup(DRY, &options, 1);
    let mut simulation = Simulation::solo(&setup).unwrap();
    let volume = 0.03 * 0.03 * 0.02;
    let fraction = |simulation: &Simulation| {
        let each = |n: u64| setup.templates[n as usize].shape.volume();
        simulation.particles().iter().map(|p| each(p.template)).sum::<f64>() / volume
    };
    simulation.advance(100).unwrap();
    let [largest, found] = [setup.templates[0].shape.volume() / volume, fraction(&simulation)];
    assert!(found <= 0.25 && found > 0.25 - largest, "{found}");
    let before = simulation.particles().len();
    simulation.advance(100).unwrap();
    assert_eq!(simulation.particles().len(), before);
}

#[test]
fn particles_that_find_no_room_wait_and_come_in_their_order_when_there_is_some() {
    let narrow = "insertion=[{ region = { lower = [0, 0, 0.03], upper = [0.03, 0.03, 0.034] }, particle_rate = 1e5, count = 260 }]";
    let gone = "removal=[{ region = { lower = [0, 0, 0], upper = [0.03, 0.03, 0.033] } }]";
    let crowded = setup(DRY, &[narrow, "removal=[]", "particles.0.count=0"], 1);
    let mut simulation = Simulation::solo(&crowded).unwrap();
    simulation.advance(400).unwrap();
    let found = simulation.particles().len();
    assert!((100..260).contains(&found), "{found}");
    let said = simulation.insertion_is_behind().unwrap();
    assert!(said.contains("of the 260 particles of `insertion.0`"), "{said}");
    assert!(from_text(DRY, "case", &[narrow, gone].map(String::from)).is_err(), "they would go at once");
    let ids: Vec<u64> = simulation.particles().iter().take(found / 2).map(|p| p.id).collect();
    simulation.remove(&ids).unwrap();
    simulation.advance(100).unwrap();
    let [come, gone] = simulation.come_and_gone().map(|counts| counts.iter().sum::<i64>() as usize);
    assert!(gone == found / 2 && come > found, "{come} {gone}");
}

#[test]
fn all_free_particles_of_a_kind_go_where_they_are_removed_and_fixed_ones_stay() {
    let some = "removal=[{ region = { lower = [0, 0, 0], upper = [0.03, 0.03, 0.03] }, kind = 0 }]";
    let fixed = "particles.1={ shape.cube.edge = 2e-3, density = 1, motion = \"fixed\", list = [[0.01, 0.01, 0.01]] }";
    let setup = setup(DRY, &[some, fixed, "insertion=[]"], 1);
    let below = setup.particles.iter().filter(|p| p.template < 2 && p.position[2] <= 0.03).count();
    let mut simulation = Simulation::solo(&setup).unwrap();
    simulation.step().unwrap();
    assert_eq!(simulation.come_and_gone()[1].iter().sum::<i64>(), below as i64);
    assert_eq!(simulation.particles().len(), 31 - below);
    assert_eq!(simulation.counts()[2], 1);
}

#[test]
fn spheres_leave_through_an_outlet_before_they_rest_on_it() {
    let setup = setup(WET, &["insertion=[]"], 2);
    let left = Simulation::on_ranks(&setup, |mut simulation| {
        simulation.advance(setup.plan.end_step)?;
        assert_eq!(simulation.dem().contacts().begun, 0);
        Ok(state(&mut simulation).1)
    });
    assert_eq!(left.unwrap(), [vec![1, 0], vec![0, 0], vec![1, 0]]);
}
