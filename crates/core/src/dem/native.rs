//! The native engine: contacts of convex bodies, leapfrog, one block of the box per rank.
//!
//! A sub-step:
//!
//! 1. every rank finds pairs among its own particles and ghosts, and evaluates the contacts assigned to it;
//! 2. forces go to the owners, who add them up in ascending order of the partner's id;
//! 3. owners integrate;
//! 4. particles go to their new owners, and to all ranks as ghosts that need them;
//! 5. contact histories follow the evaluating rank.
//!
//! Every number is computed once, by one rank, in the same order whatever the number of ranks: the pair with the
//! lower id first, from the nearest image of wrapped positions. Walls stand where their motion has brought them
//! after `substep dt`. A contact with a wall belongs to the owner of the particle and comes after those with
//! particles. Bodies of several parts touch part by part, and meshes by several facets; their forces and torques add up. In a narrow box bodies
//! touch through several images, and images of themselves: each is a contact of its own, and its image is told from the nearest one of the
//! centres. Images of walls are left out.

#[cfg(test)]
mod bricks_tests;
#[cfg(test)]
mod carried_tests;
mod clearances;
#[cfg(test)]
mod cohesion_tests;
mod context;
#[cfg(test)]
mod cube_tests;
#[cfg(test)]
mod damped_tests;
pub mod failures;
#[cfg(test)]
mod film_tests;
mod films;
mod forces;
#[cfg(test)]
mod friction_tests;
#[cfg(test)]
mod image_tests;
#[cfg(test)]
mod mesh_tests;
#[cfg(test)]
mod mixed_tests;
mod motion;
#[cfg(test)]
mod motion_tests;
mod order;
#[cfg(test)]
mod parts_tests;
#[cfg(test)]
mod population_tests;
#[cfg(test)]
mod pull_tests;
#[cfg(test)]
mod rest_tests;
#[cfg(test)]
mod saved_tests;
#[cfg(test)]
mod slip_tests;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod through_tests;
mod velocities;
#[cfg(test)]
mod wall_tests;
mod walls;

use super::assign::GhostLayer;
use super::exchange::LocalParticles;
use super::facets::Facets;
use super::history::{History, Records};
use super::integrator::{self, Inertia, Motion};
use super::saved::{Loaded, Saved};
use super::{Check, ContactKey, ContactState, ContactSummary, DemEngine, Load};
use crate::comm::{Comm, SavedParts};
use crate::contact::{ContactModel, NeighbourList, PairFinder, PairLaw};
use crate::domain::{Decomposition, Domain};
use crate::error::{Error, Result};
use crate::math::Vec3;
use crate::particle::{Particle, ParticleStore, PrescribedMotion, Template};
use crate::shape::Shape;
use crate::wall::Wall;
use clearances::Clearances;
use context::{ContactContext, PartConstants, TemplateConstants};
use films::Films;
use forces::ContactForces;
use order::IdOrder;
use std::collections::BTreeMap;
use std::sync::Arc;
use velocities::KnownVelocities;

/// Parameters of the native engine.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NativeParams {
    /// Materials and model of the contacts; without, particles pass through each other and through walls.
    pub contact: Option<ContactModel>,
    /// Walls.
    pub walls: Vec<Wall>,
    /// Acceleration of every particle (m/s^2); buoyancy is part of the loads.
    pub gravity: Vec3,
    /// Sub-steps per call of [`advance`](DemEngine::advance), at least one.
    pub substeps: u32,
    /// Motion of the bodies of each template; empty if all are free. Two bodies whose whole motion is prescribed exert no
    /// contact force on each other, nor does such a body on a wall; in other contacts a body whose centre forces do
    /// not move is infinitely heavy.
    pub motions: Vec<PrescribedMotion>,
    /// True if [sums](Facets) of the contacts with the facets of meshes are kept.
    pub sums_facets: bool,
}

impl NativeParams {
    /// Numbers that the law remembers of a contact.
    fn memory(&self) -> usize {
        self.contact.as_ref().map_or(0, ContactModel::memory)
    }

    /// Sums of facets without a contact, if they are kept.
    fn facets(&self) -> Option<Facets> {
        self.sums_facets.then(|| Facets::new(&self.walls))
    }

