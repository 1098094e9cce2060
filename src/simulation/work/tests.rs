use super::*;
use crate::case;
use crate::comm::on_threads;
use crate::contact::ContactModel;
use crate::domain::Decomposition;
use crate::engine::{self, process};
use crate::simulation::{Simulation, seconds_of_files};
use std::fmt::Write as _;

/// Spheres of 8 cells in a box of 6 x 6 x 12 diameters at these centres (diameters).
pub(in crate::simulation) fn spheres(periodic: bool, centres: &[[f64; 3]]) -> Setup {
    let mut list = String::new();
    for centre in centres {
        let [x, y, z] = centre.map(|c| c * 1e-3);
        let _ = write!(list, "[{x:?}, {y:?}, {z:?}], ");
    }
    let text = format!(
        "[domain]\nsize = {{ diameters = [6, 6, 12] }}\nperiodic = [{periodic}, {periodic}, {periodic}]\n\
         [fluid]\ndensity = 1000\nviscosity = 1e-6\n\
         [lattice]\ncells_per_diameter = 8\nrelaxation_time = 0.55\n\
         [[particles]]\nshape = {{ sphere = {{ diameter = 1e-3 }} }}\ndensity = 2500\nlist = [{list}]\n\
         [driving]\ngravity = 0\n\
         [run]\nend = {{ steps = 1 }}\n"
    );
    case::from_text(&text, "spheres", &[]).unwrap()
}

/// A bed of 5 x 5 x 4 spheres on the floor of a closed box.
pub(in crate::simulation) fn bed() -> Setup {
    let mut centres = Vec::new();
    for z in 0..4 {
        for y in 0..5 {
            for x in 0..5 {
                centres.push([x, y, z].map(|n| 0.6 + 1.02 * f64::from(n)));
            }
        }
    }
    spheres(false, &centres)
}

/// Spheres all over a periodic box.
pub(in crate::simulation) fn suspension() -> Setup {
    let mut centres = Vec::new();
    for z in 0..8 {
        for y in 0..4 {
            for x in 0..4 {
                centres.push([x, y, z].map(|n| 0.75 + 1.5 * f64::from(n)));
            }
        }
    }
    spheres(true, &centres)
}

#[test]
fn the_layers_along_all_axes_have_the_same_work() {
    for setup in [bed(), suspension()] {
        let weights = Work::of(&setup).weights(&Comm::Solo);
        let total = weights.total();
        let cells = setup.domain.cell_count() as f64 * costs::cell(setup.plan.precision);
        assert!(total > cells);
        for layers in &weights.layers {
            assert!((layers.iter().sum::<f64>() / total - 1.0).abs() < 1e-12);
        }
    }
}

#[test]
fn a_sphere_is_spread_over_the_cells_that_it_covers() {
    let setup = spheres(true, &[[0.1, 3.13, 5.9]]);
    let work = Work::of(&setup);
    let body = &work.bodies[0];
    let domain = &setup.domain;
    let mut counts: [Vec<f64>; 3] = domain.cells.map(|n| vec![0.0; n]);
    let mut covered = 0.0;
    for n in 0..domain.cell_count() {
        let [nx, ny, _] = domain.cells;
        let cell = [n % nx, n / nx % ny, n / nx / ny];
        let centre = Vec3::from(cell.map(|c| (c as f64 + 0.5) * domain.dx));
        let distance = domain.nearest_image(centre - body.position).norm() / domain.dx;
        if distance < 4.0 + setup.expect_fluid().coupling.half_layer() {
            covered += 1.0;
            for axis in 0..3 {
                counts[axis][cell[axis]] += 1.0;
            }
        }
    }
    assert!((body.covered / covered - 1.0).abs() < 0.05, "{} {covered}", body.covered);
    for axis in 0..3 {
        let mut shares = vec![0.0; domain.cells[axis]];
        for (layer, share) in body.spread(domain, axis) {
            shares[layer] += share;
        }
        for (share, count) in shares.iter().zip(&counts[axis]) {
            assert!((share - count / covered).abs() < 0.03, "{share} {count}");
        }
    }
}

