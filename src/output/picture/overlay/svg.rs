//! What is drawn, for a canvas or as SVG.

use crate::output::picture::canvas::{Align, Canvas, Pencil, text_path};
use crate::output::picture::text::{Span, path_data};
use std::fmt::Write;

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

    pub(super) fn fill(&mut self, points: Vec<(f32, f32)>, colour: [u8; 3]) {
        self.marks.push(Mark::Area { points, colour });
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
                Mark::Area { points, colour } => canvas.fill(points, *colour, 1.0),
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

    /// The same as a page of SVG.
    pub(super) fn svg(&self, (width, height): (f32, f32)) -> String {
        let mut page = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\">\n\
             <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
        );
        for mark in &self.marks {
            match mark {
                Mark::Line {
                    points,
                    close,
                    pencil,
                } => {
                    let name = if *close { "polygon" } else { "polyline" };
                    let dash = if pencil.dashed {
                        let [dash, gap] = pencil.dash();
                        format!(" stroke-dasharray=\"{dash} {gap}\"")
                    } else {
                        String::new()
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
                Mark::Area { points, colour } => {
                    add(
                        &mut page,
                        format_args!(
                            "<polygon points=\"{}\" fill=\"{}\"/>",
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
                    let path = text_path(spans, *size, *at, *align);
                    if let Some(path) = path {
                        add(
                            &mut page,
                            format_args!("<path d=\"{}\" fill=\"{}\"/>", path_data(&path), hex(*colour)),
                        );
                    }
                }
            }
        }
        page.push_str("</svg>\n");
        page
    }
}

fn add(page: &mut String, line: std::fmt::Arguments) {
    writeln!(page, "{line}").expect("memory takes any text");
}

fn listed(points: &[(f32, f32)]) -> String {
    let points = points.iter().map(|(x, y)| format!("{x:.2},{y:.2}"));
    points.collect::<Vec<_>>().join(" ")
}

fn hex([r, g, b]: [u8; 3]) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}
