//! From what the user wrote to what a run needs: every derived number, and every check on the way.

use super::checks::Clock;
use super::dry::{self, Medium};
use super::engine::{engine, refuse_walls};
use super::file::Case;
use super::files::Files;
use super::kinds::kinds;
use super::materials::Materials;
use super::physics::{self, collision, gravity, time_step, viscosity};
use super::placement::Placer;
use super::plausible::Written;
use super::scales::Reference;
use super::schedule::{Known, are_few, names, reschedule, title};
use super::source::Source;
use super::space::{domain, refuse_double_contacts};
use super::walls::{free_volume, walls};
use super::{FluidSetup, Provenance, RunPlan, Setup};
use crate::contact::Contour;
use crate::domain::Domain;
use crate::error::Result;
use crate::math::Vec3;
use crate::wall::Wall;
use std::path::Path;

/// Most sub-steps of the particles in a step.
const MAX_SUBSTEPS: u32 = 10_000;

/// Reads a case file, applies `--set` options, checks everything and derives every number.
pub fn load(path: &Path, options: &[String]) -> Result<Setup> {
    read(path, options, true)
}

fn read(path: &Path, options: &[String], places: bool) -> Result<Setup> {
    let source = Source::read(path, options)?;
    let name = path
        .file_stem()
        .map_or_else(|| "case".to_string(), |stem| stem.to_string_lossy().into_owned());
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut setup = resolve(&source, &name, Files::on_disk(folder), places)?;
    let origin = &mut setup.provenance;
    let named = origin.files.iter().map(|(name, _)| folder.join(name));
    origin.inputs = std::iter::once(path.to_path_buf()).chain(named).collect();
    Ok(setup)
}

/// As [`load`], but particles that are placed at random are only counted, which takes no time: they are missing in
/// [`Setup::particles`], and in [`Setup::volume_fraction`] they are not.
///
/// # Errors
/// As [`load`], less those of placing them.
pub fn outline(path: &Path, options: &[String]) -> Result<Setup> {
    read(path, options, false)
}

/// As [`load`], for a text that is no file; what it names is looked for in the current directory.
pub fn from_text(text: &str, name: &str, options: &[String]) -> Result<Setup> {
    let source = Source::new(name.to_string(), text.to_string(), options);
    resolve(&source, name, Files::on_disk(Path::new("")), true)
}

/// As [`load`], for the text of a [`Setup`] that was saved together with the files that the case names. Options may change how
/// long to run and what to write; what then has its default by the length of the run keeps the spacing it had.
///
/// # Errors
/// As [`load`]; and for an option that names any other key than those below `run.` and `output.`.
pub fn from_saved(name: &str, text: &str, files: &[(String, Vec<u8>)], options: &[String]) -> Result<Setup> {
    // This processor may lack what the one had that the run comes from.
    let simd: Vec<String> = (options.iter().filter(|option| names(option, "run.simd")).cloned()).collect();
    let source = Source::new(title(name), text.to_string(), &simd);
    let mut setup = resolve(&source, name, Files::saved(files), true)?;
    if !options.is_empty() {
        reschedule(&mut setup, text, options)?;
    }
    Ok(setup)
}

