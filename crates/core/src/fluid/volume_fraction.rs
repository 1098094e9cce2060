//! Volume fraction of a cell that is inside a particle.
//!
//! Volume of a unit cube behind a plane with unit normal `n`, at the signed distance `d` of the cell's centre
//! (cells, negative inside):
//!
//! ```text
//! m_1 <= m_2 <= m_3 of |n_a|,   s = m_1 + m_2 + m_3,   q = s/2 - |d|,   x+ = max(x, 0)
//! V = (q - (m_1 + m_2) / 2) / m_3                                                         q >= m_1 + m_2
//! V = (m_1 (3 q (q - m_1) + m_1^2) - (m_1 - q)+^3 - (q - m_2)+^3 - (q - m_3)+^3) / (6 m_1 m_2 m_3)   otherwise
//! V(d > 0) = V,   V(d < 0) = 1 - V
//! ```
//!
//! In this form no terms cancel that are larger than the result times `m_1 m_2 m_3`, so single precision is enough.
//!
//! A curved surface counts as a plane moved in by `(k_1 + k_2) / 24` (principal curvatures, 1 / cells). Fractions
//! `v`, `w` behind two planes whose normals have the cosine `c` combine as `(1 - c) v w + c min(v, w)` for `c >= 0`
//! and `(1 + c) v w - c max(0, v + w - 1)` otherwise. Derivation: `docs/theory/coupling.md`.
//!
//! Reference: Scardovelli and Zaleski (2000), doi:10.1006/jcph.2000.6567.

use crate::fluid::simd::Choose;

/// Components of a normal below this count as this.
pub(crate) const LEAST: f32 = 1e-4;

/// Volume fraction of cells behind a plane with normal `n`, the signed distance of their centres being `d` (cells).
#[inline(always)]
pub(crate) fn behind_plane<R: Choose<f32>>(d: R, n: [R; 3]) -> R {
    Normal::unit(n).behind(d)
}

/// The size of a component of a normal, at least so large.
#[inline(always)]
pub(crate) fn at_least<R: Choose<f32>>(x: R, least: R) -> R {
    x.size().max(least)
}

/// Properties of the normal of a plane that the volume behind it needs.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Normal<R> {
    /// `m_1 <= m_2 <= m_3`, and the square of the first.
    sizes: [R; 3],
    square: R,
    /// `s / 2` and `(m_1 + m_2) / 2`.
    half: R,
    half_both: R,
    both: R,
    /// `6 m_1 m_2`, and that times `m_3`.
    product: R,
    divisor: R,
}

impl Normal<f32> {
    /// The same for all lanes.
    #[inline(always)]
    pub(crate) fn splat<R: Choose<f32>>(&self) -> Normal<R> {
        let [m1, m2, m3] = self.sizes;
        Normal {
            sizes: [R::splat(m1), R::splat(m2), R::splat(m3)],
            square: R::splat(self.square),
            half: R::splat(self.half),
            half_both: R::splat(self.half_both),
            both: R::splat(self.both),
            product: R::splat(self.product),
            divisor: R::splat(self.divisor),
        }
    }
}

/// Properties of the unit normal `n` of a face that the volume behind it needs, in the form for a device.
pub(crate) fn face_numbers(n: [f32; 3]) -> [f32; 9] {
    let Normal { sizes: [m1, m2, m3], square, half, half_both, both, product, divisor } =
        Normal::<f32>::unit(n);
    [m1, m2, m3, square, half, half_both, both, product, divisor]
}

impl<R: Choose<f32>> Normal<R> {
    /// The unit vector `n`.
    #[inline(always)]
    pub(crate) fn unit(n: [R; 3]) -> Self {
        let least = R::splat(LEAST);
        Self::new([at_least(n[0], least), at_least(n[1], least), at_least(n[2], least)])
    }

    /// From the sizes of the components; it may have any length if distances are multiplied by it.
    #[inline(always)]
    pub(crate) fn new(m: [R; 3]) -> Self {
        let (low, high) = (m[0].min(m[1]), m[0].max(m[1]));
        let (m1, rest, m3) = (low.min(m[2]), low.max(m[2]), high.max(m[2]));
        let m2 = high.min(rest);
        let (both, product, half) = (m1 + m2, R::splat(6.0) * (m1 * m2), R::splat(0.5));
        Self {
            sizes: [m1, m2, m3],
            square: m1 * m1,
            half: half * (both + m3),
            half_both: half * both,
            both,
            product,
            divisor: product * m3,
        }
    }

