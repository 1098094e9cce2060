//! Convex polyhedra clipped by half-spaces, and integrals over the remaining body.
//!
//! The surface is a graph in which every vertex has three edges and three faces; corners where more faces meet are
//! several vertices at (nearly) the same position. A cut keeps the vertices with `normal . x <= offset`, puts a new
//! vertex on every edge that leaves them, and joins the new ones along their common faces into the new face. The
//! surface stays closed whatever the rounding of the signs, so volumes are right to rounding even for degenerate
//! planes. Buffers are reused: nothing is allocated.
//!
//! Integrals are sums over the tetrahedra from one corner to the fans of the faces:
//!
//! ```text
//! V = sum v,  v = (a - o) . ((b - a) x (c - a)) / 6      int x dV = sum v (o + a + b + c) / 4
//! S = sum s,  s = (b - a) x (c - a) / 2                  int x cross n dA = sum (a + b + c) / 3 x s
//! ```
//!
//! # Reference
//! Powell and Abel (2015), J. Comput. Phys. 297, 340, doi:10.1016/j.jcp.2015.05.022 (the graph; our own rules for
//! joining, by twins of half-edges, also hold where two vertices have two edges in common).

use crate::math::{Mat3, Vec3, bounding_box, furthest};

/// A plane, `normal . x = offset`; the body lies where `normal . x <= offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Plane {
    /// Unit normal, outward.
    pub normal: Vec3,
    /// Distance from the origin along the normal (m).
    pub offset: f64,
}

impl Plane {
    /// Height of a point above the plane (m).
    #[inline]
    pub(super) fn height(&self, at: &Vec3) -> f64 {
        self.normal.dot(at) - self.offset
    }
}

/// Distances (m) from a point along a unit vector, and against it, to the first of some planes.
pub(super) fn distances<'a>(
    planes: impl Iterator<Item = &'a Plane>,
    from: &Vec3,
    along: &Vec3,
) -> (f64, f64) {
    let (mut ahead, mut behind) = (f64::INFINITY, f64::INFINITY);
    for plane in planes {
        let (slope, room) = (plane.normal.dot(along), -plane.height(from));
        if slope > 0.0 {
            ahead = ahead.min(room / slope);
        } else if slope < 0.0 {
            behind = behind.min(-room / slope);
        }
    }
    (ahead, behind)
}

/// Corner of the graph: half-edges 0, 1, 2 leave it counter-clockwise, seen from outside.
#[derive(Clone, Copy, Debug)]
struct Corner {
    position: Vec3,
    /// The half-edge that comes back: four times its corner plus its index there.
    twin: [u32; 3],
    /// The face to the left of the half-edge.
    face: [u32; 3],
}

/// A polyhedron as a graph, ready to be cut.
#[derive(Clone, Debug)]
pub(super) struct Graph {
    corners: Vec<Corner>,
}

impl Graph {
    /// The box between two corners; its faces are numbered from `first`: x-, x+, y-, ...
    pub(super) fn cuboid(lo: Vec3, hi: Vec3, first: u32) -> Self {
        let corners = (0..8_u32)
            .map(|n| {
                let side = |axis: u32| n >> axis & 1;
                // Counter-clockwise, seen from outside; every reflection turns the order round.
                let order: [u32; 3] = if n.count_ones() % 2 == 1 { [0, 1, 2] } else { [0, 2, 1] };
                Corner {
                    position: Vec3::from_fn(|i, _| if side(i as u32) == 1 { hi[i] } else { lo[i] }),
                    // At the other end the edges along y and z have changed places.
                    twin: std::array::from_fn(|k| 4 * (n ^ (1 << order[k])) + [0, 2, 1][k]),
                    face: std::array::from_fn(|k| {
                        let across = order[(k + 2) % 3];
                        first + 2 * across + side(across)
                    }),
                }
            })
            .collect();
        Self { corners }
    }

    /// The same body, rotated.
    #[must_use]
    pub(super) fn turned(mut self, turn: &Mat3) -> Self {
        for corner in &mut self.corners {
            corner.position = turn * corner.position;
        }
        self
    }

    /// Positions of the corners (m); those with more than three faces come several times.
    pub(super) fn positions(&self) -> impl Iterator<Item = Vec3> + '_ {
        self.corners.iter().map(|c| c.position)
    }

    /// Every edge once for either face: the face to the left, from where and whereto (m), counter-clockwise.
    pub(super) fn edges(&self) -> impl Iterator<Item = (u32, Vec3, Vec3)> + '_ {
        self.corners.iter().flat_map(move |corner| {
            (0..3).map(move |k| {
                let end = self.corners[(corner.twin[k] >> 2) as usize].position;
                (corner.face[k], corner.position, end)
            })
        })
    }

    /// Renumbers the existing faces from 0, in their order, and returns their planes.
    pub(super) fn renumber(&mut self, planes: &[Plane]) -> Vec<Plane> {
        let mut there = vec![false; planes.len()];
        for face in self.corners.iter().flat_map(|c| c.face) {
            there[face as usize] = true;
        }
        let mut number = vec![0; planes.len()];
        let mut kept = Vec::new();
        for (old, plane) in planes.iter().enumerate().filter(|&(old, _)| there[old]) {
            number[old] = kept.len() as u32;
            kept.push(*plane);
        }
        for face in self.corners.iter_mut().flat_map(|c| &mut c.face) {
            *face = number[*face as usize];
        }
        kept
    }
}

