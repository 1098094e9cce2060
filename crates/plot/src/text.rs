//! Text as outlines of an embedded font (`DejaVu` Sans), so that figures look the same on every machine.

use crate::markup::{Span, spans};
use std::sync::LazyLock;
use tiny_skia::{Path, PathBuilder, Transform};
use ttf_parser::{Face, GlyphId, OutlineBuilder};

/// Size of subscripts and superscripts over that of the text.
const SCRIPT_SIZE: f32 = 0.72;

/// The upright and the oblique font.
static FACES: LazyLock<[Face<'static>; 2]> = LazyLock::new(|| {
    [dejavu::sans::regular(), dejavu::sans::oblique()]
        .map(|data| Face::parse(data, 0).expect("the embedded font is whole"))
});

/// The outlines of a line of text that starts at the origin with its baseline on `y = 0` (pixels, y down), if there is
/// anything to see, and its width (pixels).
pub(crate) fn line(text: &str, size: f32) -> (Option<Path>, f32) {
    let mut line = PathBuilder::new();
    let mut x = 0.0;
    for Span { text, italic, rise } in spans(text) {
        let face = &FACES[usize::from(italic)];
        let script = if rise == 0.0 { 1.0 } else { SCRIPT_SIZE };
        let scale = script * size / f32::from(face.units_per_em());
        let mut previous = None;
        for character in text.chars() {
            let glyph = face.glyph_index(character).unwrap_or(GlyphId(0));
            if let Some(previous) = previous {
                x += scale * f32::from(kerning(face, previous, glyph));
            }
            let mut pen = Pen(PathBuilder::new());
            face.outline_glyph(glyph, &mut pen);
            let position = Transform::from_scale(scale, scale).post_translate(x, -rise * size);
            if let Some(outline) = pen.0.finish().and_then(|outline| outline.transform(position)) {
                line.push_path(&outline);
            }
            x += scale * f32::from(face.glyph_hor_advance(glyph).unwrap_or(0));
            previous = Some(glyph);
        }
    }
    (line.finish(), x)
}

fn kerning(face: &Face, left: GlyphId, right: GlyphId) -> i16 {
    let tables = face.tables().kern.map(|table| table.subtables);
    let mut tables = tables.into_iter().flatten().filter(|t| t.horizontal && !t.variable);
    tables.find_map(|table| table.glyphs_kerning(left, right)).unwrap_or(0)
}

/// Width of a line of text (pixels).
pub(crate) fn width(text: &str, size: f32) -> f32 {
    line(text, size).1
}

/// The largest width of lines of text (pixels), 0 without lines.
pub(crate) fn widest<'a>(lines: impl IntoIterator<Item = &'a str>, size: f32) -> f32 {
    lines.into_iter().map(|line| width(line, size)).fold(0.0, f32::max)
}

/// Lines of a text no wider than `space` (pixels), broken at blanks, but not at no-break spaces.
pub(crate) fn wrapped(text: &str, size: f32, space: f32) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_ascii_whitespace() {
        match lines.last_mut() {
            Some(line) if width(&format!("{line} {word}"), size) <= space => line.extend([" ", word]),
            _ => lines.push(word.to_string()),
        }
    }
    lines
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
        let bounds = |text| line(text, 100.0).0.unwrap().bounds();
        let [capitals, index] = ["HE", "u_H"].map(bounds);
        assert!((capitals.height() - 72.9).abs() < 0.5, "cap height of the font");
        assert!(capitals.bottom().abs() < 0.01, "stands on the baseline");
        assert!(capitals.right() < width("HE", 100.0));
        assert!(index.bottom() > 20.0 && width("u_H", 100.0) < 0.9 * width("uH", 100.0));
    }

    #[test]
    fn every_symbol_used_in_figures_is_in_the_font() {
        for symbol in "\u{2212}\u{b1}\u{b5}\u{d7}\u{2013}\u{2026}\u{a0}*/^0123456789()".chars() {
            assert!(FACES[0].glyph_index(symbol).is_some(), "{symbol:?}");
        }
    }

    #[test]
    fn pairs_are_kerned() {
        assert!(width("(AV)", 100.0) < width("(A)", 100.0) + width("(V)", 100.0) - width("()", 100.0) - 1.0);
    }
}
