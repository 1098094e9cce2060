//! Nearest points of two ellipsoids, or of one and a wall, and the curvature of the gap there.
//!
//! With the squares of the semi-axes as a matrix `S` in the world frame, an ellipsoid has the support function `s(n) = sqrt(n . S n)`,
//! its point with the normal `n` is `x(n) = S n / s`, and the inverse of its curvature there is the second derivative
//! `W = (S - x x^T) / s` in the tangent plane. A plane with the normal `n` between two bodies, `d` from the first to the second,
//! leaves
//!
//! ```text
//! g(n) = n . d - s_1(n) - s_2(n)
//! ```
//!
//! The width of the gap is its maximum, where `d - x_1 - x_2` is along `n`. Newton's step there solves
//! `(W_1 + W_2 + g) dn = d - x_1 - x_2` in the tangent plane; the matrix is positive as long as the bodies are apart, and for bodies
//! that are apart there is one maximum. At a pipe or a rod `n` turns about its axis.
//!
//! The gap is `g + x^T K x / 2`, `K = K_1 + K_2`, `K_i = W_i^-1`; walls and faces of polyhedra have none. What it does to the bodies:
//! [`lubrication`](super::lubrication).

use crate::math::nalgebra::{Matrix2, Matrix3x2, Vector2};
use crate::math::{Mat3, Quat, Vec3};
use crate::shape::Polyhedron;
use crate::wall::Surface;

/// An ellipsoid with a place in the world: the matrix `S` (m^2).
#[derive(Clone, Copy, Debug)]
pub struct Ellipsoidal(Mat3);

/// The gap between two bodies that are apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gap {
    /// Distance of the surfaces (m).
    pub width: f64,
    /// Unit normal, from the first body to the second.
    pub normal: Vec3,
    /// The nearest points, each from the centre of its body (m); zero for a wall.
    pub points: [Vec3; 2],
    /// Two unit vectors across the normal: the principal directions of the curvature of the gap.
    pub across: [Vec3; 2],
    /// The principal curvatures `K` of the gap (1/m).
    pub curvatures: [f64; 2],
    /// `2 K^-1` (m), of the surfaces half-way between the bodies.
    pub turning: [f64; 2],
    /// `K^-1 (K_2 - K_1)` of these surfaces (-), in rows.
    pub difference: [[f64; 2]; 2],
    /// Part of the film that there is (-): less than one beside the rim of a face.
    pub part: f64,
    /// Excess of `1 / s` over the mean curvature at the nearest points (1/m), `s` the distance from there to the centre along the normal, of both
    /// bodies by their parts in the curvature of the gap: the gap opens the faster further out, `area(d) ~ d (1 - d / 2 s)`. Zero for spheres.
    pub bulge: f64,
}

impl Gap {
    /// That of two spheres, or of a sphere and a wall, whose radius is infinite (m).
    pub fn of_spheres(radii: [f64; 2], normal: Vec3, width: f64) -> Self {
        let [a, b] = radii.map(|radius| 1.0 / (radius + 0.5 * width));
        let across = tangents(normal);
        let difference = (b - a) / (a + b);
        Self {
            width,
            normal,
            points: [
                normal * radii[0],
                if radii[1].is_finite() { -normal * radii[1] } else { Vec3::zeros() },
            ],
            across: [0, 1].map(|i| across.column(i).into_owned()),
            curvatures: [1.0 / radii[0] + 1.0 / radii[1]; 2],
            turning: [2.0 / (a + b); 2],
            difference: [[difference, 0.0], [0.0, difference]],
            part: 1.0,
            bulge: 0.0,
        }
    }

