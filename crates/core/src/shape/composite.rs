//! A rigid body that is the union of convex parts.
//!
//! Parts with flat faces that overlap are cut apart along these faces (`apart.rs`), so that nothing counts twice. Others keep what
//! they share, which is taken off once. Volumes add up, and moments of inertia with the arms `d` from the common centre of mass:
//!
//! ```text
//! V = sum V_i - S,   x = (sum V_i x_i - int_S x) / V
//! J = (sum V_i (R_i J_i R_i^T + d_i.d_i - d_i d_i^T) - int_S (d.d - d d^T)) / V
//! ```
//!
//! `S` is what each part shares with those before it: lengths of lines, exact, on [`LINES`] x [`LINES`] lines across it. Its error is below 1e-4
//! of the volume that is shared.

use super::polyhedron::mass::principal_axes;
use super::{Face, Part, Placement, Shape, ShapeError, SurfaceMesh, apart};
use crate::math::{Mat3, Quat, Vec3};

/// Most parts of a body: set-up and contacts look at all of them.
pub const MOST_PARTS: usize = 256;

/// Part of the smaller thickness by which two parts may overlap: what touches overlaps by rounding.
pub(super) const ROUNDING: f64 = 1e-3;

/// Projections after which a common point of two parts is found.
const PROJECTIONS: usize = 200;

/// Distance beyond the surface of a part at which another one is looked for, over the radius of the body: more than rounding.
const BEYOND: f64 = 1e-5;

/// Part of the volume of a body that its thinnest parts may hold together and not count as thin: splinters of a cut along a curved surface.
const SPLINTERS: f64 = 1e-3;

/// Lines across what parts share, in each direction.
const LINES: usize = 200;

/// A rigid body of convex parts.
#[derive(Clone, Debug)]
pub struct Composite {
    parts: Vec<Part>,
    /// Of each part, those that it shares space with.
    shared: Vec<Vec<u32>>,
    /// Of each part (m), see [`thicknesses`].
    thickness: Vec<f64>,
    volume: f64,
    inertia: Vec3,
    circumradius: f64,
}

/// Integrals over a region: of 1, of `x`, and of `x x^T`.
#[derive(Default)]
struct Moments {
    volume: f64,
    first: Vec3,
    second: Mat3,
}

impl Moments {
    /// Adds the points of a section (m^2) of lines along x at `y, z` between two ends.
    fn add(&mut self, [y, z]: [f64; 2], (low, high): (f64, f64), section: f64) {
        let length = section * (high - low);
        let middle = 0.5 * (low + high);
        let mean = Vec3::new(middle, y, z);
        self.volume += length;
        self.first += mean * length;
        self.second += mean * mean.transpose() * length;
        self.second[(0, 0)] += length * (high - low) * (high - low) / 12.0;
    }

    /// `int (d.d - d d^T)` about a centre.
    fn inertia(&self, centre: &Vec3) -> Mat3 {
        let mixed = self.first * centre.transpose();
        let spread = self.second - mixed - mixed.transpose() + centre * centre.transpose() * self.volume;
        Mat3::identity() * spread.trace() - spread
    }
}

