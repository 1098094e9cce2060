//! Ranges and ticks of linear and logarithmic axes.

use crate::markup::power_of_ten;
use crate::text::{Span, roman};

/// Ranges narrower than this part of their values are rounding.
const NARROWEST: f64 = 1e-12;

/// Range and ticks of an axis.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Scale {
    /// Both ends; their decimal logarithms if the axis is logarithmic.
    range: (f64, f64),
    logarithmic: bool,
    /// The numbers at the ticks are to be multiplied by this power of ten.
    pub(crate) exponent: i32,
    /// Ascending.
    pub(crate) ticks: Vec<Tick>,
}

/// A mark on an axis.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Tick {
    /// Position between both ends, 0 to 1.
    pub(crate) part: f32,
    /// The number; empty at a minor tick.
    pub(crate) text: Vec<Span>,
}

impl Tick {
    /// True if it has a number and a grid line.
    pub(crate) fn is_major(&self) -> bool {
        !self.text.is_empty()
    }
}

impl Scale {
    /// The axis for these values, all of them finite and positive if it is logarithmic, with at most `steps` steps between ticks; a
    /// tight one ends at the outermost values.
    pub(crate) fn new(values: &[f64], logarithmic: bool, tight: bool, steps: f64) -> Self {
        let values = values.iter().map(|value| if logarithmic { value.log10() } else { *value });
        let ends = values.fold(None, |ends: Option<(f64, f64)>, value| {
            Some(ends.map_or((value, value), |(lo, hi)| (lo.min(value), hi.max(value))))
        });
        let ends = ends.unwrap_or((0.0, 1.0));
        let (range, exponent, numbers) = if logarithmic {
            let range = logarithmic_range(ends, tight);
            (range, 0, logarithmic_ticks(range, steps))
        } else {
            let range = linear_range(ends, tight, steps);
            let (exponent, numbers) = linear_ticks(range, steps);
            (range, exponent, numbers)
        };
        let (lo, hi) = range;
        let ticks = numbers.into_iter().map(|(at, text)| Tick { part: ((at - lo) / (hi - lo)) as f32, text });
        Self { range, logarithmic, exponent, ticks: ticks.collect() }
    }

    /// Replaces the ticks by ones with numbers at these values, all of them positive if the axis is logarithmic.
    pub(crate) fn set_ticks(&mut self, values: &[f64]) {
        let tick =
            |value: &f64| Some(Tick { part: self.part(*value)?, text: vec![roman(value.to_string())] });
        self.ticks = values.iter().filter_map(tick).collect();
    }

    /// Position of a value between both ends, 0 to 1; none if it is not finite or has no logarithm.
    pub(crate) fn part(&self, value: f64) -> Option<f32> {
        let value = if self.logarithmic { value.log10() } else { value };
        let (lo, hi) = self.range;
        value.is_finite().then(|| ((value - lo) / (hi - lo)) as f32)
    }

    /// Position of zero, if it is well within a linear axis.
    pub(crate) fn zero(&self) -> Option<f32> {
        let zero = -self.range.0 / (self.range.1 - self.range.0);
        (!self.logarithmic && zero > 1e-3 && zero < 0.999).then_some(zero as f32)
    }
}

fn linear_range((lo, hi): (f64, f64), tight: bool, steps: f64) -> (f64, f64) {
    let size = lo.abs().max(hi.abs());
    if hi - lo <= NARROWEST * size {
        let half = if size > 0.0 { 0.05 * size } else { 1.0 };
        (lo - half, hi + half)
    } else if tight {
        (lo, hi)
    } else {
        let margin = 0.02 * (hi - lo);
        rounded(grown(lo, -margin), grown(hi, margin), 1.5 * steps)
    }
}

/// An end of a range and a margin; a range that begins or ends at zero keeps doing so.
pub(crate) fn grown(end: f64, margin: f64) -> f64 {
    if end == 0.0 { 0.0 } else { end + margin }
}

/// The power of ten that the numbers share, and values with their numbers.
fn linear_ticks((lo, hi): (f64, f64), steps: f64) -> (i32, Vec<(f64, Vec<Span>)>) {
    let exponent = match lo.abs().max(hi.abs()).log10().floor() as i32 {
        -2..=3 => 0,
        far => 3 * far.div_euclid(3),
    };
    let unit = 10_f64.powi(exponent);
    let numbers = round_numbers(lo / unit, hi / unit, steps);
    let tick = |(value, text): (f64, String)| (value * unit, vec![roman(text)]);
    (exponent, numbers.into_iter().map(tick).collect())
}

