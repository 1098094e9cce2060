//! `turbid pack`.

use super::placing::{part_of, remove};
use super::terminal::{remark, say};
use super::{PackArguments, check_picture, load_from};
use std::path::Path;
use turbid::error::{Error, Result};
use turbid::output::directory::{self, refuse_input};
use turbid::output::{OutputFiles, Summary, write_bytes};
use turbid::packing::positions::{self, Row};
use turbid::simulation::{particles_in, write_start};

pub(super) fn pack(arguments: &PackArguments) -> Result<()> {
    if let Some(picture) = &arguments.picture {
        check_picture(picture)?;
    }
    let part = part_of(&arguments.out);
    let (rows, what, notes) = match (&arguments.case, &arguments.from) {
        (Some(case), _) => {
            let setup = load_from(case, &arguments.changes, Some(&part)).inspect_err(|_| remove(&part))?;
            refuse_input(&arguments.out, &setup.provenance.inputs)?;
            if let Some(picture) = &arguments.picture {
                refuse_input(picture, &setup.provenance.inputs)?;
                write_start(picture, &setup)?;
            }
            let rows = setup.particles.iter().map(|particle| {
                let template = particle.template as usize;
                Row {
                    id: particle.id,
                    kind: setup.sections[template],
                    diameter: setup.templates[template].shape.equivalent_diameter(),
                    position: particle.position(),
                    orientation: particle.orientation_given(&setup.frames[template]),
                    velocity: particle.velocity(),
                    angular_velocity: particle.angular_velocity(),
                }
            });
            let fraction = setup.volume_fraction;
            (rows.collect(), format!("volume fraction {fraction:.6}"), Vec::new())
        }
        (None, Some(directory)) => of_a_run(directory, arguments)?,
        (None, None) => unreachable!("the command line asks for one of them"),
    };
    let out = &arguments.out;
    let count = rows.len();
    write_bytes(out, positions::format(rows).as_bytes())?;
    if arguments.from.is_none() {
        remove(&part);
    }
    say(&format!("{count} particles, {what}, written to {}", out.display()));
    for note in notes {
        remark("note", &note);
    }
    Ok(())
}

/// Notes on what the file of a run's particles lacks: its flow, and the end of a run that was stopped.
fn notes(directory: &Path) -> Vec<String> {
    let (summary, shown) = (Summary::read(&OutputFiles::new(directory).summary()).ok(), directory.display());
    let state = match &summary {
        None => Some("has left no summary: it is still running, or was killed".to_string()),
        Some(Summary { interrupted: true, steps, .. }) => {
            Some(format!("was interrupted after {steps} steps, before its end"))
        }
        Some(_) => None,
    };
    let flow = summary.is_none_or(|summary| !summary.dry).then(|| {
        format!(
            "the file has no flow: in a case that reads it the fluid starts at rest; turbid resume {shown} --out NEW continues with the \
             flow"
        )
    });
    state
        .map(|state| format!("the run in {shown} {state}; turbid resume {shown} completes it"))
        .into_iter()
        .chain(flow)
        .collect()
}

/// The particles that a run has left at a step, the last one if none is asked for, which step that is, and notes.
fn of_a_run(directory: &Path, arguments: &PackArguments) -> Result<(Vec<Row>, String, Vec<String>)> {
    let files = OutputFiles::new(directory);
    let steps = files.steps(directory::PARTICLES)?;
    let Some(&last) = steps.last() else {
        return Err(Error::Input(format!(
            "{} holds no files of particles (particles/particles_*.vtp); --from names the output directory of a run whose \
             output.particles_every is not \"never\"",
            directory.display()
        )));
    };
    let step = arguments.step.unwrap_or(last);
    if !steps.contains(&step) {
        let near = steps.iter().min_by_key(|known| known.abs_diff(step));
        return Err(Error::Input(format!(
            "{} holds no particles of step {step}; it has those of {} steps from {} to {last}, the nearest of them {}",
            directory.display(),
            steps.len(),
            steps[0],
            near.unwrap_or(&last)
        )));
    }
    refuse_input(&arguments.out, &[files.file(directory::PARTICLES, step)])?;
    let mut rows = particles_in(&files.file(directory::PARTICLES, step))?;
    rows.sort_unstable_by_key(|row| row.id);
    let fastest = |rows: &[Row]| rows.iter().map(|row| row.velocity.norm()).fold(0.0, f64::max);
    let what = format!("those of step {step}, the fastest at {:.3e} m/s", fastest(&rows));
    Ok((rows, what, notes(directory)))
}
