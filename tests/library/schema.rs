//! The schemas for editors: what is shipped fits them, and what the program refuses does not.

use crate::common::case::{SPHERE, SPHERES, changed};
use crate::common::in_tree;
use serde_json::{Map, Value as Json};
use std::fs;
use std::path::{Path, PathBuf};
use turbid::case;
use turbid_lab::study;

const STUDY: &str = r#"
title = "x"
case = "case.toml"
[[axis]]
name = "phi"
key = "particles.0.volume_fraction"
values = [0.1, { name = "dense", set = { "particles.0.volume_fraction" = 0.3 } }]
[[figure]]
name = "u"
title = "u"
x = "phi"
y = "settling_velocity_over_stokes"
references = [{ law = "richardson_zaki" }]
[[check]]
kind = "within"
reference = { value = 0.3 }
tolerance = 0.1
"#;

fn json(schema: &str) -> Json {
    serde_json::from_str(schema).unwrap()
}

fn document(text: &str) -> Json {
    let table: toml::Table = text.parse().unwrap_or_else(|e| panic!("{e}\n{text}"));
    serde_json::to_value(table).unwrap()
}

/// Case and study files of `cases` and of the folders in `validation`, `ffi/engines` and `docs/tutorials`.
fn shipped() -> Vec<PathBuf> {
    let list = |folder: &Path| fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let folders =
        ["validation", "ffi/engines", "docs/tutorials"].into_iter().flat_map(|folder| list(&in_tree(folder)));
    let folders = folders.filter(|path| path.is_dir());
    let folders: Vec<PathBuf> = folders.chain([in_tree("cases")]).collect();
    let files = folders.iter().flat_map(|folder| list(folder));
    let is_input = |path: &PathBuf| {
        let name = path.file_name().unwrap().to_string_lossy();
        name.ends_with(".toml") && !name.ends_with(".expect.toml")
    };
    files.filter(is_input).collect()
}

#[test]
fn all_cases_and_studies_that_are_shipped_fit_the_schema_that_they_name() {
    let schemas = [("case", json(&case::schema())), ("study", json(&study::file::schema()))];
    let mut counts = [0; 2];
    for path in shipped() {
        let text = fs::read_to_string(&path).unwrap();
        let first = text.lines().next().unwrap();
        let which = schemas
            .iter()
            .position(|(name, _)| {
                first.ends_with(&format!("/{name}.schema.json")) && first.starts_with("#:schema ")
            })
            .unwrap_or_else(|| panic!("{} does not begin with its schema", path.display()));
        let named = path.parent().unwrap().join(first.trim_start_matches("#:schema "));
        assert!(named.is_file(), "{} names a schema that is not there", path.display());
        if let Err(what) = check(&schemas[which].1, &document(&text)) {
            panic!("{}: {what}", path.display());
        }
        counts[which] += 1;
    }
    assert!(counts[0] > 20 && counts[1] > 5, "{counts:?}");
}

#[test]
fn the_schema_of_studies_for_editors_is_that_of_the_program() {
    let stored = fs::read_to_string(in_tree("cases/study.schema.json")).unwrap();
    assert!(
        stored == study::file::schema(),
        "out of date; run: cargo run -- study --schema > cases/study.schema.json"
    );
}

