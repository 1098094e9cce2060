//! All that is ever printed, by one process of an MPI job. A closed pipe is no reason to fail.

use crate::comm;
use crate::error::Error;
use std::io::{self, Write};

/// Whether this process speaks for all.
pub(super) fn speaks() -> bool {
    comm::launched().is_none_or(|launched| launched.rank == 0)
}

/// A result, on standard output.
pub(super) fn say(text: &str) {
    if !speaks() {
        return;
    }
    let _ = writeln!(io::stdout(), "{}", text.trim_end());
}

/// Something to think about, on standard error.
pub(super) fn warn(text: &str) {
    if !speaks() {
        return;
    }
    let _ = writeln!(io::stderr(), "warning: {}", text.trim_end());
}

/// Why nothing came of it, on standard error.
pub(super) fn error(error: &Error) {
    if !speaks() {
        return;
    }
    let _ = writeln!(io::stderr(), "error: {}", error.to_string().trim_end());
}

/// Rows of name, value and remark, aligned.
pub(super) fn table(rows: &[[String; 3]]) -> String {
    let width = |column: usize| {
        rows.iter()
            .map(|row| row[column].chars().count())
            .max()
            .unwrap_or(0)
    };
    let (names, values) = (width(0), width(1));
    let line = |[name, value, remark]: &[String; 3]| {
        format!("  {name:names$}  {value:>values$}  {remark}")
            .trim_end()
            .to_string()
    };
    rows.iter().map(line).collect::<Vec<_>>().join("\n")
}
