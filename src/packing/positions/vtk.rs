//! Points of VTK: XML (`.vtp`, `.vtu`) and legacy files (`.vtk`), as text or binary. Arrays of several components are columns
//! `velocity:0`, `velocity:1`, ..., as `ParaView` calls them in tables; the points are `Points:0`, `Points:1`, `Points:2`.
//!
//! Lengths that a file states are compared with what is there before memory is taken.

mod array;
mod legacy;
mod xml;

use super::columns::{Alias, Columns, Dialect, KIND, Layout, Line};
use super::{Found, MOST, Placement};
use crate::input;
use array::{Array, Data, Kind};

/// Most components of an array that are read.
const COMPONENTS: usize = 9;
/// Most arrays.
const ARRAYS: usize = 1_000;
const POINTS: &str = "Points";
const EXPECTED: &str =
    "expected points of VTK with arrays such as id, diameter or radius, orientation (w, x, y, z), velocity";

#[derive(Default)]
struct Piece<'a> {
    count: usize,
    arrays: Vec<Array<'a>>,
}

impl<'a> Piece<'a> {
    /// Adds an array that may be read.
    fn add(&mut self, name: &str, components: usize, kind: Kind, data: Data<'a>) {
        if (1..=COMPONENTS).contains(&components) && self.arrays.len() < ARRAYS {
            self.arrays.push(Array { name: name.to_owned(), components, kind, data });
        }
    }
}

/// A point as a line of numbers.
struct Point<'a> {
    number: usize,
    index: usize,
    /// Numbers of the array and the component, by column.
    columns: &'a [(usize, usize)],
    /// By array its numbers, if they are read, and its components.
    values: &'a [(Vec<f64>, usize)],
}

impl Line for Point<'_> {
    fn number(&self, column: usize) -> Option<f64> {
        let (array, component) = self.columns[column];
        let (values, components) = &self.values[array];
        values.get(self.index * components + component).copied()
    }

    fn word(&self, column: usize) -> String {
        self.number(column).map_or_else(String::new, |number| number.to_string())
    }

    fn column(&self, _: usize) -> usize {
        0
    }

    fn line(&self) -> usize {
        self.number
    }
}

/// True for what begins as a file of VTK.
pub(super) fn is_vtk(bytes: &[u8]) -> bool {
    let begin = &bytes[..bytes.len().min(1024)];
    let has = |words: &[u8]| begin.windows(words.len()).any(|window| window.eq_ignore_ascii_case(words));
    has(b"# vtk datafile") || has(b"<vtkfile")
}

/// Reads the points of a file, of which there is at least one.
pub(super) fn parse(bytes: &[u8], name: &str, columns: &Columns, several: bool) -> Result<Found, String> {
    let placements = points(bytes, name, columns, several)?;
    if placements.is_empty() {
        return Err(format!("{name}: holds no points; {EXPECTED}"));
    }
    Ok(Found { placements, notes: Vec::new() })
}

/// Pieces of at most [`MOST`] points in all.
fn bounded(pieces: Vec<Piece<'_>>) -> Result<Vec<Piece<'_>>, String> {
    let count = pieces.iter().map(|piece| piece.count).fold(0, usize::saturating_add);
    if count > MOST { Err(format!("more than {MOST} points")) } else { Ok(pieces) }
}

/// Numbers of the points of a file in arrays with these names and numbers of components, piece after piece; none if one is missing.
pub(super) fn arrays(bytes: &[u8], wanted: &[(&str, usize)]) -> Result<Option<Vec<Vec<f64>>>, String> {
    let pieces = bounded(xml::pieces(bytes)?)?;
    let mut all = vec![Vec::new(); wanted.len()];
    for piece in pieces.iter().filter(|piece| piece.count > 0) {
        for ((name, components), numbers) in wanted.iter().zip(&mut all) {
            let is_it = |array: &&Array| array.name == *name && array.components == *components;
            let Some(array) = piece.arrays.iter().find(is_it) else { return Ok(None) };
            let found = array.numbers(piece.count);
            numbers.extend(found.map_err(|what| format!("the array `{name}` {what}"))?);
        }
    }
    Ok(Some(all))
}

pub(super) fn points(
    bytes: &[u8],
    name: &str,
    columns: &Columns,
    several: bool,
) -> Result<Vec<Placement>, String> {
    let is_legacy = bytes.trim_ascii_start().first() == Some(&b'#');
    let bad = |what: String| format!("{name}: {what}; {EXPECTED}");
    let pieces = if is_legacy { legacy::pieces(bytes) } else { xml::pieces(bytes) };
    let pieces = pieces.and_then(bounded).map_err(bad)?;
    let kind = Alias { name: "type", target: KIND, factor: 1.0, constant: -1.0 };
    let aliases = if several { vec![kind] } else { Vec::new() };
    let dialect = Dialect { lenient: true, aliases, ..Dialect::default() };
    let mut placements = Vec::new();
    for piece in pieces.iter().filter(|piece| piece.count > 0) {
        let (mut header, mut of_columns) = (Vec::new(), Vec::new());
        for (index, array) in piece.arrays.iter().enumerate() {
            for component in 0..array.components {
                let alone = array.components == 1;
                header.push(if alone { array.name.clone() } else { format!("{}:{component}", array.name) });
                of_columns.push((index, component));
            }
        }
        let layout = Layout::new(&header, columns, &dialect).map_err(bad)?;
        let mut values: Vec<(Vec<f64>, usize)> =
            piece.arrays.iter().map(|array| (Vec::new(), array.components)).collect();
        for (index, _) in layout.sources().map(|column| of_columns[column]) {
            if values[index].0.is_empty() {
                let array = &piece.arrays[index];
                let numbers = array.numbers(piece.count);
                values[index].0 = numbers
                    .map_err(|what| bad(format!("the array `{}` {what}", input::word(&array.name))))?;
            }
        }
        for index in 0..piece.count {
            let point = Point { number: placements.len() + 1, index, columns: &of_columns, values: &values };
            let placement = layout.placement(&point);
            placements.push(placement.map_err(|(_, what)| bad(format!("point {}: {what}", point.number)))?);
        }
    }
    Ok(placements)
}
