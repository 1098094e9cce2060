//! Particles from files of positions.

use super::{Placed, Placer};
use crate::case::file::ParticleSection;
use crate::case::located::Located;
use crate::error::{Error, Result};
use crate::input;
use crate::math::Vec3;
use crate::packing::positions::{self, Placement};
use crate::particle::Particle;

/// Relative difference of diameters that are the same: a text may have few digits.
const SAME_DIAMETER: f64 = 1e-6;

impl Placer<'_> {
    /// Adds the particles of a section that reads a file: all of it, or the rows of its kind.
    pub(super) fn read(&self, index: usize, file: &Located<String>, placed: &mut Vec<Placed>) -> Result<()> {
        let name = self.files.path(&file.value).display().to_string();
        let text = self
            .files
            .contents(&file.value, input::POSITIONS)
            .and_then(|bytes| String::from_utf8(bytes).map_err(|_| "it is not UTF-8 text".to_string()))
            .map_err(|what| {
                let title = format!("cannot read the positions file {name}: {what}");
                let remedy = "the path is relative to the case file";
                self.source.error(&file.span, &title, "this file", remedy)
            })?;
        let mut read = 0;
        let bad = |text: String| Error::Parse {
            path: name.clone().into(),
            line: (text.strip_prefix(&format!("{name}:")))
                .and_then(|rest| rest.split(':').next()?.parse().ok())
                .unwrap_or(0),
            text,
        };
        for placement in positions::parse(&text, &name).map_err(bad)? {
            if self.is_of_another(index, file, &name, &placement)? {
                continue;
            }
            read += 1;
            let line = format!("{name}:{}", placement.line);
            let position = self.inside(&line, &file.span, placement.position)?;
            let template = self.sized(index, file, &name, &placement)?;
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
                span: file.span.clone(),
                line: Some(line),
                in_motion: placement.motion.is_some(),
            });
        }
        if read == 0 {
            let title = format!("{name} holds no particles of kind {index}, those of `particles.{index}`");
            let remedy = "kinds are the [[particles]] sections, counted from 0; a section without particles has `count = 0`";
            return Err(self.source.error(&file.span, &title, "read for these", remedy));
        }
        Ok(())
    }

    /// True if a row belongs to another section, which must read the file, too.
    fn is_of_another(
        &self,
        index: usize,
        file: &Located<String>,
        name: &str,
        placement: &Placement,
    ) -> Result<bool> {
        let reads = |section: &Located<ParticleSection>| {
            let named = section.value.file.as_ref();
            named.is_some_and(|other| other.value == file.value)
        };
        let Some(kind) = placement.kind else {
            return match self.case.particles.iter().filter(|section| reads(section)).count() {
                1 => Ok(false),
                count => {
                    let title =
                        format!("{name} has no column `kind`, but {count} [[particles]] sections read it");
                    let remedy = "a column `kind` says which section, counted from 0, a line belongs to";
                    Err(self.source.error(&file.span, &title, "one of them", remedy))
                }
            };
        };
        let section = usize::try_from(kind.value).ok().and_then(|i| self.case.particles.get(i));
        if section.is_some_and(reads) {
            return Ok(kind.value != index as u64);
        }
        let (line, column, kind) = (placement.line, kind.column, kind.value);
        let why = match section {
            Some(_) => format!("`particles.{kind}` does not read this file"),
            None => format!("the case has {} [[particles]] sections", self.case.particles.len()),
        };
        let title = format!("{name}:{line}:{column}: `kind` is {kind}, but {why}");
        let remedy = "a line of kind n belongs to the n-th [[particles]] section, counted from 0: give each the same `file`";
        Err(self.source.error(&file.span, &title, "this file", remedy))
    }

    /// The template of a row: that of its diameter.
    fn sized(
        &self,
        index: usize,
        file: &Located<String>,
        name: &str,
        placement: &Placement,
    ) -> Result<usize> {
        let templates = self.kinds.sections[index].templates();
        let Some(diameter) = placement.diameter else {
            if templates.len() == 1 {
                return Ok(templates.start);
            }
            let title = format!(
                "`particles.{index}` has {} sizes, but {name} has no column `diameter`",
                templates.len()
            );
            let remedy =
                "a column `diameter` (m, of the sphere of equal volume) says which size a particle has";
            return Err(self.source.error(&file.span, &title, "this file", remedy));
        };
        let of = |template: usize| self.kinds.templates[template].shape.equivalent_diameter();
        let off = |template: usize| (of(template) - diameter.value).abs();
        let nearest =
            (templates.clone().min_by(|a, b| off(*a).total_cmp(&off(*b)))).expect("every kind has a size");
        if off(nearest) <= SAME_DIAMETER * of(nearest) {
            return Ok(nearest);
        }
        let title = format!(
            "{name}:{}:{}: `diameter` is {} m, but the nearest size of `particles.{index}` is {} m",
            placement.line,
            diameter.column,
            diameter.value,
            of(nearest)
        );
        let remedy =
            "diameters are those of spheres of equal volume: give the shape this size, or list it in `sizes`";
        Err(self.source.error(&file.span, &title, "this file", remedy))
    }
}
