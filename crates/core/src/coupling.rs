//! Coupling of fluid and particles: the only place where SI units meet lattice units at run time.
//!
//! - [`map`](Coupling::map): particles -> the cells they cover, all parts of a body together;
//! - [`sweep`](Coupling::sweep): one sweep of the fluid round them, by one of two [`Method`]s;
//! - [`loads`](Coupling::loads): momentum exchange over the covered cells -> force and torque on each particle, those on
//!   light ones with a [`VirtualMass`];
//! - [`measure`](Coupling::measure): first moments of that momentum -> stress of the particles;
//! - [`LatticeWalls`]: walls -> cells and motions that the fluid bounces back from;
//! - [`Driving`]: the acceleration of the fluid that balances the weight of the particles and removes the net flux.
//!
//! Everything a cell contributes is computed from its integer offset to the particle's reference cell, so it is the
//! same on every rank, for every periodic image, and for a particle moved by whole cells.

mod any_fluid;
mod cells;
mod cover;
mod driving;
mod faces;
mod homogenised;
mod images;
mod kept;
mod light;
mod mapper;
mod method;
mod population;
mod saturated;
mod saved;
mod walls;

use crate::comm::Comm;
use crate::dem::Load;
use crate::domain::{Block, Decomposition, Domain};
use crate::fluid::{
    Body, CoverCount, ExchangeSum, Fluid, Images, LatticeSphere, Population, RigidMotion, RowSegments, Simd,
};
use crate::math::{Vec3, from_fixed};
use crate::particle::{Particle, ParticleStore, Template};
use crate::shape::Shape;
use crate::units::Units;
pub use any_fluid::AnyFluid;
use cover::Cover;
pub use driving::{
    CONTROL_INTERVAL, Control, ControlRecord, Driving, DrivingParams, ForceBalance, MeanFlow, Resistance,
};
pub use homogenised::Homogenised;
use kept::KeptSpheres;
pub use light::VirtualMass;
use mapper::Mapper;
pub use method::Method;
#[cfg(test)]
pub(crate) use method::sweep_alone;
use method::{CouplingMethod, with_method};
use saturated::KeptPolyhedra;
pub use saturated::{Saturated, SolidOperator, SurfaceShift};
use std::sync::Arc;
pub use walls::{LatticeWalls, check_motion};

/// Parameters of the coupling.
#[derive(Clone, Copy, Debug)]
pub struct CouplingParams {
    /// Cell size, time step, density of the fluid.
    pub units: Units,
    /// Solid fraction and collision of the cells that particles cover.
    pub method: Method,
    /// Gravity (m/s^2), for the buoyancy.
    pub gravity: Vec3,
    /// Bodies on which the mean pressure gradient acts.
    pub force_balance: ForceBalance,
    /// Instruction set, which the processor must have; all give the same bits.
    pub simd: Simd,
}

/// Moves particle data between the engine and one block of fluid, which is at rest before the first step unless
/// [`begin_moving`](Self::begin_moving) says otherwise.
pub struct Coupling {
    params: CouplingParams,
    decomposition: Decomposition,
    block: Block,
    /// Ranks that may have a particle that touches this block.
    peers: Vec<usize>,
    /// The particles of the last [`map`](Self::map), in their order, and the cells they cover.
    bodies: Vec<Body>,
    segments: RowSegments,
    /// Of those spheres, the rows that they may reach: the sweep finds their cells.
    spheres: KeptSpheres,
    /// Of those polyhedra that move little: their cells.
    polyhedra: KeptPolyhedra,
    /// The parts of the bodies, one body after the other, and the index of the body of each; without the following.
    parts: Vec<(u32, Mapper)>,
    /// The spheres, if the method needs their surfaces only, and their indices.
    surfaces: Vec<(u32, LatticeSphere)>,
    /// Body whose surface the fluid takes for that of each part of each template, moved in by a distance (cells).
    felt: Vec<Felt>,
    /// The same at the last sweep.
    swept_bodies: Vec<Body>,
    swept_segments: RowSegments,
    swept_count: CoverCount,
    swept_particles: Vec<Particle>,
    /// Number of those that were owned here.
    swept_owned: usize,
    /// Of the owned ones of them.
    swept_loads: Vec<Load>,
    /// Ids of those of them that are no longer there.
    removed: Vec<u64>,
    /// Of each template; empty if there are none.
    virtual_masses: Vec<Option<VirtualMass>>,
    /// Constant load on the bodies of each template besides all else; empty if there is none.
    applied: Vec<Load>,
    /// Mean loads of the past, weight included, of the owned ones of the last sweep; empty without virtual masses.
    swept_means: Vec<Load>,
    /// Scratch of [`map`](Self::map).
    cover: Cover,
    /// Data of the bodies for a device, if one computes the fluid; the cells they cover are then found only for output.
    images: Option<Images>,
    /// The cells of the present bodies are found.
    found: bool,
}

