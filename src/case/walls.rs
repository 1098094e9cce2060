//! Closed faces of the box and other walls.

use super::checks::Alternative;
use super::file::{Case, WallSection};
use super::located::Located;
use super::materials::Materials;
use super::source::Source;
use crate::coupling::check_motion;
use crate::domain::Domain;
use crate::error::Result;
use crate::math::Vec3;
use crate::wall::{Motion, Surface, Wall};
use std::ops::Range;

/// Points in each direction at which the faces of the box are looked at.
const SAMPLES: usize = 17;

/// Most points in each direction at which the free volume is measured.
const FINEST: usize = 256;

/// A wall and where the case says so (empty for a face that is not mentioned).
#[derive(Clone, Debug)]
pub(super) struct PlacedWall {
    pub(super) wall: Wall,
    /// Whether it is a closed face of the box.
    pub(super) is_face: bool,
    pub(super) span: Range<usize>,
}

/// Names of the axes.
const AXES: [&str; 3] = ["x", "y", "z"];

/// All walls: the closed faces, lower before upper, then those listed.
///
/// `reach` (m) is how far a particle extends from its centre at most.
pub(super) fn walls(
    source: &Source,
    case: &Case,
    domain: &Domain,
    materials: &Materials,
    reach: f64,
) -> Result<Vec<PlacedWall>> {
    let builder = Builder { source, case, domain, materials };
    let mut walls = builder.faces()?;
    for (index, section) in case.walls.iter().enumerate() {
        let placed = builder.listed(index, section)?;
        if walls.iter().any(|other| other.wall.name == placed.wall.name) {
            let title = format!("`walls.{index}.name` is \"{}\", the name of another wall", placed.wall.name);
            let span = &section.value.name.span;
            return Err(source.error(span, &title, "given twice", "every wall needs a name of its own"));
        }
        builder.meets_the_box(&placed)?;
        builder.agrees_with_periodic_faces(&placed, reach)?;
        walls.push(placed);
    }
    if case.dry.is_none() {
        for PlacedWall { wall, span, .. } in &walls {
            check_motion(wall).map_err(|what| {
                source.error(
                    span,
                    &format!("the wall \"{}\" {what}", wall.name),
                    "a fluid cannot follow this",
                    "with a fluid a plane slides along itself or turns about its normal, a pipe or rod slides along its \
                     axis and turns about it; dry runs may have any motion",
                )
            })?;
        }
    }
    Ok(walls)
}

/// Volume of the box that is in no wall (m^3).
pub(super) fn free_volume(domain: &Domain, walls: &[PlacedWall]) -> f64 {
    let size = domain.size();
    // The closed faces take nothing away.
    let walls: Vec<&PlacedWall> = walls.iter().filter(|placed| !placed.is_face).collect();
    if walls.is_empty() {
        return domain.volume();
    }
    let grid = domain.cells.map(|n| n.min(FINEST));
    let mut free = 0_usize;
    for n in 0..grid.iter().product() {
        let index = [n % grid[0], n / grid[0] % grid[1], n / (grid[0] * grid[1])];
        let at = Vec3::from_fn(|i, _| size[i] * (index[i] as f64 + 0.5) / grid[i] as f64);
        free += usize::from(walls.iter().all(|wall| wall.wall.surface.distance(at) > 0.0));
    }
    domain.volume() * free as f64 / grid.iter().product::<usize>() as f64
}

struct Builder<'a> {
    source: &'a Source,
    case: &'a Case,
    domain: &'a Domain,
    materials: &'a Materials,
}