impl Composite {
    /// The body of these parts, with poses in any one frame, and where its centre of mass and principal axes lie in that frame. Parts of parts
    /// are parts.
    ///
    /// # Errors
    /// [`ShapeError::TooManyParts`], after those that overlap have been cut.
    ///
    /// # Panics
    /// If there are no parts.
    pub fn new(parts: Vec<Part>) -> Result<(Self, Placement), ShapeError> {
        assert!(!parts.is_empty(), "convex parts");
        let check = |count: usize| {
            let most = MOST_PARTS;
            if count > most { Err(ShapeError::TooManyParts { count, most }) } else { Ok(()) }
        };
        let parts: Vec<Part> = parts.into_iter().flat_map(Part::flattened).collect();
        check(parts.len())?;
        let mut parts = apart::cut(parts);
        check(parts.len())?;
        let mut shared = vec![Vec::new(); parts.len()];
        for second in 1..parts.len() {
            for first in 0..second {
                if overlap(&parts[first], &parts[second]) {
                    shared[first].push(second as u32);
                    shared[second].push(first as u32);
                }
            }
        }
        let twice = counted_twice(&parts, &shared);
        let volume = parts.iter().map(|part| part.shape.volume()).sum::<f64>() - twice.volume;
        let weighted = |part: &Part| part.position * part.shape.volume();
        let centre = (parts.iter().map(weighted).sum::<Vec3>() - twice.first) / volume;
        let mut tensor = -twice.inertia(&centre) / volume;
        for part in &mut parts {
            part.position -= centre;
            let (arm, turn) = (part.position, part.orientation.to_rotation_matrix().into_inner());
            let own = turn * Mat3::from_diagonal(&part.shape.inertia_per_mass()) * turn.transpose();
            let far = Mat3::identity() * arm.norm_squared() - arm * arm.transpose();
            tensor += (own + far) * (part.shape.volume() / volume);
        }
        let rotation = principal_axes(&tensor);
        let axes = rotation.to_rotation_matrix().into_inner();
        for part in &mut parts {
            part.position = rotation.inverse_transform_vector(&part.position);
            part.orientation = rotation.inverse() * part.orientation;
        }
        let inertia = (axes.transpose() * tensor * axes).diagonal();
        let circumradius = parts.iter().map(Part::reach).fold(0.0, f64::max);
        let thickness = thicknesses(&parts, circumradius, SPLINTERS * volume);
        Ok((Self { parts, shared, thickness, volume, inertia, circumradius }, Placement { centre, rotation }))
    }

    /// The part that is nearest to a point, and its signed distance (m).
    fn nearest(&self, point: Vec3) -> (&Part, f64) {
        let distance = |part: &Part| part.shape.signed_distance(part.to_own(point));
        let mut best = (&self.parts[0], distance(&self.parts[0]));
        for part in &self.parts[1..] {
            let found = distance(part);
            if found < best.1 {
                best = (part, found);
            }
        }
        best
    }
}

/// Integrals over what parts share with those before them.
fn counted_twice(parts: &[Part], shared: &[Vec<u32>]) -> Moments {
    let mut sum = Moments::default();
    let mut ends = Vec::new();
    for (n, part) in parts.iter().enumerate() {
        let before: Vec<&Part> =
            shared[n].iter().map(|&k| k as usize).filter(|&k| k < n).map(|k| &parts[k]).collect();
        if before.is_empty() {
            continue;
        }
        let (mut low, mut high) = part.bounds();
        let boxes = before.iter().map(|other| other.bounds());
        let all = boxes.reduce(|(a, b), (c, d)| (a.inf(&c), b.sup(&d))).expect("not empty");
        (low, high) = (low.sup(&all.0), high.inf(&all.1));
        let step = (high - low) / LINES as f64;
        let at = |axis: usize, k: usize| low[axis] + (k as f64 + 0.5) * step[axis];
        for (y, z) in (0..LINES).flat_map(|k| (0..LINES).map(move |j| (at(1, j), at(2, k)))) {
            let Some((from, to)) = part.row(y, z) else { continue };
            ends.clear();
            ends.extend(before.iter().filter_map(|other| other.row(y, z)));
            ends.sort_by(|a, b| a.0.total_cmp(&b.0));
            let mut done = from;
            for &(first, last) in &ends {
                let (first, last) = (first.max(done), last.min(to));
                if first < last {
                    sum.add([y, z], (first, last), step.y * step.z);
                    done = last;
                }
            }
        }
    }
    sum
}

/// [`thickness`] of all parts of a body of this radius, infinite for the thinnest ones that hold less than `splinters` (m^3) together.
fn thicknesses(parts: &[Part], radius: f64, splinters: f64) -> Vec<f64> {
    let mut all: Vec<f64> = (0..parts.len()).map(|n| thickness(parts, n, radius)).collect();
    let mut order: Vec<usize> = (0..parts.len()).collect();
    order.sort_by(|&a, &b| all[a].total_cmp(&all[b]));
    let mut held = 0.0;
    for n in order {
        held += parts[n].shape.volume();
        if held > splinters {
            break;
        }
        all[n] = f64::INFINITY;
    }
    all
}

