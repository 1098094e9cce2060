//! Parameter studies: many runs of one case, and what they say together.
//!
//! ```text
//! study.toml --(plan)--> runs --(state)--> done, part or open --(execute)--> DIR/<run>/summary.json, series.csv
//!                                            |
//!                                         (record) numbers by name
//!                                            |
//!                  DIR/result.csv <---(collect)---> DIR/study.json: figures, tables, checks
//! ```
//!
//! A run that has ended with the same case is not repeated, wherever among the directories of the study it is; one that has left
//! checkpoints goes on from there. So a study may be stopped at any time, and the same command goes on. One that is killed loses
//! no more than the time since the last checkpoint.

mod check;
mod convergence;
pub mod document;
mod execute;
mod figure;
pub mod file;
pub mod plan;
mod points;
pub mod record;
mod reference;
mod refuse;
pub(crate) mod result;
pub mod state;
mod table;

pub use document::Document;
pub use execute::{Event, Manner, Outcome, execute};
use file::{Choice, StudyFile};
use plan::{Plan, Selection};
use record::Record;
use state::{Results, State};
use std::cell::OnceCell;
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};
use turbid::case::Source;
use turbid::case::located::Located;
use turbid::error::Result;
use turbid::simulation::time_estimate;

/// Samples of a benchmark.
const SAMPLES: u64 = 5;

/// A study: what it asks for, and how far it has come.
pub struct Study {
    /// What its file says.
    pub file: StudyFile,
    /// Path of the file as the user gave it.
    pub path: PathBuf,
    /// Its case.
    pub case: PathBuf,
    /// Where its results are.
    pub out: PathBuf,
    /// Its runs.
    pub plan: Plan,
    /// How far each run has come.
    pub states: Vec<State>,
    /// Threads that are asked for instead of the case's.
    pub threads: Option<usize>,
    source: Source,
    /// Seconds that each whole run takes by the cost model, once somebody wants to know.
    estimates: Vec<OnceCell<f64>>,
}

impl Study {
    /// Reads a study file and looks at what is there of its runs. `threads` stand in place of the case's.
    ///
    /// # Errors
    /// [`Error::Input`](turbid::error::Error::Input) with the place of what is wrong in the study file or in the case; [`Error::Io`](turbid::error::Error::Io) if a file cannot be read.
    pub fn load(path: &Path, out: Option<&Path>, threads: Option<usize>) -> Result<Self> {
        let source = Source::read(path, &[])?;
        let file = source.parse::<StudyFile>()?;
        let folder = path.parent().unwrap_or(Path::new(""));
        let case = folder.join(&file.case.value);
        if !case.is_file() {
            let title = format!("there is no case {}", case.display());
            let remedy = "name it relative to the study file";
            return Err(source.error(&file.case.span, &title, "no such file", remedy));
        }
        let plan = Plan::new(&source, &file, &case)?;
        if let Some(bench) = &file.bench
            && bench.value.steps == 0
        {
            return Err(source.error(&bench.span, "a benchmark of no steps", "here", "e.g. steps = 100"));
        }
        let out = out.map_or_else(|| default_directory(path), Path::to_path_buf);
        let mut study = Self {
            file,
            path: path.to_path_buf(),
            case,
            out,
            states: Vec::new(),
            threads,
            source,
            estimates: vec![OnceCell::new(); plan.runs.len()],
            plan,
        };
        study.refuse_what_means_nothing()?;
        study.refresh()?;
        // Says what is wrong with figures, tables and checks before anything runs.
        study.document()?;
        Ok(study)
    }

    /// A mistake in the study file, with its place and a remedy.
    fn refuse<T>(&self, span: &Range<usize>, title: &str, label: &str, remedy: &str) -> Result<T> {
        Err(self.source.error(span, title, label, remedy))
    }

    /// The places of axes with these names.
    fn axes(&self, names: &[Located<String>]) -> Result<Vec<usize>> {
        names.iter().map(|name| self.axis(name)).collect()
    }

    /// The place of an axis.
    fn axis(&self, name: &Located<String>) -> Result<usize> {
        self.plan.axis(&self.source, name)
    }

    /// The combinations that have these values.
    fn selection(&self, span: &Range<usize>, only: &BTreeMap<String, Choice>) -> Result<Selection> {
        self.plan.selection(&self.source, span, only)
    }

