//! Four-way runs with LIGGGHTS moving the particles, end to end.

use crate::common::case::{SPHERES, changed};
use crate::common::child::{Guard, poll, rows};
use crate::common::{Place, column, has, well, words};
use std::io::Read;
use std::path::Path;
use std::process::Output;
use std::time::{Duration, Instant};

/// A folder with a case of twice as many spheres, which LIGGGHTS moves, and its number of steps.
fn place(steps: u64, more: &str) -> Place {
    let engine = format!("[dem]\nengine = \"liggghts\"\n{more}\n[run]");
    let steps = format!("steps = {steps}");
    let changes =
        [("volume_fraction = 0.1", "volume_fraction = 0.2"), ("[run]", &engine), ("steps = 10", &steps)];
    let output = "[output]\ndirectory = \"out\"\nseries_every = { steps = 8 }\npicture_every = \"never\"\n";
    Place::new(&(changed(SPHERES, &changes) + output))
}

#[test]
fn a_run_with_liggghts_is_that_of_the_native_engine_and_the_same_on_any_number_of_threads() {
    let run = |engine: &str, threads: &str| {
        let place = place(400, "");
        let engine = format!("dem.engine={engine}");
        place.well(&["run", "case.toml", "--set", &engine, "--threads", threads]);
        let settling = column(&place.path("out/series.csv"), "settling_velocity_over_stokes (-)");
        (settling, place.summary("out")["state_hash"].clone())
    };
    let (native, _) = run("native", "2");
    let (lgg, hash) = run("liggghts", "2");
    assert_eq!(hash, run("liggghts", "1").1, "1 thread");
    assert_eq!(hash, run("liggghts", "3").1, "3 threads");
    assert_eq!(native.len(), lgg.len());
    for (a, b) in native.iter().zip(&lgg).skip(1) {
        assert!((a / b - 1.0).abs() < 0.01, "{a} {b}");
    }
}

#[test]
fn what_liggghts_says_is_in_its_log() {
    let place = place(8, "[dem.liggghts]\ncommands = [\"group heavy type 1\"]\n");
    place.well(&["run", "case.toml"]);
    has(&place.text("out/liggghts.log"), &["atoms in group heavy", "pair_style gran"]);
}

#[test]
fn a_wrong_command_of_the_user_is_an_error_with_liggghts_words_and_no_run() {
    let place = place(8, "[dem.liggghts]\ncommands = [\"fix extra nobody viscous 1\"]\n");
    let said = place.ends(2, &["run", "case.toml"]);
    has(&said, &["Could not find fix group ID", "fix extra nobody viscous 1"]);
}

#[test]
fn a_set_up_that_liggghts_refuses_leaves_the_results_of_the_run_before() {
    let place = place(16, "");
    place.well(&["run", "case.toml"]);
    let read = |name: &str| std::fs::read(place.path("out").join(name)).unwrap();
    let names = ["summary.json", "series.csv", "particles.pvd"];
    let before = names.map(read);
    let refused =
        ["run", "case.toml", "--overwrite", "--set", "dem.liggghts.commands=[\"fix a nobody viscous 1\"]"];
    place.ends(2, &refused);
    assert!(before == names.map(read));
    let log = String::from_utf8(read("liggghts.log")).unwrap();
    assert!(log.contains("fix a nobody viscous 1"), "{log}");
}

fn start(place: &Place) -> Guard {
    Guard::of(place.turbid(&["run", "case.toml", "--quiet"]))
}

/// Waits for the end, and returns what is said until then.
fn end(run: &mut Guard) -> Output {
    let status = poll("the end of the run", || run.0.try_wait().unwrap());
    let mut output = Output { status, stdout: Vec::new(), stderr: Vec::new() };
    run.0.stdout.take().unwrap().read_to_end(&mut output.stdout).unwrap();
    run.0.stderr.take().unwrap().read_to_end(&mut output.stderr).unwrap();
    output
}

/// The process that `parent` has started as LIGGGHTS's worker, and that has been set up.
fn worker_of(parent: &Guard, place: &Place) -> i32 {
    let start = Instant::now();
    while start.elapsed() < Duration::from_secs(30) {
        // After the first row.
        if rows(&place.path("out/series.csv")) > 3 {
            for entry in std::fs::read_dir("/proc").unwrap().flatten() {
                let Some(pid) = entry.file_name().to_str().and_then(|name| name.parse().ok()) else {
                    continue;
                };
                let stat = std::fs::read_to_string(entry.path().join("stat")).unwrap_or_default();
                let mut after = stat.rsplit(')').next().unwrap_or("").split_whitespace();
                if after.nth(1) == Some(&parent.0.id().to_string()) {
                    return pid;
                }
            }
        }
        std::thread::yield_now();
    }
    panic!("there is no worker");
}

