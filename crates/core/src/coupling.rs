//! Coupling of fluid and particles: the only place where SI units meet lattice units at run time.
//!
//! - [`map`](Coupling::map): particles -> the cells they cover, whose solid fractions and velocities the sweep requests row
//!   by row ([`solids`](Coupling::solids));
//! - [`loads`](Coupling::loads): momentum exchange over the covered cells -> force and torque on each particle;
//! - [`Stresslet`]: first moments of that momentum -> stress of the particles;
//! - [`LatticeWalls`]: walls -> cells and motions that the fluid bounces back from;
//! - [`Driving`]: the acceleration of the fluid that balances the weight of the particles and removes the net flux.
//!
//! Everything a cell contributes is computed from its integer offset to the particle's reference cell, so it is the
//! same on every rank, for every periodic image, and for a particle moved by whole cells.

mod any_fluid;
mod driving;
mod faces;
mod lines;
mod momentum_exchange;
mod saved;
mod solid_fraction;
mod stresslet;
mod surface;
mod volume_fraction;
mod walls;

use crate::comm::Comm;
use crate::dem::Load;
use crate::domain::{Block, Decomposition, Domain};
use crate::fluid::{CHUNK, Fluid, Real, SolidCollision, SolidRow, Solids};
use crate::math::{Vec3, from_fixed, to_fixed_wide};
use crate::particle::{Particle, ParticleStore, Template};
use crate::shape::Shape;
use crate::units::Units;
pub use any_fluid::AnyFluid;
pub use driving::{CONTROL_INTERVAL, ControlRecord, Driving, DrivingParams, ForceBalance, MeanFlow};
use faces::FacePlane;
use lines::{Lines, Segment, each_cell_outside};
use momentum_exchange::{ExchangeSum, add_segment, add_shares};
pub use solid_fraction::Fraction;
use solid_fraction::{Mapper, RigidMotion, shift_of};
pub use stresslet::Stresslet;
pub use walls::{LatticeWalls, check_motion};

/// Parameters of the coupling.
#[derive(Clone, Copy, Debug)]
pub struct CouplingParams {
    /// Cell size, time step, density of the fluid.
    pub units: Units,
    /// Collision of cells that particles cover, as in the parameters of the fluid.
    pub solids: SolidCollision,
    /// Solid fraction of a cell; its volume fraction where cells are partially saturated.
    pub fraction: Fraction,
    /// Gravity (m/s^2), for the buoyancy.
    pub gravity: Vec3,
    /// Bodies on which the mean pressure gradient acts.
    pub force_balance: ForceBalance,
}

/// Moves particle data between the engine and one block of fluid.
pub struct Coupling {
    params: CouplingParams,
    decomposition: Decomposition,
    block: Block,
    /// Ranks that may have a particle that touches this block.
    peers: Vec<usize>,
    /// The particles of the last [`map`](Self::map), in their order, and the cells they cover.
    bodies: Vec<Body>,
    lines: Lines,
    /// Faces of the flat-faced ones, and where those of each begin; one past the last.
    planes: Vec<FacePlane>,
    first_plane: Vec<u32>,
    /// Distance by which the surface of each template is moved in where it counts as a plane (cells); none for other
    /// fractions.
    shifts: Vec<f64>,
    /// The same at the last sweep.
    swept_bodies: Vec<Body>,
    swept_lines: Lines,
    swept_particles: Vec<Particle>,
    /// Number of those that were owned here.
    swept_owned: usize,
    /// Of the owned ones of them.
    swept_loads: Vec<Load>,
    /// True if the momentum inside the particles a step before is available: there was a sweep, or all was at rest.
    begun: bool,
    /// Scratch of [`map`](Self::map).
    added: Vec<(u32, Segment)>,
}

/// A particle on the lattice.
#[derive(Clone, Copy, Debug)]
struct Body {
    id: u64,
    /// The cell that offsets count from.
    reference: [i64; 3],
    motion: RigidMotion,
    /// Momentum exchange of this step: came in now, less what left in the step before.
    exchange: ExchangeSum,
    /// Momentum that left in this step's sweep; for partially saturated cells the momentum inside the particle.
    departed: ExchangeSum,
    /// Momentum of fluid that fills the particle and moves with it; of owned ones, and none where it does not matter.
    rigid: ExchangeSum,
}

/// Index of a particle that is not in a list.
const NOWHERE: u32 = u32::MAX;

/// A partial sum on its way to the owner.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct Partial {
    id: u64,
    sum: ExchangeSum,
}

