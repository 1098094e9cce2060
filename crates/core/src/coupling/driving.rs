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
//! The first equals gravity `g / (1 - phi)`. A controller keeps the volume flux `<u>` of the mixture at its target `U`, 0 by default, in each
//! direction on its own. Where nothing but the fluid holds the bodies back, they move with the flux, and it adds `-k (<u> - U)`,
//! `k = max(u_Stokes / D, nu / D^2)`. Where bodies are held, or walls, the flux meets a force that is not known beforehand: of a resistance
//! `r` (1/s), and of a constant, by what moves. With the share `s` of the box on which the acceleration acts,
//!
//! ```text
//! d<u>/dt = s a - r (<u> - c)                                          c, unknown: of bodies and walls that move
//! <u> after an interval T between two measurements = A <u> + B a + (1 - A) c,     A = exp(-r T),  B = s (1 - A) / r
//! a_n = -(A / 2B) (<u>_n - U) + h_n,     h_n = h_(n-1) - ((1 - A) / 2B) (<u>_n - U)
//! ```
//!
//! With `r` no less than `1 / 4T`: the proportional part cancels the pole `A` of the bed, so that the error halves in each `T`, and the sum
//! `h` finds the force. `T` is [`CONTROL_INTERVAL`] steps. An error of 1 % of a step of the target or of `c` is reached in 144 steps for any
//! `r`, in 280 if `r` is known to a factor of three only; it is stable while the true one is above a quarter of it. Bodies that are held
//! have no part in `W` in the directions in which they are not free: what moves them bears their weight.
//!
//! References: Marquardt et al. (2024), section 4, and the force balance of its published driver; Rivera, Morari, Skogestad (1986),
//! doi:10.1021/i200032a041, for the controller that inverts the model.

use crate::math::{TimeFunction, Vec3};
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
#[derive(Clone, Debug)]
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
    /// The controller of the net flux in each direction, where it is on.
    pub control: [Option<Control>; 3],
    /// Further uniform acceleration of the fluid (m/s^2).
    pub body_acceleration: TimeFunction,
}

/// The controller of the net flux in a direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Control {
    /// Flux to be kept (m/s).
    pub target: f64,
    /// Resistance against it.
    pub resistance: Resistance,
}