/// Outcome of a cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Cut {
    /// The plane misses the body, which lies below it.
    Missed,
    /// Some of it is gone.
    Trimmed,
    /// All of it is gone.
    Emptied,
}

/// A body being cut. Keeps its buffers.
#[derive(Debug, Default)]
pub(super) struct Clipper {
    corners: Vec<Corner>,
    /// Corners that are left.
    live: Vec<u32>,
    /// Height of every corner above the plane of the cut (m).
    heights: Vec<f64>,
    /// Half-edges that a cut ends, with their twins.
    trimmed: Vec<(u32, u32)>,
    /// Bits: half-edges that the integration has been to.
    seen: Vec<u8>,
    /// Faces that are left, those in several pieces several times.
    pub faces: Vec<u32>,
    /// Centre and radius of a sphere that holds all corners (m), if known.
    ball: Option<(Vec3, f64)>,
}

/// Integrals over a polyhedron.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Integrals {
    /// Volume (m^3).
    pub volume: f64,
    /// Centre of the volume (m).
    pub centre: Vec3,
    /// Area vector of the faces with weight (m^2).
    pub area: Vec3,
    /// Integral of `x` cross the outward normal over the same faces (m^3).
    pub moment: Vec3,
}

impl Clipper {
    /// Starts from a body.
    pub(super) fn load(&mut self, graph: &Graph) {
        self.corners.clear();
        self.corners.extend_from_slice(&graph.corners);
        self.live.clear();
        self.live.extend(0..graph.corners.len() as u32);
        self.heights.clear();
        self.heights.resize(graph.corners.len(), 0.0);
        self.ball = None;
    }

    /// The remaining body, as a body of its own.
    pub(super) fn graph(&self) -> Graph {
        let mut place = vec![0; self.corners.len()];
        for (new, &old) in self.live.iter().enumerate() {
            place[old as usize] = new as u32;
        }
        let moved = |half_edge: u32| 4 * place[(half_edge >> 2) as usize] + (half_edge & 3);
        let corners = self.live.iter().map(|&v| {
            let corner = self.corners[v as usize];
            Corner { twin: corner.twin.map(moved), ..corner }
        });
        Graph { corners: corners.collect() }
    }

