//! The command line: verbs, flags, and the one place that prints errors and chooses the exit code.

mod allocator;
mod analyse;
mod bench;
mod check;
mod costs;
mod crosscheck;
mod doctor;
mod film;
mod live;
mod machine;
mod manual;
mod mesh;
mod pack;
mod placing;
mod preflight;
mod progress;
mod report;
mod run;
mod signals;
mod study;
mod suite;
mod terminal;
mod validate;
mod walltime;

pub use allocator::Guarded;
use clap::{Args, Parser, Subcommand};
use placing::Packing;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;
use terminal::{say, warn};
use turbid::case::{self, Origin, Setup};
use turbid::comm;
use turbid::error::{Error, Result};

/// Particle-resolved suspension dynamics.
#[derive(Debug, Parser)]
#[command(name = "turbid", version, arg_required_else_help = true, after_help = exit_codes())]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Run a case and write its output files.
    Run(RunArguments),
    /// Resume a run from its last checkpoint, on any number of threads or processes.
    Resume(ResumeArguments),
    /// Check a case without running it: derived numbers, cost, and values outside the usual range.
    Check(CheckArguments),
    /// Measure the speed of a case without writing anything.
    Bench(BenchArguments),
    /// Write the particles of a case at the start, or of a run at the end, to a file that `file = "..."` reads back.
    Pack(PackArguments),
    /// Show what a mesh is and what it can be in a case: closed, convex, volume, inertia, parts; with a picture.
    Mesh(mesh::MeshArguments),
    /// Run the native engine and LIGGGHTS from the same state and compare them: a suite, or a case of spheres.
    Crosscheck(crosscheck::CrosscheckArguments),
    /// Run a parameter study, skipping finished runs, and collect the results.
    Study(study::StudyArguments),
    /// Run cases of the literature and compare the results with their references.
    Validate(validate::ValidateArguments),
    /// Draw the results of a run or a study: figures as SVG and PNG, tables, pictures and checks on one page.
    Report(report::ReportArguments),
    /// Compute statistics of a run from its files: means with errors, profiles, fronts, structure, dynamics.
    Analyse(analyse::AnalyseArguments),
    /// Make an animated PNG, or an MP4 with ffmpeg, of the pictures of a run.
    Film(film::FilmArguments),
    /// Serve a page about a run of another process to browsers on this machine, from the files that it writes.
    Watch(live::WatchArguments),
    /// Show the properties of this machine, and settings to change.
    Doctor,
    /// Print completions for a shell: turbid completions bash > ~/.local/share/bash-completion/completions/turbid.
    Completions {
        /// Shell that reads them.
        shell: clap_complete::Shell,
    },
    /// Write the manual pages turbid.1, turbid-run.1, ...: turbid man ~/.local/share/man/man1.
    Man {
        /// Directory for them, made if it is missing.
        #[arg(value_name = "DIR")]
        directory: PathBuf,
    },
    /// LIGGGHTS in a process of its own, for turbid's own use.
    #[cfg(feature = "liggghts")]
    #[command(name = turbid::engine::liggghts::worker::VERB, hide = true)]
    LiggghtsWorker,
    /// LAMMPS in a process of its own, for turbid's own use.
    #[command(name = turbid::engine::lammps::VERB, hide = true)]
    LammpsWorker,
}

/// A case and changes to it.
#[derive(Debug, Args)]
struct CaseArguments {
    /// Case file (TOML).
    case: PathBuf,
    #[command(flatten)]
    changes: Changes,
}

/// Changes to a case.
#[derive(Debug, Args)]
struct Changes {
    /// Set a key of the case to any TOML value, e.g. `--set particles.0.volume_fraction=0.3`; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Threads; 0 is one per core. Results do not depend on it.
    #[arg(long)]
    threads: Option<usize>,
    /// Device that computes the fluid: cpu, gpu, gpu:1, a device by its number in `turbid doctor`, or gpu:0,1, which ranks take in turn.
    /// Results do not depend on it.
    #[arg(long)]
    device: Option<String>,
}

impl Changes {
    /// All keys that are set, that of `--device` among them.
    fn all(&self) -> Vec<String> {
        with_device(&self.set, self.device.as_ref())
    }
}

fn with_device(set: &[String], device: Option<&String>) -> Vec<String> {
    set.iter().cloned().chain(device.map(|device| format!("run.device={device:?}"))).collect()
}

#[derive(Debug, Args)]
struct RunArguments {
    #[command(flatten)]
    case: CaseArguments,
    /// Directory for all output, instead of the case's.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Remove the results of an earlier run that are in the output directory. Other files there stay.
    #[arg(long)]
    overwrite: bool,
    #[command(flatten)]
    live: live::LiveFlags,
    #[command(flatten)]
    flags: RunFlags,
}

/// Flags of everything that runs cases.
#[derive(Debug, Args)]
struct RunFlags {
    /// No progress and no summary.
    #[arg(long)]
    quiet: bool,
    /// Let a case run the program that it names as its engine.
    #[arg(long)]
    allow_engine: bool,
    /// Stop with a checkpoint before this much time has passed: 5400, 90m, 1h30m or 01:30:00.
    #[arg(long, value_name = "TIME", value_parser = walltime::parse)]
    max_walltime: Option<Duration>,
}

