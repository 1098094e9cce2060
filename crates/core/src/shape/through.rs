//! A body that goes through the periodic faces of the box: its next image continues it, so it has no ends.
//!
//! Mass, extent and picture are those of the piece in the box, its surface is that of a piece [`STRETCH`] times as long. The sharpness of
//! its edges is per length, with the root of the area of its section in place of the cube root of its volume.

use super::{Curvature, Cylinder, Polyhedron, Shape, SurfaceMesh};
use crate::math::{Quat, Vec3};
use std::sync::Arc;

/// Length of the surface in lengths of the body: nothing that is nearer to the body than to its next image sees its ends.
const STRETCH: f64 = 9.0;
/// The same for the mean curvature, to which the ends add little.
const ENDLESS: f64 = 1e4;
/// Components of normals that are none.
const NONE: f64 = 1e-9;

/// The way a body goes through the box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Passage {
    /// Axis of the box along which it does.
    pub axis: usize,
    /// That axis in the body frame.
    pub along: Vec3,
    /// Its length (m), which is the edge of the box.
    pub length: f64,
    /// Radius of the smallest cylinder about that axis that holds it (m).
    pub radius: f64,
}

/// A cylinder or prism without ends.
#[derive(Clone, Debug)]
pub struct Through {
    piece: Arc<dyn Shape>,
    long: Arc<dyn Shape>,
    passage: Passage,
    curvature: Curvature,
}

impl Through {
    /// A body whose own axis `along` lies along an `axis` of the box; none if it is no cylinder or prism along it.
    pub fn new(piece: Arc<dyn Shape>, axis: usize, along: Vec3) -> Option<Self> {
        let (long, endless) = (stretched(&*piece, along, STRETCH)?, stretched(&*piece, along, ENDLESS)?);
        let length = 2.0 * piece.support(along).dot(&along);
        let half = 0.5 * length;
        let radius = (piece.circumradius() * piece.circumradius() - half * half).max(0.0).sqrt();
        let (section, mut curvature) = (piece.volume() / length, endless.curvature());
        curvature.sharpness = curvature.sharpness * section.sqrt() / libm::cbrt(endless.volume());
        Some(Self { piece, long, passage: Passage { axis, along, length, radius }, curvature })
    }
}

/// A cylinder or prism longer by a factor along its own axis.
fn stretched(piece: &dyn Shape, along: Vec3, factor: f64) -> Option<Arc<dyn Shape>> {
    if let Some((radius, half)) = piece.as_cylinder() {
        let cylinder = Cylinder::new(radius, 2.0 * half * factor).ok()?;
        return (along.xy().norm() < NONE).then(|| Arc::new(cylinder) as _);
    }
    let axis = along.abs().imax();
    let is_end = |normal: f64| normal.abs() > 1.0 - NONE;
    let prism = piece.as_polyhedron()?;
    let is_prism = prism.faces.iter().all(|face| face.normal[axis].abs() < NONE || is_end(face.normal[axis]));
    (is_prism && is_end(along[axis])).then(|| Arc::new(prism.stretched(axis, factor)) as _)
}

impl Shape for Through {
    fn kind(&self) -> &'static str {
        self.piece.kind()
    }

    fn volume(&self) -> f64 {
        self.piece.volume()
    }

    fn inertia_per_mass(&self) -> Vec3 {
        self.piece.inertia_per_mass()
    }

    /// Of the piece: what touches the surface between its ends is not further away.
    fn circumradius(&self) -> f64 {
        self.piece.circumradius()
    }

    fn thickness(&self) -> f64 {
        self.long.thickness()
    }

    fn signed_distance(&self, point: Vec3) -> f64 {
        self.long.signed_distance(point)
    }

    fn gradient(&self, point: Vec3) -> Vec3 {
        self.long.gradient(point)
    }

    fn support(&self, direction: Vec3) -> Vec3 {
        self.long.support(direction)
    }

    fn bounds(&self, orientation: &Quat) -> (Vec3, Vec3) {
        self.piece.bounds(orientation)
    }

    fn row_interval(&self, orientation: &Quat, y: f64, z: f64, growth: f64) -> Option<(f64, f64)> {
        self.long.row_interval(orientation, y, z, growth)
    }

    fn as_cylinder(&self) -> Option<(f64, f64)> {
        self.long.as_cylinder()
    }

    fn as_polyhedron(&self) -> Option<&Polyhedron> {
        self.long.as_polyhedron()
    }

    fn passage(&self) -> Option<Passage> {
        Some(self.passage)
    }

    fn piece(&self) -> Option<Arc<dyn Shape>> {
        Some(self.piece.clone())
    }

    fn curvature(&self) -> Curvature {
        self.curvature
    }

    fn surface_mesh(&self, refinement: u32) -> SurfaceMesh {
        self.piece.surface_mesh(refinement)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::{Capsule, Cuboid};

    #[test]
    fn a_cylinder_and_a_square_prism_have_mass_of_their_length_and_the_curvature_of_their_sides() {
        let near = |a: f64, b: f64| assert!((a - b).abs() < 3e-4 * b.abs(), "{a} {b}");
        let cylinder = Through::new(Arc::new(Cylinder::new(2.0, 3.0).unwrap()), 0, Vec3::z()).unwrap();
        near(cylinder.volume(), 12.0 * std::f64::consts::PI);
        near(cylinder.curvature().mean, 0.25);
        assert!(cylinder.curvature().sharpness < 1e-3);
        let prism = Through::new(Arc::new(Cuboid::new(Vec3::new(2.0, 2.0, 5.0)).unwrap()), 1, Vec3::z());
        let prism = prism.unwrap();
        // Four right edges per length on a perimeter of 8: half the sharpness of a cube.
        near(
            prism.curvature().sharpness,
            0.5 * Cuboid::new(Vec3::repeat(2.0)).unwrap().curvature().sharpness,
        );
        near(prism.passage().unwrap().radius, 2.0_f64.sqrt());
        assert!((prism.passage().unwrap().length - 5.0).abs() < 1e-12);
        for z in [-2.5, 0.0, 2.4, 7.0] {
            assert!((prism.signed_distance(Vec3::new(1.5, 0.2, z)) - 0.5).abs() < 1e-12);
            assert!((cylinder.signed_distance(Vec3::new(0.0, 2.5, z)) - 0.5).abs() < 1e-12);
        }
    }

    #[test]
    fn what_is_no_cylinder_or_prism_along_the_axis_goes_through_no_box() {
        let cylinder = Arc::new(Cylinder::new(2.0, 3.0).unwrap());
        assert!(Through::new(cylinder, 0, Vec3::x()).is_none());
        assert!(Through::new(Arc::new(Capsule::new(1.0, 3.0).unwrap()), 0, Vec3::z()).is_none());
        let points = [[0.0, 0.0, 3.0], [1.0, 0.0, 0.0], [-1.0, 1.0, 0.0], [-1.0, -1.0, 0.0]].map(Vec3::from);
        let (pyramid, _) = Polyhedron::hull(&points, 1e-9).unwrap();
        assert!((0..3).all(|i| Through::new(Arc::new(pyramid.clone()), 2, Vec3::ith(i, 1.0)).is_none()));
    }
}
