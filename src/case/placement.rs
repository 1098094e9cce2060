//! Initial positions of the particles of a case.

mod listed;
mod overlaps;
mod random;
mod relaxed;

use super::checks::Document;
use super::file::{Entry, MovingEntry};
use super::filled::Filled;
use super::kinds::Kinds;
use super::placed::Places;
use super::walls::PlacedWall;
use crate::domain::Domain;
use crate::error::Result;
use crate::math::{Quat, Vec3};
use crate::particle::{Particle, Template};
use crate::wall::Surface;
pub(super) use random::CLEAR;
pub(super) use relaxed::pose;
use std::collections::HashMap;

/// A case, and all that the positions depend on.
pub(super) struct Placer<'a> {
    pub(super) document: &'a Document<'a>,
    pub(super) domain: Domain,
    pub(super) kinds: &'a Kinds,
    pub(super) walls: &'a [PlacedWall],
    /// Volume of the box outside of walls (m^3).
    pub(super) free_volume: f64,
    /// Templates whose whole motion is prescribed: their bodies may overlap each other and walls.
    pub(super) prescribed: &'a [bool],
    /// Distance by which surfaces are grown for contacts (m); 0 without contacts.
    pub(super) enlargement: f64,
}

/// Numbers of particles by template.
type Counts = Vec<(usize, usize)>;

/// A particle and its key in the case; its id is final only if the file gave one.
struct Candidate {
    particle: Particle,
    has_id: bool,
    key: String,
    /// `name:line` in a positions file.
    line: Option<String>,
    /// It is part of the state of a run, where contacts overlap.
    in_motion: bool,
}

