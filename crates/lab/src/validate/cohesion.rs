//! Cohesion of spheres: `validation/cohesion`.

use super::prelude::*;
use std::f64::consts::PI;

const LIFT: &str = include_str!("../../../../validation/cohesion/case.toml");
const PULL: &str = include_str!("../../../../validation/cohesion/pull.toml");
const STICK: &str = include_str!("../../../../validation/cohesion/stick.toml");
const CYCLE: &str = include_str!("../../../../validation/cohesion/cycle.toml");
const IMPACT: &str = include_str!("../../../../validation/cohesion/impact.toml");
const GAP: &str = include_str!("../../../../validation/cohesion/gap.toml");

pub(super) const CASE: Case = Case {
    name: "cohesion",
    question: "cohesion of spheres: pull-off force, weight that a plate lifts, depth at rest, energy of parting, approach by van der Waals forces",
    source: DMT,
    parts: &[
        Part::quick(1.0, pull),
        Part::quick(1.0, lift),
        Part::quick(1.0, stick),
        Part::quick(1.0, cycle),
        Part::quick(1.0, impact),
        Part::quick(1.0, approach),
    ],
};

const DMT: &str = "2 pi w R*, Derjaguin, Muller and Toporov (1975), doi:10.1016/0021-9797(75)90018-1";
const JKR: &str = "Johnson, Kendall and Roberts (1971), doi:10.1098/rspa.1971.0141";
const NING: &str = "JKR: Thornton and Ning (1998), doi:10.1016/S0032-5910(98)00099-0";
const HAMAKER: &str = "work of A R* / (6 h^2): Hamaker (1937), doi:10.1016/S0031-8914(37)80203-7";
const LAWS: [&str; 2] = ["overlap_volume", "hertz"];
const RADIUS: f64 = 1e-3;
/// Work of adhesion (J/m^2) and density of the energy of cohesion (J/m^3) of the cases.
const WORK: f64 = 0.05;
const DENSITY: f64 = 3e4;
/// Of the pull-off force and of the depth at rest, as a part.
const TOLERANCE: f64 = 5e-3;
/// Of the speed at which spheres meet, as a part.
const APPROACH: f64 = 0.01;
/// Of the height of a lifted sphere over that of the plate (-).
const HEIGHT: f64 = 0.02;

/// Effective modulus (Pa) of a case of one material.
fn modulus(setup: &Setup) -> f64 {
    setup.contact.as_ref().map_or(f64::NAN, |model| {
        let material = model.materials[0];
        0.5 * material.youngs_modulus / (1.0 - material.poisson_ratio * material.poisson_ratio)
    })
}

/// Square (m^2) of the radius of the disc, in which spheres with this effective radius (m) meet just before they part, and the energy (J) that a cycle of touching
/// and parting takes: with `a = u^2 a_c` the force is `pi w R (u^6 / 6 - u^3)` over the depth `(u^4 - 4 u) a_c^2 / R`, from `u = 1`, where
/// they part, to `u^3 = 4`, where they touch.
fn parting(radius: f64, modulus: f64) -> [f64; 2] {
    let square = (PI * WORK * radius * radius / (8.0 * modulus)).cbrt().powi(2);
    [square, PI * WORK * square * (2.4 * 4.0_f64.cbrt() + 0.4)]
}

