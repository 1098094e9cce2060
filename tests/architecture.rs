//! Who may use whom: the table of ARCHITECTURE.md, held against every path that the code names.

use proc_macro2::{Delimiter, TokenStream, TokenTree};
use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

/// Every module and the modules it may use, which all stand below it: no arrow points up, so there is no cycle.
const MAY_USE: &[(&str, &str)] = &[
    ("main", "cli"),
    (
        "cli",
        "validate report study crosscheck simulation case output packing fluid dem contact particle comm memory error",
    ),
    (
        "validate",
        "crosscheck simulation case output checkpoint coupling fluid dem contact particle shape domain comm math input error",
    ),
    ("report", "study simulation output input error"),
    ("study", "simulation case output checkpoint comm math input error"),
    (
        "crosscheck",
        "simulation case output dem contact particle shape wall domain comm units math error",
    ),
    (
        "simulation",
        "case output checkpoint coupling fluid dem contact particle shape wall lattice domain comm units math timing memory error",
    ),
    (
        "case",
        "packing coupling fluid dem contact particle shape wall domain units math input memory error",
    ),
    ("output", "checkpoint particle shape wall domain math input error"),
    ("packing", "contact particle shape wall domain math input"),
    ("checkpoint", "domain comm input memory error"),
    (
        "coupling",
        "fluid dem particle shape wall lattice domain comm units math",
    ),
    ("fluid", "lattice domain comm math memory error"),
    ("dem", "contact particle shape wall domain comm math error"),
    ("contact", "shape wall domain math"),
    ("particle", "shape math"),
    ("shape", "math input"),
    ("wall", "math"),
    ("lattice", ""),
    ("domain", "math"),
    ("comm", "memory error"),
    ("units", ""),
    ("math", ""),
    ("timing", ""),
    ("input", ""),
    ("memory", "error"),
    ("error", ""),
];

/// What `lib.rs` re-exports, and from where.
const ROOT_NAMES: &[(&str, &str)] = &[("Error", "error"), ("Result", "error")];

/// Modules whose numbers become part of the state of a run.
const STATE: &str = "case packing coupling fluid dem contact particle shape wall lattice domain units math";

/// Methods of numbers that the system or the processor rounds as it likes.
const INEXACT: &str = "sin cos tan sin_cos asin acos atan atan2 sinh cosh tanh exp exp2 exp_m1 ln ln_1p log log2 log10 \
                       powf cbrt hypot mul_add";

/// Modules that describe charts or pictures.
const MAY_DRAW: &[&str] = &["output", "crosscheck", "study", "report", "validate"];

/// Who may write to the terminal.
const MAY_PRINT: &[&str] = &["cli", "output/progress.rs"];

#[test]
fn modules_use_only_what_the_table_allows() {
    let mut wrong = String::new();
    for file in sources() {
        let Some((_, allowed)) = MAY_USE.iter().find(|(module, _)| *module == file.module) else {
            continue; // lib.rs, or a module that the next test complains of
        };
        let allowed: BTreeSet<&str> = allowed.split_whitespace().collect();
        for used in uses(&file) {
            if used != file.module && !allowed.contains(used.as_str()) {
                let _ = writeln!(
                    wrong,
                    "src/{}: `{}` must not use `{used}`",
                    file.path, file.module
                );
            }
        }
    }
    assert!(wrong.is_empty(), "\n{wrong}");
}

#[test]
fn every_module_stands_in_the_table_and_the_table_names_no_other() {
    let there: BTreeSet<String> = sources().into_iter().map(|file| file.module).collect();
    let known: BTreeSet<String> = MAY_USE.iter().map(|(module, _)| (*module).to_owned()).collect();
    let missing: Vec<_> = there
        .difference(&known)
        .filter(|module| *module != "lib")
        .collect();
    assert!(missing.is_empty(), "where do {missing:?} belong?");
    let gone: Vec<_> = known.difference(&there).collect();
    assert!(gone.is_empty(), "the table names {gone:?}, which are not there");
}

#[test]
fn arrows_point_down_the_table() {
    for (row, (module, allowed)) in MAY_USE.iter().enumerate() {
        for used in allowed.split_whitespace() {
            let below = MAY_USE[row + 1..].iter().any(|(other, _)| *other == used);
            assert!(below, "`{module}` -> `{used}` points up, or nowhere");
        }
    }
}

#[test]
fn fluid_and_dem_do_not_know_each_other() {
    for (a, b) in [("fluid", "dem"), ("dem", "fluid")] {
        let (_, allowed) = MAY_USE.iter().find(|(module, _)| *module == a).unwrap();
        assert!(allowed.split_whitespace().all(|used| used != b));
    }
}

