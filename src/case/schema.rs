//! JSON schemas of case and study files, for editors and for what [`conform`](super::conform) says.

use schemars::{JsonSchema, Schema};
use serde_json::{Map, Value as Json};

/// The schema of a type, without the `null` that TOML cannot write.
pub fn of<T: JsonSchema>() -> Json {
    let mut schema = schemars::schema_for!(T).to_value();
    drop_null(&mut schema);
    schema
}

/// The same as text.
pub fn text<T: JsonSchema>() -> String {
    // As a schema again, whose keywords have their usual order.
    let schema = Schema::try_from(of::<T>()).expect("an object");
    let mut text = serde_json::to_string_pretty(&schema).expect("a schema is plain JSON");
    text.push('\n');
    text
}

fn drop_null(schema: &mut Json) {
    match schema {
        Json::Object(object) => {
            object.values_mut().for_each(drop_null);
            object.retain(|_, value| !value.is_null());
            if let Some(Json::Array(types)) = object.get_mut("type") {
                types.retain(|kind| kind != "null");
                if let [one] = &types[..] {
                    let one = one.clone();
                    object.insert("type".to_string(), one);
                }
            }
            if let Some(Json::Array(forms)) = object.get_mut("anyOf") {
                forms.retain(|form| form["type"] != "null");
                if let [Json::Object(one)] = &mut forms[..] {
                    let one: Map<String, Json> = std::mem::take(one);
                    object.remove("anyOf");
                    for (key, value) in one {
                        object.entry(key).or_insert(value);
                    }
                }
            }
        }
        Json::Array(list) => list.iter_mut().for_each(drop_null),
        _ => {}
    }
}

/// Marks a number, or all numbers of a list, as above 0.
pub fn positive(schema: &mut Schema) {
    bound(schema, "exclusiveMinimum");
}

/// Marks a number, or all numbers of a list, as at least 0.
pub fn non_negative(schema: &mut Schema) {
    bound(schema, "minimum");
}

fn bound(schema: &mut Schema, keyword: &str) {
    let numbers = if schema.get("items").is_some() {
        schema.get_mut("items").and_then(Json::as_object_mut)
    } else {
        schema.as_object_mut()
    };
    if let Some(numbers) = numbers {
        numbers.insert(keyword.to_string(), 0.into());
    }
}
