//! Ranges and ticks of linear and logarithmic axes.

use crate::colour::INK;
use crate::drawing::{Align, Area, Drawing, Stroke};
use crate::text::{widest, width};

/// Ranges narrower than this fraction of their values are rounding.
const NARROWEST: f64 = 1e-12;
/// Length of a tick with a number.
const TICK: f32 = 10.0;

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

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Tick {
    /// Position between both ends, 0 to 1.
    pub(crate) part: f32,
    /// The number; empty at a minor tick.
    pub(crate) text: String,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Ends {
    /// At the outermost values.
    Tight,
    /// A margin beyond them.
    Margin,
    /// At the next ticks beyond them; a logarithmic axis has a margin instead.
    Round,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Side {
    Below,
    Left,
    Right,
}

impl Scale {
    /// The axis for these values, all of them finite and positive if it is logarithmic, with at most `steps` steps between ticks.
    pub(crate) fn new(values: &[f64], logarithmic: bool, ends: Ends, steps: f64) -> Self {
        let values = values.iter().map(|value| if logarithmic { value.log10() } else { *value });
        let range =
            values.map(|value| (value, value)).reduce(|(lo, hi), (value, _)| (lo.min(value), hi.max(value)));
        let range = range.unwrap_or((0.0, 1.0));
        let (range, exponent, numbers) = if logarithmic {
            let range = logarithmic_range(range, ends);
            (range, 0, logarithmic_ticks(range, steps))
        } else {
            let range = linear_range(range, ends, steps);
            let exponent = match range.0.abs().max(range.1.abs()).log10().floor() as i32 {
                -2..=3 => 0,
                far => 3 * far.div_euclid(3),
            };
            let unit = 10_f64.powi(exponent);
            let mut numbers = round_numbers(range.0 / unit, range.1 / unit, steps);
            for (value, _) in &mut numbers {
                *value *= unit;
            }
            (range, exponent, numbers)
        };
        let (lo, hi) = range;
        let ticks = numbers.into_iter().map(|(at, text)| Tick { part: ((at - lo) / (hi - lo)) as f32, text });
        Self { range, logarithmic, exponent, ticks: ticks.collect() }
    }

    /// Replaces the ticks by ones with numbers at these values, all of them positive if the axis is logarithmic.
    pub(crate) fn set_ticks(&mut self, values: &[f64]) {
        let tick = |value: &f64| Some(Tick { part: self.part(*value)?, text: value.to_string() });
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

    /// Ticks with a number and a grid line.
    pub(crate) fn major(&self) -> impl Iterator<Item = &Tick> {
        self.ticks.iter().filter(|tick| !tick.text.is_empty())
    }

    /// Width of the widest number.
    pub(crate) fn widest(&self, size: f32) -> f32 {
        widest(self.ticks.iter().map(|tick| &*tick.text), size)
    }

    /// Draws the ticks at a side of a frame, with numbers of this size where they do not overlap, or none for size zero.
    pub(crate) fn draw(&self, drawing: &mut Drawing, side: Side, (l, t, r, b): Area, size: f32) {
        // Middle of the last number, and half the space that it takes.
        let mut last = (f32::NEG_INFINITY, 0.0);
        for Tick { part, text } in &self.ticks {
            let (x, y) = (l + part * (r - l), b - part * (b - t));
            let (baseline, beside) = (y + 0.36 * size, (y, 0.5 * size));
            let below = (x, 0.5 * width(text, size) + 6.0);
            let (foot, outwards, at, align, number) = match side {
                Side::Below => ((x, b), (0.0, 1.0), (x, b + 40.0), Align::Middle, below),
                Side::Left => ((l, y), (-1.0, 0.0), (l - 20.0, baseline), Align::End, beside),
                Side::Right => ((r, y), (1.0, 0.0), (r + 20.0, baseline), Align::Start, beside),
            };
            let end = |length: f32| (foot.0 + outwards.0 * length, foot.1 + outwards.1 * length);
            let length = if text.is_empty() { 0.6 * TICK } else { TICK };
            drawing.line(&[end(2.0), end(2.0 + length)], Stroke::new(INK, 2.0));
            if !text.is_empty() && size > 0.0 && (number.0 - last.0).abs() > number.1 + last.1 {
                drawing.text(text, size, at, align, INK);
                last = number;
            }
        }
    }
}

fn linear_range((lo, hi): (f64, f64), ends: Ends, steps: f64) -> (f64, f64) {
    let size = lo.abs().max(hi.abs());
    if hi - lo <= NARROWEST * size {
        let half = if size > 0.0 { 0.05 * size } else { 1.0 };
        return (lo - half, hi + half);
    }
    // An end at zero stays there.
    let grown = |fraction: f64| {
        let grow = |end: f64, margin: f64| if end == 0.0 { 0.0 } else { end + margin };
        let margin = fraction * (hi - lo);
        (grow(lo, -margin), grow(hi, margin))
    };
    match ends {
        Ends::Tight => (lo, hi),
        Ends::Margin => grown(0.05),
        Ends::Round => {
            let (lo, hi) = grown(0.02);
            rounded(lo, hi, 1.5 * steps)
        }
    }
}

/// Ends are decimal logarithms.
fn logarithmic_range((lo, hi): (f64, f64), ends: Ends) -> (f64, f64) {
    let margin = match ends {
        Ends::Tight if hi - lo >= 0.04 => 0.0,
        Ends::Tight => 0.02,
        Ends::Margin | Ends::Round => (0.02 * (hi - lo)).max(0.02),
    };
    (lo - margin, hi + margin)
}

/// Decimal logarithms with their numbers.
fn logarithmic_ticks((lo, hi): (f64, f64), steps: f64) -> Vec<(f64, String)> {
    let slack = 1e-9;
    let decades = (hi + slack).floor() - (lo - slack).ceil() + 1.0;
    let mut ticks = Vec::new();
    if decades < 2.0 {
        ticks = short_ticks((lo, hi), steps);
    } else {
        let step = (decades / (steps + 1.0)).ceil() as i32;
        for power in lo.floor() as i32..=hi.ceil() as i32 {
            let text = if power.rem_euclid(step) == 0 { format!("10^{power}") } else { String::new() };
            ticks.push((f64::from(power), text));
            let minor = (2..10).filter(|_| step == 1);
            ticks.extend(minor.map(|digit| (f64::from(power) + f64::from(digit).log10(), String::new())));
        }
    }
    ticks.retain(|(power, _)| (lo - slack..=hi + slack).contains(power));
    ticks
}

/// Ticks of a logarithmic axis that is too short for powers of ten alone: 1, 2 and 5, or all digits, or round numbers.
fn short_ticks((lo, hi): (f64, f64), steps: f64) -> Vec<(f64, String)> {
    // Numbers far from one are written with a power of ten.
    let far = lo < -3.0 || hi > 4.0;
    let number = |digit: u8, power: i32| match (far, digit) {
        (true, 1) => format!("10^{power}"),
        (true, _) => format!("{digit}\u{d7}10^{power}"),
        _ => format!("{:.*}", (-power).max(0) as usize, f64::from(digit) * 10_f64.powi(power)),
    };
    // A linear step suits what spans much less than a decade.
    let digits = [&[1, 2, 5][..], &[1, 2, 3, 4, 5, 6, 7, 8, 9]].into_iter().filter(|_| far || hi - lo > 0.8);
    for digits in digits {
        let decades = lo.floor() as i32..=hi.floor() as i32;
        let all = decades.flat_map(|power| digits.iter().map(move |&digit| (digit, power)));
        let ticks: Vec<(f64, String)> = all
            .map(|(digit, power)| (f64::from(power) + f64::from(digit).log10(), number(digit, power)))
            .filter(|(at, _)| (lo..=hi).contains(at))
            .collect();
        if ticks.len() > 2 {
            return ticks;
        }
    }
    let numbers = round_numbers(10_f64.powf(lo), 10_f64.powf(hi), steps).into_iter();
    numbers.filter(|(value, _)| *value > 0.0).map(|(value, text)| (value.log10(), text)).collect()
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
    use crate::drawing::Mark;

    fn texts(axis: &Scale) -> Vec<String> {
        axis.major().map(|tick| tick.text.clone()).collect()
    }

    fn linear(values: &[f64], ends: Ends) -> Scale {
        Scale::new(values, false, ends, 8.0)
    }

    fn logarithmic(values: &[f64], ends: Ends) -> Scale {
        Scale::new(values, true, ends, 8.0)
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
        let small = linear(&[0.0, 3.01e-6], Ends::Tight);
        assert_eq!(small.exponent, -6);
        assert_eq!(texts(&small), ["0.0", "0.5", "1.0", "1.5", "2.0", "2.5", "3.0"]);
        assert_eq!(linear(&[0.0, 5e4], Ends::Tight).exponent, 3);
        assert_eq!(linear(&[-0.02, 0.05], Ends::Tight).exponent, 0);
        assert_eq!(linear(&[0.0, 900.0], Ends::Tight).exponent, 0);
    }

    #[test]
    fn a_long_logarithmic_axis_has_powers_of_ten_and_between_them_the_other_digits() {
        let axis = logarithmic(&[1e-8, 0.1], Ends::Tight);
        let powers: Vec<String> = (1..=8).rev().map(|power| format!("10^-{power}")).collect();
        assert_eq!(texts(&axis), powers);
        assert_eq!(axis.ticks.len(), 8 + 7 * 8);
        assert!(axis.part(1e-8).unwrap().abs() < 1e-6 && (axis.part(0.1).unwrap() - 1.0).abs() < 1e-6);
        assert_eq!(axis.part(0.0), None);
    }

    #[test]
    fn a_short_logarithmic_axis_has_round_numbers() {
        let axis = logarithmic(&[0.5, 0.95], Ends::Tight);
        assert_eq!(texts(&axis)[0], "0.5");
        assert!(texts(&axis).len() >= 4);
        assert_eq!(texts(&logarithmic(&[0.003, 0.08], Ends::Tight)), ["0.005", "0.01", "0.02", "0.05"]);
        let tiny = logarithmic(&[2.5e-16, 8.8e-15], Ends::Tight);
        let numbers = ["5\u{d7}10^-16", "10^-15", "2\u{d7}10^-15", "5\u{d7}10^-15"];
        assert_eq!(texts(&tiny), numbers);
    }

    #[test]
    fn constant_missing_and_huge_values_still_make_an_axis() {
        for values in [&[][..], &[0.0], &[1.0 + 1e-15, 1.0], &[-3e300, 2e300], &[1e-300]] {
            let axis = linear(values, Ends::Round);
            assert!(axis.range.1 > axis.range.0 && axis.ticks.len() >= 2, "{values:?}");
            let inside = |value: &f64| (0.0..=1.0).contains(&axis.part(*value).unwrap());
            assert!(values.iter().all(inside), "{values:?}: {axis:?}");
        }
        assert!(logarithmic(&[], Ends::Round).ticks.len() >= 2);
        assert!(logarithmic(&[7e-5], Ends::Round).range.0 < logarithmic(&[7e-5], Ends::Round).range.1);
    }

    #[test]
    fn numbers_are_drawn_from_both_ends_and_left_out_where_they_would_overlap() {
        let scale = Scale::new(&[0.0, 1.0], false, Ends::Tight, 10.0);
        let numbers = |side, area, size| {
            let mut drawing = Drawing::default();
            scale.draw(&mut drawing, side, area, size);
            drawing.0.iter().filter(|mark| matches!(mark, Mark::Area(..))).count()
        };
        for side in [Side::Below, Side::Left, Side::Right] {
            let [area, downwards] = [(0.0, 0.0, 800.0, 800.0), (0.0, 800.0, 800.0, 0.0)];
            assert_eq!([numbers(side, area, 20.0), numbers(side, downwards, 20.0)], [11; 2]);
            assert!((3..9).contains(&numbers(side, (0.0, 0.0, 200.0, 100.0), 20.0)));
            assert_eq!(numbers(side, area, 0.0), 0);
        }
    }
}
