//! LIGGGHTS in a process of its own: a crash there is an error message here.
//!
//! The worker is this program again, with a verb of its own; its standard input is one end of a private socket, which it
//! moves away before LIGGGHTS starts. What LIGGGHTS and MPI print goes to the log. The worker ends when the socket
//! does, so it never outlives the run.

use super::LiggghtsParams;
use super::protocol::{Reply, Request};
use super::session::Session;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGUSR1};
use std::fmt::Write as _;
use std::fs::{File, OpenOptions};
use std::io;
use std::os::fd::{AsFd, OwnedFd};
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

/// How long a worker may take to end once it is told to.
const PATIENCE: Duration = Duration::from_secs(2);
/// How long a worker may still take to answer once the run is told to stop.
const GRACE: Duration = Duration::from_secs(5);
/// Time between two looks at a worker that is ending.
const PAUSE: Duration = Duration::from_millis(1);
/// Time between two looks at the stop flag while a worker does not answer.
const LOOK: Duration = Duration::from_millis(50);
/// Lines of the log that an error message quotes.
const QUOTED: usize = 8;

/// Variables of a launcher of MPI: the worker is no rank of the job.
const OF_LAUNCHERS: [&str; 3] = ["OMPI_", "PMIX_", "PMI_"];

/// One process, started in a tenth of the usual time and without a daemon.
const ALONE: [(&str, &str); 4] = [
    ("OMPI_MCA_ess_singleton_isolated", "1"),
    // Workers that begin and end at the same time would remove each other's.
    ("OMPI_MCA_orte_create_session_dirs", "0"),
    ("OMPI_MCA_btl", "self"),
    ("OMPI_MCA_pml", "ob1"),
];

/// A worker and the socket to it.
#[derive(Debug)]
pub(crate) struct Worker {
    child: Child,
    /// `None` when the worker has been told to end.
    line: Option<Line>,
    timeout: Duration,
    log_file: Option<PathBuf>,
    /// Length of the log when the worker last answered.
    logged: u64,
}

