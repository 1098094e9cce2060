//! Complete runs that are resumed or extended, branches of a run, and checkpoints that are of another run.

use super::{DRY, Left, checkpoints};
use crate::common::{Place, case, column, files_below, has};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// The crowd of the other tests, without pictures and fields.
fn crowd() -> String {
    let output = "series_every = { steps = 4 }\nparticles_every = { steps = 16 }\nfields_every = \"never\"\npicture_every = \"never\"";
    let end = "end = { steps = 80 }";
    case::changed(&case::crowd(80, output), &[(end, &format!("{end}\naverage_from = {{ steps = 0 }}"))])
}

/// All files of a folder.
fn bytes(place: &Place, out: &str) -> BTreeMap<PathBuf, Vec<u8>> {
    let files = files_below(&place.path(out)).into_iter();
    files.map(|(name, path)| (name, std::fs::read(path).unwrap())).collect()
}

fn hash(place: &Place, out: &str) -> String {
    place.summary(out)["state_hash"].to_string()
}

/// The crowd for 40 steps, in `out`.
fn begun() -> Place {
    let place = Place::new(&crowd());
    place.well(&["run", "case.toml", "--quiet", "--threads", "2", "--set", "run.end.steps=40"]);
    place
}

#[test]
fn a_checkpoint_of_another_case_is_refused_and_that_of_the_run_itself_used() {
    let place = begun();
    // Fewer rows, so that the file is long enough for it.
    let rows = ["--set", "output.series_every={ steps = 20 }"];
    let other = ["--set", "particles.0.seed=7", "--set", "run.end.steps=60", "--out", "other"];
    place.well(&[&["run", "case.toml", "--quiet"], &other[..], &rows].concat());
    place.well(&["run", "case.toml", "--quiet", "--out", "whole"]);
    let [own, foreign] = ["step-0000000040", "step-0000000060"].map(|name| format!("out/checkpoints/{name}"));
    std::fs::rename(place.path("other/checkpoints/step-0000000060"), place.path(&foreign)).unwrap();
    // With the foreign one alone nothing can be resumed, and nothing changes.
    std::fs::rename(place.path(&own), place.path("aside")).unwrap();
    let before = bytes(&place, "out");
    let said = place.ends(2, &["resume", "out", "--set", "run.end.steps=80"]);
    has(&said, &["checkpoint step-0000000060 of the case `case`", "out/run.id", "that of another run"]);
    assert_eq!(bytes(&place, "out"), before);
    std::fs::rename(place.path("aside"), place.path(&own)).unwrap();
    let said = place.well(&["resume", "out", "--quiet", "--threads", "3", "--set", "run.end.steps=80"]);
    has(&said, &["warning: checkpoint step-0000000060", "that of another run"]);
    Left::of(&place, "out").must_be(&Left::of(&place, "whole"), "from its own checkpoint");
}

#[test]
fn a_checkpoint_of_another_run_is_refused_though_the_rows_until_then_are_the_same() {
    let output = "series_every = { steps = 1000 }\nparticles_every = \"never\"\nfields_every = \"never\"\npicture_every = \"never\"";
    let place = Place::new(&case::crowd(80, output));
    let run = ["run", "case.toml", "--quiet", "--set"];
    place.well(&[&run[..], &["run.end.steps=8"]].concat());
    let other = ["run.end.steps=12", "--set", "particles.0.seed=7", "--out", "other"];
    place.well(&[&run[..], &other].concat());
    place.well(&["resume", "out", "--out", "branch", "--quiet", "--set", "run.end.steps=10"]);
    // A branch is a run of its own, and one of other ranks and length the same run.
    let id = |out: &str| place.text(&format!("{out}/run.id"));
    place.well(&[&run[..], &["run.end.steps=4", "--threads", "3", "--out", "short"]].concat());
    assert!(id("branch") != id("out") && id("other") != id("out") && id("short") == id("out"));
    std::fs::remove_dir_all(place.path("out/checkpoints")).unwrap();
    for foreign in ["other", "branch"] {
        std::fs::rename(place.path(foreign).join("checkpoints"), place.path("out/checkpoints")).unwrap();
        let before = bytes(&place, "out");
        for arguments in [&["resume", "out"][..], &["resume", "out", "--out", "new"]] {
            let said = place.ends(2, &[arguments, &["--set", "run.end.steps=20"]].concat());
            has(&said, &["out/run.id", id("out").trim(), "another run", id(foreign).trim()]);
        }
        assert_eq!(bytes(&place, "out"), before);
        std::fs::rename(place.path("out/checkpoints"), place.path(foreign).join("checkpoints")).unwrap();
        place.well(&["resume", foreign, "--quiet", "--set", "run.end.steps=14"]);
    }
}

