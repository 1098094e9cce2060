//! Walls from mesh files.

use super::super::checks::Document;
use super::super::file::{LengthUnit, SideKind, WallMeshSection};
use super::super::files::Files;
use super::PlacedWall;
use crate::contact::{CohesionLaw, ContactModel};
use crate::domain::Domain;
use crate::error::Result;
use crate::math::{Quat, Vec3, bounding_box};
use crate::mesh;
use crate::particle::Template;
use crate::wall::{FreeSide, PlacedMesh};
use std::sync::Arc;

/// Extent of a mesh over that of the box from which on it is taken for one in another unit.
const LARGEST: f64 = 100.0;

/// Reads the mesh of a wall, whose section has this key; adds notes on it.
pub(super) fn placed(
    document: &Document,
    (files, notes): (&Files, &mut Vec<String>),
    (key, name): (&str, &str),
    section: &WallMeshSection,
) -> Result<PlacedMesh> {
    let (key, path) = (format!("{key}.mesh"), files.path(&section.file));
    let file = format!("{key}.file");
    let unit = section.unit.map_or(1.0, LengthUnit::metres);
    let free = section.side.map(|side| match side {
        SideKind::Outside => FreeSide::Outside,
        SideKind::Inside => FreeSide::Inside,
        SideKind::Both => FreeSide::Both,
    });
    let read = files.mesh(&section.file).and_then(|bytes| mesh::wall(&path, &bytes, unit, free));
    let (mesh, of_file) = read.map_err(|error| {
        let title = format!("the mesh of the wall \"{name}\", {error}");
        document.error(&file, &title, "no wall can be made of this", "")
    })?;
    notes.extend(
        of_file
            .iter()
            .map(|note| document.warning(&file, &format!("{}: {note}", path.display()), "this mesh", "")),
    );
    let orientation = match &section.orientation {
        Some(given) => document.orientation(&format!("{key}.orientation"), given)?,
        None => Quat::identity(),
    };
    Ok(PlacedMesh { mesh: Arc::new(mesh), position: section.position.into(), orientation })
}

/// The box that holds a mesh where it is at the start (m).
pub(in crate::case) fn bounds(placed: &PlacedMesh) -> [Vec3; 2] {
    let corners = placed.mesh.vertices().iter().map(|vertex| placed.to_world(vertex));
    bounding_box(corners).into()
}

/// Refuses a mesh that has no part in the box, or is so large that its unit must be another one.
pub(super) fn meets_the_box(document: &Document, domain: &Domain, wall: &PlacedWall) -> Result<()> {
    let Some(placed) = wall.wall.surface.mesh() else { return Ok(()) };
    let (size, [low, high], name) = (domain.size(), bounds(placed), &wall.wall.name);
    let (extent, key) = ((high - low).max(), format!("{}.mesh.file", wall.key));
    let place = format!(
        "it reaches from ({:.3e}, {:.3e}, {:.3e}) to ({:.3e}, {:.3e}, {:.3e}) m, the box from the origin to ({:.3e}, {:.3e}, {:.3e}) m",
        low.x, low.y, low.z, high.x, high.y, high.z, size.x, size.y, size.z
    );
    if extent > LARGEST * size.max() {
        let times = extent / size.max();
        let title = format!("the mesh of the wall \"{name}\" is {times:.0} times as large as the box");
        let remedy = format!("{place}; are its lengths millimetres? Then add unit = \"mm\" to `mesh`");
        return Err(document.error(&key, &title, "in this unit", &remedy));
    }
    let margin = 1e-9 * size.max();
    let meets = (0..3).all(|i| low[i] <= size[i] + margin && high[i] >= -margin);
    let is_still = wall.wall.motion.rests();
    let container = placed.mesh.free() == FreeSide::Inside;
    let what = if !meets && (is_still || container) {
        "lies outside the box"
    } else if placed.mesh.free() == FreeSide::Outside && encloses_all(placed, &size) {
        "leaves no free space in the box"
    } else {
        return Ok(());
    };
    let title = format!("the mesh of the wall \"{name}\" {what}");
    let remedy = match placed.mesh.free() {
        FreeSide::Outside if meets => {
            format!("{place}; for the free space inside of a container take side = \"inside\"")
        }
        _ => format!("{place}; move it by `position`, or give its `unit`"),
    };
    Err(document.error(&key, &title, "this wall", &remedy))
}

/// Note on a mesh in a fluid with cells of this edge (m), which takes sheets and what is thinner than a cell as walls half-way
/// between cells, at rest.
pub(super) fn thin_for_cells(document: &Document, dx: f64, wall: &PlacedWall) -> Result<Option<String>> {
    let Some(placed) = wall.wall.surface.mesh() else { return Ok(None) };
    let (key, name) = (format!("{}.mesh.file", wall.key), &wall.wall.name);
    let thinnest = match placed.mesh.free() {
        FreeSide::Outside => placed.mesh.thinnest(),
        FreeSide::Inside => None,
        FreeSide::Both => Some(0.0),
    };
    let Some(thinnest) = thinnest.filter(|width| *width < dx) else { return Ok(None) };
    let cells = thinnest / dx;
    if !wall.wall.motion.rests() {
        let title =
            format!("the mesh of the wall \"{name}\" turns, and is {cells:.2} cells thin at the narrowest");
        let remedy =
            "in a fluid only what is at least a cell thick may turn; refine the lattice, or make it thicker";
        return Err(document.error(&key, &title, "turns", remedy));
    }
    let title = match placed.mesh.free() {
        FreeSide::Both => format!("the mesh of the wall \"{name}\" is a sheet"),
        _ => format!("the mesh of the wall \"{name}\" is {cells:.2} cells thin at the narrowest"),
    };
    let remedy = "a closed mesh of at least a cell lies in the fluid where it is";
    Ok(Some(document.warning(&key, &title, "for the fluid half-way between cells", remedy)))
}

/// True if all corners of the box and its middle are in the wall.
fn encloses_all(placed: &PlacedMesh, size: &Vec3) -> bool {
    let inner = |n: usize| Vec3::from_fn(|i, _| size[i] * if n >> i & 1 == 0 { 0.01 } else { 0.99 });
    let all = (0..8).map(inner).chain([size * 0.5]);
    all.map(|at| placed.to_own(&at)).all(|at| placed.mesh.is_wall(&at))
}

/// Refuses what has no force beside a mesh: laws that act over gaps, and bodies that go through the box.
pub(in crate::case) fn refuse_beside_meshes(
    document: &Document,
    walls: &[PlacedWall],
    templates: &[Template],
    model: &ContactModel,
) -> Result<()> {
    let Some(wall) = walls.iter().find(|placed| placed.wall.surface.mesh().is_some()) else { return Ok(()) };
    let what = if model.cohesion == CohesionLaw::Jkr {
        "`contact.cohesion` is \"jkr\", whose necks"
    } else if model.van_der_waals.is_some() {
        "the forces of `contact.van_der_waals`"
    } else if templates.iter().any(|template| template.shape.passage().is_some()) {
        "bodies that go through the box"
    } else {
        return Ok(());
    };
    let title = format!("{what} cannot be beside the mesh of the wall \"{}\"", wall.wall.name);
    let remedy =
        "take planes, pipes and rods; beside meshes there are the other laws of contact (docs/limits.md)";
    Err(document.error(&wall.key, &title, "a mesh", remedy))
}
