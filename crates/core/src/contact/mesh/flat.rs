//! Polyhedra at a mesh: the body cut by facets.
//!
//! Behind each facet is a wedge, down to the planes through its edges that bisect the angles to the facets beyond: wedges of neighbours do
//! not overlap along edges, and leave nothing out there, but do not quite fit at corners. The pieces of the body in those whose normals differ by less than 20 degrees add up to one
//! contact: volumes, centres, area vectors and moments are integrals, which add up. If all lie in one plane and no part of the body behind
//! it is left out, the contact is that with the plane.

use super::super::clip::{Integrals, Plane, distances};
use super::super::overlap::Overlap;
use super::super::polyhedra;
use super::super::solid::Solid;
use super::{MeshContact, ONE};
use crate::math::{Quat, Vec3};
use crate::wall::PlacedMesh;
use crate::wall::mesh::NearestPoint;

/// Relative difference of volumes, and sines and distances over the reach of the body, that are rounding.
const ROUNDING: f64 = 1e-9;

/// The part of a body behind a facet, in the frame of the body.
#[derive(Clone, Copy)]
struct Piece {
    facet: u32,
    plane: Plane,
    integrals: Integrals,
}

/// The plane of a facet as seen from the centre of the body, in its frame, and those of its edges; none if it looks away from there.
fn wedge((wall, own): (&PlacedMesh, Vec3), (facet, sign): (u32, f64), turn: &Quat) -> Option<[Plane; 4]> {
    let mesh = &wall.mesh;
    let of = &mesh.facets()[facet as usize];
    let corners = mesh.corners(facet).map(|corner| corner - own);
    let height = -of.normal.dot(&corners[0]);
    if height * sign < 0.0 || of.normal == Vec3::zeros() {
        return None;
    }
    let seen = |normal: Vec3, at: Vec3| Plane {
        normal: turn.inverse_transform_vector(&normal),
        offset: normal.dot(&at),
    };
    let side = |k: usize| {
        let along = corners[(k + 1) % 3] - corners[k];
        let beyond = of.beyond[k].map_or(Vec3::zeros(), |next| mesh.facets()[next as usize].normal);
        let across = |normal: Vec3| along.cross(&normal).try_normalize(ROUNDING * along.norm());
        // Neighbours in one plane have the same plane between them, whatever rounding says of its direction.
        let across = across(of.normal + beyond).or_else(|| across(of.normal)).unwrap_or_else(Vec3::zeros);
        seen(across, corners[k])
    };
    Some([seen(of.normal * sign, corners[0]), side(0), side(1), side(2)])
}

/// Finds the contacts of a polyhedron; see [`super::contacts`].
pub(super) fn contacts(
    solid: &Solid,
    orientation: Quat,
    (wall, own): (&PlacedMesh, Vec3),
    (points, sides): (&[NearestPoint], &[f64]),
    found: &mut Vec<MeshContact>,
) -> bool {
    let turn = wall.orientation.inverse() * orientation;
    let (mut pieces, mut behind) = (Vec::new(), false);
    for (&NearestPoint { facet, .. }, &side) in points.iter().zip(sides) {
        let Some(planes) = wedge((wall, own), (facet, side), &turn) else {
            behind = true;
            continue;
        };
        if let Some(integrals) = polyhedra::piece(solid, &planes) {
            pieces.push(Piece { facet, plane: planes[0], integrals });
        }
    }
    // The largest first, of equal ones the first facet.
    pieces.sort_by(|a, b| b.integrals.volume.total_cmp(&a.integrals.volume).then(a.facet.cmp(&b.facet)));
    while let Some(&leader) = pieces.first() {
        let alike = |piece: &Piece| piece.plane.normal.dot(&leader.plane.normal) > ONE;
        let group: Vec<Piece> = pieces.iter().copied().filter(alike).collect();
        pieces.retain(|piece| !alike(piece));
        let facet = group.iter().map(|piece| piece.facet).min().unwrap_or(leader.facet);
        found.extend(together(solid, orientation, &group).map(|overlap| MeshContact { facet, overlap }));
    }
    behind
}

/// The overlap that pieces make together; the largest is the first.
fn together(solid: &Solid, orientation: Quat, group: &[Piece]) -> Option<Overlap> {
    let leader = group.first()?.plane;
    let sum = |of: &dyn Fn(&Integrals) -> Vec3| group.iter().map(|piece| of(&piece.integrals)).sum::<Vec3>();
    let volume: f64 = group.iter().map(|piece| piece.integrals.volume).sum();
    let is_flat = group.iter().all(|Piece { plane, .. }| {
        (plane.normal - leader.normal).norm() <= ROUNDING
            && (plane.offset - leader.offset).abs() <= ROUNDING * solid.reach
    });
    if is_flat {
        let to_world = orientation.to_rotation_matrix().into_inner();
        let plane = Plane { normal: orientation * leader.normal, ..leader };
        let whole = polyhedra::overlap_plane(solid, &to_world, &plane);
        if whole.is_some_and(|whole| volume >= whole.volume * (1.0 - ROUNDING)) {
            return whole;
        }
    }
    let centre = sum(&|part| part.centre * part.volume) / volume;
    let area = sum(&|part| part.area);
    let size = area.norm();
    let normal = if size > 0.0 { area / size } else { -leader.normal };
    let (ahead, _) = distances(solid.planes.iter(), &centre, &normal);
    let behind = leader.height(&centre) / leader.normal.dot(&normal);
    let depth = ahead + behind.max(0.0);
    (depth > 0.0 && depth.is_finite()).then(|| Overlap {
        volume,
        depth,
        point: orientation * centre,
        normal: orientation * normal,
        area: size,
        moment: orientation * sum(&|part| part.moment),
    })
}
