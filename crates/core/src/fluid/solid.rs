//! The collision of cells that solids cover.

use super::Real;
use super::kernel::{Moments, Operator, Row, Slots};
use super::population::{Population, PopulationLanes};
use super::simd::{Choose, Lanes};
use super::solid_row::SolidRow;

/// Cells of the widest register of single precision: rows are padded to a multiple of this.
pub const CHUNK: usize = 16;

/// Cells that are looked at together where bodies cover some of them.
pub const GROUP: usize = 8;

/// Method of coupling solids to the fluid: collision of the cells they cover, compiled into the sweep.
pub trait SolidModel: Copy {
    /// Populations relax in pairs of opposite directions, even with one relaxation time: a cell without solids must not be
    /// rounded differently where it shares a register with one that has some.
    const PAIRS: bool;
    /// Operator of a fluid whose collision is recursive regularised; any other of a method that does not have it.
    type Regularised: Operator;
    /// Solid fractions are of the volume: they add up to at most one, `B = max(0, 1 - sum e_k)`, and divide the momentum of
    /// a cell among bodies. Otherwise `B = prod (1 - phi_k)`, and each body receives what its own velocity says.
    const BY_VOLUME: bool;
    /// Measured momentum is that midway between before and after the collision, as velocities of fields are; otherwise that before it.
    const MIDWAY: bool;

    /// Collides the register of cells at `x` in place under the acceleration `a`, writes what the solids exchange to
    /// `solids`, and returns the measured momentum of solid and fluid.
    ///
    /// # Safety
    /// `WIDTH` numbers can be read and written at `x` of all slots, and the row has as many cells from there on.
    unsafe fn collide<S: Population, R: PopulationLanes<S>, O: Operator>(
        self,
        slots: &Slots<S>,
        cells: &Moments<R>,
        a: [R; 3],
        row: &Row<S::Number>,
        solids: &mut SolidRow<S::Number>,
        x: usize,
    ) -> [R; 3];

    /// Measures the change that [`collide`](Self::collide) would make to a register of cells.
    fn measure<T: Real, R: Lanes<T>>(
        self,
        cells: &Moments<R>,
        covered: &Covered<R>,
        row: &Row<T>,
    ) -> Measure<R>;

    /// Options of the preprocessor for the kernels of a device, besides `BY_VOLUME`.
    fn kernel_options(self) -> String {
        String::new()
    }

    /// Momentum that a cell of solid fraction `e` receives over `rho (u_s - u)` and over `rho a`; `t = tau - 1/2`.
    fn received<D: Choose<f64>>(self, e: D, t: f64) -> [D; 2];
}

/// Momentum of a register of cells, as a collision would see it.
pub struct Measure<R> {
    /// That of solid and fluid.
    pub(crate) mean: [R; 3],
    /// Momentum that the solids receive.
    pub(crate) received: [R; 3],
    /// Part of the deviation from equilibrium that the solids keep from relaxing, if they do.
    pub(crate) reflected: Option<R>,
}

/// Solids in a register of cells.
pub struct Covered<R> {
    /// `B`, and `1 - B`.
    pub(crate) open: R,
    pub(crate) solid: R,
    /// By how much the volumes of several bodies exceed the cell.
    pub(crate) overlap: R,
    /// `u_s`; anything where there is no solid.
    pub(crate) velocity: [R; 3],
}

impl<R> Covered<R> {
    /// Those of the register at cell `x`.
    ///
    /// # Safety
    /// The row has `WIDTH` cells from `x` on.
    #[inline(always)]
    pub(crate) unsafe fn load<T: Real, M: SolidModel>(solids: &SolidRow<T>, x: usize) -> Self
    where
        R: Lanes<T>,
    {
        // SAFETY: promised by the caller; the arrays hold a chunk more.
        let at = |values: &[T]| unsafe { R::load(values.as_ptr().add(x)) };
        let (one, fraction) = (R::splat(T::ONE), at(&solids.fraction));
        let overlap = if M::BY_VOLUME { (fraction - one).max(R::splat(T::ZERO)) } else { R::splat(T::ZERO) };
        let solid = fraction - overlap;
        let [x_velocity, y_velocity, z_velocity] = &solids.velocity;
        Self { open: one - solid, solid, overlap, velocity: [at(x_velocity), at(y_velocity), at(z_velocity)] }
    }
}
