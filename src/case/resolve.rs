//! From what the user wrote to what a run needs: every derived number, and every check on the way.

use super::checks::Clock;
use super::dry::{self, Medium};
use super::engine::{engine, refuse_walls};
use super::file::{Case, Duration, Every};
use super::kinds::kinds;
use super::materials::Materials;
use super::physics::{collision, gravity, time_step, viscosity};
use super::placement::Placer;
use super::scales::Reference;
use super::source::Source;
use super::space::{domain, refuse_double_contacts};
use super::walls::{free_volume, walls};
use super::{OutputPlan, Setup};
use crate::contact::Contour;
use crate::domain::Domain;
use crate::error::Result;
use crate::fluid::{Collision, Precision, Simd};
use crate::math::Vec3;
use crate::units::Units;
use crate::wall::Wall;
use std::path::{Path, PathBuf};

/// Most sub-steps of the particles in a step.
const MAX_SUBSTEPS: u32 = 10_000;

/// Reads a case file, applies `--set` options, checks everything and derives every number.
pub fn load(path: &Path, options: &[String]) -> Result<Setup> {
    let source = Source::read(path, options)?;
    let name = path
        .file_stem()
        .map_or_else(|| "case".to_string(), |stem| stem.to_string_lossy().into_owned());
    let folder = path.parent().unwrap_or(Path::new(""));
    resolve(&source, &name, folder)
}

/// As [`load`], for a text that is no file; what it names is looked for in the current directory.
pub fn from_text(text: &str, name: &str, options: &[String]) -> Result<Setup> {
    let source = Source::new(name.to_string(), text.to_string(), options);
    resolve(&source, name, Path::new(""))
}

fn resolve(source: &Source, name: &str, folder: &Path) -> Result<Setup> {
    let (case, text) = source.parse::<Case>()?;
    let mut warnings = Vec::new();
    let medium = Medium::of(source, &case)?;
    let materials = Materials::new(source, &case)?;
    let kinds = kinds(source, &case, &materials, folder)?;
    let templates = &kinds.templates;
    let (lattice, grown) = match &medium {
        Medium::Wet(_, lattice) => (Some(&lattice.value), &case.contact.enlargement),
        Medium::Dry(dry) => (None, &dry.value.enlargement),
    };
    let domain = domain(source, &case, lattice, &kinds, &mut warnings)?;
    let enlargement = match &medium {
        Medium::Wet(..) => domain.dx * source.non_negative("contact.enlargement", grown, "in cells")?,
        Medium::Dry(_) => source.non_negative("dry.enlargement", grown, "in metres")?,
    };
    let contact = materials.contact(source, &case, enlargement)?;
    let engine = engine(source, &case)?;
    let reach = (templates.iter())
        .map(|template| Contour::new(template.shape.clone(), enlargement).reach())
        .fold(0.0, f64::max);
    let walls = walls(source, &case, &domain, &materials, reach)?;
    refuse_walls(source, &case, &engine, &walls)?;
    let gravity = gravity(source, &case)?;
    let substeps = substeps(source, &case)?;
    let reference = |density: f64| Reference {
        diameter: kinds.diameter,
        density_ratio: templates[0].density / density,
        gravity: gravity.norm(),
    };
    // Density and viscosity of the fluid, if there is one.
    let mut fluid = None;
    let (units, relaxation_time, operator, solid_ramp_width, precision);
    match &medium {
        Medium::Wet(section, lattice) => {
            let density = source.positive(
                "fluid.density",
                &section.value.density,
                "in kg/m^3; water has 1000",
            )?;
            let viscosity = viscosity(source, section, &reference(density))?;
            fluid = Some((density, viscosity));
            (units, relaxation_time) = time_step(source, lattice, domain.dx, viscosity, density)?;
            operator = collision(source, &lattice.value)?;
            precision = section.value.precision;
            solid_ramp_width = source.satisfies(
                "lattice.solid_ramp_width",
                &lattice.value.solid_ramp_width,
                |width| width > 0.0 && width <= 2.0,
                "above 0 and at most 2 cells",
                "in cells; 0.5 is usual",
            )?;
        }
        Medium::Dry(section) => {
            units = Units {
                dx: domain.dx,
                dt: dry::time_step(source, section, substeps, templates, &materials)?,
                density: 0.0,
            };
            (relaxation_time, operator) = (1.0, Collision::Bgk);
            (solid_ramp_width, precision) = (0.5, Precision::F32);
        }
    }
    let placer = Placer {
        source,
        case: &case,
        domain,
        kinds: &kinds,
        walls: &walls,
        free_volume: free_volume(&domain, &walls),
        folder,
    };
    let particles = placer.place()?;
    if contact.is_some() {
        refuse_double_contacts(source, &case, &domain, templates, &particles, enlargement)?;
    }
    let solid: f64 = particles
        .iter()
        .map(|p| templates[p.template as usize].shape.volume())
        .sum();
    let volume_fraction = solid / placer.free_volume;
    let scales = match fluid {
        Some((density, viscosity)) => reference(density).scales(viscosity, volume_fraction),
        None => dry::scales(kinds.diameter, volume_fraction),
    };
    let clock = Clock {
        time_step: units.dt,
        stokes_time: scales.stokes_time,
    };
    let end_step = source.steps("run.end", &case.run.end, clock)?;
    let acceleration = &case.driving.body_acceleration;
    let walls: Vec<Wall> = walls.into_iter().map(|placed| placed.wall).collect();
    Ok(Setup {
        name: name.to_string(),
        text,
        warnings,
        domain,
        units,
        precision,
        simd: simd(source, &case)?,
        dry: fluid.is_none(),
        relaxation_time,
        collision: operator,
        solid_ramp_width,
        frames: kinds.frames(),
        templates: kinds.templates.into(),
        particles,
        contact,
        engine,
        substeps,
        gravity,
        force_balance: case
            .driving
            .force_balance
            .as_ref()
            .map_or_else(Default::default, |b| b.value),
        zero_net_flux: match &case.driving.zero_net_flux {
            Some(given) => given.value,
            None => fluid.is_some() && flux_is_known_to_vanish(&domain, &walls, gravity),
        },
        body_acceleration: source
            .finite(
                "driving.body_acceleration",
                &acceleration.span,
                acceleration.value,
            )?
            .into(),
        walls,
        scales,
        end_step,
        average_from_step: average_from(source, &case, clock, end_step)?,
        threads: case.run.threads,
        output: output(source, &case, clock, end_step, name)?,
    })
}

