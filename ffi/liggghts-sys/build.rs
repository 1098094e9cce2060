//! Compiles the C++ shim, makes Rust declarations of its C header, and links LIGGGHTS.
//!
//! `LIGGGHTS_INCLUDE` names the directory of LIGGGHTS's headers (default `/usr/include/liggghts`), `MPICC` the compiler
//! wrapper of MPI (default `mpicc`).

use std::env;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

/// Debian packages that hold everything that is probed for.
const PACKAGES: &str = "liggghts libliggghts-dev libopenmpi-dev libclang-dev g++";

fn main() -> ExitCode {
    for variable in ["LIGGGHTS_INCLUDE", "MPICC", "PATH"] {
        println!("cargo::rerun-if-env-changed={variable}");
    }
    for file in ["shim/shim.cpp", "shim/shim.h"] {
        println!("cargo::rerun-if-changed={file}");
    }
    match build() {
        Ok(()) => ExitCode::SUCCESS,
        Err(missing) => {
            println!("cargo::error=the feature `liggghts` is on, but not everything that it needs is here:");
            for reason in missing {
                println!("cargo::error=  {reason}");
            }
            println!("cargo::error=Debian: apt-get install {PACKAGES}");
            println!(
                "cargo::error=or build without `--features liggghts`: the native engine needs nothing of this"
            );
            ExitCode::FAILURE
        }
    }
}

/// Probes, compiles, declares and links; all reasons at once if something is missing.
fn build() -> Result<(), Vec<String>> {
    let mut missing = Vec::new();
    let headers = PathBuf::from(env::var("LIGGGHTS_INCLUDE").unwrap_or("/usr/include/liggghts".to_owned()));
    if !headers.join("library.h").exists() || !headers.join("update.h").exists() {
        let headers = headers.display();
        missing.push(format!(
            "no LIGGGHTS headers in {headers} (package libliggghts-dev, or set LIGGGHTS_INCLUDE)"
        ));
    }
    let mpi = mpi_directories().unwrap_or_else(|reason| {
        missing.push(reason);
        Vec::new()
    });
    if !mpi.iter().any(|directory| directory.join("mpi.h").exists()) && missing.is_empty() {
        missing.push("mpi.h is not there (package libopenmpi-dev)".to_owned());
    }
    missing.extend(declare().err());
    if !missing.is_empty() {
        return Err(missing);
    }
    let mut shim = cc::Build::new();
    shim.cpp(true).std("c++11").warnings(false).includes([Path::new("shim"), &headers]).includes(&mpi);
    shim.file("shim/shim.cpp")
        .try_compile("liggghts_shim")
        .map_err(|error| vec![format!("the C++ shim does not compile (package g++?): {error}")])?;
    println!("cargo::rustc-link-lib=dylib=liggghts");
    println!("cargo::rustc-link-lib=dylib=mpi");
    Ok(())
}

/// Directories with MPI's headers, from the compiler wrapper of Open MPI or MPICH.
fn mpi_directories() -> Result<Vec<PathBuf>, String> {
    let wrapper = env::var("MPICC").unwrap_or("mpicc".to_owned());
    let ask = |flag: &str| {
        let output = Command::new(&wrapper).arg(flag).output().ok().filter(|o| o.status.success())?;
        String::from_utf8(output.stdout).ok()
    };
    let (text, prefix) = match (ask("--showme:incdirs"), ask("-show")) {
        (Some(text), _) => (text, ""),
        (None, Some(text)) => (text, "-I"),
        _ => {
            return Err(format!(
                "the compiler wrapper `{wrapper}` does not run (package libopenmpi-dev, or set MPICC)"
            ));
        }
    };
    Ok(text.split_whitespace().filter_map(|word| word.strip_prefix(prefix)).map(PathBuf::from).collect())
}

/// Rust declarations of the shim's C header.
fn declare() -> Result<(), String> {
    let target = Path::new(&env::var("OUT_DIR").expect("cargo sets it")).join("declarations.rs");
    // Without libclang bindgen panics; its reason is worth more than its backtrace.
    let made = std::panic::catch_unwind(|| {
        bindgen::Builder::default()
            .header("shim/shim.h")
            .allowlist_function("lgg_.*")
            .allowlist_type("lgg_.*")
            .derive_default(true)
            .generate()
    });
    match made {
        Ok(Ok(bindings)) => bindings.write_to_file(target).map_err(|e| e.to_string()),
        Ok(Err(error)) => Err(format!("bindgen cannot read shim/shim.h: {error}")),
        Err(_) => Err("bindgen cannot load libclang (package libclang-dev)".to_owned()),
    }
}