impl Worker {
    /// Starts a worker: `program`, or the program that runs now. What it prints goes to the end of `log`.
    pub(super) fn start(params: &LiggghtsParams) -> Result<Self, String> {
        let (program, log) = (params.program.as_deref(), params.log.as_deref());
        let program = match program {
            Some(program) => program.to_owned(),
            None => std::env::current_exe().map_err(|e| format!("cannot find this program: {e}"))?,
        };
        let failed = |e: io::Error| format!("cannot start {} as a worker: {e}", program.display());
        let (here, there) = UnixStream::pair().map_err(failed)?;
        here.set_read_timeout(Some(LOOK)).map_err(failed)?;
        here.set_write_timeout(Some(LOOK)).map_err(failed)?;
        let output = match log {
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
        let logged = log.map_or(0, length);
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
        Ok(Self {
            child,
            line: Some(Line {
                socket: here,
                stop: Arc::clone(&params.stop),
                told: false,
                waited: Duration::ZERO,
                limit: Duration::ZERO,
            }),
            timeout: Duration::from_secs_f64(params.timeout.unwrap_or(60.0)),
            log_file: log.map(Path::to_owned),
            logged,
        })
    }

    /// Asks the worker. One that does not answer is gone, and the reply says how it ended.
    pub(super) fn ask(&mut self, request: &Request) -> Reply {
        let Some(line) = &mut self.line else {
            return Reply::Failed("LIGGGHTS has ended before".to_owned());
        };
        let brief = matches!(request, Request::Advance { .. } | Request::Touches);
        line.limit = if brief { self.timeout } else { 10 * self.timeout };
        (line.waited, line.told) = (Duration::ZERO, false);
        match request.write(line).and_then(|()| Reply::read(line)) {
            Ok(reply) => {
                // Only the set-up writes to it.
                if matches!(request, Request::Open(..) | Request::Resume(..)) {
                    self.logged = self.log_file.as_deref().map_or(0, length);
                }
                reply
            }
            Err(error) => Reply::Failed(self.how_it_ended(&error)),
        }
    }

    /// What became of a worker that has not answered.
    fn how_it_ended(&mut self, error: &io::Error) -> String {
        self.line = None;
        let mut text = if error.kind() == io::ErrorKind::TimedOut {
            self.kill();
            format!("its process {error}; it has been ended")
        } else {
            match self.wait() {
                Some(status) => {
                    let how = describe(status);
                    format!("its process {how}; the run cannot go on without it")
                }
                None => format!("its process does not answer ({error})"),
            }
        };
        if let Some(log) = &self.log_file {
            let lines = last_lines(log, self.logged);
            if !lines.is_empty() {
                let _ = write!(text, "\n  the end of {}:", log.display());
                for line in lines {
                    let _ = write!(text, "\n  | {line}");
                }
            }
        }
        text
    }

    /// Waits for the worker to end; one that does not is ended.
    fn wait(&mut self) -> Option<ExitStatus> {
        let start = Instant::now();
        loop {
            if let Ok(Some(status)) = self.child.try_wait() {
                return Some(status);
            }
            if start.elapsed() > PATIENCE {
                self.kill();
                return None;
            }
            std::thread::sleep(PAUSE);
        }
    }

    /// Ends the worker, even one that is stopped.
    fn kill(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The socket to a worker: waits for it as long as it may take, and only briefly once the run is told to stop.
#[derive(Debug)]
struct Line {
    socket: UnixStream,
    /// Set when the run is told to stop.
    stop: Arc<AtomicBool>,
    /// Whether that was seen while waiting for the present answer.
    told: bool,
    /// Time waited for the present answer. A sum of looks: what passes while this process is suspended does not count.
    waited: Duration,
    limit: Duration,
}

impl Line {
    /// Repeats what the socket was not ready for, until it is or the time is over.
    fn patiently<R>(&mut self, mut attempt: impl FnMut(&mut UnixStream) -> io::Result<R>) -> io::Result<R> {
        loop {
            match attempt(&mut self.socket) {
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => self.waited += LOOK,
                outcome => return outcome,
            }
            if !self.told && self.stop.load(Ordering::Relaxed) {
                // A worker that is at work is given the time to finish the step, so that a checkpoint can be written.
                self.told = true;
                self.limit = self.limit.min(self.waited + GRACE);
            }
            if self.waited >= self.limit {
                let why = if self.told { "and the run is to stop" } else { "(see `dem.liggghts.timeout`)" };
                let text = format!("has not answered for {:.1} s {why}", self.waited.as_secs_f64());
                return Err(io::Error::new(io::ErrorKind::TimedOut, text));
            }
        }
    }
}

impl io::Read for Line {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.patiently(|socket| socket.read(buffer))
    }
}

impl io::Write for Line {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        self.patiently(|socket| socket.write(buffer))
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
        self.line = None;
        self.wait();
    }
}

fn describe(status: ExitStatus) -> String {
    match (status.signal(), status.code()) {
        (Some(signal), _) => format!("was ended by signal {signal}{}", name_of(signal)),
        (_, Some(code)) => format!("has ended with exit code {code}"),
        _ => "has ended".to_owned(),
    }
}

/// Name of a signal that a worker is likely to die of.
fn name_of(signal: i32) -> &'static str {
    match signal {
        libc::SIGSEGV => " (SIGSEGV: a bad pointer in LIGGGHTS)",
        libc::SIGABRT => " (SIGABRT: LIGGGHTS or a library below it has given up)",
        libc::SIGFPE => " (SIGFPE)",
        libc::SIGBUS => " (SIGBUS)",
        libc::SIGKILL => " (SIGKILL: by someone, or for want of memory)",
        libc::SIGTERM => " (SIGTERM)",
        _ => "",
    }
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
    let from = lines.len().saturating_sub(QUOTED);
    lines[from..].iter().map(|line| (*line).to_owned()).collect()
}

/// The worker: answers what comes from the socket that is its standard input, until that closes.
pub fn main() -> ExitCode {
    match serve() {
        Ok(()) => ExitCode::SUCCESS,
        Err(_) => ExitCode::from(2),
    }
}

fn serve() -> io::Result<()> {
    let stdin = io::stdin().as_fd().try_clone_to_owned()?;
    let mut socket = UnixStream::from(stdin);
    // Anything else than a socket is an error here: the verb is for this program's own use.
    socket.peer_addr()?;
    // A batch system may send these to every process of a job; the run decides what becomes of them.
    for signal in [SIGHUP, SIGINT, SIGTERM, SIGUSR1] {
        signal_hook::flag::register(signal, Arc::default())?;
    }
    let null = File::open("/dev/null")?;
    // SAFETY: both are open descriptors; from here on nobody reads standard input.
    if unsafe { libc::dup2(std::os::fd::AsRawFd::as_raw_fd(&null), 0) } < 0 {
        return Err(io::Error::last_os_error());
    }
    // SAFETY: sets the buffering of a stream that nothing has been written to.
    unsafe { liggghts_sys::lgg_flush_lines() };
    let mut session = Session::new();
    let outcome = loop {
        let request = match Request::read(&mut socket) {
            Ok(request) => request,
            // The run has ended.
            Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => break Ok(()),
            Err(error) => break Err(error),
        };
        let reply = session.serve(request);
        if reply.write(&mut socket).is_err() {
            break Ok(());
        }
    };
    drop(session);
    // SAFETY: the last call to MPI of this process.
    unsafe { liggghts_sys::lgg_finalize() };
    outcome
}
