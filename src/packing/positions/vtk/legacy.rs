//! Legacy files of VTK.

use super::array::{Data, Kind};
use super::{POINTS, Piece};
use crate::input;

struct Rest<'a> {
    bytes: &'a [u8],
    text: bool,
}

impl<'a> Rest<'a> {
    /// The next line; empty at the end.
    fn line(&mut self) -> &'a str {
        let end = self.bytes.iter().position(|byte| *byte == b'\n').map_or(self.bytes.len(), |end| end + 1);
        let (line, rest) = self.bytes.split_at(end);
        self.bytes = rest;
        std::str::from_utf8(line).unwrap_or_default().trim()
    }

    /// The words of the next line that is not empty; none at the end.
    fn words(&mut self) -> Vec<&'a str> {
        while !self.bytes.is_empty() {
            let words: Vec<&str> = self.line().split_whitespace().collect();
            if !words.is_empty() {
                return words;
            }
        }
        Vec::new()
    }

    /// Numbers of a kind.
    fn numbers(&mut self, count: usize, kind: Kind) -> Result<Data<'a>, String> {
        let short = || format!("the file ends before {count} numbers");
        if !self.text {
            let length = count.saturating_mul(kind.bytes);
            let (data, rest) = self.bytes.split_at_checked(length).ok_or_else(short)?;
            self.bytes = rest;
            return Ok(Data::Plain(data));
        }
        let begin = self.bytes;
        for _ in 0..count {
            let rest = self.bytes.trim_ascii_start();
            let end = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
            if end == 0 {
                return Err(short());
            }
            self.bytes = &rest[end..];
        }
        Ok(Data::Text(&begin[..begin.len() - self.bytes.len()]))
    }
}

/// The points of a file, as one piece.
pub(super) fn pieces(bytes: &[u8]) -> Result<Vec<Piece<'_>>, String> {
    let mut rest = Rest { bytes: bytes.trim_ascii_start(), text: true };
    // The version and the title.
    let _ = (rest.line(), rest.line());
    rest.text = match rest.line().to_ascii_uppercase().as_str() {
        "ASCII" => true,
        "BINARY" => false,
        other => return Err(format!("its third line is `{}`, not ASCII or BINARY", input::word(other))),
    };
    let int = Kind::named("int").expect("a kind");
    let mut piece = Piece::default();
    let mut of_points = false;
    loop {
        let words = rest.words();
        let number = |n: usize| -> Result<usize, String> {
            let word = words.get(n).copied().unwrap_or_default();
            word.parse().map_err(|_| format!("`{}` stands where a number should", input::word(word)))
        };
        let kind = |name: Option<&&str>| {
            let name = name.copied().unwrap_or_default();
            Kind::named(name).ok_or_else(|| format!("numbers of the type `{}`", input::word(name)))
        };
        let Some(keyword) = words.first().map(|word| word.to_ascii_uppercase()) else {
            break;
        };
        match keyword.as_str() {
            "DATASET" => match words.get(1).map(|word| word.to_ascii_uppercase()).as_deref() {
                Some("POLYDATA" | "UNSTRUCTURED_GRID") => {}
                _ => return Err("the data set is neither POLYDATA nor UNSTRUCTURED_GRID".to_owned()),
            },
            "POINTS" => {
                piece.count = number(1)?;
                let kind = kind(words.get(2))?;
                let data = rest.numbers(piece.count.saturating_mul(3), kind)?;
                piece.add(POINTS, 3, kind, data);
            }
            "VERTICES" | "LINES" | "POLYGONS" | "TRIANGLE_STRIPS" | "CELLS" => {
                let (cells, size) = (number(1)?, number(2)?);
                if rest.bytes.trim_ascii_start().starts_with(b"OFFSETS") {
                    for count in [cells, size] {
                        let kind = kind(rest.words().get(1))?;
                        rest.numbers(count, kind)?;
                    }
                } else {
                    rest.numbers(size, int)?;
                }
            }
            "CELL_TYPES" => {
                rest.numbers(number(1)?, int)?;
            }
            "METADATA" => while !rest.line().is_empty() {},
            "POINT_DATA" => of_points = number(1)? == piece.count,
            "CELL_DATA" => break,
            "FIELD" => {
                for _ in 0..number(2)? {
                    let mut words = rest.words();
                    while words.first().is_some_and(|word| word.eq_ignore_ascii_case("METADATA")) {
                        while !rest.line().is_empty() {}
                        words = rest.words();
                    }
                    let [name, components, tuples, of] = words[..] else {
                        return Err("an array of a FIELD has a name, two numbers and a type".to_owned());
                    };
                    let (components, tuples) = (components.parse::<usize>(), tuples.parse::<usize>());
                    let (Ok(components), Ok(tuples)) = (components, tuples) else {
                        return Err(format!("the array `{}` of a FIELD has no size", input::word(name)));
                    };
                    let kind = kind(Some(&of))?;
                    let data = rest.numbers(components.saturating_mul(tuples), kind)?;
                    if of_points && tuples == piece.count {
                        piece.add(name, components, kind, data);
                    }
                }
            }
            "SCALARS" | "VECTORS" | "NORMALS" | "TENSORS" if of_points => {
                let kind = kind(words.get(2))?;
                let components = match keyword.as_str() {
                    "SCALARS" => {
                        let components = if words.len() > 3 { number(3)? } else { 1 };
                        if rest.bytes.trim_ascii_start().starts_with(b"LOOKUP_TABLE") {
                            rest.words();
                        }
                        components
                    }
                    "TENSORS" => 9,
                    _ => 3,
                };
                let data = rest.numbers(piece.count.saturating_mul(components), kind)?;
                piece.add(words.get(1).copied().unwrap_or_default(), components, kind, data);
            }
            other => return Err(format!("`{}` is not known in a legacy file of points", input::word(other))),
        }
    }
    Ok(vec![piece])
}
