//! Where the particles of a case are at the start.

mod listed;
mod overlaps;
mod random;

use super::checks::{Alternative, at};
use super::file::Case;
use super::files::Files;
use super::forms::{Entry, MovingEntry, OrientationSection, Triple};
use super::kinds::Kinds;
use super::located::Located;
use super::source::Source;
use super::walls::PlacedWall;
use crate::domain::Domain;
use crate::error::Result;
use crate::math::nalgebra::Quaternion;
use crate::math::{Quat, Vec3};
use crate::particle::{Particle, Template};
use std::collections::HashMap;
use std::ops::Range;

/// What the case file and its neighbours say about positions.
pub(super) struct Placer<'a> {
    pub(super) source: &'a Source,
    pub(super) case: &'a Case,
    pub(super) domain: Domain,
    pub(super) kinds: &'a Kinds,
    pub(super) walls: &'a [PlacedWall],
    /// Volume of the box that is in no wall (m^3).
    pub(super) free_volume: f64,
    pub(super) files: &'a Files<'a>,
    /// By how much surfaces are grown for contacts (m); 0 without contacts.
    pub(super) enlargement: f64,
}

/// Numbers of particles by template.
type Counts = Vec<(usize, usize)>;

/// A particle and where it was written; its id is final only where the file gave one.
struct Placed {
    particle: Particle,
    has_id: bool,
    span: Range<usize>,
    /// `name:line` in a positions file.
    line: Option<String>,
    /// It is part of the state of a run, where contacts overlap.
    in_motion: bool,
}

