//! What is drawn, for a canvas or as SVG: one description, so that both show the same.

use super::canvas::{Align, Canvas, Pencil, shift};
use super::text::{Glyph, Span, glyph_data, glyphs};
use super::write_png;
use crate::error::Result;
use crate::output::atomic::write_bytes;
use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::Path;

/// A drawn figure, to be written in any format.
#[derive(Clone, Debug)]
pub struct Figure {
    /// Width and height (pixels).
    pub(super) size: (f32, f32),
    /// Of what it is, for those who cannot see it.
    pub(super) title: String,
    pub(super) drawing: Drawing,
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
    /// Writes the figure; the file appears whole.
    pub fn write(&self, path: &Path, format: Format) -> Result<()> {
        match format {
            Format::Svg => write_bytes(path, self.drawing.svg(self.size, &self.title).as_bytes()),
            Format::Png => write_png(path, &self.canvas()),
        }
    }

    /// The figure in pixels.
    pub(super) fn canvas(&self) -> Canvas {
        let mut canvas = Canvas::new(self.size.0.ceil() as u32, self.size.1.ceil() as u32);
        self.drawing.paint(&mut canvas);
        canvas
    }
}

/// Lines, areas and text in the order in which they lie on each other, in pixels from the top left corner.
#[derive(Clone, Debug, Default)]
pub(super) struct Drawing {
    marks: Vec<Mark>,
}

#[derive(Clone, Debug)]
enum Mark {
    Line {
        points: Vec<(f32, f32)>,
        close: bool,
        pencil: Pencil,
    },
    Area {
        points: Vec<(f32, f32)>,
        colour: [u8; 3],
        opacity: f32,
    },
    Text {
        spans: Vec<Span<'static>>,
        size: f32,
        at: (f32, f32),
        /// None if the text reads upwards, its middle at the place.
        align: Option<Align>,
        colour: [u8; 3],
    },
}

impl Drawing {
    pub(super) fn polyline(&mut self, points: Vec<(f32, f32)>, pencil: Pencil) {
        self.line(points, false, pencil);
    }

    pub(super) fn polygon(&mut self, points: Vec<(f32, f32)>, pencil: Pencil) {
        self.line(points, true, pencil);
    }

    fn line(&mut self, points: Vec<(f32, f32)>, close: bool, pencil: Pencil) {
        if points.len() > 1 {
            self.marks.push(Mark::Line {
                points,
                close,
                pencil,
            });
        }
    }

    /// A frame whose lines lie outside of the area `(left, top, right, bottom)`.
    pub(super) fn frame(&mut self, (l, t, r, b): (f32, f32, f32, f32), pencil: Pencil) {
        let h = 0.5 * pencil.width;
        let corners = vec![(l - h, t - h), (r + h, t - h), (r + h, b + h), (l - h, b + h)];
        self.polygon(corners, pencil);
    }

    pub(super) fn fill(&mut self, points: Vec<(f32, f32)>, colour: [u8; 3]) {
        self.tint(points, colour, 1.0);
    }

    /// Fills an area, `opacity` between 0 and 1.
    pub(super) fn tint(&mut self, points: Vec<(f32, f32)>, colour: [u8; 3], opacity: f32) {
        self.marks.push(Mark::Area {
            points,
            colour,
            opacity,
        });
    }

    /// Fills `(left, top, right, bottom)`, `opacity` between 0 and 1.
    pub(super) fn rectangle(&mut self, (l, t, r, b): (f32, f32, f32, f32), colour: [u8; 3], opacity: f32) {
        self.tint(vec![(l, t), (r, t), (r, b), (l, b)], colour, opacity);
    }

    /// One line of text, its baseline at the place.
    pub(super) fn text(
        &mut self,
        spans: Vec<Span<'static>>,
        size: f32,
        at: (f32, f32),
        align: Align,
        colour: [u8; 3],
    ) {
        let align = Some(align);
        self.marks.push(Mark::Text {
            spans,
            size,
            at,
            align,
            colour,
        });
    }

    /// One line of text that reads upwards, its baseline at `x`, its middle at `y`.
    pub(super) fn text_upwards(
        &mut self,
        spans: Vec<Span<'static>>,
        size: f32,
        at: (f32, f32),
        colour: [u8; 3],
    ) {
        self.marks.push(Mark::Text {
            spans,
            size,
            at,
            align: None,
            colour,
        });
    }

    /// Draws on a canvas.
    pub(super) fn paint(&self, canvas: &mut Canvas) {
        for mark in &self.marks {
            match mark {
                Mark::Line {
                    points,
                    close: false,
                    pencil,
                } => canvas.polyline(points, *pencil),
                Mark::Line { points, pencil, .. } => canvas.polygon(points, *pencil),
                Mark::Area {
                    points,
                    colour,
                    opacity,
                } => canvas.fill(points, *colour, *opacity),
                Mark::Text {
                    spans,
                    size,
                    at,
                    align: Some(align),
                    colour,
                } => {
                    canvas.text(spans, *size, *at, *align, *colour);
                }
                Mark::Text {
                    spans,
                    size,
                    at,
                    colour,
                    ..
                } => canvas.text_upwards(spans, *size, *at, *colour),
            }
        }
    }

