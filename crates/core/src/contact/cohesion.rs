//! Cohesion: a pull along the normal between bodies that touch, beside the force of the overlap, through its centre.
//!
//! ```text
//! Dmt    F = 2 pi w R*        w: work of adhesion (J/m^2), what it takes to part a unit of area
//! Sjkr   F = k A              k: density of the energy of cohesion (J/m^3), A: area of the overlap
//! ```
//!
//! `R*` is that of spheres of equal volume. Both forces depend on the present overlap alone, so a cycle of loading neither gains nor loses energy. Both vanish where the bodies
//! part: `Dmt` at once, so that its whole force is the pull-off force, `Sjkr` gradually. Friction follows the normal force without cohesion, as in the theory of `Dmt`: cohesion
//! presses the surfaces together, and the elastic force of the overlap that this causes carries friction.
//!
//! References: Derjaguin, Muller and Toporov (1975), J. Colloid Interface Sci. 53, 314, doi:10.1016/0021-9797(75)90018-1; `cohesion sjkr` of LIGGGHTS.

#[cfg(test)]
mod tests;

use super::{CohesionLaw, ContactModel, PairParams};
use std::f64::consts::PI;

/// Cohesion between two materials, ready for use.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cohesion {
    law: CohesionLaw,
    /// Work of adhesion (J/m^2), or density of energy (J/m^3).
    strength: f64,
}

impl CohesionLaw {
    /// Names of the fields of [`PairParams`] that the law reads.
    pub(super) fn parameters(self) -> &'static [&'static str] {
        match self {
            Self::None => &[],
            Self::Dmt => &["work_of_adhesion"],
            Self::Sjkr => &["cohesion_density"],
        }
    }
}

impl Cohesion {
    /// Cohesion between two materials.
    pub(super) fn new(model: &ContactModel, pair: &PairParams) -> Self {
        let strength = match model.cohesion {
            CohesionLaw::None => 0.0,
            CohesionLaw::Dmt => pair.work_of_adhesion,
            CohesionLaw::Sjkr => pair.cohesion_density,
        };
        Self { law: model.cohesion, strength }
    }

    /// True if there is none.
    pub(super) fn is_none(&self) -> bool {
        self.strength == 0.0
    }

    /// The pull (N) of an overlap with this area (m^2) of bodies with the effective radius (m).
    pub(super) fn force(&self, area: f64, radius: f64) -> f64 {
        match self.law {
            CohesionLaw::None => 0.0,
            CohesionLaw::Dmt => 2.0 * PI * self.strength * radius,
            CohesionLaw::Sjkr => self.strength * area,
        }
    }
}

impl ContactModel {
    /// True if bodies that touch pull at each other.
    pub fn is_cohesive(&self) -> bool {
        self.cohesion != CohesionLaw::None
    }
}
