//! Particles that overlap each other or a wall where the case puts them.

use super::{Placed, Placer};
use crate::contact::{Body, Geometry, GrownShape, overlap, overlap_wall};
use crate::error::Result;
use crate::math::Vec3;
use crate::packing::close_pairs;
use crate::particle::Particle;
use crate::wall::Surface;
use std::fmt::Write;

/// Overlaps that are named; the others are counted.
const NAMED: usize = 3;
/// Depth of an overlap in parts of the particle: touching is allowed, and rounding must not make it an overlap.
const ROUNDING: f64 = 1e-9;
/// The same for particles of the state of a run, whose contacts overlap.
const CONTACT: f64 = 0.1;

/// Depth in parts of the particle up to which an overlap is none.
fn allowed(of_a_run: bool) -> f64 {
    if of_a_run { CONTACT } else { ROUNDING }
}

/// Overlapping particles, by their places in the list, and what they do.
struct Found {
    pair: (usize, usize),
    what: String,
}

impl Placer<'_> {
    /// Refuses particles that overlap each other.
    pub(super) fn refuse_overlaps(&self, placed: &[Placed]) -> Result<()> {
        if placed.is_empty() {
            return Ok(());
        }
        let positions: Vec<Vec3> = placed.iter().map(|p| p.particle.position()).collect();
        let radius = |i: usize| self.template(&placed[i].particle).shape.circumradius();
        let reaches: Vec<f64> = (0..placed.len()).map(|i| radius(i) * (1.0 - 1e-12)).collect();
        let contours = self.contours();
        let mut found = Vec::new();
        let mut count = 0;
        for pair in close_pairs(&self.domain, &positions, &reaches) {
            let (a, b) = pair;
            let offset = self.domain.nearest_image(positions[b] - positions[a]);
            let [first, second] = [a, b].map(|i| body(&contours, &placed[i].particle));
            let spheres = [&first, &second].map(|body| body.grown.shape.as_sphere());
            let most = allowed(placed[a].in_motion && placed[b].in_motion) * radius(a).min(radius(b));
            let what = if let [Some(_), Some(_)] = spheres {
                if radius(a) + radius(b) - offset.norm() <= most {
                    continue;
                }
                format!(
                    "centres {:.6e} m apart{}, surfaces touch at {:.6e} m",
                    offset.norm(),
                    through_faces(offset, positions[b] - positions[a]),
                    radius(a) + radius(b)
                )
            } else {
                let Some(overlap) = overlap(Geometry::Exact, &first, &second, offset) else {
                    continue;
                };
                if overlap.depth <= most {
                    continue;
                }
                format!(
                    "overlap {:.6e} m deep{}, centres {:.6e} m apart",
                    overlap.depth,
                    through_faces(offset, positions[b] - positions[a]),
                    offset.norm()
                )
            };
            count += 1;
            if found.len() < NAMED {
                found.push(Found { pair, what });
            }
        }
        let Some(&Found { pair: (first, second), .. }) = found.first() else {
            return Ok(());
        };
        let mut list = String::new();
        for Found { pair: (a, b), what } in &found {
            let names = [*a, *b].map(|i| name(&placed[i]));
            write!(list, "\nparticles {} and {}: {what}", names[0], names[1])
                .expect("a string can always grow");
        }
        if count > found.len() {
            write!(list, "\nand {} more", count - found.len()).expect("a string can always grow");
        }
        let pairs = if count == 1 { "pair" } else { "pairs" };
        let title = format!("{count} {pairs} of particles overlap at the start");
        let spans = [&placed[first].span, &placed[second].span];
        let places = [(spans[0], "one of them"), (spans[1], "the other")];
        let places = if spans[0] == spans[1] { &[(spans[0], "from here")][..] } else { &places[..] };
        Err(self.source.error_at(places, &title, &format!("move them apart or take smaller ones:{list}")))
    }

    /// Refuses particles that overlap a wall.
    pub(super) fn refuse_overlaps_with_walls(&self, placed: &[Placed]) -> Result<()> {
        if placed.is_empty() {
            return Ok(());
        }
        let contours = self.contours();
        let mut first = None;
        let (mut list, mut count) = (String::new(), 0);
        for (i, p) in placed.iter().enumerate() {
            let body = body(&contours, &p.particle);
            for wall in self.walls {
                let most = allowed(p.in_motion) * body.grown.shape.circumradius();
                let Some(depth) =
                    depth_in(&wall.wall.surface, &body, p.particle.position()).filter(|depth| *depth > most)
                else {
                    continue;
                };
                count += 1;
                first.get_or_insert(i);
                if count <= NAMED {
                    let name = name(p);
                    let wall = &wall.wall.name;
                    write!(list, "\nparticle {name}: {depth:.6e} m deep in the wall \"{wall}\"")
                        .expect("a string can always grow");
                }
            }
        }
        let Some(first) = first else {
            return Ok(());
        };
        if count > NAMED {
            write!(list, "\nand {} more", count - NAMED).expect("a string can always grow");
        }
        let particles = if count == 1 { "particle overlaps" } else { "particles overlap" };
        let title = format!("{count} {particles} a wall at the start");
        let remedy = format!("move them into the free space:{list}");
        Err(self.source.error(&placed[first].span, &title, "from here", &remedy))
    }

    /// The shapes as they are, for each template.
    fn contours(&self) -> Vec<GrownShape> {
        let templates = &self.kinds.templates;
        (templates.iter()).map(|template| GrownShape::new(template.shape.clone(), 0.0)).collect()
    }
}

fn body<'a>(contours: &'a [GrownShape], particle: &Particle) -> Body<'a> {
    Body { grown: &contours[particle.template as usize], orientation: particle.orientation() }
}

fn name(placed: &Placed) -> String {
    let id = placed.particle.id;
    match &placed.line {
        Some(line) => format!("{id} ({line})"),
        None => id.to_string(),
    }
}

fn through_faces(nearest: Vec3, direct: Vec3) -> &'static str {
    if nearest == direct { "" } else { ", through the periodic faces" }
}

/// How deep a body is in a wall (m), if it is.
fn depth_in(surface: &Surface, body: &Body, position: Vec3) -> Option<f64> {
    let shape = &body.grown.shape;
    let radius = shape.circumradius();
    let clearance = surface.distance(position);
    if clearance >= radius {
        return None;
    }
    let depth = match surface {
        Surface::Plane { normal, .. } => {
            let towards = body.orientation.inverse_transform_vector(&-normal);
            shape.support(towards).dot(&towards) - clearance
        }
        Surface::Cylinder { .. } if clearance <= 0.0 => radius - clearance,
        Surface::Cylinder { .. } => overlap_wall(Geometry::Exact, body, &surface.seen_from(position))?.depth,
    };
    (depth > 0.0).then_some(depth)
}
