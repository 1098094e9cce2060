//! Discharge of spheres from vessels whose walls are meshes: `validation/hopper`.

use super::prelude::*;
use super::settling_tank::slope;
use super::vessels::{add_mesh, jitter, turned};
use std::f64::consts::PI;
use std::fmt::Write;
use turbid::wall::Motion;

const TEXT: &str = include_str!("../../../../validation/hopper/case.toml");

pub(super) const CASE: Case = Case {
    name: "hopper",
    question: "mass flow of spheres out of vessels with flat bottoms and with cones, all meshes",
    source: "Beverloo, Leniger and van de Velde (1961), doi:10.1016/0009-2509(61)85030-6",
    parts: &[
        Part::full(80.0, |context, found| discharge(context, (FLAT_6, SMOOTHER), TOLERANCE, found)),
        Part::full(100.0, |context, found| discharge(context, (FLAT_8, SMOOTHER), TOLERANCE, found)),
        Part::full(150.0, |context, found| discharge(context, (FLAT_10, SMOOTHER), TOLERANCE, found)),
        Part::full(100.0, |context, found| discharge(context, (FLAT_8, ROUGHER), f64::INFINITY, found)),
        Part::full(60.0, |context, found| discharge(context, (CONE_30, ROUGHER), TOLERANCE, found)),
        Part::full(80.0, |context, found| discharge(context, (CONE_15, ROUGHER), TOLERANCE, found)),
        Part::full(80.0, |context, found| discharge(context, (CONE_15, SMOOTHER), f64::INFINITY, found)),
    ],
};

/// Coefficients of friction (-). What the page says is beyond the tolerance is reported alone.
const SMOOTHER: f64 = 0.3;
const ROUGHER: f64 = 0.5;

/// A vessel; lengths in diameters of the spheres.
#[derive(Clone, Copy, Debug)]
struct Vessel {
    /// Width of the outlet.
    outlet: f64,
    radius: f64,
    /// Half-angle of the cone from the vertical (degrees).
    cone: Option<f64>,
    /// Height of the loose grid of spheres above the bottom or the cone.
    fill: f64,
    /// Time over which the flow is measured (s).
    window: f64,
}

const FLAT_6: Vessel = Vessel { outlet: 6.0, radius: 9.0, cone: None, fill: 25.0, window: 0.4 };
const FLAT_8: Vessel = Vessel { outlet: 8.0, radius: 10.0, cone: None, fill: 30.0, window: 0.3 };
const FLAT_10: Vessel = Vessel { outlet: 10.0, radius: 12.5, cone: None, fill: 34.0, window: 0.2 };
const CONE_30: Vessel = Vessel { outlet: 8.0, radius: 10.0, cone: Some(30.0), fill: 20.0, window: 0.2 };
const CONE_15: Vessel = Vessel { cone: Some(15.0), ..CONE_30 };

/// Constants of Beverloo's law for spheres (-).
const C: f64 = 0.58;
const K: f64 = 1.4;
/// Power of the factor of Rose and Tanaka (-), and the angle of the border of the grains at rest that they take where it is not known (degrees).
const POWER: f64 = -0.35;
const BORDER: f64 = 45.0;
/// Of the mass flow, as a part.
const TOLERANCE: f64 = 0.1;

/// Diameter of the spheres, their density, gravity, and the height of the outlet in the box (m).
const D: f64 = 3e-3;
const DENSITY: f64 = 2500.0;
const GRAVITY: f64 = 9.81;
const OUTLET: f64 = 0.015;
/// Distance between spheres at the start (diameters).
const SPACING: f64 = 1.06;
/// Time at which the outlet is opened, as in the case file, and from then until the flow is measured (s).
const OPENED: f64 = 0.15;
const STEADY: f64 = 0.08;
/// Heights between which the bulk density at rest is measured: from above the bottom or the cone, and up to below the top (diameters).
const ABOVE: f64 = 3.0;
const BELOW: f64 = 3.0;
const EVERY: u64 = 50;

impl Vessel {
    /// Height of the cone.
    fn neck(&self) -> f64 {
        self.cone.map_or(0.0, |angle| (self.radius - 0.5 * self.outlet) / angle.to_radians().tan())
    }

    fn top(&self) -> f64 {
        self.neck() + self.fill
    }

    /// Position of the axis in the box (m).
    fn axis(&self) -> f64 {
        (self.radius + 0.5) * D
    }

