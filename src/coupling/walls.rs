//! Walls as the fluid knows them: cells whose centres lie in a wall, and steady motions in lattice units.

use crate::fluid::WallMotion;
use crate::math::Vec3;
use crate::units::Units;
use crate::wall::{Surface, Wall};

/// Sines of angles and relative lengths below this count as zero.
const TOLERANCE: f64 = 1e-9;

/// Says what is wrong with the motion of a wall that a fluid meets: its surface must stay where it is, and the velocity of
/// its matter at a place must not change in time. So a plane slides along itself or turns about its normal (not both),
/// and a cylinder slides along its axis and turns about it.
///
/// # Errors
/// What the wall does instead, as the end of a sentence that begins with its name.
pub fn check_motion(wall: &Wall) -> Result<(), &'static str> {
    let (v, w) = (wall.motion.velocity, wall.motion.angular_velocity);
    let along = |a: &Vec3, b: &Vec3| a.cross(b).norm() <= TOLERANCE * a.norm();
    match wall.surface {
        Surface::Plane { normal, .. } => {
            if v.dot(&normal).abs() > TOLERANCE * v.norm() {
                Err("moves along its normal")
            } else if !along(&w, &normal) {
                Err("turns about another axis than its normal")
            } else if v != Vec3::zeros() && w != Vec3::zeros() {
                Err("slides and turns at once")
            } else {
                Ok(())
            }
        }
        Surface::Cylinder {
            point, axis, radius, ..
        } => {
            let off_axis = (wall.motion.pivot - point).cross(&axis).norm();
            if !along(&v, &axis) {
                Err("moves across its axis")
            } else if !along(&w, &axis) || (w != Vec3::zeros() && off_axis > TOLERANCE * radius) {
                Err("turns about another axis than its own")
            } else {
                Ok(())
            }
        }
    }
}

/// All walls of a case in lattice units.
#[derive(Clone, Debug)]
pub struct LatticeWalls {
    surfaces: Vec<Surface>,
    motions: Vec<WallMotion>,
    dx: f64,
}

impl LatticeWalls {
    /// From walls that pass [`check_motion`]; every closed face of the box is one of them.
    pub fn new(walls: &[Wall], units: &Units) -> Self {
        let Units { dx, dt, .. } = *units;
        for wall in walls {
            if let Err(what) = check_motion(wall) {
                panic!("wall {} {what}, which the fluid cannot follow", wall.name);
            }
        }
        let motion = |wall: &Wall| WallMotion {
            velocity: (wall.motion.velocity * (dt / dx)).into(),
            angular_velocity: (wall.motion.angular_velocity * dt).into(),
            pivot: (wall.motion.pivot / dx).into(),
        };
        Self {
            surfaces: walls.iter().map(|wall| wall.surface).collect(),
            motions: walls.iter().map(motion).collect(),
            dx,
        }
    }

    /// The first wall that holds the centre of a cell.
    pub fn wall_of(&self, cell: [i64; 3]) -> Option<usize> {
        let centre = Vec3::from(cell.map(|n| (n as f64 + 0.5) * self.dx));
        self.surfaces
            .iter()
            .position(|surface| surface.distance(centre) < 0.0)
    }

    /// How they move.
    pub fn motions(&self) -> &[WallMotion] {
        &self.motions
    }
}
