//! Reading `series.csv`.

use crate::error::{Error, Result};
use crate::input;
use std::path::Path;

/// The columns of a time series, by the names in its header.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SeriesTable {
    /// In the order of the file.
    pub columns: Vec<SeriesColumn>,
}

/// A column.
#[derive(Clone, Debug, PartialEq)]
pub struct SeriesColumn {
    /// Name without its unit.
    pub name: String,
    /// What stands in parentheses behind it, `-` for none.
    pub unit: String,
    /// A number for each row.
    pub values: Vec<f64>,
}

impl SeriesTable {
    /// Reads the file; a last row that was not written to its end is left out. Errors: [`Error::Io`] if it cannot be read;
    /// [`Error::Input`] with line and column of what is not a number.
    pub fn read(path: &Path) -> Result<Self> {
        let broken = |error: csv::Error| match error.into_kind() {
            csv::ErrorKind::Io(source) => Error::io("read", path, source),
            other => Error::Input(format!("{}: {other:?}", path.display())),
        };
        let bytes = input::read(path, input::TABLE).map_err(|source| Error::io("read", path, source))?;
        let mut reader = csv::ReaderBuilder::new().flexible(true).from_reader(&bytes[..]);
        let header = reader.headers().map_err(broken)?.clone();
        let mut columns: Vec<SeriesColumn> = header.iter().map(column).collect();
        let records = reader.records().collect::<std::result::Result<Vec<_>, _>>();
        let records = records.map_err(broken)?;
        for (row, record) in records.iter().enumerate() {
            let numbers: Option<Vec<f64>> = record.iter().map(|word| word.parse().ok()).collect();
            match numbers.filter(|numbers| numbers.len() == columns.len()) {
                Some(numbers) => {
                    for (column, number) in columns.iter_mut().zip(numbers) {
                        column.values.push(number);
                    }
                }
                None if row + 1 == records.len() => {}
                None => return Err(bad_row(path, record, &columns)),
            }
        }
        Ok(Self { columns })
    }

    /// The values of a column, if there is one of this name.
    pub fn get(&self, name: &str) -> Option<&[f64]> {
        let found = self.columns.iter().find(|column| column.name == name);
        found.map(|column| column.values.as_slice())
    }
}

fn column(head: &str) -> SeriesColumn {
    let parts = head.strip_suffix(')').and_then(|head| head.rsplit_once(" ("));
    let (name, unit) = parts.unwrap_or((head, "-"));
    SeriesColumn { name: name.to_string(), unit: unit.to_string(), values: Vec::new() }
}

fn bad_row(path: &Path, record: &csv::StringRecord, columns: &[SeriesColumn]) -> Error {
    let line = record.position().map_or(0, csv::Position::line);
    let wrong = record.iter().zip(columns).find(|(word, _)| word.parse::<f64>().is_err());
    let what = match wrong {
        Some((word, column)) => format!("`{word}` in column `{}` is no number", column.name),
        None => format!("{} values under {} heads", record.len(), columns.len()),
    };
    Error::Input(format!(
        "{}, line {line}: {what}\n  the file was changed after the run; run the case again, or remove this line",
        path.display()
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<SeriesTable> {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("series.csv");
        std::fs::write(&path, text).unwrap();
        SeriesTable::read(&path)
    }

    #[test]
    fn names_and_units_are_taken_apart_and_a_torn_last_row_is_left_out() {
        let series = read("step (-),v (m/s),plain\n0,1.5,2\n1,-2e-3,3\n2,4").unwrap();
        let units: Vec<&str> = series.columns.iter().map(|c| c.unit.as_str()).collect();
        assert_eq!(units, ["-", "m/s", "-"]);
        assert_eq!(series.get("v").unwrap(), [1.5, -2e-3]);
        assert_eq!(series.get("w"), None);
    }

    #[test]
    fn a_row_that_is_broken_is_named_with_its_line_and_column() {
        let error = read("step (-),v (m/s)\n0,1\n1,x\n2,3\n").unwrap_err().to_string();
        assert!(error.contains("line 3: `x` in column `v` is no number"), "{error}");
        let error = read("a,b\n0\n1,2\n").unwrap_err().to_string();
        assert!(error.contains("line 2: 1 values under 2 heads"), "{error}");
    }
}
