//! Studies on disk and in memory: plans, what is taken from earlier runs, and what is made of results.

use super::record::{Quantity, Record};
use super::state::State;
use super::*;
use std::collections::BTreeMap;
use std::fs;
use turbid::case;
use turbid::simulation::{self, RunOptions};

const CASE: &str = r#"
[domain]
size = { diameters = [4, 4, 4] }
[fluid]
density = 1000.0
archimedes = 500
[lattice]
cells_per_diameter = 4
relaxation_time = 0.7
[[particles]]
shape = { sphere = { diameter = 1.5e-3 } }
density = 3300.0
volume_fraction = 0.1
seed = 1
[run]
end = { steps = 24 }
threads = 1
[output]
series_every = { steps = 1 }
fields_every = "never"
particles_every = "never"
picture_every = "never"
"#;

const AXES: &str = r#"
title = "A test"
case = "case.toml"
shares = ["other"]
skip = [{ phi = 0.2, seed = 2 }]
[set]
"run.average_from" = { steps = 8 }
[[axis]]
name = "phi"
key = "particles.0.volume_fraction"
values = [0.1, 0.2]
[[axis]]
name = "shape"
values = [
    { name = "sphere", label = "spheres" },
    { name = "cube", label = "cubes", set = { "particles.0.shape" = { cube = { equivalent_diameter = 1.5e-3 } } } },
]
[[axis]]
name = "seed"
key = "particles.0.seed"
values = [1, 2]
average = true
[[derived]]
name = "slower_by"
axis = "shape"
of = "cube"
to = "sphere"
form = "deficit"
"#;

/// Its study file is `study.toml`, its output `here`, beside `other`.
fn place(study: &str) -> tempfile::TempDir {
    let place = tempfile::tempdir().unwrap();
    fs::write(place.path().join("case.toml"), CASE).unwrap();
    fs::write(place.path().join("study.toml"), study).unwrap();
    place
}

fn load(place: &tempfile::TempDir) -> Result<Study> {
    let path = place.path();
    Study::load(&path.join("study.toml"), Some(&path.join("here")), None)
}

fn names(study: &Study) -> Vec<&str> {
    study.plan.runs.iter().map(|run| run.name.as_str()).collect()
}

/// A study whose runs all have ended with the velocities that `velocity` gives for their names, with these errors.
fn with_results(more: &str, velocity: impl Fn(&str) -> Option<(f64, f64)>) -> (tempfile::TempDir, Study) {
    let place = place(&format!("{AXES}{more}"));
    let mut study = load(&place).unwrap();
    for (run, state) in study.plan.runs.iter().zip(&mut study.states) {
        if let Some((value, error)) = velocity(&run.name) {
            let quantity = Quantity { value, error: Some(error) };
            let end = Quantity { value: 20.0, error: None };
            let numbers = [
                ("settling_velocity_over_stokes", quantity),
                ("transient_end", end),
                ("settled_mean", quantity),
            ];
            *state = State::Done(Box::new(Record {
                directory: study.out.join(&run.name),
                version: "0".to_string(),
                averaged_over: Some([30.0, 90.0]),
                quantities: BTreeMap::from(numbers.map(|(name, number)| (name.to_string(), number))),
            }));
        }
    }
    (place, study)
}

#[test]
fn the_runs_are_all_combinations_less_those_skipped_first_repetitions_first() {
    let place = place(AXES);
    let study = load(&place).unwrap();
    let expected = [
        "phi0.1_sphere_seed1",
        "phi0.1_cube_seed1",
        "phi0.2_sphere_seed1",
        "phi0.2_cube_seed1",
        "phi0.1_sphere_seed2",
        "phi0.1_cube_seed2",
    ];
    assert_eq!(names(&study), expected);
    let cube = &study.plan.runs[3].setup;
    assert_eq!(cube.plan.average_from_step, 8);
    assert!(cube.volume_fraction > 0.15);
    assert_ne!(cube.templates[0].shape.kind(), "sphere");
}

