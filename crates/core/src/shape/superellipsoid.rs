//! The superellipsoid `(|x/a|^(2/e2) + |y/b|^(2/e2))^(e2/e1) + |z/c|^(2/e1) <= 1`: from boxes with round edges (small
//! exponents) through ellipsoids (1, 1) to bodies with sharp tips (exponents near 2).
//!
//! It is the unit ball of nested norms: with `p = 2/e`, `|| (||(x/a, y/b)||_p2, z/c) ||_p1 <= 1`, the gauge. The dual
//! norm has `q = p / (p - 1)`: the support function is `|| (||(a nx, b ny)||_q2, c nz) ||_q1`.

mod nearest;

use super::error::check_size;
use super::{Shape, ShapeError, SurfaceMesh, row, surface};
use crate::math::{Quat, Vec3};
use nearest::Chart;

/// Exponents `e1` and `e2` for which the distance is found to the stated precision. Below, edges are as good as sharp;
/// from 2 on the body is not smooth or not convex.
pub const EXPONENTS: (f64, f64) = (0.2, 1.9);

/// A superellipsoid, semi-axes along the axes.
#[derive(Clone, Debug, PartialEq)]
pub struct Superellipsoid {
    semi_axes: Vec3,
    /// `2 / e1` and `2 / e2`.
    p: [f64; 2],
    volume: f64,
    inertia: Vec3,
    circumradius: f64,
    inradius: f64,
    chart: Chart,
}

impl Superellipsoid {
    /// A superellipsoid with these semi-axes (m) and exponents `e1` (towards the poles on z) and `e2` (around z).
    ///
    /// # Errors
    /// A semi-axis that is not positive and finite; an exponent outside [`EXPONENTS`].
    pub fn new(semi_axes: Vec3, exponents: [f64; 2]) -> Result<Self, ShapeError> {
        for semi_axis in &semi_axes {
            check_size("semi-axis", *semi_axis)?;
        }
        let (low, high) = EXPONENTS;
        if let Some(&value) = exponents.iter().find(|e| !(low..=high).contains(*e)) {
            return Err(ShapeError::BadExponent { value, low, high });
        }
        let p = exponents.map(|e| 2.0 / e);
        let unit = moment(p, [0.0, 0.0, 0.0]);
        let squares = semi_axes.component_mul(&semi_axes);
        let spread = Vec3::new(
            squares.x * moment(p, [2.0, 0.0, 0.0]),
            squares.y * moment(p, [0.0, 2.0, 0.0]),
            squares.z * moment(p, [0.0, 0.0, 2.0]),
        ) / unit;
        Ok(Self {
            semi_axes,
            p,
            volume: unit * semi_axes.product(),
            inertia: Vec3::repeat(spread.sum()) - spread,
            circumradius: extreme(p[0], extreme(p[1], squares.x, squares.y, true), squares.z, true).sqrt(),
            inradius: extreme(p[0], extreme(p[1], squares.x, squares.y, false), squares.z, false).sqrt(),
            chart: Chart::new(semi_axes, p),
        })
    }

    /// The gauge, 1 on the surface, and its gradient (1/m).
    fn gauge_of(&self, point: Vec3) -> (f64, Vec3) {
        let scaled = point.component_div(&self.semi_axes);
        let (rho, [to_x, to_y]) = norm(self.p[1], scaled.x.abs(), scaled.y.abs());
        let (gauge, [to_rho, to_z]) = norm(self.p[0], rho, scaled.z.abs());
        let gradient = Vec3::new(to_rho * to_x, to_rho * to_y, to_z);
        let signed = gradient.zip_map(&scaled, |g, x| if x < 0.0 { -g } else { g });
        (gauge, signed.component_div(&self.semi_axes))
    }
}

/// Largest exponent that is a multiple of a half and is found by products.
const MOST_PRODUCTS: f64 = 16.0;

/// `x^p` for `x >= 0`, by products and a square root where that is possible, which takes a tenth of the time.
fn power(x: f64, p: f64) -> f64 {
    let halves = 2.0 * p;
    if halves > 2.0 * MOST_PRODUCTS || halves.fract() != 0.0 {
        return libm::pow(x, p);
    }
    let halves = halves as u32;
    let (mut product, mut square) = (if halves % 2 == 1 { x.sqrt() } else { 1.0 }, x);
    let mut left = halves / 2;
    while left > 0 {
        if left % 2 == 1 {
            product *= square;
        }
        square *= square;
        left /= 2;
    }
    product
}

/// `x^(1/p)` for `x >= 0`.
fn root(x: f64, p: f64) -> f64 {
    match p {
        2.0 => x.sqrt(),
        4.0 => x.sqrt().sqrt(),
        8.0 => x.sqrt().sqrt().sqrt(),
        _ => libm::pow(x, 1.0 / p),
    }
}

