//! From what the user wrote to what a run needs: every derived number, and every check on the way.

use super::checks::Clock;
use super::dry::{self, Medium};
use super::engine::{engine, refuse_walls};
use super::file::Case;
use super::files::{Files, OwnShapes};
use super::kinds::kinds;
use super::materials::Materials;
use super::physics::{self, gravity};
use super::placement::Placer;
use super::plausible::Written;
use super::schedule::{Known, are_few, names, reschedule, title};
use super::source::Source;
use super::space::{domain, refuse_double_contacts};
use super::walls::{free_volume, walls};
use super::{Provenance, RunPlan, Setup};
use crate::contact::GrownShape;
use crate::error::Result;
use crate::wall::Wall;
use std::path::Path;

/// Most sub-steps of the particles in a step.
const MAX_SUBSTEPS: u32 = 10_000;

/// Reads a case file, applies `--set` options, checks everything and derives every number.
///
/// ```
/// # let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/cases");
/// let path = std::path::Path::new(folder).join("single_sphere.toml");
/// let setup = turbid::case::load(&path, &["lattice.relaxation_time=0.6".to_string()])?;
/// assert_eq!((setup.particles.len(), setup.expect_fluid().relaxation_time), (1, 0.6));
/// # Ok::<(), turbid::Error>(())
/// ```
///
/// # Errors
/// [`Error::Io`](crate::Error::Io) if the file cannot be read, [`Error::Parse`](crate::Error::Parse) if it is no TOML,
/// [`Error::Case`](crate::Error::Case) for a key that is wrong.
pub fn load(path: &Path, options: &[String]) -> Result<Setup> {
    read(path, options, true)
}

fn read(path: &Path, options: &[String], places: bool) -> Result<Setup> {
    let source = Source::read(path, options)?;
    let name =
        path.file_stem().map_or_else(|| "case".to_string(), |stem| stem.to_string_lossy().into_owned());
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
///
/// ```
/// let text = "domain.size.diameters = [4, 4, 6]\nfluid = { density = 1000, archimedes = 100 }\n\
///             lattice = { cells_per_diameter = 4, relaxation_time = 0.6 }\nrun.end.steps = 8\n\
///             particles = [{ shape.sphere.diameter = 1e-3, density = 2000, count = 3 }]";
/// let setup = turbid::case::from_text(text, "three", &["particles.0.count=2".to_string()])?;
/// assert_eq!(setup.particles.len(), 2);
/// # Ok::<(), turbid::Error>(())
/// ```
pub fn from_text(text: &str, name: &str, options: &[String]) -> Result<Setup> {
    with_shapes(text, name, options, &[])
}

/// As [`from_text`], where the file of a mesh may be a shape of the caller's own.
pub(crate) fn with_shapes(text: &str, name: &str, options: &[String], shapes: &OwnShapes) -> Result<Setup> {
    let source = Source::new(name.to_string(), text.to_string(), options);
    resolve(&source, name, Files::on_disk(Path::new("")).with_shapes(shapes), true)
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
        Medium::Wet(..) => domain.dx * grown.value,
        Medium::Dry(_) => grown.value,
    };
    let contact = materials.contact(source, &case, enlargement)?;
    let engine = engine(source, &case)?;
    // As the engine grows them: corners stay sharp.
    let reaches: Vec<f64> = (templates.iter())
        .map(|template| GrownShape::new(template.shape.clone(), enlargement).reach())
        .collect();
    let reach = reaches.iter().copied().fold(0.0, f64::max);
    let walls = walls(source, &case, &domain, &materials, reach)?;
    refuse_walls(source, &case, &engine, &walls)?;
    let gravity = gravity(source, &case)?;
    let wanted = format!("at least 1 and at most {MAX_SUBSTEPS}");
    let substeps = &case.contact.substeps;
    let substeps = source.whole("contact.substeps", substeps, 1..=MAX_SUBSTEPS, &wanted, "1 is usual")?;
    let (time_step, fluid) = match &medium {
        Medium::Wet(section, lattice) => {
            let (step, fluid) =
                physics::fluid(source, &case, (section, lattice), &kinds, &domain, &walls, gravity)?;
            (step, Some(fluid))
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
    let counts: Vec<(usize, usize)> =
        (particles.iter().map(|p| (p.template as usize, 1))).chain(random).collect();
    let volume = |&(template, count): &(usize, usize)| count as f64 * templates[template].shape.volume();
    let volume_fraction = counts.iter().map(volume).sum::<f64>() / placer.free_volume;
    let present = (counts.iter().filter(|(_, count)| *count > 0)).map(|(template, _)| *template).collect();
    let known = Known {
        name,
        clock: Clock::of(time_step, fluid.as_ref()),
        size: domain.size(),
        few: are_few(templates, counts),
    };
    let plan = RunPlan::new(source, &case, &known)?;
    let (walls, wall_spans): (Vec<Wall>, Vec<_>) =
        walls.into_iter().map(|placed| (placed.wall, placed.span)).unzip();
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

#[cfg(test)]
mod tests;
