//! Exchange after the sweep of a block on a device: populations cross to other blocks, round the box, and back from walls.

use super::{DeviceSweep, Populations, filled};
use crate::device::{Argument, Array, Done, Queue};
use crate::error::Result;
use crate::fluid::Fluid;
use crate::fluid::dispatch::WrapX;
use crate::fluid::halo::{FluidHalo, Pattern};
use crate::fluid::layout::AaPhase;
use crate::fluid::population::Population;
use crate::fluid::walls::{CellList, LinkList, LinkRule};

/// Name of the lists in messages.
const LINKS: &str = "the links of a block";

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

/// Numbers that cross to other blocks: where they are, where those that come go, by the phase entered, and the message.
struct Crossing<S> {
    from: [Array; 2],
    to: [Array; 2],
    counts: [usize; 2],
    message: Array,
    packed: Vec<S>,
}

impl<S: Population> Crossing<S> {
    fn new(queue: &Queue, pattern: &Pattern<S>) -> Result<Self> {
        let [[sent_even, come_even], [sent_odd, come_odd]] =
            [AaPhase::Even, AaPhase::Odd].map(|phase| pattern.slots(phase));
        let counts = [sent_even.len(), sent_odd.len()];
        // As many come as are sent.
        let most = counts[0].max(counts[1]);
        let fill = |slots: &[u64]| filled(queue, slots, LINKS);
        Ok(Self {
            from: [fill(&sent_even)?, fill(&sent_odd)?],
            to: [fill(&come_even)?, fill(&come_odd)?],
            counts,
            message: queue.zeroed(most * size_of::<S>(), "the messages of a block")?,
            packed: vec![S::zeroed(); most],
        })
    }
}

/// All that populations do besides the sweep, by the phase entered.
pub(super) struct Exchange<S> {
    /// After the sweep, within the block in the halo exchange, and after it.
    pub(super) swept: [Vec<Copies>; 2],
    own: [Vec<Copies>; 2],
    late: [Vec<Copies>; 2],
    /// After the sweep, and after the halo exchange, in both phases.
    pub(super) interpolated: [Option<Interpolated>; 2],
    crossing: [Crossing<S>; 2],
}

impl<S: Population> Exchange<S> {
    pub(super) fn new(queue: &Queue, fluid: &Fluid<S>) -> Result<Self> {
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
        let swept = |entered: AaPhase| -> Result<Vec<Copies>> {
            let mut copies = of_links(&early, entered)?;
            if fluid.wrap_x {
                copies.extend(plain(WrapX::new(&fluid.layout, entered.next()).slots(&fluid.layout))?);
            }
            Ok(copies)
        };
        let own = |entered: AaPhase| -> Result<Vec<Copies>> {
            Ok(plain(fluid.halo.own_slots(entered))?.into_iter().collect())
        };
        Ok(Self {
            swept: [swept(AaPhase::Even)?, swept(AaPhase::Odd)?],
            own: [own(AaPhase::Even)?, own(AaPhase::Odd)?],
            late: [of_links(&late, AaPhase::Even)?, of_links(&late, AaPhase::Odd)?],
            interpolated: [
                Interpolated::new::<S>(queue, &cells)?,
                Interpolated::new::<S>(queue, &late_cells)?,
            ],
            crossing: [Crossing::new(queue, &fluid.halo.early)?, Crossing::new(queue, &fluid.halo.late)?],
        })
    }
}

impl<S: Population> DeviceSweep<S> {
    /// Takes the numbers of all links within the block, and of those that wait, from walls that vary their motion.
    pub(in crate::fluid) fn move_walls(
        &mut self,
        [early, late]: [Vec<LinkList<S::Number>>; 2],
        cells: &[CellList<S::Number>; 2],
    ) {
        let Exchange { swept, late: waiting, interpolated, .. } = &mut self.exchange;
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
        let (array, moved) = (populations.on_device(), 8 + 2 * size_of::<S>());
        // Both ranks of a message must get through the exchange even if a device has failed.
        let mut failed = Ok(());
        let at = entered as usize;
        for (crossing, pattern) in self.exchange.crossing.iter_mut().zip([&mut halo.early, &mut halo.late]) {
            let Crossing { from, counts, message, packed, .. } = crossing;
            packed.resize(counts[at], S::zeroed());
            if counts[at] > 0 {
                let arguments = [
                    Argument::Array(array),
                    Argument::Array(&from[at]),
                    Argument::Long(counts[at] as u64),
                    Argument::Array(message),
                ];
                // SAFETY: the arguments of the kernel; the message has room for all that is sent.
                let done =
                    unsafe { self.queue.launch_over(&self.kernels.pack, &arguments, counts[at], moved) };
                failed = failed.and(done).and_then(|()| self.queue.read(message, packed));
            }
            pattern.send(packed, entered);
        }
        failed = failed.and(self.copy(&self.exchange.own[at], array));
        for (crossing, pattern) in self.exchange.crossing.iter_mut().zip([&mut halo.early, &mut halo.late]) {
            let Crossing { to, counts, message, packed, .. } = crossing;
            pattern.receive(packed);
            if !packed.is_empty() {
                let arguments = |message| {
                    [
                        Argument::Array(array),
                        Argument::Array(&to[at]),
                        Argument::Long(counts[at] as u64),
                        Argument::Array(message),
                    ]
                };
                assert_eq!(packed.len(), counts[at], "as many numbers come as are sent");
                failed = failed.and_then(|()| self.queue.write(message, packed)).and_then(|()| {
                    // SAFETY: the arguments of the kernel; the message holds all that came.
                    unsafe {
                        self.queue.launch_over(&self.kernels.unpack, &arguments(message), counts[at], moved)
                    }
                });
            }
        }
        failed = failed.and_then(|()| self.copy(&self.exchange.late[at], array));
        let late = self.exchange.interpolated[1].as_ref();
        failed = failed.and_then(|()| self.interpolate(late, entered, array));
        self.failed.note(failed);
    }

    pub(super) fn copy(&self, all: &[Copies], populations: &Array) -> Done {
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
