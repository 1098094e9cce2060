//! Bodies of several parts: `validation/composites`.

use super::prelude::*;
use std::f64::consts::PI;
use std::sync::Arc;
use turbid::math::{Mat3, Quat};
use turbid::shape::polyhedron::COMPUTED;
use turbid::shape::{Composite, Polyhedron, Shape, Sphere};

const BODIES: &str = include_str!("../../../../validation/composites/bodies.toml");
const IMPACT: &str = include_str!("../../../../validation/composites/impact.toml");
const HOOK: &str = include_str!("../../../../validation/composites/hook.toml");
const PILE: &str = include_str!("../../../../validation/composites/pile.toml");
const DRAG: &str = include_str!("../../../../validation/composites/drag.toml");
const REFERENCE: &str = include_str!("../../../../validation/composites/reference.csv");
const LIGGGHTS: &str = include_str!("../../../../validation/composites/liggghts.csv");

pub(super) const CASE: Case = Case {
    name: "composites",
    question: "bodies of several parts: mass properties, free flight, impact, a hook, drag of two spheres that touch",
    source: "integrals over the union of the parts",
    parts: &[
        Part::quick(1.0, bodies),
        Part::quick(1.0, flight),
        Part::quick(1.0, impact),
        Part::quick(5.0, hook),
        Part::full(60.0, pile),
        Part::quick(20.0, |context, found| drag(context, found, &ALONG)),
        Part::quick(20.0, |context, found| drag(context, found, &ACROSS)),
    ],
};

/// Of volumes and moments, of angular momentum, and of the velocities after an impact.
const MASS: f64 = 1e-3;
const MOMENTUM: f64 = 1e-12;
const AFTER: f64 = 5e-3;
/// Furthest that a hanging body may be from where it was a second before, in its lengths, and of its weight.
const STAYS: f64 = 0.01;
const WEIGHT: f64 = 1e-3;
/// Length of its post (m).
const LENGTH: f64 = 5e-3;
/// Of the mean height of a pile: the mean of three differs by 1 % of it from that of three others.
const HEIGHT: f64 = 0.03;
/// Of the drag.
const OF_DRAG: f64 = 0.03;
/// Largest relative change of the drag in `STRETCH` steps that counts as steady.
const STEADY: f64 = 2e-4;
const STRETCH: u64 = 200;

/// Volume, and moments of inertia over the mass, ascending.
fn mass_properties(shape: &dyn Shape) -> [f64; 4] {
    let mut moments: [f64; 3] = shape.inertia_per_mass().into();
    moments.sort_by(f64::total_cmp);
    [shape.volume(), moments[0], moments[1], moments[2]]
}

fn compare(found: &mut Findings, name: &str, shape: &dyn Shape, unit: f64, expected: [f64; 4], source: &str) {
    let powers = [unit.powi(3), unit * unit, unit * unit, unit * unit];
    let names = ["volume (mm^3)", "lowest moment (mm^2)", "middle moment (mm^2)", "highest moment (mm^2)"];
    for (((name_of, measured), expected), power) in
        names.iter().zip(mass_properties(shape)).zip(expected).zip(powers)
    {
        let quantity = format!("{name}, {} parts: {name_of}", shape.parts().len());
        found.relative(quantity, measured / power, expected, MASS).source(source);
    }
}

