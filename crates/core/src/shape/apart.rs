//! Parts with flat faces that overlap, cut apart: what a part shares with those before it is cut off along their faces.
//!
//! The rest of a convex part `P` outside of another one with the faces `n_k . x <= c_k` is the union of at most as many convex pieces,
//!
//! ```text
//! P_k = { x in P: n_k . x >= c_k, n_j . x <= c_j for j < k }
//! ```
//!
//! which touch, but share nothing.

use super::composite::{ROUNDING, overlap};
use super::polyhedron::COMPUTED;
use super::{Part, Polyhedron};
use crate::math::{Quat, Vec3};
use std::sync::Arc;

/// A plane `normal . x = offset` (m).
#[derive(Clone, Copy)]
struct Plane {
    normal: Vec3,
    offset: f64,
}

/// The same body of parts with flat faces that share nothing, and of the others as they are. Pieces thinner than a thousandth of their part are left out.
pub(super) fn cut(parts: Vec<Part>) -> Vec<Part> {
    let mut done: Vec<Part> = Vec::new();
    for part in parts {
        let least = ROUNDING * part.shape.thickness();
        let known: Vec<Part> =
            done.iter().filter(|other| other.shape.as_polyhedron().is_some()).cloned().collect();
        let mut pieces = vec![part];
        for other in &known {
            pieces = pieces.into_iter().flat_map(|piece| outside(piece, other, least)).collect();
        }
        done.append(&mut pieces);
    }
    done
}

/// The pieces of a part outside of another one, those thinner than `least` (m) left out.
fn outside(part: Part, other: &Part, least: f64) -> Vec<Part> {
    let (Some(_), Some(solid)) = (part.shape.as_polyhedron(), other.shape.as_polyhedron()) else {
        return vec![part];
    };
    if !overlap(&part, other) {
        return vec![part];
    }
    let (mut pieces, mut rest) = (Vec::new(), part);
    for face in &solid.faces {
        let normal = other.orientation * face.normal;
        let plane = Plane { normal, offset: face.offset + normal.dot(&other.position) };
        let beyond = Plane { normal: -plane.normal, offset: -plane.offset };
        pieces.extend(below(&rest, beyond).filter(|piece| piece.shape.thickness() > least));
        match below(&rest, plane) {
            Some(within) => rest = within,
            None => break,
        }
    }
    pieces
}

/// The piece of a part below a plane, if that has a volume.
fn below(part: &Part, Plane { normal, offset }: Plane) -> Option<Part> {
    let solid = part.shape.as_polyhedron()?;
    let at: Vec<Vec3> = solid.vertices.iter().map(|v| part.position + part.orientation * v).collect();
    let heights: Vec<f64> = at.iter().map(|point| normal.dot(point) - offset).collect();
    let rounding = 1e-9 * part.shape.circumradius();
    if heights.iter().all(|height| *height <= rounding) {
        return Some(part.clone());
    }
    let mut points: Vec<Vec3> = (0..at.len()).filter(|&k| heights[k] <= 0.0).map(|k| at[k]).collect();
    for face in &solid.faces {
        for (n, &from) in face.corners.iter().enumerate() {
            // Each edge runs both ways, in two faces.
            let [i, j] = [from, face.corners[(n + 1) % face.corners.len()]].map(|k| k as usize);
            if heights[i] < 0.0 && heights[j] > 0.0 {
                points.push(at[i].lerp(&at[j], heights[i] / (heights[i] - heights[j])));
            }
        }
    }
    let (shape, placement) = Polyhedron::hull(&points, COMPUTED).ok()?;
    let (position, orientation): (Vec3, Quat) = (placement.centre, placement.rotation);
    Some(Part { shape: Arc::new(shape), position, orientation })
}