    /// Volume fraction of cells behind the plane at the signed distance `d` of their centres.
    #[inline(always)]
    pub(crate) fn behind(&self, d: R) -> R {
        let (c, [m1, m2, m3]) = (|x: f32| R::splat(x), self.sizes);
        let cube = |x: R| {
            let x = x.max(c(0.0));
            (x * x) * x
        };
        // By symmetry the smaller part.
        let q = (self.half - d.size()).max(c(0.0));
        let corner =
            m1 * ((c(3.0) * q) * (q - m1) + self.square) - ((cube(m1 - q) + cube(q - m2)) + cube(q - m3));
        let band = self.product * (q - self.half_both);
        let part = self.both.if_greater(q, corner, band).over(self.divisor);
        let part = part.max(c(0.0)).min(c(0.5));
        d.if_greater(c(0.0), part, c(1.0) - part)
    }
}

/// Distance (cells) by which a surface with this sum of principal curvatures (1 / cells) is moved in.
#[inline(always)]
pub(crate) fn curved(curvature: f64) -> f64 {
    curvature / 24.0
}

/// Volume fraction behind two planes whose normals have the cosine `c`.
#[inline(always)]
pub(crate) fn behind_both<R: Choose<f32>>(v: R, w: R, c: R) -> R {
    let (zero, both) = (R::splat(0.0), v * w);
    let other = c.if_greater(zero, v.min(w), (v + w - R::splat(1.0)).max(zero));
    both + c.size() * (other - both)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The formula of Scardovelli and Zaleski in double precision, which cancels where components are small.
    fn exact(d: f64, n: [f64; 3]) -> f64 {
        let m = n.map(|x| x.abs().max(f64::from(LEAST)));
        let s: f64 = m.iter().sum();
        let q = 0.5 * s - d.abs();
        let cube = |x: f64| x.max(0.0).powi(3);
        let single: f64 = m.iter().map(|m| cube(q - m)).sum();
        let double: f64 = m.iter().map(|m| cube(q - (s - m))).sum();
        let part = ((cube(q) - single) + double) / (6.0 * m[0] * m[1] * m[2]);
        if d > 0.0 { part } else { 1.0 - part }
    }

    /// By counting `n^3` points.
    fn counted(d: f64, n: [f64; 3]) -> f64 {
        let count = 60;
        let at = |k: usize| (k as f64 + 0.5) / count as f64 - 0.5;
        let inside = (0..count * count * count)
            .filter(|&k| {
                let p = [at(k % count), at(k / count % count), at(k / count / count)];
                p[0] * n[0] + p[1] * n[1] + p[2] * n[2] + d < 0.0
            })
            .count();
        inside as f64 / (count * count * count) as f64
    }

    #[test]
    fn the_share_of_a_cell_behind_a_plane_is_what_counting_points_says() {
        let root = 3.0_f64.sqrt().recip();
        for n in
            [[1.0, 0.0, 0.0], [0.0, -0.6, 0.8], [root, root, -root], [0.28, 0.96, 0.0], [0.48, -0.6, 0.64]]
        {
            for k in -10..=10 {
                let d = 0.09 * f64::from(k);
                let (exact, counted) = (exact(d, n), counted(d, n));
                assert!((exact - counted).abs() < 0.01, "{n:?} {d}: {exact} {counted}");
            }
        }
    }

    #[test]
    fn single_precision_is_as_good_as_the_numbers_it_gets() {
        let mut worst = 0.0_f64;
        for (a, b) in (0..60).flat_map(|a| (0..120).map(move |b| (a, b))) {
            let (theta, phi) = (0.0265 * f64::from(a), 0.0265 * f64::from(b));
            let n = [theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()];
            for k in -90..=90 {
                let d = 0.01 * f64::from(k);
                worst =
                    worst.max((f64::from(behind_plane(d as f32, n.map(|x| x as f32))) - exact(d, n)).abs());
            }
        }
        assert!(worst < 2e-6, "{worst}");
    }

    #[test]
    fn a_plane_along_the_lattice_cuts_off_what_lies_behind_it() {
        for d in [-0.6_f32, -0.5, -0.3, 0.0, 0.125, 0.49, 0.5, 0.8] {
            let exact = (0.5 - d).clamp(0.0, 1.0);
            assert!((behind_plane(d, [0.0, 0.0, 1.0]) - exact).abs() < 3e-4, "{d}");
        }
    }
}
