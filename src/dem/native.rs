//! The native engine: contacts of convex bodies, leapfrog, one block of the box per rank.
//!
//! A sub-step:
//!
//! 1. every rank searches pairs among the particles it knows, and evaluates the contacts it is responsible for;
//! 2. forces go to the owners, who add them up in ascending order of the partner's id;
//! 3. owners integrate;
//! 4. particles go to their new owners and to all ranks that must know them;
//! 5. the memory of a contact follows its responsibility.
//!
//! Every number is computed once, by one rank, from the same bits in the same order whatever the number of ranks: the
//! pair with the lower id first, from the nearest image of wrapped positions. So trajectories are the same to the bit.
//!
//! Walls, and bodies that touch through two images at once, are left out.

#[cfg(test)]
mod bricks;
#[cfg(test)]
mod tests;

use super::assign::{Neighbourhood, responsible};
use super::exchange::Population;
use super::history::{History, Record};
use super::integrator::{self, Inertia};
use super::{ContactState, ContactSummary, DemEngine, Load};
use crate::comm::Comm;
use crate::contact::{Body, ContactModel, Contour, Overlap, PairFinder, PairLaw, law::UNSET, measure};
use crate::domain::Decomposition;
use crate::error::{Error, Result};
use crate::math::Vec3;
use crate::particle::{Particle, ParticleStore, Template};
use crate::shape::Shape;
use crate::wall::Wall;
use bytemuck::{Pod, Zeroable};
use std::sync::Arc;

/// Overlaps deeper than this part of the smaller circumradius are beyond the contact model.
const DEEPEST: f64 = 0.5;

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
    /// Circumradius plus enlargement by template (m).
    bounds: Vec<f64>,
    /// By the materials of the pair, as [`ContactModel::pairs`].
    laws: Vec<PairLaw>,
    finder: PairFinder,
    history: History,
    summary: ContactSummary,
    /// Sub-steps since the start.
    substep: u64,
    scratch: Scratch,
}

/// Buffers that live from sub-step to sub-step.
#[derive(Clone, Debug, Default)]
struct Scratch {
    /// Indices of the known particles, ascending by id; their positions and bounding radii.
    known: Vec<u32>,
    positions: Vec<Vec3>,
    radii: Vec<f64>,
    /// Contact forces on owned particles, with their index.
    shares: Vec<(u32, Share)>,
    /// The same for other ranks, by peer.
    messages: Vec<Vec<u8>>,
    /// Contact force and torque by owned particle.
    totals: Vec<Load>,
    /// Contacts of this sub-step, ascending by the ids of the pair.
    states: Vec<ContactState>,
}

/// What one contact does to one particle.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Share {
    to: u64,
    partner: u64,
    force: [f64; 3],
    torque: [f64; 3],
}

impl Share {
    fn new([to, partner]: [u64; 2], force: Vec3, lever: Vec3) -> Self {
        Self {
            to,
            partner,
            force: force.into(),
            torque: lever.cross(&force).into(),
        }
    }
}

