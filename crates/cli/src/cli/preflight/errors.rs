//! Errors that tables of `validation/` let expect of a case: `validation/errors.csv`, which `docs/limits.md` shows whole.

use crate::cli::terminal::{Row, row};
use serde::Deserialize;
use std::collections::BTreeMap;
use turbid::case::{FluidSetup, Setup};
use turbid::shape::Shape;

const TABLE: &str = include_str!("../../../../../validation/errors.csv");

/// A row of the table: the errors (%) of a quantity of a kind of body from a number of cells per diameter on.
#[derive(Deserialize)]
struct Entry {
    coupling: String,
    quantity: String,
    body: String,
    cells: f64,
    tau_least: f64,
    tau_most: f64,
    precision: String,
    least: f64,
    most: f64,
    source: String,
}

/// Kind of a body in the table.
fn kind(shape: &dyn Shape) -> &'static str {
    if shape.as_sphere().is_some() {
        "sphere"
    } else if !shape.parts().is_empty() {
        "composite"
    } else if shape.as_ellipsoid().is_some() {
        "spheroid"
    } else {
        "edges"
    }
}

/// The entries for bodies of a kind that are this many cells across: of each quantity that with the most cells.
fn entries(setup: &Setup, fluid: &FluidSetup, body: &str, cells: f64) -> Vec<Entry> {
    let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(TABLE.as_bytes());
    let (tau, precision) = (fluid.relaxation_time, setup.plan.precision.name());
    let fits = |entry: &Entry| {
        fluid.collision == fluid.coupling.usual_collision()
            && entry.coupling == fluid.coupling.name()
            && (entry.body == body || entry.body == "any")
            && (entry.precision == precision || entry.precision == "any")
            // Sizes of boxes are whole numbers of cells.
            && entry.cells <= 1.03 * cells
            && (entry.tau_least..=entry.tau_most).contains(&tau)
    };
    let mut best: BTreeMap<(String, String), Entry> = BTreeMap::new();
    for entry in reader.deserialize().map(|entry| entry.expect("a row of the table")).filter(fits) {
        let key = (entry.quantity.clone(), entry.precision.clone());
        if best.get(&key).is_none_or(|known| known.cells < entry.cells) {
            best.insert(key, entry);
        }
    }
    best.into_values().collect()
}

/// A row for each kind of body that the case has, by its smallest.
pub(super) fn rows(setup: &Setup, fluid: &FluidSetup) -> Vec<Row> {
    let mut smallest: BTreeMap<&str, f64> = BTreeMap::new();
    for (template, _) in setup.expected_counts() {
        let shape = &*setup.templates[template].shape;
        let cells = shape.equivalent_diameter() / setup.domain.dx;
        let least = smallest.entry(kind(shape)).or_insert(f64::INFINITY);
        *least = least.min(cells);
    }
    let lubricated = setup.contact.as_ref().is_some_and(|contact| contact.lubrication.is_some());
    let one = |(body, cells): (&str, f64)| {
        let mut said = Vec::new();
        for Entry { quantity, precision, least, most, source, .. } in entries(setup, fluid, body, cells) {
            let what = match quantity.as_str() {
                "gap" if lubricated => "force in gaps of 1 to 0.1 cells",
                "gap_lattice" if !lubricated => "force in gaps of 1 to 0.1 cells",
                "gap" | "gap_lattice" => continue,
                "dense" if setup.volume_fraction < 0.3 => continue,
                "dense" => "drag in dense arrays",
                other => other,
            };
            let rounded = if precision == "any" { String::new() } else { format!(" more by {precision}") };
            said.push(format!("{what} {least:+} to {most:+} %{rounded} ({source})"));
        }
        let name = if body == "edges" { "bodies with edges" } else { body };
        let (tau, value) = (fluid.relaxation_time, format!("{name}, {cells:.1} cells"));
        row(
            "expected error",
            value,
            if said.is_empty() {
                format!(
                    "not known for so few cells, the relaxation time {tau:.3} or this collision (docs/limits.md)"
                )
            } else {
                format!("{}; of docs/limits.md", said.join(", "))
            },
        )
    };
    smallest.into_iter().map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use turbid::case::from_text;

    fn said(cells: f64) -> String {
        let text = format!(
            "domain.size = [4e-3, 4e-3, 4e-3]\n\
             fluid = {{ density = 1000, viscosity = 1e-6 }}\n\
             lattice = {{ cells_per_diameter = {cells}, relaxation_time = 0.6 }}\n\
             driving.gravity = 9.81\n\
             run.end.steps = 100\n\
             [[particles]]\n\
             shape.sphere.diameter = 1e-3\n\
             density = 1100.0\n\
             list = [[1e-3, 1e-3, 1e-3]]\n"
        );
        let setup = from_text(&text, "errors.toml", &[]).unwrap();
        rows(&setup, setup.expect_fluid())[0].join(" ")
    }

    #[test]
    fn the_error_said_is_that_of_the_largest_number_of_cells_that_the_case_has() {
        let [coarse, fine] = [10.0, 15.0].map(said);
        assert!(coarse.contains("drag -0.1 to +0.9 %") && !coarse.contains("torque"), "{coarse}");
        assert!(fine.contains("drag +0.1 to +0.6 %") && fine.contains("torque"), "{fine}");
    }

    #[test]
    fn what_the_table_does_not_have_is_not_made_up() {
        assert!(said(5.0).contains("not known for so few cells"));
    }
}
