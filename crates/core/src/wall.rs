//! Walls: rigid no-slip surfaces in contact with particles and fluid, at rest or moving.
//!
//! A wall is the part of space behind its surface, or a sheet without thickness. SI units, world frame.

pub mod mesh;

use crate::math::nalgebra::Quaternion;
use crate::math::{Patch, Profile, Quat, TimeFunction, Vec3};
pub use mesh::{FreeSide, WallMesh};
use std::sync::Arc;

/// The surface of a wall.
#[derive(Clone, Debug, PartialEq)]
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
        /// True if the free space is inside.
        pipe: bool,
    },
    /// Facets.
    Mesh(PlacedMesh),
}

/// A mesh in the world.
#[derive(Clone, Debug, PartialEq)]
pub struct PlacedMesh {
    /// In its own frame.
    pub mesh: Arc<WallMesh>,
    /// Origin of that frame (m).
    pub position: Vec3,
    /// Maps that frame to the world frame.
    pub orientation: Quat,
}

impl PlacedMesh {
    /// A point of the world in the frame of the mesh.
    #[inline]
    pub fn to_own(&self, at: &Vec3) -> Vec3 {
        self.orientation.inverse_transform_vector(&(at - self.position))
    }

    /// A point of the mesh in the world.
    #[inline]
    pub fn to_world(&self, at: &Vec3) -> Vec3 {
        self.position + self.orientation * at
    }

    /// Corners of a facet in the world (m).
    pub fn corners(&self, facet: u32) -> [Vec3; 3] {
        self.mesh.corners(facet).map(|corner| self.to_world(&corner))
    }
}

impl Surface {
    /// Name of the kind for messages.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Plane { .. } => "plane",
            Self::Cylinder { pipe: true, .. } => "pipe",
            Self::Cylinder { .. } => "rod",
            Self::Mesh(_) => "mesh",
        }
    }

    /// The mesh, if it is one.
    pub fn mesh(&self) -> Option<&PlacedMesh> {
        if let Self::Mesh(mesh) = self { Some(mesh) } else { None }
    }

    /// Number of facets, 1 of what is no mesh.
    pub fn facets(&self) -> usize {
        self.mesh().map_or(1, |placed| placed.mesh.facets().len())
    }

    /// True of planes.
    pub fn is_plane(&self) -> bool {
        matches!(self, Self::Plane { .. })
    }

    /// Signed distance of a point to the wall (m): positive in the free space, negative in the wall. Of a mesh it takes a search.
    pub fn distance(&self, at: Vec3) -> f64 {
        match self {
            Self::Plane { point, normal } => (at - point).dot(normal),
            Self::Cylinder { radius, pipe: true, .. } => radius - self.radial(at).norm(),
            Self::Cylinder { radius, .. } => self.radial(at).norm() - radius,
            Self::Mesh(placed) => placed.mesh.distance(&placed.to_own(&at)),
        }
    }

    /// The distance of a point to the wall where it is less than a limit (m), else at least that; of points deeper in the wall at most minus the limit.
    /// Of a mesh it is found faster.
    pub fn distance_up_to(&self, at: Vec3, limit: f64) -> f64 {
        match self {
            Self::Mesh(placed) => placed.mesh.distance_up_to(&placed.to_own(&at), limit),
            _ => self.distance(at),
        }
    }

    /// True if a point is in the wall: its distance is negative. Of a mesh exact, and faster.
    pub fn is_wall(&self, at: Vec3) -> bool {
        match self {
            Self::Mesh(placed) => placed.mesh.is_wall(&placed.to_own(&at)),
            _ => self.distance(at) < 0.0,
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
            Self::Mesh(placed) => placed.orientation * placed.mesh.normal(&placed.to_own(&at)),
        }
    }

    /// Part of the way from a point in the free space to one in the wall at which its surface is met.
    pub fn part_of_way(&self, from: Vec3, to: Vec3) -> f64 {
        match self {
            Self::Plane { normal, .. } => self.distance(from) / (from - to).dot(normal),
            Self::Mesh(placed) => {
                let [from, to] = [from, to].map(|at| placed.to_own(&at));
                placed.mesh.crossing(&from, &to).map_or(1.0, |crossing| crossing.part)
            }
            Self::Cylinder { radius, pipe, .. } => {
                // Roots of `a part^2 + 2 b part + c = 0`, without cancellation.
                let (r, way) = (self.radial(from), self.radial(to) - self.radial(from));
                let (a, b, c) = (way.norm_squared(), r.dot(&way), r.norm_squared() - radius * radius);
                let root = (b * b - a * c).sqrt();
                match *pipe {
                    false => c / (root - b),
                    true if b > 0.0 => -c / (b + root),
                    true => (root - b) / a,
                }
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
            Self::Mesh(placed) => at - placed.position,
        }
    }

    /// The same surface at a time (s) of a motion: turned about the pivot, then carried along with it.
    ///
    /// Exact at any time, up to rounding: nothing is added up from step to step.
    #[must_use]
    pub fn moved(&self, motion: &Motion, time: f64) -> Self {
        if motion.rests() {
            return self.clone();
        }
        let way = motion.velocity.integral(0.0, time);
        let (turn, time) = match motion.angular_velocity.constant() {
            Some(steady) => (steady, time),
            None => (motion.angular_velocity.integral(0.0, time), 1.0),
        };
        let speed = turn.norm();
        let mut moved = self.clone();
        let (point, mut direction) = match &mut moved {
            Self::Plane { point, normal } => (point, Some(normal)),
            Self::Cylinder { point, axis, .. } => (point, Some(axis)),
            Self::Mesh(PlacedMesh { position, orientation, .. }) => {
                if speed > 0.0 {
                    let (sine, cosine) = libm::sincos(0.5 * speed * time);
                    let turned = Quaternion::from_parts(cosine, turn * (sine / speed));
                    *orientation = Quat::new_normalize(turned * orientation.quaternion());
                }
                (position, None)
            }
        };
        if speed > 0.0 {
            let axis = turn / speed;
            let (sine, cosine) = libm::sincos(speed * time);
            // Rodrigues: along the axis, and round it.
            let turned =
                |v: Vec3| v * cosine + axis.cross(&v) * sine + axis * (axis.dot(&v) * (1.0 - cosine));
            *point = motion.pivot + turned(*point - motion.pivot);
            if let Some(direction) = &mut direction {
                **direction = turned(**direction).normalize();
            }
        }
        *point += way;
        moved
    }

    /// The same surface moved by `-origin`: as seen from there.
    #[must_use]
    pub fn seen_from(&self, origin: Vec3) -> Self {
        let mut seen = self.clone();
        match &mut seen {
            Self::Plane { point, .. } | Self::Cylinder { point, .. } => *point -= origin,
            Self::Mesh(placed) => placed.position -= origin,
        }
        seen
    }
}

