//! Concave bodies cut into convex parts.
//!
//! Parts only touch, and their union holds the body: it errs to one side, by hollows that lie within one part (`cut.rs`).
//!
//! Only basic arithmetic and `sqrt`: the same bits on all machines.

mod cut;

use super::surface::Surface;
use super::survey::{mass_of, moments};
use super::{Contents, Facets, TAKE_HULL, facets, scaled, tolerance, united, wall};
use crate::math::Vec3;
use crate::shape::composite::MOST_PARTS;
use crate::shape::{Placement, Polyhedron, Shape, ShapeError};
use crate::wall::{FreeSide, WallMesh};
use std::path::Path;
use std::sync::Arc;

/// Part of the volume of the body by which that of its parts may exceed it, unless the case has another.
pub const EXCESS: f64 = 0.01;
/// Part of it by which it may lack: rounding.
const LACKING: f64 = 1e-4;
/// Range of it.
pub const ALLOWED: std::ops::RangeInclusive<f64> = 1e-5..=1.0;
/// Points across the extent of the body at which its distance from the mesh is looked for.
const SAMPLES: f64 = 100.0;

/// A body that was cut into convex parts.
#[derive(Clone, Debug)]
pub struct Decomposition {
    /// Points of each part, in the units of the file, of which it is the hull.
    parts: Vec<Vec<Vec3>>,
    /// Relative precision of the points.
    precision: f64,
    /// Comparison with the mesh.
    pub fit: Fit,
    /// Notes for the user.
    notes: Vec<String>,
}

/// Comparison of the parts with the mesh.
#[derive(Clone, Copy, Debug, serde::Serialize)]
pub struct Fit {
    /// Number of parts.
    pub parts: usize,
    /// Faces of all parts.
    pub faces: usize,
    /// Volume of the parts over that of the mesh, less 1 (-).
    pub volume: f64,
    /// Largest relative difference of a principal moment of inertia per mass (-).
    pub inertia: f64,
    /// Distance of the centres of mass over the diameter (-).
    pub centre: f64,
    /// Largest distance of a point of one surface, outside of the other body, from that body, over the diameter (-).
    pub distance: f64,
}

impl std::fmt::Display for Fit {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            out,
            "{} convex part{} of {} faces: volume {:+.3} %, principal moments of inertia per mass within {:.3} %, surface within {:.3} % of the \
             diameter, against the mesh",
            self.parts,
            if self.parts == 1 { "" } else { "s" },
            self.faces,
            100.0 * self.volume,
            100.0 * self.inertia,
            100.0 * self.distance
        )
    }
}

/// Cuts the body in the contents of a file into convex parts, with at most the part `excess` more volume than it.
///
/// # Errors
/// [`ShapeError::Mesh`] with remedy: a surface that is not closed, or runs through itself so that a volume counts twice or is inside out;
/// more parts than a body may have.
pub fn decompose(path: &Path, bytes: &[u8], excess: f64) -> Result<Decomposition, ShapeError> {
    (facets(path, bytes).and_then(|contents| of(&contents, excess)))
        .map_err(|problem| ShapeError::Mesh { path: path.to_path_buf(), problem })
}

impl Decomposition {
    /// The body, with all lengths of the file multiplied by `scale`, and its pose in the frame of the file.
    ///
    /// # Errors
    /// [`ShapeError::TooManyFaces`] of a part.
    pub fn body(&self, scale: f64) -> Result<(Arc<dyn Shape>, Placement), ShapeError> {
        body(&self.parts, self.precision, scale)
    }

    /// Triangles of the surface of each part, with all lengths of the file multiplied by `scale`.
    pub fn surfaces(&self, scale: f64) -> Vec<Facets> {
        let of = |points: &Vec<Vec3>| {
            let (body, placement) = Polyhedron::hull(points, self.precision).ok()?;
            let surface = body.surface_mesh(0);
            let at = |corner: u32| {
                (placement.centre + placement.rotation * surface.points[corner as usize]) * scale
            };
            Some(surface.triangles.iter().map(|corners| corners.map(at)).collect())
        };
        self.parts.iter().filter_map(of).collect()
    }

    /// Notes for the user: how the parts compare with the mesh, what was dropped.
    pub fn notes(&self) -> Vec<String> {
        let own = format!("cut into {}", self.fit);
        [own].into_iter().chain(self.notes.iter().cloned()).collect()
    }
}

/// The hulls of the points of parts, with all lengths multiplied by `scale`, as one body, and its pose in the frame of the file.
fn body(parts: &[Vec<Vec3>], precision: f64, scale: f64) -> Result<(Arc<dyn Shape>, Placement), ShapeError> {
    let part = |points: &Vec<Vec3>| {
        let points: Vec<Vec3> = points.iter().map(|point| point * scale).collect();
        Polyhedron::hull(&points, precision)
    };
    united(parts.iter().map(part).collect::<Result<_, ShapeError>>()?)
}

