//! Properties that every shape must have, each checked for all of them, at random poses and points.

use super::*;
use crate::math::Mat3;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::PI;
use std::fmt::Write as _;

/// All kinds, in millimetres, also at the rims of what is allowed.
fn shapes() -> Vec<(String, Box<dyn Shape>)> {
    let mm = 1e-3;
    let vec = |x: f64, y: f64, z: f64| Vec3::new(x, y, z) * mm;
    let mut shapes: Vec<(String, Box<dyn Shape>)> = Vec::new();
    let mut add = |name: &str, shape: Box<dyn Shape>| shapes.push((name.to_owned(), shape));
    add("sphere", Box::new(Sphere { radius: 0.6 * mm }));
    add("cube", Box::new(Cuboid::new(vec(1.0, 1.0, 1.0)).unwrap()));
    add("brick", Box::new(Cuboid::new(vec(1.0, 0.4, 2.0)).unwrap()));
    for (name, x, y, z) in [
        ("ellipsoid", 1.0, 0.7, 0.5),
        ("prolate spheroid", 0.5, 0.5, 1.0),
        ("oblate spheroid", 0.4, 1.0, 1.0),
        ("needle", 0.05, 1.0, 0.05),
        ("leaf", 1.0, 0.05, 0.6),
        ("ellipsoid that is a sphere", 0.5, 0.5, 0.5),
    ] {
        add(name, Box::new(Ellipsoid::new(vec(x, y, z)).unwrap()));
    }
    add("long cylinder", Box::new(Cylinder::new(0.3 * mm, 1.5 * mm).unwrap()));
    add("coin", Box::new(Cylinder::new(0.7 * mm, 0.2 * mm).unwrap()));
    add("capsule", Box::new(Capsule::new(0.3 * mm, 0.8 * mm).unwrap()));
    for (name, x, y, z, e1, e2) in [
        ("superellipsoid that is an ellipsoid", 1.0, 0.7, 0.5, 1.0, 1.0),
        ("rounded box", 0.6, 0.5, 0.4, 0.4, 0.4),
        ("sharpest box", 0.6, 0.5, 0.4, 0.2, 0.2),
        ("rounded cylinder", 0.4, 0.4, 0.7, 0.3, 1.0),
        ("lens with corners", 0.8, 0.6, 0.4, 1.4, 0.6),
        ("pillow with tips", 0.5, 0.6, 0.7, 0.5, 1.6),
        ("sharpest tips", 0.5, 0.6, 0.4, 1.9, 1.9),
        ("box with tips", 0.5, 0.6, 0.4, 0.2, 1.9),
        ("tent", 0.5, 0.6, 0.4, 1.9, 0.2),
    ] {
        add(name, Box::new(Superellipsoid::new(vec(x, y, z), [e1, e2]).unwrap()));
    }
    let tetrahedron = [vec(1.0, 1.0, 1.0), vec(1.0, -1.0, -1.0), vec(-1.0, 1.0, -1.0), vec(-0.5, -1.2, 1.0)];
    add("tetrahedron", Box::new(Polyhedron::from_corners(&tetrahedron, polyhedron::COMPUTED).unwrap().0));
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let points: Vec<Vec3> = (0..30).map(|_| direction(&mut rng).component_mul(&vec(0.7, 0.5, 0.4))).collect();
    add("stone", Box::new(Polyhedron::hull(&points, polyhedron::COMPUTED).unwrap().0));
    shapes
}

fn direction(rng: &mut ChaCha8Rng) -> Vec3 {
    loop {
        let v = Vec3::from_fn(|_, _| rng.random_range(-1.0..1.0_f64));
        if (0.01..1.0).contains(&v.norm()) {
            return v.normalize();
        }
    }
}

fn orientation(rng: &mut ChaCha8Rng) -> Quat {
    Quat::from_scaled_axis(direction(rng) * rng.random_range(0.0..3.2))
}

/// Inside or out, up to twice the size away.
fn point(shape: &dyn Shape, rng: &mut ChaCha8Rng) -> Vec3 {
    let (_, high) = shape.bounds(&Quat::identity());
    let far = if rng.random_bool(0.5) { 1.05 } else { 2.0 };
    Vec3::from_fn(|i, _| rng.random_range(-far..far) * high[i])
}

