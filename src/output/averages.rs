//! Means over time of columns of tables, with their standard errors and the ends of their transients, as `summary.json` has them.

use super::series::SeriesTable;
use super::statistics::{Estimate, estimate_settling, settled};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Mean over time of one quantity.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Average {
    /// Unit; `-` for none.
    pub unit: String,
    /// Mean over the averages of the run.
    pub mean: f64,
    /// Its standard error, which knows how long the values are correlated; none of too few values.
    pub standard_error: Option<f64>,
    /// Time at the end of the transient (s), if one was found.
    pub transient_end: Option<f64>,
    /// Mean from there to the end.
    pub settled_mean: Option<f64>,
    /// Its standard error.
    pub settled_standard_error: Option<f64>,
}

/// Averages by the names of their columns.
pub type Averages = BTreeMap<String, Average>;

impl Average {
    /// One without a transient.
    pub fn of(unit: &str, estimate: Estimate) -> Self {
        let Estimate { mean, standard_error } = estimate;
        Self { unit: unit.to_string(), mean, standard_error, ..Self::default() }
    }
}

/// Averages of the columns of a table that are `wanted`, over the rows from a time (s) on, in which the particles settle by `distance` diameters,
/// infinite where their arrangement does not matter. Empty cells are left out; the transient is looked for in all rows.
pub fn averages(
    table: &SeriesTable,
    wanted: impl Fn(&str) -> bool,
    from: f64,
    distance: f64,
) -> impl Iterator<Item = (String, Average)> {
    let time = table.get("t").unwrap_or_default();
    let first = time.partition_point(|t| *t < from);
    let columns = table.columns.iter().filter(move |column| wanted(&column.name));
    columns.filter_map(move |column| {
        let rest = column.values.get(first..)?.iter().copied().filter(|value| value.is_finite());
        let estimate = estimate_settling(&rest.collect::<Vec<_>>(), distance)?;
        let end = settled(&column.values);
        let average = Average {
            transient_end: end.and_then(|end| time.get(end.first).copied()),
            settled_mean: end.map(|end| end.estimate.mean),
            settled_standard_error: end.and_then(|end| end.estimate.standard_error),
            ..Average::of(&column.unit, estimate)
        };
        Some((column.name.clone(), average))
    })
}
