//! Structure, dynamics, fronts and averages of a run.

use crate::written;
use std::path::Path;
use turbid::output::directory::{
    CONTACT_FORCES, DYNAMICS, DYNAMICS_MEANS, FRONTS, PAIR_DISTRIBUTION, PAIR_DISTRIBUTION_MEANS, STRUCTURE,
    STRUCTURE_FACTOR, STRUCTURE_FACTOR_MEANS,
};
use turbid::output::{OutputFiles, SeriesTable, Summary, directory};
use turbid::simulation;

/// Spheres and rods that fall into a heap, in a periodic box with a floor.
const HEAP: &str = r#"
[domain]
size = [6e-3, 6e-3, 8e-3]
periodic = [true, true, false]
[dry]
time_step = 2e-5
[[particles]]
shape = { sphere = { diameter = 1e-3 } }
density = 2500.0
volume_fraction = 0.15
granular_temperature = 1e-3
seed = 5
[[particles]]
shape = { capsule = { diameter = 0.8e-3, length = 1.6e-3 } }
density = 2500.0
count = 14
[contact]
youngs_modulus = 1e5
restitution = 0.5
[driving]
gravity = [0, 0, -9]
[run]
end = { steps = 2000 }
average_from = { steps = 1000 }
[output]
structure = { every = { steps = 50 }, reach = 2.9e-3, bins = 40, plane = "xz", shortest_wave = 0.5e-3 }
dynamics = { every = { steps = 20 }, lags = 10 }
average = ["contacts", "wall_force_z"]
particles_every = "never"
picture_every = "never"
checkpoint_every = "never"
"#;

#[test]
fn structure_and_dynamics_of_a_heap_have_the_same_bits_on_1_to_4_ranks() {
    let root = tempfile::tempdir().unwrap();
    let read = |threads: u32| {
        let out = root.path().join(threads.to_string());
        let (_, files) = written(&out, HEAP, &[format!("run.threads={threads}")]);
        let tables = [
            STRUCTURE,
            PAIR_DISTRIBUTION,
            PAIR_DISTRIBUTION_MEANS,
            CONTACT_FORCES,
            STRUCTURE_FACTOR,
            STRUCTURE_FACTOR_MEANS,
            DYNAMICS,
        ];
        let bytes = tables.map(|name| std::fs::read(files.table(name)).unwrap());
        let averages = Summary::read(&files.summary()).unwrap().averages;
        (files, bytes, averages)
    };
    let (files, alone, averages) = read(1);
    for threads in [2, 4] {
        let (_, bytes, others) = read(threads);
        assert!(bytes == alone && others == averages, "{threads} threads");
    }
    let table = SeriesTable::read(&files.table(STRUCTURE)).unwrap();
    let last = |name: &str| *table.get(name).unwrap_or_else(|| panic!("{name}")).last().unwrap();
    for tensor in ["fabric", "orientation"] {
        let trace: f64 = ["xx", "yy", "zz"].iter().map(|axis| last(&format!("{tensor}_{axis}"))).sum();
        assert!((trace - 1.0).abs() < 1e-9, "{tensor}: {trace}");
    }
    let numbers = ["coordination", "rattlers", "coordination_without_rattlers"].map(last);
    let [all, loose, holding] = numbers;
    assert!(holding >= 4.0 && all > 1.0 && all < holding, "{numbers:?}");
    assert!(loose > 0.0 && loose < 0.8, "{numbers:?}");
    // The heap reaches through the periodic faces; there is no lid to reach.
    let clusters = ["clusters", "cluster_size", "largest_cluster"].map(last);
    assert!(clusters[0] >= 1.0 && clusters[1] > 2.0 && clusters[2] > 0.5, "{clusters:?}");
    let through = ["x", "y", "z"].map(|axis| last(&format!("percolation_{axis}")) > 0.5);
    assert_eq!(through, [true, true, false]);
    assert!(last("normal_force") > 0.0 && last("nearest_neighbour_distance") < 1.1e-3);
    // The weight on the floor is that of all particles; its average has an error and the column its unit.
    let weight = &averages["wall_force_z"];
    assert!(weight.unit == "N" && weight.mean < 0.0 && weight.standard_error.unwrap() > 0.0, "{weight:?}");
    assert!(averages.contains_key("contacts") && averages.contains_key("diffusion"));
    // The density of the forces is that of a distribution with mean one, but for the few contacts beyond six means.
    let forces = SeriesTable::read(&files.table(CONTACT_FORCES)).unwrap();
    let [at, density] = ["force_over_mean", "probability_density"].map(|name| forces.get(name).unwrap());
    let rows = density.len() - 60..density.len();
    let sum: f64 = rows.clone().map(|row| 0.1 * density[row]).sum();
    let mean: f64 = rows.map(|row| 0.1 * density[row] * at[row]).sum();
    assert!((0.9..1.0 + 1e-9).contains(&sum) && (0.6..1.05).contains(&mean), "{sum} {mean}");
}

