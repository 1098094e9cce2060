//! Files in pieces: one for each rank where ranks are processes, and an index that VTK opens in their place.
//!
//! ```text
//! fields/fields_0000001000.pvti                                 the index
//! fields/fields_0000001000/fields_0000001000_p00003.vti         the piece of rank 3
//! ```
//!
//! All pieces are complete before the index is written, so an index never names what is not there.

use super::atomic::write_bytes;
use crate::error::Result;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Separates the name of a file from the rank of a piece.
const MARK: &str = "_p";

/// The piece of `rank` of a file that is written in pieces.
pub fn piece(file: &Path, rank: usize) -> PathBuf {
    let folder = file.with_extension("");
    folder.join(piece_name(file, rank))
}

/// The index of the pieces of a file: its name with a `p` before the extension.
pub fn index(file: &Path) -> PathBuf {
    file.with_extension(format!("p{}", text(file.extension())))
}

fn piece_name(file: &Path, rank: usize) -> String {
    format!("{}{MARK}{rank:05}.{}", text(file.file_stem()), text(file.extension()))
}

/// Returns true if `name` is that of a piece of the file `stem` + `extension`, with its dot.
pub(super) fn is_piece(name: &str, stem: &str, extension: &str) -> bool {
    name.strip_prefix(stem)
        .and_then(|rest| rest.strip_prefix(MARK))
        .and_then(|rest| rest.strip_suffix(extension))
        .is_some_and(is_number)
}

/// Returns true for a number without a sign.
pub(super) fn is_number(digits: &str) -> bool {
    !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit())
}

/// Declares an array that all pieces have.
pub(super) fn array(kind: &str, name: &str, components: usize) -> String {
    format!("<PDataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\"/>\n")
}

/// Writes the index of a file; the path of the index. `kind` is VTK's name of the data, `attributes` are its own, each with a blank
/// before it, `declared` its elements before the pieces; `pieces` gives the attributes of each piece but for its name, by rank.
pub(super) fn write_index(
    file: &Path,
    kind: &str,
    attributes: &str,
    declared: &str,
    pieces: impl Iterator<Item = String>,
) -> Result<PathBuf> {
    let mut body = String::new();
    let folder = text(file.file_stem());
    for (rank, attributes) in pieces.enumerate() {
        let source = format!("{folder}/{}", piece_name(file, rank));
        writeln!(body, "<Piece{attributes} Source=\"{source}\"/>").expect("memory takes any text");
    }
    let text = format!(
        "<?xml version=\"1.0\"?>\n\
         <VTKFile type=\"{kind}\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n\
         <{kind} GhostLevel=\"0\"{attributes}>\n{declared}{body}</{kind}>\n</VTKFile>\n"
    );
    let path = index(file);
    write_bytes(&path, text.as_bytes())?;
    Ok(path)
}

/// A part of a name that this program has made.
fn text(name: Option<&std::ffi::OsStr>) -> std::borrow::Cow<'_, str> {
    name.unwrap_or_default().to_string_lossy()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_names_of_pieces_and_indices_follow_from_that_of_the_file() {
        let file = Path::new("out.dir/fields/fields_0000001000.vti");
        let expected = "out.dir/fields/fields_0000001000/fields_0000001000_p00003.vti";
        assert_eq!(piece(file, 3), Path::new(expected));
        assert_eq!(index(file), Path::new("out.dir/fields/fields_0000001000.pvti"));
    }

    #[test]
    fn a_piece_is_known_by_its_name() {
        let file = Path::new("fields/fields_0000001000.vti");
        for rank in [0, 99_999, 123_456] {
            let name = piece_name(file, rank);
            assert!(is_piece(&name, "fields_0000001000", ".vti"), "{name}");
        }
        for other in [
            "fields_0000001000.vti",
            "fields_0000001000_p.vti",
            "fields_0000001000_p1.vtp",
            "fields_0000001001_p00001.vti",
            "fields_0000001000_pa.vti",
        ] {
            assert!(!is_piece(other, "fields_0000001000", ".vti"), "{other}");
        }
    }
}
