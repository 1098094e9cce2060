//! The engine that a case asks for, those that this program has been built with, and those that are programs of the user.

pub mod commands;

use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;
pub use turbid_lammps as lammps;
#[cfg(feature = "liggghts")]
pub use turbid_liggghts as liggghts;
pub use turbid_process as process;

/// Engine that moves the particles of a case.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum EngineChoice {
    /// [`Native`](crate::dem::Native).
    #[default]
    Native,
    /// LIGGGHTS, for spheres; needs the cargo feature `liggghts`.
    Liggghts(LiggghtsOptions),
    /// LAMMPS, for spheres; loads its library while the program runs.
    Lammps(LammpsOptions),
    /// A program that speaks the engine protocol.
    Process(ProcessOptions),
}

impl EngineChoice {
    /// Short name, as that of the [engine](crate::dem::DemEngine::name).
    pub fn name(&self) -> &'static str {
        match self {
            Self::Native => "native",
            Self::Liggghts(_) => "liggghts",
            Self::Lammps(_) => "lammps",
            Self::Process(_) => "process",
        }
    }
}

impl EngineChoice {
    /// True if an engine outside of Turbid has its particles in several processes, where ranks are processes too.
    pub fn is_in_parts(&self) -> bool {
        match self {
            Self::Native => false,
            Self::Liggghts(options) => options.process == EngineProcess::Own,
            Self::Lammps(options) => options.process == EngineProcess::Own,
            Self::Process(options) => options.processes > 1,
        }
    }
}

/// A program that moves the particles.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ProcessOptions {
    /// The program and its arguments.
    pub command: Vec<String>,
    /// Folder in which it runs, and to which a relative path of the program refers.
    pub folder: PathBuf,
    /// Longest time that it may take to answer (s); ten times as long for the set-up, for saving and for resuming.
    pub timeout: f64,
    /// Number of its processes, at least one.
    pub processes: usize,
    /// The whole message to a user who has not allowed it.
    pub refusal: String,
}

impl ProcessOptions {
    /// Parameters of this program, with nothing to move yet; `log` is the file for what it prints, `stop` is set when the run shall
    /// stop.
    pub fn params(&self, log: Option<PathBuf>, stop: Arc<AtomicBool>) -> process::ExternalParams {
        let program = process::Program {
            command: self.command.iter().map(Into::into).collect(),
            folder: Some(self.folder.clone()),
            variables: &[],
            timeout: Duration::from_secs_f64(self.timeout),
            timeout_key: "dem.engine.timeout",
            log,
            stop,
        };
        let label = format!("the program `{}`", self.command.join(" "));
        let host = match self.processes {
            0 | 1 => process::Host::Process(program),
            several => process::Host::Processes(program, several),
        };
        process::ExternalParams::new("process", label, host)
    }
}

/// Options of LAMMPS beyond those of every engine.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LammpsOptions {
    /// Process in which LAMMPS runs.
    pub process: EngineProcess,
    /// Longest time that a worker may take to answer (s), 60 if not given; ten times as long for the set-up and for
    /// saving.
    pub timeout: Option<f64>,
}

impl LammpsOptions {
    /// Parameters of LAMMPS with these options, and nothing to move yet; `log` is the file for what it prints, `stop` is set when the
    /// run shall stop.
    pub fn params(&self, log: Option<PathBuf>, stop: Arc<AtomicBool>) -> process::ExternalParams {
        lammps::params(self.process == EngineProcess::Own, self.timeout, log, stop)
    }
}

/// Options of LIGGGHTS beyond those of every engine.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LiggghtsOptions {
    /// Process in which LIGGGHTS runs.
    pub process: EngineProcess,
    /// Commands of the user, given after all others of the set-up and before the first step; any that
    /// [`commands::accept`] refuses is an error of the set-up.
    pub commands: Vec<String>,
    /// Longest time that a worker may take to answer (s), 60 if not given; ten times as long for the set-up and for
    /// saving.
    pub timeout: Option<f64>,
}

#[cfg(feature = "liggghts")]
impl LiggghtsOptions {
    /// Parameters of LIGGGHTS with these options, and nothing to move yet.
    ///
    /// # Errors
    /// [`Error::Input`] if a command is not one that a case may give.
    pub fn params(&self) -> Result<liggghts::LiggghtsParams> {
        let accepted = |command: &String| {
            commands::accept(command).map_err(|commands::Refusal { title, remedy, .. }| {
                Error::Input(format!(
                    "LIGGGHTS refuses the set-up: the command `{command}` {title}; {remedy}"
                ))
            })
        };
        Ok(liggghts::LiggghtsParams {
            in_this_process: self.process == EngineProcess::Own,
            commands: self.commands.iter().map(accepted).collect::<Result<_>>()?,
            timeout: self.timeout,
            ..liggghts::LiggghtsParams::default()
        })
    }
}

/// Process in which an engine runs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum EngineProcess {
    /// In a process of its own, whose crash ends as an error message.
    #[default]
    Worker,
    /// In this process.
    Own,
}

/// True if this program was built with the cargo feature `liggghts`.
pub const HAS_LIGGGHTS: bool = cfg!(feature = "liggghts");

/// Debian's packages that the cargo feature `liggghts` needs.
pub const LIGGGHTS_PACKAGES: &str = "liggghts libliggghts-dev libopenmpi-dev libclang-dev g++";

/// Refuses an engine that this program was built without or that this machine lacks, and a program of the case that is not `allowed`: a
/// case may come from anybody.
///
/// # Errors
/// That of [`liggghts_is_missing`]; [`Error::Input`] without the library of LAMMPS; [`Error::Case`].
pub fn refuse_unusable(engine: &EngineChoice, allowed: bool) -> Result<()> {
    match engine {
        EngineChoice::Liggghts(_) if !HAS_LIGGGHTS => Err(liggghts_is_missing("`dem.engine = \"liggghts\"`")),
        EngineChoice::Lammps(_) => lammps::load().map_err(|why| {
            Error::Input(format!("`dem.engine = \"lammps\"` needs the library of LAMMPS: {why}"))
        }),
        EngineChoice::Process(options) if !allowed => Err(Error::Case {
            key: "dem.engine".to_string(),
            what: "`dem.engine` starts a program".to_string(),
            remedy: "--allow-engine".to_string(),
            text: options.refusal.clone(),
        }),
        _ => Ok(()),
    }
}

/// The [`Error::Input`] for what needs LIGGGHTS in a program built without it: how to get one with it.
pub fn liggghts_is_missing(what: &str) -> Error {
    Error::Input(format!(
        "{what} needs LIGGGHTS, which this turbid was built without\n  \
         on Debian: apt-get install {LIGGGHTS_PACKAGES}\n  \
         then build with the cargo feature: cargo build --release --features liggghts\n  \
         or let ./run.sh do both: TURBID_FEATURES=liggghts ./run.sh ..."
    ))
}

#[cfg(all(test, feature = "liggghts"))]
mod tests {
    use super::*;

    #[test]
    fn liggghts_is_given_a_command_as_it_was_checked_and_no_other() {
        let with = |command: &str| LiggghtsOptions { commands: vec![command.into()], ..Default::default() };
        let params = with("  fix slow all  viscous 1e-6 # ${name}").params().unwrap();
        assert_eq!(params.commands, ["fix slow all viscous 1e-6"]);
        let refused = with("shell ls").params().unwrap_err().to_string();
        assert!(refused.contains("the command `shell ls`"), "{refused}");
    }
}
