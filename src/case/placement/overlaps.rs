//! Particles that overlap each other or a wall at the start.

use super::{Candidate, Placer};
use crate::contact::{Body, Geometry, GrownShape, PairFinder, overlap, overlap_wall};
use crate::error::Result;
use crate::math::Vec3;
use crate::packing::relax::TOUCHING;
use crate::particle::Particle;
use crate::wall::Surface;

/// Overlaps that are named; the others are counted.
const NAMED: usize = 3;
/// Depth of an overlap in radii of the particle up to which particles of the state of a run may overlap, as contacts do; others may
/// [touch](TOUCHING).
const CONTACT: f64 = 0.1;

/// Depth in radii of the particle up to which an overlap is allowed.
fn allowed(of_a_run: bool) -> f64 {
    if of_a_run { CONTACT } else { TOUCHING }
}

/// The first overlaps in words, one per line, and the number of all.
#[derive(Default)]
struct Overlaps {
    list: String,
    count: usize,
}

impl Overlaps {
    fn add(&mut self, line: impl FnOnce() -> String) {
        self.count += 1;
        if self.count <= NAMED {
            self.list += "\n";
            self.list += &line();
        }
    }

    fn list(self) -> String {
        match self.count.saturating_sub(NAMED) {
            0 => self.list,
            more => format!("{}\nand {more} more", self.list),
        }
    }
}

impl Placer<'_> {
    /// Refuses particles that overlap each other or a wall, or miss the gap that relaxed ones keep. Bodies whose whole motion is prescribed
    /// may overlap; returns true if they do.
    pub(super) fn refuse_overlaps(&self, placed: &[Candidate]) -> Result<bool> {
        if placed.is_empty() {
            return Ok(false);
        }
        let contours = self.relaxed_contours();
        let pairs = self.refuse_pairs(placed, &contours)?;
        Ok(self.refuse_in_walls(placed, &contours)? || pairs)
    }

    fn refuse_pairs(&self, placed: &[Candidate], contours: &[GrownShape]) -> Result<bool> {
        let positions: Vec<Vec3> = placed.iter().map(|p| p.particle.position()).collect();
        let grown = |i: usize| &contours[placed[i].particle.template as usize];
        let radius = |i: usize| grown(i).shape.circumradius() + grown(i).enlargement;
        let reaches: Vec<f64> = (0..placed.len()).map(|i| radius(i) * (1.0 - 1e-12)).collect();
        let (mut first, mut overlaps, mut accepted) = (None, Overlaps::default(), false);
        for ([a, b], offset) in self.near(&positions, &reaches) {
            let direct = positions[b] - positions[a];
            let bodies = [a, b].map(|i| body(contours, &placed[i].particle));
            let most = allowed(placed[a].in_motion && placed[b].in_motion) * radius(a).min(radius(b));
            let spheres = are_spheres(&bodies);
            let depth = depth_of(&bodies, offset);
            if depth <= most {
                continue;
            }
            if self.is_prescribed(&placed[a].particle) && self.is_prescribed(&placed[b].particle) {
                accepted = true;
                continue;
            }
            first.get_or_insert((a, b));
            overlaps.add(|| {
                let [one, other] = [a, b].map(|i| name(&placed[i]));
                let (apart, touch) = (offset.norm(), radius(a) + radius(b));
                let through = if offset == direct { "" } else { ", through the periodic faces" };
                let what = if spheres {
                    format!("centres {apart:.6e} m apart{through}, surfaces touch at {touch:.6e} m")
                } else {
                    format!("overlap {depth:.6e} m deep{through}, centres {apart:.6e} m apart")
                };
                let included = match grown(a).enlargement + grown(b).enlargement {
                    gap if gap > 0.0 => format!(", a gap of {gap:.6e} m included"),
                    _ => String::new(),
                };
                format!("particles {one} and {other}: {what}{included}")
            });
        }
        let Some((a, b)) = first else {
            return Ok(accepted);
        };
        let pairs = if overlaps.count == 1 { "pair" } else { "pairs" };
        let title = format!("{} {pairs} of particles overlap at the start", overlaps.count);
        let remedy = self.remedy("move them apart or take smaller ones", [&placed[a], &placed[b]]);
        let remedy = format!("{remedy}:{}", overlaps.list());
        let (a, b) = (&*placed[a].key, &*placed[b].key);
        let marks = [(a, "one of them"), (b, "the other")];
        let marks = if a == b { &[(a, "from here")][..] } else { &marks[..] };
        Err(self.document.error_at(marks, &title, &remedy))
    }

    /// Warns of surfaces that overlap only as they are grown for contacts, by more than half of what they are grown by: a packing was
    /// made with another enlargement, and its particles would be thrown apart.
    pub(super) fn grown_overlaps(&self, placed: &[Candidate]) -> Option<String> {
        let gap = self.enlargement;
        let contours = self.contours(vec![2.0 * gap; self.kinds.templates.len()]);
        let positions: Vec<Vec3> = placed.iter().map(|p| p.particle.position()).collect();
        let bodies: Vec<Body> = placed.iter().map(|p| body(&contours, &p.particle)).collect();
        let reaches: Vec<f64> = bodies.iter().map(|body| body.grown.shape.circumradius() + gap).collect();
        let pairs = if gap > 0.0 { self.near(&positions, &reaches) } else { Vec::new() };
        // Two bodies whose whole motion is prescribed exert no force on each other.
        let moves = |i: usize| !self.is_prescribed(&placed[i].particle);
        let depths = (pairs.into_iter())
            .filter(|&([a, b], _)| moves(a) || moves(b))
            .map(|([a, b], offset)| depth_of(&[bodies[a], bodies[b]], offset));
        let deep: Vec<f64> = depths.filter(|depth| *depth > gap).collect();
        let deepest = deep.iter().copied().reduce(f64::max)?;
        let title = format!(
            "{} pairs of particles touch too closely for surfaces that are grown for contacts",
            deep.len()
        );
        let label = format!("up to {deepest:.3e} m deep, surfaces are grown by {gap:.3e} m each");
        let remedy = format!(
            "they will be pushed apart at the start: make a dry packing with `dry.enlargement = {gap:.6e}`, or set \
             `contact.enlargement` to the value that the packing was made with"
        );
        Some(self.document.warning(&placed[0].key, &title, &label, &remedy))
    }

    /// Pairs whose bounding spheres meet, each with the offset of an image of the second body from the first (m).
    fn near(&self, positions: &[Vec3], radii: &[f64]) -> Vec<([usize; 2], Vec3)> {
        let mut finder = PairFinder::new(self.domain);
        let pairs = finder.find(positions, radii).iter().map(|pair| pair.map(|i| i as usize));
        pairs
            .flat_map(|[a, b]| {
                let images = self.domain.images(positions[b] - positions[a], radii[a] + radii[b]);
                images.map(move |offset| ([a, b], offset))
            })
            .collect()
    }

    fn refuse_in_walls(&self, placed: &[Candidate], contours: &[GrownShape]) -> Result<bool> {
        let (mut first, mut overlaps, mut deepest, mut accepted) = (None, Overlaps::default(), 0.0, false);
        for p in placed {
            let body = body(contours, &p.particle);
            let most = allowed(p.in_motion) * body.grown.shape.circumradius();
            for wall in self.walls {
                let depth = depth_in(&wall.wall.surface, &body, p.particle.position());
                if let Some(depth) = depth.filter(|depth| *depth > most) {
                    let clearance = wall.wall.surface.distance(p.particle.position());
                    if self.is_prescribed(&p.particle) && clearance >= -body.grown.shape.circumradius() {
                        accepted = true;
                        continue;
                    }
                    first.get_or_insert(p);
                    deepest = depth.max(deepest);
                    let wall = &wall.wall.name;
                    overlaps
                        .add(|| format!("particle {}: {depth:.6e} m deep in the wall \"{wall}\"", name(p)));
                }
            }
        }
        let Some(first) = first else {
            return Ok(accepted);
        };
        let particles = if overlaps.count == 1 { "particle overlaps" } else { "particles overlap" };
        let title = format!("{} {particles} a wall at the start", overlaps.count);
        let by_hand = format!(
            "move them into the free space, or make the box longer there by {deepest:.3e} m (`domain.size`)"
        );
        let remedy = self.remedy(&by_hand, [first, first]);
        let remedy = format!("{remedy}:{}", overlaps.list());
        Err(self.document.error(&first.key, &title, "from here", &remedy))
    }

    /// Remedies for particles that overlap: by hand, or by relaxing them.
    fn remedy(&self, by_hand: &str, particles: [&Candidate; 2]) -> String {
        let limits = particles.map(|placed| self.relax_limit(placed.particle.template as usize));
        match limits.into_iter().flatten().reduce(f64::max) {
            None => format!("set `overlaps = \"relax\"`, {by_hand}"),
            Some(limit) => format!(
                "relaxing them by up to {limit:.3e} m did not suffice: raise `relax_distance`, {by_hand}"
            ),
        }
    }
}