    /// True if there are films between near bodies.
    fn is_lubricated(&self) -> bool {
        self.contact.as_ref().is_some_and(|model| model.lubrication.is_some())
    }
}

/// The native engine.
#[derive(Clone, Debug)]
pub struct Native {
    context: ContactContext,
    order: IdOrder,
    films: Films,
    clearances: Clearances,
    forces: ContactForces,
    velocities: KnownVelocities,
    /// Motion of the bodies of each template over sub-steps of the last length.
    motions: Vec<Motion>,
    /// Largest radii (m) along the axes of the box of particles that there have been.
    widest: Vec3,
}

impl Native {
    /// The particles of `all` that `rank` has, owned or as ghosts; `all` and the rest are the same on every rank.
    ///
    /// A particle with an angular velocity but no angular momentum gets the one that belongs to it, and one whose motion is
    /// prescribed the velocities at time 0.
    ///
    /// # Errors
    /// [`Error::Input`] if the box is so small that a particle could touch others beyond the images beside the nearest one.
    pub fn new(
        params: NativeParams,
        decomposition: Decomposition,
        rank: usize,
        templates: Arc<[Template]>,
        all: &[Particle],
    ) -> Result<Self> {
        assert!(params.substeps > 0);
        let model = params.contact.clone().unwrap_or_default();
        let constants: Vec<TemplateConstants> = (templates.iter().enumerate())
            .map(|(index, template)| TemplateConstants {
                parts: PartConstants::all(template, &model),
                bound: model.reach(&template.shape),
                reach: model.reach_along(&template.shape),
                inertia: Inertia::of(template),
                weight: params.gravity * Inertia::of(template).mass,
                turns_about: template.shape.passage().map(|passage| passage.axis),
                is_free: params.motions.get(index).is_none_or(PrescribedMotion::is_free),
                motion: params.motions.get(index).cloned().unwrap_or_default(),
            })
            .collect();
        let bounds: Vec<f64> = constants.iter().map(|template| template.bound).collect();
        let widest = widest(Vec3::zeros(), all, &constants);
        if params.contact.is_some() {
            check_images(&decomposition, widest)?;
        }
        let near = GhostLayer::new(decomposition, rank, &bounds);
        let local = LocalParticles::new(&near, templates, all.iter().map(|p| started(p, &constants, 0.0)));
        let (lo, extent) = near.window();
        // Parts lie around the centres of bodies.
        let arms = constants.iter().flat_map(|template| template.parts.iter().map(PartConstants::length));
        let around = Vec3::repeat(arms.fold(0.0, f64::max));
        let finder = PairFinder::in_window(near.decomposition().domain, lo - around, extent + 2.0 * around);
        let reach = 2.0 * bounds.iter().copied().fold(0.0, f64::max);
        let is_narrow = near.decomposition().domain.has_images(reach) != [false; 3];
        let has_meshes = params.walls.iter().any(|wall| wall.surface.mesh().is_some());
        let several = is_narrow || constants.iter().any(|template| template.parts.len() > 1);
        Ok(Self {
            widest,
            motions: Vec::new(),
            velocities: KnownVelocities::default(),
            films: Films::default(),
            clearances: Clearances::default(),
            order: IdOrder::new(NeighbourList::new(finder)),
            forces: ContactForces::new(
                (near.peers.len(), several, has_meshes),
                params.memory(),
                params.facets(),
            ),
            context: ContactContext {
                laws: params.contact.as_ref().map_or_else(Vec::new, laws),
                params,
                templates: constants,
                near,
                local,
                substep: 0,
                past: Vec::new(),
                is_narrow,
            },
        })
    }

    /// The same with the particles that the ranks hand over, each by one of them. Errors: as [`new`](Self::new), on every rank. Collective.
    pub fn with(mut self, comm: &Comm, handed: &[Particle]) -> Result<Self> {
        let ContactContext { near, local, params, templates, .. } = &mut self.context;
        self.widest = widest_of_all(comm, handed, templates);
        if params.contact.is_some() {
            check_images(near.decomposition(), self.widest)?;
        }
        let begun = handed.iter().map(|particle| (started(particle, templates, 0.0), Load::default()));
        local.take_over(near, comm, 0, begun);
        Ok(self)
    }

