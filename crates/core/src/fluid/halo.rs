//! Ghost cells: which populations cross which face or edge of a block, and their exchange.
//!
//! After a sweep from [`AaPhase::Even`] the boundary cells of a block are copied to the ghosts of its neighbours (*fill*),
//! which the next sweep reads and writes; after that one the ghosts are copied back (*return*). Both copy the same slots:
//! for a face the 5 populations that cross it, for an edge 1, for a corner none. Nothing crosses a closed face; along one that
//! [sends back to neighbours](crate::domain::Face::sends_to_neighbours) what it sends back into cells of the neighbour crosses, too ([`Beyond`]).

use super::layout::{AaPhase, Layout};
use crate::comm::{Comm, Halo};
use crate::domain::Decomposition;
use crate::error::Result;
use crate::lattice::{C, Q};
use bytemuck::Pod;
use std::collections::BTreeMap;

/// A row of cells to copy: first index and distance between cells, for `count` cells.
#[derive(Clone, Copy, Debug)]
struct Run {
    start: usize,
    distance: usize,
    count: usize,
}

/// Contents of one message, in order, by the phase that is entered: even a return, odd a fill.
#[derive(Default)]
struct Message {
    from: [Vec<Run>; 2],
    to: [Vec<Run>; 2],
}

impl Message {
    /// Slots that are sent on entering a phase, and slots that are received into.
    fn runs(&self, entered: AaPhase) -> (&[Run], &[Run]) {
        (&self.from[entered as usize], &self.to[entered as usize])
    }

    /// All messages of a rank by peer, ascending, including those to itself.
    fn all(layout: &Layout, decomposition: &Decomposition, rank: usize) -> BTreeMap<usize, Self> {
        let mut messages = BTreeMap::<usize, Self>::new();
        let [outwards, inwards] = beyond(decomposition, rank);
        // Sender and receiver list the directions in the order of the sender.
        for d in C.iter().skip(1).copied() {
            if decomposition.grid[0] == 1 && d[1] == 0 && d[2] == 0 {
                // The sweep wraps rows itself.
                continue;
            }
            let back = d.map(|x| -x);
            if let Some(peer) = neighbour(decomposition, rank, d) {
                let message = messages.entry(peer).or_default();
                message.from[1].extend(runs(layout, back, Side::Boundary, &outwards));
                message.from[0].extend(runs(layout, d, Side::Ghost, &inwards));
            }
            if let Some(peer) = neighbour(decomposition, rank, back) {
                let message = messages.entry(peer).or_default();
                message.to[1].extend(runs(layout, back, Side::Ghost, &outwards));
                message.to[0].extend(runs(layout, d, Side::Boundary, &inwards));
            }
        }
        messages
    }
}

/// The rank of the block next to that of `rank` in a direction; none across a closed face.
fn neighbour(decomposition: &Decomposition, rank: usize, d: [isize; 3]) -> Option<usize> {
    let block = decomposition.grid_index(rank);
    let to: [isize; 3] = std::array::from_fn(|a| block[a] as isize + d[a]);
    let inside = |a: usize| (0..decomposition.grid[a] as isize).contains(&to[a]);
    (0..3).all(|a| decomposition.domain.is_periodic(a) || inside(a)).then(|| decomposition.rank_at(to))
}

/// Directions along each axis in which populations are copied in one more layer of cells: to the lower and to the upper face.
type Beyond = [[isize; 2]; 3];

/// At faces of the block that send back to neighbours that lies, on entering `Odd`, in the ghosts beyond, in slots of populations
/// that go outwards, and on entering `Even` in the cells beside them, in slots of those that go inwards.
fn beyond(decomposition: &Decomposition, rank: usize) -> [Beyond; 2] {
    let (block, faces) = (decomposition.grid_index(rank), decomposition.domain.faces);
    let outwards: Beyond = std::array::from_fn(|a| {
        let is_last = [block[a] == 0, block[a] + 1 == decomposition.grid[a]];
        [0, 1].map(|side| {
            isize::from(is_last[side] && faces[2 * a + side].sends_to_neighbours()) * [-1, 1][side]
        })
    });
    [outwards, outwards.map(|sides| sides.map(|c| -c))]
}

