//! Contacts with walls, and the films there.
//!
//! A contact with a mesh is known by a facet. Once it has left one it continues at the nearest of those that it has come to, with what its law
//! remembers: friction does not end at a seam.

use super::clearances::Clearances;
use super::context::{ContactContext, PartConstants, with_pull};
use super::failures::{behind_wall, is_too_deep, too_deep};
use super::films::{Acting, Films};
use super::forces::{ContactForces, ContactInput, PairEntry};
use super::order::PartIndex;
use super::velocities::KnownVelocities;
use crate::contact::mesh::{self, MeshContact};
use crate::contact::{CohesionLaw, ContactModel, ElasticLaw, Overlap, PairLaw, PairProperties, overlap_wall};
use crate::dem::{ContactKey, ContactState};
use crate::error::Result;
use crate::math::Vec3;
use crate::wall::{PlacedMesh, Surface, Wall};

/// Cosine of the angle between facets up to which a contact continues from one to the other.
const CONTINUES: f64 = 0.5;

/// A wall at one time.
struct Standing<'a> {
    wall: &'a Wall,
    surface: Surface,
    /// Stand-in for its id in the keys of contacts.
    second: u64,
    /// Time, half the sub-step before, and the sub-step (s).
    times: [f64; 3],
}

/// The neck of a sphere and a wall, at a distance (m) from its centre along a normal.
fn wall_neck(part: &PartConstants, (distance, normal): (f64, Vec3), law: &PairLaw) -> Option<Overlap> {
    let radius = part.shape.sphere().filter(|_| law.cohesion.has_neck())?;
    let depth = radius - distance;
    (depth >= -law.cohesion.stretch(radius)).then(|| Overlap::neck(normal * distance, normal, depth))
}

/// Of contacts known by facets the ones of the sub-step before that continue as others: for each of `found` one of `before`, if it is not one of them.
fn followed(
    placed: &PlacedMesh,
    (found, centre, reach): (&[MeshContact], Vec3, f64),
    before: &[u32],
) -> Vec<Option<u32>> {
    let is_found = |facet: &u32| found.iter().any(|contact| contact.facet == *facet);
    let mut left: Vec<u32> = before.iter().copied().filter(|facet| !is_found(facet)).collect();
    let normal = |facet: u32| placed.mesh.facets()[facet as usize].normal;
    let closed = placed.mesh.is_closed();
    let follows = |contact: &MeshContact| {
        let is_new = !before.contains(&contact.facet);
        let at = placed.to_own(&(centre + contact.overlap.point));
        let (index, _) = (left.iter().enumerate())
            .filter(|_| is_new)
            .filter_map(|(index, &facet)| {
                let cosine = normal(facet).dot(&normal(contact.facet));
                let square = placed.mesh.nearest_on(facet, &at).square;
                let cosine = if closed { cosine } else { cosine.abs() };
                (cosine > CONTINUES && square < reach * reach).then_some((index, square))
            })
            .min_by(|a, b| a.1.total_cmp(&b.1))?;
        Some(left.remove(index))
    };
    found.iter().map(follows).collect()
}

impl ContactContext {
    /// Contacts of the owned particles with walls, with sub-steps of `dt` (s), and the films there.
    pub(super) fn walls(
        &self,
        model: &ContactModel,
        dt: f64,
        films: &Films,
        clearances: &mut Clearances,
        (forces, velocities): (&mut ContactForces, &mut KnownVelocities),
    ) -> Result<()> {
        if self.params.walls.is_empty() {
            return Ok(());
        }
        let time = self.substep as f64 * dt;
        let half = if self.substep > 0 { 0.5 * dt } else { 0.0 };
        let walls: Vec<Standing> = (self.params.walls.iter().enumerate())
            .map(|(at, wall)| Standing {
                wall,
                surface: wall.surface_at(time),
                second: ContactState::of_wall(at),
                times: [time, half, dt],
            })
            .collect();
        let (store, near) = (&self.local.store, &self.near);
        let domain = near.decomposition().domain;
        let has_necks = model.cohesion == CohesionLaw::Jkr;
        let mut outcome = Ok(());
        let mut found = Vec::new();
        for (number, index) in self.owned_parts().enumerate() {
            let (i, (particle, of_part)) = (index.particle as usize, self.part(index));
            let arm = of_part.arm(particle);
            let centre = arm.map_or(particle.position(), |arm| particle.position() + arm);
            let constants = self.constants(particle);
            // Ids of walls fall with their index.
            for (wall_number, standing) in walls.iter().enumerate().rev() {
                let Standing { wall, surface, second, .. } = standing;
                if let Surface::Mesh(placed) = surface {
                    let (own, of) = (placed.to_own(&centre), (particle.id, index.part));
                    let reach = of_part.shape.reach();
                    let place = (number, of);
                    let near = clearances.facets((wall_number, &placed.mesh), place, &own, reach);
                    if near.is_empty() {
                        continue;
                    }
                    let at_mesh = self.at_mesh(
                        model,
                        (index, centre),
                        (standing, placed),
                        (near, &mut found),
                        (forces, velocities),
                    );
                    outcome = outcome.and(at_mesh);
                    continue;
                }
                let distance = surface.distance(centre);
                let radius = of_part.circumradius;
                if distance >= of_part.near_wall {
                    continue;
                }
                if distance < -radius {
                    outcome = outcome
                        .and_then(|()| Err(behind_wall(self.substep, particle, wall, distance, radius)));
                    continue;
                }
                let key = ContactKey { first: particle.id, second: *second, parts: [index.part, 0] };
                let film = self.at_wall(model, index, (wall, surface, time), films);
                let body = of_part.body(particle);
                let overlap = overlap_wall(model.geometry, &body, &surface.seen_from(centre))
                    .or_else(|| {
                        let at = || (distance, -surface.normal(centre));
                        let law = || self.wall_law(model, index, wall);
                        let neck = has_necks.then(|| wall_neck(of_part, at(), law())).flatten();
                        neck.filter(|_| forces.history.knows(&key))
                    })
                    .filter(|_| !constants.motion.is_complete());
                let Some(overlap) = overlap else {
                    let radius = of_part.shape.sphere().filter(|_| !constants.motion.is_complete());
                    let gap = |_| (-surface.normal(centre), distance - radius.unwrap_or_default());
                    let acting = with_pull(film, model, [radius, Some(f64::INFINITY)], [arm, None], gap);
                    if let Some(Acting { action, normal, lever }) = acting {
                        let point = domain.wrap(particle.position() + lever);
                        let touched = [Some(i), None];
                        forces.add(&PairEntry::apart(key, touched, (point, normal), action), near, store);
                    }
                    continue;
                };
                let touches = (key, None, overlap, film);
                let acted = self.touch_wall(model, (index, centre), standing, touches, (forces, velocities));
                outcome = outcome.and(acted);
            }
        }
        outcome
    }

