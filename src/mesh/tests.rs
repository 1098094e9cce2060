use super::*;
use crate::math::Quat;
use crate::shape::Cuboid;
use std::fmt::Write as _;
use std::path::PathBuf;

/// Corners of a cuboid as triangles, counter-clockwise from outside.
pub(super) fn box_facets(edges: Vec3) -> Vec<[Vec3; 3]> {
    let mesh = Cuboid::new(edges).unwrap().surface_mesh(0);
    mesh.triangles.iter().map(|t| t.map(|i| mesh.points[i as usize])).collect()
}

/// A prism of height 1 over an L: a square of 3 without one of 2.
pub(super) fn l() -> Vec<[Vec3; 3]> {
    let outline = [[0, 0], [3, 0], [3, 1], [1, 1], [1, 3], [0, 3]].map(|at| at.map(f64::from));
    let at = |n: usize, z: f64| Vec3::new(outline[n % 6][0], outline[n % 6][1], z);
    // Caps are fans about the corner in the middle.
    let caps = (4..8)
        .flat_map(|n| [[at(3, 1.0), at(n, 1.0), at(n + 1, 1.0)], [at(3, 0.0), at(n + 1, 0.0), at(n, 0.0)]]);
    let sides = (0..6).flat_map(|n| {
        let [a, b, c, d] = [at(n, 0.0), at(n + 1, 0.0), at(n + 1, 1.0), at(n, 1.0)];
        [[a, b, c], [a, c, d]]
    });
    caps.chain(sides).collect()
}

pub(super) fn text_stl(facets: &[[Vec3; 3]]) -> Vec<u8> {
    let mut text = "solid test\n".to_owned();
    for facet in facets {
        text += " facet normal 0 0 0\n  outer loop\n";
        for c in facet {
            let _ = writeln!(text, "   vertex {} {} {}", c.x, c.y, c.z);
        }
        text += "  endloop\n endfacet\n";
    }
    (text + "endsolid test\n").into_bytes()
}

pub(super) fn binary_stl(facets: &[[Vec3; 3]], head: &str) -> Vec<u8> {
    let mut bytes = head.as_bytes().to_vec();
    bytes.resize(80, b' ');
    bytes.extend((facets.len() as u32).to_le_bytes());
    for facet in facets {
        bytes.extend([0; 12]);
        for x in facet.iter().flatten() {
            bytes.extend((*x as f32).to_le_bytes());
        }
        bytes.extend([0; 2]);
    }
    bytes
}

pub(super) fn read_bytes(name: &str, bytes: &[u8], hull: bool) -> Result<Mesh, String> {
    parse(Path::new(name), bytes, 1e-3, hull).map_err(|e| {
        let message = e.to_string();
        assert!(message.contains(name), "the file is named: {message}");
        message
    })
}

const OBJ_CUBE: &str = "# unit cube\nmtllib none.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\n\
    v 0 1 1\nvn 0 0 1\nf 4 3 2 1\nf 5//1 6//1 7//1 8//1\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

#[test]
fn a_cube_from_any_file_is_the_cuboid() {
    let edges = Vec3::repeat(1.0);
    let cuboid = Cuboid::new(edges * 1e-3).unwrap();
    let facets = box_facets(edges);
    for (name, bytes) in [
        ("text.stl", text_stl(&facets)),
        ("binary.STL", binary_stl(&facets, "cube")),
        ("upper_case.stl", {
            let text = String::from_utf8(text_stl(&facets)).unwrap().to_uppercase();
            format!("\u{feff} {}", text.replace('\n', "\r\n")).into_bytes()
        }),
        ("carriage_returns.stl", {
            let text = String::from_utf8(text_stl(&facets)).unwrap();
            text.replace('\n', "\r").into_bytes()
        }),
        ("carriage_returns.obj", OBJ_CUBE.replace('\n', "\r").into_bytes()),
        ("nameless.stl", {
            let text = String::from_utf8(text_stl(&facets)).unwrap();
            text.replace(" test", "").into_bytes()
        }),
        ("two_solids.stl", {
            let two = [text_stl(&facets[..5]), text_stl(&facets[5..])];
            two.concat()
        }),
        ("misleading.stl", binary_stl(&facets, "solid cube\n")),
        ("cube.obj", OBJ_CUBE.as_bytes().to_vec()),
    ] {
        let Mesh { body, placement, notes } =
            read_bytes(name, &bytes, false).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!((body.vertices.len(), body.faces.len()), (8, 6), "{name}");
        assert!(notes.is_empty(), "{notes:?}");
        assert_eq!(placement.rotation, Quat::identity());
        assert!((body.volume() / cuboid.volume() - 1.0).abs() < 1e-12);
        assert!((body.inertia_per_mass() - cuboid.inertia_per_mass()).amax() < 1e-18);
        for n in 0..1000 {
            let x = Vec3::from_fn(|i, _| (f64::from(n) * [0.618, 0.414, 0.732][i]).fract() * 2e-3 - 1e-3);
            assert!((body.signed_distance(x) - cuboid.signed_distance(x)).abs() < 1e-12, "{name}");
        }
    }
}

