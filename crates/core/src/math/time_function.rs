//! A vector as a function of time: a prescribed velocity, or an acceleration.
//!
//! ```text
//! constant      v(t) = v
//! oscillation   v(t) = v_m + v_a sin(2 pi f t + phase)
//! table         linear between its times, constant before the first and after the last
//! ```

use super::Vec3;
use std::f64::consts::TAU;
use std::sync::Arc;

/// A vector as a function of time.
#[derive(Clone, Debug, PartialEq)]
pub enum TimeFunction {
    /// The same at all times.
    Constant(Vec3),
    /// `mean + amplitude sin(2 pi frequency t + phase)`.
    Oscillation {
        /// Mean over a period.
        mean: Vec3,
        /// Amplitude.
        amplitude: Vec3,
        /// Frequency (Hz).
        frequency: f64,
        /// Phase at time 0 (radians).
        phase: f64,
    },
    /// Values at ascending times (s), linear between them and constant before and after.
    Table(Arc<[(f64, Vec3)]>),
}

impl Default for TimeFunction {
    fn default() -> Self {
        Self::Constant(Vec3::zeros())
    }
}

impl TimeFunction {
    /// Value at a time (s).
    pub fn at(&self, time: f64) -> Vec3 {
        match self {
            Self::Constant(value) => *value,
            Self::Oscillation { mean, amplitude, frequency, phase } => {
                mean + amplitude * libm::sin(TAU * frequency * time + phase)
            }
            Self::Table(rows) => {
                let after = rows.partition_point(|row| row.0 <= time);
                match (rows[..after].last(), rows.get(after)) {
                    (Some((t, value)), Some((next, following))) => {
                        value + (following - value) * ((time - t) / (next - t))
                    }
                    (Some((_, value)), None) | (None, Some((_, value))) => *value,
                    (None, None) => Vec3::zeros(),
                }
            }
        }
    }

    /// Integral over an interval of time (s), exact but for rounding.
    pub fn integral(&self, from: f64, to: f64) -> Vec3 {
        match self {
            Self::Constant(value) => value * (to - from),
            Self::Oscillation { mean, amplitude, frequency, phase } => {
                // cos a - cos b = 2 sin((a + b) / 2) sin((b - a) / 2) loses no digits where the interval is short.
                let omega = TAU * frequency;
                let middle = libm::sin(0.5 * omega * (from + to) + phase);
                let half = libm::sin(0.5 * omega * (to - from));
                mean * (to - from) + amplitude * (2.0 * middle * half / omega)
            }
            Self::Table(rows) => {
                let first = rows.partition_point(|row| row.0 <= from);
                let last = rows.partition_point(|row| row.0 < to).max(first);
                let (mut sum, mut time) = (Vec3::zeros(), from);
                for next in rows[first..last].iter().map(|row| row.0).chain([to]) {
                    sum += (self.at(time) + self.at(next)) * (0.5 * (next - time));
                    time = next;
                }
                sum
            }
        }
    }

    /// Mean over an interval of time (s).
    pub fn mean(&self, from: f64, to: f64) -> Vec3 {
        match self {
            Self::Constant(value) => *value,
            _ => self.integral(from, to) / (to - from),
        }
    }

    /// The value, if it is the same at all times by its form.
    pub fn constant(&self) -> Option<Vec3> {
        match self {
            Self::Constant(value) => Some(*value),
            _ => None,
        }
    }

    /// True if it is zero at all times.
    pub fn is_zero(&self) -> bool {
        self.largest() == Vec3::zeros()
    }

    /// Vectors of which every value is a sum with any factors.
    pub fn span(&self) -> Vec<Vec3> {
        match self {
            Self::Constant(value) => vec![*value],
            Self::Oscillation { mean, amplitude, .. } => vec![*mean, *amplitude],
            Self::Table(rows) => rows.iter().map(|row| row.1).collect(),
        }
    }

    /// Bound of the magnitude of each component of its integral from time 0 to any time up to `to` (s).
    pub fn largest_integral(&self, to: f64) -> Vec3 {
        let bound = self.largest() * to;
        match self {
            Self::Constant(_) => bound,
            Self::Oscillation { mean, amplitude, frequency, phase } => {
                let swing = (1.0 + libm::cos(*phase).abs()) / (TAU * frequency);
                bound.inf(&(mean.abs() * to + amplitude.abs() * swing))
            }
            Self::Table(rows) => {
                Self::Table(rows.iter().map(|(time, value)| (*time, value.abs())).collect()).integral(0.0, to)
            }
        }
    }

