//! Work of a time step by position, estimated from the particles and walls of the case: for the cuts of the box and their forecast.
//!
//! ```text
//! work = c_cell cells + sum over particles (c_covered covered cells + substeps c_particle) + substeps sum over contacts c_contact
//! ```
//!
//! [`costs`] has the constants. Particles that fall on a heap are not foreseen.

mod costs;
mod forecast;

use super::run::refuse_divided;
use super::{Simulation, decompose};
use crate::case::Setup;
use crate::comm::{self, Comm};
use crate::contact::PairFinder;
use crate::dem::assign::GhostLayer;
use crate::domain::{Block, Domain, Weights};
use crate::engine::EngineChoice;
use crate::error::Result;
use crate::fluid::CHUNK;
use crate::math::Vec3;
use crate::particle::Particle;
use crate::wall::{Surface, Wall};
use costs::Form;
pub use costs::bytes_per_cell;
pub use forecast::{Forecast, RankForecast, Traffic};
use serde::{Deserialize, Serialize};
use std::rc::Rc;

/// Particles count as in contact if the spheres of their volume, grown by this part, meet: in a random packing about as many as touch
/// later (`hindered_settling` at volume fractions 0.2 and 0.3: 120 and 314, after 200 steps 106 and 303; cubes: 120, 198).
const NEAR: f64 = 0.03;

/// Unit of work in sums over ranks (s), and that of its square (s^2).
const TICK: f64 = 1e-16;
const SQUARE: f64 = 1e-18;

/// Points per axis at which the walls in the box are sampled.
const POINTS: usize = 64;

/// Work of a time step (s of one thread) by position.
#[derive(Clone, Debug)]
pub(crate) struct Work<'a> {
    setup: &'a Setup,
    /// Those that this rank owns, and its ghosts.
    bodies: Vec<Body>,
    owned: usize,
    /// Of each pair that of the owner of the first of them.
    contacts: Vec<Contact>,
    /// Walls with cells of the box in them.
    walls: Vec<Surface>,
    pub(super) factors: CostFactors,
    /// Cells that are swept in each layer along each axis, as walls at the start leave them.
    pub(super) swept: Swept,
}

/// Cells in each layer along each axis.
pub(super) type Swept = Rc<[Vec<f64>; 3]>;

/// Costs on a machine over those that are built in.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CostFactors {
    /// A cell of the fluid.
    pub cell: f64,
    /// A cell that a particle covers, beyond that.
    pub covered_cell: f64,
    /// Motion and contacts of particles.
    pub particles: f64,
    /// A message.
    pub message: f64,
    /// A byte in it.
    pub byte: f64,
}

impl CostFactors {
    /// Those of messages that take so long, and whose bytes do (s); a clock may have missed them.
    #[must_use]
    pub fn with_messages(self, message: f64, byte: f64) -> Self {
        let [message, byte] = [message / costs::MESSAGE, byte / costs::BYTE].map(|of| of.clamp(1e-3, 1e3));
        Self { message, byte, ..self }
    }
}

impl Default for CostFactors {
    fn default() -> Self {
        Self { cell: 1.0, covered_cell: 1.0, particles: 1.0, message: 1.0, byte: 1.0 }
    }
}

#[derive(Clone, Copy, Debug)]
struct Body {
    id: u64,
    /// Wrapped position (m).
    position: Vec3,
    template: u64,
    /// The box that holds it with half of the ramp of its solid fraction: middle and half edges (cells).
    middle: Vec3,
    half: Vec3,
    covered: f64,
    /// Cost of these beyond that of fluid (s), as it is built in.
    cost: f64,
}

/// Two particles near each other, or a particle and a wall.
#[derive(Clone, Copy, Debug)]
struct Contact {
    first: usize,
    second: Option<usize>,
    /// As it is built in (s).
    cost: f64,
}

/// Work (s) of cells, of what particles cover, and of their motion and contacts.
pub(super) type Parts = [f64; 3];

impl<'a> Work<'a> {
    /// Of the particles of a case at the start, all of which are here, and its walls.
    pub(crate) fn of(setup: &'a Setup) -> Self {
        Self::with(setup, CostFactors::default())
    }

    /// The same on a machine with other costs.
    pub(crate) fn with(setup: &'a Setup, factors: CostFactors) -> Self {
        let finder = PairFinder::new(setup.domain);
        let work = Self::among(setup, (&setup.particles, setup.particles.len()), finder, Swept::default());
        let swept = Rc::new(work.count_swept());
        Self { factors, swept, ..work }
    }

