//! What rank 0 writes.

use super::row::{settles_for_ever, settling_direction};
use super::summary::{self, Outcome};
use super::viscosity::Plates;
use super::{CONTACTS, Due, FIELDS, Frame, KINDS, Looks, PARTICLES, PICTURES, SURFACES, pictures};
use crate::case::Setup;
use crate::domain::{Block, Decomposition};
use crate::error::{Error, Result};
use crate::output::picture::{SettlingPlot, write_settling};
use crate::output::progress::Workload;
use crate::output::{
    Collection, OutputFiles, ParticleSeries, PathsState, Progress, SeriesWriter, Summary, directory,
    estimate_mean, settled, write_contacts_index, write_fields_index, write_force_chains_index, write_walls,
};
use crate::simulation::Simulation;
use crate::simulation::references::references;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// What rank 0 keeps open.
pub(super) struct Writer<'a> {
    /// Steps done before this run, which goes on from there.
    first: u64,
    pub(super) progress: Progress,
    setup: &'a Setup,
    files: OutputFiles,
    series: Option<(SeriesWriter, ParticleSeries)>,
    fields: Collection,
    particles: Collection,
    surfaces: Collection,
    contacts: Collection,
    force_chains: Collection,
    walls_written: bool,
    /// Speed at the upper end of the colours of all pictures (m/s), once there is one.
    picture_range: Option<f64>,
    t_star: Vec<f64>,
    settling: Vec<f64>,
    steps: Vec<u64>,
    max_mach: f64,
    plates: Option<Plates>,
    /// Of the suspension over that of the fluid; nothing without plates.
    viscosity: Vec<f64>,
}

/// How far the files have come, and what the end of a run needs of its beginning.
#[derive(Serialize, Deserialize)]
pub(in crate::simulation) struct WriterState {
    /// Bytes of `series.csv`, and how far the paths have come; nothing before the first row.
    series: Option<(u64, PathsState)>,
    fields: Vec<(f64, String)>,
    particles: Vec<(f64, String)>,
    surfaces: Vec<(f64, String)>,
    contacts: Vec<(f64, String)>,
    force_chains: Vec<(f64, String)>,
    walls_written: bool,
    picture_range: Option<f64>,
    t_star: Vec<f64>,
    settling: Vec<f64>,
    steps: Vec<u64>,
    max_mach: f64,
    #[serde(default)]
    viscosity: Vec<f64>,
}

impl WriterState {
    /// Whether the tables hold the rows that they held then.
    pub(in crate::simulation) fn fits(&self, setup: &Setup) -> Result<()> {
        let files = OutputFiles::new(&setup.plan.output.directory);
        let samples = self.settling.len();
        if [self.t_star.len(), self.steps.len()] != [samples; 2] || !self.max_mach.is_finite() {
            let what = "the samples for the averages in the common state are not whole";
            return Err(Error::Input(what.to_string()));
        }
        match &self.series {
            None => Ok(()),
            Some((length, paths)) => SeriesWriter::holds(&files.series(), *length)
                .and_then(|()| ParticleSeries::holds(&files.particle_series(), paths)),
        }
    }
}

impl<'a> Writer<'a> {
    pub(super) fn new(setup: &'a Setup, quiet: bool) -> Self {
        Self::starting_at(0, setup, quiet)
    }

