//! The text of a document: the file followed by the `--set` options, so that every position is one number.

use super::overrides::{Alternatives, Keys, split};
use super::{Format, Schema, conform};
use crate::input;
#[cfg(feature = "snippets")]
use annotate_snippets::{AnnotationKind, Group, Level, Origin, Renderer, Snippet};
use serde::Deserialize;
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::Spanned;
use toml::de::{DeTable, DeValue};
use turbid_core::error::{Error, Result};

/// Text of the file followed by the options, one per line.
#[derive(Debug)]
pub struct Source {
    /// Path of the file as the user gave it.
    pub path: String,
    /// File, then options.
    pub(super) text: String,
    /// Length of the file.
    file_length: usize,
    /// The options.
    pub(super) options: Vec<GivenOption>,
}

/// One `--set` option.
#[derive(Debug)]
pub(super) struct GivenOption {
    /// Position in [`Source::text`].
    pub(super) span: Range<usize>,
    /// Its path of keys.
    pub(super) keys: Keys,
    /// `v=` and its value, after as many blanks as give every part of the value its position in [`Source::text`].
    pub(super) shifted: Option<String>,
}

impl Source {
    /// Reads the file and appends the options.
    pub fn read(path: &Path, options: &[String]) -> Result<Self> {
        let bytes = input::read(path, input::CASE).map_err(|e| Error::io("read", path, e))?;
        let text = String::from_utf8(bytes).map_err(|e| {
            let good = &e.as_bytes()[..e.utf8_error().valid_up_to()];
            let line = good.split(|&byte| byte == b'\n').count();
            let shown = path.display();
            let text = format!("{shown}:{line}: not UTF-8 text; save the file as UTF-8");
            let path = path.to_path_buf();
            Error::Parse { path, line, text }
        })?;
        Ok(Self::new(path.display().to_string(), text, options))
    }

    /// From text.
    pub fn new(path: String, mut text: String, options: &[String]) -> Self {
        let file_length = text.len();
        let options = options
            .iter()
            .map(|option| {
                text.push('\n');
                let start = text.len();
                text.push_str(option);
                let (keys, value) = split(option);
                let shifted =
                    value.map(|value| format!("{}v={}", " ".repeat(start + value - 2), &option[value..]));
                GivenOption { keys, span: start..text.len(), shifted }
            })
            .collect();
        Self { path, text, file_length, options }
    }

    /// The document as typed values.
    pub fn parse<T: Format>(&self) -> Result<T> {
        let tree = self.tree(&Schema::of::<T>())?;
        T::deserialize(toml::de::Deserializer::from(tree)).map_err(|e| self.type_error(&e))
    }

