//! `turbid resume`, end to end: a run that stops and is resumed, on other ranks, leaves what a run leaves that never stopped.

mod branch;
mod disk;
mod signals;

use crate::common::vtk::{piece, point_data};
use crate::common::{Place, case, files_below, in_tree};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use turbid::output::series::SeriesTable;

/// Thirty spheres for 80 steps, with all kinds of files.
fn crowd() -> String {
    let output = "series_every = { steps = 4 }
fields_every = { steps = 24 }
particles_every = { steps = 16 }
picture_every = { steps = 32 }";
    let end = "end = { steps = 80 }";
    let averaged = format!("{end}\naverage_from = {{ steps = 0 }}");
    case::changed(&case::crowd(80, output), &[(end, &averaged)])
}

/// Sliding, rolling and impacts between walls, without a fluid, in sub-steps.
const DRY: &str = r#"
[domain]
size = [0.03, 0.03, 0.03]
periodic = [false, true, false]

[dry]
impact_speed = 0.6

[[particles]]
shape = { cube = { edge = 3e-3 } }
density = 2500.0
count = 120
seed = 1

[[particles]]
shape = { sphere = { diameter = 3e-3 } }
density = 2500.0
count = 100
seed = 2

[contact]
youngs_modulus = 2e7
poisson_ratio = 0.25
restitution = 0.5
friction_static = 0.4
friction_kinetic = 0.3
substeps = 2

[driving]
gravity = [300.0, 0.0, -900.0]

[run]
end = { steps = 400 }
average_from = { steps = 0 }

[output]
directory = "out"
series_every = { steps = 8 }
average = ["contacts"]
structure = { every = { steps = 40 }, reach = 8e-3, bins = 20, plane = "yz" }
dynamics = { every = { steps = 8 }, lags = 14 }
profiles = [{ axis = "z", bins = 6 }, { axis = "y", bins = 4, about = [0.015, 0, 0.015] }]
profiles_every = { steps = 40 }
particles_every = { steps = 48 }
picture_every = { steps = 160 }
pictures = [{ view = { colour = "contact_force", force_chains = true, size = [500, 300] } }]
"#;

/// Free spheres among bodies that oscillate, follow a table, turn and are free along an axis, whose loads are in the series; the
/// half of the run lies within a period and between two rows of the table.
const PRESCRIBED: &str = r#"
[domain]
size = [3e-3, 3e-3, 3e-3]

[fluid]
density = 1000.0
viscosity = 2e-6

[lattice]
cells_per_diameter = 5
relaxation_time = 0.6

[[walls]]
name = "rod"
rod = { point = [0, 1.03e-3, 2.23e-3], axis = [1, 0, 0], diameter = 5e-4 }
angular_velocity = { oscillation = { amplitude = [20, 0, 0], frequency = 31 } }

[[particles]]
shape = { sphere = { diameter = 5e-4 } }
density = 3000.0
count = 40
seed = 1

[[particles]]
shape = { cube = { edge = 5e-4 } }
density = 3000.0
list = [[0.6e-3, 0.6e-3, 0.6e-3], [2.9e-3, 1.5e-3, 1.5e-3]]

[particles.motion]
velocity = { oscillation = { amplitude = [0, 2e-2, 1e-2], frequency = 23, phase = 60, mean = [1e-2, 0, 0] } }
angular_velocity = [0, 30, 10]

[[particles]]
shape = { cylinder = { diameter = 4e-4, length = 6e-4 } }
density = 3000.0
list = [[1.5e-3, 2.2e-3, 0.8e-3]]

[particles.motion]
velocity = { table = [[0, 1e-2, 0, 0], [0.01, 0, 2e-2, 0], [0.04, -1e-2, 0, 0]] }
free = ["z", "rotation"]

[[particles]]
shape = { sphere = { diameter = 6e-4 } }
density = 3000.0
list = [[0.8e-3, 2.3e-3, 2.2e-3]]
motion = "fixed"

[contact]
substeps = 2

[run]
end = { steps = 160 }
average_from = { steps = 0 }

[output]
directory = "out"
series_every = { steps = 4 }
particles_every = { steps = 16 }
picture_every = { steps = 80 }
fields_every = "never"
"#;

/// A unit cell whose two spheres touch through several images, and a grain between them.
const UNIT_CELL: &str = r#"
[domain]
size = [1.1e-3, 1.1e-3, 1.1e-3]

