//! Motions that cannot be prescribed.

use super::{all_refused, all_refused_of};
use crate::common::Place;
use crate::common::case::{SPHERES, changed};
use crate::common::has;

#[test]
fn bodies_that_cannot_go_through_the_box_are_refused() {
    let random = "volume_fraction = 0.1\nseed = 1";
    let rod = |length: &str, more: &str| {
        format!(
            "count = 0\n[[particles]]\nshape = {{ cylinder = {{ diameter = 1e-3, length = {length} }} }}\ndensity = 2000\n\
             through = \"x\"\n{more}"
        )
    };
    let sphere = format!("{random}\nthrough = \"z\"");
    let listed = |length: &str, motion: &str| rod(length, &format!("{motion}list = [[1e-3, 1e-3, 1e-3]]"));
    let moving = |more: &str| rod("6e-3", &format!("list = [{{ position = [1e-3, 1e-3, 1e-3], {more} }}]"));
    let rows = [
        (sphere, "is no cylinder or prism along its z axis"),
        (listed("5e-3", "motion = \"fixed\"\n"), "0.006 m in x"),
        (moving("angular_velocity = [1, 2, 0]"), "turn about x alone"),
        (rod("6e-3", "count = 1"), "are not placed at random"),
        (listed("6e-3", "motion = { angular_velocity = [1, 2, 0] }\n"), "turn about x alone"),
        (rod("6e-3", "motion = \"fixed\"\ncount = 1"), "are not placed at random"),
        (moving("orientation = { axis = [0, 1, 0], angle = 3 }"), "does not lie along it"),
    ];
    for (particles, expected) in &rows {
        all_refused(&[(random, particles.as_str(), &["bad.toml:", "through", *expected])]);
    }
}

#[test]
fn motions_that_are_none_are_refused() {
    all_refused(&[
        (
            "seed = 1",
            "seed = 1\nmotion = \"frozen\"",
            &["bad.toml:18:10", "unknown choice `frozen`", "free, fixed"],
        ),
        ("seed = 1", "seed = 1\nmotion = 3", &["bad.toml:18:10", "`particles.0.motion` is 3"]),
        (
            "seed = 1",
            "seed = 1\nmotion = { speed = 1 }",
            &["bad.toml:18:12", "unknown", "`speed`", "velocity"],
        ),
        (
            "seed = 1",
            "seed = 1\nmotion = { velocity = [0, 1] }",
            &["bad.toml:18:", "`particles.0.motion.velocity` has 2 values", "must have 3"],
        ),
        (
            "seed = 1",
            "seed = 1\nmotion = { velocity = [0, nan, 0] }",
            &["bad.toml:18:", "`particles.0.motion.velocity` is NaN", "finite"],
        ),
        (
            "seed = 1",
            "seed = 1\nmotion = { free = [\"w\"] }",
            &["bad.toml:18:20", "`w`", "x, y, z, rotation"],
        ),
        (
            "seed = 1",
            "seed = 1\nmotion = { velocity = [0, 0, 1e-3], free = [\"x\", \"z\"] }",
            &["bad.toml:18:", "`particles.0.motion.velocity` prescribes", "\"z\"", "take it off `free`"],
        ),
        (
            "seed = 1",
            "seed = 1\nmotion = { angular_velocity = [0, 0, 1], free = [\"rotation\"] }",
            &["bad.toml:18:", "angular_velocity` prescribes", "\"rotation\""],
        ),
        (
            "seed = 1",
            "seed = 1\nmotion = { velocity = { oscillation = { amplitude = [0, 0, 1e-3], frequency = 0 } } }",
            &["bad.toml:18:", "`particles.0.motion.velocity.oscillation.frequency` is 0", "above 0"],
        ),
        (
            "seed = 1",
            "seed = 1\nmotion = { velocity = { oscillation = { amplitude = [0, 0, 1e-3], frequency = 1e4 } } }",
            &["bad.toml:18:", "oscillation.frequency` is 10000", "at most", "10 time steps"],
        ),
        (
            "seed = 1",
            "seed = 1\nmotion = { velocity = { oscillation = { frequency = 1 } } }",
            &["bad.toml:18:", "`amplitude` is missing"],
        ),
        (
            "seed = 1",
            "seed = 1\nmotion = { velocity = { table = [] } }",
            &["bad.toml:18:", "`particles.0.motion.velocity.table` is empty", "[t, x, y, z]"],
        ),
        (
            "seed = 1",
            "seed = 1\nmotion = { velocity = { table = [[0, 0, 0, 0], [0, 0, 0, 1e-3]] } }",
            &["bad.toml:18:", "`particles.0.motion.velocity.table.1` is 0", "later than 0 s"],
        ),
        (
            "seed = 1",
            "seed = 1\nmotion = { velocity = [0, 0, 10] }",
            &["bad.toml:18:", "`particles.0.motion`", "cells per time step", "cannot follow"],
        ),
        (
            "volume_fraction = 0.1\nseed = 1",
            "motion = \"fixed\"\nlist = [{ position = [3e-3, 3e-3, 3e-3], velocity = [1e-3, 0, 0] }]",
            &["bad.toml:17:", "`particles.0.list.0.velocity` is given", "`motion`"],
        ),
    ]);
    let with_liggghts = changed(SPHERES, &[("[run]", "[dem]\nengine = \"liggghts\"\n[run]")]);
    all_refused_of(
        &with_liggghts,
        &[("seed = 1", "seed = 1\nmotion = \"fixed\"", &["bad.toml:18:10", "LIGGGHTS", "native"])],
    );
}

#[test]
fn check_names_what_is_prescribed_and_does_not_let_fixed_bodies_settle() {
    let light = ("density = 3300.0", "density = 30.0");
    let fixed = ("seed = 1", "seed = 1\nmotion = \"fixed\"");
    let free = Place::new(&changed(SPHERES, &[light])).well(&["check", "case.toml"]);
    assert!(free.contains("too light"), "{free}");
    let said = Place::new(&changed(SPHERES, &[light, fixed])).well(&["check", "case.toml"]);
    assert!(!said.contains("too light"), "{said}");
    has(&said, &[", fixed"]);
}
