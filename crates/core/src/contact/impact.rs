//! Two equal spheres that meet head-on, by the elastic law of a case: how long an impact lasts and how deep contacts are.
//!
//! ```text
//! E* = E / (2 (1 - nu^2)),  R* = R / 2,  m* = m / 2,  F = (4/3) E* sqrt(R*) d^(3/2)  (small overlaps, all laws)
//! duration      2.868 (m*^2 / (R* E*^2 v))^(1/5)
//! impact depth  (15 m* v^2 / (16 sqrt(R*) E*))^(2/5)
//! static depth  (3 F / (4 E* sqrt(R*)))^(2/3)
//! ```
//!
//! # Reference
//! Johnson (1985), Contact Mechanics, sections 4.2 and 11.4.

use super::law::effective_modulus;
use super::{Cohesion, ContactModel, ElasticLaw};
use std::f64::consts::PI;

/// Two equal spheres of one material in contact.
#[derive(Clone, Copy, Debug)]
pub struct SpherePair {
    law: ElasticLaw,
    /// `E*` (Pa).
    modulus: f64,
    /// `R*` (m).
    radius: f64,
    /// `m*` (kg).
    mass: f64,
    cohesion: Cohesion,
}

impl ContactModel {
    /// Depth (m) at which two spheres rest that nothing but cohesion presses together, of these materials and radii (m), of which that of a
    /// wall is infinite.
    pub fn cohesive_depth(&self, materials: [usize; 2], [first, second]: [f64; 2]) -> f64 {
        let [a, b] = materials;
        let pair = SpherePair {
            law: self.law,
            modulus: effective_modulus(&self.materials[a], &self.materials[b]),
            radius: first / (1.0 + first / second),
            // Depths at rest do not depend on it.
            mass: 0.0,
            cohesion: Cohesion::new(self, a, b),
        };
        pair.static_depth(0.0)
    }
}

impl SpherePair {
    /// Spheres of a diameter (m) and a mass (kg), of the material with this index.
    pub fn new(model: &ContactModel, material: usize, diameter: f64, mass: f64) -> Self {
        let cohesion = Cohesion::new(model, material, material);
        let material = &model.materials[material];
        Self {
            law: model.law,
            modulus: material.youngs_modulus
                / (2.0 * (1.0 - material.poisson_ratio * material.poisson_ratio)),
            radius: 0.25 * diameter,
            mass: 0.5 * mass,
            cohesion,
        }
    }

    /// Duration (s) of an elastic impact at relative speed `speed` (m/s).
    pub fn duration(&self, speed: f64) -> f64 {
        match self.law {
            ElasticLaw::OverlapVolume | ElasticLaw::OverlapEnergy | ElasticLaw::Hertz => {
                let scale = self.mass * self.mass / (self.radius * self.modulus * self.modulus * speed);
                2.868 * libm::pow(scale, 0.2)
            }
        }
    }

    /// Largest depth (m) of an elastic impact at relative speed `speed` (m/s).
    pub fn impact_depth(&self, speed: f64) -> f64 {
        match self.law {
            ElasticLaw::OverlapVolume | ElasticLaw::OverlapEnergy | ElasticLaw::Hertz => {
                let scale = 15.0 * self.mass * speed * speed / (16.0 * self.radius.sqrt() * self.modulus);
                libm::pow(scale, 0.4)
            }
        }
    }

    /// Depth (m) under a steady force (N) and the cohesion.
    pub fn static_depth(&self, force: f64) -> f64 {
        let under = |force: f64| match self.law {
            ElasticLaw::OverlapVolume | ElasticLaw::OverlapEnergy | ElasticLaw::Hertz => {
                libm::pow(0.75 * force / (self.modulus * self.radius.sqrt()), 2.0 / 3.0)
            }
        };
        // Spheres of radius 2 R* meet in a disc of the area 2 pi R* d. Each turn leaves less than two thirds of the error of the logarithm.
        let pull = |depth: f64| self.cohesion.force(2.0 * PI * self.radius * depth, depth, self.radius);
        let turns = if self.cohesion.is_none() { 0 } else { 60 };
        let pressed =
            (0..turns).fold(under(force + pull(self.radius)), |depth, _| under(force + pull(depth)));
        self.cohesion.released(pressed, self.radius)
    }
}

impl ElasticLaw {
    /// The power `p` of `F ~ d^p` with which the force between spheres grows with the depth (-). With the stiffness `K` of `F = K d^p`
    /// the duration of an impact goes as `K^(-1/(p+1))`, the depth under a steady force as `K^(-1/p)`.
    pub fn exponent(self) -> f64 {
        match self {
            Self::OverlapVolume | Self::OverlapEnergy | Self::Hertz => 1.5,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAWS: [ElasticLaw; 3] = [ElasticLaw::OverlapVolume, ElasticLaw::OverlapEnergy, ElasticLaw::Hertz];

    /// The driver of Marquardt et al. (2024): D = 3 mm, E = 5 kPa, N = 9.
    fn paper(law: ElasticLaw, stiffer: f64) -> SpherePair {
        SpherePair {
            law,
            modulus: 2660.0 * stiffer,
            radius: 0.75e-3,
            mass: 0.5 * 3300.0 * 1.413_716_7e-8,
            cohesion: Cohesion::default(),
        }
    }

    #[test]
    fn one_submerged_weight_indents_as_the_paper_has_it() {
        let weight = 2300.0 * 9.81 * 1.413_716_7e-8;
        assert!((paper(ElasticLaw::OverlapVolume, 1.0).static_depth(weight) / 3e-3 - 0.074).abs() < 5e-4);
    }

    #[test]
    fn depth_and_duration_conserve_energy_and_agree_with_each_other() {
        let (pair, speed) = (paper(ElasticLaw::Hertz, 1.0), 0.1);
        let depth = pair.impact_depth(speed);
        let stored = 8.0 / 15.0 * pair.modulus * pair.radius.sqrt() * libm::pow(depth, 2.5);
        assert!((stored / (0.5 * pair.mass * speed * speed) - 1.0).abs() < 1e-12);
        // Hertz: the duration is 2.94 times the depth over the speed.
        assert!((pair.duration(speed) * speed / depth / 2.9432 - 1.0).abs() < 1e-3);
    }

    #[test]
    fn durations_and_depths_scale_with_the_stiffness_as_the_exponent_of_the_law_says() {
        for law in LAWS {
            let (one, stiffer, p) = (paper(law, 1.0), paper(law, 8.0), law.exponent());
            let duration = one.duration(0.1) / stiffer.duration(0.1);
            let depth = one.static_depth(1e-4) / stiffer.static_depth(1e-4);
            assert!((duration / libm::pow(8.0, 1.0 / (p + 1.0)) - 1.0).abs() < 1e-12, "{law:?}");
            assert!((depth / libm::pow(8.0, 1.0 / p) - 1.0).abs() < 1e-12, "{law:?}");
        }
    }
}
