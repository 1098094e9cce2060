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
//! particles. Bodies that touch through two images at once are left out, and so are images of walls.

#[cfg(test)]
mod bricks;
#[cfg(test)]
mod carried_tests;
#[cfg(test)]
mod cube_tests;
#[cfg(test)]
mod damped_tests;
pub mod failures;
mod ledger;
#[cfg(test)]
mod mixed_tests;
#[cfg(test)]
mod saved_tests;
mod scene;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod wall_tests;

use super::assign::Neighbourhood;
use super::exchange::Population;
use super::history::{History, Record};
use super::integrator::{self, Inertia};
use super::saved::{Case, Saved};
use super::{ContactState, ContactSummary, DemEngine, Load};
use crate::comm::Comm;
use crate::contact::{ContactModel, Contour, DampingLaw, PairFinder, PairLaw};
use crate::domain::{Decomposition, Domain};
use crate::error::{Error, Result};
use crate::math::Vec3;
use crate::particle::{Particle, ParticleStore, Template};
use crate::shape::Shape;
use crate::wall::{Surface, Wall};
use failures::{outside, too_far};
use ledger::Ledger;
use scene::{Roll, Scene, responsible_for_pair};
use std::sync::Arc;

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
}

/// The native engine.
#[derive(Clone, Debug)]
pub struct Native {
    params: NativeParams,
    rank: usize,
    near: Neighbourhood,
    population: Population,
    /// By template.
    inertias: Vec<Inertia>,
    /// By template.
    contours: Vec<Contour>,
    /// Radius of a sphere that holds the enlarged body by template (m).
    bounds: Vec<f64>,
    /// Radius of the sphere of equal volume plus enlargement by template (m).
    radii: Vec<f64>,
    /// By the materials of the pair, as [`ContactModel::pairs`].
    laws: Vec<PairLaw>,
    /// Those of the walls at the last sub-step.
    surfaces: Vec<Surface>,
    ledger: Ledger,
    /// Sub-steps since the start.
    substep: u64,
    /// Loads of the previous sub-step by particle, if a law needs them.
    past: Vec<Load>,
    roll: Roll,
}

impl Native {
    /// The particles of `all` that `rank` has, owned or as ghosts; `all` and the rest are the same on every rank.
    ///
    /// A particle with an angular velocity but no angular momentum gets the one that belongs to it.
    ///
    /// # Errors
    /// [`Error::Input`] if the box is so small that two particles could touch through two periodic images at once.
    pub fn new(
        params: NativeParams,
        decomposition: Decomposition,
        rank: usize,
        templates: Arc<[Template]>,
        all: &[Particle],
    ) -> Result<Self> {
        assert!(params.substeps > 0);
        let enlargement = params.contact.as_ref().map_or(0.0, |contact| contact.enlargement);
        let contours: Vec<Contour> =
            (templates.iter()).map(|t| Contour::new(t.shape.clone(), enlargement)).collect();
        let bounds: Vec<f64> = contours.iter().map(Contour::reach).collect();
        if params.contact.is_some() {
            check_images(&decomposition, all, &bounds)?;
        }
        let inertias: Vec<Inertia> = templates.iter().map(Inertia::of).collect();
        let near = Neighbourhood::new(decomposition, rank, &bounds);
        let spun = all.iter().map(|particle| {
            let mut particle = *particle;
            let (momentum, velocity) = (Vec3::from(particle.angular_momentum), particle.angular_velocity());
            let inertia = &inertias[particle.template as usize];
            if momentum == Vec3::zeros() {
                let momentum = inertia.angular_momentum(&particle.orientation(), velocity);
                particle.angular_momentum = momentum.into();
            }
            particle
        });
        let population = Population::new(&near, rank, templates, spun);
        let (lo, extent) = near.window(rank);
        let radii = (population.store.templates.iter())
            .map(|t| 0.5 * t.shape.equivalent_diameter() + enlargement)
            .collect();
        Ok(Self {
            roll: Roll::new(PairFinder::in_window(near.decomposition().domain, lo, extent)),
            contours,
            radii,
            laws: params.contact.as_ref().map_or_else(Vec::new, laws),
            surfaces: Vec::new(),
            ledger: Ledger::new(near.peers.len()),
            substep: 0,
            past: Vec::new(),
            params,
            rank,
            near,
            population,
            inertias,
            bounds,
        })
    }

