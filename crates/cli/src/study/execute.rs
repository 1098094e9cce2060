//! Doing what is left of a study, one run after the other.

use super::Study;
use super::record::{BENCH_FILE, Record};
use super::state::{State, measured_with};
use serde_json::{Value as Json, json};
use std::fs;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};
use turbid::case::{self, CHECKPOINT_INTERVAL, CheckpointSpacing, Setup};
use turbid::checkpoint;
use turbid::error::{Error, Result};
use turbid::input;
use turbid::output::{OutputFiles, Summary, directory, write_bytes};
use turbid::simulation::{self, RunOptions, identity};

/// With less time than this no run begins.
const LEAST_TIME: Duration = Duration::from_secs(5);
/// How often a benchmark is looked at.
const POLL: Duration = Duration::from_millis(50);

/// How a study is done.
#[derive(Clone, Debug, Default)]
pub struct Manner {
    /// As for a single run; the time limit is for all of them.
    pub run: RunOptions,
    /// Only runs whose names contain this.
    pub only: Option<String>,
}

/// What happens on the way.
#[derive(Clone, Copy, Debug)]
pub enum Event<'a> {
    /// A run begins, or goes on from a step.
    Begins {
        /// Its name.
        name: &'a str,
        /// Its number among those to be done now, from 1, and how many these are.
        number: [usize; 2],
        /// The step it goes on from; 0 at the start.
        from: u64,
        /// Time it may take (s), if it is known.
        seconds: Option<f64>,
    },
    /// A run has ended.
    Ended {
        /// Its name.
        name: &'a str,
        /// What it has left.
        record: &'a Record,
    },
    /// A run has failed; the next one follows.
    Failed {
        /// Its name.
        name: &'a str,
        /// Why.
        error: &'a Error,
    },
}

/// How the execution of a study has ended.
#[derive(Debug, Default)]
pub struct Outcome {
    /// It was told to stop, or its time was over.
    pub interrupted: bool,
    /// Runs that failed now.
    pub failed: usize,
    /// Exit code of the first that failed.
    pub code: i32,
}

/// Does all runs that have not ended, and collects the results after each. `admit` may
/// refuse a run that does not fit the machine; it is asked before particles are placed.
///
/// # Errors
/// Those of the directory of the study and of what is written there; a run that fails is told of and is no error.
pub fn execute(
    study: &mut Study,
    manner: &Manner,
    admit: &dyn Fn(&Setup) -> Result<()>,
    tell: &mut dyn FnMut(Event),
) -> Result<Outcome> {
    let start = Instant::now();
    let _lock = directory::create(&study.out)?;
    study.refresh()?;
    study.collect()?;
    let meant: Vec<usize> = (0..study.plan.runs.len())
        .filter(|&run| {
            let name = &study.plan.runs[run].name;
            manner.only.as_ref().is_none_or(|only| name.contains(only))
                && study.states[run].record().is_none()
        })
        .collect();
    let mut outcome = Outcome::default();
    for (number, &run) in meant.iter().enumerate() {
        let mut options = manner.run.clone();
        // The list of the study says which runs it replaces.
        options.overwrite = true;
        if let Some(limit) = manner.run.max_walltime {
            options.max_walltime = Some(limit.saturating_sub(start.elapsed()));
        }
        let late = options.max_walltime.is_some_and(|left| left < LEAST_TIME);
        if late || options.stop.load(Ordering::Relaxed) {
            outcome.interrupted = true;
            break;
        }
        let from = match study.states[run] {
            State::Part { step } => step,
            _ => 0,
        };
        let name = study.plan.runs[run].name.clone();
        let number = [number + 1, meant.len()];
        let seconds = study.seconds_left(run);
        tell(Event::Begins { name: &name, number, from, seconds });
        let done = admit(&study.plan.runs[run].setup).and_then(|()| {
            if study.file.bench.is_some() { bench(study, run, &options) } else { go(study, run, &options) }
        });
        let done = done.and_then(|ended| {
            study.refresh()?;
            Ok(ended)
        });
        match (done, study.states[run].record()) {
            (Ok(true), Some(record)) => tell(Event::Ended { name: &name, record }),
            (Ok(_), _) => outcome.interrupted = true,
            (Err(error), _) => {
                tell(Event::Failed { name: &name, error: &error });
                outcome.failed += 1;
                if outcome.failed == 1 {
                    outcome.code = error.exit_code();
                }
                study.refresh()?;
            }
        }
        study.collect()?;
        if outcome.interrupted {
            break;
        }
    }
    Ok(outcome)
}

