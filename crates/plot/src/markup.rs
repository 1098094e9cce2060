//! Names of quantities as text in several styles.

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Span {
    pub(crate) text: String,
    pub(crate) italic: bool,
    /// Rise over the font size: positive for a superscript.
    pub(crate) rise: f32,
}

/// Between these a text is set as it is: the isolates of Unicode.
const LITERAL: [char; 2] = ['\u{2068}', '\u{2069}'];

/// A text that is set as it is, without symbols: a name that a user has given.
pub fn literal(text: &str) -> String {
    // Words stay apart, so that lines can break between them.
    let [open, close] = LITERAL;
    let words: Vec<String> = text.split(' ').map(|word| format!("{open}{word}{close}")).collect();
    words.join(" ")
}

/// A text without its markup of [literal] parts.
pub(crate) fn bare(text: &str) -> String {
    text.replace(LITERAL, "")
}

const SUBSCRIPT: f32 = -0.22;
const SUPERSCRIPT: f32 = 0.32;

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

/// A text with its indices, exponents and symbols.
///
/// `^` raises the word after it (letters, digits, a sign before), and `_` after a symbol lowers it. A symbol is a single
/// letter outside of parentheses, but for the article, the name of a Greek one (`phi`), or a characteristic number (`Re`); a star
/// right after it is raised; a [literal] is none of this. What follows a number is its unit, unless it is the diameter D. A hyphen between blanks is a minus.
pub(crate) fn spans(text: &str) -> Vec<Span> {
    let mut spans = Vec::new();
    let mut push = |text: &str, italic, rise| spans.push(Span { text: text.to_string(), italic, rise });
    let mut rest = text;
    let mut depth = 0_i32;
    // True if the word before may have an index: a single letter, or a symbol.
    let mut letter = false;
    // True if this is the unit of the number before.
    let mut unit = false;
    let mut before = ' ';
    while let Some(first) = rest.chars().next() {
        let taken = match first {
            open if open == LITERAL[0] => {
                let word = &rest[open.len_utf8()..];
                let length = word.find(LITERAL[1]).unwrap_or(word.len());
                push(&word[..length], false, 0.0);
                letter = false;
                (open.len_utf8() + length + LITERAL[1].len_utf8()).min(rest.len())
            }
            '_' | '^' if (first == '^' || letter) && script(&rest[1..]) > 0 => {
                let length = script(&rest[1..]);
                let rise = if first == '_' { SUBSCRIPT } else { SUPERSCRIPT };
                push(&rest[1..=length].replace('-', "\u{2212}"), false, rise);
                letter = false;
                1 + length
            }
            '*' if letter && !rest[1..].starts_with(char::is_alphanumeric) => {
                push("*", false, SUPERSCRIPT);
                1
            }
            ' ' if rest.starts_with(" - ") => {
                push(" \u{2212} ", false, 0.0);
                letter = false;
                3
            }
            first if first.is_alphabetic() => {
                let length = rest.find(|c: char| !c.is_alphabetic()).unwrap_or(rest.len());
                let word = &rest[..length];
                let greek = GREEK.iter().find(|(name, _)| *name == word);
                let named = greek.is_some() || NUMBERS.contains(&word);
                letter = named || word.chars().count() == 1;
                unit |= before.is_ascii_digit() && !named && word != "D";
                let symbol = named || (letter && depth == 0 && !unit && word != "a");
                push(greek.map_or(word, |(_, letter)| letter), symbol, 0.0);
                length
            }
            other => {
                letter = false;
                depth += i32::from(other == '(') - i32::from(other == ')');
                push(other.encode_utf8(&mut [0; 4]), false, 0.0);
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

/// The label of an axis whose numbers are to be multiplied by `10^exponent` of the unit in parentheses at its end. No-break
/// spaces join the unit to the word before it.
pub(crate) fn axis_label(label: &str, exponent: i32) -> String {
    let label = label.trim_end();
    let (name, unit) = match label.strip_suffix(')').and_then(|label| label.rsplit_once('(')) {
        Some((name, unit)) => (name.trim_end(), unit.trim()),
        None => (label, ""),
    };
    let unit = match unit {
        "-" => String::new(),
        "um" | "us" | "uN" | "uJ" => unit.replace('u', "\u{b5}"),
        unit => unit.replace(' ', "\u{a0}"),
    };
    match (exponent, &*unit) {
        (0, "") => name.to_string(),
        (0, unit) => format!("{name}\u{a0}({unit})"),
        (power, "") => format!("{name}\u{a0}(10^{power})"),
        (power, unit) => format!("{name}\u{a0}(10^{power}\u{a0}{unit})"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Text in which indices stand in `[]`, exponents in `{}`, and symbols in `<>`.
    fn written(text: &str) -> String {
        let mut written = String::new();
        for Span { text, italic, rise } in spans(text) {
            let [open, close] = match rise {
                _ if italic => ["<", ">"],
                rise if rise < 0.0 => ["[", "]"],
                rise if rise > 0.0 => ["{", "}"],
                _ => ["", ""],
            };
            written.extend([open, &text, close]);
        }
        written
    }

    #[test]
    fn indices_exponents_and_symbols_are_set_as_such_and_words_are_not() {
        for (text, expected) in [
            ("force F / F_Hertz", "force <F> / <F>[Hertz]"),
            ("height of a sphere, z^2 - 1", "height of a sphere, <z>{2} \u{2212} 1"),
            ("at 1 m/s, e = 0.5", "at 1 m/s, <e> = 0.5"),
            ("along / mu", "along / <\u{b5}>"),
            ("hunt_crossley, T_0", "hunt_crossley, <T>[0]"),
            (
                "phi, t* = t u_Stokes / D, tau_0, Re_p",
                "<\u{3c6}>, <t>{*} = <t> <u>[Stokes] / <D>, <\u{3c4}>[0], <Re>[p]",
            ),
            ("a*b, 8 D, 5 N", "a*<b>, 8 <D>, 5 N"),
            ("10^-3 _ ^", "10{\u{2212}3} _ ^"),
        ] {
            assert_eq!(written(text), expected);
        }
    }

    #[test]
    fn a_literal_text_has_no_symbols_and_may_break_between_its_words() {
        for name in ["b", "e_05", "mu_a", "z_ x^2"] {
            assert_eq!(written(&literal(name)), name);
            assert_eq!(bare(&literal(name)), name);
        }
        assert_eq!(written(&format!("{}: speed u", literal("a_b"))), "a_b: speed <u>");
    }

    #[test]
    fn the_power_of_ten_of_the_numbers_stands_before_the_unit() {
        let label = |label, exponent| written(&axis_label(label, exponent)).replace('\u{a0}', " ");
        assert_eq!(label("time t (s)", -6), "time <t> (10{\u{2212}6} s)");
        assert_eq!(label("acceleration (m/s^2)", 0), "acceleration (m/s{2})");
        assert_eq!(label("time (us)", 0), "time (\u{b5}s)");
        assert_eq!(label("d / R (-)", 0), "<d> / <R>");
        assert_eq!(label("d / R (-)", -3), "<d> / <R> (10{\u{2212}3})");
    }
}
