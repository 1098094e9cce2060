//! Figures as lists of marks, which pixels and SVG show alike.

use crate::image::Image;
use crate::svg;
use crate::text;
use serde::Serialize;
use tiny_skia::{Path, PathBuilder, Transform};

/// A position in pixels from the top left corner.
pub(crate) type Position = (f32, f32);
/// An area: left, top, right, bottom.
pub(crate) type Area = (f32, f32, f32, f32);
/// Red, green and blue.
pub(crate) type Colour = [u8; 3];

/// A drawn figure, to be encoded in any format.
#[derive(Clone, Debug)]
pub struct Figure {
    /// Width and height (pixels).
    pub(crate) size: (f32, f32),
    /// Description for those who cannot see it.
    pub(crate) title: String,
    pub(crate) drawing: Drawing,
    pub(crate) readings: Readings,
}

/// Values that can be read off a figure, for a page that shows them under the pointer. Without curves there are none.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Readings {
    /// Labels of the horizontal and the vertical axis.
    pub axes: [String; 2],
    /// Series in the order of the chart.
    pub curves: Vec<Curve>,
}

/// A series of [`Readings`].
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Curve {
    /// Name; may be empty.
    pub label: String,
    /// Red, green and blue.
    pub colour: [u8; 3],
    /// Position on the page (pixels from the top left corner), value on both axes, and half the length of the error bar.
    pub points: Vec<(f32, f32, f64, f64, Option<f64>)>,
}

/// Format of a figure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Vectors, text as outlines.
    Svg,
    /// Pixels, 200 to the inch.
    Png,
}

impl Format {
    /// Extension of its files.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Svg => "svg",
            Self::Png => "png",
        }
    }
}

impl Figure {
    /// The bytes of a file in this format.
    pub fn encode(&self, format: Format) -> Vec<u8> {
        match format {
            Format::Svg => svg::page(self).into_bytes(),
            Format::Png => self.image().png(),
        }
    }

    /// The element `svg` of a page in HTML, as wide as what holds it.
    pub fn inline(&self) -> String {
        svg::inline(self)
    }

    /// Width and height (pixels).
    pub fn size(&self) -> (f32, f32) {
        self.size
    }

    /// Values at the points of its series.
    pub fn readings(&self) -> &Readings {
        &self.readings
    }

    /// The figure in pixels.
    pub fn image(&self) -> Image {
        let mut image = Image::white(self.size.0.ceil() as u32, self.size.1.ceil() as u32);
        image.paint(&self.drawing);
        image
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Align {
    Start,
    Middle,
    End,
    /// Reads upwards, its middle at the position.
    Upwards,
}

/// Lengths of a dash and of the gap after it, in widths of the line.
pub(crate) const DASHES: &[f32] = &[5.0, 3.0];

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stroke {
    pub(crate) colour: Colour,
    /// Width (pixels).
    pub(crate) width: f32,
    /// Lengths of dashes and gaps, in widths of the line; none for a solid line.
    pub(crate) dashes: &'static [f32],
}

impl Stroke {
    /// A solid line.
    pub(crate) fn new(colour: Colour, width: f32) -> Self {
        Self { colour, width, dashes: &[] }
    }

    /// Lengths of dashes and gaps (pixels).
    pub(crate) fn dash(self) -> Vec<f32> {
        self.dashes.iter().map(|length| length * self.width).collect()
    }
}

#[derive(Clone, Debug)]
pub(crate) enum Mark {
    Line(Path, Stroke),
    /// An area; its opacity, 0 to 1.
    Area(Path, Colour, f32),
    /// Pixels; the position of their top left corner.
    Image(Image, (u32, u32)),
}

/// Lines, areas and images in the order in which they lie on each other.
#[derive(Clone, Debug, Default)]
pub(crate) struct Drawing(pub(crate) Vec<Mark>);

impl Drawing {
    pub(crate) fn line(&mut self, points: &[Position], stroke: Stroke) {
        self.0.extend(path(points, false).map(|path| Mark::Line(path, stroke)));
    }

    /// The closed line round an area.
    pub(crate) fn outline(&mut self, points: &[Position], stroke: Stroke) {
        self.0.extend(path(points, true).map(|path| Mark::Line(path, stroke)));
    }

    /// A frame whose lines lie outside of the area.
    pub(crate) fn frame(&mut self, (l, t, r, b): Area, stroke: Stroke) {
        let h = 0.5 * stroke.width;
        self.outline(&corners((l - h, t - h, r + h, b + h)), stroke);
    }

    pub(crate) fn fill(&mut self, points: &[Position], colour: Colour, opacity: f32) {
        self.0.extend(path(points, true).map(|path| Mark::Area(path, colour, opacity)));
    }

    pub(crate) fn rectangle(&mut self, area: Area, colour: Colour, opacity: f32) {
        self.fill(&corners(area), colour, opacity);
    }

    /// One line of text, in the markup of [`spans`](crate::markup::spans); `at` is the position of its baseline.
    pub(crate) fn text(&mut self, text: &str, size: f32, at: Position, align: Align, colour: Colour) {
        let (path, width) = text::line(text, size);
        let (shift, degrees) = match align {
            Align::Start => (0.0, 0.0),
            Align::Middle => (0.5, 0.0),
            Align::End => (1.0, 0.0),
            Align::Upwards => (0.5, -90.0),
        };
        let position = Transform::from_translate(-shift * width, 0.0)
            .post_concat(Transform::from_rotate(degrees))
            .post_translate(at.0, at.1);
        let path = path.and_then(|path| path.transform(position));
        self.0.extend(path.map(|path| Mark::Area(path, colour, 1.0)));
    }
}

fn corners((l, t, r, b): Area) -> [Position; 4] {
    [(l, t), (r, t), (r, b), (l, b)]
}

/// The path through these points; none through fewer than two.
fn path(points: &[Position], closed: bool) -> Option<Path> {
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
