//! A side of a sampled contact, known by distance and gradient, and its gauge if that has a formula: a body in its pose, or a wall.

use crate::contact::clip::Plane;
use crate::contact::overlap::Body;
use crate::contact::solid::Solid;
use crate::math::{Mat3, Vec3};
use crate::shape::{Ellipsoid, Shape};
use crate::wall::Surface;

/// Steps of the secant method after which a grazing line is given up.
const STEPS: u32 = 40;

/// Planes tried before distances are: enough where the growth is less than the radii of curvature.
const PLANES: u32 = 8;

/// A straight line, `from + along t` (m).
#[derive(Clone, Copy, Debug)]
pub(super) struct Line {
    pub from: Vec3,
    /// Unit vector.
    pub along: Vec3,
}

impl Line {
    pub(super) fn at(&self, t: f64) -> Vec3 {
        self.from + self.along * t
    }
}

/// Part of a line inside a side: one interval or, outside of a pipe, two.
pub(super) type Intervals = [Option<(f64, f64)>; 2];

/// A body or a wall, world axes, from the centre of the first body.
pub(super) enum Side<'a> {
    /// A convex body grown by an enlargement.
    Body {
        shape: &'a dyn Shape,
        to_body: Mat3,
        centre: Vec3,
        growth: f64,
        /// Its faces if it has only flat ones.
        solid: Option<&'a Solid>,
        /// A quicker way to its chords than distances.
        chords: Option<Chords>,
    },
    Wall(Surface),
}

impl<'a> Side<'a> {
    pub(super) fn body(body: &'a Body<'a>, centre: Vec3) -> Self {
        let (shape, growth) = (body.grown.shape.as_ref(), body.grown.enlargement);
        Self::Body {
            shape,
            to_body: body.rotation().transpose(),
            centre,
            growth,
            solid: body.grown.solid(),
            chords: Chords::new(shape, growth),
        }
    }

    /// Signed distance to the surface (m), negative inside.
    pub(super) fn distance(&self, at: Vec3) -> f64 {
        match self {
            Self::Body { shape, to_body, centre, growth, .. } => {
                shape.signed_distance(to_body * (at - centre)) - growth
            }
            Self::Wall(surface) => surface.distance(at),
        }
    }

    /// Gradient of the distance, outwards.
    pub(super) fn gradient(&self, at: Vec3) -> Vec3 {
        match self {
            Self::Body { shape, to_body, centre, .. } => {
                to_body.tr_mul(&shape.gradient(to_body * (at - centre)))
            }
            Self::Wall(surface) => surface.normal(at),
        }
    }

    /// The distance or, where that is faster, the height above a plane that holds the side: less than the distance by little close to the
    /// surface, and below zero inside alike.
    pub(super) fn height(&self, at: Vec3) -> f64 {
        self.plane_of_gauge(at).map_or_else(|| self.distance(at), |(height, _)| height)
    }

    /// Height above that plane, and its normal, of a body with a gauge.
    fn plane_of_gauge(&self, at: Vec3) -> Option<(f64, Vec3)> {
        let Self::Body { chords: Some(_), shape, to_body, centre, growth, .. } = self else {
            return None;
        };
        let (gauge, gradient) = shape.gauge(to_body * (at - centre))?;
        let length = gradient.norm();
        (length > 0.0).then(|| ((gauge - 1.0) / length - growth, to_body.tr_mul(&(gradient / length))))
    }

    /// The furthest point of a body along a unit vector; walls have none.
    pub(super) fn support(&self, along: Vec3) -> Option<Vec3> {
        match self {
            Self::Body { shape, to_body, centre, growth, .. } => {
                Some(centre + to_body.tr_mul(&shape.support(to_body * along)) + along * *growth)
            }
            Self::Wall(_) => None,
        }
    }

