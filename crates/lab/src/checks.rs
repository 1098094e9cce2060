//! Numbers against their references, as `validate`, `crosscheck` and `study` have them in common.
//!
//! A [`Check`] is one number with its reference, tolerance and verdict. The [`Findings`] of a case are several of them, with
//! plots; an [`Outcome`] is a case after its run, a [`Score`] the count over all cases. Tables on the terminal, CSV, JSON and
//! markdown are written in one form each.
//!
//! A check with an infinite tolerance is only reported: it neither passes nor fails.

mod figure;
mod files;
pub mod suite;
mod tables;

pub use figure::{Figure, measured, overlaid, reference};
pub use files::{csv, json, prepare, read_csv, write_bars, write_json, write_plots, write_tables};
use serde::ser::SerializeStruct;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::Value as Json;
use std::sync::Arc;
pub use tables::{aligned, bold_failure, cells, markdown, markdown_table, one_line, summary, table};
use turbid::error::{Error, Result};
use turbid::particle::{Particle, Template};

/// Relative difference up to which two numbers of a file are the same.
const SAME: f64 = 1e-9;

/// Returns whether a value that a file has is the one of this program.
pub fn is_same(known: &Json, wanted: &Json) -> bool {
    match (known.as_f64(), wanted.as_f64()) {
        (Some(a), Some(b)) => (a - b).abs() <= SAME * b.abs(),
        _ => known == wanted,
    }
}

/// Name of an engine that the native one is compared with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EngineName {
    pub id: &'static str,
    /// In tables and plots.
    pub label: &'static str,
}

/// One number against its reference.
///
/// Keys of its JSON and heads of its CSV, both stable: `case` (left out where there is none), `quantity`, `measured`,
/// `reference`, `tolerance`, `pass`, `source`; one that compares engines has `native`, `other` and `analytic` beside them. Numbers that
/// are not finite are `null` in JSON.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Check {
    #[serde(default)]
    pub case: String,
    /// Name of the quantity, with its unit.
    pub quantity: String,
    /// Measured value; NaN if there is none.
    #[serde(deserialize_with = "or_nan")]
    pub measured: f64,
    /// Expected value in the same unit; NaN if there is none.
    #[serde(deserialize_with = "or_nan")]
    pub reference: f64,
    /// Largest admissible distance of the two, in their unit; infinite for a number that is only reported.
    #[serde(deserialize_with = "or_infinite")]
    pub tolerance: f64,
    pub pass: bool,
    /// Source of the reference (author, year, DOI), or kind of the difference with the reason for its tolerance.
    pub source: String,
    /// Values of the native engine, of the other engine and of theory, if it compares the engines; `measured` is then the difference
    /// that counts, absolute or relative as `source` says, and `reference` zero, or the difference that is known.
    #[serde(skip)]
    pub engines: Option<[Option<f64>; 3]>,
}

fn or_nan<'de, D: Deserializer<'de>>(from: D) -> std::result::Result<f64, D::Error> {
    Ok(Option::deserialize(from)?.unwrap_or(f64::NAN))
}

fn or_infinite<'de, D: Deserializer<'de>>(from: D) -> std::result::Result<f64, D::Error> {
    Ok(Option::deserialize(from)?.unwrap_or(f64::INFINITY))
}

impl Check {
    /// Compares a number with its reference; NaN fails.
    pub fn new(
        quantity: impl Into<String>,
        measured: f64,
        reference: f64,
        tolerance: f64,
        source: impl Into<String>,
    ) -> Self {
        Self {
            case: String::new(),
            quantity: quantity.into(),
            measured,
            reference,
            tolerance,
            pass: (measured - reference).abs() <= tolerance,
            source: source.into(),
            engines: None,
        }
    }

    /// A check that cannot be made, and so fails.
    pub fn failed(quantity: impl Into<String>, source: impl Into<String>) -> Self {
        Self::new(quantity, f64::NAN, f64::NAN, 0.0, source)
    }

