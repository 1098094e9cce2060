//! Shapes, walls, materials and dry runs that cannot be.

use super::{CASE, all_refused, refused, turbid};

#[test]
fn shapes_that_are_no_bodies_are_refused() {
    const SHAPE: &str = "{ sphere = { diameter = 1.5e-3 } }";
    all_refused(&[
        (
            SHAPE,
            "{ cube = {} }",
            &["bad.toml:14:", "`edge`, `equivalent_diameter`", "none"],
        ),
        (
            SHAPE,
            "{ cube = { edge = 1e-3, equivalent_diameter = 1e-3 } }",
            &["bad.toml:14:", "has 2"],
        ),
        (
            SHAPE,
            "{ cuboid = { edges = [1e-3, 0, 1e-3] } }",
            &[
                "bad.toml:14:37",
                "`particles.0.shape.cuboid.edges` is 0",
                "metres",
            ],
        ),
        (
            SHAPE,
            "{ ellipsoid = { axes = [1e-3, 1e-3, nan] } }",
            &["bad.toml:14:", "`particles.0.shape.ellipsoid.axes` is NaN"],
        ),
        (
            SHAPE,
            "{ cuboid = { edges = [1, 1, 2], equivalent_diameter = -1 } }",
            &[
                "bad.toml:14:",
                "`particles.0.shape.cuboid.equivalent_diameter` is -1",
            ],
        ),
        (
            SHAPE,
            "{ capsule = { diameter = 1e-3, length = 1e-3 } }",
            &["bad.toml:14:", "more than its diameter", "tip to tip"],
        ),
        (
            SHAPE,
            "{ superellipsoid = { axes = [1e-3, 1e-3, 1e-3], exponents = [3, 1] } }",
            &["bad.toml:14:", "exponent 3", "1.9"],
        ),
        (
            SHAPE,
            "{ polyhedron = { vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]] } }",
            &["bad.toml:14:", "at least 4", "there are 3"],
        ),
        (
            SHAPE,
            "{ polyhedron = { vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]] } }",
            &["bad.toml:14:", "flat"],
        ),
        (
            SHAPE,
            "{ polyhedron = { vertices = [[0, 0, 0], [4, 0, 0], [0, 4, 0], [0, 0, 4], [0.1, 0.2, 0.3]] } }",
            &[
                "bad.toml:14:",
                "point 4 at (0.1, 0.2, 0.3)",
                "concave",
                "hull = true",
            ],
        ),
        (
            SHAPE,
            "{ polyhedron = { vertices = [[0, 0, 0], [4, 0, 0], [0, 4, 0], [0, 0, nan]] } }",
            &["bad.toml:14:", "point 3", "finite"],
        ),
        (
            SHAPE,
            "{ mesh = { file = \"none.stl\" } }",
            &["bad.toml:14:", "none.stl", "cannot be read"],
        ),
        (
            SHAPE,
            "{ mesh = { file = \"none.stl\", unit = \"ell\" } }",
            &["bad.toml:14:", "\"ell\"", "m, cm, mm"],
        ),
        (
            SHAPE,
            "{ mesh = { file = \"none.stl\", scale = 0 } }",
            &["bad.toml:14:", "`particles.0.shape.mesh.scale` is 0"],
        ),
        (
            SHAPE,
            "{ cuboid = { edges = [3.2e-3, 1e-4, 1e-4] } }",
            &["14 |", "bad.toml:3:", "larger than half the box"],
        ),
        (
            "seed = 1",
            "seed = 1\nsizes = []",
            &["bad.toml:18:9", "`particles.0.sizes` is empty"],
        ),
        (
            "seed = 1",
            "seed = 1\nsizes = { uniform = [1.2, 0.8] }",
            &["bad.toml:18:", "at least 1.2", "smallest factor"],
        ),
        (
            "seed = 1",
            "seed = 1\nsizes = [{ scale = 1, share = 0 }]",
            &["bad.toml:18:", "`particles.0.sizes.share` is 0"],
        ),
        (
            "seed = 1",
            "seed = 1\nsizes = [{ scale = 3, share = 1 }]",
            &["14 |", "larger than half the box"],
        ),
        (
            "volume_fraction = 0.1\nseed = 1",
            "list = [[1e-3, 1e-3, 1e-3]]\nsizes = [{ scale = 1, share = 1 }]",
            &["bad.toml:17:9", "`particles.0.sizes`", "remove it"],
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
            let mut square = [
                corner(0.0, 0.0),
                corner(1.0, 0.0),
                corner(1.0, 1.0),
                corner(0.0, 1.0),
            ];
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
    let folder = tempfile::tempdir().unwrap();
    let mesh = "{ mesh = { file = \"stone.stl\", unit = \"mm\" } }";
    let case = CASE.replace("{ sphere = { diameter = 1.5e-3 } }", mesh);
    std::fs::write(folder.path().join("case.toml"), case).unwrap();
    let write = |facets: &[Facet]| {
        std::fs::write(folder.path().join("stone.stl"), stl(facets)).unwrap();
    };
    let good = cube_facets();
    write(&good);
    let output = turbid(folder.path(), &["check", "case.toml"]);
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );

    let mut not_a_number = good.clone();
    not_a_number[5][1][2] = f64::NAN;
    let inverted: Vec<_> = good.iter().map(|&[a, b, c]| [a, c, b]).collect();
    let mut concave = good.clone();
    for x in concave
        .iter_mut()
        .flatten()
        .filter(|x| x.iter().sum::<f64>() > 2.5)
    {
        *x = [0.4, 0.4, 0.4];
    }
    let flat: Vec<_> = good.iter().map(|f| f.map(|[x, y, _]| [x, y, 0.0])).collect();
    let spoilt: [Spoilt; 5] = [
        (&not_a_number, &["case.toml:14:", "stone.stl", "facet 5"]),
        (&good[1..], &["case.toml:14:", "stone.stl", "open"]),
        (&inverted, &["stone.stl", "inside out"]),
        (&concave, &["stone.stl", "concave", "hull = true"]),
        (&flat, &["stone.stl"]),
    ];
    for (facets, words) in spoilt {
        write(facets);
        refused(folder.path(), &["check", "case.toml"], words);
    }
}

#[test]
fn walls_and_faces_that_cannot_be_are_refused() {
    const SIZE: &str = "[4, 4, 4] }";
    let closed = |more: &str| format!("[4, 4, 4] }}\nperiodic = [true, true, false]\n{more}");
    let wall = |text: &str| format!("[[walls]]\nname = \"floor\"\n{text}\n\n[run]");
    let tables: Vec<(&str, String, &[&str])> = vec![
        (
            SIZE,
            "[4, 4, 4] }\n[domain.faces]\n\"z+\" = { velocity = [1e-3, 0, 0] }".to_string(),
            &["bad.toml:5:8", "\"z+\" is periodic", "false for z"],
        ),
        (
            SIZE,
            closed("[domain.faces]\n\"z*\" = {}"),
            &["bad.toml:6:1", "unknown key `z*`", "z+"],
        ),
        (
            SIZE,
            closed("[domain.faces]\n\"z+\" = { velocity = [0, 0, 1e-3] }"),
            &["bad.toml:6:8", "\"z+\" moves along its normal", "dry"],
        ),
        (
            SIZE,
            closed("[domain.faces]\n\"z+\" = { velocity = [inf, 0, 0] }"),
            &["bad.toml:6:8", "`domain.faces.z+.velocity` is inf"],
        ),
        (
            SIZE,
            closed("[domain.faces]\n\"z+\" = { material = \"steel\" }"),
            &["bad.toml:6:21", "\"steel\"", "no such material", "[[materials]]"],
        ),
        (
            "[4, 4, 4] }",
            "[4, 4, 0.5] }\nperiodic = [true, true, false]".to_string(),
            &["bad.toml:3:", "does not fit between walls"],
        ),
        (
            "volume_fraction = 0.1\nseed = 1",
            "list = [[3e-3, 3e-3, 1e-3]]\n[[walls]]\nname = \"floor\"\nplane = { point = [0, 0, 5e-4], normal = [0, 0, 1] }"
                .to_string(),
            &["bad.toml:", "\"floor\" meets the periodic faces in z"],
        ),
        (
            "[run]",
            wall("plane = { point = [0, 0, 1], normal = [0, 0, 1] }"),
            &["bad.toml:19:1", "leaves no free space"],
        ),
        (
            "[run]",
            wall("plane = { point = [0, 0, -1], normal = [0, 0, 1] }"),
            &["bad.toml:19:1", "outside the box", "6.000000e-3"],
        ),
        (
            "[run]",
            wall("plane = { point = [0, 0, 0], normal = [0, 0, 0] }"),
            &["bad.toml:21:9", "`walls.0.plane.normal` is [0, 0, 0]"],
        ),
        (
            "[run]",
            wall("pipe = { point = [3e-3, 3e-3, 0], axis = [0, 0, 1], diameter = 0 }"),
            &["bad.toml:21:", "`walls.0.pipe.diameter` is 0"],
        ),
        (
            "[run]",
            wall("pipe = { point = [3e-3, 3e-3, 0], axis = [0, 0, 1], diameter = 5e-3 }\nvelocity = [1e-3, 0, 0]"),
            &["bad.toml:19:1", "\"floor\" moves across its axis"],
        ),
        (
            "[run]",
            wall("rod = { point = [6e-3, 3e-3, 0], axis = [0, 0, 1], diameter = 1e-3 }"),
            &["bad.toml:19:1", "periodic faces in x"],
        ),
        ("[run]", wall(""), &["bad.toml:19:1", "`plane`, `pipe`, `rod`", "none"]),
    ];
    for (good, spoilt, words) in &tables {
        all_refused(&[(good, spoilt, words)]);
    }
}

#[test]
fn particles_that_overlap_each_other_or_a_wall_are_listed() {
    const SHAPE: &str =
        "shape = { sphere = { diameter = 1.5e-3 } }\ndensity = 3300.0\nvolume_fraction = 0.1\nseed = 1";
    let with = |shape: &str, list: &str| format!("shape = {shape}\ndensity = 3300.0\nlist = [{list}]");
    let cube = "{ cube = { edge = 1e-3 } }";
    let turned = "{ position = [4.3e-3, 3e-3, 3e-3], orientation = { axis = [0, 0, 1], angle = 45 } }";
    let tables: Vec<(&str, String, &[&str])> = vec![
        (
            SHAPE,
            // Corner to face: half an edge and half a diagonal are 1.207 mm.
            with(
                cube,
                "[3.1e-3, 3e-3, 3e-3], { position = [4.3e-3, 3e-3, 3e-3], orientation = { axis = [0, 0, 1], angle = 45 } }",
            ),
            &["bad.toml:16:9", "particles 0 and 1", "deep", "1.2"],
        ),
        (
            SHAPE,
            with(
                cube,
                "{ position = [1e-3, 1e-3, 1e-3], orientation = { axis = [0, 0, 0], angle = 45 } }",
            ),
            &[
                "bad.toml:16:",
                "`particles.0.list.0.orientation.axis` is [0, 0, 0]",
            ],
        ),
        (
            SHAPE,
            with(
                cube,
                "{ position = [1e-3, 1e-3, 1e-3], orientation = { axis = [0, 0, 1] } }",
            ),
            &["bad.toml:16:", "has an axis, but no angle"],
        ),
        (
            SHAPE,
            with(
                cube,
                "{ position = [1e-3, 1e-3, 1e-3], orientation = { quaternion = [0, 0, 0, 0] } }",
            ),
            &["bad.toml:16:", "quaternion", "not all zero"],
        ),
        (
            SHAPE,
            with(
                cube,
                "{ position = [1e-3, 1e-3, 1e-3], orientation = { angle = 3 } }",
            ),
            &["bad.toml:16:", "exactly one of `axis`, `quaternion`"],
        ),
    ];
    for (good, spoilt, words) in &tables {
        all_refused(&[(good, spoilt, words)]);
    }
    // In a closed box, and without the turn there is room for the cubes.
    let closed = CASE
        .replace("[4, 4, 4] }", "[4, 4, 4] }\nperiodic = [true, true, false]")
        .replace(
            SHAPE,
            &with(
                cube,
                &format!("[3.1e-3, 3e-3, 3e-3], {}", turned.replace("45", "0")),
            ),
        );
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("case.toml");
    std::fs::write(&path, &closed).unwrap();
    let output = turbid(folder.path(), &["check", "case.toml"]);
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    std::fs::write(
        &path,
        closed.replace("[3.1e-3, 3e-3, 3e-3]", "[3.1e-3, 3e-3, 4.5e-3]"),
    )
    .unwrap();
    let words = ["1 particle overlaps a wall", "particle 0: 3.7", "the wall \"z+\""];
    refused(folder.path(), &["check", "case.toml"], &words);
}

#[test]
fn materials_steps_and_dry_runs_that_make_no_sense_are_refused() {
    let dry = CASE.find("[fluid]").unwrap()..CASE.find("[[particles]]").unwrap();
    let dry = &CASE[dry];
    all_refused(&[
        (
            "density = 3300.0",
            "density = 3300.0\nmaterial = \"glas\"\n",
            &["bad.toml:16:12", "no such material"],
        ),
        (
            "[run]",
            "[[materials]]\nname = \"glass\"\n[[materials]]\nname = \"glass\"\n[run]",
            &["bad.toml:22:8", "given twice"],
        ),
        (
            "[run]",
            "[[materials]]\nname = \"glass\"\n[[contact.pairs]]\nmaterials = [\"glass\", \"steal\"]\n[run]",
            &["bad.toml:22:23", "\"steal\"", "glass"],
        ),
        (
            "[run]",
            "[[contact.pairs]]\nmaterials = [\"default\", \"default\"]\nrestitution = 2\n[run]",
            &["bad.toml:21:15", "`contact.pairs.0.restitution` is 2"],
        ),
        (
            "[run]",
            "[contact]\nsubsteps = 10001\n[run]",
            &["bad.toml:20:12", "`contact.substeps` is 10001", "at most 10000"],
        ),
        (
            "relaxation_time = 0.55",
            "relaxation_time = 0.55\ncollision = \"bgk\"\nmagic_parameter = 0.2",
            &["bad.toml:13:19", "trt"],
        ),
        (
            "relaxation_time = 0.55",
            "relaxation_time = 0.55\ncollision = \"trt\"\nmagic_parameter = 0",
            &["bad.toml:13:19", "`lattice.magic_parameter` is 0"],
        ),
        (
            "[run]",
            "[output]\nseries_every = \"never\"\n[run]",
            &["bad.toml:20:16", "\"never\"", "means"],
        ),
        (
            "[run]",
            "[output]\npicture_range = 0\n[run]",
            &["bad.toml:20:17", "`output.picture_range` is 0", "m/s"],
        ),
        (
            "[run]",
            "[output]\npicture_plane = { normal = \"y\", position = 1 }\n[run]",
            &[
                "bad.toml:20:44",
                "`output.picture_plane.position` is 1",
                "from 0 to 0.006",
            ],
        ),
        (
            "[run]",
            "[output]\npicture_plane = { normal = \"w\" }\n[run]",
            &["bad.toml:20:28", "unknown choice `w`"],
        ),
        (
            "[4, 4, 4]",
            "[4, 4, 2]",
            &[
                "bad.toml:3:8",
                "two periodic images at once",
                "contact enlargement included",
            ],
        ),
        (
            "[run]",
            "[dry]\ntime_step = 1e-5\n[run]",
            &["[fluid]", "bad.toml:5:1", "dry run"],
        ),
        (dry, "", &["section [fluid] is missing", "[dry]"]),
        (dry, "[dry]\n", &["`time_step`, `impact_speed`"]),
        (
            dry,
            "[dry]\ntime_step = 0\n",
            &["bad.toml:6:13", "`dry.time_step` is 0"],
        ),
        (
            dry,
            "[dry]\nimpact_speed = 0\n",
            &["bad.toml:6:16", "`dry.impact_speed` is 0"],
        ),
        (
            dry,
            "[contact]\nenlargement = 0.1\n[dry]\ntime_step = 1e-5\n",
            &["bad.toml:6:15", "dry.enlargement"],
        ),
        (
            dry,
            "[driving]\nzero_net_flux = true\n[dry]\ntime_step = 1e-5\n",
            &["bad.toml:6:17", "no meaning in a dry run"],
        ),
        (
            dry,
            "[output]\nfields_every = { steps = 1 }\n[dry]\ntime_step = 1e-5\n",
            &["bad.toml:6:16", "no field"],
        ),
        (
            dry,
            "[output]\npicture_plane = { normal = \"x\", position = 1e-3 }\n[dry]\ntime_step = 1e-5\n",
            &["bad.toml:6:44", "no slice"],
        ),
    ]);
}

#[test]
fn a_plate_thinner_than_four_cells_is_warned_of_with_the_number() {
    let folder = tempfile::tempdir().unwrap();
    let plate = "{ cuboid = { edges = [1, 1, 0.2], equivalent_diameter = 1e-3 } }";
    let case = CASE
        .replace("{ sphere = { diameter = 1.5e-3 } }", plate)
        .replace("volume_fraction = 0.1", "count = 1");
    std::fs::write(folder.path().join("case.toml"), case).unwrap();
    let output = turbid(folder.path(), &["check", "case.toml"]);
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{said}");
    // The sphere is 8 cells; 0.2 of 8 (pi / 1.2)^(1/3).
    for word in [
        "case.toml:14:",
        "2.21 cells thick",
        "below 4",
        "cells_per_diameter = 14.5",
    ] {
        assert!(said.contains(word), "`{word}` is not in\n{said}");
    }
}

#[test]
fn packed_bodies_come_back_where_and_as_they_were_turned() {
    let folder = tempfile::tempdir().unwrap();
    let stone = "{ polyhedron = { vertices = [[0, 0, 0], [2, 0, 0], [0.3, 1.5, 0], [0.2, 0.1, 1.2], [1, 0.9, 1]], \
                 equivalent_diameter = 1e-3 } }";
    let case = CASE
        .replace("{ sphere = { diameter = 1.5e-3 } }", stone)
        .replace("[4, 4, 4]", "[6, 6, 6]");
    std::fs::write(folder.path().join("case.toml"), case).unwrap();
    let pack = |arguments: &[&str]| {
        let all = [&["pack", "case.toml"], arguments].concat();
        let output = turbid(folder.path(), &all);
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
    };
    pack(&["--out", "a.txt"]);
    pack(&["--out", "b.txt", "--set", "particles.0.file=a.txt"]);
    let read = |name| -> Vec<Vec<f64>> {
        let text = std::fs::read_to_string(folder.path().join(name)).unwrap();
        let number = |field: &str| field.parse().unwrap();
        text.lines()
            .skip(1)
            .map(|line| line.split(';').map(number).collect())
            .collect()
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
