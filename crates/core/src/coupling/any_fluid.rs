//! A fluid whose precision is chosen at run time. All sweeps are compiled here, once.

use super::Coupling;
use super::method::{sweep_alone, with_method};
use crate::comm::{Comm, SavedParts};
use crate::device::{Device, KernelCost};
use crate::domain::{Block, Decomposition};
use crate::error::Result;
use crate::fluid::{
    Asked, Boundary, F16, Flow, FlowRow, FlowState, Fluid, FluidParams, Images, Precision, SavedMean,
    Stresslet, WallLoad, WallMotion,
};

/// The fluid of one block, of any [`Precision`], in lattice units; see [`Fluid`].
pub enum AnyFluid {
    /// Populations of four bytes.
    F32(Box<Fluid<f32>>),
    /// Populations of eight bytes.
    F64(Box<Fluid<f64>>),
    /// Populations of two bytes.
    F16(Box<Fluid<F16>>),
}

/// End of the bytes of a rank that has means.
const MEANS: &[u8] = b"outlets\0";

/// The same words for all precisions.
macro_rules! either {
    ($of:expr, $fluid:ident => $words:expr) => {
        match $of {
            AnyFluid::F32($fluid) => $words,
            AnyFluid::F64($fluid) => $words,
            AnyFluid::F16($fluid) => $words,
        }
    };
}

impl AnyFluid {
    /// Fluid at rest with density 1 on the block of this rank, as [`Fluid::new`]. Collective.
    ///
    /// # Errors
    /// On every rank, if one of them has too little memory.
    pub fn new(
        precision: Precision,
        decomposition: &Decomposition,
        comm: &Comm,
        params: &FluidParams,
        boundary: &Boundary,
    ) -> Result<Self> {
        Ok(match precision {
            Precision::F32 => Self::F32(Box::new(Fluid::new(decomposition, comm, params, boundary)?)),
            Precision::F64 => Self::F64(Box::new(Fluid::new(decomposition, comm, params, boundary)?)),
            Precision::F16 => Self::F16(Box::new(Fluid::new(decomposition, comm, params, boundary)?)),
        })
    }

    /// Bytes of a saved cell.
    pub const fn saved_bytes(precision: Precision) -> usize {
        match precision {
            Precision::F32 => Fluid::<f32>::SAVED_BYTES,
            Precision::F64 => Fluid::<f64>::SAVED_BYTES,
            Precision::F16 => Fluid::<F16>::SAVED_BYTES,
        }
    }

    /// Storage type of the populations.
    pub fn precision(&self) -> Precision {
        match self {
            Self::F32(_) => Precision::F32,
            Self::F64(_) => Precision::F64,
            Self::F16(_) => Precision::F16,
        }
    }

    /// Computes on a device from now on, which then finds the cells that the bodies of a coupling cover.
    ///
    /// # Errors
    /// As [`Fluid::use_device`].
    pub fn use_device(&mut self, device: &Device, coupling: &mut Coupling) -> Result<()> {
        with_method!(coupling.params.method, method => either!(self, fluid => fluid.use_device(device, method)))?;
        self.prepare(coupling);
        Ok(())
    }

    /// As [`Fluid::connect_on_device`].
    ///
    /// # Errors
    /// As there.
    pub fn connect_on_device(&mut self, comm: &Comm) -> Result<()> {
        either!(self, fluid => fluid.connect_on_device(comm))
    }

    /// Prepares a coupling for sweeps of this fluid: for one on a device it finds images of bodies, else the cells that they cover.
    pub fn prepare(&self, coupling: &mut Coupling) {
        coupling.images = self.device_traffic().map(|_| Images::default());
    }

    /// Bytes to and from the device in the last sweep, without messages to other ranks and copies for output; none without a device.
    pub fn device_traffic(&self) -> Option<u64> {
        either!(self, fluid => fluid.device_traffic())
    }

    /// As [`Fluid::time_kernels`].
    pub fn time_kernels(&self, from_now_on: bool) -> Vec<KernelCost> {
        either!(self, fluid => fluid.time_kernels(from_now_on))
    }

    /// A failure of the device since the last call.
    pub fn take_failure(&mut self) -> Option<crate::Error> {
        either!(self, fluid => fluid.take_failure())
    }

    /// The block of cells.
    pub fn block(&self) -> Block {
        either!(self, fluid => fluid.block())
    }

    /// Sets every cell to equilibrium at a density and velocity, as [`Fluid::set_equilibrium`]. Collective in effect.
    pub fn set_equilibrium(&mut self, state: impl Fn([usize; 3]) -> (f64, [f64; 3])) {
        let state: &dyn Fn([usize; 3]) -> (f64, [f64; 3]) = &state;
        either!(self, fluid => fluid.set_equilibrium(state));
    }

    /// Sets every cell to a flow, as [`Fluid::set_flow`]. Collective in effect.
    pub fn set_flow(&mut self, state: impl Fn([usize; 3]) -> FlowState) {
        let state: &dyn Fn([usize; 3]) -> FlowState = &state;
        either!(self, fluid => fluid.set_flow(state));
    }

    /// Density (-) and velocity (cells per step) of the bare populations in a cell of the block.
    pub fn moments(&self, cell: [usize; 3]) -> (f64, [f64; 3]) {
        either!(self, fluid => fluid.moments(cell))
    }

