//! A white page with lines, areas and text, in pixels from the top left corner.

use super::colour::rgb;
use super::text::{self, Span};
use tiny_skia::{
    FillRule, IntSize, LineCap, LineJoin, Paint, PathBuilder, Pixmap, PixmapPaint, PremultipliedColorU8,
    Rect, Stroke, StrokeDash, Transform,
};

/// Where a text stands relative to the point it is placed at.
#[derive(Clone, Copy, Debug)]
pub(super) enum Align {
    Start,
    Middle,
    End,
}

/// How to draw a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pencil {
    pub(super) colour: [u8; 3],
    pub(super) width: f32,
    /// Lengths of dashes and of the gaps behind them, in widths of the line; none for a solid line.
    pub(super) dashes: &'static [f32],
}

impl Pencil {
    pub(super) fn new(colour: [u8; 3], width: f32) -> Self {
        Self {
            colour,
            width,
            dashes: &[],
        }
    }

    /// The same, dashed.
    pub(super) fn dashed(self) -> Self {
        Self {
            dashes: &[5.0, 3.0],
            ..self
        }
    }

    /// Lengths of dashes and of the gaps behind them, in pixels.
    pub(super) fn dash(self) -> Vec<f32> {
        self.dashes.iter().map(|length| length * self.width).collect()
    }
}

pub(super) struct Canvas {
    pixels: Pixmap,
}

impl Canvas {
    pub(super) fn new(width: u32, height: u32) -> Self {
        let mut pixels = Pixmap::new(width.max(1), height.max(1)).expect("a page has an area");
        pixels.fill(tiny_skia::Color::WHITE);
        Self { pixels }
    }

    /// A canvas with given pixels, row by row from the top.
    pub(super) fn from_pixels(width: u32, height: u32, colours: &[[u8; 3]]) -> Self {
        let size = IntSize::from_wh(width, height).expect("a picture has an area");
        let bytes = colours.iter().flat_map(|&[r, g, b]| [r, g, b, 255]).collect();
        Self {
            pixels: Pixmap::from_vec(bytes, size).expect("one colour per pixel"),
        }
    }

    pub(super) fn width(&self) -> u32 {
        self.pixels.width()
    }

    pub(super) fn height(&self) -> u32 {
        self.pixels.height()
    }

    /// Red, green and blue of every pixel, row by row from the top.
    pub(super) fn rgb(&self) -> Vec<u8> {
        let channels = |p: &PremultipliedColorU8| [p.red(), p.green(), p.blue()];
        self.pixels.pixels().iter().flat_map(channels).collect()
    }

    /// Puts another canvas on this one, its top left corner at `(x, y)`.
    pub(super) fn paste(&mut self, other: &Canvas, x: u32, y: u32) {
        let paint = PixmapPaint::default();
        self.pixels.draw_pixmap(
            x as i32,
            y as i32,
            other.pixels.as_ref(),
            &paint,
            Transform::identity(),
            None,
        );
    }

    pub(super) fn line(&mut self, from: (f32, f32), to: (f32, f32), pencil: Pencil) {
        self.polyline(&[from, to], pencil);
    }

    pub(super) fn polyline(&mut self, points: &[(f32, f32)], pencil: Pencil) {
        self.stroke(points, false, pencil);
    }

    pub(super) fn polygon(&mut self, points: &[(f32, f32)], pencil: Pencil) {
        self.stroke(points, true, pencil);
    }

    fn stroke(&mut self, points: &[(f32, f32)], close: bool, pencil: Pencil) {
        let Some(path) = path(points, close) else { return };
        let dash = (!pencil.dashes.is_empty())
            .then(|| StrokeDash::new(pencil.dash(), 0.0).expect("pairs of positive lengths"));
        let stroke = Stroke {
            width: pencil.width,
            line_cap: LineCap::Butt,
            line_join: LineJoin::Round,
            dash,
            ..Stroke::default()
        };
        let paint = paint(pencil.colour, 1.0);
        self.pixels
            .stroke_path(&path, &paint, &stroke, Transform::identity(), None);
    }

