//! The force at rest: pairs of spheres, spheres and a wall.

use super::prelude::*;
use super::theory::{cap_ratio, lens_ratio};
use std::f64::consts::PI;
use turbid::contact::CohesionLaw;

/// So short a step (s) that no sphere moves, however hard it is pressed.
pub(super) const STEP: f64 = 1e-15;

const SOFT: Material = Material { youngs_modulus: 1e7, poisson_ratio: 0.3 };

const MATERIALS: [Material; 2] = [GLASS, SOFT];

/// Radii of the kinds of spheres (m); every kind comes in both materials.
const RADII: [f64; 2] = [0.5e-3, 0.2e-3];

const HERTZ: Limit =
    (1e-9, "relative, with the depth of the stored positions, worst of all depths: rounding");
const VOLUME: Limit =
    (1e-9, "relative, worst of all depths: small depths lose digits in the closed forms of the volumes");
const COHESIVE: Limit = (
    1e-9,
    "over the sum of elastic force and cohesion, d/R from 1e-6, where LIGGGHTS's area is no small difference: rounding",
);
const PAIRWISE: Limit = (1e-15, "relative to the force: the forces are equal and opposite");

const ADHESIVE: Limit = (
    1e-9,
    "over the sum of Hertz's force and the pull-off force, d/R from 1e-6: rounding, also of the roots for the disc in which spheres meet",
);

/// Density of the energy of cohesion (J/m^3), and work of adhesion (J/m^2), by pair of materials.
const DENSITY: [f64; 4] = [1e6, 3e5, 3e5, 1e5];
const ADHESION: [f64; 4] = [20.0, 5.0, 5.0, 1.0];

/// Depths over the radius below which the area of a sphere at a wall, a difference of squares in LIGGGHTS, has lost its digits.
const CANCELLED: f64 = 0.99e-6;

/// Depths over the radius of the first sphere, four per decade from 1e-8 to 0.1.
fn depths() -> impl Iterator<Item = f64> {
    (0..29).map(|i| 10.0_f64.powf(-8.0 + 0.25 * f64::from(i)))
}

struct Contact {
    what: &'static str,
    stem: &'static str,
    /// Indices of radius and material of a sphere, and of another one or, without, of a wall of glass.
    sphere: [usize; 2],
    other: Option<[usize; 2]>,
}

#[derive(Default)]
struct Curve {
    /// Depth over the radius of the first sphere (-).
    depth: Vec<f64>,
    /// Force by Hertz (N), and that of the volume law over it.
    hertz: Vec<f64>,
    ratio: Vec<f64>,
    /// Native, the other engine (N).
    forces: [Vec<f64>; 2],
    /// Largest sum of the forces on both over the force, in both engines.
    unpaired: [f64; 2],
}

impl Contact {
    /// Law of Hertz, and the ratio of the volume law to it at a depth (m).
    fn theory(&self) -> (Hertz, impl Fn(f64) -> f64) {
        let [radius, material] = self.sphere;
        let (radius, material) = (RADII[radius], &MATERIALS[material]);
        let other = self.other.map(|[radius, material]| (RADII[radius], &MATERIALS[material]));
        let hertz = match other {
            Some((other, partner)) => Hertz::pair([1.0; 2], [radius, other], [material, partner]),
            None => Hertz::wall(1.0, radius, [material, &GLASS]),
        };
        let ratio = move |depth| match other {
            Some((other, _)) => lens_ratio([radius, other], depth),
            None => cap_ratio(radius, depth),
        };
        (hertz, ratio)
    }

    /// Depth (m) of the first sphere, with this id, in its partner, and the unit vector to there.
    fn depth(&self, system: &Setup, id: usize) -> (f64, Vec3) {
        let at = |id: usize| system.particles[id].position();
        if self.other.is_some() {
            let line = at(id + 1) - at(id);
            let distance = line.norm();
            (radius(system, id) + radius(system, id + 1) - distance, line / distance)
        } else {
            (radius(system, id) - at(id).z, -Vec3::z())
        }
    }

