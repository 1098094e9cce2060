//! Extrapolation to fine grids, and the confidence in its order.
//!
//! ```text
//! u(N) = u_0 + c N^-p
//! ```
//!
//! is fitted to values at `N` cells per diameter by least squares, each weighted with the inverse square of its standard
//! error (equally, if one of them is unknown): for a given order `p` the problem is linear, and the best `p` in [`ORDERS`] is
//! found by a scan and golden sections. A best `p` at an end of this range is not resolved, and there is no extrapolation.
//! Confidence: percentiles of fits to values drawn from normal distributions of these errors around the measured ones, always
//! the same ones.
//!
//! The order against the finest grid is the slope of `ln |u(N) - u(N_max)|` over `ln N`, as usual in the literature. It is too
//! large: a method of order 1 has 2.3 on 5 to 18 cells.
//!
//! # Reference
//! L. F. Richardson, Phil. Trans. R. Soc. A 210 (1911) 307-357, doi:10.1098/rsta.1911.0009.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use turbid_plot::Point;

const ORDERS: [f64; 2] = [0.5, 4.0];
/// An order nearer than this to an end of the range is at it.
const NEAR: f64 = 1e-3;
/// Steps of the scan over the orders.
const STEPS: u32 = 35;
/// Repetitions of the fit with drawn values.
const DRAWS: usize = 2000;
/// Fewest grids of a fit: it has three numbers.
const LEAST: usize = 3;

/// `u_0 + c N^-p`
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Fit {
    pub(super) limit: f64,
    coefficient: f64,
    pub(super) order: f64,
    /// Sum of the squared deviations over the squared errors.
    squares: f64,
}

impl Fit {
    pub(super) fn at(&self, cells: f64) -> f64 {
        self.limit + self.coefficient * cells.powf(-self.order)
    }
}

fn is_bound(order: f64) -> bool {
    ORDERS.iter().any(|bound| (order - bound).abs() < NEAR)
}

/// An order in words; one at an end of the range may lie beyond.
pub(super) fn words(order: f64) -> String {
    let [least, most] = ORDERS;
    match order {
        p if p - least < NEAR => format!("below {least}"),
        p if most - p < NEAR => format!("above {most}"),
        p => format!("{p:.2}"),
    }
}

/// An interval of orders in words.
pub(super) fn interval_words([low, high]: [f64; 2]) -> String {
    match (is_bound(low), is_bound(high)) {
        (true, true) => "not resolved".to_string(),
        (true, false) => format!("below {high:.2}"),
        (false, true) => format!("above {low:.2}"),
        (false, false) => format!("{low:.2} to {high:.2}"),
    }
}

/// Values over the resolution, with their extrapolation.
#[derive(Clone, Debug)]
pub(super) struct Convergence {
    /// The values over the cells per diameter, from coarse to fine.
    pub(super) samples: Vec<Point>,
    pub(super) fit: Fit,
    /// Intervals that hold the order with 68 % and with 95 %, if the errors are known.
    pub(super) order_within: Option<[[f64; 2]; 2]>,
    /// Interval that holds the extrapolated value with 68 %.
    pub(super) limit_within: Option<[f64; 2]>,
    /// Order against the finest grid, if all errors against it are above zero.
    pub(super) against_finest: Option<f64>,
    /// Extrapolated values if the order is 1 and if it is 2.
    pub(super) limit_of_order: [f64; 2],
}

impl Convergence {
    /// Fits values over the cells per diameter; none for fewer grids than [`LEAST`].
    pub(super) fn of(samples: &[Point]) -> Option<Self> {
        let mut samples = samples.to_vec();
        samples.sort_by(|a, b| a.x.total_cmp(&b.x));
        let fit = best(&samples)?;
        let (mut orders, mut limits) = (Vec::new(), Vec::new());
        if samples.iter().all(|sample| sample.error.is_some()) {
            let mut random = ChaCha8Rng::seed_from_u64(1);
            for _ in 0..DRAWS {
                let drawn: Vec<Point> = samples.iter().map(|sample| drawn(sample, &mut random)).collect();
                let fit = best(&drawn)?;
                orders.push(fit.order);
                limits.push(fit.limit);
            }
        }
        let narrow = within(&mut orders, 0.68);
        let is_resolved = narrow.is_some_and(|ends| !ends.map(is_bound).contains(&true));
        Some(Self {
            order_within: narrow.zip(within(&mut orders, 0.95)).map(|(narrow, wide)| [narrow, wide]),
            limit_within: within(&mut limits, 0.68).filter(|_| is_resolved),
            against_finest: against_finest(&samples),
            limit_of_order: [1.0, 2.0].map(|order| linear(&samples, order).limit),
            fit,
            samples,
        })
    }

