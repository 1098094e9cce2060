//! Walls from mesh files: any surface, closed or open.

use super::surface::Surface;
use super::{Contents, facets, scaled, tolerance};
use crate::math::Vec3;
use crate::shape::ShapeError;
use crate::shape::error::check_size;
use crate::wall::mesh::Flaw;
use crate::wall::{FreeSide, WallMesh};
use std::path::Path;

/// The wall in the contents of a file, of which `path` has the kind and the name for errors, and notes for the user; `scale` is the length in
/// metres of 1 in the file. The free space is on the side given, else outside of a closed surface and on both sides of an open one.
///
/// Vertices that differ by rounding are welded. Facets without area, and those that are there twice, are dropped.
///
/// # Errors
/// [`ShapeError::Mesh`] with file, facets, place and remedy: no file of its kind, numbers that are not finite, no facet with an
/// area, or a surface without the inside that `free` asks for.
pub fn wall(
    path: &Path,
    bytes: &[u8],
    scale: f64,
    free: Option<FreeSide>,
) -> Result<(WallMesh, Vec<String>), ShapeError> {
    check_size("scale", scale)?;
    facets(path, bytes)
        .and_then(|Contents { facets, rounding, .. }| {
            let scaled = scaled(&facets, scale)?;
            let ((precision, extent), rounded) = tolerance(&facets, &scaled, rounding);
            let (mesh, mut notes) = of(&scaled, precision * extent, free)?;
            notes.extend(rounded);
            Ok((mesh, notes))
        })
        .map_err(|problem| ShapeError::Mesh { path: path.to_path_buf(), problem })
}

/// The wall that facets make; vertices closer than a tolerance (m) are one.
pub(super) fn of(
    facets: &[[Vec3; 3]],
    tolerance: f64,
    free: Option<FreeSide>,
) -> Result<(WallMesh, Vec<String>), String> {
    // As the surface of a body, facets that enclose nothing dropped; an open one keeps those with an area.
    let closed = Surface::new(facets, tolerance);
    let mesh = |surface: &Surface| -> Result<Result<WallMesh, Flaw>, String> {
        let (vertices, corners) = surface.parts_of_mesh();
        if corners.is_empty() {
            return Err("no facet has an area; export the mesh again".to_owned());
        }
        Ok(WallMesh::new(vertices, corners, free))
    };
    let attempt = if closed.is_empty() { None } else { Some(mesh(&closed)?) };
    match attempt {
        Some(Ok(mesh)) if mesh.inverted().is_some() => Err(inside_out(&mesh)),
        Some(Ok(mesh)) if mesh.is_closed() => Ok((mesh, closed.dropped().into_iter().collect())),
        Some(Err(flaw)) => Err(format!(
            "{flaw}, the first of {} from {}; close the mesh, or leave `side` out: then it is a sheet, which acts on both sides",
            closed.listed(&flaw.facets),
            place(&flaw),
        )),
        _ => {
            let sheet = Surface::sheet(facets, tolerance);
            let mesh = mesh(&sheet)?.map_err(|flaw| flaw.to_string())?;
            Ok((mesh, sheet.dropped().into_iter().collect()))
        }
    }
}

fn inside_out(mesh: &WallMesh) -> String {
    let [a, b, c] = mesh.corners(mesh.inverted().unwrap_or_default());
    let middle = (a + b + c) / 3.0;
    let [x, y, z] = [middle.x, middle.y, middle.z];
    format!(
        "the surface runs through itself, and is inside out at ({x:.4e}, {y:.4e}, {z:.4e}) m; repair the mesh (MeshLab: remove \
         self-intersections, or take a union), or take `side = \"both\"`: then it is a sheet, which acts on both sides"
    )
}

pub(super) fn place(flaw: &Flaw) -> String {
    let [a, b] = flaw.edge;
    format!("({}, {}, {}) m to ({}, {}, {}) m", a.x, a.y, a.z, b.x, b.y, b.z)
}

#[cfg(test)]
mod tests {
    use super::super::tests::{binary_stl, box_facets, text_stl};
    use super::*;
    use std::path::PathBuf;

    fn read(bytes: &[u8], free: Option<FreeSide>) -> Result<(WallMesh, Vec<String>), String> {
        wall(&PathBuf::from("wall.stl"), bytes, 1e-3, free).map_err(|e| e.to_string())
    }

