//! Comparisons of a study with references: each point one check. What is not done yet is not checked.

use super::Study;
use super::convergence::{Convergence, Sample};
use super::document::{Check, Table};
use super::file::{CheckKind, CheckSection};
use super::points::{At, Known};
use super::record::Quantity;
use super::reference::Expected;
use super::table::{Found, of_convergence};
use crate::case::located::Located;
use crate::error::Result;

/// Standard errors by which an error may seem to grow from one grid to the next.
const NOISE: f64 = 2.0;
/// Resolutions that differ by less are the same.
const SAME: f64 = 1e-9;

/// What a section of checks has found.
#[derive(Default)]
pub(super) struct Verdict {
    pub(super) checks: Vec<Check>,
    pub(super) tables: Vec<Table>,
}

impl Study {
    /// All comparisons that a section asks for.
    ///
    /// # Errors
    /// [`Error::Input`](crate::error::Error::Input) if it lacks a key, or names an axis, a value or a reference that is not there.
    pub(super) fn check(&self, section: &Located<CheckSection>) -> Result<Verdict> {
        match section.value.kind {
            CheckKind::Within => self.within(section),
            CheckKind::Ordered => self.ordered(section),
            CheckKind::Scatter => self.scatter(section),
            CheckKind::Convergence => self.convergence(section),
        }
    }

    fn within(&self, section: &Located<CheckSection>) -> Result<Verdict> {
        let check = &section.value;
        let reference = self.needed(section, check.reference.as_ref(), "reference = { .. }")?;
        let tolerance = match (&check.tolerance, &check.absolute) {
            (Some(part), None) => (part.value, true),
            (None, Some(absolute)) => (absolute.value, false),
            _ => return Err(self.lacks(section, "one of tolerance = 0.1 (a part) and absolute = 0.1")),
        };
        let mut checks = Vec::new();
        for (at, value) in self.values(section)? {
            let label = self.label(section, &at);
            let expected = match self.reference_at(reference, &check.y.value, &at)? {
                Expected::NotMeant => continue,
                Expected::Absent => None,
                Expected::Value(expected) => Some(expected),
            };
            checks.push(match (value, expected) {
                (Some(quantity), Some(expected)) => {
                    let (size, part) = tolerance;
                    let tolerance = if part { size * expected.abs() } else { size };
                    near(label, quantity.value, expected, tolerance, &check.source)
                }
                (None, _) => without_quantity(section, &label),
                (Some(quantity), None) => Check {
                    measured: quantity.value,
                    ..fails(format!("{label}: the reference has no value here"), &check.source)
                },
            });
        }
        Ok(Verdict {
            checks,
            ..Verdict::default()
        })
    }

    fn ordered(&self, section: &Located<CheckSection>) -> Result<Verdict> {
        let check = &section.value;
        let (bound, above) = match (&check.above, &check.below) {
            (Some(above), None) => (above.value, true),
            (None, Some(below)) => (below.value, false),
            _ => return Err(self.lacks(section, "one of above = 0.0 and below = 0.0")),
        };
        let word = if above { "above" } else { "below" };
        let checks = (self.values(section)?.iter())
            .map(|(at, quantity)| match quantity {
                None => without_quantity(section, &self.label(section, at)),
                Some(quantity) => Check {
                    quantity: format!("{} ({word})", self.label(section, at)),
                    measured: quantity.value,
                    reference: bound,
                    tolerance: 0.0,
                    pass: if above {
                        quantity.value > bound
                    } else {
                        quantity.value < bound
                    },
                    source: check.source.clone(),
                },
            })
            .collect();
        Ok(Verdict {
            checks,
            ..Verdict::default()
        })
    }

