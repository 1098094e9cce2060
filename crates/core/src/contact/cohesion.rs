//! Cohesion: a pull along the normal between bodies that touch, beside the force of the overlap, through its centre.
//!
//! ```text
//! Dmt    F = 2 pi w R*                w: work of adhesion (J/m^2), what it takes to part a unit of area
//! Sjkr   F = k A                      k: density of the energy of cohesion (J/m^3), A: area of the overlap
//! Jkr    F = sqrt(8 pi w E* a^3)      a: radius of the disc in which the spheres meet, d = a^2 / R* - sqrt(2 pi w a / E*)
//! ```
//!
//! `R*` is that of spheres of equal volume. `Dmt` and `Sjkr` depend on the present overlap alone; `Dmt` vanishes at once where the bodies part, `Sjkr` gradually.
//! `Jkr` comes at the first touch and holds on over a gap ([`Cohesion::stretch`]), so a cycle of loading loses energy; its elastic force is Hertz's of the same
//! disc. Friction follows the normal force without cohesion, since cohesion presses the surfaces together; that of `Jkr` the force plus twice the pull-off force.
//!
//! References: Derjaguin, Muller and Toporov (1975), J. Colloid Interface Sci. 53, 314; `cohesion sjkr` of LIGGGHTS; Johnson, Kendall and Roberts (1971), Proc. R. Soc. A
//! 324, 301, doi:10.1098/rspa.1971.0141; Thornton (1991), J. Phys. D 24, 1942 (friction).

#[cfg(test)]
mod tests;

use super::law::effective_modulus;
use super::{CohesionLaw, ContactModel, Overlap};
use crate::math::Vec3;
use std::f64::consts::PI;

/// Cohesion between two materials, ready for use.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cohesion {
    law: CohesionLaw,
    /// Work of adhesion (J/m^2), or density of energy (J/m^3).
    strength: f64,
    /// `w / E*` (m).
    length: f64,
    /// `sqrt(8 pi w E*)` (N/m^(3/2)).
    adhesion: f64,
}

impl CohesionLaw {
    /// Names of the fields of [`PairParams`](super::PairParams) that the law reads.
    pub(super) fn parameters(self) -> &'static [&'static str] {
        match self {
            Self::None => &[],
            Self::Dmt | Self::Jkr => &["work_of_adhesion"],
            Self::Sjkr => &["cohesion_density"],
        }
    }
}

impl Cohesion {
    /// Cohesion between two materials, by their indices.
    pub(super) fn new(model: &ContactModel, a: usize, b: usize) -> Self {
        let pair = model.pair(a, b);
        // The van der Waals force in contact is that of Derjaguin, Muller and Toporov.
        let apart = model.van_der_waals.map(|law| law.work_of_adhesion());
        let law = if apart.is_some() { CohesionLaw::Dmt } else { model.cohesion };
        let modulus = effective_modulus(&model.materials[a], &model.materials[b]);
        let strength = match law {
            CohesionLaw::None => 0.0,
            CohesionLaw::Dmt | CohesionLaw::Jkr => apart.unwrap_or(pair.work_of_adhesion),
            CohesionLaw::Sjkr => pair.cohesion_density,
        };
        let adhesion = (8.0 * PI * strength * modulus).sqrt();
        Self { law, strength, length: strength / modulus, adhesion }
    }

    /// True if there is none.
    pub(super) fn is_none(&self) -> bool {
        self.strength == 0.0
    }

    /// True if bodies that have touched hold on to each other over a gap.
    pub fn has_neck(&self) -> bool {
        self.law == CohesionLaw::Jkr && !self.is_none()
    }

    /// The pull (N) of an overlap with this area (m^2) of bodies with the effective radius (m); `depth` (m) is that of [`pressed`](Self::pressed).
    pub(super) fn force(&self, area: f64, depth: f64, radius: f64) -> f64 {
        match self.law {
            CohesionLaw::None => 0.0,
            CohesionLaw::Dmt => 2.0 * PI * self.strength * radius,
            CohesionLaw::Sjkr => self.strength * area,
            CohesionLaw::Jkr => {
                let square = radius * depth;
                self.adhesion * (square * square.sqrt()).sqrt()
            }
        }
    }

