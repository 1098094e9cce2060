//! What a run writes on the way: rows, fields, particles, pictures, and the summary at the end.
//!
//! All ranks take part; rank 0 gathers and writes. A failure to write on rank 0 ends the run on every rank.

use super::references::references;
use super::{Simulation, Wet};
use crate::case::Setup;
use crate::comm::Comm;
use crate::domain::Decomposition;
use crate::error::{Error, Result};
use crate::fluid::{Precision, Real, Simd};
use crate::math::Vec3;
use crate::output::picture::{SettlingPlot, VelocitySlice, write_settling, write_slice};
use crate::output::progress::Workload;
use crate::output::{
    Collection, FieldSnapshot, OutputFiles, Progress, ReferenceScales, SeriesRow, SeriesWriter, Summary,
    estimate_mean, write_fields, write_particles,
};
use crate::particle::Particle;
use std::collections::BTreeMap;
use std::time::Instant;

/// Gathers and writes what the output plan asks for.
pub(super) struct Observer<'a> {
    setup: &'a Setup,
    decomposition: &'a Decomposition,
    start: Instant,
    /// Steps at which rows, fields, particles and pictures were written last.
    done: [Option<u64>; 4],
    /// Only on rank 0.
    writer: Option<Writer<'a>>,
}

/// What rank 0 keeps open.
struct Writer<'a> {
    setup: &'a Setup,
    files: OutputFiles,
    series: Option<SeriesWriter>,
    fields: Collection,
    particles: Collection,
    progress: Progress,
    t_star: Vec<f64>,
    settling: Vec<f64>,
    steps: Vec<u64>,
}

/// Fields of a block or of the box, SI units.
#[derive(Default)]
struct Fields {
    velocity: Vec<[f32; 3]>,
    pressure: Vec<f32>,
    solid_fraction: Vec<f32>,
}

const ROWS: usize = 0;
const FIELDS: usize = 1;
const PARTICLES: usize = 2;
const PICTURES: usize = 3;

impl<'a> Observer<'a> {
    pub(super) fn new(setup: &'a Setup, decomposition: &'a Decomposition, comm: &Comm, quiet: bool) -> Self {
        let writer = (comm.rank() == 0).then(|| {
            let files = OutputFiles::new(&setup.output.directory);
            let t_star_per_step = setup.units.dt / setup.scales.stokes_time;
            let work = Workload {
                steps: setup.end_step,
                cells: setup.domain.cell_count(),
                t_star_per_step,
            };
            Writer {
                setup,
                series: None,
                fields: Collection::new(files.fields_collection()),
                particles: Collection::new(files.particles_collection()),
                progress: Progress::new(work, quiet),
                files,
                t_star: Vec::new(),
                settling: Vec::new(),
                steps: Vec::new(),
            }
        });
        Self {
            setup,
            decomposition,
            start: Instant::now(),
            done: [None; 4],
            writer,
        }
    }

    /// Writes what is due after the current step; `last` makes everything due that is wanted at all. Collective.
    pub(super) fn observe<T: Real>(&mut self, simulation: &mut Simulation<T>, last: bool) -> Result<()> {
        let step = simulation.step;
        if let Some(writer) = &mut self.writer {
            writer.progress.update(step);
        }
        let plan = &self.setup.output;
        let every = [
            plan.series_every,
            plan.fields_every,
            plan.particles_every,
            plan.picture_every,
        ];
        let due: [bool; 4] = std::array::from_fn(|i| {
            // There is nothing to see of a fluid at rest.
            let shows = i != PICTURES || step > 0;
            every[i] > 0 && (last || step.is_multiple_of(every[i])) && self.done[i] != Some(step) && shows
        });
        if due == [false; 4] {
            return Ok(());
        }
        let start = Instant::now();
        let particles = gather_particles(simulation);
        let mut row = due[ROWS].then(|| self.row(simulation, &particles));
        let fields = (due[FIELDS] || due[PICTURES]).then(|| gather_fields(simulation, self.decomposition));
        let mut failed = None;
        if let Some(writer) = &mut self.writer {
            failed = writer
                .write(step, row.take().flatten(), fields.as_ref(), &particles, due)
                .err();
        }
        for (done, _) in self.done.iter_mut().zip(due).filter(|(_, due)| *due) {
            *done = Some(step);
        }
        simulation.timings.add("observe", start.elapsed().as_secs_f64());
        let mut failures = [i64::from(failed.is_some())];
        simulation.comm.sum(&mut failures);
        match failed {
            Some(error) => Err(error),
            None if failures[0] > 0 => Err(Error::OtherRank),
            None => Ok(()),
        }
    }