    /// With the inverse curvatures of the surfaces (m), none of a flat one, by two vectors across the normal.
    pub(super) fn new(
        (width, normal, points): (f64, Vec3, [Vec3; 2]),
        across: &Matrix3x2<f64>,
        inverse: [Option<Matrix2<f64>>; 2],
    ) -> Option<Self> {
        let curvature = |out: f64| {
            let of = |inverse: Option<Matrix2<f64>>| match inverse {
                Some(inverse) => (inverse + Matrix2::from_diagonal_element(out)).try_inverse(),
                None => Some(Matrix2::zeros()),
            };
            Some([of(inverse[0])?, of(inverse[1])?])
        };
        let [first, second] = curvature(0.0)?;
        let excess = |own: Matrix2<f64>, height: f64| match 0.5 * own.trace() {
            mean if mean > 0.0 => mean * (1.0 / height - mean),
            _ => 0.0,
        };
        let [near, far] = points.map(|point| point.dot(&normal));
        let bulge = (excess(first, near) + excess(second, -far)) / (0.5 * (first + second).trace());
        let axes = principal(first + second);
        let seen = |matrix: Matrix2<f64>| axes.transpose() * matrix * axes;
        let sum = seen(first + second);
        let [first, second] = curvature(0.5 * width)?.map(seen);
        let middle = (first + second).try_inverse()?;
        let difference = middle * (second - first);
        let principal = across * axes;
        Some(Self {
            width,
            normal,
            points,
            across: [0, 1].map(|i| principal.column(i).into_owned()),
            curvatures: [sum[(0, 0)], sum[(1, 1)]],
            turning: [2.0 * middle[(0, 0)], 2.0 * middle[(1, 1)]],
            difference: [0, 1].map(|i| [difference[(i, 0)], difference[(i, 1)]]),
            part: 1.0,
            bulge,
        })
    }

    /// The same gap, seen from the second body.
    #[must_use]
    pub fn flipped(self) -> Self {
        Self {
            normal: -self.normal,
            points: [self.points[1], self.points[0]],
            difference: self.difference.map(|row| row.map(|part| -part)),
            ..self
        }
    }

    /// Radius of the sphere that a wall resists alike when it is squeezed (m), `sqrt(2 / (tr K sqrt(det K)))`.
    pub fn reduced(&self) -> f64 {
        let [first, second] = self.curvatures;
        (2.0 / ((first + second) * (first * second).sqrt())).sqrt()
    }
}

/// The unit eigenvectors of a symmetric matrix, a turn.
fn principal(matrix: Matrix2<f64>) -> Matrix2<f64> {
    let (half, off) = (0.5 * (matrix[(0, 0)] - matrix[(1, 1)]), matrix[(0, 1)]);
    let size = Vector2::new(half, off).norm();
    let first = if half < 0.0 { Vector2::new(off, size - half) } else { Vector2::new(size + half, off) };
    let first = first.try_normalize(0.0).unwrap_or_else(Vector2::x);
    Matrix2::new(first.x, -first.y, first.y, first.x)
}

/// Steps of the normal after which the nearest points are as good as they get; far more than any pair needs.
const MOST_STEPS: usize = 50;
/// Steps of the normal (-) whose square is rounding.
const CONVERGED: f64 = 1e-8;

/// Points in which a plane with this normal touches both.
struct Touching {
    normal: Vec3,
    /// Two unit vectors across it.
    across: Matrix3x2<f64>,
    points: [Vec3; 2],
    /// Inverse curvatures (m).
    inverse: [Matrix2<f64>; 2],
    width: f64,
}

/// Two unit vectors that are perpendicular to a third and to each other.
fn tangents(normal: Vec3) -> Matrix3x2<f64> {
    let other = if normal.x.abs() < 0.6 { Vec3::x() } else { Vec3::y() };
    let first = normal.cross(&other).normalize();
    Matrix3x2::from_columns(&[first, normal.cross(&first)])
}

impl Ellipsoidal {
    /// With these semi-axes (m).
    pub fn new(semi_axes: Vec3, orientation: &Quat) -> Self {
        let turn = orientation.to_rotation_matrix().into_inner();
        Self(turn * Mat3::from_diagonal(&semi_axes.component_mul(&semi_axes)) * turn.transpose())
    }

    /// The point of the surface with this normal, from the centre, and the height of its tangent plane (m).
    fn support(&self, normal: Vec3) -> (Vec3, f64) {
        let stretched = self.0 * normal;
        let height = normal.dot(&stretched).sqrt();
        (stretched / height, height)
    }

