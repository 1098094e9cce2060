//! `turbid doctor`: what this machine offers, what is fine, what to change.

use super::machine;
use super::terminal::table;
use std::path::{Path, PathBuf};
use turbid::engine::{HAS_LIGGGHTS, LIGGGHTS_PACKAGES};
use turbid::fluid::{Precision, Simd};

/// Debian's packages that the cargo feature `mpi` needs.
const MPI_PACKAGES: &str = "openmpi-bin libopenmpi-dev libclang-dev";

/// The report.
pub(super) fn report() -> String {
    let row = |name: &str, value: String, remark: String| [name.to_string(), value, remark];
    let mut rows = vec![
        row("version", env!("CARGO_PKG_VERSION").to_string(), build()),
        row("threads", machine::cores().to_string(), threads_remark()),
        row("instructions", Simd::best().name().to_string(), simd_remark(Simd::best())),
    ];
    let pages = machine::huge_pages();
    rows.push(row(
        "huge pages",
        pages.clone().unwrap_or_else(|| "unknown".to_string()),
        huge_pages_remark(pages.as_deref()),
    ));
    rows.push(match (machine::memory(), machine::memory_available()) {
        (Some(all), Some(free)) => {
            let cells = free / turbid::simulation::bytes_per_cell(Precision::F32);
            let remark = format!(
                "{} free: about {:.0} million cells in f32, a cube of {:.0}",
                machine::in_bytes(free),
                cells / 1e6,
                cells.cbrt()
            );
            row("memory", machine::in_bytes(all), remark)
        }
        _ => row("memory", "unknown".to_string(), "no /proc/meminfo here".to_string()),
    });
    let liggghts = if HAS_LIGGGHTS { "yes" } else { "no" };
    rows.push(row("LIGGGHTS", liggghts.to_string(), liggghts_remark(HAS_LIGGGHTS)));
    let has_mpi = if cfg!(feature = "mpi") { "yes" } else { "no" };
    rows.push(row("MPI", has_mpi.to_string(), mpi_remark(cfg!(feature = "mpi"), launcher().as_deref())));
    table(&rows)
}

fn build() -> String {
    if cfg!(debug_assertions) {
        "built for debugging, many times slower: build with `cargo build --release`".to_string()
    } else {
        "built for speed: fine".to_string()
    }
}

fn threads_remark() -> String {
    "one per core is the default; --threads changes it, results stay the same".to_string()
}

fn simd_remark(simd: Simd) -> String {
    match simd {
        Simd::Avx2 | Simd::Avx512 => "the fastest there is here: fine".to_string(),
        _ => "no AVX2 on this processor; results are the same, only slower".to_string(),
    }
}

fn huge_pages_remark(setting: Option<&str>) -> String {
    match setting {
        Some("always" | "madvise") => "fine".to_string(),
        Some(_) => "off, which costs speed; to change: echo madvise | sudo tee \
                    /sys/kernel/mm/transparent_hugepage/enabled"
            .to_string(),
        None => "this system does not say".to_string(),
    }
}

/// About the engine `dem.engine = "liggghts"` and the verb `crosscheck`.
fn liggghts_remark(has: bool) -> String {
    if has {
        "`dem.engine = \"liggghts\"` and `turbid crosscheck` work; this program falls under the GPL"
            .to_string()
    } else {
        format!(
            "the native engine needs none; for it: apt-get install {LIGGGHTS_PACKAGES}, then \
             cargo build --release --features liggghts"
        )
    }
}

/// The first program on the path that starts MPI jobs.
fn launcher() -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    let mut places =
        std::env::split_paths(&path).flat_map(|place| ["mpirun", "mpiexec"].map(|name| place.join(name)));
    places.find(|program| program.is_file())
}

/// About ranks that are processes.
fn mpi_remark(has: bool, launcher: Option<&Path>) -> String {
    match (has, launcher) {
        (true, Some(launcher)) => format!("`{} -n 4 turbid run ...` runs on 4 processes", launcher.display()),
        (true, None) => {
            "built in, but there is neither mpirun nor mpiexec: apt-get install openmpi-bin".to_string()
        }
        (false, found) => format!(
            "threads need none; for several machines: apt-get install {MPI_PACKAGES}, then cargo build --release --features \
             mpi{}",
            found.map_or_else(String::new, |found| format!("; {} is there", found.display()))
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_setting_that_costs_speed_comes_with_the_command_that_changes_it() {
        assert!(huge_pages_remark(Some("never")).contains("echo madvise"));
        assert_eq!(huge_pages_remark(Some("madvise")), "fine");
        assert!(simd_remark(Simd::Sse2).contains("slower"));
        assert!(liggghts_remark(false).contains("--features liggghts"));
        for found in [None, Some(Path::new("/usr/bin/mpirun"))] {
            assert!(mpi_remark(false, found).contains("--features mpi"));
        }
        assert!(mpi_remark(true, None).contains("apt-get install openmpi-bin"));
    }
}