    /// Looks again at what is there of the runs.
    ///
    /// # Errors
    /// [`Error::Io`](turbid::error::Error::Io) or [`Error::Input`](turbid::error::Error::Input) if results that are there cannot be read.
    pub fn refresh(&mut self) -> Result<()> {
        let beside = self.out.parent().unwrap_or(Path::new(""));
        let mut directories = vec![self.out.clone()];
        directories.extend(self.file.shares.iter().map(|name| beside.join(&name.value)));
        let results = Results::new(&self.file, &directories, self.threads);
        self.states = results.states(&self.plan, &self.out)?;
        Ok(())
    }

    /// Steps of a run.
    pub fn steps(&self, run: usize) -> u64 {
        match self.file.bench.as_ref().map(|bench| bench.value) {
            Some(bench) => SAMPLES * bench.steps + bench.warm_up(&self.plan.runs[run].setup),
            None => self.plan.runs[run].setup.plan.end_step,
        }
    }

    /// Seconds that a whole run takes by the cost model.
    fn estimate(&self, run: usize) -> f64 {
        *self.estimates[run].get_or_init(|| {
            let mut setup = self.plan.runs[run].setup.clone();
            setup.plan.threads = self.threads.unwrap_or(setup.plan.threads);
            // A run that cannot be is refused where it begins.
            let step = time_estimate(&setup).map_or(0.0, |estimate| estimate.seconds_per_step);
            self.steps(run) as f64 * step
        })
    }

    /// Time of the runs that have ended over what the cost model says of them; none before there is one.
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

    /// Time (s) that what is left of a run will take; none without a fluid.
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

    /// Writes `result.csv` and `study.json`.
    ///
    /// # Errors
    /// [`Error::Io`](turbid::error::Error::Io) if they cannot be written; [`Error::Input`](turbid::error::Error::Input) if a figure, table or check is wrong.
    pub fn collect(&self) -> Result<Document> {
        result::write_csv(self)?;
        let document = self.document()?;
        document.write(&self.out)?;
        Ok(document)
    }

    /// What is known so far.
    ///
    /// # Errors
    /// [`Error::Input`](turbid::error::Error::Input) if a figure, table or check is wrong.
    pub fn document(&self) -> Result<Document> {
        let done = self.states.iter().filter_map(State::record);
        let spent = done.clone().filter_map(|record| record.value("wall_seconds"));
        let left = (0..self.states.len()).filter_map(|run| self.seconds_left(run));
        let figures = self.file.figures.iter().map(|figure| self.figure(figure));
        let figures = figures.collect::<Result<Vec<_>>>()?;
        let tables = self.file.tables.iter().map(|table| self.table(table));
        let mut tables = tables.collect::<Result<Vec<_>>>()?;
        let mut checks = Vec::new();
        for section in &self.file.checks {
            let (found, of_checks) = self.check(section)?;
            checks.extend(found);
            for mut table in of_checks {
                let same =
                    |known: &&document::Table| known.name.trim_end_matches(char::is_numeric) == table.name;
                let known = tables.iter().filter(same).count();
                if known > 0 {
                    table.name = format!("{}{}", table.name, known + 1);
                }
                tables.push(table);
            }
        }
        Ok(Document {
            title: self.file.title.value.clone(),
            version: env!("CARGO_PKG_VERSION").to_string(),
            command: format!("turbid study {}", self.path.display()),
            figures,
            tables,
            checks,
            runs: document::Runs {
                done: done.count(),
                total: self.states.len(),
                seconds_spent: spent.sum(),
                seconds_left: left.sum(),
            },
            unsettled: (self.plan.runs.iter().enumerate())
                .filter(|(run, _)| self.is_unsettled(*run))
                .map(|(_, run)| run.name.clone())
                .collect(),
        })
    }

    /// Whether a run has ended with means that have not settled.
    fn is_unsettled(&self, run: usize) -> bool {
        self.states[run].record().and_then(Record::is_settled) == Some(false)
    }
}

/// `out/<folder of the file>/<name of the file>`, so that studies of one folder lie beside each other.
fn default_directory(path: &Path) -> PathBuf {
    let name = path.file_stem().map_or_else(|| "study".into(), PathBuf::from);
    let folder = std::path::absolute(path).ok();
    let folder = folder.as_deref().and_then(Path::parent).and_then(Path::file_name);
    match folder {
        Some(folder) => Path::new("out").join(folder).join(name),
        None => Path::new("out").join(name),
    }
}

#[cfg(test)]
mod tests;
