//! Signals: SIGINT, SIGTERM and SIGHUP stop a run, SIGUSR1 asks it for a checkpoint, SIGXFSZ must not end it.

use super::terminal::notice;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGUSR1, SIGXFSZ};
use signal_hook::flag;
use signal_hook::iterator::Signals;
use std::io;
use std::path::Path;
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};
use turbid::error::{Error, Result};
use turbid::memory;
use turbid::simulation::RunOptions;

/// Time after the first SIGINT in which others are ignored: a key that is held down, or a launcher that repeats it.
const GRACE: Duration = Duration::from_secs(2);

/// Exit code after a further SIGINT, as shells have it for an interrupt.
const ABORTED: i32 = 130;

/// Makes a write beyond the limit on the size of files an error instead of the end of the process.
pub(super) fn outlive_the_file_limit() {
    // Any handler does; it can be refused for SIGKILL, SIGSTOP and the like only.
    let _ = flag::register(SIGXFSZ, Arc::default());
}

/// Lets signals set the flags of `options`. The first SIGINT prints `answer`; one more than [`GRACE`] later ends the process.
/// Launchers may send SIGTERM more than once.
pub(super) fn listen(options: &RunOptions, answer: &'static str) -> Result<()> {
    let attempt = || -> io::Result<()> {
        for signal in [SIGINT, SIGTERM] {
            flag::register(signal, Arc::clone(&options.stop))?;
        }
        // Set by `nohup`.
        if !is_ignored(SIGHUP) {
            flag::register(SIGHUP, Arc::clone(&options.stop))?;
        }
        flag::register(SIGUSR1, Arc::clone(&options.checkpoint))?;
        let mut interrupts = Signals::new([SIGINT])?;
        let mut listen = move || {
            let mut first = None;
            for _ in &mut interrupts {
                match first {
                    None => {
                        first = Some(Instant::now());
                        notice(&format!("{answer}; interrupt again to abort"));
                    }
                    Some(first) if first.elapsed() >= GRACE => signal_hook::low_level::exit(ABORTED),
                    Some(_) => {}
                }
            }
        };
        memory::start_thread(|starting| {
            thread::Builder::new().name("signals".to_string()).spawn(move || {
                drop(starting);
                listen();
            })
        })?;
        Ok(())
    };
    attempt().map_err(|e| Error::io("handle signals of", Path::new("this process"), e))
}

/// Returns true if this process was started with a signal ignored.
fn is_ignored(signal: i32) -> bool {
    let mut action = std::mem::MaybeUninit::<libc::sigaction>::zeroed();
    // SAFETY: without a new action the call only fills the one that it is given, for which all zeros are valid.
    let action = unsafe {
        libc::sigaction(signal, std::ptr::null(), action.as_mut_ptr());
        action.assume_init()
    };
    action.sa_sigaction == libc::SIG_IGN
}
