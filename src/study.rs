//! Parameter studies: many runs of one case, and what they say together.

pub mod document;
