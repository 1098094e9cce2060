//! Curves over each other, on linear or logarithmic axes.
//!
//! Curves that should coincide stay visible where they do: the reference lies below, thick and pale; on it a thin solid
//! line; on that dashes. Curves of few points have them marked, the solid line by dots and the dashes by rings round them.

use super::canvas::{Align, Pencil};
use super::colour::{BLUE, GREY, GRID, INK, REFERENCES, VERMILION};
use super::drawing::{Drawing, Figure, Format};
use super::markup;
use super::plot_axis::{Axis, Tick};
use super::text::width;
use crate::error::Result;
use std::path::Path;

/// What a plot shows.
#[derive(Clone, Copy, Debug)]
pub struct OverlayPlot<'a> {
    /// Above the plot.
    pub title: &'a str,
    /// Quantity of both axes, with the unit in parentheses at the end: `"time (s)"`; `(-)` stands for none.
    ///
    /// Here, in the title and in the names of curves a letter that stands alone is a symbol, `^` raises the word that follows, and `_` lowers
    /// it behind a symbol.
    pub axes: [&'a str; 2],
    /// Whether each axis is logarithmic; values that are not positive are then left out.
    pub logarithmic: [bool; 2],
    /// The curves, drawn in the order of their styles.
    pub curves: &'a [Curve<'a>],
}

/// One curve.
#[derive(Clone, Copy, Debug)]
pub struct Curve<'a> {
    /// Name in the legend; curves with the same name and style are named once.
    pub name: &'a str,
    /// How it is drawn.
    pub style: CurveStyle,
    /// Beside its right end or above its highest point, to tell curves of one style apart; may be empty.
    pub label: &'a str,
    /// Its points; one with a number that is not finite interrupts the line.
    pub points: &'a [[f64; 2]],
}

/// How a curve is drawn; those that come first here lie below.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum CurveStyle {
    /// Thick and pale, below all others.
    Pale,
    /// A thin line in one of four other colours.
    Other(u8),
    /// Solid, with dots.
    Solid,
    /// Dashes, with rings.
    Dashed,
}

const PAGE: (f32, f32) = (1600.0, 1000.0);
/// Space left of the frame for the name of the axis, beside the numbers.
const NAME_SPACE: f32 = 100.0;
/// Space right of the frame without labels.
const RIGHT_SPACE: f32 = 70.0;
/// Bottom of the frame.
const BOTTOM: f32 = 870.0;
const TITLE: f32 = 30.0;
const LABEL: f32 = 30.0;
const NUMBER: f32 = 26.0;
const TICK: f32 = 10.0;
/// Height of a line of the legend, and the length of the piece of curve in it.
const LEGEND: (f32, f32) = (44.0, 84.0);
/// Curves with at most so many points have them marked.
const MARKED: usize = 40;
/// Points closer to the last one than this are not drawn (pixels).
const RESOLUTION: f32 = 0.25;

/// The pale colour of the reference.
const PALE: [u8; 3] = [190, 205, 170];

impl CurveStyle {
    fn pencil(self) -> Pencil {
        match self {
            Self::Pale => Pencil::new(PALE, 13.0),
            Self::Solid => Pencil::new(VERMILION, 3.5),
            Self::Dashed => Pencil::new(BLUE, 3.5).dashed(),
            Self::Other(index) => Pencil::new(REFERENCES[usize::from(index) % REFERENCES.len()], 2.5),
        }
    }
}

/// Writes the plot as PNG.
pub fn write_overlay(path: &Path, plot: &OverlayPlot) -> Result<()> {
    figure(plot).write(path, Format::Png)
}

/// Writes the plot as SVG, text as outlines.
pub fn write_overlay_svg(path: &Path, plot: &OverlayPlot) -> Result<()> {
    figure(plot).write(path, Format::Svg)
}

fn figure(plot: &OverlayPlot) -> Figure {
    Figure {
        size: PAGE,
        title: plot.title.to_string(),
        drawing: draw(plot),
    }
}

/// Where the data go on the page.
struct Frame {
    x: Axis,
    y: Axis,
    left: f32,
    right: f32,
    top: f32,
}

impl Frame {
    fn new(plot: &OverlayPlot, legend_lines: usize) -> Self {
        let axis = |i: usize| {
            let points = || plot.curves.iter().flat_map(|curve| curve.points);
            let whole =
                |p: &&[f64; 2]| (0..2).all(|j| p[j].is_finite() && (p[j] > 0.0 || !plot.logarithmic[j]));
            let values: Vec<f64> = points().filter(whole).map(|p| p[i]).collect();
            let marked = plot.curves.iter().any(|curve| curve.points.len() <= MARKED);
            let tight = i == 0 && !marked;
            Axis::new(&values, plot.logarithmic[i], tight)
        };
        let (x, y) = (axis(0), axis(1));
        let labels = plot
            .curves
            .iter()
            .map(|curve| width(&markup::spans(curve.label), NUMBER));
        let widest = labels.fold(0.0, f32::max);
        let numbers = (y.ticks.iter())
            .map(|tick| width(&tick.spans(), NUMBER))
            .fold(0.0, f32::max);
        Self {
            left: NAME_SPACE + numbers,
            right: PAGE.0 - (RIGHT_SPACE + widest).min(0.4 * PAGE.0),
            top: 96.0 + legend_lines as f32 * LEGEND.0,
            x,
            y,
        }
    }

