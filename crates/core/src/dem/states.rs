//! States of particles that a caller sets between two steps.

use super::integrator::{Inertia, turned};
use super::native::failures::is_too_deep;
use super::saved::Saved;
use crate::comm::SavedParts;
use crate::contact::{Body, Geometry, GrownShape, PairFinder, overlap, overlap_wall};
use crate::domain::Domain;
use crate::error::{Error, Result};
use crate::math::{Quat, Vec3, nalgebra::Quaternion};
use crate::particle::{Particle, Template};
use crate::wall::Wall;
use std::f64::consts::PI;
use std::sync::Arc;

/// Largest distance from the origin (cells) at which a position can be wrapped: rounding is below a millionth of a cell.
const FARTHEST: f64 = (1_u64 << 32) as f64;

/// The part of a case that states are checked against.
#[derive(Clone, Debug)]
pub struct Limits {
    /// Geometries and materials.
    pub templates: Arc<[Template]>,
    /// The box.
    pub domain: Domain,
    /// Time step (s): in it no particle may move by more than a cell, or by more than half a turn.
    pub time_step: f64,
    /// Walls.
    pub walls: Arc<[Wall]>,
    /// Time (s), for the surfaces of the walls.
    pub time: f64,
    /// True if bodies must not be deeper in others or in walls than a quarter of the thickness of the thinner one.
    pub solid: bool,
    /// True if no particle is more than a cell away from where it was before the last step; else particles are placed freely.
    pub continuous: bool,
}

/// Bodies that overlap others or walls too deeply.
#[derive(Clone, Debug, PartialEq)]
pub struct Deep {
    /// Index of the body.
    pub body: usize,
    /// Index of the other body, if it is no wall.
    pub other: Option<usize>,
    /// The overlap in words.
    pub words: String,
}

/// Part of a cell, and angle (rad), by which bodies that move as one seem to move relative to each other: rounding.
const AS_ONE: f64 = 1e-9;

/// Reason why a particle is too fast for a time step (s) on cells of the width `dx` (m), if it is.
pub fn too_fast(particle: &Particle, time_step: f64, dx: f64) -> Option<String> {
    let cells = particle.velocity().norm() * time_step / dx;
    let angle = particle.angular_velocity().norm() * time_step;
    if cells > 1.0 {
        Some(format!("particle {} would move by {cells:.3} cells in a step, more than 1", particle.id))
    } else {
        (angle > PI).then(|| {
            format!("particle {} would turn by {angle:.3} rad in a step, more than half a turn", particle.id)
        })
    }
}

/// These particles a time `dt` (s) earlier at the same velocities.
pub fn earlier(particles: &[Particle], domain: &Domain, dt: f64) -> Vec<Particle> {
    let moved_back = |particle: &Particle| {
        let mut earlier = *particle;
        earlier.position = domain.wrap(particle.position() - particle.velocity() * dt).into();
        earlier.set_orientation(&turned(&particle.orientation(), particle.angular_velocity(), -dt));
        earlier
    };
    particles.iter().map(moved_back).collect()
}

