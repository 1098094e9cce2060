//! The run plan: its length and outputs, which may change when a run is resumed.

use super::Setup;
use super::checks::{Clock, Document};
use super::file::{CheckpointEvery, Duration, Every, LoadBalancing, RunEnd, SteadySection, WallShape};
use super::pictures::{PicturePlan, pictures};
use super::statistics::{self, Dynamics, Profile, Structure};
use crate::device;
use crate::document::{Source, names};
use crate::error::Result;
use crate::fluid::{Precision, Simd};
use crate::math::Vec3;
use crate::output::surfaces::are_few;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::time::Duration as WallTime;

/// Wall time between checkpoints if a case says nothing: what is lost if the machine stops.
pub const CHECKPOINT_INTERVAL: WallTime = WallTime::from_secs(600);

/// Length of a run, hardware and output. None of this changes the physics, but the precision rounds it.
#[derive(Clone, Debug, PartialEq)]
pub struct RunPlan {
    /// Number of time steps to run, at most.
    pub end_step: u64,
    /// The run ends before that when it is steady.
    pub steady: Option<Steady>,
    /// Averages are taken from this step on.
    pub average_from_step: u64,
    /// Thread ranks; 0 is one per core.
    pub threads: usize,
    /// The box may be cut into other blocks during the run.
    pub is_cut_anew: bool,
    /// Storage of the populations.
    pub precision: Precision,
    /// Instruction set; `None` takes the best this processor has.
    pub simd: Option<Simd>,
    /// Numbers of the devices that compute the fluid, which ranks take in turn; none is the processor.
    pub devices: Vec<usize>,
    /// Files to write.
    pub output: OutputPlan,
}

/// Steady state that ends a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Steady {
    /// Length of each of the two windows that are compared (steps).
    pub window: u64,
    /// Largest change that counts as none (-).
    pub change: f64,
}

/// Directory and intervals of the output (fluid steps; 0 is never).
#[derive(Clone, Debug, PartialEq)]
pub struct OutputPlan {
    /// Directory for all output.
    pub directory: PathBuf,
    /// Steps between rows of `series.csv`.
    pub series_every: u64,
    /// Steps between field files.
    pub fields_every: u64,
    /// Steps between particle files.
    pub particles_every: u64,
    /// Steps between files of the surfaces of particles.
    pub surfaces_every: u64,
    /// Steps between files of contacts.
    pub contacts_every: u64,
    /// Steps between files of the wear of walls; 0 if it is not kept.
    pub wear_every: u64,
    /// Steps between rows of `profiles.csv`; 0 without profiles.
    pub profiles_every: u64,
    /// The profiles.
    pub profiles: Vec<Profile>,
    /// Structure of the particles.
    pub structure: Option<Structure>,
    /// Motion of the particles over time.
    pub dynamics: Option<Dynamics>,
    /// Columns of `series.csv` that are averaged.
    pub average: Vec<String>,
    /// Ids of the particles whose paths are written, ascending; none for the usual ones.
    pub paths: Vec<u64>,
    /// Steps between pictures.
    pub picture_every: u64,
    /// The pictures.
    pub pictures: Vec<PicturePlan>,
    /// Interval between checkpoints.
    pub checkpoint_every: CheckpointSpacing,
    /// The run leaves a checkpoint at its end.
    pub checkpoint_at_end: bool,
}

/// Interval between the checkpoints that a run writes without a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CheckpointSpacing {
    /// Never.
    Never,
    /// After each interval of this many steps.
    Steps(u64),
    /// After so much wall time each.
    WallTime(WallTime),
}

/// Properties of a case that its schedule depends on.
pub(super) struct Known<'a> {
    pub(super) name: &'a str,
    pub(super) clock: Clock,
    /// Edges of the box (m).
    pub(super) size: Vec3,
    /// Diameter of the first kind of particle (m).
    pub(super) diameter: f64,
    /// The surfaces of the particles are small enough to be written by default.
    pub(super) few: bool,
}

impl RunPlan {
    /// The step from which on means are taken of a run whose last rows are those of step `last`: one that has become steady may end before
    /// its averages were to begin.
    pub(crate) fn averages_from(&self, last: u64) -> u64 {
        match self.steady {
            Some(Steady { window, .. }) => self.average_from_step.min(last.saturating_sub(window)),
            None => self.average_from_step,
        }
    }

