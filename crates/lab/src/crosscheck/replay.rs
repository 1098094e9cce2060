//! The loads of a small four-way run, recorded and replayed through both engines: with elastic contacts, and with damped ones
//! that rub.

use super::pair::Pair;
use super::prelude::*;
use super::record::{Recording, record};
use crate::checks::Moment;
use turbid::case::{self};
use turbid::error::Error;

/// Spheres that come through a periodic box of fluid from all sides.
const CASE: &str = include_str!("replay.toml");

/// Impacts that dissipate, along the normal and by friction.
const RUBBING: [&str; 4] = [
    "contact.restitution=0.8",
    "contact.friction_static=0.3",
    "contact.friction_kinetic=0.3",
    "contact.transition_velocity=1e-4",
];

/// Cells per step of the spheres at the start, so fast that they meet.
const SPEED: f64 = 0.05;

const ELASTIC: Limit =
    (1e-12, "the same law and scheme: rounding of 1e-15, ten times larger with each of some three impacts");
const DAMPED: Limit = (f64::INFINITY, "reported only: the engines have different laws of friction");
const MOMENTUM: Limit =
    (1e-11, "over the sum of all momenta at the start: rounding of opposite forces in 1200 sub-steps");
const FIRST_CONTACT: Limit =
    (1.0, "the native engine counts at the start of its last sub-step, OTHER at its end");

/// Records and replays both kinds of contacts; trajectories are those of the damped ones.
pub(super) fn replay(against: &Against) -> Result<Findings> {
    let mut findings = Findings::default();
    compare("elastic", &[], ELASTIC, against, &mut findings)?;
    compare("damped", &RUBBING, DAMPED, against, &mut findings)?;
    Ok(findings)
}

/// Replays the case with these options; the trajectories replace those before.
fn compare(
    what: &str,
    options: &[&str],
    distance: Limit,
    against: &Against,
    findings: &mut Findings,
) -> Result<()> {
    let options: Vec<String> = options.iter().map(ToString::to_string).collect();
    let mut setup = case::from_text(CASE, "replay", &options)?;
    setup.plan.threads = 1;
    stir(&mut setup);
    let recorded = record(&setup, setup.plan.end_step)?;
    let mut pair = Pair::start(&setup, "replay", against)?;
    let mut apart = Vec::new();
    findings.moments.clear();
    pair.run(setup.plan.end_step, Some(&recorded), |pair| {
        let step = pair.steps[0];
        let time = step as f64 * setup.time_step;
        apart.push([time, pair.largest[0]]);
        if step % 2 == 1 {
            let particles = [0, 1].map(|engine| pair.particles(engine).to_vec());
            findings.moments.push(Moment { time, particles, templates: setup.templates.clone() });
        }
    });
    if let Some((engine, error)) = pair.failures.first() {
        let name = ["native engine", against.name.label][*engine];
        return Err(Error::Input(format!("{name}: {error}")));
    }
    let [Some(native), Some(other)] = pair.first_contact.map(|step| step.map(|step| step as f64)) else {
        let text = format!("{what}: nothing touches, so there is nothing to compare");
        return Err(Error::Input(text));
    };
    pair.check_repeats(findings, &format!("{what}: "), &recorded);
    check_momentum(findings, what, &setup, &recorded, &pair);
    let values = [Some(native), Some(other), None];
    let quantity = format!("{what}: steps to the first contact (-)");
    findings.given(quantity, values, (native - other).abs(), FIRST_CONTACT);
    pair.report_begun(findings, &format!("{what}: "));
    let quantity = format!("{what}: largest distance between the engines over D (-)");
    findings.given(quantity, [None; 3], pair.largest[0], distance);
    let plot = Overlay::new(
        format!("{what}_apart"),
        format!("replay, {what} contacts: largest distance between the engines so far"),
        ["time t (s)", "distance / D (-)"],
        [("distance / D", apart)],
    );
    findings.overlays.push(plot.logarithmic([false, true]));
    Ok(())
}

/// Gives the spheres velocities and spins in all directions, up to [`SPEED`] along each axis.
fn stir(setup: &mut Setup) {
    let velocity = SPEED * setup.domain.dx / setup.time_step;
    let radius = 0.5 * setup.diameter;
    let mut random = Random(7);
    for particle in &mut setup.particles {
        particle.velocity = (random.vector() * velocity).into();
        particle.angular_velocity = (random.vector() * (velocity / radius)).into();
    }
}

/// Contacts exchange momentum and give none: all of the gain is from the loads.
fn check_momentum(findings: &mut Findings, what: &str, setup: &Setup, recorded: &Recording, pair: &Pair) {
    let steps = setup.plan.end_step;
    let mass = |p: &Particle| setup.templates[p.template as usize].mass();
    let momentum =
        |particles: &[Particle]| -> Vec3 { particles.iter().map(|p| p.velocity() * mass(p)).sum() };
    let scale: f64 = setup.particles.iter().map(|p| p.velocity().norm() * mass(p)).sum();
    let weight: Vec3 = setup.particles.iter().map(|p| setup.gravity * mass(p)).sum();
    let loads: Vec3 = (0..steps).flat_map(|step| recorded.loads(step)).map(|load| load.force).sum();
    let exact = momentum(&setup.particles) + (loads + weight * steps as f64) * setup.time_step;
    let ends = [0, 1].map(|engine| momentum(pair.particles(engine)));
    let error = ends.map(|end| (end - exact).norm() / scale);
    let values = [ends[0].z, ends[1].z, exact.z].map(Some);
    findings.given(format!("{what}: momentum along z (kg m/s)"), values, error[0].max(error[1]), MOMENTUM);
}
