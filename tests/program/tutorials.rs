//! The tutorials of `docs/tutorials`: their commands run as they stand on the page, print what the page says, and draw its pictures, to
//! the byte. `UPDATE=1 cargo test --test program tutorials` replaces the pictures and `docs/reference/commands.md`.

use crate::common::{PROGRAM, Place, in_tree, words};
use pulldown_cmark::{CodeBlockKind, Event, Parser, Tag};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::fs;
use std::process::{Command, Stdio};

/// Tested parts of a page.
#[derive(Default)]
struct Page {
    /// Its shell commands.
    commands: String,
    /// Lines that the commands print, among others.
    lines: Vec<String>,
    /// Pictures: path from the page, and path in the folder of the commands, the title of the picture.
    pictures: Vec<(String, String)>,
}

impl Page {
    fn read(text: &str) -> Self {
        let mut page = Self::default();
        let mut block = String::new();
        for event in Parser::new(text) {
            match event {
                Event::Start(Tag::CodeBlock(CodeBlockKind::Fenced(language))) => block = language.to_string(),
                Event::Start(_) => block.clear(),
                Event::Text(text) if block == "sh" => page.commands.push_str(&text),
                Event::Text(text) if block == "text" => page.lines.extend(text.lines().map(squeezed)),
                _ => {}
            }
        }
        for event in Parser::new(text) {
            if let Event::Start(Tag::Image { dest_url, title, .. }) = event {
                page.pictures.push((dest_url.to_string(), title.to_string()));
            }
        }
        page
    }
}