    /// The row of the time series, on rank 0. Collective.
    fn row<T: Real>(&self, simulation: &Simulation<T>, particles: &[Particle]) -> Option<SeriesRow> {
        let contacts = simulation.dem.contacts();
        let mut counts = [contacts.count as i64];
        simulation.comm.sum(&mut counts);
        let mut depth = [contacts.max_depth];
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
        } = self.setup;
        let mean = simulation.mean_flow();
        let time = simulation.step as f64 * units.dt;
        let count = particles.len().max(1) as f64;
        let mass = |p: &Particle| templates[p.template as usize].mass();
        let speeds = || particles.iter().map(|p| p.velocity().norm());
        let mean_velocity = particles.iter().map(Particle::velocity).sum::<Vec3>() / count;
        let down = gravity.try_normalize(0.0).unwrap_or_default();
        let momentum = particles.iter().map(|p| mass(p) * p.velocity()).sum::<Vec3>()
            + units.density * domain.volume() * mean.velocity;
        let over_stokes = if particles.is_empty() || scales.stokes_velocity <= 0.0 {
            0.0
        } else {
            (mean_velocity - mean.velocity).dot(&down) / scales.stokes_velocity
        };
        Some(SeriesRow {
            step: simulation.step,
            time,
            t_star: time / scales.stokes_time,
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
            kinetic_energy_rotation: particles
                .iter()
                .map(|p| 0.5 * Vec3::from(p.angular_momentum).dot(&p.angular_velocity()))
                .sum(),
            momentum: momentum.into(),
        })
    }

    /// Averages, the plot and the summary, on rank 0. Collective.
    pub(super) fn finish<T: Real>(
        mut self,
        simulation: &mut Simulation<T>,
        interrupted: bool,
    ) -> Result<Option<Summary>> {
        let hash = simulation.state_hash();
        let Some(writer) = self.writer.take() else {
            return Ok(None);
        };
        writer
            .finish(simulation, hash, interrupted, self.start.elapsed().as_secs_f64())
            .map(Some)
    }
}

