//! Contacts of the spheres from their geometry; from LIGGGHTS only the forces.

use super::protocol::{State, Touch};
use super::{Liggghts, Master, deck};
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
    fn body(&self, master: &Master, index: usize) -> Body<'_> {
        Body { grown: &self.contours[master.templates[index]], orientation: Quat::identity() }
    }

    /// Walls where they stand now: those that LIGGGHTS has move along themselves only.
    fn surfaces(&self) -> impl Iterator<Item = &Surface> {
        let walls: &[Wall] = if self.params.contact.is_some() { &self.params.walls } else { &[] };
        walls.iter().map(|wall| &wall.surface)
    }

    /// Counts the contacts at the present positions; on rank 0.
    pub(super) fn count(&mut self, states: &[State]) -> Result<()> {
        let Some(mut master) = self.master.take() else {
            return Ok(());
        };
        let domain = self.near.decomposition().domain;
        master.positions.clear();
        (master.positions).extend(states.iter().map(|state| domain.wrap(state.position.into())));
        let mut pairs = Vec::with_capacity(master.pairs.len());
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
            for &[i, j] in master.finder.find(&master.positions, &master.radii) {
                let [i, j] = [i as usize, j as usize];
                let offset = domain.nearest_image(master.positions[j] - master.positions[i]);
                let (a, b) = (master.radii[i], master.radii[j]);
                note(i, j as u64, a + b - offset.norm(), 2.0 * a.min(b));
            }
        }
        for (index, surface) in self.surfaces().enumerate() {
            for (i, (&position, &radius)) in master.positions.iter().zip(&master.radii).enumerate() {
                let depth = radius - surface.distance(position).abs();
                note(i, ContactState::of_wall(index), depth, 2.0 * radius);
            }
        }
        pairs.sort_unstable();
        let begun = pairs.iter().filter(|pair| master.pairs.binary_search(pair).is_err()).count();
        master.summary = ContactSummary {
            count: pairs.len(),
            max_depth: deepest,
            begun: master.summary.begun + begun as u64,
        };
        master.pairs = pairs;
        self.master = Some(master);
        outcome
    }

    /// A contact with its geometry at the present positions; nothing for bodies that have parted.
    pub(super) fn contact_state(&self, master: &Master, touch: &Touch) -> Option<ContactState> {
        let domain = self.near.decomposition().domain;
        let first = touch.first as usize;
        let position = *master.positions.get(first)?;
        let body = self.body(master, first);
        let (second, overlap) = if touch.is_wall == 1 {
            let surface = self.params.walls.get(touch.second as usize)?.surface.seen_from(position);
            let wall = ContactState::of_wall(touch.second as usize);
            (wall, overlap_wall(Geometry::Exact, &body, &surface)?)
        } else {
            let second = touch.second as usize;
            let offset = domain.nearest_image(*master.positions.get(second)? - position);
            let overlap = overlap(Geometry::Exact, &body, &self.body(master, second), offset)?;
            (self.ids[second], overlap)
        };
        let normal = Vec3::from(touch.force);
        let mut friction = Vec3::from(touch.friction);
        if let (0, Some(model)) = (touch.is_wall, &self.params.contact) {
            // A contact that slides has Coulomb's friction; the dashpot LIGGGHTS adds when asked for it did not act.
            let material = |index: u64| {
                let template = master.templates[index as usize];
                self.population.store.templates[template].material
            };
            let pair = model.pair(material(touch.first), material(touch.second));
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
