//! Choice of cases of a suite.

use turbid::document::nearest;
use turbid::error::{Error, Result};

/// Indices of the cases with these names, each once and in the order of the suite; of all if none is named.
pub(super) fn chosen(known: &[&str], names: &[String]) -> Result<Vec<usize>> {
    if let Some(name) = names.iter().find(|name| !known.contains(&name.as_str())) {
        let remedy = nearest(name, known).map_or(String::new(), |near| format!("did you mean `{near}`? "));
        return Err(Error::Input(format!(
            "there is no case `{name}` in the suite\n  {remedy}known here: {}",
            known.join(", ")
        )));
    }
    let named = |index: &usize| names.is_empty() || names.iter().any(|name| name == known[*index]);
    Ok((0..known.len()).filter(named).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    const KNOWN: [&str; 3] = ["sliding", "spin", "static-pair"];

    #[test]
    fn a_misspelt_case_is_an_error_that_names_the_nearest_and_all_others() {
        let error = |name: &str| chosen(&KNOWN, &[name.to_string()]).expect_err("no such case");
        let text = error("slidign").to_string();
        assert_eq!(error("slidign").exit_code(), 2);
        assert!(text.contains("did you mean `sliding`?") && text.contains("known here: "), "{text}");
        assert!(!error("qqqq").to_string().contains("did you mean"));
    }

    #[test]
    fn without_a_name_all_cases_run_and_a_case_named_twice_runs_once() {
        assert_eq!(chosen(&KNOWN, &[]).unwrap(), [0, 1, 2]);
        let twice = ["spin".to_string(), "spin".to_string()];
        assert_eq!(chosen(&KNOWN, &twice).unwrap(), [1]);
    }
}