/// Surfaces of the parts of a body, each moved in by a distance (cells).
type Felt = Vec<(Arc<dyn Shape>, f64)>;

/// Index of a particle that is not in a list.
const NONE: u32 = u32::MAX;

/// A partial sum on its way to the owner.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct Partial {
    id: u64,
    sum: ExchangeSum,
    /// Mean load of the past, from the rank that owned the particle in the last sweep.
    mean: [[f64; 3]; 2],
}

impl Coupling {
    /// Bytes of the partial sum of a particle that reaches into another block.
    pub const PARTIAL: usize = size_of::<Partial>();

    /// For the block of `rank`; `max_circumradius` (m) of all particles limits which particles can touch.
    pub fn new(
        params: CouplingParams,
        decomposition: &Decomposition,
        rank: usize,
        max_circumradius: f64,
    ) -> Self {
        assert!(params.simd.is_available(), "{:?} on a processor that has it", params.simd);
        let reach = max_circumradius + 2.0 * params.units.dx;
        Self {
            params,
            decomposition: decomposition.clone(),
            block: decomposition.block(rank),
            peers: decomposition.neighbours(rank, reach),
            bodies: Vec::new(),
            segments: RowSegments::default(),
            spheres: KeptSpheres::default(),
            polyhedra: KeptPolyhedra::default(),
            parts: Vec::new(),
            surfaces: Vec::new(),
            felt: Vec::new(),
            swept_bodies: Vec::new(),
            swept_segments: RowSegments::default(),
            swept_count: CoverCount::default(),
            swept_particles: Vec::new(),
            swept_owned: 0,
            swept_loads: Vec::new(),
            removed: Vec::new(),
            virtual_masses: Vec::new(),
            applied: Vec::new(),
            swept_means: Vec::new(),
            cover: Cover::default(),
            images: None,
            found: false,
        }
    }

    /// Tells the constant loads that the bodies of each template get besides that of the fluid.
    pub fn set_applied(&mut self, of_templates: Vec<Load>) {
        self.applied = of_templates;
    }

    /// Gives the bodies of each template a virtual mass, or none.
    pub fn set_virtual_masses(&mut self, of_templates: Vec<Option<VirtualMass>>) {
        let any = of_templates.iter().any(Option::is_some);
        self.virtual_masses = if any { of_templates } else { Vec::new() };
    }

    /// Finds the cells of the block that every particle covers, with all its periodic images.
    pub fn map(&mut self, particles: &ParticleStore) {
        let params = &self.params;
        let dx = params.units.dx;
        if self.felt.len() != particles.templates.len() {
            let felt = |part: &Arc<dyn Shape>| with_method!(params.method, method => method.felt(part, dx));
            let all = |t: &Template| t.parts().map(|(part, _)| felt(part)).collect();
            self.felt = particles.templates.iter().map(all).collect();
        }
        self.bodies.clear();
        self.parts.clear();
        self.surfaces.clear();
        let keeps_cover = with_method!(params.method, method => method.keeps_cover());
        let sphere = |(template, felt): (&Template, &Felt)| match (template.parts().next(), &felt[..]) {
            (Some((_, None)), [(shape, shift)]) if !keeps_cover => {
                let surface = |radius| LatticeSphere { radius: radius * (1.0 / dx), shift: *shift };
                shape.as_sphere().map(surface)
            }
            _ => None,
        };
        let spheres: Vec<_> = particles.templates.iter().zip(&self.felt).map(sphere).collect();
        for (i, particle) in particles.particles.iter().enumerate() {
            let (template, mut body) = (particles.template(particle), lattice_body(particle, &params.units));
            if i < particles.owned {
                body.departed = with_method!(params.method, method => {
                    method.momentum_inside(particle, &*template.shape, &body.motion, dx)
                });
            }
            let felt = &self.felt[particle.template as usize];
            if let Some(sphere) = spheres[particle.template as usize] {
                self.surfaces.push((i as u32, sphere));
                self.bodies.push(body);
                continue;
            }
            for (n, ((_, part), (shape, shift))) in template.parts().zip(felt).enumerate() {
                let (mut turn, mut motion) = (particle.orientation(), body.motion);
                if let Some(part) = part {
                    // The fluid gets the velocities of the body, so of this motion only the centre counts.
                    let arm = turn * part.position / dx;
                    motion.centre = std::array::from_fn(|a| motion.centre[a] + arm[a]);
                    turn *= part.orientation;
                }
                let mut mapper = Mapper::new(shape, turn, motion, params, *shift);
                if !template.shape.shared_with(n).is_empty() {
                    mapper.of = Some((template.shape.clone(), n));
                }
                self.parts.push((i as u32, mapper));
            }
            self.bodies.push(body);
        }
        self.found = false;
        if let Some(mut images) = self.images.take() {
            self.find_images(&mut images);
            self.images = Some(images);
            return;
        }
        self.find_cells();
    }

