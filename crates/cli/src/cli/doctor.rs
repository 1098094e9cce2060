//! `turbid doctor`: what this machine offers, what is fine, what to change.

use super::machine;
use super::terminal::{Row, row, table};
use std::path::{Path, PathBuf};
use turbid::device::{Device, HAS_DRIVERS, devices};
use turbid::engine::{HAS_LIGGGHTS, LIGGGHTS_PACKAGES, lammps};
use turbid::fluid::{Precision, Simd};

/// Debian's packages that the cargo feature `mpi` needs.
const MPI_PACKAGES: &str = "openmpi-bin libopenmpi-dev libclang-dev";

/// The report.
pub(super) fn report() -> String {
    let yes_or_no = |is: bool| if is { "yes" } else { "no" };
    let build = if cfg!(debug_assertions) {
        "built for debugging, many times slower: build with `cargo build --release`"
    } else {
        "built for speed: fine"
    };
    let threads = "one per core is the default; --threads changes it, results stay the same";
    let (simd, pages) = (Simd::best(), machine::huge_pages());
    let pages = pages.as_deref();
    let memory = machine::memory().zip(machine::memory_available()).map(|(all, free)| {
        let cells = free / turbid::simulation::bytes_per_cell(Precision::F32);
        let (millions, edge, free) = (cells / 1e6, cells.cbrt(), machine::in_bytes(free));
        let remark = format!("{free} free: about {millions:.0} million cells in f32, a cube of {edge:.0}");
        (machine::in_bytes(all), remark)
    });
    let (memory, free) = memory.unwrap_or_else(|| ("unknown".into(), "no /proc/meminfo here".into()));
    let has_mpi = cfg!(feature = "mpi");
    let mut rows = vec![
        row("version", env!("CARGO_PKG_VERSION"), build),
        row("threads", machine::cores().to_string(), threads),
        row("instructions", simd.name(), simd_remark(simd)),
        row("huge pages", pages.unwrap_or("unknown"), huge_pages_remark(pages)),
        row("memory", memory, free),
        row("LIGGGHTS", yes_or_no(HAS_LIGGGHTS), liggghts_remark(HAS_LIGGGHTS)),
        row("LAMMPS", yes_or_no(lammps::load().is_ok()), lammps_remark(lammps::load().is_ok())),
        row("MPI", yes_or_no(has_mpi), mpi_remark(has_mpi, launcher().as_deref())),
    ];
    add_devices(&mut rows);
    table(&rows)
}

/// Devices that `--device` takes, with what they reach.
fn add_devices(rows: &mut Vec<Row>) {
    if !HAS_DRIVERS {
        let remark = "for GPUs: cargo build --release with the feature gpu, which is on by default";
        return rows.push(row("devices", "no", remark));
    }
    let found = devices();
    if found.is_empty() {
        rows.push(row(
            "devices",
            "none",
            "--device gpu needs the driver of a graphics card with OpenCL; the processor needs none",
        ));
    }
    for (number, info) in found.iter().enumerate() {
        let remark = match &info.refused {
            Some(why) => format!("cannot be used: {why}"),
            None => match Device::open(number).and_then(|device| device.measure()) {
                Ok([bandwidth, rate]) => format!(
                    "{}, {:.1} GB/s, {:.0} GFLOP/s in double precision{}; {}",
                    machine::in_bytes(info.memory as f64),
                    bandwidth / 1e9,
                    rate / 1e9,
                    if info.is_processor {
                        ", slower than --device cpu, which is this processor too"
                    } else {
                        ""
                    },
                    info.driver
                ),
                Err(error) => error.to_string(),
            },
        };
        rows.push(row(format!("gpu:{number}"), info.name.clone(), remark));
    }
}

fn simd_remark(simd: Simd) -> &'static str {
    match simd {
        Simd::Avx2 | Simd::Avx512 => "the fastest there is here: fine",
        _ => "no AVX2 on this processor; results are the same, only slower",
    }
}

fn huge_pages_remark(setting: Option<&str>) -> &'static str {
    match setting {
        Some("always" | "madvise") => "fine",
        Some(_) => {
            "off, which costs speed; to change: echo madvise | sudo tee /sys/kernel/mm/transparent_hugepage/enabled"
        }
        None => "this system does not say",
    }
}

/// About the engine `dem.engine = "liggghts"`.
fn liggghts_remark(has: bool) -> String {
    if has {
        "`dem.engine = \"liggghts\"` works, and so does `turbid crosscheck`; this program falls under the GPL"
            .to_string()
    } else {
        format!(
            "the native engine needs none; for it: apt-get install {LIGGGHTS_PACKAGES}, then \
             cargo build --release --features liggghts"
        )
    }
}

/// About the engine `dem.engine = "lammps"`.
fn lammps_remark(has: bool) -> String {
    if has {
        "`dem.engine = \"lammps\"` works: its library is loaded while the program runs".to_string()
    } else {
        format!("the native engine needs none; for it: apt-get install {}", lammps::PACKAGE)
    }
}

/// The first program on the path that starts MPI jobs.
fn launcher() -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    let mut programs =
        std::env::split_paths(&path).flat_map(|folder| ["mpirun", "mpiexec"].map(|name| folder.join(name)));
    programs.find(|program| program.is_file())
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
        assert!(lammps_remark(false).contains("apt-get install liblammps0"));
        for found in [None, Some(Path::new("/usr/bin/mpirun"))] {
            assert!(mpi_remark(false, found).contains("--features mpi"));
        }
        assert!(mpi_remark(true, None).contains("apt-get install openmpi-bin"));
    }
}