impl Writer<'_> {
    fn write(
        &mut self,
        step: u64,
        row: Option<SeriesRow>,
        fields: Option<&Fields>,
        particles: &[Particle],
        due: [bool; 4],
    ) -> Result<()> {
        let setup = self.setup;
        let time = step as f64 * setup.units.dt;
        if let Some(row) = row {
            if self.series.is_none() {
                self.series = Some(SeriesWriter::create(&self.files.series())?);
            }
            if let Some(series) = &mut self.series {
                series.write(&row)?;
            }
            self.t_star.push(row.t_star);
            self.settling.push(row.settling_velocity);
            self.steps.push(step);
        }
        if let (true, Some(fields)) = (due[FIELDS], fields) {
            let path = self.files.fields(step);
            write_fields(
                &path,
                &FieldSnapshot {
                    domain: setup.domain,
                    time,
                    velocity: &fields.velocity,
                    pressure: &fields.pressure,
                    solid_fraction: &fields.solid_fraction,
                },
            )?;
            self.fields.add(time, &path)?;
        }
        if due[PARTICLES] {
            let path = self.files.particles(step);
            write_particles(&path, &setup.domain, &setup.templates, particles)?;
            self.particles.add(time, &path)?;
        }
        if let (true, Some(fields)) = (due[PICTURES], fields) {
            write_slice(
                &self.files.picture(step),
                &VelocitySlice {
                    case: &setup.name,
                    t_star: time / setup.scales.stokes_time,
                    domain: setup.domain,
                    velocity: &fields.velocity,
                    templates: &setup.templates,
                    particles,
                    gravity: setup.gravity,
                    largest_speed: None,
                },
            )?;
        }
        Ok(())
    }

    fn finish<T: Real>(
        mut self,
        simulation: &mut Simulation<T>,
        hash: u64,
        interrupted: bool,
        wall_seconds: f64,
    ) -> Result<Summary> {
        let setup = self.setup;
        let steps = simulation.step;
        let first = self.steps.partition_point(|&step| step < setup.average_from_step);
        let settles = setup.scales.stokes_velocity > 0.0 && !setup.particles.is_empty();
        let estimate = settles.then(|| estimate_mean(&self.settling[first..])).flatten();
        let drift = estimate.and_then(|e| drift(&self.settling[first..], e.mean));
        let averaged_over = estimate.map(|_| [self.t_star[first], self.t_star[self.t_star.len() - 1]]);
        if settles && !self.settling.is_empty() {
            let references = references(&setup.scales);
            write_settling(
                &self.files.settling_plot(),
                &SettlingPlot {
                    case: &setup.name,
                    t_star: &self.t_star,
                    velocity: &self.settling,
                    mean: averaged_over.zip(estimate),
                    references: &references,
                },
            )?;
        }
        let scales = setup.scales;
        let over_schiller_naumann = scales.stokes_velocity / scales.schiller_naumann_velocity;
        let per_step = |seconds: f64| seconds / steps.max(1) as f64;
        let stages: BTreeMap<String, f64> = simulation
            .timings
            .stages()
            .iter()
            .map(|&(name, seconds)| (name.to_owned(), per_step(seconds)))
            .collect();
        let cells = setup.domain.cell_count();
        let summary = Summary {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            case: setup.name.clone(),
            interrupted,
            settling_velocity_over_stokes: estimate.map(|e| e.mean),
            settling_velocity_over_schiller_naumann: estimate.map(|e| e.mean * over_schiller_naumann),
            standard_error: estimate.and_then(|e| e.standard_error),
            drift,
            averaged_over,
            particles: setup.particles.len(),
            volume_fraction: scales.volume_fraction,
            scales: ReferenceScales {
                diameter: scales.diameter,
                viscosity: scales.viscosity,
                density_ratio: scales.density_ratio,
                archimedes: scales.archimedes,
                galileo: scales.archimedes.sqrt(),
                stokes_velocity: scales.stokes_velocity,
                stokes_time: scales.stokes_time,
                schiller_naumann_velocity: scales.schiller_naumann_velocity,
                schiller_naumann_reynolds: scales.schiller_naumann_reynolds,
            },
            cells,
            steps,
            dx: setup.domain.dx,
            time_step: setup.units.dt,
            relaxation_time: setup.relaxation_time,
            mlups: steps as f64 * cells as f64 / wall_seconds / 1e6,
            wall_seconds,
            stages,
            precision: precision_name(setup.precision).to_owned(),
            simd: setup.simd.unwrap_or_else(Simd::best).name().to_owned(),
            ranks: simulation.comm.size(),
            threads: simulation.comm.size(),
            state_hash: format!("{hash:016x}"),
            input: setup.text.clone(),
        };
        summary.write(&self.files.summary())?;
        self.progress.finish(steps);
        Ok(summary)
    }
}

/// Difference of the means of the second and the first half of a series, over its mean; `None` for too few values.
fn drift(series: &[f64], mean: f64) -> Option<f64> {
    let (early, late) = series.split_at(series.len() / 2);
    let of = |half: &[f64]| half.iter().sum::<f64>() / half.len() as f64;
    (series.len() >= 4 && mean != 0.0).then(|| (of(late) - of(early)) / mean)
}

pub(super) fn precision_name(precision: Precision) -> &'static str {
    match precision {
        Precision::F32 => "f32",
        Precision::F64 => "f64",
    }
}

/// All particles in ascending order of id, on rank 0; none elsewhere. Collective.
fn gather_particles<T: Real>(simulation: &Simulation<T>) -> Vec<Particle> {
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

/// Fields of the whole box on rank 0, with the particles where they are now; empty elsewhere. Collective.
fn gather_fields<T: Real>(simulation: &mut Simulation<T>, decomposition: &Decomposition) -> Fields {
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
