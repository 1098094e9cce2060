//! Contact force: elastic and damped along the normal, friction across it.
//!
//! With volume `V`, depth `d`, normal `n` (from the first body to the second), centre `x_c`, area `A` and moment
//! `M` of the overlap, modulus `E*` ([`effective_modulus`]), `1/R_e = 1/R_a + 1/R_b`, `1/m* = 1/m_a + 1/m_b`,
//! restitution `e` and approach speed `v`:
//!
//! ```text
//! OverlapVolume   F = -n k E* sqrt(V d),   k = 4 / (3 sqrt(pi)),   through x_c
//! OverlapEnergy   F = -n A E'(V),   torque -M E'(V),   E(V) = K V^(5/4),   K = (8/15) E* R_e^(-3/4) pi^(-5/4)
//! Hertz           F = -n (4/3) E* sqrt(R_e) d^(3/2),   through x_c
//! HuntCrossley    F (1 + y v / max(u0, u_d)),   y = 1.5 (1 - e) (11 - e) / (1 + 9 e),   u_d = sqrt((2/3) |F| d / m*)
//! Tsuji           F - n sqrt(5) b sqrt(m* |F| / d) v,   b = -ln e / sqrt(pi^2 + ln^2 e),   through x_c
//! ```
//!
//! with the approach speed `u0` when the bodies first approach. Friction: [`friction`](super::friction); cohesion: [`cohesion`](super::cohesion). `docs/theory/contact.md` says which law to use, with numbers.
//!
//! References: Nassauer and Kuna (2013), doi:10.1007/s10035-013-0417-9; Feng, Han and Owen (2012), Comput. Methods
//! Appl. Mech. Engrg. 205-208, 169; Tsuji, Tanaka and Ishida (1992), Powder Technol. 71, 239; Antypov and Elliott
//! (2011), EPL 94, 50004.

#[cfg(test)]
mod tests;

use super::friction::contact_radius;
use super::rolling::Pressed;
use super::{
    Cohesion, ContactModel, DampingLaw, ElasticLaw, Friction, FrictionLaw, Material, Overlap, RelativeMotion,
    Turning,
};
use crate::math::Vec3;
use bytemuck::{Pod, Zeroable};
use std::f64::consts::{FRAC_2_SQRT_PI, PI};

/// Factor that makes small overlaps of spheres and planes follow Hertz (-), `4 / (3 sqrt(pi))`.
///
/// Lens and cap both have `V -> pi R d^2`; Marquardt et al. (2024) print `4 / (3 pi)`, too small by `sqrt(pi)`.
const HERTZ_FACTOR: f64 = 2.0 / 3.0 * FRAC_2_SQRT_PI;

/// Factor of the derivative of the energy of an overlap (-), `(2/3) pi^(-5/4)`.
const ENERGY_FACTOR: f64 = 2.0 / 3.0 * 0.239_090_686_568_373_64;

/// Damping of a contact whose bodies have not approached yet.
const UNSET: f64 = -1.0;

/// Slowest impact that is distinguished from rest (m/s): keeps the damping finite.
const SLOWEST: f64 = 1e-290;

/// Greatest stiffness of [`ElasticLaw::OverlapEnergy`] times the square of a sub-step over the reduced mass (-): a period of 12
/// sub-steps.
const STIFFEST: f64 = 0.25;

/// Greatest damping of [`DampingLaw::HuntCrossley`] times a sub-step over the reduced mass (-); beyond 1 the explicit
/// integration of a contact at rest is unstable.
const MOST_DAMPED: f64 = 0.5;

/// Material constants of one pair, ready for use.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairLaw {
    /// Law of the elastic force.
    pub elastic: ElasticLaw,
    /// Law of the normal damping.
    pub damping: DampingLaw,
    /// Effective modulus (Pa).
    pub modulus: f64,
    /// Damping times impact speed, `c u0` (-), of [`DampingLaw::HuntCrossley`].
    pub damping_number: f64,
    /// `sqrt(5) b` (-) of [`DampingLaw::Tsuji`].
    pub dashpot_number: f64,
    /// Friction.
    pub friction: Friction,
    /// Resistance to rolling and twisting.
    pub turning: Turning,
    /// Cohesion.
    pub cohesion: Cohesion,
}

impl ContactModel {
    /// Names of the fields of [`Material`] and [`PairParams`](super::PairParams) that the laws read; a case that gives another one is
    /// refused.
    pub fn parameters(&self) -> Vec<&'static str> {
        let elastic: &[&str] = match self.law {
            ElasticLaw::OverlapVolume | ElasticLaw::OverlapEnergy | ElasticLaw::Hertz => {
                &["youngs_modulus", "poisson_ratio"]
            }
        };
        let damping: &[&str] = match self.damping {
            DampingLaw::HuntCrossley | DampingLaw::Tsuji => &["restitution"],
        };
        let rolling: &[&str] = if self.rolling.is_given() { &["rolling_friction"] } else { &[] };
        let mut all =
            [elastic, damping, self.friction.parameters(), rolling, self.cohesion.parameters()].concat();
        all.sort_unstable();
        all.dedup();
        all
    }
}

