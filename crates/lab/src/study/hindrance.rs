//! Exponent of hindered settling from the points of a line over the volume fraction.
//!
//! ```text
//! ln u = ln k + n ln(1 - phi)          by least squares, weighted by (u / e)^2 where all points have errors e
//! ```
//!
//! The interval of `n` holds it at 95 %: Student's quantile for the degrees of freedom times its standard error, which comes from the scatter about the line, or
//! from the errors of the points where that is more.
//!
//! # Reference
//! Richardson and Zaki (1954), Trans. Inst. Chem. Eng. 32, 35, for the law; di Felice and Kehlenbeck (2000), Chem. Eng. Technol. 23, 1123, for a prefactor
//! `k` below one.

use turbid_plot::Point;

/// Quantiles of Student's distribution at 95 %, two-sided, from one degree of freedom on.
const STUDENT: [f64; 10] = [12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228];

/// A fitted law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Hindrance {
    pub(super) prefactor: f64,
    pub(super) exponent: f64,
    /// Half width of the interval of the exponent at 95 %.
    pub(super) confidence: f64,
}

impl Hindrance {
    /// The law through points of the velocity over the volume fraction; none for less than three that it can hold for.
    pub(super) fn of(points: &[Point]) -> Option<Self> {
        let points: Vec<&Point> =
            points.iter().filter(|at| at.y > 0.0 && (0.0..1.0).contains(&at.x)).collect();
        let known: Option<Vec<f64>> = points.iter().map(|at| at.error.filter(|error| *error > 0.0)).collect();
        let logs: Vec<[f64; 3]> = (points.iter().enumerate())
            .map(|(n, at)| {
                let weight = known.as_ref().map_or(1.0, |errors| (at.y / errors[n]).powi(2));
                [(1.0 - at.x).ln(), at.y.ln(), weight]
            })
            .collect();
        let total: f64 = logs.iter().map(|[.., w]| w).sum();
        let mean = |k: usize| logs.iter().map(|at| at[k] * at[2]).sum::<f64>() / total;
        let [x, y] = [0, 1].map(mean);
        let square: f64 = logs.iter().map(|at| at[2] * (at[0] - x).powi(2)).sum();
        let freedom = logs.len().checked_sub(2).filter(|freedom| *freedom > 0 && square > 0.0)?;
        let exponent = logs.iter().map(|at| at[2] * (at[0] - x) * (at[1] - y)).sum::<f64>() / square;
        let left: f64 = logs.iter().map(|at| at[2] * (at[1] - y - exponent * (at[0] - x)).powi(2)).sum();
        let scatter = left / freedom as f64;
        let variance = if known.is_some() { scatter.max(1.0) } else { scatter };
        let quantile = STUDENT.get(freedom - 1).copied().unwrap_or(1.96 + 2.6 / freedom as f64);
        Some(Self {
            prefactor: (y - exponent * x).exp(),
            exponent,
            confidence: quantile * (variance / square).sqrt(),
        })
    }

    /// The velocity at a volume fraction.
    pub(super) fn at(&self, fraction: f64) -> f64 {
        self.prefactor * (self.exponent * (1.0 - fraction).ln()).exp()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points of `0.9 (1 - phi)^4` with noise of this size, and errors if they are known.
    fn points(noise: &[f64], error: Option<f64>) -> Vec<Point> {
        let point = |(n, noise): (usize, &f64)| {
            let x = 0.05 * (n + 1) as f64;
            let y = 0.9 * (1.0 - x).powi(4);
            Point { x, y: y * (1.0 + noise), error: error.map(|error| error * y) }
        };
        noise.iter().enumerate().map(point).collect()
    }

    #[test]
    fn a_law_without_noise_is_found_and_two_points_have_none() {
        let found = Hindrance::of(&points(&[0.0; 6], None)).unwrap();
        assert!((found.exponent - 4.0).abs() < 1e-9 && (found.prefactor - 0.9).abs() < 1e-9);
        assert!(found.confidence < 1e-6 && (found.at(0.2) - 0.9 * 0.8_f64.powi(4)).abs() < 1e-9);
        assert_eq!(Hindrance::of(&points(&[0.0; 2], None)), None);
    }

    #[test]
    fn the_interval_holds_the_exponent_in_19_of_20_sets_of_points() {
        for error in [None, Some(0.02)] {
            let mut random = 7_u64;
            let mut noise = || {
                // Sum of twelve uniform numbers: nearly normal.
                let uniform = (0..12).map(|_| {
                    random = random
                        .wrapping_mul(6_364_136_223_846_793_005)
                        .wrapping_add(1_442_695_040_888_963_407);
                    (random >> 33) as f64 / f64::from(1_u32 << 31)
                });
                0.02 * (uniform.sum::<f64>() - 6.0)
            };
            let held = (0..400).filter(|_| {
                let noise: Vec<f64> = (0..6).map(|_| noise()).collect();
                let found = Hindrance::of(&points(&noise, error)).unwrap();
                (found.exponent - 4.0).abs() < found.confidence
            });
            // 380 of 400 with a deviation of 4.4; with known errors the quantile is that of the scatter as well, which is wider.
            let held = held.count();
            assert!((366..=400).contains(&held), "{error:?}: {held}");
        }
    }
}