    /// Half-spaces that hold it, known beforehand.
    pub(super) fn planes(&self) -> impl Iterator<Item = Plane> + '_ {
        let faces = match self {
            Self::Body { solid: Some(solid), to_body, centre, .. } => {
                Some((solid.planes.iter(), to_body, centre))
            }
            _ => None,
        };
        let wall = match self {
            Self::Wall(Surface::Plane { point, normal }) => {
                Some(Plane { normal: *normal, offset: normal.dot(point) })
            }
            _ => None,
        };
        let faces = faces.into_iter().flat_map(|(planes, to_body, centre)| {
            planes.map(move |plane| {
                let normal = to_body.tr_mul(&plane.normal);
                Plane { normal, offset: plane.offset + normal.dot(centre) }
            })
        });
        faces.chain(wall)
    }

    /// A half-space that holds the side and not `at`, a point at the [`height`](Self::height) `height > 0`: the surface is convex, so the plane
    /// touches it. What is outside of a pipe is not; there the chord below the part of the
    /// pipe in the reach of `corners` holds all of it that counts, if they lie on one side of the axis.
    pub(super) fn cut(&self, at: Vec3, height: f64, corners: impl Iterator<Item = Vec3>) -> Option<Plane> {
        if let Self::Wall(Surface::Cylinder { point, axis, radius, pipe: true }) = self {
            let away = -self.gradient(at);
            let across = axis.cross(&away);
            let (mut lo, mut hi) = (f64::INFINITY, f64::NEG_INFINITY);
            for corner in corners {
                let arm = corner - point;
                if arm.dot(&away) < 0.0 {
                    return None;
                }
                let x = arm.dot(&across);
                (lo, hi) = (lo.min(x), hi.max(x));
            }
            let rise = |x: f64| (radius * radius - x * x).max(0.0).sqrt();
            let chord = away * (hi - lo) - across * (rise(hi) - rise(lo));
            let normal = -chord.try_normalize(0.0)?;
            return Some(Plane { normal, offset: normal.dot(&(point + across * lo + away * rise(lo))) });
        }
        let normal = self.plane_of_gauge(at).map_or_else(|| self.gradient(at), |(_, normal)| normal);
        Some(Plane { normal, offset: normal.dot(&at) - height })
    }

    /// Part of a line inside the side. Parts before `from` and after `to` are of no interest: intervals may be cut off
    /// there. Ends are right to `precision` (m), or far better.
    pub(super) fn intervals(&self, line: &Line, from: f64, to: f64, precision: f64) -> Intervals {
        match self {
            Self::Body { .. } => {
                if let Some(quick) = self.quick(line) {
                    return [quick.within([from, to], precision), None];
                }
                let enter = self.approach(line, from, 1.0, precision);
                if enter == Approach::Missed {
                    return [None; 2];
                }
                let leave = self.approach(line, to, -1.0, precision);
                match (enter, leave) {
                    (Approach::Missed, _) | (_, Approach::Missed) | (Approach::Behind, Approach::Behind) => {
                        [None; 2]
                    }
                    (Approach::Behind, Approach::Met(leave)) => [Some((f64::NEG_INFINITY, leave)), None],
                    (Approach::Met(enter), Approach::Behind) => [Some((enter, f64::INFINITY)), None],
                    (Approach::Met(enter), Approach::Met(leave)) => [Some((enter, leave)), None],
                }
            }
            Self::Wall(surface) => wall_intervals(surface, line),
        }
    }

    /// A line seen from a body that has a quick way to its chords.
    #[inline]
    pub(super) fn quick(&self, line: &Line) -> Option<Quick<'_>> {
        let Self::Body { chords: Some(chords), to_body, centre, shape, growth, .. } = self else {
            return None;
        };
        let line = Line { from: to_body * (line.from - centre), along: to_body * line.along };
        Some(Quick { chords, line, shape: *shape, growth: *growth })
    }

    /// The secant method from `start` along the line (`sign` 1) or back. The distance to a convex body is convex
    /// along a line, so that no step passes the surface, and one that leads no nearer shows that there is none ahead.
    fn approach(&self, line: &Line, start: f64, sign: f64, precision: f64) -> Approach {
        let (mut t, mut last) = (0.0, self.distance(line.at(start)));
        if last <= 0.0 {
            return Approach::Met(start);
        }
        let mut step = last;
        for n in 0..STEPS {
            t += step;
            let distance = self.distance(line.at(start + sign * t));
            if distance <= precision {
                return Approach::Met(start + sign * t);
            }
            if distance >= last {
                return if n == 0 { Approach::Behind } else { Approach::Missed };
            }
            (step, last) = (step * distance / (last - distance), distance);
        }
        Approach::Missed
    }
}