    /// Begins the momentum exchange of a step, before the sweep: what left in the last sweep, corrected for the cells
    /// that were covered only then or only now.
    fn begin_exchange<S: Population>(&mut self, fluid: &mut Fluid<S>) {
        // Where each particle of one list is in the other: mostly at the same place.
        let mut before: Vec<(u64, u32)> = Vec::new();
        let mut old_of = vec![NONE; self.bodies.len()];
        let mut new_of = vec![NONE; self.swept_bodies.len()];
        let domain = &self.decomposition.domain;
        for (new, body) in self.bodies.iter_mut().enumerate() {
            body.exchange = body.departed;
            let old = match self.swept_bodies.get(new) {
                Some(old) if old.id == body.id => Some(new as u32),
                _ => {
                    if before.is_empty() {
                        before = (0..).zip(&self.swept_bodies).map(|(i, b)| (b.id, i)).collect();
                        before.sort_unstable();
                    }
                    before.binary_search_by_key(&body.id, |&(id, _)| id).ok().map(|at| before[at].1)
                }
            };
            if let Some(old) = old {
                (old_of[new], new_of[old as usize]) = (old, new as u32);
                let old = &self.swept_bodies[old as usize];
                body.exchange.add(
                    &old.departed.shifted(shift_of_reference(old.reference, body.reference, domain)),
                    -1,
                );
            }
        }
        with_method!(self.params.method, method => {
            method.correct_cover(self, &mut |cells| fluid.departed_from(cells), &old_of, &new_of);
        });
    }

    /// Force and torque of the fluid on every owned particle, after the sweep; `acceleration` (m/s^2) is that of the
    /// fluid in this sweep. Collective.
    ///
    /// ```text
    /// F = momentum exchange - rho V g + (mixture balance) rho V a
    /// ```
    ///
    /// The lattice holds no hydrostatic pressure, so the buoyancy is added here; so is the mean pressure gradient
    /// `-rho a` that drives the fluid, if it acts on the particles as well. On light bodies, `F` with a [`VirtualMass`].
    pub fn loads(&mut self, particles: &ParticleStore, acceleration: Vec3, comm: &Comm) -> Vec<Load> {
        assert_eq!(particles.particles.len(), self.bodies.len(), "the particles that were mapped");
        let mut means = self.known_means(particles);
        self.collect(particles, &mut means, comm);
        let units = &self.params.units;
        let loads = particles.owned().iter().zip(&self.bodies).map(|(particle, body)| {
            let force = Vec3::from(body.exchange.force.map(from_fixed));
            let moment = Vec3::from(body.exchange.moment.map(from_fixed));
            let torque = moment - Vec3::from(body.motion.centre).cross(&force);
            let displaced = units.density * particles.template(particle).shape.volume();
            let gradient = match self.params.force_balance {
                ForceBalance::Mixture => acceleration,
                ForceBalance::FluidOnly => Vec3::zeros(),
            };
            Load {
                force: force * units.force() + displaced * (gradient - self.params.gravity),
                torque: torque * units.torque(),
            }
        });
        let mut loads: Vec<Load> = loads.collect();
        for ((load, mean), particle) in loads.iter_mut().zip(&mut means).zip(particles.owned()) {
            if let Some(virtual_mass) = &self.virtual_masses[particle.template as usize] {
                let mut weight = self.applied.get(particle.template as usize).copied().unwrap_or_default();
                weight.force += self.params.gravity * particles.template(particle).mass();
                *load = virtual_mass.apply(*load, weight, mean);
            }
        }
        means.truncate(particles.owned);
        self.note_swept(particles);
        self.swept_means = means;
        self.swept_loads.clone_from(&loads);
        loads
    }

