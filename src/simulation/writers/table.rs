//! A table of a writer, which is created with its first rows.

use crate::error::{Error, Result};
use crate::output::{RowsMark, SeriesWriter, directory};
use serde::Serialize;
use std::path::PathBuf;

pub(super) struct Table {
    path: PathBuf,
    head: Vec<String>,
    open: Option<SeriesWriter>,
}

impl Table {
    pub(super) fn new(path: PathBuf, head: Vec<String>) -> Self {
        Self { path, head, open: None }
    }

    pub(super) fn write(&mut self, rows: &[impl Serialize]) -> Result<()> {
        let table = match &mut self.open {
            Some(table) => table,
            none => none.insert(SeriesWriter::with_columns(&self.path, &self.head)?),
        };
        table.write(rows)
    }

    pub(super) fn intact(&self) -> Result<()> {
        self.open.as_ref().map_or(Ok(()), SeriesWriter::intact)
    }

    /// Mark of the rows so far; nothing before the first.
    pub(super) fn mark(&self) -> Result<Option<RowsMark>> {
        self.open.as_ref().map(SeriesWriter::mark).transpose()
    }

    /// Refuses to continue these rows, if the key of `[output]` that says what they are has another value than then, and a file that does not begin
    /// with them.
    pub(super) fn fits(&self, key: &str, is_same: bool, rows: Option<&RowsMark>) -> Result<()> {
        if rows.is_some() && !is_same {
            return Err(Error::Input(format!(
                "`output.{key}` is not what it was when {} was begun\n  leave it, or branch off by `turbid resume DIR --out NEW`",
                self.path.display()
            )));
        }
        self.holds(rows)
    }

    /// Refuses a file that does not begin with these rows.
    fn holds(&self, rows: Option<&RowsMark>) -> Result<()> {
        rows.map_or(Ok(()), |mark| SeriesWriter::holds(&self.path, mark))
    }

    /// Continues after these rows; without any the file is removed.
    pub(super) fn resume(&mut self, rows: Option<&RowsMark>) -> Result<()> {
        self.open = rows.map(|mark| SeriesWriter::resume(&self.path, mark)).transpose()?;
        if self.open.is_none() {
            directory::remove(&self.path)?;
        }
        Ok(())
    }
}