#[test]
fn the_table_of_architecture_md_is_this_one() {
    let text = fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap();
    let stated: Vec<(String, String)> = text
        .lines()
        .skip_while(|line| !line.starts_with("| module | may use |"))
        .skip(2)
        .take_while(|line| line.starts_with('|'))
        .map(|line| {
            let mut cells = line.split('|').skip(1).map(|cell| cell.trim().replace('`', ""));
            (cells.next().unwrap_or_default(), cells.next().unwrap_or_default())
        })
        .collect();
    let here: Vec<(String, String)> = MAY_USE
        .iter()
        .map(|(module, allowed)| ((*module).to_owned(), (*allowed).to_owned()))
        .collect();
    assert_eq!(stated, here);
}

#[test]
fn the_step_in_architecture_md_is_the_one_of_the_code() {
    let squeezed = |text: &str| text.split_whitespace().collect::<String>();
    let text = fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap();
    let quoted = text
        .split("```rust\n")
        .nth(1)
        .and_then(|rest| rest.split("```").next());
    let code = fs::read_to_string(root().join("src/simulation.rs")).unwrap();
    let step = squeezed(quoted.expect("a quotation"));
    assert!(
        squeezed(&code).contains(&step),
        "out of date: src/simulation.rs has another step"
    );
}

#[test]
fn only_the_command_line_and_the_progress_write_to_the_terminal() {
    let mut wrong = String::new();
    for file in sources() {
        // What tests print is captured.
        let is_test = file.path.ends_with("tests.rs");
        if is_test
            || MAY_PRINT
                .iter()
                .any(|who| *who == file.module || *who == file.path)
        {
            continue;
        }
        visit(file.tokens.clone(), &mut |tokens, at| {
            let macros = ["print", "println", "eprint", "eprintln", "dbg"];
            let prints = macros.iter().any(|name| is(tokens, at, name)) && is_mark(tokens, at + 1, '!');
            // `.stdout(...)` is where a child process writes to.
            let opens = ["stdout", "stderr"].iter().any(|name| is(tokens, at, name))
                && !(at > 0 && is_mark(tokens, at - 1, '.'))
                && matches!(&tokens.get(at + 1), Some(TokenTree::Group(_)));
            if prints || opens {
                let _ = writeln!(wrong, "src/{}: {}", file.path, tokens[at]);
            }
        });
    }
    assert!(wrong.is_empty(), "\n{wrong}");
}

#[test]
fn what_feeds_the_state_is_rounded_alike_on_every_machine() {
    let state: BTreeSet<&str> = STATE.split_whitespace().collect();
    let inexact: BTreeSet<&str> = INEXACT.split_whitespace().collect();
    let mut wrong = String::new();
    for file in sources() {
        if !state.contains(file.module.as_str()) || file.path.ends_with("tests.rs") {
            continue;
        }
        visit(file.tokens.clone(), &mut |tokens, at| {
            let TokenTree::Ident(name) = &tokens[at] else {
                return;
            };
            let called = matches!(tokens.get(at + 1), Some(TokenTree::Group(_)));
            let method = at > 0 && is_mark(tokens, at - 1, '.');
            if called && method && inexact.contains(name.to_string().as_str()) {
                let _ = writeln!(
                    wrong,
                    "src/{}: `{name}`; the crate libm has one for all machines",
                    file.path
                );
            }
        });
    }
    assert!(wrong.is_empty(), "\n{wrong}");
}

#[test]
fn only_comm_names_mpi() {
    for file in sources().into_iter().filter(|file| file.module != "comm") {
        visit(file.tokens.clone(), &mut |tokens, at| {
            let named = is(tokens, at, "mpi") && is_mark(tokens, at + 1, ':');
            assert!(!named, "src/{} names mpi; only comm may", file.path);
        });
    }
}

#[test]
fn only_figures_name_the_plot_crate_and_it_names_nothing_of_turbid() {
    for file in sources() {
        visit(file.tokens.clone(), &mut |tokens, at| {
            let named = is(tokens, at, "turbid_plot");
            let draws = MAY_DRAW.contains(&file.module.as_str());
            assert!(draws || !named, "src/{} names turbid_plot", file.path);
        });
    }
    let manifest = fs::read_to_string(root().join("crates/plot/Cargo.toml")).unwrap();
    assert!(
        !manifest.contains("path ="),
        "crates/plot depends on a crate of ours"
    );
}

#[test]
fn paths_are_found_however_they_are_written() {
    let found = |path: &str, text: &str| {
        let file = Source::new(path.to_owned(), text);
        uses(&file).into_iter().collect::<Vec<_>>().join(" ")
    };
    assert_eq!(
        found("fluid.rs", "use crate::{comm::Comm, math::{self, Vec3}};"),
        "comm math"
    );
    assert_eq!(
        found("fluid.rs", "fn f() { crate::dem::step(super::case::load()) }"),
        "case dem"
    );
    assert_eq!(found("fluid/halo.rs", "use super::{layout, super::dem};"), "dem");
    assert_eq!(
        found("fluid/halo.rs", "use super::super::{dem, case};"),
        "case dem"
    );
    assert_eq!(
        found(
            "fluid/halo.rs",
            "use super::layout; mod a { use super::super::b; }"
        ),
        ""
    );
    assert_eq!(
        found("fluid.rs", "mod tests { use super::*; use super::super::dem; }"),
        "dem"
    );
    assert_eq!(
        found("dem.rs", "macro_rules! m { () => { $crate::fluid::go() } }"),
        "fluid"
    );
    assert_eq!(
        found("dem.rs", "pub(crate) fn f() -> crate::Result<()> {}"),
        "error"
    );
    assert_eq!(
        found(
            "dem.rs",
            "/// [`crate::fluid`]\nconst A: &str = \"crate::fluid\"; // crate::fluid"
        ),
        ""
    );
    assert_eq!(found("main.rs", "fn main() { turbid::cli::main() }"), "cli");
    let glob = std::panic::catch_unwind(|| found("dem.rs", "use crate::*;"));
    assert!(glob.is_err(), "a glob of the root names everything");
}

