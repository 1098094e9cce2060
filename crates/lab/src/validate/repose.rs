//! Angle of repose of spheres, cubes and stones: `validation/repose`.

use super::heap::{Column, Heap};
use super::prelude::*;
use turbid::engine::HAS_LIGGGHTS;

const TEXT: &str = include_str!("../../../../validation/repose/case.toml");
const RELEASED: &str = include_str!("../../../../validation/repose/released.toml");
const REFERENCE: &str = include_str!("../../../../validation/repose/reference.csv");
const STONE: &str = include_str!("../../../../cases/stone.stl");

pub(super) const CASE: Case = Case {
    name: "repose",
    question: "angle of repose of spheres with and without rolling resistance, of cubes and of stones; spheres against LIGGGHTS",
    source: KLEINHANS,
    parts: if HAS_LIGGGHTS {
        &[QUICK, ROUND, ROUGH, CUBES, STONES, Part::full(120.0, engines)]
    } else {
        &[QUICK, ROUND, ROUGH, CUBES, STONES]
    },
};

const QUICK: Part = Part::quick(15.0, |context, found| spheres(context, (FEW, 0.0), found));
const ROUND: Part = Part::full(240.0, |context, found| spheres(context, (MANY, 0.0), found));
const ROUGH: Part = Part::full(240.0, |context, found| spheres(context, (MANY, ROLLING), found));
const CUBES: Part = Part::full(180.0, cubes);
const STONES: Part = Part::full(270.0, stones);

const KLEINHANS: &str = "Kleinhans et al. (2011), doi:10.1029/2011JE003865";
/// Starts at other positions and orientations, over which angles are means.
const STARTS: u32 = 3;
/// Numbers of grains.
const FEW: u32 = 250;
const MANY: u32 = 2000;
const CUBES_COUNT: u32 = 600;
const STONES_COUNT: u32 = 400;
/// Of the column that both engines let fall.
const RELEASED_COUNT: u32 = 500;
/// Coefficient of rolling friction of grains that are not quite round (-).
const ROLLING: f64 = 0.3;
/// Between both engines: of the slope (degrees), and of run-out and height over the length (-). Collapses are chaotic.
const ENGINES: [f64; 2] = [1.5, 0.1];

const SPHERES: Column = Column {
    diameter: 2e-3,
    grains: MANY,
    aspect: 0.8,
    box_length: 0.0,
    spacing: 1.06,
    turned: false,
    start: 0,
};

/// Checks the mean slope of all starts against a row of the reference, and plots the heaps under a name.
fn check(found: &mut Findings, what: &str, heaps: &[Heap], (name, row): (&str, &str)) {
    let table = Table::new(REFERENCE);
    let source = table.word("grains", row, "source");
    let quantity = format!("angle of repose of {what}, mean of {STARTS} starts (degrees)");
    let slopes: Vec<f64> = heaps.iter().map(Heap::slope).collect();
    let [low, high] = [f64::min, f64::max].map(|of| slopes.iter().copied().fold(f64::NAN, of));
    let mean = slopes.iter().sum::<f64>() / slopes.len() as f64;
    let (angle, tolerance) = (table.of("grains", row, "angle"), table.of("grains", row, "tolerance"));
    found.absolute(quantity, mean, angle, tolerance).source(&source);
    found.note(format!("{what}: largest less smallest angle of the starts (degrees)"), high - low);
    let fastest = heaps.iter().map(Heap::fastest).fold(0.0, f64::max);
    found.note(format!("{what}: largest speed at the end (m/s)"), fastest);
    found.plot(
        format!("heap_of_{name}"),
        format!("Heap of {what}"),
        ["distance from the wall (diameters)", "height (diameters)"],
        heaps.iter().zip(1..).map(|(heap, start)| measured(format!("start {start}"), heap.surface())),
    );
}

