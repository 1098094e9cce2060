//! The surface that facets make: vertices welded, facets that enclose nothing dropped, edges checked.
//!
//! A facet encloses nothing if it has no area, if it is there already, or if another one with the same vertices runs the other way
//! round, as the two sides of a fold do. Facets of the last kind, and those without area but with three vertices, are kept if they
//! close the surface: one whose copy is inside out, and the sliver between a long edge and the two halves of it.

use super::TAKE_HULL;
use crate::math::Vec3;
use std::collections::{BTreeMap, BTreeSet};

/// Facets that a message lists by their numbers.
const LISTED: usize = 6;

/// A facet: its number in the file, and its vertices, the least first.
#[derive(Clone, Copy, Debug)]
struct Facet {
    number: usize,
    vertices: [u32; 3],
}

impl Facet {
    fn new(number: usize, [a, b, c]: [u32; 3]) -> Self {
        let vertices = [[a, b, c], [b, c, a], [c, a, b]];
        Self { number, vertices: *vertices.iter().min().expect("three rotations") }
    }

    fn sides(&self) -> [(u32, u32); 3] {
        let [a, b, c] = self.vertices;
        [(a, b), (b, c), (c, a)]
    }

    fn flipped(&self) -> Self {
        let [a, b, c] = self.vertices;
        Self { vertices: [a, c, b], ..*self }
    }
}

/// The facets that make a surface, and the numbers of those that were dropped.
#[derive(Debug)]
pub(super) struct Surface {
    vertices: Vec<Vec3>,
    facets: Vec<Facet>,
    duplicated: Vec<usize>,
    degenerate: Vec<usize>,
}

impl Surface {
    /// Takes the corners of facets (m); those closer than `tolerance` (m) are one vertex.
    pub(super) fn new(facets: &[[Vec3; 3]], tolerance: f64) -> Self {
        let mut welded = Welded { spacing: tolerance, cells: BTreeMap::new(), vertices: Vec::new() };
        let mut by_vertices: BTreeMap<[u32; 3], Vec<Facet>> = BTreeMap::new();
        let mut degenerate = Vec::new();
        for (number, corners) in facets.iter().enumerate() {
            let facet = Facet::new(number, corners.map(|corner| welded.number(corner)));
            let [a, b, c] = facet.vertices;
            if a == b || b == c || c == a {
                degenerate.push(number);
            } else {
                let mut key = facet.vertices;
                key.sort_unstable();
                by_vertices.entry(key).or_default().push(facet);
            }
        }
        let (mut kept, mut undecided, mut flat) = (Vec::new(), Vec::new(), Vec::new());
        for copies in by_vertices.into_values() {
            let first = copies[0];
            let other = copies.iter().find(|copy| copy.vertices != first.vertices).copied();
            let alike = copies.iter().filter(|copy| copy.vertices == first.vertices).count();
            match other {
                Some(other) if 2 * alike == copies.len() => undecided.push(vec![first, other]),
                Some(other) if 2 * alike < copies.len() => kept.push(other),
                _ if height(&facets[first.number]) <= tolerance => {
                    flat.push(first.number);
                    undecided.push(vec![first]);
                }
                _ => kept.push(first),
            }
        }
        if kept.is_empty() {
            // A surface that has both sides everywhere.
            kept = undecided.iter().filter(|facets| facets.len() == 2).map(|facets| facets[0]).collect();
            undecided.retain(|facets| facets.len() < 2);
        }
        close(&mut kept, undecided);
        kept.sort_unstable_by_key(|facet| facet.number);
        let mut is_kept = vec![false; facets.len()];
        for facet in &kept {
            is_kept[facet.number] = true;
        }
        degenerate.extend(flat.into_iter().filter(|&number| !is_kept[number]));
        for &number in &degenerate {
            is_kept[number] = true;
        }
        degenerate.sort_unstable();
        let duplicated = (0..facets.len()).filter(|&number| !is_kept[number]).collect();
        Self { vertices: welded.vertices, facets: kept, duplicated, degenerate }
    }

    /// All facets with an area, each once: those of a surface that encloses nothing.
    pub(super) fn sheet(facets: &[[Vec3; 3]], tolerance: f64) -> Self {
        let mut welded = Welded { spacing: tolerance, cells: BTreeMap::new(), vertices: Vec::new() };
        let (mut seen, mut kept) = (BTreeSet::new(), Vec::new());
        let (mut duplicated, mut degenerate) = (Vec::new(), Vec::new());
        for (number, corners) in facets.iter().enumerate() {
            let facet = Facet::new(number, corners.map(|corner| welded.number(corner)));
            let [a, b, c] = facet.vertices;
            let mut key = facet.vertices;
            key.sort_unstable();
            if a == b || b == c || c == a || height(corners) <= tolerance {
                degenerate.push(number);
            } else if seen.insert(key) {
                kept.push(facet);
            } else {
                duplicated.push(number);
            }
        }
        Self { vertices: welded.vertices, facets: kept, duplicated, degenerate }
    }

