//! How long to run and what to write: what may change when a run goes on, and the numbers that then stay.

use super::checks::{Clock, at};
use super::file::{Case, CheckpointEvery, Duration, EngineKind, Every};
use super::overrides::option_keys;
use super::source::Source;
use super::{CheckpointSpacing, OutputPlan, RunPlan, Setup};
use crate::error::Result;
use crate::fluid::{Precision, Simd};
use crate::math::Vec3;
use crate::particle::{FEW_TRIANGLES, Template, surface_triangles};
use std::path::{Path, PathBuf};
use std::time::Duration as WallTime;

/// Wall time between checkpoints if a case says nothing: what is lost if the machine stops.
pub const CHECKPOINT_INTERVAL: WallTime = WallTime::from_secs(600);

/// Properties of a case that its schedule depends on.
pub(super) struct Known<'a> {
    pub(super) name: &'a str,
    pub(super) clock: Clock,
    /// Edges of the box (m).
    pub(super) size: Vec3,
    /// The surfaces of the particles are small enough to be written by default.
    pub(super) few: bool,
}

impl RunPlan {
    /// What the sections `[run]` and `[output]` say of a case of which this much is known already.
    pub(super) fn new(source: &Source, case: &Case, known: &Known) -> Result<Self> {
        let clock = known.clock;
        let end_step = source.steps("run.end", &case.run.end, clock)?;
        Ok(Self {
            end_step,
            average_from_step: average_from(source, case, clock, end_step)?,
            threads: case.run.threads,
            precision: case.fluid.as_ref().map_or(Precision::F32, |fluid| fluid.value.precision),
            simd: simd(source, case)?,
            output: output(source, case, known, end_step)?,
        })
    }

