//! Flow through a random bed of fixed spheres from an inlet to an outlet: `validation/packed_bed`.

use super::prelude::*;

const TEXT: &str = include_str!("../../../../validation/packed_bed/case.toml");

pub(super) const CASE: Case = Case {
    name: "packed_bed",
    question: "pressure drop of a random packed bed of spheres between an inlet and an outlet",
    source: "Ergun (1952), Chem. Eng. Prog. 48, 89",
    parts: &[Part::full(120.0, |context, found| bed(context, found))],
};

/// Of Ergun's pressure drop, and of that in a periodic box.
const ERGUN: f64 = 0.1;
const PERIODIC: f64 = 0.02;
/// Superficial velocity (m/s).
const VELOCITY: f64 = 0.03;
/// Largest change of the pressure drop in the last tenth of a run that counts as steady.
const STEADY: f64 = 2e-3;
/// Length of the clear flow before and behind the beds, in cells.
const CLEAR: f64 = 18.0;

/// Pressure drop (Pa/m) along x after a run, by the force on the spheres of the first kind.
fn gradient(setup: &Setup, volume: f64) -> Result<f64> {
    let mut run = Simulation::solo(setup)?;
    let first: Vec<u64> =
        setup.particles.iter().filter(|p| setup.sections[p.template as usize] == 0).map(|p| p.id).collect();
    let force = |run: &Simulation| -> f64 {
        run.loads().filter(|(id, _)| first.contains(id)).map(|(_, load)| load.force.x).sum()
    };
    let tenth = setup.plan.end_step / 10;
    run.advance(setup.plan.end_step - tenth)?;
    let before = force(&run);
    run.advance(tenth)?;
    let now = force(&run);
    if (now / before - 1.0).abs() > STEADY {
        return Err(unsteady("the pressure drop changes by", now / before - 1.0));
    }
    Ok(now / volume)
}

fn bed(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let periodic = context.setup(TEXT, CASE.name, &[])?;
    let (size, dx, diameter) = (periodic.domain.size(), periodic.domain.dx, periodic.diameter);
    let volume = size.product();
    let alone = gradient(&periodic, volume)?;

    // The same bed three times; the middle one has the flow of an endless bed.
    let copy = |n: f64| -> Vec<[f64; 3]> {
        let shift = CLEAR * dx + n * size.x;
        periodic.particles.iter().map(|p| [p.position[0] + shift, p.position[1], p.position[2]]).collect()
    };
    let kind = |list: Vec<[f64; 3]>| {
        format!(
            "{{ shape.sphere.diameter = {diameter:e}, density = 1000, motion = \"fixed\", list = {list:?} }}"
        )
    };
    let own = [
        format!(
            "domain={{ size = [{:e}, {:e}, {:e}], periodic = [false, true, true], \
             faces = {{ x-.inlet.velocity = [{VELOCITY}, 0, 0], \"x+\".outlet.absorbs_sound = true }} }}",
            3.0 * size.x + 2.0 * CLEAR * dx,
            size.y,
            size.z
        ),
        format!("particles=[{}, {}]", kind(copy(1.0)), kind([copy(0.0), copy(2.0)].concat())),
        "driving={ gravity = 0, force_balance = \"fluid_only\" }".to_string(),
    ];
    let open = context.setup(TEXT, CASE.name, &own)?;
    let between = gradient(&open, volume)?;

    let (phi, viscosity, density) =
        (periodic.volume_fraction, periodic.expect_fluid().viscosity, periodic.fluid_density());
    let void = (1.0 - phi).powi(3);
    let ergun = 150.0 * phi * phi * viscosity * density * VELOCITY / (void * diameter * diameter)
        + 1.75 * phi * density * VELOCITY * VELOCITY / (void * diameter);
    found.note("volume fraction (-)", phi);
    found.note(
        "Reynolds number by the diameter and the superficial velocity (-)",
        VELOCITY * diameter / viscosity,
    );
    found.relative("pressure drop between inlet and outlet (Pa/m)", between, ergun, ERGUN);
    let quantity = "pressure drop between inlet and outlet over that in a periodic box (-)";
    found.relative(quantity, between / alone, 1.0, PERIODIC).source("the same bed in a periodic box");
    Ok(())
}
