//! The engines that this program was built with.

use crate::dem::EngineChoice;
use crate::error::{Error, Result};
#[cfg(feature = "liggghts")]
pub use turbid_liggghts as liggghts;

/// True if this program was built with the cargo feature `liggghts`.
pub const HAS_LIGGGHTS: bool = cfg!(feature = "liggghts");

/// Debian's packages that the cargo feature `liggghts` needs.
pub const LIGGGHTS_PACKAGES: &str = "liggghts libliggghts-dev libopenmpi-dev libclang-dev g++";

/// Refuses an engine that this program was built without.
///
/// # Errors
/// That of [`liggghts_is_missing`].
pub fn refuse_if_missing(engine: &EngineChoice) -> Result<()> {
    match engine {
        EngineChoice::Liggghts(_) if !HAS_LIGGGHTS => Err(liggghts_is_missing("`dem.engine = \"liggghts\"`")),
        _ => Ok(()),
    }
}

/// The [`Error::Input`] for what needs LIGGGHTS in a program built without it: how to get one with it.
pub fn liggghts_is_missing(what: &str) -> Error {
    Error::Input(format!(
        "{what} needs LIGGGHTS, which this turbid was built without\n  \
         on Debian: apt-get install {LIGGGHTS_PACKAGES}\n  \
         then build with the cargo feature: cargo build --release --features liggghts\n  \
         or let ./run.sh do both: TURBID_FEATURES=liggghts ./run.sh ..."
    ))
}
