//! A bed of spheres that a flow from an inlet to an outlet fluidises: `validation/fluidised_bed`.

use super::prelude::*;
use serde::{Deserialize, Serialize};

const TEXT: &str = include_str!("../../../../validation/fluidised_bed/case.toml");

pub(super) const CASE: Case = Case {
    name: "fluidised_bed",
    question: "pressure drop and expansion of a fluidised bed of spheres, and the mass of its fluid over 1e5 steps",
    source: "weight less buoyancy of the bed, exact",
    parts: &[Part::quick(12.0, drop_of_pressure), Part::full(300.0, expansion)],
};

/// Of the pressure drop over the weight of the bed.
const DROP: f64 = 0.02;
/// Of the height of the bed over that by its own exponent.
const HEIGHT: f64 = 0.05;
/// Of the mean density of the fluid over the reference, from the first half of the run to its end.
const DENSITY: f64 = 1e-5;
/// Steps between two looks.
const EVERY: u64 = 50;
/// Velocities at the inlet (m/s), steps of each, and those after which the bed is steady. The last one is the first one again.
const VELOCITIES: [f64; 4] = [0.012, 0.0075, 0.0045, 0.012];
const STEPS: [u64; 4] = [30_000, 25_000, 20_000, 25_000];
const UNSTEADY: u64 = 10_000;

/// A look at the bed.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
struct Look {
    /// Height (m), twice that of the mean centre.
    height: f64,
    /// Pressure drop times area over the weight less buoyancy of the bed.
    drop: f64,
    /// Mean density of the fluid over the reference less 1, and what the weight of the spheres gives it by the pressure.
    excess: f64,
    of_weight: f64,
}

impl Look {
    fn at(run: &Simulation, setup: &Setup) -> Self {
        let (units, size) = (setup.units(), setup.domain.size());
        let particles = run.particles();
        let weight = -setup.submerged_weight().z;
        let height = 2.0 * particles.iter().map(|p| p.position().z).sum::<f64>() / particles.len() as f64;
        let wall = |name: &str| setup.walls.iter().position(|wall| wall.name == name).expect("a closed face");
        let loads = run.wall_loads();
        let [below, above] = ["z-", "z+"].map(|name| loads[wall(name)].force.z);
        let fluid = run.fluid().expect("the case has one");
        let excess = run.block().cells().map(|cell| fluid.moments(cell).0 - 1.0).sum::<f64>();
        let volume = size.product() * units.pressure();
        Self {
            height,
            drop: -(below + above) / weight,
            excess: excess / setup.domain.cell_count() as f64,
            of_weight: weight * 0.5 * height / volume,
        }
    }

    /// Means of many.
    fn mean(of: &[Self]) -> Self {
        let mean = |value: fn(&Self) -> f64| of.iter().map(value).sum::<f64>() / of.len() as f64;
        Self {
            height: mean(|look| look.height),
            drop: mean(|look| look.drop),
            excess: mean(|look| look.excess),
            of_weight: mean(|look| look.of_weight),
        }
    }
}

/// The pressure drop while the bed still expands.
fn drop_of_pressure(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let setup = context.setup(TEXT, CASE.name, &[])?;
    let mut run = Simulation::solo(&setup)?;
    run.advance(2000)?;
    let mut looks = Vec::new();
    while run.steps_done() < 5000 {
        run.advance(EVERY)?;
        looks.push(Look::at(&run, &setup));
    }
    found.relative(
        "pressure drop times area over the weight of the bed (-)",
        Look::mean(&looks).drop,
        1.0,
        DROP,
    );
    Ok(())
}

/// Least-squares line through points: its value at 0 and its slope.
fn line(points: &[[f64; 2]]) -> [f64; 2] {
    let n = points.len() as f64;
    let mean = [0, 1].map(|i| points.iter().map(|point| point[i]).sum::<f64>() / n);
    let sum = |i: usize| points.iter().map(|p| (p[0] - mean[0]) * (p[i] - mean[i])).sum::<f64>();
    let slope = sum(1) / sum(0);
    [mean[1] - slope * mean[0], slope]
}

fn expansion(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let plain = context.setup(TEXT, CASE.name, &[])?;
    let (mut rows, mut end) = (Vec::new(), 0);
    for (velocity, steps) in VELOCITIES.into_iter().zip(STEPS) {
        rows.push(format!("[{:e}, 0, 0, {velocity}]", (end as f64 + 0.25) * plain.time_step));
        end += steps;
        rows.push(format!("[{:e}, 0, 0, {velocity}]", (end as f64 - 0.25) * plain.time_step));
    }
    let own = [
        format!("domain.faces.\"z-\".inlet.velocity={{ table = [{}] }}", rows.join(", ")),
        format!("run.end.steps={end}"),
    ];
    let setup = context.setup(TEXT, CASE.name, &own)?;
    let watch = Watch { context, setup: &setup, threads: 1, every: EVERY };
    let looks: Vec<Look> = watch.rows(|run, rows: &mut Vec<Look>| {
        let setup = setup.clone();
        rows.push(run.on_root(move |run| Ok(Look::at(run, &setup)))?);
        Ok(false)
    })?;
    let area = setup.domain.size().xy().product();
    let solid = setup.particles.len() as f64 * setup.templates[0].shape.volume();
    let (mut first, mut means) = (0, Vec::new());
    for steps in STEPS {
        let last = first + steps;
        let steady = &looks[((first + UNSTEADY) / EVERY) as usize..(last / EVERY) as usize];
        means.push(Look::mean(steady));
        first = last;
    }
    let voids: Vec<f64> = means.iter().map(|mean| 1.0 - solid / (area * mean.height)).collect();
    let points: Vec<[f64; 2]> = (0..3).map(|n| [voids[n].ln(), VELOCITIES[n].ln()]).collect();
    let [offset, exponent] = line(&points);
    found.note("exponent of Richardson and Zaki of the bed (-)", exponent);
    found.note("velocity of a single sphere by it (m/s)", offset.exp());
    for n in 0..3 {
        let velocity = VELOCITIES[n];
        let quantity = format!("{velocity} m/s: pressure drop times area over the weight of the bed (-)");
        found.relative(quantity, means[n].drop, 1.0, DROP);
        let expected = solid / (area * (1.0 - ((velocity.ln() - offset) / exponent).exp()));
        let quantity = format!("{velocity} m/s: height of the bed over its diameter (-)");
        let (height, expected) = (means[n].height / setup.diameter, expected / setup.diameter);
        found.relative(quantity, height, expected, HEIGHT).source(
            "Richardson and Zaki (1954), Trans. Inst. Chem. Eng. 32, 35, with the exponent of the bed",
        );
        found.note(format!("{velocity} m/s: void fraction (-)"), voids[n]);
    }
    let [before, after] = [means[0], means[3]].map(|mean| mean.excess - mean.of_weight);
    found.note("mean density over the reference less 1, first velocity (-)", means[0].excess);
    found.note("of it by the weight of the spheres (-)", means[0].of_weight);
    let quantity =
        "mean density less what the weight of the spheres gives it, its change to the end of 1e5 steps (-)";
    found.absolute(quantity, after - before, 0.0, DENSITY).source("conservation of mass");
    let course = looks.iter().enumerate().step_by(20);
    let course = course.map(|(n, look)| [(n as u64 * EVERY) as f64, look.height / setup.diameter]);
    let axes = ["step (-)", "height over diameter (-)"];
    found.plot("height", "Height of a fluidised bed", axes, [measured("measured", course)]);
    Ok(())
}
