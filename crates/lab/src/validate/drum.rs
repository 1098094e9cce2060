//! Spheres in a rotating drum that is a mesh: `validation/drum`.

use super::prelude::*;
use super::vessels::{add_mesh, jitter, turned};
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};
use std::fmt::Write;
use turbid::domain::Domain;
use turbid::wall::{FreeSide, Motion};

const TEXT: &str = include_str!("../../../../validation/drum/case.toml");

pub(super) const CASE: Case = Case {
    name: "drum",
    question: "slope of spheres in a half-full rotating drum, a mesh, and the work of the drum against what contacts dissipate",
    source: "Kleinhans et al. (2011), doi:10.1029/2011JE003865",
    parts: &[Part::full(240.0, rolling)],
};

/// Rounded grains, averaged over time, and how far it may be off (degrees).
const SLOPE: f64 = 25.0;
const TOLERANCE: f64 = 2.5;
/// Of the work of the drum, as a part.
const BALANCE: f64 = 0.01;

/// Diameter of the spheres, their density, gravity; the axis in the box and its length (m).
const D: f64 = 2e-3;
const DENSITY: f64 = 2500.0;
const GRAVITY: f64 = 9.81;
const AXIS: f64 = 0.038;
const LENGTH: f64 = 0.01;
/// Radius of the drum (diameters), and volume fraction of the spheres at rest, by which their number follows (-).
const RADIUS: f64 = 18.0;
const FRACTION: f64 = 0.6;
/// Distance between spheres at the start (diameters).
const SPACING: f64 = 1.06;
/// Slope at the start (degrees).
const START: f64 = 25.0;
/// Froude number `w^2 R / g` (-): single avalanches are below 1e-3, the rolling regime is from 1e-4 to 1e-2.
const FROUDE: f64 = 4e-4;
/// Effective modulus of two spheres, and of a sphere and a wall of the same material, `E / (2 (1 - nu^2))` of those of the case file (Pa).
const EFFECTIVE_MODULUS: f64 = 5e5 / (2.0 * (1.0 - 0.25 * 0.25));
/// Revolutions before what is measured, and of it.
const BEFORE: f64 = 0.1;
const MEASURED: f64 = 0.15;
/// Steps between two samples.
const EVERY: u64 = 10;

/// The lower part of a grid in the drum, under a surface that already slopes, as many spheres as fill half of it.
fn grains() -> String {
    let count = (PI / 8.0 * (2.0 * RADIUS).powi(2) * (LENGTH / D) * FRACTION * 6.0 / PI) as usize;
    let most = (RADIUS / SPACING) as i32;
    let along = (LENGTH / D / SPACING).floor();
    let mut points: Vec<[f64; 2]> = (-most..=most)
        .flat_map(|k| (-most..=most).map(move |i| [f64::from(i) * SPACING, f64::from(k) * SPACING]))
        .filter(|[x, z]| x.hypot(*z) < RADIUS - 0.58)
        .collect();
    let (sine, cosine) = START.to_radians().sin_cos();
    let height = |[x, z]: &[f64; 2]| x * sine + z * cosine;
    points.sort_by(|a, b| height(a).total_cmp(&height(b)));
    let (mut list, mut n) = (String::new(), 0.0);
    for ([x, z], j) in points.iter().flat_map(|point| (0..along as u32).map(move |j| (point, j))).take(count)
    {
        n += 1.0;
        let jitter = jitter(n);
        let y = (f64::from(j) + 0.5) * LENGTH / along;
        let [x, z] = [x + jitter[0], z + jitter[2]].map(|at| AXIS + at * D);
        let _ = write!(list, "[{x:.9e}, {:.9e}, {z:.9e}],", y + jitter[1] * D);
    }
    list
}

/// Of the time of the last forces.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
struct Sample {
    /// Power that the drum gives the spheres: its angular velocity times the torque of its contacts (W).
    drum: f64,
    /// Power that damping takes out of normal motions, and that friction takes (W).
    damping: f64,
    friction: f64,
    /// Centre of mass from the axis, across and up (m).
    centre: [f64; 2],
    /// Energies: of motion and weight, and of the overlaps (J).
    mechanical: f64,
    elastic: f64,
}

