//! Clusters: sets of particles connected by contacts, and whether they reach through the box.
//!
//! Every particle of a cluster has a place in boxes from the first one, which contacts pass on across periodic faces. A contact between two
//! particles whose places do not fit to it closes a way through the box. Each rank finds the clusters among its own contacts; only those
//! that may have parts on other ranks are joined on rank 0.
//!
//! # Reference
//! Stauffer and Aharony (1994), Introduction to Percolation Theory, section 2.

use crate::dem::ContactState;
use crate::domain::Domain;
use crate::math::Vec3;
use crate::particle::{Particle, Template};
use crate::simulation::observe::{partners, to_owners};
use crate::simulation::writers::RankState;
use bytemuck::{Pod, Zeroable};
use std::collections::{BTreeMap, BTreeSet};

/// Least component along an axis of the normal of a contact with a wall on that side: 45 degrees.
const ON_SIDE: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Particles connected by contacts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Cluster {
    /// Their number.
    pub size: u64,
    /// Axes along which they are connected to their own periodic images.
    wraps: [bool; 3],
    /// They touch a wall at the lower and the upper side of each axis.
    touches: [[bool; 2]; 3],
}

impl Cluster {
    /// True of each axis along which it reaches through the box.
    pub(super) fn percolates(&self, domain: &Domain) -> [bool; 3] {
        [0, 1, 2].map(|axis| {
            if domain.is_periodic(axis) { self.wraps[axis] } else { self.touches[axis] == [true; 2] }
        })
    }

    fn add(&mut self, other: &Self) {
        self.size += other.size;
        for axis in 0..3 {
            self.wraps[axis] |= other.wraps[axis];
            (0..2).for_each(|side| self.touches[axis][side] |= other.touches[axis][side]);
        }
    }
}

/// Two nodes that are connected, and how many boxes the place of the second is from that of the first.
type Edge = (usize, usize, [i32; 3]);

/// Joins nodes: for each its cluster and its place (boxes), and the clusters.
fn join(nodes: &[Cluster], edges: &[Edge]) -> (Vec<(usize, [i32; 3])>, Vec<Cluster>) {
    let mut of_node = vec![Vec::new(); nodes.len()];
    for &(from, to, step) in edges {
        of_node[from].push((to, step));
        of_node[to].push((from, step.map(|boxes| -boxes)));
    }
    let (mut places, mut clusters) = (vec![None; nodes.len()], Vec::new());
    for first in 0..nodes.len() {
        if places[first].is_some() {
            continue;
        }
        let (mut cluster, number) = (Cluster::default(), clusters.len());
        places[first] = Some((number, [0; 3]));
        let mut waiting = vec![(first, [0; 3])];
        while let Some((node, place)) = waiting.pop() {
            cluster.add(&nodes[node]);
            for &(other, step) in &of_node[node] {
                let there: [i32; 3] = std::array::from_fn(|axis| place[axis] + step[axis]);
                if let Some((_, known)) = places[other] {
                    (0..3).for_each(|axis| cluster.wraps[axis] |= known[axis] != there[axis]);
                } else {
                    places[other] = Some((number, there));
                    waiting.push((other, there));
                }
            }
        }
        clusters.push(cluster);
    }
    (places.into_iter().map(|place| place.expect("each node is in a cluster")).collect(), clusters)
}

/// A particle that the contacts of a rank know and another rank owns: that rank, its cluster there, and its place.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Known {
    rank: u32,
    cluster: u32,
    place: [i32; 3],
    unused: u32,
}

/// A cluster of which others may hold a part, on its way to rank 0.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Part {
    number: u64,
    size: u64,
    /// [`Cluster::wraps`], then the sides.
    flags: [u8; 16],
}

/// Clusters of two ranks that are parts of one, and how many boxes the place of the second is from that of the first.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Joint {
    parts: [[u32; 2]; 2],
    step: [i32; 3],
    unused: u32,
}

impl Part {
    fn new(number: usize, &Cluster { size, wraps, touches }: &Cluster) -> Self {
        let mut flags = [0; 16];
        let all = wraps.into_iter().chain(touches.into_iter().flatten());
        flags.iter_mut().zip(all).for_each(|(flag, is)| *flag = is.into());
        Self { number: number as u64, size, flags }
    }

