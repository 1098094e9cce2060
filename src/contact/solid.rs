//! A polyhedron made ready for contacts: grown, and cut into the tables that the closed forms want.
//!
//! The faces move outwards by the enlargement and the corners stay sharp, so that the grown cube is a cube. Where the
//! planes of a very sharp edge meet far outside they are cut off by a box [`SHARPEST`] enlargements from the
//! circumscribed sphere. Planes that do not bound the body (doubles, for example of a triangulated face) are dropped.

use super::clip::{Clipper, Cut, Graph, Plane};
use crate::math::Vec3;
use crate::shape::Polyhedron;

/// How far a corner may move out, in enlargements.
const SHARPEST: f64 = 8.0;
/// A plane that cuts off less than this part of the circumradius is a double.
const SAME: f64 = 1e-12;

/// A convex polyhedron, body frame.
#[derive(Clone, Debug)]
pub(super) struct Solid {
    /// Planes of the faces; their index is the number of the face.
    pub planes: Vec<Plane>,
    /// Corners (m), each once.
    pub vertices: Vec<Vec3>,
    /// Corners, edges and faces.
    pub graph: Graph,
    /// Radius of a sphere about the origin that holds the body (m).
    pub reach: f64,
    /// Radius of a sphere about the origin that lies in the body (m).
    pub inner: f64,
}

impl Solid {
    /// A polyhedron grown by `enlargement` (m).
    ///
    /// # Panics
    /// If nothing lies behind all of its planes.
    pub(super) fn new(polyhedron: &Polyhedron, enlargement: f64) -> Self {
        let circumradius = polyhedron.vertices.iter().map(Vec3::norm).fold(0.0, f64::max);
        let mut planes: Vec<Plane> = polyhedron
            .faces
            .iter()
            .map(|face| Plane {
                normal: face.normal,
                offset: face.offset + enlargement,
            })
            .collect();
        let half = circumradius * 1.01 + SHARPEST * enlargement;
        let mut clipper = Clipper::default();
        clipper.load(&Graph::cube(half, planes.len() as u32));
        for (number, plane) in planes.iter().enumerate() {
            let cut = clipper.cut(plane, number as u32, SAME * circumradius);
            assert!(cut != Cut::Emptied, "a polyhedron has an inside");
        }
        for side in 0..6 {
            let sign = if side % 2 == 0 { -1.0 } else { 1.0 };
            planes.push(Plane {
                normal: Vec3::ith(side / 2, sign),
                offset: half,
            });
        }
        let mut graph = clipper.graph();
        let planes = graph.renumber(&planes);
        let mut vertices: Vec<Vec3> = Vec::new();
        for position in graph.positions() {
            if vertices
                .iter()
                .all(|v| (v - position).norm() > SAME * circumradius)
            {
                vertices.push(position);
            }
        }
        Self {
            reach: graph.positions().map(|x| x.norm()).fold(0.0, f64::max),
            inner: planes
                .iter()
                .map(|p| p.offset)
                .fold(f64::INFINITY, f64::min)
                .max(0.0),
            planes,
            vertices,
            graph,
        }
    }

    /// Lowest value of `direction . x` over the body (m).
    #[inline]
    pub(super) fn lowest(&self, direction: &Vec3) -> f64 {
        self.vertices
            .iter()
            .fold(f64::INFINITY, |low, v| low.min(direction.dot(v)))
    }
}
