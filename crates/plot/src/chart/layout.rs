//! Positions on the page.

use super::labels;
use super::legend::Legend;
use super::looks::MARKED;
use super::{Axis, Chart, Mark, Point, Series};
use crate::colour::{GREY, INK};
use crate::drawing::{Align, Area, Drawing, Place};
use crate::markup::{axis_name, spans};
use crate::scale::{Scale, grown};
use crate::text::{Span, width};

/// Space at the edges of the page.
pub(super) const MARGIN: f32 = 36.0;
/// Size of the numbers at the ticks.
pub(super) const NUMBER: f32 = 25.0;
/// Size of the titles of panels.
pub(super) const PANEL_TITLE: f32 = 27.0;
const TITLE: f32 = 32.0;
const LABEL: f32 = 29.0;
const NOTE: f32 = 22.0;
/// Distance of the lines of a name, over its size.
const NAME_STEP: f32 = 1.3;
/// Space between the frames of neighbouring panels.
const BETWEEN: f32 = 58.0;
/// Space below a frame for the numbers, and for the name of the axis below them.
const BELOW: (f32, f32) = (46.0, 56.0);

/// Positions on the page, in pixels.
pub(super) struct Layout {
    pub(super) size: Place,
    /// Top of the legend.
    pub(super) legend: f32,
    /// Frames of the panels.
    pub(super) panels: Vec<Area>,
    pub(super) x: Scale,
    pub(super) y: Scale,
    /// Lines of the name of the vertical axis.
    name: Vec<Vec<Span>>,
    columns: usize,
}

/// Panels beside each other.
fn columns(panels: usize) -> usize {
    match panels {
        0..=3 => panels.max(1),
        4 => 2,
        _ => 3,
    }
}

/// Width of the page, and height of a panel.
pub(super) fn page(chart: &Chart) -> (f32, f32) {
    match columns(chart.panels.len()) {
        1 => (1500.0, 760.0),
        2 => (1800.0, 620.0),
        _ => (2100.0, 540.0),
    }
}

impl Layout {
    pub(super) fn new(chart: &Chart, legend: &Legend) -> Self {
        let count = chart.panels.len().max(1);
        let columns = columns(count);
        let (page, height) = page(chart);
        let y = vertical(chart, height);
        let numbers = y.widest(NUMBER);
        let name = name_lines(&chart.y.label, y.exponent, height);
        let left = MARGIN + (1.0 + NAME_STEP * (name.len() - 1) as f32) * LABEL + 46.0 + numbers;
        let right = MARGIN + 14.0 + labels::margin(chart).min(0.4 * page);
        let between = (columns - 1) as f32 * BETWEEN;
        let panel = (page - left - right - between) / columns as f32;
        let x = horizontal(chart, panel);

        let titles = wrapped(&chart.title, TITLE, page - 2.0 * MARGIN).len() as f32;
        let legend_top = MARGIN + titles * 1.35 * TITLE + 6.0;
        let mut top = legend_top + legend.height() + 14.0;
        let titled = (chart.panels.iter()).any(|panel| !panel.title.is_empty()) || count > 1;
        let above = if titled { 1.75 * PANEL_TITLE } else { 0.0 };
        let mut panels = Vec::new();
        for row in 0..count.div_ceil(columns) {
            top += above;
            for column in 0..columns.min(count - row * columns) {
                let l = left + column as f32 * (panel + BETWEEN);
                panels.push((l, top, l + panel, top + height));
            }
            top += height + BELOW.0 + 18.0;
        }
        let note = wrapped(&chart.note, NOTE, page - 2.0 * MARGIN).len() as f32;
        let bottom = top + BELOW.1 - 18.0 + note * 1.4 * NOTE + MARGIN - 14.0;
        Self {
            // Even, as SVG opens at half of it.
            size: (page, 2.0 * (0.5 * bottom).ceil()),
            legend: legend_top,
            panels,
            x,
            y,
            name,
            columns,
        }
    }

    /// True if the panel has no neighbour on the left.
    pub(super) fn is_leftmost(&self, panel: usize) -> bool {
        panel.is_multiple_of(self.columns)
    }

    /// Draws title, names of the axes, note.
    pub(super) fn draw_words(&self, drawing: &mut Drawing, chart: &Chart) {
        let space = self.size.0 - 2.0 * MARGIN;
        for (i, line) in wrapped(&chart.title, TITLE, space).iter().enumerate() {
            let baseline = MARGIN + (i as f32 + 0.85) * 1.35 * TITLE;
            drawing.text(spans(line), TITLE, (MARGIN, baseline), Align::Start, INK);
        }
        let middle = |a: f32, b: f32| 0.5 * (a + b);
        for (panel, &(l, t, r, b)) in self.panels.iter().enumerate() {
            if self.is_leftmost(panel) {
                for (i, line) in self.name.iter().enumerate() {
                    let at = (MARGIN + (0.8 + NAME_STEP * i as f32) * LABEL, middle(t, b));
                    drawing.text(line.clone(), LABEL, at, Align::Upwards, INK);
                }
            }
            // Below the last panel of every column.
            if panel + self.columns >= self.panels.len() {
                let name = axis_name(&chart.x.label, self.x.exponent);
                let at = (middle(l, r), b + BELOW.0 + 0.8 * BELOW.1);
                drawing.text(name, LABEL, at, Align::Middle, INK);
            }
        }
        let notes = wrapped(&chart.note, NOTE, space);
        for (i, line) in notes.iter().enumerate() {
            let from_below = (notes.len() - i) as f32;
            let baseline = self.size.1 - MARGIN + 10.0 - (from_below - 1.0) * 1.4 * NOTE;
            drawing.text(spans(line), NOTE, (MARGIN, baseline), Align::Start, GREY);
        }
    }

