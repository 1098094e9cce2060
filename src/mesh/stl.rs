//! STL, text or binary: the corners of each facet.
//!
//! Text begins with `solid`, in any case, behind a byte order mark or blanks; a binary file has a length that says
//! how many facets there are, and may begin with `solid`, too. Coordinates have single precision in both. A text file
//! may hold several solids.

use super::with_newlines;
use crate::input;
use crate::math::Vec3;

const REMEDY: &str = "export the mesh again as STL, text or binary";
/// Lengths of the head of a binary file with the number of facets, and of a facet (bytes).
const HEAD: usize = 84;
const FACET: usize = 50;

/// The facets, and the first one of each solid.
pub(super) fn parse(bytes: &[u8]) -> Result<(Vec<[Vec3; 3]>, Vec<usize>), String> {
    let count = bytes.get(80..HEAD).map(le_u32);
    let length = count.map(|count| HEAD as u64 + FACET as u64 * u64::from(count));
    if length == Some(bytes.len() as u64) {
        return Ok((bytes[HEAD..].chunks_exact(FACET).map(binary_facet).collect(), vec![0]));
    }
    let begin = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start();
    if begin.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid")) && !begin.contains(&0) {
        return text(&String::from_utf8_lossy(&with_newlines(begin)));
    }
    let has = bytes.len();
    Err(match count.zip(length) {
        Some((count, length)) => format!(
            "is no STL file: it does not begin with `solid`, as text does, and has {has} bytes, while a binary file of the \
             {count} facets that it states has {length}; {REMEDY}"
        ),
        None => format!(
            "is no STL file: it does not begin with `solid`, as text does, and its {has} bytes are too few for a binary \
             file; {REMEDY}"
        ),
    })
}

fn le_u32(bytes: &[u8]) -> u32 {
    u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])
}

/// Three corners behind the normal, which is ignored.
fn binary_facet(bytes: &[u8]) -> [Vec3; 3] {
    let number = |at: usize| f64::from(f32::from_bits(le_u32(&bytes[4 * at..])));
    [3, 6, 9].map(|at| Vec3::new(number(at), number(at + 1), number(at + 2)))
}

fn text(text: &str) -> Result<(Vec<[Vec3; 3]>, Vec<usize>), String> {
    let (mut facets, mut solids) = (Vec::new(), Vec::new());
    let mut corners = Vec::new();
    let mut ended = false;
    for (line, number) in text.lines().zip(1..) {
        let bad = |what: &str| format!("facet {} cannot be read, line {number}: {what}", facets.len());
        let mut words = line.split_whitespace();
        let Some(keyword) = words.next().map(str::to_ascii_lowercase) else {
            continue;
        };
        match keyword.as_str() {
            "vertex" => {
                let corner = words.map(coordinate).collect::<Result<Vec<f64>, _>>();
                let corner: [f64; 3] = corner
                    .and_then(|corner| {
                        corner.try_into().map_err(|_| "a vertex has three numbers".to_string())
                    })
                    .map_err(|what| bad(&what))?;
                corners.push(Vec3::from(corner));
            }
            "endfacet" => {
                let facet = std::mem::take(&mut corners).try_into();
                let facet =
                    facet.map_err(|_| bad("a facet has three lines `vertex x y z`; triangulate the mesh"))?;
                facets.push(facet);
            }
            "facet" | "outer" | "endloop" => {}
            "solid" => solids.push(facets.len()),
            "endsolid" => ended = true,
            other => {
                return Err(bad(&format!("`{}` is no word of a text STL; {REMEDY}", input::word(other))));
            }
        }
    }
    if !corners.is_empty() || !ended {
        return Err(format!(
            "facet {} cannot be read: the text ends before `endsolid`; {REMEDY}",
            facets.len()
        ));
    }
    Ok((facets, solids))
}

fn coordinate(word: &str) -> Result<f64, String> {
    let number: Result<f32, _> = word.parse();
    number.map(f64::from).map_err(|_| {
        let remedy = match word.replacen(',', ".", 1).parse::<f32>() {
            Ok(_) if word.contains(',') => "decimal commas must be points",
            _ => REMEDY,
        };
        format!("`{}` is not a number; {remedy}", input::word(word))
    })
}
