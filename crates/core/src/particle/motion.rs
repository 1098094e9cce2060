//! Prescribed motion: velocity and angular velocity as functions of time, and the directions that stay free.
//!
//! ```text
//! constant      v(t) = v
//! oscillation   v(t) = v_m + v_a sin(2 pi f t + phase)
//! table         linear between its times, constant before the first and after the last
//! ```
//!
//! Over a step a body moves by the exact integral of its velocity, so that its path does not drift, and turns through
//! that of its angular velocity: exact for a constant axis, else second order in the step. The time of a step alone
//! decides both; no state is kept.

use crate::math::Vec3;
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

    /// Bound of the magnitude of each component at all times.
    pub fn largest(&self) -> Vec3 {
        match self {
            Self::Constant(value) => value.abs(),
            Self::Oscillation { mean, amplitude, .. } => mean.abs() + amplitude.abs(),
            Self::Table(rows) => rows.iter().fold(Vec3::zeros(), |most, row| most.sup(&row.1.abs())),
        }
    }
}

/// Motion of the bodies of a template, as far as it is prescribed. By default all of it follows from forces.
#[derive(Clone, Debug, PartialEq)]
pub struct PrescribedMotion {
    /// Velocity of the centre of mass (m/s) in the directions that are not free.
    pub velocity: TimeFunction,
    /// Angular velocity (1/s), unless rotation is free.
    pub angular_velocity: TimeFunction,
    /// Directions x, y, z in which forces move the centre of mass.
    pub free: [bool; 3],
    /// True if torques turn the body.
    pub free_rotation: bool,
}

impl Default for PrescribedMotion {
    fn default() -> Self {
        Self { free: [true; 3], free_rotation: true, ..Self::fixed() }
    }
}

impl PrescribedMotion {
    /// Neither moves nor turns.
    pub fn fixed() -> Self {
        Self {
            velocity: TimeFunction::default(),
            angular_velocity: TimeFunction::default(),
            free: [false; 3],
            free_rotation: false,
        }
    }

    /// Returns true if nothing is prescribed.
    pub fn is_free(&self) -> bool {
        self.free == [true; 3] && self.free_rotation
    }

    /// Returns true if forces do not move the centre of mass in any direction.
    pub fn holds_centre(&self) -> bool {
        self.free == [false; 3]
    }

    /// Returns true if neither forces nor torques move the body.
    pub fn is_complete(&self) -> bool {
        self.holds_centre() && !self.free_rotation
    }

    /// Returns true if the centre of mass stays where it is.
    pub fn rests(&self) -> bool {
        self.holds_centre() && self.velocity.largest() == Vec3::zeros()
    }

    /// Bound (m/s) of the speed of the surface of a body of this circumradius (m) by what is prescribed.
    pub fn largest_speed(&self, circumradius: f64) -> f64 {
        self.velocity.largest().norm() + self.angular_velocity.largest().norm() * circumradius
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