[fluid]
density = 1000.0
viscosity = 2e-6

[lattice]
cells_per_diameter = 12
relaxation_time = 0.6

[[particles]]
shape = { sphere = { diameter = 9.5e-4 } }
density = 3000.0
list = [{ position = [0, 0, 0], velocity = [2e-2, 1e-2, 0], angular_velocity = [40, 0, 90] }, [5.5e-4, 5.5e-4, 5.5e-4]]

[[particles]]
shape = { cube = { edge = 1.2e-4 } }
density = 3000.0
list = [[5.5e-4, 0, 0]]

[contact]
substeps = 4

[run]
end = { steps = 160 }
average_from = { steps = 0 }

[output]
directory = "out"
series_every = { steps = 4 }
particles_every = { steps = 16 }
picture_every = "never"
fields_every = "never"
"#;

/// A suspension that a force and an acceleration shake between a plate that oscillates and one at rest, in a fluid that starts in motion.
const SHAKEN: &str = r#"
[domain]
size = [2e-3, 2e-3, 3e-3]
periodic = [true, true, false]
faces = { "z+" = { velocity = { oscillation = { amplitude = [2e-2, 0, 0], frequency = 31, phase = 20 } } } }

[fluid]
density = 1000.0
viscosity = 2e-6
start = { poiseuille = { velocity = [5e-3, 0, 0] } }

[lattice]
cells_per_diameter = 5
relaxation_time = 0.6

[[particles]]
shape = { sphere = { diameter = 5e-4 } }
density = 3000.0
count = 20
force = [2e-8, 0, 0]
torque = [0, 1e-12, 0]
granular_temperature = 1e-5

[[particles]]
shape = { sphere = { diameter = 5e-4 } }
density = 3000.0
count = 3
seed = 2
motion = "fixed"

[driving]
body_acceleration = { table = [[0, 0, 0, 0], [0.02, 0.4, 0, 0], [0.04, -0.2, 0, 0]] }
net_flux = [0, 2e-3, 0]

[run]
end = { steps = 160 }
average_from = { steps = 0 }

[output]
directory = "out"
series_every = { steps = 4 }
particles_every = { steps = 80 }
picture_every = "never"
fields_every = "never"
"#;

/// Spheres and cubes that come into a suspension at its top, of which few are there at the start, and go at its bottom.
const COMING: &str = r#"
[domain]
size = [2e-3, 2e-3, 4e-3]
periodic = [true, true, false]

[fluid]
density = 1000.0
viscosity = 2e-6

[lattice]
cells_per_diameter = 5
relaxation_time = 0.6

[[particles]]
shape = { sphere = { diameter = 5e-4 } }
density = 3000.0
count = 5
sizes = { uniform = [0.8, 1.2], steps = 3 }

[[particles]]
shape = { cube = { edge = 4e-4 } }
density = 2000.0
count = 0

[[insertion]]
region = { lower = [0, 0, 3.0e-3], upper = [2e-3, 2e-3, 3.6e-3] }
particle_rate = 400
velocity = [0, 0, -2e-2]
velocity_spread = [5e-3, 5e-3, 0]

[[insertion]]
kind = 1
region = { lower = [0, 0, 1.6e-3], upper = [2e-3, 2e-3, 2.2e-3] }
volume_fraction = 0.1
every = { steps = 30 }

[[removal]]
plane = { point = [0, 0, 1.2e-3], normal = [0, 0, 1] }

[run]
end = { steps = 160 }
average_from = { steps = 0 }

[output]
directory = "out"
series_every = { steps = 4 }
particles_every = { steps = 16 }
picture_every = { steps = 80 }
pictures = [{ view = {} }]
fields_every = "never"
"#;

/// A fluid between plates, which an acceleration drives until it is steady.
const SETTLING_DOWN: &str = r#"
[domain]
size = [8e-4, 8e-4, 12e-4]
periodic = [true, true, false]

[fluid]
density = 1000.0
viscosity = 1e-6

[lattice]
cells_per_diameter = 2
relaxation_time = 1.0

[[particles]]
shape = { sphere = { diameter = 2e-4 } }
density = 1000.0
list = []

[driving]
gravity = 0
body_acceleration = [3e-3, 0, 0]

[run]
end = { steady = { over = { steps = 40 }, at_most = { steps = 2000 } } }
average_from = { steps = 0 }

