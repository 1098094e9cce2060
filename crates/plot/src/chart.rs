//! Charts as in a journal: panels side by side with common axes, measured values with their errors, references as lines.
//!
//! Series are distinguished by the shapes of their markers and the dashes of their lines as well as by colours, so that a print
//! in grey still says which is which. The legend lies above the panels, where no data are. A series of one name looks the same
//! in every panel.

mod layout;
mod looks;
mod panel;

use crate::drawing::{Curve, Drawing, Figure, Readings};
use crate::markup::bare;
use layout::Layout;
use looks::{Legend, Looks};
use serde::{Deserialize, Serialize};

/// Least distance of two points of a long series whose values are given (pixels).
const APART: f32 = 2.0;

/// Contents of a chart. Its serialised form is stable.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Chart {
    /// Heading.
    pub title: String,
    /// Horizontal axis of all panels.
    pub x: Axis,
    /// Vertical axis of all panels.
    pub y: Axis,
    /// Diagrams, from left to right, then down.
    pub panels: Vec<Panel>,
    /// Note below everything; may be empty.
    pub note: String,
}

/// An axis.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Axis {
    /// Quantity, with the unit in parentheses at the end: `"time (s)"`; `(-)` stands for none.
    pub label: String,
    /// Logarithmic axis; values that are not positive are then left out.
    pub log: bool,
}

/// One diagram of a chart.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Panel {
    /// Heading; may be empty.
    pub title: String,
    /// Curves and points.
    pub series: Vec<Series>,
    /// Lines and areas that belong to no series.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub marks: Vec<Mark>,
}

/// Points that belong together.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Series {
    /// Name in the legend; an empty one is not listed.
    pub label: String,
    /// Appearance.
    pub style: Style,
    /// In the order in which a line connects them; one that is not finite interrupts the line.
    pub points: Vec<Point>,
}

/// Appearance of a series, in the order in which they are drawn: open markers let filled ones below them be seen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Style {
    /// Thick and pale, below all others, which should lie on it.
    Reference,
    /// A line.
    Line,
    /// A dashed line.
    Dashed,
    /// Filled markers with error bars, joined by a thin line if they ascend; a plain line if there are many.
    #[default]
    Measured,
    /// Open markers with error bars.
    Points,
    /// Dashes over a measured line that should coincide with it; open markers if there are few points.
    Overlaid,
}

/// A point of a series.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// In the unit of the horizontal axis.
    pub x: f64,
    /// In the unit of the vertical axis.
    pub y: f64,
    /// Half the length of its error bar, in the unit of the vertical axis, if it has one.
    pub error: Option<f64>,
}

/// A line or an area that belongs to no series.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Mark {
    /// A horizontal line, named beside the right edge of a chart of one panel.
    Level {
        /// Name; each of its lines stands on a line of its own.
        label: String,
        /// In the unit of the vertical axis.
        value: f64,
        /// Half the height of a band round it, if it has one.
        error: Option<f64>,
        /// Both ends, in the unit of the horizontal axis; else those of the frame.
        between: Option<[f64; 2]>,
        /// Dashes instead of a solid line.
        dashed: bool,
        /// Red, green and blue.
        colour: [u8; 3],
    },
    /// A dashed vertical line with its name.
    Event {
        /// Name.
        label: String,
        /// In the unit of the horizontal axis.
        at: f64,
    },
    /// An interval of the horizontal axis, lightly tinted.
    Interval([f64; 2]),
}

impl Axis {
    /// The axis with this label.
    pub fn new(label: impl Into<String>, log: bool) -> Self {
        let label = label.into();
        Self { label, log }
    }
}

impl Series {
    /// The series of these points, without errors.
    pub fn new(label: impl Into<String>, style: Style, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let (label, points) = (label.into(), points.into_iter());
        let points = points.map(|(x, y)| Point { x, y, error: None }).collect();
        Self { label, style, points }
    }
}

impl Chart {
    /// The chart of one panel, without a note.
    pub fn new(title: impl Into<String>, x: Axis, y: Axis, series: Vec<Series>) -> Self {
        let (title, note) = (title.into(), String::new());
        let panel = Panel { series, ..Panel::default() };
        Self { title, x, y, panels: vec![panel], note }
    }

    /// Draws the chart.
    pub fn figure(&self) -> Figure {
        let looks = Looks::of(&self.panels);
        let legend = Legend::new(self, &looks);
        let layout = Layout::new(self, &legend);
        let mut drawing = Drawing::default();
        layout.draw_text(&mut drawing, self);
        legend.draw(&mut drawing, layout.legend);
        for index in 0..layout.panels.len() {
            panel::draw(&mut drawing, self, &layout, index, &looks);
        }
        let readings = self.readings(&layout, &looks);
        Figure { size: layout.size, title: bare(&self.title), drawing, readings }
    }

    /// Values at the points that can be told apart by a pointer.
    fn readings(&self, layout: &Layout, looks: &Looks) -> Readings {
        let panels = self.panels.iter().zip(&layout.panels);
        let series = panels.flat_map(|(panel, &area)| panel.series.iter().map(move |series| (series, area)));
        let curves = series.map(|(series, area)| {
            let mut last = f32::NEG_INFINITY;
            let points = series.points.iter().filter_map(|&Point { x, y, error }| {
                let at = layout.at(area, x, y)?;
                let apart = series.points.len() <= looks::MARKED || (at.0 - last).abs() >= APART;
                last = if apart { at.0 } else { last };
                let tenth = |pixels: f32| (10.0 * pixels).round() / 10.0;
                apart.then(|| (tenth(at.0), tenth(at.1), x, y, error))
            });
            let points = points.collect();
            Curve { label: series.label.clone(), colour: looks.find(series).colour, points }
        });
        Readings { axes: [&self.x, &self.y].map(|axis| axis.label.clone()), curves: curves.collect() }
    }
}

#[cfg(test)]
mod tests;
