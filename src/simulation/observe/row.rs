//! One row of the time series.

use super::gather;
use super::sums::{Sums, Totals};
use crate::case::Setup;
use crate::dem::{ContactState, Load};
use crate::math::Vec3;
use crate::output::SeriesRow;
use crate::output::series::{DRAG, LOADS};
use crate::output::walls::area;
use crate::particle::Particle;
use crate::simulation::writers::RankState;
use crate::simulation::{Measurement, Simulation};
use crate::wall::{Surface, Wall};

/// Pairs of axes of a symmetric tensor.
pub(in crate::simulation) const PAIRS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];

/// Direction of the [weight less buoyancy](Setup::submerged_weight) of all particles, in which they settle as a whole. `None` if
/// nothing settles.
pub(in crate::simulation) fn settling_direction(setup: &Setup) -> Option<Vec3> {
    let speed = stokes_velocity(setup);
    (speed > 0.0 && speed.is_finite()).then(|| setup.submerged_weight().try_normalize(0.0)).flatten()
}

/// Returns true if a settling velocity can become steady: the box has no end in its direction.
pub(in crate::simulation) fn settles_for_ever(setup: &Setup) -> bool {
    settling_direction(setup)
        .is_some_and(|down| (0..3).all(|axis| setup.domain.is_periodic(axis) || down[axis] == 0.0))
}

/// Stokes velocity (m/s); 0 without a fluid.
fn stokes_velocity(setup: &Setup) -> f64 {
    (setup.fluid.as_ref()).map_or(0.0, |fluid| fluid.scales.stokes_velocity)
}

/// Contribution of this rank to the row of the time series, which [`row`] makes of the totals. Collective.
///
/// The mean velocity `<u>` is over all cells, those in particles included, so the momentum is
///
/// ```text
/// rho V <u> + sum (m - rho V_p) v
/// ```
///
/// Before the first step no body has moved the fluid: there `<u>` is that of the flow at the start, which also fills the bodies,
/// and its momentum in them is part of theirs, `sum m v - rho V_p u`.
pub(super) fn sums(setup: &Setup, rank: &RankState, measured: &Measurement) -> Sums {
    let (simulation, contacts) = (rank.simulation(), rank.contacts());
    let on_sections = ON_WALLS + 6 * setup.walls.len();
    let mut sums = Sums::new(on_sections + LOADS.len() * 3 * setup.prescribed_sections().len(), 0, 3);
    let known = gather::partners(simulation, contacts);
    let start = (simulation.step == 0).then(|| setup.flow_at_start());
    for particle in simulation.particles() {
        of_particle(setup, particle, start.as_ref(), &mut sums);
        sums.raise(MAX_SPEED, particle.velocity().norm());
    }
    for contact in contacts {
        of_contact(setup, &known, contact, &mut sums);
    }
    of_loads(setup, simulation, on_sections, &mut sums);
    let summary = simulation.dem.contacts();
    sums.add(COUNTS, &[simulation.particles().len() as f64, summary.count as f64]);
    sums.raise(MAX_DEPTH, summary.max_depth);
    sums.raise(MAX_LATTICE_SPEED, measured.mean.max_lattice_speed);
    sums
}