#[test]
fn a_turned_box_in_single_precision_has_six_faces() {
    let turn = Quat::from_scaled_axis(Vec3::new(0.3, 0.5, -0.7));
    let shift = Vec3::new(20.0, -3.0, 5.0);
    let facets: Vec<_> =
        box_facets(Vec3::new(1.0, 2.0, 3.0)).iter().map(|f| f.map(|c| turn * c + shift)).collect();
    // Also where rounding has made the parts of a face a little hilly.
    for facets in [divided(&facets, 4), facets] {
        let Mesh { body, placement, notes } = read_bytes("box.stl", &binary_stl(&facets, ""), false).unwrap();
        assert_eq!((body.vertices.len(), body.faces.len()), (8, 6));
        assert!(notes.is_empty(), "{notes:?}");
        assert!((body.volume() / 6e-9 - 1.0).abs() < 1e-5);
        assert!((placement.centre - shift * 1e-3).norm() < 1e-8);
    }
}

/// Corners of a turned dodecahedron, written with this many digits behind the point.
fn dodecahedron(digits: usize) -> Vec<Vec3> {
    let golden = 0.5 * (1.0 + 5.0_f64.sqrt());
    let signs = [-1.0, 1.0];
    let cube = (0..8).map(|n| Vec3::from_fn(|i, _| signs[n >> i & 1]));
    let on_planes = (0..12).map(|n| {
        let mut corner = [0.0, signs[n & 1] / golden, signs[n >> 1 & 1] * golden];
        corner.rotate_right(n / 4);
        Vec3::from(corner)
    });
    let written = |x: f64| format!("{x:.digits$}").parse().unwrap();
    let turn = Quat::from_scaled_axis(Vec3::new(0.3, 0.5, -0.7));
    cube.chain(on_planes).map(|corner| (turn * corner).map(written)).collect()
}

#[test]
fn corners_with_few_digits_have_the_flat_faces_of_the_body_that_they_round() {
    let exact = Polyhedron::hull(&dodecahedron(15), 1e-9).unwrap().0;
    for (digits, precision) in [(6, 4e-6), (8, 4e-8), (3, 0.0), (15, 0.0)] {
        let points = dodecahedron(digits);
        let (low, high) = bounding_box(points.iter().copied());
        let (found, expected) = (decimal_precision(&points), precision / (high - low).max());
        assert!((found - expected).abs() <= 1e-12 * expected + 1e-14, "{digits} digits: {found}");
    }
    for digits in [6, 8] {
        let points = dodecahedron(digits);
        assert!(Polyhedron::hull(&points, 1e-9).unwrap().0.faces.len() > 12);
        let precision = decimal_precision(&points);
        let (body, placement) = Polyhedron::hull(&points, precision).unwrap();
        assert_eq!((body.faces.len(), exact.faces.len()), (12, 12));
        assert!((body.volume() / exact.volume() - 1.0).abs() < precision);
        assert!((body.inertia_per_mass() - exact.inertia_per_mass()).amax() < 3.0 * precision);
        // Convex: no corner is above a face, and none is further below than its rounding.
        for point in &points {
            let distance = body.signed_distance(placement.to_body(*point));
            assert!((-4.0 * precision..1e-12).contains(&distance), "{distance}");
        }
    }
}