impl Placer<'_> {
    /// All particles, ascending ids, or their numbers where they are only counted or elsewhere. The volume (m^3) is that by which listed bodies
    /// with [prescribed](Self::prescribed) motion fill less of the box than each of them alone, as they overlap each other or walls.
    pub(super) fn place(
        &self,
        places: Places,
        warnings: &mut Vec<String>,
        notes: &mut Vec<String>,
    ) -> Result<(Vec<Particle>, Counts, f64)> {
        if let Places::Elsewhere(placed) = places {
            return Ok((Vec::new(), placed.totals.counts.iter().copied().enumerate().collect(), 0.0));
        }
        let mut placed = Vec::new();
        let mut random = Vec::new();
        for (index, kind) in self.document.case.particles.iter().enumerate() {
            let key = format!("particles.{index}");
            self.check_relaxed(&key, kind)?;
            if kind.is_random() {
                random.push((index, self.count(index, kind)?));
                continue;
            }
            // A file may say which size a particle has.
            let of_random = ["sizes", "seed", "minimum_gap"].iter().skip(usize::from(kind.file().is_some()));
            let of_random = of_random.filter(|name| **name != "minimum_gap" || !relaxed::relaxes(kind));
            for name in of_random.map(|name| format!("{key}.{name}")) {
                if self.document.has(&name) {
                    let title =
                        format!("`{name}` belongs to random positions, but `{key}` lists its positions");
                    return Err(self.document.error(&name, &title, "has no effect here", "remove it"));
                }
            }
            if let Some(listed) = &self.kinds.listed[index] {
                self.add_listed(index, listed, &mut placed)?;
            }
            for (i, entry) in kind.list().iter().enumerate() {
                placed.push(self.entry(index, format!("{key}.list.{i}"), entry)?);
            }
        }
        self.number(&mut placed)?;
        notes.extend(self.relax(&mut placed));
        let overlap = self.refuse_overlaps(&placed)?;
        warnings.extend(self.grown_overlaps(&placed));
        let mut particles: Vec<Particle> = placed.into_iter().map(|p| p.particle).collect();
        let filled = overlap.then(|| self.filled(&particles));
        let shared = filled.map_or(0.0, |filled| self.prescribed_volume(&particles) - filled);
        let mut counted = Vec::new();
        if let Places::Here(follow) = places {
            self.pack(&random, &mut particles, filled, warnings, follow)?;
        } else {
            counted.extend(random.iter().flat_map(|&(index, count)| self.allot(index, count)));
        }
        particles.sort_by_key(|p| p.id);
        Ok((particles, counted, shared))
    }

    fn is_prescribed(&self, particle: &Particle) -> bool {
        self.prescribed[particle.template as usize]
    }

    /// Volume (m^3) of the box outside of walls that bodies with prescribed motion fill, where they overlap.
    fn filled(&self, particles: &[Particle]) -> f64 {
        let walls: Vec<Surface> = self.walls.iter().map(|placed| placed.wall.surface.clone()).collect();
        let bodies = particles.iter().filter(|p| self.is_prescribed(p));
        Filled::by(&self.domain, &walls, &self.kinds.templates, bodies).solid_volume()
    }

    /// Volume (m^3) of bodies with prescribed motion, each alone.
    fn prescribed_volume(&self, particles: &[Particle]) -> f64 {
        let bodies = particles.iter().filter(|p| self.is_prescribed(p));
        bodies.map(|p| self.template(p).shape.volume()).sum()
    }

    fn template(&self, particle: &Particle) -> &Template {
        &self.kinds.templates[particle.template as usize]
    }

    fn entry(&self, index: usize, key: String, entry: &Entry) -> Result<Candidate> {
        let moving = match entry {
            Entry::Position(position) => &MovingEntry { position: *position, ..MovingEntry::default() },
            Entry::Moving(moving) => moving,
        };
        let position = self.inside(&format!("`{key}`"), &key, moving.position.into())?;
        let kind = &self.kinds.sections[index];
        let given = match &moving.orientation {
            Some(section) => self.document.orientation(&format!("{key}.orientation"), section)?,
            None => Quat::identity(),
        };
        let motion = [moving.velocity, moving.angular_velocity].map(Vec3::from);
        let particle = self.particle(0, kind.first, (position, kind.turned(&given)), motion);
        Ok(Candidate { particle, has_id: false, key, line: None, in_motion: false })
    }

    /// A particle at a position with an orientation of its body, a velocity (m/s) and an angular velocity (1/s).
    pub(super) fn particle(
        &self,
        id: u64,
        template: usize,
        (position, orientation): (Vec3, Quat),
        motion: [Vec3; 2],
    ) -> Particle {
        let mut particle = Particle::at(id, template, position);
        particle.set_orientation(&orientation);
        let [velocity, angular_velocity] = motion;
        (particle.velocity, particle.angular_velocity) = (velocity.into(), angular_velocity.into());
        // L = R I R^T w, with the moments of inertia about the axes of the body.
        let in_body = orientation.inverse_transform_vector(&angular_velocity);
        let momentum = self.template(&particle).inertia().component_mul(&in_body);
        particle.angular_momentum = orientation.transform_vector(&momentum).into();
        particle
    }

    /// The position if it lies in the box, wrapped: the upper faces are the lower ones.
    fn inside(&self, what: &str, key: &str, position: Vec3) -> Result<Vec3> {
        let size = self.domain.size();
        for i in 0..3 {
            // Rounding may put a position on a face beside it.
            let margin = 1e-9 * size[i];
            if !(-margin..=size[i] + margin).contains(&position[i]) {
                let (x, length, axis) = (position[i], size[i], ["x", "y", "z"][i]);
                let title =
                    format!("{what} lies outside the box: {axis} is {x} m, but must be from 0 to {length} m");
                let remedy = format!(
                    "positions are in metres, and the box starts at the origin; make it longer in {axis} (`domain.size`), \
                     or remove this particle"
                );
                return Err(self.document.error(key, &title, "outside the box", &remedy));
            }
        }
        Ok(self.domain.wrap(position))
    }

    /// Gives numbers to the particles that have none, and refuses numbers given twice.
    fn number(&self, placed: &mut [Candidate]) -> Result<()> {
        let mut seen: HashMap<u64, usize> = HashMap::new();
        for (i, p) in placed.iter().enumerate().filter(|(_, p)| p.has_id) {
            if let Some(first) = seen.insert(p.particle.id, i) {
                let id = p.particle.id;
                let lines = [&placed[first], p].map(|p| p.line.clone().unwrap_or_default());
                let title = format!("the id {id} is given twice, in {} and {}", lines[0], lines[1]);
                let remedy = "every particle needs a number of its own; without a column `id` they are numbered in order";
                return Err(self.document.error(&p.key, &title, "in this file", remedy));
            }
        }
        let first = seen.keys().max().map_or(0, |id| id + 1);
        for (id, p) in (first..).zip(placed.iter_mut().filter(|p| !p.has_id)) {
            p.particle.id = id;
        }
        Ok(())
    }
}

#[cfg(test)]
mod prescribed_tests;
