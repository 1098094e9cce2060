//! Particles near the block of a rank, beyond its ghosts, and sums of particles at their owner ranks.

use crate::domain::Decomposition;
use crate::math::Vec3;
use crate::particle::Particle;
use crate::simulation::Simulation;
use bytemuck::Pod;
use std::collections::BTreeMap;

/// Centre (m) and template of a particle.
pub(in crate::simulation) type Centre = (Vec3, u64);

/// Centres of the particles of other ranks that are within `reach` (m) of the block of this rank along every axis. Collective; sends each rank in
/// reach the centres near its block.
pub(in crate::simulation) fn centres_near(
    simulation: &Simulation,
    cut: &Decomposition,
    reach: f64,
) -> Vec<Centre> {
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
        let centre = |particle: &Particle| {
            let [x, y, z] = particle.position.map(f64::to_bits);
            bytemuck::cast::<_, [u8; 32]>([x, y, z, particle.template])
        };
        near.flat_map(centre).collect()
    });
    let received = comm.exchange(&peers, messages.collect());
    let centres = received.iter().flat_map(|bytes| bytemuck::pod_collect_to_vec::<u8, [u64; 4]>(bytes));
    centres.map(|[x, y, z, template]| ([x, y, z].map(f64::from_bits).into(), template)).collect()
}

/// Adds up numbers by the id of a particle, which any ranks have, at its owner: in the order of its particles. Collective.
pub(in crate::simulation) fn at_owners(
    simulation: &Simulation,
    cut: &Decomposition,
    numbers: &BTreeMap<u64, u64>,
) -> Vec<u64> {
    let mut sums = vec![0; simulation.particles().len()];
    for (at, number) in to_owners(simulation, cut, numbers.iter().map(|(&id, &number)| (id, number))) {
        sums[at] += number;
    }
    sums
}

/// Gives what ranks have for particles, by id, to the owner of each: with the index of the particle there, in any order. Collective.
///
/// That of ghosts goes to ranks nearby; only an engine that has all contacts at one rank has more, which all ranks get.
pub(in crate::simulation) fn to_owners<N: Pod>(
    simulation: &Simulation,
    cut: &Decomposition,
    all: impl Iterator<Item = (u64, N)>,
) -> Vec<(usize, N)> {
    let (comm, store) = (simulation.comm(), simulation.dem().particles());
    let own = store.owned();
    let index = |id: u64| own.binary_search_by_key(&id, |particle| particle.id).ok();
    let ghosts = store.particles.iter().zip(&store.owners).skip(store.owned);
    let owner_of: BTreeMap<u64, usize> = ghosts.map(|(ghost, &owner)| (ghost.id, owner as usize)).collect();
    // Wide enough for the owners of all ghosts; mutual.
    let widest = store.templates.iter().map(|template| template.shape.circumradius()).fold(0.0, f64::max);
    let peers = cut.neighbours(comm.rank(), 3.0 * widest + 4.0 * cut.domain.dx);
    let mut messages = vec![Vec::new(); peers.len()];
    let (mut given, mut others) = (Vec::new(), Vec::new());
    for (id, number) in all {
        if let Some(at) = index(id) {
            given.push((at, number));
            continue;
        }
        let link = owner_of.get(&id).and_then(|owner| peers.binary_search(owner).ok());
        let message = link.map_or(&mut others, |link| &mut messages[link]);
        message.extend(bytemuck::bytes_of(&id));
        message.extend(bytemuck::bytes_of(&number));
    }
    let mut received = comm.exchange(&peers, messages);
    if comm.any(!others.is_empty()) {
        received.extend(comm.all_gather(others));
    }
    for one in received.iter().flat_map(|bytes| bytes.chunks_exact(size_of::<u64>() + size_of::<N>())) {
        let (id, number) = one.split_at(size_of::<u64>());
        let at = index(bytemuck::pod_read_unaligned(id));
        given.extend(at.map(|at| (at, bytemuck::pod_read_unaligned(number))));
    }
    given
}
