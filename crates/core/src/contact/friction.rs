//! Friction: the force across the normal of a contact.
//!
//! `N` is the normal force, `v` the sliding velocity of the first body relative to the second, `a` the radius of contact, `mu_s` and `mu_k`
//! the static and the kinetic coefficient. The second body pulls the first one back by
//!
//! ```text
//! Mindlin              f' = turned(f) min(1, a / a_before) + k v dt,   |f'| <= mu |N|;   F = f' + c v,   |F| <= mu |N|
//! MindlinDisplacement  s' = projected(s) + v dt,   f' = k s',   |f'| <= mu_k |N|;   F = f' + c v, or f' where it slides
//! MindlinDeresiewicz   a row of such springs, which slips from the edge of the contact inwards: [`partial_slip`](super::partial_slip);   F = f' + c v,   |F| <= mu_k |N|
//! NassauerKuna         F = mu(|v|) |N| v / |v|
//! k = 8 G* a,   c = 2 sqrt(5/6) b sqrt(k m*),   b = -ln e / sqrt(pi^2 + ln^2 e),   1/G* = (2 - nu_a) / G_a + (2 - nu_b) / G_b
//! a^2 = R d  (law `Hertz`),   V / (pi d)  (others: `R d` of small overlaps of spheres, `A / pi` of flat faces)
//! mu(v) = (2 mu_s* - mu_k) x^2 / (x^4 + 1) + mu_k - mu_k / (x^2 + 1),   x = v / u_k,   mu_s* = mu_s (1 - 0.09 (mu_k / mu_s)^4)
//! ```
//!
//! `Mindlin`: a contact sticks until `|f'| > mu_s |N|`, then slides with `mu = mu_k` until `|f'| <= mu_k |N|`. Its spring keeps its force
//! where the contact is loaded and gives part of it up where it is unloaded, so the energy `f^2 / (2 k)` that it holds never grows but by work done on it;
//! it turns with the normal and, about the normal, with the mean of both bodies. `MindlinDisplacement`
//! is that of LIGGGHTS: its spring has the stiffness of the present overlap, so a contact that is loaded while it sticks gains energy.
//!
//! References: Mindlin and Deresiewicz (1953), J. Appl. Mech. 20, 327; Thornton, Cummins and Cleary (2013), Powder Technol. 233, 30 (the force that is
//! rescaled where a contact is unloaded); Luding (2008), Granul. Matter 10, 235 (two coefficients); Tsuji, Tanaka and Ishida (1992), Powder Technol. 71,
//! 239 (`c`); Nassauer and Kuna (2013), doi:10.1007/s10035-013-0417-9, as Eqs. 7-9 of Marquardt et al. (2024).

#[cfg(test)]
mod tests;

use super::law::{PairProperties, dashpot_number};
use super::partial_slip::SpringRow;
use super::{ElasticLaw, FrictionLaw, Material, Overlap, PairParams};
use crate::math::Vec3;
use bytemuck::{Pod, Zeroable};
use std::f64::consts::FRAC_1_PI;

/// Sliding speed over transition speed beyond which friction is kinetic to the last bit.
const GROSS: f64 = 1e30;

/// Friction between two materials, ready for use.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Friction {
    /// Law.
    pub law: FrictionLaw,
    /// Static coefficient (-), of [`FrictionLaw::NassauerKuna`] corrected for the kinetic part; 0 switches friction off.
    pub fixed: f64,
    /// Kinetic coefficient (-).
    pub kinetic: f64,
    /// Speed of transition from static to kinetic friction (m/s) of [`FrictionLaw::NassauerKuna`].
    transition_velocity: f64,
    /// `8 G*` (Pa).
    stiffness: f64,
    /// `2 sqrt(5/6) b` (-).
    dashpot: f64,
}

/// Memory of the laws with a spring.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Spring {
    /// Its force on the second body (N); with [`FrictionLaw::MindlinDisplacement`] its length (m).
    force: [f64; 3],
    /// Radius of the contact (m), negative while it slides; 0 of one that has just begun.
    radius: f64,
}