/// Memory of [`DampingLaw::HuntCrossley`].
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct ImpactMemory {
    /// Damping constant (s/m); negative until the bodies approach, see [`PairLaw::latch`].
    damping: f64,
}

impl ContactModel {
    /// Numbers that the laws remember of each contact from sub-step to sub-step: [`PairLaw::begin`] sets them, [`PairLaw::act`] reads and
    /// changes them, and nothing else knows what they are.
    pub fn memory(&self) -> usize {
        self.damping.memory() + self.friction.memory() + Turning::memory(self)
    }
}

impl DampingLaw {
    /// Numbers that the law remembers of a contact.
    fn memory(self) -> usize {
        match self {
            Self::HuntCrossley => size_of::<ImpactMemory>() / size_of::<f64>(),
            Self::Tsuji => 0,
        }
    }

    /// True if the law takes velocities of half a step before, as the velocity Verlet scheme of LIGGGHTS has them.
    pub fn lags(self) -> bool {
        match self {
            Self::HuntCrossley => false,
            Self::Tsuji => true,
        }
    }

    /// Coefficient of restitution that comes out of one that is set (-), where it is another one: in a dry head-on impact, whatever the
    /// elastic force and the speed.
    pub fn resulting_restitution(self, set: f64) -> Option<f64> {
        match self {
            Self::HuntCrossley => Some(resulting_restitution(damping_number(set))),
            Self::Tsuji => None,
        }
    }
}

impl PairLaw {
    /// Law between two materials, by their indices.
    ///
    /// # Panics
    /// If the coefficient of restitution is not in `(0, 1]`.
    pub fn new(model: &ContactModel, a: usize, b: usize) -> Self {
        let pair = model.pair(a, b);
        assert!(pair.restitution > 0.0 && pair.restitution <= 1.0);
        let materials = [a, b].map(|index| &model.materials[index]);
        let cohesion = Cohesion::new(model, a, b);
        Self {
            elastic: if cohesion.has_neck() { ElasticLaw::Hertz } else { model.law },
            damping: model.damping,
            modulus: effective_modulus(materials[0], materials[1]),
            damping_number: damping_number(pair.restitution),
            dashpot_number: dashpot_number(pair.restitution),
            friction: Friction::new(model.friction, materials, pair),
            turning: Turning::new(model, pair),
            cohesion,
        }
    }

    /// True if a law takes velocities of half a step before, see [`RelativeMotion`].
    pub fn lags(&self) -> bool {
        self.damping.lags() || self.friction.law.has_spring() || !self.turning.is_none()
    }

    /// Sets the memory of a contact that has just begun, which is zero.
    pub fn begin(&self, memory: &mut [f64]) {
        match self.damping {
            DampingLaw::HuntCrossley => memory_of::<ImpactMemory>(memory).damping = UNSET,
            DampingLaw::Tsuji => {}
        }
    }

    /// The damping constant `c = (c u0) / u0` (s/m) of a contact, from its history so far.
    ///
    /// Stored at the first evaluation at which the bodies approach, `approach = u0 > 0` (m/s); until then it stays
    /// [`UNSET`], which damps nothing.
    fn latch(&self, damping: f64, approach: f64) -> f64 {
        if damping < 0.0 && approach > 0.0 { self.damping_number / approach.max(SLOWEST) } else { damping }
    }

    /// The pressure `E'(V)` of [`ElasticLaw::OverlapEnergy`] (Pa). The fourth root is two square roots, alike on every
    /// machine.
    ///
    /// The force of flat faces sets in as `d^(1/4)`, with an infinite slope. Where it is stiffer than a sub-step `dt` resolves it is
    /// that of a spring, `F <= m* V / (4 A dt^2)` (our rule), which is conservative on a face.
    fn pressure(&self, overlap: &Overlap, pair: &PairProperties) -> f64 {
        let curvature = 1.0 / pair.radii[0] + 1.0 / pair.radii[1];
        let part = overlap.volume * curvature * curvature * curvature;
        let span = overlap.area * pair.dt;
        let onset = STIFFEST * pair.mass() * overlap.volume / (span * span);
        // An overlap without area has no limit.
        (ENERGY_FACTOR * self.modulus * part.sqrt().sqrt()).min(onset)
    }

