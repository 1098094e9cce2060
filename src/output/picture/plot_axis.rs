//! Ranges and ticks of linear and logarithmic axes.

use super::axis::{Ticks, rounded_range};
use super::markup::power_of_ten;
use super::text::{Span, roman};

/// Most steps between the ticks of an axis, unless told otherwise.
const STEPS: f64 = 8.0;
/// Ranges narrower than this part of their values are rounding.
const NARROWEST: f64 = 1e-12;

/// What an axis shows, and where.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Axis {
    /// Both ends; their decimal logarithms if the axis is logarithmic.
    range: (f64, f64),
    logarithmic: bool,
    /// The numbers at the ticks are to be multiplied by this power of ten.
    pub(super) exponent: i32,
    /// Ascending.
    pub(super) ticks: Vec<Tick>,
}

/// A mark on an axis.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Tick {
    /// Where between both ends, 0 to 1.
    pub(super) part: f32,
    text: TickText,
}

#[derive(Clone, Debug, PartialEq)]
enum TickText {
    None,
    Number(String),
    /// Power of ten.
    Power(i32),
    /// A digit times a power of ten.
    Scaled(u8, i32),
}

impl Tick {
    /// Whether a line goes through the plot here.
    pub(super) fn is_major(&self) -> bool {
        self.text != TickText::None
    }

    /// The number here, if there is one.
    pub(super) fn spans(&self) -> Vec<Span<'static>> {
        match &self.text {
            TickText::None => Vec::new(),
            TickText::Number(text) => vec![roman(text.clone())],
            TickText::Power(exponent) | TickText::Scaled(1, exponent) => power_of_ten(*exponent).into(),
            TickText::Scaled(digit, exponent) => {
                let mut spans = vec![roman(format!("{digit}\u{d7}"))];
                spans.extend(power_of_ten(*exponent));
                spans
            }
        }
    }
}

impl Axis {
    /// For these values, all of them finite and positive if the axis is logarithmic; a tight one ends where they do.
    pub(super) fn new(values: &[f64], logarithmic: bool, tight: bool) -> Self {
        Self::with_steps(values, logarithmic, tight, STEPS)
    }

    /// The same, with at most so many steps between its ticks.
    pub(super) fn with_steps(values: &[f64], logarithmic: bool, tight: bool, steps: f64) -> Self {
        let least = values.iter().copied().fold(f64::INFINITY, f64::min);
        let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        if logarithmic {
            let ends = if values.is_empty() {
                (0.0, 1.0)
            } else {
                (least.log10(), most.log10())
            };
            return Self::logarithmic(ends, tight, steps);
        }
        let ends = if values.is_empty() {
            (0.0, 1.0)
        } else {
            (least, most)
        };
        Self::linear(ends, tight, steps)
    }

    fn linear((mut lo, mut hi): (f64, f64), tight: bool, steps: f64) -> Self {
        let size = lo.abs().max(hi.abs());
        if hi - lo <= NARROWEST * size {
            let half = if size > 0.0 { 0.05 * size } else { 1.0 };
            (lo, hi) = (lo - half, hi + half);
        } else if !tight {
            let margin = 0.02 * (hi - lo);
            // What begins or ends at zero goes on doing so.
            let grown = |end: f64, margin: f64| if end == 0.0 { 0.0 } else { end + margin };
            (lo, hi) = rounded_range(grown(lo, -margin), grown(hi, margin), 1.5 * steps);
        }
        let size = lo.abs().max(hi.abs());
        let exponent = match size.log10().floor() as i32 {
            -2..=3 => 0,
            far => 3 * far.div_euclid(3),
        };
        let unit = 10_f64.powi(exponent);
        let numbers = Ticks::new(lo / unit, hi / unit, steps);
        let ticks = (numbers.values.iter())
            .map(|&value| Tick {
                part: ((value * unit - lo) / (hi - lo)) as f32,
                text: TickText::Number(numbers.label(value)),
            })
            .collect();
        Self {
            range: (lo, hi),
            logarithmic: false,
            exponent,
            ticks,
        }
    }

    /// `lo` and `hi` are decimal logarithms.
    fn logarithmic((mut lo, mut hi): (f64, f64), tight: bool, steps: f64) -> Self {
        if !tight {
            let margin = (0.02 * (hi - lo)).max(0.02);
            (lo, hi) = (lo - margin, hi + margin);
        } else if hi - lo < 0.04 {
            (lo, hi) = (lo - 0.02, hi + 0.02);
        }
        let at = |power: f64| ((power - lo) / (hi - lo)) as f32;
        let slack = 1e-9;
        let decades = (hi + slack).floor() - (lo - slack).ceil() + 1.0;
        let mut ticks = Vec::new();
        if decades >= 2.0 {
            let step = (decades / (steps + 1.0)).ceil() as i32;
            for power in lo.floor() as i32..=hi.ceil() as i32 {
                let exponent = f64::from(power);
                let major = power.rem_euclid(step) == 0;
                let text = if major {
                    TickText::Power(power)
                } else {
                    TickText::None
                };
                let minor = (2..10).filter(|_| step == 1);
                ticks.push((exponent, text));
                ticks.extend(minor.map(|digit| (exponent + f64::from(digit).log10(), TickText::None)));
            }
        } else {
            ticks = short_ticks((lo, hi), steps);
        }
        ticks.retain(|(power, _)| (lo - slack..=hi + slack).contains(power));
        Self {
            range: (lo, hi),
            logarithmic: true,
            exponent: 0,
            ticks: (ticks.into_iter())
                .map(|(power, text)| Tick {
                    part: at(power),
                    text,
                })
                .collect(),
        }
    }