#[test]
fn particles_that_fly_freely_move_apart_by_their_velocities_and_forget_nothing() {
    let root = tempfile::tempdir().unwrap();
    let text = HEAP
        .replace("[true, true, false]", "[true, true, true]")
        .replace("[0, 0, -9]", "0")
        .replace("youngs_modulus = 1e5\nrestitution = 0.5", "enabled = false");
    let (_, files) = written(root.path(), &text, &[]);
    let means = SeriesTable::read(&files.table(DYNAMICS_MEANS)).unwrap();
    let column = |name: &str| means.get(name).unwrap();
    for axis in ["x", "y", "z"] {
        let [way, memory] = ["mean_squared_displacement", "velocity_autocorrelation"]
            .map(|name| column(&format!("{name}_{axis}")));
        for (row, lag) in column("lag").iter().enumerate() {
            assert!((memory[row] / memory[0] - 1.0).abs() < 1e-9);
            assert!((way[row] - memory[0] * lag * lag).abs() <= 1e-9 * memory[0] * lag * lag, "{axis} {lag}");
        }
    }
    // Five whole blocks after the start of the averages; four are needed for an error.
    let blocks = column("rows");
    assert!(blocks.len() == 11 && blocks.iter().all(|rows| *rows >= 5.0), "{blocks:?}");
    assert!(column("mean_squared_displacement_x_error")[10].is_finite());
}

#[test]
fn a_column_of_suspension_has_a_front_that_comes_down_and_a_bed_that_rises() {
    let root = tempfile::tempdir().unwrap();
    let text = r#"
[domain]
size = { diameters = [3, 3, 12] }
periodic = [true, true, false]
[fluid]
density = 1000.0
archimedes = 20
[lattice]
cells_per_diameter = 4
relaxation_time = 0.8
[[particles]]
shape = { sphere = { diameter = 1e-3 } }
density = 2000.0
volume_fraction = 0.12
[run]
end = { steps = 3000 }
[output]
profiles = [{ axis = "x", bins = 3 }, { axis = "z", bins = 24 }]
profiles_every = { steps = 50 }
fields_every = "never"
particles_every = "never"
picture_every = "never"
checkpoint_every = "never"
"#;
    let (setup, files) = written(root.path(), text, &[]);
    let fronts = SeriesTable::read(&files.table(FRONTS)).unwrap();
    let [profile, front, bed] =
        ["profile", "front_height", "bed_height"].map(|name| fronts.get(name).unwrap());
    assert!(profile.iter().all(|number| (number - 1.0).abs() < 0.5) && front.len() == 61);
    let length = setup.domain.size()[2];
    assert!(front[0] > 0.9 * length && front[60] < front[0] - 2e-3, "{front:?}");
    assert!(bed[0] == 0.0 && bed[60] < front[60] + 1e-12);
    let averages = Summary::read(&files.summary()).unwrap().averages;
    let velocity = &averages["front_velocity"];
    let stokes = setup.expect_fluid().scales.stokes_velocity;
    assert!((0.1..1.0).contains(&(velocity.mean / stokes)), "{velocity:?} {stokes}");
}

