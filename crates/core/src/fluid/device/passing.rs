//! The kernel that sends back at outlets, on a device; free slip is a copy, like a link.

use super::exchange::LINKS;
use super::{DeviceSweep, filled};
use crate::device::{Argument, Array, Done, Queue};
use crate::error::Result;
use crate::fluid::population::Population;
use crate::fluid::walls::PassList;
use crate::lattice::Q;

/// Sends back at outlets, on entering a phase.
pub(super) struct Outlets {
    cells: Array,
    excess: Array,
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
        list: &PassList<S::Number>,
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
            first: filled(queue, &list.first, LINKS)?,
            from: filled(queue, &list.from, LINKS)?,
            to: filled(queue, &list.to, LINKS)?,
            weights: filled(queue, &list.weights, LINKS)?,
            left: left.map(|slot| slot as u64),
            count,
            bytes: 12 + size_of::<S::Number>() + (Q - 1) * size_of::<S>() + links.div_ceil(count) * of_link,
        }))
    }
}

impl<S: Population> DeviceSweep<S> {
    /// Sends back what cells beside outlets pass on.
    pub(super) fn pass_outlets(&self, outlets: Option<&Outlets>, populations: &Array) -> Done {
        let Some(outlets) = outlets else { return Ok(()) };
        let arguments = [
            Argument::Array(populations),
            Argument::Longs(outlets.left),
            Argument::Array(&outlets.cells),
            Argument::Array(&outlets.excess),
            Argument::Array(&outlets.first),
            Argument::Array(&outlets.from),
            Argument::Array(&outlets.to),
            Argument::Array(&outlets.weights),
            Argument::Long(outlets.count as u64),
        ];
        // SAFETY: the arguments of the kernel; all slots are within the populations, and a cell writes none that another one reads.
        unsafe {
            self.queue.launch_over(&self.kernels.pass_outlets, &arguments, outlets.count, outlets.bytes)
        }
    }
}
