//! Shapes that cannot be, and what is said of thin ones.

use super::all_refused;
use crate::common::case::{SPHERE, SPHERES, changed};
use crate::common::{Place, has};

#[test]
fn shapes_that_are_no_bodies_are_refused() {
    all_refused(&[
        (SPHERE, "{ cube = {} }", &["bad.toml:14:", "`edge`, `equivalent_diameter`", "none"]),
        (SPHERE, "{ cube = { edge = 1e-3, equivalent_diameter = 1e-3 } }", &["bad.toml:14:", "has 2"]),
        (
            SPHERE,
            "{ cuboid = { edges = [1e-3, 0, 1e-3] } }",
            &["bad.toml:14:37", "`particles.0.shape.cuboid.edges` is 0", "metres"],
        ),
        (
            SPHERE,
            "{ ellipsoid = { axes = [1e-3, 1e-3, nan] } }",
            &["bad.toml:14:", "`particles.0.shape.ellipsoid.axes` is NaN"],
        ),
        (
            SPHERE,
            "{ cuboid = { edges = [1, 1, 2], equivalent_diameter = -1 } }",
            &["bad.toml:14:", "`particles.0.shape.cuboid.equivalent_diameter` is -1"],
        ),
        (
            SPHERE,
            "{ capsule = { diameter = 1e-3, length = 1e-3 } }",
            &["bad.toml:14:", "more than its diameter", "tip to tip"],
        ),
        (
            SPHERE,
            "{ superellipsoid = { axes = [1e-3, 1e-3, 1e-3], exponents = [3, 1] } }",
            &["bad.toml:14:", "exponent 3", "1.9"],
        ),
        (
            SPHERE,
            "{ polyhedron = { vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]] } }",
            &["bad.toml:14:", "at least 4", "there are 3"],
        ),
        (
            SPHERE,
            "{ polyhedron = { vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]] } }",
            &["bad.toml:14:", "flat"],
        ),
        (
            SPHERE,
            "{ polyhedron = { vertices = [[0, 0, 0], [4, 0, 0], [0, 4, 0], [0, 0, 4], [0.1, 0.2, 0.3]] } }",
            &["bad.toml:14:", "point 4 at (0.1, 0.2, 0.3)", "concave", "hull = true"],
        ),
        (
            SPHERE,
            "{ polyhedron = { vertices = [[0, 0, 0], [4, 0, 0], [0, 4, 0], [0, 0, nan]] } }",
            &["bad.toml:14:", "`particles.0.shape.polyhedron.vertices.3` is NaN", "finite"],
        ),
        (SPHERE, "{ mesh = { file = \"none.stl\" } }", &["bad.toml:14:", "none.stl", "cannot be read"]),
        (
            SPHERE,
            "{ mesh = { file = \"none.stl\", unit = \"ell\" } }",
            &["bad.toml:14:", "unknown choice `ell`", "m, cm, mm"],
        ),
        (
            SPHERE,
            "{ mesh = { file = \"none.stl\", scale = 0 } }",
            &["bad.toml:14:", "`particles.0.shape.mesh.scale` is 0"],
        ),
        (
            SPHERE,
            "{ cuboid = { edges = [6.2e-3, 1e-4, 1e-4] } }",
            &["14 |", "bad.toml:3:", "too large for the box"],
        ),
        (
            SPHERE,
            "{ composite = { parts = [] } }",
            &["bad.toml:14:", "`particles.0.shape.composite.parts` is empty", "one part or more"],
        ),
        (
            SPHERE,
            "{ composite = { parts = [{ shape = { cube = { edge = 0 } } }] } }",
            &["bad.toml:14:", "`particles.0.shape.composite.parts.0.shape.cube.edge` is 0"],
        ),
        (
            SPHERE,
            "{ composite = { parts = [{ shape = { cube = { edge = 1e-4 } }, orientation = { axis = [0, 0, 1] } }] } }",
            &["bad.toml:14:", "`particles.0.shape.composite.parts.0.orientation`", "no angle"],
        ),
        (
            SPHERE,
            "{ composite = { parts = [{ shape = { cube = { edge = 1e-4 } }, place = [0, 0, 0] }] } }",
            &["bad.toml:14:", "unknown key `place`", "position"],
        ),
        (
            SPHERE,
            "{ composite = { parts = [{ shape = { mesh = { file = \"none.stl\" } } }] } }",
            &["bad.toml:14:", "none.stl", "cannot be read"],
        ),
        ("seed = 1", "seed = 1\nsizes = []", &["bad.toml:18:9", "`particles.0.sizes` is empty"]),
        (
            "seed = 1",
            "seed = 1\nsizes = { uniform = [1.2, 0.8] }",
            &["bad.toml:18:", "at least 1.2", "smallest factor"],
        ),
        (
            "seed = 1",
            "seed = 1\nsizes = [{ scale = 1, share = 0 }]",
            &["bad.toml:18:", "`particles.0.sizes.0.share` is 0"],
        ),
        ("seed = 1", "seed = 1\nsizes = [{ scale = 5, share = 1 }]", &["14 |", "too large for the box"]),
        (
            "volume_fraction = 0.1\nseed = 1",
            "list = [[1e-3, 1e-3, 1e-3]]\nsizes = [{ scale = 1, share = 1 }]",
            &["bad.toml:17:9", "`particles.0.sizes`", "remove it"],
        ),
        (
            "seed = 1",
            "seed = 1\ncolumns = { x = \"Points:0\" }",
            &["bad.toml:18:11", "`particles.0.columns` belongs to a `file`", "remove it"],
        ),
    ]);
}