    /// Continues from the state of another engine after `substep` sub-steps: the particles are its particles,
    /// `records` are (at least) the histories of the contacts that this rank evaluates, `begun` is the number of
    /// contacts that have begun here. Walls are where `substep` sub-steps of the coming length have brought them.
    pub fn resume(&mut self, records: &[Record], substep: u64, begun: u64) {
        let mine =
            records.iter().filter(|r| responsible_for(r, &self.near, &self.population) == Some(self.rank));
        self.ledger.history = History::new(mine.copied().collect());
        self.ledger.summary.begun = begun;
        self.substep = substep;
    }

    /// Histories of the contacts that this rank evaluates, ascending by pair of ids.
    pub fn records(&self) -> &[Record] {
        self.ledger.history.records()
    }

    /// Sub-steps since the start.
    pub fn substep(&self) -> u64 {
        self.substep
    }

    /// Stores the loads of the previous sub-step for the laws that need them.
    fn note_loads(&mut self) {
        self.past.clear();
        if self.laws.iter().any(|law| law.damping == DampingLaw::Tsuji) {
            self.past.extend_from_slice(&self.population.loads);
            self.past.extend_from_slice(&self.population.ghost_loads);
        }
    }

    /// One sub-step; all messages are exchanged even if it fails.
    fn advance_once(&mut self, comm: &Comm, dt: f64) -> Result<()> {
        let evaluated = self.evaluate_contacts(dt);
        self.ledger.add_up(comm, &self.near, &self.population);
        let moved = self.integrate(dt);
        self.population.refresh(&self.near, comm);
        let (near, population) = (&self.near, &self.population);
        self.ledger.history.hand_over(comm, &near.peers, |record| responsible_for(record, near, population));
        self.substep += 1;
        evaluated.and(moved)
    }

    /// Forces of the contacts that this rank evaluates, at the current positions.
    fn evaluate_contacts(&mut self, dt: f64) -> Result<()> {
        self.ledger.open();
        let Some(contact) = &self.params.contact else {
            return Ok(());
        };
        let scene = Scene {
            contact,
            contours: &self.contours,
            bounds: &self.bounds,
            radii: &self.radii,
            inertias: &self.inertias,
            laws: &self.laws,
            store: &self.population.store,
            near: &self.near,
            rank: self.rank,
            substep: self.substep,
            dt,
            gravity: self.params.gravity,
            past: (self.substep > 0 && !self.past.is_empty()).then_some(&self.past[..]),
        };
        let mut outcome = scene.pairs(&mut self.roll, &mut self.ledger);
        if !self.params.walls.is_empty() {
            let time = self.substep as f64 * dt;
            self.surfaces.clear();
            (self.surfaces).extend(self.params.walls.iter().map(|wall| wall.surface_at(time)));
            let walls = (&self.params.walls[..], &self.surfaces[..]);
            outcome = outcome.and(scene.walls(walls, time, &mut self.ledger));
        }
        self.ledger.close();
        outcome
    }

    /// Moves the owned particles. One that would leave the range of the method stays where it is.
    fn integrate(&mut self, dt: f64) -> Result<()> {
        let domain = self.near.decomposition().domain;
        let owned = self.population.store.owned;
        let mut failure = Ok(());
        for (i, particle) in self.population.store.particles[..owned].iter_mut().enumerate() {
            let contact = &self.ledger.totals[i];
            let inertia = &self.inertias[particle.template as usize];
            let mut load = self.population.loads[i];
            load.force += self.params.gravity * inertia.mass;
            let before = *particle;
            if self.substep == 0 {
                integrator::start(particle, contact);
            }
            integrator::step(particle, inertia, &load, contact, dt);
            let moved = (particle.position() - before.position()).amax();
            let lost = if particle.is_finite() && moved <= domain.dx {
                particle.position = domain.wrap(particle.position()).into();
                face_passed(&domain, particle.position())
                    .map(|face| outside(self.substep, &before, particle, face, &self.params.walls))
            } else {
                let force = load.force + contact.force;
                Some(too_far(self.substep, &before, particle, force, domain.dx))
            };
            if let Some(error) = lost {
                *particle = before;
                failure = failure.and(Err(error));
            }
        }
        failure
    }
}