#[derive(Debug, Args)]
struct ResumeArguments {
    /// Output directory of the run.
    #[arg(value_name = "DIR")]
    directory: PathBuf,
    /// Set a key below `run.` or `output.`, e.g. `--set run.end.steps=20000`, with `--out` any key; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Make a run of its own in this directory, a branch, which continues with the fluid and the particles. DIR stays as it is.
    #[arg(long, value_name = "NEW")]
    out: Option<PathBuf>,
    /// Threads; 0 is one per core. Results do not depend on it.
    #[arg(long)]
    threads: Option<usize>,
    /// Device that computes the fluid: cpu, gpu, gpu:1, a device by its number in `turbid doctor`, or gpu:0,1, which ranks take in turn.
    /// Results do not depend on it.
    #[arg(long)]
    device: Option<String>,
    #[command(flatten)]
    live: live::LiveFlags,
    #[command(flatten)]
    flags: RunFlags,
}

#[derive(Debug, Args)]
struct CheckArguments {
    /// Case file (TOML).
    #[arg(required_unless_present = "schema")]
    case: Option<PathBuf>,
    #[command(flatten)]
    changes: Changes,
    /// Also show the cells, memory, work and messages of each of N ranks (threads or MPI processes).
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    ranks: Option<u64>,
    /// Costs of the machine that the ranks are on, from `turbid bench --calibrate FILE` there, in place of the built-in ones.
    #[arg(long, value_name = "FILE", requires = "ranks")]
    costs: Option<PathBuf>,
    /// Print the JSON schema of case files instead.
    #[arg(long, conflicts_with = "case")]
    schema: bool,
}

#[derive(Debug, Args)]
#[allow(clippy::struct_excessive_bools, reason = "each is a flag of the command line")]
struct BenchArguments {
    #[command(flatten)]
    case: CaseArguments,
    /// Timed steps of each sample.
    #[arg(long, default_value_t = 100, value_parser = clap::value_parser!(u64).range(1..))]
    steps: u64,
    /// Steps before the first sample; as many as a sample if not given. A packing has few contacts at the start.
    #[arg(long)]
    warm_up: Option<u64>,
    /// Let a case run the program that it names as its engine.
    #[arg(long)]
    allow_engine: bool,
    /// Leave out contacts.
    #[arg(long)]
    no_contact: bool,
    /// Leave out particles altogether.
    #[arg(long)]
    fluid_only: bool,
    /// Also write the costs of cells, particles and messages of this machine, for `turbid check --ranks N --costs FILE`.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["no_contact", "fluid_only"])]
    calibrate: Option<PathBuf>,
    /// Print JSON with stable keys.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Args)]
struct PackArguments {
    /// Case file (TOML), whose initial positions are written.
    #[arg(required_unless_present = "from")]
    case: Option<PathBuf>,
    #[command(flatten)]
    changes: Changes,
    /// Output directory of a run, whose last particles are written, with their velocities.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["case", "set", "threads"])]
    from: Option<PathBuf>,
    /// Step of the run, of those whose particles are in a file, instead of the last one.
    #[arg(long, value_name = "N", requires = "from")]
    step: Option<u64>,
    /// File to write. Until it is there, a dense packing keeps its state in FILE.part, from which the same command continues after it was stopped.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Also write a picture of the particles of the case (.png).
    #[arg(long, value_name = "FILE", conflicts_with = "from")]
    picture: Option<PathBuf>,
}

/// Exit code of a complete cross-check, validation or study with failed checks.
const CHECKS_FAILED: u8 = 3;

/// Exit code of [`Error::Interrupted`]: a signal or the time limit came before the end.
const STOPPED: u8 = 4;

/// Exit codes and their meanings.
pub const EXIT_CODES: [(u8, &str); 5] = [
    (0, "success"),
    (2, "invalid input, of which nothing was written; or the machine failed: disk full, out of memory"),
    (CHECKS_FAILED, "the simulation diverged, an external engine or a device failed, or a check failed"),
    (STOPPED, "a signal or --max-walltime stopped run, resume, study or validate early; it can be resumed"),
    (130, "a second interrupt ended the program at once; everything since the last checkpoint is lost"),
];

/// The text on exit codes below the help.
fn exit_codes() -> String {
    let line = |(code, meaning): &(u8, &str)| format!("\n  {code:<5}{meaning}");
    EXIT_CODES.iter().map(line).fold("Exit codes:".to_string(), |text, line| text + &line)
}

/// Runs the program; arguments are those of the process.
pub fn main() -> ExitCode {
    signals::outlive_the_file_limit();
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => return terminal::usage(&error),
    };
    if let Some(done) = place_in_job(&arguments.command) {
        return done;
    }
    #[cfg(feature = "liggghts")]
    if let Command::LiggghtsWorker = arguments.command {
        return turbid::engine::liggghts::worker::main();
    }
    if let Command::LammpsWorker = arguments.command {
        return turbid::engine::lammps::worker();
    }
    let code = carry_out(arguments.command);
    #[cfg(feature = "liggghts")]
    turbid::engine::liggghts::end();
    turbid::engine::lammps::end();
    terminal::exit(code)
}

