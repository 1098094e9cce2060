//! A folder in which the program runs.

use super::PROGRAM;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

/// A temporary folder with a case, `case.toml`.
pub(crate) struct Place(tempfile::TempDir);

impl Place {
    pub(crate) fn new(case: &str) -> Self {
        let place = Self::empty();
        place.write("case.toml", case);
        place
    }

    /// Without a case.
    pub(crate) fn empty() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    pub(crate) fn folder(&self) -> &Path {
        self.0.path()
    }

    pub(crate) fn path(&self, name: impl AsRef<Path>) -> PathBuf {
        self.0.path().join(name)
    }

    pub(crate) fn write(&self, name: &str, text: impl AsRef<[u8]>) {
        std::fs::write(self.path(name), text).unwrap();
    }

    pub(crate) fn text(&self, name: &str) -> String {
        let path = self.path(name);
        std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
    }

    /// A JSON file.
    pub(crate) fn json(&self, name: &str) -> Value {
        serde_json::from_str(&self.text(name)).unwrap()
    }

    /// The summary of the run in a folder.
    pub(crate) fn summary(&self, out: &str) -> Value {
        self.json(&format!("{out}/summary.json"))
    }

    /// Names in the folder, in order.
    pub(crate) fn names(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.folder()).unwrap();
        let mut names: Vec<_> =
            entries.map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    /// The program itself, so that signals reach it.
    pub(crate) fn turbid(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(PROGRAM);
        command.args(arguments).current_dir(self.folder());
        command
    }

    /// The program, ended if it hangs.
    pub(crate) fn limited(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new("timeout");
        command
            .args(["--kill-after=5", "300", PROGRAM])
            .args(arguments)
            .current_dir(self.folder())
            .stdin(Stdio::null());
        command
    }

    pub(crate) fn output(&self, arguments: &[&str]) -> Output {
        self.limited(arguments).output().unwrap()
    }

    /// Runs it; it must end with this exit code. What it says, standard output first.
    pub(crate) fn ends(&self, code: i32, arguments: &[&str]) -> String {
        let output = self.output(arguments);
        let said = words(&output);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {said}");
        said
    }

    /// Runs it; it must end well. What it says.
    pub(crate) fn well(&self, arguments: &[&str]) -> String {
        self.ends(0, arguments)
    }

    /// Runs it; the words must be on standard error, the exit code 2, and the folder as it was.
    pub(crate) fn refused(&self, arguments: &[&str], words: &[&str]) {
        let before = self.names();
        let output = self.output(arguments);
        let said = String::from_utf8(output.stderr).unwrap();
        for word in words {
            assert!(said.contains(word), "{arguments:?}: `{word}` is not in\n{said}");
        }
        assert_eq!(output.status.code(), Some(2), "{arguments:?}\n{said}");
        assert_eq!(self.names(), before, "{arguments:?}");
    }
}

/// Output of a command, standard output first.
pub(crate) fn words(output: &Output) -> String {
    [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes)).concat()
}

/// Runs it; it must end well. What it says.
#[track_caller]
pub(crate) fn well(command: &mut Command) -> String {
    let output = command.stdin(Stdio::null()).output().unwrap();
    let said = words(&output);
    assert!(output.status.success(), "{command:?}: {said}");
    said
}

/// All of the words are in the text, whatever the layout.
#[track_caller]
pub(crate) fn has(text: &str, words: &[&str]) {
    for word in words {
        assert!(text.contains(word), "`{word}` is not in\n{text}");
    }
}
