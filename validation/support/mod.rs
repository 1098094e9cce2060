//! What the cases share: their files, the comparison, and an engine that tells what it was given.

#![allow(clippy::print_stdout)]

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use turbid::Result;
use turbid::case::{self, Setup};
use turbid::comm::Comm;
use turbid::dem::{Ballistic, ContactState, ContactSummary, DemEngine, Load};
use turbid::domain::Decomposition;
use turbid::particle::ParticleStore;
use turbid::shape::Shape;

pub(crate) fn folder(case: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("validation")
        .join(case)
}

/// The case of a folder with some keys changed, and the only block it is computed on.
pub(crate) fn setup(case: &str, changes: &[String]) -> (Setup, Decomposition) {
    setup_of(case, "case", changes)
}

/// The same of a folder with several cases, by name.
///
/// What the variable `TURBID_SET` holds, options as of `--set` between semicolons, is changed last: the same validation for another
/// coupling, for instance.
pub(crate) fn setup_of(case: &str, name: &str, changes: &[String]) -> (Setup, Decomposition) {
    let path = folder(case).join(name).with_extension("toml");
    let mut changes = changes.to_vec();
    if let Ok(more) = std::env::var("TURBID_SET") {
        changes.extend(more.split(';').map(str::to_owned));
    }
    let setup = case::load(&path, &changes).unwrap_or_else(|e| panic!("{e}"));
    for warning in &setup.warnings {
        println!("{case}: {warning}");
    }
    let decomposition = Decomposition::new(setup.domain, 1).expect("one block always fits");
    (setup, decomposition)
}

/// The number in column `value` of `reference.csv`, in the row where `key` is `at`.
pub(crate) fn reference(case: &str, key: &str, at: f64, value: &str) -> f64 {
    let path = folder(case).join("reference.csv");
    let mut reader = csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .from_path(&path)
        .unwrap();
    let header = reader.headers().unwrap().clone();
    let column = |name: &str| {
        header
            .iter()
            .position(|h| h == name)
            .unwrap_or_else(|| panic!("no column {name}"))
    };
    let (key, value) = (column(key), column(value));
    let number = |text: &str| -> f64 { text.parse().unwrap() };
    let row = reader
        .records()
        .map(std::result::Result::unwrap)
        .find(|row| (number(&row[key]) - at).abs() < 1e-9)
        .unwrap_or_else(|| panic!("no row for {at} in {}", path.display()));
    number(&row[value])
}

/// Prints measured value, reference, deviation and tolerance, and fails beyond the tolerance (relative).
pub(crate) fn compare(what: &str, measured: f64, reference: f64, tolerance: f64) {
    let deviation = measured / reference - 1.0;
    println!(
        "{what}: measured {measured:.5}, reference {reference:.5}, deviation {:+.2} %, tolerance {:.2} %",
        100.0 * deviation,
        100.0 * tolerance
    );
    assert!(
        deviation.abs() <= tolerance,
        "{what}: {measured} differs from {reference} by {:+.2} %, more than {:.2} %",
        100.0 * deviation,
        100.0 * tolerance
    );
}

/// Prints a number that belongs to the result but has no reference.
pub(crate) fn note(what: &str, value: f64) {
    println!("{what}: {value:.6}");
}

/// A ballistic engine whose last load on its first particle can be read while a simulation owns it.
pub(crate) struct Held {
    engine: Ballistic,
    load: Arc<Mutex<Load>>,
}

impl Held {
    /// The particles of a case, held where they are; and where to read the load.
    pub(crate) fn new(setup: &Setup, decomposition: &Decomposition) -> (Box<Self>, Arc<Mutex<Load>>) {
        let load = Arc::new(Mutex::new(Load::default()));
        let templates = setup.templates.clone();
        let engine = Ballistic::new(decomposition.clone(), 0, templates, &setup.particles);
        let held = Self {
            engine,
            load: Arc::clone(&load),
        };
        (Box::new(held), load)
    }
}

impl DemEngine for Held {
    fn name(&self) -> &'static str {
        self.engine.name()
    }

    fn supports(&self, shape: &dyn Shape) -> bool {
        self.engine.supports(shape)
    }

    fn particles(&self) -> &ParticleStore {
        self.engine.particles()
    }

    fn advance(&mut self, comm: &Comm, loads: &[Load], dt: f64) -> Result<()> {
        *self.load.lock().unwrap() = loads[0];
        self.engine.advance(comm, loads, dt)
    }

    fn contact_states(&self) -> Vec<ContactState> {
        Vec::new()
    }

    fn save(&self) -> Result<Vec<u8>> {
        self.engine.save()
    }

    fn restore(&mut self, comm: &Comm, parts: &[Vec<u8>]) -> Result<()> {
        self.engine.restore(comm, parts)?;
        *self.load.lock().unwrap() = self.engine.last_loads().first().copied().unwrap_or_default();
        Ok(())
    }

    fn contacts(&self) -> ContactSummary {
        self.engine.contacts()
    }
}
