//! Figures of a study: points, references, and a note on what is missing.

use super::hindrance::Hindrance;
use super::points::Line;
use super::prelude::*;
use turbid_plot::{Axis, Chart, Panel};

/// Points of the line of an extrapolation.
const PARTS: u32 = 60;
/// Its end over the resolution of the finest grid (-).
const BEYOND: f64 = 1.5;

const BARS: &str =
    "Bars: one standard error, of the mean over time, or of repetitions by their scatter where that is more.";

/// Relative difference up to which two lines look the same.
const ALIKE: f64 = 1e-3;

impl Study {
    pub(super) fn figure(&self, section: &Located<FigureSection>) -> Result<Figure> {
        let Located { value, span } = section;
        let x = self.plan.axis(&value.x)?;
        if self.plan.axes[x].values.iter().any(|value| value.number.is_none()) {
            let title = format!("the axis `{}` has values without a number", value.x.value);
            let remedy = "give each one, e.g. { name = \"a\", value = 1.5, .. }";
            return self.plan.refuse(&value.x.span, &title, "cannot be drawn", remedy);
        }
        let series = self.plan.axes_of(&value.series)?;
        let across = value.panels.as_ref().map(|name| self.plan.axis(name)).transpose()?;
        let free: Vec<usize> = [x].into_iter().chain(series.iter().copied()).chain(across).collect();
        let mut lines = Vec::new();
        for quantity in &value.y.value.0 {
            lines.extend(self.lines(quantity, x, self.points(span, &free, &value.only, quantity)?));
        }
        let mut note = note(&value.note, &lines);
        if let Some(rounded) = self.note_on_fractions(x) {
            note = if note.is_empty() { rounded } else { format!("{note} {rounded}") };
        }
        if value.error {
            lines.iter_mut().for_each(take_errors);
        }
        let label = |line: &Line| {
            let title = self.title(&line.of, |axis| series.contains(&axis));
            match (value.y.value.0.len() > 1, title.is_empty()) {
                (false, true) => "this study".to_string(),
                (false, false) => title,
                (true, true) => self.words(&line.quantity),
                (true, false) => format!("{}, {title}", self.words(&line.quantity)),
            }
        };
        let lines: Vec<(String, Line)> = lines.into_iter().map(|line| (label(&line), line)).collect();
        let mut panels = Vec::new();
        for column in across.map_or(0..1, |axis| 0..self.plan.axes[axis].values.len()) {
            let is_here =
                |line: &Line| across.and_then(|axis| line.of[axis]).is_none_or(|value| value == column);
            let here: Vec<&(String, Line)> = lines.iter().filter(|(_, line)| is_here(line)).collect();
            let Some((_, first)) = here.first() else {
                continue;
            };
            let drawn = here.iter().filter(|(_, line)| !line.points.is_empty());
            let mut drawn: Vec<Series> = (drawn.map(|(label, line)| Series {
                label: label.clone(),
                style: Style::Measured,
                points: line.points.clone(),
            }))
            .collect();
            for reference in &value.references {
                drawn.extend(self.reference_series(reference, x, &here)?);
            }
            let title = self.title(&first.of, |axis| across == Some(axis));
            panels.push(Panel { title, series: drawn, ..Panel::default() });
        }
        let words = self.words(&value.y.value.0[0]);
        let words = if value.error { format!("error of {words} (part of the extrapolation)") } else { words };
        let chart = Chart {
            title: value.title.clone(),
            x: Axis::new(&self.plan.axes[x].label, value.x_log),
            y: Axis::new(value.y_label.clone().unwrap_or(words), value.y_log),
            panels,
            note,
        };
        Ok(Figure { name: value.name.value.clone(), chart })
    }

    /// A reference in one panel, for its lines with their labels.
    fn reference_series(
        &self,
        reference: &Located<ReferenceSection>,
        x: usize,
        lines: &[&(String, Line)],
    ) -> Result<Vec<Series>> {
        let label = reference.value.label.as_deref();
        if reference.value.fit {
            let fitted = if self.plan.axes[x].is_fraction { hindrance } else { extrapolation };
            return Ok(lines.iter().filter_map(|line| fitted(line, lines.len(), label)).collect());
        }
        if let Some(order) = reference.value.order {
            return Ok(power_law(lines, order, label).into_iter().collect());
        }
        if let Some(band) = reference.value.band {
            return Ok(mean_with_band(lines, band, label.unwrap_or("mean")));
        }
        let mut found: Vec<(&str, Series)> = Vec::new();
        for (of, line) in lines {
            let series = self.reference_along(reference, &line.quantity, Some(x), &line.along)?;
            let is_known = |series: &Series| found.iter().any(|(_, known)| alike(known, series));
            let new = series.filter(|series| !series.points.is_empty() && !is_known(series));
            found.extend(new.map(|series| (of.as_str(), series)));
        }
        if found.len() > 1 {
            for (of, series) in &mut found {
                series.label = format!("{}, {of}", series.label);
            }
        }
        Ok(found.into_iter().map(|(_, series)| series).collect())
    }
}