    /// Continues from the state of another engine after `substep` sub-steps: the particles are its particles,
    /// `records` are (at least) the histories of the contacts that this rank evaluates, `begun` is the number of
    /// contacts that have begun here. Walls are where `substep` sub-steps of the coming length have brought them.
    pub fn resume(&mut self, records: &Records, substep: u64, begun: u64) {
        let ContactContext { near, local, .. } = &self.context;
        self.forces.history = History::new(records.clone());
        self.forces.history.retain(|key| evaluating_rank_of(key, near, local) == Some(near.rank));
        self.forces.begun = begun;
        self.context.substep = substep;
    }

    /// Histories of the contacts that this rank evaluates, ascending.
    pub fn records(&self) -> &Records {
        self.forces.history.records()
    }

    /// Sub-steps since the start.
    pub fn substep(&self) -> u64 {
        self.context.substep
    }

    /// Stores the loads of the previous sub-step for the laws that need them, and replaces them if there are new ones.
    fn note_loads(&mut self, new: Option<&[Load]>) {
        let ContactContext { past, laws, local, params, templates, .. } = &mut self.context;
        past.clear();
        let needs_past = params.is_lubricated() || laws.iter().any(PairLaw::lags);
        if let Some(new) = new {
            std::mem::swap(past, &mut local.loads);
            local.loads.clear();
            local.loads.extend_from_slice(new);
            hold_axes(templates, local.store.owned(), &mut local.loads);
        } else if needs_past {
            past.extend_from_slice(&local.loads);
        }
        if needs_past {
            past.extend_from_slice(&local.ghost_loads);
        } else {
            past.clear();
        }
    }

    /// Positions (m) of the particles in the contacts of the sub-step.
    fn touching(&self) -> BTreeMap<u64, Vec3> {
        let local = &self.context.local;
        let ids = self.forces.states.iter().flat_map(|state| [state.first, state.second]);
        ids.filter_map(|id| Some((id, local.store.particles[local.index_of(id)?].position()))).collect()
    }

    /// One sub-step; all messages are exchanged even if it fails.
    fn advance_once(&mut self, comm: &Comm, dt: f64) -> Result<()> {
        let evaluated = self.evaluate_contacts(comm, dt);
        let ContactContext { near, local, templates, .. } = &self.context;
        self.forces.reduce(comm, near, local);
        hold_axes(templates, local.store.owned(), &mut self.forces.totals);
        let before = self.context.is_narrow.then(|| self.touching());
        let moved = self.integrate(dt);
        let ContactContext { near, local, substep, .. } = &mut self.context;
        local.refresh(near, comm);
        *substep += 1;
        self.follow(comm, before.as_ref());
        evaluated.and(moved)
    }

    /// Lets the histories of contacts follow particles that have moved, which were at `before` in a narrow box. Collective.
    fn follow(&mut self, comm: &Comm, before: Option<&BTreeMap<u64, Vec3>>) {
        let ContactContext { near, local, .. } = &self.context;
        if let Some(before) = before {
            self.forces.rename(|key| followed(key, &near.decomposition().domain, before, local));
        }
        self.forces.history.hand_over(comm, &near.peers, |key| evaluating_rank_of(key, near, local));
    }

    /// Forces of the contacts and films that this rank evaluates, at the current positions. Collective.
    fn evaluate_contacts(&mut self, comm: &Comm, dt: f64) -> Result<()> {
        let Self { context, order, films, clearances, forces, velocities, .. } = self;
        forces.begin(context.local.store.owned);
        let Some(model) = &context.params.contact else {
            return Ok(());
        };
        order.sort(&context.local, &context.templates, &context.near.decomposition().domain);
        context.find_films((model, films), order, dt, comm);
        let pairs = context.pairs(model, dt, (order, films), (forces, velocities));
        let walls = context.walls(model, dt, films, clearances, (forces, velocities));
        forces.finish();
        pairs.and(walls)
    }
}

/// Leaves bodies that go through the box, which turn about the axis of the box along it alone, only the torque about that axis.
fn hold_axes(templates: &[TemplateConstants], owned: &[Particle], loads: &mut [Load]) {
    if templates.iter().all(|template| template.turns_about.is_none()) {
        return;
    }
    for (particle, load) in owned.iter().zip(loads) {
        if let Some(axis) = templates[particle.template as usize].turns_about {
            (0..3).filter(|&other| other != axis).for_each(|other| load.torque[other] = 0.0);
        }
    }
}

