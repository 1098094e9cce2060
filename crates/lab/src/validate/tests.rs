//! Claims about the suite: it is consistent, and it notices when the physics is wrong.

use super::watch::Watch;
use super::*;
use crate::checks::{self, Check, Ending, Score};
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use turbid::case::Setup;
use turbid::error::{Error, Result};
use turbid::shape::Sphere;

/// Faults of the physics.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Fault {
    /// The lattice relaxes with 0.02 more than the time step was made for.
    RelaxationTime,
    /// A step counts for 2 % more time than it takes.
    TimeStep,
    /// Forces of the fluid count a tenth too much.
    ForceUnit,
    /// Gravity points up.
    GravitySign,
    /// Particles weigh 5 % too much.
    Weight,
    /// Particles are 5 % too wide.
    Radius,
    /// `fluid_only` does what `mixture` should, and the other way round.
    Balance,
    /// The prefactor of the contact force as printed in Marquardt et al. (2024), Eq. 4: `4 / (3 pi)`.
    ContactPrefactor,
    /// The restitution is 0.02 less than set.
    Restitution,
    /// Friction is a tenth too strong.
    Friction,
    /// Cohesion is 5 % too strong.
    Cohesion,
}

impl Fault {
    /// Makes a case wrong in this way, with all that its module compares with left right.
    pub(super) fn spoil(self, setup: &mut Setup) {
        let (contact, fluid) = (&mut setup.contact, &mut setup.fluid);
        match self {
            Self::RelaxationTime => fluid.iter_mut().for_each(|fluid| fluid.relaxation_time += 0.02),
            Self::TimeStep => setup.time_step *= 1.02,
            Self::ForceUnit => fluid.iter_mut().for_each(|fluid| fluid.density *= 1.1),
            Self::GravitySign => setup.gravity = -setup.gravity,
            Self::Weight => {
                let mut templates = setup.templates.to_vec();
                for template in &mut templates {
                    template.density *= 1.05;
                }
                setup.templates = templates.into();
            }
            Self::Radius => {
                let mut templates = setup.templates.to_vec();
                for template in &mut templates {
                    let radius = 0.525 * template.shape.equivalent_diameter();
                    template.shape = Arc::new(Sphere { radius });
                }
                setup.templates = templates.into();
            }
            Self::Balance => {
                use turbid::coupling::ForceBalance::{FluidOnly, Mixture};
                if let Some(fluid) = fluid {
                    fluid.force_balance = match fluid.force_balance {
                        FluidOnly => Mixture,
                        Mixture => FluidOnly,
                    };
                }
            }
            Self::ContactPrefactor => {
                let materials = contact.iter_mut().flat_map(|contact| &mut contact.materials);
                materials.for_each(|material| material.youngs_modulus /= std::f64::consts::PI.sqrt());
            }
            Self::Restitution => {
                let pairs = contact.iter_mut().flat_map(|contact| &mut contact.pairs);
                pairs.for_each(|pair| pair.restitution -= 0.02);
            }
            Self::Friction => {
                for pair in contact.iter_mut().flat_map(|contact| &mut contact.pairs) {
                    pair.friction_static *= 1.1;
                    pair.friction_kinetic *= 1.1;
                }
            }
            Self::Cohesion => {
                for pair in contact.iter_mut().flat_map(|contact| &mut contact.pairs) {
                    pair.work_of_adhesion *= 1.05;
                    pair.cohesion_density *= 1.05;
                }
            }
        }
    }
}

/// Returns true if a part of a case fails a check, or does not finish.
fn fails(case: &Case, part: usize, fault: Option<Fault>) -> bool {
    let context = SuiteContext { fault, ..SuiteContext::new(Vec::new(), 1) };
    let mut found = Findings::default();
    if let Err(error) = (case.parts[part].run)(&context, &mut found) {
        println!("{fault:?}: {} does not finish: {error}", case.name);
        return true;
    }
    let wrong: Vec<&Check> = found.checks.iter().filter(|check| !check.pass).collect();
    for check in &wrong {
        println!(
            "{fault:?}: {}, {}: {} for {} +- {}",
            check.case, check.quantity, check.measured, check.reference, check.tolerance
        );
    }
    !wrong.is_empty()
}

