//! The page in HTML, `report.html`: one file that asks for nothing else, whose elements a script makes move.
//!
//! Everything that comes from a case, a file or a name is escaped, and the policy of the page lets only the script and the style of this
//! program act, which bear a number that follows from all contents.

use super::section::{Block, Section, Span, spans};
use serde::Serialize;
use std::fmt::Write;
use turbid::output::picture::{Figure, Format};
use turbid_lab::checks::one_line;
use xxhash_rust::xxh3::xxh3_128;

const STYLE: &str = include_str!("style.css");
const SCRIPT: &str = include_str!("report.js");
/// Figures with more pixels across have a line of their own.
const WIDE: f32 = 1500.0;
/// Most columns of a table that stands beside another one.
const NARROW: usize = 3;

/// A page with this body, which is HTML, and a further script. It may `connect` only to where it comes from.
pub(crate) fn shell(title: &str, connect: bool, script: &str, body: &str) -> String {
    let title = escaped(title);
    let number = format!("{:032x}", xxh3_128(format!("{title}{script}{body}").as_bytes()));
    let connect = if connect { "connect-src 'self'; " } else { "" };
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data: blob:; {connect}\
         style-src 'nonce-{number}'; script-src 'nonce-{number}'; base-uri 'none'; form-action 'none'\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"referrer\" content=\"no-referrer\">\n\
         <link rel=\"icon\" href=\"data:,\">\n<title>{title}</title>\n\
         <style nonce=\"{number}\">\n{STYLE}</style>\n</head>\n<body>\n{body}\
         <script nonce=\"{number}\">\n{SCRIPT}{script}</script>\n</body>\n</html>\n"
    )
}

/// The report: a head, tables of all studies and of all runs, and the sections.
pub(super) fn page(title: &str, overviews: &[(Vec<&str>, Vec<Vec<String>>)], sections: &[Section]) -> String {
    let mut links = String::new();
    let mut main = String::new();
    for (columns, rows) in overviews {
        let _ = write!(main, "{}", table(columns, rows, &[], true));
    }
    for (at, section) in sections.iter().enumerate() {
        let id = format!("section-{at}");
        if !section.is_alone {
            let title = escaped(&section.title);
            let _ = write!(links, "<a href=\"#{id}\">{title}</a>");
            let _ = write!(main, "<section>\n<h2 id=\"{id}\">{title}</h2>\n");
        }
        let body = blocks(section, &id);
        main += &body;
        if section.is_alone {
            let headings = section.blocks.iter().enumerate().filter_map(|(at, block)| match block {
                Block::Heading(words) => Some((at, words.as_str())),
                Block::Html(words, _) if !words.is_empty() => Some((at, *words)),
                _ => None,
            });
            for (at, words) in headings {
                let _ = write!(links, "<a href=\"#{id}-{at}\">{}</a>", escaped(words));
            }
        } else {
            main += "</section>\n";
        }
    }
    let body = format!(
        "<header>\n<h1>{}</h1>\n<nav aria-label=\"Contents\">{links}</nav>\n</header>\n<main>\n{main}</main>\n\
         <footer>Drawn by <code>turbid report</code>, version {}.</footer>\n",
        escaped(title),
        env!("CARGO_PKG_VERSION")
    );
    shell(title, false, "", &body)
}

/// The blocks of a section; figures and tables that follow each other stand side by side where there is space.
pub(super) fn blocks(section: &Section, id: &str) -> String {
    let level = if section.is_alone { 2 } else { 3 };
    let mut html = String::new();
    let mut before = "";
    for (at, block) in section.blocks.iter().enumerate() {
        let kind = match block {
            Block::Figure { .. } => "figures",
            Block::Table { columns, .. } if columns.len() <= NARROW => "tables",
            _ => "",
        };
        if kind != before {
            html += if before.is_empty() { "" } else { "</div>\n" };
            if !kind.is_empty() {
                let _ = writeln!(html, "<div class=\"{kind}\">");
            }
            before = kind;
        }
        let sub = level + 1;
        let _ = match block {
            Block::Heading(words) => {
                writeln!(html, "<h{level} id=\"{id}-{at}\">{}</h{level}>", inline(words))
            }
            Block::Text(words) => writeln!(html, "<p>{}</p>", inline(words)),
            Block::Code(_, lines) => {
                writeln!(html, "<pre tabindex=\"0\"><code>{}</code></pre>", escaped(lines))
            }
            Block::Table { title, columns, rows } => {
                let columns: Vec<&str> = columns.iter().map(String::as_str).collect();
                let table = table(&columns, rows, &[], false);
                let title = match &**title {
                    "" => String::new(),
                    title => format!("<h{sub}>{}</h{sub}>\n", inline(title)),
                };
                writeln!(html, "<section>\n{title}{table}</section>")
            }
            Block::Figure { stem, title, figure: drawn, note } => {
                let files: String = section.files(stem).iter().map(file_link).collect();
                let note = format!("{} {files}", inline(note));
                writeln!(html, "{}", figure(title, drawn, note.trim(), sub))
            }
            Block::Link(words, file) => {
                writeln!(
                    html,
                    "<p>{}: <a href=\"{}\">{}</a>.</p>",
                    inline(words),
                    address(file),
                    escaped(file)
                )
            }
            Block::Warnings(all) => writeln!(html, "{}", warnings(all)),
            Block::Html("", elements) => writeln!(html, "{elements}"),
            Block::Html(words, elements) => {
                writeln!(html, "<h{level} id=\"{id}-{at}\">{words}</h{level}>\n{elements}")
            }
        };
    }
    html += if before.is_empty() { "" } else { "</div>\n" };
    html
}

