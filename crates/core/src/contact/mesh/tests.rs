use super::*;
use crate::contact::overlap::{GrownShape, overlap_wall};
use crate::contact::tests::{random, random_turn};
use crate::math::Quat;
use crate::shape::{Capsule, Cuboid, Ellipsoid, Shape, Sphere};
use crate::wall::mesh::tests::{cuboid, placed, plate, tube};
use crate::wall::{FreeSide, Surface};
use rand::Rng;
use std::sync::Arc;

fn grown(shape: impl Shape + 'static) -> GrownShape {
    GrownShape::new(Arc::new(shape), 0.0)
}

fn at(wall: &PlacedMesh, grown: &GrownShape, orientation: Quat, centre: Vec3) -> Vec<MeshContact> {
    let mut found = Vec::new();
    let near = wall.mesh.facets_near(&wall.to_own(&centre), grown.reach());
    contacts(Geometry::Exact, &Body { grown, orientation }, (wall, centre), &near, &mut found);
    found
}

fn of_sphere(wall: &PlacedMesh, radius: f64, centre: Vec3) -> Vec<MeshContact> {
    at(wall, &grown(Sphere { radius }), Quat::identity(), centre)
}

fn differ(a: &Overlap, b: &Overlap) -> f64 {
    let lengths = [(a.point - b.point).norm(), (a.normal - b.normal).norm(), (a.moment - b.moment).norm()];
    let numbers = [a.volume - b.volume, a.depth - b.depth, a.area - b.area];
    lengths.into_iter().chain(numbers.map(f64::abs)).fold(0.0, f64::max)
}

#[test]
fn every_shape_has_at_a_plate_of_many_facets_the_contact_with_a_plane() {
    let mut random = random(5);
    let shapes: [GrownShape; 5] = [
        grown(Sphere { radius: 0.5 }),
        grown(Cuboid::new(Vec3::new(0.8, 0.6, 0.7)).unwrap()),
        GrownShape::new(Arc::new(Cuboid::new(Vec3::repeat(0.7)).unwrap()), 0.02),
        grown(Ellipsoid::new(Vec3::new(0.5, 0.4, 0.3)).unwrap()),
        grown(Capsule::new(0.3, 0.5).unwrap()),
    ];
    let mut wall = placed(plate([10.0, 10.0], [23, 29]), None);
    wall.orientation = random_turn(&mut random);
    wall.position = Vec3::new(0.3, 0.2, -0.7);
    let mut touching = 0;
    for n in 0..600 {
        let shape = &shapes[n % 5];
        let (orientation, side) = (random_turn(&mut random), if n % 2 == 0 { 1.0 } else { -1.0 });
        let body = Body { grown: shape, orientation };
        let mut own = Vec3::from_fn(|_, _| random.random_range(2.0..8.0));
        own.z = side * random.random_range(0.2..0.6);
        if n % 7 == 0 {
            // Above a vertex.
            (own.x, own.y) = (10.0 * 5.0 / 23.0, 10.0 * 9.0 / 29.0);
        }
        let centre = wall.to_world(&own);
        let normal = wall.orientation * Vec3::z() * side;
        let plane = Surface::Plane { point: wall.position, normal }.seen_from(centre);
        let exact = overlap_wall(Geometry::Exact, &body, &plane);
        let found = at(&wall, shape, orientation, centre);
        assert_eq!(found.len(), usize::from(exact.is_some()), "{n} {own} {found:?}");
        if let Some(exact) = exact {
            // Samples lie otherwise.
            let limit = if n % 5 < 3 { 1e-12 } else { 5e-3 };
            assert!(differ(&found[0].overlap, &exact) < limit, "{n}: {:?} {exact:?}", found[0].overlap);
            touching += 1;
        }
    }
    assert!(touching > 200, "{touching}");
}

#[test]
fn a_sphere_in_a_concave_corner_has_the_contacts_with_its_three_planes() {
    let wall = placed(cuboid(Vec3::repeat(4.0)), Some(FreeSide::Inside));
    let (radius, centre) = (0.5, Vec3::new(0.49, 0.48, 0.47));
    let found = of_sphere(&wall, radius, centre);
    assert_eq!(found.len(), 3);
    for (axis, depth) in [0.01, 0.02, 0.03].into_iter().enumerate() {
        let exact =
            sphere_plane::overlap(radius, &Plane { normal: Vec3::ith(axis, 1.0), offset: -centre[axis] });
        let of = found.iter().find(|contact| contact.overlap.normal[axis] < -0.9).unwrap();
        assert!(differ(&of.overlap, &exact.unwrap()) < 1e-14 && (of.overlap.depth - depth).abs() < 1e-14);
    }
}

