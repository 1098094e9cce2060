//! The oblique impact of two spheres that slide on each other all the time.
//!
//! ```text
//! m_i v_i' = +- F,   F = -F_n n - mu F_n t,   F_n = K d^(3/2)
//! I_i w_i' = (r_i - d / 2) (+- n) x F
//! ```
//!
//! with the unit normal `n` from the first to the second sphere and `t` along the sliding of the first on the second.

use super::super::system::State;
use super::{Hertz, runge_kutta};
use turbid::math::Vec3;

/// Steps over the duration of the impact along the normal.
const STEPS: f64 = 20_000.0;

/// States of two touching spheres of this radius (m) and mass (kg) after their impact without damping, with gross sliding under
/// the friction coefficient `friction` (-).
pub(in super::super) fn slide(
    start: [State; 2],
    radius: f64,
    mass: f64,
    hertz: &Hertz,
    friction: f64,
) -> [State; 2] {
    let vector = |state: &[f64; 18], i: usize| Vec3::new(state[3 * i], state[3 * i + 1], state[3 * i + 2]);
    let depth_at = |state: &[f64; 18]| radius + radius - (vector(state, 1) - vector(state, 0)).norm();
    let rate = |state: [f64; 18]| {
        let velocities = [vector(&state, 2), vector(&state, 3)];
        let offset = vector(&state, 1) - vector(&state, 0);
        let normal = offset.normalize();
        let depth = depth_at(&state).max(0.0);
        let levers = [normal * (radius - 0.5 * depth), -normal * (radius - 0.5 * depth)];
        let surface = |i: usize| velocities[i] + vector(&state, 4 + i).cross(&levers[i]);
        let relative = surface(0) - surface(1);
        let sliding = relative - normal * relative.dot(&normal);
        let push = hertz.force(depth);
        let along = sliding.try_normalize(0.0).unwrap_or_else(Vec3::zeros);
        let force = -push * (normal + friction * along);
        let inertia = 0.4 * mass * radius * radius;
        let rates = [
            velocities[0],
            velocities[1],
            force / mass,
            -force / mass,
            levers[0].cross(&force) / inertia,
            levers[1].cross(&-force) / inertia,
        ];
        std::array::from_fn(|i| rates[i / 3][i % 3])
    };
    // Positions, velocities, spins.
    let mut state: [f64; 18] = std::array::from_fn(|i| start[i / 3 % 2][i / 6][i % 3]);
    let normal = (start[1][0] - start[0][0]).normalize();
    let approach = (start[0][1] - start[1][1]).dot(&normal);
    let step = hertz.duration(approach) / STEPS;
    // The first step leads from the touch into the contact whatever rounding makes of the touch.
    loop {
        state = runge_kutta(state, step, rate);
        if depth_at(&state) <= 0.0 {
            break;
        }
    }
    [0, 1].map(|i| [vector(&state, i), vector(&state, 2 + i), vector(&state, 4 + i)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;
    use turbid::contact::Material;

    const RADIUS: f64 = 0.5e-3;

    /// Velocity and spin of two glass spheres of 1 mm that touch along x, after an impact of the first with this velocity (m/s).
    fn impact(velocity: Vec3, friction: f64) -> [(Vec3, Vec3); 2] {
        let mass = 2500.0 * 4.0 / 3.0 * PI * RADIUS.powi(3);
        let material = Material { youngs_modulus: 7e10, poisson_ratio: 0.22 };
        let hertz = Hertz::pair([mass; 2], [RADIUS; 2], [&material; 2]);
        let rest = Vec3::zeros();
        let start = [[rest, velocity, rest], [Vec3::x() * (2.0 * RADIUS), rest, rest]];
        slide(start, RADIUS, mass, &hertz, friction).map(|[_, velocity, spin]| (velocity, spin))
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
            let [(a, spin), (b, other)] = impact(Vec3::new(speed, speed, 0.0), friction);
            let found = [a.x, a.y, b.x, b.y];
            for (found, expected) in found.iter().zip(&expected) {
                assert!((found - expected).abs() < tolerance, "{found} {expected}");
            }
            assert!((spin.z - expected[4]).abs() < 2e-5 * expected[4].abs() + 1e-9, "{}", spin.z);
            assert!((spin - other).norm() < 1e-9 * spin.norm() + 1e-12);
        }
    }

    #[test]
    fn a_slow_impact_is_that_of_rigid_spheres() {
        let [(a, spin), (b, _)] = impact(Vec3::new(1e-6, 1e-6, 0.0), 0.1);
        let impulse = 1e-6;
        assert!((a - Vec3::new(0.0, 0.9e-6, 0.0)).norm() < 1e-5 * impulse);
        assert!((b - Vec3::new(1e-6, 0.1e-6, 0.0)).norm() < 1e-5 * impulse);
        assert!((spin.z * RADIUS / (-2.5 * 0.1 * impulse) - 1.0).abs() < 1e-5);
    }
}
