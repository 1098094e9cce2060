//! Cases that cannot work although every number by itself is admissible: velocities that the lattice cannot follow, units that were
//! mixed up, particles lighter than the coupling is tested for. Refused or warned of with the place in the case.

use super::checks::Document;
use super::file::{FACES, FluidSection, FluidStart, LatticeSection, PositionsBy, TimeStepBy, ViscosityBy};
use super::speeds::{laminar_speed, wall_speed};
use super::{FluidSetup, Setup};
use crate::coupling::VirtualMass;
use crate::domain::Face;
use crate::error::Result;
use crate::particle::{Particle, Template};
use std::collections::BTreeSet;
use std::fmt;
use std::ops::RangeInclusive;

/// Speed on the lattice (cells per step) above which a case is refused: the scheme becomes unstable near 0.4.
const LARGEST_SPEED: f64 = 0.3;
/// Largest usual speed on the lattice (cells per step): compressibility errors grow with its square.
const USUAL_SPEED: f64 = 0.1;
/// Least relaxation time, and most cells per diameter, that are suggested to anybody.
const SUGGESTED: (f64, f64) = (0.51, 60.0);
/// Kinematic viscosity (m^2/s) of a liquid of usual density (kg/m^3) from which it is asked for: that of water at 25 degrees centigrade is
/// 0.89e-6, and its dynamic viscosity 0.89e-3 Pa s.
const DOUBTFUL_VISCOSITY: f64 = 0.88e-3;
const LIQUIDS: RangeInclusive<f64> = 500.0..=3000.0;
/// Least density ratio at which the coupling with a [`VirtualMass`] has been tested: spheres, 8 to 20 cells per diameter, relaxation
/// times 0.52 to 1, both couplings.
const LEAST_RATIO: f64 = 0.05;

/// A [`Setup`] and the case that it comes from.
pub(super) struct Review<'a> {
    pub(super) document: &'a Document<'a>,
    pub(super) fluid: &'a FluidSection,
    pub(super) lattice: &'a LatticeSection,
    pub(super) setup: &'a Setup,
    /// Templates of which there are particles.
    pub(super) present: BTreeSet<usize>,
    /// The key of each wall.
    pub(super) walls: Vec<String>,
}

/// Particles that may be too light for the coupling.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TooLight {
    template: usize,
    /// Density over that of the fluid (-).
    ratio: f64,
}

impl fmt::Display for TooLight {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(
            f,
            "particles of {:.1e} times the density of the fluid may be too light for the coupling, which is tested down to \
             {LEAST_RATIO}: the added mass of the fluid round them outweighs them",
            self.ratio
        )
    }
}

impl Setup {
    /// The lightest particles, if they are lighter than the coupling is tested for.
    ///
    /// Bodies whose centre is not free in any direction cannot be.
    pub fn too_light(&self) -> Option<TooLight> {
        let fluid = self.fluid.as_ref()?;
        (self.expected_counts())
            .map(|(template, _)| template)
            .filter(|&template| !self.motions[template].holds_centre())
            .map(|template| TooLight { template, ratio: self.templates[template].density / fluid.density })
            .filter(|light| light.ratio < LEAST_RATIO)
            .min_by(|a, b| a.ratio.total_cmp(&b.ratio))
    }

    /// Virtual mass of the bodies of a template in a fluid; none where a force or torque moves nothing.
    pub(crate) fn virtual_mass(&self, fluid: &FluidSetup, template: usize) -> Option<VirtualMass> {
        let Template { shape, density, .. } = &self.templates[template];
        let (ratio, dx) = (density / fluid.density, self.domain.dx);
        let free = !self.motions[template].is_complete();
        free.then(|| VirtualMass::new(&**shape, ratio, dx, fluid.relaxation_time)).flatten()
    }
}

