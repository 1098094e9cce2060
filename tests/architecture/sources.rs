//! The sources of the crates of this repository, token by token, and the modules that they name.

use super::MAY_USE;
use proc_macro2::{Delimiter, TokenStream, TokenTree};
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// A crate: its folder, its name in paths, and the one row that it is in the table; without, its modules are rows.
pub(crate) struct Crate(&'static str, &'static str, Option<&'static str>);

/// All crates; a folder that is not there is passed over.
const CRATES: [Crate; 9] = [
    Crate("src", "turbid", None),
    Crate("crates/cli/src", "turbid_cli", None),
    Crate("crates/lab/src", "turbid_lab", None),
    Crate("crates/core/src", "turbid_core", None),
    Crate("crates/input/src", "turbid_input", None),
    Crate("crates/plot/src", "turbid_plot", Some("plot")),
    Crate("ffi/process/src", "turbid_process", Some("process")),
    Crate("ffi/lammps/src", "turbid_lammps", Some("lammps")),
    Crate("ffi/liggghts/src", "turbid_liggghts", Some("liggghts")),
];

/// Names that a `lib.rs` re-exports, and from where.
const ROOT_NAMES: &[(&str, &str)] = &[("Error", "error"), ("Result", "error")];

/// A file, with its comments gone.
pub(crate) struct Source {
    /// Below the repository, with slashes.
    pub(crate) path: String,
    /// Row of the table that it belongs to.
    pub(crate) module: String,
    pub(crate) tokens: TokenStream,
    /// Depth of its items below the root of the crate.
    depth: usize,
    /// True if paths within its crate name rows of the table.
    has_rows: bool,
}

impl Source {
    fn new(of: &Crate, below: &str, text: &str) -> Self {
        let names: Vec<&str> = below.trim_end_matches(".rs").split('/').collect();
        let path = format!("{}/{below}", of.0);
        let tokens = text.parse().unwrap_or_else(|e| panic!("{path}: {e}"));
        let is_root = matches!(names[0], "lib" | "main");
        let is_mod = names.last() == Some(&"mod");
        Self {
            module: of.2.unwrap_or(names[0]).to_owned(),
            depth: if is_root { 0 } else { names.len() - usize::from(is_mod) },
            has_rows: of.2.is_none(),
            tokens,
            path,
        }
    }

    pub(crate) fn is_test(&self) -> bool {
        self.path.ends_with("tests.rs")
    }

    /// True if it is this module, or in it: `simulation/references`.
    pub(crate) fn is_in(&self, module: &str) -> bool {
        let (_, below) = self.path.split_once("src/").unwrap();
        let rest = below.strip_prefix(module);
        rest.is_some_and(|rest| rest.starts_with('/') || rest == ".rs")
    }

    /// Rows of the table that it names; tests may put together what they like.
    pub(crate) fn uses(&self) -> BTreeSet<String> {
        let mut used = BTreeSet::new();
        if !self.is_test() {
            self.search(self.tokens.clone(), self.depth, &mut used);
        }
        used
    }

    /// Looks for the beginnings of paths in code that lies `depth` below the root.
    fn search(&self, tokens: TokenStream, depth: usize, used: &mut BTreeSet<String>) {
        let tokens: Vec<TokenTree> = tokens.into_iter().collect();
        let mut at = 0;
        while at < tokens.len() {
            let after_path = at > 0 && is_mark(&tokens, at - 1, ':');
            let starts = !after_path && is_mark(&tokens, at + 1, ':') && is_mark(&tokens, at + 2, ':');
            let renamed = at > 0 && is(&tokens, at - 1, "use") && is(&tokens, at + 1, "as");
            let named = (CRATES.iter()).find(|other| (starts || renamed) && is(&tokens, at, other.1));
            if let Some(&Crate(_, _, Some(row))) = named {
                used.insert(row.to_owned());
                at += 1;
            } else if (starts && named.is_some()) || (starts && self.has_rows && is(&tokens, at, "crate")) {
                at = self.follow(&tokens, at + 3, 0, used);
            } else if starts && self.has_rows && is(&tokens, at, "super") {
                at = self.follow(&tokens, at, depth, used);
            } else if let TokenTree::Group(group) = &tokens[at] {
                let named_module =
                    at >= 2 && is(&tokens, at - 2, "mod") && group.delimiter() == Delimiter::Brace;
                if !(named_module && is(&tokens, at - 1, "tests")) {
                    self.search(group.stream(), depth + usize::from(named_module), used);
                }
                at += 1;
            } else {
                at += 1;
            }
        }
    }

    /// Follows a path from the module `level` below the root, down to the name of a row of the table if it gets there. Returns where
    /// it ends.
    fn follow(
        &self,
        tokens: &[TokenTree],
        mut at: usize,
        mut level: usize,
        used: &mut BTreeSet<String>,
    ) -> usize {
        while is(tokens, at, "super") {
            level = level.checked_sub(1).expect("code that compiles");
            at += 3;
        }
        if let Some(TokenTree::Group(group)) = tokens.get(at) {
            let inside: Vec<TokenTree> = group.stream().into_iter().collect();
            let comma = |token: &TokenTree| matches!(token, TokenTree::Punct(mark) if mark.as_char() == ',');
            for branch in inside.split(comma) {
                self.follow(branch, 0, level, used);
            }
        } else if level == 0 && at < tokens.len() {
            let name = tokens[at].to_string();
            let root = ROOT_NAMES.iter().find(|(root, _)| *root == name);
            let row = root.map_or(name.as_str(), |(_, module)| module);
            assert!(
                MAY_USE.iter().any(|(module, _)| *module == row),
                "{}: `crate::{name}` is no module; name the one it is from",
                self.path
            );
            used.insert(row.to_owned());
        }
        at + 1
    }
}

pub(crate) fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
}

