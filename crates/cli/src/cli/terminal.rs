//! Output to the terminal, by one process of an MPI job; another one prints only why it alone has failed. A closed pipe is
//! no failure; any other error of standard output is one at the end.

use indicatif::{ProgressBar, ProgressStyle};
use std::io::{self, IsTerminal, Write};
use std::process::ExitCode;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Mutex, OnceLock};
use std::thread;
use std::time::Duration;
use turbid::comm;
use turbid::error::Error;
use turbid::memory;

/// Time after which a spinner is shown, and its interval.
const MOMENT: Duration = Duration::from_secs(1);
const TICK: Duration = Duration::from_millis(100);

/// The first error of standard output.
static REFUSED: OnceLock<String> = OnceLock::new();

/// Returns true if this process prints for all.
pub(super) fn speaks() -> bool {
    comm::launched().is_none_or(|launched| launched.rank == 0)
}

/// Prints a result on standard output.
pub(super) fn say(text: &str) {
    if speaks() {
        note(writeln!(io::stdout(), "{}", text.trim_end()));
    }
}

/// Keeps the first failure to write to standard output for [`exit`].
fn note(written: io::Result<()>) {
    if let Err(error) = written
        && error.kind() != io::ErrorKind::BrokenPipe
    {
        REFUSED.get_or_init(|| error.to_string());
    }
}

/// Exits with a code, which becomes that of an error if results could not be printed.
pub(super) fn exit(code: u8) -> ExitCode {
    note(io::stdout().flush());
    let Some(why) = REFUSED.get() else {
        return ExitCode::from(code);
    };
    let _ = writeln!(io::stderr(), "error: cannot write to standard output: {why}");
    ExitCode::from(if code == 0 { 2 } else { code })
}

/// Prints progress on standard error; on a terminal below the line of the cursor.
pub(super) fn notice(text: &str) {
    if speaks() {
        let below = if io::stderr().is_terminal() { "\n" } else { "" };
        let _ = writeln!(io::stderr(), "{below}{text}");
    }
}

/// Prints a warning on standard error.
pub(super) fn warn(text: &str) {
    remark("warning", text);
}

/// Prints a remark on standard error, behind the name of its level.
pub(super) fn remark(level: &str, text: &str) {
    if speaks() {
        let _ = writeln!(io::stderr(), "{level}: {}", printable(text));
    }
}

/// Prints an error on standard error: one that all processes have agreed on once, any other by each that finds it.
pub(super) fn error(error: &Error) {
    let rank = comm::launched().map_or(0, |launched| launched.rank);
    let text = error.to_string();
    let text = printable(&text);
    let _ = match (rank, error) {
        (0, _) => writeln!(io::stderr(), "error: {text}"),
        (_, Error::Agreed { .. } | Error::OtherRank) => Ok(()),
        _ => writeln!(io::stderr(), "error: rank {rank}: {text}"),
    };
    if let Error::Kernels { log, .. } = error {
        let _ = writeln!(io::stderr(), "the compiler said:\n{}", printable(log));
    }
}

/// A text that may quote names and files of others, without control sequences.
fn printable(text: &str) -> String {
    let mut printable = String::new();
    for c in text.trim_end().chars() {
        match c {
            '\n' | '\t' => printable.push(c),
            c if c.is_control() => printable.extend(c.escape_default()),
            c => printable.push(c),
        }
    }
    printable
}

/// Prints the help, or what is wrong with the arguments, which are the same for all processes. Only the process that prints has the
/// exit code of a failure: a launcher ends the others at the first one that fails.
pub(super) fn usage(error: &clap::Error) -> ExitCode {
    if !speaks() {
        return ExitCode::SUCCESS;
    }
    let printed = error.print();
    if !error.use_stderr() {
        note(printed);
    }
    exit(u8::try_from(error.exit_code()).unwrap_or(2))
}

/// Text beside a spinner.
pub(super) struct Status(Mutex<String>);

impl Status {
    /// Changes the text, unless the spinner reads it at this moment.
    pub(super) fn set(&self, text: impl FnOnce() -> String) {
        if let Ok(mut shown) = self.0.try_lock() {
            *shown = text();
        }
    }
}

/// Does `work`, with a spinner on a terminal if it takes more than [`MOMENT`].
pub(super) fn waiting<R>(what: &str, work: impl FnOnce() -> R) -> R {
    reporting(what, |_| work())
}

/// The same, where the work changes the text beside the spinner.
pub(super) fn reporting<R>(what: &str, work: impl FnOnce(&Status) -> R) -> R {
    let status = Status(Mutex::new(what.to_string()));
    if !speaks() || !io::stderr().is_terminal() {
        return work(&status);
    }
    let (done, ended) = mpsc::channel::<()>();
    thread::scope(|scope| {
        let shown = &status;
        let spinner = move |starting| {
            drop(starting);
            let bar = ProgressBar::new_spinner();
            bar.set_style(ProgressStyle::with_template("{spinner} {msg} {elapsed}").expect("a constant"));
            while ended.recv_timeout(TICK) == Err(RecvTimeoutError::Timeout) {
                if bar.elapsed() > MOMENT {
                    let text = shown.0.lock().map_or_else(|_| String::new(), |text| text.clone());
                    bar.set_message(text);
                    bar.tick();
                }
            }
            bar.finish_and_clear();
        };
        // Without a thread there is no spinner.
        let _ = memory::start_thread(|starting| {
            thread::Builder::new().spawn_scoped(scope, move || spinner(starting))
        });
        let result = work(&status);
        drop(done);
        result
    })
}

/// Name, value and remark.
pub(super) type Row = [String; 3];

pub(super) fn row(name: impl Into<String>, value: impl Into<String>, remark: impl Into<String>) -> Row {
    [name.into(), value.into(), remark.into()]
}

/// Rows of name, value and remark, aligned.
pub(super) fn table(rows: &[Row]) -> String {
    let row = |[name, value, remark]: &Row| vec![format!("  {name}"), value.clone(), remark.clone()];
    columns(&rows.iter().map(row).collect::<Vec<_>>())
}

/// Columns, the first and the last to the left, the others to the right.
pub(super) fn columns(rows: &[Vec<String>]) -> String {
    let last = rows.iter().map(Vec::len).max().unwrap_or(1) - 1;
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..=last).map(width).collect();
    let cell = |(column, text): (usize, &String)| match column {
        0 => format!("{text:0$}", widths[0]),
        _ if column == last => text.clone(),
        _ => format!("{text:>0$}", widths[column]),
    };
    let line = |row: &Vec<String>| {
        let cells: Vec<String> = row.iter().enumerate().map(cell).collect();
        cells.join("  ").trim_end().to_string()
    };
    rows.iter().map(line).collect::<Vec<_>>().join("\n")
}