/// A quick way to the chords of a body.
pub(super) enum Chords {
    /// Those of an ellipsoid with these inverse semi-axes (1/m).
    Ellipsoid(Vec3),
    /// Those of one that holds the body, shortened.
    GrownEllipsoid {
        /// Inverse semi-axes of ellipsoids that hold the body and lie in it (1/m).
        outer: Vec3,
        inner: Vec3,
        /// Squares of the semi-axes of the one that has grown (m^2).
        squares: Vec3,
        /// Their inverses (1/m^2).
        inverse: Vec3,
        /// Least radius of curvature of its surface (m).
        roundness: f64,
    },
    /// Those of a sphere of this radius (m), shortened to those of a body with a gauge.
    Gauge { reach: f64 },
}

impl Chords {
    /// For a sphere, an ellipsoid or a body with a gauge.
    fn new(shape: &dyn Shape, growth: f64) -> Option<Self> {
        if let Some(radius) = shape.as_sphere().map(|radius| radius + growth).filter(|radius| *radius > 0.0) {
            return Some(Self::Ellipsoid(Vec3::repeat(1.0 / radius)));
        }
        if growth < 0.0 {
            return None;
        }
        let Some(semi_axes) = shape.as_ellipsoid() else {
            return shape.gauge(Vec3::zeros()).map(|_| Self::Gauge { reach: shape.circumradius() + growth });
        };
        if growth == 0.0 {
            return Some(Self::Ellipsoid(semi_axes.map(f64::recip)));
        }
        let (mean, squares) =
            ((semi_axes.max() * semi_axes.min()).sqrt(), semi_axes.component_mul(&semi_axes));
        let outer = Ellipsoid::around(squares, growth, mean).map(|square| square.sqrt().recip());
        let inner = semi_axes.map(|axis| (axis + growth).recip());
        let (inverse, roundness) = (squares.map(f64::recip), squares.min() / semi_axes.max());
        Some(Self::GrownEllipsoid { outer, inner, squares, inverse, roundness })
    }

    /// The chord of the sphere or ellipsoid that holds the body, in its frame.
    #[inline]
    fn around(&self, line: &Line) -> Option<[f64; 2]> {
        match self {
            Self::Ellipsoid(inverse) | Self::GrownEllipsoid { outer: inverse, .. } => {
                of_ellipsoid(inverse, line)
            }
            Self::Gauge { reach } => {
                let middle = -line.from.dot(&line.along);
                let square = reach * reach - (line.from + line.along * middle).norm_squared();
                (square > 0.0).then(|| [middle - square.sqrt(), middle + square.sqrt()])
            }
        }
    }
}

/// A line in the frame of a body that has a quick way to its chords.
pub(super) struct Quick<'a> {
    chords: &'a Chords,
    line: Line,
    shape: &'a dyn Shape,
    growth: f64,
}

