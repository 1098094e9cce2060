//! The legend: a grid of names above the panels.

use super::Chart;
use super::layout::{MARGIN, grid};
use super::looks::{Look, Looks, draw_marker};
use crate::colour::INK;
use crate::drawing::{Align, Drawing};
use crate::text::{widest, wrapped};

const SIZE: f32 = 25.0;
/// Height of a line.
const LINE: f32 = 40.0;
/// Length of the piece of curve before a name, and the space behind it.
const SAMPLE: (f32, f32) = (76.0, 14.0);
/// Space between columns.
const GAP: f32 = 44.0;

/// Names beside pieces of their curves.
pub(super) struct Legend {
    entries: Vec<(Look, String)>,
    columns: usize,
    column_width: f32,
}

impl Legend {
    pub(super) fn new(chart: &Chart, looks: &Looks) -> Self {
        let space = grid(chart).1 - 2.0 * MARGIN;
        let mut entries: Vec<(Look, String)> = Vec::new();
        for series in chart.panels.iter().flat_map(|panel| &panel.series) {
            let look = looks.find(series);
            let known = |entry: &(Look, String)| entry.0.style == look.style && entry.1 == series.label;
            if !series.label.is_empty() && !entries.iter().any(known) {
                entries.push((look, series.label.clone()));
            }
        }
        for (_, label) in &mut entries {
            // An ellipsis stands where a label was cut.
            if let [line, _, ..] = &wrapped(label, SIZE, space - SAMPLE.0 - SAMPLE.1 - SIZE)[..] {
                *label = format!("{line}\u{2026}");
            }
        }
        let widest = widest(entries.iter().map(|(_, label)| &**label), SIZE);
        let column_width = SAMPLE.0 + SAMPLE.1 + widest + GAP;
        let most = ((space + GAP) / column_width).floor().max(1.0) as usize;
        // As few columns as need no more lines.
        let lines = entries.len().div_ceil(most).max(1);
        Self { columns: entries.len().div_ceil(lines).max(1), entries, column_width }
    }

    pub(super) fn height(&self) -> f32 {
        self.lines() as f32 * LINE
    }

    fn lines(&self) -> usize {
        self.entries.len().div_ceil(self.columns)
    }

    /// Draws it below `top`, column by column.
    pub(super) fn draw(&self, drawing: &mut Drawing, top: f32) {
        for (i, (look, label)) in self.entries.iter().enumerate() {
            let (column, line) = (i / self.lines(), i % self.lines());
            let x = MARGIN + column as f32 * self.column_width;
            let middle = top + (line as f32 + 0.5) * LINE;
            if let Some(stroke) = look.stroke {
                drawing.line(&[(x, middle), (x + SAMPLE.0, middle)], stroke);
            }
            draw_marker(drawing, *look, (x + 0.5 * SAMPLE.0, middle));
            let at = (x + SAMPLE.0 + SAMPLE.1, middle + 0.36 * SIZE);
            drawing.text(label, SIZE, at, Align::Start, INK);
        }
    }
}
