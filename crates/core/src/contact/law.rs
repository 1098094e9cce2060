//! The contact force: elastic and damped along the normal, friction across it.
//!
//! With volume `V`, depth `d`, unit normal `n` (from the first body to the second), centre `x_c` of the overlap, and the
//! area `A` and moment `M` of the part of the first body's surface in it, the elastic force on the first body is
//!
//! ```text
//! Paper           F = -n k E* sqrt(V d),   k = 4 / (3 sqrt(pi)),   through x_c
//! OverlapEnergy   F = -n A E'(V),   torque -M E'(V),   E(V) = K V^(5/4)
//!                 K = (8/15) E* R_e^(-3/4) pi^(-5/4),   E'(V) = (2/3) E* pi^(-5/4) (V / R_e^3)^(1/4)
//! Hertz           F = -n (4/3) E* sqrt(R_e) d^(3/2),   through x_c
//! ```
//!
//! with the effective modulus `E*` ([`effective_modulus`]) and `1/R_e = 1/R_a + 1/R_b` of the spheres of equal volume (a wall
//! has an infinite radius). The first two are Hertz for small overlaps of spheres with spheres and planes: there
//! `V = pi R_e d^2` and `A = 2 pi R_e d`, and `Paper` is `Hertz` times `sqrt(1 - d/(6R))` for equal spheres, `sqrt(1 - d/(3R))`
//! for a sphere and a plane. To each belongs a damping, with the approach speed `v`,
//!
//! ```text
//! HuntCrossley   F (1 + c v),   c = 1.5 (1 - e) (11 - e) / (1 + 9 e) / u0,   u0 latched when the bodies first approach
//! Tsuji          F - n sqrt(5) b sqrt(m* |F| / d) v,   b = -ln e / sqrt(pi^2 + ln^2 e),   through x_c
//! ```
//!
//! `1/m* = 1/m_a + 1/m_b`, the mass of a wall being infinite, and friction at `x_c` ([`PairLaw::act`]).
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
//! - `Hertz` with `Tsuji` is the normal force of LIGGGHTS (`gran model hertz`, `limitForce off`): take both for comparisons with
//!   it, for spheres. For other bodies `Hertz` sees the depth and nothing of the shape: a face is as stiff as a sphere.
//! - `HuntCrossley` never pulls and needs the impact speed, so a contact has a memory; what it makes of `e` is exact to 0.0002
//!   for `e >= 0.5`, and 0.03 too much at 0.1. `Tsuji` has no memory, and in an impact of spheres by `Hertz` gives just `e`
//!   at any speed; but its dashpot sets in steeply, as `d^(1/4)`, and pulls the bodies together at the end of an impact (by up to
//!   a tenth of the largest elastic force), where friction follows `|F|`. On flat faces, which are linear springs, it
//!   damps more than `e` says, by the factor `sqrt(5) / 2`. Both agree in how impacts end, not in their course: at e = 0.5
//!   `HuntCrossley` lasts 2.4 % longer and goes 1.5 % less deep. So take `HuntCrossley` unless there is a reason not to.
//!
//! Friction is stiff near rest: steps longer than about `u_k m / (mu F)` (with a third of the mass for a body that may turn)
//! let a sliding body jitter about its creep speed instead of approaching it; bounded, but not resolved.
//!
//! # Reference
//! Volume and depth: Nassauer and Kuna (2013), doi:10.1007/s10035-013-0417-9. A potential of the overlap volume: Feng, Han and Owen
//! (2012), Comput. Methods Appl. Mech. Engrg. 205-208, 169; the power 5/4 and `K`: ours, from Hertz. `Tsuji`: Tsuji, Tanaka and
//! Ishida (1992), Powder Technol. 71, 239, with the closed form of Antypov and Elliott (2011), EPL 94, 50004.

#[cfg(test)]
mod tests;

