//! Exchange after the sweep of a block on a device: populations cross to other blocks, round the box, and back from walls.

use super::outlets::Outlets;
use super::{DeviceSweep, Populations, filled};
use crate::comm::{Comm, Halo};
use crate::device::{Argument, Array, Done, Kernels, Queue};
use crate::error::Result;
use crate::fluid::Fluid;
use crate::fluid::dispatch::WrapX;
use crate::fluid::halo::FluidHalo;
use crate::fluid::layout::AaPhase;
use crate::fluid::population::Population;
use crate::fluid::walls::{CellList, LinkList, LinkRule};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Name of the lists in messages.
pub(super) const LINKS: &str = "the links of a block";

/// Populations that are copied along links of one rule, from slots to slots.
pub(super) struct Copies {
    to: Array,
    from: Array,
    count: usize,
    rule: LinkRule,
    numbers: Array,
}

impl Copies {
    /// None without links.
    fn new<T: bytemuck::Pod>(
        queue: &Queue,
        [to, from]: [&[u64]; 2],
        rule: LinkRule,
        numbers: &[T],
    ) -> Result<Option<Self>> {
        if to.is_empty() {
            return Ok(None);
        }
        let (to, from, count) = (filled(queue, to, LINKS)?, filled(queue, from, LINKS)?, to.len());
        Ok(Some(Self { to, from, count, rule, numbers: filled(queue, numbers, "the motion of walls")? }))
    }
}

/// Interpolated links of some cells.
pub(super) struct Interpolated {
    cells: Array,
    first: Array,
    directions: Array,
    numbers: Array,
    count: usize,
    /// Bytes that each cell moves.
    bytes: usize,
}

impl Interpolated {
    /// None without cells.
    fn new<S: Population>(queue: &Queue, list: &CellList<S::Number>) -> Result<Option<Self>> {
        let (count, links) = (list.cells.len(), list.directions.len());
        if count == 0 {
            return Ok(None);
        }
        let of_link = 4 * size_of::<S>() + 4 + 3 * size_of::<S::Number>();
        Ok(Some(Self {
            cells: filled(queue, &list.cells, LINKS)?,
            first: filled(queue, &list.first, LINKS)?,
            directions: filled(queue, &list.directions, LINKS)?,
            numbers: filled(queue, &list.numbers, LINKS)?,
            count,
            bytes: 12 + 2 * size_of::<S>() + links.div_ceil(count) * of_link,
        }))
    }
}

/// Messages of a block, two in turn, where on the device they are.
struct Outbox {
    kernels: Arc<Kernels>,
    messages: [Array; 2],
    /// By peer.
    parts: BTreeMap<usize, Part>,
}

/// Numbers for a peer, or from it, in the lists of a block: first one and count, by the phase entered.
#[derive(Clone, Copy)]
struct Part {
    first: [usize; 2],
    counts: [usize; 2],
}

/// Numbers from a peer: its outbox, those that are for this block there, and in [`Crossing::to`].
struct Incoming {
    outbox: Arc<Outbox>,
    sent: Part,
    part: Part,
}

/// Ways from block to block.
enum Way<S> {
    /// Messages between ranks; numbers on the host, and those that came, on the device.
    Host { packed: Vec<S>, came: Array },
    /// Every block reads on the device what its neighbours have packed there, when they say that they have.
    Device { incoming: Vec<Incoming>, ready: Halo<u8> },
}

/// Numbers that cross to other blocks: where they are, where those that come go, by the phase entered.
struct Crossing<S> {
    from: [Array; 2],
    to: [Array; 2],
    counts: [usize; 2],
    outbox: Arc<Outbox>,
    /// The one of its messages that is next.
    turn: usize,
    way: Way<S>,
}

