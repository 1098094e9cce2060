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

/// An edge as seen in the plane of one of its faces.
#[derive(Clone, Copy, Debug)]
pub(super) struct Edge {
    /// Unit vector across the edge, in the plane and out of the face, and its product with the points of the edge (m).
    pub across: Plane,
    /// Unit vector along the edge, counter-clockwise.
    pub along: Vec3,
    /// Product of `along` with the ends (m).
    pub ends: [f64; 2],
}

/// A convex polyhedron, body frame.
#[derive(Clone, Debug)]
pub(super) struct Solid {
    /// Planes of the faces; their index is the number of the face.
    pub planes: Vec<Plane>,
    /// Corners (m), each once.
    pub vertices: Vec<Vec3>,
    /// Corners, edges and faces.
    pub graph: Graph,
    /// Edges of the faces, one face after the other.
    edges: Vec<Edge>,
    /// Where the edges of each face begin, and where the last end.
    starts: Vec<usize>,
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
        let planes = polyhedron.faces.iter().map(|face| Plane {
            normal: face.normal,
            offset: face.offset,
        });
        Self::from_planes(planes.collect(), circumradius, enlargement)
    }

    /// What lies below all of these planes and, before it is grown, within `circumradius` (m).
    pub(super) fn from_planes(mut planes: Vec<Plane>, circumradius: f64, enlargement: f64) -> Self {
        for plane in &mut planes {
            plane.offset += enlargement;
        }
        let half = circumradius * 1.01 + SHARPEST * enlargement;
        let mut clipper = Clipper::default();
        clipper.load(&Graph::cuboid(
            Vec3::repeat(-half),
            Vec3::repeat(half),
            planes.len() as u32,
        ));
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
        let (mut edges, mut starts) = (Vec::new(), vec![0]);
        for (number, plane) in planes.iter().enumerate() {
            for (_, from, to) in graph.edges().filter(|(face, ..)| *face as usize == number) {
                let length = (to - from).norm();
                if length > SAME * circumradius {
                    let along = (to - from) / length;
                    let normal = along.cross(&plane.normal);
                    edges.push(Edge {
                        across: Plane {
                            normal,
                            offset: normal.dot(&from),
                        },
                        along,
                        ends: [along.dot(&from), along.dot(&to)],
                    });
                }
            }
            starts.push(edges.len());
        }
        Self {
            edges,
            starts,
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

    /// Edges of a face.
    #[inline]
    pub(super) fn edges(&self, face: usize) -> &[Edge] {
        &self.edges[self.starts[face]..self.starts[face + 1]]
    }

    /// The corner that lies furthest along a direction (m); the first of several.
    #[inline]
    pub(super) fn furthest(&self, direction: &Vec3) -> Vec3 {
        let mut best = (f64::NEG_INFINITY, Vec3::zeros());
        for vertex in &self.vertices {
            let way = direction.dot(vertex);
            if way > best.0 {
                best = (way, *vertex);
            }
        }
        best.1
    }

    /// Lowest value of `direction . x` over the body (m).
    #[inline]
    pub(super) fn lowest(&self, direction: &Vec3) -> f64 {
        self.vertices
            .iter()
            .fold(f64::INFINITY, |low, v| low.min(direction.dot(v)))
    }
}