/// `(u^p + v^p)^(1/p)` for `u, v >= 0`, and its gradient.
fn norm(p: f64, u: f64, v: f64) -> (f64, [f64; 2]) {
    let largest = u.max(v);
    if largest <= 0.0 {
        return (0.0, [0.0, 0.0]);
    }
    let (u, v) = (u / largest, v / largest);
    let powers = [power(u, p), power(v, p)];
    let sum = powers[0] + powers[1];
    let norm = root(sum, p);
    // (x / norm)^(p - 1)
    let slope = |x: f64, power: f64| if x > 0.0 { power / sum * (norm / x) } else { 0.0 };
    (largest * norm, [slope(u, powers[0]), slope(v, powers[1])])
}

/// `int |x|^i |y|^j |z|^k dV` over the body with semi-axes 1.
///
/// Dirichlet's integral over the disc of a `p`-norm, then Euler's over its height (Jaklic, Leonardis, Solina 2000,
/// "Segmentation and Recovery of Superquadrics", section 2.4).
fn moment([p1, p2]: [f64; 2], [i, j, k]: [f64; 3]) -> f64 {
    let disc =
        libm::lgamma((i + 1.0) / p2) + libm::lgamma((j + 1.0) / p2) - libm::lgamma((i + j + 2.0) / p2 + 1.0);
    let (a, b) = ((k + 1.0) / p1, (i + j + 2.0) / p1 + 1.0);
    let height = libm::lgamma(a) + libm::lgamma(b) - libm::lgamma(a + b);
    8.0 * libm::exp(disc + height) / (p2 * p2 * p1)
}

/// Greatest or least `a u^2 + b v^2` on `u^p + v^p = 1`, for positive `a` and `b`: on an axis, or, by Hoelder's
/// inequality, `(a^s + b^s)^(1/s)` with `s = p / (p - 2)`.
fn extreme(p: f64, a: f64, b: f64, greatest: bool) -> f64 {
    let between = if greatest { p > 2.0 } else { p < 2.0 };
    let (low, high) = (a.min(b), a.max(b));
    if !between {
        return if greatest { high } else { low };
    }
    let s = p / (p - 2.0);
    // The term that counts most taken out: s is huge where the body is nearly an ellipsoid.
    let (main, other) = if greatest { (high, low) } else { (low, high) };
    main * libm::pow(1.0 + libm::pow(other / main, s), 1.0 / s)
}

impl Shape for Superellipsoid {
    fn kind(&self) -> &'static str {
        "superellipsoid"
    }

    fn as_ellipsoid(&self) -> Option<Vec3> {
        self.p.iter().all(|p| p.to_bits() == 2.0_f64.to_bits()).then_some(self.semi_axes)
    }

    fn volume(&self) -> f64 {
        self.volume
    }

    fn inertia_per_mass(&self) -> Vec3 {
        self.inertia
    }

    fn circumradius(&self) -> f64 {
        self.circumradius
    }

    /// The body is symmetric about its centre, so the thinnest way through goes through the inscribed sphere.
    fn thickness(&self) -> f64 {
        2.0 * self.inradius
    }

    /// The height above a supporting plane, which is never more than the distance, nor less by more than 1e-9 of
    /// the largest semi-axis.
    fn signed_distance(&self, point: Vec3) -> f64 {
        self.chart.nearest(point).0
    }

    fn gradient(&self, point: Vec3) -> Vec3 {
        self.chart.nearest(point).1
    }

    fn distance_and_gradient(&self, point: Vec3) -> (f64, Vec3) {
        self.chart.nearest(point)
    }

    fn gauge(&self, point: Vec3) -> Option<(f64, Vec3)> {
        Some(self.gauge_of(point))
    }

    fn support(&self, direction: Vec3) -> Vec3 {
        let q = self.p.map(|p| p / (p - 1.0));
        let pull = (direction / direction.amax()).component_mul(&self.semi_axes);
        let (in_plane, [x, y]) = norm(q[1], pull.x.abs(), pull.y.abs());
        let (_, [rho, z]) = norm(q[0], in_plane, pull.z.abs());
        let found = Vec3::new(rho * x, rho * y, z).component_mul(&self.semi_axes);
        found.zip_map(&pull, |x, pull| if pull < 0.0 { -x } else { x })
    }

    /// The line in the body scaled so that its inscribed sphere grows by `growth`: scaled up by `1 + g / r` it
    /// holds the grown body, scaled down it is within the shrunk one. At the ends of an axis `a` that is longer, or
    /// shorter, by `g (a / r - 1)`.
    fn row_interval(&self, orientation: &Quat, y: f64, z: f64, growth: f64) -> Option<(f64, f64)> {
        let level = 1.0 + growth / self.inradius;
        if level <= 0.0 {
            return None;
        }
        let bracket = row::Clip::ball(self.circumradius * level, y, z)?;
        let line = row::Line::new(orientation, y, z);
        let gauge = |x: f64| {
            let (value, gradient) = self.gauge_of(line.at(x));
            (value, gradient.dot(&line.direction))
        };
        row::convex(gauge, bracket, level, growth < 0.0, 1e-9 * self.inradius)
    }

    /// Icosahedron, each triangle split in four `refinement` times, its points moved to the surface along the radius.
    fn surface_mesh(&self, refinement: u32) -> SurfaceMesh {
        surface::icosphere(refinement, |point| {
            let stretched = point.component_mul(&self.semi_axes);
            stretched / self.gauge_of(stretched).0
        })
    }
}