#[test]
fn a_worker_that_is_killed_ends_the_run_within_a_second_with_its_outputs_intact() {
    for (signal, word) in [(libc::SIGKILL, "SIGKILL"), (libc::SIGABRT, "SIGABRT")] {
        let place = place(1_000_000, "");
        let mut run = start(&place);
        let worker = worker_of(&run, &place);
        let killed = Instant::now();
        // SAFETY: sends a signal to a process that this test has started.
        assert_eq!(unsafe { libc::kill(worker, signal) }, 0);
        let output = end(&mut run);
        assert!(killed.elapsed() < Duration::from_secs(1), "{:?}", killed.elapsed());
        let said = words(&output);
        assert_eq!(output.status.code(), Some(3), "{said}");
        assert!(said.contains("liggghts engine failed at step") && said.contains(word), "{said}");
        let rows = column(&place.path("out/series.csv"), "t (s)");
        assert!(rows.len() > 2 && rows.is_sorted(), "{rows:?}");
        for entry in std::fs::read_dir(place.path("out")).unwrap() {
            let name = entry.unwrap().file_name().into_string().unwrap();
            assert!(Path::new(&name).extension().is_none_or(|end| end != "tmp"), "half-written: {name}");
        }
    }
}

#[test]
fn a_run_that_is_killed_leaves_no_worker_behind() {
    let place = place(1_000_000, "");
    let mut run = start(&place);
    let worker = worker_of(&run, &place);
    run.0.kill().unwrap();
    run.0.wait().unwrap();
    let start = Instant::now();
    while Path::new(&format!("/proc/{worker}")).exists() && start.elapsed() < Duration::from_secs(5) {
        let stat = std::fs::read_to_string(format!("/proc/{worker}/stat")).unwrap_or_default();
        if stat.contains(") Z ") {
            break;
        }
        std::thread::yield_now();
    }
    assert!(start.elapsed() < Duration::from_secs(5), "the worker lives on");
}

/// True if a process is there and not merely waiting to be collected.
fn lives(process: i32) -> bool {
    let stat = std::fs::read_to_string(format!("/proc/{process}/stat")).unwrap_or_default();
    !stat.is_empty() && !stat.contains(") Z ")
}

/// The end of a run whose worker is stopped, and that gets this signal then.
fn after_its_worker_is_stopped(more: &str, signal: Option<i32>) -> (Output, i32) {
    let place = place(1_000_000, more);
    let mut run = start(&place);
    let worker = worker_of(&run, &place);
    // SAFETY: sends signals to processes that this test has started.
    assert_eq!(unsafe { libc::kill(worker, libc::SIGSTOP) }, 0);
    if let Some(signal) = signal {
        let run = run.0.id() as libc::pid_t;
        // SAFETY: as above.
        assert_eq!(unsafe { libc::kill(run, signal) }, 0);
    }
    let output = end(&mut run);
    assert!(column(&place.path("out/series.csv"), "t (s)").len() > 2);
    (output, worker)
}

#[test]
fn a_worker_that_is_stopped_ends_the_run_after_the_time_limit_and_is_ended_itself() {
    let (output, worker) = after_its_worker_is_stopped("[dem.liggghts]\ntimeout = 2\n", None);
    let said = words(&output);
    assert_eq!(output.status.code(), Some(3), "{said}");
    assert!(
        said.contains("liggghts engine failed at step") && said.contains("has not answered for 2.0 s"),
        "{said}"
    );
    assert!(said.contains("dem.liggghts.timeout"), "{said}");
    assert!(!lives(worker), "the worker lives on");
}

#[test]
fn a_run_that_waits_for_a_stopped_worker_ends_at_sigterm() {
    let (output, worker) = after_its_worker_is_stopped("", Some(libc::SIGTERM));
    let said = words(&output);
    assert_eq!(output.status.code(), Some(3), "{said}");
    assert!(said.contains("and the run is to stop"), "{said}");
    assert!(!lives(worker), "the worker lives on");
}

#[test]
fn no_file_of_a_run_has_a_name_that_others_foresee_and_odd_names_of_directories_do_no_harm() {
    let place = place(16, "");
    let odd = "it's \"a\" $d";
    let temporary = place.path(odd);
    std::fs::create_dir(&temporary).unwrap();
    let finishes = |arguments: &[&str]| {
        well(place.limited(arguments).env("TMPDIR", &temporary));
        for entry in std::fs::read_dir(&temporary).unwrap() {
            let name = entry.unwrap().file_name().into_string().unwrap();
            assert!(!name.contains("turbid") && !name.contains("restart"), "{name}");
        }
    };
    let out = format!("{odd}#r %*");
    finishes(&["run", "case.toml", "--out", &out, "--set", "output.checkpoint_every={ steps = 8 }"]);
    finishes(&["resume", &out, "--set", "run.end={ steps = 24 }"]);
    has(&place.text(&format!("{out}/liggghts.log")), &["pair_style gran"]);
}

#[test]
fn a_log_that_is_a_link_is_not_followed() {
    let place = place(8, "");
    place.write("mine", "precious");
    std::fs::create_dir(place.path("out")).unwrap();
    std::os::unix::fs::symlink(place.path("mine"), place.path("out/liggghts.log")).unwrap();
    has(&place.ends(2, &["run", "case.toml"]), &["liggghts.log"]);
    assert_eq!(place.text("mine"), "precious");
}
