//! LIGGGHTS in a process of its own.

use super::session::Engine;
use std::process::ExitCode;
use turbid_process::{Seat, work};

/// The verb of the worker.
pub const VERB: &str = "liggghts-worker";

/// The worker: answers what comes from the socket that is its standard input, until that closes.
pub fn main() -> ExitCode {
    let outcome = work(|| {
        // SAFETY: sets the buffering of a stream that nothing has been written to.
        unsafe { liggghts_sys::lgg_flush_lines() };
        Engine::new(Seat::default())
    });
    // SAFETY: the last call to MPI of this process.
    unsafe { liggghts_sys::lgg_finalize() };
    if outcome.is_ok() { ExitCode::SUCCESS } else { ExitCode::from(2) }
}
