//! From what the user wrote to what a run needs: every derived number, and every check on the way.

use super::checks::{Clock, at};
use super::file::{Case, GeometryKind, ShapeSection};
use super::forms::{Gravity, Size};
use super::placement::Placer;
use super::scales::Reference;
use super::source::Source;
use super::{OutputPlan, Setup};
use crate::contact::{ContactParams, Geometry};
use crate::domain::Domain;
use crate::error::{Error, Result};
use crate::math::Vec3;
use crate::particle::Template;
use crate::shape::Sphere;
use crate::units::Units;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// More cells than any machine of today holds.
const MAX_CELLS: f64 = 1e12;

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
    let solid_ramp_width = source.positive(
        "lattice.solid_ramp_width",
        &case.lattice.value.solid_ramp_width,
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
        simd: case.run.simd,
        relaxation_time,
        solid_ramp_width,
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
    let one = |(index, section): (usize, &super::located::Located<super::file::ParticleSection>)| {
        let ShapeSection::Sphere(sphere) = &section.value.shape;
        let key = format!("particles.{index}.shape.sphere.diameter");
        let diameter = source.positive(&key, &sphere.diameter, "diameters are in metres")?;
        let key = format!("particles.{index}.density");
        Ok(Template {
            shape: Arc::new(Sphere {
                radius: 0.5 * diameter,
            }),
            density: source.positive(&key, &section.value.density, "in kg/m^3; glass has 2500")?,
        })
    };
    case.particles.iter().enumerate().map(one).collect()
}

fn domain(
    source: &Source,
    case: &Case,
    templates: &[Template],
    warnings: &mut Vec<String>,
) -> Result<Domain> {
    let periodic = &case.domain.periodic;
    if periodic.value != [true; 3] {
        return Err(source.error(
            &periodic.span,
            "walls are not part of this version: every direction is periodic",
            "must be [true, true, true]",
            "write periodic = [true, true, true], or leave the key out",
        ));
    }
    let diameter = templates[0].shape.equivalent_diameter();
    let per_diameter = source.satisfies(
        "lattice.cells_per_diameter",
        &case.lattice.value.cells_per_diameter,
        |n| n >= 2.0,
        "a finite number of at least 2",
        "9 to 27 cells are usual",
    )?;
    let dx = diameter / per_diameter;
    let size = &case.domain.size;
    let (edges, unit) = match &size.value {
        Size::Metres(edges) => (edges, diameter),
        Size::Relative(relative) => (&relative.diameters, 1.0),
    };
    let mut cells = [0; 3];
    let mut total = 1.0;
    let mut rounded = false;
    for i in 0..3 {
        let edge = source.positive(
            "domain.size",
            &edges[i],
            "three edges in metres, or { diameters = [6, 6, 6] }",
        )?;
        let exact = edge / unit * per_diameter;
        total *= exact.max(1.0);
        if total > MAX_CELLS {
            let title = format!("the box has more than {MAX_CELLS:e} cells");
            let remedy = "take a smaller `domain.size` or fewer `lattice.cells_per_diameter`";
            return Err(source.error(&edges[i].span, &title, "too large", remedy));
        }
        cells[i] = exact.round().max(1.0) as usize;
        rounded |= (exact - cells[i] as f64).abs() > 1e-9 * exact;
    }
    let domain = Domain { cells, dx };
    let used = domain.size();
    if rounded {
        let (x, y, z) = (used.x, used.y, used.z);
        warnings.push(source.warning(
            &size.span,
            &format!("the box is not a whole number of cells; it is {x:.6e} x {y:.6e} x {z:.6e} m here"),
            &format!(
                "rounded to {} x {} x {} cells of {dx:.6e} m",
                cells[0], cells[1], cells[2]
            ),
            "",
        ));
    }
    for (template, section) in templates.iter().zip(&case.particles) {
        let ShapeSection::Sphere(sphere) = &section.value.shape;
        let width = 2.0 * template.shape.circumradius();
        let half = 0.5 * used.min();
        if width > half * (1.0 + 1e-9) {
            return Err(source.error_at(
                &[(&sphere.diameter.span, "too large for"), (&size.span, "this box")],
                &format!("a particle of {width} m is larger than half the box, {half:.6e} m"),
                &format!("the smallest edge must be at least {:.6e} m", 2.0 * width),
            ));
        }
    }
    Ok(domain)
}

fn gravity(source: &Source, case: &Case) -> Result<Vec3> {
    let gravity = &case.driving.gravity;
    let vector = match gravity.value {
        Gravity::Downwards(g) => {
            let remedy = "a number is the magnitude and points along -z; give [x, y, z] for other directions";
            source.non_negative("driving.gravity", &at(&gravity.span, g), remedy)?;
            [0.0, 0.0, -g]
        }
        Gravity::Vector(vector) => source.finite("driving.gravity", &gravity.span, vector)?,
    };
    Ok(vector.into())
}