impl Placer<'_> {
    /// All particles, ascending ids; those at random, unless `places`, are only counted.
    pub(super) fn place(&self, places: bool, warnings: &mut Vec<String>) -> Result<(Vec<Particle>, Counts)> {
        let mut placed = Vec::new();
        let mut random = Vec::new();
        for (index, section) in self.case.particles.iter().enumerate() {
            let kind = &section.value;
            let key = format!("particles.{index}");
            let choices: [(_, &dyn Alternative); 4] = [
                ("volume_fraction", &kind.volume_fraction),
                ("count", &kind.count),
                ("file", &kind.file),
                ("list", &kind.list),
            ];
            let choice = self.source.exactly_one(&key, &section.span, &choices)?;
            if ["volume_fraction", "count"].contains(&choice) {
                random.push((index, self.count(index, kind)?));
                continue;
            }
            let of_random: [(_, &dyn Alternative); 3] =
                [("sizes", &kind.sizes), ("seed", &kind.seed), ("minimum_gap", &kind.minimum_gap)];
            // A file may say which size a particle has.
            for (name, value) in of_random.into_iter().skip(usize::from(choice == "file")) {
                if let Some(span) = value.place(&section.span) {
                    let title = format!(
                        "`{key}.{name}` belongs to random positions, but `{key}` lists its positions"
                    );
                    return Err(self.source.error(&span, &title, "has no effect here", "remove it"));
                }
            }
            if let Some(file) = &kind.file {
                self.read(index, file, &mut placed)?;
            }
            for (i, entry) in kind.list.iter().flatten().enumerate() {
                placed.push(self.entry(index, &format!("{key}.list.{i}"), entry)?);
            }
        }
        self.number(&mut placed)?;
        self.refuse_overlaps(&placed)?;
        self.refuse_overlaps_with_walls(&placed)?;
        let mut particles: Vec<Particle> = placed.into_iter().map(|p| p.particle).collect();
        let mut counted = Vec::new();
        if places {
            self.pack(&random, &mut particles, warnings)?;
        } else {
            counted.extend(random.iter().flat_map(|&(index, count)| self.allot(index, count)));
        }
        particles.sort_by_key(|p| p.id);
        Ok((particles, counted))
    }

    fn template(&self, particle: &Particle) -> &Template {
        &self.kinds.templates[particle.template as usize]
    }

    fn entry(&self, index: usize, key: &str, entry: &Located<Entry>) -> Result<Placed> {
        let still: Triple = [at(&entry.span, 0.0), at(&entry.span, 0.0), at(&entry.span, 0.0)];
        let moving = match &entry.value {
            Entry::Position(position) => MovingEntry {
                position: position.clone(),
                orientation: None,
                velocity: still.clone(),
                angular_velocity: still,
            },
            Entry::Moving(moving) => (**moving).clone(),
        };
        let vector = |numbers: &Triple| self.source.vector(key, &entry.span, numbers);
        let position = self.inside(&format!("`{key}`"), &entry.span, vector(&moving.position)?)?;
        let kind = &self.kinds.sections[index];
        let given = match &moving.orientation {
            Some(section) => self.orientation(&format!("{key}.orientation"), section)?,
            None => Quat::identity(),
        };
        let pose = (position, kind.turned(&given));
        let motion = [vector(&moving.velocity)?, vector(&moving.angular_velocity)?];
        Ok(Placed {
            particle: self.particle(0, kind.first, pose, motion),
            has_id: false,
            span: entry.span.clone(),
            line: None,
            in_motion: false,
        })
    }

    /// A particle at a position with an orientation of its body, a velocity (m/s) and an angular velocity (1/s).
    fn particle(
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

    /// An orientation from an axis and an angle, or from a quaternion.
    fn orientation(&self, key: &str, section: &Located<OrientationSection>) -> Result<Quat> {
        let (span, given) = (&section.span, &section.value);
        let choices: [(_, &dyn Alternative); 2] = [("axis", &given.axis), ("quaternion", &given.quaternion)];
        let example = "e.g. { axis = [0, 0, 1], angle = 45 }";
        let direction = "not all zero";
        if self.source.exactly_one(key, span, &choices)? == "quaternion" {
            if let Some(angle) = &given.angle {
                let title = format!("`{key}.angle` belongs to an axis, but there is a quaternion");
                return Err(self.source.error(&angle.span, &title, "has no effect here", "remove it"));
            }
            let quaternion = given.quaternion.as_ref().expect("checked by exactly_one");
            let [i, j, k, w] = quaternion.each_ref().map(|x| x.value);
            let norm = (i * i + j * j + k * k + w * w).sqrt();
            if !norm.is_finite() || norm <= 0.0 {
                let value = format!("{:?}", [i, j, k, w]);
                let key = format!("{key}.quaternion");
                return Err(self.source.out_of_range(&key, span, &value, direction, "[i, j, k, w]"));
            }
            let unit = Quaternion::new(w / norm, i / norm, j / norm, k / norm);
            return Ok(Quat::new_unchecked(unit));
        }
        let axis = given.axis.as_ref().expect("checked by exactly_one");
        let axis = (self.source).vector(&format!("{key}.axis"), span, axis)?;
        let Some(axis) = axis.try_normalize(0.0) else {
            let key = format!("{key}.axis");
            return Err(self.source.out_of_range(&key, span, "[0, 0, 0]", direction, example));
        };
        let Some(angle) = &given.angle else {
            let title = format!("`{key}` has an axis, but no angle");
            return Err(self.source.error(span, &title, "by how much?", example));
        };
        let key = format!("{key}.angle");
        let degrees = (self.source).satisfies(&key, angle, |_| true, "a finite number", "in degrees")?;
        let half = 0.5 * degrees.to_radians();
        let (sine, cosine) = (libm::sin(half), libm::cos(half));
        Ok(Quat::new_normalize(Quaternion::from_parts(cosine, axis * sine)))
    }

    /// The position if it lies in the box, wrapped: the upper faces are the lower ones.
    fn inside(&self, what: &str, span: &Range<usize>, position: Vec3) -> Result<Vec3> {
        let size = self.domain.size();
        for i in 0..3 {
            // A position on a face may be beside it by rounding.
            let margin = 1e-9 * size[i];
            if !(-margin..=size[i] + margin).contains(&position[i]) {
                let (x, length, axis) = (position[i], size[i], ["x", "y", "z"][i]);
                return Err(self.source.error(
                    span,
                    &format!(
                        "{what} lies outside the box: {axis} is {x} m, but must be from 0 to {length} m"
                    ),
                    "outside the box",
                    "positions are in metres, and the box starts at the origin",
                ));
            }
        }
        Ok(self.domain.wrap(position))
    }

    /// Gives numbers to the particles that have none, and refuses numbers given twice.
    fn number(&self, placed: &mut [Placed]) -> Result<()> {
        let mut seen: HashMap<u64, usize> = HashMap::new();
        for (i, p) in placed.iter().enumerate().filter(|(_, p)| p.has_id) {
            if let Some(first) = seen.insert(p.particle.id, i) {
                let id = p.particle.id;
                let lines = [&placed[first], p].map(|p| p.line.clone().unwrap_or_default());
                return Err(self.source.error(
                    &p.span,
                    &format!("the id {id} is given twice, in {} and {}", lines[0], lines[1]),
                    "in this file",
                    "every particle needs a number of its own; without a column `id` they are numbered in order",
                ));
            }
        }
        let first = seen.keys().max().map_or(0, |id| id + 1);
        for (id, p) in (first..).zip(placed.iter_mut().filter(|p| !p.has_id)) {
            p.particle.id = id;
        }
        Ok(())
    }
}