pub(super) fn of(contents: &Contents, excess: f64) -> Result<Decomposition, String> {
    let scaled = scaled(&contents.facets, 1.0)?;
    let ((precision, extent), rounded) = tolerance(&contents.facets, &scaled, contents.rounding);
    let surface = Surface::new(&scaled, precision * extent);
    let mut notes: Vec<String> = surface.dropped().into_iter().chain(rounded).collect();
    let mesh = closed(&surface, &mut notes)?;
    let volume = mass_of(&mesh).volume;
    let parts = cut::cut(&mesh, (volume, precision), excess, MOST_PARTS)?;
    let (body, placement) = body(&parts, precision, 1.0).map_err(|e| e.to_string())?;
    let fit = fit(&mesh, &*body, &placement);
    if fit.volume < -LACKING {
        let lacking = -100.0 * fit.volume;
        return Err(format!(
            "parts with {lacking:.2} % of the volume are lacking, as where surfaces overlap; remove self-intersections, {TAKE_HULL}"
        ));
    }
    Ok(Decomposition { parts, precision, fit, notes })
}

/// The mesh of a closed surface, all facets turned outwards; or what keeps it from being that of a body.
fn closed(surface: &Surface, notes: &mut Vec<String>) -> Result<WallMesh, String> {
    let (vertices, corners) = surface.parts_of_mesh();
    if corners.is_empty() {
        return Err("no facet has an area; export the mesh again".to_owned());
    }
    let mesh = WallMesh::new(vertices, corners, Some(FreeSide::Outside)).map_err(|flaw| {
        let (facets, place) = (surface.listed(&flaw.facets), wall::place(&flaw));
        format!("{flaw}, the first of {facets} from {place}; close the mesh, {TAKE_HULL}")
    })?;
    let remedy = "repair the mesh (MeshLab: remove self-intersections, or take a union)";
    let crossing = mesh.self_crossing();
    let at = crossing.map_or_else(String::new, |crossing| {
        let [x, y, z] = crossing.at.into();
        format!(", the first time at ({x:.4e}, {y:.4e}, {z:.4e})")
    });
    if mesh.inverted().is_some() {
        return Err(format!(
            "the surface runs through itself{at} and is inside out beyond; {remedy}, {TAKE_HULL}"
        ));
    }
    if mesh.overlaps() {
        return Err(format!(
            "surfaces overlap{at}, so that their volume counts twice; {remedy}, set `parts = true` if each is convex, {TAKE_HULL}"
        ));
    }
    if let Some(crossing) = crossing {
        let times = if crossing.count == 1 { "once".to_owned() } else { format!("{} times", crossing.count) };
        notes.push(format!("the surface runs through itself {times}{at}, by little; {remedy}"));
    }
    Ok(mesh)
}

fn fit(mesh: &WallMesh, body: &dyn Shape, placement: &Placement) -> Fit {
    let own = mass_of(mesh);
    let expected = moments(&own.spread);
    let mut found: [f64; 3] = body.inertia_per_mass().into();
    found.sort_by(f64::total_cmp);
    let inertia = (0..3).map(|k| (found[k] / expected[k] - 1.0).abs()).fold(0.0, f64::max);
    let diameter = 2.0 * body.circumradius();
    let solids: Vec<&Polyhedron> = match body.parts() {
        [] => body.as_polyhedron().into_iter().collect(),
        parts => parts.iter().filter_map(|part| part.shape.as_polyhedron()).collect(),
    };
    Fit {
        parts: solids.len(),
        faces: solids.iter().map(|solid| solid.faces.len()).sum(),
        volume: body.volume() / own.volume - 1.0,
        inertia,
        centre: (placement.centre - own.centre).norm() / diameter,
        distance: distance(mesh, body, placement, diameter / SAMPLES) / diameter,
    }
}

/// Largest distance between the surfaces outside of each other, at points this far apart and at all corners.
fn distance(mesh: &WallMesh, body: &dyn Shape, placement: &Placement, step: f64) -> f64 {
    let middles = (0..mesh.facets().len() as u32).map(|facet| mesh.corners(facet).iter().sum::<Vec3>() / 3.0);
    let missing =
        mesh.vertices().iter().copied().chain(middles).map(|at| body.signed_distance(placement.to_body(at)));
    let mut largest = missing.fold(0.0, f64::max);
    let surface = body.surface_mesh(0);
    let at: Vec<Vec3> =
        surface.points.iter().map(|point| placement.centre + placement.rotation * point).collect();
    for triangle in &surface.triangles {
        let [a, b, c] = triangle.map(|corner| at[corner as usize]);
        let longest = (b - a).norm().max((c - b).norm()).max((a - c).norm());
        let count = (longest / step).ceil().max(1.0) as usize;
        for (i, j) in (0..=count).flat_map(|i| (0..=count - i).map(move |j| (i, j))) {
            let (u, v) = (i as f64 / count as f64, j as f64 / count as f64);
            let point = a + (b - a) * u + (c - a) * v;
            // A nearer bound than the distance found so far needs no second look.
            let away = mesh.nearest(&point).square.sqrt();
            if away > largest && !mesh.encloses(&point) {
                largest = away;
            }
        }
    }
    largest
}

#[cfg(test)]
mod tests {
    use super::super::tests::{box_facets, l, text_stl};
    use super::*;
    use crate::math::Quat;

