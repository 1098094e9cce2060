//! Reading of files, which may come from untrusted sources: regular files up to a size limit, opened without blocking (a FIFO
//! would block for ever, a device may be endless); messages, which others may see, quote at most one word of them.

use std::fs::{File, FileType, OpenOptions};
use std::io::{self, Read};
use std::os::unix::fs::{FileTypeExt, OpenOptionsExt};
use std::path::Path;

/// Largest case or study file (bytes).
pub const CASE: u64 = 16 << 20;
/// Largest mesh (bytes).
pub const MESH: u64 = 256 << 20;
/// Largest file of positions (bytes), some ten million particles.
pub const POSITIONS: u64 = 1 << 30;
/// Largest file of results or of references that is read back (bytes).
pub const TABLE: u64 = 1 << 30;
/// Largest manifest, summary or other text of this program (bytes).
pub const RECORD: u64 = 256 << 20;

/// Most characters of a file that a message quotes.
const QUOTED: usize = 24;

/// Opens a regular file to read, but not through a symbolic link as the last part of the path.
///
/// # Errors
/// Those of the system; if the file is of another kind, one that names the kind.
pub fn open_unlinked(path: &Path) -> io::Result<File> {
    regular(std::fs::symlink_metadata(path)?.file_type())?;
    open_with(path, libc::O_NOFOLLOW)
}

/// Opens a file that was found to be regular: some devices act when they are opened. Checks again what was opened.
fn open_with(path: &Path, flags: i32) -> io::Result<File> {
    let flags = libc::O_NONBLOCK | libc::O_NOCTTY | flags;
    let file = OpenOptions::new().read(true).custom_flags(flags).open(path)?;
    regular(file.metadata()?.file_type())?;
    Ok(file)
}

fn regular(kind: FileType) -> io::Result<()> {
    let other = match kind {
        _ if kind.is_file() => return Ok(()),
        _ if kind.is_dir() => "a directory",
        _ if kind.is_fifo() => "a FIFO",
        _ if kind.is_socket() => "a socket",
        _ if kind.is_symlink() => "a symbolic link",
        _ => "a device",
    };
    Err(io::Error::other(format!("it is {other}, not a regular file")))
}

/// Reads a regular file of at most `limit` bytes.
///
/// # Errors
/// As [`open_unlinked`], and one for a file that is longer.
pub fn read(path: &Path, limit: u64) -> io::Result<Vec<u8>> {
    regular(std::fs::metadata(path)?.file_type())?;
    contents(open_with(path, 0)?, limit)
}

/// As [`read`], but not through a symbolic link as the last part of the path.
///
/// # Errors
/// As [`read`], also for a link.
pub fn read_unlinked(path: &Path, limit: u64) -> io::Result<Vec<u8>> {
    contents(open_unlinked(path)?, limit)
}

/// As [`read`], for UTF-8 text.
///
/// # Errors
/// As [`read`], and one for a file that is not such a text.
pub fn read_text(path: &Path, limit: u64) -> io::Result<String> {
    let not_text = |_| io::Error::new(io::ErrorKind::InvalidData, "it is not UTF-8 text");
    String::from_utf8(read(path, limit)?).map_err(not_text)
}

fn contents(file: File, limit: u64) -> io::Result<Vec<u8>> {
    let too_long = || {
        let (size, unit) = match limit >> 20 {
            0 => (limit, "bytes"),
            megabytes => (megabytes, "MiB"),
        };
        io::Error::other(format!("it is larger than {size} {unit}, the most that is read"))
    };
    let length = file.metadata()?.len();
    if length > limit {
        return Err(too_long());
    }
    let mut bytes = Vec::new();
    bytes.try_reserve_exact(length as usize + 1)?;
    // A file may have a length of 0 and no end, as some of /proc, or grow.
    file.take(limit.saturating_add(1)).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > limit {
        return Err(too_long());
    }
    Ok(bytes)
}

/// Quotable part of somebody else's text for a message: its first word, cut short, without control characters.
pub fn word(text: &str) -> String {
    let word = text.split_whitespace().next().unwrap_or_default();
    let mut quoted = String::new();
    for c in word.chars().take(QUOTED) {
        match c {
            '"' | '\'' | '\\' => quoted.push(c),
            _ => quoted.extend(c.escape_debug()),
        }
    }
    if word.chars().nth(QUOTED).is_some() {
        quoted.push_str("...");
    }
    quoted
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::ffi::CString;

    #[test]
    fn what_is_no_regular_file_is_named_and_never_waited_for() {
        let folder = tempfile::tempdir().unwrap();
        let fifo = folder.path().join("fifo");
        let name = CString::new(fifo.to_str().unwrap()).unwrap();
        // SAFETY: a path that ends with a zero byte.
        assert_eq!(unsafe { libc::mkfifo(name.as_ptr(), 0o600) }, 0);
        let said = |path: &Path| read(path, CASE).unwrap_err().to_string();
        assert_eq!(said(&fifo), "it is a FIFO, not a regular file");
        assert_eq!(said(folder.path()), "it is a directory, not a regular file");
        assert_eq!(said(Path::new("/dev/zero")), "it is a device, not a regular file");
        // One that replaces a file after the check is opened, but without blocking.
        assert!(open_with(&fifo, 0).is_err());
    }

    #[test]
    fn a_file_is_read_up_to_the_limit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        std::fs::write(&path, [7; 10]).unwrap();
        assert_eq!(read(&path, 10).unwrap(), [7; 10]);
        let said = read(&path, 9).unwrap_err().to_string();
        assert_eq!(said, "it is larger than 9 bytes, the most that is read");
        // Sparse: nothing of it is on disk, and nothing is read.
        File::options().write(true).open(&path).unwrap().set_len(MESH + 1).unwrap();
        let said = read(&path, MESH).unwrap_err().to_string();
        assert_eq!(said, "it is larger than 256 MiB, the most that is read");
    }

    #[test]
    fn a_link_is_followed_only_where_it_may_be() {
        let folder = tempfile::tempdir().unwrap();
        let [file, link] = ["file", "link"].map(|name| folder.path().join(name));
        std::fs::write(&file, "x").unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        assert!(read(&link, 1).is_ok() && open_unlinked(&file).is_ok());
        let said = open_unlinked(&link).unwrap_err().to_string();
        assert_eq!(said, "it is a symbolic link, not a regular file");
    }

    #[test]
    fn a_message_quotes_one_short_word() {
        assert_eq!(word("  density = 3"), "density");
        assert_eq!(word(""), "");
        assert_eq!(word("a\u{1b}[2Jb c"), "a\\u{1b}[2Jb");
        assert_eq!(word(&"x".repeat(30)), format!("{}...", "x".repeat(24)));
    }
}
