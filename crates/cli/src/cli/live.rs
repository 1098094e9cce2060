//! The live page of a run: `turbid run --serve`, and `turbid watch` for a run of another process.
//!
//! The page is drawn from the files in the output directory, which the run writes anyway; beside them the run tells its step and takes
//! two requests, to stop and to write a checkpoint, which have the same effect as signals. It never waits for a client, but after its
//! last file for a page that is about to show the end.

mod server;

use super::progress::{Pace, Progressed, Terminal, Workload};
use super::run::STOPPING;
use super::terminal::{notice, say, speaks};
use crate::report::{self, Curves};
use clap::Args;
use serde_json::{Value, json};
use server::{Answer, Server, Site};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant, SystemTime};
use turbid::case::Setup;
use turbid::checkpoint;
use turbid::error::{Error, Result};
use turbid::input;
use turbid::memory;
use turbid::output::{OutputFiles, Summary};
use turbid::simulation::{Progress, RunOptions};

/// Time between measurements of the speed.
const INTERVAL: Duration = Duration::from_millis(500);
/// Drawing of the curves takes at most this part of the time of one thread, as one over it.
const SELDOM: u32 = 20;
/// A page that has asked within this time is open.
const OPEN: Duration = Duration::from_secs(4);
/// Longest time to wait at the end of a run for an open page to show it.
const LAST: Duration = Duration::from_secs(3);

const BODY: &str = include_str!("live/body.html");
const SCRIPT: &str = include_str!("live/live.js");

/// Flags of the live page of a run.
#[derive(Debug, Args)]
pub(super) struct LiveFlags {
    /// Serve a page about the run to browsers on this machine: progress, curves, newest pictures, stop. Without a port any that is
    /// free; the address is printed.
    #[arg(long, value_name = "PORT", num_args = 0..=1, require_equals = true, default_missing_value = "0")]
    serve: Option<u16>,
}

/// Input of `turbid watch`.
#[derive(Debug, Args)]
pub(super) struct WatchArguments {
    /// Output directory of a run, which may still be under way.
    #[arg(value_name = "DIR")]
    directory: PathBuf,
    /// Port of the page; 0 is any that is free.
    #[arg(long, default_value_t = 0)]
    port: u16,
}

/// A run that a page shows.
#[derive(Default)]
struct Live {
    run: Mutex<Option<Running>>,
    /// Flags that stop the run and let it write a checkpoint; none of a run of another process.
    requests: Option<[Arc<AtomicBool>; 2]>,
    drawn: Mutex<Drawn>,
    pages: Mutex<Pages>,
    seen: Condvar,
}

/// State of a run.
struct Running {
    case: String,
    directory: PathBuf,
    pace: Pace,
    step: u64,
    ended: bool,
    /// True if it ended before its last step, which may be unknown.
    interrupted: bool,
    warnings: Vec<String>,
}

/// The curves, and of which state of the series they are.
#[derive(Default)]
struct Drawn {
    of: Option<(u64, SystemTime)>,
    curves: Curves,
    /// The time at which they were drawn, and how long that took.
    last: Option<(Instant, Duration)>,
    /// The reason why there are none.
    error: String,
}

/// Pages that are open.
#[derive(Default)]
struct Pages {
    asked: Option<Instant>,
    has_end: bool,
}

/// Follows a run on the terminal and for the page.
struct Follower {
    terminal: Arc<Terminal>,
    live: Arc<Live>,
}

/// Serves a page about the run with these options, if the flags ask for one, and prints its address.
///
/// # Errors
/// [`Error::Input`] if the port cannot be bound.
pub(super) fn serve(flags: &LiveFlags, options: &mut RunOptions, terminal: &Arc<Terminal>) -> Result<()> {
    let Some(port) = flags.serve.filter(|_| speaks()) else {
        return Ok(());
    };
    let requests = Some([Arc::clone(&options.stop), Arc::clone(&options.checkpoint)]);
    let live = Arc::new(Live { requests, ..Live::default() });
    let (server, address) = bind(port)?;
    options.progress = Some(Arc::new(Follower { terminal: Arc::clone(terminal), live: Arc::clone(&live) }));
    let thread = thread::Builder::new().name("server".to_string());
    let started = memory::start_thread(|starting| {
        thread.spawn(move || {
            drop(starting);
            server.serve(&live);
        })
    });
    started.map_err(|error| Error::io("start a thread of", Path::new("this process"), error))?;
    notice(&format!("live page: {address}"));
    Ok(())
}

