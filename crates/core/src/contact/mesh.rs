//! Contacts of a body with the facets of a mesh: one for each place at which the distance of the body to the mesh has a minimum.
//!
//! | body | interior of a facet | edges and corners of the mesh |
//! |---|---|---|
//! | sphere | the exact contact with its plane | the exact contact with the plane across the way from the nearest point |
//! | [polyhedron](flat) | exact: that of its plane, if all facets that it meets lie in one | the body cut by facets, each with the space behind it up to the bisecting planes of its edges |
//! | [any other](smooth) | that with its plane | that with the plane across the gradient at the deepest point of the edge |
//!
//! Contacts whose normals differ by less than 20 degrees are one, the deepest: so coplanar facets count once, and a finely divided curved
//! surface acts as a smooth one. A ball of radius `R` in a concave edge of angle `t` leaves the plane behind it at a depth of
//! `R (1 / cos t - 1)`, 6 % of its radius at 20 degrees: up to that depth forces are continuous at sharper edges, too. Where two contacts are
//! one, its elastic energy is that of the deeper one, which is continuous.
//!
//! A sheet acts on the side of the centre of the body. Facets of a closed mesh that look away from the centre do not act.

mod flat;
mod smooth;

use super::clip::Plane;
use super::overlap::{Body, Overlap};
use super::{Geometry, sphere_plane};
use crate::math::Vec3;
use crate::wall::PlacedMesh;
use crate::wall::mesh::{Feature, NearestPoint};
use std::cell::RefCell;

/// Cosine of the angle of normals from which on contacts are one: 20 degrees.
const ONE: f64 = 0.939_692_620_785_908_4;
/// Distances below this part of the reach of a body have no direction.
const NOWHERE: f64 = 1e-9;

/// A contact of a body with a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshContact {
    /// Facet by which it is known.
    pub facet: u32,
    /// Seen from the centre of the body; the normal points into the wall.
    pub overlap: Overlap,
}

/// Places that may be contacts.
struct Place {
    facet: u32,
    feature: Feature,
    /// Unit vector from the mesh to the body, in the frame of the mesh.
    away: Vec3,
    /// The lesser, the nearer or the deeper (m).
    rank: f64,
    /// Distance of the centre of the body from the plane across `away` (m).
    height: f64,
}

#[derive(Default)]
struct Buffers {
    points: Vec<NearestPoint>,
    sides: Vec<f64>,
    places: Vec<Place>,
}

thread_local! {
    static BUFFERS: RefCell<Buffers> = RefCell::default();
}

/// Contacts of a body, whose centre is at `centre` (m), with a mesh, in ascending order of their facets. `near` are all facets that come within
/// the reach of the body, and any others, ascending.
///
/// Returns true if it meets facets of a closed mesh that look away from its centre: if there is no contact, the centre may be in the wall.
pub fn contacts(
    geometry: Geometry,
    body: &Body,
    (wall, centre): (&PlacedMesh, Vec3),
    near: &[u32],
    found: &mut Vec<MeshContact>,
) -> bool {
    found.clear();
    let own = wall.to_own(&centre);
    BUFFERS.with_borrow_mut(|buffers| {
        let Buffers { points, sides, places } = buffers;
        points.clear();
        places.clear();
        wall.mesh.within(&own, body.grown.reach(), near, points);
        if points.is_empty() {
            return false;
        }
        let behind = match (geometry, body.grown.sphere(), body.grown.solid()) {
            (Geometry::Exact, None, Some(solid)) => {
                wall.mesh.sides(&own, points, sides);
                flat::contacts(solid, body.orientation, (wall, own), (points, sides), found)
            }
            (_, Some(radius), _) => {
                places.extend(points.iter().map(|point| of_sphere(wall, &own, radius, point)));
                accept(
                    wall,
                    places,
                    |away, height| match geometry {
                        Geometry::Exact => {
                            sphere_plane::overlap(radius, &Plane { normal: away, offset: -height })
                        }
                        Geometry::Sampled { .. } => smooth::at_plane(geometry, body, away, height),
                    },
                    found,
                )
            }
            _ => {
                wall.mesh.sides(&own, points, sides);
                smooth::places(body, (wall, own), (points, sides), places);
                accept(wall, places, |away, height| smooth::at_plane(geometry, body, away, height), found)
            }
        };
        found.sort_unstable_by_key(|contact| contact.facet);
        behind
    })
}

/// The place at which a sphere is nearest to a facet.
fn of_sphere(wall: &PlacedMesh, own: &Vec3, radius: f64, nearest: &NearestPoint) -> Place {
    let NearestPoint { point, square, facet, feature } = *nearest;
    let (normal, way, distance) = (wall.mesh.facets()[facet as usize].normal, own - point, square.sqrt());
    let plane = normal.dot(&(own - wall.mesh.corners(facet)[0]));
    let on_face = distance <= NOWHERE * radius || feature == Feature::Face && normal != Vec3::zeros();
    let (away, height) = match on_face {
        true if plane < 0.0 && distance > NOWHERE * radius => (-normal, -plane),
        true => (normal, plane),
        false => (way / distance, distance),
    };
    Place { facet, feature, away, rank: distance, height }
}

/// Turns places into contacts, the first ones first, if they are least distances from the front and have directions of their own.
fn accept(
    wall: &PlacedMesh,
    places: &mut [Place],
    overlap: impl Fn(Vec3, f64) -> Option<Overlap>,
    found: &mut Vec<MeshContact>,
) -> bool {
    places.sort_unstable_by(|a, b| a.rank.total_cmp(&b.rank).then(a.facet.cmp(&b.facet)));
    let mut behind = false;
    for n in 0..places.len() {
        let Place { facet, feature, away, height, .. } = places[n];
        let normal = wall.orientation * away;
        if found.iter().any(|contact| -contact.overlap.normal.dot(&normal) > ONE) {
            continue;
        }
        if !wall.mesh.is_in_front(facet, feature, &away) {
            behind = true;
        } else if wall.mesh.is_least(facet, feature, &away)
            && let Some(overlap) = overlap(normal, height)
        {
            found.push(MeshContact { facet, overlap });
        }
    }
    behind
}

/// The deepest contact, seen from the centre of the body; none if they do not touch.
pub(super) fn deepest(geometry: Geometry, body: &Body, wall: &PlacedMesh) -> Option<Overlap> {
    let near = wall.mesh.facets_near(&wall.to_own(&Vec3::zeros()), body.grown.reach());
    let mut found = Vec::new();
    contacts(geometry, body, (wall, Vec3::zeros()), &near, &mut found);
    found.into_iter().map(|contact| contact.overlap).max_by(|a, b| a.depth.total_cmp(&b.depth))
}

#[cfg(test)]
mod tests;