/// Largest force by which a sphere is pulled back as it is moved slowly away from another.
fn pull(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    for law in LAWS {
        let setup = context.setup(PULL, CASE.name, &[format!("contact.law={law:?}")])?;
        let mut run = Simulation::solo(&setup)?;
        let (mut largest, mut deepest) = (0.0_f64, 0.0_f64);
        let mut history = Vec::new();
        for _ in 0..setup.plan.end_step {
            run.advance(1)?;
            let depth = 2.0 * RADIUS - (run.particles()[1].position() - run.particles()[0].position()).norm();
            deepest = deepest.max(depth);
            for state in run.contact_states() {
                // On the first, whose partner is at larger x.
                let force = state.force[0];
                largest = largest.max(force);
                history.push([depth * 1e6, force * 1e6]);
            }
        }
        if run.dem().contacts().count > 0 || deepest < 1e-6 {
            return Err(unsteady("depth (m)", deepest));
        }
        let quantity = format!("largest force by which two spheres are pulled apart, law {law} (N)");
        found.relative(quantity, largest, PI * WORK * RADIUS, TOLERANCE);
        if law == "hertz" {
            let modulus = modulus(&setup);
            let theory = (0..=100).map(|n| f64::from(n) * 0.02e-6).map(|depth| {
                let elastic = 4.0 / 3.0 * modulus * (0.5 * RADIUS).sqrt() * depth.powf(1.5);
                [depth * 1e6, (PI * WORK * RADIUS - elastic) * 1e6]
            });
            found.plot(
                "pull",
                "Force between two spheres of 2 mm, work of adhesion 0.05 J/m2",
                ["overlap (um)", "pull (uN)"],
                [reference("Hertz and DMT", theory.collect::<Vec<_>>()), measured("measured", history)],
            );
        }
    }
    Ok(())
}

/// Spheres a little lighter and heavier than the pull-off force, under a plate that rises.
fn lift(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    for law in LAWS {
        let setup = context.setup(LIFT, CASE.name, &[format!("contact.law={law:?}")])?;
        let mut run = Simulation::solo(&setup)?;
        run.advance(setup.plan.end_step)?;
        let plate =
            setup.walls.iter().find(|wall| wall.name == "plate").map(|plate| plate.surface_at(run.time()));
        let height = plate.map_or(f64::NAN, |plate| plate.distance(Vec3::zeros())) - 2.0 * RADIUS;
        for (n, what, lifted) in
            [(0, "0.98 of the pull-off force", 1.0), (1, "1.02 of the pull-off force", 0.0)]
        {
            let part = (run.particles()[n].position().z - RADIUS) / height;
            let quantity = format!("height of a sphere of {what} over that of the plate, law {law} (-)");
            found.absolute(quantity, part, lifted, HEIGHT);
        }
    }
    Ok(())
}

/// Depth at rest of spheres that stick by the area of their overlap.
fn stick(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let setup = context.setup(STICK, CASE.name, &[])?;
    let mut run = Simulation::solo(&setup)?;
    run.advance(setup.plan.end_step)?;
    let (all, contacts) = (run.particles(), run.dem().contacts());
    if contacts.count != 2 {
        return Err(unsteady("contacts at rest", contacts.count as f64));
    }
    let part = 1.5 * PI * DENSITY / modulus(&setup);
    let pair = 2.0 * RADIUS - (all[1].position() - all[0].position()).norm();
    for (what, depth, radius) in
        [("two spheres", pair, 0.5 * RADIUS), ("a sphere and a wall", RADIUS - all[2].position().z, RADIUS)]
    {
        let quantity = format!("depth at which {what} stick, cohesion by density (m)");
        found
            .relative(quantity, depth, radius * part * part, TOLERANCE)
            .source("Hertz and k A: R* (3 pi k / (2 E*))^2 of small overlaps");
    }
    Ok(())
}

