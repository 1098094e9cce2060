//! Keys of a study file.

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::Deserialize;
use serde_json::Value as Json;
use std::borrow::Cow;
use std::collections::BTreeMap;
use turbid::case::Setup;
use turbid::case::file::Duration;
use turbid::document::{Format, Located, Schema as DocumentSchema};
use turbid::simulation::Law;

/// A study: runs of a case, and their evaluation.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "Study")]
pub struct StudyFile {
    /// Subject, one line.
    pub title: String,
    /// The case, relative to this file.
    pub case: Located<String>,
    /// Studies beside the output directory of this one whose finished runs are used too.
    #[serde(default)]
    pub shares: Vec<Located<String>>,
    /// Keys of the case for all runs: `"run.end" = { stokes_times = 100 }`.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, Json>")]
    pub set: Located<toml::Table>,
    /// Axes; the runs are all combinations of their values.
    #[serde(default, rename = "axis")]
    pub axes: Vec<Located<AxisSection>>,
    /// Combinations that are left out: `{ cells = [15, 18], seed = 3 }`.
    #[serde(default)]
    pub skip: Vec<Located<Only>>,
    /// Measure the speed instead of running to the end.
    pub bench: Option<Located<BenchSection>>,
    /// Intervals of time with means of their own.
    #[serde(default, rename = "window")]
    pub windows: Vec<Located<WindowSection>>,
    /// Quantities that compare two values of an axis.
    #[serde(default)]
    pub derived: Vec<Located<DerivedSection>>,
    /// Figures.
    #[serde(default, rename = "figure")]
    pub figures: Vec<Located<FigureSection>>,
    /// Tables.
    #[serde(default, rename = "table")]
    pub tables: Vec<Located<TableSection>>,
    /// Comparisons with references.
    #[serde(default, rename = "check")]
    pub checks: Vec<Located<CheckSection>>,
}

/// A parameter with its values.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AxisSection {
    /// Short name.
    pub name: Located<String>,
    /// Text at the axis of a figure. Default: the name.
    pub label: Option<String>,
    /// The key of the case to which plain values apply.
    pub key: Option<String>,
    /// Plain values of `key`, or tables `{ name, value, set }`.
    #[schemars(extend("minItems" = 1))]
    pub values: Vec<Located<ValueSection>>,
    /// Repetitions of the same thing, such as seeds, that are averaged over.
    #[serde(default)]
    pub average: bool,
}

/// A value of an axis: any, or changes of several keys with a name.
#[derive(Deserialize)]
#[serde(untagged)]
pub enum ValueSection {
    /// Changes of several keys.
    Named(NamedValue),
    /// A value of the axis' key.
    Plain(toml::Value),
}

/// A name for changes of several keys.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NamedValue {
    /// Name in directories and tables.
    pub name: String,
    /// Text of legends and titles. Default: the name.
    pub label: Option<String>,
    /// Number, where the axis is one of a figure. Default: the name, if it is a number.
    pub value: Option<f64>,
    /// Keys of the case and their values.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, Json>")]
    pub set: toml::Table,
}

/// Values of axes by the names of these.
pub type Only = BTreeMap<String, Choice>;

/// Values of an axis, by name or number: one, or a list.
#[derive(Deserialize)]
#[serde(from = "toml::Value")]
pub struct Choice(pub Vec<String>);

impl From<toml::Value> for Choice {
    fn from(value: toml::Value) -> Self {
        match value {
            toml::Value::Array(values) => Self(values.iter().map(word).collect()),
            value => Self(vec![word(&value)]),
        }
    }
}

/// A value as it stands in names: strings without quotes.
pub(super) fn word(value: &toml::Value) -> String {
    match value {
        toml::Value::String(text) => text.clone(),
        value => value.to_string(),
    }
}

/// Measurement of the speed.
#[derive(Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BenchSection {
    /// Timed steps of each of five samples.
    #[schemars(extend("minimum" = 1))]
    pub steps: u64,
    /// Time before the first sample. Default: as many steps as a sample.
    pub warm_up: Option<Duration>,
}