/// Thickness of a part (m) of a body of this radius: the least over its faces of its width across them, if both the face and what lies
/// opposite are mostly surface of the body; infinite if none is. That of its shape, if it has no faces.
fn thickness(parts: &[Part], part: usize, radius: f64) -> f64 {
    let own = &parts[part];
    let Some(solid) = own.shape.as_polyhedron() else { return own.shape.thickness() };
    let near: Vec<&Part> = (parts.iter().enumerate())
        .filter(|(n, other)| {
            let between = (other.position - own.position).norm();
            *n != part && between < (own.shape.circumradius() + other.shape.circumradius()) * 1.01
        })
        .map(|(_, other)| other)
        .collect();
    let corner = |n: &u32| solid.vertices[*n as usize];
    // Of each face: its area, and the share of it that no other part covers.
    let seen: Vec<(f64, f64)> = (solid.faces.iter())
        .map(|face| {
            let corners: Vec<Vec3> = face.corners.iter().map(corner).collect();
            let middle = corners.iter().sum::<Vec3>() / corners.len() as f64;
            let (mut area, mut free) = (0.0, 0.0);
            for (n, from) in corners.iter().enumerate() {
                let to = corners[(n + 1) % corners.len()];
                let facet = 0.5 * (from - middle).cross(&(to - middle)).norm();
                let at = (middle + from + to) / 3.0 + face.normal * (BEYOND * radius);
                let at = own.position + own.orientation * at;
                let is_covered = near.iter().any(|part| part.shape.signed_distance(part.to_own(at)) < 0.0);
                area += facet;
                free += if is_covered { 0.0 } else { facet };
            }
            (area, free)
        })
        .collect();
    let across = |(face, (area, free)): (&Face, &(f64, f64))| {
        let (mut opposite, mut surface) = (0.0, 0.0);
        for (other, (area, free)) in solid.faces.iter().zip(&seen) {
            let towards = (-other.normal.dot(&face.normal)).max(0.0);
            opposite += towards * area;
            surface += towards * free;
        }
        let lowest = solid.vertices.iter().map(|at| face.normal.dot(at)).fold(f64::INFINITY, f64::min);
        (2.0 * free > *area && 2.0 * surface > opposite).then_some(face.offset - lowest)
    };
    solid.faces.iter().zip(&seen).filter_map(across).fold(f64::INFINITY, f64::min)
}

impl Part {
    /// It, or the parts that its shape has.
    fn flattened(self) -> Vec<Self> {
        if self.shape.parts().is_empty() {
            return vec![self];
        }
        let inner = |part: &Self| Self {
            shape: part.shape.clone(),
            position: self.position + self.orientation * part.position,
            orientation: self.orientation * part.orientation,
        };
        self.shape.parts().iter().map(inner).collect()
    }

    /// Corners (m) of the box along the axes of the body that holds it.
    fn bounds(&self) -> (Vec3, Vec3) {
        let (low, high) = self.shape.bounds(&self.orientation);
        (self.position + low, self.position + high)
    }

    /// Ends (m) of the line along x at `y, z`, axes of the body, in it.
    fn row(&self, y: f64, z: f64) -> Option<(f64, f64)> {
        let at = self.position;
        let (low, high) = self.shape.row_interval(&self.orientation, y - at.y, z - at.z, 0.0)?;
        Some((at.x + low, at.x + high))
    }

    /// A point of the body in the frame of the part.
    pub(super) fn to_own(&self, point: Vec3) -> Vec3 {
        self.orientation.inverse_transform_vector(&(point - self.position))
    }

    /// Its furthest point in a direction of the body.
    fn support(&self, direction: &Vec3) -> Vec3 {
        self.position
            + self.orientation * self.shape.support(self.orientation.inverse_transform_vector(direction))
    }

