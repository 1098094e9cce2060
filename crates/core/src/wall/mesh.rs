//! Walls from meshes: facets with their neighbours, and a tree to find them by.
//!
//! A closed mesh encloses a region, which is wall, or the free space of a container; all facets are turned so that their normals
//! point into the free space, whatever the order of their corners in the file. Of several closed surfaces, one within another is
//! a cavity, and what overlaps counts as one. An open mesh is a sheet without thickness, which is a wall on both sides.
//!
//! `V = sum a . (b x c) / 6` over the facets `a b c`, by the divergence theorem.

mod crossing;
mod nearest;
mod through;
mod topology;
mod tree;

use crate::math::{Vec3, bounding_box, triangle_area};
pub use nearest::{Feature, NearestPoint};
use std::fmt::{Display, Formatter};
use std::sync::OnceLock;
pub use through::SelfCrossing;
pub use topology::Flaw;
use topology::{Edges, Oriented};
use tree::Tree;

/// The side of a mesh on which the free space is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FreeSide {
    /// Outside of a closed mesh: an obstacle.
    Outside,
    /// Inside of a closed mesh: a container.
    Inside,
    /// On both sides, of a sheet without thickness.
    Both,
}

impl Display for FreeSide {
    fn fmt(&self, out: &mut Formatter<'_>) -> std::fmt::Result {
        out.write_str(match self {
            Self::Outside => "outside",
            Self::Inside => "inside",
            Self::Both => "both",
        })
    }
}

/// A triangle of a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Facet {
    /// Its vertices, counter-clockwise seen from where its normal points to.
    pub vertices: [u32; 3],
    /// Unit normal, into the free space; zero if it has no area.
    pub normal: Vec3,
    /// The facet beyond each edge, from a vertex to the next one; none at a rim, or where more than two facets meet.
    pub beyond: [Option<u32>; 3],
    /// Numbers of its edges.
    edges: [u32; 3],
}

/// A mesh in its own frame (m).
#[derive(Clone, Debug)]
pub struct WallMesh {
    vertices: Vec<Vec3>,
    facets: Vec<Facet>,
    edges: Edges,
    /// Angle-weighted sums of the normals of the facets round each vertex.
    vertex_normals: Vec<Vec3>,
    free: FreeSide,
    bounds: [Vec3; 2],
    tree: Tree,
    survey: OnceLock<Survey>,
}

/// Facets from whose middles a mesh is looked at.
const LOOKED_AT: usize = 2000;

/// Findings on both sides of the middles of facets.
#[derive(Clone, Debug)]
struct Survey {
    /// Least width (m).
    width: f64,
    /// True if facets lie in what others enclose.
    overlaps: bool,
    /// A facet that is inside out.
    inverted: Option<u32>,
}

impl Display for WallMesh {
    fn fmt(&self, out: &mut Formatter<'_>) -> std::fmt::Result {
        let facets = self.facets.len();
        let (Some(volume), Some(width)) = (self.volume(), self.thinnest()) else {
            return write!(out, "open mesh of {facets} facets, a sheet of {:.4e} m^2", self.area());
        };
        let is = if self.free == FreeSide::Inside { "container" } else { "body" };
        let twice = if self.survey().overlaps { " (overlaps counted twice)" } else { "" };
        write!(
            out,
            "closed mesh of {facets} facets, a {is} of {volume:.4e} m^3{twice}, {width:.3e} m wide at the narrowest"
        )
    }
}

impl PartialEq for WallMesh {
    fn eq(&self, other: &Self) -> bool {
        let corners = |of: &Self| of.facets.iter().map(|facet| facet.vertices).collect::<Vec<_>>();
        self.free == other.free && self.vertices == other.vertices && corners(self) == corners(other)
    }
}