/// Serves a page about a run of another process, until it is ended.
pub(super) fn watch(arguments: &WatchArguments) -> Result<()> {
    let directory = &arguments.directory;
    let files = OutputFiles::new(directory);
    if !files.series().is_file() {
        return Err(Error::Input(format!(
            "there is no run in {}: it holds no series.csv\n  give the output directory of `turbid run`",
            directory.display()
        )));
    }
    let live = Live::default();
    let work = Workload { steps: 0, first: 0, cells: 0, time_step: 0.0, stokes_time: None };
    *lock(&live.run) = Some(Running {
        case: report::name(directory),
        directory: directory.clone(),
        pace: Pace::new(work, INTERVAL, Instant::now()),
        step: 0,
        ended: false,
        interrupted: false,
        warnings: Vec::new(),
    });
    let (server, address) = bind(arguments.port)?;
    say(&format!("live page: {address}"));
    server.serve(&Arc::new(live));
    Ok(())
}

fn bind(port: u16) -> Result<(Server, String)> {
    let bound = Server::bind(port).and_then(|server| server.address().map(|address| (server, address)));
    bound.map_err(|error| {
        Error::Input(format!(
            "cannot serve a page on port {port} of 127.0.0.1: {error}\n  give another port, or none for any that is free"
        ))
    })
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Progress for Follower {
    fn start(&self, setup: &Setup, first: u64) {
        self.terminal.start(setup, first);
        *lock(&self.live.run) = Some(Running {
            case: setup.provenance.name.clone(),
            directory: setup.plan.output.directory.clone(),
            pace: Pace::new(Workload::of(setup, first), INTERVAL, Instant::now()),
            step: first,
            ended: false,
            interrupted: false,
            warnings: setup.provenance.warnings.clone(),
        });
    }

    fn step(&self, step: u64) {
        self.terminal.step(step);
        if let Some(run) = &mut *lock(&self.live.run) {
            run.step = step;
            run.pace.update(step, Instant::now());
        }
    }

    fn warn(&self, text: &str) {
        self.terminal.warn(text);
        if let Some(run) = &mut *lock(&self.live.run) {
            run.warnings.push(text.to_string());
        }
    }

    fn finish(&self, step: u64) {
        self.terminal.finish(step);
        if let Some(run) = &mut *lock(&self.live.run) {
            (run.step, run.ended) = (step, true);
        }
        let pages = lock(&self.live.pages);
        if pages.asked.is_some_and(|asked| asked.elapsed() < OPEN) {
            drop(self.live.seen.wait_timeout_while(pages, LAST, |pages| !pages.has_end));
        }
    }
}

impl Site for Live {
    fn page(&self) -> String {
        report::shell("Turbid", true, SCRIPT, BODY)
    }

    fn answer(&self, method: &str, path: &str) -> Answer {
        let json = |value: &Value| Answer::new("application/json", value.to_string());
        let request = |which: usize| self.requests.as_ref().map(|requests| &requests[which]);
        match (method, path) {
            ("GET", "/state") => json(&self.state()),
            ("GET", "/curves") => {
                let drawn = lock(&self.drawn);
                json(&json!({ "figures": drawn.curves.figures, "newest": drawn.curves.newest_row }))
            }
            ("POST", "/stop") if request(0).is_some() => {
                if !request(0).is_some_and(|stop| stop.swap(true, Ordering::Relaxed)) {
                    notice(&format!("the page asks to stop: {STOPPING}"));
                }
                json(&json!({}))
            }
            ("POST", "/checkpoint") if request(1).is_some() => {
                request(1).inspect(|save| save.store(true, Ordering::Relaxed));
                json(&json!({}))
            }
            ("POST", "/seen") => {
                lock(&self.pages).has_end = true;
                self.seen.notify_all();
                json(&json!({}))
            }
            ("GET", path) => {
                self.picture(path).unwrap_or_else(|| Answer::refusal(404, "there is nothing here"))
            }
            _ => Answer::refusal(404, "there is nothing here"),
        }
    }
}

impl Live {
    /// State of the run as JSON.
    fn state(&self) -> Value {
        lock(&self.pages).asked = Some(Instant::now());
        let run = lock(&self.run).as_ref().map(|run| (run.directory.clone(), run.case.clone()));
        let Some((directory, case)) = run else {
            return json!({ "phase": "starting" });
        };
        // The curves of a state that is shown as the end must be the last ones.
        let ended = match self.requests {
            Some(_) => lock(&self.run).as_ref().is_some_and(|run| run.ended),
            None => OutputFiles::new(&directory).summary().is_file(),
        };
        let (drawn, error) = self.draw(&directory, &case, ended);
        if self.requests.is_none() {
            self.look(&directory);
        }
        let films = report::films(&directory);
        let pictures: Vec<(String, u64)> =
            films.into_iter().filter_map(|film| Some((film.name, film.frames.last()?.0))).collect();
        let saved = checkpoint::list(&OutputFiles::new(&directory).checkpoints()).unwrap_or_default();
        let flag = |which: usize| {
            self.requests.as_ref().is_some_and(|requests| requests[which].load(Ordering::Relaxed))
        };
        let [stopping, saving] = [flag(0), flag(1)];
        let guard = lock(&self.run);
        let Some(run) = guard.as_ref() else {
            return json!({ "phase": "starting" });
        };
        let (step, end) = (run.step, run.pace.work.steps);
        let ended = ended && run.ended;
        let phase = match ended {
            true if run.interrupted || step < end => "stopped",
            true => "complete",
            false if stopping => "stopping",
            false => "running",
        };
        let Progressed { time, speed, left } = run.pace.status(step);
        json!({
            "phase": phase, "case": run.case, "directory": directory, "step": step, "end": end, "time": time, "speed": speed,
            "left": left, "warnings": run.warnings, "controls": self.requests.is_some() && !ended, "saving": saving,
            "checkpoint": saved.first().map(|newest| newest.step), "pictures": pictures, "drawn": drawn, "error": error,
        })
    }

    /// Draws the curves again if the series has grown, but seldom before the end; returns which ones there are, and why there are none.
    fn draw(&self, directory: &Path, case: &str, ended: bool) -> (u64, String) {
        let path = OutputFiles::new(directory).series();
        let data = fs::metadata(&path).and_then(|data| Ok((data.len(), data.modified()?)));
        let drawn = &mut *lock(&self.drawn);
        let is_time = ended || drawn.last.is_none_or(|(at, cost)| at.elapsed() >= SELDOM * cost);
        if let (Ok(data), true) = (data, is_time)
            && drawn.of != Some(data)
        {
            let start = Instant::now();
            match report::curves(directory, case) {
                Ok(curves) => (drawn.curves, drawn.error) = (curves, String::new()),
                Err(error) => drawn.error = error.to_string(),
            }
            drawn.of = Some(data);
            drawn.last = Some((Instant::now(), start.elapsed()));
        }
        (drawn.of.map_or(0, |of| of.0), drawn.error.clone())
    }

    /// Learns from its files how far a run of another process has come.
    fn look(&self, directory: &Path) {
        let files = OutputFiles::new(directory);
        let value = |name: &str| {
            let drawn = lock(&self.drawn);
            drawn.curves.newest.iter().find(|(known, _)| known == name).map_or(0.0, |known| known.1)
        };
        let [row, time, t_star] = ["step", "t", "t_star"].map(value);
        let summary = Summary::read(&files.summary()).ok();
        let saved = || {
            let newest = checkpoint::list(&files.checkpoints()).ok()?.into_iter().next()?;
            Some(checkpoint::Checkpoint::open(&newest.path).ok()?.head().case.text.clone())
        };
        let known = lock(&self.run).as_ref().map_or(0, |run| run.pace.work.steps);
        let end = match &summary {
            Some(summary) if !summary.interrupted => summary.steps,
            _ if known > 0 => known,
            Some(summary) => end_step(&summary.input, [row, time, t_star]).unwrap_or(0),
            None => saved().and_then(|case| end_step(&case, [row, time, t_star])).unwrap_or(0),
        };
        if let Some(run) = &mut *lock(&self.run) {
            let work = &mut run.pace.work;
            let ratio = |a: f64, b: f64| Some(a / b).filter(|ratio| ratio.is_finite() && *ratio > 0.0);
            work.steps = end;
            work.time_step = ratio(time, row).unwrap_or(work.time_step);
            work.stokes_time = ratio(time, t_star).or(work.stokes_time);
            run.ended = summary.is_some();
            run.interrupted = summary.as_ref().is_some_and(|summary| summary.interrupted);
            let step = summary.as_ref().map_or(row as u64, |summary| summary.steps);
            if step != run.step {
                // The first row is no progress.
                work.first = if run.step == 0 { step } else { work.first };
                run.pace.update(step, Instant::now());
                run.step = step;
            }
            if let Some(summary) = summary {
                (run.case, run.warnings) = (summary.case, summary.warnings);
            }
        }
    }

    /// The newest picture of a film, by its number.
    fn picture(&self, path: &str) -> Option<Answer> {
        let number: usize = path.strip_prefix("/picture/")?.parse().ok()?;
        let directory = lock(&self.run).as_ref()?.directory.clone();
        let films = report::films(&directory);
        let (_, path, _) = films.get(number)?.frames.last()?;
        Some(Answer::new("image/png", input::read_unlinked(path, report::PICTURE).ok()?))
    }
}

/// The last step of a case, from its text and a row of its series: step, time (s), and `t*`.
fn end_step(case: &str, [step, time, t_star]: [f64; 3]) -> Option<u64> {
    let case: toml::Table = case.parse().ok()?;
    let end = case.get("run")?.get("end")?;
    let end = end.get("steady").and_then(|steady| steady.get("at_most")).unwrap_or(end);
    let number =
        |key: &str| end.get(key).and_then(|value| value.as_float().or(value.as_integer().map(|n| n as f64)));
    let steps = match (number("steps"), number("time"), number("stokes_times")) {
        (Some(steps), ..) => steps,
        (_, Some(until), _) => step / time * until,
        (.., Some(until)) => step / t_star * until,
        _ => return None,
    };
    (steps.is_finite() && steps >= 1.0).then(|| steps.round() as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_are_drawn_seldom_but_always_at_the_end() {
        let place = tempfile::tempdir().unwrap();
        let live = Live::default();
        lock(&live.drawn).last = Some((Instant::now(), Duration::from_secs(3600)));
        let series = OutputFiles::new(place.path()).series();
        drop(turbid::output::SeriesWriter::create(&series, &[], &[], &[], &[]).unwrap());
        assert_eq!(live.draw(place.path(), "case", false).0, 0);
        assert_eq!(live.draw(place.path(), "case", true).0, fs::metadata(&series).unwrap().len());
    }

    #[test]
    fn the_last_step_follows_from_the_case_and_a_row() {
        let end = |text: &str| end_step(&format!("[run]\nend = {{ {text} }}\n"), [100.0, 0.5, 4.0]);
        assert_eq!(end("steps = 70"), Some(70));
        assert_eq!(end("time = 2"), Some(400));
        assert_eq!(end("stokes_times = 10.0"), Some(250));
        assert_eq!(end("steady = { over = { steps = 5 }, at_most = { time = 2 } }"), Some(400));
        assert_eq!(end_step("[run]\nend = { time = 1.0 }\n", [0.0; 3]), None);
        assert_eq!(end_step("no case", [1.0; 3]), None);
    }
}
