//! A document held against the schema of its type: keys that are unknown or missing, values of another type, lists of another
//! length, numbers out of range. Each is named with its whole key, its place and a remedy, which is the comment of the key. Numbers
//! of values that have several forms, such as `[4, 5, 6]` or `{ diameters = [4, 5, 6] }`, are checked where they are used.

use super::source::{Source, nearest};
use crate::error::{Error, Result};
use serde_json::{Map, Value as Json};
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Names that other programs and papers use, the key that is meant, and how to write it.
const OTHER_NAMES: [(&str, &str, &str); 6] = [
    ("radius", "diameter", "write diameter = 2 radius"),
    ("radius", "axes", "write axes = [x, y, z], whole lengths from end to end"),
    ("dt", "time_step", "write time_step = ... in seconds"),
    ("tau", "relaxation_time", "write relaxation_time = ... in time steps"),
    ("phi", "volume_fraction", "write volume_fraction = ..."),
    ("nu", "viscosity", "write viscosity = ... in m^2/s"),
];

/// Most characters of a value that a title repeats.
const REPEATED: usize = 40;

/// One form that a value may have.
type Form = Map<String, Json>;

/// Refuses a document that does not have the form that its schema describes.
pub(super) fn check(source: &Source, document: &DeTable<'_>, schema: &Json) -> Result<()> {
    let check = Check { source, schema };
    check.table(document, &(0..0), &check.forms(schema), "", true)
}

struct Check<'a> {
    source: &'a Source,
    /// With the definitions that its parts refer to.
    schema: &'a Json,
}