[output]
directory = "out"
series_every = { steps = 8 }
picture_every = "never"
fields_every = "never"
particles_every = "never"
"#;

/// Stones from a file at places from another one, between a floor and a lid that slides.
const STONES: &str = r#"
[domain]
size = { diameters = [4, 4, 6] }
periodic = [true, true, false]
faces = { "z+" = { velocity = [1e-2, 0, 0] } }

[fluid]
density = 1000.0
archimedes = 1000
precision = "f64"

[lattice]
cells_per_diameter = 6
relaxation_time = 0.6
collision = "trt"

[[particles]]
shape = { mesh = { file = "meshes/stone.stl", equivalent_diameter = 1.5e-3 } }
density = 3300.0
file = "places.csv"

[run]
end = { steps = 80 }
average_from = { steps = 0 }

[output]
directory = "out"
series_every = { steps = 4 }
particles_every = { steps = 16 }
fields_every = "never"
picture_every = "never"
"#;

/// Steps of the whole checkpoints of an output directory, ascending.
fn checkpoints(place: &Place, out: &str) -> Vec<u64> {
    let found = turbid::checkpoint::list(&place.path(out).join("checkpoints")).unwrap();
    found.iter().rev().map(|found| found.step).collect()
}

/// Results of a run: the summary but for what depends on the machine, and the bytes of all other files but checkpoints and logs.
struct Left {
    summary: serde_json::Value,
    files: BTreeMap<PathBuf, Vec<u8>>,
}

impl Left {
    fn of(place: &Place, out: &str) -> Self {
        let mut summary = place.summary(out);
        for key in
            ["mlups", "wall_seconds", "stages", "input", "warnings", "ranks", "threads", "resumed_from"]
        {
            assert!(summary.as_object_mut().unwrap().remove(key).is_some(), "{key}");
        }
        let mut files = files_below(&place.path(out));
        let other = ["summary.json", "liggghts.log"];
        files.retain(|name, _| {
            !name.starts_with("checkpoints") && !other.iter().any(|file| name.ends_with(file))
        });
        for table in ["series.csv", "particle_series.csv"] {
            assert!(files.contains_key(Path::new(table)), "{table}");
        }
        let files = files.into_iter().map(|(name, path)| (name, std::fs::read(path).unwrap()));
        Self { summary, files: files.collect() }
    }

    /// The same numbers, files and bytes.
    fn must_be(&self, other: &Self, what: &str) {
        assert_eq!(self.summary, other.summary, "{what}");
        let names = |left: &Self| left.files.keys().cloned().collect::<Vec<_>>();
        assert_eq!(names(self), names(other), "{what}");
        for (name, bytes) in &self.files {
            assert!(*bytes == other.files[name], "{what}: {} differs", name.display());
        }
    }
}

/// Flips a byte of a file.
fn flip(path: &Path, place: impl FnOnce(usize) -> usize) {
    let mut bytes = std::fs::read(path).unwrap();
    let place = place(bytes.len());
    bytes[place] ^= 0x10;
    std::fs::write(path, bytes).unwrap();
}

/// Half of a run on some threads and the rest on others leave what the whole run leaves, which has these options more.
fn in_two_halves(place: &Place, steps: u64, options: &[&str], whole: &[&str]) {
    let run = |parts: &[&[&str]]| place.well(&parts.concat());
    let [half, end] = [steps / 2, steps].map(|steps| format!("run.end.steps={steps}"));
    let start = ["run", "case.toml", "--overwrite", "--quiet"];
    run(&[&start, options, whole, &["--out", "whole", "--threads", "1"]]);
    let whole = Left::of(place, "whole");
    for (before, after) in [("1", "3"), ("2", "1"), ("4", "2")] {
        // The only checkpoint is that of the end.
        let first = ["--threads", before, "--set", &half, "--set", "output.checkpoint_every.steps=1000"];
        run(&[&start, options, &first]);
        assert_eq!(checkpoints(place, "out"), [steps / 2]);
        let second = ["--threads", after, "--set", &end, "--set", "output.checkpoint_every=never"];
        let said = run(&[&["resume", "out", "--quiet"], &second]);
        assert_eq!(said, "", "quiet");
        Left::of(place, "out").must_be(&whole, &format!("{before} and then {after} threads"));
    }
}

