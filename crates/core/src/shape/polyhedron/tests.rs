use super::*;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

#[test]
fn the_corners_of_a_box_run_counter_clockwise_seen_from_outside() {
    let cuboid = Polyhedron::cuboid(Vec3::new(1.0, 2.0, 3.0));
    for face in &cuboid.faces {
        let [a, b, c] = [0, 1, 2].map(|i| cuboid.vertices[face.corners[i] as usize]);
        assert!((b - a).cross(&(c - b)).normalize().dot(&face.normal) > 1.0 - 1e-12);
        for &corner in &face.corners {
            let height = cuboid.vertices[corner as usize].dot(&face.normal);
            assert!((height - face.offset).abs() < 1e-15);
        }
    }
}

/// Points of a grid over a cuboid, turned and shifted.
fn grid(edges: Vec3, n: u32, turn: &Quat, shift: Vec3) -> Vec<Vec3> {
    let at = |i: u32| f64::from(i) / f64::from(n - 1) - 0.5;
    let point = |k: u32| Vec3::new(at(k % n), at(k / n % n), at(k / n / n)).component_mul(&edges);
    (0..n * n * n).map(|k| turn * point(k) + shift).collect()
}

#[test]
fn the_hull_of_a_turned_grid_of_points_is_the_box() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for scale in [1.0, 1e-6] {
        let edges = Vec3::new(1.0, 2.0, 3.0) * scale;
        let turn = Quat::from_scaled_axis(Vec3::from_fn(|_, _| rng.random_range(-2.0..2.0)));
        let shift = Vec3::new(3.0, -2.0, 1.0) * scale;
        let points = grid(edges, 7, &turn, shift);
        let (body, placement) = Polyhedron::hull(&points, COMPUTED).unwrap();
        assert_eq!((body.vertices.len(), body.faces.len()), (8, 6));
        assert!((body.volume() / edges.product() - 1.0).abs() < 1e-13);
        assert!((placement.centre - shift).norm() < 1e-14 * scale * 10.0);
        for point in &points {
            assert!(body.signed_distance(placement.to_body(*point)) < 1e-14 * scale * 10.0);
        }
        let mut moments: Vec<f64> = body.inertia_per_mass().iter().map(|x| x / scale / scale).collect();
        moments.sort_by(f64::total_cmp);
        for (moment, exact) in moments.iter().zip([5.0, 10.0, 13.0]) {
            assert!((moment - exact / 12.0).abs() < 1e-13);
        }
    }
}

#[test]
fn a_cube_keeps_the_axes_it_is_given_in() {
    let points = grid(Vec3::repeat(2.0), 2, &Quat::identity(), Vec3::new(5.0, 0.0, 0.1));
    let (body, placement) = Polyhedron::from_corners(&points, COMPUTED).unwrap();
    assert_eq!(placement.rotation, Quat::identity());
    assert!((body.vertices[0].abs() - Vec3::repeat(1.0)).amax() < 1e-15);
}

#[test]
fn hulls_of_lattice_points_are_closed_hold_all_points_and_have_their_corners_among_them() {
    // Many points in one plane or on one line: where hulls usually break.
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let mut flat = 0;
    for set in 0..3000 {
        let side = rng.random_range(2..5);
        let count = rng.random_range(4..40);
        let turn = match set % 3 {
            0 => Quat::identity(),
            _ => Quat::from_scaled_axis(Vec3::from_fn(|_, _| rng.random_range(-2.0..2.0))),
        };
        let points: Vec<Vec3> =
            (0..count).map(|_| turn * Vec3::from_fn(|_, _| f64::from(rng.random_range(0..side)))).collect();
        let (body, placement) = match Polyhedron::hull(&points, COMPUTED) {
            Ok(found) => found,
            Err(ShapeError::Flat { .. } | ShapeError::TooFewPoints { .. }) => {
                flat += 1;
                continue;
            }
            Err(error) => panic!("{error}"),
        };
        let loops: Vec<Vec<u32>> = body.faces.iter().map(|f| f.corners.clone()).collect();
        assert!(is_closed(&loops), "set {set}");
        for point in &points {
            assert!(body.signed_distance(placement.to_body(*point)) < 1e-12, "set {set}");
        }
        for vertex in &body.vertices {
            let found = points.iter().any(|p| (placement.to_body(*p) - vertex).norm() < 1e-12);
            assert!(found, "set {set}");
        }
        for (n, face) in body.faces.iter().enumerate() {
            for &corner in &face.corners {
                let height = body.vertices[corner as usize].dot(&face.normal) - face.offset;
                assert!(height.abs() < 1e-12, "set {set}");
            }
            let twins = body.faces[..n].iter().filter(|other| other.normal.dot(&face.normal) > 1.0 - 1e-9);
            assert_eq!(twins.count(), 0, "set {set}: two faces in one plane");
        }
    }
    assert!(flat < 600, "{flat} of 3000");
}

