//! A body cut along planes until the hulls of its pieces have little more volume than the body.
//!
//! A piece is what a convex cell has of the body. Its hull is that of the corners of facets cut off at the planes of the cell, and of the corners
//! of the cell that the mesh encloses: exact but for rounding. The piece whose hull holds the most that is not body is cut, by the plane that leaves
//! hulls of the least volume in all: one in which a facet at a concave edge lies, or one across an axis. In the end those that are
//! convex together are joined.

use super::super::{COARSEST, TAKE_HULL};
use crate::math::{Mat3, Vec3, bounding_box};
use crate::shape::{Polyhedron, ShapeError};
use crate::wall::WallMesh;
use std::collections::BTreeMap;

/// Planes across each axis that are tried, and times that the step between them is halved about the best one.
const ACROSS: usize = 8;
const HALVINGS: usize = 4;
/// Planes of facets at concave edges that are tried, those along the longest and sharpest edges.
const NOTCHES: usize = 24;
/// Weight of the difference of the volumes of two hulls, in the volume to be gained.
const BALANCE: f64 = 0.05;
/// Weight of what the extent across a plane lacks of the largest one.
const LENGTH: f64 = 0.05;
/// Points in the box about a piece at which the body is looked for.
const SAMPLES: f64 = 4096.0;
/// Part of the volume of the body by which the hull of two pieces that are convex together may exceed them.
const JOINED: f64 = 1e-6;
/// Relative difference up to which planes are one candidate.
const SAME: f64 = 1e-4;

/// A plane `normal . x = offset`.
#[derive(Clone, Copy, Debug)]
struct Plane {
    normal: Vec3,
    offset: f64,
}

impl Plane {
    fn height(&self, at: &Vec3) -> f64 {
        self.normal.dot(at) - self.offset
    }

    fn flipped(&self) -> Self {
        Self { normal: -self.normal, offset: -self.offset }
    }
}

/// Part of a facet.
#[derive(Clone, Debug)]
struct Polygon {
    /// Among the points of the piece.
    corners: Vec<u32>,
    normal: Vec3,
}

/// Part of a concave edge.
#[derive(Clone, Debug)]
struct Notch {
    ends: [Vec3; 2],
    /// Candidates, of the facets on both sides.
    planes: [u32; 2],
    /// Sine of the angle between the facets.
    sharpness: f64,
}

/// Share of the body in a convex cell.
#[derive(Clone, Debug, Default)]
struct Piece {
    /// Planes of the cell, which is below all of them.
    planes: Vec<Plane>,
    /// Corners of polygons.
    points: Vec<Vec3>,
    polygons: Vec<Polygon>,
    notches: Vec<Notch>,
    /// Corners of the cell in the body.
    enclosed: Vec<Vec3>,
    /// Volume of the hull, and estimate of what of it is not body.
    volume: f64,
    excess: f64,
}

/// Lengths and volumes that count as nothing, and what can be asked of the mesh.
struct Cutter<'a> {
    mesh: &'a WallMesh,
    /// Distance up to which a point is on a plane.
    near: f64,
    /// Volume of the body.
    volume: f64,
    /// Planes of facets at concave edges.
    candidates: Vec<Plane>,
}

