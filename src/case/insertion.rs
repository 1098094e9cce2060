//! Particles that come and go during a run: what of them, when and where.

mod exchange;

use super::Setup;
use super::placement::CLEAR;
use crate::contact::GrownShape;
use crate::math::Vec3;
use crate::packing::insertion::{Bodies, Region};
use crate::particle::{Particle, Template};
use crate::wall::Surface;
pub(super) use exchange::{Exchange, refuse_engine};

/// Least gap between the surfaces of bodies, in their diameters.
const GAP: f64 = 1e-6;

/// Particles that are inserted during a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Insertion {
    /// Their `[[particles]]` section, counted from 0.
    pub section: usize,
    /// Shapes, orientations and velocities of the particles, in their order.
    pub bodies: Bodies,
    /// Region of their centres.
    pub region: Region,
    /// Their number over time.
    pub amount: Amount,
    /// First step, and the one at which the insertion has ended.
    pub steps: [u64; 2],
    /// Steps from one attempt to the next.
    pub every: u64,
    /// Most particles in all.
    pub most: u64,
    /// Mean volume of one (m^3).
    pub volume: f64,
}

/// Number of particles that are inserted over time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Amount {
    /// Particles per time (1/s).
    Rate(f64),
    /// Solid volume fraction up to which the region is filled (-).
    VolumeFraction(f64),
}

/// Largest speed (m/s) with this mean velocity and these largest deviations from it.
fn largest_speed([mean, spread]: [Vec3; 2]) -> f64 {
    (mean.abs() + spread).norm()
}

impl Insertion {
    /// Largest speed of an inserted particle (m/s).
    pub fn speed(&self) -> f64 {
        largest_speed(self.bodies.velocity)
    }

    /// True of a step before which particles are inserted, if some are due.
    pub fn is_attempted(&self, step: u64) -> bool {
        let [from, to] = self.steps;
        (from..to).contains(&step) && (step - from).is_multiple_of(self.every)
    }

    /// Particles that all attempts below step `end` insert if all find room, those by rate counted from the step `since` on: at each attempt
    /// those that are due until the next.
    pub fn due_before(&self, end: u64, since: u64, dt: f64) -> u64 {
        let [from, to] = self.steps;
        let Some(steps) = end.min(to).checked_sub(from.saturating_add(1)) else { return 0 };
        let last = from + (steps - steps.checked_rem(self.every).unwrap_or(0));
        self.due(last.saturating_add(self.every), since, dt)
    }

    /// Particles that are due by rate after `step` steps of length `dt` (s), counted from the step `since` on; all of them by volume fraction.
    fn due(&self, step: u64, since: u64, dt: f64) -> u64 {
        let Amount::Rate(rate) = self.amount else { return self.most };
        let [from, to] = self.steps;
        let steps = step.min(to).saturating_sub(from.max(since));
        // A whole number of particles is one, also after rounding.
        ((rate * dt * steps as f64 + 1e-9) as u64).min(self.most)
    }

    /// Particles that come within the first `step` steps of length `dt` (s), if all find room; of a volume fraction those that fill the region
    /// and move out of it at their first velocity.
    pub fn expected(&self, step: u64, dt: f64) -> u64 {
        let Amount::VolumeFraction(fraction) = self.amount else { return self.due_before(step, 0, dt) };
        let [from, to] = self.steps;
        let time = step.min(to).saturating_sub(from) as f64 * dt;
        let volume = volume_passed(&self.region, 0.0, self.bodies.velocity[0].abs(), time);
        ((fraction * volume / self.volume) as u64).min(self.most)
    }

    /// Numbers by template of the [expected](Self::expected) particles.
    pub fn at_end(&self, end_step: u64, dt: f64) -> impl Iterator<Item = (usize, usize)> {
        let count = self.expected(end_step, dt) as f64;
        self.bodies.fractions.iter().map(move |(template, part)| (*template, (part * count).ceil() as usize))
    }
}

impl Setup {
    /// Numbers of particles by template, of the start and those that come during the run, whether some go or not; none are 0.
    pub fn expected_counts(&self) -> impl Iterator<Item = (usize, usize)> {
        let later = self.insertions.iter().flat_map(|of| of.at_end(self.plan.end_step, self.time_step));
        self.start_counts().into_iter().enumerate().chain(later).filter(|(_, count)| *count > 0)
    }

    /// Number of these particles.
    pub fn expected_particles(&self) -> usize {
        self.expected_counts().map(|(_, count)| count).fold(0, usize::saturating_add)
    }

    /// True if particles come or go during the run.
    pub fn changes_population(&self) -> bool {
        !self.insertions.is_empty() || !self.removals.is_empty()
    }

    /// The `[[particles]]` sections that are counted as they come and go, ascending: those of free particles, if any come or go.
    pub fn counted_sections(&self) -> Vec<usize> {
        let changes = self.changes_population();
        let of_each =
            self.sections.iter().zip(&self.motions).filter(|(_, motion)| changes && motion.is_free());
        let mut sections: Vec<usize> = of_each.map(|(section, _)| *section).collect();
        sections.dedup();
        sections
    }
}

/// Volume (m^3) of a region that is grown by `reach` (m), and what leaves it in a `time` (s) at this speed along each axis (m/s).
fn volume_passed(region: &Region, reach: f64, speed: Vec3, time: f64) -> f64 {
    let edges = region.edges().add_scalar(2.0 * reach);
    let through = |i: usize| speed[i] * edges[(i + 1) % 3] * edges[(i + 2) % 3];
    edges.product() + time * (0..3).map(through).sum::<f64>()
}

/// Free particles that are removed during a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Removal {
    /// Their `[[particles]]` section, if not all.
    pub section: Option<usize>,
    /// Place at which they are removed.
    pub from: RemovedFrom,
}

/// Place at which particles are removed.
#[derive(Clone, Debug, PartialEq)]
pub enum RemovedFrom {
    /// Those whose centre is in it.
    Region(Region),
    /// Those whose centre is behind it.
    Plane(Surface),
    /// Those that touch it, as the face of the box is a wall to them.
    Outlet(Surface),
}

impl Removal {
    /// True of a particle that reaches this far (m) and is removed, if it would touch an outlet within a `time` (s).
    pub fn removes(&self, particle: &Particle, reach: f64, time: f64) -> bool {
        let at = particle.position();
        match &self.from {
            RemovedFrom::Region(region) => region.has(at),
            RemovedFrom::Plane(plane) => plane.distance(at) < 0.0,
            RemovedFrom::Outlet(face) => {
                let approach = -particle.velocity().dot(&face.normal(at));
                face.distance(at) <= reach + time * approach.max(0.0)
            }
        }
    }
}

/// Contours that keep inserted particles from touching anything, by template.
pub fn contours(templates: &[Template], enlargement: f64) -> Vec<GrownShape> {
    let grown = |template: &Template| {
        let gap = (CLEAR * enlargement).max(GAP * template.shape.equivalent_diameter());
        GrownShape::new(template.shape.clone(), gap)
    };
    templates.iter().map(grown).collect()
}
