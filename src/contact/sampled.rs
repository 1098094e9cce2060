//! The overlap of two convex bodies by samples: the scheme of Marquardt et al. (2024).
//!
//! Only signed distances are asked for, so it serves every shape; it costs some 70 000 of them per contact and its
//! force scatters by several per cent. Three steps:
//!
//! 1. **start**: the box of the lens of the two circumscribed spheres (the paper takes the lattice nodes near both
//!    bodies; ours needs no lattice and keeps no box from step to step, so no contact is lost or late);
//! 2. **tighten**: from every point on the surface of the grid in the box, rays run inwards to the 26 neighbours;
//!    the places where they meet the surface of the overlap span the new box;
//! 3. **integrate** over the points of a grid in that box, one more layer all round: points in both bodies give
//!    volume and centre, the others the normal; the depth is the length of rays along the normal through the centre.
//!
//! An overlap thinner than the spacing may fall between all rays or all points; then there is no contact, as there.
//!
//! Points are whole multiples of the spacings, counted from the centre of the first body.
//!
//! # Reference
//! Marquardt, Hafen, Krause (2024), doi:10.1016/j.cpc.2024.109321, sections 2.3 and 3.

use super::{Body, Overlap, sphere_sphere};
use crate::math::{Mat3, Vec3};

/// Samples per direction, `N_c`, where nothing else is said.
pub const DEFAULT_SAMPLES: u32 = 8;

/// Precision of a ray in parts of the spacing.
const RAY_PRECISION: f64 = 0.01;
/// Steps after which a grazing ray is given up.
const RAY_STEPS: u32 = 200;
/// Spacing of the differences that give a gradient, in parts of the spacing of the samples.
const GRADIENT_STEP: f64 = 1e-4;
/// The thinnest box, in parts of its longest edge.
const THINNEST: f64 = 1e-3;

/// Overlap of two bodies by `samples` points per direction.
///
/// `offset` (m) is the centre of the second body relative to the first.
pub fn overlap(first: &Body, second: &Body, offset: Vec3, samples: u32) -> Option<Overlap> {
    let enlargement = first.contour.enlargement;
    let pair = Pair {
        first: Placed::new(first, Vec3::zeros(), enlargement),
        second: Placed::new(second, offset, enlargement),
        enlargement,
    };
    let start = lens_box(first.contour.reach(), second.contour.reach(), offset)?;
    let tight = tightened(&pair, &Grid::new(&start, samples, 0)?)?;
    integrate(&pair, &Grid::new(&tight, samples, 1)?)
}

/// A body in its place.
struct Placed<'a> {
    body: &'a Body<'a>,
    to_body: Mat3,
    centre: Vec3,
    enlargement: f64,
}

impl<'a> Placed<'a> {
    fn new(body: &'a Body<'a>, centre: Vec3, enlargement: f64) -> Self {
        let to_body = body.orientation.to_rotation_matrix().into_inner().transpose();
        Self {
            body,
            to_body,
            centre,
            enlargement,
        }
    }

    /// Distance to the enlarged surface (m), negative inside.
    fn distance(&self, point: Vec3) -> f64 {
        self.body
            .contour
            .shape
            .signed_distance(self.to_body * (point - self.centre))
            - self.enlargement
    }

    /// Outward unit normal of the level set through `point`, by central differences of `step` (m).
    fn normal(&self, point: Vec3, step: f64) -> Option<Vec3> {
        let gradient = Vec3::from_fn(|i, _| {
            let shift = Vec3::ith(i, step);
            self.distance(point + shift) - self.distance(point - shift)
        });
        let norm = gradient.norm();
        (norm > 0.0).then(|| gradient / norm)
    }
}

struct Pair<'a> {
    first: Placed<'a>,
    second: Placed<'a>,
    enlargement: f64,
}

impl Pair<'_> {
    /// Signed distance to the overlap (m): a lower bound outside, exact inside.
    fn distance(&self, point: Vec3) -> f64 {
        self.first.distance(point).max(self.second.distance(point))
    }
}

/// A box by its corners (m).
struct Bounds {
    lo: Vec3,
    hi: Vec3,
}

