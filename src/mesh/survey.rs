//! A mesh in a file: what it is, and what it can be in a case.

use super::decompose::{self, EXCESS, Fit};
use super::surface::Surface;
use super::{Contents, Facets, body, facets, parts_of, scaled, tolerance, united, wall};
use crate::math::{Mat3, bounding_box};
use crate::shape::error::check_size;
use crate::shape::polyhedron::mass;
use crate::shape::{Polyhedron, Shape, ShapeError};
use crate::wall::WallMesh;
use serde::Serialize;
use std::path::Path;

/// Extent from which on a body of that many metres is unlikely.
const LARGE: f64 = 0.5;

/// Findings on a mesh.
#[derive(Clone, Debug, Serialize)]
pub struct Survey {
    /// Kind of the file.
    pub format: &'static str,
    /// Facets in the file, polygons split into triangles.
    pub facets: usize,
    /// Facets that were dropped, in words.
    pub dropped: Option<String>,
    /// Vertices, those that differ by rounding as one.
    pub vertices: usize,
    /// Solids, groups or objects.
    pub groups: usize,
    /// Surfaces that share no vertex.
    pub surfaces: usize,
    /// Lower and upper corner of the box that holds it (m).
    pub bounds: [[f64; 3]; 2],
    /// Area of all facets (m^2).
    pub area: f64,
    /// Reason why it encloses no region, with the place; none if it does.
    pub open: Option<String>,
    /// Way that normals point in the file: "outward", "inward", "mixed"; none of an open surface.
    pub orientation: Option<&'static str>,
    /// Pairs of an edge and a facet that run through each other.
    pub self_crossings: usize,
    /// Position of the first of them (m).
    pub first_crossing: Option<[f64; 3]>,
    /// The body, of a closed surface.
    pub body: Option<BodySurvey>,
    /// Comparison of its convex parts with the mesh, if it was to be cut into them.
    pub decomposed: Option<Fit>,
    /// True if it is as large as bodies given in millimetres are that are read in metres.
    pub is_large: bool,
    /// Its uses in a case.
    pub uses: Vec<MeshUse>,
}

/// The body that a closed mesh encloses.
#[derive(Clone, Debug, Serialize)]
pub struct BodySurvey {
    /// Volume (m^3).
    pub volume: f64,
    /// Centre of mass (m).
    pub centre: [f64; 3],
    /// Principal moments of inertia per mass, ascending (m^2).
    pub inertia_per_mass: [f64; 3],
    /// Least width along normals, from the middles of at most 2000 facets (m).
    pub thinnest: f64,
    /// True if it is convex within 1e-4 of its diameter.
    pub convex: bool,
    /// Volume that the convex hull adds, over its own (-).
    pub hull_adds: Option<f64>,
    /// True if surfaces overlap, so that volume counts twice.
    pub overlaps: bool,
}

/// A use of a mesh in a case.
#[derive(Clone, Debug, Serialize)]
pub struct MeshUse {
    /// Its kind: "particle", "parts", "decompose", "hull", "wall".
    pub kind: &'static str,
    /// Line for the case; none if it cannot be used so.
    pub line: Option<String>,
    /// Reason why not, with a remedy.
    pub problem: Option<String>,
}