impl BenchSection {
    /// Steps before the first sample.
    pub fn warm_up(&self, setup: &Setup) -> u64 {
        let time = match self.warm_up {
            None => return self.steps,
            Some(Duration::Steps(count)) => return count,
            Some(Duration::Time(time)) => time,
            Some(Duration::StokesTimes(times)) => times * setup.stokes_time().unwrap_or(f64::INFINITY),
        };
        (time / setup.time_step).ceil() as u64
    }
}

/// An interval of time. Its mean settling velocity over that of Stokes is the quantity `<name>_velocity`.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WindowSection {
    /// Short name.
    pub name: Located<String>,
    /// Begin (`t*`).
    #[schemars(extend("minimum" = 0))]
    pub from: f64,
    /// End (`t*`).
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub to: f64,
}

impl WindowSection {
    /// Name of its quantity.
    pub fn quantity(&self) -> String {
        format!("{}_velocity", self.name.value)
    }
}

/// A quantity that compares two values of an axis.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DerivedSection {
    /// Its name.
    pub name: Located<String>,
    /// Text in figures and tables. Default: the name.
    pub label: Option<String>,
    /// Axis whose two values are compared.
    pub axis: Located<String>,
    /// The value of the axis that is compared.
    pub of: Choice,
    /// The value that it is compared with.
    pub to: Choice,
    /// The quantity that is compared. Default: the settling velocity over that of Stokes.
    #[serde(default = "settling_velocity")]
    pub quantity: Located<String>,
    /// Kind of the comparison.
    #[serde(default)]
    pub form: Comparison,
}

fn settling_velocity() -> Located<String> {
    "settling_velocity_over_stokes".to_string().into()
}

/// Comparisons of two values of a quantity.
#[derive(Clone, Copy, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Comparison {
    /// `of / to`.
    #[default]
    Ratio,
    /// `1 - of / to`.
    Deficit,
}

/// A figure.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FigureSection {
    /// Short name, good for a file.
    pub name: Located<String>,
    /// Heading.
    pub title: String,
    /// Axis of the study along the horizontal, with its label.
    pub x: Located<String>,
    /// Quantity, or a list of them.
    pub y: Located<Choice>,
    /// Text of the vertical axis. Default: the quantity.
    pub y_label: Option<String>,
    /// Logarithmic horizontal axis.
    #[serde(default)]
    pub x_log: bool,
    /// Logarithmic vertical axis.
    #[serde(default)]
    pub y_log: bool,
    /// Axes whose values have a series each.
    #[serde(default)]
    pub series: Vec<Located<String>>,
    /// Axis whose values have a panel each.
    pub panels: Option<Located<String>>,
    /// The values of axes that are shown; others are left out.
    #[serde(default)]
    pub only: Only,
    /// Draw the error of each line relative to its own extrapolation to fine grids instead of the quantity.
    #[serde(default)]
    pub error: bool,
    /// References to draw as well.
    #[serde(default)]
    pub references: Vec<Located<ReferenceSection>>,
    /// Note below the figure.
    #[serde(default)]
    pub note: String,
}

/// A reference: exactly one of `law`, `csv`, `fit`, `band`, `order`, `value`.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(extend("oneOf" = [{ "required": ["law"] }, { "required": ["csv"] }, { "required": ["fit"] }, { "required": ["band"] }, { "required": ["order"] }, { "required": ["value"] }]))]
pub struct ReferenceSection {
    /// A correlation for the settling velocity of suspensions.
    pub law: Option<Law>,
    /// A table beside this file, with column `y`.
    pub csv: Option<String>,
    /// Column of the table with the values.
    pub y: Option<String>,
    /// Columns of the table and what they must equal: an axis of the study, or a number or word.
    #[serde(default, rename = "where")]
    #[schemars(with = "BTreeMap<String, Json>")]
    pub rows: BTreeMap<String, toml::Value>,
    /// The values of axes to which it applies.
    #[serde(default)]
    pub only: Only,
    /// The fit through the points of each series: over cells per diameter the extrapolation to fine grids, over volume fractions
    /// `k (1 - phi)^n` with the interval of `n` at 95 %.
    #[serde(default)]
    pub fit: bool,
    /// The mean of all points, and lines above and below it at this relative distance.
    pub band: Option<f64>,
    /// A power law with this order, `x^-order`, through the first point of the first line.
    pub order: Option<f64>,
    /// A number.
    pub value: Option<f64>,
    /// Text of the legend.
    pub label: Option<String>,
    /// Dashed line.
    #[serde(default)]
    pub dashed: bool,
}

