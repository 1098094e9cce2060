//! The fluid of a block on a [`Device`]: the same sweep, to the bit, by `device/kernels.cl`.
//!
//! Populations lie on the device in the [`Layout`](super::layout::Layout) of the processor; the host has a copy that is brought up to date
//! when something reads it (output, checkpoints, the hash of the state). In a step the device gets the poses of bodies ([`Images`]) and returns
//! the momentum that each body received; nothing is transferred for a cell, but to other ranks and for bodies whose cells the host finds.

mod bodies;
mod exchange;
mod outlets;
mod populations;

pub(super) use populations::Populations;

use super::bodies::Body;
use super::kernel::Operator;
use super::layout::AaPhase;
use super::population::Population;
use super::solid::SolidModel;
use super::walls::LinkRule;
use super::{Flow, Fluid, Images};
use crate::device::{Argument, Array, Device, Done, Failed, KernelCost, Kernels, NamedKernel, Queue};
use crate::error::{Error, Result};
use crate::lattice::Q;
use crate::math::join_wide;
use bodies::BodyArrays;
use exchange::Exchange;
use populations::Failure;
use std::fmt::Write;
use std::rc::Rc;

/// Source of the kernels.
pub(crate) const KERNELS: &str = include_str!("device/kernels.cl");
/// Cells that a work-group sweeps, as in the kernels.
const TILE: [usize; 3] = [32, 4, 2];
const ITEMS: usize = TILE[0] * TILE[1] * TILE[2];
/// Words that a tile writes of the flow, and those of the sum, as in the kernels.
const TILE_WORDS: usize = 8;
const FLOW_WORDS: usize = 13;
/// Words that a body receives.
const BODY_WORDS: usize = 12;
/// Word of a flow in which no cell is too fast.
const NO_FAULT: i64 = i64::MAX;

/// Options of the preprocessor: numbers, method, operator, and the rules of links.
pub(crate) fn options<S: Population, M: SolidModel, O: Operator>(model: M) -> String {
    let real = if size_of::<S::Number>() == 4 { "float" } else { "double" };
    let stored = if S::IS_CONVERTED { "-DF16 " } else { "" };
    let [volume, pairs, regularised] = [M::BY_VOLUME, O::PAIRS, O::REGULARISED].map(i32::from);
    let mut options = format!(
        "-DREAL={real} {stored}-DPAIRS={pairs} -DREGULARISED={regularised} -DBY_VOLUME={volume} {}",
        model.kernel_options()
    );
    for rule in LinkRule::ALL {
        let _ = write!(options, " -D{}={}", rule.name(), rule as i32);
    }
    options
}

struct CompiledKernels {
    spans: NamedKernel,
    sweep: NamedKernel,
    flow_total: NamedKernel,
    copy_links: NamedKernel,
    interpolate_links: NamedKernel,
    outlets: NamedKernel,
    pack: NamedKernel,
    unpack: NamedKernel,
    departed: NamedKernel,
}

impl CompiledKernels {
    fn new(of: &Kernels) -> Self {
        Self {
            spans: of.kernel("spans"),
            sweep: of.kernel("sweep"),
            flow_total: of.kernel("flow_total"),
            copy_links: of.kernel("copy_links"),
            interpolate_links: of.kernel("interpolate_links"),
            outlets: of.kernel("outlets"),
            pack: of.kernel("pack"),
            unpack: of.kernel("unpack"),
            departed: of.kernel("departed"),
        }
    }
}

/// Data of a block on a device, besides its populations.
pub(super) struct DeviceSweep<S> {
    queue: Rc<Queue>,
    failed: Rc<Failure>,
    kernels: CompiledKernels,
    size: [usize; 3],
    pitch: usize,
    tiles: [usize; 3],
    corner: [usize; 3],
    cells: [usize; 3],
    /// By the phase that a sweep begins in.
    slots: [[u64; Q]; 2],
    /// Slots of the populations that left a cell in the last sweep, by the phase after it; cells that were asked for, and their sums.
    left: [Array; 2],
    asked: [Array; 2],
    walls: Option<Array>,
    exchange: Exchange<S>,
    bodies: BodyArrays,
    flows: Array,
    total: Array,
    /// Bytes of the last step to and from the device, without messages to other ranks.
    pub(super) transferred: u64,
}

