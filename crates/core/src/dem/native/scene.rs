//! Contacts at one time: overlapping pairs and their relative velocities.

use super::failures::{behind_wall, too_deep, too_deep_in_wall};
use super::ledger::{Ledger, Meeting, Share};
use crate::contact::{
    Body, ContactModel, Contour, Couple, DampingLaw, PairFinder, PairLaw, measure, measure_wall,
};
use crate::dem::assign::Neighbourhood;
use crate::dem::integrator::Inertia;
use crate::dem::{ContactState, Load};
use crate::error::Result;
use crate::math::Vec3;
use crate::particle::{Particle, ParticleStore};
use crate::wall::{Surface, Wall};

/// Overlaps deeper than this part of the thickness of the (thinner) body are beyond the contact model; for spheres
/// half of the radius.
const DEEPEST: f64 = 0.25;

/// The particles of this rank, ghosts included, ascending by id, and the pairs of neighbours. Keeps its buffers from
/// sub-step to sub-step.
#[derive(Clone, Debug)]
pub(super) struct Roll {
    finder: PairFinder,
    /// Indices of the particles, ghosts included.
    known: Vec<u32>,
    /// Their positions (m).
    positions: Vec<Vec3>,
    /// Their bounding radii (m).
    radii: Vec<f64>,
}

impl Roll {
    pub(super) fn new(finder: PairFinder) -> Self {
        Self { finder, known: Vec::new(), positions: Vec::new(), radii: Vec::new() }
    }

    /// Lists the particles, ghosts included, by ascending id.
    fn list(&mut self, store: &ParticleStore, bounds: &[f64]) {
        let (owned, known) = (store.owned as u32, store.particles.len() as u32);
        let id = |k: u32| store.particles[k as usize].id;
        let (mut next_owned, mut next_ghost) = (0, owned);
        self.known.clear();
        while next_owned < owned || next_ghost < known {
            let ghost = next_owned == owned || (next_ghost < known && id(next_ghost) < id(next_owned));
            let next = if ghost { &mut next_ghost } else { &mut next_owned };
            self.known.push(*next);
            *next += 1;
        }
        let particles = || self.known.iter().map(|&k| &store.particles[k as usize]);
        self.positions.clear();
        self.positions.extend(particles().map(Particle::position));
        self.radii.clear();
        self.radii.extend(particles().map(|p| bounds[p.template as usize]));
    }
}

/// All that contacts depend on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scene<'a> {
    pub(super) contact: &'a ContactModel,
    /// By template.
    pub(super) contours: &'a [Contour],
    /// Bounding radii by template (m).
    pub(super) bounds: &'a [f64],
    /// Radii of the spheres of equal volume by template (m).
    pub(super) radii: &'a [f64],
    /// By template.
    pub(super) inertias: &'a [Inertia],
    /// By the materials of the pair.
    pub(super) laws: &'a [PairLaw],
    pub(super) store: &'a ParticleStore,
    pub(super) near: &'a Neighbourhood,
    pub(super) rank: usize,
    pub(super) substep: u64,
    /// Length of a sub-step (s).
    pub(super) dt: f64,
    /// Acceleration of every particle (m/s^2).
    pub(super) gravity: Vec3,
    /// Loads of the previous sub-step by particle, if there was one and a law needs them.
    pub(super) past: Option<&'a [Load]>,
}