/// All slots of some runs.
fn each_slot(runs: &[Run]) -> Vec<u64> {
    let slots = |run: &Run| {
        let Run { start, distance, count } = *run;
        (0..count).map(move |k| (start + k * distance) as u64)
    };
    runs.iter().flat_map(slots).collect()
}

/// Messages that go together.
pub(crate) struct Pattern<T> {
    pub(crate) peers: Vec<usize>,
    messages: Vec<Message>,
    halo: Halo<T>,
    under_way: bool,
}

impl<T: Pod + Send> Pattern<T> {
    /// Collective.
    fn new(messages: Vec<(usize, Message)>, comm: &Comm) -> Result<Self> {
        let (peers, messages): (Vec<usize>, Vec<Message>) = messages.into_iter().unzip();
        let lengths: Vec<usize> =
            messages.iter().map(|m| m.from[1].iter().map(|run| run.count).sum()).collect();
        let halo = comm.halo(&peers, &lengths)?;
        Ok(Self { peers, messages, halo, under_way: false })
    }

    /// Packs and sends, unless that has been done since the last [`finish`](Self::finish).
    pub(crate) fn start(&mut self, populations: &[T], entered: AaPhase) {
        if self.under_way || self.messages.is_empty() {
            return;
        }
        for (link, message) in self.messages.iter().enumerate() {
            let mut buffer = self.halo.send(link);
            for run in message.runs(entered).0 {
                let (now, rest) = buffer.split_at_mut(run.count);
                let source = populations[run.start..].iter().step_by(run.distance);
                now.iter_mut().zip(source).for_each(|(to, from)| *to = *from);
                buffer = rest;
            }
        }
        self.halo.start();
        self.under_way = true;
    }

    /// By peer, slots of the numbers that are sent, and where those that come go.
    pub(crate) fn slots(&self, entered: AaPhase) -> impl Iterator<Item = (usize, [Vec<u64>; 2])> {
        let of_message = move |message: &Message| {
            let (from, to) = message.runs(entered);
            [each_slot(from), each_slot(to)]
        };
        self.peers.iter().copied().zip(self.messages.iter().map(of_message))
    }

    /// Sends numbers that a device has packed, from the front of a list, and returns the rest.
    pub(crate) fn send<'a>(&mut self, mut packed: &'a [T], entered: AaPhase) -> &'a [T] {
        for (link, message) in self.messages.iter().enumerate() {
            let count = message.runs(entered).0.iter().map(|run| run.count).sum();
            let (now, rest) = packed.split_at(count);
            self.halo.send(link).copy_from_slice(now);
            packed = rest;
        }
        if !self.messages.is_empty() {
            self.halo.start();
        }
        packed
    }

    /// Appends numbers that came, for a device to unpack.
    pub(crate) fn receive(&mut self, packed: &mut Vec<T>) {
        if !self.messages.is_empty() {
            self.halo.finish();
            for link in 0..self.messages.len() {
                packed.extend_from_slice(self.halo.received(link));
            }
        }
    }

    fn progress(&mut self) {
        if self.under_way {
            self.halo.progress();
        }
    }

    /// Waits for the messages of the others and unpacks them.
    fn finish(&mut self, populations: &mut [T], entered: AaPhase) {
        if !self.under_way {
            return;
        }
        self.halo.finish();
        self.under_way = false;
        for (link, message) in self.messages.iter().enumerate() {
            let mut buffer = self.halo.received(link);
            for run in message.runs(entered).1 {
                let (now, rest) = buffer.split_at(run.count);
                let target = populations[run.start..].iter_mut().step_by(run.distance);
                target.zip(now).for_each(|(to, from)| *to = *from);
                buffer = rest;
            }
        }
    }
}

/// The messages of one block, one to each other rank.
///
/// In both phases the slots that a message is packed from belong to cells of the rows named below, so no later row writes
/// them, and those that it is unpacked to belong to no cell of the block: only garbage lanes of the sweep may write them.
pub(crate) struct FluidHalo<T> {
    /// From here to here, where the block is its own neighbour.
    own: Message,
    /// To ranks that no x face is shared with: from the rows that are swept first.
    pub(crate) early: Pattern<T>,
    /// To ranks across x faces: needs the ends of all rows.
    pub(crate) late: Pattern<T>,
}

