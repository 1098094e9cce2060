//! Files `.xyz`: the number of particles, a comment, and lines `element x y z`; the last frame of several counts.
//!
//! A comment with `Properties=species:S:1:pos:R:3:radius:R:1` (extended XYZ) names the columns; without it those behind `z` are called by
//! their numbers, `5`, `6`, ...

use super::columns::{Columns, Dialect, Layout};
use super::table::{self, TextLine, words};
use super::{Found, MOST};
use crate::input;

const EXPECTED: &str = "expected the number of particles, a line of comment, and lines of `element x y z` (metres) with further columns";

/// Reads the last frame.
pub(super) fn parse(text: &str, name: &str, columns: &Columns) -> Result<Found, String> {
    let mut lines = text.lines().zip(1..);
    let (mut frames, mut last) = (0, None);
    while let Some((first, number)) = lines.next() {
        let first = first.trim();
        if first.is_empty() {
            continue;
        }
        let count = first.parse().ok().filter(|count| *count <= MOST);
        let Some(count) = count else {
            return Err(format!(
                "{name}:{number}: the number of particles is `{}`, expected a whole number up to {MOST}; {EXPECTED}",
                input::word(first)
            ));
        };
        let comment = lines.next().map_or("", |(line, _)| line);
        let rows = lines.clone();
        let has = lines.by_ref().take(count).count();
        if has < count {
            return Err(format!(
                "{name}:{number}: {count} particles, but only {has} lines of them; {EXPECTED}"
            ));
        }
        last = Some((number, comment, rows.take(count)));
        frames += 1;
    }
    let frame = last.and_then(|(number, comment, rows)| {
        let (row, _) = rows.clone().next()?;
        Some((number, comment, rows, words(row).len()))
    });
    let Some((number, comment, rows, count)) = frame else {
        return Err(format!("{name}: holds no particles; {EXPECTED}"));
    };
    let header = properties(comment).unwrap_or_else(|| {
        let first = ["element", "x", "y", "z"].map(str::to_owned).into_iter();
        first.chain((5..=count).map(|column| column.to_string())).collect()
    });
    let dialect = Dialect { lenient: true, ..Dialect::default() };
    let layout = Layout::new(&header, columns, &dialect)
        .map_err(|e| format!("{name}:{}: {e}; {EXPECTED}", number + 1))?;
    let placements = rows.map(|(row, line)| {
        table::placement(&layout, &TextLine { line, fields: &words(row) }, (name, EXPECTED))
    });
    let placements = placements.collect::<Result<_, _>>()?;
    let notes =
        (frames > 1).then(|| format!("of {frames} frames the last one is read")).into_iter().collect();
    Ok(Found { placements, notes })
}

/// The columns that a comment of extended XYZ names.
fn properties(comment: &str) -> Option<Vec<String>> {
    let (_, rest) = comment.split_once("Properties=")?;
    let list = rest.trim_start_matches('"').split(|c: char| c.is_whitespace() || c == '"').next()?;
    let parts: Vec<&str> = list.split(':').collect();
    let mut names = Vec::new();
    for property in parts.chunks(3) {
        let [name, _, count] = property else {
            return None;
        };
        let count: usize = count.parse().ok().filter(|count| *count < 100)?;
        let xyz = |prefix: &str| ["x", "y", "z"].map(|axis| format!("{prefix}{axis}"));
        match (name.to_lowercase().as_str(), count) {
            ("pos", 3) => names.extend(xyz("")),
            ("velo" | "vel" | "velocities" | "velocity", 3) => names.extend(xyz("v")),
            (name, 1) => names.push(name.to_owned()),
            (name, _) => names.extend((0..count).map(|n| format!("{name}:{n}"))),
        }
    }
    Some(names)
}