impl<S: Population> Crossing<S> {
    fn new(queue: &Queue, kernels: &Arc<Kernels>, halo: &FluidHalo<S>) -> Result<Self> {
        let slots = |phase| halo.early.slots(phase).chain(halo.late.slots(phase)).collect::<Vec<_>>();
        let by_phase = [AaPhase::Even, AaPhase::Odd].map(slots);
        let fill = |phase: usize, way: usize| {
            let all: Vec<u64> = by_phase[phase].iter().flat_map(|(_, slots)| slots[way].clone()).collect();
            filled(queue, &all, LINKS)
        };
        // As many come from a peer as it is sent.
        let (mut counts, mut parts) = ([0; 2], BTreeMap::new());
        for ((peer, even), (_, odd)) in by_phase[0].iter().zip(&by_phase[1]) {
            let part = Part { first: counts, counts: [even[0].len(), odd[0].len()] };
            parts.insert(*peer, part);
            counts = [0, 1].map(|phase| counts[phase] + part.counts[phase]);
        }
        let room = |count: usize| queue.zeroed(count * size_of::<S>(), "the messages of a block");
        let most = counts[0].max(counts[1]);
        let messages = [room(most)?, room(most)?];
        Ok(Self {
            from: [fill(0, 0)?, fill(1, 0)?],
            to: [fill(0, 1)?, fill(1, 1)?],
            counts,
            outbox: Arc::new(Outbox { kernels: kernels.clone(), messages, parts }),
            turn: 0,
            way: Way::Host { packed: vec![S::zeroed(); most], came: room(most)? },
        })
    }

    /// Takes the way on the device if there are several ranks, all of them threads that use the same one. Collective.
    ///
    /// # Errors
    /// As [`Comm::halo`].
    fn connect(&mut self, comm: &Comm) -> Result<()> {
        let Some(all) = comm.share(self.outbox.clone()) else { return Ok(()) };
        let same = all.iter().all(|outbox| Arc::ptr_eq(&outbox.kernels, &self.outbox.kernels));
        if comm.size() == 1 || !same {
            return Ok(());
        }
        let parts = &self.outbox.parts;
        let from = |(&peer, &part): (&usize, &Part)| {
            let outbox = all[peer].clone();
            Incoming { sent: outbox.parts[&comm.rank()], outbox, part }
        };
        let peers: Vec<usize> = parts.keys().copied().collect();
        let ready = comm.halo(&peers, &vec![1; peers.len()])?;
        self.way = Way::Device { incoming: parts.iter().map(from).collect(), ready };
        Ok(())
    }
}

/// All that populations do besides the sweep, by the phase entered.
pub(super) struct Exchange<S> {
    /// After the sweep, within the block in the halo exchange, and after it.
    pub(super) swept: [Vec<Copies>; 2],
    own: [Vec<Copies>; 2],
    late: [Vec<Copies>; 2],
    /// After the sweep, as `swept`.
    pub(super) outlets: [Option<Outlets>; 2],
    /// After the sweep, and after the halo exchange, in both phases.
    pub(super) interpolated: [Option<Interpolated>; 2],
    crossing: Crossing<S>,
}

impl<S: Population> Exchange<S> {
    pub(super) fn new(queue: &Queue, kernels: &Arc<Kernels>, fluid: &Fluid<S>) -> Result<Self> {
        let [early, late] = fluid.walls.links(&fluid.layout);
        let [cells, late_cells] = fluid.walls.cells();
        let of_links = |lists: &[LinkList<S::Number>], entered: AaPhase| -> Result<Vec<Copies>> {
            let copies = lists.iter().map(|list| {
                // What enters the phase `Odd` goes to the wall.
                let [to, from] = match entered {
                    AaPhase::Odd => [&list.far, &list.near],
                    AaPhase::Even => [&list.near, &list.far],
                };
                Copies::new(queue, [to, from], list.rule, &list.numbers)
            });
            copies.filter_map(Result::transpose).collect()
        };
        let plain =
            |[to, from]: [Vec<u64>; 2]| Copies::new::<S::Number>(queue, [&to, &from], LinkRule::Resting, &[]);
        let swept = |entered: AaPhase| -> Result<(Vec<Copies>, Option<Outlets>)> {
            let (mut passed, left) = fluid.walls.face_links(entered);
            let mut copies = of_links(&early, entered)?;
            copies.extend(plain(std::mem::take(&mut passed.slips))?);
            if fluid.wrap_x {
                copies.extend(plain(WrapX::new(&fluid.layout, entered.next()).slots(&fluid.layout))?);
            }
            Ok((copies, Outlets::new::<S>(queue, &passed, left)?))
        };
        let own = |entered: AaPhase| -> Result<Vec<Copies>> {
            Ok(plain(fluid.halo.own_slots(entered))?.into_iter().collect())
        };
        let [even, odd] = [swept(AaPhase::Even)?, swept(AaPhase::Odd)?];
        Ok(Self {
            swept: [even.0, odd.0],
            own: [own(AaPhase::Even)?, own(AaPhase::Odd)?],
            outlets: [even.1, odd.1],
            late: [of_links(&late, AaPhase::Even)?, of_links(&late, AaPhase::Odd)?],
            interpolated: [
                Interpolated::new::<S>(queue, &cells)?,
                Interpolated::new::<S>(queue, &late_cells)?,
            ],
            crossing: Crossing::new(queue, kernels, &fluid.halo)?,
        })
    }
}

