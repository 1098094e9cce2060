//! Numbers and times as they stand in tables.

use crate::output::numbers::significant;

/// Four significant digits; a count as it is; a dash for what is not finite.
pub(super) fn number(x: f64) -> String {
    match x {
        x if !x.is_finite() => "-".to_string(),
        x if x.fract() == 0.0 && x.abs() < 1e6 => format!("{x:.0}"),
        x if (1e-3..1e5).contains(&x.abs()) => significant(x, 4),
        x => format!("{x:.3e}"),
    }
}

/// [`number`], or a dash.
pub(super) fn known(x: Option<f64>) -> String {
    number(x.unwrap_or(f64::NAN))
}

/// A mean with its standard error: two digits of the error, and as many decimals of the mean.
pub(super) fn with_error(mean: Option<f64>, error: Option<f64>) -> String {
    match (mean, error) {
        (Some(mean), Some(error)) if error > 0.0 && error.is_finite() => {
            let decimals = (1.0 - error.log10().floor()).clamp(0.0, 12.0) as usize;
            format!("{mean:.decimals$} \u{b1} {error:.decimals$}")
        }
        (mean, _) => known(mean),
    }
}

/// A time in the unit that suits it.
pub(super) fn duration(seconds: f64) -> String {
    match seconds {
        s if !s.is_finite() => "-".to_string(),
        s if s < 60.0 => format!("{} s", number(s)),
        s if s < 5400.0 => format!("{} min", significant(s / 60.0, 2)),
        s => format!("{} h", significant(s / 3600.0, 2)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mean_has_as_many_decimals_as_its_error_and_the_error_two_digits() {
        assert_eq!(with_error(Some(0.163472), Some(0.00127)), "0.1635 \u{b1} 0.0013");
        assert_eq!(with_error(Some(1234.5), Some(31.0)), "1234 \u{b1} 31");
        assert_eq!(with_error(Some(0.163472), None), "0.1635");
        assert_eq!(with_error(Some(2.5), Some(0.0)), "2.500");
        assert_eq!(with_error(None, Some(1.0)), "-");
    }

    #[test]
    fn numbers_of_any_size_are_short() {
        for (x, text) in [
            (0.0, "0"),
            (196.0, "196"),
            (1.5e-3, "0.001500"),
            (8.7249e-6, "8.725e-6"),
            (-2e9, "-2.000e9"),
            (f64::NAN, "-"),
        ] {
            assert_eq!(number(x), text);
        }
        assert_eq!(
            [duration(12.345), duration(600.0), duration(9000.0)],
            ["12.35 s", "10 min", "2.5 h"]
        );
    }
}
