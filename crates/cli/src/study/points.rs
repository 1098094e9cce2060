//! Points of a study: quantities at one value of each axis, repetitions averaged, two values of an axis compared.
//!
//! ```text
//! mean of n repetitions    u = sum u_i / n,    e = max( sqrt(sum e_i^2) / n,  s / sqrt(n) )
//! ```
//!
//! with the standard errors `e_i` of the single runs and the standard deviation `s` of the repetitions: the former do not
//! know what a run keeps from its initial state, the latter is uncertain itself where there are few repetitions, so the larger counts.
//! Errors of ratios are propagated to first order.

use super::Study;
use super::file::{Choice, Comparison, DerivedSection};
use super::plan::{PlannedRun, Selection};
use super::record::Quantity;
use std::collections::BTreeMap;
use std::ops::Range;
use turbid::case::located::Located;
use turbid::error::Result;
use turbid::simulation::Suspension;

/// The value of every axis that is not averaged over; none of those that are.
pub(super) type At = Vec<Option<usize>>;

/// What is known of a quantity at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Known {
    /// The study has no such point.
    Absent,
    /// So many of its runs are not done.
    Missing(usize),
    /// The runs do not have the quantity.
    Unnamed,
    /// Its value.
    Value(Quantity),
}

/// A quantity that compares two values of an axis.
struct Derived<'a> {
    section: &'a DerivedSection,
    /// Place of the axis.
    axis: usize,
    of: usize,
    to: usize,
}

impl Study {
    /// What the file says of the comparison of this name, if it is one.
    pub(super) fn comparison(&self, name: &str) -> Option<&Located<DerivedSection>> {
        let mut derived = self.file.derived.iter();
        derived.find(|known| known.value.name.value == name)
    }

    /// The comparison of this name, if it is one.
    fn derived(&self, name: &str) -> Result<Option<Derived<'_>>> {
        let Some(Located { value, span }) = self.comparison(name) else {
            return Ok(None);
        };
        let axis = self.axis(&value.axis)?;
        let one = |choice: &Choice| match self.plan.values(&self.source, span, axis, choice)?[..] {
            [one] => Ok(one),
            _ => self.refuse(span, "more than one value is compared", "here", "name one value"),
        };
        Ok(Some(Derived { axis, of: one(&value.of)?, to: one(&value.to)?, section: value }))
    }

    /// As a quantity stands in figures and tables.
    pub(super) fn words(&self, name: &str) -> String {
        let label = self.comparison(name).and_then(|known| known.value.label.clone());
        label.unwrap_or_else(|| name.replace('_', " "))
    }

    /// A quantity at a point.
    pub(super) fn known(&self, name: &str, at: &At) -> Result<Known> {
        let Some(derived) = self.derived(name)? else {
            return Ok(self.mean(name, at));
        };
        let value = |place: usize| {
            let mut at = at.clone();
            at[derived.axis] = Some(place);
            self.mean(&derived.section.quantity.value, &at)
        };
        Ok(match (value(derived.of), value(derived.to)) {
            (Known::Value(of), Known::Value(to)) => Known::Value(compare(of, to, derived.section.form)),
            (Known::Missing(of), Known::Missing(to)) => Known::Missing(of + to),
            (Known::Missing(count), _) | (_, Known::Missing(count)) => Known::Missing(count),
            (Known::Absent, _) | (_, Known::Absent) => Known::Absent,
            _ => Known::Unnamed,
        })
    }

    /// Mean over the runs of a point.
    fn mean(&self, name: &str, at: &At) -> Known {
        let (mut values, mut missing, mut unnamed) = (Vec::new(), 0, false);
        for (run, _) in self.runs_at(at) {
            match self.states[run].record().map(|record| record.get(name)) {
                None => missing += 1,
                Some(None) => unnamed = true,
                Some(Some(quantity)) => values.push(quantity),
            }
        }
        match values[..] {
            _ if missing > 0 => Known::Missing(missing),
            _ if unnamed => Known::Unnamed,
            [] => Known::Absent,
            _ => Known::Value(average(&values)),
        }
    }

    /// The runs of a point, with their numbers.
    pub(super) fn runs_at<'a>(&'a self, at: &'a At) -> impl Iterator<Item = (usize, &'a PlannedRun)> {
        let runs = self.plan.runs.iter().enumerate();
        runs.filter(move |(_, run)| {
            let mut pairs = at.iter().zip(&run.at);
            pairs.all(|(wanted, place)| wanted.is_none_or(|wanted| wanted == *place))
        })
    }

    /// The suspension of a point, as planned.
    pub(super) fn suspension(&self, at: &At) -> Option<Suspension> {
        let (_, run) = self.runs_at(at).next()?;
        let fluid = run.setup.fluid.as_ref()?;
        Some(Suspension::of(&fluid.scales, run.setup.volume_fraction))
    }

    /// All points with these values, in the order of the axes; repetitions are averaged but on the axes `separate`.
    ///
    /// # Errors
    /// [`Error::Input`](turbid::error::Error::Input) for an axis or a value that is not there.
    pub(super) fn points_of(
        &self,
        span: &Range<usize>,
        only: &BTreeMap<String, Choice>,
        quantity: &str,
        separate: &[usize],
    ) -> Result<Vec<At>> {
        let axes = self.plan.axes.iter().enumerate();
        let free: Vec<usize> = axes
            .filter(|(place, axis)| !axis.average || separate.contains(place))
            .map(|(place, _)| place)
            .collect();
        self.points(span, &free, only, quantity)
    }

    /// All points with these values, in the order of the axes; `free` axes vary, of the others there may be one value only,
    /// unless they hold repetitions, which are averaged.
    ///
    /// # Errors
    /// [`Error::Input`](turbid::error::Error::Input) if an axis that is not free has several values.
    pub(super) fn points(
        &self,
        span: &Range<usize>,
        free: &[usize],
        only: &BTreeMap<String, Choice>,
        quantity: &str,
    ) -> Result<Vec<At>> {
        let derived = self.derived(quantity)?;
        let selection = self.selection(span, only)?;
        let mut all: Vec<At> = vec![Vec::new()];
        for (place, axis) in self.plan.axes.iter().enumerate() {
            let chosen = selection.0.get(&place).cloned();
            let values: Vec<Option<usize>> = if derived.as_ref().is_some_and(|derived| derived.axis == place)
                || axis.average && chosen.is_none() && !free.contains(&place)
            {
                vec![None]
            } else {
                let values = chosen.unwrap_or_else(|| (0..axis.values.len()).collect());
                if values.len() > 1 && !free.contains(&place) {
                    let title = format!("the axis `{}` has several values here", axis.name);
                    let remedy = format!(
                        "choose one, only = {{ {} = .. }}, or let it vary: as x, series, panels or rows",
                        axis.name
                    );
                    return self.refuse(span, &title, "which one?", &remedy);
                }
                values.into_iter().map(Some).collect()
            };
            let with =
                |at: &At| -> Vec<At> { values.iter().map(|value| [&at[..], &[*value]].concat()).collect() };
            all = all.iter().flat_map(with).collect();
        }
        Ok(all)
    }

    /// The values of a point in words, those of axes with one value left out: `Ar 500, spheres`.
    pub(super) fn title(&self, at: &At, of: impl Fn(usize) -> bool) -> String {
        let axes = self.plan.axes.iter().enumerate().zip(at);
        let words: Vec<String> = axes
            .filter(|((place, axis), value)| of(*place) && value.is_some() && axis.values.len() > 1)
            .filter_map(|((_, axis), value)| {
                let value = &axis.values[(*value)?];
                let plain = value.label == value.name && value.number.is_some();
                Some(if plain { format!("{} {}", axis.name, value.name) } else { value.label.clone() })
            })
            .collect();
        words.join(", ")
    }
}

