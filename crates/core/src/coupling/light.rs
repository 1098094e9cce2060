//! Light bodies: a relaxing virtual mass on both sides of the equation of motion keeps the explicit coupling stable.
//!
//! ```text
//! (s + c) dU/dt = (F + M g) / (rho V) + c q      s = density ratio, c = h - s for s < h, none above
//! q' = q + (dU/dt - q) / T                       T = 5 + 0.6 (tau - 1/2)^(-3/2) steps,  1/2 <= h = 6 / N <= 1
//!
//! applied   A = (1 - m) (F + M g) + m Q,   Q' = Q + (A - Q) / T,   m = c / (s + c) = 1 - s / h
//! ```
//!
//! `F` is the load of the fluid in this step, which still answers to the velocity at its start; without more, a body with
//! less mass than the fluid moves within a step overreacts to it. The first two lines are the virtual mass of
//! Schwarz, Kempe and Froehlich (2015), except that its right side is the mean acceleration of the last `T` steps: the
//! acceleration of the last step alone (`T = 1`) is a negative resistance at the frequencies of sound, where a fluid with
//! delayed response does not resist as much. The third is the same, as a load on a body of mass `M = s rho V` for any
//! engine; torques likewise. With the weight go the constant force and torque that a case applies. A load that lasts is
//! applied in full. `T` and `h` are fitted to the stability of spheres (`docs/theory/coupling.md`).
//!
//! Reference: Schwarz, Kempe and Froehlich (2015), J. Comput. Phys. 281.

use crate::dem::Load;
use crate::math::Vec3;
use crate::shape::Shape;

/// Ratio of densities from which on a body has no virtual mass: the least, the largest, and this times the cells across it.
const HEAVY: f64 = 0.5;
const NEUTRAL: f64 = 1.0;
const HEAVY_CELLS: f64 = 6.0;
/// Time constant (steps), and the part of it that grows as the viscosity falls.
const STEPS: f64 = 5.0;
const STEPS_VISCOUS: f64 = 0.6;

/// Virtual mass of the bodies of one template.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VirtualMass {
    /// Part `m` of the applied load that is that of the past.
    share: f64,
    /// Part `1 / T` by which the mean load changes in a step.
    rate: f64,
}

impl VirtualMass {
    /// For bodies of `ratio` times the density of the fluid; `None` if they are heavy enough without.
    pub fn new(shape: &dyn Shape, ratio: f64, dx: f64, relaxation_time: f64) -> Option<Self> {
        let heavy = Self::heavy(shape, dx);
        let above_half = relaxation_time - 0.5;
        let steps = STEPS + STEPS_VISCOUS / (above_half * above_half.sqrt());
        (ratio < heavy).then(|| Self { share: 1.0 - ratio / heavy, rate: 1.0 / steps })
    }

    /// Density ratio `h` from which on a body needs none.
    ///
    /// The cells across a body are the geometric mean of its thickness and its diameter.
    pub fn heavy(shape: &dyn Shape, dx: f64) -> f64 {
        let across = (shape.thickness() * shape.equivalent_diameter()).sqrt() / dx;
        (HEAVY_CELLS / across).clamp(HEAVY, NEUTRAL)
    }

    /// The load to apply in place of that of the fluid, beside a `weight` and what else acts; `mean` is that of the past, with the weight.
    pub(super) fn apply(&self, load: Load, weight: Load, mean: &mut Load) -> Load {
        let part = |now: Vec3, mean: &mut Vec3| {
            let applied = now + (*mean - now) * self.share;
            *mean += (applied - *mean) * self.rate;
            applied
        };
        Load {
            force: part(load.force + weight.force, &mut mean.force) - weight.force,
            torque: part(load.torque + weight.torque, &mut mean.torque) - weight.torque,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::Sphere;

    fn of(ratio: f64) -> Option<VirtualMass> {
        VirtualMass::new(&Sphere { radius: 0.5 }, ratio, 1.0 / 12.0, 0.6)
    }

    #[test]
    fn a_heavy_body_has_none_and_the_limit_rises_on_coarse_lattices() {
        assert_eq!((of(1.0), of(0.501)), (None, None));
        assert!(of(0.499).is_some());
        for (dx, limit) in [(0.1, 0.6), (0.125, 0.75), (0.25, 1.0)] {
            assert!((VirtualMass::heavy(&Sphere { radius: 0.5 }, dx) - limit).abs() < 1e-15);
        }
    }

    #[test]
    fn a_load_that_begins_accelerates_body_and_virtual_mass_and_one_that_lasts_the_body_alone() {
        let (mass, mut mean) = (of(0.05).unwrap(), Load::default());
        let load = Load { force: Vec3::x() * 4.0, torque: Vec3::y() };
        let weight = Load { force: -Vec3::x(), torque: Vec3::zeros() };
        let first = mass.apply(load, weight, &mut mean);
        // Net force 3 on 0.5 rho V, of which the body is a tenth.
        assert!((first.force - Vec3::x() * 1.3).norm() < 1e-14, "{first:?}");
        assert!((first.torque - Vec3::y() * 0.1).norm() < 1e-14, "{first:?}");
        let last = (0..6000).fold(first, |_, _| mass.apply(load, weight, &mut mean));
        assert!((last.force - load.force).norm() + (last.torque - load.torque).norm() < 1e-9, "{last:?}");
    }

    /// `s dU = A`, with a fluid that resists the velocity of two steps ago.
    fn growth(apply: impl Fn(Load, &mut Load) -> Load) -> f64 {
        let (mut mean, mut u) = (Load::default(), [1.0_f64; 3]);
        for _ in 0..2000 {
            let load = Load { force: Vec3::x() * (-0.1 * u[0]), ..Load::default() };
            let next = u[2] + apply(load, &mut mean).force.x / 0.05;
            u = [u[1], u[2], next];
            if next.abs() > 1e6 {
                break;
            }
        }
        u[2].abs()
    }

    #[test]
    fn a_light_body_in_a_fluid_that_answers_late_is_unstable_without_and_stable_with_it() {
        assert!(growth(|load, _| load) > 1e6);
        let of_one_step = VirtualMass { rate: 1.0, ..of(0.05).unwrap() };
        assert!(growth(|load, mean| of_one_step.apply(load, Load::default(), mean)) > 1e-2);
        let mass = of(0.05).unwrap();
        assert!(growth(|load, mean| mass.apply(load, Load::default(), mean)) < 1e-2);
    }
}