    /// Magnitude of the elastic force (N).
    fn elastic_force(&self, overlap: &Overlap, pair: &PairProperties) -> f64 {
        let force = match self.elastic {
            ElasticLaw::OverlapVolume => {
                HERTZ_FACTOR * self.modulus * (overlap.volume * overlap.depth).sqrt()
            }
            ElasticLaw::OverlapEnergy => self.pressure(overlap, pair) * overlap.area,
            ElasticLaw::Hertz => {
                4.0 / 3.0 * self.modulus * (pair.radius() * overlap.depth).sqrt() * overlap.depth
            }
        };
        // Volume and depth of nearly nothing may come out below zero.
        force.max(0.0)
    }

    /// Damping of an elastic force (N): the factor (-) by which it is multiplied, and the force (N) that is added.
    ///
    /// An impact has the approach speed `-e u0 <= v <= u0` and a depth that it reaches by its own energy: with a force `F ~ d^p`
    /// that is `F d / (p + 1) <= m* u0^2 / 2`, and `p <= 2` for convex bodies, so that `u_d <= u0`. A contact that was made almost
    /// at rest and is loaded later has no impact speed, but a depth: `u_d` is the slowest impact that would reach it. So a contact at
    /// rest under the force `F` is a damped oscillator, of damping ratio `y / 2` with Hertz (our rule; Marquardt et al. (2024) keep
    /// `c = y / u0`, which grows beyond all bounds as `u0` vanishes). The damping is never more than sub-steps of `dt` resolve,
    /// `c F <= m* / (2 dt)`, which impacts at `e >= 0.3` do not reach if they last ten sub-steps, and `-y <= c v <= y`.
    ///
    /// # Reference
    /// Carvalho and Martins (2019), doi:10.1016/j.mechmachtheory.2019.03.028.
    fn damped(
        &self,
        elastic: f64,
        depth: f64,
        pair: &PairProperties,
        damping: f64,
        approach: f64,
    ) -> [f64; 2] {
        match self.damping {
            DampingLaw::HuntCrossley => {
                let slowest = (2.0 / 3.0 * elastic * depth.max(0.0) / pair.mass()).sqrt().max(SLOWEST);
                let resolved = MOST_DAMPED * pair.mass() / (elastic * pair.dt);
                let damping = damping.max(0.0).min(self.damping_number / slowest).min(resolved);
                let damped = (damping * approach).clamp(-self.damping_number, self.damping_number);
                let factor = 1.0 + damped;
                [factor.max(0.0), 0.0]
            }
            DampingLaw::Tsuji if depth > 0.0 => {
                let resistance = self.dashpot_number * (pair.mass() * (elastic / depth)).sqrt();
                [1.0, resistance * approach]
            }
            DampingLaw::Tsuji => [1.0, 0.0],
        }
    }

    /// Normal force (N), positive if it pushes the bodies apart; its elastic part, and the factor and the summand of its damping.
    fn normal(&self, overlap: &Overlap, pair: &PairProperties, damping: f64, approach: f64) -> [f64; 4] {
        let elastic = self.elastic_force(overlap, pair);
        let [factor, dashpot] = self.damped(elastic, overlap.depth, pair, damping, approach);
        [elastic * factor + dashpot, elastic, factor, dashpot]
    }

