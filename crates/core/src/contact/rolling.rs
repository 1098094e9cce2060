//! Resistance to rolling and twisting: torques of a contact beside those of its forces.
//!
//! `N` is the elastic normal force, `F` that with damping, `d` the depth, `a` the radius of contact, `w` the angular velocity of the first body relative to
//! the second, of which `w_r` is across and `w_t` about the normal, `k` and `c` the stiffness and the dashpot of [friction](super::friction). The second body turns the first one
//! back by
//!
//! ```text
//! ConstantTorque   M = mu_r R* N w_r / |w_r|
//! ElasticPlastic   m' = turned(m) + k_r w_r dt,   |m'| <= mu_r R* |F|;   M = m' + c_r w_r, or m' where it rolls
//!                  k_r = 2.25 mu_r^2 R*^2 N / d,   c_r = 0.6 sqrt(I_r k_r),   1/I_r = 1/(I_a + m_a R_a^2) + 1/(I_b + m_b R_b^2)
//! Marshall         q' = q + k_t w_t dt,   |q'| <= (2/3) a mu_k |F|;   M = q' + c_t w_t, or q' where it twists;   k_t = k a^2 / 2,   c_t = c a^2 / 2
//! ```
//!
//! `R` and `I = (2/5) m R^2` are those of spheres of equal volume. A spring that turns, and whose limit falls, takes energy only: its torque is
//! cut to the limit, and its stiffness is that of the present overlap (as in the source, so a contact that is loaded while it is wound up gains what `k_r` gains).
//!
//! References: Ai, Chen, Rotter and Ooi (2011), Powder Technol. 206, 269, models A and C (`cdt` and `epsd` of LIGGGHTS); Marshall (2009), J. Comput. Phys. 228,
//! 1541 (`twisting marshall` of LAMMPS).

#[cfg(test)]
mod tests;

use super::friction::{Friction, RelativeMotion, capped, turned};
use super::law::PairProperties;
use super::{ContactModel, PairParams, RollingLaw, TwistingLaw};
use crate::math::Vec3;

/// Twice the damping ratio of [`RollingLaw::ElasticPlastic`] (-).
const DAMPING: f64 = 0.6;

/// Torques between two materials, ready for use.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turning {
    rolling: RollingLaw,
    twisting: TwistingLaw,
    /// Coefficient of rolling friction (-).
    coefficient: f64,
}

/// The forces of a contact that limit its torques.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pressed {
    /// Unit normal.
    pub(super) axis: Vec3,
    /// Depth (m) and radius of contact (m).
    pub(super) depth: f64,
    pub(super) radius: f64,
    /// Magnitudes of the normal force (N): elastic, and with damping.
    pub(super) elastic: f64,
    pub(super) normal: f64,
}

impl RollingLaw {
    /// True if the law reads the coefficient of rolling friction.
    pub fn is_given(self) -> bool {
        self != Self::None
    }

    /// Numbers that the law remembers of a contact: the torque of its spring (N m).
    fn memory(self) -> usize {
        if self == Self::ElasticPlastic { 3 } else { 0 }
    }
}

impl TwistingLaw {
    /// Numbers that the law remembers of a contact: the torque of its spring about the normal (N m).
    fn memory(self) -> usize {
        usize::from(self == Self::Marshall)
    }
}

impl Turning {
    /// Torques between two materials.
    pub(super) fn new(model: &ContactModel, pair: &PairParams) -> Self {
        Self { rolling: model.rolling, twisting: model.twisting, coefficient: pair.rolling_friction }
    }

    /// Numbers that the laws of a model remember of a contact.
    pub(super) fn memory(model: &ContactModel) -> usize {
        model.rolling.memory() + model.twisting.memory()
    }

    /// True if there are no torques.
    pub(super) fn is_none(&self) -> bool {
        self.rolling == RollingLaw::None && self.twisting == TwistingLaw::None
    }

    /// The torque (N m) that turns the first body back, and its opposite the second.
    pub(super) fn torque(
        &self,
        pressed: &Pressed,
        friction: &Friction,
        pair: &PairProperties,
        motion: &RelativeMotion,
        memory: &mut [f64],
    ) -> Vec3 {
        let (rolling, twisting) = memory.split_at_mut(self.rolling.memory());
        let spin = motion.turning.dot(&pressed.axis);
        let roll = motion.turning - pressed.axis * spin;
        let across = self.rolls(pressed, pair, (roll, motion), rolling);
        let about = match twisting {
            [spring] => pressed.axis * twists(pressed, friction, pair, spin, motion.elapsed, spring),
            _ => Vec3::zeros(),
        };
        across + about
    }

    fn rolls(
        &self,
        pressed: &Pressed,
        pair: &PairProperties,
        (roll, motion): (Vec3, &RelativeMotion),
        memory: &mut [f64],
    ) -> Vec3 {
        let arm = self.coefficient * pair.radius();
        match (self.rolling, memory) {
            (RollingLaw::ConstantTorque, _) => {
                let speed = roll.norm();
                if speed > 0.0 { roll * (arm * pressed.elastic / speed) } else { Vec3::zeros() }
            }
            (RollingLaw::ElasticPlastic, [x, y, z]) => {
                let most = arm * pressed.normal;
                let stiffness = if pressed.depth > 0.0 {
                    2.25 * arm * arm * pressed.elastic / pressed.depth
                } else {
                    0.0
                };
                let wound =
                    turned(Vec3::new(*x, *y, *z), pressed.axis, motion) + roll * (stiffness * motion.elapsed);
                let torque = capped(wound, most);
                [*x, *y, *z] = torque.into();
                if wound.norm() > most {
                    torque
                } else {
                    torque + roll * (DAMPING * (pair.rolling_inertia() * stiffness).sqrt())
                }
            }
            _ => Vec3::zeros(),
        }
    }
}

/// The torque about the normal (N m) that turns the first body back.
fn twists(
    pressed: &Pressed,
    friction: &Friction,
    pair: &PairProperties,
    spin: f64,
    elapsed: f64,
    spring: &mut f64,
) -> f64 {
    let [stiffness, dashpot] =
        friction.spring(pressed.radius, pair).map(|of| 0.5 * of * pressed.radius * pressed.radius);
    let most = 2.0 / 3.0 * pressed.radius * friction.kinetic * pressed.normal;
    let wound = *spring + stiffness * spin * elapsed;
    *spring = wound.clamp(-most, most);
    if wound.abs() > most { *spring } else { (*spring + dashpot * spin).clamp(-most, most) }
}

impl PairProperties {
    /// `I_r` (kg m^2) of two bodies that roll on each other, as spheres; that of a body on a wall is that of the body.
    fn rolling_inertia(&self) -> f64 {
        let inverse: f64 = (0..2)
            .map(|i| 1.0 / (1.4 * self.masses[i] * self.radii[i] * self.radii[i]))
            .filter(|inverse| inverse.is_finite())
            .sum();
        1.0 / inverse
    }
}
