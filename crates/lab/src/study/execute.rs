//! Execution of the open runs of a study, one after the other.

use super::prelude::*;
use super::state::measured_with;
use serde_json::json;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::process::{Command, ExitStatus, Stdio};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};
use turbid::case::{CHECKPOINT_INTERVAL, CheckpointSpacing};
use turbid::checkpoint;
use turbid::simulation::RunOptions;

/// With less time than this no run begins.
const LEAST_TIME: Duration = Duration::from_secs(5);
/// Interval at which a benchmark is looked at.
const POLL: Duration = Duration::from_millis(50);

#[derive(Clone, Copy, Debug)]
pub enum Event<'a> {
    Begins {
        name: &'a str,
        /// Its number among the open runs, from 1, and the number of these.
        number: [usize; 2],
        /// The step from which it is resumed; 0 at the start.
        from: u64,
        seconds: Option<f64>,
    },
    Finished(&'a Record),
    /// A run has failed; the next one follows.
    Failed {
        name: &'a str,
        error: &'a Error,
    },
}

#[derive(Debug, Default)]
pub struct Outcome {
    /// True if it was told to stop, or its time was over.
    pub interrupted: bool,
    pub failed: usize,
    pub code: i32,
}

/// Executes all open runs whose names contain `only`, and collects the results after each. The time limit of `options` is for
/// all of them. `admit` may refuse a run that does not fit the machine, before particles are placed, and returns warnings for its summary.
///
/// # Errors
/// Those of the directory of the study and of writing there; a run that fails is an event and no error.
pub fn execute(
    study: &mut Study,
    options: &RunOptions,
    only: Option<&str>,
    admit: &Admit,
    tell: &mut dyn FnMut(Event),
) -> Result<Outcome> {
    let start = Instant::now();
    let _lock = directory::create(&study.out)?;
    study.refresh()?;
    study.collect()?;
    let is_open = |&run: &usize| {
        let name = &study.plan.runs[run].name;
        only.is_none_or(|only| name.contains(only)) && study.states[run].record().is_none()
    };
    let open: Vec<usize> = (0..study.plan.runs.len()).filter(is_open).collect();
    let mut outcome = Outcome::default();
    for (number, &run) in open.iter().enumerate() {
        let left = options.max_walltime.map(|limit| limit.saturating_sub(start.elapsed()));
        // The list of the study says which runs it replaces.
        let options = RunOptions { overwrite: true, max_walltime: left, ..options.clone() };
        if left.is_some_and(|left| left < LEAST_TIME) || options.stop.load(Ordering::Relaxed) {
            outcome.interrupted = true;
            break;
        }
        let from = match study.states[run] {
            State::Part { step } => step,
            _ => 0,
        };
        let name = study.plan.runs[run].name.clone();
        let seconds = study.seconds_left(run);
        tell(Event::Begins { name: &name, number: [number + 1, open.len()], from, seconds });
        let finished = admit(&study.plan.runs[run].setup).and_then(|_| match &study.file.bench {
            Some(_) => bench(study, run, &options),
            None => simulate(study, run, &options, admit),
        });
        study.refresh()?;
        match (finished, study.states[run].record()) {
            (Ok(true), Some(record)) => tell(Event::Finished(record)),
            (Ok(_), _) => outcome.interrupted = true,
            (Err(error), _) => {
                tell(Event::Failed { name: &name, error: &error });
                outcome.failed += 1;
                if outcome.failed == 1 {
                    outcome.code = error.exit_code();
                }
            }
        }
        study.collect()?;
        if outcome.interrupted {
            break;
        }
    }
    Ok(outcome)
}

/// Refuses a run, or returns warnings about it.
pub type Admit<'a> = dyn Fn(&Setup) -> Result<Vec<String>> + 'a;

/// Runs a case from the start or from its last checkpoint; whether it finished.
fn simulate(study: &Study, run: usize, options: &RunOptions, admit: &Admit) -> Result<bool> {
    let planned = &study.plan.runs[run];
    let folder = study.out.join(&planned.name);
    let is_part = matches!(study.states[run], State::Part { .. });
    let mut setup = if is_part {
        simulation::saved_setup(&folder, &[], study.threads)?
    } else {
        case::load(&study.case, &planned.options)?
    };
    setup.plan.output.directory.clone_from(&folder);
    setup.plan.threads = study.threads.unwrap_or(setup.plan.threads);
    setup.provenance.warnings.extend(admit(&setup)?);
    // Removed when the run is finished: those of many runs would fill the disk.
    setup.plan.output.checkpoint_every = CheckpointSpacing::WallTime(CHECKPOINT_INTERVAL);
    setup.plan.output.checkpoint_at_end = false;
    let run = if is_part { simulation::resume } else { simulation::run };
    let finished = run(&setup, options)?.is_some_and(|summary| !summary.interrupted);
    if finished {
        checkpoint::clear(&OutputFiles::new(&folder).checkpoints())?;
    }
    Ok(finished)
}