/// Ends are decimal logarithms.
fn logarithmic_range((lo, hi): (f64, f64), tight: bool) -> (f64, f64) {
    let margin = match tight {
        false => (0.02 * (hi - lo)).max(0.02),
        true if hi - lo < 0.04 => 0.02,
        true => 0.0,
    };
    (lo - margin, hi + margin)
}

/// Decimal logarithms with their numbers.
fn logarithmic_ticks((lo, hi): (f64, f64), steps: f64) -> Vec<(f64, Vec<Span>)> {
    let slack = 1e-9;
    let decades = (hi + slack).floor() - (lo - slack).ceil() + 1.0;
    let mut ticks = Vec::new();
    if decades >= 2.0 {
        let step = (decades / (steps + 1.0)).ceil() as i32;
        for power in lo.floor() as i32..=hi.ceil() as i32 {
            let major = power.rem_euclid(step) == 0;
            let text = if major { power_of_ten(power).into() } else { Vec::new() };
            ticks.push((f64::from(power), text));
            let minor = (2..10).filter(|_| step == 1);
            ticks.extend(minor.map(|digit| (f64::from(power) + f64::from(digit).log10(), Vec::new())));
        }
    } else {
        ticks = short_ticks((lo, hi), steps);
    }
    ticks.retain(|(power, _)| (lo - slack..=hi + slack).contains(power));
    ticks
}

/// Ticks of a logarithmic axis that is too short for powers of ten alone: 1, 2 and 5, or all digits, or round numbers.
fn short_ticks((lo, hi): (f64, f64), steps: f64) -> Vec<(f64, Vec<Span>)> {
    // Numbers far from one are written with a power of ten.
    let far = lo < -3.0 || hi > 4.0;
    let number = |digit: u8, power: i32| match (far, digit) {
        (false, _) => {
            let value = f64::from(digit) * 10_f64.powi(power);
            vec![roman(format!("{value:.*}", (-power).max(0) as usize))]
        }
        (true, 1) => power_of_ten(power).into(),
        (true, _) => [vec![roman(format!("{digit}\u{d7}"))], power_of_ten(power).into()].concat(),
    };
    // A linear step suits what spans much less than a decade.
    let digits: &[&[u8]] =
        if far || hi - lo > 0.8 { &[&[1, 2, 5], &[1, 2, 3, 4, 5, 6, 7, 8, 9]] } else { &[] };
    for digits in digits {
        let decades = lo.floor() as i32..=hi.floor() as i32;
        let all = decades.flat_map(|power| digits.iter().map(move |&digit| (digit, power)));
        let ticks: Vec<(f64, Vec<Span>)> = all
            .map(|(digit, power)| (f64::from(power) + f64::from(digit).log10(), number(digit, power)))
            .filter(|(at, _)| (lo..=hi).contains(at))
            .collect();
        if ticks.len() > 2 {
            return ticks;
        }
    }
    let numbers = round_numbers(10_f64.powf(lo), 10_f64.powf(hi), steps);
    let positive = numbers.into_iter().filter(|(value, _)| *value > 0.0);
    positive.map(|(value, text)| (value.log10(), vec![roman(text)])).collect()
}

/// Distance between round numbers, at most `count` steps over `lo..=hi`: 1, 2 or 5 times a power of ten.
fn round_step(lo: f64, hi: f64, count: f64) -> f64 {
    let raw = (hi - lo).max(f64::MIN_POSITIVE) / count;
    let decade = 10_f64.powf(raw.log10().floor());
    let fits = |factor: &f64| factor * decade >= raw * (1.0 - 1e-9);
    [1.0, 2.0, 5.0].into_iter().find(fits).unwrap_or(10.0) * decade
}

/// Round numbers within `lo..=hi`, ascending, each with as many decimals as the step needs.
fn round_numbers(lo: f64, hi: f64, count: f64) -> Vec<(f64, String)> {
    let (step, slack) = (round_step(lo, hi, count), 1e-6);
    let decimals = (-(step.log10() + 1e-9).floor()).max(0.0) as usize;
    let number = |value: f64| {
        let text = format!("{value:.decimals$}");
        // A proper minus sign, and none before zero.
        match text.strip_prefix('-') {
            Some(rest) if rest.bytes().all(|b| b == b'0' || b == b'.') => rest.to_string(),
            Some(rest) => format!("\u{2212}{rest}"),
            None => text,
        }
    };
    let (first, last) = ((lo / step - slack).ceil() as i64, (hi / step + slack).floor() as i64);
    (first..=last).map(|i| i as f64 * step).map(|value| (value, number(value))).collect()
}

