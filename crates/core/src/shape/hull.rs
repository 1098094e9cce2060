//! Convex hull of points: quickhull (Barber, Dobkin, Huhdanpaa 1996) with exact predicates (Shewchuk 1997).
//!
//! A point is outside a facet if it lies strictly above its plane, decided without rounding. So the triangles are
//! closed and convex by construction, whatever the input. Corners that are coplanar up to rounding still give many
//! thin triangles; [`merge`] joins these to flat faces with a tolerance.

use super::ShapeError;
use crate::math::{Vec3, bounding_box};
use robust::{Coord3D, orient3d};
use std::collections::{BTreeMap, BTreeSet};

/// A triangulated hull. Triangles run counter-clockwise seen from outside.
pub(super) struct Hull {
    /// Corners (m), and possibly points inside.
    pub points: Vec<Vec3>,
    /// Three points each.
    pub triangles: Vec<[u32; 3]>,
    /// Length that counts as nothing (m): the relative tolerance times the longest edge of the bounding box.
    pub tolerance: f64,
}

/// A triangle in the making.
struct Facet {
    corners: [u32; 3],
    /// Facets across the edges from corner `i` to corner `i + 1`.
    neighbours: [usize; 3],
    /// Points strictly above, not yet in the hull.
    outside: Vec<u32>,
    alive: bool,
}

/// Convex hull of `points`; those closer than `relative_tolerance` times the extent are one.
pub(super) fn hull(points: &[Vec3], relative_tolerance: f64) -> Result<Hull, ShapeError> {
    if let Some(index) = points.iter().position(|p| p.iter().any(|x| !x.is_finite())) {
        let at = points[index].into();
        return Err(ShapeError::NotFinite { index, at });
    }
    let (low, high) = bounding_box(points.iter().copied());
    let extent = (high - low).max().max(0.0);
    let tolerance = relative_tolerance * extent;
    let points = weld(points, tolerance);
    if points.len() < 4 {
        return Err(ShapeError::TooFewPoints { count: points.len() });
    }
    let mut builder = Builder::new(&points, extent, tolerance)?;
    builder.grow();
    let triangles = builder.facets.iter().filter(|facet| facet.alive).map(|facet| facet.corners).collect();
    Ok(Hull { points, triangles, tolerance })
}

/// The first of all points in a cell of a grid of this spacing.
fn weld(points: &[Vec3], spacing: f64) -> Vec<Vec3> {
    let mut seen = BTreeSet::new();
    let cell = |p: &Vec3| <[f64; 3]>::from(p.map(|x| if spacing > 0.0 { (x / spacing).round() } else { x }));
    // Adding zero turns -0 into 0.
    points.iter().filter(|p| seen.insert(cell(p).map(|x| (x + 0.0).to_bits()))).copied().collect()
}

/// The hull while points are added.
struct Builder<'a> {
    points: &'a [Vec3],
    exact: Vec<Coord3D<f64>>,
    facets: Vec<Facet>,
}

impl<'a> Builder<'a> {
    /// A tetrahedron of points that lie far apart.
    fn new(points: &'a [Vec3], extent: f64, tolerance: f64) -> Result<Self, ShapeError> {
        // Scaled by a power of two, which is exact: the predicates multiply up to five coordinates and need their
        // digits.
        let scale = libm::ldexp(1.0, -libm::frexp(extent).1);
        let exact =
            points.iter().map(|p| Coord3D { x: p.x * scale, y: p.y * scale, z: p.z * scale }).collect();
        let count = points.len() as u32;
        let at = |i: u32| points[i as usize];
        let furthest = |measure: &dyn Fn(u32) -> f64| {
            (1..count).fold((0, measure(0)), |best, i| {
                let value = measure(i);
                if value > best.1 { (i, value) } else { best }
            })
        };
        let a = furthest(&|i| -at(i).x).0;
        let b = furthest(&|i| (at(i) - at(a)).norm_squared()).0;
        let along = (at(b) - at(a)).normalize();
        let (c, width) = furthest(&|i| (at(i) - at(a)).cross(&along).norm());
        if width <= tolerance {
            return Err(ShapeError::Flat { extent, height: width });
        }
        let normal = (at(b) - at(a)).cross(&(at(c) - at(a))).normalize();
        let (d, height) = furthest(&|i| (at(i) - at(a)).dot(&normal).abs());
        let mut builder = Self { points, exact, facets: Vec::new() };
        let side = builder.above([a, b, c], d);
        // The exact sign is part of the question: a body needs a volume.
        if height <= tolerance || (!side && !builder.above([a, c, b], d)) {
            return Err(ShapeError::Flat { extent, height });
        }
        let (b, c) = if side { (c, b) } else { (b, c) };
        for (corners, neighbours) in
            [([a, b, c], [1, 2, 3]), ([a, d, b], [3, 2, 0]), ([b, d, c], [1, 3, 0]), ([c, d, a], [2, 1, 0])]
        {
            builder.facets.push(Facet { corners, neighbours, outside: Vec::new(), alive: true });
        }
        builder.distribute((0..count).collect(), 0);
        Ok(builder)
    }

