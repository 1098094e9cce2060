use super::*;
use crate::math::{Quat, TimeFunction};
use crate::shape::{Cuboid, Shape};
use crate::wall::{Motion, PlacedMesh, Surface};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::sync::Arc;

/// Vertices and facets.
pub(crate) type Parts = (Vec<Vec3>, Vec<[u32; 3]>);

/// A rectangle across z at the origin, of `n` times `m` squares of two facets each.
pub(crate) fn plate(edges: [f64; 2], [n, m]: [u32; 2]) -> Parts {
    let at = |i: u32, j: u32| {
        Vec3::new(edges[0] * f64::from(i) / f64::from(n), edges[1] * f64::from(j) / f64::from(m), 0.0)
    };
    let vertices = (0..=m).flat_map(|j| (0..=n).map(move |i| at(i, j))).collect();
    let number = |i: u32, j: u32| i + j * (n + 1);
    let square = |i: u32, j: u32| {
        let [a, b, c, d] = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(x, y)| number(i + x, j + y));
        // Diagonals either way.
        if (i + j).is_multiple_of(2) { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] }
    };
    (vertices, (0..m).flat_map(|j| (0..n).flat_map(move |i| square(i, j))).collect())
}

/// A box from the origin on.
pub(crate) fn cuboid(edges: Vec3) -> Parts {
    let mesh = Cuboid::new(edges).unwrap().surface_mesh(0);
    let mut vertices: Vec<Vec3> = Vec::new();
    let mut number = |at: Vec3| {
        vertices.iter().position(|known| (known - at).norm() < 1e-9 * edges.norm()).unwrap_or_else(|| {
            vertices.push(at);
            vertices.len() - 1
        }) as u32
    };
    let facets =
        mesh.triangles.iter().map(|t| t.map(|i| number(mesh.points[i as usize] + edges * 0.5))).collect();
    (vertices, facets)
}

/// An open tube along z of `n` strips of two facets.
pub(crate) fn tube(radius: f64, length: f64, n: u32) -> Parts {
    let at = |k: u32| {
        let angle = std::f64::consts::TAU * f64::from(k % n) / f64::from(n);
        Vec3::new(radius * angle.cos(), radius * angle.sin(), if k < n { 0.0 } else { length })
    };
    let strip = |k: u32| {
        let next = (k + 1) % n;
        [[k, next, next + n], [k, next + n, k + n]]
    };
    ((0..2 * n).map(at).collect(), (0..n).flat_map(strip).collect())
}

/// A mesh in the frame of the world.
pub(crate) fn placed((vertices, facets): Parts, free: Option<FreeSide>) -> PlacedMesh {
    let mesh = Arc::new(WallMesh::new(vertices, facets, free).unwrap());
    PlacedMesh { mesh, position: Vec3::zeros(), orientation: Quat::identity() }
}

fn joined(meshes: impl IntoIterator<Item = Parts>) -> Parts {
    meshes.into_iter().fold((Vec::new(), Vec::new()), |(mut vertices, mut facets), (own, other)| {
        let first = vertices.len() as u32;
        vertices.extend(own);
        facets.extend(other.iter().map(|facet| facet.map(|vertex| first + vertex)));
        (vertices, facets)
    })
}

fn random() -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(11)
}

const EDGES: Vec3 = Vec3::new(1.0, 2.0, 0.5);

#[test]
fn surfaces_that_overlap_are_as_wide_as_what_they_cover_together() {
    let (mut vertices, mut facets) = cuboid(Vec3::repeat(1.0));
    let (others, count) = (vertices.clone(), vertices.len() as u32);
    vertices.extend(others.iter().map(|at| at + Vec3::new(0.9, 0.05, 0.05)));
    facets.extend(facets.clone().iter().map(|facet| facet.map(|k| k + count)));
    let mesh = WallMesh::new(vertices, facets, Some(FreeSide::Outside)).unwrap();
    let thinnest = mesh.thinnest().unwrap();
    assert!((thinnest - 1.0).abs() < 1e-12, "{thinnest}");
}

