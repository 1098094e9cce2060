//! Vessels from meshes that are surfaces of revolution, for `mesh_walls`, `hopper` and `drum`, and spheres to fill them.

use super::prelude::*;
use std::f64::consts::TAU;
use std::sync::Arc;
use turbid::math::Quat;
use turbid::wall::{FreeSide, Motion, PlacedMesh, Surface, Wall, WallMesh};

/// Distances (-) from the point of a grid along each axis, up to a fortieth, of the n-th sphere, from one: not at random, but unlike those of
/// its neighbours.
pub(super) fn jitter(n: f64) -> [f64; 3] {
    // Fractional parts of multiples of square roots of primes.
    [0.414_213_562, 0.732_050_808, 0.236_067_977].map(|step: f64| 0.05 * ((n * step).fract() - 0.5))
}

/// The surface of `strips` flat strips round an axis, through rings of a radius at a height along it (m) in their order; a first or last radius
/// of zero closes it. `place` gives the position of a point by its two coordinates across the axis and its height.
///
/// # Panics
/// If it is not closed, but `free` needs an inside.
pub(super) fn turned(
    profile: &[[f64; 2]],
    strips: u32,
    free: Option<FreeSide>,
    place: impl Fn(f64, f64, f64) -> Vec3,
) -> WallMesh {
    let at = |k: u32, [radius, height]: [f64; 2]| {
        let angle = TAU * f64::from(k) / f64::from(strips);
        place(radius * angle.cos(), radius * angle.sin(), height)
    };
    let rings: Vec<[f64; 2]> = profile.iter().copied().filter(|ring| ring[0] > 0.0).collect();
    let mut vertices: Vec<Vec3> = rings
        .iter()
        .flat_map(|&ring| (0..strips).map(move |k| (k, ring)))
        .map(|(k, ring)| at(k, ring))
        .collect();
    let mut facets = Vec::new();
    for k in 0..strips {
        let next = (k + 1) % strips;
        for first in (0..rings.len() as u32 - 1).map(|ring| ring * strips) {
            let [a, b, c, d] = [first + k, first + next, first + strips + next, first + strips + k];
            facets.extend([[a, b, c], [a, c, d]]);
        }
    }
    for (end, first, tip) in
        [(0, 0, profile[0]), (1, (rings.len() as u32 - 1) * strips, profile[profile.len() - 1])]
    {
        if tip[0] > 0.0 {
            continue;
        }
        let middle = vertices.len() as u32;
        vertices.push(place(0.0, 0.0, tip[1]));
        facets.extend((0..strips).map(|k| {
            let [a, b] = [first + k, first + (k + 1) % strips];
            if end == 0 { [middle, b, a] } else { [middle, a, b] }
        }));
    }
    WallMesh::new(vertices, facets, free).expect("a mesh with the inside that it needs")
}

/// Adds a mesh, which moves in some way, to the walls of a case.
pub(super) fn add_mesh(setup: &mut Setup, name: &str, mesh: WallMesh, motion: Motion) {
    let placed = PlacedMesh { mesh: Arc::new(mesh), position: Vec3::zeros(), orientation: Quat::identity() };
    setup.walls.push(Wall { name: name.into(), surface: Surface::Mesh(placed), motion, material: 0 });
}
