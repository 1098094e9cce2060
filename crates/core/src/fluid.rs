//! The lattice Boltzmann fluid of one block, in lattice units.
//!
//! D3Q19, BGK, TRT or regularised, forces by the exact difference method ([`kernel`]); populations shifted by their weights and
//! streamed in place in one buffer ([`layout`]); ghosts exchanged with the neighbouring blocks ([`halo`]); walls by
//! half-way and interpolated bounce-back ([`walls`]). The fluid does not know particles: a sweep gets the cells that bodies cover and
//! returns the momentum that each body received ([`bodies`]).

mod bodies;
mod buffer;
pub(crate) mod device;
mod dispatch;
mod flow_row;
mod halo;
mod images;
pub(crate) mod kernel;
mod layout;
mod measure;
mod observe;
mod population;
mod regularised;
mod rows;
mod saved;
mod segments;
pub(crate) mod simd;
pub(crate) mod solid;
mod solid_row;
mod spheres;
mod sweep;
pub(crate) mod volume_fraction;
mod walls;

use crate::comm::Comm;
use crate::domain::{Block, Decomposition, Domain};
use crate::error::Result;
use crate::lattice::{C, Q, W, shifted_equilibrium};
use crate::memory;
pub use bodies::{BlockSolids, Body, ExchangeSum, RigidMotion};
use buffer::Buffer;
use device::Populations;
pub use dispatch::Real;
#[doc(hidden)]
pub use dispatch::Sweep;
pub use flow_row::{FLOW_SUMS, FlowRow, FlowSums, SumsAlongRows};
use halo::FluidHalo;
pub(crate) use images::INTS as IMAGE_INTS;
pub use images::Images;
use kernel::Measured;
#[doc(hidden)]
pub use kernel::{Operator, Recursive, TwoTimes};
use layout::{AaPhase, Layout};
pub use measure::Stresslet;
pub use observe::{CellState, stream_bandwidth};
#[doc(hidden)]
pub use population::PopulationLanes;
pub use population::{F16, Population};
use regularised::with_eddies;
use rows::RowOrder;
pub use segments::{CoverCount, RowSegments, Segment};
use serde::{Deserialize, Serialize};
pub use solid::{CHUNK, GROUP, SolidModel};
pub(crate) use solid_row::SolidRow;
pub(crate) use spheres::{HALF_DIAGONAL, NEAR};
pub use spheres::{LatticeSphere, SphereImage, SphereRows};
pub use sweep::Asked;
use sweep::SweepDevice;
pub(crate) use walls::SavedMean;
use walls::Walls;
pub use walls::{Between, Boundary, HALF_WAY, NO_SHEETS, PartOfLink, WallLoad, WallMotion};

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
    /// Recursive regularised, with two relaxation times in cells with solids ([`regularised`]); not with homogenised cells.
    RecursiveRegularised {
        /// The magic parameter of cells with solids (-).
        magic: f64,
        /// Smagorinsky's constant (-), 0 for none.
        smagorinsky: f64,
    },
}

impl Collision {
    /// Its name in case files and summaries.
    pub fn name(self) -> &'static str {
        match self {
            Self::Bgk => "bgk",
            Self::Trt { .. } => "trt",
            Self::RecursiveRegularised { .. } => "recursive_regularised",
        }
    }

    /// Smagorinsky's constant (-), 0 for none.
    fn smagorinsky(self) -> f64 {
        match self {
            Self::Bgk | Self::Trt { .. } => 0.0,
            Self::RecursiveRegularised { smagorinsky, .. } => smagorinsky,
        }
    }
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

/// A flow in a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlowState {
    /// Density.
    pub density: f64,
    /// Velocity (cells per time step).
    pub velocity: [f64; 3],
    /// Rate of strain (1 / time step): `xx`, `yy`, `zz`, `xy`, `xz`, `yz`.
    pub strain: [f64; 6],
}

