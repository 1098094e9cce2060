//! Ticks at round numbers.

use super::text::{roman, width};

/// Round numbers along an axis, and how to print them.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Ticks {
    /// Distance between ticks: 1, 2 or 5 times a power of ten.
    pub(super) step: f64,
    /// Places of the ticks, ascending.
    pub(super) values: Vec<f64>,
    decimals: usize,
}

impl Ticks {
    /// At most `count` steps over `lo..=hi`.
    pub(super) fn new(lo: f64, hi: f64, count: f64) -> Self {
        let raw = (hi - lo).max(f64::MIN_POSITIVE) / count;
        let decade = 10_f64.powf(raw.log10().floor());
        let factor = [1.0, 2.0, 5.0]
            .into_iter()
            .find(|f| f * decade >= raw * (1.0 - 1e-9));
        let step = factor.unwrap_or(10.0) * decade;
        let slack = 1e-6;
        let (first, last) = (
            (lo / step - slack).ceil() as i64,
            (hi / step + slack).floor() as i64,
        );
        Self {
            step,
            values: (first..=last).map(|i| i as f64 * step).collect(),
            decimals: (-(step.log10() + 1e-9).floor()).max(0.0) as usize,
        }
    }

    /// Width of the widest label in pixels.
    pub(super) fn widest(&self, size: f32) -> f32 {
        self.values
            .iter()
            .map(|&value| width(&[roman(self.label(value))], size))
            .fold(0.0, f32::max)
    }

    /// The number at a tick, with as many decimals as the step needs.
    pub(super) fn label(&self, value: f64) -> String {
        let text = format!("{value:.*}", self.decimals);
        // A proper minus sign, and none before zero.
        match text.strip_prefix('-') {
            Some(rest) if rest.bytes().all(|b| b == b'0' || b == b'.') => rest.to_string(),
            Some(rest) => format!("\u{2212}{rest}"),
            None => text,
        }
    }
}

/// `lo..=hi` grown to the next ticks outside.
pub(super) fn rounded_range(lo: f64, hi: f64, count: f64) -> (f64, f64) {
    let step = Ticks::new(lo, hi, count).step;
    (
        (lo / step + 1e-6).floor() * step,
        (hi / step - 1e-6).ceil() * step,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(lo: f64, hi: f64) -> Vec<String> {
        let ticks = Ticks::new(lo, hi, 6.0);
        ticks.values.iter().map(|&v| ticks.label(v)).collect()
    }

    #[test]
    fn ticks_are_round_and_labelled_with_just_enough_decimals() {
        assert_eq!(labels(0.0, 1.0), ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(labels(0.0, 150.0), ["0", "50", "100", "150"]);
        assert_eq!(
            labels(-0.03, 0.02),
            [
                "\u{2212}0.03",
                "\u{2212}0.02",
                "\u{2212}0.01",
                "0.00",
                "0.01",
                "0.02"
            ]
        );
    }

    #[test]
    fn a_range_grows_to_whole_ticks_and_keeps_one_that_is_already_there() {
        let close = |(a, b): (f64, f64), (c, d): (f64, f64)| (a - c).abs() < 1e-12 && (b - d).abs() < 1e-12;
        assert!(close(rounded_range(0.013, 0.27, 6.0), (0.0, 0.3)));
        assert!(close(rounded_range(0.0, 1.0, 6.0), (0.0, 1.0)));
    }
}
