//! Positions on the page.

use super::looks::{Legend, MARKED};
use super::panel::label_margin;
use super::{Axis, Chart, Mark};
use crate::colour::{GREY, INK};
use crate::drawing::{Align, Area, Drawing, Position};
use crate::markup::axis_label;
use crate::scale::{Ends, Scale};
use crate::text::wrapped;

/// Space at the edges of the page.
pub(super) const MARGIN: f32 = 36.0;
/// Size of the numbers at the ticks.
pub(super) const NUMBER: f32 = 25.0;
/// Size of the titles of panels.
pub(super) const PANEL_TITLE: f32 = 27.0;
const TITLE: f32 = 32.0;
const LABEL: f32 = 29.0;
const NOTE: f32 = 22.0;
/// Distance of the lines of the title, of the label of an axis, and of the note, over their sizes.
const TITLE_STEP: f32 = 1.35;
const LABEL_STEP: f32 = 1.3;
const NOTE_STEP: f32 = 1.4;
/// Space between the frames of neighbouring panels.
const BETWEEN: f32 = 58.0;
/// Space below a frame for the numbers, and for the label of the axis below them.
const BELOW: (f32, f32) = (46.0, 56.0);

/// Positions on the page, in pixels.
pub(super) struct Layout {
    pub(super) size: Position,
    /// Top of the legend.
    pub(super) legend: f32,
    /// Frames of the panels.
    pub(super) panels: Vec<Area>,
    pub(super) x: Scale,
    pub(super) y: Scale,
    columns: usize,
    title: Vec<String>,
    y_label: Vec<String>,
    note: Vec<String>,
}

/// Panels beside each other, width of the page, and height of a panel.
pub(super) fn grid(chart: &Chart) -> (usize, f32, f32) {
    match chart.panels.len() {
        0 | 1 => (1, 1500.0, 760.0),
        2 | 4 => (2, 1800.0, 620.0),
        _ => (3, 2100.0, 540.0),
    }
}

impl Layout {
    pub(super) fn new(chart: &Chart, legend: &Legend) -> Self {
        let count = chart.panels.len().max(1);
        let (columns, page, height) = grid(chart);
        let space = page - 2.0 * MARGIN;
        let (title, note) = (wrapped(&chart.title, TITLE, space), wrapped(&chart.note, NOTE, space));
        let y = vertical(chart, height);
        let y_label = wrapped(&axis_label(&chart.y.label, y.exponent), LABEL, height);
        let more = y_label.len().saturating_sub(1) as f32;
        let left = MARGIN + (1.0 + LABEL_STEP * more) * LABEL + 46.0 + y.widest(NUMBER);
        let right = MARGIN + 14.0 + label_margin(chart).min(0.4 * page);
        let between = (columns - 1) as f32 * BETWEEN;
        let panel = (page - left - right - between) / columns as f32;

        let legend_top = MARGIN + title.len() as f32 * TITLE_STEP * TITLE + 6.0;
        let mut top = legend_top + legend.height() + 14.0;
        let titled = count > 1 || chart.panels.iter().any(|panel| !panel.title.is_empty());
        let mut panels = Vec::new();
        for row in 0..count.div_ceil(columns) {
            top += if titled { 1.75 * PANEL_TITLE } else { 0.0 };
            for column in 0..columns.min(count - row * columns) {
                let l = left + column as f32 * (panel + BETWEEN);
                panels.push((l, top, l + panel, top + height));
            }
            top += height + BELOW.0 + 18.0;
        }
        let bottom = top + BELOW.1 - 18.0 + note.len() as f32 * NOTE_STEP * NOTE + MARGIN - 14.0;
        // Even, as SVG opens at half of it.
        let size = (page, 2.0 * (0.5 * bottom).ceil());
        Self {
            size,
            legend: legend_top,
            panels,
            x: horizontal(chart, panel),
            y,
            columns,
            title,
            y_label,
            note,
        }
    }

    /// True if the panel has no neighbour on the left.
    pub(super) fn is_leftmost(&self, panel: usize) -> bool {
        panel.is_multiple_of(self.columns)
    }

