//! Means over time of a table whose rows are those of bins at several times, with standard errors.

use super::atomic::write_table;
use super::series::SeriesTable;
use super::statistics::{Estimate, estimate_independent, estimate_mean};
use crate::error::Result;
use std::collections::BTreeMap;
use std::path::Path;

/// A kind of tables of bins.
#[derive(Clone, Copy, Debug)]
pub struct Bins {
    /// Columns that tell the bins apart; their numbers are not negative.
    pub keys: &'static [&'static str],
    /// Column of the time that decides whether a row counts.
    pub time: &'static str,
    /// Columns in front of the values.
    pub front: usize,
    /// Rows of a bin are independent of each other, as those of blocks.
    pub independent: bool,
}

impl Bins {
    /// Writes a table of means: of each bin in `rows` the mean of every quantity over the rows from a time (s) on, and its standard error;
    /// empty where there are no values, or too few for an error.
    ///
    /// # Errors
    /// Of reading and writing the files.
    pub fn write_means(&self, rows: &Path, means: &Path, from: f64) -> Result<()> {
        let table = SeriesTable::read(rows)?;
        let column = |name: &str| table.get(name).unwrap_or_default();
        let keys: Vec<&[f64]> = self.keys.iter().map(|key| column(key)).collect();
        let time = column(self.time);
        // Bits of numbers that are not negative have their order.
        let mut bins: BTreeMap<Vec<u64>, Vec<usize>> = BTreeMap::new();
        for row in (0..time.len()).filter(|&row| time[row] >= from) {
            bins.entry(keys.iter().map(|key| key[row].to_bits()).collect()).or_default().push(row);
        }
        let values = table.columns.get(self.front..).unwrap_or_default();
        let unit = |key: &&str| table.columns.iter().find(|of| of.name == **key).map_or("-", |of| &*of.unit);
        let mut head: Vec<String> = self.keys.iter().map(|key| format!("{key} ({})", unit(key))).collect();
        head.push("rows (-)".to_string());
        for column in values {
            head.extend(["", "_error"].map(|of| format!("{}{of} ({})", column.name, column.unit)));
        }
        let text = |value: Option<f64>| value.map_or(String::new(), |value| value.to_string());
        let records = bins.iter().map(|(bin, rows)| {
            let mut record: Vec<String> = bin.iter().map(|bits| f64::from_bits(*bits).to_string()).collect();
            record.push(rows.len().to_string());
            for column in values {
                let known = rows.iter().map(|&row| column.values[row]).filter(|value| !value.is_nan());
                let known: Vec<f64> = known.collect();
                let estimate: Option<Estimate> =
                    if self.independent { estimate_independent(&known) } else { estimate_mean(&known) };
                record.push(text(estimate.map(|estimate| estimate.mean)));
                record.push(text(estimate.and_then(|estimate| estimate.standard_error)));
            }
            record
        });
        write_table(means, &head, records)
    }
}
