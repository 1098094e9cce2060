//! References: laws, tables, numbers.

use super::document;
use super::prelude::*;

/// Points of a smooth line between two points of a study.
const PARTS: u32 = 8;

impl Study {
    /// The value of a reference for a quantity at a point, NaN if it has none there; `None` if it does not apply to the point.
    pub(super) fn reference_at(
        &self,
        reference: &Located<ReferenceSection>,
        quantity: &str,
        at: &At,
    ) -> Result<Option<f64>> {
        if let ReferenceSection { law: None, csv: None, value: None, .. } = reference.value {
            let title = "this reference has no value at a single point";
            return self.plan.refuse(&reference.span, title, "here", "give `law`, `csv` or `value`");
        }
        let series = self.reference_along(reference, quantity, None, std::slice::from_ref(at))?;
        Ok(series.map(|series| series.points.first().map_or(f64::NAN, |point| point.y)))
    }

    fn law(&self, law: Law, quantity: &str, span: &Range<usize>, of: Suspension) -> Result<f64> {
        match quantity {
            "settling_velocity_over_stokes" => Ok(law.over_stokes(of)),
            "settling_velocity_over_schiller_naumann" => Ok(law.over_stokes(of) / of.single_over_stokes),
            _ => {
                let title = format!("a law for settling velocities is no reference for `{quantity}`");
                let remedy =
                    "it is one for settling_velocity_over_stokes or settling_velocity_over_schiller_naumann";
                self.plan.refuse(span, &title, "here", remedy)
            }
        }
    }

    /// A reference along the horizontal axis `x` through points that differ in nothing else; at 0 without an axis.
    pub(super) fn reference_along(
        &self,
        reference: &Located<ReferenceSection>,
        quantity: &str,
        x: Option<usize>,
        along: &[At],
    ) -> Result<Option<Series>> {
        let Located { value, span } = reference;
        let selection = self.plan.selection(span, &value.only)?;
        let Some(first) = along.first().filter(|at| selection.meets(|axis| at[axis])) else {
            return Ok(None);
        };
        let known = |at: &At| x.map_or(Some(0.0), |x| self.number(x, at));
        let (points, style, name) = match value {
            ReferenceSection { law: Some(law), .. } => {
                let mut points = Vec::new();
                for pair in along.windows(2) {
                    let [from, to] = [0, 1].map(|end| known(&pair[end]).zip(self.suspension(&pair[end])));
                    let (Some((from, a)), Some((to, b))) = (from, to) else {
                        continue;
                    };
                    for part in u32::from(!points.is_empty())..=PARTS {
                        let part = f64::from(part) / f64::from(PARTS);
                        let y = self.law(*law, quantity, span, a.towards(b, part))?;
                        points.push((from + part * (to - from), y));
                    }
                }
                if let (None, Some(of)) = (x, self.suspension(first)) {
                    points.push((0.0, self.law(*law, quantity, span, of)?));
                }
                (points, Style::Line, law.name().to_string())
            }
            ReferenceSection { csv: Some(table), .. } => {
                (self.rows(reference, first, x)?, Style::Points, table.clone())
            }
            ReferenceSection { value: Some(number), .. } => {
                let points = along.iter().filter_map(|at| Some((known(at)?, *number)));
                (points.collect(), Style::Line, number.to_string())
            }
            _ => {
                let title = "a reference without `law`, `csv`, `fit`, `band`, `order` or `value`";
                return self.plan.refuse(span, title, "here", "give one of them");
            }
        };
        let style = if value.dashed { Style::Dashed } else { style };
        Ok(Some(Series::new(value.label.clone().unwrap_or(name), style, points)))
    }

    /// The rows of a table that are for a point, at the values of the axis `x`, or at 0 without one.
    fn rows(
        &self,
        reference: &Located<ReferenceSection>,
        at: &At,
        x: Option<usize>,
    ) -> Result<Vec<(f64, f64)>> {
        let Located { value, span } = reference;
        let (Some(file), Some(y)) = (&value.csv, &value.y) else {
            let remedy = "y = \"name of a column\"";
            return self.plan.refuse(span, "a table without the column of its values", "here", remedy);
        };
        let path = self.path.parent().unwrap_or(Path::new("")).join(file);
        // The own result of the study is no reference.
        directory::refuse_input(&self.out.join(document::RESULT), std::slice::from_ref(&path))?;
        let bytes = input::read(&path, input::TABLE).map_err(|error| Error::io("read", &path, error))?;
        let broken = |error: csv::Error| Error::Input(format!("{}: {error}", path.display()));
        let mut reader =
            csv::ReaderBuilder::new().comment(Some(b'#')).trim(csv::Trim::All).from_reader(&bytes[..]);
        let heads = reader.headers().map_err(broken)?.clone();
        let column = |name: &str| {
            heads.iter().position(|head| head == name).ok_or_else(|| {
                let known: Vec<&str> = heads.iter().collect();
                let title = format!("{} has no column `{name}`", path.display());
                let remedy = match nearest(name, &known) {
                    Some(near) => format!("did you mean `{}`?", input::word(near)),
                    None => format!("columns in its first line: {}", known.len()),
                };
                self.plan.source.error(span, &title, "here", &remedy)
            })
        };
        let y = column(y)?;
        let x = x.map(|axis| column(&self.plan.axes[axis].name)).transpose()?;
        let conditions = value.rows.iter();
        let conditions = conditions.map(|(name, wanted)| Ok((column(name)?, self.wanted(span, wanted, at)?)));
        let conditions = conditions.collect::<Result<Vec<_>>>()?;
        let mut points = Vec::new();
        for row in reader.records() {
            let row = row.map_err(broken)?;
            let number = |column: usize| row[column].parse::<f64>();
            let (Ok(y), Ok(x)) = (number(y), x.map_or(Ok(0.0), number)) else {
                continue;
            };
            if conditions.iter().all(|(column, wanted)| same(&row[*column], wanted)) {
                points.push((x, y));
            }
        }
        Ok(points)
    }

    /// Word that a column must equal: the value of an axis at this point, or a given one.
    fn wanted(&self, span: &Range<usize>, wanted: &toml::Value, at: &At) -> Result<String> {
        let word = word(wanted);
        let Some(axis) = self.plan.axes.iter().position(|axis| axis.name == word) else {
            return Ok(word);
        };
        let Some(value) = at[axis] else {
            let title = format!("the axis `{word}` has no single value here");
            return self.plan.refuse(span, &title, "in `where`", "compare with a value instead");
        };
        let value = &self.plan.axes[axis].values[value];
        Ok(value.number.map_or_else(|| value.name.clone(), |number| number.to_string()))
    }
}

/// Returns whether two words are the same, or the same number.
fn same(a: &str, b: &str) -> bool {
    match (a.parse::<f64>(), b.parse::<f64>()) {
        (Ok(a), Ok(b)) => (a - b).abs() <= 1e-9 * b.abs(),
        _ => a == b,
    }
}
