//! Particles near the block of a rank, beyond its ghosts, and sums of particles at their owner ranks.

use crate::domain::Decomposition;
use crate::math::Vec3;
use crate::simulation::Simulation;
use std::collections::BTreeMap;

/// Centres (m) of the particles of other ranks that are within `reach` (m) of the block of this rank along every axis. Collective; sends each rank in
/// reach the centres near its block.
pub(in crate::simulation) fn centres_near(
    simulation: &Simulation,
    cut: &Decomposition,
    reach: f64,
) -> Vec<Vec3> {
    let comm = simulation.comm();
    let peers = cut.neighbours(comm.rank(), reach);
    let own = simulation.particles();
    let messages = peers.iter().map(|&peer| {
        let place = cut.grid_index(peer);
        let slabs = [0, 1, 2].map(|axis| cut.slab(axis, place[axis]));
        let near = own.iter().filter(|particle| {
            (0..3).all(|axis| {
                let ([low, high], x) = (slabs[axis], particle.position[axis]);
                let offset = (x - 0.5 * (low + high)).abs();
                // Positions beyond a closed face belong to the block at that face.
                cut.domain.shorter_way(axis, offset) <= 0.5 * (high - low) + reach
            })
        });
        near.flat_map(|particle| bytemuck::cast::<_, [u8; 24]>(particle.position)).collect()
    });
    let received = comm.exchange(&peers, messages.collect());
    let centres = received.iter().flat_map(|bytes| bytemuck::pod_collect_to_vec::<u8, [f64; 3]>(bytes));
    centres.map(Vec3::from).collect()
}

/// Adds up numbers by the id of a particle, which any ranks have, at its owner: in the order of its particles. Collective.
///
/// Those of ghosts go to ranks nearby; only an engine that has all contacts at one rank has others, which all ranks get.
pub(in crate::simulation) fn at_owners(
    simulation: &Simulation,
    cut: &Decomposition,
    numbers: &BTreeMap<u64, u64>,
) -> Vec<u64> {
    let (comm, store) = (simulation.comm(), simulation.dem().particles());
    let own = store.owned();
    let mut sums = vec![0; own.len()];
    let mut add = |pair: [u64; 2]| {
        if let Ok(at) = own.binary_search_by_key(&pair[0], |particle| particle.id) {
            sums[at] += pair[1];
        }
    };
    let ghosts = store.particles.iter().zip(&store.owners).skip(store.owned);
    let owner_of: BTreeMap<u64, usize> = ghosts.map(|(ghost, &owner)| (ghost.id, owner as usize)).collect();
    // Wide enough for the owners of all ghosts; mutual.
    let widest = store.templates.iter().map(|template| template.shape.circumradius()).fold(0.0, f64::max);
    let peers = cut.neighbours(comm.rank(), 3.0 * widest + 4.0 * cut.domain.dx);
    let mut messages = vec![Vec::new(); peers.len()];
    let mut others = Vec::new();
    for (&id, &number) in numbers {
        let bytes: [u8; 16] = bytemuck::cast([id, number]);
        if own.binary_search_by_key(&id, |particle| particle.id).is_ok() {
            add([id, number]);
        } else if let Some(link) = owner_of.get(&id).and_then(|owner| peers.binary_search(owner).ok()) {
            messages[link].extend(bytes);
        } else {
            others.extend(bytes);
        }
    }
    let mut received = comm.exchange(&peers, messages);
    if comm.any(!others.is_empty()) {
        received.extend(comm.all_gather(others));
    }
    for bytes in &received {
        bytemuck::pod_collect_to_vec::<u8, [u64; 2]>(bytes).into_iter().for_each(&mut add);
    }
    sums
}
