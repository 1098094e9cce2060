//! The `turbid` program.

use std::alloc::System;
use std::process::ExitCode;
use turbid::cli::Guarded;

#[global_allocator]
static ALLOCATOR: Guarded<System> = Guarded(System);

fn main() -> ExitCode {
    turbid::cli::main()
}
