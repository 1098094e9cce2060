//! Theory of impacts: closed forms, or the equations of motion integrated on their own.
//!
//! Two spheres that meet head-on, with reduced mass `m*`, depth `d` and speed of approach `v = d'`:
//!
//! ```text
//! Hertz           F = K d^(3/2),  K = 4/3 E* sqrt(R*)
//! Tsuji           F = K d^(3/2) + sqrt(5) beta sqrt(m* K) d^(1/4) v,  beta = -ln e / sqrt(pi^2 + ln^2 e)
//! Hunt-Crossley   F = K d^(3/2) (1 + z v / u_0),  z = 3/2 (1 - e) (11 - e) / (1 + 9 e)
//! m* v' = -F
//! ```
//!
//! Nothing here uses the laws or the integrator of the engines.
//!
//! # Reference
//! Hertz (1882); Tsuji, Tanaka and Ishida (1992), doi:10.1016/0032-5910(92)88030-L; Hunt and Crossley (1975),
//! doi:10.1115/1.3423596, with the damping of Carvalho and Martins (2019), doi:10.1016/j.mechmachtheory.2019.03.028.

mod oblique;

use std::f64::consts::PI;
use turbid::contact::Material;

pub(super) use oblique::slide;

/// Steps of the integration over the duration of an elastic impact.
const STEPS: f64 = 20_000.0;

/// Two bodies that press on each other as Hertz (1882) has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Hertz {
    /// Reduced mass `m*` (kg), effective modulus `E*` (Pa) and radius `R*` (m).
    pub(super) mass: f64,
    pub(super) modulus: f64,
    pub(super) radius: f64,
}

impl Hertz {
    /// Of two spheres with these masses (kg) and radii (m).
    pub(super) fn pair(masses: [f64; 2], radii: [f64; 2], materials: [&Material; 2]) -> Self {
        let harmonic = |[a, b]: [f64; 2]| a * b / (a + b);
        let compliance = |m: &Material| (1.0 - m.poisson_ratio * m.poisson_ratio) / m.youngs_modulus;
        Self {
            mass: harmonic(masses),
            modulus: 1.0 / (compliance(materials[0]) + compliance(materials[1])),
            radius: harmonic(radii),
        }
    }

    /// Of a sphere and a plane wall.
    pub(super) fn wall(mass: f64, radius: f64, materials: [&Material; 2]) -> Self {
        Self { mass, radius, ..Self::pair([1.0; 2], [1.0; 2], materials) }
    }

    /// `K` (N/m^(3/2)).
    pub(super) fn stiffness(&self) -> f64 {
        4.0 / 3.0 * self.modulus * self.radius.sqrt()
    }

    /// Force at a depth (N).
    pub(super) fn force(&self, depth: f64) -> f64 {
        self.stiffness() * depth * depth.sqrt()
    }

    /// Largest depth of an elastic impact (m), `(5 m* v^2 / (4 K))^(2/5)`.
    pub(super) fn deepest(&self, speed: f64) -> f64 {
        (1.25 * self.mass * speed * speed / self.stiffness()).powf(0.4)
    }

    /// Duration of an elastic impact (s), `2 d_max / v` times the integral of `(1 - x^(5/2))^(-1/2)` from 0 to 1.
    pub(super) fn duration(&self, speed: f64) -> f64 {
        let integral = 0.4 * PI.sqrt() * libm::tgamma(0.4) / libm::tgamma(0.9);
        2.0 * integral * self.deepest(speed) / speed
    }
}

/// Damping of an impact, and the coefficient of restitution that is set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Damping {
    Tsuji(f64),
    /// That of Hunt and Crossley with the number of Carvalho and Martins.
    HuntCrossley(f64),
}

/// Time since the first touch (s), depth (m), and force (N), positive if it pushes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Instant {
    pub(super) time: f64,
    pub(super) depth: f64,
    pub(super) force: f64,
}

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Impact {
    /// Duration (s), largest depth (m).
    pub(super) duration: f64,
    pub(super) deepest: f64,
    /// Speed of separation over that of approach (-).
    pub(super) restitution: f64,
    pub(super) history: Vec<Instant>,
}