#[test]
fn spheres_in_a_fluid_resume_to_the_bit_on_other_threads() {
    in_two_halves(&Place::new(&crowd()), 80, &[], &[]);
}

#[test]
fn bodies_between_walls_without_a_fluid_resume_to_the_bit_on_other_threads() {
    in_two_halves(&Place::new(DRY), 400, &[], &[]);
}

#[test]
fn a_unit_cell_whose_bodies_touch_through_several_images_resumes_to_the_bit_on_other_threads() {
    in_two_halves(&Place::new(UNIT_CELL), 160, &[], &[]);
}

#[test]
fn prescribed_bodies_resume_to_the_bit_within_a_period_on_other_threads() {
    let place = Place::new(PRESCRIBED);
    in_two_halves(&place, 160, &[], &[]);
    // The text of the case file, which a resumed run does not read.
    let warning = place.summary("out")["warnings"][0].to_string();
    assert!(warning.contains("--> case.toml:"), "{warning}");
}

#[test]
fn a_suspension_that_is_driven_over_time_resumes_to_the_bit_on_other_threads() {
    in_two_halves(&Place::new(SHAKEN), 160, &[], &[]);
}

#[test]
fn a_run_in_which_particles_come_and_go_resumes_to_the_bit_in_the_middle_of_an_insertion_on_other_threads() {
    let place = Place::new(COMING);
    in_two_halves(&place, 160, &[], &[]);
    let series = SeriesTable::read(&place.path("whole/series.csv")).unwrap();
    let last = |name: &str| *series.get(name).unwrap().last().unwrap();
    let [come, gone] = ["inserted", "removed"]
        .map(|what| [0, 1].map(|kind| last(&format!("{what}_particles.{kind}")) as u64).iter().sum::<u64>());
    assert!(come > 10 && gone > 1, "{come} {gone}");
    assert_eq!(place.summary("whole")["particles"].as_u64(), Some(5 + come - gone));
    let mass = 2000.0 * 6.4e-11 * last("inserted_particles.1");
    assert!((last("inserted_mass_particles.1") / mass - 1.0).abs() < 1e-9);
}

#[test]
fn a_run_that_ends_when_it_is_steady_ends_at_the_same_step_when_it_is_resumed_on_other_threads() {
    let place = Place::new(SETTLING_DOWN);
    let start = ["run", "case.toml", "--overwrite", "--quiet"];
    place.well(&[&start[..], &["--out", "whole", "--threads", "1"]].concat());
    let whole = place.summary("whole");
    let steps = whole["steps"].as_u64().unwrap();
    assert!(
        whole["steady"] == true && whole["interrupted"] == false && (200..1900).contains(&steps),
        "{steps}"
    );
    // The slowest mode decays with H^2 / (pi^2 nu), 88 steps: energies change by 1e-3 in 40 steps after 600.
    assert!((450..800).contains(&steps), "{steps}");
    let whole = Left::of(&place, "whole");
    for (before, after) in [("1", "2"), ("2", "1")] {
        let first = ["--threads", before, "--set", "run.end.steady.at_most.steps=400"];
        place.well(&[&start[..], &first].concat());
        assert_eq!(place.summary("out")["steady"], false);
        let second = ["--threads", after, "--set", "run.end.steady.at_most.steps=2000"];
        place.well(&[&["resume", "out", "--quiet"][..], &second].concat());
        Left::of(&place, "out").must_be(&whole, &format!("{before} and then {after} threads"));
        // It is finished: nothing is left to do.
        let again = place.well(&["resume", "out", "--quiet"]);
        assert_eq!(place.summary("out")["steps"].as_u64(), Some(steps), "{again}");
    }
}

#[cfg(feature = "liggghts")]
#[test]
fn spheres_that_liggghts_moves_resume_to_the_bit_on_other_threads() {
    // Saving makes LIGGGHTS build its lists again: a resumed run is as one that was saved and not stopped, but not as one never saved.
    let saved = ["--set", "output.checkpoint_every.steps=40"];
    in_two_halves(&Place::new(&crowd()), 80, &["--set", "dem.engine=liggghts"], &saved);
}