/// The time of the forces is a step ago: positions have moved with the velocity of half a step later, and the velocities of the particles are those
/// of now, as if the forces had stayed.
fn sample(run: &Simulation, domain: &Domain, [rate, dt]: [f64; 2]) -> Sample {
    let store = run.dem().particles();
    let mass = DENSITY * PI / 6.0 * D.powi(3);
    let inertia = 0.1 * mass * D * D;
    let weight = Vec3::z() * (-GRAVITY * mass);
    // Ids are those of the list.
    let mut all = vec![[Vec3::zeros(); 3]; store.owned().len()];
    let (mut sum, mut found) = (Vec3::zeros(), Sample::default());
    for of in store.owned() {
        let force = Vec3::from(of.contact_force) + weight;
        let change = force * (dt / mass);
        let velocity = of.velocity() - change;
        let turning = of.angular_velocity() - Vec3::from(of.contact_torque) * (dt / inertia);
        let position = of.position() - (of.velocity() - change * 0.5) * dt;
        sum += position;
        found.mechanical += 0.5 * mass * velocity.norm_squared() + 0.5 * inertia * turning.norm_squared();
        found.mechanical += mass * GRAVITY * position.z;
        all[of.id as usize] = [position, velocity, turning];
    }
    let axis = Vec3::new(AXIS, 0.0, AXIS);
    let turn = Vec3::y() * rate;
    let centre = sum / all.len() as f64 - axis;
    found.centre = [centre.x, centre.z];
    for state in run.contact_states() {
        let [point, force, along] = [state.point, state.force, state.normal].map(Vec3::from);
        let at = |id: u64| {
            all.get(id as usize).map(|[position, velocity, turning]| {
                velocity + turning.cross(&domain.nearest_image(point - position))
            })
        };
        let own = at(state.first).expect("the first body is a sphere");
        let other = at(state.second);
        let radius = if other.is_some() { 0.25 * D } else { 0.5 * D };
        let lever = point - axis;
        if other.is_none() {
            found.drum += rate * lever.cross(&force).y;
        }
        let relative = own - other.unwrap_or_else(|| turn.cross(&lever));
        // Hertz (1882); what is left of the normal force is damping.
        let stiffness = 4.0 / 3.0 * EFFECTIVE_MODULUS * radius.sqrt();
        found.elastic += 0.4 * stiffness * state.depth.powf(2.5);
        let elastic = along * (-stiffness * state.depth.powf(1.5));
        let normal = along * force.dot(&along);
        found.damping -= (normal - elastic).dot(&relative);
        found.friction -= (force - normal).dot(&relative);
    }
    found
}

fn rolling(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let rate = (FROUDE * GRAVITY / (RADIUS * D)).sqrt();
    let period = TAU / rate;
    let changes = [
        format!("particles.0.list=[{}]", grains()),
        format!("run.end.time={:e}", (BEFORE + MEASURED) * period),
    ];
    let mut setup = context.setup(TEXT, CASE.name, &changes)?;
    let [low, high] = [-4.0 * D, LENGTH + 4.0 * D];
    let radius = RADIUS * D;
    let profile = [[0.0, low], [radius, low], [radius, high], [0.0, high]];
    let drum = turned(&profile, 192, Some(FreeSide::Inside), |a, b, y| Vec3::new(AXIS + b, y, AXIS + a));
    let pivot = Vec3::new(AXIS, 0.0, AXIS);
    let motion = Motion { angular_velocity: (Vec3::y() * rate).into(), pivot, ..Motion::default() };
    add_mesh(&mut setup, "drum", drum, motion);

    let (dt, domain) = (setup.time_step, setup.domain);
    let watch = Watch { context, setup: &setup, threads: 1, every: EVERY };
    let rows = watch.rows(|run, rows: &mut Vec<Sample>| {
        if run.steps_done()? as f64 * dt >= BEFORE * period {
            rows.push(run.on_root(move |run| Ok(sample(run, &domain, [rate, dt])))?);
        }
        Ok(false)
    })?;
    let mean = |of: &dyn Fn(&Sample) -> f64| rows.iter().map(of).sum::<f64>() / rows.len() as f64;
    let slopes = |row: &Sample| row.centre[0].atan2(-row.centre[1]).abs().to_degrees();
    // From the first sample to the last.
    let time = (rows.len() - 1) as f64 * EVERY as f64 * dt;
    let integral = |of: &dyn Fn(&Sample) -> f64| {
        let ends = 0.5 * (of(&rows[0]) + of(&rows[rows.len() - 1]));
        (rows.iter().map(of).sum::<f64>() - ends) / (rows.len() - 1) as f64 * time
    };
    let gain = |of: &dyn Fn(&Sample) -> f64| of(&rows[rows.len() - 1]) - of(&rows[0]);
    let work = integral(&|row| row.drum);
    let [damping, friction] = [integral(&|row| row.damping), integral(&|row| row.friction)];
    let [mechanical, elastic] = [gain(&|row| row.mechanical), gain(&|row| row.elastic)];
    let what = format!("half-full drum of {} diameters, Froude number {FROUDE}", 2.0 * RADIUS);
    found.absolute(format!("{what}: slope (degrees)"), mean(&slopes), SLOPE, TOLERANCE);
    found
        .relative(
            format!("{what}: energy dissipated and gained over the work of the drum (-)"),
            (damping + friction + mechanical + elastic) / work,
            1.0,
            BALANCE,
        )
        .source("conservation of energy");
    for (name, part) in [
        ("damping", damping),
        ("friction", friction),
        ("motion and weight", mechanical),
        ("overlaps", elastic),
    ] {
        found.note(format!("{what}: part of the work of the drum that went to {name} (-)"), part / work);
    }
    let spread =
        rows.iter().map(slopes).fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| [a.min(x), b.max(x)]);
    found.note(format!("{what}: largest less smallest slope (degrees)"), spread[1] - spread[0]);
    found.plot(
        "slope".to_owned(),
        "Slope of spheres in a half-full drum".to_owned(),
        ["revolutions", "slope (degrees)"],
        [measured(
            "by the centre of mass",
            rows.iter()
                .step_by(100)
                .enumerate()
                .map(|(n, row)| [BEFORE + n as f64 * 100.0 * EVERY as f64 * dt / period, slopes(row)])
                .collect::<Vec<_>>(),
        )],
    );
    Ok(())
}
