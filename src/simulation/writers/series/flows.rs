//! Flows of which a run measures the resistance: between plates that pass each other, and through fixed bodies.
//!
//! ```text
//! relative viscosity   (tau_1 - tau_2) . e / (2 rho nu G)     stresses on two plates, shear rate G along e
//! drag over Stokes     F / (sum 3 pi rho nu D U)              drag F along the flow, superficial velocity U, all bodies
//! permeability         nu U / a                               Darcy's law; the mean pressure gradient is rho a
//! ```
//!
//! `D` is the diameter of the sphere of equal volume. With the force balance "mixture" `F` holds the force of the mean pressure gradient
//! on the bodies, as in Zick and Homsy (1982), doi:10.1017/S0022112082000627; without, as in van der Hoef, Beetstra and Kuipers (2005),
//! doi:10.1017/S0022112004003295, it is smaller by the factor `1 - phi`.

use super::Samples;
use crate::case::Setup;
use crate::math::Vec3;
use crate::output::series::{DRAG, LOADS, PLANE_COLUMNS};
use crate::output::{Estimate, SeriesRow, Summary, estimate_mean, estimate_ratio};
use crate::particle::PrescribedMotion;
use crate::wall::{Surface, Wall};
use std::f64::consts::PI;

/// Two parallel plates that face and pass each other, the only walls of a case.
pub(super) struct Plates {
    /// Direction in which the second one moves as seen from the first.
    along: Vec3,
    /// Shear rate (1/s).
    rate: f64,
    /// Stress of the fluid alone, viscosity times shear rate (Pa).
    plain: f64,
}

impl Plates {
    /// Those of a case, if its walls are such plates.
    pub(super) fn of(setup: &Setup) -> Option<Self> {
        let [first, second] = &setup.walls[..] else {
            return None;
        };
        let (Surface::Plane { point: a, normal: up }, Surface::Plane { point: b, normal: down }) =
            (&first.surface, &second.surface)
        else {
            return None;
        };
        if !setup.domain.faces.iter().all(|face| face.is_plain()) {
            return None;
        }
        let turns = |wall: &Wall| !wall.motion.angular_velocity.is_zero();
        let passes = second.motion.velocity.constant()? - first.motion.velocity.constant()?;
        let along = passes.try_normalize(0.0)?;
        let gap = (b - a).dot(up);
        let parallel = (up + down).norm() < 1e-9 && gap > 0.0;
        let fluid = setup.fluid.as_ref()?;
        let rate = passes.norm() / gap;
        (parallel && !turns(first) && !turns(second)).then_some(Self {
            along,
            rate,
            plain: fluid.density * fluid.viscosity * rate,
        })
    }

    /// Mean shear stress on both plates over that of the fluid alone: what drives the fluid along the plates drops out. Nothing if
    /// the engine does not tell its contacts.
    pub(super) fn relative_viscosity(&self, row: &SeriesRow) -> Option<f64> {
        // Of the vectors of each plate the stress is the last one.
        let stress = |wall: usize| row.walls[PLANE_COLUMNS * (wall + 1) - 1].map(Vec3::from);
        Some(0.5 * (stress(0)? - stress(1)?).dot(&self.along) / self.plain)
    }

    /// Strain in some time (s).
    pub(super) fn strain(&self, time: f64) -> f64 {
        self.rate * time
    }

    /// Adds rate and Reynolds number of the shear at the end of a run.
    pub(super) fn finish(&self, setup: &Setup, summary: &mut Summary) {
        summary.shear_rate = Some(self.rate);
        let squared = setup.diameter * setup.diameter;
        summary.shear_reynolds = Some(self.rate * squared / setup.expect_fluid().viscosity);
    }
}

/// Fixed bodies, the only ones of a case, and a flow that a body acceleration or the controller of the net flux drives through them.
pub(super) struct Bed {
    along: Vec3,
    /// Acceleration of the fluid (m/s^2); 0 where the net flux is kept instead.
    acceleration: f64,
    viscosity: f64,
    /// Stokes drag of all bodies over the velocity (kg/s).
    stokes: f64,
}

impl Bed {
    /// That of a case, if it has one.
    pub(super) fn of(setup: &Setup) -> Option<Self> {
        let fluid = setup.fluid.as_ref()?;
        let fixed = |motion: &PrescribedMotion| *motion == PrescribedMotion::fixed();
        if setup.start_count() == 0 || !setup.motions.iter().all(fixed) {
            return None;
        }
        let acceleration = fluid.body_acceleration.constant()?;
        let drive = Vec3::from_fn(|a, _| if setup.domain.is_periodic(a) { acceleration[a] } else { 0.0 });
        let flux = Vec3::from(fluid.net_flux.map(Option::unwrap_or_default));
        Some(Self {
            along: drive.try_normalize(0.0).or_else(|| flux.try_normalize(0.0))?,
            acceleration: drive.norm(),
            viscosity: fluid.viscosity,
            stokes: 3.0 * PI * fluid.density * fluid.viscosity * setup.totals().diameters,
        })
    }

    /// Superficial velocity (m/s) and drag on all bodies (N) along the flow.
    pub(super) fn sample(&self, row: &SeriesRow) -> [f64; 2] {
        let sections = row.prescribed.chunks_exact(3 * LOADS.len());
        let drag: Vec3 = sections.map(|section| Vec3::from_column_slice(&section[3 * DRAG..][..3])).sum();
        [Vec3::from(row.net_flux).dot(&self.along), drag.dot(&self.along)]
    }

    /// Adds the means from the sample `first` on; returns the velocities that they are of.
    pub(super) fn finish(&self, samples: &Samples, first: usize, summary: &mut Summary) -> Vec<f64> {
        let column = |n: usize| -> Vec<f64> {
            samples.bed.get(first..).unwrap_or(&[]).iter().map(|sample| sample[n]).collect()
        };
        let [velocity, drag] = [0, 1].map(column);
        let scaled = |estimate: Option<Estimate>, factor: f64| {
            let finite = |x: &f64| x.is_finite();
            (
                estimate.map(|e| factor * e.mean).filter(finite),
                estimate.and_then(|e| e.standard_error).map(|error| factor * error).filter(finite),
            )
        };
        let speed = estimate_mean(&velocity);
        let ratio = estimate_ratio(&drag, &velocity);
        (summary.superficial_velocity, summary.superficial_velocity_standard_error) = scaled(speed, 1.0);
        (summary.drag, summary.drag_standard_error) = scaled(estimate_mean(&drag), 1.0);
        (summary.drag_over_stokes, summary.drag_over_stokes_standard_error) =
            scaled(ratio, 1.0 / self.stokes);
        (summary.permeability, summary.permeability_standard_error) =
            scaled(speed, self.viscosity / self.acceleration);
        velocity
    }
}
