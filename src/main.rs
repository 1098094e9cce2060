//! The `turbid` program.
fn main() {}