/// Motion of the first body of a contact relative to the second.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RelativeMotion {
    /// Velocity at the point of contact (m/s).
    pub velocity: Vec3,
    /// The same half a sub-step before, where a law [asks for it](super::PairLaw::lags).
    pub before: Vec3,
    /// Mean angular velocity of both bodies (1/s), of the same time as `before`.
    pub spin: Vec3,
    /// Angular velocity of the first body relative to the second (1/s), likewise.
    pub turning: Vec3,
    /// Time since the contacts were evaluated last (s): the sub-step, and 0 in the first one.
    pub elapsed: f64,
}

impl FrictionLaw {
    /// True if the law has a spring, which remembers how far the bodies have slid.
    pub fn has_spring(self) -> bool {
        match self {
            Self::Mindlin | Self::MindlinDisplacement | Self::MindlinDeresiewicz => true,
            Self::NassauerKuna => false,
        }
    }

    /// True if the law has a coefficient of static friction.
    pub fn has_static(self) -> bool {
        self.parameters().contains(&"friction_static")
    }

    /// Numbers that the law remembers of a contact.
    pub(super) fn memory(self) -> usize {
        let bytes = match self {
            Self::Mindlin | Self::MindlinDisplacement => size_of::<Spring>(),
            Self::MindlinDeresiewicz => size_of::<SpringRow>(),
            Self::NassauerKuna => 0,
        };
        bytes / size_of::<f64>()
    }

    /// Names of the fields of [`PairParams`] that the law reads.
    pub(super) fn parameters(self) -> &'static [&'static str] {
        match self {
            Self::Mindlin => &["friction_static", "friction_kinetic", "restitution"],
            Self::MindlinDisplacement | Self::MindlinDeresiewicz => &["friction_kinetic", "restitution"],
            Self::NassauerKuna => &["friction_static", "friction_kinetic", "transition_velocity"],
        }
    }
}

impl Friction {
    /// Friction between two materials.
    pub(super) fn new(law: FrictionLaw, materials: [&Material; 2], pair: &PairParams) -> Self {
        let ratio = pair.friction_kinetic / pair.friction_static;
        let ratio_squared = ratio * ratio;
        let fixed = match law {
            _ if pair.friction_static <= 0.0 => 0.0,
            FrictionLaw::NassauerKuna => pair.friction_static * (1.0 - 0.09 * ratio_squared * ratio_squared),
            FrictionLaw::Mindlin | FrictionLaw::MindlinDisplacement | FrictionLaw::MindlinDeresiewicz => {
                pair.friction_static
            }
        };
        Self {
            law,
            fixed,
            kinetic: pair.friction_kinetic,
            transition_velocity: pair.transition_velocity,
            stiffness: 8.0 * shear_modulus(materials),
            dashpot: (2.0 / 3.0_f64).sqrt() * dashpot_number(pair.restitution),
        }
    }

    /// Coefficient (-) of [`FrictionLaw::NassauerKuna`] at a sliding speed (m/s).
    pub fn coefficient(&self, speed: f64) -> f64 {
        if speed <= 0.0 || self.fixed <= 0.0 {
            return 0.0;
        }
        let x = (speed / self.transition_velocity).min(GROSS);
        let s = x * x;
        // The sum as one fraction: divisions are what this costs.
        let rising = (2.0 * self.fixed - self.kinetic) * (s + 1.0);
        let kinetic = self.kinetic * (s * s + 1.0);
        s * (rising + kinetic) / ((s * s + 1.0) * (s + 1.0))
    }

    /// The force (N) that holds the first body back, at a sliding velocity (m/s) and a normal force (N), by a law without a spring.
    pub(super) fn of_speed(&self, sliding: Vec3, normal: f64) -> Vec3 {
        let speed = sliding.norm();
        if speed > 0.0 { sliding * (self.coefficient(speed) * normal / speed) } else { Vec3::zeros() }
    }

    /// Stiffness (N/m) and dashpot (kg/s) of a spring at a radius of contact (m).
    pub(super) fn spring(&self, radius: f64, pair: &PairProperties) -> [f64; 2] {
        let stiffness = self.stiffness * radius;
        [stiffness, self.dashpot * (stiffness * pair.mass()).sqrt()]
    }

