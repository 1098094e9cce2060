//! Charts as in a journal: panels side by side with common axes, measured values with their errors, references as lines.
//!
//! Series are told apart by the shapes of their markers and the dashes of their lines as well as by colours, so that a print
//! in grey still says which is which. The legend lies above the panels, where no data are. A series of one name looks the same
//! in every panel.

mod layout;
mod legend;
mod looks;
mod panel;

use super::drawing::{Drawing, Figure};
use layout::Layout;
use legend::Legend;
use looks::Looks;

/// What a chart shows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Chart {
    /// Above everything.
    pub title: String,
    /// Horizontal axis of all panels.
    pub x: ChartAxis,
    /// Vertical axis of all panels.
    pub y: ChartAxis,
    /// From left to right, then down.
    pub panels: Vec<ChartPanel>,
    /// Below everything; may be empty.
    pub note: String,
}

/// An axis.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ChartAxis {
    /// Quantity, with the unit in parentheses at the end: `"time (s)"`; `(-)` stands for none.
    ///
    /// Here, in titles and in the legend a letter that stands alone is a symbol, as are the names of Greek letters; `^` raises the
    /// word that follows, and `_` lowers it behind a symbol.
    pub label: String,
    /// Whether it is logarithmic; values that are not positive are then left out.
    pub logarithmic: bool,
}

/// One diagram.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ChartPanel {
    /// Above the diagram; may be empty.
    pub title: String,
    /// What is in it.
    pub series: Vec<ChartSeries>,
}

/// Points that belong together.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ChartSeries {
    /// Name in the legend; an empty one is not listed.
    pub label: String,
    /// How it is drawn.
    pub style: ChartStyle,
    /// In the order in which a line connects them; one that is not finite interrupts the line.
    pub points: Vec<ChartPoint>,
}

/// How a series is drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ChartStyle {
    /// Filled markers with error bars, joined by a thin line if they ascend; a plain line if there are many.
    #[default]
    Measured,
    /// Open markers with error bars.
    Points,
    /// A line.
    Line,
    /// A dashed line.
    Dashed,
}

/// A point of a series.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ChartPoint {
    /// In the unit of the horizontal axis.
    pub x: f64,
    /// In the unit of the vertical axis.
    pub y: f64,
    /// Half the length of its error bar, if it has one.
    pub error: Option<f64>,
}

impl Chart {
    /// Draws it.
    pub fn figure(&self) -> Figure {
        let looks = Looks::of(&self.panels);
        let legend = Legend::new(self, &looks);
        let layout = Layout::new(self, &legend);
        let mut drawing = Drawing::default();
        layout.draw_words(&mut drawing, self);
        legend.draw(&mut drawing, layout.legend);
        for place in 0..layout.panels.len() {
            panel::draw(&mut drawing, self, &layout, place, &looks);
        }
        Figure {
            size: layout.size,
            title: self.title.clone(),
            drawing,
        }
    }
}

#[cfg(test)]
mod tests;
