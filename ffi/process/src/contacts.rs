//! Contacts, from the geometry of the bodies and the forces of the engine.

use super::External;
use crate::message::{MeasuredContact, State};
use turbid_core::contact::{Body, Geometry, overlap, overlap_wall};
use turbid_core::dem::native::failures::{is_too_deep, position_text};
use turbid_core::dem::states::too_fast;
use turbid_core::dem::{ContactState, ContactSummary};
use turbid_core::error::{Error, Result};
use turbid_core::math::Vec3;
use turbid_core::particle::Particle;

impl External {
    /// Refuses velocities that are too fast for the fluid, and forces and torques that no contacts have.
    pub(super) fn refuse_absurd(&self, id: u64, state: &State, dt: f64) -> Result<()> {
        let domain = self.near.decomposition().domain;
        let &State { velocity, angular_velocity, contact_force, contact_torque, .. } = state;
        let moving = Particle { velocity, angular_velocity, ..Particle::at(id, 0, Vec3::zeros()) };
        if let Some(what) = too_fast(&moving, dt, domain.dx) {
            return Err(Error::Diverged { step: self.step, what });
        }
        let [force, torque] = [contact_force, contact_torque].map(|vector| Vec3::from(vector).norm());
        let (largest, most) = (force.max(torque / domain.size().norm()), self.strongest);
        if largest <= most {
            return Ok(());
        }
        Err(self.failure(format!(
            "field `contact_force` or `contact_torque` of particle {id}: {largest:.3e} N (torque over the size of the box) is more \
             than the {most:.3e} N that move all particles by a cell in a sub-step"
        )))
    }

    /// Counts the contacts as they are now.
    pub(super) fn count(&mut self) -> Result<()> {
        let domain = self.near.decomposition().domain;
        let store = &self.population.store;
        let now = &store.particles;
        let positions: Vec<Vec3> = now.iter().map(Particle::position).collect();
        let radii: Vec<f64> = now.iter().map(|p| self.contours[p.template as usize].reach()).collect();
        let found = if self.params.contact.is_some() {
            self.finder.find(&positions, &radii).to_vec()
        } else {
            Vec::new()
        };
        let mut pairs = Vec::with_capacity(self.pairs.len());
        // Those that this rank evaluates, each contact is one of one rank.
        let (mut own, mut deepest, mut outcome) = (Vec::new(), 0.0_f64, Ok(()));
        let mut add = |first: usize, second: u64, is_own: bool, depth: f64, thickness: f64| {
            if depth <= 0.0 {
                return;
            }
            let pair = (now[first].id, second);
            pairs.push(pair);
            if !is_own {
                return;
            }
            own.push(pair);
            deepest = deepest.max(depth);
            if is_too_deep(depth, thickness) && outcome.is_ok() {
                let other = match ContactState::wall_of(second) {
                    Some(wall) => format!("wall `{}`", self.params.walls[wall].name),
                    None => second.to_string(),
                };
                let what = format!(
                    "particles {} at {} and {other}: overlap {depth:.3e} m deep, more than a quarter of the thickness \
                     {thickness:.3e} m",
                    now[first].id,
                    position_text(positions[first]),
                );
                outcome = Err(Error::Diverged { step: self.step, what });
            }
        };
        let sphere = |i: usize| self.contours[now[i].template as usize].shape.as_sphere().is_some();
        let thickness = |i: usize| self.thickness(&now[i]);
        for [i, j] in found {
            let [i, j] = [i as usize, j as usize];
            let [i, j] = if now[i].id < now[j].id { [i, j] } else { [j, i] };
            let offset = domain.nearest_image(positions[j] - positions[i]);
            let depth = if sphere(i) && sphere(j) {
                radii[i] + radii[j] - offset.norm()
            } else {
                let bodies = [self.body(&now[i]), self.body(&now[j])];
                overlap(Geometry::Exact, &bodies[0], &bodies[1], offset).map_or(0.0, |overlap| overlap.depth)
            };
            let is_own = self.near.evaluating_rank_of([i, j], store) == Some(self.near.rank);
            add(i, now[j].id, is_own, depth, thickness(i).min(thickness(j)));
        }
        // Walls move along themselves only, so their surfaces stay where they are.
        for (index, wall) in self.params.touched_walls().iter().enumerate() {
            for (i, (&position, &radius)) in positions.iter().zip(&radii).enumerate() {
                let room = wall.surface.distance(position).abs();
                let depth = if sphere(i) || room > radius {
                    radius - room
                } else {
                    let wall = wall.surface.seen_from(position);
                    overlap_wall(Geometry::Exact, &self.body(&now[i]), &wall)
                        .map_or(0.0, |overlap| overlap.depth)
                };
                add(i, ContactState::of_wall(index), i < store.owned, depth, thickness(i));
            }
        }
        // The rank that evaluates a contact knew both bodies before, too.
        let begun = own.iter().filter(|pair| self.pairs.binary_search(pair).is_err()).count() as u64;
        self.summary =
            ContactSummary { count: own.len(), max_depth: deepest, begun: self.summary.begun + begun };
        pairs.sort_unstable();
        self.pairs = pairs;
        outcome
    }

    /// A contact with its geometry at the present positions, or the overlap that the engine has measured; nothing for bodies that have
    /// parted.
    pub(super) fn contact_state(&self, measured: &MeasuredContact) -> Option<ContactState> {
        let contact = &measured.contact;
        let domain = self.near.decomposition().domain;
        let known = |id: u64| self.population.index_of(id).map(|at| &self.population.store.particles[at]);
        let first = known(contact.first)?;
        let position = first.position();
        let overlap = if let Some(wall) = ContactState::wall_of(contact.second) {
            let surface = self.params.walls[wall].surface.seen_from(position);
            overlap_wall(Geometry::Exact, &self.body(first), &surface)?
        } else {
            let second = known(contact.second)?;
            let offset = domain.nearest_image(second.position() - position);
            overlap(Geometry::Exact, &self.body(first), &self.body(second), offset)?
        };
        let (point, volume) = match measured.overlap {
            // Of spheres an engine may leave it out, of others it must not.
            own if own.volume > 0.0
                || self.able.overlaps && self.body(first).grown.shape.as_sphere().is_none() =>
            {
                (own.centroid.into(), own.volume)
            }
            _ => (position + overlap.point, overlap.volume),
        };
        Some(ContactState {
            first: contact.first,
            second: contact.second,
            parts: [0; 2],
            point: domain.wrap(point).into(),
            normal: overlap.normal.into(),
            force: contact.force,
            depth: overlap.depth,
            volume,
        })
    }

    fn body(&self, particle: &Particle) -> Body<'_> {
        let grown = &self.contours[particle.template as usize];
        Body { grown, orientation: particle.orientation() }
    }

    /// Thickness of a body (m), of a sphere that of its contacts.
    fn thickness(&self, particle: &Particle) -> f64 {
        let grown = &self.contours[particle.template as usize];
        if grown.shape.as_sphere().is_some() { 2.0 * grown.reach() } else { grown.shape.thickness() }
    }
}
