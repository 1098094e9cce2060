//! Numbers as they stand in tables, on the terminal and on pages.

/// A number with `digits` significant digits; a count as it is; a dash for what is not finite.
pub fn number(x: f64, digits: i32) -> String {
    match x {
        x if !x.is_finite() => "-".to_string(),
        x if x.abs() < 1e6 && x.fract() == 0.0 => format!("{x:.0}"),
        x if (1e-3..1e6).contains(&x.abs()) => significant(x, digits),
        x => format!("{x:.*e}", (digits - 1) as usize),
    }
}

/// A mean with its standard error: two digits of the error, and as many decimals of the mean, with one power of ten where the mean is small
/// or large; without an error four digits.
pub fn with_error(mean: Option<f64>, error: Option<f64>) -> String {
    match (mean, error) {
        (Some(mean), Some(error)) if error > 0.0 && error.is_finite() => {
            let usual = mean == 0.0 || (1e-3..1e6).contains(&mean.abs());
            let power = if usual { 0 } else { mean.abs().log10().floor() as i32 };
            let [mean, error] = [mean, error].map(|x| x / 10_f64.powi(power));
            let decimals = (1.0 - error.log10().floor()).clamp(0.0, 12.0) as usize;
            let text = format!("{mean:.decimals$} \u{b1} {error:.decimals$}");
            if usual { text } else { format!("({text})e{power}") }
        }
        (mean, _) => number(mean.unwrap_or(f64::NAN), 4),
    }
}

/// A time (s) in the unit that suits it.
pub fn duration(seconds: f64) -> String {
    match seconds {
        s if !s.is_finite() => "-".to_string(),
        s if s < 60.0 => format!("{} s", number(s, 4)),
        s if s < 5400.0 => format!("{} min", significant(s / 60.0, 2)),
        s => format!("{} h", significant(s / 3600.0, 2)),
    }
}

/// A difference or a tolerance with two significant digits.
pub fn small(value: f64) -> String {
    match value {
        x if x.is_nan() => "-".to_string(),
        0.0 => "0".to_string(),
        x if x.is_infinite() => "none".to_string(),
        x if (0.1..1000.0).contains(&x.abs()) => significant(x, 2),
        x => format!("{x:.1e}"),
    }
}

/// A number from a thousandth to a million with `digits` significant digits.
pub fn significant(value: f64, digits: i32) -> String {
    // The exponent of the number after rounding.
    let rounded = format!("{value:.*e}", (digits - 1) as usize);
    let exponent = rounded.split('e').nth(1).and_then(|text| text.parse::<i32>().ok());
    let before = exponent.unwrap_or(0) + 1;
    format!("{value:.*}", (digits - before).max(0) as usize)
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
        assert_eq!(with_error(Some(1.23456e-8), Some(3.1e-10)), "(1.235 \u{b1} 0.031)e-8");
        assert_eq!(with_error(Some(-2.5e7), Some(4e5)), "(-2.500 \u{b1} 0.040)e7");
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
            assert_eq!(number(x, 4), text);
        }
        assert_eq!([duration(12.345), duration(600.0), duration(9000.0)], ["12.35 s", "10 min", "2.5 h"]);
    }
}
