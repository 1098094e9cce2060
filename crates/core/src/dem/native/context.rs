//! Contacts at one time: overlapping pairs and their relative velocities.

use super::NativeParams;
use super::failures::{behind_wall, is_too_deep, too_deep};
use super::films::Acting;
use super::forces::{ContactForces, ContactInput, PairEntry};
use crate::contact::lubrication::Rates;
use crate::contact::{
    Body, ContactModel, GrownShape, Neighbour, NeighbourList, PairLaw, PairProperties, overlap_again,
    overlap_wall,
};
use crate::dem::assign::GhostLayer;
use crate::dem::exchange::LocalParticles;
use crate::dem::integrator::Inertia;
use crate::dem::{ContactKey, ContactState, Load};
use crate::error::Result;
use crate::math::{Mat3, Vec3};
use crate::particle::{Particle, ParticleStore, PrescribedMotion};

/// The particles of this rank, ghosts included, ascending by id, and the pairs of neighbours. Keeps its buffers from
/// sub-step to sub-step.
#[derive(Clone, Debug)]
pub(super) struct IdOrder {
    list: NeighbourList,
    /// Indices of the particles.
    indices: Vec<u32>,
    /// Their positions (m).
    positions: Vec<Vec3>,
    /// Their bounding radii (m).
    radii: Vec<f64>,
    /// Their rotations, of body frame to world frame.
    rotations: Vec<Mat3>,
}

/// Bounding spheres that miss each other by less than this part of their distance are left to the exact test.
const SLACK: f64 = 1e-9;

impl IdOrder {
    pub(super) fn new(list: NeighbourList) -> Self {
        Self { list, indices: Vec::new(), positions: Vec::new(), radii: Vec::new(), rotations: Vec::new() }
    }

    /// The pairs of neighbours, and for each place in the order the index and the position (m) of its particle.
    pub(super) fn pairs(&mut self) -> (&[Neighbour], &[u32], &[Vec3]) {
        (self.list.find(&self.positions, &self.radii), &self.indices, &self.positions)
    }

    /// Sorts the particles by id.
    pub(super) fn sort(&mut self, store: &ParticleStore, templates: &[TemplateConstants]) {
        self.indices.clear();
        self.indices.extend(0..store.particles.len() as u32);
        // Owned particles, then ghosts, both ascending: a stable sort merges them.
        self.indices.sort_by_key(|&k| store.particles[k as usize].id);
        let particles = || self.indices.iter().map(|&k| &store.particles[k as usize]);
        self.positions.clear();
        self.positions.extend(particles().map(Particle::position));
        self.radii.clear();
        self.radii.extend(particles().map(|p| templates[p.template as usize].bound));
        self.rotations.clear();
        self.rotations.extend(particles().map(|p| p.orientation().to_rotation_matrix().into_inner()));
    }
}

/// Properties of a template that contacts need.
#[derive(Clone, Debug)]
pub(super) struct TemplateConstants {
    pub(super) shape: GrownShape,
    /// [`ContactModel::reach`] of the shape (m).
    pub(super) bound: f64,
    pub(super) inertia: Inertia,
    /// Radius of the sphere of equal volume plus enlargement (m).
    pub(super) radius: f64,
    /// Thickness of the shape (m).
    pub(super) thickness: f64,
    /// Prescribed part of its motion.
    pub(super) motion: PrescribedMotion,
}

/// Masses (kg) of the two bodies of a contact: infinite, and second, where forces do not move the centre of one of them.
fn masses(bodies: [&TemplateConstants; 2]) -> [f64; 2] {
    let [a, b] = bodies.map(|body| body.inertia.mass);
    match bodies.map(|body| body.motion.holds_centre()) {
        [true, false] => [b, f64::INFINITY],
        [false, true] => [a, f64::INFINITY],
        // Between two of them only a rotation can be free.
        _ => [a, b],
    }
}

