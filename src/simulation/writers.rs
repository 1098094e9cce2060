//! Files that a run writes on the way: a [`Writer`] for each kind of file, and the list of all of them ([`of`]).
//!
//! The [`Observer`](super::observe::Observer) asks every writer after every step whether it is [due](Writer::due), brings together
//! once what the due ones [need](Writer::needs), and hands it to them:
//!
//! ```text
//! every rank    needs, selects      the same answers on all of them
//! every rank    sums                what it contributes to numbers of the whole box
//! every rank    write               the whole at rank 0 where the ranks are threads; the piece of each where they are processes
//! rank 0        complete            when all pieces are written: rows, indices, collections, pictures
//! rank 0        finish              at the end of the run
//! ```
//!
//! A number of the whole box is a sum over the ranks ([`Writer::sums`]): nothing is gathered for it. A library adds its own writers with [`run_with`](super::run_with()).

pub(super) mod dynamics;
#[cfg(feature = "pictures")]
mod pictures;
pub(super) mod profiles;
pub(super) mod series;
mod steady;
pub(super) mod structure;
mod table;
mod vtk;
mod wear;

#[cfg(feature = "pictures")]
pub use pictures::write_start;
#[doc(hidden)]
pub use profiles::FlowOfRows;

use super::Simulation;
use super::observe::{Sums, Totals, each_row};
use super::work::cores;
use crate::case::Setup;
use crate::dem::{ContactState, Load};
use crate::domain::{Block, Decomposition};
use crate::error::Result;
use crate::output::picture::Plane;
use crate::output::{Fields, Numbered, OutputFiles, SeriesRow, Summary, pieces};
use crate::particle::Particle;
use std::cell::OnceCell;
use std::path::PathBuf;

/// State of a writer in a checkpoint; nothing is [`Null`](serde_json::Value::Null).
pub type WriterState = serde_json::Value;

/// Writes one kind of file during a run. An error of a method ends the run on all ranks.
///
/// Every rank has its own, made alike: what does not stand in a `&mut self` of rank 0 alone must be the same on all of them.
pub trait Writer {
    /// Name, unique in a run, of its state in a checkpoint.
    fn name(&self) -> &'static str;

    /// Interval (steps); 0 is never.
    fn every(&self) -> u64;

    /// Returns true if it is due after `step` steps; `last` after the last step of the run. The same on all ranks.
    fn due(&self, step: u64, last: bool) -> bool {
        self.every() > 0 && (last || step.is_multiple_of(self.every()))
    }

    /// Data that it gets when it is due. The same on all ranks.
    fn needs(&self) -> Vec<Need>;

    /// Returns true if rank 0 gets this particle in [`RootOutput::selected`].
    fn selects(&self, _: &Particle) -> bool {
        false
    }

    /// Contribution of this rank to the sums and maxima that rank 0 gets in [`RootOutput::totals`], as many on every rank.
    ///
    /// ```
    /// # use turbid::simulation::{RankState, Sums};
    /// /// Number, and kinetic energy (J), of the particles in the upper half.
    /// fn sums(height: f64, rank: &mut RankState) -> Sums {
    ///     let mut sums = Sums::new(2, 0, 0);
    ///     let store = rank.simulation().dem().particles();
    ///     for particle in store.owned().iter().filter(|particle| particle.position().z > 0.5 * height) {
    ///         let mass = store.template(particle).mass();
    ///         sums.add(0, &[1.0, 0.5 * mass * particle.velocity().norm_squared()]);
    ///     }
    ///     sums
    /// }
    /// ```
    fn sums(&self, _: &mut RankState) -> Sums {
        Sums::default()
    }

    /// Sums over the rows of the flow in a block, none of them added yet. The rows are those of the step, but pass in the sweep of the next one
    /// where that is cheaper: the writer [completes](Self::complete) its step then.
    #[doc(hidden)]
    fn of_rows(&self, _: Block) -> Option<FlowOfRows> {
        None
    }

