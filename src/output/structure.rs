//! Tables of the structure of the particles: `structure.csv`, `pair_distribution.csv`, `contact_forces.csv` and `structure_factor.csv`.

use super::means::Bins;
use super::series::{definitions, heads};
use std::sync::LazyLock;

/// Quantities of `structure.csv`, one row per time.
const QUANTITIES: &str = "\
step (-): Steps done.
t (s): Time, `step * time_step`.
nearest_neighbour_distance (m): Mean distance of a particle's centre to the nearest other one, of particles that have one within \
    `output.structure.reach`.
coordination (-): Mean number of bodies and walls that a freely moving particle touches. Empty, as is all that follows from contacts, if the engine \
    does not tell them.
rattlers (-): Part of the freely moving particles that touch fewer than four bodies and walls (Goncu, Duran and Luding 2010, \
    doi:10.1016/j.crme.2010.10.004).
coordination_without_rattlers (-): Mean number of bodies and walls that the others touch.
fabric_{xx,yy,zz,xy,xz,yz} (-): Fabric tensor, mean of `n_i n_j` over the contacts of particles with each other, `n` the unit normal \
    (Satake 1982); its trace is 1, and a third of that on the diagonal means no preferred direction.
normal_force (N): Mean normal force of these contacts, positive where it pushes.
orientation_{xx,yy,zz,xy,xz,yz} (-): Orientation tensor, mean of `p_i p_j` (Advani and Tucker 1987, doi:10.1122/1.549945), `p` the \
    principal axis of a body whose moment of inertia differs most from both others. Empty without such bodies.
velocity_variance_{xx,yy,zz,xy,xz,yz} (m^2/s^2): Velocity fluctuations, mean of `(v_i - <v_i>) (v_j - <v_j>)` over the freely moving particles; a third \
    of the trace is the granular temperature.
clusters (-): Number of sets of two or more particles that are connected by contacts with each other. Empty, as are the next three, if the engine does not \
    tell its contacts.
cluster_size (-): Mean size of the cluster that a particle is in, `sum s^2 / N`, a particle without contacts being one of size 1 (Stauffer and Aharony 1994, \
    Introduction to Percolation Theory, section 2).
largest_cluster (-): Fraction of the particles that is in the largest cluster.
percolation_{x,y,z} (-): 1 if a cluster reaches through the box, otherwise 0, so that the mean is the probability: along a periodic axis it is connected to its \
    own periodic image, along a closed one it touches walls at both sides, with normals within 45 degrees of the axis, each in that half of the box. Bodies whose whole \
    motion is prescribed have no contacts with each other and with walls.
";

/// Quantities of `pair_distribution.csv`, one row per time and bin.
const OF_PAIRS: &str = "\
step (-): Steps done.
t (s): Time, `step * time_step`.
separation (m): Middle of the bin of the distance `r` of two centres.
pair_distribution (-): `g(r)`, number of ordered pairs in the bin over that of as many particles anywhere in the box, `N (N - 1) / V` times the volume of the \
    shell; in a box with walls times the part of it that lies in the box, in the mean over its centre.
";

/// Quantities of `contact_forces.csv`, one row per time and bin.
const OF_FORCES: &str = "\
step (-): Steps done.
t (s): Time, `step * time_step`.
force_over_mean (-): Middle of the bin of the normal force of contacts between particles over its mean at this time (those that pull are left out).
probability_density (-): Part of the contacts in the bin over its width (Radjai et al. 1996, doi:10.1103/PhysRevLett.77.274).
";

/// Quantities of `structure_factor.csv`, one row per time and shell of wave vectors.
const OF_WAVES: &str = "\
step (-): Steps done.
t (s): Time, `step * time_step`.
wave_number (1/m): Mean length of the wave vectors `2 pi n_i / L_i` of the shell, with whole numbers `n_i` along periodic axes and zero along closed ones.
structure_factor (-): `S(k)`, mean of `|sum exp(i k x)|^2 / N` over these, `x` the centres of all `N` particles (Hansen and McDonald 2013, section 4.1).
";

/// Sectors of the directions of pairs in a plane, from the first axis on over half a turn.
pub const SECTORS: usize = 18;

/// Header of `structure.csv`.
pub static COLUMNS: LazyLock<Vec<String>> = LazyLock::new(|| heads(QUANTITIES));
/// Header of `contact_forces.csv`.
pub static FORCE_COLUMNS: LazyLock<Vec<String>> = LazyLock::new(|| heads(OF_FORCES));
/// Header of `pair_distribution.csv` without directions.
pub static PAIR_COLUMNS: LazyLock<Vec<String>> = LazyLock::new(|| heads(OF_PAIRS));
/// Header of `structure_factor.csv`.
pub static FACTOR_COLUMNS: LazyLock<Vec<String>> = LazyLock::new(|| heads(OF_WAVES));
/// Definition of every quantity of the tables.
pub static DEFINITIONS: LazyLock<Vec<(&str, &str)>> =
    LazyLock::new(|| [QUANTITIES, OF_PAIRS, OF_FORCES, OF_WAVES].map(definitions).concat());

/// The bins of `pair_distribution.csv`.
pub const PAIR_BINS: Bins = Bins { keys: &["separation"], time: "t", front: 3, independent: false };
/// The bins of `contact_forces.csv`.
pub const FORCE_BINS: Bins = Bins { keys: &["force_over_mean"], time: "t", front: 3, independent: false };
/// The bins of `structure_factor.csv`.
pub const FACTOR_BINS: Bins = Bins { keys: &["wave_number"], time: "t", front: 3, independent: false };

/// Angle (degrees) from the first axis of the plane in the middle of a sector.
pub fn angle(sector: usize) -> usize {
    (180 * sector + 90) / SECTORS
}

/// Most sections of particles whose pairs have distributions of their own.
pub const MOST_SECTIONS: usize = 6;

/// The pairs of sections of particles that have distributions of their own; none with one section, or too many.
pub fn kinds(sections: usize) -> impl Iterator<Item = [usize; 2]> {
    let all = if (2..=MOST_SECTIONS).contains(&sections) { sections } else { 0 };
    (0..all).flat_map(move |a| (a..all).map(move |b| [a, b]))
}

/// Name of the column of a pair of sections.
pub fn of_kinds([a, b]: [usize; 2]) -> String {
    format!("pair_distribution_particles.{a}_particles.{b}")
}

/// Header of `pair_distribution.csv`, with columns of directions if pairs are told apart by them, and of the pairs of sections.
pub fn pair_head(directions: bool, sections: usize) -> Vec<String> {
    let sectors = if directions { SECTORS } else { 0 };
    let of = |sector| format!("pair_distribution_at_{} (-)", angle(sector));
    let of_kinds = kinds(sections).map(|kinds| of_kinds(kinds) + " (-)");
    PAIR_COLUMNS.iter().cloned().chain((0..sectors).map(of)).chain(of_kinds).collect()
}
