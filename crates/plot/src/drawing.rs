//! Figures as lists of marks, which pixels and SVG show alike.

use crate::image::Image;
use crate::svg;
use crate::text::Span;

/// A position in pixels from the top left corner.
pub(crate) type Place = (f32, f32);
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

    /// The figure in pixels.
    pub fn image(&self) -> Image {
        let mut image = Image::white(self.size.0.ceil() as u32, self.size.1.ceil() as u32);
        image.paint(&self.drawing);
        image
    }
}

/// Alignment of a line of text to its position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Align {
    Start,
    Middle,
    End,
    /// Reads upwards, its middle at the position.
    Upwards,
}

impl Align {
    /// Distance from the start of a text of this width to its position, along the direction in which it reads.
    pub(crate) fn shift(self, width: f32) -> f32 {
        match self {
            Self::Start => 0.0,
            Self::Middle | Self::Upwards => 0.5 * width,
            Self::End => width,
        }
    }
}

/// Dashes of a line, and the gaps behind them, in its widths.
pub(crate) const DASHES: &[f32] = &[5.0, 3.0];

/// Colour, width and dashes of a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pencil {
    pub(crate) colour: Colour,
    /// Width (pixels).
    pub(crate) width: f32,
    /// Lengths of dashes and of the gaps behind them, in widths of the line; none for a solid line.
    pub(crate) dashes: &'static [f32],
}

impl Pencil {
    pub(crate) fn new(colour: Colour, width: f32) -> Self {
        Self::dashed(colour, width, &[])
    }

    pub(crate) fn dashed(colour: Colour, width: f32, dashes: &'static [f32]) -> Self {
        Self { colour, width, dashes }
    }

    /// Lengths of dashes and of the gaps behind them (pixels).
    pub(crate) fn dash(self) -> Vec<f32> {
        self.dashes.iter().map(|length| length * self.width).collect()
    }
}

#[derive(Clone, Debug)]
pub(crate) enum Mark {
    /// A line; whether it is closed.
    Line(Vec<Place>, bool, Pencil),
    /// An area; its opacity, 0 to 1.
    Area(Vec<Place>, Colour, f32),
    /// One line of text; its size, and the position of its baseline.
    Text(Vec<Span>, f32, Place, Align, Colour),
    /// Pixels; the position of their top left corner.
    Image(Image, (u32, u32)),
}

/// Lines, areas and text in the order in which they lie on each other.
#[derive(Clone, Debug, Default)]
pub(crate) struct Drawing {
    pub(crate) marks: Vec<Mark>,
}

impl Drawing {
    pub(crate) fn line(&mut self, points: Vec<Place>, pencil: Pencil) {
        if points.len() > 1 {
            self.marks.push(Mark::Line(points, false, pencil));
        }
    }

    /// The closed line round an area.
    pub(crate) fn outline(&mut self, points: Vec<Place>, pencil: Pencil) {
        self.marks.push(Mark::Line(points, true, pencil));
    }

    /// A frame whose lines lie outside of the area.
    pub(crate) fn frame(&mut self, (l, t, r, b): Area, pencil: Pencil) {
        let h = 0.5 * pencil.width;
        self.outline(corners((l - h, t - h, r + h, b + h)), pencil);
    }

    pub(crate) fn fill(&mut self, points: Vec<Place>, colour: Colour, opacity: f32) {
        self.marks.push(Mark::Area(points, colour, opacity));
    }

    pub(crate) fn rectangle(&mut self, area: Area, colour: Colour, opacity: f32) {
        self.fill(corners(area), colour, opacity);
    }

    pub(crate) fn text(&mut self, spans: Vec<Span>, size: f32, at: Place, align: Align, colour: Colour) {
        self.marks.push(Mark::Text(spans, size, at, align, colour));
    }

    pub(crate) fn image(&mut self, image: Image, at: (u32, u32)) {
        self.marks.push(Mark::Image(image, at));
    }
}

fn corners((l, t, r, b): Area) -> Vec<Place> {
    vec![(l, t), (r, t), (r, b), (l, b)]
}
