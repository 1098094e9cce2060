//! CONTRIBUTING.md: what its text and its recipes name is there.

use super::sources::{root, sources};
use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

/// The texts between back quotes, those in blocks of code left out.
fn spans(text: &str) -> Vec<String> {
    let prose: String = text.split("```").step_by(2).collect();
    let inside = prose.split('`').skip(1).step_by(2);
    inside.map(|span| span.split_whitespace().collect::<Vec<_>>().join(" ")).collect()
}

/// Returns true if a word is the path of a file, as a text or a command names it.
fn is_path(word: &str) -> bool {
    let ending = Path::new(word).extension().and_then(|e| e.to_str()).unwrap_or_default();
    let known = ["rs", "md", "toml", "json", "sh", "py", "csv"].contains(&ending);
    // Words of output that a run makes are no files of the tree.
    word.contains('/') && !word.starts_with("out/") && (known || word.ends_with('/'))
}

/// Returns true if there is a file at the path; of `<name>` it is asked for its folder only.
fn is_there(path: &str) -> bool {
    let kept = path.split_once('<').map_or(path, |(before, _)| before);
    let folder = kept.rsplit_once('/').map_or("", |(folder, _)| folder);
    root().join(if kept == path { path } else { folder }).exists()
}

#[test]
fn every_file_that_contributing_md_names_is_there() {
    let text = fs::read_to_string(root().join("CONTRIBUTING.md")).unwrap();
    let spans = spans(&text);
    let words: Vec<&str> = spans.iter().flat_map(|span| span.split(' ')).collect();
    let paths: Vec<&&str> = words.iter().filter(|word| is_path(word)).collect();
    assert!(paths.len() > 40, "{paths:?}");
    let mut wrong: Vec<&&&str> = paths.iter().filter(|path| !is_there(path)).collect();
    // A file of source is named with its folder.
    let bare = |word: &&&str| Path::new(word).extension().is_some_and(|e| e == "rs") && !word.contains('/');
    let bare: Vec<&&str> = words.iter().filter(bare).collect();
    wrong.extend(&bare);
    assert!(wrong.is_empty(), "{wrong:?}");
}

#[test]
fn every_name_of_the_code_that_a_recipe_gives_is_in_the_code() {
    let text = fs::read_to_string(root().join("CONTRIBUTING.md")).unwrap();
    let (_, recipes) = text.split_once("## Recipes").unwrap();
    let mut known = BTreeSet::new();
    for file in sources() {
        let code = fs::read_to_string(root().join(&file.path)).unwrap();
        let words = code.split(|c: char| !c.is_alphanumeric() && c != '_');
        known.extend(words.map(str::to_owned));
    }
    let mut wrong = String::new();
    for span in spans(recipes) {
        let is_name = span.chars().all(|c| c.is_alphanumeric() || c == '_' || c == ':')
            && span.contains(|c: char| c.is_uppercase() || c == '_');
        for name in span.split("::").filter(|_| is_name) {
            if !known.contains(name) {
                let _ = writeln!(wrong, "`{span}`");
            }
        }
    }
    assert!(wrong.is_empty(), "CONTRIBUTING.md names what is not there:\n{wrong}");
}
