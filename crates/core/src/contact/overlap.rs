//! Overlap: the intersection of two (enlarged) bodies.

use super::clip::Plane;
use super::polyhedra::Hint;
use super::solid::Solid;
use super::{
    Geometry, cylinder_plane, mesh, parallel, polyhedra, sampled, sphere_plane, sphere_polyhedron,
    sphere_sphere,
};
use crate::math::{Mat3, Quat, Vec3};
use crate::shape::{Part, Passage, Shape};
use crate::wall::Surface;
use std::sync::Arc;

/// Geometry of one contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Overlap {
    /// Shared volume (m^3).
    pub volume: f64,
    /// Extent along the normal through the centre, the indentation depth of the papers (m); minus the gap of a [neck](Self::neck).
    pub depth: f64,
    /// Centre of the shared volume, relative to the centre of the first body, world axes (m).
    pub point: Vec3,
    /// Unit normal, from the first body to the second.
    pub normal: Vec3,
    /// Area (m^2): the integral of the outward normal of the first body over the part of its surface that lies in the
    /// second is `area * normal`; the change of the volume with the distance of the bodies is minus that.
    pub area: f64,
    /// First moment of that surface (m^3), the integral of `x` cross the outward normal, `x` relative to the centre of
    /// the first body.
    pub moment: Vec3,
}

impl Overlap {
    /// The same overlap seen from another centre of the first body, from which `arm` (m) leads to the present one.
    #[must_use]
    pub fn seen_from(self, arm: Vec3) -> Self {
        let moment = self.moment + arm.cross(&self.normal) * self.area;
        Self { point: self.point + arm, moment, ..self }
    }

    /// The same overlap with the bodies exchanged; `offset` (m) leads from the centre of the new first body to the other.
    pub(super) fn reversed(self, offset: Vec3) -> Self {
        let normal = -self.normal;
        let moment = offset.cross(&normal) * self.area - self.moment;
        Self { point: self.point + offset, normal, moment, ..self }
    }
}

/// A shape made ready for contacts: grown by the enlargement. Contacts of a body of several parts are those of its parts; where it is asked for as
/// a whole, its overlap is the deepest of them.
///
/// A grown polyhedron keeps sharp edges where its overlap is exact, a grown cylinder at planes; any other shape, and any shape that is sampled, has
/// all points within the enlargement.
#[derive(Clone, Debug)]
pub struct GrownShape {
    /// The shape as it is.
    pub shape: Arc<dyn Shape>,
    /// By how much its surface is grown (m).
    pub enlargement: f64,
    solid: Option<Arc<Solid>>,
    /// Radius of the grown sphere (m), if it is one.
    sphere: Option<f64>,
    /// Radius and half length of the grown cylinder (m), if it is one.
    cylinder: Option<[f64; 2]>,
    /// Of a body that goes through the box, the piece in it.
    piece: Option<Arc<Piece>>,
    /// Those of a body of several parts, with their poses in the body.
    parts: Arc<[(Self, Part)]>,
}

/// The piece in the box of a body that goes through it, for overlaps along its whole length.
#[derive(Debug)]
struct Piece {
    passage: Passage,
    grown: GrownShape,
    /// Part of the overlap of grown pieces that counts: these have grown ends.
    part: f64,
}

impl Piece {
    fn new(shape: &dyn Shape, enlargement: f64) -> Option<Self> {
        let (passage, piece) = (shape.passage()?, shape.piece()?);
        let part = passage.length / (passage.length + 2.0 * enlargement);
        Some(Self { passage, grown: GrownShape::new(piece, enlargement), part })
    }
}

impl GrownShape {
    /// Prepares a shape, grown by `enlargement` (m).
    pub fn new(shape: Arc<dyn Shape>, enlargement: f64) -> Self {
        let solid = shape.as_polyhedron().map(|p| Arc::new(Solid::new(p, enlargement)));
        let sphere = shape.as_sphere().map(|radius| radius + enlargement);
        let cylinder =
            shape.as_cylinder().map(|lengths| <[f64; 2]>::from(lengths).map(|length| length + enlargement));
        let piece = Piece::new(&*shape, enlargement).map(Arc::new);
        let grown = |part: &Part| (Self::new(part.shape.clone(), enlargement), part.clone());
        let parts = shape.parts().iter().map(grown).collect();
        Self { shape, enlargement, solid, sphere, cylinder, piece, parts }
    }

    /// True if it is a polyhedron.
    pub fn is_solid(&self) -> bool {
        self.solid.is_some()
    }

