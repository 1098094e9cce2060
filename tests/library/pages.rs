//! The pages of the repository: their links, anchors and pictures lead to something, and the summary of the book lists every page.

use crate::common::in_tree;
use pulldown_cmark::{Event, Options, Parser, Tag, TagEnd};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Component, Path, PathBuf};
use std::process::Command;

/// Folders without pages of ours.
const ELSEWHERE: [&str; 4] = ["target", ".git", "out", "node_modules"];

/// All pages below a folder.
fn pages(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if path.is_dir() && !ELSEWHERE.contains(&name.as_str()) && !path.is_symlink() {
            pages(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "md") {
            found.push(path);
        }
    }
}

fn parse(text: &str) -> Parser<'_> {
    Parser::new_ext(text, Options::ENABLE_TABLES | Options::ENABLE_STRIKETHROUGH)
}

/// Anchors of the headings of a page, as code hosts and mdBook make them.
fn anchors(text: &str) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    let mut times = BTreeMap::new();
    let mut heading: Option<String> = None;
    for event in parse(text) {
        match event {
            Event::Start(Tag::Heading { .. }) => heading = Some(String::new()),
            Event::Text(words) | Event::Code(words) => {
                if let Some(heading) = &mut heading {
                    heading.push_str(&words);
                }
            }
            Event::End(TagEnd::Heading(_)) => {
                let words = heading.take().unwrap().to_lowercase();
                let kept = words.chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c));
                let anchor: String = kept.map(|c| if c == ' ' { '-' } else { c }).collect();
                let before: &mut usize = times.entry(anchor.clone()).or_default();
                found.insert(if *before == 0 { anchor } else { format!("{anchor}-{before}") });
                *before += 1;
            }
            _ => {}
        }
    }
    found
}

/// Destinations of links and pictures, those of `<img src="...">` among them.
fn destinations(text: &str) -> Vec<String> {
    let mut found = Vec::new();
    for event in parse(text) {
        match event {
            Event::Start(Tag::Link { dest_url, .. } | Tag::Image { dest_url, .. }) => {
                found.push(dest_url.to_string());
            }
            Event::Html(html) | Event::InlineHtml(html) => {
                for attribute in ["src=\"", "href=\""] {
                    let values = html.split(attribute).skip(1);
                    found.extend(values.filter_map(|rest| Some(rest.split_once('"')?.0.to_string())));
                }
            }
            _ => {}
        }
    }
    found
}

/// A path without `.` and `..`.
fn plain(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match part {
            Component::ParentDir => assert!(plain.pop()),
            Component::CurDir => {}
            part => plain.push(part),
        }
    }
    plain
}

/// Fault of a link of a page, if it has one.
fn wrong(page: &Path, link: &str) -> Option<&'static str> {
    if ["https://", "http://", "mailto:"].iter().any(|scheme| link.starts_with(scheme)) {
        return None;
    }
    let (path, anchor) = link.split_once('#').unwrap_or((link, ""));
    let mut target =
        if path.is_empty() { page.to_path_buf() } else { plain(&page.parent().unwrap().join(path)) };
    if !target.exists() {
        return Some("is not there");
    }
    if target.is_dir() {
        target = target.join("README.md");
    }
    if anchor.is_empty() || target.extension().is_none_or(|extension| extension != "md") {
        return None;
    }
    let text = fs::read_to_string(&target).unwrap_or_default();
    (!anchors(&text).contains(anchor)).then_some("has no such heading")
}

#[test]
fn every_link_leads_to_a_file_and_a_heading_that_are_there() {
    let root = plain(&in_tree("."));
    let mut all = Vec::new();
    pages(&root, &mut all);
    let mut count = 0;
    let mut bad = Vec::new();
    for page in &all {
        for link in destinations(&fs::read_to_string(page).unwrap()) {
            count += 1;
            if let Some(what) = wrong(page, &link) {
                bad.push(format!("{}: {link} {what}", page.strip_prefix(&root).unwrap().display()));
            }
        }
    }
    assert!(bad.is_empty(), "{}", bad.join("\n"));
    assert!(all.len() > 50 && count > 300, "{} pages, {count} links", all.len());
}

#[test]
fn a_link_to_what_is_not_there_is_found() {
    let page = plain(&in_tree("docs/SUMMARY.md"));
    for (link, what) in [
        ("nothing.md", Some("is not there")),
        ("study.md#nothing", Some("has no such heading")),
        ("../validation/drag#nothing", Some("has no such heading")),
        ("study.md#keys", None),
        ("../validation/drag", None),
    ] {
        assert_eq!(wrong(&page, link), what, "{link}");
    }
}

#[test]
fn the_summary_of_the_book_lists_every_page_of_docs_once() {
    let docs = plain(&in_tree("docs"));
    let mut there = Vec::new();
    pages(&docs, &mut there);
    there.retain(|page| !page.ends_with("SUMMARY.md"));
    there.sort();
    let mut listed: Vec<PathBuf> = destinations(&fs::read_to_string(docs.join("SUMMARY.md")).unwrap())
        .iter()
        .map(|link| docs.join(link))
        .collect();
    listed.sort();
    assert_eq!(listed, there);
}

#[test]
fn the_pictures_of_the_pages_are_those_of_the_program_as_it_is() {
    let check = Command::new("sh").arg(in_tree("scripts/pictures.sh")).arg("--check").output().unwrap();
    assert!(check.status.success(), "{}", String::from_utf8_lossy(&check.stderr));
}

#[test]
fn every_picture_of_the_docs_is_drawn_by_the_script_or_a_screenshot() {
    let script = fs::read_to_string(in_tree("scripts/pictures.sh")).unwrap();
    for entry in fs::read_dir(in_tree("docs")).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        if let Some(stem) = name.strip_suffix(".png") {
            let drawn = script.contains(&format!("\n    line {stem} "));
            assert!(drawn || script.contains(&format!("docs/{name}")), "{name}");
        }
    }
}