    /// Position of a point in the panel with this frame, if it has one.
    pub(super) fn at(&self, (l, t, r, b): Area, x: f64, y: f64) -> Option<Place> {
        let (x, y) = (self.x.part(x)?, self.y.part(y)?);
        Some((l + x * (r - l), b - y * (b - t)))
    }
}

/// True if a value has a position on an axis.
fn fits(value: f64, axis: &Axis) -> bool {
    value.is_finite() && (value > 0.0 || !axis.log)
}

fn series(chart: &Chart) -> impl Iterator<Item = &Series> {
    chart.panels.iter().flat_map(|panel| &panel.series)
}

/// All points that have a position on the horizontal axis.
fn points(chart: &Chart) -> impl Iterator<Item = &Point> {
    let points = series(chart).flat_map(|series| &series.points);
    points.filter(|point| fits(point.x, &chart.x))
}

fn ends(values: &[f64]) -> (f64, f64) {
    let least = values.iter().copied().fold(f64::INFINITY, f64::min);
    (least, values.iter().copied().fold(f64::NEG_INFINITY, f64::max))
}

fn horizontal(chart: &Chart, pixels: f32) -> Scale {
    let mut values: Vec<f64> = points(chart).map(|point| point.x).collect();
    // Where all are curves they fill the frame.
    let curves = !values.is_empty() && series(chart).all(|series| series.points.len() > MARKED);
    let steps = f64::from(pixels / 105.0).max(2.0);
    let mut scale = if chart.x.log {
        Scale::new(&values, true, curves, steps)
    } else {
        let (least, most) = ends(&values);
        let margin = if curves { 0.0 } else { 0.05 * (most - least) };
        let ends = [grown(least, -margin), grown(most, margin)];
        let ends: &[f64] = if values.is_empty() { &[] } else { &ends };
        Scale::new(ends, false, true, steps)
    };
    // A few whole numbers on a short logarithmic axis, such as resolutions, are better ticks than round ones.
    values.sort_by(f64::total_cmp);
    values.dedup();
    let whole = values.iter().all(|x| x.fract() == 0.0 && (1.0..1e5).contains(x));
    let spread = values.first().zip(values.last()).map_or(1.0, |(a, b)| b / a);
    if chart.x.log && whole && (2..=9).contains(&values.len()) && spread < 100.0 {
        scale.set_ticks(&values);
    }
    scale
}

fn vertical(chart: &Chart, pixels: f32) -> Scale {
    let mut values: Vec<f64> = Vec::new();
    for point in points(chart) {
        let error = point.error.filter(|error| error.is_finite()).unwrap_or(0.0);
        if fits(point.y, &chart.y) {
            values.extend([point.y, point.y - error, point.y + error]);
        }
    }
    for mark in chart.panels.iter().flat_map(|panel| &panel.marks) {
        if let Mark::Level { value, .. } = mark {
            values.push(*value);
        }
    }
    values.retain(|value| fits(*value, &chart.y));
    let (least, most) = ends(&values);
    if !chart.y.log && least > 0.0 && least < 0.4 * most {
        values.push(0.0);
    }
    Scale::new(&values, chart.y.log, false, f64::from(pixels / 75.0))
}

/// Lines of the name of an axis, at least one: words break between lines, the unit stays whole at the end of the last.
pub(super) fn name_lines(label: &str, exponent: i32, space: f32) -> Vec<Vec<Span>> {
    let unit = match label.rfind(" (") {
        Some(at) if label.ends_with(')') => at,
        _ => label.len(),
    };
    let (words, unit) = label.split_at(unit);
    let mut lines = wrapped(words, LABEL, space);
    let last = lines.pop().unwrap_or_default();
    let mut lines: Vec<_> = lines.iter().map(|line| spans(line)).collect();
    let whole = axis_name(&format!("{last}{unit}"), exponent);
    match last.rsplit_once(' ') {
        Some((before, word)) if width(&whole, LABEL) > space => {
            lines.push(spans(before));
            lines.push(axis_name(&format!("{word}{unit}"), exponent));
        }
        _ => lines.push(whole),
    }
    lines
}

/// Lines of a text, broken between words.
pub(super) fn wrapped(text: &str, size: f32, space: f32) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if width(&spans(&format!("{line} {word}")), size) <= space => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_string()),
        }
    }
    lines
}