/// Runs `check` on every shape and prints the largest of the errors it returns.
fn on_all(what: &str, limit: f64, mut check: impl FnMut(&dyn Shape, &mut ChaCha8Rng) -> f64) {
    let mut worst = String::new();
    for (name, shape) in shapes() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let error = check(&*shape, &mut rng);
        println!("{name}: {what} {error:.2e}");
        if error.is_nan() || error > limit {
            let _ = write!(worst, "\n{name}: {what} {error:.2e} > {limit:.0e}");
        }
    }
    assert!(worst.is_empty(), "{worst}");
}

/// End of the shadow of the body along x in y, at this z; `within` is in the shadow.
fn slice(shape: &dyn Shape, turn: &Quat, [low, within, high]: [f64; 3], z: f64) -> (f64, f64) {
    let end = |mut outside: f64| {
        let mut inside = within;
        for _ in 0..18 {
            let middle = 0.5 * (inside + outside);
            if shape.row_interval(turn, middle, z, 0.0).is_some() {
                inside = middle;
            } else {
                outside = middle;
            }
        }
        inside
    };
    (end(low), end(high))
}

/// Volume, first and second moments of the turned body, by rows. The sine puts more rows where they become short.
fn integrate(shape: &dyn Shape, turn: &Quat, rows: u32) -> (f64, Vec3, Mat3) {
    let nodes = |low: f64, high: f64| {
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        let step = std::f64::consts::PI / f64::from(rows);
        (0..rows).map(move |n| {
            let angle = step * (f64::from(n) + 0.5 - 0.5 * f64::from(rows));
            (middle + half * angle.sin(), half * angle.cos() * step)
        })
    };
    let (low, high) = shape.bounds(turn);
    let [bottom, top] =
        [-1.0, 1.0].map(|s| turn * shape.support(turn.inverse_transform_vector(&(Vec3::z() * s))));
    let (mut volume, mut first, mut second) = (0.0, Vec3::zeros(), Mat3::zeros());
    for (z, z_weight) in nodes(low.z, high.z) {
        // The line from the lowest to the highest point is in the body.
        let within = bottom.y + (top.y - bottom.y) * (z - bottom.z) / (top.z - bottom.z);
        let ends = slice(shape, turn, [low.y, within, high.y], z);
        for (y, y_weight) in nodes(ends.0, ends.1) {
            let Some((a, b)) = shape.row_interval(turn, y, z, 0.0) else {
                continue;
            };
            let powers = [b - a, (b * b - a * a) / 2.0, (b * b * b - a * a * a) / 3.0];
            let [one, x, xx] = powers.map(|m| m * y_weight * z_weight);
            volume += one;
            first += Vec3::new(x, y * one, z * one);
            let (xy, xz, yz) = (y * x, z * x, y * z * one);
            second += Mat3::new(xx, xy, xz, xy, y * y * one, yz, xz, yz, z * z * one);
        }
    }
    (volume, first, second)
}

#[test]
fn volume_centre_and_inertia_are_those_of_the_body() {
    on_all("moments", 1e-3, |shape, rng| {
        // Faces and tips make chords that are not smooth.
        let rows = if shape.as_polyhedron().is_some() { 128 } else { 64 };
        let mut worst = 0.0_f64;
        for _ in 0..200 {
            let orientation = orientation(rng);
            let (volume, first, second) = integrate(shape, &orientation, rows);
            let turn = orientation.to_rotation_matrix();
            let inertia = turn * Mat3::from_diagonal(&shape.inertia_per_mass()) * turn.transpose();
            let found = (Mat3::identity() * second.trace() - second) / shape.volume();
            worst = worst.max((volume / shape.volume() - 1.0).abs());
            worst = worst.max(first.amax() / shape.volume() / shape.circumradius());
            worst = worst.max((found - inertia).amax() / inertia.amax());
        }
        worst
    });
}

