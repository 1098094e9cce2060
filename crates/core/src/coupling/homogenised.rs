//! Homogenised cells (HLBM): the velocity of a covered cell is blended by the exact difference, and a body receives the
//! momentum exchanged over all links of all cells that it covers.
//!
//! ```text
//! u* = B (u + a) + (1 - B) u_s,   B = prod (1 - phi_k)       f' as in the kernel, pushed to u* instead of u + a
//! phi = 1                              d <= -w/2
//! phi = cos^2( pi/2 (d + w/2) / w )    -w/2 < d < w/2        d = signed distance of the cell's centre
//! phi = 0                              d >=  w/2             w = width of the ramp
//! F = (p_in - m_in u_s) - (p_out - m_out u_s)
//! ```
//!
//! `p`, `m` are the momentum and mass (minus the weights) that came in and left over all links of a covered cell. Inner
//! links cancel, so the sums are moments that the collision computes anyway. Cells that were covered only before or only
//! now are corrected one by one. Derivation: `docs/theory/coupling.md`.
//!
//! References: Krause et al. (2017), doi:10.1016/j.partic.2016.11.001; Wen et al. (2014),
//! doi:10.1016/j.jcp.2014.02.018; Marquardt et al. (2024), doi:10.1016/j.cpc.2024.109321 (its Eq. (15) has the wrong
//! sign: `u* - u = (1 - B)(u_s - u)`; its Eq. (16) lacks the opposite index and the minus sign).

mod collision;

use super::cover::{Cover, Rows, Surface};
use super::mapper::{Image, Mapper};
use super::method::{CouplingMethod, Departed};
use super::{Coupling, NONE, shift_of_reference};
use crate::fluid::simd::Registers;
use crate::fluid::{ExchangeSum, GROUP, Segment, Simd};

/// Homogenised cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Homogenised {
    /// Width of the ramp of the solid fraction (cells).
    pub ramp: f64,
}

impl CouplingMethod for Homogenised {
    fn half_layer(self) -> f64 {
        0.5 * self.ramp
    }

    fn keeps_cover(self) -> bool {
        true
    }

    fn cover(self, mapper: &Mapper, image: &Image, cover: &mut Cover, simd: Simd) {
        cover.add(Ramp(mapper), mapper, image, simd);
    }

    fn correct_cover(self, coupling: &mut Coupling, departed: &mut Departed, old_of: &[u32], new_of: &[u32]) {
        let domain = &coupling.decomposition.domain;
        let [_, ny, nz] = coupling.block.size();
        let (mut cells, mut corrections) = (Vec::new(), Vec::new());
        for row in 0..ny * nz {
            let (new, old) = (coupling.segments.row(row), coupling.swept_segments.row(row));
            let cell = |x: u32| [x as usize, row % ny, row / ny];
            for segment in new {
                let motion = &coupling.bodies[segment.body as usize].motion;
                let was = old_of[segment.body as usize];
                each_cell_outside(segment, &old.iter().filter(|s| s.body == was), |x| {
                    let n = offset_of(segment, x);
                    cells.push(cell(x));
                    corrections.push(Correction {
                        body: segment.body,
                        sign: -1,
                        velocity: motion.at(n),
                        n,
                        shift: [0; 3],
                    });
                });
            }
            for segment in old {
                let is = new_of[segment.body as usize];
                // A particle that this rank no longer has covers no cell of it, nor did it a step ago.
                if is == NONE {
                    continue;
                }
                let old_body = &coupling.swept_bodies[segment.body as usize];
                let shift =
                    shift_of_reference(old_body.reference, coupling.bodies[is as usize].reference, domain);
                each_cell_outside(segment, &new.iter().filter(|s| s.body == is), |x| {
                    let n = offset_of(segment, x);
                    cells.push(cell(x));
                    corrections.push(Correction {
                        body: is,
                        sign: 1,
                        velocity: old_body.motion.at(n),
                        n,
                        shift,
                    });
                });
            }
        }
        for (Correction { body, sign, velocity, n, shift }, left) in
            corrections.into_iter().zip(departed(&cells))
        {
            let sum = ExchangeSum::of_cell(left, velocity, n).shifted(shift);
            coupling.bodies[body as usize].exchange.add(&sum, sign);
        }
    }
}