#[test]
fn a_run_that_has_ended_is_taken_from_wherever_it_is_if_its_case_is_the_same() {
    let place = place(AXES);
    let run = |folder: &str| {
        let study = load(&place).unwrap();
        let mut setup = case::load(&study.case, &study.plan.runs[0].options).unwrap();
        setup.plan.output.directory = place.path().join(folder).join("some_name");
        let options = RunOptions::default();
        simulation::run(&setup, &options).unwrap();
        setup.plan.output.directory.join("summary.json")
    };
    run("unrelated");
    assert!(load(&place).unwrap().states[0].record().is_none());
    let summary = run("other");
    let study = load(&place).unwrap();
    let record = study.states[0].record().expect("it is in a directory that is shared");
    assert_eq!(record.directory, place.path().join("other/some_name"));
    assert!(record.value("settling_velocity_over_stokes").unwrap() > 0.0);
    let known = record::names(false);
    let strange = |name: &&String| !known.contains(&name.as_str()) && !name.starts_with(record::SHARE);
    let strange: Vec<&String> = record.quantities.keys().filter(strange).collect();
    assert!(strange.is_empty(), "a study file could not name {strange:?}");
    assert!(study.states[1..].iter().all(|state| state.record().is_none()));

    let text = fs::read_to_string(&summary).unwrap();
    let with = |from: &str, to: &str| {
        assert!(text.contains(from), "{from}");
        fs::write(&summary, text.replace(from, to)).unwrap();
        load(&place).unwrap().states[0].record().is_some()
    };
    assert!(with("\"version\": \"0.", "\"version\": \"9."), "the version is no part of the case");
    assert!(!with("\"interrupted\": false", "\"interrupted\": true"));
    assert!(!with("\"coupling\": \"", "\"coupling\": \"another_"), "a default has changed since");
    assert!(!with("archimedes = 500", "archimedes = 501"));
}

#[test]
fn a_run_that_has_ended_is_done_with_the_homogenised_coupling_too() {
    let homogenised = AXES.replace("[set]", "[set]\n\"lattice.coupling\" = \"homogenised\"");
    let place = place(&homogenised);
    let study = load(&place).unwrap();
    let mut setup = case::load(&study.case, &study.plan.runs[0].options).unwrap();
    setup.plan.output.directory = study.out.join(&study.plan.runs[0].name);
    simulation::run(&setup, &RunOptions::default()).unwrap();
    assert!(load(&place).unwrap().states[0].record().is_some());
    fs::write(place.path().join("study.toml"), AXES).unwrap();
    assert!(load(&place).unwrap().states[0].record().is_none(), "that is another coupling");
}

#[test]
fn a_run_that_was_stopped_is_a_part_and_one_of_another_case_is_replaced() {
    let place = place(AXES);
    let study = load(&place).unwrap();
    let mut setup = case::load(&study.case, &study.plan.runs[1].options).unwrap();
    setup.plan.output.directory = study.out.join(&study.plan.runs[1].name);
    let options = RunOptions::default();
    options.stop.store(true, std::sync::atomic::Ordering::Relaxed);
    simulation::run(&setup, &options).unwrap();
    let study = load(&place).unwrap();
    assert!(
        matches!(study.states[1], State::Part { step } if step > 0 && step < 24),
        "{:?}",
        study.states[1]
    );
    assert!(matches!(study.states[0], State::Open { replaces: false }));

    fs::write(place.path().join("study.toml"), AXES.replace("{ steps = 8 }", "{ steps = 9 }")).unwrap();
    let study = load(&place).unwrap();
    assert!(matches!(study.states[1], State::Open { replaces: true }), "{:?}", study.states[1]);
}

#[test]
fn time_is_projected_with_the_speed_of_what_is_done() {
    let place = place(AXES);
    let mut study = load(&place).unwrap();
    assert_eq!(study.measured_over_estimated(), None);
    let estimates = [0, 1].map(|run| study.estimate(run));
    let quantity = Quantity { value: 2.0, error: None };
    study.states[0] = State::Done(Box::new(Record {
        directory: PathBuf::new(),
        version: String::new(),
        averaged_over: None,
        quantities: BTreeMap::from([("wall_seconds".to_string(), quantity)]),
    }));
    let slower = study.measured_over_estimated().unwrap();
    assert!((slower * estimates[0] - 2.0).abs() < 1e-12);
    let left = slower * estimates[1];
    assert!(left > 0.0 && (study.seconds_left(1).unwrap() - left).abs() < 1e-12);
    study.states[1] = State::Part { step: 18 };
    assert!((study.seconds_left(1).unwrap() - 0.25 * left).abs() < 1e-12);
}

const WITHIN: &str = r#"
[[check]]
kind = "within"
only = { shape = "sphere" }
reference = { csv = "reference.csv", y = "u", where = { phi = "phi", kind = "sphere" } }
tolerance = 0.1
[[check]]
kind = "ordered"
y = "slower_by"
above = 0.15
"#;