impl Review<'_> {
    /// Refuses a case that cannot work; returns warnings.
    pub(super) fn judge(&self) -> Result<Vec<String>> {
        let (setup, fluid) = (self.setup, self.setup.expect_fluid());
        let mut warnings: Vec<String> = self.dynamic_viscosity().into_iter().chain(self.light()).collect();
        let mut follow = |name: &str, speed: f64, key: &str, doubt: Option<String>| {
            self.follow(name, speed, key, doubt).map(|warning| warnings.extend(warning))
        };
        let settling = self.present.iter().filter(|&&template| setup.falls(template));
        let settling = settling.map(|&template| (template, setup.settling_speed(fluid, template)));
        if let Some((template, speed)) = settling.max_by(|a, b| a.1.total_cmp(&b.1)) {
            let section = setup.sections[template];
            let name = format!("the settling velocity that `particles.{section}` reaches in this run");
            let doubt =
                self.doubt_of_settling(section, setup.templates[template].shape.equivalent_diameter());
            follow(&name, speed, &format!("particles.{section}.shape"), doubt)?;
        }
        // Walls decide the speed of bodies that the flow carries.
        let own = |p: &&Particle| fluid.start.is_none_or(|flow| p.velocity() != flow.velocity(p.position()));
        let started = setup.particles.iter().filter(own).map(|p| {
            let template = p.template as usize;
            let rim = p.angular_velocity().norm() * setup.templates[template].shape.circumradius();
            (template, p.velocity().norm() + rim)
        });
        if let Some((template, speed)) = started.max_by(|a, b| a.1.total_cmp(&b.1)) {
            let section = setup.sections[template];
            let name = format!("the fastest surface of `particles.{section}` at the start");
            let list = if matches!(self.document.case.particles[section].positions, PositionsBy::List(_)) {
                ".list.0"
            } else {
                ""
            };
            let doubt = (speed > 10.0).then(|| "velocities are in m/s".to_string());
            follow(&name, speed, &format!("particles.{section}{list}"), doubt)?;
        }
        for (n, insertion) in setup.insertions.iter().enumerate() {
            let key = format!("insertion.{n}.velocity");
            let doubt = (insertion.speed() > 10.0).then(|| "velocities are in m/s".to_string());
            follow(
                &format!("the velocity of the particles of `insertion.{n}`"),
                insertion.speed(),
                &key,
                doubt,
            )?;
        }
        for &template in &self.present {
            let speed = setup.prescribed_speed(template);
            let key = format!("particles.{}.motion", setup.sections[template]);
            let doubt =
                (speed > 10.0).then(|| "velocities are in m/s, angular velocities in 1/s".to_string());
            follow(&format!("the fastest surface by `{key}`"), speed, &key, doubt)?;
        }
        let size = setup.domain.size();
        if let Some(flow) = fluid.start.filter(|_| self.fluid.start != FluidStart::Couette) {
            follow("the flow of `fluid.start`", flow.largest(size), "fluid.start", None)?;
        }
        for (wall, key) in setup.walls.iter().zip(&self.walls) {
            follow(&format!("the wall \"{}\"", wall.name), wall_speed(wall, &size), key, None)?;
        }
        for (&number, inlet) in &setup.inlets {
            let name = &setup.walls[number].name;
            let speed = inlet.velocity.largest().norm() * inlet.profile.largest();
            let key = format!("domain.faces.{name}.inlet.velocity");
            follow(&format!("the fluid at the inlet \"{name}\""), speed, &key, None)?;
        }
        for axis in 0..3 {
            let [Face::Outlet { excess: low, .. }, Face::Outlet { excess: high, .. }] =
                [0, 1].map(|end| setup.domain.faces[2 * axis + end])
            else {
                continue;
            };
            let varies =
                [0, 1].map(|end| setup.largest_change_of_pressure(2 * axis + end)).iter().sum::<f64>();
            // From rest without friction, and between walls far from either end.
            let drop = ((high - low).abs() * setup.units().pressure() + varies) / fluid.density;
            let width = setup.width_across(axis);
            let speed = (2.0 * drop).sqrt().min(laminar_speed(drop / size[axis], width, fluid.viscosity));
            let [name, other] = [FACES[2 * axis], FACES[2 * axis + 1]];
            let flow = format!("the flow between the outlets \"{name}\" and \"{other}\"");
            follow(&flow, speed, &format!("domain.faces.{name}.outlet"), None)?;
        }
        // Where bodies at rest are only counted, their drag is not known.
        let is_placed = |template: usize| setup.particles.iter().any(|p| p.template as usize == template);
        let unknown =
            self.present.iter().any(|&template| setup.motions[template].rests() && !is_placed(template));
        if let Some(flow) = setup.driven_flow().filter(|_| !unknown) {
            let key = "driving.body_acceleration";
            let acceleration = fluid.body_acceleration.largest().norm();
            let doubt = (acceleration > 100.0).then(|| {
                format!(
                    "it is in m/s^2, the gradient of the pressure over the density: is {:.4} meant, from \
                     {acceleration} Pa/m?",
                    acceleration / fluid.density
                )
            });
            follow(&format!("the flow that `{key}` drives in this run"), flow.speed, key, doubt)?;
        }
        let flux = fluid.net_flux.map(Option::unwrap_or_default);
        let key = "driving.net_flux";
        follow(&format!("the flow of `{key}`"), crate::math::Vec3::from(flux).norm(), key, None)?;
        Ok(warnings)
    }

    /// Refuses a speed (m/s) that the lattice cannot follow, which one key decides and which may be a mistake; or warns of it.
    fn follow(&self, name: &str, speed: f64, key: &str, doubt: Option<String>) -> Result<Option<String>> {
        let lattice = speed / self.setup.units().velocity();
        let is = format!("{name} is {speed:.4e} m/s or {lattice:.3} cells per time step, above");
        if lattice > LARGEST_SPEED {
            let remedy = doubt.unwrap_or_else(|| self.slower(lattice));
            let title = format!("{is} {LARGEST_SPEED}, which the lattice cannot follow");
            return Err(self.document.error(key, &title, "too fast", &remedy));
        }
        let title = format!("{is} {USUAL_SPEED}, where the fluid becomes compressible");
        Ok((lattice > USUAL_SPEED).then(|| self.document.warning(key, &title, "fast", &self.slower(lattice))))
    }

    /// The unit that was likely mixed up where a particle settles too fast.
    fn doubt_of_settling(&self, section: usize, diameter: f64) -> Option<String> {
        let (gravity, viscosity) = (self.setup.gravity.norm(), self.setup.expect_fluid().viscosity);
        if diameter > 0.05 {
            if let Some(doubt) = self.document.case.particles[section].shape.doubtful_unit() {
                return Some(doubt.to_string());
            }
            return Some(format!(
                "lengths are in metres: is a diameter of {:.4e} m meant, not {diameter} m?",
                1e-3 * diameter
            ));
        }
        if matches!(self.fluid.viscosity, ViscosityBy::Viscosity(_)) && viscosity < 5e-8 {
            return Some(format!(
                "`fluid.viscosity` is {viscosity:.3e} m^2/s, below that of any liquid; water has 1e-6"
            ));
        }
        (gravity > 100.0).then(|| format!("`driving.gravity` is {gravity} m/s^2; that of the Earth is 9.81"))
    }

    /// Suggests changes that lower a speed on the lattice to the usual range.
    fn slower(&self, lattice: f64) -> String {
        let (setup, fluid, factor) = (self.setup, self.setup.expect_fluid(), USUAL_SPEED / lattice);
        // Rounded to the safe side, and so to another value than the present one.
        let tau = ((0.5 + (fluid.relaxation_time - 0.5) * factor) * 1e4).floor() / 1e4;
        let cells = (setup.diameter / setup.domain.dx / factor).ceil();
        let mut ways = Vec::new();
        let given = matches!(self.lattice.time, TimeStepBy::TimeStep(_));
        if tau >= SUGGESTED.0 {
            ways.push(if given {
                format!("lattice.time_step = {:.4e}", 0.9999 * setup.time_step * factor)
            } else {
                format!("lattice.relaxation_time = {tau:.4}")
            });
        }
        // With a given time step a finer lattice is a faster one.
        if cells <= SUGGESTED.1 && !given {
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

    /// Asks about a viscosity that looks like a dynamic one.
    fn dynamic_viscosity(&self) -> Option<String> {
        let ViscosityBy::Viscosity(viscosity) = self.fluid.viscosity else { return None };
        let density = self.fluid.density;
        if !LIQUIDS.contains(&density) || viscosity < DOUBTFUL_VISCOSITY {
            return None;
        }
        let title = format!(
            "`fluid.viscosity` = {viscosity:e} m^2/s is {:.0} times that of water: is it the dynamic viscosity, in Pa s?",
            viscosity / 1e-6
        );
        let remedy = format!(
            "if so, divide it by the density: {:.4e} m^2/s; 1e-6 is that of water",
            viscosity / density
        );
        Some(self.document.warning("fluid.viscosity", &title, "kinematic, in m^2/s", &remedy))
    }

    /// Particles that may be too light for the coupling.
    fn light(&self) -> Option<String> {
        let (setup, light) = (self.setup, self.setup.too_light()?);
        let section = setup.sections[light.template];
        let (density, key) =
            (self.document.case.particles[section].density, format!("particles.{section}.density"));
        let least = LEAST_RATIO * setup.fluid_density();
        let remedy = if density < 25.0 && setup.fluid_density() > 500.0 {
            format!("densities are in kg/m^3: is {} meant, {density} g/cm^3?", 1e3 * density)
        } else {
            format!("take a density of {least:.0} kg/m^3 or more")
        };
        Some(self.document.warning(&key, &format!("`{key}`: {light}"), "light", &remedy))
    }
}
