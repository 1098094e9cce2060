//! Hertz contact of two equal spheres: how long it lasts and how deep it goes.
//!
//! ```text
//! E* = E / (2 (1 - nu^2)),  R* = R / 2,  m* = m / 2
//! duration      2.868 (m*^2 / (R* E*^2 v))^(1/5)
//! impact depth  (15 m* v^2 / (16 sqrt(R*) E*))^(2/5)
//! static depth  (3 F / (4 E* sqrt(R*)))^(2/3)
//! ```
//!
//! # Reference
//! Johnson (1985), Contact Mechanics, sections 4.2 and 11.4.

use super::Setup;
use crate::contact::Material;
use crate::math::Vec3;
use crate::particle::Template;

/// Steps of the particles in which a contact is resolved.
pub(super) const STEPS_PER_CONTACT: f64 = 50.0;

/// Two equal spheres in contact.
#[derive(Clone, Copy, Debug)]
pub struct Hertz {
    /// `E*` (Pa).
    modulus: f64,
    /// `R*` (m).
    radius: f64,
    /// `m*` (kg).
    mass: f64,
}

impl Hertz {
    /// Spheres of the volume and mass of the bodies of a template, and of one material.
    pub fn new(template: &Template, material: &Material) -> Self {
        Self {
            modulus: material.youngs_modulus
                / (2.0 * (1.0 - material.poisson_ratio * material.poisson_ratio)),
            radius: 0.25 * template.shape.equivalent_diameter(),
            mass: 0.5 * template.mass(),
        }
    }

    /// Duration (s) of an impact at relative speed `speed` (m/s).
    pub fn duration(&self, speed: f64) -> f64 {
        let scale = self.mass * self.mass / (self.radius * self.modulus * self.modulus * speed);
        2.868 * libm::pow(scale, 0.2)
    }

    /// Largest depth (m) of an impact at relative speed `speed` (m/s).
    pub fn impact_depth(&self, speed: f64) -> f64 {
        let scale = 15.0 * self.mass * speed * speed / (16.0 * self.radius.sqrt() * self.modulus);
        libm::pow(scale, 0.4)
    }

    /// Depth (m) under a steady force (N).
    pub fn static_depth(&self, force: f64) -> f64 {
        libm::pow(0.75 * force / (self.modulus * self.radius.sqrt()), 2.0 / 3.0)
    }
}

impl Setup {
    /// Two particles of a template in contact, as spheres of their volume; none without contacts.
    pub fn hertz(&self, template: usize) -> Option<Hertz> {
        let kind = &self.templates[template];
        Some(Hertz::new(kind, &self.contact.as_ref()?.materials[kind.material]))
    }

    /// Templates of particles that gravity presses onto others, and the depth (m) of a contact under the weight of one of them minus its
    /// buoyancy, along the directions in which it is free.
    pub fn resting_depths(&self) -> Vec<(usize, f64)> {
        let depth = |template: usize| {
            let (kind, free) = (&self.templates[template], self.motions[template].free);
            let gravity = Vec3::from_fn(|axis, _| if free[axis] { self.gravity[axis] } else { 0.0 });
            let weight = (kind.density - self.fluid_density()).abs() * kind.shape.volume() * gravity.norm();
            Some((template, self.hertz(template)?.static_depth(weight)))
        };
        self.movable().into_iter().filter_map(depth).filter(|(_, depth)| *depth > 0.0).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The driver of Marquardt et al. (2024): D = 3 mm, E = 5 kPa, N = 9.
    const PAPER: Hertz = Hertz { modulus: 2660.0, radius: 0.75e-3, mass: 0.5 * 3300.0 * 1.413_716_7e-8 };

    #[test]
    fn one_submerged_weight_indents_as_the_paper_has_it() {
        let weight = 2300.0 * 9.81 * 1.413_716_7e-8;
        assert!((PAPER.static_depth(weight) / 3e-3 - 0.074).abs() < 5e-4);
    }

    #[test]
    fn depth_and_duration_conserve_energy_and_agree_with_each_other() {
        let speed = 0.1;
        let depth = PAPER.impact_depth(speed);
        let stored = 8.0 / 15.0 * PAPER.modulus * PAPER.radius.sqrt() * libm::pow(depth, 2.5);
        assert!((stored / (0.5 * PAPER.mass * speed * speed) - 1.0).abs() < 1e-12);
        // Hertz: the duration is 2.94 times the depth over the speed.
        assert!((PAPER.duration(speed) * speed / depth / 2.9432 - 1.0).abs() < 1e-3);
    }
}