    fn cluster(&self) -> Cluster {
        let is = |n: usize| self.flags[n] != 0;
        Cluster {
            size: self.size,
            wraps: [0, 1, 2].map(is),
            touches: [3, 5, 7].map(|low| [is(low), is(low + 1)]),
        }
    }
}

/// A particle without contacts; a body that goes through the box is its own continuation.
fn alone(template: &Template) -> Cluster {
    let mut cluster = Cluster { size: 1, ..Cluster::default() };
    for passage in template.parts().filter_map(|(shape, _)| shape.passage()) {
        cluster.wraps[passage.axis] = true;
    }
    cluster
}

/// Particles and the contacts between them, as nodes and edges.
struct Graph {
    nodes: Vec<Cluster>,
    edges: Vec<Edge>,
    /// Nodes of the particles of other ranks, by id.
    others: BTreeMap<u64, usize>,
}

impl Graph {
    /// From the particles of a rank and its contacts; `known` has all particles that these name, both ascending by id.
    fn new<'a>(
        domain: &Domain,
        own: &[Particle],
        template: impl Fn(&Particle) -> &'a Template,
        known: &[Particle],
        contacts: &[ContactState],
    ) -> Self {
        let size = domain.size();
        let mut nodes: Vec<Cluster> = own.iter().map(|particle| alone(template(particle))).collect();
        let (mut others, mut edges) = (BTreeMap::new(), Vec::new());
        for contact in contacts.iter().filter(|contact| contact.touches()) {
            let mut node = |id: u64| {
                own.binary_search_by_key(&id, |particle| particle.id).unwrap_or_else(|_| {
                    *others.entry(id).or_insert_with(|| {
                        nodes.push(Cluster::default());
                        nodes.len() - 1
                    })
                })
            };
            let first = node(contact.first);
            if contact.wall().is_some() {
                for (axis, touches) in nodes[first].touches.iter_mut().enumerate() {
                    // A wall within the box has bodies on both of its sides, but each of these lies in one half.
                    let upper = contact.point[axis] > 0.5 * size[axis];
                    touches[0] |= contact.normal[axis] < -ON_SIDE && !upper;
                    touches[1] |= contact.normal[axis] > ON_SIDE && upper;
                }
                continue;
            }
            let second = node(contact.second);
            let centre = |id: u64| -> Vec3 {
                let at = known.binary_search_by_key(&id, |particle| particle.id);
                known[at.expect("both are known")].position()
            };
            let between = centre(contact.second) - centre(contact.first);
            let way = domain.shifted(domain.nearest_image(between), contact.key().shift());
            edges.push((first, second, domain.boxes(way - between).map(i32::from)));
        }
        Self { nodes, edges, others }
    }
}

/// The clusters of all particles, ascending by id, and all contacts.
pub(super) fn clusters_of_all<'a>(
    domain: &Domain,
    particles: &[Particle],
    template: impl Fn(&Particle) -> &'a Template,
    contacts: &[ContactState],
) -> Vec<Cluster> {
    let Graph { nodes, edges, .. } = Graph::new(domain, particles, template, particles, contacts);
    join(&nodes, &edges).1
}

/// The clusters, single particles among them, each on one rank, in any order. Collective.
pub(super) fn clusters(rank: &RankState) -> Vec<Cluster> {
    let (simulation, contacts) = (rank.simulation(), rank.contacts());
    let (domain, comm) = (&rank.decomposition().domain, simulation.comm());
    let store = simulation.dem().particles();
    let known = partners(simulation, contacts);
    let template = |particle: &Particle| store.template(particle);
    let Graph { nodes, edges, others } =
        Graph::new(domain, simulation.particles(), template, &known, contacts);
    let (places, clusters) = join(&nodes, &edges);
    let here = comm.rank() as u32;
    let abroad = others.iter().map(|(&id, &node)| {
        let (cluster, place) = places[node];
        (id, Known { rank: here, cluster: cluster as u32, place, unused: 0 })
    });
    let told = to_owners(simulation, rank.decomposition(), abroad);
    let joints = told.iter().map(|(at, known)| {
        let (cluster, place) = places[*at];
        let step = std::array::from_fn(|axis| known.place[axis] - place[axis]);
        Joint { parts: [[known.rank, known.cluster], [here, cluster as u32]], step, unused: 0 }
    });
    let joints: Vec<Joint> = joints.collect();
    let of_others = others.values().map(|&node| places[node].0);
    let shared: BTreeSet<usize> = of_others.chain(told.iter().map(|(at, _)| places[*at].0)).collect();
    let parts: Vec<Part> = shared.iter().map(|&number| Part::new(number, &clusters[number])).collect();
    let parts = comm.gather(bytemuck::cast_slice(&parts).to_vec());
    let joints = comm.gather(bytemuck::cast_slice(&joints).to_vec());
    let mut all: Vec<Cluster> =
        (0..clusters.len()).filter(|n| !shared.contains(n)).map(|n| clusters[n]).collect();
    all.extend(of_parts(&parts, &joints));
    all
}

