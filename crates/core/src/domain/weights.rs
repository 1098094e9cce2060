//! Work per layer of cells, and the cuts that balance it.
//!
//! Work is represented by its sums over the layers of cells along each axis. The fraction of the work in a block is
//! taken to be the product of the fractions of its three slabs, which is exact where the work varies along one axis
//! only (a bed on a floor):
//!
//! ```text
//! work(p, q, r) = total X_p Y_q Z_r,      X_p = work of the layers of slab p / total,   Y, Z likewise
//! ```

use super::Domain;

/// Smallest number of cells of a block in any direction.
pub(super) const MIN_BLOCK: usize = 4;

/// Equal slabs stay as they are if other cuts lower the work of the heaviest by less than this factor, or by less
/// than chance brings.
const WORTH: f64 = 1.02;

/// Cost of a cell of a face across x, y and z relative to the contiguous z: x faces touch one line of memory per
/// number. The faces across y cost a hair more than those across z, so that equal grids have one order.
pub(super) const FACES: [f64; 3] = [1.5, 1.01, 1.0];

/// Work of a time step by position, in any unit.
#[derive(Clone, Debug, PartialEq)]
pub struct Weights {
    /// Work of each layer of cells along each axis; all three have the same sum.
    ///
    /// # Shape
    /// `layers[axis].len() == domain.cells[axis]`
    pub layers: [Vec<f64>; 3],
    /// Work that a cell of a face between two ranks makes for each of them.
    pub face: f64,
    /// Sum of the squares of the work of everything whose position is random: particles, contacts. The work of one
    /// of `n` slabs varies by the root of a part `n` of it.
    pub variance: f64,
    /// Cells of a row that are worked on at once: shorter ends of rows cost as much.
    pub chunk: usize,
}

impl Weights {
    /// The same work in every cell, `cell` in all of each.
    pub fn even(domain: &Domain, cell: f64) -> Self {
        Self {
            layers: std::array::from_fn(|axis| {
                let layer = cell * domain.cell_count() as f64 / domain.cells[axis] as f64;
                vec![layer; domain.cells[axis]]
            }),
            face: 0.0,
            variance: 0.0,
            chunk: 1,
        }
    }

    /// Work of the whole box.
    pub fn total(&self) -> f64 {
        self.layers[0].iter().sum()
    }

    /// Fraction of the work (with the ends of rows) that the heaviest slab between cuts of an axis has, by running sums of its layers.
    fn heaviest(&self, axis: usize, sums: &[f64], cuts: &[usize]) -> f64 {
        let chunk = if axis == 0 { self.chunk } else { 1 };
        let share = |w: &[usize]| {
            let width = w[1] - w[0];
            (sums[w[1]] - sums[w[0]]) * (width.next_multiple_of(chunk) as f64 / width as f64)
        };
        cuts.windows(2).map(share).fold(0.0, f64::max) / sums[sums.len() - 1]
    }

    /// Work of the heaviest block between these cuts, without its faces.
    pub(super) fn heaviest_block(&self, cuts: &[Vec<usize>; 3]) -> f64 {
        let total = self.total();
        if total <= 0.0 {
            return 0.0;
        }
        let share = |axis: usize| self.heaviest(axis, &running_sums(&self.layers[axis]), &cuts[axis]);
        (0..3).map(share).product::<f64>() * total
    }

    /// Cuts of an axis into this many slabs, and the fraction of the work (with the ends of rows) that the heaviest
    /// has.
    pub(super) fn cut(&self, axis: usize, parts: usize) -> (Vec<usize>, f64) {
        let layers = &self.layers[axis];
        let sums = running_sums(layers);
        let equal = equal_cuts(layers.len(), parts);
        let total = sums[layers.len()];
        if parts == 1 || total <= 0.0 || !total.is_finite() {
            return (equal, 1.0 / parts as f64);
        }
        let shifted = even_out(&sums, parts);
        let heaviest = |sums: &[f64], cuts: &[usize]| self.heaviest(axis, sums, cuts);
        let (of_equal, of_shifted) = (heaviest(&sums, &equal), heaviest(&sums, &shifted));
        // Twice the standard deviation relative to the mean of a slab: the heaviest of several is that far off.
        let noise = 2.0 * (parts as f64 * self.variance).sqrt() / total;
        if of_equal <= (WORTH + noise) * of_shifted {
            let even: Vec<f64> = (0..=layers.len()).map(|n| n as f64).collect();
            let of_even = heaviest(&even, &equal);
            (equal, of_even)
        } else {
            (shifted, of_shifted)
        }
    }
}

/// Cuts into slabs of (nearly) equal width; the first is 0, the last `cells`.
pub(super) fn equal_cuts(cells: usize, parts: usize) -> Vec<usize> {
    (0..=parts).map(|p| cells * p / parts).collect()
}