impl Bounds {
    fn nothing() -> Self {
        Self {
            lo: Vec3::repeat(f64::INFINITY),
            hi: Vec3::repeat(f64::NEG_INFINITY),
        }
    }

    fn include(&mut self, point: Vec3) {
        self.lo = self.lo.inf(&point);
        self.hi = self.hi.sup(&point);
    }
}

/// A box that holds the lens of two spheres: that of the cylinder round the lens, as long as it is deep.
fn lens_box(a: f64, b: f64, offset: Vec3) -> Option<Bounds> {
    let lens = sphere_sphere::overlap(a, b, offset)?;
    let distance = offset.norm();
    let whole = distance <= (a - b).abs() || lens.depth >= 2.0 * a.min(b);
    let (middle, half) = if whole {
        (lens.point, Vec3::repeat(a.min(b)))
    } else {
        // The plane of the circle in which the spheres meet lies at `plane` from the first centre.
        let plane = 0.5 * (distance + (a - b) * (a + b) / distance);
        // Past the centre of the smaller sphere the lens bulges to its equator.
        let radius = if plane < 0.0 {
            a
        } else if plane > distance {
            b
        } else {
            (a * a - plane * plane).max(0.0).sqrt()
        };
        let middle = lens.normal * (a - 0.5 * lens.depth);
        let half = lens
            .normal
            .map(|n| 0.5 * lens.depth * n.abs() + radius * (1.0 - n * n).max(0.0).sqrt());
        (middle, half)
    };
    Some(Bounds {
        lo: middle - half,
        hi: middle + half,
    })
}

/// Points at whole multiples of the spacing, `lo..=hi` in each direction.
struct Grid {
    spacing: Vec3,
    lo: [i64; 3],
    hi: [i64; 3],
}

impl Grid {
    /// Grid of `samples` spacings across a box and `layers` more on every side; `None` for an empty box.
    fn new(bounds: &Bounds, samples: u32, layers: i64) -> Option<Self> {
        let extent = bounds.hi - bounds.lo;
        let longest = extent.max();
        if !(longest > 0.0 && longest.is_finite()) {
            return None;
        }
        let spacing = extent.map(|e| e.max(THINNEST * longest) / f64::from(samples.max(1)));
        let index = |i: usize, x: f64| x / spacing[i];
        Some(Self {
            lo: std::array::from_fn(|i| index(i, bounds.lo[i]).floor() as i64 - layers),
            hi: std::array::from_fn(|i| index(i, bounds.hi[i]).ceil() as i64 + layers),
            spacing,
        })
    }

    fn point(&self, [i, j, k]: [i64; 3]) -> Vec3 {
        Vec3::new(i as f64, j as f64, k as f64).component_mul(&self.spacing)
    }

    fn for_each(&self, mut visit: impl FnMut([i64; 3])) {
        for k in self.lo[2]..=self.hi[2] {
            for j in self.lo[1]..=self.hi[1] {
                for i in self.lo[0]..=self.hi[0] {
                    visit([i, j, k]);
                }
            }
        }
    }

    /// Whether the point has all its neighbours in the grid.
    fn is_interior(&self, index: [i64; 3]) -> bool {
        (0..3).all(|a| self.lo[a] < index[a] && index[a] < self.hi[a])
    }
}

/// Distance (m) from `from` along the unit vector `along` to the zero of `distance`, by sphere tracing; `None` beyond
/// `limit`.
fn trace(distance: impl Fn(Vec3) -> f64, from: Vec3, along: Vec3, precision: f64, limit: f64) -> Option<f64> {
    let mut s = distance(from);
    // A step too far changes the sign, and the next one goes back.
    let side = s.signum();
    let mut length = 0.0;
    for _ in 0..RAY_STEPS {
        if s.abs() <= precision {
            return Some(length);
        }
        length += side * s;
        if length.is_nan() || length > limit {
            return None;
        }
        s = distance(from + along * length);
    }
    None
}

