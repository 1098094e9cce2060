//! Names of quantities as text in several styles.

use crate::text::{Span, above, below, italic, roman};

/// A name with its indices, exponents and symbols.
///
/// `^` raises the word behind it (letters, digits, a sign before), and `_` lowers it behind a symbol. A symbol is a single
/// letter outside of parentheses, but for the article, the name of a Greek one (`phi`), or a characteristic number (`Re`); a star
/// right behind it is raised. What follows a number is its unit, unless it is the diameter D. A hyphen between blanks is a minus.
pub(crate) fn spans(text: &str) -> Vec<Span> {
    styled(text, true)
}

/// Names of Greek letters.
const GREEK: [(&str, &str); 9] = [
    ("delta", "\u{3b4}"),
    ("eta", "\u{3b7}"),
    ("mu", "\u{b5}"),
    ("nu", "\u{3bd}"),
    ("omega", "\u{3c9}"),
    ("phi", "\u{3c6}"),
    ("rho", "\u{3c1}"),
    ("sigma", "\u{3c3}"),
    ("tau", "\u{3c4}"),
];

/// Characteristic numbers.
const NUMBERS: [&str; 4] = ["Ar", "Ga", "Re", "St"];

fn styled(text: &str, symbols: bool) -> Vec<Span> {
    let mut spans = Vec::new();
    let mut rest = text;
    let mut depth = 0_i32;
    // Whether the word before may have an index: a single letter, or a symbol.
    let mut letter = false;
    // Whether this is the unit of the number before.
    let mut unit = false;
    let mut before = ' ';
    while let Some(first) = rest.chars().next() {
        let taken = match first {
            '_' | '^' if (first == '^' || letter) && script(&rest[1..]) > 0 => {
                let length = script(&rest[1..]);
                let word = rest[1..=length].replace('-', "\u{2212}");
                spans.push(if first == '_' { below(word) } else { above(word) });
                letter = false;
                1 + length
            }
            '*' if letter && symbols && !rest[1..].starts_with(char::is_alphanumeric) => {
                spans.push(above("*"));
                1
            }
            ' ' if rest.starts_with(" - ") => {
                spans.push(roman(" \u{2212} "));
                letter = false;
                3
            }
            first if first.is_alphabetic() => {
                let length = rest.find(|c: char| !c.is_alphabetic()).unwrap_or(rest.len());
                let word = rest[..length].to_string();
                let greek = GREEK.iter().find(|(name, _)| symbols && *name == word);
                let number = symbols && NUMBERS.contains(&word.as_str());
                letter = word.chars().count() == 1 || greek.is_some() || number;
                unit |= before.is_ascii_digit() && greek.is_none() && !number && word != "D";
                let symbol = number || (symbols && depth == 0 && letter && !unit && word != "a");
                spans.push(match greek {
                    Some((_, letter)) => italic(*letter),
                    None if symbol => italic(word),
                    None => roman(word),
                });
                length
            }
            other => {
                letter = false;
                depth += i32::from(other == '(') - i32::from(other == ')');
                spans.push(roman(other.to_string()));
                other.len_utf8()
            }
        };
        unit &= !rest.starts_with([' ', ',']);
        if let Some(last) = rest[..taken].trim_end().chars().last() {
            before = last;
        }
        rest = &rest[taken..];
    }
    spans
}

/// Length of the word at the beginning that is lowered or raised.
fn script(text: &str) -> usize {
    let sign = usize::from(text.starts_with(['-', '+']));
    let word = text[sign..].find(|c: char| !c.is_alphanumeric()).unwrap_or(text.len() - sign);
    if word == 0 { 0 } else { sign + word }
}

/// The name of an axis whose numbers are to be multiplied by `10^exponent` of the unit in parentheses at its end.
pub(crate) fn axis_name(text: &str, exponent: i32) -> Vec<Span> {
    let text = text.trim_end();
    let (name, unit) = match text.strip_suffix(')').and_then(|text| text.rsplit_once('(')) {
        Some((name, unit)) => (name.trim_end(), unit.trim()),
        None => (text, ""),
    };
    let unit = match unit {
        "-" => String::new(),
        "um" | "us" | "uN" | "uJ" => unit.replace('u', "\u{b5}"),
        unit => unit.to_string(),
    };
    let mut name = spans(name);
    if exponent == 0 && unit.is_empty() {
        return name;
    }
    name.push(roman(" ("));
    if exponent != 0 {
        name.extend(power_of_ten(exponent));
        if !unit.is_empty() {
            name.push(roman(" "));
        }
    }
    name.extend(styled(&unit, false));
    name.push(roman(")"));
    name
}

/// `10` with an exponent.
pub(crate) fn power_of_ten(exponent: i32) -> [Span; 2] {
    [roman("10"), above(exponent.to_string().replace('-', "\u{2212}"))]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Text in which indices stand in `[]`, exponents in `{}`, and symbols in `<>`.
    fn written(spans: &[Span]) -> String {
        let mut text = String::new();
        for span in spans {
            let Span { text: word, italic, rise } = span;
            let [open, close] = match *rise {
                _ if *italic => ["<", ">"],
                rise if rise < 0.0 => ["[", "]"],
                rise if rise > 0.0 => ["{", "}"],
                _ => ["", ""],
            };
            text.extend([open, word, close]);
        }
        text
    }

    #[test]
    fn indices_exponents_and_symbols_are_set_as_such_and_words_are_not() {
        assert_eq!(written(&spans("force F / F_Hertz")), "force <F> / <F>[Hertz]");
        assert_eq!(written(&spans("height of a sphere, z^2 - 1")), "height of a sphere, <z>{2} \u{2212} 1");
        assert_eq!(written(&spans("at 1 m/s, e = 0.5")), "at 1 m/s, <e> = 0.5");
        assert_eq!(written(&spans("along / mu")), "along / <\u{b5}>");
        assert_eq!(written(&spans("hunt_crossley, T_0")), "hunt_crossley, <T>[0]");
        assert_eq!(
            written(&spans("phi, t* = t u_Stokes / D, tau_0, Re_p")),
            "<\u{3c6}>, <t>{*} = <t> <u>[Stokes] / <D>, <\u{3c4}>[0], <Re>[p]"
        );
        assert_eq!(written(&spans("a*b, 8 D, 5 N")), "a*<b>, 8 <D>, 5 N");
        assert_eq!(written(&spans("10^-3 _ ^")), "10{\u{2212}3} _ ^");
    }

    #[test]
    fn the_power_of_ten_of_the_numbers_stands_before_the_unit() {
        assert_eq!(written(&axis_name("time t (s)", -6)), "time <t> (10{\u{2212}6} s)");
        assert_eq!(written(&axis_name("acceleration (m/s^2)", 0)), "acceleration (m/s{2})");
        assert_eq!(written(&axis_name("time (us)", 0)), "time (\u{b5}s)");
        assert_eq!(written(&axis_name("d / R (-)", 0)), "<d> / <R>");
        assert_eq!(written(&axis_name("d / R (-)", -3)), "<d> / <R> (10{\u{2212}3})");
    }
}
