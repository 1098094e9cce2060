//! The runs of a study: all combinations of the values of its axes.

use super::prelude::*;

pub struct Axis {
    pub name: String,
    pub label: String,
    /// True if its values are repetitions.
    pub average: bool,
    /// True if its numbers are volume fractions, which whole particles meet only nearly.
    pub is_fraction: bool,
    pub values: Vec<Value>,
}

impl Axis {
    pub(super) fn indices(&self) -> Vec<usize> {
        (0..self.values.len()).collect()
    }

    pub(super) fn known_values(&self) -> String {
        let known: Vec<&str> = self.values.iter().map(|value| value.name.as_str()).collect();
        format!("its values are: {}", known.join(", "))
    }
}

/// A value of an axis, with options for the case.
pub struct Value {
    pub name: String,
    pub label: String,
    pub number: Option<f64>,
    options: Vec<String>,
}

impl Value {
    /// True if its number is a volume fraction of the case.
    fn is_fraction(&self) -> bool {
        let sets = |option: &String| {
            let (key, value) = option.split_once('=').unwrap_or_default();
            key.ends_with(".volume_fraction") && value.parse().ok() == self.number
        };
        self.number.is_some() && self.options.iter().any(sets)
    }
}

pub struct PlannedRun {
    pub name: String,
    /// Index of its value on each axis.
    pub at: Vec<usize>,
    pub options: Vec<String>,
    /// The case with these, without particles at random positions.
    pub setup: Setup,
}

/// The runs of a study in the order of their execution: the first repetition of all before the second of any.
pub struct Plan {
    pub(super) source: Source,
    pub axes: Vec<Axis>,
    pub runs: Vec<PlannedRun>,
    /// Axis and indices of the two values (`of`, `to`) of each derived quantity.
    pub(super) derived: Vec<[usize; 3]>,
}

impl Plan {
    /// Plans the runs of a study file whose case is `case`.
    ///
    /// # Errors
    /// [`Error::Input`] with the position in the study file or, if the case is at fault, in the case with the name of the run.
    pub fn new(source: Source, file: &StudyFile, case: &Path) -> Result<Self> {
        let axes = file.axes.iter().map(|section| axis(&source, &section.value)).collect::<Result<_>>()?;
        let mut plan = Self { source, axes, runs: Vec::new(), derived: Vec::new() };
        plan.refuse_duplicates("axes", file.axes.iter().map(|section| &section.value.name))?;
        for Located { value, span } in &file.derived {
            let axis = plan.axis(&value.axis)?;
            let one = |choice| match plan.values(span, axis, choice)?[..] {
                [one] => Ok(one),
                _ => plan.refuse(span, "more than one value is compared", "here", "name one value"),
            };
            let derived = [axis, one(&value.of)?, one(&value.to)?];
            plan.derived.push(derived);
        }
        let skips = file.skip.iter().map(|skip| plan.selection(&skip.span, &skip.value));
        let skips = skips.collect::<Result<Vec<_>>>()?;
        let common = options(&plan.source, &file.set.span, &file.set.value)?;
        for at in combinations(plan.axes.iter().map(Axis::indices)) {
            if skips.iter().any(|skip| skip.meets(|axis| Some(at[axis]))) {
                continue;
            }
            let mut options = common.clone();
            let mut words = Vec::new();
            for (axis, &value) in plan.axes.iter().zip(&at) {
                options.extend(axis.values[value].options.iter().cloned());
                words.push(directory_word(axis, &axis.values[value]));
            }
            let name = if words.is_empty() { "run".to_string() } else { words.join("_") };
            let setup = case::outline(case, &options).map_err(|error| {
                Error::Input(format!("{error}\nin the run {name} of {}", plan.source.path))
            })?;
            plan.runs.push(PlannedRun { name, at, options, setup });
        }
        if plan.runs.is_empty() {
            return plan.refuse(&(0..0), "the study has no run: all combinations are skipped", "", "");
        }
        let mut names = BTreeSet::new();
        if let Some(twice) = plan.runs.iter().find(|run| !names.insert(run.name.as_str())) {
            let title = format!("two runs have the name {}", twice.name);
            let remedy = "give values names that tell them apart";
            return plan.refuse(&file.axes[0].span, &title, "", remedy);
        }
        let axes = &plan.axes;
        plan.runs.sort_by_key(|run| -> Vec<usize> {
            let values = axes.iter().zip(&run.at).filter(|(axis, _)| axis.average);
            values.map(|(_, &value)| value).collect()
        });
        Ok(plan)
    }

    pub(super) fn refuse<T>(&self, span: &Range<usize>, title: &str, label: &str, remedy: &str) -> Result<T> {
        Err(self.source.error(span, title, label, remedy))
    }

