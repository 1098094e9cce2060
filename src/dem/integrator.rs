//! Second-order motion of one rigid body: leapfrog for the centre, leapfrog with unit quaternions for the turning.
//!
//! Force and torque are those at the current position, `a^n = a(x^n)`, and so symplectic; a particle carries the
//! velocity predicted for its own time, from which that at the half step is found again by the stored last force:
//!
//! ```text
//! v^{n-1/2} = v^n - dt/2 a^{n-1}        undoes the prediction
//! v^{n+1/2} = v^{n-1/2} + dt a^n
//! x^{n+1}   = x^n + dt v^{n+1/2}
//! v^{n+1}   = v^{n+1/2} + dt/2 a^n      prediction
//! ```
//!
//! Likewise the angular momentum `L` in the world frame with the torque. `w = R I^-1 R^T L` holds the gyroscopic term of
//! Euler's equations. The orientation turns by `w` at the half step, for which it is predicted there:
//!
//! ```text
//! L^n       = L^{n-1/2} + dt/2 T^n
//! q^{n+1/2} = turn(q^n, w(q^n, L^n), dt/2)
//! q^{n+1}   = turn(q^n, w(q^{n+1/2}, L^{n+1/2}), dt)
//! ```
//!
//! Only + - * / and square roots are used, so that every machine gets the same bits.
//!
//! # Reference
//! Allen and Tildesley (2017), Computer Simulation of Liquids, section 3.3 (after Fincham, 1992), with a Cayley-like turn
//! instead of the derivative of the quaternion.

