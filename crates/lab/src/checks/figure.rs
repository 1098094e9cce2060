//! Charts of cases and of studies, with names.

use super::Findings;
use serde::{Deserialize, Serialize};
use turbid_plot::{Axis, Chart, Series, Style};

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Figure {
    /// Short name, good for a file.
    pub name: String,
    #[serde(flatten)]
    pub chart: Chart,
}

impl Figure {
    pub fn logarithmic(&mut self, [x, y]: [bool; 2]) {
        (self.chart.x.log, self.chart.y.log) = (x, y);
    }
}

impl Findings {
    /// Adds a chart with linear axes.
    pub fn plot(
        &mut self,
        name: impl Into<String>,
        title: impl Into<String>,
        axes: [&str; 2],
        series: impl IntoIterator<Item = Series>,
    ) -> &mut Figure {
        let [x, y] = axes.map(|label| Axis::new(label, false));
        let chart = Chart::new(title, x, y, series.into_iter().collect());
        self.figures.push(Figure { name: name.into(), chart });
        self.figures.last_mut().expect("it was added")
    }
}

fn curve(label: impl Into<String>, style: Style, points: impl IntoIterator<Item = [f64; 2]>) -> Series {
    Series::new(label, style, points.into_iter().map(|[x, y]| (x, y)))
}

/// A curve below all others, which should lie on it.
pub fn reference(label: impl Into<String>, points: impl IntoIterator<Item = [f64; 2]>) -> Series {
    curve(label, Style::Reference, points)
}

pub fn measured(label: impl Into<String>, points: impl IntoIterator<Item = [f64; 2]>) -> Series {
    curve(label, Style::Measured, points)
}

/// A measured curve over another one.
pub fn overlaid(label: impl Into<String>, points: impl IntoIterator<Item = [f64; 2]>) -> Series {
    curve(label, Style::Overlaid, points)
}
