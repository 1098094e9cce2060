//! From what the user wrote to what a run needs: every derived number, and every check on the way.

use super::array::FixedArray;
use super::checks::{Clock, Document};
use super::dry::{self, Medium};
use super::engine::{engine, refuse_walls, saved_text};
use super::file::PositionsBy;
use super::files::{Files, OwnShapes};
use super::granular::agitate;
use super::insertion::{Exchange, refuse_engine};
use super::kinds::Kinds;
use super::laws::{refuse_cohesion, refuse_edges, refuse_van_der_waals};
use super::materials::Materials;
use super::motion::{applied, buoyancy, motions, refuse_vectors};
use super::open::{open_faces, set_pressures};
use super::physics::{self, gravity};
use super::placed::Places;
use super::placement::Placer;
use super::plausible::Review;
use super::schedule::{Known, of_machine, reschedule, title};
use super::space::{
    domain, refuse_double_contacts, refuse_passages, refuse_shared_cells, refuse_what_is_too_large,
};
use super::statistics::refuse_paths;
use super::walls::{PlacedWall, free_volume, refuse_beside_meshes, walls};
use super::{FluidSetup, Placed, Provenance, RunPlan, Setup};
use crate::document::Source;
use crate::domain::Domain;
use crate::engine::EngineChoice;
use crate::error::Result;
use crate::math::Vec3;
use crate::output::surfaces::are_few;
use crate::packing::progress::{Follow, Unfollowed};
use crate::units::Units;
use crate::wall::Wall;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Arc;

/// Relative difference of a volume fraction from the requested one that is worth a warning.
const ROUNDED: f64 = 0.03;

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
    load_followed(path, options, &mut Unfollowed)
}

/// As [`load`], where dense packings are followed, and may continue an earlier attempt.
///
/// # Errors
/// As [`load`].
pub fn load_followed(path: &Path, options: &[String], follow: &mut dyn Follow) -> Result<Setup> {
    read(path, options, Places::Here(follow))
}

fn read(path: &Path, options: &[String], places: Places) -> Result<Setup> {
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
    read(path, options, Places::Counted)
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
    resolve(&source, name, Files { shapes, ..Files::default() }, Places::Here(&mut Unfollowed))
}