/// Measures the speed of a case in a process of its own, whose memory is then that of this case; whether it finished.
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
    command.args(planned.options.iter().flat_map(|option| ["--set", option]));
    command
        .args(study.threads.into_iter().flat_map(|threads| ["--threads".to_string(), threads.to_string()]));
    command.args(options.allow_engine.then_some("--allow-engine"));
    let folder = study.out.join(&planned.name);
    fs::create_dir_all(&folder).map_err(|error| Error::io("create", &folder, error))?;
    let start = Instant::now();
    let Some(output) = output_of(&mut command, &folder, options)? else {
        return Ok(false);
    };
    let report: Json = serde_json::from_str(&output).map_err(|error| {
        Error::Input(format!("the output of `turbid bench` is no JSON: {error}\n{output}"))
    })?;
    let mut record = json!({
        "version": env!("CARGO_PKG_VERSION"),
        "input": planned.setup.provenance.text,
        "identity": identity(&planned.setup),
        "seconds": start.elapsed().as_secs_f64(),
        "report": report,
    });
    let with = measured_with(&section, &planned.setup, study.threads);
    if let (Json::Object(record), Json::Object(with)) = (&mut record, with) {
        record.extend(with);
    }
    let text = serde_json::to_string_pretty(&record).expect("plain data always serialises") + "\n";
    write_bytes(&folder.join(BENCH_FILE), text.as_bytes())?;
    Ok(true)
}

/// Standard output of a process; none if it was stopped because the study was, or because the time is over.
///
/// # Errors
/// [`Error::Io`] if it cannot be started; [`Error::Agreed`] with its message and its exit code if it failed.
fn output_of(command: &mut Command, folder: &Path, options: &RunOptions) -> Result<Option<String>> {
    // Files, not pipes, which would have to be emptied meanwhile.
    let [output, errors] = ["bench.out", "bench.err"].map(|name| folder.join(name));
    let create = |path: &Path| fs::File::create(path).map_err(|error| Error::io("create", path, error));
    command.stdin(Stdio::null()).stdout(create(&output)?).stderr(create(&errors)?);
    // A signal from the keyboard goes to this process alone, which then ends the other.
    command.process_group(0);
    let status =
        wait(command, options).map_err(|error| Error::io("start `turbid bench` in", folder, error))?;
    let take = |path: &Path| {
        let text = input::read_text(path, input::RECORD).map_err(|error| Error::io("read", path, error))?;
        fs::remove_file(path).map_err(|error| Error::io("remove", path, error))?;
        Ok::<_, Error>(text)
    };
    let (output, errors) = (take(&output)?, take(&errors)?);
    let Some(status) = status else {
        return Ok(None);
    };
    let (code, text) = match (status.code(), status.signal()) {
        (Some(0), _) => return Ok(Some(output)),
        // Somebody ended that process alone.
        (_, Some(libc::SIGINT | libc::SIGTERM | libc::SIGHUP)) => return Ok(None),
        (_, Some(signal)) => {
            let system = "9 is what the system sends where memory runs out";
            (3, format!("`turbid bench` was ended by signal {signal}; {system}"))
        }
        (code, None) => (code.unwrap_or(3), errors.trim_start_matches("error: ").trim_end().to_string()),
    };
    Err(Error::Agreed { code, text })
}

/// Runs a process; none if it was stopped.
fn wait(command: &mut Command, options: &RunOptions) -> std::io::Result<Option<ExitStatus>> {
    let start = Instant::now();
    let mut child = command.spawn()?;
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(Some(status));
        }
        let late = options.max_walltime.is_some_and(|limit| start.elapsed() >= limit);
        if late || options.stop.load(Ordering::Relaxed) {
            // It may have ended by itself in between.
            let _ = child.kill();
            let _ = child.wait();
            return Ok(None);
        }
        std::thread::sleep(POLL);
    }
}
