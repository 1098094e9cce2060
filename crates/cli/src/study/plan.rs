//! The runs of a study: all combinations of the values of its axes.

use super::file::{AxisSection, Choice, StudyFile, ValueSection, word};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use turbid::case::located::Located;
use turbid::case::{self, Setup, Source};
use turbid::error::{Error, Result};

/// An axis with what its values do.
#[derive(Clone, Debug)]
pub struct Axis {
    /// Short name.
    pub name: String,
    /// As it stands at the axis of a figure.
    pub label: String,
    /// Whether its values are repetitions.
    pub average: bool,
    /// Its values.
    pub values: Vec<Value>,
}

/// A value of an axis.
#[derive(Clone, Debug)]
pub struct Value {
    /// Name: a number or a word.
    pub name: String,
    /// Text of legends and titles.
    pub label: String,
    /// Its number, if it is one.
    pub number: Option<f64>,
    /// Options for the case.
    options: Vec<String>,
}

/// One run.
#[derive(Clone, Debug)]
pub struct PlannedRun {
    /// Name of its directory.
    pub name: String,
    /// The place of its value on each axis.
    pub at: Vec<usize>,
    /// Options for the case.
    pub options: Vec<String>,
    /// The case with these, without the particles that it places at random.
    pub setup: Setup,
}

/// The runs of a study, in the order in which they are done: the first repetition of all before the second of any.
#[derive(Clone, Debug)]
pub struct Plan {
    /// What is varied.
    pub axes: Vec<Axis>,
    /// The runs.
    pub runs: Vec<PlannedRun>,
}

impl Plan {
    /// Of a study file whose case is `case`.
    ///
    /// # Errors
    /// [`Error::Input`] with the place in the study file or, if the case is at fault, in the case with the name of the run.
    pub(crate) fn new(source: &Source, file: &StudyFile, case: &Path) -> Result<Self> {
        let axes =
            (file.axes.iter()).map(|section| axis(source, &section.value)).collect::<Result<Vec<_>>>()?;
        let mut names = BTreeSet::new();
        for (axis, section) in axes.iter().zip(&file.axes) {
            if !names.insert(axis.name.as_str()) {
                let span = &section.value.name.span;
                return Err(source.error(span, "two axes have the same name", "again", "rename one of them"));
            }
        }
        let plan = Self { axes, runs: Vec::new() };
        let skips = (file.skip.iter())
            .map(|skip| plan.selection(source, &skip.span, &skip.value))
            .collect::<Result<Vec<_>>>()?;
        let common = match &file.set {
            Some(set) => options(source, &set.span, &set.value)?,
            None => Vec::new(),
        };
        let mut runs = Vec::new();
        for at in combinations(&plan.axes) {
            if skips.iter().any(|skip| skip.holds(&at)) {
                continue;
            }
            let mut options = common.clone();
            let mut words = Vec::new();
            for (axis, &value) in plan.axes.iter().zip(&at) {
                let value = &axis.values[value];
                options.extend(value.options.iter().cloned());
                words.push(directory_word(axis, value));
            }
            let name = if words.is_empty() { "run".to_string() } else { words.join("_") };
            let setup = case::outline(case, &options)
                .map_err(|error| Error::Input(format!("{error}\nin the run {name} of {}", source.path)))?;
            runs.push(PlannedRun { name, at, options, setup });
        }
        if runs.is_empty() {
            return Err(source.error(&(0..0), "the study has no run: all combinations are skipped", "", ""));
        }
        let mut names = BTreeSet::new();
        if let Some(twice) = runs.iter().find(|run| !names.insert(run.name.as_str())) {
            let title = format!("two runs have the name {}", twice.name);
            let remedy = "give values names that tell them apart";
            return Err(source.error(&file.axes[0].span, &title, "", remedy));
        }
        let axes = plan.axes;
        let repetition = |run: &PlannedRun| -> Vec<usize> {
            let places = axes.iter().zip(&run.at).filter(|(axis, _)| axis.average);
            places.map(|(_, &place)| place).collect()
        };
        runs.sort_by_key(repetition);
        Ok(Self { axes, runs })
    }

    /// The place of an axis.
    ///
    /// # Errors
    /// [`Error::Input`] if there is none of this name.
    pub(crate) fn axis(&self, source: &Source, name: &Located<String>) -> Result<usize> {
        let found = self.axes.iter().position(|axis| axis.name == name.value);
        found.ok_or_else(|| {
            let title = format!("there is no axis `{}`", name.value);
            source.error(&name.span, &title, "no such axis", &self.known_axes())
        })
    }

    fn known_axes(&self) -> String {
        let names: Vec<&str> = self.axes.iter().map(|axis| axis.name.as_str()).collect();
        format!("the axes are: {}", names.join(", "))
    }

    /// The values of an axis, in words.
    pub(super) fn known_values(axis: &Axis) -> String {
        let known: Vec<&str> = axis.values.iter().map(|value| value.name.as_str()).collect();
        format!("its values are: {}", known.join(", "))
    }

