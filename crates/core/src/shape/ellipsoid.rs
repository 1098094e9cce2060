//! The ellipsoid, with its true distance.
//!
//! The nearest surface point `x` to `p` has `p - x = t grad`, with `grad_i = x_i / a_i^2`, so
//! `x_i = a_i^2 p_i / (t + a_i^2)`, where `t > -a_min^2` is the largest root of
//! `S(t) = sum (a_i p_i / (t + a_i^2))^2 = 1` (Eberly 2013, "Distance from a point to an ellipse, an ellipsoid, or a
//! hyperellipsoid", section 3). The signed distance is `t
//! |grad|`, which loses no digits near the surface. `1 / sqrt(S)` is concave and rising, so Newton's method for `1 /
//! sqrt(S) = 1`, from a `t` with `S >= 1`, rises to the root without passing it, and from any other falls below it first. From
//! `t = 0` it needs two steps near the surface.

use super::error::check_size;
use super::{Shape, ShapeError, SurfaceMesh, row, surface};
use crate::math::{Quat, Vec3};
use std::f64::consts::PI;

/// An ellipsoid, semi-axes along the axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ellipsoid {
    semi_axes: Vec3,
    squares: Vec3,
    /// Of the semi-axes (m).
    geometric_mean: f64,
}

impl Ellipsoid {
    /// An ellipsoid with these semi-axes (m).
    ///
    /// # Errors
    /// A semi-axis that is not positive and finite.
    pub fn new(semi_axes: Vec3) -> Result<Self, ShapeError> {
        for semi_axis in &semi_axes {
            check_size("semi-axis", *semi_axis)?;
        }
        let squares = semi_axes.component_mul(&semi_axes);
        Ok(Self { semi_axes, squares, geometric_mean: libm::cbrt(semi_axes.product()) })
    }

    /// Squares of the semi-axes (m^2) of an ellipsoid that holds one with these `squares` grown by `growth >= 0` (m).
    ///
    /// For any `beta > 0` that is the one with `(1 + beta) a_i^2 + (1 + 1/beta) g^2` (Kurzhanski and Valyi 1997, section 2.2). It touches
    /// where `beta = g / a_i`; `beta` is taken from a `mean` of the semi-axes (m), exact for spheres, longer by
    /// `g / 2 (m / a_i + a_i / m - 2)` on the axes.
    pub(crate) fn around(squares: Vec3, growth: f64, mean: f64) -> Vec3 {
        let beta = growth / mean;
        // growth / beta, also where both are zero
        squares.map(|square| (1.0 + beta) * square + growth * (growth + mean))
    }

    /// The `t` of the head of this module, and `x_i / a_i^2` of the nearest surface point.
    #[inline]
    fn nearest(&self, point: Vec3) -> (f64, Vec3) {
        let least = self.squares.min();
        // In terms of s = t + a_min^2, which keeps its digits near the pole at s = 0.
        let above = self.squares.map(|square| square - least);
        let pull = point.abs().component_mul(&self.semi_axes);
        let terms =
            |s: f64| pull.zip_map(&above, |pull, above| if pull > 0.0 { pull / (s + above) } else { 0.0 });
        // Below the root: each term alone is 1 here at most, and the largest is.
        let low = (pull - above).max().max(0.0);
        let at_pole = terms(low);
        let mut s = low;
        let grad = if low == 0.0 && at_pole.norm_squared() < 1.0 {
            // Deep inside, in the plane of symmetry: the nearest points lie off that plane, one on either side.
            let shortest = self.semi_axes.imin();
            let mut on_unit_sphere = at_pole;
            on_unit_sphere[shortest] = (1.0 - at_pole.norm_squared()).sqrt();
            on_unit_sphere.component_div(&self.semi_axes)
        } else {
            s = low.max(least);
            for _ in 0..60 {
                let term = terms(s);
                let root = term.norm();
                let slope: f64 = (0..3)
                    .map(|i| if pull[i] > 0.0 { term[i] * term[i] / (s + above[i]) } else { 0.0 })
                    .sum();
                s = (s + root * root * (root - 1.0) / slope).max(low);
                // The error of the next step is the square of this one.
                if (root - 1.0).abs() < 1e-10 {
                    break;
                }
            }
            terms(s).component_div(&self.semi_axes)
        };
        (s - least, grad.zip_map(&point, |g, p| if p < 0.0 { -g } else { g }))
    }
}