/// The fluid of one block.
pub struct Fluid<S: Population> {
    domain: Domain,
    block: Block,
    layout: Layout,
    populations: Populations<S>,
    device: SweepDevice<S>,
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
        let relaxation_times = match params.collision {
            Collision::Bgk => [tau; 2],
            Collision::Trt { magic } | Collision::RecursiveRegularised { magic, .. } => {
                [tau, 0.5 + magic / (tau - 0.5)]
            }
        };
        let order = RowOrder::new(decomposition, comm.rank());
        let arrays = (|| {
            let [x, y, z] = block.size();
            let what = format!("the populations of a block of {x} x {y} x {z} cells");
            let bytes = block.size().map(|n| n as f64).iter().product::<f64>() * Self::SAVED_BYTES as f64;
            let layout = Layout::new(block.size(), size_of::<S>());
            let layout = layout.ok_or_else(|| memory::refused(bytes, &what))?;
            let walls = Walls::new(&layout, order, domain, block, boundary, relaxation_times)?;
            let populations = Buffer::zeroed(layout.len() + walls.tail(), &what)?;
            Ok((populations, FluidHalo::new(&layout, decomposition, comm)?, walls, layout))
        })();
        let (populations, halo, walls, layout) = comm.agree(arrays)?;
        let row = layout.chunks_per_row() * CHUNK;
        let mut fluid = Self {
            block,
            populations: populations.into(),
            device: SweepDevice::Host,
            phase: AaPhase::Even,
            solid_row: SolidRow::new(layout.chunks_per_row()),
            halo,
            order,
            measured: Measured { momentum: std::array::from_fn(|_| vec![S::Number::ZERO; row]), bare: None },
            walls,
            relaxation_times,
            params: *params,
            wrap_x: decomposition.grid[0] == 1 && domain.is_periodic(0),
            domain: *domain,
            layout,
        };
        fluid.begin();
        Ok(fluid)
    }

    /// The collision operator.
    pub(crate) fn collision(&self) -> Collision {
        self.params.collision
    }

    /// The block of cells.
    pub fn block(&self) -> Block {
        self.block
    }

    /// Sets every cell to equilibrium at the density and velocity given for its position in the box. Collective in effect.
    pub fn set_equilibrium(&mut self, state: impl Fn([usize; 3]) -> (f64, [f64; 3])) {
        self.set_cells(|at| {
            let (rho, u) = state(at);
            shifted_equilibrium(rho, u)
        });
    }

    /// Sets every cell to a flow, with its viscous stress: `f = f_eq - 3 w_i rho tau c.S.c` of the rate of strain `S`, without trace.
    /// Collective in effect.
    ///
    /// Reference: Krüger et al. (2017), The Lattice Boltzmann Method, Eq. (4.35).
    pub fn set_flow(&mut self, state: impl Fn([usize; 3]) -> FlowState) {
        let (tau, smagorinsky) = (self.relaxation_times[0], self.params.collision.smagorinsky());
        self.set_cells(|at| {
            let FlowState { density, velocity, strain } = state(at);
            let mut g = shifted_equilibrium(density, velocity);
            if strain.iter().any(|&s| s != 0.0) {
                let tau = with_eddies(tau, smagorinsky, strain);
                let [xx, yy, zz, xy, xz, yz] = strain;
                for (i, g) in g.iter_mut().enumerate() {
                    let [x, y, z] = C[i].map(|c| c as f64);
                    let along =
                        (x * x * xx + y * y * yy + z * z * zz) + 2.0 * (x * y * xy + x * z * xz + y * z * yz);
                    *g -= 3.0 * W[i] * density * tau * along;
                }
            }
            g
        });
    }

    fn set_cells(&mut self, cell: impl Fn([usize; 3]) -> [f64; Q]) {
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
                beyond |= !self.domain.is_periodic(a) && !(0..cells[a]).contains(&at[a]);
            }
            let at = std::array::from_fn(|a| at[a].rem_euclid(cells[a]) as usize);
            let inside = x >= 0 && x < nx && y >= 0 && y < ny && z >= 0 && z < nz;
            let in_wall = inside && self.walls.of([x, y, z].map(|c| c as usize)).is_some();
            let g = if beyond || in_wall { [0.0; Q] } else { cell(at) };
            for (i, g) in g.into_iter().enumerate() {
                self.populations[i * self.layout.stride + slot] = S::round(S::Number::from_f64(g));
            }
        }
        self.begin();
    }

    /// Makes what walls send back that of populations which are there in the phase `Even`.
    fn begin(&mut self) {
        self.walls.begin(&self.layout, &mut self.populations);
        if self.domain.faces.iter().any(|face| face.sends_to_neighbours()) {
            self.halo.exchange(&mut self.populations, AaPhase::Even);
        }
        self.walls.begin_sheets(&mut self.populations);
        self.walls.begin_interpolated(&mut self.populations);
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
mod regularised_tests;
#[cfg(test)]
mod tests;
