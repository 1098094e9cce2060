//! Van der Waals force between spheres that are apart, and between a sphere and a wall: a pull along the normal, by the gap `h` of their surfaces.
//!
//! ```text
//! F = A R* / (6 max(h, z)^2),   h < h_c;   F = 0,   h >= h_c          R* = R_a R_b / (R_a + R_b), that of a sphere and a wall is R
//! U = -(A R* / 6) (1 / h - 1 / h_c),   z <= h < h_c;   U = -(A R* / 6) ((2 z - h) / z^2 - 1 / h_c),   h < z
//! ```
//!
//! `A` is the Hamaker constant, `z` the smallest gap, `h_c` the cut-off. The force is not shifted: it is that of the formula up to the cut-off, where it drops by the part `(z / h_c)^2`
//! of its largest value; the energy is shifted, so it is continuous. Spheres that touch pull at each other with the force at the smallest gap, which is that of [`Dmt`](super::CohesionLaw::Dmt)
//! with the work of adhesion `w = A / (12 pi z^2)`: contacts have it from there ([`Cohesion`](super::Cohesion)). Good for gaps far below the radii (Derjaguin's approximation).
//!
//! References: Hamaker (1937), Physica 4, 1058, doi:10.1016/S0031-8914(37)80203-7; Derjaguin (1934), Kolloid-Z. 69, 155, doi:10.1007/BF01433225.

use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Van der Waals force between all spheres of a case, and between them and walls.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VanDerWaals {
    /// Hamaker constant (J), about 1e-20 to 1e-19 of real materials.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub hamaker_constant: f64,
    /// Smallest gap (m): in narrower ones, and in contact, the force is that of this gap. About 0.2 to 0.4 nm of smooth surfaces, the height of
    /// the roughness of others.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub smallest_gap: f64,
    /// Gap from which on there is no force (m), above the smallest one.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub cut_off: f64,
}

impl VanDerWaals {
    /// The pull (N) over a gap (m) of spheres with this effective radius (m).
    pub fn pull(&self, gap: f64, radius: f64) -> f64 {
        if gap >= self.cut_off {
            return 0.0;
        }
        let gap = gap.max(self.smallest_gap);
        self.hamaker_constant * radius / (6.0 * gap * gap)
    }

    /// Potential energy (J) of spheres with this effective radius (m) at a gap (m).
    pub fn energy(&self, gap: f64, radius: f64) -> f64 {
        let (least, far) = (self.smallest_gap, 1.0 / self.cut_off);
        let part = match gap {
            _ if gap >= self.cut_off => 0.0,
            _ if gap >= least => 1.0 / gap - far,
            _ => (2.0 * least - gap) / (least * least) - far,
        };
        -self.hamaker_constant * radius / 6.0 * part
    }

    /// Work of adhesion (J/m^2) of the contact that has the force of the smallest gap.
    pub fn work_of_adhesion(&self) -> f64 {
        self.hamaker_constant / (12.0 * PI * self.smallest_gap * self.smallest_gap)
    }

    /// Steepest change of the pull with the gap (N/m), at the smallest gap.
    pub(super) fn steepest(&self, radius: f64) -> f64 {
        2.0 * self.pull(self.smallest_gap, radius) / self.smallest_gap
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAW: VanDerWaals = VanDerWaals { hamaker_constant: 2e-19, smallest_gap: 4e-10, cut_off: 1e-7 };

    #[test]
    fn the_pull_is_that_of_hamaker_between_the_smallest_gap_and_the_cut_off() {
        let radius = 5e-6;
        for (gap, pull) in [
            (1e-9, 2e-19 * 5e-6 / 6e-18),
            (9.9e-8, 2e-19 * 5e-6 / (6.0 * 9.9e-8 * 9.9e-8)),
            (1e-10, 2e-19 * 5e-6 / (6.0 * 1.6e-19)),
            (-1e-9, 2e-19 * 5e-6 / (6.0 * 1.6e-19)),
        ] {
            assert!((LAW.pull(gap, radius) / pull - 1.0).abs() < 1e-14, "{gap}");
        }
        assert_eq!([1e-7, 1e-6].map(|gap| LAW.pull(gap, radius).to_bits()), [0; 2]);
        assert!((2.0 * PI * LAW.work_of_adhesion() * radius / LAW.pull(0.0, radius) - 1.0).abs() < 1e-14);
    }

    #[test]
    fn the_pull_is_the_slope_of_an_energy_that_is_continuous_and_ends_at_nothing() {
        for gap in [-2e-10, 1e-10, 5e-10, 2e-9, 5e-8, 9e-8] {
            let step = 1e-4 * 4e-10;
            let slope = (LAW.energy(gap + step, 1e-6) - LAW.energy(gap - step, 1e-6)) / (2.0 * step);
            assert!((slope / LAW.pull(gap, 1e-6) - 1.0).abs() < 1e-6, "{gap}");
        }
        for gap in [4e-10, 1e-7] {
            let [below, above] = [1.0 - 1e-12, 1.0 + 1e-12].map(|part| LAW.energy(part * gap, 1e-6));
            assert!((below - above).abs() < 1e-10 * LAW.energy(0.0, 1e-6).abs(), "{gap}");
        }
        assert_eq!(LAW.energy(1e-7, 1e-6).abs().to_bits(), 0);
    }
}
