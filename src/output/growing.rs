//! Tables that grow on disk by whole rows, and the mark by which a run knows its own again.

use super::series::{COLUMNS, flow_columns, load_columns, population_columns, wall_columns};
use crate::error::{Error, Result};
use crate::wall::Wall;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use xxhash_rust::xxh3::Xxh3;

/// Length of a table and its checksum (xxh3) up to there, which tell its rows from those of another run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RowsMark {
    /// Bytes.
    pub bytes: u64,
    /// Checksum of these bytes.
    pub xxh3: u64,
}

/// Writes a table that grows on disk, as `series.csv`.
#[derive(Debug)]
pub struct SeriesWriter {
    path: PathBuf,
    writer: csv::Writer<Rows>,
}

struct Rows {
    file: File,
    bytes: u64,
    sum: Box<Xxh3>,
}

impl fmt::Debug for Rows {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.debug_struct("Rows").field("file", &self.file).field("bytes", &self.bytes).finish_non_exhaustive()
    }
}

impl Rows {
    fn take_note(&mut self, bytes: &[u8]) {
        self.sum.update(bytes);
        self.bytes += bytes.len() as u64;
    }
}

impl Write for Rows {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.file.write(bytes)?;
        self.take_note(&bytes[..written]);
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl SeriesWriter {
    /// Creates the `series.csv` of a run with these walls, these sections of prescribed motion, these inlets and outlets, and these
    /// sections whose particles come and go, replacing an older one, and writes the header.
    pub fn create(
        path: &Path,
        walls: &[Wall],
        prescribed: &[usize],
        open: &[&str],
        counted: &[usize],
    ) -> Result<Self> {
        let columns = COLUMNS.iter().cloned().chain(wall_columns(walls)).chain(load_columns(prescribed));
        Self::with_columns(path, columns.chain(flow_columns(open)).chain(population_columns(counted)))
    }

    /// As [`create`](Self::create), with these columns.
    pub fn with_columns(path: &Path, columns: impl IntoIterator<Item: AsRef<[u8]>>) -> Result<Self> {
        let file = File::create(path).map_err(|source| Error::io("create", path, source))?;
        let mut table = Self::of(path, Rows { file, bytes: 0, sum: Box::default() });
        let header = table.writer.write_record(columns).and_then(|()| Ok(table.writer.flush()?));
        table.check(header)?;
        Ok(table)
    }

    fn of(path: &Path, rows: Rows) -> Self {
        let writer = csv::WriterBuilder::new().has_headers(false).from_writer(rows);
        Self { path: path.to_path_buf(), writer }
    }

    /// Checks that the file begins with the rows that were [marked](Self::mark). Errors: [`Error::Input`] if not.
    pub fn holds(path: &Path, mark: &RowsMark) -> Result<()> {
        Self::open(path, mark, false).map(|_| ())
    }

    /// The file behind the rows that were marked.
    fn open(path: &Path, mark: &RowsMark, to_write: bool) -> Result<Rows> {
        let attempt = || -> io::Result<Rows> {
            let file = File::options().read(true).write(to_write).open(path)?;
            let mut rows = Rows { file, bytes: 0, sum: Box::default() };
            let mut chunk = vec![0; 1 << 16];
            while rows.bytes < mark.bytes {
                let most = chunk.len().min((mark.bytes - rows.bytes) as usize);
                match rows.file.read(&mut chunk[..most])? {
                    0 => break,
                    count => rows.take_note(&chunk[..count]),
                }
            }
            Ok(rows)
        };
        let rows = attempt().map_err(|source| gone(path, &source.to_string()))?;
        if rows.bytes < mark.bytes {
            return Err(gone(path, &format!("it has {} bytes of at least {}", rows.bytes, mark.bytes)));
        }
        if rows.sum.digest() != mark.xxh3 {
            let what = format!("its first {} bytes are those of another run", mark.bytes);
            return Err(gone(path, &what));
        }
        Ok(rows)
    }

    /// Continues after the rows that were [marked](Self::mark); what follows is cut off. Errors: [`Error::Input`] if the file is not
    /// there, has become shorter, or is that of another run.
    pub fn resume(path: &Path, mark: &RowsMark) -> Result<Self> {
        let mut rows = Self::open(path, mark, true)?;
        (rows.file.set_len(mark.bytes))
            .and_then(|()| rows.file.seek(SeekFrom::End(0)))
            .map_err(|source| Error::io("cut", path, source))?;
        Ok(Self::of(path, rows))
    }

    /// Mark of the rows so far, which are safe on disk after this. Errors: as [`intact`](Self::intact), and of writing.
    pub fn mark(&self) -> Result<RowsMark> {
        self.intact()?;
        let Rows { file, bytes, sum } = self.writer.get_ref();
        file.sync_all()
            // The name of a new file, too.
            .and_then(|()| match self.path.parent().filter(|parent| parent.is_dir()) {
                Some(folder) => File::open(folder)?.sync_all(),
                None => Ok(()),
            })
            .map_err(|source| Error::io("write", &self.path, source))?;
        Ok(RowsMark { bytes: *bytes, xxh3: sum.digest() })
    }

    /// Checks that the file still has its name: a file that was removed takes rows that nobody can read. Errors: [`Error::Input`] if it
    /// was removed or replaced.
    pub fn intact(&self) -> Result<()> {
        let Rows { file, bytes, .. } = self.writer.get_ref();
        let is_open = file.metadata().is_ok_and(|own| own.nlink() > 0);
        if is_open && std::fs::metadata(&self.path).is_ok_and(|named| named.len() >= *bytes) {
            return Ok(());
        }
        Err(Error::Input(format!(
            "{} was removed or replaced while the run wrote to it: its rows are lost, and the run ends\n  run the case anew, in a \
             directory that nothing removes",
            self.path.display()
        )))
    }

    /// Appends rows and hands them to the operating system as a whole, so that a killed run leaves whole rows.
    pub fn write(&mut self, rows: &[impl Serialize]) -> Result<()> {
        let written = rows.iter().try_for_each(|row| self.writer.serialize(row));
        let written = written.and_then(|()| Ok(self.writer.flush()?));
        self.check(written)
    }

    fn check(&self, done: csv::Result<()>) -> Result<()> {
        done.map_err(|error| Error::io("write", &self.path, io::Error::from(error)))
    }
}

/// The rows of an earlier run are not what they were.
fn gone(path: &Path, what: &str) -> Error {
    Error::Input(format!(
        "the rows of {} cannot be continued: {what}\n  put the file back as the run has left it, remove a checkpoint that is of another run, \
         or start a new run",
        path.display()
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::SeriesRow;

    fn row(step: u64) -> SeriesRow {
        SeriesRow { step, ..SeriesRow::default() }
    }

    #[test]
    fn rows_go_on_where_they_were_and_later_ones_are_cut_off() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("series.csv");
        let mut series = SeriesWriter::create(&path, &[], &[], &[], &[]).unwrap();
        series.write(&[row(1)]).unwrap();
        let mark = series.mark().unwrap();
        series.write(&[row(7)]).unwrap();
        drop(series);
        let mut series = SeriesWriter::resume(&path, &mark).unwrap();
        assert_eq!(series.mark().unwrap(), mark);
        series.write(&[row(2)]).unwrap();
        let mark = series.mark().unwrap();
        assert_eq!(mark.xxh3, xxhash_rust::xxh3::xxh3_64(&std::fs::read(&path).unwrap()));
        let mut reader = csv::Reader::from_path(&path).unwrap();
        let steps: Vec<String> = reader.records().map(|r| r.unwrap()[0].to_string()).collect();
        assert_eq!(steps, ["1", "2"]);
    }

    #[test]
    fn rows_that_are_gone_or_of_another_run_are_named_and_what_is_left_stays() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("series.csv");
        std::fs::write(&path, "step\n1\n").unwrap();
        let refused =
            |bytes| SeriesWriter::resume(&path, &RowsMark { bytes, xxh3: 1 }).unwrap_err().to_string();
        let error = refused(100);
        assert!(error.contains("series.csv") && error.contains("7 bytes"), "{error}");
        let error = refused(7);
        assert!(error.contains("its first 7 bytes are those of another run"), "{error}");
        assert_eq!(std::fs::read(&path).unwrap(), b"step\n1\n");
        std::fs::remove_file(&path).unwrap();
        assert!(refused(7).contains("No such file"));
    }

    #[test]
    fn a_table_that_was_removed_or_replaced_by_a_shorter_one_is_noticed() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("series.csv");
        let series = SeriesWriter::create(&path, &[], &[], &[], &[]).unwrap();
        series.intact().unwrap();
        for replaced in [false, true] {
            let _ = std::fs::remove_file(&path);
            if replaced {
                std::fs::write(&path, "step").unwrap();
            }
            let error = series.mark().unwrap_err();
            assert!(error.to_string().contains("series.csv was removed or replaced"), "{error}");
            assert_eq!(error.exit_code(), 2);
        }
    }
}
