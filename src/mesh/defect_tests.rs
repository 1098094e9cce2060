//! Meshes with the defects of those of other programs: facets that are there twice, folded, flat, turned or torn off by rounding.

use super::tests::{binary_stl, box_facets, read_bytes, text_stl};
use super::*;
use crate::math::Quat;
use crate::shape::Cuboid;

type Facets = Vec<[Vec3; 3]>;

/// A cube with an edge of 1, after a change of its facets.
fn cube(change: impl FnOnce(&mut Facets)) -> Facets {
    let mut facets = box_facets(Vec3::repeat(1.0));
    change(&mut facets);
    facets
}

fn flipped([a, b, c]: [Vec3; 3]) -> [Vec3; 3] {
    [a, c, b]
}

/// The mesh of facets in mm, as text and in binary.
fn both(facets: &[[Vec3; 3]], hull: bool) -> [Result<Mesh, String>; 2] {
    [("text.stl", text_stl(facets)), ("binary.stl", binary_stl(facets, ""))]
        .map(|(name, bytes)| read_bytes(name, &bytes, hull))
}

/// Asserts that facets are the surface of the cube of 1 mm, and that one note has all these words.
fn is_the_cube_with_a_note(facets: &[[Vec3; 3]], words: &[&str]) {
    for hull in [false, true] {
        for mesh in both(facets, hull) {
            let Mesh { body, notes, .. } = mesh.unwrap_or_else(|e| panic!("{e}"));
            assert_eq!((body.vertices.len(), body.faces.len()), (8, 6));
            assert!((body.volume() / 1e-9 - 1.0).abs() < 1e-12, "{}", body.volume());
            assert!(words.iter().all(|word| notes[0].contains(word)), "{words:?} in {notes:?}");
            assert_eq!(notes.len(), 1 + usize::from(hull));
            assert!(!hull || notes[1].contains("adds 0.000 % to the volume"), "{notes:?}");
        }
    }
}

#[test]
fn facets_that_are_there_twice_count_once() {
    let twice = cube(|f| {
        let [a, b, c] = f[7];
        f.extend([f[2], [b, c, a], [c, a, b]]);
    });
    is_the_cube_with_a_note(&twice, &["dropped 3 duplicated facets", "the first is facet 12"]);
    let all = cube(|f| f.extend(f.clone()));
    is_the_cube_with_a_note(&all, &["12 duplicated facets"]);
}

#[test]
fn a_fold_is_dropped_and_its_tip_is_no_corner() {
    let fold = cube(|f| {
        let [a, b, _] = f[4];
        let leaf = [a, b, Vec3::new(3.0, 2.0, 1.0)];
        f.insert(3, leaf);
        f.push(flipped(leaf));
    });
    is_the_cube_with_a_note(&fold, &["dropped 2 duplicated facets", "facet 3"]);
}

#[test]
fn of_a_facet_and_its_copy_that_is_inside_out_the_one_remains_that_closes_the_surface() {
    for region in [1..2, 0..4, 3..12] {
        let turned = cube(|f| {
            for n in region.clone() {
                // The wrong one first.
                f.push(f[n]);
                f[n] = flipped(f[n]);
            }
        });
        let count = region.len().to_string();
        is_the_cube_with_a_note(&turned, &[&format!("dropped {count} duplicated facet")]);
    }
    let both_sides_of_all = cube(|f| f.extend(f.clone().into_iter().map(flipped)));
    is_the_cube_with_a_note(&both_sides_of_all, &["dropped 12 duplicated facets (the first is facet 12)"]);
}

#[test]
fn facets_without_area_are_dropped() {
    let flat = cube(|f| {
        let [a, b, c] = f[4];
        f.extend([[a, b, b], [c, c, c]]);
        // A stray line on a face.
        f.push([a, b, (a + b) / 2.0]);
        // A thread that leaves the body.
        f.push([a, Vec3::repeat(9.0), a]);
    });
    is_the_cube_with_a_note(&flat, &["dropped 4 degenerate facets", "facet 12"]);
}

#[test]
fn a_sliver_that_closes_a_divided_edge_is_kept() {
    // The edge from a to b has its middle m in one facet and not in the other; a sliver fills the gap.
    let divided = cube(|f| {
        let [a, b, c] = f[0];
        let m = (a + b) / 2.0;
        f[0] = [a, m, c];
        f.extend([[m, b, c], [a, b, m]]);
    });
    for mesh in both(&divided, false) {
        let Mesh { body, notes, .. } = mesh.unwrap_or_else(|e| panic!("{e}"));
        assert_eq!((body.vertices.len(), body.faces.len(), notes.len()), (8, 6, 0), "{notes:?}");
    }
    // Without the sliver.
    let error = both(&divided[..13], false)[0].clone().unwrap_err();
    assert!(error.contains("open: 3 edges"), "{error}");
}

#[test]
fn a_surface_with_an_inner_facet_is_not_manifold() {
    let inner = cube(|f| {
        let [a, b, _] = f[0];
        f.push([a, b, -a]);
    });
    for mesh in both(&inner, false) {
        let error = mesh.unwrap_err();
        let words = ["open: ", "facet 12", "hull = true"];
        assert!(words.iter().all(|word| error.contains(word)), "{error}");
    }
    // A second cube that shares an edge with the first.
    let siamese = cube(|f| {
        let second: Facets = f.iter().map(|facet| facet.map(|c| c + Vec3::new(1.0, 1.0, 0.0))).collect();
        f.extend(second);
    });
    let error = both(&siamese, false)[0].clone().unwrap_err();
    let words = ["not manifold: 1 edge of more than two facets", "(0.0005, 0.0005, ", "of facets "];
    assert!(words.iter().all(|word| error.contains(word)), "{error}");
    let mesh = both(&siamese, true)[1].clone().unwrap();
    // Two prisms with triangles of half a square as their base are added to two cubes.
    assert!(mesh.notes[0].contains("adds 50.000 %"), "{:?}", mesh.notes);
}

