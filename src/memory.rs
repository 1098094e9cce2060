//! Memory: allocations that may fail, and the limits of a process ([`rooms`]).

mod room;

pub use room::{Room, kilobytes, rooms};
pub use turbid_core::memory::*;