/// The note of a figure, with the points that it lacks.
fn note(note: &str, lines: &[Line]) -> String {
    let mut parts: Vec<String> = Vec::new();
    if !note.is_empty() {
        parts.push(note.to_string());
    }
    if lines.iter().flat_map(|line| &line.points).any(|point| point.error.is_some_and(|error| error > 0.0)) {
        parts.push(BARS.to_string());
    }
    let [points, runs] = [0, 1].map(|k| lines.iter().map(|line| line.missing[k]).sum::<usize>());
    if runs > 0 {
        let are = if points == 1 { "point is" } else { "points are" };
        parts.push(format!("{points} {are} missing: {runs} of their runs are not done."));
    }
    for line in lines.iter().filter(|line| line.unnamed > 0) {
        let words = format!("The runs have no `{}`.", line.quantity);
        if !parts.contains(&words) {
            parts.push(words);
        }
    }
    parts.join(" ")
}

/// Replaces values by their errors against the extrapolation; there are none without an extrapolation.
fn take_errors(line: &mut Line) {
    let Some(limit) = Convergence::of(&line.points).and_then(|found| found.limit()) else {
        line.points.clear();
        return;
    };
    for point in &mut line.points {
        point.y = (point.y / limit - 1.0).abs();
        point.error = point.error.map(|error| error / limit.abs());
    }
}

/// Returns whether two series would be drawn on each other.
fn alike(a: &Series, b: &Series) -> bool {
    let near = |a: f64, b: f64| (a - b).abs() <= ALIKE * a.abs().max(b.abs());
    let mut pairs = a.points.iter().zip(&b.points);
    a.points.len() == b.points.len() && pairs.all(|(a, b)| near(a.x, b.x) && near(a.y, b.y))
}

/// A power law through the first point of the first line that has one.
fn power_law(lines: &[&(String, Line)], order: f64, label: Option<&str>) -> Option<Series> {
    let points = lines.iter().map(|(_, line)| &line.points).find(|points| !points.is_empty())?;
    let first = points[0];
    let label = label.map_or_else(|| format!("order {order}"), str::to_string);
    let points = points.iter().map(|point| (point.x, first.y * (point.x / first.x).powf(-order)));
    Some(Series::new(label, Style::Dashed, points))
}

/// The extrapolation to fine grids through the points of a line.
fn extrapolation((of, line): &(String, Line), lines: usize, label: Option<&str>) -> Option<Series> {
    let found = Convergence::of(&line.points)?;
    found.limit()?;
    let (first, last) = (found.samples.first()?.x, BEYOND * found.samples.last()?.x);
    let points = (0..=PARTS).map(|part| {
        let x = first + f64::from(part) / f64::from(PARTS) * (last - first);
        (x, found.fit.at(x))
    });
    let label = label.unwrap_or("extrapolation");
    let label = if lines > 1 { format!("{label}, {of}") } else { label.to_string() };
    Some(Series::new(label, Style::Line, points))
}

/// The law of hindered settling through the points of a line, with the interval of its exponent at 95 %.
fn hindrance((of, line): &(String, Line), lines: usize, label: Option<&str>) -> Option<Series> {
    let found = Hindrance::of(&line.points)?;
    let ends = [f64::min, f64::max].map(|pick| line.points.iter().map(|at| at.x).reduce(pick));
    let (first, last) = (ends[0]?, ends[1]?);
    let points = (0..=PARTS).map(|part| {
        let x = first + f64::from(part) / f64::from(PARTS) * (last - first);
        (x, found.at(x))
    });
    let Hindrance { prefactor, exponent, confidence } = found;
    let law = format!("{prefactor:.2} (1 - phi)^n, n = {exponent:.2} +- {confidence:.2} (95 %)");
    let label = label.map_or(law.clone(), |label| format!("{label}: {law}"));
    let label = if lines > 1 { format!("{label}, {of}") } else { label };
    Some(Series::new(label, Style::Line, points))
}

/// The mean of all points, and lines above and below it at the relative distance `band`.
fn mean_with_band(lines: &[&(String, Line)], band: f64, label: &str) -> Vec<Series> {
    let points: Vec<Point> = lines.iter().flat_map(|(_, line)| line.points.clone()).collect();
    if points.is_empty() {
        return Vec::new();
    }
    let mean = points.iter().map(|point| point.y).sum::<f64>() / points.len() as f64;
    let ends =
        [f64::min, f64::max].map(|pick| points.iter().map(|point| point.x).reduce(pick).unwrap_or(0.0));
    let line = |y: f64, label: String, style| Series::new(label, style, ends.map(|x| (x, y)));
    let percent = 100.0 * band;
    vec![
        line(mean, label.to_string(), Style::Line),
        line(mean * (1.0 + band), format!("{label} + {percent} %"), Style::Dashed),
        line(mean * (1.0 - band), format!("{label} - {percent} %"), Style::Dashed),
    ]
}