    /// The value on an infinitely fine grid, if the order is resolved.
    pub(super) fn limit(&self) -> Option<f64> {
        (!is_bound(self.fit.order)).then_some(self.fit.limit)
    }

    pub(super) fn error(&self, value: f64) -> Option<f64> {
        self.limit().map(|limit| (value - limit) / limit)
    }
}

/// Another value from the normal distribution of this one (Box and Muller 1958).
fn drawn(sample: &Point, random: &mut ChaCha8Rng) -> Point {
    let (a, b): (f64, f64) = (random.random(), random.random());
    let normal = (-2.0 * (1.0 - a).ln()).sqrt() * (std::f64::consts::TAU * b).cos();
    Point { y: sample.y + normal * sample.error.unwrap_or(0.0), ..*sample }
}

/// The interval with this part of the values that leaves out equally many below and above.
fn within(values: &mut [f64], part: f64) -> Option<[f64; 2]> {
    values.sort_unstable_by(f64::total_cmp);
    let last = values.len().checked_sub(1)? as f64;
    Some([0.5 - 0.5 * part, 0.5 + 0.5 * part].map(|at| values[(at * last).round() as usize]))
}

/// The inverse squares of the errors, relative to the largest; equal ones if one is unknown.
fn weights(samples: &[Point]) -> Vec<f64> {
    let errors = samples.iter().map(|sample| sample.error.filter(|error| *error > 0.0));
    let Some(errors) = errors.collect::<Option<Vec<f64>>>() else {
        return vec![1.0; samples.len()];
    };
    let least = errors.iter().copied().fold(f64::INFINITY, f64::min);
    errors.iter().map(|error| (least / error).powi(2)).collect()
}

/// The best limit and coefficient for a given order.
fn linear(samples: &[Point], order: f64) -> Fit {
    let weights = weights(samples);
    let mut sums = [0.0; 5];
    for (sample, &w) in samples.iter().zip(&weights) {
        let (x, y) = (sample.x.powf(-order), sample.y);
        for (sum, term) in sums.iter_mut().zip([w, w * x, w * y, w * x * x, w * x * y]) {
            *sum += term;
        }
    }
    let [w, x, y, xx, xy] = sums;
    let coefficient = (w * xy - x * y) / (w * xx - x * x);
    let mut fit = Fit { limit: (y - coefficient * x) / w, coefficient, order, squares: 0.0 };
    let squares = samples.iter().zip(&weights);
    fit.squares = squares.map(|(sample, weight)| weight * (sample.y - fit.at(sample.x)).powi(2)).sum();
    fit
}

fn best(samples: &[Point]) -> Option<Fit> {
    let mut grids: Vec<f64> = samples.iter().map(|sample| sample.x).collect();
    grids.dedup();
    if grids.len() < LEAST {
        return None;
    }
    let [least, most] = ORDERS;
    let step = (most - least) / f64::from(STEPS);
    let scan = (0..=STEPS).map(|k| linear(samples, least + f64::from(k) * step));
    let coarse = scan.min_by(|a, b| a.squares.total_cmp(&b.squares))?;
    let golden = 0.5 * (5_f64.sqrt() - 1.0);
    let [mut low, mut high] = [(coarse.order - step).max(least), (coarse.order + step).min(most)];
    for _ in 0..40 {
        let inner =
            [high - golden * (high - low), low + golden * (high - low)].map(|order| linear(samples, order));
        if inner[0].squares < inner[1].squares {
            high = inner[1].order;
        } else {
            low = inner[0].order;
        }
    }
    Some(linear(samples, 0.5 * (low + high)))
}

