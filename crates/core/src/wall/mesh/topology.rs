//! Facets and their edges: neighbours, consistent orientation, holes.

use super::tree::Tree;
use super::{Facet, crossing};
use crate::math::{Vec3, bounding_box};
use std::collections::BTreeMap;
use std::fmt::{Display, Formatter};

/// A flaw that keeps a mesh from having an inside.
#[derive(Clone, Debug, PartialEq)]
pub struct Flaw {
    kind: FlawKind,
    /// Number of such edges.
    pub count: usize,
    /// Facets at the first of them.
    pub facets: Vec<u32>,
    /// Ends of the first of them (m).
    pub edge: [Vec3; 2],
    ends: [u32; 2],
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum FlawKind {
    Open,
    NotManifold,
    OneSided,
}

impl Flaw {
    pub(super) fn at(self, vertices: &[Vec3]) -> Self {
        Self { edge: self.ends.map(|vertex| vertices[vertex as usize]), ..self }
    }
}

impl Display for Flaw {
    fn fmt(&self, out: &mut Formatter<'_>) -> std::fmt::Result {
        let count = match self.count {
            1 => "1 edge".to_owned(),
            count => format!("{count} edges"),
        };
        match self.kind {
            FlawKind::Open => write!(out, "the surface is open: {count} without a second facet"),
            FlawKind::NotManifold => {
                write!(out, "the surface is not manifold: {count} of an odd number of facets")
            }
            FlawKind::OneSided => write!(
                out,
                "the surface has one side only, as a Moebius strip: {count} through which facets run the same way however they are turned"
            ),
        }
    }
}

/// The edges of facets.
#[derive(Clone, Debug)]
pub(super) struct Edges {
    /// By edge its ends, the lower number first.
    pub(super) ends: Vec<[u32; 2]>,
    /// By edge the range of its facets in `facets`: from its number to that of the next edge.
    first: Vec<u32>,
    /// Facets, ascending by edge.
    facets: Vec<u32>,
    /// By facet the edges from each of its vertices to the next one.
    pub(super) of_facet: Vec<[u32; 3]>,
    /// By vertex the range of the vertices at the other ends of its edges in `others`.
    around: Vec<u32>,
    others: Vec<u32>,
}

impl Edges {
    pub(super) fn new(facets: &[[u32; 3]]) -> Self {
        let mut sides: Vec<([u32; 2], u32, u8)> = Vec::with_capacity(3 * facets.len());
        for (n, corners) in facets.iter().enumerate() {
            for k in 0..3 {
                let (from, to) = (corners[k], corners[(k + 1) % 3]);
                sides.push(([from.min(to), from.max(to)], n as u32, k as u8));
            }
        }
        sides.sort_unstable();
        let (mut ends, mut first, mut of_facet) =
            (Vec::<[u32; 2]>::new(), Vec::new(), vec![[0; 3]; facets.len()]);
        for (n, (edge, facet, k)) in sides.iter().enumerate() {
            if ends.last() != Some(edge) {
                ends.push(*edge);
                first.push(n as u32);
            }
            of_facet[*facet as usize][*k as usize] = ends.len() as u32 - 1;
        }
        first.push(sides.len() as u32);
        let most = facets.iter().flatten().max().map_or(0, |most| *most as usize + 1);
        let mut around = vec![0; most + 1];
        for [a, b] in &ends {
            around[*a as usize + 1] += 1;
            around[*b as usize + 1] += 1;
        }
        for n in 0..most {
            around[n + 1] += around[n];
        }
        let mut next = around.clone();
        let mut others = vec![0; 2 * ends.len()];
        for &[a, b] in &ends {
            for [from, to] in [[a, b], [b, a]] {
                others[next[from as usize] as usize] = to;
                next[from as usize] += 1;
            }
        }
        let facets = sides.iter().map(|side| side.1).collect();
        Self { ends, first, facets, of_facet, around, others }
    }

    /// Facets at an edge.
    pub(super) fn facets(&self, edge: u32) -> &[u32] {
        &self.facets[self.first[edge as usize] as usize..self.first[edge as usize + 1] as usize]
    }

    /// Vertices at the other ends of the edges of a vertex.
    pub(super) fn around(&self, vertex: u32) -> &[u32] {
        &self.others[self.around[vertex as usize] as usize..self.around[vertex as usize + 1] as usize]
    }

