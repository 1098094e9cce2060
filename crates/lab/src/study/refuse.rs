//! Mistakes in a study file that are refused before anything runs.

use super::prelude::*;
use super::record;
use turbid::output::series::is_of_a_body;

impl Study {
    /// Refuses duplicate names, impossible windows, and unknown quantities.
    pub(super) fn refuse_mistakes(&self) -> Result<()> {
        let (file, plan) = (&self.file, &self.plan);
        plan.refuse_duplicates("figures", file.figures.iter().map(|figure| &figure.value.name))?;
        plan.refuse_duplicates("tables", file.tables.iter().map(|table| &table.value.name))?;
        plan.refuse_duplicates("windows", file.windows.iter().map(|window| &window.value.name))?;
        plan.refuse_duplicates("derived quantities", file.derived.iter().map(|derived| &derived.value.name))?;
        if let Some(bench) = file.bench.as_ref().filter(|bench| bench.value.steps == 0) {
            return plan.refuse(&bench.span, "a benchmark of no steps", "here", "e.g. steps = 100");
        }
        self.refuse_windows()?;
        let columns = file.tables.iter().flat_map(|table| &table.value.columns);
        let quantities = (columns.map(|column| &column.value.y))
            .chain(file.derived.iter().map(|derived| &derived.value.quantity))
            .chain(file.checks.iter().map(|check| &check.value.y));
        for Located { value, span } in quantities {
            self.refuse_unknown(span, value)?;
        }
        for Located { value, span } in file.figures.iter().map(|figure| &figure.value.y) {
            value.0.iter().try_for_each(|name| self.refuse_unknown(span, name))?;
        }
        Ok(())
    }

    pub fn warnings(&self) -> Vec<String> {
        let beside = self.out.parent().unwrap_or(Path::new(""));
        let folder = self.path.parent().unwrap_or(Path::new(""));
        let warning = |Located { value, span }: &Located<String>| {
            let (results, file) = (beside.join(value), folder.join(format!("{value}.toml")));
            let title = format!("there is no study `{value}` to take runs from");
            let remedy = format!("looked for {} and {}", results.display(), file.display());
            let is_there = results.is_dir() || file.is_file();
            let label = "neither a directory nor a study file";
            (!is_there).then(|| self.plan.source.warning(span, &title, label, &remedy))
        };
        self.file.shares.iter().filter_map(warning).collect()
    }

    fn refuse_windows(&self) -> Result<()> {
        for Located { value, span } in &self.file.windows {
            let (from, to) = (value.from, value.to);
            if !(from >= 0.0 && from < to && to.is_finite()) {
                let title = "a window must begin at 0 or later, and end after that";
                return self.plan.refuse(span, title, "here", "e.g. from = 5, to = 15");
            }
            for run in &self.plan.runs {
                let end = run.setup.end_time() / run.setup.stokes_time().unwrap_or(f64::INFINITY);
                if to > end {
                    let name = &value.name.value;
                    let title =
                        format!("the window `{name}` ends at {to} t*, the run {} at {end:.2} t*", run.name);
                    let remedy =
                        "end the window earlier, or the run later: its last row may lie before `run.end`";
                    return self.plan.refuse(span, &title, "here", remedy);
                }
            }
        }
        Ok(())
    }

    fn refuse_unknown(&self, span: &std::ops::Range<usize>, name: &str) -> Result<()> {
        let derived = self.file.derived.iter().map(|derived| derived.value.name.value.clone());
        let own: Vec<String> = derived.chain(self.window_quantities()).collect();
        let of_runs = record::names(self.file.bench.is_some());
        let known: Vec<&str> = own.iter().map(String::as_str).chain(of_runs).collect();
        if known.contains(&name) || name.starts_with(record::SHARE) || is_of_a_body(name) {
            return Ok(());
        }
        let remedy = match nearest(name, &known) {
            Some(near) => format!("did you mean `{near}`?"),
            None => format!("known here: {}", known.join(", ")),
        };
        self.plan.refuse(span, &format!("there is no quantity `{name}`"), "no such quantity", &remedy)
    }
}
