//! Rows of the time series, the paths of single particles, and what the samples of a run say at its end.

mod flows;

use super::vtk::parsed;
use super::{FileEstimate, NUMBER, Need, RootOutput, Writer, WriterState, files_of, threads_and_cores};
use crate::case::Setup;
use crate::error::{Error, Result};
#[cfg(feature = "pictures")]
use crate::output::ReferenceScales;
#[cfg(feature = "pictures")]
use crate::output::picture::{SettlingPlot, write_settling};
use crate::output::{
    Estimate, OutputFiles, PATHS, ParticleSeries, PathsState, RowsMark, SeriesRow, SeriesTable, SeriesWriter,
    Summary, averages, directory, estimate_settling, estimate_sheared, particle_series, series,
    settled_suspension,
};
use crate::particle::Particle;
use crate::simulation::observe::settles_for_ever;
#[cfg(feature = "pictures")]
use crate::simulation::{observe::settling_direction, settling_references};
use flows::{Bed, Plates};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

const NAME: &str = "series";
/// Time (s) of one thread to measure the flow in a cell for a row: processor time of `hindered_settling` with rows, less that without.
const MEASURED_CELL: f64 = 26e-9;

/// Writes `series.csv` and `particle_series.csv`, and collects samples for the averages of the summary.
pub(super) struct Series<'a> {
    setup: &'a Setup,
    files: OutputFiles,
    /// Largest id of the particles whose paths are written if the case names none.
    last_path: Option<u64>,
    open: Option<(SeriesWriter, ParticleSeries)>,
    samples: Samples,
    plates: Option<Plates>,
    bed: Option<Bed>,
}

/// Of every sample.
#[derive(Clone, Default, Serialize, Deserialize)]
struct Samples {
    steps: Vec<u64>,
    t_star: Vec<f64>,
    settling: Vec<f64>,
    /// Of the suspension over that of the fluid; nothing without plates.
    viscosity: Vec<f64>,
    /// Superficial velocity (m/s) and drag (N); nothing without a bed.
    #[serde(default)]
    bed: Vec<[f64; 2]>,
    max_mach: f64,
}

#[derive(Serialize, Deserialize)]
struct State {
    /// Rows of `series.csv`, and how far the paths have come; nothing before the first row.
    open: Option<(RowsMark, PathsState)>,
    samples: Samples,
}

/// Refuses tables that do not begin with these rows.
fn holds(files: &OutputFiles, open: Option<&(RowsMark, PathsState)>) -> Result<()> {
    let Some((rows, paths)) = open else {
        return Ok(());
    };
    SeriesWriter::holds(&files.series(), rows)?;
    SeriesWriter::holds(&files.particle_series(), &paths.rows)
}

/// Refuses a directory whose tables are not those of the run that has left these states of its writers.
pub(in crate::simulation) fn refuse_other_rows(
    directory: &Path,
    states: &BTreeMap<String, WriterState>,
) -> Result<()> {
    match states.get(NAME) {
        None => Ok(()),
        Some(state) => holds(&OutputFiles::new(directory), parsed::<State>(NAME, state)?.open.as_ref()),
    }
}

impl<'a> Series<'a> {
    pub(super) fn new(setup: &'a Setup) -> Self {
        Self {
            setup,
            files: files_of(setup),
            last_path: setup.plan.output.paths.is_empty().then(|| last_path(setup)).flatten(),
            open: None,
            samples: Samples::default(),
            plates: Plates::of(setup),
            bed: Bed::of(setup),
        }
    }

    /// Distance (diameters) by which a suspension has settled relative to the mixture from a sample on to the end; infinite for one
    /// particle, whose arrangement does not change.
    fn sunk(&self, first: usize) -> f64 {
        if !self.is_suspension() {
            return f64::INFINITY;
        }
        let Samples { t_star, settling, .. } = &self.samples;
        let rows = t_star.windows(2).zip(settling.windows(2)).skip(first);
        rows.map(|(t, u)| 0.5 * (u[0] + u[1]) * (t[1] - t[0])).sum::<f64>().abs()
    }

    /// Strain of a suspension between plates from a sample on to the end; infinite as in [`sunk`](Self::sunk).
    fn sheared(&self, first: usize) -> f64 {
        let Some(plates) = self.plates.as_ref().filter(|_| self.is_suspension()) else {
            return f64::INFINITY;
        };
        let steps = &self.samples.steps;
        let count = steps.get(first).zip(steps.last()).map_or(0, |(from, to)| to - from);
        plates.strain(count as f64 * self.setup.time_step)
    }