/// Force and energy of a slow cycle in which spheres touch and part, by the law of Johnson, Kendall and Roberts.
fn cycle(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let setup = context.setup(CYCLE, CASE.name, &[])?;
    let mut run = Simulation::solo(&setup)?;
    let [square, energy] = parting(0.5 * RADIUS, modulus(&setup));
    let (mut largest, mut widest, mut lost) = (0.0_f64, 0.0_f64, 0.0);
    let mut history = Vec::new();
    let depth = |run: &Simulation| {
        2.0 * RADIUS - (run.particles()[1].position() - run.particles()[0].position()).norm()
    };
    for _ in 0..setup.plan.end_step {
        let before = depth(&run);
        run.advance(1)?;
        for state in run.contact_states() {
            let force = state.force[0];
            largest = largest.max(force);
            widest = widest.max(-state.depth);
            lost += force * (before - depth(&run));
            history.push([state.depth * 1e6, force * 1e6]);
        }
    }
    if run.dem().contacts().count > 0 || history.is_empty() {
        return Err(unsteady("contacts at the end", run.dem().contacts().count as f64));
    }
    let pull_off = 1.5 * PI * WORK * 0.5 * RADIUS;
    found
        .relative(
            "largest force by which two spheres are pulled apart, jkr (N)",
            largest,
            pull_off,
            TOLERANCE,
        )
        .source(JKR);
    let stretch = 3.0 * square / (0.5 * RADIUS);
    found
        .relative("gap over which two spheres hold on to each other, jkr (m)", widest, stretch, TOLERANCE)
        .source(JKR);
    found.relative("energy that touching and parting takes, jkr (J)", lost, energy, TOLERANCE).source(NING);
    let theory = (0..=100).map(|n| 1.0 + 0.014 * f64::from(n)).map(|u: f64| {
        let depth = (u.powi(4) - 4.0 * u) * square / (0.5 * RADIUS);
        [depth * 1e6, PI * WORK * 0.5 * RADIUS * (u.powi(3) - u.powi(6) / 6.0) * 1e6]
    });
    found.plot(
        "neck",
        "Force between two spheres of 2 mm that touch and part, work of adhesion 0.05 J/m2",
        ["overlap (um)", "pull (uN)"],
        [
            reference("Johnson, Kendall and Roberts", theory.collect::<Vec<_>>()),
            measured("measured", history),
        ],
    );
    Ok(())
}

/// Restitution of elastic spheres that need energy to part from a wall.
fn impact(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let setup = context.setup(IMPACT, CASE.name, &[])?;
    let mut run = Simulation::solo(&setup)?;
    let before: Vec<f64> = run.particles().iter().map(|sphere| sphere.velocity().z).collect();
    run.advance(setup.plan.end_step)?;
    let [_, energy] = parting(RADIUS, modulus(&setup));
    let slowest = (2.0 * energy / setup.templates[0].mass()).sqrt();
    if run.dem().contacts().count != 1 {
        return Err(unsteady("spheres that stick", run.dem().contacts().count as f64));
    }
    for (sphere, before) in run.particles().iter().zip(before).skip(1) {
        let quantity = format!("restitution of an elastic impact at {:.0} mm/s, jkr (-)", -1e3 * before);
        let (speed, theory) = (sphere.velocity().z, (1.0 - (slowest / before).powi(2)).sqrt());
        found.relative(quantity, -speed / before, theory, TOLERANCE).source(NING);
    }
    Ok(())
}

/// Speed with which spheres that the van der Waals force draws over a gap touch a sphere and a wall, and the force that holds them there.
fn approach(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let setup = context.setup(GAP, CASE.name, &[])?;
    let mut run = Simulation::solo(&setup)?;
    let (radius, start, mass) = (5e-6, 20e-9, setup.templates[0].mass());
    let start_height = run.particles()[3].position();
    let mut speeds = [None; 2];
    for _ in 0..setup.plan.end_step {
        run.advance(1)?;
        let [left, right, lower, _] = run.particles() else { return Err(unsteady("spheres", 0.0)) };
        let gap = (right.position() - left.position()).norm() - 2.0 * radius;
        if gap <= 0.0 {
            speeds[0].get_or_insert(left.velocity().x - right.velocity().x);
        }
        if lower.position().z <= radius {
            speeds[1].get_or_insert(-lower.velocity().z);
        }
        if speeds.iter().all(Option::is_some) {
            break;
        }
    }
    let [constant, least] = [1e-19, 1e-9];
    for (what, speed, [reduced, moved]) in [
        ("two spheres", speeds[0], [0.5 * radius, 0.5 * mass]),
        ("a sphere and a wall", speeds[1], [radius, mass]),
    ] {
        // From the start to the smallest gap, and on to contact under the force there.
        let work = constant * reduced / 6.0 * (1.0 / least - 1.0 / start + 1.0 / least);
        let quantity = format!("speed at which {what} meet, drawn from a gap of 20 nm (m/s)");
        found
            .relative(quantity, speed.unwrap_or(f64::NAN), (2.0 * work / moved).sqrt(), APPROACH)
            .source(HAMAKER);
    }
    let moved = (run.particles()[3].position() - start_height).norm();
    found.absolute("way of a sphere beyond the cut-off (m)", moved, 0.0, 0.0);
    Ok(())
}
