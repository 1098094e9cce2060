//! What a study has found, resolved to numbers: `study.json`, which `turbid report` draws.

use crate::checks::Check;
use serde::{Deserialize, Serialize};
use std::path::Path;
use turbid::error::{Error, Result};
use turbid::input;
use turbid::output::write_bytes;

pub use turbid_plot::{Axis, Chart, Panel, Point, Series, Style};

/// Name of the file in the directory of a study.
pub const FILE: &str = "study.json";

/// A study in numbers. Its JSON keys are stable.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Document {
    /// What is studied, one line.
    pub title: String,
    /// Version of the program that wrote it.
    pub version: String,
    /// The command that makes it again.
    pub command: String,
    /// Figures, in the order of the study file.
    pub figures: Vec<Figure>,
    /// Tables, in the order of the study file.
    pub tables: Vec<Table>,
    /// Comparisons with references.
    pub checks: Vec<Check>,
    /// How much of it is done.
    pub runs: Runs,
    /// Names of the runs whose means have not settled, by [`Record::is_settled`](super::record::Record::is_settled).
    #[serde(default)]
    pub unsettled: Vec<String>,
}

/// A chart with its name.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Figure {
    /// Short name, good for a file.
    pub name: String,
    /// Contents.
    #[serde(flatten)]
    pub chart: Chart,
}

/// A table of words.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Table {
    /// Short name, good for a file.
    pub name: String,
    /// Heading.
    pub title: String,
    /// Heads of the columns.
    pub columns: Vec<String>,
    /// Rows, each as long as `columns`.
    pub rows: Vec<Vec<String>>,
}

/// How much of a study is done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Runs {
    /// Runs that have come to their end.
    pub done: usize,
    /// All runs.
    pub total: usize,
    /// Time that the steps of all runs have taken so far (s).
    pub seconds_spent: f64,
    /// Time that the others will take, estimated (s).
    pub seconds_left: f64,
}

impl Document {
    /// Reads the document of the study in a directory.
    ///
    /// # Errors
    /// [`Error::Io`] if the file cannot be read, [`Error::Input`] if it is not of this kind.
    pub fn read(directory: &Path) -> Result<Self> {
        let path = directory.join(FILE);
        let text = input::read_text(&path, input::RECORD).map_err(|error| Error::io("read", &path, error))?;
        serde_json::from_str(&text).map_err(|error| {
            Error::Input(format!(
                "{} is no document of a study: {error}\n  `turbid study` writes it anew",
                path.display()
            ))
        })
    }

    /// Writes the document into a directory; it appears whole.
    pub fn write(&self, directory: &Path) -> Result<()> {
        let mut text = serde_json::to_string_pretty(self).expect("plain data always serialises");
        text.push('\n');
        write_bytes(&directory.join(FILE), text.as_bytes())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_document_survives_being_written_and_read() {
        let point = Point { x: 0.1, y: 0.27, error: None };
        let series = Series { label: "spheres".into(), style: Style::Dashed, points: vec![point] };
        let panel = Panel { title: "Ar 500".into(), series: vec![series], ..Panel::default() };
        let document = Document {
            title: "A study".into(),
            figures: vec![Figure {
                name: "velocity".into(),
                chart: Chart { panels: vec![panel], ..Chart::default() },
            }],
            runs: Runs { done: 1, total: 2, seconds_spent: 3.5, seconds_left: 4.0 },
            ..Document::default()
        };
        let place = tempfile::tempdir().unwrap();
        document.write(place.path()).unwrap();
        assert_eq!(Document::read(place.path()).unwrap(), document);
        let json: serde_json::Value =
            serde_json::from_str(&std::fs::read_to_string(place.path().join(FILE)).unwrap()).unwrap();
        assert_eq!(json["figures"][0]["panels"][0]["series"][0]["style"], "dashed");
        assert!(json["figures"][0]["panels"][0]["series"][0]["points"][0]["error"].is_null());
    }
}