fn are_spheres(bodies: &[Body; 2]) -> bool {
    bodies.iter().all(|body| body.grown.shape.as_sphere().is_some())
}

/// Depth of the overlap of two bodies (m), the second at an offset from the first; negative for spheres apart, else 0.
fn depth_of(bodies: &[Body; 2], offset: Vec3) -> f64 {
    let [one, other] = bodies;
    if are_spheres(bodies) {
        let reach = |body: &Body| body.grown.shape.circumradius() + body.grown.enlargement;
        return reach(one) + reach(other) - offset.norm();
    }
    overlap(Geometry::Exact, one, other, offset).map_or(0.0, |overlap| overlap.depth)
}

fn body<'a>(contours: &'a [GrownShape], particle: &Particle) -> Body<'a> {
    Body { grown: &contours[particle.template as usize], orientation: particle.orientation() }
}

fn name(placed: &Candidate) -> String {
    let id = placed.particle.id;
    placed.line.as_ref().map_or_else(|| id.to_string(), |line| format!("{id} ({line})"))
}

/// Depth of a body in a wall (m), if it overlaps it.
fn depth_in(surface: &Surface, body: &Body, position: Vec3) -> Option<f64> {
    let shape = &body.grown.shape;
    let gap = body.grown.enlargement;
    let radius = shape.circumradius() + gap;
    let clearance = surface.distance(position);
    if clearance >= radius {
        return None;
    }
    let depth = match surface {
        Surface::Plane { normal, .. } => {
            let towards = body.orientation.inverse_transform_vector(&-normal);
            shape.support(towards).dot(&towards) + gap - clearance
        }
        // The centre of a body of several parts may lie outside of it.
        _ if clearance <= 0.0 && shape.parts().is_empty() => radius - clearance,
        _ => overlap_wall(Geometry::Exact, body, &surface.seen_from(position))?.depth,
    };
    (depth > 0.0).then_some(depth)
}