#[test]
fn a_box_of_facets_turned_at_random_has_the_distances_of_a_cuboid_from_outside_and_inside() {
    let mut random = random();
    let exact = Cuboid::new(EDGES).unwrap();
    for free in [FreeSide::Outside, FreeSide::Inside] {
        let (vertices, mut facets) = cuboid(EDGES);
        for facet in &mut facets {
            if random.random_bool(0.5) {
                facet.swap(0, 1);
            }
        }
        let mesh = WallMesh::new(vertices, facets, Some(free)).unwrap();
        assert!((mesh.volume().unwrap() - 1.0).abs() < 1e-15 && (mesh.area() - 7.0).abs() < 1e-15);
        assert!((mesh.thinnest().unwrap() - 0.5).abs() < 1e-15);
        let sign = if free == FreeSide::Inside { -1.0 } else { 1.0 };
        for _ in 0..2000 {
            let at = Vec3::from_fn(|i, _| random.random_range(-0.5..1.5) * EDGES[i]);
            let (distance, own) = (mesh.distance(&at), sign * exact.signed_distance(at - EDGES * 0.5));
            assert!((distance - own).abs() < 1e-14, "{at} {distance} {own}");
            let there = mesh.distance(&(at + mesh.normal(&at) * 1e-6));
            assert!((there - distance - 1e-6).abs() < 1e-12, "{at}");
        }
    }
}

#[test]
fn a_box_within_a_box_is_a_cavity_and_one_across_another_adds_to_it() {
    let moved = |(mut vertices, facets): Parts, by: f64| {
        for vertex in &mut vertices {
            *vertex += Vec3::repeat(by);
        }
        (vertices, facets)
    };
    let cube = |edge: f64| cuboid(Vec3::repeat(edge));
    for flip in [false, true] {
        let (vertices, mut facets) = joined([cube(3.0), moved(cube(1.0), 1.0), moved(cube(1.0), 5.0)]);
        if flip {
            facets[12..].iter_mut().for_each(|facet| facet.swap(1, 2));
        }
        let mesh = WallMesh::new(vertices, facets, None).unwrap();
        assert!((mesh.volume().unwrap() - 27.0).abs() < 1e-12, "{:?}", mesh.volume());
        let walls = [0.5, 1.5, 2.5, 3.5, 5.5].map(|x| mesh.is_wall(&Vec3::repeat(x)));
        assert_eq!(walls, [true, false, true, false, true]);
    }
    let (vertices, facets) = joined([cube(2.0), moved(cube(2.0), 1.0)]);
    let mesh = WallMesh::new(vertices, facets, None).unwrap();
    let walls = [0.5, 1.5, 2.5, 3.5].map(|x| mesh.is_wall(&Vec3::repeat(x)));
    assert_eq!(walls, [true, true, true, false]);
}

#[test]
fn rays_through_edges_and_corners_count_once() {
    // All points of a grid that holds the corners of the box and the diagonals of its faces.
    let (vertices, facets) = cuboid(Vec3::repeat(4.0));
    let mesh = WallMesh::new(vertices, facets, None).unwrap();
    for n in 0..729 {
        let cell = Vec3::new(f64::from(n % 9), f64::from(n / 9 % 9), f64::from(n / 81));
        let at = cell.map(|x| x - 2.0);
        let inside = at.iter().all(|x| *x > 0.0 && *x < 4.0);
        let outside = at.iter().any(|x| *x < 0.0 || *x > 4.0);
        assert!(inside == outside || mesh.encloses(&at) == inside, "{at}");
    }
}

#[test]
fn no_segment_from_one_side_of_a_plate_to_the_other_passes_an_edge_or_a_corner_unseen() {
    let mesh = placed(plate([4.0, 4.0], [4, 4]), None).mesh;
    for n in 0..1089 {
        // Corners, middles of edges and diagonals, straight and askew.
        let at = Vec3::new(f64::from(n % 33), f64::from(n / 33), 0.0) / 8.0;
        for way in [Vec3::z(), Vec3::new(0.1, 0.3, 1.0), Vec3::new(-0.7, 0.0, 1.0), -Vec3::z()] {
            let crossing = mesh.crossing(&(at - way * 0.25), &(at + way * 0.75));
            let part = crossing.map_or(f64::NAN, |crossing| crossing.part);
            assert!(
                (part - 0.25).abs() < 1e-15 || n % 33 == 0 || n % 33 == 32 || !(33..=1055).contains(&n),
                "{at}"
            );
            assert!(way.xy() != Vec3::zeros().xy() || (part - 0.25).abs() < 1e-15, "rims count");
        }
        assert_eq!(mesh.crossing(&(at + Vec3::z()), &(at + Vec3::z() * 0.5)), None);
    }
}