    /// Fills an area, `opacity` between 0 and 1.
    pub(super) fn fill(&mut self, points: &[(f32, f32)], colour: [u8; 3], opacity: f32) {
        if let Some(path) = path(points, true) {
            let paint = paint(colour, opacity);
            self.pixels
                .fill_path(&path, &paint, FillRule::Winding, Transform::identity(), None);
        }
    }

    /// Mixes a colour into every pixel `(x, y)`, by `part` between 0 and 1.
    pub(super) fn blend(&mut self, colour: [u8; 3], part: impl Fn(u32, u32) -> f32) {
        let width = self.pixels.width();
        for (index, pixel) in self.pixels.pixels_mut().iter_mut().enumerate() {
            let part = part(index as u32 % width, index as u32 / width);
            if part > 0.0 {
                let mix = |old: u8, new: u8| {
                    (f32::from(old) + part.min(1.0) * (f32::from(new) - f32::from(old))).round() as u8
                };
                let [r, g, b] = colour;
                let mixed = [mix(pixel.red(), r), mix(pixel.green(), g), mix(pixel.blue(), b)];
                *pixel = PremultipliedColorU8::from_rgba(mixed[0], mixed[1], mixed[2], 255)
                    .expect("an opaque colour is premultiplied");
            }
        }
    }

    /// A frame whose lines lie outside of the area `(left, top, right, bottom)`.
    pub(super) fn frame(&mut self, (l, t, r, b): (f32, f32, f32, f32), pencil: Pencil) {
        let h = 0.5 * pencil.width;
        self.polygon(
            &[(l - h, t - h), (r + h, t - h), (r + h, b + h), (l - h, b + h)],
            pencil,
        );
    }

    /// One line of text, its baseline at `y`.
    pub(super) fn text(
        &mut self,
        spans: &[Span],
        size: f32,
        (x, y): (f32, f32),
        align: Align,
        colour: [u8; 3],
    ) {
        self.fill_outline(text_path(spans, size, (x, y), Some(align)), colour);
    }

    /// One line of text that reads upwards, its baseline at `x`, its middle at `y`.
    pub(super) fn text_upwards(&mut self, spans: &[Span], size: f32, at: (f32, f32), colour: [u8; 3]) {
        self.fill_outline(text_path(spans, size, at, None), colour);
    }

    fn fill_outline(&mut self, path: Option<tiny_skia::Path>, colour: [u8; 3]) {
        if let Some(path) = path {
            let paint = paint(colour, 1.0);
            self.pixels
                .fill_path(&path, &paint, FillRule::Winding, Transform::identity(), None);
        }
    }

    /// Fills `(left, top, right, bottom)`.
    pub(super) fn rectangle(&mut self, (l, t, r, b): (f32, f32, f32, f32), colour: [u8; 3], opacity: f32) {
        if let Some(area) = Rect::from_ltrb(l, t, r, b) {
            self.pixels
                .fill_rect(area, &paint(colour, opacity), Transform::identity(), None);
        }
    }
}

/// Outline of a line of text at its place; without alignment it reads upwards about its middle.
fn text_path(spans: &[Span], size: f32, (x, y): (f32, f32), align: Option<Align>) -> Option<tiny_skia::Path> {
    let (path, width) = text::outline(spans, size);
    match align {
        Some(align) => text::placed(&path?, x - shift(align, width), y, 0.0),
        None => text::placed(&path?, x, y + 0.5 * width, -90.0),
    }
}

/// How far left of its place a text of this width begins.
pub(super) fn shift(align: Align, width: f32) -> f32 {
    match align {
        Align::Start => 0.0,
        Align::Middle => 0.5 * width,
        Align::End => width,
    }
}

fn paint(colour: [u8; 3], opacity: f32) -> Paint<'static> {
    let mut paint = Paint::default();
    let mut colour = rgb(colour);
    colour.apply_opacity(opacity);
    paint.set_color(colour);
    paint.anti_alias = true;
    paint
}

fn path(points: &[(f32, f32)], close: bool) -> Option<tiny_skia::Path> {
    let (&(x, y), rest) = points.split_first()?;
    let mut builder = PathBuilder::new();
    builder.move_to(x, y);
    for &(x, y) in rest {
        builder.line_to(x, y);
    }
    if close {
        builder.close();
    }
    builder.finish()
}
