//! Pixels, and marks that are painted on them.

use crate::drawing::{Align, Colour, Drawing, Mark, Pencil, Place};
use crate::text;
use tiny_skia::{
    FillRule, IntSize, LineJoin, Paint, Path, PathBuilder, Pixmap, PixmapPaint, PremultipliedColorU8, Stroke,
    StrokeDash, Transform,
};

/// 200 dots per inch: a picture 1200 pixels wide fills 15 cm of a page.
const PIXELS_PER_METRE: u32 = 7874;

/// An opaque image in pixels.
#[derive(Clone, Debug)]
pub struct Image {
    pixels: Pixmap,
}

impl Image {
    /// A white image of at least one pixel.
    pub(crate) fn white(width: u32, height: u32) -> Self {
        let mut pixels = Pixmap::new(width.max(1), height.max(1)).expect("a page has an area");
        pixels.fill(tiny_skia::Color::WHITE);
        Self { pixels }
    }

    /// The image with given pixels, row by row from the top.
    ///
    /// # Panics
    /// If there are not `width * height` colours, or none.
    pub fn new(width: u32, height: u32, colours: &[[u8; 3]]) -> Self {
        let size = IntSize::from_wh(width, height).expect("an image has an area");
        let bytes = colours.iter().flat_map(|&[r, g, b]| [r, g, b, 255]).collect();
        Self {
            pixels: Pixmap::from_vec(bytes, size).expect("one colour per pixel"),
        }
    }

    /// Width (pixels).
    pub fn width(&self) -> u32 {
        self.pixels.width()
    }

    /// Height (pixels).
    pub fn height(&self) -> u32 {
        self.pixels.height()
    }

    /// Red, green and blue of a pixel.
    ///
    /// # Panics
    /// If there is no such pixel.
    pub fn colour(&self, x: u32, y: u32) -> [u8; 3] {
        let pixel = self.pixels.pixel(x, y).expect("a pixel of the image");
        [pixel.red(), pixel.green(), pixel.blue()]
    }

    /// Mixes a colour into every pixel `(x, y)`, by `part` between 0 and 1.
    pub fn blend(&mut self, colour: [u8; 3], part: impl Fn(u32, u32) -> f32) {
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

    /// Draws the outline of a body (pixels from the top left corner) over a light veil.
    pub fn outline(&mut self, points: &[(f32, f32)]) {
        let mut drawing = Drawing::default();
        drawing.fill(points.to_vec(), [255; 3], 0.22);
        drawing.outline(points.to_vec(), Pencil::new([20; 3], 2.0));
        self.paint(&drawing);
    }

    /// Paints a drawing on the image.
    pub(crate) fn paint(&mut self, drawing: &Drawing) {
        for mark in &drawing.marks {
            match mark {
                Mark::Line {
                    points,
                    closed,
                    pencil,
                } => self.stroke(points, *closed, *pencil),
                Mark::Area {
                    points,
                    colour,
                    opacity,
                } => {
                    if let Some(path) = path(points, true) {
                        self.fill(&path, &paint(*colour, *opacity), Transform::identity());
                    }
                }
                Mark::Text {
                    spans,
                    size,
                    at,
                    align,
                    colour,
                } => {
                    let (glyphs, width) = text::glyphs(spans, *size);
                    let degrees = if *align == Align::Upwards { -90.0 } else { 0.0 };
                    let place = Transform::from_translate(-align.shift(width), 0.0)
                        .post_concat(Transform::from_rotate(degrees))
                        .post_translate(at.0, at.1);
                    for glyph in glyphs {
                        if let Some(path) = text::outline(glyph.italic, glyph.id) {
                            let own = Transform::from_scale(glyph.scale, glyph.scale)
                                .post_translate(glyph.at.0, glyph.at.1);
                            self.fill(&path, &paint(*colour, 1.0), own.post_concat(place));
                        }
                    }
                }
                Mark::Image { image, at } => self.pixels.draw_pixmap(
                    at.0 as i32,
                    at.1 as i32,
                    image.pixels.as_ref(),
                    &PixmapPaint::default(),
                    Transform::identity(),
                    None,
                ),
            }
        }
    }

    fn fill(&mut self, path: &Path, paint: &Paint, place: Transform) {
        self.pixels.fill_path(path, paint, FillRule::Winding, place, None);
    }

    fn stroke(&mut self, points: &[Place], closed: bool, pencil: Pencil) {
        let Some(path) = path(points, closed) else { return };
        let dash = (!pencil.dashes.is_empty())
            .then(|| StrokeDash::new(pencil.dash(), 0.0).expect("pairs of positive lengths"));
        let stroke = Stroke {
            width: pencil.width,
            line_join: LineJoin::Round,
            dash,
            ..Stroke::default()
        };
        let paint = paint(pencil.colour, 1.0);
        self.pixels
            .stroke_path(&path, &paint, &stroke, Transform::identity(), None);
    }

    /// The bytes of a PNG file.
    pub(crate) fn png(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width(), self.height());
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_compression(png::Compression::Balanced);
        encoder.set_pixel_dims(Some(png::PixelDimensions {
            xppu: PIXELS_PER_METRE,
            yppu: PIXELS_PER_METRE,
            unit: png::Unit::Meter,
        }));
        let channels = |p: &PremultipliedColorU8| [p.red(), p.green(), p.blue()];
        let rgb: Vec<u8> = self.pixels.pixels().iter().flat_map(channels).collect();
        let mut writer = encoder.write_header().expect("memory takes any header");
        writer.write_image_data(&rgb).expect("three bytes per pixel");
        writer.finish().expect("memory takes any picture");
        bytes
    }
}

fn paint(colour: Colour, opacity: f32) -> Paint<'static> {
    let mut paint = Paint::default();
    let [r, g, b] = colour;
    let mut colour = tiny_skia::Color::from_rgba8(r, g, b, 255);
    colour.apply_opacity(opacity);
    paint.set_color(colour);
    paint.anti_alias = true;
    paint
}

fn path(points: &[Place], closed: bool) -> Option<Path> {
    let (&(x, y), rest) = points.split_first()?;
    let mut builder = PathBuilder::new();
    builder.move_to(x, y);
    for &(x, y) in rest {
        builder.line_to(x, y);
    }
    if closed {
        builder.close();
    }
    builder.finish()
}
