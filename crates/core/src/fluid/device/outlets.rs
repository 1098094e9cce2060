//! The kernel that sends back at outlets, on a device; free slip is a copy, like a link.

use super::exchange::LINKS;
use super::{DeviceSweep, filled};
use crate::device::{Argument, Array, Done, Queue};
use crate::error::Result;
use crate::fluid::population::Population;
use crate::fluid::walls::FaceLinkList;
use crate::lattice::Q;

/// Sends back at outlets, on entering a phase.
pub(super) struct Outlets {
    cells: Array,
    pub(super) excess: Array,
    rates: Array,
    axes: Array,
    outwards: Array,
    means: Array,
    first: Array,
    from: Array,
    to: Array,
    weights: Array,
    left: [u64; Q],
    count: usize,
    /// Bytes that each cell moves.
    bytes: usize,
}

impl Outlets {
    /// None without outlets.
    pub(super) fn new<S: Population>(
        queue: &Queue,
        list: &FaceLinkList<S::Number>,
        left: &[usize; Q],
    ) -> Result<Option<Self>> {
        let (count, links) = (list.cells.len(), list.from.len());
        if count == 0 {
            return Ok(None);
        }
        let of_link = 16 + 2 * size_of::<S>() + size_of::<S::Number>();
        Ok(Some(Self {
            cells: filled(queue, &list.cells, LINKS)?,
            excess: filled(queue, &list.excess, LINKS)?,
            rates: filled(queue, &list.rates, LINKS)?,
            axes: filled(queue, &list.axes, LINKS)?,
            outwards: filled(queue, &list.outwards, LINKS)?,
            means: filled(queue, &list.means, LINKS)?,
            first: filled(queue, &list.first, LINKS)?,
            from: filled(queue, &list.from, LINKS)?,
            to: filled(queue, &list.to, LINKS)?,
            weights: filled(queue, &list.weights, LINKS)?,
            left: left.map(|slot| slot as u64),
            count,
            bytes: 24
                + 5 * size_of::<S::Number>()
                + (Q - 1) * size_of::<S>()
                + links.div_ceil(count) * of_link,
        }))
    }
}

impl<S: Population> DeviceSweep<S> {
    /// Sends back what comes from cells beside outlets.
    pub(super) fn apply_outlets(&self, outlets: Option<&Outlets>, populations: &Array) -> Done {
        let Some(outlets) = outlets else { return Ok(()) };
        let arguments = [
            Argument::Array(populations),
            Argument::Longs(outlets.left),
            Argument::Array(&outlets.cells),
            Argument::Array(&outlets.excess),
            Argument::Array(&outlets.rates),
            Argument::Array(&outlets.axes),
            Argument::Array(&outlets.outwards),
            Argument::Array(&outlets.means),
            Argument::Array(&outlets.first),
            Argument::Array(&outlets.from),
            Argument::Array(&outlets.to),
            Argument::Array(&outlets.weights),
            Argument::Long(outlets.count as u64),
        ];
        // SAFETY: the arguments of the kernel; all slots are within the populations, and a cell writes none that another one reads; the
        // means of type REAL lie behind the populations.
        unsafe { self.queue.launch_over(&self.kernels.outlets, &arguments, outlets.count, outlets.bytes) }
    }
}