    /// Radius of a sphere about the centre of the body that holds it (m): the smallest one of bodies with flat faces and of spheres.
    fn reach(&self) -> f64 {
        match self.shape.as_polyhedron() {
            Some(solid) => {
                let corners = solid.vertices.iter().map(|&corner| self.position + self.orientation * corner);
                corners.map(|corner| corner.norm()).fold(0.0, f64::max)
            }
            None => self.position.norm() + self.shape.circumradius(),
        }
    }
}

/// True if two parts share more than rounding: projections onto each in turn lead to a point of both, if there is one (von Neumann).
pub(super) fn overlap(a: &Part, b: &Part) -> bool {
    if (b.position - a.position).norm() >= a.shape.circumradius() + b.shape.circumradius() {
        return false;
    }
    let depth = ROUNDING * a.shape.thickness().min(b.shape.thickness());
    let inside = |part: &Part, point: Vec3| part.shape.signed_distance(part.to_own(point)) < -0.5 * depth;
    let mut point = a.position;
    for _ in 0..PROJECTIONS {
        if inside(a, point) && inside(b, point) {
            return true;
        }
        for part in [b, a] {
            let seen = part.to_own(point);
            let above = part.shape.signed_distance(seen) + depth;
            if above > 0.0 {
                point -= part.orientation * part.shape.gradient(seen) * above;
            }
        }
    }
    false
}

