//! Tables and files that a run has left.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::{Path, PathBuf};

/// A column of a table, by the beginning of its name.
pub(crate) fn column(path: &Path, name: &str) -> Vec<f64> {
    column_of(std::fs::File::open(path).unwrap(), name)
}

/// The same of a table that has been read.
pub(crate) fn column_of(table: impl Read, name: &str) -> Vec<f64> {
    let mut table = csv::Reader::from_reader(table);
    let heads = table.headers().unwrap();
    let at =
        heads.iter().position(|head| head.starts_with(name)).unwrap_or_else(|| panic!("no column {name}"));
    table.records().map(|row| row.unwrap()[at].parse().unwrap()).collect()
}

/// All files below a folder, by their path in it; none if there is no such folder.
pub(crate) fn files_below(root: &Path) -> BTreeMap<PathBuf, PathBuf> {
    let (mut open, mut found) = (vec![root.to_path_buf()], BTreeMap::new());
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(folder).into_iter().flatten() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                open.push(path);
            } else {
                found.insert(path.strip_prefix(root).unwrap().to_path_buf(), path);
            }
        }
    }
    found
}
