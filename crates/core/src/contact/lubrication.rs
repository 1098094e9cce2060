//! Lubrication: what the fluid in a narrow gap does to two bodies, as far as the lattice does not resolve it.
//!
//! Two spheres of radii `a` and `b`, `R = a b / (a + b)` (`R = a` at a wall), at a gap `h` of `delta = h / dx` cells in a fluid of
//! viscosity `mu`. With the unit vector `n` from the first to the second, the velocity `u` of the first relative to the second, and
//! the lengths `l_a = a + h/2`, `l_b = b + h/2`, the surfaces slide at `s` and roll at `r`:
//!
//! ```text
//! u_t = u - (u.n) n,   w_a = l_a omega_a x n,   w_b = l_b omega_b x n,   c = (l_a - l_b) / (l_a + l_b)
//! s = u_t + w_a + w_b,   r = c u_t + w_a - w_b
//! F_n = -6 pi mu R^2 M(delta) / h  (u.n) n
//! F_s = -2 pi mu R Lambda_s(delta) s,   F_r = -(6/5) pi mu R Lambda_r(delta) r
//! F_a = F_n + F_s + c F_r = -F_b,   T_a = l_a n x (F_s + F_r),   T_b = l_b n x (F_s - F_r)
//! ```
//!
//! With `M = 1` and both `Lambda = ln(R / h)` these are the singular terms of the exact resistance, which for sliding and
//! rolling are diagonal in `s` and `r`. So every term takes energy, forces are opposite, and their moments are balanced for any
//! two radii. [`Unresolved`] has what is missing on a lattice.
//!
//! Other smooth convex bodies, of which at least one is not a sphere or is part of a body, have the normal part alone, at their nearest points `r_a` and
//! `r_b` from the centres, with the `R` of the curvatures there ([`nearest`](super::nearest)):
//!
//! ```text
//! u_n = (v_a + omega_a x r_a - v_b - omega_b x r_b).n,   F_a = -6 pi mu R^2 M(delta) / h  u_n n = -F_b
//! T_a = r_a x F_a,   T_b = r_b x F_b
//! ```
//!
//! Resistances are those of a gap of at least the roughness; bodies that overlap have no film. A force grows without bound as the gap closes, so it is
//! implicit: with the velocity `v` of a term that the other forces would bring about within the sub-step `dt`, and the resistance `k`,
//!
//! ```text
//! F = -k v / (1 + dt (sigma_a + sigma_b)),   sigma = sum of k beta over the terms of all gaps of a body
//! ```
//!
//! where `beta` is the change of `v` by a unit impulse on that body, `1/m + (r x n).I^-1 (r x n)` for the normal part. For one gap this is the backward Euler method. For any number of
//! gaps, `sum dt k v^2 / (1 + ...) <= sum m v^2` over the bodies (Cauchy), so no term takes more energy than there is, however long
//! the sub-step.
//!
//! References: Jeffrey and Onishi (1984), doi:10.1017/S0022112084000355 (spheres); Cox (1974), Int. J. Multiphase Flow 1, 343 (other bodies); Goldman, Cox and Brenner (1967), doi:10.1016/0009-2509(67)80047-2 (a sphere along a wall); Ball and Melrose
//! (1997), doi:10.1016/S0378-4371(97)00412-3 (terms that take energy).

use super::law::Action;
use super::nearest::Gap;
use crate::math::{Quat, Vec3};
use serde::Serialize;
use std::f64::consts::PI;

/// Lubrication between all bodies of a case.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Lubrication {
    /// Dynamic viscosity of the fluid (Pa s).
    pub viscosity: f64,
    /// Smallest gap that counts (m): the height of the roughness of the surfaces.
    pub roughness: f64,
    /// Edge of a cell (m).
    pub cell: f64,
    /// Part of the force that a lattice of such cells misses.
    pub unresolved: Unresolved,
}