/// Faults, each with the part of a case that must detect it.
const NOTICED: [(Fault, &Case, usize); 11] = [
    (Fault::RelaxationTime, &shear_wave::CASE, 0),
    (Fault::TimeStep, &shear_wave::CASE, 0),
    (Fault::ForceUnit, &settling_tank::CASE, 0),
    (Fault::GravitySign, &settling_tank::CASE, 0),
    (Fault::Weight, &settling_tank::CASE, 0),
    (Fault::Radius, &sphere_array::CASE, 6),
    (Fault::Balance, &periodic_settling::CASE, 0),
    (Fault::ContactPrefactor, &hertz::CASE, 0),
    (Fault::Restitution, &restitution::CASE, 0),
    (Fault::Friction, &friction::CASE, 0),
    (Fault::Cohesion, &cohesion::CASE, 0),
];

#[test]
fn physics_that_is_wrong_is_noticed_and_physics_that_is_right_is_not() {
    let missed: Vec<_> = std::thread::scope(|scope| {
        let runs =
            NOTICED.map(|(fault, case, part)| scope.spawn(move || (fault, fails(case, part, Some(fault)))));
        runs.into_iter().map(|run| run.join().unwrap()).collect()
    });
    for (fault, noticed) in missed {
        assert!(noticed, "{fault:?}");
    }
    for case in [&restitution::CASE, &friction::CASE, &hertz::CASE, &shear_wave::CASE] {
        assert!(!fails(case, 0, None), "{}", case.name);
    }
}

#[test]
fn every_case_has_a_folder_with_its_page_and_every_folder_of_references_a_case() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../validation");
    let names: BTreeSet<&str> = CASES.iter().map(|case| case.name).collect();
    assert_eq!(names.len(), CASES.len());
    for name in &names {
        let page = fs::read_to_string(root.join(name).join("README.md")).unwrap_or_default();
        assert!(page.contains("**Question.**"), "validation/{name}/README.md");
        assert!(page.contains("**Tolerance.**") || page.contains("**Acceptance.**"), "{name}");
    }
    for entry in fs::read_dir(&root).unwrap() {
        let folder = entry.unwrap().path();
        if folder.join("reference.csv").exists() {
            let name = folder.file_name().unwrap().to_string_lossy().into_owned();
            assert!(names.contains(name.as_str()), "validation/{name} has no case");
        }
    }
}

#[test]
fn a_number_that_is_none_passes_nothing_and_a_case_that_checks_nothing_has_failed() {
    fn undefined(found: &mut Findings) {
        found.absolute("x", f64::NAN, 0.0, f64::INFINITY);
    }
    const NOTHING: Case = Case { parts: &[Part::quick(1.0, |_, _| Ok(()))], ..hertz::CASE };
    const UNDEFINED: Case = Case {
        parts: &[Part::quick(1.0, |_, found| {
            undefined(found);
            Ok(())
        })],
        ..hertz::CASE
    };
    for case in [&NOTHING, &UNDEFINED] {
        let outcomes = run(&[case], Level::Quick, &SuiteContext::new(Vec::new(), 1), |_| {});
        let score = Score::of(&outcomes);
        assert_eq!((score.passed, score.checks), (0, 1));
        assert!(!score.is_full());
        let json: serde_json::Value = serde_json::from_str(&checks::json(&outcomes)).unwrap();
        assert_eq!(json[0]["pass"], false);
        assert!(checks::table(&outcomes[0], false).contains("FAIL"));
    }
}

