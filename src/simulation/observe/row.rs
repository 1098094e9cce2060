//! One row of the time series.

use super::gather;
use crate::case::Setup;
use crate::comm::Comm;
use crate::dem::ContactState;
use crate::math::{ReproducibleSum, Vec3, join_wide, magnitude, split_wide};
use crate::output::SeriesRow;
use crate::output::series::{DRAG, LOADS};
use crate::output::walls::area;
use crate::particle::Particle;
use crate::simulation::{Measurement, Simulation};
use crate::wall::{Surface, Wall};

/// Direction of the [weight less buoyancy](Setup::submerged_weight) of all particles, in which they settle as a whole. `None` if
/// nothing settles.
pub(in crate::simulation) fn settling_direction(setup: &Setup) -> Option<Vec3> {
    let speed = stokes_velocity(setup);
    (speed > 0.0 && speed.is_finite()).then(|| setup.submerged_weight().try_normalize(0.0)).flatten()
}

/// Returns true if a settling velocity can become steady: the box has no end in its direction.
pub(in crate::simulation) fn settles_for_ever(setup: &Setup) -> bool {
    settling_direction(setup)
        .is_some_and(|down| (0..3).all(|axis| setup.domain.periodic[axis] || down[axis] == 0.0))
}

/// Stokes velocity (m/s); 0 without a fluid.
fn stokes_velocity(setup: &Setup) -> f64 {
    (setup.fluid.as_ref()).map_or(0.0, |fluid| fluid.scales.stokes_velocity)
}

/// The row of the time series, on rank 0; `contacts` are those this rank is responsible for. Collective.
///
/// The mean velocity `<u>` is over all cells, those in particles included, so the momentum is
///
/// ```text
/// rho V <u> + sum (m - rho V_p) v
/// ```
///
/// Before the first step no body has moved the fluid: there `<u>` is that of the flow at the start, which also fills the bodies,
/// and its momentum in them is part of theirs, `sum m v - rho V_p u`.
pub(super) fn row(
    setup: &Setup,
    simulation: &Simulation,
    measured: &Measurement,
    contacts: &[ContactState],
) -> Option<SeriesRow> {
    let own = simulation.dem.particles().owned();
    let known = gather::partners(simulation, contacts);
    let mut terms = Vec::new();
    let start = (simulation.step == 0).then(|| setup.flow_at_start());
    for particle in own {
        of_particle(setup, particle, start.as_ref(), &mut terms);
    }
    for contact in contacts {
        of_contact(setup, &known, contact, &mut terms);
    }
    let on_sections = ON_WALLS + 3 * setup.walls.len();
    of_loads(setup, simulation, on_sections, &mut terms);
    let summary = simulation.dem.contacts();
    let mean = measured.mean;
    let fastest = own.iter().map(|p| p.velocity().norm()).fold(0.0, f64::max);
    let (sums, [particles, contacts], [max_particle_speed, depth, max_lattice_speed]) = reduce(
        &simulation.comm,
        on_sections + LOADS.len() * 3 * setup.prescribed_sections().len(),
        &terms,
        [own.len(), summary.count],
        [fastest, summary.max_depth, mean.max_lattice_speed],
    );
    let by_fluid = simulation.wall_loads();
    if simulation.comm.rank() > 0 {
        return None;
    }
    let vector = |first: usize| Vec3::from_column_slice(&sums[first..first + 3]);
    let time = simulation.step as f64 * setup.time_step;
    let count = particles.max(1) as f64;
    let mean_velocity = vector(VELOCITY) / count;
    let over_stokes = settling_direction(setup)
        .map_or(0.0, |down| (mean_velocity - mean.velocity).dot(&down) / stokes_velocity(setup));
    let fluid_mass = setup.fluid_density() * simulation.fluid_volume();
    let volume = match setup.fluid {
        Some(_) => simulation.fluid_volume(),
        None => setup.domain.volume(),
    };
    let moving = start.map_or(mean.velocity, |flow| flow(0.5 * setup.domain.size()));
    let walls = setup.walls.iter().zip(by_fluid).enumerate();
    let tells = simulation.dem.tells_contacts();
    let by_contacts = |x: f64| if tells { x } else { f64::NAN };
    Some(SeriesRow {
        step: simulation.step,
        time,
        t_star: setup.stokes_time().map_or(0.0, |unit| time / unit),
        settling_velocity: over_stokes,
        mean_particle_velocity: mean_velocity.into(),
        mean_particle_speed: sums[SPEED] / count,
        max_particle_speed,
        net_flux: mean.velocity.into(),
        contacts: contacts as usize,
        max_overlap: depth / setup.diameter,
        kinetic_energy_fluid: mean.kinetic_energy,
        kinetic_energy_translation: sums[TRANSLATION],
        kinetic_energy_rotation: sums[ROTATION],
        momentum: (vector(MOMENTUM) + fluid_mass * moving).into(),
        wall_force: vector(WALL_FORCE).map(by_contacts).into(),
        gravitational_energy: sums[GRAVITATION],
        max_mach: 3.0_f64.sqrt() * max_lattice_speed,
        contact_stress: std::array::from_fn(|i| by_contacts(sums[CONTACT_STRESS + i] / volume)),
        hydrodynamic_stress: measured.stresslet.map(|sum| sum / volume),
        walls: walls
            .flat_map(|(n, (wall, load))| {
                // Before the first step there was none to measure in.
                let fluid = if simulation.step > 0 { load.force } else { Vec3::zeros() };
                let contacts = vector(ON_WALLS + 3 * n).map(by_contacts);
                let stress = shear_stress(setup, wall, fluid + contacts);
                [Some(fluid), Some(contacts), stress].into_iter().flatten()
            })
            .flat_map(<[f64; 3]>::from)
            .collect(),
        prescribed: sums[on_sections..].to_vec(),
    })
}

