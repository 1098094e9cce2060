//! `packaging/slurm.sh`, with stand-ins for the commands of Slurm.

use crate::common::{Place, in_tree};
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::process::{Command, Output};

/// A folder with an `srun` that notes its arguments and does `body`, and an `scontrol` that notes them.
struct Job(Place);

impl Job {
    fn new(body: &str) -> Self {
        let job = Self(Place::empty());
        job.0.write("my.toml", "# a case\n");
        job.command("srun", &format!("echo \"$@\" >>srun.log\n{body}"));
        job.command("scontrol", "echo \"$@\" >>scontrol.log");
        job
    }

    fn command(&self, name: &str, body: &str) {
        self.0.write(name, format!("#!/bin/bash\n{body}\n"));
        fs::set_permissions(self.0.path(name), fs::Permissions::from_mode(0o755)).unwrap();
    }

    /// Starts the job for the `restarts`th time after the first, an hour before its limit.
    fn start(&self, restarts: u32) -> Output {
        let end = std::time::SystemTime::UNIX_EPOCH.elapsed().unwrap().as_secs() + 3600;
        let path = format!("{}:{}", self.0.folder().display(), std::env::var("PATH").unwrap());
        Command::new("bash")
            .arg(in_tree("packaging/slurm.sh").canonicalize().unwrap())
            .args(["my.toml", "results"])
            .current_dir(self.0.folder())
            .env_remove("TURBID")
            .envs([
                ("PATH", path),
                ("SLURM_JOB_ID", "7".into()),
                ("SLURM_RESTART_COUNT", restarts.to_string()),
            ])
            .envs([("SLURM_JOB_END_TIME", end.to_string()), ("SLURM_CPUS_PER_TASK", "3".into())])
            .output()
            .unwrap()
    }

    fn log(&self, name: &str) -> String {
        fs::read_to_string(self.0.path(format!("{name}.log"))).unwrap_or_default()
    }
}

#[test]
fn a_job_that_stops_with_a_checkpoint_is_queued_again_and_then_resumes_until_its_run_is_complete() {
    let job = Job::new("mkdir -p results/checkpoints/step-0000000100\nexit 4");
    let first = job.start(0);
    assert_eq!(first.status.code(), Some(0), "{first:?}");
    assert_eq!(job.log("scontrol"), "requeue 7\n");
    let said = job.log("srun");
    assert!(said.starts_with("turbid run my.toml --out results --threads 3 --max-walltime "), "{said}");
    let walltime: u64 =
        said.split("--max-walltime ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    assert!((1..=3300).contains(&walltime), "{walltime} s of 3600");

    job.command("srun", "echo \"$@\" >>srun.log");
    assert_eq!(job.start(1).status.code(), Some(0));
    assert!(job.log("srun").contains("\nturbid resume results --threads 3 "), "{}", job.log("srun"));
    assert_eq!(job.log("scontrol"), "requeue 7\n");
}

#[test]
fn a_job_that_fails_keeps_its_exit_code_and_is_not_queued_again() {
    let failed = Job::new("exit 3");
    assert_eq!(failed.start(0).status.code(), Some(3));
    // It would stop at the same place for ever.
    let hopeless = Job::new("exit 4");
    let output = hopeless.start(0);
    assert_eq!(output.status.code(), Some(4));
    assert!(String::from_utf8_lossy(&output.stderr).contains("before the first checkpoint"));
    assert_eq!(failed.log("scontrol") + &hopeless.log("scontrol"), "");
}

#[test]
fn results_are_replaced_only_by_the_job_that_made_them() {
    let job = Job::new("touch results/series.csv");
    job.start(0);
    job.start(1);
    job.0.write("my.toml", "# another case\n");
    job.start(2);
    let of_others = Job::new("exit 2");
    fs::create_dir(of_others.0.path("results")).unwrap();
    of_others.0.write("results/series.csv", "");
    of_others.start(0);
    of_others.start(1);
    let calls = job.log("srun") + &of_others.log("srun");
    let calls: Vec<bool> = calls.lines().map(|call| call.contains("--overwrite")).collect();
    assert_eq!(calls, [false, true, false, false, false]);
}

#[test]
fn only_the_case_that_was_started_is_resumed() {
    let job = Job::new("mkdir -p results/checkpoints/step-1");
    job.start(0);
    job.0.write("my.toml", "# an edited case\n");
    let edited = job.start(0);
    assert_eq!(edited.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&edited.stderr).contains("not of this script with the present my.toml"));
    assert_eq!(job.log("srun").lines().count(), 1);
    job.0.write("my.toml", "# a case\n");
    job.start(0);
    assert!(job.log("srun").contains("\nturbid resume results "), "{}", job.log("srun"));
}

#[test]
fn the_signal_before_the_time_limit_reaches_the_program() {
    let waits = "trap 'mkdir -p results/checkpoints/step-1; kill $!; exit 4' TERM\nsleep 60 &\nkill -TERM $PPID\nwait";
    let job = Job::new(waits);
    assert_eq!(job.start(0).status.code(), Some(0));
    assert_eq!(job.log("scontrol"), "requeue 7\n");
}