/// `sums[k]` is the sum of the first `k` layers.
fn running_sums(layers: &[f64]) -> Vec<f64> {
    let mut sum = 0.0;
    std::iter::once(0.0)
        .chain(layers.iter().map(|layer| {
            sum += layer;
            sum
        }))
        .collect()
}

/// Cuts where the running sum comes nearest to equal parts, at least [`MIN_BLOCK`] layers apart; each then moved as
/// long as this makes the heavier of the two slabs beside it lighter.
fn even_out(sums: &[f64], parts: usize) -> Vec<usize> {
    let cells = sums.len() - 1;
    let mut cuts: Vec<usize> = (0..=parts)
        .map(|p| {
            let wanted = sums[cells] * p as f64 / parts as f64;
            let above = sums.partition_point(|&sum| sum < wanted).min(cells);
            let nearest =
                if above > 0 && wanted - sums[above - 1] <= sums[above] - wanted { above - 1 } else { above };
            nearest.clamp(MIN_BLOCK * p, cells - MIN_BLOCK * (parts - p))
        })
        .collect();
    cuts[0] = 0;
    for p in 1..parts {
        cuts[p] = cuts[p].max(cuts[p - 1] + MIN_BLOCK);
    }
    cuts[parts] = cells;
    // Every move lowers the sum of the squares of the work, so there is an end; the bound is for rounding.
    for _ in 0..parts * cells {
        let mut moved = false;
        for p in 1..parts {
            let (lo, at, hi) = (cuts[p - 1], cuts[p], cuts[p + 1]);
            let heavier = |at: usize| (sums[at] - sums[lo]).max(sums[hi] - sums[at]);
            let better = [at - 1, at + 1].into_iter().find(|&to| {
                to >= lo + MIN_BLOCK && to + MIN_BLOCK <= hi && heavier(to) < heavier(at) * (1.0 - 1e-12)
            });
            if let Some(to) = better {
                (cuts[p], moved) = (to, true);
            }
        }
        if !moved {
            break;
        }
    }
    cuts
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The least possible work of the heaviest slab, by trying all cuts.
    fn least(layers: &[f64], parts: usize) -> f64 {
        let sum = |layers: &[f64]| layers.iter().sum::<f64>();
        if parts == 1 {
            return sum(layers);
        }
        (MIN_BLOCK..=layers.len() - MIN_BLOCK * (parts - 1))
            .map(|at| sum(&layers[..at]).max(least(&layers[at..], parts - 1)))
            .fold(f64::INFINITY, f64::min)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(300))]
        #[test]
        fn slabs_are_wide_enough_and_the_heaviest_is_at_most_one_layer_above_the_best(
            layers in prop::collection::vec(0.0..1.0_f64, 16..30),
            bump in 1.0..30.0_f64,
            parts in 1..5_usize,
        ) {
            let mut layers = layers;
            let end = layers.len() / 4;
            layers[..end].iter_mut().for_each(|layer| *layer *= bump);
            let sums = running_sums(&layers);
            let cuts = even_out(&sums, parts);
            prop_assert_eq!((cuts[0], cuts[parts], cuts.len()), (0, layers.len(), parts + 1));
            prop_assert!(cuts.windows(2).all(|w| w[1] >= w[0] + MIN_BLOCK), "{:?}", cuts);
            let heaviest = cuts.windows(2).map(|w| sums[w[1]] - sums[w[0]]).fold(0.0, f64::max);
            let layer = layers.iter().copied().fold(0.0, f64::max);
            let best = least(&layers, parts);
            prop_assert!(heaviest <= best + layer * (1.0 + 1e-9), "{} > {} + {}", heaviest, best, layer);
        }
    }

    #[test]
    fn even_work_and_no_work_at_all_are_cut_into_equal_slabs() {
        let domain = Domain { faces: Domain::faces([true; 3]), cells: [41, 34, 47], dx: 1.0 };
        for cell in [0.0, 1.0] {
            let weights = Weights::even(&domain, cell);
            for (axis, cells) in domain.cells.into_iter().enumerate() {
                for parts in 1..=cells / MIN_BLOCK {
                    assert_eq!(weights.cut(axis, parts).0, equal_cuts(cells, parts));
                }
            }
        }
    }

    #[test]
    fn slabs_that_differ_by_chance_stay_equal_and_a_heap_does_not() {
        let domain = Domain { faces: Domain::faces([true; 3]), cells: [40; 3], dx: 1.0 };
        let mut weights = Weights::even(&domain, 1.0 / 1600.0);
        // Eight bodies of the work of two layers, five in one half and three in the other.
        weights.variance = 8.0 * 4.0;
        for layer in [2, 3, 9, 13, 17, 22, 30, 35] {
            weights.layers[2][layer] += 2.0;
        }
        assert_eq!(weights.cut(2, 2).0, [0, 20, 40]);
        for layer in &mut weights.layers[2][..10] {
            *layer += 4.0;
        }
        assert!(weights.cut(2, 2).0[1] < 15);
    }
}
