//! Walks the [writers] of a run: gathers what the due ones need, hands it to them, and writes the summary.
//!
//! All ranks take part. Files for `ParaView` are written by rank 0 where the ranks are threads, and in pieces by all of them where they are
//! processes ([`gather`]). A failure to write on one rank ends the run on every rank.

mod gather;
mod near;
mod row;
mod summary;
mod sums;

use super::writers::{
    self, FlowOfRows, Need, RankOutput, RankState, RootOutput, Writer, WriterState, slice_planes,
};
use super::{Measurement, Progress, Simulation};
use crate::case::Setup;
use crate::comm::Comm;
use crate::error::{Error, Result};
use crate::output::directory::{self, Kind};
use crate::output::{Numbered, OutputFiles, Summary};
use crate::particle::Particle;
pub(super) use gather::partners;
pub(super) use gather::{each_row, fields as all_fields, own_fields};
pub(super) use near::{Centre, at_owners, centres_near, to_owners};
pub(super) use row::{PAIRS, branch_moment, settles_for_ever, settling_direction};
use serde::{Deserialize, Serialize};
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fs::File;
use std::path::Path;
use std::rc::Rc;
use std::sync::Arc;
use std::time::Instant;
pub use summary::device_name;
pub use summary::instruction_set;
pub use sums::{Sums, Totals};

/// Name of the writer whose time is a stage of its own.
pub(super) const PICTURES: &str = "pictures";

pub(super) type Writers<'a> = Vec<Box<dyn Writer + 'a>>;

pub(super) struct Observer<'a> {
    setup: &'a Setup,
    start: Instant,
    /// Steps done before this run, which continues from there.
    first: u64,
    /// The output directory, on rank 0.
    opened: Option<File>,
    files: OutputFiles,
    writers: Writers<'a>,
    /// Those that wait for the rows of the flow.
    later: Vec<Later>,
    /// Steps at which they have written last.
    done: Vec<Option<u64>>,
    /// True if every rank writes its own pieces of files.
    pieces: bool,
    is_root: bool,
    /// Time (s) that the pictures of this step took to draw, if there were any.
    drawn: Option<f64>,
    /// Warnings so far, those about the case first.
    warnings: Vec<String>,
    /// Only on rank 0.
    progress: Option<Arc<dyn Progress>>,
}

/// A step that a writer completes when its [rows](Writer::of_rows) have passed.
struct Later {
    writer: usize,
    step: u64,
    sums: Sums,
    rows: Rc<RefCell<FlowOfRows>>,
}

/// State of the writers, by their names, to continue from.
#[derive(Serialize, Deserialize)]
pub(super) struct ObserverState {
    /// The step at which it has written last.
    done: BTreeMap<String, u64>,
    states: BTreeMap<String, WriterState>,
    /// Warnings so far; none in checkpoints of older versions.
    #[serde(default)]
    warnings: Option<Vec<String>>,
}

impl ObserverState {
    /// Refuses a directory that holds another run than the one that has left this state.
    pub(super) fn is_of(&self, directory: &Path) -> Result<()> {
        writers::series::refuse_other_rows(directory, &self.states)
    }

    /// Refuses files of the run that cannot be continued.
    pub(super) fn fits(&self, writers: &Writers) -> Result<()> {
        writers.iter().try_for_each(|writer| match self.states.get(writer.name()) {
            Some(state) => writer.fits(state),
            None => Ok(()),
        })
    }
}

