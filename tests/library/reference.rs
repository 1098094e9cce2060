//! The pages of `docs/reference`, which the source gives: `UPDATE=1 cargo test --test library reference` writes them anew.

use crate::common::in_tree;
use serde_json::Value as Json;
use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::fs;
use turbid::case;
use turbid::output::{Summary, dynamics, fronts, particle_series, profiles, series, structure};
use turbid_cli::cli;
use turbid_lab::study;

/// Compares a page with the one in the tree, or replaces that.
#[track_caller]
fn is_page(name: &str, text: &str) {
    let path = in_tree("docs/reference").join(name);
    if std::env::var_os("UPDATE").is_some() {
        return fs::write(path, text).unwrap();
    }
    let stored = fs::read_to_string(&path).unwrap_or_default();
    assert!(
        stored == text,
        "docs/reference/{name} is out of date; run: UPDATE=1 cargo test --test library reference"
    );
}

/// A text in a cell of a table.
fn cell(text: &str) -> String {
    text.replace("\n\n", "<br>").replace('\n', " ").replace('|', "\\|")
}

fn string<'a>(value: &'a Json, key: &str) -> &'a str {
    value[key].as_str().unwrap_or_default()
}

/// A link to the heading of a type below.
fn link(name: &str) -> String {
    format!("[{name}](#{})", name.to_lowercase())
}

/// A page on a JSON schema: a table of the keys of each section, in this order, and the types that they name.
struct Pages<'a> {
    schema: &'a Json,
    /// Names of the types that tables name, in order.
    open: Vec<String>,
    done: BTreeSet<String>,
}

impl Pages<'_> {
    fn resolve<'b>(&'b self, value: &'b Json) -> &'b Json {
        match value["$ref"].as_str() {
            Some(name) => self.schema.pointer(name.trim_start_matches('#')).unwrap(),
            None => value,
        }
    }

    /// Words for the kind of value that a schema takes; types of their own are linked.
    fn kind(&mut self, value: &Json) -> String {
        if let Some(name) = value["$ref"].as_str() {
            let name = name.rsplit('/').next().unwrap().to_string();
            if !self.done.contains(&name) {
                self.open.push(name.clone());
            }
            return link(&name);
        }
        for list in ["oneOf", "anyOf"] {
            if let (Some(choices), true) = (value[list].as_array(), value["properties"].is_null()) {
                let kinds: Vec<String> = choices.iter().map(|choice| self.kind(choice)).collect();
                return kinds.join(" or ");
            }
        }
        if let Some(word) = value["const"].as_str() {
            return format!("`\"{word}\"`");
        }
        match string(value, "type") {
            "array" => {
                let of = self.kind(&value["items"]);
                match (value["minItems"].as_u64(), value["maxItems"].as_u64()) {
                    (Some(least), Some(most)) if least == most => format!("{least} x {of}"),
                    _ => format!("list of {of}"),
                }
            }
            "object" => match value["properties"].as_object() {
                Some(keys) => {
                    let keys: Vec<String> =
                        keys.iter().map(|(key, value)| format!("`{key}` = {}", self.kind(value))).collect();
                    format!("{{ {} }}", keys.join(", "))
                }
                None => "table".into(),
            },
            other => other.to_string(),
        }
    }

    /// A table of the keys of an object.
    fn keys(&mut self, out: &mut String, object: &Json) {
        let Some(properties) = object["properties"].as_object() else { return };
        let required: Vec<&str> =
            object["required"].as_array().into_iter().flatten().filter_map(Json::as_str).collect();
        out.push_str("| key | value | meaning |\n|---|---|---|\n");
        for (key, value) in properties {
            let kind = self.kind(value);
            let range = range(value);
            let needed = if required.contains(&key.as_str()) { " **Required.**" } else { "" };
            let _ = writeln!(
                out,
                "| `{key}` | {}{range} | {}{needed} |",
                cell(&kind),
                cell(string(value, "description"))
            );
        }
        out.push('\n');
    }

    /// A type below its heading.
    fn of_type(&mut self, out: &mut String, name: &str) {
        let value = self.schema["$defs"][name].clone();
        let _ = writeln!(out, "### {name}\n\n{}\n", string(&value, "description").replace('\n', " "));
        if value["properties"].is_object() {
            self.keys(out, &value);
        } else if let Some(choices) = value["oneOf"].as_array().or(value["anyOf"].as_array()) {
            out.push_str("| value | meaning |\n|---|---|\n");
            for choice in choices {
                let said = match string(choice, "description") {
                    "" => string(self.resolve(choice), "description"),
                    said => said,
                };
                let said = cell(said);
                let _ = writeln!(out, "| {} | {said} |", cell(&self.kind(choice)));
            }
            out.push('\n');
        } else {
            let _ = writeln!(out, "{}\n", self.kind(&value));
        }
    }
}

