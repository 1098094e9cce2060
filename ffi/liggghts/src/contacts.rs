//! Contacts of the spheres from their geometry; from LIGGGHTS only the forces.

use super::protocol::{ContactForce, State};
use super::{Liggghts, Root, deck};
use turbid_core::contact::{Body, Geometry, overlap, overlap_wall};
use turbid_core::dem::native::failures::position_text;
use turbid_core::dem::{ContactState, ContactSummary};
use turbid_core::error::{Error, Result};
use turbid_core::math::{Quat, Vec3};
use turbid_core::wall::{Surface, Wall};

/// Overlaps deeper than this part of the smaller diameter are beyond the contact model, as in the native engine.
const DEEPEST: f64 = 0.25;

impl Liggghts {
    /// A sphere of contact by its index, for the measurement of overlaps.
    fn body(&self, root: &Root, index: usize) -> Body<'_> {
        Body { grown: &self.contours[root.templates[index]], orientation: Quat::identity() }
    }

    /// Walls where they stand now: those that LIGGGHTS has move along themselves only.
    fn surfaces(&self) -> impl Iterator<Item = &Surface> {
        let walls: &[Wall] = if self.params.contact.is_some() { &self.params.walls } else { &[] };
        walls.iter().map(|wall| &wall.surface)
    }

    /// Counts the contacts at the present positions; on rank 0.
    pub(super) fn count(&mut self, states: &[State]) -> Result<()> {
        let Some(mut root) = self.root.take() else {
            return Ok(());
        };
        let domain = self.near.decomposition().domain;
        root.positions.clear();
        (root.positions).extend(states.iter().map(|state| domain.wrap(state.position.into())));
        let mut pairs = Vec::with_capacity(root.pairs.len());
        let (mut deepest, mut outcome) = (0.0_f64, Ok(()));
        let mut note = |first: usize, second: u64, depth: f64, thickness: f64| {
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
                outcome = Err(Error::Diverged {
                    step: self.step,
                    what: format!(
                        "particles {} at {} and {other}: overlap {depth:.3e} m deep, more than a quarter of the thickness \
                         {thickness:.3e} m",
                        self.ids[first],
                        position_text(Vec3::from(states[first].position)),
                    ),
                });
            }
        };
        if self.params.contact.is_some() {
            for &[i, j] in root.finder.find(&root.positions, &root.radii) {
                let [i, j] = [i as usize, j as usize];
                let offset = domain.nearest_image(root.positions[j] - root.positions[i]);
                let (a, b) = (root.radii[i], root.radii[j]);
                note(i, j as u64, a + b - offset.norm(), 2.0 * a.min(b));
            }
        }
        for (index, surface) in self.surfaces().enumerate() {
            for (i, (&position, &radius)) in root.positions.iter().zip(&root.radii).enumerate() {
                let depth = radius - surface.distance(position).abs();
                note(i, ContactState::of_wall(index), depth, 2.0 * radius);
            }
        }
        pairs.sort_unstable();
        let begun = pairs.iter().filter(|pair| root.pairs.binary_search(pair).is_err()).count();
        root.summary = ContactSummary {
            count: pairs.len(),
            max_depth: deepest,
            begun: root.summary.begun + begun as u64,
        };
        root.pairs = pairs;
        self.root = Some(root);
        outcome
    }

    /// A contact with its geometry at the present positions; nothing for bodies that have parted.
    pub(super) fn contact_state(&self, root: &Root, contact: &ContactForce) -> Option<ContactState> {
        let domain = self.near.decomposition().domain;
        let first = contact.first as usize;
        let position = *root.positions.get(first)?;
        let body = self.body(root, first);
        let (second, overlap) = if contact.is_wall == 1 {
            let surface = self.params.walls.get(contact.second as usize)?.surface.seen_from(position);
            let wall = ContactState::of_wall(contact.second as usize);
            (wall, overlap_wall(Geometry::Exact, &body, &surface)?)
        } else {
            let second = contact.second as usize;
            let offset = domain.nearest_image(*root.positions.get(second)? - position);
            let overlap = overlap(Geometry::Exact, &body, &self.body(root, second), offset)?;
            (self.ids[second], overlap)
        };
        let normal = Vec3::from(contact.force);
        let mut friction = Vec3::from(contact.friction);
        if let (0, Some(model)) = (contact.is_wall, &self.params.contact) {
            // A contact that slides has Coulomb's friction; the dashpot LIGGGHTS adds when asked for it did not act.
            let material = |index: u64| {
                let template = root.templates[index as usize];
                self.population.store.templates[template].material
            };
            let pair = model.pair(material(contact.first), material(contact.second));
            let most = deck::friction(pair) * normal.norm();
            let norm = friction.norm();
            if norm > most {
                friction *= most / norm;
            }
        }
        Some(ContactState {
            first: self.ids[first],
            second,
            point: domain.wrap(position + overlap.point).into(),
            normal: overlap.normal.into(),
            force: (normal + friction).into(),
            depth: overlap.depth,
            volume: overlap.volume,
        })
    }
}
