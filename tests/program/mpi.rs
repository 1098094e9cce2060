//! Runs on the processes of an MPI job, end to end: the same bits as on threads, one voice, no process left waiting.

use crate::common::{PROGRAM, Place, case, column, has_lammps, in_tree, words};
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

/// The spheres for some steps, without pictures, which take longer than all else.
fn crowd(steps: u64) -> String {
    case::crowd(steps, "series_every = { steps = 8 }\npicture_every = \"never\"")
}

/// Turbid on several processes; a job that hangs is ended, and fails.
fn turbid(place: &Place, processes: usize, arguments: &[&str]) -> Output {
    place.limited_job(processes, arguments).output().unwrap()
}

/// The hash of the state at the end and the bytes of the series.
fn result(place: &Place) -> (String, Vec<u8>) {
    let series = std::fs::read(place.path("out/series.csv")).unwrap();
    (place.summary("out")["state_hash"].to_string(), series)
}

/// Result on this number of threads of one process.
fn on_threads(place: &Place, threads: &str, more: &[&str]) -> (String, Vec<u8>) {
    let run = ["run", "case.toml", "--overwrite", "--quiet", "--threads", threads];
    place.well(&[&run, more].concat());
    result(place)
}

#[test]
fn two_three_and_five_processes_find_the_bits_of_one_thread() {
    let place = Place::new(&crowd(60));
    let expected = on_threads(&place, "1", &[]);
    for processes in [2, 3, 5] {
        let output = turbid(&place, processes, &["run", "case.toml", "--overwrite"]);
        let said = words(&output);
        assert!(output.status.success(), "{said}");
        assert_eq!(said.matches("state hash").count(), 1, "one speaks: {said}");
        assert!(result(&place) == expected, "{processes} processes");
    }
}

#[cfg(feature = "liggghts")]
#[test]
fn a_run_of_64_processes_resumes_on_27_with_the_bits_of_2_threads() {
    let place = Place::empty();
    std::fs::copy(in_tree("cases/hindered_settling.toml"), place.path("case.toml")).unwrap();
    let run = [
        "run",
        "case.toml",
        "--quiet",
        "--out",
        "out",
        "--set",
        "output.picture_every=never",
        "--set",
        "output.checkpoint_every={ steps = 12 }",
    ];
    let [half, whole] = [["--set", "run.end={ steps = 12 }"], ["--set", "run.end={ steps = 24 }"]];
    for (processes, arguments) in
        [(64, [&run[..], &half].concat()), (27, [&["resume", "out", "--quiet"][..], &whole].concat())]
    {
        let output = turbid(&place, processes, &arguments);
        assert!(output.status.success(), "{}", words(&output));
    }
    let hash = place.summary("out")["state_hash"].clone();
    place.well(&[&run[..], &whole, &["--threads", "2", "--overwrite"]].concat());
    assert_eq!(place.summary("out")["state_hash"], hash);
}

#[test]
fn liggghts_moves_the_particles_of_all_processes() {
    let place = Place::new(&crowd(60));
    let engine = ["--set", "dem.engine=liggghts"];
    let expected = on_threads(&place, "2", &engine);
    let output = turbid(&place, 3, &[&["run", "case.toml", "--overwrite", "--quiet"], &engine[..]].concat());
    assert!(output.status.success(), "{}", words(&output));
    assert!(result(&place) == expected);
}

/// The velocity of settling over time.
fn settling(place: &Place) -> Vec<f64> {
    column(&place.path("out/series.csv"), "settling_velocity_over_stokes (-)")
}

#[cfg(feature = "liggghts")]
#[test]
fn liggghts_in_all_processes_settles_as_its_worker_does_and_resumes_on_another_number() {
    settles_in_all_processes("liggghts");
}

#[test]
fn lammps_in_all_processes_settles_as_its_worker_does_and_resumes_on_another_number() {
    if has_lammps() {
        settles_in_all_processes("lammps");
    }
}

