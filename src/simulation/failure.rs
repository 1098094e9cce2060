//! A failure of one rank, as it travels to the others.

use crate::error::Error;
use serde::{Deserialize, Serialize};

/// What ends a run on every rank; the engine is the same on all of them, so its name does not travel.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) enum Failure {
    /// [`Error::Diverged`].
    Diverged { step: u64, what: String },
    /// [`Error::Engine`].
    Engine { step: u64, what: String },
}

impl Failure {
    /// A failure that all ranks learn of at `step`; that of an engine keeps the step at which it was noticed.
    pub(super) fn new(error: Error, step: u64) -> Self {
        match error {
            Error::Engine { step, what, .. } => Self::Engine { step, what },
            Error::Diverged { what, .. } => Self::Diverged { step, what },
            other => Self::Diverged {
                step,
                what: other.to_string(),
            },
        }
    }

    /// For a message.
    pub(super) fn to_bytes(&self) -> Vec<u8> {
        serde_json::to_vec(self).expect("plain JSON")
    }

    /// The first failure of all ranks, in their order; ranks without one sent nothing.
    pub(super) fn first(all: &[Vec<u8>]) -> Option<Self> {
        let first = all.iter().find(|bytes| !bytes.is_empty())?;
        Some(serde_json::from_slice(first).expect("made by to_bytes"))
    }

    /// The error of every rank; `engine` is the name of theirs.
    pub(super) fn into_error(self, engine: &'static str) -> Error {
        match self {
            Self::Diverged { step, what } => Error::Diverged { step, what },
            Self::Engine { step, what } => Error::Engine { engine, step, what },
        }
    }
}