impl<'a> Scene<'a> {
    fn body(&self, particle: &Particle) -> Body<'a> {
        Body { contour: &self.contours[particle.template as usize], orientation: particle.orientation() }
    }

    fn law(&self, a: usize, b: usize) -> &'a PairLaw {
        &self.laws[a * self.contact.materials.len() + b]
    }

    /// Velocity (m/s) at a point of a particle, `lever` (m) from its centre, as a law needs it.
    ///
    /// [`DampingLaw::Tsuji`] exists for comparison with LIGGGHTS, whose velocity Verlet computes forces with the
    /// velocity of half a step before, `v - dt/2 (C + F + m g) / m`: so does it.
    fn velocity(&self, index: usize, lever: &Vec3, law: &PairLaw) -> Vec3 {
        let particle = &self.store.particles[index];
        let (velocity, spin) = match (law.damping, self.past) {
            (DampingLaw::HuntCrossley, _) | (DampingLaw::Tsuji, None) => {
                (particle.velocity(), particle.angular_velocity())
            }
            (DampingLaw::Tsuji, Some(past)) => {
                let inertia = &self.inertias[particle.template as usize];
                let half = 0.5 * self.dt;
                let weight = self.gravity * inertia.mass;
                let force = Vec3::from(particle.contact_force) + (past[index].force + weight);
                let torque = Vec3::from(particle.contact_torque) + past[index].torque;
                let momentum = Vec3::from(particle.angular_momentum) - torque * half;
                (
                    particle.velocity() - force * (half / inertia.mass),
                    inertia.angular_velocity(&particle.orientation(), momentum),
                )
            }
        };
        velocity + spin.cross(lever)
    }

    /// Contacts of pairs of particles that this rank evaluates, in ascending order of their ids.
    pub(super) fn pairs(&self, roll: &mut Roll, ledger: &mut Ledger) -> Result<()> {
        let store = self.store;
        roll.list(store, self.bounds);
        let domain = self.near.decomposition().domain;
        let mut outcome = Ok(());
        for &[i, j] in roll.finder.find(&roll.positions, &roll.radii) {
            let [i, j] = [i, j].map(|k| roll.known[k as usize] as usize);
            if responsible_for_pair(i, j, self.near, store) != Some(self.rank) {
                continue;
            }
            let (a, b) = (&store.particles[i], &store.particles[j]);
            let offset = domain.nearest_image(b.position() - a.position());
            let [first, second] = [a, b].map(|p| self.body(p));
            let Some(overlap) = measure(self.contact.geometry, &first, &second, offset) else {
                continue;
            };
            let levers = [overlap.point, overlap.point - offset];
            let law = self.law(store.template(a).material, store.template(b).material);
            let action = ledger.enter(&Meeting {
                ids: [a.id, b.id],
                law,
                overlap: &overlap,
                offset,
                couple: Couple {
                    radii: [a, b].map(|p| self.radii[p.template as usize]),
                    masses: [a, b].map(|p| self.inertias[p.template as usize].mass),
                },
                velocity: self.velocity(i, &levers[0], law) - self.velocity(j, &levers[1], law),
                point: domain.wrap(a.position() + overlap.point),
            });
            let thinner = (first.contour.shape.thickness()).min(second.contour.shape.thickness());
            if overlap.depth > DEEPEST * thinner && outcome.is_ok() {
                outcome = Err(too_deep(self.substep, a, b, &overlap, thinner));
            }
            let of_a = Share::new([a.id, b.id], action.force, action.torques[0]);
            let of_b = Share::new([b.id, a.id], -action.force, action.torques[1]);
            ledger.book(i, of_a, self.near, store);
            ledger.book(j, of_b, self.near, store);
        }
        outcome
    }

    /// Contacts of the owned particles with walls, which stand at these surfaces at `time` (s).
    pub(super) fn walls(
        &self,
        (walls, surfaces): (&[Wall], &[Surface]),
        time: f64,
        ledger: &mut Ledger,
    ) -> Result<()> {
        ledger.begin_walls();
        let domain = self.near.decomposition().domain;
        let mut outcome = Ok(());
        for (i, particle) in self.store.owned().iter().enumerate() {
            let (centre, template) = (particle.position(), particle.template as usize);
            // Ids of walls fall with their index.
            for (index, (wall, surface)) in walls.iter().zip(surfaces).enumerate().rev() {
                let distance = surface.distance(centre);
                if distance >= self.bounds[template] {
                    continue;
                }
                let body = self.body(particle);
                let radius = body.contour.shape.circumradius();
                if distance < -radius {
                    outcome = outcome
                        .and_then(|()| Err(behind_wall(self.substep, particle, wall, distance, radius)));
                    continue;
                }
                let Some(overlap) = measure_wall(self.contact.geometry, &body, &surface.seen_from(centre))
                else {
                    continue;
                };
                let point = centre + overlap.point;
                let law = self.law(self.store.template(particle).material, wall.material);
                let velocity = self.velocity(i, &overlap.point, law);
                let ids = [particle.id, ContactState::of_wall(index)];
                let action = ledger.enter(&Meeting {
                    ids,
                    law,
                    overlap: &overlap,
                    offset: Vec3::zeros(),
                    couple: Couple {
                        radii: [self.radii[template], f64::INFINITY],
                        masses: [self.inertias[template].mass, f64::INFINITY],
                    },
                    velocity: velocity - wall.velocity(point, time),
                    point: domain.wrap(point),
                });
                let thickness = body.contour.shape.thickness();
                if overlap.depth > DEEPEST * thickness {
                    outcome = outcome.and_then(|()| {
                        Err(too_deep_in_wall(self.substep, particle, wall, overlap.depth, thickness))
                    });
                }
                let share = Share::new(ids, action.force, action.torques[0]);
                ledger.book(i, share, self.near, self.store);
            }
        }
        outcome
    }
}

/// The rank that evaluates the contact of two particles.
pub(super) fn responsible_for_pair(
    i: usize,
    j: usize,
    near: &Neighbourhood,
    store: &ParticleStore,
) -> Option<usize> {
    let [a, b] = [i, j].map(|k| {
        let particle = &store.particles[k];
        (store.owners[k] as usize, particle.position(), particle.template)
    });
    near.responsible(a, b)
}