use super::{ContactModel, DampingLaw, ElasticLaw, Material, Overlap};
use crate::math::Vec3;
use std::f64::consts::{FRAC_2_SQRT_PI, PI};

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
    /// How the normal force is damped.
    pub damping: DampingLaw,
    /// Effective modulus (Pa).
    pub modulus: f64,
    /// Damping times impact speed, `c u0` (-), of [`DampingLaw::HuntCrossley`].
    pub damping_number: f64,
    /// `sqrt(5) b` (-) of [`DampingLaw::Tsuji`].
    pub dashpot_number: f64,
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
            damping: model.damping,
            modulus: effective_modulus(&model.materials[a], &model.materials[b]),
            damping_number: damping_number(pair.restitution),
            dashpot_number: dashpot_number(pair.restitution),
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
    /// [`DampingLaw::Tsuji`] latches nothing.
    pub fn latch(&self, damping: f64, approach: f64) -> f64 {
        if self.damping == DampingLaw::HuntCrossley && damping < 0.0 && approach > 0.0 {
            self.damping_number / approach.max(SLOWEST)
        } else {
            damping
        }
    }

    /// The pressure `E'(V)` of [`ElasticLaw::OverlapEnergy`] (Pa).
    ///
    /// `R_e^-3 = (1/R_a + 1/R_b)^3`; the fourth root is two square roots, alike on every machine.
    fn pressure(&self, overlap: &Overlap, couple: &Couple) -> f64 {
        let curvature = 1.0 / couple.radii[0] + 1.0 / couple.radii[1];
        let part = overlap.volume * curvature * curvature * curvature;
        ENERGY_FACTOR * self.modulus * part.sqrt().sqrt()
    }

    /// Magnitude of the elastic force (N).
    fn elastic_force(&self, overlap: &Overlap, couple: &Couple) -> f64 {
        let force = match self.elastic {
            ElasticLaw::Paper => HERTZ_FACTOR * self.modulus * (overlap.volume * overlap.depth).sqrt(),
            ElasticLaw::OverlapEnergy => self.pressure(overlap, couple) * overlap.area,
            ElasticLaw::Hertz => {
                4.0 / 3.0 * self.modulus * (couple.radius() * overlap.depth).sqrt() * overlap.depth
            }
        };
        // Volume and depth of nearly nothing may come out below zero.
        force.max(0.0)
    }

    /// What damps an elastic force (N): the factor (-) it is multiplied by, and the force (N) that is added.
    ///
    /// With approach speed `v` (m/s, positive while the bodies close in). [`HuntCrossley`](DampingLaw::HuntCrossley): `1 + c v >= 0`
    /// with `c` from [`latch`](Self::latch). An impact keeps `-e u0 <= v <= u0`. Outside of `-u0 <= v <= u0` the product
    /// `c v` is held at its end, `|c v| <= c u0`, so that a contact made almost at rest and pushed later cannot explode.
    /// [`Tsuji`](DampingLaw::Tsuji): `sqrt(5) b sqrt(m* F / d) v`, of either sign; for Hertz `sqrt(5) b sqrt(m* K) d^(1/4) v`
    /// with `F = K d^(3/2)`.
    ///
    /// # Reference
    /// Carvalho and Martins (2019), doi:10.1016/j.mechmachtheory.2019.03.028; bound on `c v`: ours.
    fn damped(&self, elastic: f64, depth: f64, couple: &Couple, damping: f64, approach: f64) -> [f64; 2] {
        match self.damping {
            DampingLaw::HuntCrossley => {
                let damped = damping.max(0.0) * approach;
                let factor = 1.0 + damped.clamp(-self.damping_number, self.damping_number);
                [factor.max(0.0), 0.0]
            }
            DampingLaw::Tsuji if depth > 0.0 => {
                let resistance = self.dashpot_number * (couple.mass() * (elastic / depth)).sqrt();
                [1.0, resistance * approach]
            }
            DampingLaw::Tsuji => [1.0, 0.0],
        }
    }

    /// The normal force (N), positive if it pushes the bodies apart; only [`DampingLaw::Tsuji`] pulls.
    ///
    /// ```text
    /// Paper           F = k E* sqrt(V d)
    /// OverlapEnergy   F = A E'(V)
    /// Hertz           F = 4/3 E* sqrt(R_e) d^(3/2)
    /// ```
    ///
    /// damped: `F (1 + c v)` or `F + sqrt(5) b sqrt(m* F / d) v`, with approach speed `v` (m/s) and `damping` from
    /// [`latch`](Self::latch).
    pub fn normal_force(&self, overlap: &Overlap, couple: &Couple, damping: f64, approach: f64) -> f64 {
        let elastic = self.elastic_force(overlap, couple);
        let [factor, dashpot] = self.damped(elastic, overlap.depth, couple, damping, approach);
        elastic * factor + dashpot
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
    /// `offset` (m) is the centre of the second body relative to the first. `velocity` (m/s) is that of the first body
    /// relative to the second, both taken at `overlap.point`. Friction follows the magnitude of the normal force.
    pub fn act(
        &self,
        overlap: &Overlap,
        offset: Vec3,
        couple: &Couple,
        velocity: Vec3,
        damping: f64,
    ) -> Action {
        let approach = velocity.dot(&overlap.normal);
        let elastic = self.elastic_force(overlap, couple);
        let [factor, dashpot] = self.damped(elastic, overlap.depth, couple, damping, approach);
        let normal = elastic * factor + dashpot;
        let sliding = velocity - overlap.normal * approach;
        let speed = sliding.norm();
        let mut force = overlap.normal * -normal;
        let mut friction = Vec3::zeros();
        if speed > 0.0 {
            friction = sliding * (self.friction_coefficient(speed) * normal.abs() / speed);
            force -= friction;
        }
        let levers = [overlap.point, overlap.point - offset];
        let torques = match self.elastic {
            ElasticLaw::Paper | ElasticLaw::Hertz => [levers[0].cross(&force), levers[1].cross(&-force)],
            ElasticLaw::OverlapEnergy => {
                let pressure = self.pressure(overlap, couple) * factor;
                let opposite = overlap.moment - offset.cross(&(overlap.normal * overlap.area));
                let through_centre = friction + overlap.normal * dashpot;
                [
                    overlap.moment * -pressure - levers[0].cross(&through_centre),
                    opposite * pressure + levers[1].cross(&through_centre),
                ]
            }
        };
        Action { force, torques }
    }
}