    /// Goes on after `step` steps, where [`state`](Self::state) was told; `done` are the steps at which things were written
    /// last. What was written later is removed or cut off.
    pub(super) fn resume(
        setup: &'a Setup,
        quiet: bool,
        step: u64,
        done: &[Option<u64>; KINDS],
        state: WriterState,
    ) -> Result<Self> {
        let writer = Self::starting_at(step, setup, quiet);
        let files = &writer.files;
        let series = match &state.series {
            None => None,
            Some((length, paths)) => Some((
                SeriesWriter::resume(&files.series(), *length)?,
                ParticleSeries::resume(&files.particle_series(), setup.domain, paths)?,
            )),
        };
        let written = |kind: usize, path| (done[kind] == Some(step)).then_some(path);
        let kept: Vec<PathBuf> = [
            written(FIELDS, files.fields(step)),
            written(PARTICLES, files.particles(step)),
            written(SURFACES, files.surfaces(step)),
            written(CONTACTS, files.contacts(step)),
            written(CONTACTS, files.force_chains(step)),
            written(PICTURES, files.picture(step)),
        ]
        .into_iter()
        .flatten()
        .collect();
        directory::clear_after(files.directory(), step, &kept)?;
        if state.series.is_none() {
            directory::remove(&files.series())?;
            directory::remove(&files.particle_series())?;
        }
        Ok(Self {
            series,
            fields: Collection::resume(files.fields_collection(), state.fields)?,
            particles: Collection::resume(files.particles_collection(), state.particles)?,
            surfaces: Collection::resume(files.surfaces_collection(), state.surfaces)?,
            contacts: Collection::resume(files.contacts_collection(), state.contacts)?,
            force_chains: Collection::resume(files.force_chains_collection(), state.force_chains)?,
            walls_written: state.walls_written,
            picture_range: setup.plan.output.picture_range.or(state.picture_range),
            t_star: state.t_star,
            settling: state.settling,
            steps: state.steps,
            max_mach: state.max_mach,
            viscosity: state.viscosity,
            ..writer
        })
    }

    /// What [`resume`](Self::resume) needs; the rows so far are safe on disk after this.
    pub(super) fn state(&mut self) -> Result<WriterState> {
        let series = match &mut self.series {
            None => None,
            Some((series, paths)) => Some((series.length()?, paths.state()?)),
        };
        Ok(WriterState {
            series,
            fields: self.fields.entries().to_vec(),
            particles: self.particles.entries().to_vec(),
            surfaces: self.surfaces.entries().to_vec(),
            contacts: self.contacts.entries().to_vec(),
            force_chains: self.force_chains.entries().to_vec(),
            walls_written: self.walls_written,
            picture_range: self.picture_range,
            t_star: self.t_star.clone(),
            settling: self.settling.clone(),
            steps: self.steps.clone(),
            max_mach: self.max_mach,
            viscosity: self.viscosity.clone(),
        })
    }

    fn starting_at(first: u64, setup: &'a Setup, quiet: bool) -> Self {
        let files = OutputFiles::new(&setup.plan.output.directory);
        let work = Workload {
            steps: setup.plan.end_step,
            first,
            cells: setup.fluid_cells(),
            time_step: setup.time_step,
            stokes_time: setup.stokes_time(),
        };
        Self {
            first,
            progress: Progress::new(work, quiet),
            setup,
            series: None,
            fields: Collection::new(files.fields_collection()),
            particles: Collection::new(files.particles_collection()),
            surfaces: Collection::new(files.surfaces_collection()),
            contacts: Collection::new(files.contacts_collection()),
            force_chains: Collection::new(files.force_chains_collection()),
            walls_written: false,
            picture_range: None,
            files,
            t_star: Vec::new(),
            settling: Vec::new(),
            steps: Vec::new(),
            max_mach: 0.0,
            plates: Plates::of(setup),
            viscosity: Vec::new(),
        }
    }

    /// Writes what comes after the files for `ParaView` of a step that are due: indices of their pieces, if there are any (then
    /// they are of the blocks of a decomposition), collections, the walls, the picture.
    pub(super) fn finish_frame(
        &mut self,
        frame: &Frame,
        due: Due,
        pieces: Option<&Decomposition>,
        looks: &Looks,
    ) -> Result<()> {
        let (setup, step) = (self.setup, frame.step);
        let domain = &setup.domain;
        let time = step as f64 * setup.time_step;
        // The file as a whole, or what `index` has made of its pieces.
        let listed = |file: PathBuf, index: &dyn Fn(&Path, &Decomposition) -> Result<PathBuf>| match pieces {
            Some(cut) => index(&file, cut),
            None => Ok(file),
        };
        if due[FIELDS] {
            let path = listed(self.files.fields(step), &|file, cut| {
                let blocks: Vec<Block> = (0..cut.ranks()).map(|rank| cut.block(rank)).collect();
                write_fields_index(file, domain, time, &blocks)
            })?;
            self.fields.add(time, &path)?;
        }
        if due[PARTICLES] {
            let path = listed(self.files.particles(step), &|file, cut| {
                looks
                    .points
                    .write_index(file, domain, setup.fluid.is_some(), cut.ranks())
            })?;
            self.particles.add(time, &path)?;
        }
        if due[SURFACES] {
            let path = listed(self.files.surfaces(step), &|file, cut| {
                looks.surfaces.write_index(file, domain, cut.ranks())
            })?;
            self.surfaces.add(time, &path)?;
        }
        if (due[PARTICLES] || due[SURFACES]) && !self.walls_written && !setup.walls.is_empty() {
            write_walls(&self.files.walls(), domain, &setup.walls)?;
            self.walls_written = true;
        }
        if due[CONTACTS] {
            let path = listed(self.files.contacts(step), &|file, cut| {
                write_contacts_index(file, cut.ranks())
            })?;
            self.contacts.add(time, &path)?;
            let path = listed(self.files.force_chains(step), &|file, cut| {
                write_force_chains_index(file, domain, cut.ranks())
            })?;
            self.force_chains.add(time, &path)?;
        }
        if let Some(picture) = &frame.picture {
            let range = self.picture_range.or_else(|| pictures::range(setup, picture));
            pictures::write(setup, &self.files.picture(step), time, picture, range)?;
            self.picture_range = range;
        }
        Ok(())
    }

