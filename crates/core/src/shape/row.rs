//! Intersection of a body with a line parallel to the x axis of the world: functions for several shapes.

use crate::math::{Quat, Vec3};

/// The line `(x, y, z), x in R` in the frame of a rotated body: `origin + x direction`.
pub(super) struct Line {
    pub origin: Vec3,
    pub direction: Vec3,
}

impl Line {
    #[inline]
    pub(super) fn new(orientation: &Quat, y: f64, z: f64) -> Self {
        let turn = orientation.to_rotation_matrix().into_inner();
        let row = |i: usize| Vec3::new(turn[(i, 0)], turn[(i, 1)], turn[(i, 2)]);
        Self { origin: row(1) * y + row(2) * z, direction: row(0) }
    }

    /// The point at `x`.
    pub(super) fn at(&self, x: f64) -> Vec3 {
        self.origin + self.direction * x
    }
}

/// An interval that is cut by half-spaces.
pub(super) struct Clip {
    pub low: f64,
    pub high: f64,
}

impl Clip {
    /// The part of the line in the ball of this radius (m) about the origin.
    #[inline]
    pub(super) fn ball(radius: f64, y: f64, z: f64) -> Option<Self> {
        let square = radius * radius - (y * y + z * z);
        (square >= 0.0).then(|| Self { low: -square.sqrt(), high: square.sqrt() })
    }

    /// Keeps the x with `rise x <= room`.
    #[inline(always)]
    pub(super) fn below(&mut self, rise: f64, room: f64) {
        let x = room / rise;
        if rise > 0.0 {
            self.high = if x < self.high { x } else { self.high };
        } else if rise < 0.0 {
            self.low = if x > self.low { x } else { self.low };
        } else if room < 0.0 {
            self.high = f64::NEG_INFINITY;
        }
    }

    /// Keeps what lies within the radius (m) of the z axis of the body, if anything.
    #[inline]
    pub(super) fn tube(&mut self, line: &Line, radius: f64) -> Option<()> {
        let (o, d) = (line.origin, line.direction);
        let roots =
            quadratic(d.x * d.x + d.y * d.y, o.x * d.x + o.y * d.y, o.x * o.x + o.y * o.y - radius * radius)?;
        self.low = self.low.max(roots.0);
        self.high = self.high.min(roots.1);
        Some(())
    }

    /// The remaining interval, if any.
    #[inline]
    pub(super) fn interval(&self) -> Option<(f64, f64)> {
        (self.low <= self.high).then_some((self.low, self.high))
    }
}

/// Interval in which `a x^2 + 2 b x + c <= 0`, for `a >= 0`.
#[inline]
pub(super) fn quadratic(a: f64, b: f64, c: f64) -> Option<(f64, f64)> {
    let square = b * b - a * c;
    if a > 0.0 && square >= 0.0 {
        let root = square.sqrt();
        Some(((-b - root) / a, (-b + root) / a))
    } else {
        // A line along the axis is in or out.
        (a == 0.0 && c <= 0.0).then_some((f64::NEG_INFINITY, f64::INFINITY))
    }
}

/// Interval in which a convex function of `x` is at most `level`, by Newton's method.
///
/// `function` gives value and slope; the interval must lie in `low..=high`. The tangent of a convex function is below
/// it, so the iteration from either end never passes the interval: the result is at most `tolerance` or so too long.
/// If it must be within (`inner`), the ends move to where the chord from the middle reaches the level, as the
/// function is below its chord.
pub(super) fn convex(
    function: impl Fn(f64) -> (f64, f64),
    Clip { low, high }: Clip,
    level: f64,
    inner: bool,
    tolerance: f64,
) -> Option<(f64, f64)> {
    let end = |from: f64, to: f64| {
        let forward = (to - from).signum();
        let mut x = from;
        for _ in 0..100 {
            let (value, slope) = function(x);
            let excess = value - level;
            if excess <= 0.0 {
                return Some(x);
            }
            let step = -excess / slope;
            // Uphill, or out at the other end: the function stays above the level.
            let is_forward = step * forward > 0.0;
            if !is_forward || (to - (x + step)) * forward < 0.0 {
                return None;
            }
            x += step;
            if step.abs() <= tolerance {
                break;
            }
        }
        Some(x)
    };
    let (low, high) = (end(low, high)?, end(high, low)?);
    if low > high || !inner {
        return (low <= high).then_some((low, high));
    }
    let middle = 0.5 * (low + high);
    let room = level - function(middle).0;
    if room <= 0.0 {
        return None;
    }
    let inwards = |x: f64| {
        let excess = (function(x).0 - level).max(0.0);
        x + (middle - x) * (excess / (excess + room))
    };
    Some((inwards(low), inwards(high)))
}