impl Builder<'_> {
    fn faces(&self) -> Result<Vec<PlacedWall>> {
        let mut walls = Vec::new();
        let size = self.domain.size();
        for (n, (name, face)) in self.case.domain.faces.named().into_iter().enumerate() {
            let (axis, upper) = (n / 2, n % 2 == 1);
            if self.domain.periodic[axis] {
                if let Some(face) = face {
                    let remedy = format!(
                        "close the direction by `periodic`, with false for {}, or remove the face",
                        AXES[axis]
                    );
                    let title = format!("the face \"{name}\" is periodic, not a wall");
                    return Err(self.source.error(&face.span, &title, "no wall here", &remedy));
                }
                continue;
            }
            let mut middle = size * 0.5;
            middle[axis] = if upper { size[axis] } else { 0.0 };
            let key = format!("domain.faces.{name}");
            let (mut motion, mut material) = (Motion::default(), 0);
            motion.pivot = middle;
            if let Some(face) = face {
                let rotation = &face.value.rotation;
                let turns = self.source.satisfies(
                    &format!("{key}.rotation"),
                    rotation,
                    |_| true,
                    "a finite number",
                    "in 1/s, about the axis of the direction of the face",
                )?;
                if let (true, Some(other)) =
                    (turns != 0.0, (0..3).find(|&other| other != axis && self.domain.periodic[other]))
                {
                    let title = format!(
                        "the face \"{name}\" turns, but {} is periodic: its velocity would jump there",
                        AXES[other]
                    );
                    let remedy =
                        "close the directions along a face that turns, or let it slide by `velocity`";
                    return Err(self.source.error(&rotation.span, &title, "turns", remedy));
                }
                motion.velocity =
                    self.source.vector(&format!("{key}.velocity"), &face.span, &face.value.velocity)?;
                motion.angular_velocity = Vec3::ith(axis, turns);
                let name = face.value.material.as_ref();
                material = self.materials.index(self.source, &format!("{key}.material"), name)?;
            }
            walls.push(PlacedWall {
                wall: Wall {
                    name: name.to_string(),
                    surface: Surface::Plane {
                        point: middle,
                        normal: Vec3::ith(axis, if upper { -1.0 } else { 1.0 }),
                    },
                    motion,
                    material,
                },
                is_face: true,
                span: face.map_or(0..0, |face| face.span.clone()),
            });
        }
        Ok(walls)
    }

    fn listed(&self, index: usize, section: &Located<WallSection>) -> Result<PlacedWall> {
        let (key, span, wall) = (format!("walls.{index}"), &section.span, &section.value);
        let name = wall.name.value.trim();
        if name.is_empty() {
            let title = format!("`{key}.name` is empty");
            return Err(self.source.error(&wall.name.span, &title, "no name", "e.g. \"piston\""));
        }
        let choices: [(_, &dyn Alternative); 3] =
            [("plane", &wall.plane), ("pipe", &wall.pipe), ("rod", &wall.rod)];
        let chosen = self.source.exactly_one(&key, span, &choices)?;
        let key_of = |field: &str| format!("{key}.{chosen}.{field}");
        let surface = if let Some(plane) = &wall.plane {
            Surface::Plane {
                point: self.source.vector(&key_of("point"), &plane.span, &plane.value.point)?,
                normal: self.source.direction(&key_of("normal"), &plane.span, &plane.value.normal)?,
            }
        } else {
            let round = wall.pipe.as_ref().or(wall.rod.as_ref());
            let round = round.expect("checked by exactly_one");
            Surface::Cylinder {
                point: self.source.vector(&key_of("point"), &round.span, &round.value.point)?,
                axis: self.source.direction(&key_of("axis"), &round.span, &round.value.axis)?,
                radius: 0.5 * round.value.diameter.value,
                pipe: wall.pipe.is_some(),
            }
        };
        let (Surface::Plane { point, .. } | Surface::Cylinder { point, .. }) = surface;
        let motion = Motion {
            velocity: self.source.vector(&format!("{key}.velocity"), span, &wall.velocity)?,
            angular_velocity: self.source.vector(
                &format!("{key}.angular_velocity"),
                span,
                &wall.angular_velocity,
            )?,
            pivot: match &wall.pivot {
                Some(pivot) => self.source.vector(&format!("{key}.pivot"), span, pivot)?,
                None => point,
            },
        };
        let material = wall.material.as_ref();
        Ok(PlacedWall {
            wall: Wall {
                name: name.to_string(),
                surface,
                motion,
                material: self.materials.index(self.source, &format!("{key}.material"), material)?,
            },
            is_face: false,
            span: span.clone(),
        })
    }

    /// Refuses a wall that leaves nothing of the box, or that has no part in it.
    fn meets_the_box(&self, placed: &PlacedWall) -> Result<()> {
        let size = self.domain.size();
        let (mut nearest, mut furthest) = (f64::INFINITY, f64::NEG_INFINITY);
        for n in 0..SAMPLES * SAMPLES * SAMPLES {
            let index = [n % SAMPLES, n / SAMPLES % SAMPLES, n / (SAMPLES * SAMPLES)];
            let at = Vec3::from_fn(|i, _| size[i] * index[i] as f64 / (SAMPLES - 1) as f64);
            let distance = placed.wall.surface.distance(at);
            nearest = nearest.min(distance);
            furthest = furthest.max(distance);
        }
        // A rod may be thinner than the samples are apart.
        if let Surface::Cylinder { point, pipe: false, .. } = placed.wall.surface {
            let inside = (0..3).all(|i| (0.0..=size[i]).contains(&point[i]));
            nearest = if inside { nearest.min(0.0) } else { nearest };
        }
        let margin = 1e-9 * size.max();
        let what = if furthest <= margin {
            "leaves no free space in the box"
        } else if nearest > margin {
            "lies outside the box"
        } else {
            return Ok(());
        };
        let title = format!("the wall \"{}\" {what}", placed.wall.name);
        let remedy = format!(
            "the box reaches from the origin to ({:.6e}, {:.6e}, {:.6e}) m; a normal points from the wall into the free \
             space",
            size.x, size.y, size.z
        );
        Err(self.source.error(&placed.span, &title, "this wall", &remedy))
    }

    /// Refuses a wall that is not the same on both sides of a periodic pair of faces, unless it is far from them.
    fn agrees_with_periodic_faces(&self, placed: &PlacedWall, reach: f64) -> Result<()> {
        let size = self.domain.size();
        for axis in (0..3).filter(|&i| self.domain.periodic[i]) {
            for n in 0..SAMPLES * SAMPLES {
                let (mut low, across) = (Vec3::zeros(), [n % SAMPLES, n / SAMPLES]);
                for (k, j) in [(axis + 1) % 3, (axis + 2) % 3].into_iter().enumerate() {
                    low[j] = size[j] * across[k] as f64 / (SAMPLES - 1) as f64;
                }
                let mut high = low;
                high[axis] = size[axis];
                let [a, b] = [low, high].map(|at| placed.wall.surface.distance(at));
                let same = (a - b).abs() <= 1e-9 * size.max();
                let both_solid = a < 0.0 && b < 0.0;
                let both_far = a > reach && b > reach;
                if !(same || both_solid || both_far) {
                    let name = AXES[axis];
                    let title = format!(
                        "the wall \"{}\" meets the periodic faces in {name}, and not both of them alike",
                        placed.wall.name
                    );
                    let remedy = format!(
                        "walls run straight through periodic faces, or keep {reach:.3e} m away from them; close {name} by \
                         `domain.periodic`, or move the wall"
                    );
                    return Err(self.source.error(&placed.span, &title, "this wall", &remedy));
                }
            }
        }
        Ok(())
    }
}
