//! The point of a polyhedron nearest to a point outside: on a face, an edge or a corner.
//!
//! The nearest point lies on a face whose plane the point is above. If the foot of the perpendicular on that plane
//! lies within the face it is the nearest point of all, as no plane is further than the body. Otherwise the nearest
//! point of a face lies on one of the edges that the point is beyond.

use super::Face;
use crate::math::Vec3;

/// One edge of one face.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Side {
    /// Unit vector in the face, out of it across the edge.
    outward: Vec3,
    /// `outward . x` of the edge (m).
    offset: f64,
    /// Start of the edge (m).
    start: Vec3,
    /// To its end (m).
    edge: Vec3,
    /// One over the square of its length (1/m^2).
    per_square: f64,
}

/// Planes and edges laid out for fast queries.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Features {
    /// Normal and offset of each face.
    pub planes: Vec<[f64; 4]>,
    /// Sides of face `f` are `starts[f]..starts[f + 1]`.
    starts: Vec<u32>,
    sides: Vec<Side>,
}

impl Features {
    pub(super) fn new(vertices: &[Vec3], faces: &[Face]) -> Self {
        let mut features = Self {
            planes: faces.iter().map(|f| [f.normal.x, f.normal.y, f.normal.z, f.offset]).collect(),
            starts: vec![0],
            sides: Vec::new(),
        };
        for face in faces {
            for (n, &corner) in face.corners.iter().enumerate() {
                let start = vertices[corner as usize];
                let edge = vertices[face.corners[(n + 1) % face.corners.len()] as usize] - start;
                let outward = edge.cross(&face.normal).normalize();
                let (offset, per_square) = (outward.dot(&start), 1.0 / edge.norm_squared());
                features.sides.push(Side { outward, offset, start, edge, per_square });
            }
            features.starts.push(features.sides.len() as u32);
        }
        features
    }

    /// Height above the plane that is highest below the point, or least deep above it, and the number of its face.
    #[inline]
    pub(super) fn highest_plane(&self, point: Vec3) -> (f64, usize) {
        let mut best = (f64::NEG_INFINITY, 0);
        for (n, plane) in self.planes.iter().enumerate() {
            let height = height(plane, point);
            if height > best.0 {
                best = (height, n);
            }
        }
        best
    }

    /// Signed distance (m).
    #[inline]
    pub(super) fn distance(&self, point: Vec3) -> f64 {
        match self.nearest(point) {
            Nearest::Face(_, height) => height,
            Nearest::Edge(offset) => offset.norm(),
        }
    }

    /// Gradient of [`Self::distance`].
    pub(super) fn gradient(&self, point: Vec3) -> Vec3 {
        let normal = |face: usize| Vec3::from_fn(|i, _| self.planes[face][i]);
        match self.nearest(point) {
            Nearest::Face(face, _) => normal(face),
            Nearest::Edge(offset) => {
                offset.try_normalize(0.0).unwrap_or_else(|| normal(self.highest_plane(point).1))
            }
        }
    }

    /// The nearest feature of a point.
    #[inline]
    fn nearest(&self, point: Vec3) -> Nearest {
        let (height, face) = self.highest_plane(point);
        if height <= 0.0 || self.covers(face, point) {
            Nearest::Face(face, height)
        } else {
            self.outside(point)
        }
    }

    /// Returns true if the foot of the perpendicular on the plane of the face lies within the face.
    #[inline]
    fn covers(&self, face: usize, point: Vec3) -> bool {
        self.sides_of(face).iter().all(|side| side.outward.dot(&point) <= side.offset)
    }

    /// Distance of a point of the plane of a face from its rim, positive within (m).
    pub(super) fn inside(&self, face: usize, point: Vec3) -> f64 {
        let within = self.sides_of(face).iter().map(|side| side.offset - side.outward.dot(&point));
        within.fold(f64::INFINITY, f64::min)
    }

    #[inline]
    fn sides_of(&self, face: usize) -> &[Side] {
        &self.sides[self.starts[face] as usize..self.starts[face + 1] as usize]
    }

    /// The nearest feature of a point above some plane.
    fn outside(&self, point: Vec3) -> Nearest {
        let mut best = (f64::INFINITY, Vec3::zeros());
        for (face, plane) in self.planes.iter().enumerate() {
            let height = height(plane, point);
            if height <= 0.0 {
                continue;
            }
            let mut covered = true;
            for side in self.sides_of(face) {
                if side.outward.dot(&point) > side.offset {
                    covered = false;
                    let from_start = point - side.start;
                    let along = (from_start.dot(&side.edge) * side.per_square).clamp(0.0, 1.0);
                    let offset = from_start - side.edge * along;
                    let square = offset.norm_squared();
                    if square < best.0 {
                        best = (square, offset);
                    }
                }
            }
            if covered {
                return Nearest::Face(face, height);
            }
        }
        Nearest::Edge(best.1)
    }
}

#[inline]
fn height(plane: &[f64; 4], point: Vec3) -> f64 {
    plane[0] * point.x + plane[1] * point.y + plane[2] * point.z - plane[3]
}

/// Feature that is nearest to a point.
enum Nearest {
    /// This face, at this height above it (m).
    Face(usize, f64),
    /// A point of an edge, or a corner; the vector from there (m).
    Edge(Vec3),
}
