//! The box about the overlap of two ellipsoids, or of grown ones.
//!
//! With `q_i = (x - c_i) . A_i (x - c_i)`, every ellipsoid `l q_1 + (1 - l) q_2 <= 1`, `0 <= l <= 1`, holds the overlap, and the
//! lowest of their furthest points along a direction is that of the overlap (the dual of a convex problem, which has no gap). It
//! has `q_1 = q_2`, or is that of one ellipsoid and in the other. The ellipsoid with `q_1 = q_2` at its own centre is nearly the
//! smallest, and empty if they are apart (Perram and Wertheim 1985, J. Comput. Phys. 58, 409).
//!
//! A grown ellipsoid is replaced by one that holds it and touches it along the normal.

use super::frame::{Frame, about, axes};
use super::side::Side;
use crate::math::nalgebra::{Cholesky, Const};
use crate::math::{Mat3, Vec3};
use crate::shape::Ellipsoid;

/// Limit on `q_1 - q_2` at a furthest point, relative to the half width of the ellipsoid: its height is right to the square of this.
const TIGHT: f64 = 0.02;
/// Most ellipsoids tried for a direction; each holds the overlap.
const STEPS: u32 = 20;

/// An ellipsoid.
struct Quadric {
    centre: Vec3,
    /// `A` (1/m^2).
    form: Mat3,
    /// Its inverse (m^2).
    inverse: Mat3,
}

impl Quadric {
    fn around(side: &Side, normal: Vec3) -> Option<Self> {
        let Side::Body { shape, to_body, centre, growth, .. } = side else { return None };
        let squares = match (shape.as_sphere(), shape.as_ellipsoid()) {
            (Some(radius), _) if radius + growth > 0.0 => Vec3::repeat((radius + growth) * (radius + growth)),
            (_, Some(semi_axes)) if *growth >= 0.0 => {
                let reach = (to_body * normal).component_mul(&semi_axes).norm();
                Ellipsoid::around(semi_axes.component_mul(&semi_axes), *growth, reach)
            }
            _ => return None,
        };
        let turned = |squares: Vec3| to_body.tr_mul(&Mat3::from_diagonal(&squares)) * to_body;
        let inverse = turned(squares);
        Some(Self { centre: *centre, form: turned(squares.map(f64::recip)), inverse })
    }

    fn value(&self, at: Vec3) -> f64 {
        let arm = at - self.centre;
        arm.dot(&(self.form * arm))
    }

    /// The furthest point along a direction, the centre if that is zero.
    fn furthest(&self, along: Vec3) -> Vec3 {
        self.centre + reach(self.inverse * along, along, 1.0)
    }
}

/// The furthest point from the centre, with the product of the inverse form and the direction.
fn reach(product: Vec3, along: Vec3, left: f64) -> Vec3 {
    let square = along.dot(&product);
    if square > 0.0 { product * (left / square).sqrt() } else { Vec3::zeros() }
}

/// Two ellipsoids and those between them.
pub(super) struct Pencil([Quadric; 2]);

impl Pencil {
    /// For sides that are ellipsoids.
    pub(super) fn new([first, second]: [&Side; 2], normal: Vec3) -> Option<Self> {
        Some(Self([Quadric::around(first, normal)?, Quadric::around(second, normal)?]))
    }

    /// Box about the overlap, the third axis along `normal`; `None` if there is no overlap.
    pub(super) fn frame(&self, normal: Vec3) -> Option<Frame> {
        let (middle, _) = self.lowest(Vec3::zeros(), 0.5)?;
        let axes = axes(normal, self.longest(middle, &about(normal))?);
        let (mut lo, mut hi) = (Vec3::zeros(), Vec3::zeros());
        for n in 0..3 {
            let axis: Vec3 = axes.column(n).into();
            hi[n] = self.lowest(axis, middle)?.1;
            lo[n] = -self.lowest(-axis, middle)?.1;
        }
        Frame::new(axes, lo, hi)
    }

    /// The matrix of an ellipsoid of the pencil, its centre, and 1 minus the value there.
    fn member(&self, l: f64) -> Option<(Cholesky<f64, Const<3>>, Vec3, f64)> {
        let [first, second] = &self.0;
        let form = Cholesky::new(first.form * l + second.form * (1.0 - l))?;
        let pull = first.form * first.centre * l + second.form * second.centre * (1.0 - l);
        let centre = form.solve(&pull);
        let left = 1.0 - l * first.value(centre) - (1.0 - l) * second.value(centre);
        (left > 0.0).then_some((form, centre, left))
    }

    /// The direction across the normal in which an ellipsoid of the pencil reaches furthest.
    fn longest(&self, l: f64, axes: &Mat3) -> Option<Vec3> {
        let form = self.member(l)?.0;
        let [u, v] = [0, 1].map(|n| Vec3::from(axes.column(n)));
        let to_v = form.solve(&v);
        let (difference, twist) = (u.dot(&form.solve(&u)) - v.dot(&to_v), 2.0 * u.dot(&to_v));
        let length = Vec3::new(difference, twist, 0.0).norm();
        // Half the angle of (difference, twist).
        let along = if difference >= 0.0 {
            u * (length + difference) + v * twist
        } else {
            u * twist + v * (length - difference)
        };
        Some(along.try_normalize(0.0).unwrap_or(u))
    }

    /// The lowest furthest point along a direction by Illinois' method, from the ellipsoid `guess`: that ellipsoid and the height (m).
    fn lowest(&self, along: Vec3, guess: f64) -> Option<(f64, f64)> {
        let [first, second] = &self.0;
        let x = first.furthest(along);
        let mut high = (1.0, first.value(x) - second.value(x));
        if high.1 >= 0.0 {
            return Some((1.0, along.dot(&x)));
        }
        let x = second.furthest(along);
        let mut low = (0.0, first.value(x) - second.value(x));
        if low.1 <= 0.0 {
            return Some((0.0, along.dot(&x)));
        }
        let (mut l, mut height, mut last) = (guess, f64::INFINITY, None);
        for _ in 0..STEPS {
            let (form, centre, left) = self.member(l)?;
            let x = centre + reach(form.solve(&along), along, left);
            height = height.min(along.dot(&x));
            let difference = first.value(x) - second.value(x);
            if difference.abs() <= TIGHT * left.sqrt() {
                break;
            }
            let is_low = difference > 0.0;
            let (end, other) = if is_low { (&mut low, &mut high) } else { (&mut high, &mut low) };
            *end = (l, difference);
            if last.replace(is_low) == Some(is_low) {
                other.1 *= 0.5;
            }
            l = (low.0 * high.1 - high.0 * low.1) / (high.1 - low.1);
        }
        Some((l, height))
    }
}
