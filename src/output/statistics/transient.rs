//! End of the transient of a correlated time series that becomes steady.
//!
//! The marginal standard error rule: of the means `z_1 .. z_m` of blocks of five values it cuts the first `d` for which
//!
//! ```text
//! MSER(d) = (S^2(d) + f^2) / (m - d),   S^2(d) = 1/(m - d) sum_{j>d} (z_j - mean_{j>d} z)^2
//! ```
//!
//! is least, the squared error that the mean of the rest would have if the blocks were independent. `f` is ours: deviations below
//! [`SLIGHT`] of the mean count as none, or a series without noise would be cut for ever.
//!
//! The published rule refuses a series whose least value lies in its second half: stationary ones as long as 60, 24 and 12 correlation
//! times in 5 %, 15 % and 36 % of cases, and only one of ten that drift by two and a half standard deviations of the noise. We look for
//! the least value in the first half, and refuse
//!
//! - if the second half has one that is [`BETTER`] times better, or
//! - if the rest still drifts: if the change along the straight line through it is more than [`DRIFT`] of its mean and more than
//!   [`SIGMAS`] times the error of that change, `sqrt(12)` times the error of the mean of what the line leaves.
//!
//! This refuses 2 %, 5 % and 12 % of the stationary series and six of ten drifting ones. No rule can see a change slower than the series.
//!
//! # Reference
//! White (1997), doi:10.1177/003754979706900601, for the rule; White, Cobb and Spratt (2000), Proceedings of the Winter
//! Simulation Conference, 755-760, for blocks of five.

use super::{Estimate, estimate_mean, standard_error};

/// Values in a block.
const BLOCK: usize = 5;
/// Fewest blocks of a series.
const MIN_SERIES: usize = 16;
/// Blocks at the end behind which nothing is cut: their scatter is chance.
const MIN_REST: usize = 5;
/// Deviations that count as none, over the mean.
const SLIGHT: f64 = 0.002;
/// Factor by which the second half must be better to refuse the first.
const BETTER: f64 = 3.0;
/// Change over the rest that is not called a drift, over the mean.
const DRIFT: f64 = 0.01;
/// Errors of that change within which it is chance.
const SIGMAS: f64 = 3.0;

/// Rest of a series after its transient.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settled {
    /// Index of the first value after the transient.
    pub first: usize,
    /// Mean of the values from there, and its standard error.
    pub estimate: Estimate,
}

/// Rest of equally spaced values of one quantity after the transient; `None` if that has not ended within the first half, for fewer
/// than 80 values, or if one is not finite.
pub fn settled(series: &[f64]) -> Option<Settled> {
    if series.len() < BLOCK * MIN_SERIES || series.iter().any(|value| !value.is_finite()) {
        return None;
    }
    // The odd ones are left out at the early end, which is the more likely to be transient.
    let odd = series.len() % BLOCK;
    let blocks: Vec<f64> =
        (series[odd..].chunks_exact(BLOCK)).map(|block| block.iter().sum::<f64>() / BLOCK as f64).collect();
    let errors = marginal_errors(&blocks);
    let least = |range: std::ops::Range<usize>| range.min_by(|&a, &b| errors[a].total_cmp(&errors[b]));
    let half = blocks.len() / 2;
    let cut = least(0..half + 1)?;
    let later = least(half + 1..blocks.len() - MIN_REST)?;
    if errors[cut] > BETTER * errors[later] {
        return None;
    }
    let first = if cut == 0 { 0 } else { odd + BLOCK * cut };
    let rest = &series[first..];
    let estimate = estimate_mean(rest)?;
    (!drifts(rest, estimate.mean)).then_some(Settled { first, estimate })
}

/// `MSER(d)` for every `d` from zero to the number of blocks, less one.
fn marginal_errors(blocks: &[f64]) -> Vec<f64> {
    // Deviations from the mean of the later half, so that differences of squares keep their digits.
    let late = &blocks[blocks.len() / 2..];
    let middle = late.iter().sum::<f64>() / late.len() as f64;
    let floor = (SLIGHT * middle).powi(2);
    let (mut sum, mut squares) = (0.0, 0.0);
    let mut errors: Vec<f64> = (1..=blocks.len())
        .zip(blocks.iter().rev())
        .map(|(count, block)| {
            let count = count as f64;
            sum += block - middle;
            squares += (block - middle).powi(2);
            let variance = (squares - sum * sum / count).max(0.0) / count;
            (variance + floor) / count
        })
        .collect();
    errors.reverse();
    errors
}

