//! Errors, in words that the user can act on.

use std::io;
use std::path::{Path, PathBuf};

/// Result of any fallible operation in this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// Reason of a failure, with the process exit code that it stands for ([`Error::exit_code`]).
///
/// ```
/// # use turbid_core as turbid;
/// use turbid::Error;
/// let error = Error::Diverged { step: 12, what: "fluid velocity 0.6".to_string() };
/// assert!(matches!(error, Error::Diverged { step: 12, .. }));
/// assert_eq!(error.to_string(), "diverged at step 12: fluid velocity 0.6");
/// assert_eq!(error.exit_code(), 3);
/// ```
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file or directory could not be read or written.
    #[error("cannot {action} {}: {source}", path.display())]
    Io {
        /// Attempted operation, e.g. `"write"`.
        action: &'static str,
        /// The file or directory.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// A case, or another document of keys, asks for something impossible.
    #[error("{text}")]
    Case {
        /// Path of the key, such as `"lattice.relaxation_time"` or `"particles.0.density"`: the first of those that
        /// do not fit together. Empty where no key stands for it.
        key: String,
        /// Problem in one line: key, value and what would be right.
        what: String,
        /// Suggested change; may be empty.
        remedy: String,
        /// The whole message with the position in the text, as it is printed.
        text: String,
    },
    /// A file is not of the kind that it should be.
    #[error("{text}")]
    Parse {
        /// The file, or the name of a text that is none.
        path: PathBuf,
        /// Line, from 1; 0 where no line stands for it.
        line: usize,
        /// Problem and position, as it is printed.
        text: String,
    },
    /// An impossible request that belongs to no key of a case; the text names value and remedy.
    #[error("{0}")]
    Input(String),
    /// There is not enough memory for a large array.
    #[error(
        "cannot allocate {amount} for {what}; take a smaller box or fewer cells per diameter, or raise the limit on the \
         memory of the process (ulimit -v, the control group, the request of the job)"
    )]
    Memory {
        /// Amount, in words.
        amount: String,
        /// Purpose, with an article.
        what: String,
    },
    /// The engine cannot represent the case.
    #[error("the {engine} engine does not support {what}")]
    Unsupported {
        /// Name of the DEM engine.
        engine: &'static str,
        /// Unsupported feature.
        what: String,
    },
    /// The simulation left the range in which the method holds.
    #[error("diverged at step {step}: {what}")]
    Diverged {
        /// Fluid step at which it was noticed.
        step: u64,
        /// Quantity, position, value and limit.
        what: String,
    },
    /// The engine that moves the particles failed: its library, its process, or a particle it lost.
    #[error("the {engine} engine failed at step {step}: {what}")]
    Engine {
        /// Name of the DEM engine.
        engine: &'static str,
        /// Fluid step at which it was noticed.
        step: u64,
        /// Message of the engine, or the end of its process.
        what: String,
    },
    /// The device that computes the fluid failed while the run was under way.
    #[error("the device failed at step {step}: {what}")]
    Device {
        /// Fluid step at which it was noticed.
        step: u64,
        /// Name of the device, and the message of its driver.
        what: String,
    },
    /// The compiler of a device refused the kernels.
    #[error(
        "the compiler of {device} refused the kernels: {}",
        log.lines().find(|line| line.contains("error")).unwrap_or("no message")
    )]
    Kernels {
        /// Name of the device.
        device: String,
        /// All that the compiler said.
        log: String,
    },
    /// Failure of one rank, with the text on which all ranks agreed.
    #[error("{text}")]
    Agreed {
        /// The exit code of that failure.
        code: i32,
        /// Its text.
        text: String,
    },
    /// Stopped by a signal or a time limit before its end; results so far are kept if the user requested it.
    #[error("stopped before its end")]
    Interrupted,
    /// Another rank failed first; its error is the one to show.
    #[error("another rank failed")]
    OtherRank,
}

impl Error {
    /// Wraps an I/O error with the attempted operation and the path.
    pub fn io(action: &'static str, path: &Path, source: io::Error) -> Self {
        Self::Io { action, path: path.to_path_buf(), source }
    }

    /// Exit code of the process: 2 for input and files, 3 for divergence and for a failed engine, 4 for a run that
    /// was stopped.
    pub fn exit_code(&self) -> i32 {
        match self {
            Self::Diverged { .. } | Self::Engine { .. } | Self::Device { .. } => 3,
            Self::Interrupted => 4,
            Self::Agreed { code, .. } => *code,
            _ => 2,
        }
    }
}