/// All files of all crates.
pub(crate) fn sources() -> Vec<Source> {
    let mut found = Vec::new();
    for of in &CRATES {
        let src = root().join(of.0);
        let mut open = vec![src.clone()];
        while let Some(folder) = open.pop() {
            let entries = fs::read_dir(folder).into_iter().flatten();
            let entries = entries.map(|entry| entry.unwrap().path());
            let (folders, files): (Vec<PathBuf>, Vec<PathBuf>) = entries.partition(|path| path.is_dir());
            open.extend(folders);
            for file in files.iter().filter(|file| file.extension().is_some_and(|e| e == "rs")) {
                let parts = file.strip_prefix(&src).unwrap().iter();
                let below: Vec<_> = parts.map(|part| part.to_string_lossy()).collect();
                found.push(Source::new(of, &below.join("/"), &fs::read_to_string(file).unwrap()));
            }
        }
    }
    assert!(found.len() > 50, "sources have gone missing");
    found
}

/// Calls `look(tokens, at)` at every token, however deep, but for the modules `tests`.
pub(crate) fn visit(tokens: TokenStream, look: &mut impl FnMut(&[TokenTree], usize)) {
    let tokens: Vec<TokenTree> = tokens.into_iter().collect();
    for at in 0..tokens.len() {
        if at >= 2 && is(&tokens, at - 2, "mod") && is(&tokens, at - 1, "tests") {
            continue;
        }
        look(&tokens, at);
        if let TokenTree::Group(group) = &tokens[at] {
            visit(group.stream(), look);
        }
    }
}

pub(crate) fn is(tokens: &[TokenTree], at: usize, name: &str) -> bool {
    matches!(tokens.get(at), Some(TokenTree::Ident(ident)) if ident == name)
}

pub(crate) fn is_mark(tokens: &[TokenTree], at: usize, mark: char) -> bool {
    matches!(tokens.get(at), Some(TokenTree::Punct(punct)) if punct.as_char() == mark)
}

#[test]
fn paths_are_found_however_they_are_written() {
    let found = |path: &str, text: &str| {
        let file = Source::new(&CRATES[0], path, text);
        file.uses().into_iter().collect::<Vec<_>>().join(" ")
    };
    assert_eq!(found("fluid.rs", "use crate::{comm::Comm, math::{self, Vec3}};"), "comm math");
    assert_eq!(found("fluid.rs", "fn f() { crate::dem::step(super::case::load()) }"), "case dem");
    assert_eq!(found("fluid/halo.rs", "use super::{layout, super::dem};"), "dem");
    assert_eq!(found("fluid/halo.rs", "use super::super::{dem, case};"), "case dem");
    assert_eq!(found("fluid/halo.rs", "use super::layout; mod a { use super::super::b; }"), "");
    assert_eq!(found("fluid.rs", "mod more { use super::*; use super::super::dem; }"), "dem");
    assert_eq!(found("fluid.rs", "mod tests { use super::super::dem; }"), "");
    assert_eq!(found("dem.rs", "macro_rules! m { () => { $crate::fluid::go() } }"), "fluid");
    assert_eq!(found("dem.rs", "pub(crate) fn f() -> crate::Result<()> {}"), "error");
    assert_eq!(
        found("dem.rs", "/// [`crate::fluid`]\nconst A: &str = \"crate::fluid\"; // crate::fluid"),
        ""
    );
    assert_eq!(found("main.rs", "fn main() { turbid_cli::cli::main() }"), "cli");
    assert_eq!(
        found("case.rs", "use turbid_core::{fluid, math::Vec3}; fn f() { turbid_core::Error::x() }"),
        "error fluid math"
    );
    assert_eq!(found("engine.rs", "pub use turbid_liggghts as lgg;"), "liggghts");
    let plot = CRATES.iter().find(|of| of.1 == "turbid_plot").unwrap();
    let whole = Source::new(plot, "axis.rs", "use crate::page; use super::fonts; use turbid_core::math;");
    assert_eq!((whole.module.as_str(), whole.uses().len()), ("plot", 1));
    let glob = std::panic::catch_unwind(|| found("dem.rs", "use crate::*;"));
    assert!(glob.is_err(), "a glob of the root names everything");
}
