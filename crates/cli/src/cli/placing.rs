//! Dense packings: how far they are, and a file from which `turbid pack` continues.

use super::progress::LINE_INTERVAL;
use super::terminal::{Status, notice};
use std::io::{self, IsTerminal};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use turbid::output::write_bytes;
use turbid::packing::progress::{Follow, State};

/// Time between states that are written.
const WRITTEN_EVERY: Duration = Duration::from_secs(20);

/// A follower of the packing of a case.
pub(super) struct Packing<'a> {
    status: &'a Status,
    /// File of the state.
    part: Option<&'a Path>,
    written: Option<Instant>,
    /// Time of the last plain line; none if there are to be none.
    line: Option<Instant>,
    /// Notes for the user at the end.
    pub(super) notes: Vec<String>,
}

impl<'a> Packing<'a> {
    pub(super) fn new(status: &'a Status, part: Option<&'a Path>) -> Self {
        Self { status, part, written: None, line: part.map(|_| Instant::now()), notes: Vec::new() }
    }

    /// Writes the state, or notes why that failed: no reason to end.
    fn write(&mut self, part: &Path, state: &State) {
        let text = serde_json::to_vec(state).expect("a state is plain JSON");
        if let Err(error) = write_bytes(part, &text) {
            self.notes.push(format!("{error}: this packing could not be continued"));
            self.part = None;
        }
        self.written = Some(Instant::now());
    }
}

/// Name of the file in which the state of a packing is kept that will be written to `out`.
pub(super) fn part_of(out: &Path) -> PathBuf {
    let mut name = out.as_os_str().to_owned();
    name.push(".part");
    name.into()
}

/// The state in a file, unless there is no file or it holds something else.
fn read(part: &Path) -> Option<State> {
    serde_json::from_slice(&std::fs::read(part).ok()?).ok()
}

/// Removes the state of a packing that has ended.
pub(super) fn remove(part: &Path) {
    if read(part).is_some() {
        let _ = std::fs::remove_file(part);
    }
}

impl Follow for Packing<'_> {
    fn kept(&mut self, mark: u64) -> Option<State> {
        let part = self.part?;
        let Some(state) = read(part) else {
            if part.exists() {
                self.notes
                    .push(format!("{} is no state of a packing, and was left as it is", part.display()));
                self.part = None;
            }
            return None;
        };
        let continues = state.mark == mark;
        self.notes.push(if continues {
            format!("continues from round {} of an earlier attempt, in {}", state.rounds, part.display())
        } else {
            format!("{} was of another packing: began anew", part.display())
        });
        continues.then_some(state)
    }

    fn round(&mut self, rounds: usize, overlaps: usize, state: &dyn Fn() -> State) {
        let text = || format!("packing densely: round {rounds}, {overlaps} overlaps left");
        self.status.set(text);
        if !io::stderr().is_terminal() && self.line.is_some_and(|last| last.elapsed() > LINE_INTERVAL) {
            self.line = Some(Instant::now());
            notice(&text());
        }
        if let Some(part) = self.part
            && self.written.is_none_or(|written| written.elapsed() > WRITTEN_EVERY)
        {
            self.write(part, &state());
        }
    }
}