fn file_link((format, file): &(Format, String)) -> String {
    format!("<a href=\"{}\">{}</a> ", address(file), format.extension().to_uppercase())
}

/// A figure with the values at its points; the note is HTML.
fn figure(title: &str, figure: &Figure, note: &str, level: usize) -> String {
    let note = if note.is_empty() { String::new() } else { format!("<p class=\"note\">{note}</p>\n") };
    let readings = figure.readings();
    let values = if readings.curves.is_empty() { String::new() } else { data(readings) };
    let title = inline(title);
    let class = if figure.size().0 > WIDE { " class=\"wide\"" } else { "" };
    format!(
        "<figure{class}>\n<h{level}>{title}</h{level}>\n<div class=\"plot\">{}</div>\n{note}{values}</figure>",
        figure.inline()
    )
}

/// Data for the script.
fn data(value: &impl Serialize) -> String {
    let json = serde_json::to_string(value).expect("plain data always serialises").replace('<', "\\u003c");
    format!("<script type=\"application/json\">{json}</script>\n")
}

/// A table that sorts; one with filters above it if `filters`. Rows may have addresses, to which their first cell leads.
pub(super) fn table(
    columns: &[&str],
    rows: &[Vec<String>],
    addresses: &[Option<String>],
    filters: bool,
) -> String {
    let filters = if filters { " data-filters" } else { "" };
    let mut html = format!("<div class=\"table\"{filters}>\n<table>\n<thead><tr>");
    let is_number = |column: usize| {
        let mut cells =
            rows.iter().filter_map(|row| row.get(column)).map(|cell| cell.trim_start_matches(['+', '-']));
        cells.all(|cell| cell.is_empty() || cell.starts_with(|c: char| c.is_ascii_digit()))
    };
    let classes: Vec<&str> =
        (0..columns.len()).map(|column| if is_number(column) { " class=\"number\"" } else { "" }).collect();
    for (column, class) in columns.iter().zip(&classes) {
        let _ = write!(html, "<th scope=\"col\"{class}>{}</th>", inline(&one_line(column)));
    }
    html += "</tr></thead>\n<tbody>\n";
    for (at, row) in rows.iter().enumerate() {
        html += "<tr>";
        let cells = row.iter().map(String::as_str).chain(std::iter::repeat(""));
        for (column, (cell, class)) in cells.zip(&classes).enumerate() {
            let text = inline(&one_line(cell));
            let _ = match addresses.get(at).and_then(Option::as_ref).filter(|_| column == 0) {
                Some(to) => write!(html, "<td{class}><a href=\"{}\">{text}</a></td>", address(to)),
                None => write!(html, "<td{class}>{text}</td>"),
            };
        }
        html += "</tr>\n";
    }
    html + "</tbody>\n</table>\n</div>\n"
}

/// A list of warnings.
fn warnings(warnings: &[String]) -> String {
    let items: Vec<String> = warnings.iter().map(|text| inline(text)).collect();
    let items = format!("<li>{}</li>\n", items.join("</li>\n<li>"));
    format!(
        "<section class=\"warnings\" aria-label=\"Warnings\">\n<strong>Warnings</strong>\n<ul>\n{items}</ul>\n</section>"
    )
}

/// Text as HTML, also in attributes.
pub(crate) fn escaped(text: &str) -> String {
    let mut html = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => html += "&amp;",
            '<' => html += "&lt;",
            '>' => html += "&gt;",
            '"' => html += "&quot;",
            '\'' => html += "&#39;",
            c => html.push(c),
        }
    }
    html
}

/// Text as HTML, with its [`spans`].
pub(super) fn inline(text: &str) -> String {
    let in_html = |span: Span| match span {
        Span::Plain(text) => escaped(text),
        Span::Code(text) => format!("<code>{}</code>", escaped(text)),
        Span::Strong(text) => format!("<strong>{text}</strong>"),
    };
    spans(text).into_iter().map(in_html).collect()
}

/// Address of a file by its path from the page; it cannot name a scheme or a host.
pub(super) fn address(path: &str) -> String {
    let mut address = String::from("./");
    for byte in path.bytes() {
        let plain = byte.is_ascii_alphanumeric() || b"-_.~/".contains(&byte);
        let _ = if plain { write!(address, "{}", char::from(byte)) } else { write!(address, "%{byte:02X}") };
    }
    address
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_comes_from_others_stays_text() {
        assert_eq!(inline("<b> & `<i>` **x** `"), "&lt;b&gt; &amp; <code>&lt;i&gt;</code> **x** `");
        assert_eq!(inline("**FAIL**"), "<strong>FAIL</strong>");
        assert_eq!(address("a b/javascript:\"x"), "./a%20b/javascript%3A%22x");
        let values = data(&["</script><script>alert(1)</script>"]);
        assert_eq!(values.matches("</script>").count(), 1, "{values}");
    }
}