impl Quick<'_> {
    /// Part of the line inside the body, as [`Side::intervals`]: from the ends of the longer chord, or from those of the part of interest.
    #[inline]
    fn within(&self, [from, to]: [f64; 2], precision: f64) -> Option<(f64, f64)> {
        let [enter, leave] = self.chords.around(&self.line)?;
        if let Chords::Ellipsoid(_) = self.chords {
            return Some((enter, leave));
        }
        let (low, high) = (from.max(enter), to.min(leave));
        if low >= high {
            return None;
        }
        let enter = self.end(low, high, precision)?;
        Some((enter, self.end(high, enter, precision)?))
    }

    /// The first point of the body on the way from a point of the longer chord to another, by Newton's method, which never passes the
    /// surface.
    #[inline]
    fn end(&self, start: f64, far: f64, precision: f64) -> Option<f64> {
        match self.chords {
            Chords::Ellipsoid(_) => Some(start),
            Chords::GrownEllipsoid { inner, .. }
                if self.line.at(start).component_mul(inner).norm_squared() <= 1.0 =>
            {
                Some(start)
            }
            _ => self.search(start, far, precision),
        }
    }

    fn search(&self, start: f64, far: f64, precision: f64) -> Option<f64> {
        let Self { chords, line, shape, growth } = self;
        if *growth == 0.0 {
            return newton(line, [start, far], |at| {
                let (gauge, gradient) = shape.gauge(at)?;
                Some((gauge - 1.0, gradient.dot(&line.along), precision * gradient.norm()))
            });
        }
        let at = line.at(start);
        if let Chords::GrownEllipsoid { outer, squares, inverse, roundness, .. } = chords {
            let normal = at.component_mul(outer).component_mul(outer);
            // The foot with the normal of the outer ellipsoid.
            let foot = Foot::of_ellipsoid(normal, normal.component_mul(squares));
            let below = |point: Vec3| Some(Foot::of_ellipsoid(point.component_mul(inverse), point));
            return to_grown(line, [start, far], (*shape, *growth, *roundness), foot, precision, below);
        }
        let below = |point: Vec3| {
            let (gauge, gradient) = shape.gauge(point)?;
            Some(Foot { at: point / gauge, normal: gradient / gradient.norm() })
        };
        let foot = below(at)?;
        if foot.normal.dot(&at) <= foot.normal.dot(&foot.at) {
            return Some(start);
        }
        to_grown(line, [start, far], (*shape, *growth, 0.0), foot, precision, below)
    }
}

/// Contribution of the ends of a line's overlap to the area vector of the first of two bodies: 1 if it leaves through that, less 1 if it
/// enters through it; nothing where the line is cut off, at `from` or `to`. `None` if there is no overlap.
pub(super) fn own_ends(first: &Quick, second: &Quick, [from, to]: [f64; 2], precision: f64) -> Option<f64> {
    let [own, other] = [first.chords.around(&first.line)?, second.chords.around(&second.line)?];
    let (low, high) = (own[0].max(other[0]).max(from), own[1].min(other[1]).min(to));
    if low >= high {
        return None;
    }
    // The end of the second body is searched for from that of the first, and is that of the first if it stays there.
    let end = |start: f64, far: f64, is_chord_of_first: bool| {
        let of_first = first.end(start, far, precision)?;
        let of_both = second.end(of_first, far, precision)?;
        let stays = |at: f64, end: f64| at.to_bits() == end.to_bits();
        Some((of_both, stays(of_first, of_both) && (is_chord_of_first || !stays(start, of_first))))
    };
    let (enter, enters) = end(low, high, own[0] > other[0].max(from))?;
    let (leave, leaves) = end(high, enter, own[1] < other[1].min(to))?;
    (enter < leave).then(|| f64::from(u8::from(leaves)) - f64::from(u8::from(enters)))
}

/// The chord of an ellipsoid: stretched, the line has one in the unit sphere.
#[inline]
fn of_ellipsoid(inverse: &Vec3, line: &Line) -> Option<[f64; 2]> {
    let [origin, along] = [line.from, line.along].map(|v| v.component_mul(inverse));
    let square = along.norm_squared();
    let middle = -origin.dot(&along) / square;
    let left = 1.0 - (origin + along * middle).norm_squared();
    if left <= 0.0 {
        return None;
    }
    let half = (left / square).sqrt();
    Some([middle - half, middle + half])
}

/// A point of a surface, and the normal there.
struct Foot {
    at: Vec3,
    normal: Vec3,
}

impl Foot {
    /// The point of an ellipsoid whose normal has a direction, with the `product` of this and the squares of the semi-axes.
    #[inline]
    fn of_ellipsoid(direction: Vec3, product: Vec3) -> Self {
        // One division for both.
        let (length, reach) = (direction.norm(), direction.dot(&product).sqrt());
        let inverse = (length * reach).recip();
        Self { at: product * (length * inverse), normal: direction * (reach * inverse) }
    }
}

