//! A sweep of a block and what completes it, by the processor or by a device: the one place that tells them apart.

use super::device::DeviceSweep;
use super::device::options;
use super::kernel::{OneTime, Operator, TwoTimes};
use super::{
    BlockSolids, Collision, CoverCount, Flow, FlowRow, Fluid, Population, SolidModel, Sweep, WallMotion,
    dispatch,
};
use crate::comm::Comm;
use crate::device::{Device, KernelCost};
use crate::error::{Error, Result};
use crate::lattice::{C, Q};
use std::fmt;

/// Sweeper of a block.
pub(super) enum SweepDevice<S> {
    /// The processor, by the kernels of [`dispatch`].
    Host,
    /// A device, by `device/kernels.cl`.
    Device(Box<DeviceSweep<S>>),
}

/// Measurements of the cells before it that a sweep is asked for.
#[derive(Default)]
pub struct Asked<'a> {
    /// Their [`Flow`].
    pub flow: bool,
    /// Gets each row of cells, but those wholly in walls, in any order; not from a device.
    pub rows: Option<&'a mut dyn FnMut(&FlowRow)>,
}

impl From<bool> for Asked<'_> {
    fn from(flow: bool) -> Self {
        Self { flow, rows: None }
    }
}

impl fmt::Debug for Asked<'_> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.debug_struct("Asked").field("flow", &self.flow).field("rows", &self.rows.is_some()).finish()
    }
}

impl<S: Population> Fluid<S> {
    /// Computes this fluid on a device from now on, with cells covered as a method says.
    ///
    /// # Errors
    /// [`Error::Input`] if the device has not the memory, [`Error::Kernels`] if its compiler refuses the kernels.
    pub fn use_device<M: SolidModel>(&mut self, device: &Device, model: M) -> Result<()> {
        self.assert_collides::<M>();
        let options = match self.params.collision {
            Collision::RecursiveRegularised { .. } => options::<S, M, M::Regularised>(model),
            Collision::Bgk if !M::PAIRS => options::<S, M, OneTime>(model),
            Collision::Bgk | Collision::Trt { .. } => options::<S, M, TwoTimes>(model),
        };
        self.device = SweepDevice::Device(Box::new(DeviceSweep::new(device, &options, self)?));
        Ok(())
    }

    /// Lets blocks that are on one device exchange populations there, if their ranks are threads of one process; else they go through the
    /// host. Collective.
    ///
    /// # Errors
    /// [`Error::Memory`] on a rank that has no room; then no rank may go on.
    pub fn connect_on_device(&mut self, comm: &Comm) -> Result<()> {
        match &mut self.device {
            SweepDevice::Host => Ok(()),
            SweepDevice::Device(device) => device.connect(comm),
        }
    }

    /// Bytes to and from the device in the last sweep, without messages to other ranks and copies for output; none without a device.
    pub fn device_traffic(&self) -> Option<u64> {
        match &self.device {
            SweepDevice::Host => None,
            SweepDevice::Device(device) => Some(device.transferred),
        }
    }

    /// Costs of the kernels of the device since they are timed; times them from now on or no longer. None without a device.
    pub fn time_kernels(&self, from_now_on: bool) -> Vec<KernelCost> {
        match &self.device {
            SweepDevice::Host => Vec::new(),
            SweepDevice::Device(device) => device.time_kernels(from_now_on),
        }
    }

    /// A failure of the device since the last call.
    pub fn take_failure(&mut self) -> Option<Error> {
        match &self.device {
            SweepDevice::Host => None,
            SweepDevice::Device(device) => device.take_failure(),
        }
    }

