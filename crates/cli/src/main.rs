//! The `turbid` program.

use std::alloc::System;
use std::process::ExitCode;
use turbid_cli::cli::Guarded;

#[global_allocator]
static ALLOCATOR: Guarded<System> = Guarded(System);

fn main() -> ExitCode {
    turbid_cli::cli::main()
}