/// The limits of a number in words.
fn range(value: &Json) -> String {
    let limit = |key: &str, sign: &str| value[key].as_f64().map(|limit| format!("{sign} {limit}"));
    let limits = [
        limit("exclusiveMinimum", ">"),
        limit("minimum", ">=").filter(|_| string(value, "type") == "number"),
        limit("maximum", "<=").filter(|text| text.len() < 12),
    ];
    let limits: Vec<String> = limits.into_iter().flatten().collect();
    if limits.is_empty() { String::new() } else { format!(", {}", limits.join(" and ")) }
}

/// The page of a schema: its sections by their names in a file, and the types that they name.
fn schema_page(head: &str, schema: &Json, sections: &[&str]) -> String {
    let mut pages = Pages { schema, open: Vec::new(), done: BTreeSet::new() };
    let mut out = head.to_string();
    let properties = schema["properties"].as_object().unwrap();
    assert_eq!(properties.len(), sections.len(), "a section is missing on the page");
    let required: Vec<&str> =
        schema["required"].as_array().unwrap().iter().filter_map(Json::as_str).collect();
    for &key in sections {
        let value = &properties[key];
        let item = if value["items"].is_null() { value } else { &value["items"] };
        let object = pages.resolve(item).clone();
        let needed = if required.contains(&key) { " Required." } else { "" };
        let title = match (value["items"].is_null(), object["properties"].is_null()) {
            (_, true) => format!("`{key}`"),
            (true, _) => format!("`[{key}]`"),
            (false, _) => format!("`[[{key}]]`"),
        };
        let said = string(value, "description").replace('\n', " ");
        let _ = writeln!(out, "## {title}\n\n{said}{needed}\n");
        if object["properties"].is_null() {
            let _ = writeln!(out, "Value: {}.\n", pages.kind(value));
        } else {
            if let Some(name) = item["$ref"].as_str() {
                pages.done.insert(name.rsplit('/').next().unwrap().into());
            }
            pages.keys(&mut out, &object);
        }
    }
    out.push_str("## Types\n\n");
    while !pages.open.is_empty() {
        let mut names = std::mem::take(&mut pages.open);
        names.sort();
        for name in names {
            if pages.done.insert(name.clone()) {
                pages.of_type(&mut out, &name);
            }
        }
    }
    out.trim_end().to_string() + "\n"
}

#[test]
fn the_page_on_case_files_has_every_key_of_the_schema() {
    let schema: Json = serde_json::from_str(&case::schema()).unwrap();
    let head = "# Case files: every key\n\nA case is a TOML file. All numbers are in SI units unless the meaning says otherwise; unknown \
                keys are refused.\n[How to write a case](../cases.md) has examples. This page is made from the schema that \
                `turbid check --schema` prints.\n\n";
    let sections = [
        "domain",
        "walls",
        "fluid",
        "lattice",
        "dry",
        "particles",
        "insertion",
        "removal",
        "materials",
        "contact",
        "dem",
        "driving",
        "run",
        "output",
    ];
    is_page("case.md", &schema_page(head, &schema, &sections));
}

#[test]
fn the_page_on_study_files_has_every_key_of_the_schema() {
    let schema: Json = serde_json::from_str(&study::file::schema()).unwrap();
    let head = "# Study files: every key\n\nA study is a TOML file; [parameter studies](../study.md) says how to use it. This page is made \
                from the schema that `turbid study --schema` prints.\n\n";
    let sections = [
        "title", "case", "shares", "set", "axis", "skip", "window", "derived", "bench", "figure", "table",
        "check",
    ];
    is_page("study.md", &schema_page(head, &schema, &sections));
}