    /// Bound of the magnitude of each component at all times.
    pub fn largest(&self) -> Vec3 {
        match self {
            Self::Constant(value) => value.abs(),
            Self::Oscillation { mean, amplitude, .. } => mean.abs() + amplitude.abs(),
            Self::Table(rows) => rows.iter().fold(Vec3::zeros(), |most, row| most.sup(&row.1.abs())),
        }
    }
}

impl From<Vec3> for TimeFunction {
    fn from(value: Vec3) -> Self {
        Self::Constant(value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn functions() -> [TimeFunction; 4] {
        [
            TimeFunction::Constant(Vec3::new(0.3, -0.2, 1.0)),
            TimeFunction::Oscillation {
                mean: Vec3::new(0.1, 0.0, -0.4),
                amplitude: Vec3::new(1.0, -2.0, 0.5),
                frequency: 3.0,
                phase: 0.7,
            },
            TimeFunction::Table(Arc::new([
                (0.1, Vec3::new(1.0, 0.0, 0.0)),
                (0.25, Vec3::new(-1.0, 2.0, 0.0)),
                (0.9, Vec3::new(0.0, 2.0, 5.0)),
            ])),
            TimeFunction::Table(Arc::new([(0.5, Vec3::x())])),
        ]
    }

    #[test]
    fn the_integral_is_the_limit_of_sums_over_short_intervals() {
        for function in functions() {
            for [from, to] in [[0.0, 0.05], [0.0, 1.3], [0.2, 0.3], [0.85, 2.0]] {
                let n = 20_000;
                let dt = (to - from) / f64::from(n);
                let sum: Vec3 = (0..n).map(|i| function.at(from + (f64::from(i) + 0.5) * dt) * dt).sum();
                let exact = function.integral(from, to);
                assert!((sum - exact).norm() < 1e-6, "{function:?} from {from} to {to}: {sum} {exact}");
            }
        }
    }

    #[test]
    fn steps_of_any_length_add_up_to_the_same_way() {
        for function in functions() {
            let whole = function.integral(0.0, 2.0);
            for n in [7_u32, 1000] {
                let at = |i: u32| f64::from(i) * 2.0 / f64::from(n);
                let sum: Vec3 = (0..n).map(|i| function.integral(at(i), at(i + 1))).sum();
                assert!((sum - whole).norm() < 1e-12, "{function:?}: {sum} {whole}");
            }
        }
    }

    #[test]
    fn an_oscillation_ends_where_it_began_after_a_million_periods() {
        let function = TimeFunction::Oscillation {
            mean: Vec3::zeros(),
            amplitude: Vec3::x(),
            frequency: 10.0,
            phase: 0.0,
        };
        assert!(function.integral(0.0, 1e5).norm() < 1e-11);
        assert!((function.integral(0.0, 0.05).x - 2.0 / (TAU * 10.0)).abs() < 1e-16);
    }

    #[test]
    fn a_table_is_constant_before_its_first_time_and_after_its_last() {
        let table = &functions()[2];
        assert_eq!((table.at(-1.0), table.at(0.1)), (Vec3::x(), Vec3::x()));
        assert!((table.at(0.175) - Vec3::y()).norm() < 1e-15);
        assert_eq!(table.at(7.0), Vec3::new(0.0, 2.0, 5.0));
    }

    #[test]
    fn the_mean_over_an_interval_times_its_length_is_the_integral() {
        for function in functions() {
            let (from, to) = (0.17, 0.31);
            let difference = function.mean(from, to) * (to - from) - function.integral(from, to);
            assert!(difference.norm() < 1e-15, "{function:?}");
        }
    }

    #[test]
    fn no_integral_from_the_start_exceeds_its_bound_and_that_of_an_oscillation_does_not_grow() {
        for function in functions() {
            for to in [0.05, 0.4, 3.0] {
                let bound = function.largest_integral(to) * (1.0 + 1e-12);
                for i in 0..=50 {
                    let value = function.integral(0.0, to * f64::from(i) / 50.0).abs();
                    assert!((0..3).all(|a| value[a] <= bound[a]), "{function:?}");
                }
            }
        }
        let TimeFunction::Oscillation { amplitude, frequency, phase, .. } = functions()[1].clone() else {
            panic!();
        };
        let swinging = TimeFunction::Oscillation { mean: Vec3::zeros(), amplitude, frequency, phase };
        assert_eq!(swinging.largest_integral(1e3), swinging.largest_integral(1e6));
    }

    #[test]
    fn no_component_exceeds_its_bound() {
        for function in functions() {
            let bound = function.largest();
            for i in 0..500 {
                let value = function.at(0.004 * f64::from(i)).abs();
                assert!((0..3).all(|a| value[a] <= bound[a]), "{function:?}");
            }
        }
    }
}