fn bodies(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let setup = context.setup(BODIES, CASE.name, &[])?;
    let table = Table::new(REFERENCE);
    let names = ["dumbbell of two spheres", "clump of ten spheres", "cross of two bars", "L of two bars"];
    for (name, template) in names.into_iter().zip(setup.templates.iter()) {
        let expected = ["volume", "low", "middle", "high"].map(|column| table.of("body", name, column));
        compare(found, name, &*template.shape, 1e-3, expected, CASE.source);
    }
    // Of each facet of a sphere a frustum between two surfaces, or a pyramid down to the middle; those of the half shell look upwards.
    let ball = Sphere { radius: 1.0 }.surface_mesh(2);
    let stone = |n: &Vec3| {
        let dent = |direction: [f64; 3], depth: f64| {
            let cosine = n.dot(&Vec3::from(direction).normalize());
            depth * (6.0 * (cosine - 1.0)).exp()
        };
        let rough = 0.04 * (7.0 * n.x + 1.0).sin() * (6.0 * n.y).cos() + 0.03 * (9.0 * n.z + 5.0 * n.x).sin();
        let dents =
            dent([1.0, 0.4, 0.1], 0.45) + dent([-0.5, 1.0, -0.6], 0.35) + dent([0.2, -0.4, -1.0], 0.4);
        (1.0 + rough - dents) * Vec3::new(1.0, 0.8, 0.7).component_mul(n).norm()
    };
    for (name, refinement, inner) in [("half of a hollow sphere", 2, 0.8), ("stone with dents", 1, 0.0)] {
        let ball =
            if refinement == 2 { ball.clone() } else { Sphere { radius: 1.0 }.surface_mesh(refinement) };
        let (mut parts, mut surface) = (Vec::new(), Vec::new());
        for corners in &ball.triangles {
            let outer = corners.map(|k| ball.points[k as usize]);
            let outer = if inner > 0.0 { outer } else { outer.map(|at| at * stone(&at)) };
            if inner > 0.0 && outer.iter().sum::<Vec3>().z < 0.0 {
                continue;
            }
            let mut points = outer.to_vec();
            if inner > 0.0 {
                points.extend(outer.map(|at| at * inner));
                let [a, b, c] = outer.map(|at| at * inner);
                surface.push([a, c, b]);
            } else {
                points.push(Vec3::zeros());
            }
            surface.push(outer);
            let (shape, placement) = Polyhedron::hull(&points, COMPUTED).expect("a solid");
            parts.push(turbid::shape::Part {
                shape: Arc::new(shape),
                position: placement.centre,
                orientation: placement.rotation,
            });
        }
        let (body, _) = Composite::new(parts).expect("few parts");
        compare(
            found,
            name,
            &body,
            1.0,
            of_cone(&surface),
            "cones from the middle to the facets of its surface",
        );
    }
    Ok(())
}

/// Volume and moments of a body between the origin and facets, those that look to it taken off.
fn of_cone(surface: &[[Vec3; 3]]) -> [f64; 4] {
    let (mut volume, mut first, mut second) = (0.0, Vec3::zeros(), Mat3::zeros());
    for [a, b, c] in surface {
        let own = a.dot(&b.cross(c)) / 6.0;
        volume += own;
        first += (a + b + c) * (own / 4.0);
        let sum = a + b + c;
        let squares = a * a.transpose() + b * b.transpose() + c * c.transpose() + sum * sum.transpose();
        second += squares * (own / 20.0);
    }
    let centre = first / volume;
    let spread = second / volume - centre * centre.transpose();
    let mut moments: Vec<f64> = spread.symmetric_eigenvalues().iter().map(|x| spread.trace() - x).collect();
    moments.sort_by(f64::total_cmp);
    [volume, moments[0], moments[1], moments[2]]
}

/// The L spins freely, about no principal axis.
fn flight(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let setup = context.setup(BODIES, CASE.name, &[])?;
    let mut run = Simulation::solo(&setup)?;
    let spins = |run: &Simulation| Vec3::from(run.particles()[3].angular_momentum);
    let begun = spins(&run);
    run.advance(setup.plan.end_step)?;
    let now = spins(&run);
    let quantity = "angular momentum of an L that spins for 0.2 s, its change over it (-)";
    found
        .absolute(quantity, (now - begun).norm() / begun.norm(), 0.0, MOMENTUM)
        .source("balance of angular momentum");
    Ok(())
}

/// Velocities after an impact without friction, beside those of LIGGGHTS and of a rigid body.
fn impact(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let setup = context.setup(IMPACT, CASE.name, &[])?;
    let mut run = Simulation::solo(&setup)?;
    run.advance(setup.plan.end_step)?;
    let after = run.particles()[0];
    let table = Table::new(LIGGGHTS);
    for (name, key, measured) in [
        ("velocity after an impact of two spheres on a floor (m/s)", "velocity", after.velocity().z),
        ("their spin after it (1/s)", "spin", after.angular_velocity().norm()),
    ] {
        found
            .relative(name, measured, table.of("quantity", key, "value"), AFTER)
            .source("LIGGGHTS 3.8.0, fix multisphere, validation/composites/liggghts");
    }
    let axis = setup.particles[0].orientation_given(&Quat::identity())
        * setup.templates[0].shape.parts()[1].position;
    let lever = axis.xy().norm();
    let square = setup.templates[0].shape.inertia_per_mass().max();
    let velocity = 0.1 * (2.0 / (1.0 + lever * lever / square) - 1.0);
    found.note("velocity of a rigid body whose impact takes no time (m/s)", velocity);
    Ok(())
}

