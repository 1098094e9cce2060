//! Nearest points of a mesh.
//!
//! The distance of a point `c` to a mesh has a minimum at a point `x` in a facet if the way from `x` to `c` is along its normal; on an
//! edge or a vertex, if `(c - x) . d <= 0` for all directions `d` from there into facets. On the rim of a facet that is no such minimum
//! another facet is nearer: a ball that touches the latter does not touch the former besides.
//!
//! # Reference
//! Ericson (2005), Real-Time Collision Detection, section 5.1.5 (regions of a triangle).

use super::WallMesh;
use crate::math::Vec3;

/// Sines of angles below which a way counts as along a facet, for the rounding of corners: single precision.
const ALONG: f64 = 1e-6;

/// Part of a facet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Feature {
    /// Its interior.
    Face,
    /// Edge from this vertex of the three to the next one.
    Edge(usize),
    /// This vertex of the three.
    Vertex(usize),
}

/// The point of a facet, or of a mesh, that is nearest to another one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NearestPoint {
    /// Its position (m).
    pub point: Vec3,
    /// Square of the distance (m^2).
    pub square: f64,
    /// Facet, of several the first.
    pub facet: u32,
    /// Part of the facet that it lies on.
    pub feature: Feature,
}

/// The point of a triangle nearest to another one.
fn on_triangle([a, b, c]: &[Vec3; 3], at: &Vec3) -> (Vec3, Feature) {
    let (ab, ac, ap) = (b - a, c - a, at - a);
    let (d1, d2) = (ab.dot(&ap), ac.dot(&ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return (*a, Feature::Vertex(0));
    }
    let bp = at - b;
    let (d3, d4) = (ab.dot(&bp), ac.dot(&bp));
    if d3 >= 0.0 && d4 <= d3 {
        return (*b, Feature::Vertex(1));
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return (a + ab * (d1 / (d1 - d3)), Feature::Edge(0));
    }
    let cp = at - c;
    let (d5, d6) = (ab.dot(&cp), ac.dot(&cp));
    if d6 >= 0.0 && d5 <= d6 {
        return (*c, Feature::Vertex(2));
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return (a + ac * (d2 / (d2 - d6)), Feature::Edge(2));
    }
    let va = d3 * d6 - d5 * d4;
    let (along, back) = (d4 - d3, d5 - d6);
    if va <= 0.0 && along >= 0.0 && back >= 0.0 {
        return (b + (c - b) * (along / (along + back)), Feature::Edge(1));
    }
    let scale = 1.0 / (va + vb + vc);
    (a + ab * (vb * scale) + ac * (vc * scale), Feature::Face)
}

impl WallMesh {
    /// The point of a facet that is nearest to a point (m).
    #[inline]
    pub fn nearest_on(&self, facet: u32, at: &Vec3) -> NearestPoint {
        let (point, feature) = on_triangle(&self.corners(facet), at);
        NearestPoint { point, square: (at - point).norm_squared(), facet, feature }
    }

    /// The point of the mesh that is nearest to a point (m).
    pub fn nearest(&self, at: &Vec3) -> NearestPoint {
        let square = |facet: u32| self.nearest_on(facet, at).square;
        let facet = self.tree.nearest(at, f64::INFINITY, square).unwrap_or(0);
        self.nearest_on(facet, at)
    }

    /// Distance of a point from the mesh (m), negative in the wall.
    pub fn distance(&self, at: &Vec3) -> f64 {
        let distance = self.nearest(at).square.sqrt();
        if distance > 0.0 && self.is_wall(at) { -distance } else { distance }
    }

    /// Distance of a point from the mesh (m), on whichever side, up to a limit, beyond which it is the limit.
    pub fn clearance(&self, at: &Vec3, limit: f64) -> f64 {
        let square = |facet: u32| self.nearest_on(facet, at).square;
        let found = self.tree.nearest(at, limit * limit, square);
        found.map_or(limit, |facet| square(facet).sqrt())
    }

    /// The same, negative in the wall.
    pub fn distance_up_to(&self, at: &Vec3, limit: f64) -> f64 {
        let distance = self.clearance(at, limit);
        if distance > 0.0 && self.is_wall(at) { -distance } else { distance }
    }

    /// Gradient of the distance: the unit vector from the nearest point, in the wall to it; on the mesh the normal of a facet there.
    pub fn normal(&self, at: &Vec3) -> Vec3 {
        let nearest = self.nearest(at);
        let own = self.facets[nearest.facet as usize].normal;
        let way = at - nearest.point;
        match way.try_normalize(0.0) {
            None => own,
            Some(_) if nearest.feature == Feature::Face && (self.is_closed() || own.dot(&way) > 0.0) => own,
            Some(_) if nearest.feature == Feature::Face => -own,
            Some(away) if self.is_wall(at) => -away,
            Some(away) => away,
        }
    }

    /// True if the distance of points along `away`, a unit vector, from a point on a facet has a minimum there.
    #[inline]
    pub fn is_least(&self, facet: u32, feature: Feature, away: &Vec3) -> bool {
        match feature {
            Feature::Face => true,
            Feature::Edge(k) => self.is_least_on_edge(self.facets[facet as usize].edges[k], away),
            Feature::Vertex(k) => self.is_least_at_vertex(self.facets[facet as usize].vertices[k], away),
        }
    }

    fn is_least_on_edge(&self, edge: u32, away: &Vec3) -> bool {
        let ends = self.edges.ends[edge as usize];
        let [a, b] = ends.map(|vertex| self.vertices[vertex as usize]);
        let Some(along) = (b - a).try_normalize(0.0) else { return true };
        self.edges.facets(edge).iter().all(|&facet| {
            let of = &self.facets[facet as usize];
            let other = of.vertices.into_iter().find(|vertex| !ends.contains(vertex));
            let way = other.map_or(Vec3::zeros(), |vertex| self.vertices[vertex as usize] - a);
            let across = way - along * way.dot(&along);
            across.dot(away) <= ALONG * across.norm()
        })
    }

    fn is_least_at_vertex(&self, vertex: u32, away: &Vec3) -> bool {
        let at = self.vertices[vertex as usize];
        self.edges.around(vertex).iter().all(|&other| {
            let way = self.vertices[other as usize] - at;
            way.dot(away) <= ALONG * way.norm()
        })
    }

    /// True if `away` leads from a point on a facet of a closed mesh into the free space; of a sheet always.
    #[inline]
    pub fn is_in_front(&self, facet: u32, feature: Feature, away: &Vec3) -> bool {
        !self.is_closed() || self.normal_of(facet, feature).dot(away) > 0.0
    }

    /// Normal of a facet, or of an edge or vertex of it, not of unit length: which side of the mesh a way from there is on.
    #[inline]
    fn normal_of(&self, facet: u32, feature: Feature) -> Vec3 {
        let of = &self.facets[facet as usize];
        match feature {
            Feature::Face => of.normal,
            Feature::Edge(k) => {
                self.edges.facets(of.edges[k]).iter().map(|&n| self.facets[n as usize].normal).sum()
            }
            Feature::Vertex(k) => self.vertex_normals[of.vertices[k] as usize],
        }
    }

    /// The side of each facet on which a point (m) is, of those that come near to it, with their nearest points by ascending facet: 1 if it is
    /// the one that its normal points to, else -1. Of a closed mesh always 1: the free space.
    ///
    /// A facet has the side of the neighbour beyond its nearest point, if that is nearer: its plane may have the point on either side.
    pub fn sides(&self, at: &Vec3, points: &[NearestPoint], sides: &mut Vec<f64>) {
        sides.clear();
        sides.resize(points.len(), if self.is_closed() { 1.0 } else { 0.0 });
        if self.is_closed() {
            return;
        }
        let mut order: Vec<usize> = (0..points.len()).collect();
        order.sort_unstable_by(|&a, &b| points[a].square.total_cmp(&points[b].square).then(a.cmp(&b)));
        for n in order {
            let NearestPoint { point, square, facet, feature } = points[n];
            let (of, away) = (&self.facets[facet as usize], at - point);
            let beyond = match feature {
                Feature::Face => [None; 2],
                Feature::Edge(k) => [of.beyond[k], None],
                Feature::Vertex(k) => [of.beyond[k], of.beyond[(k + 2) % 3]],
            };
            let nearer = beyond.into_iter().flatten().find_map(|next| {
                let index = points.binary_search_by_key(&next, |point| point.facet).ok()?;
                (points[index].square < square).then_some(sides[index])
            });
            let own = || if self.normal_of(facet, feature).dot(&away) < 0.0 { -1.0 } else { 1.0 };
            sides[n] = nearer.unwrap_or_else(own);
        }
    }

    /// Facets whose leaves have boxes within a distance (m) of a point (m), ascending.
    pub fn facets_near(&self, at: &Vec3, distance: f64) -> Vec<u32> {
        let mut found = Vec::new();
        self.facets_in(&[at.add_scalar(-distance), at.add_scalar(distance)], &mut found);
        found
    }

    /// Appends the points nearest to a point (m) on those of these facets, which ascend, that come within a distance of it (m).
    pub fn within(&self, at: &Vec3, distance: f64, facets: &[u32], found: &mut Vec<NearestPoint>) {
        let nearest = facets.iter().map(|&facet| self.nearest_on(facet, at));
        found.extend(nearest.filter(|nearest| nearest.square < distance * distance));
    }
}
