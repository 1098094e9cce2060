//! LIGGGHTS in a process of its own: a crash there is an error message here.
//!
//! The worker is this program with a hidden verb; its standard input is one end of a private socket, which it duplicates and
//! closes before LIGGGHTS starts. What LIGGGHTS and MPI print goes to the log. The worker ends when the socket closes, so it
//! never outlives the run.

use super::LiggghtsParams;
use super::instance::Outcome;
use super::protocol::{Request, read, write};
use super::session::serve;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGUSR1};
use signal_hook::low_level::signal_name;
use std::fmt::Write as _;
use std::fs::{File, OpenOptions};
use std::io;
use std::os::fd::{AsFd, AsRawFd, OwnedFd};
use std::os::unix::fs::OpenOptionsExt;
use std::os::unix::net::UnixStream;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitCode, ExitStatus, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// The verb of the worker.
pub const VERB: &str = "liggghts-worker";

/// Time that a worker may take to end once its socket is closed.
const ENDING: Duration = Duration::from_secs(2);
/// Time that a worker may still take to answer once the run is told to stop.
const GRACE: Duration = Duration::from_secs(5);
/// Time between two checks of a worker that is ending.
const PAUSE: Duration = Duration::from_millis(1);
/// Time between two checks of the stop flag while a worker does not answer.
const CHECK: Duration = Duration::from_millis(50);
/// Lines of the log that an error message quotes.
const QUOTED: usize = 8;

/// Variables of a launcher of MPI: the worker is no rank of the job.
const OF_LAUNCHERS: [&str; 3] = ["OMPI_", "PMIX_", "PMI_"];

/// One process, started in a tenth of the usual time and without a daemon.
const ALONE: [(&str, &str); 5] = [
    ("OMPI_MCA_ess_singleton_isolated", "1"),
    // Workers that begin and end at the same time would remove each other's.
    ("OMPI_MCA_orte_create_session_dirs", "0"),
    ("OMPI_MCA_btl", "self"),
    ("OMPI_MCA_pml", "ob1"),
    // MPI looks for devices through it, and drivers of OpenCL catch signals: an abort would not end the worker.
    ("HWLOC_COMPONENTS", "-opencl"),
];

/// A worker and the socket to it.
#[derive(Debug)]
pub(crate) struct Worker {
    child: Child,
    /// `None` once the worker is to end.
    channel: Option<Channel>,
    timeout: Duration,
    log_file: Option<PathBuf>,
    /// Length of the log at the end of the set-up.
    logged: u64,
}

impl Worker {
    /// Starts a worker: the program of `params`, or the one that runs now. What it prints goes to the end of the log.
    pub(super) fn start(params: &LiggghtsParams) -> Outcome<Self> {
        let program = match &params.program {
            Some(program) => program.clone(),
            None => std::env::current_exe().map_err(|e| format!("cannot find this program: {e}"))?,
        };
        let failed = |e: io::Error| format!("cannot start {} as a worker: {e}", program.display());
        let (here, there) = UnixStream::pair().map_err(failed)?;
        here.set_read_timeout(Some(CHECK)).map_err(failed)?;
        here.set_write_timeout(Some(CHECK)).map_err(failed)?;
        let output = match &params.log {
            Some(path) => open_log(path)?,
            None => OpenOptions::new().write(true).open("/dev/null").map_err(failed)?,
        };
        let mut command = Command::new(&program);
        for (name, _) in std::env::vars_os() {
            let text = name.to_string_lossy();
            if OF_LAUNCHERS.iter().any(|prefix| text.starts_with(prefix)) {
                command.env_remove(&name);
            }
        }
        // A worker may print as soon as it runs.
        let logged = params.log.as_deref().map_or(0, length);
        let child = command
            .arg(VERB)
            .envs(ALONE)
            // A signal of the terminal ends the run in order; the worker then ends with the socket.
            .process_group(0)
            .stdin(Stdio::from(OwnedFd::from(there)))
            .stdout(Stdio::from(output.try_clone().map_err(failed)?))
            .stderr(Stdio::from(output))
            .spawn()
            .map_err(failed)?;
        let (stop, zero) = (Arc::clone(&params.stop), Duration::ZERO);
        Ok(Self {
            child,
            channel: Some(Channel { socket: here, stop, stopping: false, waited: zero, limit: zero }),
            timeout: Duration::from_secs_f64(params.timeout.unwrap_or(60.0)),
            log_file: params.log.clone(),
            logged,
        })
    }

    /// Asks the worker. One that does not answer is gone, and the error says how it ended.
    pub(super) fn ask(&mut self, request: &Request, bytes: &[u8]) -> Outcome<Vec<u8>> {
        let channel = self.channel.as_mut().ok_or("LIGGGHTS has ended before")?;
        let brief = matches!(request, Request::Advance { .. } | Request::Contacts);
        channel.limit = if brief { self.timeout } else { 10 * self.timeout };
        (channel.waited, channel.stopping) = (Duration::ZERO, false);
        let answer = write(channel, request, bytes).and_then(|()| read::<Outcome<()>>(channel));
        let (outcome, bytes) = answer.map_err(|error| self.how_it_ended(&error))?;
        // Only the set-up writes to the log.
        if matches!(request, Request::Open(..)) {
            self.logged = self.log_file.as_deref().map_or(0, length);
        }
        outcome.map(|()| bytes)
    }