    /// The document with the options applied, which has the form that a schema describes.
    pub fn tree(&self, schema: &Schema) -> Result<Spanned<DeTable<'_>>> {
        self.refuse_foreign(schema)?;
        let mut tree = DeTable::parse(&self.text[..self.file_length]).map_err(|e| self.toml_error(&e))?;
        let alternatives = Alternatives::of(schema);
        for option in &self.options {
            self.apply(option, tree.get_mut(), &alternatives)?;
        }
        conform::check(self, tree.get_ref(), schema)?;
        Ok(tree)
    }

    /// A tree as a table, and as a text: that of the file if there are no options.
    pub fn effective(&self, tree: Spanned<DeTable<'_>>) -> Result<(toml::Table, String)> {
        let table = toml::Table::deserialize(toml::de::Deserializer::from(tree));
        let table = table.map_err(|e| self.type_error(&e))?;
        let text = match &self.options[..] {
            [] => self.text.clone(),
            _ => toml::to_string(&table).expect("a parsed document can be written"),
        };
        Ok((table, text))
    }

    /// Refuses a file that has no key of its kind, without showing its lines: they may be confidential.
    fn refuse_foreign(&self, schema: &Schema) -> Result<()> {
        let keys = schema.json["properties"].as_object().into_iter().flatten();
        let known: Vec<&str> = keys.map(|(key, _)| key.as_str()).collect();
        let mut lines = self.text[..self.file_length].trim_start_matches('\u{feff}').lines();
        let begins = |line: &str| {
            let line = line.trim_start_matches(['[', '"', '\'', ' ', '\t']);
            let behind = known.iter().filter_map(|key| line.strip_prefix(key));
            let mut behind = behind.map(|rest| rest.trim_start_matches(['"', '\'', ' ', '\t']));
            behind.any(|rest| rest.starts_with([']', '.', '=']))
        };
        let says_nothing = |line: &str| line.trim().is_empty() || line.trim_start().starts_with('#');
        if lines.clone().any(begins) || lines.all(says_nothing) {
            return Ok(());
        }
        let kind = schema.json["title"].as_str().unwrap_or("case").to_lowercase();
        let text = format!(
            "{}: this is no {kind} of turbid: no line begins with a key of one\n  its keys are: {}",
            self.path,
            known.join(", ")
        );
        Err(self.parse_error(0, text))
    }

    /// An error at one place.
    pub fn error(&self, span: &Range<usize>, title: &str, label: &str, remedy: &str) -> Error {
        self.error_at(&[(span, label)], title, remedy)
    }

    /// An error that several marks make together.
    pub fn error_at(&self, marks: &[(&Range<usize>, &str)], title: &str, remedy: &str) -> Error {
        let at_place = marks.iter().find_map(|(span, _)| self.key_at(span));
        let in_title = || (title.split(['`', '[', ']']).nth(1).unwrap_or_default()).to_string();
        Error::Case {
            key: at_place.unwrap_or_else(in_title),
            what: title.to_string(),
            remedy: remedy.to_string(),
            text: self.render(marks, title, remedy),
        }
    }

    /// `key` is `value`, but must be `wanted`.
    pub fn out_of_range(
        &self,
        key: &str,
        span: &Range<usize>,
        value: &str,
        wanted: &str,
        remedy: &str,
    ) -> Error {
        let title = format!("`{key}` is {value}, but must be {wanted}");
        self.error(span, &title, "out of range", remedy)
    }

    /// Path of the innermost key that a place belongs to, by its name or its value.
    fn key_at(&self, span: &Range<usize>) -> Option<String> {
        if span.is_empty() {
            return None;
        }
        if let Some(option) = self.option_at(span) {
            let keys: Vec<&str> = option.keys.iter().map(|(_, key)| key.as_str()).collect();
            return Some(keys.join("."));
        }
        let document = DeTable::parse(&self.text[..self.file_length]).ok()?;
        innermost(&DeValue::Table(document.into_inner()), span)
    }

    /// The options: text, path of keys, and position.
    pub fn options(&self) -> impl Iterator<Item = (&str, Vec<&str>, &Range<usize>)> {
        self.options.iter().map(|option| {
            let keys = option.keys.iter().map(|(_, key)| key.as_str()).collect();
            (&self.text[option.span.clone()], keys, &option.span)
        })
    }

    /// The option that a position is in.
    fn option_at(&self, span: &Range<usize>) -> Option<&GivenOption> {
        self.options.iter().find(|option| holds(&option.span, span))
    }

    /// A text that is no document of the kind it should be; `line` counts from 1.
    fn parse_error(&self, line: usize, text: String) -> Error {
        let path = PathBuf::from(&self.path);
        Error::Parse { path, line, text }
    }

    /// A warning at one place, rendered.
    pub fn warning(&self, span: &Range<usize>, title: &str, label: &str, remedy: &str) -> String {
        self.render(&[(span, label)], title, remedy)
    }

    /// Title, positions with their labels, and remedy.
    #[cfg(not(feature = "snippets"))]
    fn render(&self, marks: &[(&Range<usize>, &str)], title: &str, remedy: &str) -> String {
        let mut text = title.to_owned();
        for &(span, label) in marks.iter().filter(|(span, _)| !span.is_empty()) {
            let before = &self.text[..span.start];
            let line = before.matches('\n').count() + 1;
            let column = before.chars().rev().take_while(|&c| c != '\n').count() + 1;
            let origin = if span.start < self.file_length {
                format!("{}:{line}:{column}", self.path)
            } else {
                "option --set".to_owned()
            };
            text += &["\n --> ", &origin, ": ", label].concat();
        }
        if !remedy.is_empty() {
            text += &["\n  help: ", remedy].concat();
        }
        text
    }

    /// As above, with the lines themselves. The level's name is left to whoever prints, who has errors of other kinds to name too.
    #[cfg(feature = "snippets")]
    fn render(&self, marks: &[(&Range<usize>, &str)], title: &str, remedy: &str) -> String {
        let mut snippets: Vec<(Range<usize>, Snippet<_>)> = Vec::new();
        for &(span, label) in marks.iter().filter(|(span, _)| !span.is_empty()) {
            let option = self.option_at(span);
            let outer = option.map_or(0..self.file_length, |option| option.span.clone());
            let clip = |at: usize| at.clamp(outer.start, outer.end) - outer.start;
            let mark = AnnotationKind::Primary.span(clip(span.start)..clip(span.end)).label(label);
            if let Some((_, snippet)) = snippets.iter_mut().find(|(known, _)| *known == outer) {
                *snippet = snippet.clone().annotation(mark);
            } else {
                let path = if option.is_some() { "option --set" } else { &self.path };
                let snippet = Snippet::source(&self.text[outer.clone()]).path(path);
                snippets.push((outer, snippet.annotation(mark)));
            }
        }
        let mut group = Group::with_title(Level::ERROR.no_name().primary_title(title));
        if snippets.is_empty() {
            group = group.element(Origin::path(&self.path));
        }
        group = group.elements(snippets.into_iter().map(|(_, snippet)| snippet));
        if !remedy.is_empty() {
            group = group.element(Level::HELP.message(remedy));
        }
        Renderer::plain().render(&[group])
    }

    /// A place of at least one character, where the TOML reader points between two.
    fn visible(&self, span: Range<usize>) -> Range<usize> {
        match span.start {
            _ if !span.is_empty() => span,
            start if self.text[start..].starts_with(|c: char| c.is_ascii() && !c.is_control()) => {
                start..start + 1
            }
            start => start.saturating_sub(1)..start,
        }
    }

    /// The error of a text that is no TOML.
    pub(super) fn toml_error(&self, error: &toml::de::Error) -> Error {
        let span = error.span().map_or(0..0, |span| self.visible(span));
        if let Some((span, number)) = self.decimal_comma(span.start) {
            let title = "a number with a decimal comma";
            let remedy = format!("write {number}");
            return self.unreadable(&span, title, "a comma separates values", &remedy);
        }
        self.unreadable(&span, error.message().trim_end(), "here", "")
    }

    fn unreadable(&self, span: &Range<usize>, title: &str, label: &str, remedy: &str) -> Error {
        let before = self.text[..self.file_length].get(..span.start);
        let line = before.map_or(0, |text| text.matches('\n').count() + 1);
        self.parse_error(line, self.render(&[(span, label)], title, remedy))
    }

    /// An error in a value that the schema does not exclude.
    pub fn type_error(&self, error: &toml::de::Error) -> Error {
        let span = error.span().map_or(0..0, |span| self.visible(span));
        self.error(&span, error.message(), "here", "")
    }

    /// A number with a comma behind `=`, in the line of `at` and not behind it, and how to write it.
    fn decimal_comma(&self, at: usize) -> Option<(Range<usize>, String)> {
        let start = self.text[..at].rfind('\n').map_or(0, |newline| newline + 1);
        let line = self.text[start..].lines().next()?;
        let of_number = |c: char| c.is_ascii_digit() || "+-.eE_".contains(c);
        line.match_indices(',').rev().find_map(|(comma, _)| {
            let (before, behind) = (&line[..comma], &line[comma + 1..]);
            let key = before.trim_end_matches(of_number);
            let whole = &before[key.len()..];
            let part = &behind[..behind.find(|c| !of_number(c)).unwrap_or(behind.len())];
            let number = format!("{whole}.{part}");
            let meant = key.trim_end().ends_with('=') && part.starts_with(|c: char| c.is_ascii_digit());
            let found = start + key.len()..start + comma + 1 + part.len();
            (meant && start + comma <= at && number.parse::<f64>().is_ok()).then_some((found, number))
        })
    }
}

