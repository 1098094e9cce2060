//! Settling velocity over time, with its means, the end of its transient, and what the literature says.

use super::axis::{Ticks, rounded_range};
use super::canvas::{Align, Pencil};
use super::colour::{BLUE, GREY, GRID, INK, REFERENCES, VERMILION};
use super::drawing::{Drawing, Figure, Format};
use super::labels::{SideLabel, draw_labels};
use super::text::{Span, above, below, italic, roman, width};
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
    /// `t*` at which the transient ends and the result from there, if it does.
    pub settled: Option<(f64, Estimate)>,
    /// Values to compare with, with the names to put beside them.
    pub references: &'a [(&'a str, f64)],
}

const PAGE: (f32, f32) = (1600.0, 1000.0);
/// Space left of the frame for the name of the axis, beside the numbers.
const NAME_SPACE: f32 = 90.0;
const TOP: f32 = 90.0;
const BOTTOM: f32 = 880.0;
const TITLE: f32 = 30.0;
const LABEL: f32 = 30.0;
const NUMBER: f32 = 24.0;
const TICK: f32 = 9.0;

/// Writes the figure of a settling velocity over time as PNG.
///
/// # Panics
/// If there are not as many velocities as times.
pub fn write_settling(path: &Path, plot: &SettlingPlot) -> Result<()> {
    settling_figure(plot).write(path, Format::Png)
}