    /// Refuses a second section of a kind, say figures, with the name of another.
    pub(super) fn refuse_duplicates<'a>(
        &self,
        kind: &str,
        names: impl Iterator<Item = &'a Located<String>>,
    ) -> Result<()> {
        let mut known = BTreeSet::new();
        for Located { value, span } in names {
            if !known.insert(value) {
                let title = format!("two {kind} have the name `{value}`");
                return self.refuse(span, &title, "again", "rename one of them");
            }
        }
        Ok(())
    }

    pub(super) fn axis(&self, name: &Located<String>) -> Result<usize> {
        self.axis_named(&name.value, &name.span)
    }

    pub(super) fn axes_of(&self, names: &[Located<String>]) -> Result<Vec<usize>> {
        names.iter().map(|name| self.axis(name)).collect()
    }

    fn axis_named(&self, name: &str, span: &Range<usize>) -> Result<usize> {
        let found = self.axes.iter().position(|axis| axis.name == name);
        found.map_or_else(
            || {
                let known: Vec<&str> = self.axes.iter().map(|axis| axis.name.as_str()).collect();
                let remedy = format!("the axes are: {}", known.join(", "));
                self.refuse(span, &format!("there is no axis `{name}`"), "no such axis", &remedy)
            },
            Ok,
        )
    }

    pub(super) fn selection(&self, span: &Range<usize>, only: &Only) -> Result<Selection> {
        let chosen = only.iter().map(|(name, choice)| {
            let axis = self.axis_named(name, span)?;
            Ok((axis, self.values(span, axis, choice)?))
        });
        chosen.collect::<Result<_>>().map(Selection)
    }

    fn values(&self, span: &Range<usize>, axis: usize, choice: &Choice) -> Result<Vec<usize>> {
        let axis = &self.axes[axis];
        let find = |word: &String| {
            let same = |value: &Value| {
                value.name == *word || value.number.is_some() && value.number == word.parse::<f64>().ok()
            };
            axis.values.iter().position(same).ok_or_else(|| {
                let title = format!("the axis `{}` has no value {word}", axis.name);
                self.source.error(span, &title, "here", &axis.known_values())
            })
        };
        choice.0.iter().map(find).collect()
    }
}

/// Indices of values by those of their axes.
pub(super) struct Selection(pub(super) BTreeMap<usize, Vec<usize>>);

impl Selection {
    pub(super) fn meets(&self, at: impl Fn(usize) -> Option<usize>) -> bool {
        self.0.iter().all(|(&axis, values)| at(axis).is_some_and(|value| values.contains(&value)))
    }
}

fn axis(source: &Source, section: &AxisSection) -> Result<Axis> {
    let AxisSection { name: Located { value: name, span }, label, average, .. } = section;
    let refuse = |title: String, remedy: &str| Err(source.error(span, &title, "here", remedy));
    if name.is_empty() || !name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_') {
        return refuse(format!("an axis cannot be called `{name}`"), "take letters, digits and _");
    }
    if section.values.is_empty() {
        return refuse(format!("the axis `{name}` has no values"), "give at least one");
    }
    let values =
        section.values.iter().map(|value| resolve(source, section, value)).collect::<Result<Vec<_>>>()?;
    let label = label.as_ref().unwrap_or(name).clone();
    let is_fraction = values.iter().all(Value::is_fraction);
    Ok(Axis { name: name.clone(), label, average: *average, is_fraction, values })
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
            let number = plain.as_float().or(plain.as_integer().map(|number| number as f64));
            Ok(Value { label: name.clone(), number, options: vec![format!("{key}={plain}")], name })
        }
        ValueSection::Named(named) => Ok(Value {
            name: named.name.clone(),
            label: named.label.as_ref().unwrap_or(&named.name).clone(),
            number: named.value.or_else(|| named.name.parse().ok()),
            options: options(source, &value.span, &named.set)?,
        }),
    }
}

/// Options `key=value` of a table whose keys are those of the case.
fn options(source: &Source, span: &Range<usize>, set: &toml::Table) -> Result<Vec<String>> {
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

/// A value in the name of a directory: numbers with the name of their axis.
fn directory_word(axis: &Axis, value: &Value) -> String {
    let keep = |c: char| if c.is_ascii_alphanumeric() || "._-+".contains(c) { c } else { '-' };
    let name: String = value.name.chars().map(keep).collect();
    if name.starts_with(|c: char| c.is_ascii_alphabetic()) { name } else { format!("{}{name}", axis.name) }
}

/// All combinations of one of each of the choices, the last one fastest.
pub(super) fn combinations<T: Copy>(choices: impl IntoIterator<Item = Vec<T>>) -> Vec<Vec<T>> {
    choices.into_iter().fold(vec![Vec::new()], |all, values| {
        let with = |at: &Vec<T>| values.iter().map(|&value| [&at[..], &[value]].concat()).collect::<Vec<_>>();
        all.iter().flat_map(with).collect()
    })
}
