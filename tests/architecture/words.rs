//! Words of names, comments and pages: the terms of the field, and doc comments that begin with a noun phrase or a verb.

use super::sources::root;
use std::fs;
use std::path::{Path, PathBuf};

/// Words that are not used, in names or in sentences, and what is said instead.
const NOT_USED: [(&str, &str); 15] = [
    ("parcel", "halo or ghost particle"),
    ("parcels", "halos or ghost particles"),
    ("ledger", "record"),
    ("keeper", "owner rank"),
    ("keepers", "owner ranks"),
    ("wishes", "requests"),
    ("goes on", "continues"),
    ("going on", "under way"),
    ("go on with", "resume"),
    ("so many", "a number by its name"),
    ("is no number", "is not a number, or NaN"),
    ("less its weight", "minus its weight"),
    ("told of", "a noun for what is shown"),
    ("who speaks", "owner rank"),
    ("hands out", "gives"),
];

/// Words that begin no doc comment.
const QUESTIONS: [&str; 8] = ["What", "Where", "How", "Whether", "Which", "Why", "Who", "When"];

/// Files below a folder whose names end like this.
fn below(folder: &Path, endings: &[&str], all: &mut Vec<PathBuf>) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for path in entries.map(|entry| entry.unwrap().path()) {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if path.is_dir() && name != "target" {
            below(&path, endings, all);
        } else if endings.iter().any(|ending| name.ends_with(ending)) && name != "words.rs" {
            all.push(path);
        }
    }
}

fn files(folders: &[&str], endings: &[&str]) -> Vec<(PathBuf, String)> {
    let mut all = Vec::new();
    for folder in folders {
        below(&root().join(folder), endings, &mut all);
    }
    all.sort();
    let text = |path: PathBuf| (path.clone(), fs::read_to_string(path).unwrap());
    all.into_iter().map(text).collect()
}

#[test]
fn no_name_comment_or_page_says_what_the_field_has_another_word_for() {
    let mut wrong = Vec::new();
    for (path, text) in files(&["src", "crates", "ffi", "tests", "docs"], &[".rs", ".py", ".h", ".cl", ".md"])
    {
        for (n, line) in text.lines().enumerate() {
            // Words of names are parted.
            let words = line.to_lowercase().replace('_', " ");
            let found = NOT_USED.iter().filter(|(word, _)| {
                let alone = |at: usize| {
                    !words[..at].ends_with(char::is_alphabetic)
                        && !words[at + word.len()..].starts_with(char::is_alphabetic)
                };
                words.match_indices(word).any(|(at, _)| alone(at))
            });
            wrong.extend(
                found.map(|(word, instead)| format!("{}:{}: {word}: say {instead}", path.display(), n + 1)),
            );
        }
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

#[test]
fn a_doc_comment_begins_with_a_noun_phrase_or_a_verb() {
    let mut wrong = Vec::new();
    for (path, text) in files(&["src", "crates", "ffi", "tests", "examples", "fuzz"], &[".rs"]) {
        let mut before = "";
        for (n, line) in text.lines().map(str::trim).enumerate() {
            let begins = |kind: &str| {
                let rest = line.strip_prefix(kind).filter(|_| !before.starts_with(kind));
                rest.and_then(|rest| rest.split_whitespace().next())
                    .is_some_and(|word| QUESTIONS.contains(&word))
            };
            if begins("///") || begins("//!") {
                wrong.push(format!("{}:{}: {line}", path.display(), n + 1));
            }
            before = line;
        }
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}
