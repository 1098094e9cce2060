//! Particles that come and go as the case says, between two steps: first those go that are removed, then others come.
//!
//! Every rank finds the same positions for new particles, from all particles near the region. What is due follows from the step and the
//! [`Record`], which checkpoints have; random numbers follow from the seed, the number of the particle and the step.

use super::Simulation;
use crate::case::Setup;
use crate::case::insertion::{Amount, Insertion, Removal, contours};
use crate::contact::GrownShape;
use crate::coupling::CONTROL_INTERVAL;
use crate::error::{Error, Result};
use crate::packing::insertion::Obstacles;
use crate::packing::relax::Pose;
use crate::particle::{Particle, PrescribedMotion};
use serde::{Deserialize, Serialize};

/// Part of the particles that are due by rate from which those that have found no room are worth a warning.
const BEHIND: f64 = 0.05;

/// Insertions and removals of a case.
pub(super) struct Plan {
    insertions: Vec<Insertion>,
    removals: Vec<Removal>,
    /// By template, with half of the gap that inserted particles keep; empty if nothing is inserted.
    contours: Vec<GrownShape>,
    /// Distance by which surfaces are grown for contacts (m).
    enlargement: f64,
    /// The `[[particles]]` section of each template, and whether its motion is free.
    sections: Vec<(usize, bool)>,
}

/// Particles that have come and gone since the start, the same on every rank.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Record {
    /// By template.
    pub(super) inserted: Vec<i64>,
    pub(super) removed: Vec<i64>,
    /// Of each insertion of the case.
    insertions: Vec<Progress>,
}

/// Progress of an insertion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Progress {
    /// Step from which on it counts.
    since: u64,
    /// Particles that have come.
    count: u64,
}

impl Plan {
    pub(super) fn of(setup: &Setup) -> Self {
        let enlargement = setup.contact.as_ref().map_or(0.0, |contact| contact.enlargement);
        let contours =
            if setup.insertions.is_empty() { Vec::new() } else { contours(&setup.templates, enlargement) };
        let free = setup.motions.iter().map(PrescribedMotion::is_free);
        Self {
            insertions: setup.insertions.clone(),
            removals: setup.removals.clone(),
            contours,
            enlargement,
            sections: setup.sections.iter().copied().zip(free).collect(),
        }
    }

    /// True if no particle comes or goes.
    pub(super) fn is_empty(&self) -> bool {
        self.insertions.is_empty() && self.removals.is_empty()
    }
}

impl Record {
    /// Of a run that begins after `step` steps.
    pub(super) fn new(templates: usize, plan: &Plan, step: u64) -> Self {
        let none = vec![0; templates];
        let mut record = Self { inserted: none.clone(), removed: none, insertions: Vec::new() };
        record.restart(plan, step);
        record
    }

    /// Counts the insertions of the case from a step on.
    pub(super) fn restart(&mut self, plan: &Plan, step: u64) {
        self.insertions = vec![Progress { since: step, count: 0 }; plan.insertions.len()];
    }

    /// True if particles have come or gone, or will.
    pub(super) fn tells(&self) -> bool {
        let some = |counts: &[i64]| counts.iter().any(|count| *count != 0);
        some(&self.inserted) || some(&self.removed) || !self.insertions.is_empty()
    }

    /// Numbers of particles by template, from those at the start.
    pub(super) fn counts(&self, start: &[i64]) -> Vec<i64> {
        let changes = self.inserted.iter().zip(&self.removed);
        start
            .iter()
            .zip(changes)
            .map(|(start, (come, gone))| start.wrapping_add(*come).wrapping_sub(*gone))
            .collect()
    }

    /// Takes over what a checkpoint of `step` has.
    ///
    /// # Errors
    /// [`Error::Input`] if it is not of this many templates.
    pub(super) fn restore(&mut self, saved: Self, plan: &Plan, step: u64) -> Result<()> {
        let templates = self.inserted.len();
        if saved.inserted.len() != templates || saved.removed.len() != templates {
            let what = "the numbers of particles that have come and gone in the common state are not those of the case";
            return Err(Error::Input(what.to_string()));
        }
        *self = saved;
        // Of a branch with other insertions.
        if self.insertions.len() != plan.insertions.len() {
            self.restart(plan, step);
        }
        Ok(())
    }
}

impl Simulation {
    /// Particles of each template that have been inserted since the start, and those that have been removed; the same on every rank.
    pub fn come_and_gone(&self) -> [&[i64]; 2] {
        [&self.record.inserted, &self.record.removed]
    }