    #[test]
    fn a_box_is_an_obstacle_or_a_container_whatever_the_order_of_its_corners() {
        let mut facets = box_facets(Vec3::repeat(4.0));
        facets[3].swap(0, 1);
        facets[7].swap(1, 2);
        for bytes in [text_stl(&facets), binary_stl(&facets, "")] {
            let (mesh, notes) = read(&bytes, None).unwrap();
            assert!(notes.is_empty() && mesh.free() == FreeSide::Outside && mesh.vertices().len() == 8);
            assert!((mesh.volume().unwrap() / 64e-9 - 1.0).abs() < 1e-7);
            let (mesh, _) = read(&bytes, Some(FreeSide::Inside)).unwrap();
            assert!(mesh.is_wall(&Vec3::repeat(3e-3)) && !mesh.is_wall(&Vec3::zeros()));
        }
    }

    #[test]
    fn a_box_with_a_hole_is_a_sheet_and_no_container() {
        let mut facets = box_facets(Vec3::repeat(4.0));
        facets.remove(5);
        let (mesh, _) = read(&text_stl(&facets), None).unwrap();
        assert_eq!((mesh.free(), mesh.facets().len()), (FreeSide::Both, 11));
        let said = read(&text_stl(&facets), Some(FreeSide::Inside)).unwrap_err();
        for words in ["open: 3 edges", "the first of facet", "m to (", "leave `side` out"] {
            assert!(said.contains(words), "{said}");
        }
    }

    #[test]
    fn a_surface_that_runs_through_itself_and_is_inside_out_beyond_is_refused_with_the_place() {
        // A prism over a bow tie: its second wing has the other sense.
        let at = |x: f64, y: f64, z: f64| Vec3::new(x, y, z);
        let low = [at(0.0, 0.0, 0.0), at(3.0, 2.0, 0.0), at(3.0, 0.0, 0.0), at(0.0, 1.0, 0.0)];
        let high = low.map(|corner| corner + Vec3::z());
        let mut facets = vec![
            [low[0], low[2], low[1]],
            [low[0], low[3], low[2]],
            [high[0], high[1], high[2]],
            [high[0], high[2], high[3]],
        ];
        for n in 0..4 {
            let m = (n + 1) % 4;
            facets.extend([[low[n], low[m], high[m]], [low[n], high[m], high[n]]]);
        }
        let said = read(&text_stl(&facets), None).unwrap_err();
        for words in ["runs through itself", "inside out at (", "side = \"both\""] {
            assert!(said.contains(words), "{said}");
        }
        assert_eq!(read(&text_stl(&facets), Some(FreeSide::Both)).unwrap().0.free(), FreeSide::Both);
    }

    #[test]
    fn boxes_that_overlap_are_one_wall_and_the_description_says_so() {
        let shifted =
            box_facets(Vec3::repeat(4.0)).into_iter().map(|f| f.map(|corner| corner + Vec3::repeat(1.0)));
        let facets: Vec<_> = box_facets(Vec3::repeat(4.0)).into_iter().chain(shifted).collect();
        let (mesh, _) = read(&text_stl(&facets), None).unwrap();
        assert!(mesh.inverted().is_none() && mesh.to_string().contains("overlaps counted twice"), "{mesh}");
        let (mesh, _) = read(&text_stl(&facets[..12]), None).unwrap();
        assert!(!mesh.to_string().contains("twice"), "{mesh}");
    }

    #[test]
    fn a_sheet_that_is_there_twice_the_two_ways_round_is_there_once() {
        let [a, b, c, d] =
            [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(x, y)| Vec3::new(x, y, 0.0));
        let facets = [[a, b, c], [a, c, d], [a, c, b], [a, d, c], [a, a, b]];
        let (mesh, notes) = read(&text_stl(&facets), None).unwrap();
        assert_eq!((mesh.facets().len(), mesh.free()), (2, FreeSide::Both));
        assert!(notes[0].contains("2 duplicated") && notes[0].contains("1 degenerate"), "{notes:?}");
    }

    #[test]
    fn what_is_no_surface_is_refused() {
        let flat = [[Vec3::x(); 3], [Vec3::zeros(), Vec3::x(), Vec3::x()]];
        assert!(read(&text_stl(&flat), None).unwrap_err().contains("no facet has an area"));
        let bad = [[Vec3::zeros(), Vec3::x(), Vec3::y() * f64::NAN]];
        assert!(read(&binary_stl(&bad, ""), None).unwrap_err().contains("facet 0 has a corner at"));
    }
}