    /// Of the particles of a rank, of which it owns the first ones.
    fn among(
        setup: &'a Setup,
        (particles, owned): (&[Particle], usize),
        finder: PairFinder,
        swept: Swept,
    ) -> Self {
        let Setup { domain, templates, .. } = setup;
        let ramp = setup.fluid.as_ref().map(|fluid| fluid.coupling.half_layer());
        let bodies: Vec<Body> = (particles.iter())
            .map(|particle| {
                let template = &templates[particle.template as usize];
                let (lo, hi) = template.shape.bounds(&particle.orientation());
                let position = domain.wrap(particle.position());
                let edges = (hi - lo) / domain.dx;
                let grown = edges.add_scalar(2.0 * ramp.unwrap_or(0.0));
                let volume = template.shape.volume() / (domain.dx * domain.dx * domain.dx);
                let covered = ramp.map_or(0.0, |_| volume * grown.product() / edges.product());
                Body {
                    id: particle.id,
                    position,
                    template: particle.template,
                    middle: (position + (lo + hi) * 0.5) / domain.dx,
                    half: grown * 0.5,
                    covered,
                    cost: covered * Form::of(template).covered_cell(),
                }
            })
            .collect();
        Self {
            contacts: contacts(setup, (&bodies, owned), finder),
            walls: ramp.map_or_else(Vec::new, |_| walls_inside(&setup.walls, domain)),
            bodies,
            owned,
            setup,
            factors: CostFactors::default(),
            swept,
        }
    }

    /// Of the walls alone.
    pub(super) fn of_walls(setup: &'a Setup) -> Self {
        Self::among(setup, (&[], 0), PairFinder::new(setup.domain), Swept::default())
    }

    /// Of the particles as they are in a run, those of this rank; cells are swept as at the start.
    pub(super) fn now(setup: &'a Setup, simulation: &Simulation, swept: Swept) -> Self {
        let store = simulation.dem().particles();
        let radii = radii(setup);
        let near = GhostLayer::new(simulation.cut.clone(), simulation.comm.rank(), &radii);
        let (lo, extent) = near.window();
        let finder = PairFinder::in_window(setup.domain, lo, extent);
        Self::among(setup, (&store.particles, store.owned), finder, swept)
    }

    /// Cost of the cells that a body covers beyond that of fluid (s).
    fn cover(&self, body: &Body) -> f64 {
        body.cost * self.factors.covered_cell
    }

    /// Cost of a contact in a step (s).
    fn contact(&self, contact: &Contact) -> f64 {
        contact.cost * self.factors.particles
    }

    fn has_fluid(&self) -> bool {
        self.setup.fluid.is_some()
    }

    /// Cost of a cell of the fluid (s); zero without a fluid.
    fn cell(&self) -> f64 {
        if self.has_fluid() { costs::cell(self.setup.plan.precision) * self.factors.cell } else { 0.0 }
    }

    /// Cost of a cell of a face between two ranks (s).
    fn face(&self) -> f64 {
        costs::face(self.setup.plan.precision) * self.factors.cell
    }

    /// Time that a message takes, and that a byte in it does (s).
    fn message(&self) -> [f64; 2] {
        [costs::MESSAGE * self.factors.message, costs::BYTE * self.factors.byte]
    }

    /// Cost of a particle on its owner and on each rank that has it as a ghost (s).
    fn particle(&self) -> f64 {
        // Else rank 0 moves them all.
        if is_shared(&self.setup.engine) {
            costs::PARTICLE * f64::from(self.setup.substeps) * self.factors.particles
        } else {
            0.0
        }
    }

    /// Bytes of a population.
    fn number(&self) -> usize {
        costs::by_precision(self.setup.plan.precision, 2, 4, 8)
    }

