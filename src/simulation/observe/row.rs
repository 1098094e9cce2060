//! One row of the time series.

use crate::case::Setup;
use crate::fluid::Real;
use crate::math::Vec3;
use crate::output::{Contact, Partner, SeriesRow};
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

/// The row of the time series, on rank 0. Collective.
///
/// The mean velocity of the fluid is over all cells, those in particles included, where it is that of the particle: so the
/// momentum of what is really there is
///
/// ```text
/// rho V <u> + sum (m - rho V_p) v
/// ```
pub(super) fn row<T: Real>(
    setup: &Setup,
    simulation: &Simulation<T>,
    particles: &[Particle],
    contacts: Option<&[Contact]>,
) -> Option<SeriesRow> {
    let summary = simulation.dem.contacts();
    let mut counts = [summary.count as i64];
    simulation.comm.sum(&mut counts);
    let mut depth = [summary.max_depth];
    simulation.comm.max(&mut depth);
    if simulation.comm.rank() > 0 {
        return None;
    }
    let Setup {
        units,
        scales,
        gravity,
        domain,
        templates,
        ..
    } = setup;
    let mean = simulation.mean_flow();
    let time = simulation.step as f64 * units.dt;
    let count = particles.len().max(1) as f64;
    let density = fluid_density(setup);
    let mass = |p: &Particle| templates[p.template as usize].mass();
    let excess = |p: &Particle| {
        let template = &templates[p.template as usize];
        (template.density - density) * template.shape.volume()
    };
    let rotation = |p: &Particle| {
        let inertia = templates[p.template as usize].inertia();
        let spin = p.orientation().inverse() * p.angular_velocity();
        0.5 * inertia.component_mul(&spin).dot(&spin)
    };
    let speeds = || particles.iter().map(|p| p.velocity().norm());
    let mean_velocity = particles.iter().map(Particle::velocity).sum::<Vec3>() / count;
    let over_stokes = settling_direction(setup).map_or(0.0, |down| {
        (mean_velocity - mean.velocity).dot(&down) / scales.stokes_velocity
    });
    // Where the box is periodic a height means nothing.
    let fall = Vec3::from_fn(|axis, _| if domain.periodic[axis] { 0.0 } else { gravity[axis] });
    let on_walls = |contact: &&Contact| matches!(contact.second, Partner::Wall(_));
    Some(SeriesRow {
        step: simulation.step,
        time,
        t_star: stokes_time(setup).map_or(0.0, |unit| time / unit),
        settling_velocity: over_stokes,
        mean_particle_velocity: mean_velocity.into(),
        mean_particle_speed: speeds().sum::<f64>() / count,
        max_particle_speed: speeds().fold(0.0, f64::max),
        net_flux: mean.velocity.into(),
        contacts: counts[0] as usize,
        max_overlap: depth[0] / scales.diameter,
        kinetic_energy_fluid: mean.kinetic_energy,
        kinetic_energy_translation: particles
            .iter()
            .map(|p| 0.5 * mass(p) * p.velocity().norm_squared())
            .sum(),
        kinetic_energy_rotation: particles.iter().map(rotation).sum(),
        momentum: (particles.iter().map(|p| excess(p) * p.velocity()).sum::<Vec3>()
            + density * simulation.fluid_volume() * mean.velocity)
            .into(),
        wall_force: contacts
            .unwrap_or_default()
            .iter()
            .filter(on_walls)
            .map(|contact| -contact.force)
            .sum::<Vec3>()
            .into(),
        gravitational_energy: -particles
            .iter()
            .map(|p| excess(p) * p.position().dot(&fall))
            .sum::<f64>(),
        max_mach: 3.0_f64.sqrt() * mean.max_lattice_speed,
    })
}
