//! Lubrication: what the fluid in a narrow gap does to two bodies, as far as the lattice does not resolve it.
//!
//! At a gap of the width `h`, `delta = h / dx` cells, in a fluid of the viscosity `mu`, with the unit vector `n` from the first body to the
//! second, the curvature of the gap `K = K_a + K_b` at the nearest points ([`nearest`](super::nearest)) and the velocities of both
//! bodies at the point half-way between these, the surfaces slide at `s` and roll at `r`:
//!
//! ```text
//! u = v_a + omega_a x m_a - v_b - omega_b x m_b,   s = u - (u.n) n,   r = K^-1 ((K_b - K_a) s + 2 (omega_a - omega_b) x n)
//! F_n = -6 pi mu R^2 M(delta) / h  (u.n) n,   R = sqrt(2 / (tr K sqrt(det K)))
//! F_s = -(2 pi mu / sqrt(det K)) Lambda_s(delta) s,   F_r = -(2 pi mu / sqrt(det K)) Lambda_r(delta) 3 (K + 2 tr K)^-1 K r
//! F_a = F_n + F_s + (K_b - K_a) K^-1 F_r = -F_b,   T_a = m_a x F_a + n x 2 K^-1 F_r,   T_b = -m_b x F_a - n x 2 K^-1 F_r
//! ```
//!
//! With `M = 1` and both `Lambda = ln(R / h)` these are the singular terms of the exact resistance, of spheres with any ratio of radii and of
//! other smooth bodies; derivation: `docs/theory/contact.md`. A sphere has `K = 1/a`, a wall and the face of a polyhedron zero. Every term takes energy, forces are
//! opposite, and their moments are balanced. [`Unresolved`] has what is missing on a lattice.
//!
//! Resistances are those of a gap of at least the roughness; bodies that overlap have no film. A force grows without bound as the gap closes, so it is
//! implicit: with the velocity `v` of a term that the other forces would bring about within the sub-step `dt`, and the resistance `k`,
//!
//! ```text
//! F = -k v / (1 + dt (sigma_a + sigma_b)),   sigma = sum of k beta over the terms of all gaps of a body
//! ```
//!
//! where `beta` is the change of `v` by a unit impulse on that body; of two terms across each other, the largest eigenvalue, or a bound of it. For one gap
//! between spheres this is the backward Euler method. For any number of gaps, `sum dt k v^2 / (1 + ...) <= sum m v^2` over the bodies (Cauchy), so no
//! term takes more energy than there is, however long the sub-step.
//!
//! References: Jeffrey and Onishi (1984), doi:10.1017/S0022112084000355 (spheres); Cox (1974), Int. J. Multiphase Flow 1, 343 (other bodies); Goldman, Cox and Brenner (1967), doi:10.1016/0009-2509(67)80047-2 (a sphere along a wall); Ball and Melrose
//! (1997), doi:10.1016/S0378-4371(97)00412-3 (terms that take energy).

use super::law::Action;
use super::nearest::Gap;
use crate::math::{Mat3, Vec3};
use serde::Serialize;
use std::f64::consts::PI;

/// Sum of the mean curvatures (1 / cells) up to which they count: that of two spheres 8 cells across.
const MOST_CURVED: f64 = 0.5;

/// Least bulge (1 / cells) that counts.
const LEAST_BULGE: f64 = -0.1;

/// Gap (cells) from which on it counts: in narrower ones only the curvature does.
const BULGING_FROM: f64 = 0.1;

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

/// The part of the singular resistance that a lattice misses, at a gap of `x` cells, a reduced radius of `r` cells and a sum of the mean
/// curvatures of the bodies of `H <= 1/2` per cell, and a [`Gap::bulge`] of `B >= -1/10` per cell:
///
/// ```text
/// fade = 1 - (x / range)^4
/// M = fade / ((1 + (linear + curved H) x + square r x^2) (1 + bulging B x / (x + 1/10)))
/// Lambda = fade (1 - curved H) (ln(1 + (strength / x)^power) / power + tail)
/// ```
///
/// Fitted to forces and torques on held spheres (`validation/lubrication`). `curved` is there because the fluid feels surfaces the further out the
/// more they are curved, up to that of a sphere 8 cells across (`SurfaceShift` of the coupling).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Unresolved {
    /// Gap from which on nothing is missing (cells).
    pub range: f64,
    /// Decay of the normal part with the gap, between two bodies and at a wall (-).
    pub linear: [f64; 2],
    /// Addition for strongly curved surfaces (cells).
    pub curved: f64,
    /// Its decay with the square of the gap (-).
    pub square: f64,
    /// Less of it if the gap opens faster than between spheres (cells).
    pub bulging: f64,
    /// Tangential parts, between two bodies and at a wall.
    pub tangential: [Tangential; 2],
}

