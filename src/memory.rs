//! Memory: allocations that may fail, and how much of it there is ([`rooms`]).

mod room;

pub use room::{Room, kilobytes, rooms};
pub use turbid_core::memory::*;
