//! One row of the time series.

use crate::case::Setup;
use crate::comm::Comm;
use crate::dem::ContactState;
use crate::fluid::Real;
use crate::math::{ReproducibleSum, Vec3, join_wide, magnitude, split_wide};
use crate::output::SeriesRow;
use crate::particle::Particle;
use crate::simulation::Simulation;

/// The direction in which the particles of a case settle as a whole, that of their weight less buoyancy: against gravity if
/// they are lighter than the fluid. `None` if nothing settles.
pub(super) fn settling_direction(setup: &Setup) -> Option<Vec3> {
    let weight: Vec3 = (setup.particles.iter())
        .map(|p| {
            let template = &setup.templates[p.template as usize];
            (template.density - fluid_density(setup)) * template.shape.volume() * setup.gravity
        })
        .sum();
    let speed = setup.scales.stokes_velocity;
    (!setup.dry && speed > 0.0 && speed.is_finite())
        .then(|| weight.try_normalize(0.0))
        .flatten()
}

/// Whether a settling velocity can become steady: the box has no end in its direction.
pub(super) fn settles_for_ever(setup: &Setup) -> bool {
    settling_direction(setup)
        .is_some_and(|down| (0..3).all(|axis| setup.domain.periodic[axis] || down[axis] == 0.0))
}

/// Unit of `t*` (s), if a case has one.
pub(super) fn stokes_time(setup: &Setup) -> Option<f64> {
    let time = setup.scales.stokes_time;
    (!setup.dry && time.is_finite() && time > 0.0).then_some(time)
}

/// Density of what surrounds the particles (kg/m^3).
fn fluid_density(setup: &Setup) -> f64 {
    if setup.dry { 0.0 } else { setup.units.density }
}

/// The row of the time series, on rank 0; `contacts` are those this rank is responsible for. Collective.
///
/// The mean velocity of the fluid is over all cells, those in particles included, where it is that of the particle: so the
/// momentum of what is really there is
///
/// ```text
/// rho V <u> + sum (m - rho V_p) v
/// ```
///
/// Every rank adds up its own particles and contacts; nothing of a single one travels.
pub(super) fn row<T: Real>(
    setup: &Setup,
    simulation: &Simulation<T>,
    contacts: &[ContactState],
) -> Option<SeriesRow> {
    let Setup { units, scales, .. } = setup;
    let own = simulation.dem.particles().owned();
    let on_walls = contacts.iter().filter(|contact| contact.wall().is_some());
    let terms: Vec<[f64; SUMS]> = (own.iter().map(|p| of_particle(setup, p)))
        .chain(on_walls.map(of_wall_contact))
        .collect();
    let summary = simulation.dem.contacts();
    let mean = simulation.mean_flow();
    let fastest = own.iter().map(|p| p.velocity().norm()).fold(0.0, f64::max);
    let Reduced {
        sums,
        counts: [particles, contacts],
        most: [max_particle_speed, depth, max_lattice_speed],
    } = reduce(
        &simulation.comm,
        &terms,
        [own.len(), summary.count],
        [fastest, summary.max_depth, mean.max_lattice_speed],
    );
    if simulation.comm.rank() > 0 {
        return None;
    }
    let [
        vx,
        vy,
        vz,
        speed,
        px,
        py,
        pz,
        translation,
        rotation,
        gravitational,
        fx,
        fy,
        fz,
    ] = sums;
    let time = simulation.step as f64 * units.dt;
    let count = particles.max(1) as f64;
    let mean_velocity = Vec3::new(vx, vy, vz) / count;
    let over_stokes = settling_direction(setup).map_or(0.0, |down| {
        (mean_velocity - mean.velocity).dot(&down) / scales.stokes_velocity
    });
    let fluid_mass = fluid_density(setup) * simulation.fluid_volume();
    Some(SeriesRow {
        step: simulation.step,
        time,
        t_star: stokes_time(setup).map_or(0.0, |unit| time / unit),
        settling_velocity: over_stokes,
        mean_particle_velocity: mean_velocity.into(),
        mean_particle_speed: speed / count,
        max_particle_speed,
        net_flux: mean.velocity.into(),
        contacts: contacts as usize,
        max_overlap: depth / scales.diameter,
        kinetic_energy_fluid: mean.kinetic_energy,
        kinetic_energy_translation: translation,
        kinetic_energy_rotation: rotation,
        momentum: (Vec3::new(px, py, pz) + fluid_mass * mean.velocity).into(),
        wall_force: [fx, fy, fz],
        gravitational_energy: gravitational,
        max_mach: 3.0_f64.sqrt() * max_lattice_speed,
    })
}

/// What a row adds up: velocity (3), speed, momentum less that of the displaced fluid (3), kinetic energy of translation and of
/// rotation, gravitational energy, force on walls (3).
const SUMS: usize = 13;

