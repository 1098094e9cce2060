//! Kinds of documents: the JSON schema of a type, for editors and for [`conform`](super::conform), and what a schema cannot say.

use schemars::JsonSchema;
use serde::de::DeserializeOwned;
use serde_json::{Value as Json, json};

/// Keyword of ours for keys of which no result depends.
const FREE: &str = "x-free";

/// A kind of document, whose schema is that of the type.
pub trait Format: DeserializeOwned + JsonSchema {
    /// Words of a choice and their earlier names, which documents may still use.
    const EARLIER_NAMES: &'static [(&'static str, &'static str)] = &[];
    /// Names that other programs and papers use, the key that is meant, and how to write it.
    const OTHER_NAMES: &'static [(&'static str, &'static str, &'static str)] = &[];
    /// Keys, and those beside them that have no meaning any more once an option has set one of the former.
    const REPLACED: (&'static [&'static str], &'static [&'static str]) = (&[], &[]);
}

/// Facts that a [`Format`] states of a document.
pub struct Schema {
    pub(super) json: Json,
    pub(super) other_names: &'static [(&'static str, &'static str, &'static str)],
    pub(super) replaced: (&'static [&'static str], &'static [&'static str]),
}

impl Schema {
    /// The schema of a kind of document, without the `null` that TOML cannot write.
    pub fn of<T: Format>() -> Self {
        let mut json = schemars::schema_for!(T).to_value();
        adapt(&mut json, T::EARLIER_NAMES);
        Self { json, other_names: T::OTHER_NAMES, replaced: T::REPLACED }
    }

    /// The schema as JSON, for editors, without our own marks.
    pub fn text(mut self) -> String {
        unmark(&mut self.json);
        // As a schema again, whose keywords have their usual order.
        let schema = schemars::Schema::try_from(self.json).expect("an object");
        serde_json::to_string_pretty(&schema).expect("a schema is plain JSON") + "\n"
    }

    /// Section and name of the keys that are marked as [`free`].
    pub fn free_keys(&self) -> Vec<[String; 2]> {
        let schema = &self.json;
        let defined =
            |part: &Json| part["$ref"].as_str().and_then(|name| schema.pointer(name.strip_prefix('#')?));
        let sections = schema["properties"].as_object().into_iter().flatten();
        let of_section =
            sections.filter_map(|(section, part)| Some((section, defined(part)?["properties"].as_object()?)));
        let keys =
            of_section.flat_map(|(section, keys)| keys.iter().map(move |(key, part)| (section, key, part)));
        keys.filter(|(.., part)| part[FREE] == true)
            .map(|(section, key, _)| [section.clone(), key.clone()])
            .collect()
    }
}

/// Marks a key of which no result depends.
pub fn free(schema: &mut schemars::Schema) {
    schema.insert(FREE.to_string(), true.into());
}

fn unmark(schema: &mut Json) {
    match schema {
        Json::Array(list) => list.iter_mut().for_each(unmark),
        Json::Object(object) => {
            object.remove(FREE);
            object.values_mut().for_each(unmark);
        }
        _ => {}
    }
}

/// Removes `null` from the types and adds the earlier names of choices.
fn adapt(schema: &mut Json, earlier_names: &[(&str, &str)]) {
    if let Json::Array(list) = schema {
        for schema in list {
            adapt(schema, earlier_names);
        }
    }
    let Json::Object(object) = schema else {
        return;
    };
    for schema in object.values_mut() {
        adapt(schema, earlier_names);
    }
    object.retain(|_, value| !value.is_null());
    if let Some(Json::Array(choices)) = object.get_mut("oneOf") {
        let names = earlier_names.iter().filter(|(name, _)| choices.iter().any(|one| one["const"] == *name));
        let earlier = names.map(|(name, earlier)| {
            json!({ "description": format!("Earlier name of \"{name}\"."), "type": "string", "const": earlier })
        });
        choices.extend(earlier.collect::<Vec<_>>());
    }
    if let Some(Json::Array(types)) = object.get_mut("type") {
        types.retain(|kind| kind != "null");
        if let [one] = &types[..] {
            object["type"] = one.clone();
        }
    }
    if let Some(Json::Array(forms)) = object.get_mut("anyOf") {
        forms.retain(|form| form["type"] != "null");
        if let [Json::Object(one)] = &mut forms[..] {
            let one = std::mem::take(one);
            object.remove("anyOf");
            for (key, value) in one {
                object.entry(key).or_insert(value);
            }
        }
    }
}

/// Gives a table the keys of the choice in it that is flattened, of which it has exactly one. Serde knows no other keys there, so that
/// the check of a document alone refuses them.
pub fn one_of(schema: &mut schemars::Schema) {
    let Some(table) = schema.as_object_mut() else { return };
    let mut choices = table.remove("oneOf").expect("a choice in the table");
    for choice in choices.as_array_mut().expect("its forms") {
        let [description, mut keys, required] =
            ["description", "properties", "required"].map(|name| choice[name].take());
        for (name, mut key) in std::mem::take(keys.as_object_mut().expect("a table of one key")) {
            key["description"] = description.clone();
            table["properties"][name] = key;
        }
        *choice = json!({ "required": required });
    }
    table.insert("oneOf".to_owned(), choices);
    table.remove("unevaluatedProperties");
    table.insert("additionalProperties".to_owned(), false.into());
}

/// Marks a number, or all numbers of a list, as above 0.
pub fn positive(schema: &mut schemars::Schema) {
    bound(schema, "exclusiveMinimum");
}

/// Marks a number, or all numbers of a list, as at least 0.
pub fn non_negative(schema: &mut schemars::Schema) {
    bound(schema, "minimum");
}

fn bound(schema: &mut schemars::Schema, keyword: &str) {
    let numbers = match schema.get("items") {
        Some(_) => schema.get_mut("items").and_then(Json::as_object_mut),
        None => schema.as_object_mut(),
    };
    if let Some(numbers) = numbers {
        numbers.insert(keyword.to_string(), 0.into());
    }
}
