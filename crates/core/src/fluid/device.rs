//! The fluid of a block on a [`Device`]: the same sweep, to the bit, by `device/kernels.cl`.
//!
//! Populations lie on the device in the [`Layout`] of the processor; the host has a copy that is brought up to date when something
//! reads it (output, checkpoints, the hash of the state). In a step the device gets the poses of bodies ([`Images`]) and returns the momentum
//! that each body received; nothing is transferred for a cell, but to other ranks and for bodies whose cells the host finds.

mod exchange;
mod populations;

pub(super) use populations::Populations;

use super::bodies::Body;
use super::dispatch::WrapX;
use super::halo::{FluidHalo, Pattern};
use super::layout::{AaPhase, Layout};
use super::population::Population;
use super::walls::{Links, Walls};
use super::{Flow, Images, Precision};
use crate::device::{Argument, Array, Device, Done, Failed, KernelCost, NamedKernel, Queue};
use crate::domain::{Block, Domain};
use crate::error::{Error, Result};
use crate::lattice::Q;
use crate::math::join_wide;
use exchange::{Copies, Crossing};
use populations::{DeviceCopy, Failure, Newer};
use std::rc::Rc;

/// Source of the kernels.
const KERNELS: &str = include_str!("device/kernels.cl");
/// Cells that a work-group sweeps, as in the kernels.
const TILE: [usize; 3] = [32, 4, 2];
const ITEMS: usize = TILE[0] * TILE[1] * TILE[2];
/// Rows that a work-group finds the ends of.
const SPANS_GROUP: usize = 64;
/// Words that a tile writes of the flow, and those of the sum, as in the kernels.
const TILE_WORDS: usize = 8;
const FLOW_WORDS: usize = 13;
/// Words that a body receives.
const BODY_WORDS: usize = 12;
/// Word of a flow in which no cell is too fast.
const NO_FAULT: i64 = i64::MAX;

struct CompiledKernels {
    spans: NamedKernel,
    sweep: NamedKernel,
    flow_total: NamedKernel,
    copy_links: NamedKernel,
    pack: NamedKernel,
    unpack: NamedKernel,
    departed: NamedKernel,
}

/// What a block needs on a device, besides its populations.
pub(super) struct DeviceFluid<S> {
    queue: Rc<Queue>,
    failed: Rc<Failure>,
    kernels: CompiledKernels,
    size: [usize; 3],
    pitch: usize,
    tiles: [usize; 3],
    corner: [usize; 3],
    cells: [usize; 3],
    /// By the phase that a sweep begins in.
    slots: [Array; 2],
    /// Slots of the populations that left a cell in the last sweep, by the phase after it; cells that were asked for, and their sums.
    left: [Array; 2],
    asked: [Array; 2],
    walls: Option<Array>,
    /// By the phase entered: after a sweep, within the block in the halo exchange, and after it.
    swept: [Vec<Copies>; 2],
    own: [Vec<Copies>; 2],
    late: [Vec<Copies>; 2],
    crossing: [Crossing<S>; 2],
    parameters: Array,
    images: [Array; 5],
    cut: Array,
    spans: [Array; 3],
    tile_start: Array,
    tile_images: Array,
    received: Array,
    flows: Array,
    total: Array,
    /// Bytes of the last step to and from the device, without messages to other ranks.
    pub(super) transferred: u64,
}

/// Options of the preprocessor for a precision, an operator (0 for homogenised cells, 1 to 3 for partially saturated ones), and whether
/// populations relax in pairs.
fn options(precision: Precision, operator: u32, pairs: bool) -> String {
    let real = match precision {
        Precision::F32 => "-DREAL=float",
        Precision::F64 => "-DREAL=double",
        Precision::F16 => "-DREAL=float -DF16",
    };
    format!("{real} -DPAIRS={} -DOPERATOR={operator}", i32::from(pairs))
}

/// What a [`DeviceFluid`] is made of.
pub(super) struct Host<'a, S: Population> {
    pub(super) layout: &'a Layout,
    pub(super) domain: &'a Domain,
    pub(super) block: Block,
    pub(super) walls: &'a Walls<S>,
    pub(super) halo: &'a FluidHalo<S>,
    pub(super) wrap_x: bool,
    pub(super) pairs: bool,
}

