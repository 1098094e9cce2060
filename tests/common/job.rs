//! MPI jobs of Turbid.
#![allow(dead_code, reason = "each test uses some of it")]

use std::path::Path;
use std::process::Command;

/// What lets a launcher start more processes than there are cores, as any user.
const ENVIRONMENT: [(&str, &str); 5] = [
    ("OMPI_ALLOW_RUN_AS_ROOT", "1"),
    ("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1"),
    ("OMPI_MCA_rmaps_base_oversubscribe", "1"),
    ("OMPI_MCA_mpi_yield_when_idle", "1"),
    ("OMPI_MCA_hwloc_base_binding_policy", "none"),
];

/// Turbid on so many processes, in a folder.
pub(crate) fn launcher(folder: &Path, processes: usize, arguments: &[&str]) -> Command {
    in_folder(Command::new("mpirun"), folder, processes, arguments)
}

/// The same, ended after so many seconds if it hangs.
pub(crate) fn limited(folder: &Path, seconds: u64, processes: usize, arguments: &[&str]) -> Command {
    let mut command = Command::new("timeout");
    command.args(["--kill-after=5", &seconds.to_string(), "mpirun"]);
    in_folder(command, folder, processes, arguments)
}

fn in_folder(mut command: Command, folder: &Path, processes: usize, arguments: &[&str]) -> Command {
    command
        .args(["-n", &processes.to_string(), env!("CARGO_BIN_EXE_turbid")])
        .args(arguments)
        .current_dir(folder)
        .envs(ENVIRONMENT);
    command
}