/// Corners of a facet.
type Facet = [[f64; 3]; 3];
/// A surface, and what must be said of it.
type Spoilt<'a> = (&'a [Facet], &'a [&'a str]);

/// Facets of the cube `[0, 1]^3`, counter-clockwise seen from outside.
fn cube_facets() -> Vec<Facet> {
    let mut facets = Vec::new();
    for axis in 0..3 {
        for side in [0.0, 1.0] {
            let corner = |a: f64, b: f64| {
                let mut x = [side; 3];
                (x[(axis + 1) % 3], x[(axis + 2) % 3]) = (a, b);
                x
            };
            let mut square = [corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)];
            if side < 0.5 {
                square.reverse();
            }
            facets.push([square[0], square[1], square[2]]);
            facets.push([square[0], square[2], square[3]]);
        }
    }
    facets
}

fn stl(facets: &[Facet]) -> String {
    use std::fmt::Write;
    let mut text = String::from("solid body\n");
    for facet in facets {
        text.push_str("facet normal 0 0 0\nouter loop\n");
        for [x, y, z] in facet {
            writeln!(text, "vertex {x} {y} {z}").unwrap();
        }
        text.push_str("endloop\nendfacet\n");
    }
    text + "endsolid body\n"
}

#[test]
fn mistakes_in_a_mesh_file_are_shown_with_the_facet() {
    let mesh = "{ mesh = { file = \"stone.stl\", unit = \"mm\" } }";
    let place = Place::new(&changed(SPHERES, &[(SPHERE, mesh)]));
    let write = |facets: &[Facet]| {
        place.write("stone.stl", stl(facets));
    };
    let good = cube_facets();
    write(&good);
    place.well(&["check", "case.toml"]);

    let mut not_a_number = good.clone();
    not_a_number[5][1][2] = f64::NAN;
    let inverted: Vec<_> = good.iter().map(|&[a, b, c]| [a, c, b]).collect();
    let mut concave = good.clone();
    for x in concave.iter_mut().flatten().filter(|x| x.iter().sum::<f64>() > 2.5) {
        *x = [0.4, 0.4, 0.4];
    }
    let flat: Vec<_> = good.iter().map(|f| f.map(|[x, y, _]| [x, y, 0.0])).collect();
    let mut turned = good.clone();
    turned[3].swap(0, 1);
    // A second cube at an edge of the first.
    let twins: Vec<_> =
        good.iter().copied().chain(good.iter().map(|f| f.map(|[x, y, z]| [x + 1.0, y + 1.0, z]))).collect();
    let spoilt: [Spoilt; 7] = [
        (&not_a_number, &["case.toml:14:", "stone.stl", "facet 5"]),
        (&good[1..], &["case.toml:14:", "stone.stl", "open: 3 edges", "the first of facet"]),
        (
            &turned,
            &["stone.stl", "3 edges through which both facets run the same way", "facets", "inside out"],
        ),
        (&twins, &["stone.stl", "not manifold: 1 edge", "from (0.001, 0.001, 0"]),
        (&inverted, &["stone.stl", "inside out"]),
        (&concave, &["stone.stl", "concave", "% of the diameter", "hull = true", "adds"]),
        (&flat, &["stone.stl"]),
    ];
    for (facets, words) in spoilt {
        write(facets);
        place.refused(&["check", "case.toml"], words);
    }
}

#[test]
fn a_plate_thinner_than_four_cells_is_warned_of_with_the_number() {
    let plate = "{ cuboid = { edges = [1, 1, 0.2], equivalent_diameter = 1e-3 } }";
    let one = ("volume_fraction = 0.1", "count = 1");
    let place = Place::new(&changed(SPHERES, &[(SPHERE, plate), one]));
    let said = place.well(&["check", "case.toml"]);
    // The sphere is 8 cells; 0.2 of 8 (pi / 1.2)^(1/3). Four cells need 14.51.
    has(&said, &["case.toml:14:", "2.21 cells thick", "below 4", "cells_per_diameter = 14.6"]);
}

#[test]
fn packed_bodies_come_back_where_and_as_they_were_turned() {
    let stone = "{ polyhedron = { vertices = [[0, 0, 0], [2, 0, 0], [0.3, 1.5, 0], [0.2, 0.1, 1.2], [1, 0.9, 1]], \
                 equivalent_diameter = 1e-3 } }";
    let place = Place::new(&changed(SPHERES, &[(SPHERE, stone), ("[4, 4, 4]", "[6, 6, 6]")]));
    place.well(&["pack", "case.toml", "--out", "a.txt"]);
    let again = ["pack", "case.toml", "--out", "b.txt", "--set", "particles.0.file=a.txt"];
    place.well(&again);
    let read = |name| -> Vec<Vec<f64>> {
        let text = place.text(name);
        let number = |field: &str| field.parse().unwrap();
        text.lines().skip(1).map(|line| line.split(',').map(number).collect()).collect()
    };
    let (once, again) = (read("a.txt"), read("b.txt"));
    assert!(once.len() > 20 && once.len() == again.len());
    for (a, b) in once.iter().zip(&again) {
        assert_eq!(a[..3], b[..3]);
        for i in 3..7 {
            assert!((a[i] - b[i]).abs() < 1e-9, "{a:?} {b:?}");
        }
    }
    assert!(once.iter().any(|line| line[3].abs() > 0.1), "turned at random");
}