impl Selection {
    /// Whether a point has these values.
    pub(super) fn meets(&self, at: &At) -> bool {
        (self.0.iter()).all(|(&axis, values)| at[axis].is_some_and(|place| values.contains(&place)))
    }
}

/// Mean of repetitions.
pub(super) fn average(values: &[Quantity]) -> Quantity {
    let count = values.len() as f64;
    let mean = values.iter().map(|one| one.value).sum::<f64>() / count;
    let errors: Option<Vec<f64>> = values.iter().map(|one| one.error).collect();
    let inner = errors.map(|errors| errors.iter().map(|e| e * e).sum::<f64>().sqrt() / count);
    let outer = (values.len() > 1).then(|| {
        let squares: f64 = values.iter().map(|one| (one.value - mean).powi(2)).sum();
        (squares / (count - 1.0) / count).sqrt()
    });
    Quantity {
        value: mean,
        error: match (inner, outer) {
            (Some(inner), Some(outer)) => Some(inner.max(outer)),
            (inner, outer) => inner.or(outer),
        },
    }
}

fn compare(of: Quantity, to: Quantity, form: Comparison) -> Quantity {
    let ratio = of.value / to.value;
    let error = match (of.error, to.error) {
        (Some(a), Some(b)) => Some(ratio.abs() * (a / of.value).hypot(b / to.value)),
        _ => None,
    };
    let value = match form {
        Comparison::Ratio => ratio,
        Comparison::Deficit => 1.0 - ratio,
    };
    Quantity { value, error }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn quantity(value: f64, error: f64) -> Quantity {
        Quantity { value, error: Some(error) }
    }

    #[test]
    fn repetitions_that_agree_have_the_error_of_their_runs_and_others_that_of_their_scatter() {
        let alike = average(&[quantity(1.0, 0.1), quantity(1.0, 0.1)]);
        assert!((alike.error.unwrap() - 0.1 / 2_f64.sqrt()).abs() < 1e-12);
        let apart = average(&[quantity(1.0, 0.01), quantity(2.0, 0.01)]);
        assert!((apart.value - 1.5).abs() < 1e-12 && (apart.error.unwrap() - 0.5).abs() < 1e-12);
        let unknown = average(&[Quantity { value: 1.0, error: None }]);
        assert_eq!(unknown.error, None);
    }

    #[test]
    fn a_deficit_is_what_a_ratio_lacks_to_one_with_the_same_error() {
        let (of, to) = (quantity(0.8, 0.03), quantity(1.0, 0.04));
        let (ratio, deficit) = (compare(of, to, Comparison::Ratio), compare(of, to, Comparison::Deficit));
        assert!((ratio.value - 0.8).abs() < 1e-12 && (deficit.value - 0.2).abs() < 1e-12);
        let expected = 0.8 * (0.03_f64 / 0.8).hypot(0.04);
        assert!((ratio.error.unwrap() - expected).abs() < 1e-12 && ratio.error == deficit.error);
    }
}
