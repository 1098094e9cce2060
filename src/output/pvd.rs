//! Series of VTK files with their physical times (`.pvd`), what one opens in `ParaView`.

use super::atomic::write_bytes;
use super::directory::remove;
use crate::error::Result;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// A growing list of files; the `.pvd` on disk is complete after every [`add`](Self::add).
#[derive(Clone, Debug)]
pub struct Collection {
    path: PathBuf,
    entries: Vec<(f64, String)>,
}

impl Collection {
    /// An empty collection; nothing is written before the first file is added.
    pub fn new(path: impl Into<PathBuf>) -> Self {
        Self { path: path.into(), entries: Vec::new() }
    }

    /// Takes up the entries of an earlier collection and writes them, if there are any; those added later to the file are gone.
    pub fn resume(path: impl Into<PathBuf>, entries: Vec<(f64, String)>) -> Result<Self> {
        let path = path.into();
        let collection = Self { path, entries };
        if collection.entries.is_empty() {
            remove(&collection.path)?;
        } else {
            write_bytes(&collection.path, collection.text().as_bytes())?;
        }
        Ok(collection)
    }

    /// Times (s) and names of the files, for [`resume`](Self::resume).
    pub fn entries(&self) -> &[(f64, String)] {
        &self.entries
    }

    /// Adds a finished file at physical time `time` (s) and rewrites the collection.
    ///
    /// Files below the directory of the collection are named relative to it, so the directory can be moved.
    pub fn add(&mut self, time: f64, file: &Path) -> Result<()> {
        let base = self.path.parent().unwrap_or(Path::new(""));
        let file = file.strip_prefix(base).unwrap_or(file).to_string_lossy();
        let escaped = file.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
        self.entries.push((time, escaped.replace('"', "&quot;")));
        write_bytes(&self.path, self.text().as_bytes())
    }

    fn text(&self) -> String {
        let mut text = String::from(
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\" byte_order=\"LittleEndian\">\n\
             <Collection>\n",
        );
        for (time, file) in &self.entries {
            writeln!(text, "<DataSet timestep=\"{time}\" group=\"\" part=\"0\" file=\"{file}\"/>")
                .expect("memory takes any text");
        }
        text.push_str("</Collection>\n</VTKFile>\n");
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_file_lists_everything_added_so_far_by_relative_name_and_exact_time() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("fields.pvd");
        let mut collection = Collection::new(&path);
        assert!(!path.exists());
        for (count, time) in [(1, 0.0), (2, 0.1 + 0.2), (3, 1e-7)] {
            collection.add(time, &directory.path().join("fields").join(format!("a&b_{count}.vti"))).unwrap();
            let text = std::fs::read_to_string(&path).unwrap();
            assert_eq!(text.matches("<DataSet").count(), count);
            assert!(text.ends_with("</VTKFile>\n"));
            assert!(text.contains(&format!("file=\"fields/a&amp;b_{count}.vti\"")));
            let written: f64 =
                text.split("timestep=\"").nth(count).unwrap()[..].split('"').next().unwrap().parse().unwrap();
            assert_eq!(written.to_bits(), time.to_bits());
        }
    }
}