#[test]
fn checks_compare_means_of_repetitions_with_rows_of_a_table_and_fail_where_they_must() {
    let place = place(AXES);
    let table = "# source\nphi,kind,u\n0.1,cube,9\n0.1,sphere,0.5\n0.20,sphere,0.5\n";
    fs::write(place.path().join("reference.csv"), table).unwrap();
    fs::write(place.path().join("study.toml"), format!("{AXES}{WITHIN}")).unwrap();
    let mut study = load(&place).unwrap();
    let values = [0.5, 0.4, 0.4, 0.36, 0.56, 0.4];
    for (state, value) in study.states.iter_mut().zip(values) {
        *state = done(value, 0.01);
    }
    let checks = study.document().unwrap().checks;
    let told: Vec<(f64, f64, bool)> = checks.iter().map(|c| (c.measured, c.reference, c.pass)).collect();
    let near = |(a, b, pass): (f64, f64, bool), (c, d, expected): (f64, f64, bool)| {
        assert!((a - c).abs() < 1e-12 && (b - d).abs() < 1e-12 && pass == expected, "{told:?}");
    };
    near(told[0], (0.53, 0.5, true));
    near(told[1], (0.4, 0.5, false));
    // The mean signed deviation of both, which is only reported.
    near(told[2], (-0.07, 0.0, true));
    near(told[3], (1.0 - 0.4 / 0.53, 0.15, true));
    near(told[4], (0.1, 0.15, false));
    assert_eq!(told.len(), 5);
    assert_eq!(checks[0].quantity, "settling velocity over stokes, phi 0.1, spheres");
    // A point with a run that is not done is not checked.
    study.states[4] = State::Open { replaces: false };
    assert_eq!(study.document().unwrap().checks.len(), 2);
}

fn done(value: f64, error: f64) -> State {
    let quantity = Quantity { value, error: Some(error) };
    State::Done(Box::new(Record {
        directory: PathBuf::new(),
        version: String::new(),
        averaged_over: None,
        quantities: BTreeMap::from([("settling_velocity_over_stokes".to_string(), quantity)]),
    }))
}

#[test]
fn a_check_that_cannot_be_made_though_its_runs_are_done_is_not_passed() {
    let checks = r#"
[[check]]
kind = "ordered"
y = "mach"
only = { phi = 0.1, shape = "cube" }
below = 1.0
[[check]]
kind = "within"
only = { phi = 0.2, shape = "cube" }
reference = { csv = "reference.csv", y = "u", where = { phi = "phi" } }
tolerance = 0.1
[[check]]
kind = "scatter"
y = "drift"
only = { phi = 0.1, shape = "cube" }
tolerance = 0.1
"#;
    let place = place(&format!("{AXES}{checks}"));
    fs::write(place.path().join("reference.csv"), "phi,u\n0.1,0.5\n").unwrap();
    let mut study = load(&place).unwrap();
    assert!(study.document().unwrap().checks.is_empty(), "nothing is done yet");
    study.states.iter_mut().for_each(|state| *state = done(0.3, 0.01));
    let checks = study.document().unwrap().checks;
    assert_eq!(checks.len(), 4);
    assert!(checks.iter().all(|check| !check.pass), "{checks:?}");
    assert!(checks[0].quantity.contains("the runs have no `mach`"), "{:?}", checks[0]);
    assert!(checks[1].quantity.ends_with("the reference has no value here"), "{:?}", checks[1]);
    study.collect().unwrap();
    let text = fs::read_to_string(study.out.join(document::FILE)).unwrap();
    let read: Document = serde_json::from_str(&text).unwrap();
    assert!(read.checks[0].measured.is_nan() && (read.checks[1].measured - 0.3).abs() < 1e-12);
}