/// Resistance against the net flux in a direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Resistance {
    /// Nothing for long: bodies follow it. With the rate (1/s) of the controller.
    None {
        /// Rate (1/s), as far as the sampling allows.
        rate: f64,
    },
    /// Bodies that are held, or walls.
    Held {
        /// Rate (1/s) at which they stop the flux.
        rate: f64,
        /// Part of the volume of the box that bodies have which are held.
        fraction: f64,
    },
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
    /// Acceleration that the controller has found against what is held (m/s^2).
    #[serde(default)]
    held: Vec3,
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
        *self = Self { held: self.held, first: step, ..Self::default() };
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
        let control = std::array::from_fn(|a| params.control[a].filter(|_| params.periodic[a]));
        let params = DrivingParams { control, ..params };
        let solid_fraction = params.particle_volume / params.volume;
        let mean = MeanFlow { solid_fraction, ..MeanFlow::default() };
        Self { params, mean, record: ControlRecord::default() }
    }

    /// Balances this submerged weight (N) of particles of this volume (m^3) from now on.
    pub fn carry(&mut self, submerged_weight: Vec3, particle_volume: f64) {
        (self.params.submerged_weight, self.params.particle_volume) = (submerged_weight, particle_volume);
    }

    /// Takes a measurement, after which the coming steps are controlled.
    pub fn measured(&mut self, mean: MeanFlow) {
        self.mean = mean;
        for axis in 0..3 {
            self.record.held[axis] -= self.gains(axis)[1] * self.excess(axis);
        }
    }

    /// Acceleration of the fluid (m/s^2) in the step after `step` steps, which is recorded.
    pub fn step(&mut self, step: u64) -> Vec3 {
        let control = self.control();
        self.record.sum += control;
        self.record.largest = self.record.largest.max(control.norm());
        self.acceleration(step)
    }

    /// Net flux over its target (m/s); 0 where it is not controlled.
    fn excess(&self, axis: usize) -> f64 {
        self.params.control[axis].map_or(0.0, |control| self.mean.velocity[axis] - control.target)
    }

    /// Accelerations over the excess of the flux (1/s): proportional to it, and added in each interval.
    fn gains(&self, axis: usize) -> [f64; 2] {
        let interval = CONTROL_INTERVAL as f64 * self.params.units.dt;
        match self.params.control[axis].map(|control| control.resistance) {
            None => [0.0; 2],
            // A sampled controller must stay well below its stability limit of 2 per interval.
            Some(Resistance::None { rate }) => [rate.min(0.25 / interval), 0.0],
            Some(Resistance::Held { rate, fraction }) => {
                let share = match self.params.balance {
                    ForceBalance::Mixture => 1.0 - fraction,
                    ForceBalance::FluidOnly => 1.0 - self.mean.solid_fraction,
                };
                let rate = rate.max(0.25 / interval);
                let settled = -libm::expm1(-rate * interval);
                let gain = 0.5 * rate / (settled * share);
                [(1.0 - settled) * gain, settled * gain]
            }
        }
    }

    /// Acceleration by the controller (m/s^2).
    fn control(&self) -> Vec3 {
        Vec3::from_fn(|axis, _| self.record.held[axis] - self.gains(axis)[0] * self.excess(axis))
    }

    /// Acceleration of the fluid (m/s^2) in the step after `step` steps.
    pub fn acceleration(&self, step: u64) -> Vec3 {
        let p = &self.params;
        let fluid = (1.0 - self.mean.solid_fraction) * p.volume;
        let carrier = match p.balance {
            ForceBalance::Mixture => fluid + p.particle_volume,
            ForceBalance::FluidOnly => fluid,
        };
        let drive = -p.submerged_weight / (p.units.density * carrier) + self.control();
        let [from, to] = [step, step + 1].map(|step| step as f64 * p.units.dt);
        let body = p.body_acceleration.mean(from, to);
        Vec3::from_fn(|a, _| body[a] + if p.periodic[a] { drive[a] } else { 0.0 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FREE: Option<Control> = Some(Control { target: 0.0, resistance: Resistance::None { rate: 50.0 } });

    fn params(balance: ForceBalance) -> DrivingParams {
        DrivingParams {
            units: Units { dx: 1e-4, dt: 1e-5, density: 1000.0 },
            volume: 1e-6,
            periodic: [true; 3],
            submerged_weight: Vec3::new(0.0, 0.0, -2e-3),
            particle_volume: 0.25e-6,
            balance,
            control: [FREE; 3],
            body_acceleration: TimeFunction::default(),
        }
    }

    fn flow(velocity: Vec3) -> MeanFlow {
        MeanFlow { velocity, solid_fraction: 0.25, ..MeanFlow::default() }
    }

    #[test]
    fn the_force_on_fluid_and_particles_balances_the_weight() {
        let fluid_only = Driving::new(params(ForceBalance::FluidOnly)).acceleration(0).z;
        assert!((fluid_only * 1000.0 * 0.75e-6 - 2e-3).abs() < 1e-15);
        let mixture = Driving::new(params(ForceBalance::Mixture)).acceleration(0).z;
        assert!((mixture * 1000.0 * (0.75e-6 + 0.25e-6) - 2e-3).abs() < 1e-15);
    }

    #[test]
    fn the_balances_differ_by_the_fluid_fraction() {
        let of = |balance| Driving::new(params(balance)).acceleration(0).z;
        assert!((of(ForceBalance::Mixture) / of(ForceBalance::FluidOnly) - 0.75).abs() < 1e-14);
    }

    #[test]
    fn a_net_flux_is_opposed_as_far_as_it_is_not_the_target() {
        let mut params = params(ForceBalance::Mixture);
        params.control[1].as_mut().unwrap().target = 0.3;
        let mut driving = Driving::new(params);
        let before = driving.acceleration(0);
        driving.measured(flow(Vec3::new(0.1, 0.3, -0.2)));
        assert!((driving.acceleration(8) - before - Vec3::new(-5.0, -15.0, 10.0)).norm() < 1e-12);
    }

    #[test]
    fn a_direction_without_a_controller_keeps_its_flux_beside_one_that_loses_it_and_both_enter_the_record() {
        let mut params = params(ForceBalance::Mixture);
        params.control[0] = None;
        let mut driving = Driving::new(params);
        let balance = driving.step(0);
        for speed in [-0.2, 0.1] {
            driving.measured(flow(Vec3::new(0.3, 0.0, speed)));
            let expected = balance - Vec3::new(0.0, 0.0, 50.0 * speed);
            assert!((driving.step(1) - expected).norm() < 1e-12);
        }
        let record = driving.record;
        assert!((record.largest - 10.0).abs() < 1e-12);
        assert!((record.mean(4) - Vec3::new(0.0, 0.0, 1.25)).norm() < 1e-12);
    }

    #[test]
    fn the_record_of_a_branch_is_of_its_own_steps_and_its_controller_continues() {
        let mut params = params(ForceBalance::Mixture);
        params.control[0] =
            Some(Control { target: 0.0, resistance: Resistance::Held { rate: 300.0, fraction: 0.2 } });
        let mut whole = Driving::new(params);
        whole.measured(flow(Vec3::new(0.3, 0.0, 0.2)));
        whole.step(0);
        let mut branch = whole.clone();
        branch.record.begin_anew(1);
        for driving in [&mut whole, &mut branch] {
            driving.measured(flow(Vec3::new(0.0, 0.0, -0.1)));
        }
        assert_eq!([branch.step(1), branch.step(2)], [whole.step(1), whole.step(2)]);
        let control = branch.control();
        assert!((branch.record.mean(3) - control).norm() < 1e-12 * control.norm());
        assert!((branch.record.largest - control.norm()).abs() < 1e-12 * control.norm());
    }

    /// Steps until the error of the flux stays below 1 %, of a bed of a true `resistance` (1/s) whose bodies move at `carried` (m/s).
    fn settling_steps(taken: f64, resistance: f64, carried: f64, target: f64) -> u64 {
        let taken = Resistance::Held { rate: taken, fraction: 0.25 };
        let mut params = params(ForceBalance::Mixture);
        params.submerged_weight = Vec3::zeros();
        params.control = [Some(Control { target, resistance: taken }), None, None];
        let (dt, mut driving, mut velocity, mut last) = (params.units.dt, Driving::new(params), 0.0, 0);
        for step in 0..100 * CONTROL_INTERVAL {
            let a = driving.step(step).x;
            // As in a sweep: measured before it, and known after it.
            if step.is_multiple_of(CONTROL_INTERVAL) {
                driving.measured(flow(Vec3::x() * velocity));
            }
            if f64::abs(velocity - target) > 0.01 * f64::abs(carried - target) {
                last = step;
            }
            // The exact solution of a step.
            let settled = -libm::expm1(-resistance * dt);
            velocity += settled * (0.75 * a / resistance + carried - velocity);
        }
        assert!((velocity - target).abs() < 1e-5, "{velocity}");
        last
    }

    #[test]
    fn the_flux_settles_in_the_stated_steps_against_any_resistance_and_no_force_leaves_an_error() {
        let (mut most, mut most_wrong) = (0, 0);
        // Viscous times of 0.03 to 3000 intervals.
        for resistance in [4.0, 400.0, 1.25e3, 4e3, 1.25e4, 4e4, 4e5] {
            for (carried, target) in [(0.4, 0.0), (0.0, -0.7)] {
                most = most.max(settling_steps(resistance, resistance, carried, target));
                for wrong in [1.0 / 3.0, 3.0] {
                    most_wrong =
                        most_wrong.max(settling_steps(wrong * resistance, resistance, carried, target));
                }
            }
        }
        assert!(most <= 144 && most_wrong <= 280, "{most} {most_wrong}");
    }

    #[test]
    fn a_closed_direction_is_neither_balanced_nor_controlled() {
        let mut driving = Driving::new(DrivingParams {
            periodic: [true, true, false],
            body_acceleration: Vec3::new(0.0, 0.0, 3.0).into(),
            ..params(ForceBalance::Mixture)
        });
        driving.measured(flow(Vec3::new(0.1, 0.0, -0.2)));
        assert!((driving.acceleration(0) - Vec3::new(-5.0, 0.0, 3.0)).norm() < 1e-12);
    }

    #[test]
    fn the_accelerations_of_all_steps_add_up_to_the_integral_of_one_that_varies() {
        let varying = TimeFunction::Oscillation {
            mean: Vec3::new(0.1, 0.0, 0.0),
            amplitude: Vec3::new(3.0, -1.0, 0.0),
            frequency: 4e3,
            phase: 0.4,
        };
        let driving = Driving::new(DrivingParams {
            submerged_weight: Vec3::zeros(),
            body_acceleration: varying.clone(),
            ..params(ForceBalance::Mixture)
        });
        let dt = driving.params.units.dt;
        let sum: Vec3 = (0..77).map(|step| driving.acceleration(step) * dt).sum();
        assert!((sum - varying.integral(0.0, 77.0 * dt)).norm() < 1e-15);
    }
}