    /// Returns true if the point lies strictly above the triangle, without rounding.
    fn above(&self, corners: [u32; 3], point: u32) -> bool {
        let [a, b, c] = corners.map(|i| self.exact[i as usize]);
        orient3d(a, b, c, self.exact[point as usize]) < 0.0
    }

    /// Notes each point at the first facet from `first` on that it lies above.
    fn distribute(&mut self, points: Vec<u32>, first: usize) {
        for point in points {
            if let Some(facet) =
                (first..self.facets.len()).find(|&f| self.above(self.facets[f].corners, point))
            {
                self.facets[facet].outside.push(point);
            }
        }
    }

    /// Adds points until none is outside.
    fn grow(&mut self) {
        let mut next = 0;
        while next < self.facets.len() {
            if self.facets[next].alive && !self.facets[next].outside.is_empty() {
                self.add(next);
            }
            next += 1;
        }
    }

    /// Adds the point furthest above the facet `seed`: the visible facets are replaced by a fan to the horizon.
    fn add(&mut self, seed: usize) {
        let [a, b, c] = self.facets[seed].corners.map(|i| self.points[i as usize]);
        let normal = (b - a).cross(&(c - a));
        let height = |i: u32| (self.points[i as usize] - a).dot(&normal);
        let outside = &self.facets[seed].outside;
        let apex =
            outside[1..].iter().fold(outside[0], |best, &i| if height(i) > height(best) { i } else { best });

        let mut visible = vec![seed];
        let mut horizon = Vec::new();
        let mut seen = BTreeSet::from([seed]);
        let mut at = 0;
        while at < visible.len() {
            let facet = visible[at];
            for side in 0..3 {
                let across = self.facets[facet].neighbours[side];
                if self.above(self.facets[across].corners, apex) {
                    if seen.insert(across) {
                        visible.push(across);
                    }
                } else {
                    let corners = self.facets[facet].corners;
                    horizon.push((corners[side], corners[(side + 1) % 3], across));
                }
            }
            at += 1;
        }

        let first = self.facets.len();
        let by_start: BTreeMap<u32, usize> =
            horizon.iter().enumerate().map(|(n, edge)| (edge.0, first + n)).collect();
        let by_end: BTreeMap<u32, usize> =
            horizon.iter().enumerate().map(|(n, edge)| (edge.1, first + n)).collect();
        for (n, &(start, end, across)) in horizon.iter().enumerate() {
            let neighbours = [across, by_start[&end], by_end[&start]];
            self.facets.push(Facet {
                corners: [start, end, apex],
                neighbours,
                outside: Vec::new(),
                alive: true,
            });
            let other = &mut self.facets[across];
            let side = (0..3).find(|&s| other.corners[s] == end && other.corners[(s + 1) % 3] == start);
            other.neighbours[side.expect("neighbours share an edge")] = first + n;
        }
        let mut orphans = Vec::new();
        for facet in visible {
            self.facets[facet].alive = false;
            orphans.append(&mut self.facets[facet].outside);
        }
        orphans.retain(|&point| point != apex);
        self.distribute(orphans, first);
    }
}

