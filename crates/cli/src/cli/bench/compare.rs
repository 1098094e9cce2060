//! Comparison of ratios with an earlier benchmark: times depend on the machine, what particles cost beside the fluid hardly does.

use crate::checks::{Check, aligned, is_same};
use serde_json::Value as Json;
use std::path::{Path, PathBuf};
use turbid::error::{Error, Result};
use turbid::input;
use turbid::simulation::Costs;

/// Keys of the ratios: speed with particles over speed without, part of the stage `dem`.
const SPEED: &str = "four_way_over_fluid_only";
const DEM: &str = "dem_share";

const RECORD: &str = "write the file again with `turbid bench CASE --json`";

/// Reads a part of one.
pub(in crate::cli) fn tolerance(text: &str) -> std::result::Result<f64, String> {
    let part = text.parse().ok().filter(|part| (0.0..1.0).contains(part));
    part.ok_or_else(|| "a part from 0 up to 1, such as 0.1 for 10 %".to_string())
}

/// Ratios of an earlier benchmark under the same conditions.
pub(super) struct Recorded {
    path: PathBuf,
    speed: f64,
    dem: f64,
}

/// Result of a comparison.
pub(super) struct Comparison {
    /// A table.
    pub(super) text: String,
    /// True if the ratio did not fall by more than the tolerance.
    pub(super) passed: bool,
}

impl Recorded {
    /// Reads the JSON of a benchmark. Errors: [`Error::Io`]; [`Error::Input`] with file, key and remedy if it is none, or was made under
    /// other conditions.
    pub(super) fn read(path: &Path, conditions: &Json) -> Result<Self> {
        let text = input::read_text(path, input::RECORD).map_err(|error| Error::io("read", path, error))?;
        let (speed, dem) =
            ratios(&text, conditions).map_err(|what| Error::Input(format!("{}: {what}", path.display())))?;
        Ok(Self { path: path.to_path_buf(), speed, dem })
    }

    /// Compares: the speed may be lower by a part `tolerance`; the part of the contacts, which a faster fluid raises, is only reported.
    pub(super) fn compare(&self, now: &Costs, tolerance: f64) -> Comparison {
        let Self { path, speed, dem } = self;
        let [speed_now, dem_now] =
            [now.four_way_over_fluid_only, now.dem_share].map(|ratio| ratio.unwrap_or(f64::NAN));
        let allowed = tolerance * speed;
        let checks = [
            Check {
                pass: speed_now >= speed - allowed,
                ..Check::new("four-way over fluid only", speed_now, *speed, allowed, "")
            },
            Check::new("part of contacts and motion", dem_now, *dem, f64::INFINITY, ""),
        ];
        let row = |check: &Check| {
            let Check { quantity, reference, measured, .. } = check;
            let change = format!("{:+.1} %", 100.0 * (measured / reference - 1.0));
            let numbers = [reference, measured].map(|ratio| format!("{ratio:.4}"));
            [vec![quantity.clone()], numbers.to_vec(), vec![change, check.verdict().to_owned()]].concat()
        };
        let heads = ["", "recorded", "now", "change", "verdict"].map(str::to_owned).to_vec();
        let rows: Vec<Vec<String>> = std::iter::once(heads).chain(checks.iter().map(row)).collect();
        let text = format!(
            "  compared with {}, tolerance {:.0} %\n  {}",
            path.display(),
            100.0 * tolerance,
            aligned(&rows).join("\n  ")
        );
        Comparison { text, passed: checks.iter().all(|check| check.pass) }
    }
}

