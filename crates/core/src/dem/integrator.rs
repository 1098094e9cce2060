//! Second-order motion of one rigid body: leapfrog for the centre of mass and, with unit quaternions, for the
//! orientation.
//!
//! ```text
//! v^{n-1/2} = v^n - dt/2 (C^{n-1} + L) / m     undoes the prediction;  C = contact force, L = load, constant over a step
//! v^{n+1/2} = v^{n-1/2} + dt (C^n + L) / m
//! x^{n+1}   = x^n + dt v^{n+1/2}
//! v^{n+1}   = v^{n+1/2} + dt/2 (C^n + L) / m   prediction
//! ```
//!
//! Angular momentum likewise, with free rotation by symmetric splitting: exact for two equal moments. Only `+ - * /`
//! and square roots are used, so every machine gets the same bits. Derivation: `docs/theory/motion.md`.
//!
//! # Reference
//! Touma and Wisdom (1994), Astron. J. 107, 1189; Allen and Tildesley (2017), Computer Simulation of Liquids,
//! section 3.2.

#[cfg(test)]
mod tests;

use super::Load;
use crate::math::{Quat, Vec3, nalgebra::Quaternion};
use crate::particle::{Particle, PrescribedMotion, Template};

/// Mass and principal moments of a template.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inertia {
    /// Mass (kg).
    pub mass: f64,
    /// Principal moments (kg m^2).
    pub moments: Vec3,
}

impl Inertia {
    /// Inertia of a template.
    pub fn of(template: &Template) -> Self {
        Self { mass: template.mass(), moments: template.inertia() }
    }

    fn is_isotropic(&self) -> bool {
        self.moments.x.to_bits() == self.moments.y.to_bits()
            && self.moments.y.to_bits() == self.moments.z.to_bits()
    }

    /// The axis of the middle one of the principal moments.
    fn middle_axis(&self) -> usize {
        let [x, y, z] = self.moments.into();
        if (x <= y) == (y <= z) {
            1
        } else if (y <= x) == (x <= z) {
            0
        } else {
            2
        }
    }

    /// Angular velocity (1/s) that belongs to an angular momentum (kg m^2/s), both in the world frame.
    pub fn angular_velocity(&self, orientation: &Quat, momentum: Vec3) -> Vec3 {
        if self.is_isotropic() {
            return momentum / self.moments.x;
        }
        let body = orientation.inverse_transform_vector(&momentum);
        orientation.transform_vector(&body.component_div(&self.moments))
    }

    /// Angular momentum (kg m^2/s) that belongs to an angular velocity (1/s), both in the world frame.
    pub fn angular_momentum(&self, orientation: &Quat, velocity: Vec3) -> Vec3 {
        if self.is_isotropic() {
            return velocity * self.moments.x;
        }
        let body = orientation.inverse_transform_vector(&velocity);
        orientation.transform_vector(&body.component_mul(&self.moments))
    }
}

/// The motion of the bodies of a template over sub-steps of one length, with what is the same for all of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    inertia: Inertia,
    is_isotropic: bool,
    /// Length of a sub-step (s).
    pub dt: f64,
    /// Over the mass (s/kg), and half of it.
    dt_per_mass: f64,
    half_per_mass: f64,
}

/// The state of a body after a sub-step, but for its contact force.
#[derive(Clone, Copy, Debug)]
pub struct Moved {
    /// Position (m), not wrapped.
    pub position: Vec3,
    orientation: Quat,
    velocity: Vec3,
    angular_velocity: Vec3,
    angular_momentum: Vec3,
}

impl Motion {
    /// Over sub-steps of `dt` (s).
    pub fn new(inertia: &Inertia, dt: f64) -> Self {
        Self {
            inertia: *inertia,
            is_isotropic: inertia.is_isotropic(),
            dt,
            dt_per_mass: dt / inertia.mass,
            half_per_mass: 0.5 * dt / inertia.mass,
        }
    }