    /// Writes what this rank has. Not collective.
    fn write(&mut self, _: &RankOutput) -> Result<()> {
        Ok(())
    }

    /// Writes what needs the whole, on rank 0, after [`write`](Self::write) has succeeded on all ranks.
    fn complete(&mut self, _: &RootOutput) -> Result<()> {
        Ok(())
    }

    /// Its numbered files: before a run they are refused or cleared; those of later steps go when a run resumes.
    fn numbered(&self) -> Option<Numbered> {
        None
    }

    /// Name of its file directly in the output directory, one that grows: before a run it is refused or cleared.
    fn table(&self) -> Option<&'static str> {
        None
    }

    /// Checks that a file that grows is still there, on rank 0, before anything is written.
    fn intact(&self) -> Result<()> {
        Ok(())
    }

    /// Returns true, on rank 0, if the run shall end after the last step that it [completed](Self::complete).
    fn ends(&self) -> bool {
        false
    }

    /// State for [`resume`](Self::resume), on rank 0; all that is written is safe on disk after this.
    fn state(&mut self) -> Result<WriterState> {
        Ok(WriterState::Null)
    }

    /// Refuses a [state](Self::state) if the files do not hold what the run had written then, on rank 0.
    fn fits(&self, _: &WriterState) -> Result<()> {
        Ok(())
    }

    /// Continues from a [state](Self::state), on rank 0; what was written after it is cut off.
    fn resume(&mut self, _: &WriterState) -> Result<()> {
        Ok(())
    }

    /// Adds to the summary what only the end of a run can tell, and writes the last files, on rank 0.
    fn finish(&mut self, _: &mut Summary) -> Result<()> {
        Ok(())
    }

    /// Estimate of the files of a run; nothing where they are few and small.
    fn estimate(&self, _end_step: u64) -> Option<FileEstimate> {
        None
    }
}

/// Data for a [`Writer`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Need {
    /// [`RootOutput::row`].
    Row,
    /// [`RankOutput::fields`].
    Fields,
    /// [`RankOutput::particles`].
    Particles,
    /// [`RankOutput::loads`]; with [`Need::Particles`].
    Loads,
    /// [`RankOutput::contacts`] and [`RankOutput::partners`].
    Contacts,
    /// [`RootOutput::selected`].
    Selected,
    /// [`RootOutput::slices`].
    Slices,
    /// [`RootOutput::contacts`].
    AllContacts,
}

/// State of one rank after a step, of which a writer [sums](Writer::sums) something.
pub struct RankState<'a> {
    simulation: &'a mut Simulation,
    contacts: OnceCell<Vec<ContactState>>,
}

impl<'a> RankState<'a> {
    pub(super) fn new(simulation: &'a mut Simulation) -> Self {
        Self { simulation, contacts: OnceCell::new() }
    }

    /// The blocks of all ranks.
    pub fn decomposition(&self) -> &Decomposition {
        &self.simulation.cut
    }

    /// The simulation, of which this rank has its particles and its block.
    pub fn simulation(&self) -> &Simulation {
        self.simulation
    }

    /// The contacts that this rank is responsible for: each contact is one of one rank.
    pub fn contacts(&self) -> &[ContactState] {
        self.contacts.get_or_init(|| self.simulation.contact_states())
    }

    /// The [contacts](Self::contacts), for good.
    pub(super) fn into_contacts(self) -> Vec<ContactState> {
        self.contacts.into_inner().unwrap_or_else(|| self.simulation.contact_states())
    }

    /// Stresslet (N m) that the fluid exerts on each of the particles of this rank in the coming step (`xx`, `yy`, `zz`, `xy`, `xz`, `yz`).
    /// Takes about as long as a step. Collective.
    pub(in crate::simulation) fn stresslets(&mut self) -> Vec<[f64; 6]> {
        self.simulation.stresslets()
    }