    /// The mean of `(measured - reference) / |reference|` over several checks of one quantity, or of `measured - reference` if
    /// `relative` is false: it shows a bias, which a two-sided tolerance of each point cannot. Only reported; `None` for fewer
    /// than two points with both numbers.
    pub fn bias(label: &str, checks: &[Self], relative: bool) -> Option<Self> {
        let unit = |reference: f64| if relative { reference.abs() } else { 1.0 };
        let off = checks.iter().map(|check| (check.measured - check.reference) / unit(check.reference));
        let off: Vec<f64> = off.filter(|off| off.is_finite()).collect();
        let count = off.len();
        let part = if relative { " (part of the reference)" } else { "" };
        let quantity = format!("{label}, mean signed deviation of {count} points{part}");
        let mean = off.iter().sum::<f64>() / count as f64;
        let source = "reported only: a bias of all points to one side";
        (count > 1).then(|| Self::new(quantity, mean, 0.0, f64::INFINITY, source))
    }

    pub fn source(&mut self, source: &str) {
        self.source = source.to_string();
    }

    pub fn is_reported(&self) -> bool {
        self.pass && self.tolerance.is_infinite()
    }

    pub fn verdict(&self) -> &'static str {
        match (self.pass, self.is_reported()) {
            (_, true) => "reported",
            (true, false) => "ok",
            (false, false) => "FAIL",
        }
    }
}

impl Serialize for Check {
    fn serialize<S: Serializer>(&self, serializer: S) -> std::result::Result<S::Ok, S::Error> {
        let mut row = serializer.serialize_struct("Check", 10)?;
        if !self.case.is_empty() {
            row.serialize_field("case", &self.case)?;
        }
        row.serialize_field("quantity", &self.quantity)?;
        row.serialize_field("measured", &self.measured)?;
        row.serialize_field("reference", &self.reference)?;
        row.serialize_field("tolerance", &self.tolerance)?;
        row.serialize_field("pass", &self.pass)?;
        row.serialize_field("source", &self.source)?;
        if let Some([native, other, analytic]) = &self.engines {
            row.serialize_field("native", native)?;
            row.serialize_field("other", other)?;
            row.serialize_field("analytic", analytic)?;
        }
        row.end()
    }
}

/// Particles of both engines at one time, for VTK.
#[derive(Clone, Debug)]
pub struct Moment {
    pub time: f64,
    /// Native, then the other engine.
    pub particles: [Vec<Particle>; 2],
    pub templates: Arc<[Template]>,
}

#[derive(Clone, Debug, Default)]
pub struct Findings {
    /// Numbers that have a reference.
    pub checks: Vec<Check>,
    /// Numbers that belong to the result but have none.
    pub notes: Vec<(String, f64)>,
    pub figures: Vec<Figure>,
    /// Trajectories of both engines, in ascending time; may be empty.
    pub moments: Vec<Moment>,
}

impl Findings {
    pub fn push(&mut self, check: Check) -> &mut Check {
        self.checks.push(check);
        self.checks.last_mut().expect("it was added")
    }

    /// Holds a number against its reference; the tolerance is in the unit of both.
    pub fn absolute(
        &mut self,
        quantity: impl Into<String>,
        measured: f64,
        reference: f64,
        tolerance: f64,
    ) -> &mut Check {
        self.push(Check::new(quantity, measured, reference, tolerance, ""))
    }

    /// Holds a number against its reference; the tolerance is a part of the reference.
    pub fn relative(
        &mut self,
        quantity: impl Into<String>,
        measured: f64,
        reference: f64,
        part: f64,
    ) -> &mut Check {
        self.absolute(quantity, measured, reference, part * reference.abs())
    }

    /// Takes what another part found.
    pub fn append(&mut self, other: Self) {
        self.checks.extend(other.checks);
        self.notes.extend(other.notes);
        self.figures.extend(other.figures);
        self.moments.extend(other.moments);
    }

    pub fn note(&mut self, quantity: impl Into<String>, value: f64) {
        self.notes.push((quantity.into(), value));
    }
}