#[test]
fn the_gradient_has_length_one_and_is_that_of_the_distance() {
    on_all("gradient", 1e-6, |shape, rng| {
        let step = 1e-5 * shape.thickness();
        let (mut worst, mut tried) = (0.0_f64, 0);
        for _ in 0..2000 {
            let p = point(shape, rng);
            let ends = |axis: usize| [-step, step].map(|s| p + Vec3::ith(axis, s));
            let gradient = shape.gradient(p);
            worst = worst.max((gradient.norm() - 1.0).abs());
            // Where two points of the surface are nearest, or the surface has an edge close by, differences say
            // nothing.
            let turns = |axis| {
                let [a, b] = ends(axis).map(|end| shape.gradient(end));
                (a - b).norm()
            };
            if (0..3).any(|axis| turns(axis) > 1e-3) {
                continue;
            }
            tried += 1;
            let difference = Vec3::from_fn(|axis, _| {
                let [a, b] = ends(axis).map(|end| shape.signed_distance(end));
                (b - a) / (2.0 * step)
            });
            worst = worst.max((difference - gradient).amax());
            if tried == 200 {
                return worst;
            }
        }
        panic!("{}: only {tried} points of 2000", shape.kind());
    });
}

/// Distance to a triangle (Ericson 2005, section 5.1.5).
fn to_triangle(p: Vec3, [a, b, c]: [Vec3; 3]) -> f64 {
    let normal = (b - a).cross(&(c - a));
    let sides = [(a, b), (b, c), (c, a)];
    if sides.iter().all(|(s, e)| (e - s).cross(&(p - s)).dot(&normal) >= 0.0) {
        return ((p - a).dot(&normal) / normal.norm()).abs();
    }
    let to_side = |(s, e): (Vec3, Vec3)| {
        let along = ((p - s).dot(&(e - s)) / (e - s).norm_squared()).clamp(0.0, 1.0);
        (p - s - (e - s) * along).norm()
    };
    sides.map(to_side).into_iter().fold(f64::INFINITY, f64::min)
}

#[test]
fn the_distance_is_that_to_a_fine_mesh() {
    on_all("distance to the mesh", 1e-2, |shape, rng| {
        let mesh = shape.surface_mesh(if shape.kind() == "superellipsoid" { 5 } else { 4 });
        let triangles: Vec<_> = mesh.triangles.iter().map(|t| t.map(|i| mesh.points[i as usize])).collect();
        (0..200).fold(0.0, |worst, _| {
            let p = point(shape, rng);
            let found = triangles.iter().map(|&t| to_triangle(p, t)).fold(f64::INFINITY, f64::min);
            let error = (shape.signed_distance(p).abs() - found).abs() / shape.circumradius();
            f64::max(worst, error)
        })
    });
}

#[test]
fn the_distance_is_the_height_above_the_highest_supporting_plane() {
    // Exact: that plane stands on the gradient, and no other of thousands is higher.
    on_all("distance", 1e-9, |shape, rng| {
        let planes: Vec<(Vec3, f64)> =
            (0..3000).map(|_| direction(rng)).map(|n| (n, n.dot(&shape.support(n)))).collect();
        (0..200).fold(0.0, |worst, _| {
            let p = point(shape, rng);
            let (distance, n) = (shape.signed_distance(p), shape.gradient(p));
            // Beside a corner the gradient has its own supporting plane; rounding tilts it.
            let height = n.dot(&(p - shape.support(n)));
            let mut error = (height - distance).abs();
            let highest = planes.iter().map(|(n, h)| n.dot(&p) - h).fold(f64::NEG_INFINITY, f64::max);
            error = error.max(highest - distance);
            // Close by, where the highest is.
            for _ in 0..300 {
                let reach = 0.3 * rng.random_range(0.0..1.0_f64).powi(4);
                let n = (n + direction(rng) * reach).normalize();
                error = error.max(n.dot(&(p - shape.support(n))) - distance);
            }
            f64::max(worst, error / shape.circumradius())
        })
    });
}

#[test]
fn the_nearest_point_lies_on_the_surface() {
    on_all("foot point", 1e-9, |shape, rng| {
        (0..200).fold(0.0, |worst, _| {
            let p = point(shape, rng);
            let foot = p - shape.gradient(p) * shape.signed_distance(p);
            f64::max(worst, shape.signed_distance(foot).abs() / shape.circumradius())
        })
    });
}

