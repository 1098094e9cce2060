//! Bodies that are neither spheres nor polyhedra, and any that is sampled, at a mesh.
//!
//! A body touches the interior of a facet if its furthest point into the wall has its foot there. On an edge its signed distance is a
//! convex function, whose minimum is found by a golden section search; there the gradient is the normal.

use super::super::overlap::{Body, Overlap};
use super::super::{Geometry, sampled};
use super::Place;
use crate::math::Vec3;
use crate::wall::mesh::{Feature, NearestPoint};
use crate::wall::{PlacedMesh, Surface};

/// Steps of the golden section search: 1e-8 of the edge.
const STEPS: usize = 38;
const GOLDEN: f64 = 0.618_033_988_749_894_9;
/// Parts of an edge that count as its end.
const END: f64 = 1e-6;

/// Overlap with everything behind a plane with the normal `away`, at a distance `height` (m) from the centre of the body.
pub(super) fn at_plane(geometry: Geometry, body: &Body, away: Vec3, height: f64) -> Option<Overlap> {
    let samples = match geometry {
        Geometry::Sampled { samples } => samples,
        Geometry::Exact => sampled::DEFAULT_SAMPLES,
    };
    let surface = Surface::Plane { point: away * -height, normal: away };
    sampled::overlap_wall(body, &surface, samples)
}

/// Places at which a body may touch facets, whose points nearest to its centre are given.
pub(super) fn places(
    body: &Body,
    (wall, own): (&PlacedMesh, Vec3),
    (points, sides): (&[NearestPoint], &[f64]),
    places: &mut Vec<Place>,
) {
    let mesh = &wall.mesh;
    let (shape, growth) = (&body.grown.shape, body.grown.enlargement);
    let turn = wall.orientation.inverse() * body.orientation;
    for (&NearestPoint { facet, .. }, &side) in points.iter().zip(sides) {
        let corners = mesh.corners(facet);
        let away = mesh.facets()[facet as usize].normal * side;
        let height = away.dot(&(own - corners[0]));
        if away == Vec3::zeros() || height < 0.0 {
            // Of a closed mesh known as one that looks away.
            if mesh.is_closed() {
                places.push(Place {
                    facet,
                    feature: Feature::Face,
                    away: -away,
                    rank: f64::INFINITY,
                    height,
                });
            }
            continue;
        }
        let lowest = own + turn * shape.support(turn.inverse_transform_vector(&-away)) - away * growth;
        let depth = -away.dot(&(lowest - corners[0]));
        if depth <= 0.0 {
            continue;
        }
        let foot = mesh.nearest_on(facet, &(lowest + away * depth));
        if foot.feature == Feature::Face || foot.square <= END * END * depth * depth {
            places.push(Place { facet, feature: Feature::Face, away, rank: -depth, height });
            continue;
        }
        let distance = |at: &Vec3| shape.signed_distance(turn.inverse_transform_vector(&(at - own))) - growth;
        let (mut deepest, mut at, mut feature) = (0.0, Vec3::zeros(), Feature::Face);
        for k in 0..3 {
            let [from, to] = [corners[k], corners[(k + 1) % 3]];
            let part = least(|part| distance(&from.lerp(&to, part)));
            let (part, own) = match part {
                part if part < END => (0.0, Feature::Vertex(k)),
                part if part > 1.0 - END => (1.0, Feature::Vertex((k + 1) % 3)),
                part => (part, Feature::Edge(k)),
            };
            let point = from.lerp(&to, part);
            let found = distance(&point);
            if found < deepest {
                (deepest, at, feature) = (found, point, own);
            }
        }
        if deepest < 0.0 {
            let gradient = turn * shape.gradient(turn.inverse_transform_vector(&(at - own)));
            let height = gradient.dot(&(at - own));
            places.push(Place { facet, feature, away: -gradient, rank: deepest, height });
        }
    }
}

/// The part of the way from 0 to 1 at which a convex function is least.
fn least(of: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    let mut inner = [1.0 - GOLDEN, GOLDEN];
    let mut values = inner.map(&of);
    for _ in 0..STEPS {
        if values[0] <= values[1] {
            high = inner[1];
            inner = [high - GOLDEN * (high - low), inner[0]];
            values = [of(inner[0]), values[0]];
        } else {
            low = inner[0];
            inner = [inner[1], low + GOLDEN * (high - low)];
            values = [values[1], of(inner[1])];
        }
    }
    0.5 * (low + high)
}