impl<T: Pod + Send> FluidHalo<T> {
    /// Collective.
    pub(crate) fn new(layout: &Layout, decomposition: &Decomposition, comm: &Comm) -> Result<Self> {
        let rank = comm.rank();
        let mut messages = Message::all(layout, decomposition, rank);
        let own = messages.remove(&rank).unwrap_or_default();
        let (late, early) = messages.into_iter().partition(|(peer, _)| is_late(decomposition, rank, *peer));
        Ok(Self { own, early: Pattern::new(early, comm)?, late: Pattern::new(late, comm)? })
    }

    /// Slots that are copied within the block, to and from.
    pub(crate) fn own_slots(&self, entered: AaPhase) -> [Vec<u64>; 2] {
        let (from, to) = self.own.runs(entered);
        [each_slot(to), each_slot(from)]
    }

    /// Lets messages make progress.
    pub(crate) fn progress(&mut self) {
        self.early.progress();
        self.late.progress();
    }

    /// Makes the ghosts (entering `Odd`) or the boundary cells (entering `Even`) whole after a sweep; sends what has
    /// not been sent.
    pub(crate) fn exchange(&mut self, populations: &mut [T], entered: AaPhase) {
        self.early.start(populations, entered);
        self.late.start(populations, entered);
        let (from, to) = self.own.runs(entered);
        for (from, to) in from.iter().zip(to) {
            if from.distance == 1 {
                populations.copy_within(from.start..from.start + from.count, to.start);
            } else {
                for k in 0..from.count {
                    populations[to.start + k * to.distance] = populations[from.start + k * from.distance];
                }
            }
        }
        self.early.finish(populations, entered);
        self.late.finish(populations, entered);
    }
}

/// Returns true if the message to a peer has to wait for the ends of all rows.
fn is_late(decomposition: &Decomposition, rank: usize, peer: usize) -> bool {
    [[1, 0, 0], [-1, 0, 0]].into_iter().any(|d| neighbour(decomposition, rank, d) == Some(peer))
}

#[derive(Clone, Copy, PartialEq)]
enum Side {
    /// Ghost cells on side `d` of the block.
    Ghost,
    /// The real cells that are the ghosts on side `d` of the neighbour at `-d`.
    Boundary,
}

