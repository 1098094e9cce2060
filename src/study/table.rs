//! Tables of a study, in words.

use super::Study;
use super::convergence::{Convergence, interval_words, words as order_words};
use super::document::Table;
use super::file::{ColumnSection, Comparison, TableSection};
use super::plan::combinations;
use super::points::{At, Known, average};
use super::record::Quantity;
use crate::case::located::Located;
use crate::error::Result;

/// Digits behind the point if nothing else is said.
const DIGITS: usize = 4;
/// What stands where there is nothing.
const NOTHING: &str = "-";
/// What follows a number that rests on means that have not settled.
const UNSETTLED: &str = " (not settled)";

impl Study {
    /// A table in words.
    ///
    /// # Errors
    /// [`Error::Input`](crate::error::Error::Input) if it names an axis, a value or a reference that is not there.
    pub(super) fn table(&self, section: &Located<TableSection>) -> Result<Table> {
        let TableSection {
            name,
            title,
            rows,
            columns,
        } = &section.value;
        let axes = (rows.iter())
            .map(|name| self.plan.axis(&self.source, name))
            .collect::<Result<Vec<_>>>()?;
        let mut heads: Vec<String> = axes
            .iter()
            .map(|&axis| self.plan.axes[axis].name.clone())
            .collect();
        let mut filled = Vec::new();
        for column in columns {
            let ColumnSection {
                label,
                y,
                only,
                reference,
                ..
            } = &column.value;
            heads.push(label.clone());
            if y.is_some() && reference.is_some() {
                heads.extend([format!("{label}: reference"), "deviation".to_string()]);
            }
            let quantity = y
                .as_ref()
                .map_or("settling_velocity_over_stokes", |y| y.value.as_str());
            filled.push((
                column,
                quantity,
                self.points(&column.span, &axes, only, quantity)?,
            ));
        }
        let mut body = Vec::new();
        for places in combinations(axes.iter().map(|&axis| &self.plan.axes[axis])) {
            let of_row = |at: &At| {
                axes.iter()
                    .zip(&places)
                    .all(|(&axis, place)| at[axis] == Some(*place))
            };
            let mut known = false;
            let mut row: Vec<String> = (axes.iter().zip(&places))
                .map(|(&axis, &place)| self.plan.axes[axis].values[place].name.clone())
                .collect();
            for (column, quantity, points) in &filled {
                let at = points
                    .iter()
                    .find(|at| of_row(at) && self.runs_at(at).next().is_some());
                known |= at.is_some();
                row.extend(self.cells(column, quantity, at)?);
            }
            if known {
                body.push(row);
            }
        }
        Ok(Table {
            name: name.value.clone(),
            title: title.clone(),
            columns: heads,
            rows: body,
        })
    }

    /// What stands in a row below one head, or below three.
    fn cells(&self, column: &Located<ColumnSection>, quantity: &str, at: Option<&At>) -> Result<Vec<String>> {
        let ColumnSection {
            y, reference, digits, ..
        } = &column.value;
        let digits = digits.unwrap_or(DIGITS);
        let known = match at {
            Some(at) => self.known(quantity, at)?,
            None => Known::Absent,
        };
        let measured = match known {
            Known::Value(quantity) => Some(quantity),
            _ => None,
        };
        let expected = match (reference, at) {
            (Some(reference), Some(at)) => self.reference_at(reference, quantity, at)?.value(),
            _ => None,
        };
        let mut cells = Vec::new();
        if y.is_some() {
            let unsettled = at.is_some_and(|at| self.runs_at(at).any(|(run, _)| self.is_unsettled(run)));
            let mark = if unsettled { UNSETTLED } else { "" };
            cells.push(measured.map_or(NOTHING.to_string(), |quantity| words(quantity, digits) + mark));
        }
        if reference.is_some() {
            cells.push(expected.map_or(NOTHING.to_string(), |value| format!("{value:.digits$}")));
        }
        if y.is_some() && reference.is_some() {
            let deviation = measured.zip(expected).map(|(measured, expected)| {
                let off = measured.value - expected;
                if self.is_deficit(quantity) {
                    format!("{off:+.digits$}")
                } else {
                    format!("{:+.1} %", 100.0 * off / expected)
                }
            });
            cells.push(deviation.unwrap_or_else(|| NOTHING.to_string()));
        }
        Ok(cells)
    }

    /// Whether a quantity is a part itself, whose deviations are differences.
    fn is_deficit(&self, quantity: &str) -> bool {
        let mut derived = self.file.derived.iter().map(|derived| &derived.value);
        derived.any(|derived| derived.name.value == quantity && derived.form == Comparison::Deficit)
    }
}