#[test]
fn a_suspension_is_cut_into_equal_blocks() {
    let setup = suspension();
    let weights = Work::of(&setup).weights(&Comm::Solo);
    for ranks in [2, 3, 4, 6, 8, 12, 16] {
        let cut = Decomposition::balanced(setup.domain, ranks, &weights).unwrap();
        for axis in 0..3 {
            let even = setup.domain.cells[axis] as f64 / cut.grid[axis] as f64;
            for width in cut.cuts[axis].windows(2).map(|w| (w[1] - w[0]) as f64) {
                assert!((width - even).abs() <= 2.0, "{ranks}: {:?}", cut.cuts);
            }
        }
    }
}

#[test]
fn a_dry_box_is_cut_by_its_particles() {
    let mut setup = bed();
    setup.fluid = None;
    let work = Work::of(&setup);
    let cut = Decomposition::balanced(setup.domain, 4, &work.weights(&Comm::Solo)).unwrap();
    let forecast = work.forecast(&cut);
    let particles: Vec<usize> = forecast.ranks.iter().map(|rank| rank.particles).collect();
    assert!(particles.iter().all(|n| (15..=40).contains(n)), "{particles:?}");
}

#[test]
fn thick_walls_are_no_work_and_closed_faces_are_no_cells() {
    let text = |walls: &str| {
        format!(
            "[domain]\nsize = [0.064, 0.064, 0.064]\nperiodic = [false, false, false]\n{walls}\
             [fluid]\ndensity = 1000\nviscosity = 1e-5\n\
             [lattice]\ncells_per_diameter = 8\nrelaxation_time = 0.55\n\
             [[particles]]\nshape = {{ sphere = {{ diameter = 8e-3 }} }}\ndensity = 1000\nlist = [[0.02, 0.032, 0.032]]\n\
             [driving]\ngravity = 0\n[run]\nend = {{ steps = 1 }}\n"
        )
    };
    let open = case::from_text(&text(""), "open", &[]).unwrap();
    assert!(Work::of(&open).walls.is_empty());
    let wall = "[[walls]]\nname = \"side\"\nplane = { point = [0.04, 0, 0], normal = [-1, 0, 0] }\n";
    let half = case::from_text(&text(wall), "half", &[]).unwrap();
    let layers = &Work::of(&half).weights(&Comm::Solo).layers[0];
    // Fluid up to 40 cells, in chunks of 16.
    let cell = costs::cell(half.plan.precision) * 64.0 * 64.0;
    for (x, layer) in layers.iter().enumerate().filter(|(x, _)| !(14..28).contains(x)) {
        let expected = if x < 48 { cell } else { 0.0 };
        assert!((layer - expected).abs() < 1e-6 * cell, "{x}: {layer} {expected}");
    }
}

#[test]
fn near_pairs_and_bodies_near_walls_are_contacts_and_costs_follow_the_shapes() {
    let setup = spheres(false, &[[0.51, 3.0, 3.0], [1.54, 3.0, 3.0], [4.0, 3.0, 3.0]]);
    let work = Work::of(&setup);
    let found: Vec<(usize, Option<usize>)> = work.contacts.iter().map(|c| (c.first, c.second)).collect();
    assert_eq!(found, [(0, Some(1)), (0, None)]);
    let model = setup.contact.as_ref().unwrap();
    let cost = |a: Form, b| a.contact(b, model);
    assert!(cost(Form::Sphere, Form::Sphere) < cost(Form::Sphere, Form::Flat));
    assert!(cost(Form::Flat, Form::Flat) < cost(Form::Sphere, Form::Other));
    let sampled =
        ContactModel { geometry: crate::contact::Geometry::Sampled { samples: 16 }, ..model.clone() };
    assert!(Form::Sphere.contact(Form::Sphere, &sampled) > 100.0 * cost(Form::Sphere, Form::Sphere));
}

#[test]
fn rows_fields_and_surfaces_take_time_as_often_as_they_are_written() {
    let mut setup = suspension();
    let plan = &mut setup.plan;
    plan.end_step = 1000;
    plan.output.series_every = 1000;
    for every in [
        &mut plan.output.fields_every,
        &mut plan.output.particles_every,
        &mut plan.output.surfaces_every,
        &mut plan.output.contacts_every,
        &mut plan.output.picture_every,
    ] {
        *every = 0;
    }
    let least = seconds_of_files(&setup);
    setup.plan.output.series_every = 5;
    let rows = seconds_of_files(&setup);
    assert!((rows / least - 201.0 / 2.0).abs() < 1e-9, "{rows} {least}");
    setup.plan.output.fields_every = 100;
    assert!(seconds_of_files(&setup) > rows);
}

