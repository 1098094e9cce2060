//! Figures as SVG; text is drawn as outlines.

use crate::drawing::{Figure, Mark};
use base64::prelude::{BASE64_STANDARD, Engine};
use tiny_skia::{Path, PathSegment};

/// A page, which opens at half its size in pixels.
pub(crate) fn page(figure: &Figure) -> String {
    let (width, height) = figure.size;
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" xmlns:xlink=\"http://www.w3.org/1999/xlink\" width=\"{}\" \
         height=\"{}\" viewBox=\"0 0 {width} {height}\">\n<title>{}</title>\n\
         <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n{}</svg>\n",
        0.5 * width,
        0.5 * height,
        escaped(&figure.title),
        body(figure)
    )
}

/// An element of a page in HTML, which names it there.
pub(crate) fn inline(figure: &Figure) -> String {
    let (width, height) = figure.size;
    format!(
        "<svg viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{}\">\n{}</svg>",
        escaped(&figure.title).replace('"', "&quot;"),
        body(figure)
    )
}

fn body(figure: &Figure) -> String {
    figure.drawing.0.iter().map(element).collect()
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// The element of a mark and a line break.
fn element(mark: &Mark) -> String {
    let hex = |[r, g, b]: [u8; 3]| format!("#{r:02x}{g:02x}{b:02x}");
    match mark {
        Mark::Line(path, stroke) => {
            let (colour, width, data) = (hex(stroke.colour), stroke.width, data(path));
            let dashes: Vec<String> = stroke.dash().iter().map(ToString::to_string).collect();
            let dashes = if dashes.is_empty() { "none".to_string() } else { dashes.join(" ") };
            format!(
                "<path fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\" stroke-dasharray=\"{dashes}\" \
                 stroke-linejoin=\"round\" d=\"{data}\"/>\n"
            )
        }
        Mark::Area(path, colour, opacity) => {
            format!("<path fill=\"{}\" fill-opacity=\"{opacity}\" d=\"{}\"/>\n", hex(*colour), data(path))
        }
        Mark::Image(image, (x, y)) => {
            let (width, height, data) = (image.width(), image.height(), BASE64_STANDARD.encode(image.png()));
            format!(
                "<image x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" \
                 xlink:href=\"data:image/png;base64,{data}\"/>\n"
            )
        }
    }
}

/// The attribute `d` of a path.
fn data(path: &Path) -> String {
    let point = |p: tiny_skia::Point| format!("{:.2} {:.2}", p.x, p.y);
    let segments = path.segments().map(|segment| match segment {
        PathSegment::MoveTo(p) => format!("M{}", point(p)),
        PathSegment::LineTo(p) => format!("L{}", point(p)),
        PathSegment::QuadTo(a, p) => format!("Q{} {}", point(a), point(p)),
        PathSegment::CubicTo(a, b, p) => format!("C{} {} {}", point(a), point(b), point(p)),
        PathSegment::Close => "Z".to_string(),
    });
    segments.collect()
}