/// The ratios of a benchmark; else what is wrong, with a remedy.
fn ratios(text: &str, conditions: &Json) -> std::result::Result<(f64, f64), String> {
    let json: Json = serde_json::from_str(text)
        .map_err(|error| format!("no result of `turbid bench --json`: {error}; {RECORD}"))?;
    let Some(known) = json.get("conditions").and_then(Json::as_object) else {
        return Err(format!("no result of `turbid bench --json`, it has no key `conditions`; {RECORD}"));
    };
    for (key, wanted) in conditions.as_object().into_iter().flatten() {
        let known = known.get(key).unwrap_or(&Json::Null);
        if is_same(known, wanted) {
            continue;
        }
        let remedy = match (key.as_str(), known) {
            ("simd", Json::String(name)) => format!("add --set 'run.simd=\"{name}\"'"),
            ("precision", Json::String(name)) => format!("add --set 'fluid.precision=\"{name}\"'"),
            ("ranks", Json::Number(ranks)) => format!("add --threads {ranks}"),
            ("steps", Json::Number(steps)) => format!("add --steps {steps}"),
            ("warm_up", Json::Number(steps)) => format!("add --warm-up {steps}"),
            _ => "compare with a file of the same case".to_owned(),
        };
        let shown = |value: &Json| input::word(&value.to_string());
        return Err(format!(
            "another benchmark: `conditions.{key}` is {} there and {} here; {remedy}, or {RECORD}",
            shown(known),
            shown(wanted)
        ));
    }
    let ratio = |key: &str| {
        let ratio = json.get(key).and_then(Json::as_f64).filter(|ratio| *ratio > 0.0);
        ratio.ok_or_else(|| {
            format!("`{key}` is not a number above 0; compare a case with a fluid and particles, or {RECORD}")
        })
    };
    Ok((ratio(SPEED)?, ratio(DEM)?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn conditions() -> Json {
        json!({ "cells": 512_000, "dx": 1.5e-4, "precision": "f32", "simd": "avx2", "ranks": 1, "steps": 100 })
    }

    fn file() -> Json {
        json!({ "conditions": conditions(), SPEED: 0.5, DEM: 0.02 })
    }

    /// The verdict if the speed is now this part of that of the fluid.
    fn passes(now: f64, tolerance: f64) -> bool {
        let recorded = Recorded { path: "a.json".into(), speed: 0.5, dem: 0.02 };
        let costs = Costs {
            fluid_only_mlups: Some(100.0),
            fluid_only_mlups_samples: vec![100.0],
            four_way_over_fluid_only: Some(now),
            dem_share: Some(0.04),
            nanoseconds_per_fluid_cell: None,
            nanoseconds_per_covered_cell: None,
            nanoseconds_per_contact: None,
            roofline_fraction_with_particles: None,
        };
        recorded.compare(&costs, tolerance).passed
    }

    #[test]
    fn a_ratio_may_rise_and_may_fall_by_the_tolerance() {
        assert!(passes(0.9, 0.1) && passes(0.451, 0.1) && !passes(0.449, 0.1));
        assert!(passes(0.449, 0.2) && passes(0.5, 0.0) && !passes(f64::NAN, 0.2));
    }

    #[test]
    fn a_file_of_the_same_conditions_has_ratios_whatever_else_is_in_it() {
        let mut file = file();
        file["mlups"] = json!(7.0);
        file["conditions"]["dx"] = json!(1.5e-4 * (1.0 + 1e-12));
        assert_eq!(ratios(&file.to_string(), &conditions()), Ok((0.5, 0.02)));
    }

    #[test]
    fn a_file_that_is_no_benchmark_is_refused_with_a_remedy() {
        for (text, words) in [
            ("", "EOF"),
            ("mlups = 3", "no result of `turbid bench --json`"),
            ("[1]", "no key `conditions`"),
            (r#"{ "mlups": 100.0 }"#, "no key `conditions`"),
        ] {
            let said = ratios(text, &conditions()).unwrap_err();
            assert!(said.contains(words) && said.contains(RECORD), "{said}");
        }
    }

    #[test]
    fn a_file_of_other_conditions_is_refused_with_key_and_remedy() {
        for (key, value, remedy) in [
            ("cells", json!(4096), "compare with a file of the same case"),
            ("dx", json!(1.6e-4), "compare with a file of the same case"),
            ("precision", json!("f64"), "--set 'fluid.precision=\"f64\"'"),
            ("simd", json!("avx512"), "--set 'run.simd=\"avx512\"'"),
            ("ranks", json!(4), "--threads 4"),
            ("steps", Json::Null, "compare with a file of the same case"),
        ] {
            let mut file = file();
            file["conditions"][key] = value;
            let said = ratios(&file.to_string(), &conditions()).unwrap_err();
            assert!(said.contains(&format!("`conditions.{key}`")) && said.contains(remedy), "{said}");
        }
    }

    #[test]
    fn a_benchmark_without_particles_or_fluid_is_refused() {
        let mut file = file();
        file[SPEED] = Json::Null;
        let said = ratios(&file.to_string(), &conditions()).unwrap_err();
        assert!(
            said.contains("`four_way_over_fluid_only`") && said.contains("a fluid and particles"),
            "{said}"
        );
    }

    #[test]
    fn a_tolerance_is_a_part_of_one() {
        assert_eq!(tolerance("0.25"), Ok(0.25));
        for text in ["1", "-0.1", "10%", "nan", ""] {
            assert!(tolerance(text).is_err(), "{text}");
        }
    }
}
