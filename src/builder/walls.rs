//! Walls for the builder.

use super::Keys;
use serde::Serialize;

/// A wall in the box, at rest, for [`Builder::wall`](super::Builder::wall). Lengths are in m.
///
/// ```
/// use turbid::{Builder, Wall};
/// let slope = Wall::plane("slope", [0.0, 0.0, 5e-4], [0.0, 0.0, 1.0]).velocity([1e-3, 0.0, 0.0]);
/// let setup = Builder::example().periodic([true, true, false]).wall(slope).setup()?;
/// assert_eq!(setup.walls[2].name, "slope");
/// # Ok::<(), turbid::Error>(())
/// ```
#[derive(Clone, Debug)]
#[must_use]
pub struct Wall {
    pub(super) keys: Keys,
}

impl Wall {
    fn new(name: &str, kind: &str, point: [f64; 3], direction: (&str, [f64; 3])) -> Self {
        Self { keys: Keys::default() }
            .set("name", name)
            .set(&format!("{kind}.point"), point)
            .set(&format!("{kind}.{}", direction.0), direction.1)
    }

    /// A plane through a point, with a normal from the wall into the free space.
    pub fn plane(name: &str, point: impl Into<[f64; 3]>, normal: impl Into<[f64; 3]>) -> Self {
        Self::new(name, "plane", point.into(), ("normal", normal.into()))
    }

    /// An endless circular pipe: everything outside of it is wall.
    pub fn pipe(name: &str, point: impl Into<[f64; 3]>, axis: impl Into<[f64; 3]>, diameter: f64) -> Self {
        Self::new(name, "pipe", point.into(), ("axis", axis.into())).set("pipe.diameter", diameter)
    }

    /// An endless circular rod: everything inside of it is wall.
    pub fn rod(name: &str, point: impl Into<[f64; 3]>, axis: impl Into<[f64; 3]>, diameter: f64) -> Self {
        Self::new(name, "rod", point.into(), ("axis", axis.into())).set("rod.diameter", diameter)
    }

    /// Velocity (m/s).
    pub fn velocity(self, velocity: impl Into<[f64; 3]>) -> Self {
        self.set("velocity", velocity.into())
    }

    /// Angular velocity (1/s) about the point of the wall.
    pub fn angular_velocity(self, angular_velocity: impl Into<[f64; 3]>) -> Self {
        self.set("angular_velocity", angular_velocity.into())
    }

    /// Any other key of a section `[[walls]]`: `"pivot"`, `"material"`.
    pub fn set(mut self, key: &str, value: impl Serialize) -> Self {
        self.keys.put(key, value);
        self
    }
}
