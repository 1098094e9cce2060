//! From all ranks to rank 0.

use crate::dem::ContactState;
use crate::domain::Decomposition;
use crate::fluid::Real;
use crate::output::{Contact, Partner};
use crate::particle::Particle;
use crate::simulation::{Simulation, Wet};

/// Fields of a block or of the box, SI units.
#[derive(Default)]
pub(super) struct Fields {
    pub(super) velocity: Vec<[f32; 3]>,
    pub(super) pressure: Vec<f32>,
    pub(super) solid_fraction: Vec<f32>,
}

/// All particles in ascending order of id, on rank 0; none elsewhere. Collective.
pub(super) fn particles<T: Real>(simulation: &Simulation<T>) -> Vec<Particle> {
    let own = simulation.dem.particles().owned();
    let mut all: Vec<Particle> = simulation
        .comm
        .gather(bytemuck::cast_slice(own).to_vec())
        .iter()
        .flat_map(|bytes| bytemuck::pod_collect_to_vec::<u8, Particle>(bytes))
        .collect();
    all.sort_unstable_by_key(|particle| particle.id);
    all
}

/// All contacts of all ranks in ascending order of the ids, on rank 0; none elsewhere. Collective.
pub(super) fn contacts<T: Real>(simulation: &Simulation<T>, own: &[ContactState]) -> Vec<Contact> {
    let mut all: Vec<ContactState> = simulation
        .comm
        .gather(bytemuck::cast_slice(own).to_vec())
        .iter()
        .flat_map(|bytes| bytemuck::pod_collect_to_vec::<u8, ContactState>(bytes))
        .collect();
    all.sort_by_key(|contact| (contact.first, contact.second));
    all.iter()
        .map(|state| Contact {
            first: state.first,
            second: state
                .wall()
                .map_or(Partner::Particle(state.second), Partner::Wall),
            point: state.point.into(),
            normal: state.normal.into(),
            force: state.force.into(),
            depth: state.depth,
            volume: state.volume,
        })
        .collect()
}

/// Fields of the whole box on rank 0, with the particles where they are now; empty elsewhere and in dry runs.
/// Collective.
pub(super) fn fields<T: Real>(simulation: &mut Simulation<T>, decomposition: &Decomposition) -> Fields {
    let lattice = (simulation.acceleration() / simulation.units.acceleration()).into();
    let Simulation {
        comm,
        units,
        wet,
        dem,
        ..
    } = simulation;
    let Some(Wet { fluid, coupling, .. }) = wet else {
        return Fields::default();
    };
    coupling.map(dem.particles());
    let mut own: Vec<[f32; 5]> = Vec::with_capacity(fluid.block().cell_count());
    fluid.each_cell(lattice, &mut coupling.solids(dem.particles()), |state| {
        let [u, v, w] = state.velocity.map(|u| (u * units.velocity()) as f32);
        let pressure = (state.density_deviation * units.pressure()) as f32;
        own.push([u, v, w, pressure, state.solid_fraction as f32]);
    });
    let blocks = comm.gather(bytemuck::cast_slice(&own).to_vec());
    if comm.rank() > 0 {
        return Fields::default();
    }
    let cells = decomposition.domain.cell_count();
    let mut all = Fields {
        velocity: vec![[0.0; 3]; cells],
        pressure: vec![0.0; cells],
        solid_fraction: vec![0.0; cells],
    };
    let [gx, gy, _] = decomposition.domain.cells;
    for (rank, bytes) in blocks.iter().enumerate() {
        let block = decomposition.block(rank);
        let mut states = bytes.chunks_exact(size_of::<[f32; 5]>());
        for (z, y) in (block.lo[2]..block.hi[2]).flat_map(|z| (block.lo[1]..block.hi[1]).map(move |y| (z, y)))
        {
            for (x, bytes) in (block.lo[0]..block.hi[0]).zip(&mut states) {
                let [u, v, w, pressure, fraction] = bytemuck::pod_read_unaligned::<[f32; 5]>(bytes);
                let cell = x + gx * (y + gy * z);
                (all.velocity[cell], all.pressure[cell], all.solid_fraction[cell]) =
                    ([u, v, w], pressure, fraction);
            }
        }
    }
    all
}
