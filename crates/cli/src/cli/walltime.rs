//! Lengths of time as people and batch systems write them.

use std::time::Duration;

const FORMS: &str =
    "write seconds, 5400; or units, 1h30m, 90m, 45s, 2d; or hours, minutes and seconds, 01:30:00";

/// A length of time above zero: `5400`, `1h30m`, `01:30:00`, and with days `1d12h`.
pub(super) fn parse(text: &str) -> Result<Duration, String> {
    let seconds = match text.split(':').collect::<Vec<_>>()[..] {
        [hours, minutes, seconds] => on_the_clock([hours, minutes, seconds]),
        [number] if number.bytes().all(|b| b.is_ascii_digit()) => number.parse().ok(),
        [units] => in_units(units),
        _ => None,
    };
    match seconds {
        None => Err(FORMS.to_string()),
        Some(0) => Err(format!("no time to run in; {FORMS}")),
        Some(seconds) => Ok(Duration::from_secs(seconds)),
    }
}

/// Seconds of hours, minutes and seconds, each of the latter two below 60.
fn on_the_clock(parts: [&str; 3]) -> Option<u64> {
    let number = |part: &str| -> Option<u64> {
        let digits = !part.is_empty() && part.bytes().all(|b| b.is_ascii_digit());
        digits.then(|| part.parse().ok())?
    };
    let [hours, minutes, seconds] = parts.map(number);
    let (minutes, seconds) = (minutes.filter(|n| *n < 60)?, seconds.filter(|n| *n < 60)?);
    hours?.checked_mul(3600)?.checked_add(60 * minutes + seconds)
}

/// Seconds of numbers with units, from the largest to the smallest, each at most once.
fn in_units(text: &str) -> Option<u64> {
    let (mut rest, mut sum) = (text, 0_u64);
    for (unit, length) in [('d', 86400), ('h', 3600), ('m', 60), ('s', 1)] {
        let Some((number, after)) = rest.split_once(unit) else {
            continue;
        };
        let number = number.bytes().all(|b| b.is_ascii_digit()).then(|| number.parse::<u64>().ok())??;
        sum = number.checked_mul(length)?.checked_add(sum)?;
        rest = after;
    }
    rest.is_empty().then_some(sum)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_usual_ways_to_write_a_time_are_understood() {
        for (text, seconds) in [
            ("90", 90),
            ("45s", 45),
            ("30m", 1800),
            ("1h30m", 5400),
            ("2d1s", 172_801),
            ("01:30:00", 5400),
            ("100:00:05", 360_005),
        ] {
            assert_eq!(parse(text), Ok(Duration::from_secs(seconds)), "{text}");
        }
    }

    #[test]
    fn what_may_mean_two_things_or_nothing_is_refused_with_the_forms() {
        let bad = [
            "",
            "0",
            "0s",
            "-5",
            "1.5",
            "1:30",
            "30m1h",
            "1h1h",
            "h",
            "1h30",
            "1 h",
            "01:60:00",
            "1::2",
            "::",
            "5x",
            "99999999999999999999",
            "999999999999999999d",
        ];
        for text in bad {
            let said = parse(text).expect_err(text);
            assert!(said.contains("01:30:00"), "{text}: {said}");
        }
    }
}