/// A cell that a body covers only now (its sum is taken off), or covered only in the last sweep (its sum is added).
struct Correction {
    /// Index of the body now.
    body: u32,
    sign: i64,
    /// Velocity of the body in the cell.
    velocity: [f64; 3],
    /// Offset from the reference cell, and by how much offsets have grown since.
    n: [i64; 3],
    shift: [i64; 3],
}

/// A surface with a ramp of the solid fraction across it.
struct Ramp<'a>(&'a Mapper);

impl Surface for Ramp<'_> {
    fn rows<V: Registers>(&self, y: &[f64; GROUP], z: f64) -> Rows {
        self.0.rows(y, z)
    }

    #[inline(always)]
    fn fractions<V: Registers>(&self, n: &[f32; GROUP], y: f64, z: f64) -> [f32; GROUP] {
        let mut fractions = [0.0; GROUP];
        for k in 0..GROUP {
            let x = f64::from(n[k]) - self.0.motion.centre[0];
            fractions[k] = cosine_ramp(self.0.distance(x, y, z) * self.0.per_layer) as f32;
        }
        fractions
    }
}

/// Offset of cell `x` of a segment.
fn offset_of(segment: &Segment, x: u32) -> [i64; 3] {
    let [nx, ny, nz] = segment.offset.map(i64::from);
    [nx + i64::from(x - segment.x), ny, nz]
}

/// Calls `visit(x)` for every cell of `segment` that is in none of `others`.
fn each_cell_outside<'a>(
    segment: &Segment,
    others: &(impl Iterator<Item = &'a Segment> + Clone),
    mut visit: impl FnMut(u32),
) {
    let mut x = segment.x;
    while x < segment.end() {
        if let Some(other) = others.clone().find(|other| (other.x..other.end()).contains(&x)) {
            x = other.end();
        } else {
            visit(x);
            x += 1;
        }
    }
}

/// The ramp as a function of the signed distance over the width of the ramp; any argument.
///
/// `cos^2(pi/2 (s + 1/2)) = (1 - sin(pi s)) / 2` with the Taylor series of the sine, accurate to 1e-11: the system's
/// trigonometric functions differ between machines, and these numbers feed the state.
#[inline(always)]
pub(super) fn cosine_ramp(s: f64) -> f64 {
    if s <= -0.5 {
        return 1.0;
    }
    if s >= 0.5 {
        return 0.0;
    }
    let x = std::f64::consts::PI * s;
    let x2 = x * x;
    // In pairs of pairs: shorter chains of dependent operations than term by term.
    let (x4, c) = (x2 * x2, &SINE);
    let (low, high) =
        ((c[0] + c[1] * x2) + (c[2] + c[3] * x2) * x4, (c[4] + c[5] * x2) + (c[6] + c[7] * x2) * x4);
    0.5 * (1.0 - x * (low + high * (x4 * x4)))
}

/// `(-1)^k / (2 k + 1)!`
const SINE: [f64; 8] = {
    let mut coefficients = [1.0; 8];
    let mut k = 1;
    while k < 8 {
        coefficients[k] = -coefficients[k - 1] / ((2 * k) as f64 * (2 * k + 1) as f64);
        k += 1;
    }
    coefficients
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_difference_of_a_segment_and_others_is_visited_cell_by_cell() {
        let segment = |x: u32, count: u16| Segment { x, count, ..Segment::default() };
        let outside = |others: &[Segment]| {
            let mut cells = Vec::new();
            each_cell_outside(&segment(10, 6), &others.iter(), |x| cells.push(x));
            cells
        };
        assert_eq!(outside(&[]), [10, 11, 12, 13, 14, 15]);
        assert_eq!(outside(&[segment(11, 4)]), [10, 15]);
        assert_eq!(outside(&[segment(14, 9), segment(0, 11)]), [11, 12, 13]);
        assert_eq!(outside(&[segment(0, 40)]), [0_u32; 0]);
    }

    #[test]
    fn the_ramp_is_the_squared_cosine() {
        for i in -60..=60 {
            let s = f64::from(i) / 100.0;
            let exact = match s {
                s if s <= -0.5 => 1.0,
                s if s >= 0.5 => 0.0,
                s => (std::f64::consts::FRAC_PI_2 * (s + 0.5)).cos().powi(2),
            };
            assert!((cosine_ramp(s) - exact).abs() < 1e-11, "{s}");
        }
    }
}
