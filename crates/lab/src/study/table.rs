//! Tables of a study, in words.

use super::convergence::{interval_words, words as order_words};
use super::plan::Axis;
use super::points::average;
use super::prelude::*;

const DIGITS: usize = 4;
/// The cell of a value that is not there.
const NOTHING: &str = "-";
/// Follows a number that rests on means that have not settled, and the note below a table with such numbers.
const UNSETTLED: &str = " *";
const UNSETTLED_NOTE: &str = "Numbers marked with * rest on means that have not settled.";

impl Study {
    pub(super) fn table(&self, section: &Located<TableSection>) -> Result<Table> {
        let TableSection { name, title, rows, columns } = &section.value;
        let axes = self.plan.axes_of(rows)?;
        let row_axes = || axes.iter().map(|&axis| &self.plan.axes[axis]);
        let mut heads: Vec<String> = row_axes().map(|axis| axis.name.clone()).collect();
        let mut filled = Vec::new();
        for Located { value: column, span } in columns {
            let ColumnSection { label, y, only, reference, .. } = column;
            heads.push(label.clone());
            if reference.is_some() {
                heads.extend([format!("{label}: reference"), "deviation".to_string()]);
            }
            filled.push((column, self.points(span, &axes, only, &y.value)?));
        }
        let mut table =
            Table { name: name.value.clone(), title: title.clone(), columns: heads, ..Table::default() };
        for values in combinations(row_axes().map(Axis::indices)) {
            let is_here = |at: &At| axes.iter().zip(&values).all(|(&axis, &value)| at[axis] == Some(value));
            let points = filled.iter().map(|(_, points)| points.iter().find(|(at, _)| is_here(at)));
            let points: Vec<_> = points.collect();
            if points.iter().all(Option::is_none) {
                continue;
            }
            let mut row: Vec<String> =
                row_axes().zip(&values).map(|(axis, &value)| axis.values[value].name.clone()).collect();
            for ((column, _), point) in filled.iter().zip(points) {
                row.extend(self.cells(column, point)?);
            }
            if row.iter().any(|cell| cell.ends_with(UNSETTLED)) {
                table.note = UNSETTLED_NOTE.to_string();
            }
            table.rows.push(row);
        }
        // Rows have the names of the values.
        if let Some(rounded) = axes.iter().find_map(|&axis| self.note_on_fractions(axis)) {
            table.note = format!("{} {rounded}", table.note).trim_start().to_string();
        }
        Ok(table)
    }

    /// The cells of a row below one head, or below three.
    fn cells(&self, column: &ColumnSection, point: Option<&(At, Known)>) -> Result<Vec<String>> {
        let (y, digits) = (&column.y.value, column.digits.unwrap_or(DIGITS));
        let measured = point.and_then(|(_, known)| known.value());
        let is_unsettled = |(at, _): &(At, Known)| self.runs_at(at).any(|(run, _)| self.is_unsettled(run));
        let mark = if point.is_some_and(is_unsettled) { UNSETTLED } else { "" };
        let mut cells = vec![measured.map(|quantity| words(quantity, digits) + mark)];
        if let Some(reference) = &column.reference {
            let expected = point.map(|(at, _)| self.reference_at(reference, y, at)).transpose()?.flatten();
            let expected = expected.filter(|value| value.is_finite());
            // Deviations of a quantity that is relative itself are differences.
            let is_part = self.derived(y).is_some_and(|(section, _)| section.form == Comparison::Deficit);
            cells.push(expected.map(|value| format!("{value:.digits$}")));
            cells.push(measured.zip(expected).map(|(measured, expected)| {
                let off = measured.value - expected;
                if is_part { format!("{off:+.digits$}") } else { format!("{:+.1} %", 100.0 * off / expected) }
            }));
        }
        Ok(cells.into_iter().map(or_nothing).collect())
    }
}

pub(super) struct Found {
    pub(super) title: String,
    /// The title that it has in common with its repetitions.
    pub(super) group: String,
    pub(super) convergence: Convergence,
}

