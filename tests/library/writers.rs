//! A writer of the caller's own beside those of a case.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use turbid::Result;
use turbid::case::{self, CheckpointSpacing, Setup};
use turbid::error::Error;
use turbid::output::Numbered;
use turbid::particle::Particle;
use turbid::simulation::{
    Need, RankOutput, RankState, RootOutput, RunOptions, Sums, Writer, WriterState, resume_with, run_with,
};

const CASE: &str = r#"
[domain]
size = { diameters = [6, 6, 8] }
[fluid]
density = 1000.0
archimedes = 100
[lattice]
cells_per_diameter = 4
relaxation_time = 0.6
[[particles]]
shape = { sphere = { diameter = 1e-3 } }
density = 2000.0
volume_fraction = 0.1
seed = 1
[run]
end = { steps = 48 }
[output]
fields_every = "never"
particles_every = { steps = 24 }
picture_every = "never"
checkpoint_every = { steps = 24 }
"#;

/// A file for each step.
const NUMBERED: Numbered = Numbered::new("heights", "heights_", ".txt");

/// Writes the mean height of the particles with even ids, the mean pressure, and what the ranks sum, to a table, and the table so far for
/// each step.
struct Heights {
    out: PathBuf,
    table: PathBuf,
    text: String,
    pressure: f32,
}

impl Writer for Heights {
    fn name(&self) -> &'static str {
        "heights"
    }

    fn every(&self) -> u64 {
        8
    }

    fn needs(&self) -> Vec<Need> {
        vec![Need::Selected, Need::Fields]
    }

    fn selects(&self, particle: &Particle) -> bool {
        particle.id.is_multiple_of(2)
    }

    /// Momentum, and the solid volume of each layer of cells (in cells).
    fn sums(&self, rank: &mut RankState) -> Sums {
        let mut sums = Sums::new(3, 32, 1);
        for particle in rank.simulation().particles() {
            sums.add(0, &particle.velocity);
        }
        rank.each_cell(|[.., z], velocity, _, fraction| {
            sums.add_fixed(z, fraction);
            sums.raise(0, velocity[2].abs());
        });
        sums
    }

    fn write(&mut self, output: &RankOutput) -> Result<()> {
        assert!(output.rank.is_none(), "threads have it all at rank 0");
        let fields = output.fields.as_ref().expect("asked for");
        assert_eq!(fields.pressure.len(), output.block.cell_count());
        self.pressure = fields.pressure.iter().sum::<f32>() / fields.pressure.len() as f32;
        Ok(())
    }

    fn complete(&mut self, output: &RootOutput) -> Result<()> {
        let particles = &output.selected;
        assert!(particles.windows(2).all(|pair| pair[0].id < pair[1].id));
        let height = particles.iter().map(|p| p.position().z).sum::<f64>() / particles.len() as f64;
        let (totals, cells) = (output.totals, 24.0 * 24.0 * 32.0);
        assert!((totals.fixed.iter().sum::<f64>() / cells - 0.1).abs() < 0.03, "{totals:?}");
        assert!(totals.sums.len() == 3 && totals.maxima[0] > 0.0);
        let _ = writeln!(self.text, "{} {height:e} {:e} {totals:?}", output.step, self.pressure);
        let numbered = NUMBERED.file(&self.out, output.step);
        std::fs::create_dir_all(numbered.parent().unwrap()).unwrap();
        std::fs::write(numbered, &self.text).unwrap();
        std::fs::write(&self.table, &self.text).map_err(|source| Error::io("write", &self.table, source))
    }

    fn numbered(&self) -> Option<Numbered> {
        Some(NUMBERED)
    }

    fn state(&mut self) -> Result<WriterState> {
        Ok(self.text.clone().into())
    }

    fn resume(&mut self, state: &WriterState) -> Result<()> {
        state.as_str().unwrap_or_default().clone_into(&mut self.text);
        Ok(())
    }
}

fn setup(root: &Path, threads: usize, end: u64) -> Setup {
    let mut setup = case::from_text(CASE, "heights", &[format!("run.end.steps={end}")]).unwrap();
    setup.plan.threads = threads;
    setup.plan.output.directory = root.join("out");
    setup
}

fn writer(root: &Path) -> Vec<Box<dyn Writer>> {
    vec![Box::new(Heights {
        out: root.join("out"),
        table: root.join("heights.txt"),
        text: String::new(),
        pressure: 0.0,
    })]
}

#[test]
fn an_own_writer_gets_the_same_on_one_and_three_threads_and_continues_where_a_checkpoint_was() {
    let places = [(); 3].map(|()| tempfile::tempdir().unwrap());
    let [one, three, resumed] = [0, 1, 2].map(|i| places[i].path());
    for (root, threads, end) in [(one, 1, 48), (three, 3, 48), (resumed, 2, 24)] {
        run_with(&setup(root, threads, end), &RunOptions::default(), &|_| writer(root)).unwrap();
    }
    let late = NUMBERED.file(&resumed.join("out"), 30);
    std::fs::write(&late, "of a run that was killed").unwrap();
    resume_with(&setup(resumed, 1, 48), &RunOptions::default(), &|_| writer(resumed)).unwrap();
    let read = |root: &Path| std::fs::read_to_string(root.join("heights.txt")).unwrap();
    let expected = read(one);
    assert_eq!(expected.lines().count(), 7, "{expected}");
    assert_eq!(read(three), expected);
    assert_eq!(read(resumed), expected);
    assert!(!late.exists() && NUMBERED.file(&resumed.join("out"), 24).exists());
}

