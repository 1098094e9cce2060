//! Pairs of centres within a distance, each once, through cells of a grid.

use crate::domain::Domain;
use crate::math::Vec3;

/// Calls `visit` with the indices of each pair of centres (wrapped, m) whose nearest images are at most `reach` (m) apart and of which the first or the
/// second is one of the first `own`; with the way from the first to the second, and its length. `reach` is at most half of any periodic edge.
///
/// Cells are at least as wide as that, so that partners are in the same or a neighbouring one.
pub(super) fn each_pair(
    domain: &Domain,
    centres: &[Vec3],
    own: usize,
    reach: f64,
    mut visit: impl FnMut([usize; 2], Vec3, f64),
) {
    let (size, images) = (domain.size(), domain.images_nearest());
    // Not more cells than centres.
    let width = reach.max(libm::cbrt(size.product() / (centres.len() + 1) as f64));
    let counts = [0, 1, 2].map(|axis| ((size[axis] / width) as usize).max(1));
    let place = |centre: &Vec3| -> [usize; 3] {
        [0, 1, 2].map(|axis| {
            // Positions beyond a closed face are in the cell at that face.
            ((centre[axis] / size[axis] * counts[axis] as f64).max(0.0) as usize).min(counts[axis] - 1)
        })
    };
    let number = |[x, y, z]: [usize; 3]| x + counts[0] * (y + counts[1] * z);
    let mut starts = vec![0_usize; counts.iter().product::<usize>() + 1];
    let cells: Vec<usize> = centres.iter().map(|centre| number(place(centre))).collect();
    for cell in &cells {
        starts[cell + 1] += 1;
    }
    for cell in 1..starts.len() {
        starts[cell] += starts[cell - 1];
    }
    let (mut next, mut sorted) = (starts.clone(), vec![(Vec3::zeros(), 0); centres.len()]);
    for (index, (cell, centre)) in cells.iter().zip(centres).enumerate() {
        sorted[next[*cell]] = (*centre, index);
        next[*cell] += 1;
    }
    let along = |axis: usize, at: usize| {
        let (count, periodic) = (counts[axis] as isize, domain.is_periodic(axis));
        let mut near: Vec<usize> = (-1..=1)
            .map(|by| at as isize + by)
            .filter(|at| periodic || (0..count).contains(at))
            .map(|at| at.rem_euclid(count) as usize)
            .collect();
        near.sort_unstable();
        // With less than three cells both sides are the same one.
        near.dedup();
        near
    };
    let square = reach * reach;
    for (z, y, x) in
        (0..counts[2]).flat_map(|z| (0..counts[1]).flat_map(move |y| (0..counts[0]).map(move |x| (z, y, x))))
    {
        let cell = number([x, y, z]);
        if starts[cell] == starts[cell + 1] {
            continue;
        }
        let [xs, ys, zs] = [along(0, x), along(1, y), along(2, z)];
        let near = zs.iter().flat_map(|z| ys.iter().map(move |y| [*y, *z]));
        for other in near.flat_map(|[y, z]| xs.iter().map(move |x| [*x, y, z])).map(number) {
            // Pairs of two cells are found from the lower one.
            if other < cell {
                continue;
            }
            for at in starts[cell]..starts[cell + 1] {
                let (from, i) = sorted[at];
                let first = if other == cell { at + 1 } else { starts[other] };
                for &(to, j) in &sorted[first..starts[other + 1]] {
                    let way = images.of(to - from);
                    let squared = way.norm_squared();
                    if squared <= square && (i < own || j < own) {
                        visit([i, j], way, squared.sqrt());
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};

    #[test]
    fn each_pair_is_found_once_in_boxes_of_few_and_of_many_cells() {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        for (reach, periodic) in
            [(0.6, [true; 3]), (1.4, [true, false, true]), (2.0, [true; 3]), (2.0, [false; 3])]
        {
            let domain = Domain { cells: [40, 50, 60], dx: 0.1, faces: Domain::faces(periodic) };
            let size = domain.size();
            let centres: Vec<Vec3> =
                (0..150).map(|_| Vec3::from_fn(|axis, _| random.random_range(0.0..size[axis]))).collect();
            let mut found = Vec::new();
            each_pair(&domain, &centres, 100, reach, |[i, j], way, distance| {
                assert!((way.norm() - distance).abs() < 1e-12);
                found.push([i.min(j), i.max(j)]);
            });
            found.sort_unstable();
            let near = |[i, j]: [usize; 2]| domain.nearest_image(centres[j] - centres[i]).norm() <= reach;
            let all = (0..100).flat_map(|i| (i + 1..150).map(move |j| [i, j])).filter(|pair| near(*pair));
            assert_eq!(found, all.collect::<Vec<_>>(), "{reach} {periodic:?}");
        }
    }
}
