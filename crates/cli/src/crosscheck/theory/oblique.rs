//! The oblique impact of two spheres that slide on each other all the time.
//!
//! ```text
//! m_i v_i' = +- F,   F = -F_n n - mu F_n t,   F_n = K d^(3/2)
//! I_i w_i' = (r_i - d / 2) (+- n) x F
//! ```
//!
//! with the unit normal `n` from the first to the second sphere and `t` along the sliding of the first on the second.

use super::{Hertz, runge_kutta};
use turbid::math::Vec3;

/// Steps over the duration of the impact along the normal.
const STEPS: f64 = 20_000.0;

/// A sphere in free flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in super::super) struct Sliding {
    /// Radius (m), mass (kg).
    pub(in super::super) radius: f64,
    pub(in super::super) mass: f64,
    /// Centre (m), velocity (m/s), angular velocity (1/s).
    pub(in super::super) position: Vec3,
    pub(in super::super) velocity: Vec3,
    pub(in super::super) spin: Vec3,
}

/// Velocities and spins of two touching spheres after their impact without damping, with gross sliding under the friction
/// coefficient `friction` (-).
pub(in super::super) fn slide(pair: [Sliding; 2], hertz: &Hertz, friction: f64) -> [Sliding; 2] {
    let vector = |state: &[f64; 18], i: usize| Vec3::new(state[3 * i], state[3 * i + 1], state[3 * i + 2]);
    let sum = pair[0].radius + pair[1].radius;
    let depth_at = |state: &[f64; 18]| sum - (vector(state, 1) - vector(state, 0)).norm();
    let rate = |state: [f64; 18]| {
        let velocities = [vector(&state, 2), vector(&state, 3)];
        let offset = vector(&state, 1) - vector(&state, 0);
        let normal = offset.normalize();
        let depth = depth_at(&state).max(0.0);
        let levers = [normal * (pair[0].radius - 0.5 * depth), -normal * (pair[1].radius - 0.5 * depth)];
        let surface = |i: usize| velocities[i] + vector(&state, 4 + i).cross(&levers[i]);
        let relative = surface(0) - surface(1);
        let sliding = relative - normal * relative.dot(&normal);
        let push = hertz.force(depth);
        let along = sliding.try_normalize(0.0).unwrap_or_else(Vec3::zeros);
        let force = -push * (normal + friction * along);
        let inertia = |i: usize| 0.4 * pair[i].mass * pair[i].radius * pair[i].radius;
        let rates = [
            velocities[0],
            velocities[1],
            force / pair[0].mass,
            -force / pair[1].mass,
            levers[0].cross(&force) / inertia(0),
            levers[1].cross(&-force) / inertia(1),
        ];
        std::array::from_fn(|i| rates[i / 3][i % 3])
    };
    let start =
        [pair[0].position, pair[1].position, pair[0].velocity, pair[1].velocity, pair[0].spin, pair[1].spin];
    let mut state: [f64; 18] = std::array::from_fn(|i| start[i / 3][i % 3]);
    let normal = (pair[1].position - pair[0].position).normalize();
    let approach = (pair[0].velocity - pair[1].velocity).dot(&normal);
    let step = hertz.duration(approach) / STEPS;
    // The first step leads from the touch into the contact whatever rounding makes of the touch.
    loop {
        state = runge_kutta(state, step, rate);
        if depth_at(&state) <= 0.0 {
            break;
        }
    }
    std::array::from_fn(|i| Sliding {
        position: vector(&state, i),
        velocity: vector(&state, 2 + i),
        spin: vector(&state, 4 + i),
        ..pair[i]
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;
    use turbid::contact::Material;

    /// Two glass spheres of 1 mm, touching along x; the first has this velocity (m/s).
    fn glass(velocity: Vec3) -> ([Sliding; 2], Hertz) {
        let radius: f64 = 0.5e-3;
        let mass = 2500.0 * 4.0 / 3.0 * PI * radius.powi(3);
        let material = Material { youngs_modulus: 7e10, poisson_ratio: 0.22 };
        let at = |x: f64, velocity| Sliding {
            radius,
            mass,
            position: Vec3::new(x, 0.0, 0.0),
            velocity,
            spin: Vec3::zeros(),
        };
        let hertz = Hertz::pair([mass; 2], [radius; 2], [&material; 2]);
        ([at(0.0, velocity), at(2.0 * radius, Vec3::zeros())], hertz)
    }

    #[test]
    fn an_impact_at_45_degrees_ends_as_an_independent_code_has_it() {
        // Without and with friction, and slowly, at which the spheres are nearly rigid.
        let table = [
            (1.0, 0.0, [0.0015072, 1.0015026, 0.9984928, -0.0015026, 0.0], 1e-6),
            (1.0, 0.1, [0.0012365, 0.9015742, 0.9987635, 0.0984258, -498.894], 1e-6),
            (0.01, 0.1, [0.0000003, 0.0090004, 0.0099997, 0.0009996, -4.9997], 6e-8),
        ];
        for (speed, friction, expected, tolerance) in table {
            let (pair, hertz) = glass(Vec3::new(speed, speed, 0.0));
            let [a, b] = slide(pair, &hertz, friction);
            let found = [a.velocity.x, a.velocity.y, b.velocity.x, b.velocity.y];
            for (found, expected) in found.iter().zip(&expected) {
                assert!((found - expected).abs() < tolerance, "{found} {expected}");
            }
            assert!((a.spin.z - expected[4]).abs() < 2e-5 * expected[4].abs() + 1e-9, "{}", a.spin.z);
            assert!((a.spin - b.spin).norm() < 1e-9 * a.spin.norm() + 1e-12);
        }
    }

    #[test]
    fn a_slow_impact_is_that_of_rigid_spheres() {
        let (pair, hertz) = glass(Vec3::new(1e-6, 1e-6, 0.0));
        let [a, b] = slide(pair, &hertz, 0.1);
        let impulse = 1e-6;
        assert!((a.velocity - Vec3::new(0.0, 0.9e-6, 0.0)).norm() < 1e-5 * impulse);
        assert!((b.velocity - Vec3::new(1e-6, 0.1e-6, 0.0)).norm() < 1e-5 * impulse);
        assert!((a.spin.z * 0.5e-3 / (-2.5 * 0.1 * impulse) - 1.0).abs() < 1e-5);
    }
}