#[test]
fn points_without_a_volume_are_refused() {
    let random = |n: usize| Vec3::new(n as f64, (n * n % 7) as f64, 0.0);
    let plane: Vec<Vec3> = (0..9).map(random).collect();
    let line: Vec<Vec3> = (0..9).map(|n| Vec3::new(1.0, 2.0, 3.0) * f64::from(n)).collect();
    let twice = [Vec3::x(), Vec3::y(), Vec3::z(), Vec3::x() * (1.0 + 1e-12)];
    let turn = Quat::from_scaled_axis(Vec3::new(0.3, 0.4, 0.5));
    let turned: Vec<Vec3> = plane.iter().map(|p| turn * p).collect();
    for (points, expected) in [
        (&plane[..], "flat"),
        (&turned[..], "flat"),
        (&line[..], "flat"),
        (&twice[..], "4 different points, but there are 3"),
        (&plane[..3], "4 different points, but there are 3"),
        (&[][..], "there are 0"),
        (&[Vec3::x(), Vec3::new(0.0, f64::NAN, 1.0)][..], "point 1 is (0, NaN, 1)"),
    ] {
        let message = Polyhedron::hull(points, COMPUTED).unwrap_err().to_string();
        assert!(message.contains(expected), "{message}");
    }
}

#[test]
fn a_corner_inside_the_hull_is_named() {
    let mut points = grid(Vec3::repeat(1.0), 2, &Quat::identity(), Vec3::zeros());
    points.push(Vec3::new(0.5, 0.25, 0.0));
    assert!(Polyhedron::from_corners(&points, COMPUTED).is_ok(), "on a face");
    points.push(Vec3::new(0.0, 0.0, 0.4));
    assert!(Polyhedron::hull(&points, COMPUTED).is_ok());
    let Err(ShapeError::Concave { index: 9, depth, .. }) = Polyhedron::from_corners(&points, COMPUTED) else {
        panic!("a body with a dent");
    };
    assert!((depth - 0.1).abs() < 1e-12);
}

#[test]
fn the_width_is_the_smallest_over_all_directions() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    // A tetrahedron is thinnest between two edges: 1 / sqrt(2) of its edge.
    let corners = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]].map(Vec3::from);
    let (tetrahedron, _) = Polyhedron::hull(&corners, COMPUTED).unwrap();
    assert!((tetrahedron.thickness() - 2.0).abs() < 1e-14);
    for _ in 0..20 {
        let points: Vec<Vec3> = (0..12).map(|_| Vec3::from_fn(|_, _| rng.random_range(-1.0..1.0))).collect();
        let (body, _) = Polyhedron::hull(&points, COMPUTED).unwrap();
        let width = |n: Vec3| (body.support(n) - body.support(-n)).dot(&n);
        // Random directions, then ever smaller steps downhill from the best few.
        let mut starts: Vec<(f64, Vec3)> = (0..3000)
            .map(|_| Vec3::from_fn(|_, _| rng.random_range(-1.0..1.0)).normalize())
            .map(|n| (width(n), n))
            .collect();
        starts.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut best = starts[0];
        for mut found in starts.into_iter().step_by(5).take(30) {
            for trial in 0..2000 {
                let step = 0.2 * 0.7_f64.powi(trial / 60);
                let direction = (found.1 + Vec3::from_fn(|_, _| rng.random_range(-step..step))).normalize();
                found = if width(direction) < found.0 { (width(direction), direction) } else { found };
            }
            best = if found.0 < best.0 { found } else { best };
        }
        assert!(best.0 >= body.thickness() - 1e-12, "{} {}", best.0, body.thickness());
        assert!(best.0 < body.thickness() * 1.0001, "{} {}", best.0, body.thickness());
    }
}