/// Findings on the contents of a file, and the facets (m) of its surface; with `excess`, those of each convex part into which the body is
/// [cut](decompose::decompose). `scale` is the length in metres of 1 in the file, and `unit` the same as a case has it, such as `"mm"` with its quotes.
///
/// # Errors
/// [`ShapeError::Mesh`]: no file of its kind, no facets, numbers that are not finite; a body that cannot be cut.
pub fn survey(
    path: &Path,
    bytes: &[u8],
    (scale, unit): (f64, Option<&str>),
    excess: Option<f64>,
) -> Result<(Survey, Vec<Facets>), ShapeError> {
    check_size("scale", scale)?;
    let failed = |problem| ShapeError::Mesh { path: path.to_path_buf(), problem };
    let contents = facets(path, bytes).map_err(failed)?;
    let Contents { facets, groups, rounding } = &contents;
    let own = scaled(facets, scale).map_err(failed)?;
    let ((precision, extent), _) = tolerance(facets, &own, *rounding);
    let mut surface = Surface::new(&own, precision * extent);
    if surface.is_empty() {
        surface = Surface::sheet(&own, precision * extent);
    }
    let (vertices, corners) = surface.parts_of_mesh();
    if corners.is_empty() {
        return Err(failed("no facet has an area; export the mesh again".to_owned()));
    }
    let used = corners.iter().flatten().collect::<std::collections::BTreeSet<_>>().len();
    let closed = WallMesh::new(vertices.clone(), corners.clone(), Some(crate::wall::FreeSide::Outside));
    let open = closed.as_ref().err().map(|flaw| {
        format!("{flaw}, the first of {} from {}", surface.listed(&flaw.facets), wall::place(flaw))
    });
    let mesh = match closed {
        Ok(mesh) => mesh,
        Err(_) => WallMesh::new(vertices, corners, None).map_err(|flaw| failed(flaw.to_string()))?,
    };
    let crossing = mesh.self_crossing();
    let (low, high) = bounding_box(own.iter().flatten().copied());
    let convex = body(facets, *rounding, scale, false);
    let found = mesh.is_closed().then(|| {
        let mass = mass_of(&mesh);
        let hull = Polyhedron::hull(&surface.corners(&own), precision).ok().map(|(hull, _)| hull);
        BodySurvey {
            volume: mass.volume,
            centre: mass.centre.into(),
            inertia_per_mass: moments(&mass.spread),
            thinnest: mesh.thinnest().unwrap_or_default(),
            convex: convex.is_ok() || mesh_is_hull(hull.as_ref(), mass.volume),
            hull_adds: hull.map(|hull| hull.volume() / mass.volume - 1.0),
            overlaps: mesh.overlaps(),
        }
    });
    let file = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    let line = Line { file, unit: unit.map_or_else(String::new, |unit| format!(", unit = {unit}")) };
    let is_one = groups.len() == 1 && surface.parts().len() == 1;
    let is_convex = convex.is_ok();
    let mut uses = vec![one_use("particle", line.shape(""), convex.map(|_| ()))];
    if !is_convex {
        if !is_one {
            uses.push(one_use("parts", line.shape(", parts = true"), as_parts(&contents, scale)));
        }
        if mesh.is_closed() && !mesh.overlaps() && mesh.inverted().is_none() {
            let own = excess.filter(|excess| excess.total_cmp(&EXCESS).is_ne());
            let own = own.map_or_else(String::new, |excess| format!(", excess = {excess}"));
            uses.push(one_use("decompose", line.shape(&format!(", concave = \"decompose\"{own}")), Ok(())));
        }
        let hull = body(facets, *rounding, scale, true).map(|_| ());
        uses.push(one_use("hull", line.shape(", hull = true"), hull));
    }
    let as_wall = wall::of(&own, precision * extent, None).map(|_| ());
    uses.push(one_use("wall", line.text(""), as_wall));
    let orientation = mesh.is_closed().then(|| match surface.volume() {
        None => "mixed",
        Some(volume) if volume < 0.0 => "inward",
        Some(_) => "outward",
    });
    let cut = excess.map(|excess| decompose::of(&contents, excess)).transpose().map_err(failed)?;
    let shown = cut.as_ref().map_or_else(|| vec![own], |cut| cut.surfaces(scale));
    let survey = Survey {
        format: format(path, bytes),
        facets: facets.len(),
        dropped: surface.dropped(),
        vertices: used,
        groups: groups.len(),
        surfaces: surface.parts().len(),
        bounds: [low.into(), high.into()],
        area: mesh.area(),
        open,
        orientation,
        self_crossings: crossing.map_or(0, |crossing| crossing.count),
        first_crossing: crossing.map(|crossing| crossing.at.into()),
        body: found,
        decomposed: cut.map(|cut| cut.fit),
        is_large: (high - low).max() >= LARGE,
        uses,
    };
    Ok((survey, shown))
}

/// True if the hull of a mesh has its volume: it is convex, whichever way its facets run.
fn mesh_is_hull(hull: Option<&Polyhedron>, volume: f64) -> bool {
    hull.is_some_and(|hull| hull.volume() <= volume * (1.0 + 1e-6))
}

/// Integrals over the body that a closed mesh encloses.
pub(super) fn mass_of(mesh: &WallMesh) -> mass::Mass {
    let middle = (mesh.bounds()[0] + mesh.bounds()[1]) * 0.5;
    mass::mass((0..mesh.facets().len() as u32).map(|n| mesh.corners(n)), middle)
}

/// Principal moments of inertia per mass, ascending.
pub(super) fn moments(spread: &Mat3) -> [f64; 3] {
    let tensor = mass::inertia(spread);
    let axes = mass::principal_axes(&tensor).to_rotation_matrix().into_inner();
    let mut moments: [f64; 3] = (axes.transpose() * tensor * axes).diagonal().into();
    moments.sort_by(f64::total_cmp);
    moments
}

