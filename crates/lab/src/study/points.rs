//! Points of a study: quantities at one value of each axis, repetitions averaged, two values of an axis compared.
//!
//! ```text
//! mean of n repetitions    u = sum u_i / n,    e = max( sqrt(sum e_i^2) / n,  s / sqrt(n) )
//! ```
//!
//! with the standard errors `e_i` of the single runs and the standard deviation `s` of the repetitions: the former miss what a run
//! keeps from its initial state, the latter is uncertain itself for few repetitions. Errors of ratios are propagated to first order.

use super::prelude::*;

/// Relative difference of a volume fraction from the requested one that is worth a note.
const ROUNDED: f64 = 1e-3;

/// Index of a value on every axis; none on those that are averaged over or compared.
pub(super) type At = Vec<Option<usize>>;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Known {
    /// The study has no such point.
    Absent,
    /// This many of its runs are not done.
    Missing(usize),
    /// The runs do not have the quantity.
    Unnamed,
    Value(Quantity),
}

impl Known {
    pub(super) fn value(self) -> Option<Quantity> {
        match self {
            Self::Value(quantity) => Some(quantity),
            _ => None,
        }
    }
}

/// Points that differ only in their value on one axis.
pub(super) struct Line {
    pub(super) quantity: String,
    pub(super) of: At,
    pub(super) along: Vec<At>,
    /// Those that are known, over the number of their value.
    pub(super) points: Vec<Point>,
    /// Points of which runs are not done, and all such runs.
    pub(super) missing: [usize; 2],
    /// Points whose runs do not have the quantity.
    pub(super) unnamed: usize,
}

impl Study {
    /// Definition of the derived quantity of this name, and its axis with the two values.
    pub(super) fn derived(&self, name: &str) -> Option<(&DerivedSection, [usize; 3])> {
        let mut derived = self.file.derived.iter().zip(&self.plan.derived);
        let (section, axis) = derived.find(|(section, _)| section.value.name.value == name)?;
        Some((&section.value, *axis))
    }

    pub(super) fn words(&self, name: &str) -> String {
        let label = self.derived(name).and_then(|(section, _)| section.label.clone());
        label.unwrap_or_else(|| name.replace('_', " "))
    }

    fn known(&self, name: &str, at: &At) -> Known {
        let Some((section, [axis, of, to])) = self.derived(name) else {
            return self.mean(name, at);
        };
        let value = |value: usize| {
            let mut at = at.clone();
            at[axis] = Some(value);
            self.mean(&section.quantity.value, &at)
        };
        match (value(of), value(to)) {
            (Known::Value(of), Known::Value(to)) => Known::Value(compare(of, to, section.form)),
            (Known::Missing(of), Known::Missing(to)) => Known::Missing(of + to),
            (Known::Missing(count), _) | (_, Known::Missing(count)) => Known::Missing(count),
            (Known::Absent, _) | (_, Known::Absent) => Known::Absent,
            _ => Known::Unnamed,
        }
    }

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