/// What a particle contributes to each sum.
fn of_particle(setup: &Setup, particle: &Particle) -> [f64; SUMS] {
    let template = &setup.templates[particle.template as usize];
    let velocity = particle.velocity();
    let excess = (template.density - fluid_density(setup)) * template.shape.volume();
    let spin = particle.orientation().inverse() * particle.angular_velocity();
    // Where the box is periodic a height means nothing.
    let fall = Vec3::from_fn(|axis, _| {
        let closed = !setup.domain.periodic[axis];
        if closed { setup.gravity[axis] } else { 0.0 }
    });
    let [vx, vy, vz] = velocity.into();
    let [px, py, pz] = (excess * velocity).into();
    let translation = 0.5 * template.mass() * velocity.norm_squared();
    let rotation = 0.5 * template.inertia().component_mul(&spin).dot(&spin);
    let gravitational = -excess * particle.position().dot(&fall);
    let speed = velocity.norm();
    [
        vx,
        vy,
        vz,
        speed,
        px,
        py,
        pz,
        translation,
        rotation,
        gravitational,
        0.0,
        0.0,
        0.0,
    ]
}

/// What a contact with a wall contributes to each sum.
fn of_wall_contact(contact: &ContactState) -> [f64; SUMS] {
    let [x, y, z] = contact.force.map(|f| -f);
    [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, x, y, z]
}

/// Numbers of all ranks.
#[derive(Debug, PartialEq)]
struct Reduced<const N: usize, const C: usize, const M: usize> {
    /// Sums of the columns of all terms.
    sums: [f64; N],
    /// Sums.
    counts: [i64; C],
    /// Maxima.
    most: [f64; M],
}

/// Adds up columns and counts over all ranks and takes maxima, with one message of each kind. Collective.
fn reduce<const N: usize, const C: usize, const M: usize>(
    comm: &Comm,
    terms: &[[f64; N]],
    counts: [usize; C],
    most: [f64; M],
) -> Reduced<N, C, M> {
    let mut largest = vec![0.0; N];
    for term in terms {
        for (largest, &x) in largest.iter_mut().zip(term) {
            *largest = f64::max(*largest, magnitude(x));
        }
    }
    largest.extend(most);
    comm.max(&mut largest);
    let mut sums: [ReproducibleSum; N] = std::array::from_fn(|column| ReproducibleSum::new(largest[column]));
    for term in terms {
        for (sum, &x) in sums.iter_mut().zip(term) {
            sum.add(x);
        }
    }
    let mut words: Vec<i64> = (sums.iter().flat_map(|sum| split_wide(sum.total())))
        .chain(counts.map(|count| count as i64))
        .collect();
    comm.sum(&mut words);
    Reduced {
        sums: std::array::from_fn(|i| sums[i].value(join_wide([words[2 * i], words[2 * i + 1]]))),
        counts: std::array::from_fn(|i| words[2 * N + i]),
        most: std::array::from_fn(|i| largest[N + i]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::on_threads;

    #[test]
    fn one_to_five_ranks_find_the_same_bits_whoever_has_which_term() {
        let terms: Vec<[f64; 2]> = (0..97_u32)
            .map(|i| {
                let x = f64::from(i) - 40.3;
                [1e-9 * x * x * x, 1e12 / x]
            })
            .collect();
        let reduced = |ranks: usize, turn: usize| {
            let mut all = on_threads(ranks, |comm| {
                let mine = (comm.rank() + turn) % ranks;
                let own: Vec<_> = terms.iter().copied().skip(mine).step_by(ranks).collect();
                let last = own.last().map_or(0.0, |term| term[0]);
                reduce(&comm, &own, [own.len()], [last])
            });
            let first = all.swap_remove(0);
            assert!(all.iter().all(|other| *other == first));
            first
        };
        let alone = reduced(1, 0);
        assert_eq!(alone.counts, [97]);
        let plain = terms.iter().map(|term| term[0]).sum::<f64>();
        assert!(
            (alone.sums[0] / plain - 1.0).abs() < 1e-14,
            "{} {plain}",
            alone.sums[0]
        );
        for (ranks, turn) in [(2, 0), (2, 1), (3, 2), (5, 1)] {
            assert_eq!(reduced(ranks, turn), alone);
        }
    }

    #[test]
    fn a_sum_with_a_term_that_is_no_number_is_none_on_every_rank() {
        let sums = on_threads(3, |comm| {
            let term = if comm.rank() == 1 { f64::NAN } else { 1.0 };
            reduce(&comm, &[[term, 2.0]], [], []).sums
        });
        assert!(
            sums.iter()
                .all(|sums| sums[0].is_nan() && (sums[1] - 6.0).abs() < 1e-15)
        );
    }
}
