//! Checks of single values, each with key, place, value and remedy in its message.

use super::FluidSetup;
use super::file::{Duration, Every};
use super::forms::Triple;
use super::located::Located;
use super::source::Source;
use crate::error::{Error, Result};
use crate::math::Vec3;
use std::ops::{Range, RangeInclusive};

/// Lengths of time that steps are counted with (s).
#[derive(Clone, Copy, Debug)]
pub(super) struct Clock {
    pub(super) time_step: f64,
    pub(super) stokes_time: f64,
}

impl Clock {
    /// Nothing settles without a fluid.
    pub(super) fn of(time_step: f64, fluid: Option<&FluidSetup>) -> Self {
        Self { time_step, stokes_time: fluid.map_or(f64::INFINITY, |fluid| fluid.scales.stokes_time) }
    }
}

/// A value that one of several alternatives may have.
pub(super) trait Alternative {
    /// Where it stands, if it is given in a section at `section`.
    fn place(&self, section: &Range<usize>) -> Option<Range<usize>>;
}

impl<T> Alternative for Option<Located<T>> {
    fn place(&self, _: &Range<usize>) -> Option<Range<usize>> {
        self.as_ref().map(|value| value.span.clone())
    }
}

impl<T> Alternative for Option<Vec<Located<T>>> {
    fn place(&self, section: &Range<usize>) -> Option<Range<usize>> {
        let first = |list: &Vec<Located<T>>| list.first().map_or(section.clone(), |value| value.span.clone());
        self.as_ref().map(first)
    }
}

impl<T, const N: usize> Alternative for Option<[Located<T>; N]> {
    fn place(&self, _: &Range<usize>) -> Option<Range<usize>> {
        self.as_ref().map(|list| list[0].span.clone())
    }
}

impl Source {
    /// A finite number above 0.
    pub(super) fn positive(&self, key: &str, number: &Located<f64>, remedy: &str) -> Result<f64> {
        self.satisfies(key, number, |x| x > 0.0, "a finite number above 0", remedy)
    }

    /// A finite number that fulfils `condition`, which `wanted` puts in words.
    pub(super) fn satisfies(
        &self,
        key: &str,
        number: &Located<f64>,
        condition: impl Fn(f64) -> bool,
        wanted: &str,
        remedy: &str,
    ) -> Result<f64> {
        let value = number.value;
        if value.is_finite() && condition(value) {
            return Ok(value);
        }
        Err(self.out_of_range(key, &number.span, &value.to_string(), wanted, remedy))
    }

    /// A whole number in a range, which `wanted` puts in words.
    pub(super) fn whole(
        &self,
        key: &str,
        number: &Located<u32>,
        range: RangeInclusive<u32>,
        wanted: &str,
        remedy: &str,
    ) -> Result<u32> {
        let value = number.value;
        if range.contains(&value) {
            return Ok(value);
        }
        Err(self.out_of_range(key, &number.span, &value.to_string(), wanted, remedy))
    }

    /// Three finite numbers.
    pub(super) fn finite(&self, key: &str, span: &Range<usize>, numbers: [f64; 3]) -> Result<[f64; 3]> {
        match numbers.iter().find(|x| !x.is_finite()) {
            Some(bad) => Err(self.out_of_range(key, span, &bad.to_string(), "finite numbers", "")),
            None => Ok(numbers),
        }
    }

    /// Three finite numbers as a vector.
    pub(super) fn vector(&self, key: &str, span: &Range<usize>, numbers: &Triple) -> Result<Vec3> {
        let values = numbers.each_ref().map(|x| x.value);
        Ok(self.finite(key, span, values)?.into())
    }

    /// Three finite numbers as a unit vector.
    pub(super) fn direction(&self, key: &str, span: &Range<usize>, numbers: &Triple) -> Result<Vec3> {
        (self.vector(key, span, numbers)?.try_normalize(0.0)).ok_or_else(|| {
            let wanted = "a direction of any length but 0";
            self.out_of_range(key, span, "[0, 0, 0]", wanted, "e.g. [0, 0, 1]")
        })
    }

