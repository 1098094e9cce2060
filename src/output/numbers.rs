//! Numbers as they stand in tables on the terminal.

/// A value with eight significant digits; a count as it is; a dash for none.
pub fn value(value: Option<f64>) -> String {
    match value {
        None => "-".to_string(),
        // Counts.
        Some(x) if x.abs() < 1e6 && x.fract() == 0.0 => format!("{x:.0}"),
        Some(x) if (1e-3..1e6).contains(&x.abs()) => significant(x, 8),
        Some(x) => format!("{x:.6e}"),
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

/// A number from a thousandth to a million with so many significant digits.
pub fn significant(value: f64, digits: i32) -> String {
    // The exponent of the number after rounding.
    let rounded = format!("{value:.*e}", (digits - 1) as usize);
    let exponent = rounded
        .split('e')
        .nth(1)
        .and_then(|text| text.parse::<i32>().ok());
    let before = exponent.unwrap_or(0) + 1;
    format!("{value:.*}", (digits - before).max(0) as usize)
}