impl<S: Population> DeviceSweep<S> {
    /// Puts a fluid on a device.
    ///
    /// # Errors
    /// [`Error::Input`] if it has not the memory, [`Error::Kernels`] if they cannot be compiled.
    pub(super) fn new(device: &Device, options: &str, fluid: &mut Fluid<S>) -> Result<Self> {
        let compiled = device.compile(KERNELS, options)?;
        let (queue, layout) = (Rc::new(device.queue(&compiled)?), &fluid.layout);
        let [x, y, z] = layout.size;
        let what = format!("the populations of a block of {x} x {y} x {z} cells");
        let array = queue.zeroed(size_of_val(&fluid.populations[..]), &what)?;
        let phases = [AaPhase::Even, AaPhase::Odd];
        let left = phases.map(|phase| {
            let left: [u64; Q] = std::array::from_fn(|i| layout.left(phase, i) as u64);
            filled(&queue, &left, "the slots of a cell")
        });
        let [left_even, left_odd] = left;
        let flags = fluid.walls.flags();
        let walls = (!flags.is_empty()).then(|| filled(&queue, &flags, "the map of the walls"));
        let tiles: [usize; 3] = std::array::from_fn(|a| layout.size[a].div_ceil(TILE[a]));
        let flow = |words: usize| queue.zeroed(words * 8, "the flow of a block");
        let small = || queue.zeroed(0, "the parameters");
        let sweep = Self {
            kernels: CompiledKernels::new(&compiled),
            size: layout.size,
            pitch: layout.pitch,
            tiles,
            corner: fluid.block.lo,
            cells: fluid.domain.cells,
            slots: phases.map(|phase| layout.slots_from(phase).map(|slot| slot as u64)),
            left: [left_even?, left_odd?],
            asked: [small()?, small()?],
            walls: walls.transpose()?,
            exchange: Exchange::new(&queue, &compiled, fluid)?,
            bodies: BodyArrays::new(&queue)?,
            flows: flow(tiles.iter().product::<usize>() * TILE_WORDS)?,
            total: flow(FLOW_WORDS)?,
            failed: Rc::default(),
            queue,
            transferred: 0,
        };
        fluid.populations.copy_to(array, &sweep.queue, &sweep.failed);
        Ok(sweep)
    }

    /// As [`Queue::time_kernels`].
    pub(super) fn time_kernels(&self, from_now_on: bool) -> Vec<KernelCost> {
        self.queue.time_kernels(from_now_on)
    }

    /// The first failure since the last call.
    pub(super) fn take_failure(&self) -> Option<Error> {
        self.failed.0.borrow_mut().take().map(|failed| lost(&self.queue, &failed))
    }

    /// Sweeps the block from a phase; `parameters` are the factors of the relaxation of the even and the odd part, the acceleration, and
    /// `tau - 1/2`.
    pub(super) fn sweep(
        &mut self,
        populations: &mut Populations<S>,
        phase: AaPhase,
        parameters: [S::Number; 8],
        images: &Images,
        bodies: &mut [Body],
        measure: bool,
    ) -> Option<Flow> {
        let mut received = vec![0_i64; BODY_WORDS * bodies.len()];
        let mut flow = measure.then(Flow::default);
        let done = self.try_sweep(
            populations.on_device(),
            phase,
            parameters.map(Into::into),
            images,
            &mut received,
            flow.as_mut(),
        );
        self.failed.note(done);
        for (body, words) in bodies.iter_mut().zip(received.chunks_exact(BODY_WORDS)) {
            let sums: &[super::ExchangeSum; 2] = bytemuck::from_bytes(bytemuck::cast_slice(words));
            body.exchange.add(&sums[0], 1);
            body.departed.add(&sums[1], 1);
        }
        flow
    }

    fn try_sweep(
        &mut self,
        populations: &Array,
        phase: AaPhase,
        parameters: [f64; 8],
        images: &Images,
        received: &mut [i64],
        flow: Option<&mut Flow>,
    ) -> Done {
        self.bodies.write::<S>(&self.queue, images, self.tiles, size_of_val(received))?;
        self.transferred = self.bodies.written as u64;
        self.bodies.find_spans(&self.queue, &self.kernels.spans, images)?;
        self.sweep_tiles(populations, phase, parameters, flow.is_some(), size_of_val(received))?;
        if let Some(flow) = flow {
            *flow = self.total_flow()?;
        }
        self.queue.read(&self.bodies.received, received)?;
        self.transferred += size_of_val(received) as u64;
        // The host need not wait for these.
        self.copy(&self.exchange.swept[phase.next() as usize], populations)?;
        self.apply_outlets(self.exchange.outlets[phase.next() as usize].as_ref(), populations)?;
        self.interpolate(self.exchange.interpolated[0].as_ref(), phase.next(), populations)
    }

