//! Dependencies of modules: the table of ARCHITECTURE.md, compared with every path that the code names.

#[path = "architecture/recipes.rs"]
mod recipes;
#[path = "architecture/sources.rs"]
mod sources;
#[path = "architecture/words.rs"]
mod words;

use proc_macro2::TokenTree;
use sources::{is, is_mark, root, sources, visit};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::fs;

/// Every module and the modules it may use, which all stand below it: no arrow points up, so there is no cycle.
const MAY_USE: &[(&str, &str)] = &[
    ("main", "cli"),
    (
        "cli",
        "report validate study crosscheck bench checks simulation case mesh output checkpoint packing engine fluid contact shape comm device document input memory error",
    ),
    ("report", "study checks simulation output plot input error"),
    (
        "validate",
        "crosscheck checks simulation case output engine checkpoint coupling fluid dem contact particle shape wall domain comm math input error",
    ),
    ("study", "checks simulation case output checkpoint plot math document input error"),
    (
        "crosscheck",
        "checks simulation case output engine fluid dem contact particle shape wall domain comm math error",
    ),
    ("bench", "simulation case output engine coupling fluid domain comm math timing error"),
    ("checks", "output plot particle error"),
    ("builder", "simulation case coupling fluid shape math error"),
    (
        "simulation",
        "case output engine checkpoint packing coupling fluid dem contact particle shape wall lattice domain comm device units math timing input memory error",
    ),
    (
        "case",
        "mesh engine packing output coupling fluid contact particle shape wall domain device units math document input memory error",
    ),
    ("output", "checkpoint plot dem particle shape wall domain math input error"),
    ("plot", ""),
    ("mesh", "shape wall math input"),
    ("engine", "lammps liggghts process error"),
    ("lammps", "process dem contact math"),
    ("liggghts", "process dem contact wall math"),
    ("process", "dem contact particle shape wall domain comm math memory error"),
    ("packing", "contact wall domain math input"),
    ("checkpoint", "domain comm input memory error"),
    ("coupling", "fluid dem particle shape wall lattice domain comm device units math error"),
    ("fluid", "lattice domain comm device math memory error"),
    ("dem", "contact particle shape wall domain comm math error"),
    ("contact", "shape wall domain math"),
    ("particle", "shape math"),
    ("shape", "math"),
    ("wall", "math"),
    ("lattice", ""),
    ("domain", "math"),
    ("comm", "memory error"),
    ("units", ""),
    ("math", ""),
    ("timing", ""),
    ("document", "input error"),
    ("input", ""),
    ("device", "memory error"),
    ("memory", "error"),
    ("error", ""),
];

/// Modules whose numbers become part of the state of a run.
const STATE: &str =
    "simulation case packing coupling fluid dem contact particle shape wall lattice domain units math";

/// Functions of numbers that the system, the processor or the compiler rounds as it likes.
const INEXACT: &str = "sin cos tan sin_cos asin acos atan atan2 sinh cosh tanh asinh acosh atanh exp exp2 exp_m1 ln ln_1p log log2 \
                       log10 powi powf cbrt hypot";

/// Laws of the literature that are drawn beside a result: they go into files and nowhere else.
const ONLY_WRITTEN: &str = "simulation/references";

/// The module that may write to the terminal.
const MAY_PRINT: &str = "cli";

/// The file that writes what LAMMPS says before it ends the process, to which nothing can be returned.
const LAST_WORDS: &str = "ffi/lammps/src/screen.rs";

#[test]
fn modules_use_what_the_table_allows_and_all_of_it() {
    let mut wrong = String::new();
    let mut arrows: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for file in sources() {
        let used = arrows.entry(file.module.clone()).or_default();
        // A `lib.rs` names all; a module that is not in the table is another test's.
        let row = MAY_USE.iter().find(|(module, _)| *module == file.module);
        for other in file.uses() {
            let allowed = row.is_none_or(|(_, allowed)| allowed.split_whitespace().any(|name| name == other));
            if other != file.module && !allowed {
                let _ = writeln!(wrong, "{}: `{}` must not use `{other}`", file.path, file.module);
            }
            used.insert(other);
        }
    }
    for (module, allowed) in MAY_USE {
        for other in allowed.split_whitespace().filter(|other| !arrows[*module].contains(*other)) {
            let _ = writeln!(wrong, "no file of `{module}` uses `{other}`: take it off the table");
        }
    }
    assert!(wrong.is_empty(), "\n{wrong}");
}