/// Rigid-body motion of a wall.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Motion {
    /// Velocity of the pivot (m/s).
    pub velocity: TimeFunction,
    /// Angular velocity about the pivot (1/s), always along the same axis.
    pub angular_velocity: TimeFunction,
    /// A point of the wall at the time 0 (m).
    pub pivot: Vec3,
}

impl Motion {
    /// True if it never moves.
    pub fn rests(&self) -> bool {
        self.velocity.is_zero() && self.angular_velocity.is_zero()
    }

    /// True if it is the same at all times.
    pub fn is_steady(&self) -> bool {
        self.velocity.constant().is_some() && self.angular_velocity.constant().is_some()
    }
}

/// Fluid that comes in through a face of the box, which is a wall at rest for bodies.
#[derive(Clone, Debug, PartialEq)]
pub struct Inlet {
    /// Mean velocity over the face or its patch (m/s), of a table what its factors multiply; along its normal.
    pub velocity: TimeFunction,
    /// Profile over the face, lengths in m.
    pub profile: Profile,
    /// Part of the face that it has, lengths in m; the rest is wall.
    pub patch: Option<Patch>,
}

/// A wall.
#[derive(Clone, Debug, PartialEq)]
pub struct Wall {
    /// Name for messages and output, e.g. `"z-"` for the lower face of the box in z.
    pub name: String,
    /// Surface at the time 0.
    pub surface: Surface,
    /// Motion.
    pub motion: Motion,
    /// Index of its material.
    pub material: usize,
}

impl Wall {
    /// Its surface at a time (s).
    pub fn surface_at(&self, time: f64) -> Surface {
        self.surface.moved(&self.motion, time)
    }

