//! Flow through a random bed of fixed spheres from an inlet to an outlet: `validation/packed_bed`.

use super::prelude::*;

const TEXT: &str = include_str!("../../../../validation/packed_bed/case.toml");

pub(super) const CASE: Case = Case {
    name: "packed_bed",
    question: "pressure drop of a random packed bed of spheres between an inlet and an outlet",
    source: "Ergun (1952), Chem. Eng. Prog. 48, 89",
    parts: &[Part::full(300.0, creeping), Part::full(500.0, with_inertia)],
};

/// Of Ergun's pressure drop, and of that in a periodic box.
const ERGUN: f64 = 0.1;
const PERIODIC: f64 = 0.02;
/// Largest change of the pressure drop in the last tenth of a run that counts as steady.
const STEADY: f64 = 2e-3;
/// Length of the clear flow before and behind the beds (m).
const CLEAR: f64 = 1.5e-3;

/// Force along x on the first `count` spheres over the volume of the bed (Pa/m), which is the mean gradient of the pressure there.
fn gradient(context: &SuiteContext, setup: &Setup, count: usize, volume: f64) -> Result<f64> {
    let watch = Watch { context, setup, threads: context.threads, every: setup.plan.end_step / 10 };
    let course = watch.rows(|run, rows: &mut Vec<f64>| {
        rows.push(run.loads()?[..count].iter().map(|load| load.force.x).sum::<f64>() / volume);
        Ok(false)
    })?;
    let [.., before, last] = course[..] else {
        return Err(unsteady("looks at the pressure drop", course.len() as f64));
    };
    if (last / before - 1.0).abs() > STEADY {
        return Err(unsteady("the pressure drop changes by", last / before - 1.0));
    }
    Ok(last)
}

/// The mean gradient of the pressure (Pa/m) between an inlet and an outlet, and in a periodic box, at a superficial velocity (m/s).
fn gradients(context: &SuiteContext, velocity: f64, own: &[String]) -> Result<(Setup, [f64; 2])> {
    let flux = format!("driving.net_flux=[{velocity:e}, 0, 0]");
    let periodic = context.setup(TEXT, CASE.name, &[own, &[flux]].concat())?;
    let (size, diameter, count) = (periodic.domain.size(), periodic.diameter, periodic.particles.len());
    let volume = size.product();
    let alone = gradient(context, &periodic, count, volume)?;

    // The same bed three times; the middle one, which comes first in the list, has the flow of an endless bed. With the pressure of the
    // outlet the density in its middle is that of the inlet.
    let copy = |n: f64| {
        let shift = CLEAR + n * size.x;
        periodic.particles.iter().map(move |p| [p.position[0] + shift, p.position[1], p.position[2]])
    };
    let list: Vec<[f64; 3]> = copy(1.0).chain(copy(0.0)).chain(copy(2.0)).collect();
    let between = [
        format!(
            "domain={{ size = [{:e}, {:e}, {:e}], periodic = [false, true, true], faces = {{ \
             x-.inlet.velocity = [{velocity:e}, 0, 0], \"x+\".outlet = {{ absorbs_sound = true, pressure = {:e} }} }} }}",
            3.0 * size.x + 2.0 * CLEAR,
            size.y,
            size.z,
            -1.5 * alone * size.x
        ),
        format!(
            "particles=[{{ shape.sphere.diameter = {diameter:e}, density = 1000, motion = \"fixed\", list = {list:?} }}]"
        ),
        "driving={ gravity = 0 }".to_string(),
    ];
    let open = context.setup(TEXT, CASE.name, &[own, &between].concat())?;
    let between = gradient(context, &open, count, volume)?;
    Ok((periodic, [between, alone]))
}

/// Slow flow, in which the drops are proportional to the velocity.
fn creeping(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let own = ["lattice.relaxation_time=0.6".to_string(), "run.end.steps=10000".to_string()];
    let (_, [between, alone]) = gradients(context, 3e-3, &own)?;
    let quantity =
        "Reynolds number 3: pressure drop between inlet and outlet over that in a periodic box (-)";
    found.relative(quantity, between / alone, 1.0, PERIODIC).source("the same bed in a periodic box");
    Ok(())
}

fn with_inertia(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let velocity = 0.03;
    let (setup, [between, alone]) = gradients(context, velocity, &[])?;
    let (phi, density, diameter) = (setup.volume_fraction, setup.fluid_density(), setup.diameter);
    let viscosity = setup.expect_fluid().viscosity;
    let void = (1.0 - phi).powi(3);
    let ergun = 150.0 * phi * phi * viscosity * density * velocity / (void * diameter * diameter)
        + 1.75 * phi * density * velocity * velocity / (void * diameter);
    found.note("volume fraction (-)", phi);
    found.relative(
        "Reynolds number 30: pressure drop between inlet and outlet (Pa/m)",
        between,
        ergun,
        ERGUN,
    );
    found.note("Reynolds number 30: the same over that in a periodic box (-)", between / alone);
    Ok(())
}