/// Stress along a wall under a force (Pa), if it is a plane that has a part in the box.
fn shear_stress(setup: &Setup, wall: &Wall, force: Vec3) -> Option<Vec3> {
    let Surface::Plane { normal, .. } = wall.surface else {
        return None;
    };
    let area = area(&wall.surface, &setup.domain.size());
    Some((force - normal * force.dot(&normal)) / area)
}

// Sums of a row: vectors of three, the stress by contacts six.
const VELOCITY: usize = 0;
const SPEED: usize = 3;
/// Momentum minus that of the displaced fluid.
const MOMENTUM: usize = 4;
const TRANSLATION: usize = 7;
const ROTATION: usize = 8;
const GRAVITATION: usize = 9;
const WALL_FORCE: usize = 10;
/// Times the volume of the box.
const CONTACT_STRESS: usize = 13;
/// Forces of contacts on each wall.
const ON_WALLS: usize = 19;

/// Column of a sum, and a number to add.
type Term = (usize, f64);

fn put(terms: &mut Vec<Term>, first: usize, values: &[f64]) {
    terms.extend((first..).zip(values.iter().copied()));
}

/// Terms of a particle; `start` is the flow (m/s) round bodies that have not moved the fluid yet.
fn of_particle(
    setup: &Setup,
    particle: &Particle,
    start: Option<&impl Fn(Vec3) -> Vec3>,
    terms: &mut Vec<Term>,
) {
    let template = &setup.templates[particle.template as usize];
    let velocity = particle.velocity();
    let excess = (template.density - setup.fluid_density()) * template.shape.volume();
    let spin = particle.orientation().inverse() * particle.angular_velocity();
    // Where the box is periodic a height means nothing.
    let fall = Vec3::from_fn(|axis, _| {
        let closed = !setup.domain.periodic[axis];
        if closed { setup.gravity[axis] } else { 0.0 }
    });
    let translation = 0.5 * template.mass() * velocity.norm_squared();
    let rotation = 0.5 * template.inertia().component_mul(&spin).dot(&spin);
    put(terms, VELOCITY, velocity.as_slice());
    let momentum = start.map_or(excess * velocity, |flow| {
        template.mass() * velocity - (template.mass() - excess) * flow(particle.position())
    });
    put(terms, MOMENTUM, momentum.as_slice());
    terms.extend([
        (SPEED, velocity.norm()),
        (TRANSLATION, translation),
        (ROTATION, rotation),
        (GRAVITATION, -excess * particle.position().dot(&fall)),
    ]);
}

/// Terms of the loads on bodies with prescribed motion, by their section and in the order of [`LOADS`], from column `first` on.
fn of_loads(setup: &Setup, simulation: &Simulation, first: usize, terms: &mut Vec<Term>) {
    let sections = setup.prescribed_sections();
    if sections.is_empty() {
        return;
    }
    let mut add = |template: u64, load: usize, values: &[[f64; 3]]| {
        if let Ok(index) = sections.binary_search(&setup.sections[template as usize]) {
            put(terms, first + 3 * (LOADS.len() * index + load), values.as_flattened());
        }
    };
    for (id, load) in simulation.loads() {
        let at = setup.particles.binary_search_by_key(&id, |particle| particle.id);
        let particle = &setup.particles[at.expect("a particle of the case")];
        let displaced = setup.fluid_density() * setup.templates[particle.template as usize].shape.volume();
        add(particle.template, 0, &[load.force.into(), load.torque.into()]);
        add(particle.template, DRAG, &[(load.force + displaced * setup.gravity).into()]);
    }
    for particle in simulation.particles() {
        add(particle.template, 2, &[particle.contact_force, particle.contact_torque]);
    }
}