/// Joins triangles that lie in one plane up to the tolerance; returns the corners of the flat faces, counter-clockwise.
///
/// Large triangles collect their neighbours first; slivers, whose normals are noise, only join. Points in the middle of
/// an edge or a face are in fewer than three faces and dropped.
pub(super) fn merge(hull: &Hull) -> Vec<Vec<u32>> {
    let count = hull.triangles.len();
    let at = |i: u32| hull.points[i as usize];
    let mut across = BTreeMap::new();
    for (n, t) in hull.triangles.iter().enumerate() {
        for side in 0..3 {
            across.insert((t[side], t[(side + 1) % 3]), n);
        }
    }
    let neighbour = |n: usize, side: usize| {
        let t = hull.triangles[n];
        across[&(t[(side + 1) % 3], t[side])]
    };
    let edge = |n: usize, side: usize| {
        let t = hull.triangles[n];
        (at(t[(side + 1) % 3]) - at(t[side])).norm()
    };
    let area_vector = |n: usize| {
        let [a, b, c] = hull.triangles[n].map(at);
        (b - a).cross(&(c - a)) * 0.5
    };
    let areas: Vec<f64> = (0..count).map(|n| area_vector(n).norm()).collect();
    let longest: Vec<usize> = (0..count)
        .map(|n| (1..3).fold(0, |best, side| if edge(n, side) > edge(n, best) { side } else { best }))
        .collect();
    let is_sliver = |n: usize| 2.0 * areas[n] <= 4.0 * hull.tolerance * edge(n, longest[n]);

    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|&m, &n| areas[n].total_cmp(&areas[m]).then(m.cmp(&n)));
    let mut face_of = vec![usize::MAX; count];
    let mut faces = 0;
    for &seed in &order {
        if face_of[seed] != usize::MAX || is_sliver(seed) {
            continue;
        }
        let normal = area_vector(seed).normalize();
        let origin = at(hull.triangles[seed][0]);
        let mut open = vec![seed];
        face_of[seed] = faces;
        while let Some(n) = open.pop() {
            for side in 0..3 {
                let other = neighbour(n, side);
                let flat = || {
                    hull.triangles[other]
                        .iter()
                        .all(|&i| (at(i) - origin).dot(&normal).abs() <= hull.tolerance)
                        && (is_sliver(other) || area_vector(other).dot(&normal) > 0.0)
                };
                if face_of[other] == usize::MAX && flat() {
                    face_of[other] = faces;
                    open.push(other);
                }
            }
        }
        faces += 1;
    }
    // Slivers left over go to the face across their longest edge, or to any when that is a sliver, too.
    let mut left: Vec<usize> = (0..count).filter(|&n| face_of[n] == usize::MAX).collect();
    let mut picky = true;
    while faces > 0 && !left.is_empty() {
        let before = left.len();
        left.retain(|&n| {
            let sides = if picky { longest[n]..longest[n] + 1 } else { 0..3 };
            let face = sides.map(|side| face_of[neighbour(n, side)]).find(|&face| face != usize::MAX);
            face_of[n] = face.unwrap_or(usize::MAX);
            face.is_none()
        });
        picky = left.len() < before;
    }

    let mut loops = vec![BTreeMap::new(); faces];
    for n in 0..count {
        for side in 0..3 {
            if faces > 0 && face_of[n] != face_of[neighbour(n, side)] {
                let t = hull.triangles[n];
                loops[face_of[n]].insert(t[side], t[(side + 1) % 3]);
            }
        }
    }
    let mut used: BTreeMap<u32, usize> = BTreeMap::new();
    for &start in loops.iter().flat_map(BTreeMap::keys) {
        *used.entry(start).or_default() += 1;
    }
    loops
        .iter()
        .filter_map(|next| {
            let first = *next.keys().next()?;
            let mut corners = vec![first];
            while let Some(&corner) = next.get(corners.last()?).filter(|&&corner| corner != first) {
                if corners.len() > next.len() {
                    return None;
                }
                corners.push(corner);
            }
            corners.retain(|corner| used[corner] >= 3);
            (corners.len() >= 3).then_some(corners)
        })
        .collect()
}
