//! Common parts of the tests: the program, cases, folders to run them in, and readers of what a run leaves.
#![allow(dead_code, unused_imports, reason = "each test program uses some of it")]

mod browser;
pub(crate) mod case;
pub(crate) mod child;
#[cfg(feature = "mpi")]
pub(crate) mod job;
mod left;
mod place;
pub(crate) mod vtk;

pub(crate) use browser::Browser;
pub(crate) use left::{column, column_of, files_below};
pub(crate) use place::{Place, has, well, words};

/// The program under test.
pub(crate) const PROGRAM: &str = env!("CARGO_BIN_EXE_turbid");

/// A file or folder of this repository.
pub(crate) fn in_tree(path: &str) -> std::path::PathBuf {
    std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(path)
}

/// True if LAMMPS is installed, which it must be if `TURBID_NEEDS_LAMMPS` is set, as `test.sh` does.
pub(crate) fn has_lammps() -> bool {
    let found = turbid::engine::lammps::load();
    assert!(found.is_ok() || std::env::var_os("TURBID_NEEDS_LAMMPS").is_none(), "{found:?}");
    found.is_ok()
}

/// Pseudo-random numbers from 0 to 1, the same ones in every run.
pub(crate) fn random() -> impl FnMut() -> f64 {
    let mut state = 1_u64;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / f64::from(1_u32 << 31)
    }
}