    /// The plan that the sections `[run]` and `[output]` describe.
    pub(super) fn new(document: &Document, known: &Known) -> Result<Self> {
        let clock = known.clock;
        let (end_step, steady) = end(document, clock)?;
        let (devices, threads) = (devices(document)?, document.case.run.threads);
        let output = output(document, known, end_step)?;
        if let Some(Steady { window, .. }) = steady.filter(|steady| steady.window < output.series_every) {
            let key = "run.end.steady.over";
            let title = format!(
                "`{key}` is {window} steps, but rows of series.csv, which it is judged by, come every {}",
                output.series_every
            );
            let remedy = "take longer windows, or a shorter `output.series_every`";
            return Err(document.error(key, &title, "no row in it", remedy));
        }
        // What is averaged by default ends with the run.
        let early = steady.map_or(end_step / 3, |steady| end_step - steady.window);
        Ok(Self {
            end_step,
            steady,
            average_from_step: average_from(document, clock, end_step, early)?,
            threads: if threads == 0 { devices.len() } else { threads },
            precision: document.case.fluid.as_ref().map_or(Precision::F32, |fluid| fluid.precision),
            is_cut_anew: document.case.run.load_balancing == LoadBalancing::Dynamic,
            simd: simd(document)?,
            devices,
            output,
        })
    }

    /// Instruction set of the kernels.
    pub(crate) fn instruction_set(&self) -> Simd {
        self.simd.unwrap_or_else(Simd::best)
    }

