//! Conversion between lattice units and SI units, which is done only here.
//!
//! With cell size `dx` (m), time step `dt` (s) and reference density `rho` (kg/m^3):
//!
//! ```text
//! velocity      u  = u_lat  dx / dt             acceleration  a = a_lat dx / dt^2
//! viscosity     nu = nu_lat dx^2 / dt           pressure      p = (rho_lat - 1) / 3  rho dx^2 / dt^2
//! force         F  = F_lat  rho dx^4 / dt^2     torque        T = T_lat rho dx^5 / dt^2
//! ```

/// Cell size, time step and density that give lattice numbers a dimension.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Units {
    /// Edge of a cell (m).
    pub dx: f64,
    /// Fluid time step (s).
    pub dt: f64,
    /// Reference density of the fluid (kg/m^3).
    pub density: f64,
}

impl Units {
    /// From the relaxation time: `dt = (tau - 1/2) / 3 * dx^2 / nu`, viscosity `nu` in m^2/s.
    pub fn from_relaxation_time(dx: f64, relaxation_time: f64, viscosity: f64, density: f64) -> Self {
        Self { dx, dt: (relaxation_time - 0.5) / 3.0 * dx * dx / viscosity, density }
    }

    /// Relaxation time (time steps) that gives the kinematic viscosity `viscosity` (m^2/s).
    pub fn relaxation_time(&self, viscosity: f64) -> f64 {
        0.5 + 3.0 * viscosity * self.dt / (self.dx * self.dx)
    }

    /// One lattice unit of velocity (m/s).
    pub fn velocity(&self) -> f64 {
        self.dx / self.dt
    }

    /// One lattice unit of acceleration (m/s^2).
    pub fn acceleration(&self) -> f64 {
        self.dx / (self.dt * self.dt)
    }

    /// One lattice unit of force (N).
    pub fn force(&self) -> f64 {
        let area = self.dx * self.dx;
        self.density * (area * area) / (self.dt * self.dt)
    }

    /// One lattice unit of torque (N m).
    pub fn torque(&self) -> f64 {
        self.force() * self.dx
    }

    /// Pressure (Pa) per unit of `rho_lat - 1`.
    pub fn pressure(&self) -> f64 {
        let speed = self.dx / self.dt;
        self.density * (speed * speed) / 3.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn relaxation_time_and_viscosity_round_trip() {
        let units = Units::from_relaxation_time(1e-4, 0.55, 8.7e-6, 1000.0);
        assert!((units.relaxation_time(8.7e-6) - 0.55).abs() < 1e-14);
    }

    #[test]
    fn the_reynolds_number_is_the_same_in_both_units() {
        let (length, speed, viscosity) = (1.5e-3, 0.1, 8.7e-6);
        let units = Units::from_relaxation_time(1e-4, 0.55, viscosity, 1000.0);
        let lattice = (length / units.dx) * (speed / units.velocity()) / ((0.55 - 0.5) / 3.0);
        assert!((lattice / (length * speed / viscosity) - 1.0).abs() < 1e-12);
    }
}
