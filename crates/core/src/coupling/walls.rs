//! Walls as cells of the lattice: cells whose centres are in a wall, and motions in lattice units.

use crate::domain::Domain;
use crate::fluid::WallMotion;
use crate::lattice::{C, Q};
use crate::math::{TimeFunction, Vec3};
use crate::units::Units;
use crate::wall::{Inlet, Motion, PlacedMesh, Surface, Wall};
use std::collections::BTreeMap;

/// Sines of angles and relative lengths below this count as zero.
const TOLERANCE: f64 = 1e-9;

/// Sine of the angle by which facets may differ from the surface of revolution that a mesh stands for: that of 12 facets round the axis.
const FACETED: f64 = 0.26;

/// Checks the motion of a wall in contact with fluid: its surface must not move, and the velocity of its material at
/// a position must change with that of the wall alone. So a plane slides along itself or turns about its normal (not both), a
/// cylinder slides along its axis and turns about it, and a mesh, which stays where it is at the start, turns about an axis that it goes
/// round, within the angle of [`FACETED`].
///
/// # Errors
/// The motion that is not possible, as the end of a sentence that begins with the name of the wall.
pub fn check_motion(wall: &Wall) -> Result<(), &'static str> {
    let [v, w] = [&wall.motion.velocity, &wall.motion.angular_velocity].map(TimeFunction::span);
    let all_along =
        |of: &[Vec3], axis: &Vec3| of.iter().all(|a| a.cross(axis).norm() <= TOLERANCE * a.norm());
    let turns = !wall.motion.angular_velocity.is_zero();
    match &wall.surface {
        Surface::Mesh(placed) => {
            if !wall.motion.velocity.is_zero() {
                Err("is a mesh that leaves its place")
            } else if turns && !placed.mesh.is_closed() {
                Err("is an open mesh that turns")
            } else if turns && !w.iter().all(|w| goes_round(placed, &wall.motion.pivot, w)) {
                Err("turns, and its mesh does not go round the axis")
            } else {
                Ok(())
            }
        }
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

/// True if the velocity of each facet of a mesh that turns is along it, but for [`FACETED`] of the fastest one of the mesh.
fn goes_round(placed: &PlacedMesh, pivot: &Vec3, angular_velocity: &Vec3) -> bool {
    let velocity = |at: &Vec3| angular_velocity.cross(&(at - pivot));
    let facets = 0..placed.mesh.facets().len() as u32;
    let fastest = facets.clone().flat_map(|facet| placed.corners(facet)).map(|at| velocity(&at).norm());
    let most = FACETED * fastest.fold(0.0, f64::max);
    facets.map(|facet| placed.corners(facet)).all(|[a, b, c]| {
        let normal = (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_default();
        [a, b, c].iter().all(|at| velocity(at).dot(&normal).abs() <= most)
    })
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
    /// Cells of the box along which it is periodic, 0 along the other axes.
    periods: [i64; 3],
}

impl LatticeWalls {
    /// From walls that pass [`check_motion`]; every closed face of the box is one of them. Meshes go on
    /// through its periodic faces.
    pub fn new(walls: &[Wall], units: &Units, domain: &Domain) -> Self {
        let cells = |a: usize| if domain.is_periodic(a) { domain.cells[a] as i64 } else { 0 };
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
            periods: std::array::from_fn(cells),
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
        let centre = self.centre(cell);
        self.surfaces.iter().position(|surface| surface.is_wall(centre))
    }

    /// Part of the way from the centre of a cell to that of the next one along a direction at which a wall is met.
    pub fn part_of_link(&self, wall: usize, cell: [i64; 3], direction: [isize; 3]) -> f64 {
        match &self.surfaces[wall] {
            // Where it is not met, as rounding has it, half-way.
            Surface::Mesh(placed) => self.meets(placed, cell, direction).unwrap_or(0.5),
            surface => {
                let from = self.centre(cell);
                surface.part_of_way(from, from + Vec3::from(direction.map(|c| c as f64 * self.units.dx)))
            }
        }
    }

    /// Meshes that the links from a cell of fluid to its neighbours meet, by direction of the lattice; none if no mesh is near.
    pub fn between(&self, cell: [i64; 3]) -> Option<[Option<usize>; Q]> {
        let centre = self.centre(cell);
        let mut all = [None; Q];
        let mut near = Vec::new();
        // The links of the cells at periodic faces may meet a mesh where they come in again.
        let beside = (0..3).any(|a| self.periods[a] > 0 && (cell[a] == 0 || cell[a] == self.periods[a] - 1));
        for (wall, surface) in self.surfaces.iter().enumerate() {
            let Some(placed) = surface.mesh() else { continue };
            // More than the longest link.
            let (own, reach) = (placed.to_own(&centre), Vec3::repeat(1.5 * self.units.dx));
            near.clear();
            placed.mesh.facets_in(&[own - reach, own + reach], &mut near);
            if near.is_empty() && !beside {
                continue;
            }
            for (i, met) in all.iter_mut().enumerate().skip(1).filter(|(_, met)| met.is_none()) {
                *met = self.meets(placed, cell, C[i]).map(|_| wall);
            }
        }
        all.iter().any(Option::is_some).then_some(all)
    }

    /// Part of the link from a cell of the box along a direction at which it meets a mesh; beyond a periodic face also where it comes in again. The
    /// same from both ends.
    fn meets(&self, placed: &PlacedMesh, cell: [i64; 3], direction: [isize; 3]) -> Option<f64> {
        let next: [i64; 3] = std::array::from_fn(|a| cell[a] + direction[a] as i64);
        let meets = |shift: [i64; 3]| {
            let [from, to] = [cell, next]
                .map(|cell| placed.to_own(&self.centre(std::array::from_fn(|a| cell[a] + shift[a]))));
            placed.mesh.crossing(&from, &to).map(|crossing| crossing.part)
        };
        let image = std::array::from_fn(|a| match self.periods[a] {
            0 => 0,
            period if next[a] < 0 => period,
            period if next[a] >= period => -period,
            _ => 0,
        });
        let here = meets([0; 3]);
        if image == [0; 3] { here } else { here.or_else(|| meets(image)) }
    }

    fn centre(&self, cell: [i64; 3]) -> Vec3 {
        Vec3::from(cell.map(|n| (n as f64 + 0.5) * self.units.dx))
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
            motions[wall].patch = patch.as_ref().map(|patch| patch.scaled(1.0 / dx));
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

    const BOX: Domain = Domain { faces: Domain::faces([false; 3]), cells: [8; 3], dx: 0.25 };

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
            &BOX,
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
        let walls =
            LatticeWalls::new(&[floor], &units, &BOX).with_open(&[(0, inlet)].into(), &BTreeMap::new());
        let motion = &walls.motions(Some(50))[0];
        assert!(walls.vary() && motion.varies);
        // Half-way between two walls that are four cells apart.
        let [x, y, z] = motion.at([2.0, 7.0, 0.0]);
        assert!(x == 0.0 && y == 0.0 && (z - 1.5 * 1.01 * 0.04).abs() < 1e-15, "{z}");
    }

    #[test]
    fn a_wall_whose_velocity_varies_has_that_of_the_middle_of_a_step() {
        let units = Units { dx: 0.25, dt: 0.01, density: 1000.0 };
        let walls =
            LatticeWalls::new(&[wall(PLANE, once(Vec3::y()), Vec3::zeros(), Vec3::zeros())], &units, &BOX);
        assert!(walls.vary() && walls.motions(None)[0].varies);
        for (step, expected) in [(None, 0.0), (Some(0), 0.005), (Some(100), 0.995), (Some(300), 0.0)] {
            let velocity = walls.motions(step)[0].velocity[1];
            assert!((velocity - expected * units.dt / units.dx).abs() < 1e-15, "{step:?}: {velocity}");
        }
    }
}
