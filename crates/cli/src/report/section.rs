//! A section of a page: its blocks, from which both `REPORT.md` and `report.html` are made.

use super::{FIGURES, markdown};
use turbid::output::picture::{Figure, Format};
use turbid_lab::checks::{markdown_table, one_line};

/// The description of one run or study.
pub(super) struct Section {
    pub(super) title: String,
    /// Heads and values for the table at the head of a page with several sections, the same heads for all of a kind.
    pub(super) row: Vec<(&'static str, String)>,
    /// Checks that passed, and all of them.
    pub(super) checks: [usize; 2],
    /// In the order of the page.
    pub(super) blocks: Vec<Block>,
    /// True if it is the only one of the page.
    pub(super) is_alone: bool,
    /// Beginning of the file names of figures.
    prefix: String,
    formats: Vec<Format>,
}

/// A part of a line of text.
pub(super) enum Span<'a> {
    Plain(&'a str),
    Code(&'a str),
    Strong(&'a str),
}

/// The parts of a line: `` `code` `` where something stands between two marks, and a line that is a verdict in capitals, `**FAIL**`,
/// which no case, file or name has written, as a whole.
pub(super) fn spans(text: &str) -> Vec<Span<'_>> {
    let capitals = |word: &&str| !word.is_empty() && word.bytes().all(|byte| byte.is_ascii_uppercase());
    if let Some(word) = text.strip_prefix("**").and_then(|rest| rest.strip_suffix("**")).filter(capitals) {
        return vec![Span::Strong(word)];
    }
    let (mut spans, mut plain, mut at) = (Vec::new(), 0, 0);
    let mark = |from: usize| text[from..].find('`').map(|n| from + n);
    while let Some((open, close)) = mark(at).and_then(|open| Some((open, mark(open + 1)?))) {
        if close > open + 1 {
            spans.extend([Span::Plain(&text[plain..open]), Span::Code(&text[open + 1..close])]);
            plain = close + 1;
        }
        at = close + 1;
    }
    spans.push(Span::Plain(&text[plain..]));
    spans
}

/// A part of a section. Words may hold `` `code` ``.
pub(super) enum Block {
    Heading(String),
    Text(String),
    /// Lines in a language.
    Code(&'static str, String),
    /// Its title may be empty.
    Table {
        title: String,
        columns: Vec<String>,
        rows: Vec<Vec<String>>,
    },
    /// File name without its ending, and a note, which may be empty.
    Figure {
        stem: String,
        title: String,
        figure: Figure,
        note: String,
    },
    /// Words before a file beside the page, and its name.
    Link(String, String),
    Warnings(Vec<String>),
    /// Elements that only `report.html` shows, below a heading, which may be empty.
    Html(&'static str, String),
}

impl Section {
    /// Without contents, about the run or study of this name.
    pub(super) fn new(name: &str, is_alone: bool, formats: &[Format]) -> Self {
        Self {
            title: name.to_string(),
            row: Vec::new(),
            checks: [0; 2],
            blocks: Vec::new(),
            is_alone,
            prefix: if is_alone { String::new() } else { format!("{}_", plain(name)) },
            formats: formats.to_vec(),
        }
    }

    /// Adds a paragraph.
    pub(super) fn text(&mut self, words: &str) {
        self.blocks.push(Block::Text(words.to_string()));
    }

    /// Adds a heading.
    pub(super) fn heading(&mut self, words: &str) {
        self.blocks.push(Block::Heading(one_line(words)));
    }

    /// Adds a table; an empty title is left out.
    pub(super) fn table(&mut self, title: &str, columns: &[&str], rows: Vec<Vec<String>>) {
        let columns = columns.iter().map(ToString::to_string).collect();
        self.blocks.push(Block::Table { title: one_line(title), columns, rows });
    }

    /// Adds a figure with a note below it, which may be empty.
    pub(super) fn figure(&mut self, name: &str, title: &str, figure: Figure, note: &str) {
        let stem = format!("{}{}", self.prefix, plain(name));
        self.blocks.push(Block::Figure { stem, title: one_line(title), figure, note: one_line(note) });
    }

    /// File names of its figures without their endings, and the figures.
    pub(super) fn figures(&self) -> impl Iterator<Item = (&str, &Figure)> + Clone {
        self.blocks.iter().filter_map(|block| match block {
            Block::Figure { stem, figure, .. } => Some((stem.as_str(), figure)),
            _ => None,
        })
    }

    /// Files of a figure that are written, below the folder of the page.
    pub(super) fn files(&self, stem: &str) -> Vec<(Format, String)> {
        let file = |format: &Format| (*format, format!("{FIGURES}/{stem}.{}", format.extension()));
        self.formats.iter().map(file).collect()
    }

    /// Its text for `REPORT.md`.
    pub(super) fn markdown(&self) -> String {
        self.blocks.iter().map(|block| self.in_markdown(block)).collect()
    }

    fn in_markdown(&self, block: &Block) -> String {
        let level = if self.is_alone { "##" } else { "###" };
        let below = |title: &str| format!("{level}# {}\n\n", markdown::inline(title));
        match block {
            Block::Heading(words) => format!("{level} {}\n\n", markdown::inline(words)),
            Block::Text(words) => format!("{}\n\n", markdown::inline(words)),
            Block::Code(language, lines) => markdown::code(language, lines),
            Block::Table { title, columns, rows } => {
                let columns: Vec<&str> = columns.iter().map(String::as_str).collect();
                let title = if title.is_empty() { title.clone() } else { below(title) };
                format!("{title}{}\n", table(&columns, rows))
            }
            Block::Warnings(warnings) => format!("**Warnings**\n\n{}", markdown::warnings(warnings)),
            Block::Figure { stem, title, note, .. } => {
                let files = self.files(stem);
                let of = |format| files.iter().find(|file| file.0 == format).map(|file| &file.1);
                let shown = of(Format::Svg).or(of(Format::Png)).map_or("", String::as_str);
                let note = match note.as_str() {
                    "" => String::new(),
                    note => markdown::inline(note) + "\n\n",
                };
                format!("{}![{}]({shown})\n\n{note}", below(title), markdown::inline(title))
            }
            // Names of files are plain.
            Block::Link(words, file) => format!("{words}: [{file}]({file}).\n\n"),
            Block::Html(..) => String::new(),
        }
    }
}

/// A table in markdown, of cells that are text.
pub(super) fn table(columns: &[&str], rows: &[Vec<String>]) -> String {
    let columns: Vec<String> = columns.iter().map(|head| markdown::cell(head)).collect();
    let columns: Vec<&str> = columns.iter().map(String::as_str).collect();
    let rows: Vec<Vec<String>> =
        rows.iter().map(|row| row.iter().map(|cell| markdown::cell(cell)).collect()).collect();
    markdown_table(&columns, &rows)
}

/// A name with only those characters that are good for a file; `+` is in names of walls.
pub(super) fn plain(text: &str) -> String {
    text.replace(|c: char| !c.is_ascii_alphanumeric() && !"-_.+".contains(c), "_")
}