/// The row of the time series from the totals of all [`sums`], on rank 0. Collective.
pub(super) fn row(
    setup: &Setup,
    simulation: &Simulation,
    measured: &Measurement,
    Totals { sums, maxima, .. }: &Totals,
) -> Option<SeriesRow> {
    let (by_fluid, mass_flows): (Vec<Load>, Vec<f64>) = simulation.wall_exchange().into_iter().unzip();
    if simulation.comm.rank() > 0 {
        return None;
    }
    let mean = measured.mean;
    let vector = |first: usize| Vec3::from_column_slice(&sums[first..first + 3]);
    let time = simulation.step as f64 * setup.time_step;
    let count = sums[COUNTS].max(1.0);
    let mean_velocity = vector(VELOCITY) / count;
    let over_stokes = settling_direction(setup)
        .map_or(0.0, |down| (mean_velocity - mean.velocity).dot(&down) / stokes_velocity(setup));
    let fluid_mass = setup.fluid_density() * simulation.fluid_volume();
    let volume = match setup.fluid {
        Some(_) => simulation.fluid_volume(),
        None => setup.domain.volume(),
    };
    // Before the first step no body has moved the fluid.
    let moving = if simulation.step == 0 { setup.mean_flow_at_start() } else { mean.velocity };
    let walls = setup.walls.iter().zip(by_fluid).enumerate();
    let tells = simulation.dem.tells_contacts();
    Some(SeriesRow {
        step: simulation.step,
        time,
        t_star: setup.stokes_time().map_or(0.0, |unit| time / unit),
        settling_velocity: over_stokes,
        mean_particle_velocity: mean_velocity.into(),
        mean_particle_speed: sums[SPEED] / count,
        max_particle_speed: maxima[MAX_SPEED],
        net_flux: mean.velocity.into(),
        contacts: sums[COUNTS + 1] as usize,
        max_overlap: maxima[MAX_DEPTH] / setup.diameter,
        kinetic_energy_fluid: mean.kinetic_energy,
        kinetic_energy_translation: sums[TRANSLATION],
        kinetic_energy_rotation: sums[ROTATION],
        momentum: (vector(MOMENTUM) + fluid_mass * moving).into(),
        wall_force: tells.then(|| vector(WALL_FORCE).into()),
        gravitational_energy: sums[GRAVITATION],
        max_mach: 3.0_f64.sqrt() * maxima[MAX_LATTICE_SPEED],
        contact_stress: tells.then(|| std::array::from_fn(|i| sums[CONTACT_STRESS + i] / volume)),
        hydrodynamic_stress: measured.stresslet.map(|sum| sum / volume),
        walls: walls
            .flat_map(|(n, (wall, load))| {
                // Before the first step there was none to measure in.
                let fluid = if simulation.step > 0 { load } else { Load::default() };
                let [contacts, torque] = [0, 3].map(|k| tells.then(|| vector(ON_WALLS + 6 * n + k)));
                let rest = if wall.surface.is_plane() {
                    [
                        Some(contacts.and_then(|contacts| shear_stress(setup, wall, fluid.force + contacts))),
                        None,
                    ]
                } else {
                    [Some(Some(fluid.torque)), Some(torque)]
                };
                [Some(Some(fluid.force)), Some(contacts)].into_iter().chain(rest).flatten()
            })
            .map(|known| known.map(<[f64; 3]>::from))
            .collect(),
        prescribed: sums[ON_WALLS + 6 * setup.walls.len()..].to_vec(),
        mass_flows: (setup.open_faces().iter())
            .map(|&n| if simulation.step > 0 { mass_flows[n] } else { 0.0 })
            .collect(),
        population: population(setup, simulation),
    })
}

/// Numbers and masses (kg) of the particles of each counted section that have come and gone, in the order of
/// [`POPULATION`](crate::output::series::POPULATION).
fn population(setup: &Setup, simulation: &Simulation) -> Vec<f64> {
    let changes = simulation.come_and_gone();
    let of = |section: usize| {
        let own = |counts: &[i64], each: &dyn Fn(usize) -> f64| -> f64 {
            let own = (0..counts.len()).filter(|template| setup.sections[*template] == section);
            own.map(|template| counts[template] as f64 * each(template)).fold(0.0, |sum, part| sum + part)
        };
        let one = |_| 1.0;
        let mass = |template: usize| setup.templates[template].mass();
        [own(changes[0], &one), own(changes[1], &one), own(changes[0], &mass), own(changes[1], &mass)]
    };
    setup.counted_sections().into_iter().flat_map(of).collect()
}

