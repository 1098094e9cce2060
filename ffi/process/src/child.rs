//! An engine in a process of its own: a crash there is an error message here.
//!
//! Its standard input and output are both one end of a private socket, and what it prints on the standard error goes to the log.
//! It is ended with the run, with what is left of its process group, and reads the end of the socket if the run is killed.

use crate::message::{self, Kind, Outcome};
use signal_hook::low_level::signal_name;
use std::ffi::OsString;
use std::fmt::Write as _;
use std::fs::{File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom};
use std::os::fd::OwnedFd;
use std::os::unix::fs::OpenOptionsExt;
use std::os::unix::net::UnixStream;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Time that an engine may take to end once its socket is closed.
const ENDING: Duration = Duration::from_secs(2);
/// Time that an engine may still take to answer once the run is told to stop.
const GRACE: Duration = Duration::from_secs(5);
/// Time between two checks of an engine that is ending.
const PAUSE: Duration = Duration::from_millis(1);
/// Time between two checks of the stop flag while an engine does not answer.
const CHECK: Duration = Duration::from_millis(50);
/// Lines of the log that an error message quotes.
const QUOTED: usize = 8;
/// Bytes at the end of the log in which they are looked for.
const LOG_END: u64 = 1 << 16;

/// Variables of a launcher of MPI: the engine is no rank of the job.
const OF_LAUNCHERS: [&str; 3] = ["OMPI_", "PMIX_", "PMI_"];

/// A program to start, and the time to wait for it.
#[derive(Clone, Debug, Default)]
pub struct Program {
    /// The program and its arguments.
    pub command: Vec<OsString>,
    /// Folder in which it runs, and to which a relative path of the program refers; without, that of this process.
    pub folder: Option<PathBuf>,
    /// Variables that are set in its environment.
    pub variables: &'static [(&'static str, &'static str)],
    /// Longest time that it may take to answer; ten times as long for the start, the set-up, saving and resuming.
    pub timeout: Duration,
    /// Key of the case with that time, for messages.
    pub timeout_key: &'static str,
    /// File to which what it prints is appended.
    pub log: Option<PathBuf>,
    /// Set when the run is told to stop: then an engine that does not answer is not waited for much longer.
    pub stop: Arc<AtomicBool>,
}

/// A message that waits for its answer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Asked {
    pub(crate) kind: Kind,
    /// Processes of the engine.
    pub(crate) parts: usize,
    /// Most bytes of the answer.
    pub(crate) most: u64,
}

/// An engine and the socket to it.
#[derive(Debug)]
pub(crate) struct Worker {
    child: Child,
    /// `None` once it is to end.
    channel: Option<Channel>,
    timeout: Duration,
    log_file: Option<PathBuf>,
    /// Length of the log at the end of the set-up.
    logged: u64,
}

impl Worker {
    /// Starts an engine. What it prints goes to the end of the log.
    pub(crate) fn start(program: &Program) -> Outcome<Self> {
        let (name, arguments) = program.command.split_first().ok_or("the command is empty")?;
        let failed = |e: io::Error| format!("cannot start {}: {e}", name.display());
        let (here, there) = UnixStream::pair().map_err(failed)?;
        here.set_read_timeout(Some(CHECK)).map_err(failed)?;
        here.set_write_timeout(Some(CHECK)).map_err(failed)?;
        let output = match &program.log {
            Some(path) => open_log(path)?,
            None => OpenOptions::new().write(true).open("/dev/null").map_err(failed)?,
        };
        let path = match &program.folder {
            Some(folder) if Path::new(name).components().nth(1).is_some() => folder.join(name),
            _ => PathBuf::from(name),
        };
        let mut command = Command::new(path);
        for (name, _) in std::env::vars_os() {
            let text = name.to_string_lossy();
            if OF_LAUNCHERS.iter().any(|prefix| text.starts_with(prefix)) {
                command.env_remove(&name);
            }
        }
        // It may print as soon as it runs.
        let logged = program.log.as_deref().map_or(0, length);
        command.args(arguments).envs(program.variables.iter().copied());
        if let Some(folder) = &program.folder {
            command.current_dir(folder);
        }
        let child = command
            // A signal of the terminal ends the run in order; the engine then ends with the socket.
            .process_group(0)
            .stdin(Stdio::from(OwnedFd::from(there.try_clone().map_err(failed)?)))
            .stdout(Stdio::from(OwnedFd::from(there)))
            .stderr(Stdio::from(output))
            .spawn()
            .map_err(failed)?;
        let (stop, zero, key) = (Arc::clone(&program.stop), Duration::ZERO, program.timeout_key);
        Ok(Self {
            child,
            channel: Some(Channel { socket: here, stop, stopping: false, waited: zero, limit: zero, key }),
            timeout: program.timeout,
            log_file: program.log.clone(),
            logged,
        })
    }