/// Sizes and masses of the two bodies of a contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Couple {
    /// Radii of the spheres of equal volume (m), infinite for a wall.
    pub radii: [f64; 2],
    /// Masses (kg), infinite for a wall.
    pub masses: [f64; 2],
}

impl Couple {
    /// Effective radius (m), `1/R_e = 1/R_a + 1/R_b`; that of a body and a wall is that of the body.
    pub fn radius(&self) -> f64 {
        self.radii[0] / (1.0 + self.radii[0] / self.radii[1])
    }

    /// Reduced mass (kg), `1/m* = 1/m_a + 1/m_b`; that of a body and a wall is that of the body.
    pub fn mass(&self) -> f64 {
        self.masses[0] / (1.0 + self.masses[0] / self.masses[1])
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

/// Dashpot of [`DampingLaw::Tsuji`] (-), `sqrt(5) b`, `b = -ln e / sqrt(pi^2 + ln^2 e)`.
///
/// # Reference
/// Antypov and Elliott (2011), doi:10.1209/0295-5075/94/50004: with Hertz, exactly `e` at any impact speed.
pub fn dashpot_number(restitution: f64) -> f64 {
    let decay = -libm::log(restitution);
    let square = PI * PI + decay * decay;
    5.0_f64.sqrt() * decay / square.sqrt()
}