/// Runs a case from the start or from its last checkpoint; whether it came to its end.
fn go(study: &Study, run: usize, options: &RunOptions) -> Result<bool> {
    let threads = study.threads;
    let planned = &study.plan.runs[run];
    let folder = study.out.join(&planned.name);
    let resumed = matches!(study.states[run], State::Part { .. });
    let mut setup = if resumed {
        simulation::saved_setup(&folder, &[], threads)?
    } else {
        case::load(&study.case, &planned.options)?
    };
    setup.plan.output.directory.clone_from(&folder);
    setup.plan.threads = threads.unwrap_or(setup.plan.threads);
    // They go when the run has ended.
    setup.plan.output.checkpoint_every = CheckpointSpacing::WallTime(CHECKPOINT_INTERVAL);
    let summary =
        if resumed { simulation::resume(&setup, options)? } else { simulation::run(&setup, options)? };
    let Some(Summary { interrupted, .. }) = summary else {
        return Ok(false);
    };
    if !interrupted {
        checkpoint::clear(&OutputFiles::new(&folder).checkpoints())?;
    }
    Ok(!interrupted)
}

/// Measures the speed of a case in a process of its own, whose memory is then that of this case; whether it came to its end.
fn bench(study: &Study, run: usize, options: &RunOptions) -> Result<bool> {
    let Some(section) = study.file.bench.as_ref().map(|bench| bench.value) else {
        return Ok(false);
    };
    let planned = &study.plan.runs[run];
    let program =
        std::env::current_exe().map_err(|error| Error::io("find", Path::new("the program itself"), error))?;
    let warm_up = section.warm_up(&planned.setup);
    let mut command = Command::new(&program);
    command.arg("bench").arg(&study.case).arg("--json");
    command.args(["--steps", &section.steps.to_string(), "--warm-up", &warm_up.to_string()]);
    for option in &planned.options {
        command.args(["--set", option]);
    }
    if let Some(threads) = study.threads {
        command.args(["--threads", &threads.to_string()]);
    }
    let folder = study.out.join(&planned.name);
    fs::create_dir_all(&folder).map_err(|error| Error::io("create", &folder, error))?;
    let start = Instant::now();
    let Some(said) = listen(&mut command, &folder, options)? else {
        return Ok(false);
    };
    let report: Json = serde_json::from_str(&said)
        .map_err(|error| Error::Input(format!("`turbid bench` has said what is no JSON: {error}\n{said}")))?;
    let mut left = json!({
        "version": env!("CARGO_PKG_VERSION"),
        "input": planned.setup.provenance.text,
        "identity": identity(&planned.setup),
        "seconds": start.elapsed().as_secs_f64(),
        "report": report,
    });
    let with = measured_with(&section, &planned.setup, study.threads);
    if let (Json::Object(left), Json::Object(with)) = (&mut left, with) {
        left.extend(with);
    }
    let text = serde_json::to_string_pretty(&left).expect("plain data always serialises") + "\n";
    write_bytes(&folder.join(BENCH_FILE), text.as_bytes())?;
    Ok(true)
}

/// What a process says until it ends; nothing if it was stopped because the study was, or because the time is over.
///
/// # Errors
/// [`Error::Io`] if it cannot be started; [`Error::Agreed`] with what it said and its exit code if it failed.
fn listen(command: &mut Command, folder: &Path, options: &RunOptions) -> Result<Option<String>> {
    let failed = |error| Error::io("start `turbid bench` in", folder, error);
    // Files, not pipes: nobody has to empty them while it runs.
    let [said, complained] = ["bench.out", "bench.err"].map(|name| folder.join(name));
    let create = |path: &Path| fs::File::create(path).map_err(|error| Error::io("create", path, error));
    command.stdin(Stdio::null()).stdout(create(&said)?).stderr(create(&complained)?);
    // A signal from the keyboard goes to this process alone, which then ends the other.
    command.process_group(0);
    let start = Instant::now();
    let mut child = command.spawn().map_err(failed)?;
    let status = loop {
        if let Some(status) = child.try_wait().map_err(failed)? {
            break Some(status);
        }
        let late = options.max_walltime.is_some_and(|limit| start.elapsed() >= limit);
        if late || options.stop.load(Ordering::Relaxed) {
            // It may have ended by itself in between.
            let _ = child.kill();
            let _ = child.wait();
            break None;
        }
        std::thread::sleep(POLL);
    };
    let read =
        |path: &Path| input::read_text(path, input::RECORD).map_err(|error| Error::io("read", path, error));
    let texts = (read(&said)?, read(&complained)?);
    for path in [&said, &complained] {
        fs::remove_file(path).map_err(|error| Error::io("remove", path, error))?;
    }
    match status {
        None => Ok(None),
        Some(status) if status.success() => Ok(Some(texts.0)),
        // Somebody ended that process alone.
        Some(status) if matches!(status.signal(), Some(libc::SIGINT | libc::SIGTERM | libc::SIGHUP)) => {
            Ok(None)
        }
        Some(status) if status.signal().is_some() => Err(Error::Agreed {
            code: 3,
            text: format!(
                "`turbid bench` was ended by signal {}; 9 is what the system sends where memory runs out",
                status.signal().unwrap_or(0)
            ),
        }),
        Some(status) => Err(Error::Agreed {
            code: status.code().unwrap_or(3),
            text: texts.1.trim_start_matches("error: ").trim_end().to_string(),
        }),
    }
}
