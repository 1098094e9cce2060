//! Data that a rank has of a step, and those that go from all ranks to rank 0.

use crate::dem::{ContactState, Load};
use crate::domain::{Block, Decomposition};
use crate::error::Result;
use crate::fluid::{CellState, FlowRow};
use crate::memory;
use crate::output::picture::Plane;
use crate::output::{Fields, contacts::ids};
use crate::particle::Particle;
use crate::simulation::writers::{Need, RankOutput};
use crate::simulation::{FluidSystem, Simulation};
use crate::units::Units;
use bytemuck::{Pod, Zeroable};

impl RankOutput {
    /// Data that are needed of a step: in `pieces` what belongs to this rank, else all at rank 0 and nothing elsewhere. `touches` are the
    /// contacts that this rank is responsible for. Errors: [`Error::Memory`](crate::Error::Memory), in `pieces` on this rank alone,
    /// else on every rank. Collective.
    pub(super) fn gather(
        simulation: &mut Simulation,
        cut: &Decomposition,
        pieces: bool,
        needs: &[Need],
        touches: &[ContactState],
        time: f64,
    ) -> Result<Option<Self>> {
        let rank = simulation.comm.rank();
        let block = if pieces { cut.block(rank) } else { Block { lo: [0; 3], hi: cut.domain.cells } };
        let mut output = Self::empty(pieces.then_some(rank), block, simulation.step, time);
        let needed = |need| needs.contains(&need);
        if needed(Need::Contacts) && pieces {
            output.contacts = touches.to_vec();
            output.partners = Some(partners(simulation, touches));
        } else if needed(Need::Contacts) {
            output.contacts = contacts(simulation, touches);
        }
        if pieces && (needed(Need::Particles) || needed(Need::Loads)) {
            output.particles = simulation.particles().to_vec();
        } else if needed(Need::Particles) || needed(Need::Loads) || needed(Need::Contacts) {
            output.particles = particles(simulation, |_| true);
        }
        if needed(Need::Loads) && simulation.system.is_some() {
            // They have travelled with the particles.
            let (own, loads) = (simulation.particles(), simulation.dem.loads());
            output.loads = Some(if pieces {
                loads.to_vec()
            } else {
                let own = own.iter().map(|particle| particle.id).zip(loads.iter().copied());
                gathered_loads(simulation, own).into_iter().map(|(_, load)| load).collect()
            });
        }
        // Last: in pieces it is no matter of the others whether this rank has room for them.
        if needed(Need::Fields) {
            let fields = if pieces { own_fields(simulation, block) } else { fields(simulation, cut) };
            output.fields = Some(fields?);
        }
        Ok(Some(output).filter(|_| pieces || rank == 0))
    }
}

/// The particles of all ranks of which `wanted` holds, in ascending order of id, on rank 0; none elsewhere. Collective.
pub(super) fn particles(simulation: &Simulation, wanted: impl Fn(&Particle) -> bool) -> Vec<Particle> {
    let own = simulation.dem.particles().owned().iter();
    let mut all = gathered(simulation, own.filter(|p| wanted(p)).copied().collect());
    all.sort_unstable_by_key(|particle| particle.id);
    all
}

/// The contacts of all ranks, in ascending order of the ids, on rank 0; none elsewhere. Collective.
pub(super) fn contacts(simulation: &Simulation, touches: &[ContactState]) -> Vec<ContactState> {
    let mut all = gathered(simulation, touches.to_vec());
    all.sort_by_key(ContactState::key);
    all
}