    /// Where a point of the data is on the page, if it is anywhere.
    fn at(&self, [x, y]: [f64; 2]) -> Option<(f32, f32)> {
        let (x, y) = (self.x.part(x)?, self.y.part(y)?);
        Some((
            self.left + x * (self.right - self.left),
            BOTTOM - y * (BOTTOM - self.top),
        ))
    }
}

fn draw(plot: &OverlayPlot) -> Drawing {
    let legend = Legend::new(plot.curves);
    let frame = Frame::new(plot, legend.lines());
    let mut drawing = Drawing::default();
    draw_axes(&mut drawing, &frame, plot);
    let mut curves: Vec<&Curve> = plot.curves.iter().collect();
    curves.sort_by_key(|curve| curve.style);
    for curve in &curves {
        draw_curve(&mut drawing, &frame, curve);
    }
    let Frame { left, right, top, .. } = frame;
    let h = 1.0;
    drawing.polygon(
        vec![
            (left - h, top - h),
            (right + h, top - h),
            (right + h, BOTTOM + h),
            (left - h, BOTTOM + h),
        ],
        Pencil::new(INK, 2.0),
    );
    draw_labels(&mut drawing, &frame, &curves);
    drawing.text(markup::spans(plot.title), TITLE, (left, 56.0), Align::Start, INK);
    legend.draw(&mut drawing, (left, 56.0 + LEGEND.0));
    drawing
}

/// Puts labels beside the right ends of their curves, or above their highest points if the ends are too close to each other.
fn draw_labels(drawing: &mut Drawing, frame: &Frame, curves: &[&Curve]) {
    let labelled: Vec<&Curve> = (curves.iter().copied())
        .filter(|curve| !curve.label.is_empty() && curve.points.iter().any(|&p| frame.at(p).is_some()))
        .collect();
    let extreme = |curve: &Curve, key: fn((f32, f32)) -> f32| {
        let places = curve.points.iter().filter_map(|&point| frame.at(point));
        places.reduce(|a, b| if key(b) > key(a) { b } else { a })
    };
    let ends: Vec<(f32, f32)> = labelled
        .iter()
        .filter_map(|curve| extreme(curve, |p| p.0))
        .collect();
    let mut heights: Vec<f32> = ends.iter().map(|end| end.1).collect();
    heights.sort_by(f32::total_cmp);
    let crowded = heights.windows(2).any(|pair| pair[1] - pair[0] < NUMBER);
    let tops = labelled.iter().filter_map(|curve| extreme(curve, |p| -p.1));
    let places: Vec<(f32, f32)> = if crowded { tops.collect() } else { ends };
    // Curves that lie on each other share a label.
    let mut labels: Vec<((f32, f32), [u8; 3], String)> = Vec::new();
    for (curve, at) in labelled.into_iter().zip(places) {
        let pale = curve.style == CurveStyle::Pale;
        let colour = if pale { GREY } else { curve.style.pencil().colour };
        let near = |other: (f32, f32)| {
            (at.0 - other.0).abs() < 8.0 * NUMBER && (at.1 - other.1).abs() < 1.2 * NUMBER
        };
        match labels.iter_mut().find(|label| near(label.0)) {
            Some((.., text)) => *text = format!("{text}; {}", curve.label),
            None => labels.push((at, colour, curve.label.to_string())),
        }
    }
    for ((x, y), colour, text) in labels {
        let (place, align) = if crowded {
            ((x, y - 18.0), Align::Middle)
        } else {
            ((x + 18.0, y + 0.36 * NUMBER), Align::Start)
        };
        drawing.text(markup::spans(&text), NUMBER, place, align, colour);
    }
}

/// The names of the curves, each beside a piece of its line, above the frame.
struct Legend<'a> {
    /// Style, name, and whether points are marked; line and place in it.
    entries: Vec<(CurveStyle, &'a str, bool, usize, f32)>,
}

