//! LIGGGHTS through a guarded C interface: its errors come back as values.
//!
//! The declarations are those of `shim/shim.h`, where their meaning stands. The shim catches every error and exception of
//! the library; a crash (a segmentation fault) it cannot catch. One instance belongs to one thread.
//!
//! LIGGGHTS is under the GNU General Public License, version 2 or later, and so is this crate, and any program that is
//! linked with it.

#![allow(non_camel_case_types)]
// Made by bindgen from the C header.
#![allow(clippy::pedantic, clippy::undocumented_unsafe_blocks, missing_docs)]

include!(concat!(env!("OUT_DIR"), "/declarations.rs"));
