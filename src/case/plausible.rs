//! What cannot work although every number by itself is admissible: velocities that the lattice cannot follow, units that were
//! mixed up, particles too light for the coupling. Refused or warned of with the place in the case.

use super::Setup;
use super::checks::Document;
use super::file::{Case, FluidSection, LatticeSection};
use super::speeds::wall_speed;
use crate::error::Result;
use crate::particle::Template;
use std::collections::BTreeSet;
use std::fmt;
use std::ops::RangeInclusive;

/// Speed on the lattice (cells per step) above which a case is refused: the scheme becomes unstable near 0.4.
const LARGEST_SPEED: f64 = 0.3;
/// Largest usual speed on the lattice (cells per step): compressibility errors grow with its square.
const USUAL_SPEED: f64 = 0.1;
/// Least relaxation time, and most cells per diameter, that are suggested to anybody.
const SUGGESTED: (f64, f64) = (0.51, 60.0);
/// Dynamic viscosity of water from 15 to 25 degrees centigrade (Pa s).
const WATER_DYNAMIC: RangeInclusive<f64> = 0.88e-3..=1.14e-3;
/// Density ratio below which the coupling is unstable, times the cells across a body: measured for spheres, cubes, ellipsoids and
/// flat cylinders, 4 to 12 cells per diameter, relaxation times 0.53 to 1, both couplings. It is 1.8 at a relaxation time of 1,
/// less below.
const UNSTABLE_RATIO_CELLS: f64 = 2.0;

/// The case that a [`Setup`] comes from.
pub(super) struct Written<'a> {
    pub(super) document: &'a Document<'a>,
    pub(super) case: &'a Case,
    pub(super) fluid: &'a FluidSection,
    pub(super) lattice: &'a LatticeSection,
    /// Templates of which there are particles.
    pub(super) present: BTreeSet<usize>,
    /// The key of each wall.
    pub(super) walls: Vec<String>,
}

/// A velocity of the case: its name, its value (m/s), the key that decides it, and what may be wrong with that.
struct Velocity {
    name: String,
    speed: f64,
    key: String,
    doubt: Option<String>,
}

/// Particles that are too light for the explicit coupling.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TooLight {
    template: usize,
    /// Density over that of the fluid (-).
    ratio: f64,
    /// From which on the coupling is stable (-).
    limit: f64,
}

impl fmt::Display for TooLight {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(
            f,
            "particles of {:.3} times the density of the fluid are too light for the explicit coupling, which becomes unstable \
             below about {:.2} at this resolution: the added mass of the fluid round them outweighs them",
            self.ratio, self.limit
        )
    }
}

impl Setup {
    /// The particles that are furthest below the density that the coupling needs, if there are any.
    ///
    /// The cells across a body are the geometric mean of its thickness and its diameter.
    pub fn too_light(&self) -> Option<TooLight> {
        let fluid = self.fluid.as_ref()?;
        let of = |template: usize| {
            let Template { shape, density, .. } = &self.templates[template];
            let across = (shape.thickness() * shape.equivalent_diameter()).sqrt() / self.domain.dx;
            TooLight { template, ratio: density / fluid.density, limit: UNSTABLE_RATIO_CELLS / across }
        };
        (self.particles.iter())
            .map(|particle| of(particle.template as usize))
            .filter(|light| light.ratio < light.limit)
            .min_by(|a, b| (a.ratio / a.limit).total_cmp(&(b.ratio / b.limit)))
    }
}