/// The saved state of the engine `was`, in the parts that this rank has read, as that of `engine` with other materials or contacts after `substep`
/// sub-steps: the particles keep their states, angular momenta follow from angular velocities, and no contact is remembered.
///
/// # Errors
/// [`Error::Input`] if a part is damaged, or if there is no template of a particle; [`Error::Unsupported`] for an engine that saves
/// particles in a form of its own.
pub fn without_memory(
    [was, engine]: [&'static str; 2],
    parts: &SavedParts,
    substep: u64,
    templates: &[Template],
) -> Result<SavedParts> {
    let refuse = |what: String| Error::Input(format!("the particles cannot continue: {what}"));
    let of_part = |(n, part): &(usize, Vec<u8>)| {
        let saved = Saved::read(was, part).map_err(refuse)?;
        if !saved.own.is_empty() {
            return Err(Error::Unsupported { engine: was, what: "a change of materials or contacts".into() });
        }
        let (population, mut particles, loads) = (saved.population, saved.particles, saved.loads);
        for particle in &mut particles {
            let template = templates.get(particle.template as usize);
            let template =
                template.ok_or_else(|| refuse(format!("particle {} is of no kind", particle.id)))?;
            let momentum =
                Inertia::of(template).angular_momentum(&particle.orientation(), particle.angular_velocity());
            particle.angular_momentum = momentum.into();
        }
        let saved = Saved { substep, population, particles, loads, ..Saved::default() };
        Ok((*n, saved.write(engine)))
    };
    Ok(SavedParts { own: parts.own.iter().map(of_part).collect::<Result<_>>()?, count: parts.count })
}

impl Limits {
    /// New particles in the states that an engine needs; `present` are those of this rank, ghosts included.
    ///
    /// # Errors
    /// [`Error::Input`] if one is impossible; what overlaps particles of other ranks only, these notice.
    pub fn new_particles(&self, new: &[Particle], present: &[Particle]) -> Result<Vec<Particle>> {
        let refuse = |what: String| Error::Input(format!("particles cannot be inserted: {what}"));
        let of = |state: &Particle| {
            let Particle { id, template, .. } = *state;
            if template >= self.templates.len() as u64 {
                return Err(format!("there is no kind {template} of particles"));
            }
            let there = Particle::at(id, template as usize, self.domain.wrap(state.position()));
            self.changed(&there, &there, state)
        };
        let states: Vec<Particle> =
            new.iter().map(of).collect::<std::result::Result<_, _>>().map_err(refuse)?;
        let stay = present.iter().map(|particle| (*particle, false));
        let bodies: Vec<(Particle, bool)> = stay.chain(states.iter().map(|state| (*state, true))).collect();
        match self.overlaps(&bodies).next() {
            Some(flaw) => Err(refuse(flaw.words)),
            None => Ok(states),
        }
    }

    /// A particle, which was at `before` before the last step, with the position, orientation, velocity and angular velocity of `state`;
    /// or the reason why it cannot be there. Periodic positions are wrapped, orientations normalised, and the angular momentum follows from
    /// the angular velocity. What is as it was keeps every bit.
    ///
    /// # Errors
    /// Words for the user.
    pub fn changed(
        &self,
        was: &Particle,
        before: &Particle,
        state: &Particle,
    ) -> std::result::Result<Particle, String> {
        let Particle { id, template, .. } = *was;
        if template != state.template {
            return Err(format!("particle {id} is of kind {template}, not {}", state.template));
        }
        let Particle { position, orientation, velocity, angular_velocity, .. } = *state;
        let mut now = Particle { position, orientation, velocity, angular_velocity, ..*was };
        let domain = &self.domain;
        if let Some(x) = position.iter().find(|x| x.is_finite() && x.abs() > FARTHEST * domain.dx) {
            return Err(format!(
                "the position of particle {id} is {x:e} m away, too far to be wrapped into the box"
            ));
        }
        now.position = domain.wrap(now.position()).into();
        // To the bit.
        let differ = |now: &[f64], was: &[f64]| {
            bytemuck::cast_slice::<_, u8>(now) != bytemuck::cast_slice::<_, u8>(was)
        };
        let turned = differ(&now.orientation, &was.orientation);
        let [i, j, k, w] = now.orientation;
        let given = Quaternion::new(w, i, j, k);
        if turned && (given.norm() - 1.0).abs() < 1e-3 {
            now.set_orientation(&Quat::new_normalize(given));
        }
        if turned || differ(&now.angular_velocity, &was.angular_velocity) {
            let inertia = Inertia::of(&self.templates[template as usize]);
            now.angular_momentum =
                inertia.angular_momentum(&now.orientation(), now.angular_velocity()).into();
        }
        let jumps = || {
            let jump = domain.nearest_image(now.position() - before.position()).norm() / domain.dx;
            (self.continuous && jump > 1.0).then(|| {
                format!(
                    "particle {id} is {jump:.3} cells from where it was before the last step, which moves it by at most 1; \
                     particles are placed freely before the first step only"
                )
            })
        };
        let flaw =
            now.flaw(domain.size()).or_else(|| too_fast(&now, self.time_step, domain.dx)).or_else(jumps);
        flaw.map_or(Ok(now), Err)
    }

    /// True if two particles, which were as in `before`, have moved as one.
    pub fn move_as_one(&self, [a, b]: [&Particle; 2], [c, d]: [&Particle; 2]) -> bool {
        let seen = |a: &Particle, b: &Particle| {
            let back = a.orientation().inverse();
            (back * self.domain.nearest_image(b.position() - a.position()), back * b.orientation())
        };
        let (now, then) = (seen(a, b), seen(c, d));
        (now.0 - then.0).norm() < AS_ONE * self.domain.dx && now.1.angle_to(&then.1) < AS_ONE
    }

    /// The overlaps of `bodies`, with walls and with each other, that are too deep; those of bodies with a `false`, which stay where they
    /// were, with each other and with walls are not. Overlaps without a closed form are bounded from below by the inscribed spheres about
    /// the centres of mass.
    pub fn overlaps(&self, bodies: &[(Particle, bool)]) -> impl Iterator<Item = Deep> {
        if self.solid { self.deep(bodies) } else { Vec::new() }.into_iter()
    }

    fn deep(&self, bodies: &[(Particle, bool)]) -> Vec<Deep> {
        let shapes: Vec<GrownShape> =
            self.templates.iter().map(|template| GrownShape::new(template.shape.clone(), 0.0)).collect();
        let inner: Vec<f64> =
            self.templates.iter().map(|t| -t.shape.signed_distance(Vec3::zeros())).collect();
        let of = |i: usize| {
            let particle = &bodies[i].0;
            let template = particle.template as usize;
            let body = Body { grown: &shapes[template], orientation: particle.orientation() };
            (particle.position(), body, inner[template], self.templates[template].shape.thickness())
        };
        let mut deep = Vec::new();
        let mut note = |body: usize, other: Option<usize>, of: &str, depth: f64, thickness: f64| {
            if is_too_deep(depth, thickness) {
                let id = bodies[body].0.id;
                let words = format!(
                    "particle {id} would overlap {of} by {depth:.3e} m, more than a quarter of the thickness {thickness:.3e} m"
                );
                deep.push(Deep { body, other, words });
            }
        };
        let surfaces: Vec<_> = self.walls.iter().map(|wall| (wall, wall.surface_at(self.time))).collect();
        for i in (0..bodies.len()).filter(|&i| bodies[i].1) {
            let (position, body, radius, thickness) = of(i);
            for (wall, surface) in &surfaces {
                let depth = if surface.is_plane() && body.has_closed_form_at_planes() {
                    let seen = overlap_wall(Geometry::Exact, &body, &surface.seen_from(position));
                    seen.map_or(0.0, |overlap| overlap.depth)
                } else {
                    radius - surface.distance(position)
                };
                note(i, None, &format!("the wall `{}`", wall.name), depth, thickness);
            }
        }
        let (positions, radii): (Vec<Vec3>, Vec<f64>) =
            (0..bodies.len()).map(|i| (of(i).0, of(i).1.grown.reach())).unzip();
        for pair in PairFinder::new(self.domain).find(&positions, &radii) {
            let [i, j] = pair.map(|i| i as usize);
            if !(bodies[i].1 || bodies[j].1) {
                continue;
            }
            let ((a, first, radius, thick), (b, second, other, thin)) = (of(i), of(j));
            let depth = |offset: Vec3| {
                if first.has_closed_form() && second.has_closed_form() {
                    let seen = overlap(Geometry::Exact, &first, &second, offset);
                    seen.map_or(0.0, |overlap| overlap.depth)
                } else {
                    radius + other - offset.norm()
                }
            };
            let images = self.domain.images(b - a, radii[i] + radii[j]);
            let depth = images.map(depth).fold(f64::NEG_INFINITY, f64::max);
            note(i, Some(j), &format!("particle {}", bodies[j].0.id), depth, thick.min(thin));
        }
        deep
    }
}
