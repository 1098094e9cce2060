use super::*;
use crate::packing::{Ball, count_for_volume_fraction, pack};
use crate::shape::{Cuboid, Shape, Sphere};
use std::sync::Arc;

const GAP: f64 = 0.03;

fn domain(cells: usize) -> Domain {
    Domain { faces: Domain::faces([true; 3]), cells: [cells; 3], dx: 0.1 }
}

/// Bodies of equal volume (that of a sphere of diameter 1) at a volume fraction, not yet relaxed.
fn thrown(domain: &Domain, shape: Arc<dyn Shape>, fraction: f64) -> (Vec<GrownShape>, Vec<Pose>) {
    let count = count_for_volume_fraction(domain.volume(), fraction, shape.volume()) as usize;
    let ball = Ball { radius: 0.5 * shape.equivalent_diameter(), half_gap: 0.5 * GAP };
    let positions = pack(domain, &[], &[], &vec![ball; count], 1).unwrap();
    let poses = positions.into_iter().zip(random_orientations(count, 1));
    let poses = poses.map(|(position, orientation)| Pose { contour: 0, position, orientation });
    (vec![GrownShape::new(shape, 0.5 * GAP)], poses.collect())
}

/// Number of pairs that overlap, and of bodies that overlap a wall, without any gap.
pub(in crate::packing) fn overlaps(
    domain: &Domain,
    walls: &[Surface],
    shape: &Arc<dyn Shape>,
    poses: &[Pose],
) -> usize {
    let bare = [GrownShape::new(shape.clone(), 0.0)];
    let mut count = 0;
    for (i, a) in poses.iter().enumerate() {
        for b in &poses[..i] {
            let offset = domain.nearest_image(b.position - a.position);
            count +=
                usize::from(overlap(Geometry::Exact, &body(&bare, a), &body(&bare, b), offset).is_some());
        }
        for wall in walls {
            let seen = wall.seen_from(a.position);
            count += usize::from(overlap_wall(Geometry::Exact, &body(&bare, a), &seen).is_some());
        }
    }
    count
}

#[test]
fn cubes_at_a_volume_fraction_of_three_tenths_come_apart() {
    let edge = libm::cbrt(std::f64::consts::PI / 6.0);
    let shape: Arc<dyn Shape> = Arc::new(Cuboid::new(Vec3::repeat(edge)).unwrap());
    let domain = domain(50);
    let (contours, mut poses) = thrown(&domain, shape.clone(), 0.3);
    let before = overlaps(&domain, &[], &shape, &poses);
    assert!(before > 20, "{before} overlaps to begin with");
    assert!(relax(domain, &[], &contours, &mut poses, 0, None));
    assert_eq!(overlaps(&domain, &[], &shape, &poses), 0);
}

#[test]
fn slabs_between_walls_stay_inside() {
    let shape: Arc<dyn Shape> = Arc::new(Cuboid::new(Vec3::new(1.2, 1.0, 0.4)).unwrap());
    let domain = Domain { faces: Domain::faces([true, true, false]), ..domain(40) };
    let walls = [(0.0, 1.0), (4.0, -1.0)]
        .map(|(z, up)| Surface::Plane { point: Vec3::new(0.0, 0.0, z), normal: Vec3::new(0.0, 0.0, up) });
    let (contours, mut poses) = thrown(&domain, shape.clone(), 0.2);
    assert!(overlaps(&domain, &walls, &shape, &poses) > 5);
    assert!(relax(domain, &walls, &contours, &mut poses, 0, None));
    assert_eq!(overlaps(&domain, &walls, &shape, &poses), 0);
}

#[test]
fn fixed_bodies_stay_where_they_are() {
    let shape: Arc<dyn Shape> = Arc::new(Sphere { radius: 0.5 });
    let domain = domain(30);
    let (contours, mut poses) = thrown(&domain, shape, 0.1);
    poses[1].position = poses[0].position + Vec3::new(0.2, 0.1, 0.0);
    let before = poses.clone();
    assert!(relax(domain, &[], &contours, &mut poses, 1, None));
    assert_eq!(poses[0], before[0]);
    assert_ne!(poses[1], before[1]);
}

#[test]
fn random_orientations_prefer_no_direction() {
    let all = random_orientations(4000, 7);
    // The mean of R_ij^2 over all rotations is 1/3, that of R_ij is 0.
    for (i, j) in (0..9).map(|n| (n / 3, n % 3)) {
        let entries = all.iter().map(|q| q.to_rotation_matrix()[(i, j)]);
        let (sum, square) = entries.fold((0.0, 0.0), |(s, q), r| (s + r, q + r * r));
        assert!((sum / 4000.0).abs() < 0.03 && (square / 4000.0 - 1.0 / 3.0).abs() < 0.02);
    }
}

