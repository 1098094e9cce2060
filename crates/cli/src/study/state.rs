//! How far each run of a study has come, from what is on disk.

use super::file::{BenchSection, StudyFile, ValueSection};
use super::plan::{Plan, PlannedRun};
use super::record::{BENCH_FILE, Record};
use serde_json::Value as Json;
use std::fs;
use std::path::{Path, PathBuf};
use turbid::case::Setup;
use turbid::checkpoint;
use turbid::comm::Comm;
use turbid::error::Result;
use turbid::input;
use turbid::output::OutputFiles;
use turbid::simulation::{identity, instruction_set};

/// Keys of a case that do not change what a study takes from a run.
const OF_NO_MATTER: [(&str, &str); 11] = [
    ("run", "threads"),
    ("run", "simd"),
    ("output", "directory"),
    ("output", "fields_every"),
    ("output", "particles_every"),
    ("output", "surfaces_every"),
    ("output", "contacts_every"),
    ("output", "picture_every"),
    ("output", "picture_plane"),
    ("output", "picture_range"),
    ("output", "checkpoint_every"),
];

/// Relative difference up to which two numbers of a summary are the same.
const SAME: f64 = 1e-9;

/// How far a run has come.
#[derive(Clone, Debug)]
pub enum State {
    /// To its end.
    Done(Box<Record>),
    /// To this step, from which it can go on.
    Part {
        /// Steps done.
        step: u64,
    },
    /// It has not begun.
    Open {
        /// Whether its directory holds the results of another run, which it will replace.
        replaces: bool,
    },
}

impl State {
    /// The record of a run that has ended.
    pub fn record(&self) -> Option<&Record> {
        match self {
            Self::Done(record) => Some(record),
            _ => None,
        }
    }
}

/// Results of runs, wherever they are.
pub struct Results<'a> {
    file: &'a StudyFile,
    bench: bool,
    /// Threads that are asked for instead of the case's.
    threads: Option<usize>,
    /// Keys that axes of the study set, which so matter.
    varied: Vec<String>,
    found: Vec<Found>,
}

/// The results of one run.
struct Found {
    directory: PathBuf,
    input: toml::Table,
    json: Json,
}

impl<'a> Results<'a> {
    /// Those that a study may use, in its own directory and in others.
    pub fn new(file: &'a StudyFile, directories: &[PathBuf], threads: Option<usize>) -> Self {
        let bench = file.bench.is_some();
        let varied = varied(file);
        let mut found = Vec::new();
        for directory in directories {
            let entries = fs::read_dir(directory).into_iter().flatten().flatten();
            let mut folders: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
            folders.sort();
            found.extend(folders.iter().filter_map(|folder| read(folder, bench, &varied)));
        }
        Self { file, bench, threads, varied, found }
    }

    /// How far a run has come whose directory is `directory`.
    ///
    /// # Errors
    /// Those of reading the results of a run that has ended.
    pub fn state(&self, run: &PlannedRun, directory: &Path) -> Result<State> {
        let wanted = canonical(&run.setup.provenance.text, &self.varied);
        let fits = |found: &&Found| {
            Some(&found.input) == wanted.as_ref()
                && is_of(&found.json, &run.setup)
                && self.is_measured_alike(&found.json, &run.setup)
        };
        let ended = |found: &&Found| self.bench || has_ended(&found.json, &run.setup);
        // Its own first.
        let mine = |found: &&Found| found.directory == directory;
        let known = self.found.iter().filter(fits);
        let done = (known.clone().filter(mine).chain(known)).find(ended);
        if let Some(found) = done {
            let record = if self.bench {
                Record::of_bench(&found.directory, &found.json)
            } else {
                let windows = self.file.windows.iter().map(|window| &window.value);
                Record::of_run(&found.directory, &found.json, &run.setup, windows)?
            };
            return Ok(State::Done(Box::new(record)));
        }
        let left = self.found.iter().find(mine);
        if !self.bench
            && left.is_none_or(|left| fits(&left))
            && let Some(step) = saved_step(directory, run, wanted.as_ref(), &self.varied)
        {
            return Ok(State::Part { step });
        }
        Ok(State::Open { replaces: left.is_some() || OutputFiles::new(directory).series().exists() })
    }

    /// Whether a benchmark was made as this study makes it; true of what is none.
    fn is_measured_alike(&self, found: &Json, setup: &Setup) -> bool {
        let Some(bench) = self.file.bench.as_ref().map(|bench| bench.value) else {
            return true;
        };
        let asked = measured_with(&bench, setup, self.threads);
        asked.as_object().into_iter().flatten().all(|(key, asked)| found.get(key) == Some(asked))
    }

    /// Of all runs of a plan.
    ///
    /// # Errors
    /// Those of [`state`](Self::state).
    pub fn states(&self, plan: &Plan, out: &Path) -> Result<Vec<State>> {
        let runs = plan.runs.iter();
        runs.map(|run| self.state(run, &out.join(&run.name))).collect()
    }
}

