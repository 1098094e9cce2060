//! Verdict on both engines under the same laws, as long as nearby trajectories stay together.
//!
//! Both engines run the case with the laws that they have in common: Hertz's force, the damping of Tsuji et al. (1992), and friction with memory of one coefficient
//! (`mindlin_displacement`) for LIGGGHTS, none for others; without resistance to rolling, whose spring turns with the contact in another way there.
//! They then differ by rounding, which contacts multiply, for the engines as for two runs of the native one whose particles are 1e-9 `D`
//! apart at the start. With the largest distance `d(t)` of these so far (diameters)
//!
//! ```text
//! distance of the engines <= 0.1 d(t)      while d(t) < 1e-3
//! ```
//!
//! Rounding is 1e-14 `D`; LIGGGHTS was within 0.001 d(t). Later nothing is compared: the linear growth has ended, and any two runs part.
//! Velocities are not judged: during contact those of one engine are of another moment of the step.

use super::super::against::LIGGGHTS;
use super::super::pair::{PARTED, Pair, QUANTITIES, Recording};
use super::super::prelude::*;
use super::COMPLETE;
use turbid::contact::RollingLaw;

/// Distance at the start of nearby trajectories (diameters).
const NEARBY: f64 = 1e-9;
/// Part of the distance of nearby trajectories by which the engines may differ.
const PART: f64 = 0.1;

const REASON: &str = "a tenth of the distance, at that time, of two native runs 1e-9 D apart at the start: the difference of \
                      the engines nearest to its tolerance, before these part by 1e-3 D";
const FIRST_CONTACT: Limit =
    (1.0, "steps: the native engine counts at the start of its last sub-step, OTHER at its end");

/// Adds the checks; returns a line on how long they compare.
pub(super) fn verdict(
    setup: &Setup,
    steps: u64,
    recorded: Option<&Recording>,
    against: &Against,
    findings: &mut Findings,
) -> Result<String> {
    let (mut same, rubs) = (setup.clone(), against.name == LIGGGHTS);
    if let Some(contact) = &mut same.contact {
        (contact.law, contact.damping, contact.friction) = SAME;
        contact.rolling = RollingLaw::None;
        for params in &mut contact.pairs {
            // LIGGGHTS has the kinetic one where there is static friction.
            let same = if rubs && params.friction_static > 0.0 { params.friction_kinetic } else { 0.0 };
            (params.friction_static, params.friction_kinetic) = (same, same);
        }
    }
    let engines = Pair::start(&same, "own_case_same_laws", against)?;
    let near = Pair::new(&same, [native(&same)?, native(&shifted(&same, NEARBY))?]);
    let (compared, end) = compare([engines, near], steps, recorded, against.other_contacts(setup), findings);
    let [time, whole] = [compared, steps].map(|steps| steps as f64 * setup.time_step);
    let friction = if rubs { "mindlin_displacement" } else { "no friction" };
    Ok(format!("  same laws (hertz, tsuji, {friction}): compared {end}, {time:.6e} s of {whole:.6e} s\n"))
}

