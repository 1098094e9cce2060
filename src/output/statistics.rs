//! Mean and standard error of a correlated time series.
//!
//! Values that follow each other closely resemble each other, so the textbook error `s / sqrt(n)` is far too small. Blocking replaces
//! neighbours by their mean, again and again; the textbook error of the block means grows with the block length `b` until that is
//! longer than the correlation time, then it is right. We take the first level with
//!
//! ```text
//! b^3 > 2 n (e_b / e_1)^4
//! ```
//!
//! which balances the rest of the correlation against the scatter, `e_b` being the error at block length `b`, and at least
//! [`MIN_BLOCKS`] blocks. If no level satisfies it the series is short for its correlation time `tau`; then the error is
//!
//! ```text
//! e = s sqrt(2 tau / n),   tau = 1/2 + sum_{k=1}^{m} rho_k,   m = 5 tau
//! ```
//!
//! unless the largest of the levels is larger still.
//!
//! # Reference
//! Flyvbjerg and Petersen (1989), doi:10.1063/1.457480, for blocking; Lee et al. (2011),
//! doi:10.1103/PhysRevE.83.066706, for the choice of the level; Sokal (1997), doi:10.1007/978-1-4899-0319-8_6, for the
//! window `m`.

mod transient;

pub use transient::{Settled, settled};

use serde::{Deserialize, Serialize};

/// Fewest blocks from which an error is taken: its own relative error is then about 18 %.
pub const MIN_BLOCKS: usize = 16;

/// A mean and its standard error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// Mean of all values.
    pub mean: f64,
    /// Standard error of the mean; `None` for fewer than [`MIN_BLOCKS`] values.
    pub standard_error: Option<f64>,
}

/// Mean and standard error of equally spaced values of one quantity; `None` if there are no values.
pub fn estimate_mean(series: &[f64]) -> Option<Estimate> {
    if series.is_empty() {
        return None;
    }
    let mean = series.iter().sum::<f64>() / series.len() as f64;
    Some(Estimate { mean, standard_error: blocking_error(series) })
}

/// Ratio of the means of two quantities that are measured at the same times, with the error `e = e(a - r b) / |<b>|` to first order; `None` if
/// there are no values.
pub fn estimate_ratio(of: &[f64], to: &[f64]) -> Option<Estimate> {
    let (over, under) = (estimate_mean(of)?.mean, estimate_mean(to)?.mean);
    let ratio = over / under;
    let rest: Vec<f64> = of.iter().zip(to).map(|(a, b)| a - ratio * b).collect();
    let error = estimate_mean(&rest)?.standard_error;
    Some(Estimate { mean: ratio, standard_error: error.map(|error| error / under.abs()) })
}

fn blocking_error(series: &[f64]) -> Option<f64> {
    let count = series.len() as f64;
    let (mut blocks, mut length) = (series.to_vec(), 1.0_f64);
    let mut largest: Option<f64> = None;
    let mut unblocked = None;
    while blocks.len() >= MIN_BLOCKS {
        let error = independent_error(&blocks);
        let first = *unblocked.get_or_insert(error);
        if error <= 0.0 || length.powi(3) > 2.0 * count * (error / first).powi(4) {
            return Some(error);
        }
        largest = Some(largest.map_or(error, |e| e.max(error)));
        // An odd one out is dropped at the early end, which is the more likely to be transient.
        blocks = blocks.rchunks_exact(2).rev().map(|pair| 0.5 * (pair[0] + pair[1])).collect();
        length *= 2.0;
    }
    largest.map(|largest| largest.max(correlation_error(series)))
}

/// `s sqrt(2 tau / n)` with the self-consistent window.
fn correlation_error(series: &[f64]) -> f64 {
    let n = series.len();
    let mean = series.iter().sum::<f64>() / n as f64;
    let covariance = |lag: usize| -> f64 {
        let pairs = series.iter().zip(&series[lag..]);
        pairs.map(|(a, b)| (a - mean) * (b - mean)).sum::<f64>() / (n - lag) as f64
    };
    let variance = covariance(0);
    if variance <= 0.0 {
        return 0.0;
    }
    let mut tau = 0.5;
    for lag in 1..n / 2 {
        tau += covariance(lag) / variance;
        if lag as f64 >= 5.0 * tau {
            break;
        }
    }
    (variance * 2.0 * tau.max(0.5) / n as f64).sqrt()
}