/// Runs a command; returns the exit code.
fn carry_out(command: Command) -> u8 {
    let passed = match command {
        Command::Run(arguments) => run::run(&arguments).map(|()| true),
        Command::Resume(arguments) => run::resume(&arguments).map(|()| true),
        Command::Check(arguments) => check::check(&arguments).map(|()| true),
        Command::Bench(arguments) => bench::bench(&arguments).map(|()| true),
        Command::Pack(arguments) => pack::pack(&arguments).map(|()| true),
        Command::Mesh(arguments) => mesh::mesh(&arguments).map(|()| true),
        Command::Crosscheck(arguments) => crosscheck::crosscheck(&arguments),
        Command::Study(arguments) => study::study(&arguments),
        Command::Validate(arguments) => validate::validate(&arguments),
        Command::Report(arguments) => report::report(&arguments).map(|()| true),
        Command::Analyse(arguments) => analyse::analyse(&arguments).map(|()| true),
        Command::Film(arguments) => film::film(&arguments).map(|()| true),
        Command::Watch(arguments) => live::watch(&arguments).map(|()| true),
        Command::Doctor => {
            say(&doctor::report());
            Ok(true)
        }
        Command::Completions { shell } => {
            manual::completions(shell);
            Ok(true)
        }
        Command::Man { directory } => manual::man(&directory).map(|()| true),
        #[cfg(feature = "liggghts")]
        Command::LiggghtsWorker => unreachable!("has its own exit"),
        Command::LammpsWorker => unreachable!("has its own exit"),
    };
    match passed {
        Ok(true) => 0,
        Ok(false) => CHECKS_FAILED,
        Err(error) => {
            let code = u8::try_from(error.exit_code()).unwrap_or(1);
            if code != STOPPED {
                terminal::error(&error);
            }
            code
        }
    }
}

/// Exit code of a process of an MPI job that has nothing to do: all processes do a run together, and one does all else.
fn place_in_job(command: &Command) -> Option<ExitCode> {
    let processes = comm::launched()?.size;
    if processes < 2 {
        return None;
    }
    let is_for_all = match command {
        Command::Run(_) | Command::Resume(_) | Command::Bench(_) => true,
        Command::Crosscheck(arguments) => arguments.is_for_all_processes(),
        _ => false,
    };
    if !is_for_all {
        return (!terminal::speaks()).then_some(ExitCode::SUCCESS);
    }
    if cfg!(feature = "mpi") {
        return None;
    }
    let error = Error::Agreed {
        code: 2,
        text: format!(
            "{processes} processes of this program were launched, but it was built without MPI: each would do the same run, \
             into the same files; build it with `cargo build --release --features mpi` (Debian packages libopenmpi-dev, \
             openmpi-bin, libclang-dev), or start one process with --threads {processes}"
        ),
    };
    terminal::error(&error);
    Some(ExitCode::from(2))
}

/// Refuses a name of a picture that does not end in .png.
fn check_picture(path: &Path) -> Result<()> {
    if path.extension().is_some_and(|extension| extension == "png") {
        return Ok(());
    }
    Err(Error::Input(format!("{}: the name of a picture ends in .png", path.display())))
}

/// Reads a case with its changes and prints its warnings and notes.
fn load(path: &Path, changes: &Changes) -> Result<Setup> {
    load_from(path, changes, None)
}

/// The same for all processes of an MPI job, each with its own particles. Collective.
fn load_together(path: &Path, changes: &Changes) -> Result<Setup> {
    follow(changes, None, |set, packing| turbid::simulation::read_together(Origin::File(path), set, packing))
}

/// The same, where a dense packing keeps its state in the file `part`, and continues from it.
fn load_from(path: &Path, changes: &Changes, part: Option<&Path>) -> Result<Setup> {
    follow(changes, part, |set, packing| case::load_followed(path, set, packing))
}

/// Reads a case with these changes, and tells the user about it.
fn follow(
    changes: &Changes,
    part: Option<&Path>,
    read: impl FnOnce(&[String], &mut Packing) -> Result<Setup>,
) -> Result<Setup> {
    let set = changes.all();
    let (read, notes) = terminal::reporting("reading the case and placing its particles", |status| {
        let mut packing = Packing::new(status, part);
        (read(&set, &mut packing), packing.notes)
    });
    for note in notes {
        terminal::remark("note", &note);
    }
    let mut setup = read?;
    setup.plan.threads = changes.threads.unwrap_or(setup.plan.threads);
    for warning in &setup.provenance.warnings {
        warn(warning);
    }
    for note in &setup.provenance.notes {
        terminal::remark("note", note);
    }
    Ok(setup)
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Arguments::command().debug_assert();
    }
}