/// A file of `src`, with its comments gone.
struct Source {
    /// Below `src`, with slashes.
    path: String,
    /// Module of the top level it belongs to.
    module: String,
    /// How deep below the root of the crate its items are.
    depth: usize,
    tokens: TokenStream,
}

impl Source {
    fn new(path: String, text: &str) -> Self {
        let names: Vec<&str> = path.trim_end_matches(".rs").split('/').collect();
        let tokens = text.parse().unwrap_or_else(|e| panic!("src/{path}: {e}"));
        let is_root = matches!(names[0], "lib" | "main");
        let is_mod = names.last() == Some(&"mod");
        Self {
            module: names[0].to_owned(),
            depth: if is_root {
                0
            } else {
                names.len() - usize::from(is_mod)
            },
            tokens,
            path,
        }
    }
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn sources() -> Vec<Source> {
    let src = root().join("src");
    let (mut open, mut found) = (vec![src.clone()], Vec::new());
    while let Some(folder) = open.pop() {
        let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
        let (folders, files): (Vec<PathBuf>, Vec<PathBuf>) = entries.partition(|path| path.is_dir());
        open.extend(folders);
        for file in files
            .iter()
            .filter(|file| file.extension().is_some_and(|e| e == "rs"))
        {
            let parts = file.strip_prefix(&src).unwrap().iter();
            let path: Vec<_> = parts.map(|part| part.to_string_lossy()).collect();
            found.push(Source::new(path.join("/"), &fs::read_to_string(file).unwrap()));
        }
    }
    assert!(found.len() > 50, "sources have gone missing");
    found
}

/// Modules of the top level that a file names.
fn uses(file: &Source) -> BTreeSet<String> {
    let mut used = BTreeSet::new();
    search(file.tokens.clone(), file, file.depth, &mut used);
    used
}

/// Looks for the beginnings of paths in code that lies `depth` below the root.
fn search(tokens: TokenStream, file: &Source, depth: usize, used: &mut BTreeSet<String>) {
    let tokens: Vec<TokenTree> = tokens.into_iter().collect();
    let mut at = 0;
    while at < tokens.len() {
        let after_path = at > 0 && is_mark(&tokens, at - 1, ':');
        let starts = !after_path && is_mark(&tokens, at + 1, ':') && is_mark(&tokens, at + 2, ':');
        if starts && (is(&tokens, at, "crate") || (file.module == "main" && is(&tokens, at, "turbid"))) {
            at = follow(&tokens, at + 3, 0, file, used);
        } else if starts && is(&tokens, at, "super") {
            at = follow(&tokens, at, depth, file, used);
        } else if let TokenTree::Group(group) = &tokens[at] {
            let named_module = at >= 2 && is(&tokens, at - 2, "mod") && group.delimiter() == Delimiter::Brace;
            search(group.stream(), file, depth + usize::from(named_module), used);
            at += 1;
        } else {
            at += 1;
        }
    }
}

/// Follows a path from the module `level` below the root, down to the name of a module of the top level if it gets there.
/// Returns where it ends.
fn follow(
    tokens: &[TokenTree],
    mut at: usize,
    mut level: usize,
    file: &Source,
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
            follow(branch, 0, level, file, used);
        }
    } else if level == 0 && at < tokens.len() {
        let name = tokens[at].to_string();
        if let Some((_, module)) = ROOT_NAMES.iter().find(|(root, _)| *root == name) {
            used.insert((*module).to_owned());
        } else {
            let is_module = MAY_USE.iter().any(|(module, _)| *module == name);
            assert!(
                is_module,
                "src/{}: `crate::{name}` is no module; name the one it is from",
                file.path
            );
            used.insert(name);
        }
    }
    at + 1
}

/// Calls `look(tokens, at)` at every token, however deep, but for the modules `tests`.
fn visit(tokens: TokenStream, look: &mut impl FnMut(&[TokenTree], usize)) {
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

fn is(tokens: &[TokenTree], at: usize, name: &str) -> bool {
    matches!(tokens.get(at), Some(TokenTree::Ident(ident)) if ident == name)
}

fn is_mark(tokens: &[TokenTree], at: usize, mark: char) -> bool {
    matches!(tokens.get(at), Some(TokenTree::Punct(punct)) if punct.as_char() == mark)
}
