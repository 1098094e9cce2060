//! Two equal spheres that meet head-on, by the elastic law of a case: how long an impact lasts and how deep contacts are.
//!
//! ```text
//! E* = E / (2 (1 - nu^2)),  R* = R / 2,  m* = m / 2,  F = (4/3) E* sqrt(R*) d^(3/2)  (small overlaps, all laws)
//! duration      2.868 (m*^2 / (R* E*^2 v))^(1/5)
//! impact depth  (15 m* v^2 / (16 sqrt(R*) E*))^(2/5)
//! static depth  (3 F / (4 E* sqrt(R*)))^(2/3)
//! bound         pi sqrt(m* / k),  k: stiffness of the contact that nothing but cohesion presses together
//! approach      pi sqrt(m* / k),  k = A R* / (3 z^3): steepest change of the van der Waals force
//! friction      2 pi sqrt((2/7) m* / (8 G* a)),  a = sqrt(R* d)
//! Rayleigh      pi r sqrt(rho / G) / (0.1631 nu + 0.8766)
//! ```
//!
//! # Reference
//! Johnson (1985), Contact Mechanics, sections 4.2 and 11.4; Rayleigh: Thornton and Randall (1988), in Micromechanics of Granular Materials, 133.

use super::friction::shear_modulus;
use super::law::effective_modulus;
use super::{Cohesion, ContactModel, ElasticLaw, Material, VanDerWaals};
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
    van_der_waals: Option<VanDerWaals>,
    /// That of the spheres, or of the first one.
    material: Material,
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
            van_der_waals: None,
            material: self.materials[a],
        };
        pair.static_depth(0.0)
    }
}

impl SpherePair {
    /// Spheres of a diameter (m) and a mass (kg), of the material with this index.
    pub fn new(model: &ContactModel, material: usize, diameter: f64, mass: f64) -> Self {
        let cohesion = Cohesion::new(model, material, material);
        let material = model.materials[material];
        Self {
            law: model.law,
            modulus: material.youngs_modulus
                / (2.0 * (1.0 - material.poisson_ratio * material.poisson_ratio)),
            radius: 0.25 * diameter,
            mass: 0.5 * mass,
            cohesion,
            van_der_waals: model.van_der_waals,
            material,
        }
    }

    /// Duration (s) of an elastic impact at relative speed `speed` (m/s); that of a [bound](Self::bound_duration) contact, or of the
    /// [approach](Self::approach_duration), if it is shorter.
    pub fn duration(&self, speed: f64) -> f64 {
        let impact = match self.law {
            ElasticLaw::OverlapVolume | ElasticLaw::OverlapEnergy | ElasticLaw::Hertz => {
                let scale = self.mass * self.mass / (self.radius * self.modulus * self.modulus * speed);
                2.868 * libm::pow(scale, 0.2)
            }
        };
        [self.bound_duration(), self.approach_duration()].into_iter().flatten().fold(impact, f64::min)
    }

    /// Half a period (s) of a spring as stiff as the van der Waals force is steep at its smallest gap, which spheres cross in about that time; none without.
    pub fn approach_duration(&self) -> Option<f64> {
        let law = self.van_der_waals?;
        Some(PI * (self.mass / law.steepest(self.radius)).sqrt())
    }

    /// The force (N) that pulls the spheres off each other; 0 without cohesion.
    pub fn pull_off(&self) -> f64 {
        self.cohesion.pull_off(self.radius, self.modulus)
    }

    /// Half a period (s) of spheres that cohesion holds together, about the depth at which they rest; none without cohesion. However slow an impact is, its
    /// contact is as stiff as that.
    pub fn bound_duration(&self) -> Option<f64> {
        if self.cohesion.is_none() {
            return None;
        }
        // A small step to both sides, as a part of the depth of Hertz's contact with the same disc.
        let at = |part: f64| {
            let pressed = part * self.pressed(0.0);
            let force = match self.law {
                ElasticLaw::OverlapVolume | ElasticLaw::OverlapEnergy | ElasticLaw::Hertz => {
                    4.0 / 3.0 * self.modulus * (self.radius * pressed).sqrt() * pressed
                }
            };
            [force - self.pull(pressed), self.cohesion.released(pressed, self.radius)]
        };
        let ([low, shallow], [high, deep]) = (at(1.0 - 1e-4), at(1.0 + 1e-4));
        Some(PI * (self.mass * (deep - shallow) / (high - low)).sqrt())
    }

    /// Period (s) of spheres that stick and rub against each other at a depth (m), by the spring of friction: a sphere rolls as it gives way, so `2/7` of
    /// the mass move.
    pub fn sliding_period(&self, depth: f64) -> f64 {
        let disc = (self.radius * self.cohesion.pressed(depth, self.radius)).sqrt();
        let stiffness = 8.0 * shear_modulus([&self.material; 2]) * disc;
        2.0 * PI * (2.0 / 7.0 * self.mass / stiffness).sqrt()
    }

