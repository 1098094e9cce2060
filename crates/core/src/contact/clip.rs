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
        let distance = room / slope;
        let distances = [
            if slope > 0.0 { distance } else { f64::INFINITY },
            if slope < 0.0 { -distance } else { f64::INFINITY },
        ];
        ahead = ahead.min(distances[0]);
        behind = behind.min(distances[1]);
    }
    (ahead, behind)
}

/// Half-edge `4 v + k` is the `k`-th of the three that leave corner `v`, counter-clockwise seen from outside. The fourth
/// slot of a corner is empty.
#[derive(Clone, Copy, Debug)]
struct HalfEdge {
    /// The half-edge that comes back.
    twin: u32,
    /// The face to the left.
    face: u32,
}

const NO_EDGE: HalfEdge = HalfEdge { twin: u32::MAX, face: u32::MAX };

/// The half-edge before `k` about the same corner: the next one along the face to the left of its twin.
#[inline]
fn turned_back(half_edge: u32) -> u32 {
    (half_edge & !3) + (0b01_00_10 >> (2 * (half_edge & 3)) & 3)
}

/// A polyhedron as a graph, ready to be cut.
#[derive(Clone, Debug)]
pub(super) struct Graph {
    /// Of the corners (m).
    positions: Vec<Vec3>,
    /// Four per corner.
    edges: Vec<HalfEdge>,
}

impl Graph {
    /// The box between two corners; its faces are numbered from `first`: x-, x+, y-, ...
    pub(super) fn cuboid(lo: Vec3, hi: Vec3, first: u32) -> Self {
        let side = |corner: u32, axis: u32| corner >> axis & 1;
        let position = |n: u32| Vec3::from_fn(|i, _| if side(n, i as u32) == 1 { hi[i] } else { lo[i] });
        let edges = (0..8_u32).flat_map(|n| {
            // Counter-clockwise, seen from outside; every reflection turns the order round.
            let order: [u32; 3] = if n.count_ones() % 2 == 1 { [0, 1, 2] } else { [0, 2, 1] };
            std::array::from_fn::<_, 4, _>(|k| {
                if k == 3 {
                    return NO_EDGE;
                }
                let across = order[(k + 2) % 3];
                // At the other end the edges along y and z have changed places.
                let twin = 4 * (n ^ (1 << order[k])) + [0, 2, 1][k];
                HalfEdge { twin, face: first + 2 * across + side(n, across) }
            })
        });
        Self { positions: (0..8).map(position).collect(), edges: edges.collect() }
    }

    /// The same body, rotated.
    #[must_use]
    pub(super) fn turned(mut self, turn: &Mat3) -> Self {
        for position in &mut self.positions {
            *position = turn * *position;
        }
        self
    }

