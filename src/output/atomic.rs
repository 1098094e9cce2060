//! Files that appear whole or not at all.

use crate::error::{Error, Result};
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// Ending of the name of a file that is being written.
pub(super) const PARTIAL_SUFFIX: &str = ".tmp";

/// Writes a file under another name, syncs it to disk, and renames it to `path`, whose directory may be missing.
///
/// After an error neither `path` has changed nor is anything left beside it.
pub fn write_atomically(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> Result<()> {
    let partial = partial_name(path);
    let attempt = || {
        if let Some(directory) = path.parent() {
            fs::create_dir_all(directory)?;
        }
        let mut file = BufWriter::with_capacity(1 << 18, create_anew(&partial)?);
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

/// Creates a file in place of one that a stopped program has left; a link of that name is removed, not followed.
///
/// # Errors
/// Those of the file system.
pub fn create_anew(path: &Path) -> io::Result<File> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => OpenOptions::new().write(true).create_new(true).open(path),
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

    /// `/dev/full` stands for the file, where every write fails as on a full disk.
    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_disk_is_an_error_even_if_everything_fits_the_buffer() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("small.json");
        let error = write_atomically(&path, |file| {
            *file = BufWriter::new(OpenOptions::new().write(true).open("/dev/full")?);
            file.write_all(b"{}")
        })
        .unwrap_err();
        assert!(matches!(&error, Error::Io { source, .. } if source.kind() == io::ErrorKind::StorageFull));
        assert_eq!(error.exit_code(), 2);
        assert_eq!(fs::read_dir(directory.path()).unwrap().count(), 0);
    }

    #[cfg(unix)]
    #[test]
    fn a_link_with_the_name_of_the_partial_file_is_not_followed() {
        let directory = tempfile::tempdir().unwrap();
        let [path, other] = ["small.json", "other"].map(|name| directory.path().join(name));
        fs::write(&other, "of somebody else").unwrap();
        std::os::unix::fs::symlink(&other, partial_name(&path)).unwrap();
        write_bytes(&path, b"{}").unwrap();
        assert_eq!(fs::read_to_string(&other).unwrap(), "of somebody else");
        assert_eq!(fs::read_to_string(&path).unwrap(), "{}");
    }
}
