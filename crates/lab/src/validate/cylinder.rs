//! Flow past a cylinder in a channel: `validation/cylinder`.

use super::prelude::*;

const TEXT: &str = include_str!("../../../../validation/cylinder/case.toml");
const REFERENCE: &str = include_str!("../../../../validation/cylinder/reference.csv");

pub(super) const CASE: Case = Case {
    name: "cylinder",
    question: "drag on a cylinder in a channel at Reynolds numbers of 20 and 100, and the frequency of its vortices",
    source: "Schaefer and Turek (1996), doi:10.1007/978-3-322-89849-4_39",
    parts: &[Part::quick(30.0, steady), Part::full(150.0, shedding)],
};

/// Of the drag at Reynolds numbers of 20 and 100, and of the Strouhal number.
const STEADY: f64 = 0.02;
const DRAG: f64 = 0.03;
const STROUHAL: f64 = 0.02;
const LIFT: f64 = 0.05;
const DIAMETER: f64 = 0.1;

/// Coefficients of drag and lift in the last step, at a mean velocity at the inlet (m/s).
fn coefficients(setup: &Setup, run: &Simulation, velocity: f64) -> [f64; 2] {
    let cylinder = setup.walls.iter().position(|wall| wall.name == "cylinder").expect("the case has one");
    let force = run.wall_loads()[cylinder].force;
    let unit = 0.5 * setup.fluid_density() * velocity * velocity * DIAMETER * setup.domain.size().z;
    [force.x / unit, force.y / unit]
}

/// Frequency of a course of times and values, and the times at which it first and last rises through the mean of its values, if it does so more
/// than once.
pub(super) fn frequency(course: impl Iterator<Item = [f64; 2]>) -> Option<(f64, [f64; 2])> {
    let course: Vec<[f64; 2]> = course.collect();
    let mean = course.iter().map(|row| row[1]).sum::<f64>() / course.len() as f64;
    let through = course.windows(2).filter(|pair| pair[0][1] < mean && pair[1][1] >= mean);
    let time = |[t, low]: [f64; 2], [end, high]: [f64; 2]| t + (end - t) * (mean - low) / (high - low);
    let rises: Vec<f64> = through.map(|pair| time(pair[0], pair[1])).collect();
    let [first, .., last] = rises[..] else { return None };
    Some(((rises.len() - 1) as f64 / (last - first), [first, last]))
}

fn steady(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let setup = context.setup(TEXT, CASE.name, &[])?;
    let mut run = Simulation::solo(&setup)?;
    let tenth = setup.plan.end_step / 10;
    run.advance(setup.plan.end_step - tenth)?;
    let before = coefficients(&setup, &run, 0.2)[0];
    run.advance(tenth)?;
    let drag = coefficients(&setup, &run, 0.2)[0];
    if (drag / before - 1.0).abs() > 0.1 * STEADY {
        return Err(unsteady("the drag on the cylinder changes by", drag / before - 1.0));
    }
    let reference = Table::new(REFERENCE).at("reynolds", 20.0, "drag");
    found.relative("Reynolds number 20: coefficient of drag (-)", drag, reference, STEADY);
    Ok(())
}

fn shedding(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let own = [
        "domain.faces.\"x-\".inlet.velocity={ table = [[0, 0, 0, 0], [0.2, 1.0, 0, 0]] }".to_string(),
        "lattice.relaxation_time=0.524".to_string(),
        "run.end.time=8".to_string(),
    ];
    let setup = context.setup(TEXT, CASE.name, &own)?;
    let mut run = Simulation::solo(&setup)?;
    // Six periods or more, and sixty samples or more of each.
    let from = setup.plan.end_step * 3 / 4;
    let every = ((5e-3 / setup.time_step) as u64).max(1);
    run.advance(from)?;
    let mut course = Vec::new();
    while run.steps_done() + every <= setup.plan.end_step {
        run.advance(every)?;
        let [drag, lift] = coefficients(&setup, &run, 1.0);
        course.push([run.steps_done() as f64 * setup.time_step, drag, lift]);
    }
    let Some((frequency, _)) = frequency(course.iter().map(|row| [row[0], row[2]])) else {
        let last = course[course.len() - 1][2];
        return Err(unsteady("no vortices leave the cylinder; its last lift is", last));
    };
    let drag = course.iter().map(|row| row[1]).fold(0.0, f64::max);
    let lift = course.iter().map(|row| row[2]).fold(0.0, f64::max);
    let table = Table::new(REFERENCE);
    let reference = |column: &str| table.at("reynolds", 100.0, column);
    found.relative("Reynolds number 100: largest coefficient of drag (-)", drag, reference("drag"), DRAG);
    let quantity = "Reynolds number 100: Strouhal number (-)";
    found.relative(quantity, frequency * DIAMETER, reference("strouhal"), STROUHAL);
    found.relative("Reynolds number 100: largest coefficient of lift (-)", lift, 1.0, LIFT);
    let axes = ["t (s)", "coefficient (-)"];
    let points = |column: usize| course.iter().map(move |row| [row[0], row[column]]);
    let curves = [measured("drag", points(1)), measured("lift", points(2))];
    found.plot("course", "Drag and lift at a Reynolds number of 100", axes, curves);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::frequency;

    #[test]
    fn the_frequency_of_a_swinging_course_is_found_from_whole_periods() {
        let course = |swing: f64| {
            (0..400).map(move |n| 0.01 * f64::from(n)).map(move |t| [t, 0.3 + swing * (9.0 * t).sin()])
        };
        let (found, [first, last]) = frequency(course(0.1)).unwrap();
        assert!((found * std::f64::consts::TAU / 9.0 - 1.0).abs() < 1e-3, "{found}");
        assert!(((last - first) * found - 5.0).abs() < 1e-9, "{first} {last}");
        assert_eq!(frequency(course(0.0)), None);
    }
}