#[test]
fn a_figure_leaves_out_what_is_not_done_and_says_so_while_its_laws_are_whole() {
    let figure = r#"
[[figure]]
name = "u"
title = "U"
x = "phi"
y = "settling_velocity_over_stokes"
panels = "shape"
references = [{ law = "richardson_zaki" }, { band = 0.1 }, { value = 0.3, label = "guess", dashed = true }]
"#;
    let (_place, study) = with_results(figure, |name| (name != "phi0.1_cube_seed2").then_some((0.25, 0.02)));
    let document = study.document().unwrap();
    let figure = &document.figures[0];
    let note = &figure.chart.note;
    assert!(note.contains("1 point is missing: 1 of their runs are not done."), "{note}");
    assert!(note.starts_with("Bars: one standard error"), "{note}");
    assert!(note.ends_with("those of whole particles: 0.1064 where 0.1000 was requested."), "{note}");
    let titles: Vec<&str> = figure.chart.panels.iter().map(|panel| panel.title.as_str()).collect();
    assert_eq!(titles, ["spheres", "cubes"]);
    let references = |panel: usize| figure.chart.panels[panel].series.len() - 1;
    assert_eq!(references(0), references(1));
    let labels: Vec<&str> =
        figure.chart.panels[1].series.iter().map(|series| series.label.as_str()).collect();
    assert_eq!(labels, ["this study", "Richardson-Zaki", "mean", "mean + 10 %", "mean - 10 %", "guess"]);
    let measured = |panel: usize| figure.chart.panels[panel].series[0].points.len();
    assert_eq!([measured(0), measured(1)], [2, 1]);
    let law = &figure.chart.panels[1].series[1].points;
    assert!(law.len() > 5 && law.windows(2).all(|pair| pair[0].x < pair[1].x && pair[0].y > pair[1].y));
    // 13 and 25 whole particles.
    let ends = [13.0, 25.0].map(|count| count * std::f64::consts::PI / 6.0 / 64.0);
    let drawn = [&figure.chart.panels[0].series[0].points, law]
        .map(|points| [points[0].x, points[points.len() - 1].x]);
    assert!(
        drawn.iter().all(|x| (x[0] - ends[0]).abs() < 1e-9 && (x[1] - ends[1]).abs() < 1e-9),
        "{drawn:?}"
    );
}

#[test]
fn a_table_shows_errors_references_and_deviations() {
    let table = r#"
[[table]]
name = "t"
title = "T"
rows = ["phi"]
columns = [
    { label = "spheres", y = "settling_velocity_over_stokes", only = { shape = "sphere" }, reference = { value = 0.2 }, digits = 2 },
    { label = "slower", y = "slower_by", reference = { value = 0.25 }, digits = 3 },
]
"#;
    let velocity = |name: &str| {
        let value = if name.contains("sphere") { 0.22 } else { 0.165 };
        (!name.starts_with("phi0.2")).then_some((value, 0.02 * 2_f64.sqrt()))
    };
    let (_place, study) = with_results(table, velocity);
    let table = &study.document().unwrap().tables[0];
    let heads =
        ["phi", "spheres", "spheres: reference", "deviation", "slower", "slower: reference", "deviation"];
    assert_eq!(table.columns, heads);
    let slower = table.rows[0][4].as_str();
    assert_eq!(table.rows[0][..4], ["0.1", "0.22 ± 0.02", "0.20", "+10.0 %"]);
    assert!(slower.starts_with("0.250 ± 0.1") && table.rows[0][6] == "+0.000", "{:?}", table.rows[0]);
    assert_eq!(table.rows[1], ["0.2", "-", "0.20", "-", "-", "0.250", "-"]);
}

#[test]
fn a_mean_that_has_not_settled_is_named_and_marked_wherever_it_counts() {
    let table = r#"
[[table]]
name = "t"
title = "T"
rows = ["phi"]
columns = [
    { label = "spheres", y = "settling_velocity_over_stokes", only = { shape = "sphere" }, digits = 2 },
    { label = "cubes", y = "settling_velocity_over_stokes", only = { shape = "cube" }, digits = 2 },
    { label = "slower", y = "slower_by", digits = 2 },
]
"#;
    let (_place, mut study) = with_results(table, |_| Some((0.2, 0.0)));
    assert!(study.document().unwrap().unsettled.is_empty());
    let cubes = names(&study).iter().position(|name| name.contains("phi0.1") && name.contains("cube"));
    let cubes = cubes.unwrap();
    let State::Done(record) = &mut study.states[cubes] else {
        panic!("all runs have ended");
    };
    record.quantities.remove("transient_end");
    let document = study.document().unwrap();
    assert_eq!(document.unsettled, [study.plan.runs[cubes].name.clone()]);
    let marked = |row: usize| -> Vec<bool> {
        let cells = document.tables[0].rows[row][1..].iter();
        cells.map(|cell| cell.ends_with(" *")).collect()
    };
    assert_eq!(marked(0), [false, true, true]);
    assert_eq!(marked(1), [false; 3]);
    assert!(document.tables[0].note.contains("* rest on means that have not settled"));
}