impl Native {
    /// The part of `all` that `rank` owns or knows; `all` and the rest are the same on every rank.
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
        let circumradii: Vec<f64> = templates.iter().map(|t| t.shape.circumradius()).collect();
        let bounds: Vec<f64> = circumradii.iter().map(|r| r + enlargement).collect();
        if params.contact.is_some() {
            check_images(&decomposition, all, &bounds)?;
        }
        let inertias: Vec<Inertia> = templates.iter().map(Inertia::of).collect();
        let near = Neighbourhood::new(decomposition, rank, &circumradii, enlargement);
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
        let contours = (templates.iter())
            .map(|t| Contour::new(t.shape.clone(), enlargement))
            .collect();
        let population = Population::new(&near, rank, templates, spun);
        let (lo, extent) = near.window(rank);
        Ok(Self {
            finder: PairFinder::in_window(near.decomposition().domain, lo, extent),
            contours,
            laws: params.contact.as_ref().map_or_else(Vec::new, laws),
            scratch: Scratch {
                messages: vec![Vec::new(); near.peers.len()],
                ..Scratch::default()
            },
            history: History::default(),
            summary: ContactSummary::default(),
            substep: 0,
            params,
            rank,
            near,
            population,
            inertias,
            bounds,
        })
    }

    /// Goes on where another engine stood after `substep` sub-steps: `all` of [`new`](Self::new) were its particles,
    /// `records` are (at least) the memories of the contacts this rank is responsible for, `begun` the contacts it has
    /// seen begin.
    pub fn resume(&mut self, records: &[Record], substep: u64, begun: u64) {
        let mine = records
            .iter()
            .filter(|r| responsible_for(r, &self.near, &self.population) == Some(self.rank));
        self.history = History::new(mine.copied().collect());
        self.substep = substep;
        self.summary.begun = begun;
    }

    /// Memories of the contacts this rank is responsible for, ascending by pair of ids.
    pub fn records(&self) -> &[Record] {
        self.history.records()
    }

    /// Sub-steps since the start.
    pub fn substep(&self) -> u64 {
        self.substep
    }

    /// One sub-step; all messages are exchanged even if it fails.
    fn advance_once(&mut self, comm: &Comm, dt: f64) -> Result<()> {
        let evaluated = self.evaluate_contacts();
        self.add_up(comm);
        let moved = self.integrate(dt);
        self.population.refresh(&self.near, comm);
        let (near, population) = (&self.near, &self.population);
        self.history.hand_over(comm, &near.peers, |record| {
            responsible_for(record, near, population)
        });
        self.substep += 1;
        evaluated.and(moved)
    }

    /// Forces of the contacts this rank is responsible for, at the current positions.
    fn evaluate_contacts(&mut self) -> Result<()> {
        let Self {
            params,
            near,
            population,
            history,
            finder,
            scratch,
            summary,
            bounds,
            contours,
            laws,
            ..
        } = self;
        scratch.shares.clear();
        scratch.states.clear();
        scratch.messages.iter_mut().for_each(Vec::clear);
        (summary.count, summary.max_depth) = (0, 0.0);
        let Some(contact) = &params.contact else {
            return Ok(());
        };
        let store = &population.store;
        scratch.list(store, bounds);
        let domain = near.decomposition().domain;
        let mut failure = Ok(());
        for &[i, j] in finder.find(&scratch.positions, &scratch.radii) {
            let [i, j] = [i, j].map(|k| scratch.known[k as usize] as usize);
            if responsible_for_pair(i, j, near, store) != Some(self.rank) {
                continue;
            }
            let (a, b) = (&store.particles[i], &store.particles[j]);
            let offset = domain.nearest_image(b.position() - a.position());
            let [first, second] = [a, b].map(|p| Body {
                contour: &contours[p.template as usize],
                orientation: p.orientation(),
            });
            let Some(overlap) = measure(contact.geometry, &first, &second, offset) else {
                continue;
            };
            let [of_first, of_second] = [a, b].map(|p| store.template(p).material);
            let law = &laws[of_first * contact.materials.len() + of_second];
            let mut record = history.recall(a.id, b.id).unwrap_or_else(|| {
                summary.begun += 1;
                Record {
                    first: a.id,
                    second: b.id,
                    damping: UNSET,
                    age: 0,
                }
            });
            let levers = [overlap.point, overlap.point - offset];
            let velocity = (a.velocity() + a.angular_velocity().cross(&levers[0]))
                - (b.velocity() + b.angular_velocity().cross(&levers[1]));
            record.damping = law.latch(record.damping, velocity.dot(&overlap.normal));
            record.age += 1;
            history.keep(record);
            let force = law.force(&overlap, velocity, record.damping);
            summary.count += usize::from(force != Vec3::zeros());
            summary.max_depth = summary.max_depth.max(overlap.depth);
            let radius = (first.contour.shape.circumradius()).min(second.contour.shape.circumradius());
            if overlap.depth > DEEPEST * radius && failure.is_ok() {
                failure = Err(too_deep(self.substep, a, b, &overlap, radius));
            }
            scratch.states.push(ContactState {
                first: a.id,
                second: b.id,
                point: domain.wrap(a.position() + overlap.point).into(),
                normal: overlap.normal.into(),
                force: force.into(),
                depth: overlap.depth,
                volume: overlap.volume,
            });
            let of_a = Share::new([a.id, b.id], force, levers[0]);
            let of_b = Share::new([b.id, a.id], -force, levers[1]);
            scratch.book(i, of_a, near, store);
            scratch.book(j, of_b, near, store);
        }
        history.turn();
        failure
    }

    /// Sends forces to the owners and adds up those on the owned particles, by ascending id of the partner.
    fn add_up(&mut self, comm: &Comm) {
        let (scratch, population) = (&mut self.scratch, &self.population);
        if !self.near.peers.is_empty() {
            let local = scratch.shares.len();
            let messages = scratch.messages.clone();
            for message in comm.exchange(&self.near.peers, messages) {
                for share in bytemuck::pod_collect_to_vec::<u8, Share>(&message) {
                    if let Some(index) = population.index_of(share.to) {
                        scratch.shares.push((index as u32, share));
                    }
                }
            }
            // Without messages they are in order already: pairs are, and lower partners come first.
            if scratch.shares.len() > local {
                scratch
                    .shares
                    .sort_unstable_by_key(|(index, share)| (*index, share.partner));
            }
        }
        scratch.totals.clear();
        scratch.totals.resize(population.store.owned, Load::default());
        for (index, share) in &scratch.shares {
            let total = &mut scratch.totals[*index as usize];
            total.force += Vec3::from(share.force);
            total.torque += Vec3::from(share.torque);
        }
    }

    /// Moves the owned particles. One that would leave the range of the method stays where it is.
    fn integrate(&mut self, dt: f64) -> Result<()> {
        let domain = self.near.decomposition().domain;
        let owned = self.population.store.owned;
        let mut failure = Ok(());
        for (i, particle) in self.population.store.particles[..owned].iter_mut().enumerate() {
            let (contact, load) = (&self.scratch.totals[i], &self.population.loads[i]);
            let inertia = &self.inertias[particle.template as usize];
            let force = load.force + contact.force + self.params.gravity * inertia.mass;
            let torque = load.torque + contact.torque;
            let before = *particle;
            if self.substep == 0 {
                integrator::start(particle, force, torque);
            }
            integrator::step(particle, inertia, force, torque, dt);
            particle.contact_force = contact.force.into();
            let moved = (particle.position() - before.position()).amax();
            if particle.is_finite() && moved <= domain.dx {
                particle.position = domain.wrap(particle.position()).into();
            } else {
                let after = std::mem::replace(particle, before);
                if failure.is_ok() {
                    failure = Err(too_far(self.substep, &before, &after, force, domain.dx));
                }
            }
        }
        failure
    }
}

