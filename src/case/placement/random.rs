//! Particles at random positions, clear of each other, of those that are listed, and of walls.

use super::Placer;
use super::relaxed::pose;
use crate::case::file::{ParticleSection, PositionsBy};
use crate::domain::Domain;
use crate::error::{Error, Result};
use crate::math::{Quat, Vec3};
use crate::memory;
use crate::packing::dense::{squeeze, widened};
use crate::packing::mix::mix;
use crate::packing::progress::Follow;
use crate::packing::relax::{Pose, random_orientations, relax};
use crate::packing::{self, Ball};
use crate::particle::Particle;
use crate::wall::Surface;

/// Default gaps in units of those at which surfaces that are grown for contacts just touch.
pub(in crate::case) const CLEAR: f64 = 1.001;

impl Placer<'_> {
    /// Number of random particles of a kind, refused if there is no room for them.
    pub(super) fn count(&self, index: usize, kind: &ParticleSection) -> Result<usize> {
        let templates = &self.kinds.templates[self.kinds.sections[index].templates()];
        let fractions = &self.kinds.sections[index].fractions;
        let volume: f64 =
            templates.iter().zip(fractions).map(|(template, part)| part * template.shape.volume()).sum();
        let count = match kind.positions {
            PositionsBy::VolumeFraction(fraction) => {
                return Ok(packing::count_for_volume_fraction(self.free_volume, fraction, volume) as usize);
            }
            PositionsBy::Count(count) => count,
            PositionsBy::File(_) | PositionsBy::List(_) => 0,
        };
        let limit = packing::MAX_DENSE_FRACTION;
        let most = (limit * self.free_volume / volume) as u64;
        if count > most {
            let remedy = format!(
                "random packing goes up to a volume fraction of {limit}; take a larger box or fewer particles"
            );
            let key = format!("particles.{index}.count");
            return Err(self.document.out_of_range(&key, count, &format!("at most {most}"), &remedy));
        }
        Ok(count as usize)
    }

    /// Refuses more particles than this process has memory for, before any is placed.
    fn refuse_too_many(&self, index: usize, count: usize) -> Result<()> {
        let needed = count as f64 * memory::PER_PARTICLE;
        let Some(room) = memory::rooms().into_iter().find(|room| needed > room.bytes) else {
            return Ok(());
        };
        let key = format!("particles.{index}");
        let needed = memory::in_bytes(needed);
        let title =
            format!("`{key}` asks for {count} particles, which need about {needed}, but {}", room.limit);
        let remedy = "take fewer or larger particles, or a smaller box";
        Err(self.document.error(&key, &title, "too many for the memory", remedy))
    }

    /// Adds the random particles, at a distance from all others: by default one at which none begins in contact. Warns if there
    /// is no room for that, or if the case asks for less. Where bodies with prescribed motion overlap, they have `filled` this volume (m^3).
    pub(super) fn pack(
        &self,
        random: &[(usize, usize)],
        particles: &mut Vec<Particle>,
        filled: Option<f64>,
        warnings: &mut Vec<String>,
        follow: &mut dyn Follow,
    ) -> Result<()> {
        let Some(&(first, _)) = random.first() else {
            return Ok(());
        };
        for &(index, count) in random {
            self.refuse_too_many(index, count)?;
        }
        let clear = CLEAR * 2.0 * self.enlargement;
        let asked = |index: usize| self.document.case.particles[index].minimum_gap;
        for &(index, _) in random {
            if let Some(gap) = asked(index).filter(|gap| *gap < clear / CLEAR) {
                warnings.push(self.begins_in_contact(index, gap, clear));
            }
        }
        let Err(refused) = self.pack_with((first, random), particles, clear, filled, follow) else {
            return Ok(());
        };
        let mut by_default = random.iter().map(|&(index, _)| index);
        let Some(index) = by_default.find(|&index| asked(index).is_none() && clear > 0.0) else {
            return Err(refused);
        };
        self.pack_with((first, random), particles, 0.0, filled, follow)?;
        let radii = self.kinds.sections[index].templates().map(|t| self.radius(t));
        let gap = 2.0 * radii.fold(0.0, f64::max) * packing::DEFAULT_GAP;
        warnings.push(self.begins_in_contact(index, gap, clear));
        Ok(())
    }

    /// Radius (m) of the sphere of the same volume.
    fn radius(&self, template: usize) -> f64 {
        let shape = &self.kinds.templates[template].shape;
        shape.as_sphere().unwrap_or_else(|| 0.5 * shape.equivalent_diameter())
    }

    fn begins_in_contact(&self, index: usize, gap: f64, clear: f64) -> String {
        let title = format!(
            "random particles begin in contact: `particles.{index}` keeps gaps of {gap:.3e} m, but surfaces are grown by \
             {:.3e} m for contacts",
            self.enlargement
        );
        let remedy = format!(
            "for a start at rest take fewer particles or more cells per diameter, and `minimum_gap` of {clear:.3e} m or none"
        );
        let label = "neighbours push each other apart from the start";
        self.document.warning(&format!("particles.{index}.minimum_gap"), &title, label, &remedy)
    }

    /// As [`pack`](Self::pack), with default gaps of at least `clear` (m) round other bodies.
    fn pack_with(
        &self,
        (first, random): (usize, &[(usize, usize)]),
        particles: &mut Vec<Particle>,
        clear: f64,
        filled: Option<f64>,
        follow: &mut dyn Follow,
    ) -> Result<()> {
        let templates = &self.kinds.templates;
        let mut gaps = vec![0.0; templates.len()];
        let (mut drawn, mut asked) = (Vec::new(), Vec::new());
        let mut seed = 0_u64;
        for &(index, count) in random {
            let kind = &self.document.case.particles[index];
            asked.push((self.kinds.sections[index].templates(), kind.minimum_gap));
            for (template, count) in self.allot(index, count) {
                drawn.extend(std::iter::repeat_n(template, count));
            }
            // One section: its own seed. Several: each of them matters.
            seed = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15).wrapping_add(kind.seed.unwrap_or(1));
        }
        let volume = |template: usize| templates[template].shape.volume();
        let drawn_volume = drawn.iter().map(|&template| volume(template)).sum::<f64>();
        // One particle more than the fraction asks for is a rounding, not a denser packing.
        let one = drawn.iter().map(|&template| volume(template)).fold(0.0, f64::max);
        let is_dense = drawn_volume > packing::MAX_VOLUME_FRACTION * self.free_volume + one;
        for (of_section, gap) in asked {
            for template in of_section {
                let usual = if is_dense { 0.0 } else { 2.0 * self.radius(template) * packing::DEFAULT_GAP };
                gaps[template] = gap.unwrap_or(usual.max(clear));
            }
        }
        let ball = |template: usize| Ball { radius: self.radius(template), half_gap: 0.5 * gaps[template] };
        let fixed: Vec<(Vec3, Ball)> =
            particles.iter().map(|p| (p.position(), ball(p.template as usize))).collect();
        let balls: Vec<Ball> = drawn.iter().map(|&template| ball(template)).collect();
        let cube = |length: f64| length * length * length;
        // Bodies that overlap leave the rest of the box.
        let room = (self.free_volume - filled.unwrap_or(0.0)).max(1e-3 * self.free_volume);
        let fraction = |grow: f64| {
            let counted = |p: &Particle| filled.is_none() || !self.is_prescribed(p);
            let listed = particles.iter().zip(&fixed).filter(|(p, _)| counted(p)).map(|(_, (_, ball))| ball);
            let volume = |b: &Ball| 4.0 / 3.0 * std::f64::consts::PI * cube(b.radius + grow * b.half_gap);
            listed.chain(&balls).map(volume).sum::<f64>() / room
        };
        let (solid, grown) = (fraction(0.0), fraction(1.0));
        let refused = || self.no_room(first, balls.len(), solid, grown);
        let most = if is_dense { packing::MAX_DENSE_FRACTION } else { packing::MAX_GROWN_FRACTION };
        if solid > packing::MAX_VOLUME_FRACTION + one / self.free_volume && !is_dense || grown > most {
            return Err(refused());
        }
        let wanted_walls: Vec<Surface> =
            self.walls.iter().map(|placed| placed.wall.surface.clone()).collect();
        // Dense packings begin in a box that is wider.
        let wide = if is_dense { libm::cbrt(grown / packing::LOOSE) } else { 1.0 };
        let walls = if is_dense {
            let widened: Option<Vec<Surface>> = wanted_walls.iter().map(|wall| widened(wall, wide)).collect();
            widened.ok_or_else(|| self.dense_in_mesh(first, solid))?
        } else {
            wanted_walls.clone()
        };
        let domain = Domain { dx: self.domain.dx * wide, ..self.domain };
        let fixed: Vec<(Vec3, Ball)> = fixed.into_iter().map(|(at, ball)| (at * wide, ball)).collect();
        let positions = packing::pack(&domain, &walls, &fixed, &balls, seed).ok_or_else(refused)?;
        let orientations = random_orientations(positions.len(), seed);
        let is_sphere = |template: usize| templates[template].shape.as_sphere().is_some();
        let fresh = positions.iter().zip(&orientations).zip(&drawn);
        let mut poses: Vec<Pose> = particles
            .iter()
            .map(|particle| Pose { position: particle.position() * wide, ..pose(particle) })
            .chain(fresh.map(|((&position, &orientation), &template)| Pose {
                contour: template,
                position,
                orientation: if is_sphere(template) { Quat::identity() } else { orientation },
            }))
            .collect();
        let contours = self.contours(gaps);
        // Spheres are clear of each other already.
        if poses.iter().any(|pose| !is_sphere(pose.contour))
            && !relax(domain, &walls, &contours, &mut poses, particles.len(), None)
        {
            return Err(refused());
        }
        mix(&domain, &walls, &contours, &mut poses, particles.len(), seed);
        if is_dense {
            let fixed = particles.len();
            if !squeeze(&self.domain, &wanted_walls, &contours, &mut poses, fixed, wide, follow) {
                return Err(self.jammed(first, solid));
            }
            mix(&self.domain, &wanted_walls, &contours, &mut poses, particles.len(), seed);
        }
        let next = particles.iter().map(|p| p.id + 1).max().unwrap_or(0);
        let fresh = poses.drain(particles.len()..);
        particles.extend((next..).zip(fresh).map(|(id, pose)| {
            let mut particle = Particle::at(id, pose.contour, pose.position);
            particle.set_orientation(&pose.orientation);
            particle
        }));
        Ok(())
    }

    /// Number of particles of each template among `count` of a kind: its fractions, rounded by the largest remainders.
    pub(super) fn allot(&self, index: usize, count: usize) -> Vec<(usize, usize)> {
        let kind = &self.kinds.sections[index];
        let exact: Vec<f64> = kind.fractions.iter().map(|part| part * count as f64).collect();
        let mut counts: Vec<usize> = exact.iter().map(|x| x.floor() as usize).collect();
        let mut order: Vec<usize> = (0..counts.len()).collect();
        order.sort_by(|&a, &b| (exact[b] - exact[b].floor()).total_cmp(&(exact[a] - exact[a].floor())));
        let missing = count.saturating_sub(counts.iter().sum());
        for &i in order.iter().take(missing) {
            counts[i] += 1;
        }
        kind.templates().zip(counts).collect()
    }

    fn dense_in_mesh(&self, first: usize, solid: f64) -> Error {
        let title = format!("a volume fraction of {solid:.3} is wanted within walls made of a mesh");
        let remedy = format!(
            "random packing goes up to {} there; pour the particles in, and take the end of that run: `turbid pack --from`",
            packing::MAX_VOLUME_FRACTION
        );
        self.document.error(&format!("particles.{first}"), &title, "too dense for this", &remedy)
    }

    fn jammed(&self, first: usize, solid: f64) -> Error {
        let title =
            format!("random bodies do not come apart at a volume fraction of {solid:.4}: they jam before");
        let remedy = "random packings end at 0.64 for equal spheres, 0.6 to 0.7 for other bodies, less beside walls; take less, another `seed`, a larger \
                      box or a smaller `minimum_gap`";
        self.document.error(&format!("particles.{first}"), &title, "too dense", remedy)
    }

    fn no_room(&self, first: usize, count: usize, solid: f64, grown: f64) -> Error {
        let title = format!(
            "no room for {count} random particles: volume fraction {solid:.3}, with their gaps {grown:.3}"
        );
        let remedy = format!(
            "random packing goes up to a volume fraction of {} and, with the gaps, {}, less for long or flat bodies; \
             take fewer particles, a larger box or a smaller `minimum_gap`",
            packing::MAX_VOLUME_FRACTION,
            packing::MAX_GROWN_FRACTION
        );
        self.document.error(&format!("particles.{first}.minimum_gap"), &title, "random positions", &remedy)
    }
}

