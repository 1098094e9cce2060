//! Runs that are stopped, asked for a checkpoint, killed, or out of time.

use super::{DRY, Left, checkpoints, crowd};
use crate::common::case::TABLES_ONLY;
use crate::common::child::{Guard, PATIENCE, poll, rows};
use crate::common::{PROGRAM, Place, random, words};
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{ChildStderr, Command};
use std::time::{Duration, Instant};

/// Never finishes.
const ENDLESS: [&str; 2] = ["--set", "run.end.steps=100000000"];

fn wait_for_rows(place: &Place, count: usize) {
    let series = place.path("out/series.csv");
    poll("more rows", || (rows(&series) >= count).then_some(()));
}

/// The steps of an interrupted run.
fn interrupted_at(place: &Place) -> u64 {
    let left = Left::of(place, "out");
    assert_eq!(left.summary["interrupted"], true);
    left.summary["steps"].as_u64().unwrap()
}

/// Continues by some steps, and compares with a run that never stopped.
fn resumes_from(place: &Place, step: u64) {
    let end = format!("run.end.steps={}", step + 20);
    place.well(&["resume", "out", "--quiet", "--threads", "3", "--set", &end]);
    let whole = ["run", "case.toml", "--quiet", "--out", "whole", "--set", &end];
    place.well(&[&whole[..], &TABLES_ONLY].concat());
    Left::of(place, "out").must_be(&Left::of(place, "whole"), &format!("from step {step}"));
}

#[test]
fn a_stopped_run_says_how_to_resume_and_resumes_to_the_bit() {
    let place = Place::new(&crowd());
    let arguments = [&["run", "case.toml", "--threads", "2"], &ENDLESS[..], &TABLES_ONLY].concat();
    let mut child = Guard::of(place.turbid(&arguments));
    wait_for_rows(&place, 20);
    child.send(libc::SIGTERM);
    child.ends_with(4);
    let mut said = String::new();
    std::io::Read::read_to_string(child.0.stdout.as_mut().unwrap(), &mut said).unwrap();
    assert!(said.contains("resume with: turbid resume out\n"), "{said}");
    let step = interrupted_at(&place);
    assert_eq!(checkpoints(&place, "out"), [step]);
    resumes_from(&place, step);
}

/// Interrupts the child and waits for its answer; what it says after that.
fn interrupt(child: &mut Guard) -> BufReader<ChildStderr> {
    child.send(libc::SIGINT);
    let mut said = BufReader::new(child.0.stderr.take().unwrap());
    let mut line = String::new();
    said.read_line(&mut line).unwrap();
    assert_eq!(line, "stopping, writing a checkpoint; interrupt again to abort\n");
    said
}

#[test]
fn an_interrupt_that_comes_twice_at_once_loses_nothing_and_is_answered_once() {
    let place = Place::new(&crowd());
    let arguments = [&["run", "case.toml", "--quiet"], &ENDLESS[..], &TABLES_ONLY].concat();
    let mut child = Guard::of(place.turbid(&arguments));
    wait_for_rows(&place, 10);
    let more = interrupt(&mut child);
    child.send(libc::SIGINT);
    child.ends_with(4);
    assert_eq!(more.lines().count(), 0);
    assert_eq!(checkpoints(&place, "out"), [interrupted_at(&place)]);
}

#[test]
fn a_later_interrupt_ends_a_run_that_takes_long_to_stop() {
    // A step takes seconds.
    let place = Place::new(DRY);
    let slow = ["--set", "contact.substeps=10000", "--set", "run.end.steps=1000"];
    let mut child = Guard::of(place.turbid(&[&["run", "case.toml", "--quiet"], &slow[..]].concat()));
    wait_for_rows(&place, 2);
    interrupt(&mut child);
    let status = poll("the end of the child", || {
        let ended = child.0.try_wait().unwrap();
        if ended.is_none() {
            child.send(libc::SIGINT);
        }
        ended
    });
    assert_eq!(status.code(), Some(130), "{status}");
}

