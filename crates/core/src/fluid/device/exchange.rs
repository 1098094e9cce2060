//! What follows the sweep of a block on a device: populations cross to other blocks, round the box, and back from walls.

use super::{DeviceFluid, Populations};
use crate::device::{Argument, Array, Done};
use crate::fluid::halo::FluidHalo;
use crate::fluid::layout::AaPhase;
use crate::fluid::population::Population;

/// Copies of populations, from slots to slots.
pub(super) struct Copies {
    pub(super) to: Array,
    pub(super) from: Array,
    pub(super) count: usize,
    pub(super) corrections: Option<Array>,
}

/// Numbers that cross to other blocks: where they are, where those that come go, by the phase entered, and the message.
pub(super) struct Crossing<S> {
    pub(super) from: [Array; 2],
    pub(super) to: [Array; 2],
    pub(super) counts: [usize; 2],
    pub(super) message: Array,
    pub(super) packed: Vec<S>,
}

impl<S: Population> DeviceFluid<S> {
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
        for (crossing, pattern) in self.crossing.iter_mut().zip([&mut halo.early, &mut halo.late]) {
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
        failed = failed.and(self.copy(&self.own[at], array));
        for (crossing, pattern) in self.crossing.iter_mut().zip([&mut halo.early, &mut halo.late]) {
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
        failed = failed.and_then(|()| self.copy(&self.late[at], array));
        self.failed.note(failed);
    }

    pub(super) fn copy(&self, all: &[Copies], populations: &Array) -> Done {
        for copies in all {
            let arguments = [
                Argument::Array(populations),
                Argument::Array(&copies.to),
                Argument::Array(&copies.from),
                Argument::Long(copies.count as u64),
                Argument::Int(i32::from(copies.corrections.is_some())),
                Argument::Array(copies.corrections.as_ref().unwrap_or(&copies.to)),
            ];
            // SAFETY: the arguments of the kernel; all slots are within the populations.
            unsafe {
                let bytes = 2 * (8 + size_of::<S>());
                self.queue.launch_over(&self.kernels.copy_links, &arguments, copies.count, bytes)?;
            }
        }
        Ok(())
    }
}
