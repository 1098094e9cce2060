//! A picture in colours: pixels on axes, with a colour bar.

use crate::colour::{Colours, INK, WALL};
use crate::drawing::{Align, Area, Drawing, Figure, Mark, Readings, Stroke};
use crate::image::Image;
use crate::markup::{axis_label, literal};
use crate::scale::{Ends, Scale, Side};
use crate::text::width;

/// Contents of a picture.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Name above the image, on the left; no symbols.
    pub title: String,
    /// Above the image, on the right.
    pub caption: String,
    /// The pixels.
    pub image: Image,
    /// Horizontal axis: label, and the length of the image in its unit; it starts at zero on the left.
    pub x: (String, f64),
    /// Vertical axis: label, and the length of the image in its unit; it starts at zero at the bottom.
    pub y: (String, f64),
    /// True if the vertical axis starts at the top instead.
    pub downwards: bool,
    /// Colour bar.
    pub bar: Bar,
    /// Walls left and right, and below and above.
    pub closed: [bool; 2],
}

/// A colour bar.
#[derive(Clone, Debug, PartialEq)]
pub struct Bar {
    /// Quantity and unit.
    pub label: String,
    /// Numbers at its ends.
    pub range: (f64, f64),
    /// Colours.
    pub colours: Colours,
}

/// Space left of the image for the name of the axis, beside the numbers.
const NAME_SPACE: f32 = 80.0;
/// Left edge and width of the colour bar, from the right edge of the image.
const BAR: (f32, f32) = (36.0, 30.0);
/// Space for the ticks of the colour bar, and for its name beside the numbers.
const TICKS: f32 = 20.0;
const BAR_NAME: f32 = 64.0;
const TOP: f32 = 90.0;
const BOTTOM: f32 = 110.0;
/// Smallest height of a page in pixels.
const LOWEST: f32 = 900.0;
pub(crate) const TITLE: f32 = 30.0;
pub(crate) const LABEL: f32 = 28.0;
const NUMBER: f32 = 24.0;
/// Width of the line that stands for a wall.
const CLOSED: f32 = 10.0;

impl Picture {
    /// Draws the picture.
    pub fn figure(&self) -> Figure {
        let (width_, height) = (self.image.width() as f32, self.image.height() as f32);
        let scale =
            |length: f64, steps: f32| Scale::new(&[0.0, length], false, Ends::Tight, f64::from(steps));
        let x = scale(self.x.1, (width_ / 110.0).max(2.0));
        let y = scale(self.y.1, (height / 110.0).max(2.0));
        let beside = self.bar.space(height, 1.0);
        let (left, right) = ((NAME_SPACE + y.widest(NUMBER)).ceil(), beside.ceil());
        let name = literal(&self.title);
        let titles = (width(&name, TITLE) + width(&self.caption, TITLE) + 2.0 * TITLE).floor();
        let size = (left + right + width_.max(titles), (TOP + height + BOTTOM).max(LOWEST));
        let l = left + (0.5 * (size.0 - left - right - width_)).floor();
        let t = TOP + (0.5 * (size.1 - TOP - BOTTOM - height)).floor();
        let area @ (.., r, b) = (l, t, l + width_, t + height);

        let mut drawing = Drawing::default();
        drawing.0.push(Mark::Image(self.image.clone(), (l as u32, t as u32)));
        self.draw_walls(&mut drawing, area);
        drawing.frame(area, Stroke::new(INK, 2.0));
        let inset = 0.5 * (titles - width_).max(0.0);
        drawing.text(&name, TITLE, (l - inset, t - 26.0), Align::Start, INK);
        drawing.text(&self.caption, TITLE, (r + inset, t - 26.0), Align::End, INK);

        x.draw(&mut drawing, Side::Below, area, NUMBER);
        let flipped = if self.downwards { (l, b, r, t) } else { area };
        y.draw(&mut drawing, Side::Left, flipped, NUMBER);
        let across = axis_label(&self.x.0, x.exponent);
        drawing.text(&across, LABEL, (0.5 * (l + r), b + 82.0), Align::Middle, INK);
        let (up, beside) = (axis_label(&self.y.0, y.exponent), l - 36.0 - y.widest(NUMBER));
        drawing.text(&up, LABEL, (beside, 0.5 * (t + b)), Align::Upwards, INK);
        self.bar.draw(&mut drawing, r, (t, b), (1.0, f32::INFINITY));
        let title = format!("{}: {}", self.title, self.caption);
        Figure { size, title, drawing, readings: Readings::default() }
    }