    /// Time (s) in which a wave on its surface runs half round a sphere.
    pub fn rayleigh_time(&self) -> f64 {
        let Material { youngs_modulus, poisson_ratio } = self.material;
        let (radius, shear) = (2.0 * self.radius, 0.5 * youngs_modulus / (1.0 + poisson_ratio));
        let density = 2.0 * self.mass / (4.0 / 3.0 * PI * radius * radius * radius);
        PI * radius * (density / shear).sqrt() / (0.1631 * poisson_ratio + 0.8766)
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
        self.cohesion.released(self.pressed(force), self.radius)
    }

    /// The pull of cohesion (N) at a depth (m) of Hertz's contact with the same disc. Spheres of radius 2 R* meet in a disc of the area 2 pi R* d.
    fn pull(&self, depth: f64) -> f64 {
        self.cohesion.force(2.0 * PI * self.radius * depth, depth, self.radius)
    }

    /// Depth (m) under a steady force (N) and the cohesion, of Hertz's contact with the same disc.
    fn pressed(&self, force: f64) -> f64 {
        let under = |force: f64| match self.law {
            ElasticLaw::OverlapVolume | ElasticLaw::OverlapEnergy | ElasticLaw::Hertz => {
                libm::pow(0.75 * force / (self.modulus * self.radius.sqrt()), 2.0 / 3.0)
            }
        };
        // Each turn leaves less than two thirds of the error of the logarithm.
        let turns = if self.cohesion.is_none() { 0 } else { 60 };
        (0..turns).fold(under(force + self.pull(self.radius)), |depth, _| under(force + self.pull(depth)))
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
            van_der_waals: None,
            material: Material { youngs_modulus: 5e3 * stiffer, poisson_ratio: 0.245 },
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

    #[test]
    fn the_wave_round_a_sphere_takes_the_time_of_rayleigh_and_friction_swings_about_as_fast_as_an_impact() {
        let pair = paper(ElasticLaw::Hertz, 1.0);
        let wave = PI * 1.5e-3 * (3300.0 / (2500.0 / 1.245_f64)).sqrt() / 0.916_56;
        assert!((pair.rayleigh_time() / wave - 1.0).abs() < 1e-5);
        // Stiffnesses along and across are as 2 (1 - nu) to 2 - nu, 8 G* a to 2 E* a.
        let depth = pair.impact_depth(0.1);
        let along = PI * (pair.mass / (2.0 * pair.modulus * (pair.radius * depth).sqrt())).sqrt();
        let ratio = 2.0 * (2.0_f64 / 7.0 * (2.0 - 0.245) / (2.0 * (1.0 - 0.245))).sqrt();
        assert!((pair.sliding_period(depth) / along / ratio - 1.0).abs() < 1e-3);
    }

    #[test]
    fn spheres_that_cohesion_holds_together_swing_as_fast_as_the_stiffness_of_their_contact_says() {
        use super::super::{CohesionLaw, PairParams};
        let radius = 0.75e-3_f64;
        let of = |cohesion| ContactModel {
            materials: vec![Material { youngs_modulus: 1e7, poisson_ratio: 0.25 }],
            pairs: vec![PairParams {
                work_of_adhesion: 0.05,
                cohesion_density: 3e4,
                ..PairParams::default()
            }],
            law: ElasticLaw::Hertz,
            cohesion,
            ..ContactModel::default()
        };
        let pair = |cohesion| SpherePair::new(&of(cohesion), 0, 4.0 * radius, 2e-5);
        assert_eq!(pair(CohesionLaw::None).bound_duration(), None);
        let modulus = 0.5e7 / (1.0 - 0.25 * 0.25);
        let disc = |force: f64| libm::cbrt(0.75 * force * radius / modulus);
        let area = PI * 0.05 * radius * radius;
        let smallest = libm::cbrt(area / (8.0 * modulus));
        for (cohesion, stiffness) in [
            (CohesionLaw::Dmt, 2.0 * modulus * disc(2.0 * PI * 0.05 * radius)),
            (CohesionLaw::Sjkr, PI * radius * 3e4),
            (CohesionLaw::Jkr, 0.15 * libm::cbrt(36.0) * area / (smallest * smallest)),
        ] {
            let (pair, half) = (pair(cohesion), PI * (1e-5 / stiffness).sqrt());
            let found = pair.bound_duration().unwrap();
            assert!((found / half - 1.0).abs() < 1e-6, "{cohesion:?}: {found} for {half}");
            assert!((pair.duration(1e-9) / half - 1.0).abs() < 1e-6 && pair.duration(10.0) < half);
        }
    }
}
