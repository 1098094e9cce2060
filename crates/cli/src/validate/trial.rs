//! What all cases of a suite are run with.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::{Duration, Instant};
use turbid::case::{self, Setup};
use turbid::domain::Decomposition;
use turbid::error::{Error, Result};

/// What all cases of a suite are run with.
#[derive(Clone, Debug, Default)]
pub struct Trial {
    /// Changes `KEY=VALUE` to all cases with a fluid, after those that the suite makes itself.
    pub changes: Vec<String>,
    /// Cores to use.
    pub threads: usize,
    /// Where runs of the full level are kept, so that they can be gone on with and need not be repeated.
    pub kept: Option<PathBuf>,
    /// How many runs were there already and were read.
    pub read: Arc<AtomicUsize>,
    /// Set when all is to end.
    pub stop: Arc<AtomicBool>,
    /// When all is to have ended.
    pub deadline: Option<Instant>,
    /// What is wrong with the physics on purpose.
    #[cfg(test)]
    pub(super) fault: Option<super::tests::Fault>,
}

impl Trial {
    /// With the texts as they are, on so many cores; 0 takes all.
    pub fn new(changes: Vec<String>, threads: usize) -> Self {
        let all = || std::thread::available_parallelism().map_or(1, usize::from);
        Self {
            changes,
            threads: if threads == 0 { all() } else { threads },
            kept: None,
            read: Arc::default(),
            stop: Arc::default(),
            deadline: None,
            #[cfg(test)]
            fault: None,
        }
    }

    /// Whether it is time to end for somebody who needs so long to do so.
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

/// The only block of a case that runs on one core.
pub(super) fn whole(setup: &Setup) -> Decomposition {
    Decomposition::solo(setup.domain)
}

/// What a case says that did not come to its end in time.
pub(super) fn unsteady(what: &str, value: f64) -> Error {
    Error::Input(format!("not steady at the end of the case: {what} {value}"))
}