#[test]
fn parts_run_side_by_side_are_put_together_in_their_order_and_the_full_level_has_the_quick_one_in_it() {
    fn part(found: &mut Findings, what: &str) {
        found.absolute(what, 1.0, 1.0, 0.0);
    }
    const BOTH: Case = Case {
        parts: &[
            Part::quick(1.0, |_, found| {
                part(found, "a");
                Ok(())
            }),
            Part::wide(1.0, |_, found| {
                part(found, "b");
                Ok(())
            }),
            Part::quick(9.0, |_, found| {
                part(found, "c");
                Ok(())
            }),
            Part::full(5.0, |_, found| {
                part(found, "d");
                Ok(())
            }),
        ],
        ..hertz::CASE
    };
    const ABSENT: Case = Case { parts: &[], ..hertz::CASE };
    let quantities = |level| {
        let outcomes = run(&[&ABSENT, &BOTH], level, &SuiteContext::new(Vec::new(), 2), |_| {});
        assert_eq!(Score::of(&outcomes).missing, 1);
        let Ending::Found(found) = &outcomes[1].ending else {
            panic!("it runs");
        };
        let all = found.checks.iter().map(|check| check.quantity.clone());
        all.collect::<String>()
    };
    assert_eq!(quantities(Level::Quick), "ac");
    assert_eq!(quantities(Level::Full), "abcd");
}

#[test]
fn a_bias_of_three_points_or_more_is_noted_though_each_is_within_its_tolerance() {
    fn points(found: &mut Findings) {
        for phi in [0.1, 0.2, 0.3] {
            found.relative(format!("K, phi {phi} (-)"), 1.96, 2.0, 0.05);
            found.absolute(format!("noise at {phi}"), 0.01, 0.0, 0.05);
        }
    }
    const BIASED: Case = Case {
        parts: &[Part::quick(1.0, |_, found| {
            points(found);
            Ok(())
        })],
        ..hertz::CASE
    };
    let outcomes = run(&[&BIASED], Level::Quick, &SuiteContext::new(Vec::new(), 1), |_| {});
    let Ending::Found(found) = &outcomes[0].ending else {
        panic!("it runs");
    };
    let [(quantity, bias)] = &found.notes[..] else {
        panic!("{:?}", found.notes);
    };
    assert!(quantity.starts_with("K, mean signed deviation of 3 points"), "{quantity}");
    assert!((bias + 0.02).abs() < 1e-12, "{bias}");
    assert!(found.checks.iter().all(|check| check.case == "hertz" && check.source == hertz::CASE.source));
}

/// Height (m) of a sphere in a small tank after every step.
fn watched(
    context: &SuiteContext,
    threads: usize,
    looks: &AtomicU64,
    look: impl Fn(u64),
) -> Result<Vec<(u64, f64)>> {
    let text = include_str!("../../../../validation/settling_tank/case.toml");
    let own = ["lattice.cells_per_diameter=4", "run.end={ steps = 40 }"].map(String::from);
    let setup = context.setup(text, "tank", &own)?;
    let watch = Watch { context, setup: &setup, threads, every: 1 };
    watch.rows(|run, rows: &mut Vec<_>| {
        looks.fetch_add(1, Ordering::Relaxed);
        let step = run.steps_done()?;
        look(step);
        rows.push((step, run.particles()?[0].position().z));
        Ok(false)
    })
}