impl Coupling {
    /// For the block of `rank`; `max_circumradius` (m) of all particles limits which particles can touch.
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
            bodies: Vec::new(),
            lines: Lines::default(),
            planes: Vec::new(),
            first_plane: Vec::new(),
            shifts: Vec::new(),
            swept_bodies: Vec::new(),
            swept_lines: Lines::default(),
            swept_particles: Vec::new(),
            swept_owned: 0,
            swept_loads: Vec::new(),
            begun: false,
            added: Vec::new(),
        }
    }

    /// For a fluid that is at rest before the first step, within the particles as well: one that moves already is not
    /// charged with the momentum of the fluid that its cells hold from then on.
    #[must_use]
    pub fn in_fluid_at_rest(mut self) -> Self {
        self.begun = true;
        self
    }

    /// Finds the cells of the block that every particle covers, with all its periodic images.
    pub fn map(&mut self, particles: &ParticleStore) {
        let [_, ny, nz] = self.block.size();
        self.bodies.clear();
        self.bodies
            .extend(particles.particles.iter().map(|particle| lattice_body(particle, &self.params.units)));
        if self.params.solids.is_saturated() {
            for (particle, body) in particles.owned().iter().zip(&mut self.bodies) {
                let shape = &*particles.template(particle).shape;
                body.rigid = rigid_momentum(particle, shape, &body.motion, self.params.units.dx);
            }
        }
        if let Fraction::Volume(out) = self.params.fraction
            && self.shifts.len() != particles.templates.len()
        {
            let dx = self.params.units.dx;
            let shift = |template: &Template| shift_of(&*template.shape, dx, out);
            self.shifts = particles.templates.iter().map(shift).collect();
        }
        self.planes.clear();
        self.first_plane.clear();
        for particle in &particles.particles {
            self.first_plane.push(self.planes.len() as u32);
            let to_world = particle.orientation().to_rotation_matrix().into_inner();
            let shape = &*particles.template(particle).shape;
            let shift = shift_in(&self.shifts, particle);
            FacePlane::collect(shape, &to_world, self.params.units.dx, shift, &mut self.planes);
        }
        self.first_plane.push(self.planes.len() as u32);
        // Ascending ids, so that cells shared by several particles combine in the same order on every rank.
        let mut order: Vec<u32> = (0..self.bodies.len() as u32).collect();
        order.sort_unstable_by_key(|&i| self.bodies[i as usize].id);
        let mut added = std::mem::take(&mut self.added);
        added.clear();
        for i in order {
            let body = &self.bodies[i as usize];
            let mapper = self.mapper(particles, i as usize);
            mapper.each_image(&self.decomposition.domain, self.block, body.reference, |offsets, base| {
                for z in offsets[2].clone() {
                    for y in offsets[1].clone() {
                        let Some((all, full)) = mapper.row(&offsets[0], y, z) else {
                            continue;
                        };
                        let line = (y + base[1]) + ny as i64 * (z + base[2]);
                        let segment = Segment {
                            body: i,
                            x: (all[0] + base[0]) as u32,
                            count: (all[1] - all[0] + 1) as u32,
                            offset: [all[0], y, z].map(|n| n as i32),
                            full: full.map(|n| n as i32),
                        };
                        added.push((line as u32, segment));
                    }
                }
            });
        }
        self.lines.sort(ny * nz, &added);
        self.added = added;
    }

    /// The geometry of particle `i` of the last [`map`](Self::map).
    fn mapper<'a>(&'a self, particles: &'a ParticleStore, i: usize) -> Mapper<'a> {
        let faces = self.first_plane[i] as usize..self.first_plane[i + 1] as usize;
        mapper(
            &self.params,
            &particles.particles[i],
            particles,
            self.bodies[i].motion,
            &self.planes[faces],
            &self.shifts,
        )
    }

    /// The mapped particles as the sweep sees them; `particles` as at [`map`](Self::map).
    pub fn solids<'a, T>(&'a mut self, particles: &'a ParticleStore) -> MappedSolids<'a, T> {
        let (planes, first, shifts) = (&self.planes, &self.first_plane, &self.shifts);
        let mappers = (particles.particles.iter().zip(&self.bodies).enumerate())
            .map(|(i, (particle, body))| {
                let faces = &planes[first[i] as usize..first[i + 1] as usize];
                mapper(&self.params, particle, particles, body.motion, faces, shifts)
            })
            .collect();
        MappedSolids {
            rows: self.block.size()[1],
            mappers,
            lines: &self.lines,
            bodies: &mut self.bodies,
            shares: self.params.solids.is_saturated().then(Vec::new),
        }
    }

    /// Begins the momentum exchange of a step, before the sweep: what left in the last sweep, corrected for the cells
    /// that were covered only then or only now.
    pub fn begin_exchange<T: Real>(&mut self, fluid: &Fluid<T>) {
        let [_, ny, nz] = self.block.size();
        // Where each particle of one list is in the other.
        let mut before: Vec<(u64, u32)> = (0..).zip(&self.swept_bodies).map(|(i, b)| (b.id, i)).collect();
        before.sort_unstable();
        let mut old_of = vec![NOWHERE; self.bodies.len()];
        let mut new_of = vec![NOWHERE; self.swept_bodies.len()];
        let domain = &self.decomposition.domain;
        for (new, body) in self.bodies.iter_mut().enumerate() {
            (body.exchange, body.departed) = (body.rigid, body.rigid);
            if let Ok(at) = before.binary_search_by_key(&body.id, |&(id, _)| id) {
                let old = before[at].1;
                (old_of[new], new_of[old as usize]) = (old, new as u32);
                let old = &self.swept_bodies[old as usize];
                body.exchange.add(&old.departed.shifted(shift_of_reference(old, body, domain)), -1);
            }
        }
        // Partially saturated cells need no neighbours.
        let lines = if self.params.solids.is_saturated() { 0 } else { ny * nz };
        for line in 0..lines {
            let (new, old) = (self.lines.line(line), self.swept_lines.line(line));
            let cell = |x: u32| [x as usize, line % ny, line / ny];
            for segment in new {
                let was = old_of[segment.body as usize];
                each_cell_outside(segment, &old.iter().filter(|s| s.body == was), |x| {
                    let body = &mut self.bodies[segment.body as usize];
                    let n = offset_of(segment, x);
                    let departed = ExchangeSum::of_cell(fluid.departed(cell(x)), body.motion.at(n), n);
                    body.exchange.add(&departed, -1);
                });
            }
            for segment in old {
                let is = new_of[segment.body as usize];
                // A particle that this rank no longer has covers no cell of it, nor did it a step ago.
                if is == NOWHERE {
                    continue;
                }
                each_cell_outside(segment, &new.iter().filter(|s| s.body == is), |x| {
                    let (old_body, body) =
                        (&self.swept_bodies[segment.body as usize], &mut self.bodies[is as usize]);
                    let n = offset_of(segment, x);
                    let departed = ExchangeSum::of_cell(fluid.departed(cell(x)), old_body.motion.at(n), n);
                    body.exchange.add(&departed.shifted(shift_of_reference(old_body, body, domain)), 1);
                });
            }
        }
    }

    /// Force and torque of the fluid on every owned particle, after the sweep; `acceleration` (m/s^2) is that of the
    /// fluid in this sweep. Collective.
    ///
    /// ```text
    /// F = momentum exchange - rho V g + (mixture balance) rho V a
    /// ```
    ///
    /// The lattice holds no hydrostatic pressure, so the buoyancy is added here; so is the mean pressure gradient
    /// `-rho a` that drives the fluid, if it acts on the particles as well.
    pub fn loads(&mut self, particles: &ParticleStore, acceleration: Vec3, comm: &Comm) -> Vec<Load> {
        assert_eq!(particles.particles.len(), self.bodies.len(), "the particles that were mapped");
        if self.params.solids.is_saturated() && !self.begun {
            // There is no step before: the fluid inside the particles is taken to have been there.
            for body in &mut self.bodies {
                body.exchange.add(&body.departed, -1);
            }
        }
        self.collect(particles, comm);
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
        let loads: Vec<Load> = loads.collect();
        self.note_swept(particles);
        self.swept_loads.clone_from(&loads);
        loads
    }

    /// Makes the mapped particles the state of the last sweep.
    fn note_swept(&mut self, particles: &ParticleStore) {
        std::mem::swap(&mut self.bodies, &mut self.swept_bodies);
        std::mem::swap(&mut self.lines, &mut self.swept_lines);
        self.swept_particles.clear();
        self.swept_particles.extend_from_slice(&particles.particles);
        self.swept_owned = particles.owned;
        self.begun = true;
    }

    /// Cells of the block that were covered in the last step, once for each particle that covered them.
    pub fn covered_cells(&self) -> usize {
        self.swept_lines.cells()
    }

    /// Sends the partial sums of ghosts to their owners and adds those that come in; integers, so in any order.
    fn collect(&mut self, particles: &ParticleStore, comm: &Comm) {
        if comm.size() == 1 {
            return;
        }
        let mut messages: Vec<Vec<u8>> = vec![Vec::new(); self.peers.len()];
        for i in particles.owned..particles.particles.len() {
            let Body { id, exchange: sum, .. } = self.bodies[i];
            if sum == ExchangeSum::default() {
                continue;
            }
            let owner = particles.owners[i] as usize;
            let link = self
                .peers
                .binary_search(&owner)
                .expect("the owner of a particle that reaches here is a peer");
            messages[link].extend_from_slice(bytemuck::bytes_of(&Partial { id, sum }));
        }
        for message in comm.exchange(&self.peers, messages) {
            for partial in bytemuck::pod_collect_to_vec::<u8, Partial>(&message) {
                let i =
                    particles.owned().binary_search_by_key(&partial.id, |p| p.id).expect("sent to the owner");
                self.bodies[i].exchange.add(&partial.sum, 1);
            }
        }
    }
}

