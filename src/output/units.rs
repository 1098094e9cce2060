//! Units of the arrays of a file for VTK, in its field data: the array `units` has a text `name: unit` for each of them.

use std::fmt::Write;

/// Name and unit of a head `name (unit)`; without a unit it is `-`.
pub(super) fn split(head: &str) -> (&str, &str) {
    head.strip_suffix(')').and_then(|head| head.rsplit_once(" (")).unwrap_or((head, "-"))
}

/// Field data with the elements `more`, and the units of arrays with these names. VTK writes a text as the codes of its bytes and a zero.
pub(super) fn field_data<'a>(more: &str, arrays: impl IntoIterator<Item = (&'a str, &'a str)>) -> String {
    let (mut codes, mut count) = (String::new(), 0);
    for (name, unit) in arrays {
        for byte in format!("{name}: {unit}\0").bytes() {
            write!(codes, "{byte} ").expect("memory takes any text");
        }
        codes.push('\n');
        count += 1;
    }
    format!(
        "<FieldData>\n{more}<Array type=\"String\" Name=\"units\" NumberOfTuples=\"{count}\" format=\"ascii\">\n{codes}</Array>\n\
         </FieldData>\n"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_head_without_a_unit_is_a_number() {
        assert_eq!(split("speed (m/s)"), ("speed", "m/s"));
        assert_eq!(split("id"), ("id", "-"));
    }

    #[test]
    fn every_array_is_a_text_that_ends_with_a_zero() {
        let element = field_data("", [("t", "s"), ("v", "m")]);
        assert!(element.contains("NumberOfTuples=\"2\""));
        assert!(element.contains(">\n116 58 32 115 0 \n118 58 32 109 0 \n<"), "{element}");
    }
}
