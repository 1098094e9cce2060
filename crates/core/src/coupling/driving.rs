//! Driving of the fluid: the force that balances the particles' weight, and the control of the net flux.
//!
//! In a periodic box nothing supports the suspension, so an upward acceleration `a` of the fluid replaces the mean
//! pressure gradient. With the total submerged weight `W = sum (rho_p - rho) V_p g` and the fluid fraction `<B>`:
//!
//! ```text
//! fluid only   rho a <B> V             = -W     all of it on the fluid (the reference paper's driver)
//! mixture      rho a (<B> V + sum V_p) = -W     the gradient acts on the particles as well, as in a closed vessel
//! ```
//!
//! The first equals gravity `g / (1 - phi)`. A proportional controller adds `-k <u>`, `k = max(u_Stokes / D, nu / D^2)`,
//! which removes the volume flux `<u>` of the mixture, in each direction on its own. A direction with walls at both ends
//! needs neither. Where the motion of bodies is prescribed their force on the fluid is not known beforehand, and `-k <u>`
//! would leave a flux of that force over `k`: there the controller is as fast as its sampling allows, `k = 1 / (32 dt)`,
//! and has an integral part `-(k^2 / 4) int <u> dt`, critically damped. Such bodies have no part in `W` in the directions
//! in which they are not free: what moves them bears their weight.
//!
//! Reference: Marquardt et al. (2024), section 4, and the force balance of its published driver.

use crate::math::Vec3;
use crate::units::Units;
use serde::{Deserialize, Serialize};

/// Region in which the force acts that balances the submerged weight of the particles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ForceBalance {
    /// The mean pressure gradient acts on fluid and particles alike, as in a closed vessel.
    #[default]
    Mixture,
    /// All of it on the fluid, as in the reference paper's driver; equals gravity `g / (1 - phi)`.
    FluidOnly,
}

/// Steps between two measurements of the flow: short against its time scales, long enough to cost nothing.
pub const CONTROL_INTERVAL: u64 = 8;

/// Parameters of the driving.
#[derive(Clone, Copy, Debug)]
pub struct DrivingParams {
    /// Cell size, time step, density.
    pub units: Units,
    /// Volume of the box without walls (m^3).
    pub volume: f64,
    /// Directions in which the weight is balanced and the net flux may be controlled.
    pub periodic: [bool; 3],
    /// Submerged weight of all particles in the directions in which forces move them (N).
    pub submerged_weight: Vec3,
    /// Volume of all particles (m^3).
    pub particle_volume: f64,
    /// Bodies on which the balancing force acts.
    pub balance: ForceBalance,
    /// Rate of the controller of the net flux in each direction (1/s), 0 for none.
    pub control_rate: Vec3,
    /// Directions in which the motion of bodies is prescribed: the controller, where it is on, is stiff there and has an
    /// integral part.
    pub prescribed: [bool; 3],
    /// Further uniform acceleration of the fluid (m/s^2).
    pub body_acceleration: Vec3,
}

/// Means over all cells that are not in walls, solid ones included; SI units.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MeanFlow {
    /// Mean velocity, the volume flux of the mixture (m/s).
    pub velocity: Vec3,
    /// Mean solid fraction as mapped, `1 - <B>`.
    pub solid_fraction: f64,
    /// Kinetic energy of the fluid in all cells (J).
    pub kinetic_energy: f64,
    /// Largest speed in the block of this rank alone (cells per time step).
    pub max_lattice_speed: f64,
}

/// Accelerations by the controller since the start of the run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ControlRecord {
    /// Sum over all steps of the run (m/s^2).
    sum: Vec3,
    /// Largest magnitude in a step (m/s^2).
    pub largest: f64,
    /// Integral of the mean velocity over time (m), in the directions in which the controller needs it.
    #[serde(default)]
    integral: Vec3,
    /// Steps done before the run.
    #[serde(default)]
    first: u64,
}

impl ControlRecord {
    /// Steps of the run, `step` of which are done together with those before it.
    pub fn steps(&self, step: u64) -> u64 {
        step.saturating_sub(self.first)
    }

