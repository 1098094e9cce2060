//! Particles at random places, clear of each other, of those that are listed, and of walls.

use super::Placer;
use crate::case::file::ParticleSection;
use crate::contact::GrownShape;
use crate::error::{Error, Result};
use crate::math::{Quat, Vec3};
use crate::memory;
use crate::packing::mix::mix;
use crate::packing::relax::{Pose, random_orientations, relax};
use crate::packing::{self, Ball};
use crate::particle::Particle;
use crate::wall::Surface;
use std::ops::Range;

/// Default gaps in units of those at which surfaces that are grown for contacts just touch.
const CLEAR: f64 = 1.001;

impl Placer<'_> {
    /// Number of random particles of a kind, refused if there is no room for them.
    pub(super) fn count(&self, index: usize, kind: &ParticleSection) -> Result<usize> {
        let templates = &self.kinds.templates[self.kinds.sections[index].templates()];
        let shares = &self.kinds.sections[index].shares;
        let volume: f64 =
            templates.iter().zip(shares).map(|(template, share)| share * template.shape.volume()).sum();
        let limit = packing::MAX_VOLUME_FRACTION;
        if let Some(fraction) = &kind.volume_fraction {
            return Ok(packing::count_for_volume_fraction(self.free_volume, fraction.value, volume) as usize);
        }
        let count = kind.count.as_ref().expect("checked by exactly_one");
        let most = (limit * self.free_volume / volume) as u64;
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

    /// Refuses more particles than this process has memory for, before any is placed.
    fn refuse_too_many(&self, index: usize, count: usize) -> Result<()> {
        let needed = count as f64 * memory::PER_PARTICLE;
        let Some(room) = memory::rooms().into_iter().find(|room| needed > room.bytes) else {
            return Ok(());
        };
        let title = format!(
            "`particles.{index}` asks for {count} particles, which need about {}, but {}",
            memory::in_bytes(needed),
            room.limit
        );
        let remedy = "take fewer or larger particles, or a smaller box";
        let span = &self.case.particles[index].span;
        Err(self.source.error(span, &title, "too many for the memory", remedy))
    }

    /// Adds the random particles, at a distance from all others: by default one at which none begins in contact. Where there
    /// is no room for that, or the case asks for less, it is said in `warnings`.
    pub(super) fn pack(
        &self,
        random: &[(usize, usize)],
        particles: &mut Vec<Particle>,
        warnings: &mut Vec<String>,
    ) -> Result<()> {
        let Some(&(first, _)) = random.first() else {
            return Ok(());
        };
        for &(index, count) in random {
            self.refuse_too_many(index, count)?;
        }
        let clear = CLEAR * 2.0 * self.enlargement;
        for &(index, _) in random {
            let gap = self.case.particles[index].value.minimum_gap.as_ref();
            if let Some(gap) = gap.filter(|gap| gap.value < clear / CLEAR) {
                warnings.push(self.begins_in_contact(index, &gap.span, gap.value, clear));
            }
        }
        let Err(refused) = self.pack_with(first, random, particles, clear) else {
            return Ok(());
        };
        let by_default = random.iter().map(|&(index, _)| index);
        let Some(index) = by_default
            .filter(|&index| self.case.particles[index].value.minimum_gap.is_none())
            .find(|_| clear > 0.0)
        else {
            return Err(refused);
        };
        self.pack_with(first, random, particles, 0.0)?;
        let kind = &self.case.particles[index];
        let gap = 2.0
            * self.kinds.sections[index].templates().map(|t| self.radius(t)).fold(0.0, f64::max)
            * packing::DEFAULT_GAP;
        warnings.push(self.begins_in_contact(index, &kind.span, gap, clear));
        Ok(())
    }

    /// Radius (m) of the sphere of the same volume.
    fn radius(&self, template: usize) -> f64 {
        let shape = &self.kinds.templates[template].shape;
        shape.as_sphere().unwrap_or_else(|| 0.5 * shape.equivalent_diameter())
    }

    fn begins_in_contact(&self, index: usize, span: &Range<usize>, gap: f64, clear: f64) -> String {
        self.source.warning(
            span,
            &format!(
                "random particles begin in contact: `particles.{index}` keeps gaps of {gap:.3e} m, but surfaces are grown by \
                 {:.3e} m for contacts",
                self.enlargement
            ),
            "neighbours push each other apart from the start",
            &format!(
                "for a start at rest take fewer particles or more cells per diameter, and `minimum_gap` of {clear:.3e} m or \
                 none"
            ),
        )
    }

    /// As [`pack`](Self::pack), with default gaps of at least `clear` (m).
    fn pack_with(
        &self,
        first: usize,
        random: &[(usize, usize)],
        particles: &mut Vec<Particle>,
        clear: f64,
    ) -> Result<()> {
        let templates = &self.kinds.templates;
        let mut gaps = vec![0.0; templates.len()];
        let mut drawn = Vec::new();
        let mut seed = 0_u64;
        for &(index, count) in random {
            let kind = &self.case.particles[index].value;
            for template in self.kinds.sections[index].templates() {
                gaps[template] = match &kind.minimum_gap {
                    Some(gap) => gap.value,
                    None => (2.0 * self.radius(template) * packing::DEFAULT_GAP).max(clear),
                };
            }
            for (template, count) in self.allot(index, count) {
                drawn.extend(std::iter::repeat_n(template, count));
            }
            // One section: its own seed. Several: each of them matters.
            seed = seed
                .wrapping_mul(0x9E37_79B9_7F4A_7C15)
                .wrapping_add(kind.seed.as_ref().map_or(1, |s| s.value));
        }
        let ball = |template: usize| Ball { radius: self.radius(template), half_gap: 0.5 * gaps[template] };
        let fixed: Vec<(Vec3, Ball)> =
            particles.iter().map(|p| (p.position(), ball(p.template as usize))).collect();
        let balls: Vec<Ball> = drawn.iter().map(|&template| ball(template)).collect();
        let cube = |length: f64| length * length * length;
        let fraction = |grow: f64| {
            let all = fixed.iter().map(|(_, b)| b).chain(&balls);
            let volume = |b: &Ball| 4.0 / 3.0 * std::f64::consts::PI * cube(b.radius + grow * b.half_gap);
            all.map(volume).sum::<f64>() / self.free_volume
        };
        let (solid, grown) = (fraction(0.0), fraction(1.0));
        // One particle more than the fraction asks for is a rounding, not a denser packing.
        let one = balls.iter().map(|b| 4.2 * cube(b.radius)).fold(0.0, f64::max) / self.free_volume;
        let refused = || self.no_room(first, balls.len(), solid, grown);
        if solid > packing::MAX_VOLUME_FRACTION + one || grown > packing::MAX_GROWN_FRACTION {
            return Err(refused());
        }
        let walls: Vec<Surface> = self.walls.iter().map(|placed| placed.wall.surface).collect();
        let positions = packing::pack(&self.domain, &walls, &fixed, &balls, seed).ok_or_else(refused)?;
        let orientations = random_orientations(positions.len(), seed);
        let is_sphere = |template: usize| templates[template].shape.as_sphere().is_some();
        let fresh = positions.iter().zip(&orientations).zip(&drawn);
        let mut poses: Vec<Pose> = particles
            .iter()
            .map(|p| Pose {
                contour: p.template as usize,
                position: p.position(),
                orientation: p.orientation(),
            })
            .chain(fresh.map(|((&position, &orientation), &template)| Pose {
                contour: template,
                position,
                orientation: if is_sphere(template) { Quat::identity() } else { orientation },
            }))
            .collect();
        let contours: Vec<GrownShape> = templates
            .iter()
            .zip(&gaps)
            .map(|(template, gap)| GrownShape::new(template.shape.clone(), 0.5 * gap))
            .collect();
        // Spheres are clear of each other already.
        if poses.iter().any(|pose| !is_sphere(pose.contour))
            && !relax(self.domain, &walls, &contours, &mut poses, particles.len())
        {
            return Err(refused());
        }
        mix(&self.domain, &walls, &contours, &mut poses, particles.len(), seed);
        let next = particles.iter().map(|p| p.id + 1).max().unwrap_or(0);
        let fresh = poses.drain(particles.len()..);
        particles.extend((next..).zip(fresh).map(|(id, pose)| {
            let mut particle = Particle::at(id, pose.contour, pose.position);
            particle.set_orientation(&pose.orientation);
            particle
        }));
        Ok(())
    }

    /// How many of `count` particles of a kind have which template: its shares, rounded by the largest remainders.
    pub(super) fn allot(&self, index: usize, count: usize) -> Vec<(usize, usize)> {
        let kind = &self.kinds.sections[index];
        let exact: Vec<f64> = kind.shares.iter().map(|share| share * count as f64).collect();
        let mut counts: Vec<usize> = exact.iter().map(|x| x.floor() as usize).collect();
        let mut order: Vec<usize> = (0..counts.len()).collect();
        order.sort_by(|&a, &b| (exact[b] - exact[b].floor()).total_cmp(&(exact[a] - exact[a].floor())));
        let missing = count.saturating_sub(counts.iter().sum());
        for &i in order.iter().take(missing) {
            counts[i] += 1;
        }
        kind.templates().zip(counts).collect()
    }

    fn no_room(&self, first: usize, count: usize, solid: f64, grown: f64) -> Error {
        let kind = &self.case.particles[first];
        let gap = kind.value.minimum_gap.as_ref().map(|g| &g.span);
        self.source.error(
            gap.unwrap_or(&kind.span),
            &format!("no room for {count} random particles: volume fraction {solid:.3}, with their gaps {grown:.3}"),
            "random positions",
            &format!(
                "random packing goes up to a volume fraction of {} and, with the gaps, {}, less for long or flat bodies; \
                 take fewer particles, a larger box or a smaller `minimum_gap`",
                packing::MAX_VOLUME_FRACTION,
                packing::MAX_GROWN_FRACTION
            ),
        )
    }
}