#[test]
fn what_is_wrong_in_a_study_file_is_named_with_its_place_and_a_remedy() {
    let bad = [
        ("key = \"particles.0.seed\"", "kee = \"x\"", "unknown key `kee`"),
        ("name = \"cube\", ", "", "the key `name` is missing"),
        ("title = ", "title = 3 #", "`title` is 3, but must be a text in quotes"),
        ("skip = [{ phi = 0.2", "skip = [{ phi = 0.3", "the axis `phi` has no value 0.3"),
        ("skip = [{ phi = 0.2", "skip = [{ fi = 0.2", "there is no axis `fi`"),
        ("case = \"case.toml\"", "case = \"cas.toml\"", "there is no case"),
        (
            "key = \"particles.0.volume_fraction\"\n",
            "",
            "a plain value on the axis `phi`, which has no `key`",
        ),
        ("\"run.average_from\" =", "run =", "`run` is a whole section of the case"),
        ("values = [1, 2]", "values = [1, 2, 1]", "two runs have the name phi0.1_sphere_seed1"),
        ("values = [0.1, 0.2]", "values = [0.1, 0.2, 0.9]", "in the run phi0.9_sphere_seed1"),
        ("values = [1, 2]", "values = []", "the axis `seed` has no values"),
    ];
    for (from, to, said) in bad {
        assert!(AXES.contains(from), "{from}");
        let place = place(&AXES.replace(from, to));
        let Err(error) = load(&place) else {
            panic!("{to} was taken");
        };
        let text = error.to_string();
        assert!(error.exit_code() == 2 && text.contains(said) && text.contains("study.toml"), "{text}");
    }
}

#[test]
fn what_is_wrong_in_figures_and_checks_is_told_before_anything_runs() {
    let figure = "[[figure]]\nname = \"u\"\ntitle = \"U\"\ny = \"mlups\"\n";
    let check = "[[check]]\nkind = \"within\"\n";
    let bad = [
        (format!("{figure}x = \"phj\"\n"), "there is no axis `phj`"),
        (format!("{figure}x = \"shape\"\n"), "the axis `shape` has values without a number"),
        (format!("{figure}x = \"phi\"\n"), "the axis `shape` has several values here"),
        (
            format!("{figure}x = \"phi\"\n"),
            "such as seeds, take their mean: `average = true` in its [[axis]]",
        ),
        (format!("{check}tolerance = 0.1\n"), "this check lacks a key"),
        (format!("{check}reference = {{ value = 1.0 }}\n"), "this check lacks a key"),
        (format!("{check}y = \"settling_velocity\"\n"), "did you mean `settling_velocity_over_"),
        (
            format!("{check}tolerance = -0.1\n"),
            "tolerance` is -0.1, but must be a finite number of at least 0",
        ),
        ("[[check]]\nkind = \"convergence\"\nx = \"phi\"\nat = 0.2\n".into(), "`at` without a `tolerance`"),
        (
            "[[check]]\nkind = \"convergence\"\nx = \"phi\"\nat = 0.3\ntolerance = 0.1\n".into(),
            "`at` is 0.3, which is no value of the axis `phi`",
        ),
        (
            "[[check]]\nkind = \"scatter\"\ntolerance = 0.1\nonly = { phi = 0.2, shape = \"cube\" }\n".into(),
            "scatter of a single run",
        ),
        ("[[window]]\nname = \"late\"\nfrom = 1\nto = 50\n".into(), "the window `late` ends at 50 t*"),
        (
            format!("{figure}x = \"seed\"\nonly = {{ phi = 0.1, shape = \"cube\" }}\n").repeat(2),
            "two figures have the name `u`",
        ),
        (format!("{check}tolerance = 0.1\nreference = {{ csv = \"none.csv\", y = \"u\" }}\n"), "none.csv"),
    ];
    for (more, said) in bad {
        // References are looked at where there is something to compare.
        let place = place(&format!("{AXES}{more}"));
        let text = match load(&place) {
            Err(error) => error.to_string(),
            Ok(mut study) => {
                study.states.iter_mut().for_each(|state| *state = done(1.0, 0.1));
                study.document().expect_err(said).to_string()
            }
        };
        assert!(text.contains(said), "{text}");
    }
}
