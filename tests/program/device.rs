//! Runs on a device, end to end: the bits of the processor, on any ranks, before and after a checkpoint, and messages where it cannot be.
//!
//! Without a GPU the driver PoCL, which `test.sh` installs, runs the same kernels on the processor. Where there is no driver at all, only the
//! messages are tested, unless `TURBID_NEEDS_DEVICE` is set.

use super::same_bits::scenes;
use crate::common::{Place, case, has, well, words};
use serde_json::Value;
use std::process::Command;

/// Returns true if there is a device.
fn has_device() -> bool {
    let found = turbid::device::devices().iter().any(|device| device.refused.is_none());
    assert!(found || std::env::var_os("TURBID_NEEDS_DEVICE").is_none(), "no OpenCL device");
    found
}

/// The hash of the state at the end of a run.
fn hash(place: &Place, options: &[&str]) -> Value {
    place.well(&[&["run", "case.toml", "--overwrite", "--quiet"], options].concat());
    place.summary("out")["state_hash"].clone()
}

#[test]
fn scenes_have_the_bits_of_the_processor_on_one_two_and_four_ranks() {
    if !has_device() {
        return;
    }
    for (name, text) in scenes() {
        let place = Place::new(&text);
        for (precision, coupling, ranks) in [
            ("f32", "saturated", &["1", "2", "4"][..]),
            ("f64", "saturated", &["2"]),
            ("f16", "saturated", &["1"]),
            ("f32", "homogenised", &["2"]),
            ("f64", "homogenised", &["1"]),
        ] {
            let keys = [format!("fluid.precision={precision}"), format!("lattice.coupling={coupling}")];
            let options = ["--set", &keys[0], "--set", &keys[1], "--set", "run.end.steps=100", "--threads"];
            let expected = hash(&place, &[&options[..], &["2"]].concat());
            for ranks in ranks {
                // Two devices that are the same one are two, too.
                let device = if *ranks == "4" { "gpu:0,0" } else { "gpu" };
                let found = hash(&place, &[&options[..], &[ranks, "--device", device]].concat());
                assert_eq!(found, expected, "{name} {precision} {coupling} on {ranks} ranks");
            }
            let summary = place.summary("out");
            assert!(summary["device"].as_str().is_some_and(|name| !name.is_empty()), "{summary}");
        }
    }
}

#[test]
fn a_checkpoint_of_the_processor_continues_on_the_device_and_back_to_the_bit() {
    if !has_device() {
        return;
    }
    let place = Place::new(&case::crowd(
        60,
        "series_every = { steps = 4 }\nfields_every = { steps = 30 }\npicture_every = \"never\"",
    ));
    place.well(&["run", "case.toml", "--quiet", "--out", "whole", "--threads", "1"]);
    let (whole, series) = (place.summary("whole"), place.text("whole/series.csv"));
    for (first, second) in [("cpu", "gpu"), ("gpu", "cpu"), ("gpu", "gpu")] {
        let half = ["--set", "run.end.steps=30", "--set", "output.checkpoint_every.steps=1000"];
        place.well(
            &[
                &["run", "case.toml", "--overwrite", "--quiet", "--device", first, "--threads", "2"],
                &half[..],
            ]
            .concat(),
        );
        let rest = ["--set", "run.end.steps=60", "--set", "output.checkpoint_every=never"];
        place
            .well(&[&["resume", "out", "--quiet", "--device", second, "--threads", "1"], &rest[..]].concat());
        assert_eq!(place.summary("out")["state_hash"], whole["state_hash"], "{first}, then {second}");
        assert_eq!(place.text("out/series.csv"), series, "{first}, then {second}");
    }
}

#[test]
fn a_benchmark_on_a_device_times_the_case_with_and_without_particles() {
    if !has_device() {
        return;
    }
    let place = Place::new(&case::crowd(8, "picture_every = \"never\""));
    let output =
        place.well(&["bench", "case.toml", "--steps", "4", "--json", "--device", "gpu", "--threads", "2"]);
    let report: Value = serde_json::from_str(&output).unwrap();
    for stages in ["stages", "fluid_only_stages"] {
        assert!(report["by_rank"][0][stages]["fluid"].as_f64().is_some_and(|time| time > 0.0), "{report}");
    }
}