    /// Writes the row and the paths, if a sample was due, and takes note of it.
    pub(super) fn write_rows(&mut self, frame: &Frame) -> Result<()> {
        let Some((row, paths)) = &frame.row else {
            return Ok(());
        };
        self.t_star.push(row.t_star);
        self.settling.push(row.settling_velocity);
        self.steps.push(row.step);
        self.max_mach = self.max_mach.max(row.max_mach);
        self.viscosity
            .extend(self.plates.as_ref().map(|plates| plates.relative_viscosity(row)));
        if self.setup.plan.output.series_every == 0 {
            return Ok(());
        }
        let (series, single) = match &mut self.series {
            Some(open) => open,
            none => none.insert((
                SeriesWriter::create(&self.files.series(), &self.setup.walls)?,
                ParticleSeries::create(&self.files.particle_series(), self.setup.domain)?,
            )),
        };
        series.write(row)?;
        single.write(row.step, row.time, paths)
    }

    /// The plot and the summary.
    pub(super) fn finish(
        mut self,
        simulation: &mut Simulation,
        hash: u64,
        interrupted: bool,
        wall_seconds: f64,
    ) -> Result<Summary> {
        let setup = self.setup;
        let first = self
            .steps
            .partition_point(|&step| step < setup.plan.average_from_step);
        let steady = settles_for_ever(setup);
        let estimate = steady.then(|| estimate_mean(&self.settling[first..])).flatten();
        let settled = (steady.then(|| settled(&self.settling)).flatten())
            .map(|settled| (self.t_star[settled.first], settled.estimate));
        let averaged_over = estimate.map(|_| [self.t_star[first], self.t_star[self.t_star.len() - 1]]);
        if let Some(fluid) = &setup.fluid
            && settling_direction(setup).is_some()
            && !self.settling.is_empty()
        {
            let references = references(&fluid.scales, setup.volume_fraction);
            write_settling(
                &self.files.settling_plot(),
                &SettlingPlot {
                    case: &setup.provenance.name,
                    t_star: &self.t_star,
                    velocity: &self.settling,
                    mean: averaged_over.zip(estimate),
                    settled,
                    references: if steady { &references } else { &[] },
                },
            )?;
        }
        let outcome = Outcome {
            estimate,
            drift: estimate.and_then(|e| drift(&self.settling[first..], e.mean)),
            settled,
            averaged_over,
            max_mach: self.max_mach,
            viscosity: estimate_mean(self.viscosity.get(first..).unwrap_or(&[])),
            hash,
            interrupted,
            first: self.first,
            wall_seconds,
        };
        let summary = summary::summary(setup, simulation, outcome);
        summary.write(&self.files.summary())?;
        self.progress.finish(simulation.step);
        Ok(summary)
    }
}

/// Difference of the means of the second and the first half of a series, over its mean; `None` for too few values.
fn drift(series: &[f64], mean: f64) -> Option<f64> {
    let (early, late) = series.split_at(series.len() / 2);
    let of = |half: &[f64]| half.iter().sum::<f64>() / half.len() as f64;
    (series.len() >= 4 && mean != 0.0).then(|| (of(late) - of(early)) / mean)
}