/// The geometry of a particle of `particles`.
fn mapper<'a>(
    params: &CouplingParams,
    particle: &Particle,
    particles: &'a ParticleStore,
    motion: RigidMotion,
    faces: &'a [FacePlane],
    shifts: &[f64],
) -> Mapper<'a> {
    let shape = &*particles.template(particle).shape;
    Mapper::new(shape, particle, motion, faces, params.units.dx, params.fraction, shift_in(shifts, particle))
}

/// Distance by which the surface of a particle is moved in (cells); 0 where there are no volume fractions.
fn shift_in(shifts: &[f64], particle: &Particle) -> f64 {
    shifts.get(particle.template as usize).copied().unwrap_or(0.0)
}

/// A particle in lattice units, relative to its reference cell; cell `n` has its centre at `(n + 1/2) dx`.
fn lattice_body(particle: &Particle, units: &Units) -> Body {
    let Units { dx, dt, .. } = *units;
    let place = particle.position.map(|x| x / dx - 0.5);
    let reference = place.map(f64::round_ties_even);
    Body {
        id: particle.id,
        reference: reference.map(|n| n as i64),
        motion: RigidMotion {
            velocity: particle.velocity.map(|v| v * (dt / dx)),
            angular: particle.angular_velocity.map(|w| w * dt),
            centre: std::array::from_fn(|a| place[a] - reference[a]),
        },
        exchange: ExchangeSum::default(),
        departed: ExchangeSum::default(),
        rigid: ExchangeSum::default(),
    }
}

