//! The order in which pairs of particles are evaluated, and what is found for it once.

use super::context::TemplateConstants;
use crate::contact::{Neighbour, NeighbourList};
use crate::dem::exchange::LocalParticles;
use crate::domain::Domain;
use crate::math::{Mat3, Vec3};
use crate::particle::ParticleStore;

/// A part of a particle: the indices of both.
#[derive(Clone, Copy, Debug)]
pub(super) struct PartIndex {
    pub(super) particle: u32,
    pub(super) part: u32,
}

/// The parts of the particles of this rank, ghosts included, ascending by id, and the pairs of neighbours. Keeps its buffers from
/// sub-step to sub-step.
#[derive(Clone, Debug)]
pub(super) struct IdOrder {
    pub(super) list: NeighbourList,
    /// [`LocalParticles::arrangement`] of the particles.
    arrangement: u64,
    /// True if the parts are the particles in their order, and no polyhedra: all that changes is their positions.
    is_plain: bool,
    /// True if the positions are those of now.
    is_current: bool,
    /// Indices of the particles.
    particles: Vec<u32>,
    /// Their parts.
    pub(super) parts: Vec<PartIndex>,
    /// Positions of the parts (m), wrapped.
    pub(super) positions: Vec<Vec3>,
    /// Their bounding radii (m).
    pub(super) radii: Vec<f64>,
    /// Their rotations, of their own frame to the world frame, if there are polyhedra; of other bodies the identity.
    pub(super) rotations: Vec<Mat3>,
}

impl IdOrder {
    pub(super) fn new(list: NeighbourList) -> Self {
        Self {
            list,
            arrangement: 0,
            is_plain: false,
            is_current: false,
            particles: Vec::new(),
            parts: Vec::new(),
            positions: Vec::new(),
            radii: Vec::new(),
            rotations: Vec::new(),
        }
    }

    /// The pairs of neighbours, and for each place in the order the part that is there and its position (m).
    pub(super) fn pairs(&mut self) -> (&[Neighbour], &[PartIndex], &[Vec3]) {
        (self.list.find(&self.positions, &self.radii), &self.parts, &self.positions)
    }

    /// Sorts the particles by id.
    pub(super) fn sort(&mut self, local: &LocalParticles, templates: &[TemplateConstants], domain: &Domain) {
        if self.arrangement != local.arrangement {
            self.arrange(&local.store, templates);
            self.arrangement = local.arrangement;
        }
        if self.is_current {
            return;
        }
        let Self { parts, positions, rotations, .. } = self;
        positions.clear();
        positions.extend(parts.iter().map(|index| {
            let particle = &local.store.particles[index.particle as usize];
            let part = &templates[particle.template as usize].parts[index.part as usize];
            let centre = particle.position();
            part.arm(particle).map_or(centre, |arm| domain.wrap(centre + arm))
        }));
        if !rotations.is_empty() {
            rotations.clear();
            rotations.extend(parts.iter().map(|index| {
                let particle = &local.store.particles[index.particle as usize];
                let part = &templates[particle.template as usize].parts[index.part as usize];
                if part.shape.is_solid() { part.body(particle).rotation() } else { Mat3::identity() }
            }));
        }
        self.is_current = self.is_plain;
    }

    /// Finds the order of the parts of the particles, and what does not change as they move.
    fn arrange(&mut self, store: &ParticleStore, templates: &[TemplateConstants]) {
        let Self { particles, parts, radii, rotations, .. } = self;
        particles.clear();
        particles.extend(0..store.particles.len() as u32);
        // Owned particles, then ghosts, both ascending: a stable sort merges them.
        particles.sort_by_key(|&k| store.particles[k as usize].id);
        parts.clear();
        radii.clear();
        rotations.clear();
        let (mut is_whole, mut is_solid) = (true, false);
        for &particle in &*particles {
            let template = store.particles[particle as usize].template;
            for (part, constants) in (0..).zip(&templates[template as usize].parts) {
                parts.push(PartIndex { particle, part });
                radii.push(constants.bound);
                is_whole &= constants.is_whole();
                is_solid |= constants.shape.is_solid();
            }
        }
        if is_solid {
            rotations.resize(parts.len(), Mat3::identity());
        }
        self.is_plain = is_whole && !is_solid && store.owned == store.particles.len();
        self.is_current = false;
    }

    /// The positions of the particles, for those who move them, if they are all that changes then. Whoever moves particles without
    /// changing these loses their trace.
    pub(super) fn positions_followed(&mut self, arrangement: u64) -> Option<&mut [Vec3]> {
        (self.is_current && self.arrangement == arrangement).then_some(&mut self.positions)
    }
}
