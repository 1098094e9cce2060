//! What is wrong in a study file and can be told before anything runs.

use super::Study;
use super::file::{CheckSection, FigureSection};
use super::plan::Plan;
use super::record;
use crate::case::located::Located;
use crate::error::Result;
use crate::output::series::is_of_a_wall;
use std::collections::BTreeSet;

/// Values of an axis that differ by less are the same.
const SAME: f64 = 1e-9;

impl Study {
    /// Refuses what can mean nothing.
    ///
    /// # Errors
    /// [`Error::Input`](crate::error::Error::Input) with its place and a remedy.
    pub(super) fn refuse_what_means_nothing(&self) -> Result<()> {
        let file = &self.file;
        self.refuse_names_twice("figures", file.figures.iter().map(|figure| &figure.value.name))?;
        self.refuse_names_twice("tables", file.tables.iter().map(|table| &table.value.name))?;
        self.refuse_names_twice("windows", file.windows.iter().map(|window| &window.value.name))?;
        self.refuse_names_twice(
            "derived quantities",
            file.derived.iter().map(|derived| &derived.value.name),
        )?;
        self.refuse_windows()?;
        for Located { value, .. } in &file.derived {
            self.refuse_unknown(&value.quantity, &value.quantity.value)?;
        }
        for name in &file.columns {
            self.refuse_unknown(name, &name.value)?;
        }
        for Located {
            value: FigureSection { y, .. },
            ..
        } in &file.figures
        {
            for name in &y.value.0 {
                self.refuse_unknown(y, name)?;
            }
        }
        let columns = file.tables.iter().flat_map(|table| &table.value.columns);
        for name in columns.filter_map(|column| column.value.y.as_ref()) {
            self.refuse_unknown(name, &name.value)?;
        }
        file.checks.iter().try_for_each(|check| self.refuse_check(check))
    }

    /// What is strange but possible.
    pub fn warnings(&self) -> Vec<String> {
        let beside = self
            .out
            .parent()
            .map(std::path::Path::to_path_buf)
            .unwrap_or_default();
        let folder = self
            .path
            .parent()
            .map(std::path::Path::to_path_buf)
            .unwrap_or_default();
        let strange = self.file.shares.iter().filter(|name| {
            let name = &name.value;
            !beside.join(name).is_dir() && !folder.join(format!("{name}.toml")).is_file()
        });
        strange
            .map(|name| {
                self.source.warning(
                    &name.span,
                    &format!("there is no study `{}` to take runs from", name.value),
                    "neither a directory nor a study file",
                    &format!(
                        "looked for {} and {}.toml",
                        beside.join(&name.value).display(),
                        folder.join(&name.value).display()
                    ),
                )
            })
            .collect()
    }

    fn refuse_names_twice<'a>(
        &self,
        what: &str,
        names: impl Iterator<Item = &'a Located<String>>,
    ) -> Result<()> {
        let mut known = BTreeSet::new();
        for name in names {
            if !known.insert(name.value.as_str()) {
                let title = format!("two {what} have the name `{}`", name.value);
                return Err(self
                    .source
                    .error(&name.span, &title, "again", "rename one of them"));
            }
        }
        Ok(())
    }

    fn refuse_windows(&self) -> Result<()> {
        for Located { value, span } in &self.file.windows {
            let times = [value.from, value.to];
            if !times.iter().all(|time| time.is_finite()) || value.from < 0.0 || value.from >= value.to {
                let title = "a window must begin at 0 or later, and end after that";
                return Err(self.source.error(span, title, "here", "e.g. from = 5, to = 15"));
            }
            for run in &self.plan.runs {
                let setup = &run.setup;
                let end = setup.end_time() / setup.stokes_time().unwrap_or(f64::INFINITY);
                if value.to > end {
                    let title = format!(
                        "the window `{}` ends at {} t*, the run {} at {end:.2} t*",
                        value.name.value, value.to, run.name
                    );
                    let remedy =
                        "end the window earlier, or the run later: its last row may lie before `run.end`";
                    return Err(self.source.error(span, &title, "here", remedy));
                }
            }
        }
        Ok(())
    }

    fn refuse_unknown<T>(&self, place: &Located<T>, name: &str) -> Result<()> {
        let derived = self.file.derived.iter().map(|derived| &derived.value.name.value);
        let windows = self
            .file
            .windows
            .iter()
            .map(|window| format!("{}_velocity", window.value.name.value));
        let own: Vec<String> = derived.cloned().chain(windows).collect();
        let of_runs = record::names(self.file.bench.is_some());
        let known: Vec<&str> = own.iter().map(String::as_str).chain(of_runs).collect();
        if known.contains(&name) || name.starts_with(record::SHARE) || is_of_a_wall(name) {
            return Ok(());
        }
        let near = crate::case::nearest(name, &known);
        let remedy = near.map_or_else(
            || format!("known here: {}", known.join(", ")),
            |near| format!("did you mean `{near}`?"),
        );
        let title = format!("there is no quantity `{name}`");
        Err(self
            .source
            .error(&place.span, &title, "no such quantity", &remedy))
    }

    fn refuse_check(&self, Located { value, span }: &Located<CheckSection>) -> Result<()> {
        self.refuse_unknown(&value.y, &value.y.value)?;
        if value.at.is_some() && value.tolerance.is_none() {
            let title = "`at` without a `tolerance`";
            return Err(self.source.error(
                span,
                title,
                "here",
                "e.g. tolerance = 0.03, a part of the extrapolation",
            ));
        }
        let Some(x) = &value.x else {
            return Ok(());
        };
        let axis = &self.plan.axes[self.plan.axis(&self.source, x)?];
        for (key, number) in [("at", value.at), ("monotone_from", value.monotone_from)] {
            let there = |number: f64| {
                axis.values
                    .iter()
                    .any(|value| value.number.is_some_and(|n| (n - number).abs() < SAME))
            };
            if let Some(number) = number.filter(|number| !there(*number)) {
                let title = format!(
                    "`{key}` is {number}, which is no value of the axis `{}`",
                    axis.name
                );
                return Err(self.source.error(span, &title, "here", &Plan::known_values(axis)));
            }
        }
        Ok(())
    }
}
