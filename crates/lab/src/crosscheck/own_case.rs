//! The spheres of a user's case in both engines, from the same state and under the same loads: where they part.
//!
//! A dry case has its contacts, walls and gravity. Of a case with a fluid the loads are recorded in a four-way run with the
//! native engine, and replayed through both: so the engines are compared, and not the response of the fluid to their differences.
//!
//! Differences under the laws of the case are reported: other laws part with the first impact. The verdict is on the same case with the
//! laws that both engines have ([`nearby`]).

mod nearby;

use super::against::LIGGGHTS;
use super::pair::{PARTED, Pair, QUANTITIES, Recording};
use super::prelude::*;
use crate::checks::{EngineName, aligned};
use std::fmt::Write as _;
use turbid::output::numbers::small;

pub const ID: &str = "own_case";

/// Bytes of memory that recorded loads may take.
const MOST_BYTES: f64 = 4e9;

const COMPLETE: Limit = (0.0, "both engines must come to the end; the text below says why one does not");
const UNTOUCHED: Limit = (0.0, "one at least: without, the engines are compared in free flight only");
const LARGEST: Limit = (
    f64::INFINITY,
    "reported only: over the whole run under the laws of the case, which are those of both engines only in the rows `same laws`",
);

/// Runs a case for `time` (s), or to its end, in both engines. The
/// text says where the engines part, and reasons that are known beforehand.
///
/// # Errors
/// [`Error::Input`] if the case has other bodies than free spheres, particles that come or go, or lubrication, or is too long to record; those of the set-up of the other engine, and of
/// the run that records loads. An engine that fails on the way is a check that fails.
pub fn run(setup: &Setup, time: Option<f64>, against: &Against) -> Result<(Findings, String)> {
    if let Some(other) = setup.templates.iter().find(|template| template.shape.as_sphere().is_none()) {
        return Err(Error::Input(format!(
            "the case has particles that are a {}, but the cross-check is of spheres; \
             --set particles.0.shape.sphere.diameter=... makes spheres of the first kind",
            other.shape.kind()
        )));
    }
    if let Some(section) = setup.prescribed_sections().first() {
        return Err(Error::Input(format!(
            "`particles.{section}.motion` prescribes motion, but the cross-check is of free particles"
        )));
    }
    if setup.changes_population() {
        let what = "particles of the case come and go (`insertion`, `removal`), but the cross-check is of those at the start";
        return Err(Error::Input(what.to_string()));
    }
    if setup.contact.as_ref().is_some_and(|contact| contact.lubrication.is_some()) {
        let remedy = "leave `contact.lubrication` out: no other engine has it";
        return Err(Error::Input(format!("the cross-check is of contacts without lubrication; {remedy}")));
    }
    let steps = steps(setup, time)?;
    let recorded = setup.fluid.as_ref().map(|_| Recording::of(setup, steps)).transpose()?;
    let mut pair = Pair::start(setup, ID, against)?;
    pair.run(steps, recorded.as_ref());
    let mut findings = Findings::default();
    let [native, other] = pair.steps.map(|done| done as f64);
    let missing = steps as f64 - native.min(other);
    findings.given("steps done", [native, other, steps as f64].map(Some), missing, COMPLETE);
    if let Some(recorded) = recorded.as_ref().filter(|_| pair.steps[0] == steps) {
        pair.check_repeats(&mut findings, recorded);
    }
    for (quantity, largest) in QUANTITIES.iter().zip(pair.largest) {
        findings.given(format!("largest difference of {quantity} (-)"), [None; 3], largest, LARGEST);
    }
    if pair.first_contact == [None; 2] {
        findings.given("contacts that began (-)", [Some(0.0), Some(0.0), None], f64::NAN, UNTOUCHED);
    } else {
        pair.report_begun(&mut findings);
    }
    let same = nearby::verdict(setup, steps, recorded.as_ref(), against, &mut findings)?;
    let text = parting(setup, &pair) + &same + &notes(setup, &pair, against.name);
    Ok((against.judged(ID, findings), text))
}