    /// The facet beyond an edge of a facet, if there is one other.
    pub(super) fn beyond(&self, edge: u32, facet: u32) -> Option<u32> {
        match *self.facets(edge) {
            [one, other] if other == facet => Some(one),
            [one, other] if one == facet => Some(other),
            _ => None,
        }
    }
}

/// Facets that run through the edges between them in opposite directions, as far as that is possible.
pub(super) struct Oriented {
    pub(super) facets: Vec<[u32; 3]>,
    /// The flaw that keeps them from enclosing a region.
    pub(super) flaw: Option<Flaw>,
}

/// True if a facet runs through an edge from its lower to its higher vertex.
fn is_upwards(facet: &[u32; 3], [low, high]: [u32; 2]) -> bool {
    (0..3).any(|k| facet[k] == low && facet[(k + 1) % 3] == high)
}

/// Turns facets like the first of those that they are connected with across edges of two.
pub(super) fn oriented(mut facets: Vec<[u32; 3]>, edges: &Edges) -> Oriented {
    let mut seen = vec![false; facets.len()];
    let mut stack = Vec::new();
    for start in 0..facets.len() {
        if seen[start] {
            continue;
        }
        seen[start] = true;
        stack.push(start as u32);
        while let Some(facet) = stack.pop() {
            for edge in edges.of_facet[facet as usize] {
                let Some(next) = edges.beyond(edge, facet) else { continue };
                if std::mem::replace(&mut seen[next as usize], true) {
                    continue;
                }
                let ends = edges.ends[edge as usize];
                let here = facets[facet as usize];
                let there = &mut facets[next as usize];
                if is_upwards(&here, ends) == is_upwards(there, ends) {
                    there.swap(1, 2);
                }
                stack.push(next);
            }
        }
    }
    let flaw = [FlawKind::Open, FlawKind::NotManifold, FlawKind::OneSided].into_iter().find_map(|kind| {
        let is_flawed = |edge: &u32| {
            let at = edges.facets(*edge);
            let ends = edges.ends[*edge as usize];
            let up = at.iter().filter(|&&facet| is_upwards(&facets[facet as usize], ends)).count();
            match kind {
                FlawKind::Open => at.len() == 1,
                FlawKind::NotManifold => at.len() % 2 == 1,
                FlawKind::OneSided => 2 * up != at.len(),
            }
        };
        let mut all = (0..edges.ends.len() as u32).filter(is_flawed);
        let first = all.next()?;
        let (facets, ends) = (edges.facets(first).to_vec(), edges.ends[first as usize]);
        Some(Flaw { kind, count: 1 + all.count(), facets, edge: [Vec3::zeros(); 2], ends })
    });
    Oriented { facets, flaw }
}

/// Turns closed surfaces so that normals point out of the region that they enclose together: those within an odd number of others are
/// cavities.
pub(super) fn turn_outwards(facets: &mut [[u32; 3]], vertices: &[Vec3], edges: &Edges, tree: &Tree) {
    let corners = |facet: &[u32; 3]| facet.map(|vertex| vertices[vertex as usize]);
    let mut part = vec![u32::MAX; facets.len()];
    let mut parts: Vec<Vec<u32>> = Vec::new();
    for start in 0..facets.len() as u32 {
        if part[start as usize] != u32::MAX {
            continue;
        }
        let number = parts.len() as u32;
        part[start as usize] = number;
        let mut members = vec![start];
        let mut at = 0;
        while let Some(&facet) = members.get(at) {
            for edge in edges.of_facet[facet as usize] {
                if let Some(next) = edges.beyond(edge, facet).filter(|next| part[*next as usize] == u32::MAX)
                {
                    part[next as usize] = number;
                    members.push(next);
                }
            }
            at += 1;
        }
        parts.push(members);
    }
    let bounds = |members: &[u32]| bounding_box(members.iter().flat_map(|&n| corners(&facets[n as usize])));
    let boxes: Vec<(Vec3, Vec3)> = parts.iter().map(|members| bounds(members)).collect();
    let holds = |outer: u32, inner: usize| {
        let ((low, high), (lower, upper)) = (boxes[outer as usize], boxes[inner]);
        (0..3).all(|i| low[i] < lower[i] && upper[i] < high[i])
    };
    let mut flips = Vec::new();
    for (number, members) in parts.iter().enumerate() {
        let origin = vertices[facets[members[0] as usize][0] as usize];
        let tetrahedron = |facet: &u32| {
            let [a, b, c] = corners(&facets[*facet as usize]).map(|corner| corner - origin);
            a.dot(&b.cross(&c))
        };
        let volume: f64 = members.iter().map(tetrahedron).sum();
        let mut around: BTreeMap<u32, i32> = BTreeMap::new();
        if parts.len() > 1 {
            let far = tree.far(&origin);
            tree.each(&[origin, far], |facet| {
                let other = part[facet as usize];
                if other as usize != number && holds(other, number) {
                    *around.entry(other).or_default() +=
                        crossing::winding(&corners(&facets[facet as usize]), &origin).unwrap_or(0);
                }
            });
        }
        let is_cavity = around.values().filter(|winding| **winding != 0).count() % 2 == 1;
        flips.push((volume < 0.0) != is_cavity);
    }
    for (facet, part) in facets.iter_mut().zip(part) {
        if flips[part as usize] {
            facet.swap(1, 2);
        }
    }
}

/// Sums of the normals of the facets round each vertex, weighted by their angles there (Baerentzen and Aanaes 2005): positive along the way
/// from there to any point of which it is the nearest one, on the side that normals point to.
pub(super) fn vertex_normals(vertices: &[Vec3], facets: &[Facet]) -> Vec<Vec3> {
    let mut normals = vec![Vec3::zeros(); vertices.len()];
    for facet in facets {
        for k in 0..3 {
            let [at, next, last] = [k, k + 1, k + 2].map(|k| facet.vertices[k % 3] as usize);
            let [a, b] = [next, last].map(|other| vertices[other] - vertices[at]);
            let angle = libm::atan2(a.cross(&b).norm(), a.dot(&b));
            normals[at] += facet.normal * angle;
        }
    }
    normals
}
