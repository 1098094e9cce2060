//! Comparisons of a study with references, a check for each point whose runs are done.

use super::prelude::*;
use super::table::{Found, of_convergence};

/// Standard errors by which an error may seem to grow from one grid to the next.
const NOISE: f64 = 2.0;
/// Resolutions that differ by less are the same.
const SAME: f64 = 1e-9;

type Section = Located<CheckSection>;

impl Study {
    pub(super) fn check(&self, section: &Section) -> Result<(Vec<Check>, Vec<Table>)> {
        match section.value.kind {
            CheckKind::Within => Ok((self.within(section)?, Vec::new())),
            CheckKind::Ordered => Ok((self.ordered(section)?, Vec::new())),
            CheckKind::Scatter => Ok((self.scatter(section)?, Vec::new())),
            CheckKind::Convergence => self.convergence(section),
        }
    }

    /// Every point against its reference, and the mean signed deviation.
    fn within(&self, section: &Section) -> Result<Vec<Check>> {
        let check = &section.value;
        let reference = check.reference.as_ref().ok_or_else(|| self.lacks(section, "reference = { .. }"))?;
        let (size, relative) = match (check.tolerance, check.absolute) {
            (Some(part), None) => (part, true),
            (None, Some(absolute)) => (absolute, false),
            _ => return Err(self.lacks(section, "one of tolerance = 0.1 (relative) and absolute = 0.1")),
        };
        let mut checks = Vec::new();
        for (at, label, value) in self.values(section)? {
            checks.extend(self.reference_at(reference, &check.y.value, &at)?.map(|expected| {
                let (label, tolerance) = match (expected.is_nan(), relative) {
                    (true, _) => (label + ": the reference has no value here", 0.0),
                    (false, true) => (label, size * expected.abs()),
                    (false, false) => (label, size),
                };
                Check::new(label, value, expected, tolerance, &*check.source)
            }));
        }
        checks.extend(Check::bias(&self.name(section), &checks, relative));
        Ok(checks)
    }

    fn ordered(&self, section: &Section) -> Result<Vec<Check>> {
        let check = &section.value;
        let (bound, above) = match (check.above, check.below) {
            (Some(above), None) => (above, true),
            (None, Some(below)) => (below, false),
            _ => return Err(self.lacks(section, "one of above = 0.0 and below = 0.0")),
        };
        let word = if above { "above" } else { "below" };
        let of = |(_, label, value): (At, String, f64)| Check {
            pass: if above { value > bound } else { value < bound },
            ..Check::new(format!("{label} ({word})"), value, bound, 0.0, &*check.source)
        };
        Ok(self.values(section)?.into_iter().map(of).collect())
    }

    /// Every single run against the mean over all, once all are done.
    fn scatter(&self, section: &Section) -> Result<Vec<Check>> {
        let check = &section.value;
        let part = check.tolerance.ok_or_else(|| self.lacks(section, "tolerance = 0.05"))?;
        let all: Vec<usize> = (0..self.plan.axes.len()).collect();
        let points = self.points(&section.span, &all, &check.only, &check.y.value)?;
        if points.len() < 2 {
            let title = "scatter of a single run";
            return self.plan.refuse(&section.span, title, "here", "it takes two runs or more");
        }
        if points.iter().any(|(_, known)| matches!(known, Known::Missing(_))) {
            return Ok(Vec::new());
        }
        let values = points.iter().map(|(at, known)| {
            let runs: Vec<&str> = self.runs_at(at).map(|(_, run)| run.name.as_str()).collect();
            labelled(section, format!("{}, {}", self.name(section), runs.join(", ")), *known)
        });
        let values: Vec<(String, f64)> = values.collect();
        let mean = values.iter().map(|(_, value)| value).sum::<f64>() / values.len() as f64;
        let of = |(label, value)| Check::new(label, value, mean, part * mean.abs(), &*check.source);
        Ok(values.into_iter().map(of).collect())
    }

    fn convergence(&self, section: &Section) -> Result<(Vec<Check>, Vec<Table>)> {
        let check = &section.value;
        let (y, source) = (&check.y.value, check.source.as_str());
        let x =
            check.x.as_ref().ok_or_else(|| self.lacks(section, "x = \"axis of the cells per diameter\""))?;
        let (x, separate) = (self.plan.axis(x)?, self.plan.axes_of(&check.separate)?);
        if check.at.is_some() && check.tolerance.is_none() {
            let remedy = "e.g. tolerance = 0.03, relative to the extrapolation";
            return self.plan.refuse(&section.span, "`at` without a `tolerance`", "here", remedy);
        }
        let axis = &self.plan.axes[x];
        let keys = [("at", check.at), ("monotone_from", check.monotone_from)];
        for (key, number) in keys.into_iter().filter_map(|(key, number)| Some((key, number?))) {
            let mut numbers = axis.values.iter().filter_map(|value| value.number);
            if !numbers.any(|known| (known - number).abs() < SAME) {
                let title = format!("`{key}` is {number}, which is no value of the axis `{}`", axis.name);
                return self.plan.refuse(&section.span, &title, "here", &axis.known_values());
            }
        }
        let points = self.points(&section.span, &self.free_axes(&separate), &check.only, y)?;
        let (mut checks, mut found, mut of_extrapolation) = (Vec::new(), Vec::new(), Vec::new());
        for line in self.lines(y, x, points) {
            let label = self.label(section, &line.of);
            if line.unnamed > 0 {
                checks.push(Check::failed(format!("{label}: the runs have no `{y}`"), source));
            }
            if line.unnamed + line.missing[0] > 0 {
                continue;
            }
            let Some(convergence) = Convergence::of(&line.points) else {
                checks.push(Check::failed(format!("{label}: fewer than three grids"), source));
                continue;
            };
            if let Some(from) = check.monotone_from {
                checks.extend(monotone(&convergence, &label, from, source));
            }
            if let (Some(cells), Some(part)) = (check.at, check.tolerance) {
                let value =
                    line.points.iter().find(|point| (point.x - cells).abs() < SAME).map(|point| point.y);
                let limit = convergence.limit();
                let missing = match (value, limit) {
                    (Some(_), Some(_)) => "",
                    (Some(_), None) => ": the order is not resolved",
                    (None, _) => ": there is no such grid",
                };
                let label =
                    format!("{label}, {cells} cells per diameter, against the extrapolation{missing}");
                let (value, limit) = (value.unwrap_or(f64::NAN), limit.unwrap_or(f64::NAN));
                let point = Check::new(label, value, limit, part * limit.abs(), source);
                checks.push(point.clone());
                of_extrapolation.push(point);
            }
            found.push(Found {
                title: self.title(&line.of, |_| true),
                group: self.title(&line.of, |axis| !separate.contains(&axis)),
                convergence,
            });
        }
        let name = self.name(section);
        checks.extend(Check::bias(&format!("{name}, against the extrapolation"), &of_extrapolation, true));
        let tables = if found.is_empty() { Vec::new() } else { of_convergence(&name, &found).into() };
        Ok((checks, tables))
    }

