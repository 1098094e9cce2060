//! Columns of grains that collapse: `validation/column_collapse`.

use super::heap::{Column, Heap};
use super::prelude::*;

const TEXT: &str = include_str!("../../../../validation/column_collapse/case.toml");
const REFERENCE: &str = include_str!("../../../../validation/column_collapse/reference.csv");

pub(super) const CASE: Case = Case {
    name: "column_collapse",
    question: "run-out and height of columns of grains that collapse, height over length 0.6 to 4",
    source: LUBE,
    parts: &[
        Part::quick(30.0, |context, found| collapse(context, 1.0, SMALL, found)),
        Part::full(100.0, |context, found| collapse(context, 0.6, LARGE, found)),
        Part::full(100.0, |context, found| collapse(context, 1.0, LARGE, found)),
        Part::full(120.0, |context, found| collapse(context, 2.0, LARGE, found)),
        Part::full(140.0, |context, found| collapse(context, 4.0, LARGE, found)),
        Part::full(100.0, round),
    ],
};

const LUBE: &str = "Lube, Huppert, Sparks and Freundt (2005), doi:10.1103/PhysRevE.72.041301";
/// Numbers of grains.
const SMALL: u32 = 1200;
const LARGE: u32 = 2000;
/// Of the run-out, as a part: between the two laboratories.
const RUN_OUT: f64 = 0.17;
/// Of the height, as a part.
const HEIGHT: f64 = 0.15;

/// Numbers of the law that holds for this aspect ratio (-): run-out and height over the length of the column.
fn law(aspect: f64) -> [f64; 2] {
    let table = Table::new(REFERENCE);
    ["run_out", "height"].map(|quantity| {
        let rows = table.points(Some(quantity), ["above", "factor"]);
        let powers = table.points(Some(quantity), ["above", "power"]);
        let row = rows.iter().rposition(|row| row[0] <= aspect).expect("a law from 0 on");
        rows[row][1] * aspect.powf(powers[row][1])
    })
}

/// The heap that a column leaves, after these changes to the case.
fn heap(context: &SuiteContext, aspect: f64, grains: u32, own: &[String]) -> Result<Heap> {
    let sizes =
        Column { diameter: 2e-3, grains, aspect, box_length: 0.0, spacing: 1.06, turned: false, start: 0 };
    let mut column = sizes;
    column.box_length = column.length() * (2.0 + 2.0 * law(aspect)[0]) + 20.0;
    // The gate is gone after 0.45 s (s); then five times the fall of the column, sqrt(2 H / g) with H in grains of 2 mm.
    let time = 0.45 + 0.07 * (aspect * column.length()).sqrt();
    let mut changes = column.with_gate();
    changes.push(format!("run.end.time={time}"));
    changes.extend_from_slice(own);
    column.heap(context, &context.setup(TEXT, CASE.name, &changes)?)
}

fn collapse(context: &SuiteContext, aspect: f64, grains: u32, found: &mut Findings) -> Result<()> {
    let heap = heap(context, aspect, grains, &[])?;
    let [run_out, height] = law(aspect);
    let column = format!("column {aspect} times as high as long, {grains} grains");
    found.relative(format!("run-out over the length, {column} (-)"), heap.run_out(), run_out, RUN_OUT);
    found.relative(format!("height over the length, {column} (-)"), heap.height(), height, HEIGHT);
    found.note(format!("{column}: slope (degrees)"), heap.slope());
    found.note(format!("{column}: largest speed at the end (m/s)"), heap.fastest());
    if grains == LARGE {
        found.plot(
            format!("heap_{aspect}"),
            format!("Column {aspect} times as high as long, after its collapse"),
            ["distance from the wall (diameters)", "height (diameters)"],
            [measured("surface", heap.surface())],
        );
    }
    Ok(())
}

/// Spheres that roll freely, for comparison.
fn round(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let heap = heap(context, 1.0, LARGE, &["contact.rolling_friction=0.0".to_string()])?;
    found.note(
        "spheres that roll freely, column as high as long: run-out over the length (-)",
        heap.run_out(),
    );
    found.note("spheres that roll freely, column as high as long: height over the length (-)", heap.height());
    found.note("spheres that roll freely, column as high as long: slope (degrees)", heap.slope());
    Ok(())
}