    /// Calls `visit` with each cell of the block of this rank, velocity (m/s) and pressure (Pa) there, and the solid volume fraction,
    /// with the particles where they are now; not at all without a fluid.
    pub fn each_cell(&mut self, mut visit: impl FnMut([usize; 3], [f64; 3], f64, f64)) {
        let units = self.simulation.units;
        each_row(self.simulation, self.simulation.block, |row| {
            for (cell, state) in row.each() {
                let velocity = state.velocity.map(|u| u * units.velocity());
                visit(cell, velocity, state.density_deviation * units.pressure(), state.solid_fraction);
            }
        });
    }
}

/// Data of a step on this rank: its piece where ranks are processes, everything at rank 0 where they are threads. Empty if no due
/// writer needs it.
#[derive(Debug)]
pub struct RankOutput {
    /// Steps done.
    pub step: u64,
    /// Physical time (s).
    pub time: f64,
    /// Whose piece this is; nothing if it is the whole.
    pub rank: Option<usize>,
    /// The cells of the fields.
    pub block: Block,
    /// The fluid in these cells.
    pub fields: Option<Fields>,
    /// The particles of this piece, ascending by id.
    pub particles: Vec<Particle>,
    /// Load of the fluid on each of the particles in the last step; nothing without a fluid.
    pub loads: Option<Vec<Load>>,
    /// The contacts of this piece; of the whole in ascending order of the ids.
    pub contacts: Vec<ContactState>,
    /// Particles that hold both of each contact; of the whole these are [`particles`](Self::particles).
    pub(super) partners: Option<Vec<Particle>>,
}

impl RankOutput {
    /// With nothing of a step.
    pub(super) fn empty(rank: Option<usize>, block: Block, step: u64, time: f64) -> Self {
        Self {
            step,
            time,
            rank,
            block,
            fields: None,
            particles: Vec::new(),
            loads: None,
            contacts: Vec::new(),
            partners: None,
        }
    }

    /// Path of the part of a file that this rank writes.
    pub fn path(&self, file: PathBuf) -> PathBuf {
        match self.rank {
            Some(rank) => pieces::piece(&file, rank),
            None => file,
        }
    }

    /// Particles, ascending by id, among which are both of each contact.
    pub fn partners(&self) -> &[Particle] {
        self.partners.as_ref().unwrap_or(&self.particles)
    }
}

/// Data of a step on rank 0 alone. Empty if the writer does not need it.
#[derive(Clone, Debug)]
pub struct RootOutput<'a> {
    /// Steps done.
    pub step: u64,
    /// Physical time (s).
    pub time: f64,
    /// The row of the time series.
    pub row: Option<&'a SeriesRow>,
    /// Totals of what the writer [sums](Writer::sums).
    pub totals: &'a Totals,
    /// The particles of all ranks that the writer [selects](Writer::selects), ascending by id.
    pub selected: Vec<Particle>,
    /// Velocity (m/s) and pressure (Pa) on each of the [planes](slice_planes) of the pictures, as [`Plane::add`] makes them; none
    /// without a fluid.
    pub slices: &'a [Vec<[f32; 4]>],
    /// The contacts of all ranks, in ascending order of the ids.
    pub contacts: &'a [ContactState],
    /// The blocks whose ranks have written the pieces of all files, if they are in pieces.
    pub pieces: Option<&'a Decomposition>,
}

impl<'a> RootOutput<'a> {
    /// With nothing of a step but its totals.
    pub(super) fn of(step: u64, time: f64, totals: &'a Totals) -> Self {
        Self { step, time, row: None, totals, selected: Vec::new(), slices: &[], contacts: &[], pieces: None }
    }
}

