//! Bodies from files: STL (text or binary) and OBJ.
//!
//! A mesh becomes a body only if it is the surface of one: closed, counter-clockwise seen from outside, convex. Normals
//! in the file are ignored. Facets count from 0; polygons of an OBJ file count as the triangles they are split into.

mod stl;

use crate::math::Vec3;
use crate::shape::error::check_size;
use crate::shape::polyhedron::SINGLE_PRECISION;
use crate::shape::{Placement, Polyhedron, Shape, ShapeError};
use std::collections::{BTreeMap, HashMap};
use std::io::Cursor;
use std::path::Path;

/// More facets would make contacts too slow to be of use, and set-up, which compares edges pair by pair.
const MOST_FACETS: usize = 2_000;
const TAKE_HULL: &str = "or set `hull = true` to take the convex hull of its points";

/// The body in the contents of a file, of which `path` has the kind and the name for errors; `scale` is the length in metres of 1
/// in the file. With `hull`, takes the hull of all points whatever the facets are.
///
/// Returns the position of the body in the frame of the file, too (m, after scaling).
///
/// # Errors
/// [`ShapeError::Mesh`] with file, facet and remedy: no file of its kind, numbers that are not finite, a surface that is open,
/// inside out, without volume, or concave.
pub fn parse(
    path: &Path,
    bytes: &[u8],
    scale: f64,
    hull: bool,
) -> Result<(Polyhedron, Placement), ShapeError> {
    check_size("scale", scale)?;
    (facets(path, bytes).and_then(|facets| body(&facets, scale, hull)))
        .map_err(|problem| ShapeError::Mesh { path: path.to_path_buf(), problem })
}

/// The triangles in a file, in its units.
fn facets(path: &Path, bytes: &[u8]) -> Result<Vec<[Vec3; 3]>, String> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    let facets = match extension.as_str() {
        "stl" => stl::parse(bytes)?,
        "obj" => obj(bytes)?,
        other => return Err(format!("the extension is `{other}`, but must be `stl` or `obj`")),
    };
    if facets.len() > MOST_FACETS {
        let count = facets.len();
        return Err(format!("has {count} facets; at most {MOST_FACETS} are of use. Take a coarser mesh"));
    }
    if facets.is_empty() {
        return Err("has no facets".to_owned());
    }
    Ok(facets)
}

fn obj(bytes: &[u8]) -> Result<Vec<[Vec3; 3]>, String> {
    let options = tobj::LoadOptions {
        triangulate: true,
        ignore_points: true,
        ignore_lines: true,
        ..Default::default()
    };
    let no_materials = |_: &Path| Ok((Vec::new(), HashMap::new()));
    let (models, _) = tobj::load_obj_buf(&mut Cursor::new(bytes), &options, no_materials)
        .map_err(|e| format!("is no OBJ file that can be read: {e}"))?;
    let mut facets = Vec::new();
    for model in models {
        let at = |i: u32| -> Option<Vec3> {
            let point = model.mesh.positions.get(3 * i as usize..3 * i as usize + 3)?;
            Some(Vec3::new(point[0], point[1], point[2]))
        };
        for corners in model.mesh.indices.chunks_exact(3) {
            let [Some(a), Some(b), Some(c)] = [corners[0], corners[1], corners[2]].map(at) else {
                return Err(format!("facet {} names a vertex that is not there", facets.len()));
            };
            facets.push([a, b, c]);
        }
    }
    Ok(facets)
}

/// Checks that facets are the surface of a convex body, and builds it.
fn body(facets: &[[Vec3; 3]], scale: f64, hull: bool) -> Result<(Polyhedron, Placement), String> {
    for (n, facet) in facets.iter().enumerate() {
        if let Some(corner) = facet.iter().find(|corner| !corner.iter().all(|x| (x * scale).is_finite())) {
            let [x, y, z] = (*corner).into();
            return Err(format!("facet {n} has a corner at ({x}, {y}, {z}); export the mesh again"));
        }
    }
    let scaled: Vec<[Vec3; 3]> = facets.iter().map(|facet| facet.map(|corner| corner * scale)).collect();
    let points: Vec<Vec3> = scaled.iter().flatten().copied().collect();
    let built = Polyhedron::hull(&points, SINGLE_PRECISION).map_err(|e| e.to_string())?;
    if !hull {
        let tolerance = SINGLE_PRECISION * 2.0 * built.0.circumradius();
        check_closed(&scaled, tolerance)?;
        check_orientation(&scaled, built.0.volume())?;
        check_convex(&scaled, &built, 4.0 * tolerance)?;
    }
    Ok(built)
}