#[test]
fn every_module_stands_in_the_table_and_the_table_names_no_other() {
    let there: BTreeSet<String> = sources().into_iter().map(|file| file.module).collect();
    let known: BTreeSet<String> = MAY_USE.iter().map(|(module, _)| (*module).to_owned()).collect();
    let missing: Vec<_> = there.difference(&known).filter(|module| *module != "lib").collect();
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
    let here: Vec<(String, String)> =
        MAY_USE.iter().map(|(module, allowed)| ((*module).to_owned(), (*allowed).to_owned())).collect();
    assert_eq!(stated, here);
}

#[test]
fn the_step_in_architecture_md_is_the_one_of_the_code() {
    let squeezed = |text: &str| text.split_whitespace().collect::<String>();
    let text = fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap();
    let quoted = text.split("```rust\n").nth(1).and_then(|rest| rest.split("```").next());
    let code = fs::read_to_string(root().join("src/simulation.rs")).unwrap();
    let step = squeezed(quoted.expect("a quotation"));
    assert!(squeezed(&code).contains(&step), "out of date: src/simulation.rs has another step");
}

#[test]
fn only_the_command_line_writes_to_the_terminal() {
    let mut wrong = String::new();
    for file in sources() {
        // What tests print is captured.
        if file.is_test() || file.is_in(MAY_PRINT) || file.path == LAST_WORDS {
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
                let _ = writeln!(wrong, "{}: {}", file.path, tokens[at]);
            }
        });
    }
    assert!(wrong.is_empty(), "\n{wrong}");
}

/// Returns true if a token is a function of [`INEXACT`]: `x.sin()`, `f64::sin(x)`, or handed over as `f64::sin`.
fn is_inexact(tokens: &[TokenTree], at: usize) -> bool {
    let TokenTree::Ident(name) = &tokens[at] else {
        return false;
    };
    let called = matches!(tokens.get(at + 1), Some(TokenTree::Group(_)));
    let method = called && at > 0 && is_mark(tokens, at - 1, '.');
    // After another name than this it is somebody else's function.
    let of_numbers = |at: usize| ["f32", "f64", "T", "Self", "Real"].iter().any(|kind| is(tokens, at, kind));
    let path =
        at >= 3 && is_mark(tokens, at - 1, ':') && (of_numbers(at - 3) || is_mark(tokens, at - 3, '>'));
    (method || path) && INEXACT.split_whitespace().any(|inexact| name == inexact)
}

#[test]
fn what_feeds_the_state_is_rounded_alike_on_every_machine() {
    let mut wrong = String::new();
    for file in sources() {
        let of_state = STATE.split_whitespace().any(|module| file.module == module);
        if !of_state || file.is_test() || file.is_in(ONLY_WRITTEN) {
            continue;
        }
        visit(file.tokens.clone(), &mut |tokens, at| {
            if is_inexact(tokens, at) {
                let _ = writeln!(
                    wrong,
                    "{}: `{}`; products, or the crate libm, are the same on all machines",
                    file.path, tokens[at]
                );
            }
        });
    }
    assert!(wrong.is_empty(), "\n{wrong}");
}

#[test]
fn inexact_functions_are_found_however_they_are_called() {
    let found = |text: &str| {
        let mut count = 0;
        visit(text.parse().unwrap(), &mut |tokens, at| {
            count += usize::from(is_inexact(tokens, at));
        });
        count
    };
    assert_eq!(found("x.sin() + x . powi (2)"), 2);
    assert_eq!(found("f64::sin(x) + <f32>::exp(x) + list.map(f64::cos)"), 3);
    assert_eq!(found("libm::sin(x) + Quat::exp(x) + x.sqrt() + f64::sqrt(x); fn sin() {}"), 0);
}

#[test]
fn only_the_list_of_drivers_depends_on_the_feature_gpu() {
    for file in sources().into_iter().filter(|file| file.path != "crates/core/src/device.rs") {
        visit(file.tokens.clone(), &mut |tokens, at| {
            let named = is(tokens, at, "feature") && is_mark(tokens, at + 1, '=');
            let value = tokens.get(at + 2).map(ToString::to_string).unwrap_or_default();
            assert!(!named || value != "\"gpu\"", "{}: all but the drivers is one code", file.path);
        });
    }
}

/// Names by which a program reaches files.
const FILES: &str = "fs File OpenOptions temp_dir";

#[test]
fn the_core_reads_and_writes_no_files() {
    let mut wrong = String::new();
    for file in sources().into_iter().filter(|file| file.path.starts_with("crates/core/") && !file.is_test())
    {
        visit(file.tokens.clone(), &mut |tokens, at| {
            if FILES.split_whitespace().any(|name| is(tokens, at, name)) {
                let _ = writeln!(wrong, "{}: `{}`; the program has the files", file.path, tokens[at]);
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
            assert!(!named, "{} names mpi; only comm may", file.path);
        });
    }
}
