//! Ghost cells: which populations cross which face or edge of a block, and their exchange.
//!
//! In place, populations cross twice in two steps. After a sweep from [`Phase::Home`] the boundary cells of a block are
//! copied to the ghosts of its neighbours (*fill*), which the next sweep reads and writes; after that one the ghosts go
//! back to the boundary cells they stand for (*return*). Both move the same places: for a face the 5 populations that
//! cross it, for an edge 1, for a corner none. Nothing crosses a closed face of the box; see [`walls`](super::walls).

use super::layout::{Layout, Phase};
use crate::comm::{Comm, Halo};
use crate::domain::Decomposition;
use crate::lattice::{C, Q};
use bytemuck::Pod;

/// A row of cells to copy: first index and distance between cells, for `count` cells.
#[derive(Clone, Copy, Debug)]
struct Run {
    start: usize,
    distance: usize,
    count: usize,
}

/// What one message holds, in order.
#[derive(Default)]
struct Message {
    /// Boundary cells sent by a fill.
    fill_from: Vec<Run>,
    /// Ghosts received by a fill.
    fill_to: Vec<Run>,
    /// Ghosts sent by a return.
    return_from: Vec<Run>,
    /// Boundary cells received by a return.
    return_to: Vec<Run>,
}

/// The plan for one block, with its buffers.
pub(crate) struct FluidHalo<T> {
    messages: Vec<Message>,
    halo: Box<dyn Halo<T>>,
}

impl<T: Pod + Send> FluidHalo<T> {
    /// Collective.
    pub(crate) fn new(layout: &Layout, decomposition: &Decomposition, comm: &Comm) -> Self {
        let rank = comm.rank();
        let place = decomposition.place(rank).map(|p| p as isize);
        let domain = &decomposition.domain;
        // Across a closed face there is nobody.
        let neighbour = |d: [isize; 3]| {
            let to: [isize; 3] = std::array::from_fn(|a| place[a] + d[a]);
            let inside = |a: usize| (0..decomposition.grid[a] as isize).contains(&to[a]);
            (0..3)
                .all(|a| domain.periodic[a] || inside(a))
                .then(|| decomposition.rank_at(to))
        };
        let mut peers: Vec<usize> = C[1..].iter().filter_map(|&d| neighbour(d)).collect();
        peers.sort_unstable();
        peers.dedup();
        let messages: Vec<Message> = peers
            .iter()
            .map(|&peer| {
                let mut message = Message::default();
                // Sender and receiver list the directions in the order of the sender.
                for d in C.iter().skip(1).copied() {
                    if decomposition.grid[0] == 1 && d[1] == 0 && d[2] == 0 {
                        // The sweep wraps rows itself.
                        continue;
                    }
                    let back = d.map(|x| -x);
                    if neighbour(d) == Some(peer) {
                        message.fill_from.extend(runs(layout, back, Side::Boundary));
                        message.return_from.extend(runs(layout, d, Side::Ghost));
                    }
                    if neighbour(back) == Some(peer) {
                        message.fill_to.extend(runs(layout, back, Side::Ghost));
                        message.return_to.extend(runs(layout, d, Side::Boundary));
                    }
                }
                message
            })
            .collect();
        let lengths: Vec<usize> = messages
            .iter()
            .map(|m| m.fill_from.iter().map(|run| run.count).sum())
            .collect();
        Self {
            messages,
            halo: comm.halo(&peers, &lengths),
        }
    }

    /// Makes the ghosts (entering `Away`) or the boundary cells (entering `Home`) whole after a sweep.
    pub(crate) fn exchange(&mut self, populations: &mut [T], entered: Phase) {
        for (link, message) in self.messages.iter().enumerate() {
            let from = if entered == Phase::Away {
                &message.fill_from
            } else {
                &message.return_from
            };
            let mut buffer = self.halo.send(link);
            for run in from {
                let (now, rest) = buffer.split_at_mut(run.count);
                let source = populations[run.start..].iter().step_by(run.distance);
                now.iter_mut().zip(source).for_each(|(to, from)| *to = *from);
                buffer = rest;
            }
        }
        self.halo.exchange();
        for (link, message) in self.messages.iter().enumerate() {
            let to = if entered == Phase::Away {
                &message.fill_to
            } else {
                &message.return_to
            };
            let mut buffer = self.halo.received(link);
            for run in to {
                let (now, rest) = buffer.split_at(run.count);
                let target = populations[run.start..].iter_mut().step_by(run.distance);
                target.zip(now).for_each(|(to, from)| *to = *from);
                buffer = rest;
            }
        }
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Side {
    /// Ghost cells on side `d` of the block.
    Ghost,
    /// The real cells that are the ghosts on side `d` of the neighbour at `-d`.
    Boundary,
}

/// The places that cross a face or edge in direction `d`, population by population.
///
/// A real cell reaches ghost `g` through population `j` from `g - c_j`, so along the face only ghosts with a real
/// `g - c_j` count; the rest belongs to a neighbouring edge.
fn runs(layout: &Layout, d: [isize; 3], side: Side) -> Vec<Run> {
    let mut runs = Vec::new();
    for j in (1..Q).filter(|&j| (0..3).all(|a| d[a] == 0 || C[j][a] == d[a])) {
        let range = |a: usize| {
            let n = layout.size[a] as isize;
            match (d[a], side) {
                (0, _) => C[j][a].max(0)..n + C[j][a].min(0),
                (1, Side::Ghost) => n..n + 1,
                (_, Side::Ghost) => -1..0,
                (1, Side::Boundary) => 0..1,
                (_, Side::Boundary) => n - 1..n,
            }
        };
        let (xs, ys, zs) = (range(0), range(1), range(2));
        for z in zs {
            let at = |x: isize, y: isize| j * layout.stride + layout.cell(x, y, z);
            if d[0] == 0 {
                for y in ys.clone() {
                    runs.push(Run {
                        start: at(xs.start, y),
                        distance: 1,
                        count: xs.clone().count(),
                    });
                }
            } else {
                runs.push(Run {
                    start: at(xs.start, ys.start),
                    distance: layout.pitch,
                    count: ys.clone().count(),
                });
            }
        }
    }
    runs
}