    /// Puts ticks with numbers at these values instead, all of them positive if the axis is logarithmic.
    pub(super) fn set_ticks(&mut self, values: &[f64]) {
        let at = |value: &f64| Some((*value, self.part(*value)?));
        let ticks = values.iter().filter_map(at).map(|(value, part)| Tick {
            part,
            text: TickText::Number(value.to_string()),
        });
        self.ticks = ticks.collect();
    }

    /// Where a value lies between both ends, 0 to 1; none if it is not finite or has no logarithm.
    pub(super) fn part(&self, value: f64) -> Option<f32> {
        let value = if self.logarithmic { value.log10() } else { value };
        let (lo, hi) = self.range;
        value.is_finite().then(|| ((value - lo) / (hi - lo)) as f32)
    }

    /// Where zero lies, if it is well within a linear axis.
    pub(super) fn zero(&self) -> Option<f32> {
        let zero = -self.range.0 / (self.range.1 - self.range.0);
        (!self.logarithmic && zero > 1e-3 && zero < 0.999).then_some(zero as f32)
    }
}

/// Ticks of a logarithmic axis between these decimal logarithms that is too short for powers of ten alone.
fn short_ticks((lo, hi): (f64, f64), steps: f64) -> Vec<(f64, TickText)> {
    // What is far from one is written with a power of ten.
    if lo < -3.0 || hi > 4.0 {
        for digits in [&[1, 2, 5][..], &[1, 2, 3, 4, 5, 6, 7, 8, 9]] {
            let decades = lo.floor() as i32..=hi.floor() as i32;
            let ticks: Vec<(f64, TickText)> = decades
                .flat_map(|power| digits.iter().map(move |&digit| (digit, power)))
                .map(|(digit, power)| {
                    (
                        f64::from(power) + f64::from(digit).log10(),
                        TickText::Scaled(digit, power),
                    )
                })
                .filter(|(at, _)| (lo..=hi).contains(at))
                .collect();
            if ticks.len() > 2 {
                return ticks;
            }
        }
    }
    let numbers = Ticks::new(10_f64.powf(lo), 10_f64.powf(hi), steps);
    (numbers.values.iter())
        .filter(|value| **value > 0.0)
        .map(|&value| (value.log10(), TickText::Number(numbers.label(value))))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(axis: &Axis) -> Vec<TickText> {
        axis.ticks
            .iter()
            .map(|tick| tick.text.clone())
            .filter(|text| *text != TickText::None)
            .collect()
    }

    fn numbers(texts: &[&str]) -> Vec<TickText> {
        texts
            .iter()
            .map(|text| TickText::Number((*text).to_string()))
            .collect()
    }

    #[test]
    fn small_and_large_numbers_share_a_power_of_ten_that_is_a_multiple_of_three() {
        let small = Axis::new(&[0.0, 3.01e-6], false, true);
        assert_eq!(small.exponent, -6);
        assert_eq!(
            texts(&small),
            numbers(&["0.0", "0.5", "1.0", "1.5", "2.0", "2.5", "3.0"])
        );
        assert_eq!(Axis::new(&[0.0, 5e4], false, true).exponent, 3);
        assert_eq!(Axis::new(&[-0.02, 0.05], false, true).exponent, 0);
        assert_eq!(Axis::new(&[0.0, 900.0], false, true).exponent, 0);
    }

    #[test]
    fn a_long_logarithmic_axis_has_powers_of_ten_and_between_them_the_other_digits() {
        let axis = Axis::new(&[1e-8, 0.1], true, true);
        let powers: Vec<TickText> = (-8..=-1).map(TickText::Power).collect();
        assert_eq!(texts(&axis), powers);
        assert_eq!(axis.ticks.len(), 8 + 7 * 8);
        assert!((axis.part(1e-8).unwrap()).abs() < 1e-6 && (axis.part(0.1).unwrap() - 1.0).abs() < 1e-6);
        assert_eq!(axis.part(0.0), None);
    }

    #[test]
    fn a_short_logarithmic_axis_has_round_numbers() {
        let axis = Axis::new(&[0.5, 0.95], true, true);
        assert_eq!(texts(&axis)[0], TickText::Number("0.5".to_string()));
        assert!(texts(&axis).len() >= 4);
        let tiny = Axis::new(&[2.5e-16, 8.8e-15], true, true);
        let digits =
            [(5, -16), (1, -15), (2, -15), (5, -15)].map(|(digit, power)| TickText::Scaled(digit, power));
        assert_eq!(texts(&tiny), digits);
    }

    #[test]
    fn constant_missing_and_huge_values_still_make_an_axis() {
        for values in [&[][..], &[0.0], &[1.0 + 1e-15, 1.0], &[-3e300, 2e300], &[1e-300]] {
            let axis = Axis::new(values, false, false);
            assert!(axis.range.1 > axis.range.0 && axis.ticks.len() >= 2, "{values:?}");
            let inside = |value: &f64| (0.0..=1.0).contains(&axis.part(*value).unwrap());
            assert!(values.iter().all(inside), "{values:?}: {axis:?}");
        }
        assert!(Axis::new(&[], true, false).ticks.len() >= 2);
        assert!(Axis::new(&[7e-5], true, false).range.0 < Axis::new(&[7e-5], true, false).range.1);
    }
}
