//! Particle stresslet: first moments of the momentum that the fluid gives to the particles, for the stress of a
//! suspension.
//!
//! ```text
//! S = sum over cells of (r g + g r) / 2 - tau Q,     r from the centre of the particle
//! tau Q = b Pi_neq    sc1 and sc3: what is reflected does not relax, so the solid itself carries stress
//! tau Q = 0           sc2 and exact difference, except for terms of second order in u
//! stress on plates = mu rate + (S_xz + contacts) / V - <rho u_x u_z>      exact in steady shear, both couplings, any grid
//! ```
//!
//! `g` is the momentum that the solid of a cell takes in a step: `(1 - B) rho (u - u_s)`, in partially saturated
//! cells `-b sum c W_solid`. All is a function of the state between two steps, so it costs nothing where it is not
//! requested. Derivation: `docs/theory/coupling.md`.
//!
//! Reference: Batchelor (1970), doi:10.1017/S0022112070000745.

use super::momentum_exchange::masked;
use super::{Coupling, MappedSolids};
use crate::fluid::{CHUNK, Number, Real, SolidRow, Solids};
use crate::math::sum_fixed;
use crate::particle::ParticleStore;

/// The mapped particles for a measurement between two steps.
pub struct Stresslet<'a, T> {
    mapped: MappedSolids<'a, T>,
    sums: [i128; 6],
}

impl Coupling {
    /// The particles of the last [`map`](Self::map) as [`Fluid::measure`](crate::fluid::Fluid::measure) sees them.
    pub fn stresslet<'a, T>(&'a mut self, particles: &'a ParticleStore) -> Stresslet<'a, T> {
        let mut mapped = self.solids(particles);
        mapped.shares.get_or_insert_default();
        Stresslet { mapped, sums: [0; 6] }
    }
}

impl<T> Stresslet<'_, T> {
    /// `xx`, `yy`, `zz`, `xy`, `xz` and `yz` of the moments of `g` over the cells of the block, all particles
    /// together: exact sums of fixed-point numbers in lattice units. `tau Q` is the other part of what the fluid
    /// measures.
    pub fn sums(&self) -> [i128; 6] {
        self.sums
    }
}