    /// Spheres on a grid, each up to a fortieth of a diameter off its point.
    fn grains(&self) -> String {
        let (mut list, slope) = (String::new(), self.cone.map(|angle| angle.to_radians().tan()));
        let most = (self.radius / SPACING).ceil() as i32;
        let (axis, mut n) = (self.axis(), 0.0);
        for layer in 0..((self.top() - 1.0) / SPACING) as u32 {
            let z = 0.55 + f64::from(layer) * SPACING;
            // As far from a cone as from the wall.
            let inner =
                slope.map_or(f64::INFINITY, |slope| 0.5 * self.outlet + z * slope - 0.58 * slope.hypot(1.0));
            let radius = (self.radius - 0.58).min(inner);
            for (i, j) in (-most..=most).flat_map(|i| (-most..=most).map(move |j| (i, j))) {
                let (x, y) = (f64::from(i) * SPACING, f64::from(j) * SPACING);
                if x.hypot(y) > radius {
                    continue;
                }
                n += 1.0;
                let jitter = jitter(n);
                let [x, y, z] = [x + jitter[0], y + jitter[1], z + jitter[2].abs()].map(|at| at * D);
                let _ = write!(list, "[{:.9e}, {:.9e}, {:.9e}],", axis + x, axis + y, OUTLET + z);
            }
        }
        list
    }

    /// The case with the vessel and this coefficient of friction.
    fn setup(&self, context: &SuiteContext, friction: f64) -> Result<Setup> {
        let (axis, top) = (self.axis(), self.top());
        let changes = [
            format!("domain.size=[{:e}, {:e}, {:e}]", 2.0 * axis, 2.0 * axis, OUTLET + (top + 1.0) * D),
            format!("particles.0.list=[{}]", self.grains()),
            format!("run.end.time={:e}", OPENED + STEADY + self.window),
            format!("contact.friction_static={friction}"),
            format!("contact.friction_kinetic={friction}"),
        ];
        let mut setup = context.setup(TEXT, CASE.name, &changes)?;
        let profile = [[0.5 * self.outlet, 0.0], [self.radius, self.neck()], [self.radius, top + 1.0]];
        let profile = profile.map(|ring| ring.map(|x| x * D));
        let mesh = turned(&profile, 96, None, |x, y, z| Vec3::new(axis + x, axis + y, OUTLET + z));
        add_mesh(&mut setup, "vessel", mesh, Motion::default());
        Ok(setup)
    }

    /// Mass flow by Beverloo's law with this bulk density (kg/m^3), and by the factor of Rose and Tanaka if it has a cone (kg/s).
    fn law(&self, bulk: f64) -> f64 {
        let factor =
            self.cone.map_or(1.0, |angle| (angle.to_radians().tan() * BORDER.to_radians().tan()).powf(POWER));
        factor * C * bulk * GRAVITY.sqrt() * ((self.outlet - K) * D).powf(2.5)
    }
}

/// Mass of the spheres between two heights over the volume of the vessel there (kg/m^3): from above the bottom or the cone up to below the surface,
/// under which 98 % of the centres are.
fn bulk(vessel: &Vessel, mut heights: Vec<f64>) -> f64 {
    heights.sort_by(f64::total_cmp);
    let low = OUTLET + (vessel.neck() + ABOVE) * D;
    let high = heights[heights.len() * 98 / 100] - BELOW * D;
    let inside = heights.iter().filter(|z| (low..high).contains(*z)).count();
    inside as f64 * mass() / (PI * (vessel.radius * D).powi(2) * (high - low))
}

fn mass() -> f64 {
    DENSITY * PI / 6.0 * D.powi(3)
}

fn discharge(
    context: &SuiteContext,
    (vessel, friction): (Vessel, f64),
    tolerance: f64,
    found: &mut Findings,
) -> Result<()> {
    let setup = vessel.setup(context, friction)?;
    // A session, as of `Watch`, has always the same particles.
    let mut run = Simulation::solo(&setup)?;
    run.advance((OPENED / setup.time_step) as u64)?;
    let density = bulk(&vessel, run.particles().iter().map(|of| of.position().z).collect());
    run.advance((STEADY / setup.time_step) as u64)?;
    let mut left = Vec::new();
    while run.steps_done() < setup.plan.end_step {
        run.advance(EVERY)?;
        left.push([run.steps_done() as f64 * setup.time_step, run.particles().len() as f64]);
    }
    let flow = -slope(&left) * mass();
    let bottom = vessel
        .cone
        .map_or("flat bottom".to_owned(), |angle| format!("cone of {angle} degrees to the vertical"));
    let what = format!("{bottom}, outlet of {} diameters, friction {friction}", vessel.outlet);
    let check = found.relative(format!("{what}: mass flow (kg/s)"), flow, vessel.law(density), tolerance);
    if vessel.cone.is_some() {
        check.source("Beverloo's law times the factor of Rose and Tanaka (1959)");
    }
    found.note(format!("{what}: bulk density at rest over that of the spheres (-)"), density / DENSITY);
    let parts: Vec<f64> =
        left.chunks(left.len().div_ceil(4)).map(|part| -slope(part) * mass() / flow).collect();
    let spread = parts.iter().map(|part| (part - 1.0).powi(2)).sum::<f64>() / (parts.len() as f64 - 1.0);
    let error = (spread / parts.len() as f64).sqrt();
    found.note(format!("{what}: standard error of the flow, of four parts of the time (-)"), error);
    Ok(())
}