    /// More than one particle moves freely.
    fn is_suspension(&self) -> bool {
        let counts = self.setup.start_counts().into_iter().zip(&self.setup.motions);
        let free = counts.filter(|(_, motion)| !motion.holds_centre());
        !self.setup.insertions.is_empty() || free.map(|(count, _)| count).sum::<usize>() > 1
    }
}

#[cfg(feature = "pictures")]
impl Series<'_> {
    /// The plot of the settling velocity, of its `mean` over an interval of t*, and of that after the transient; nothing for
    /// particles that do not settle.
    fn draw(
        &self,
        mean: Option<([f64; 2], Estimate)>,
        settled: Option<(f64, Estimate)>,
        scales: &ReferenceScales,
    ) -> Result<()> {
        let (setup, samples) = (self.setup, &self.samples);
        if setup.fluid.is_none() || settling_direction(setup).is_none() || samples.settling.is_empty() {
            return Ok(());
        }
        let references = settling_references(scales, setup.volume_fraction);
        let plot = SettlingPlot {
            case: &setup.provenance.name,
            t_star: &samples.t_star,
            velocity: &samples.settling,
            mean,
            settled,
            references: if settles_for_ever(setup) { &references } else { &[] },
        };
        write_settling(&self.files.settling_plot(), &plot)
    }
}

impl Writer for Series<'_> {
    fn name(&self) -> &'static str {
        NAME
    }

    fn every(&self) -> u64 {
        self.setup.plan.output.series_every
    }

    fn needs(&self) -> Vec<Need> {
        vec![Need::Row, Need::Selected]
    }

    fn selects(&self, particle: &Particle) -> bool {
        self.last_path.is_some_and(|last| particle.id <= last)
            || self.setup.plan.output.paths.binary_search(&particle.id).is_ok()
    }

    fn complete(&mut self, output: &RootOutput) -> Result<()> {
        let Some(row) = output.row else {
            return Ok(());
        };
        self.samples.add(row, self.plates.as_ref(), self.bed.as_ref());
        let open: Vec<&str> =
            self.setup.open_faces().into_iter().map(|n| &*self.setup.walls[n].name).collect();
        let (series, paths) = match &mut self.open {
            Some(open) => open,
            none => none.insert((
                SeriesWriter::create(
                    &self.files.series(),
                    &self.setup.walls,
                    &self.setup.prescribed_sections(),
                    &open,
                    &self.setup.counted_sections(),
                )?,
                ParticleSeries::create(&self.files.particle_series(), self.setup.domain)?,
            )),
        };
        series.write(&[row])?;
        paths.write(row.step, row.time, &output.selected)
    }

    fn intact(&self) -> Result<()> {
        match &self.open {
            None => Ok(()),
            Some((series, paths)) => series.intact().and_then(|()| paths.intact()),
        }
    }

    fn state(&mut self) -> Result<WriterState> {
        let open = match &self.open {
            None => None,
            Some((series, paths)) => Some((series.mark()?, paths.state()?)),
        };
        let samples = self.samples.clone();
        Ok(serde_json::json!(State { open, samples }))
    }

    fn fits(&self, state: &WriterState) -> Result<()> {
        let State { open, samples } = parsed(self.name(), state)?;
        let count = samples.settling.len();
        if [samples.t_star.len(), samples.steps.len()] != [count; 2] || !samples.max_mach.is_finite() {
            let what = "the samples for the averages in the common state are not whole";
            return Err(Error::Input(what.to_string()));
        }
        holds(&self.files, open.as_ref())
    }

    fn resume(&mut self, state: &WriterState) -> Result<()> {
        let State { open, samples } = parsed(self.name(), state)?;
        let [rows, paths] = [self.files.series(), self.files.particle_series()];
        self.samples = samples;
        self.open = match &open {
            None => {
                directory::remove(&rows)?;
                directory::remove(&paths)?;
                None
            }
            Some((mark, state)) => Some((
                SeriesWriter::resume(&rows, mark)?,
                ParticleSeries::resume(&paths, self.setup.domain, state)?,
            )),
        };
        Ok(())
    }

    /// The averages, and the plot of the settling velocity.
    fn finish(&mut self, summary: &mut Summary) -> Result<()> {
        let (setup, samples) = (self.setup, &self.samples);
        let from = setup.plan.averages_from(samples.steps.last().copied().unwrap_or_default());
        let first = (samples.steps).partition_point(|&step| step < from);
        let (t_star, settling) = (&samples.t_star, &samples.settling);
        let steady = settles_for_ever(setup);
        let sunk = |from: usize| self.sunk(from);
        let mean = steady.then(|| estimate_settling(&settling[first..], sunk(first))).flatten();
        let settled =
            steady.then(|| settled_suspension(settling, |rest| sunk(settling.len() - rest))).flatten();
        let settled = settled.map(|settled| (t_star[settled.first], settled.estimate));
        let averaged_over = mean.map(|_| [t_star[first], t_star[t_star.len() - 1]]);
        #[cfg(feature = "pictures")]
        self.draw(averaged_over.zip(mean), settled, &summary.scales)?;
        let viscosity = estimate_sheared(samples.viscosity.get(first..).unwrap_or(&[]), self.sheared(first));
        let error = |of: Option<Estimate>| of.and_then(|estimate| estimate.standard_error);
        let over_schiller_naumann = summary.scales.stokes_velocity / summary.scales.schiller_naumann_velocity;
        summary.settling_velocity_over_stokes = mean.map(|e| e.mean);
        summary.settling_velocity_over_schiller_naumann = mean.map(|e| e.mean * over_schiller_naumann);
        summary.standard_error = error(mean);
        if let Some(plates) = &self.plates {
            plates.finish(setup, summary);
        }
        let velocities = self.bed.as_ref().map(|bed| bed.finish(samples, first, summary));
        summary.drift = (mean.and_then(|e| drift(&settling[first..], e.mean)))
            .or_else(|| viscosity.and_then(|e| drift(&samples.viscosity[first..], e.mean)))
            .or_else(|| drift(&velocities?, summary.superficial_velocity?));
        summary.transient_end = settled.map(|(end, _)| end);
        summary.settled_mean = settled.map(|(_, e)| e.mean);
        summary.settled_standard_error = error(settled.map(|(_, e)| e));
        summary.averaged_over = averaged_over;
        summary.averaged_over_distance = mean.map(|_| sunk(first)).filter(|distance| distance.is_finite());
        let time = |step: &u64| *step as f64 * setup.time_step;
        let steps = samples.steps.get(first..).unwrap_or(&[]);
        summary.averaged_over_time = steps.first().zip(steps.last()).map(|(from, to)| [time(from), time(to)]);
        let names = &setup.plan.output.average;
        if !names.is_empty() && self.open.is_some() {
            let table = SeriesTable::read(&self.files.series())?;
            let from = from as f64 * setup.time_step;
            let wanted = |name: &str| names.iter().any(|wanted| wanted == name);
            let distance = summary.averaged_over_distance.unwrap_or(f64::INFINITY);
            summary.averages.extend(averages(&table, wanted, from, distance));
        }
        summary.mach = setup.fluid.as_ref().map(|_| samples.max_mach);
        summary.relative_viscosity = viscosity.map(|e| e.mean);
        summary.relative_viscosity_standard_error = error(viscosity);
        Ok(())
    }

    fn estimate(&self, end_step: u64) -> Option<FileEstimate> {
        let paths = match self.setup.plan.output.paths.len() {
            0 => self.setup.expected_particles().min(PATHS),
            asked => asked,
        };
        let numbers = series::COLUMNS.len() + paths * particle_series::COLUMNS.len();
        let rows = FileEstimate::of(self, end_step, "tables", NUMBER * numbers as f64, "");
        let [threads, cores] = threads_and_cores(self.setup);
        let each = MEASURED_CELL * self.setup.fluid_cells() as f64 / threads.min(cores) as f64;
        let seconds = rows.count as f64 * each;
        Some(FileEstimate { seconds, ..rows.in_one_file() })
    }
}

