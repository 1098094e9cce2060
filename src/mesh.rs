//! Bodies and walls from files: STL (text or binary) and OBJ.
//!
//! A [wall](wall()) may be any surface. A mesh becomes a body only if it is the surface of one: closed, counter-clockwise seen from outside, convex; as its convex
//! hull; or cut into [convex parts](decompose). Normals in the file are ignored, and so are facets that enclose nothing (`surface.rs`). Facets count from 0; polygons of
//! an OBJ file count as the triangles they are split into.

pub mod decompose;
mod stl;
mod surface;
mod survey;
mod wall;

use crate::math::{Vec3, bounding_box};
use crate::shape::composite::MOST_PARTS;
use crate::shape::error::check_size;
use crate::shape::polyhedron::SINGLE_PRECISION;
use crate::shape::{Composite, Part, Placement, Polyhedron, Shape, ShapeError};
use std::borrow::Cow;
use std::collections::{BTreeMap, HashMap};
use std::io::Cursor;
use std::path::Path;
use std::sync::Arc;
use surface::Surface;
pub use survey::{BodySurvey, MeshUse, Survey, survey};
pub use wall::wall;

/// Most facets of a file, before those in one plane are joined and the convex hull is taken.
const MOST_FACETS: usize = 200_000;
/// Depth below the hull, in diameters of the body, up to which a surface counts as convex: a mesh written with few digits.
const CONVEX: f64 = 1e-4;
/// Coarsest relative precision of vertices that is taken for rounding.
const COARSEST: f64 = 1e-3;
/// Relative precision up to which coordinates of few decimal digits are taken for rounded ones; those of fewer digits are exact.
const DECIMAL: f64 = 1e-5;
/// Rounding of corners, in extents of the body, from which on it is reported.
const REPORTED: f64 = 1e-5;
const TAKE_HULL: &str = "or set `hull = true` to take the convex hull of its points";

/// The corners of the facets of a surface.
pub type Facets = Vec<[Vec3; 3]>;

/// A body from a file.
#[derive(Clone, Debug)]
pub struct Mesh {
    /// The body.
    pub body: Polyhedron,
    /// Its position in the frame of the file (m, after scaling).
    pub placement: Placement,
    /// Notes for the user: facets that were dropped, corners that are rounded, the volume that the convex hull adds.
    pub notes: Vec<String>,
}

/// The body in the contents of a file, of which `path` has the kind and the name for errors; `scale` is the length in metres of 1
/// in the file. With `hull`, takes the convex hull of the surface, closed or not.
///
/// Facets that are there twice and facets without area are [dropped](Mesh::notes). A surface counts as convex if it lies within
/// 1e-4 of the diameter of the body below its hull, with a note beyond the rounding of its coordinates.
///
/// # Errors
/// [`ShapeError::Mesh`] with file, facet and remedy: no file of its kind, numbers that are not finite, a surface that is open,
/// not manifold, inside out, without volume, concave, or that of several bodies.
pub fn parse(path: &Path, bytes: &[u8], scale: f64, hull: bool) -> Result<Mesh, ShapeError> {
    check_size("scale", scale)?;
    (facets(path, bytes).and_then(|Contents { facets, rounding, .. }| body(&facets, rounding, scale, hull)))
        .map_err(|problem| ShapeError::Mesh { path: path.to_path_buf(), problem })
}

/// The bodies that are the parts of one: each solid, group or object in the contents of a file, and each surface that has no corner in common
/// with the others. As [`parse`] otherwise.
///
/// # Errors
/// As [`parse`], with the number of the part and its first facet.
pub fn parts(path: &Path, bytes: &[u8], scale: f64, hull: bool) -> Result<Vec<Mesh>, ShapeError> {
    check_size("scale", scale)?;
    (facets(path, bytes).and_then(|contents| parts_of(&contents, scale, hull)))
        .map_err(|problem| ShapeError::Mesh { path: path.to_path_buf(), problem })
}