/// The head-on impact of two bodies at `speed` (m/s), by the classical Runge-Kutta scheme.
///
/// `ratio` is the elastic force over that of Hertz at a depth (m): 1, or [`lens_ratio`] and its likes.
pub(super) fn impact(hertz: &Hertz, damping: Damping, ratio: impl Fn(f64) -> f64, speed: f64) -> Impact {
    let force = |depth: f64, approach: f64| {
        let depth = depth.max(0.0);
        let elastic = hertz.force(depth) * ratio(depth);
        match damping {
            Damping::Tsuji(e) => {
                let dashpot = dashpot(hertz, e);
                elastic + dashpot * depth.sqrt().sqrt() * approach
            }
            Damping::HuntCrossley(e) => {
                let number = 1.5 * (1.0 - e) * (11.0 - e) / (1.0 + 9.0 * e);
                elastic * (1.0 + number * approach / speed)
            }
        }
    };
    let rate = |[depth, approach]: [f64; 2]| [approach, -force(depth, approach) / hertz.mass];
    let step = hertz.duration(speed) / STEPS;
    let (mut state, mut time) = ([0.0, speed], 0.0);
    let mut history = Vec::new();
    let mut deepest = 0.0_f64;
    loop {
        let instant = Instant { time, depth: state[0], force: force(state[0], state[1]) };
        history.push(instant);
        let next = runge_kutta(state, step, rate);
        if next[0] <= 0.0 {
            let part = state[0] / (state[0] - next[0]);
            return Impact {
                duration: time + part * step,
                deepest,
                restitution: -(state[1] + part * (next[1] - state[1])) / speed,
                history,
            };
        }
        deepest = deepest.max(next[0]);
        (state, time) = (next, time + step);
    }
}

/// Factor of `d^(1/4) v` in the force of Tsuji's dashpot, `sqrt(5) beta sqrt(m* K)`.
pub(super) fn dashpot(hertz: &Hertz, restitution: f64) -> f64 {
    let log = restitution.ln();
    let beta = -log / PI.hypot(log);
    beta * (5.0 * hertz.mass * hertz.stiffness()).sqrt()
}

fn runge_kutta<const N: usize>(state: [f64; N], step: f64, rate: impl Fn([f64; N]) -> [f64; N]) -> [f64; N] {
    let along = |slope: &[f64; N], by: f64| std::array::from_fn(|i| state[i] + slope[i] * by);
    let a = rate(state);
    let b = rate(along(&a, 0.5 * step));
    let c = rate(along(&b, 0.5 * step));
    let d = rate(along(&c, step));
    std::array::from_fn(|i| state[i] + (a[i] + 2.0 * (b[i] + c[i]) + d[i]) * (step / 6.0))
}

/// Force of the law `k E* sqrt(V d)` over that of Hertz for two spheres (-): `sqrt(V / (pi R* d^2))` with the volume of
/// their lens. With equal radii it is `sqrt(1 - d / (6 R))`.
///
/// # Reference
/// Volume of the lens: Weisstein, Sphere-Sphere Intersection, `MathWorld`.
pub(super) fn lens_ratio([a, b]: [f64; 2], depth: f64) -> f64 {
    let distance = a + b - depth;
    let volume_over_pi_square =
        (distance * distance + 2.0 * distance * (a + b) - 3.0 * (a - b) * (a - b)) / (12.0 * distance);
    (volume_over_pi_square * (a + b) / (a * b)).sqrt()
}