/// Steps in `time`, or to the end of the case.
fn steps(setup: &Setup, time: Option<f64>) -> Result<u64> {
    let steps = match time {
        None => setup.plan.end_step,
        Some(time) if time > 0.0 && time.is_finite() => (time / setup.time_step).ceil().max(1.0) as u64,
        Some(time) => {
            return Err(Error::Input(format!("--time {time} is not a time above 0, in seconds")));
        }
    };
    let each = (size_of::<Load>() * setup.particles.len()) as f64;
    if setup.fluid.is_some() && each * steps as f64 > MOST_BYTES {
        let most = (MOST_BYTES / each).floor();
        return Err(Error::Input(format!(
            "the loads of {} particles over {steps} steps are too many to record; run a shorter time, at most --time {:.4e}",
            setup.particles.len(),
            most * setup.time_step
        )));
    }
    Ok(steps)
}

/// A table of where the engines part: quantity, time, particle, contact, and largest difference.
fn parting(setup: &Setup, pair: &Pair) -> String {
    let heads = ["", "parts at (s)", "particle", "in contact", "largest"];
    let mut rows = vec![heads.map(String::from).to_vec()];
    for ((quantity, parting), largest) in QUANTITIES.iter().zip(&pair.parting).zip(pair.largest) {
        let [at, id, touching] = parting.map_or(["never", "-", "-"].map(String::from), |first| {
            let time = format!("{:.6e}", first.step as f64 * setup.time_step);
            [time, first.id.to_string(), if first.touching { "yes" } else { "no" }.to_string()]
        });
        rows.push(vec![(*quantity).to_string(), at, id, touching, small(largest)]);
    }
    let lines = aligned(&rows).join("\n  ");
    let position = pair.parting[0].map_or_else(String::new, |first| {
        let [x, y, z] = first.position;
        format!("\n  particle {} then is at ({x:.6e}, {y:.6e}, {z:.6e}) m", first.id)
    });
    format!("  engines part where they differ by more than {PARTED:.0e}:\n  {lines}{position}\n")
}

/// Failures, first contacts, and differences of the laws, a line each.
fn notes(setup: &Setup, pair: &Pair, name: EngineName) -> String {
    let (mut text, other_name) = (String::new(), name.label);
    for (engine, error) in &pair.failures {
        let engine = ["the native engine", other_name][*engine];
        let _ = writeln!(text, "  {engine} does not come to the end: {error}");
    }
    if pair.first_contact == [None; 2] {
        text += "  no contact in either engine, so that contacts are not compared: run the case for longer, or denser\n";
    }
    let [native, other] = pair.first_contact.map(|step| {
        step.map_or("never".to_string(), |step| format!("{:.6e} s", step as f64 * setup.time_step))
    });
    let _ = writeln!(text, "  first contact: native {native}, {other_name} {other}");
    let Some(contact) = &setup.contact else { return text };
    let damped = contact.pairs.iter().any(|params| params.restitution < 1.0);
    let rough = contact.pairs.iter().any(|params| params.friction_static > 0.0);
    let (rubs, same) = if name == LIGGGHTS {
        (contact.friction != FrictionLaw::MindlinDisplacement, "contact.friction=mindlin_displacement")
    } else {
        (true, "contact.friction_static=0")
    };
    for (differs, law, remedy) in [
        (contact.law != ElasticLaw::Hertz, "elasticity", "contact.law=hertz"),
        (damped && contact.damping != DampingLaw::Tsuji, "damping", "contact.damping=tsuji"),
        (rough && rubs, "friction", same),
    ] {
        if differs {
            let _ =
                writeln!(text, "  the engines have different laws of {law}; the same with --set {remedy}");
        }
    }
    text
}

#[cfg(test)]
mod tests;
