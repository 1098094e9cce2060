//! Prescribed motion: velocity and angular velocity as functions of time, and the directions that stay free.
//!
//! Over a step a body moves by the exact integral of its velocity, so that its path does not drift, and turns through
//! that of its angular velocity: exact for a constant axis, else second order in the step. The time of a step alone
//! decides both; no state is kept.

use crate::math::TimeFunction;

/// Motion of the bodies of a template, as far as it is prescribed. By default all of it follows from forces.
#[derive(Clone, Debug, PartialEq)]
pub struct PrescribedMotion {
    /// Velocity of the centre of mass (m/s) in the directions that are not free.
    pub velocity: TimeFunction,
    /// Angular velocity (1/s), unless rotation is free.
    pub angular_velocity: TimeFunction,
    /// Directions x, y, z in which forces move the centre of mass.
    pub free: [bool; 3],
    /// True if torques turn the body.
    pub free_rotation: bool,
}

impl Default for PrescribedMotion {
    fn default() -> Self {
        Self { free: [true; 3], free_rotation: true, ..Self::fixed() }
    }
}

impl PrescribedMotion {
    /// Neither moves nor turns.
    pub fn fixed() -> Self {
        Self {
            velocity: TimeFunction::default(),
            angular_velocity: TimeFunction::default(),
            free: [false; 3],
            free_rotation: false,
        }
    }

    /// Returns true if nothing is prescribed.
    pub fn is_free(&self) -> bool {
        self.free == [true; 3] && self.free_rotation
    }

    /// Returns true if forces do not move the centre of mass in any direction.
    pub fn holds_centre(&self) -> bool {
        self.free == [false; 3]
    }

    /// Returns true if neither forces nor torques move the body.
    pub fn is_complete(&self) -> bool {
        self.holds_centre() && !self.free_rotation
    }

    /// Returns true if the centre of mass stays where it is.
    pub fn rests(&self) -> bool {
        self.holds_centre() && self.velocity.is_zero()
    }

    /// Bound (m/s) of the speed of the surface of a body of this circumradius (m) by what is prescribed.
    pub fn largest_speed(&self, circumradius: f64) -> f64 {
        self.velocity.largest().norm() + self.angular_velocity.largest().norm() * circumradius
    }
}
