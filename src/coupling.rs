//! Fluid and particles meet here, and only here: the border between SI units and lattice units at run time.
//!
//! - [`map`](Coupling::map): particles -> solid fractions and velocities of the cells they cover ([`solid_fraction`]);
//! - [`loads`](Coupling::loads): momentum exchange over the covered cells -> force and torque on each particle;
//! - [`Driving`]: the acceleration of the fluid that balances the weight of the particles and removes the net flux.
//!
//! Everything a cell contributes is computed from its integer offset to the particle's reference cell, so it is the same
//! on every rank, for every periodic image, and for a particle moved by whole cells.

mod driving;
pub mod solid_fraction;

use crate::comm::Comm;
use crate::dem::Load;
use crate::domain::{Block, Decomposition};
use crate::fluid::{CHUNK, ExchangeSum, Fluid, Real, RigidMotion, SolidRow};
use crate::math::{Vec3, from_fixed};
use crate::particle::{Particle, ParticleStore};
use crate::units::Units;
pub use driving::{CONTROL_INTERVAL, Driving, DrivingParams, ForceBalance, MeanFlow};
use solid_fraction::Mapper;

/// Parameters of the coupling.
#[derive(Clone, Copy, Debug)]
pub struct CouplingParams {
    /// Cell size, time step, density of the fluid.
    pub units: Units,
    /// Width of the cosine ramp of the solid fraction (cells).
    pub solid_ramp_width: f64,
    /// Gravity (m/s^2), for the buoyancy.
    pub gravity: Vec3,
    /// Whether the mean pressure gradient acts on the particles, too.
    pub force_balance: ForceBalance,
}

/// Moves particle data between the engine and one block of fluid.
pub struct Coupling {
    params: CouplingParams,
    decomposition: Decomposition,
    block: Block,
    /// Ranks that may know a particle that touches this block.
    peers: Vec<usize>,
    rows: Vec<SolidRow>,
    motions: Vec<RigidMotion>,
    sums: Vec<ExchangeSum>,
}

/// A partial sum on its way to the owner.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct Partial {
    id: u64,
    sum: ExchangeSum,
}

impl Coupling {
    /// For the block of `rank`; `max_circumradius` (m) of all particles bounds who can touch whom.
    pub fn new(
        params: CouplingParams,
        decomposition: &Decomposition,
        rank: usize,
        max_circumradius: f64,
    ) -> Self {
        let reach = max_circumradius + 2.0 * params.units.dx;
        Self {
            params,
            decomposition: decomposition.clone(),
            block: decomposition.block(rank),
            peers: decomposition.neighbours(rank, reach),
            rows: Vec::new(),
            motions: Vec::new(),
            sums: Vec::new(),
        }
    }

    /// Rows of cells covered by the particles at the last [`map`](Self::map).
    pub fn rows(&self) -> &[SolidRow] {
        &self.rows
    }

    /// Writes the solid fraction and velocity of every particle (all its periodic images) to the cells of the block.
    pub fn map<T: Real>(&mut self, particles: &ParticleStore, fluid: &mut Fluid<T>) {
        let solid = fluid.solid_mut();
        solid.clear();
        self.rows.clear();
        self.motions.clear();
        self.motions
            .resize(particles.particles.len(), RigidMotion::default());
        // Ascending ids, so that cells shared by several particles combine in the same order on every rank.
        let mut order: Vec<u32> = (0..particles.particles.len() as u32).collect();
        order.sort_unstable_by_key(|&i| particles.particles[i as usize].id);
        for body in order {
            let particle = &particles.particles[body as usize];
            let (reference, motion) = self.lattice_motion(particle);
            self.motions[body as usize] = motion;
            let shape = &*particles.template(particle).shape;
            let mapper = Mapper::new(
                shape,
                particle,
                motion,
                self.params.units.dx,
                self.params.solid_ramp_width,
            );
            mapper.each_image(
                &self.decomposition.domain,
                self.block,
                reference,
                |offsets, base| {
                    for nz in offsets[2].clone() {
                        for ny in offsets[1].clone() {
                            let Some(covered) = mapper.row(&offsets[0], ny, nz) else {
                                continue;
                            };
                            let [y, z] = [ny + base[1], nz + base[2]].map(|c| c as usize);
                            let (first, last) = (*covered.all.start(), *covered.all.end());
                            let [x, end] = [first + base[0], last + base[0]].map(|c| c as usize);
                            for chunk in x / CHUNK..=end / CHUNK {
                                let (fraction, velocity) =
                                    mapper.chunk::<T>(&covered, (chunk * CHUNK) as i64 - base[0]);
                                solid.add(y, z, chunk, &fraction, &velocity);
                            }
                            self.rows.push(SolidRow {
                                body,
                                cell: [x, y, z].map(|c| c as u32),
                                count: (last - first + 1) as u32,
                                offset: [first, ny, nz].map(|n| n as i32),
                            });
                        }
                    }
                },
            );
        }
    }