/// The laws of all pairs of materials.
fn laws(model: &ContactModel) -> Vec<PairLaw> {
    let n = model.materials.len();
    (0..n * n).map(|i| PairLaw::new(model, i / n, i % n)).collect()
}

/// The rank that evaluates a contact, if this rank has all its particles.
fn evaluating_rank_of(key: &ContactKey, near: &GhostLayer, local: &LocalParticles) -> Option<usize> {
    let i = local.index_of(key.first)?;
    if ContactState::wall_of(key.second).is_some() {
        return Some(local.store.owners[i] as usize);
    }
    near.evaluating_rank_of([i, local.index_of(key.second)?], &local.store)
}

/// The key of a contact after particles, which were at `before`, have moved: another image may have become the nearest one.
fn followed(
    key: &ContactKey,
    domain: &Domain,
    before: &BTreeMap<u64, Vec3>,
    now: &LocalParticles,
) -> ContactKey {
    let nearest =
        |at: &dyn Fn(u64) -> Option<Vec3>| Some(domain.nearest_image(at(key.second)? - at(key.first)?));
    let was = nearest(&|id| before.get(&id).copied());
    let is = nearest(&|id| now.index_of(id).map(|index| now.store.particles[index].position()));
    let (Some(was), Some(is)) = (was, is) else { return *key };
    key.with_shift(domain.boxes(domain.shifted(was, key.shift()) - is))
}

/// The face of the box that a wrapped position lies beyond, e.g. `"z-"`.
pub fn face_passed(domain: &Domain, position: Vec3) -> Option<&'static str> {
    const FACES: [[&str; 2]; 3] = [["x-", "x+"], ["y-", "y+"], ["z-", "z+"]];
    if domain.periodic() == [true; 3] {
        return None;
    }
    let size = domain.size();
    (0..3).filter(|&i| !domain.is_periodic(i)).find_map(|i| {
        if position[i] < 0.0 {
            Some(FACES[i][0])
        } else if position[i] > size[i] {
            Some(FACES[i][1])
        } else {
            None
        }
    })
}

/// A particle as an engine needs it at a time (s): with the angular momentum that belongs to its angular velocity, if it has none, and the
/// velocities that are prescribed.
fn started(particle: &Particle, constants: &[TemplateConstants], time: f64) -> Particle {
    let mut particle = *particle;
    let TemplateConstants { inertia, motion, .. } = &constants[particle.template as usize];
    integrator::set_prescribed(&mut particle, inertia, motion, time);
    if Vec3::from(particle.angular_momentum) == Vec3::zeros() {
        let velocity = particle.angular_velocity();
        particle.angular_momentum = inertia.angular_momentum(&particle.orientation(), velocity).into();
    }
    particle
}

/// The largest radii (m) along the axes of the box among `widest` and those of particles.
fn widest(widest: Vec3, all: &[Particle], constants: &[TemplateConstants]) -> Vec3 {
    let reach = |particle: &Particle| constants[particle.template as usize].reach;
    all.iter().map(reach).fold(widest, |widest, reach| widest.sup(&reach))
}

/// The largest radii (m) along the axes of the box of particles that the ranks have, `own` by this one. Collective.
fn widest_of_all(comm: &Comm, own: &[Particle], constants: &[TemplateConstants]) -> Vec3 {
    let mut reach: [f64; 3] = widest(Vec3::zeros(), own, constants).into();
    comm.max(&mut reach);
    reach.into()
}

/// Refuses a box in which a pair, the widest particles, could touch through more images than the engine looks at.
fn check_images(decomposition: &Decomposition, widest: Vec3) -> Result<()> {
    let domain = &decomposition.domain;
    for axis in (0..3).filter(|&axis| domain.is_periodic(axis)) {
        let (edge, reach) = (domain.size()[axis], widest[axis]);
        let needed = 2.0 * reach / Domain::MOST_REACH;
        if edge < needed {
            return Err(Error::Input(format!(
                "the domain is {edge:.6e} m wide, too narrow for the periodic images of a particle that reaches {reach:.6e} m \
                 from its centre, contact enlargement included; make it at least {needed:.6e} m wide"
            )));
        }
    }
    Ok(())
}