    /// The combinations that have these values.
    ///
    /// # Errors
    /// [`Error::Input`] for an axis or a value that is not there.
    pub(crate) fn selection(
        &self,
        source: &Source,
        span: &std::ops::Range<usize>,
        only: &BTreeMap<String, Choice>,
    ) -> Result<Selection> {
        let mut chosen = BTreeMap::new();
        for (name, choice) in only {
            let Some(place) = self.axes.iter().position(|axis| axis.name == *name) else {
                let title = format!("there is no axis `{name}`");
                return Err(source.error(span, &title, "here", &self.known_axes()));
            };
            chosen.insert(place, self.values(source, span, place, choice)?);
        }
        Ok(Selection(chosen))
    }

    /// The places of values on an axis.
    ///
    /// # Errors
    /// [`Error::Input`] for a value that is not there.
    pub(crate) fn values(
        &self,
        source: &Source,
        span: &std::ops::Range<usize>,
        axis: usize,
        choice: &Choice,
    ) -> Result<Vec<usize>> {
        let axis = &self.axes[axis];
        let find = |word: &String| {
            let same = |value: &Value| {
                value.name == *word || value.number.is_some() && value.number == word.parse::<f64>().ok()
            };
            axis.values.iter().position(same).ok_or_else(|| {
                let title = format!("the axis `{}` has no value {word}", axis.name);
                source.error(span, &title, "here", &Self::known_values(axis))
            })
        };
        choice.0.iter().map(find).collect()
    }
}

/// Values of some axes.
#[derive(Clone, Debug, Default)]
pub struct Selection(pub BTreeMap<usize, Vec<usize>>);

impl Selection {
    /// Whether a combination has them.
    pub fn holds(&self, at: &[usize]) -> bool {
        self.0.iter().all(|(&axis, values)| values.contains(&at[axis]))
    }
}

fn axis(source: &Source, section: &AxisSection) -> Result<Axis> {
    let name = section.name.value.clone();
    if !is_word(&name) {
        let title = format!("an axis cannot be called `{name}`");
        return Err(source.error(&section.name.span, &title, "here", "take letters, digits and _"));
    }
    if section.values.is_empty() {
        let title = format!("the axis `{name}` has no values");
        return Err(source.error(&section.name.span, &title, "here", "give at least one"));
    }
    let values =
        (section.values.iter()).map(|value| resolve(source, section, value)).collect::<Result<_>>()?;
    Ok(Axis {
        label: section.label.clone().unwrap_or_else(|| name.clone()),
        average: section.average,
        name,
        values,
    })
}

fn resolve(source: &Source, section: &AxisSection, value: &Located<ValueSection>) -> Result<Value> {
    match &value.value {
        ValueSection::Plain(plain) => {
            let Some(key) = &section.key else {
                let title = format!("a plain value on the axis `{}`, which has no `key`", section.name.value);
                let remedy =
                    "give the key of the case that it is for, or write { name = \"..\", set = { .. } }";
                return Err(source.error(&value.span, &title, "for which key?", remedy));
            };
            let name = word(plain);
            Ok(Value {
                label: name.clone(),
                number: number(plain),
                options: vec![format!("{}={plain}", key.value)],
                name,
            })
        }
        ValueSection::Named(named) => Ok(Value {
            name: named.name.clone(),
            label: named.label.clone().unwrap_or_else(|| named.name.clone()),
            number: named.value.or_else(|| named.name.parse().ok()),
            options: options(source, &value.span, &named.set)?,
        }),
    }
}

fn number(value: &toml::Value) -> Option<f64> {
    match value {
        toml::Value::Integer(number) => Some(*number as f64),
        toml::Value::Float(number) => Some(*number),
        _ => None,
    }
}

/// Options `key=value` of a table whose keys are those of the case.
fn options(source: &Source, span: &std::ops::Range<usize>, set: &toml::Table) -> Result<Vec<String>> {
    let mut options = Vec::new();
    for (key, value) in set {
        if value.is_table() && !key.contains('.') {
            let title = format!("`{key}` is a whole section of the case");
            let remedy = format!("name a key of it, in quotes: \"{key}.key\" = value");
            return Err(source.error(span, &title, "here", &remedy));
        }
        options.push(format!("{key}={value}"));
    }
    Ok(options)
}

fn is_word(name: &str) -> bool {
    !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
}

/// A value in the name of a directory: numbers with the name of their axis.
fn directory_word(axis: &Axis, value: &Value) -> String {
    let name: String = (value.name.chars())
        .map(|c| if c.is_ascii_alphanumeric() || "._-+".contains(c) { c } else { '-' })
        .collect();
    if name.starts_with(|c: char| c.is_ascii_alphabetic()) { name } else { format!("{}{name}", axis.name) }
}

/// All combinations of the places of values on some axes, the last axis fastest.
pub(super) fn combinations<'a>(axes: impl IntoIterator<Item = &'a Axis>) -> Vec<Vec<usize>> {
    let mut all = vec![Vec::new()];
    for axis in axes {
        let extend = |at: &Vec<usize>| -> Vec<Vec<usize>> {
            (0..axis.values.len()).map(|value| [&at[..], &[value]].concat()).collect()
        };
        all = all.iter().flat_map(extend).collect();
    }
    all
}