/// Settling velocity over time, the mean with its standard error as a band, the end of the transient and the mean from there,
/// and reference lines.
///
/// # Panics
/// If there are not as many velocities as times.
pub fn settling_figure(plot: &SettlingPlot) -> Figure {
    assert_eq!(
        plot.t_star.len(),
        plot.velocity.len(),
        "one velocity for each time"
    );
    Figure {
        size: PAGE,
        title: format!("{}: settling velocity", plot.case),
        drawing: draw(plot),
    }
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

fn draw(plot: &SettlingPlot) -> Drawing {
    let labels = side_labels(plot);
    let widest = labels
        .iter()
        .flat_map(|label| &label.lines)
        .map(|line| width(&[roman(line)], NUMBER))
        .fold(0.0, f32::max);
    // Long names get space, but never more than half of the page.
    let margin = if labels.is_empty() { 60.0 } else { 60.0 + widest };
    let frame = Frame::new(plot, PAGE.0 - margin.min(0.5 * PAGE.0));

    let mut drawing = Drawing::default();
    draw_axes(&mut drawing, &frame);
    for ((_, value), colour) in plot.references.iter().zip(REFERENCES.iter().cycle()) {
        if value.is_finite() {
            let ends = vec![frame.at(frame.x.0, *value), frame.at(frame.x.1, *value)];
            drawing.polyline(ends, Pencil::new(*colour, 2.5).dashed());
        }
    }
    draw_series(&mut drawing, &frame, plot);
    drawing.frame((frame.left, TOP, frame.right, BOTTOM), Pencil::new(INK, 2.0));
    let within = (TOP - 20.0, BOTTOM + 60.0);
    draw_labels(&mut drawing, &labels, (frame.right, NUMBER), within, |v| {
        frame.at(0.0, v).1
    });
    drawing.text(
        vec![roman(plot.case.to_string())],
        TITLE,
        (frame.left, TOP - 28.0),
        Align::Start,
        INK,
    );
    drawing
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
    labels.extend(means(plot, 0.0).iter().map(|mean| SideLabel {
        value: mean.estimate.mean,
        lines: vec![mean.name.to_string(), with_error(mean.estimate)],
        colour: mean.colour,
    }));
    labels.retain(|label| label.value.is_finite());
    labels.sort_by(|a, b| b.value.total_cmp(&a.value));
    labels
}

/// A mean with its error: two digits of the error, and as many decimals of the mean.
fn with_error(estimate: Estimate) -> String {
    match estimate.standard_error {
        Some(error) => {
            let decimals = (1.0 - error.log10().floor()).clamp(2.0, 6.0) as usize;
            format!("{:.decimals$} \u{b1} {error:.decimals$}", estimate.mean)
        }
        None => significant(estimate.mean),
    }
}

/// A number with three significant digits.
fn significant(value: f64) -> String {
    let decimals = (2.0 - value.abs().max(1e-6).log10().floor()).clamp(0.0, 8.0) as usize;
    format!("{value:.decimals$}")
}

fn draw_axes(drawing: &mut Drawing, frame: &Frame) {
    let ink = Pencil::new(INK, 2.0);
    let grid = Pencil::new(GRID, 1.5);
    let horizontal = Ticks::new(frame.x.0, frame.x.1, 8.0);
    for &value in &horizontal.values {
        let (x, _) = frame.at(value, 0.0);
        drawing.polyline(vec![(x, TOP), (x, BOTTOM)], grid);
        drawing.polyline(vec![(x, BOTTOM + 2.0), (x, BOTTOM + 2.0 + TICK)], ink);
        let text = horizontal.label(value);
        drawing.text(vec![roman(text)], NUMBER, (x, BOTTOM + 40.0), Align::Middle, INK);
    }
    let vertical = Ticks::new(frame.y.0, frame.y.1, 8.0);
    for &value in &vertical.values {
        let (_, y) = frame.at(0.0, value);
        drawing.polyline(vec![(frame.left, y), (frame.right, y)], grid);
        drawing.polyline(vec![(frame.left - 2.0, y), (frame.left - 2.0 - TICK, y)], ink);
        let text = vertical.label(value);
        let place = (frame.left - 20.0, y + 0.36 * NUMBER);
        drawing.text(vec![roman(text)], NUMBER, place, Align::End, INK);
    }
    if frame.y.0 < 0.0 {
        let ends = vec![frame.at(frame.x.0, 0.0), frame.at(frame.x.1, 0.0)];
        drawing.polyline(ends, Pencil::new(GREY, 1.5));
    }
    let time: Vec<Span> = vec![
        italic("t"),
        above("*"),
        roman(" = "),
        italic("t u"),
        below("Stokes"),
        roman(" / "),
        italic("D"),
    ];
    let middle = 0.5 * (frame.left + frame.right);
    drawing.text(time, LABEL, (middle, BOTTOM + 94.0), Align::Middle, INK);
    let velocity = vec![
        roman("settling velocity  "),
        italic("u"),
        roman(" / "),
        italic("u"),
        below("Stokes"),
    ];
    let place = (NAME_SPACE - 44.0, 0.5 * (TOP + BOTTOM));
    drawing.text_upwards(velocity, LABEL, place, INK);
}

fn draw_series(drawing: &mut Drawing, frame: &Frame, plot: &SettlingPlot) {
    let within = |x: f64| x.clamp(frame.x.0, frame.x.1);
    if let Some(([from, to], _)) = plot.mean {
        let (l, r) = (frame.at(within(from), 0.0).0, frame.at(within(to), 0.0).0);
        drawing.rectangle((l, TOP, r, BOTTOM), VERMILION, 0.05);
    }
    let means = means(plot, frame.x.1);
    for mean in &means {
        let (l, r) = (
            frame.at(within(mean.from), 0.0).0,
            frame.at(within(mean.to), 0.0).0,
        );
        if let Some(error) = mean.estimate.standard_error {
            let (_, top) = frame.at(0.0, mean.estimate.mean + error);
            let (_, bottom) = frame.at(0.0, mean.estimate.mean - error);
            drawing.rectangle((l, top.max(TOP), r, bottom.min(BOTTOM)), mean.colour, 0.25);
        }
    }
    if let Some((end, _)) = plot.settled {
        let (x, _) = frame.at(within(end), 0.0);
        drawing.polyline(vec![(x, TOP), (x, BOTTOM)], Pencil::new(SETTLED, 2.0).dashed());
        let text = vec![
            roman("transient ends at "),
            italic("t"),
            above("*"),
            roman(format!(" = {end:.1}")),
        ];
        // Right of the line if there is space.
        let (place, align) = if x + 24.0 + width(&text, NUMBER) < frame.right {
            (x + 12.0, Align::Start)
        } else {
            (x - 12.0, Align::End)
        };
        drawing.text(text, NUMBER, (place, BOTTOM - 18.0), align, SETTLED);
    }
    let mut run: Vec<(f32, f32)> = Vec::new();
    let points = plot.t_star.iter().zip(plot.velocity);
    // A value that is not a number interrupts the line; the last, empty one ends it.
    for (&t, &v) in points.chain([(&f64::NAN, &f64::NAN)]) {
        if t.is_finite() && v.is_finite() {
            let place = frame.at(t, v);
            // Points closer than a quarter of a pixel are one.
            let near = |last: &(f32, f32)| (place.0 - last.0).abs().max((place.1 - last.1).abs()) < 0.25;
            if !run.last().is_some_and(near) {
                run.push(place);
            }
        } else {
            drawing.polyline(std::mem::take(&mut run), Pencil::new(BLUE, 3.0));
        }
    }
    for mean in &means {
        let ends = [mean.from, mean.to].map(|t| frame.at(within(t), mean.estimate.mean));
        let pencil = Pencil::new(mean.colour, 3.0);
        drawing.polyline(ends.to_vec(), if mean.dashed { pencil.dashed() } else { pencil });
    }
}

/// Colour of what follows the transient.
const SETTLED: [u8; 3] = INK;

/// A mean to be drawn.
struct Mean {
    name: &'static str,
    from: f64,
    to: f64,
    estimate: Estimate,
    colour: [u8; 3],
    dashed: bool,
}

/// The mean that was asked for and that behind the transient, whose series ends at `end`.
fn means(plot: &SettlingPlot, end: f64) -> Vec<Mean> {
    let asked = plot.mean.map(|([from, to], estimate)| Mean {
        name: "mean",
        from,
        to,
        estimate,
        colour: VERMILION,
        dashed: false,
    });
    let settled = plot.settled.map(|(from, estimate)| Mean {
        name: "after the transient",
        from,
        to: end,
        estimate,
        colour: SETTLED,
        dashed: true,
    });
    let both = asked.into_iter().chain(settled);
    both.filter(|mean| mean.estimate.mean.is_finite()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn colour_at(canvas: &crate::output::picture::canvas::Canvas, (x, y): (f32, f32)) -> [u8; 3] {
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
            settled: Some((
                20.0,
                Estimate {
                    mean: 0.4,
                    standard_error: None,
                },
            )),
            references: &[("reference", 0.5)],
        };
        let canvas = settling_figure(&plot).canvas();
        let label_width = width(&[roman("after the transient")], NUMBER);
        let frame = Frame::new(&plot, PAGE.0 - 60.0 - label_width);
        assert_eq!(colour_at(&canvas, frame.at(30.0, 0.2)), BLUE);
        assert_eq!(colour_at(&canvas, frame.at(75.0, 0.3)), VERMILION);
        assert_eq!(colour_at(&canvas, frame.at(0.5, 0.5)), REFERENCES[0]);
        let [r, g, b] = colour_at(&canvas, frame.at(75.0, 0.315));
        assert!(r > g && g > b, "the band is a light vermilion");
        assert_eq!(colour_at(&canvas, frame.at(25.0, 0.33)), [255, 255, 255]);
        let dark = |at: (f32, f32)| colour_at(&canvas, at) == SETTLED;
        let from = frame.at(20.0, 0.4);
        assert!(
            (0..40).any(|i| dark((from.0 + i as f32, from.1))),
            "the mean behind the transient"
        );
        assert!(
            (0..40).any(|i| dark((from.0, from.1 - 60.0 + i as f32))),
            "its end"
        );
        assert!(
            !(0..40).any(|i| dark((from.0 - 50.0 + i as f32, from.1))),
            "nothing before"
        );
    }

    #[test]
    fn nothing_to_show_still_makes_a_plot() {
        for velocity in [&[][..], &[f64::NAN], &[0.0]] {
            let canvas = settling_figure(&SettlingPlot {
                case: "",
                t_star: &[0.0][..velocity.len()],
                velocity,
                mean: None,
                settled: None,
                references: &[("unknown", f64::NAN)],
            })
            .canvas();
            assert_eq!((canvas.width(), canvas.height()), (1600, 1000));
        }
    }
}