    /// True if no facet is left.
    pub(super) fn is_empty(&self) -> bool {
        self.facets.is_empty()
    }

    /// Vertices (m) and facets.
    pub(super) fn parts_of_mesh(&self) -> (Vec<Vec3>, Vec<[u32; 3]>) {
        (self.vertices.clone(), self.facets.iter().map(|facet| facet.vertices).collect())
    }

    /// Facets, given by their index among those that are left, in words with their numbers in the file.
    pub(super) fn listed(&self, facets: &[u32]) -> String {
        list(&facets.iter().map(|&index| self.facets[index as usize].number).collect::<Vec<_>>())
    }

    /// Corners of the facets, as the file has them; of all of them if none is left.
    pub(super) fn corners(&self, facets: &[[Vec3; 3]]) -> Vec<Vec3> {
        match self.facets.as_slice() {
            [] => facets.iter().flatten().copied().collect(),
            kept => kept.iter().flat_map(|facet| facets[facet.number]).collect(),
        }
    }

    /// Facets with their numbers in the file.
    pub(super) fn triangles(&self) -> impl Iterator<Item = (usize, [Vec3; 3])> {
        self.facets
            .iter()
            .map(|facet| (facet.number, facet.vertices.map(|vertex| self.vertices[vertex as usize])))
    }

    /// The first facet of each part of the surface that shares no vertex with the others, by its number in the file.
    pub(super) fn parts(&self) -> Vec<usize> {
        // Each vertex leads to one of its part with a smaller number, or to itself.
        let mut leads: Vec<usize> = (0..self.vertices.len()).collect();
        for facet in &self.facets {
            let [a, b, c] = facet.vertices.map(|vertex| end_of(&mut leads, vertex as usize));
            let least = a.min(b).min(c);
            (leads[a], leads[b], leads[c]) = (least, least, least);
        }
        let mut parts = BTreeMap::new();
        for facet in &self.facets {
            parts.entry(end_of(&mut leads, facet.vertices[0] as usize)).or_insert(facet.number);
        }
        let mut numbers: Vec<usize> = parts.into_values().collect();
        numbers.sort_unstable();
        numbers
    }

    /// The facets that were dropped in words, if there are any.
    pub(super) fn dropped(&self) -> Option<String> {
        let some = |numbers: &[usize], kind: &str| {
            let first = numbers.first()?;
            Some(match numbers.len() {
                1 => format!("1 {kind} facet (facet {first})"),
                count => format!("{count} {kind} facets (the first is facet {first})"),
            })
        };
        let kinds = [some(&self.duplicated, "duplicated"), some(&self.degenerate, "degenerate")];
        let kinds: Vec<String> = kinds.into_iter().flatten().collect();
        (!kinds.is_empty()).then(|| format!("dropped {}", kinds.join(" and ")))
    }

    /// Volume that the facets enclose (m^3), negative if they are inside out; none if they are not closed.
    ///
    /// By the divergence theorem, the sum of the tetrahedra from one vertex to each facet.
    pub(super) fn volume(&self) -> Option<f64> {
        let is_closed = self.edges().values().all(|[there, back]| there.len() == back.len());
        let origin = self.triangles().next()?.1[0];
        let tetrahedra = self.triangles().map(|(_, corners)| {
            let [a, b, c] = corners.map(|corner| corner - origin);
            a.dot(&b.cross(&c)) / 6.0
        });
        is_closed.then(|| tetrahedra.sum())
    }

    /// Numbers of the facets on each edge, by its vertices in ascending order, that run through it this way and the other way.
    fn edges(&self) -> BTreeMap<(u32, u32), [Vec<usize>; 2]> {
        let mut edges: BTreeMap<_, [Vec<usize>; 2]> = BTreeMap::new();
        for facet in &self.facets {
            for (from, to) in facet.sides() {
                let entry = edges.entry((from.min(to), from.max(to))).or_default();
                entry[usize::from(from > to)].push(facet.number);
            }
        }
        edges
    }