/// Terms of a contact; `known` has its particles, ascending by id.
fn of_contact(setup: &Setup, known: &[Particle], contact: &ContactState, terms: &mut Vec<Term>) {
    let centre = |id: u64| {
        let found = known.binary_search_by_key(&id, |particle| particle.id);
        known[found.expect("the particles of all contacts are known")].position()
    };
    let force = Vec3::from(contact.force);
    let from = match contact.wall() {
        None => centre(contact.second),
        Some(wall) => {
            put(terms, WALL_FORCE, (-force).as_slice());
            put(terms, ON_WALLS + 3 * wall, (-force).as_slice());
            contact.point.into()
        }
    };
    let branch = setup.domain.nearest_image(centre(contact.first) - from);
    let moment = -0.5 * (branch * force.transpose() + force * branch.transpose());
    let pairs = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];
    put(terms, CONTACT_STRESS, &pairs.map(|(i, j)| moment[(i, j)]));
}

/// Over all ranks the sums of the terms by column, the sums of the counts and the maxima, with one message of each kind.
/// Collective.
fn reduce<const C: usize, const M: usize>(
    comm: &Comm,
    columns: usize,
    terms: &[Term],
    counts: [usize; C],
    most: [f64; M],
) -> (Vec<f64>, [i64; C], [f64; M]) {
    let mut largest = vec![0.0; columns];
    for &(column, x) in terms {
        largest[column] = f64::max(largest[column], magnitude(x));
    }
    largest.extend(most);
    comm.max(&mut largest);
    let mut sums: Vec<ReproducibleSum> =
        (largest[..columns].iter()).map(|&x| ReproducibleSum::new(x)).collect();
    for &(column, x) in terms {
        sums[column].add(x);
    }
    let mut words: Vec<i64> = (sums.iter().flat_map(|sum| split_wide(sum.total())))
        .chain(counts.map(|count| count as i64))
        .collect();
    comm.sum(&mut words);
    let total = |i: usize| join_wide([words[2 * i], words[2 * i + 1]]);
    (
        sums.iter().enumerate().map(|(i, sum)| sum.value(total(i))).collect(),
        std::array::from_fn(|i| words[2 * columns + i]),
        std::array::from_fn(|i| largest[columns + i]),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::on_threads;

    #[test]
    fn one_to_five_ranks_find_the_same_bits_whoever_has_which_term() {
        let terms: Vec<[Term; 2]> = (0..97_u32)
            .map(|i| {
                let x = f64::from(i) - 40.3;
                [(0, 1e-9 * x * x * x), (1, 1e12 / x)]
            })
            .collect();
        let reduced = |ranks: usize, turn: usize| {
            let mut all = on_threads(ranks, |comm| {
                let mine = (comm.rank() + turn) % ranks;
                let own: Vec<_> = terms.iter().copied().skip(mine).step_by(ranks).collect();
                let last = own.last().map_or(0.0, |term| term[0].1);
                reduce(&comm, 2, &own.concat(), [own.len()], [last])
            });
            let first = all.swap_remove(0);
            assert!(all.iter().all(|other| *other == first));
            first
        };
        let alone = reduced(1, 0);
        assert_eq!(alone.1, [97]);
        let plain = terms.iter().map(|term| term[0].1).sum::<f64>();
        assert!((alone.0[0] / plain - 1.0).abs() < 1e-14, "{} {plain}", alone.0[0]);
        for (ranks, turn) in [(2, 0), (2, 1), (3, 2), (5, 1)] {
            assert_eq!(reduced(ranks, turn), alone);
        }
    }

    #[test]
    fn a_sum_with_a_term_that_is_no_number_is_none_on_every_rank() {
        let sums = on_threads(3, |comm| {
            let term = if comm.rank() == 1 { f64::NAN } else { 1.0 };
            reduce(&comm, 2, &[(0, term), (1, 2.0)], [], []).0
        });
        assert!(sums.iter().all(|sums| sums[0].is_nan() && (sums[1] - 6.0).abs() < 1e-15));
    }
}
