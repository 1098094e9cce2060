//! Another process of Turbid that a test watches, stops and outlives.
#![allow(dead_code, reason = "each test uses some of it")]

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Longest time to wait for another process: far beyond what is needed, so that only a hang reaches it.
pub(crate) const PATIENCE: Duration = Duration::from_secs(120);

/// Ends a child that a failed test would leave behind.
pub(crate) struct Guard(pub(crate) Child);

impl Drop for Guard {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Guard {
    /// Starts it; what it says is kept.
    pub(crate) fn of(mut command: Command) -> Self {
        let command = command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        Self(command.spawn().unwrap())
    }

    pub(crate) fn send(&self, signal: i32) {
        // SAFETY: `kill` takes two numbers; the process is our child and not yet waited for, so its id is still its own.
        let sent = unsafe { libc::kill(self.0.id() as libc::pid_t, signal) };
        assert_eq!(sent, 0);
    }

    /// Waits for the end.
    pub(crate) fn ends_with(&mut self, code: i32) {
        let status = poll("the end of the child", || self.0.try_wait().unwrap());
        assert_eq!(status.code(), Some(code), "{status}");
    }
}

/// Asks again and again until there is an answer; another process gives no other sign.
pub(crate) fn poll<T>(what: &str, mut ask: impl FnMut() -> Option<T>) -> T {
    let start = Instant::now();
    loop {
        if let Some(answer) = ask() {
            return answer;
        }
        assert!(start.elapsed() < PATIENCE, "waited in vain for {what}");
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// Lines of a series so far.
pub(crate) fn rows(series: &Path) -> usize {
    std::fs::read_to_string(series).map_or(0, |text| text.lines().count())
}