    /// As [`Coupling::sweep`]. Collective.
    pub fn sweep<'a>(
        &mut self,
        acceleration: [f64; 3],
        coupling: &mut Coupling,
        asked: impl Into<Asked<'a>>,
    ) -> Option<Flow> {
        either!(self, fluid => coupling.sweep(fluid, acceleration, asked))
    }

    /// Gives the walls that vary their motion in the coming step, as [`Fluid::move_walls`].
    pub fn move_walls(&mut self, motions: &[WallMotion]) {
        either!(self, fluid => fluid.move_walls(motions));
    }

    /// As [`sweep`](Self::sweep), without particles and without measuring. Collective.
    pub fn sweep_alone(&mut self, acceleration: [f64; 3]) {
        either!(self, fluid => { sweep_alone(fluid, acceleration, false); });
    }

    /// Completes a sweep, as [`Fluid::exchange`]. Collective.
    pub fn exchange(&mut self) {
        either!(self, fluid => fluid.exchange());
    }

    /// As [`Coupling::measure`].
    pub fn measure(&self, acceleration: [f64; 3], coupling: &mut Coupling) -> (Flow, Vec<(u64, Stresslet)>) {
        either!(self, fluid => coupling.measure(fluid, acceleration))
    }

    /// As [`Fluid::each_row`].
    pub fn each_row(
        &self,
        cells: Block,
        acceleration: [f64; 3],
        coupling: &mut Coupling,
        mut visit: impl FnMut(&FlowRow),
    ) {
        either!(self, fluid => coupling.each_row(fluid, cells, acceleration, &mut visit));
    }

    /// Adds what fills bodies that were inserted.
    pub(super) fn fill_inserted(
        &self,
        coupling: &mut Coupling,
        ids: &std::ops::Range<u64>,
        fillings: &mut [[i128; 8]],
    ) {
        either!(self, fluid => coupling.fill(fluid, ids, fillings));
    }

    /// Force and torque on each wall in the last step, as [`Fluid::wall_loads`].
    pub fn wall_loads(&self) -> Vec<WallLoad> {
        either!(self, fluid => fluid.wall_loads())
    }

    /// Number of cells of the block in no wall.
    pub fn fluid_cells(&self) -> usize {
        either!(self, fluid => fluid.fluid_cells())
    }

    /// Hash of all populations of the block; see [`Fluid::state_hash`].
    pub fn state_hash(&self) -> u64 {
        either!(self, fluid => fluid.state_hash())
    }

    /// Appends the populations of plane `z` of the box, which crosses the block.
    pub fn save_plane(&self, z: usize, out: &mut Vec<u8>) {
        either!(self, fluid => fluid.save_plane(z, out));
    }

    /// Takes the saved populations of some cells.
    ///
    /// # Errors
    /// Their defect.
    pub fn restore(&mut self, cells: Block, bytes: &[u8]) -> std::result::Result<(), String> {
        either!(self, fluid => fluid.restore(cells, bytes))
    }

    /// Appends the mean momenta at outlets of the block that let sound leave, if there are some.
    pub fn save_means(&self, out: &mut Vec<u8>) {
        let saved = either!(self, fluid => fluid.save_means());
        if !saved.is_empty() {
            out.extend_from_slice(bytemuck::cast_slice(&saved));
            out.extend_from_slice(&(saved.len() as u64).to_le_bytes());
            out.extend_from_slice(MEANS);
        }
    }

    /// Takes those of this block among all that were appended to the parts, and leaves what they were appended to in the parts that this rank
    /// has read, with their indices; before [`resume`](Self::resume). Where there is none the mean begins as the momentum that is there.
    /// Collective.
    ///
    /// # Errors
    /// Their defect, the same on every rank.
    pub fn restore_means<'a>(
        &mut self,
        comm: &Comm,
        parts: &'a SavedParts,
    ) -> std::result::Result<Vec<(usize, &'a [u8])>, String> {
        let (rests, saved) = comm.agree_words(read_means(parts))?;
        let offered: Vec<(u64, SavedMean)> = saved.into_iter().map(|mean| (mean.id(), mean)).collect();
        let there = either!(self, fluid => fluid.save_means());
        let wanted: Vec<u64> = there.iter().map(SavedMean::id).collect();
        let found = comm.fetch(&offered, &wanted).found;
        let found: Vec<SavedMean> = found.into_iter().flatten().collect();
        either!(self, fluid => fluid.restore_means(&found));
        Ok(rests)
    }

    /// Makes the restored populations the state between two steps.
    pub fn resume(&mut self) {
        either!(self, fluid => fluid.resume());
    }
}

/// The parts of the coupling without the means that were appended to them, and these means; or their defect.
type ReadMeans<'a> = std::result::Result<(Vec<(usize, &'a [u8])>, Vec<SavedMean>), String>;

fn read_means(parts: &SavedParts) -> ReadMeans<'_> {
    let (mut rests, mut saved): (_, Vec<SavedMean>) = (Vec::new(), Vec::new());
    for (n, part) in &parts.own {
        let Some(head) = part.strip_suffix(MEANS) else {
            rests.push((*n, &part[..]));
            continue;
        };
        let defect = || format!("part {} of the coupling: the means at outlets are of another form", n + 1);
        let (head, count) = head.split_last_chunk().ok_or_else(defect)?;
        let bytes = usize::try_from(u64::from_le_bytes(*count)).ok();
        let bytes = bytes.and_then(|count| count.checked_mul(size_of::<SavedMean>()));
        let rest = bytes.and_then(|bytes| head.len().checked_sub(bytes)).ok_or_else(defect)?;
        let means = head[rest..].chunks_exact(size_of::<SavedMean>());
        saved.extend(means.map(bytemuck::pod_read_unaligned::<SavedMean>));
        rests.push((*n, &head[..rest]));
    }
    if saved.iter().any(|of| !of.is_sound()) {
        return Err("a mean momentum at an outlet is that of no fluid".to_string());
    }
    Ok((rests, saved))
}
