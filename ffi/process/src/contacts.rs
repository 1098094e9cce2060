//! Contacts, from the geometry of the bodies and the forces of the engine.

use super::{External, Root};
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

    /// Counts the contacts of all particles as they are now; on rank 0.
    pub(super) fn count(&mut self, now: &[Particle]) -> Result<()> {
        let Some(mut root) = self.root.take() else {
            return Ok(());
        };
        let domain = self.near.decomposition().domain;
        root.particles.clear();
        root.particles.extend_from_slice(now);
        let positions: Vec<Vec3> = now.iter().map(Particle::position).collect();
        let mut pairs = Vec::with_capacity(root.pairs.len());
        let (mut deepest, mut outcome) = (0.0_f64, Ok(()));
        let mut add = |first: usize, second: u64, depth: f64, thickness: f64| {
            if depth <= 0.0 {
                return;
            }
            pairs.push((first as u64, second));
            deepest = deepest.max(depth);
            if is_too_deep(depth, thickness) && outcome.is_ok() {
                let other = match ContactState::wall_of(second) {
                    Some(wall) => format!("wall `{}`", self.params.walls[wall].name),
                    None => self.ids[second as usize].to_string(),
                };
                let what = format!(
                    "particles {} at {} and {other}: overlap {depth:.3e} m deep, more than a quarter of the thickness \
                     {thickness:.3e} m",
                    self.ids[first],
                    position_text(positions[first]),
                );
                outcome = Err(Error::Diverged { step: self.step, what });
            }
        };
        let sphere = |i: usize| self.contours[now[i].template as usize].shape.as_sphere().is_some();
        let thickness = |i: usize| self.thickness(&now[i]);
        if self.params.contact.is_some() {
            for &[i, j] in root.finder.find(&positions, &root.radii) {
                let [i, j] = [i as usize, j as usize];
                let offset = domain.nearest_image(positions[j] - positions[i]);
                let depth = if sphere(i) && sphere(j) {
                    root.radii[i] + root.radii[j] - offset.norm()
                } else {
                    let bodies = [self.body(&now[i]), self.body(&now[j])];
                    overlap(Geometry::Exact, &bodies[0], &bodies[1], offset)
                        .map_or(0.0, |overlap| overlap.depth)
                };
                add(i, j as u64, depth, thickness(i).min(thickness(j)));
            }
        }
        // Walls move along themselves only, so their surfaces stay where they are.
        for (index, wall) in self.params.touched_walls().iter().enumerate() {
            for (i, (&position, &radius)) in positions.iter().zip(&root.radii).enumerate() {
                let room = wall.surface.distance(position).abs();
                let depth = if sphere(i) || room > radius {
                    radius - room
                } else {
                    let wall = wall.surface.seen_from(position);
                    overlap_wall(Geometry::Exact, &self.body(&now[i]), &wall)
                        .map_or(0.0, |overlap| overlap.depth)
                };
                add(i, ContactState::of_wall(index), depth, thickness(i));
            }
        }
        pairs.sort_unstable();
        let begun = pairs.iter().filter(|pair| root.pairs.binary_search(pair).is_err()).count() as u64;
        let begun = root.summary.begun + begun;
        root.summary = ContactSummary { count: pairs.len(), max_depth: deepest, begun };
        root.pairs = pairs;
        self.root = Some(root);
        outcome
    }

    /// A contact with its geometry at the present positions, or the overlap that the engine has measured; nothing for bodies that have
    /// parted.
    pub(super) fn contact_state(&self, root: &Root, measured: &MeasuredContact) -> Option<ContactState> {
        let contact = &measured.contact;
        let domain = self.near.decomposition().domain;
        let first = &root.particles[self.index(contact.first)];
        let position = first.position();
        let overlap = if let Some(wall) = ContactState::wall_of(contact.second) {
            let surface = self.params.walls[wall].surface.seen_from(position);
            overlap_wall(Geometry::Exact, &self.body(first), &surface)?
        } else {
            let second = &root.particles[self.index(contact.second)];
            let offset = domain.nearest_image(second.position() - position);
            overlap(Geometry::Exact, &self.body(first), &self.body(second), offset)?
        };
        let (point, volume) = match measured.overlap {
            // Of spheres an engine may leave it out, of others it must not.
            own if own.volume > 0.0
                || root.hello.overlaps && self.body(first).grown.shape.as_sphere().is_none() =>
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
