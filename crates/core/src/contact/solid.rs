//! A polyhedron prepared for contacts: grown, with the tables that the closed forms need.
//!
//! The faces move outwards by the enlargement and the corners stay sharp, so that the grown cube is a cube. Where the
//! planes of a very sharp edge meet far outside they are cut off by a box [`SHARPEST`] enlargements from the
//! circumscribed sphere. Planes that do not bound the body (doubles, for example of a triangulated face) are dropped.

use super::clip::{Clipper, Cut, Graph, Plane};
use crate::math::{Vec3, furthest};
use crate::shape::Polyhedron;
use std::collections::BTreeSet;

/// Limit on how far a corner may move out, in enlargements.
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
    /// Index of the first edge of each face, and one past the last.
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
        let planes = polyhedron.faces.iter().map(|face| Plane { normal: face.normal, offset: face.offset });
        Self::from_planes(planes.collect(), circumradius, enlargement)
    }

    /// Body below all of these planes and, before it is grown, within `circumradius` (m).
    pub(super) fn from_planes(mut planes: Vec<Plane>, circumradius: f64, enlargement: f64) -> Self {
        for plane in &mut planes {
            plane.offset += enlargement;
        }
        let half = circumradius * 1.01 + SHARPEST * enlargement;
        let mut clipper = Clipper::default();
        clipper.load(&Graph::cuboid(Vec3::repeat(-half), Vec3::repeat(half), planes.len() as u32));
        for (number, plane) in planes.iter().enumerate() {
            let cut = clipper.cut(plane, number as u32, SAME * circumradius);
            assert!(cut != Cut::Emptied, "a polyhedron has an inside");
        }
        for side in 0..6 {
            let sign = if side % 2 == 0 { -1.0 } else { 1.0 };
            planes.push(Plane { normal: Vec3::ith(side / 2, sign), offset: half });
        }
        let mut graph = clipper.graph();
        let planes = graph.renumber(&planes);
        let vertices = distinct(graph.positions(), SAME * circumradius);
        let (edges, starts) = edges_by_face(&graph, &planes, SAME * circumradius);
        Self {
            edges,
            starts,
            reach: graph.positions().map(|x| x.norm()).fold(0.0, f64::max),
            inner: planes.iter().map(|p| p.offset).fold(f64::INFINITY, f64::min).max(0.0),
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
        furthest(self.vertices.iter().copied(), direction)
    }

    /// Lowest value of `direction . x` over the body (m).
    #[inline]
    pub(super) fn lowest(&self, direction: &Vec3) -> f64 {
        self.vertices.iter().fold(f64::INFINITY, |low, v| {
            let height = direction.dot(v);
            if height < low { height } else { low }
        })
    }
}

/// The first of all positions that are closer to each other than `tolerance` (m).
fn distinct(positions: impl Iterator<Item = Vec3>, tolerance: f64) -> Vec<Vec3> {
    let mut vertices: Vec<Vec3> = Vec::new();
    // By x, as an integer with the same order.
    let mut by_x = BTreeSet::new();
    let key = |x: f64| {
        let bits = x.to_bits() as i64;
        bits ^ (((bits >> 63) as u64) >> 1) as i64
    };
    for position in positions {
        let near = (key(position.x - tolerance), 0)..=(key(position.x + tolerance), usize::MAX);
        let is_new =
            by_x.range(near).all(|&(_, n): &(i64, usize)| (vertices[n] - position).norm() > tolerance);
        if is_new {
            by_x.insert((key(position.x), vertices.len()));
            vertices.push(position);
        }
    }
    vertices
}

/// Edges longer than `tolerance` (m), face after face, and the index of the first of each face, and their number.
fn edges_by_face(graph: &Graph, planes: &[Plane], tolerance: f64) -> (Vec<Edge>, Vec<usize>) {
    let mut of_face: Vec<Vec<Edge>> = vec![Vec::new(); planes.len()];
    for (face, from, to) in graph.edges() {
        let length = (to - from).norm();
        if length > tolerance {
            let along = (to - from) / length;
            let normal = along.cross(&planes[face as usize].normal);
            of_face[face as usize].push(Edge {
                across: Plane { normal, offset: normal.dot(&from) },
                along,
                ends: [along.dot(&from), along.dot(&to)],
            });
        }
    }
    let mut starts = vec![0];
    starts.extend(of_face.iter().scan(0, |sum, edges| {
        *sum += edges.len();
        Some(*sum)
    }));
    (of_face.concat(), starts)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn corners_are_kept_once_as_by_comparing_all_with_all(
            points in prop::collection::vec(prop::array::uniform3(-4_i8..4), 1..60),
            noise in prop::collection::vec(prop::array::uniform3(-1.0..1.0), 60),
        ) {
            let tolerance = 1e-3;
            let positions: Vec<Vec3> = (points.iter().zip(&noise))
                .map(|(p, n)| Vec3::from(p.map(f64::from)) + Vec3::from(*n) * tolerance)
                .collect();
            let mut expected: Vec<Vec3> = Vec::new();
            for p in &positions {
                if expected.iter().all(|v| (v - p).norm() > tolerance) {
                    expected.push(*p);
                }
            }
            prop_assert_eq!(distinct(positions.into_iter(), tolerance), expected);
        }
    }

    #[test]
    fn edges_of_a_face_are_those_of_the_graph_that_have_it_on_their_left() {
        let planes: Vec<Plane> = (0..200)
            .map(|n| {
                let (height, turn) = (f64::from(n) / 99.5 - 1.0, 2.4 * f64::from(n));
                let radius = (1.0 - height * height).max(0.0).sqrt();
                let normal = Vec3::new(radius * turn.cos(), radius * turn.sin(), height).normalize();
                Plane { normal, offset: 1.0 }
            })
            .collect();
        let solid = Solid::from_planes(planes, 1.5, 0.01);
        assert!(solid.planes.len() > 150, "{}", solid.planes.len());
        for face in 0..solid.planes.len() {
            let of_graph: Vec<f64> = (solid.graph.edges())
                .filter(|(left, from, to)| *left as usize == face && (to - from).norm() > SAME * 1.5)
                .map(|(_, from, to)| ((to - from) / (to - from).norm()).dot(&from))
                .collect();
            let listed: Vec<f64> = solid.edges(face).iter().map(|edge| edge.ends[0]).collect();
            assert!(listed.len() >= 3);
            assert_eq!(listed, of_graph);
        }
    }
}