    /// The law of a particle and a wall.
    fn wall_law(&self, model: &ContactModel, index: PartIndex, wall: &Wall) -> &PairLaw {
        &self.laws[self.material(self.part(index).0) * model.materials.len() + wall.material]
    }

    /// Contacts of a part of a particle with a mesh.
    fn at_mesh(
        &self,
        model: &ContactModel,
        (index, centre): (PartIndex, Vec3),
        (standing, placed): (&Standing, &PlacedMesh),
        (near, found): (&[u32], &mut Vec<MeshContact>),
        (forces, velocities): (&mut ContactForces, &mut KnownVelocities),
    ) -> Result<()> {
        let (particle, of_part) = self.part(index);
        let body = of_part.body(particle);
        let behind = mesh::contacts(model.geometry, &body, (placed, centre), near, found);
        let own = placed.to_own(&centre);
        if behind && found.is_empty() && placed.mesh.is_wall(&own) {
            let (distance, radius) = (placed.mesh.distance(&own), of_part.circumradius);
            return Err(behind_wall(self.substep, particle, standing.wall, distance, radius));
        }
        if found.is_empty() || self.constants(particle).motion.is_complete() {
            return Ok(());
        }
        let key =
            |facet| ContactKey { first: particle.id, second: standing.second, parts: [index.part, facet] };
        let before: Vec<u32> = forces.history.alike(&key(0)).map(|key| key.parts[1]).collect();
        let followed = followed(placed, (found, centre, of_part.circumradius), &before);
        let mut outcome = Ok(());
        for (contact, from) in found.iter().zip(followed) {
            let touches = (key(contact.facet), from.map(key), contact.overlap, None);
            outcome =
                outcome.and(self.touch_wall(model, (index, centre), standing, touches, (forces, velocities)));
        }
        outcome
    }

    /// Force of a contact of a part, whose centre is at `centre` (m), with a wall: its key, the one that it had, the overlap seen from the centre, and the
    /// film besides.
    fn touch_wall(
        &self,
        model: &ContactModel,
        (index, centre): (PartIndex, Vec3),
        standing: &Standing,
        (key, from, mut overlap, film): (ContactKey, Option<ContactKey>, Overlap, Option<Acting>),
        (forces, velocities): (&mut ContactForces, &mut KnownVelocities),
    ) -> Result<()> {
        let Standing { wall, times: [time, half, dt], .. } = *standing;
        let (i, (particle, of_part)) = (index.particle as usize, self.part(index));
        let arm = of_part.arm(particle);
        let domain = self.near.decomposition().domain;
        let law = self.wall_law(model, index, wall);
        if let (ElasticLaw::Hertz, Some(radius)) = (law.elastic, of_part.shape.sphere()) {
            // In the middle of the depth, as between spheres: that of the overlap is a sixth of the depth further in.
            overlap.point = overlap.normal * (radius - 0.5 * overlap.depth);
        }
        let point = centre + overlap.point;
        let overlap = arm.map_or(overlap, |arm| overlap.seen_from(arm));
        let part = self.share(index, overlap.point, &overlap);
        let input = ContactInput {
            key,
            from,
            indices: [Some(i), None],
            law,
            overlap: &overlap,
            offset: Vec3::zeros(),
            properties: PairProperties {
                radii: [of_part.radius, f64::INFINITY],
                masses: [self.constants(particle).inertia.mass, f64::INFINITY],
                dt,
            },
            motion: self.relative(
                [
                    velocities.of(i, || self.velocities(i, dt)).at(&overlap.point, law),
                    [
                        wall.velocity(point, time),
                        wall.velocity(point, time - half),
                        wall.motion.angular_velocity.at(time - half),
                    ],
                ],
                dt,
            ),
            point: domain.wrap(point),
        };
        let entry = forces.evaluate(&input).part(part);
        if let (Some(facets), Some(number)) = (&mut forces.facets, ContactState::wall_of(key.second)) {
            let of_contact = [-entry.action.force, entry.normal, input.motion.velocity];
            facets.add((number, key.parts[1]), of_contact, dt);
        }
        let entry = film.map_or(entry, |film| entry.with(&film.action));
        forces.add(&entry, &self.near, &self.local.store);
        if is_too_deep(overlap.depth, of_part.thickness) {
            let partner = format_args!("wall `{}`", wall.name);
            return Err(too_deep(self.substep, particle, partner, overlap.depth, of_part.thickness));
        }
        Ok(())
    }
}
