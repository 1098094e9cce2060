//! Figures of a study: which points, which references, and what is missing.

use super::Study;
use super::convergence::{Convergence, Sample};
use super::document::{Axis, Chart, Figure, Panel, Point, Series, Style};
use super::file::FigureSection;
use super::points::{At, Known};
use turbid::case::located::Located;
use turbid::error::Result;

/// Points of the line of an extrapolation.
const PARTS: u32 = 60;
/// How far beyond the finest grid it is drawn (-).
const BEYOND: f64 = 1.5;

/// Relative difference up to which two lines look the same.
const ALIKE: f64 = 1e-3;

/// Points that differ only in the place along the horizontal axis.
struct Line {
    label: String,
    quantity: String,
    along: Vec<At>,
    points: Vec<Point>,
}

/// What keeps points out of a figure.
#[derive(Default)]
struct Gaps {
    points: usize,
    runs: usize,
    unnamed: Vec<String>,
}

impl Study {
    /// A figure in numbers.
    ///
    /// # Errors
    /// [`Error::Input`](turbid::error::Error::Input) if it names an axis, a value or a table that is not there.
    pub(super) fn figure(&self, section: &Located<FigureSection>) -> Result<Figure> {
        let Located { value, span } = section;
        let x = self.plan.axis(&self.source, &value.x)?;
        let numbers = self.plan.axes[x].values.iter().all(|value| value.number.is_some());
        if !numbers {
            let title = format!("the axis `{}` has values without a number", value.x.value);
            let remedy = "give each one, e.g. { name = \"a\", value = 1.5, .. }";
            return Err(self.source.error(&value.x.span, &title, "cannot be drawn", remedy));
        }
        let series = (value.series.iter())
            .map(|name| self.plan.axis(&self.source, name))
            .collect::<Result<Vec<_>>>()?;
        let across = (value.panels.as_ref()).map(|name| self.plan.axis(&self.source, name)).transpose()?;
        let places: Vec<Option<usize>> = match across {
            Some(axis) => (0..self.plan.axes[axis].values.len()).map(Some).collect(),
            None => vec![None],
        };
        let free: Vec<usize> = [x].into_iter().chain(series.iter().copied()).chain(across).collect();
        let mut gaps = Gaps::default();
        let mut panels = Vec::new();
        for place in places {
            let mut lines = Vec::new();
            for quantity in &value.y.value.0 {
                let points = self.points(span, &free, &value.only, quantity)?;
                let here = |at: &&At| across.is_none_or(|axis| at[axis].is_none() || at[axis] == place);
                self.lines(quantity, x, points.iter().filter(here), &mut lines, &mut gaps)?;
            }
            if lines.is_empty() {
                continue;
            }
            if value.error {
                lines.iter_mut().for_each(Line::take_errors);
            }
            let several = value.y.value.0.len() > 1;
            for line in &mut lines {
                let title = self.title(&line.along[0], |axis| series.contains(&axis));
                line.label = match (several, title.is_empty()) {
                    (false, true) => "this study".to_string(),
                    (false, false) => title,
                    (true, true) => self.words(&line.quantity),
                    (true, false) => format!("{}, {title}", self.words(&line.quantity)),
                };
            }
            let mut drawn: Vec<Series> = (lines.iter())
                .filter(|line| !line.points.is_empty())
                .map(|line| Series {
                    label: line.label.clone(),
                    style: Style::Measured,
                    points: line.points.clone(),
                })
                .collect();
            drawn.extend(self.references(value, x, &lines)?);
            panels.push(Panel {
                title: across
                    .map_or(String::new(), |axis| self.title(&lines[0].along[0], |place| place == axis)),
                series: drawn,
                ..Panel::default()
            });
        }
        let quantity = &value.y.value.0[0];
        let words = if value.error {
            format!("error of {} (part of the extrapolation)", self.words(quantity))
        } else {
            self.words(quantity)
        };
        let axis =
            |label: &Option<String>, other: String, log| Axis { label: label.clone().unwrap_or(other), log };
        let chart = Chart {
            title: value.title.clone(),
            x: axis(&value.x_label, self.plan.axes[x].label.clone(), value.x_log),
            y: axis(&value.y_label, words, value.y_log),
            panels,
            note: gaps.note(&value.note),
        };
        let name = value.name.value.clone();
        Ok(Figure { name, chart })
    }