/// Stress along a wall under a force (Pa), if it is a plane.
fn shear_stress(setup: &Setup, wall: &Wall, force: Vec3) -> Option<Vec3> {
    let Surface::Plane { normal, .. } = &wall.surface else {
        return None;
    };
    let area = area(&wall.surface, &setup.domain.size());
    Some((force - normal * force.dot(normal)) / area)
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
/// Numbers of particles and of contacts.
const COUNTS: usize = 19;
/// Force of contacts on each wall, and torque about its pivot.
const ON_WALLS: usize = 21;
// Its maxima.
const MAX_SPEED: usize = 0;
const MAX_DEPTH: usize = 1;
const MAX_LATTICE_SPEED: usize = 2;

/// Terms of a particle; `start` is the flow (m/s) round bodies that have not moved the fluid yet.
fn of_particle(setup: &Setup, particle: &Particle, start: Option<&impl Fn(Vec3) -> Vec3>, sums: &mut Sums) {
    let template = &setup.templates[particle.template as usize];
    let velocity = particle.velocity();
    let excess = (template.density - setup.fluid_density()) * template.shape.volume();
    let spin = particle.orientation().inverse() * particle.angular_velocity();
    // Where the box is periodic a height means nothing.
    let fall = Vec3::from_fn(|axis, _| {
        let closed = !setup.domain.is_periodic(axis);
        if closed { setup.gravity[axis] } else { 0.0 }
    });
    let translation = 0.5 * template.mass() * velocity.norm_squared();
    let rotation = 0.5 * template.inertia().component_mul(&spin).dot(&spin);
    sums.add(VELOCITY, velocity.as_slice());
    let momentum = start.map_or(excess * velocity, |flow| {
        template.mass() * velocity - (template.mass() - excess) * flow(particle.position())
    });
    sums.add(MOMENTUM, momentum.as_slice());
    sums.add(SPEED, &[velocity.norm()]);
    sums.add(TRANSLATION, &[translation, rotation, -excess * particle.position().dot(&fall)]);
}

/// Terms of the loads on bodies with prescribed motion, by their section and in the order of [`LOADS`], from column `first` on.
fn of_loads(setup: &Setup, simulation: &Simulation, first: usize, sums: &mut Sums) {
    let sections = setup.prescribed_sections();
    if sections.is_empty() {
        return;
    }
    let mut add = |template: u64, load: usize, values: &[[f64; 3]]| {
        if let Ok(index) = sections.binary_search(&setup.sections[template as usize]) {
            sums.add(first + 3 * (LOADS.len() * index + load), values.as_flattened());
        }
    };
    for (particle, load) in simulation.swept() {
        let displaced = setup.fluid_density() * setup.templates[particle.template as usize].shape.volume();
        add(particle.template, 0, &[load.force.into(), load.torque.into()]);
        add(particle.template, DRAG, &[(load.force + displaced * setup.gravity).into()]);
    }
    for particle in simulation.particles() {
        add(particle.template, 2, &[particle.contact_force, particle.contact_torque]);
    }
}

/// Terms of a contact; `known` has its particles, ascending by id.
fn of_contact(setup: &Setup, known: &[Particle], contact: &ContactState, sums: &mut Sums) {
    let force = Vec3::from(contact.force);
    let from = match contact.wall() {
        None => centre(known, contact.second),
        Some(wall) => {
            sums.add(WALL_FORCE, (-force).as_slice());
            let point = Vec3::from(contact.point);
            let torque = (point - setup.walls[wall].motion.pivot).cross(&-force);
            sums.add(ON_WALLS + 6 * wall, (-force).as_slice());
            sums.add(ON_WALLS + 6 * wall + 3, torque.as_slice());
            point
        }
    };
    sums.add(CONTACT_STRESS, &moment_about(setup, contact, centre(known, contact.first) - from));
}

/// Contribution of a contact to the stress by contacts, times a volume (J): `-l F`, symmetric; `known` has its particles, ascending by id.
pub(in crate::simulation) fn branch_moment(
    setup: &Setup,
    known: &[Particle],
    contact: &ContactState,
) -> [f64; 6] {
    let from = match contact.wall() {
        None => centre(known, contact.second),
        Some(_) => Vec3::from(contact.point),
    };
    moment_about(setup, contact, centre(known, contact.first) - from)
}

/// The same of a branch that leads `way` (m) to the centre of the first body, perhaps through the box.
fn moment_about(setup: &Setup, contact: &ContactState, way: Vec3) -> [f64; 6] {
    let force = Vec3::from(contact.force);
    let nearest = setup.domain.nearest_image(way);
    let branch = setup.domain.shifted(nearest, contact.key().shift().map(|along| -along));
    let moment = -0.5 * (branch * force.transpose() + force * branch.transpose());
    PAIRS.map(|(i, j)| moment[(i, j)])
}

/// The centre of a particle of a contact (m).
fn centre(known: &[Particle], id: u64) -> Vec3 {
    let found = known.binary_search_by_key(&id, |particle| particle.id);
    known[found.expect("the particles of all contacts are known")].position()
}