#[test]
fn a_run_that_was_stopped_continues_to_the_same_numbers_and_is_not_repeated_on_1_and_2_ranks() {
    let looks = AtomicU64::new(0);
    let free = watched(&SuiteContext::new(Vec::new(), 1), 1, &looks, |_| {}).unwrap();
    assert_eq!(free.len(), 40);
    for ranks in [1, 2] {
        let directory = tempfile::tempdir().unwrap();
        let context =
            SuiteContext { kept: Some(directory.path().to_path_buf()), ..SuiteContext::new(Vec::new(), 1) };
        let looks = AtomicU64::new(0);
        for stop in [13, 27] {
            let stopped = watched(&context, ranks, &looks, |step| {
                context.stop.store(step >= stop, Ordering::Relaxed);
            });
            assert!(matches!(stopped, Err(Error::Interrupted)), "{stopped:?}");
        }
        context.stop.store(false, Ordering::Relaxed);
        // On as many ranks as it likes.
        let whole = watched(&context, 3 - ranks, &looks, |_| {}).unwrap();
        assert_eq!(whole, free);
        assert_eq!(looks.load(Ordering::Relaxed), 40, "no step is done twice");
        let before = looks.load(Ordering::Relaxed);
        assert_eq!(watched(&context, ranks, &looks, |_| {}).unwrap(), free);
        assert_eq!(looks.load(Ordering::Relaxed), before, "it is read, not run");
        let kept = fs::read_dir(directory.path().join("kept")).unwrap();
        let folders: Vec<_> = kept.map(|entry| entry.unwrap().path()).collect();
        assert_eq!(folders.len(), 1);
        assert!(!folders[0].join("checkpoints").exists());
        // Another case is another run.
        let other =
            SuiteContext { changes: vec!["lattice.relaxation_time=0.6".to_string()], ..context.clone() };
        assert_ne!(watched(&other, ranks, &looks, |_| {}).unwrap(), free);
    }
}

#[test]
fn cases_that_are_stopped_have_neither_passed_nor_failed() {
    let context = SuiteContext::new(Vec::new(), 1);
    context.stop.store(true, Ordering::Relaxed);
    let outcomes = run(&[&hertz::CASE, &friction::CASE], Level::Quick, &context, |_| {});
    let score = Score::of(&outcomes);
    assert_eq!((score.interrupted, score.checks, score.passed), (2, 0, 0));
    assert!(checks::summary(&outcomes, 1.0).contains("2 cases stopped before the end"));
    assert_eq!(checks::json(&outcomes).trim(), "[]");
}

#[test]
fn changes_reach_the_cases_with_a_fluid_and_no_others() {
    let context = SuiteContext::new(vec!["lattice.relaxation_time=0.7".to_string()], 1);
    let wet = include_str!("../../../../validation/shear_wave/case.toml");
    let dry = include_str!("../../../../validation/hertz/case.toml");
    let tau = context.setup(wet, "wet", &[]).unwrap().expect_fluid().relaxation_time;
    assert!((tau - 0.7).abs() < 1e-15);
    assert!(context.setup(dry, "dry", &[]).unwrap().fluid.is_none());
}

#[test]
fn a_report_says_each_check_in_a_row_of_each_of_its_forms() {
    let outcomes = run(&[&friction::CASE], Level::Quick, &SuiteContext::new(Vec::new(), 1), |_| {});
    let json: serde_json::Value = serde_json::from_str(&checks::json(&outcomes)).unwrap();
    let rows = json.as_array().unwrap();
    let keys: Vec<&str> = rows[0].as_object().unwrap().keys().map(String::as_str).collect();
    for key in ["case", "quantity", "measured", "reference", "tolerance", "pass", "source"] {
        assert!(keys.contains(&key), "{keys:?}");
    }
    let directory = tempfile::tempdir().unwrap();
    checks::prepare(directory.path()).unwrap();
    checks::write_plots(directory.path(), &outcomes[0]).unwrap();
    checks::write_tables(directory.path(), "validation", &outcomes).unwrap();
    let read = |name: &str| fs::read_to_string(directory.path().join(name)).unwrap();
    assert_eq!(read("validation.csv").lines().count(), rows.len() + 1);
    assert_eq!(read("validation.md").matches("| ok |").count(), rows.len());
    assert_eq!(checks::table(&outcomes[0], false).matches("  ok").count(), rows.len());
    for name in ["friction_tangential.png", "friction_tangential.svg", "friction_spin.svg"] {
        assert!(directory.path().join(name).exists(), "{name}");
    }
}