#[test]
fn the_distance_is_right_on_the_axes_in_the_planes_of_symmetry_and_at_the_centre() {
    on_all("distance", 1e-9, |shape, rng| {
        let planes: Vec<(Vec3, f64)> = (0..3000)
            .map(|_| direction(rng))
            .chain((0..6).map(|n| Vec3::ith(n % 3, if n < 3 { 1.0 } else { -1.0 })))
            .map(|n| (n, n.dot(&shape.support(n))))
            .collect();
        let (_, high) = shape.bounds(&Quat::identity());
        let mut worst = 0.0_f64;
        for n in 0..5_i32.pow(3) {
            let at = Vec3::from([n % 5, n / 5 % 5, n / 25].map(f64::from));
            for scale in [1e-14, 0.3, 0.5, 0.7] {
                let p = (at - Vec3::repeat(2.0)).component_mul(&high) * scale;
                let (distance, gradient) = (shape.signed_distance(p), shape.gradient(p));
                assert!((gradient.norm() - 1.0).abs() < 1e-12, "{p:?} {gradient:?}");
                let height = gradient.dot(&(p - shape.support(gradient)));
                let highest = planes.iter().map(|(n, h)| n.dot(&p) - h).fold(f64::NEG_INFINITY, f64::max);
                let error = (height - distance).abs().max(highest - distance);
                worst = worst.max(error / shape.circumradius());
            }
        }
        worst
    });
}

#[test]
fn the_support_point_is_on_the_surface_and_no_point_of_the_mesh_is_further() {
    on_all("support", 1e-9, |shape, rng| {
        let mesh = shape.surface_mesh(4);
        (0..200).fold(0.0, |worst, _| {
            let n = direction(rng);
            let support = shape.support(n * 7.0);
            let furthest = mesh.points.iter().map(|p| p.dot(&n)).fold(f64::NEG_INFINITY, f64::max);
            let short = n.dot(&support) - furthest;
            assert!(short < 0.02 * shape.circumradius(), "{}: {short:.2e}", shape.kind());
            let off = shape.signed_distance(support).abs();
            f64::max(worst, off.max(-short) / shape.circumradius())
        })
    });
}

#[test]
fn the_bounds_hold_the_mesh_and_touch_it() {
    on_all("bounds", 1e-12, |shape, rng| {
        let mesh = shape.surface_mesh(4);
        (0..200).fold(0.0, |worst, _| {
            let turn = orientation(rng);
            let (low, high) = shape.bounds(&turn);
            let points: Vec<Vec3> = mesh.points.iter().map(|p| turn * p).collect();
            let (first, last) = points.iter().fold((points[0], points[0]), |(a, b), p| (a.inf(p), b.sup(p)));
            let slack = (first - low).amax().max((high - last).amax());
            assert!(slack < 0.02 * shape.circumradius(), "{}: {slack:.2e}", shape.kind());
            let out = (low - first).max().max((last - high).max());
            let by_support = Vec3::from_fn(|i, _| {
                (turn * shape.support(turn.inverse_transform_vector(&Vec3::ith(i, 1.0))))[i]
            });
            f64::max(worst, out.max((by_support - high).amax()) / shape.circumradius())
        })
    });
}

#[test]
fn circumradius_and_thickness_are_the_greatest_and_least_over_all_directions() {
    on_all("extents", 1e-12, |shape, rng| {
        let mesh = shape.surface_mesh(4);
        let furthest = mesh.points.iter().map(Vec3::norm).fold(0.0, f64::max);
        assert!(furthest > 0.98 * shape.circumradius(), "{furthest:.3e} {:.3e}", shape.circumradius());
        let width = |n: Vec3| n.dot(&(shape.support(n) - shape.support(-n)));
        let mut best = (f64::INFINITY, Vec3::x());
        for trial in 0..12000 {
            let reach = if trial < 6000 { 10.0 } else { 0.5 * 0.5_f64.powi((trial - 6000) / 400) };
            let n = (best.1 + direction(rng) * reach).normalize();
            best = if width(n) < best.0 { (width(n), n) } else { best };
        }
        assert!(
            best.0 < 1.01 * shape.thickness(),
            "{}: {:.3e} {:.3e}",
            shape.kind(),
            best.0,
            shape.thickness()
        );
        (furthest - shape.circumradius()).max(shape.thickness() - best.0) / shape.circumradius()
    });
}

