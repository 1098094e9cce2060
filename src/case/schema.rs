//! JSON schemas of case and study files, for editors and for [`conform`](super::conform).

use schemars::{JsonSchema, Schema};
use serde_json::{Value as Json, json};

/// Words of a choice and their earlier names, which cases may still use.
const EARLIER_NAMES: [(&str, &str); 2] = [("homogenised", "paper"), ("overlap_volume", "paper")];

/// Keyword of ours for keys of which no result depends.
const FREE: &str = "x-free";

/// The schema of a type, without the `null` that TOML cannot write.
pub(crate) fn of<T: JsonSchema>() -> Json {
    let mut schema = schemars::schema_for!(T).to_value();
    adapt(&mut schema);
    schema
}

/// The same as text, without our own marks.
pub fn text<T: JsonSchema>() -> String {
    let mut schema = of::<T>();
    unmark(&mut schema);
    // As a schema again, whose keywords have their usual order.
    let schema = Schema::try_from(schema).expect("an object");
    serde_json::to_string_pretty(&schema).expect("a schema is plain JSON") + "\n"
}

/// Removes `null` from the types and adds the earlier names of choices.
fn adapt(schema: &mut Json) {
    if let Json::Array(list) = schema {
        list.iter_mut().for_each(adapt);
    }
    let Json::Object(object) = schema else {
        return;
    };
    object.values_mut().for_each(adapt);
    object.retain(|_, value| !value.is_null());
    if let Some(Json::Array(choices)) = object.get_mut("oneOf") {
        let names = EARLIER_NAMES.iter().filter(|(name, _)| choices.iter().any(|one| one["const"] == *name));
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

/// Marks a key of which no result depends.
pub(crate) fn free(schema: &mut Schema) {
    schema.insert(FREE.to_string(), true.into());
}

/// Section and name of the keys that are marked as [`free`].
pub(crate) fn free_keys<T: JsonSchema>() -> Vec<[String; 2]> {
    let schema = of::<T>();
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

/// Marks a number, or all numbers of a list, as above 0.
pub fn positive(schema: &mut Schema) {
    bound(schema, "exclusiveMinimum");
}

/// Marks a number, or all numbers of a list, as at least 0.
pub(crate) fn non_negative(schema: &mut Schema) {
    bound(schema, "minimum");
}

fn bound(schema: &mut Schema, keyword: &str) {
    let numbers = match schema.get("items") {
        Some(_) => schema.get_mut("items").and_then(Json::as_object_mut),
        None => schema.as_object_mut(),
    };
    if let Some(numbers) = numbers {
        numbers.insert(keyword.to_string(), 0.into());
    }
}
