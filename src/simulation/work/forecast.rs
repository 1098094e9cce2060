//! Forecast of the work and the messages of every rank in a time step.
//!
//! ```text
//! time of a rank = work + c_message messages + c_byte bytes + 2 log2(ranks) c_message / 8
//!                + external engine: 2 (log2(ranks) c_message + 8 ranks c_byte) + 2 s log2(ranks) c_message
//! efficiency     = work on one rank / (ranks x longest time of a rank)
//! ```
//!
//! The fourth term is the global reduction of every eighth step. Behind an external engine each step has two messages whose receivers do not
//! know the senders, which costs a sum over all ranks of a number for each, and s = 5 small sums. The work of a rank includes ghosts and the packing of faces. Messages do
//! not hide behind work here, so the efficiency is a lower bound.

use super::{Work, costs, radii};
use crate::coupling::{CONTROL_INTERVAL, Coupling};
use crate::dem::assign::GhostLayer;
use crate::domain::Decomposition;
use crate::engine::EngineChoice;
use crate::fluid::CHUNK;
use crate::lattice::C;
use crate::math::Vec3;
use crate::memory;
use crate::particle::Particle;
use std::collections::{BTreeMap, BTreeSet};

/// Bytes of a particle on its way, with its load.
const PARTICLE: usize = size_of::<Particle>() + size_of::<[f64; 6]>();
/// Bytes of a load on its way to a part of an external engine, and of a state on its way back.
const APPLIED: usize = 56;
/// See [`APPLIED`].
const STATE: usize = 208;
/// Bytes of a particle while it is placed: 1e6 at random take 1.3 GB, 1e6 in a positions file 0.6 GB.
const PLACED: f64 = 1300.0;
/// Sums over all ranks in a step of an external engine.
const SUMS: f64 = 5.0;
/// Bytes of a part of the momentum exchange of a particle, and of its mean load.
const PARTIAL: usize = Coupling::PARTIAL;
/// Bytes of the force of a contact on a particle.
const PAIR_FORCE: usize = 64;
/// Least number of cells, estimated, that a body covers in a block for there to be one.
const LEAST: f64 = 5.0;
/// Points per axis at which the walls in a block are sampled.
const POINTS: usize = 16;

/// Data that a rank sends to another one in a time step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Traffic {
    /// Bytes of populations.
    pub halo: usize,
    /// Bytes about particles: ghosts, loads, contact forces.
    pub particles: usize,
    /// Number of messages.
    pub messages: usize,
}

/// Work of one rank in a time step.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RankForecast {
    /// Cells of its block in each direction.
    pub size: [usize; 3],
    /// Cells that particles cover, estimated.
    pub covered: f64,
    /// Particles it owns.
    pub particles: usize,
    /// Ghosts: particles of other ranks.
    pub ghosts: usize,
    /// Contacts it evaluates, estimated.
    pub contacts: usize,
    /// Work (s of one thread).
    pub work: f64,
    /// Memory of its cells and particles during the run (bytes), estimated.
    pub memory: f64,
    /// Data that it sends, by receiver.
    pub sends: BTreeMap<usize, Traffic>,
}

impl RankForecast {
    /// Number of cells.
    pub fn cells(&self) -> usize {
        self.size.iter().product()
    }

    /// Bytes sent.
    pub fn bytes(&self) -> usize {
        self.sends.values().map(|to| to.halo + to.particles).sum()
    }

    /// Messages sent.
    pub fn messages(&self) -> usize {
        self.sends.values().map(|to| to.messages).sum()
    }

    /// Time (s) with messages, of which each and a byte of each take so long (s), less global reductions.
    fn time(&self, [message, byte]: [f64; 2]) -> f64 {
        self.work + self.messages() as f64 * message + self.bytes() as f64 * byte
    }
}

/// Work of all ranks in a time step.
#[derive(Clone, Debug, PartialEq)]
pub struct Forecast {
    /// Number of blocks in each direction.
    pub grid: [usize; 3],
    /// By rank.
    pub ranks: Vec<RankForecast>,
    /// Work of one rank that does it all (s of one thread).
    pub alone: f64,
    /// Messages of a step to ranks that do not know the sender: those to and from an external engine.
    pub routes: usize,
    /// Time that a message takes, and that a byte in it does (s).
    pub message: [f64; 2],
    /// Memory of the process that reads the case and places all particles, until each has its own (bytes), estimated.
    pub placing: f64,
}

impl Forecast {
    /// Mean over largest work.
    pub fn balance(&self) -> f64 {
        let (sum, most) = (self.ranks.iter())
            .fold((0.0, 0.0_f64), |(sum, most), rank| (sum + rank.work, most.max(rank.work)));
        if most > 0.0 { sum / self.ranks.len() as f64 / most } else { 1.0 }
    }