/// Returns true if a straight line through the values rises or falls by more than is slight and more than is chance.
fn drifts(series: &[f64], mean: f64) -> bool {
    let n = series.len() as f64;
    let middle = 0.5 * (n - 1.0);
    let moment: f64 = (series.iter().enumerate()).map(|(i, x)| (i as f64 - middle) * (x - mean)).sum();
    let slope = 12.0 * moment / (n * (n * n - 1.0));
    let change = (slope * n).abs();
    if change <= DRIFT * mean.abs() {
        return false;
    }
    let left: Vec<f64> =
        (series.iter().enumerate()).map(|(i, x)| x - mean - slope * (i as f64 - middle)).collect();
    standard_error(&left, 0.0).is_none_or(|error| change > SIGMAS * 12.0_f64.sqrt() * error)
}

#[cfg(test)]
mod tests {
    use super::super::tests::auto_regressive;
    use super::*;

    const COUNT: usize = 1200;

    /// `shape` and noise of a standard deviation of 0.04 that forgets within `correlation` values.
    fn noisy(correlation: f64, seed: u64, shape: impl Fn(f64) -> f64) -> Vec<f64> {
        let memory = (-1.0 / correlation).exp();
        let size = 0.04 * (1.0 - memory * memory).sqrt();
        (auto_regressive(memory, COUNT, seed).iter().enumerate())
            .map(|(i, noise)| shape(i as f64) + size * noise)
            .collect()
    }

    /// Results of 100 series, the first values sorted, the means beside them.
    fn found(correlation: f64, shape: impl Fn(f64) -> f64) -> Vec<(usize, f64)> {
        let mut found: Vec<(usize, f64)> = (0..100)
            .filter_map(|seed| settled(&noisy(correlation, seed, &shape)))
            .map(|settled| (settled.first, settled.estimate.mean))
            .collect();
        found.sort_by_key(|(first, _)| *first);
        found
    }

    #[test]
    fn an_exponential_approach_ends_when_it_is_lost_in_the_noise() {
        for (time, correlation) in [(20.0, 5.0), (60.0, 5.0), (60.0, 20.0)] {
            let found = found(correlation, |t| 1.0 - (-t / time).exp());
            // It has fallen to the standard deviation of the noise, 0.04, after 3.2 times its time.
            let expected = 3.2 * time;
            let median = found[found.len() / 2].0 as f64;
            assert!(found.len() >= 90, "{time}: {} of 100", found.len());
            assert!(
                (0.7..1.5).contains(&(median / expected)),
                "{time}, {correlation}: {median} instead of {expected}"
            );
            let mean = found.iter().map(|(_, mean)| mean).sum::<f64>() / found.len() as f64;
            assert!((mean - 1.0).abs() < 0.004, "{time}, {correlation}: {mean}");
        }
    }

    #[test]
    fn of_a_stationary_series_nothing_is_cut() {
        for (correlation, at_least) in [(1.0, 95), (5.0, 92), (20.0, 88), (50.0, 80)] {
            let found = found(correlation, |_| 1.0);
            assert!(found.len() >= at_least, "{correlation}: {}", found.len());
            assert!(found[found.len() / 2].0 < COUNT / 20, "{correlation}");
        }
    }

    #[test]
    fn a_series_that_continues_rising_has_no_end_of_its_transient() {
        let drift = found(20.0, |t| 1.0 + 0.3 * t / COUNT as f64);
        assert!(drift.len() <= 10, "{} of 100", drift.len());
        let slow = found(20.0, |t| 1.0 - (-t / 600.0).exp());
        assert!(slow.len() <= 4, "{} of 100", slow.len());
    }

    #[test]
    fn without_noise_the_end_is_where_the_rest_is_slight() {
        let series: Vec<f64> = (0..COUNT).map(|i| 1.0 - (-(i as f64) / 60.0).exp()).collect();
        let settled = settled(&series).unwrap();
        let left = (-(settled.first as f64) / 60.0).exp();
        assert!(left > 0.1 * SLIGHT && left < 10.0 * SLIGHT, "{left}");
        assert!((settled.estimate.mean - 1.0).abs() < SLIGHT);
    }

    #[test]
    fn neither_scale_nor_sign_matters() {
        let series = noisy(5.0, 3, |t| 1.0 - (-t / 40.0).exp());
        let reference = settled(&series).unwrap().first;
        for factor in [-1.0, 1e-6, -1e9] {
            let scaled: Vec<f64> = series.iter().map(|x| factor * x).collect();
            assert_eq!(settled(&scaled).unwrap().first, reference, "{factor}");
        }
    }

    #[test]
    fn few_values_broken_ones_and_constants_are_dealt_with() {
        assert_eq!(settled(&[]), None);
        assert_eq!(settled(&[1.0; 79]), None);
        let mut series = vec![1.0; 200];
        let constant = settled(&series).unwrap();
        assert_eq!((constant.first, constant.estimate.mean), (0, 1.0));
        assert_eq!(settled(&[0.0; 100]).unwrap().first, 0);
        series[150] = f64::NAN;
        assert_eq!(settled(&series), None);
    }
}