pub(super) fn kinds(writers: &[Box<dyn Writer + '_>]) -> Vec<Kind> {
    let of_each = writers
        .iter()
        .flat_map(|writer| [writer.numbered().map(Kind::Numbered), writer.table().map(Kind::Table)]);
    of_each.flatten().collect()
}

impl<'a> Observer<'a> {
    pub(super) fn new(
        setup: &'a Setup,
        comm: &Comm,
        writers: Writers<'a>,
        first: u64,
        progress: Option<Arc<dyn Progress>>,
    ) -> Self {
        let is_root = comm.rank() == 0;
        let progress = progress.filter(|_| is_root);
        if let Some(progress) = &progress {
            progress.start(setup, first);
        }
        Self {
            setup,
            start: Instant::now(),
            first,
            opened: is_root.then(|| File::open(&setup.plan.output.directory).ok()).flatten(),
            files: OutputFiles::new(&setup.plan.output.directory),
            done: vec![None; writers.len()],
            later: Vec::new(),
            writers,
            pieces: comm.ranks_per_process() < comm.size(),
            is_root,
            drawn: None,
            warnings: setup.provenance.warnings.clone(),
            progress,
        }
    }

    /// Continues from a [state](Self::state), or an error if the files are not what they were then.
    /// Collective.
    pub(super) fn resume(&mut self, comm: &Comm, state: &ObserverState) -> Result<()> {
        for (writer, done) in self.writers.iter().zip(&mut self.done) {
            *done = state.done.get(writer.name()).copied();
        }
        if let Some(warnings) = &state.warnings {
            // Those of the saved case are among them.
            self.warnings.splice(..self.setup.provenance.warnings.len(), warnings.iter().cloned());
        }
        comm.agree(if self.is_root { self.resume_files(state) } else { Ok(()) })
    }

    /// Removes or cuts off what was written after the first step.
    fn resume_files(&mut self, state: &ObserverState) -> Result<()> {
        let written = |done: &Option<u64>| *done == Some(self.first);
        let kept: Vec<Numbered> = (self.writers.iter().zip(&self.done))
            .filter(|(_, done)| written(done))
            .filter_map(|(writer, _)| writer.numbered())
            .collect();
        directory::clear_after(self.files.directory(), &kinds(&self.writers), self.first, &kept)?;
        for writer in &mut self.writers {
            if let Some(state) = state.states.get(writer.name()) {
                writer.resume(state)?;
            }
        }
        Ok(())
    }

    /// A warning to the user, from rank 0.
    pub(super) fn warn(&mut self, text: &str) {
        self.warnings.push(text.to_string());
        if let Some(progress) = &self.progress {
            progress.warn(text);
        }
    }

    /// State of the writers, on rank 0; nothing elsewhere. What has been written is safe on disk after this. Collective.
    pub(super) fn state(&mut self, comm: &Comm) -> Result<Option<ObserverState>> {
        let states = self.is_root.then(|| {
            self.intact()?;
            let states = self.writers.iter_mut();
            states
                .map(|writer| Ok((writer.name().to_owned(), writer.state()?)))
                .collect::<Result<BTreeMap<_, _>>>()
        });
        let states = comm.agree(states.transpose())?;
        let done = self.writers.iter().zip(&self.done);
        let done = done.filter_map(|(writer, done)| Some((writer.name().to_owned(), (*done)?)));
        let warnings = Some(self.warnings.clone());
        Ok(states.map(|states| ObserverState { done: done.collect(), states, warnings }))
    }

    /// Writes what is due after the current step; `last` makes everything due that the run writes at all. Fails with a failure of
    /// any rank since the last control, before anything of it is written. Collective.
    pub(super) fn observe(&mut self, simulation: &mut Simulation, last: bool) -> Result<()> {
        let step = simulation.step;
        if let Some(progress) = &self.progress {
            progress.step(step);
        }
        if last || self.later.first().is_some_and(|later| later.step < step) {
            self.complete_later(simulation)?;
        }
        let due: Vec<usize> = (0..self.writers.len())
            .filter(|&i| self.done[i] != Some(step) && self.writers[i].due(step, last))
            .collect();
        if due.is_empty() {
            return Ok(());
        }
        let start = Instant::now();
        let needs: Vec<Need> = due.iter().flat_map(|&i| self.writers[i].needs()).collect();
        let measured = needs.contains(&Need::Row).then(|| simulation.measure());
        simulation.share_failure()?;
        let outcome = self.write(simulation, &due, &needs, measured.as_ref());
        for &i in &due {
            self.done[i] = Some(step);
        }
        let drawn = self.drawn.take();
        if let Some(drawn) = drawn {
            simulation.timings.add(PICTURES, drawn);
        }
        simulation.timings.add("observe", start.elapsed().as_secs_f64() - drawn.unwrap_or(0.0));
        if outcome.is_ok() && (last || !simulation.is_swept_as_it_is()) {
            return self.complete_later(simulation);
        }
        outcome
    }

    /// Completes what waits for the rows of a step, which have passed in the sweep of the next one or pass now. Collective.
    pub(super) fn complete_later(&mut self, simulation: &mut Simulation) -> Result<()> {
        let mut later = std::mem::take(&mut self.later);
        let Some(step) = later.first().map(|later| later.step) else { return Ok(()) };
        let start = Instant::now();
        if let Some(mut visit) = simulation.rows.take().filter(|_| simulation.step == step) {
            gather::each_row(simulation, simulation.block, &mut *visit);
        }
        for Later { sums, rows, .. } in &mut later {
            rows.borrow_mut().add_to(sums);
        }
        simulation.comm.agree(self.intact())?;
        let all: Vec<Sums> = later.iter_mut().map(|later| std::mem::take(&mut later.sums)).collect();
        let totals = Sums::reduce(&all, &simulation.comm);
        let time = step as f64 * self.setup.time_step;
        let mut on_root = later.iter().zip(&totals).filter(|_| self.is_root);
        let outcome = on_root.try_for_each(|(later, totals)| {
            self.writers[later.writer].complete(&RootOutput::of(step, time, totals))
        });
        let outcome = simulation.comm.agree(outcome);
        simulation.timings.add("observe", start.elapsed().as_secs_f64());
        outcome
    }

    /// Lets the writers that are due and need the rows of the flow wait for them.
    fn wait_for_rows(&mut self, simulation: &mut Simulation, due: &[usize], sums: &mut [Sums]) {
        let step = simulation.step;
        for (&writer, sums) in due.iter().zip(sums) {
            if let Some(rows) = self.writers[writer].of_rows(simulation.block) {
                let (sums, rows) = (std::mem::take(sums), Rc::new(RefCell::new(rows)));
                self.later.push(Later { writer, step, sums, rows });
            }
        }
        let rows: Vec<_> = self.later.iter().map(|later| later.rows.clone()).collect();
        if !rows.is_empty() {
            simulation.rows =
                Some(Box::new(move |row| rows.iter().for_each(|rows| rows.borrow_mut().add(row))));
        }
    }

    /// Returns true if a writer ends the run after this step. Collective.
    pub(super) fn ends(&self, simulation: &Simulation) -> bool {
        let may = self.setup.plan.steady.is_some()
            && simulation.step.is_multiple_of(self.setup.plan.output.series_every);
        may && simulation.comm.any(self.is_root && self.writers.iter().any(|writer| writer.ends()))
    }

    /// Refuses to write where somebody has removed the directory or a table of this run, on rank 0.
    fn intact(&self) -> Result<()> {
        self.writers.iter().try_for_each(|writer| writer.intact())?;
        let directory = self.files.directory();
        if self.opened.as_ref().is_none_or(|opened| directory::is_named(opened, directory)) {
            return Ok(());
        }
        Err(Error::Input(format!(
            "{} was removed or replaced while the run wrote to it: what was in it is lost, and the run ends\n  run the case anew, in \
             a directory that nothing removes",
            directory.display()
        )))
    }

    /// Adds up what the writers that are `due` [sum](Writer::sums), gathers what they `need`, lets them write, and complete their files
    /// when all pieces are there.
    /// Collective.
    fn write(
        &mut self,
        simulation: &mut Simulation,
        due: &[usize],
        needs: &[Need],
        measured: Option<&Measurement>,
    ) -> Result<()> {
        simulation.comm.agree(self.intact())?;
        let (setup, needed) = (self.setup, |need| needs.contains(&need));
        let time = simulation.step as f64 * setup.time_step;
        let mut rank = RankState::new(simulation);
        let of_row = measured.map_or_else(Sums::default, |measured| row::sums(setup, &rank, measured));
        let of_each = due.iter().map(|&i| self.writers[i].sums(&mut rank));
        let mut sums: Vec<Sums> = std::iter::once(of_row).chain(of_each).collect();
        let touches = needed(Need::Contacts) || needed(Need::AllContacts);
        let touches = if touches { rank.into_contacts() } else { Vec::new() };
        self.wait_for_rows(simulation, due, &mut sums[1..]);
        let totals = Sums::reduce(&sums, &simulation.comm);
        let row = measured.and_then(|measured| row::row(setup, simulation, measured, &totals[0]));
        let cut = &simulation.cut.clone();
        let planes = (needed(Need::Slices) && setup.fluid.is_some()).then(|| slice_planes(setup));
        let planes = planes.unwrap_or_default();
        let slices: Vec<_> = planes.iter().map(|plane| gather::slice(simulation, cut, plane)).collect();
        let contacts = needed(Need::AllContacts).then(|| gather::contacts(simulation, &touches));
        let contacts = contacts.unwrap_or_default();
        let selected: Vec<Vec<Particle>> = (due.iter().map(|&i| &self.writers[i]))
            .map(|writer| {
                if writer.needs().contains(&Need::Selected) {
                    gather::particles(simulation, |particle| writer.selects(particle))
                } else {
                    Vec::new()
                }
            })
            .collect();
        let own = RankOutput::gather(simulation, cut, self.pieces, needs, &touches, time);
        let mut outcome = own.and_then(|own| match own {
            Some(own) => due.iter().try_for_each(|&i| self.writers[i].write(&own)),
            None => Ok(()),
        });
        if self.pieces {
            // No index before all pieces are there.
            simulation.comm.agree(outcome)?;
            outcome = Ok(());
        }
        if outcome.is_ok() && self.is_root {
            let given = selected.into_iter().zip(&totals[1..]);
            let waits = |i: usize| self.later.iter().any(|later| later.writer == i);
            let now = due.iter().zip(given).filter(|(i, _)| !waits(**i)).collect::<Vec<_>>();
            outcome = now.into_iter().try_for_each(|(&i, (selected, totals))| {
                let start = Instant::now();
                let done = self.writers[i].complete(&RootOutput {
                    step: simulation.step,
                    time,
                    row: row.as_ref(),
                    totals,
                    selected,
                    slices: &slices,
                    contacts: &contacts,
                    pieces: self.pieces.then_some(cut),
                });
                if self.writers[i].name() == PICTURES {
                    self.drawn = Some(start.elapsed().as_secs_f64());
                }
                done
            });
        }
        simulation.comm.agree(outcome)
    }

    /// The last files and the summary, on rank 0. Collective.
    pub(super) fn finish(
        mut self,
        simulation: &mut Simulation,
        interrupted: bool,
    ) -> Result<Option<Summary>> {
        let hash = simulation.state_hash();
        if !self.is_root {
            return Ok(None);
        }
        self.intact()?;
        let seconds = self.start.elapsed().as_secs_f64();
        let mut summary = summary::summary(self.setup, simulation, hash, self.first, seconds);
        summary.interrupted = interrupted;
        summary.warnings = std::mem::take(&mut self.warnings);
        for writer in &mut self.writers {
            writer.finish(&mut summary)?;
        }
        let time = simulation.control_record().steps(summary.steps) as f64;
        summary.shear_strain = summary.shear_rate.map(|rate| rate * time * self.setup.time_step);
        summary.write(&self.files.summary())?;
        if let Some(progress) = &self.progress {
            progress.finish(simulation.step);
        }
        Ok(Some(summary))
    }
}