impl<S> Drop for DeviceSweep<S> {
    /// Other blocks may be gone before work that reads their messages is done.
    fn drop(&mut self) {
        // What a failed device says here it has said before.
        let _ = self.queue.finish();
    }
}

impl<S: Population> DeviceSweep<S> {
    /// Takes the numbers of all links within the block, and of those that wait, from walls that vary their motion, and the densities of outlets.
    pub(in crate::fluid) fn move_walls(
        &mut self,
        [early, late]: [Vec<LinkList<S::Number>>; 2],
        cells: &[CellList<S::Number>; 2],
        outlet_densities: &[S::Number],
    ) {
        let Exchange { swept, late: waiting, interpolated, outlets, .. } = &mut self.exchange;
        for outlets in outlets.iter_mut().flatten() {
            let done = self.queue.write(&mut outlets.excess, outlet_densities);
            self.failed.note(done);
        }
        for (list, links) in cells.iter().zip(interpolated) {
            let done = links.as_mut().map(|links| self.queue.write(&mut links.numbers, &list.numbers));
            self.failed.note(done.unwrap_or(Ok(())));
        }
        let all = swept
            .iter_mut()
            .map(|copies| (&early, copies))
            .chain(waiting.iter_mut().map(|copies| (&late, copies)));
        for (lists, copies) in all {
            let lists = lists.iter().filter(|list| list.rule.numbers() > 0);
            for list in lists {
                let moved = copies.iter_mut().find(|copies| copies.rule == list.rule);
                let done = moved.map_or(Ok(()), |moved| self.queue.write(&mut moved.numbers, &list.numbers));
                self.failed.note(done);
            }
        }
    }

    /// Completes a sweep, after which the phase is `entered`: populations arrive from the neighbouring blocks, and walls send them back.
    pub(in crate::fluid) fn exchange(
        &mut self,
        populations: &mut Populations<S>,
        halo: &mut FluidHalo<S>,
        entered: AaPhase,
    ) {
        let (array, at) = (populations.on_device(), entered as usize);
        // Both ranks of a message must get through the exchange even if a device has failed.
        let mut failed = self.pack(array, at);
        let Crossing { counts, outbox, turn, way, .. } = &mut self.exchange.crossing;
        match way {
            Way::Host { packed, .. } => {
                packed.resize(counts[at], S::zeroed());
                failed = failed.and_then(|()| self.queue.read(&outbox.messages[*turn], packed));
                let rest = halo.early.send(packed, entered);
                halo.late.send(rest, entered);
            }
            // When the neighbours pack this one of their messages again, they will know that this block has finished the other.
            Way::Device { ready, .. } => {
                failed = failed.and_then(|()| self.queue.finish());
                ready.start();
            }
        }
        failed = failed.and(self.copy(&self.exchange.own[at], array));
        let Crossing { counts, way, .. } = &mut self.exchange.crossing;
        match way {
            Way::Host { packed, came } => {
                packed.clear();
                halo.early.receive(packed);
                halo.late.receive(packed);
                assert_eq!(packed.len(), counts[at], "as many numbers come as are sent");
                failed = failed.and_then(|()| self.queue.write(came, packed));
            }
            Way::Device { ready, .. } => ready.finish(),
        }
        failed = failed.and_then(|()| self.unpack(array, at));
        self.exchange.crossing.turn ^= 1;
        failed = failed.and_then(|()| self.copy(&self.exchange.late[at], array));
        let late = self.exchange.interpolated[1].as_ref();
        failed = failed.and_then(|()| self.interpolate(late, entered, array));
        self.failed.note(failed);
    }