    /// Sorts points into lines along the axis `x`.
    fn lines<'a>(
        &self,
        quantity: &str,
        x: usize,
        points: impl Iterator<Item = &'a At>,
        lines: &mut Vec<Line>,
        gaps: &mut Gaps,
    ) -> Result<()> {
        for at in points {
            let known = self.known(quantity, at)?;
            if known == Known::Absent {
                continue;
            }
            let beside =
                |other: &At| other.iter().zip(at).enumerate().all(|(axis, (a, b))| axis == x || a == b);
            let found = lines.iter().position(|line| line.quantity == quantity && beside(&line.along[0]));
            let line = found.unwrap_or_else(|| {
                let (label, quantity) = (String::new(), quantity.to_string());
                lines.push(Line { label, quantity, along: Vec::new(), points: Vec::new() });
                lines.len() - 1
            });
            lines[line].along.push(at.clone());
            match known {
                Known::Value(quantity) => {
                    let number = at[x].and_then(|place| self.plan.axes[x].values[place].number);
                    lines[line].points.extend(number.map(|x| Point {
                        x,
                        y: quantity.value,
                        error: quantity.error,
                    }));
                }
                Known::Missing(runs) => {
                    gaps.points += 1;
                    gaps.runs += runs;
                }
                Known::Unnamed => {
                    gaps.points += 1;
                    if !gaps.unnamed.iter().any(|known| known == quantity) {
                        gaps.unnamed.push(quantity.to_string());
                    }
                }
                Known::Absent => {}
            }
        }
        Ok(())
    }

    /// The references of one panel.
    fn references(&self, section: &FigureSection, x: usize, lines: &[Line]) -> Result<Vec<Series>> {
        let mut all = Vec::new();
        for reference in &section.references {
            let label = reference.value.label.as_deref();
            if reference.value.fit {
                all.extend(lines.iter().filter_map(|line| extrapolation(line, lines.len(), label)));
                continue;
            }
            if let Some(order) = reference.value.order {
                all.extend(power(lines, order, label));
                continue;
            }
            if let Some(band) = reference.value.band {
                all.extend(mean_with_band(lines, band, label.unwrap_or("mean")));
                continue;
            }
            let mut found: Vec<(String, Series)> = Vec::new();
            for line in lines {
                let series = self.reference_along(reference, &line.quantity, x, &line.along)?;
                let Some(series) = series.filter(|series| !series.points.is_empty()) else {
                    continue;
                };
                if !found.iter().any(|(_, known)| alike(&known.points, &series.points)) {
                    found.push((line.label.clone(), series));
                }
            }
            let several = found.len() > 1;
            all.extend(found.into_iter().map(|(of, mut series)| {
                if several {
                    series.label = format!("{}, {of}", series.label);
                }
                series
            }));
        }
        Ok(all)
    }
}

impl Gaps {
    fn note(self, note: &str) -> String {
        let mut parts: Vec<String> = Vec::new();
        if !note.is_empty() {
            parts.push(note.to_string());
        }
        if self.runs > 0 {
            let plural = if self.points == 1 { "point is" } else { "points are" };
            parts
                .push(format!("{} {plural} missing: {} of their runs are not done.", self.points, self.runs));
        }
        for quantity in self.unnamed {
            parts.push(format!("The runs have no `{quantity}`."));
        }
        parts.join(" ")
    }
}

impl Line {
    fn convergence(&self) -> Option<Convergence> {
        let samples: Vec<Sample> = (self.points.iter())
            .map(|point| Sample { cells: point.x, value: point.y, error: point.error })
            .collect();
        Convergence::of(&samples)
    }

    /// Errors against the extrapolation instead of the values; nothing where there is no extrapolation.
    fn take_errors(&mut self) {
        let Some(limit) = self.convergence().and_then(|found| found.limit()) else {
            self.points.clear();
            return;
        };
        for point in &mut self.points {
            point.y = (point.y / limit - 1.0).abs();
            point.error = point.error.map(|error| error / limit.abs());
        }
    }
}

/// Whether two lines would be drawn on each other.
fn alike(a: &[Point], b: &[Point]) -> bool {
    let near = |a: f64, b: f64| (a - b).abs() <= ALIKE * a.abs().max(b.abs());
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| near(a.x, b.x) && near(a.y, b.y))
}

/// A power law through the first point of the first line that has one.
fn power(lines: &[Line], order: f64, label: Option<&str>) -> Option<Series> {
    let points = &lines.iter().find(|line| !line.points.is_empty())?.points;
    let first = points.first()?;
    let y = |x: f64| first.y * (x / first.x).powf(-order);
    Some(Series {
        label: label.map_or_else(|| format!("order {order}"), str::to_string),
        style: Style::Dashed,
        points: (points.iter()).map(|&Point { x, .. }| Point { x, y: y(x), error: None }).collect(),
    })
}

/// The extrapolation to fine grids through the points of a line.
fn extrapolation(line: &Line, lines: usize, label: Option<&str>) -> Option<Series> {
    let found = line.convergence()?;
    found.limit()?;
    let (first, last) = (found.samples.first()?.cells, BEYOND * found.samples.last()?.cells);
    let points = (0..=PARTS).map(|part| {
        let x = first + f64::from(part) / f64::from(PARTS) * (last - first);
        Point { x, y: found.fit.at(x), error: None }
    });
    let label = label.unwrap_or("extrapolation");
    Some(Series {
        label: if lines > 1 { format!("{label}, {}", line.label) } else { label.to_string() },
        style: Style::Line,
        points: points.collect(),
    })
}

/// The mean of all points, and lines so far above and below.
fn mean_with_band(lines: &[Line], band: f64, label: &str) -> Vec<Series> {
    let points = || lines.iter().flat_map(|line| &line.points);
    let count = points().count();
    if count == 0 {
        return Vec::new();
    }
    let mean = points().map(|point| point.y).sum::<f64>() / count as f64;
    let ends = [f64::min, f64::max].map(|pick| points().map(|point| point.x).reduce(pick).unwrap_or(0.0));
    let line = |y: f64, label: String, style| Series {
        label,
        style,
        points: ends.map(|x| Point { x, y, error: None }).to_vec(),
    };
    let percent = 100.0 * band;
    vec![
        line(mean, label.to_string(), Style::Line),
        line(mean * (1.0 + band), format!("{label} + {percent} %"), Style::Dashed),
        line(mean * (1.0 - band), format!("{label} - {percent} %"), Style::Dashed),
    ]
}
