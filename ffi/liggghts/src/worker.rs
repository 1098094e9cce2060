//! LIGGGHTS in a process of its own: this program with a hidden verb, its standard input a socket, which it duplicates and closes
//! before LIGGGHTS starts. What LIGGGHTS and MPI print goes to the log.

use super::session::Engine;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGUSR1};
use std::fs::File;
use std::io;
use std::os::fd::{AsFd, AsRawFd};
use std::os::unix::net::UnixStream;
use std::process::ExitCode;
use std::sync::Arc;
use turbid_process::{Seat, serve};

/// The verb of the worker.
pub const VERB: &str = "liggghts-worker";

/// The worker: answers what comes from the socket that is its standard input, until that closes.
pub fn main() -> ExitCode {
    if run().is_ok() { ExitCode::SUCCESS } else { ExitCode::from(2) }
}

fn run() -> io::Result<()> {
    let mut socket = UnixStream::from(io::stdin().as_fd().try_clone_to_owned()?);
    // Anything else than a socket is an error here: the verb is for this program's own use.
    socket.peer_addr()?;
    // A batch system may send these to every process of a job; the run decides what becomes of them.
    for signal in [SIGHUP, SIGINT, SIGTERM, SIGUSR1] {
        signal_hook::flag::register(signal, Arc::default())?;
    }
    let null = File::open("/dev/null")?;
    for (from, to) in [(null.as_raw_fd(), 0), (2, 1)] {
        // SAFETY: both are open descriptors; from here on nobody reads standard input, and nothing was written to the output.
        if unsafe { libc::dup2(from, to) } < 0 {
            return Err(io::Error::last_os_error());
        }
    }
    // SAFETY: sets the buffering of a stream that nothing has been written to.
    unsafe { liggghts_sys::lgg_flush_lines() };
    let mut engine = Engine::new(Seat::default());
    let outcome = serve(&mut engine, &mut socket);
    drop(engine);
    // SAFETY: the last call to MPI of this process.
    unsafe { liggghts_sys::lgg_finalize() };
    outcome
}