/// Particles are placed at random if `places`, else counted.
fn resolve(source: &Source, name: &str, files: Files, places: bool) -> Result<Setup> {
    let (case, text) = source.parse::<Case>()?;
    let mut warnings = Vec::new();
    let medium = Medium::of(source, &case)?;
    let materials = Materials::new(source, &case)?;
    let kinds = kinds(source, &case, &materials, &files)?;
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
    // As the engine grows them: corners stay sharp.
    let reaches: Vec<f64> = (templates.iter())
        .map(|template| Contour::new(template.shape.clone(), enlargement).reach())
        .collect();
    let reach = reaches.iter().copied().fold(0.0, f64::max);
    let walls = walls(source, &case, &domain, &materials, reach)?;
    refuse_walls(source, &case, &engine, &walls)?;
    let gravity = gravity(source, &case)?;
    let substeps = substeps(source, &case)?;
    let (time_step, mut fluid) = match &medium {
        Medium::Wet(section, lattice) => {
            let density = &section.value.density;
            let density = source.positive("fluid.density", density, "in kg/m^3; water has 1000")?;
            let reference = Reference {
                diameter: kinds.diameter,
                density_ratio: templates[0].density / density,
                gravity: gravity.norm(),
            };
            let viscosity = viscosity(source, section, &reference)?;
            let (units, relaxation_time) = time_step(source, lattice, domain.dx, viscosity, density)?;
            let collision = collision(source, &lattice.value)?;
            let (solids, fraction) = physics::solids(source, &lattice.value)?;
            let scales = reference.scales(viscosity);
            let rate = scales.stokes_velocity.abs() / kinds.diameter;
            let fluid = FluidSetup {
                density,
                viscosity,
                relaxation_time,
                collision,
                solids,
                fraction,
                force_balance: (case.driving.force_balance.as_ref())
                    .map_or_else(Default::default, |b| b.value),
                zero_net_flux: [false; 3],
                control_rate: rate.max(viscosity / (kinds.diameter * kinds.diameter)),
                body_acceleration: Vec3::zeros(),
                scales,
            };
            (units.dt, Some(fluid))
        }
        Medium::Dry(section) => {
            let step = dry::time_step(source, section, substeps, templates, &materials)?;
            (step, None)
        }
    };
    let placer = Placer {
        source,
        case: &case,
        domain,
        kinds: &kinds,
        walls: &walls,
        free_volume: free_volume(&domain, &walls),
        files: &files,
        enlargement: if contact.is_some() { enlargement } else { 0.0 },
    };
    let (particles, random) = placer.place(places, &mut warnings)?;
    if contact.is_some() {
        refuse_double_contacts(source, &case, &domain, &reaches, &particles)?;
    }
    let mut present = vec![false; templates.len()];
    let counted = random.iter().filter(|random| random.1 > 0).map(|random| random.0);
    for template in particles.iter().map(|p| p.template as usize).chain(counted) {
        present[template] = true;
    }
    let volume = |template: usize| templates[template].shape.volume();
    let placed: f64 = particles.iter().map(|p| volume(p.template as usize)).sum();
    let counted: f64 = (random.iter())
        .map(|&(template, count)| count as f64 * volume(template))
        .sum();
    let solid = placed + counted;
    let volume_fraction = solid / placer.free_volume;
    let placed = particles.iter().map(|p| (p.template as usize, 1));
    let known = Known {
        name,
        clock: Clock::of(time_step, fluid.as_ref()),
        size: domain.size(),
        few: are_few(templates, placed.chain(random)),
    };
    let plan = RunPlan::new(source, &case, &known)?;
    let (walls, wall_spans): (Vec<Wall>, Vec<_>) =
        walls.into_iter().map(|placed| (placed.wall, placed.span)).unzip();
    if let Some(fluid) = &mut fluid {
        let vanishes = || flux_is_known_to_vanish(&domain, &walls, gravity);
        (fluid.body_acceleration, fluid.zero_net_flux) =
            physics::driven(source, &case.driving, domain.periodic, vanishes)?;
    }
    let mut setup = Setup {
        domain,
        time_step,
        fluid,
        sections: kinds.section_of_each(),
        frames: kinds.frames(),
        templates: kinds.templates.into(),
        particles,
        diameter: kinds.diameter,
        volume_fraction,
        walls,
        contact,
        engine,
        substeps,
        gravity,
        plan,
        provenance: Provenance {
            name: name.to_string(),
            text,
            files: files.into_read(),
            inputs: Vec::new(),
            warnings,
        },
    };
    if let Medium::Wet(fluid, lattice) = &medium {
        let written = Written {
            source,
            case: &case,
            fluid: &fluid.value,
            lattice: &lattice.value,
            present,
            walls: wall_spans,
        };
        let found = written.judge(&setup)?;
        setup.provenance.warnings.extend(found);
    }
    Ok(setup)
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

#[cfg(test)]
mod tests;
