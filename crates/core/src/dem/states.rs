//! States of particles that a caller sets between two steps.

use super::integrator::{Inertia, turned};
use super::native::failures::is_too_deep;
use super::saved::Saved;
use crate::contact::{Body, Geometry, GrownShape, PairFinder, overlap, overlap_wall};
use crate::domain::Domain;
use crate::error::{Error, Result};
use crate::math::{Quat, Vec3, nalgebra::Quaternion};
use crate::particle::{Particle, Template};
use crate::wall::Wall;
use std::f64::consts::PI;

/// Largest distance from the origin (cells) at which a position can be wrapped: rounding is below a millionth of a cell.
const FARTHEST: f64 = (1_u64 << 32) as f64;

/// The part of a case that [`replace`] checks states against.
#[derive(Clone, Copy, Debug)]
pub struct Limits<'a> {
    /// Geometries and materials.
    pub templates: &'a [Template],
    /// The box.
    pub domain: Domain,
    /// Time step (s): in it no particle may move by more than a cell, or by more than half a turn.
    pub time_step: f64,
    /// Walls.
    pub walls: &'a [Wall],
    /// Time (s), for the surfaces of the walls.
    pub time: f64,
    /// True if bodies must not be deeper in others or in walls than a quarter of the thickness of the thinner one.
    pub solid: bool,
    /// States before the last step, ascending by id.
    pub before: &'a [Particle],
    /// True if no particle is more than a cell away from them; else particles are placed freely.
    pub continuous: bool,
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

/// The saved parts of an engine, of all ranks.
///
/// # Errors
/// [`Error::Input`] if a part is damaged.
pub fn read(engine: &'static str, parts: &[Vec<u8>]) -> Result<Vec<Saved>> {
    parts.iter().map(|part| Saved::read(engine, part).map_err(Error::Input)).collect()
}

/// The saved state of an engine, in `parts` of all ranks, with the position, orientation, velocity and angular velocity of every
/// particle as in `states`, which are ascending by id. Periodic positions are wrapped, orientations normalised, and the angular
/// momentum follows from the angular velocity. What is as it was keeps every bit. Overlaps without a closed form are bounded from below by
/// the inscribed spheres about the centres of mass; those of bodies that stay where they are pass, and so do those of bodies that move as
/// one, with each other.
///
/// # Errors
/// [`Error::Input`] if `states` are not those of all particles, or impossible; [`Error::Unsupported`] for an engine that saves
/// particles in a form of its own.
pub fn replace(
    engine: &'static str,
    parts: Vec<Saved>,
    states: &[Particle],
    limits: &Limits,
) -> Result<Vec<Vec<u8>>> {
    let refuse = |what: String| Error::Input(format!("the states of the particles cannot be set: {what}"));
    if let Some(pair) = states.windows(2).find(|pair| pair[0].id >= pair[1].id) {
        let [first, second] = [pair[0].id, pair[1].id];
        return Err(refuse(format!("the ids must ascend, but {second} follows {first}")));
    }
    let (mut bodies, mut replaced) = (Vec::with_capacity(states.len()), Vec::with_capacity(parts.len()));
    for mut saved in parts {
        if !saved.own.is_empty() {
            return Err(Error::Unsupported {
                engine,
                what: "states of particles that the caller sets".into(),
            });
        }
        for particle in &mut saved.particles {
            let at = states.binary_search_by_key(&particle.id, |state| state.id);
            let at = at.map_err(|_| refuse(format!("that of particle {} is missing", particle.id)))?;
            let now = limits.changed(particle, &states[at]).map_err(refuse)?;
            let pose = |of: &Particle| (of.position.map(f64::to_bits), of.orientation.map(f64::to_bits));
            bodies.push((now, pose(&now) != pose(particle)));
            *particle = now;
        }
        replaced.push(saved.write(engine));
    }
    if bodies.len() != states.len() {
        return Err(refuse(format!("there are {} particles, not {}", bodies.len(), states.len())));
    }
    match limits.solid.then(|| limits.overlap(&bodies)).flatten() {
        Some(flaw) => Err(refuse(flaw)),
        None => Ok(replaced),
    }
}

/// The states in the saved `parts` of all ranks, ascending by id, or those a time `dt` (s) earlier at the same velocities.
pub fn earlier(parts: &[Saved], domain: &Domain, dt: f64) -> Vec<Particle> {
    let mut all: Vec<Particle> = parts.iter().flat_map(|part| part.particles.iter().copied()).collect();
    all.sort_unstable_by_key(|particle| particle.id);
    for particle in &mut all {
        particle.position = domain.wrap(particle.position() - particle.velocity() * dt).into();
        particle.set_orientation(&turned(&particle.orientation(), particle.angular_velocity(), -dt));
    }
    all
}