/// The same for a sphere and a plane, `sqrt(1 - d / (3 R))`.
pub(super) fn cap_ratio(radius: f64, depth: f64) -> f64 {
    (1.0 - depth / (3.0 * radius)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    const GLASS: Material = Material { youngs_modulus: 7e10, poisson_ratio: 0.22 };

    /// Two equal glass spheres of 1 mm.
    fn glass() -> Hertz {
        let mass = 2500.0 * 4.0 / 3.0 * PI * f64::powi(0.5e-3, 3);
        Hertz::pair([mass; 2], [0.5e-3; 2], [&GLASS; 2])
    }

    fn plain(_: f64) -> f64 {
        1.0
    }

    #[test]
    fn the_elastic_impact_of_two_glass_spheres_has_the_depth_and_duration_of_hertz() {
        let hertz = glass();
        assert!((hertz.deepest(1.0) / 1.021_688_531_796e-6 - 1.0).abs() < 1e-12);
        assert!((hertz.duration(1.0) / 3.007_110_502e-6 - 1.0).abs() < 1e-9);
        let impact = impact(&hertz, Damping::Tsuji(1.0), plain, 1.0);
        assert!((impact.deepest / hertz.deepest(1.0) - 1.0).abs() < 1e-8);
        assert!((impact.duration / hertz.duration(1.0) - 1.0).abs() < 1e-8);
        assert!((impact.restitution - 1.0).abs() < 1e-8);
    }

    #[test]
    fn damped_impacts_have_the_duration_and_depth_of_an_independent_integration() {
        // Restitution; of Hunt-Crossley what it realises, duration and depth over Hertz; the same two of Tsuji; its least
        // force over K d_0^(3/2), K = m* = u_0 = 1.
        let table = [
            [0.95, -5.8e-8, 1.00538, 0.97982, 1.00525, 0.97990, -0.010],
            [0.9, -8.5e-7, 1.01162, 0.95926, 1.01107, 0.95959, -0.023],
            [0.8, -1.1e-5, 1.02724, 0.91688, 1.02472, 0.91830, -0.049],
            [0.7, -3.5e-5, 1.04846, 0.87250, 1.04189, 0.87599, -0.073],
            [0.5, 1.7e-4, 1.11970, 0.77567, 1.09337, 0.78747, -0.110],
            [0.3, 4.0e-3, 1.28073, 0.66156, 1.19487, 0.69116, -0.118],
        ];
        let unit = Hertz { mass: 1.0, modulus: 0.75, radius: 1.0 };
        for [e, off, hc_time, hc_depth, time, depth, pull] in table {
            let close = |measured: f64, expected: f64| (measured - expected).abs() < 1e-5;
            let (duration, deepest) = (unit.duration(1.0), unit.deepest(1.0));
            let hc = impact(&unit, Damping::HuntCrossley(e), plain, 1.0);
            assert!(close(hc.duration / duration, hc_time), "{e}: {}", hc.duration / duration);
            assert!(close(hc.deepest / deepest, hc_depth), "{e}: {}", hc.deepest / deepest);
            assert!((hc.restitution - e - off).abs() < 0.05 * off.abs() + 1e-8, "{e}");
            let tsuji = impact(&unit, Damping::Tsuji(e), plain, 1.0);
            assert!(close(tsuji.duration / duration, time), "{e}: {}", tsuji.duration / duration);
            assert!(close(tsuji.deepest / deepest, depth), "{e}: {}", tsuji.deepest / deepest);
            assert!((tsuji.restitution - e).abs() < 1e-6, "{e}: {}", tsuji.restitution);
            let least = tsuji.history.iter().fold(0.0_f64, |least, i| least.min(i.force));
            assert!((least - pull).abs() < 1e-3, "{e}: {least}");
        }
    }

    #[test]
    fn the_volume_law_is_softer_than_hertz_by_the_ratios_of_lens_and_cap() {
        let table = [
            [1e-4, 0.999991667, 0.999986805, 0.999983333],
            [1e-3, 0.999916663, 0.999868034, 0.999833319],
            [1e-2, 0.999166319, 0.998678372, 0.998331942],
            [1e-1, 0.991631652, 0.986576572, 0.983192080],
        ];
        for [depth, equal, unlike, plane] in table {
            assert!((lens_ratio([1.0; 2], depth) - equal).abs() < 1e-9);
            assert!((lens_ratio([1.0, 0.6], depth) - unlike).abs() < 1e-9);
            assert!((cap_ratio(1.0, depth) - plane).abs() < 1e-9);
        }
    }

    #[test]
    fn the_volume_law_shifts_depth_and_duration_to_first_order_in_the_depth() {
        let hertz = glass();
        let radius = 0.5e-3;
        let q = hertz.deepest(1.0) / radius;
        let ratio = |depth| lens_ratio([radius; 2], depth);
        let impact = impact(&hertz, Damping::HuntCrossley(1.0), ratio, 1.0);
        let shifts = [impact.deepest / hertz.deepest(1.0) - 1.0, impact.duration / hertz.duration(1.0) - 1.0];
        assert!((shifts[0] / q - 0.0239).abs() < 2e-4, "{}", shifts[0] / q);
        assert!((shifts[1] / q - 0.0298).abs() < 2e-4, "{}", shifts[1] / q);
    }
}