#[test]
fn a_run_that_is_to_outlive_its_terminal_does() {
    let place = Place::new(&crowd());
    let mut command = Command::new("env");
    command.args(["--ignore-signal=HUP", PROGRAM, "run", "case.toml", "--quiet"]);
    command.args([&ENDLESS[..], &TABLES_ONLY].concat()).current_dir(place.folder());
    let mut child = Guard::of(command);
    wait_for_rows(&place, 5);
    child.send(libc::SIGHUP);
    wait_for_rows(&place, 20);
    child.send(libc::SIGTERM);
    child.ends_with(4);
}

#[test]
fn a_file_that_becomes_too_long_is_an_error_and_the_checkpoint_before_resumes() {
    let place = Place::new(&crowd());
    let every = ["--set", "output.checkpoint_every.steps=20"];
    let run =
        [&["run", "case.toml", "--quiet", "--set", "run.end.steps=20"], &every[..], &TABLES_ONLY].concat();
    place.well(&run);
    let whole = ["run", "case.toml", "--quiet", "--out", "whole"];
    place.well(&[&whole[..], &TABLES_ONLY].concat());
    // Some rows are in it, and a checkpoint is not.
    let output = Command::new("sh")
        .args(["-c", "ulimit -f 200; exec \"$0\" resume out --quiet --set run.end.steps=80"])
        .arg(PROGRAM)
        .current_dir(place.folder())
        .output()
        .unwrap();
    let said = words(&output);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains("the checkpoint of step 40 failed") && said.contains("too large"), "{said}");
    assert!(said.contains("the checkpoint of step 20 is intact"), "{said}");
    assert_eq!(checkpoints(&place, "out"), [20]);
    place.well(&["resume", "out", "--quiet", "--set", "run.end.steps=80"]);
    Left::of(&place, "out").must_be(&Left::of(&place, "whole"), "without the limit");
}

#[test]
fn checkpoints_by_the_clock_change_no_bit_and_are_written_every_ten_minutes_by_default() {
    let place = Place::new(&crowd());
    place.well(&["run", "case.toml", "--quiet", "--out", "whole"]);
    assert_eq!(checkpoints(&place, "whole"), [80], "only at the end: it does not take ten minutes");
    // Due whenever the ranks talk to each other, every 8th step.
    let clock =
        ["--set", "output.checkpoint_every.wall_time=1e-6", "--set", "output.checkpoint_at_end=false"];
    place.well(&[&["run", "case.toml", "--quiet", "--threads", "3"], &clock[..]].concat());
    assert_eq!(checkpoints(&place, "out"), [65, 73]);
    Left::of(&place, "out").must_be(&Left::of(&place, "whole"), "with checkpoints");
    // As if it had been killed after its last row.
    std::fs::remove_file(place.path("out/summary.json")).unwrap();
    place.well(&["resume", "out", "--quiet", "--threads", "2"]);
    Left::of(&place, "out").must_be(&Left::of(&place, "whole"), "from step 73");
}

#[test]
fn a_run_that_is_asked_for_a_checkpoint_writes_it_and_continues() {
    let place = Place::new(&crowd());
    let arguments = [&["run", "case.toml", "--quiet", "--threads", "2"], &ENDLESS[..], &TABLES_ONLY].concat();
    let child = Guard::of(place.turbid(&arguments));
    wait_for_rows(&place, 10);
    child.send(libc::SIGUSR1);
    let first = poll("a checkpoint", || checkpoints(&place, "out").last().copied());
    let more = rows(&place.path("out/series.csv")) + 10;
    wait_for_rows(&place, more);
    child.send(libc::SIGUSR1);
    let second =
        poll("another one", || checkpoints(&place, "out").last().copied().filter(|step| *step > first));
    child.send(libc::SIGKILL);
    drop(child);
    assert_eq!(checkpoints(&place, "out"), [first, second]);
    resumes_from(&place, second);
}

