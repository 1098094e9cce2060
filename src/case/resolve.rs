//! From what the user wrote to what a run needs: every derived number, and every check on the way.

use super::checks::Clock;
use super::file::{Case, Duration, ParticleSection, ShapeSection};
use super::located::Located;
use super::physics::{contact, gravity, time_step, viscosity};
use super::placement::Placer;
use super::scales::Reference;
use super::source::Source;
use super::space::domain;
use super::{OutputPlan, Setup};
use crate::error::{Error, Result};
use crate::fluid::{Collision, Simd};
use crate::particle::Template;
use crate::shape::Sphere;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Reads a case file, applies `--set` options, checks everything and derives every number.
pub fn load(path: &Path, options: &[String]) -> Result<Setup> {
    let source = Source::read(path, options)?;
    let name = path
        .file_stem()
        .map_or_else(|| "case".to_string(), |stem| stem.to_string_lossy().into_owned());
    let folder = path.parent().unwrap_or(Path::new(""));
    resolve(&source, &name, folder)
}

fn resolve(source: &Source, name: &str, folder: &Path) -> Result<Setup> {
    let (case, text) = source.parse::<Case>()?;
    let mut warnings = Vec::new();
    let templates = templates(source, &case)?;
    let diameter = templates[0].shape.equivalent_diameter();
    let domain = domain(source, &case, &templates, &mut warnings)?;
    let gravity = gravity(source, &case)?;
    let density = source.positive(
        "fluid.density",
        &case.fluid.value.density,
        "in kg/m^3; water has 1000",
    )?;
    let reference = Reference {
        diameter,
        density_ratio: templates[0].density / density,
        gravity: gravity.norm(),
    };
    let viscosity = viscosity(source, &case, &reference)?;
    let (units, relaxation_time) = time_step(source, &case, domain.dx, viscosity, density)?;
    let ramp = "in cells; 0.5 is usual";
    let solid_ramp_width = source.satisfies(
        "lattice.solid_ramp_width",
        &case.lattice.value.solid_ramp_width,
        |width| width > 0.0 && width <= 2.0,
        "above 0 and at most 2 cells",
        ramp,
    )?;
    let particles = Placer {
        source,
        case: &case,
        domain,
        templates: &templates,
        folder,
    }
    .place()?;
    let solid: f64 = particles
        .iter()
        .map(|p| templates[p.template as usize].shape.volume())
        .sum();
    let scales = reference.scales(viscosity, solid / domain.volume());
    let clock = Clock {
        time_step: units.dt,
        stokes_time: scales.stokes_time,
    };
    let end_step = source.steps("run.end", &case.run.end, clock)?;
    let substeps = &case.contact.substeps;
    if substeps.value == 0 {
        return Err(source.out_of_range(
            "contact.substeps",
            &substeps.span,
            "0",
            "at least 1",
            "1 is usual",
        ));
    }
    let acceleration = &case.driving.body_acceleration;
    Ok(Setup {
        name: name.to_string(),
        text,
        warnings,
        domain,
        units,
        precision: case.fluid.value.precision,
        simd: simd(source, &case)?,
        dry: false,
        relaxation_time,
        collision: Collision::Bgk,
        solid_ramp_width,
        walls: Vec::new(),
        templates: templates.into(),
        particles,
        contact: contact(source, &case, domain.dx)?,
        substeps: substeps.value,
        gravity,
        force_balance: case.driving.force_balance,
        zero_net_flux: case.driving.zero_net_flux,
        body_acceleration: source
            .finite(
                "driving.body_acceleration",
                &acceleration.span,
                acceleration.value,
            )?
            .into(),
        scales,
        end_step,
        average_from_step: average_from(source, &case, clock, end_step)?,
        threads: case.run.threads,
        output: output(source, &case, clock, end_step, name)?,
    })
}

fn templates(source: &Source, case: &Case) -> Result<Vec<Template>> {
    if case.particles.is_empty() {
        return Err(Error::Input(format!(
            "{}: the case has no [[particles]]; the diameter of the first kind is the reference length, and \
             `count = 0` runs the fluid alone",
            source.path
        )));
    }
    let one = |(index, section): (usize, &Located<ParticleSection>)| {
        let ShapeSection::Sphere(sphere) = &section.value.shape;
        let key = format!("particles.{index}.shape.sphere.diameter");
        let diameter = source.positive(&key, &sphere.diameter, "diameters are in metres")?;
        let key = format!("particles.{index}.density");
        Ok(Template {
            shape: Arc::new(Sphere {
                radius: 0.5 * diameter,
            }),
            material: 0,
            density: source.positive(&key, &section.value.density, "in kg/m^3; glass has 2500")?,
        })
    };
    case.particles.iter().enumerate().map(one).collect()
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
    let every = |key, value: &Option<_>, number| {
        source.interval(&format!("output.{key}"), value.as_ref(), clock, end_step / number)
    };
    Ok(OutputPlan {
        directory,
        series_every: every("series_every", &output.series_every, 1000)?,
        fields_every: every("fields_every", &output.fields_every, 5)?,
        particles_every: every("particles_every", &output.particles_every, 50)?,
        contacts_every: every("particles_every", &output.particles_every, 50)?,
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