/// `lo..=hi` grown to the next round numbers outside.
pub(crate) fn rounded(lo: f64, hi: f64, count: f64) -> (f64, f64) {
    let step = round_step(lo, hi, count);
    ((lo / step + 1e-6).floor() * step, (hi / step - 1e-6).ceil() * step)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(axis: &Scale) -> Vec<String> {
        let major = axis.ticks.iter().filter(|tick| tick.is_major());
        major.map(|tick| tick.text.iter().map(|span| &*span.text).collect()).collect()
    }

    fn linear(values: &[f64], tight: bool) -> Scale {
        Scale::new(values, false, tight, 8.0)
    }

    fn logarithmic(values: &[f64], tight: bool) -> Scale {
        Scale::new(values, true, tight, 8.0)
    }

    #[test]
    fn numbers_are_round_and_have_just_enough_decimals() {
        let labels = |lo, hi| -> Vec<String> {
            round_numbers(lo, hi, 6.0).into_iter().map(|(_, text)| text).collect()
        };
        assert_eq!(labels(0.0, 1.0), ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(labels(0.0, 150.0), ["0", "50", "100", "150"]);
        let signed = ["\u{2212}0.03", "\u{2212}0.02", "\u{2212}0.01", "0.00", "0.01", "0.02"];
        assert_eq!(labels(-0.03, 0.02), signed);
    }

    #[test]
    fn a_range_grows_to_whole_ticks_and_keeps_one_that_is_already_there() {
        let close = |(a, b): (f64, f64), (c, d): (f64, f64)| (a - c).abs() < 1e-12 && (b - d).abs() < 1e-12;
        assert!(close(rounded(0.013, 0.27, 6.0), (0.0, 0.3)));
        assert!(close(rounded(0.0, 1.0, 6.0), (0.0, 1.0)));
    }

    #[test]
    fn small_and_large_numbers_share_a_power_of_ten_that_is_a_multiple_of_three() {
        let small = linear(&[0.0, 3.01e-6], true);
        assert_eq!(small.exponent, -6);
        assert_eq!(texts(&small), ["0.0", "0.5", "1.0", "1.5", "2.0", "2.5", "3.0"]);
        assert_eq!(linear(&[0.0, 5e4], true).exponent, 3);
        assert_eq!(linear(&[-0.02, 0.05], true).exponent, 0);
        assert_eq!(linear(&[0.0, 900.0], true).exponent, 0);
    }

    #[test]
    fn a_long_logarithmic_axis_has_powers_of_ten_and_between_them_the_other_digits() {
        let axis = logarithmic(&[1e-8, 0.1], true);
        let powers: Vec<String> = (1..=8).rev().map(|power| format!("10\u{2212}{power}")).collect();
        assert_eq!(texts(&axis), powers);
        assert_eq!(axis.ticks.len(), 8 + 7 * 8);
        assert!(axis.part(1e-8).unwrap().abs() < 1e-6 && (axis.part(0.1).unwrap() - 1.0).abs() < 1e-6);
        assert_eq!(axis.part(0.0), None);
    }

    #[test]
    fn a_short_logarithmic_axis_has_round_numbers() {
        let axis = logarithmic(&[0.5, 0.95], true);
        assert_eq!(texts(&axis)[0], "0.5");
        assert!(texts(&axis).len() >= 4);
        assert_eq!(texts(&logarithmic(&[0.003, 0.08], true)), ["0.005", "0.01", "0.02", "0.05"]);
        let tiny = logarithmic(&[2.5e-16, 8.8e-15], true);
        let numbers = ["5\u{d7}10\u{2212}16", "10\u{2212}15", "2\u{d7}10\u{2212}15", "5\u{d7}10\u{2212}15"];
        assert_eq!(texts(&tiny), numbers);
    }

    #[test]
    fn constant_missing_and_huge_values_still_make_an_axis() {
        for values in [&[][..], &[0.0], &[1.0 + 1e-15, 1.0], &[-3e300, 2e300], &[1e-300]] {
            let axis = linear(values, false);
            assert!(axis.range.1 > axis.range.0 && axis.ticks.len() >= 2, "{values:?}");
            let inside = |value: &f64| (0.0..=1.0).contains(&axis.part(*value).unwrap());
            assert!(values.iter().all(inside), "{values:?}: {axis:?}");
        }
        assert!(logarithmic(&[], false).ticks.len() >= 2);
        assert!(logarithmic(&[7e-5], false).range.0 < logarithmic(&[7e-5], false).range.1);
    }
}
