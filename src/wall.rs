//! Walls: rigid surfaces that particles touch and the fluid sticks to, at rest or moving.
//!
//! A wall is the part of space behind its surface. SI units, world frame.

use crate::math::Vec3;

/// The surface of a wall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Surface {
    /// Everything behind a plane.
    Plane {
        /// A point of the plane (m).
        point: Vec3,
        /// Unit normal, from the wall into the free space.
        normal: Vec3,
    },
    /// Everything outside a circular cylinder (a pipe), or inside of it (a rod); endless.
    Cylinder {
        /// A point of the axis (m).
        point: Vec3,
        /// Unit vector along the axis.
        axis: Vec3,
        /// Radius (m).
        radius: f64,
        /// Whether the free space is inside.
        pipe: bool,
    },
}

impl Surface {
    /// Signed distance of a point to the wall (m): positive in the free space, negative in the wall.
    pub fn distance(&self, at: Vec3) -> f64 {
        match self {
            Self::Plane { point, normal } => (at - point).dot(normal),
            Self::Cylinder {
                radius, pipe: true, ..
            } => radius - self.radial(at).norm(),
            Self::Cylinder { radius, .. } => self.radial(at).norm() - radius,
        }
    }

    /// Gradient of the distance: the unit vector from the wall into the free space.
    pub fn normal(&self, at: Vec3) -> Vec3 {
        match self {
            Self::Plane { normal, .. } => *normal,
            Self::Cylinder { axis, pipe, .. } => {
                let away = self.radial(at).try_normalize(0.0).unwrap_or_else(|| {
                    // On the axis every direction across it is as good.
                    let other = if axis.x.abs() < 0.6 { Vec3::x() } else { Vec3::y() };
                    axis.cross(&other).normalize()
                });
                if *pipe { -away } else { away }
            }
        }
    }

    /// From the axis of a cylinder to a point.
    fn radial(&self, at: Vec3) -> Vec3 {
        match self {
            Self::Plane { normal, point } => *normal * (at - point).dot(normal),
            Self::Cylinder { point, axis, .. } => {
                let arm = at - point;
                arm - *axis * arm.dot(axis)
            }
        }
    }

    /// The same surface moved by `-origin`: as seen from there.
    #[must_use]
    pub fn seen_from(&self, origin: Vec3) -> Self {
        let mut seen = *self;
        match &mut seen {
            Self::Plane { point, .. } | Self::Cylinder { point, .. } => *point -= origin,
        }
        seen
    }
}

/// How a wall moves: as a rigid body, steadily.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Motion {
    /// Velocity of the pivot (m/s).
    pub velocity: Vec3,
    /// Angular velocity about the pivot (1/s).
    pub angular_velocity: Vec3,
    /// A point of the wall at the time 0 (m).
    pub pivot: Vec3,
}

/// A wall.
#[derive(Clone, Debug, PartialEq)]
pub struct Wall {
    /// Name for messages and output, e.g. `"z-"` for the lower face of the box in z.
    pub name: String,
    /// Where it is at the time 0.
    pub surface: Surface,
    /// How it moves.
    pub motion: Motion,
    /// Index of its material.
    pub material: usize,
}

impl Wall {
    /// Velocity of its matter at a place and time (m/s).
    pub fn velocity(&self, at: Vec3, time: f64) -> Vec3 {
        let pivot = self.motion.pivot + self.motion.velocity * time;
        self.motion.velocity + self.motion.angular_velocity.cross(&(at - pivot))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_grow_along_the_normal_into_the_free_space() {
        let axis = Vec3::new(0.6, 0.0, 0.8);
        let cylinder = |pipe| Surface::Cylinder {
            point: Vec3::new(0.1, 0.2, 0.3),
            axis,
            radius: 1.5,
            pipe,
        };
        let plane = Surface::Plane {
            point: Vec3::new(1.0, 0.0, 0.0),
            normal: axis,
        };
        for surface in [plane, cylinder(true), cylinder(false)] {
            let at = Vec3::new(0.7, -0.4, 0.5);
            let normal = surface.normal(at);
            assert!((normal.norm() - 1.0).abs() < 1e-14);
            let there = surface.distance(at + normal * 0.1);
            assert!((there - surface.distance(at) - 0.1).abs() < 1e-14);
            let origin = Vec3::new(3.0, 2.0, 1.0);
            assert!((surface.seen_from(origin).distance(at - origin) - surface.distance(at)).abs() < 1e-14);
        }
    }

    #[test]
    fn a_turning_wall_moves_with_its_angular_velocity_about_its_moving_pivot() {
        let wall = Wall {
            name: "disc".into(),
            surface: Surface::Plane {
                point: Vec3::zeros(),
                normal: Vec3::z(),
            },
            motion: Motion {
                velocity: Vec3::x(),
                angular_velocity: 2.0 * Vec3::z(),
                pivot: Vec3::zeros(),
            },
            material: 0,
        };
        let velocity = wall.velocity(Vec3::new(3.0, 1.0, 0.0), 2.0);
        assert!((velocity - Vec3::new(-1.0, 2.0, 0.0)).norm() < 1e-15);
    }
}