/// An L hangs on another by its arm; across both only friction holds it.
fn hook(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let setup = context.setup(HOOK, CASE.name, &[])?;
    let mut run = Simulation::solo(&setup)?;
    let steps = |seconds: f64| (seconds / setup.time_step).round() as u64;
    run.advance(steps(0.5))?;
    let before = run.particles()[1].position();
    run.advance(steps(1.0))?;
    let crept = (run.particles()[1].position() - before).norm();
    found
        .absolute("way of an L that hangs on another in 1 s, over its length (-)", crept / LENGTH, 0.0, STAYS)
        .source("the angle of friction is 0.46 rad, the slope across it 0.20");
    let force: Vec3 = run.contact_states().iter().map(|state| Vec3::from(state.force)).sum();
    let weight = setup.gravity.norm() * setup.templates[1].mass();
    found
        .relative("force on its arm over its weight (-)", force.norm() / weight, 1.0, WEIGHT)
        .source("balance of forces");
    Ok(())
}

/// Bodies of two spheres in a box, at rest, beside those of LIGGGHTS.
fn pile(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let (mut height, seeds) = (0.0, 3);
    for seed in 1..=seeds {
        let setup = context.setup(PILE, CASE.name, &[format!("particles.0.seed={seed}")])?;
        let mut run = Simulation::solo(&setup)?;
        run.advance(setup.plan.end_step)?;
        let all = run.particles();
        height +=
            all.iter().map(|body| body.position().z).sum::<f64>() / (all.len() as f64 * f64::from(seeds));
    }
    let table = Table::new(LIGGGHTS);
    let theirs = ["height_1", "height_2", "height_3"].map(|key| table.of("quantity", key, "value"));
    found
        .relative(
            "mean height of 120 bodies of two spheres in a box, of three piles (m)",
            height,
            theirs.iter().sum::<f64>() / 3.0,
            HEIGHT,
        )
        .source("LIGGGHTS 3.8.0, fix multisphere, validation/composites/liggghts");
    Ok(())
}

/// A direction of the velocity: its component, the drag of each sphere over that of Stokes, and the correction of a cube.
struct Direction {
    name: &'static str,
    component: usize,
    factor: f64,
    /// Of the term with the third power of the radius over the edge.
    cubic: f64,
    source: &'static str,
}

const ALONG: Direction = Direction {
    name: "along the line of their centres",
    component: 0,
    factor: 0.6451,
    cubic: 6.7,
    source: "Stimson and Jeffery (1926), doi:10.1098/rspa.1926.0053",
};
const ACROSS: Direction = Direction {
    name: "across the line of their centres",
    component: 1,
    factor: 0.7243,
    cubic: 9.2,
    source: "Goldman, Cox and Brenner (1966), doi:10.1016/0009-2509(66)85036-4",
};

/// Drag of two spheres that touch and move as one through a periodic cube of fluid whose mean velocity is zero:
///
/// ```text
/// 6 pi mu R U / F = 1 / (2 lambda) - 2.8373 R / L + c (R / L)^3
/// ```
fn drag(context: &SuiteContext, found: &mut Findings, direction: &Direction) -> Result<()> {
    let mut velocity = [0.0; 3];
    velocity[direction.component] = 1e-4;
    let own = [format!("particles.1.motion.velocity={velocity:?}")];
    let setup = context.setup(DRAG, CASE.name, &own)?;
    let mut run = Simulation::solo(&setup)?;
    let mut force = 0.0;
    loop {
        run.advance(STRETCH)?;
        let now = run.loads().next().map_or(0.0, |(_, load)| -load.force[direction.component]);
        let before = std::mem::replace(&mut force, now);
        if run.steps_done() > 10 * STRETCH && (force - before).abs() < STEADY * force.abs() {
            break;
        }
        if run.steps_done() >= setup.plan.end_step {
            return Err(unsteady("drag (N)", force));
        }
    }
    let radius = 0.5 * setup.diameter;
    let ratio = radius / setup.domain.size().x;
    let mobility = 0.5 / direction.factor - 2.8373 * ratio + direction.cubic * ratio.powi(3);
    let mu = setup.fluid_density() * setup.expect_fluid().viscosity;
    let stokes = 6.0 * PI * mu * radius * 1e-4;
    let quantity = format!("drag of two spheres that touch, {}, over that of one alone (-)", direction.name);
    found.relative(quantity, force / stokes, 1.0 / mobility, OF_DRAG).source(direction.source);
    Ok(())
}
