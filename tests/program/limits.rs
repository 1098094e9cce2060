//! Limits of the system, end to end: what a process may not have, it says, and ends with exit code 2 on every rank.

use crate::common::case::{SPHERES, changed};
use crate::common::child::{Guard, poll};
use crate::common::{PROGRAM, Place, has};
use std::io::{self, Read};
use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::CommandExt;
use std::process::{Command, ExitStatus};

/// Five spheres, two steps.
fn case() -> String {
    changed(SPHERES, &[("volume_fraction = 0.1", "count = 5"), ("steps = 10", "steps = 2")])
}

type Resource = libc::__rlimit_resource_t;

/// A user without any process: the limit on processes does not bind root.
const NOBODY: libc::uid_t = 61_234;

/// A folder that every user may write to, with the case, and the program where every user may run it.
fn place() -> Place {
    let place = Place::new(&case());
    std::fs::set_permissions(place.folder(), PermissionsExt::from_mode(0o777)).unwrap();
    // Not by this process: what another test starts meanwhile would hold the copy open to be written, and such a file cannot be run.
    let copied = Command::new("cp").args([PROGRAM, "turbid"]).current_dir(place.folder()).status();
    assert!(copied.unwrap().success());
    place
}

/// The end of a program that has no more of a resource than this, and its message.
fn ends(
    place: &Place,
    (resource, most): (Resource, u64),
    user: Option<libc::uid_t>,
    arguments: &[&str],
) -> (ExitStatus, String) {
    let mut command = Command::new(place.path("turbid"));
    command.args(arguments).current_dir(place.folder()).env("RUST_BACKTRACE", "0");
    let limit = move || {
        let limit = libc::rlimit { rlim_cur: most, rlim_max: most };
        // SAFETY: both calls take plain data and may be made between fork and exec.
        let done = user.is_none_or(|user| unsafe { libc::setuid(user) } == 0)
            && unsafe { libc::setrlimit(resource, &raw const limit) } == 0;
        if done { Ok(()) } else { Err(io::Error::last_os_error()) }
    };
    // SAFETY: the function makes system calls only.
    unsafe { command.pre_exec(limit) };
    let mut child = Guard::of(command);
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
    let place = place();
    // Others have as many processes already as are allowed.
    let (user, most) = if is_root() { (Some(NOBODY), 3) } else { (None, 1) };
    let run = ["run", "case.toml", "--out", "out", "--threads", "8"];
    let limit = (libc::RLIMIT_NPROC, most);
    let (status, said) = ends(&place, limit, user, &run);
    assert_eq!(status.code(), Some(2), "{status} {said}");
    has(&said, &["cannot start thread ", " of 8: ", "use --threads "]);
}

#[test]
fn a_case_beyond_the_limit_of_the_address_space_is_refused_before_it_runs() {
    let place = place();
    let limit = (libc::RLIMIT_AS, 1 << 30);
    let run = ["run", "case.toml", "--out", "out", "--set"];
    let large = [&run[..], &["domain.size={diameters=[40,40,40]}"]].concat();
    let (status, said) = ends(&place, limit, None, &large);
    assert_eq!(status.code(), Some(2), "{status} {said}");
    has(
        &said,
        &[
            "320 x 320 x 320 cells with 5 particles needs about 3.6 GB",
            "(ulimit -v)",
            "cells_per_diameter = ",
        ],
    );
    assert!(!place.path("out").exists());
    let dry = changed(
        &case(),
        &[
            ("[fluid]\ndensity = 1000.0\narchimedes = 1000", "[dry]\ntime_step = 1e-6"),
            ("[lattice]\ncells_per_diameter = 8\nrelaxation_time = 0.55", ""),
            ("size = { diameters = [4, 4, 4] }", "size = [1.0, 1.0, 1.0]"),
            ("count = 5", "volume_fraction = 0.1"),
        ],
    );
    place.write("case.toml", dry);
    let (status, said) = ends(&place, limit, None, &["check", "case.toml"]);
    assert_eq!(status.code(), Some(2), "{status} {said}");
    has(&said, &["`particles.0` asks for ", "too many for the memory"]);
}

#[test]
fn no_limit_ends_a_run_with_a_signal_a_panic_or_a_hang() {
    let place = place();
    // Below this the system cannot even load the program.
    let loads = |most: &u64| {
        let (status, _) = ends(&place, (libc::RLIMIT_AS, *most), None, &["--version"]);
        status.success()
    };
    let least = (1..256).map(|n| n << 24).find(loads).expect("4 GiB are enough");
    let room = [0, 4, 16, 64, 256].map(|more| (libc::RLIMIT_AS, least + (more << 20)));
    // Pages with which the first thread cannot be started, and with which it can; there it may lack what it needs beside its stack.
    let mut pages = [least, least + (16 << 20)].map(|bytes| bytes >> 12);
    while pages[1] > pages[0] + 1 {
        let middle = u64::midpoint(pages[0], pages[1]);
        let (_, said) =
            ends(&place, (libc::RLIMIT_AS, middle << 12), None, &["run", "case.toml", "--overwrite"]);
        pages[usize::from(!said.contains("cannot handle signals"))] = middle;
    }
    let stacks: Vec<_> = (0..60).map(|n| (libc::RLIMIT_AS, (pages[1] + n % 12) << 12)).collect();
    let files = [8, 16, 64].map(|most| (libc::RLIMIT_NOFILE, most));
    let sizes = [0, 1000, 100_000].map(|most| (libc::RLIMIT_FSIZE, most));
    let processes = [1, 2, 64].map(|most| (libc::RLIMIT_NPROC, most));
    let limits = [&room[..], &stacks, &files, &sizes, &processes].concat();
    for (n, limit) in limits.into_iter().enumerate() {
        let user = (is_root() && limit.0 == libc::RLIMIT_NPROC).then_some(NOBODY + 1);
        let out = format!("out{n}");
        let run = ["run", "case.toml", "--out", &out, "--threads", "2"];
        let (status, said) = ends(&place, limit, user, &run);
        let code = status.code();
        assert!(matches!(code, Some(0 | 2 | 4)), "{limit:?}: {status}\n{said}");
        assert!(!said.contains("panicked"), "{limit:?}: {status}\n{said}");
        assert!(code == Some(0) || said.contains("error: "), "{limit:?}: {status}\n{said}");
    }
}
