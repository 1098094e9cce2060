//! Comparisons of a study with references: each point one check. What is not done yet is not checked.

use super::Study;
use super::convergence::{Convergence, Sample};
use super::document::Table;
use super::file::{CheckKind, CheckSection};
use super::points::{At, Known};
use super::record::Quantity;
use super::reference::Expected;
use super::table::{Found, of_convergence};
use crate::checks::Check;
use turbid::case::located::Located;
use turbid::error::{Error, Result};

/// Standard errors by which an error may seem to grow from one grid to the next.
const NOISE: f64 = 2.0;
/// Resolutions that differ by less are the same.
const SAME: f64 = 1e-9;

/// What a section of checks has found.
type Verdict = (Vec<Check>, Vec<Table>);

impl Study {
    /// All comparisons that a section asks for.
    ///
    /// # Errors
    /// [`Error::Input`] if it lacks a key, or names an axis, a value or a reference that is not there.
    pub(super) fn check(&self, section: &Located<CheckSection>) -> Result<Verdict> {
        match section.value.kind {
            CheckKind::Within => Ok((self.within(section)?, Vec::new())),
            CheckKind::Ordered => Ok((self.ordered(section)?, Vec::new())),
            CheckKind::Scatter => Ok((self.scatter(section)?, Vec::new())),
            CheckKind::Convergence => self.convergence(section),
        }
    }

    /// Every point against its reference, and how far all of them together lie to one side.
    fn within(&self, section: &Located<CheckSection>) -> Result<Vec<Check>> {
        let check = &section.value;
        let reference = self.needed(section, check.reference.as_ref(), "reference = { .. }")?;
        let (size, relative) = match (&check.tolerance, &check.absolute) {
            (Some(part), None) => (part.value, true),
            (None, Some(absolute)) => (absolute.value, false),
            _ => return Err(self.lacks(section, "one of tolerance = 0.1 (a part) and absolute = 0.1")),
        };
        let mut checks = Vec::new();
        for (at, value) in self.values(section)? {
            let label = self.label(section, &at);
            let expected = self.reference_at(reference, &check.y.value, &at)?;
            checks.push(match (value, expected) {
                (_, Expected::NotMeant) => continue,
                (None, _) => without_quantity(section, &label),
                (Some(quantity), Expected::Value(expected)) => {
                    let tolerance = if relative { size * expected.abs() } else { size };
                    Check::new(label, quantity.value, expected, tolerance, &*check.source)
                }
                (Some(quantity), Expected::Absent) => {
                    let label = format!("{label}: the reference has no value here");
                    Check::new(label, quantity.value, f64::NAN, 0.0, &*check.source)
                }
            });
        }
        checks.extend(Check::bias(&self.name(section), &checks, relative));
        Ok(checks)
    }

    fn ordered(&self, section: &Located<CheckSection>) -> Result<Vec<Check>> {
        let check = &section.value;
        let (bound, above) = match (&check.above, &check.below) {
            (Some(above), None) => (above.value, true),
            (None, Some(below)) => (below.value, false),
            _ => return Err(self.lacks(section, "one of above = 0.0 and below = 0.0")),
        };
        let word = if above { "above" } else { "below" };
        let of = |(at, quantity): &(At, Option<Quantity>)| {
            let label = self.label(section, at);
            let Some(Quantity { value, .. }) = *quantity else {
                return without_quantity(section, &label);
            };
            Check {
                pass: if above { value > bound } else { value < bound },
                ..Check::new(format!("{label} ({word})"), value, bound, 0.0, &*check.source)
            }
        };
        Ok(self.values(section)?.iter().map(of).collect())
    }

    /// Every single run against the mean over all, once all are done.
    fn scatter(&self, section: &Located<CheckSection>) -> Result<Vec<Check>> {
        let check = &section.value;
        let part = self.needed(section, check.tolerance.as_ref(), "tolerance = 0.05")?;
        let selection = self.selection(&section.span, &check.only)?;
        let runs: Vec<_> =
            (self.plan.runs.iter().zip(&self.states)).filter(|(run, _)| selection.holds(&run.at)).collect();
        if runs.len() < 2 {
            let title = "scatter of a single run";
            let remedy = "it takes two runs or more";
            return self.refuse(&section.span, title, "here", remedy);
        }
        let records: Option<Vec<_>> =
            (runs.iter().map(|(run, state)| Some((run, state.record()?)))).collect();
        let values: Vec<_> = (records.unwrap_or_default().iter())
            .map(|(run, record)| (&run.name, record.value(&check.y.value)))
            .collect();
        let sum: f64 = values.iter().map(|(_, value)| value.unwrap_or(f64::NAN)).sum();
        let mean = sum / values.len() as f64;
        let of = |(run, value): &(&String, Option<f64>)| {
            let label = format!("{}, {run}", self.name(section));
            match value {
                None => without_quantity(section, &label),
                Some(value) => Check::new(label, *value, mean, part.value * mean.abs(), &*check.source),
            }
        };
        Ok(values.iter().map(of).collect())
    }