    fn decomposed(facets: &[[Vec3; 3]], excess: f64) -> Result<Decomposition, String> {
        decompose(Path::new("mesh.stl"), &text_stl(facets), excess).map_err(|e| e.to_string())
    }

    /// A ring of height 1 between two regular polygons about the origin, their corners at these distances.
    fn ring(inner: f64, outer: f64, sides: usize) -> Vec<[Vec3; 3]> {
        let at = |radius: f64, n: usize, z: f64| {
            let angle = std::f64::consts::TAU * (n % sides) as f64 / sides as f64;
            Vec3::new(radius * libm::cos(angle), radius * libm::sin(angle), z)
        };
        let quad = |[a, b, c, d]: [Vec3; 4]| [[a, b, c], [a, c, d]];
        (0..sides)
            .flat_map(|n| {
                let [a, b] = [n, n + 1].map(|n| [at(outer, n, 0.0), at(outer, n, 1.0)]);
                let [c, d] = [n, n + 1].map(|n| [at(inner, n, 0.0), at(inner, n, 1.0)]);
                let (above, below) = ([c[1], a[1], b[1], d[1]], [c[0], d[0], b[0], a[0]]);
                [[a[0], b[0], b[1], a[1]], [c[0], c[1], d[1], d[0]], above, below].into_iter().flat_map(quad)
            })
            .collect()
    }

    #[test]
    fn an_l_falls_into_two_cuboids_however_it_is_turned() {
        let turn = Quat::from_euler_angles(0.3, -0.5, 1.1);
        for turn in [Quat::identity(), turn] {
            let facets: Vec<_> = l().iter().map(|corners| corners.map(|at| turn * at)).collect();
            let found = decomposed(&facets, 1e-4).unwrap();
            assert_eq!((found.fit.parts, found.fit.faces), (2, 12), "{}", found.fit);
            // The file has single precision.
            assert!(found.fit.volume.abs() < 1e-6 && found.fit.inertia < 1e-6, "{}", found.fit);
            assert!(found.fit.distance < 1e-6 && found.fit.centre < 1e-6, "{}", found.fit);
        }
    }

    #[test]
    fn a_square_ring_falls_into_four_parts_although_the_first_cuts_gain_nothing() {
        let found = decomposed(&ring(1.0, 1.5, 4), 1e-4).unwrap();
        assert_eq!(found.fit.parts, 4, "{}", found.fit);
        assert!(found.fit.volume.abs() < 1e-6 && found.fit.distance < 1e-6, "{}", found.fit);
    }

    #[test]
    fn less_excess_takes_more_parts_and_is_kept() {
        let round = ring(1.0, 1.3, 48);
        let of = |excess: f64| decomposed(&round, excess).unwrap().fit;
        let fits = [0.1, 0.02, 0.004].map(of);
        for (fit, excess) in fits.iter().zip([0.1, 0.02, 0.004]) {
            assert!(fit.volume <= excess && fit.volume > -1e-6, "{fit}");
            let exact = 0.5 * 48.0 * (1.3f64 * 1.3 - 1.0) * libm::sin(std::f64::consts::TAU / 48.0);
            let own = decomposed(&round, excess).unwrap().body(2.0).unwrap().0.volume();
            assert!((own / (8.0 * exact) - 1.0 - fit.volume).abs() < 1e-6, "{own}");
        }
        assert!(fits[0].parts < fits[1].parts && fits[1].parts < fits[2].parts, "{fits:?}");
        assert!(fits[0].distance > fits[2].distance, "{fits:?}");
    }

    #[test]
    fn a_convex_body_is_one_part_and_one_with_a_void_is_cut_around_it() {
        let cube = box_facets(Vec3::repeat(3.0));
        assert_eq!(decomposed(&cube, 0.01).unwrap().fit.parts, 1);
        let void = box_facets(Vec3::repeat(1.0)).into_iter().map(|[a, b, c]| [a, c, b]);
        let hollow: Vec<_> = cube.into_iter().chain(void).collect();
        let found = decomposed(&hollow, 1e-4).unwrap();
        assert!((6..=16).contains(&found.fit.parts), "{}", found.fit);
        let volume = found.body(1.0).unwrap().0.volume();
        assert!((volume / 26.0 - 1.0).abs() < 1e-6, "{volume}");
    }

    #[test]
    fn what_is_no_body_or_needs_too_many_parts_is_refused_with_a_remedy() {
        let cube = box_facets(Vec3::repeat(2.0));
        let shifted = cube.iter().map(|corners| corners.map(|at| at + Vec3::new(0.7, 0.8, 0.9)));
        let twice: Vec<_> = cube.iter().copied().chain(shifted).collect();
        let fine = ring(1.0, 1.01, 600);
        for (facets, excess, words) in [
            (&cube[1..], 0.01, ["open: 3 edges", "close the mesh"]),
            (&twice, 0.01, ["overlap", "remove self-intersections"]),
            (&fine, 1e-5, ["256 convex parts still have", "set `excess ="]),
        ] {
            let said = decomposed(facets, excess).unwrap_err();
            assert!(words.iter().all(|word| said.contains(word)), "{said}");
        }
    }
}