    /// Positions of the corners (m); those with more than three faces come several times.
    pub(super) fn positions(&self) -> impl Iterator<Item = Vec3> + '_ {
        self.positions.iter().copied()
    }

    /// Every edge once for either face: the face to the left, from where and whereto (m), counter-clockwise.
    pub(super) fn edges(&self) -> impl Iterator<Item = (u32, Vec3, Vec3)> + '_ {
        self.positions.iter().zip(self.edges.chunks_exact(4)).flat_map(move |(&from, edges)| {
            edges[..3].iter().map(move |edge| (edge.face, from, self.positions[(edge.twin >> 2) as usize]))
        })
    }

    /// Renumbers the existing faces from 0, in their order, and returns their planes.
    pub(super) fn renumber(&mut self, planes: &[Plane]) -> Vec<Plane> {
        let mut there = vec![false; planes.len()];
        for (face, ..) in self.edges() {
            there[face as usize] = true;
        }
        let mut number = vec![0; planes.len()];
        let mut kept = Vec::new();
        for (old, plane) in planes.iter().enumerate().filter(|&(old, _)| there[old]) {
            number[old] = kept.len() as u32;
            kept.push(*plane);
        }
        for edge in self.edges.chunks_exact_mut(4).flat_map(|edges| &mut edges[..3]) {
            edge.face = number[edge.face as usize];
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
    /// Of all corners, those that are gone as well (m).
    positions: Vec<Vec3>,
    /// Four per corner.
    edges: Vec<HalfEdge>,
    /// Corners that are left, ascending.
    live: Vec<u32>,
    /// Height of every corner above the plane of the cut (m).
    heights: Vec<f64>,
    /// Corners that a cut keeps, then rubbish; the same of those that it takes away.
    kept: Vec<u32>,
    gone: Vec<u32>,
    /// Half-edges that a cut ends in the upper halves, with their twins, then rubbish.
    trimmed: Vec<u64>,
    /// Bits: half-edges that the integration has not been to.
    pending: Vec<u64>,
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
        self.positions.clear();
        self.positions.extend_from_slice(&graph.positions);
        self.edges.clear();
        self.edges.extend_from_slice(&graph.edges);
        self.live.clear();
        self.live.extend(0..graph.positions.len() as u32);
        self.ball = None;
    }

    /// The remaining body, as a body of its own.
    pub(super) fn graph(&self) -> Graph {
        let mut place = vec![0; self.positions.len()];
        for (new, &old) in self.live.iter().enumerate() {
            place[old as usize] = new as u32;
        }
        let moved = |edge: &HalfEdge| HalfEdge {
            twin: 4 * place[(edge.twin >> 2) as usize] + (edge.twin & 3),
            ..*edge
        };
        let edges = self.live.iter().flat_map(|&v| {
            let first = 4 * v as usize;
            self.edges[first..first + 3].iter().map(moved).chain([NO_EDGE])
        });
        Graph { edges: edges.collect(), positions: self.positions().collect() }
    }

    /// Corners that are left (m).
    pub(super) fn positions(&self) -> impl Iterator<Item = Vec3> + '_ {
        self.live.iter().map(|&v| self.positions[v as usize])
    }

    /// The corner furthest along a direction; there must be one.
    pub(super) fn furthest(&self, along: &Vec3) -> Vec3 {
        furthest(self.positions(), along)
    }

    /// Vectors along all edges (m), each once.
    pub(super) fn edge_vectors(&self) -> impl Iterator<Item = Vec3> + '_ {
        self.live.iter().flat_map(move |&v| {
            let ends = (4 * v..4 * v + 3).map(|edge| self.twin(edge) >> 2).filter(move |&end| end > v);
            ends.map(move |end| self.positions[end as usize] - self.positions[v as usize])
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
        let positions = &self.positions[..];
        let (lo, hi) = bounding_box(self.live.iter().map(|&v| positions[v as usize]));
        *self.ball.insert((0.5 * (lo + hi), 0.5 * (hi - lo).norm()))
    }

    #[inline]
    fn twin(&self, half_edge: u32) -> u32 {
        self.edges[half_edge as usize].twin
    }

    /// Sets what belongs to the faces that are left.
    #[inline]
    pub(super) fn mark_faces(&self, by_face: &mut [bool]) {
        for &v in &self.live {
            let first = 4 * v as usize;
            for edge in &self.edges[first..first + 3] {
                by_face[edge.face as usize] = true;
            }
        }
    }

    /// Takes away what lies more than `slack` (m) above the plane; the new face gets the number `face`.
    pub(super) fn cut(&mut self, plane: &Plane, face: u32, slack: f64) -> Cut {
        let old = self.positions.len();
        let (kept, gone) = self.divide(plane, slack);
        if gone == 0 {
            return Cut::Missed;
        }
        if kept == 0 {
            self.live.clear();
            return Cut::Emptied;
        }
        let trimmed = self.find_trimmed(kept, gone, slack);
        for n in 0..trimmed {
            let pair = self.trimmed[n];
            self.split((pair >> 32) as u32, pair as u32, face);
        }
        // Along the face to the left of its edge back, every new corner finds the one before it on the rim.
        let edges = &mut self.edges[..];
        for new in (4 * old as u32..edges.len() as u32).step_by(4) {
            let mut twin = edges[new as usize].twin;
            while (twin >> 2) < old as u32 {
                twin = edges[turned_back(twin) as usize].twin;
            }
            let (edge, end) = (new + 1, (twin & !3) + 2);
            edges[edge as usize].twin = end;
            edges[end as usize].twin = edge;
        }
        std::mem::swap(&mut self.live, &mut self.kept);
        self.live.truncate(kept);
        self.live.extend(old as u32..self.positions.len() as u32);
        self.ball = None;
        Cut::Trimmed
    }

    /// Heights of all corners; the numbers of those that stay and that go, now in `kept` and `gone`. Without branches, which
    /// nobody could predict; the same below.
    #[inline]
    fn divide(&mut self, plane: &Plane, slack: f64) -> (usize, usize) {
        let (count, all) = (self.live.len(), self.positions.len());
        self.heights.resize(all.max(self.heights.len()), 0.0);
        self.kept.resize(count.max(self.kept.len()), 0);
        self.gone.resize(count.max(self.gone.len()), 0);
        let (positions, heights) = (&self.positions[..], &mut self.heights[..]);
        let (stay, go) = (&mut self.kept[..], &mut self.gone[..]);
        let (mut kept, mut gone) = (0, 0);
        for &v in &self.live {
            let height = plane.height(&positions[v as usize]);
            heights[v as usize] = height;
            stay[kept] = v;
            go[gone] = v;
            let above = height > slack;
            kept += usize::from(!above);
            gone += usize::from(above);
        }
        (kept, gone)
    }

    /// Lists half-edges of corners that stay to corners that go, ascending, from the side that has fewer; returns their number.
    #[inline]
    fn find_trimmed(&mut self, kept: usize, gone: usize, slack: f64) -> usize {
        let from_below = kept <= gone;
        let from = if from_below { &self.kept[..kept] } else { &self.gone[..gone] };
        self.trimmed.resize((3 * from.len() + 1).max(self.trimmed.len()), 0);
        let (edges, heights, trimmed) = (&self.edges[..], &self.heights[..], &mut self.trimmed[..]);
        let mut count = 0;
        for &v in from {
            let first = 4 * v;
            for (edge, half_edge) in (first..).zip(&edges[first as usize..first as usize + 3]) {
                let there = half_edge.twin;
                let above = heights[(there >> 2) as usize] > slack;
                let pair = u64::from(edge) << 32 | u64::from(there);
                trimmed[count] = if from_below { pair } else { pair.rotate_left(32) };
                count += usize::from(above == from_below);
            }
        }
        if !from_below {
            self.trimmed[..count].sort_unstable();
        }
        count
    }

    /// New corner on a half-edge of a corner that stays, to one that goes and where `there` comes back.
    #[inline]
    fn split(&mut self, half_edge: u32, there: u32, face: u32) {
        let (inside, outside) = ((half_edge >> 2) as usize, (there >> 2) as usize);
        let (below, above) = (self.heights[inside], self.heights[outside]);
        // From the end that is nearer to the plane; never beyond the ends.
        let part = (below / (below - above)).clamp(0.0, 1.0);
        let position = self.positions[inside] + (self.positions[outside] - self.positions[inside]) * part;
        let new = 4 * self.positions.len() as u32;
        let [left, right] = [there, half_edge].map(|edge| self.edges[edge as usize].face);
        self.positions.push(position);
        self.edges.extend_from_slice(&[
            HalfEdge { twin: half_edge, face: left },
            HalfEdge { twin: u32::MAX, face },
            HalfEdge { twin: u32::MAX, face: right },
            NO_EDGE,
        ]);
        self.edges[half_edge as usize].twin = new;
    }

    /// Integrals over the remaining body; faces count in the surface integrals with their `weights`, by number. Fills
    /// [`faces`](Self::faces).
    pub(super) fn integrate(&mut self, weights: &[f64]) -> Option<Integrals> {
        let origin = self.positions[*self.live.first()? as usize];
        self.pending.clear();
        self.pending.resize(self.edges.len().div_ceil(64), 0);
        for &v in &self.live {
            self.pending[(v >> 4) as usize] |= 0b111 << (4 * (v & 15));
        }
        self.faces.clear();
        let (positions, edges, pending) = (&self.positions[..], &self.edges[..], &mut self.pending[..]);
        let next = |edge: u32| turned_back(edges[edge as usize].twin);
        let corner = |edge: u32| positions[(edge >> 2) as usize] - origin;
        let (mut volume, mut first) = (0.0, Vec3::zeros());
        let (mut area, mut moment) = (Vec3::zeros(), Vec3::zeros());
        for word in 0..pending.len() {
            while pending[word] != 0 {
                let start = 64 * word as u32 + pending[word].trailing_zeros();
                let face = edges[start as usize].face;
                self.faces.push(face);
                let a = corner(start);
                let (mut twice, mut lever, mut part, mut part_first) =
                    (Vec3::zeros(), Vec3::zeros(), 0.0, Vec3::zeros());
                pending[word] &= pending[word] - 1;
                let mut edge = next(start);
                let mut b = corner(edge);
                loop {
                    pending[(edge >> 6) as usize] &= !(1 << (edge & 63));
                    edge = next(edge);
                    if edge == start {
                        break;
                    }
                    let c = corner(edge);
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
