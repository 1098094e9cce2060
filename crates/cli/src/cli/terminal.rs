//! All that is ever printed, by one process of an MPI job; another one prints only why it alone has failed. A closed pipe is
//! no reason to fail: who reads has seen enough. Anything else that standard output does not take is an error at the end.

use indicatif::{ProgressBar, ProgressStyle};
use std::io::{self, IsTerminal, Write};
use std::process::ExitCode;
use std::sync::OnceLock;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::Duration;
use turbid::comm;
use turbid::error::Error;

/// After this long, what is being waited for is shown, and this often.
const MOMENT: Duration = Duration::from_secs(1);
const TICK: Duration = Duration::from_millis(100);

/// Why standard output has not taken something, the first time.
static REFUSED: OnceLock<String> = OnceLock::new();

/// Whether this process speaks for all.
pub(super) fn speaks() -> bool {
    comm::launched().is_none_or(|launched| launched.rank == 0)
}

/// A result, on standard output.
pub(super) fn say(text: &str) {
    if !speaks() {
        return;
    }
    note(writeln!(io::stdout(), "{}", text.trim_end()));
}

/// Keeps the first failure to write to standard output for [`exit`].
fn note(written: io::Result<()>) {
    if let Err(error) = written
        && error.kind() != io::ErrorKind::BrokenPipe
    {
        REFUSED.get_or_init(|| error.to_string());
    }
}

/// The exit of the program with a code, which becomes that of an error if results could not be printed.
pub(super) fn exit(code: u8) -> ExitCode {
    note(io::stdout().flush());
    let Some(why) = REFUSED.get() else {
        return ExitCode::from(code);
    };
    let _ = writeln!(io::stderr(), "error: cannot write to standard output: {why}");
    ExitCode::from(if code == 0 { 2 } else { code })
}

/// What goes on, on standard error; on a terminal below the line that the cursor is in.
pub(super) fn notice(text: &str) {
    if speaks() {
        let below = if io::stderr().is_terminal() { "\n" } else { "" };
        let _ = writeln!(io::stderr(), "{below}{text}");
    }
}

/// Something to think about, on standard error.
pub(super) fn warn(text: &str) {
    if !speaks() {
        return;
    }
    let _ = writeln!(io::stderr(), "warning: {}", printable(text));
}

/// Why nothing came of it, on standard error. What all processes have agreed on is said by one, all else by each that finds it.
pub(super) fn error(error: &Error) {
    let rank = comm::launched().map_or(0, |launched| launched.rank);
    let text = error.to_string();
    let text = printable(&text);
    let _ = match (rank, error) {
        (0, _) => writeln!(io::stderr(), "error: {text}"),
        (_, Error::Agreed { .. } | Error::OtherRank) => Ok(()),
        _ => writeln!(io::stderr(), "error: rank {rank}: {text}"),
    };
}

/// A text that may quote names and files of others: nothing in it commands the terminal.
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

/// What is wrong with the arguments, which are the same for all processes, or the help that they ask for. The process that
/// says it also has the exit code: a launcher ends the others at the first one that fails, before it may have spoken.
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

/// Does `work`, with a sign of life on a terminal if it takes more than a moment.
pub(super) fn waiting<R>(what: &'static str, work: impl FnOnce() -> R) -> R {
    if !speaks() || !io::stderr().is_terminal() {
        return work();
    }
    let (done, ended) = mpsc::channel::<()>();
    thread::scope(|scope| {
        let spinner = move || {
            let bar = ProgressBar::new_spinner();
            bar.set_style(ProgressStyle::with_template("{spinner} {msg} {elapsed}").expect("a constant"));
            bar.set_message(what);
            while ended.recv_timeout(TICK) == Err(RecvTimeoutError::Timeout) {
                if bar.elapsed() > MOMENT {
                    bar.tick();
                }
            }
            bar.finish_and_clear();
        };
        // Where there is no thread to be had for it, there is no sign of life.
        let _ = thread::Builder::new().spawn_scoped(scope, spinner);
        let result = work();
        drop(done);
        result
    })
}

/// Rows of name, value and remark, aligned.
pub(super) fn table(rows: &[[String; 3]]) -> String {
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let (names, values) = (width(0), width(1));
    let line = |[name, value, remark]: &[String; 3]| {
        format!("  {name:names$}  {value:>values$}  {remark}").trim_end().to_string()
    };
    rows.iter().map(line).collect::<Vec<_>>().join("\n")
}
