//! Text as outlines of an embedded font (`DejaVu` Sans), so that figures look the same on every machine.

use std::sync::OnceLock;
use tiny_skia::{Path, PathBuilder};
use ttf_parser::{Face, GlyphId, OutlineBuilder};

/// A piece of text in one style.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Span {
    pub(crate) text: String,
    pub(crate) italic: bool,
    /// Rise over the font size: positive is a superscript.
    pub(crate) rise: f32,
}

fn span(text: impl Into<String>, italic: bool, rise: f32) -> Span {
    let text = text.into();
    Span { text, italic, rise }
}

/// Upright text.
pub(crate) fn roman(text: impl Into<String>) -> Span {
    span(text, false, 0.0)
}

/// A symbol.
pub(crate) fn italic(text: impl Into<String>) -> Span {
    span(text, true, 0.0)
}

/// A subscript.
pub(crate) fn below(text: impl Into<String>) -> Span {
    span(text, false, -0.22)
}

/// A superscript.
pub(crate) fn above(text: impl Into<String>) -> Span {
    span(text, false, 0.32)
}

/// Size of subscripts and superscripts over that of the text.
const SCRIPT_SIZE: f32 = 0.72;

/// A glyph of a line of text that starts at the origin with its baseline on `y = 0`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Glyph {
    pub(crate) italic: bool,
    /// Its number in the font.
    pub(crate) id: u16,
    /// Its own origin (pixels, y down).
    pub(crate) at: (f32, f32),
    /// Pixels per unit of the font.
    pub(crate) scale: f32,
}

/// The glyphs of a line of text, and its width (pixels).
pub(crate) fn glyphs(spans: &[Span], size: f32) -> (Vec<Glyph>, f32) {
    let mut glyphs = Vec::new();
    let mut x = 0.0;
    for span in spans {
        let face = face(span.italic);
        let script = if span.rise == 0.0 { 1.0 } else { SCRIPT_SIZE };
        let scale = script * size / f32::from(face.units_per_em());
        let mut previous = None;
        for character in span.text.chars() {
            let glyph = face.glyph_index(character).unwrap_or(GlyphId(0));
            if let Some(previous) = previous {
                x += scale * f32::from(kerning(face, previous, glyph));
            }
            glyphs.push(Glyph { italic: span.italic, id: glyph.0, at: (x, -span.rise * size), scale });
            x += scale * f32::from(face.glyph_hor_advance(glyph).unwrap_or(0));
            previous = Some(glyph);
        }
    }
    (glyphs, x)
}

/// Width of a line of text (pixels).
pub(crate) fn width(spans: &[Span], size: f32) -> f32 {
    glyphs(spans, size).1
}

/// The largest width of lines of text (pixels), 0 without lines.
pub(crate) fn widest<S: AsRef<[Span]>>(lines: impl IntoIterator<Item = S>, size: f32) -> f32 {
    let widths = lines.into_iter().map(|line| width(line.as_ref(), size));
    widths.fold(0.0, f32::max)
}

/// Outline of a glyph in units of the font, y down; none of a blank.
pub(crate) fn outline(italic: bool, id: u16) -> Option<Path> {
    let mut pen = Pen(PathBuilder::new());
    face(italic).outline_glyph(GlyphId(id), &mut pen);
    pen.0.finish()
}

fn face(italic: bool) -> &'static Face<'static> {
    static ROMAN: OnceLock<Face<'static>> = OnceLock::new();
    static ITALIC: OnceLock<Face<'static>> = OnceLock::new();
    let parse = |data| Face::parse(data, 0).expect("the embedded font is whole");
    if italic {
        ITALIC.get_or_init(|| parse(dejavu::sans::oblique()))
    } else {
        ROMAN.get_or_init(|| parse(dejavu::sans::regular()))
    }
}

fn kerning(face: &Face, left: GlyphId, right: GlyphId) -> i16 {
    let tables = face.tables().kern.map(|table| table.subtables);
    let mut tables = tables.into_iter().flatten().filter(|t| t.horizontal && !t.variable);
    tables.find_map(|table| table.glyphs_kerning(left, right)).unwrap_or(0)
}

/// Collects an outline of the font, whose y points up.
struct Pen(PathBuilder);

impl OutlineBuilder for Pen {
    fn move_to(&mut self, x: f32, y: f32) {
        self.0.move_to(x, -y);
    }
    fn line_to(&mut self, x: f32, y: f32) {
        self.0.line_to(x, -y);
    }
    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        self.0.quad_to(x1, -y1, x, -y);
    }
    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        self.0.cubic_to(x1, -y1, x2, -y2, x, -y);
    }
    fn close(&mut self) {
        self.0.close();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_has_the_requested_size_and_scripts_are_smaller() {
        let (glyph, advance) = (glyphs(&[roman("H")], 100.0).0[0], width(&[roman("H")], 100.0));
        let bounds = outline(false, glyph.id).unwrap().bounds();
        let height = glyph.scale * bounds.height();
        assert!((height - 72.9).abs() < 0.5, "cap height of the font");
        assert!(bounds.bottom().abs() < 0.01, "stands on the baseline");
        assert!(advance > glyph.scale * bounds.right());
        let index = glyphs(&[below("H")], 100.0).0[0];
        assert!(index.at.1 > 20.0 && index.scale < 0.8 * glyph.scale);
    }

    #[test]
    fn every_symbol_used_in_figures_is_in_the_font() {
        for symbol in "\u{2212}\u{b1}\u{b5}\u{d7}\u{2013}\u{2026}*/^0123456789()".chars() {
            assert!(face(false).glyph_index(symbol).is_some(), "{symbol:?}");
        }
    }

    #[test]
    fn pairs_are_kerned() {
        let apart = width(&[roman("A")], 100.0) + width(&[roman("V")], 100.0);
        assert!(width(&[roman("AV")], 100.0) < apart - 1.0);
    }
}
