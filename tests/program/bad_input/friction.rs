//! Friction that a case cannot have.

use super::all_refused_of;
use crate::common::case::{SPHERE, SPHERES, changed};

#[test]
fn partial_slip_of_bodies_and_engines_that_lack_it_and_a_static_coefficient_for_it_are_refused() {
    let case = changed(SPHERES, &[("[run]", "[contact]\nfriction = \"mindlin_deresiewicz\"\n[run]")]);
    let round = "`contact.friction` \"mindlin_deresiewicz\" is the friction of round bodies, but `particles.0.shape` is a";
    all_refused_of(
        &case,
        &[
            (
                SPHERE,
                "{ cube = { edge = 1e-3 } }",
                &["bad.toml:14:", round, "has edges", "friction_kinetic = 0", "take \"mindlin\""],
            ),
            (
                "[run]",
                "[dem]\nengine = \"liggghts\"\n[run]",
                &["bad.toml:20:12", "\"mindlin_deresiewicz\", which LIGGGHTS", "\"mindlin_displacement\""],
            ),
            (
                "[run]",
                "[dem]\nengine = { command = [\"true\"] }\n[run]",
                &["bad.toml:20:12", "`contact.friction` is \"mindlin_deresiewicz\", of which a program"],
            ),
            (
                "[run]",
                "friction_static = 0.5\n[run]",
                &["bad.toml:21:", "`contact.friction_static` is given", "reads no `friction_static`"],
            ),
        ],
    );
}
