//! Compares a document with the schema of its type: keys that are unknown, missing or exclude each other, values of another type,
//! lists of another length, numbers out of range. Errors have the whole key, its position and a remedy, the comment of the key.

use super::schema::Schema;
use super::source::{Source, nearest};
use serde_json::{Map, Value as Json};
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};
use turbid_core::error::{Error, Result};

/// Largest magnitude of a number, and least one of a number that must be above 0: no quantity in SI units is beyond, and what is
/// derived from it would not be finite.
const MOST: f64 = 1e30;
const LEAST: f64 = 1e-30;

/// Most characters of a number without an exponent.
const LONG: usize = 20;
/// Most characters of a value that a title repeats.
const REPEATED: usize = 40;

/// One form that a value may have.
type Form = Map<String, Json>;

/// Refuses a document that does not fit its schema.
pub(super) fn check(source: &Source, document: &DeTable<'_>, schema: &Schema) -> Result<()> {
    let check = Check { source, schema };
    check.table(document, &(0..0), &check.forms(&schema.json), "")
}

struct Check<'a> {
    source: &'a Source,
    /// With the definitions that its parts refer to.
    schema: &'a Schema,
}

impl<'a> Check<'a> {
    /// A schema, or the definition that it refers to.
    fn defined(&self, schema: &'a Json) -> &'a Json {
        let name = schema.get("$ref").and_then(Json::as_str);
        name.and_then(|name| self.schema.json.pointer(name.trim_start_matches('#'))).unwrap_or(schema)
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

    /// A value; the range of a number is called that of `range_key`, the key of the list that it is in.
    fn value(
        &self,
        value: &Spanned<DeValue<'_>>,
        schema: &'a Json,
        (key, range_key): (&str, &str),
        remedy: Option<&str>,
    ) -> Result<()> {
        let condition = self.defined(schema);
        if let Some(then) = condition.get("then") {
            // Our only condition: a table that has one of some keys.
            let conditions = condition["if"]["anyOf"].as_array().into_iter().flatten();
            let mut names = conditions.filter_map(|condition| condition["required"][0].as_str());
            return match value.get_ref() {
                DeValue::Table(table) if names.any(|name| table.contains_key(name)) => {
                    self.value(value, then, (key, key), remedy)
                }
                _ => Ok(()),
            };
        }
        let all = self.forms(schema);
        let forms: Vec<&Form> = all.iter().copied().filter(|form| takes(form, value.get_ref())).collect();
        let Some(first) = forms.first() else {
            return if all.is_empty() { Ok(()) } else { Err(self.other_type(value, remedy, &all, key)) };
        };
        match value.get_ref() {
            DeValue::String(text) => self.text(text, &value.span(), &forms, key),
            DeValue::Array(values) => {
                self.length(values.len(), first, &value.span(), key)?;
                let Some(items) = first.get("items") else {
                    return Ok(());
                };
                values
                    .iter()
                    .enumerate()
                    .try_for_each(|(n, value)| self.value(value, items, (&format!("{key}.{n}"), key), remedy))
            }
            DeValue::Table(table) => self.table(table, &value.span(), &forms, key),
            DeValue::Integer(_) | DeValue::Float(_) if forms.len() == 1 => {
                self.range(value, first, remedy.unwrap_or_default(), range_key)
            }
            _ => Ok(()),
        }
    }

    /// A number must be finite and within the bounds of its form.
    fn range(&self, value: &Spanned<DeValue<'_>>, form: &Form, remedy: &str, key: &str) -> Result<()> {
        let (number, has) = match value.get_ref() {
            DeValue::Float(number) => {
                let size: f64 = number.as_str().parse().unwrap_or(f64::NAN);
                // Without an exponent 1e-300 has 300 digits.
                let plain = size.to_string();
                (size, if plain.len() > LONG { number.as_str().to_string() } else { plain })
            }
            DeValue::Integer(text) => {
                let number = i64::from_str_radix(text.as_str(), text.radix());
                (number.map_or(f64::INFINITY, |n| n as f64), text.to_string())
            }
            _ => return Ok(()),
        };
        let bound = |name: &str| form.get(name).and_then(Json::as_f64);
        let (above, least) = (bound("exclusiveMinimum"), bound("minimum"));
        let narrow = form.get("format").is_some_and(|format| format == "uint32");
        let most = bound("maximum").or(narrow.then(|| f64::from(u32::MAX)));
        let kind = if form["type"] == "integer" { "a whole number" } else { "a finite number" };
        let wanted = match (above, least, most) {
            (Some(above), _, None) => format!("{kind} above {above}"),
            (Some(above), _, Some(most)) => format!("above {above} and at most {most}"),
            (None, Some(least), None) => format!("{kind} of at least {least}"),
            (None, Some(least), Some(most)) => format!("at least {least} and at most {most}"),
            (None, None, _) => kind.to_string(),
        };
        let within = above.is_none_or(|above| number > above)
            && least.is_none_or(|least| number >= least)
            && most.is_none_or(|most| number <= most);
        if number.is_finite() && within {
            let beyond = match number.abs() {
                size if size > MOST => format!("of a magnitude of at most {MOST:e}"),
                size if size < LEAST && above == Some(0.0) => format!("at least {LEAST:e}"),
                _ => return Ok(()),
            };
            return Err(self.source.out_of_range(key, &value.span(), &has, &beyond, remedy));
        }
        Err(self.source.out_of_range(key, &value.span(), &has, &wanted, remedy))
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
        let values = if has == 1 { "value" } else { "values" };
        let title = format!("`{key}` has {has} {values}, but must have {least}");
        let mut remedy = match least {
            3 => "one for each of x, y, z".to_string(),
            _ => format!("give {least} values"),
        };
        if has > most {
            remedy += "; decimal commas must be points";
        }
        Err(self.source.error(span, &title, "of another length", &remedy))
    }

    fn table(&self, table: &DeTable<'_>, span: &Range<usize>, forms: &[&'a Form], key: &str) -> Result<()> {
        let properties =
            || forms.iter().filter_map(|form| Some((*form, form.get("properties")?.as_object()?)));
        let closed = forms.iter().all(|form| form.get("additionalProperties") == Some(&Json::Bool(false)));
        for (name, value) in table {
            let inner = match key {
                "" => name.get_ref().to_string(),
                _ => format!("{key}.{}", name.get_ref()),
            };
            let known =
                properties().find_map(|(form, known)| Some((form, known.get(name.get_ref().as_ref())?)));
            if let Some((form, schema)) = known {
                let remedy = description(schema).or(form.get("description").and_then(Json::as_str));
                self.value(value, schema, (&inner, &inner), remedy)?;
            } else if closed {
                let known: Vec<&str> =
                    properties().flat_map(|(_, known)| known.keys()).map(String::as_str).collect();
                let kind = if forms.len() > 1 { "choice" } else { "key" };
                return Err(self.unknown(kind, name.get_ref(), &name.span(), &known, key));
            } else if let Some(schema) = forms[0].get("additionalProperties") {
                self.value(value, schema, (&inner, &inner), None)?;
            }
        }
        let [form] = forms else {
            if table.len() == 1 {
                return Ok(());
            }
            let title =
                format!("`{key}` must have exactly one of several alternatives, but has {}", table.len());
            let remedy = format!("write {}", alternatives(forms));
            return Err(self.source.error(span, &title, "exactly one", &remedy));
        };
        let required = form.get("required").and_then(Json::as_array).into_iter().flatten();
        if let Some(missing) = required.filter_map(Json::as_str).find(|name| !table.contains_key(*name)) {
            let title = format!("the key `{missing}` is missing");
            let remedy = description(&form["properties"][missing]);
            let remedy = remedy.map(|text| format!("{missing}: {text}")).unwrap_or_default();
            return Err(self.source.error(span, &title, "must be given here", &remedy));
        }
        self.exactly_one(table, span, form, key)
    }

    /// A table must have exactly one of the keys that its form lists as alternatives; those of the whole
    /// document are the caller's.
    fn exactly_one(&self, table: &DeTable<'_>, span: &Range<usize>, form: &Form, key: &str) -> Result<()> {
        let one_of = form.get("oneOf").and_then(Json::as_array).filter(|_| !key.is_empty());
        let names: Vec<&str> =
            one_of.into_iter().flatten().filter_map(|one| one["required"][0].as_str()).collect();
        let given: Vec<_> = names.iter().filter_map(|name| Some((*name, table.get(*name)?.span()))).collect();
        let title =
            |has: &str| format!("`{key}` needs exactly one of `{}`, but has {has}", names.join("`, `"));
        match &given[..] {
            _ if names.is_empty() => Ok(()),
            [_] => Ok(()),
            [] => Err(self.source.error(span, &title("none"), "none is given here", "add one of them")),
            [(_, first), (_, second), ..] => {
                let marks = [(first, "given here"), (second, "and here")];
                let given: Vec<&str> = given.iter().map(|(name, _)| *name).collect();
                let remedy = format!("keep either `{}`", given.join("` or `"));
                Err(self.source.error_at(&marks, &title(&given.len().to_string()), &remedy))
            }
        }
    }

    fn unknown(&self, kind: &str, name: &str, span: &Range<usize>, known: &[&str], key: &str) -> Error {
        let other =
            self.schema.other_names.iter().find(|(other, meant, _)| *other == name && known.contains(meant));
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

    fn other_type(
        &self,
        value: &Spanned<DeValue<'_>>,
        remedy: Option<&str>,
        forms: &[&Form],
        key: &str,
    ) -> Error {
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
        let unquoted = value.get_ref().as_str().map(|text| (text, text.replacen(',', ".", 1)));
        let remedy = match (unquoted, value.get_ref().as_float()) {
            (Some((text, point)), _) if number && point.parse::<f64>().is_ok() => {
                let comma = if point == text { "" } else { " with a point and" };
                format!("write {point}{comma} without quotes")
            }
            (Some((text @ ("true" | "false"), _)), _) if of_type("boolean") => {
                format!("write {text} without quotes")
            }
            (_, Some(number)) if of_type("integer") => match number.as_str().parse::<f64>() {
                Ok(whole) if whole.fract() == 0.0 => format!("write {whole}"),
                _ => "without a decimal point".to_string(),
            },
            _ => remedy.unwrap_or_default().to_string(),
        };
        let title = format!("`{key}` is {has}, but must be {wanted}");
        self.source.error(&value.span(), &title, "of another type", &remedy)
    }
}

/// True if a value is of the type of a form.
fn takes(form: &Form, value: &DeValue<'_>) -> bool {
    let kind = form.get("type").and_then(Json::as_str).unwrap_or_default();
    match value {
        DeValue::String(_) => kind == "string",
        DeValue::Integer(_) => kind == "number" || kind == "integer",
        DeValue::Float(_) => kind == "number",
        DeValue::Boolean(_) => kind == "boolean",
        DeValue::Datetime(_) => false,
        DeValue::Array(_) => kind == "array",
        DeValue::Table(_) => kind == "object",
    }
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
    match (form["type"].as_str().unwrap_or_default(), form.get("const")) {
        (_, Some(word)) => word.to_string(),
        ("number", _) => "a number".to_string(),
        ("integer", _) => match form.get("minimum") {
            Some(least) => format!("a whole number of at least {least}"),
            None => "a whole number".to_string(),
        },
        ("boolean", _) => "true or false".to_string(),
        ("string", _) => "a text in quotes".to_string(),
        ("array", _) => {
            form.get("minItems").map_or("a list".to_string(), |n| format!("a list of {n} values"))
        }
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
