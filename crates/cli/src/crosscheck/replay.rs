//! The loads of a small four-way run, recorded and replayed through both engines: with elastic contacts, and with damped ones
//! that rub.

use super::files::sphere;
use super::own_case::{begun, repeats};
use super::pair::Pair;
use super::record::{Recording, record};
use super::tools::{Random, Scene, given};
use crate::checks::{Check, Findings, Moment};
use std::path::Path;
use turbid::case::{self, Setup};
use turbid::dem::DemEngine;
use turbid::error::{Error, Result};
use turbid::math::Vec3;
use turbid::output::Overlay;
use turbid::particle::Particle;

/// Spheres that come through a periodic box of fluid from all sides.
const CASE: &str = r#"
[domain]
size = { diameters = [4, 4, 4] }
[fluid]
density = 1000.0
archimedes = 1000
[lattice]
cells_per_diameter = 8
relaxation_time = 0.55
[[particles]]
shape = { sphere = { diameter = 1.5e-3 } }
density = 3300.0
count = 40
seed = 5
minimum_gap = 2e-5
[contact]
youngs_modulus = 5e5
poisson_ratio = 0.25
restitution = 1.0
friction_static = 0.0
friction_kinetic = 0.0
enlargement = 0.0
law = "hertz"
damping = "tsuji"
substeps = 20
[driving]
gravity = 9.80665
zero_net_flux = true
[run]
end = { steps = 60 }
"#;

/// Impacts that dissipate, along the normal and by friction.
const RUBBING: [&str; 4] = [
    "contact.restitution=0.8",
    "contact.friction_static=0.3",
    "contact.friction_kinetic=0.3",
    "contact.transition_velocity=1e-4",
];

/// Cells per step of the spheres at the start, so fast that they meet.
const SPEED: f64 = 0.05;

/// Distance of elastic impacts over the diameter: rounding of 1e-15, that every impact multiplies by about ten, and each sphere
/// has some three.
const ELASTIC: f64 = 1e-12;
/// Of momentum over the sum of its absolute values.
const MOMENTUM: f64 = 1e-11;

/// Records and replays; what LIGGGHTS says goes to the directory, if there is one.
pub(super) fn replay(directory: Option<&Path>) -> Result<Findings> {
    let mut found = Findings::default();
    scene("elastic", &[], directory, &mut found)?;
    scene("damped", &RUBBING, directory, &mut found)?;
    Ok(found)
}

/// One run and its replay; its trajectories take the place of those before.
fn scene(what: &str, options: &[&str], directory: Option<&Path>, findings: &mut Findings) -> Result<()> {
    let options: Vec<String> = options.iter().map(ToString::to_string).collect();
    let mut setup = case::from_text(CASE, "replay", &options)?;
    setup.plan.threads = 1;
    stir(&mut setup);
    let (steps, dt) = (setup.plan.end_step, setup.time_step);
    let recorded = record(&setup, steps)?;
    let engines = Scene::of("replay", &setup);
    let engines: [Box<dyn DemEngine>; 2] =
        [Box::new(engines.native()?), Box::new(engines.liggghts(directory)?)];
    let mut pair = Pair::new(&setup, engines);
    let mut apart = Vec::new();
    findings.moments.clear();
    for step in 0..steps {
        if !pair.advance(recorded.loads(step)) {
            break;
        }
        let time = (step + 1) as f64 * dt;
        apart.push([time, pair.found.largest[0].value]);
        if step % 2 == 0 {
            let spheres = [0, 1].map(|engine| {
                let of = |p: &Particle| sphere(p, &setup.templates[p.template as usize]);
                pair.particles(engine).iter().map(of).collect()
            });
            findings.moments.push(Moment { time, spheres });
        }
    }
    let found = &pair.found;
    if let Some((engine, error)) = found.failures.first() {
        return Err(Error::Input(format!("{engine}: {error}")));
    }
    let [Some(native), Some(liggghts)] = found.first_contact.map(|step| step.map(|step| step as f64)) else {
        let text = format!("{what}: nothing touches, so there is nothing to compare");
        return Err(Error::Input(text));
    };
    let label = format!("{what}: ");
    findings.push(repeats(&label, &recorded, &pair));
    findings.push(momentum(what, &setup, &recorded, &pair));
    findings.push(given(
        format!("{what}: steps to the first contact (-)"),
        [Some(native), Some(liggghts), None],
        (native - liggghts).abs(),
        1.0,
        "the native engine counts the contacts at the start of its last sub-step, LIGGGHTS those at its end",
    ));
    findings.push(begun(&label, found));
    let (tolerance, reason) = if what == "elastic" {
        (
            ELASTIC,
            "the same law (Hertz, elastic, no friction) in the same leapfrog scheme: rounding of 1e-15, ten times larger with every \
             impact, and each sphere has some three",
        )
    } else {
        let reason = "reported only: the engines have different laws of friction";
        (f64::INFINITY, reason)
    };
    findings.push(given(
        format!("{what}: largest distance between the engines over D (-)"),
        [None; 3],
        found.largest[0].value,
        tolerance,
        reason,
    ));
    findings.overlays.push(
        Overlay::new(
            format!("{what}_apart"),
            format!("replay, {what} contacts: largest distance between the engines so far"),
            ["time t (s)", "distance / D (-)"],
            [("distance / D", apart)],
        )
        .logarithmic([false, true]),
    );
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

/// Contacts exchange momentum and give none: what is gained is what the loads gave.
fn momentum(what: &str, setup: &Setup, recorded: &Recording, pair: &Pair) -> Check {
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
    given(
        format!("{what}: momentum along z (kg m/s)"),
        [ends[0].z, ends[1].z, exact.z].map(Some),
        error[0].max(error[1]),
        MOMENTUM,
        "vector difference to start and loads, over the sum of all momenta at the start: forces of contact are opposite, so \
         1200 sub-steps leave rounding only",
    )
}
