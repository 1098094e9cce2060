//! Agglomerates of sticky spheres in shear: `validation/agglomerate`.

use super::prelude::*;
use std::f64::consts::PI;
use turbid::dem::Load;

const TEXT: &str = include_str!("../../../../validation/agglomerate/case.toml");

pub(super) const CASE: Case = Case {
    name: "agglomerate",
    question: "an agglomerate of 87 JKR spheres, dragged by a shear flow: whether it holds at a fifth of the shear rate of an estimate and breaks at three times it",
    source: STATICS,
    parts: &[Part::quick(15.0, survives), Part::quick(5.0, breaks), Part::full(40.0, limit)],
};

const STATICS: &str = "statics of a close-packed lattice, each contact up to the pull-off force of Johnson, Kendall and Roberts (1971), doi:10.1098/rspa.1971.0141";
const RADIUS: f64 = 1e-3;
/// Work of adhesion of the case (J/m^2).
const WORK: f64 = 0.05;
/// Solid volume fraction of the densest packing of spheres (-).
const PACKED: f64 = 0.740_480_489;
/// Viscosity (Pa s) of the fluid whose drag is `6 pi mu R (u - v)` on each sphere: its inertia counts for little.
const VISCOSITY: f64 = 0.3;
/// Strain after which an agglomerate that is whole has survived: half a rotation, in which every plane in it has passed the axis of extension.
const STRAIN: f64 = 7.0;
/// Half a sphere, of all (-).
const LOST: f64 = 0.5 / 87.0;
/// Shear rates over that of the estimate: far below, far above.
const BELOW: f64 = 0.2;
const ABOVE: f64 = 3.0;

/// Spheres of a face-centred cubic packing in a ball of 87, a millionth of a diameter apart.
fn packed() -> Vec<Vec3> {
    let half = (1.0 + 1e-6) * RADIUS * 2.0_f64.sqrt();
    let mut all = Vec::new();
    for x in -4_i32..=4 {
        for y in -4_i32..=4 {
            for z in -4_i32..=4 {
                if (x + y + z) % 2 == 0 && x * x + y * y + z * z <= 12 {
                    all.push(Vec3::new(f64::from(x), f64::from(y), f64::from(z)) * half);
                }
            }
        }
    }
    all
}

/// An agglomerate after some strain.
struct Remains {
    /// Fraction of the spheres that are in its largest piece (-).
    largest: f64,
    /// Strain at which it was looked at (-).
    strain: f64,
}

/// Shear rate (1/s) at which the estimate has an agglomerate of this number of spheres break.
fn estimate(count: f64) -> f64 {
    let pull_off = 1.5 * PI * WORK * 0.5 * RADIUS;
    // Where a stress s pulls and an equal one pushes across it, the most loaded of the three contacts by which each sphere hangs on a close-packed plane bears
    // s (2 R)^2 / sqrt(2).
    let strength = 2.0_f64.sqrt() * pull_off / (4.0 * RADIUS * RADIUS);
    // The drag per volume at the place x is k E x, k = 9/2 phi mu / R^2, and the stress k / 2 (B^2 - x^2) E, with E = rate / 2.
    let square = (count / PACKED).cbrt().powi(2);
    strength / (1.125 * PACKED * VISCOSITY * square)
}

/// Drags the agglomerate by a shear flow of this rate over that of the estimate.
fn shear(context: &SuiteContext, part: f64) -> Result<Remains> {
    let centre = Vec3::new(0.1, 0.05, 0.05);
    let spheres = packed();
    let entry = |at: &Vec3| {
        // They approach the middle slowly, and touch within the first steps.
        let (place, inwards) = (at + centre, -0.02 * at);
        format!(
            "{{ position = [{:.12e}, {:.12e}, {:.12e}], velocity = [{:e}, {:e}, {:e}] }}",
            place.x, place.y, place.z, inwards.x, inwards.y, inwards.z
        )
    };
    let list = spheres.iter().map(entry).collect::<Vec<_>>().join(",");
    let setup = context.setup(TEXT, CASE.name, &[format!("particles.0.list=[{list}]")])?;
    let mut run = Simulation::solo(&setup)?;
    run.advance((0.02 / setup.time_step).round() as u64)?;
    let count = spheres.len() as f64;
    if pieces(&run)[0] < spheres.len() {
        return Err(unsteady("largest piece before the shear", pieces(&run)[0] as f64));
    }
    let rate = part * estimate(count);
    run.set_external_load(move |_, sphere| {
        let away = sphere.position() - centre;
        let (flow, spin) = (Vec3::x() * (rate * away.z), Vec3::y() * (0.5 * rate));
        Load {
            force: 6.0 * PI * VISCOSITY * RADIUS * (flow - sphere.velocity()),
            torque: 8.0 * PI * VISCOSITY * RADIUS.powi(3) * (spin - Vec3::from(sphere.angular_velocity)),
        }
    });
    let steps = (0.25 / rate / setup.time_step).ceil() as u64;
    let mut remains = Remains { largest: 1.0, strain: 0.0 };
    while remains.strain < STRAIN && remains.largest > 0.5 {
        run.advance(steps)?;
        remains.strain += rate * steps as f64 * setup.time_step;
        remains.largest = pieces(&run)[0] as f64 / count;
    }
    Ok(remains)
}

/// Numbers of spheres in the pieces, the largest first.
fn pieces(run: &Simulation) -> Vec<usize> {
    let ids: Vec<u64> = run.particles().iter().map(|sphere| sphere.id).collect();
    let index = |id: u64| ids.iter().position(|&known| known == id);
    let mut of: Vec<usize> = (0..ids.len()).collect();
    for state in run.contact_states() {
        if let (Some(a), Some(b)) = (index(state.first), index(state.second)) {
            let (keep, lose) = (of[a].min(of[b]), of[a].max(of[b]));
            of.iter_mut().filter(|piece| **piece == lose).for_each(|piece| *piece = keep);
        }
    }
    let mut sizes: Vec<usize> =
        (0..ids.len()).map(|piece| of.iter().filter(|&&of| of == piece).count()).collect();
    sizes.sort_unstable_by(|a, b| b.cmp(a));
    sizes
}

fn survives(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let remains = shear(context, BELOW)?;
    let quantity = format!(
        "largest piece after a strain of {STRAIN}, at a fifth of the shear rate of the estimate, of all (-)"
    );
    found.absolute(quantity, remains.largest, 1.0, LOST);
    Ok(())
}

fn breaks(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let remains = shear(context, ABOVE)?;
    let quantity = "largest piece at three times the shear rate of the estimate, of all (-)";
    found.absolute(quantity, remains.largest, 0.25, 0.25);
    found.note(
        "strain until it is in pieces, at three times the shear rate of the estimate (-)",
        remains.strain,
    );
    Ok(())
}

/// The shear rate at which it breaks, between two that are a fifth apart.
fn limit(context: &SuiteContext, found: &mut Findings) -> Result<()> {
    let mut part = BELOW;
    let mut last = 0.0;
    while part <= ABOVE {
        let remains = shear(context, part)?;
        found.note(
            format!("largest piece at {part:.3} of the shear rate of the estimate, of all (-)"),
            remains.largest,
        );
        if remains.largest < 0.9 {
            break;
        }
        last = part;
        part *= 1.2;
    }
    let quantity =
        "shear rate at which an agglomerate loses a tenth of its spheres, over that of the estimate (-)";
    found.absolute(quantity, (last * part).sqrt(), 1.0, f64::INFINITY);
    Ok(())
}
