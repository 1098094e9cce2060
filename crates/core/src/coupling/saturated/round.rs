//! Volume fractions of cells that curved surfaces cut.

use crate::coupling::cover::{Intervals, Rows, Surface, load, store};
use crate::coupling::mapper::{HALF_DIAGONAL, Mapper};
use crate::fluid::simd::{Choose, Lanes, Registers};
use crate::fluid::volume_fraction::{LEAST, Normal, at_least, behind_plane, curved};
use crate::fluid::{GROUP, LatticeSphere, NEAR};
use crate::math::{Mat3, Vec3};

/// A sphere.
pub(super) struct SphereSurface<'a> {
    mapper: &'a Mapper,
    sphere: LatticeSphere,
}

impl<'a> SphereSurface<'a> {
    /// A sphere of this radius (m).
    pub(super) fn new(mapper: &'a Mapper, radius: f64) -> Self {
        Self { mapper, sphere: mapper.sphere(radius) }
    }
}

impl Surface for SphereSurface<'_> {
    #[inline(always)]
    fn rows<V: Registers>(&self, y: &[f64; GROUP], z: f64) -> Rows {
        let [outer, inner] = self.sphere.squares();
        let mut within = Intervals { outer: [[0.0; GROUP]; 2], inner: [[0.0; GROUP]; 2] };
        for at in (0..GROUP).step_by(V::D::WIDTH) {
            let (y, c) = (load::<f64, V::D>(y, at), |x: f64| V::D::splat(x));
            for (ends, room) in [(&mut within.outer, outer), (&mut within.inner, inner)] {
                let square = c(room - z * z) - y * y;
                let half = c(0.0).if_greater(square, c(-1.0), square.max(c(0.0)).sqrt());
                store(&mut ends[0], at, c(0.0) - half);
                store(&mut ends[1], at, half);
            }
        }
        within.rows::<V>(self.mapper.motion.centre[0])
    }

    #[inline(always)]
    fn fractions<V: Registers>(&self, n: &[f32; GROUP], y: f64, z: f64) -> [f32; GROUP] {
        let row = self.sphere.row(self.mapper.motion.centre[0], [y, z]);
        let mut fractions = [0.0; GROUP];
        for at in (0..GROUP).step_by(V::F::WIDTH) {
            store(&mut fractions, at, row.fractions(load::<f32, V::F>(n, at)));
        }
        fractions
    }
}

/// An ellipsoid.
///
/// The nearest surface point to `p` has `p - x = t grad` as in [`Ellipsoid`](crate::shape::Ellipsoid), here for several cells
/// at a time. Which cells may be cut follows from ellipsoids that hold the body grown by `g` or are held by the shrunken one: with
/// support functions `h^2 = sum a_i^2 n_i^2` and `2 h <= h^2 / c + c` for any `c`,
///
/// ```text
/// (h + g)^2 <= sum (a_i^2 + g (a_i^2 / c + c) + g^2) n_i^2,     (h - g)^2 >= sum (a_i^2 - g (a_i^2 / c + c) + g^2) n_i^2
/// ```
pub(super) struct EllipsoidSurface<'a> {
    mapper: &'a Mapper,
    /// Semi-axes, and their squares less the least (cells).
    semi_axes: [f32; 3],
    above: [f32; 3],
    /// Least square.
    least: f32,
    /// Quadratic forms (`xx`, `yy`, `zz`, `xy`, `xz`, `yz`) of the ellipsoids that hold what is covered, and are held by what is wholly
    /// solid, if anything is.
    outer: [f64; 6],
    inner: Option<[f64; 6]>,
}

impl<'a> EllipsoidSurface<'a> {
    /// An ellipsoid with these semi-axes (m).
    pub(super) fn new(mapper: &'a Mapper, semi_axes: Vec3) -> Self {
        let semi_axes: [f64; 3] = (semi_axes * mapper.per_dx).into();
        let squares = semi_axes.map(|a| a * a);
        let least = squares[0].min(squares[1]).min(squares[2]);
        let most = squares[0].max(squares[1]).max(squares[2]);
        let (g, c) = (HALF_DIAGONAL, (least * most).sqrt().sqrt());
        let form = |sign: f64| {
            let grown = squares.map(|square| square + sign * g * (square / c + c) + g * g);
            let scale = Mat3::from_diagonal(&Vec3::from(grown.map(|square| 1.0 / square)));
            let m = mapper.to_body.transpose() * scale * mapper.to_body;
            let fits = grown.iter().all(|square| *square > 0.0) && (sign > 0.0 || least > g * g);
            fits.then_some([m[(0, 0)], m[(1, 1)], m[(2, 2)], m[(0, 1)], m[(0, 2)], m[(1, 2)]])
        };
        Self {
            mapper,
            semi_axes: semi_axes.map(|a| a as f32),
            above: squares.map(|square| (square - least) as f32),
            least: least as f32,
            outer: form(1.0).expect("a larger one always is"),
            inner: form(-1.0),
        }
    }
}

