//! Files that appear whole or not at all.

use crate::error::{Error, Result};
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// Ending of the name of a file that is being written.
pub(super) const PARTIAL_SUFFIX: &str = ".tmp";

/// Writes a file under another name, syncs it to disk, and renames it to `path`, whose directory may be missing.
///
/// After an error neither `path` has changed nor is anything left beside it. A left-over of that other name is replaced; if it is a
/// symbolic link, nothing is written through it.
pub fn write_atomically(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> Result<()> {
    let partial = partial_name(path);
    let attempt = || {
        if let Some(directory) = path.parent() {
            fs::create_dir_all(directory)?;
        }
        let mut file = BufWriter::with_capacity(1 << 18, create_fresh(&partial)?);
        write(&mut file)?;
        file.flush()?;
        // Some file systems report a full disk only here.
        file.get_ref().sync_all()?;
        drop(file);
        fs::rename(&partial, path)
    };
    attempt().map_err(|source| {
        // The error at hand matters more than a failure to clean up after it.
        let _ = fs::remove_file(&partial);
        Error::io("write", path, source)
    })
}

/// [`write_atomically`] for contents that are in memory.
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<()> {
    write_atomically(path, |file| file.write_all(bytes))
}

/// [`write_atomically`] for a table with this header.
pub(super) fn write_table(
    path: &Path,
    head: &[String],
    rows: impl IntoIterator<Item = Vec<String>>,
) -> Result<()> {
    write_atomically(path, |file| {
        let mut table = csv::Writer::from_writer(file);
        table.write_record(head)?;
        for row in rows {
            table.write_record(row)?;
        }
        table.flush()
    })
}

/// Creates a file that was not there. One of this name that an earlier attempt left is removed, and a link itself.
fn create_fresh(path: &Path) -> io::Result<File> {
    match File::create_new(path) {
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {
            fs::remove_file(path)?;
            File::create_new(path)
        }
        created => created,
    }
}

fn partial_name(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(PARTIAL_SUFFIX);
    name.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_write_that_fails_half_way_keeps_the_old_file_and_leaves_nothing_beside_it() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("table.csv");
        write_bytes(&path, b"old").unwrap();
        let error = write_atomically(&path, |file| {
            file.write_all(b"half")?;
            Err(io::Error::other("power cut"))
        })
        .unwrap_err();
        assert!(error.to_string().contains("table.csv") && error.to_string().contains("power cut"));
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(fs::read_dir(directory.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_link_of_the_partial_name_is_replaced_and_what_it_leads_to_stays() {
        let directory = tempfile::tempdir().unwrap();
        let [path, other] = ["view.png", "other"].map(|name| directory.path().join(name));
        fs::write(&other, "mine").unwrap();
        std::os::unix::fs::symlink(&other, partial_name(&path)).unwrap();
        write_bytes(&path, b"new").unwrap();
        assert_eq!(
            (fs::read(&other).unwrap(), fs::read(&path).unwrap()),
            (b"mine".to_vec(), b"new".to_vec())
        );
        assert!(fs::symlink_metadata(&path).unwrap().is_file());
        assert_eq!(fs::read_dir(directory.path()).unwrap().count(), 2);
    }

    /// On `/dev/full` every write fails as on a full disk.
    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_disk_is_an_error_even_if_everything_fits_the_buffer() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("small.json");
        let error = write_atomically(&path, |file| {
            *file = BufWriter::new(File::options().write(true).open("/dev/full")?);
            file.write_all(b"{}")
        })
        .unwrap_err();
        assert!(matches!(&error, Error::Io { source, .. } if source.kind() == io::ErrorKind::StorageFull));
        assert_eq!(error.exit_code(), 2);
        assert_eq!(fs::read_dir(directory.path()).unwrap().count(), 0);
    }
}