#[test]
fn without_a_driver_the_message_says_what_to_install() {
    let place = Place::new(case::SPHERES);
    let mut run = place.limited(&["run", "case.toml", "--device", "gpu"]);
    // Where the loader looks for drivers: there are none.
    let output = run
        .env("OCL_ICD_VENDORS", place.folder())
        .env("OPENCL_VENDOR_PATH", place.folder())
        .output()
        .unwrap();
    let said = words(&output);
    if turbid::device::devices().iter().all(|device| device.is_processor) {
        assert_eq!(output.status.code(), Some(2), "{said}");
        has(&said, &["`run.device` is gpu", "no OpenCL driver", "pocl-opencl-icd", "--device cpu"]);
    }
}

#[test]
fn what_no_device_does_is_refused_with_the_place_in_the_case() {
    let place = Place::new(case::SPHERES);
    let refused =
        |options: &[&str], words: &[&str]| place.refused(&[&["run", "case.toml"], options].concat(), words);
    refused(&["--device", "gpu:x"], &["`run.device` is gpu:x", "gpu:1"]);
    refused(&["--device", "gpu:0,"], &["`run.device` is gpu:0,", "gpu:0,1"]);
    refused(&["--device", "gpu:99"], &["`run.device` is gpu:99"]);
}

#[test]
fn a_fluid_too_large_for_a_device_is_refused_with_what_it_needs() {
    if !has_device() {
        return;
    }
    let place = Place::new(&case::changed(
        case::SPHERES,
        &[("[4, 4, 4]", "[20, 20, 20]"), ("volume_fraction = 0.1", "count = 5")],
    ));
    let arguments = ["run", "case.toml", "--device", "gpu", "--threads", "1", "--set", "fluid.precision=f64"];
    // Of PoCL, in GB; other drivers do not know it.
    let output = place
        .limited(&arguments)
        .env("POCL_MEMORY_LIMIT", "1")
        .args(["--set", "run.end.steps=1"])
        .output()
        .unwrap();
    let said = words(&output);
    if turbid::device::devices().iter().all(|device| device.is_processor) {
        assert_eq!(output.status.code(), Some(2), "{said}");
        has(&said, &["has not the memory for the populations", "MB", "smaller box"]);
    }
}

/// The driver of OpenCL, which refuses to launch kernels after as many as the environment says, as if the device were gone.
const LOST: &str = r#"
#include <dlfcn.h>
#include <stdlib.h>
typedef int enqueue(void*, void*, unsigned, const size_t*, const size_t*, const size_t*, unsigned, const void*, void*);
int clEnqueueNDRangeKernel(void* queue, void* kernel, unsigned dimensions, const size_t* offset, const size_t* global,
                           const size_t* local, unsigned count, const void* events, void* event) {
    static int launches = 0;
    static enqueue* next = 0;
    if (!next) next = (enqueue*)dlsym(dlopen("libOpenCL.so.1", RTLD_NOW), "clEnqueueNDRangeKernel");
    if (launches >= atoi(getenv("LAUNCHES"))) return -2;
    launches++;
    return next(queue, kernel, dimensions, offset, global, local, count, events, event);
}
"#;

#[test]
fn a_run_whose_device_is_lost_ends_with_a_sound_checkpoint() {
    if !has_device() {
        return;
    }
    let place = Place::new(&case::crowd(60, "series_every = { steps = 4 }\npicture_every = \"never\""));
    place.well(&["run", "case.toml", "--quiet", "--out", "whole", "--threads", "1"]);
    place.write("lost.c", LOST);
    let compiler = std::env::var("CC").unwrap_or_else(|_| "cc".to_owned());
    well(Command::new(compiler).current_dir(place.folder()).args([
        "-shared",
        "-fPIC",
        "-o",
        "lost.so",
        "lost.c",
        "-Wl,--no-as-needed",
        "-l:libOpenCL.so.1",
        "-ldl",
    ]));
    let every = "output.checkpoint_every.steps=10";
    let output = place
        .limited(&["run", "case.toml", "--quiet", "--device", "gpu", "--threads", "2", "--set", every])
        .env("OPENCL_DYLIB_PATH", place.path("lost.so"))
        .env("LAUNCHES", "500")
        .output()
        .unwrap();
    let said = words(&output);
    assert_eq!(output.status.code(), Some(3), "{said}");
    has(&said, &["the device failed at step", "CL_DEVICE_NOT_AVAILABLE"]);
    // The rest is computed by the processor.
    let resumed =
        place.well(&["resume", "out", "--quiet", "--threads", "1", "--set", "output.checkpoint_every=never"]);
    assert_eq!(place.summary("out")["state_hash"], place.summary("whole")["state_hash"], "{resumed}");
    assert_eq!(place.text("out/series.csv"), place.text("whole/series.csv"));
}