    /// Adds the spheres of all depths; the first of them has this index in a grid of positions.
    fn add_to(&self, system: &mut Setup, first: usize) {
        // Every radius comes in all materials.
        let kind = |[radius, material]: [usize; 2]| radius * MATERIALS.len() + material;
        let radius = RADII[self.sphere[0]];
        let direction = Vec3::new(0.48, -0.6, 0.64);
        for (n, depth) in (first..).zip(depths()) {
            let height = if self.other.is_some() { 4e-3 } else { radius * (1.0 - depth) };
            // So far from each other that they do not touch.
            let at =
                Vec3::new((n % 12) as f64, (n / 12) as f64, 0.0) * 2.5e-3 + Vec3::new(2e-3, 2e-3, height);
            add(system, kind(self.sphere), at, Vec3::zeros());
            if let Some(other) = self.other {
                let distance = radius + RADII[other[0]] - depth * radius;
                add(system, kind(other), at + direction * distance, Vec3::zeros());
            }
        }
    }
}

/// Spheres in these contacts, pressed to all depths.
fn pressed(name: String, contacts: &[Contact], laws: Laws) -> Setup {
    let mut system = glass(name, 1.0, 0.0, laws);
    let kinds = RADII.iter().flat_map(|&radius| (0..2).map(move |material| sphere(radius, material)));
    system.templates = kinds.collect();
    system.contact = Some(model(&MATERIALS, &[1.0; 4], 0.0, laws));
    system.domain = open([64, 64, 16], 0.5e-3);
    if contacts.iter().any(|contact| contact.other.is_none()) {
        system.walls.push(plane(2, 0.0, true));
    }
    for (k, contact) in contacts.iter().enumerate() {
        contact.add_to(&mut system, k * depths().count());
    }
    system
}

/// Force at rest with the laws of cohesion that the engines have in common.
fn cohesive(name: &str, contacts: &[Contact], against: &Against, findings: &mut Findings) -> Result<()> {
    let laws: &[(CohesionLaw, &str)] = match against.name.id {
        "liggghts" => &[(CohesionLaw::Sjkr, "cohesion")],
        "lammps" => &[(CohesionLaw::Dmt, "dmt"), (CohesionLaw::Jkr, "jkr")],
        _ => &[],
    };
    for &(law, label) in laws {
        let mut system = pressed(format!("{name}-{label}"), contacts, SAME);
        if let Some(model) = &mut system.contact {
            model.cohesion = law;
            for ((pair, density), adhesion) in model.pairs.iter_mut().zip(DENSITY).zip(ADHESION) {
                (pair.cohesion_density, pair.work_of_adhesion) = (density, adhesion);
            }
        }
        let tracks = record(&system, against, STEP, 1)?;
        let mut id = 0;
        for contact in contacts {
            let (hertz, _) = contact.theory();
            let pair = contact.sphere[1] * MATERIALS.len() + contact.other.map_or(0, |[_, other]| other);
            let (mut apart, mut last) = (Vec::new(), [None; 3]);
            for depth in depths() {
                let (stored, towards) = contact.depth(&system, id);
                let forces = tracks.each_ref().map(|track| -track.resting_force(id).dot(&towards));
                if depth > CANCELLED {
                    let pull = match law {
                        CohesionLaw::Sjkr => DENSITY[pair] * stored,
                        _ => ADHESION[pair],
                    };
                    let size = hertz.force(stored) + 2.0 * PI * hertz.radius * pull;
                    apart.push((forces[0] - forces[1]).abs() / size);
                }
                last = [Some(forces[0]), Some(forces[1]), None];
                id += 1 + usize::from(contact.other.is_some());
            }
            let quantity = format!("force with {label}, d/R = 0.1, {} (N)", contact.what);
            let limit = if law == CohesionLaw::Sjkr { COHESIVE } else { ADHESIVE };
            findings.given(quantity, last, worst(apart), limit);
        }
    }
    Ok(())
}