#[test]
fn a_cube_in_a_concave_corner_has_three_contacts_whose_volumes_are_what_lies_outside() {
    let wall = placed(cuboid(Vec3::repeat(4.0)), Some(FreeSide::Inside));
    let cube = grown(Cuboid::new(Vec3::repeat(1.0)).unwrap());
    let found = at(&wall, &cube, Quat::identity(), Vec3::new(0.49, 0.48, 0.47));
    assert_eq!(found.len(), 3);
    let volume: f64 = found.iter().map(|contact| contact.overlap.volume).sum();
    assert!((volume - (1.0 - 0.99 * 0.98 * 0.97)).abs() < 1e-14, "{volume}");
}

#[test]
fn on_a_convex_edge_and_corner_the_normal_is_the_way_from_the_nearest_point() {
    let wall = placed(cuboid(Vec3::repeat(4.0)), None);
    for away in [Vec3::new(0.6, 0.8, 0.0), Vec3::new(1.0, 2.0, 3.0).normalize(), Vec3::new(0.01, 1.0, 0.0)] {
        let away = away.normalize();
        let edge = Vec3::new(4.0, 4.0, if away.z > 0.0 { 4.0 } else { 1.7 });
        let found = of_sphere(&wall, 0.5, edge + away * 0.45);
        assert_eq!(found.len(), 1, "{away}");
        let Overlap { depth, normal, .. } = found[0].overlap;
        assert!((depth - 0.05).abs() < 1e-14 && (normal + away).norm() < 1e-13);
    }
}

#[test]
fn smooth_bodies_touch_a_convex_edge_where_their_distance_is_least() {
    let wall = placed(cuboid(Vec3::repeat(4.0)), None);
    let away = Vec3::new(0.6, 0.8, 0.0);
    // A capsule along the edge, and an ellipsoid that is a sphere.
    for shape in [grown(Capsule::new(0.5, 1.0).unwrap()), grown(Ellipsoid::new(Vec3::repeat(0.5)).unwrap())] {
        let found = at(&wall, &shape, Quat::identity(), Vec3::new(4.0, 4.0, 1.7) + away * 0.45);
        assert_eq!(found.len(), 1);
        let Overlap { depth, normal, .. } = found[0].overlap;
        assert!((depth - 0.05).abs() < 1e-4 && (normal + away).norm() < 1e-6, "{depth} {normal}");
    }
}

#[test]
fn a_cube_on_a_pedestal_that_is_smaller_overlaps_it_over_its_face() {
    let wall = placed(cuboid(Vec3::new(0.4, 0.5, 3.0)), None);
    let cube = grown(Cuboid::new(Vec3::repeat(1.0)).unwrap());
    let found = at(&wall, &cube, Quat::identity(), Vec3::new(0.25, 0.2, 3.49));
    assert_eq!(found.len(), 1);
    let Overlap { volume, depth, point, normal, area, .. } = found[0].overlap;
    // The wedge behind the face narrows by the depth on all sides; at its corners wedges do not fit exactly.
    let cut = |h: f64| 0.2 * h - 0.9 * h * h + 4.0 / 3.0 * h * h * h;
    assert!((volume / cut(0.01) - 1.0).abs() < 1e-4, "{volume} {}", cut(0.01));
    assert!((depth - 0.01).abs() < 1e-14 && (normal + Vec3::z()).norm() < 1e-12 && area > 0.18, "{area}");
    assert!((point - Vec3::new(-0.05, 0.05, -0.495)).norm() < 1e-3, "{point}");
}

#[test]
fn in_a_drum_of_flat_strips_a_sphere_has_one_contact_anywhere_and_in_a_narrow_one_several() {
    let wall = placed(tube(10.0, 8.0, 96), None);
    for n in 0..200 {
        let angle = 0.0123 * f64::from(n);
        let out = Vec3::new(angle.cos(), angle.sin(), 0.0);
        let found = of_sphere(&wall, 1.0, out * 9.02 + Vec3::z() * 4.0);
        assert_eq!(found.len(), 1, "{n}");
        assert!((found[0].overlap.normal - out).norm() < 0.04);
    }
    let narrow = placed(tube(1.0, 8.0, 8), None);
    assert_eq!(of_sphere(&narrow, 0.95, Vec3::z() * 4.0).len(), 8);
}

#[test]
fn a_sphere_over_the_far_side_of_a_thin_plate_touches_the_near_side_only() {
    let wall = placed(cuboid(Vec3::new(4.0, 4.0, 0.01)), None);
    let found = of_sphere(&wall, 0.5, Vec3::new(2.0, 2.0, 0.48));
    assert_eq!(found.len(), 1);
    assert!((found[0].overlap.depth - 0.03).abs() < 1e-14 && found[0].overlap.normal.z < -0.9);
    let mut none = Vec::new();
    let sphere = grown(Sphere { radius: 0.5 });
    let body = Body { grown: &sphere, orientation: Quat::identity() };
    let block = placed(cuboid(Vec3::repeat(4.0)), None);
    let centre = Vec3::new(2.0, 2.0, 3.9);
    let all: Vec<u32> = (0..block.mesh.facets().len() as u32).collect();
    assert!(contacts(Geometry::Exact, &body, (&block, centre), &all, &mut none), "in the wall");
    assert!(none.is_empty());
}

