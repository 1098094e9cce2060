//! Curves over each other that own what they show, as suites of checks hand them on.

use super::picture::{Curve, OverlayPlot, write_overlay, write_overlay_svg};
use crate::error::Result;
use std::path::Path;

/// Curves over each other, for a plot.
#[derive(Clone, Debug, PartialEq)]
pub struct Overlay {
    /// File stem, unique within the case.
    pub name: String,
    /// Above the plot.
    pub title: String,
    /// Quantity and unit of both axes.
    pub axes: [String; 2],
    /// Whether each axis is logarithmic.
    pub logarithmic: [bool; 2],
    /// Name and points of every curve; how each is drawn, the suite decides by its name.
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

    /// Writes the plot as `CASE_NAME.png` and `CASE_NAME.svg`, with its curves drawn as given.
    pub fn write(&self, directory: &Path, case: &str, curves: &[Curve]) -> Result<()> {
        let stem = format!("{case}_{}", self.name);
        let plot = OverlayPlot {
            title: &self.title,
            axes: [&self.axes[0], &self.axes[1]],
            logarithmic: self.logarithmic,
            curves,
        };
        write_overlay(&directory.join(format!("{stem}.png")), &plot)?;
        write_overlay_svg(&directory.join(format!("{stem}.svg")), &plot)
    }
}