impl Scratch {
    /// Lists the known particles by ascending id.
    fn list(&mut self, store: &ParticleStore, bounds: &[f64]) {
        let (owned, known) = (store.owned as u32, store.particles.len() as u32);
        let id = |k: u32| store.particles[k as usize].id;
        let (mut next_owned, mut next_ghost) = (0, owned);
        self.known.clear();
        while next_owned < owned || next_ghost < known {
            let ghost = next_owned == owned || (next_ghost < known && id(next_ghost) < id(next_owned));
            let next = if ghost { &mut next_ghost } else { &mut next_owned };
            self.known.push(*next);
            *next += 1;
        }
        let particles = || self.known.iter().map(|&k| &store.particles[k as usize]);
        self.positions.clear();
        self.positions.extend(particles().map(Particle::position));
        self.radii.clear();
        self.radii
            .extend(particles().map(|p| bounds[p.template as usize]));
    }

    /// Books a share of known particle `index`: here, or in the message to its owner.
    fn book(&mut self, index: usize, share: Share, near: &Neighbourhood, store: &ParticleStore) {
        if index < store.owned {
            self.shares.push((index as u32, share));
        } else if let Ok(link) = near.peers.binary_search(&(store.owners[index] as usize)) {
            self.messages[link].extend_from_slice(bytemuck::bytes_of(&share));
        }
    }
}

/// The laws of all pairs of materials.
fn laws(model: &ContactModel) -> Vec<PairLaw> {
    let n = model.materials.len();
    (0..n * n).map(|i| PairLaw::new(model, i / n, i % n)).collect()
}

/// The rank responsible for the contact of two known particles.
fn responsible_for_pair(i: usize, j: usize, near: &Neighbourhood, store: &ParticleStore) -> Option<usize> {
    let knows_both = |rank| {
        [i, j].iter().all(|&k| {
            let particle = &store.particles[k];
            near.knows(rank, particle.position(), particle.template)
        })
    };
    let [a, b] = [i, j].map(|k| store.owners[k] as usize);
    responsible(a, b, near.ranks(), knows_both)
}

/// The rank responsible for a contact by its record, if both particles are known here.
fn responsible_for(record: &Record, near: &Neighbourhood, population: &Population) -> Option<usize> {
    let (i, j) = (
        population.index_of(record.first)?,
        population.index_of(record.second)?,
    );
    responsible_for_pair(i, j, near, &population.store)
}

/// Refuses a box in which a pair could touch through two images: the nearest one is all the engine looks at.
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
    let (edge, needed) = (decomposition.domain.size().min(), 2.0 * (largest + second));
    if all.len() > 1 && edge < needed {
        return Err(Error::Input(format!(
            "the domain is {edge:.6e} m wide, but two particles with circumscribed radii (contact enlargement \
             included) of {largest:.6e} m and {second:.6e} m could touch through two periodic images at once; \
             make it at least {needed:.6e} m wide"
        )));
    }
    Ok(())
}

fn too_deep(step: u64, a: &Particle, b: &Particle, overlap: &Overlap, radius: f64) -> Error {
    Error::Diverged {
        step,
        what: format!(
            "particles {} at {} and {}: overlap {:.3e} m deep, more than half the circumradius {radius:.3e} m",
            a.id,
            Population::place(a.position()),
            b.id,
            overlap.depth
        ),
    }
}

fn too_far(step: u64, before: &Particle, after: &Particle, force: Vec3, dx: f64) -> Error {
    let what = if after.is_finite() {
        format!(
            "moved {:.3e} m in one sub-step, more than a cell ({dx:.3e} m), under {:.3e} N",
            (after.position() - before.position()).amax(),
            force.norm()
        )
    } else {
        format!("its state is not finite, under {:.3e} N", force.norm())
    };
    let place = Population::place(before.position());
    Error::Diverged {
        step,
        what: format!("particle {} at {place}: {what}", before.id),
    }
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
        self.population.loads.copy_from_slice(loads);
        let mut outcome = Ok(());
        for _ in 0..self.params.substeps {
            outcome = outcome.and(self.advance_once(comm, dt / f64::from(self.params.substeps)));
        }
        outcome
    }

    fn contacts(&self) -> ContactSummary {
        self.summary
    }

    fn contact_states(&self) -> Vec<ContactState> {
        self.scratch.states.clone()
    }
}
