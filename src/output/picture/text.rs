//! Text as outlines of an embedded font (`DejaVu` Sans), so that pictures look the same on every machine.

use std::borrow::Cow;
use std::sync::OnceLock;
use tiny_skia::{Path, PathBuilder, PathSegment, Transform};
use ttf_parser::{Face, GlyphId, OutlineBuilder};

/// A piece of text in one style.
#[derive(Clone, Debug)]
pub(super) struct Span<'a> {
    text: Cow<'a, str>,
    italic: bool,
    /// Rise over the font size: positive is a superscript.
    rise: f32,
}

/// Upright text.
pub(super) fn roman<'a>(text: impl Into<Cow<'a, str>>) -> Span<'a> {
    Span {
        text: text.into(),
        italic: false,
        rise: 0.0,
    }
}

/// A symbol.
pub(super) fn italic<'a>(text: impl Into<Cow<'a, str>>) -> Span<'a> {
    Span {
        italic: true,
        ..roman(text)
    }
}

/// An index below the line.
pub(super) fn below<'a>(text: impl Into<Cow<'a, str>>) -> Span<'a> {
    Span {
        rise: -0.22,
        ..roman(text)
    }
}

/// A mark above the line.
pub(super) fn above<'a>(text: impl Into<Cow<'a, str>>) -> Span<'a> {
    Span {
        rise: 0.32,
        ..roman(text)
    }
}

#[cfg(test)]
impl Span<'_> {
    /// Its text, whether it is a symbol, and its rise.
    pub(super) fn parts(&self) -> (&str, bool, f32) {
        (&self.text, self.italic, self.rise)
    }
}

/// Size of indices and marks over that of the text.
const SCRIPT_SIZE: f32 = 0.72;

/// A glyph of a line of text that starts at the origin with its baseline on `y = 0`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Glyph {
    pub(super) italic: bool,
    /// Its number in the font.
    pub(super) id: u16,
    /// Where its own origin lies (pixels, y down).
    pub(super) at: (f32, f32),
    /// Pixels per unit of the font.
    pub(super) scale: f32,
}

/// The glyphs of a line of text, and its width.
pub(super) fn glyphs(spans: &[Span], size: f32) -> (Vec<Glyph>, f32) {
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
            glyphs.push(Glyph {
                italic: span.italic,
                id: glyph.0,
                at: (x, -span.rise * size),
                scale,
            });
            x += scale * f32::from(face.glyph_hor_advance(glyph).unwrap_or(0));
            previous = Some(glyph);
        }
    }
    (glyphs, x)
}

/// Outline of a line of text that starts at the origin with its baseline on `y = 0`, and its width.
pub(super) fn outline(spans: &[Span], size: f32) -> (Option<Path>, f32) {
    let (glyphs, width) = glyphs(spans, size);
    let mut pen = Pen {
        path: PathBuilder::new(),
        x: 0.0,
        y: 0.0,
        scale: 1.0,
    };
    for glyph in glyphs {
        ((pen.x, pen.y), pen.scale) = (glyph.at, glyph.scale);
        face(glyph.italic).outline_glyph(GlyphId(glyph.id), &mut pen);
    }
    (pen.path.finish(), width)
}

/// Outline of a glyph of the font in its units, y down, as the attribute `d` of SVG; none of a blank.
pub(super) fn glyph_data(italic: bool, id: u16) -> Option<String> {
    let mut pen = Pen {
        path: PathBuilder::new(),
        x: 0.0,
        y: 0.0,
        scale: 1.0,
    };
    face(italic).outline_glyph(GlyphId(id), &mut pen);
    pen.path.finish().map(|path| path_data(&path))
}

/// Width of a line of text.
pub(super) fn width(spans: &[Span], size: f32) -> f32 {
    glyphs(spans, size).1
}

/// [`outline`] moved so that its baseline starts at `(x, y)`, turned by `degrees` about that point.
pub(super) fn placed(path: &Path, x: f32, y: f32, degrees: f32) -> Option<Path> {
    path.clone()
        .transform(Transform::from_rotate(degrees).post_translate(x, y))
}

/// A path as the attribute `d` of SVG, to a unit.
fn path_data(path: &Path) -> String {
    let point = |p: tiny_skia::Point| format!("{:.0} {:.0}", p.x, p.y);
    let segments = path.segments().map(|segment| match segment {
        PathSegment::MoveTo(p) => format!("M{}", point(p)),
        PathSegment::LineTo(p) => format!("L{}", point(p)),
        PathSegment::QuadTo(a, p) => format!("Q{} {}", point(a), point(p)),
        PathSegment::CubicTo(a, b, p) => format!("C{} {} {}", point(a), point(b), point(p)),
        PathSegment::Close => "Z".to_string(),
    });
    segments.collect()
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
    let Some(table) = face.tables().kern else { return 0 };
    table
        .subtables
        .into_iter()
        .filter(|subtable| subtable.horizontal && !subtable.variable)
        .find_map(|subtable| subtable.glyphs_kerning(left, right))
        .unwrap_or(0)
}

struct Pen {
    path: PathBuilder,
    x: f32,
    y: f32,
    scale: f32,
}

impl Pen {
    /// Font units, y up, to pixels, y down.
    fn at(&self, x: f32, y: f32) -> (f32, f32) {
        (self.x + self.scale * x, self.y - self.scale * y)
    }
}

impl OutlineBuilder for Pen {
    fn move_to(&mut self, x: f32, y: f32) {
        let (x, y) = self.at(x, y);
        self.path.move_to(x, y);
    }
    fn line_to(&mut self, x: f32, y: f32) {
        let (x, y) = self.at(x, y);
        self.path.line_to(x, y);
    }
    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        let ((x1, y1), (x, y)) = (self.at(x1, y1), self.at(x, y));
        self.path.quad_to(x1, y1, x, y);
    }
    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        let ((x1, y1), (x2, y2), (x, y)) = (self.at(x1, y1), self.at(x2, y2), self.at(x, y));
        self.path.cubic_to(x1, y1, x2, y2, x, y);
    }
    fn close(&mut self) {
        self.path.close();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_has_the_size_asked_for_and_scripts_are_smaller() {
        let (path, advance) = outline(&[roman("H")], 100.0);
        let bounds = path.unwrap().bounds();
        assert!((bounds.height() - 72.9).abs() < 0.5, "cap height of the font");
        assert!(bounds.bottom().abs() < 0.01, "stands on the baseline");
        assert!(advance > bounds.right());
        let (path, _) = outline(&[below("H")], 100.0);
        let index = path.unwrap().bounds();
        assert!(index.bottom() > 20.0 && index.height() < 60.0);
    }

    #[test]
    fn every_symbol_used_in_pictures_is_in_the_font() {
        for symbol in "\u{2212}\u{b1}\u{b5}\u{d7}\u{2013}*/^0123456789()".chars() {
            assert!(face(false).glyph_index(symbol).is_some(), "{symbol:?}");
        }
    }

    #[test]
    fn pairs_are_kerned() {
        let apart = width(&[roman("A")], 100.0) + width(&[roman("V")], 100.0);
        assert!(width(&[roman("AV")], 100.0) < apart - 1.0);
    }
}
