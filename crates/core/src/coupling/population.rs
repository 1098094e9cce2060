//! Bodies at their beginning, and those that go: momentum of the fluid that the coupling keeps from one sweep to the next.

use super::method::{CouplingMethod, with_method};
use super::{AnyFluid, Coupling};
use crate::comm::Comm;
use crate::dem::Load;
use crate::fluid::{Body, Fluid, Population};
use crate::math::{Vec3, from_fixed_wide, join_wide, split_wide, to_fixed_wide};
use crate::particle::{Particle, ParticleStore};
use std::ops::Range;

/// Sums over the cells of a new body, weighted by their solid fraction: 1, the squared distance from the centre, the velocity of the
/// fluid, its moment about the centre; lattice units.
type Filling = [i128; 8];

impl Coupling {
    /// Begins with a fluid that moves, by the velocity (m/s) and half the vorticity (1/s) of `flow` at each body: its momentum is in the
    /// bodies before the first step. Methods that keep the cover find it in the cells.
    pub fn begin_moving(&mut self, particles: &ParticleStore, flow: impl Fn(&Particle) -> [Vec3; 2]) {
        if with_method!(self.params.method, method => method.keeps_cover()) {
            return;
        }
        let mut carried = particles.clone();
        for particle in &mut carried.particles {
            let [velocity, angular_velocity] = flow(particle);
            (particle.velocity, particle.angular_velocity) = (velocity.into(), angular_velocity.into());
        }
        self.map(&carried);
        self.note_swept(&carried);
    }

    /// Begins bodies with these ids that were inserted since the last sweep, with the momentum of the fluid in them, as it moves and turns
    /// there in the mean, so that they displace it without a jolt. Methods that keep the cover find it in the cells. Collective.
    pub fn begin_inserted(
        &mut self,
        fluid: &AnyFluid,
        particles: &ParticleStore,
        ids: Range<u64>,
        comm: &Comm,
    ) {
        if with_method!(self.params.method, method => method.keeps_cover()) {
            return;
        }
        self.map(particles);
        let mut fillings = vec![Filling::default(); (ids.end - ids.start) as usize];
        fluid.fill_inserted(self, &ids, &mut fillings);
        let mut words: Vec<i64> = fillings.iter().flatten().flat_map(|sum| split_wide(*sum)).collect();
        comm.sum(&mut words);
        let units = self.params.units;
        let mut carried = particles.clone();
        for particle in carried.particles.iter_mut().filter(|particle| ids.contains(&particle.id)) {
            let words = &words[16 * (particle.id - ids.start) as usize..];
            let sum = |n: usize| from_fixed_wide(join_wide([words[2 * n], words[2 * n + 1]]));
            let over = |first: usize, weight: f64| {
                if weight > 0.0 { Vec3::from_fn(|axis, _| sum(first + axis) / weight) } else { Vec3::zeros() }
            };
            particle.velocity = (over(2, sum(0)) * units.velocity()).into();
            // Of a sphere: the moment of a rotation is two thirds of the squared distances.
            particle.angular_velocity = (over(5, sum(1)) * (1.5 / units.dt)).into();
        }
        self.map(&carried);
        for (i, particle) in carried.particles.iter().enumerate().filter(|(_, p)| ids.contains(&p.id)) {
            let is_owned = i < carried.owned;
            let at = if is_owned { self.swept_owned } else { self.swept_bodies.len() };
            self.swept_bodies.insert(at, self.bodies[i]);
            self.swept_particles.insert(at, *particle);
            if is_owned {
                let light = !self.virtual_masses.is_empty();
                for (list, has) in [(&mut self.swept_loads, true), (&mut self.swept_means, light)] {
                    if has && list.len() == at {
                        list.push(Load::default());
                    }
                }
                self.swept_owned += 1;
            }
        }
    }

    /// Adds what fills inserted bodies in the block.
    pub(super) fn fill<S: Population>(
        &mut self,
        fluid: &Fluid<S>,
        ids: &Range<u64>,
        fillings: &mut [Filling],
    ) {
        self.find_cells();
        let visit = |body: &Body, n: [i64; 3], part: f64, u: [f64; 3]| {
            if ids.contains(&body.id) {
                let from_centre = Vec3::from_fn(|axis, _| n[axis] as f64 - body.motion.centre[axis]);
                let u = Vec3::from(u);
                let moment = from_centre.cross(&u);
                let values = [1.0, from_centre.norm_squared(), u.x, u.y, u.z, moment.x, moment.y, moment.z];
                for (sum, value) in fillings[(body.id - ids.start) as usize].iter_mut().zip(values) {
                    *sum += i128::from(to_fixed_wide(part * value));
                }
            }
        };
        with_method!(self.params.method, method => fluid.each_covered(&self.solids(method), visit));
    }

    /// Forgets the particles with these ids, which have been removed, and with them the momentum of the fluid in them.
    pub fn remove(&mut self, ids: &[u64]) {
        self.removed.extend(ids);
        self.removed.sort_unstable();
    }

    /// The particles that this rank owned in the last sweep, as they were then, and force and torque of the fluid on them; without those
    /// that have been removed.
    pub fn last_loads(&self) -> impl Iterator<Item = (&Particle, Load)> {
        let all = self.swept_particles.iter().zip(self.swept_loads.iter().copied());
        all.filter(|(particle, _)| self.removed.binary_search(&particle.id).is_err())
    }
}
