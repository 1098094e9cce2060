//! Checkpoints that an earlier build has written, in `tests/golden/`: this build resumes them to the same bits.
//!
//! A failure here means that checkpoints of users cannot be resumed, or resume to something else. If that is meant, raise
//! `FORMAT` in `src/checkpoint/manifest.rs`, say so in the changelog, and make them anew:
//!
//! ```sh
//! cargo test --test program golden -- --ignored
//! ```

use crate::common::{Place, in_tree};
use std::fs;
use std::path::{Path, PathBuf};

/// Two spheres that press on each other, which slide and roll, in a sheared fluid.
const CASE: &str = r#"
[domain]
size = { diameters = [2.5, 2.5, 2.5] }
periodic = [true, true, false]
faces = { "z+" = { velocity = [2e-3, 0, 0] } }

[fluid]
density = 1000.0
archimedes = 100

[lattice]
cells_per_diameter = 2
relaxation_time = 0.6

[[particles]]
shape = { sphere = { diameter = 1e-3 } }
density = 2500.0
file = "places.csv"

[contact]
youngs_modulus = 1e3
friction_static = 0.3
friction_kinetic = 0.2

[run]
end = { steps = 10 }

[output]
directory = "out"
series_every = { steps = 10 }
fields_every = "never"
particles_every = "never"
picture_every = "never"
"#;
const PLACES: &str = "x,y,z\n6e-4,6e-4,7e-4\n6.2e-4,6.5e-4,1.6995e-3\n";
/// Steps until the checkpoint, and to the end.
const STEPS: [u64; 2] = [10, 20];
const PRECISIONS: [&str; 2] = ["f32", "f64"];

fn golden(precision: &str) -> PathBuf {
    in_tree("tests/golden").join(precision)
}

/// Turbid up to a step; it must end well.
fn turbid(place: &Place, arguments: &[&str], end: u64) {
    let end = format!("run.end.steps={end}");
    place.well(&[arguments, &["--quiet", "--threads", "1", "--set", &end]].concat());
}

/// Resumes from the checkpoint in the folder `out`: the hash of the state at the end.
fn resume(place: &Place) -> String {
    turbid(place, &["resume", "out"], STEPS[1]);
    place.summary("out")["state_hash"].as_str().unwrap().to_string()
}

/// Copies a folder with all that is in it.
fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let path = entry.unwrap().path();
        let copied = to.join(path.file_name().unwrap());
        if path.is_dir() {
            copy(&path, &copied);
        } else {
            fs::copy(&path, copied).unwrap();
        }
    }
}

#[test]
fn checkpoints_of_an_earlier_build_resume_to_its_state() {
    for precision in PRECISIONS {
        let recorded = fs::read_to_string(golden(precision).join("state_hash")).unwrap();
        let place = Place::empty();
        copy(&golden(precision), &place.path("out"));
        assert_eq!(resume(&place), recorded.trim(), "{precision}");
    }
}

#[test]
#[ignore = "makes tests/golden anew"]
fn write_the_golden_checkpoints() {
    for precision in PRECISIONS {
        let place = Place::new(CASE);
        place.write("places.csv", PLACES);
        let [precise, every] =
            [format!("fluid.precision={precision:?}"), format!("output.checkpoint_every.steps={}", STEPS[0])];
        let run = ["run", "case.toml", "--set", &precise, "--set", &every];
        turbid(&place, &run, STEPS[0]);

        let (out, kept) = (place.path("out"), golden(precision));
        let _ = fs::remove_dir_all(&kept);
        copy(&out.join("checkpoints"), &kept.join("checkpoints"));
        for table in ["series.csv", "particle_series.csv"] {
            fs::copy(out.join(table), kept.join(table)).unwrap();
        }
        fs::write(kept.join("state_hash"), resume(&place) + "\n").unwrap();
    }
}