/// A turned body, a row near it, and growths to try.
fn random_row(shape: &dyn Shape, rng: &mut ChaCha8Rng) -> (Quat, f64, f64) {
    let turn = orientation(rng);
    let (low, high) = shape.bounds(&turn);
    let mut within = |i: usize| rng.random_range(1.1 * low[i]..1.1 * high[i]);
    let (y, z) = (within(1), within(2));
    (turn, y, z)
}

#[test]
fn a_row_of_the_body_ends_on_its_surface() {
    on_all("ends of rows", 1e-8, |shape, rng| {
        let mut worst = 0.0_f64;
        for _ in 0..2000 {
            let (turn, y, z) = random_row(shape, rng);
            let height = |x: f64| shape.signed_distance(turn.inverse_transform_vector(&Vec3::new(x, y, z)));
            let reach = shape.circumradius() * 1.2;
            if let Some((low, high)) = shape.row_interval(&turn, y, z, 0.0) {
                worst = worst.max(height(low).abs()).max(height(high).abs());
            } else {
                let inside = (-50..=50).any(|n| height(reach * f64::from(n) / 50.0) < 0.0);
                assert!(!inside, "{}: missed", shape.kind());
            }
        }
        worst / shape.circumradius()
    });
}

#[test]
fn a_row_of_the_grown_body_holds_every_point_as_close() {
    on_all("missing length", 1e-9, |shape, rng| {
        let (mut worst, mut excess, mut rows) = (0.0_f64, 0.0_f64, 0);
        for _ in 0..400 {
            let growth = [0.02, 0.1, 0.3][rng.random_range(0..3)] * shape.thickness();
            let (turn, y, z) = random_row(shape, rng);
            let height = |x: f64| shape.signed_distance(turn.inverse_transform_vector(&Vec3::new(x, y, z)));
            let reach = shape.circumradius() + growth;
            let found = shape.row_interval(&turn, y, z, growth);
            for n in -20..=20 {
                let x = reach * f64::from(n) / 20.0;
                if height(x) <= growth {
                    let (low, high) = found.expect("a row");
                    worst = worst.max(low - x).max(x - high);
                }
            }
            if let Some((low, high)) = found {
                rows += 1;
                excess = excess.max(height(low) / growth).max(height(high) / growth);
            }
        }
        println!("  {rows} rows, their ends are up to {excess:.2} growths away from the body");
        worst / shape.circumradius()
    });
}

#[test]
fn a_row_of_the_shrunk_body_holds_only_points_as_deep() {
    on_all("excess depth", 1e-9, |shape, rng| {
        let (mut worst, mut missing, mut present) = (0.0_f64, 0, 0);
        for _ in 0..400 {
            let growth = [-0.02, -0.1, -0.3, -0.49, -0.6][rng.random_range(0..5)] * shape.thickness();
            let (turn, y, z) = random_row(shape, rng);
            let height = |x: f64| shape.signed_distance(turn.inverse_transform_vector(&Vec3::new(x, y, z)));
            let found = shape.row_interval(&turn, y, z, growth);
            if let Some((low, high)) = found {
                worst = worst.max(height(low) - growth).max(height(high) - growth);
            }
            for n in -20..=20 {
                let x = shape.circumradius() * f64::from(n) / 20.0;
                if height(x) <= growth {
                    present += 1;
                    missing += i32::from(!found.is_some_and(|(low, high)| (low..=high).contains(&x)));
                }
            }
        }
        println!("  {missing} of {present} points deep enough were left out");
        worst / shape.circumradius()
    });
}