/// Tangential parts of [`Unresolved`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Tangential {
    /// Gaps at which they set in, of sliding and rolling (cells).
    pub strength: [f64; 2],
    /// Less of them for strongly curved surfaces, likewise (cells).
    pub curved: [f64; 2],
    /// Twice the power with which they fall off at wider gaps (-): a root and products, no `pow` for each of thousands of gaps.
    pub twice_power: u32,
    /// Part of rolling that is left at wide gaps (-).
    pub tail: f64,
}

impl Tangential {
    /// Logarithms of these strengths, for surfaces of any curvature.
    pub const fn plain(strength: [f64; 2]) -> Self {
        Self { strength, curved: [0.0; 2], twice_power: 2, tail: 0.0 }
    }
}

impl Unresolved {
    /// With partially saturated cells.
    pub fn saturated() -> Self {
        Self {
            range: 3.0,
            linear: [1.6, 2.0],
            curved: 6.0,
            square: 0.85,
            bulging: 1.0,
            tangential: [
                Tangential { strength: [0.285, 0.38], curved: [1.8, 1.0], twice_power: 5, tail: 0.0 },
                Tangential { strength: [0.0, 0.59], curved: [0.0, 0.5], twice_power: 13, tail: 0.02 },
            ],
        }
    }

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
            bulging: 0.0,
            tangential: [[0.7, 2.1], [0.28, 0.78]]
                .map(|parts| Tangential::plain(parts.map(|part| part * depth))),
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
    /// Inverse of its inertia in the world frame (1/(kg m^2)).
    pub inertia: Mat3,
}

/// Resistance times inverse inertia (1/s), of the normal term and of the tangential ones; over the gaps of a body they add up.
pub type Rates = [f64; 2];

/// The film of one gap: the normal term, and two tangential ones across each other for each of two kinds of motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Film([Term; 5]);

/// A resistance `k` (N s/m) to the velocity `v = d.(v_a - v_b) + omega_a.arm_a - omega_b.arm_b`: force `-k v d`, torques `-k v arm_a`
/// and `k v arm_b`.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Term {
    resistance: f64,
    /// `d` (-).
    direction: Vec3,
    /// Of both bodies (m).
    arms: [Vec3; 2],
}

/// Second body of a film, in a lattice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Partner {
    /// Another body, covered cells.
    Body = 0,
    /// A wall of the lattice.
    Wall = 1,
}

impl Lubrication {
    /// Gap from which on there is no force (m).
    pub fn range(&self) -> f64 {
        self.unresolved.range * self.cell
    }

    /// The film of a gap, none out of range; with the sum of the mean curvatures of the bodies (1/m).
    pub fn film(&self, gap: &Gap, mean: f64, partner: Partner) -> Option<Film> {
        if !(gap.width > 0.0 && gap.width < self.range()) {
            return None;
        }
        let Gap { normal, points, across, turning, difference, width, .. } = *gap;
        let Resistances { squeezing, tangential } = self.resistances(gap, mean, partner);
        let half = normal * (0.5 * width);
        let is_wall = partner == Partner::Wall;
        let levers = [points[0] + half, if is_wall { Vec3::zeros() } else { points[1] - half }];
        let term = |resistance: f64, direction: Vec3, roll: Vec3| {
            let roll = normal.cross(&roll);
            Term { resistance, direction, arms: levers.map(|lever| lever.cross(&direction) + roll) }
        };
        let [first, second] = [0, 1].map(|i| {
            let [sliding, rolling] = tangential[i];
            let shift = across[0] * difference[i][0] + across[1] * difference[i][1];
            [term(sliding, across[i], Vec3::zeros()), term(rolling, shift, across[i] * turning[i])]
        });
        Some(Film([term(squeezing, normal, Vec3::zeros()), first[0], second[0], first[1], second[1]]))
    }
}