/// The box of the places where rays from the surface of the grid inwards meet the surface of the overlap.
fn tightened(pair: &Pair, grid: &Grid) -> Option<Bounds> {
    let mut bounds = Bounds::nothing();
    let precision = RAY_PRECISION * grid.spacing.min();
    let limit = (grid.point(grid.hi) - grid.point(grid.lo)).norm();
    grid.for_each(|index| {
        if grid.is_interior(index) {
            return;
        }
        let from = grid.point(index);
        for neighbour in 0..27_i64 {
            let step = [neighbour % 3 - 1, neighbour / 3 % 3 - 1, neighbour / 9 - 1];
            if !grid.is_interior(std::array::from_fn(|a| index[a] + step[a])) {
                continue;
            }
            let along = Vec3::from_fn(|a, _| step[a] as f64).normalize();
            if let Some(length) = trace(|x| pair.distance(x), from, along, precision, limit) {
                bounds.include(from + along * length);
            }
        }
    });
    (bounds.lo.x <= bounds.hi.x).then_some(bounds)
}

/// Volume, centre, normal and depth by sums over the points of the grid.
fn integrate(pair: &Pair, grid: &Grid) -> Option<Overlap> {
    let h = grid.spacing;
    let area = Vec3::new(h.y * h.z, h.x * h.z, h.x * h.y);
    let step = GRADIENT_STEP * h.mean();
    let (mut inside, mut centre, mut normal) = (0_u32, Vec3::zeros(), Vec3::zeros());
    grid.for_each(|index| {
        let point = grid.point(index);
        if pair.distance(point) <= 0.0 {
            inside += 1;
            centre += point;
            return;
        }
        // Points whose neighbour towards a body lies in it: a layer on its surface, and all of its inside.
        for (body, sign) in [(&pair.first, 1.0), (&pair.second, -1.0)] {
            if let Some(n) = body.normal(point, step)
                && body.distance(point - n.component_mul(&h)) <= 0.0
            {
                normal += n * (sign * area.dot(&n.component_mul(&n)));
            }
        }
    });
    let norm = normal.norm();
    if inside == 0 || norm == 0.0 {
        return None;
    }
    let (centre, normal) = (centre / f64::from(inside), normal / norm);
    let depth = depth(pair, centre, normal, h);
    (depth > 0.0).then(|| Overlap {
        volume: f64::from(inside) * h.product(),
        depth,
        point: centre,
        normal,
        area: 0.0,
        moment: Vec3::zeros(),
    })
}

