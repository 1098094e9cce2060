//! What is wrong in a study file and can be told before anything runs.

use super::Study;
use super::file::CheckSection;
use super::plan::Plan;
use super::record;
use std::collections::BTreeSet;
use std::path::Path;
use turbid::case::located::Located;
use turbid::error::Result;
use turbid::output::series::is_of_a_wall;

/// Values of an axis that differ by less are the same.
const SAME: f64 = 1e-9;

impl Study {
    /// Refuses what can mean nothing.
    ///
    /// # Errors
    /// [`Error::Input`](turbid::error::Error::Input) with its place and a remedy.
    pub(super) fn refuse_what_means_nothing(&self) -> Result<()> {
        let file = &self.file;
        self.refuse_names_twice("figures", file.figures.iter().map(|figure| &figure.value.name))?;
        self.refuse_names_twice("tables", file.tables.iter().map(|table| &table.value.name))?;
        self.refuse_names_twice("windows", file.windows.iter().map(|window| &window.value.name))?;
        let derived = file.derived.iter().map(|derived| &derived.value.name);
        self.refuse_names_twice("derived quantities", derived)?;
        self.refuse_windows()?;
        let columns = file.tables.iter().flat_map(|table| &table.value.columns);
        let quantities = (columns.map(|column| &column.value.y))
            .chain(file.derived.iter().map(|derived| &derived.value.quantity))
            .chain(file.checks.iter().map(|check| &check.value.y));
        for quantity in quantities {
            self.refuse_unknown(quantity, &quantity.value)?;
        }
        for figure in &file.figures {
            let y = &figure.value.y;
            y.value.0.iter().try_for_each(|name| self.refuse_unknown(y, name))?;
        }
        file.checks.iter().try_for_each(|check| self.refuse_check(check))
    }

    /// What is strange but possible.
    pub fn warnings(&self) -> Vec<String> {
        let beside = self.out.parent().unwrap_or(Path::new(""));
        let folder = self.path.parent().unwrap_or(Path::new(""));
        let mut warnings = Vec::new();
        for name in &self.file.shares {
            let (results, file) = (beside.join(&name.value), folder.join(format!("{}.toml", name.value)));
            if !results.is_dir() && !file.is_file() {
                warnings.push(self.source.warning(
                    &name.span,
                    &format!("there is no study `{}` to take runs from", name.value),
                    "neither a directory nor a study file",
                    &format!("looked for {} and {}", results.display(), file.display()),
                ));
            }
        }
        warnings
    }

    fn refuse_names_twice<'a>(
        &self,
        what: &str,
        names: impl Iterator<Item = &'a Located<String>>,
    ) -> Result<()> {
        let mut known = BTreeSet::new();
        for Located { value, span } in names {
            if !known.insert(value) {
                let title = format!("two {what} have the name `{value}`");
                return self.refuse(span, &title, "again", "rename one of them");
            }
        }
        Ok(())
    }

    fn refuse_windows(&self) -> Result<()> {
        for Located { value, span } in &self.file.windows {
            let times = [value.from, value.to];
            if !times.iter().all(|time| time.is_finite()) || value.from < 0.0 || value.from >= value.to {
                let title = "a window must begin at 0 or later, and end after that";
                return self.refuse(span, title, "here", "e.g. from = 5, to = 15");
            }
            for run in &self.plan.runs {
                let setup = &run.setup;
                let end = setup.end_time() / setup.stokes_time().unwrap_or(f64::INFINITY);
                if value.to > end {
                    let (name, to) = (&value.name.value, value.to);
                    let title =
                        format!("the window `{name}` ends at {to} t*, the run {} at {end:.2} t*", run.name);
                    let remedy =
                        "end the window earlier, or the run later: its last row may lie before `run.end`";
                    return self.refuse(span, &title, "here", remedy);
                }
            }
        }
        Ok(())
    }

    fn refuse_unknown<T>(&self, place: &Located<T>, name: &str) -> Result<()> {
        let derived = self.file.derived.iter().map(|derived| derived.value.name.value.clone());
        let windows = self.file.windows.iter().map(|window| &window.value.name.value);
        let own: Vec<String> = derived.chain(windows.map(|window| format!("{window}_velocity"))).collect();
        let of_runs = record::names(self.file.bench.is_some());
        let known: Vec<&str> = own.iter().map(String::as_str).chain(of_runs).collect();
        if known.contains(&name) || name.starts_with(record::SHARE) || is_of_a_wall(name) {
            return Ok(());
        }
        let remedy = turbid::case::nearest(name, &known).map_or_else(
            || format!("known here: {}", known.join(", ")),
            |near| format!("did you mean `{near}`?"),
        );
        let title = format!("there is no quantity `{name}`");
        self.refuse(&place.span, &title, "no such quantity", &remedy)
    }

    fn refuse_check(&self, Located { value, span }: &Located<CheckSection>) -> Result<()> {
        self.refuse_unknown(&value.y, &value.y.value)?;
        if value.at.is_some() && value.tolerance.is_none() {
            let remedy = "e.g. tolerance = 0.03, a part of the extrapolation";
            return self.refuse(span, "`at` without a `tolerance`", "here", remedy);
        }
        let Some(x) = &value.x else {
            return Ok(());
        };
        let axis = &self.plan.axes[self.axis(x)?];
        for (key, number) in [("at", value.at), ("monotone_from", value.monotone_from)] {
            let Some(number) = number else { continue };
            let mut numbers = axis.values.iter().filter_map(|value| value.number);
            if !numbers.any(|known| (known - number).abs() < SAME) {
                let title = format!("`{key}` is {number}, which is no value of the axis `{}`", axis.name);
                return self.refuse(span, &title, "here", &Plan::known_values(axis));
            }
        }
        Ok(())
    }
}
