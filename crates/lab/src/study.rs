//! Parameter studies: many runs of one case, and their evaluation.
//!
//! ```text
//! study.toml --(plan)--> runs --(state)--> done, part or open --(execute)--> DIR/<run>/summary.json, series.csv
//!                                            |
//!                                         (record) numbers by name
//!                                            |
//!                  DIR/result.csv <---(collect)---> DIR/study.json: figures, tables, checks
//! ```
//!
//! A finished run with the same case is not repeated, wherever among the directories of the study it is; one that has left
//! checkpoints is resumed. So a study may be stopped at any time, and the same command resumes it; at most the time since the
//! last checkpoint is lost.

mod check;
mod convergence;
pub mod document;
mod execute;
mod figure;
pub mod file;
mod hindrance;
mod plan;
mod points;
pub mod record;
mod reference;
mod refuse;
pub mod state;
mod table;

use document::Document;
pub use document::{DEFINITIONS as RESULT_DEFINITIONS, result_columns};
pub use execute::{Admit, Event, execute};
use file::StudyFile;
use plan::Plan;
use record::Record;
use state::State;
use std::cell::OnceCell;
use std::path::{Path, PathBuf};
use turbid::document::Source;
use turbid::error::Result;
use turbid::simulation::{seconds_of_files, time_estimate};

/// Names that most files use.
mod prelude {
    pub(super) use super::Study;
    pub(super) use super::convergence::Convergence;
    pub(super) use super::document::{Figure, Table};
    pub(super) use super::file::*;
    pub(super) use super::plan::{PlannedRun, combinations};
    pub(super) use super::points::{At, Known};
    pub(super) use super::record::{BENCH_FILE, Quantity, Record, SHARE};
    pub(super) use super::state::State;
    pub(super) use crate::checks::Check;
    pub(super) use serde_json::Value as Json;
    pub(super) use std::collections::{BTreeMap, BTreeSet};
    pub(super) use std::fs;
    pub(super) use std::ops::Range;
    pub(super) use std::path::{Path, PathBuf};
    pub(super) use turbid::case::{self, Setup};
    pub(super) use turbid::document::{Located, Source, nearest};
    pub(super) use turbid::error::{Error, Result};
    pub(super) use turbid::input;
    pub(super) use turbid::output::{OutputFiles, directory, write_bytes};
    pub(super) use turbid::simulation::{self, Law, Suspension, identity};
    pub(super) use turbid_plot::{Point, Series, Style};
}

/// Samples of a benchmark.
const SAMPLES: u64 = 5;

pub struct Study {
    pub file: StudyFile,
    /// Path of the file as the user gave it.
    pub path: PathBuf,
    pub case: PathBuf,
    pub out: PathBuf,
    pub plan: Plan,
    pub states: Vec<State>,
    /// Threads that are requested instead of the case's.
    pub threads: Option<usize>,
    /// Seconds that each whole run takes by the cost model, evaluated on demand.
    estimates: Vec<OnceCell<f64>>,
}

impl Study {
    /// Reads a study file and looks for results of its runs. `threads` replaces the number of the case.
    ///
    /// # Errors
    /// [`Error::Input`](turbid::error::Error::Input) with the position of a mistake in the study file or in the case;
    /// [`Error::Io`](turbid::error::Error::Io) if a file cannot be read.
    pub fn load(path: &Path, out: Option<&Path>, threads: Option<usize>) -> Result<Self> {
        let source = Source::read(path, &[])?;
        let file = source.parse::<StudyFile>()?;
        let case = path.parent().unwrap_or(Path::new("")).join(&file.case.value);
        if !case.is_file() {
            let title = format!("there is no case {}", case.display());
            let remedy = "name it relative to the study file";
            return Err(source.error(&file.case.span, &title, "no such file", remedy));
        }
        let plan = Plan::new(source, &file, &case)?;
        let mut study = Self {
            path: path.to_path_buf(),
            case,
            out: out.map_or_else(|| default_directory(path), Path::to_path_buf),
            states: Vec::new(),
            threads,
            estimates: vec![OnceCell::new(); plan.runs.len()],
            file,
            plan,
        };
        study.refuse_mistakes()?;
        study.refresh()?;
        // Finds mistakes in figures, tables and checks before anything runs.
        study.document()?;
        Ok(study)
    }

    fn window_quantities(&self) -> impl Iterator<Item = String> {
        self.file.windows.iter().map(|window| window.value.quantity())
    }

    /// Looks for results of the runs again; an error if they cannot be read.
    pub fn refresh(&mut self) -> Result<()> {
        self.states = self.progress()?;
        Ok(())
    }

