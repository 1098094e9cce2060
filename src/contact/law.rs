//! The contact force: elastic and damped along the normal, friction across it.
//!
//! With volume `V`, depth `d`, unit normal `n` (from the first body to the second), centre `x_c` of the overlap, and the
//! area `A` and moment `M` of the part of the first body's surface in it, the elastic force on the first body is
//!
//! ```text
//! Paper           F = -n k E* sqrt(V d),   k = 4 / (3 sqrt(pi)),   through x_c
//! OverlapEnergy   F = -n A E'(V),   torque -M E'(V),   E(V) = K V^(5/4)
//!                 K = (8/15) E* R_e^(-3/4) pi^(-5/4),   E'(V) = (2/3) E* pi^(-5/4) (V / R_e^3)^(1/4)
//! ```
//!
//! with the effective modulus `E*` ([`effective_modulus`]) and `1/R_e = 1/R_a + 1/R_b` of the spheres of equal volume (a wall
//! has an infinite radius). Both are Hertz for small overlaps of spheres with spheres and planes: there `V = pi R_e d^2` and
//! `A = 2 pi R_e d`. Both are multiplied by the damping `1 + c v`, and both get friction at `x_c` ([`PairLaw::act`]).
//!
//! Which to use:
//!
//! - `Paper` is the model of Marquardt et al. (2024) and the default. A face that lies flat on another is a linear spring of
//!   stiffness `k E* sqrt(A)`. But `sqrt(V d)` is not the gradient of anything where edges or corners are pressed in: an
//!   impact with e = 1 loses energy, the more the deeper it is. A cube of 1 mm that hits a wall at 0.1 m/s loses up to 2 % at
//!   E = 1e7 Pa, 5 % at 1e6 Pa, 12 % at 1e5 Pa, and 0.4 % at 1e9 Pa; two cubes that collide anyhow, at E = 1e7 Pa and 0.2 m/s,
//!   have between 87 % and 100.4 % of their energy left.
//! - `OverlapEnergy` is the gradient of a potential by construction, `dV = A n . dx + M . dw`, so elastic impacts of any
//!   bodies conserve energy, whatever the depth. Its price is a stiff onset of flat faces: there `V = A d` and
//!   `F ~ A^(5/4) d^(1/4)`, infinitely steep at `d = 0`. A box that rests on its face should sink in by next to
//!   nothing, and its stiffness there is `F / (4 d)`: no affordable time step resolves that, and the box hops (a cube of
//!   1 mm with E = 1e7 Pa and steps of 1 us by a tenth of its edge). And corners are softer than by the paper's law, so that
//!   impacts on them go deeper and are farther from those of rigid bodies. So take it where energy matters in
//!   impacts (granular gases, checks), not for beds of bodies with flat faces.
//!
//! Friction is stiff near rest: steps longer than about `u_k m / (mu F)` (with a third of the mass for a body that may turn)
//! let a sliding body jitter about its creep speed instead of approaching it; bounded, but not resolved.
//!
//! # Reference
//! Volume and depth: Nassauer and Kuna (2013), doi:10.1007/s10035-013-0417-9. A potential of the overlap volume: Feng, Han and Owen
//! (2012), Comput. Methods Appl. Mech. Engrg. 205-208, 169; the power 5/4 and `K`: ours, from Hertz.

use super::{ContactModel, DampingLaw, ElasticLaw, Material, Overlap};
use crate::math::Vec3;
use std::f64::consts::FRAC_2_SQRT_PI;

/// Factor that makes small overlaps of spheres and planes follow Hertz (-), `4 / (3 sqrt(pi))`.
///
/// Lens and cap both have `V -> pi R d^2`, so that `sqrt(V d) = sqrt(pi R) d^(3/2)`; Marquardt et al. (2024) print
/// `4 / (3 pi)`, too small by `sqrt(pi)`.
pub const HERTZ_FACTOR: f64 = 2.0 / 3.0 * FRAC_2_SQRT_PI;

/// Factor of the derivative of the energy of an overlap (-), `(2/3) pi^(-5/4)`.
pub const ENERGY_FACTOR: f64 = 2.0 / 3.0 * 0.239_090_686_568_373_64;

/// Damping of a contact whose bodies have not approached yet.
pub const UNSET: f64 = -1.0;

/// Slowest impact that is told from rest (m/s): keeps the damping finite.
const SLOWEST: f64 = 1e-290;

/// Sliding speed over transition speed beyond which friction is kinetic to the last bit.
const GROSS: f64 = 1e30;

