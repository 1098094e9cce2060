//! Claims about a case that was saved, and about how long it then runs and what it writes.

use crate::case::{CheckpointSpacing, Setup, from_saved, from_text, load};
use crate::math::Vec3;
use std::path::Path;

const TEXT: &str = r"
    [domain]
    size = { diameters = [6, 6, 6] }
    [fluid]
    density = 1000
    archimedes = 1000
    [lattice]
    cells_per_diameter = 8
    relaxation_time = 0.55
    [[particles]]
    shape = { sphere = { diameter = 1.5e-3 } }
    density = 3300
    count = 3
    [run]
    end = { steps = 6000 }
    [output]
    picture_every = { steps = 50 }
";

fn strings(options: &[&str]) -> Vec<String> {
    options.iter().map(ToString::to_string).collect()
}

/// A saved setup with options, as a resumed run has it.
fn go_on(setup: &Setup, options: &[&str]) -> crate::Result<Setup> {
    from_saved(&setup.provenance.name, &setup.provenance.text, &setup.provenance.files, &strings(options))
}

fn new(options: &[&str]) -> Setup {
    from_text(TEXT, "case", &strings(options)).unwrap()
}

#[test]
fn a_saved_case_needs_no_file_on_disk() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("case.toml");
    let stones = Path::new(env!("CARGO_MANIFEST_DIR")).join("cases/stone.stl");
    std::fs::create_dir(folder.path().join("data")).unwrap();
    std::fs::copy(stones, folder.path().join("data/stone.stl")).unwrap();
    std::fs::write(folder.path().join("places.csv"), "x,y,z\n3e-3,3e-3,3e-3\n7e-3,7e-3,7e-3\n").unwrap();
    let mesh = "particles.0.shape={ mesh = { file = \"data/stone.stl\", equivalent_diameter = 1.5e-3 } }";
    std::fs::write(&path, TEXT).unwrap();
    let before = load(&path, &strings(&[mesh, "particles.0.file=places.csv"])).unwrap();
    let names: Vec<&str> = before.provenance.files.iter().map(|(name, _)| &name[..]).collect();
    assert_eq!(names, ["data/stone.stl", "places.csv"]);
    drop(folder);
    let after = go_on(&before, &[]).unwrap();
    assert_eq!(after.particles, before.particles);
    assert_eq!(after.templates[0].shape.volume().to_bits(), before.templates[0].shape.volume().to_bits());
    assert_eq!(
        (&after.provenance.text, &after.provenance.files),
        (&before.provenance.text, &before.provenance.files)
    );
    assert_eq!((after.plan.end_step, after.plan.output), (before.plan.end_step, before.plan.output.clone()));

    let lost =
        from_saved(&before.provenance.name, &before.provenance.text, &before.provenance.files[..1], &[])
            .unwrap_err();
    assert!(lost.to_string().contains("places.csv: it was not saved with the case"), "{lost}");
}

#[test]
fn a_longer_run_keeps_the_spacing_of_all_rows_and_frames_however_often_it_continues() {
    let mut setup = new(&[]);
    let (plan, from) = (setup.plan.output.clone(), setup.plan.average_from_step);
    assert_eq!((plan.series_every, plan.fields_every, from), (6, 1200, 2000));
    for end in [20_000, 90_000, 7_000] {
        setup = go_on(&setup, &[&format!("run.end.steps={end}")]).unwrap();
        assert_eq!(setup.plan.end_step, end);
        assert_eq!((&setup.plan.output, setup.plan.average_from_step), (&plan, from));
        // The text alone says so, too.
        let again = go_on(&setup, &[]).unwrap();
        assert_eq!(
            (again.plan.end_step, &again.plan.output, again.plan.average_from_step),
            (end, &plan, from)
        );
    }
}

#[test]
fn what_an_option_names_is_as_it_says() {
    let setup = new(&["output.particles_every=never"]);
    let longer = go_on(
        &setup,
        &[
            "run.end.steps=12000",
            "output.series_every = { steps = 40 }",
            "output.checkpoint_every.steps=500",
            "run.average_from.steps=0",
            "run.threads=3",
        ],
    )
    .unwrap();
    let plan = &longer.plan.output;
    let saved = CheckpointSpacing::Steps(500);
    assert_eq!((plan.series_every, plan.checkpoint_every), (40, saved));
    assert_eq!((longer.plan.average_from_step, longer.plan.threads), (0, 3));
    assert_eq!((plan.particles_every, plan.contacts_every, plan.picture_every), (0, 0, 50));
    // Contacts come with the particles, as they do in a new case.
    let plan = go_on(&setup, &["output.particles_every.steps=70"]).unwrap().plan.output;
    assert_eq!((plan.particles_every, plan.contacts_every), (70, 70));
}

#[test]
fn the_particles_are_where_they_were() {
    let setup = new(&[]);
    let longer = go_on(&setup, &["run.end.steps=12000"]).unwrap();
    assert_eq!(longer.particles, setup.particles);
    assert!(longer.particles.iter().any(|p| p.position() != Vec3::zeros()));
}

#[test]
fn a_change_of_anything_but_length_and_output_is_refused_with_the_reason() {
    let setup = new(&[]);
    for option in ["fluid.archimedes=500", "particles.0.count=4", "run={ end = { steps = 5 } }", "nonsense"] {
        let said = go_on(&setup, &[option]).unwrap_err().to_string();
        assert!(said.contains(&format!("`--set {option}`")), "{said}");
        assert!(said.contains("only keys below `run.` and `output.`"), "{said}");
    }
    let said = go_on(&setup, &["output.directory=elsewhere"]).unwrap_err().to_string();
    assert!(said.contains("resumed in its own directory"), "{said}");
    let said = go_on(&setup, &["run.ende.steps=5"]).unwrap_err().to_string();
    assert!(said.contains("did you mean `end`"), "{said}");
}

#[test]
fn an_end_before_the_averages_begin_is_refused() {
    let said = go_on(&new(&[]), &["run.end.steps=1500"]).unwrap_err().to_string();
    assert!(said.contains("`run.average_from` is step 2000, but the run ends at step 1500"), "{said}");
}

#[test]
fn checkpoints_are_written_every_ten_minutes_unless_the_case_asks_for_others() {
    let spacing = |options: &[&str]| new(options).plan.output.checkpoint_every;
    let seconds = |s| CheckpointSpacing::WallTime(std::time::Duration::from_secs(s));
    assert_eq!(spacing(&[]), seconds(600));
    let asked = |value: &str| spacing(&[&format!("output.checkpoint_every={value}")]);
    assert_eq!(asked("never"), CheckpointSpacing::Never);
    assert_eq!(asked("{ steps = 300 }"), CheckpointSpacing::Steps(300));
    assert_eq!(asked("{ wall_time = 60 }"), seconds(60));
    // A saved LIGGGHTS rounds differently, so the clock has no part in it.
    assert_eq!(spacing(&["dem.engine=liggghts"]), CheckpointSpacing::Never);
}