    /// Collides and streams all cells of the block under a uniform acceleration of the fluid, in place.
    ///
    /// The bodies of `solids` get the momentum that their cells exchange. On return, populations are being sent to the
    /// neighbouring blocks, and the ghosts are stale until [`exchange`](Self::exchange). Also returns the measurements of the cells
    /// before the sweep that are asked for. Collective.
    ///
    /// # Panics
    /// If the method has no [`Collision::RecursiveRegularised`] and the fluid has, or if a device is asked for rows.
    pub fn sweep<'a, M: SolidModel>(
        &mut self,
        acceleration: [f64; 3],
        solids: &mut BlockSolids<M>,
        asked: impl Into<Asked<'a>>,
    ) -> Option<Flow> {
        self.assert_collides::<M>();
        let mut asked = asked.into();
        let (mut flow, entered) = (asked.flow.then(Flow::default), self.phase.next());
        self.solid_row.count = CoverCount::default();
        let row = dispatch::parameters_of(self, acceleration);
        match &mut self.device {
            SweepDevice::Device(device) => {
                assert!(asked.rows.is_none(), "rows of a sweep on a processor");
                let images = solids.images.expect("the images of bodies for a device");
                flow =
                    device.sweep(&mut self.populations, self.phase, row, images, solids.bodies, asked.flow);
            }
            SweepDevice::Host => {
                if self.order.has_first() {
                    self.sweep_part(true, acceleration, solids, flow.as_mut(), &mut asked);
                    self.halo.early.start(&self.populations, entered);
                }
                self.sweep_part(false, acceleration, solids, flow.as_mut(), &mut asked);
                self.halo.late.start(&self.populations, entered);
            }
        }
        self.phase = entered;
        flow
    }

    /// Cells that bodies covered in the last sweep of the processor.
    pub(crate) fn cover_count(&self) -> CoverCount {
        self.solid_row.count
    }

    /// Panics if cells without solids would collide otherwise than it was asked for.
    fn assert_collides<M: SolidModel>(&self) {
        let regularised = matches!(self.params.collision, Collision::RecursiveRegularised { .. });
        assert!(
            !regularised || M::Regularised::REGULARISED,
            "a coupling that has the collision of the fluid"
        );
    }

    fn sweep_part<M: SolidModel>(
        &mut self,
        first: bool,
        acceleration: [f64; 3],
        solids: &mut BlockSolids<M>,
        flow: Option<&mut Flow>,
        asked: &mut Asked,
    ) {
        // Compiled apart, so that boxes without walls and cells with one relaxation time pay for neither; for the regularised collision
        // once, which takes longer than to ask for walls.
        let (collision, walls) = (self.params.collision, !self.walls.is_empty());
        let rows = asked.rows.as_mut().map(|visit| &mut **visit as &mut dyn FnMut(&FlowRow));
        let sweep = Sweep { fluid: self, first, acceleration, solids, flow, rows };
        match (collision, walls) {
            (Collision::RecursiveRegularised { .. }, _) => S::sweep::<M, M::Regularised, true>(sweep),
            (Collision::Bgk, true) if !M::PAIRS => S::sweep::<M, OneTime, true>(sweep),
            (Collision::Bgk, false) if !M::PAIRS => S::sweep::<M, OneTime, false>(sweep),
            (_, true) => S::sweep::<M, TwoTimes, true>(sweep),
            (_, false) => S::sweep::<M, TwoTimes, false>(sweep),
        }
    }

    /// Completes a sweep: populations arrive from the neighbouring blocks, and walls send them back. Collective.
    pub fn exchange(&mut self) {
        match &mut self.device {
            SweepDevice::Device(device) => {
                device.exchange(&mut self.populations, &mut self.halo, self.phase);
            }
            SweepDevice::Host => {
                self.halo.exchange(&mut self.populations, self.phase);
                self.walls.bounce_late(self.phase, &mut self.populations, false);
            }
        }
    }

    /// Gives the walls that vary their motion in the coming step.
    pub fn move_walls(&mut self, motions: &[WallMotion]) {
        self.walls.set_motions(&self.layout, motions);
        if let SweepDevice::Device(device) = &mut self.device {
            let densities = self.walls.outlet_densities();
            device.move_walls(self.walls.links(&self.layout), &self.walls.cells(), &densities);
        }
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
            let g = self.populations[self.walls.left(self.left(cell, i))].wide();
            for axis in 0..3 {
                sum[axis] += C[i][axis] as f64 * g;
            }
            sum[3] += g;
        }
        sum
    }

    /// [`departed`](Self::departed) of some cells; a device is asked for all at once.
    pub(crate) fn departed_from(&mut self, cells: &[[usize; 3]]) -> Vec<[f64; 4]> {
        let SweepDevice::Device(device) = &mut self.device else {
            return cells.iter().map(|&cell| self.departed(cell)).collect();
        };
        let slot = |&[x, y, z]: &[usize; 3]| self.layout.cell(x as isize, y as isize, z as isize) as u64;
        let slots: Vec<u64> = cells.iter().map(slot).collect();
        let mut sums = device.departed(&mut self.populations, self.phase, &slots);
        for (sum, _) in sums.iter_mut().zip(cells).filter(|(_, cell)| self.walls.of(**cell).is_some()) {
            *sum = [0.0; 4];
        }
        sums
    }
}
