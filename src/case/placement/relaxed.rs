//! Listed particles that overlap, moved apart within a distance, by the means of the random packing.

use super::{Candidate, Placer};
use crate::case::file::{Overlaps, ParticleSection, RelaxDistance};
use crate::case::kinds::Kind;
use crate::contact::GrownShape;
use crate::error::Result;
use crate::math::Vec3;
use crate::packing::relax::{Pose, relax};
use crate::particle::{Particle, Template};
use crate::wall::Surface;

/// Furthest that a point of a particle is moved by default, in diameters of the sphere of equal volume.
const DISTANCE: f64 = 0.5;

/// True of a section whose particles may be moved apart.
pub(super) fn relaxes(section: &ParticleSection) -> bool {
    section.overlaps == Some(Overlaps::Relax)
}

impl Placer<'_> {
    /// Refuses keys that have no effect on the particles of a section.
    pub(super) fn check_relaxed(&self, key: &str, section: &ParticleSection) -> Result<()> {
        let (name, title) = if section.overlaps.is_some() && section.is_random() {
            let name = format!("{key}.overlaps");
            let title = format!(
                "`{name}` belongs to particles of a list or a file, but those of `{key}` are at random"
            );
            (name, title)
        } else if section.relax_distance.is_some() && !relaxes(section) {
            let name = format!("{key}.relax_distance");
            let title =
                format!("`{name}` belongs to `overlaps = \"relax\"`, but overlaps of `{key}` are refused");
            (name, title)
        } else {
            return Ok(());
        };
        Err(self.document.error(&name, &title, "has no effect here", "remove it"))
    }

    /// Shapes with half of the gaps that listed particles keep, where overlaps are relaxed.
    pub(super) fn relaxed_contours(&self) -> Vec<GrownShape> {
        let gaps = self.kinds.of_each(|index, _| {
            let section = &self.document.case.particles[index];
            section.minimum_gap.filter(|_| relaxes(section)).unwrap_or(0.0)
        });
        self.contours(gaps)
    }

    /// Shapes with half of the gaps that their bodies keep, by template (m).
    pub(super) fn contours(&self, gaps: Vec<f64>) -> Vec<GrownShape> {
        let grown = |(template, gap): (&Template, f64)| GrownShape::new(template.shape.clone(), 0.5 * gap);
        self.kinds.templates.iter().zip(gaps).map(grown).collect()
    }

    /// Furthest that a point of a particle may be moved (m), if it may.
    pub(super) fn relax_limit(&self, template: usize) -> Option<f64> {
        let is_of = |kind: &Kind| kind.templates().contains(&template);
        let index = self.kinds.sections.iter().position(is_of)?;
        let section = &self.document.case.particles[index];
        let diameter = self.kinds.templates[template].shape.equivalent_diameter();
        relaxes(section).then_some(match section.relax_distance {
            Some(RelaxDistance::Metres(distance)) => distance,
            Some(RelaxDistance::Relative(relative)) => relative.diameters * diameter,
            None => DISTANCE * diameter,
        })
    }

    /// Moves the particles apart whose sections say so, and returns a note on how far. What still overlaps is left for
    /// [`refuse_overlaps`](Self::refuse_overlaps).
    pub(super) fn relax(&self, placed: &mut [Candidate]) -> Option<String> {
        let limit = |placed: &Candidate| self.relax_limit(placed.particle.template as usize);
        // Those that stay come first.
        let mut order: Vec<usize> = (0..placed.len()).collect();
        order.sort_by_key(|&i| limit(&placed[i]).is_some());
        let fixed = order.iter().filter(|&&i| limit(&placed[i]).is_none()).count();
        let first = order.get(fixed)?;
        let section = placed[*first].key.split('.').take(2).collect::<Vec<_>>().join(".");
        let starts: Vec<Pose> = order.iter().map(|&i| pose(&placed[i].particle)).collect();
        let bounds: Vec<f64> = order.iter().map(|&i| limit(&placed[i]).unwrap_or(0.0)).collect();
        let mut poses = starts.clone();
        let walls: Vec<Surface> = self.walls.iter().map(|placed| placed.wall.surface.clone()).collect();
        relax(self.domain, &walls, &self.relaxed_contours(), &mut poses, fixed, Some(&bounds));

        let (mut count, mut sum, mut most, mut turn) = (0_usize, 0.0, 0.0_f64, 0.0_f64);
        for ((&i, start), pose) in order.iter().zip(&starts).zip(&poses).skip(fixed) {
            // What overlaps now was not meant to.
            placed[i].in_motion = false;
            if pose == start {
                continue;
            }
            let shape = &self.kinds.templates[pose.contour].shape;
            // The turns of a sphere are rounding.
            let orientation = if shape.as_sphere().is_some() { start.orientation } else { pose.orientation };
            let pose = Pose { orientation, ..*pose };
            let (way, angle) = pose.moved_from(&self.domain, start, shape.circumradius());
            (count, sum, most, turn) = (count + 1, sum + way, most.max(way), turn.max(angle));
            let particle = &mut placed[i].particle;
            let motion = [particle.velocity(), particle.angular_velocity()];
            particle.position = pose.position.into();
            particle.set_orientation(&orientation);
            if motion != [Vec3::zeros(); 2] {
                *particle = self.particle(particle.id, pose.contour, (pose.position, orientation), motion);
            }
        }
        let all = poses.len() - fixed;
        let mean = sum / count.max(1) as f64;
        let title = match count {
            0 => format!("none of {all} particles overlaps at the start, so none was moved apart"),
            _ => format!(
                "{count} of {all} particles were moved apart, by {mean:.3e} m in the mean and {most:.3e} m at most, with turns \
                 of up to {turn:.2} degrees"
            ),
        };
        Some(self.document.warning(&format!("{section}.overlaps"), &title, "relaxed here", ""))
    }
}

pub(in crate::case) fn pose(particle: &Particle) -> Pose {
    Pose {
        contour: particle.template as usize,
        position: particle.position(),
        orientation: particle.orientation(),
    }
}

#[cfg(test)]
mod tests;