/// Each edge must be run through once each way.
fn check_closed(facets: &[[Vec3; 3]], tolerance: f64) -> Result<(), String> {
    let mut welded = Welded { spacing: tolerance, cells: BTreeMap::new(), count: 0 };
    let mut edges = BTreeMap::new();
    for (n, facet) in facets.iter().enumerate() {
        let corners = facet.map(|corner| welded.number(corner));
        if corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0] {
            continue; // without area, so without sides
        }
        for side in 0..3 {
            let (from, to) = (corners[side], corners[(side + 1) % 3]);
            if let Some((other, _)) = edges.insert((from, to), (n, side)) {
                return Err(format!(
                    "facets {other} and {n} run through a common edge the same way, so one of them is inside out or there \
                     twice; make all facets run counter-clockwise seen from outside, {TAKE_HULL}"
                ));
            }
        }
    }
    for (&(from, to), &(n, side)) in &edges {
        if !edges.contains_key(&(to, from)) {
            let [a, b] = [facets[n][side], facets[n][(side + 1) % 3]];
            return Err(format!(
                "the surface is open: facet {n} has no neighbour along its edge from ({}, {}, {}) m to ({}, {}, {}) m; \
                 close the mesh, {TAKE_HULL}",
                a.x, a.y, a.z, b.x, b.y, b.z
            ));
        }
    }
    Ok(())
}

/// The volume the facets enclose must be positive.
fn check_orientation(facets: &[[Vec3; 3]], hull_volume: f64) -> Result<(), String> {
    let origin = facets[0][0];
    let volume: f64 =
        facets.iter().map(|t| t.map(|c| c - origin)).map(|[a, b, c]| a.dot(&b.cross(&c)) / 6.0).sum();
    if volume.abs() <= SINGLE_PRECISION * hull_volume {
        return Err(format!(
            "the facets enclose no volume ({volume} m^3); export the mesh again, {TAKE_HULL}"
        ));
    }
    if volume < 0.0 {
        return Err(format!(
            "all facets are inside out: they run clockwise seen from outside (the enclosed volume is {volume} m^3); flip \
             them, {TAKE_HULL}"
        ));
    }
    Ok(())
}

/// A facet whose corners and centre lie on the hull is part of it.
fn check_convex(
    facets: &[[Vec3; 3]],
    (hull, placement): &(Polyhedron, Placement),
    tolerance: f64,
) -> Result<(), String> {
    let mut deepest = (0, 0.0);
    for (n, [a, b, c]) in facets.iter().enumerate() {
        for point in [*a, *b, *c, (a + b + c) / 3.0] {
            let depth = -hull.signed_distance(placement.to_body(point));
            if depth > deepest.1 {
                deepest = (n, depth);
            }
        }
    }
    if deepest.1 > tolerance {
        let (n, depth) = deepest;
        return Err(format!(
            "the body is concave: facet {n} lies up to {depth} m below the convex hull; bodies must be convex: split \
             the body, {TAKE_HULL}"
        ));
    }
    Ok(())
}

/// Numbers of points; those closer than the spacing to an earlier one have its number.
struct Welded {
    spacing: f64,
    cells: BTreeMap<[i64; 3], Vec<(Vec3, u32)>>,
    count: u32,
}

impl Welded {
    fn number(&mut self, point: Vec3) -> u32 {
        let cell: [i64; 3] = (point / self.spacing).map(|x| x.floor() as i64).into();
        for n in 0..27 {
            let near = [n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1];
            let key = [0, 1, 2].map(|i| cell[i].saturating_add(near[i]));
            let found = self
                .cells
                .get(&key)
                .and_then(|points| points.iter().find(|(other, _)| (other - point).norm() <= self.spacing));
            if let Some(&(_, number)) = found {
                return number;
            }
        }
        self.count += 1;
        self.cells.entry(cell).or_default().push((point, self.count));
        self.count
    }
}

#[cfg(test)]
mod tests;