    /// The sweep itself; bodies receive `received` bytes.
    fn sweep_tiles(
        &self,
        populations: &Array,
        phase: AaPhase,
        parameters: [f64; 8],
        measure: bool,
        received: usize,
    ) -> Done {
        let int = |n: usize| n as i32;
        let [nx, ny, nz] = self.size.map(int);
        let [ox, oy, oz] = self.corner.map(int);
        let [cx, cy, cz] = self.cells.map(int);
        let (tiles, bodies) = (self.tiles.iter().product::<usize>(), &self.bodies);
        let [bin, bins] = [bodies.bin, bodies.bins].map(|of| of.map(int));
        let arguments = [
            Argument::Array(populations),
            Argument::Longs(self.slots[phase as usize]),
            Argument::Ints([nx, ny, nz, self.pitch as i32]),
            Argument::Int(ny + 2),
            Argument::Ints([cx, cy, cz, 0]),
            Argument::Ints([ox, oy, oz, 0]),
            Argument::Ints([bin[0], bin[1], bin[2], 0]),
            Argument::Ints([bins[0], bins[1], bins[2], 0]),
            Argument::Doubles(parameters),
            Argument::Int(i32::from(self.walls.is_some())),
            Argument::Array(self.walls.as_ref().unwrap_or(&bodies.bin_start)),
            Argument::Array(&bodies.bin_start),
            Argument::Array(&bodies.bin_images),
            Argument::Array(&bodies.ints),
            Argument::Array(&bodies.numbers),
            Argument::Array(&bodies.faces),
            Argument::Array(&bodies.cut),
            Argument::Array(&bodies.spans),
            Argument::Array(&bodies.lengths),
            Argument::Array(&bodies.velocities),
            Argument::Array(&bodies.received),
            Argument::Int(i32::from(measure)),
            Argument::Array(&self.flows),
        ];
        let of_cell = 2 * Q * size_of::<S>() + usize::from(self.walls.is_some());
        let of_flow = if measure { tiles * TILE_WORDS * 8 } else { 0 };
        let of_bodies = bodies.of_rows + bodies.written + received;
        let bytes = self.size.iter().product::<usize>() * of_cell + of_bodies + of_flow;
        // SAFETY: the arguments of the kernel; slots of cells of the block are within the populations (tested in `layout`), and lists of
        // tiles, images and rows within their arrays.
        unsafe { self.queue.launch(&self.kernels.sweep, &arguments, tiles, ITEMS, bytes) }
    }

    /// Sum of the flows of all tiles.
    fn total_flow(&mut self) -> Done<Flow> {
        let tiles: usize = self.tiles.iter().product();
        let arguments =
            [Argument::Array(&self.flows), Argument::Int(tiles as i32), Argument::Array(&self.total)];
        let bytes = tiles * TILE_WORDS * 8;
        // SAFETY: the arguments of the kernel; there is a flow of each tile.
        unsafe { self.queue.launch(&self.kernels.flow_total, &arguments, 1, ITEMS, bytes) }?;
        let mut words = [0_i64; FLOW_WORDS];
        self.queue.read(&self.total, &mut words)?;
        self.transferred += size_of_val(&words) as u64;
        Ok(self.flow_of(&words))
    }

    /// Momentum and moving mass that left some cells, given by their slots, in the last sweep, after which the phase is `phase`.
    pub(super) fn departed(
        &mut self,
        populations: &mut Populations<S>,
        phase: AaPhase,
        cells: &[u64],
    ) -> Vec<[f64; 4]> {
        let mut sums = vec![[0.0; 4]; cells.len()];
        if !cells.is_empty() {
            let done = self.try_departed(populations.on_device(), phase, cells, &mut sums);
            self.failed.note(done);
        }
        sums
    }

    fn try_departed(
        &mut self,
        populations: &Array,
        phase: AaPhase,
        cells: &[u64],
        sums: &mut [[f64; 4]],
    ) -> Done {
        self.exchange_sheets(phase, populations)?;
        let (queue, [asked, found]) = (&*self.queue, &mut self.asked);
        queue.write(asked, cells)?;
        queue.reserve(found, size_of_val(sums))?;
        let arguments = [
            Argument::Array(populations),
            Argument::Array(&self.left[phase as usize]),
            Argument::Array(asked),
            Argument::Long(cells.len() as u64),
            Argument::Array(found),
        ];
        // SAFETY: the arguments of the kernel; what left a cell of the block is within the populations.
        unsafe {
            let bytes = 8 + (Q - 1) * size_of::<S>() + size_of::<[f64; 4]>();
            queue.launch_over(&self.kernels.departed, &arguments, cells.len(), bytes)?;
        }
        queue.read(found, sums)?;
        self.transferred += (size_of_val(cells) + size_of_val(sums)) as u64;
        self.exchange_sheets(phase, populations)
    }

    fn flow_of(&self, words: &[i64; FLOW_WORDS]) -> Flow {
        let sum = |at: usize| join_wide([words[2 * at], words[2 * at + 1]]);
        let number = |word: i64| f64::from_bits(word as u64);
        let [nx, ny] = [self.cells[0] as i64, self.cells[1] as i64];
        let fault = (words[11] != NO_FAULT).then(|| {
            let key = words[11];
            ([key % nx, key / nx % ny, key / nx / ny].map(|n| n as usize), number(words[12]))
        });
        Flow {
            momentum: [sum(0), sum(1), sum(2)],
            square: sum(3),
            solid: sum(4),
            max_speed: number(words[10]).sqrt(),
            fault,
        }
    }
}

/// An array with these numbers; `what` they are for stands in the message, with an article.
fn filled<T: bytemuck::Pod>(queue: &Queue, values: &[T], what: &str) -> Result<Array> {
    let mut array = queue.zeroed(size_of_val(values), what)?;
    queue.write(&mut array, values).map_err(|failed| lost(queue, &failed))?;
    Ok(array)
}

fn lost(queue: &Queue, failed: &Failed) -> Error {
    Error::Device { step: 0, what: format!("{}: {failed}", queue.device().info().name) }
}
