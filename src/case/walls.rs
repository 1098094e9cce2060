//! Closed faces of the box and other walls.

mod mesh;

use super::checks::Document;
use super::file::{FACES, RoundSection, WallSection, WallShape};
use super::files::Files;
use super::materials::Materials;
use crate::coupling::check_motion;
use crate::domain::{Domain, Face};
use crate::error::Result;
use crate::math::Vec3;
use crate::wall::{Motion, Surface, Wall};
pub(super) use mesh::{bounds as bounds_of_mesh, refuse_beside_meshes};

/// Points in each direction at which the faces of the box are looked at.
const SAMPLES: usize = 17;

/// Most points in each direction at which the free volume is measured.
const FINEST: usize = 256;
/// The same where there is a mesh.
const FINEST_AT_MESHES: usize = 64;

/// A wall, and the key of the case that describes it.
#[derive(Clone, Debug)]
pub(super) struct PlacedWall {
    pub(super) wall: Wall,
    /// True for a closed face of the box.
    pub(super) is_face: bool,
    pub(super) key: String,
}

/// Names of the axes.
const AXES: [&str; 3] = ["x", "y", "z"];

/// All walls: the closed faces, lower before upper, then those listed.
///
/// `reach` (m) is how far a particle extends from its centre at most. Adds notes on meshes.
pub(super) fn walls(
    document: &Document,
    domain: &Domain,
    materials: &Materials,
    (files, notes): (&Files, &mut Vec<String>),
    reach: f64,
) -> Result<Vec<PlacedWall>> {
    let builder = Builder { document, domain, materials };
    let mut walls = builder.faces()?;
    for (index, section) in document.case.walls.iter().enumerate() {
        let placed = builder.listed((files, notes), format!("walls.{index}"), section)?;
        if walls.iter().any(|other| other.wall.name == placed.wall.name) {
            let key = format!("{}.name", placed.key);
            let title = format!("`{key}` is \"{}\", the name of another wall", placed.wall.name);
            return Err(document.error(&key, &title, "given twice", "every wall needs a name of its own"));
        }
        builder.meets_the_box(&placed)?;
        builder.agrees_with_periodic_faces(&placed, reach)?;
        walls.push(placed);
    }
    if document.case.dry.is_none() {
        for placed in &walls {
            let PlacedWall { wall, key, .. } = placed;
            check_motion(wall).map_err(|what| {
                document.error(
                    key,
                    &format!("the wall \"{}\" {what}", wall.name),
                    "a fluid cannot follow this",
                    "with a fluid a plane slides along itself or turns about its normal, a pipe or rod slides along its \
                     axis and turns about it, and a closed mesh turns about an axis that it goes round, as a drum does; dry runs may have any \
                     motion. For a piston give the face an inlet with its velocity \
                     instead (docs/limits.md)",
                )
            })?;
            notes.extend(mesh::thin_for_cells(document, domain.dx, placed)?);
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
    let has_mesh = walls.iter().any(|placed| placed.wall.surface.mesh().is_some());
    let finest = if has_mesh { FINEST_AT_MESHES } else { FINEST };
    let counts = domain.cells.map(|n| n.min(finest));
    let points =
        grid(counts).map(|at| Vec3::from_fn(|i, _| size[i] * (at[i] as f64 + 0.5) / counts[i] as f64));
    let free = points.filter(|at| walls.iter().all(|wall| !wall.wall.surface.is_wall(*at))).count();
    domain.volume() * free as f64 / counts.iter().product::<usize>() as f64
}

/// Indices of a grid with this number of points in each direction, x fastest.
fn grid(counts: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
    let [x, y, z] = counts;
    (0..x * y * z).map(move |n| [n % x, n / x % y, n / (x * y)])
}

struct Builder<'a> {
    document: &'a Document<'a>,
    domain: &'a Domain,
    materials: &'a Materials,
}

impl Builder<'_> {
    fn faces(&self) -> Result<Vec<PlacedWall>> {
        let mut walls = Vec::new();
        let size = self.domain.size();
        for (n, name) in FACES.into_iter().enumerate() {
            let (axis, upper) = (n / 2, n % 2 == 1);
            let (key, face) = (format!("domain.faces.{name}"), self.document.case.domain.faces.get(name));
            if self.domain.faces[n] == Face::Periodic {
                if face.is_some() {
                    let remedy = format!(
                        "close the direction by `periodic`, with false for {}, or remove the face",
                        AXES[axis]
                    );
                    let title = format!("the face \"{name}\" is periodic, not a wall");
                    return Err(self.document.error(&key, &title, "no wall here", &remedy));
                }
                continue;
            }
            let mut middle = size * 0.5;
            middle[axis] = if upper { size[axis] } else { 0.0 };
            let (mut motion, mut material) = (Motion { pivot: middle, ..Motion::default() }, 0);
            if let Some(face) = face {
                let open = (0..3).find(|&other| other != axis && self.domain.is_periodic(other));
                if let (true, Some(open)) = (face.rotation != 0.0, open) {
                    let title = format!(
                        "the face \"{name}\" turns, but {} is periodic: its velocity would jump there",
                        AXES[open]
                    );
                    let remedy =
                        "close the directions along a face that turns, or let it slide by `velocity`";
                    return Err(self.document.error(&format!("{key}.rotation"), &title, "turns", remedy));
                }
                motion.velocity = face.velocity.function();
                motion.angular_velocity = Vec3::ith(axis, face.rotation).into();
                let key = format!("{key}.material");
                material = self.materials.index(self.document, &key, face.material.as_ref())?;
            }
            let normal = Vec3::ith(axis, if upper { -1.0 } else { 1.0 });
            let surface = Surface::Plane { point: middle, normal };
            let wall = Wall { name: name.to_string(), surface, motion, material };
            walls.push(PlacedWall { wall, is_face: true, key });
        }
        Ok(walls)
    }

    fn listed(
        &self,
        files: (&Files, &mut Vec<String>),
        key: String,
        section: &WallSection,
    ) -> Result<PlacedWall> {
        let name = section.name.trim();
        if name.is_empty() {
            let key = format!("{key}.name");
            return Err(self.document.error(
                &key,
                &format!("`{key}` is empty"),
                "no name",
                "e.g. \"piston\"",
            ));
        }
        let direction = |name: &str, of| self.document.direction(&format!("{key}.{name}"), of);
        let round = |round: &RoundSection, name: &str, pipe: bool| {
            let (axis, radius) = (direction(&format!("{name}.axis"), round.axis)?, 0.5 * round.diameter);
            Ok((Surface::Cylinder { point: round.point.into(), axis, radius, pipe }, round.point))
        };
        let (surface, point) = match &section.shape {
            WallShape::Plane(plane) => {
                let normal = direction("plane.normal", plane.normal)?;
                (Surface::Plane { point: plane.point.into(), normal }, plane.point)
            }
            WallShape::Pipe(pipe) => round(pipe, "pipe", true)?,
            WallShape::Rod(rod) => round(rod, "rod", false)?,
            WallShape::Mesh(section) => {
                let placed = mesh::placed(self.document, files, (&key, name), section)?;
                (Surface::Mesh(placed), section.position)
            }
        };
        let motion = Motion {
            velocity: section.velocity.function(),
            angular_velocity: section.angular_velocity.function(),
            pivot: section.pivot.unwrap_or(point).into(),
        };
        let material =
            self.materials.index(self.document, &format!("{key}.material"), section.material.as_ref())?;
        let wall = Wall { name: name.to_string(), surface, motion, material };
        Ok(PlacedWall { wall, is_face: false, key })
    }

    /// Refuses a wall that leaves nothing of the box, or that has no part in it.
    fn meets_the_box(&self, placed: &PlacedWall) -> Result<()> {
        if placed.wall.surface.mesh().is_some() {
            return mesh::meets_the_box(self.document, self.domain, placed);
        }
        let size = self.domain.size();
        let (mut nearest, mut furthest) = (f64::INFINITY, f64::NEG_INFINITY);
        for index in grid([SAMPLES; 3]) {
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
        Err(self.document.error(&placed.key, &title, "this wall", &remedy))
    }

    /// Refuses a wall that is not the same on both sides of a periodic pair of faces, unless it is far from them.
    fn agrees_with_periodic_faces(&self, placed: &PlacedWall, reach: f64) -> Result<()> {
        let size = self.domain.size();
        let clear = |axis: usize| {
            // A mesh may be far from the faces, which need no search then.
            placed.wall.surface.mesh().map(mesh::bounds).is_some_and(|[low, high]| {
                placed.wall.motion.rests() && low[axis] > reach && high[axis] < size[axis] - reach
            })
        };
        for axis in (0..3).filter(|&i| self.domain.is_periodic(i) && !clear(i)) {
            let mut counts = [SAMPLES; 3];
            counts[axis] = 1;
            for index in grid(counts) {
                let low = Vec3::from_fn(|i, _| size[i] * index[i] as f64 / (SAMPLES - 1) as f64);
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
                    return Err(self.document.error(&placed.key, &title, "this wall", &remedy));
                }
            }
        }
        Ok(())
    }
}