impl Written<'_> {
    /// Refuses a case that cannot work; what it should be warned of.
    pub(super) fn judge(&self, setup: &Setup) -> Result<Vec<String>> {
        let mut warnings: Vec<String> =
            self.dynamic_viscosity(setup).into_iter().chain(self.light(setup)).collect();
        for Velocity { name, speed, key, doubt } in self.velocities(setup) {
            let lattice = speed / setup.units().velocity();
            if lattice > LARGEST_SPEED {
                let remedy = doubt.unwrap_or_else(|| self.slower(setup, lattice));
                let title = format!(
                    "{name} is {speed:.4e} m/s or {lattice:.3} cells per time step, above {LARGEST_SPEED}, which the lattice \
                     cannot follow"
                );
                return Err(self.document.error(&key, &title, "too fast", &remedy));
            }
            if lattice > USUAL_SPEED {
                let title = format!(
                    "{name} is {speed:.4e} m/s or {lattice:.3} cells per time step, above {USUAL_SPEED}, where the fluid \
                     becomes compressible"
                );
                warnings.push(self.document.warning(&key, &title, "fast", &self.slower(setup, lattice)));
            }
        }
        Ok(warnings)
    }

    fn velocities(&self, setup: &Setup) -> Vec<Velocity> {
        let (fluid, mut all) = (setup.expect_fluid(), Vec::new());
        let fastest = (self.present.iter())
            .map(|&template| (template, setup.settling_speed(fluid, template)))
            .max_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((template, speed)) = fastest {
            let section = setup.sections[template];
            let diameter = setup.templates[template].shape.equivalent_diameter();
            all.push(Velocity {
                name: format!("the settling velocity of `particles.{section}`"),
                speed,
                key: format!("particles.{section}.shape"),
                doubt: self.doubt_of_settling(setup, diameter),
            });
        }
        let started = setup.particles.iter().map(|p| {
            let template = p.template as usize;
            let rim = p.angular_velocity().norm() * setup.templates[template].shape.circumradius();
            (template, p.velocity().norm() + rim)
        });
        if let Some((template, speed)) = started.max_by(|a, b| a.1.total_cmp(&b.1)) {
            let section = setup.sections[template];
            let list = if self.case.particles[section].list.is_some() { ".list.0" } else { "" };
            all.push(Velocity {
                name: format!("the fastest surface of `particles.{section}` at the start"),
                speed,
                key: format!("particles.{section}{list}"),
                doubt: (speed > 10.0).then(|| "velocities are in m/s".to_string()),
            });
        }
        let size = setup.domain.size();
        for (wall, key) in setup.walls.iter().zip(&self.walls) {
            all.push(Velocity {
                name: format!("the wall \"{}\"", wall.name),
                speed: wall_speed(wall, &size),
                key: key.clone(),
                doubt: None,
            });
        }
        if let Some(flow) = setup.driven_flow() {
            let acceleration = fluid.body_acceleration.norm();
            all.push(Velocity {
                name: "the flow that `driving.body_acceleration` drives".to_string(),
                speed: flow.speed,
                key: "driving.body_acceleration".to_string(),
                doubt: (acceleration > 100.0).then(|| {
                    format!(
                        "it is in m/s^2, the gradient of the pressure over the density: is {:.4} meant, from \
                         {acceleration} Pa/m?",
                        acceleration / setup.fluid_density()
                    )
                }),
            });
        }
        all
    }

    /// The unit that was likely mixed up where a particle settles too fast.
    fn doubt_of_settling(&self, setup: &Setup, diameter: f64) -> Option<String> {
        let (gravity, viscosity) = (setup.gravity.norm(), setup.expect_fluid().viscosity);
        if diameter > 0.05 {
            return Some(format!(
                "lengths are in metres: is a diameter of {:.4e} m meant, not {diameter} m?",
                1e-3 * diameter
            ));
        }
        if self.fluid.viscosity.is_some() && viscosity < 5e-8 {
            return Some(format!(
                "`fluid.viscosity` is {viscosity:.3e} m^2/s, below that of any liquid; water has 1e-6"
            ));
        }
        (gravity > 100.0).then(|| format!("`driving.gravity` is {gravity} m/s^2; that of the Earth is 9.81"))
    }

    /// What lowers a speed on the lattice to the usual range, as far as that can be had.
    fn slower(&self, setup: &Setup, lattice: f64) -> String {
        let (fluid, factor) = (setup.expect_fluid(), USUAL_SPEED / lattice);
        let tau = 0.5 + (fluid.relaxation_time - 0.5) * factor;
        let cells = setup.diameter / setup.domain.dx / factor;
        let mut ways = Vec::new();
        if tau >= SUGGESTED.0 {
            ways.push(if self.lattice.time_step.is_some() {
                format!("lattice.time_step = {:.4e}", setup.time_step * factor)
            } else {
                format!("lattice.relaxation_time = {tau:.4}")
            });
        }
        // With a given time step a finer lattice is a faster one.
        if cells <= SUGGESTED.1 && self.lattice.time_step.is_none() {
            ways.push(format!("lattice.cells_per_diameter = {cells:.0}"));
        }
        if ways.is_empty() {
            return format!(
                "no usual time step or resolution lowers it to {USUAL_SPEED}: are all lengths in m, velocities in m/s, \
                 densities in kg/m^3, and the viscosity ({:.3e}) kinematic, in m^2/s?",
                fluid.viscosity
            );
        }
        format!("take {}", ways.join(" or "))
    }

    /// Asks about a viscosity that looks like the dynamic one of water.
    fn dynamic_viscosity(&self, setup: &Setup) -> Option<String> {
        let viscosity = self.fluid.viscosity?;
        let like_water = (950.0..1050.0).contains(&setup.fluid_density());
        if !like_water || !WATER_DYNAMIC.contains(&viscosity) {
            return None;
        }
        let title = format!(
            "`fluid.viscosity` = {viscosity:e} m^2/s is a thousand times that of water: is it the dynamic viscosity, in Pa s?"
        );
        let remedy =
            format!("if so, divide it by the density: {:.3e} m^2/s", viscosity / setup.fluid_density());
        Some(self.document.warning("fluid.viscosity", &title, "kinematic, in m^2/s", &remedy))
    }

    /// Particles too light for the explicit coupling.
    fn light(&self, setup: &Setup) -> Option<String> {
        let light = setup.too_light()?;
        let section = setup.sections[light.template];
        let (density, key) = (self.case.particles[section].density, format!("particles.{section}.density"));
        let least = light.limit * setup.fluid_density();
        let cells = setup.diameter / setup.domain.dx * light.limit / light.ratio;
        let remedy = if density < 25.0 && setup.fluid_density() > 500.0 {
            format!("densities are in kg/m^3: is {} meant, {density} g/cm^3?", 1e3 * density)
        } else if cells <= SUGGESTED.1 {
            format!("take lattice.cells_per_diameter = {cells:.1} or a density of {least:.0} kg/m^3, or more")
        } else {
            format!("take a density of {least:.0} kg/m^3 or more")
        };
        Some(self.document.warning(&key, &format!("`{key}`: {light}"), "light", &remedy))
    }
}
