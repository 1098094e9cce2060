//! Figures as SVG: shapes as elements, text as outlines of glyphs, each of which is defined once.

use crate::drawing::{Align, Figure, Mark, Place};
use crate::text::{Glyph, glyphs, outline};
use std::collections::BTreeSet;
use std::fmt::Write;
use tiny_skia::PathSegment;

/// A page, which opens at half its size in pixels.
pub(crate) fn page(figure: &Figure) -> String {
    let (width, height) = figure.size;
    let mut body = String::new();
    let mut known = BTreeSet::new();
    for mark in &figure.drawing.marks {
        element(&mut body, mark, &mut known);
    }
    let mut glyphs = String::new();
    for (italic, id) in known {
        if let Some(data) = data(italic, id) {
            add(
                &mut glyphs,
                format_args!("<path id=\"{}\" d=\"{data}\"/>\n", name(italic, id)),
            );
        }
    }
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" xmlns:xlink=\"http://www.w3.org/1999/xlink\" width=\"{}\" \
         height=\"{}\" viewBox=\"0 0 {width} {height}\">\n<title>{}</title>\n\
         <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n<defs>\n{glyphs}</defs>\n{body}</svg>\n",
        0.5 * width,
        0.5 * height,
        escaped(&figure.title)
    )
}

/// Appends the element of a mark and a line break, and the glyphs that it needs to the known ones.
fn element(page: &mut String, mark: &Mark, known: &mut BTreeSet<(bool, u16)>) {
    match mark {
        Mark::Line {
            points,
            closed,
            pencil,
        } => {
            let name = if *closed { "polygon" } else { "polyline" };
            let dash: Vec<String> = pencil.dash().iter().map(ToString::to_string).collect();
            let dash = match &dash[..] {
                [] => String::new(),
                dash => format!(" stroke-dasharray=\"{}\"", dash.join(" ")),
            };
            let (points, colour, width) = (listed(points), hex(pencil.colour), pencil.width);
            add(
                page,
                format_args!(
                    "<{name} points=\"{points}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\" \
                     stroke-linejoin=\"round\"{dash}/>"
                ),
            );
        }
        Mark::Area {
            points,
            colour,
            opacity,
        } => {
            let (points, colour) = (listed(points), hex(*colour));
            let opacity = if *opacity < 1.0 {
                format!(" fill-opacity=\"{opacity}\"")
            } else {
                String::new()
            };
            add(
                page,
                format_args!("<polygon points=\"{points}\" fill=\"{colour}\"{opacity}/>"),
            );
        }
        Mark::Text {
            spans,
            size,
            at: (x, y),
            align,
            colour,
        } => {
            let (glyphs, width) = glyphs(spans, *size);
            let shift = align.shift(width);
            let place = match align {
                Align::Upwards => format!("translate({x:.2} {:.2}) rotate(-90)", y + shift),
                _ => format!("translate({:.2} {y:.2})", x - shift),
            };
            add(
                page,
                format_args!("<g fill=\"{}\" transform=\"{place}\">", hex(*colour)),
            );
            known.extend(glyphs.iter().map(|glyph| (glyph.italic, glyph.id)));
            text(page, &glyphs);
            page.push_str("</g>");
        }
        Mark::Image { image, at } => {
            let (x, y, width, height) = (at.0, at.1, image.width(), image.height());
            let data = base64(&image.png());
            add(
                page,
                format_args!(
                    "<image x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" \
                     xlink:href=\"data:image/png;base64,{data}\"/>"
                ),
            );
        }
    }
    page.push('\n');
}

/// Glyphs of one size and rise share a group, in which they count in units of the font.
fn text(page: &mut String, glyphs: &[Glyph]) {
    let key = |glyph: &Glyph| (glyph.scale.to_bits(), glyph.at.1.to_bits());
    for group in glyphs.chunk_by(|a, b| key(a) == key(b)) {
        let (y, scale) = (group[0].at.1, group[0].scale);
        add(
            page,
            format_args!("<g transform=\"translate(0 {y:.2}) scale({scale})\">"),
        );
        for glyph in group
            .iter()
            .filter(|glyph| outline(glyph.italic, glyph.id).is_some())
        {
            let (name, x) = (name(glyph.italic, glyph.id), glyph.at.0 / scale);
            add(page, format_args!("<use xlink:href=\"#{name}\" x=\"{x:.0}\"/>"));
        }
        page.push_str("</g>");
    }
}

fn name(italic: bool, id: u16) -> String {
    format!("{}{id}", if italic { 'i' } else { 'r' })
}

/// The attribute `d` of a glyph, to a unit of the font.
fn data(italic: bool, id: u16) -> Option<String> {
    let point = |p: tiny_skia::Point| format!("{:.0} {:.0}", p.x, p.y);
    let path = outline(italic, id)?;
    let segments = path.segments().map(|segment| match segment {
        PathSegment::MoveTo(p) => format!("M{}", point(p)),
        PathSegment::LineTo(p) => format!("L{}", point(p)),
        PathSegment::QuadTo(a, p) => format!("Q{} {}", point(a), point(p)),
        PathSegment::CubicTo(a, b, p) => format!("C{} {} {}", point(a), point(b), point(p)),
        PathSegment::Close => "Z".to_string(),
    });
    Some(segments.collect())
}

fn add(page: &mut String, text: std::fmt::Arguments) {
    page.write_fmt(text).expect("memory takes any text");
}

fn escaped(text: &str) -> String {
    let text = text.replace('&', "&amp;").replace('<', "&lt;");
    text.replace('>', "&gt;").replace('"', "&quot;")
}

fn listed(points: &[Place]) -> String {
    let points = points.iter().map(|(x, y)| format!("{x:.2},{y:.2}"));
    points.collect::<Vec<_>>().join(" ")
}

fn hex([r, g, b]: [u8; 3]) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len() / 3 * 4 + 4);
    for chunk in bytes.chunks(3) {
        let word = (0..3).fold(0, |word, i| word << 8 | u32::from(*chunk.get(i).unwrap_or(&0)));
        for i in 0..4 {
            let digit = DIGITS[(word >> (18 - 6 * i) & 63) as usize];
            text.push(if i <= chunk.len() { char::from(digit) } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::base64;

    #[test]
    fn bytes_become_base64_with_its_padding() {
        // RFC 4648, section 10.
        for (bytes, text) in [
            ("", ""),
            ("f", "Zg=="),
            ("fo", "Zm8="),
            ("foo", "Zm9v"),
            ("foob", "Zm9vYg=="),
        ] {
            assert_eq!(base64(bytes.as_bytes()), text);
        }
    }
}