    /// Removes and inserts what the case says before the coming step. Collective.
    pub(super) fn come_and_go(&mut self) -> Result<()> {
        let plan = self.plan.clone();
        if !plan.removals.is_empty() && self.step.is_multiple_of(CONTROL_INTERVAL) {
            let own = self.to_remove(&plan);
            if self.comm.any(!own.is_empty()) {
                self.remove(&own)?;
            }
        }
        for (n, insertion) in plan.insertions.iter().enumerate() {
            if insertion.is_attempted(self.step) {
                self.insert_due(n, insertion, &plan.contours)?;
            }
        }
        Ok(())
    }

    /// Particles of this rank that are removed now.
    fn to_remove(&self, plan: &Plan) -> Vec<u64> {
        let time = CONTROL_INTERVAL as f64 * self.units.dt;
        let is_removed = |particle: &&Particle| {
            let (section, free) = plan.sections[particle.template as usize];
            let reach = self.templates[particle.template as usize].shape.circumradius() + plan.enlargement;
            let own = |removal: &&Removal| removal.section.is_none_or(|one| one == section);
            free && plan.removals.iter().filter(own).any(|removal| removal.removes(particle, reach, time))
        };
        self.particles().iter().filter(is_removed).map(|particle| particle.id).collect()
    }

    /// Inserts as many of the due particles as find room, in their order. Collective.
    fn insert_due(&mut self, n: usize, insertion: &Insertion, contours: &[GrownShape]) -> Result<()> {
        let Progress { since, count } = self.record.insertions[n];
        let due = insertion.due_before(self.step + 1, since, self.units.dt).saturating_sub(count);
        if due == 0 {
            return Ok(());
        }
        let near = self.near(insertion, contours);
        let volume = |template: usize| self.templates[template].shape.volume();
        let mut left = match insertion.amount {
            Amount::Rate(_) => f64::INFINITY,
            Amount::VolumeFraction(fraction) => {
                let inside = near.iter().filter(|particle| insertion.region.has(particle.position()));
                let there: f64 = inside.map(|particle| volume(particle.template as usize)).sum();
                fraction * insertion.region.edges().product() - there
            }
        };
        let walls: Vec<_> = self.walls.iter().map(|wall| wall.surface_at(self.time())).collect();
        let poses = near.iter().map(|particle| Pose {
            contour: particle.template as usize,
            position: particle.position(),
            orientation: particle.orientation(),
        });
        let mut obstacles = Obstacles::new(self.domain, &walls, contours, poses.collect());
        let mut new = Vec::new();
        for number in count..count.saturating_add(due) {
            left -= volume(insertion.bodies.nth(number).template);
            if left < 0.0 {
                break;
            }
            let found = obstacles.insert(&insertion.bodies, number, self.step, &insertion.region);
            let Some((body, pose)) = found else { break };
            let mut particle = Particle::at(0, body.template, pose.position);
            particle.set_orientation(&pose.orientation);
            particle.velocity = body.velocity.into();
            new.push(particle);
        }
        self.record.insertions[n].count += new.len() as u64;
        if new.is_empty() {
            return Ok(());
        }
        // All ranks have found the same; one hands it over.
        let own = if self.comm.rank() == 0 { &new[..] } else { &[] };
        self.insert(own).map(|_| ())
    }

    /// The particles of all ranks that an inserted one could touch, ascending by id, the same on every rank. Collective.
    fn near(&self, insertion: &Insertion, contours: &[GrownShape]) -> Vec<Particle> {
        let reach = |template: usize| contours[template].reach();
        let widest =
            insertion.bodies.fractions.iter().map(|(template, _)| reach(*template)).fold(0.0, f64::max);
        let is_near = |particle: &&Particle| {
            let distance = insertion.region.distance(&self.domain, particle.position());
            distance <= widest + reach(particle.template as usize)
        };
        let own: Vec<Particle> = self.particles().iter().filter(is_near).copied().collect();
        let all = self.comm.all_gather(bytemuck::cast_slice(&own).to_vec());
        let mut all: Vec<Particle> = bytemuck::pod_collect_to_vec(&all.concat());
        all.sort_unstable_by_key(|particle| particle.id);
        all
    }

    /// A warning if many particles that are due by rate have found no room.
    pub(super) fn insertion_is_behind(&self) -> Option<String> {
        let all = self.plan.insertions.iter().zip(&self.record.insertions).enumerate();
        let mut behind = all.filter_map(|(n, (insertion, progress))| {
            if !matches!(insertion.amount, Amount::Rate(_)) {
                return None;
            }
            let due = insertion.due_before(self.step, progress.since, self.units.dt);
            let waiting = due.saturating_sub(progress.count);
            (waiting as f64 > BEHIND * due as f64 && waiting > 1).then(|| {
                format!("of the {due} particles of `insertion.{n}` that are due, {waiting} have found no room in its region and wait")
            })
        });
        behind.next()
    }
}

#[cfg(test)]
mod tests;