    /// The points of a check whose runs are done, with labels and values.
    fn values(&self, section: &Section) -> Result<Vec<(At, String, f64)>> {
        let CheckSection { y, only, .. } = &section.value;
        let mut points = self.points(&section.span, &self.free_axes(&[]), only, &y.value)?;
        points.retain(|(_, known)| !matches!(known, Known::Missing(_)));
        let values = points.into_iter().map(|(at, known)| {
            let (label, value) = labelled(section, self.label(section, &at), known);
            (at, label, value)
        });
        Ok(values.collect())
    }

    fn name(&self, section: &Section) -> String {
        section.value.label.clone().unwrap_or_else(|| self.words(&section.value.y.value))
    }

    fn label(&self, section: &Section, at: &At) -> String {
        let (name, title) = (self.name(section), self.title(at, |_| true));
        if title.is_empty() { name } else { format!("{name}, {title}") }
    }

    fn lacks(&self, section: &Section, how: &str) -> Error {
        let remedy = format!("give it {how}");
        self.plan.source.error(&section.span, "this check lacks a key", "here", &remedy)
    }
}

/// A value with its label; NaN where the runs do not have the quantity, which the label then says.
fn labelled(section: &Section, label: String, known: Known) -> (String, f64) {
    match known.value() {
        Some(quantity) => (label, quantity.value),
        None => (format!("{label}: the runs have no `{}`", section.value.y.value), f64::NAN),
    }
}

/// The largest rise of the error from one grid to the next, relative to the extrapolation, against the statistical errors, if
/// they are known.
fn monotone(convergence: &Convergence, label: &str, from: f64, source: &str) -> Option<Check> {
    let quantity = format!(
        "{label}, largest rise of the error from a grid to the next from {from} cells on (part of the extrapolation)"
    );
    let Some(limit) = convergence.limit() else {
        return Some(Check::failed(format!("{quantity}: the order is not resolved"), source));
    };
    let fine = convergence.samples.iter().filter(|sample| sample.x >= from - SAME);
    let fine: Vec<&Point> = fine.collect();
    let rises = fine.windows(2).map(|pair| {
        let [before, after] = [pair[0], pair[1]].map(|sample| (sample.y / limit - 1.0).abs());
        let errors = pair[0].error.zip(pair[1].error);
        (after - before, errors.map(|(a, b)| NOISE * a.hypot(b) / limit.abs()))
    });
    let over = |rise: &(f64, Option<f64>)| rise.0 - rise.1.unwrap_or(0.0);
    let (rise, noise) = rises.max_by(|a, b| over(a).total_cmp(&over(b)))?;
    let explained = noise.map_or(String::new(), |_| format!("; tolerance: {NOISE} standard errors"));
    Some(Check::new(quantity + &explained, rise.max(0.0), 0.0, noise.unwrap_or(0.0), source))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn convergence(values: [f64; 5], error: f64) -> Convergence {
        let samples: Vec<Point> = ([5.0, 7.0, 9.0, 12.0, 18.0].iter().zip(values))
            .map(|(&x, y)| Point { x, y, error: Some(error) })
            .collect();
        Convergence::of(&samples).unwrap()
    }

    #[test]
    fn an_error_that_falls_passes_and_one_that_rises_beyond_its_noise_fails() {
        let falls = [1.2, 1.143, 1.111, 1.083, 1.056];
        let verdict = monotone(&convergence(falls, 1e-3), "u", 7.0, "").unwrap();
        assert!(verdict.pass && verdict.measured == 0.0);
        let rises = [1.2, 1.143, 1.02, 1.11, 1.056];
        let verdict = monotone(&convergence(rises, 1e-3), "u", 7.0, "").unwrap();
        assert!(!verdict.pass && verdict.measured > verdict.tolerance, "{verdict:?}");
        let noisy = [1.2, 1.143, 1.111, 1.083, 1.085];
        let verdict = monotone(&convergence(noisy, 3e-3), "u", 7.0, "").unwrap();
        assert!(verdict.pass && verdict.measured > 0.0, "all of it noise: {verdict:?}");
        assert!(verdict.quantity.contains("2 standard errors"));
    }
}