impl<T: Real> Solids<T> for Stresslet<'_, T> {
    fn fill(&mut self, y: usize, z: usize, row: &mut SolidRow<T>) {
        self.mapped.fill(y, z, row);
    }

    fn collect(&mut self, y: usize, z: usize, row: &SolidRow<T>) {
        let MappedSolids { lines, bodies, shares, rows, .. } = &self.mapped;
        let mut windows = shares.iter().flatten();
        for segment in lines.line(z * rows + y) {
            let centre = bodies[segment.body as usize].motion.centre;
            let n = segment.offset.map(f64::from);
            let [ry, rz] = [n[1] - centre[1], n[2] - centre[2]];
            for done in (0..segment.count as usize).step_by(CHUNK) {
                let count = (segment.count as usize - done).min(CHUNK);
                let shares = windows.next().expect("one for each window");
                let [taken, _] = row.exchanged(segment.x as usize + done);
                let [fx, fy, fz]: [[f64; CHUNK]; 3] = std::array::from_fn(|axis| {
                    masked(&std::array::from_fn(|k| shares[k] * taken[axis][k]), count)
                });
                let moments = |moment: &dyn Fn(usize, f64) -> f64| {
                    let at = |k: usize| moment(k, (n[0] + done as f64 + f64::LANE[k]) - centre[0]);
                    i128::from(sum_fixed(&std::array::from_fn::<f64, CHUNK, _>(at)))
                };
                self.sums[0] += moments(&|k, rx| rx * fx[k]);
                self.sums[1] += moments(&|k, _| ry * fy[k]);
                self.sums[2] += moments(&|k, _| rz * fz[k]);
                self.sums[3] += moments(&|k, rx| 0.5 * (rx * fy[k] + ry * fx[k]));
                self.sums[4] += moments(&|k, rx| 0.5 * (rx * fz[k] + rz * fx[k]));
                self.sums[5] += moments(&|k, _| 0.5 * (ry * fz[k] + rz * fy[k]));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{CELLS, COUPLINGS, UNITS, coupled, fluid_for, store};
    use super::super::wall_tests::walls;
    use super::super::{Fraction, LatticeWalls};
    use super::*;
    use crate::comm::on_threads;
    use crate::domain::{Decomposition, Domain};
    use crate::fluid::{Boundary, Fluid, SolidCollision};
    use crate::math::{Vec3, from_fixed_wide};
    use crate::particle::Particle;

    /// One that overlaps the floor, and two that overlap each other across an edge of the box; all turn.
    fn three() -> [Particle; 3] {
        [[0.1, 1.5, 0.4], [1.4, 0.02, 3.2], [1.9, 2.4, 3.0]].map(|at| {
            let mut particle = Particle::at((10.0 * at[0]) as u64, 0, at.into());
            (particle.velocity, particle.angular_velocity) = ([0.3, -0.2, 0.1], [2.0, -1.0, 3.0]);
            particle
        })
    }

    /// The sums after some steps, each of which gets beforehand what it will measure.
    fn measured<T: Real>(solids: SolidCollision, grid: [usize; 3]) -> [i128; 6] {
        let domain = Domain { periodic: [true, true, false], cells: CELLS, dx: UNITS.dx };
        let decomposition = Decomposition::with_grid(domain, grid);
        let walls = LatticeWalls::new(&walls(&domain), &UNITS);
        let parts = on_threads(decomposition.ranks(), |comm| {
            let boundary = Boundary { motions: walls.motions(), wall_of: &|cell| walls.wall_of(cell) };
            let store = store(&decomposition, comm.rank(), &three(), 0.6);
            let mut fluid = Fluid::<T>::new(&decomposition, &comm, &fluid_for(solids), &boundary).unwrap();
            let mut coupling = Coupling::new(coupled(solids), &decomposition, comm.rank(), 0.6);
            let mut sums = [0; 6];
            for step in 0..7 {
                coupling.map(&store);
                let before = fluid.state_hash();
                let mut stresslet = coupling.stresslet(&store);
                let (foretold, held) = fluid.measure(&mut stresslet);
                sums = std::array::from_fn(|i| stresslet.sums()[i] - held[i]);
                assert_eq!(fluid.state_hash(), before);
                coupling.begin_exchange(&fluid);
                let found = fluid.sweep([1e-4, 0.0, 0.0], &mut coupling.solids(&store), true);
                assert_eq!(Some(foretold), found, "{solids:?}, step {step}");
                fluid.exchange();
                coupling.loads(&store, Vec3::zeros(), &comm);
            }
            sums
        });
        std::array::from_fn(|i| parts.iter().map(|part| part[i]).sum())
    }

    #[test]
    fn a_measurement_foretells_the_next_sweep_to_the_bit_and_is_the_same_on_any_blocks() {
        for solids in COUPLINGS {
            let (single, double) = (measured::<f32>(solids, [1, 1, 1]), measured::<f64>(solids, [1, 1, 1]));
            assert_eq!(measured::<f32>(solids, [2, 1, 2]), single, "{solids:?}");
            assert_eq!(measured::<f64>(solids, [3, 2, 2]), double, "{solids:?}");
            let [single, double] = [single, double].map(|sums| sums.map(from_fixed_wide));
            let largest = double.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
            for (s, d) in single.into_iter().zip(double) {
                assert!(largest > 0.1 && (s - d).abs() < 1e-4 * largest, "{single:?} {double:?}");
            }
        }
    }

    #[test]
    fn the_moments_are_those_of_the_force_in_every_cell_about_the_centre() {
        // A sphere at rest in fluid that flows as `u = E r`: all it takes in a cell is along its own part of the
        // strain.
        let strain = [[1e-3, 2e-4, 3e-4], [2e-4, -5e-4, 4e-4], [3e-4, 4e-4, -5e-4]];
        let (centre, radius) = (Vec3::new(1.51, 1.18, 1.73), 0.7);
        let decomposition =
            Decomposition::new(Domain { periodic: [true; 3], cells: CELLS, dx: UNITS.dx }, 1).unwrap();
        let particle = Particle::at(0, 0, centre);
        let store = store(&decomposition, 0, &[particle], radius);
        let params = fluid_for(SolidCollision::ExactDifference);
        let comm = crate::comm::Comm::Solo;
        let mut fluid = Fluid::<f64>::new(&decomposition, &comm, &params, &Boundary::none()).unwrap();
        fluid.set_equilibrium(|cell| {
            let r = Vec3::from(cell.map(|n| n as f64 + 0.5)) - centre / UNITS.dx;
            (1.0, std::array::from_fn(|a| (0..3).map(|b| strain[a][b] * r[b]).sum()))
        });
        let params = crate::coupling::CouplingParams {
            fraction: Fraction::VOLUME,
            ..coupled(SolidCollision::ExactDifference)
        };
        let mut coupling = Coupling::new(params, &decomposition, 0, radius);
        coupling.map(&store);
        let mut stresslet = coupling.stresslet(&store);
        fluid.measure(&mut stresslet);
        let sums = stresslet.sums().map(from_fixed_wide);
        // int r E r dV over a sphere is 4 pi a^5 / 15 E; the steps of the lattice leave 5 / 12 over a^2 in cells, 1.3
        // %.
        let cells = radius / UNITS.dx;
        let whole = 4.0 / 15.0 * std::f64::consts::PI * cells.powi(5);
        for (sum, (a, b)) in sums.into_iter().zip([(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]) {
            let exact = whole * strain[a][b];
            assert!((sum / exact - 1.0).abs() < 0.03, "{a}{b}: {sum} {exact}");
        }
    }
}
