//! Particles from files of positions.

use super::{Placed, Placer};
use crate::case::file::ParticleSection;
use crate::error::{Error, Result};
use crate::input;
use crate::math::Vec3;
use crate::packing::positions::{self, Placement};
use crate::particle::Particle;

/// Relative difference up to which diameters are the same: a text may have few digits.
const SAME_DIAMETER: f64 = 1e-6;

impl Placer<'_> {
    /// Adds the particles of a section that reads a file: all of it, or the rows of its kind.
    pub(super) fn read(&self, index: usize, file: &str, placed: &mut Vec<Placed>) -> Result<()> {
        let name = self.files.path(file).display().to_string();
        let key = format!("particles.{index}.file");
        let refused = |title: &str, remedy: &str| self.document.error(&key, title, "this file", remedy);
        let bytes = self.files.contents(file, input::POSITIONS);
        let text = bytes
            .and_then(|bytes| String::from_utf8(bytes).map_err(|_| "it is not UTF-8 text".to_string()))
            .map_err(|what| {
                let title = format!("cannot read the positions file {name}: {what}");
                refused(&title, "the path is relative to the case file")
            })?;
        let bad = |text: String| Error::Parse {
            path: name.clone().into(),
            line: (text.strip_prefix(&format!("{name}:")))
                .and_then(|rest| rest.split(':').next()?.parse().ok())
                .unwrap_or(0),
            text,
        };
        let before = placed.len();
        for placement in positions::parse(&text, &name).map_err(bad)? {
            let is_of_another = self.is_of_another(index, file, &name, &placement);
            if is_of_another.map_err(|(title, remedy)| refused(&title, remedy))? {
                continue;
            }
            let line = format!("{name}:{}", placement.line);
            let position = self.inside(&line, &key, placement.position)?;
            let template = self.sized(index, &name, &placement);
            let template = template.map_err(|(title, remedy)| refused(&title, remedy))?;
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
            placed.push(Placed {
                particle,
                has_id: placement.id.is_some(),
                key: key.clone(),
                line: Some(line),
                in_motion: placement.motion.is_some(),
            });
        }
        if placed.len() == before {
            let title = format!("{name} holds no particles of kind {index}, those of `particles.{index}`");
            let remedy = "kinds are the [[particles]] sections, counted from 0; a section without particles has `count = 0`";
            return Err(refused(&title, remedy));
        }
        Ok(())
    }

    /// True if a row belongs to another section, which must read the file, too; else an error and its remedy.
    fn is_of_another(
        &self,
        index: usize,
        file: &str,
        name: &str,
        placement: &Placement,
    ) -> std::result::Result<bool, (String, &'static str)> {
        let sections = &self.document.case.particles;
        let reads = |section: &ParticleSection| section.file.as_deref() == Some(file);
        let Some((kind, column)) = placement.kind else {
            return match sections.iter().filter(|section| reads(section)).count() {
                1 => Ok(false),
                count => Err((
                    format!("{name} has no column `kind`, but {count} [[particles]] sections read it"),
                    "a column `kind` says which section, counted from 0, a line belongs to",
                )),
            };
        };
        let section = usize::try_from(kind).ok().and_then(|i| sections.get(i));
        if section.is_some_and(reads) {
            return Ok(kind != index as u64);
        }
        let line = placement.line;
        let why = match section {
            Some(_) => format!("`particles.{kind}` does not read this file"),
            None => format!("the case has {} [[particles]] sections", sections.len()),
        };
        let remedy = "a line of kind n belongs to the n-th [[particles]] section, counted from 0: give each the same `file`";
        Err((format!("{name}:{line}:{column}: `kind` is {kind}, but {why}"), remedy))
    }

    /// The template of a row: that of its diameter; else an error and its remedy.
    fn sized(
        &self,
        index: usize,
        name: &str,
        placement: &Placement,
    ) -> std::result::Result<usize, (String, &'static str)> {
        let templates = self.kinds.sections[index].templates();
        let Some((diameter, column)) = placement.diameter else {
            if templates.len() == 1 {
                return Ok(templates.start);
            }
            let count = templates.len();
            let title = format!("`particles.{index}` has {count} sizes, but {name} has no column `diameter`");
            let remedy =
                "a column `diameter` (m, of the sphere of equal volume) says which size a particle has";
            return Err((title, remedy));
        };
        let of = |template: usize| self.kinds.templates[template].shape.equivalent_diameter();
        let off = |template: usize| (of(template) - diameter).abs();
        let nearest = templates.min_by(|a, b| off(*a).total_cmp(&off(*b))).expect("every kind has a size");
        if off(nearest) <= SAME_DIAMETER * of(nearest) {
            return Ok(nearest);
        }
        let (line, size) = (placement.line, of(nearest));
        let title = format!(
            "{name}:{line}:{column}: `diameter` is {diameter} m, but the nearest size of `particles.{index}` is {size} m"
        );
        let remedy =
            "diameters are those of spheres of equal volume: give the shape this size, or list it in `sizes`";
        Err((title, remedy))
    }
}