    /// Velocity of its material at a position and time (m/s).
    pub fn velocity(&self, at: Vec3, time: f64) -> Vec3 {
        let Motion { velocity, angular_velocity, pivot } = &self.motion;
        let pivot = pivot + velocity.integral(0.0, time);
        velocity.at(time) + angular_velocity.at(time).cross(&(at - pivot))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_grow_along_the_normal_into_the_free_space() {
        let axis = Vec3::new(0.6, 0.0, 0.8);
        let cylinder = |pipe| Surface::Cylinder { point: Vec3::new(0.1, 0.2, 0.3), axis, radius: 1.5, pipe };
        let plane = Surface::Plane { point: Vec3::new(1.0, 0.0, 0.0), normal: axis };
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
    fn a_way_into_a_wall_meets_its_surface_where_the_distance_is_zero() {
        let axis = Vec3::new(0.6, 0.0, 0.8);
        let cylinder = |pipe| Surface::Cylinder { point: Vec3::new(0.1, 0.2, 0.3), axis, radius: 1.5, pipe };
        let plane = Surface::Plane { point: Vec3::new(1.0, 0.0, 0.0), normal: axis };
        let mut ways = 0;
        for surface in [plane, cylinder(true), cylinder(false)] {
            for n in 0..4000 {
                let random =
                    |k: u32| f64::from((n * 6 + k).wrapping_mul(2_654_435_761) >> 8) / f64::from(1 << 24);
                let [from, to] = [0, 3].map(|k| Vec3::from_fn(|a, _| 4.0 * random(k + a as u32) - 2.0));
                if surface.distance(from) > 0.0 && surface.distance(to) < 0.0 {
                    let part = surface.part_of_way(from, to);
                    assert!((0.0..=1.0).contains(&part), "{surface:?} {part}");
                    assert!(surface.distance(from + (to - from) * part).abs() < 1e-12, "{surface:?}");
                    ways += 1;
                }
            }
        }
        assert!(ways > 1000);
    }

    #[test]
    fn a_turning_wall_moves_with_its_angular_velocity_about_its_moving_pivot() {
        let wall = Wall {
            name: "disc".into(),
            surface: Surface::Plane { point: Vec3::zeros(), normal: Vec3::z() },
            motion: Motion {
                velocity: Vec3::x().into(),
                angular_velocity: (2.0 * Vec3::z()).into(),
                pivot: Vec3::zeros(),
            },
            material: 0,
        };
        let velocity = wall.velocity(Vec3::new(3.0, 1.0, 0.0), 2.0);
        assert!((velocity - Vec3::new(-1.0, 2.0, 0.0)).norm() < 1e-15);
    }

    #[test]
    fn a_moved_surface_keeps_its_distance_to_the_matter_that_moves_with_it() {
        let axis = Vec3::new(0.6, 0.0, 0.8);
        let steady = Motion {
            velocity: Vec3::new(0.3, -0.2, 0.1).into(),
            angular_velocity: Vec3::new(0.5, 2.0, -1.0).into(),
            pivot: Vec3::new(1.0, 0.5, -0.5),
        };
        let swing =
            |mean: Vec3, amplitude| TimeFunction::Oscillation { mean, amplitude, frequency: 0.7, phase: 1.0 };
        let shaken = Motion {
            velocity: swing(Vec3::zeros(), Vec3::new(0.3, -0.2, 0.1)),
            angular_velocity: swing(Vec3::new(0.2, 0.8, -0.4), Vec3::new(-0.5, -2.0, 1.0)),
            ..steady
        };
        let plane = Surface::Plane { point: Vec3::new(0.2, 0.1, 0.0), normal: axis };
        let pipe = Surface::Cylinder { point: Vec3::new(0.2, 0.1, 0.0), axis, radius: 2.0, pipe: true };
        let cases = [steady, shaken]
            .into_iter()
            .flat_map(|motion| [(plane.clone(), motion.clone()), (pipe.clone(), motion)]);
        for (surface, motion) in cases {
            let wall = Wall { name: "moving".into(), surface: surface.clone(), motion, material: 0 };
            // A point that moves with the wall, followed in small steps of second order.
            let mut dust = Vec3::new(-0.4, 0.7, 1.1);
            let distance = surface.distance(dust);
            let steps = 20_000;
            let dt = 3.0 / f64::from(steps);
            for n in 0..steps {
                let time = f64::from(n) * dt;
                let half = dust + wall.velocity(dust, time) * (0.5 * dt);
                dust += wall.velocity(half, time + 0.5 * dt) * dt;
            }
            let moved = wall.surface_at(3.0);
            assert!((moved.distance(dust) - distance).abs() < 1e-6);
            assert!((moved.normal(dust).norm() - 1.0).abs() < 1e-14);
            assert!((moved.distance(dust) - surface.distance(dust)).abs() > 0.1, "it did move");
        }
    }

    #[test]
    fn a_wall_at_rest_keeps_its_bits_and_one_that_only_slides_its_normal() {
        let surface = Surface::Plane { point: Vec3::new(0.1, 0.2, 0.3), normal: Vec3::new(0.6, 0.0, 0.8) };
        let still = Motion { pivot: Vec3::x(), ..Motion::default() };
        assert_eq!(surface.moved(&still, 1e3), surface);
        let sliding = Motion { velocity: Vec3::new(0.8, 0.0, -0.6).into(), ..still };
        let moved = surface.moved(&sliding, 7.0);
        assert_eq!(moved.normal(Vec3::zeros()), surface.normal(Vec3::zeros()));
        assert!((moved.distance(Vec3::x()) - surface.distance(Vec3::x())).abs() < 1e-14);
    }
}