/// Newton's method along a line for a grown body with a gauge, from outside: as [`newton`].
///
/// A step ends at the plane that touches the grown body above a foot on the surface: it holds the body. It has arrived in the ball that
/// touches that plane from within, of the radius of the growth and the least one of curvature, `roundness` (m), if known. The next foot is
/// that on the way to the centre from the middle of the ball of growth that touches the plane where the step ends (`below`).
fn to_grown(
    line: &Line,
    [start, end]: [f64; 2],
    (shape, growth, roundness): (&dyn Shape, f64, f64),
    mut foot: Foot,
    precision: f64,
    below: impl Fn(Vec3) -> Option<Foot>,
) -> Option<f64> {
    let mut t = start;
    for _ in 0..PLANES {
        let mut arm = line.at(t) - foot.at;
        let height = foot.normal.dot(&arm) - growth;
        if height > 0.0 {
            let step = height / foot.normal.dot(&line.along);
            let ahead = step * (end - start) < 0.0 && (end - t).abs() >= step.abs();
            if !ahead {
                return None;
            }
            t -= step;
            arm -= line.along * step;
        }
        let radius = growth + roundness + precision;
        if (arm + foot.normal * roundness).norm_squared() <= radius * radius {
            return Some(t);
        }
        foot = below(line.at(t) - foot.normal * growth)?;
    }
    newton(line, [t, end], |at| {
        let (distance, gradient) = shape.distance_and_gradient(at);
        Some((distance - growth, gradient.dot(&line.along), precision))
    })
}

/// Newton's method along a line for a convex function, positive at the start: the first point on the way to the end where it is within its
/// precision. `above` gives its value, its slope and that precision.
fn newton(
    line: &Line,
    [start, end]: [f64; 2],
    above: impl Fn(Vec3) -> Option<(f64, f64, f64)>,
) -> Option<f64> {
    let mut t = start;
    for _ in 0..STEPS {
        let (left, slope, precision) = above(line.at(t))?;
        if left <= precision {
            return Some(t);
        }
        let step = left / slope;
        let ahead = step * (end - start) < 0.0 && (end - t).abs() >= step.abs();
        if !ahead {
            return None;
        }
        t -= step;
    }
    None
}

/// Course of a line near a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Approach {
    /// There.
    Met(f64),
    /// The distance increases from the start, or the first step passes by: the surface is behind, or missed.
    Behind,
    /// It passes by.
    Missed,
}

fn wall_intervals(surface: &Surface, line: &Line) -> Intervals {
    let whole = Some((f64::NEG_INFINITY, f64::INFINITY));
    match surface {
        Surface::Plane { point, normal } => {
            let (height, slope) = ((line.from - point).dot(normal), line.along.dot(normal));
            if slope > 0.0 {
                [Some((f64::NEG_INFINITY, -height / slope)), None]
            } else if slope < 0.0 {
                [Some((-height / slope, f64::INFINITY)), None]
            } else {
                [whole.filter(|_| height <= 0.0), None]
            }
        }
        Surface::Cylinder { point, axis, radius, pipe } => {
            let across = |v: Vec3| v - *axis * axis.dot(&v);
            let (arm, along) = (across(line.from - point), across(line.along));
            let (a, b, c) = (along.norm_squared(), arm.dot(&along), arm.norm_squared() - radius * radius);
            let square = b * b - a * c;
            let meets = a > 0.0 && square > 0.0;
            let ends = meets.then(|| ((-b - square.sqrt()) / a, (-b + square.sqrt()) / a));
            let parallel_inside = a == 0.0 && c <= 0.0;
            match (ends, pipe) {
                (Some((enter, leave)), true) => {
                    [Some((f64::NEG_INFINITY, enter)), Some((leave, f64::INFINITY))]
                }
                (Some(ends), false) => [Some(ends), None],
                (None, true) => [whole.filter(|_| !parallel_inside), None],
                (None, false) => [whole.filter(|_| parallel_inside), None],
            }
        }
        // A body meets the planes of a mesh, see `contact::mesh`.
        Surface::Mesh(_) => [None; 2],
    }
}
