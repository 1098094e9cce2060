//! An engine of this program in a process of its own: this program with a hidden verb, its standard input a socket, which it duplicates and
//! closes before the engine starts. What the engine and MPI print goes to the log.

use crate::child::Program;
use crate::serve::{Served, serve};
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGUSR1};
use std::fs::File;
use std::io;
use std::os::fd::{AsFd, AsRawFd};
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// Longest time that a worker may take to answer if the case does not say (s).
const TIMEOUT: f64 = 60.0;

/// One process of MPI, started in a tenth of the usual time and without a daemon.
const ALONE: [(&str, &str); 5] = [
    ("OMPI_MCA_ess_singleton_isolated", "1"),
    // Workers that begin and end at the same time would remove each other's.
    ("OMPI_MCA_orte_create_session_dirs", "0"),
    ("OMPI_MCA_btl", "self"),
    ("OMPI_MCA_pml", "ob1"),
    // MPI looks for devices through it, and drivers of OpenCL catch signals: an abort would not end the worker.
    ("HWLOC_COMPONENTS", "-opencl"),
];

impl Program {
    /// A worker: `program`, or the program that runs now, with this hidden verb; `timeout` (s) is the value of the key of the case.
    pub fn worker(
        (program, verb): (Option<PathBuf>, &str),
        (timeout, timeout_key): (Option<f64>, &'static str),
        log: Option<PathBuf>,
        stop: Arc<AtomicBool>,
    ) -> Self {
        let program = program.or_else(|| std::env::current_exe().ok());
        Self {
            command: vec![program.unwrap_or_else(|| "turbid".into()).into(), verb.into()],
            folder: None,
            variables: &ALONE,
            timeout: Duration::from_secs_f64(timeout.unwrap_or(TIMEOUT)),
            timeout_key,
            log,
            stop,
        }
    }
}

/// Answers, with the engine that `start` makes, what comes from the socket that is the standard input, until that closes.
///
/// # Errors
/// Those of the socket.
pub fn work<E: Served>(start: impl FnOnce() -> E) -> io::Result<()> {
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
    serve(&mut start(), &mut socket)
}
