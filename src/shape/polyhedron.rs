//! Convex polyhedra: vertices, flat faces with any number of corners, and the planes they lie in.

use crate::math::Vec3;

/// A flat face.
#[derive(Clone, Debug, PartialEq)]
pub struct Face {
    /// Outward unit normal.
    pub normal: Vec3,
    /// `normal . x` of its points (m).
    pub offset: f64,
    /// Indices of its vertices, counter-clockwise seen from outside; at least three.
    pub corners: Vec<u32>,
}

/// A convex polyhedron, body frame: the origin lies inside it, at the centre of mass, and the axes are principal axes.
#[derive(Clone, Debug, PartialEq)]
pub struct Polyhedron {
    /// Vertices (m).
    pub vertices: Vec<Vec3>,
    /// Faces.
    pub faces: Vec<Face>,
}

impl Polyhedron {
    /// A box with these edges (m).
    pub fn cuboid(edges: Vec3) -> Self {
        let half = edges * 0.5;
        let vertices = (0..8)
            .map(|n| Vec3::from_fn(|i, _| if n >> i & 1 == 0 { -half[i] } else { half[i] }))
            .collect();
        let corners: [[u32; 4]; 6] = [
            [0, 4, 6, 2],
            [1, 3, 7, 5],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 2, 3, 1],
            [4, 5, 7, 6],
        ];
        let faces = corners
            .iter()
            .enumerate()
            .map(|(n, corners)| Face {
                normal: Vec3::ith(n / 2, if n % 2 == 0 { -1.0 } else { 1.0 }),
                offset: half[n / 2],
                corners: corners.to_vec(),
            })
            .collect();
        Self { vertices, faces }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_corners_of_a_box_run_counter_clockwise_seen_from_outside() {
        let cuboid = Polyhedron::cuboid(Vec3::new(1.0, 2.0, 3.0));
        for face in &cuboid.faces {
            let [a, b, c] = [0, 1, 2].map(|i| cuboid.vertices[face.corners[i] as usize]);
            assert!((b - a).cross(&(c - b)).normalize().dot(&face.normal) > 1.0 - 1e-12);
            for &corner in &face.corners {
                let height = cuboid.vertices[corner as usize].dot(&face.normal);
                assert!((height - face.offset).abs() < 1e-15);
            }
        }
    }
}
