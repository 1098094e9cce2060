//! Curves over each other that own what they show, as suites of checks hand them on.

use super::picture::{Format, write_figure};
use crate::error::Result;
use std::path::Path;
use turbid_plot::{Axis, Chart, Panel, Point, Series, Style};

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
    /// Writes the chart as `CASE_NAME.png` and `CASE_NAME.svg`, its curves with the given legends and styles, one for each curve.
    pub fn write(&self, directory: &Path, case: &str, looks: Vec<(String, Style)>) -> Result<()> {
        let axis = |i: usize| Axis {
            label: self.axes[i].clone(),
            log: self.logarithmic[i],
        };
        let series = (looks.into_iter().zip(&self.curves)).map(|((label, style), (_, points))| {
            let points = points.iter().map(|&[x, y]| Point { x, y, error: None });
            Series {
                label,
                style,
                points: points.collect(),
            }
        });
        let chart = Chart {
            title: self.title.clone(),
            x: axis(0),
            y: axis(1),
            panels: vec![Panel {
                series: series.collect(),
                ..Panel::default()
            }],
            ..Chart::default()
        };
        let (figure, stem) = (chart.figure(), format!("{case}_{}", self.name));
        for format in [Format::Png, Format::Svg] {
            let file = format!("{stem}.{}", format.extension());
            write_figure(&directory.join(file), &figure, format)?;
        }
        Ok(())
    }
}