/// Corners of the hulls of convex pieces of a body in a closed mesh, of which the volume and the relative precision are given. The volume of all hulls exceeds
/// that of the body by at most the part `excess`.
///
/// # Errors
/// More than `most` pieces; too many faces of one.
pub(super) fn cut(
    mesh: &WallMesh,
    (volume, precision): (f64, f64),
    excess: f64,
    most: usize,
) -> Result<Vec<Vec<Vec3>>, String> {
    let [low, high] = mesh.bounds();
    let near = 4.0 * precision * (high - low).norm();
    let mut cutter = Cutter { mesh, near, volume, candidates: Vec::new() };
    let mut pieces = vec![cutter.whole()];
    let beyond = |pieces: &[Piece]| pieces.iter().map(|piece| piece.volume).sum::<f64>() / volume - 1.0;
    let (mut now, mut reached) = (beyond(&pieces), f64::INFINITY);
    // Some of them will be joined.
    while now > excess && pieces.len() < 2 * most {
        let worst = (0..pieces.len())
            .fold(0, |worst, n| if pieces[n].excess > pieces[worst].excess { n } else { worst });
        if pieces[worst].excess <= 0.0 {
            break;
        }
        match cutter.halves(&pieces[worst]) {
            Some([one, other]) => {
                pieces[worst] = one;
                pieces.push(other);
            }
            None => pieces[worst].excess = 0.0,
        }
        now = beyond(&pieces);
        if pieces.len() <= most {
            reached = now;
        }
    }
    let hulls = cutter.joined(&pieces).map_err(|e| e.to_string())?;
    if now > excess || hulls.len() > most {
        return Err(format!(
            "{most} convex parts still have {:.2} % more volume than the body, {:.2} % are allowed; set `excess = {:.2}`, take a simpler mesh, \
             {TAKE_HULL}",
            100.0 * reached,
            100.0 * excess,
            libm::ceil(100.0 * reached) / 100.0
        ));
    }
    Ok(hulls)
}

