//! Where a line parallel to the x axis of the world meets a body: parts that several shapes share.

use crate::math::{Quat, Vec3};

/// The line `(x, y, z), x in R` in the frame of a turned body: `origin + x direction`.
pub(super) struct Line {
    pub origin: Vec3,
    pub direction: Vec3,
}

impl Line {
    #[inline]
    pub(super) fn new(orientation: &Quat, y: f64, z: f64) -> Self {
        let turn = orientation.to_rotation_matrix().into_inner();
        let row = |i: usize| Vec3::new(turn[(i, 0)], turn[(i, 1)], turn[(i, 2)]);
        Self {
            origin: row(1) * y + row(2) * z,
            direction: row(0),
        }
    }
}

/// Where the line meets the ball of this radius (m) about the origin.
#[inline]
pub(super) fn ball(radius: f64, y: f64, z: f64) -> Option<(f64, f64)> {
    let square = radius * radius - (y * y + z * z);
    (square >= 0.0).then(|| (-square.sqrt(), square.sqrt()))
}

/// An interval that is cut by half-spaces.
pub(super) struct Clip {
    pub low: f64,
    pub high: f64,
}

impl Clip {
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

    /// What is left, if anything.
    #[inline]
    pub(super) fn interval(&self) -> Option<(f64, f64)> {
        (self.low <= self.high).then_some((self.low, self.high))
    }
}