    /// The force (N) that pulls bodies off each other at small overlaps, with the effective radius (m) and modulus (Pa): with `Sjkr` the largest of `k A` beyond
    /// Hertz's, `(4 / 27) (2 pi k R*)^3 / ((4 / 3) E* sqrt(R*))^2`.
    pub(super) fn pull_off(&self, radius: f64, modulus: f64) -> f64 {
        match self.law {
            CohesionLaw::None => 0.0,
            CohesionLaw::Dmt => 2.0 * PI * self.strength * radius,
            CohesionLaw::Jkr => 1.5 * PI * self.strength * radius,
            CohesionLaw::Sjkr => {
                let slope = 2.0 * PI * self.strength * radius;
                slope * slope * slope / (12.0 * modulus * modulus * radius)
            }
        }
    }

    /// The normal force (N) that limits friction, of one without cohesion and the pull (N).
    pub(super) fn grip(&self, normal: f64, pull: f64, radius: f64) -> f64 {
        match self.law {
            CohesionLaw::None | CohesionLaw::Dmt | CohesionLaw::Sjkr => normal.abs(),
            CohesionLaw::Jkr => (normal - pull + 3.0 * PI * self.strength * radius).abs(),
        }
    }

    /// The square (m^2) of the radius of the disc in which bodies with this effective radius (m) meet just before they part,
    /// `a_c^3 = pi w R*^2 / (8 E*)`.
    fn smallest_disc(&self, radius: f64) -> f64 {
        let edge = libm::cbrt(PI / 8.0 * self.length * radius * radius);
        edge * edge
    }

    /// The widest gap (m) over which bodies that have touched hold on to each other, `3 a_c^2 / R*`; none of laws but `Jkr`.
    pub fn stretch(&self, radius: f64) -> f64 {
        if self.has_neck() { 3.0 * self.smallest_disc(radius) / radius } else { 0.0 }
    }

    /// Depth (m) of the overlap with which bodies without cohesion would meet in the same disc, `a^2 / R*`.
    ///
    /// With `a = u^2 a_c` and `u = 1 + v` the law `d = a^2 / R* - sqrt(2 pi w a / E*)` is `v^2 (v^2 + 4 v + 6) = 3 + d R* / a_c^2`, of
    /// which the positive root is the stable one. Newton's method for the root of both sides falls onto it from above.
    pub(super) fn pressed(&self, depth: f64, radius: f64) -> f64 {
        if !self.has_neck() {
            return depth;
        }
        let square = self.smallest_disc(radius);
        let part = (3.0 + depth * radius / square).max(0.0);
        let root = part.sqrt();
        let mut v = (root / 6.0_f64.sqrt()).min(root.sqrt());
        for _ in 0..TURNS {
            let side = (6.0 + v * (4.0 + v)).sqrt();
            let next = v - (v * side - root) * side / (6.0 + v * (6.0 + 2.0 * v));
            if next >= v || next.is_nan() {
                break;
            }
            v = next;
        }
        let u = (1.0 + v) * (1.0 + v);
        u * u * square / radius
    }

    /// Depth (m) of the overlap of bodies that meet in the disc of such a [depth](Self::pressed) (m).
    pub(super) fn released(&self, pressed: f64, radius: f64) -> f64 {
        if !self.has_neck() {
            return pressed;
        }
        pressed - (2.0 * PI * self.length * (radius * pressed).sqrt()).sqrt()
    }
}

/// Turns of Newton's method, of which ten are enough.
const TURNS: usize = 30;

impl Overlap {
    /// The neck of two spheres that have touched, whose surfaces are a gap of `-depth` (m) apart; `point` (m) is in its middle.
    pub fn neck(point: Vec3, normal: Vec3, depth: f64) -> Self {
        Self { volume: 0.0, depth, point, normal, area: 0.0, moment: Vec3::zeros() }
    }
}

impl ContactModel {
    /// True if bodies that touch pull at each other.
    pub fn is_cohesive(&self) -> bool {
        self.cohesion != CohesionLaw::None || self.van_der_waals.is_some()
    }

    /// The widest gap (m) over which a body of this radius (m) that has touched another one, or a wall, may hold on to it.
    pub fn stretch(&self, radius: f64) -> f64 {
        if self.cohesion != CohesionLaw::Jkr {
            return 0.0;
        }
        // It grows with the effective radius, which is largest at a wall.
        let n = self.materials.len();
        let all = (0..n * n).map(|at| Cohesion::new(self, at / n, at % n).stretch(radius));
        all.fold(0.0, f64::max)
    }
}