    fn convergence(&self, section: &Located<CheckSection>) -> Result<Verdict> {
        let check = &section.value;
        let how = "x = \"axis of the cells per diameter\"";
        let x = self.plan.axis(&self.source, self.needed(section, check.x.as_ref(), how)?)?;
        let (mut checks, mut series) = (Vec::new(), Vec::<(At, Option<Vec<Sample>>)>::new());
        let separate = self.axes(&check.separate)?;
        for at in self.points_of(&section.span, &check.only, &check.y.value, &separate)? {
            let known = self.known(&check.y.value, &at)?;
            let cells = at[x].and_then(|place| self.plan.axes[x].values[place].number);
            let (Some(cells), false) = (cells, known == Known::Absent) else {
                continue;
            };
            let mut of = at;
            of[x] = None;
            if known == Known::Unnamed {
                checks.push(without_quantity(section, &self.label(section, &of)));
            }
            let place = series.iter().position(|(known, _)| *known == of);
            let place = place.unwrap_or_else(|| {
                series.push((of, Some(Vec::new())));
                series.len() - 1
            });
            match (known, &mut series[place].1) {
                (Known::Value(Quantity { value, error }), Some(all)) => {
                    all.push(Sample { cells, value, error });
                }
                // A series counts when all its runs are done.
                (_, samples) => *samples = None,
            }
        }
        let (mut found, mut points) = (Vec::new(), Vec::new());
        for (at, samples) in series {
            let Some(samples) = samples else {
                continue;
            };
            let label = self.label(section, &at);
            let Some(convergence) = Convergence::of(&samples) else {
                let quantity = format!("{label}: fewer than three grids");
                checks.push(Check::failed(quantity, &*check.source));
                continue;
            };
            if let Some(from) = check.monotone_from {
                checks.extend(monotone(&convergence, &label, from, &check.source));
            }
            if let (Some(cells), Some(part)) = (check.at, &check.tolerance) {
                let here = |sample: &&Sample| (sample.cells - cells).abs() < SAME;
                let value = convergence.samples.iter().find(here).map(|sample| sample.value);
                let limit = convergence.limit();
                let missing = match (value, limit) {
                    (Some(_), Some(_)) => "",
                    (Some(_), None) => ": the order is not resolved",
                    (None, _) => ": there is no such grid",
                };
                let label =
                    format!("{label}, {cells} cells per diameter, against the extrapolation{missing}");
                let (value, limit) = (value.unwrap_or(f64::NAN), limit.unwrap_or(f64::NAN));
                let point = Check::new(label, value, limit, part.value * limit.abs(), &*check.source);
                checks.push(point.clone());
                points.push(point);
            }
            found.push(Found {
                title: self.title(&at, |_| true),
                group: self.title(&at, |axis| !separate.contains(&axis)),
                convergence,
            });
        }
        let label = format!("{}, against the extrapolation", self.name(section));
        checks.extend(Check::bias(&label, &points, true));
        let tables =
            if found.is_empty() { Vec::new() } else { of_convergence(&self.name(section), &found).into() };
        Ok((checks, tables))
    }

    /// The points of a check whose runs are done, without a value where these do not have the quantity.
    fn values(&self, section: &Located<CheckSection>) -> Result<Vec<(At, Option<Quantity>)>> {
        let CheckSection { y, only, .. } = &section.value;
        let mut values = Vec::new();
        for at in self.points_of(&section.span, only, &y.value, &[])? {
            match self.known(&y.value, &at)? {
                Known::Value(quantity) => values.push((at, Some(quantity))),
                Known::Unnamed => values.push((at, None)),
                Known::Missing(_) | Known::Absent => {}
            }
        }
        Ok(values)
    }

    fn name(&self, section: &Located<CheckSection>) -> String {
        section.value.label.clone().unwrap_or_else(|| self.words(&section.value.y.value))
    }

    fn label(&self, section: &Located<CheckSection>, at: &At) -> String {
        let title = self.title(at, |_| true);
        let name = self.name(section);
        if title.is_empty() { name } else { format!("{name}, {title}") }
    }

    fn needed<'a, T>(&self, section: &Located<CheckSection>, key: Option<&'a T>, how: &str) -> Result<&'a T> {
        key.ok_or_else(|| self.lacks(section, how))
    }

    fn lacks(&self, section: &Located<CheckSection>, how: &str) -> Error {
        let remedy = format!("give it {how}");
        (self.source).error(&section.span, "this check lacks a key", "here", &remedy)
    }
}

/// The check of a point whose runs do not have the quantity.
fn without_quantity(section: &Located<CheckSection>, label: &str) -> Check {
    let CheckSection { y, source, .. } = &section.value;
    Check::failed(format!("{label}: the runs have no `{}`", y.value), &**source)
}

/// The largest rise of the error from one grid to the next, against what its statistical errors explain, if they are known.
fn monotone(convergence: &Convergence, label: &str, from: f64, source: &str) -> Option<Check> {
    let fine: Vec<&Sample> =
        (convergence.samples.iter()).filter(|sample| sample.cells >= from - SAME).collect();
    let quantity = format!(
        "{label}, largest rise of the error from a grid to the next from {from} cells on (part of the extrapolation)"
    );
    let Some(limit) = convergence.limit() else {
        let quantity = format!("{quantity}: the order is not resolved");
        return Some(Check::failed(quantity, source));
    };
    let rises = fine.windows(2).map(|pair| {
        let [before, after] = [pair[0], pair[1]].map(|sample| (sample.value / limit - 1.0).abs());
        let errors = pair[0].error.zip(pair[1].error);
        (after - before, errors.map(|(a, b)| NOISE * a.hypot(b) / limit.abs()))
    });
    let over = |rise: &(f64, Option<f64>)| rise.0 - rise.1.unwrap_or(0.0);
    let (rise, noise) = rises.max_by(|a, b| over(a).total_cmp(&over(b)))?;
    let explained = noise.map_or(String::new(), |_| format!("; tolerance: {NOISE} standard errors"));
    let tolerance = noise.unwrap_or(0.0);
    Some(Check::new(quantity + &explained, rise.max(0.0), 0.0, tolerance, source))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn convergence(values: [f64; 5], error: f64) -> Convergence {
        let samples: Vec<Sample> = ([5.0, 7.0, 9.0, 12.0, 18.0].iter().zip(values))
            .map(|(&cells, value)| Sample { cells, value, error: Some(error) })
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