impl<'a> Check<'a> {
    /// A schema, or the definition that it refers to.
    fn defined(&self, schema: &'a Json) -> &'a Json {
        let name = schema.get("$ref").and_then(Json::as_str);
        name.and_then(|name| self.schema.pointer(name.trim_start_matches('#'))).unwrap_or(schema)
    }

    /// The forms that a value may have; none if it may have any.
    fn forms(&self, schema: &'a Json) -> Vec<&'a Form> {
        let Some(form) = self.defined(schema).as_object() else {
            return Vec::new();
        };
        if form.contains_key("type") {
            return vec![form];
        }
        let forms = form.get("anyOf").or(form.get("oneOf")).and_then(Json::as_array);
        forms.into_iter().flatten().flat_map(|schema| self.forms(schema)).collect()
    }

    /// A value, and the numbers in it if they have `ranges` to keep.
    fn value(&self, value: &Spanned<DeValue<'_>>, schema: &'a Json, key: &str, ranges: bool) -> Result<()> {
        let condition = self.defined(schema);
        if let Some(then) = condition.get("then") {
            // Our only condition: a table that has one of some keys.
            let conditions = condition["if"]["anyOf"].as_array().into_iter().flatten();
            let mut names = conditions.filter_map(|condition| condition["required"][0].as_str());
            return match value.get_ref() {
                DeValue::Table(table) if names.any(|name| table.contains_key(name)) => {
                    self.value(value, then, key, ranges)
                }
                _ => Ok(()),
            };
        }
        let all = self.forms(schema);
        if all.is_empty() {
            return Ok(());
        }
        let ranges = ranges && all.len() == 1;
        let forms: Vec<&Form> = all.iter().copied().filter(|form| takes(form, value.get_ref())).collect();
        let Some(first) = forms.first() else {
            return Err(self.other_type(value, schema, &all, key));
        };
        match value.get_ref() {
            DeValue::String(text) => self.text(text, &value.span(), &forms, key),
            DeValue::Array(values) => {
                self.length(values.len(), first, &value.span(), key)?;
                let Some(items) = first.get("items") else {
                    return Ok(());
                };
                for (n, value) in values.iter().enumerate() {
                    self.value(value, items, &format!("{key}.{n}"), ranges)?;
                    if ranges {
                        self.range(value, items, description(schema), key)?;
                    }
                }
                Ok(())
            }
            DeValue::Table(table) => self.table(table, &value.span(), &forms, key, ranges || forms.len() > 1),
            _ => Ok(()),
        }
    }

    /// A number must be finite and within the bounds of its schema, if there are any.
    fn range(
        &self,
        value: &Spanned<DeValue<'_>>,
        schema: &Json,
        remedy: Option<&str>,
        key: &str,
    ) -> Result<()> {
        let number = match value.get_ref() {
            DeValue::Float(number) => number.as_str().parse().ok(),
            DeValue::Integer(number) => {
                (i64::from_str_radix(number.as_str(), number.radix()).ok()).map(|n| n as f64)
            }
            _ => None,
        };
        let Some(number) = number.filter(|_| schema["type"] == "number") else {
            return Ok(());
        };
        let bound = |name: &str| schema.get(name).and_then(Json::as_f64);
        let (above, least, most) = (bound("exclusiveMinimum"), bound("minimum"), bound("maximum"));
        let wanted = match (above, least, most) {
            (Some(above), _, None) => format!("a finite number above {above}"),
            (Some(above), _, Some(most)) => format!("above {above} and at most {most}"),
            (None, Some(least), None) => format!("a finite number of at least {least}"),
            (None, Some(least), Some(most)) => format!("at least {least} and at most {most}"),
            (None, None, _) => return Ok(()),
        };
        let within = above.is_none_or(|above| number > above)
            && least.is_none_or(|least| number >= least)
            && most.is_none_or(|most| number <= most);
        if number.is_finite() && within {
            return Ok(());
        }
        let remedy = remedy.unwrap_or_default();
        Err(self.source.out_of_range(key, &value.span(), &number.to_string(), &wanted, remedy))
    }

    /// A text must be one of the words that are known, if all of them are.
    fn text(&self, text: &str, span: &Range<usize>, forms: &[&Form], key: &str) -> Result<()> {
        let known: Option<Vec<&str>> = forms.iter().map(|form| form.get("const")?.as_str()).collect();
        match known {
            Some(known) if !known.contains(&text) => Err(self.unknown("choice", text, span, &known, key)),
            _ => Ok(()),
        }
    }

    fn length(&self, has: usize, form: &Form, span: &Range<usize>, key: &str) -> Result<()> {
        let limit = |name: &str| form.get(name).and_then(Json::as_u64).map(|limit| limit as usize);
        let (Some(least), Some(most)) = (limit("minItems"), limit("maxItems")) else {
            return Ok(());
        };
        if (least..=most).contains(&has) {
            return Ok(());
        }
        let title = format!("`{key}` has {has} {}, but must have {least}", plural(has, "value"));
        let mut remedy = match least {
            3 => "one for each of x, y, z".to_string(),
            _ => format!("give {least} values"),
        };
        if has > most {
            remedy += "; decimal commas must be points";
        }
        Err(self.source.error(span, &title, "of another length", &remedy))
    }

    fn table(
        &self,
        table: &DeTable<'_>,
        span: &Range<usize>,
        forms: &[&'a Form],
        key: &str,
        ranges: bool,
    ) -> Result<()> {
        let properties = || forms.iter().filter_map(|form| form.get("properties")?.as_object());
        let closed = forms.iter().all(|form| form.get("additionalProperties") == Some(&Json::Bool(false)));
        for (name, value) in table {
            let inner = match key {
                "" => name.get_ref().to_string(),
                _ => format!("{key}.{}", name.get_ref()),
            };
            if let Some(schema) = properties().find_map(|known| known.get(name.get_ref().as_ref())) {
                self.value(value, schema, &inner, ranges)?;
                if ranges && forms.len() == 1 {
                    self.range(value, self.defined(schema), description(schema), &inner)?;
                }
            } else if closed {
                let known: Vec<&str> = properties().flat_map(Map::keys).map(String::as_str).collect();
                let kind = if forms.len() > 1 { "choice" } else { "key" };
                return Err(self.unknown(kind, name.get_ref(), &name.span(), &known, key));
            } else if let Some(schema) = forms[0].get("additionalProperties") {
                self.value(value, schema, &inner, ranges)?;
            }
        }
        if let [form] = forms {
            let required = form.get("required").and_then(Json::as_array).into_iter().flatten();
            if let Some(missing) = required.filter_map(Json::as_str).find(|name| !table.contains_key(*name)) {
                let title = format!("the key `{missing}` is missing");
                let remedy = properties().find_map(|known| description(known.get(missing)?));
                let remedy = remedy.map(|text| format!("{missing}: {text}")).unwrap_or_default();
                return Err(self.source.error(span, &title, "must be given here", &remedy));
            }
        } else if table.len() != 1 {
            let title =
                format!("`{key}` must have exactly one of several alternatives, but has {}", table.len());
            let remedy = format!("write {}", alternatives(forms));
            return Err(self.source.error(span, &title, "exactly one", &remedy));
        }
        Ok(())
    }

    fn unknown(&self, kind: &str, name: &str, span: &Range<usize>, known: &[&str], key: &str) -> Error {
        let other = OTHER_NAMES.iter().find(|(other, meant, _)| *other == name && known.contains(meant));
        let all = known.join(", ");
        let remedy = match (other, nearest(name, known)) {
            (Some((_, _, how)), _) => format!("{how}; known here: {all}"),
            (None, Some(near)) => format!("did you mean `{near}`? known here: {all}"),
            (None, None) => format!("known here: {all}"),
        };
        let of = if key.is_empty() { String::new() } else { format!(" in `{key}`") };
        let title = format!("unknown {kind} `{}`{of}", short(name));
        self.source.error(span, &title, &format!("unknown {kind}"), &remedy)
    }

    fn other_type(&self, value: &Spanned<DeValue<'_>>, schema: &Json, forms: &[&Form], key: &str) -> Error {
        let has = match value.get_ref() {
            DeValue::String(text) => format!("the text \"{}\"", short(text)),
            DeValue::Integer(number) => number.to_string(),
            DeValue::Float(number) => number.to_string(),
            DeValue::Boolean(truth) => truth.to_string(),
            DeValue::Datetime(date) => format!("the date {date}"),
            DeValue::Array(_) => "a list".to_string(),
            DeValue::Table(_) => "a table".to_string(),
        };
        let wanted = alternatives(forms);
        let of_type = |kind: &str| forms.iter().any(|form| form["type"] == kind);
        let number = of_type("number") || of_type("integer");
        let remedy = match value.get_ref() {
            DeValue::String(text) if number && text.parse::<f64>().is_ok() => {
                format!("write {text} without quotes")
            }
            DeValue::String(text) if number && text.replacen(',', ".", 1).parse::<f64>().is_ok() => {
                format!("write {} with a point and without quotes", text.replacen(',', ".", 1))
            }
            DeValue::String(text) if of_type("boolean") && ["true", "false"].contains(&text.as_ref()) => {
                format!("write {text} without quotes")
            }
            DeValue::Float(number) if of_type("integer") => match number.as_str().parse::<f64>() {
                Ok(whole) if whole.fract() == 0.0 => format!("write {whole}"),
                _ => "without a decimal point".to_string(),
            },
            _ => description(schema).map(str::to_string).unwrap_or_default(),
        };
        let title = format!("`{key}` is {has}, but must be {wanted}");
        self.source.error(&value.span(), &title, "of another type", &remedy)
    }
}

/// Whether a value is of the type of a form.
fn takes(form: &Form, value: &DeValue<'_>) -> bool {
    let kind = form.get("type").and_then(Json::as_str).unwrap_or_default();
    match value {
        DeValue::String(_) => kind == "string",
        DeValue::Integer(number) => {
            kind == "number"
                || kind == "integer" && !(least(form).is_some() && number.as_str().starts_with('-'))
        }
        DeValue::Float(_) => kind == "number",
        DeValue::Boolean(_) => kind == "boolean",
        DeValue::Datetime(_) => false,
        DeValue::Array(_) => kind == "array",
        DeValue::Table(_) => kind == "object",
    }
}

/// Least value of a form of whole numbers of at least 0.
fn least(form: &Form) -> Option<u64> {
    form.get("minimum").and_then(Json::as_u64)
}

/// The forms in words.
fn alternatives(forms: &[&Form]) -> String {
    let mut words: Vec<String> = Vec::new();
    for form in forms {
        let word = in_words(form);
        if !words.contains(&word) {
            words.push(word);
        }
    }
    match words.split_last() {
        Some((last, [])) => last.clone(),
        Some((last, others)) => format!("{} or {last}", others.join(", ")),
        None => String::new(),
    }
}

fn in_words(form: &Form) -> String {
    let list =
        |form: &Form| form.get("minItems").map_or("a list".to_string(), |n| format!("a list of {n} values"));
    match (form["type"].as_str().unwrap_or_default(), form.get("const")) {
        (_, Some(word)) => word.to_string(),
        ("number", _) => "a number".to_string(),
        ("integer", _) => match least(form) {
            Some(least) => format!("a whole number of at least {least}"),
            None => "a whole number".to_string(),
        },
        ("boolean", _) => "true or false".to_string(),
        ("string", _) => "a text in quotes".to_string(),
        ("array", _) => list(form),
        _ => {
            let only = form.get("properties").and_then(Json::as_object).filter(|keys| keys.len() == 1);
            let only = only.and_then(|keys| keys.iter().next());
            let example = |schema: &Json| match schema["type"].as_str() {
                Some("integer") => "100",
                Some("number") => "...",
                Some("array") => "[x, y, z]",
                _ => "{ ... }",
            };
            only.map_or("a table".to_string(), |(key, schema)| format!("{{ {key} = {} }}", example(schema)))
        }
    }
}

fn description(schema: &Json) -> Option<&str> {
    schema["description"].as_str()
}

fn short(text: &str) -> String {
    let mut short: String = text.chars().take(REPEATED).collect();
    if short.len() < text.len() {
        short.push_str("...");
    }
    short
}

fn plural(count: usize, word: &str) -> String {
    format!("{word}{}", if count == 1 { "" } else { "s" })
}