/// The convergence of one series.
pub(super) struct Found {
    /// Its name.
    pub(super) title: String,
    /// The name that it has in common with its repetitions.
    pub(super) group: String,
    /// What is known of it.
    pub(super) convergence: Convergence,
}

/// What is known of the convergence of several series: errors at each resolution, and orders. Of repetitions that have a fit each,
/// means over those on most grids are given, with the standard error of their scatter.
pub(super) fn of_convergence(label: &str, found: &[Found]) -> [Table; 2] {
    let percent =
        |part: Option<f64>| part.map_or(NOTHING.to_string(), |part| format!("{:+.2} %", 100.0 * part));
    let mut errors = Vec::new();
    let mut orders = Vec::new();
    for Found {
        title: of,
        convergence,
        ..
    } in found
    {
        let finest = convergence.samples.last().map(|sample| sample.value);
        for sample in &convergence.samples {
            let quantity = Quantity {
                value: sample.value,
                error: sample.error,
            };
            errors.push(vec![
                of.clone(),
                sample.cells.to_string(),
                words(quantity, DIGITS),
                percent(convergence.error(sample)),
                percent(finest.map(|finest| sample.value / finest - 1.0)),
            ]);
        }
        let number =
            |value: Option<f64>| value.map_or(NOTHING.to_string(), |value| format!("{value:.DIGITS$}"));
        let order = |which: usize| {
            let within = convergence.order_within.map(|within| within[which]);
            within.map_or(NOTHING.to_string(), interval_words)
        };
        let limits = convergence
            .limit_within
            .map(|[low, high]| format!("{low:.DIGITS$} to {high:.DIGITS$}"));
        let [first, second] = convergence.limit_of_order;
        orders.push(vec![
            of.clone(),
            order_words(convergence.fit.order),
            order(0),
            order(1),
            (convergence.against_finest).map_or(NOTHING.to_string(), |order| format!("{order:.2}")),
            number(convergence.limit()),
            limits.unwrap_or_else(|| NOTHING.to_string()),
            number(Some(first)),
            number(Some(second)),
        ]);
    }
    orders.extend(means(found));
    let table = |name: &str, title: String, columns: &[&str], rows| Table {
        name: name.to_string(),
        title,
        columns: columns.iter().map(ToString::to_string).collect(),
        rows,
    };
    [
        table(
            "convergence",
            format!("{label} over the resolution"),
            &[
                "series",
                "cells per diameter",
                "value",
                "error against the extrapolation",
                "error against the finest",
            ],
            errors,
        ),
        table(
            "order",
            format!("{label}: order of convergence and extrapolation u_0 + c N^-p"),
            &[
                "series",
                "order",
                "within (68 %)",
                "within (95 %)",
                "order against the finest",
                "extrapolated",
                "within (68 %)",
                "extrapolated if the order is 1",
                "extrapolated if it is 2",
            ],
            orders,
        ),
    ]
}

/// Rows of the table of orders for means over repetitions.
fn means(found: &[Found]) -> Vec<Vec<String>> {
    let mut rows: Vec<Vec<String>> = Vec::new();
    let mut groups: Vec<&str> = found.iter().map(|one| one.group.as_str()).collect();
    groups.sort_unstable();
    groups.dedup();
    for group in groups {
        let alike = || {
            let of_group = found.iter().filter(|one| one.group == group);
            of_group.map(|one| &one.convergence)
        };
        let most = alike().map(|one| one.samples.len()).max();
        let whole: Vec<&Convergence> = alike().filter(|one| Some(one.samples.len()) == most).collect();
        if whole.len() < 2 {
            continue;
        }
        let mean = |figure: &dyn Fn(&Convergence) -> Option<f64>, digits: usize| {
            let values: Option<Vec<Quantity>> = whole
                .iter()
                .map(|one| {
                    Some(Quantity {
                        value: figure(one)?,
                        error: None,
                    })
                })
                .collect();
            values.map_or(NOTHING.to_string(), |values| words(average(&values), digits))
        };
        let separator = if group.is_empty() { "" } else { ", " };
        rows.push(vec![
            format!("{group}{separator}mean of {}", whole.len()),
            mean(&|one| one.limit().map(|_| one.fit.order), 2),
            NOTHING.to_string(),
            NOTHING.to_string(),
            mean(&|one| one.against_finest, 2),
            mean(&|one| one.limit(), DIGITS),
            NOTHING.to_string(),
            mean(&|one| Some(one.limit_of_order[0]), DIGITS),
            mean(&|one| Some(one.limit_of_order[1]), DIGITS),
        ]);
    }
    rows
}

fn words(quantity: Quantity, digits: usize) -> String {
    let Quantity { value, error } = quantity;
    let error = error.map_or(String::new(), |error| format!(" ± {error:.digits$}"));
    format!("{value:.digits$}{error}")
}
