//! Progress of a run, for whoever shows it.

use crate::case::Setup;
use std::fmt;

/// Follows a [run](super::run()), on rank 0: a bar on the terminal, a window. Every method does nothing unless it is overridden.
pub trait Progress: Send + Sync {
    /// The run begins after `first` steps: 0, or those of its checkpoint.
    fn start(&self, _setup: &Setup, _first: u64) {}

    /// `step` steps are done. Called after every step.
    fn step(&self, _step: u64) {}

    /// A warning to the user.
    fn warn(&self, _text: &str) {}

    /// The run has ended after `step` steps, with all its files written. A run that fails does not come here.
    fn finish(&self, _step: u64) {}
}

impl fmt::Debug for dyn Progress {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("Progress")
    }
}