/// The clusters that parts of ranks, by rank, make up.
fn of_parts(parts: &[Vec<u8>], joints: &[Vec<u8>]) -> Vec<Cluster> {
    let (mut number_of, mut nodes) = (BTreeMap::new(), Vec::new());
    for (rank, bytes) in (0_u32..).zip(parts) {
        for part in bytemuck::pod_collect_to_vec::<u8, Part>(bytes) {
            number_of.insert([rank, part.number as u32], nodes.len());
            nodes.push(part.cluster());
        }
    }
    let edges = joints.iter().flat_map(|bytes| bytemuck::pod_collect_to_vec::<u8, Joint>(bytes));
    let edges = edges.map(|Joint { parts: [from, to], step, .. }| (number_of[&from], number_of[&to], step));
    join(&nodes, &edges.collect::<Vec<_>>()).1
}

#[cfg(test)]
mod tests {
    use super::*;

    fn nodes<const N: usize>() -> [Cluster; N] {
        [Cluster { size: 1, ..Cluster::default() }; N]
    }

    #[test]
    fn a_ring_wraps_where_it_crosses_a_face_once_and_not_where_it_comes_back() {
        let ring = |last: [i32; 3]| [(0, 1, [1, 0, 0]), (1, 2, [0; 3]), (2, 0, last), (3, 4, [0, 0, 1])];
        let of = |last| join(&nodes::<6>(), &ring(last)).1;
        let whole = of([0; 3]);
        assert_eq!(whole.iter().map(|cluster| cluster.size).collect::<Vec<_>>(), [3, 2, 1]);
        assert_eq!(whole[0].wraps, [true, false, false]);
        assert_eq!(of([-1, 0, 0])[0].wraps, [false; 3]);
        assert_eq!(of([-1, 2, 0])[0].wraps, [false, true, false]);
    }

    #[test]
    fn a_chain_of_particles_on_three_ranks_is_one_cluster_that_wraps() {
        // Ranks 0 and 2 have two particles each, rank 1 one, and on rank 2 there is a cluster of its own.
        let part = |number, size| Part::new(number, &Cluster { size, ..Cluster::default() });
        let parts = [vec![part(4, 2)], vec![part(0, 1)], vec![part(1, 2), part(7, 5)]];
        let joint = |parts, step| Joint { parts, step, unused: 0 };
        let joints = [
            joint([[0, 4], [1, 0]], [0; 3]),
            joint([[1, 0], [2, 1]], [0, 1, 0]),
            joint([[0, 4], [2, 1]], [0; 3]),
        ];
        let parts = parts.map(|parts| bytemuck::cast_slice(&parts).to_vec());
        let clusters = of_parts(&parts, &[Vec::new(), bytemuck::cast_slice(&joints).to_vec()]);
        assert_eq!(clusters.iter().map(|cluster| cluster.size).collect::<Vec<_>>(), [5, 5]);
        assert_eq!([clusters[0].wraps, clusters[1].wraps], [[false, true, false], [false; 3]]);
    }

    #[test]
    fn what_a_cluster_touches_and_wraps_survives_the_way_to_rank_0() {
        let touches = [[true, false], [false, true], [true, true]];
        let cluster = Cluster { size: 3, wraps: [true, false, true], touches };
        assert_eq!(Part::new(9, &cluster).cluster(), cluster);
    }
}