/// Thickness of the overlap along `normal` through `centre` (m): one ray to each true surface, from the point by which
/// the enlargement is taken back. A ray that finds nothing counts as zero.
fn depth(pair: &Pair, centre: Vec3, normal: Vec3, spacing: Vec3) -> f64 {
    let precision = RAY_PRECISION * (normal.component_mul(&spacing).norm_squared() / 3.0).sqrt();
    [(&pair.first, 1.0), (&pair.second, -1.0)]
        .into_iter()
        .map(|(body, sign)| {
            let along = normal * sign;
            let from = centre - along * pair.enlargement;
            let true_surface = |x| body.distance(x) + body.enlargement;
            let limit = 3.0 * body.body.contour.shape.circumradius();
            trace(true_surface, from, along, precision, limit).unwrap_or(0.0)
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::Contour;
    use crate::math::Quat;
    use crate::shape::Sphere;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use std::sync::Arc;

    /// Mean and standard deviation of sampled over exact: volume, depth, and `sqrt(V d)` (the force), and the mean
    /// angle between the normals (degrees), over random directions, and the share of contacts not seen. Lengths in cells.
    fn compare(radius: f64, deep: f64, enlargement: f64) -> ([f64; 3], [f64; 3], f64, f64) {
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let contour = Contour::new(Arc::new(Sphere { radius }), enlargement);
        let body = Body {
            contour: &contour,
            orientation: Quat::identity(),
        };
        let (mut sum, mut squares, mut angle, mut seen) = ([0.0; 3], [0.0; 3], 0.0, 0.0);
        let runs = 60;
        for _ in 0..runs {
            let direction = loop {
                let v = Vec3::from_fn(|_, _| random.random_range(-1.0..1.0));
                if (0.1..1.0).contains(&v.norm()) {
                    break v.normalize();
                }
            };
            let offset = direction * (2.0 * (radius + enlargement) - deep);
            let exact = sphere_sphere::overlap(radius + enlargement, radius + enlargement, offset).unwrap();
            let Some(sampled) = overlap(&body, &body, offset, 8) else {
                continue;
            };
            seen += 1.0;
            let ratios = [
                sampled.volume / exact.volume,
                sampled.depth / exact.depth,
                (sampled.volume * sampled.depth / (exact.volume * exact.depth)).sqrt(),
            ];
            for (i, ratio) in ratios.into_iter().enumerate() {
                sum[i] += ratio;
                squares[i] += ratio * ratio;
            }
            angle += sampled
                .normal
                .dot(&exact.normal)
                .clamp(-1.0, 1.0)
                .acos()
                .to_degrees();
            assert!(
                (sampled.point - exact.point).norm() < (radius * deep).sqrt(),
                "outside the lens"
            );
        }
        let mean = sum.map(|s| s / seen);
        let deviation = std::array::from_fn(|i| (squares[i] / seen - mean[i] * mean[i]).max(0.0).sqrt());
        (mean, deviation, angle / seen, 1.0 - seen / f64::from(runs))
    }

    #[test]
    fn sampled_spheres_agree_with_the_lens_as_well_as_the_reference_code_does() {
        // Radius and depth in cells; bands on mean and deviation of the force, on the normal, and on the contacts not
        // seen. The reference code, measured: 0.93 +- 0.13 at depth 0.02, 0.99 +- 0.04 at 0.1, 1.00 +- 0.015 at 0.8,
        // mean angles of 1 to 7 degrees, 15 to 25 % unseen at 0.02. Ours: 1.00 +- 0.14, 1.00 +- 0.05 (0.08 at the
        // larger radius), 1.00 +- 0.013, the same angles, 3 % unseen.
        for (radius, deep, mean_band, deviation_band, degrees, unseen) in [
            (4.5, 0.02, 0.1, 0.15, 2.0, 0.25),
            (4.5, 0.1, 0.04, 0.06, 3.0, 0.0),
            (4.5, 0.8, 0.03, 0.04, 10.0, 0.0),
            (9.0, 0.1, 0.04, 0.1, 3.0, 0.0),
            (9.0, 0.8, 0.03, 0.04, 7.0, 0.0),
        ] {
            let (mean, deviation, angle, lost) = compare(radius, deep, 0.2);
            assert!(
                lost <= unseen,
                "{lost} of the contacts unseen at {radius}, {deep}"
            );
            assert!(
                (mean[2] - 1.0).abs() < mean_band,
                "force at {radius}, {deep}: {mean:?}"
            );
            assert!(
                deviation[2] < deviation_band,
                "force at {radius}, {deep}: {deviation:?}"
            );
            assert!(
                (mean[1] - 1.0).abs() < 0.05,
                "depth at {radius}, {deep}: {mean:?}"
            );
            assert!(
                (mean[0] - 1.0).abs() < 0.1,
                "volume at {radius}, {deep}: {mean:?}"
            );
            assert!(angle < degrees, "normal at {radius}, {deep}: {angle}");
        }
    }

    #[test]
    fn more_samples_come_closer_to_the_lens() {
        let contours = [1.0, 0.6].map(|radius| Contour::new(Arc::new(Sphere { radius }), 0.0));
        let [first, second] = contours.each_ref().map(|contour| Body {
            contour,
            orientation: Quat::identity(),
        });
        let offset = Vec3::new(0.7, 0.9, -0.5);
        let exact = sphere_sphere::overlap(1.0, 0.6, offset).unwrap();
        let error = |samples| {
            let sampled = overlap(&first, &second, offset, samples).unwrap();
            (sampled.volume / exact.volume - 1.0).abs()
        };
        assert!(
            error(40) < 0.01 && error(40) < error(8),
            "{} {}",
            error(8),
            error(40)
        );
    }

    #[test]
    fn bodies_apart_do_not_touch() {
        let contour = Contour::new(Arc::new(Sphere { radius: 1.0 }), 0.0);
        let body = Body {
            contour: &contour,
            orientation: Quat::identity(),
        };
        assert!(overlap(&body, &body, Vec3::new(1.5, 1.5, 0.0), 8).is_none());
    }
}
