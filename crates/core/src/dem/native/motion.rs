//! Motion of the particles over a sub-step.

use super::context::{ContactContext, TemplateConstants};
use super::failures::{outside, too_far};
use super::{Native, face_passed};
use crate::dem::Load;
use crate::dem::integrator::{self, Motion};
use crate::domain::Domain;
use crate::error::Result;
use crate::particle::Particle;
use crate::wall::Wall;

impl Native {
    /// Moves the owned particles. One that would leave the range of the method stays where it is.
    pub(super) fn integrate(&mut self, dt: f64) -> Result<()> {
        let Self { context, order, forces, motions, .. } = self;
        if motions.first().is_none_or(|motion| motion.dt.to_bits() != dt.to_bits()) {
            motions.clear();
            motions.extend(context.templates.iter().map(|template| Motion::new(&template.inertia, dt)));
        }
        let ContactContext { params, templates, near, local, substep, .. } = context;
        let (domain, started) = (near.decomposition().domain, *substep > 0);
        let size = domain.size();
        let mut positions = order.positions_followed(local.arrangement);
        let mut failure = Ok(());
        let owned = local.store.particles[..local.store.owned].iter_mut();
        for (i, ((particle, load), contact)) in owned.zip(&local.loads).zip(&forces.totals).enumerate() {
            let (constants, motion) =
                (&templates[particle.template as usize], &motions[particle.template as usize]);
            let load = Load { force: load.force + constants.weight, ..*load };
            if started && constants.is_free {
                let moved = motion.of(particle, &load, contact);
                if moved.is_inside(&particle.position(), domain.dx, &size) {
                    moved.store(particle, contact);
                    if let Some(positions) = &mut positions {
                        positions[i] = moved.position;
                    }
                    continue;
                }
            }
            let integrated =
                integrate_one(particle, constants, (&load, contact), (*substep, dt), &domain, &params.walls);
            failure = failure.and(integrated);
            if let Some(positions) = &mut positions {
                positions[i] = particle.position();
            }
        }
        failure
    }
}

/// Moves a particle of any kind, in any sub-step of `dt` (s), under a load and the contact forces.
fn integrate_one(
    particle: &mut Particle,
    TemplateConstants { inertia, motion, .. }: &TemplateConstants,
    (load, contact): (&Load, &Load),
    (substep, dt): (u64, f64),
    domain: &Domain,
    walls: &[Wall],
) -> Result<()> {
    let before = *particle;
    if substep == 0 {
        integrator::start(particle, contact);
    }
    integrator::step(particle, inertia, load, contact, dt);
    if !motion.is_free() {
        let times = [substep, substep + 1].map(|n| n as f64 * dt);
        integrator::prescribe(particle, &before, inertia, motion, times);
    }
    let moved = (particle.position() - before.position()).amax();
    let lost = if particle.is_finite() && moved <= domain.dx {
        particle.position = domain.wrap(particle.position()).into();
        face_passed(domain, particle.position()).map(|face| outside(substep, &before, particle, face, walls))
    } else {
        Some(too_far(substep, &before, particle, [load.force, contact.force], domain.dx))
    };
    lost.map_or(Ok(()), |error| {
        *particle = before;
        Err(error)
    })
}