    pub fn steps(&self, run: usize) -> u64 {
        let setup = &self.plan.runs[run].setup;
        match &self.file.bench {
            Some(bench) => SAMPLES * bench.value.steps + bench.value.warm_up(setup),
            None => setup.plan.end_step,
        }
    }

    /// The command that repeats the study.
    fn command(&self) -> String {
        let command = format!("turbid study {}", self.path.display());
        if self.out == default_directory(&self.path) {
            return command;
        }
        format!("{command} --out {}", self.out.display())
    }

    /// Seconds that a whole run takes by the cost model.
    fn estimate(&self, run: usize) -> f64 {
        *self.estimates[run].get_or_init(|| {
            let mut setup = self.plan.runs[run].setup.clone();
            setup.plan.threads = self.threads.unwrap_or(setup.plan.threads);
            // An impossible run is refused where it begins.
            let step = time_estimate(&setup).map_or(0.0, |estimate| estimate.seconds_per_step);
            let files = if self.file.bench.is_some() { 0.0 } else { seconds_of_files(&setup) };
            self.steps(run) as f64 * step + files
        })
    }

    /// Measured over estimated time of the finished runs, if there are any.
    pub fn measured_over_estimated(&self) -> Option<f64> {
        let (mut measured, mut estimated) = (0.0, 0.0);
        for (run, state) in self.states.iter().enumerate() {
            if let Some(time) = state.record().and_then(|record| record.value("wall_seconds")) {
                measured += time;
                estimated += self.estimate(run);
            }
        }
        (measured > 0.0 && estimated > 0.0).then(|| measured / estimated)
    }

    /// Estimated time (s) of the rest of a run; none without a fluid.
    pub fn seconds_left(&self, run: usize) -> Option<f64> {
        let setup = &self.plan.runs[run].setup;
        setup.fluid.as_ref()?;
        let part = match self.states[run] {
            State::Done(_) => return Some(0.0),
            State::Part { step } => 1.0 - step as f64 / setup.plan.end_step as f64,
            State::Open { .. } => 1.0,
        };
        Some(part * self.estimate(run) * self.measured_over_estimated().unwrap_or(1.0))
    }

    pub fn collect(&self) -> Result<()> {
        document::write_csv(self)?;
        self.document()?.write(&self.out)
    }

    /// The present results; an error if a figure, table or check is wrong.
    pub fn document(&self) -> Result<Document> {
        let figures = self.file.figures.iter().map(|figure| self.figure(figure)).collect::<Result<_>>()?;
        let tables = self.file.tables.iter().map(|table| self.table(table));
        let mut tables = tables.collect::<Result<Vec<_>>>()?;
        let mut checks = Vec::new();
        for section in &self.file.checks {
            let (found, of_checks) = self.check(section)?;
            checks.extend(found);
            for mut table in of_checks {
                let stem = |name: &str| name.trim_end_matches(char::is_numeric) == table.name;
                let known = tables.iter().filter(|known| stem(&known.name)).count();
                if known > 0 {
                    table.name = format!("{}{}", table.name, known + 1);
                }
                tables.push(table);
            }
        }
        let done = self.states.iter().filter_map(State::record);
        let unsettled = (0..self.states.len()).filter(|&run| self.is_unsettled(run));
        Ok(Document {
            title: self.file.title.clone(),
            version: env!("CARGO_PKG_VERSION").to_string(),
            command: self.command(),
            figures,
            tables,
            checks,
            runs: document::Runs {
                done: done.clone().count(),
                total: self.states.len(),
                seconds_spent: done.filter_map(|record| record.value("wall_seconds")).sum(),
                seconds_left: (0..self.states.len()).filter_map(|run| self.seconds_left(run)).sum(),
            },
            unsettled: unsettled.map(|run| self.plan.runs[run].name.clone()).collect(),
        })
    }

    /// Returns whether a run is finished with means that have not settled.
    fn is_unsettled(&self, run: usize) -> bool {
        self.states[run].record().and_then(Record::is_settled) == Some(false)
    }
}

/// `out/<folder of the file>/<name of the file>`, so that studies of one folder lie beside each other.
fn default_directory(path: &Path) -> PathBuf {
    let folder = std::path::absolute(path).ok();
    let folder = folder.as_deref().and_then(Path::parent).and_then(Path::file_name);
    let name = path.file_stem().unwrap_or("study".as_ref());
    Path::new("out").join(folder.unwrap_or_default()).join(name)
}

#[cfg(test)]
mod tests;
