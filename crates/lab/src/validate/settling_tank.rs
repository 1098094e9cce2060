//! One sphere settling in a tank of oil: `validation/settling_tank`.

use super::prelude::*;

const TEXT: &str = include_str!("../../../../validation/settling_tank/case.toml");
const REFERENCE: &str = include_str!("../../../../validation/settling_tank/reference.csv");
const PATH: &str = include_str!("../../../../validation/settling_tank/trajectory_E1.csv");

pub(super) const CASE: Case = Case {
    name: "settling_tank",
    question: "velocity and path of a sphere that settles in a closed tank of oil",
    source: "ten Cate et al. (2002), doi:10.1063/1.1512918",
    parts: &[
        Part::quick(2.0, |context, found| fall(context, found, "E4", (8, 0.55), 0.05, 1)),
        Part::wide(68.0, |context, found| fall(context, found, "E1", (15, 0.8), 0.04, context.threads)),
        Part::wide(34.0, |context, found| fall(context, found, "E2", (15, 0.8), 0.03, context.threads)),
        Part::wide(26.0, |context, found| fall(context, found, "E3", (15, 0.65), 0.03, context.threads)),
        Part::wide(26.0, |context, found| fall(context, found, "E4", (15, 0.55), 0.03, context.threads)),
    ],
};

/// Largest way to the side (diameters).
const SIDEWAYS: f64 = 0.05;
/// Largest distance from the measured path of E1 (diameters), while the gap is above one diameter.
const OFF_PATH: f64 = 0.4;

/// Gaps (diameters) at which the velocity of E1 along the measured path is taken, and its tolerance.
const FALLING: std::ops::RangeInclusive<f64> = 3.0..=6.0;
const SLOPE: f64 = 0.03;
/// Gap to the floor (diameters) at which it ends: E4 is fastest a little above two.
const UNTIL: f64 = 0.9;

/// Runs one of the fluids with these cells per diameter and relaxation time; the tolerance is of the largest velocity.
fn fall(
    context: &SuiteContext,
    found: &mut Findings,
    oil: &str,
    (cells, relaxation_time): (u32, f64),
    tolerance: f64,
    threads: usize,
) -> Result<()> {
    let table = Table::new(REFERENCE);
    let [density, viscosity, fastest] = ["rho_f", "mu", "u_max"].map(|column| table.of("case", oil, column));
    let own = [
        format!("fluid.density={density}"),
        format!("fluid.viscosity={}", viscosity / density),
        format!("lattice.cells_per_diameter={cells}"),
        format!("lattice.relaxation_time={relaxation_time}"),
    ];
    let setup = context.setup(TEXT, CASE.name, &own)?;
    let course = sphere_course(context, &setup, threads, UNTIL)?;
    let largest = course.iter().map(|at| -at[2]).fold(f64::NEG_INFINITY, f64::max);
    let aside = course.iter().map(|at| at[3]).fold(0.0, f64::max);
    let title = format!("{oil}, N = {cells}, tau = {}", setup.expect_fluid().relaxation_time);
    let quantity = format!("largest velocity, {title} (m/s)");
    found.relative(quantity, largest, fastest, tolerance);
    let quantity = format!("way to the side, {title} (D)");
    found.absolute(quantity, aside, 0.0, SIDEWAYS).source("symmetry");
    if oil == "E1" {
        let path = Table::new(PATH).points(Some("h_over_d"), ["t_s", "value"]);
        let quantity = format!("furthest from the measured path, {title} (D)");
        found.absolute(quantity, off_path(&course, &path), 0.0, OFF_PATH);
        let fallen = |at: &&[f64; 2]| FALLING.contains(&at[1]);
        let there: Vec<[f64; 2]> = path.iter().filter(fallen).copied().collect();
        let here: Vec<[f64; 2]> = there.iter().map(|at| [at[0], interpolated(&course, at[0])]).collect();
        let quantity = format!("velocity over the measured path at gaps of 6 to 3 D, {title} (m/s)");
        let [here, there] = [here, there].map(|points| -slope(&points) * setup.diameter);
        found.relative(quantity, here, there, SLOPE);
        let own = course.iter().step_by(50).map(|at| [at[0], at[1]]);
        found.plot(
            format!("path_{oil}"),
            "Gap between a sphere and the floor of the tank, experiment E1",
            ["time (s)", "gap over diameter (-)"],
            [reference("ten Cate et al. (2002)", path), measured("measured", own)],
        );
    }
    let end = course.last().map_or(0.0, |at| at[0]);
    found.plot(
        format!("velocity_{oil}_{cells}"),
        format!("Velocity of a sphere in the tank, {title}"),
        ["time (s)", "velocity (m/s)"],
        [
            reference("largest velocity measured", [[0.0, fastest], [end, fastest]]),
            measured("measured", course.iter().step_by(20).map(|at| [at[0], -at[2]])),
        ],
    );
    Ok(())
}

/// Largest distance (diameters) from the points of a path with the gap above one diameter; all must have been reached.
fn off_path(course: &[[f64; 4]], path: &[[f64; 2]]) -> f64 {
    let off =
        path.iter().filter(|at| at[1] > 1.0).map(|&[time, gap]| (interpolated(course, time) - gap).abs());
    // NaN, of a point that was not reached, stays NaN.
    off.fold(0.0, |worst, off| if off <= worst { worst } else { off })
}

/// Slope of the line through points by least squares.
pub(super) fn slope(points: &[[f64; 2]]) -> f64 {
    let count = points.len() as f64;
    let mean = |axis: usize| points.iter().map(|at| at[axis]).sum::<f64>() / count;
    let [x, y] = [mean(0), mean(1)];
    let square: f64 = points.iter().map(|at| (at[0] - x).powi(2)).sum();
    points.iter().map(|at| (at[0] - x) * (at[1] - y)).sum::<f64>() / square
}