    /// Mean loads of the past of those particles that were owned here in the last sweep, zeros of all others; none without
    /// virtual masses.
    fn known_means(&self, particles: &ParticleStore) -> Vec<Load> {
        if self.virtual_masses.is_empty() {
            return Vec::new();
        }
        let mut means = vec![Load::default(); particles.particles.len()];
        let mut at: Vec<(u64, usize)> = (0..).zip(&particles.particles).map(|(i, p)| (p.id, i)).collect();
        at.sort_unstable();
        for (particle, mean) in self.swept_particles.iter().zip(&self.swept_means) {
            if let Ok(found) = at.binary_search_by_key(&particle.id, |&(id, _)| id) {
                means[at[found].1] = *mean;
            }
        }
        means
    }

    /// Makes the mapped particles the state of the last sweep.
    fn note_swept(&mut self, particles: &ParticleStore) {
        std::mem::swap(&mut self.bodies, &mut self.swept_bodies);
        if with_method!(self.params.method, method => method.keeps_cover()) {
            std::mem::swap(&mut self.segments, &mut self.swept_segments);
        }
        self.swept_particles.clear();
        self.swept_particles.extend_from_slice(&particles.particles);
        self.swept_owned = particles.owned;
        self.removed.clear();
    }

    /// Cells of the block that were covered in the last step.
    pub fn cover_count(&self) -> CoverCount {
        self.swept_count
    }

    /// Sends the partial sums of ghosts to their owners and adds those that come in; integers, so in any order. The mean
    /// load of a particle comes from one rank at most.
    fn collect(&mut self, particles: &ParticleStore, means: &mut [Load], comm: &Comm) {
        if comm.size() == 1 {
            return;
        }
        let mut messages: Vec<Vec<u8>> = vec![Vec::new(); self.peers.len()];
        for i in particles.owned..particles.particles.len() {
            let Body { id, exchange: sum, .. } = self.bodies[i];
            let mean = means.get(i).copied().unwrap_or_default();
            if sum == ExchangeSum::default() && mean == Load::default() {
                continue;
            }
            let owner = particles.owners[i] as usize;
            let link = self
                .peers
                .binary_search(&owner)
                .expect("the owner of a particle that reaches here is a peer");
            let mean = [mean.force.into(), mean.torque.into()];
            messages[link].extend_from_slice(bytemuck::bytes_of(&Partial { id, sum, mean }));
        }
        for message in comm.exchange(&self.peers, messages) {
            for partial in bytemuck::pod_collect_to_vec::<u8, Partial>(&message) {
                let i =
                    particles.owned().binary_search_by_key(&partial.id, |p| p.id).expect("sent to the owner");
                self.bodies[i].exchange.add(&partial.sum, 1);
                if let Some(mean) = means.get_mut(i) {
                    let [force, torque] = partial.mean.map(Vec3::from);
                    *mean += Load { force, torque };
                }
            }
        }
    }
}

/// A particle in lattice units, relative to its reference cell; cell `n` has its centre at `(n + 1/2) dx`.
fn lattice_body(particle: &Particle, units: &Units) -> Body {
    let Units { dx, dt, .. } = *units;
    let position = particle.position.map(|x| x / dx - 0.5);
    let reference = position.map(f64::round_ties_even);
    Body {
        id: particle.id,
        reference: reference.map(|n| n as i64),
        motion: RigidMotion {
            velocity: particle.velocity.map(|v| v * (dt / dx)),
            angular: particle.angular_velocity.map(|w| w * dt),
            centre: std::array::from_fn(|a| position[a] - reference[a]),
        },
        exchange: ExchangeSum::default(),
        departed: ExchangeSum::default(),
    }
}

/// Shift of offsets when they are counted from the reference cell of `new` instead of that of `old`, across the
/// periodic faces.
fn shift_of_reference(old: [i64; 3], new: [i64; 3], domain: &Domain) -> [i64; 3] {
    std::array::from_fn(|a| {
        let (shift, cells) = (old[a] - new[a], domain.cells[a] as i64);
        if domain.is_periodic(a) {
            shift - cells * (shift as f64 / cells as f64).round_ties_even() as i64
        } else {
            shift
        }
    })
}

#[cfg(test)]
mod contact_tests;
#[cfg(test)]
mod device_tests;
#[cfg(test)]
mod image_tests;
#[cfg(test)]
mod overlap_tests;
#[cfg(test)]
mod population_tests;
#[cfg(test)]
mod shape_tests;
#[cfg(test)]
mod stresslet_tests;
#[cfg(test)]
pub(crate) mod tests;
#[cfg(test)]
mod wall_tests;