    /// Every single run against the mean over all, once all are done.
    fn scatter(&self, section: &Located<CheckSection>) -> Result<Verdict> {
        let check = &section.value;
        let part = self
            .needed(section, check.tolerance.as_ref(), "tolerance = 0.05")?
            .value;
        let selection = self.plan.selection(&self.source, &section.span, &check.only)?;
        let runs: Vec<_> = (self.plan.runs.iter().zip(&self.states))
            .filter(|(run, _)| selection.holds(&run.at))
            .collect();
        if runs.len() < 2 {
            let title = "scatter of a single run";
            return Err(self
                .source
                .error(&section.span, title, "here", "it takes two runs or more"));
        }
        let records: Option<Vec<_>> = runs
            .iter()
            .map(|(run, state)| Some((run, state.record()?)))
            .collect();
        let values: Vec<(&str, Option<f64>)> = (records.unwrap_or_default().iter())
            .map(|(run, record)| (run.name.as_str(), record.value(&check.y.value)))
            .collect();
        let mean = values
            .iter()
            .map(|(_, value)| value.unwrap_or(f64::NAN))
            .sum::<f64>()
            / values.len() as f64;
        let label = self.name(section);
        let checks = (values.iter())
            .map(|(run, value)| {
                let label = format!("{label}, {run}");
                match value {
                    None => without_quantity(section, &label),
                    Some(value) => near(label, *value, mean, part * mean.abs(), &check.source),
                }
            })
            .collect();
        Ok(Verdict {
            checks,
            ..Verdict::default()
        })
    }

    fn convergence(&self, section: &Located<CheckSection>) -> Result<Verdict> {
        let check = &section.value;
        let x = self.needed(
            section,
            check.x.as_ref(),
            "x = \"axis of the cells per diameter\"",
        )?;
        let x = self.plan.axis(&self.source, x)?;
        let mut verdict = Verdict::default();
        let mut series: Vec<(At, Option<Vec<Sample>>)> = Vec::new();
        let separate = (check.separate.iter())
            .map(|name| self.plan.axis(&self.source, name))
            .collect::<Result<Vec<_>>>()?;
        for at in self.points_of(&section.span, &check.only, &check.y.value, &separate)? {
            let known = self.known(&check.y.value, &at)?;
            let cells = at[x].and_then(|place| self.plan.axes[x].values[place].number);
            let (Some(cells), false) = (cells, known == Known::Absent) else {
                continue;
            };
            let mut of = at;
            of[x] = None;
            if !series.iter().any(|(known, _)| *known == of) {
                series.push((of.clone(), Some(Vec::new())));
            }
            let Some((_, samples)) = series.iter_mut().find(|(known, _)| *known == of) else {
                continue;
            };
            match (known, samples.as_mut()) {
                (Known::Value(Quantity { value, error }), Some(all)) => {
                    all.push(Sample { cells, value, error });
                }
                _ => *samples = None,
            }
            if known == Known::Unnamed {
                let label = self.label(section, &of);
                verdict.checks.push(without_quantity(section, &label));
            }
        }
        let mut found: Vec<Found> = Vec::new();
        for (at, samples) in series {
            let Some(samples) = samples else {
                continue;
            };
            let label = self.label(section, &at);
            let Some(convergence) = Convergence::of(&samples) else {
                let quantity = format!("{label}: fewer than three grids");
                verdict.checks.push(fails(quantity, &check.source));
                continue;
            };
            if let Some(from) = check.monotone_from {
                verdict
                    .checks
                    .extend(monotone(&convergence, &label, from, &check.source));
            }
            if let (Some(cells), Some(part)) = (check.at, &check.tolerance) {
                let here = |sample: &&Sample| (sample.cells - cells).abs() < SAME;
                let label = format!("{label}, {cells} cells per diameter, against the extrapolation");
                let sample = convergence.samples.iter().find(here);
                verdict.checks.push(match (sample, convergence.limit()) {
                    (Some(sample), Some(limit)) => near(
                        label,
                        sample.value,
                        limit,
                        part.value * limit.abs(),
                        &check.source,
                    ),
                    (Some(sample), None) => Check {
                        measured: sample.value,
                        ..fails(format!("{label}: the order is not resolved"), &check.source)
                    },
                    (None, _) => fails(format!("{label}: there is no such grid"), &check.source),
                });
            }
            found.push(Found {
                title: self.title(&at, |_| true),
                group: self.title(&at, |axis| !separate.contains(&axis)),
                convergence,
            });
        }
        if !found.is_empty() {
            verdict.tables.extend(of_convergence(&self.name(section), &found));
        }
        Ok(verdict)
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
        section
            .value
            .label
            .clone()
            .unwrap_or_else(|| self.words(&section.value.y.value))
    }