    /// Time of a step (s): of the slowest rank, with messages and reductions.
    pub fn seconds_per_step(&self) -> f64 {
        let ranks = self.ranks.len() as f64;
        let [message, byte] = self.message;
        let sum = libm::log2(ranks) * message;
        let reductions = 2.0 * sum / CONTROL_INTERVAL as f64;
        let routing = if self.routes > 0 {
            self.routes as f64 * (sum + 8.0 * ranks * byte) + 2.0 * SUMS * sum
        } else {
            0.0
        };
        (self.ranks.iter().map(|rank| rank.time(self.message))).fold(0.0, f64::max) + reductions + routing
    }

    /// Parallel efficiency with messages.
    pub fn efficiency(&self) -> f64 {
        let longest = self.seconds_per_step();
        if longest > 0.0 { self.alone / (self.ranks.len() as f64 * longest) } else { 1.0 }
    }
}

impl Work<'_> {
    /// Work of every rank.
    pub(crate) fn forecast(&self, cut: &Decomposition) -> Forecast {
        let whole = Decomposition::solo(cut.domain);
        let routes = if self.setup.engine == EngineChoice::Native || cut.ranks() == 1 { 0 } else { 2 };
        let placing = PLACED * self.bodies.len() as f64;
        let alone = self.by_rank(&whole)[0].work;
        Forecast { grid: cut.grid, ranks: self.by_rank(cut), alone, routes, placing, message: self.message() }
    }

    /// The rank with the part of an external engine that has a particle: at the start, as it moves with the engine's own blocks.
    fn holder(&self, cut: &Decomposition, position: Vec3, owner: usize) -> usize {
        if let EngineChoice::Process(options) = &self.setup.engine {
            return owner * options.processes.clamp(1, cut.ranks()) / cut.ranks();
        }
        if !self.setup.engine.is_in_parts() {
            return 0;
        }
        // LIGGGHTS and LAMMPS have equal blocks.
        let size = self.setup.domain.size();
        cut.rank_of(std::array::from_fn(|axis| {
            let blocks = cut.grid[axis];
            ((position[axis] / size[axis] * blocks as f64) as usize).min(blocks - 1)
        }))
    }

    fn by_rank(&self, cut: &Decomposition) -> Vec<RankForecast> {
        let mut ranks: Vec<RankForecast> = (0..cut.ranks()).map(|rank| self.of_fluid(cut, rank)).collect();
        self.add_peers(cut, &mut ranks);
        let native = self.setup.engine == EngineChoice::Native;
        let substeps = self.setup.substeps as usize;
        let near = GhostLayer::new(cut.clone(), 0, &radii(self.setup));
        let owners: Vec<usize> = self.bodies.iter().map(|body| near.owner(body.position)).collect();
        let send = |ranks: &mut [RankForecast], from: usize, to: usize, bytes: usize| {
            if from != to {
                ranks[from].sends.entry(to).or_default().particles += bytes;
            }
        };
        // Of loads and of states, a message from one rank to another.
        let mut routed = BTreeSet::new();
        for (body, &owner) in self.bodies.iter().zip(&owners) {
            ranks[owner].particles += 1;
            for rank in near.ranks_with(body.position, body.template) {
                ranks[rank].work += self.particle();
                ranks[rank].ghosts += usize::from(rank != owner);
                send(&mut ranks, owner, rank, if native { substeps * PARTICLE } else { PARTICLE });
            }
            if !native {
                let holder = self.holder(cut, body.position, owner);
                send(&mut ranks, owner, holder, APPLIED);
                send(&mut ranks, holder, owner, STATE);
                if holder != owner {
                    routed.extend([(true, owner, holder), (false, holder, owner)]);
                }
            }
            if self.has_fluid() {
                for (rank, part) in
                    parts_of_blocks(cut, std::array::from_fn(|axis| self.slabs(body, cut, axis)))
                {
                    ranks[rank].covered += part * body.covered;
                    ranks[rank].work += part * self.cover(body);
                    if part * body.covered >= LEAST {
                        send(&mut ranks, rank, owner, PARTIAL);
                    }
                }
            }
        }
        let per_cell = if self.has_fluid() { costs::bytes_per_cell(self.setup.plan.precision) } else { 0.0 };
        for rank in &mut ranks {
            rank.memory = per_cell * rank.cells() as f64 + memory::PER_PARTICLE * rank.particles as f64;
        }
        for (_, from, to) in routed {
            ranks[from].sends.entry(to).or_default().messages += 1;
        }
        for contact in &self.contacts {
            let of = |i: usize| (owners[i], self.bodies[i].position, self.bodies[i].template);
            let first = contact.first;
            let second = contact.second.unwrap_or(first);
            let rank = near.evaluating_rank(of(first), of(second)).unwrap_or(owners[first]);
            ranks[rank].contacts += 1;
            ranks[rank].work += self.contact(contact);
            // An engine in parts has messages of its own.
            for i in [first, second].into_iter().filter(|_| native) {
                send(&mut ranks, rank, owners[i], substeps * PAIR_FORCE);
            }
        }
        ranks
    }

    /// Cells, and the populations that leave the block.
    fn of_fluid(&self, cut: &Decomposition, rank: usize) -> RankForecast {
        let block = cut.block(rank);
        let size = block.size();
        let mut forecast = RankForecast { size, ..RankForecast::default() };
        if !self.has_fluid() {
            return forecast;
        }
        let row_ends = size[0].next_multiple_of(CHUNK) as f64 / size[0] as f64;
        let swept = self.swept_part(block.lo, size) * block.cell_count() as f64 * row_ends;
        forecast.work = swept * self.cell();
        let place = cut.grid_index(rank);
        for d in &C[1..] {
            let to: [isize; 3] = std::array::from_fn(|a| place[a] as isize + d[a]);
            let open =
                (0..3).all(|a| cut.domain.is_periodic(a) || (0..cut.grid[a] as isize).contains(&to[a]));
            if !open || (cut.grid[0] == 1 && d[1] == 0 && d[2] == 0) {
                continue;
            }
            let numbers = numbers_across(*d, size);
            forecast.work += numbers as f64 / 5.0 * self.face();
            let peer = cut.rank_at(to);
            if peer != rank {
                let traffic = forecast.sends.entry(peer).or_default();
                traffic.halo += numbers * self.number();
                traffic.messages = 1;
            }
        }
        forecast
    }

    /// Messages that go to every peer whatever they hold: ghosts, contact forces and memories in each sub-step, and loads.
    fn add_peers(&self, cut: &Decomposition, ranks: &mut [RankForecast]) {
        let radii = radii(self.setup);
        let native = self.setup.engine == EngineChoice::Native;
        let largest =
            (self.setup.templates.iter()).map(|template| template.shape.circumradius()).fold(0.0, f64::max);
        for (rank, forecast) in ranks.iter_mut().enumerate() {
            // Those of an external engine are found once in a step, and nothing else is sent.
            let of_engine = if native { 3 * self.setup.substeps as usize } else { 1 };
            for peer in GhostLayer::new(cut.clone(), rank, &radii).peers {
                forecast.sends.entry(peer).or_default().messages += of_engine;
            }
            if self.has_fluid() {
                for peer in cut.neighbours(rank, largest + 2.0 * cut.domain.dx) {
                    forecast.sends.entry(peer).or_default().messages += 1;
                }
            }
        }
    }

    /// Part of the cells of a block that are swept.
    pub(in crate::simulation) fn swept_part(&self, lo: [usize; 3], size: [usize; 3]) -> f64 {
        if self.walls.is_empty() {
            return 1.0;
        }
        let counts = self.swept_points(lo, size, POINTS);
        counts[0].iter().sum::<f64>() / counts.iter().map(Vec::len).product::<usize>() as f64
    }

    /// Slabs of an axis in which a body lies, and its part in each.
    fn slabs(&self, body: &super::Body, cut: &Decomposition, axis: usize) -> BTreeMap<usize, f64> {
        let mut slabs = BTreeMap::new();
        for (layer, part) in body.spread(&self.setup.domain, axis) {
            let slab = cut.cuts[axis].partition_point(|&at| at <= layer) - 1;
            *slabs.entry(slab).or_insert(0.0) += part;
        }
        slabs
    }
}

/// Parts in all blocks, as products of those in the slabs.
fn parts_of_blocks(cut: &Decomposition, [xs, ys, zs]: [BTreeMap<usize, f64>; 3]) -> Vec<(usize, f64)> {
    let mut parts = Vec::new();
    for (&z, of_z) in &zs {
        for (&y, of_y) in &ys {
            parts.extend(xs.iter().map(|(&x, of_x)| (cut.rank_of([x, y, z]), of_x * of_y * of_z)));
        }
    }
    parts
}

/// Populations that leave a block in direction `d`: five per cell of a face, one per cell of an edge, fewer at the rims, where the
/// diagonal ones go to another neighbour.
fn numbers_across(d: [isize; 3], size: [usize; 3]) -> usize {
    C.iter()
        .filter(|c| (0..3).all(|a| d[a] == 0 || c[a] == d[a]))
        .map(|c| (0..3).filter(|&a| d[a] == 0).map(|a| size[a] - c[a].unsigned_abs()).product::<usize>())
        .sum()
}

#[cfg(test)]
mod tests;
