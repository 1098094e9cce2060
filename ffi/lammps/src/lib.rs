//! LAMMPS as an engine: spheres, behind the messages of the engine protocol. One instance in a worker process or in this one, or one in all
//! processes of an MPI job, where each has the spheres of a block of LAMMPS's own.
//!
//! The library is loaded while the program runs, with all its symbols to itself: LIGGGHTS, which the program may be linked with, has the
//! same ones. LAMMPS is under the GNU General Public License, version 2; nothing of it is part of this crate.
//!
//! Debian's LAMMPS has no exceptions: an error ends the process in which it runs, and all processes of an MPI job.

mod deck;
mod library;
mod screen;
mod session;

pub use library::{end, load};

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use turbid_process::{ExternalParams, Host, Program, Seat, work};

/// The verb of the worker.
pub const VERB: &str = "lammps-worker";

/// Debian's package with the library.
pub const PACKAGE: &str = "liblammps0";

/// Parameters of LAMMPS, with nothing to move yet: in this process, in all of them if the ranks are processes of MPI; or in a worker that
/// may take `timeout` (s) to answer. `log` is the file for what it prints in the set-up, `stop` is set when the run shall stop.
pub fn params(
    in_this_process: bool,
    timeout: Option<f64>,
    log: Option<PathBuf>,
    stop: Arc<AtomicBool>,
) -> ExternalParams {
    let options = serde_json::json!({ "log_file": &log });
    let host = if in_this_process {
        Host::Here(|seat| Box::new(session::Engine::new(seat)))
    } else {
        Host::Process(Program::worker((None, VERB), (timeout, "dem.lammps.timeout"), log, stop))
    };
    ExternalParams { options, regroups: true, ..ExternalParams::new("lammps", "LAMMPS".to_owned(), host) }
}

/// The worker: answers what comes from the socket that is its standard input, until that closes.
pub fn worker() -> ExitCode {
    let outcome = work(|| session::Engine::new(Seat::default()));
    end();
    if outcome.is_ok() { ExitCode::SUCCESS } else { ExitCode::from(2) }
}
