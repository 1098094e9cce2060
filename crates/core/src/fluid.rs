//! The lattice Boltzmann fluid of one block, in lattice units.
//!
//! D3Q19, BGK or TRT, forces by the exact difference method ([`kernel`]); populations shifted by their weights and
//! streamed in place in one buffer ([`layout`]); ghosts exchanged with the neighbouring blocks ([`halo`]); walls by
//! half-way bounce-back ([`walls`]). The fluid does not know particles: a sweep gets the cells that bodies cover and
//! returns the momentum that each body received ([`bodies`]).

mod bodies;
mod buffer;
#[cfg(feature = "gpu")]
mod device;
mod dispatch;
mod halo;
mod images;
pub(crate) mod kernel;
mod layout;
mod measure;
mod observe;
mod population;
mod rows;
mod saved;
pub(crate) mod simd;
pub(crate) mod solid;
mod walls;

use crate::comm::Comm;
use crate::domain::{Block, Decomposition, Domain};
use crate::error::Result;
use crate::lattice::{C, Q, shifted_equilibrium};
use crate::memory;
pub use bodies::{BlockSolids, Body, CoverCount, ExchangeSum, RigidMotion, RowSegments, Segment};
use buffer::Buffer;
pub use dispatch::Real;
#[doc(hidden)]
pub use dispatch::Sweep;
use halo::FluidHalo;
#[cfg(feature = "gpu")]
pub(crate) use images::INTS as IMAGE_INTS;
pub use images::Images;
use kernel::Measured;
use layout::{AaPhase, Layout};
pub use observe::{CellState, stream_bandwidth};
#[doc(hidden)]
pub use population::PopulationLanes;
pub use population::{F16, Population};
use rows::RowOrder;
use serde::{Deserialize, Serialize};
pub(crate) use solid::SolidRow;
pub use solid::{CHUNK, GROUP, SolidModel};
use walls::Walls;
pub use walls::{Boundary, WallLoad, WallMotion};

/// Storage type of the populations.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Precision {
    /// Four bytes a population; accurate because populations are shifted by their weights.
    #[default]
    F32,
    /// Eight bytes a population.
    F64,
    /// Two bytes a population, computed with in four: half the memory and its traffic; see `validation/precision`.
    F16,
}

impl Precision {
    /// Its name in case files and summaries.
    pub fn name(self) -> &'static str {
        match self {
            Self::F32 => "f32",
            Self::F64 => "f64",
            Self::F16 => "f16",
        }
    }
}

/// Collision operator.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Collision {
    /// Bhatnagar, Gross and Krook: one relaxation time.
    #[default]
    Bgk,
    /// Two relaxation times: that of the even part sets the viscosity, that of the odd part follows from the magic
    /// parameter `(tau_even - 1/2) (tau_odd - 1/2)`.
    Trt {
        /// The magic parameter (-); 3/16 puts half-way walls exactly half-way.
        magic: f64,
    },
}

/// Instruction set of the kernels; all give the same bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Simd {
    /// One cell at a time.
    Scalar,
    /// 128-bit registers; FMA.
    Sse2,
    /// 256-bit registers; FMA.
    Avx2,
    /// 512-bit registers.
    Avx512,
}

/// Speed (cells per time step) above which a run has diverged: Mach number 0.7.
pub const SPEED_LIMIT: f64 = 0.4;

/// Parameters of the fluid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FluidParams {
    /// Relaxation time (time steps) of the viscosity `(tau - 1/2) / 3`.
    pub relaxation_time: f64,
    /// Collision operator.
    pub collision: Collision,
    /// Instruction set, which the processor must have.
    pub simd: Simd,
}

/// Measurements of a sweep before its collisions, as exact sums of fixed-point numbers, without cells in walls.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Flow {
    /// Sum of the momentum of all cells.
    pub momentum: [i128; 3],
    /// Sum of the squared momentum of all cells.
    pub square: i128,
    /// Sum of the solid fractions of all cells.
    pub solid: i128,
    /// Largest speed.
    pub max_speed: f64,
    /// First cell (of the whole box) whose speed is above [`SPEED_LIMIT`] or not a number.
    pub fault: Option<([usize; 3], f64)>,
}

#[cfg(not(feature = "gpu"))]
use buffer::Buffer as Populations;
#[cfg(feature = "gpu")]
use device::Populations;

/// The fluid of one block.
pub struct Fluid<S: Population> {
    domain: Domain,
    block: Block,
    layout: Layout,
    populations: Populations<S>,
    #[cfg(feature = "gpu")]
    device: Option<device::DeviceFluid<S>>,
    phase: AaPhase,
    solid_row: SolidRow<S::Number>,
    halo: FluidHalo<S>,
    order: RowOrder,
    measured: Measured<S::Number>,
    walls: Walls<S>,
    params: FluidParams,
    /// Of the even and of the odd part.
    relaxation_times: [f64; 2],
    /// The block is as long as the periodic box in x, so it is its own neighbour there.
    wrap_x: bool,
}