/// Furthest that a vertex of a cuboid with these half edges has moved.
fn furthest(domain: &Domain, half: Vec3, start: &Pose, end: &Pose) -> f64 {
    let shift = domain.nearest_image(end.position - start.position);
    let corner = |n: usize| Vec3::from_fn(|i, _| if n >> i & 1 == 0 { -half[i] } else { half[i] });
    let moved = |c: Vec3| shift + end.orientation * c - start.orientation * c;
    (0..8).map(|n| moved(corner(n)).norm()).fold(0.0, f64::max)
}

#[test]
fn within_limits_that_suffice_bodies_go_where_they_go_without() {
    let shape: Arc<dyn Shape> = Arc::new(Cuboid::new(Vec3::new(1.2, 1.0, 0.4)).unwrap());
    let domain = domain(40);
    let (contours, poses) = thrown(&domain, shape, 0.25);
    let (mut free, mut bounded) = (poses.clone(), poses.clone());
    assert!(relax(domain, &[], &contours, &mut free, 0, None));
    assert!(relax(domain, &[], &contours, &mut bounded, 0, Some(&vec![10.0; poses.len()])));
    assert_ne!(free, poses);
    assert_eq!(free, bounded);
}

#[test]
fn no_point_of_a_body_moves_further_than_its_limit() {
    let edges = Vec3::new(1.2, 1.0, 0.4);
    let shape: Arc<dyn Shape> = Arc::new(Cuboid::new(edges).unwrap());
    let domain = domain(40);
    let (contours, starts) = thrown(&domain, shape.clone(), 0.25);
    // Without a limit they move by up to 0.56.
    for (limit, suffices) in [(0.45, true), (0.05, false)] {
        let mut poses = starts.clone();
        let limits = vec![limit; poses.len()];
        assert_eq!(relax(domain, &[], &contours, &mut poses, 0, Some(&limits)), suffices);
        let ways: Vec<f64> =
            starts.iter().zip(&poses).map(|(a, b)| furthest(&domain, 0.5 * edges, a, b)).collect();
        let most = ways.iter().copied().fold(0.0, f64::max);
        assert!(most <= limit * (1.0 + 1e-12) && most > 0.7 * limit, "{most} of {limit}");
        for ((start, end), way) in starts.iter().zip(&poses).zip(&ways) {
            let (bound, _) = end.moved_from(&domain, start, shape.circumradius());
            assert!(*way <= bound * (1.0 + 1e-12) && bound <= limit * (1.0 + 1e-12), "{way} {bound}");
        }
        assert_eq!(overlaps(&domain, &[], &shape, &poses) == 0, suffices);
    }
}

#[test]
fn an_ellipsoid_that_dips_into_a_wall_by_less_than_samples_see_is_lifted_out() {
    let shape: Arc<dyn Shape> = Arc::new(crate::shape::Ellipsoid::new(Vec3::new(0.6, 0.5, 0.4)).unwrap());
    let domain = Domain { faces: Domain::faces([true, true, false]), ..domain(40) };
    let walls = [Surface::Plane { point: Vec3::zeros(), normal: Vec3::z() }];
    let contours = [GrownShape::new(shape.clone(), 0.0)];
    for depth in [1e-3, 1e-6, 1e-9] {
        let position = Vec3::new(2.0, 2.0, 0.4 - depth);
        let mut poses = [Pose { contour: 0, position, orientation: Quat::identity() }];
        assert!(relax(domain, &walls, &contours, &mut poses, 0, Some(&[0.1])));
        let down = poses[0].orientation.inverse_transform_vector(&-Vec3::z());
        let lowest = poses[0].position.z - shape.support(down).dot(&down);
        assert!((0.0..1e-2).contains(&lowest), "{lowest} from {depth}");
    }
}

#[test]
fn the_angle_and_the_way_of_a_turn_are_those_of_its_outermost_point() {
    let start = Pose {
        contour: 0,
        position: Vec3::new(0.1, 2.0, 2.0),
        orientation: Quat::from_scaled_axis(Vec3::new(0.4, -0.2, 0.9)),
    };
    let turn = Quat::from_scaled_axis(Vec3::new(0.0, 0.0, 0.5));
    let end = Pose { position: Vec3::new(3.9, 2.0, 2.0), orientation: turn * start.orientation, ..start };
    let (way, angle) = end.moved_from(&domain(40), &start, 3.0);
    assert!((way - (0.2 + 6.0 * libm::sin(0.25))).abs() < 1e-12, "{way}");
    assert!((angle - 0.5_f64.to_degrees()).abs() < 1e-9, "{angle}");
}
