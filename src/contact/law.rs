//! The contact force: elastic and damped along the normal, friction across it.

use super::{ContactModel, Material, Overlap};
use crate::math::Vec3;
use std::f64::consts::FRAC_2_SQRT_PI;

/// Factor that makes small overlaps of spheres and planes follow Hertz (-), `4 / (3 sqrt(pi))`.
///
/// Lens and cap both have `V -> pi R d^2`, so that `sqrt(V d) = sqrt(pi R) d^(3/2)`; Marquardt et al. (2024) print
/// `4 / (3 pi)`, too small by `sqrt(pi)`.
pub const HERTZ_FACTOR: f64 = 2.0 / 3.0 * FRAC_2_SQRT_PI;

/// Damping of a contact whose bodies have not approached yet.
pub const UNSET: f64 = -1.0;

/// Slowest impact that is told from rest (m/s): keeps the damping finite.
const SLOWEST: f64 = 1e-290;

/// Sliding speed over transition speed beyond which friction is kinetic to the last bit.
const GROSS: f64 = 1e30;

/// Material constants of one pair, ready for use.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairLaw {
    /// Effective modulus (Pa).
    pub modulus: f64,
    /// Damping times impact speed, `c u0` (-).
    pub damping_number: f64,
    /// Static friction coefficient, corrected for the kinetic part (-); 0 switches friction off.
    pub friction_static: f64,
    /// Kinetic friction coefficient (-).
    pub friction_kinetic: f64,
    /// Speed of transition from static to kinetic friction (m/s).
    pub transition_velocity: f64,
}

impl PairLaw {
    /// Law between two materials, by their indices.
    ///
    /// # Panics
    /// If the coefficient of restitution is not in `(0, 1]`.
    pub fn new(model: &ContactModel, a: usize, b: usize) -> Self {
        let pair = model.pair(a, b);
        assert!(pair.restitution > 0.0 && pair.restitution <= 1.0);
        let ratio = pair.friction_kinetic / pair.friction_static;
        let ratio_squared = ratio * ratio;
        Self {
            modulus: effective_modulus(&model.materials[a], &model.materials[b]),
            damping_number: damping_number(pair.restitution),
            friction_static: if pair.friction_static > 0.0 {
                pair.friction_static * (1.0 - 0.09 * ratio_squared * ratio_squared)
            } else {
                0.0
            },
            friction_kinetic: pair.friction_kinetic,
            transition_velocity: pair.transition_velocity,
        }
    }

    /// The damping constant `c = (c u0) / u0` (s/m) of a contact, given what is known of it so far.
    ///
    /// Latched at the first evaluation at which the bodies approach, `approach = u0 > 0` (m/s); until then it stays
    /// [`UNSET`], which damps nothing. (The reference code latches whatever speed it meets first, separation too.)
    pub fn latch(&self, damping: f64, approach: f64) -> f64 {
        if damping < 0.0 && approach > 0.0 {
            self.damping_number / approach.max(SLOWEST)
        } else {
            damping
        }
    }

    /// Magnitude of the normal force (N).
    ///
    /// ```text
    /// F = k E* sqrt(V d) (1 + c v),   k = 4 / (3 sqrt(pi)),   F >= 0
    /// ```
    ///
    /// with volume `V`, depth `d`, approach speed `v` (m/s, positive while the bodies close in) and damping `c` from
    /// [`latch`](Self::latch). An impact keeps `-e u0 <= v <= u0`. Outside of `-u0 <= v <= u0` the product `c v` is held
    /// at its end, `|c v| <= c u0`, so that a contact made almost at rest and pushed later cannot explode.
    ///
    /// # Reference
    /// Nassauer and Kuna (2013), doi:10.1007/s10035-013-0417-9; damping Carvalho and Martins (2019),
    /// doi:10.1016/j.mechmachtheory.2019.03.028; bound on `c v`: ours.
    pub fn normal_force(&self, overlap: &Overlap, damping: f64, approach: f64) -> f64 {
        let elastic = HERTZ_FACTOR * self.modulus * (overlap.volume * overlap.depth).sqrt();
        let damped = damping.max(0.0) * approach;
        (elastic * (1.0 + damped.clamp(-self.damping_number, self.damping_number))).max(0.0)
    }

