//! The walls as VTK polygons (`walls.vtp`), clipped to the box.
//!
//! Planes are single polygons, cylinders are tubes of [`FACETS`] strips, meshes are their facets. Point data: `wall`, the index of the wall in the
//! order of the case, which is also that in `summary.json`; `velocity` (m/s); exact `Normals`, into the free space.

use super::polydata::PolyData;
use crate::domain::Domain;
use crate::error::Result;
use crate::math::{Vec3, triangle_area};
use crate::wall::{Surface, Wall};
use std::f64::consts::TAU;
use std::path::Path;

/// Strips round a cylinder.
const FACETS: u32 = 96;
/// Points this far outside of the box, over its longest edge, still count as inside: faces of the box are walls, too.
const SLACK: f64 = 1e-9;

/// Writes the walls where they are at the start.
pub fn write_walls(path: &Path, domain: &Domain, walls: &[Wall]) -> Result<()> {
    let mut data = PolyData::default();
    let (mut velocities, mut normals, mut indices) = (Vec::new(), Vec::new(), Vec::new());
    for (index, wall) in walls.iter().enumerate() {
        for polygon in polygons(&wall.surface, &domain.size()) {
            let points: Vec<u64> = polygon.iter().map(|&at| data.point(at)).collect();
            data.polygon(points);
            velocities.extend(polygon.iter().map(|&at| wall.velocity(at, 0.0)));
            normals.extend(normals_of(&wall.surface, &polygon));
            indices.extend(polygon.iter().map(|_| index as u32));
        }
    }
    data.integers("wall", indices);
    data.vectors("velocity (m/s)", velocities);
    data.normals(normals);
    data.write(path)
}

/// Writes the facets of all meshes where they are at a time (s), with sums over their contacts since the start: five numbers each, the impulse
/// along x, y and z and along normals (N s), and the work of friction (J).
pub fn write_wear(path: &Path, walls: &[Wall], time: f64, sums: &[f64]) -> Result<()> {
    let (mut data, mut indices) = (PolyData::default(), Vec::new());
    let mut wear: Vec<(Vec3, [f64; 4])> = Vec::new();
    let mut sums = sums.as_chunks::<5>().0.iter();
    for (index, wall) in walls.iter().enumerate() {
        let surface = wall.surface_at(time);
        let Some(placed) = surface.mesh() else { continue };
        for facet in 0..placed.mesh.facets().len() as u32 {
            let corners = placed.corners(facet);
            let area = triangle_area(corners);
            let points = corners.map(|at| data.point(at));
            data.polygon(points);
            let &[x, y, z, normal, friction] = sums.next().unwrap_or(&[0.0; 5]);
            // A mean over no time or no area is zero.
            let mean = |sum: f64| if sum == 0.0 { 0.0 } else { sum / (area * time) };
            wear.extend([(Vec3::new(x, y, z), [normal, mean(normal), friction, mean(friction)]); 3]);
            indices.extend([index as u32; 3]);
        }
    }
    data.integers("wall", indices);
    data.vectors("contact_impulse (N s)", wear.iter().map(|of| of.0));
    for (n, head) in WEAR.into_iter().enumerate() {
        data.scalars(head, wear.iter().map(|of| of.1[n]));
    }
    data.write(path)
}

/// Arrays of a file of wear beside the impulse, with the same values at the corners of a facet.
const WEAR: [&str; 4] =
    ["normal_impulse (N s)", "mean_pressure (Pa)", "friction_work (J)", "mean_friction_power (W/m^2)"];

/// Area of the part of a surface inside of the box from the origin to `size` (m^2).
pub fn area(surface: &Surface, size: &Vec3) -> f64 {
    let of = |polygon: &Vec<Vec3>| -> Vec3 {
        let fan = polygon.windows(2).skip(1);
        fan.map(|w| (w[0] - polygon[0]).cross(&(w[1] - polygon[0])) * 0.5).sum()
    };
    polygons(surface, size).iter().map(|polygon| of(polygon).norm()).sum()
}

/// The part of a surface inside of the box from the origin to `size`, counter-clockwise seen from the free space.
pub(super) fn polygons(surface: &Surface, size: &Vec3) -> Vec<Vec<Vec3>> {
    let whole = match *surface {
        Surface::Mesh(ref placed) => {
            (0..placed.mesh.facets().len() as u32).map(|facet| placed.corners(facet).to_vec()).collect()
        }
        Surface::Plane { point, normal } => {
            let middle = 0.5 * size;
            let foot = middle - normal * (middle - point).dot(&normal);
            let (a, b) = across(&normal);
            let reach = 2.0 * size.norm();
            let corner = |i: f64, j: f64| foot + reach * (i * a + j * b);
            vec![vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)]]
        }
        Surface::Cylinder { point, axis, radius, pipe } => {
            let (a, b) = across(&axis);
            let middle = point + axis * (0.5 * size - point).dot(&axis);
            let end = axis * size.norm();
            let at = |facet: u32| {
                let angle = TAU * f64::from(facet % FACETS) / f64::from(FACETS);
                middle + radius * (angle.cos() * a + angle.sin() * b)
            };
            let strip = |facet| {
                let (from, to) = if pipe { (at(facet + 1), at(facet)) } else { (at(facet), at(facet + 1)) };
                vec![from - end, to - end, to + end, from + end]
            };
            (0..FACETS).map(strip).collect()
        }
    };
    whole.into_iter().map(|polygon| inside(polygon, size)).filter(|polygon| polygon.len() > 2).collect()
}