fn format(path: &Path, bytes: &[u8]) -> &'static str {
    let is_obj = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("obj"));
    match (is_obj, bytes.contains(&0)) {
        (true, _) => "OBJ",
        (false, true) => "binary STL",
        (false, false) => "text STL",
    }
}

/// The parts of a line for a case.
struct Line {
    file: String,
    /// The key, if it is not 1 m.
    unit: String,
}

impl Line {
    fn text(&self, more: &str) -> String {
        format!("mesh = {{ file = \"{}\"{}{more} }}", self.file, self.unit)
    }

    fn shape(&self, more: &str) -> String {
        format!("shape = {{ {} }}", self.text(more))
    }
}

fn one_use(kind: &'static str, line: String, result: Result<(), String>) -> MeshUse {
    match result {
        Ok(()) => MeshUse { kind, line: Some(line), problem: None },
        Err(problem) => MeshUse { kind, line: None, problem: Some(problem) },
    }
}

/// Refuses parts of a file that are no body together.
fn as_parts(contents: &Contents, scale: f64) -> Result<(), String> {
    let meshes = parts_of(contents, scale, false)?;
    let bodies = meshes.into_iter().map(|mesh| (mesh.body, mesh.placement)).collect();
    united(bodies).map(|_| ()).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::super::tests::{box_facets, l, text_stl};
    use super::*;
    use crate::math::Vec3;

    fn look(facets: &[[Vec3; 3]]) -> Survey {
        survey(Path::new("mesh.stl"), &text_stl(facets), (1e-3, Some("\"mm\"")), None).unwrap().0
    }

    #[test]
    fn volume_moments_and_hull_of_an_l_are_those_of_its_two_cuboids() {
        let found = look(&l());
        let body = found.body.unwrap();
        let is = |found: f64, expected: f64| (found / expected - 1.0).abs() < 1e-12;
        assert!(is(body.volume, 5e-9) && is(body.hull_adds.unwrap(), 0.4), "{body:?}");
        assert!(
            body.centre.iter().zip([1.1e-3, 1.1e-3, 0.5e-3]).all(|(found, expected)| is(*found, expected))
        );
        // About the middle, times the mass: 7.2333 along z; 4.0333 and a product of 1.8 along x and y.
        let expected =
            [4.0 + 1.0 / 30.0 - 1.8, 4.0 + 1.0 / 30.0 + 1.8, 7.0 + 7.0 / 30.0].map(|x| 1e-6 * x / 5.0);
        assert!(
            body.inertia_per_mass.iter().zip(expected).all(|(found, expected)| is(*found, expected)),
            "{body:?}"
        );
        assert!(!body.convex && is(body.thinnest, 1e-3) && found.open.is_none());
        assert_eq!(found.orientation, Some("outward"));
    }

    #[test]
    fn a_rod_through_a_plate_crosses_it_with_each_of_its_edges_twice() {
        let plate = box_facets(Vec3::new(4.0, 4.0, 1.0));
        let through = |shift: Vec3| {
            let rod = box_facets(Vec3::new(1.0, 1.0, 4.0));
            let rod = rod.into_iter().map(|corners| corners.map(|corner| corner + shift));
            look(&plate.iter().copied().chain(rod).collect::<Vec<_>>())
        };
        // Beside the diagonals of the plate: four edges and four diagonals of the rod, through both sides.
        let found = through(Vec3::new(1.3, 0.1, 0.0));
        assert_eq!((found.surfaces, found.self_crossings), (2, 16));
        assert!(found.first_crossing.is_some_and(|at| (at[2].abs() - 0.5e-3).abs() < 1e-15));
        assert_eq!(through(Vec3::new(5.0, 0.0, 0.0)).self_crossings, 0, "beside the plate");
    }

    #[test]
    fn what_is_open_mixed_or_inward_is_told_apart() {
        let cube = box_facets(Vec3::repeat(1.0));
        let inward: Vec<_> = cube.iter().map(|[a, b, c]| [*a, *c, *b]).collect();
        let mut mixed = cube.clone();
        mixed[0].swap(0, 1);
        let ways = [&cube, &inward, &mixed].map(|facets| look(facets).orientation);
        assert_eq!(ways, [Some("outward"), Some("inward"), Some("mixed")]);
        let open = look(&cube[1..]);
        assert!(open.open.is_some_and(|open| open.contains("3 edges")) && open.body.is_none());
    }
}