#[test]
fn the_surface_mesh_is_closed_points_outwards_and_fills_the_body() {
    on_all("volume of the mesh", 5e-3, |shape, _| {
        let error = |refinement: u32| {
            let mesh = shape.surface_mesh(refinement);
            let mut edges: Vec<(u32, u32)> =
                mesh.triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]).collect();
            edges.sort_unstable();
            assert!(edges.windows(2).all(|e| e[0] != e[1]));
            assert!(edges.iter().all(|&(a, b)| edges.binary_search(&(b, a)).is_ok()));
            assert_eq!(mesh.points.len() + mesh.triangles.len(), edges.len() / 2 + 2, "Euler's formula");
            let mut volume = 0.0;
            for t in &mesh.triangles {
                let [a, b, c] = t.map(|i| mesh.points[i as usize]);
                let part = a.dot(&b.cross(&c)) / 6.0;
                assert!(part > 0.0, "counter-clockwise from outside");
                volume += part;
            }
            1.0 - volume / shape.volume()
        };
        let errors = [error(2), error(5)];
        let is_flat = shape.as_polyhedron().is_some();
        let limit = if is_flat { 1e-13 } else { errors[0] / 20.0 };
        assert!(errors[1] <= limit && errors[1] > -1e-13, "{}: {errors:?}", shape.kind());
        errors[1].abs()
    });
}

#[test]
fn a_cube_is_the_same_as_cuboid_and_as_polyhedron() {
    let edge = 1e-3;
    let cuboid = Cuboid::new(Vec3::repeat(edge)).unwrap();
    let corners = cuboid.as_polyhedron().unwrap().vertices.clone();
    let (polyhedron, _) = Polyhedron::from_corners(&corners, polyhedron::COMPUTED).unwrap();
    let superellipsoid = Superellipsoid::new(Vec3::repeat(0.5 * edge), [0.2, 0.2]).unwrap();
    assert!(superellipsoid.volume() < cuboid.volume());
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    assert!((cuboid.volume() / polyhedron.volume() - 1.0).abs() < 1e-14);
    assert!((cuboid.inertia_per_mass() - polyhedron.inertia_per_mass()).amax() < 1e-14 * edge * edge);
    assert!((cuboid.thickness() - polyhedron.thickness()).abs() < 1e-14 * edge);
    for _ in 0..1000 {
        let p = point(&cuboid, &mut rng);
        assert!((cuboid.signed_distance(p) - polyhedron.signed_distance(p)).abs() < 1e-12 * edge);
        let (turn, y, z) = random_row(&cuboid, &mut rng);
        let rows = [&cuboid as &dyn Shape, &polyhedron].map(|s| s.row_interval(&turn, y, z, 0.1 * edge));
        assert_eq!(rows[0].is_some(), rows[1].is_some());
        if let [Some(a), Some(b)] = rows {
            assert!((a.0 - b.0).abs().max((a.1 - b.1).abs()) < 1e-12 * edge);
        }
    }
}

#[test]
fn edges_are_as_sharp_as_those_of_a_cube_whatever_its_size_and_fade_out_on_the_way_to_a_sphere() {
    let cube = Polyhedron::cuboid(Vec3::repeat(0.7));
    assert!((cube.curvature().sharpness - 1.0).abs() < 1e-12);
    // Edges of a tetrahedron of edge 1: normals turn by acos(-1/3); volume 1 / (6 sqrt 2), area sqrt 3.
    let corners = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
    let tetrahedron = Polyhedron::hull(&corners.map(Vec3::from), 1e-9).unwrap().0;
    let exact =
        (6.0 * 2.0_f64.sqrt()).cbrt().recip() * 6.0 * (0.5 * (4.0 / 3.0 + 2.0)) / (2.0 * 3.0_f64.sqrt());
    assert!((tetrahedron.curvature().sharpness - exact).abs() < 1e-12);
    let of = |refinement| {
        let mesh = Sphere { radius: 2.0 }.surface_mesh(refinement);
        Polyhedron::hull(&mesh.points, 1e-9).unwrap().0.curvature().sharpness
    };
    let [coarse, fine] = [of(2), of(3)];
    assert!(fine < 0.6 * coarse && coarse < 0.5, "{coarse} {fine}");
}

