//! XML files of VTK: polygonal data and unstructured grids. Of XML only tags and their attributes are looked at.

use super::array::{Compressor, Data, Encoding, Kind};
use super::{POINTS, Piece};
use crate::input;
use crate::packing::positions::MOST;

/// A tag: its text without the brackets, and where it ends.
struct Tag<'a> {
    text: &'a str,
    end: usize,
}

impl<'a> Tag<'a> {
    /// The first tag from a position on.
    fn next(bytes: &'a [u8], from: usize) -> Option<Self> {
        let find = |from: usize, byte: u8| Some(from + bytes.get(from..)?.iter().position(|b| *b == byte)?);
        let mut begin = find(from, b'<')?;
        while bytes[begin..].starts_with(b"<!--") {
            begin += bytes[begin..].windows(3).position(|window| window == b"-->")?;
            begin = find(begin, b'<')?;
        }
        let end = find(begin, b'>')?;
        Some(Self { text: std::str::from_utf8(&bytes[begin + 1..end]).unwrap_or_default(), end: end + 1 })
    }

    fn name(&self) -> &'a str {
        self.text.split([' ', '\t', '\r', '\n']).next().unwrap_or_default().trim_end_matches('/')
    }

    fn attribute(&self, name: &str) -> Option<&'a str> {
        let mut rest = self.text;
        loop {
            let (before, after) = rest.split_once('=')?;
            let after = after.trim_start();
            let quote = after.chars().next().filter(|quote| ['"', '\''].contains(quote))?;
            let (value, behind) = after[1..].split_once(quote)?;
            if before.trim_end().rsplit(|c: char| c.is_whitespace()).next() == Some(name) {
                return Some(value);
            }
            rest = behind;
        }
    }
}

/// The pieces of a file.
pub(super) fn pieces(bytes: &[u8]) -> Result<Vec<Piece<'_>>, String> {
    // What is appended may be no text.
    let appended = bytes.windows(13).position(|window| window == b"<AppendedData");
    let (head, appended) = bytes.split_at(appended.unwrap_or(bytes.len()));
    let appended = Tag::next(appended, 0).and_then(|tag| {
        let base64 = tag.attribute("encoding").is_none_or(|encoding| encoding == "base64");
        let data = appended.get(tag.end..)?;
        let begin = data.iter().position(|byte| *byte == b'_')? + 1;
        Some((&data[begin..], base64))
    });
    let mut encoding = Encoding { big: false, header: 4, compressor: Compressor::None };
    let mut pieces: Vec<Piece<'_>> = Vec::new();
    let (mut at, mut section, mut open) = (0, "", 0_usize);
    while let Some(tag) = Tag::next(head, at) {
        at = tag.end;
        match tag.name() {
            "VTKFile" => {
                let kind = tag.attribute("type").unwrap_or_default();
                if !["PolyData", "UnstructuredGrid"].contains(&kind) {
                    let kind = input::word(kind);
                    return Err(format!("its type is `{kind}`, but must be PolyData or UnstructuredGrid"));
                }
                encoding = Encoding {
                    big: tag.attribute("byte_order") == Some("BigEndian"),
                    header: if tag.attribute("header_type") == Some("UInt64") { 8 } else { 4 },
                    compressor: match tag.attribute("compressor") {
                        None | Some("") => Compressor::None,
                        Some("vtkLZ4DataCompressor") => Compressor::Lz4,
                        Some("vtkZLibDataCompressor") => Compressor::Zlib,
                        Some(other) => {
                            return Err(format!(
                                "is compressed by `{}`; save it with zlib, LZ4 or without compression",
                                input::word(other)
                            ));
                        }
                    },
                };
            }
            "Piece" => {
                let count = tag.attribute("NumberOfPoints").unwrap_or("0");
                let count = count.parse().ok().filter(|count| *count <= MOST);
                let count = count.ok_or_else(|| format!("a piece has no number of points up to {MOST}"))?;
                pieces.push(Piece { count, arrays: Vec::new() });
                open += usize::from(!tag.text.ends_with('/'));
            }
            "/Piece" => open = open.saturating_sub(1),
            "PointData" => section = "PointData",
            "Points" => section = "Points",
            "/PointData" | "/Points" => section = "",
            "DataArray" if !section.is_empty() => {
                let Some(piece) = pieces.last_mut() else {
                    return Err("an array is outside of all pieces".to_owned());
                };
                let name = match section {
                    "Points" => POINTS,
                    _ => tag.attribute("Name").unwrap_or_default(),
                };
                let kind = tag.attribute("type").unwrap_or_default();
                let components = tag.attribute("NumberOfComponents").unwrap_or("1").parse().unwrap_or(0);
                let Some(kind) = Kind::named(kind) else {
                    continue;
                };
                let end = head[at..].iter().position(|byte| *byte == b'<').unwrap_or(head.len() - at);
                let text = &head[at..at + end];
                let data = match tag.attribute("format") {
                    Some("appended") => {
                        let offset = tag.attribute("offset").and_then(|offset| offset.parse::<usize>().ok());
                        let place = appended.zip(offset);
                        let place = place.and_then(|((data, base64), at)| Some((data.get(at..)?, base64)));
                        let (bytes, base64) = place
                            .ok_or_else(|| format!("the array `{}` is not in the file", input::word(name)))?;
                        Data::Encoded { bytes, base64, encoding }
                    }
                    Some("binary") => Data::Encoded { bytes: text, base64: true, encoding },
                    _ => Data::Text(text),
                };
                piece.add(name, components, kind, data);
            }
            _ => {}
        }
    }
    if open > 0 {
        return Err("a piece has no end: the file is cut off".to_owned());
    }
    Ok(pieces)
}