impl<S: Population> Fluid<S> {
    /// Fluid at rest with density 1 on the block of this rank, between walls that move already. Collective.
    ///
    /// # Errors
    /// On every rank, if one of them has not the memory.
    pub fn new(
        decomposition: &Decomposition,
        comm: &Comm,
        params: &FluidParams,
        boundary: &Boundary,
    ) -> Result<Self> {
        let (tau, simd) = (params.relaxation_time, params.simd);
        assert!(simd.is_available(), "{simd:?} on a processor that has it");
        let (domain, block) = (&decomposition.domain, decomposition.block(comm.rank()));
        let order = RowOrder::new(decomposition, comm.rank());
        let arrays = (|| {
            let [x, y, z] = block.size();
            let what = format!("the populations of a block of {x} x {y} x {z} cells");
            let bytes = block.size().map(|n| n as f64).iter().product::<f64>() * Self::SAVED_BYTES as f64;
            let layout = Layout::new(block.size(), size_of::<S>());
            let layout = layout.ok_or_else(|| memory::refused(bytes, &what))?;
            Ok((
                Buffer::zeroed(layout.len(), &what)?,
                FluidHalo::new(&layout, decomposition, comm)?,
                Walls::new(&layout, order, domain, block, boundary)?,
                layout,
            ))
        })();
        let (populations, halo, walls, layout) = comm.agree(arrays)?;
        let row = layout.chunks_per_row() * CHUNK;
        let mut fluid = Self {
            block,
            #[cfg(feature = "gpu")]
            populations: populations.into(),
            #[cfg(not(feature = "gpu"))]
            populations,
            #[cfg(feature = "gpu")]
            device: None,
            phase: AaPhase::Even,
            solid_row: SolidRow::new(layout.chunks_per_row()),
            halo,
            order,
            measured: Measured { momentum: std::array::from_fn(|_| vec![S::Number::ZERO; row]) },
            walls,
            relaxation_times: match params.collision {
                Collision::Bgk => [tau; 2],
                Collision::Trt { magic } => [tau, 0.5 + magic / (tau - 0.5)],
            },
            params: *params,
            wrap_x: decomposition.grid[0] == 1 && domain.periodic[0],
            domain: *domain,
            layout,
        };
        fluid.walls.begin(&fluid.layout, &mut fluid.populations);
        Ok(fluid)
    }

    /// Computes this fluid on a device from now on, with partially saturated cells of an operator (1 to 3), or homogenised ones (0).
    ///
    /// # Errors
    /// [`Error::Input`](crate::Error::Input) if the device has not the memory, or if its compiler refuses the kernels.
    #[cfg(feature = "gpu")]
    pub fn use_device(
        &mut self,
        device: &crate::device::Device,
        precision: Precision,
        operator: u32,
    ) -> Result<()> {
        let Self { layout, domain, block, walls, halo, wrap_x, populations, .. } = self;
        // As in `sweep_part`.
        let pairs = operator != 0 || self.params.collision != Collision::Bgk;
        let host = device::Host { layout, domain, block: *block, walls, halo, wrap_x: *wrap_x, pairs };
        self.device = Some(device::DeviceFluid::new(device, precision, operator, &host, populations)?);
        Ok(())
    }

    /// Bytes to and from the device in the last sweep, without messages to other ranks and copies for output; none without a device.
    #[cfg(feature = "gpu")]
    pub fn device_traffic(&self) -> Option<u64> {
        self.device.as_ref().map(|device| device.transferred)
    }

    /// Costs of the kernels of the device since they are timed; times them from now on or no longer. None without a device.
    #[cfg(feature = "gpu")]
    pub fn time_kernels(&self, from_now_on: bool) -> Vec<crate::device::KernelCost> {
        self.device.as_ref().map(|device| device.time_kernels(from_now_on)).unwrap_or_default()
    }

    /// A failure of the device since the last call.
    pub fn take_failure(&mut self) -> Option<crate::Error> {
        #[cfg(feature = "gpu")]
        return self.device.as_ref().and_then(device::DeviceFluid::take_failure);
        #[cfg(not(feature = "gpu"))]
        None
    }

    /// The block of cells.
    pub fn block(&self) -> Block {
        self.block
    }

    /// Sets every cell to equilibrium at the density and velocity given for its position in the box. Collective in effect.
    pub fn set_equilibrium(&mut self, state: impl Fn([usize; 3]) -> (f64, [f64; 3])) {
        let ([nx, ny, nz], lo) = (self.layout.size.map(|n| n as isize), self.block.lo);
        let cells = self.domain.cells.map(|n| n as isize);
        self.phase = AaPhase::Even;
        // Ghosts as well: they hold what left the block in the step before.
        for (z, y, x) in
            (-1..=nz).flat_map(|z| (-1..=ny).flat_map(move |y| (-1..=nx).map(move |x| (z, y, x))))
        {
            let (slot, mut at, mut beyond) = (self.layout.cell(x, y, z), [x, y, z], false);
            for a in 0..3 {
                at[a] += lo[a] as isize;
                beyond |= !self.domain.periodic[a] && !(0..cells[a]).contains(&at[a]);
            }
            let at = std::array::from_fn(|a| at[a].rem_euclid(cells[a]) as usize);
            let inside = x >= 0 && x < nx && y >= 0 && y < ny && z >= 0 && z < nz;
            let in_wall = inside && self.walls.of([x, y, z].map(|c| c as usize)).is_some();
            let g = if beyond || in_wall {
                [0.0; Q]
            } else {
                let (rho, u) = state(at);
                shifted_equilibrium(rho, u)
            };
            for (i, g) in g.into_iter().enumerate() {
                self.populations[i * self.layout.stride + slot] = S::round(S::Number::from_f64(g));
            }
        }
        self.walls.begin(&self.layout, &mut self.populations);
    }