/// A table.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TableSection {
    /// Short name, good for a file.
    pub name: Located<String>,
    /// Heading.
    pub title: String,
    /// Axes whose combinations have a row each.
    pub rows: Vec<Located<String>>,
    /// The other columns.
    pub columns: Vec<Located<ColumnSection>>,
}

/// A column of a table.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ColumnSection {
    /// Head.
    pub label: String,
    /// Quantity.
    pub y: Located<String>,
    /// The values of axes to which it applies.
    #[serde(default)]
    pub only: Only,
    /// A reference, which is shown beside the quantity with the deviation from it.
    pub reference: Option<Located<ReferenceSection>>,
    /// Digits behind the point. Default 4.
    pub digits: Option<usize>,
}

/// A comparison with a reference.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CheckSection {
    /// Kind of the comparison.
    pub kind: CheckKind,
    /// Words for the quantity. Default: its name.
    pub label: Option<String>,
    /// The quantity. Default: the settling velocity over that of Stokes.
    #[serde(default = "settling_velocity")]
    pub y: Located<String>,
    /// The values of axes to which it applies.
    #[serde(default)]
    pub only: Only,
    /// `within`: the reference.
    pub reference: Option<Located<ReferenceSection>>,
    /// `within`, `scatter`, `convergence`: largest deviation, relative to the reference.
    #[schemars(extend("minimum" = 0))]
    pub tolerance: Option<f64>,
    /// `within`: largest deviation, in the unit of the quantity.
    #[schemars(extend("minimum" = 0))]
    pub absolute: Option<f64>,
    /// `ordered`: the quantity is above this number.
    pub above: Option<f64>,
    /// `ordered`: the quantity is below this number.
    pub below: Option<f64>,
    /// `convergence`: the axis with the cells per diameter.
    pub x: Option<Located<String>>,
    /// `convergence`: axes of repetitions that are not averaged over but have a fit each.
    #[serde(default)]
    pub separate: Vec<Located<String>>,
    /// `convergence`: the error must fall from this number of cells on.
    pub monotone_from: Option<f64>,
    /// `convergence`: number of cells at which the deviation from the extrapolation is compared with `tolerance`.
    pub at: Option<f64>,
    /// Source of the reference.
    #[serde(default)]
    pub source: String,
}

/// Kinds of comparisons.
#[derive(Clone, Copy, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CheckKind {
    /// Every point is near its reference.
    Within,
    /// Every point is above or below a number.
    Ordered,
    /// The error against the extrapolation to fine grids falls, and is small at one of them.
    Convergence,
    /// Every single run is near the mean over all.
    Scatter,
}

impl JsonSchema for ValueSection {
    fn schema_name() -> Cow<'static, str> {
        "Value".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let named = generator.subschema_for::<NamedValue>();
        // Any other value is one of the axis' key, which may be a table without a name.
        json_schema!({
            "if": { "type": "object", "anyOf": [{ "required": ["name"] }, { "required": ["set"] }] },
            "then": named
        })
    }
}

impl JsonSchema for Choice {
    fn schema_name() -> Cow<'static, str> {
        "Choice".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let [text, number, truth] =
            ["string", "number", "boolean"].map(|kind| json_schema!({ "type": kind }));
        let list = json_schema!({ "type": "array", "items": { "anyOf": [text, number, truth] } });
        json_schema!({ "anyOf": [text, number, truth, list] })
    }
}

impl Format for StudyFile {}

/// The JSON schema of study files, for editors.
pub fn schema() -> String {
    DocumentSchema::of::<StudyFile>().text()
}
