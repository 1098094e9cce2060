//! A section of a page: markdown, and the figures that it shows.

use super::FIGURES;
use crate::checks::{markdown_table, one_line};
use turbid::output::picture::{Figure, Format};

/// The description of one run or study.
pub(super) struct Section {
    pub(super) title: String,
    /// Heads and values for the table at the head of a page with several sections, the same heads for all of a kind.
    pub(super) row: Vec<(&'static str, String)>,
    /// Checks that passed, and all of them.
    pub(super) checks: [usize; 2],
    pub(super) markdown: String,
    /// File names without their endings.
    pub(super) figures: Vec<(String, Figure)>,
    /// True if it is the only one of the page.
    pub(super) is_alone: bool,
    /// Beginning of the file names of figures.
    prefix: String,
    formats: Vec<Format>,
}

impl Section {
    /// Without contents, about the run or study of this name.
    pub(super) fn new(name: &str, is_alone: bool, formats: &[Format]) -> Self {
        Self {
            title: name.to_string(),
            row: Vec::new(),
            checks: [0; 2],
            markdown: String::new(),
            figures: Vec::new(),
            is_alone,
            prefix: if is_alone { String::new() } else { format!("{}_", plain(name)) },
            formats: formats.to_vec(),
        }
    }

    /// Adds a paragraph.
    pub(super) fn text(&mut self, words: &str) {
        self.markdown += words;
        self.markdown += "\n\n";
    }

    /// Adds a heading.
    pub(super) fn heading(&mut self, words: &str) {
        let level = if self.is_alone { "##" } else { "###" };
        self.text(&format!("{level} {}", one_line(words)));
    }

    fn sub_heading(&mut self, words: &str) {
        let level = if self.is_alone { "###" } else { "####" };
        self.text(&format!("{level} {}", one_line(words)));
    }

    /// Adds a table; an empty title is left out.
    pub(super) fn table(&mut self, title: &str, columns: &[&str], rows: &[Vec<String>]) {
        if !title.is_empty() {
            self.sub_heading(title);
        }
        self.markdown += &markdown_table(columns, rows);
        self.markdown.push('\n');
    }

    /// Adds a figure with a note below it, which may be empty.
    pub(super) fn figure(&mut self, name: &str, title: &str, figure: Figure, note: &str) {
        let stem = format!("{}{}", self.prefix, plain(name));
        let has = |format| self.formats.contains(&format);
        let file = |format: Format| format!("{FIGURES}/{stem}.{}", format.extension());
        let shown = if has(Format::Png) { Format::Png } else { Format::Svg };
        let mut below = one_line(note);
        if has(Format::Png) && has(Format::Svg) {
            let link = format!("[SVG]({})", file(Format::Svg));
            below = if below.is_empty() { link } else { format!("{below} {link}") };
        }
        let image = format!("![{}]({})", one_line(title), file(shown));
        self.figures.push((stem, figure));
        self.sub_heading(title);
        self.text(&image);
        if !below.is_empty() {
            self.text(&below);
        }
    }
}

/// A name with only those characters that are good for a file.
pub(super) fn plain(text: &str) -> String {
    text.replace(|c: char| !c.is_ascii_alphanumeric() && !"-_.".contains(c), "_")
}