/// Normals at the corners of a polygon of a surface: of a mesh that of its facet.
pub(super) fn normals_of(surface: &Surface, polygon: &[Vec3]) -> Vec<Vec3> {
    if surface.mesh().is_none() {
        return polygon.iter().map(|&at| surface.normal(at)).collect();
    }
    let fan = polygon.windows(2).skip(1).map(|w| (w[0] - polygon[0]).cross(&(w[1] - polygon[0])));
    vec![fan.sum::<Vec3>().try_normalize(0.0).unwrap_or_else(Vec3::z); polygon.len()]
}

/// Two unit vectors that complete `normal` to a right-handed frame, itself the third.
fn across(normal: &Vec3) -> (Vec3, Vec3) {
    let least = normal.abs().imin();
    let a = Vec3::ith(least, 1.0).cross(normal).normalize();
    (a, normal.cross(&a))
}

/// The part of a convex polygon inside of the box, cut face by face (Sutherland and Hodgman 1974).
fn inside(mut polygon: Vec<Vec3>, size: &Vec3) -> Vec<Vec3> {
    let slack = SLACK * size.max();
    for (axis, sign) in (0..3).flat_map(|axis| [(axis, -1.0), (axis, 1.0)]) {
        let limit = if sign < 0.0 { 0.0 } else { size[axis] };
        let beyond = |p: &Vec3| sign * p[axis] - limit - slack;
        let mut kept = Vec::with_capacity(polygon.len() + 1);
        for (i, p) in polygon.iter().enumerate() {
            let q = &polygon[(i + 1) % polygon.len()];
            let (at_p, at_q) = (beyond(p), beyond(q));
            if at_p <= 0.0 {
                kept.push(*p);
            }
            if (at_p <= 0.0) != (at_q <= 0.0) {
                kept.push(p.lerp(q, at_p / (at_p - at_q)));
            }
        }
        polygon = kept;
    }
    polygon
}

#[cfg(test)]
mod tests {
    use super::super::vtk_reader::{piece as read, point_data as array};
    use super::*;
    use crate::wall::Motion;

    const BOX: Domain = Domain { faces: Domain::faces([true, true, false]), cells: [10, 20, 30], dx: 0.1 };

    fn vector_area(polygons: &[Vec<Vec3>]) -> Vec3 {
        let one = |p: &Vec<Vec3>| -> Vec3 {
            let fan = p.windows(2).skip(1);
            fan.map(|w| (w[0] - p[0]).cross(&(w[1] - p[0])) * 0.5).sum()
        };
        polygons.iter().map(one).sum()
    }

    #[test]
    fn a_face_of_the_box_is_a_rectangle_and_a_tilted_plane_is_cut_to_size() {
        let face = Surface::Plane { point: Vec3::zeros(), normal: Vec3::z() };
        let cut = polygons(&face, &BOX.size());
        assert_eq!((cut.len(), cut[0].len()), (1, 4));
        assert!((vector_area(&cut) - Vec3::z() * 2.0).norm() < 1e-7);
        // Through the diagonal of x and y.
        let normal = Vec3::new(2.0, -1.0, 0.0).normalize();
        let tilted = Surface::Plane { point: Vec3::new(0.5, 1.0, 9.0), normal };
        let cut = polygons(&tilted, &BOX.size());
        assert!((vector_area(&cut) - normal * 5.0_f64.sqrt() * 3.0).norm() < 1e-7);
        assert!((area(&tilted, &BOX.size()) - 5.0_f64.sqrt() * 3.0).abs() < 1e-7);
        let outside = Surface::Plane { point: Vec3::new(0.0, 0.0, -0.01), normal: Vec3::z() };
        assert!(polygons(&outside, &BOX.size()).is_empty());
    }

    #[test]
    fn a_pipe_is_a_tube_as_long_as_the_box_seen_from_inside() {
        for pipe in [true, false] {
            let surface =
                Surface::Cylinder { point: Vec3::new(0.5, 7.0, 1.5), axis: Vec3::y(), radius: 0.4, pipe };
            let cut = polygons(&surface, &BOX.size());
            assert_eq!(cut.len(), FACETS as usize);
            let mut total = 0.0;
            for strip in cut {
                let area = vector_area(std::slice::from_ref(&strip));
                let middle = strip.iter().sum::<Vec3>() / strip.len() as f64;
                assert!(area.normalize().dot(&surface.normal(middle)) > 0.99);
                total += area.norm();
            }
            assert!((total / (TAU * 0.4 * 2.0) - 1.0).abs() < 1e-3, "{total}");
        }
    }

    #[test]
    fn the_file_says_which_wall_it_is_and_how_it_moves() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("walls.vtp");
        let wall = |normal: Vec3, point, velocity: Vec3| Wall {
            name: "plate".to_owned(),
            surface: Surface::Plane { point, normal },
            motion: Motion { velocity: velocity.into(), ..Motion::default() },
            material: 0,
        };
        let walls = [
            wall(Vec3::z(), Vec3::zeros(), Vec3::zeros()),
            wall(-Vec3::z(), BOX.size(), Vec3::new(0.5, 0.0, 0.0)),
        ];
        write_walls(&path, &BOX, &walls).unwrap();
        let piece = read(&path);
        assert_eq!(array(&piece, "wall"), [0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0]);
        assert_eq!(array(&piece, "velocity")[9..15], [0.0, 0.0, 0.0, 0.5, 0.0, 0.0]);
        assert_eq!(array(&piece, "Normals")[21..], [0.0, 0.0, -1.0]);
        assert_eq!(piece.num_polys(), 2);
    }
}