fn viscosity(source: &Source, case: &Case, reference: &Reference) -> Result<f64> {
    let fluid = &case.fluid.value;
    let choices = [
        ("viscosity", &fluid.viscosity),
        ("archimedes", &fluid.archimedes),
        ("galileo", &fluid.galileo),
    ];
    let spans = choices.map(|(name, value)| (name, value.as_ref().map(|v| v.span.clone())));
    let (name, value) = choices[source.exactly_one("fluid", &case.fluid.span, &spans)?];
    let value = value.as_ref().expect("checked by exactly_one");
    let remedy = match name {
        "viscosity" => "kinematic, in m^2/s; water has 1e-6",
        _ => "e.g. archimedes = 1000",
    };
    let number = source.positive(&format!("fluid.{name}"), value, remedy)?;
    if name == "viscosity" {
        return Ok(number);
    }
    if reference.buoyancy() <= 0.0 {
        return Err(source.error(
            &value.span,
            &format!("`fluid.{name}` cannot give the viscosity of this case"),
            "it is zero for any viscosity: gravity is zero or the densities are equal",
            "give `viscosity` (m^2/s) instead",
        ));
    }
    Ok(if name == "galileo" {
        reference.buoyancy().sqrt() / number
    } else {
        (reference.buoyancy() / number).sqrt()
    })
}

fn time_step(source: &Source, case: &Case, dx: f64, viscosity: f64, density: f64) -> Result<(Units, f64)> {
    let lattice = &case.lattice.value;
    let choices = [
        (
            "relaxation_time",
            lattice.relaxation_time.as_ref().map(|v| v.span.clone()),
        ),
        ("time_step", lattice.time_step.as_ref().map(|v| v.span.clone())),
    ];
    source.exactly_one("lattice", &case.lattice.span, &choices)?;
    if let Some(tau) = &lattice.relaxation_time {
        let remedy = "0.5 stands for no viscosity at all; 0.51 to 1 is usual, 0.55 a good start";
        let wanted = "a finite number above 0.5";
        let tau = source.satisfies("lattice.relaxation_time", tau, |x| x > 0.5, wanted, remedy)?;
        return Ok((Units::from_relaxation_time(dx, tau, viscosity, density), tau));
    }
    let dt = lattice.time_step.as_ref().expect("checked by exactly_one");
    let usual = Units::from_relaxation_time(dx, 0.55, viscosity, density).dt;
    let remedy = format!("in seconds; {usual:.3e} s would be a relaxation time of 0.55");
    let dt = source.positive("lattice.time_step", dt, &remedy)?;
    let units = Units { dx, dt, density };
    Ok((units, units.relaxation_time(viscosity)))
}

fn contact(source: &Source, case: &Case, dx: f64) -> Result<Option<ContactParams>> {
    let contact = &case.contact;
    let range = "above 0 and at most 1";
    let within = |x: f64| x > 0.0 && x <= 1.0;
    let poisson = "above -1 and at most 0.5";
    let samples = &contact.samples;
    if !(2..=1000).contains(&samples.value) {
        let value = samples.value.to_string();
        return Err(source.out_of_range(
            "contact.samples",
            &samples.span,
            &value,
            "from 2 to 1000",
            "8 is usual",
        ));
    }
    // Checked even where contacts are off: a wrong number is wrong.
    let params = ContactParams {
        youngs_modulus: source.positive("contact.youngs_modulus", &contact.youngs_modulus, "in Pa")?,
        poisson_ratio: source.satisfies(
            "contact.poisson_ratio",
            &contact.poisson_ratio,
            |x| x > -1.0 && x <= 0.5,
            poisson,
            "0.2 to 0.3 is usual",
        )?,
        restitution: source.satisfies(
            "contact.restitution",
            &contact.restitution,
            within,
            range,
            "1 is elastic; 0.926 is usual for glass",
        )?,
        friction_static: source.non_negative(
            "contact.friction_static",
            &contact.friction_static,
            "0 is smooth",
        )?,
        friction_kinetic: source.non_negative(
            "contact.friction_kinetic",
            &contact.friction_kinetic,
            "0 is smooth",
        )?,
        transition_velocity: source.positive(
            "contact.transition_velocity",
            &contact.transition_velocity,
            "in m/s",
        )?,
        enlargement: dx * source.non_negative("contact.enlargement", &contact.enlargement, "in cells")?,
        geometry: match contact.geometry {
            GeometryKind::Exact => Geometry::Exact,
            GeometryKind::Sampled => Geometry::Sampled {
                samples: samples.value,
            },
        },
    };
    Ok(contact.enabled.then_some(params))
}

fn average_from(source: &Source, case: &Case, clock: Clock, end_step: u64) -> Result<u64> {
    let Some(from) = &case.run.average_from else {
        return Ok(end_step / 3);
    };
    let step = match from.value {
        super::file::Duration::Steps(0) => 0,
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
        picture_every: every("picture_every", &output.picture_every, 10)?,
    })
}