fn parts_of(contents: &Contents, scale: f64, hull: bool) -> Result<Vec<Mesh>, String> {
    let Contents { facets, groups, rounding } = contents;
    let separate = separate(facets, groups);
    if separate.len() > MOST_PARTS {
        let (count, most) = (separate.len(), MOST_PARTS);
        return Err(ShapeError::TooManyParts { count, most }.to_string());
    }
    let one = |(n, numbers): (usize, &Vec<usize>)| {
        let own: Vec<[Vec3; 3]> = numbers.iter().map(|&number| facets[number]).collect();
        body(&own, *rounding, scale, hull).map_err(|problem| {
            let first = numbers[0];
            format!("part {n}, whose facet 0 is facet {first} of the file: {problem}")
        })
    };
    separate.iter().enumerate().map(one).collect()
}

/// The union of convex bodies in one frame, and its pose in it; one body alone is itself.
///
/// # Errors
/// As [`Composite::new`].
pub fn united(mut bodies: Vec<(Polyhedron, Placement)>) -> Result<(Arc<dyn Shape>, Placement), ShapeError> {
    if bodies.len() == 1 {
        let (body, placement) = bodies.remove(0);
        return Ok((Arc::new(body), placement));
    }
    let part = |(body, placement): (Polyhedron, Placement)| Part {
        shape: Arc::new(body),
        position: placement.centre,
        orientation: placement.rotation,
    };
    let (body, placement) = Composite::new(bodies.into_iter().map(part).collect())?;
    Ok((Arc::new(body), placement))
}

/// Numbers of the facets of each group, those without a corner in common apart.
fn separate(facets: &[[Vec3; 3]], groups: &[usize]) -> Vec<Vec<usize>> {
    let mut all = Vec::new();
    for (n, &begin) in groups.iter().enumerate() {
        let end = groups.get(n + 1).copied().unwrap_or(facets.len());
        // Each corner leads to the first facet that has it, and each facet to one that it hangs together with.
        let mut first_with: BTreeMap<[u64; 3], usize> = BTreeMap::new();
        let mut leads: Vec<usize> = (0..end - begin).collect();
        let root = |leads: &[usize], mut at: usize| {
            while leads[at] != at {
                at = leads[at];
            }
            at
        };
        for (k, corners) in facets[begin..end].iter().enumerate() {
            for corner in corners {
                // Both zeros are one.
                let bits = <[f64; 3]>::from(*corner).map(|x| (x + 0.0).to_bits());
                let [one, other] = [*first_with.entry(bits).or_insert(k), k].map(|at| root(&leads, at));
                leads[one.max(other)] = one.min(other);
            }
            leads[k] = root(&leads, k);
        }
        let mut found: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for k in 0..leads.len() {
            found.entry(root(&leads, k)).or_default().push(begin + k);
        }
        all.extend(found.into_values());
    }
    all
}

/// Contents of a file.
struct Contents {
    /// Triangles in its units.
    facets: Vec<[Vec3; 3]>,
    /// The first one of each solid, group or object.
    groups: Vec<usize>,
    /// Largest distance over the coordinate of equal vertices.
    rounding: f64,
}

fn facets(path: &Path, bytes: &[u8]) -> Result<Contents, String> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    let ((facets, groups), rounding) = match extension.as_str() {
        "stl" => (stl::parse(bytes)?, 2.0 * f64::from(f32::EPSILON)),
        "obj" => (obj(bytes)?, 0.0),
        other => return Err(format!("the extension is `{other}`, but must be `stl` or `obj`")),
    };
    if facets.len() > MOST_FACETS {
        let count = facets.len();
        return Err(format!("has {count} facets, at most {MOST_FACETS} are read; take a coarser mesh"));
    }
    if facets.is_empty() {
        return Err("has no facets".to_owned());
    }
    Ok(Contents { facets, groups, rounding })
}

