//! The `turbid` program.

use std::process::ExitCode;

fn main() -> ExitCode {
    turbid::cli::main()
}
