//! MPI jobs of Turbid.

use super::{PROGRAM, Place};
use std::process::Command;

/// Settings that let a launcher start more processes than there are cores, as any user.
const ENVIRONMENT: [(&str, &str); 6] = [
    ("OMPI_ALLOW_RUN_AS_ROOT", "1"),
    ("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1"),
    ("OMPI_MCA_rmaps_base_oversubscribe", "1"),
    ("OMPI_MCA_mpi_yield_when_idle", "1"),
    ("OMPI_MCA_hwloc_base_binding_policy", "none"),
    // The launcher looks for devices, and PoCL catches signals (docs/gpu.md).
    ("HWLOC_COMPONENTS", "-opencl"),
];

impl Place {
    /// The program on `processes` processes.
    pub(crate) fn job(&self, processes: usize, arguments: &[&str]) -> Command {
        self.launched(Command::new("mpirun"), processes, arguments)
    }

    /// The same, ended if it hangs.
    pub(crate) fn limited_job(&self, processes: usize, arguments: &[&str]) -> Command {
        let mut command = Command::new("timeout");
        command.args(["--kill-after=5", "300", "mpirun"]);
        self.launched(command, processes, arguments)
    }

    fn launched(&self, mut launcher: Command, processes: usize, arguments: &[&str]) -> Command {
        launcher
            .args(["-n", &processes.to_string(), PROGRAM])
            .args(arguments)
            .current_dir(self.folder())
            .envs(ENVIRONMENT);
        launcher
    }
}