    /// Mean over the [steps](Self::steps) of the run (m/s^2).
    pub fn mean(&self, step: u64) -> Vec3 {
        self.sum / self.steps(step).max(1) as f64
    }

    /// Begins a run after `step` steps. What the controller needs stays.
    pub fn begin_anew(&mut self, step: u64) {
        *self = Self { integral: self.integral, first: step, ..Self::default() };
    }
}

/// The acceleration of the fluid, constant between measurements.
#[derive(Clone, Debug)]
pub struct Driving {
    params: DrivingParams,
    /// The last measurement.
    pub mean: MeanFlow,
    /// The accelerations that the controller has added.
    pub record: ControlRecord,
}

impl Driving {
    /// Before the first measurement the box is taken to be at rest.
    pub fn new(params: DrivingParams) -> Self {
        // A sampled controller must stay well below its stability limit of 2 per interval.
        let limit = 0.25 / (CONTROL_INTERVAL as f64 * params.units.dt);
        let control_rate = Vec3::from_fn(|axis, _| {
            let rate = params.control_rate[axis];
            if params.prescribed[axis] && rate > 0.0 { limit } else { rate.min(limit) }
        });
        let params = DrivingParams { control_rate, ..params };
        let solid_fraction = params.particle_volume / params.volume;
        let mean = MeanFlow { solid_fraction, ..MeanFlow::default() };
        Self { params, mean, record: ControlRecord::default() }
    }

    /// Balances this submerged weight (N) of particles of this volume (m^3) from now on.
    pub fn carry(&mut self, submerged_weight: Vec3, particle_volume: f64) {
        (self.params.submerged_weight, self.params.particle_volume) = (submerged_weight, particle_volume);
    }

    /// Acceleration of the fluid (m/s^2) in the coming step, which is recorded.
    pub fn step(&mut self) -> Vec3 {
        for axis in (0..3).filter(|&axis| self.params.prescribed[axis]) {
            self.record.integral[axis] += self.mean.velocity[axis] * self.params.units.dt;
        }
        let control = self.control();
        self.record.sum += control;
        self.record.largest = self.record.largest.max(control.norm());
        self.acceleration()
    }

    /// Acceleration by the controller (m/s^2).
    fn control(&self) -> Vec3 {
        let p = &self.params;
        let rate = Vec3::from_fn(|a, _| if p.periodic[a] { p.control_rate[a] } else { 0.0 });
        let proportional = -rate.component_mul(&self.mean.velocity);
        let integral = &self.record.integral;
        Vec3::from_fn(|a, _| {
            let more = if p.prescribed[a] { 0.25 * rate[a] * rate[a] * integral[a] } else { 0.0 };
            proportional[a] - more
        })
    }

