//! The kept inputs of the fuzz targets: what is read from files of strangers returns, whatever it is.

#[path = "../../fuzz/readers.rs"]
mod readers;

use crate::common::in_tree;
use std::fs;

/// Reads all that is kept for a target; files named `good...` must be accepted, of the others some were found by fuzzing.
fn replay(target: &str, read: fn(&[u8]) -> bool) {
    let folder = in_tree("fuzz/seeds").join(target);
    let (mut accepted, mut refused) = (0, 0);
    for entry in fs::read_dir(&folder).unwrap() {
        let path = entry.unwrap().path();
        let good = read(&fs::read(&path).unwrap());
        let must = path.file_name().unwrap().to_string_lossy().starts_with("good");
        assert!(good || !must, "{} is refused", path.display());
        accepted += u32::from(good);
        refused += u32::from(!good);
    }
    assert!(refused > 0, "{target}: {accepted} are accepted, {refused} refused");
}

#[test]
fn cases_that_were_kept_are_read_or_refused() {
    replay("case", readers::case);
}

#[test]
fn meshes_that_were_kept_are_read_or_refused() {
    replay("stl", readers::stl);
    replay("obj", readers::obj);
}

#[test]
fn positions_that_were_kept_are_read_or_refused() {
    replay("positions", readers::positions);
    replay("xyz", readers::xyz);
    replay("lammps", readers::lammps);
    replay("vtk", readers::vtk);
}

#[test]
fn manifests_and_parts_that_were_kept_are_read_or_refused() {
    let (manifest, part) = readers::sample();
    assert!(readers::manifest(manifest.as_bytes()) && readers::part(part));
    replay("manifest", readers::manifest);
    replay("part", readers::part);
}

#[test]
fn messages_that_were_kept_are_read_or_refused() {
    replay("protocol", readers::protocol);
}