#[cfg(feature = "mpi")]
#[test]
fn the_processes_of_a_job_write_a_checkpoint_that_its_launcher_is_asked_for() {
    let place = Place::new(&crowd());
    let arguments = [&["run", "case.toml", "--quiet"], &ENDLESS[..], &TABLES_ONLY].concat();
    // Not through `timeout`, which would keep the signal.
    let mut child = Guard::of(place.job(2, &arguments));
    wait_for_rows(&place, 10);
    child.send(libc::SIGUSR1);
    let step = poll("a checkpoint", || checkpoints(&place, "out").last().copied());
    child.send(libc::SIGTERM);
    poll("the end of the job", || child.0.try_wait().unwrap());
    // The launcher may end before its processes.
    poll("the end of its processes", || std::fs::File::open(place.path("out")).unwrap().try_lock().ok());
    // The signal that ends the job may leave time for another one.
    let newest = checkpoints(&place, "out").last().copied().unwrap();
    assert!(newest >= step);
    resumes_from(&place, newest);
}

#[test]
fn a_run_ends_with_a_checkpoint_before_its_time_is_up() {
    let place = Place::new(&crowd());
    let arguments =
        [&["run", "case.toml", "--quiet", "--max-walltime", "3s"], &ENDLESS[..], &TABLES_ONLY].concat();
    let start = Instant::now();
    place.ends(4, &arguments);
    let taken = start.elapsed().as_secs_f64();
    assert!(taken < PATIENCE.as_secs_f64(), "{taken} s");
    let step = interrupted_at(&place);
    assert_eq!(checkpoints(&place, "out"), [step]);
    resumes_from(&place, step);
}

/// Kills a run at a random moment, `times` times over; each must resume from its last checkpoint to the end of an unbroken run.
fn killed(times: u64) {
    let place = Place::new(&crowd());
    let options = ["--quiet", "--set", "run.end.steps=200", "--set", "output.checkpoint_every.steps=10"];
    place.well(&[&["run", "case.toml", "--out", "whole"], &options[..3]].concat());
    let whole = Left::of(&place, "whole");
    let mut random = random();
    let mut up_to = |limit: u64| (random() * limit as f64) as u64;
    let (mut before_first, mut after_end) = (0, 0);
    for time in 0..times {
        let _ = std::fs::remove_dir_all(place.path("out"));
        let threads = ["1", "2", "3"][time as usize % 3];
        let mut child =
            Guard::of(place.turbid(&[&["run", "case.toml", "--threads", threads], &options[..]].concat()));
        // Anywhere from the start to the end, and then anywhere in what happens there: as far into the run on a busy machine
        // as on a quiet one.
        let bytes = up_to(whole.files[Path::new("series.csv")].len() as u64 + 1);
        poll("rows", || {
            let written = std::fs::metadata(place.path("out/series.csv")).map_or(0, |file| file.len());
            (written >= bytes || child.0.try_wait().unwrap().is_some()).then_some(())
        });
        std::thread::sleep(Duration::from_micros(up_to(20_000)));
        // This is SIGKILL.
        drop(child);
        if checkpoints(&place, "out").is_empty() {
            before_first += 1;
            place.ends(2, &["resume", "out"]);
            continue;
        }
        after_end += u64::from(place.path("out/summary.json").exists());
        let threads = ["2", "3", "1"][time as usize % 3];
        place.well(&["resume", "out", "--quiet", "--threads", threads]);
        Left::of(&place, "out").must_be(&whole, &format!("kill {time}, after {bytes} bytes of rows"));
    }
    println!(
        "{times} runs killed: {before_first} before their first checkpoint, {after_end} after their end"
    );
    assert!(before_first + after_end < times, "none was killed in between");
}

#[test]
fn ten_killed_runs_resume_to_the_same_end() {
    killed(10);
}

#[test]
#[ignore = "minutes"]
fn a_hundred_killed_runs_resume_to_the_same_end() {
    killed(100);
}