/// A table of columns, those of a vector or tensor in one row: `net_flux_x`, `_y`, `_z`.
fn columns(out: &mut String, heads: &[String], definitions: &[(&str, &str)]) {
    out.push_str("| column | unit | definition |\n|---|---|---|\n");
    let split = |head: &str| {
        let (name, unit) = head.strip_suffix(')').unwrap().rsplit_once(" (").unwrap();
        (name.to_string(), unit.to_string())
    };
    let quantity = |name: &str| {
        let vector = name.rsplit_once('_').filter(|(_, axis)| axis.chars().all(|c| "wxyz".contains(c)));
        let alone = if ["x", "y", "z"].contains(&name) { "" } else { name };
        vector.map_or(alone, |(vector, _)| vector).to_string()
    };
    let mut rows: Vec<(String, Vec<String>, String)> = Vec::new();
    for head in heads {
        let (name, unit) = split(head);
        match rows.last_mut().filter(|(of, _, _)| *of == quantity(&name)) {
            Some((_, names, _)) => names.push(name),
            None => rows.push((quantity(&name), vec![name], unit)),
        }
    }
    for (quantity, names, unit) in rows {
        let of = quantity.split("_WALL").next().unwrap().split("_particles.N").next().unwrap();
        let of = of.split("_FACE").next().unwrap();
        let (_, said) = definitions.iter().find(|(name, _)| *name == of).unwrap();
        let names: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
        let _ = writeln!(out, "| {} | {unit} | {} |", names.join(", "), cell(said));
    }
}

#[test]
fn the_page_on_tables_has_every_column() {
    let mut out = String::from(
        "# Tables: every column\n\nThe first row of a table has the name and the unit of each column. This page is made from the source.\n\n\
         ## series.csv\n\nA row is the state between two steps: all forces of the steps so far have acted, and none of the coming one. Here `v` \
         is the velocity of a\nparticle, `m` its mass, `V_p` its volume, `D` the diameter of the first kind of particle before its `sizes`, `V` the volume of the \
         box that is in no\nwall (without a fluid of the whole box), `u` the velocity of the fluid, `rho` its density, `g` gravity, and `<>` a \
         mean over the\nparticles.\n\n",
    );
    columns(&mut out, &series::COLUMNS, &series::DEFINITIONS);
    let vector = |(what, unit): &(&str, &str), of: &str| {
        ["x", "y", "z"].map(|axis| format!("{what}_{of}_{axis} ({unit})"))
    };
    out.push_str("\nThen, for each wall `WALL` by its name (`z-`, or that of `[[walls]]`):\n\n");
    let walls: Vec<String> = series::WALL_COLUMNS.iter().flat_map(|column| vector(column, "WALL")).collect();
    columns(&mut out, &walls, &series::DEFINITIONS);
    out.push_str("\nThen, for each section `[[particles]]` with `motion`, `N` counted from 0:\n\n");
    let loads: Vec<String> = series::LOADS.iter().flat_map(|column| vector(column, "particles.N")).collect();
    columns(&mut out, &loads, &series::DEFINITIONS);
    out.push_str("\nThen, for each inlet and outlet by its face `FACE` (`x-` to `z+`):\n\n");
    let flows: Vec<String> = series::flow_columns(&["FACE"]).collect();
    columns(&mut out, &flows, &series::DEFINITIONS);
    out.push_str("\nThen, if particles come or go, for each section `[[particles]]` of free ones:\n\n");
    let population: Vec<String> =
        series::POPULATION.iter().map(|(what, unit)| format!("{what}_particles.N ({unit})")).collect();
    columns(&mut out, &population, &series::DEFINITIONS);
    let _ = write!(
        out,
        "\n## particle_series.csv\n\nOne row for each of the particles in `output.paths`, or else of the first {}, at each time.\n\n",
        particle_series::PATHS
    );
    columns(&mut out, &particle_series::COLUMNS, &particle_series::DEFINITIONS);
    out.push_str(
        "\n## profiles.csv\n\nOne row for each profile of `output.profiles`, time and bin. `number_density_particles.N` (1/m^3), the number density of a \
         section\n`[[particles]]`, follow for all of these.\n\n",
    );
    columns(&mut out, &profiles::COLUMNS, &profiles::DEFINITIONS);
    out.push_str(
        "\n## Tables of means\n\n`profile_means.csv`, `pair_distribution_means.csv`, `contact_force_means.csv`, `structure_factor_means.csv` and `dynamics_means.csv`: one row for each bin of the table \
         of that name, told by\n`profile` and `position`, `separation`, `force_over_mean`, `wave_number` or `lag`, with the number of `rows` from `run.average_from` on, and of each quantity the mean over \
         these rows and\nits standard error, `NAME_error`, which knows how long the values are correlated; empty with fewer than 16 rows. Rows of dynamics.csv with one lag are of \
         blocks, which are\ntaken as independent: their errors need four.\n\n## fronts.csv\n\nOne row for each time of profiles.csv. [Statistics](../statistics.md#profiles-and-fronts) has more.\n\n",
    );
    columns(&mut out, &fronts::COLUMNS, &fronts::DEFINITIONS);
    out.push_str("\n## structure.csv\n\nOne row for each time of `output.structure`.\n\n");
    columns(&mut out, &structure::COLUMNS, &structure::DEFINITIONS);
    out.push_str(
        "\n## pair_distribution.csv\n\nOne row for each time and bin. With `output.structure.plane`, columns `pair_distribution_at_N` (-) follow: the same of pairs within 30 \
         degrees of the plane\nwhose direction lies in the sector of 10 degrees about `N` degrees from the first axis of the plane. With two to six sections \
         `[[particles]]`, columns `pair_distribution_particles.A_particles.B` (-) follow:\n`g(r)` of the pairs of a particle of section `A` and one of section `B`.\n\n",
    );
    columns(&mut out, &structure::PAIR_COLUMNS, &structure::DEFINITIONS);
    out.push_str("\n## contact_forces.csv\n\nOne row for each time and bin.\n\n");
    columns(&mut out, &structure::FORCE_COLUMNS, &structure::DEFINITIONS);
    out.push_str("\n## structure_factor.csv\n\nOne row for each time and shell of wave vectors, with `output.structure.shortest_wave`.\n\n");
    columns(&mut out, &structure::FACTOR_COLUMNS, &structure::DEFINITIONS);
    out.push_str("\n## dynamics.csv\n\nOne row for each sample of `output.dynamics`.\n\n");
    columns(&mut out, &dynamics::COLUMNS, &dynamics::DEFINITIONS);
    out.push_str(
        "\n## result.csv\n\nOne row for each finished run of a [study](../study.md): its name `run`, a column for each axis, the columns \
         below, one for each\n`[[window]]`, and the `version` of the program. What a run does not have stays empty. Names without a definition \
         here are keys of\n[summary.json](summary.md), and for benchmarks of [`turbid bench \
         --json`](../../validation/scaling/README.md#keys-of-turbid-bench---json).\nBenchmarks also have `share_map`, `share_fluid`, ...: \
         parts of the time that a step takes.\n\n",
    );
    for (title, bench) in [("of runs", false), ("of benchmarks", true)] {
        let _ = write!(out, "| column {title} | definition |\n|---|---|\n");
        for name in study::result_columns(bench) {
            let definition = study::RESULT_DEFINITIONS.iter().find(|(of, _)| *of == name);
            let said = definition.map_or("", |(_, said)| said);
            let _ = writeln!(out, "| `{name}` | {said} |");
        }
        out.push('\n');
    }
    is_page("tables.md", &(out.trim_end().to_string() + "\n"));
}