    /// Friction coefficient (-) at sliding speed `speed` (m/s).
    ///
    /// ```text
    /// mu = (2 mu_s* - mu_k) a^2 / (a^4 + 1) + mu_k - mu_k / (a^2 + 1),   a = speed / u_k
    /// mu_s* = mu_s (1 - 0.09 (mu_k / mu_s)^4)
    /// ```
    ///
    /// Rises from 0 at rest to `mu_s*` at the transition speed `u_k` (the maximum, close by, is `mu_s`) and falls to
    /// `mu_k`.
    ///
    /// # Reference
    /// Nassauer and Kuna (2013), Eqs. 7-9 of Marquardt et al. (2024).
    pub fn friction_coefficient(&self, speed: f64) -> f64 {
        if speed <= 0.0 || self.friction_static <= 0.0 {
            return 0.0;
        }
        let a = (speed / self.transition_velocity).min(GROSS);
        let s = a * a;
        // The sum as one fraction: divisions are what this costs.
        let rising = (2.0 * self.friction_static - self.friction_kinetic) * (s + 1.0);
        let kinetic = self.friction_kinetic * (s * s + 1.0);
        s * (rising + kinetic) / ((s * s + 1.0) * (s + 1.0))
    }

    /// Force on the first body (N); the second gets the opposite.
    ///
    /// `velocity` (m/s) is that of the first body relative to the second, both taken at `overlap.point`.
    pub fn force(&self, overlap: &Overlap, velocity: Vec3, damping: f64) -> Vec3 {
        let approach = velocity.dot(&overlap.normal);
        let normal = self.normal_force(overlap, damping, approach);
        let sliding = velocity - overlap.normal * approach;
        let speed = sliding.norm();
        let mut force = overlap.normal * -normal;
        if speed > 0.0 {
            force -= sliding * (self.friction_coefficient(speed) * normal / speed);
        }
        force
    }
}

/// `E* = [(1 - nu_a^2) / E_a + (1 - nu_b^2) / E_b]^-1` (Pa).
pub fn effective_modulus(first: &Material, second: &Material) -> f64 {
    let compliance = |p: &Material| (1.0 - p.poisson_ratio * p.poisson_ratio) / p.youngs_modulus;
    1.0 / (compliance(first) + compliance(second))
}

