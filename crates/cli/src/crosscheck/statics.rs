//! The force at rest: pairs of spheres, spheres and a wall.

use super::theory::{Hertz, cap_ratio, lens_ratio};
use super::tools::{GLASS, Laws, OWN, SAME, Scene, Track, given, model, plane, sphere, worst};
use super::{Check, Findings, Overlay};
use std::path::Path;
use turbid::contact::Material;
use turbid::domain::Domain;
use turbid::error::Result;
use turbid::math::Vec3;

/// So short a step (s) that no sphere moves, however hard it is pressed.
pub(super) const STEP: f64 = 1e-15;

/// A soft material.
const SOFT: Material = Material { youngs_modulus: 1e7, poisson_ratio: 0.3 };

const MATERIALS: [Material; 2] = [GLASS, SOFT];

/// Radii of the kinds of spheres (m); every kind comes in both materials.
const RADII: [f64; 2] = [0.5e-3, 0.2e-3];

const SAME_DEPTH_LAW: &str = "relative, to 4/3 E* sqrt(R*) d^(3/2) with the depth of the same stored positions, worst of all \
                              depths: rounding, doubled at every root";
const VOLUME_LAW: &str = "relative, to the ratio of the lens or cap, worst of all depths; shown at the deepest: both volumes \
                          are closed forms, and small depths lose digits in them";
const PAIRWISE: &str = "relative to the force: what one sphere gets the other gives";

/// Depths over the radius of the first sphere, four per decade from 1e-8 to 0.1.
fn depths() -> impl Iterator<Item = f64> {
    (0..29).map(|i| 10.0_f64.powf(-8.0 + 0.25 * f64::from(i)))
}

/// A scene of touching things without friction and damping, in which nothing has happened yet.
fn scene(name: String, laws: Laws) -> Scene {
    let mut scene = Scene::glass(name, 1.0, 0.0, laws);
    scene.templates = (RADII.iter())
        .flat_map(|&radius| (0..MATERIALS.len()).map(move |material| sphere(radius, material)))
        .collect();
    scene.contact = Some(model(&MATERIALS, &[1.0; 4], 0.0, laws));
    scene.domain = Domain { cells: [64, 64, 16], dx: 0.5e-3, periodic: [false; 3] };
    scene
}

/// Index of the template with the radius and material of these indices.
fn kind(radius: usize, material: usize) -> usize {
    radius * MATERIALS.len() + material
}

/// Somewhere in a grid of places that do not see each other (m).
fn place(n: usize, height: f64) -> Vec3 {
    Vec3::new((n % 12) as f64, (n / 12) as f64, 0.0) * 2.5e-3 + Vec3::new(2e-3, 2e-3, height)
}

/// Forces of one configuration in all three ways, by depth.
#[derive(Clone, Debug, Default)]
struct Curve {
    /// Depth over the radius of the first sphere (-).
    depth: Vec<f64>,
    /// Hertz (N).
    hertz: Vec<f64>,
    /// What the native law should be over Hertz.
    ratio: Vec<f64>,
    /// Native, LIGGGHTS (N).
    forces: [Vec<f64>; 2],
    /// Largest sum of the forces on both over the force, in both engines.
    unpaired: [f64; 2],
}

impl Curve {
    /// Largest deviation of both engines from what they should be under these laws of the native one.
    fn deviation(&self, laws: Laws) -> f64 {
        let ratio = |k: usize| if laws == SAME { 1.0 } else { self.ratio[k] };
        let native = (0..self.depth.len()).map(|k| self.forces[0][k] / (self.hertz[k] * ratio(k)) - 1.0);
        let liggghts = (0..self.depth.len()).map(|k| self.forces[1][k] / self.hertz[k] - 1.0);
        worst(native.chain(liggghts).map(f64::abs))
    }

    fn check(&self, what: &str, laws: Laws) -> Check {
        let last = self.depth.len() - 1;
        if laws == SAME {
            let values = [self.forces[0][last], self.forces[1][last], self.hertz[last]];
            let quantity = format!("force, d/R = 0.1, {what} (N)");
            return given(quantity, values.map(Some), self.deviation(laws), 1e-9, SAME_DEPTH_LAW);
        }
        let hertz = self.hertz[last];
        let values = [self.forces[0][last] / hertz, self.forces[1][last] / hertz, self.ratio[last]];
        let quantity = format!("force over Hertz, volume law, d/R = 0.1, {what} (-)");
        given(quantity, values.map(Some), self.deviation(laws), 1e-9, VOLUME_LAW)
    }

    fn overlay(&self, name: &str, what: &str) -> [Overlay; 2] {
        let curve = |ys: &[f64]| self.depth.iter().zip(ys).map(|(&x, &y)| [x, y]).collect::<Vec<_>>();
        let over =
            |forces: &[f64]| -> Vec<f64> { forces.iter().zip(&self.hertz).map(|(f, h)| f / h).collect() };
        let force = Overlay::new(
            format!("force_{name}"),
            format!("Force at rest, {what}"),
            ["depth / R", "force (N)"],
            [
                ("native", curve(&self.forces[0])),
                ("LIGGGHTS", curve(&self.forces[1])),
                ("Hertz", curve(&self.hertz)),
            ],
        )
        .logarithmic([true; 2]);
        let ratio = Overlay::new(
            format!("ratio_{name}"),
            format!("Force at rest over Hertz, {what}, volume law"),
            ["depth / R", "force / Hertz"],
            [
                ("native", curve(&over(&self.forces[0]))),
                ("LIGGGHTS", curve(&over(&self.forces[1]))),
                ("volume law", curve(&self.ratio)),
            ],
        )
        .logarithmic([true, false]);
        [force, ratio]
    }
}