use crate::math::{Quat, Vec3, nalgebra::Quaternion};
use crate::particle::{Particle, Template};

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
        Self {
            mass: template.mass(),
            moments: template.inertia(),
        }
    }

    fn is_isotropic(&self) -> bool {
        self.moments.x.to_bits() == self.moments.y.to_bits()
            && self.moments.y.to_bits() == self.moments.z.to_bits()
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

/// Advances a particle by `dt` (s) under `force` (N) and `torque` (N m) at its current position.
///
/// `last_force` and `last_torque` must be those of the step before; at the start of the motion those of this step,
/// see [`start`]. The position is not wrapped.
pub fn step(particle: &mut Particle, inertia: &Inertia, force: Vec3, torque: Vec3, dt: f64) {
    let half = 0.5 * dt;

    let before = particle.velocity() - Vec3::from(particle.last_force) * (half / inertia.mass);
    let between = before + force * (dt / inertia.mass);
    particle.position = (particle.position() + between * dt).into();
    particle.velocity = (between + force * (half / inertia.mass)).into();
    particle.last_force = force.into();

    let orientation = particle.orientation();
    let before = Vec3::from(particle.angular_momentum) - Vec3::from(particle.last_torque) * half;
    let between = before + torque * dt;
    let middle = if inertia.is_isotropic() {
        orientation // does not matter
    } else {
        let now = inertia.angular_velocity(&orientation, before + torque * half);
        turned(&orientation, now, half)
    };
    let next = turned(&orientation, inertia.angular_velocity(&middle, between), dt);
    let predicted = between + torque * half;
    particle.set_orientation(&next);
    particle.angular_momentum = predicted.into();
    particle.angular_velocity = inertia.angular_velocity(&next, predicted).into();
    particle.last_torque = torque.into();
}

/// Makes the first [`step`] a good one: with the force of the step before unknown, that of this step stands for it.
pub fn start(particle: &mut Particle, force: Vec3, torque: Vec3) {
    particle.last_force = force.into();
    particle.last_torque = torque.into();
}

/// The orientation after turning with `angular_velocity` (1/s, world frame) for `dt` (s).
///
/// `q' = (1, t) q / |(1, t) q|` with the vector `t = h (1 + |h|^2 / 3)`, `h = w dt / 2`: the tangent of half the angle to
/// third order, so that even a constant spin is exact to the fourth.
pub fn turned(orientation: &Quat, angular_velocity: Vec3, dt: f64) -> Quat {
    let half = angular_velocity * (0.5 * dt);
    let tangent = half * (1.0 + half.norm_squared() / 3.0);
    let product = Quaternion::from_parts(1.0, tangent) * orientation.quaternion();
    let [i, j, k, w] = product.coords.into();
    let scale = 1.0 / (i * i + j * j + k * k + w * w).sqrt();
    Quat::new_unchecked(Quaternion::new(w * scale, i * scale, j * scale, k * scale))
}

#[cfg(test)]
mod tests {
    use super::*;

    const TOP: Inertia = Inertia {
        mass: 2.0,
        moments: Vec3::new(1.0, 2.0, 2.5),
    };

    fn spinning() -> Particle {
        let mut particle = Particle::at(1, 0, Vec3::zeros());
        particle.set_orientation(&turned(&Quat::identity(), Vec3::new(0.3, -0.2, 0.9), 1.0));
        particle.angular_momentum = [0.2, 2.0, 0.1];
        particle
    }

    fn spin_energy(particle: &Particle) -> f64 {
        let momentum = Vec3::from(particle.angular_momentum);
        0.5 * momentum.dot(&TOP.angular_velocity(&particle.orientation(), momentum))
    }

    /// Largest deviation of the energy of a free top over a time of 20, and the final orientation.
    fn free_top(dt: f64) -> (f64, Quat) {
        let mut particle = spinning();
        let energy = spin_energy(&particle);
        let mut worst = 0.0_f64;
        for _ in 0..(20.0 / dt).round() as usize {
            step(&mut particle, &TOP, Vec3::zeros(), Vec3::zeros(), dt);
            worst = worst.max((spin_energy(&particle) / energy - 1.0).abs());
        }
        (worst, particle.orientation())
    }

    #[test]
    fn a_free_asymmetric_top_keeps_its_angular_momentum() {
        let mut particle = spinning();
        let momentum = particle.angular_momentum;
        for _ in 0..1000 {
            step(&mut particle, &TOP, Vec3::zeros(), Vec3::zeros(), 0.01);
        }
        assert_eq!(
            particle.angular_momentum.map(f64::to_bits),
            momentum.map(f64::to_bits)
        );
        let turned = Vec3::from(particle.angular_velocity) - spinning().angular_velocity();
        assert!(turned.norm() > 0.1, "it does tumble");
    }

    #[test]
    fn a_free_asymmetric_top_keeps_its_energy_and_course_to_second_order() {
        let (_, exact) = free_top(0.000_625);
        let [(coarse, at_coarse), (fine, at_fine)] = [0.02, 0.01].map(free_top);
        assert!(coarse < 1e-3);
        assert!(coarse / fine > 3.8, "energy {coarse} {fine}");
        let ratio = at_coarse.angle_to(&exact) / at_fine.angle_to(&exact);
        assert!((3.7..4.5).contains(&ratio), "course {ratio}");
    }

    #[test]
    fn a_torque_turns_a_body_at_rest_by_half_t_squared() {
        let mut particle = Particle::at(1, 0, Vec3::zeros());
        let torque = Vec3::new(0.0, 0.0, 0.5);
        start(&mut particle, Vec3::zeros(), torque);
        for _ in 0..1000 {
            step(&mut particle, &TOP, Vec3::zeros(), torque, 1e-3);
        }
        assert!((particle.orientation().angle() - 0.5 * 0.5 / 2.5).abs() < 1e-10);
        assert!((particle.angular_velocity[2] - 0.2).abs() < 1e-12);
    }

    #[test]
    fn a_constant_force_gives_a_parabola() {
        let mut particle = Particle::at(1, 0, Vec3::new(1.0, 2.0, 3.0));
        particle.velocity = [0.5, -1.0, 0.0];
        let force = Vec3::new(0.3, 0.0, -2.0);
        start(&mut particle, force, Vec3::zeros());
        let dt = 0.125;
        for n in 1..=64 {
            step(&mut particle, &TOP, force, Vec3::zeros(), dt);
            let t = f64::from(n) * dt;
            let exact =
                Vec3::new(1.0, 2.0, 3.0) + Vec3::new(0.5, -1.0, 0.0) * t + force / 2.0 * (0.5 * t * t);
            assert!((particle.position() - exact).norm() < 1e-12 * (1.0 + exact.norm()));
            assert!((particle.velocity() - (Vec3::new(0.5, -1.0, 0.0) + force / 2.0 * t)).norm() < 1e-12);
        }
    }

    #[test]
    fn an_oscillator_is_followed_to_second_order_with_a_bounded_energy() {
        // x'' = -x from x = 1 at rest, up to t = 20.
        let run = |dt: f64| {
            let mut particle = Particle::at(1, 0, Vec3::x());
            let mut energy = 0.0_f64;
            for n in 0..(20.0 / dt).round() as usize {
                let force = -TOP.mass * particle.position();
                if n == 0 {
                    start(&mut particle, force, Vec3::zeros());
                }
                step(&mut particle, &TOP, force, Vec3::zeros(), dt);
                energy = energy.max(particle.position().norm_squared() + particle.velocity().norm_squared());
            }
            ((particle.position[0] - 20.0_f64.cos()).abs(), energy)
        };
        let ((coarse, energy), (fine, _)) = (run(0.02), run(0.01));
        assert!((3.9..4.1).contains(&(coarse / fine)), "{}", coarse / fine);
        assert!(energy < 1.0 + 1e-3);
    }

    #[test]
    fn the_quaternion_stays_unit() {
        let mut particle = spinning();
        for n in 0..100_000 {
            let torque = Vec3::new(f64::from(n % 7) - 3.0, f64::from(n % 5) - 2.0, 1.0);
            step(&mut particle, &TOP, Vec3::zeros(), torque, 1e-3);
        }
        assert!((particle.orientation().quaternion().norm() - 1.0).abs() < 1e-15);
    }

    #[test]
    fn a_constant_spin_turns_by_the_right_angle_to_fourth_order() {
        let error = |n: u32| {
            let mut orientation = Quat::identity();
            for _ in 0..n {
                orientation = turned(&orientation, Vec3::new(0.0, 1.0, 0.0), 2.0 / f64::from(n));
            }
            (orientation.angle() - 2.0).abs()
        };
        assert!(error(20) / error(40) > 15.0 && error(40) < 1e-6);
    }
}