    /// Corners that are left (m).
    pub(super) fn positions(&self) -> impl Iterator<Item = Vec3> + '_ {
        self.live.iter().map(|&v| self.corners[v as usize].position)
    }

    /// The corner furthest along a direction; there must be one.
    pub(super) fn furthest(&self, along: &Vec3) -> Vec3 {
        furthest(self.positions(), along)
    }

    /// Vectors along all edges (m), each once.
    pub(super) fn edge_vectors(&self) -> impl Iterator<Item = Vec3> + '_ {
        self.live.iter().flat_map(move |&v| {
            let corner = &self.corners[v as usize];
            let ends = corner.twin.into_iter().filter(move |end| end >> 2 > v);
            ends.map(|end| self.corners[(end >> 2) as usize].position - corner.position)
        })
    }

    /// Highest that any corner can lie above a plane (m), cheaply.
    #[inline]
    pub(super) fn highest_bound(&mut self, plane: &Plane) -> f64 {
        let (centre, radius) = match self.ball {
            Some(ball) => ball,
            None => self.bound(),
        };
        plane.height(&centre) + radius
    }

    fn bound(&mut self) -> (Vec3, f64) {
        let (lo, hi) = bounding_box(self.positions());
        *self.ball.insert((0.5 * (lo + hi), 0.5 * (hi - lo).norm()))
    }

    /// The half-edge that follows along the face to the left.
    #[inline]
    fn next(&self, half_edge: u32) -> u32 {
        let back = self.twin(half_edge);
        (back & !3) + [2, 0, 1][(back & 3) as usize]
    }

    #[inline]
    fn twin(&self, half_edge: u32) -> u32 {
        self.corners[(half_edge >> 2) as usize].twin[(half_edge & 3) as usize]
    }

    #[inline]
    fn join(&mut self, a: u32, b: u32) {
        self.corners[(a >> 2) as usize].twin[(a & 3) as usize] = b;
        self.corners[(b >> 2) as usize].twin[(b & 3) as usize] = a;
    }

    /// Takes away what lies more than `slack` (m) above the plane; the new face gets the number `face`.
    pub(super) fn cut(&mut self, plane: &Plane, face: u32, slack: f64) -> Cut {
        let (mut above, old) = (0, self.corners.len() as u32);
        for &v in &self.live {
            let height = plane.height(&self.corners[v as usize].position);
            self.heights[v as usize] = height;
            above += usize::from(height > slack);
        }
        if above == 0 {
            return Cut::Missed;
        }
        if above == self.live.len() {
            self.live.clear();
            return Cut::Emptied;
        }
        let gone = |heights: &[f64], v: u32| heights[v as usize] > slack;
        // Half-edges of corners that stay to corners that go, found from the side that has fewer: most planes trim
        // little.
        let mut trimmed = std::mem::take(&mut self.trimmed);
        trimmed.clear();
        for &u in self.live.iter().filter(|&&u| gone(&self.heights, u)) {
            let back = self.corners[u as usize].twin.into_iter().enumerate();
            trimmed.extend(
                back.filter(|&(_, there)| !gone(&self.heights, there >> 2))
                    .map(|(k, there)| (there, 4 * u + k as u32)),
            );
        }
        trimmed.sort_unstable();
        for &(half_edge, there) in &trimmed {
            self.split(half_edge >> 2, (half_edge & 3) as usize, there, face);
        }
        self.trimmed = trimmed;
        let mut live = std::mem::take(&mut self.live);
        live.retain(|&v| !gone(&self.heights, v));
        live.extend(old..self.corners.len() as u32);
        self.live = live;
        self.heights.resize(self.corners.len(), 0.0);
        // Along the face to the left of its edge back, every new corner finds the one before it on the rim.
        for new in old..self.corners.len() as u32 {
            let mut edge = 4 * new;
            loop {
                let end = self.twin(edge) >> 2;
                if end >= old {
                    self.join(4 * new + 1, 4 * end + 2);
                    break;
                }
                edge = self.next(edge);
            }
        }
        self.ball = None;
        Cut::Trimmed
    }

    /// New corner on the half-edge `k` of `v`, which stays, to a corner that goes and where `there` comes back.
    fn split(&mut self, v: u32, k: usize, there: u32, face: u32) {
        let (inside, outside) = (self.corners[v as usize], self.corners[(there >> 2) as usize]);
        let (below, above) = (self.heights[v as usize], self.heights[(there >> 2) as usize]);
        // From the end that is nearer to the plane; never beyond the ends.
        let part = (below / (below - above)).clamp(0.0, 1.0);
        let position = inside.position + (outside.position - inside.position) * part;
        let new = self.corners.len() as u32;
        let half_edge = 4 * v + k as u32;
        self.corners.push(Corner {
            position,
            twin: [half_edge, u32::MAX, u32::MAX],
            face: [outside.face[(there & 3) as usize], face, inside.face[k]],
        });
        self.corners[v as usize].twin[k] = 4 * new;
    }

    /// Integrals over the remaining body; faces count in the surface integrals with their `weights`, by number. Fills
    /// [`faces`](Self::faces).
    pub(super) fn integrate(&mut self, weights: &[f64]) -> Option<Integrals> {
        let origin = self.corners[*self.live.first()? as usize].position;
        self.seen.clear();
        self.seen.resize(self.corners.len(), 0);
        self.faces.clear();
        let (mut volume, mut first) = (0.0, Vec3::zeros());
        let (mut area, mut moment) = (Vec3::zeros(), Vec3::zeros());
        for n in 0..self.live.len() {
            let v = self.live[n];
            for k in 0..3 {
                if self.seen[v as usize] >> k & 1 == 1 {
                    continue;
                }
                let start = 4 * v + k;
                let face = self.corners[v as usize].face[k as usize];
                self.faces.push(face);
                let a = self.corners[v as usize].position - origin;
                let (mut twice, mut lever, mut part, mut part_first) =
                    (Vec3::zeros(), Vec3::zeros(), 0.0, Vec3::zeros());
                self.seen[v as usize] |= 1 << k;
                let mut edge = self.next(start);
                let mut b = self.corners[(edge >> 2) as usize].position - origin;
                while edge != start {
                    self.seen[(edge >> 2) as usize] |= 1 << (edge & 3);
                    edge = self.next(edge);
                    let c = self.corners[(edge >> 2) as usize].position - origin;
                    let s = (b - a).cross(&(c - a));
                    let sum = a + b + c;
                    let six = a.dot(&s);
                    part += six;
                    part_first += sum * six;
                    twice += s;
                    lever += sum.cross(&s);
                    b = c;
                }
                volume += part;
                first += part_first;
                let weight = weights[face as usize];
                if weight != 0.0 {
                    area += twice * (0.5 * weight);
                    moment += (lever / 6.0 + origin.cross(&twice) * 0.5) * weight;
                }
            }
        }
        volume /= 6.0;
        (volume > 0.0).then(|| Integrals { volume, centre: origin + first / (24.0 * volume), area, moment })
    }
}