/// The heaps behind a gate that is drawn away slowly, of all starts.
fn heaps(context: &SuiteContext, column: Column, own: &[String]) -> Result<Vec<Heap>> {
    let of = |start| {
        let column = Column { box_length: 3.0 * column.length() + 5.0, start, ..column };
        let mut changes = column.with_gate();
        changes.extend_from_slice(own);
        column.heap(context, &context.setup(TEXT, CASE.name, &changes)?)
    };
    (0..STARTS).map(of).collect()
}

fn spheres(context: &SuiteContext, (grains, rolling): (u32, f64), found: &mut Findings) -> Result<()> {
    let own = [format!("contact.rolling_friction={rolling:?}")];
    let heaps = heaps(context, Column { grains, ..SPHERES }, &own)?;
    let (what, rows) = if rolling > 0.0 {
        ("with", ("rolling_spheres", "rounded"))
    } else {
        ("without", ("spheres", "glass_beads"))
    };
    check(found, &format!("{grains} spheres {what} rolling resistance"), &heaps, rows);
    Ok(())
}

/// Changes for bodies with edges, which resist rolling by themselves.
fn faceted(shape: &str) -> [String; 2] {
    [format!("particles.0.shape={shape}"), "contact.pairs.0.rolling_friction=0.0".to_string()]
}

fn cubes(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let column = Column { grains: CUBES_COUNT, spacing: 1.45, turned: true, ..SPHERES };
    let edge = column.diameter * (std::f64::consts::PI / 6.0).cbrt();
    let heaps = heaps(context, column, &faceted(&format!("{{ cube = {{ edge = {edge:e} }} }}")))?;
    check(found, &format!("{CUBES_COUNT} cubes"), &heaps, ("cubes", "angular"));
    Ok(())
}

fn stones(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let column = Column { grains: STONES_COUNT, spacing: 1.45, turned: true, ..SPHERES };
    let shape = format!(
        "{{ polyhedron = {{ vertices = {}, equivalent_diameter = {:e} }} }}",
        vertices(),
        column.diameter
    );
    let heaps = heaps(context, column, &faceted(&shape))?;
    check(found, &format!("{STONES_COUNT} stones"), &heaps, ("stones", "rounded"));
    Ok(())
}

/// Corners of the stone, each once.
fn vertices() -> String {
    let mut corners: Vec<String> = STONE
        .lines()
        .filter_map(|line| line.trim().strip_prefix("vertex "))
        .map(|line| format!("[{}]", line.split_whitespace().collect::<Vec<_>>().join(", ")))
        .collect();
    corners.sort();
    corners.dedup();
    format!("[{}]", corners.join(", "))
}

/// A loose column that falls and spreads, with both engines.
fn engines(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let few = Column { grains: RELEASED_COUNT, ..SPHERES };
    let column = Column { box_length: 4.0 * few.length() + 10.0, ..few };
    for rolling in [0.0, ROLLING] {
        let mut changes = column.released();
        changes.push(format!("contact.rolling_friction={rolling:?}"));
        let native = column.heap(context, &context.setup(RELEASED, CASE.name, &changes)?)?;
        changes.push("dem.engine=\"liggghts\"".to_string());
        let other = column.heap(context, &context.setup(RELEASED, CASE.name, &changes)?)?;
        let what = format!("collapse of {RELEASED_COUNT} spheres, rolling friction {rolling}");
        let [slope, length] = ENGINES;
        for (quantity, own, other, tolerance) in [
            ("slope (degrees)", native.slope(), other.slope(), slope),
            ("run-out over the length (-)", native.run_out(), other.run_out(), length),
            ("height over the length (-)", native.height(), other.height(), length),
        ] {
            found
                .absolute(format!("{what}: {quantity}, native and LIGGGHTS"), own, other, tolerance)
                .source(LIGGGHTS);
        }
    }
    Ok(())
}

const LIGGGHTS: &str = "LIGGGHTS 3.8.0: Kloss et al. (2012), doi:10.1504/PCFD.2012.047457";