    /// Draws title, labels of the axes, note.
    pub(super) fn draw_text(&self, drawing: &mut Drawing, chart: &Chart) {
        for (i, line) in self.title.iter().enumerate() {
            let baseline = MARGIN + (i as f32 + 0.85) * TITLE_STEP * TITLE;
            drawing.text(line, TITLE, (MARGIN, baseline), Align::Start, INK);
        }
        let x_label = axis_label(&chart.x.label, self.x.exponent);
        for (panel, &(l, t, r, b)) in self.panels.iter().enumerate() {
            for (i, line) in self.y_label.iter().enumerate().filter(|_| self.is_leftmost(panel)) {
                let at = (MARGIN + (0.8 + LABEL_STEP * i as f32) * LABEL, 0.5 * (t + b));
                drawing.text(line, LABEL, at, Align::Upwards, INK);
            }
            // Below the last panel of every column.
            if panel + self.columns >= self.panels.len() {
                let at = (0.5 * (l + r), b + BELOW.0 + 0.8 * BELOW.1);
                drawing.text(&x_label, LABEL, at, Align::Middle, INK);
            }
        }
        for (i, line) in self.note.iter().rev().enumerate() {
            let baseline = self.size.1 - MARGIN + 10.0 - i as f32 * NOTE_STEP * NOTE;
            drawing.text(line, NOTE, (MARGIN, baseline), Align::Start, GREY);
        }
    }

    /// Position of a point in the panel with this frame, if it has one.
    pub(super) fn at(&self, (l, t, r, b): Area, x: f64, y: f64) -> Option<Position> {
        let (x, y) = (self.x.part(x)?, self.y.part(y)?);
        Some((l + x * (r - l), b - y * (b - t)))
    }
}

/// True if a value has a position on an axis.
fn fits(value: f64, axis: &Axis) -> bool {
    value.is_finite() && (value > 0.0 || !axis.log)
}

fn horizontal(chart: &Chart, pixels: f32) -> Scale {
    let series = || chart.panels.iter().flat_map(|panel| &panel.series);
    let mut values: Vec<f64> = series().flat_map(|series| &series.points).map(|point| point.x).collect();
    values.retain(|x| fits(*x, &chart.x));
    values.sort_by(f64::total_cmp);
    values.dedup();
    // Where all are curves they fill the frame.
    let curves = values.is_empty() || series().all(|series| series.points.len() > MARKED);
    let ends = if curves { Ends::Tight } else { Ends::Margin };
    let mut scale = Scale::new(&values, chart.x.log, ends, f64::from(pixels / 105.0).max(2.0));
    // A few whole numbers on a short logarithmic axis, such as resolutions, are better ticks than round ones.
    let whole = values.iter().all(|x| x.fract() == 0.0 && (1.0..1e5).contains(x));
    if chart.x.log && whole && (2..=9).contains(&values.len()) && values[values.len() - 1] / values[0] < 100.0
    {
        scale.set_ticks(&values);
    }
    scale
}

fn vertical(chart: &Chart, pixels: f32) -> Scale {
    let mut values: Vec<f64> = Vec::new();
    for panel in &chart.panels {
        let points = panel.series.iter().flat_map(|series| &series.points);
        for point in points.filter(|point| fits(point.x, &chart.x) && fits(point.y, &chart.y)) {
            let error = point.error.filter(|error| error.is_finite()).unwrap_or(0.0);
            values.extend([point.y, point.y - error, point.y + error]);
        }
        values.extend(panel.marks.iter().filter_map(|mark| match mark {
            Mark::Level { value, .. } => Some(value),
            _ => None,
        }));
    }
    values.retain(|value| fits(*value, &chart.y));
    let least = values.iter().copied().fold(f64::INFINITY, f64::min);
    let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if !chart.y.log && least > 0.0 && least < 0.4 * most {
        values.push(0.0);
    }
    Scale::new(&values, chart.y.log, Ends::Round, f64::from(pixels / 75.0))
}