#[test]
fn corners_of_simple_numbers_are_taken_as_they_are() {
    let cube: Vec<Vec3> = (0..8).map(|n| Vec3::from_fn(|i, _| f64::from(n >> i & 1) * 1.5e-3)).collect();
    assert_eq!(decimal_precision(&cube).to_bits(), 0);
    assert_eq!(decimal_precision(&[]).to_bits(), 0);
    assert_eq!(decimal_precision(&[Vec3::zeros(), Vec3::repeat(1e-300)]).to_bits(), 0);
    let turned: Vec<Vec3> = cube.iter().map(|c| Quat::from_scaled_axis(Vec3::repeat(0.3)) * c).collect();
    assert!(decimal_precision(&turned) < 1e-12);
}

#[test]
fn the_stone_of_the_cases_is_a_convex_body_of_one_millimetre() {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("cases/stone.stl");
    let bytes = std::fs::read(&path).unwrap();
    let Mesh { body: stone, notes, .. } = parse(&path, &bytes, 1e-3, false).unwrap_or_else(|e| panic!("{e}"));
    assert!(notes.is_empty(), "{notes:?}");
    assert!((stone.equivalent_diameter() / 1e-3 - 1.0).abs() < 1e-5);
    assert!((12..=60).contains(&stone.faces.len()), "{}", stone.faces.len());
    assert!(stone.thickness() > 0.5e-3 && stone.circumradius() < 1e-3);
}

#[test]
fn what_is_no_convex_body_is_refused_with_facet_and_remedy() {
    let cube = box_facets(Vec3::repeat(1.0));
    let change = |change: &dyn Fn(&mut Vec<[Vec3; 3]>)| {
        let mut facets = cube.clone();
        change(&mut facets);
        binary_stl(&facets, "")
    };
    // One corner pulled in: all other facets stay where they are.
    let corner = cube[0][0];
    let dent = |f: &mut Vec<[Vec3; 3]>| {
        for x in f.iter_mut().flatten().filter(|x| **x == corner) {
            *x *= 0.3;
        }
    };
    let flip = |f: &mut [Vec3; 3]| f.swap(1, 2);
    let cases: Vec<(&str, Vec<u8>, &str)> = vec![
        ("open.stl", change(&|f| f.truncate(11)), "open: 3 edges without a second facet, the first of facet"),
        ("inverted.stl", change(&|f| f.iter_mut().for_each(flip)), "inside out"),
        (
            "one_flipped.stl",
            change(&|f| flip(&mut f[5])),
            "3 edges through which both facets run the same way",
        ),
        ("dent.stl", change(&dent), "concave: facet"),
        ("nan.stl", change(&|f| f[7][1].y = f64::NAN), "facet 7 has a corner at (0.5, NaN, 0.5)"),
        ("infinite.stl", change(&|f| f[2][0].x = f64::INFINITY), "facet 2"),
        ("flat.stl", change(&|f| f.iter_mut().flatten().for_each(|x| x.z = 0.0)), "flat"),
        ("point.stl", change(&|f| f.iter_mut().flatten().for_each(|x| *x = Vec3::x())), "at least 4"),
        ("empty.stl", Vec::new(), "STL"),
        ("none.stl", change(&Vec::clear), "no facets"),
        ("garbage.stl", b"hello, world".to_vec(), "no STL file: it does not begin with `solid`"),
        (
            "comma.stl",
            b"solid x\nfacet\nvertex 0,5 1 2\n".to_vec(),
            "line 3: `0,5` is not a number; decimal commas",
        ),
        (
            "square.stl",
            b"solid x\nfacet\nvertex 0 0 0\nvertex 0 1 0\nvertex 1 1 0\nvertex 1 0 0\nendfacet\n".to_vec(),
            "line 7: a facet has three",
        ),
        (
            "secret.stl",
            b"solid x\nroot:x:0:0:/root:/bin/bash:and:what:else one two three\n".to_vec(),
            "line 2: `root:x:0:0:/root:/bin/ba...` is no word",
        ),
        ("text_nan.stl", b"solid x\nfacet normal 0 0 0\nouter loop\nvertex 0 nan 0\n".to_vec(), "facet 0"),
        ("wrong.ply", Vec::new(), "must be `stl` or `obj`"),
        ("bad.obj", b"v 0 0 0\nf 1 2 3\n".to_vec(), "OBJ"),
        ("none.obj", b"v 0 0 0\n".to_vec(), "no facets"),
    ];
    for (name, bytes, expected) in cases {
        let message = read_bytes(name, &bytes, false).unwrap_err();
        assert!(message.contains(expected), "{message}");
    }
    for (name, bytes) in [
        ("open.stl", change(&|f| f.truncate(11))),
        ("inverted.stl", change(&|f| f.iter_mut().for_each(flip))),
        ("dent.stl", change(&dent)),
    ] {
        let message = read_bytes(name, &bytes, false).unwrap_err();
        assert!(message.contains("`hull = true`"), "{message}");
        assert!(read_bytes(name, &bytes, true).is_ok(), "{name}");
    }
}

