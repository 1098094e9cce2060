//! Settings of a run of the suite, and what its cases have in common.

use super::{Case, Findings, Level};
use crate::checks::Check;
use crate::checks::suite::Context;
use std::fmt::Write;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::{Duration, Instant};
use turbid::case::{self, Setup};
use turbid::error::{Error, Result};
use turbid::output::numbers::duration;
use turbid::output::{OutputFiles, SeriesTable, Summary};
use turbid::simulation::{self, RunOptions};

const MISSING: &str = "built without LIGGGHTS; `cargo build --release --features liggghts` has it";

#[derive(Clone, Debug, Default)]
pub struct SuiteContext {
    /// Changes `KEY=VALUE` to all cases with a fluid, after those that the suite makes itself.
    pub changes: Vec<String>,
    pub threads: usize,
    /// Directory for runs of the full level, so that they can be resumed and need not be repeated.
    pub kept: Option<PathBuf>,
    /// Number of complete runs that were read from there.
    pub read: Arc<AtomicUsize>,
    pub stop: Arc<AtomicBool>,
    /// Time at which all must have stopped.
    pub deadline: Option<Instant>,
    #[cfg(test)]
    pub(super) fault: Option<super::tests::Fault>,
}

impl SuiteContext {
    /// Settings with these changes and number of cores; 0 takes all.
    pub fn new(changes: Vec<String>, threads: usize) -> Self {
        let all = || std::thread::available_parallelism().map_or(1, usize::from);
        Self { changes, threads: if threads == 0 { all() } else { threads }, ..Self::default() }
    }

    /// A case text with the changes that its module makes.
    pub(super) fn setup(&self, text: &str, name: &str, own: &[String]) -> Result<Setup> {
        let wet = text.lines().any(|line| line.trim() == "[fluid]");
        let given = if wet { self.changes.as_slice() } else { &[] };
        #[cfg_attr(not(test), allow(unused_mut))]
        let mut setup = case::from_text(text, name, &[own, given].concat())?;
        #[cfg(test)]
        if let Some(fault) = self.fault {
            fault.spoil(&mut setup);
        }
        Ok(setup)
    }
}

/// Numbers that a run has written.
pub(super) struct Written {
    pub(super) summary: Summary,
    pub(super) tables: Vec<SeriesTable>,
}

/// Runs a case to its end in a folder of its own, and reads its summary and these tables of statistics.
pub(super) fn written(setup: &Setup, threads: usize, names: &[&str]) -> Result<Written> {
    /// Parts of a case may run at the same time.
    static RUNS: AtomicUsize = AtomicUsize::new(0);
    let mut setup = setup.clone();
    let run = RUNS.fetch_add(1, Ordering::Relaxed);
    let name = format!("turbid_{}_{}_{run}", setup.provenance.name, std::process::id());
    let folder = std::env::temp_dir().join(name);
    setup.plan.output.directory.clone_from(&folder);
    setup.plan.threads = threads;
    let read = || {
        simulation::run(&setup, &RunOptions::default())?;
        let files = OutputFiles::new(&folder);
        let tables = names.iter().map(|name| SeriesTable::read(&files.table(name)));
        Ok(Written { tables: tables.collect::<Result<_>>()?, summary: Summary::read(&files.summary())? })
    };
    let outcome = read();
    // It is a copy of what was read.
    let _ = std::fs::remove_dir_all(&folder);
    outcome
}

impl Context for SuiteContext {
    fn threads(&self) -> usize {
        self.threads
    }

    fn is_over(&self, needs: Duration) -> bool {
        let late = self.deadline.is_some_and(|deadline| Instant::now() + needs >= deadline);
        late || self.stop.load(Ordering::Relaxed)
    }

    fn lacks(&self, case: &Case) -> Option<&'static str> {
        case.parts.is_empty().then_some(MISSING)
    }

    /// Checks that say no other source have that of the case; biases are noted.
    fn judge(&self, case: &Case, mut found: Findings) -> Findings {
        for check in found.checks.iter_mut().filter(|check| check.source.is_empty()) {
            check.source(case.source);
        }
        found.notes.extend(biases(&found.checks));
        found
    }
}

/// Mean signed deviations of the quantities that were checked at three points or more; a quantity is called the same up to the
/// first comma of its name.
fn biases(checks: &[Check]) -> Vec<(String, f64)> {
    let name = |check: &Check| check.quantity.split([',', '(']).next().unwrap_or_default().to_string();
    let mut groups: Vec<(String, Vec<Check>)> = Vec::new();
    for check in checks.iter().filter(|check| check.reference != 0.0) {
        match groups.iter_mut().find(|(known, _)| *known == name(check)) {
            Some((_, group)) => group.push(check.clone()),
            None => groups.push((name(check), vec![check.clone()])),
        }
    }
    let groups = groups.iter().filter(|(_, group)| group.len() > 2);
    let biases = groups.filter_map(|(name, group)| Check::bias(name.trim(), group, true));
    biases.map(|bias| (bias.quantity, bias.measured)).collect()
}

/// The cases: level, time, question and source of each; then the time of each level.
pub fn list(cases: &[Case]) -> String {
    let width = cases.iter().map(|case| case.name.len()).max().unwrap_or(0);
    let mut text = String::new();
    for case in cases {
        let [quick, full] = [Level::Quick, Level::Full].map(|level| case.seconds(level));
        let times = match case.level() {
            Level::Quick if full > quick => format!("quick, {}; full, {}", duration(quick), duration(full)),
            Level::Quick => format!("quick, {}", duration(quick)),
            Level::Full => format!("full, {}", duration(full)),
        };
        let _ = writeln!(text, "  {:width$}  {} ({times})", case.name, case.question);
        let _ = writeln!(text, "  {:width$}  {}", "", case.source);
        if case.parts.is_empty() {
            let _ = writeln!(text, "  {:width$}  not here: {MISSING}", "");
        }
    }
    let all = |level| duration(cases.iter().map(|case| case.seconds(level)).sum());
    let [quick, full] = [Level::Quick, Level::Full].map(all);
    let _ = writeln!(text, "times are of one core; together: quick, {quick}; full, {full}");
    text
}

/// Error of a case that has not become steady.
pub(super) fn unsteady(what: &str, value: f64) -> Error {
    Error::Input(format!("not steady at the end of the case: {what} {value}"))
}