fn holds(outer: &Range<usize>, inner: &Range<usize>) -> bool {
    outer.start <= inner.start && inner.end <= outer.end
}

/// Path of the innermost key whose name or value holds a position.
fn innermost(value: &DeValue<'_>, at: &Range<usize>) -> Option<String> {
    let children: Vec<(String, Range<usize>, &Spanned<DeValue<'_>>)> = match value {
        DeValue::Table(table) => {
            table.iter().map(|(name, value)| (name.get_ref().to_string(), name.span(), value)).collect()
        }
        DeValue::Array(values) => {
            values.iter().enumerate().map(|(n, value)| (n.to_string(), value.span(), value)).collect()
        }
        _ => return None,
    };
    children.into_iter().find_map(|(name, span, value)| {
        let inner = innermost(value.get_ref(), at).map(|inner| format!("{name}.{inner}"));
        inner.or_else(|| (holds(&span, at) || holds(&value.span(), at)).then_some(name))
    })
}

/// The name closest to a misspelt one, if any is close.
pub fn nearest<'a>(wrong: &str, names: &[&'a str]) -> Option<&'a str> {
    names
        .iter()
        .map(|&name| (strsim::jaro_winkler(wrong, name), name))
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .filter(|(similarity, _)| *similarity > 0.75)
        .map(|(_, name)| name)
}
