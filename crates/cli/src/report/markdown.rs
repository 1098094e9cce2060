//! Text in `REPORT.md`: what comes from a case, a file or a name is text there, and neither HTML nor a link, a heading or a fence.

use super::section::{Span, spans};

/// Characters that begin something else at the start of a line.
const AT_START: [char; 5] = ['#', '-', '+', '=', '~'];

/// Text of a line, with its [`spans`].
pub(super) fn inline(words: &str) -> String {
    let text = cell(words);
    let rest = text.trim_start_matches(['*', '_']);
    // An item of a list, or a line.
    let begins = rest.len() < text.len() && (rest.is_empty() || rest.starts_with(' '));
    if begins || text.starts_with(AT_START) { format!("\\{text}") } else { text }
}

/// The same within a line, as in a cell of a table.
pub(super) fn cell(words: &str) -> String {
    let words = turbid_lab::checks::one_line(words);
    let spans = spans(&words);
    let last = spans.len() - 1;
    let in_markdown = |(at, span): (usize, &Span)| match span {
        Span::Plain(text) => {
            let [before, after] = [at == 0, at == last].map(|edge| if edge { ' ' } else { '`' });
            marked(text, before, after)
        }
        Span::Code(text) => format!("`{text}`"),
        Span::Strong(text) => format!("**{text}**"),
    };
    spans.iter().enumerate().map(in_markdown).collect()
}

/// Text between two characters, in which nothing is emphasised or struck out: of `*`, `_` and `~` those are escaped that could begin
/// it by the rules of `CommonMark`.
fn marked(text: &str, before: char, after: char) -> String {
    let is_sign = |c: char| !c.is_alphanumeric() && !c.is_whitespace();
    let (mut marked, mut previous, mut rest) = (String::with_capacity(text.len()), before, text);
    while let Some(mark) = rest.chars().next() {
        let length = rest.find(|c| c != mark).unwrap_or(rest.len());
        let (run, tail) = rest.split_at(length);
        let next = tail.chars().next().unwrap_or(after);
        let opens =
            !next.is_whitespace() && (is_sign(previous) || previous.is_whitespace() || !is_sign(next));
        // Within a word it is part of the name.
        let opens = opens && (mark != '_' || !previous.is_alphanumeric());
        if opens && ['*', '_', '~'].contains(&mark) {
            marked.extend(run.chars().flat_map(|c| ['\\', c]));
        } else {
            marked += &escaped(run);
        }
        (previous, rest) = (mark, tail);
    }
    marked
}

fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped += "&amp;",
            '<' => escaped += "&lt;",
            '>' => escaped += "&gt;",
            '\\' | '[' | ']' | '`' => escaped.extend(['\\', c]),
            c => escaped.push(c),
        }
    }
    escaped
}

/// Lines as they are, in a language, between fences that are in none of them.
pub(super) fn code(language: &str, lines: &str) -> String {
    let runs = lines.split(|c| c != '`').map(str::len);
    let fence = "`".repeat(3.max(1 + runs.max().unwrap_or(0)));
    format!("{fence}{language}\n{lines}\n{fence}\n\n")
}

/// A list of warnings, some of which quote lines of a file.
pub(super) fn warnings(warnings: &[String]) -> String {
    let item = |warning: &String| match warning.trim_end() {
        line if !line.contains('\n') => format!("- {}\n\n", inline(line)),
        lines => code("text", lines),
    };
    warnings.iter().map(item).collect::<String>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_comes_from_others_stays_text() {
        for (given, escaped) in [
            ("<img src=x> & [a](b) \\", "&lt;img src=x&gt; &amp; \\[a\\](b) \\\\"),
            ("# no heading\n## none", "\\# no heading ## none"),
            ("~~~", "\\~~~"),
            ("*a* _b_ ~~c~~ d*e*", "\\*a* \\_b_ \\~\\~c~~ d\\*e*"),
            ("series_every at t* = 2 * 3, (t*)", "series_every at t* = 2 * 3, (t*)"),
            ("**t* x** **", "\\*\\*t* x** **"),
            ("* item", "\\* item"),
            ("***", "\\***"),
            ("**FAIL**", "**FAIL**"),
            ("**Mine** is **FAIL**", "\\*\\*Mine** is \\*\\*FAIL**"),
            ("is `run.end` **x** `", "is `run.end` \\*\\*x** \\`"),
            // A span must not end elsewhere than it seems to: what it held would be read as HTML.
            ("`<b>```", "`<b>`\\`\\`"),
            ("`<b>``", "`<b>`\\`"),
        ] {
            assert_eq!(inline(given), escaped, "{given}");
        }
    }

    #[test]
    fn no_line_ends_the_fence_it_is_in() {
        let lines = "a\n```\n<b>\n`````";
        assert_eq!(code("toml", lines), format!("``````toml\n{lines}\n``````\n\n"));
        assert!(code("sh", "x").starts_with("```sh\n"));
    }
}
