//! A rigid body of several convex parts, which may touch but do not overlap.
//!
//! Volumes add up, and moments of inertia with the arms `d` from the common centre of mass:
//!
//! ```text
//! V = sum V_i,   x = sum V_i x_i / V,   J = sum V_i (R_i J_i R_i^T + d_i.d_i - d_i d_i^T) / V
//! ```

use super::polyhedron::mass::principal_axes;
use super::{Part, Placement, Shape, ShapeError, SurfaceMesh};
use crate::math::{Mat3, Quat, Vec3};

/// Part of the smaller thickness by which two parts may overlap: what touches overlaps by rounding.
const ROUNDING: f64 = 1e-3;

/// Projections after which a common point of two parts is found.
const PROJECTIONS: usize = 200;

/// A rigid body of several convex parts.
#[derive(Clone, Debug)]
pub struct Composite {
    parts: Vec<Part>,
    volume: f64,
    inertia: Vec3,
    circumradius: f64,
}

impl Composite {
    /// The body of these parts, with poses in any one frame, and where its centre of mass and principal axes lie in that frame.
    ///
    /// # Errors
    /// [`ShapeError::Overlap`] for parts that overlap: what they share would count twice.
    ///
    /// # Panics
    /// If there are no parts, or parts of parts.
    pub fn new(mut parts: Vec<Part>) -> Result<(Self, Placement), ShapeError> {
        assert!(!parts.is_empty() && parts.iter().all(|part| part.shape.parts().is_empty()), "convex parts");
        for second in 1..parts.len() {
            if let Some(first) = (0..second).find(|&first| overlap(&parts[first], &parts[second])) {
                return Err(ShapeError::Overlap { first, second });
            }
        }
        let volume: f64 = parts.iter().map(|part| part.shape.volume()).sum();
        let weighted = |part: &Part| part.position * part.shape.volume();
        let centre = parts.iter().map(weighted).sum::<Vec3>() / volume;
        let mut tensor = Mat3::zeros();
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
        Ok((Self { parts, volume, inertia, circumradius }, Placement { centre, rotation }))
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

impl Part {
    /// A point of the body in the frame of the part.
    fn to_own(&self, point: Vec3) -> Vec3 {
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
fn overlap(a: &Part, b: &Part) -> bool {
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

    /// That of its thinnest part.
    fn thickness(&self) -> f64 {
        self.parts.iter().map(|part| part.shape.thickness()).fold(f64::INFINITY, f64::min)
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

    #[test]
    fn parts_that_overlap_are_refused_and_those_that_touch_are_not() {
        let crossed = |z: f64| {
            let bar = |edges, z| part(Cuboid::new(edges).unwrap(), Vec3::z() * z);
            Composite::new(vec![bar(Vec3::new(2.0, 0.2, 0.2), 0.0), bar(Vec3::new(0.2, 2.0, 0.2), z)])
        };
        assert!(crossed(0.2).is_ok());
        let error = crossed(0.15).unwrap_err();
        assert_eq!(error, ShapeError::Overlap { first: 0, second: 1 });
        assert!(error.to_string().contains("parts 0 and 1 overlap"), "{error}");
    }
}