#[test]
fn the_wear_of_a_turning_mesh_resumes_to_the_bit_on_other_threads() {
    let stirrer = "[[walls]]\nname = \"stirrer\"\nangular_velocity = [0, 60, 0]\n\
         mesh = { file = \"octahedron.obj\", unit = \"mm\", position = [0.015, 0.015, 0.012] }\n";
    let place = Place::new(&format!("{DRY}\n{stirrer}"));
    place.write("octahedron.obj", case::octahedron(7));
    in_two_halves(&place, 400, &["--set", "output.wear_every.steps=40"], &[]);
    let last = piece(&place.path("out/wear/wear_0000000400.vtp"));
    assert!(point_data(&last, "friction_work").iter().any(|work| *work > 0.0));
}

#[test]
fn stones_between_sliding_walls_resume_to_the_bit_without_the_files_of_the_case() {
    let place = Place::new(STONES);
    let stone = in_tree("cases/stone.stl");
    std::fs::create_dir(place.path("meshes")).unwrap();
    std::fs::copy(stone, place.path("meshes/stone.stl")).unwrap();
    let places = "x,y,z\n1.5e-3,1.5e-3,2e-3\n4.5e-3,1.5e-3,4e-3\n1.5e-3,4.5e-3,6e-3\n4.5e-3,4.5e-3,2e-3\n";
    place.write("places.csv", places);
    place.well(&["run", "case.toml", "--quiet", "--out", "whole"]);
    let options = ["--set", "run.end.steps=40", "--set", "output.checkpoint_every.steps=40"];
    place.well(&[&["run", "case.toml", "--quiet", "--threads", "2"], &options[..]].concat());
    for file in ["case.toml", "places.csv", "meshes/stone.stl"] {
        std::fs::remove_file(place.path(file)).unwrap();
    }
    std::fs::rename(place.path("out"), place.path("moved")).unwrap();
    place.well(&["resume", "moved", "--quiet", "--threads", "3", "--set", "run.end.steps=80"]);
    Left::of(&place, "moved").must_be(&Left::of(&place, "whole"), "elsewhere");
}

#[cfg(feature = "mpi")]
#[test]
fn processes_resume_what_threads_began_and_threads_what_processes_began() {
    let place = Place::new(&crowd());
    place.well(&["run", "case.toml", "--quiet", "--out", "whole"]);
    let half = [
        "run",
        "case.toml",
        "--overwrite",
        "--quiet",
        "--set",
        "run.end.steps=40",
        "--set",
        "output.checkpoint_every.steps=40",
    ];
    let rest = ["resume", "out", "--quiet", "--set", "run.end.steps=80"];
    let threads = |arguments: &[&str]| place.limited(&[arguments, &["--threads", "3"]].concat());
    for (mut first, mut second) in [
        (place.limited_job(2, &half), threads(&rest)),
        (threads(&half), place.limited_job(5, &rest)),
        (place.limited_job(3, &half), place.limited_job(2, &rest)),
    ] {
        for half in [&mut first, &mut second] {
            crate::common::well(half);
        }
        // Processes write frames in pieces, whose contents `pieces.rs` compares.
        let in_one_file = |left: Left| {
            let one = |name: &Path| name.extension().is_some_and(|kind| kind == "csv" || kind == "png");
            Left { files: left.files.into_iter().filter(|(name, _)| one(name)).collect(), ..left }
        };
        let whole = in_one_file(Left::of(&place, "whole"));
        assert!(whole.files.len() > 4);
        in_one_file(Left::of(&place, "out")).must_be(&whole, &format!("{first:?}, then {second:?}"));
    }
}

#[test]
fn a_run_that_is_resumed_twice_keeps_the_intervals_of_its_first_length() {
    // Rows and frames by their defaults, which depend on the length.
    let case = crowd();
    let case = case.split("series_every").next().unwrap().replace("average_from = { steps = 0 }\n", "");
    let place = Place::new(&case);
    place.well(&["run", "case.toml", "--quiet", "--set", "output.checkpoint_every.steps=50"]);
    for end in ["run.end.steps=100", "run.end.steps=110"] {
        place.well(&["resume", "out", "--quiet", "--set", end]);
    }
    let frames = |folder: &str| std::fs::read_dir(place.path("out").join(folder)).unwrap().count();
    // Every 16 steps and at the end, and every 8.
    assert_eq!((frames("fields"), frames("pictures")), (8, 28));
    let summary = place.summary("out");
    let input = summary["input"].as_str().unwrap();
    assert!(input.contains("[run.average_from]\nsteps = 26"), "{input}");
}