    /// Sends a message and waits for the answer of at most `most` bytes to what was `asked`; one of several processes may answer with an
    /// exchange first. One that does not answer, or not as the protocol has it, is gone, and the error says how it ended.
    pub(crate) fn ask(&mut self, kind: Kind, payload: &[u8], asked: &Asked) -> Outcome<(Kind, Vec<u8>)> {
        let channel = self.channel.as_mut().ok_or("its process has ended before")?;
        let brief = matches!(asked.kind, Kind::Advance | Kind::ListContacts);
        channel.limit = if brief { self.timeout } else { 10 * self.timeout };
        (channel.waited, channel.stopping) = (Duration::ZERO, false);
        // One that has ended may have said why.
        let sent = message::write(channel, kind, payload);
        let (answer, bytes) =
            match message::read(channel, asked.most).map_err(|read| sent.err().unwrap_or(read)) {
                Ok(message) => message,
                Err(error) => return Err(self.how_it_ended(&error)),
            };
        // Only the set-up writes to the log.
        if asked.kind == Kind::SetUp {
            self.logged = self.log_file.as_deref().map_or(0, length);
        }
        if answer == Kind::Error {
            return Err(String::from_utf8_lossy(&bytes).into_owned());
        }
        if answer != asked.kind.answer() && (answer != Kind::Exchange || asked.parts == 1) {
            self.kill();
            return Err(format!("answered `{}` with the message `{}`", kind.name(), answer.name()));
        }
        Ok((answer, bytes))
    }

    /// Message about the end of an engine that has not answered.
    fn how_it_ended(&mut self, error: &io::Error) -> String {
        self.channel = None;
        let mut text = if error.kind() == io::ErrorKind::TimedOut {
            self.kill();
            format!("its process {error}; it has been ended")
        } else if error.kind() == io::ErrorKind::InvalidData {
            self.kill();
            error.to_string()
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

    /// Waits for it to end; one that does not is ended, and so is what either has started.
    fn wait(&mut self) -> Option<ExitStatus> {
        let start = Instant::now();
        let ended = loop {
            if self.has_ended() || start.elapsed() > ENDING {
                break self.has_ended();
            }
            std::thread::sleep(PAUSE);
        };
        self.kill().filter(|_| ended)
    }

    /// True if it has ended; it is not waited for, so that its number stays its own.
    fn has_ended(&self) -> bool {
        let flags = libc::WEXITED | libc::WNOHANG | libc::WNOWAIT;
        // SAFETY: a structure of numbers, for which zeros are valid.
        let mut state: libc::siginfo_t = unsafe { std::mem::zeroed() };
        // SAFETY: the structure is there to be written to, and the process is a child that has not been waited for.
        let asked = unsafe { libc::waitid(libc::P_PID, self.child.id(), &raw mut state, flags) };
        // SAFETY: `waitid` has filled it, or left zeros where nothing has ended.
        asked == 0 && unsafe { state.si_pid() } != 0
    }

    /// Ends it and what it has started, even if it is stopped; how it ended.
    fn kill(&mut self) -> Option<ExitStatus> {
        self.channel = None;
        // SAFETY: takes numbers only; the group is that of a child that has not been waited for, so it is still its own.
        unsafe { libc::kill(-(self.child.id() as libc::pid_t), libc::SIGKILL) };
        self.child.wait().ok()
    }
}

/// The socket to an engine: waits for it up to a limit, and only briefly once the run is told to stop.
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
    key: &'static str,
}

impl Channel {
    /// Repeats what the socket was not ready for, until it is or the time is over.
    fn retry<R>(&mut self, mut attempt: impl FnMut(&mut UnixStream) -> io::Result<R>) -> io::Result<R> {
        loop {
            let start = Instant::now();
            let outcome = attempt(&mut self.socket);
            self.waited += start.elapsed().min(CHECK);
            if !self.stopping && self.stop.load(Ordering::Relaxed) {
                // An engine that is at work is given the time to finish the step, so that a checkpoint can be written.
                self.stopping = true;
                self.limit = self.limit.min(self.waited + GRACE);
            }
            let is_open = matches!(&outcome, Err(error) if error.kind() == io::ErrorKind::WouldBlock);
            if self.waited >= self.limit {
                let (waited, key) = (self.waited.as_secs_f64(), self.key);
                let why = if self.stopping {
                    "and the run is to stop".to_owned()
                } else {
                    format!("(see `{key}`)")
                };
                let text = format!("has not answered for {waited:.1} s {why}");
                return Err(io::Error::new(io::ErrorKind::TimedOut, text));
            }
            if !is_open {
                return outcome;
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
///
/// # Errors
/// Reason for which it cannot be written.
pub fn open_log(path: &Path) -> Result<File, String> {
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
        if let Some(mut channel) = self.channel.take() {
            channel.limit = PAUSE;
            let _ = message::write(&mut channel, Kind::Goodbye, &[]);
            drop(channel);
            self.wait();
        }
    }
}

fn describe(status: ExitStatus) -> String {
    let Some(signal) = status.signal() else {
        return status
            .code()
            .map_or("has ended".to_owned(), |code| format!("has ended with exit code {code}"));
    };
    let remark = match signal {
        libc::SIGSEGV => ": a bad pointer",
        libc::SIGABRT => ": the engine or a library below it has given up",
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
    let mut bytes = Vec::new();
    if let Ok(mut file) = File::open(log) {
        let from = after.max(length(log).saturating_sub(LOG_END));
        let _ = file.seek(SeekFrom::Start(from)).and_then(|_| file.take(LOG_END).read_to_end(&mut bytes));
    }
    let text = String::from_utf8_lossy(&bytes);
    let lines: Vec<&str> = text.lines().map(str::trim_end).filter(|line| !line.is_empty()).collect();
    lines[lines.len().saturating_sub(QUOTED)..].iter().map(ToString::to_string).collect()
}
