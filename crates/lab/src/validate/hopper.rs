//! Discharge of spheres from vessels whose walls are meshes: `validation/hopper`.

use super::prelude::*;
use super::settling_tank::slope;
use super::vessels::{add_mesh, turned};
use std::f64::consts::PI;
use std::fmt::Write;
use turbid::wall::Motion;

const TEXT: &str = include_str!("../../../../validation/hopper/case.toml");

pub(super) const CASE: Case = Case {
    name: "hopper",
    question: "mass flow of spheres out of a vessel with a flat bottom and with a cone, both meshes",
    source: "Beverloo, Leniger and van de Velde (1961), doi:10.1016/0009-2509(61)85030-6",
    parts: &[
        Part::full(120.0, |context, found| discharge(context, (5.0, None), found)),
        Part::full(120.0, |context, found| discharge(context, (6.0, None), found)),
        Part::full(120.0, |context, found| discharge(context, (7.0, None), found)),
        Part::full(120.0, |context, found| discharge(context, (6.0, Some(30.0)), found)),
    ],
};

/// Constants of Beverloo's law for spheres (-).
const C: f64 = 0.58;
const K: f64 = 1.4;
/// Power of the factor of Rose and Tanaka (-), and the angle of the border of the grains at rest that they take where it is not known (degrees).
const POWER: f64 = -0.35;
const BORDER: f64 = 45.0;
/// Of the mass flow, as a part.
const TOLERANCE: f64 = 0.1;

/// Diameter of the spheres, their density, gravity; the axis and the outlet in the box (m).
const D: f64 = 3e-3;
const DENSITY: f64 = 2500.0;
const GRAVITY: f64 = 9.81;
const AXIS: f64 = 0.028;
const OUTLET: f64 = 0.015;
/// Radius of the vessel (diameters), and height to which it is filled loosely above a cone.
const RADIUS: f64 = 8.75;
const FILL: [f64; 2] = [26.0, 20.0];
/// Distance between spheres at the start (diameters).
const SPACING: f64 = 1.06;
/// The outlet is opened, and the flow is steady from then on (s).
const OPENED: f64 = 0.2;
const STEADY: f64 = 0.3;
/// Heights between which the bulk density is measured: above the bottom or the cone (diameters).
const SLAB: [f64; 2] = [3.0, 9.0];
const EVERY: u64 = 50;

/// Height of a cone from an outlet (diameters) at an angle to the vertical (degrees) up to the vessel (diameters).
fn neck(outlet: f64, cone: Option<f64>) -> f64 {
    cone.map_or(0.0, |angle| (RADIUS - 0.5 * outlet) / angle.to_radians().tan())
}

/// Spheres on a grid in the vessel, each up to a fortieth of a diameter off its point.
fn grains(outlet: f64, cone: Option<f64>, top: f64) -> String {
    let (mut list, slope) = (String::new(), cone.map_or(f64::INFINITY, |angle| angle.to_radians().tan()));
    let most = (RADIUS / SPACING).ceil() as i32;
    let mut n = 0.0;
    for layer in 0..((top - 1.0) / SPACING) as u32 {
        let z = 0.55 + f64::from(layer) * SPACING;
        // As far from a cone as from the wall.
        let lean = (1.0 + slope.powi(-2)).sqrt();
        let inner =
            if cone.is_some() { 0.5 * outlet + (z - 0.55 * (lean - 1.0)) * slope - 0.55 } else { RADIUS };
        let radius = (RADIUS - 0.58).min(inner);
        for (i, j) in (-most..=most).flat_map(|i| (-most..=most).map(move |j| (i, j))) {
            let (x, y) = (f64::from(i) * SPACING, f64::from(j) * SPACING);
            if x.hypot(y) > radius {
                continue;
            }
            n += 1.0;
            // Fractional parts of multiples of square roots of primes.
            let jitter = [0.414_213_562, 0.732_050_808, 0.236_067_977]
                .map(|step: f64| 0.05 * ((n * step).fract() - 0.5));
            let [x, y, z] = [x + jitter[0], y + jitter[1], z + jitter[2].abs()].map(|at| at * D);
            let _ = write!(list, "[{:.9e}, {:.9e}, {:.9e}],", AXIS + x, AXIS + y, OUTLET + z);
        }
    }
    list
}

fn discharge(context: &SuiteContext, (outlet, cone): (f64, Option<f64>), found: &mut Findings) -> Result<()> {
    let neck = neck(outlet, cone);
    let top = neck + FILL[usize::from(cone.is_some())];
    let changes = [
        format!("domain.size=[{:e}, {:e}, {:e}]", 2.0 * AXIS, 2.0 * AXIS, OUTLET + (top + 1.0) * D),
        format!("particles.0.list=[{}]", grains(outlet, cone, top)),
    ];
    let mut setup = context.setup(TEXT, CASE.name, &changes)?;
    let profile = [[0.5 * outlet, 0.0], [RADIUS, neck], [RADIUS, top + 1.0]].map(|ring| ring.map(|x| x * D));
    let vessel = turned(&profile, 96, None, |x, y, z| Vec3::new(AXIS + x, AXIS + y, OUTLET + z));
    add_mesh(&mut setup, "vessel", vessel, Motion::default());

    // Time, spheres, and those of the slab.
    let slab = SLAB.map(|at| OUTLET + (neck + at) * D);
    // A session, as of `Watch`, has always the same particles.
    let (mut run, mut rows) = (Simulation::solo(&setup)?, Vec::new());
    for _ in 0..setup.plan.end_step / EVERY {
        run.advance(EVERY)?;
        let all = run.particles();
        let inside = all.iter().filter(|of| (slab[0]..slab[1]).contains(&of.position().z)).count();
        rows.push([run.steps_done() as f64 * setup.time_step, all.len() as f64, inside as f64]);
    }
    let mass = DENSITY * PI / 6.0 * D.powi(3);
    let at_rest = rows.iter().rev().find(|row| row[0] <= OPENED).expect("rows before it is opened");
    let area = PI * (RADIUS * D).powi(2);
    let bulk = at_rest[2] * mass / (area * (slab[1] - slab[0]));
    let points: Vec<[f64; 2]> =
        rows.iter().filter(|row| row[0] >= STEADY).map(|row| [row[0], row[1]]).collect();
    let flow = -slope(&points) * mass;
    let law = C * bulk * GRAVITY.sqrt() * ((outlet - K) * D).powf(2.5);
    let factor = cone.map_or(1.0, |angle| (angle.to_radians().tan() * BORDER.to_radians().tan()).powf(POWER));
    let bottom =
        cone.map_or("flat bottom".to_owned(), |angle| format!("cone of {angle} degrees to the vertical"));
    let what = format!("outlet of {outlet} diameters, {bottom}");
    let check = found.relative(format!("{what}: mass flow (kg/s)"), flow, law * factor, TOLERANCE);
    if cone.is_some() {
        check.source("Beverloo's law times the factor of Rose and Tanaka (1959)");
    }
    found.note(format!("{what}: bulk density over that of the spheres (-)"), bulk / DENSITY);
    Ok(())
}