#[test]
fn a_run_leaves_one_checkpoint_at_its_end_unless_that_is_switched_off() {
    let place = Place::new(&crowd());
    for (option, left) in [
        ("run.threads=1", &[80][..]),
        ("output.checkpoint_at_end=false", &[]),
        ("output.checkpoint_every=never", &[]),
        ("output.checkpoint_every={ steps = 30 }", &[60, 80]),
    ] {
        place.well(&["run", "case.toml", "--quiet", "--overwrite", "--set", option]);
        assert_eq!(checkpoints(&place, "out"), left, "{option}");
    }
    let never = ["--set", "output.checkpoint_every=never", "--set", "output.checkpoint_at_end=true"];
    place.well(&[&["run", "case.toml", "--quiet", "--overwrite"], &never[..]].concat());
    assert_eq!(checkpoints(&place, "out"), [80]);
}

#[test]
fn a_complete_run_is_not_computed_again_though_its_last_checkpoint_is_of_an_earlier_step() {
    let place = Place::new(&crowd());
    let options =
        ["--set", "output.checkpoint_every={ steps = 60 }", "--set", "output.checkpoint_at_end=false"];
    place.well(&[&["run", "case.toml", "--quiet"], &options[..]].concat());
    let before = bytes(&place, "out");
    let said = place.well(&["resume", "out"]);
    has(
        &said,
        &[
            "the run is complete, with all of its 80 steps",
            "--set run.end.steps=160",
            "--out NEW",
            "state hash",
        ],
    );
    assert_eq!(place.well(&["resume", "out", "--quiet"]), "");
    assert_eq!(bytes(&place, "out"), before);
}

#[test]
fn an_unchanged_branch_on_other_threads_is_the_rest_of_the_run_and_leaves_its_origin_as_it_was() {
    let place = begun();
    let before = bytes(&place, "out");
    place.well(&["run", "case.toml", "--quiet", "--out", "whole"]);
    let said = place.well(&["resume", "out", "--out", "b", "--threads", "3", "--set", "run.end.steps=80"]);
    has(&said, &["note: a branch of out: fluid and particles continue", "run.end.steps=80"]);
    assert!(!said.contains("dropped"), "{said}");
    assert_eq!(hash(&place, "b"), hash(&place, "whole"));
    assert_eq!(bytes(&place, "out"), before);
    assert_eq!(place.summary("b")["resumed_from"], 40);
    let rows = |out: &str, name: &str| column(&place.path(out).join("series.csv"), name);
    for name in ["step", "settling_velocity", "kinetic_energy_fluid", "hydrodynamic_stress_xx", "contacts"] {
        // A row every 4 steps.
        assert_eq!(rows("b", name), rows("whole", name)[10..], "{name}");
    }
    // A branch is a run like any other.
    place.well(&["resume", "b", "--quiet", "--set", "run.end.steps=100"]);
    place.well(&[
        "run",
        "case.toml",
        "--quiet",
        "--overwrite",
        "--out",
        "whole",
        "--set",
        "run.end.steps=100",
    ]);
    assert_eq!(hash(&place, "b"), hash(&place, "whole"));
}

#[test]
fn a_branch_with_other_contacts_and_gravity_continues_with_the_same_fluid_and_particles() {
    let place = begun();
    // The viscosity follows from the Archimedes number and gravity: of those the case had it is given.
    let viscosity = place.summary("out")["scales"]["viscosity"].to_string();
    let viscosity = format!("fluid.viscosity={viscosity}");
    let changes = [
        "run.end.steps=60",
        "contact.friction_static=0.5",
        "particles.0.density=2500",
        "driving.gravity=[0, 0, -5]",
        &viscosity,
    ];
    let set: Vec<&str> = changes.iter().flat_map(|change| ["--set", change]).collect();
    let said = place.well(&[&["resume", "out", "--out", "b", "--threads", "1"], &set[..]].concat());
    has(
        &said,
        &[
            "a branch of out",
            changes[1],
            changes[3],
            "dropped, as it no longer fits: the history of the contacts",
        ],
    );
    let warnings = place.summary("b")["warnings"].to_string();
    assert!(warnings.contains("a branch of out") && warnings.contains(changes[2]), "{warnings}");
    let rows = |out: &str, name: &str| column(&place.path(out).join("series.csv"), name);
    for name in ["step", "t (s)", "mean_particle_velocity_z", "max_particle_speed"] {
        assert_eq!(rows("b", name)[..1], rows("out", name)[10..], "{name}");
    }
    // The velocity of the fluid in the middle of a collision has half of the coming acceleration, which is another one here.
    let alike = ["resume", "out", "--out", "d", "--quiet", "--set", changes[0], "--set", changes[1]];
    place.well(&alike);
    for name in ["net_flux_z", "kinetic_energy_fluid"] {
        let off = rows("b", name)[0] / rows("out", name)[10] - 1.0;
        assert!(off.abs() < 0.06, "{name}: {off}");
        assert_eq!(rows("d", name)[..1], rows("out", name)[10..], "{name}");
    }
    assert_eq!(rows("b", "step").last(), Some(&60.0));
    // The same on other threads.
    place.well(&[&["resume", "out", "--out", "c", "--threads", "3", "--quiet"], &set[..]].concat());
    assert_eq!(hash(&place, "b"), hash(&place, "c"));
}