    /// The work by layers of cells, of the particles of all ranks. Collective.
    pub(crate) fn weights(&self, comm: &Comm) -> Weights {
        let domain = &self.setup.domain;
        let own = &self.bodies[..self.owned];
        let mut layers = domain.cells.map(|n| vec![0.0; n]);
        for (axis, layers) in layers.iter_mut().enumerate() {
            for body in own {
                for (layer, part) in body.spread(domain, axis) {
                    layers[layer] += part * self.cover(body);
                }
                layers[domain.cell_of(body.position)[axis]] += self.particle();
            }
            for contact in &self.contacts {
                let at = self.bodies[contact.first].position;
                layers[domain.cell_of(at)[axis]] += self.contact(contact);
            }
        }
        let squares: f64 = (own.iter().map(|body| self.cover(body) + self.particle()))
            .chain(self.contacts.iter().map(|contact| self.contact(contact)))
            .map(|work| work * work)
            .sum();
        // Rounded, so that all ranks find the same.
        let words = layers.concat().into_iter().map(|work| work / TICK).chain([squares / SQUARE]);
        let most = (i64::MAX / comm.size() as i64) as f64;
        let mut words: Vec<i64> =
            words.map(|word| word.round().min(most) as i64).chain([own.len() as i64]).collect();
        comm.sum(&mut words);
        let [.., squares, bodies] = words[..] else { unreachable!("two words at least") };
        let mut sums = words.iter().map(|word| *word as f64 * TICK);
        let cells = &self.swept;
        let mut weights = Weights::even(domain, 0.0);
        for axis in 0..3 {
            for (layer, cells) in weights.layers[axis].iter_mut().zip(&cells[axis]) {
                *layer = sums.next().unwrap_or_default() + self.cell() * cells;
            }
        }
        // Particles near a face are on two ranks.
        let reach = self.reach() / domain.dx;
        let per_cell = bodies as f64 / domain.cell_count() as f64;
        weights.face = reach * per_cell * self.particle();
        weights.variance = squares as f64 * SQUARE;
        if self.has_fluid() {
            weights.face += self.face() + 5.0 * self.number() as f64 * self.message()[1];
            weights.chunk = CHUNK;
        }
        weights
    }

    /// Work of this rank in its block, of whose cells a part is swept.
    pub(super) fn of_block(&self, block: &Block, swept: f64) -> Parts {
        let domain = &self.setup.domain;
        let cells = block.cell_count() as f64 * swept;
        let part = |body: &Body| -> f64 {
            let along = |axis: usize| -> f64 {
                let inside = |layer: &usize| (block.lo[axis]..block.hi[axis]).contains(layer);
                body.spread(domain, axis).filter(|(layer, _)| inside(layer)).map(|(_, part)| part).sum()
            };
            self.cover(body) * (0..3).map(along).product::<f64>()
        };
        let contacts: f64 = self.contacts.iter().map(|contact| self.contact(contact)).sum();
        [
            cells * self.cell(),
            self.bodies.iter().map(part).sum(),
            self.bodies.len() as f64 * self.particle() + contacts,
        ]
    }

    /// Largest distance of a ghost to a block (m).
    fn reach(&self) -> f64 {
        let largest = radii(self.setup).into_iter().fold(0.0, f64::max);
        2.0 * (largest + self.setup.domain.dx)
    }

    /// Cells that are swept in each layer along each axis.
    pub(super) fn count_swept(&self) -> [Vec<f64>; 3] {
        let cells = self.setup.domain.cells;
        let counts = self.swept_points([0; 3], cells, POINTS);
        let points = counts.each_ref().map(Vec::len);
        let all: usize = points.iter().product();
        std::array::from_fn(|axis| {
            // A layer of cells stands in the middle of its points.
            let layer = self.setup.domain.cell_count() as f64 / cells[axis] as f64;
            let asked = (all / points[axis]) as f64;
            (0..cells[axis]).map(|n| counts[axis][n * points[axis] / cells[axis]] / asked * layer).collect()
        })
    }

    /// Of evenly spaced cells of a block, at most `most` per axis, the number that are swept in each layer along each axis.
    fn swept_points(&self, lo: [usize; 3], size: [usize; 3], most: usize) -> [Vec<f64>; 3] {
        let points = size.map(|n| n.min(most));
        let at = |axis: usize, p: usize| lo[axis] + (size[axis] * p + size[axis] / 2) / points[axis];
        let mut counts = points.map(|n| vec![0.0; n]);
        for z in 0..points[2] {
            for y in 0..points[1] {
                for x in 0..points[0] {
                    if self.is_swept([at(0, x), at(1, y), at(2, z)]) {
                        counts[0][x] += 1.0;
                        counts[1][y] += 1.0;
                        counts[2][z] += 1.0;
                    }
                }
            }
        }
        counts
    }

    /// Returns true if a sweep works on a cell: also for one in a wall that is in a chunk with fluid.
    fn is_swept(&self, [x, y, z]: [usize; 3]) -> bool {
        let dx = self.setup.domain.dx;
        let in_wall = |x: usize| {
            let centre = Vec3::new(x as f64 + 0.5, y as f64 + 0.5, z as f64 + 0.5) * dx;
            self.walls.iter().any(|wall| wall.is_wall(centre))
        };
        let chunk = x - x % CHUNK;
        self.walls.is_empty()
            || !in_wall(x)
            || (chunk..(chunk + CHUNK).min(self.setup.domain.cells[0])).any(|x| !in_wall(x))
    }
}

