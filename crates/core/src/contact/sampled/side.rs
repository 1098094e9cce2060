//! A side of a sampled contact, known by distance and gradient only: a body in its pose, or a wall.

use crate::contact::clip::Plane;
use crate::contact::overlap::Body;
use crate::contact::solid::Solid;
use crate::math::{Mat3, Vec3};
use crate::shape::{Ellipsoid, Shape};
use crate::wall::Surface;

/// Steps of the secant method after which a grazing line is given up.
const STEPS: u32 = 40;

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
        /// A body that holds it, whose chords are found faster, if that is close.
        around: Option<Around>,
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
            around: Around::new(shape, growth),
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
        let Self::Body { around: Some(Around::Gauge { .. }), shape, to_body, centre, growth, .. } = self
        else {
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
            Self::Body { around: Some(around), to_body, centre, shape, growth, .. } => {
                let line = Line { from: to_body * (line.from - centre), along: to_body * line.along };
                [around.within(&line, (*shape, *growth), [from, to], precision), None]
            }
            Self::Body { .. } => {
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

/// A body that holds a grown one.
pub(super) enum Around {
    Ellipsoid {
        /// Inverse semi-axes (1/m).
        inverse: Vec3,
        /// It is the body.
        is_exact: bool,
    },
    /// The body itself, scaled by this factor.
    Gauge { scale: f64 },
}

impl Around {
    /// For a sphere, an ellipsoid or a body with a gauge.
    fn new(shape: &dyn Shape, growth: f64) -> Option<Self> {
        if let Some(radius) = shape.as_sphere().map(|radius| radius + growth).filter(|radius| *radius > 0.0) {
            return Some(Self::Ellipsoid { inverse: Vec3::repeat(1.0 / radius), is_exact: true });
        }
        if let Some(semi_axes) = shape.as_ellipsoid() {
            let mean = (semi_axes.max() * semi_axes.min()).sqrt();
            let squares = Ellipsoid::around(semi_axes.component_mul(&semi_axes), growth.max(0.0), mean);
            let inverse = squares.map(|square| square.sqrt().recip());
            return Some(Self::Ellipsoid { inverse, is_exact: growth == 0.0 });
        }
        // A body with a gauge is symmetric about its centre: half of its thickness is the radius of a sphere in it.
        let scale = 1.0 + growth.max(0.0) / (0.5 * shape.thickness());
        shape.gauge(Vec3::zeros()).map(|_| Self::Gauge { scale })
    }

    /// Part of a line inside the body, in its own frame, as [`Side::intervals`]: the chord of the body that holds it, and from its ends, or
    /// from those of the part of interest, Newton's method, which never passes the surface.
    fn within(
        &self,
        line: &Line,
        body: (&dyn Shape, f64),
        [from, to]: [f64; 2],
        precision: f64,
    ) -> Option<(f64, f64)> {
        let (shape, growth) = body;
        let ((enter, leave), is_exact) = match self {
            Self::Ellipsoid { inverse, is_exact } => (Self::of_ellipsoid(inverse, line)?, *is_exact),
            Self::Gauge { scale } => {
                (Self::of_gauge((shape, *scale), line, [from, to], precision)?, growth == 0.0)
            }
        };
        if is_exact {
            return Some((enter, leave));
        }
        // Most that begin where the part of interest does are inside there.
        let end = |near: f64, start: f64, far: f64| {
            let is_between = near > start.min(far) && near < start.max(far);
            let found = is_between.then(|| Self::nearer(line, body, [near, far], precision)).flatten();
            found.or_else(|| Self::nearer(line, body, [start, far], precision))
        };
        let enter = end(from, enter, leave)?;
        Some((enter, end(to, leave, enter)?))
    }

    /// The chord of an ellipsoid: stretched, the line has one in the unit sphere.
    fn of_ellipsoid(inverse: &Vec3, line: &Line) -> Option<(f64, f64)> {
        let [origin, along] = [line.from, line.along].map(|v| v.component_mul(inverse));
        let square = along.norm_squared();
        let middle = -origin.dot(&along) / square;
        let left = 1.0 - (origin + along * middle).norm_squared();
        if left <= 0.0 {
            return None;
        }
        let half = (left / square).sqrt();
        Some((middle - half, middle + half))
    }

    /// The part between `from` and `to` of the chord of a body `scale` times as large. The gauge is convex along the line.
    fn of_gauge(
        (shape, scale): (&dyn Shape, f64),
        line: &Line,
        [from, to]: [f64; 2],
        precision: f64,
    ) -> Option<(f64, f64)> {
        let above = |at: Vec3| {
            let (gauge, gradient) = shape.gauge(at)?;
            Some((gauge - scale, gradient.dot(&line.along), precision * gradient.norm()))
        };
        let end = |start, far| newton(line, [start, far], above);
        let reach = scale * shape.circumradius();
        let middle = -line.from.dot(&line.along);
        let half = (reach * reach - (line.from + line.along * middle).norm_squared()).max(0.0).sqrt();
        let (low, high) = (from.max(middle - half), to.min(middle + half));
        if low >= high {
            return None;
        }
        let enter = end(low, high)?;
        Some((enter, end(high, enter)?))
    }

    /// The end of the part inside, from outside on towards the other one; none if the line misses the body.
    fn nearer(
        line: &Line,
        (shape, growth): (&dyn Shape, f64),
        ends: [f64; 2],
        precision: f64,
    ) -> Option<f64> {
        newton(line, ends, |at| {
            let (distance, gradient) = shape.distance_and_gradient(at);
            Some((distance - growth, gradient.dot(&line.along), precision))
        })
    }
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