impl Cutter<'_> {
    /// The body in its box; notes the planes of facets at concave edges.
    fn whole(&mut self) -> Piece {
        let facets = self.mesh.facets();
        let mut sides: BTreeMap<[u32; 2], Vec<(u32, bool)>> = BTreeMap::new();
        for (n, facet) in facets.iter().enumerate() {
            for k in 0..3 {
                let (from, to) = (facet.vertices[k], facet.vertices[(k + 1) % 3]);
                sides.entry([from.min(to), from.max(to)]).or_default().push((n as u32, from < to));
            }
        }
        let mut known: BTreeMap<[i64; 4], u32> = BTreeMap::new();
        let mut notches = Vec::new();
        let [low, high] = self.mesh.bounds();
        let (middle, extent) = ((low + high) * 0.5, (high - low).norm());
        for (ends, facets_of) in &sides {
            let &[(one, up), (other, _)] = &facets_of[..] else { continue };
            let [first, second] = [one, other].map(|n| facets[n as usize].normal);
            let ends = ends.map(|vertex| self.mesh.vertices()[vertex as usize]);
            let along = (ends[1] - ends[0]) * if up { 1.0 } else { -1.0 };
            let sharpness = -first.cross(&second).dot(&along) / along.norm();
            if sharpness <= 1e-6 {
                continue;
            }
            let planes = [first, second].map(|normal| {
                let plane = Plane { normal, offset: normal.dot(&ends[0]) };
                let away = plane.height(&middle) / extent;
                let key = [normal.x, normal.y, normal.z, away].map(|x| libm::round(x / SAME) as i64);
                *known.entry(key).or_insert_with(|| {
                    self.candidates.push(plane);
                    self.candidates.len() as u32 - 1
                })
            });
            notches.push(Notch { ends, planes, sharpness });
        }
        let planes = (0..3).flat_map(|axis| {
            let normal = Vec3::ith(axis, 1.0);
            let above = Plane { normal, offset: high[axis] };
            [above, Plane { normal, offset: low[axis] }.flipped()]
        });
        let polygons =
            facets.iter().map(|facet| Polygon { corners: facet.vertices.to_vec(), normal: facet.normal });
        let mut piece = Piece {
            planes: planes.collect(),
            points: self.mesh.vertices().to_vec(),
            polygons: polygons.collect(),
            notches,
            ..Piece::default()
        };
        self.measure(&mut piece);
        piece
    }

    fn hull_volume(&self, points: &[Vec3]) -> f64 {
        Polyhedron::hull_volume(points, self.tolerance(points))
    }

    /// The rounding of the mesh in terms of the extent of some of its points.
    fn tolerance(&self, points: &[Vec3]) -> f64 {
        let (low, high) = bounding_box(points.iter().copied());
        (0.25 * self.near / (high - low).max()).min(COARSEST)
    }

    /// Sets volume and excess.
    fn measure(&self, piece: &mut Piece) {
        let content = piece.content();
        piece.volume = self.hull_volume(&content);
        piece.excess = 0.0;
        let (body, placement) = match Polyhedron::hull(&content, self.tolerance(&content)) {
            Ok(found) => found,
            // Smaller pieces have fewer faces.
            Err(ShapeError::TooManyFaces { .. }) => {
                piece.excess = piece.volume;
                return;
            }
            Err(_) => return,
        };
        let (low, high) = bounding_box(body.vertices.iter().copied());
        let step = libm::cbrt((high - low).product() / SAMPLES);
        let count = (high - low).map(|length| libm::ceil(length / step).max(4.0));
        let (mut within, mut beyond) = (0.0, 0.0);
        for i in 0..count.x as usize {
            for j in 0..count.y as usize {
                for k in 0..count.z as usize {
                    let part =
                        Vec3::new(i as f64 + 0.5, j as f64 + 0.5, k as f64 + 0.5).component_div(&count);
                    let at = low + part.component_mul(&(high - low));
                    if body.faces.iter().all(|face| face.normal.dot(&at) <= face.offset) {
                        within += 1.0;
                        let at = placement.centre + placement.rotation * at;
                        beyond += if self.mesh.encloses(&at) { 0.0 } else { 1.0 };
                    }
                }
            }
        }
        // None seen may be half a point.
        piece.excess = piece.volume * f64::max(beyond, if piece.notches.is_empty() { 0.0 } else { 0.5 })
            / f64::max(within, 1.0);
    }

    /// Both sides of the best plane, below it first.
    fn halves(&self, piece: &Piece) -> Option<[Piece; 2]> {
        let (low, high) = bounding_box(piece.content());
        let extent = (high - low).max();
        let mut best: Option<(f64, Plane)> = None;
        let mut attempt = |plane: Plane| {
            let Some(cost) = self.cost(piece, extent, &plane) else { return false };
            let is_best = best.is_none_or(|(known, _)| cost < known);
            if is_best {
                best = Some((cost, plane));
            }
            is_best
        };
        for plane in self.heaviest(piece) {
            attempt(plane);
        }
        let mut across = None;
        for axis in 0..3 {
            let step = (high[axis] - low[axis]) / (ACROSS as f64 + 1.0);
            for n in 1..=ACROSS {
                let offset = low[axis] + step * n as f64;
                if attempt(Plane { normal: Vec3::ith(axis, 1.0), offset }) {
                    across = Some((axis, offset, step));
                }
            }
        }
        if let Some((axis, mut offset, mut step)) = across {
            for _ in 0..HALVINGS {
                step *= 0.5;
                for to in [offset - step, offset + step] {
                    if attempt(Plane { normal: Vec3::ith(axis, 1.0), offset: to }) {
                        offset = to;
                    }
                }
            }
        }
        let (_, plane) = best?;
        let halves = [plane, plane.flipped()].map(|plane| {
            let mut half = self.below(piece, &plane);
            self.measure(&mut half);
            half
        });
        Some(halves)
    }

    /// Planes of facets at the notches of a piece, those along the longest and sharpest first.
    fn heaviest(&self, piece: &Piece) -> Vec<Plane> {
        let mut weights: BTreeMap<u32, f64> = BTreeMap::new();
        for notch in &piece.notches {
            for plane in notch.planes {
                *weights.entry(plane).or_default() +=
                    (notch.ends[1] - notch.ends[0]).norm() * notch.sharpness;
            }
        }
        let mut order: Vec<(u32, f64)> = weights.into_iter().collect();
        order.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        order.iter().take(NOTCHES).map(|(plane, _)| self.candidates[*plane as usize]).collect()
    }

    /// Volume of the hulls on both sides of a plane, and a part for their difference; none if nothing is on one of them.
    fn cost(&self, piece: &Piece, extent: f64, plane: &Plane) -> Option<f64> {
        let heights: Vec<f64> = piece.points.iter().map(|point| plane.height(point)).collect();
        let side = |height: f64| {
            if height > self.near {
                1
            } else if height < -self.near {
                -1
            } else {
                0
            }
        };
        // Points on the plane belong to a side to which an edge leads from them.
        let mut leads = vec![[false; 2]; heights.len()];
        let mut found: [Vec<Vec3>; 2] = Default::default();
        for polygon in &piece.polygons {
            for (n, &from) in polygon.corners.iter().enumerate() {
                let to = polygon.corners[(n + 1) % polygon.corners.len()];
                let (from, to) = (from as usize, to as usize);
                match (side(heights[from]), side(heights[to])) {
                    (0, -1) => leads[from][0] = true,
                    (0, 1) => leads[from][1] = true,
                    (-1, 0) => leads[to][0] = true,
                    (1, 0) => leads[to][1] = true,
                    (-1, 1) | (1, -1) => {
                        let at = piece.points[from]
                            .lerp(&piece.points[to], heights[from] / (heights[from] - heights[to]));
                        for points in &mut found {
                            points.push(at);
                        }
                    }
                    _ => {}
                }
            }
        }
        for (n, height) in heights.iter().enumerate() {
            let side = side(*height);
            for (k, points) in found.iter_mut().enumerate() {
                if side == 2 * k as i32 - 1 || side == 0 && leads[n][k] {
                    points.push(piece.points[n]);
                }
            }
        }
        for (points, plane) in found.iter_mut().zip([*plane, plane.flipped()]) {
            points.extend(piece.enclosed.iter().filter(|at| plane.height(at) <= self.near));
            self.corners(&piece.planes, &plane, points);
        }
        let volumes = found.map(|points| self.hull_volume(&points));
        let least = 1e-9 * self.volume;
        let difference = (volumes[0] - volumes[1]).abs() / piece.volume;
        let (low, high) =
            heights.iter().fold((f64::MAX, f64::MIN), |(low, high), x| (low.min(*x), high.max(*x)));
        let short = 1.0 - (high - low) / extent;
        volumes
            .iter()
            .all(|volume| *volume > least)
            .then(|| volumes[0] + volumes[1] + piece.excess * (BALANCE * difference + LENGTH * short))
    }

    /// Adds the corners that a plane makes with pairs of those of a cell, if they are in the body below it.
    fn corners(&self, planes: &[Plane], plane: &Plane, found: &mut Vec<Vec3>) {
        for (n, one) in planes.iter().enumerate() {
            for other in &planes[..n] {
                let normals = Mat3::from_rows(&[
                    plane.normal.transpose(),
                    one.normal.transpose(),
                    other.normal.transpose(),
                ]);
                if normals.determinant().abs() < 1e-6 {
                    continue;
                }
                let Some(inverse) = normals.try_inverse() else { continue };
                let at = inverse * Vec3::new(plane.offset, one.offset, other.offset);
                let is_corner = planes.iter().all(|plane| plane.height(&at) <= self.near);
                // A corner on the mesh may be on the side of the body or not.
                let inwards = inverse * Vec3::repeat(-4.0 * self.near);
                if is_corner && self.mesh.encloses(&(at + inwards)) {
                    found.push(at);
                }
            }
        }
    }

    /// Share of a piece below a plane.
    fn below(&self, piece: &Piece, plane: &Plane) -> Piece {
        let heights: Vec<f64> = piece.points.iter().map(|point| plane.height(point)).collect();
        let mut half = Piece::default();
        let mut taken: BTreeMap<[u32; 2], u32> = BTreeMap::new();
        let mut take = |key: [u32; 2], at: Vec3, points: &mut Vec<Vec3>| {
            *taken.entry(key).or_insert_with(|| {
                points.push(at);
                points.len() as u32 - 1
            })
        };
        for polygon in &piece.polygons {
            let own = polygon.corners.iter().map(|&n| heights[n as usize]);
            let (low, high) = own.fold((f64::MAX, f64::MIN), |(low, high), x| (low.min(x), high.max(x)));
            // One in the plane belongs to the side of the body.
            let is_kept = if high <= self.near && low >= -self.near {
                polygon.normal.dot(&plane.normal) > 0.0
            } else {
                low < -self.near
            };
            if !is_kept {
                continue;
            }
            let is_below = |n: u32| heights[n as usize] <= self.near;
            let mut corners = Vec::new();
            for (n, &from) in polygon.corners.iter().enumerate() {
                let to = polygon.corners[(n + 1) % polygon.corners.len()];
                if is_below(from) {
                    corners.push(take([from, from], piece.points[from as usize], &mut half.points));
                }
                if is_below(from) != is_below(to) {
                    let (low, high) = (from.min(to), from.max(to));
                    let [below, above] = [low, high].map(|n| heights[n as usize]);
                    // From a point on the plane nothing is cut off.
                    if below.abs() > self.near && above.abs() > self.near {
                        let [a, b] = [low, high].map(|n| piece.points[n as usize]);
                        corners.push(take(
                            [low, high],
                            a.lerp(&b, below / (below - above)),
                            &mut half.points,
                        ));
                    }
                }
            }
            if corners.len() > 2 {
                half.polygons.push(Polygon { corners, normal: polygon.normal });
            }
        }
        for notch in &piece.notches {
            let heights = notch.ends.map(|at| plane.height(&at));
            let at = notch.ends[0].lerp(&notch.ends[1], heights[0] / (heights[0] - heights[1]));
            let ends = match heights.map(|height| height < -self.near) {
                [true, true] => notch.ends,
                [false, false] => continue,
                [true, false] => [notch.ends[0], if heights[1] > 0.0 { at } else { notch.ends[1] }],
                [false, true] => [if heights[0] > 0.0 { at } else { notch.ends[0] }, notch.ends[1]],
            };
            half.notches.push(Notch { ends, ..notch.clone() });
        }
        half.enclosed = piece.enclosed.iter().filter(|at| plane.height(at) <= self.near).copied().collect();
        self.corners(&piece.planes, plane, &mut half.enclosed);
        half.planes.clone_from(&piece.planes);
        half.planes.push(*plane);
        half
    }

    /// Corners of hulls that have a volume, those that are convex together as one.
    fn joined(&self, pieces: &[Piece]) -> Result<Vec<Vec<Vec3>>, ShapeError> {
        let mut hulls: Vec<(Vec<Vec3>, f64)> = Vec::new();
        for piece in pieces.iter().filter(|piece| piece.volume > 0.0) {
            hulls.push((self.hull_corners(&piece.content())?, piece.volume));
        }
        let mut n = 0;
        while n < hulls.len() {
            let together = (0..hulls.len()).filter(|&k| k != n).find_map(|k| {
                let ((one, first), (other, second)) = (&hulls[n], &hulls[k]);
                let [a, b] = [one, other].map(|points| bounding_box(points.iter().copied()));
                let apart =
                    (0..3).any(|axis| a.0[axis] > b.1[axis] + self.near || b.0[axis] > a.1[axis] + self.near);
                if apart {
                    return None;
                }
                let points: Vec<Vec3> = one.iter().chain(other).copied().collect();
                let volume = self.hull_volume(&points);
                (volume <= first + second + JOINED * self.volume).then_some((k, points, volume))
            });
            match together {
                Some((k, points, volume)) => {
                    hulls[n] = (self.hull_corners(&points)?, volume);
                    hulls.remove(k);
                    n = if k < n { n - 1 } else { n };
                }
                None => n += 1,
            }
        }
        Ok(hulls.into_iter().map(|(points, _)| points).collect())
    }

    /// Corners of the hull of points.
    fn hull_corners(&self, points: &[Vec3]) -> Result<Vec<Vec3>, ShapeError> {
        let (body, placement) = Polyhedron::hull(points, self.tolerance(points))?;
        Ok(body.vertices.iter().map(|&at| placement.centre + placement.rotation * at).collect())
    }
}

impl Piece {
    /// Points of which the hull is that of the piece.
    fn content(&self) -> Vec<Vec3> {
        self.points.iter().chain(&self.enclosed).copied().collect()
    }
}
