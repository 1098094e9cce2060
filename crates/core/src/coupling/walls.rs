//! Walls as cells of the lattice: cells whose centres are in a wall, and motions in lattice units.

use crate::fluid::WallMotion;
use crate::math::{TimeFunction, Vec3};
use crate::units::Units;
use crate::wall::{Inlet, Motion, Surface, Wall};
use std::collections::BTreeMap;

/// Sines of angles and relative lengths below this count as zero.
const TOLERANCE: f64 = 1e-9;

/// Checks the motion of a wall in contact with fluid: its surface must not move, and the velocity of its material at
/// a position must change with that of the wall alone. So a plane slides along itself or turns about its normal (not both), and a
/// cylinder slides along its axis and turns about it.
///
/// # Errors
/// The motion that is not possible, as the end of a sentence that begins with the name of the wall.
pub fn check_motion(wall: &Wall) -> Result<(), &'static str> {
    let [v, w] = [&wall.motion.velocity, &wall.motion.angular_velocity].map(TimeFunction::span);
    let all_along =
        |of: &[Vec3], axis: &Vec3| of.iter().all(|a| a.cross(axis).norm() <= TOLERANCE * a.norm());
    let turns = !wall.motion.angular_velocity.is_zero();
    match &wall.surface {
        Surface::Mesh(_) => Err("is a mesh, which only dry runs have"),
        Surface::Plane { normal, .. } => {
            if v.iter().any(|v| v.dot(normal).abs() > TOLERANCE * v.norm()) {
                Err("moves along its normal")
            } else if !all_along(&w, normal) {
                Err("turns about another axis than its normal")
            } else if turns && !wall.motion.velocity.is_zero() {
                Err("slides and turns at once")
            } else {
                Ok(())
            }
        }
        Surface::Cylinder { point, axis, radius, .. } => {
            let off_axis = (wall.motion.pivot - point).cross(axis).norm();
            if !all_along(&v, axis) {
                Err("moves across its axis")
            } else if !all_along(&w, axis) || (turns && off_axis > TOLERANCE * *radius) {
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
    motions: Vec<Motion>,
    /// By number of the wall.
    inlets: BTreeMap<usize, Inlet>,
    /// Pressures (Pa) along x of outlets that vary it, by number of the wall.
    pressures: BTreeMap<usize, TimeFunction>,
    units: Units,
}

impl LatticeWalls {
    /// From walls that pass [`check_motion`]; every closed face of the box is one of them.
    pub fn new(walls: &[Wall], units: &Units) -> Self {
        for wall in walls {
            if let Err(what) = check_motion(wall) {
                panic!("wall {} {what}, which the fluid cannot follow", wall.name);
            }
        }
        Self {
            surfaces: walls.iter().map(|wall| wall.surface.clone()).collect(),
            motions: walls.iter().map(|wall| wall.motion.clone()).collect(),
            inlets: BTreeMap::new(),
            pressures: BTreeMap::new(),
            units: *units,
        }
    }

    /// The same walls, through some of which, given by their numbers, fluid comes in, or leaves at a pressure (Pa, the component along x)
    /// that varies.
    #[must_use]
    pub fn with_open(
        self,
        inlets: &BTreeMap<usize, Inlet>,
        pressures: &BTreeMap<usize, TimeFunction>,
    ) -> Self {
        Self { inlets: inlets.clone(), pressures: pressures.clone(), ..self }
    }

    /// The first wall that holds the centre of a cell.
    pub fn wall_of(&self, cell: [i64; 3]) -> Option<usize> {
        let centre = Vec3::from(cell.map(|n| (n as f64 + 0.5) * self.units.dx));
        self.surfaces.iter().position(|surface| surface.distance(centre) < 0.0)
    }

    /// Part of the way from the centre of a cell to that of the next one along a direction at which a wall is met.
    pub fn part_of_link(&self, wall: usize, cell: [i64; 3], direction: [isize; 3]) -> f64 {
        let from = Vec3::from(cell.map(|n| (n as f64 + 0.5) * self.units.dx));
        let way = Vec3::from(direction.map(|c| c as f64 * self.units.dx));
        self.surfaces[wall].part_of_way(from, from + way)
    }

    /// True if one of them changes its motion in time.
    pub fn vary(&self) -> bool {
        let varies = |inlet: &Inlet| inlet.velocity.constant().is_none();
        self.motions.iter().any(|motion| !motion.is_steady())
            || self.inlets.values().any(varies)
            || !self.pressures.is_empty()
    }

    /// Their motions in the middle of the step after `step` steps, when populations meet them; before the first step in that of the
    /// step that led to the start.
    pub fn motions(&self, step: Option<u64>) -> Vec<WallMotion> {
        let Units { dx, dt, .. } = self.units;
        let time = step.map_or(-0.5, |step| step as f64 + 0.5) * dt;
        let motion = |motion: &Motion| WallMotion {
            velocity: (motion.velocity.at(time) * (dt / dx)).into(),
            angular_velocity: (motion.angular_velocity.at(time) * dt).into(),
            pivot: (motion.pivot / dx).into(),
            varies: !motion.is_steady(),
            ..WallMotion::default()
        };
        let mut motions: Vec<WallMotion> = self.motions.iter().map(motion).collect();
        for (&wall, Inlet { velocity, profile, patch }) in &self.inlets {
            motions[wall].velocity = (velocity.at(time) * (dt / dx)).into();
            motions[wall].varies = velocity.constant().is_none();
            motions[wall].profile = profile.scaled(1.0 / dx);
            motions[wall].patch = patch.map(|patch| patch.scaled(1.0 / dx));
        }
        for (&wall, pressure) in &self.pressures {
            motions[wall].excess = pressure.at(time).x / self.units.pressure();
        }
        motions
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Profile;

    fn wall(
        surface: Surface,
        velocity: impl Into<TimeFunction>,
        angular_velocity: impl Into<TimeFunction>,
        pivot: Vec3,
    ) -> Wall {
        let motion = Motion { velocity: velocity.into(), angular_velocity: angular_velocity.into(), pivot };
        Wall { name: "wall".into(), surface, motion, material: 0 }
    }

    /// Zero at all times but one, where it is `value`.
    fn once(value: Vec3) -> TimeFunction {
        TimeFunction::Table([(0.0, Vec3::zeros()), (1.0, value), (2.0, Vec3::zeros())].into())
    }

    const PLANE: Surface =
        Surface::Plane { point: Vec3::new(0.0, 0.0, 0.5), normal: Vec3::new(0.6, 0.0, 0.8) };
    const ROD: Surface = Surface::Cylinder {
        point: Vec3::new(1.0, 2.0, 0.0),
        axis: Vec3::new(0.0, 0.0, 1.0),
        radius: 0.5,
        pipe: false,
    };

    #[test]
    fn walls_that_leave_their_place_or_change_their_velocity_are_refused() {
        let (o, x, y, z) = (Vec3::zeros(), Vec3::x(), Vec3::y(), Vec3::z());
        let (along, across) = (Vec3::new(0.8, 0.0, -0.6), Vec3::new(0.6, 0.0, 0.8));
        let good = [
            wall(PLANE, along + y, o, o),
            wall(PLANE, o, 3.0 * across, x),
            wall(ROD, 2.0 * z, -z, Vec3::new(1.0, 2.0, 7.0)),
            wall(ROD, o, o, o),
            wall(PLANE, once(along), o, o),
            wall(ROD, z, once(z), Vec3::new(1.0, 2.0, 7.0)),
        ];
        for wall in good {
            assert_eq!(check_motion(&wall), Ok(()), "{wall:?}");
        }
        let bad = [
            (wall(PLANE, x, o, o), "moves along its normal"),
            (wall(PLANE, o, along, o), "turns about another axis than its normal"),
            (wall(PLANE, y, across, o), "slides and turns at once"),
            (wall(ROD, x + z, o, o), "moves across its axis"),
            (wall(ROD, o, y, o), "turns about another axis than its own"),
            (wall(ROD, o, z, o), "turns about another axis than its own"),
            (wall(PLANE, once(x), o, o), "moves along its normal"),
            (wall(PLANE, y, once(across), o), "slides and turns at once"),
            (wall(ROD, o, once(z), o), "turns about another axis than its own"),
        ];
        for (wall, what) in bad {
            assert_eq!(check_motion(&wall), Err(what), "{wall:?}");
        }
    }

    #[test]
    fn a_cell_belongs_to_the_first_wall_that_holds_its_centre_and_moves_like_it() {
        let units = Units { dx: 0.25, dt: 0.01, density: 1000.0 };
        let turning = wall(ROD, Vec3::zeros(), 4.0 * Vec3::z(), Vec3::new(1.0, 2.0, 0.0));
        let walls = LatticeWalls::new(
            &[turning.clone(), wall(PLANE, Vec3::y(), Vec3::zeros(), Vec3::zeros())],
            &units,
        );
        assert_eq!(walls.wall_of([3, 7, 1]), Some(0));
        // Of this plane the cells with 0.6 x + 0.8 z < 0.4 are wall; the rod comes first.
        assert_eq!(walls.wall_of([0, -9, 0]), Some(1));
        assert_eq!(walls.wall_of([2, 7, 0]), Some(0));
        assert_eq!(walls.wall_of([0, 0, 2]), None);
        let place = [5.5, 7.25, 1.0];
        let exact = turning.velocity(Vec3::from(place) * units.dx, 0.0) / units.velocity();
        let lattice = Vec3::from(walls.motions(None)[0].at(place));
        assert!((lattice - exact).norm() < 1e-15);
    }

    #[test]
    fn an_inlet_moves_like_its_fluid_and_its_profile_has_lengths_in_cells() {
        let units = Units { dx: 0.25, dt: 0.01, density: 1000.0 };
        let profile = Profile::Parabolic([Some([0.0, 1.0]), None, None]);
        let inlet = Inlet { velocity: once(2.0 * Vec3::z()), profile, patch: None };
        let floor = wall(PLANE, Vec3::zeros(), Vec3::zeros(), Vec3::zeros());
        let walls = LatticeWalls::new(&[floor], &units).with_open(&[(0, inlet)].into(), &BTreeMap::new());
        let motion = walls.motions(Some(50))[0];
        assert!(walls.vary() && motion.varies);
        // Half-way between two walls that are four cells apart.
        let [x, y, z] = motion.at([2.0, 7.0, 0.0]);
        assert!(x == 0.0 && y == 0.0 && (z - 1.5 * 1.01 * 0.04).abs() < 1e-15, "{z}");
    }

    #[test]
    fn a_wall_whose_velocity_varies_has_that_of_the_middle_of_a_step() {
        let units = Units { dx: 0.25, dt: 0.01, density: 1000.0 };
        let walls = LatticeWalls::new(&[wall(PLANE, once(Vec3::y()), Vec3::zeros(), Vec3::zeros())], &units);
        assert!(walls.vary() && walls.motions(None)[0].varies);
        for (step, expected) in [(None, 0.0), (Some(0), 0.005), (Some(100), 0.995), (Some(300), 0.0)] {
            let velocity = walls.motions(step)[0].velocity[1];
            assert!((velocity - expected * units.dt / units.dx).abs() < 1e-15, "{step:?}: {velocity}");
        }
    }
}