/// Fails unless this engine in all processes settles as in its worker, also after resuming on another number of processes.
fn settles_in_all_processes(engine: &str) {
    let place = Place::new(&crowd(240));
    let process = format!("dem.{engine}.process=own");
    let engine = ["--set", &format!("dem.engine={engine}")];
    on_threads(&place, "2", &engine);
    let expected = settling(&place);
    let agrees = |place: &Place, what: &str| {
        let found = settling(place);
        assert_eq!(found.len(), expected.len(), "{what}");
        for (a, b) in expected.iter().zip(&found).skip(1) {
            assert!((b / a - 1.0).abs() < 1e-6, "{what}: {a} {b}");
        }
    };
    let run = ["run", "case.toml", "--overwrite", "--quiet", "--set", &process];
    let all = [&run[..], &engine].concat();
    for processes in [1, 2, 4] {
        let output = turbid(&place, processes, &all);
        assert!(output.status.success(), "{}", words(&output));
        agrees(&place, &format!("{processes} processes"));
        // Contacts were seen, and their forces are those of the whole bed.
        assert!(column(&place.path("out/series.csv"), "contacts (-)").iter().any(|contacts| *contacts > 1.0));
    }
    let more = ["--set", "run.end.steps=120", "--set", "output.checkpoint_every={ steps = 60 }"];
    for processes in [1, 2] {
        let output = turbid(&place, 3, &[&all[..], &more].concat());
        assert!(output.status.success(), "{}", words(&output));
        let output = turbid(&place, processes, &["resume", "out", "--quiet", "--set", "run.end.steps=240"]);
        assert!(output.status.success(), "{}", words(&output));
        agrees(&place, &format!("resumed on {processes}"));
    }
}

#[test]
fn liggghts_and_lammps_in_2_processes_pass_their_cross_checks() {
    for engine in ["liggghts", "lammps"].into_iter().filter(|engine| *engine == "liggghts" || has_lammps()) {
        let place = Place::empty();
        let cases =
            ["--case", "static-pair", "--case", "sticking", "--case", "periodic", "--case", "free-flight"];
        let arguments = [&["crosscheck", "--engine", engine, "--out", "out"][..], &cases].concat();
        let output = turbid(&place, 2, &arguments);
        let said = words(&output);
        assert!(output.status.success() && said.matches("checks passed").count() == 1, "{said}");
    }
}

#[test]
fn a_failure_is_said_once_and_ends_all_processes_with_its_exit_code() {
    let place = Place::new(&crowd(60));
    // Far too stiff and fast for the time step.
    let arguments = ["run", "case.toml", "--quiet", "--set", "contact.youngs_modulus=1e12"];
    let output = turbid(&place, 3, &arguments);
    let said = words(&output);
    assert_eq!(output.status.code(), Some(3), "{said}");
    assert_eq!(said.matches("error:").count(), 1, "{said}");
    assert!(said.contains("diverged at step"), "{said}");
}

#[test]
fn bad_input_is_said_once() {
    let place = Place::new(&crowd(60));
    let output = turbid(&place, 3, &["run", "case.toml", "--set", "fluid.density=-1"]);
    let said = words(&output);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert_eq!(said.matches("`fluid.density` is -1").count(), 1, "{said}");
    let output = turbid(&place, 2, &["check", "case.toml"]);
    assert!(output.status.success());
    assert_eq!(words(&output).matches("\n  cells per diameter").count(), 1, "{}", words(&output));
}

#[test]
fn wrong_arguments_are_said_once() {
    let place = Place::new(&crowd(60));
    let output = turbid(&place, 3, &["run", "case.toml", "--cores"]);
    let said = words(&output);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert_eq!(said.matches("unexpected argument '--cores'").count(), 1, "{said}");
}

#[test]
fn what_one_process_alone_finds_wrong_is_said_with_its_number_and_ends_all() {
    let place = Place::new(&crowd(60));
    let program = PROGRAM;
    let arguments = ["run", "case.toml", ":", "-n", "1", program, "run", "missing.toml"];
    let output = turbid(&place, 2, &arguments);
    let said = words(&output);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert_eq!(said.matches("error: rank 2:").count(), 1, "{said}");
    assert_eq!(said.matches("missing.toml").count(), 1, "{said}");
    assert!(!place.path("out").exists(), "{said}");
}

#[test]
fn an_output_folder_that_cannot_be_made_ends_all_processes() {
    let place = Place::new(&crowd(60));
    place.write("file", "");
    let output = turbid(&place, 3, &["run", "case.toml", "--out", "file/out"]);
    let said = words(&output);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert_eq!(said.matches("error:").count(), 1, "{said}");
}

