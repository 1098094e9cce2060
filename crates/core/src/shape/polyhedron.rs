//! Convex polyhedra: vertices, flat faces with any number of corners, and the planes they lie in.

pub mod mass;
mod nearest;
mod width;

use super::hull::{self, Hull};
use super::{Curvature, Shape, ShapeError, SurfaceMesh, row};
use crate::math::{Quat, Vec3, bounding_box, furthest};
use nearest::Features;
use std::collections::BTreeSet;

/// Relative tolerance for corners that were computed: closer ones are one, faces that are flat up to it are one face.
pub const COMPUTED: f64 = 1e-9;
/// The same for corners in single precision, as binary STL files hold them.
pub const SINGLE_PRECISION: f64 = 1e-6;

/// Most faces of a body: contacts look at all of them, and set-up compares edges pair by pair.
pub const MOST_FACES: usize = 4_096;

/// A flat face.
#[derive(Clone, Debug, PartialEq)]
pub struct Face {
    /// Outward unit normal.
    pub normal: Vec3,
    /// `normal . x` of its points (m). No vertex of the body is above.
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
    features: Features,
    volume: f64,
    inertia: Vec3,
    circumradius: f64,
    width: f64,
}

/// Pose of the body frame in the frame of the input: a body point `x` was given as `centre + rotation x`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Centre of mass (m).
    pub centre: Vec3,
    /// From the body frame to the frame of the input.
    pub rotation: Quat,
}

/// Largest `tan^2(t/2)` of a turn `t` of the normal at an edge that [`Curvature::sharpness`] takes into account.
const SHARPEST: f64 = 4.0;

impl Polyhedron {
    /// A box with these edges (m).
    pub fn cuboid(edges: Vec3) -> Self {
        let half = edges * 0.5;
        let vertices =
            (0..8).map(|n| Vec3::from_fn(|i, _| if n >> i & 1 == 0 { -half[i] } else { half[i] })).collect();
        let corners: [[u32; 4]; 6] =
            [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        let faces = corners
            .iter()
            .enumerate()
            .map(|(n, corners)| Face {
                normal: Vec3::ith(n / 2, if n % 2 == 0 { -1.0 } else { 1.0 }),
                offset: half[n / 2],
                corners: corners.to_vec(),
            })
            .collect();
        Self::assemble(vertices, faces)
    }

    /// The convex hull of points (m), and where its centre and principal axes lie among them.
    ///
    /// Points closer together than `tolerance` times the extent are one (see [`COMPUTED`], [`SINGLE_PRECISION`]).
    ///
    /// # Errors
    /// Fewer than four points, points in a plane, numbers that are not finite, and more than [`MOST_FACES`].
    pub fn hull(points: &[Vec3], tolerance: f64) -> Result<(Self, Placement), ShapeError> {
        let hull = hull::hull(points, tolerance)?;
        let at = |i: u32| hull.points[i as usize];
        let reference = at(hull.triangles[0][0]);
        let mass = mass::mass(hull.triangles.iter().map(|t| t.map(at)), reference);
        let rotation = mass::principal_axes(&mass::inertia(&mass.spread));
        let placement = Placement { centre: mass.centre, rotation };
        Ok((Self::in_frame(&hull, &placement)?, placement))
    }

    /// Volume of the convex hull of points (m^3), 0 of flat ones; `tolerance` as in [`Self::hull`].
    pub fn hull_volume(points: &[Vec3], tolerance: f64) -> f64 {
        let Ok(hull) = hull::hull(points, tolerance) else { return 0.0 };
        let first = hull.points[hull.triangles[0][0] as usize];
        let corner = |n: u32| hull.points[n as usize] - first;
        hull.triangles.iter().map(|&[a, b, c]| corner(a).dot(&corner(b).cross(&corner(c))) / 6.0).sum()
    }

    /// The polyhedron with these corners (m): as [`Self::hull`], but every point must be on the surface of the hull.
    ///
    /// Points in the middle of a face or an edge are no corners and left out.
    ///
    /// # Errors
    /// As [`Self::hull`], and [`ShapeError::Concave`] for the deepest point that is further than the tolerance inside.
    pub fn from_corners(points: &[Vec3], tolerance: f64) -> Result<(Self, Placement), ShapeError> {
        let (body, placement) = Self::hull(points, tolerance)?;
        let depths = points.iter().map(|p| -body.signed_distance(placement.to_body(*p)));
        let deepest = depths
            .enumerate()
            .fold((0, 0.0), |best, (n, depth)| if depth > best.1 { (n, depth) } else { best });
        // A face may be off its plane by the tolerance, and its offset is that of its furthest corner.
        if deepest.1 > 4.0 * tolerance * 2.0 * body.circumradius {
            let (index, depth) = deepest;
            return Err(ShapeError::Concave { index, at: points[index].into(), depth });
        }
        Ok((body, placement))
    }

    /// The same body with all lengths multiplied by a factor above 0.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        let square = factor * factor;
        let scaled = |face: &Face| Face { offset: face.offset * factor, ..face.clone() };
        let vertices: Vec<Vec3> = self.vertices.iter().map(|vertex| vertex * factor).collect();
        let faces: Vec<Face> = self.faces.iter().map(scaled).collect();
        Self {
            features: Features::new(&vertices, &faces),
            volume: self.volume * square * factor,
            inertia: self.inertia * square,
            circumradius: self.circumradius * factor,
            width: self.width * factor,
            vertices,
            faces,
        }
    }