    /// `key` is `value`, but must be `wanted`.
    pub(super) fn out_of_range(
        &self,
        key: &str,
        span: &Range<usize>,
        value: &str,
        wanted: &str,
        remedy: &str,
    ) -> Error {
        let title = format!("`{key}` is {value}, but must be {wanted}");
        self.error(span, &title, "out of range", remedy)
    }

    /// The name of the one alternative of a section, which stands at `place`, that is given.
    pub(super) fn exactly_one<'a>(
        &self,
        section: &str,
        place: &Range<usize>,
        alternatives: &[(&'a str, &dyn Alternative)],
    ) -> Result<&'a str> {
        let given: Vec<_> =
            (alternatives.iter()).filter_map(|(name, value)| Some((*name, value.place(place)?))).collect();
        let names: Vec<String> = alternatives.iter().map(|(name, _)| format!("`{name}`")).collect();
        let title = |has: &str| {
            let names = names.join(", ");
            format!("`{section}` needs exactly one of {names}, but has {has}")
        };
        match &given[..] {
            [(name, _)] => Ok(*name),
            [] => Err(self.error(place, &title("none"), "none is given here", "add one of them")),
            [(_, first), (_, second), ..] => {
                let places = [(first, "given here"), (second, "and here")];
                Err(self.error_at(&places, &title(&given.len().to_string()), "remove all but one"))
            }
        }
    }

    /// A length of time in whole steps, at least one.
    pub(super) fn steps(&self, key: &str, duration: &Located<Duration>, clock: Clock) -> Result<u64> {
        let span = &duration.span;
        let seconds = match duration.value {
            Duration::Steps(0) => {
                return Err(self.out_of_range(key, span, "0 steps", "at least 1 step", "give more steps"));
            }
            Duration::Steps(steps) => return Ok(steps),
            Duration::Time(seconds) => {
                self.positive(key, &at(span, seconds), "give seconds, e.g. { time = 0.5 }")?
            }
            Duration::StokesTimes(times) => {
                let times = self.positive(key, &at(span, times), "e.g. { stokes_times = 50 }")?;
                if !clock.stokes_time.is_finite() {
                    return Err(self.error(
                        span,
                        &format!("`{key}` is in units of t*, but nothing settles in this case"),
                        "t* is infinite: gravity is zero or the densities are equal",
                        "use { steps = ... } or { time = ... }",
                    ));
                }
                times * clock.stokes_time
            }
        };
        let steps = (seconds / clock.time_step).round().max(1.0);
        if steps > 1e15 {
            let remedy = format!("one time step is {:.3e} s", clock.time_step);
            return Err(self.out_of_range(
                key,
                span,
                &format!("{steps:e} steps"),
                "below 1e15 steps",
                &remedy,
            ));
        }
        Ok(steps as u64)
    }

    /// Steps between outputs; 0 is never.
    pub(super) fn interval(
        &self,
        key: &str,
        every: Option<&Located<Every>>,
        clock: Clock,
        default: u64,
    ) -> Result<u64> {
        let Some(every) = every else {
            return Ok(default.max(1));
        };
        let duration = match every.value {
            Every::Never => return Ok(0),
            Every::Time(x) => Duration::Time(x),
            Every::Steps(n) => Duration::Steps(n),
            Every::StokesTimes(x) => Duration::StokesTimes(x),
        };
        self.steps(key, &at(&every.span, duration), clock).map_err(|e| match every.value {
            Every::Steps(0) => {
                self.out_of_range(key, &every.span, "0 steps", "at least 1 step", "\"never\" switches it off")
            }
            _ => e,
        })
    }
}

/// A value at a known place.
pub(super) fn at<T>(span: &Range<usize>, value: T) -> Located<T> {
    Located { value, span: span.clone() }
}