#[test]
fn the_files_of_a_run_have_the_numbers_of_the_run_afterwards() {
    let root = tempfile::tempdir().unwrap();
    let (_, files) = written(&root.path().join("run"), HEAP, &[]);
    let out = root.path().join("analysis");
    let found = simulation::analyse(files.directory(), &out, None).unwrap();
    let averages = Summary::read(&files.summary()).unwrap().averages;
    assert!(averages.len() > 20 && averages.iter().all(|(name, of)| found.averages[name] == *of));
    assert!(found.averages.len() > averages.len() && found.notes.is_empty(), "{:?}", found.notes);
    let bytes = |root: &Path, name: &str| std::fs::read(root.join(name)).unwrap();
    for name in [PAIR_DISTRIBUTION_MEANS, DYNAMICS_MEANS] {
        assert!(bytes(&out, name) == bytes(files.directory(), name), "{name}");
    }
    // From the files of particles alone: all that follows from places and velocities, at their spacing.
    let mut text = HEAP.replace(
        "particles_every = \"never\"",
        "particles_every = { steps = 20 }\ncontacts_every = \"never\"",
    );
    for key in ["structure", "dynamics"] {
        let line = text.lines().find(|line| line.starts_with(key)).unwrap().to_string();
        text = text.replace(&line, "");
    }
    let (_, bare) = written(&root.path().join("bare"), &text, &[]);
    let later = simulation::analyse(bare.directory(), &root.path().join("later"), Some(0.02)).unwrap();
    assert!(later.notes[0].contains("contacts are missing at 101 of 101 steps"), "{:?}", later.notes);
    assert!(!later.averages.contains_key("coordination"));
    // The orientation of bodies in a file is that of their shape, of which the axes may have other names.
    for name in ["nearest_neighbour_distance", "velocity_variance_xx", "orientation_zz"] {
        let [there, here] = [&averages, &later.averages].map(|all| all[name].mean);
        assert!((there / here - 1.0).abs() < 0.05, "{name}: {there} {here}");
    }
    let error = simulation::analyse(root.path(), &out, None).unwrap_err();
    assert!(error.exit_code() == 2 && error.to_string().contains("series.csv"), "{error}");
}

#[test]
fn files_of_particles_and_contacts_have_the_structure_of_the_run_afterwards() {
    let root = tempfile::tempdir().unwrap();
    let own = ["particles_every", "contacts_every"].map(|key| format!("output.{key}={{ steps = 50 }}"));
    for (name, periodic, gravity) in [("heap", "false", -9), ("gas", "true", 0)] {
        let own = [
            &own[..],
            &[
                format!("domain.periodic=[true, true, {periodic}]"),
                format!("driving.gravity=[0, 0, {gravity}]"),
                "output.structure.every={ steps = 50 }".into(),
            ],
        ];
        let (_, files) = written(&root.path().join(name), HEAP, &own.concat());
        let tables = [STRUCTURE, PAIR_DISTRIBUTION, CONTACT_FORCES];
        let text = |files: &OutputFiles, name| std::fs::read_to_string(files.table(name)).unwrap();
        let before = tables.map(|name| text(&files, name));
        for name in tables {
            std::fs::remove_file(files.table(name)).unwrap();
        }
        let out = root.path().join(format!("{name}_later"));
        let found = simulation::analyse(files.directory(), &out, None).unwrap();
        assert!(found.notes.is_empty(), "{:?}", found.notes);
        for name in ["coordination", "fabric_zz", "largest_cluster", "normal_force"] {
            assert!(found.averages[name].mean > 0.0, "{name}: {:?}", found.averages);
        }
        for (name, before) in tables.into_iter().zip(&before) {
            let after = text(&OutputFiles::new(&out), name);
            assert_eq!(before.lines().count(), after.lines().count(), "{name}");
            for (ours, theirs) in before.lines().zip(after.lines()) {
                let same = |(a, b): (&str, &str)| match [a, b].map(str::parse::<f64>) {
                    [Ok(a), Ok(b)] => (a - b).abs() <= 1e-9 * a.abs(),
                    _ => a == b,
                };
                assert_eq!(ours.split(',').count(), theirs.split(',').count(), "{name}");
                assert!(ours.split(',').zip(theirs.split(',')).all(same), "{name}\n{ours}\n{theirs}");
            }
        }
        let last = files.steps(directory::CONTACTS).unwrap().pop().unwrap();
        std::fs::write(files.file(directory::CONTACTS, last), "no points").unwrap();
        let error = simulation::analyse(files.directory(), &out, None).unwrap_err();
        assert!(error.exit_code() == 2 && error.to_string().contains("no file of VTK"), "{error}");
    }
}