/// Damping times impact speed (-), `c u0 = 1.5 (1 - e) (11 - e) / (1 + 9 e)`.
///
/// # Reference
/// Carvalho and Martins (2019), doi:10.1016/j.mechmachtheory.2019.03.028: within 0.005 of the exact solution of
/// `(1 + e) y = ln((1 + y) / (1 - e y))`, `y = c u0`, for `e >= 0.3`.
pub fn damping_number(restitution: f64) -> f64 {
    1.5 * (1.0 - restitution) * (11.0 - restitution) / (1.0 + 9.0 * restitution)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::{ContactParams, ElasticLaw, Geometry, PairParams, sphere_sphere};

    const GLASS: ContactParams = ContactParams {
        material: Material {
            youngs_modulus: 5e6,
            poisson_ratio: 0.25,
        },
        pair: PairParams {
            restitution: 0.5,
            friction_static: 0.32,
            friction_kinetic: 0.16,
            transition_velocity: 1e-3,
        },
        enlargement: 0.0,
        geometry: Geometry::Exact,
        law: ElasticLaw::Paper,
    };

    fn law() -> PairLaw {
        PairLaw::new(&GLASS.into(), 0, 0)
    }

    fn lens(depth: f64) -> Overlap {
        sphere_sphere::overlap(1e-3, 1e-3, Vec3::new(2e-3 - depth, 0.0, 0.0)).unwrap()
    }

    #[test]
    fn a_static_force_is_the_lens_law() {
        let (radius, depth): (f64, f64) = (1e-3, 1e-4);
        let distance = 2.0 * radius - depth;
        let d = 2.0 * radius - distance;
        let volume = std::f64::consts::PI * d * d * (distance + 4.0 * radius) / 12.0;
        let modulus = 5e6 / (2.0 * (1.0 - 0.0625));
        let expected = 4.0 / (3.0 * std::f64::consts::PI.sqrt()) * modulus * (volume * d).sqrt();
        let force = law().force(&lens(depth), Vec3::zeros(), UNSET);
        println!("off the lens law by {:.1e}", -force.x / expected - 1.0);
        assert!((-force.x / expected - 1.0).abs() < 1e-12);
        assert!(force.y.abs() + force.z.abs() < 1e-30);
    }

    #[test]
    fn a_small_overlap_of_spheres_follows_hertz() {
        for (depth, tolerance) in [(1e-6, 1e-3), (1e-8, 1e-5)] {
            let hertz: f64 = 4.0 / 3.0 * law().modulus * (0.5e-3_f64).sqrt() * f64::powf(depth, 1.5);
            let force = law().normal_force(&lens(depth), UNSET, 0.0);
            println!("depth {depth:e} m: off Hertz by {:.1e}", force / hertz - 1.0);
            assert!((force / hertz - 1.0).abs() < tolerance, "{}", force / hertz);
        }
    }

    #[test]
    fn the_damping_number_nearly_solves_the_restitution_condition() {
        for e in [0.926, 0.9, 0.7, 0.5] {
            let y = damping_number(e);
            assert!(
                ((1.0 + e) * y - ((1.0 + y) / (1.0 - e * y)).ln()).abs() < 2e-3,
                "{e}"
            );
        }
        assert!(damping_number(1.0).abs() < 1e-15);
    }

    #[test]
    fn the_force_never_pulls() {
        let fast = law().latch(UNSET, 1e-3);
        for approach in [-1e-3, -1.0, -1e9] {
            assert!(law().normal_force(&lens(1e-5), fast, approach) >= 0.0);
        }
    }

    #[test]
    fn damping_is_latched_on_approach_and_then_stays() {
        let law = law();
        let mut damping = UNSET;
        for approach in [0.0, -0.3] {
            damping = law.latch(damping, approach);
            assert!(damping < 0.0, "nothing to latch at {approach}");
        }
        damping = law.latch(damping, 0.2);
        assert!((damping * 0.2 / damping_number(0.5) - 1.0).abs() < 1e-14);
        assert_eq!(law.latch(damping, 7.0).to_bits(), damping.to_bits());
    }

    #[test]
    fn a_contact_made_almost_at_rest_has_a_bounded_force_when_pushed_later() {
        let law = law();
        let elastic = law.normal_force(&lens(1e-5), UNSET, 0.0);
        for slowest in [1e-12, 1e-300, f64::from_bits(1)] {
            let damping = law.latch(UNSET, slowest);
            let pushed = law.normal_force(&lens(1e-5), damping, 0.1);
            assert!((pushed / elastic - (1.0 + law.damping_number)).abs() < 1e-12);
            assert!(law.normal_force(&lens(1e-5), damping, 0.0).is_finite());
        }
    }

    #[test]
    fn friction_is_static_at_the_transition_speed_and_kinetic_in_gross_sliding() {
        let law = law();
        let at = |a: f64| law.friction_coefficient(a * 1e-3);
        assert!((at(1.0) - 0.32 * (1.0 - 0.09 / 16.0)).abs() < 1e-14);
        assert!((at(1.09) - 0.3216).abs() < 1e-4, "the maximum");
        assert!((at(1e4) - 0.16).abs() < 1e-8);
        assert!(at(1e200).is_finite() && at(1e-200).abs() < 1e-30 && at(0.0).abs() < 1e-30);
    }

    #[test]
    fn gross_sliding_is_resisted_with_the_kinetic_coefficient_against_the_motion() {
        let (law, overlap) = (law(), lens(1e-5));
        let force = law.force(&overlap, Vec3::new(0.0, 3.0, -4.0), UNSET);
        let normal = law.normal_force(&overlap, UNSET, 0.0);
        assert!((force.yz().norm() / (0.16 * normal) - 1.0).abs() < 1e-6);
        assert!((force.y / force.z + 0.75).abs() < 1e-12 && force.y < 0.0);
    }

    #[test]
    fn bodies_of_unlike_stiffness_compress_like_springs_in_series() {
        let glass = GLASS.material;
        let soft = Material {
            youngs_modulus: 1e3,
            ..glass
        };
        let (a, b) = (effective_modulus(&glass, &soft), effective_modulus(&soft, &glass));
        assert!((a / b - 1.0).abs() < 1e-15);
        assert!((a / (1e3 / (1.0 - 0.0625)) - 1.0).abs() < 1e-3);
    }
}
