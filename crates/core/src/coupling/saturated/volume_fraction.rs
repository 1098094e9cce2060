//! Volume fraction of a cell that is inside a particle.
//!
//! Volume of a unit cube behind a plane with unit normal `n`, at the signed distance `d` of the cell's centre
//! (cells, negative inside):
//!
//! ```text
//! V(d, n) = [ q^3 - sum_a (q - m_a)+^3 + sum_a (q - s + m_a)+^3 - (q - s)+^3 ] / (6 m_1 m_2 m_3)
//! m_a = |n_a|,   s = m_1 + m_2 + m_3,   q = s/2 - d,   x+ = max(x, 0)
//! ```
//!
//! A curved surface counts as a plane moved in by `(k_1 + k_2) / 24` (principal curvatures, 1 / cells). Fractions
//! `v`, `w` behind two planes whose normals have the cosine `c` combine as `(1 - c) v w + c min(v, w)` for `c >= 0`
//! and `(1 + c) v w - c max(0, v + w - 1)` otherwise. Derivation: `docs/theory/coupling.md`.
//!
//! Reference: Scardovelli and Zaleski (2000), doi:10.1006/jcph.2000.6567.

/// Components of a normal below this count as this, which keeps the division good to eight digits.
pub(super) const LEAST: f64 = 1e-4;

/// Volume fraction of a cell behind a plane with normal `n`, the signed distance of its centre being `d` (cells).
#[inline(always)]
pub(super) fn behind_plane(d: f64, n: [f64; 3]) -> f64 {
    behind(d, [at_least(n[0], LEAST), at_least(n[1], LEAST), at_least(n[2], LEAST)])
}

/// The size of a component of a normal, at least so large.
#[inline(always)]
pub(super) fn at_least(x: f64, least: f64) -> f64 {
    let x = x.abs();
    if x > least { x } else { least }
}

/// The same from the sizes of the components; the normal may have any length if the distance is multiplied by it.
#[inline(always)]
pub(super) fn behind(d: f64, m: [f64; 3]) -> f64 {
    let s = (m[0] + m[1]) + m[2];
    // By symmetry the smaller part: fewer terms that cancel.
    let far = 0.5 * s - d.abs();
    let cube = |x: f64| {
        let x = if x > 0.0 { x } else { 0.0 };
        x * x * x
    };
    // Up to half of the cell, at most two of the pairs are passed, and never all three.
    let single = (cube(far - m[0]) + cube(far - m[1])) + cube(far - m[2]);
    let double = (cube(far - (m[0] + m[1])) + cube(far - (m[1] + m[2]))) + cube(far - (m[2] + m[0]));
    let part = ((cube(far) - single) + double) / (6.0 * (m[0] * m[1] * m[2]));
    let part = if part < 0.5 { part } else { 0.5 };
    if d > 0.0 { part } else { 1.0 - part }
}

/// Distance (cells) by which a surface with this sum of principal curvatures (1 / cells) is moved in.
#[inline(always)]
pub(super) fn curved(curvature: f64) -> f64 {
    curvature / 24.0
}

/// Volume fraction behind two planes whose normals have the cosine `c`.
#[inline(always)]
pub(super) fn behind_both(v: f64, w: f64, c: f64) -> f64 {
    let both = v * w;
    if c >= 0.0 { both + c * (v.min(w) - both) } else { both - c * ((v + w - 1.0).max(0.0) - both) }
}

#[cfg(test)]
mod tests {
    use super::*;

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
                let (exact, counted) = (behind_plane(d, n), counted(d, n));
                assert!((exact - counted).abs() < 0.01, "{n:?} {d}: {exact} {counted}");
                // Rounding, over the product of components at their least.
                assert!((exact + behind_plane(-d, n) - 1.0).abs() < 1e-7);
            }
        }
    }

    #[test]
    fn a_plane_along_the_lattice_cuts_off_what_lies_behind_it() {
        for d in [-0.6_f64, -0.5, -0.3, 0.0, 0.125, 0.49, 0.5, 0.8] {
            let exact = (0.5 - d).clamp(0.0, 1.0);
            assert!((behind_plane(d, [0.0, 0.0, 1.0]) - exact).abs() < 3e-4, "{d}");
        }
    }
}