#[test]
fn bodies_that_lean_over_the_ridge_of_a_sheet_touch_it_at_the_ridge_whichever_slope_they_are_above() {
    // A gentle slope and a steep one, whose plane has the middle of the bodies behind it.
    let v = |x: f64, y: f64, z: f64| Vec3::new(x, y, z);
    let vertices =
        [v(-6.0, -4.0, -1.0), v(0.0, -4.0, 0.0), v(1.0, -4.0, -6.0)].map(|low| [low, low + Vec3::y() * 8.0]);
    let facets = vec![[0, 2, 1], [1, 2, 3], [2, 4, 3], [3, 4, 5]];
    let wall = placed((vertices.concat(), facets), None);
    let shapes = [
        (grown(Cuboid::new(Vec3::repeat(1.0)).unwrap()), 0.5),
        (grown(Ellipsoid::new(Vec3::repeat(0.5)).unwrap()), 0.5),
        (grown(Sphere { radius: 0.5 }), 0.5),
    ];
    for (n, (shape, half)) in shapes.iter().enumerate() {
        for x in [-0.1, -0.12] {
            let found = at(&wall, shape, Quat::identity(), Vec3::new(x, 0.1, half - 0.02));
            assert_eq!(found.len(), 1, "{n}");
            let Overlap { depth, normal, volume, .. } = found[0].overlap;
            assert!(normal.z < -0.9 && depth < 0.03 && volume < 0.02, "{n} {x}: {depth} {normal} {volume}");
        }
    }
}

#[test]
fn surfaces_that_overlap_act_as_the_surface_of_both_together() {
    // A plate with a post that reaches into it, and the same as one surface.
    let shifted = |(vertices, facets): (Vec<Vec3>, Vec<[u32; 3]>), by: Vec3, first: u32| {
        let vertices: Vec<Vec3> = vertices.into_iter().map(|vertex| vertex + by).collect();
        (vertices, facets.into_iter().map(|facet| facet.map(|k| k + first)).collect::<Vec<_>>())
    };
    let (mut vertices, mut facets) = cuboid(Vec3::new(4.0, 4.0, 1.0));
    let post = shifted(cuboid(Vec3::new(2.0, 2.0, 2.5)), Vec3::new(1.0, 1.0, 0.5), vertices.len() as u32);
    vertices.extend(post.0);
    facets.extend(post.1);
    let crossing = placed((vertices, facets), None);
    let square = |low: f64, high: f64, z: f64| {
        [(low, low), (high, low), (high, high), (low, high)].map(|(x, y)| Vec3::new(x, y, z))
    };
    // From below: the floor, the edge of the plate, the foot of the post and its top.
    let rings = [square(0.0, 4.0, 0.0), square(0.0, 4.0, 1.0), square(1.0, 3.0, 1.0), square(1.0, 3.0, 3.0)];
    let mut facets = vec![[0, 2, 1], [0, 3, 2], [12, 13, 14], [12, 14, 15]];
    for (ring, n) in (0..3).flat_map(|ring| (0..4).map(move |n| (4 * ring, n))) {
        let [a, b] = [ring + n, ring + (n + 1) % 4];
        facets.extend([[a, b, b + 4], [a, b + 4, a + 4]]);
    }
    let one = placed((rings.concat(), facets), None);
    let (mut random, mut touching) = (random(9), 0);
    for _ in 0..4000 {
        let centre = Vec3::new(
            random.random_range(-0.5..4.5),
            random.random_range(-0.5..4.5),
            random.random_range(0.3..3.5),
        );
        let distance = one.mesh.distance(&centre);
        if distance < 0.1 {
            continue;
        }
        // Up to 2 % of the radius deep.
        let radius = distance * 1.02;
        let [mut found, mut expected] = [&crossing, &one].map(|wall| of_sphere(wall, radius, centre));
        for contacts in [&mut found, &mut expected] {
            contacts.sort_by(|a, b| {
                let key = |contact: &MeshContact| contact.overlap.normal;
                (key(a).x, key(a).y, key(a).z).partial_cmp(&(key(b).x, key(b).y, key(b).z)).unwrap()
            });
        }
        assert_eq!(found.len(), expected.len(), "{centre} {radius}");
        let largest = found.iter().zip(&expected).map(|(a, b)| differ(&a.overlap, &b.overlap));
        assert!(largest.fold(0.0, f64::max) < 1e-12, "{centre}");
        touching += usize::from(found.len() > 1);
    }
    assert!(touching > 10, "{touching}");
}
