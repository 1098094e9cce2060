//! Figures as SVG: shapes as elements, text as outlines of glyphs, each of which is defined once.

use crate::drawing::{Align, Figure, Mark, Place};
use crate::text::{Glyph, glyphs, outline};
use std::collections::BTreeSet;
use tiny_skia::PathSegment;

/// A page, which opens at half its size in pixels.
pub(crate) fn page(figure: &Figure) -> String {
    let (width, height) = figure.size;
    let mut body = String::new();
    let mut known = BTreeSet::new();
    for mark in &figure.drawing.marks {
        element(&mut body, mark, &mut known);
    }
    let glyphs = known.into_iter().filter_map(|(italic, id)| {
        let (name, data) = (name(italic, id), data(italic, id)?);
        Some(format!("<path id=\"{name}\" d=\"{data}\"/>\n"))
    });
    let glyphs: String = glyphs.collect();
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
    let element = match mark {
        Mark::Line(points, closed, pencil) => {
            let name = if *closed { "polygon" } else { "polyline" };
            let dashes: Vec<String> = pencil.dash().iter().map(ToString::to_string).collect();
            let dashes = attribute("stroke-dasharray", &dashes.join(" "), pencil.dashes.is_empty());
            let (points, colour, width) = (listed(points), hex(pencil.colour), pencil.width);
            format!(
                "<{name} points=\"{points}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\" \
                 stroke-linejoin=\"round\"{dashes}/>"
            )
        }
        Mark::Area(points, colour, opacity) => {
            let (points, colour) = (listed(points), hex(*colour));
            let opacity = attribute("fill-opacity", &opacity.to_string(), *opacity >= 1.0);
            format!("<polygon points=\"{points}\" fill=\"{colour}\"{opacity}/>")
        }
        Mark::Text(spans, size, (x, y), align, colour) => {
            let (glyphs, width) = glyphs(spans, *size);
            let shift = align.shift(width);
            let place = match align {
                Align::Upwards => format!("translate({x:.2} {:.2}) rotate(-90)", y + shift),
                _ => format!("translate({:.2} {y:.2})", x - shift),
            };
            known.extend(glyphs.iter().map(|glyph| (glyph.italic, glyph.id)));
            format!("<g fill=\"{}\" transform=\"{place}\">{}</g>", hex(*colour), text(&glyphs))
        }
        Mark::Image(image, (x, y)) => {
            let (width, height, data) = (image.width(), image.height(), base64(&image.png()));
            format!(
                "<image x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" \
                 xlink:href=\"data:image/png;base64,{data}\"/>"
            )
        }
    };
    page.extend([&element, "\n"]);
}

/// An attribute behind a blank, nothing where it has its usual value.
fn attribute(name: &str, value: &str, usual: bool) -> String {
    if usual { String::new() } else { format!(" {name}=\"{value}\"") }
}

/// Glyphs of one size and rise share a group, in which they count in units of the font.
fn text(glyphs: &[Glyph]) -> String {
    let key = |glyph: &Glyph| (glyph.scale.to_bits(), glyph.at.1.to_bits());
    let groups = glyphs.chunk_by(|a, b| key(a) == key(b)).map(|group| {
        let (y, scale) = (group[0].at.1, group[0].scale);
        let seen = group.iter().filter(|glyph| outline(glyph.italic, glyph.id).is_some());
        let uses = seen.map(|glyph| {
            let (name, x) = (name(glyph.italic, glyph.id), glyph.at.0 / scale);
            format!("<use xlink:href=\"#{name}\" x=\"{x:.0}\"/>")
        });
        let uses: String = uses.collect();
        format!("<g transform=\"translate(0 {y:.2}) scale({scale})\">{uses}</g>")
    });
    groups.collect()
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
        for (bytes, text) in [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foob", "Zm9vYg==")]
        {
            assert_eq!(base64(bytes.as_bytes()), text);
        }
    }
}