/// The particles on this rank, ghosts included, ascending by id, and with them all that its contacts are between. Collective.
///
/// Only an engine that has all contacts at one rank names others than those on it
/// ([`GhostLayer`](crate::dem::assign::GhostLayer)).
pub(in crate::simulation) fn partners(simulation: &Simulation, own: &[ContactState]) -> Vec<Particle> {
    let (comm, store) = (&simulation.comm, simulation.dem.particles());
    let mut known = store.particles.clone();
    known.sort_unstable_by_key(|particle| particle.id);
    let is_known = |id: &u64| known.binary_search_by_key(id, |particle| particle.id).is_ok();
    let mut missing: Vec<u64> = own.iter().flat_map(ids).filter(|id| !is_known(id)).collect();
    if !comm.any(!missing.is_empty()) {
        return known;
    }
    let asked = comm.all_gather(bytemuck::cast_slice(&missing).to_vec());
    let mut asked: Vec<u64> = bytemuck::pod_collect_to_vec(&asked.concat());
    asked.sort_unstable();
    let answers = store.owned().iter().filter(|particle| asked.binary_search(&particle.id).is_ok());
    let answers: Vec<Particle> = answers.copied().collect();
    let answers = comm.all_gather(bytemuck::cast_slice(&answers).to_vec());
    missing.sort_unstable();
    let found: Vec<Particle> = bytemuck::pod_collect_to_vec(&answers.concat());
    known.extend(found.into_iter().filter(|particle| missing.binary_search(&particle.id).is_ok()));
    known.sort_unstable_by_key(|particle| particle.id);
    known
}

/// Force and torque of the fluid on a particle in the last step.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Loaded {
    id: u64,
    force: [f64; 3],
    torque: [f64; 3],
}

/// These loads of all ranks with their ids, ascending, on rank 0; nothing elsewhere. Collective.
fn gathered_loads(simulation: &Simulation, own: impl Iterator<Item = (u64, Load)>) -> Vec<(u64, Load)> {
    let loaded =
        |(id, load): (u64, Load)| Loaded { id, force: load.force.into(), torque: load.torque.into() };
    let mut all = gathered(simulation, own.map(loaded).collect());
    all.sort_unstable_by_key(|load| load.id);
    let load = |of: &Loaded| Load { force: of.force.into(), torque: of.torque.into() };
    all.iter().map(|of| (of.id, load(of))).collect()
}

/// Data of all ranks, by rank, on rank 0; nothing elsewhere. Collective.
fn gathered<V: Pod>(simulation: &Simulation, own: Vec<V>) -> Vec<V> {
    let parts = simulation.comm.gather(bytemuck::cast_slice(&own).to_vec());
    drop(own);
    let mut all = Vec::with_capacity(parts.iter().map(Vec::len).sum::<usize>() / size_of::<V>().max(1));
    for part in parts {
        all.extend(bytemuck::pod_collect_to_vec::<u8, V>(&part));
    }
    all
}

/// Name of the arrays of [`Fields`] in messages.
const FIELDS: &str = "a file of fields";

fn zeros(cells: usize) -> Result<Fields> {
    Ok(Fields {
        velocity: memory::zeroed(cells, FIELDS)?,
        pressure: memory::zeroed(cells, FIELDS)?,
        solid_fraction: memory::zeroed(cells, FIELDS)?,
    })
}

fn set(fields: &mut Fields, at: usize, [u, v, w, pressure, solid_fraction]: [f32; 5]) {
    fields.velocity[at] = [u, v, w];
    fields.pressure[at] = pressure;
    fields.solid_fraction[at] = solid_fraction;
}

/// Fields of the block of this rank, with the particles where they are now; nothing without a fluid.
pub(in crate::simulation) fn own_fields(simulation: &mut Simulation, block: Block) -> Result<Fields> {
    let (mut fields, mut at) = (zeros(block.cell_count())?, 0);
    let units = simulation.units;
    each_row(simulation, block, |row| {
        for (_, state) in row.each() {
            set(&mut fields, at, field_values(&units, &state));
            at += 1;
        }
    });
    Ok(fields)
}