    /// The inverse of the curvature there (m).
    fn inverse_curvature(&self, (point, height): (Vec3, f64), across: &Matrix3x2<f64>) -> Matrix2<f64> {
        let flat = across.transpose() * point;
        (across.transpose() * self.0 * across - flat * flat.transpose()) / height
    }

    /// The gap to another one, `offset` (m) from the first to the second; `None` if they overlap or are `range` (m) apart.
    pub fn gap(&self, other: &Self, offset: Vec3, range: f64) -> Option<Gap> {
        let touch = |normal: Vec3| {
            let across = tangents(normal);
            let (first, second) = (self.support(normal), other.support(normal));
            Touching {
                normal,
                across,
                points: [first.0, -second.0],
                inverse: [self.inverse_curvature(first, &across), other.inverse_curvature(second, &across)],
                width: normal.dot(&offset) - first.1 - second.1,
            }
        };
        let noise = 1e-15 * offset.norm();
        // Exact for bodies of one form and orientation, and for any that hardly touch nearly so.
        let mut here = touch(((self.0 + other.0).try_inverse()? * offset).try_normalize(0.0)?);
        for _ in 0..MOST_STEPS {
            if here.width >= range {
                return None;
            }
            let apart = offset - here.points[0] + here.points[1];
            let sum = here.inverse[0] + here.inverse[1];
            let newton = |shift: f64| sum + Matrix2::from_diagonal_element(shift);
            let exact = newton(here.width);
            let matrix = if exact.trace() > 0.0 && exact.determinant() > 0.0 { exact } else { newton(0.0) };
            let mut step: Vector2<f64> = matrix.try_inverse()? * (here.across.transpose() * apart);
            let mut there = touch((here.normal + here.across * step).normalize());
            while there.width < here.width - noise && step.norm() > CONVERGED {
                step *= 0.5;
                there = touch((here.normal + here.across * step).normalize());
            }
            here = there;
            if step.norm() <= CONVERGED {
                break;
            }
        }
        let Touching { width, normal, points, across, inverse } = here;
        if !(width > 0.0 && width < range) {
            return None;
        }
        Gap::new((width, normal, points), &across, inverse.map(Some))
    }

    /// The gap to a wall, whose own curvature does not count, seen from the centre of the body; `None` if they overlap or are
    /// `range` (m) apart.
    pub fn gap_to_wall(&self, wall: &Surface, range: f64) -> Option<Gap> {
        let mut normal = -wall.normal(Vec3::zeros());
        if let Surface::Cylinder { point, axis, .. } = wall {
            let to_axis = point - axis * point.dot(axis);
            for _ in 0..MOST_STEPS {
                let (support, across) = (self.support(normal), axis.cross(&normal));
                let apart = to_axis - support.0;
                let flat = across.dot(&support.0);
                let bend = (across.dot(&(self.0 * across)) - flat * flat) / support.1;
                let step = across.dot(&apart) / (bend + normal.dot(&apart));
                normal = (normal + across * step).normalize();
                if step.abs() <= CONVERGED {
                    break;
                }
            }
        }
        let support = self.support(normal);
        let width = wall.distance(support.0);
        if !(width > 0.0 && width < range) {
            return None;
        }
        self.flat((width, normal, [support.0, Vec3::zeros()]), support)
    }

    /// The gap to a face of a polyhedron, whose centre is at `offset` (m); `None` if none is within `range` (m), or if it is an edge or a corner
    /// that is near. As the point of the body comes near to the rim of the face the film fades,
    /// `part = d / sqrt(d^2 + 2 R h)`, `d` the distance of the rim and `2 R h` the square of the width of the film.
    pub fn gap_to_face(&self, (solid, turn): (&Polyhedron, &Quat), offset: Vec3, range: f64) -> Option<Gap> {
        (solid.faces.iter().enumerate()).find_map(|(number, face)| {
            let normal = -(turn * face.normal);
            let support = self.support(normal);
            let width = normal.dot(&offset) - face.offset - support.1;
            if !(width > 0.0 && width < range) {
                return None;
            }
            let foot = support.0 + normal * width - offset;
            let rim = solid.inside(number, turn.inverse_transform_vector(&foot));
            let gap = self.flat((width, normal, [support.0, foot]), support).filter(|_| rim > 0.0)?;
            Some(Gap { part: rim / (rim * rim + 2.0 * gap.reduced() * width).sqrt(), ..gap })
        })
    }

