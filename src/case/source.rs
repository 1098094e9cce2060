//! The text of a case: the file, and behind it the `--set` options, so that every place has one number.

use crate::error::{Error, Result};
use crate::input;
use annotate_snippets::{AnnotationKind, Group, Level, Origin, Renderer, Snippet};
use serde::Deserialize;
use std::ops::Range;
use std::path::Path;
use toml::de::DeTable;

/// Text of the case file followed by the options, one per line.
#[derive(Debug)]
pub(crate) struct Source {
    /// Path of the file as the user gave it.
    pub(crate) path: String,
    /// File, then options.
    pub(crate) text: String,
    /// Length of the file.
    pub(crate) file_length: usize,
    /// The options.
    pub(crate) options: Vec<GivenOption>,
}

/// One `--set` option.
#[derive(Debug)]
pub(crate) struct GivenOption {
    /// Where it stands in [`Source::text`].
    pub(crate) span: Range<usize>,
    /// `v=` and its value, behind so many blanks that every part of the value has its place in [`Source::text`].
    pub(crate) shifted: String,
}

impl Source {
    /// Reads the file and appends the options.
    pub(crate) fn read(path: &Path, options: &[String]) -> Result<Self> {
        let bytes = input::read(path, input::CASE).map_err(|e| Error::io("read", path, e))?;
        let text = String::from_utf8(bytes).map_err(|e| {
            let good = &e.as_bytes()[..e.utf8_error().valid_up_to()];
            let line = good.split(|&byte| byte == b'\n').count();
            let shown = path.display();
            Error::Input(format!(
                "{shown}:{line}: not UTF-8 text; save the case file as UTF-8"
            ))
        })?;
        Ok(Self::new(path.display().to_string(), text, options))
    }

    /// From text.
    pub(crate) fn new(path: String, mut text: String, options: &[String]) -> Self {
        let file_length = text.len();
        let options = options
            .iter()
            .map(|option| {
                text.push('\n');
                let start = text.len();
                text.push_str(option);
                let value = option.find('=').map_or(option.len(), |i| i + 1);
                GivenOption {
                    span: start..text.len(),
                    shifted: format!("{}v={}", " ".repeat(start + value - 2), &option[value..]),
                }
            })
            .collect();
        Self {
            path,
            text,
            file_length,
            options,
        }
    }

    /// The document with the options applied, as typed values and as text.
    pub(crate) fn parse<T: for<'de> Deserialize<'de>>(&self) -> Result<(T, String)> {
        let mut tree = DeTable::parse(&self.text[..self.file_length]).map_err(|e| self.toml_error(&e))?;
        for option in &self.options {
            self.apply(option, tree.get_mut())?;
        }
        let deserializer = toml::de::Deserializer::from(tree.clone());
        let typed = T::deserialize(deserializer).map_err(|e| self.toml_error(&e))?;
        if self.options.is_empty() {
            return Ok((typed, self.text.clone()));
        }
        let table =
            toml::Table::deserialize(toml::de::Deserializer::from(tree)).map_err(|e| self.toml_error(&e))?;
        let text = toml::to_string(&table).expect("a parsed document can be written");
        Ok((typed, text))
    }

    /// An error at one place.
    pub(crate) fn error(&self, span: &Range<usize>, title: &str, label: &str, remedy: &str) -> Error {
        self.error_at(&[(span, label)], title, remedy)
    }

    /// An error that several places make together.
    pub(crate) fn error_at(&self, places: &[(&Range<usize>, &str)], title: &str, remedy: &str) -> Error {
        Error::Input(self.render(places, title, remedy))
    }

    /// A warning at one place, rendered.
    pub(crate) fn warning(&self, span: &Range<usize>, title: &str, label: &str, remedy: &str) -> String {
        self.render(&[(span, label)], title, remedy)
    }

    /// The level's name is left to whoever prints, who has errors of other kinds to name too.
    fn render(&self, places: &[(&Range<usize>, &str)], title: &str, remedy: &str) -> String {
        let mut snippets: Vec<(Range<usize>, Snippet<_>)> = Vec::new();
        for &(span, label) in places.iter().filter(|(span, _)| !span.is_empty()) {
            let spans = self.options.iter().map(|option| option.span.clone());
            let whole = 0..self.file_length;
            let outer = spans
                .into_iter()
                .find(|outer| outer.start <= span.start && span.end <= outer.end)
                .unwrap_or(whole.clone());
            let clip = |at: usize| at.clamp(outer.start, outer.end) - outer.start;
            let mark = AnnotationKind::Primary
                .span(clip(span.start)..clip(span.end))
                .label(label);
            if let Some((_, snippet)) = snippets.iter_mut().find(|(known, _)| *known == outer) {
                *snippet = snippet.clone().annotation(mark);
            } else {
                let path = if outer == whole {
                    &self.path
                } else {
                    "option --set"
                };
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

    /// What the TOML reader says, in the words of this program, with a suggestion.
    pub(crate) fn toml_error(&self, error: &toml::de::Error) -> Error {
        let span = error.span().map_or(0..0, |span| self.visible(span));
        let message = error.message();
        let quoted: Vec<&str> = message.split('`').skip(1).step_by(2).collect();
        let (title, label, remedy) = if message.starts_with("unknown") && !quoted.is_empty() {
            let kind = if message.starts_with("unknown field") {
                "key"
            } else {
                "choice"
            };
            let remedy = match nearest(quoted[0], &quoted[1..]) {
                Some(near) => format!("did you mean `{near}`? known here: {}", quoted[1..].join(", ")),
                None => format!("known here: {}", quoted[1..].join(", ")),
            };
            (
                format!("unknown {kind} `{}`", quoted[0]),
                format!("unknown {kind}"),
                remedy,
            )
        } else if message.starts_with("missing field") && !quoted.is_empty() {
            let title = format!("the key `{}` is missing", quoted[0]);
            (title, "must be given here".to_string(), String::new())
        } else if message.contains("exactly 1 element") {
            let title = "exactly one of several alternatives must be given".to_string();
            let label = message.rsplit(", ").next().unwrap_or_default().to_string();
            (title, label, "keep one of them".to_string())
        } else if message == "wanted string or table" {
            let title = "a number or list where one of several alternatives must be named".to_string();
            let remedy = "e.g. { steps = 100 }, { time = 0.5 } or { stokes_times = 10 }; \"never\" switches an output off";
            (title, "which unit is this?".to_string(), remedy.to_string())
        } else {
            let title = message
                .replace("expected f64", "expected a number")
                .replace("expected u64", "expected a whole number of at least 0")
                .replace("expected u32", "expected a whole number of at least 0")
                .replace("expected usize", "expected a whole number of at least 0");
            (title, "here".to_string(), String::new())
        };
        self.error(&span, title.trim_end(), &label, &remedy)
    }
}

/// The name closest to a misspelt one, if any is close.
pub(crate) fn nearest<'a>(wrong: &str, names: &[&'a str]) -> Option<&'a str> {
    names
        .iter()
        .map(|&name| (strsim::jaro_winkler(wrong, name), name))
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .filter(|(similarity, _)| *similarity > 0.75)
        .map(|(_, name)| name)
}