    /// Collides and streams all cells of the block under a uniform acceleration of the fluid, in place.
    ///
    /// The bodies of `solids` get the momentum that their cells exchange. On return, populations are being sent to the
    /// neighbouring blocks, and the ghosts are stale until [`exchange`](Self::exchange). With `measure`, also returns
    /// measurements of the cells before the sweep. Collective.
    pub fn sweep<M: SolidModel>(
        &mut self,
        acceleration: [f64; 3],
        solids: &mut BlockSolids<M>,
        measure: bool,
    ) -> Option<Flow> {
        #[cfg(feature = "gpu")]
        if let Some(device) = &mut self.device {
            let row = dispatch::parameters_of(self.relaxation_times, acceleration);
            let images = solids.images.expect("the images of bodies for a device");
            let flow = device.sweep(&mut self.populations, self.phase, row, images, solids.bodies, measure);
            self.phase = self.phase.next();
            return flow;
        }
        let mut flow = measure.then(Flow::default);
        let entered = self.phase.next();
        if self.order.has_first() {
            self.sweep_part(true, acceleration, solids, flow.as_mut());
            self.halo.early.start(&self.populations, entered);
        }
        self.sweep_part(false, acceleration, solids, flow.as_mut());
        self.halo.late.start(&self.populations, entered);
        self.phase = entered;
        flow
    }

    fn sweep_part<M: SolidModel>(
        &mut self,
        first: bool,
        acceleration: [f64; 3],
        solids: &mut BlockSolids<M>,
        flow: Option<&mut Flow>,
    ) {
        // Compiled apart, so that boxes without walls and cells with one relaxation time pay for neither.
        let (pairs, walls) = (self.params.collision != Collision::Bgk, !self.walls.is_empty());
        let sweep = Sweep { fluid: self, first, acceleration, solids, flow };
        if M::PAIRS || pairs {
            if walls { S::sweep::<M, true, true>(sweep) } else { S::sweep::<M, true, false>(sweep) }
        } else if walls {
            S::sweep::<M, false, true>(sweep);
        } else {
            S::sweep::<M, false, false>(sweep);
        }
    }

    /// Completes a sweep: populations arrive from the neighbouring blocks, and walls send them back. Collective.
    pub fn exchange(&mut self) {
        #[cfg(feature = "gpu")]
        if let Some(device) = &mut self.device {
            return device.exchange(&mut self.populations, &mut self.halo, self.phase);
        }
        self.halo.exchange(&mut self.populations, self.phase);
        self.walls.bounce_late(self.phase, &mut self.populations);
    }

    /// Momentum and (moving, shifted) mass that left a cell of the block in the last sweep: `[p_x, p_y, p_z, m]`;
    /// nothing leaves a cell in a wall.
    pub fn departed(&self, [x, y, z]: [usize; 3]) -> [f64; 4] {
        if self.walls.of([x, y, z]).is_some() {
            return [0.0; 4];
        }
        let cell = self.layout.cell(x as isize, y as isize, z as isize);
        let mut sum = [0.0; 4];
        for i in 1..Q {
            let g = self.populations[self.left(cell, i)].wide();
            for axis in 0..3 {
                sum[axis] += C[i][axis] as f64 * g;
            }
            sum[3] += g;
        }
        sum
    }

    /// [`departed`](Self::departed) of some cells; a device is asked for all at once.
    pub(crate) fn departed_from(&mut self, cells: &[[usize; 3]]) -> Vec<[f64; 4]> {
        #[cfg(feature = "gpu")]
        if let Some(device) = &mut self.device {
            let slot = |[x, y, z]: [usize; 3]| self.layout.cell(x as isize, y as isize, z as isize) as u64;
            let slots: Vec<u64> = cells.iter().map(|&cell| slot(cell)).collect();
            let mut sums = device.departed(&mut self.populations, self.phase, &slots);
            for (sum, cell) in sums.iter_mut().zip(cells) {
                if self.walls.of(*cell).is_some() {
                    *sum = [0.0; 4];
                }
            }
            return sums;
        }
        cells.iter().map(|&cell| self.departed(cell)).collect()
    }

    /// Populations of a cell of the block after streaming, minus their weights.
    pub fn populations(&self, [x, y, z]: [usize; 3]) -> [S; Q] {
        let cell = self.layout.cell(x as isize, y as isize, z as isize);
        self.layout.slots(self.phase, cell).map(|slot| self.populations[slot])
    }
}

#[cfg(test)]
mod half_tests;
#[cfg(test)]
mod tests;
