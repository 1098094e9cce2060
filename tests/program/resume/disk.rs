//! Disks that are full, and folders that cannot be written to.

use super::{Left, crowd};
use crate::common::case::TABLES_ONLY;
use crate::common::{PROGRAM, Place, has, words};
use std::process::Command;

/// True if this system lets a test have a file system of its own.
#[cfg(target_os = "linux")]
fn can_mount() -> bool {
    let folder = tempfile::tempdir().unwrap();
    let status = Command::new("unshare")
        .args(["--mount", "mount", "-t", "tmpfs", "none", "."])
        .current_dir(folder.path())
        .output();
    status.is_ok_and(|output| output.status.success())
}

/// A run that finds its disk full after step 30, and says so with these words, resumes to the bit elsewhere.
#[cfg(target_os = "linux")]
fn with_too_little_room(room: &str, options: &[&str], words_said: &[&str]) {
    if !can_mount() {
        println!("skipped: no tmpfs can be mounted here");
        return;
    }
    let place = Place::new(&crowd());
    let fields = ["--set", "output.fields_every=never"];
    let whole = [&["run", "case.toml", "--quiet"], &fields[..], options].concat();
    place.well(&[&whole[..], &["--out", "whole"]].concat());
    // The file system is gone with its only process.
    let script = "mkdir small && mount -t tmpfs -o size=$0 none small || exit 99\n\
                  timeout --kill-after=5 300 \"$@\" --out small/out; code=$?\n\
                  cp -r small/out copy && exit $code";
    let output = Command::new("unshare")
        .args(["--mount", "sh", "-c", script, room, PROGRAM])
        .args(whole)
        .args(["--threads", "2", "--set", "output.checkpoint_every.steps=30"])
        .current_dir(place.folder())
        .output()
        .unwrap();
    let said = words(&output);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert_eq!(said.matches("error:").count(), 1, "{said}");
    has(&said, words_said);
    let names: Vec<_> = std::fs::read_dir(place.path("copy/checkpoints"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name())
        .collect();
    assert_eq!(names, ["step-0000000030"]);
    place.well(&["resume", "copy", "--quiet", "--threads", "3"]);
    Left::of(&place, "copy").must_be(&Left::of(&place, "whole"), "with room");
}

#[cfg(target_os = "linux")]
#[test]
fn a_disk_that_is_full_at_a_checkpoint_keeps_the_one_before_which_resumes_to_the_bit() {
    let words = ["the checkpoint of step 60 failed", "No space left", "the checkpoint of step 30 is intact"];
    // A checkpoint has 1.3 MB.
    with_too_little_room("2000k", &TABLES_ONLY, &words);
}

#[cfg(target_os = "linux")]
#[test]
fn a_disk_that_is_full_at_a_frame_keeps_the_checkpoint_before_which_resumes_to_the_bit() {
    // A checkpoint and some frames are too much.
    with_too_little_room("2500k", &[], &["cannot write small/out/", "No space left"]);
}

#[test]
fn a_folder_of_checkpoints_that_cannot_be_used_is_refused_before_anything_is_computed() {
    let place = Place::new(&crowd());
    std::fs::create_dir(place.path("out")).unwrap();
    place.write("out/checkpoints", "a file");
    let said = place.ends(2, &["run", "case.toml"]);
    assert!(said.contains("out/checkpoints") && said.contains("--out"), "{said}");
    assert!(!place.path("out/series.csv").exists());
}