#[test]
fn all_processes_of_a_run_that_is_stopped_end_well_and_the_launcher_reports_their_code() {
    let place = Place::new(&crowd(60));
    let endless = ["--max-walltime", "1s", "--set", "run.end.steps=100000000"];
    let few_files = ["fields", "particles", "picture"].map(|what| format!("--set=output.{what}_every=never"));
    let few_files: Vec<&str> = few_files.iter().map(String::as_str).collect();
    let arguments = [&["run", "case.toml"], &endless[..], &few_files].concat();
    let output = turbid(&place, 2, &arguments);
    let said = words(&output);
    assert_eq!(output.status.code(), Some(4), "{said}");
    // What Open MPI says if one is gone before it has told MPI, or is killed.
    assert!(!said.contains("improper") && !said.contains("signal"), "{said}");
    assert_eq!(said.matches("turbid resume out").count(), 1, "{said}");
    assert!(!said.contains("error:"), "{said}");
}

#[test]
fn results_of_an_earlier_run_are_refused_once_by_all_processes() {
    let place = Place::new(&crowd(60));
    let before = on_threads(&place, "1", &[]);
    let output = turbid(&place, 2, &["run", "case.toml"]);
    let said = words(&output);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert_eq!(said.matches("error:").count(), 1, "{said}");
    assert!(said.contains("--overwrite"), "{said}");
    assert!(result(&place) == before);
}

/// The processes of a job that run turbid, by their rank; found by the folder they were started in.
fn ranks_of(folder: &Path) -> Vec<(usize, u32)> {
    let folder = folder.canonicalize().unwrap();
    let rank = |process: &Path| {
        let here = std::fs::read_link(process.join("cwd")).ok()?;
        let words = std::fs::read(process.join("environ")).ok()?;
        let words = String::from_utf8_lossy(&words).into_owned();
        let rank = words.split('\0').find_map(|word| word.strip_prefix("OMPI_COMM_WORLD_RANK="))?;
        let id = process.file_name()?.to_str()?.parse().ok()?;
        (here == folder).then_some((rank.parse().ok()?, id))
    };
    std::fs::read_dir("/proc").unwrap().filter_map(|entry| rank(&entry.unwrap().path())).collect()
}

#[test]
fn a_killed_rank_ends_all_others_is_named_and_the_checkpoint_before_resumes() {
    // More steps than it can take.
    let place = Place::new(&crowd(10_000_000));
    let every = ["--set", "output.checkpoint_every.steps=8", "--set", "run.average_from.steps=20"];
    let arguments = [&["run", "case.toml", "--quiet"], &every[..]].concat();
    let job = place.limited_job(3, &arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let written = place.path("out/checkpoints/step-0000000024");
    let limit = Instant::now() + Duration::from_secs(60);
    let victim = loop {
        assert!(Instant::now() < limit, "no checkpoint within a minute");
        let ranks = ranks_of(place.folder());
        if written.exists()
            && let Some((_, id)) = ranks.iter().find(|(rank, _)| *rank == 1)
        {
            break *id;
        }
        std::thread::yield_now();
    };
    let killed = Instant::now();
    assert!(Command::new("kill").args(["-KILL", &victim.to_string()]).status().unwrap().success());
    let output = job.wait_with_output().unwrap();
    let took = killed.elapsed();
    let said = words(&output);
    assert!(!output.status.success(), "{said}");
    assert!(took < Duration::from_secs(10), "{took:?}");
    assert!(said.contains("process rank 1"), "{said}");
    assert_eq!(ranks_of(place.folder()), [], "no process is left");

    let newest: Option<u64> = std::fs::read_dir(written.parent().unwrap())
        .unwrap()
        .filter_map(|entry| entry.unwrap().file_name().to_str()?.strip_prefix("step-")?.parse().ok())
        .max();
    let end = newest.expect("one is whole") + 20;
    let end = format!("run.end.steps={end}");
    place.well(&["resume", "out", "--quiet", "--threads", "2", "--set", &end]);
    let resumed = result(&place);
    let alone = on_threads(&place, "1", &[&["--set", &end], &every[..]].concat());
    assert!(resumed == alone);
}

#[test]
fn the_launcher_of_another_mpi_is_refused() {
    let place = Place::new(&crowd(60));
    for (rank, times) in [("0", 1), ("1", 0)] {
        let output = place
            .limited(&["run", "case.toml"])
            .envs([("PMI_RANK", rank), ("PMI_SIZE", "2")])
            .output()
            .unwrap();
        let said = words(&output);
        assert_eq!(output.status.code(), Some(2), "{said}");
        let words = "process 0 of 2, and MPI says that it is process 0 of 1";
        assert_eq!(said.matches(words).count(), times, "{said}");
        assert!(!place.path("out").exists(), "{said}");
    }
}