    /// Acceleration of the fluid (m/s^2).
    pub fn acceleration(&self) -> Vec3 {
        let p = &self.params;
        let fluid = (1.0 - self.mean.solid_fraction) * p.volume;
        let carrier = match p.balance {
            ForceBalance::Mixture => fluid + p.particle_volume,
            ForceBalance::FluidOnly => fluid,
        };
        let drive = -p.submerged_weight / (p.units.density * carrier) + self.control();
        Vec3::from_fn(|a, _| p.body_acceleration[a] + if p.periodic[a] { drive[a] } else { 0.0 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn params(balance: ForceBalance) -> DrivingParams {
        DrivingParams {
            units: Units { dx: 1e-4, dt: 1e-5, density: 1000.0 },
            volume: 1e-6,
            periodic: [true; 3],
            submerged_weight: Vec3::new(0.0, 0.0, -2e-3),
            particle_volume: 0.25e-6,
            balance,
            control_rate: Vec3::repeat(50.0),
            prescribed: [false; 3],
            body_acceleration: Vec3::zeros(),
        }
    }

    #[test]
    fn the_force_on_fluid_and_particles_balances_the_weight() {
        let fluid_only = Driving::new(params(ForceBalance::FluidOnly)).acceleration().z;
        assert!((fluid_only * 1000.0 * 0.75e-6 - 2e-3).abs() < 1e-15);
        let mixture = Driving::new(params(ForceBalance::Mixture)).acceleration().z;
        assert!((mixture * 1000.0 * (0.75e-6 + 0.25e-6) - 2e-3).abs() < 1e-15);
    }

    #[test]
    fn the_balances_differ_by_the_fluid_fraction() {
        let of = |balance| Driving::new(params(balance)).acceleration().z;
        assert!((of(ForceBalance::Mixture) / of(ForceBalance::FluidOnly) - 0.75).abs() < 1e-14);
    }

    #[test]
    fn a_net_flux_is_opposed() {
        let mut driving = Driving::new(params(ForceBalance::Mixture));
        let before = driving.acceleration();
        driving.mean =
            MeanFlow { velocity: Vec3::new(0.1, 0.0, -0.2), solid_fraction: 0.25, ..MeanFlow::default() };
        assert!((driving.acceleration() - before - Vec3::new(-5.0, 0.0, 10.0)).norm() < 1e-12);
    }

    #[test]
    fn a_direction_without_a_rate_keeps_its_flux_beside_one_that_loses_it_and_both_enter_the_record() {
        let mut driving = Driving::new(DrivingParams {
            control_rate: Vec3::new(0.0, 50.0, 50.0),
            ..params(ForceBalance::Mixture)
        });
        let balance = driving.step();
        for speed in [-0.2, 0.1] {
            driving.mean = MeanFlow {
                velocity: Vec3::new(0.3, 0.0, speed),
                solid_fraction: 0.25,
                ..MeanFlow::default()
            };
            let expected = balance - Vec3::new(0.0, 0.0, 50.0 * speed);
            assert!((driving.step() - expected).norm() < 1e-12);
        }
        let record = driving.record;
        assert!((record.largest - 10.0).abs() < 1e-12);
        assert!((record.mean(4) - Vec3::new(0.0, 0.0, 1.25)).norm() < 1e-12);
    }

    #[test]
    fn the_record_of_a_branch_is_of_its_own_steps_and_its_controller_continues() {
        let params = DrivingParams { prescribed: [true, false, false], ..params(ForceBalance::Mixture) };
        let mut whole = Driving::new(params);
        whole.mean.velocity = Vec3::new(0.3, 0.0, 0.2);
        whole.step();
        let mut branch = whole.clone();
        branch.record.begin_anew(1);
        for driving in [&mut whole, &mut branch] {
            driving.mean.velocity = Vec3::new(0.0, 0.0, -0.1);
        }
        assert_eq!([branch.step(), branch.step()], [whole.step(), whole.step()]);
        let control = branch.control();
        assert!((branch.record.mean(3) - control).norm() < 1e-12 * control.norm());
        assert!((branch.record.largest - control.norm()).abs() < 1e-12 * control.norm());
    }

    #[test]
    fn no_constant_force_leaves_a_flux_where_motion_is_prescribed() {
        let run = |prescribed: bool| {
            let mut driving = Driving::new(DrivingParams {
                prescribed: [prescribed, false, false],
                submerged_weight: Vec3::zeros(),
                ..params(ForceBalance::Mixture)
            });
            let (force, mut velocity) = (Vec3::new(3.0, 3.0, 0.0), Vec3::zeros());
            for step in 0..20_000_u64 {
                if step.is_multiple_of(CONTROL_INTERVAL) {
                    driving.mean.velocity = velocity;
                }
                velocity += (driving.step() + force) * driving.params.units.dt;
            }
            velocity
        };
        let (with, without) = (run(true), run(false));
        assert!(with.x.abs() < 1e-12, "{with}");
        assert!((without.x - 3.0 / 50.0).abs() < 1e-5 && (with.y - without.y).abs() < 1e-12, "{without}");
    }

    #[test]
    fn a_closed_direction_is_neither_balanced_nor_controlled() {
        let mut driving = Driving::new(DrivingParams {
            periodic: [true, true, false],
            body_acceleration: Vec3::new(0.0, 0.0, 3.0),
            ..params(ForceBalance::Mixture)
        });
        driving.mean = MeanFlow { velocity: Vec3::new(0.1, 0.0, -0.2), ..MeanFlow::default() };
        assert!((driving.acceleration() - Vec3::new(-5.0, 0.0, 3.0)).norm() < 1e-12);
    }
}