#[test]
fn the_page_on_the_summary_has_every_key() {
    let schema = schemars::schema_for!(Summary).to_value();
    let mut out = String::from(
        "# summary.json: every key\n\nThe result of a run. Keys are stable: they are added, never renamed. `null` means that there was nothing \
         to average, or no particle to\nrefer to. This page is made from the source.\n\n",
    );
    let mut objects = vec![(String::new(), schema.clone())];
    while let Some((name, object)) = objects.pop() {
        if !name.is_empty() {
            let _ = writeln!(out, "\n## {name}\n\n{}\n", string(&object, "description"));
        }
        out.push_str("| key | meaning |\n|---|---|\n");
        let mut inner = Vec::new();
        for (key, value) in object["properties"].as_object().unwrap() {
            let _ = writeln!(out, "| `{key}` | {} |", cell(string(value, "description")));
            let text = value.to_string();
            if let Some((_, of)) = text.split_once("#/$defs/") {
                let of = of.split('"').next().unwrap();
                inner.push((format!("`{key}`"), schema["$defs"][of].clone()));
            }
        }
        objects.extend(inner.into_iter().rev());
    }
    is_page("summary.md", &out);
}

#[test]
fn the_page_on_exit_codes_has_all_of_them() {
    let mut out = String::from("# Exit codes\n\n| code | meaning |\n|---|---|\n");
    for (code, meaning) in cli::EXIT_CODES {
        let _ = writeln!(out, "| {code} | {meaning} |");
    }
    out.push_str(
        "\n`mpirun` returns the same codes after a message of its own. Files that were written before an error stay readable. This page is made \
         from\nthe source.\n",
    );
    is_page("exit-codes.md", &out);
}
