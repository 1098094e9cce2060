//! What a cross-check says: a table to read, CSV and JSON for programs, plots and trajectories.

mod files;
mod table;

use super::{Check, Findings};
use crate::error::{Error, Result};
pub(in crate::crosscheck) use files::sphere;
pub use files::{prepare, write_case, write_json, write_series, write_tables};
use serde::Serialize;
use std::time::Instant;
pub use table::{summary, table};

/// A case after its run.
#[derive(Debug)]
pub struct Outcome {
    /// Id of the case.
    pub case: &'static str,
    /// What it shows, one line.
    pub title: String,
    /// How long it took (s).
    pub seconds: f64,
    /// What it found, or why it did not come to its end.
    pub result: Result<Findings>,
}

impl Outcome {
    /// Runs a case. One that checks nothing has failed.
    pub fn of(case: &'static str, title: &str, run: impl FnOnce() -> Result<Findings>) -> Self {
        let start = Instant::now();
        let result = match run() {
            Ok(found) if found.checks.is_empty() => Err(Error::Input("the case checked nothing".to_string())),
            result => result,
        };
        Self {
            case,
            title: title.to_string(),
            seconds: start.elapsed().as_secs_f64(),
            result,
        }
    }

    /// One row for each check; a case that did not come to its end has one that fails.
    pub fn rows(&self) -> Vec<Row> {
        match &self.result {
            Ok(found) => found.checks.iter().map(Row::of).collect(),
            Err(error) => vec![Row {
                case: self.case,
                quantity: "comes to its end".to_string(),
                native: None,
                liggghts: None,
                analytic: None,
                difference: f64::NAN,
                tolerance: 0.0,
                reason: error.to_string(),
                pass: false,
            }],
        }
    }
}

/// One number of both engines, as it is written; the keys are stable. What is not finite becomes `null` in JSON.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// Id of the case.
    pub case: &'static str,
    /// What is compared, with its unit.
    pub quantity: String,
    /// Of the native engine.
    pub native: Option<f64>,
    /// Of LIGGGHTS.
    pub liggghts: Option<f64>,
    /// What theory says.
    pub analytic: Option<f64>,
    /// What is held against the tolerance.
    pub difference: f64,
    /// Largest admissible difference; infinite for what is only reported.
    pub tolerance: f64,
    /// Which difference, and why this tolerance; or why there is no number.
    pub reason: String,
    /// Whether the difference is within the tolerance.
    pub pass: bool,
}

impl Row {
    fn of(check: &Check) -> Self {
        Self {
            case: check.case,
            quantity: check.quantity.clone(),
            native: check.native,
            liggghts: check.liggghts,
            analytic: check.analytic,
            difference: check.difference,
            tolerance: check.tolerance,
            reason: check.reason.to_string(),
            // A difference that is no number is within nothing.
            pass: check.pass && check.difference <= check.tolerance,
        }
    }
}

/// How the checks of all cases came out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Score {
    /// Checks that passed.
    pub passed: usize,
    /// All checks.
    pub checks: usize,
    /// Numbers without a tolerance.
    pub reported: usize,
}

impl Score {
    /// Counts the rows of all cases.
    pub fn of(outcomes: &[Outcome]) -> Self {
        let mut score = Self::default();
        for row in outcomes.iter().flat_map(Outcome::rows) {
            if row.pass && row.tolerance.is_infinite() {
                score.reported += 1;
            } else {
                score.checks += 1;
                score.passed += usize::from(row.pass);
            }
        }
        score
    }

    /// Whether every check passed.
    pub fn is_full(&self) -> bool {
        self.passed == self.checks
    }
}

#[cfg(test)]
mod tests;