/// Fields of the whole box on rank 0, as [`own_fields`], or an error on every rank if one of them has not the memory. Collective.
pub(in crate::simulation) fn fields(
    simulation: &mut Simulation,
    decomposition: &Decomposition,
) -> Result<Fields> {
    let comm = simulation.comm.clone();
    let block = decomposition.block(comm.rank());
    let room = || {
        let all = match comm.rank() {
            0 => zeros(decomposition.domain.cell_count())?,
            _ => Fields::default(),
        };
        Ok((all, memory::with_capacity(block.cell_count() * size_of::<[f32; 5]>(), FIELDS)?))
    };
    let (mut all, own): (_, Vec<u8>) = comm.agree(room())?;
    let hi @ [gx, gy, _] = decomposition.domain.cells;
    let whole = Block { lo: [0; 3], hi };
    gathered_cells(simulation, decomposition, whole, own, field_values, |[x, y, z], values| {
        set(&mut all, x + gx * (y + gy * z), values);
    });
    Ok(all)
}

/// Velocity (m/s) and pressure (Pa) on the plane of a slice on rank 0, as [`Plane::add`] makes it; nothing elsewhere and without a fluid.
/// Collective.
pub(super) fn slice(
    simulation: &mut Simulation,
    decomposition: &Decomposition,
    plane: &Plane,
) -> Vec<[f32; 4]> {
    let value = |units: &Units, state: &CellState| {
        let [u, v, w, pressure, _] = field_values(units, state);
        [u, v, w, pressure]
    };
    let mut all = vec![[0.0; 4]; if simulation.comm.rank() == 0 { plane.values() } else { 0 }];
    gathered_cells(simulation, decomposition, plane.cells(), Vec::new(), value, |cell, u| {
        plane.add(&mut all, cell, u);
    });
    all
}

/// Calls `visit` on rank 0 with those of `cells` that each rank has, x fastest, and the values that the ranks make of them and write into
/// `own`. Collective.
fn gathered_cells<V: Pod>(
    simulation: &mut Simulation,
    decomposition: &Decomposition,
    cells: Block,
    mut own: Vec<u8>,
    value: impl Fn(&Units, &CellState) -> V,
    mut visit: impl FnMut([usize; 3], V),
) {
    let part = |rank: usize| common(cells, decomposition.block(rank));
    let units = simulation.units;
    each_row(simulation, part(simulation.comm.rank()), |row| {
        row.each().for_each(|(_, state)| own.extend_from_slice(bytemuck::bytes_of(&value(&units, &state))));
    });
    for (rank, bytes) in simulation.comm.gather(own).iter().enumerate() {
        for (cell, bytes) in part(rank).cells().zip(bytes.chunks_exact(size_of::<V>())) {
            visit(cell, bytemuck::pod_read_unaligned(bytes));
        }
    }
}

fn field_values(units: &Units, state: &CellState) -> [f32; 5] {
    let [u, v, w] = state.velocity.map(|u| (u * units.velocity()) as f32);
    let pressure = (state.density_deviation * units.pressure()) as f32;
    [u, v, w, pressure, state.solid_fraction as f32]
}

/// Calls `visit` for the rows of `cells`, which are of the block of this rank, in ascending order; not at all without a fluid.
pub(in crate::simulation) fn each_row(
    simulation: &mut Simulation,
    cells: Block,
    visit: impl FnMut(&FlowRow),
) {
    let lattice = simulation.lattice_acceleration();
    let Simulation { system, dem, .. } = simulation;
    let Some(FluidSystem { fluid, coupling, .. }) = system else {
        return;
    };
    if cells.cell_count() > 0 {
        coupling.map(dem.particles());
        fluid.each_row(cells, lattice, coupling, visit);
    }
}

/// The cells that two boxes have in common.
fn common(a: Block, b: Block) -> Block {
    let lo = std::array::from_fn(|i| a.lo[i].max(b.lo[i]));
    Block { lo, hi: std::array::from_fn(|i| a.hi[i].min(b.hi[i]).max(lo[i])) }
}