impl<'a> Legend<'a> {
    fn new(curves: &[Curve<'a>]) -> Self {
        let mut entries: Vec<(CurveStyle, &str, bool, usize, f32)> = Vec::new();
        let (mut line, mut used) = (0, 0.0);
        for curve in curves {
            let known = entries.iter().any(|e| (e.0, e.1) == (curve.style, curve.name));
            if known || curve.name.is_empty() {
                continue;
            }
            let length = LEGEND.1 + 14.0 + width(&markup::spans(curve.name), NUMBER) + 44.0;
            if used > 0.0 && used + length > 0.82 * PAGE.0 {
                (line, used) = (line + 1, 0.0);
            }
            entries.push((curve.style, curve.name, curve.points.len() <= MARKED, line, used));
            used += length;
        }
        Self { entries }
    }

    fn lines(&self) -> usize {
        self.entries.last().map_or(0, |entry| entry.3 + 1)
    }

    fn draw(&self, drawing: &mut Drawing, (left, top): (f32, f32)) {
        for &(style, name, marked, line, x) in &self.entries {
            let (x, y) = (left + x, top + line as f32 * LEGEND.0);
            let middle = y - 0.36 * NUMBER;
            let ends = vec![(x, middle), (x + LEGEND.1, middle)];
            drawing.polyline(ends, style.pencil());
            if marked {
                mark(drawing, style, (x + 0.5 * LEGEND.1, middle));
            }
            let place = (x + LEGEND.1 + 14.0, y);
            drawing.text(markup::spans(name), NUMBER, place, Align::Start, INK);
        }
    }
}

fn draw_axes(drawing: &mut Drawing, frame: &Frame, plot: &OverlayPlot) {
    let Frame {
        x,
        y,
        left,
        right,
        top,
    } = frame;
    let ink = Pencil::new(INK, 2.0);
    let grid = Pencil::new(GRID, 1.5);
    let length = |tick: &Tick| if tick.is_major() { TICK } else { 0.6 * TICK };
    for tick in &x.ticks {
        let at = left + tick.part * (right - left);
        if tick.is_major() {
            drawing.polyline(vec![(at, *top), (at, BOTTOM)], grid);
        }
        drawing.polyline(vec![(at, BOTTOM + 2.0), (at, BOTTOM + 2.0 + length(tick))], ink);
        drawing.text(tick.spans(), NUMBER, (at, BOTTOM + 42.0), Align::Middle, INK);
    }
    for tick in &y.ticks {
        let at = BOTTOM - tick.part * (BOTTOM - top);
        if tick.is_major() {
            drawing.polyline(vec![(*left, at), (*right, at)], grid);
        }
        drawing.polyline(vec![(left - 2.0, at), (left - 2.0 - length(tick), at)], ink);
        drawing.text(
            tick.spans(),
            NUMBER,
            (left - 20.0, at + 0.36 * NUMBER),
            Align::End,
            INK,
        );
    }
    if let Some(zero) = y.zero() {
        let at = BOTTOM - zero * (BOTTOM - top);
        drawing.polyline(vec![(*left, at), (*right, at)], Pencil::new(GREY, 1.5));
    }
    if let Some(zero) = x.zero() {
        let at = left + zero * (right - left);
        drawing.polyline(vec![(at, *top), (at, BOTTOM)], Pencil::new(GREY, 1.5));
    }
    let below = (0.5 * (left + right), BOTTOM + 96.0);
    drawing.text(
        markup::axis_name(plot.axes[0], x.exponent),
        LABEL,
        below,
        Align::Middle,
        INK,
    );
    let beside = (NAME_SPACE - 52.0, 0.5 * (top + BOTTOM));
    drawing.text_upwards(markup::axis_name(plot.axes[1], y.exponent), LABEL, beside, INK);
}

fn draw_curve(drawing: &mut Drawing, frame: &Frame, curve: &Curve) {
    let pencil = curve.style.pencil();
    let mut run: Vec<(f32, f32)> = Vec::new();
    // A point that is nowhere interrupts the line; the one behind the end ends it.
    for place in curve.points.iter().map(|&point| frame.at(point)).chain([None]) {
        match (place, run.last()) {
            (Some((x, y)), Some(last)) if (x - last.0).abs().max((y - last.1).abs()) < RESOLUTION => {}
            (Some(place), _) => run.push(place),
            (None, _) => drawing.polyline(std::mem::take(&mut run), pencil),
        }
    }
    if curve.points.len() <= MARKED {
        for place in curve.points.iter().filter_map(|&point| frame.at(point)) {
            mark(drawing, curve.style, place);
        }
    }
}

/// Marks a point.
fn mark(drawing: &mut Drawing, style: CurveStyle, at: (f32, f32)) {
    let Pencil { colour, .. } = style.pencil();
    let circle = |radius: f32| -> Vec<(f32, f32)> {
        (0..32)
            .map(|i| {
                let (sine, cosine) = (i as f32 * std::f32::consts::TAU / 32.0).sin_cos();
                (at.0 + radius * cosine, at.1 + radius * sine)
            })
            .collect()
    };
    match style {
        CurveStyle::Pale => {}
        CurveStyle::Solid => drawing.fill(circle(5.5), colour),
        CurveStyle::Dashed => drawing.polygon(circle(11.0), Pencil::new(colour, 3.0)),
        CurveStyle::Other(_) => drawing.fill(circle(4.0), colour),
    }
}

#[cfg(test)]
mod tests;