    /// Radius of the grown sphere (m), if it is one.
    pub fn sphere(&self) -> Option<f64> {
        self.sphere
    }

    /// Tables of the grown polyhedron, if it is one.
    pub(super) fn solid(&self) -> Option<&Solid> {
        self.solid.as_deref()
    }

    /// Radius of a sphere about the centre of mass that holds the grown body (m).
    pub fn reach(&self) -> f64 {
        if let Some(solid) = &self.solid {
            return solid.reach;
        }
        if let Some([radius, half]) = self.cylinder {
            return libm::hypot(radius, half);
        }
        let part = |(grown, part): &(Self, Part)| part.position.norm() + grown.reach();
        self.parts.iter().map(part).fold(self.shape.circumradius() + self.enlargement, f64::max)
    }
}

/// A body of a pair: its grown shape and orientation.
#[derive(Clone, Copy, Debug)]
pub struct Body<'a> {
    /// Geometry.
    pub grown: &'a GrownShape,
    /// Maps the body frame to the world frame.
    pub orientation: Quat,
}

/// Kind of body, as far as the closed forms distinguish.
enum Form<'a> {
    /// Radius (m).
    Sphere(f64),
    Solid(&'a Solid),
    /// Radius and half length (m).
    Cylinder([f64; 2]),
    Other,
}

impl Body<'_> {
    fn form(&self) -> Form<'_> {
        let GrownShape { solid, sphere, cylinder, .. } = self.grown;
        match (solid, sphere, cylinder) {
            (Some(solid), ..) => Form::Solid(solid),
            (None, Some(radius), _) => Form::Sphere(*radius),
            (None, None, Some(lengths)) => Form::Cylinder(*lengths),
            (None, None, None) => Form::Other,
        }
    }

    /// True if its exact overlap with another such body is found without samples.
    pub fn has_closed_form(&self) -> bool {
        self.parts_or_self().all(|(part, _)| matches!(part.form(), Form::Sphere(_) | Form::Solid(_)))
    }

    /// True if its exact overlap with a plane is found without samples.
    pub fn has_closed_form_at_planes(&self) -> bool {
        self.parts_or_self().all(|(part, _)| !matches!(part.form(), Form::Other))
    }

    /// Its parts, if it has several, with their centres relative to its own (m, world axes).
    fn parts(&self) -> impl Iterator<Item = (Body<'_>, Vec3)> + Clone {
        self.grown.parts.iter().map(|(grown, part)| {
            let body = Body { grown, orientation: self.orientation * part.orientation };
            (body, self.orientation * part.position)
        })
    }

    /// Its parts; a convex body is its own only part.
    fn parts_or_self(&self) -> impl Iterator<Item = (Body<'_>, Vec3)> + Clone {
        self.grown.parts.is_empty().then(|| (*self, Vec3::zeros())).into_iter().chain(self.parts())
    }

    /// Maps the body frame to the world frame.
    pub fn rotation(&self) -> Mat3 {
        self.orientation.to_rotation_matrix().into_inner()
    }
}

/// Bodies that go through the box along the same axis, as the pieces side by side in it, with that of the first, and the offset (m) across them.
fn side_by_side<'a>(
    [first, second]: [&Body<'a>; 2],
    mut offset: Vec3,
) -> Option<(&'a Piece, [Body<'a>; 2], Vec3)> {
    let (a, b) = (first.grown.piece.as_deref()?, second.grown.piece.as_deref()?);
    let axis = a.passage.axis;
    if axis != b.passage.axis {
        return None;
    }
    offset[axis] = 0.0;
    let of = |piece: &'a Piece, body: &Body| Body { grown: &piece.grown, ..*body };
    Some((a, [of(a, first), of(b, second)], offset))
}

/// Returns true if the spheres that hold two bodies meet; false if the offset is not finite.
fn meet(first: &Body, second: &Body, offset: Vec3) -> bool {
    let reach = first.grown.reach() + second.grown.reach();
    offset.norm_squared() < reach * reach
}

