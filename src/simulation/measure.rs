//! Measurements of the whole box: mean flow, stress of the particles, force of the fluid on walls.

use super::observe::to_owners;
use super::{FluidSystem, Simulation};
use crate::coupling::MeanFlow;
use crate::dem::Load;
use crate::fluid::Flow;
use crate::math::{Vec3, from_fixed_wide, join_wide, split_wide};
use crate::units::Units;

/// The flow as the last step has left it, with all forces of that step and none of the coming one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Measurement {
    /// Mean values over the box.
    pub mean: MeanFlow,
    /// Stresslet of all particles together in the coming step (N m): `xx`, `yy`, `zz`, `xy`, `xz`, `yz`.
    pub stresslet: [f64; 6],
}

/// Words of the sums of a [`Flow`].
pub(super) const WORDS: usize = 10;

/// The sums of a measurement, to be added up over all ranks.
pub(super) fn words(flow: &Flow) -> Vec<i64> {
    let [x, y, z] = flow.momentum;
    [x, y, z, flow.square, flow.solid].into_iter().flat_map(split_wide).collect()
}

/// The numbers that pairs of added-up words stand for.
fn numbers<const N: usize>(words: &[i64]) -> [f64; N] {
    std::array::from_fn(|i| from_fixed_wide(join_wide([words[2 * i], words[2 * i + 1]])))
}

impl Simulation {
    /// Mean values from the added-up [`words`] of all ranks.
    pub(super) fn mean_of(&self, words: &[i64], max_lattice_speed: f64) -> MeanFlow {
        let sums: [f64; 5] = numbers(words);
        let cells = self.system.as_ref().map_or(1.0, |system| system.cells);
        let Units { dx, density, .. } = self.units;
        let velocity = self.units.velocity();
        MeanFlow {
            velocity: Vec3::new(sums[0], sums[1], sums[2]) / cells * velocity,
            solid_fraction: sums[4] / cells,
            kinetic_energy: 0.5 * density * (dx * dx * dx) * sums[3] * velocity * velocity,
            max_lattice_speed,
        }
    }

    /// Measures the fluid as it is now; the controller of the net flux does not see it. A cell that is too fast becomes a failure
    /// of this rank. Zeros without a fluid. Collective.
    ///
    /// ```
    /// # let mut simulation = turbid::Builder::example().build()?;
    /// simulation.advance(8)?;
    /// let flow = simulation.measure().mean;
    /// let volume_fraction = std::f64::consts::PI / 6.0 / 64.0;
    /// // The surface lies where the fluid feels it, here a twenty-fifth of a cell outside of the body (4 cells across).
    /// assert!((flow.solid_fraction / volume_fraction - 1.0).abs() < 0.1);
    /// # Ok::<(), turbid::Error>(())
    /// ```
    pub fn measure(&mut self) -> Measurement {
        let acceleration = self.lattice_acceleration();
        let Some(FluidSystem { fluid, coupling, .. }) = &mut self.system else {
            return Measurement::default();
        };
        let particles = self.dem.particles();
        coupling.map(particles);
        let (flow, stresslets) = fluid.measure(acceleration, coupling);
        let mut words = words(&flow);
        let sum = |n: usize| stresslets.iter().map(|(_, stresslet)| stresslet[n]).sum();
        words.extend((0..6).flat_map(|n| split_wide(sum(n))));
        self.note_fault(flow.fault);
        self.comm.sum(&mut words);
        let sums: [f64; 6] = numbers(&words[WORDS..]);
        Measurement {
            mean: self.mean_of(&words, flow.max_speed),
            stresslet: sums.map(|sum| sum * self.units.torque()),
        }
    }

    /// Stresslet (N m) of each particle of this rank in the coming step, in their order: `xx`, `yy`, `zz`, `xy`, `xz`, `yz`; zeros without
    /// a fluid. Collective.
    pub(super) fn stresslets(&mut self) -> Vec<[f64; 6]> {
        let acceleration = self.lattice_acceleration();
        let Some(FluidSystem { fluid, coupling, .. }) = &mut self.system else {
            return vec![[0.0; 6]; self.particles().len()];
        };
        coupling.map(self.dem.particles());
        let (flow, stresslets) = fluid.measure(acceleration, coupling);
        self.note_fault(flow.fault);
        let mut sums = vec![[0_i128; 6]; self.particles().len()];
        for (at, stresslet) in to_owners(self, &self.cut, stresslets.into_iter()) {
            (0..6).for_each(|n| sums[at][n] += stresslet[n]);
        }
        sums.into_iter().map(|sums| sums.map(|sum| from_fixed_wide(sum) * self.units.torque())).collect()
    }

    /// Force (N) of the fluid on each wall in the last step, and torque (N m) about the pivot of its motion, without the pressure
    /// of the fluid at rest, which the lattice does not hold; at inlets and outlets the momentum that leaves there with the fluid counts as
    /// force. Zeros without a fluid. Collective.
    pub fn wall_loads(&self) -> Vec<Load> {
        self.wall_exchange().into_iter().map(|(load, _)| load).collect()
    }

    /// Mass flow (kg/s) of the fluid that came in through each wall in the last step, which is not zero at inlets and outlets, negative
    /// where it left. Zeros without a fluid. Collective.
    pub fn mass_flows(&self) -> Vec<f64> {
        self.wall_exchange().into_iter().map(|(_, flow)| flow).collect()
    }

    /// [`wall_loads`](Self::wall_loads) and [`mass_flows`](Self::mass_flows). Collective.
    pub(super) fn wall_exchange(&self) -> Vec<(Load, f64)> {
        let Some(system) = &self.system else {
            return vec![(Load::default(), 0.0); self.walls.len()];
        };
        let mut words: Vec<i64> = system
            .fluid
            .wall_loads()
            .iter()
            .flat_map(|load| [load.force, load.torque].into_iter().flatten().chain([load.mass]))
            .flat_map(split_wide)
            .collect();
        self.comm.sum(&mut words);
        let Units { dx, dt, density } = self.units;
        let mass_flow = density * (dx * dx * dx) / dt;
        words
            .chunks_exact(14)
            .map(|w| {
                let load = Load {
                    force: Vec3::from(numbers(&w[..6])) * self.units.force(),
                    torque: Vec3::from(numbers(&w[6..12])) * self.units.torque(),
                };
                let [mass]: [f64; 1] = numbers(&w[12..]);
                (load, mass * mass_flow)
            })
            .collect()
    }
}
