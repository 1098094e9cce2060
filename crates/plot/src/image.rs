//! Pixels, and marks that are painted on them.

use crate::drawing::{Colour, Drawing, Mark, Stroke};
use std::io::Write;
use tiny_skia::{FillRule, IntSize, LineJoin, Paint, Pixmap, PixmapPaint, StrokeDash, Transform};

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
        let (width, height) = (width.max(1), height.max(1));
        Self::new(width, height, &vec![[255; 3]; width as usize * height as usize])
    }

    /// The image with given pixels, row by row from the top.
    ///
    /// # Panics
    /// If there are not `width * height` colours, or none.
    pub fn new(width: u32, height: u32, colours: &[[u8; 3]]) -> Self {
        let size = IntSize::from_wh(width, height).expect("an image has an area");
        let bytes = colours.iter().flat_map(|&[r, g, b]| [r, g, b, 255]).collect();
        Self { pixels: Pixmap::from_vec(bytes, size).expect("one colour per pixel") }
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

    /// Red, green and blue (0 to 255) at a position, 0 to 1 from the left and from the top; linear between the middles of pixels.
    pub(crate) fn between(&self, right: f32, down: f32) -> [f32; 3] {
        let near = |part: f32, pixels: u32| {
            let at = (part * pixels as f32 - 0.5).clamp(0.0, pixels as f32 - 1.0);
            let first = at as u32;
            (first, (first + 1).min(pixels - 1), at - first as f32)
        };
        let ((x0, x1, s), (y0, y1, t)) = (near(right, self.width()), near(down, self.height()));
        let corners = [(x0, y0), (x1, y0), (x0, y1), (x1, y1)].map(|(x, y)| self.colour(x, y));
        std::array::from_fn(|i| {
            let [a, b, c, d] = corners.map(|colour| f32::from(colour[i]));
            (1.0 - t) * ((1.0 - s) * a + s * b) + t * ((1.0 - s) * c + s * d)
        })
    }

    /// Mixes a colour into every pixel `(x, y)`, by `part` between 0 and 1.
    pub fn blend(&mut self, colour: [u8; 3], part: impl Fn(u32, u32) -> f32) {
        let width = self.pixels.width();
        for (index, pixel) in self.pixels.data_mut().chunks_exact_mut(4).enumerate() {
            let part = part(index as u32 % width, index as u32 / width).clamp(0.0, 1.0);
            for (channel, new) in pixel.iter_mut().zip(colour) {
                let old = f32::from(*channel);
                *channel = (old + part * (f32::from(new) - old)).round() as u8;
            }
        }
    }

    /// Draws the outline of a body (pixels from the top left corner) over a light tint.
    pub fn outline(&mut self, points: &[(f32, f32)]) {
        let mut drawing = Drawing::default();
        drawing.fill(points, [255; 3], 0.22);
        drawing.outline(points, Stroke::new([20; 3], 2.0));
        self.paint(&drawing);
    }

    pub(crate) fn paint(&mut self, drawing: &Drawing) {
        let (pixels, identity) = (&mut self.pixels, Transform::identity());
        for mark in &drawing.0 {
            match mark {
                Mark::Line(path, stroke) => {
                    let own = tiny_skia::Stroke {
                        width: stroke.width,
                        line_join: LineJoin::Round,
                        dash: StrokeDash::new(stroke.dash(), 0.0),
                        ..tiny_skia::Stroke::default()
                    };
                    pixels.stroke_path(path, &paint(stroke.colour, 1.0), &own, identity, None);
                }
                Mark::Area(path, colour, opacity) => {
                    pixels.fill_path(path, &paint(*colour, *opacity), FillRule::Winding, identity, None);
                }
                Mark::Image(image, (x, y)) => {
                    let (image, paint) = (image.pixels.as_ref(), PixmapPaint::default());
                    pixels.draw_pixmap(*x as i32, *y as i32, image, &paint, identity, None);
                }
            }
        }
    }

    pub(crate) fn png(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = encoder(&mut bytes, (self.width(), self.height()));
        encoder.set_pixel_dims(Some(png::PixelDimensions {
            xppu: PIXELS_PER_METRE,
            yppu: PIXELS_PER_METRE,
            unit: png::Unit::Meter,
        }));
        let rgb: Vec<u8> =
            self.pixels.data().chunks_exact(4).flat_map(|pixel| &pixel[..3]).copied().collect();
        let mut writer = encoder.write_header().expect("memory takes any header");
        writer.write_image_data(&rgb).expect("three bytes per pixel");
        writer.finish().expect("memory takes any picture");
        bytes
    }
}

/// Encodes pictures of this size (pixels) as PNG.
pub(crate) fn encoder<'a, W: Write>(out: W, (width, height): (u32, u32)) -> png::Encoder<'a, W> {
    let mut encoder = png::Encoder::new(out, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Balanced);
    encoder
}

fn paint([r, g, b]: Colour, opacity: f32) -> Paint<'static> {
    let mut paint = Paint::default();
    paint.set_color_rgba8(r, g, b, (255.0 * opacity).round() as u8);
    paint
}