/// Pairs of parts, with the centre of the first one relative to that of its body and the offset of the second one from it (m).
fn pairs_of_parts<'a>(
    [first, second]: [&'a Body<'a>; 2],
    offset: Vec3,
) -> impl Iterator<Item = ([Body<'a>; 2], Vec3, Vec3)> {
    first.parts_or_self().flat_map(move |(one, arm)| {
        second.parts_or_self().map(move |(other, its)| ([one, other], arm, offset + its - arm))
    })
}

fn deepest(each: impl Iterator<Item = Overlap>) -> Option<Overlap> {
    each.reduce(|best, other| if other.depth > best.depth { other } else { best })
}

/// Centres closer than this part of the reach of a body are moved that far apart before they are sampled.
const COINCIDENT: f64 = 1e-6;

/// Overlap of two bodies; `None` if they do not touch.
///
/// `offset` (m) is the centre of the second body relative to the first, the nearest image in a periodic box. Pairs
/// without a closed form are sampled with [`sampled::DEFAULT_SAMPLES`].
pub fn overlap(geometry: Geometry, first: &Body, second: &Body, offset: Vec3) -> Option<Overlap> {
    let rotations = [&first.rotation(), &second.rotation()];
    overlap_again(geometry, [first, second], rotations, offset, &mut Hint::default())
}

/// The same, faster: the `rotations` of polyhedra are those of their orientations, and the `hint` is that of an earlier call for this
/// pair, or the default.
#[inline]
pub fn overlap_again(
    geometry: Geometry,
    bodies: [&Body; 2],
    rotations: [&Mat3; 2],
    offset: Vec3,
    hint: &mut Hint,
) -> Option<Overlap> {
    if let (Geometry::Exact, [Some(a), Some(b)]) = (geometry, bodies.map(|body| body.grown.sphere)) {
        return sphere_sphere::overlap(a, b, offset);
    }
    overlap_of_any(geometry, bodies, rotations, offset, hint)
}

/// The same but for two spheres that are not sampled.
fn overlap_of_any(
    geometry: Geometry,
    [first, second]: [&Body; 2],
    rotations: [&Mat3; 2],
    offset: Vec3,
    hint: &mut Hint,
) -> Option<Overlap> {
    if !meet(first, second, offset) {
        return None;
    }
    if [first, second].iter().any(|body| !body.grown.parts.is_empty()) {
        let pairs = pairs_of_parts([first, second], offset);
        let each = pairs.filter_map(|([one, other], arm, offset)| {
            Some(overlap(geometry, &one, &other, offset)?.seen_from(arm))
        });
        return deepest(each);
    }
    if let Some((a, [one, other], across)) = side_by_side([first, second], offset) {
        if let (Geometry::Exact, Form::Cylinder([radius, _]), Form::Cylinder([other, _])) =
            (geometry, first.form(), second.form())
        {
            return parallel::cylinders([radius, other], a.passage.length, across);
        }
        let found = overlap_of_any(geometry, [&one, &other], rotations, across, hint)?;
        return Some(found.of_piece(a.part, a.passage.axis));
    }
    let samples = match geometry {
        Geometry::Sampled { samples } => samples,
        Geometry::Exact => match (first.form(), second.form()) {
            (Form::Solid(a), Form::Solid(b)) => {
                return polyhedra::overlap(a, rotations[0], b, rotations[1], offset, hint);
            }
            (Form::Sphere(radius), Form::Solid(solid)) => {
                return sphere_polyhedron::overlap(radius, solid, rotations[1], offset);
            }
            (Form::Solid(solid), Form::Sphere(radius)) => {
                let seen = sphere_polyhedron::overlap(radius, solid, rotations[0], -offset)?;
                return Some(seen.reversed(offset));
            }
            _ => sampled::DEFAULT_SAMPLES,
        },
    };
    // Coinciding bodies have no direction from one to the other: any will do.
    let least = COINCIDENT * first.grown.reach();
    let offset = if offset.norm() < least { Vec3::x() * least } else { offset };
    sampled::overlap(first, second, offset, samples)
}

/// Returns true if two bodies overlap, as [`overlap()`] of the exact geometry finds, but faster and without a size.
/// Overlaps so small that samples miss them count.
pub fn intersects(first: &Body, second: &Body, offset: Vec3) -> bool {
    if !meet(first, second, offset) {
        return false;
    }
    if [first, second].iter().any(|body| !body.grown.parts.is_empty()) {
        let mut pairs = pairs_of_parts([first, second], offset);
        return pairs.any(|([one, other], _, offset)| intersects(&one, &other, offset));
    }
    if let Some((_, [first, second], across)) = side_by_side([first, second], offset) {
        return intersects(&first, &second, across);
    }
    match (first.form(), second.form()) {
        (Form::Sphere(_), Form::Sphere(_)) => true,
        (Form::Solid(a), Form::Solid(b)) => {
            polyhedra::intersects(a, &first.rotation(), b, &second.rotation(), offset)
        }
        (Form::Sphere(_), Form::Solid(_)) | (Form::Solid(_), Form::Sphere(_)) => {
            overlap(Geometry::Exact, first, second, offset).is_some()
        }
        _ => sampled::intersects(first, second, offset),
    }
}

/// Overlap of a body with a wall, seen from the centre of the body; `None` if they do not touch. The normal points
/// from the body into the wall. Of several [contacts](mesh::contacts) with a mesh it is the deepest.
pub fn overlap_wall(geometry: Geometry, body: &Body, wall: &Surface) -> Option<Overlap> {
    if !body.grown.parts.is_empty() {
        let each = body.parts().filter_map(|(part, arm)| {
            Some(overlap_wall(geometry, &part, &wall.seen_from(arm))?.seen_from(arm))
        });
        return deepest(each);
    }
    if let Some(piece) = &body.grown.piece {
        let Passage { axis, length, .. } = piece.passage;
        if let (Geometry::Exact, Form::Cylinder([radius, _]), Surface::Plane { normal, .. }) =
            (geometry, body.form(), wall)
        {
            let plane = (wall.distance(Vec3::zeros()), -normal);
            return parallel::cylinder_at_plane(radius, length, plane);
        }
        let found = overlap_wall(geometry, &Body { grown: &piece.grown, ..*body }, wall)?;
        return Some(found.of_piece(piece.part, axis));
    }
    if let Surface::Mesh(placed) = wall {
        return mesh::deepest(geometry, body, placed);
    }
    let samples = match (geometry, wall) {
        (Geometry::Sampled { samples }, _) => samples,
        (Geometry::Exact, Surface::Plane { point, normal }) => {
            let plane = Plane { normal: *normal, offset: normal.dot(point) };
            match body.form() {
                Form::Sphere(radius) => return sphere_plane::overlap(radius, &plane),
                Form::Solid(solid) => return polyhedra::overlap_plane(solid, &body.rotation(), &plane),
                Form::Cylinder(lengths) => return cylinder_plane::overlap(lengths, &body.rotation(), &plane),
                Form::Other => sampled::DEFAULT_SAMPLES,
            }
        }
        (Geometry::Exact, _) => sampled::DEFAULT_SAMPLES,
    };
    sampled::overlap_wall(body, wall, samples)
}

/// Returns true if a body overlaps a wall, as [`overlap_wall`] of the exact geometry finds, but faster at planes.
pub fn intersects_wall(body: &Body, wall: &Surface) -> bool {
    if !body.grown.parts.is_empty() {
        return body.parts().any(|(part, arm)| intersects_wall(&part, &wall.seen_from(arm)));
    }
    match (body.form(), wall) {
        (Form::Other, Surface::Plane { normal, .. }) => {
            let along = body.orientation.inverse_transform_vector(normal);
            let lowest = body.grown.shape.support(-along).dot(&along);
            wall.distance(Vec3::zeros()) + lowest < body.grown.enlargement
        }
        _ => overlap_wall(Geometry::Exact, body, wall).is_some(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::tests::{random, random_direction, random_turn};
    use crate::shape::polyhedron::SINGLE_PRECISION;
    use crate::shape::{Capsule, Cuboid, Cylinder, Ellipsoid, Polyhedron, Sphere};

    #[test]
    fn what_touches_has_an_overlap_and_what_does_not_has_none() {
        let shapes: [Arc<dyn Shape>; 6] = [
            Arc::new(Sphere { radius: 0.5 }),
            Arc::new(Cuboid::new(Vec3::repeat(1.0)).unwrap()),
            Arc::new(Cuboid::new(Vec3::new(1.2, 0.9, 0.3)).unwrap()),
            Arc::new(Ellipsoid::new(Vec3::new(0.7, 0.5, 0.3)).unwrap()),
            Arc::new(Capsule::new(0.4, 0.8).unwrap()),
            Arc::new(Cylinder::new(0.8, 0.6).unwrap()),
        ];
        let shapes = shapes.map(|shape| GrownShape::new(shape, 0.02));
        let mut random = random(3);
        let (mut touching, mut small) = (0, 0);
        for n in 0..6000 {
            let [first, second] =
                [n % 6, n / 6 % 6].map(|i| Body { grown: &shapes[i], orientation: random_turn(&mut random) });
            let reach = first.grown.reach() + second.grown.reach();
            let offset = random_direction(&mut random) * (0.4 + 0.6 * (n % 97) as f64 / 97.0) * reach;
            let touches = intersects(&first, &second, offset);
            let overlap = overlap(Geometry::Exact, &first, &second, offset);
            let nowhere = Vec3::new(f64::NAN, 0.0, 0.0);
            assert_eq!(super::overlap(Geometry::Exact, &first, &second, nowhere), None);
            touching += u32::from(touches);
            let wall = Surface::Plane { point: offset, normal: -offset.normalize() };
            let beside = overlap_wall(Geometry::Exact, &first, &wall).is_some();
            assert!(!beside || wall.distance(Vec3::zeros()) < first.grown.reach(), "{n}");
            if intersects_wall(&first, &wall) != beside {
                assert!(!beside, "{n}");
                small += 1;
            }
            if touches != overlap.is_some() {
                // Samples miss small overlaps, and rounding decides where bodies just touch.
                assert!(touches, "{overlap:?} in {n}");
                small += 1;
            }
        }
        assert!(touching > 1000 && small < 30);
    }

    #[test]
    fn a_cube_is_a_cube_as_a_cuboid_as_corners_and_as_triangles() {
        let corners = Polyhedron::cuboid(Vec3::repeat(1.0)).vertices;
        // As a mesh file has them: the corners of all triangles.
        let surface = Cuboid::new(Vec3::repeat(1.0)).unwrap().surface_mesh(0);
        let triangles: Vec<Vec3> =
            (surface.triangles.iter().flatten()).map(|&corner| surface.points[corner as usize]).collect();
        let plain = GrownShape::new(Arc::new(Cuboid::new(Vec3::repeat(1.0)).unwrap()), 0.01);
        let others = [
            Polyhedron::from_corners(&corners, 1e-9).unwrap(),
            Polyhedron::hull(&triangles, SINGLE_PRECISION).unwrap(),
        ]
        .map(|(shape, placement)| (GrownShape::new(Arc::new(shape), 0.01), placement));
        let mut random = random(1);
        let wall = Surface::Plane { point: Vec3::new(0.0, 0.0, -0.5), normal: Vec3::new(0.36, 0.48, 0.8) };
        for _ in 0..100 {
            let turns = [random_turn(&mut random), random_turn(&mut random)];
            let offset = random_direction(&mut random);
            let both = |grown, more: Quat| {
                let bodies = turns.map(|turn| Body { grown, orientation: turn * more });
                [
                    overlap(Geometry::Exact, &bodies[0], &bodies[1], offset),
                    overlap_wall(Geometry::Exact, &bodies[0], &wall),
                ]
            };
            let expected = both(&plain, Quat::identity());
            for (grown, placement) in &others {
                for (one, other) in expected.iter().zip(both(grown, placement.rotation)) {
                    let (Some(one), Some(other)) = (one, other) else {
                        assert!(one.is_none() && other.is_none());
                        continue;
                    };
                    assert!(
                        (one.volume - other.volume).abs() < 1e-9 && (one.depth - other.depth).abs() < 1e-9
                    );
                    assert!(
                        (one.point - other.point).norm() < 1e-9 && (one.moment - other.moment).norm() < 1e-9
                    );
                    assert!((one.normal * one.area - other.normal * other.area).norm() < 1e-9);
                }
            }
        }
    }

    #[test]
    fn enlarged_spheres_touch_across_the_gap_between_their_surfaces() {
        let offset = Vec3::new(0.0, 2.1, 0.0);
        let with = |enlargement| {
            let grown = GrownShape::new(Arc::new(Sphere { radius: 1.0 }), enlargement);
            let body = Body { grown: &grown, orientation: Quat::identity() };
            overlap(Geometry::Exact, &body, &body, offset)
        };
        assert_eq!(with(0.0), None);
        let overlap = with(0.1).unwrap();
        assert!((overlap.depth - 0.1).abs() < 1e-15);
        assert_eq!(overlap.normal, Vec3::y());
    }

    #[test]
    fn equal_bodies_at_the_same_place_overlap_whole() {
        let shapes: [Arc<dyn Shape>; 3] = [
            Arc::new(Ellipsoid::new(Vec3::new(1.0, 0.8, 0.5)).unwrap()),
            Arc::new(Capsule::new(0.4, 1.0).unwrap()),
            Arc::new(Cuboid::new(Vec3::new(1.0, 2.0, 1.5)).unwrap()),
        ];
        for shape in shapes {
            let volume = shape.volume();
            let grown = GrownShape::new(shape, 0.0);
            let body = Body { grown: &grown, orientation: Quat::from_euler_angles(0.3, -0.2, 0.5) };
            let overlap = overlap(Geometry::Exact, &body, &body, Vec3::zeros());
            let kind = grown.shape.kind();
            let overlap = overlap.unwrap_or_else(|| panic!("{kind}: not seen"));
            assert!((overlap.volume / volume - 1.0).abs() < 0.1, "{kind}: {} of {volume}", overlap.volume);
        }
    }
}
