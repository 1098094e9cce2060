//! Pairs of spheres that are too close, by a cell list with nearest images.

use crate::domain::Domain;
use crate::math::Vec3;

/// All pairs `a < b` of wrapped positions nearer than `reaches[a] + reaches[b]` (m), ascending.
///
/// Distances are those of nearest images; reaches up to a quarter of the box are safe.
pub fn close_pairs(domain: &Domain, positions: &[Vec3], reaches: &[f64]) -> Vec<(usize, usize)> {
    assert_eq!(positions.len(), reaches.len());
    let size = domain.size();
    let widest = 2.0 * reaches.iter().copied().fold(0.0, f64::max);
    // No more bins than particles in all, else a large dilute box would be mostly empty bins.
    let most = 1 + libm::cbrt(positions.len() as f64) as usize;
    let bins: [usize; 3] = std::array::from_fn(|i| ((size[i] / widest) as usize).clamp(1, most));
    let bin_of = |p: &Vec3| -> [usize; 3] {
        std::array::from_fn(|i| ((p[i] / size[i] * bins[i] as f64) as usize).min(bins[i] - 1))
    };
    let index = |b: [usize; 3]| b[0] + bins[0] * (b[1] + bins[1] * b[2]);
    let mut members: Vec<Vec<usize>> = vec![Vec::new(); bins.iter().product()];
    for (i, p) in positions.iter().enumerate() {
        members[index(bin_of(p))].push(i);
    }
    // With fewer than three bins in a direction, neighbours on both sides are the same bin: visit it once.
    let steps = |n: usize| -> &'static [usize] {
        match n {
            1 => &[0],
            2 => &[0, 1],
            _ => &[0, 1, 2],
        }
    };
    let mut pairs = Vec::new();
    for (a, p) in positions.iter().enumerate() {
        let home = bin_of(p);
        let start = pairs.len();
        let step = |i: usize, d: usize| (home[i] + bins[i] + d - usize::from(bins[i] > 2)) % bins[i];
        for &dz in steps(bins[2]) {
            for &dy in steps(bins[1]) {
                for &dx in steps(bins[0]) {
                    for &b in &members[index([step(0, dx), step(1, dy), step(2, dz)])] {
                        let reach = reaches[a] + reaches[b];
                        if b > a && domain.nearest_image(positions[b] - p).norm_squared() < reach * reach {
                            pairs.push((a, b));
                        }
                    }
                }
            }
        }
        pairs[start..].sort_unstable();
    }
    pairs
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_cell_list_finds_the_pairs_that_brute_force_finds(
            cells in prop::array::uniform3(8_usize..60),
            points in prop::collection::vec((0.0..1.0, 0.0..1.0, 0.0..1.0, 0.05..1.0), 0..60),
        ) {
            let domain = Domain { periodic: [true; 3], cells, dx: 0.5 };
            let positions: Vec<Vec3> =
                points.iter().map(|&(x, y, z, _)| Vec3::new(x, y, z).component_mul(&domain.size())).collect();
            let reaches: Vec<f64> = points.iter().map(|p| p.3).collect();
            let mut expected = Vec::new();
            for a in 0..points.len() {
                for b in a + 1..points.len() {
                    let reach = reaches[a] + reaches[b];
                    if domain.nearest_image(positions[b] - positions[a]).norm_squared() < reach * reach {
                        expected.push((a, b));
                    }
                }
            }
            prop_assert_eq!(close_pairs(&domain, &positions, &reaches), expected);
        }
    }
}