#[test]
fn what_the_program_refuses_for_its_form_or_range_does_not_fit_the_schema_of_cases() {
    let schema = json(&case::schema());
    check(&schema, &document(SPHERES)).unwrap();
    for (good, bad) in [
        ("density = 1000.0", "density = -1"),
        ("density = 1000.0", "density = \"thin\""),
        ("density = 1000.0", "density = 0"),
        ("density = 1000.0", "densty = 1000.0"),
        ("density = 1000.0", ""),
        ("archimedes = 1000", ""),
        ("archimedes = 1000", "archimedes = 1000\nviscosity = 1e-6"),
        ("archimedes = 1000", "galileo = 0"),
        ("archimedes = 1000", "viscosity = -1e-6"),
        ("relaxation_time = 0.55", "relaxation_time = 0.5"),
        ("relaxation_time = 0.55", "relaxation_time = 0.55\ntime_step = 1e-5"),
        ("relaxation_time = 0.55", "time_step = 0"),
        ("relaxation_time = 0.55", ""),
        ("relaxation_time = 0.55", "relaxation_time = 0.55\ncollision = \"mrt\""),
        ("relaxation_time = 0.55", "relaxation_time = 0.55\ncoupling = \"paper\"\nsolid_ramp_width = 3"),
        ("cells_per_diameter = 8", "cells_per_diameter = 1"),
        ("[4, 4, 4]", "[4, 4]"),
        ("[4, 4, 4]", "[4, 4, 4, 4]"),
        ("[4, 4, 4]", "[4, 4, -4]"),
        ("density = 3300.0", "density = 0.0"),
        ("volume_fraction = 0.1", "volume_fraction = 1.1"),
        ("volume_fraction = 0.1", "volume_fraction = 0"),
        ("volume_fraction = 0.1", "volume_fraction = 0.1\ncount = 3"),
        ("volume_fraction = 0.1", ""),
        ("volume_fraction = 0.1", "count = -1"),
        ("volume_fraction = 0.1", "list = [[1e-3, 1e-3, 1e-3]]"),
        ("seed = 1", "minimum_gap = -1"),
        ("seed = 1", "overlaps = \"relax\""),
        ("volume_fraction = 0.1\nseed = 1", "list = [[1e-3, 1e-3, 1e-3]]\noverlaps = \"move\""),
        ("volume_fraction = 0.1\nseed = 1", "list = [[1e-3, 1e-3, 1e-3]]\nrelax_distance = 1e-4"),
        (
            "volume_fraction = 0.1\nseed = 1",
            "list = [[1e-3, 1e-3, 1e-3]]\noverlaps = \"refuse\"\nminimum_gap = 1e-4",
        ),
        (
            "volume_fraction = 0.1\nseed = 1",
            "list = [[1e-3, 1e-3, 1e-3]]\noverlaps = \"relax\"\nrelax_distance = 0",
        ),
        ("seed = 1", "columns = { x = \"2*radius\" }"),
        ("volume_fraction = 0.1\nseed = 1", "file = \"bed.csv\"\ncolumns = { colour = \"x\" }"),
        ("volume_fraction = 0.1\nseed = 1", "file = \"bed.csv\"\ncolumns = { x = 3 }"),
        ("seed = 1", "motion = \"frozen\""),
        ("seed = 1", "motion = { velocity = [0, 1] }"),
        ("seed = 1", "motion = { free = [\"w\"] }"),
        ("seed = 1", "motion = { velocity = { oscillation = { frequency = 1 } } }"),
        ("seed = 1", "motion = { velocity = { table = [[0, 1]] } }"),
        ("seed = 1", "sizes = [{ scale = 1, share = 0 }]"),
        ("seed = 1", "force = [0, 1]"),
        ("seed = 1", "granular_temperature = 0"),
        ("archimedes = 1000", "archimedes = 1000\nstart = { uniform = 1 }"),
        (
            "archimedes = 1000",
            "archimedes = 1000\nstart = { shear = { gradient = [1, 0, 0], along = \"w\" } }",
        ),
        ("steps = 10", "steady = { over = { steps = 4 } }"),
        ("steps = 10", "steady = { over = { steps = 4 }, at_most = { steps = 9 }, change = 0 }"),
        (SPHERE, "{ sphere = { diameter = 0 } }"),
        (SPHERE, "{ sphere = { radius = 1e-3 } }"),
        (SPHERE, "\"sphere\""),
        (SPHERE, "{ cube = {} }"),
        (SPHERE, "{ cube = { edge = 1e-3, equivalent_diameter = 1e-3 } }"),
        (SPHERE, "{ cuboid = { edges = [1e-3, 0, 1e-3] } }"),
        ("{ steps = 10 }", "{ steps = 10, time = 1 }"),
        ("{ steps = 10 }", "{ time = -1 }"),
        ("{ steps = 10 }", "10"),
        ("[run]", "[contact]\nrestitution = 1.1\n[run]"),
        ("[run]", "[contact]\npoisson_ratio = 0.6\n[run]"),
        ("[run]", "[contact]\nsubsteps = 0\n[run]"),
        ("[run]", "[output]\nfields_every = { steps = 0 }\n[run]"),
        ("[run]", "[dem.liggghts]\n[run]"),
        ("[run]", "[dem]\nengine = { command = [] }\n[run]"),
        ("[run]", "[dem]\nengine = { command = [\"x\"], timeout = 0 }\n[run]"),
        ("[run]", "[dem]\nengine = { program = \"x\" }\n[run]"),
        ("[run]", "[dry]\ntime_step = 1e-5\n[run]"),
        ("[run]", "[[walls]]\nname = \"w\"\n[run]"),
        ("[fluid]\ndensity = 1000.0\narchimedes = 1000", ""),
    ] {
        let text = changed(SPHERES, &[(good, bad)]);
        assert!(check(&schema, &document(&text)).is_err(), "the schema takes {bad}");
        assert!(case::from_text(&text, "case", &[]).is_err(), "the program takes {bad}");
    }
}