/// Force at rest of contacts over all depths, under both laws of the native engine.
fn measure(name: &str, contacts: &[Contact], against: &Against, findings: &mut Findings) -> Result<()> {
    for (laws, label) in [(SAME, "hertz"), (OWN, "volume")] {
        let system = pressed(format!("{name}-{label}"), contacts, laws);
        let tracks = record(&system, against, STEP, 1)?;
        let mut id = 0;
        for contact in contacts {
            let (hertz, ratio) = contact.theory();
            let mut curve = Curve::default();
            for depth in depths() {
                let (stored, towards) = contact.depth(&system, id);
                curve.depth.push(depth);
                curve.hertz.push(hertz.force(stored));
                curve.ratio.push(ratio(stored));
                for (i, track) in tracks.iter().enumerate() {
                    let force = track.resting_force(id);
                    curve.forces[i].push(-force.dot(&towards));
                    if contact.other.is_some() {
                        let unpaired = (force + track.resting_force(id + 1)).norm() / force.norm();
                        curve.unpaired[i] = curve.unpaired[i].max(unpaired);
                    }
                }
                id += 1 + usize::from(contact.other.is_some());
            }
            curve.judge(findings, contact, laws, label);
        }
    }
    Ok(())
}

impl Curve {
    fn judge(&self, findings: &mut Findings, contact: &Contact, laws: Laws, label: &str) {
        let (what, stem, last) = (contact.what, contact.stem, self.depth.len() - 1);
        let same = laws == SAME;
        let ratio = |k: usize| if same { 1.0 } else { self.ratio[k] };
        let native = (0..=last).map(|k| self.forces[0][k] / (self.hertz[k] * ratio(k)) - 1.0);
        let other = (0..=last).map(|k| self.forces[1][k] / self.hertz[k] - 1.0);
        let deviation = worst(native.chain(other).map(f64::abs));
        let unit = if same { 1.0 } else { self.hertz[last] };
        let expected = if same { self.hertz[last] } else { self.ratio[last] };
        let values = [self.forces[0][last] / unit, self.forces[1][last] / unit, expected].map(Some);
        let (quantity, limit) = if same {
            (format!("force, d/R = 0.1, {what} (N)"), HERTZ)
        } else {
            (format!("force over Hertz, volume law, d/R = 0.1, {what} (-)"), VOLUME)
        };
        findings.given(quantity, values, deviation, limit);
        if contact.other.is_some() {
            let quantity = format!("sum of both forces over one, {what}, {label} law (-)");
            let values = [self.unpaired[0], self.unpaired[1], 0.0].map(Some);
            findings.given(quantity, values, worst(self.unpaired), PAIRWISE);
        }
        let curve = |ys: &[f64]| -> Points { self.depth.iter().zip(ys).map(|(&x, &y)| [x, y]).collect() };
        let over = |forces: &Vec<f64>| -> Vec<f64> {
            if same { forces.clone() } else { forces.iter().zip(&self.hertz).map(|(f, h)| f / h).collect() }
        };
        let engines = self.forces.each_ref().map(|forces| curve(&over(forces)));
        let (name, title, axis, theory) = if same {
            ("force", format!("Force at rest, {what}"), "force (N)", ("Hertz", &self.hertz))
        } else {
            let title = format!("Force at rest over Hertz, {what}, volume law");
            ("ratio", title, "force / Hertz", ("volume law", &self.ratio))
        };
        let theory = Some((theory.0, curve(theory.1)));
        let plot = findings.plot_both(format!("{name}_{stem}"), title, ["depth / R", axis], engines, theory);
        plot.logarithmic([true, same]);
    }
}

/// Pairs of equal and unequal spheres and materials, along a tilted line.
pub(super) fn pairs(against: &Against, findings: &mut Findings) -> Result<()> {
    let pair = |what, stem, sphere, other| Contact { what, stem, sphere, other: Some(other) };
    let contacts = [
        pair("equal", "r00_m00", [0, 0], [0, 0]),
        pair("R2 = 0.4 R1", "r01_m00", [0, 0], [1, 0]),
        pair("glass on soft", "r00_m01", [0, 0], [0, 1]),
        pair("R2 = 0.4 R1, soft on glass", "r01_m10", [0, 1], [1, 0]),
    ];
    measure("static-pair", &contacts, against, findings)?;
    cohesive("static-pair", &contacts, against, findings)
}

/// Spheres of both sizes and materials pressed into a wall of glass.
pub(super) fn wall(against: &Against, findings: &mut Findings) -> Result<()> {
    let wall = |what, stem, sphere| Contact { what, stem, sphere, other: None };
    let contacts = [wall("glass on glass", "r0_m0", [0, 0]), wall("small soft on glass", "r1_m1", [1, 1])];
    measure("static-wall", &contacts, against, findings)?;
    cohesive("static-wall", &contacts, against, findings)
}