/// Material constants of one pair, ready for use.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairLaw {
    /// How the elastic force follows from the overlap.
    pub elastic: ElasticLaw,
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
            elastic: model.law,
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

    /// The pressure `E'(V)` of [`ElasticLaw::OverlapEnergy`] (Pa) for bodies of these radii (m).
    ///
    /// `R_e^-3 = (1/R_a + 1/R_b)^3`; the fourth root is two square roots, alike on every machine.
    fn pressure(&self, overlap: &Overlap, radii: [f64; 2]) -> f64 {
        let curvature = 1.0 / radii[0] + 1.0 / radii[1];
        let part = overlap.volume * curvature * curvature * curvature;
        ENERGY_FACTOR * self.modulus * part.sqrt().sqrt()
    }

    /// Factor of the elastic force that damps it (-), `1 + c v >= 0`.
    ///
    /// With approach speed `v` (m/s, positive while the bodies close in) and damping `c` from [`latch`](Self::latch). An
    /// impact keeps `-e u0 <= v <= u0`. Outside of `-u0 <= v <= u0` the product `c v` is held at its end,
    /// `|c v| <= c u0`, so that a contact made almost at rest and pushed later cannot explode.
    ///
    /// # Reference
    /// Carvalho and Martins (2019), doi:10.1016/j.mechmachtheory.2019.03.028; bound on `c v`: ours.
    fn damped(&self, damping: f64, approach: f64) -> f64 {
        let damped = damping.max(0.0) * approach;
        1.0 + damped.clamp(-self.damping_number, self.damping_number)
    }

    /// Magnitude of the normal force (N), never negative.
    ///
    /// ```text
    /// Paper           F = k E* sqrt(V d) (1 + c v)
    /// OverlapEnergy   F = A E'(V) (1 + c v)
    /// ```
    ///
    /// for bodies with these radii of equal volume (m), which only the second one needs; that of a wall is infinite.
    pub fn normal_force(&self, overlap: &Overlap, radii: [f64; 2], damping: f64, approach: f64) -> f64 {
        let elastic = match self.elastic {
            ElasticLaw::Paper => HERTZ_FACTOR * self.modulus * (overlap.volume * overlap.depth).sqrt(),
            ElasticLaw::OverlapEnergy => self.pressure(overlap, radii) * overlap.area,
            ElasticLaw::Hertz => unimplemented!("H1 writes this"),
        };
        (elastic * self.damped(damping, approach)).max(0.0)
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

    /// Force and torques of a contact.
    ///
    /// `offset` (m) is the centre of the second body relative to the first, `radii` (m) those of spheres of equal volume,
    /// infinite for a wall. `velocity` (m/s) is that of the first body relative to the second, both taken at
    /// `overlap.point`.
    pub fn act(
        &self,
        overlap: &Overlap,
        offset: Vec3,
        radii: [f64; 2],
        velocity: Vec3,
        damping: f64,
    ) -> Action {
        let approach = velocity.dot(&overlap.normal);
        let normal = self.normal_force(overlap, radii, damping, approach);
        let sliding = velocity - overlap.normal * approach;
        let speed = sliding.norm();
        let mut force = overlap.normal * -normal;
        let mut friction = Vec3::zeros();
        if speed > 0.0 {
            friction = sliding * (self.friction_coefficient(speed) * normal / speed);
            force -= friction;
        }
        let levers = [overlap.point, overlap.point - offset];
        let torques = match self.elastic {
            ElasticLaw::Paper | ElasticLaw::Hertz => [levers[0].cross(&force), levers[1].cross(&-force)],
            ElasticLaw::OverlapEnergy => {
                let pressure = self.pressure(overlap, radii) * self.damped(damping, approach).max(0.0);
                let opposite = overlap.moment - offset.cross(&(overlap.normal * overlap.area));
                [
                    overlap.moment * -pressure - levers[0].cross(&friction),
                    opposite * pressure + levers[1].cross(&friction),
                ]
            }
        };
        Action { force, torques }
    }
}