    /// Lets blocks on one device read each other's messages there. Collective.
    ///
    /// # Errors
    /// As [`Comm::halo`].
    pub(in crate::fluid) fn connect(&mut self, comm: &Comm) -> Result<()> {
        self.exchange.crossing.connect(comm)
    }

    /// Bytes of a number that is packed or unpacked.
    const MOVED: usize = 8 + 2 * size_of::<S>();

    fn pack(&self, populations: &Array, at: usize) -> Done {
        let Crossing { from, counts, outbox, turn, .. } = &self.exchange.crossing;
        if counts[at] == 0 {
            return Ok(());
        }
        let arguments = [
            Argument::Array(populations),
            Argument::Array(&from[at]),
            Argument::Long(counts[at] as u64),
            Argument::Array(&outbox.messages[*turn]),
        ];
        // SAFETY: the arguments of the kernel; the message has room for all that is sent, and no block reads it now.
        unsafe { self.queue.launch_over(&self.kernels.pack, &arguments, counts[at], Self::MOVED) }
    }

    fn unpack(&self, populations: &Array, at: usize) -> Done {
        let Crossing { to, counts, turn, way, .. } = &self.exchange.crossing;
        let unpack = |message: &Array, first: usize, into: usize, count: usize| {
            let arguments = [
                Argument::Array(populations),
                Argument::Array(&to[at]),
                Argument::Long(into as u64),
                Argument::Long(count as u64),
                Argument::Array(message),
                Argument::Long(first as u64),
            ];
            // SAFETY: the arguments of the kernel; the message holds all that came, and nobody writes it before this block has finished the next exchange.
            unsafe { self.queue.launch_over(&self.kernels.unpack, &arguments, count, Self::MOVED) }
        };
        match way {
            Way::Host { .. } if counts[at] == 0 => Ok(()),
            Way::Host { came, .. } => unpack(came, 0, 0, counts[at]),
            Way::Device { incoming, .. } => incoming.iter().try_for_each(|from| {
                unpack(
                    &from.outbox.messages[*turn],
                    from.sent.first[at],
                    from.part.first[at],
                    from.part.counts[at],
                )
            }),
        }
    }

    /// Exchanges what sheets within the block have between two cells on entering this phase, which exchanges it back the second time.
    pub(super) fn exchange_sheets(&self, entered: AaPhase, populations: &Array) -> Done {
        let Exchange { swept, late, .. } = &self.exchange;
        let links = swept[entered as usize].iter().chain(&late[entered as usize]);
        self.copy(links.filter(|copies| copies.rule == LinkRule::TwoSided), populations)
    }

    pub(super) fn copy<'a>(&self, all: impl IntoIterator<Item = &'a Copies>, populations: &Array) -> Done {
        for copies in all {
            let arguments = [
                Argument::Array(populations),
                Argument::Array(&copies.to),
                Argument::Array(&copies.from),
                Argument::Long(copies.count as u64),
                Argument::Int(copies.rule as i32),
                Argument::Array(&copies.numbers),
            ];
            // SAFETY: the arguments of the kernel; all slots are within the populations.
            unsafe {
                let bytes = 2 * (8 + size_of::<S>());
                self.queue.launch_over(&self.kernels.copy_links, &arguments, copies.count, bytes)?;
            }
        }
        Ok(())
    }

    /// Applies interpolated links on entering a phase.
    pub(super) fn interpolate(
        &self,
        links: Option<&Interpolated>,
        entered: AaPhase,
        populations: &Array,
    ) -> Done {
        let Some(links) = links else { return Ok(()) };
        let arguments = [
            Argument::Array(populations),
            Argument::Longs(self.slots[entered as usize]),
            Argument::Longs(self.slots[entered.next() as usize]),
            Argument::Array(&links.cells),
            Argument::Array(&links.first),
            Argument::Array(&links.directions),
            Argument::Long(links.count as u64),
            Argument::Array(&links.numbers),
        ];
        // SAFETY: the arguments of the kernel; all slots are within the populations, and a cell writes none that another one reads.
        unsafe {
            self.queue.launch_over(&self.kernels.interpolate_links, &arguments, links.count, links.bytes)
        }
    }
}