/// All writers of a case, in the order in which they write; those that are never due among them.
pub(super) fn of(setup: &Setup) -> Vec<Box<dyn Writer + '_>> {
    let mut writers = vtk::writers(setup);
    #[cfg(feature = "pictures")]
    writers.push(Box::new(pictures::Pictures::new(setup)));
    if let Some(wear) = wear::Wear::of(setup) {
        writers.push(Box::new(wear));
    }
    writers.push(Box::new(series::Series::new(setup)));
    if let Some(profiles) = profiles::Profiles::of(setup) {
        writers.push(Box::new(profiles));
    }
    if let Some(structure) = structure::StructureWriter::of(setup) {
        writers.push(Box::new(structure));
    }
    if let Some(dynamics) = dynamics::DynamicsWriter::of(setup) {
        writers.push(Box::new(dynamics));
    }
    if let Some(steadiness) = steady::Steadiness::of(setup) {
        writers.push(Box::new(steadiness));
    }
    writers
}

/// The planes that the pictures of a case show, each once.
pub fn slice_planes(setup: &Setup) -> Vec<Plane> {
    let mut planes = Vec::new();
    for slice in setup.plan.output.pictures.iter().filter_map(|picture| picture.slice.as_ref()) {
        let plane = Plane::new(&setup.domain, setup.gravity, slice.cut);
        if !planes.contains(&plane) {
            planes.push(plane);
        }
    }
    planes
}

/// Files of one kind, estimated before a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FileEstimate {
    /// Kind of the files.
    pub name: &'static str,
    /// Number of files.
    pub count: u64,
    /// Bytes of each.
    pub bytes: f64,
    /// Quantity on which the bytes depend, for the text behind them.
    pub remark: &'static str,
    /// Time to make each (s).
    pub seconds: f64,
}

impl FileEstimate {
    /// Bytes of all of them.
    pub fn total(&self) -> f64 {
        self.count as f64 * self.bytes
    }

    /// The same in one file that grows.
    fn in_one_file(self) -> Self {
        Self { count: 1, bytes: self.total(), ..self }
    }

    /// With a file whenever a writer is due, the first and the last state included.
    fn of(writer: &dyn Writer, end_step: u64, name: &'static str, bytes: f64, remark: &'static str) -> Self {
        let every = writer.every();
        let due = |n: u64| n + 1 + u64::from(!end_step.is_multiple_of(every));
        Self { name, count: end_step.checked_div(every).map_or(0, due), bytes, remark, seconds: 0.0 }
    }
}

/// Time (s) in which a byte of a file for `ParaView` is gathered and compressed: processor time of `turbid run --threads 1` (release, a
/// shared 2-core virtual machine) of `hindered_settling` with fields, and with surfaces, less that without.
const PACKED_BYTE: f64 = 16e-9;

/// Bytes of a number in a table.
const NUMBER: f64 = 14.0;

/// Bytes of a particle in a checkpoint.
const SAVED_PARTICLE: f64 = 600.0;
/// Checkpoints that are kept, and the new one beside them.
const CHECKPOINTS: u64 = 3;

/// The files that a run of a case writes, by kind.
pub fn file_estimates(setup: &Setup) -> Vec<FileEstimate> {
    let populations = (setup.fluid.as_ref()).map_or(0.0, |_| Simulation::checkpoint_bytes(setup));
    let checkpoints = FileEstimate {
        name: "checkpoints",
        count: CHECKPOINTS,
        bytes: populations + SAVED_PARTICLE * setup.expected_particles() as f64,
        remark: ", the last two and a new one",
        seconds: 0.0,
    };
    (of(setup).iter())
        .filter_map(|writer| writer.estimate(setup.plan.end_step))
        .filter(|files| files.count > 0)
        .chain([checkpoints])
        .collect()
}

/// Estimated time (s) of a run beside its steps: that of its files.
pub fn seconds_of_files(setup: &Setup) -> f64 {
    file_estimates(setup).iter().map(|files| files.count as f64 * files.seconds).sum()
}

/// Threads that a run has, and the cores for them.
fn threads_and_cores(setup: &Setup) -> [usize; 2] {
    match setup.plan.threads {
        0 => [cores(); 2],
        threads => [threads, cores()],
    }
}

fn files_of(setup: &Setup) -> OutputFiles {
    OutputFiles::new(&setup.plan.output.directory)
}