/// What a contact does to its two bodies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Action {
    /// Force on the first body (N); the second gets the opposite.
    pub force: Vec3,
    /// Torques on the first and the second body, each about its own centre (N m).
    pub torques: [Vec3; 2],
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
    use crate::contact::{ContactParams, Geometry, PairParams, sphere_sphere};

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
        damping: DampingLaw::HuntCrossley,
    };

    /// Radii of the spheres of [`lens`] (m).
    const RADII: [f64; 2] = [1e-3; 2];

    fn law() -> PairLaw {
        PairLaw::new(&GLASS.into(), 0, 0)
    }

    fn energy_law() -> PairLaw {
        let law = ElasticLaw::OverlapEnergy;
        PairLaw::new(&ContactParams { law, ..GLASS }.into(), 0, 0)
    }

    /// Force on the first of two spheres.
    fn force(overlap: &Overlap, velocity: Vec3) -> Vec3 {
        let offset = Vec3::new(2e-3 - overlap.depth, 0.0, 0.0);
        law().act(overlap, offset, RADII, velocity, UNSET).force
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
        let force = force(&lens(depth), Vec3::zeros());
        println!("off the lens law by {:.1e}", -force.x / expected - 1.0);
        assert!((-force.x / expected - 1.0).abs() < 1e-12);
        assert!(force.y.abs() + force.z.abs() < 1e-30);
    }

    #[test]
    fn a_small_overlap_of_spheres_follows_hertz() {
        for (depth, tolerance) in [(1e-6, 1e-3), (1e-8, 1e-5)] {
            let hertz: f64 = 4.0 / 3.0 * law().modulus * (0.5e-3_f64).sqrt() * f64::powf(depth, 1.5);
            for law in [law(), energy_law()] {
                let force = law.normal_force(&lens(depth), RADII, UNSET, 0.0);
                println!("depth {depth:e} m: off Hertz by {:.1e}", force / hertz - 1.0);
                assert!((force / hertz - 1.0).abs() < tolerance, "{}", force / hertz);
            }
        }
    }

    #[test]
    fn a_small_cap_cut_off_by_a_wall_follows_hertz_by_both_laws() {
        let (radius, depth): (f64, f64) = (1e-3, 1e-8);
        let volume = std::f64::consts::PI * depth * depth * (3.0 * radius - depth) / 3.0;
        let cap = Overlap {
            volume,
            depth,
            point: Vec3::z() * -radius,
            normal: -Vec3::z(),
            area: std::f64::consts::PI * depth * (2.0 * radius - depth),
            moment: Vec3::zeros(),
        };
        for law in [law(), energy_law()] {
            let hertz = 4.0 / 3.0 * law.modulus * radius.sqrt() * f64::powf(depth, 1.5);
            let force = law.normal_force(&cap, [radius, f64::INFINITY], UNSET, 0.0);
            assert!((force / hertz - 1.0).abs() < 1e-5, "{}", force / hertz);
        }
    }

    #[test]
    fn the_force_of_the_energy_law_is_the_derivative_of_its_energy() {
        // Two spheres of unlike size: the energy E = K V^(5/4) against their distance, by central differences.
        let (law, radii) = (energy_law(), [1e-3, 0.4e-3]);
        let at = |distance: f64| sphere_sphere::overlap(radii[0], radii[1], Vec3::x() * distance).unwrap();
        let radius = 1.0 / (1.0 / radii[0] + 1.0 / radii[1]);
        let pi = std::f64::consts::PI;
        let energy = |distance: f64| {
            8.0 / 15.0
                * law.modulus
                * f64::powf(radius, -0.75)
                * f64::powf(pi, -1.25)
                * f64::powf(at(distance).volume, 1.25)
        };
        for distance in [1.399e-3, 1.35e-3, 1.1e-3] {
            let step = 1e-9;
            let slope = (energy(distance + step) - energy(distance - step)) / (2.0 * step);
            let force = law.normal_force(&at(distance), radii, UNSET, 0.0);
            assert!((force / -slope - 1.0).abs() < 1e-5, "{force} {slope}");
        }
    }

    #[test]
    fn the_torques_of_both_laws_keep_the_angular_momentum_of_the_pair() {
        let overlap = Overlap {
            volume: 1e-11,
            depth: 1e-4,
            point: Vec3::new(0.5e-3, 0.2e-3, -0.1e-3),
            normal: Vec3::new(0.6, 0.0, 0.8),
            area: 1e-7,
            moment: Vec3::new(2e-11, -3e-11, 1e-11),
        };
        let offset = Vec3::new(1e-3, 0.3e-3, 0.1e-3);
        for law in [law(), energy_law()] {
            let action = law.act(&overlap, offset, RADII, Vec3::new(0.3, -0.2, 0.5), 0.1);
            let total = action.torques[0] + action.torques[1] + offset.cross(&-action.force);
            assert!(total.norm() < 1e-14 * action.torques[0].norm());
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
            assert!(law().normal_force(&lens(1e-5), RADII, fast, approach) >= 0.0);
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
        let elastic = law.normal_force(&lens(1e-5), RADII, UNSET, 0.0);
        for slowest in [1e-12, 1e-300, f64::from_bits(1)] {
            let damping = law.latch(UNSET, slowest);
            let pushed = law.normal_force(&lens(1e-5), RADII, damping, 0.1);
            assert!((pushed / elastic - (1.0 + law.damping_number)).abs() < 1e-12);
            assert!(law.normal_force(&lens(1e-5), RADII, damping, 0.0).is_finite());
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
        let overlap = lens(1e-5);
        let force = force(&overlap, Vec3::new(0.0, 3.0, -4.0));
        let normal = law().normal_force(&overlap, RADII, UNSET, 0.0);
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
