//! Settings of a run of the suite.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::{Duration, Instant};
use turbid::case::{self, Setup};
use turbid::error::{Error, Result};

/// Settings of all cases of a suite.
#[derive(Clone, Debug, Default)]
pub struct SuiteContext {
    /// Changes `KEY=VALUE` to all cases with a fluid, after those that the suite makes itself.
    pub changes: Vec<String>,
    /// Cores to use.
    pub threads: usize,
    /// Directory for runs of the full level, so that they can be resumed and need not be repeated.
    pub kept: Option<PathBuf>,
    /// Number of complete runs that were read from there.
    pub read: Arc<AtomicUsize>,
    /// Set to stop all runs.
    pub stop: Arc<AtomicBool>,
    /// Time at which all must have stopped.
    pub deadline: Option<Instant>,
    /// Deliberate fault in the physics.
    #[cfg(test)]
    pub(super) fault: Option<super::tests::Fault>,
}

impl SuiteContext {
    /// Settings with these changes and number of cores; 0 takes all.
    pub fn new(changes: Vec<String>, threads: usize) -> Self {
        let all = || std::thread::available_parallelism().map_or(1, usize::from);
        Self { changes, threads: if threads == 0 { all() } else { threads }, ..Self::default() }
    }

    /// Returns true if work that needs this much time must stop now.
    pub(super) fn is_over(&self, needs: Duration) -> bool {
        let late = self.deadline.is_some_and(|deadline| Instant::now() + needs >= deadline);
        late || self.stop.load(Ordering::Relaxed)
    }

    /// A case text with the changes that its module makes.
    pub(super) fn setup(&self, text: &str, name: &str, own: &[String]) -> Result<Setup> {
        let wet = text.lines().any(|line| line.trim() == "[fluid]");
        let given = if wet { self.changes.as_slice() } else { &[] };
        #[cfg_attr(not(test), allow(unused_mut))]
        let mut setup = case::from_text(text, name, &[own, given].concat())?;
        #[cfg(test)]
        if let Some(fault) = self.fault {
            fault.spoil(&mut setup);
        }
        Ok(setup)
    }
}

/// Error of a case that has not become steady.
pub(super) fn unsteady(what: &str, value: f64) -> Error {
    Error::Input(format!("not steady at the end of the case: {what} {value}"))
}