#[test]
fn a_suspension_takes_longer_than_its_fluid_and_on_one_core_not_much_more() {
    let mut setup = suspension();
    setup.plan.threads = 1;
    let cells = setup.domain.cell_count() as f64;
    let forecast = crate::simulation::forecast(&setup, 1, CostFactors::default()).unwrap();
    let each = forecast.seconds_per_step() / cells / costs::cell(setup.plan.precision);
    assert!((1.0..4.0).contains(&each), "{each}");
    assert_eq!(time_estimate(&setup).unwrap().ranks, 1);
}

/// An engine that moves nothing, on rank 0 for all.
#[derive(Debug, Default)]
struct Still(Vec<process::Body>);

impl process::Served for Still {
    fn hello(&self) -> process::Hello {
        let kinds = |names: &[&str]| names.iter().map(ToString::to_string).collect();
        process::Hello {
            name: "still".into(),
            shapes: kinds(&["sphere"]),
            walls: kinds(&["plane"]),
            ..process::Hello::default()
        }
    }

    fn set_up(&mut self, _: process::SetUp, bodies: Vec<process::Body>) -> process::Outcome<()> {
        self.0 = bodies;
        Ok(())
    }

    fn advance(&mut self, _: f64, _: u32, _: &[process::AppliedLoad]) -> process::Outcome<()> {
        Ok(())
    }

    fn states(&mut self) -> process::Outcome<Vec<process::LoadedState>> {
        let state = |body: &process::Body| process::LoadedState {
            state: process::State {
                id: body.id,
                orientation: [0.0, 0.0, 0.0, 1.0],
                position: body.position,
                velocity: body.velocity,
                angular_velocity: body.angular_velocity,
                contact_force: [0.0; 3],
                contact_torque: [0.0; 3],
            },
            force: [0.0; 3],
            torque: [0.0; 3],
        };
        Ok(self.0.iter().map(state).collect())
    }

    fn contacts(&mut self) -> process::Outcome<Vec<process::ContactForce>> {
        Ok(Vec::new())
    }

    fn save(&mut self) -> process::Outcome<Vec<u8>> {
        Err("it does not save".into())
    }

    fn restore(&mut self, _: &[u8]) -> process::Outcome<()> {
        Err("it does not save".into())
    }
}

#[test]
fn ranks_send_the_messages_and_bytes_of_the_forecast_with_the_native_and_an_external_engine() {
    let mut touching = bed();
    for particle in &mut touching.particles {
        particle.position = particle.position.map(|x| 0.98035 * x);
        particle.velocity = [1e-5, 0.0, 0.0];
    }
    for (mut setup, is_external) in
        [(suspension(), false), (touching.clone(), false), (suspension(), true), (touching, true)]
    {
        if is_external {
            setup.engine = EngineChoice::Process(engine::ProcessOptions::default());
        }
        for ranks in [2, 4] {
            let work = Work::of(&setup);
            let cut = Decomposition::balanced(setup.domain, ranks, &work.weights(&Comm::Solo)).unwrap();
            let forecast = work.forecast(&cut);
            let sent = on_threads(ranks, |comm| {
                let mut simulation = if is_external {
                    let host = process::Host::Here(|_| Box::new(Still::default()));
                    let mut params = process::ExternalParams::new("still", "still".into(), host);
                    params.walls.clone_from(&setup.walls);
                    let handed = if comm.rank() == 0 { &setup.particles[..] } else { &[] };
                    let templates = setup.templates.clone();
                    let still =
                        process::External::new(params, cut.clone(), &comm, templates, handed).unwrap();
                    Simulation::with_engine(&setup, &cut, comm, Box::new(still)).unwrap()
                } else {
                    Simulation::new(&setup, &cut, comm).unwrap()
                };
                simulation.step().unwrap();
                let before = simulation.comm().traffic();
                simulation.step().unwrap();
                let sent = simulation.comm().traffic() - before;
                [sent.halo.bytes + sent.exchange.bytes, sent.halo.messages + sent.exchange.messages]
            });
            for (rank, ([bytes, messages], forecast)) in sent.into_iter().zip(&forecast.ranks).enumerate() {
                let off = (bytes as f64 / forecast.bytes() as f64 - 1.0).abs();
                assert!(off < 0.01, "rank {rank} of {ranks}: {bytes} bytes, not {}", forecast.bytes());
                assert_eq!(messages, forecast.messages() as u64, "rank {rank} of {ranks}");
            }
        }
    }
}
