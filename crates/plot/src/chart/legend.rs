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
    lines: usize,
    column_width: f32,
}

impl Legend {
    pub(super) fn new(chart: &Chart, looks: &Looks) -> Self {
        let space = grid(chart).1 - 2.0 * MARGIN;
        let named = looks.0.iter().filter(|(_, label, _)| !label.is_empty());
        let entries = named.map(|(_, label, look)| {
            // An ellipsis stands where a label was cut.
            let label = match &wrapped(label, SIZE, space - SAMPLE.0 - SAMPLE.1 - SIZE)[..] {
                [line, _, ..] => format!("{line}\u{2026}"),
                _ => label.clone(),
            };
            (*look, label)
        });
        let entries: Vec<(Look, String)> = entries.collect();
        let widest = widest(entries.iter().map(|(_, label)| &**label), SIZE);
        let column_width = SAMPLE.0 + SAMPLE.1 + widest + GAP;
        let columns = ((space + GAP) / column_width).floor().max(1.0) as usize;
        Self { lines: entries.len().div_ceil(columns), entries, column_width }
    }

    pub(super) fn height(&self) -> f32 {
        self.lines as f32 * LINE
    }

    /// Draws it below `top`, column by column.
    pub(super) fn draw(&self, drawing: &mut Drawing, top: f32) {
        for (i, (look, label)) in self.entries.iter().enumerate() {
            let (column, line) = (i / self.lines, i % self.lines);
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