    /// A particle after a [`step`].
    #[inline(always)]
    pub fn of(&self, particle: &Particle, load: &Load, contact: &Load) -> Moved {
        let Self { inertia, dt, .. } = self;
        let half = 0.5 * dt;
        let (undone, force) = (load.force + Vec3::from(particle.contact_force), load.force + contact.force);
        let before = particle.velocity() - undone * self.half_per_mass;
        let between = before + force * self.dt_per_mass;
        let position = particle.position() + between * *dt;
        let velocity = between + force * self.half_per_mass;

        let (undone, torque) =
            (load.torque + Vec3::from(particle.contact_torque), load.torque + contact.torque);
        let orientation = particle.orientation();
        let before = Vec3::from(particle.angular_momentum) - undone * half;
        let between = before + torque * *dt;
        let predicted = between + torque * half;
        let (next, angular_velocity) = if self.is_isotropic {
            let (moment, spin) = (inertia.moments.x, between / inertia.moments.x);
            // Without a torque to the bit the same: divisions are what this costs.
            let is_same = predicted.map(f64::to_bits) == between.map(f64::to_bits);
            (turned(&orientation, spin, *dt), if is_same { spin } else { predicted / moment })
        } else {
            let next = turned_freely(&orientation, inertia, between, *dt);
            (next, inertia.angular_velocity(&next, predicted))
        };
        Moved { position, orientation: next, velocity, angular_velocity, angular_momentum: predicted }
    }
}

impl Moved {
    /// True if all is finite, the body has moved by at most `most` (m) along each axis, and its centre is inside a box of
    /// this size (m), not on its faces.
    #[inline(always)]
    pub fn is_inside(&self, before: &Vec3, most: f64, size: &Vec3) -> bool {
        let Self { position, velocity, angular_velocity, angular_momentum, .. } = self;
        // What is finite but too large for the sum goes the slow way.
        let sizes = |v: &Vec3| v.x.abs() + v.y.abs() + v.z.abs();
        let is_finite = (sizes(velocity) + sizes(angular_velocity) + sizes(angular_momentum)).is_finite();
        let is_near =
            |i: usize| (position[i] - before[i]).abs() <= most && position[i] > 0.0 && position[i] < size[i];
        is_finite && is_near(0) && is_near(1) && is_near(2)
    }

    /// Makes it the state of a particle under the contact forces that it was found with.
    #[inline(always)]
    pub fn store(&self, particle: &mut Particle, contact: &Load) {
        particle.position = self.position.into();
        particle.set_orientation(&self.orientation);
        particle.velocity = self.velocity.into();
        particle.angular_velocity = self.angular_velocity.into();
        particle.angular_momentum = self.angular_momentum.into();
        particle.contact_force = contact.force.into();
        particle.contact_torque = contact.torque.into();
    }
}

/// Advances a particle by `dt` (s) under the `contact` forces at its current position and a constant `load` (gravity
/// included).
///
/// The particle's `contact_force` and `contact_torque` must be those of the step before; at the start of the motion
/// those of this step, see [`start`]. The position is not wrapped.
pub fn step(particle: &mut Particle, inertia: &Inertia, load: &Load, contact: &Load, dt: f64) {
    Motion::new(inertia, dt).of(particle, load, contact).store(particle, contact);
}

/// Replaces what forces have done to a particle in a [`step`] between two times (s), the same but for its contact force as
/// `before`, by what is prescribed.
pub fn prescribe(
    particle: &mut Particle,
    before: &Particle,
    inertia: &Inertia,
    motion: &PrescribedMotion,
    [from, to]: [f64; 2],
) {
    let way = motion.velocity.integral(from, to);
    for axis in (0..3).filter(|&axis| !motion.free[axis]) {
        particle.position[axis] = before.position[axis] + way[axis];
    }
    if !motion.free_rotation {
        let (angle, orientation) = (motion.angular_velocity.integral(from, to), before.orientation());
        // A body at rest keeps every bit.
        let still = angle == Vec3::zeros();
        particle.set_orientation(&if still { orientation } else { turned(&orientation, angle, 1.0) });
    }
    set_prescribed(particle, inertia, motion, to);
}