/// The part of the singular resistance that a lattice misses, at a gap of `x` cells and a reduced radius of `r` cells:
///
/// ```text
/// fade = 1 - (x / range)^4
/// M = fade / (1 + (linear + curved min(1/r, 1/2)) x + square r x^2)
/// Lambda_s = fade ln(1 + sliding / x),   Lambda_r = fade ln(1 + rolling / x)
/// ```
///
/// Fitted to forces on held spheres (`validation/lubrication`). `curved` is there because the fluid feels surfaces the further out the more they
/// are curved, up to that of a sphere 8 cells across (`SurfaceShift` of the coupling); `1/r` is the sum of the mean curvatures of two spheres.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Unresolved {
    /// Gap from which on nothing is missing (cells).
    pub range: f64,
    /// Decay of the normal part with the gap, between two bodies and at a wall (-).
    pub linear: [f64; 2],
    /// Addition for strongly curved surfaces (-).
    pub curved: f64,
    /// Its decay with the square of the gap (-).
    pub square: f64,
    /// Strength of the sliding part, between two bodies and at a wall (-).
    pub sliding: [f64; 2],
    /// Strength of the rolling part, likewise (-).
    pub rolling: [f64; 2],
}

impl Unresolved {
    /// With partially saturated cells, for relaxation times from 0.53 to 1.
    pub const SATURATED: Self = Self {
        range: 3.0,
        linear: [0.6, 2.0],
        curved: 6.0,
        square: 0.85,
        sliding: [0.16, 0.0],
        rolling: [0.65, 0.29],
    };

    /// With homogenised cells, whose surface lies deeper in the body the longer the relaxation time is (time steps, 0.53 to 1). For sliding and
    /// rolling fitted at 1 alone.
    pub fn homogenised(relaxation_time: f64) -> Self {
        let above_half = relaxation_time - 0.5;
        let depth = above_half.sqrt();
        Self {
            range: (9.5 * depth * depth.sqrt()).min(3.0),
            linear: [0.85 + 0.035 / above_half, 1.0 + 0.21 / above_half],
            curved: 0.125 / above_half - 1.2,
            square: (0.112 / above_half - 0.2).max(0.0),
            sliding: [0.7 * depth, 0.28 * depth],
            rolling: [2.1 * depth, 0.78 * depth],
        }
    }
}

/// One of the two bodies of a gap.
#[derive(Clone, Copy, Debug)]
pub struct Side {
    /// Velocity of its centre (m/s) at the end of the sub-step, as all other forces would make it.
    pub velocity: Vec3,
    /// Its angular velocity (1/s) likewise.
    pub spin: Vec3,
    /// The rates of all its gaps together.
    pub rates: Rates,
}

/// Mobility of a body; the default is that of a wall, which does not move.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Mobility {
    /// Inverse of its mass (1/kg).
    pub mass: f64,
    /// Inverses of its principal moments of inertia (1/(kg m^2)).
    pub moments: Vec3,
    /// Maps its principal axes to the world frame.
    pub orientation: Quat,
}

/// Resistance times inverse inertia (1/s), of the normal term and of the tangential ones; over the gaps of a body they add up.
pub type Rates = [f64; 2];

/// The film of one gap.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Film {
    /// Resistances (N s/m): normal, sliding, rolling.
    resistances: [f64; 3],
    /// Lengths from the centres of spheres to the middle of the gap (m); that of a wall is zero.
    levers: [f64; 2],
    /// `c` of the formulas (-).
    difference: f64,
    /// `r x n` of the normal part (m); zero for a sphere.
    arms: [Vec3; 2],
}

impl Lubrication {
    /// Gap from which on there is no force (m).
    pub fn range(&self) -> f64 {
        self.unresolved.range * self.cell
    }

    /// The film between two spheres, or between a sphere and a wall, whose radius is infinite. `gap` (m) is the distance of the
    /// surfaces; bodies that overlap or are too far apart have none.
    pub fn film(&self, radii: [f64; 2], gap: f64) -> Option<Film> {
        if !(gap > 0.0 && gap < self.range()) {
            return None;
        }
        let reduced = radii[0] / (1.0 + radii[0] / radii[1]);
        let is_wall = radii[1].is_infinite();
        let lever = |radius: f64| radius + 0.5 * gap;
        let (levers, difference) = if is_wall {
            ([lever(radii[0]), 0.0], -1.0)
        } else {
            (radii.map(lever), (radii[0] - radii[1]) / (radii[0] + radii[1] + gap))
        };
        let resistances = self.resistances(reduced, gap, is_wall);
        Some(Film { resistances, levers, difference, arms: [Vec3::zeros(); 2] })
    }

    /// The film between two bodies, or between a body and a wall, of which only the normal part is known; none out of range.
    pub fn squeezed(&self, gap: &Gap, is_wall: bool) -> Option<Film> {
        if !(gap.width > 0.0 && gap.width < self.range()) {
            return None;
        }
        let [squeezing, ..] = self.resistances(gap.reduced, gap.width, is_wall);
        let arms = gap.points.map(|point| point.cross(&gap.normal));
        Some(Film { resistances: [squeezing, 0.0, 0.0], levers: [0.0; 2], difference: 0.0, arms })
    }

