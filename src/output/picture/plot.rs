//! Settling velocity over time, with its mean and what the literature says.

use super::axis::{Ticks, rounded_range};
use super::canvas::{Align, Canvas, Pencil};
use super::colour::{BLUE, GREY, GRID, INK, REFERENCES, VERMILION};
use super::labels::{SideLabel, draw_labels};
use super::text::{Span, above, below, italic, roman, width};
use super::write_png;
use crate::error::Result;
use crate::output::Estimate;
use std::path::Path;

/// What a plot of settling velocity shows.
#[derive(Clone, Copy, Debug)]
pub struct SettlingPlot<'a> {
    /// Name of the case, for the title.
    pub case: &'a str,
    /// Time over `D / u_Stokes` (-), ascending.
    pub t_star: &'a [f64],
    /// Settling velocity over `u_Stokes` (-), one for each time.
    pub velocity: &'a [f64],
    /// Interval of `t*` that is averaged over and the result, if there is one.
    pub mean: Option<([f64; 2], Estimate)>,
    /// Values to compare with, with the names to put beside them.
    pub references: &'a [(&'a str, f64)],
}

const PAGE: (u32, u32) = (1600, 1000);
/// Space left of the frame for the name of the axis, beside the numbers.
const NAME_SPACE: f32 = 90.0;
const TOP: f32 = 90.0;
const BOTTOM: f32 = 880.0;
const TITLE: f32 = 30.0;
const LABEL: f32 = 30.0;
const NUMBER: f32 = 24.0;
const TICK: f32 = 9.0;

/// Draws settling velocity over time, the mean with its standard error as a band, and reference lines.
///
/// # Panics
/// If there are not as many velocities as times.
pub fn write_settling(path: &Path, plot: &SettlingPlot) -> Result<()> {
    assert_eq!(
        plot.t_star.len(),
        plot.velocity.len(),
        "one velocity for each time"
    );
    write_png(path, &draw(plot))
}

/// Data ranges and the pixels they cover.
struct Frame {
    x: (f64, f64),
    y: (f64, f64),
    left: f32,
    right: f32,
}

impl Frame {
    fn new(plot: &SettlingPlot, right: f32) -> Self {
        let finite = |x: &f64| x.is_finite();
        let end = plot.t_star.iter().copied().filter(finite).fold(0.0, f64::max);
        let values = plot
            .velocity
            .iter()
            .copied()
            .chain(plot.references.iter().map(|r| r.1))
            .filter(finite);
        let (lo, hi) = values.fold((0.0, 0.0), |(lo, hi): (f64, f64), v| (lo.min(v), hi.max(v)));
        // A start that trembles about zero does not deserve a range of its own.
        let lo = if lo > -0.03 * hi { 0.0 } else { lo };
        let y = if hi > lo {
            rounded_range(lo, hi + 0.02 * (hi - lo), 12.0)
        } else {
            (0.0, 1.0)
        };
        Self {
            x: (0.0, if end > 0.0 { end } else { 1.0 }),
            y,
            left: NAME_SPACE + Ticks::new(y.0, y.1, 8.0).widest(NUMBER),
            right,
        }
    }

    fn at(&self, x: f64, y: f64) -> (f32, f32) {
        let part = |v: f64, (lo, hi): (f64, f64)| ((v - lo) / (hi - lo)) as f32;
        (
            self.left + part(x, self.x) * (self.right - self.left),
            BOTTOM - part(y, self.y) * (BOTTOM - TOP),
        )
    }
}