    /// Draws thick lines outside of the sides with walls.
    fn draw_walls(&self, drawing: &mut Drawing, (l, t, r, b): Area) {
        let [beside, above] = self.closed;
        if beside {
            drawing.rectangle((l - CLOSED, t, l, b), WALL, 1.0);
            drawing.rectangle((r, t, r + CLOSED, b), WALL, 1.0);
        }
        if above {
            // Corners belong to a line only where both sides are closed.
            let more = if beside { CLOSED } else { 0.0 };
            drawing.rectangle((l - more, t - CLOSED, r + more, t), WALL, 1.0);
            drawing.rectangle((l - more, b, r + more, b + CLOSED), WALL, 1.0);
        }
    }
}

impl Bar {
    /// Its numbers, on a bar of this height (pixels).
    fn scale(&self, height: f32) -> Scale {
        let (lo, hi) = self.range;
        Scale::new(&[lo, hi], false, Ends::Tight, f64::from((height / 60.0).clamp(2.0, 9.0)))
    }

    /// Width that it takes beside an image with its numbers and its name, `part` times as large as usual.
    pub(crate) fn space(&self, height: f32, part: f32) -> f32 {
        TICKS + part * (BAR.0 + BAR.1 + BAR_NAME) + self.scale(height / part).widest(part * NUMBER)
    }

    /// Draws it right of an image that ends at `r`, between the rows `t` and `b`, `part` times as large as usual; its name fits into
    /// `room` pixels.
    pub(crate) fn draw(&self, drawing: &mut Drawing, r: f32, (t, b): (f32, f32), (part, room): (f32, f32)) {
        let (scale, number) = (self.scale((b - t) / part), part * NUMBER);
        let across = (part * BAR.1).round();
        let (left, right) = (r + part * BAR.0, r + part * BAR.0 + across);
        let (rows, (lo, hi)) = ((b - t) as u32, self.range);
        let row = |y: u32| {
            let value = hi - (hi - lo) * (f64::from(y) + 0.5) / f64::from(rows);
            self.colours.of(value, self.range)
        };
        let colours: Vec<[u8; 3]> = (0..rows).flat_map(|y| vec![row(y); across as usize]).collect();
        let image = Image::new(across as u32, rows, &colours);
        drawing.0.push(Mark::Image(image, (left as u32, t as u32)));
        drawing.frame((left, t, right, b), Stroke::new(INK, 2.0));
        scale.draw(drawing, Side::Right, (left, t, right, b), number);
        let name = axis_label(&self.label, scale.exponent);
        let size = part * LABEL * (room / width(&name, part * LABEL)).min(1.0);
        let at = (right + TICKS + scale.widest(number) + part * 40.0, 0.5 * (t + b));
        drawing.text(&name, size, at, Align::Upwards, INK);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(width: u32, height: u32) -> Picture {
        Picture {
            title: "a rather long name of a case that is wider than its image".into(),
            caption: "y = 4.00 D     t* = 12.3".into(),
            image: Image::new(width, height, &vec![[200, 0, 0]; (width * height) as usize]),
            x: ("x / D".into(), 8.0),
            y: ("z / D".into(), 16.0),
            downwards: false,
            bar: Bar { label: "speed |u| (mm/s)".into(), range: (0.0, 40.0), colours: Colours::Viridis },
            closed: [true, false],
        }
    }

    #[test]
    fn the_image_is_whole_on_a_page_at_least_900_pixels_high() {
        for (width, height) in [(500, 1000), (2200, 60), (62, 1000), (1000, 1000)] {
            let page = picture(width, height).figure().image();
            assert!(page.height() >= 900 && page.width() < 2600, "{width} {height}");
            let red = |y: u32| (0..page.width()).filter(|&x| page.colour(x, y) == [200, 0, 0]).count();
            let rows: Vec<u32> = (0..page.height()).filter(|&y| red(y) == width as usize).collect();
            assert_eq!(rows.len(), height as usize);
        }
    }

    #[test]
    fn walls_are_grey_lines_beside_the_image_and_the_svg_holds_it() {
        let (closed, figure) = ([true, true], picture(500, 800).figure());
        let open = figure.image();
        let walls = Picture { closed, ..picture(500, 800) }.figure().image();
        let y = |image: &Image| (0..image.height()).filter(|&y| image.colour(900, y) == WALL).count();
        assert!(y(&open) < y(&walls));
        let svg = String::from_utf8(figure.encode(crate::Format::Svg)).unwrap();
        assert_eq!(svg.matches("data:image/png;base64,").count(), 2);
    }
}