/// Ends of the intervals in which `x A x <= 1` for the form, crossing if there is none.
#[inline(always)]
fn within<D: Choose<f64>>([xx, yy, zz, xy, xz, yz]: &[f64; 6], y: D, z: f64) -> [D; 2] {
    let c = |x: f64| D::splat(x);
    let b = c(*xy) * y + c(xz * z);
    let rest = (c(*yy) * y + c(2.0 * yz * z)) * y + c(zz * z * z - 1.0);
    let square = b * b - c(*xx) * rest;
    let root = c(0.0).if_greater(square, c(-1.0), square.max(c(0.0)).sqrt());
    let per = c(1.0 / xx);
    [(c(0.0) - b - root) * per, (root - b) * per]
}

impl Surface for EllipsoidSurface<'_> {
    #[inline(always)]
    fn rows<V: Registers>(&self, y: &[f64; GROUP], z: f64) -> Rows {
        let mut found = Intervals { outer: [[0.0; GROUP]; 2], inner: [[1.0; GROUP], [-1.0; GROUP]] };
        for at in (0..GROUP).step_by(V::D::WIDTH) {
            let y = load::<f64, V::D>(y, at);
            let forms = [(Some(&self.outer), &mut found.outer), (self.inner.as_ref(), &mut found.inner)];
            for (form, ends) in forms {
                if let Some(form) = form {
                    let [low, high] = within(form, y, z);
                    store(&mut ends[0], at, low);
                    store(&mut ends[1], at, high);
                }
            }
        }
        found.rows::<V>(self.mapper.motion.centre[0])
    }

    #[inline(always)]
    fn fractions<V: Registers>(&self, n: &[f32; GROUP], y: f64, z: f64) -> [f32; GROUP] {
        let c = |x: f32| V::F::splat(x);
        let (turn, centre) = (&self.mapper.to_body, c(self.mapper.motion.centre[0] as f32));
        // No `map` over arrays: what it calls is not always inlined, and then not compiled for the instruction set.
        let (above, least) = ([c(self.above[0]), c(self.above[1]), c(self.above[2])], c(self.least));
        let (mut fractions, mut deep) = ([0.0; GROUP], [0.0; GROUP]);
        for at in (0..GROUP).step_by(V::F::WIDTH) {
            let x = load::<f32, V::F>(n, at) - centre;
            let (mut point, mut pull) = ([x; 3], [x; 3]);
            // s = t + a_min^2 as in `Ellipsoid::nearest`: each term alone is 1 at the low bound at most, and the largest is.
            let mut low = c(NEAR);
            for i in 0..3 {
                point[i] = c(turn[(i, 0)] as f32) * x + c((turn[(i, 1)] * y + turn[(i, 2)] * z) as f32);
                pull[i] = point[i].size() * c(self.semi_axes[i]);
                low = low.max(pull[i] - above[i]);
            }
            if c(2.0 * NEAR).any_greater(low) {
                let mut square = c(0.0);
                for i in 0..3 {
                    let term = pull[i].over(low + above[i]);
                    square = square + term * term;
                }
                let in_plane = c(2.0 * NEAR).if_greater(low, c(1.0), c(0.0));
                store(&mut deep, at, c(1.0 - 2e-3).if_greater(square, in_plane, c(0.0)));
            }
            // From the surface, near which most are. Each cell stops by itself, so that it does not matter which are looked at together.
            let (mut s, mut moves) = (low.max(least), c(1.0));
            for _ in 0..MOST_STEPS {
                let (mut square, mut slope) = (c(0.0), c(0.0));
                for i in 0..3 {
                    let over = (s + above[i]).recip();
                    let term = pull[i] * over;
                    square = square + term * term;
                    slope = slope + (term * term) * over;
                }
                let excess = square.sqrt() - c(1.0);
                s = (s + moves * (square * excess).over(slope)).max(low);
                // The error of the next step is the square of this one.
                moves = excess.size().if_greater(c(1e-3), moves, c(0.0));
                if !moves.any_greater(c(0.0)) {
                    break;
                }
            }
            let mut gradient = point;
            for i in 0..3 {
                gradient[i] = point[i].over(s + above[i]);
            }
            let length =
                ((gradient[0] * gradient[0] + gradient[1] * gradient[1]) + gradient[2] * gradient[2]).sqrt();
            let mut m = gradient;
            for axis in 0..3 {
                let [x, y, z] =
                    [c(turn[(0, axis)] as f32), c(turn[(1, axis)] as f32), c(turn[(2, axis)] as f32)];
                m[axis] = at_least((x * gradient[0] + y * gradient[1]) + z * gradient[2], c(LEAST) * length);
            }
            // The normal is as long as the gradient.
            let distance = (s - least) * length + c(self.mapper.shift as f32);
            store(&mut fractions, at, Normal::new(m).behind(distance * length));
        }
        if deep.contains(&1.0) {
            // As good as on the plane of symmetry, with nearest points on either side.
            let exact = SmoothSurface(self.mapper).fractions::<V>(n, y, z);
            for k in 0..GROUP {
                fractions[k] = if deep[k] > 0.0 { exact[k] } else { fractions[k] };
            }
        }
        fractions
    }
}

/// Steps of Newton's method: three are usual, more are needed far within, where the fraction is one anyway.
const MOST_STEPS: usize = 12;

