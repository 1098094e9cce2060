//! Limits of the system, end to end: what a process may not have, it says, and ends with exit code 2 on every rank.

#[path = "common/child.rs"]
mod child;

use child::{Guard, poll};
use std::io::{self, Read};
use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus};
use std::sync::{Mutex, MutexGuard, PoisonError};

const CASE: &str = r"
[domain]
size = { diameters = [4, 4, 4] }

[fluid]
density = 1000.0
archimedes = 1000

[lattice]
cells_per_diameter = 8
relaxation_time = 0.55

[[particles]]
shape = { sphere = { diameter = 1.5e-3 } }
density = 3300.0
count = 5
seed = 1

[run]
end = { steps = 2 }
";

type Resource = libc::__rlimit_resource_t;

/// A user without any process: the limit on processes does not bind root.
const NOBODY: libc::uid_t = 61_234;

/// Held while the program is copied, and while one is started: a process between fork and exec would hold the copy open to be
/// written, and what is written cannot be run.
static STARTS: Mutex<()> = Mutex::new(());

fn turn() -> MutexGuard<'static, ()> {
    STARTS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A folder that every user may write to, with the case, and the program where every user may run it.
fn place() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    std::fs::set_permissions(folder.path(), PermissionsExt::from_mode(0o777)).unwrap();
    std::fs::write(folder.path().join("case.toml"), CASE).unwrap();
    let program = folder.path().join("turbid");
    let _turn = turn();
    std::fs::copy(env!("CARGO_BIN_EXE_turbid"), &program).unwrap();
    (folder, program)
}

/// How the program ends that has no more of a resource than this, and what it says.
fn ends(
    (folder, program): (&Path, &Path),
    (resource, most): (Resource, u64),
    user: Option<libc::uid_t>,
    arguments: &[&str],
) -> (ExitStatus, String) {
    let mut command = Command::new(program);
    command
        .args(arguments)
        .current_dir(folder)
        .env("RUST_BACKTRACE", "0");
    let limit = move || {
        let limit = libc::rlimit {
            rlim_cur: most,
            rlim_max: most,
        };
        // SAFETY: both calls take plain data and may be made between fork and exec.
        let done = user.is_none_or(|user| unsafe { libc::setuid(user) } == 0)
            && unsafe { libc::setrlimit(resource, &raw const limit) } == 0;
        if done {
            Ok(())
        } else {
            Err(io::Error::last_os_error())
        }
    };
    // SAFETY: the function makes system calls only.
    unsafe { command.pre_exec(limit) };
    let mut child = {
        let _turn = turn();
        Guard::of(command)
    };
    let status = poll("the end of a limited run", || child.0.try_wait().unwrap());
    let mut said = String::new();
    child.0.stderr.take().unwrap().read_to_string(&mut said).unwrap();
    (status, said)
}

fn is_root() -> bool {
    // SAFETY: the call takes nothing.
    unsafe { libc::geteuid() == 0 }
}

#[test]
fn a_run_whose_threads_cannot_all_be_had_ends_and_says_how_many_to_use() {
    let (folder, program) = place();
    // Others have as many processes already as are allowed.
    let (user, most) = if is_root() { (Some(NOBODY), 3) } else { (None, 1) };
    let run = ["run", "case.toml", "--out", "out", "--threads", "8"];
    let limit = (libc::RLIMIT_NPROC, most);
    let (status, said) = ends((folder.path(), program.as_path()), limit, user, &run);
    assert_eq!(status.code(), Some(2), "{status} {said}");
    for words in ["cannot start thread ", " of 8: ", "use --threads "] {
        assert!(said.contains(words), "`{words}` is not in\n{said}");
    }
}

#[test]
fn a_case_beyond_the_limit_of_the_address_space_is_refused_before_it_runs() {
    let (folder, program) = place();
    let place = (folder.path(), program.as_path());
    let limit = (libc::RLIMIT_AS, 1 << 30);
    let run = ["run", "case.toml", "--out", "out", "--set"];
    let large = [&run[..], &["domain.size={diameters=[40,40,40]}"]].concat();
    let (status, said) = ends(place, limit, None, &large);
    assert_eq!(status.code(), Some(2), "{status} {said}");
    for words in [
        "320 x 320 x 320 cells with 5 particles needs about 3.6 GB",
        "(ulimit -v)",
        "cells_per_diameter = ",
    ] {
        assert!(said.contains(words), "`{words}` is not in\n{said}");
    }
    assert!(!folder.path().join("out").exists());
    let dry = CASE
        .replace(
            "[fluid]\ndensity = 1000.0\narchimedes = 1000",
            "[dry]\ntime_step = 1e-6",
        )
        .replace("[lattice]\ncells_per_diameter = 8\nrelaxation_time = 0.55", "")
        .replace("size = { diameters = [4, 4, 4] }", "size = [1.0, 1.0, 1.0]")
        .replace("count = 5", "volume_fraction = 0.1");
    std::fs::write(folder.path().join("case.toml"), dry).unwrap();
    let (status, said) = ends(place, limit, None, &["check", "case.toml"]);
    assert_eq!(status.code(), Some(2), "{status} {said}");
    for words in ["`particles.0` asks for ", "too many for the memory"] {
        assert!(said.contains(words), "`{words}` is not in\n{said}");
    }
}

#[test]
fn no_limit_ends_a_run_with_a_signal_a_panic_or_a_hang() {
    let (folder, program) = place();
    let place = (folder.path(), program.as_path());
    // Below this the system cannot even load the program.
    let loads = |most: &u64| {
        let (status, _) = ends(place, (libc::RLIMIT_AS, *most), None, &["--version"]);
        status.success()
    };
    let least = (1..256).map(|n| n << 24).find(loads).expect("4 GiB are enough");
    let room = [0, 4, 16, 64, 256].map(|more| (libc::RLIMIT_AS, least + (more << 20)));
    let files = [8, 16, 64].map(|most| (libc::RLIMIT_NOFILE, most));
    let sizes = [0, 1000, 100_000].map(|most| (libc::RLIMIT_FSIZE, most));
    let processes = [1, 2, 64].map(|most| (libc::RLIMIT_NPROC, most));
    let limits = [&room[..], &files, &sizes, &processes].concat();
    for (n, limit) in limits.into_iter().enumerate() {
        let user = (is_root() && limit.0 == libc::RLIMIT_NPROC).then_some(NOBODY + 1);
        let out = format!("out{n}");
        let run = ["run", "case.toml", "--out", &out, "--threads", "2"];
        let (status, said) = ends(place, limit, user, &run);
        let code = status.code();
        assert!(matches!(code, Some(0 | 2 | 4)), "{limit:?}: {status}\n{said}");
        assert!(!said.contains("panicked"), "{limit:?}: {status}\n{said}");
        assert!(
            code == Some(0) || said.contains("error: "),
            "{limit:?}: {status}\n{said}"
        );
    }
}