    /// Reference cell of a particle, and its motion in lattice units relative to that cell.
    ///
    /// Cell `n` has its centre at `(n + 1/2) dx`.
    fn lattice_motion(&self, particle: &Particle) -> ([i64; 3], RigidMotion) {
        let Units { dx, dt, .. } = self.params.units;
        let place = particle.position.map(|x| x / dx - 0.5);
        let reference = place.map(|s| s.round_ties_even());
        let motion = RigidMotion {
            velocity: particle.velocity.map(|v| v * (dt / dx)),
            angular: particle.angular_velocity.map(|w| w * dt),
            centre: std::array::from_fn(|a| place[a] - reference[a]),
        };
        (reference.map(|n| n as i64), motion)
    }

    /// Force and torque of the fluid on every owned particle, after the sweep that followed [`map`](Self::map) of the
    /// same particles; `acceleration` (m/s^2) is that of the fluid in this sweep. Collective.
    ///
    /// ```text
    /// F = momentum exchange - rho V g + (mixture balance) rho V a
    /// ```
    ///
    /// The lattice holds no hydrostatic pressure, so the buoyancy is added here; so is the mean pressure gradient
    /// `-rho a` that drives the fluid, if it acts on the particles as well.
    pub fn loads<T: Real>(
        &mut self,
        particles: &ParticleStore,
        fluid: &Fluid<T>,
        acceleration: Vec3,
        comm: &Comm,
    ) -> Vec<Load> {
        self.sums.clear();
        self.sums
            .resize(particles.particles.len(), ExchangeSum::default());
        fluid.momentum_exchange(&self.rows, &self.motions, &mut self.sums);
        self.collect(particles, comm);
        let units = &self.params.units;
        particles
            .owned()
            .iter()
            .enumerate()
            .map(|(i, particle)| {
                let force = Vec3::from(self.sums[i].force.map(from_fixed));
                let moment = Vec3::from(self.sums[i].moment.map(from_fixed));
                let torque = moment - Vec3::from(self.motions[i].centre).cross(&force);
                let displaced = units.density * particles.template(particle).shape.volume();
                let gradient = match self.params.force_balance {
                    ForceBalance::Mixture => acceleration,
                    ForceBalance::FluidOnly => Vec3::zeros(),
                };
                Load {
                    force: force * units.force() + displaced * (gradient - self.params.gravity),
                    torque: torque * units.torque(),
                }
            })
            .collect()
    }

    /// Sends the partial sums of ghosts to their owners and adds those that come in; integers, so in any order.
    fn collect(&mut self, particles: &ParticleStore, comm: &Comm) {
        if comm.size() == 1 {
            return;
        }
        let mut messages: Vec<Vec<u8>> = vec![Vec::new(); self.peers.len()];
        for i in particles.owned..particles.particles.len() {
            if self.sums[i] == ExchangeSum::default() {
                continue;
            }
            let owner = particles.owners[i] as usize;
            let link = self
                .peers
                .binary_search(&owner)
                .expect("the owner of a particle that reaches here is a peer");
            let partial = Partial {
                id: particles.particles[i].id,
                sum: self.sums[i],
            };
            messages[link].extend_from_slice(bytemuck::bytes_of(&partial));
        }
        for message in comm.exchange(&self.peers, messages) {
            for partial in bytemuck::pod_collect_to_vec::<u8, Partial>(&message) {
                let i = particles
                    .owned()
                    .binary_search_by_key(&partial.id, |p| p.id)
                    .expect("sent to the owner");
                for a in 0..3 {
                    self.sums[i].force[a] = self.sums[i].force[a].wrapping_add(partial.sum.force[a]);
                    self.sums[i].moment[a] = self.sums[i].moment[a].wrapping_add(partial.sum.moment[a]);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests;
