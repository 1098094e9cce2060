//! Tables of a study, in words.

use super::Study;
use super::convergence::{Convergence, Sample, interval_words, words as order_words};
use super::document::Table;
use super::file::{ColumnSection, Comparison, TableSection};
use super::plan::combinations;
use super::points::{At, Known, average};
use super::record::Quantity;
use std::collections::BTreeSet;
use turbid::case::located::Located;
use turbid::error::Result;

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
    /// [`Error::Input`](turbid::error::Error::Input) if it names an axis, a value or a reference that is not there.
    pub(super) fn table(&self, section: &Located<TableSection>) -> Result<Table> {
        let TableSection { name, title, rows, columns } = &section.value;
        let axes = self.axes(rows)?;
        let mut heads: Vec<String> = axes.iter().map(|&axis| self.plan.axes[axis].name.clone()).collect();
        let mut filled = Vec::new();
        for column in columns {
            let ColumnSection { label, y, only, reference, .. } = &column.value;
            heads.push(label.clone());
            if reference.is_some() {
                heads.extend([format!("{label}: reference"), "deviation".to_string()]);
            }
            filled.push((column, self.points(&column.span, &axes, only, &y.value)?));
        }
        let mut body = Vec::new();
        for places in combinations(axes.iter().map(|&axis| &self.plan.axes[axis])) {
            let of_row = |at: &&At| axes.iter().zip(&places).all(|(&axis, place)| at[axis] == Some(*place));
            let mut known = false;
            let mut row: Vec<String> = (axes.iter().zip(&places))
                .map(|(&axis, &place)| self.plan.axes[axis].values[place].name.clone())
                .collect();
            for (column, points) in &filled {
                let at = (points.iter().filter(of_row)).find(|at| self.runs_at(at).next().is_some());
                known |= at.is_some();
                row.extend(self.cells(&column.value, at)?);
            }
            if known {
                body.push(row);
            }
        }
        Ok(Table { name: name.value.clone(), title: title.clone(), columns: heads, rows: body })
    }

    /// What stands in a row below one head, or below three.
    fn cells(&self, column: &ColumnSection, at: Option<&At>) -> Result<Vec<String>> {
        let (y, digits) = (&column.y.value, column.digits.unwrap_or(DIGITS));
        let or_nothing = |text: Option<String>| text.unwrap_or_else(|| NOTHING.to_string());
        let (mut measured, mut expected, mut mark) = (None, None, "");
        if let Some(at) = at {
            if let Known::Value(quantity) = self.known(y, at)? {
                measured = Some(quantity);
            }
            if let Some(reference) = &column.reference {
                expected = self.reference_at(reference, y, at)?.value();
            }
            if self.runs_at(at).any(|(run, _)| self.is_unsettled(run)) {
                mark = UNSETTLED;
            }
        }
        let mut cells = vec![or_nothing(measured.map(|quantity| words(quantity, digits) + mark))];
        if column.reference.is_some() {
            cells.push(or_nothing(expected.map(|value| format!("{value:.digits$}"))));
            // Of a quantity that is a part itself deviations are differences.
            let is_part = self.comparison(y).is_some_and(|derived| derived.value.form == Comparison::Deficit);
            cells.push(or_nothing(measured.zip(expected).map(|(measured, expected)| {
                let off = measured.value - expected;
                if is_part { format!("{off:+.digits$}") } else { format!("{:+.1} %", 100.0 * off / expected) }
            })));
        }
        Ok(cells)
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
    let or_nothing = |text: Option<String>| text.unwrap_or_else(|| NOTHING.to_string());
    let percent = |part: Option<f64>| or_nothing(part.map(|part| format!("{:+.2} %", 100.0 * part)));
    let number = |value: Option<f64>| or_nothing(value.map(|value| format!("{value:.DIGITS$}")));
    let (mut errors, mut orders) = (Vec::new(), Vec::new());
    for Found { title, convergence, .. } in found {
        let finest = convergence.samples.last().map(|sample| sample.value);
        errors.extend(convergence.samples.iter().map(|sample| {
            let Sample { cells, value, error } = *sample;
            vec![
                title.clone(),
                cells.to_string(),
                words(Quantity { value, error }, DIGITS),
                percent(convergence.error(sample)),
                percent(finest.map(|finest| value / finest - 1.0)),
            ]
        }));
        let order =
            |which: usize| or_nothing(convergence.order_within.map(|within| interval_words(within[which])));
        let limits = convergence.limit_within;
        let [first, second] = convergence.limit_of_order;
        orders.push(vec![
            title.clone(),
            order_words(convergence.fit.order),
            order(0),
            order(1),
            or_nothing(convergence.against_finest.map(|order| format!("{order:.2}"))),
            number(convergence.limit()),
            or_nothing(limits.map(|[low, high]| format!("{low:.DIGITS$} to {high:.DIGITS$}"))),
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
    let groups: BTreeSet<&str> = found.iter().map(|one| one.group.as_str()).collect();
    for group in groups {
        let mut whole: Vec<&Convergence> =
            (found.iter().filter(|one| one.group == group)).map(|one| &one.convergence).collect();
        let most = whole.iter().map(|one| one.samples.len()).max();
        whole.retain(|one| Some(one.samples.len()) == most);
        if whole.len() < 2 {
            continue;
        }
        let mean = |figure: &dyn Fn(&Convergence) -> Option<f64>, digits: usize| {
            let quantity = |one: &&Convergence| Some(Quantity::exact(figure(one)?));
            let values: Option<Vec<Quantity>> = whole.iter().map(quantity).collect();
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