#[test]
fn a_branch_with_another_coupling_gives_the_bodies_no_kick() {
    let place = begun();
    let speeds = |out: &str| column(&place.path(out).join("series.csv"), "mean_particle_speed");
    let last = *speeds("out").last().unwrap();
    let set = [
        "--set",
        "run.end.steps=44",
        "--set",
        "output.series_every={ steps = 1 }",
        "--set",
        "lattice.coupling=homogenised",
    ];
    let said = place.well(&[&["resume", "out", "--out", "b"], &set[..]].concat());
    has(&said, &["dropped, as it no longer fits: what the coupling remembers"]);
    let speeds = speeds("b");
    assert_eq!((speeds.len(), speeds[0]), (5, last));
    for speed in speeds {
        assert!((speed / last - 1.0).abs() < 0.2, "{speed} after {last}");
    }
}

#[test]
fn a_branch_of_a_dry_run_may_change_friction_and_gravity() {
    let place = Place::new(DRY);
    place.well(&["run", "case.toml", "--quiet", "--set", "run.end.steps=200"]);
    let set = [
        "--set",
        "run.end.steps=240",
        "--set",
        "contact.friction_static=0.9",
        "--set",
        "driving.gravity=[0, 0, -900]",
    ];
    let said = place.well(&[&["resume", "out", "--out", "b"], &set[..]].concat());
    has(&said, &["a branch of out: particles continue", "the history of the contacts"]);
}

#[test]
fn what_a_branch_cannot_continue_with_is_refused_and_makes_no_folder() {
    let place = begun();
    let refused = |set: &[&str], words: &[&str]| {
        let set: Vec<&str> = set.iter().flat_map(|change| ["--set", change]).collect();
        place.refused(&[&["resume", "out", "--out", "b"], &set[..]].concat(), words);
    };
    let end = "run.end.steps=80";
    refused(&[end, "fluid.density=900"], &["`fluid.density` was 1000", "turbid run"]);
    refused(&[end, "lattice.cells_per_diameter=7"], &["the number of cells was \"[24, 24, 30]\""]);
    refused(&[end, "fluid.precision=f64"], &["`fluid.precision` was \"f32\""]);
    refused(&[end, "particles.0.volume_fraction=0.1"], &["the volume fraction of the particles was"]);
    refused(&[end, "particles.0.shape={ cube = { edge = 1.5e-3 } }"], &["was"]);
    refused(&[end, "domain.periodic=[true, true, false]"], &["was"]);
    refused(&[], &["would begin at step 40, where it ends", "give a later end"]);
    refused(&["run.end.steps=30"], &["give a later end"]);
    place.refused(
        &["resume", "out", "--set", "driving.gravity=[0, 0, -5]"],
        &["only keys below", "--out NEW"],
    );
    place.refused(&["resume", "out", "--out", "out", "--set", end], &["holds the results of an earlier run"]);
    // The remedy for a changed viscosity keeps the time step.
    let set = ["resume", "out", "--out", "b", "--set", end, "--set", "fluid.viscosity=9e-6"];
    let said = place.ends(2, &set);
    let value = said.split("lattice.relaxation_time = ").nth(1).unwrap().split(' ').next().unwrap();
    place.well(&[&set[..], &["--quiet", "--set", &format!("lattice.relaxation_time={value}")]].concat());
}

#[test]
fn a_branch_whose_particles_are_of_other_sections_is_refused() {
    let place = Place::new(&case::changed(
        DRY,
        &[
            ("sphere = { diameter = 3e-3 }", "cube = { edge = 3e-3 }"),
            ("count = 120", "count = 10"),
            ("count = 100", "count = 20"),
        ],
    ));
    let never = ["--set", "output.picture_every=never", "--set"];
    place.well(&[&["run", "case.toml", "--quiet"], &never[..], &["run.end.steps=16"]].concat());
    let swapped = ["run.end.steps=24", "--set", "particles.0.count=20", "--set", "particles.1.count=10"];
    let said = place.ends(2, &[&["resume", "out", "--out", "b"], &never[..], &swapped].concat());
    has(&said, &["the particles of each kind were [10, 20] and would be [20, 10]"]);
}
