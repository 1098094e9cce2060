//! Mesh walls that cannot be.

use super::all_refused_of;
use crate::common::Place;
use crate::common::case::{SPHERES, changed};

const DRY: &str = r#"
[domain]
size = [0.06, 0.06, 0.09]
periodic = [false, false, false]

[dry]
impact_speed = 0.8

[[walls]]
name = "funnel"
mesh = { file = "funnel.stl", unit = "mm", position = [0.03, 0.03, 0.015] }

[[particles]]
shape = { sphere = { diameter = 3e-3 } }
density = 2500.0
list = [[0.03, 0.03, 0.05]]

[contact]
law = "hertz"
youngs_modulus = 5e6
poisson_ratio = 0.25
restitution = 0.5

[run]
end = { steps = 10 }
"#;

const HOPPER: &str = include_str!("../../../cases/hopper.stl");
const MESH: &str = "unit = \"mm\", position = [0.03, 0.03, 0.015] }";

/// The good case, changed, with a mesh.
fn place(changes: &[(&str, &str)], mesh: &str) -> Place {
    let place = Place::new(&changed(DRY, changes));
    place.write("funnel.stl", mesh);
    place
}

#[test]
fn meshes_of_walls_that_are_none_are_refused_with_file_facet_and_remedy() {
    let cut = &HOPPER[..HOPPER.len() / 2];
    let blank = HOPPER.replacen("vertex 9.000000", "vertex nan", 1);
    let flat = "solid flat\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 2 0 0\nendloop\nendfacet\nendsolid\n";
    let cases: [(&str, &[&str]); 4] = [
        (cut, &["case.toml:11:", "funnel.stl", "the text ends before"]),
        (&blank, &["case.toml:11:", "funnel.stl", "facet 0"]),
        (flat, &["funnel.stl", "no facet has an area"]),
        ("", &["funnel.stl", "no STL file"]),
    ];
    for (mesh, words) in cases {
        place(&[], mesh).refused(&["check", "case.toml"], words);
    }
    let mut many = Vec::from([0_u8; 80]);
    many.extend(10_000_000_u32.to_le_bytes());
    let place = Place::new(DRY);
    place.write("funnel.stl", &many);
    place.refused(&["check", "case.toml"], &["funnel.stl", "10000000 facets"]);
}

#[test]
fn mesh_walls_in_the_wrong_place_unit_or_run_are_refused() {
    let refused = |changes: &[(&str, &str)], words: &[&str]| {
        place(changes, HOPPER).refused(&["check", "case.toml"], words);
    };
    refused(&[(MESH, "position = [0.03, 0.03, 0.015] }")], &["case.toml:11:", "778 times", "unit = \"mm\""]);
    refused(
        &[(MESH, "unit = \"mm\", position = [0.3, 0.03, 0.015] }")],
        &["\"funnel\" lies outside the box", "position"],
    );
    refused(
        &[(MESH, "unit = \"mm\", position = [0.03, 0.03, 0.015], side = \"inside\" }")],
        &["open: 64 edges", "the first of facet", "m to (", "leave `side` out"],
    );
    refused(&[(MESH, "unit = \"mm\", side = \"left\" }")], &["case.toml:11:", "left", "outside"]);
    let beside = (MESH, "unit = \"mm\", position = [0.0255, 0.03, 0.015] }");
    let periodic = ("periodic = [false, false, false]", "periodic = [true, true, false]");
    refused(&[beside, periodic], &["\"funnel\" meets the periodic faces in x", "1.500e-3 m away"]);
    refused(&[("[0.03, 0.03, 0.05]", "[0.0545, 0.03, 0.05]")], &["1 particle overlaps a wall", "\"funnel\""]);
    refused(
        &[("restitution = 0.5", "restitution = 0.5\ncohesion = \"jkr\"\nwork_of_adhesion = 0.1")],
        &["\"jkr\"", "the mesh of the wall \"funnel\"", "planes, pipes and rods"],
    );
    let good = place(&[], HOPPER).well(&["check", "case.toml"]);
    assert!(good.contains("open mesh of 128 facets, a sheet of"), "{good}");
    let wall = |motion: &str| {
        let mesh = "mesh = { file = \"funnel.stl\", unit = 2e-5, position = [3e-3, 3e-3, 2.5e-3] }";
        format!("[[walls]]\nname = \"funnel\"\n{mesh}\n{motion}\n\n[run]")
    };
    let wet = |motion: &str| {
        let wet = Place::new(&changed(SPHERES, &[("[run]", &wall(motion))]));
        wet.write("funnel.stl", HOPPER);
        wet
    };
    let leaves = &["\"funnel\" is a mesh that leaves its place", "dry runs may have any"];
    wet("velocity = [0, 0, 1e-3]").refused(&["check", "case.toml"], leaves);
    wet("angular_velocity = [0, 0, 1]")
        .refused(&["check", "case.toml"], &["\"funnel\" is an open mesh that turns"]);
    wet("").well(&["check", "case.toml"]);
}

#[test]
fn particles_outside_of_a_container_or_within_an_obstacle_are_refused() {
    let container = |side: &str| {
        let mesh = format!("unit = \"mm\", position = [0.03, 0.03, 0.015], side = \"{side}\" }}");
        changed(DRY, &[(MESH, &mesh), ("[0.03, 0.03, 0.05]", "[0.005, 0.005, 0.05], [0.03, 0.03, 0.03]")])
    };
    // A tetrahedron of 40 mm.
    let [a, b, c, d] = ["-20 -20 0", "20 -20 0", "0 20 0", "0 0 40"];
    let facets = [[a, c, b], [a, b, d], [b, c, d], [c, a, d]].map(|[a, b, c]| {
        format!("facet normal 0 0 0\nouter loop\nvertex {a}\nvertex {b}\nvertex {c}\nendloop\nendfacet\n")
    });
    let mesh = format!("solid t\n{}endsolid\n", facets.concat());
    for (side, outside) in [("inside", 0), ("outside", 1)] {
        let place = Place::new(&container(side));
        place.write("funnel.stl", &mesh);
        let words = [format!("particle {outside}: "), "1 particle overlaps a wall".to_owned()];
        place.refused(&["check", "case.toml"], &[&words[0], &words[1], "\"funnel\""]);
    }
}

#[test]
fn a_mesh_has_a_file_and_a_wall_one_surface() {
    let table: &[(&str, &str, &[&str])] = &[
        ("file = \"funnel.stl\", ", "", &["bad.toml:11:", "`file`"]),
        (
            "mesh = { file",
            "plane = { point = [0, 0, 0], normal = [0, 0, 1] }\nmesh = { file",
            &["`mesh`", "`plane`"],
        ),
        ("file = \"funnel.stl\"", "file = \"none.stl\"", &["bad.toml:11:", "none.stl", "cannot be read"]),
        ("file = \"funnel.stl\"", "file = \"bad.toml\"", &["bad.toml:11:", "`stl` or `obj`"]),
    ];
    all_refused_of(DRY, table);
}