    /// [`Film::resistances`] of a gap (m) within range, with the reduced radius (m).
    fn resistances(&self, reduced: f64, gap: f64, is_wall: bool) -> [f64; 3] {
        let wall = usize::from(is_wall);
        let open = gap.max(self.roughness);
        let cells = open / self.cell;
        let Unresolved { range, linear, curved, square, sliding, rolling } = self.unresolved;
        let part = (cells / range) * (cells / range);
        let unit = PI * self.viscosity * reduced * (1.0 - part * part).max(0.0);
        let linear = linear[wall] + curved * (self.cell / reduced).min(0.5);
        let decay = 1.0 + cells * (linear + square * (reduced / self.cell) * cells);
        [
            6.0 * unit * reduced / (open * decay),
            2.0 * unit * libm::log1p(sliding[wall] / cells),
            1.2 * unit * libm::log1p(rolling[wall] / cells),
        ]
    }
}

impl Film {
    /// Rates that the film adds to those of the bodies.
    pub fn rates(&self, bodies: [Mobility; 2]) -> [Rates; 2] {
        let [squeezing, sliding, rolling] = self.resistances;
        let c = self.difference;
        std::array::from_fn(|i| {
            let Mobility { mass, moments, orientation } = bodies[i];
            let turn = self.levers[i] * self.levers[i] * moments.x;
            let arm = orientation.inverse_transform_vector(&self.arms[i]);
            let tilt = arm.component_mul(&arm).dot(&moments);
            [squeezing * (mass + tilt), sliding * (mass + turn) + rolling * (c * c * mass + turn)]
        })
    }