/// A case to be read by one process, or by all of a job together.
#[derive(Clone, Copy, Debug)]
pub enum Origin<'a> {
    /// The file of a case, as for [`load`].
    File(&'a Path),
    /// The text of a case and its name, as for [`from_text`].
    Text(&'a str, &'a str),
    /// As for [`from_saved`]: the name, the text and the files.
    Saved(&'a str, &'a str, &'a [(String, Vec<u8>)]),
}

/// Reads a case in this process alone, as [`load`], [`from_text`] or [`from_saved`].
///
/// # Errors
/// As these.
pub fn read_alone(origin: Origin, options: &[String]) -> Result<Setup> {
    read_from(origin, options, (None, &mut Unfollowed))
}

/// Reads a case with options; with what is known of particles that another process has `placed`, if there is one.
pub(crate) fn read_from(
    origin: Origin,
    options: &[String],
    (placed, follow): (Option<&Arc<Placed>>, &mut dyn Follow),
) -> Result<Setup> {
    let places = placed.map_or(Places::Here(follow), Places::Elsewhere);
    match origin {
        Origin::File(path) => read(path, options, places),
        Origin::Text(text, name) => {
            resolve(&Source::new(name.to_string(), text.to_string(), options), name, Files::default(), places)
        }
        Origin::Saved(name, text, files) => saved(name, text, files, options, places),
    }
}

/// As [`load`], for the text of a [`Setup`] that was saved together with the files that the case names. Options may change how
/// long to run and what to write; defaults that follow from the length of the run keep the spacing they had.
///
/// # Errors
/// As [`load`]; and for an option that names any other key than those below `run.` and `output.`.
pub fn from_saved(name: &str, text: &str, files: &[(String, Vec<u8>)], options: &[String]) -> Result<Setup> {
    saved(name, text, files, options, Places::Here(&mut Unfollowed))
}

fn saved(
    name: &str,
    text: &str,
    files: &[(String, Vec<u8>)],
    options: &[String],
    places: Places,
) -> Result<Setup> {
    let source = Source::new(title(name), text.to_string(), &of_machine(options));
    let mut setup = resolve(&source, name, Files { saved: Some(files), ..Files::default() }, places)?;
    if !options.is_empty() {
        reschedule(&mut setup, text, options)?;
    }
    Ok(setup)
}

/// As [`from_saved`], for another run of that case: options may change any key. Particles that are placed at random are only counted
/// unless `places`.
pub(crate) fn from_saved_anew(
    name: &str,
    text: &str,
    files: &[(String, Vec<u8>)],
    options: &[String],
    places: bool,
) -> Result<Setup> {
    let source = Source::new(title(name), text.to_string(), options);
    let mut unfollowed = Unfollowed;
    let places = if places { Places::Here(&mut unfollowed) } else { Places::Counted };
    resolve(&source, name, Files { saved: Some(files), ..Files::default() }, places)
}

fn resolve(source: &Source, name: &str, files: Files, places: Places) -> Result<Setup> {
    let document = &Document::parse(source)?;
    let placed = if let Places::Elsewhere(placed) = &places { Some(Arc::clone(placed)) } else { None };
    let mut warnings = Vec::new();
    let medium = Medium::of(document)?;
    let materials = Materials::new(document)?;
    let scales = placed.as_ref().map(|placed| &placed.scales[..]);
    let mut kinds = Kinds::new(document, &materials, (&files, scales), &mut warnings)?;
    let mut notes = std::mem::take(&mut kinds.notes);
    let templates = &kinds.templates;
    let lattice = document.case.lattice.as_ref();
    let mut domain = domain(document, lattice, &kinds, &mut warnings)?;
    let enlargement = match &medium {
        Medium::Fluid(..) => domain.dx * document.case.contact.enlargement(),
        Medium::Dry(dry) => dry.enlargement,
    };
    let gravity = gravity(document);
    let mut model = materials.contact(document, enlargement)?;
    refuse_edges(document, &kinds, &model)?;
    refuse_van_der_waals(document, &kinds, &model)?;
    if let Medium::Fluid(section, lattice) = &medium {
        model.lubrication = physics::lubrication(document, (section, lattice), &kinds, domain.dx, gravity)?;
    }
    let engine = engine(document, &files.folder)?;
    refuse_engine(document, &engine)?;
    let no_particles = kinds.of_each(|section, _| !document.case.has_particles(section));
    let reaches = templates
        .iter()
        .zip(no_particles)
        .map(|(template, none)| if none { 0.0 } else { model.reach(&template.shape) });
    let reaches: Vec<f64> = reaches.collect();
    refuse_what_is_too_large(document, &kinds, &domain, (&reaches, &engine))?;
    let contact = document.case.contact.enabled.then(|| model.clone());
    let reach = reaches.iter().copied().fold(0.0, f64::max);
    let walls = walls(document, &domain, &materials, (&files, &mut notes), reach)?;
    let inlets = open_faces(document, &mut domain, &walls)?;
    refuse_walls(document, &engine, &walls)?;
    refuse_beside_meshes(document, &walls, templates, &model)?;
    refuse_cohesion(document, &kinds, &walls, &model)?;
    let substeps = document.case.contact.substeps;
    let mut pressures = BTreeMap::new();
    let (time_step, fluid) = match &medium {
        Medium::Fluid(section, lattice) => {
            let sections = (*section, *lattice);
            let fluid = physics::fluid(document, sections, &kinds, &domain, &walls, gravity)?;
            let units = Units { dx: domain.dx, dt: fluid.0, density: fluid.1.density };
            pressures = set_pressures(document, &mut domain, &walls, &units)?;
            refuse_shared_cells(document, (&kinds, &reaches), &domain, fluid.1.coupling)?;
            (fluid.0, Some(fluid.1))
        }
        Medium::Dry(section) => (dry::time_step(section, substeps, templates, &model), None),
    };
    refuse_vectors(document, time_step)?;
    let motions = motions(document)?;
    let applied = applied(document, &motions)?;
    let prescribed = kinds.of_each(|section, _| motions[section].is_complete());
    let placer = Placer {
        document,
        domain,
        kinds: &kinds,
        walls: &walls,
        free_volume: free_volume(&domain, &walls),
        prescribed: &prescribed,
        enlargement: if contact.is_some() { enlargement } else { 0.0 },
    };
    let (mut particles, random, shared) = placer.place(places, &mut warnings, &mut notes)?;
    let sections = kinds.of_each(|section, _| section);
    refuse_passages(document, &domain, (templates, &sections), (&motions, &engine), &particles)?;
    if let Some(flow) = fluid.as_ref().and_then(|fluid| fluid.start) {
        flow.carry(&placer, &motions, &mut particles);
    }
    agitate(document, &sections, (&kinds.templates, &motions), &mut particles)?;
    if contact.is_some() && engine != EngineChoice::Native {
        refuse_double_contacts(document, &domain, &reaches, (kinds.diameter, &particles))?;
    }
    let counts: Vec<(usize, usize)> =
        (particles.iter().map(|p| (p.template as usize, 1))).chain(random).collect();
    // An empty sum of floats is -0.
    let volume = |counts: &mut dyn Iterator<Item = &(usize, usize)>| {
        counts.fold(0.0, |sum, &(template, count)| sum + count as f64 * templates[template].shape.volume())
    };
    let mut volume_fraction = (volume(&mut counts.iter()) - shared) / placer.free_volume;
    let mut requested_volume_fraction = volume_fraction;
    for (index, kind) in kinds.sections.iter().enumerate() {
        if let PositionsBy::VolumeFraction(requested) = document.case.particles[index].positions {
            let mut of_kind = counts.iter().filter(|(template, _)| kind.templates().contains(template));
            let actual = volume(&mut of_kind) / placer.free_volume;
            requested_volume_fraction += requested - actual;
            let count = counts.iter().filter(|(template, _)| kind.templates().contains(template));
            let count = count.map(|(_, count)| count).sum();
            warnings.extend(rounded(document, index, [requested, actual], count));
        }
    }
    if let Some(placed) = &placed {
        [volume_fraction, requested_volume_fraction] = placed.volume_fractions;
    }
    let count: usize = counts.iter().map(|(_, count)| count).sum();
    let mut present: BTreeSet<usize> =
        (counts.iter().filter(|(_, count)| *count > 0)).map(|(template, _)| *template).collect();
    let clock = Clock::of(time_step, fluid.as_ref());
    let mut known = Known {
        name,
        clock,
        size: domain.size(),
        diameter: kinds.diameter,
        few: are_few(templates, counts.iter().copied()),
    };
    let mut plan = RunPlan::new(document, &known)?;
    let exchange = Exchange {
        placer: &placer,
        clock,
        end_step: plan.end_step,
        motions: &motions,
        particles: &particles,
        gravity,
        undriven: is_undriven(&domain, fluid.as_ref(), &walls)
            && applied.iter().all(|[force, _]| *force == Vec3::zeros())
            && motions.iter().all(|motion| motion.is_free() || motion.rests())
            && particles.iter().all(|particle| particle.velocity() == Vec3::zeros())
            && placed.is_none(),
    };
    let (insertions, removals) = exchange.resolve()?;
    if !insertions.is_empty() {
        let later = insertions.iter().flat_map(|insertion| insertion.at_end(plan.end_step, time_step));
        let counts = counts.into_iter().chain(later);
        present.extend(
            insertions.iter().flat_map(|of| of.bodies.fractions.iter().map(|(template, _)| *template)),
        );
        known.few = are_few(templates, counts);
        plan = RunPlan::new(document, &known)?;
    }
    if placed.is_none() {
        refuse_paths(document, &particles, count - particles.len(), !insertions.is_empty())?;
    }
    let (text, free_volume) = (saved_text(document, &engine), placer.free_volume);
    let (walls, wall_keys): (Vec<Wall>, Vec<_>) =
        walls.into_iter().map(|placed| (placed.wall, placed.key)).unzip();
    let mut setup = Setup {
        domain,
        time_step,
        fluid,
        sections,
        applied: kinds.of_each(|section, _| applied[section]),
        motions: kinds.of_each(|section, _| motions[section].clone()),
        frames: kinds.of_each(|_, kind| kind.rotation),
        templates: kinds.templates.into(),
        particles,
        insertions,
        removals,
        diameter: kinds.diameter,
        volume_fraction,
        free_volume,
        requested_volume_fraction,
        walls,
        inlets,
        pressures,
        contact,
        engine,
        substeps,
        gravity,
        fixed_array: None,
        scales: kinds.scales,
        placed: None,
        plan,
        provenance: Provenance {
            name: name.to_string(),
            text,
            files: files.read.into_inner(),
            inputs: Vec::new(),
            warnings,
            notes,
        },
    };
    if placed.is_some() {
        // The process that has placed the particles has judged the case.
        setup.fixed_array = placed.as_ref().and_then(|placed| placed.fixed_array);
        setup.placed = placed;
        return Ok(setup);
    }
    if (0..3).any(|axis| setup.drives(axis)) {
        setup.fixed_array = FixedArray::of(&setup);
    }
    if let Medium::Fluid(fluid, lattice) = medium {
        let review = Review { document, fluid, lattice, setup: &setup, present, walls: wall_keys };
        let found = review.judge()?;
        setup.provenance.warnings.extend(found);
        setup.provenance.notes.extend(buoyancy(&setup));
    }
    Ok(setup)
}

/// True if nothing but the particles moves the fluid.
fn is_undriven(domain: &Domain, fluid: Option<&FluidSetup>, walls: &[PlacedWall]) -> bool {
    let rests = |fluid: &FluidSetup| {
        let flux = fluid.net_flux.into_iter().flatten().any(|flux| flux != 0.0);
        !flux && fluid.body_acceleration.is_zero() && fluid.start.is_none()
    };
    fluid.is_none_or(rests)
        && domain.faces.iter().all(|face| !face.is_open())
        && walls.iter().all(|placed| placed.wall.motion.rests())
}

/// Warns of a volume fraction that whole particles miss by more than [`ROUNDED`].
fn rounded(document: &Document, index: usize, [requested, actual]: [f64; 2], count: usize) -> Option<String> {
    if (actual / requested - 1.0).abs() <= ROUNDED {
        return None;
    }
    let key = format!("particles.{index}.volume_fraction");
    let (particles, each) =
        (if count == 1 { "particle makes" } else { "particles make" }, actual / count as f64);
    let title = format!("`{key}` is {requested}, but {count} whole {particles} it {actual:.4}");
    let fewer = match count - 1 {
        0 => String::new(),
        fewer => format!("`count = {fewer}` makes it {:.4}; ", each * fewer as f64),
    };
    let remedy = format!("{fewer}a larger box comes nearer");
    Some(document.warning(&key, &title, "rounded up to whole particles", &remedy))
}

#[cfg(test)]
mod tests;
