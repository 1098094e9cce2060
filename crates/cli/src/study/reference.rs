//! References: laws, tables, numbers.

use super::Study;
use super::document::{Point, Series, Style};
use super::file::ReferenceSection;
use super::points::At;
use super::result;
use std::path::Path;
use turbid::case::located::Located;
use turbid::case::nearest;
use turbid::error::{Error, Result};
use turbid::input;
use turbid::output::directory;
use turbid::simulation::Law;

/// Points of a smooth line between two points of a study.
const PARTS: u32 = 8;

/// The value of a reference at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Expected {
    /// The reference is not for this point.
    NotMeant,
    /// It is, but has no value there.
    Absent,
    /// Its value.
    Value(f64),
}

impl Expected {
    /// The value, if there is one.
    pub(super) fn value(self) -> Option<f64> {
        match self {
            Self::Value(value) => Some(value),
            Self::NotMeant | Self::Absent => None,
        }
    }
}

impl Study {
    /// The value of a reference for a quantity at a point.
    ///
    /// # Errors
    /// [`Error::Input`] if the reference is not one of a point, or its table is wrong.
    pub(super) fn reference_at(
        &self,
        reference: &Located<ReferenceSection>,
        quantity: &str,
        at: &At,
    ) -> Result<Expected> {
        let Located { value, span } = reference;
        if !self.selection(span, &value.only)?.meets(at) {
            return Ok(Expected::NotMeant);
        }
        let found = match *value {
            ReferenceSection { law: Some(law), .. } => self.law(law, quantity, reference, at)?,
            ReferenceSection { csv: Some(_), .. } => {
                let rows = self.rows(reference, at, None)?;
                rows.first().map(|row| row.y)
            }
            ReferenceSection { value: Some(number), .. } => Some(number),
            _ => {
                let title = "this reference has no value at a single point";
                return self.refuse(span, title, "here", "give `law`, `csv` or `value`");
            }
        };
        Ok(found.map_or(Expected::Absent, Expected::Value))
    }

    fn law(
        &self,
        law: Law,
        quantity: &str,
        reference: &Located<ReferenceSection>,
        at: &At,
    ) -> Result<Option<f64>> {
        let Some(suspension) = self.suspension(at) else {
            return Ok(None);
        };
        let over_stokes = law.over_stokes(suspension);
        match quantity {
            "settling_velocity_over_stokes" => Ok(Some(over_stokes)),
            "settling_velocity_over_schiller_naumann" => {
                Ok(Some(over_stokes / suspension.single_over_stokes))
            }
            _ => {
                let title = format!("a law for settling velocities is no reference for `{quantity}`");
                let remedy =
                    "it is one for settling_velocity_over_stokes or settling_velocity_over_schiller_naumann";
                self.refuse(&reference.span, &title, "here", remedy)
            }
        }
    }

    /// A reference along the horizontal axis `x` through points that differ in nothing else.
    ///
    /// # Errors
    /// As [`reference_at`](Self::reference_at).
    pub(super) fn reference_along(
        &self,
        reference: &Located<ReferenceSection>,
        quantity: &str,
        x: usize,
        along: &[At],
    ) -> Result<Option<Series>> {
        let Located { value, span } = reference;
        let selection = self.selection(span, &value.only)?;
        let Some(first) = along.first().filter(|at| selection.meets(at)) else {
            return Ok(None);
        };
        let known = |at: &At| self.plan.axes[x].values[at[x]?].number;
        let point = |x: f64, y: f64| Point { x, y, error: None };
        let (points, style, name) = match value {
            ReferenceSection { law: Some(law), .. } => {
                let mut points = Vec::new();
                for pair in along.windows(2) {
                    let [from, to] = [0, 1].map(|end| known(&pair[end]).zip(self.suspension(&pair[end])));
                    let (Some((from, a)), Some((to, b))) = (from, to) else {
                        continue;
                    };
                    // Says what is wrong with the quantity.
                    let Some(at_end) = self.law(*law, quantity, reference, &pair[1])? else {
                        continue;
                    };
                    let unit = at_end / law.over_stokes(b);
                    let skipped = u32::from(!points.is_empty());
                    points.extend((skipped..=PARTS).map(|part| {
                        let part = f64::from(part) / f64::from(PARTS);
                        point(from + part * (to - from), unit * law.over_stokes(a.towards(b, part)))
                    }));
                }
                (points, Style::Line, law.name().to_string())
            }
            ReferenceSection { csv: Some(table), .. } => {
                let points = self.rows(reference, first, Some(x))?;
                (points, Style::Points, table.value.clone())
            }
            ReferenceSection { value: Some(number), .. } => {
                let points = along.iter().filter_map(|at| Some(point(known(at)?, *number)));
                (points.collect(), Style::Line, number.to_string())
            }
            _ => {
                let title = "a reference without `law`, `csv`, `fit`, `band` or `value`";
                return self.refuse(span, title, "here", "give one of them");
            }
        };
        Ok(Some(Series {
            label: value.label.clone().unwrap_or(name),
            style: if value.dashed { Style::Dashed } else { style },
            points,
        }))
    }

    /// The rows of a table that are for a point, at the values of the axis `x` if there is one.
    fn rows(&self, reference: &Located<ReferenceSection>, at: &At, x: Option<usize>) -> Result<Vec<Point>> {
        let Located { value, span } = reference;
        let (Some(file), Some(y)) = (&value.csv, &value.y) else {
            let remedy = "y = \"name of a column\"";
            return self.refuse(span, "a table without the column of its values", "here", remedy);
        };
        let path = self.path.parent().unwrap_or(Path::new("")).join(&file.value);
        // What the study itself writes is no reference.
        directory::refuse_input(&self.out.join(result::FILE), std::slice::from_ref(&path))?;
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
                self.source.error(span, &title, "here", &remedy)
            })
        };
        let y = column(&y.value)?;
        let x = x.map(|axis| column(&self.plan.axes[axis].name)).transpose()?;
        let conditions = (value.rows.iter())
            .map(|(name, wanted)| Ok((column(name)?, self.wanted(reference, wanted, at)?)))
            .collect::<Result<Vec<_>>>()?;
        let mut points = Vec::new();
        for row in reader.records() {
            let row = row.map_err(broken)?;
            let holds = |(place, wanted): &(usize, String)| same(&row[*place], wanted);
            let number = |place: usize| row[place].parse::<f64>();
            let (Ok(y), Ok(x)) = (number(y), x.map_or(Ok(0.0), number)) else {
                continue;
            };
            if conditions.iter().all(holds) {
                points.push(Point { x, y, error: None });
            }
        }
        Ok(points)
    }

    /// What a column must equal: the value of an axis at this point, or what is written.
    fn wanted(&self, reference: &Located<ReferenceSection>, wanted: &toml::Value, at: &At) -> Result<String> {
        let word = super::file::word(wanted);
        let Some(place) = self.plan.axes.iter().position(|axis| axis.name == word) else {
            return Ok(word);
        };
        let Some(value) = at[place] else {
            let title = format!("the axis `{word}` has no single value here");
            return self.refuse(&reference.span, &title, "in `where`", "compare with a value instead");
        };
        let value = &self.plan.axes[place].values[value];
        Ok(value.number.map_or_else(|| value.name.clone(), |number| number.to_string()))
    }
}

/// Whether two words are the same, or the same number.
fn same(a: &str, b: &str) -> bool {
    match (a.parse::<f64>(), b.parse::<f64>()) {
        (Ok(a), Ok(b)) => (a - b).abs() <= 1e-9 * b.abs(),
        _ => a == b,
    }
}