    pub(super) fn runs_at<'a>(&'a self, at: &'a At) -> impl Iterator<Item = (usize, &'a PlannedRun)> {
        self.plan.runs.iter().enumerate().filter(move |(_, run)| {
            let mut pairs = at.iter().zip(&run.at);
            pairs.all(|(wanted, value)| wanted.is_none_or(|wanted| wanted == *value))
        })
    }

    pub(super) fn suspension(&self, at: &At) -> Option<Suspension> {
        let (_, run) = self.runs_at(at).next()?;
        let fluid = run.setup.fluid.as_ref()?;
        Some(Suspension::of(&fluid.scales, run.setup.volume_fraction))
    }

    /// Number of a point on an axis: its value; of volume fractions those of the whole particles that its runs have.
    pub(super) fn number(&self, axis: usize, at: &At) -> Option<f64> {
        let value = at[axis]?;
        let axis = &self.plan.axes[axis];
        let number = axis.values[value].number?;
        let run = self.runs_at(at).next().filter(|_| axis.is_fraction);
        Some(run.map_or(number, |(_, run)| {
            number * run.setup.volume_fraction / run.setup.requested_volume_fraction
        }))
    }

    /// Says where whole particles miss the volume fractions of an axis most, if they do.
    pub(super) fn note_on_fractions(&self, axis: usize) -> Option<String> {
        let of_run = |run: &PlannedRun| {
            let [actual, requested] = [run.setup.volume_fraction, run.setup.requested_volume_fraction];
            ((actual / requested - 1.0).abs(), actual, requested)
        };
        let runs = self.plan.runs.iter().filter(|_| self.plan.axes[axis].is_fraction).map(of_run);
        let (_, actual, requested) = runs.filter(|run| run.0 > ROUNDED).max_by(|a, b| a.0.total_cmp(&b.0))?;
        Some(format!(
            "Volume fractions are those of whole particles: {actual:.4} where {requested:.4} was requested."
        ))
    }

    /// Axes that a check has points along: all but those of repetitions, and `separate` ones of these.
    pub(super) fn free_axes(&self, separate: &[usize]) -> Vec<usize> {
        let is_free = |axis: &usize| !self.plan.axes[*axis].average || separate.contains(axis);
        (0..self.plan.axes.len()).filter(is_free).collect()
    }

    /// A quantity at all points of the study that have these values, in the order of the axes; `free` axes vary, of the others there
    /// may be one value only, unless they hold repetitions, which are averaged.
    pub(super) fn points(
        &self,
        span: &Range<usize>,
        free: &[usize],
        only: &Only,
        quantity: &str,
    ) -> Result<Vec<(At, Known)>> {
        let compared = self.derived(quantity).map(|(_, [axis, ..])| axis);
        let selection = self.plan.selection(span, only)?;
        let mut choices = Vec::new();
        for (index, axis) in self.plan.axes.iter().enumerate() {
            let (chosen, is_free) = (selection.0.get(&index), free.contains(&index));
            if compared == Some(index) || axis.average && chosen.is_none() && !is_free {
                choices.push(vec![None]);
                continue;
            }
            let values = chosen.cloned().unwrap_or_else(|| axis.indices());
            if values.len() > 1 && !is_free {
                let name = &axis.name;
                let title = format!("the axis `{name}` has several values here");
                let remedy = format!(
                    "choose one, only = {{ {name} = .. }}; let it vary, as x, series, panels or rows; or, if its values are \
                     repetitions such as seeds, take their mean: `average = true` in its [[axis]]"
                );
                return self.plan.refuse(span, &title, "which one?", &remedy);
            }
            choices.push(values.into_iter().map(Some).collect());
        }
        let known = combinations(choices).into_iter().map(|at| (self.known(quantity, &at), at));
        Ok(known.filter(|(known, _)| *known != Known::Absent).map(|(known, at)| (at, known)).collect())
    }

    /// Sorts points of a quantity into lines along the axis `x`; values of this axis without a number are left out.
    pub(super) fn lines(&self, quantity: &str, x: usize, points: Vec<(At, Known)>) -> Vec<Line> {
        let mut lines: Vec<Line> = Vec::new();
        for (at, known) in points {
            let Some(number) = self.number(x, &at) else {
                continue;
            };
            let mut of = at.clone();
            of[x] = None;
            let index = lines.iter().position(|line| line.of == of).unwrap_or_else(|| {
                let (quantity, along, points) = (quantity.to_string(), Vec::new(), Vec::new());
                lines.push(Line { quantity, of, along, points, missing: [0; 2], unnamed: 0 });
                lines.len() - 1
            });
            let line = &mut lines[index];
            line.along.push(at);
            match known {
                Known::Value(Quantity { value, error }) => {
                    line.points.push(Point { x: number, y: value, error });
                }
                Known::Missing(runs) => line.missing = [line.missing[0] + 1, line.missing[1] + runs],
                Known::Unnamed => line.unnamed += 1,
                Known::Absent => {}
            }
        }
        lines
    }

    /// The values of a point on some axes in words, those of axes with one value left out: `Ar 500, spheres`.
    pub(super) fn title(&self, at: &At, of: impl Fn(usize) -> bool) -> String {
        let axes = self.plan.axes.iter().enumerate().zip(at);
        let words = axes.filter(|((index, axis), _)| of(*index) && axis.values.len() > 1);
        let words = words.filter_map(|((_, axis), value)| {
            let value = &axis.values[(*value)?];
            let plain = value.label == value.name && value.number.is_some();
            Some(if plain { format!("{} {}", axis.name, value.name) } else { value.label.clone() })
        });
        words.collect::<Vec<_>>().join(", ")
    }
}

pub(super) fn average(values: &[Quantity]) -> Quantity {
    let count = values.len() as f64;
    let mean = values.iter().map(|one| one.value).sum::<f64>() / count;
    let errors: Option<Vec<f64>> = values.iter().map(|one| one.error).collect();
    let inner = errors.map(|errors| errors.iter().map(|e| e * e).sum::<f64>().sqrt() / count);
    let outer = (values.len() > 1).then(|| {
        let squares: f64 = values.iter().map(|one| (one.value - mean).powi(2)).sum();
        (squares / (count - 1.0) / count).sqrt()
    });
    let error = inner.zip(outer).map(|(inner, outer)| inner.max(outer)).or(inner).or(outer);
    Quantity { value: mean, error }
}

fn compare(of: Quantity, to: Quantity, form: Comparison) -> Quantity {
    let ratio = of.value / to.value;
    let errors = of.error.zip(to.error);
    let error = errors.map(|(a, b)| ratio.abs() * (a / of.value).hypot(b / to.value));
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