fn draw(plot: &SettlingPlot) -> Canvas {
    let labels = side_labels(plot);
    let widest = labels
        .iter()
        .flat_map(|label| &label.lines)
        .map(|line| width(&[roman(line)], NUMBER))
        .fold(0.0, f32::max);
    // Long names get space, but never more than half of the page.
    let margin = if labels.is_empty() { 60.0 } else { 60.0 + widest };
    let frame = Frame::new(plot, PAGE.0 as f32 - margin.min(0.5 * PAGE.0 as f32));

    let mut canvas = Canvas::new(PAGE.0, PAGE.1);
    draw_axes(&mut canvas, &frame);
    for ((_, value), colour) in plot.references.iter().zip(REFERENCES.iter().cycle()) {
        if value.is_finite() {
            let pencil = Pencil {
                dashed: true,
                ..Pencil::new(*colour, 2.5)
            };
            canvas.line(frame.at(frame.x.0, *value), frame.at(frame.x.1, *value), pencil);
        }
    }
    draw_series(&mut canvas, &frame, plot);
    canvas.frame((frame.left, TOP, frame.right, BOTTOM), Pencil::new(INK, 2.0));
    let within = (TOP - 20.0, BOTTOM + 60.0);
    draw_labels(&mut canvas, &labels, (frame.right, NUMBER), within, |v| {
        frame.at(0.0, v).1
    });
    canvas.text(
        &[roman(plot.case)],
        TITLE,
        (frame.left, TOP - 28.0),
        Align::Start,
        INK,
    );
    canvas
}

fn side_labels(plot: &SettlingPlot) -> Vec<SideLabel> {
    let mut labels: Vec<SideLabel> = plot
        .references
        .iter()
        .zip(REFERENCES.iter().cycle())
        .filter(|(reference, _)| reference.1.is_finite())
        .map(|(&(name, value), &colour)| SideLabel {
            value,
            lines: vec![name.to_string(), significant(value)],
            colour,
        })
        .collect();
    if let Some((_, estimate)) = plot.mean {
        let number = match estimate.standard_error {
            Some(error) => {
                // Two digits of the error, and as many decimals of the mean.
                let decimals = (1.0 - error.log10().floor()).clamp(2.0, 6.0) as usize;
                format!("{:.decimals$} \u{b1} {error:.decimals$}", estimate.mean)
            }
            None => significant(estimate.mean),
        };
        labels.push(SideLabel {
            value: estimate.mean,
            lines: vec!["mean".to_string(), number],
            colour: VERMILION,
        });
    }
    labels.retain(|label| label.value.is_finite());
    labels.sort_by(|a, b| b.value.total_cmp(&a.value));
    labels
}

/// A number with three significant digits.
fn significant(value: f64) -> String {
    let decimals = (2.0 - value.abs().max(1e-6).log10().floor()).clamp(0.0, 8.0) as usize;
    format!("{value:.decimals$}")
}

fn draw_axes(canvas: &mut Canvas, frame: &Frame) {
    let ink = Pencil::new(INK, 2.0);
    let grid = Pencil::new(GRID, 1.5);
    let horizontal = Ticks::new(frame.x.0, frame.x.1, 8.0);
    for &value in &horizontal.values {
        let (x, _) = frame.at(value, 0.0);
        canvas.line((x, TOP), (x, BOTTOM), grid);
        canvas.line((x, BOTTOM + 2.0), (x, BOTTOM + 2.0 + TICK), ink);
        let text = horizontal.label(value);
        canvas.text(&[roman(&text)], NUMBER, (x, BOTTOM + 40.0), Align::Middle, INK);
    }
    let vertical = Ticks::new(frame.y.0, frame.y.1, 8.0);
    for &value in &vertical.values {
        let (_, y) = frame.at(0.0, value);
        canvas.line((frame.left, y), (frame.right, y), grid);
        canvas.line((frame.left - 2.0, y), (frame.left - 2.0 - TICK, y), ink);
        let text = vertical.label(value);
        let place = (frame.left - 20.0, y + 0.36 * NUMBER);
        canvas.text(&[roman(&text)], NUMBER, place, Align::End, INK);
    }
    if frame.y.0 < 0.0 {
        canvas.line(
            frame.at(frame.x.0, 0.0),
            frame.at(frame.x.1, 0.0),
            Pencil::new(GREY, 1.5),
        );
    }
    let time: [Span; 7] = [
        italic("t"),
        above("*"),
        roman(" = "),
        italic("t u"),
        below("Stokes"),
        roman(" / "),
        italic("D"),
    ];
    let middle = 0.5 * (frame.left + frame.right);
    canvas.text(&time, LABEL, (middle, BOTTOM + 94.0), Align::Middle, INK);
    let velocity = [
        roman("settling velocity  "),
        italic("u"),
        roman(" / "),
        italic("u"),
        below("Stokes"),
    ];
    let place = (NAME_SPACE - 44.0, 0.5 * (TOP + BOTTOM));
    canvas.text_upwards(&velocity, LABEL, place, INK);
}

