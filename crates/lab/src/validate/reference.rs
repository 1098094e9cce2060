//! Tables of references: CSV with comments that say where they come from.

use csv::{ReaderBuilder, StringRecord};

/// A table that is part of this program; what it lacks is our mistake.
pub(super) struct Table {
    header: StringRecord,
    rows: Vec<StringRecord>,
}

impl Table {
    pub(super) fn new(text: &str) -> Self {
        let mut reader = ReaderBuilder::new().comment(Some(b'#')).flexible(true).from_reader(text.as_bytes());
        let header = reader.headers().expect("a table has a header").clone();
        let rows = reader.records().map(|row| row.expect("rows are CSV")).collect();
        Self { header, rows }
    }

    fn column(&self, name: &str) -> usize {
        let found = self.header.iter().position(|known| known == name);
        found.unwrap_or_else(|| panic!("the table has a column {name}"))
    }

    /// The number in a column, in the first row whose column `key` holds this word.
    pub(super) fn of(&self, key: &str, word: &str, column: &str) -> f64 {
        let (key, value) = (self.column(key), self.column(column));
        let row = self.rows.iter().find(|row| &row[key] == word);
        let row = row.unwrap_or_else(|| panic!("the table has a row {word}"));
        number(&row[value])
    }

    /// The text in a column, in the first row whose column `key` holds this word.
    pub(super) fn word(&self, key: &str, word: &str, column: &str) -> String {
        let (key, value) = (self.column(key), self.column(column));
        let row = self.rows.iter().find(|row| &row[key] == word);
        row.unwrap_or_else(|| panic!("the table has a row {word}"))[value].to_string()
    }

    /// The number in a column, in the first row whose column `key` is `at`.
    pub(super) fn at(&self, key: &str, at: f64, column: &str) -> f64 {
        let (key, value) = (self.column(key), self.column(column));
        let near = |row: &&StringRecord| (number(&row[key]) - at).abs() < 1e-9;
        let row = self.rows.iter().find(near);
        number(&row.unwrap_or_else(|| panic!("the table has a row for {at}"))[value])
    }

    /// Two columns as points, of the rows whose first column is `word` if one is given.
    pub(super) fn points(&self, word: Option<&str>, columns: [&str; 2]) -> Vec<[f64; 2]> {
        let [x, y] = columns.map(|name| self.column(name));
        let rows = self.rows.iter().filter(|row| word.is_none_or(|word| &row[0] == word));
        rows.map(|row| [number(&row[x]), number(&row[y])]).collect()
    }
}

/// The second column at a value of the first, which ascends, between two rows; NaN before the first row and after the last.
pub(super) fn interpolated<const N: usize>(rows: &[[f64; N]], at: f64) -> f64 {
    let after = rows.partition_point(|row| row[0] < at);
    if after == 0 || after == rows.len() {
        return f64::NAN;
    }
    let (one, next) = (&rows[after - 1], &rows[after]);
    one[1] + (next[1] - one[1]) * (at - one[0]) / (next[0] - one[0])
}

fn number(text: &str) -> f64 {
    text.parse().unwrap_or_else(|_| panic!("{text} is a number"))
}