#[test]
fn a_writer_that_fails_ends_the_run_on_three_threads_with_its_error() {
    let place = tempfile::tempdir().unwrap();
    std::fs::create_dir(place.path().join("heights.txt")).unwrap();
    let run = run_with(&setup(place.path(), 3, 48), &RunOptions::default(), &|_| writer(place.path()));
    let error = run.unwrap_err().to_string();
    assert!(error.contains("heights.txt"), "{error}");
}

#[test]
fn files_of_an_own_writer_that_an_earlier_run_has_left_are_refused_and_with_overwrite_replaced() {
    let place = tempfile::tempdir().unwrap();
    let root = place.path();
    let late = NUMBERED.file(&root.join("out"), 99);
    std::fs::create_dir_all(late.parent().unwrap()).unwrap();
    std::fs::write(&late, "of an earlier run").unwrap();
    let run = |options: &RunOptions| run_with(&setup(root, 1, 8), options, &|_| writer(root));
    let refused = run(&RunOptions::default()).unwrap_err().to_string();
    assert!(refused.contains("heights_0000000099.txt"), "{refused}");
    let overwrite = RunOptions { overwrite: true, ..RunOptions::default() };
    run(&overwrite).unwrap();
    assert!(!late.exists() && NUMBERED.file(&root.join("out"), 8).exists());
}

/// Counts what is asked of it.
struct Seldom {
    is_due: std::cell::Cell<bool>,
}

impl Writer for Seldom {
    fn name(&self) -> &'static str {
        "seldom"
    }

    fn every(&self) -> u64 {
        24
    }

    fn due(&self, step: u64, _: bool) -> bool {
        self.is_due.set(step.is_multiple_of(self.every()));
        self.is_due.get()
    }

    fn needs(&self) -> Vec<Need> {
        assert!(self.is_due.get(), "of a step at which nothing is due");
        vec![Need::Selected]
    }

    fn selects(&self, _: &Particle) -> bool {
        assert!(self.is_due.get(), "of a step at which nothing is due");
        true
    }
}

#[test]
fn nothing_is_gathered_for_a_writer_at_steps_at_which_it_is_not_due() {
    let place = tempfile::tempdir().unwrap();
    let seldom = |_: usize| -> Vec<Box<dyn Writer>> { vec![Box::new(Seldom { is_due: false.into() })] };
    run_with(&setup(place.path(), 2, 48), &RunOptions::default(), &seldom).unwrap();
}

/// Removes the output directory, or only the table in it, after 16 steps.
struct Purge {
    doomed: PathBuf,
}

impl Writer for Purge {
    fn name(&self) -> &'static str {
        "purge"
    }

    fn every(&self) -> u64 {
        16
    }

    fn needs(&self) -> Vec<Need> {
        Vec::new()
    }

    fn complete(&mut self, output: &RootOutput) -> Result<()> {
        match output.step {
            16 if self.doomed.is_dir() => std::fs::remove_dir_all(&self.doomed).unwrap(),
            16 => std::fs::remove_file(&self.doomed).unwrap(),
            _ => {}
        }
        Ok(())
    }
}

#[test]
fn a_run_on_three_threads_whose_directory_or_table_is_removed_says_so_and_ends_with_2() {
    for doomed in ["out", "out/series.csv", "out/particle_series.csv"] {
        let place = tempfile::tempdir().unwrap();
        let doomed = place.path().join(doomed);
        let setup = setup(place.path(), 3, 48);
        let run =
            run_with(&setup, &RunOptions::default(), &|_| vec![Box::new(Purge { doomed: doomed.clone() })]);
        let error = run.unwrap_err();
        let said = error.to_string();
        assert!(said.contains("removed or replaced") && said.contains("series.csv"), "{said}");
        assert_eq!(error.exit_code(), 2);
        assert!(!doomed.exists(), "nothing comes back beside rows that are lost");
    }
}

#[test]
fn a_run_without_rows_whose_directory_is_removed_says_so_and_leaves_none() {
    let place = tempfile::tempdir().unwrap();
    let doomed = place.path().join("out");
    let mut setup = setup(place.path(), 3, 48);
    setup.plan.output.series_every = 0;
    let run = run_with(&setup, &RunOptions::default(), &|_| vec![Box::new(Purge { doomed: doomed.clone() })]);
    let said = run.unwrap_err().to_string();
    assert!(said.contains("out was removed or replaced"), "{said}");
    assert!(!doomed.exists());
}

/// Puts a file where the checkpoints go.
struct InTheWay(PathBuf);

impl Writer for InTheWay {
    fn name(&self) -> &'static str {
        "in_the_way"
    }

    fn every(&self) -> u64 {
        8
    }

    fn needs(&self) -> Vec<Need> {
        Vec::new()
    }

    fn complete(&mut self, output: &RootOutput) -> Result<()> {
        if output.step == 8 {
            std::fs::write(&self.0, "").unwrap();
        }
        Ok(())
    }
}

#[test]
fn a_run_is_complete_though_its_checkpoint_at_the_end_cannot_be_written() {
    let place = tempfile::tempdir().unwrap();
    let mut setup = setup(place.path(), 2, 16);
    setup.plan.output.checkpoint_every = CheckpointSpacing::Steps(24);
    setup.plan.output.checkpoint_at_end = true;
    let path = place.path().join("out/checkpoints");
    let run = run_with(&setup, &RunOptions::default(), &|_| vec![Box::new(InTheWay(path.clone()))]);
    let summary = run.unwrap().unwrap();
    assert!(!summary.interrupted && place.path().join("out/summary.json").exists());
    let warning = summary.warnings.last().unwrap();
    assert!(warning.contains("the checkpoint of step 16 failed"), "{warning}");
}