/// The laws of all pairs of materials.
fn laws(model: &ContactModel) -> Vec<PairLaw> {
    let n = model.materials.len();
    (0..n * n).map(|i| PairLaw::new(model, i / n, i % n)).collect()
}

/// The rank that evaluates the contact of a record, if this rank has all its particles.
fn responsible_for(record: &Record, near: &Neighbourhood, population: &Population) -> Option<usize> {
    let i = population.index_of(record.first)?;
    if ContactState::wall_of(record.second).is_some() {
        return Some(population.store.owners[i] as usize);
    }
    let j = population.index_of(record.second)?;
    responsible_for_pair(i, j, near, &population.store)
}

/// The face of the box that a wrapped position lies beyond, e.g. `"z-"`.
pub fn face_passed(domain: &Domain, position: Vec3) -> Option<&'static str> {
    const FACES: [[&str; 2]; 3] = [["x-", "x+"], ["y-", "y+"], ["z-", "z+"]];
    if domain.periodic == [true; 3] {
        return None;
    }
    let size = domain.size();
    (0..3).filter(|&i| !domain.periodic[i]).find_map(|i| {
        if position[i] < 0.0 {
            Some(FACES[i][0])
        } else if position[i] > size[i] {
            Some(FACES[i][1])
        } else {
            None
        }
    })
}

/// Refuses a box in which a pair could touch through two images: the engine considers only the nearest one.
fn check_images(decomposition: &Decomposition, all: &[Particle], bounds: &[f64]) -> Result<()> {
    let (mut largest, mut second) = (0.0, 0.0);
    for particle in all {
        let bound = bounds[particle.template as usize];
        if bound > largest {
            (largest, second) = (bound, largest);
        } else if bound > second {
            second = bound;
        }
    }
    let domain = &decomposition.domain;
    let size = domain.size();
    let round = (0..3).filter(|&i| domain.periodic[i]);
    let edge = round.map(|i| size[i]).fold(f64::INFINITY, f64::min);
    let needed = 2.0 * (largest + second);
    if all.len() > 1 && edge < needed {
        return Err(Error::Input(format!(
            "the domain is {edge:.6e} m wide, but two particles with circumscribed radii (contact enlargement \
             included) of {largest:.6e} m and {second:.6e} m could touch through two periodic images at once; \
             make it at least {needed:.6e} m wide"
        )));
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
        &self.population.store
    }

    fn advance(&mut self, comm: &Comm, loads: &[Load], dt: f64) -> Result<()> {
        assert_eq!(loads.len(), self.population.store.owned);
        assert_eq!((comm.rank(), comm.size()), (self.rank, self.near.ranks()));
        self.note_loads();
        self.population.loads.copy_from_slice(loads);
        let mut outcome = Ok(());
        for substep in 0..self.params.substeps {
            if substep > 0 {
                self.note_loads();
            }
            outcome = outcome.and(self.advance_once(comm, dt / f64::from(self.params.substeps)));
        }
        outcome
    }

    fn contacts(&self) -> ContactSummary {
        self.ledger.summary
    }

    fn contact_states(&self) -> Vec<ContactState> {
        self.ledger.states.clone()
    }

    fn save(&self) -> Result<Vec<u8>> {
        let saved = Saved {
            substep: self.substep,
            begun: self.ledger.summary.begun,
            particles: self.population.store.owned().to_vec(),
            loads: self.population.loads.clone(),
            records: self.records().to_vec(),
            states: self.ledger.states.clone(),
            own: Vec::new(),
        };
        Ok(saved.write(self.name()))
    }

    fn restore(&mut self, comm: &Comm, parts: &[Vec<u8>]) -> Result<()> {
        let case = Case {
            census: self.population.census(comm),
            walls: self.params.walls.len(),
            domain: self.near.decomposition().domain,
        };
        let saved = Saved::join(self.name(), parts, &case, (self.rank, comm.size()))?;
        let templates = self.population.store.templates.clone();
        let all = saved.particles.into_iter().zip(saved.loads);
        self.population = Population::loaded(&self.near, self.rank, templates, all);
        self.ledger = Ledger::new(self.near.peers.len());
        self.resume(&saved.records, saved.substep, saved.begun);
        self.ledger.recount(saved.states);
        Ok(())
    }
}