    /// Flat faces from the triangles of a hull, in the body frame.
    fn in_frame(hull: &Hull, placement: &Placement) -> Result<Self, ShapeError> {
        let mut loops = hull::merge(hull);
        if !is_closed(&loops) {
            // Rounding has torn the flat faces apart; the triangles are closed whatever happens.
            loops = hull.triangles.iter().map(|t| t.to_vec()).collect();
        }
        if loops.len() > MOST_FACES {
            return Err(ShapeError::TooManyFaces { count: loops.len(), most: MOST_FACES });
        }
        let used: BTreeSet<u32> = loops.iter().flatten().copied().collect();
        let used = Vec::from_iter(used);
        let vertices: Vec<Vec3> = used.iter().map(|&i| placement.to_body(hull.points[i as usize])).collect();
        let mut faces = Vec::new();
        for corners in loops {
            let corners: Vec<u32> =
                corners.iter().map(|c| used.binary_search(c).expect("corners are used") as u32).collect();
            let at = |n: usize| vertices[corners[n] as usize];
            // Newell's normal: the area vector, the best fit where corners are not quite in one plane.
            let area = (2..corners.len())
                .fold(Vec3::zeros(), |sum, n| sum + (at(n - 1) - at(0)).cross(&(at(n) - at(0))));
            let Some(normal) = area.try_normalize(0.0) else {
                let extent = 2.0 * vertices.iter().map(Vec3::norm).fold(0.0, f64::max);
                return Err(ShapeError::Flat { extent, height: 0.0 });
            };
            let offset = vertices.iter().map(|v| v.dot(&normal)).fold(f64::NEG_INFINITY, f64::max);
            faces.push(Face { normal, offset, corners });
        }
        // What a cell has of faces that nearly continue each other is found before faces cut it at a sharper angle.
        let smooth: Vec<bool> = {
            let edges = width::edges(&vertices, &faces);
            let gentle = |e: &&width::Edge| e.normals[0].dot(&e.normals[1]) > 0.8;
            let bits = |normal: Vec3| <[f64; 3]>::from(normal).map(f64::to_bits);
            let gentle: BTreeSet<[u64; 3]> =
                edges.iter().filter(gentle).flat_map(|e| e.normals.map(bits)).collect();
            faces.iter().map(|face| gentle.contains(&bits(face.normal))).collect()
        };
        let mut order: Vec<usize> = (0..faces.len()).collect();
        order.sort_by_key(|&n| !smooth[n]);
        let faces = order.into_iter().map(|n| faces[n].clone()).collect();
        Ok(Self::assemble(vertices, faces))
    }

    /// Computes the quantities that are stored.
    fn assemble(vertices: Vec<Vec3>, faces: Vec<Face>) -> Self {
        let triangles = faces.iter().flat_map(fan).map(|t| t.map(|i| vertices[i as usize]));
        let mass = mass::mass(triangles, Vec3::zeros());
        Self {
            features: Features::new(&vertices, &faces),
            volume: mass.volume,
            inertia: mass::inertia(&mass.spread).diagonal(),
            circumradius: vertices.iter().map(Vec3::norm).fold(0.0, f64::max),
            width: width::width(&vertices, &faces),
            vertices,
            faces,
        }
    }

    /// A prism along an axis of its frame, longer by a factor.
    pub(super) fn stretched(&self, axis: usize, factor: f64) -> Self {
        let (mut vertices, mut faces) = (self.vertices.clone(), self.faces.clone());
        for vertex in &mut vertices {
            vertex[axis] *= factor;
        }
        for end in faces.iter_mut().filter(|face| face.normal[axis].abs() > 0.5) {
            end.offset *= factor;
        }
        Self::assemble(vertices, faces)
    }