/// Resistances of a film (N s/m).
struct Resistances {
    squeezing: f64,
    /// In each principal direction, of sliding and of rolling.
    tangential: [[f64; 2]; 2],
}

impl Lubrication {
    fn resistances(&self, gap: &Gap, mean: f64, partner: Partner) -> Resistances {
        let open = gap.width.max(self.roughness);
        let (cells, reduced, kind) = (open / self.cell, gap.reduced(), partner as usize);
        let Unresolved { range, linear, curved, square, bulging, tangential } = self.unresolved;
        let part = (cells / range) * (cells / range);
        let unit = PI * self.viscosity * gap.part * (1.0 - part * part).max(0.0);
        let curvature = (self.cell * mean).min(MOST_CURVED);
        let bulge = bulging * (self.cell * gap.bulge).max(LEAST_BULGE) * cells / (cells + BULGING_FROM);
        let linear = linear[kind] + curved * curvature;
        let decay = (1.0 + cells * (linear + square * (reduced / self.cell) * cells)) * (1.0 + bulge);
        let [first, second] = gap.curvatures;
        let Tangential { strength, curved, twice_power, tail } = tangential[kind];
        let power = 0.5 * f64::from(twice_power);
        let [sliding, rolling] = [0, 1].map(|k| {
            let root = (strength[k] / cells).sqrt();
            let ratio = (0..twice_power).fold(1.0, |product, _| product * root);
            let logarithm = libm::log1p(ratio) / power + [0.0, tail][k];
            2.0 * unit / (first * second).sqrt() * (1.0 - curved[k] * curvature) * logarithm
        });
        Resistances {
            squeezing: 6.0 * unit * reduced * reduced / (open * decay),
            tangential: gap.curvatures.map(|curvature| {
                let part = 3.0 * curvature / (curvature + 2.0 * (first + second));
                [sliding, part * rolling]
            }),
        }
    }
}

impl Film {
    /// Rates that the film adds to those of the bodies.
    pub fn rates(&self, bodies: [&Mobility; 2]) -> [Rates; 2] {
        let terms = &self.0;
        std::array::from_fn(|i| {
            let Mobility { mass, inertia } = bodies[i];
            let turned: [Vec3; 5] = std::array::from_fn(|n| inertia * terms[n].arms[i]);
            // Change of the velocity of one term by a unit impulse of another one, or of itself.
            let change = |n: usize, by: usize| {
                mass * terms[n].direction.dot(&terms[by].direction) + terms[n].arms[i].dot(&turned[by])
            };
            let own = |n: usize| terms[n].resistance * change(n, n);
            // An upper bound of the largest eigenvalue of two terms.
            let both = |one: usize, other: usize| {
                let mixed =
                    (terms[one].resistance * terms[other].resistance).sqrt() * change(one, other).abs();
                own(one).max(own(other)) + mixed
            };
            [own(0), both(1, 2) + both(3, 4)]
        })
    }

    /// Force and torques, implicit over a sub-step of `dt` (s).
    pub fn act(&self, sides: [&Side; 2], dt: f64) -> Action {
        let velocity = sides[0].velocity - sides[1].velocity;
        let parts = [0, 1].map(|group| -1.0 / (1.0 + dt * (sides[0].rates[group] + sides[1].rates[group])));
        let mut action = Action { force: Vec3::zeros(), torques: [Vec3::zeros(); 2] };
        for (n, Term { resistance, direction, arms }) in self.0.iter().enumerate() {
            let turning = sides[0].spin.dot(&arms[0]) - sides[1].spin.dot(&arms[1]);
            let push = resistance * parts[usize::from(n > 0)] * (velocity.dot(direction) + turning);
            action.force += direction * push;
            action.torques[0] += arms[0] * push;
            action.torques[1] -= arms[1] * push;
        }
        action
    }
}

#[cfg(test)]
mod tests;
