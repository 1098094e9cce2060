//! Four-way runs with LIGGGHTS moving the particles, end to end.

use super::child::poll;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

/// Few spheres in a small box; the rest is appended.
const CASE: &str = r#"
[domain]
size = { diameters = [4, 4, 4] }

[fluid]
density = 1000.0
archimedes = 1000

[lattice]
cells_per_diameter = 8
relaxation_time = 0.55

[[particles]]
shape = { sphere = { diameter = 1.5e-3 } }
density = 3300.0
volume_fraction = 0.2
seed = 1

[dem]
engine = "liggghts"
"#;

fn turbid(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_turbid"));
    command.args(arguments).current_dir(folder);
    command
}

/// A folder with the case, which ends after so many steps.
fn folder(steps: u64, more: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let output = "[output]\ndirectory = \"out\"\nseries_every = { steps = 8 }\n";
    let text = format!("{CASE}{more}\n[run]\nend = {{ steps = {steps} }}\n{output}");
    std::fs::write(folder.path().join("case.toml"), text).unwrap();
    folder
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// The numbers of a column of `series.csv`.
fn column(folder: &Path, name: &str) -> Vec<f64> {
    let mut reader = csv::Reader::from_path(folder.join("out/series.csv")).unwrap();
    let at = reader.headers().unwrap().iter().position(|h| h == name).unwrap();
    reader
        .records()
        .map(|r| r.unwrap()[at].parse().unwrap())
        .collect()
}

#[test]
fn a_run_with_liggghts_is_that_of_the_native_engine_and_the_same_on_any_number_of_threads() {
    let run = |engine: &str, threads: &str| {
        let folder = folder(400, "");
        let engine = format!("dem.engine={engine}");
        let arguments = ["run", "case.toml", "--set", &engine, "--threads", threads];
        let output = turbid(folder.path(), &arguments).output().unwrap();
        assert!(output.status.success(), "{}", stderr(&output));
        let text = std::fs::read_to_string(folder.path().join("out/summary.json")).unwrap();
        let summary: serde_json::Value = serde_json::from_str(&text).unwrap();
        let settling = column(folder.path(), "settling_velocity_over_stokes (-)");
        (settling, summary["state_hash"].clone())
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
    let folder = folder(8, "[dem.liggghts]\ncommands = [\"group heavy type 1\"]\n");
    let output = turbid(folder.path(), &["run", "case.toml"]).output().unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    let log = std::fs::read_to_string(folder.path().join("out/liggghts.log")).unwrap();
    assert!(
        log.contains("atoms in group heavy") && log.contains("pair_style gran"),
        "{log}"
    );
}

#[test]
fn a_wrong_command_of_the_user_is_an_error_with_liggghts_words_and_no_run() {
    let folder = folder(8, "[dem.liggghts]\ncommands = [\"fix extra nobody viscous 1\"]\n");
    let output = turbid(folder.path(), &["run", "case.toml"]).output().unwrap();
    let said = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(
        said.contains("Could not find fix group ID") && said.contains("fix extra nobody viscous 1"),
        "{said}"
    );
}

#[test]
fn a_set_up_that_liggghts_refuses_leaves_the_results_of_the_run_before() {
    let folder = folder(16, "");
    let output = turbid(folder.path(), &["run", "case.toml"]).output().unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    let read = |name: &str| std::fs::read(folder.path().join("out").join(name)).unwrap();
    let names = ["summary.json", "series.csv", "particles.pvd"];
    let before = names.map(read);
    let refused = [
        "run",
        "case.toml",
        "--overwrite",
        "--set",
        "dem.liggghts.commands=[\"fix a nobody viscous 1\"]",
    ];
    let output = turbid(folder.path(), &refused).output().unwrap();
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert!(before == names.map(read));
    let log = String::from_utf8(read("liggghts.log")).unwrap();
    assert!(log.contains("fix a nobody viscous 1"), "{log}");
}

/// A run that does not outlive its test.
struct Running(Option<Child>);

impl Running {
    fn start(folder: &Path) -> Self {
        let mut command = turbid(folder, &["run", "case.toml", "--quiet"]);
        Self(Some(command.stderr(Stdio::piped()).spawn().unwrap()))
    }

    fn child(&mut self) -> &mut Child {
        self.0.as_mut().unwrap()
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        if let Some(child) = &mut self.0 {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

/// The process that `parent` has started as LIGGGHTS's worker, and that has been set up.
fn worker_of(parent: &Child, folder: &Path) -> i32 {
    let start = Instant::now();
    while start.elapsed() < Duration::from_secs(30) {
        if column_is_there(folder) {
            for entry in std::fs::read_dir("/proc").unwrap().flatten() {
                let Some(pid) = entry.file_name().to_str().and_then(|name| name.parse().ok()) else {
                    continue;
                };
                let stat = std::fs::read_to_string(entry.path().join("stat")).unwrap_or_default();
                let mut after = stat.rsplit(')').next().unwrap_or("").split_whitespace();
                if after.nth(1) == Some(&parent.id().to_string()) {
                    return pid;
                }
            }
        }
        std::thread::yield_now();
    }
    panic!("there is no worker");
}

/// Whether the run has written a row of its series after the first.
fn column_is_there(folder: &Path) -> bool {
    std::fs::read_to_string(folder.join("out/series.csv")).is_ok_and(|text| text.lines().count() > 3)
}

#[test]
fn a_worker_that_is_killed_ends_the_run_within_a_second_with_its_outputs_intact() {
    for (signal, word) in [(libc::SIGKILL, "SIGKILL"), (libc::SIGABRT, "SIGABRT")] {
        let folder = folder(1_000_000, "");
        let mut run = Running::start(folder.path());
        let worker = worker_of(run.child(), folder.path());
        let killed = Instant::now();
        // SAFETY: sends a signal to a process that this test has started.
        assert_eq!(unsafe { libc::kill(worker, signal) }, 0);
        let output = run.0.take().unwrap().wait_with_output().unwrap();
        assert!(
            killed.elapsed() < Duration::from_secs(1),
            "{:?}",
            killed.elapsed()
        );
        let said = stderr(&output);
        assert_eq!(output.status.code(), Some(3), "{said}");
        assert!(
            said.contains("liggghts engine failed at step") && said.contains(word),
            "{said}"
        );
        let rows = column(folder.path(), "t (s)");
        assert!(rows.len() > 2 && rows.is_sorted(), "{rows:?}");
        for entry in std::fs::read_dir(folder.path().join("out")).unwrap() {
            let name = entry.unwrap().file_name().into_string().unwrap();
            assert!(
                Path::new(&name).extension().is_none_or(|end| end != "tmp"),
                "half-written: {name}"
            );
        }
    }
}

#[test]
fn a_run_that_is_killed_leaves_no_worker_behind() {
    let folder = folder(1_000_000, "");
    let mut run = Running::start(folder.path());
    let worker = worker_of(run.child(), folder.path());
    run.child().kill().unwrap();
    run.child().wait().unwrap();
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

/// Whether a process is there and not merely waiting to be collected.
fn lives(process: i32) -> bool {
    let stat = std::fs::read_to_string(format!("/proc/{process}/stat")).unwrap_or_default();
    !stat.is_empty() && !stat.contains(") Z ")
}

/// The end of a run whose worker is stopped, and that gets this signal then.
fn after_its_worker_is_stopped(more: &str, signal: Option<i32>) -> (Output, i32) {
    let folder = folder(1_000_000, more);
    let mut run = Running::start(folder.path());
    let worker = worker_of(run.child(), folder.path());
    // SAFETY: sends signals to processes that this test has started.
    assert_eq!(unsafe { libc::kill(worker, libc::SIGSTOP) }, 0);
    if let Some(signal) = signal {
        let run = run.child().id() as libc::pid_t;
        // SAFETY: as above.
        assert_eq!(unsafe { libc::kill(run, signal) }, 0);
    }
    poll("the end of the run", || run.child().try_wait().unwrap());
    let output = run.0.take().unwrap().wait_with_output().unwrap();
    assert!(column(folder.path(), "t (s)").len() > 2);
    (output, worker)
}

#[test]
fn a_worker_that_is_stopped_ends_the_run_after_the_time_limit_and_is_ended_itself() {
    let (output, worker) = after_its_worker_is_stopped("[dem.liggghts]\ntimeout = 2\n", None);
    let said = stderr(&output);
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
    let said = stderr(&output);
    assert_eq!(output.status.code(), Some(3), "{said}");
    assert!(said.contains("and the run is to stop"), "{said}");
    assert!(!lives(worker), "the worker lives on");
}

#[test]
fn no_file_of_a_run_has_a_name_that_others_foresee_and_odd_names_of_directories_do_no_harm() {
    let folder = folder(16, "");
    let odd = "it's \"a\" $d";
    let temporary = folder.path().join(odd);
    std::fs::create_dir(&temporary).unwrap();
    let finishes = |arguments: &[&str]| {
        let output = turbid(folder.path(), arguments)
            .env("TMPDIR", &temporary)
            .output()
            .unwrap();
        assert!(output.status.success(), "{}", stderr(&output));
        for entry in std::fs::read_dir(&temporary).unwrap() {
            let name = entry.unwrap().file_name().into_string().unwrap();
            assert!(!name.contains("turbid") && !name.contains("restart"), "{name}");
        }
    };
    let out = format!("{odd}#r %*");
    finishes(&[
        "run",
        "case.toml",
        "--out",
        &out,
        "--set",
        "output.checkpoint_every={ steps = 8 }",
    ]);
    finishes(&["resume", &out, "--set", "run.end={ steps = 24 }"]);
    let log = std::fs::read_to_string(folder.path().join(out).join("liggghts.log")).unwrap();
    assert!(log.contains("pair_style gran"), "{log}");
}

#[test]
fn a_log_that_is_a_link_is_not_followed() {
    let folder = folder(8, "");
    let target = folder.path().join("mine");
    std::fs::write(&target, "precious").unwrap();
    std::fs::create_dir(folder.path().join("out")).unwrap();
    std::os::unix::fs::symlink(&target, folder.path().join("out/liggghts.log")).unwrap();
    let output = turbid(folder.path(), &["run", "case.toml"]).output().unwrap();
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert!(stderr(&output).contains("liggghts.log"), "{}", stderr(&output));
    assert_eq!(std::fs::read_to_string(&target).unwrap(), "precious");
}