    /// Numbers of steps whose defaults depend on the length of the run, by key; 0 is never.
    fn spacings(&self) -> [(&'static str, u64); 7] {
        let plan = &self.output;
        [
            ("run.average_from", self.average_from_step),
            ("output.series_every", plan.series_every),
            ("output.fields_every", plan.fields_every),
            ("output.particles_every", plan.particles_every),
            ("output.surfaces_every", plan.surfaces_every),
            ("output.contacts_every", plan.contacts_every),
            ("output.picture_every", plan.picture_every),
        ]
    }
}

/// Changes the schedule of a case as `options` ask, who name keys of `[run]` and `[output]` only. What has its default by the
/// length of the run keeps the number of steps it has, and stands in the text from now on.
pub(super) fn reschedule(setup: &mut Setup, saved: &str, options: &[String]) -> Result<()> {
    let particles = setup.particles.iter().map(|p| (p.template as usize, 1));
    let known = Known {
        name: &setup.provenance.name,
        clock: Clock::of(setup.time_step, setup.fluid.as_ref()),
        size: setup.domain.size(),
        few: are_few(&setup.templates, particles),
    };
    let resolve = |options: &[String]| -> Result<(RunPlan, String)> {
        let source = Source::new(title(known.name), saved.to_string(), options);
        source.refuse_changes_of_the_case()?;
        let (case, text) = source.parse::<Case>()?;
        Ok((RunPlan::new(&source, &case, &known)?, text))
    };
    let (mut plan, mut text) = resolve(options)?;
    // Contacts and surfaces are written as often as particles if nothing else is said.
    let named = |key: &str| {
        let also = match key {
            "output.contacts_every" | "output.surfaces_every" => "output.particles_every",
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

/// True if the surfaces of particles, given as numbers of particles by template, are small enough to be written by default.
pub(super) fn are_few(templates: &[Template], counts: impl IntoIterator<Item = (usize, usize)>) -> bool {
    surface_triangles(templates, counts) <= FEW_TRIANGLES
}

/// Whether an option sets this key or one below it.
pub(super) fn names(option: &str, key: &str) -> bool {
    let path = option_keys(option);
    key.split('.').enumerate().all(|(n, key)| path.get(n).is_some_and(|given| given == key))
}

/// How messages call a case that was saved.
pub(super) fn title(name: &str) -> String {
    format!("saved case {name}")
}

impl Source {
    /// Refuses options that make another case of this one.
    fn refuse_changes_of_the_case(&self) -> Result<()> {
        for option in &self.options {
            let text = &self.text[option.span.clone()];
            let path = option_keys(text);
            let path: Vec<&str> = path.iter().map(String::as_str).collect();
            let remedy = match path[..] {
                ["output", "directory", ..] => {
                    "it goes on in its own directory; a copy of that goes on as well"
                }
                ["run" | "output", _, ..] => continue,
                _ => {
                    "only keys below `run.` and `output.` can; with any other change it is another run, for `turbid run`"
                }
            };
            let title = format!("`--set {text}` cannot change a run that goes on");
            return Err(self.error(&option.span, &title, "not this key", remedy));
        }
        Ok(())
    }
}

fn average_from(source: &Source, case: &Case, clock: Clock, end_step: u64) -> Result<u64> {
    let Some(from) = &case.run.average_from else {
        return Ok(end_step / 3);
    };
    let step = match from.value {
        Duration::Steps(0) => 0,
        _ => source.steps("run.average_from", from, clock)?,
    };
    if step >= end_step {
        return Err(source.error_at(
            &[(&from.span, "averages from here"), (&case.run.end.span, "the run ends here")],
            &format!("`run.average_from` is step {step}, but the run ends at step {end_step}"),
            "average from an earlier time, or run longer",
        ));
    }
    Ok(step)
}

fn output(source: &Source, case: &Case, known: &Known, end_step: u64) -> Result<OutputPlan> {
    let &Known { name, clock, size, few } = known;
    let output = &case.output;
    let directory = match &output.directory {
        Some(directory) if directory.value.trim().is_empty() => {
            let title = "`output.directory` is empty";
            return Err(source.error(&directory.span, title, "no directory", "\".\" is the current one"));
        }
        Some(directory) => PathBuf::from(&directory.value),
        None => Path::new("out").join(name),
    };
    if let Some(every) = &output.series_every
        && every.value == Every::Never
    {
        return Err(source.error(
            &every.span,
            "`output.series_every` is \"never\", but the means of a run are taken from the rows of series.csv",
            "no rows, no means",
            "give an interval, e.g. { steps = 100 }, or leave the key out",
        ));
    }
    if let Some(pictures) = &output.picture_every
        && pictures.value != Every::Never
        && !cfg!(feature = "pictures")
    {
        return Err(source.error(
            &pictures.span,
            "`output.picture_every` needs the cargo feature `pictures`, which this turbid was built without",
            "pictures",
            "leave the key out or give \"never\", or build with the default features",
        ));
    }
    let every = |key, value: &Option<_>, number| {
        source.interval(&format!("output.{key}"), value.as_ref(), clock, end_step / number)
    };
    if let (Some(_), Some(fields)) = (&case.dry, &output.fields_every)
        && fields.value != Every::Never
    {
        let title = "`output.fields_every` has no meaning in a dry run";
        return Err(source.error(&fields.span, title, "there is no field to write", "remove it"));
    }
    let particles_every = every("particles_every", &output.particles_every, 50)?;
    Ok(OutputPlan {
        directory,
        series_every: every("series_every", &output.series_every, 1000)?,
        fields_every: match &case.dry {
            Some(_) => 0,
            None => every("fields_every", &output.fields_every, 5)?,
        },
        particles_every,
        surfaces_every: match &output.surfaces_every {
            Some(_) => every("surfaces_every", &output.surfaces_every, 50)?,
            None if few => particles_every,
            None => 0,
        },
        contacts_every: match &output.contacts_every {
            Some(_) => every("contacts_every", &output.contacts_every, 50)?,
            None => particles_every,
        },
        picture_every: match &output.picture_every {
            None if !cfg!(feature = "pictures") => 0,
            asked => every("picture_every", asked, 10)?,
        },
        picture_plane: picture_plane(source, case, size)?,
        picture_range: match &output.picture_range {
            Some(speed) => Some(source.positive("output.picture_range", speed, "a speed in m/s")?),
            None => None,
        },
        checkpoint_every: checkpoint_every(source, case, clock)?,
    })
}

/// Axis and coordinate of the plane of pictures.
fn picture_plane(source: &Source, case: &Case, size: Vec3) -> Result<Option<(usize, Option<f64>)>> {
    let Some(plane) = &case.output.picture_plane else {
        return Ok(None);
    };
    let axis = plane.value.normal as usize;
    let Some(position) = &plane.value.position else {
        return Ok(Some((axis, None)));
    };
    let key = "output.picture_plane.position";
    if case.dry.is_some() {
        let title =
            format!("`{key}` has no meaning in a dry run, whose pictures show all particles from the side");
        return Err(source.error(&position.span, &title, "there is no slice", "remove it"));
    }
    let length = size[axis];
    let within = |x: f64| (0.0..=length).contains(&x);
    let wanted = format!("from 0 to {length}, the length of the box");
    source.satisfies(key, position, within, &wanted, "in metres")?;
    Ok(Some((axis, Some(position.value))))
}

fn checkpoint_every(source: &Source, case: &Case, clock: Clock) -> Result<CheckpointSpacing> {
    const KEY: &str = "output.checkpoint_every";
    let Some(every) = &case.output.checkpoint_every else {
        return Ok(match case.dem.engine.value {
            EngineKind::Native => CheckpointSpacing::WallTime(CHECKPOINT_INTERVAL),
            // LIGGGHTS rounds differently once it has been saved: results would depend on how fast the machine is.
            EngineKind::Liggghts => CheckpointSpacing::Never,
        });
    };
    let steps = match every.value {
        CheckpointEvery::Never => return Ok(CheckpointSpacing::Never),
        CheckpointEvery::WallTime(seconds) => {
            let (seconds, remedy) = (at(&every.span, seconds), "in seconds; \"never\" switches it off");
            let seconds =
                source.satisfies(KEY, &seconds, |s| s > 0.0 && s < 1e9, "above 0 and below 1e9", remedy)?;
            return Ok(CheckpointSpacing::WallTime(WallTime::from_secs_f64(seconds)));
        }
        CheckpointEvery::Time(x) => Every::Time(x),
        CheckpointEvery::Steps(n) => Every::Steps(n),
        CheckpointEvery::StokesTimes(x) => Every::StokesTimes(x),
    };
    let steps = source.interval(KEY, Some(&at(&every.span, steps)), clock, 1)?;
    Ok(CheckpointSpacing::Steps(steps))
}

/// The instruction set asked for, if this processor has it.
fn simd(source: &Source, case: &Case) -> Result<Option<Simd>> {
    let Some(asked) = &case.run.simd else {
        return Ok(None);
    };
    if asked.value.is_available() {
        return Ok(Some(asked.value));
    }
    let remedy = format!(
        "leave the key out; the best here is {}, and results do not depend on it",
        Simd::best().name()
    );
    Err(source.out_of_range("run.simd", &asked.span, asked.value.name(), "one this processor has", &remedy))
}

#[cfg(test)]
mod tests;