/// Compares two engines while nearby trajectories stay together, and at most up to the first contact if there is a reason to; returns the
/// steps that this was, and their end.
fn compare(
    [mut engines, mut near]: [Pair; 2],
    steps: u64,
    recorded: Option<&Recording>,
    other_contacts: Option<&str>,
    findings: &mut Findings,
) -> (u64, String) {
    let mut worst = (0.0, PART * NEARBY);
    let mut compared = 0;
    let mut end = "to the end".to_string();
    while compared < steps {
        if !engines.step(compared, recorded) || !near.step(compared, recorded) {
            end = "until an engine fails".to_string();
            break;
        }
        if near.largest[0] > PARTED {
            end = "until nearby trajectories part".to_string();
            break;
        }
        if let Some(why) = other_contacts.filter(|_| engines.first_contact != [None; 2]) {
            end = format!("until the first contact, as {why}");
            break;
        }
        compared += 1;
        let (distance, tolerance) = (engines.now, PART * near.largest[0].max(NEARBY));
        if distance.is_nan() || distance / tolerance > worst.0 / worst.1 {
            worst = (distance, tolerance);
        }
    }
    if !engines.failures.is_empty() {
        let [native, other] = engines.steps.map(|done| done as f64);
        let values = [native, other, steps as f64].map(Some);
        findings.given("same laws: steps done", values, steps as f64 - native.min(other), COMPLETE);
    }
    let quantity = format!("same laws: difference of {} (-)", QUANTITIES[0]);
    findings.given(quantity, [None; 3], worst.0, (worst.1, REASON));
    if other_contacts.is_none() && engines.first_contact != [None; 2] {
        let [native, other] = engines.first_contact.map(|step| step.unwrap_or(engines.steps[0]) as f64);
        let values = [Some(native), Some(other), None];
        findings.given(
            "same laws: steps to the first contact (-)",
            values,
            (native - other).abs(),
            FIRST_CONTACT,
        );
    }
    (compared, end)
}

/// A system whose particles are some way off (diameters), each in a direction of its own.
fn shifted(system: &Setup, distance: f64) -> Setup {
    let mut shifted = system.clone();
    let mut random = Random(11);
    for id in 0..shifted.particles.len() {
        let away = random.vector().normalize() * (distance * 2.0 * radius(system, id));
        let particle = &mut shifted.particles[id];
        particle.position = (particle.position() + away).into();
    }
    shifted
}

#[cfg(test)]
mod tests {
    use super::*;
    use turbid::case::from_text;

    /// A gas of elastic spheres in a periodic box.
    fn gas() -> Setup {
        let text = "domain.size = [4e-3, 4e-3, 4e-3]\ndry.time_step = 2e-5\ndriving.gravity = 0\nrun.end.steps = 1500\n\
                    contact = { youngs_modulus = 1e6, friction_static = 0, friction_kinetic = 0, restitution = 1, law = \"hertz\" }\n\
                    particles = [{ shape.sphere.diameter = 1e-3, density = 2500, count = 20 }]";
        let mut setup = from_text(text, "gas", &[]).unwrap_or_else(|e| panic!("{e}"));
        let mut random = Random(5);
        for particle in &mut setup.particles {
            particle.velocity = (random.vector() * 0.5).into();
        }
        setup
    }

    /// Steps that the gas is compared with another one, and the checks.
    fn against(change: impl FnOnce(&mut Setup)) -> (u64, Findings) {
        let setup = gas();
        let mut other = setup.clone();
        change(&mut other);
        let pair = |other: &Setup| Pair::new(&setup, [&setup, other].map(|of| native(of).unwrap()));
        let pairs = [pair(&other), pair(&shifted(&setup, NEARBY))];
        let mut findings = Findings::default();
        let (compared, _) = compare(pairs, setup.plan.end_step, None, None, &mut findings);
        (compared, findings)
    }

    #[test]
    fn engines_that_round_differently_pass_though_they_part_in_the_end() {
        let (compared, findings) = against(|system| *system = shifted(system, 1e-14));
        assert!((100..1500).contains(&compared), "{compared} steps until nearby trajectories part");
        assert!(findings.checks.len() == 2 && findings.checks.iter().all(|check| check.pass), "{findings:?}");
        assert!(findings.checks.iter().all(|check| !check.is_reported() && check.tolerance > 0.0));
    }

    #[test]
    fn an_engine_that_loses_a_thousandth_in_each_impact_fails() {
        let (_, findings) = against(|system| {
            for params in &mut system.contact.as_mut().unwrap().pairs {
                params.restitution = 0.999;
            }
        });
        assert!(findings.checks.iter().any(|check| !check.pass), "{findings:?}");
    }

    #[test]
    fn an_engine_that_starts_a_millionth_of_a_diameter_away_fails() {
        let (_, findings) = against(|system| *system = shifted(system, 1e-6));
        assert!(findings.checks.iter().any(|check| !check.pass), "{findings:?}");
    }
}