#[cfg(test)]
mod tests {
    use crate::case::{Setup, from_text};
    use crate::error::Result;

    fn dense(fraction: f64, more: &str) -> Result<Setup> {
        let text = format!(
            "domain = {{ size = [4e-3, 4e-3, 4.5e-3], periodic = [true, true, false] }}\n\
             dry.time_step = 1e-6\nrun.end.steps = 1\noutput.directory = \"out\"\n{more}\
             [[particles]]\nshape.sphere.diameter = 5e-4\ndensity = 2000\nlist = [[2e-3, 2e-3, 2e-3]]\nmotion = \"fixed\"\n\
             [[particles]]\nshape.sphere.diameter = 5e-4\ndensity = 2000\nvolume_fraction = {fraction}\n"
        );
        from_text(&text, "dense", &[])
    }

    #[test]
    fn dense_random_particles_lie_clear_of_each_other_of_fixed_ones_and_of_walls() {
        let setup = dense(0.56, "").unwrap_or_else(|e| panic!("{e}"));
        assert!((setup.volume_fraction - 0.56).abs() < 2e-3 + 1.0 / 1000.0, "{}", setup.volume_fraction);
        let particles = &setup.particles;
        assert!((particles[0].position[0] - 2e-3).abs() < 1e-15, "the fixed one stays");
        for (n, a) in particles.iter().enumerate() {
            assert!((2.5e-4..=4.25e-3).contains(&a.position[2]));
            for b in &particles[..n] {
                let apart = setup.domain.nearest_image(b.position() - a.position()).norm();
                assert!(apart >= 5e-4, "{apart}");
            }
        }
    }

    #[test]
    fn what_jams_before_and_what_is_dense_in_a_mesh_is_refused_with_a_remedy() {
        let jams = dense(0.7, "").unwrap_err().to_string();
        assert!(jams.contains("they jam before") && jams.contains("equal spheres"), "{jams}");
        let hopper = concat!(env!("CARGO_MANIFEST_DIR"), "/cases/hopper.stl");
        let mesh = format!(
            "walls = [{{ name = \"hopper\", mesh = {{ file = \"{hopper}\", unit = \"mm\", position = [2e-3, 2e-3, 1e-3] }} }}]\n"
        );
        let refused = dense(0.5, &mesh).unwrap_err().to_string();
        assert!(
            refused.contains("within walls made of a mesh") && refused.contains("turbid pack --from"),
            "{refused}"
        );
    }
}