    /// Distance of a point of the plane of a face from the rim of this face, positive within (m).
    pub fn inside(&self, face: usize, point: Vec3) -> f64 {
        self.features.inside(face, point)
    }
}

impl Placement {
    /// A point of the input in the body frame.
    pub fn to_body(&self, point: Vec3) -> Vec3 {
        self.rotation.inverse_transform_vector(&(point - self.centre))
    }
}

/// Triangles of a face.
fn fan(face: &Face) -> impl Iterator<Item = [u32; 3]> {
    (2..face.corners.len()).map(|n| [face.corners[0], face.corners[n - 1], face.corners[n]])
}

/// Returns true if each edge is traversed once in each direction and the faces form one sphere (Euler's formula).
fn is_closed(loops: &[Vec<u32>]) -> bool {
    let mut edges: Vec<(u32, u32)> =
        loops.iter().flat_map(|c| (0..c.len()).map(|n| (c[n], c[(n + 1) % c.len()]))).collect();
    edges.sort_unstable();
    let corners: BTreeSet<u32> = loops.iter().flatten().copied().collect();
    loops.len() >= 4
        && edges.windows(2).all(|pair| pair[0] != pair[1])
        && edges.iter().all(|&(a, b)| edges.binary_search(&(b, a)).is_ok())
        && corners.len() + loops.len() == edges.len() / 2 + 2
}

impl Shape for Polyhedron {
    fn curvature(&self) -> Curvature {
        let mut area = 0.0;
        for face in &self.faces {
            for [a, b, c] in fan(face).map(|corners| corners.map(|i| self.vertices[i as usize])) {
                area += 0.5 * (b - a).cross(&(c - a)).dot(&face.normal);
            }
        }
        let (mut mean, mut smooth, mut sharpness) = (0.0, 0.0, 0.0);
        for edge in width::edges(&self.vertices, &self.faces) {
            let cosine = edge.normals[0].dot(&edge.normals[1]).clamp(-1.0, 1.0);
            let (length, turn) = (edge.along.norm(), libm::acos(cosine));
            mean += 0.5 * length * turn;
            smooth += 0.5 * length * turn * cosine.max(0.0);
            sharpness += 0.25 * length * (1.0 - cosine + ((1.0 - cosine) / (1.0 + cosine)).min(SHARPEST));
        }
        Curvature {
            mean: mean / area,
            smooth: smooth / area,
            sharpness: libm::cbrt(self.volume) * sharpness / area,
        }
    }

    fn kind(&self) -> &'static str {
        "polyhedron"
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

    fn thickness(&self) -> f64 {
        self.width
    }

    #[inline]
    fn signed_distance(&self, point: Vec3) -> f64 {
        self.features.distance(point)
    }

    fn gradient(&self, point: Vec3) -> Vec3 {
        self.features.gradient(point)
    }

    fn support(&self, direction: Vec3) -> Vec3 {
        furthest(self.vertices.iter().copied(), &direction)
    }

    fn bounds(&self, orientation: &Quat) -> (Vec3, Vec3) {
        let turn = orientation.to_rotation_matrix();
        bounding_box(self.vertices.iter().map(|vertex| turn * vertex))
    }

    /// The planes moved by `growth`: exact inwards, and outwards a little long beside edges; there the sphere that
    /// holds the grown body cuts off what is far out.
    fn row_interval(&self, orientation: &Quat, y: f64, z: f64, growth: f64) -> Option<(f64, f64)> {
        let mut clip = row::Clip::ball(self.circumradius + growth.max(0.0), y, z)?;
        let line = row::Line::new(orientation, y, z);
        for plane in &self.features.planes {
            let [nx, ny, nz, offset] = *plane;
            let rise = nx * line.direction.x + ny * line.direction.y + nz * line.direction.z;
            let height = nx * line.origin.x + ny * line.origin.y + nz * line.origin.z;
            clip.below(rise, offset + growth - height);
        }
        clip.interval()
    }

    fn as_polyhedron(&self) -> Option<&Polyhedron> {
        Some(self)
    }

    /// Its flat faces, whatever the requested refinement.
    fn surface_mesh(&self, _: u32) -> SurfaceMesh {
        SurfaceMesh { points: self.vertices.clone(), triangles: self.faces.iter().flat_map(fan).collect() }
    }
}

#[cfg(test)]
mod tests;