    /// Force and torques of a contact, of bodies that overlap or that hold on to each other by a [neck](Overlap::neck).
    ///
    /// `offset` (m) is the centre of the second body relative to the first; `motion` is that at `overlap.point`. Friction follows the
    /// magnitude of the normal force without cohesion ([`cohesion`](super::cohesion)). `memory` has the [numbers](ContactModel::memory) that the laws remember of this contact, from the
    /// sub-step before.
    pub fn act(
        &self,
        overlap: &Overlap,
        offset: Vec3,
        pair: &PairProperties,
        motion: &RelativeMotion,
        memory: &mut [f64],
    ) -> Action {
        let (impact, spring) = memory.split_at_mut(self.damping.memory());
        let (spring, torques) = spring.split_at_mut(self.friction.law.memory());
        // The elastic force of a neck is that of the disc in which the bodies meet.
        let pressed;
        let overlap = if self.cohesion.has_neck() {
            pressed = Overlap { depth: self.cohesion.pressed(overlap.depth, pair.radius()), ..*overlap };
            &pressed
        } else {
            overlap
        };
        let radius = || contact_radius(overlap, self.elastic, pair);
        let velocity = if self.damping.lags() { motion.before } else { motion.velocity };
        let approach = velocity.dot(&overlap.normal);
        let damping = match self.damping {
            DampingLaw::HuntCrossley => {
                let impact = memory_of::<ImpactMemory>(impact);
                impact.damping = self.latch(impact.damping, approach);
                impact.damping
            }
            DampingLaw::Tsuji => UNSET,
        };
        let [normal, elastic, factor, dashpot] = self.normal(overlap, pair, damping, approach);
        let pull = self.cohesion.force(overlap.area, overlap.depth, pair.radius());
        let grip = self.cohesion.grip(normal, pull, pair.radius());
        let friction = match self.friction.law {
            FrictionLaw::Mindlin | FrictionLaw::MindlinDisplacement => {
                self.friction.of_spring((overlap.normal, radius()), pair, motion, grip, memory_of(spring))
            }
            FrictionLaw::MindlinDeresiewicz => {
                let contact = (overlap.normal, radius(), overlap.depth);
                self.friction.of_row(contact, pair, motion, grip, memory_of(spring))
            }
            FrictionLaw::NassauerKuna => self.friction.of_speed(velocity - overlap.normal * approach, grip),
        };
        // No sign of a zero changes without.
        let along = if self.cohesion.is_none() { -normal } else { pull - normal };
        let force = overlap.normal * along - friction;
        let levers = [overlap.point, overlap.point - offset];
        let mut action = match self.elastic {
            ElasticLaw::OverlapVolume | ElasticLaw::Hertz => Action::through(force, levers),
            ElasticLaw::OverlapEnergy => {
                let pressure = self.pressure(overlap, pair) * factor;
                let opposite = overlap.moment - offset.cross(&(overlap.normal * overlap.area));
                let through_centre = friction + overlap.normal * (dashpot - pull);
                let torques = [
                    overlap.moment * -pressure - levers[0].cross(&through_centre),
                    opposite * pressure + levers[1].cross(&through_centre),
                ];
                Action { force, torques }
            }
        };
        if !self.turning.is_none() {
            let pressed = Pressed {
                axis: overlap.normal,
                depth: overlap.depth,
                radius: radius(),
                elastic,
                normal: grip,
            };
            let back = self.turning.torque(&pressed, &self.friction, pair, motion, torques);
            action.torques[0] -= back;
            action.torques[1] += back;
        }
        action
    }
}

/// The memory of a law at the beginning of these numbers.
fn memory_of<T: Pod>(memory: &mut [f64]) -> &mut T {
    bytemuck::from_bytes_mut(&mut bytemuck::cast_slice_mut(memory)[..size_of::<T>()])
}

/// Sizes and masses of the two bodies of a contact, and the time for which its force stays the same.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairProperties {
    /// Radii of the spheres of equal volume (m), infinite for a wall.
    pub radii: [f64; 2],
    /// Masses (kg), infinite for a wall.
    pub masses: [f64; 2],
    /// Length of a sub-step (s).
    pub dt: f64,
}

impl PairProperties {
    /// Effective radius (m), `1/R_e = 1/R_a + 1/R_b`; that of a body and a wall is that of the body.
    pub fn radius(&self) -> f64 {
        self.radii[0] / (1.0 + self.radii[0] / self.radii[1])
    }

    /// Reduced mass (kg), `1/m* = 1/m_a + 1/m_b`; that of a body and a wall is that of the body.
    pub fn mass(&self) -> f64 {
        self.masses[0] / (1.0 + self.masses[0] / self.masses[1])
    }
}

/// Force and torques of a contact on its two bodies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Action {
    /// Force on the first body (N); the second gets the opposite.
    pub force: Vec3,
    /// Torques on the first and the second body, each about its own centre (N m).
    pub torques: [Vec3; 2],
}

impl Action {
    /// A force (N) on the first body, and its opposite on the second, at one point: `levers` (m) lead there from the centres.
    pub fn through(force: Vec3, levers: [Vec3; 2]) -> Self {
        Self { force, torques: [levers[0].cross(&force), levers[1].cross(&-force)] }
    }

    /// Both actions.
    #[must_use]
    pub fn plus(mut self, other: &Self) -> Self {
        self.force += other.force;
        for (sum, torque) in self.torques.iter_mut().zip(other.torques) {
            *sum += torque;
        }
        self
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

/// Coefficient of restitution that comes out of [`damping_number`] (-), whatever the elastic force and the impact speed:
/// `e` of `(1 + e) y = ln((1 + y) / (1 - e y))`, `y` the damping number, in a dry head-on impact.
fn resulting_restitution(damping_number: f64) -> f64 {
    let y = damping_number;
    // It falls over all `e` of which the logarithm is one.
    let excess = |e: f64| (1.0 + e) * y - (libm::log1p(y) - libm::log1p(-e * y));
    let (mut low, mut high) = (0.0, if y > 1.0 { 1.0 / y } else { 1.0 });
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if excess(middle) > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    if y > 0.0 { 0.5 * (low + high) } else { 1.0 }
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