    /// The same as a page of SVG, which opens at half its size in pixels.
    pub(super) fn svg(&self, (width, height): (f32, f32), title: &str) -> String {
        let mut page = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" xmlns:xlink=\"http://www.w3.org/1999/xlink\" width=\"{}\" height=\"{}\" viewBox=\"0 0 {width} {height}\">\n\
             <title>{}</title>\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n",
            0.5 * width,
            0.5 * height,
            escaped(title)
        );
        self.define_glyphs(&mut page);
        for mark in &self.marks {
            match mark {
                Mark::Line {
                    points,
                    close,
                    pencil,
                } => {
                    let name = if *close { "polygon" } else { "polyline" };
                    let dash: Vec<String> = pencil.dash().iter().map(ToString::to_string).collect();
                    let dash = if dash.is_empty() {
                        String::new()
                    } else {
                        format!(" stroke-dasharray=\"{}\"", dash.join(" "))
                    };
                    add(
                        &mut page,
                        format_args!(
                            "<{name} points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{}\" \
                             stroke-linejoin=\"round\"{dash}/>",
                            listed(points),
                            hex(pencil.colour),
                            pencil.width
                        ),
                    );
                }
                Mark::Area {
                    points,
                    colour,
                    opacity,
                } => {
                    let opacity = if *opacity < 1.0 {
                        format!(" fill-opacity=\"{opacity}\"")
                    } else {
                        String::new()
                    };
                    add(
                        &mut page,
                        format_args!(
                            "<polygon points=\"{}\" fill=\"{}\"{opacity}/>",
                            listed(points),
                            hex(*colour)
                        ),
                    );
                }
                Mark::Text {
                    spans,
                    size,
                    at,
                    align,
                    colour,
                } => {
                    write_text(&mut page, &glyphs(spans, *size), *at, *align, *colour);
                }
            }
        }
        page.push_str("</svg>\n");
        page
    }

    /// The outlines of all glyphs that occur, each once.
    fn define_glyphs(&self, page: &mut String) {
        let mut seen = BTreeSet::new();
        for mark in &self.marks {
            if let Mark::Text { spans, size, .. } = mark {
                let found = glyphs(spans, *size).0;
                seen.extend(found.iter().map(|glyph| (glyph.italic, glyph.id)));
            }
        }
        page.push_str("<defs>\n");
        for (italic, id) in seen {
            if let Some(data) = glyph_data(italic, id) {
                let name = glyph_name(italic, id);
                add(page, format_args!("<path id=\"{name}\" d=\"{data}\"/>"));
            }
        }
        page.push_str("</defs>\n");
    }
}

fn glyph_name(italic: bool, id: u16) -> String {
    format!("{}{id}", if italic { 'i' } else { 'r' })
}

/// One line of text, of outlines that were defined before.
fn write_text(
    page: &mut String,
    (glyphs, width): &(Vec<Glyph>, f32),
    (x, y): (f32, f32),
    align: Option<Align>,
    colour: [u8; 3],
) {
    let place = match align {
        Some(align) => format!("translate({:.2} {y:.2})", x - shift(align, *width)),
        None => format!("translate({x:.2} {:.2}) rotate(-90)", y + 0.5 * width),
    };
    let _ = write!(page, "<g fill=\"{}\" transform=\"{place}\">", hex(colour));
    // Glyphs of one size on one line share a group, in which they count in units of the font.
    let together =
        |a: &Glyph, b: &Glyph| a.scale.to_bits() == b.scale.to_bits() && a.at.1.to_bits() == b.at.1.to_bits();
    for group in glyphs.chunk_by(together) {
        let Glyph {
            at: (_, y), scale, ..
        } = group[0];
        let _ = write!(page, "<g transform=\"translate(0 {y:.2}) scale({scale})\">");
        for glyph in group
            .iter()
            .filter(|glyph| glyph_data(glyph.italic, glyph.id).is_some())
        {
            let name = glyph_name(glyph.italic, glyph.id);
            let _ = write!(
                page,
                "<use xlink:href=\"#{name}\" x=\"{:.0}\"/>",
                glyph.at.0 / scale
            );
        }
        page.push_str("</g>");
    }
    page.push_str("</g>\n");
}

fn add(page: &mut String, line: std::fmt::Arguments) {
    writeln!(page, "{line}").expect("memory takes any text");
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

fn listed(points: &[(f32, f32)]) -> String {
    let points = points.iter().map(|(x, y)| format!("{x:.2},{y:.2}"));
    points.collect::<Vec<_>>().join(" ")
}

fn hex([r, g, b]: [u8; 3]) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}