/// Minus the slope of the logarithm of the error against the finest grid over that of the resolution.
fn against_finest(samples: &[Point]) -> Option<f64> {
    let (finest, others) = samples.split_last()?;
    let logs = others.iter().map(|sample| [sample.x.ln(), (sample.y - finest.y).abs().ln()]);
    let logs: Vec<[f64; 2]> = logs.collect();
    if logs.len() < 2 || logs.iter().any(|log| !log[1].is_finite()) {
        return None;
    }
    let count = logs.len() as f64;
    let [x, y] = [0, 1].map(|k| logs.iter().map(|log| log[k]).sum::<f64>() / count);
    let covariance: f64 = logs.iter().map(|log| (log[0] - x) * (log[1] - y)).sum();
    let variance: f64 = logs.iter().map(|log| (log[0] - x).powi(2)).sum();
    Some(-covariance / variance)
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRIDS: [f64; 6] = [5.0, 7.0, 9.0, 12.0, 15.0, 18.0];

    fn samples(order: f64, error: f64, noise: [f64; 6]) -> Vec<Point> {
        (GRIDS.iter().zip(noise))
            .map(|(&x, noise)| Point {
                x,
                y: 0.2 * (1.0 + 2.0 * x.powf(-order)) + noise * error,
                error: Some(error),
            })
            .collect()
    }

    #[test]
    fn exact_values_of_a_known_order_give_this_order_and_the_limit() {
        for order in [0.8, 1.0, 1.5, 2.0, 3.0] {
            let found = Convergence::of(&samples(order, 1e-7, [0.0; 6])).unwrap();
            assert!((found.fit.order - order).abs() < 1e-3, "{order}: {}", found.fit.order);
            assert!((found.fit.limit - 0.2).abs() < 1e-5, "{order}: {}", found.fit.limit);
            let [low, high] = found.order_within.unwrap()[1];
            assert!(low <= order + 1e-3 && order - 1e-3 <= high && high - low < 0.01);
        }
    }

    #[test]
    fn the_confidence_interval_grows_with_the_errors_and_holds_the_order() {
        let noise = [0.6, -0.3, 0.9, -1.1, 0.2, 0.4];
        let width = |error: f64| {
            let found = Convergence::of(&samples(1.5, error, noise)).unwrap();
            let [low, high] = found.order_within.unwrap()[1];
            assert!(low < 1.5 && 1.5 < high, "{error}: {low} to {high}");
            high - low
        };
        assert!(width(1e-4) < 0.5 * width(1e-3), "{} {}", width(1e-4), width(1e-3));
    }

    #[test]
    fn the_order_against_the_finest_grid_is_too_large() {
        let found = Convergence::of(&samples(1.0, 1e-6, [0.0; 6])).unwrap();
        assert!((found.fit.order - 1.0).abs() < 1e-2);
        let finest = found.against_finest.unwrap();
        // The slope of ln (1 / N - 1 / 18) over ln N by least squares.
        assert!((finest - 2.266).abs() < 1e-3, "{finest}");
    }

    #[test]
    fn two_grids_have_no_order_and_unknown_errors_no_confidence() {
        let mut all = samples(1.0, 1e-3, [0.0; 6]);
        assert!(Convergence::of(&all[..2]).is_none());
        for sample in &mut all {
            sample.error = None;
        }
        let found = Convergence::of(&all).unwrap();
        assert!(found.order_within.is_none() && found.limit_within.is_none());
        assert!((found.fit.order - 1.0).abs() < 1e-3);
    }

    #[test]
    fn one_value_without_an_error_counts_as_much_as_the_others() {
        let noise = [0.0, 0.0, 3.0, 0.0, -2.0, 0.0];
        let mut some = samples(1.0, 1e-3, noise);
        let mut none = some.clone();
        some[0].error = None;
        for sample in &mut none {
            sample.error = None;
        }
        assert_eq!(Convergence::of(&some).unwrap().fit, Convergence::of(&none).unwrap().fit);
    }

    #[test]
    fn values_that_do_not_tell_the_order_have_no_extrapolation() {
        let mut wild = samples(1.0, 1e-3, [0.0; 6]);
        for (sample, value) in wild.iter_mut().zip([0.30, 0.2, 0.2, 0.2, 0.2, 0.2]) {
            sample.y = value;
        }
        let found = Convergence::of(&wild).unwrap();
        assert_eq!((words(found.fit.order), found.limit()), ("above 4".to_string(), None));
        assert!(found.limit_within.is_none() && found.error(wild[0].y).is_none());
        assert_eq!(interval_words(found.order_within.unwrap()[0]), "not resolved");
        assert_eq!(interval_words([0.5, 1.25]), "below 1.25");
        assert_eq!(interval_words([1.0, 4.0]), "above 1.00");
    }
}