/// A sphere of 1 mm whose facets are this fine, with facets in one plane divided further.
fn divided(facets: &[[Vec3; 3]], times: usize) -> Vec<[Vec3; 3]> {
    let quarters = |[a, b, c]: [Vec3; 3]| {
        let [ab, bc, ca] = [(a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0];
        [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
    };
    (0..times).fold(facets.to_vec(), |facets, _| facets.into_iter().flat_map(quarters).collect())
}

#[test]
fn facets_in_one_plane_are_one_face_before_faces_are_counted() {
    let facets = divided(&box_facets(Vec3::new(1.0, 2.0, 3.0)), 5);
    assert_eq!(facets.len(), 12_288);
    for hull in [false, true] {
        let Mesh { body, .. } = read_bytes("fine.stl", &binary_stl(&facets, ""), hull).unwrap();
        assert_eq!((body.vertices.len(), body.faces.len()), (8, 6));
    }
}

/// Triangles with corners of their own on a sphere, evenly spread, or within it.
fn triangles(count: usize, radius: impl Fn(usize) -> f64) -> Vec<[Vec3; 3]> {
    let total = 3 * count;
    let point = |n: usize| {
        let z = 1.0 - (2 * n + 1) as f64 / total as f64;
        let (s, c) = libm::sincos(2.399963229728653 * n as f64);
        radius(n) * Vec3::new((1.0 - z * z).sqrt() * c, (1.0 - z * z).sqrt() * s, z)
    };
    (0..count).map(|n| [point(n), point(n + count), point(n + 2 * count)]).collect()
}

#[test]
fn a_concave_mesh_of_many_facets_has_a_hull_of_few_faces() {
    let inside = triangles(3072, |n| if n % 64 == 0 { 1.0 } else { 0.5 });
    let Mesh { body, notes, .. } = read_bytes("rough.stl", &binary_stl(&inside, ""), true).unwrap();
    assert!((50..600).contains(&body.faces.len()), "{}", body.faces.len());
    assert!(notes.last().unwrap().contains("not closed"), "{notes:?}");
}

#[test]
fn a_hull_of_more_faces_than_are_of_use_is_refused_before_its_edges_are_compared() {
    let message = read_bytes("fine.stl", &binary_stl(&triangles(2000, |_| 1.0), ""), true).unwrap_err();
    let words = ["the convex hull has 11", "at most 4096 are of use", "take a coarser mesh"];
    assert!(words.iter().all(|word| message.contains(word)), "{message}");
}

#[test]
fn a_line_of_an_obj_file_may_go_on_in_the_next() {
    let broken = OBJ_CUBE.replace("4 3 2 1", "4 3 \\\n2 1").replace("v 1 1 0", "v 1 \\ \r\n 1 0");
    let remark = format!("# C:\\meshes\\\n{broken}");
    for text in [broken, remark] {
        let Mesh { body, .. } = read_bytes("broken.obj", text.as_bytes(), false).unwrap();
        assert_eq!((body.vertices.len(), body.faces.len()), (8, 6));
    }
}

#[test]
fn separate_or_overlapping_solids_are_told_apart_from_concave_bodies() {
    let cube = box_facets(Vec3::repeat(1.0));
    for shift in [0.5, 3.0] {
        let second = cube.iter().map(|facet| facet.map(|corner| corner + Vec3::repeat(shift)));
        let both: Vec<[Vec3; 3]> = cube.iter().copied().chain(second).collect();
        let message = read_bytes("two.stl", &text_stl(&both), false).unwrap_err();
        let words = ["2 separate surfaces, the second with facet 12", "`parts = true`", "`hull = true`"];
        assert!(words.iter().all(|word| message.contains(word)), "{message}");
        let notes = read_bytes("two.stl", &text_stl(&both), true).unwrap().notes;
        assert!(notes[0].contains("2 separate surfaces"), "{notes:?}");
    }
}

#[test]
fn solids_groups_and_separate_surfaces_of_a_file_are_the_parts_of_a_body() {
    let cube = box_facets(Vec3::repeat(1.0));
    // Two that touch, which only their names tell apart.
    let beside: Vec<[Vec3; 3]> = cube.iter().map(|facet| facet.map(|corner| corner + Vec3::x())).collect();
    let solids = [text_stl(&cube), text_stl(&beside)].concat();
    let away: Vec<[Vec3; 3]> =
        cube.iter().map(|facet| facet.map(|corner| corner + Vec3::y() * 3.0)).collect();
    let surfaces = binary_stl(&[cube.clone(), away].concat(), "");
    let (head, faces) = OBJ_CUBE.split_once("vn 0 0 1").unwrap();
    let second = "g second\nf 3 10 9 2\nf 6 11 12 7\nf 2 9 11 6\nf 9 10 12 11\nf 10 3 7 12\nf 3 2 6 7\n";
    let groups =
        format!("{head}v 2 0 0\nv 2 1 0\nv 2 0 1\nv 2 1 1\nvn 0 0 1\ng first{faces}{second}").into_bytes();
    for (name, bytes, apart) in
        [("solids.stl", solids, 1.0), ("surfaces.stl", surfaces, 3.0), ("groups.obj", groups, 1.0)]
    {
        let found = parts(&PathBuf::from(name), &bytes, 1e-3, false).unwrap();
        assert_eq!(found.len(), 2);
        assert!(found.iter().all(|part| (part.body.volume() / 1e-9 - 1.0).abs() < 1e-6));
        let between = (found[1].placement.centre - found[0].placement.centre).norm();
        assert!((between / (1e-3 * apart) - 1.0).abs() < 1e-6, "{name}");
    }
    let mut open = cube.clone();
    open.truncate(11);
    let shifted = open.iter().map(|facet| facet.map(|corner| corner + Vec3::z() * 3.0));
    let both: Vec<[Vec3; 3]> = cube.iter().copied().chain(shifted).collect();
    let message = parts(&PathBuf::from("open.stl"), &text_stl(&both), 1.0, false).unwrap_err().to_string();
    assert!(
        message.contains("part 1, whose facet 0 is facet 12 of the file: the surface is open"),
        "{message}"
    );
}

#[test]
fn the_rounding_of_a_mesh_far_from_its_origin_is_told() {
    let at = |shift: f64| -> Vec<[Vec3; 3]> {
        let turn = Quat::from_scaled_axis(Vec3::new(0.3, 0.5, -0.7));
        let moved = |corner: Vec3| turn * corner + Vec3::new(shift, 0.0, 0.0);
        box_facets(Vec3::repeat(1.0)).iter().map(|facet| facet.map(moved)).collect()
    };
    // 1 m from the origin two units in the last place are 2.4e-7 m.
    let Mesh { body, notes, .. } = read_bytes("far.stl", &binary_stl(&at(1000.0), ""), false).unwrap();
    let words = ["1.001e0 m from the origin", "rounds them by 2.4e-7 m, ", "e-3 % of the extent of the mesh"];
    assert!(words.iter().all(|word| notes[0].contains(word)), "{notes:?}");
    assert!((body.volume() / 1e-9 - 1.0).abs() < 1e-3);
    assert!(read_bytes("near.stl", &binary_stl(&at(10.0), ""), false).unwrap().notes.is_empty());
    // So far away that nothing is left of it.
    let message = read_bytes("lost.stl", &binary_stl(&at(1e8), ""), false).unwrap_err();
    assert!(message.contains("from the origin, where single precision rounds them"), "{message}");
}

#[test]
fn a_file_that_claims_four_thousand_million_facets_takes_no_memory() {
    let mut bytes = binary_stl(&box_facets(Vec3::repeat(1.0)), "");
    bytes[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
    let message = read_bytes("huge.stl", &bytes, false).unwrap_err();
    assert!(message.contains("it states has 214748364834"), "{message}");
}
