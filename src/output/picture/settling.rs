//! Settling velocity over time, with its means, the end of its transient, and values of the literature.

use super::{Format, write_figure};
use crate::error::Result;
use crate::output::Estimate;
use std::path::Path;
use turbid_plot::{Axis, Chart, INK, Mark, REFERENCES, Series, Style, VERMILION, literal};

/// Contents of a chart of the settling velocity.
#[derive(Clone, Copy, Debug)]
pub struct SettlingPlot<'a> {
    /// Name of the case, for the title.
    pub case: &'a str,
    /// Time over `D / u_Stokes` (-), ascending.
    pub t_star: &'a [f64],
    /// Settling velocity over `u_Stokes` (-), one for each time.
    pub velocity: &'a [f64],
    /// Interval of `t*` that is averaged over and the result, if there is one.
    pub mean: Option<([f64; 2], Estimate)>,
    /// `t*` at which the transient ends and the result from there, if it does.
    pub settled: Option<(f64, Estimate)>,
    /// Values to compare with, with the names to put beside them.
    pub references: &'a [(&'a str, f64)],
}

/// Writes the chart of a settling velocity over time as PNG.
pub fn write_settling(path: &Path, plot: &SettlingPlot) -> Result<()> {
    write_figure(path, &settling_chart(plot).figure(), Format::Png)
}

/// Settling velocity over time, the mean with its standard error as a band, the end of the transient and the mean from there, and
/// reference lines. Panics unless there is one velocity for each time.
pub fn settling_chart(plot: &SettlingPlot) -> Chart {
    assert_eq!(plot.t_star.len(), plot.velocity.len(), "one velocity for each time");
    let end = plot.t_star.iter().copied().fold(0.0, f64::max);
    let level = |name: &str, estimate: Estimate, between, dashed, colour| Mark::Level {
        label: format!("{name}\n{}", with_error(estimate)),
        value: estimate.mean,
        error: estimate.standard_error,
        between,
        dashed,
        colour,
    };
    let mut marks = Vec::new();
    marks.extend(plot.mean.map(|(between, _)| Mark::Interval(between)));
    for (&(name, mean), colour) in plot.references.iter().zip(REFERENCES.into_iter().cycle()) {
        let exact = Estimate { mean, standard_error: None };
        marks.push(level(name, exact, None, true, colour));
    }
    if let Some((between, estimate)) = plot.mean {
        marks.push(level("mean", estimate, Some(between), false, VERMILION));
    }
    if let Some((at, estimate)) = plot.settled {
        let label = format!("transient ends at t* = {at:.1}");
        marks.push(Mark::Event { label, at });
        marks.push(level("after the transient", estimate, Some([at, end]), true, INK));
    }
    // A name without a value would point nowhere.
    marks.retain(|mark| !matches!(mark, Mark::Level { value, .. } if !value.is_finite()));
    let points = plot.t_star.iter().copied().zip(plot.velocity.iter().copied());
    let mut chart = Chart::new(
        literal(plot.case),
        Axis::new("t* = t u_Stokes / D (-)", false),
        Axis::new("settling velocity  u / u_Stokes (-)", false),
        vec![Series::new("", Style::Measured, points)],
    );
    let banded = |mark: &Mark| matches!(mark, Mark::Level { error: Some(error), .. } if *error > 0.0);
    if marks.iter().any(banded) {
        chart.note = "\u{b1} and bands: standard error of the mean.".to_string();
    }
    chart.panels[0].marks = marks;
    chart
}

/// A mean with its error: two digits of the error, and as many decimals of the mean; three significant digits without one.
fn with_error(estimate: Estimate) -> String {
    let mean = estimate.mean;
    if let Some(error) = estimate.standard_error {
        let decimals = (1.0 - error.log10().floor()).clamp(2.0, 6.0) as usize;
        format!("{mean:.decimals$} \u{b1} {error:.decimals$}")
    } else {
        let decimals = (2.0 - mean.abs().max(1e-6).log10().floor()).clamp(0.0, 8.0) as usize;
        format!("{mean:.decimals$}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_and_references_are_levels_with_their_numbers() {
        let estimate = |mean, standard_error| Estimate { mean, standard_error };
        let chart = settling_chart(&SettlingPlot {
            case: "test",
            t_star: &[0.0, 100.0],
            velocity: &[0.0, 0.2],
            mean: Some(([50.0, 100.0], estimate(0.3, Some(0.02)))),
            settled: Some((20.0, estimate(0.4, None))),
            references: &[("reference", 0.5), ("unknown", f64::NAN)],
        });
        let levels = chart.panels[0].marks.iter().filter_map(|mark| match mark {
            Mark::Level { label, between, .. } => Some((&**label, *between)),
            _ => None,
        });
        let expected = [
            ("reference\n0.500", None),
            ("mean\n0.300 \u{b1} 0.020", Some([50.0, 100.0])),
            ("after the transient\n0.400", Some([20.0, 100.0])),
        ];
        assert_eq!(levels.collect::<Vec<_>>(), expected);
        assert!(chart.note.contains("standard error"), "{}", chart.note);
    }

    #[test]
    fn nothing_to_show_still_makes_a_chart() {
        for velocity in [&[][..], &[f64::NAN], &[0.0]] {
            let chart = settling_chart(&SettlingPlot {
                case: "",
                t_star: &[0.0][..velocity.len()],
                velocity,
                mean: None,
                settled: None,
                references: &[("unknown", f64::NAN)],
            });
            assert!(chart.figure().image().width() > 1000);
        }
    }
}
