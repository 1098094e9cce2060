//! The libraries are installed, and the example is built with them by its Makefile, and runs.

use std::path::Path;
use std::process::Command;
use turbid::simulation::Session;

/// Output of a command, which must succeed.
fn output(command: &mut Command) -> String {
    let done = command.output().unwrap_or_else(|why| panic!("{command:?}: {why}"));
    assert!(done.status.success(), "{command:?}: {}", String::from_utf8_lossy(&done.stderr));
    String::from_utf8(done.stdout).unwrap()
}

/// The case that the example has as a text of C.
fn case(source: &str) -> String {
    let (_, text) = source.split_once("*CASE =").unwrap();
    let (text, _) = text.split_once(';').unwrap();
    text.lines()
        .filter_map(|line| line.trim().strip_prefix('"')?.strip_suffix("\\n\""))
        .collect::<Vec<_>>()
        .join("\n")
}

/// The installed libraries, and examples that are built with them, in a folder.
fn built(examples: &[&str]) -> tempfile::TempDir {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let built = std::env::current_exe().unwrap().parent().unwrap().to_owned();
    let place = tempfile::tempdir().unwrap();
    let prefix = place.path().join("turbid");
    let make = |at: &Path| {
        let mut make = Command::new("make");
        make.arg("-C").arg(at).env("PKG_CONFIG_PATH", prefix.join("lib/pkgconfig"));
        make
    };
    let variable = |name: &str, value: &Path| format!("{name}={}", value.display());
    output(make(folder).args(["install", &variable("PREFIX", &prefix), &variable("LIBDIR", &built)]));
    let targets = examples.iter().map(|example| place.path().join(example));
    output(make(&folder.join("examples")).arg(variable("OUT", place.path())).args(targets));
    place
}

#[test]
fn a_dem_in_c_has_the_velocity_of_the_native_engine_and_its_spheres_come_to_rest() {
    let place = built(&["settling"]);
    let printed = output(Command::new(place.path().join("settling")).arg("0.25"));

    let source = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/spheres.h")).unwrap();
    let setup = turbid::case::from_text(&case(&source), "settling", &["run.threads=1".into()]).unwrap();
    let native = Session::new(setup).unwrap();
    native.run_until(0.02).unwrap();
    let native = native.particles().unwrap()[0].velocity().z;
    let (_, own) = printed.split_once("0.02 s: ").unwrap();
    let own: f64 = own.split_whitespace().next().unwrap().parse().unwrap();
    assert!((own / native - 1.0).abs() < 0.01, "{own} m/s in C, {native} m/s by the native engine");

    let heights = printed.lines().last().unwrap().split_whitespace().skip(1);
    let heights: Vec<f64> = heights.map(|height| height.parse().unwrap()).collect();
    assert!(heights.iter().all(|z| (0.49..2.6).contains(z)), "on the floor, or on others: {printed}");
    assert!(heights.iter().any(|z| *z < 0.51), "none is on the floor: {printed}");
}

#[cfg(feature = "mpi")]
#[test]
fn a_dem_in_3_processes_whose_spheres_wander_between_them_prints_what_it_prints_in_one() {
    let place = built(&["settling", "settling_mpi"]);
    let alone = output(Command::new(place.path().join("settling")).arg("0.1"));
    let mut job = Command::new("timeout");
    job.args(["--kill-after=5", "120", "mpirun", "-n", "3"])
        .arg(place.path().join("settling_mpi"))
        .arg("0.1");
    job.envs([
        ("OMPI_ALLOW_RUN_AS_ROOT", "1"),
        ("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1"),
        ("OMPI_MCA_rmaps_base_oversubscribe", "1"),
        ("OMPI_MCA_mpi_yield_when_idle", "1"),
        ("OMPI_MCA_hwloc_base_binding_policy", "none"),
    ]);
    let done = job.output().unwrap();
    let said = String::from_utf8(done.stderr).unwrap();
    assert!(done.status.success(), "{said}");
    assert_eq!(String::from_utf8(done.stdout).unwrap(), alone);
    let (_, moves) = said.split_once("another process: ").unwrap();
    assert!(moves.trim().parse::<u32>().unwrap() >= 3, "{said}");
}