#[test]
fn the_mean_curvature_of_a_prism_with_many_sides_is_that_of_its_cylinder_and_of_a_hull_of_many_points_that_of_its_sphere()
 {
    let corners = (0..256).flat_map(|k| {
        let (sin, cos) = (2.0 * PI * f64::from(k) / 256.0).sin_cos();
        [-0.5, 0.5].map(|z| Vec3::new(cos, sin, 3.0 * z))
    });
    let prism = Polyhedron::hull(&corners.collect::<Vec<_>>(), 1e-9).unwrap().0.curvature();
    // Side: radius 1, length 3. Rims: two quarter turns around a length of 2 pi each.
    let (side, rims, area) = (3.0 * PI, PI * PI, 8.0 * PI);
    let cylinder = Cylinder::new(1.0, 3.0).unwrap().curvature();
    assert!((cylinder.mean - (side + rims) / area).abs() < 1e-12);
    assert!((prism.mean / cylinder.mean - 1.0).abs() < 1e-3, "{prism:?} {cylinder:?}");
    assert!((prism.smooth - side / area).abs() < 1e-3, "{prism:?}");
    assert!((prism.sharpness / cylinder.sharpness - 1.0).abs() < 0.03, "{prism:?} {cylinder:?}");

    let mesh = Sphere { radius: 2.0 }.surface_mesh(3);
    let hull = Polyhedron::hull(&mesh.points, 1e-9).unwrap().0.curvature();
    let ball = Ellipsoid::new(Vec3::repeat(2.0)).unwrap().curvature();
    for round in [hull.mean, hull.smooth, ball.mean, ball.smooth, Sphere { radius: 2.0 }.curvature().mean] {
        assert!((round - 0.5).abs() < 0.01, "{round}");
    }
}

#[test]
fn sizes_that_are_no_sizes_are_refused() {
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let messages = [
            Cuboid::new(Vec3::new(1.0, bad, 1.0)).unwrap_err(),
            Ellipsoid::new(Vec3::new(1.0, 1.0, bad)).unwrap_err(),
            Cylinder::new(1.0, bad).unwrap_err(),
            Capsule::new(bad, 1.0).unwrap_err(),
            Superellipsoid::new(Vec3::new(bad, 1.0, 1.0), [1.0, 1.0]).unwrap_err(),
        ];
        for message in messages {
            assert!(matches!(message, ShapeError::BadSize { .. }), "{message}");
        }
    }
    for bad in [0.0, 0.1, 2.0, f64::NAN] {
        let error = Superellipsoid::new(Vec3::repeat(1.0), [1.0, bad]).unwrap_err();
        assert!(error.to_string().contains("0.2..=1.9"), "{error}");
    }
}

/// Nanoseconds per call; run with `cargo test --lib shape::tests::timing -- --ignored --nocapture`.
#[test]
#[ignore = "a measurement, not a claim"]
fn timing() {
    for (name, shape) in shapes() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        // Points of the shell that the mapping asks for, 12 cells per diameter.
        let shell = shape.equivalent_diameter() / 24.0;
        let mut points = Vec::new();
        while points.len() < 2000 {
            let p = point(&*shape, &mut rng);
            if shape.signed_distance(p).abs() < shell {
                points.push(p);
            }
        }
        let rows: Vec<_> = (0..2000).map(|_| random_row(&*shape, &mut rng)).collect();
        let least = |run: &mut dyn FnMut() -> f64, calls: usize| {
            let mut sum = 0.0;
            let times = (0..10).map(|_| {
                let start = std::time::Instant::now();
                sum += run();
                start.elapsed().as_secs_f64() * 1e9 / calls as f64
            });
            (times.fold(f64::INFINITY, f64::min), sum)
        };
        let distance = least(&mut || points.iter().map(|&p| shape.signed_distance(p)).sum(), points.len());
        let row = |(turn, y, z): &(Quat, f64, f64)| {
            [shell, -shell]
                .iter()
                .map(|g| shape.row_interval(turn, *y, *z, *g).map_or(0.0, |row| row.1))
                .sum::<f64>()
        };
        let row = least(&mut || rows.iter().map(row).sum(), 2 * rows.len());
        println!("{name}: distance {:.0} ns, row {:.0} ns ({:.1e})", distance.0, row.0, distance.1 + row.1);
    }
}
