//! Curves over each other that own what they show, as suites of checks hand them on.

use super::picture::{Format, write_figure};
use crate::error::Result;
use std::path::Path;
use turbid_plot::{Axis, Chart, Series, Style};

/// Curves over each other, for a chart.
#[derive(Clone, Debug, PartialEq)]
pub struct Overlay {
    /// File stem, unique within the case.
    pub name: String,
    /// Heading.
    pub title: String,
    /// Quantity and unit of both axes.
    pub axes: [String; 2],
    /// Logarithmic axes.
    pub logarithmic: [bool; 2],
    /// Name and points of every curve; the suite decides by the name how each is drawn.
    pub curves: Vec<(String, Vec<[f64; 2]>)>,
}

impl Overlay {
    /// A plot on linear axes.
    pub fn new<N: Into<String>>(
        name: impl Into<String>,
        title: impl Into<String>,
        axes: [&str; 2],
        curves: impl IntoIterator<Item = (N, Vec<[f64; 2]>)>,
    ) -> Self {
        let curves = curves.into_iter().map(|(name, points)| (name.into(), points));
        Self {
            name: name.into(),
            title: title.into(),
            axes: axes.map(str::to_string),
            logarithmic: [false; 2],
            curves: curves.collect(),
        }
    }

    /// The same with these axes logarithmic.
    #[must_use]
    pub fn logarithmic(mut self, logarithmic: [bool; 2]) -> Self {
        self.logarithmic = logarithmic;
        self
    }

    /// Writes the chart as `CASE_NAME.png` and `CASE_NAME.svg`, its curves with the given legends and styles, one for each curve.
    pub fn write(&self, directory: &Path, case: &str, looks: Vec<(String, Style)>) -> Result<()> {
        let series = (looks.into_iter().zip(&self.curves)).map(|((label, style), (_, points))| {
            Series::new(label, style, points.iter().map(|&[x, y]| (x, y)))
        });
        let [x, y] = [0, 1].map(|i: usize| Axis::new(&self.axes[i], self.logarithmic[i]));
        let chart = Chart::new(&self.title, x, y, series.collect());
        let (figure, stem) = (chart.figure(), format!("{case}_{}", self.name));
        for format in [Format::Png, Format::Svg] {
            let file = format!("{stem}.{}", format.extension());
            write_figure(&directory.join(file), &figure, format)?;
        }
        Ok(())
    }
}