#[test]
fn a_damaged_checkpoint_is_named_and_the_one_before_it_used() {
    let place = Place::new(&crowd());
    place.well(&["run", "case.toml", "--quiet", "--out", "whole"]);
    let options = ["--set", "run.end.steps=60", "--set", "output.checkpoint_every.steps=20"];
    place.well(&[&["run", "case.toml", "--quiet", "--threads", "2"], &options[..]].concat());
    assert_eq!(checkpoints(&place, "out"), [40, 60]);
    flip(&place.path("out/checkpoints/step-0000000060/part-00001.bin"), |length| length - 9);
    // A checkpoint that was being written when the run was killed.
    std::fs::create_dir(place.path("out/checkpoints/step-0000000080.partial")).unwrap();
    let said = place.well(&["resume", "out", "--threads", "3", "--quiet", "--set", "run.end.steps=80"]);
    assert_eq!(said.matches("warning").count(), 1, "{said}");
    assert!(said.contains("checkpoint step-0000000060: part 1, plane z = 29 is damaged"), "{said}");
    Left::of(&place, "out").must_be(&Left::of(&place, "whole"), "from step 40");
    assert_eq!(checkpoints(&place, "out"), [60, 80]);
}

#[test]
fn if_no_checkpoint_is_sound_each_is_named_and_nothing_is_changed() {
    let place = Place::new(&crowd());
    place.well(&["run", "case.toml", "--quiet", "--set", "output.checkpoint_every.steps=40"]);
    let before = Left::of(&place, "out");
    flip(&place.path("out/checkpoints/step-0000000040/manifest.toml"), |_| 100);
    flip(&place.path("out/checkpoints/step-0000000080/part-00000.bin"), |_| 30);
    let said = place.ends(2, &["resume", "out"]);
    assert!(said.contains("checkpoint step-0000000040: manifest.toml is damaged"), "{said}");
    assert!(said.contains("checkpoint step-0000000080: part 0: its head is damaged"), "{said}");
    Left::of(&place, "out").must_be(&before, "after a refusal");
}

#[test]
fn what_cannot_be_resumed_is_refused_with_a_remedy() {
    let place = Place::new(&crowd());
    place.well(&["run", "case.toml", "--quiet", "--set", "output.checkpoint_every.steps=40"]);
    let before = Left::of(&place, "out");
    for (arguments, words) in [
        (&["resume", "nowhere"][..], &["nowhere/checkpoints", "output.checkpoint_every"][..]),
        (&["resume", "out", "--set", "fluid.density=900"], &["fluid.density=900", "only keys below"]),
        (&["resume", "out", "--set", "output.directory=b"], &["its own directory"]),
        (&["resume", "out", "--set", "run.end.steps=79"], &["has done 80 steps", "later end"]),
        (&["resume", "out", "--threads", "5000"], &["too many", "--threads"]),
        (&["resume", "out", "--max-walltime", "soon"], &["01:30:00"]),
    ] {
        let said = place.ends(2, arguments);
        assert!(words.iter().all(|word| said.contains(word)), "{arguments:?}: {said}");
    }
    Left::of(&place, "out").must_be(&before, "after refusals");
    // A run that is at its end stays as it is.
    let said = place.well(&["resume", "out", "--threads", "2"]);
    assert!(said.contains("state hash"), "{said}");
    Left::of(&place, "out").must_be(&before, "at its end");
}

#[test]
fn a_fresh_run_replaces_the_one_before_only_when_it_is_told_to() {
    let place = Place::new(&crowd());
    place.well(&["run", "case.toml", "--quiet", "--set", "output.checkpoint_every.steps=40"]);
    place.write("out/checkpoints/notes", "mine");
    let before = Left::of(&place, "out");
    let said = place.ends(2, &["run", "case.toml"]);
    for word in [
        "the output directory out holds the results of an earlier run: summary.json, ",
        " other files, 2 checkpoints, the last of step 80",
        "turbid resume out",
        "--out",
        "--overwrite",
    ] {
        assert!(said.contains(word), "{word}: {said}");
    }
    Left::of(&place, "out").must_be(&before, "after a refusal");
    assert_eq!(checkpoints(&place, "out"), [40, 80]);
    place.well(&["run", "case.toml", "--quiet", "--overwrite"]);
    assert_eq!(checkpoints(&place, "out"), [80]);
    assert!(place.path("out/checkpoints/notes").exists());
}