impl DemEngine for Native {
    fn name(&self) -> &'static str {
        "native"
    }

    fn supports(&self, _: &dyn Shape) -> bool {
        true
    }

    fn particles(&self) -> &ParticleStore {
        &self.context.local.store
    }

    fn advance(&mut self, comm: &Comm, loads: &[Load], dt: f64) -> Result<()> {
        let ContactContext { near, local, params, .. } = &self.context;
        assert_eq!(loads.len(), local.store.owned);
        assert_eq!((comm.rank(), comm.size()), (near.rank, near.ranks()));
        let substeps = params.substeps;
        self.note_loads(Some(loads));
        let mut outcome = Ok(());
        for substep in 0..substeps {
            if substep > 0 {
                self.note_loads(None);
            }
            outcome = outcome.and(self.advance_once(comm, dt / f64::from(substeps)));
        }
        outcome
    }

    fn loads(&self) -> &[Load] {
        &self.context.local.loads
    }

    fn next_id(&self) -> Option<u64> {
        Some(self.context.local.population.next_id)
    }

    fn insert(&mut self, new: &[Particle], time: f64) -> Result<()> {
        let ContactContext { near, local, params, templates, .. } = &mut self.context;
        let widest = widest(self.widest, new, templates);
        if params.contact.is_some() {
            check_images(near.decomposition(), widest)?;
        }
        self.widest = widest;
        local.insert(near, new.iter().map(|particle| started(particle, templates, time)));
        Ok(())
    }

    fn remove(&mut self, ids: &[u64]) -> Result<()> {
        let ContactContext { near, local, .. } = &mut self.context;
        local.remove(near, ids);
        let stays =
            |key: &ContactKey| [key.first, key.second].iter().all(|id| ids.binary_search(id).is_err());
        self.forces.history.retain(stays);
        self.forces.states.retain(|state| stays(&state.key()));
        Ok(())
    }

    fn place(&mut self, comm: &Comm, owned: Vec<(Particle, Load)>, check: Check) -> Result<()> {
        let ContactContext { near, local, .. } = &self.context;
        let placed = local.placed(near, comm, owned);
        check([local, &placed])?;
        let before = self.context.is_narrow.then(|| self.touching());
        self.context.local = placed;
        self.follow(comm, before.as_ref());
        Ok(())
    }

    fn contacts(&self) -> ContactSummary {
        self.forces.summary(self.context.params.contact.as_ref().is_some_and(ContactModel::is_cohesive))
    }

    fn contact_states(&self, _: &Comm) -> Vec<ContactState> {
        self.forces.states()
    }

    fn facets(&self) -> Option<&Facets> {
        self.forces.facets.as_ref()
    }

    fn save(&self, _: &Comm) -> Result<Vec<u8>> {
        let saved = Saved {
            substep: self.context.substep,
            begun: self.forces.begun,
            population: self.context.local.population,
            particles: self.particles().owned().to_vec(),
            loads: self.context.local.loads.clone(),
            records: self.records().clone(),
            states: self.forces.states(),
            own: self.forces.facets.as_ref().map_or_else(Vec::new, Facets::save),
        };
        Ok(saved.write(self.name()))
    }

    fn restore(&mut self, comm: &Comm, parts: &SavedParts) -> Result<()> {
        let ContactContext { near, local, params, templates, .. } = &mut self.context;
        let memory = params.memory();
        let Loaded { state: saved, own } =
            Saved::load("native", comm, parts, (near, local, &params.walls), memory)?;
        // Each rank continues the sums of the parts that it has read.
        let mut facets = params.facets();
        let fit = |facets: &mut Facets| own.iter().all(|(_, sums)| facets.take(sums));
        if comm.any(!facets.as_mut().is_none_or(fit)) {
            return Err(Error::Input(
                "the saved state of the native engine cannot be used: its sums of facets are of other meshes"
                    .into(),
            ));
        }
        self.widest = widest_of_all(comm, &saved.particles, templates);
        let handed = saved.particles.into_iter().zip(saved.loads);
        local.take_over(near, comm, saved.population.next_id, handed);
        let ContactForces { several, has_meshes, .. } = self.forces;
        self.forces = ContactForces::new((near.peers.len(), several, has_meshes), memory, facets);
        self.forces.states = saved.states;
        self.resume(&saved.records, saved.substep, saved.begun);
        Ok(())
    }
}
