//! Velocities of the particles that touch others, found once in a sub-step.

use super::context::{ContactContext, TemplateConstants};
use crate::contact::PairLaw;
use crate::math::Vec3;

/// Velocity (m/s) of the centre of a particle and its angular velocity (1/s).
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Velocities {
    now: [Vec3; 2],
    /// Half a sub-step before.
    before: [Vec3; 2],
}

impl Velocities {
    /// Velocity (m/s) at a point `lever` (m) from the centre, the same half a sub-step before if the [law needs it](PairLaw::lags),
    /// and the angular velocity (1/s).
    #[inline]
    pub(super) fn at(&self, lever: &Vec3, law: &PairLaw) -> [Vec3; 3] {
        let ([velocity, spin], [slower, before]) = (&self.now, &self.before);
        let now = velocity + spin.cross(lever);
        if law.lags() { [now, slower + before.cross(lever), *before] } else { [now, now, *spin] }
    }
}

/// The velocities of the particles that touch others, each found once in a sub-step.
#[derive(Clone, Debug, Default)]
pub(super) struct KnownVelocities {
    all: Vec<Velocities>,
    known: Vec<bool>,
}

impl KnownVelocities {
    /// Forgets all, for this number of particles.
    pub(super) fn clear(&mut self, particles: usize) {
        self.known.clear();
        self.known.resize(particles, false);
        self.all.resize(particles, Velocities::default());
    }

    #[inline]
    pub(super) fn of(&mut self, index: usize, find: impl FnOnce() -> Velocities) -> &Velocities {
        if !self.known[index] {
            self.all[index] = find();
            self.known[index] = true;
        }
        &self.all[index]
    }
}

impl ContactContext {
    /// Velocities of a particle now and half a sub-step of `dt` (s) before, if a [law needs them](PairLaw::lags):
    /// `v - dt/2 (C + F + m g) / m`.
    pub(super) fn velocities(&self, index: usize, dt: f64) -> Velocities {
        let particle = &self.local.store.particles[index];
        let (velocity, spin) = (particle.velocity(), particle.angular_velocity());
        let TemplateConstants { inertia, weight, is_free, .. } = self.constants(particle);
        let Some(past) = self.past.get(index).filter(|_| self.substep > 0 && *is_free) else {
            return Velocities { now: [velocity, spin], before: [velocity, spin] };
        };
        let half = 0.5 * dt;
        let force = Vec3::from(particle.contact_force) + (past.force + weight);
        let torque = Vec3::from(particle.contact_torque) + past.torque;
        let momentum = Vec3::from(particle.angular_momentum) - torque * half;
        let before = inertia.angular_velocity(&particle.orientation(), momentum);
        let slower = velocity - force * (half / inertia.mass);
        Velocities { now: [velocity, spin], before: [slower, before] }
    }
}