    /// Force and torques, implicit over a sub-step of `dt` (s); `normal` leads from the first body to the second.
    pub fn act(&self, normal: Vec3, sides: [&Side; 2], dt: f64) -> Action {
        let [squeezing, sliding, rolling] = self.resistances;
        let ([a, b], c) = (self.levers, self.difference);
        let velocity = sides[0].velocity - sides[1].velocity;
        let approach = velocity.dot(&normal);
        let along = velocity - normal * approach;
        let turning = [sides[0].spin.cross(&normal) * a, sides[1].spin.cross(&normal) * b];
        let slip = along + turning[0] + turning[1];
        let roll = along * c + turning[0] - turning[1];
        let [straight, across] =
            [0, 1].map(|term| 1.0 / (1.0 + dt * (sides[0].rates[term] + sides[1].rates[term])));
        let (slip, roll) = (slip * (-sliding * across), roll * (-rolling * across));
        let approach = approach + (sides[0].spin.dot(&self.arms[0]) - sides[1].spin.dot(&self.arms[1]));
        let squeeze = -squeezing * straight * approach;
        Action {
            force: normal * squeeze + slip + roll * c,
            torques: [
                normal.cross(&(slip + roll)) * a + self.arms[0] * squeeze,
                normal.cross(&(slip - roll)) * b - self.arms[1] * squeeze,
            ],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::nearest::Ellipsoidal;
    use crate::contact::tests::{random, random_direction, random_turn};
    use crate::wall::Surface;
    use rand::Rng;

    const VISCOSITY: f64 = 0.7;

    /// Everything singular is missing, and both logarithms are `log`.
    fn everything(cell: f64, gap: f64, log: f64) -> Lubrication {
        let strength = [libm::expm1(log) * gap / cell; 2];
        let unresolved = Unresolved {
            range: 1e9,
            linear: [0.0; 2],
            curved: 0.0,
            square: 0.0,
            sliding: strength,
            rolling: strength,
        };
        Lubrication { viscosity: VISCOSITY, roughness: 0.0, cell, unresolved }
    }

    fn side(velocity: Vec3, spin: Vec3) -> Side {
        Side { velocity, spin, rates: [0.0; 2] }
    }

    #[test]
    fn the_singular_resistances_of_two_spheres_are_those_of_jeffrey_and_onishi_for_any_ratio_of_radii() {
        let (a, gap, log) = (1.3, 1e-9, 4.0);
        let (along, across, turning) = (Vec3::z(), Vec3::x(), Vec3::y());
        let still = side(Vec3::zeros(), Vec3::zeros());
        for l in [0.2, 0.5, 1.0, 3.0, 10.0_f64] {
            let film = everything(0.1, gap, log).film([a, l * a], gap).unwrap();
            let act = |first: &Side| film.act(along, [first, &still], 0.0);
            let same = |value: f64, expected: f64| {
                assert!((value / expected - 1.0).abs() < 1e-7, "{value} {expected}");
            };
            let m = PI * VISCOSITY * a;
            // Squeezing: X^A, of which the gap is measured in means of the radii.
            let squeezed = act(&side(along, Vec3::zeros()));
            let x = 2.0 * l * l / (1.0 + l).powi(3) * (0.5 * (1.0 + l) * a / gap);
            same(squeezed.force.z, -6.0 * m * x);
            assert!(squeezed.torques == [Vec3::zeros(); 2]);
            // A velocity across the line of centres: Y^A and Y^B.
            let sheared = act(&side(across, Vec3::zeros()));
            let (y_a, y_b) = (
                4.0 * l * (2.0 + l + 2.0 * l * l) / (15.0 * (1.0 + l).powi(3)),
                l * (4.0 + l) / (5.0 * (1.0 + l).powi(2)),
            );
            same(sheared.force.x, -6.0 * m * y_a * log);
            same(sheared.torques[0].y, -4.0 * m * a * y_b * log);
            // A spin: Y^B again, by reciprocity, and Y^C of both spheres.
            let spun = act(&side(Vec3::zeros(), turning));
            same(spun.force.x, -4.0 * m * a * y_b * log);
            same(spun.torques[0].y, -8.0 * m * a * a * 2.0 * l / (5.0 * (1.0 + l)) * log);
            same(spun.torques[1].y, -8.0 * m * a * a * l * l / (10.0 * (1.0 + l)) * log);
        }
    }

    #[test]
    fn the_singular_resistances_at_a_wall_are_those_of_goldman_cox_and_brenner() {
        let (a, gap, log) = (1.3, 1e-9, 4.0);
        let film = everything(0.1, gap, log).film([a, f64::INFINITY], gap).unwrap();
        let still = side(Vec3::zeros(), Vec3::zeros());
        let act = |first: &Side| film.act(-Vec3::z(), [first, &still], 0.0);
        let same =
            |value: f64, expected: f64| assert!((value / expected - 1.0).abs() < 1e-7, "{value} {expected}");
        let m = PI * VISCOSITY * a;
        same(act(&side(-Vec3::z(), Vec3::zeros())).force.z, 6.0 * m * a / gap);
        let (moved, spun) = (act(&side(Vec3::x(), Vec3::zeros())), act(&side(Vec3::zeros(), Vec3::y())));
        same(moved.force.x, -6.0 * m * 8.0 / 15.0 * log);
        same(moved.torques[0].y, 8.0 * m * a * 0.1 * log);
        same(spun.force.x, 6.0 * m * a * 2.0 / 15.0 * log);
        same(spun.torques[0].y, -8.0 * m * a * a * 0.4 * log);
    }

    #[test]
    fn two_spheres_that_move_like_one_rigid_body_feel_nothing_and_any_other_motion_costs_energy() {
        let mut random = random(8);
        for _ in 0..2000 {
            let radii = [random.random_range(0.1..3.0), random.random_range(0.1..3.0)];
            let gap = random.random_range(1e-3..0.1);
            let film = everything(0.05, gap, random.random_range(0.1..5.0)).film(radii, gap).unwrap();
            let normal = random_direction(&mut random);
            let [u, v, spin, other] = [0; 4].map(|_| random_direction(&mut random));
            let offset = normal * (radii[0] + radii[1] + gap);
            let rigid = [side(u, spin), side(u + spin.cross(&offset), spin)];
            let felt = film.act(normal, [&rigid[0], &rigid[1]], 0.0);
            let scale = VISCOSITY * 400.0 / gap;
            assert!(
                felt.force.norm() < 1e-12 * scale && felt.torques.iter().all(|t| t.norm() < 1e-12 * scale)
            );

            let sides = [side(u, spin), side(v, other)];
            let Action { force, torques } = film.act(normal, [&sides[0], &sides[1]], 0.0);
            assert!(force.dot(&(u - v)) + torques[0].dot(&spin) + torques[1].dot(&other) < 0.0);
            // Forces are opposite; so their moment is that of the force on the second.
            let moment = torques[0] + torques[1] - offset.cross(&force);
            assert!(moment.norm() < 1e-12 * scale, "{moment}");
        }
    }

    #[test]
    fn ellipsoids_with_equal_axes_have_the_normal_force_of_spheres() {
        let mut random = random(9);
        for _ in 0..200 {
            let [a, b, width] = [0.5..2.0, 0.5..2.0, 1e-3..0.1].map(|range| random.random_range(range));
            let film = Lubrication {
                viscosity: VISCOSITY,
                roughness: 1e-4,
                cell: 0.1,
                unresolved: Unresolved::SATURATED,
            };
            let bodies = [a, b].map(|r: f64| Ellipsoidal::new(Vec3::repeat(r), &random_turn(&mut random)));
            let normal = random_direction(&mut random);
            let [u, v, spin, other] = [0; 4].map(|_| random_direction(&mut random));
            let sides = [side(u, spin), side(v, other)];
            let act = |film: Film| film.act(normal, [&sides[0], &sides[1]], 0.0);
            let wall = Surface::Plane { point: normal * (a + width), normal: -normal };
            let cases = [
                ([a, b], bodies[0].gap(&bodies[1], normal * (a + b + width), 1.0), false),
                ([a, f64::INFINITY], bodies[0].gap_to_wall(&wall, 1.0), true),
            ];
            for (radii, gap, is_wall) in cases {
                let (sphere, local) = (
                    act(film.film(radii, width).unwrap()),
                    act(film.squeezed(&gap.unwrap(), is_wall).unwrap()),
                );
                let scale = sphere.force.dot(&normal).abs().max(1e-3 / width);
                // The gap is a difference of lengths.
                let rounding = 1e-14 / width * scale;
                assert!((local.force.dot(&normal) - sphere.force.dot(&normal)).abs() < rounding);
                assert!((local.force - normal * local.force.dot(&normal)).norm() < rounding);
                assert!(local.torques.iter().all(|torque| torque.norm() < rounding));
            }
        }
    }

    #[test]
    fn two_ellipsoids_that_move_like_one_rigid_body_feel_nothing_and_any_other_motion_keeps_momenta_and_costs_energy()
     {
        let mut random = random(10);
        let lubrication = everything(0.05, 0.05, 1.0);
        let mut found = 0;
        for _ in 0..2000 {
            let [first, second] = [0; 2].map(|_| {
                let axes = Vec3::from_fn(|_, _| random.random_range(0.3..1.5));
                Ellipsoidal::new(axes, &random_turn(&mut random))
            });
            let offset = random_direction(&mut random) * 2.0;
            let Some(gap) = first.gap(&second, offset, 1.0) else { continue };
            found += 1;
            let film = lubrication.squeezed(&gap, false).unwrap();
            let [u, v, spin, other] = [0; 4].map(|_| random_direction(&mut random));
            let rigid = [side(u, spin), side(u + spin.cross(&offset), spin)];
            let felt = film.act(gap.normal, [&rigid[0], &rigid[1]], 0.0);
            let scale = 1e-12 * film.resistances[0];
            assert!(felt.force.norm() < scale && felt.torques.iter().all(|t| t.norm() < scale));
            let sides = [side(u, spin), side(v, other)];
            let Action { force, torques } = film.act(gap.normal, [&sides[0], &sides[1]], 0.0);
            assert!(force.dot(&(u - v)) + torques[0].dot(&spin) + torques[1].dot(&other) < 0.0);
            assert!((torques[0] + torques[1] - offset.cross(&force)).norm() < scale);
        }
        assert!(found > 300, "{found}");
    }

    #[test]
    fn the_force_ends_without_a_step_at_the_range_and_stays_the_same_below_the_roughness() {
        let unresolved = Unresolved::SATURATED;
        let film = Lubrication { viscosity: 1.0, roughness: 1e-3, cell: 0.1, unresolved };
        let squeezing = |gap: f64| film.film([1.0, 2.0], gap).map_or(0.0, |film| film.resistances[0]);
        assert!(squeezing(0.3001) == 0.0 && squeezing(-1e-9) == 0.0 && squeezing(f64::NAN) == 0.0);
        assert!(squeezing(0.2999) < 1e-3 * squeezing(0.1));
        assert_eq!(squeezing(1e-9).to_bits(), squeezing(1e-3).to_bits());
        assert!(squeezing(1e-3) > 1.5 * squeezing(2e-3));
    }
}