/// How a benchmark is made, apart from its case.
pub(super) fn measured_with(bench: &BenchSection, setup: &Setup, threads: Option<usize>) -> Json {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let threads = match threads.unwrap_or(setup.plan.threads) {
        0 => cores,
        threads => threads,
    };
    serde_json::json!({
        "steps": bench.steps,
        "warm_up": bench.warm_up(setup),
        "threads": threads,
        "simd": instruction_set(setup),
    })
}

/// Keys of the case that axes set.
fn varied(file: &StudyFile) -> Vec<String> {
    let mut keys = Vec::new();
    for axis in &file.axes {
        keys.extend(axis.value.key.iter().map(|key| key.value.clone()));
        for value in &axis.value.values {
            if let ValueSection::Named(named) = &value.value {
                keys.extend(named.set.keys().cloned());
            }
        }
    }
    keys
}

/// The results in a directory, if there are any.
fn read(directory: &Path, bench: bool, varied: &[String]) -> Option<Found> {
    let path = if bench { directory.join(BENCH_FILE) } else { OutputFiles::new(directory).summary() };
    let json: Json = serde_json::from_slice(&input::read(&path, input::RECORD).ok()?).ok()?;
    Some(Found {
        directory: directory.to_path_buf(),
        input: canonical(json["input"].as_str()?, varied)?,
        json,
    })
}

/// A case without what does not matter, unless the study varies it, and all numbers of one kind.
fn canonical(text: &str, varied: &[String]) -> Option<toml::Table> {
    let mut table: toml::Table = text.parse().ok()?;
    let matters = |section: &str, key: &str| {
        let name = format!("{section}.{key}");
        varied.iter().any(|set| *set == name || set.starts_with(&format!("{name}.")))
    };
    for (section, key) in OF_NO_MATTER.into_iter().filter(|(section, key)| !matters(section, key)) {
        if let Some(toml::Value::Table(section)) = table.get_mut(section) {
            section.remove(key);
        }
    }
    table.retain(|_, value| !value.as_table().is_some_and(toml::Table::is_empty));
    for (_, value) in &mut table {
        as_float(value);
    }
    Some(table)
}

fn as_float(value: &mut toml::Value) {
    match value {
        toml::Value::Integer(number) => *value = toml::Value::Float(*number as f64),
        toml::Value::Array(values) => values.iter_mut().for_each(as_float),
        toml::Value::Table(table) => table.iter_mut().for_each(|(_, value)| as_float(value)),
        _ => {}
    }
}

/// Whether a summary, as far as it tells, is of this set-up.
fn is_of(json: &Json, setup: &Setup) -> bool {
    let same = |known: &Json, wanted: &Json| match (known.as_f64(), wanted.as_f64()) {
        (Some(a), Some(b)) => (a - b).abs() <= SAME * b.abs(),
        _ => known == wanted,
    };
    let told = json.get("identity").unwrap_or(json);
    let wanted = identity(setup);
    let mut keys = wanted.as_object().into_iter().flatten();
    keys.all(|(key, wanted)| match told.get(key) {
        Some(known) => same(known, wanted),
        // What summaries of older versions do not tell.
        None => key == "setup_hash",
    })
}

fn has_ended(summary: &Json, setup: &Setup) -> bool {
    summary["interrupted"] == false && summary["steps"] == setup.plan.end_step
}

/// The step of the newest checkpoint of a run, if it is of this case, and this program makes the same of it.
fn saved_step(
    directory: &Path,
    run: &PlannedRun,
    wanted: Option<&toml::Table>,
    varied: &[String],
) -> Option<u64> {
    let folder = OutputFiles::new(directory).checkpoints();
    let (head, _) = checkpoint::newest_sound(&folder, &Comm::Solo, |saved| Ok(saved.head().clone())).ok()?;
    let resolved: Json = serde_json::from_str(&head.case.resolved).ok()?;
    let same = canonical(&head.case.text, varied).as_ref() == wanted && is_of(&resolved, &run.setup);
    same.then_some(head.step)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cases_that_differ_only_in_what_they_write_are_the_same() {
        let a = "[fluid]\narchimedes = 1000\n[run]\nend = { steps = 5 }\nthreads = 2\n[output]\npicture_every = \"never\"\n";
        let b = "[run]\nend.steps = 5\n# a comment\n[fluid]\narchimedes = 1000.0\n";
        let canonical = |text: &str| canonical(text, &[]);
        assert_eq!(canonical(a), canonical(b));
        assert_ne!(canonical(a), canonical(&a.replace("1000", "500")));
        let rows = a.replace("picture_every", "series_every");
        assert_ne!(canonical(a), canonical(&rows), "means depend on the rows");
    }

    #[test]
    fn a_key_that_an_axis_sets_matters_whatever_it_is() {
        let case = |threads: u32| format!("[run]\nend.steps = 5\nthreads = {threads}\n");
        let varied = ["run.threads".to_string()];
        assert_eq!(canonical(&case(1), &[]), canonical(&case(2), &[]));
        assert_ne!(canonical(&case(1), &varied), canonical(&case(2), &varied));
    }
}
