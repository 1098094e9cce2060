//! Contacts of the spheres, from their geometry and LIGGGHTS's forces.

use super::protocol::ContactForce;
use super::{Liggghts, Root, deck};
use turbid_core::contact::{Body, Geometry, overlap, overlap_wall};
use turbid_core::dem::native::failures::position_text;
use turbid_core::dem::{ContactState, ContactSummary};
use turbid_core::error::{Error, Result};
use turbid_core::math::{Quat, Vec3};

/// Overlaps deeper than this part of the smaller diameter are outside the contact model, as in the native engine.
const DEEPEST: f64 = 0.25;

impl Liggghts {
    /// Counts the contacts of the particles at these positions; on rank 0.
    pub(super) fn count(&mut self, positions: &[Vec3]) -> Result<()> {
        let Some(mut root) = self.root.take() else {
            return Ok(());
        };
        let domain = self.near.decomposition().domain;
        root.positions = positions.iter().map(|&position| domain.wrap(position)).collect();
        let mut pairs = Vec::with_capacity(root.pairs.len());
        let (mut deepest, mut outcome) = (0.0_f64, Ok(()));
        let mut add = |first: usize, second: u64, depth: f64, thickness: f64| {
            if depth <= 0.0 {
                return;
            }
            pairs.push((first as u64, second));
            deepest = deepest.max(depth);
            if depth > DEEPEST * thickness && outcome.is_ok() {
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
        if self.params.contact.is_some() {
            for &[i, j] in root.finder.find(&root.positions, &root.radii) {
                let [i, j] = [i as usize, j as usize];
                let offset = domain.nearest_image(root.positions[j] - root.positions[i]);
                let (a, b) = (root.radii[i], root.radii[j]);
                add(i, j as u64, a + b - offset.norm(), 2.0 * a.min(b));
            }
        }
        // Walls that LIGGGHTS has move along themselves only, so their surfaces stay where they are.
        for (index, wall) in self.params.touched_walls().iter().enumerate() {
            for (i, (&position, &radius)) in root.positions.iter().zip(&root.radii).enumerate() {
                let depth = radius - wall.surface.distance(position).abs();
                add(i, ContactState::of_wall(index), depth, 2.0 * radius);
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

    /// A contact with its geometry at the present positions; nothing for bodies that have parted.
    pub(super) fn contact_state(&self, root: &Root, contact: &ContactForce) -> Option<ContactState> {
        let domain = self.near.decomposition().domain;
        let (first, second) = (contact.first as usize, contact.second as usize);
        let body = |index: usize| Body {
            grown: &self.contours[root.templates[index]],
            orientation: Quat::identity(),
        };
        let position = *root.positions.get(first)?;
        let normal = Vec3::from(contact.force);
        let mut friction = Vec3::from(contact.friction);
        let (partner, overlap) = if contact.is_wall == 1 {
            let surface = self.params.walls.get(second)?.surface.seen_from(position);
            (ContactState::of_wall(second), overlap_wall(Geometry::Exact, &body(first), &surface)?)
        } else {
            if let Some(model) = &self.params.contact {
                // A contact that slides has Coulomb's friction; the dashpot that LIGGGHTS adds now did not act.
                let [a, b] = [first, second]
                    .map(|index| self.population.store.templates[root.templates[index]].material);
                let (most, norm) = (deck::friction(model.pair(a, b)) * normal.norm(), friction.norm());
                if norm > most {
                    friction *= most / norm;
                }
            }
            let offset = domain.nearest_image(*root.positions.get(second)? - position);
            (self.ids[second], overlap(Geometry::Exact, &body(first), &body(second), offset)?)
        };
        Some(ContactState {
            first: self.ids[first],
            second: partner,
            point: domain.wrap(position + overlap.point).into(),
            normal: overlap.normal.into(),
            force: (normal + friction).into(),
            depth: overlap.depth,
            volume: overlap.volume,
        })
    }
}