fn obj(bytes: &[u8]) -> Result<(Vec<[Vec3; 3]>, Vec<usize>), String> {
    let options = tobj::LoadOptions {
        triangulate: true,
        ignore_points: true,
        ignore_lines: true,
        ..Default::default()
    };
    let text = with_newlines(bytes);
    let bytes = &joined(&text)[..];
    let no_materials = |_: &Path| Ok((Vec::new(), HashMap::new()));
    let (models, _) = tobj::load_obj_buf(&mut Cursor::new(bytes), &options, no_materials)
        .map_err(|e| format!("is no OBJ file that can be read: {e}"))?;
    let (mut facets, mut groups) = (Vec::new(), Vec::new());
    for model in models {
        groups.push(facets.len());
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
    Ok((facets, groups))
}

/// Text whose lines end with a line feed: those of old programs end with a carriage return alone.
fn with_newlines(bytes: &[u8]) -> Cow<'_, [u8]> {
    let is_alone = |pair: &[u8]| pair[0] == b'\r' && pair[1] != b'\n';
    if !bytes.windows(2).any(is_alone) {
        return Cow::Borrowed(bytes);
    }
    let next = bytes.iter().skip(1).copied().chain([b'\n']);
    let change = |(&byte, next): (&u8, u8)| if byte == b'\r' && next != b'\n' { b'\n' } else { byte };
    Cow::Owned(bytes.iter().zip(next).map(change).collect())
}

/// The lines of an OBJ file, of which one that ends with `\\` continues in the next.
fn joined(bytes: &[u8]) -> Cow<'_, [u8]> {
    if !bytes.contains(&b'\\') {
        return Cow::Borrowed(bytes);
    }
    let mut text = Vec::with_capacity(bytes.len());
    for line in bytes.split_inclusive(|byte| *byte == b'\n') {
        match line.trim_ascii_end().strip_suffix(b"\\") {
            Some(begun) if !line.trim_ascii_start().starts_with(b"#") => {
                text.extend_from_slice(begun);
                text.push(b' ');
            }
            _ => text.extend_from_slice(line),
        }
    }
    Cow::Owned(text)
}

/// Distance from their planes that rounding to decimal digits gives points, over the longest edge of their box; 0 if their digits
/// are too few, or too many, to be those of rounded numbers.
pub fn decimal_precision(points: &[Vec3]) -> f64 {
    // The power of ten of the last digit of the shortest number that is read as this one.
    let place = |x: &f64| {
        let single = *x as f32;
        let text =
            if f64::from(single).to_bits() == x.to_bits() { format!("{single:e}") } else { format!("{x:e}") };
        let (digits, exponent) = text.split_once('e')?;
        let decimals = digits.split_once('.').map_or(0, |(_, decimals)| decimals.len() as i32);
        (*x != 0.0).then_some(exponent.parse::<i32>().ok()? - decimals)
    };
    let finest = points.iter().flat_map(|point| point.iter()).filter_map(place).min();
    let (low, high) = bounding_box(points.iter().copied());
    let unit: Option<f64> = finest.and_then(|finest| format!("1e{finest}").parse().ok());
    // A corner lies up to one unit off its plane, and the plane through three of them up to three at a fourth.
    let relative = unit.map_or(0.0, |unit| 4.0 * unit / (high - low).max());
    if relative <= DECIMAL { relative } else { 0.0 }
}

/// Corners in metres; refuses those that are not finite.
fn scaled(facets: &[[Vec3; 3]], scale: f64) -> Result<Vec<[Vec3; 3]>, String> {
    for (n, facet) in facets.iter().enumerate() {
        if let Some(corner) = facet.iter().find(|corner| !corner.iter().all(|x| (x * scale).is_finite())) {
            let [x, y, z] = (*corner).into();
            return Err(format!("facet {n} has a corner at ({x}, {y}, {z}); export the mesh again"));
        }
    }
    Ok(facets.iter().map(|facet| facet.map(|corner| corner * scale)).collect())
}

/// Relative precision of the corners of facets, the extent of these (m), and a note for the user if they are rounded much.
fn tolerance(facets: &[[Vec3; 3]], scaled: &[[Vec3; 3]], rounding: f64) -> ((f64, f64), Option<String>) {
    let (low, high) = bounding_box(scaled.iter().flatten().copied());
    let extent = (high - low).norm();
    // Far from the origin single precision has fewer digits for the body.
    let far = low.amax().max(high.amax());
    let lost = rounding * far / extent;
    let precision = SINGLE_PRECISION.max(lost.min(COARSEST)).max(decimal_precision(facets.as_flattened()));
    let rounded = (lost > REPORTED).then(|| {
        format!(
            "corners lie up to {far:.3e} m from the origin, where single precision rounds them by {:.1e} m, {:.1e} % of the \
             extent of the mesh; move the mesh to the origin and export it again",
            lost * extent,
            100.0 * lost
        )
    });
    ((precision, extent), rounded)
}