/// Whether nothing but the controller keeps the fluid from falling or rising, and nothing drags it along.
fn flux_is_known_to_vanish(domain: &Domain, walls: &[Wall], gravity: Vec3) -> bool {
    let closed = (0..3).any(|i| !domain.periodic[i] && gravity[i] != 0.0);
    let moving = walls
        .iter()
        .any(|wall| wall.motion.velocity != Vec3::zeros() || wall.motion.angular_velocity != Vec3::zeros());
    !closed && !moving
}

fn substeps(source: &Source, case: &Case) -> Result<u32> {
    let substeps = &case.contact.substeps;
    if (1..=MAX_SUBSTEPS).contains(&substeps.value) {
        return Ok(substeps.value);
    }
    let wanted = format!("at least 1 and at most {MAX_SUBSTEPS}");
    Err(source.out_of_range(
        "contact.substeps",
        &substeps.span,
        &substeps.value.to_string(),
        &wanted,
        "1 is usual",
    ))
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
            &[
                (&from.span, "averages from here"),
                (&case.run.end.span, "the run ends here"),
            ],
            &format!("`run.average_from` is step {step}, but the run ends at step {end_step}"),
            "average from an earlier time, or run longer",
        ));
    }
    Ok(step)
}

fn output(source: &Source, case: &Case, clock: Clock, end_step: u64, name: &str) -> Result<OutputPlan> {
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
        fields_every: every("fields_every", &output.fields_every, 5)?,
        particles_every,
        contacts_every: match &output.contacts_every {
            Some(_) => every("contacts_every", &output.contacts_every, 50)?,
            None => particles_every,
        },
        picture_every: every("picture_every", &output.picture_every, 10)?,
    })
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
    Err(source.out_of_range(
        "run.simd",
        &asked.span,
        asked.value.name(),
        "one this processor has",
        &remedy,
    ))
}

#[cfg(test)]
mod tests;
