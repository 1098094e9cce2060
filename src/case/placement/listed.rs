//! Particles from files of positions.

use super::{Candidate, Placer};
use crate::case::listed::{Listed, SAME_DIAMETER};
use crate::error::Result;
use crate::math::Vec3;
use crate::packing::positions::{self, Placement};
use crate::particle::Particle;

impl Placer<'_> {
    /// Adds the particles that a section has read from a file.
    pub(super) fn add_listed(
        &self,
        index: usize,
        listed: &Listed,
        placed: &mut Vec<Candidate>,
    ) -> Result<()> {
        let key = format!("particles.{index}.file");
        for placement in &listed.placements {
            let line = positions::place(&listed.name, placement, 0);
            let position = self.inside(&line, &key, placement.position)?;
            let template = self.sized(index, &listed.name, placement);
            let template =
                template.map_err(|(title, remedy)| self.document.error(&key, &title, "this file", remedy))?;
            let orientation = self.kinds.sections[index].turned(&placement.orientation);
            let id = placement.id.unwrap_or(0);
            let particle = match placement.motion {
                Some(motion) if motion != [Vec3::zeros(); 2] => {
                    self.particle(id, template, (position, orientation), motion)
                }
                _ => {
                    let mut particle = Particle::at(id, template, position);
                    particle.set_orientation(&orientation);
                    particle
                }
            };
            placed.push(Candidate {
                particle,
                has_id: placement.id.is_some(),
                key: key.clone(),
                line: Some(line),
                in_motion: placement.motion.is_some(),
            });
        }
        Ok(())
    }

    /// The template of a particle: that of its diameter; else an error and its remedy.
    fn sized(
        &self,
        index: usize,
        name: &str,
        placement: &Placement,
    ) -> std::result::Result<usize, (String, &'static str)> {
        let kind = &self.kinds.sections[index];
        let Some((diameter, column)) = placement.diameter else {
            let count = kind.templates().len();
            if count == 1 {
                return Ok(kind.first);
            }
            let title = format!("`particles.{index}` has {count} sizes, but {name} has no column `diameter`");
            let remedy =
                "a column `diameter` (m, of the sphere of equal volume) says which size a particle has";
            return Err((title, remedy));
        };
        let (size, template) = kind.nearest(diameter);
        if (size - diameter).abs() <= SAME_DIAMETER * size {
            return Ok(template);
        }
        let place = positions::place(name, placement, column);
        let title = format!(
            "{place}: `diameter` is {diameter} m, but the nearest size of `particles.{index}` is {size} m"
        );
        let remedy = "diameters are those of spheres of equal volume: give the shape this size, or list it in `sizes`; without \
                      `sizes` every particle has its own";
        Err((title, remedy))
    }
}