impl WallMesh {
    /// The mesh of these vertices (m) and facets, with the free space on a side: without one outside of a mesh that is closed, else on
    /// both sides.
    ///
    /// # Errors
    /// The flaw that keeps it from having an inside, if `free` needs one.
    ///
    /// # Panics
    /// If there are no facets, or one has a vertex that is not there, or not finite, or one vertex twice.
    pub fn new(vertices: Vec<Vec3>, facets: Vec<[u32; 3]>, free: Option<FreeSide>) -> Result<Self, Flaw> {
        assert!(!facets.is_empty() && vertices.iter().flatten().all(|x| x.is_finite()));
        assert!(facets.iter().all(|[a, b, c]| a != b && b != c && c != a));
        let boxes = |facets: &[[u32; 3]]| -> Vec<[Vec3; 2]> {
            let of = |facet: &[u32; 3]| bounding_box(facet.map(|vertex| vertices[vertex as usize])).into();
            facets.iter().map(of).collect()
        };
        let edges = Edges::new(&facets);
        let Oriented { mut facets, flaw } = topology::oriented(facets, &edges);
        let free = match (free, flaw) {
            (Some(FreeSide::Both), _) | (None, Some(_)) => FreeSide::Both,
            (Some(_), Some(flaw)) => return Err(flaw.at(&vertices)),
            (known, None) => known.unwrap_or(FreeSide::Outside),
        };
        let tree = Tree::new(&boxes(&facets));
        if free != FreeSide::Both {
            topology::turn_outwards(&mut facets, &vertices, &edges, &tree);
        }
        if free == FreeSide::Inside {
            for [_, b, c] in &mut facets {
                std::mem::swap(b, c);
            }
        }
        // The numbers of edges follow the order of the corners.
        let edges = Edges::new(&facets);
        let facets: Vec<Facet> = (facets.iter().enumerate())
            .map(|(n, &corners)| {
                let [a, b, c] = corners.map(|vertex| vertices[vertex as usize]);
                let normal = (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_default();
                let own = edges.of_facet[n];
                let beyond = own.map(|edge| edges.beyond(edge, n as u32));
                Facet { vertices: corners, normal, beyond, edges: own }
            })
            .collect();
        let vertex_normals = topology::vertex_normals(&vertices, &facets);
        let bounds = bounding_box(
            facets.iter().flat_map(|facet| facet.vertices.map(|vertex| vertices[vertex as usize])),
        );
        Ok(Self {
            vertex_normals,
            bounds: bounds.into(),
            vertices,
            facets,
            edges,
            free,
            tree,
            survey: OnceLock::new(),
        })
    }

    /// Digest of the vertices, the facets and the side: the same wherever it lies.
    pub fn digest(&self) -> u64 {
        let numbers = self.vertices.iter().flatten().flat_map(|x| x.to_bits().to_le_bytes());
        let corners = self.facets.iter().flat_map(|facet| facet.vertices).flat_map(u32::to_le_bytes);
        xxhash_rust::xxh3::xxh3_64(&numbers.chain(corners).chain([self.free as u8]).collect::<Vec<_>>())
    }

    /// Vertices (m).
    pub fn vertices(&self) -> &[Vec3] {
        &self.vertices
    }

    /// Facets.
    pub fn facets(&self) -> &[Facet] {
        &self.facets
    }

    /// Corners of a facet (m).
    #[inline]
    pub fn corners(&self, facet: u32) -> [Vec3; 3] {
        self.facets[facet as usize].vertices.map(|vertex| self.vertices[vertex as usize])
    }

    /// The side on which the free space is.
    pub fn free(&self) -> FreeSide {
        self.free
    }

    /// True if it encloses a region that is wall, or the free space.
    pub fn is_closed(&self) -> bool {
        self.free != FreeSide::Both
    }

    /// Lower and upper corner of the box that holds it (m).
    pub fn bounds(&self) -> [Vec3; 2] {
        self.bounds
    }

    /// Volume that a closed mesh encloses (m^3); none of a sheet.
    pub fn volume(&self) -> Option<f64> {
        // About the middle: the sum of large numbers far from the origin would lose digits.
        let origin = (self.bounds[0] + self.bounds[1]) * 0.5;
        let tetrahedron = |facet: u32| {
            let [a, b, c] = self.corners(facet).map(|corner| corner - origin);
            a.dot(&b.cross(&c)) / 6.0
        };
        self.is_closed().then(|| (0..self.facets.len() as u32).map(tetrahedron).sum::<f64>().abs())
    }

    /// Area of all facets (m^2).
    pub fn area(&self) -> f64 {
        (0..self.facets.len() as u32).map(|facet| triangle_area(self.corners(facet))).sum()
    }

    /// Least width of the enclosed region of a closed mesh (m), along the normals of at most 2000 facets from their middles; none of a sheet.
    pub fn thinnest(&self) -> Option<f64> {
        self.is_closed().then(|| self.survey().width)
    }

    /// True if facets of a closed mesh, of at most 2000 that are looked at, lie in what others enclose: such volume counts twice.
    pub fn overlaps(&self) -> bool {
        self.is_closed() && self.survey().overlaps
    }

    /// A facet of a closed mesh, of at most 2000 that are looked at, whose normal does not point into the free space: the surface runs
    /// through itself and is inside out beyond.
    pub fn inverted(&self) -> Option<u32> {
        if self.is_closed() { self.survey().inverted } else { None }
    }

    /// Findings on both sides of the middles of facets, looked for once.
    fn survey(&self) -> &Survey {
        self.survey.get_or_init(|| {
            let reach = (self.bounds[1] - self.bounds[0]).norm();
            let sign = if self.free == FreeSide::Inside { 1.0 } else { -1.0 };
            let count = self.facets.len().min(LOOKED_AT);
            let mut survey = Survey { width: f64::INFINITY, overlaps: false, inverted: None };
            for facet in (0..count).map(|n| (n * self.facets.len() / count) as u32) {
                let [a, b, c] = self.corners(facet);
                let middle = (a + b + c) / 3.0;
                let way = self.facets[facet as usize].normal * (sign * 2.0 * reach);
                let [ahead, behind] = [1e-9, -1e-9].map(|part| self.encloses(&(middle + way * part)));
                match [ahead, behind] {
                    [true, false] => {
                        let width = self.width(facet, &middle, &way);
                        survey.width = width.map_or(survey.width, |width| survey.width.min(width));
                    }
                    // Surfaces that overlap are one.
                    [true, true] => survey.overlaps = true,
                    [false, true] => survey.inverted = survey.inverted.or(Some(facet)),
                    [false, false] => {}
                }
            }
            survey
        })
    }

    /// The way (m) from the middle of a facet to where one leaves what is enclosed.
    fn width(&self, facet: u32, middle: &Vec3, way: &Vec3) -> Option<f64> {
        let (mut from, mut but) = (*middle, Some(facet));
        // Each facet is met once at most, unless the way lies in it.
        for _ in 0..=self.facets.len() {
            let crossing = self.crossing_but(&from, &(middle + way), but)?;
            let at = from + (middle + way - from) * crossing.part;
            let beyond = at + way * 1e-9;
            if !self.encloses(&beyond) {
                return (*way != Vec3::zeros()).then(|| (at - middle).norm());
            }
            // Where two facets meet each would lead back to the other.
            (from, but) = (beyond, None);
        }
        None
    }

    /// Appends the facets whose boxes a box meets, given by its lower and upper corner (m), ascending.
    #[inline]
    pub fn facets_in(&self, bounds: &[Vec3; 2], found: &mut Vec<u32>) {
        let first = found.len();
        self.tree.each(bounds, |facet| found.push(facet));
        found[first..].sort_unstable();
    }
}

#[cfg(test)]
pub(crate) mod tests;
