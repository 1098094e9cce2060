//! States of particles that a caller sets between two steps.

use super::integrator::Inertia;
use super::saved::Saved;
use crate::domain::Domain;
use crate::error::{Error, Result};
use crate::math::{Quat, nalgebra::Quaternion};
use crate::particle::{Particle, Template};

/// The part of a case that [`replace`] checks states against.
#[derive(Clone, Copy, Debug)]
pub struct Limits<'a> {
    /// Geometries and materials.
    pub templates: &'a [Template],
    /// The box.
    pub domain: Domain,
    /// Time step (s): no particle may move by more than a cell in it.
    pub time_step: f64,
}

/// The saved state of an engine, in `parts` of all ranks, with the position, orientation, velocity and angular velocity of every
/// particle as in `states`, which are ascending by id. Periodic positions are wrapped, orientations normalised, and the angular
/// momentum follows from the angular velocity. What is as it was keeps every bit.
///
/// # Errors
/// [`Error::Input`] if `states` are not those of all particles, or impossible; [`Error::Unsupported`] for an engine that saves
/// particles in a form of its own.
pub fn replace(
    engine: &'static str,
    parts: &[Vec<u8>],
    states: &[Particle],
    limits: &Limits,
) -> Result<Vec<Vec<u8>>> {
    let refuse = |what: String| Error::Input(format!("the states of the particles cannot be set: {what}"));
    if let Some(pair) = states.windows(2).find(|pair| pair[0].id >= pair[1].id) {
        let [first, second] = [pair[0].id, pair[1].id];
        return Err(refuse(format!("the ids must ascend, but {second} follows {first}")));
    }
    let (mut count, mut replaced) = (0, Vec::with_capacity(parts.len()));
    for part in parts {
        let mut saved = Saved::read(engine, part).map_err(refuse)?;
        if !saved.own.is_empty() {
            return Err(Error::Unsupported {
                engine,
                what: "states of particles that the caller sets".into(),
            });
        }
        count += saved.particles.len();
        for particle in &mut saved.particles {
            let at = states.binary_search_by_key(&particle.id, |state| state.id);
            let at = at.map_err(|_| refuse(format!("that of particle {} is missing", particle.id)))?;
            *particle = limits.changed(particle, &states[at]).map_err(refuse)?;
        }
        replaced.push(saved.write(engine));
    }
    if count == states.len() {
        Ok(replaced)
    } else {
        Err(refuse(format!("there are {count} particles, not {}", states.len())))
    }
}

impl Limits<'_> {
    /// The particle in its new state, or the reason why it cannot be in it.
    fn changed(&self, was: &Particle, state: &Particle) -> std::result::Result<Particle, String> {
        let Particle { id, template, .. } = *was;
        if template != state.template {
            return Err(format!("particle {id} is of kind {template}, not {}", state.template));
        }
        let Particle { position, orientation, velocity, angular_velocity, .. } = *state;
        let mut now = Particle { position, orientation, velocity, angular_velocity, ..*was };
        now.position = self.domain.wrap(now.position()).into();
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
        let cells = now.velocity().norm() * self.time_step / self.domain.dx;
        match now.flaw(self.domain.size()) {
            Some(flaw) => Err(flaw),
            None if cells > 1.0 => {
                Err(format!("particle {id} would move by {cells:.3} cells in a step, more than 1"))
            }
            None => Ok(now),
        }
    }
}