    /// Numbers of steps whose defaults depend on the length of the run, by key; 0 is never.
    fn spacings(&self) -> [(&'static str, u64); 11] {
        let plan = &self.output;
        [
            ("run.average_from", self.average_from_step),
            ("output.series_every", plan.series_every),
            ("output.fields_every", plan.fields_every),
            ("output.particles_every", plan.particles_every),
            ("output.surfaces_every", plan.surfaces_every),
            ("output.contacts_every", plan.contacts_every),
            ("output.wear_every", plan.wear_every),
            ("output.profiles_every", plan.profiles_every),
            ("output.picture_every", plan.picture_every),
            ("output.structure.every", plan.structure.map_or(0, |structure| structure.every)),
            ("output.dynamics.every", plan.dynamics.map_or(0, |dynamics| dynamics.every)),
        ]
    }
}

/// Changes the schedule of a case by options that name keys of `[run]` and `[output]` only. Defaults that follow from the length
/// of the run keep the number of steps that they had, and stand in the text from now on.
pub(super) fn reschedule(setup: &mut Setup, saved: &str, options: &[String]) -> Result<()> {
    let known = Known {
        name: &setup.provenance.name,
        clock: Clock::of(setup.time_step, setup.fluid.as_ref()),
        size: setup.domain.size(),
        diameter: setup.diameter,
        few: are_few(&setup.templates, setup.expected_counts()),
    };
    let resolve = |options: &[String]| -> Result<(RunPlan, String)> {
        let source = Source::new(title(known.name), saved.to_string(), options);
        refuse_changes_of_the_case(&source)?;
        let document = Document::parse(&source)?;
        Ok((RunPlan::new(&document, &known)?, document.text))
    };
    let (mut plan, mut text) = resolve(options)?;
    // Contacts and surfaces are written as often as particles if nothing else is said.
    let named = |key: &str| {
        let also = match key {
            "output.contacts_every" | "output.surfaces_every" => "output.particles_every",
            "output.structure.every" => "output.structure",
            "output.dynamics.every" => "output.dynamics",
            key => key,
        };
        options.iter().any(|option| names(option, key) || names(option, also))
    };
    let pins: Vec<String> = (setup.plan.spacings().into_iter().zip(plan.spacings()))
        .filter(|((key, old), (_, new))| old != new && !named(key))
        .map(|((key, old), _)| match old {
            0 if key != "run.average_from" => format!("{key}=\"never\""),
            steps => format!("{key}={{ steps = {steps} }}"),
        })
        .collect();
    if !pins.is_empty() {
        (plan, text) = resolve(&[options, &pins[..]].concat())?;
    }
    (setup.plan, setup.provenance.text) = (plan, text);
    Ok(())
}

/// The options that fit a saved case to this machine, which may lack what the one had that the run comes from.
pub(crate) fn of_machine(options: &[String]) -> Vec<String> {
    let is_one = |option: &&String| ["run.simd", "run.device"].iter().any(|key| names(option, key));
    options.iter().filter(is_one).cloned().collect()
}

/// The name of a saved case in messages.
pub(super) fn title(name: &str) -> String {
    format!("saved case {name}")
}

/// Refuses options that make another case of this one.
fn refuse_changes_of_the_case(source: &Source) -> Result<()> {
    for (text, path, span) in source.options() {
        let remedy = match path[..] {
            ["output", "directory", ..] => {
                "a run is resumed in its own directory; `--out NEW` makes a branch of it elsewhere"
            }
            // A program may be elsewhere by now, or slower.
            ["run" | "output", _, ..] | ["dem", "engine", "command" | "folder" | "timeout", ..] => {
                continue;
            }
            _ => {
                "only keys below `run.` and `output.` can; any other change makes another run: `turbid resume DIR --out NEW` branches off \
                     one, which continues with the fluid and the particles"
            }
        };
        let title = format!("`--set {text}` cannot change a run that is resumed");
        return Err(source.error(span, &title, "not this key", remedy));
    }
    Ok(())
}

/// The last step of a run, and the steady state that ends it before.
fn end(document: &Document, clock: Clock) -> Result<(u64, Option<Steady>)> {
    let key = "run.end";
    let duration = match document.case.run.end {
        RunEnd::Time(time) => Duration::Time(time),
        RunEnd::Steps(steps) => Duration::Steps(steps),
        RunEnd::StokesTimes(times) => Duration::StokesTimes(times),
        RunEnd::Steady(SteadySection { over, at_most, change }) => {
            let [over_key, most_key] = ["over", "at_most"].map(|name| format!("{key}.steady.{name}"));
            let window = document.steps(&over_key, over, clock)?;
            let end_step = document.steps(&most_key, at_most, clock)?;
            if 2 * window > end_step {
                let marks = [(&*over_key, "each of two windows"), (&*most_key, "the run ends here")];
                let title = format!(
                    "two windows of {window} steps do not fit into the {end_step} steps of `{most_key}`"
                );
                return Err(document.error_at(&marks, &title, "take shorter windows, or run longer"));
            }
            return Ok((end_step, Some(Steady { window, change })));
        }
    };
    Ok((document.steps(key, duration, clock)?, None))
}

fn average_from(document: &Document, clock: Clock, end_step: u64, early: u64) -> Result<u64> {
    let key = "run.average_from";
    let step = match document.case.run.average_from {
        None => return Ok(early),
        Some(Duration::Steps(0)) => 0,
        Some(from) => document.steps(key, from, clock)?,
    };
    if step >= end_step {
        return Err(document.error_at(
            &[(key, "averages from here"), ("run.end", "the run ends here")],
            &format!("`{key}` is step {step}, but the run ends at step {end_step}"),
            "average from an earlier time, or run longer",
        ));
    }
    Ok(step)
}

fn output(document: &Document, known: &Known, end_step: u64) -> Result<OutputPlan> {
    let &Known { name, clock, size, few, .. } = known;
    let output = &document.case.output;
    let directory = match &output.directory {
        Some(directory) if directory.trim().is_empty() => {
            let title = "`output.directory` is empty";
            let remedy = "\".\" is the current one";
            return Err(document.error("output.directory", title, "no directory", remedy));
        }
        Some(directory) => PathBuf::from(directory),
        None => Path::new("out").join(name),
    };
    if output.series_every == Some(Every::Never) {
        return Err(document.error(
            "output.series_every",
            "`output.series_every` is \"never\", but the means of a run are taken from the rows of series.csv",
            "no rows, no means",
            "give an interval, e.g. { steps = 100 }, or leave the key out",
        ));
    }
    if output.picture_every.is_some_and(|every| every != Every::Never) && !cfg!(feature = "pictures") {
        return Err(document.error(
            "output.picture_every",
            "`output.picture_every` needs the cargo feature `pictures`, which this turbid was built without",
            "pictures",
            "leave the key out or give \"never\", or build with the default features",
        ));
    }
    let dry = document.case.dry.is_some();
    if dry && output.fields_every.is_some_and(|every| every != Every::Never) {
        let title = "`output.fields_every` has no meaning in a dry run";
        return Err(document.error("output.fields_every", title, "there is no field to write", "remove it"));
    }
    let has_mesh = document.case.walls.iter().any(|wall| matches!(wall.shape, WallShape::Mesh(_)));
    if !has_mesh && output.wear_every.is_some_and(|every| every != Every::Never) {
        let title = "`output.wear_every` is that of walls from meshes, and this case has none";
        let remedy = "give a wall a `mesh` (docs/cases.md), or leave the key out";
        return Err(document.error("output.wear_every", title, "no facets", remedy));
    }
    let every = |key: &str, value: Option<Every>, number: u64| {
        document.interval(&format!("output.{key}"), value, clock, end_step / number)
    };
    let particles_every = every("particles_every", output.particles_every, 50)?;
    let checkpoint_every = checkpoint_every(document, clock)?;
    Ok(OutputPlan {
        directory,
        series_every: every("series_every", output.series_every, 1000)?,
        fields_every: if dry { 0 } else { every("fields_every", output.fields_every, 5)? },
        particles_every,
        surfaces_every: match output.surfaces_every {
            None => u64::from(few) * particles_every,
            asked => every("surfaces_every", asked, 50)?,
        },
        contacts_every: match output.contacts_every {
            None => particles_every,
            asked => every("contacts_every", asked, 50)?,
        },
        wear_every: match output.wear_every {
            None => 0,
            asked => every("wear_every", asked, 50)?,
        },
        picture_every: match output.picture_every {
            None if !cfg!(feature = "pictures") => 0,
            asked => every("picture_every", asked, 10)?,
        },
        profiles_every: match output.profiles[..] {
            [] => 0,
            _ => every("profiles_every", output.profiles_every, 100)?,
        },
        profiles: statistics::profiles(document, known)?,
        structure: statistics::structure(document, known, end_step)?,
        dynamics: statistics::dynamics(document, known, end_step)?,
        average: statistics::averaged(document)?,
        paths: output.paths.iter().copied().collect::<BTreeSet<_>>().into_iter().collect(),
        pictures: pictures(document, size)?,
        checkpoint_every,
        checkpoint_at_end: output.checkpoint_at_end.unwrap_or(checkpoint_every != CheckpointSpacing::Never),
    })
}

fn checkpoint_every(document: &Document, clock: Clock) -> Result<CheckpointSpacing> {
    let duration = match document.case.output.checkpoint_every {
        // LIGGGHTS and LAMMPS round differently once they have been saved, and others may: results would depend on how fast the machine is.
        None if !document.case.dem.engine.is_native() => return Ok(CheckpointSpacing::Never),
        None => return Ok(CheckpointSpacing::WallTime(CHECKPOINT_INTERVAL)),
        Some(CheckpointEvery::Never) => return Ok(CheckpointSpacing::Never),
        Some(CheckpointEvery::WallTime(seconds)) => {
            return Ok(CheckpointSpacing::WallTime(WallTime::from_secs_f64(seconds)));
        }
        Some(CheckpointEvery::Time(x)) => Duration::Time(x),
        Some(CheckpointEvery::Steps(n)) => Duration::Steps(n),
        Some(CheckpointEvery::StokesTimes(x)) => Duration::StokesTimes(x),
    };
    Ok(CheckpointSpacing::Steps(document.steps("output.checkpoint_every", duration, clock)?))
}

/// The instruction set asked for, if this processor has it.
fn simd(document: &Document) -> Result<Option<Simd>> {
    match document.case.run.simd {
        Some(asked) if !asked.is_available() => {
            let best = Simd::best().name();
            let remedy =
                format!("leave the key out; the best here is {best}, and results do not depend on it");
            Err(document.out_of_range("run.simd", asked.name(), "one this processor has", &remedy))
        }
        asked => Ok(asked),
    }
}

/// Numbers of the devices asked for, if they are there and can do what the case needs.
fn devices(document: &Document) -> Result<Vec<usize>> {
    let Some(asked) = document.case.run.device.as_deref().filter(|asked| *asked != "cpu") else {
        return Ok(Vec::new());
    };
    let refused =
        |wanted: &str, remedy: &str| Err(document.out_of_range("run.device", asked, wanted, remedy));
    let listed = |list: &str| list.split(',').map(|number| number.parse().ok()).collect();
    let numbers: Option<Vec<usize>> = match asked.strip_prefix("gpu") {
        Some("") => Some(vec![0]),
        list => list.and_then(|list| listed(list.strip_prefix(':')?)),
    };
    let Some(numbers) = numbers else {
        let wanted = "\"cpu\", \"gpu\", \"gpu:1\", or \"gpu:0,1\" for ranks that take devices in turn";
        return refused(wanted, "`turbid doctor` lists the devices");
    };
    if document.case.fluid.is_none() {
        return refused("\"cpu\" without a fluid", "leave the key out; particles are moved by the processor");
    }
    if !device::HAS_DRIVERS {
        let wanted = "\"cpu\", as this program was built without devices";
        return refused(wanted, "build it with the cargo feature `gpu`");
    }
    match numbers.iter().find_map(|&number| device::Device::open(number).err()) {
        None => Ok(numbers),
        Some(error) => refused("a device that is here", &error.to_string()),
    }
}

#[cfg(test)]
mod tests;