impl Body {
    /// The layers of cells along an axis in which it lies, and the part of its volume in each: exact for an ellipsoid,
    /// whose sections are `1 - t^2` of the largest at the part `t` of the half edge.
    fn spread(&self, domain: &Domain, axis: usize) -> impl Iterator<Item = (usize, f64)> {
        let (middle, half) = (self.middle[axis], self.half[axis]);
        let (cells, periodic) = (domain.cells[axis] as i64, domain.is_periodic(axis));
        let below = move |x: f64| {
            let t = ((x - middle) / half).clamp(-1.0, 1.0);
            (2.0 + 3.0 * t - t * t * t) / 4.0
        };
        let layers = (middle - half).floor() as i64..=(middle + half).floor() as i64;
        layers.map(move |n| {
            let part = below(n as f64 + 1.0) - below(n as f64);
            let layer = if periodic { n.rem_euclid(cells) } else { n.clamp(0, cells - 1) };
            (layer as usize, part)
        })
    }
}

/// True if every rank moves particles. An engine in parts takes about as long as the native one.
fn is_shared(engine: &EngineChoice) -> bool {
    *engine == EngineChoice::Native || engine.is_in_parts()
}

/// Bounding radii of the particles for contacts by template (m), as the engine has them.
fn radii(setup: &Setup) -> Vec<f64> {
    let model = setup.contact.clone().unwrap_or_default();
    setup.templates.iter().map(|template| model.reach(&template.shape)).collect()
}

/// Pairs of particles, and of particles and walls, that are near each other, of which the first is owned here.
fn contacts(setup: &Setup, (bodies, owned): (&[Body], usize), mut finder: PairFinder) -> Vec<Contact> {
    let Some(model) = setup.contact.as_ref().filter(|_| is_shared(&setup.engine)) else {
        return Vec::new();
    };
    let forms: Vec<Form> = setup.templates.iter().map(Form::of).collect();
    let form = |body: &Body| forms[body.template as usize];
    let by_template: Vec<f64> = (setup.templates.iter())
        .map(|template| 0.5 * (1.0 + NEAR) * template.shape.equivalent_diameter())
        .collect();
    let radii: Vec<f64> = (bodies.iter()).map(|body| by_template[body.template as usize]).collect();
    let positions: Vec<Vec3> = bodies.iter().map(|body| body.position).collect();
    let substeps = f64::from(setup.substeps);
    let mut contacts: Vec<Contact> = finder
        .find(&positions, &radii)
        .iter()
        .map(|pair| {
            let [a, b] = pair.map(|i| i as usize);
            if bodies[a].id <= bodies[b].id { [a, b] } else { [b, a] }
        })
        .filter(|[first, _]| *first < owned)
        .map(|[first, second]| Contact {
            first,
            second: Some(second),
            cost: substeps * form(&bodies[first]).contact(form(&bodies[second]), model),
        })
        .collect();
    for wall in &setup.walls {
        let near = (0..owned).filter(|&i| wall.surface.distance(positions[i]) < radii[i]);
        contacts.extend(near.map(|first| Contact {
            first,
            second: None,
            cost: substeps * form(&bodies[first]).contact(form(&bodies[first]), model),
        }));
    }
    contacts
}

/// Those walls that are not merely closed faces of the box.
fn walls_inside(walls: &[Wall], domain: &Domain) -> Vec<Surface> {
    let half = 0.5 * domain.dx;
    let size = domain.size();
    // The cells in the corners lie furthest behind a plane.
    let corners: Vec<Vec3> = (0..8)
        .map(|corner| Vec3::from_fn(|i, _| if corner >> i & 1 == 0 { half } else { size[i] - half }))
        .collect();
    (walls.iter())
        .map(|wall| wall.surface.clone())
        .filter(|surface| match surface {
            Surface::Plane { .. } => corners.iter().any(|&corner| surface.distance(corner) < 0.0),
            _ => true,
        })
        .collect()
}

/// Time of a step, estimated from the particles and walls at the start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimeEstimate {
    /// Of a step of the slowest rank (s).
    pub seconds_per_step: f64,
    /// Number of ranks, threads or processes.
    pub ranks: usize,
}

/// Time of a step of a case on the ranks that it asks for, or [`Error::Input`](crate::Error::Input) if these are too many.
pub fn time_estimate(setup: &Setup) -> Result<TimeEstimate> {
    refuse_divided(setup)?;
    let cut = decompose(setup)?;
    let ranks = cut.ranks();
    // Threads may share cores; the cores of processes are unknown.
    let turns = match comm::launched() {
        Some(launched) if launched.size > 1 => 1.0,
        _ => (ranks as f64 / cores() as f64).max(1.0),
    };
    Ok(TimeEstimate { seconds_per_step: turns * Work::of(setup).forecast(&cut).seconds_per_step(), ranks })
}

/// Cores of this machine that the program may use.
pub(super) fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

#[cfg(test)]
pub(super) mod tests;
