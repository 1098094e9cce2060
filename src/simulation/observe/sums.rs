//! Sums and maxima over all ranks that are the same to the bit in any order and on any number of ranks, so that a writer gets a number
//! of the whole box without gathering what it is made of.
//!
//! What one rank contributes is rounded to integers: in units that follow from the largest term of all ranks
//! ([`ReproducibleSum`]), or for [`add_fixed`](Sums::add_fixed) in units of 2^-42.

use crate::comm::Comm;
use crate::math::{
    FIXED_POINT_LIMIT, ReproducibleSum, from_fixed_wide, join_wide, magnitude, split_wide, to_fixed,
    to_fixed_wide,
};

/// Contribution of one rank to sums and maxima over all ranks, by index. Every rank has as many of them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sums {
    /// Index of a sum, and a number to add.
    terms: Vec<(usize, f64)>,
    /// Number of sums.
    count: usize,
    fixed: Vec<i128>,
    maxima: Vec<f64>,
}

impl Sums {
    /// Numbers of sums, of sums of [fixed-point numbers](Self::add_fixed), and of maxima (of numbers that are not negative).
    pub fn new(sums: usize, fixed: usize, maxima: usize) -> Self {
        Self { terms: Vec::new(), count: sums, fixed: vec![0; fixed], maxima: vec![0.0; maxima] }
    }

    /// Adds a value to each of the sums from index `first` on; 16 bytes each are kept until the sums are known. Sums of whole numbers
    /// below 2^53 are exact.
    pub fn add(&mut self, first: usize, values: &[f64]) {
        assert!(first + values.len() <= self.count);
        self.terms.extend((first..).zip(values.iter().copied()));
    }

    /// Adds a value below 2^20, rounded to a multiple of 2^-42, to the fixed-point sum `index`; nothing is kept. For values of all
    /// cells, which are of order one.
    pub fn add_fixed(&mut self, index: usize, value: f64) {
        // Rounding of small numbers takes no call.
        let small = value.abs() < FIXED_POINT_LIMIT;
        self.fixed[index] += i128::from(if small { to_fixed(value) } else { to_fixed_wide(value) });
    }

    /// Adds [fixed-point numbers](crate::math::to_fixed), or other whole numbers, to the fixed-point sums from index `first` on: of all ranks
    /// together below 2^102.
    pub(in crate::simulation) fn add_integers<N: Copy + Into<i128>>(&mut self, first: usize, values: &[N]) {
        for (sum, value) in self.fixed[first..].iter_mut().zip(values) {
            *sum += (*value).into();
        }
    }

    /// Raises the maximum `index` to this value, if it is larger.
    pub fn raise(&mut self, index: usize, value: f64) {
        self.maxima[index] = self.maxima[index].max(value);
    }

    /// The totals of each of the sums of all ranks, with one message of each kind for all together. Collective.
    pub(super) fn reduce(all: &[Self], comm: &Comm) -> Vec<Totals> {
        let mut largest = Vec::new();
        for sums in all {
            let first = largest.len();
            largest.resize(first + sums.count, 0.0);
            for &(index, x) in &sums.terms {
                largest[first + index] = f64::max(largest[first + index], magnitude(x));
            }
            largest.extend(&sums.maxima);
        }
        if !largest.is_empty() {
            comm.max(&mut largest);
        }
        let (mut words, mut known, mut units) = (Vec::new(), &largest[..], Vec::new());
        for sums in all {
            let mut own: Vec<_> = known[..sums.count].iter().map(|&x| ReproducibleSum::new(x)).collect();
            known = &known[sums.count + sums.maxima.len()..];
            for &(index, x) in &sums.terms {
                own[index].add(x);
            }
            words.extend(own.iter().map(ReproducibleSum::total).chain(sums.fixed.iter().copied()));
            units.push(own);
        }
        let mut words: Vec<i64> = words.into_iter().flat_map(split_wide).collect();
        if !words.is_empty() {
            comm.sum(&mut words);
        }
        let mut totals = words.chunks_exact(2).map(|pair| join_wide([pair[0], pair[1]]));
        let mut known = &largest[..];
        (all.iter().zip(units))
            .map(|(sums, units)| {
                let maxima = &known[sums.count..][..sums.maxima.len()];
                known = &known[sums.count + maxima.len()..];
                Totals {
                    sums: units.iter().zip(&mut totals).map(|(unit, total)| unit.value(total)).collect(),
                    fixed: totals.by_ref().take(sums.fixed.len()).map(from_fixed_wide).collect(),
                    maxima: maxima.to_vec(),
                }
            })
            .collect()
    }
}

/// [`Sums`] of all ranks.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Totals {
    /// The sums; NaN if a term was not finite.
    pub sums: Vec<f64>,
    /// The sums of fixed-point numbers.
    pub fixed: Vec<f64>,
    /// The maxima.
    pub maxima: Vec<f64>,
}

impl Totals {
    /// Those of one [`Sums`], on every rank. Collective.
    pub(in crate::simulation) fn of(sums: Sums, comm: &Comm) -> Self {
        Sums::reduce(&[sums], comm).swap_remove(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::on_threads;

    #[test]
    fn one_to_five_ranks_find_the_same_bits_whoever_has_which_term() {
        let terms: Vec<[f64; 2]> = (0..97_u32)
            .map(|i| {
                let x = f64::from(i) - 40.3;
                [1e-9 * x * x * x, 1e12 / x]
            })
            .collect();
        let reduced = |ranks: usize, turn: usize| {
            let mut all = on_threads(ranks, |comm| {
                let mine = (comm.rank() + turn) % ranks;
                let mut sums = [Sums::new(3, 0, 1), Sums::default(), Sums::new(1, 2, 2)];
                for term in terms.iter().skip(mine).step_by(ranks) {
                    sums[0].add(0, term);
                    sums[0].add(2, &[1.0]);
                    sums[0].raise(0, term[0]);
                    sums[2].add(0, &[-term[1]]);
                    sums[2].add_fixed(1, 0.1 * term[0]);
                    sums[2].raise(1, 2.0 * term[0]);
                }
                Sums::reduce(&sums, &comm)
            });
            let first = all.swap_remove(0);
            assert!(all.iter().all(|other| *other == first));
            first
        };
        let alone = reduced(1, 0);
        let [first, second] = [0, 1].map(|n| terms.iter().map(|term| term[n]).sum::<f64>());
        let near = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-6;
        assert!(near(alone[0].sums[0], first) && near(alone[0].sums[1], second));
        assert!(alone[0].sums[2..] == [97.0] && alone[2].fixed[..1] == [0.0]);
        assert!(near(alone[2].fixed[1], 0.1 * first));
        assert!(alone[0].maxima == [terms[96][0]] && alone[2].maxima == [0.0, 2.0 * terms[96][0]]);
        assert!(alone[1] == Totals::default() && alone[2].sums == [-alone[0].sums[1]]);
        for (ranks, turn) in [(2, 0), (2, 1), (3, 2), (5, 1)] {
            assert_eq!(reduced(ranks, turn), alone);
        }
    }

    #[test]
    fn a_sum_with_a_term_that_is_not_finite_is_nan_on_every_rank() {
        let sums = on_threads(3, |comm| {
            let mut sums = Sums::new(2, 0, 0);
            sums.add(0, &[if comm.rank() == 1 { f64::NAN } else { 1.0 }, 2.0]);
            Sums::reduce(&[sums], &comm)[0].sums.clone()
        });
        assert!(sums.iter().all(|sums| sums[0].is_nan() && (sums[1] - 6.0).abs() < 1e-15));
    }
}