impl Shape for Ellipsoid {
    fn kind(&self) -> &'static str {
        "ellipsoid"
    }

    fn as_ellipsoid(&self) -> Option<Vec3> {
        Some(self.semi_axes)
    }

    fn volume(&self) -> f64 {
        4.0 / 3.0 * PI * self.semi_axes.product()
    }

    fn inertia_per_mass(&self) -> Vec3 {
        let s = self.squares;
        Vec3::new(s.y + s.z, s.z + s.x, s.x + s.y) * 0.2
    }

    fn circumradius(&self) -> f64 {
        self.semi_axes.max()
    }

    fn thickness(&self) -> f64 {
        2.0 * self.semi_axes.min()
    }

    #[inline]
    fn signed_distance(&self, point: Vec3) -> f64 {
        let (t, grad) = self.nearest(point);
        t * grad.norm()
    }

    fn gradient(&self, point: Vec3) -> Vec3 {
        self.nearest(point).1.normalize()
    }

    fn distance_and_gradient(&self, point: Vec3) -> (f64, Vec3) {
        let (t, grad) = self.nearest(point);
        let length = grad.norm();
        (t * length, grad / length)
    }

    fn gauge(&self, point: Vec3) -> Option<(f64, Vec3)> {
        let gauge = point.component_div(&self.semi_axes).norm();
        let gradient = point.component_div(&self.squares) / gauge;
        Some((gauge, if gauge > 0.0 { gradient } else { Vec3::zeros() }))
    }

    fn support(&self, direction: Vec3) -> Vec3 {
        // Scaled first: squares of tiny lengths would vanish.
        let stretched = (direction / direction.amax()).component_mul(&self.semi_axes);
        stretched.component_mul(&self.semi_axes) / stretched.norm()
    }

    fn bounds(&self, orientation: &Quat) -> (Vec3, Vec3) {
        let turn = orientation.to_rotation_matrix().into_inner();
        let high = Vec3::from_fn(|i, _| turn.row(i).transpose().component_mul(&self.semi_axes).norm());
        (-high, high)
    }

    /// The line in an ellipsoid that holds the grown body ([`around`](Self::around), by the geometric mean of the semi-axes), or that
    /// the grown body holds.
    #[inline]
    fn row_interval(&self, orientation: &Quat, y: f64, z: f64, growth: f64) -> Option<(f64, f64)> {
        let squares = if growth >= 0.0 {
            Self::around(self.squares, growth, self.geometric_mean)
        } else {
            let rest = self.geometric_mean + growth;
            if rest <= 0.0 {
                return None;
            }
            // The same with the shrunk body as the one that grows: beta = g / (m - g).
            let beta = -growth / rest;
            self.squares.map(|square| (square + growth * self.geometric_mean) / (1.0 + beta))
        };
        if squares.min() <= 0.0 {
            return None;
        }
        let line = row::Line::new(orientation, y, z);
        let (o, d) = (line.origin, line.direction);
        let (mut a, mut b, mut c) = (0.0, 0.0, -1.0);
        for i in 0..3 {
            let weight = 1.0 / squares[i];
            a += d[i] * d[i] * weight;
            b += o[i] * d[i] * weight;
            c += o[i] * o[i] * weight;
        }
        row::quadratic(a, b, c)
    }

    /// Icosahedron, each triangle split in four `refinement` times, stretched.
    fn surface_mesh(&self, refinement: u32) -> SurfaceMesh {
        surface::icosphere(refinement, |point| point.component_mul(&self.semi_axes))
    }
}
