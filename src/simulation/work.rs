//! Work of a time step by position, estimated from the particles and walls of the case: for the cuts of the box and their forecast.
//!
//! ```text
//! work = c_cell cells + sum over particles (c_covered covered cells + substeps c_particle) + substeps sum over contacts c_contact
//! ```
//!
//! [`costs`] has the constants. Particles that fall on a heap are not foreseen.

mod costs;
mod forecast;

use super::decompose;
use crate::case::Setup;
use crate::comm;
use crate::contact::PairFinder;
use crate::domain::{Domain, Weights};
use crate::engine::EngineChoice;
use crate::error::Result;
use crate::fluid::CHUNK;
use crate::math::Vec3;
use crate::wall::{Surface, Wall};
use costs::Form;
pub use costs::bytes_per_cell;
pub use forecast::{Forecast, RankForecast, Traffic};

/// Particles count as in contact if the spheres of their volume, grown by this part, meet: in a random packing about as many as touch
/// later (`hindered_settling` at volume fractions 0.2 and 0.3: 120 and 314, after 200 steps 106 and 303; cubes: 120, 198).
const NEAR: f64 = 0.03;

/// Points per axis at which the walls in the box are sampled.
const POINTS: usize = 64;

/// Work of a time step (s of one thread) by position.
#[derive(Clone, Debug)]
pub(crate) struct Work<'a> {
    setup: &'a Setup,
    bodies: Vec<Body>,
    contacts: Vec<Contact>,
    /// Walls with cells of the box in them.
    walls: Vec<Surface>,
}

#[derive(Clone, Copy, Debug)]
struct Body {
    /// Wrapped position (m).
    position: Vec3,
    template: u64,
    /// The box that holds it with half of the ramp of its solid fraction: middle and half edges (cells).
    middle: Vec3,
    half: Vec3,
    covered: f64,
    /// Cost of these beyond that of fluid (s).
    cost: f64,
}

/// Two particles near each other, or a particle and a wall.
#[derive(Clone, Copy, Debug)]
struct Contact {
    first: usize,
    second: Option<usize>,
    cost: f64,
}

impl<'a> Work<'a> {
    /// Of the particles and walls of a case.
    pub(crate) fn of(setup: &'a Setup) -> Self {
        let Setup { domain, templates, .. } = setup;
        let ramp = setup.fluid.as_ref().map(|fluid| fluid.coupling.half_layer());
        let bodies: Vec<Body> = (setup.particles.iter())
            .map(|particle| {
                let template = &templates[particle.template as usize];
                let (lo, hi) = template.shape.bounds(&particle.orientation());
                let position = domain.wrap(particle.position());
                let edges = (hi - lo) / domain.dx;
                let grown = edges.add_scalar(2.0 * ramp.unwrap_or(0.0));
                let volume = template.shape.volume() / (domain.dx * domain.dx * domain.dx);
                let covered = ramp.map_or(0.0, |_| volume * grown.product() / edges.product());
                Body {
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
            contacts: contacts(setup, &bodies),
            walls: ramp.map_or_else(Vec::new, |_| walls_inside(&setup.walls, domain)),
            bodies,
            setup,
        }
    }

    fn has_fluid(&self) -> bool {
        self.setup.fluid.is_some()
    }

    /// Cost of a cell of the fluid (s); zero without a fluid.
    fn cell(&self) -> f64 {
        if self.has_fluid() { costs::cell(self.setup.plan.precision) } else { 0.0 }
    }

    /// Cost of a particle on its owner and on each rank that has it as a ghost (s).
    fn particle(&self) -> f64 {
        // Else rank 0 moves them all.
        if is_shared(&self.setup.engine) { costs::PARTICLE * f64::from(self.setup.substeps) } else { 0.0 }
    }

    /// Bytes of a population.
    fn number(&self) -> usize {
        costs::by_precision(self.setup.plan.precision, 2, 4, 8)
    }

    /// The work by layers of cells.
    pub(crate) fn weights(&self) -> Weights {
        let domain = &self.setup.domain;
        let mut weights = Weights::even(domain, 0.0);
        let cells = self.swept();
        for axis in 0..3 {
            let layers = &mut weights.layers[axis];
            for (layer, cells) in layers.iter_mut().zip(&cells[axis]) {
                *layer += self.cell() * cells;
            }
            for body in &self.bodies {
                for (layer, part) in body.spread(domain, axis) {
                    layers[layer] += part * body.cost;
                }
                layers[domain.cell_of(body.position)[axis]] += self.particle();
            }
            for contact in &self.contacts {
                let at = self.bodies[contact.first].position;
                layers[domain.cell_of(at)[axis]] += contact.cost;
            }
        }
        // Particles near a face are on two ranks.
        let reach = self.reach() / domain.dx;
        let per_cell = self.bodies.len() as f64 / domain.cell_count() as f64;
        weights.face = reach * per_cell * self.particle();
        weights.variance = (self.bodies.iter().map(|body| body.cost + self.particle()))
            .chain(self.contacts.iter().map(|contact| contact.cost))
            .map(|work| work * work)
            .sum();
        if self.has_fluid() {
            weights.face += costs::face(self.setup.plan.precision) + 5.0 * self.number() as f64 * costs::BYTE;
            weights.chunk = CHUNK;
        }
        weights
    }

    /// Bounding radii of the particles for contacts by template (m), as the engine has them.
    fn radii(&self) -> Vec<f64> {
        let model = self.setup.contact.clone().unwrap_or_default();
        self.setup.templates.iter().map(|template| model.reach(&template.shape)).collect()
    }

    /// Largest distance of a ghost to a block (m).
    fn reach(&self) -> f64 {
        let largest = self.radii().into_iter().fold(0.0, f64::max);
        2.0 * (largest + self.setup.domain.dx)
    }

    /// Cells that are swept in each layer along each axis.
    fn swept(&self) -> [Vec<f64>; 3] {
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

/// Pairs of particles, and of particles and walls, that are near each other.
fn contacts(setup: &Setup, bodies: &[Body]) -> Vec<Contact> {
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
    let mut contacts: Vec<Contact> = PairFinder::new(setup.domain)
        .find(&positions, &radii)
        .iter()
        .map(|pair| {
            let [first, second] = pair.map(|i| i as usize);
            Contact {
                first,
                second: Some(second),
                cost: substeps * form(&bodies[first]).contact(form(&bodies[second]), model),
            }
        })
        .collect();
    for wall in &setup.walls {
        let near = (0..bodies.len()).filter(|&i| wall.surface.distance(positions[i]) < radii[i]);
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
mod tests;
