//! A thousand dry spheres of three sizes fall into a box and come to rest.
//!
//! Without friction: the native engine has no static friction of springs, so that piles with it differ by design. Frictionless
//! spheres have one kind of packing, whatever the way to it.

use super::tools::{Between, Random, SAME, Scene, advance, model, moments, plane, relative, sphere};
use super::{Findings, Overlay};
use std::path::Path;
use turbid::contact::Material;
use turbid::dem::DemEngine;
use turbid::domain::Domain;
use turbid::error::Result;
use turbid::math::Vec3;
use turbid::particle::Particle;

const COUNT: usize = 1000;

const RADII: [f64; 3] = [0.45e-3, 0.5e-3, 0.55e-3];

const MATERIAL: Material = Material { youngs_modulus: 1e6, poisson_ratio: 0.3 };

const RESTITUTION: f64 = 0.3;

/// Step of the motion (s): 23 per contact at 0.3 m/s.
const STEP: f64 = 1.4e-5;

/// Steps of the motion between two samples.
const SUBSTEPS: u32 = 40;

/// Samples until the end, at 0.252 s.
const SAMPLES: usize = 450;

/// Samples at the end over which means are taken.
const MEAN: usize = 100;

const GRAVITY: f64 = 9.81;

/// Edges of the box and its height (m).
const BOX: Domain = Domain { cells: [20, 20, 48], dx: 0.525e-3, periodic: [false; 3] };

const HEIGHT: &str = "relative, between the engines: six packings of each engine from other starts scatter by 2.8e-3; three times \
                      the difference of two such";
const COORDINATION: &str = "relative, between the engines: six packings of each engine from other starts scatter by 1.3e-2; three \
                            times the difference of two such";
const WEIGHT: &str = "relative, to the weight: what is left of the motion, averaged over 56 ms, scatters by 4e-4 over twelve \
                      packings; three times that";
const SIDE: &str = "relative, between the engines: six packings of each engine from other starts scatter by 5e-2; three times the \
                    difference of two such";

/// Spheres on a disturbed lattice in the air.
fn scene(name: &str, seed: u64) -> Scene {
    let mut scene = Scene::glass(name, 1.0, 0.0, SAME);
    scene.contact = Some(model(&[MATERIAL], &[RESTITUTION], 0.0, SAME));
    scene.templates = RADII.iter().map(|&radius| sphere(radius, 0)).collect();
    scene.domain = BOX;
    scene.substeps = SUBSTEPS;
    scene.gravity = Vec3::z() * -GRAVITY;
    let size = BOX.size();
    scene.walls =
        (0..3).flat_map(|axis| [plane(axis, 0.0, true, 0), plane(axis, size[axis], false, 0)]).collect();
    let mut random = Random(seed);
    let spacing = size.x / 8.0;
    for n in 0..COUNT {
        let cell = Vec3::new((n % 8) as f64, (n / 8 % 8) as f64, (n / 64) as f64);
        let place = (cell + Vec3::repeat(0.5) + random.vector() * 0.05) * spacing;
        scene.add(n * 7 % RADII.len(), place, random.vector() * 0.1, Vec3::zeros());
    }
    scene
}

/// Means over all spheres at one moment.
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

fn sample(scene: &Scene, engine: &dyn DemEngine) -> Sample {
    let spheres = engine.particles().owned();
    let mut sample = Sample::default();
    let mut total = 0.0;
    for (id, p) in spheres.iter().enumerate() {
        let mass = scene.mass(id);
        total += mass;
        sample.height += mass * p.position[2];
        sample.kinetic += 0.5 * mass * p.velocity().norm_squared();
    }
    sample.height /= total;
    for contact in engine.contact_states() {
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

/// The fall in one engine.
struct Run {
    samples: Vec<Sample>,
    /// Spheres at every twentieth sample.
    frames: Vec<Vec<Particle>>,
}

impl Run {
    fn of(scene: &Scene, engine: &mut dyn DemEngine) -> Result<Self> {
        let (mut samples, mut frames) = (Vec::new(), Vec::new());
        for k in 0..=SAMPLES {
            if k > 0 {
                advance(engine, f64::from(SUBSTEPS) * STEP)?;
            }
            samples.push(sample(scene, engine));
            if k.is_multiple_of(20) {
                frames.push(engine.particles().owned().to_vec());
            }
        }
        Ok(Self { samples, frames })
    }

    /// Mean over the end.
    fn mean(&self, of: impl Fn(&Sample) -> f64) -> f64 {
        self.samples[SAMPLES + 1 - MEAN..].iter().map(of).sum::<f64>() / MEAN as f64
    }
}

/// Time of a sample (s).
fn time(sample: usize) -> f64 {
    sample as f64 * f64::from(SUBSTEPS) * STEP
}

/// The box of a thousand spheres.
pub(super) fn settling(directory: Option<&Path>) -> Result<Findings> {
    let scene = scene("settling-box", 7);
    let runs = [Run::of(&scene, &mut scene.native()?)?, Run::of(&scene, &mut scene.liggghts(directory)?)?];
    let weight = GRAVITY * (0..COUNT).map(|id| scene.mass(id)).sum::<f64>();
    let both = |of: fn(&Sample) -> f64, analytic| [Some(runs[0].mean(of)), Some(runs[1].mean(of)), analytic];
    let engines = |quantity: &str, of: fn(&Sample) -> f64, tolerance: f64, reason: &str| {
        relative(quantity, both(of, None), Between::Engines, tolerance, reason)
    };
    let floor = both(|s| s.floor, Some(weight));
    Ok(Findings {
        checks: vec![
            engines("height of the centre of mass (m)", |s| s.height, 1.2e-2, HEIGHT),
            engines("coordination number (-)", |s| s.coordination, 5.5e-2, COORDINATION),
            relative("force on the floor (N)", floor, Between::Theory, 1.2e-3, WEIGHT),
            engines("force on a side wall (N)", |s| s.side, 0.2, SIDE),
        ],
        overlays: plots(&runs),
        moments: moments(&scene, [&runs[0].frames, &runs[1].frames], |k| time(20 * k), 1),
        ..Findings::default()
    })
}

/// Height, coordination number and force on the floor over time.
fn plots(runs: &[Run; 2]) -> Vec<Overlay> {
    let overlay = |name: &str, axis: &str, of: fn(&Sample) -> f64| {
        let curve = |run: &Run| {
            let samples = run.samples.iter().enumerate();
            samples.map(|(k, s)| [time(k), of(s)]).collect()
        };
        Overlay::new(
            name,
            "1000 dry spheres settle in a box",
            ["time (s)", axis],
            [("native", curve(&runs[0])), ("LIGGGHTS", curve(&runs[1]))],
        )
    };
    vec![
        overlay("height", "height of the centre of mass (mm)", |s| s.height * 1e3),
        overlay("coordination", "coordination number", |s| s.coordination),
        overlay("floor", "force on the floor (mN)", |s| s.floor * 1e3),
        overlay("kinetic", "kinetic energy (uJ)", |s| s.kinetic * 1e6),
    ]
}