impl Samples {
    fn add(&mut self, row: &SeriesRow, plates: Option<&Plates>, bed: Option<&Bed>) {
        self.steps.push(row.step);
        self.t_star.push(row.t_star);
        self.settling.push(row.settling_velocity);
        self.max_mach = self.max_mach.max(row.max_mach);
        let viscosity = plates.and_then(|plates| plates.relative_viscosity(row));
        self.viscosity.extend(viscosity.filter(|viscosity| viscosity.is_finite()));
        self.bed.extend(bed.map(|bed| bed.sample(row)));
    }
}

/// The largest of the lowest ids, as many as there are paths, those of inserted particles among them.
fn last_path(setup: &Setup) -> Option<u64> {
    let count = setup.start_count().min(PATHS);
    let last = setup.totals().last_path;
    if setup.insertions.is_empty() || count == PATHS {
        return last;
    }
    // They get the next ids.
    Some(last.map_or(0, |last| last + 1) + (PATHS - count) as u64 - 1)
}

/// Difference of the means of the second and the first half of a series, over its mean; `None` for too few values.
fn drift(series: &[f64], mean: f64) -> Option<f64> {
    let (early, late) = series.split_at(series.len() / 2);
    let of = |half: &[f64]| half.iter().sum::<f64>() / half.len() as f64;
    (series.len() >= 4 && mean != 0.0).then(|| (of(late) - of(early)) / mean)
}