/// The slots that cross a face or edge in direction `d`, population by population.
///
/// A real cell reaches ghost `g` through population `j` from `g - c_j`, so along the face only ghosts with a real
/// `g - c_j` count; the rest belongs to a neighbouring edge, or is sent back by a face: `more`.
fn runs(layout: &Layout, d: [isize; 3], side: Side, more: &Beyond) -> Vec<Run> {
    let mut runs = Vec::new();
    for j in (1..Q).filter(|&j| (0..3).all(|a| d[a] == 0 || C[j][a] == d[a])) {
        let range = |a: usize| {
            let n = layout.size[a] as isize;
            match (d[a], side) {
                (0, _) => {
                    let [low, high] = more[a].map(|c| isize::from(c != 0 && c == C[j][a]));
                    C[j][a].max(0) - low..n + C[j][a].min(0) + high
                }
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
                    runs.push(Run { start: at(xs.start, y), distance: 1, count: xs.clone().count() });
                }
            } else {
                let start = at(xs.start, ys.start);
                runs.push(Run { start, distance: layout.pitch, count: ys.clone().count() });
            }
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::super::rows::RowOrder;
    use super::*;
    use crate::comm::on_threads;
    use crate::domain::Domain;
    use std::collections::{HashMap, HashSet};

    fn cut(cells: [usize; 3], periodic: [bool; 3], grid: [usize; 3]) -> Decomposition {
        let domain = Domain { cells, faces: Domain::faces(periodic), dx: 1.0 };
        Decomposition::with_grid(domain, grid)
    }

    /// Slots of a list of runs, in order.
    fn slots(runs: &[Run]) -> Vec<usize> {
        let each = |run: &Run| {
            let Run { start, distance, count } = *run;
            (0..count).map(move |k| start + k * distance)
        };
        runs.iter().flat_map(each).collect()
    }

    #[test]
    fn messages_are_packed_from_what_the_rows_swept_first_wrote_and_unpacked_where_no_cell_writes() {
        let grids = [[1, 1, 1], [1, 1, 2], [1, 2, 1], [2, 1, 1], [1, 3, 2], [2, 2, 2], [3, 1, 2], [2, 3, 3]];
        let (mut early, mut late, mut own) = (0, 0, 0);
        for (grid, periodic) in grids
            .into_iter()
            .flat_map(|grid| [[true; 3], [true, false, true], [false, true, false]].map(|p| (grid, p)))
        {
            let cut = cut([17, 13, 14], periodic, grid);
            for (rank, phase) in
                (0..cut.ranks()).flat_map(|rank| [AaPhase::Even, AaPhase::Odd].map(|phase| (rank, phase)))
            {
                let [nx, ny, nz] = cut.block(rank).size();
                let layout = Layout::new([nx, ny, nz], 4).unwrap();
                let order = RowOrder::new(&cut, rank);
                // What a sweep from this phase writes, by the row that writes it.
                let mut writer = HashMap::new();
                for (z, y, x) in
                    (0..nz).flat_map(|z| (0..ny).flat_map(move |y| (0..nx).map(move |x| (z, y, x))))
                {
                    let cell = layout.cell(x as isize, y as isize, z as isize);
                    for slot in layout.slots(phase, cell) {
                        writer.insert(slot, [y, z]);
                    }
                }
                let (mut sent, mut filled) = (HashSet::new(), HashSet::new());
                for (peer, message) in Message::all(&layout, &cut, rank) {
                    let (from, to) = message.runs(phase.next());
                    let is_early = peer != rank && !is_late(&cut, rank, peer);
                    for slot in slots(from) {
                        let row = *writer.get(&slot).expect("written by the sweep");
                        assert!(!is_early || order.is_first(row), "{grid:?} {row:?}");
                        assert!(sent.insert(slot), "sent twice");
                    }
                    for slot in slots(to) {
                        assert!(!writer.contains_key(&slot), "{grid:?} {phase:?}");
                        assert!(filled.insert(slot), "received twice");
                    }
                    let count = if peer == rank {
                        &mut own
                    } else if is_early {
                        &mut early
                    } else {
                        &mut late
                    };
                    *count += from.len();
                }
            }
        }
        assert!(early > 0 && late > 0 && own > 0);
    }

    #[test]
    fn both_ends_of_a_message_agree_on_its_length_and_a_block_copies_to_itself_run_by_run() {
        for grid in [[1, 1, 1], [1, 1, 2], [2, 1, 1], [2, 3, 2]] {
            let cut = cut([17, 13, 14], [true, false, true], grid);
            let all: Vec<_> = (0..cut.ranks())
                .map(|rank| Message::all(&Layout::new(cut.block(rank).size(), 4).unwrap(), &cut, rank))
                .collect();
            for (rank, messages) in all.iter().enumerate() {
                for (&peer, message) in messages {
                    for entered in [AaPhase::Even, AaPhase::Odd] {
                        let (from, to) = (message.runs(entered).0, all[peer][&rank].runs(entered).1);
                        let counts = |runs: &[Run]| runs.iter().map(|run| run.count).collect::<Vec<_>>();
                        assert_eq!(counts(from), counts(to));
                        let kind =
                            |runs: &[Run]| runs.iter().map(|run| run.distance == 1).collect::<Vec<_>>();
                        assert_eq!(kind(from), kind(to));
                    }
                }
            }
        }
    }

    #[test]
    fn a_step_sends_each_neighbour_one_message_of_what_crosses_on_2_and_8_ranks() {
        // Five numbers for each cell of the two faces; and on 8 ranks three faces and three edges, all with different
        // peers.
        for (cells, grid, expected) in [
            ([10, 12, 20], [1, 1, 2], [1, 2 * 5 * 10 * 12]),
            ([16, 16, 16], [2, 2, 2], [6, 6 * (5 * 64 - 4 * 8) + 12 * 8]),
        ] {
            let cut = cut(cells, [true; 3], grid);
            on_threads(cut.ranks(), |comm| {
                let layout = Layout::new(cut.block(comm.rank()).size(), 4).unwrap();
                let mut halo = FluidHalo::<f32>::new(&layout, &cut, &comm).unwrap();
                let mut populations = vec![0.0; layout.len()];
                for entered in [AaPhase::Odd, AaPhase::Even] {
                    let before = comm.traffic().halo;
                    halo.exchange(&mut populations, entered);
                    let sent = comm.traffic().halo - before;
                    assert_eq!([sent.messages, sent.bytes / 4], expected, "{grid:?}");
                }
            });
        }
    }
}
