//! Dimensionless numbers and reference velocities of settling.

use super::Scales;

/// Reynolds number beyond which the drag coefficient of a sphere is taken as constant (-).
const NEWTON_REYNOLDS: f64 = 1000.0;
/// That constant (-).
const NEWTON_DRAG: f64 = 0.44;

/// Quantities from which the scales follow.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reference {
    /// Diameter of the sphere of equal volume (m).
    pub(super) diameter: f64,
    /// Particle density over fluid density (-).
    pub(super) density_ratio: f64,
    /// Magnitude of gravity (m/s^2).
    pub(super) gravity: f64,
}

impl Reference {
    /// `g |s - 1| D^3` (m^4/s^2), the Archimedes number times the viscosity squared.
    pub(super) fn buoyancy(&self) -> f64 {
        let cube = self.diameter * self.diameter * self.diameter;
        self.gravity * (self.density_ratio - 1.0).abs() * cube
    }

    /// The scales in a fluid of kinematic viscosity `viscosity` (m^2/s).
    pub(super) fn scales(&self, viscosity: f64) -> Scales {
        let archimedes = self.buoyancy() / (viscosity * viscosity);
        let stokes_velocity = archimedes / 18.0 * viscosity / self.diameter;
        let reynolds = schiller_naumann_reynolds(archimedes);
        Scales {
            density_ratio: self.density_ratio,
            archimedes,
            stokes_velocity,
            stokes_time: self.diameter / stokes_velocity,
            schiller_naumann_velocity: reynolds * viscosity / self.diameter,
            schiller_naumann_reynolds: reynolds,
        }
    }
}

/// Reynolds number of one sphere at its terminal velocity, from its Archimedes number.
///
/// Drag balances weight, `Re (1 + 0.15 Re^0.687) = Ar / 18`; beyond a Reynolds number of 1000 the drag coefficient
/// is 0.44, hence `Re^2 = 4 Ar / (3 0.44)`.
///
/// # Reference
/// Schiller & Naumann (1933).
fn schiller_naumann_reynolds(archimedes: f64) -> f64 {
    let weight = archimedes / 18.0;
    let drag = |re: f64| re * (1.0 + 0.15 * libm::pow(re, 0.687));
    if weight <= 0.0 {
        return 0.0;
    }
    if drag(NEWTON_REYNOLDS) < weight {
        return (4.0 * archimedes / (3.0 * NEWTON_DRAG)).sqrt().max(NEWTON_REYNOLDS);
    }
    // The Stokes value is an upper bound; the drag is convex, so Newton's method descends to the root from there.
    let mut re = weight.min(NEWTON_REYNOLDS);
    for _ in 0..50 {
        let slope = 1.0 + 0.15 * 1.687 * libm::pow(re, 0.687);
        let step = (drag(re) - weight) / slope;
        re -= step;
        if step.abs() <= 1e-15 * re {
            break;
        }
    }
    re
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn terminal_velocities_are_those_of_the_reference_table() {
        let particle = Reference { diameter: 1.5e-3, density_ratio: 3.3, gravity: 9.80665 };
        for (archimedes, reynolds, velocity, stokes_velocity) in [
            (21.0, 1.01329, 0.040_671_8, 0.046_828_2),
            (500.0, 14.3536, 0.118_072, 0.228_498),
            (1000.0, 23.8775, 0.138_886, 0.323_145),
            (2000.0, 38.9108, 0.160_039, 0.456_996),
            (14641.0, 145.476, 0.221_144, 1.236_47),
        ] {
            let viscosity = (particle.buoyancy() / archimedes).sqrt();
            let scales = particle.scales(viscosity);
            let close = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 4e-6, "{a} is not {b}");
            close(scales.archimedes, archimedes);
            close(scales.schiller_naumann_reynolds, reynolds);
            close(scales.schiller_naumann_velocity, velocity);
            close(scales.stokes_velocity, stokes_velocity);
        }
    }

    #[test]
    fn heavy_particles_follow_newtons_drag_and_weightless_ones_rest() {
        let re = schiller_naumann_reynolds(4e7);
        assert!((re - (4e7 * 4.0 / 1.32_f64).sqrt()).abs() < 1e-9 * re);
        assert!(schiller_naumann_reynolds(0.0) == 0.0);
    }
}