impl<S: Population> DeviceFluid<S> {
    /// Puts the fluid of a block on a device.
    ///
    /// # Errors
    /// [`Error::Input`] if it has not the memory, or if the kernels cannot be compiled.
    pub(super) fn new(
        device: &Device,
        precision: Precision,
        operator: u32,
        host: &Host<S>,
        populations: &mut Populations<S>,
    ) -> Result<Self> {
        let layout = host.layout;
        let kernels = device.compile(KERNELS, &options(precision, operator, host.pairs))?;
        let queue = Rc::new(device.queue(&kernels)?);
        let failed = Rc::new(Failure::default());
        let tiles: [usize; 3] = std::array::from_fn(|a| layout.size[a].div_ceil(TILE[a]));
        let bytes = layout.len() * size_of::<S>();
        let [x, y, z] = layout.size;
        let array = queue.zeroed(bytes, &format!("the populations of a block of {x} x {y} x {z} cells"))?;
        let fill = |values: &[u64]| filled(&queue, values, "the links of a block");
        let phases = [AaPhase::Even, AaPhase::Odd];
        let copies = |[to, from]: [&[u64]; 2], corrections: &[S::Number]| -> Result<Option<Copies>> {
            if to.is_empty() {
                return Ok(None);
            }
            let corrections = if corrections.is_empty() {
                None
            } else {
                Some(filled(&queue, corrections, "the motion of walls")?)
            };
            Ok(Some(Copies { to: fill(to)?, from: fill(from)?, count: to.len(), corrections }))
        };
        let of_links = |links: &Links<S::Number>, entered: AaPhase| -> Result<Vec<Copies>> {
            // To and from: what enters the phase `Odd` goes to the wall.
            let (to, from) = if entered == AaPhase::Odd { (1, 0) } else { (0, 1) };
            let (still, moving) = (&links.still, &links.moving);
            let both = [
                copies([&still[to], &still[from]], &[])?,
                copies([&moving[to], &moving[from]], &links.corrections)?,
            ];
            Ok(both.into_iter().flatten().collect())
        };
        let [early, late] = host.walls.links(layout);
        let mut swept = [of_links(&early, AaPhase::Even)?, of_links(&early, AaPhase::Odd)?];
        if host.wrap_x {
            for entered in phases {
                let [to, from] = WrapX::new(layout, entered.next()).slots(layout);
                swept[entered as usize].extend(copies([&to, &from], &[])?);
            }
        }
        let own = |entered: AaPhase| -> Result<Vec<Copies>> {
            let [to, from] = host.halo.own_slots(entered);
            Ok(copies([&to, &from], &[])?.into_iter().collect())
        };
        let crossing = |pattern: &Pattern<S>| -> Result<Crossing<S>> {
            let [even, odd] = phases.map(|phase| pattern.slots(phase));
            let counts = [even[0].len(), odd[0].len()];
            // As many come as are sent.
            let most = counts[0].max(counts[1]);
            Ok(Crossing {
                from: [fill(&even[0])?, fill(&odd[0])?],
                to: [fill(&even[1])?, fill(&odd[1])?],
                counts,
                message: queue.zeroed(most * size_of::<S>(), "the messages of a block")?,
                packed: vec![S::zeroed(); most],
            })
        };
        let flags = host.walls.flags();
        let walls =
            if flags.is_empty() { None } else { Some(filled(&queue, &flags, "the map of the walls")?) };
        let slots = phases.map(|phase| fill(&layout.slots_from(phase).map(|slot| slot as u64)));
        let [even, odd] = slots;
        let [left_even, left_odd] =
            phases.map(|phase| fill(&std::array::from_fn::<_, Q, _>(|i| layout.left(phase, i) as u64)));
        let small = || queue.zeroed(0, "the bodies");
        let kernel = |name| kernels.kernel(name);
        let fluid = Self {
            kernels: CompiledKernels {
                spans: kernel("spans"),
                sweep: kernel("sweep"),
                flow_total: kernel("flow_total"),
                copy_links: kernel("copy_links"),
                pack: kernel("pack"),
                unpack: kernel("unpack"),
                departed: kernel("departed"),
            },
            size: layout.size,
            pitch: layout.pitch,
            tiles,
            corner: host.block.lo,
            cells: host.domain.cells,
            slots: [even?, odd?],
            left: [left_even?, left_odd?],
            asked: [small()?, small()?],
            walls,
            swept,
            own: [own(AaPhase::Even)?, own(AaPhase::Odd)?],
            late: [of_links(&late, AaPhase::Even)?, of_links(&late, AaPhase::Odd)?],
            crossing: [crossing(&host.halo.early)?, crossing(&host.halo.late)?],
            parameters: small()?,
            images: [small()?, small()?, small()?, small()?, small()?],
            cut: small()?,
            spans: [small()?, small()?, small()?],
            tile_start: small()?,
            tile_images: small()?,
            received: small()?,
            flows: queue.zeroed(tiles.iter().product::<usize>() * TILE_WORDS * 8, "the flow of a block")?,
            total: queue.zeroed(FLOW_WORDS * 8, "the flow of a block")?,
            queue: queue.clone(),
            failed: failed.clone(),
            transferred: 0,
        };
        populations.copy = Some(DeviceCopy { queue, array, failed });
        populations.newer.set(Newer::Host);
        Ok(fluid)
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
        parameters: [S::Number; 6],
        images: &Images,
        bodies: &mut [Body],
        measure: bool,
    ) -> Option<Flow> {
        let mut received = vec![0_i64; BODY_WORDS * bodies.len()];
        let mut flow = measure.then(Flow::default);
        let done =
            self.try_sweep(populations.on_device(), phase, &parameters, images, &mut received, flow.as_mut());
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
        parameters: &[S::Number; 6],
        images: &Images,
        received: &mut [i64],
        flow: Option<&mut Flow>,
    ) -> Done {
        let queue = &*self.queue;
        let [ints, numbers, planes, faces, mapped] = &mut self.images;
        queue.write(&mut self.parameters, parameters)?;
        queue.write(ints, &images.ints)?;
        queue.write(numbers, &images.numbers)?;
        queue.write(planes, &images.planes)?;
        queue.write(faces, &images.faces)?;
        queue.write(mapped, &images.mapped)?;
        queue.write(&mut self.cut, &images.cut)?;
        let (start, listed) = images.by_tile(self.tiles, TILE);
        queue.write(&mut self.tile_start, &start)?;
        queue.write(&mut self.tile_images, &listed)?;
        self.transferred = (images.bytes() + size_of_val(&start[..]) + size_of_val(&listed[..])) as u64;
        let [spans, lengths, velocities] = &mut self.spans;
        let row_bytes = [5 * size_of::<i32>(), 3 * size_of::<f32>(), 6 * size_of::<S::Number>()];
        for (array, bytes) in [spans, lengths, velocities].into_iter().zip(row_bytes) {
            queue.reserve(array, images.rows * bytes)?;
        }
        let [spans, lengths, velocities] = &self.spans;
        let of_rows = images.rows * row_bytes.iter().sum::<usize>() + images.bytes();
        queue.reserve(&mut self.received, size_of_val(received))?;
        queue.clear(&mut self.received, size_of_val(received).max(8))?;
        if images.count() > 0 {
            let (count, most) = (images.count(), images.most_rows);
            let arguments = [
                Argument::Int(count as i32),
                Argument::Int(most as i32),
                Argument::Array(ints),
                Argument::Array(numbers),
                Argument::Array(planes),
                Argument::Array(mapped),
                Argument::Array(spans),
                Argument::Array(lengths),
                Argument::Array(velocities),
            ];
            // SAFETY: the arguments of the kernel; arrays have room for all images and rows.
            unsafe {
                let groups = (count * most).div_ceil(SPANS_GROUP);
                queue.launch(&self.kernels.spans, &arguments, groups, SPANS_GROUP, of_rows)?;
            }
        }
        let int = |n: usize| n as i32;
        let [nx, ny, nz] = self.size.map(int);
        let [ox, oy, oz] = self.corner.map(int);
        let [cx, cy, cz] = self.cells.map(int);
        let [ints, numbers, _, faces, ..] = &self.images;
        let tiles: usize = self.tiles.iter().product();
        let arguments = [
            Argument::Array(populations),
            Argument::Array(&self.slots[phase as usize]),
            Argument::Ints([nx, ny, nz, self.pitch as i32]),
            Argument::Int(ny + 2),
            Argument::Ints([cx, cy, cz, 0]),
            Argument::Ints([ox, oy, oz, 0]),
            Argument::Array(&self.parameters),
            Argument::Int(i32::from(self.walls.is_some())),
            Argument::Array(self.walls.as_ref().unwrap_or(&self.parameters)),
            Argument::Array(&self.tile_start),
            Argument::Array(&self.tile_images),
            Argument::Array(ints),
            Argument::Array(numbers),
            Argument::Array(faces),
            Argument::Array(&self.cut),
            Argument::Array(spans),
            Argument::Array(lengths),
            Argument::Array(velocities),
            Argument::Array(&self.received),
            Argument::Int(i32::from(flow.is_some())),
            Argument::Array(&self.flows),
        ];
        let of_cell = 2 * Q * size_of::<S>() + usize::from(self.walls.is_some());
        let of_tiles = size_of_val(&start[..])
            + size_of_val(&listed[..])
            + if flow.is_some() { tiles * TILE_WORDS * 8 } else { 0 };
        let bytes =
            self.size.iter().product::<usize>() * of_cell + of_rows + of_tiles + size_of_val(received);
        // SAFETY: the arguments of the kernel; slots of cells of the block are within the populations (tested in `layout`), and lists of
        // tiles, images and rows within their arrays.
        unsafe { queue.launch(&self.kernels.sweep, &arguments, tiles, ITEMS, bytes)? };
        if let Some(flow) = flow {
            let arguments =
                [Argument::Array(&self.flows), Argument::Int(tiles as i32), Argument::Array(&self.total)];
            // SAFETY: the arguments of the kernel; there is a flow of each tile.
            unsafe {
                let bytes = tiles * TILE_WORDS * 8;
                queue.launch(&self.kernels.flow_total, &arguments, 1, ITEMS, bytes)?;
            }
            let mut words = [0_i64; FLOW_WORDS];
            queue.read(&self.total, &mut words)?;
            self.transferred += size_of_val(&words) as u64;
            *flow = self.flow_of(&words);
        }
        self.copy(&self.swept[phase.next() as usize], populations)?;
        queue.read(&self.received, received)?;
        self.transferred += size_of_val(received) as u64;
        Ok(())
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
        self.transferred += (size_of_val(cells) + size_of_val(sums)) as u64;
        queue.read(found, sums)
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
