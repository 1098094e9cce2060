//! The controller of the net flux against held bodies: `validation/net_flux`.

use super::prelude::*;
use std::f64::consts::PI;

const TEXT: &str = include_str!("../../../../validation/net_flux/case.toml");

pub(super) const CASE: Case = Case {
    name: "net_flux",
    question: "net flux through beds of volume fractions of 0.1 to 0.6, asked for, or to be removed as the bed is dragged",
    source: "the flux that is asked for",
    parts: &[
        Part::quick(3.0, |context, found| bed(context, found, 0.1, 0.55)),
        Part::quick(3.0, |context, found| bed(context, found, 0.1, 1.0)),
        Part::quick(3.0, |context, found| bed(context, found, 0.3, 0.55)),
        Part::quick(3.0, |context, found| bed(context, found, 0.3, 1.0)),
        Part::quick(3.0, |context, found| bed(context, found, 0.5, 0.55)),
        Part::quick(3.0, |context, found| bed(context, found, 0.5, 1.0)),
        Part::quick(3.0, |context, found| bed(context, found, 0.6, 0.55)),
        Part::quick(3.0, |context, found| bed(context, found, 0.6, 1.0)),
    ],
};

/// Of the flux, over what is asked for or over the velocity of the bed, from this step on.
const TOLERANCE: f64 = 0.01;
const STEPS: u64 = 240;
/// Edge of a cell (m), and cells of the box, which holds two lattice constants.
const CELL: f64 = 1e-4;
const EDGE: usize = 24;

/// Spheres on a face-centred cubic lattice, two constants of it in each direction.
fn centres() -> Vec<[f64; 3]> {
    let constant = 0.5 * EDGE as f64 * CELL;
    let basis = [[0.0; 3], [0.5, 0.5, 0.0], [0.5, 0.0, 0.5], [0.0, 0.5, 0.5]];
    let corner = |n: usize| [n % 2, n / 2 % 2, n / 4].map(|c| c as f64);
    let places = (0..8).flat_map(|n| basis.map(|b| std::array::from_fn(|a| corner(n)[a] + b[a])));
    places.map(|place: [f64; 3]| place.map(|c| (c + 0.25) * constant)).collect()
}

/// Both ways, at a volume fraction and a relaxation time.
fn bed(context: &SuiteContext, found: &mut Findings, fraction: f64, relaxation_time: f64) -> Result<()> {
    let side = EDGE as f64 * CELL;
    let diameter = side * (6.0 * fraction / (PI * 32.0)).cbrt();
    let units =
        context.setup(TEXT, CASE.name, &[format!("lattice.relaxation_time={relaxation_time}")])?.units();
    // 0.002 cells per step, on the lattice; the flow in the gaps is up to 14 times as fast.
    let speed = 0.002 * units.velocity();
    for dragged in [false, true] {
        let mut own = vec![
            format!("lattice.relaxation_time={relaxation_time}"),
            format!("lattice.cells_per_diameter={:e}", diameter / CELL),
            format!("particles.0.shape.sphere.diameter={diameter:e}"),
            format!("particles.0.list={:?}", centres()),
        ];
        own.push(if dragged {
            format!("particles.0.motion={{ velocity = [0, 0, {speed:e}] }}")
        } else {
            format!("driving.net_flux=[0, 0, {speed:e}]")
        });
        let setup = context.setup(TEXT, CASE.name, &own)?;
        let wanted = if dragged { 0.0 } else { speed };
        let mut run = Simulation::solo(&setup)?;
        let (mut worst, mut last) = (0.0_f64, 0);
        while run.steps_done() < setup.plan.end_step {
            run.advance(8)?;
            let error = (run.mean_flow().velocity.z - wanted).abs() / speed;
            if error > TOLERANCE {
                last = run.steps_done();
            }
            if run.steps_done() >= STEPS {
                worst = worst.max(error);
            }
        }
        let what = if dragged { "bed dragged, flux to vanish" } else { "bed at rest, flux asked for" };
        let name = format!("{what}, phi {fraction}, tau {relaxation_time}");
        let quantity = format!("{name}: largest error of the flux from step {STEPS} on (-)");
        found.absolute(quantity, worst, 0.0, TOLERANCE);
        found.note(format!("{name}: last step with an error above 1 %"), last as f64);
    }
    Ok(())
}
