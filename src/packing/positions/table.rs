//! Lines of numbers between semicolons, commas, tabs or blanks, and rows of text of any kind of file.

use super::columns::{Columns, Dialect, Layout, Line, unquoted};
use super::{Found, MOST, Placement};
use crate::input;

const EXPECTED: &str = "expected lines of x;y;z;rx;ry;rz;id or x;y;z (metres, degrees), or a table whose header names x, y, z and \
                        optionally rx, ry, rz or qx, qy, qz, qw, id, kind, diameter or radius, vx, vy, vz, wx, wy, wz, with units \
                        as in x [mm], between semicolons, commas, tabs or blanks";
/// Columns of a file without a header: with angles and id, or positions alone.
const HEADERLESS: [usize; 2] = [7, 3];

/// Most fields of a line that are looked at.
const FIELDS: usize = 1_024;

/// A field of a line, and its position in the line (characters, from 1).
type Field<'a> = (usize, &'a str);

pub(super) struct TextLine<'a> {
    pub(super) line: usize,
    pub(super) fields: &'a [Field<'a>],
}

impl Line for TextLine<'_> {
    fn number(&self, column: usize) -> Option<f64> {
        unquoted(self.fields[column].1).parse().ok()
    }

    fn word(&self, column: usize) -> String {
        input::word(unquoted(self.fields[column].1))
    }

    fn column(&self, column: usize) -> usize {
        self.fields[column].0
    }

    fn line(&self) -> usize {
        self.line
    }
}

/// The particle of a line of text; the error has `name:line:column`, the word found and what was expected.
pub(super) fn placement(
    layout: &Layout,
    line: &TextLine<'_>,
    (name, expected): (&str, &str),
) -> Result<Placement, String> {
    let (number, found, wanted) = (line.line, line.fields.len(), layout.fields);
    if found != wanted {
        let fields = if found == 1 { "field" } else { "fields" };
        return Err(format!("{name}:{number}: {found} {fields} instead of {wanted}; {expected}"));
    }
    layout.placement(line).map_err(|(column, what)| match column {
        0 => format!("{name}:{number}: {what}"),
        _ => format!("{name}:{number}:{column}: {what}; {expected}"),
    })
}

/// Fields between blanks.
pub(super) fn words(line: &str) -> Vec<Field<'_>> {
    split(line, None)
}

/// Fields between delimiters that are not in quotes; without a delimiter between blanks.
fn split(line: &str, delimiter: Option<char>) -> Vec<Field<'_>> {
    let (mut fields, mut quote) = (Vec::new(), None);
    // Byte and character where a field begins.
    let mut begin = delimiter.map(|_| (0, 1));
    let mut column = 0;
    for (at, c) in line.char_indices() {
        column += 1;
        if fields.len() > FIELDS {
            return fields;
        }
        let ends = quote.is_none() && delimiter.map_or(c.is_whitespace(), |delimiter| c == delimiter);
        match (quote, c) {
            (Some(open), _) if open == c => quote = None,
            (None, '"' | '\'') => quote = Some(c),
            _ => {}
        }
        if ends {
            fields.extend(begin.map(|(from, column)| (column, &line[from..at])));
            begin = delimiter.map(|_| (at + c.len_utf8(), column + 1));
        } else if begin.is_none() {
            begin = Some((at, column));
        }
    }
    fields.extend(begin.map(|(from, column)| (column, &line[from..])));
    fields
}

/// The separator of the fields of a line.
fn delimiter(line: &str) -> Option<char> {
    let is = |&delimiter: &char| line.contains(delimiter) && split(line, Some(delimiter)).len() > 1;
    [';', ',', '\t'].into_iter().find(is)
}

/// The fields of a header; between blanks a unit belongs to the name before it.
fn header(line: &str) -> Vec<Field<'_>> {
    let delimiter = delimiter(line);
    let fields = split(line, delimiter);
    if delimiter.is_some() {
        return fields;
    }
    let mut joined: Vec<Field<'_>> = Vec::new();
    for (column, field) in fields {
        match joined.last_mut() {
            Some((_, last)) if field.starts_with(['[', '(']) => {
                let from = last.as_ptr() as usize - line.as_ptr() as usize;
                let to = field.as_ptr() as usize - line.as_ptr() as usize + field.len();
                *last = &line[from..to];
            }
            _ => joined.push((column, field)),
        }
    }
    joined
}

pub(super) fn parse(text: &str, name: &str, columns: &Columns) -> Result<Found, String> {
    let mut layout: Option<Layout> = None;
    let mut comment = None;
    let mut placements = Vec::new();
    let of_header = |line: &str| {
        let fields: Vec<&str> = header(line).into_iter().map(|(_, field)| field).collect();
        Layout::new(&fields, columns, &Dialect::default())
    };
    for (raw, number) in text.lines().zip(1..) {
        let trimmed = raw.trim_start();
        if trimmed.is_empty() {
            continue;
        }
        if let Some(words) = trimmed.strip_prefix('#') {
            comment = Some(words);
            continue;
        }
        let fields = split(raw, delimiter(raw));
        let line = TextLine { line: number, fields: &fields };
        if layout.is_none() && (0..fields.len()).all(|n| line.number(n).is_none()) {
            let found = of_header(raw);
            layout = Some(found.map_err(|e| format!("{name}:{number}: {e}; {EXPECTED}"))?);
            continue;
        }
        if layout.is_none() {
            // numpy writes the header as a comment.
            let named = comment.and_then(|words| of_header(words).ok());
            let named = named.filter(|layout| layout.fields == fields.len());
            if named.is_none() && !columns.0.is_empty() {
                return Err(format!(
                    "{name}:{number}: there is no header with the columns that `columns` of the case names; {EXPECTED}"
                ));
            }
            let count = HEADERLESS.into_iter().find(|&count| count == fields.len());
            layout = named.or_else(|| Some(Layout::first(count.unwrap_or(HEADERLESS[0]))));
        }
        let known = layout.as_ref().expect("found above");
        placements.push(placement(known, &line, (name, EXPECTED))?);
        if placements.len() > MOST {
            return Err(format!("{name}:{number}: more than {MOST} particles"));
        }
    }
    if placements.is_empty() {
        return Err(format!("{name}: holds no particles; {EXPECTED}"));
    }
    Ok(Found { placements, notes: Vec::new() })
}
