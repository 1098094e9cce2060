//! Lubrication that a case cannot have.

use super::{all_refused, all_refused_of};
use crate::common::Place;
use crate::common::case::{SPHERES, changed};
use crate::common::has;

#[test]
fn lubrication_of_other_bodies_engines_and_gaps_is_refused_with_the_reason() {
    let with = |keys: &str| format!("[contact]\n{keys}\n[run]");
    all_refused(&[
        (
            "[run]",
            &with("lubrication = { roughness = 0 }"),
            &["`contact.lubrication.roughness` is 0", "above 0"],
        ),
        (
            "[run]",
            &with("lubrication = { roughness = 1e-3 }"),
            &["`contact.lubrication.roughness` is 0.001 m, and a cell has", "less than a cell"],
        ),
        ("[run]", &with("lubrication = { rough = 1e-7 }"), &["unknown key `rough`", "roughness"]),
        ("[run]", &with("enabled = false\nlubrication = {}"), &["needs contacts, which are off"]),
        (
            "[run]",
            "[contact]\nlubrication = {}\n[dem]\nengine = \"liggghts\"\n[run]",
            &["`contact.lubrication` is given, but LIGGGHTS", "native"],
        ),
    ]);
    let lubricated = changed(SPHERES, &[("[run]", &with("lubrication = {}"))]);
    let line = SPHERES.lines().find(|line| line.starts_with("shape")).unwrap();
    let only = "films of spheres and ellipsoids only";
    all_refused_of(
        &lubricated,
        &[
            (
                line,
                "shape = { cube = { edge = 1e-3 } }",
                &[only, "`particles.0.shape` is a cuboid", "flat faces"],
            ),
            (
                line,
                "shape = { capsule = { diameter = 1e-3, length = 2e-3 } }",
                &[only, "is a capsule", "without curvature"],
            ),
        ],
    );
    let more = |shape: &str| {
        format!("{lubricated}\n[[particles]]\nshape = {{ {shape} }}\ndensity = 3300.0\ncount = 3\nseed = 2\n")
    };
    Place::new(&more("cube = { edge = 1e-3 }")).well(&["check", "case.toml"]);
    all_refused_of(
        &more("cylinder = { diameter = 1e-3, length = 1e-3 }"),
        &[("[run]", "[run]", &[only, "`particles.1.shape` is a cylinder"])],
    );
    let said = Place::new(&lubricated).well(&["check", "case.toml"]);
    has(&said, &["lubrication below", "1.0e-3 radii", "surfaces touch at 0.000e0 m"]);
}