#[test]
fn a_study_that_is_none_does_not_fit_the_schema_of_studies() {
    let schema = json(&study::file::schema());
    check(&schema, &document(STUDY)).unwrap();
    for (good, bad) in [
        ("title = \"x\"\n", ""),
        ("case = \"case.toml\"", "case = 1"),
        ("[[axis]]", "[axis]"),
        ("[[axis]]", "[[axes]]"),
        ("name = \"dense\", ", ""),
        ("name = \"phi\"\n", ""),
        ("values = [0.1, ", "values = 0.1 #"),
        ("{ law = \"richardson_zaki\" }", "{ law = \"stokes\" }"),
        ("{ law = \"richardson_zaki\" }", "{ law = \"richardson_zaki\", value = 0.3 }"),
        ("{ law = \"richardson_zaki\" }", "{}"),
        ("y = \"settling", "y = { a = 1 } #"),
        ("kind = \"within\"", "kind = \"near\""),
        ("tolerance = 0.1", "tolerance = -0.1"),
        ("[[check]]", "[bench]\nsteps = 0\n[[check]]"),
        ("[[check]]", "[[window]]\nname = \"w\"\nfrom = -1\nto = 2\n[[check]]"),
    ] {
        let text = changed(STUDY, &[(good, bad)]);
        assert!(check(&schema, &document(&text)).is_err(), "the schema takes {bad}");
    }
}

#[test]
fn an_option_with_a_shape_takes_the_place_of_the_shape_of_the_case() {
    let schema = json(&case::schema());
    let shapes = schema["$defs"]["ShapeSection"]["oneOf"].as_array().unwrap();
    assert!(shapes.len() >= 9);
    for shape in shapes {
        let key = shape["required"][0].as_str().unwrap();
        let option = format!("particles.0.shape.{key}.nothing=1");
        let error = case::from_text(SPHERES, "case", &[option]).unwrap_err().to_string();
        // Not that there are two.
        assert!(error.contains("unknown key `nothing`"), "{error}");
    }
}

/// Holds a value against a schema, by the keywords of JSON schema (2020-12) that ours have; another one is a failure.
fn check(schema: &Json, value: &Json) -> Result<(), String> {
    fits(schema, schema, value)
}

fn fits(root: &Json, schema: &Json, value: &Json) -> Result<(), String> {
    let fits = |schema: &Json, value: &Json| fits(root, schema, value);
    let Json::Object(keywords) = schema else {
        return if schema == &Json::Bool(true) { Ok(()) } else { Err("nothing fits `false`".into()) };
    };
    let empty = Map::new();
    let list = |keyword: &Json| keyword.as_array().unwrap().clone();
    let object = value.as_object();
    let number = value.as_f64();
    let length = value.as_array().map(|items| items.len() as f64);
    for (keyword, wanted) in keywords {
        let limit = wanted.as_f64().unwrap_or(f64::NAN);
        let good = match keyword.as_str() {
            "$schema" | "$defs" | "title" | "description" | "default" | "format" | "then" => true,
            "$ref" => {
                let place = wanted.as_str().unwrap().trim_start_matches('#');
                fits(root.pointer(place).unwrap(), value)?;
                true
            }
            "type" => match wanted.as_str().unwrap() {
                "object" => value.is_object(),
                "array" => value.is_array(),
                "string" => value.is_string(),
                "boolean" => value.is_boolean(),
                "number" => value.is_number(),
                "integer" => value.is_i64() || value.is_u64(),
                other => panic!("type {other}"),
            },
            "const" => value == wanted,
            "enum" => list(wanted).contains(value),
            "anyOf" => list(wanted).iter().any(|schema| fits(schema, value).is_ok()),
            "oneOf" => list(wanted).iter().filter(|schema| fits(schema, value).is_ok()).count() == 1,
            "not" => fits(wanted, value).is_err(),
            "if" => fits(wanted, value).is_err() || fits(&keywords["then"], value).is_ok(),
            "minimum" => number.is_none_or(|number| number >= limit),
            "exclusiveMinimum" => number.is_none_or(|number| number > limit),
            "maximum" => number.is_none_or(|number| number <= limit),
            "minItems" => length.is_none_or(|length| length >= limit),
            "maxItems" => length.is_none_or(|length| length <= limit),
            "items" => {
                let mut items = value.as_array().into_iter().flatten();
                items.try_for_each(|item| fits(wanted, item))?;
                true
            }
            "required" => object.is_none_or(|object| {
                list(wanted).iter().all(|key| object.contains_key(key.as_str().unwrap()))
            }),
            "properties" => {
                for (key, schema) in wanted.as_object().unwrap() {
                    if let Some(value) = object.and_then(|object| object.get(key)) {
                        fits(schema, value).map_err(|what| format!("{key}: {what}"))?;
                    }
                }
                true
            }
            "additionalProperties" => {
                let known = keywords.get("properties").and_then(Json::as_object).unwrap_or(&empty);
                for (key, value) in object.into_iter().flatten().filter(|(key, _)| !known.contains_key(*key))
                {
                    fits(wanted, value).map_err(|what| format!("{key}: {what}"))?;
                }
                true
            }
            "dependentSchemas" => {
                for (key, schema) in wanted.as_object().unwrap() {
                    if object.is_some_and(|object| object.contains_key(key)) {
                        fits(schema, value)?;
                    }
                }
                true
            }
            other => panic!("a keyword that this test does not know: {other}"),
        };
        if !good {
            return Err(format!("{value} against {keyword}: {wanted}"));
        }
    }
    Ok(())
}