/// Everything that contacts depend on.
#[derive(Clone, Debug)]
pub(super) struct ContactContext {
    pub(super) params: NativeParams,
    /// As those of the store.
    pub(super) templates: Vec<TemplateConstants>,
    /// By the materials of the pair, as [`ContactModel::pairs`].
    pub(super) laws: Vec<PairLaw>,
    pub(super) near: GhostLayer,
    pub(super) local: LocalParticles,
    /// Sub-steps since the start.
    pub(super) substep: u64,
    /// Loads of the previous sub-step by particle, if a law needs them.
    pub(super) past: Vec<Load>,
}

impl ContactContext {
    /// Constants of the template of a particle.
    pub(super) fn constants(&self, particle: &Particle) -> &TemplateConstants {
        &self.templates[particle.template as usize]
    }

    fn body(&self, particle: &Particle) -> Body<'_> {
        Body { grown: &self.constants(particle).shape, orientation: particle.orientation() }
    }

    /// Material of a particle.
    fn material(&self, particle: &Particle) -> usize {
        self.local.store.template(particle).material
    }

    /// Velocity (m/s) at a point of a particle, `lever` (m) from its centre, as a law needs it.
    ///
    /// A [law that lags](crate::contact::DampingLaw::lags) gets that of half a step before, `v - dt/2 (C + F + m g) / m`.
    fn velocity(&self, index: usize, lever: &Vec3, law: &PairLaw, dt: f64) -> Vec3 {
        let particle = &self.local.store.particles[index];
        let moved_by_forces = self.substep > 0 && self.constants(particle).motion.is_free();
        let past = self.past.get(index).filter(|_| moved_by_forces && law.damping.lags());
        let (velocity, spin) = match past {
            None => (particle.velocity(), particle.angular_velocity()),
            Some(past) => {
                let inertia = &self.constants(particle).inertia;
                let half = 0.5 * dt;
                let weight = self.params.gravity * inertia.mass;
                let force = Vec3::from(particle.contact_force) + (past.force + weight);
                let torque = Vec3::from(particle.contact_torque) + past.torque;
                let momentum = Vec3::from(particle.angular_momentum) - torque * half;
                (
                    particle.velocity() - force * (half / inertia.mass),
                    inertia.angular_velocity(&particle.orientation(), momentum),
                )
            }
        };
        velocity + spin.cross(lever)
    }

    /// Contacts of pairs of particles that this rank evaluates, in ascending order of their ids, with sub-steps of `dt`
    /// (s), and the films between them.
    pub(super) fn pairs(
        &self,
        model: &ContactModel,
        dt: f64,
        (order, rates): (&mut IdOrder, &[Rates]),
        forces: &mut ContactForces,
    ) -> Result<()> {
        let (store, near) = (&self.local.store, &self.near);
        let IdOrder { list, indices, positions, radii, rotations } = order;
        let domain = near.decomposition().domain;
        let mut outcome = Ok(());
        for neighbour in list.find(positions, radii) {
            let [p, q] = neighbour.pair.map(|k| k as usize);
            let (offset, reach) = (domain.nearest_image(positions[q] - positions[p]), radii[p] + radii[q]);
            if offset.norm_squared() > reach * reach * (1.0 + SLACK) {
                continue;
            }
            let [i, j] = [p, q].map(|k| indices[k] as usize);
            if near.evaluating_rank_of([i, j], store) != Some(near.rank) {
                continue;
            }
            let [a, b] = [i, j].map(|k| &store.particles[k]);
            let (bodies, turns) = ([&self.body(a), &self.body(b)], [&rotations[p], &rotations[q]]);
            let hint = &mut neighbour.hint;
            let film = self.between(model, [i, j], offset, (rates, dt));
            let key = ContactKey { first: a.id, second: b.id, parts: [0; 2] };
            let touched = [Some(i), Some(j)];
            let [first, second] = [a, b].map(|p| self.constants(p));
            let held = first.motion.is_complete() && second.motion.is_complete();
            let overlap =
                if held { None } else { overlap_again(model.geometry, bodies, turns, offset, hint) };
            let Some(overlap) = overlap else {
                if let Some(Acting { action, normal, lever }) = film {
                    let point = domain.wrap(a.position() + lever);
                    forces.add(&PairEntry::apart(key, touched, (point, normal), action), near, store);
                }
                continue;
            };
            let levers = [overlap.point, overlap.point - offset];
            let law = &self.laws[self.material(a) * model.materials.len() + self.material(b)];
            let input = ContactInput {
                key,
                indices: touched,
                law,
                overlap: &overlap,
                offset,
                properties: PairProperties {
                    radii: [first.radius, second.radius],
                    masses: masses([first, second]),
                    dt,
                },
                velocity: self.velocity(i, &levers[0], law, dt) - self.velocity(j, &levers[1], law, dt),
                point: domain.wrap(a.position() + overlap.point),
            };
            let entry = forces.evaluate(&input);
            let entry = film.map_or(entry, |film| entry.with(&film.action));
            forces.add(&entry, near, store);
            let thinner = first.thickness.min(second.thickness);
            if is_too_deep(overlap.depth, thinner) && outcome.is_ok() {
                let partner = format_args!("particle {}", b.id);
                outcome = Err(too_deep(self.substep, a, partner, overlap.depth, thinner));
            }
        }
        outcome
    }

    /// Contacts of the owned particles with walls, with sub-steps of `dt` (s), and the films there.
    pub(super) fn walls(
        &self,
        model: &ContactModel,
        dt: f64,
        rates: &[Rates],
        forces: &mut ContactForces,
    ) -> Result<()> {
        let time = self.substep as f64 * dt;
        let walls: Vec<_> = self.params.walls.iter().map(|wall| (wall, wall.surface_at(time))).collect();
        let (store, near) = (&self.local.store, &self.near);
        let domain = near.decomposition().domain;
        let range = model.lubrication.map_or(0.0, |lubrication| lubrication.range());
        let mut outcome = Ok(());
        for (i, particle) in store.owned().iter().enumerate() {
            let centre = particle.position();
            let constants = self.constants(particle);
            // Ids of walls fall with their index.
            for (index, (wall, surface)) in walls.iter().enumerate().rev() {
                let distance = surface.distance(centre);
                let radius = constants.shape.shape.circumradius();
                if distance >= constants.bound.max(radius + range) {
                    continue;
                }
                if distance < -radius {
                    outcome = outcome
                        .and_then(|()| Err(behind_wall(self.substep, particle, wall, distance, radius)));
                    continue;
                }
                let key =
                    ContactKey { first: particle.id, second: ContactState::of_wall(index), parts: [0; 2] };
                let touched = [Some(i), None];
                let film = self.at_wall(model, i, (wall, surface, time), (rates, dt));
                let overlap = overlap_wall(model.geometry, &self.body(particle), &surface.seen_from(centre))
                    .filter(|_| !constants.motion.is_complete());
                let Some(overlap) = overlap else {
                    if let Some(Acting { action, normal, lever }) = film {
                        let point = domain.wrap(centre + lever);
                        forces.add(&PairEntry::apart(key, touched, (point, normal), action), near, store);
                    }
                    continue;
                };
                let point = centre + overlap.point;
                let law = &self.laws[self.material(particle) * model.materials.len() + wall.material];
                let input = ContactInput {
                    key,
                    indices: touched,
                    law,
                    overlap: &overlap,
                    offset: Vec3::zeros(),
                    properties: PairProperties {
                        radii: [constants.radius, f64::INFINITY],
                        masses: [constants.inertia.mass, f64::INFINITY],
                        dt,
                    },
                    velocity: self.velocity(i, &overlap.point, law, dt) - wall.velocity(point, time),
                    point: domain.wrap(point),
                };
                let entry = forces.evaluate(&input);
                let entry = film.map_or(entry, |film| entry.with(&film.action));
                forces.add(&entry, near, store);
                if is_too_deep(overlap.depth, constants.thickness) && outcome.is_ok() {
                    let partner = format_args!("wall `{}`", wall.name);
                    let (depth, thickness) = (overlap.depth, constants.thickness);
                    outcome = Err(too_deep(self.substep, particle, partner, depth, thickness));
                }
            }
        }
        outcome
    }
}