/// Sets the prescribed velocities of a particle to those at a time (s).
pub fn set_prescribed(particle: &mut Particle, inertia: &Inertia, motion: &PrescribedMotion, time: f64) {
    let velocity = motion.velocity.at(time);
    for axis in (0..3).filter(|&axis| !motion.free[axis]) {
        particle.velocity[axis] = velocity[axis];
    }
    if !motion.free_rotation {
        let spin = motion.angular_velocity.at(time);
        particle.angular_velocity = spin.into();
        particle.angular_momentum = inertia.angular_momentum(&particle.orientation(), spin).into();
    }
}

/// Makes the first [`step`] a good one: with the contacts of the step before unknown, those of this step stand for
/// them.
pub fn start(particle: &mut Particle, contact: &Load) {
    particle.contact_force = contact.force.into();
    particle.contact_torque = contact.torque.into();
}

/// The orientation of a body whose moments are not all equal after turning for `dt` (s) under a constant angular momentum
/// (kg m^2/s, world frame).
fn turned_freely(orientation: &Quat, inertia: &Inertia, momentum: Vec3, dt: f64) -> Quat {
    let moments = inertia.moments;
    let axis = inertia.middle_axis();
    let common = 1.0 / moments[axis];
    let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
    let (of_a, of_b) = (1.0 / moments[a] - common, 1.0 / moments[b] - common);
    let mut body = orientation.inverse_transform_vector(&momentum);
    let mut turning = *orientation.quaternion();
    turn_about_own_axis(&mut turning, &mut body, a, of_a, 0.5 * dt);
    turn_about_own_axis(&mut turning, &mut body, b, of_b, dt);
    turn_about_own_axis(&mut turning, &mut body, a, of_a, 0.5 * dt);
    // The last turn makes the length one again.
    turned(&Quat::new_unchecked(turning), momentum * common, dt)
}

/// Turns a body about its own axis `k` by `momentum[k] inverse dt`: `q' = q (1, t e_k)`, not normalised, with the
/// tangent `t` of [`turned`]; the momentum in the body frame turns the other way.
fn turn_about_own_axis(q: &mut Quaternion<f64>, momentum: &mut Vec3, k: usize, inverse: f64, dt: f64) {
    let (a, b) = ((k + 1) % 3, (k + 2) % 3);
    let half = 0.5 * dt * inverse * momentum[k];
    let t = half * (1.0 + half * half / 3.0);
    let [w, along, p, r] = [q.coords[3], q.coords[k], q.coords[a], q.coords[b]];
    (q.coords[3], q.coords[k]) = (w - t * along, along + t * w);
    (q.coords[a], q.coords[b]) = (p + t * r, r - t * p);
    let scale = 1.0 / (1.0 + t * t);
    let (cosine, sine) = ((1.0 - t * t) * scale, 2.0 * t * scale);
    let (p, r) = (momentum[a], momentum[b]);
    (momentum[a], momentum[b]) = (cosine * p + sine * r, cosine * r - sine * p);
}

/// The orientation after turning with `angular_velocity` (1/s, world frame) for `dt` (s).
///
/// `q' = (1, t) q / |(1, t) q|` with the vector `t = h (1 + |h|^2 / 3)`, `h = w dt / 2`: the tangent of half the
/// angle to third order, so that even a constant spin is exact to the fourth.
#[inline(always)]
pub fn turned(orientation: &Quat, angular_velocity: Vec3, dt: f64) -> Quat {
    let half = angular_velocity * (0.5 * dt);
    let tangent = half * (1.0 + half.norm_squared() / 3.0);
    let product = Quaternion::from_parts(1.0, tangent) * orientation.quaternion();
    let [i, j, k, w] = product.coords.into();
    let scale = 1.0 / (i * i + j * j + k * k + w * w).sqrt();
    Quat::new_unchecked(Quaternion::new(w * scale, i * scale, j * scale, k * scale))
}
