//! Progress of each run of a study, from the files on disk.

use super::prelude::*;
use crate::checks::is_same;
use turbid::case::free_keys;
use turbid::simulation::{instruction_set, saved_head};

#[derive(Clone, Debug)]
pub enum State {
    Done(Box<Record>),
    /// It can be resumed from this step.
    Part {
        step: u64,
    },
    Open {
        /// True if its directory holds the results of another run, which it will replace.
        replaces: bool,
    },
}

impl State {
    pub fn record(&self) -> Option<&Record> {
        match self {
            Self::Done(record) => Some(record),
            _ => None,
        }
    }
}

struct Found {
    directory: PathBuf,
    input: toml::Table,
    json: Json,
}

impl Study {
    /// Progress of all runs, by their own directories and those of the studies whose runs may be used.
    pub(super) fn progress(&self) -> Result<Vec<State>> {
        let beside = self.out.parent().unwrap_or(Path::new(""));
        let shares = self.file.shares.iter().map(|name| beside.join(&name.value));
        let varied = varied(&self.file);
        let mut found = Vec::new();
        for directory in [self.out.clone()].into_iter().chain(shares) {
            let entries = fs::read_dir(directory).into_iter().flatten().flatten();
            let mut folders: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
            folders.sort();
            found.extend(folders.into_iter().filter_map(|folder| self.found(folder, &varied)));
        }
        self.plan.runs.iter().map(|run| self.state(run, &found, &varied)).collect()
    }

    fn found(&self, directory: PathBuf, varied: &[String]) -> Option<Found> {
        let path = match self.file.bench {
            Some(_) => directory.join(BENCH_FILE),
            None => OutputFiles::new(&directory).summary(),
        };
        let json: Json = serde_json::from_slice(&input::read(&path, input::RECORD).ok()?).ok()?;
        Some(Found { directory, input: canonical(json["input"].as_str()?, varied)?, json })
    }

    fn state(&self, run: &PlannedRun, found: &[Found], varied: &[String]) -> Result<State> {
        let (setup, directory) = (&run.setup, self.out.join(&run.name));
        let wanted = canonical(&setup.provenance.text, varied);
        let bench = self.file.bench.as_ref().map(|bench| measured_with(&bench.value, setup, self.threads));
        let is_measured_alike = |json: &Json| {
            let mut wanted = bench.iter().filter_map(Json::as_object).flatten();
            wanted.all(|(key, wanted)| json.get(key) == Some(wanted))
        };
        let fits = |Found { input, json, .. }: &Found| {
            Some(input) == wanted.as_ref() && is_of(json, setup) && is_measured_alike(json)
        };
        let is_finished = |Found { json, .. }: &Found| {
            bench.is_some()
                || json["interrupted"] == false
                    && (json["steady"] == true || json["steps"] == setup.plan.end_step)
        };
        let own = found.iter().find(|found| found.directory == directory);
        if let Some(found) = own.into_iter().chain(found).find(|found| fits(found) && is_finished(found)) {
            let record = match bench {
                Some(_) => Record::of_bench(&found.directory, &found.json),
                None => Record::of_run(&found.directory, &found.json, setup, &self.file.windows)?,
            };
            return Ok(State::Done(Box::new(record)));
        }
        if bench.is_none()
            && own.is_none_or(fits)
            && let Some(step) = saved_step(&directory, setup, wanted.as_ref(), varied)
        {
            return Ok(State::Part { step });
        }
        Ok(State::Open { replaces: own.is_some() || OutputFiles::new(&directory).series().exists() })
    }
}

/// The step of the newest checkpoint of a run, if it is of this case, and this program makes the same of it.
fn saved_step(
    directory: &Path,
    setup: &Setup,
    wanted: Option<&toml::Table>,
    varied: &[String],
) -> Option<u64> {
    let head = saved_head(directory).ok()?;
    let resolved: Json = serde_json::from_str(&head.case.resolved).ok()?;
    let same = canonical(&head.case.text, varied).as_ref() == wanted && is_of(&resolved, setup);
    same.then_some(head.step)
}

/// Conditions of a benchmark, apart from its case.
pub(super) fn measured_with(bench: &BenchSection, setup: &Setup, threads: Option<usize>) -> Json {
    let threads = match threads.unwrap_or(setup.plan.threads) {
        0 => std::thread::available_parallelism().map_or(1, usize::from),
        threads => threads,
    };
    serde_json::json!({
        "steps": bench.steps,
        "warm_up": bench.warm_up(setup),
        "threads": threads,
        "simd": instruction_set(setup),
    })
}

fn varied(file: &StudyFile) -> Vec<String> {
    let mut keys = Vec::new();
    for axis in &file.axes {
        keys.extend(axis.value.key.clone());
        for value in &axis.value.values {
            if let ValueSection::Named(named) = &value.value {
                keys.extend(named.set.keys().cloned());
            }
        }
    }
    keys
}

/// A case without [keys](free_keys) that do not change its results, unless the study varies them, and all numbers of one kind.
fn canonical(text: &str, varied: &[String]) -> Option<toml::Table> {
    let mut table: toml::Table = text.parse().ok()?;
    for [section, key] in free_keys() {
        let name = format!("{section}.{key}");
        let is_varied = |set: &String| *set == name || set.starts_with(&format!("{name}."));
        if let Some(toml::Value::Table(section)) = table.get_mut(section)
            && !varied.iter().any(is_varied)
        {
            section.remove(key);
        }
    }
    table.retain(|_, value| !value.as_table().is_some_and(toml::Table::is_empty));
    table.iter_mut().for_each(|(_, value)| as_float(value));
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

/// Returns whether a summary is of this set-up, by the keys that it has.
fn is_of(json: &Json, setup: &Setup) -> bool {
    let stored = json.get("identity").unwrap_or(json);
    let wanted = identity(setup);
    // A summary has the coupling by its present name, an identity by the name that identities were first made with.
    let coupling = setup.fluid.as_ref().map(|fluid| fluid.coupling.name());
    let mut keys = wanted.as_object().into_iter().flatten();
    keys.all(|(key, wanted)| match stored.get(key) {
        Some(known) if key == "coupling" => known == wanted || known.as_str() == coupling,
        Some(known) => is_same(known, wanted),
        // Summaries of older versions lack it.
        None => key == "setup_hash",
    })
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
    fn keys_are_free_where_the_case_file_marks_them() {
        let names: Vec<String> = free_keys().iter().map(|key| key.join(".")).collect();
        let outputs = [
            "average",
            "checkpoint_at_end",
            "checkpoint_every",
            "contacts_every",
            "directory",
            "dynamics",
            "fields_every",
        ];
        let more = [
            "particles_every",
            "paths",
            "picture_every",
            "pictures",
            "profiles",
            "profiles_every",
            "structure",
            "surfaces_every",
            "wear_every",
        ];
        let outputs = outputs.iter().chain(&more).map(|key| format!("output.{key}"));
        let run = ["device", "load_balancing", "simd", "threads"].map(|key| format!("run.{key}"));
        assert_eq!(names, outputs.chain(run).collect::<Vec<_>>());
        assert!(!turbid::case::schema().contains("x-free"));
    }

    #[test]
    fn a_key_that_an_axis_sets_matters_whatever_it_is() {
        let case = |threads: u32| format!("[run]\nend.steps = 5\nthreads = {threads}\n");
        let varied = ["run.threads".to_string()];
        assert_eq!(canonical(&case(1), &[]), canonical(&case(2), &[]));
        assert_ne!(canonical(&case(1), &varied), canonical(&case(2), &varied));
    }
}