/// A line with single blanks.
fn squeezed(line: &str) -> String {
    line.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Follows a tutorial from an empty folder.
#[track_caller]
fn follow(name: &str) {
    let folder = in_tree("docs/tutorials");
    let text = fs::read_to_string(folder.join(format!("{name}.md"))).unwrap();
    let page = Page::read(&text);
    assert!(!page.commands.is_empty() && !page.pictures.is_empty() && !page.lines.is_empty());
    let place = Place::empty();
    fs::create_dir(place.path("bin")).unwrap();
    std::os::unix::fs::symlink(PROGRAM, place.path("bin/turbid")).unwrap();
    let path = std::env::join_paths(
        [place.path("bin")].into_iter().chain(std::env::split_paths(&std::env::var_os("PATH").unwrap())),
    );
    let output = Command::new("timeout")
        .args(["--kill-after=5", "600", "sh", "-euc", &page.commands])
        .current_dir(place.folder())
        .env("PATH", path.unwrap())
        .env("TURBID", in_tree(".").canonicalize().unwrap())
        .stdin(Stdio::null())
        .output()
        .unwrap();
    let said = words(&output);
    assert!(output.status.success(), "{said}");
    let squeezed: Vec<String> = said.lines().map(squeezed).collect();
    for line in page.lines {
        assert!(
            squeezed.iter().any(|said| said.contains(&line)),
            "the page says `{line}`, the commands\n{said}"
        );
    }
    for (picture, made) in page.pictures {
        let new = fs::read(place.path(name).join(&made)).unwrap_or_else(|error| panic!("{made}: {error}"));
        let stored = folder.join(&picture);
        if std::env::var_os("UPDATE").is_some() {
            fs::write(stored, new).unwrap();
        } else {
            assert!(
                fs::read(&stored).unwrap_or_default() == new,
                "{picture} is no longer {made}; look at it, then run: UPDATE=1 cargo test --test program tutorials"
            );
        }
    }
}

#[test]
fn the_tutorial_on_settling_gives_what_its_page_shows() {
    follow("settling");
}

#[test]
fn the_tutorial_on_shear_gives_what_its_page_shows() {
    follow("shear");
}

#[test]
fn the_tutorial_on_shapes_gives_what_its_page_shows() {
    follow("own-shape");
}

#[test]
fn the_tutorial_on_packings_gives_what_its_page_shows() {
    follow("packing");
}

#[test]
fn the_tutorial_on_engines_gives_what_its_page_shows() {
    follow("engine");
}

#[test]
fn every_tutorial_is_followed() {
    let pages = fs::read_dir(in_tree("docs/tutorials")).unwrap();
    let names = pages.map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let mut names: Vec<String> =
        names.filter_map(|name| Some(name.strip_suffix(".md")?.to_string())).collect();
    names.sort();
    assert_eq!(names, ["engine", "own-shape", "packing", "settling", "shear"]);
}

#[test]
fn the_page_on_commands_is_the_help_of_the_program() {
    let place = Place::empty();
    let help = place.well(&["--help"]);
    let (_, verbs) = help.split_once("Commands:\n").unwrap();
    let mut out = String::from(
        "# Commands\n\nThis page is the help of the program: `turbid help`, `turbid help COMMAND`.\n\n",
    );
    let _ = write!(out, "```text\n{}\n```\n", help.trim_end());
    for line in verbs.lines().take_while(|line| !line.is_empty()) {
        let Some(verb) =
            line.split_whitespace().next().filter(|_| line.starts_with("  ") && !line.starts_with("   "))
        else {
            continue;
        };
        if verb != "help" {
            let _ = write!(out, "\n## {verb}\n\n```text\n{}\n```\n", place.well(&["help", verb]).trim_end());
        }
    }
    let lines: Vec<&str> = out.lines().map(str::trim_end).collect();
    let out = lines.join("\n") + "\n";
    let path = in_tree("docs/reference/commands.md");
    if std::env::var_os("UPDATE").is_some() {
        return fs::write(path, out).unwrap();
    }
    let stored = fs::read_to_string(path).unwrap_or_default();
    assert!(stored == out, "out of date; run: UPDATE=1 cargo test --test program tutorials");
}

/// Units of the arrays of a file for VTK, by their names: texts as the codes of their bytes, each ended by a zero.
fn units(file: &str) -> BTreeMap<String, String> {
    let (_, rest) = file.split_once("Name=\"units\"").unwrap();
    let (_, rest) = rest.split_once('>').unwrap();
    let codes = rest.split('<').next().unwrap().split_whitespace();
    let bytes = codes.map(|code| code.parse().unwrap()).collect();
    let text = String::from_utf8(bytes).unwrap();
    let entries = text.split_terminator('\0').map(|entry| entry.split_once(": ").unwrap());
    entries.map(|(name, unit)| (name.to_owned(), unit.to_owned())).collect()
}

#[test]
fn the_page_on_arrays_has_those_of_every_file_with_their_units() {
    let page = fs::read_to_string(in_tree("docs/reference/arrays.md")).unwrap();
    let place = Place::empty();
    let case = in_tree("docs/tutorials/own-shape/grains.toml");
    place.well(&["run", case.to_str().unwrap(), "--out", "out", "--quiet", "--set", "run.end={ steps = 2 }"]);
    // Names of VTK's own arrays, and of the time of a file.
    let of_vtk = ["TimeValue", "Points", "connectivity", "offsets"];
    let mut found = BTreeSet::new();
    for (file, section) in [
        ("fields/fields_0000000002.vti", "fields_"),
        ("particles/particles_0000000002.vtp", "particles_"),
        ("surfaces/surfaces_0000000002.vtp", "surfaces_"),
        ("contacts/contacts_0000000002.vtp", "contacts_"),
        ("force_chains/force_chains_0000000002.vtp", "force_chains_"),
        ("walls.vtp", "walls.vtp"),
    ] {
        let bytes = fs::read(place.path("out").join(file)).unwrap();
        let text = String::from_utf8_lossy(&bytes);
        let (_, rest) = page.split_once(&format!("\n## {section}")).unwrap();
        let section = rest.split("\n## ").next().unwrap();
        let units = units(&text);
        for name in text.split(" Name=\"").skip(1).map(|rest| rest.split('"').next().unwrap()) {
            if name == "units" || of_vtk.contains(&name) {
                continue;
            }
            let quoted = format!("`{name}`");
            assert!(section.contains(&quoted), "{file}: {quoted}");
            let unit = units.get(name).unwrap_or_else(|| panic!("{file}: no unit of {quoted}"));
            if let Some(row) = section.lines().find(|row| row.starts_with('|') && row.contains(&quoted)) {
                assert_eq!(row.split(" | ").nth(1), Some(unit.as_str()), "{file}: {quoted}");
            }
            found.insert(name.to_string());
        }
    }
    assert!(found.len() > 15, "{found:?}");
}
