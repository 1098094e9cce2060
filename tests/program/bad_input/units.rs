//! Numbers in another unit than the one that is meant: the question, and how to write it.

use super::all_refused;
use crate::common::case::{SPHERES, changed};
use crate::common::{Place, has};

/// The words of `check` on the good case with one thing changed.
fn said(good: &str, other: &str) -> String {
    Place::new(&changed(SPHERES, &[(good, other)])).well(&["check", "case.toml"])
}

#[test]
fn a_viscosity_far_above_that_of_water_is_asked_for_its_unit() {
    let dynamic = said("archimedes = 1000", "viscosity = 0.0108");
    has(&dynamic, &["10800 times that of water", "is it the dynamic viscosity, in Pa s?", "1.0800e-5 m^2/s"]);
    for liquid in ["1e-6", "1e-4"] {
        let plain = said("archimedes = 1000", &format!("viscosity = {liquid}"));
        assert!(!plain.contains("dynamic"), "{plain}");
    }
}

#[test]
fn other_names_of_the_viscosity_are_answered_with_what_to_divide() {
    all_refused(&[
        (
            "archimedes = 1000",
            "dynamic_viscosity = 1e-3",
            &[
                "bad.toml:7:1",
                "unknown key `dynamic_viscosity`",
                "viscosity = ... in m^2/s",
                "over the density",
            ],
        ),
        ("archimedes = 1000", "mu = 1e-3", &["bad.toml:7:1", "over the density"]),
        (
            "archimedes = 1000",
            "kinematic_viscosity = 1e-6",
            &["bad.toml:7:1", "write viscosity = ... in m^2/s"],
        ),
    ]);
}

#[test]
fn a_box_of_metres_for_particles_of_millimetres_is_asked_for_its_unit() {
    all_refused(&[(
        "{ diameters = [4, 4, 4] }",
        "[8, 8, 16]",
        &["bad.toml:3:8", "more than 1e12 cells", "{ diameters = [8, 8, 16] }", "[8e-3, 8e-3, 16e-3]?"],
    )]);
    let dry = "[domain]\nsize = [1, 1, 1]\n[dry]\nimpact_speed = 1\n[[particles]]\n\
               shape.sphere.diameter = 1e-3\ndensity = 2500\ncount = 2\n[run]\nend.steps = 5\n";
    let said = Place::new(dry).well(&["check", "case.toml"]);
    has(&said, &["the box is 1 x 1 x 1 m", "{ diameters = [1, 1, 1] }"]);
}

#[test]
fn sizes_that_are_lengths_and_too_small_for_factors_are_refused_with_those_that_are_meant() {
    all_refused(&[
        (
            "seed = 1",
            "sizes = { uniform = [0.75e-3, 1.5e-3] }",
            &[
                "bad.toml:17:9",
                "factors on the lengths",
                "0.00075, 0.0015",
                "divide them by the diameter: 0.5, 1",
            ],
        ),
        (
            "seed = 1",
            "sizes = [{ scale = 3e-3, share = 1 }]",
            &["bad.toml:17:9", "`particles.0.sizes` are factors", "divide them by the diameter: 2"],
        ),
    ]);
}

#[test]
fn sizes_that_may_be_lengths_or_factors_are_asked_for_what_they_are() {
    let dry = "[domain]\nsize = [4e-2, 4e-2, 4e-2]\n[dry]\nimpact_speed = 1\n[[particles]]\n\
               shape.sphere.diameter = 1e-2\ndensity = 2500\ncount = 2\nsizes.uniform = [0.02, 0.04]\n[run]\nend.steps = 5\n";
    let said = Place::new(dry).well(&["check", "case.toml"]);
    has(&said, &["are lengths meant, 0.02, 0.04 m?", "if so, divide them by the diameter: 2, 4;"]);
}

#[test]
fn numbers_that_no_quantity_has_are_refused_instead_of_remedies_that_are_none() {
    all_refused(&[
        (
            "density = 3300.0",
            "density = 1e308",
            &["bad.toml:15:11", "`particles.0.density` is 1e308", "a magnitude of at most 1e30"],
        ),
        (
            "seed = 1",
            "[contact]\nyoungs_modulus = 5e-324",
            &["bad.toml:18:18", "`contact.youngs_modulus` is 5e-324", "at least 1e-30", "Young"],
        ),
        ("seed = 1", "[driving]\ngravity = 1e308", &["bad.toml:18:11", "`driving.gravity` is 1e308", "1e30"]),
        ("seed = 1", "[driving]\ngravity = [0, 0, -1e200]", &["bad.toml:18:", "is -1e200", "1e30"]),
    ]);
}