/// `sqrt(sum (x - mean)^2 / (n (n - 1)))`
fn independent_error(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|x| (x - mean).powi(2)).sum();
    (squares / (n * (n - 1.0))).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngCore, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// `x[k+1] = memory x[k] + noise`, noise uniform with unit variance, started in its stationary state.
    pub(super) fn auto_regressive(memory: f64, count: usize, seed: u64) -> Vec<f64> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut noise = || 12.0_f64.sqrt() * (random.next_u64() as f64 / u64::MAX as f64 - 0.5);
        let mut x = noise() / (1.0 - memory * memory).sqrt();
        (0..count)
            .map(|_| {
                x = memory * x + noise();
                x
            })
            .collect()
    }

    /// Standard error of the mean of `count` values in the limit of long series: `1 / ((1 - memory) sqrt(count))`.
    fn known_error(memory: f64, count: usize) -> f64 {
        1.0 / ((1.0 - memory) * (count as f64).sqrt())
    }

    /// Root mean square of the errors estimated from, and of the means of, many independent series.
    fn over_many(memory: f64, count: usize) -> (f64, f64) {
        let series = 200;
        let (mut errors, mut means) = (0.0, 0.0);
        for seed in 0..series {
            let estimate = estimate_mean(&auto_regressive(memory, count, seed)).unwrap();
            errors += estimate.standard_error.unwrap().powi(2);
            means += estimate.mean.powi(2);
        }
        ((errors / series as f64).sqrt(), (means / series as f64).sqrt())
    }

    #[test]
    fn white_noise_has_the_textbook_error() {
        let count = 4096;
        let (claimed, scatter) = over_many(0.0, count);
        assert!((claimed / known_error(0.0, count) - 1.0).abs() < 0.04, "{claimed}");
        assert!((claimed / scatter - 1.0).abs() < 0.15, "{claimed} {scatter}");
    }

    #[test]
    fn the_error_of_a_correlated_series_is_that_of_its_mean_over_many_series() {
        for (memory, count) in [(0.5, 2048), (0.9, 8192), (0.97, 16384)] {
            let (claimed, scatter) = over_many(memory, count);
            let known = known_error(memory, count);
            assert!((claimed / known - 1.0).abs() < 0.08, "{memory}: {claimed} {known}");
            assert!((claimed / scatter - 1.0).abs() < 0.15, "{memory}: {claimed} {scatter}");
        }
    }

    #[test]
    fn a_series_shorter_than_its_correlation_still_gets_more_than_the_textbook_error() {
        let series = auto_regressive(0.98, 200, 5);
        let error = estimate_mean(&series).unwrap().standard_error.unwrap();
        assert!(error > 2.0 * independent_error(&series));
    }

    #[test]
    fn the_error_of_a_ratio_is_that_of_what_the_two_do_not_have_in_common() {
        let common = auto_regressive(0.9, 4096, 1);
        let noise = auto_regressive(0.0, 4096, 2);
        let to: Vec<f64> = common.iter().map(|x| 10.0 + 0.1 * x).collect();
        let of: Vec<f64> = to.iter().zip(&noise).map(|(to, noise)| 3.0 * to + 0.2 * noise).collect();
        let ratio = estimate_ratio(&of, &to).unwrap();
        let known = 0.2 / 64.0 / 10.0;
        assert!((ratio.mean - 3.0).abs() < 3.0 * known, "{ratio:?}");
        assert!((ratio.standard_error.unwrap() / known - 1.0).abs() < 0.1, "{ratio:?} {known}");
        assert_eq!(estimate_ratio(&[], &[]), None);
    }

    #[test]
    fn a_constant_has_no_error_and_few_values_have_an_unknown_one() {
        let constant = estimate_mean(&[2.5; 100]).unwrap();
        assert_eq!((constant.mean, constant.standard_error), (2.5, Some(0.0)));
        assert_eq!(estimate_mean(&[1.0, 3.0]).unwrap().standard_error, None);
        assert_eq!(estimate_mean(&[]), None);
    }
}