/// An octahedron with corners at a distance of 1 mm, but the upper one at this height (mm).
fn octahedron(top: f64) -> Facets {
    let ring = [Vec3::x(), Vec3::y(), -Vec3::x(), -Vec3::y()];
    let sides = (0..4).map(|n| [ring[n], ring[(n + 1) % 4]]);
    sides.flat_map(|[a, b]| [[a, b, Vec3::z() * top], [b, a, -Vec3::z()]]).collect()
}

#[test]
fn the_volume_that_a_hull_adds_is_that_of_the_dent() {
    // Below the ring lie 2/3 mm^3, of which the dent takes 1/3.
    for (facets, added) in [(octahedron(-0.5), "100.000 %"), (octahedron(-0.1), "11.111 %")] {
        for mesh in both(&facets, true) {
            let Mesh { body, notes, .. } = mesh.unwrap();
            assert!((body.volume() / (2e-9 / 3.0) - 1.0).abs() < 1e-12);
            assert_eq!(notes, [format!("the convex hull adds {added} to the volume of the mesh")]);
        }
        let inverted: Facets = facets.iter().copied().map(flipped).collect();
        assert!(both(&inverted, true)[0].clone().unwrap().notes[0].contains(added));
        let open = both(&facets[1..], true)[0].clone().unwrap().notes;
        assert!(open[0].contains("not closed"), "{open:?}");
        let error = both(&facets, false)[0].clone().unwrap_err();
        assert!(error.contains("concave") && error.contains(added), "{error}");
    }
}

#[test]
fn how_far_a_body_is_concave_is_said_in_metres_and_in_diameters() {
    // The hull is a pyramid below the ring, with its centre of mass at a quarter of its height of 1 mm: the furthest corners are
    // sqrt(1 + 1/16) mm from there.
    let error = both(&octahedron(-0.125), false)[0].clone().unwrap_err();
    let part = 100.0 * 0.125 / (2.0 * 1.0625_f64.sqrt());
    let words =
        format!("lies up to 1.2500e-4 m, {part:.3} % of the diameter of the body, below the convex hull");
    assert!(error.contains(&words), "{error}");
}

#[test]
fn a_dent_of_few_digits_counts_as_convex_with_a_note_and_a_deeper_one_does_not() {
    // The middle of a face of the cube lies below it. The diameter of the cube is sqrt(3).
    let dented = |depth: f64| {
        cube(|f| {
            let top = |facet: &[Vec3; 3]| facet.iter().all(|c| c.z > 0.49);
            let rim: Facets = f.iter().copied().filter(top).collect();
            f.retain(|facet| !top(facet));
            let middle = Vec3::new(0.1, 0.05, 0.5 - depth);
            for [a, b, c] in rim {
                let is_edge = |a: Vec3, b: Vec3| (a.x - b.x).abs().min((a.y - b.y).abs()) < 0.1;
                for (a, b) in [(a, b), (b, c), (c, a)].into_iter().filter(|&(a, b)| is_edge(a, b)) {
                    f.push([a, b, middle]);
                }
            }
        })
    };
    let rounding = both(&dented(1e-6), false)[0].clone().unwrap();
    assert!(rounding.notes.is_empty(), "{:?}", rounding.notes);
    let Mesh { body, notes, .. } = both(&dented(1.5e-4), false)[0].clone().unwrap();
    assert!((body.volume() / 1e-9 - 1.0).abs() < 1e-6);
    // A third of the depth is missing of the volume, 5e-3 %.
    let words = ["taken as convex", "lies up to 8.7e-3 %", "adds 5.0e-3 %"];
    assert!(words.iter().all(|word| notes[0].contains(word)), "{notes:?}");
    let error = both(&dented(2e-4), false)[0].clone().unwrap_err();
    assert!(error.contains("concave: facet") && error.contains("2.0000e-7 m"), "{error}");
}

#[test]
fn vertices_that_single_precision_has_torn_apart_far_from_the_origin_are_one() {
    let turn = Quat::from_scaled_axis(Vec3::new(0.3, 0.5, -0.7));
    let edges = Vec3::new(1.0, 2.0, 3.0);
    for far in [20.0, 400.0] {
        let shift = Vec3::new(far, -0.7 * far, 0.3 * far);
        // Each facet rounds its corners up or down on its own.
        let facets: Facets = box_facets(edges)
            .iter()
            .enumerate()
            .map(|(n, f)| {
                let ulp = if n % 2 == 0 { 1.0 } else { 1.0 + f64::from(f32::EPSILON) };
                f.map(|c| (turn * c + shift) * ulp)
            })
            .collect();
        let Mesh { body, .. } = both(&facets, false)[1].clone().unwrap_or_else(|e| panic!("{e}"));
        let cuboid = Cuboid::new(edges * 1e-3).unwrap();
        let error = (body.volume() / cuboid.volume() - 1.0).abs();
        assert!(error < 1e-6 * far, "{error}");
    }
}