/// Momentum and angular momentum about the reference cell of fluid that fills a body and moves with it, lattice units.
fn rigid_momentum(particle: &Particle, shape: &dyn Shape, motion: &RigidMotion, dx: f64) -> ExchangeSum {
    let volume = shape.volume() / (dx * dx * dx);
    let momentum = Vec3::from(motion.velocity) * volume;
    let turn = particle.orientation();
    let inertia = shape.inertia_per_mass() / (dx * dx) * volume;
    let spin = turn.inverse_transform_vector(&Vec3::from(motion.angular));
    let angular = turn.transform_vector(&inertia.component_mul(&spin));
    let moment = angular + Vec3::from(motion.centre).cross(&momentum);
    ExchangeSum { force: momentum.map(to_fixed_wide).into(), moment: moment.map(to_fixed_wide).into() }
}

/// Shift of offsets when they are counted from the reference cell of `new` instead of that of `old`, across the
/// periodic faces.
fn shift_of_reference(old: &Body, new: &Body, domain: &Domain) -> [i64; 3] {
    std::array::from_fn(|a| {
        let (shift, cells) = (old.reference[a] - new.reference[a], domain.cells[a] as i64);
        if domain.periodic[a] {
            shift - cells * (shift as f64 / cells as f64).round_ties_even() as i64
        } else {
            shift
        }
    })
}

/// Offset of cell `x` of a segment.
fn offset_of(segment: &Segment, x: u32) -> [i64; 3] {
    let [nx, ny, nz] = segment.offset.map(i64::from);
    [nx + i64::from(x - segment.x), ny, nz]
}

/// The mapped particles of a block, row by row.
pub struct MappedSolids<'a, T> {
    rows: usize,
    mappers: Vec<Mapper<'a>>,
    lines: &'a Lines,
    bodies: &'a mut [Body],
    /// For partially saturated cells and for measurements, the fractions of the row being swept, segment by segment.
    shares: Option<Vec<[T; CHUNK]>>,
}

impl<T: Real> Solids<T> for MappedSolids<'_, T> {
    #[inline(always)]
    fn fill(&mut self, y: usize, z: usize, row: &mut SolidRow<T>) {
        if let Some(shares) = &mut self.shares {
            shares.clear();
        }
        for segment in self.lines.line(z * self.rows + y) {
            self.mappers[segment.body as usize].fill(segment, row, self.shares.as_mut());
        }
    }

    #[inline(always)]
    fn collect(&mut self, y: usize, z: usize, row: &SolidRow<T>) {
        let segments = self.lines.line(z * self.rows + y);
        let Some(shares) = &self.shares else {
            for segment in segments {
                let Body { motion, exchange, departed, .. } = &mut self.bodies[segment.body as usize];
                add_segment(segment, motion, row, exchange, departed);
            }
            return;
        };
        let mut windows = shares.iter();
        for segment in segments {
            let Body { exchange, departed, .. } = &mut self.bodies[segment.body as usize];
            add_shares(segment, &mut windows, row, exchange, departed);
        }
    }
}

#[cfg(test)]
mod contact_tests;
#[cfg(test)]
mod shape_tests;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod wall_tests;