    fn label(&self, section: &Located<CheckSection>, at: &At) -> String {
        let title = self.title(at, |_| true);
        let name = self.name(section);
        if title.is_empty() {
            name
        } else {
            format!("{name}, {title}")
        }
    }

    fn needed<'a, T>(&self, section: &Located<CheckSection>, key: Option<&'a T>, how: &str) -> Result<&'a T> {
        key.ok_or_else(|| self.lacks(section, how))
    }

    fn lacks(&self, section: &Located<CheckSection>, how: &str) -> crate::error::Error {
        self.source.error(
            &section.span,
            "this check lacks a key",
            "here",
            &format!("give it {how}"),
        )
    }
}

fn near(quantity: String, measured: f64, reference: f64, tolerance: f64, source: &str) -> Check {
    Check {
        quantity,
        measured,
        reference,
        tolerance,
        // What is no number is near nothing.
        pass: (measured - reference).abs() <= tolerance,
        source: source.to_string(),
    }
}

/// A check that cannot be made, and so is not passed.
fn fails(quantity: String, source: &str) -> Check {
    Check {
        quantity,
        measured: f64::NAN,
        reference: f64::NAN,
        tolerance: 0.0,
        pass: false,
        source: source.to_string(),
    }
}

/// The check of a point whose runs do not have the quantity.
fn without_quantity(section: &Located<CheckSection>, label: &str) -> Check {
    let CheckSection { y, source, .. } = &section.value;
    fails(format!("{label}: the runs have no `{}`", y.value), source)
}

/// The largest rise of the error from one grid to the next, against what its statistical errors explain, if they are known.
fn monotone(convergence: &Convergence, label: &str, from: f64, source: &str) -> Option<Check> {
    let fine: Vec<&Sample> = (convergence.samples.iter())
        .filter(|sample| sample.cells >= from - SAME)
        .collect();
    let quantity = format!(
        "{label}, largest rise of the error from a grid to the next from {from} cells on (part of the extrapolation)"
    );
    let Some(limit) = convergence.limit() else {
        return Some(fails(format!("{quantity}: the order is not resolved"), source));
    };
    let rises = fine.windows(2).map(|pair| {
        let [before, after] = [pair[0], pair[1]].map(|sample| (sample.value / limit - 1.0).abs());
        let errors = pair[0].error.zip(pair[1].error);
        (
            after - before,
            errors.map(|(a, b)| NOISE * a.hypot(b) / limit.abs()),
        )
    });
    let over = |rise: &(f64, Option<f64>)| rise.0 - rise.1.unwrap_or(0.0);
    let (rise, noise) = rises.max_by(|a, b| over(a).total_cmp(&over(b)))?;
    let explained = noise.map_or(String::new(), |_| format!("; tolerance: {NOISE} standard errors"));
    Some(Check {
        quantity: quantity + &explained,
        measured: rise.max(0.0),
        reference: 0.0,
        tolerance: noise.unwrap_or(0.0),
        pass: rise <= noise.unwrap_or(0.0),
        source: source.to_string(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn convergence(values: [f64; 5], error: f64) -> Convergence {
        let samples: Vec<Sample> = ([5.0, 7.0, 9.0, 12.0, 18.0].iter().zip(values))
            .map(|(&cells, value)| Sample {
                cells,
                value,
                error: Some(error),
            })
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
        assert!(
            !verdict.pass && verdict.measured > verdict.tolerance,
            "{verdict:?}"
        );
        let noisy = [1.2, 1.143, 1.111, 1.083, 1.085];
        let verdict = monotone(&convergence(noisy, 3e-3), "u", 7.0, "").unwrap();
        assert!(
            verdict.pass && verdict.measured > 0.0,
            "all of it noise: {verdict:?}"
        );
        assert!(verdict.quantity.contains("2 standard errors"));
    }

    #[test]
    fn a_number_that_is_none_is_near_nothing() {
        assert!(near(String::new(), 1.04, 1.0, 0.05, "").pass);
        assert!(!near(String::new(), 1.06, 1.0, 0.05, "").pass);
        assert!(!near(String::new(), f64::NAN, 1.0, 0.05, "").pass);
    }
}