/// Tables of the convergence of several series: errors at each resolution, and orders. Of repetitions that have a fit each,
/// means over those on most grids are given, with the standard error of their scatter.
pub(super) fn of_convergence(label: &str, found: &[Found]) -> [Table; 2] {
    let percent = |part: Option<f64>| or_nothing(part.map(|part| format!("{:+.2} %", 100.0 * part)));
    let number = |value: f64| format!("{value:.DIGITS$}");
    let (mut errors, mut orders) = (Vec::new(), Vec::new());
    for Found { title, convergence, .. } in found {
        let finest = convergence.samples.last().map(|sample| sample.y);
        errors.extend(convergence.samples.iter().map(|sample| {
            vec![
                title.clone(),
                sample.x.to_string(),
                words(Quantity { value: sample.y, error: sample.error }, DIGITS),
                percent(convergence.error(sample.y)),
                percent(finest.map(|finest| sample.y / finest - 1.0)),
            ]
        }));
        let order = |k: usize| or_nothing(convergence.order_within.map(|within| interval_words(within[k])));
        let limits = convergence.limit_within;
        let [first, second] = convergence.limit_of_order.map(number);
        orders.push(vec![
            title.clone(),
            order_words(convergence.fit.order),
            order(0),
            order(1),
            or_nothing(convergence.against_finest.map(|order| format!("{order:.2}"))),
            or_nothing(convergence.limit().map(number)),
            or_nothing(limits.map(|[low, high]| format!("{low:.DIGITS$} to {high:.DIGITS$}"))),
            first,
            second,
        ]);
    }
    orders.extend(means(found));
    let table = |name: &str, title: String, columns: &[&str], rows| Table {
        name: name.to_string(),
        title,
        columns: columns.iter().map(ToString::to_string).collect(),
        rows,
        note: String::new(),
    };
    let of_errors = [
        "series",
        "cells per diameter",
        "value",
        "error against the extrapolation",
        "error against the finest",
    ];
    let of_orders = [
        "series",
        "order",
        "within (68 %)",
        "within (95 %)",
        "order against the finest",
        "extrapolated",
        "within (68 %)",
        "extrapolated if the order is 1",
        "extrapolated if it is 2",
    ];
    let title = format!("{label}: order of convergence and extrapolation u_0 + c N^-p");
    [
        table("convergence", format!("{label} over the resolution"), &of_errors, errors),
        table("order", title, &of_orders, orders),
    ]
}

/// Rows of the table of orders for means over repetitions.
fn means(found: &[Found]) -> Vec<Vec<String>> {
    let mut rows: Vec<Vec<String>> = Vec::new();
    let groups: BTreeSet<&str> = found.iter().map(|one| one.group.as_str()).collect();
    for group in groups {
        let of_group = found.iter().filter(|one| one.group == group);
        let mut whole: Vec<&Convergence> = of_group.map(|one| &one.convergence).collect();
        let most = whole.iter().map(|one| one.samples.len()).max();
        whole.retain(|one| Some(one.samples.len()) == most);
        if whole.len() < 2 {
            continue;
        }
        let mean = |figure: &dyn Fn(&Convergence) -> Option<f64>, digits: usize| {
            let values = whole.iter().map(|one| figure(one).map(Quantity::exact));
            or_nothing(values.collect::<Option<Vec<_>>>().map(|values| words(average(&values), digits)))
        };
        let separator = if group.is_empty() { "" } else { ", " };
        rows.push(vec![
            format!("{group}{separator}mean of {}", whole.len()),
            mean(&|one| one.limit().map(|_| one.fit.order), 2),
            NOTHING.to_string(),
            NOTHING.to_string(),
            mean(&|one| one.against_finest, 2),
            mean(&Convergence::limit, DIGITS),
            NOTHING.to_string(),
            mean(&|one| Some(one.limit_of_order[0]), DIGITS),
            mean(&|one| Some(one.limit_of_order[1]), DIGITS),
        ]);
    }
    rows
}

fn or_nothing(text: Option<String>) -> String {
    text.unwrap_or_else(|| NOTHING.to_string())
}

fn words(quantity: Quantity, digits: usize) -> String {
    let Quantity { value, error } = quantity;
    let error = error.map_or(String::new(), |error| format!(" ± {error:.digits$}"));
    format!("{value:.digits$}{error}")
}
