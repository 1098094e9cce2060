//! The suite of `turbid crosscheck`, run once as a user runs it, and the numbers that both engines promise to keep.

use crate::common::{Place, well};
use serde_json::Value;
use std::sync::LazyLock;

/// All checks of the suite, from its JSON.
static CHECKS: LazyLock<Vec<Value>> = LazyLock::new(|| {
    let place = Place::empty();
    // It takes minutes, all the longer on a busy machine.
    println!("{}", well(&mut place.turbid(&["crosscheck", "--json", "checks.json", "--out", "out"])));
    serde_json::from_str(&place.text("checks.json")).unwrap()
});

/// The checks of a case whose quantity begins like this; there are some.
fn checks(case: &str, quantity: &str) -> Vec<&'static Value> {
    let wanted = |check: &&Value| {
        check["case"] == case && check["quantity"].as_str().is_some_and(|text| text.starts_with(quantity))
    };
    let found: Vec<_> = CHECKS.iter().filter(wanted).collect();
    assert!(!found.is_empty(), "no check of {case} begins with `{quantity}`");
    found
}

/// Asserts that the difference of every such check is at most `limit`.
fn within(case: &str, quantity: &str, limit: f64) {
    for check in checks(case, quantity) {
        let difference = check["measured"].as_f64().unwrap();
        assert!(difference <= limit, "{difference:e} > {limit:e}: {check}");
    }
}

/// Asserts that both engines are within `limit` of theory in every such check.
fn both_within(case: &str, quantity: &str, limit: f64) {
    for check in checks(case, quantity) {
        let analytic = check["analytic"].as_f64().unwrap();
        for engine in ["native", "other"] {
            let value = check[engine].as_f64().unwrap();
            assert!((value - analytic).abs() <= limit, "{engine}: {check}");
        }
    }
}

#[test]
fn every_case_of_the_suite_is_within_its_tolerances() {
    let cases = [
        "static-pair",
        "static-wall",
        "head-on",
        "restitution",
        "duration",
        "force-history",
        "wall-impact",
        "sliding",
        "sticking",
        "near-rigid",
        "spin",
        "periodic",
        "free-flight",
        "settling-box",
    ];
    for case in cases {
        assert!(CHECKS.iter().any(|check| check["case"] == case), "{case} did not run");
    }
    for check in CHECKS.iter() {
        assert_eq!(check["pass"], true, "{check}");
        assert!(!check["source"].as_str().unwrap().is_empty(), "{check}");
    }
}

#[test]
fn forces_at_rest_are_those_of_hertz_and_of_the_volume_law() {
    for case in ["static-pair", "static-wall"] {
        within(case, "force, d/R = 0.1", 1e-9);
        within(case, "force over Hertz, volume law", 1e-9);
        within(case, "force with cohesion", 1e-9);
    }
}

#[test]
fn an_elastic_head_on_impact_returns_all_of_it_on_the_same_path() {
    both_within("head-on", "restitution, hertz law", 1e-5);
    both_within("head-on", "momentum over that at the start", 1e-14);
    within("head-on", "path of the second sphere", 2e-4);
}

#[test]
fn damped_impacts_have_the_same_force_all_along_and_the_restitution_of_their_law() {
    within("force-history", "whole history of the force", 1e-9);
    for (e, limit) in [(0.95, 2e-4), (0.9, 2e-4), (0.8, 2e-4), (0.7, 2e-4), (0.5, 4e-4)] {
        within("restitution", &format!("restitution, e = {e}, "), limit);
    }
}

#[test]
fn gross_sliding_is_coulomb_friction_and_ends_alike() {
    both_within("sliding", "J_t / (mu J_n)", 1e-6);
    within("sliding", "velocities after", 1e-4);
    within("sliding", "spins after", 2e-3);
}

#[test]
fn free_flight_under_loads_is_exact() {
    for quantity in ["position (m), random", "velocity (m/s), random", "spin (1/s), random"] {
        within("free-flight", quantity, 1e-12);
    }
}