#[test]
fn paths_are_those_of_the_particles_that_a_case_names() {
    let root = tempfile::tempdir().unwrap();
    for threads in [1, 3] {
        let own = ["output.paths=[40, 2, 17]".to_string(), format!("run.threads={threads}")];
        let (_, files) = written(&root.path().join(threads.to_string()), HEAP, &own);
        let paths = SeriesTable::read(&files.particle_series()).unwrap();
        let ids = paths.get("id").unwrap();
        assert!(ids.len() > 30 && ids.chunks(3).all(|ids| ids == [2.0, 17.0, 40.0]), "{ids:?}");
    }
}

/// Spheres that fall round a rod in a fluid.
const FLOW: &str = r#"
[domain]
size = [4e-3, 4e-3, 6e-3]
periodic = [true, true, false]
[[walls]]
name = "rod"
rod = { point = [1.3e-3, 0, 1.2e-3], axis = [0, 1, 0], diameter = 1.5e-3 }
[[walls]]
name = "along"
rod = { point = [0, 2e-3, 1.1e-3], axis = [1, 0, 0], diameter = 1.3e-3 }
[fluid]
density = 1000
viscosity = 1e-6
[lattice]
cells_per_diameter = 5
relaxation_time = 0.6
[[particles]]
shape = { sphere = { diameter = 1e-3 } }
density = 2000
list = [[1e-3, 1e-3, 4.2e-3], [3.9e-3, 2e-3, 3e-3], [2.2e-3, 3.1e-3, 5e-3]]
[driving]
gravity = [0, 0, -0.5]
[run]
end = { steps = 60 }
[output]
profiles = [{ axis = "x", bins = 7 }, { axis = "y", bins = 5 }, { axis = "z", bins = 30 }, { axis = "z", bins = 6, about = [2e-3, 2e-3, 0], radius = 2e-3 }]
profiles_every = { steps = 20 }
particles_every = "never"
picture_every = "never"
checkpoint_every = "never"
"#;

#[test]
fn profiles_of_the_flow_in_the_next_sweep_are_those_of_a_pass_of_their_own() {
    let root = tempfile::tempdir().unwrap();
    let rows = |name: &str, options: &[&str]| {
        let options: Vec<String> = options.iter().map(ToString::to_string).collect();
        let (_, files) = written(&root.path().join(name), FLOW, &options);
        let text = std::fs::read_to_string(files.table(directory::PROFILES)).unwrap();
        let rows = text.lines().filter(|line| !line.starts_with('#')).skip(1);
        let step = |row: &str| row.split(',').nth(1).and_then(|step| step.parse::<f64>().ok());
        rows.filter(|row| step(row).expect("a step") < 50.0).map(str::to_string).collect::<Vec<_>>()
    };
    // The last rows of a run, and those of a checkpoint, take a pass; the others pass in the sweep of the next step.
    for (name, method) in [
        ("saturated", ["lattice.coupling=\"saturated\"", "fluid.precision=\"f32\""]),
        ("homogenised", ["lattice.coupling=\"homogenised\"", "fluid.precision=\"f64\""]),
        ("regularised", ["lattice.collision=\"recursive_regularised\"", "fluid.precision=\"f16\""]),
    ] {
        let rows =
            |kind: &str, options: &[&str]| rows(&format!("{name}_{kind}"), &[&method, options].concat());
        let swept = rows("swept", &["run.threads=1"]);
        assert_eq!(swept.len(), 3 * 48);
        assert_eq!(rows("last", &["run.end.steps=40", "run.threads=1"]), swept, "{name}");
        assert_eq!(rows("saved", &["output.checkpoint_every={steps=20}", "run.threads=2"]), swept, "{name}");
        assert_eq!(rows("three", &["run.simd=\"scalar\"", "run.threads=3"]), swept, "{name}");
    }
}