/// The saved state of the engine `was`, in `parts` of all ranks, as that of `engine` with other materials or contacts after `substep`
/// sub-steps: the particles keep their states, angular momenta follow from angular velocities, and no contact is remembered.
///
/// # Errors
/// [`Error::Input`] if a part is damaged, or if there is no template of a particle; [`Error::Unsupported`] for an engine that saves
/// particles in a form of its own.
pub fn without_memory(
    [was, engine]: [&'static str; 2],
    parts: &[Vec<u8>],
    substep: u64,
    templates: &[Template],
) -> Result<Vec<Vec<u8>>> {
    let refuse = |what: String| Error::Input(format!("the particles cannot continue: {what}"));
    let of_part = |part: &Vec<u8>| {
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
        Ok(Saved { substep, population, particles, loads, ..Saved::default() }.write(engine))
    };
    parts.iter().map(of_part).collect()
}

impl Limits<'_> {
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
            self.changed(&Particle::at(id, template as usize, self.domain.wrap(state.position())), state)
        };
        let states: Vec<Particle> =
            new.iter().map(of).collect::<std::result::Result<_, _>>().map_err(refuse)?;
        let stay = present.iter().map(|particle| (*particle, false));
        let bodies: Vec<(Particle, bool)> = stay.chain(states.iter().map(|state| (*state, true))).collect();
        match self.solid.then(|| self.overlap(&bodies)).flatten() {
            Some(flaw) => Err(refuse(flaw)),
            None => Ok(states),
        }
    }

    /// The particle in its new state, or the reason why it cannot be in it.
    fn changed(&self, was: &Particle, state: &Particle) -> std::result::Result<Particle, String> {
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
            let jump = domain.nearest_image(now.position() - self.before(id)?.position()).norm() / domain.dx;
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

    /// State of a particle before the last step.
    fn before(&self, id: u64) -> Option<&Particle> {
        self.before.binary_search_by_key(&id, |particle| particle.id).ok().map(|at| &self.before[at])
    }

    /// True if the last step has moved two particles as one.
    fn move_as_one(&self, a: &Particle, b: &Particle) -> bool {
        let seen = |a: &Particle, b: &Particle| {
            let back = a.orientation().inverse();
            (back * self.domain.nearest_image(b.position() - a.position()), back * b.orientation())
        };
        let (now, before) = (seen(a, b), self.before(a.id).zip(self.before(b.id)));
        before.is_some_and(|(c, d)| {
            let then = seen(c, d);
            (now.0 - then.0).norm() < AS_ONE * self.domain.dx && now.1.angle_to(&then.1) < AS_ONE
        })
    }

    /// The first overlap of `bodies`, with walls and with each other, that is too deep, in words; bodies with a `false` stay where
    /// they were.
    fn overlap(&self, bodies: &[(Particle, bool)]) -> Option<String> {
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
        let words = |i: usize, other: String, depth: f64, thickness: f64| {
            is_too_deep(depth, thickness).then(|| {
                let id = bodies[i].0.id;
                format!(
                    "particle {id} would overlap {other} by {depth:.3e} m, more than a quarter of the thickness {thickness:.3e} m"
                )
            })
        };
        let moved = (0..bodies.len()).filter(|&i| bodies[i].1);
        let surfaces: Vec<_> = self.walls.iter().map(|wall| (wall, wall.surface_at(self.time))).collect();
        let mut on_walls = moved.flat_map(|i| surfaces.iter().map(move |(wall, surface)| (i, wall, surface)));
        let in_wall = on_walls.find_map(|(i, wall, surface)| {
            let (position, body, radius, thickness) = of(i);
            let depth = if surface.is_plane() && body.has_closed_form() {
                let seen = overlap_wall(Geometry::Exact, &body, &surface.seen_from(position));
                seen.map_or(0.0, |overlap| overlap.depth)
            } else {
                radius - surface.distance(position)
            };
            words(i, format!("the wall `{}`", wall.name), depth, thickness)
        });
        in_wall.or_else(|| {
            let (positions, radii): (Vec<Vec3>, Vec<f64>) =
                (0..bodies.len()).map(|i| (of(i).0, of(i).1.grown.reach())).unzip();
            PairFinder::new(self.domain).find(&positions, &radii).iter().find_map(|pair| {
                let [i, j] = pair.map(|i| i as usize);
                let ((a, first, radius, thick), (b, second, other, thin)) = (of(i), of(j));
                if !(bodies[i].1 || bodies[j].1) || self.move_as_one(&bodies[i].0, &bodies[j].0) {
                    return None;
                }
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
                words(i, format!("particle {}", bodies[j].0.id), depth, thick.min(thin))
            })
        })
    }
}
