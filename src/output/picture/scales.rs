//! The numbers around a slice: its axes and its colour bar.

use super::axis::Ticks;
use super::canvas::{Align, Canvas, Pencil};
use super::colour::{INK, viridis};
use super::plane::Plane;
use super::text::{Span, italic, roman};

/// Space left of the slice for the name of the axis, beside the numbers.
const NAME_SPACE: f32 = 80.0;
/// Space right of the slice for the colour bar and its name, beside the numbers.
const BAR_SPACE: f32 = BAR.0 + BAR.1 + 84.0;
const LABEL: f32 = 28.0;
const NUMBER: f32 = 24.0;
const TICK: f32 = 9.0;
/// Left edge and width of the colour bar, from the right edge of the slice.
const BAR: (f32, f32) = (36.0, 30.0);

/// The numbers around the slice.
pub(super) struct Axes {
    across: Ticks,
    up: Ticks,
    bar: Ticks,
    /// Value at the upper end of the colour bar.
    top: f64,
    /// Unit of length of the axes (m), and what it is called if it is not the diameter.
    unit: (f64, Option<&'static str>),
}

impl Axes {
    /// For a slice of `width` by `height` pixels and a colour bar up to `top`; lengths are in diameters if there is one.
    pub(super) fn new(diameter: Option<f64>, plane: &Plane, (width, height): (u32, u32), top: f64) -> Self {
        let unit = match diameter {
            Some(diameter) => (diameter, None),
            None => match unit_prefix(plane.size.0.max(plane.size.1)) {
                ("m", factor) => (1.0 / factor, Some("mm")),
                ("", factor) => (1.0 / factor, Some("m")),
                (_, factor) => (1.0 / factor, Some("\u{b5}m")),
            },
        };
        let ticks =
            |length: f64, pixels: u32| Ticks::new(0.0, length / unit.0, (f64::from(pixels) / 110.0).max(2.0));
        Self {
            across: ticks(plane.size.0, width),
            up: ticks(plane.size.1, height),
            bar: Ticks::new(0.0, top, (f64::from(height) / 60.0).clamp(2.0, 9.0)),
            top,
            unit,
        }
    }

    /// Space that numbers and names take left and right of the slice.
    pub(super) fn margins(&self) -> (u32, u32) {
        let left = NAME_SPACE + self.up.widest(NUMBER);
        let right = BAR_SPACE + self.bar.widest(NUMBER);
        (left.ceil() as u32, right.ceil() as u32)
    }

    /// A coordinate (m) in the unit of the axes.
    pub(super) fn coordinate(&self, axis: usize, at: f64) -> Coordinate {
        Coordinate {
            name: ["x", "y", "z"][axis],
            number: format!(" = {:.2} ", at / self.unit.0),
            unit: self.unit.1,
        }
    }

    fn axis_name(&self, axis: usize) -> Vec<Span<'static>> {
        let name = italic(["x", "y", "z"][axis]);
        match self.unit.1 {
            None => vec![name, roman(" / "), italic("D")],
            Some(unit) => vec![name, roman(" ("), roman(unit), roman(")")],
        }
    }

    pub(super) fn draw_axes(&self, canvas: &mut Canvas, plane: &Plane, (l, t, r, b): (f32, f32, f32, f32)) {
        let pencil = Pencil::new(INK, 2.0);
        let pixels_per_metre = f64::from(b - t) / plane.size.1;
        for &value in &self.across.values {
            let x = l + (value * self.unit.0 * pixels_per_metre) as f32;
            canvas.line((x, b + 2.0), (x, b + 2.0 + TICK), pencil);
            let text = self.across.label(value);
            canvas.text(&[roman(&text)], NUMBER, (x, b + 38.0), Align::Middle, INK);
        }
        for &value in &self.up.values {
            let y = t + (plane.down(value * self.unit.0) * pixels_per_metre) as f32;
            canvas.line((l - 2.0, y), (l - 2.0 - TICK, y), pencil);
            let text = self.up.label(value);
            let place = (l - 18.0, y + 0.36 * NUMBER);
            canvas.text(&[roman(&text)], NUMBER, place, Align::End, INK);
        }
        let below = (0.5 * (l + r), b + 82.0);
        canvas.text(&self.axis_name(plane.across), LABEL, below, Align::Middle, INK);
        let beside = (l - 36.0 - self.up.widest(NUMBER), 0.5 * (t + b));
        canvas.text_upwards(&self.axis_name(plane.up), LABEL, beside, INK);
    }

    /// The colour bar right of the slice; `speed` says whose speed it means.
    pub(super) fn draw_bar(
        &self,
        canvas: &mut Canvas,
        (_, t, r, b): (f32, f32, f32, f32),
        prefix: &str,
        speed: &[Span],
    ) {
        let (left, right) = (r + BAR.0, r + BAR.0 + BAR.1);
        let rows = (b - t).round() as u32;
        let colours: Vec<[u8; 3]> = (0..rows)
            .flat_map(|y| {
                let colour = viridis(1.0 - (f64::from(y) + 0.5) / f64::from(rows));
                std::iter::repeat_n(colour, BAR.1 as usize)
            })
            .collect();
        let bar = Canvas::from_pixels(BAR.1 as u32, rows, &colours);
        canvas.paste(&bar, left as u32, t as u32);
        canvas.frame((left, t, right, b), Pencil::new(INK, 2.0));
        for &value in &self.bar.values {
            let y = b - (value / self.top) as f32 * (b - t);
            canvas.line((right + 2.0, y), (right + 2.0 + TICK, y), Pencil::new(INK, 2.0));
            let text = self.bar.label(value);
            let place = (right + 18.0, y + 0.36 * NUMBER);
            canvas.text(&[roman(&text)], NUMBER, place, Align::Start, INK);
        }
        let unit = format!(" ({prefix}m/s)");
        let mut label = speed.to_vec();
        label.push(roman(&unit));
        let place = (right + 60.0 + self.bar.widest(NUMBER), 0.5 * (t + b));
        canvas.text_upwards(&label, LABEL, place, INK);
    }
}

/// Where along an axis, as text.
pub(super) struct Coordinate {
    name: &'static str,
    number: String,
    unit: Option<&'static str>,
}

impl Coordinate {
    pub(super) fn spans(&self) -> Vec<Span<'_>> {
        let unit = self.unit.map_or_else(|| italic("D"), roman);
        vec![italic(self.name), roman(&self.number), unit]
    }
}

/// Prefix of the unit that makes the numbers of order one to a thousand, and the factor to it.
pub(super) fn unit_prefix(largest: f64) -> (&'static str, f64) {
    match largest {
        x if x >= 1.0 || x <= 0.0 || x.is_nan() => ("", 1.0),
        x if x >= 1e-3 => ("m", 1e3),
        _ => ("\u{b5}", 1e6),
    }
}
