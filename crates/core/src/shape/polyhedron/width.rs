//! The smallest width of a convex polyhedron.
//!
//! It is taken between a face and a corner, or between two edges whose common normal supports the body at both (Houle
//! and Toussaint 1988, doi:10.1109/34.3916). The latter are the pairs of edges whose arcs on the sphere of normals
//! cross when one of them is mirrored.

use super::Face;
use crate::math::Vec3;
use std::collections::BTreeMap;

/// Edges whose angle (its sine) is below this are parallel.
const PARALLEL: f64 = 1e-9;

/// Smallest distance of two parallel planes that hold the body between them (m).
pub(super) fn width(vertices: &[Vec3], faces: &[Face]) -> f64 {
    let mut width = f64::INFINITY;
    for face in faces {
        let lowest = vertices.iter().map(|v| face.normal.dot(v)).fold(f64::INFINITY, f64::min);
        width = width.min(face.offset - lowest);
    }
    let edges = edges(vertices, faces);
    for (n, first) in edges.iter().enumerate() {
        // Most pairs fail this, the cheaper test.
        for second in edges[..n].iter().filter(|second| mirrored_arcs_cross(first, second)) {
            let normal = first.along.cross(&second.along);
            // Parallel edges (opposite ones of symmetric bodies) have no common normal; a face gives their width.
            let scale = first.along.norm_squared() * second.along.norm_squared();
            if normal.norm_squared() > PARALLEL * PARALLEL * scale {
                width = width.min((first.start - second.start).dot(&normal).abs() / normal.norm());
            }
        }
    }
    width
}

pub(super) struct Edge {
    start: Vec3,
    pub along: Vec3,
    /// Of the faces on either side.
    pub normals: [Vec3; 2],
    /// Their cross product.
    across: Vec3,
}

/// Every edge once.
pub(super) fn edges(vertices: &[Vec3], faces: &[Face]) -> Vec<Edge> {
    let mut first_side = BTreeMap::new();
    let mut edges = Vec::new();
    for face in faces {
        for (n, &from) in face.corners.iter().enumerate() {
            let to = face.corners[(n + 1) % face.corners.len()];
            if let Some(normal) = first_side.remove(&(to, from)) {
                let start = vertices[from as usize];
                let along = vertices[to as usize] - start;
                edges.push(Edge {
                    start,
                    along,
                    normals: [face.normal, normal],
                    across: face.normal.cross(&normal),
                });
            } else {
                first_side.insert((from, to), face.normal);
            }
        }
    }
    edges
}

/// Returns true if the arc of normals of one edge crosses the mirrored arc of the other; arcs are shorter than half a
/// circle.
fn mirrored_arcs_cross(first: &Edge, second: &Edge) -> bool {
    let [a, b] = first.normals;
    let [c, d] = second.normals;
    let (c_side, d_side) = (c.dot(&first.across), d.dot(&first.across));
    if c_side * d_side >= 0.0 {
        return false;
    }
    let (a_side, b_side) = (a.dot(&second.across), b.dot(&second.across));
    // The last one distinguishes the arc from its mirror image.
    a_side * b_side < 0.0 && c_side * b_side < 0.0
}