#[test]
fn the_nearest_point_is_that_of_a_search_through_all_facets() {
    let mut random = random();
    let (mut vertices, facets) = plate([10.0, 10.0], [20, 20]);
    for vertex in &mut vertices {
        vertex.z = random.random_range(0.0..1.0);
    }
    let mesh = WallMesh::new(vertices, facets, None).unwrap();
    let mut found = Vec::new();
    for _ in 0..500 {
        let at = Vec3::from_fn(|_, _| random.random_range(-5.0..15.0));
        let all = (0..mesh.facets().len() as u32).map(|facet| mesh.nearest_on(facet, &at));
        let first = all.min_by(|a, b| a.square.total_cmp(&b.square)).unwrap();
        assert_eq!(mesh.nearest(&at), first);
        found.clear();
        mesh.facets_in(&[at.add_scalar(-2.0), at.add_scalar(2.0)], &mut found);
        let near = (0..mesh.facets().len() as u32).filter(|facet| mesh.nearest_on(*facet, &at).square < 4.0);
        assert!(found.is_sorted() && near.into_iter().all(|facet| found.contains(&facet)));
    }
}

#[test]
fn an_open_mesh_is_a_sheet_and_no_container() {
    let sheet = placed(plate([2.0, 1.0], [2, 1]), None);
    assert!(!sheet.mesh.is_closed() && sheet.mesh.volume().is_none());
    for z in [0.5, -0.5] {
        let surface = Surface::Mesh(sheet.clone());
        let at = Vec3::new(0.3, 0.4, z);
        assert_eq!((surface.distance(at), surface.normal(at)), (0.5, Vec3::z() * z.signum()));
        assert!(!surface.is_wall(at));
    }
    let (vertices, facets) = plate([2.0, 1.0], [2, 1]);
    let flaw = WallMesh::new(vertices, facets, Some(FreeSide::Inside)).unwrap_err();
    assert_eq!(flaw.count, 6);
    assert!(flaw.to_string().contains("open: 6 edges"), "{flaw}");
    let (vertices, mut facets) = cuboid(EDGES);
    let [a, b, _] = facets[0];
    facets.push([a, b, (0..8).rev().find(|other| !facets[0].contains(other)).unwrap()]);
    let flaw = WallMesh::new(vertices, facets, Some(FreeSide::Outside)).unwrap_err();
    assert!(flaw.to_string().contains("edge"), "{flaw}");
}

#[test]
fn a_mesh_moves_as_a_plane_in_its_facet_does() {
    let motion = Motion {
        velocity: Vec3::new(0.3, -0.2, 0.1).into(),
        angular_velocity: TimeFunction::from(Vec3::new(0.5, 2.0, -1.0)),
        pivot: Vec3::new(1.0, 0.5, -0.5),
    };
    let sheet = Surface::Mesh(placed(plate([40.0, 40.0], [3, 3]), None));
    let plane = Surface::Plane { point: Vec3::zeros(), normal: Vec3::z() };
    for time in [0.0, 0.4, 3.0] {
        let [sheet, plane] =
            [&sheet, &plane].map(|surface| surface.moved(&motion, time).seen_from(Vec3::x()));
        // Above the middle of the sheet.
        let at = sheet.mesh().unwrap().to_world(&Vec3::new(20.0, 20.0, 1.5));
        assert!((sheet.distance(at) - 1.5).abs() < 1e-13 && (plane.distance(at) - 1.5).abs() < 1e-13);
        assert!((sheet.normal(at) - plane.normal(at)).norm() < 1e-14);
    }
}