/// The end of a case.
#[derive(Debug)]
pub enum Ending {
    Found(Findings),
    Failed(Error),
    /// By a signal or a time limit.
    Stopped,
    /// This program cannot run it; why.
    Missing(String),
}

impl From<Result<Findings>> for Ending {
    /// A case without a check has failed.
    fn from(result: Result<Findings>) -> Self {
        match result {
            Ok(found) if found.checks.is_empty() => {
                Self::Failed(Error::Input("the case checked nothing".to_string()))
            }
            Ok(found) => Self::Found(found),
            Err(Error::Interrupted) => Self::Stopped,
            Err(Error::Unsupported { what, .. }) => Self::Missing(format!("no support for {what}")),
            Err(error) => Self::Failed(error),
        }
    }
}

/// A case after its run.
#[derive(Debug)]
pub struct Outcome {
    pub case: String,
    pub title: String,
    /// The engine with which it compares the native one, if it does, which decides the columns of its checks.
    pub engine: Option<EngineName>,
    pub seconds: f64,
    pub ending: Ending,
}

impl Outcome {
    /// With this name and title of the case; its checks get the name.
    pub fn new(
        case: &str,
        title: &str,
        engine: Option<EngineName>,
        seconds: f64,
        mut ending: Ending,
    ) -> Self {
        if let Ending::Found(found) = &mut ending {
            for check in &mut found.checks {
                check.case = case.to_string();
            }
        }
        Self { case: case.to_string(), title: title.to_string(), engine, seconds, ending }
    }

    /// Its checks; a case that failed has one that fails.
    pub fn checks(&self) -> Vec<Check> {
        match &self.ending {
            Ending::Found(found) => found.checks.clone(),
            Ending::Failed(error) => {
                let failed = Check::failed("completes", error.to_string());
                let (case, engines) = (self.case.clone(), self.engine.map(|_| [None; 3]));
                vec![Check { case, engines, ..failed }]
            }
            Ending::Stopped | Ending::Missing(_) => Vec::new(),
        }
    }
}

pub fn all(outcomes: &[Outcome]) -> Vec<Check> {
    outcomes.iter().flat_map(Outcome::checks).collect()
}

/// Of the checks with a tolerance: how many passed, how many there are, and the largest part of a tolerance that one of them uses; `None`
/// if there are none.
pub fn judged<'a>(checks: impl IntoIterator<Item = &'a Check>) -> Option<(usize, usize, f64)> {
    let judged: Vec<&Check> = checks.into_iter().filter(|check| check.tolerance.is_finite()).collect();
    let part = |check: &&Check| match (check.measured - check.reference).abs() {
        0.0 => 0.0,
        off => off / check.tolerance,
    };
    let passed = judged.iter().filter(|check| check.pass).count();
    (!judged.is_empty()).then(|| (passed, judged.len(), judged.iter().map(part).fold(0.0, f64::max)))
}

/// Numbers of checks and cases by their results.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Score {
    pub passed: usize,
    pub checks: usize,
    pub reported: usize,
    /// Cases that this program cannot run.
    pub missing: usize,
    /// Cases that were stopped.
    pub interrupted: usize,
}

impl Score {
    pub fn of_checks(checks: &[Check]) -> Self {
        let count = |verdict| checks.iter().filter(|check| check.verdict() == verdict).count();
        let (passed, reported) = (count("ok"), count("reported"));
        Self { passed, checks: checks.len() - reported, reported, ..Self::default() }
    }

    pub fn of(outcomes: &[Outcome]) -> Self {
        let count = |is: fn(&Ending) -> bool| outcomes.iter().filter(|outcome| is(&outcome.ending)).count();
        Self {
            missing: count(|ending| matches!(ending, Ending::Missing(_))),
            interrupted: count(|ending| matches!(ending, Ending::Stopped)),
            ..Self::of_checks(&all(outcomes))
        }
    }

    pub fn is_full(&self) -> bool {
        self.passed == self.checks
    }
}

impl std::fmt::Display for Score {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "{} of {} checks passed", self.passed, self.checks)
    }
}

#[cfg(test)]
mod tests;