    /// Two facets must meet in each edge, which run through it in opposite directions.
    pub(super) fn check_closed(&self) -> Result<(), String> {
        let edges = self.edges();
        // The defects of a kind: their number, and the one of the first facet.
        let worst = |is_defect: &dyn Fn(usize, usize) -> bool| {
            let defects = edges.iter().filter(|(_, [there, back])| is_defect(there.len(), back.len()));
            let all = defects.map(|(&edge, [there, back])| {
                let mut numbers = [&there[..], &back[..]].concat();
                numbers.sort_unstable();
                (numbers, edge)
            });
            let all: Vec<_> = all.collect();
            let count = match all.len() {
                1 => "1 edge".to_owned(),
                count => format!("{count} edges"),
            };
            all.into_iter().min().map(|(numbers, edge)| (count, list(&numbers), self.place(edge)))
        };
        let error = if self.facets.is_empty() {
            Some(format!("no facet has an area; export the mesh again, {TAKE_HULL}"))
        } else if let Some((edges, facets, at)) = worst(&|there, back| there + back == 1) {
            Some(format!(
                "the surface is open: {edges} without a second facet, the first of {facets} from {at}; close the mesh, {TAKE_HULL}"
            ))
        } else if let Some((edges, facets, at)) = worst(&|there, back| there + back > 2) {
            Some(format!(
                "the surface is not manifold: {edges} of more than two facets, the first of {facets} from {at}; remove the \
                 facets that do not belong to the surface, {TAKE_HULL}"
            ))
        } else {
            worst(&|there, back| there != back).map(|(edges, facets, at)| {
                format!(
                    "{edges} through which both facets run the same way, the first of {facets} from {at}, so that one of them is \
                     inside out; make all facets run counter-clockwise seen from outside, {TAKE_HULL}"
                )
            })
        };
        error.map_or(Ok(()), Err)
    }

    fn place(&self, (from, to): (u32, u32)) -> String {
        let [a, b] = [from, to].map(|vertex| self.vertices[vertex as usize]);
        format!("({}, {}, {}) m to ({}, {}, {}) m", a.x, a.y, a.z, b.x, b.y, b.z)
    }
}

/// Adds to closed or nearly closed facets one of each of the alternatives that an edge without a second facet needs.
fn close(kept: &mut Vec<Facet>, mut undecided: Vec<Vec<Facet>>) {
    /// Facets that run through each edge this way less those that run through it the other way.
    type Excess = BTreeMap<(u32, u32), i64>;
    fn add(excess: &mut Excess, facet: &Facet) {
        for (from, to) in facet.sides() {
            *excess.entry((from, to)).or_default() += 1;
            *excess.entry((to, from)).or_default() -= 1;
        }
    }
    fn closes(excess: &Excess, facet: &Facet) -> usize {
        facet.sides().iter().filter(|side| excess.get(side).is_some_and(|&excess| excess < 0)).count()
    }
    let mut excess = Excess::new();
    for facet in kept.iter() {
        add(&mut excess, facet);
    }
    loop {
        let before = undecided.len();
        undecided.retain(|alternatives| {
            let needed =
                alternatives.iter().find(|facet| closes(&excess, facet) > closes(&excess, &facet.flipped()));
            if let Some(facet) = needed {
                add(&mut excess, facet);
                kept.push(*facet);
            }
            needed.is_none()
        });
        if undecided.len() == before {
            return;
        }
    }
}

/// The vertex at which the ways from a vertex end; shortens them.
fn end_of(leads: &mut [usize], mut vertex: usize) -> usize {
    while leads[vertex] != vertex {
        leads[vertex] = leads[leads[vertex]];
        vertex = leads[vertex];
    }
    vertex
}

/// Least height of a triangle (m).
fn height([a, b, c]: &[Vec3; 3]) -> f64 {
    let longest = (b - a).norm().max((c - b).norm()).max((a - c).norm());
    if longest > 0.0 { (b - a).cross(&(c - a)).norm() / longest } else { 0.0 }
}

fn list(numbers: &[usize]) -> String {
    let first: Vec<String> = numbers.iter().take(LISTED).map(usize::to_string).collect();
    let more = if numbers.len() > LISTED { " ..." } else { "" };
    let facets = if numbers.len() == 1 { "facet" } else { "facets" };
    format!("{facets} {}{more}", first.join(", "))
}

/// Numbers of points; those closer than the spacing to an earlier one have its number.
struct Welded {
    spacing: f64,
    cells: BTreeMap<[i64; 3], Vec<u32>>,
    vertices: Vec<Vec3>,
}

impl Welded {
    fn number(&mut self, point: Vec3) -> u32 {
        let cell: [i64; 3] = (point / self.spacing).map(|x| x.floor() as i64).into();
        for n in 0..27 {
            let near = [n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1];
            let key = [0, 1, 2].map(|i| cell[i].saturating_add(near[i]));
            let is_near = |&&number: &&u32| (self.vertices[number as usize] - point).norm() <= self.spacing;
            if let Some(&number) = self.cells.get(&key).and_then(|numbers| numbers.iter().find(is_near)) {
                return number;
            }
        }
        let number = self.vertices.len() as u32;
        self.vertices.push(point);
        self.cells.entry(cell).or_default().push(number);
        number
    }
}
