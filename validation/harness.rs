//! Checks that are computed row by row, from lists of values: shared by drag and lubrication.
//!
//! ```text
//! cargo test --release --test NAME -- all            every line of rows.txt; writes result.csv beside it, or to OUT
//! cargo test --release --test NAME -- key=a,b ...    the combinations of these lists; prints them
//! ```

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;
use turbid_lab::checks::{Check, Ending, Findings, Outcome, Score, all, csv, summary, table};

/// One value for each key.
#[derive(Clone)]
pub(super) struct Pick(BTreeMap<String, String>);

impl Pick {
    /// The value of a key as it is written.
    pub(super) fn word(&self, key: &str) -> &str {
        &self.0[key]
    }

    /// The value of a key as a number.
    pub(super) fn real(&self, key: &str) -> f64 {
        self.word(key).parse().expect("a number")
    }

    /// The value of a key as a whole number.
    pub(super) fn whole(&self, key: &str) -> u64 {
        self.word(key).parse().expect("a whole number")
    }

    /// The values of these keys, `tau 0.53, n 12`.
    pub(super) fn named(&self, keys: &[&str]) -> String {
        keys.iter().map(|key| format!("{key} {}", self.word(key))).collect::<Vec<_>>().join(", ")
    }
}

/// All combinations of the lists `key=a,b,...` of a line, the last key fastest; a key that it lacks has its default.
fn combinations(line: &str, defaults: &[(&str, &str)]) -> Vec<Pick> {
    let given: BTreeMap<&str, &str> =
        line.split_whitespace().map(|list| list.split_once('=').expect("key=a,b,...")).collect();
    assert!(given.keys().all(|key| defaults.iter().any(|(known, _)| known == key)), "{line}");
    let mut picks = vec![BTreeMap::new()];
    for (key, default) in defaults {
        let list = given.get(key).unwrap_or(default);
        let with = |pick: &BTreeMap<String, String>, value: &str| {
            let mut pick = pick.clone();
            pick.insert((*key).to_string(), value.to_string());
            pick
        };
        picks = picks.iter().flat_map(|pick| list.split(',').map(move |value| with(pick, value))).collect();
    }
    picks.into_iter().map(Pick).collect()
}

/// Computes the rows that the command line asks for on all cores; `last` sees all checks together.
pub(super) fn main(
    name: &str,
    question: &str,
    rows: &str,
    defaults: &[(&str, &str)],
    row: impl Fn(&Pick) -> Vec<Check> + Sync,
    last: impl FnOnce(&mut [(Pick, Vec<Check>)]),
) -> ExitCode {
    let given: Vec<String> =
        std::env::args().skip(1).filter(|word| word == "all" || word.contains('=')).collect();
    if given.is_empty() {
        return ExitCode::SUCCESS;
    }
    let whole = given == ["all"];
    let lines = if whole { rows.to_string() } else { given.join(" ") };
    let lines = lines.lines().filter(|line| !line.starts_with('#'));
    let picks: Vec<Pick> = lines.flat_map(|line| combinations(line, defaults)).collect();
    let (start, next, found) = (Instant::now(), AtomicUsize::new(0), Mutex::new(BTreeMap::new()));
    std::thread::scope(|scope| {
        for _ in 0..std::thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(|| {
                while let Some((at, pick)) =
                    (Some(next.fetch_add(1, Ordering::Relaxed))).and_then(|at| Some((at, picks.get(at)?)))
                {
                    let checks = row(pick);
                    found.lock().unwrap().insert(at, (pick.clone(), checks));
                }
            });
        }
    });
    let mut found: Vec<(Pick, Vec<Check>)> = found.into_inner().unwrap().into_values().collect();
    last(&mut found);
    let checks = found.into_iter().flat_map(|(_, checks)| checks).collect();
    let ending = Ending::Found(Findings { checks, ..Findings::default() });
    let outcome = Outcome::new(name, question, None, start.elapsed().as_secs_f64(), ending);
    println!("{}", table(&outcome, false));
    let outcomes = [outcome];
    if whole {
        let here = concat!(env!("CARGO_MANIFEST_DIR"), "/../../validation/");
        let out =
            std::env::var_os("OUT").map_or_else(|| PathBuf::from(format!("{here}{name}")), PathBuf::from);
        std::fs::write(out.join("result.csv"), csv(&all(&outcomes)))
            .expect("a folder that can be written to");
    }
    println!("{}", summary(&outcomes, start.elapsed().as_secs_f64()));
    if Score::of(&outcomes).is_full() { ExitCode::SUCCESS } else { ExitCode::from(3) }
}

/// A number without a tolerance; NaN for a reference where there is none.
pub(super) fn reported(quantity: String, measured: f64, reference: f64, source: &str) -> Check {
    Check { pass: true, ..Check::new(quantity, measured, reference, f64::INFINITY, source) }
}

/// A random number in (0, 1) of a fixed sequence.
pub(super) fn random(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*seed >> 11) as f64 / (1_u64 << 53) as f64
}