/// Checks that facets are the surface of a convex body, and builds it.
fn body(facets: &[[Vec3; 3]], rounding: f64, scale: f64, hull: bool) -> Result<Mesh, String> {
    let scaled = scaled(facets, scale)?;
    let ((precision, extent), rounded) = tolerance(facets, &scaled, rounding);
    let surface = Surface::new(&scaled, precision * extent);
    let checked = checked(&surface, &scaled, precision, hull);
    let (body, placement, mut notes) = checked.map_err(|problem| match &rounded {
        Some(rounded) => format!("{problem}. Its {rounded}"),
        None => problem,
    })?;
    notes.extend(rounded);
    Ok(Mesh { body, placement, notes })
}

/// The body of a surface, and notes.
fn checked(
    surface: &Surface,
    scaled: &[[Vec3; 3]],
    precision: f64,
    hull: bool,
) -> Result<(Polyhedron, Placement, Vec<String>), String> {
    let (body, placement) =
        Polyhedron::hull(&surface.corners(scaled), precision).map_err(|e| e.to_string())?;
    let volume = surface.volume();
    let added = volume.map(|volume| body.volume() / volume.abs() - 1.0);
    let mut notes: Vec<String> = surface.dropped().into_iter().collect();
    let parts = surface.parts();
    if hull {
        if let [_, second, ..] = parts[..] {
            notes.push(format!(
                "the mesh has {} separate surfaces, the second with facet {second}; where they overlap, their volume counts twice",
                parts.len()
            ));
        }
        notes.push(match added {
            Some(added) => format!("the convex hull adds {:.3} % to the volume of the mesh", 100.0 * added),
            None => "the surface is not closed, so it has no volume to compare that of its convex hull with"
                .to_owned(),
        });
    } else {
        surface.check_closed()?;
        if let [_, second, ..] = parts[..] {
            return Err(format!(
                "there are {} separate surfaces, the second with facet {second}, but a convex body has one; set `parts = true` to take each as \
                 a part of the body, {TAKE_HULL}",
                parts.len()
            ));
        }
        check_orientation(volume.unwrap_or(0.0), body.volume())?;
        let added = 100.0 * added.unwrap_or(f64::NAN);
        let (facet, depth) = deepest(surface, &body, &placement);
        let diameter = 2.0 * body.circumradius();
        let part = 100.0 * depth / diameter;
        if depth > CONVEX * diameter {
            return Err(format!(
                "the body is concave: facet {facet} lies up to {depth:.4e} m, {part:.3} % of the diameter of the body, below the convex \
                 hull; a surface must be convex: set `concave = \"decompose\"` to cut the body into convex parts, {TAKE_HULL}, which adds {added:.3} % to the volume"
            ));
        }
        if depth > 4.0 * precision * diameter {
            notes.push(format!(
                "taken as convex, although facet {facet} lies up to {part:.1e} % of the diameter of the body below the convex hull, \
                 which adds {added:.1e} % to the volume"
            ));
        }
    }
    Ok((body, placement, notes))
}

/// The volume that the facets enclose must be positive.
fn check_orientation(volume: f64, hull_volume: f64) -> Result<(), String> {
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

/// The facet that lies furthest below the hull, and how far (m): a facet whose corners and centre lie on the hull is part of it.
fn deepest(surface: &Surface, hull: &Polyhedron, placement: &Placement) -> (usize, f64) {
    let mut deepest = (0, 0.0);
    for (number, [a, b, c]) in surface.triangles() {
        for point in [a, b, c, (a + b + c) / 3.0] {
            let depth = -hull.signed_distance(placement.to_body(point));
            if depth > deepest.1 {
                deepest = (number, depth);
            }
        }
    }
    deepest
}

#[cfg(test)]
mod defect_tests;
#[cfg(test)]
mod tests;