    /// The same by one with a spring, at a radius of contact (m).
    pub(super) fn of_spring(
        &self,
        (axis, radius): (Vec3, f64),
        pair: &PairProperties,
        motion: &RelativeMotion,
        normal: f64,
        spring: &mut Spring,
    ) -> Vec3 {
        let across = |vector: Vec3| vector - axis * vector.dot(&axis);
        let (sliding, before) = (across(motion.before), Vec3::from(spring.force));
        let [stiffness, dashpot] = self.spring(radius, pair);
        let way = sliding * motion.elapsed;
        let damping = sliding * dashpot;
        if self.law == FrictionLaw::MindlinDisplacement {
            let length = across(before) + way;
            let force = length * stiffness;
            let slides = self.kinetic * normal;
            let size = force.norm();
            if size > slides {
                spring.force = (length * (slides / size)).into();
                return force * (slides / size);
            }
            spring.force = length.into();
            return force + damping;
        }
        let kept = turned(before, axis, motion);
        // One that has just begun has neither force nor radius.
        let kept = if radius < spring.radius.abs() { kept * (radius / spring.radius.abs()) } else { kept };
        let kinetic = self.kinetic.min(self.fixed);
        let most = normal * if spring.radius < 0.0 { kinetic } else { self.fixed };
        let force = kept + way * stiffness;
        let slides = force.norm() > most;
        let most = if slides { kinetic * normal } else { most };
        let force = capped(force, most);
        *spring = Spring { force: force.into(), radius: if slides { -radius } else { radius } };
        capped(force + damping, most)
    }

    /// The same by a row of springs, at a radius of contact (m) and a depth (m).
    pub(super) fn of_row(
        &self,
        (axis, radius, depth): (Vec3, f64, f64),
        pair: &PairProperties,
        motion: &RelativeMotion,
        normal: f64,
        row: &mut SpringRow,
    ) -> Vec3 {
        let [stiffness, dashpot] = self.spring(radius, pair);
        let (hardness, most) = (stiffness * depth, self.kinetic * normal);
        if hardness <= 0.0 {
            *row = SpringRow::zeroed();
            return Vec3::zeros();
        }
        let sliding = motion.before - axis * motion.before.dot(&axis);
        row.turn(|deflection| turned(deflection, axis, motion));
        let mean = row.slide(depth, 1.5 * most / hardness, sliding * motion.elapsed);
        capped(mean * stiffness + sliding * dashpot, most)
    }
}

/// A vector at most so long.
pub(super) fn capped(vector: Vec3, most: f64) -> Vec3 {
    let size = vector.norm();
    if size > most { vector * (most / size) } else { vector }
}

/// The force of a spring that turns with the contact: into the plane across the normal, as long as before, and about the normal.
pub(super) fn turned(force: Vec3, normal: Vec3, motion: &RelativeMotion) -> Vec3 {
    let size = force.norm();
    let about = normal * (motion.spin.dot(&normal) * motion.elapsed);
    let turned = force + about.cross(&force);
    let across = turned - normal * turned.dot(&normal);
    let length = across.norm();
    if length > 0.0 { across * (size / length) } else { Vec3::zeros() }
}

/// Radius of a contact (m).
pub(super) fn contact_radius(overlap: &Overlap, elastic: ElasticLaw, pair: &PairProperties) -> f64 {
    let square = match elastic {
        ElasticLaw::Hertz => pair.radius() * overlap.depth,
        ElasticLaw::OverlapVolume | ElasticLaw::OverlapEnergy => overlap.volume / overlap.depth * FRAC_1_PI,
    };
    // Volume and depth of nearly nothing may come out below zero.
    if square > 0.0 && square.is_finite() { square.sqrt() } else { 0.0 }
}

/// `G*` (Pa), `1/G* = (2 - nu_a) / G_a + (2 - nu_b) / G_b`, `G = E / (2 (1 + nu))`.
pub fn shear_modulus(materials: [&Material; 2]) -> f64 {
    let [a, b] =
        materials.map(|of| 2.0 * (1.0 + of.poisson_ratio) * (2.0 - of.poisson_ratio) / of.youngs_modulus);
    1.0 / (a + b)
}