/// A body known by its distance only, cell by cell.
pub(super) struct SmoothSurface<'a>(pub(super) &'a Mapper);

impl Surface for SmoothSurface<'_> {
    fn rows<V: Registers>(&self, y: &[f64; GROUP], z: f64) -> Rows {
        self.0.rows(y, z)
    }

    fn fractions<V: Registers>(&self, n: &[f32; GROUP], y: f64, z: f64) -> [f32; GROUP] {
        let Mapper { shape, to_body, dx, per_dx, shift, motion, .. } = self.0;
        n.map(|n| {
            let point = to_body * (Vec3::new(f64::from(n) - motion.centre[0], y, z) * *dx);
            let distance = shape.signed_distance(point) * per_dx + shift;
            let normal: [f64; 3] = to_body.tr_mul(&shape.gradient(point)).into();
            behind_plane(distance as f32, normal.map(|x| x as f32))
        })
    }
}

/// A cylinder: what is behind its side, taken as a plane in each cell, and between its ends.
pub(super) struct CylinderSurface<'a> {
    mapper: &'a Mapper,
    /// Radius and half length (cells), as moved; the side also by its curvature.
    radius: f64,
    half: f64,
}

impl<'a> CylinderSurface<'a> {
    /// A cylinder of this radius and half length (m).
    pub(super) fn new(mapper: &'a Mapper, radius: f64, half: f64) -> Self {
        let [radius, half] = [radius, half].map(|x| x * mapper.per_dx - mapper.shift);
        Self { mapper, radius: radius - curved(1.0 / radius), half }
    }
}

impl Surface for CylinderSurface<'_> {
    fn rows<V: Registers>(&self, y: &[f64; GROUP], z: f64) -> Rows {
        self.mapper.rows(y, z)
    }

    fn fractions<V: Registers>(&self, n: &[f32; GROUP], y: f64, z: f64) -> [f32; GROUP] {
        let Mapper { to_body, motion, .. } = self.mapper;
        let axis: Vec3 = to_body.row(2).transpose();
        let end = Normal::unit([axis.x as f32, axis.y as f32, axis.z as f32]);
        n.map(|n| {
            let point = Vec3::new(f64::from(n) - motion.centre[0], y, z);
            let along = axis.dot(&point);
            let outwards = point - axis * along;
            let distance = outwards.norm();
            let (side, over) = (distance - self.radius, along.abs() - self.half);
            let (beside, beyond) = (side.max(0.0), over.max(0.0));
            if beside * beside + beyond * beyond >= HALF_DIAGONAL * HALF_DIAGONAL {
                return 0.0;
            }
            let normal: [f64; 3] = (outwards / distance.max(f64::from(NEAR))).into();
            // Normals at right angles.
            let between = end.behind(over as f32) - end.behind((along.abs() + self.half) as f32);
            between * behind_plane(side as f32, normal.map(|x| x as f32))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::coupling::tests::coupled;
    use crate::coupling::{Method, Saturated, SolidOperator};
    use crate::fluid::RigidMotion;
    use crate::fluid::simd::Single;
    use crate::math::Quat;
    use crate::shape::{Ellipsoid, Shape};
    use std::sync::Arc;

    #[test]
    fn the_fractions_of_an_ellipsoid_are_those_of_its_distance_cell_by_cell() {
        let params = coupled(Method::Saturated(Saturated::new(SolidOperator::Sc3)));
        for (axes, turn) in [
            ([6.0, 6.0, 3.0], Quat::from_euler_angles(0.3, -0.7, 1.1)),
            ([3.1, 7.9, 4.2], Quat::from_euler_angles(-1.2, 0.4, 0.2)),
            ([5.0, 5.0, 5.0], Quat::identity()),
        ] {
            let semi_axes = Vec3::from(axes) * params.units.dx;
            let shape: Arc<dyn Shape> = Arc::new(Ellipsoid::new(semi_axes).unwrap());
            let motion = RigidMotion { centre: [0.2, 0.1, -0.3], ..RigidMotion::default() };
            let mapper = Mapper::new(&shape, turn, motion, &params, 0.02);
            let (fast, exact) = (EllipsoidSurface::new(&mapper, semi_axes), SmoothSurface(&mapper));
            let (mut cut, mut worst) = (0, 0.0_f32);
            for (ny, nz) in (-10..=10).flat_map(|ny| (-10..=10).map(move |nz| (ny, nz))) {
                let (y, z) = (f64::from(ny) - 0.1, f64::from(nz) + 0.3);
                for first in [-12, -4, 4] {
                    let n = std::array::from_fn(|k| (first + k as i32) as f32);
                    let [a, b] = [fast.fractions::<Single>(&n, y, z), exact.fractions::<Single>(&n, y, z)];
                    for (a, b) in a.into_iter().zip(b) {
                        cut += usize::from(b > 0.0 && b < 1.0);
                        worst = worst.max((a - b).abs());
                    }
                }
            }
            assert!(cut > 400 && worst < 1e-4, "{axes:?}: {worst} in {cut} cut cells");
        }
    }
}
