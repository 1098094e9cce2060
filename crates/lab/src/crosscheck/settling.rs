//! A thousand dry spheres of three sizes fall into a box and come to rest.
//!
//! Without friction: the native engine has no static friction of springs, so that piles with it differ by design. Frictionless
//! spheres have one kind of packing, whatever the way to it.

use super::prelude::*;

const COUNT: usize = 1000;

const RADII: [f64; 3] = [0.45e-3, 0.5e-3, 0.55e-3];

const MATERIAL: Material = Material { youngs_modulus: 1e6, poisson_ratio: 0.3 };

const RESTITUTION: f64 = 0.3;

/// Step of the motion (s): 23 per contact at 0.3 m/s.
const STEP: f64 = 1.4e-5;

const SUBSTEPS: u32 = 40;

/// Samples until the end, at 0.252 s.
const SAMPLES: usize = 450;

const MEAN: usize = 100;

const GRAVITY: f64 = 9.81;

/// Edges of the box and its height (m).
const BOX: Domain = open([20, 20, 48], 0.525e-3);

const HEIGHT: Limit = (1.2e-2, "relative: 3 sqrt(2) of the scatter of 2.8e-3 of six packings of each engine");
const COORDINATION: Limit =
    (5.5e-2, "relative: 3 sqrt(2) of the scatter of 1.3e-2 of six packings of each engine");
const SIDE: Limit = (0.2, "relative: 3 sqrt(2) of the scatter of 5e-2 of six packings of each engine");
const WEIGHT: Limit =
    (1.2e-3, "relative, to the weight: 3 times the scatter of the mean over 56 ms of twelve packings");

/// Spheres on a disturbed lattice in the air.
fn system() -> Setup {
    let mut system = glass("settling-box", 1.0, 0.0, SAME);
    system.contact = Some(model(&[MATERIAL], &[RESTITUTION], 0.0, SAME));
    system.templates = RADII.iter().map(|&radius| sphere(radius, 0)).collect();
    system.domain = BOX;
    system.substeps = SUBSTEPS;
    system.gravity = Vec3::z() * -GRAVITY;
    let size = BOX.size();
    system.walls = (0..3).flat_map(|axis| [plane(axis, 0.0, true), plane(axis, size[axis], false)]).collect();
    let mut random = Random(7);
    let spacing = size.x / 8.0;
    for n in 0..COUNT {
        let cell = Vec3::new((n % 8) as f64, (n / 8 % 8) as f64, (n / 64) as f64);
        let at = (cell + Vec3::repeat(0.5) + random.vector() * 0.05) * spacing;
        add(&mut system, n * 7 % RADII.len(), at, random.vector() * 0.1);
    }
    system
}

#[derive(Clone, Copy, Debug, Default)]
struct Sample {
    /// Height of the centre of mass (m).
    height: f64,
    /// Kinetic energy (J).
    kinetic: f64,
    /// Contacts with other spheres of each sphere (-).
    coordination: f64,
    /// Force on the floor, downwards (N).
    floor: f64,
    /// Force on a side wall outwards (N), mean of the four.
    side: f64,
}

fn sample(system: &Setup, engine: &dyn DemEngine) -> Sample {
    let spheres = engine.particles().owned();
    let mut sample = Sample::default();
    let mut total = 0.0;
    for (id, p) in spheres.iter().enumerate() {
        let mass = mass(system, id);
        total += mass;
        sample.height += mass * p.position[2];
        sample.kinetic += 0.5 * mass * p.velocity().norm_squared();
    }
    sample.height /= total;
    for contact in engine.contact_states(&Comm::Solo) {
        let Some(wall) = contact.wall() else {
            sample.coordination += 2.0 / spheres.len() as f64;
            continue;
        };
        let (axis, side) = (wall / 2, wall % 2);
        // The force on the sphere points into the box.
        let outwards = if side == 0 { contact.force[axis] } else { -contact.force[axis] };
        match (axis, side) {
            (2, 0) => sample.floor += outwards,
            (2, _) => {}
            _ => sample.side += 0.25 * outwards,
        }
    }
    sample
}

fn time(sample: usize) -> f64 {
    sample as f64 * f64::from(SUBSTEPS) * STEP
}

/// The box of a thousand spheres: quantities at the end, and over time.
pub(super) fn settling(against: &Against, findings: &mut Findings) -> Result<()> {
    let system = system();
    let run = |engine: Box<dyn DemEngine>| {
        sampled(engine, f64::from(SUBSTEPS) * STEP, SAMPLES, 20, |engine| sample(&system, engine))
    };
    let (native, native_frames) = run(native(&system)?)?;
    let (other, other_frames) = run(against.engine(&system)?)?;
    let runs = [&native[..], &other];
    let weight = GRAVITY * (0..COUNT).map(|id| mass(&system, id)).sum::<f64>();
    for (quantity, of, analytic, limit) in [
        ("height of the centre of mass (m)", (|s| s.height) as fn(&Sample) -> f64, None, HEIGHT),
        ("coordination number (-)", |s| s.coordination, None, COORDINATION),
        ("force on the floor (N)", |s| s.floor, Some(weight), WEIGHT),
        ("force on a side wall (N)", |s| s.side, None, SIDE),
    ] {
        let mean = |run: &[Sample]| run[SAMPLES + 1 - MEAN..].iter().map(of).sum::<f64>() / MEAN as f64;
        let between = if analytic.is_some() { Between::Theory } else { Between::Engines };
        let [native, other] = runs.map(|run| Some(mean(run)));
        findings.compare_relative(quantity, [native, other, analytic], between, limit);
    }
    for (name, axis, of) in [
        ("height", "height of the centre of mass (mm)", (|s| s.height * 1e3) as fn(&Sample) -> f64),
        ("coordination", "coordination number", |s| s.coordination),
        ("floor", "force on the floor (mN)", |s| s.floor * 1e3),
        ("kinetic", "kinetic energy (uJ)", |s| s.kinetic * 1e6),
    ] {
        let curve = |run: &[Sample]| run.iter().enumerate().map(|(k, s)| [time(k), of(s)]).collect();
        let title = "1000 dry spheres settle in a box";
        findings.plot_both(name, title, ["time (s)", axis], runs.map(curve), None);
    }
    findings.moments = moments(&system.templates, [&native_frames, &other_frames], |k| time(20 * k), 1);
    Ok(())
}