/// H1: pairs of equal and unequal spheres and materials, along a tilted line.
pub(super) fn pairs(directory: Option<&Path>) -> Result<Findings> {
    let configurations = [
        ("equal", [0, 0], [0, 0]),
        ("R2 = 0.4 R1", [0, 1], [0, 0]),
        ("glass on soft", [0, 0], [0, 1]),
        ("R2 = 0.4 R1, soft on glass", [0, 1], [1, 0]),
    ];
    let mut findings = Findings::default();
    for (laws, label) in [(SAME, "hertz"), (OWN, "volume")] {
        let mut scene = scene(format!("static-pair-{label}"), laws);
        let direction = Vec3::new(0.48, -0.6, 0.64);
        let mut n = 0;
        for (_, radii, materials) in configurations {
            for depth in depths() {
                let distance = RADII[radii[0]] + RADII[radii[1]] - depth * RADII[radii[0]];
                let at = place(n, 4e-3);
                for (i, along) in [(0, 0.0), (1, distance)] {
                    let template = kind(radii[i], materials[i]);
                    scene.add(template, at + direction * along, Vec3::zeros(), Vec3::zeros());
                }
                n += 1;
            }
        }
        let tracks = scene.record(directory, STEP, 1, |_| false)?;
        let mut ids = (0..).step_by(2);
        for (what, radii, materials) in configurations {
            let curve = pair_curve(&scene, &tracks, radii, materials, &mut ids);
            findings.push(curve.check(what, laws));
            let unpaired = worst(curve.unpaired);
            let quantity = format!("sum of both forces over one, {what}, {label} law (-)");
            let values = [Some(curve.unpaired[0]), Some(curve.unpaired[1]), Some(0.0)];
            findings.push(given(quantity, values, unpaired, 1e-15, PAIRWISE));
            let name = format!("r{}{}_m{}{}", radii[0], radii[1], materials[0], materials[1]);
            let [force, ratio] = curve.overlay(&name, what);
            findings.overlays.push(if laws == SAME { force } else { ratio });
        }
    }
    Ok(findings)
}

/// The forces of pairs of spheres with these ids and the ones above them.
fn pair_curve(
    scene: &Scene,
    tracks: &[Track; 2],
    radii: [usize; 2],
    materials: [usize; 2],
    ids: &mut impl Iterator<Item = usize>,
) -> Curve {
    let hertz = Hertz::pair([1.0; 2], radii.map(|i| RADII[i]), materials.map(|i| &MATERIALS[i]));
    let mut curve = Curve::default();
    for (depth, id) in depths().zip(ids) {
        let [a, b] = [id, id + 1].map(|id| scene.particles[id].position());
        let distance = (b - a).norm();
        let stored = scene.radius(id) + scene.radius(id + 1) - distance;
        curve.depth.push(depth);
        curve.hertz.push(hertz.force(stored));
        curve.ratio.push(lens_ratio(radii.map(|i| RADII[i]), stored));
        for (i, track) in tracks.iter().enumerate() {
            let forces = [track.resting_force(id), track.resting_force(id + 1)];
            curve.forces[i].push(-forces[0].dot(&(b - a)) / distance);
            let unpaired = (forces[0] + forces[1]).norm() / forces[0].norm();
            curve.unpaired[i] = curve.unpaired[i].max(unpaired);
        }
    }
    curve
}

/// H2: spheres of both sizes and materials pressed into a wall of glass.
pub(super) fn wall(directory: Option<&Path>) -> Result<Findings> {
    let configurations = [("glass on glass", 0, 0), ("small soft on glass", 1, 1)];
    let mut findings = Findings::default();
    for (laws, label) in [(SAME, "hertz"), (OWN, "volume")] {
        let mut scene = scene(format!("static-wall-{label}"), laws);
        scene.walls.push(plane(2, 0.0, true, 0));
        for (n, ((_, radius, material), depth)) in (configurations.iter())
            .flat_map(|configuration| depths().map(move |depth| (configuration, depth)))
            .enumerate()
        {
            let height = RADII[*radius] * (1.0 - depth);
            let template = kind(*radius, *material);
            scene.add(template, place(n, height), Vec3::zeros(), Vec3::zeros());
        }
        let tracks = scene.record(directory, STEP, 1, |_| false)?;
        let mut ids = 0..;
        for (what, radius, material) in configurations {
            let hertz = Hertz::wall(1.0, RADII[radius], [&MATERIALS[material], &GLASS]);
            let mut curve = Curve::default();
            for (depth, id) in depths().zip(&mut ids) {
                let stored = RADII[radius] - scene.particles[id].position().z;
                curve.depth.push(depth);
                curve.hertz.push(hertz.force(stored));
                curve.ratio.push(cap_ratio(RADII[radius], stored));
                for (i, track) in tracks.iter().enumerate() {
                    curve.forces[i].push(track.resting_force(id).z);
                }
            }
            findings.push(curve.check(what, laws));
            let [force, ratio] = curve.overlay(&format!("r{radius}_m{material}"), what);
            findings.overlays.push(if laws == SAME { force } else { ratio });
        }
    }
    Ok(findings)
}