fn draw_series(canvas: &mut Canvas, frame: &Frame, plot: &SettlingPlot) {
    if let Some(([from, to], estimate)) = plot.mean.filter(|m| m.1.mean.is_finite()) {
        let (l, _) = frame.at(from.max(frame.x.0), 0.0);
        let (r, _) = frame.at(to.min(frame.x.1), 0.0);
        canvas.rectangle((l, TOP, r, BOTTOM), VERMILION, 0.05);
        if let Some(error) = estimate.standard_error {
            let (_, top) = frame.at(0.0, estimate.mean + error);
            let (_, bottom) = frame.at(0.0, estimate.mean - error);
            canvas.rectangle((l, top.max(TOP), r, bottom.min(BOTTOM)), VERMILION, 0.3);
        }
    }
    let mut run: Vec<(f32, f32)> = Vec::new();
    let points = plot.t_star.iter().zip(plot.velocity);
    // A value that is not a number interrupts the line; the last, empty one ends it.
    for (&t, &v) in points.chain([(&f64::NAN, &f64::NAN)]) {
        if t.is_finite() && v.is_finite() {
            run.push(frame.at(t, v));
        } else {
            canvas.polyline(&run, Pencil::new(BLUE, 3.0));
            run.clear();
        }
    }
    if let Some(([from, to], estimate)) = plot.mean.filter(|m| m.1.mean.is_finite()) {
        canvas.line(
            frame.at(from.max(frame.x.0), estimate.mean),
            frame.at(to.min(frame.x.1), estimate.mean),
            Pencil::new(VERMILION, 3.0),
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn colour_at(canvas: &Canvas, (x, y): (f32, f32)) -> [u8; 3] {
        let first = 3 * (y as usize * canvas.width() as usize + x as usize);
        canvas.rgb()[first..first + 3].try_into().unwrap()
    }

    #[test]
    fn series_mean_and_reference_are_drawn_where_their_values_are() {
        let t_star: Vec<f64> = (0..=100).map(f64::from).collect();
        let plot = SettlingPlot {
            case: "test",
            velocity: &vec![0.2; t_star.len()],
            t_star: &t_star,
            mean: Some((
                [50.0, 100.0],
                Estimate {
                    mean: 0.3,
                    standard_error: Some(0.02),
                },
            )),
            references: &[("reference", 0.5)],
        };
        let canvas = draw(&plot);
        let label_width = width(&[roman("0.300 \u{b1} 0.020")], NUMBER);
        let frame = Frame::new(&plot, PAGE.0 as f32 - 60.0 - label_width);
        assert_eq!(colour_at(&canvas, frame.at(30.0, 0.2)), BLUE);
        assert_eq!(colour_at(&canvas, frame.at(75.0, 0.3)), VERMILION);
        assert_eq!(colour_at(&canvas, frame.at(0.5, 0.5)), REFERENCES[0]);
        let [r, g, b] = colour_at(&canvas, frame.at(75.0, 0.315));
        assert!(r > g && g > b, "the band is a light vermilion");
        assert_eq!(colour_at(&canvas, frame.at(25.0, 0.33)), [255, 255, 255]);
    }

    #[test]
    fn nothing_to_show_still_makes_a_plot() {
        for velocity in [&[][..], &[f64::NAN], &[0.0]] {
            let canvas = draw(&SettlingPlot {
                case: "",
                t_star: &[0.0][..velocity.len()],
                velocity,
                mean: None,
                references: &[("unknown", f64::NAN)],
            });
            assert_eq!((canvas.width(), canvas.height()), PAGE);
        }
    }
}
