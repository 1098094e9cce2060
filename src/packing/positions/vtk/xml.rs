//! XML files of VTK: polygonal data and unstructured grids.

use super::array::{Compressor, Data, Encoding, Kind};
use super::{POINTS, Piece};
use crate::input;
use crate::packing::positions::MOST;
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

fn attribute(tag: &BytesStart, name: &str) -> Option<String> {
    Some(tag.try_get_attribute(name).ok()??.unescape_value().ok()?.into_owned())
}

pub(super) fn pieces(bytes: &[u8]) -> Result<Vec<Piece<'_>>, String> {
    // What is appended may be no text.
    let appended = bytes.windows(13).position(|window| window == b"<AppendedData");
    let (head, appended) = bytes.split_at(appended.unwrap_or(bytes.len()));
    let mut reader = Reader::from_reader(appended);
    let appended = match reader.read_event() {
        Ok(Event::Start(tag)) => {
            let base64 = attribute(&tag, "encoding").is_none_or(|encoding| encoding == "base64");
            let data = &appended[reader.buffer_position() as usize..];
            data.iter().position(|byte| *byte == b'_').map(|begin| (&data[begin + 1..], base64))
        }
        _ => None,
    };
    let mut encoding = Encoding { big: false, header: 4, compressor: Compressor::None };
    let mut pieces: Vec<Piece<'_>> = Vec::new();
    let (mut section, mut open) = ("", 0_usize);
    let mut reader = Reader::from_reader(head);
    loop {
        let event = reader.read_event().map_err(|error| format!("cannot be read as XML: {error}"))?;
        let (Event::Start(tag) | Event::Empty(tag)) = &event else {
            match &event {
                Event::End(tag) if tag.name().as_ref() == b"Piece" => open = open.saturating_sub(1),
                Event::End(tag) if [&b"PointData"[..], b"Points"].contains(&tag.name().as_ref()) => {
                    section = "";
                }
                Event::Eof => break,
                _ => {}
            }
            continue;
        };
        let attribute = |name: &str| attribute(tag, name);
        match tag.name().as_ref() {
            b"VTKFile" => {
                let kind = attribute("type").unwrap_or_default();
                if !["PolyData", "UnstructuredGrid"].contains(&&*kind) {
                    let kind = input::word(&kind);
                    return Err(format!("its type is `{kind}`, but must be PolyData or UnstructuredGrid"));
                }
                encoding = Encoding {
                    big: attribute("byte_order").is_some_and(|order| order == "BigEndian"),
                    header: if attribute("header_type").is_some_and(|kind| kind == "UInt64") { 8 } else { 4 },
                    compressor: match attribute("compressor").as_deref() {
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
            b"Piece" => {
                let count = attribute("NumberOfPoints").map_or(Some(0), |count| count.parse().ok());
                let count = count.filter(|count| *count <= MOST);
                let count = count.ok_or_else(|| format!("a piece has no number of points up to {MOST}"))?;
                pieces.push(Piece { count, arrays: Vec::new() });
                open += usize::from(matches!(event, Event::Start(_)));
            }
            b"PointData" => section = "PointData",
            b"Points" => section = "Points",
            b"DataArray" if !section.is_empty() => {
                let Some(piece) = pieces.last_mut() else {
                    return Err("an array is outside of all pieces".to_owned());
                };
                let name = match section {
                    "Points" => POINTS.to_owned(),
                    _ => attribute("Name").unwrap_or_default(),
                };
                let components = attribute("NumberOfComponents");
                let components = components.map_or(1, |components| components.parse().unwrap_or(0));
                let Some(kind) = attribute("type").and_then(|kind| Kind::named(&kind)) else {
                    continue;
                };
                let at = reader.buffer_position() as usize;
                let end = head[at..].iter().position(|byte| *byte == b'<').unwrap_or(head.len() - at);
                let text = &head[at..at + end];
                let data = match attribute("format").as_deref() {
                    Some("appended") => {
                        let offset = attribute("offset").and_then(|offset| offset.parse::<usize>().ok());
                        let place = appended.zip(offset);
                        let place = place.and_then(|((data, base64), at)| Some((data.get(at..)?, base64)));
                        let (bytes, base64) = place.ok_or_else(|| {
                            format!("the array `{}` is not in the file", input::word(&name))
                        })?;
                        Data::Encoded { bytes, base64, encoding }
                    }
                    Some("binary") => Data::Encoded { bytes: text, base64: true, encoding },
                    _ => Data::Text(text),
                };
                piece.add(&name, components, kind, data);
            }
            _ => {}
        }
    }
    if open > 0 {
        return Err("a piece has no end: the file is cut off".to_owned());
    }
    Ok(pieces)
}