impl Shape for Composite {
    fn kind(&self) -> &'static str {
        "composite"
    }

    fn volume(&self) -> f64 {
        self.volume
    }

    fn inertia_per_mass(&self) -> Vec3 {
        self.inertia
    }

    fn circumradius(&self) -> f64 {
        self.circumradius
    }

    /// That of its thinnest part, where both ends are surface of the body.
    fn thickness(&self) -> f64 {
        let least = self.thickness.iter().copied().fold(f64::INFINITY, f64::min);
        if least < f64::INFINITY { least } else { 2.0 * self.circumradius }
    }

    fn thickness_of(&self, part: usize) -> f64 {
        self.thickness[part]
    }

    /// Exact outside; inside that of a part, of which faces may lie within the body.
    fn signed_distance(&self, point: Vec3) -> f64 {
        self.nearest(point).1
    }

    fn gradient(&self, point: Vec3) -> Vec3 {
        let (part, _) = self.nearest(point);
        part.orientation * part.shape.gradient(part.to_own(point))
    }

    fn support(&self, direction: Vec3) -> Vec3 {
        let points = self.parts.iter().map(|part| part.support(&direction));
        crate::math::furthest(points, &direction)
    }

    /// From the first to the last part on the line.
    fn row_interval(&self, orientation: &Quat, y: f64, z: f64, growth: f64) -> Option<(f64, f64)> {
        let of_part = |part: &Part| {
            let arm = orientation * part.position;
            let turn = orientation * part.orientation;
            let (low, high) = part.shape.row_interval(&turn, y - arm.y, z - arm.z, growth)?;
            Some((low + arm.x, high + arm.x))
        };
        self.parts.iter().filter_map(of_part).reduce(|(a, b), (c, d)| (a.min(c), b.max(d)))
    }

    fn parts(&self) -> &[Part] {
        &self.parts
    }

    fn shared_with(&self, part: usize) -> &[u32] {
        &self.shared[part]
    }

    fn surface_mesh(&self, refinement: u32) -> SurfaceMesh {
        let mut all = SurfaceMesh::default();
        for part in &self.parts {
            let SurfaceMesh { points, triangles } = part.shape.surface_mesh(refinement);
            let first = all.points.len() as u32;
            all.points.extend(points.into_iter().map(|point| part.position + part.orientation * point));
            all.triangles.extend(triangles.into_iter().map(|corners| corners.map(|corner| first + corner)));
        }
        all
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::shape::{Cuboid, Sphere};
    use std::sync::Arc;

    pub(crate) fn part(shape: impl Shape + 'static, position: Vec3) -> Part {
        Part { shape: Arc::new(shape), position, orientation: Quat::identity() }
    }

    /// Two spheres of one size that touch, along x.
    pub(crate) fn dumbbell(radius: f64) -> Arc<dyn Shape> {
        let parts = [-radius, radius].map(|x| part(Sphere { radius }, Vec3::x() * x));
        Arc::new(Composite::new(parts.into()).unwrap().0)
    }

    /// A box with these edges (m), cut in two across x.
    pub(crate) fn halves(edges: Vec3) -> Arc<dyn Shape> {
        let half = Vec3::new(0.5 * edges.x, edges.y, edges.z);
        let parts = [-0.25, 0.25].map(|x| part(Cuboid::new(half).unwrap(), Vec3::x() * (x * edges.x)));
        Arc::new(Composite::new(parts.into()).unwrap().0)
    }

    fn near(a: f64, b: f64) -> bool {
        (a - b).abs() < 1e-14 * a.abs().max(b.abs())
    }

    #[test]
    fn a_body_cut_anywhere_is_as_thick_as_it_was() {
        for place in [2e-3, 0.1, 0.5] {
            let edges = Vec3::new(2.0, 1.2, 0.8);
            let part = |low: f64, high: f64| {
                let shape = Cuboid::new(Vec3::new(high - low, edges.y, edges.z)).unwrap();
                part(shape, Vec3::x() * (0.5 * (low + high)))
            };
            let cut = place * edges.x;
            let (body, _) = Composite::new(vec![part(0.0, cut), part(cut, edges.x)]).unwrap();
            assert!((body.thickness() - 0.8).abs() < 1e-12, "{place}: {}", body.thickness());
            assert!((0..2).all(|n| (body.thickness_of(n) - 0.8).abs() < 1e-12));
        }
        // A fin on a block is as thin as it is.
        let block = part(Cuboid::new(Vec3::repeat(1.0)).unwrap(), Vec3::zeros());
        let fin = part(Cuboid::new(Vec3::new(1.0, 0.1, 0.5)).unwrap(), Vec3::z() * 0.75);
        let (body, _) = Composite::new(vec![block, fin]).unwrap();
        assert!((body.thickness() - 0.1).abs() < 1e-12, "{}", body.thickness());
    }

    #[test]
    fn a_splinter_does_not_count_as_thin() {
        let rest = part(Cuboid::new(Vec3::new(1.0, 1.0, 0.9)).unwrap(), Vec3::zeros());
        let splinter = part(Cuboid::new(Vec3::new(0.01, 0.4, 0.1)).unwrap(), Vec3::z() * 0.5);
        let (body, _) = Composite::new(vec![rest, splinter]).unwrap();
        assert!((body.thickness() - 0.9).abs() < 1e-12, "{}", body.thickness());
    }

    #[test]
    fn two_halves_of_a_box_have_the_volume_the_moments_and_the_radius_of_the_box() {
        let edges = Vec3::new(2.0, 1.2, 0.8);
        let (whole, cut) = (Cuboid::new(edges).unwrap(), halves(edges));
        assert!(near(cut.volume(), whole.volume()) && near(cut.circumradius(), whole.circumradius()));
        assert!((cut.inertia_per_mass() - whole.inertia_per_mass()).norm() < 1e-14);
    }

    #[test]
    fn the_frame_of_a_body_is_at_its_centre_of_mass_along_its_principal_axes() {
        let turn = Quat::from_euler_angles(0.3, -0.2, 0.9);
        let edges = Vec3::new(2.0, 1.2, 0.8);
        let parts: Vec<Part> = (halves(edges).parts().iter())
            .map(|part| Part {
                position: Vec3::new(3.0, -1.0, 2.0) + turn * part.position,
                orientation: turn * part.orientation,
                ..part.clone()
            })
            .collect();
        let (body, placement) = Composite::new(parts.clone()).unwrap();
        assert!((placement.centre - Vec3::new(3.0, -1.0, 2.0)).norm() < 1e-14);
        let (mut found, mut expected): (Vec<f64>, Vec<f64>) = (
            body.inertia_per_mass().iter().copied().collect(),
            Cuboid::new(edges).unwrap().inertia_per_mass().iter().copied().collect(),
        );
        found.sort_by(f64::total_cmp);
        expected.sort_by(f64::total_cmp);
        assert!(found.iter().zip(&expected).all(|(a, b)| near(*a, *b)), "{found:?} {expected:?}");
        for (given, part) in parts.iter().zip(body.parts()) {
            assert!((placement.to_body(given.position) - part.position).norm() < 1e-14);
            assert!(given.orientation.angle_to(&(placement.rotation * part.orientation)) < 1e-7);
        }
    }

    #[test]
    fn two_halves_of_a_box_have_its_extent_its_rows_and_its_distances_outside() {
        let edges = Vec3::new(2.0, 1.2, 0.8);
        let (whole, cut) = (Cuboid::new(edges).unwrap(), halves(edges));
        let turn = Quat::from_euler_angles(0.3, -0.2, 0.9);
        let ((low, high), (least, most)) = (whole.bounds(&turn), cut.bounds(&turn));
        assert!((low - least).norm() < 1e-14 && (high - most).norm() < 1e-14);
        for n in 0..200 {
            let at = |k: f64| 3.0 * ((f64::from(n) * k) % 1.0) - 1.5;
            let point = Vec3::new(at(0.618), at(0.414), at(0.732));
            let distance = whole.signed_distance(point);
            if distance > 0.0 {
                assert!((cut.signed_distance(point) - distance).abs() < 1e-14);
                assert!((cut.gradient(point) - whole.gradient(point)).norm() < 1e-7);
            } else {
                assert!(cut.signed_distance(point) <= 0.0);
            }
            let rows = [&whole as &dyn Shape, &*cut].map(|s| s.row_interval(&turn, point.y, point.z, 0.0));
            if let [Some((a, b)), Some((c, d))] = rows {
                assert!((a - c).abs() < 1e-9 && (b - d).abs() < 1e-9);
            }
        }
    }

    /// Bars of this width crossed at right angles, the second one shifted along z.
    fn cross(width: f64, z: f64) -> Composite {
        let bar = |edges, z| part(Cuboid::new(edges).unwrap(), Vec3::z() * z);
        let bars = vec![bar(Vec3::new(2.0, width, width), 0.0), bar(Vec3::new(width, 2.0, width), z)];
        Composite::new(bars).unwrap().0
    }

    #[test]
    fn bars_that_cross_are_cut_apart_with_the_volume_and_the_moments_of_the_union() {
        let (w, body) = (0.2, cross(0.2, 0.0));
        assert_eq!((body.parts().len(), body.shared_with(0)), (3, &[][..]));
        let bar = |l: f64| (l * w * w, l * w * w * (l * l + w * w) / 12.0, l * w * w * w * w / 6.0);
        let ((volume, across, along), (middle, of_middle, _)) = (bar(2.0), bar(w));
        let union = 2.0 * volume - middle;
        assert!(near(body.volume(), union));
        let mut found: Vec<f64> = body.inertia_per_mass().iter().map(|i| i * union).collect();
        found.sort_by(f64::total_cmp);
        let (flat, round) = (across + along - of_middle, 2.0 * across - of_middle);
        assert!([flat, flat, round].iter().zip(&found).all(|(a, b)| (a / b - 1.0).abs() < 1e-12));
        // Aside of each other they only touch.
        assert_eq!(cross(0.2, 0.2).parts().len(), 2);
        assert!(near(cross(0.2, 0.2).volume(), 2.0 * volume));
        // Half on top of each other: what is left of the second bar is cut in three.
        assert_eq!(cross(0.2, 0.1).parts().len(), 4);
        assert!((cross(0.2, 0.1).volume() / (2.0 * volume - 0.5 * middle) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn turned_boxes_that_overlap_keep_every_point_and_share_none() {
        let turn = Quat::from_euler_angles(0.5, 0.3, -0.8);
        let cuboid = |edges: [f64; 3]| -> Arc<dyn Shape> { Arc::new(Cuboid::new(edges.into()).unwrap()) };
        let of =
            |shape, position: [f64; 3], orientation| Part { shape, position: position.into(), orientation };
        let given = vec![
            of(cuboid([1.0, 0.8, 0.6]), [0.0; 3], Quat::identity()),
            of(cuboid([0.9, 0.5, 0.7]), [0.4, 0.2, 0.1], turn),
            of(cuboid([0.4, 0.4, 1.4]), [0.1, 0.0, -0.2], turn * turn),
        ];
        let (body, placement) = Composite::new(given.clone()).unwrap();
        let mut inside = 0;
        for n in 0..20_000 {
            let at = |k: f64| 2.4 * ((f64::from(n) * k) % 1.0) - 1.2;
            // The steps of the sequence that fills a cube evenly.
            let point = Vec3::new(at(0.819_172_5), at(0.671_043_6), at(0.549_700_5));
            let holders = |parts: &[Part], point: Vec3| {
                parts.iter().filter(|p| p.shape.signed_distance(p.to_own(point)) < 0.0).count()
            };
            let pieces = holders(body.parts(), placement.to_body(point));
            assert_eq!(pieces, usize::from(holders(&given, point) > 0), "{point:?}");
            inside += pieces;
        }
        let volume = 2.4_f64.powi(3) * inside as f64 / 20_000.0;
        assert!((body.volume() / volume - 1.0).abs() < 0.02, "{} {volume}", body.volume());
    }

    #[test]
    fn spheres_that_overlap_have_the_volume_and_the_moments_of_their_union() {
        for distance in [0.3, 1.0, 1.6, 1.95] {
            let turn = Quat::from_euler_angles(0.4, 1.0, -0.3);
            let at = |x: f64| part(Sphere { radius: 1.0 }, turn * Vec3::x() * x + Vec3::y());
            let (body, placement) = Composite::new(vec![at(0.0), at(distance)]).unwrap();
            assert_eq!((body.shared_with(0), body.shared_with(1)), (&[1][..], &[0][..]));
            // A lens of two caps, with discs of radius^2 = 1 - x^2.
            let (mut lens, mut along, mut across) = (0.0, 0.0, 0.0);
            let (half, steps) = (0.5 * distance, 100_000);
            let width = (1.0 - half) / f64::from(steps);
            for n in 0..steps {
                let x = half + (f64::from(n) + 0.5) * width;
                let disc = std::f64::consts::PI * (1.0 - x * x) * 2.0 * width;
                lens += disc;
                along += disc * 0.5 * (1.0 - x * x);
                across += disc * (0.25 * (1.0 - x * x) + (x - half) * (x - half));
            }
            let sphere = 4.0 / 3.0 * std::f64::consts::PI;
            let union = 2.0 * sphere - lens;
            assert!((body.volume() - union).abs() < 1e-4 * lens, "{} {union}", body.volume());
            let mut found: Vec<f64> = body.inertia_per_mass().iter().map(|i| i * body.volume()).collect();
            found.sort_by(f64::total_cmp);
            let (thin, thick) = (0.8 * sphere - along, 2.0 * sphere * (0.4 + half * half) - across);
            assert!([thin, thick, thick].iter().zip(&found).all(|(a, b)| (a / b - 1.0).abs() < 1e-4));
            assert!((placement.centre - turn * Vec3::x() * half - Vec3::y()).norm() < 1e-4);
        }
    }

    #[test]
    fn parts_of_parts_are_parts_and_too_many_are_refused() {
        let inner: Arc<dyn Shape> = Arc::new(cross(0.2, 0.2));
        let placed = |z: f64| Part { shape: inner.clone(), ..part(Sphere { radius: 1.0 }, Vec3::z() * z) };
        let (body, _) = Composite::new(vec![placed(0.0), placed(5.0)]).unwrap();
        assert_eq!(body.parts().len(), 4);
        assert!(near(body.volume(), 2.0 * inner.volume()));
        let many = (0..300).map(|n| part(Sphere { radius: 0.4 }, Vec3::x() * f64::from(n))).collect();
        let error = Composite::new(many).unwrap_err();
        assert_eq!(error, ShapeError::TooManyParts { count: 300, most: 256 });
    }
}
