//! Where the particles of a case are at the start.

use super::checks::at;
use super::file::{Case, ParticleSection};
use super::forms::{Entry, MovingEntry, Triple};
use super::located::Located;
use super::source::Source;
use crate::domain::Domain;
use crate::error::{Error, Result};
use crate::math::Vec3;
use crate::packing::{self, Ball, positions};
use crate::particle::{Particle, Template};
use std::collections::HashMap;
use std::fmt::Write;
use std::ops::Range;
use std::path::Path;

/// What the case file and its neighbours say about positions.
pub(super) struct Placer<'a> {
    pub(super) source: &'a Source,
    pub(super) case: &'a Case,
    pub(super) domain: Domain,
    pub(super) templates: &'a [Template],
    /// Folder that positions files are relative to.
    pub(super) folder: &'a Path,
}

/// A particle and where it was written; its id is final only where the file gave one.
struct Placed {
    particle: Particle,
    has_id: bool,
    span: Range<usize>,
    /// `name:line` in a positions file.
    line: Option<String>,
}

impl Placer<'_> {
    /// All particles, ascending ids.
    pub(super) fn place(&self) -> Result<Vec<Particle>> {
        let mut placed = Vec::new();
        let mut random = Vec::new();
        for (index, section) in self.case.particles.iter().enumerate() {
            let kind = &section.value;
            let key = format!("particles.{index}");
            let choices = [
                (
                    "volume_fraction",
                    kind.volume_fraction.as_ref().map(|v| v.span.clone()),
                ),
                ("count", kind.count.as_ref().map(|v| v.span.clone())),
                ("file", kind.file.as_ref().map(|v| v.span.clone())),
                (
                    "list",
                    kind.list
                        .as_ref()
                        .map(|l| l.first().map_or(section.span.clone(), |e| e.span.clone())),
                ),
            ];
            let choice = self.source.exactly_one(&key, &section.span, &choices)?;
            if choice < 2 {
                random.push((index, self.count(index, kind)?));
                continue;
            }
            for (name, span) in [
                ("seed", kind.seed.as_ref().map(|v| &v.span)),
                ("minimum_gap", kind.minimum_gap.as_ref().map(|v| &v.span)),
            ] {
                if let Some(span) = span {
                    let title = format!(
                        "`{key}.{name}` belongs to random positions, but `{key}` lists its positions"
                    );
                    return Err(self.source.error(span, &title, "has no effect here", "remove it"));
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
        let mut particles: Vec<Particle> = placed.into_iter().map(|p| p.particle).collect();
        self.pack(&random, &mut particles)?;
        particles.sort_by_key(|p| p.id);
        Ok(particles)
    }

    fn radius(&self, template: usize) -> f64 {
        self.templates[template].shape.circumradius()
    }

    /// Number of random particles of a kind, refused if there is no room for them.
    fn count(&self, index: usize, kind: &ParticleSection) -> Result<usize> {
        let volume = self.templates[index].shape.volume();
        let limit = packing::MAX_VOLUME_FRACTION;
        if let Some(fraction) = &kind.volume_fraction {
            let key = format!("particles.{index}.volume_fraction");
            let remedy = format!("random packing goes up to {limit}");
            let wanted = format!("above 0 and at most {limit}");
            self.source
                .satisfies(&key, fraction, |x| x > 0.0 && x <= limit, &wanted, &remedy)?;
            return Ok(packing::count_for_volume_fraction(&self.domain, fraction.value, volume) as usize);
        }
        let count = kind.count.as_ref().expect("checked by exactly_one");
        let most = (limit * self.domain.volume() / volume) as u64;
        if count.value > most {
            return Err(self.source.out_of_range(
                &format!("particles.{index}.count"),
                &count.span,
                &count.value.to_string(),
                &format!("at most {most}"),
                &format!("random packing goes up to a volume fraction of {limit}; take a larger box or fewer particles"),
            ));
        }
        Ok(count.value as usize)
    }

    fn read(&self, index: usize, file: &Located<String>, placed: &mut Vec<Placed>) -> Result<()> {
        let path = self.folder.join(&file.value);
        let name = path.display().to_string();
        let text = std::fs::read_to_string(&path).map_err(|e| {
            let title = format!("cannot read the positions file {name}: {e}");
            let remedy = "the path is relative to the case file";
            self.source.error(&file.span, &title, "this file", remedy)
        })?;
        for placement in positions::parse(&text, &name).map_err(Error::Input)? {
            let line = format!("{name}:{}", placement.line);
            let position = self.inside(&line, &file.span, placement.position)?;
            let mut particle = Particle::at(placement.id.unwrap_or(0), index, position);
            particle.set_orientation(&placement.orientation);
            placed.push(Placed {
                particle,
                has_id: placement.id.is_some(),
                span: file.span.clone(),
                line: Some(line),
            });
        }
        Ok(())
    }

    fn entry(&self, index: usize, key: &str, entry: &Located<Entry>) -> Result<Placed> {
        let still: Triple = [at(&entry.span, 0.0), at(&entry.span, 0.0), at(&entry.span, 0.0)];
        let moving = match &entry.value {
            Entry::Position(position) => MovingEntry {
                position: position.clone(),
                velocity: still.clone(),
                angular_velocity: still,
            },
            Entry::Moving(moving) => moving.clone(),
        };
        let numbers = |t: &Triple| {
            self.source
                .finite(key, &entry.span, t.each_ref().map(|x| x.value))
        };
        let position = self.inside(
            &format!("`{key}`"),
            &entry.span,
            numbers(&moving.position)?.into(),
        )?;
        let mut particle = Particle::at(0, index, position);
        particle.velocity = numbers(&moving.velocity)?;
        particle.angular_velocity = numbers(&moving.angular_velocity)?;
        // The body starts with its principal axes along those of the world.
        particle.angular_momentum = self.templates[index]
            .inertia()
            .component_mul(&particle.angular_velocity())
            .into();
        Ok(Placed {
            particle,
            has_id: false,
            span: entry.span.clone(),
            line: None,
        })
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

    fn refuse_overlaps(&self, placed: &[Placed]) -> Result<()> {
        let positions: Vec<Vec3> = placed.iter().map(|p| p.particle.position()).collect();
        let radii: Vec<f64> = placed
            .iter()
            .map(|p| self.radius(p.particle.template as usize))
            .collect();
        // Touching is allowed, and rounding must not make it an overlap.
        let reaches: Vec<f64> = radii.iter().map(|r| r * (1.0 - 1e-12)).collect();
        let pairs = packing::close_pairs(&self.domain, &positions, &reaches);
        let Some(&(first, second)) = pairs.first() else {
            return Ok(());
        };
        let mut list = String::new();
        for &(a, b) in pairs.iter().take(3) {
            let direct = positions[b] - positions[a];
            let nearest = self.domain.nearest_image(direct);
            let through = if nearest == direct {
                ""
            } else {
                ", through the periodic faces"
            };
            let names = [a, b].map(|i| match &placed[i].line {
                Some(line) => format!("{} ({line})", placed[i].particle.id),
                None => placed[i].particle.id.to_string(),
            });
            write!(
                list,
                "\nparticles {} and {}: centres {:.6e} m apart{through}, surfaces touch at {:.6e} m",
                names[0],
                names[1],
                nearest.norm(),
                radii[a] + radii[b]
            )
            .expect("a string can always grow");
        }
        if pairs.len() > 3 {
            write!(list, "\nand {} more", pairs.len() - 3).expect("a string can always grow");
        }
        let title = format!("{} pairs of particles overlap at the start", pairs.len());
        let spans = [&placed[first].span, &placed[second].span];
        let places = [(spans[0], "one of them"), (spans[1], "the other")];
        let places = if spans[0] == spans[1] {
            &[(spans[0], "from here")][..]
        } else {
            &places[..]
        };
        Err(self.source.error_at(
            places,
            &title,
            &format!("move them apart or take smaller ones:{list}"),
        ))
    }

    /// Adds the random particles, at a distance from all others.
    fn pack(&self, random: &[(usize, usize)], particles: &mut Vec<Particle>) -> Result<()> {
        let Some(&(first, _)) = random.first() else {
            return Ok(());
        };
        let mut gaps = vec![0.0; self.templates.len()];
        let mut seed = 0_u64;
        for &(index, _) in random {
            let kind = &self.case.particles[index].value;
            let key = format!("particles.{index}.minimum_gap");
            gaps[index] = match &kind.minimum_gap {
                Some(gap) => self.source.non_negative(&key, gap, "gaps are in metres")?,
                None => 2.0 * self.radius(index) * packing::DEFAULT_GAP,
            };
            // One section: its own seed. Several: each of them matters.
            seed = seed
                .wrapping_mul(0x9E37_79B9_7F4A_7C15)
                .wrapping_add(kind.seed.as_ref().map_or(1, |s| s.value));
        }
        let ball = |index: usize| Ball {
            radius: self.radius(index),
            half_gap: 0.5 * gaps[index],
        };
        let fixed: Vec<(Vec3, Ball)> = particles
            .iter()
            .map(|p| (p.position(), ball(p.template as usize)))
            .collect();
        let kinds: Vec<usize> = random
            .iter()
            .flat_map(|&(index, count)| std::iter::repeat_n(index, count))
            .collect();
        let balls: Vec<Ball> = kinds.iter().map(|&index| ball(index)).collect();
        let fraction = |grow: f64| {
            let all = fixed.iter().map(|(_, b)| b).chain(&balls);
            let volume = |b: &Ball| 4.0 / 3.0 * std::f64::consts::PI * (b.radius + grow * b.half_gap).powi(3);
            all.map(volume).sum::<f64>() / self.domain.volume()
        };
        let (solid, grown) = (fraction(0.0), fraction(1.0));
        // One particle more than the fraction asks for is a rounding, not a denser packing.
        let one = balls.iter().map(|b| 4.2 * b.radius.powi(3)).fold(0.0, f64::max) / self.domain.volume();
        let packed = if solid <= packing::MAX_VOLUME_FRACTION + one && grown <= packing::MAX_GROWN_FRACTION {
            packing::pack(&self.domain, &fixed, &balls, seed)
        } else {
            None
        };
        let Some(packed) = packed else {
            let kind = &self.case.particles[first];
            let gap = kind.value.minimum_gap.as_ref().map(|g| &g.span);
            return Err(self.source.error(
                gap.unwrap_or(&kind.span),
                &format!(
                    "no room for {} random particles: volume fraction {solid:.3}, with their gaps {grown:.3}",
                    balls.len()
                ),
                "random positions",
                &format!(
                    "random packing goes up to a volume fraction of {} and, with the gaps, {}; take fewer particles, a \
                     larger box or a smaller `minimum_gap`",
                    packing::MAX_VOLUME_FRACTION,
                    packing::MAX_GROWN_FRACTION
                ),
            ));
        };
        let next = particles.iter().map(|p| p.id + 1).max().unwrap_or(0);
        for (id, (position, kind)) in (next..).zip(packed.into_iter().zip(kinds)) {
            particles.push(Particle::at(id, kind, position));
        }
        Ok(())
    }
}
