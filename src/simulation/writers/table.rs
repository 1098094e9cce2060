//! A table of a writer, which is created with its first rows.

use crate::error::Result;
use crate::output::{RowsMark, SeriesWriter, directory};
use serde::Serialize;
use std::path::{Path, PathBuf};

pub(super) struct Table {
    path: PathBuf,
    head: Vec<String>,
    open: Option<SeriesWriter>,
}

impl Table {
    pub(super) fn new(path: PathBuf, head: Vec<String>) -> Self {
        Self { path, head, open: None }
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
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

    /// Refuses a file that does not begin with these rows.
    pub(super) fn holds(&self, rows: Option<&RowsMark>) -> Result<()> {
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