    /// The gap to a flat surface.
    fn flat(&self, place: (f64, Vec3, [Vec3; 2]), support: (Vec3, f64)) -> Option<Gap> {
        let across = tangents(place.1);
        Gap::new(place, &across, [Some(self.inverse_curvature(support, &across)), None])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::tests::{random, random_direction, random_turn};
    use crate::shape::{Ellipsoid, Shape};
    use rand::Rng;

    /// The least value of a function of a direction, by ever smaller steps from the best of many.
    fn least(mut best: Vec3, of: impl Fn(Vec3) -> f64) -> (f64, Vec3) {
        let mut lowest = of(best);
        for n in (0..200).map(f64::from) {
            let direction = Vec3::new(n.sin(), (1.7 * n).cos(), (2.3 * n).sin());
            let value = of(direction.normalize());
            if value < lowest {
                (lowest, best) = (value, direction.normalize());
            }
        }
        let mut reach = 0.5;
        while reach > 1e-9 {
            let across = tangents(best);
            let around = (0..8).map(|k| std::f64::consts::FRAC_PI_4 * f64::from(k));
            let near = around
                .map(|t| (best + across * Vector2::new(t.cos(), t.sin()) * reach).normalize())
                .map(|direction| (of(direction), direction))
                .min_by(|a, b| a.0.total_cmp(&b.0))
                .unwrap();
            if near.0 < lowest {
                (lowest, best) = near;
            } else {
                reach *= 0.6;
            }
        }
        (lowest, best)
    }

    #[test]
    fn the_gap_of_two_ellipsoids_in_any_pose_is_the_least_distance_of_a_point_of_one_to_the_other() {
        let mut random = random(21);
        let mut found = 0;
        for _ in 0..150 {
            let mut body = || {
                let semi_axes = Vec3::from_fn(|_, _| random.random_range(0.3..1.5));
                (Ellipsoid::new(semi_axes).unwrap(), semi_axes, random_turn(&mut random))
            };
            let [(first, axes, turn), (second, other_axes, other_turn)] = [body(), body()];
            let offset = random_direction(&mut random) * random.random_range(0.8..3.2);
            // World to the frame of the second.
            let distance =
                |point: Vec3| second.signed_distance(other_turn.inverse_transform_vector(&(point - offset)));
            let on_first = |direction: Vec3| turn * first.support(direction);
            let (width, best) = least(turn.inverse() * offset.normalize(), |d| distance(on_first(d)));
            let bodies = [Ellipsoidal::new(axes, &turn), Ellipsoidal::new(other_axes, &other_turn)];
            let gap = bodies[0].gap(&bodies[1], offset, 1.0);
            if width.abs() < 1e-6 || (width - 1.0).abs() < 1e-6 {
                continue;
            }
            let Some(gap) = gap else {
                assert!(!(0.0..1.0).contains(&width), "{width}");
                continue;
            };
            found += 1;
            assert!((gap.width - width).abs() < 1e-9, "{} {width}", gap.width);
            assert!((gap.points[0] - on_first(best)).norm() < 1e-5);
            let across = offset + gap.points[1] - gap.points[0] - gap.normal * gap.width;
            assert!(across.norm() < 1e-12, "the nearest points lie on one normal: {across}");
            assert!(distance(gap.points[0] + gap.normal * gap.width).abs() < 1e-12);
        }
        assert!(found > 50, "{found}");
    }

    #[test]
    fn the_curvature_follows_from_how_the_gap_opens_around_its_narrowest_place() {
        let mut random = random(22);
        for _ in 0..100 {
            let mut body = || {
                let semi_axes = Vec3::from_fn(|_, _| random.random_range(0.5..1.5));
                let turn = random_turn(&mut random);
                (Ellipsoid::new(semi_axes).unwrap(), turn, Ellipsoidal::new(semi_axes, &turn))
            };
            let bodies = [body(), body()];
            let Some(gap) = bodies[0].2.gap(&bodies[1].2, random_direction(&mut random) * 2.6, 2.0) else {
                continue;
            };
            let (across, wide) = (tangents(gap.normal), 1e-3);
            // Height of a body below its tangent plane, along a line at `aside`.
            let depth = |k: usize, aside: Vec3| {
                let (shape, turn, _) = &bodies[k];
                let out = if k == 0 { gap.normal } else { -gap.normal };
                let at = |depth: f64| turn.inverse() * (gap.points[k] + aside - out * depth);
                let (mut low, mut high) = (0.0, 1e-4);
                for _ in 0..60 {
                    let middle = 0.5 * (low + high);
                    if shape.signed_distance(at(middle)) > 0.0 { low = middle } else { high = middle }
                }
                low
            };
            let opening = |x: f64, y: f64| {
                let aside = across * Vector2::new(x, y) * wide;
                let both = |aside: Vec3| depth(0, aside) + depth(1, aside);
                (both(aside) + both(-aside)) / (wide * wide)
            };
            let (xx, yy) = (opening(1.0, 0.0), opening(0.0, 1.0));
            let xy = 0.25 * (opening(1.0, 1.0) - opening(1.0, -1.0));
            // The opening is twice x.K x / 2.
            let measured = Matrix2::new(xx, xy, xy, yy);
            let seen = Matrix3x2::from_columns(&gap.across).transpose() * across;
            let expected = seen * measured * seen.transpose();
            for (i, j) in [(0, 0), (0, 1), (1, 1)] {
                let found = if i == j { gap.curvatures[i] } else { 0.0 };
                assert!((found - expected[(i, j)]).abs() < 1e-4 * expected.trace(), "{found} {expected}");
            }
        }
    }

    #[test]
    fn the_gap_to_a_plane_a_pipe_and_a_rod_is_the_least_distance_of_a_point_of_the_body() {
        let mut random = random(23);
        for n in 0..90 {
            let semi_axes = Vec3::from_fn(|_, _| random.random_range(0.3..1.0));
            let (turn, axis) = (random_turn(&mut random), random_direction(&mut random));
            let side = axis.cross(&random_direction(&mut random)).normalize();
            let wall = match n % 3 {
                0 => Surface::Plane { point: -axis * 1.1, normal: axis },
                1 => Surface::Cylinder { point: side * 1.4, axis, radius: 2.6, pipe: true },
                _ => Surface::Cylinder { point: side * 2.1, axis, radius: 1.0, pipe: false },
            };
            let body = Ellipsoid::new(semi_axes).unwrap();
            let of = |direction: Vec3| wall.distance(turn * body.support(direction));
            let (width, _) = least(Vec3::x(), of);
            let gap = Ellipsoidal::new(semi_axes, &turn).gap_to_wall(&wall, 10.0).unwrap();
            assert!((gap.width - width).abs() < 1e-9, "{n}: {} {width}", gap.width);
            let foot = gap.points[0] + gap.normal * gap.width;
            assert!(wall.distance(foot).abs() < 1e-12, "{n}");
        }
    }

    #[test]
    fn ellipsoids_with_equal_axes_have_the_gap_and_the_reduced_radius_of_spheres() {
        let mut random = random(24);
        for _ in 0..100 {
            let [a, b] = [0; 2].map(|_| random.random_range(0.1..2.0));
            let bodies = [a, b].map(|r: f64| Ellipsoidal::new(Vec3::repeat(r), &random_turn(&mut random)));
            let direction = random_direction(&mut random);
            let gap = bodies[0].gap(&bodies[1], direction * (a + b + 0.01), 0.1).unwrap();
            assert!((gap.width - 0.01).abs() < 1e-14 && (gap.normal - direction).norm() < 1e-14);
            assert!((gap.reduced() * (a + b) / (a * b) - 1.0).abs() < 1e-14);
            let wall = Surface::Plane { point: direction * (a + 0.01), normal: -direction };
            let gap = bodies[0].gap_to_wall(&wall, 0.1).unwrap();
            assert!((gap.width - 0.01).abs() < 1e-14 && (gap.reduced() / a - 1.0).abs() < 1e-14);
        }
    }
}