    /// Message about the end of a worker that has not answered.
    fn how_it_ended(&mut self, error: &io::Error) -> String {
        self.channel = None;
        let mut text = if error.kind() == io::ErrorKind::TimedOut {
            self.kill();
            format!("its process {error}; it has been ended")
        } else {
            match self.wait() {
                Some(status) => {
                    format!("its process {}; the run cannot continue without it", describe(status))
                }
                None => format!("its process does not answer ({error})"),
            }
        };
        if let Some(log) = &self.log_file {
            let lines = last_lines(log, self.logged);
            if !lines.is_empty() {
                let _ = write!(text, "\n  the end of {}:\n  | {}", log.display(), lines.join("\n  | "));
            }
        }
        text
    }

    /// Waits for the worker to end; one that does not is ended.
    fn wait(&mut self) -> Option<ExitStatus> {
        let start = Instant::now();
        while start.elapsed() <= ENDING {
            if let Ok(Some(status)) = self.child.try_wait() {
                return Some(status);
            }
            std::thread::sleep(PAUSE);
        }
        self.kill();
        None
    }

    /// Ends the worker, even one that is stopped.
    fn kill(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The socket to a worker: waits for it up to a limit, and only briefly once the run is told to stop.
#[derive(Debug)]
struct Channel {
    socket: UnixStream,
    /// Set when the run is told to stop.
    stop: Arc<AtomicBool>,
    /// True if that was seen while waiting for the present answer.
    stopping: bool,
    /// Time waited for the present answer, as a sum of checks: time in which this process is suspended does not count.
    waited: Duration,
    limit: Duration,
}

impl Channel {
    /// Repeats what the socket was not ready for, until it is or the time is over.
    fn retry<R>(&mut self, mut attempt: impl FnMut(&mut UnixStream) -> io::Result<R>) -> io::Result<R> {
        loop {
            match attempt(&mut self.socket) {
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => self.waited += CHECK,
                outcome => return outcome,
            }
            if !self.stopping && self.stop.load(Ordering::Relaxed) {
                // A worker that is at work is given the time to finish the step, so that a checkpoint can be written.
                self.stopping = true;
                self.limit = self.limit.min(self.waited + GRACE);
            }
            if self.waited >= self.limit {
                let why =
                    if self.stopping { "and the run is to stop" } else { "(see `dem.liggghts.timeout`)" };
                let text = format!("has not answered for {:.1} s {why}", self.waited.as_secs_f64());
                return Err(io::Error::new(io::ErrorKind::TimedOut, text));
            }
        }
    }
}

impl io::Read for Channel {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.retry(|socket| socket.read(buffer))
    }
}

impl io::Write for Channel {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        self.retry(|socket| socket.write(buffer))
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// The log, to be added to: not what a link of its name points to, and nothing else than a file.
pub(crate) fn open_log(path: &Path) -> Result<File, String> {
    let failed = |e: io::Error| format!("cannot write {}: {e}", path.display());
    let mut options = OpenOptions::new();
    let flags = libc::O_NOFOLLOW | libc::O_NONBLOCK;
    let log = options.create(true).append(true).custom_flags(flags).open(path).map_err(failed)?;
    if log.metadata().map_err(failed)?.is_file() {
        Ok(log)
    } else {
        Err(format!("cannot write {}: it is not a file", path.display()))
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.channel = None;
        self.wait();
    }
}

fn describe(status: ExitStatus) -> String {
    let Some(signal) = status.signal() else {
        return status
            .code()
            .map_or("has ended".to_owned(), |code| format!("has ended with exit code {code}"));
    };
    let remark = match signal {
        libc::SIGSEGV => ": a bad pointer in LIGGGHTS",
        libc::SIGABRT => ": LIGGGHTS or a library below it has given up",
        libc::SIGKILL => ": by someone, or for want of memory",
        _ => "",
    };
    let name = signal_name(signal).unwrap_or("unknown");
    format!("was ended by signal {signal} ({name}{remark})")
}

/// Length of a file (bytes).
fn length(file: &Path) -> u64 {
    std::fs::metadata(file).map_or(0, |data| data.len())
}

/// The last lines of a log after its first bytes that say something.
fn last_lines(log: &Path, after: u64) -> Vec<String> {
    let bytes = std::fs::read(log).unwrap_or_default();
    let text = String::from_utf8_lossy(bytes.get(after as usize..).unwrap_or_default());
    let lines: Vec<&str> = text.lines().map(str::trim_end).filter(|line| !line.is_empty()).collect();
    lines[lines.len().saturating_sub(QUOTED)..].iter().map(ToString::to_string).collect()
}

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
    // SAFETY: both are open descriptors; from here on nobody reads standard input.
    if unsafe { libc::dup2(null.as_raw_fd(), 0) } < 0 {
        return Err(io::Error::last_os_error());
    }
    // SAFETY: sets the buffering of a stream that nothing has been written to.
    unsafe { liggghts_sys::lgg_flush_lines() };
    let mut session = None;
    let outcome = loop {
        let (request, bytes) = match read(&mut socket) {
            Ok(message) => message,
            // The run has ended.
            Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => break Ok(()),
            Err(error) => break Err(error),
        };
        let (head, bytes) = match serve(&mut session, request, &bytes) {
            Ok(bytes) => (Ok(()), bytes),
            Err(text) => (Err(text), Vec::new()),
        };
        if write(&mut socket, &head, &bytes).is_err() {
            break Ok(());
        }
    };
    drop(session);
    // SAFETY: the last call to MPI of this process.
    unsafe { liggghts_sys::lgg_finalize() };
    outcome
}
