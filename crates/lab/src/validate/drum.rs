//! Spheres in a rotating drum that is a mesh: `validation/drum`.

use super::prelude::*;
use super::vessels::{add_mesh, turned};
use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};
use std::fmt::Write;
use turbid::domain::Domain;
use turbid::wall::{FreeSide, Motion};

const TEXT: &str = include_str!("../../../../validation/drum/case.toml");

pub(super) const CASE: Case = Case {
    name: "drum",
    question: "slope of spheres in a half-full rotating drum, a mesh, and the work of the drum against what contacts dissipate",
    source: "Kleinhans et al. (2011), doi:10.1029/2011JE003865",
    parts: &[Part::full(600.0, rolling)],
};

/// Rounded grains, averaged over time, and how far it may be off (degrees).
const SLOPE: f64 = 25.0;
const TOLERANCE: f64 = 2.5;
/// Of the energies over one revolution, as a part.
const BALANCE: f64 = 0.01;

/// Diameter of the spheres, their density, gravity; the axis in the box and its length (m).
const D: f64 = 2e-3;
const DENSITY: f64 = 2500.0;
const GRAVITY: f64 = 9.81;
const AXIS: f64 = 0.026;
const LENGTH: f64 = 0.012;
/// Radius of the drum (diameters), and volume fraction of the spheres at rest, by which their number follows (-).
const RADIUS: f64 = 12.0;
const FRACTION: f64 = 0.6;
/// Distance between spheres at the start (diameters).
const SPACING: f64 = 1.06;
/// Froude number `w^2 R / g` (-): the rolling regime is from 1e-4 to 1e-2.
const FROUDE: f64 = 4e-3;
/// Revolutions before the one that is measured.
const BEFORE: f64 = 0.3;
/// Steps between two samples.
const EVERY: u64 = 50;

/// The lower layers of a grid in the drum, as many spheres as fill half of it.
fn grains() -> String {
    let count = PI / 8.0 * (2.0 * RADIUS).powi(2) * (LENGTH / D) * FRACTION * 6.0 / PI;
    let (most, mut list, mut n) = ((RADIUS / SPACING) as i32, String::new(), 0.0);
    let along = (LENGTH / D / SPACING).floor();
    for (k, i) in (-most..=most).flat_map(|k| (-most..=most).map(move |i| (k, i))) {
        let (x, z) = (f64::from(i) * SPACING, f64::from(k) * SPACING);
        if x.hypot(z) > RADIUS - 0.58 {
            continue;
        }
        for j in 0..along as u32 {
            n += 1.0;
            if n > count {
                return list;
            }
            // Fractional parts of multiples of square roots of primes.
            let jitter = [0.414_213_562, 0.732_050_808, 0.236_067_977]
                .map(|step: f64| 0.05 * ((n * step).fract() - 0.5));
            let y = (f64::from(j) + 0.5) * LENGTH / along;
            let [x, z] = [x + jitter[0], z + jitter[2]].map(|at| AXIS + at * D);
            let _ = write!(list, "[{x:.9e}, {:.9e}, {z:.9e}],", y + jitter[1] * D);
        }
    }
    list
}

/// Of the last step: power of the drum, power that contacts take out of normal motions and by friction (W), the centre of mass from the axis
/// across and up (m), and kinetic and gravitational energy (J).
///
/// The leapfrog has velocities half a step after the positions at which it finds the forces.
fn sample(run: &Simulation, domain: &Domain, [rate, dt]: [f64; 2]) -> [f64; 6] {
    let store = run.dem().particles();
    let mass = DENSITY * PI / 6.0 * D.powi(3);
    let inertia = 0.1 * mass * D * D;
    let weight = Vec3::z() * (-GRAVITY * mass);
    let half = 0.5 * dt;
    let mut all = BTreeMap::new();
    let (mut sum, mut energy) = (Vec3::zeros(), 0.0);
    for of in store.owned() {
        let force = Vec3::from(of.contact_force) + weight;
        let velocity = of.velocity() - force * (half / mass);
        let turning = of.angular_velocity() - Vec3::from(of.contact_torque) * (half / inertia);
        let position = of.position() - of.velocity() * dt;
        sum += position;
        energy += 0.5 * mass * velocity.norm_squared() + 0.5 * inertia * turning.norm_squared();
        energy += mass * GRAVITY * position.z;
        all.insert(of.id, (position, velocity, turning));
    }
    let axis = Vec3::new(AXIS, 0.0, AXIS);
    let turn = Vec3::y() * rate;
    let (mut driven, mut normal, mut friction) = (0.0, 0.0, 0.0);
    for state in run.dem().contact_states() {
        let (point, force, along) =
            (Vec3::from(state.point), Vec3::from(state.force), Vec3::from(state.normal));
        let at = |id: &u64| {
            all.get(id).map(|(position, velocity, turning)| {
                velocity + turning.cross(&domain.nearest_image(point - position))
            })
        };
        let own = at(&state.first).expect("the first body is a particle");
        let other = at(&state.second).unwrap_or_else(|| {
            let wall = turn.cross(&(point - axis));
            driven += force.dot(&wall);
            wall
        });
        let relative = own - other;
        let across = force.dot(&along) * relative.dot(&along);
        normal -= across;
        friction -= force.dot(&relative) - across;
    }
    let centre = sum / store.owned().len() as f64 - axis;
    [driven, normal, friction, centre.x, centre.z, energy]
}

fn rolling(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let rate = (FROUDE * GRAVITY / (RADIUS * D)).sqrt();
    let period = TAU / rate;
    let changes =
        [format!("particles.0.list=[{}]", grains()), format!("run.end.time={:e}", (1.0 + BEFORE) * period)];
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
    let rows = watch.rows(|run, rows: &mut Vec<[f64; 6]>| {
        if run.steps_done()? as f64 * dt >= BEFORE * period {
            rows.push(run.on_root(move |run| Ok(sample(run, &domain, [rate, dt])))?);
        }
        Ok(false)
    })?;
    let mean = |of: &dyn Fn(&[f64; 6]) -> f64| rows.iter().map(of).sum::<f64>() / rows.len() as f64;
    let slopes = |row: &[f64; 6]| row[3].atan2(-row[4]).abs().to_degrees();
    let [work, normal, friction] = [0, 1, 2].map(|n| mean(&|row| row[n]) * period);
    let what = format!("half-full drum of {} diameters, Froude number {FROUDE}", 2.0 * RADIUS);
    found.absolute(format!("{what}: slope (degrees)"), mean(&slopes), SLOPE, TOLERANCE);
    found
        .relative(
            format!("{what}: energy that contacts dissipate over the work of the drum (-)"),
            (normal + friction) / work,
            1.0,
            BALANCE,
        )
        .source("conservation of energy over a revolution");
    found.note(format!("{what}: part of it by friction (-)"), friction / (normal + friction));
    let [first, last] = [rows.first(), rows.last()].map(|row| row.expect("rows")[5]);
    found.note(
        format!("{what}: energy of the grains gained over the work of the drum (-)"),
        (last - first) / work,
    );
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
                .step_by(20)
                .enumerate()
                .map(|(n, row)| [BEFORE + n as f64 * 20.0 * EVERY as f64 * dt / period, slopes(row)])
                .collect::<Vec<_>>(),
        )],
    );
    Ok(())
}
