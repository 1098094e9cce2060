//! Statistics of a run afterwards, from its files, by the code that writes them during a run.
//!
//! | file of the run | numbers |
//! |---|---|
//! | `series.csv` | averages of all columns |
//! | `profiles.csv` | `profile_means.csv`, `fronts.csv` and the velocity of the front |
//! | `structure.csv`, or else `particles/` and `contacts/` | averages; `pair_distribution_means.csv` |
//! | `dynamics.csv`, or else `particles/` at equal spacings | `dynamics_means.csv` and coefficients of diffusion |

use super::run::saved_setup;
use super::writers::{dynamics, profiles, structure};
use crate::case::{self, Dynamics, LAGS, Setup, Structure};
use crate::dem::ContactState;
use crate::error::{Error, Result};
use crate::input;
use crate::output::{
    Averages, OutputFiles, SeriesTable, Summary, averages, contacts, directory, pieces, write_bytes,
};
use crate::packing::positions::{self, Row};
use crate::particle::Particle;
use std::fs;
use std::path::{Path, PathBuf};

/// Name of the file of the averages.
const AVERAGES: &str = "averages.json";

/// Numbers of a run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Analysis {
    /// Means over time by their names.
    pub averages: Averages,
    /// Time from which they are taken (s).
    pub from: f64,
    /// Notes on what the files lack.
    pub notes: Vec<String>,
}

/// Analyses the files of a run in a directory, means being taken from a time (s) on, by default from that of its case, and writes the tables and
/// `averages.json` to `out`.
///
/// # Errors
/// [`Error::Input`] for a directory without `series.csv`, or without the case, which `summary.json` or a checkpoint has; those of reading and writing
/// files.
pub fn analyse(directory: &Path, out: &Path, from: Option<f64>) -> Result<Analysis> {
    let files = OutputFiles::new(directory);
    if !files.series().is_file() {
        return Err(Error::Input(format!(
            "{} holds no series.csv\n  give the output directory of a run",
            directory.display()
        )));
    }
    let known = Summary::read(&files.summary()).ok();
    let mut setup = case_of(directory, known.as_ref())?;
    fs::create_dir_all(out).map_err(|source| Error::io("create", out, source))?;
    setup.plan.output.directory = out.to_path_buf();
    let to = OutputFiles::new(out);
    let series = SeriesTable::read(&files.series())?;
    let last = series.get("step").and_then(|steps| steps.last().copied()).unwrap_or(0.0);
    let from = from.unwrap_or(setup.averages_from(last as u64));
    let distance = known.and_then(|summary| summary.averaged_over_distance);
    let mut summary = Summary { averaged_over_distance: distance, ..Summary::default() };
    let wanted = |name: &str| !["step", "t", "t_star"].contains(&name);
    summary.averages.extend(averages(&series, wanted, from, distance.unwrap_or(f64::INFINITY)));
    let mut notes = Vec::new();
    profiles::average(&setup, [&files, &to], from, &mut summary)?;
    let has = [directory::STRUCTURE, directory::DYNAMICS].map(|name| files.table(name).is_file());
    if has != [true; 2] {
        notes.extend(of_particles(&mut setup, &files, has)?);
    }
    let of = has.map(|has| if has { &files } else { &to });
    structure::average([of[0], &to], from, &mut summary)?;
    dynamics::average([of[1], &to], from, &mut summary)?;
    let averages = summary.averages;
    let json = serde_json::to_string_pretty(&averages).expect("plain data always serialises") + "\n";
    write_bytes(&out.join(AVERAGES), json.as_bytes())?;
    Ok(Analysis { averages, from, notes })
}

/// The case of a run, from its checkpoint, or from its summary if it names no files.
fn case_of(directory: &Path, summary: Option<&Summary>) -> Result<Setup> {
    let saved = saved_setup(directory, &[], None);
    match summary {
        Some(summary) if saved.is_err() => {
            case::from_saved_anew(&summary.case, &summary.input, &[], &[], false)
        }
        _ => saved,
    }
}

/// Writes the tables that the run `has` not to the output directory of the case, from its files of particles. Returns a note on what they lack.
fn of_particles(setup: &mut Setup, files: &OutputFiles, has: [bool; 2]) -> Result<Option<String>> {
    let steps = files.steps(directory::PARTICLES)?;
    let every = match steps[..] {
        [first, second, ..] => second - first,
        _ => {
            return Ok(Some(
                "there are no files of particles from which to take structure or dynamics".into(),
            ));
        }
    };
    let spaced = steps.windows(2).filter(|pair| pair[1] - pair[0] == every).count();
    let (domain, plan) = (setup.domain, &mut setup.plan.output);
    let edges = [0, 1, 2].map(|axis| domain.is_periodic(axis).then(|| domain.size()[axis]));
    plan.structure.get_or_insert(Structure::usual(every, edges, setup.diameter));
    let lags = plan.dynamics.map_or(LAGS, |dynamics| dynamics.lags).min((spaced / 4).max(2));
    plan.dynamics = Some(Dynamics { every, lags });
    let mut without = 0;
    let mut structure = structure::StructureWriter::of(setup);
    let mut dynamics = dynamics::DynamicsWriter::of(setup);
    for &step in &steps {
        let particles = particles_of(setup, &files.file(directory::PARTICLES, step))?;
        let time = step as f64 * setup.time_step;
        if let Some(structure) = structure.as_mut().filter(|_| !has[0]) {
            let contacts = contacts_of(setup, &files.file(directory::CONTACTS, step), &particles)?;
            without += usize::from(contacts.is_none());
            structure.add(step, time, &particles, contacts.as_deref())?;
        }
        // The end of a run is no sample, unless it is at the same spacing.
        if let Some(dynamics) = dynamics.as_mut().filter(|_| !has[1] && step.is_multiple_of(every)) {
            dynamics.add(step, time, &particles)?;
        }
    }
    Ok((without > 0).then(|| {
        format!(
            "structure.csv is made of the files of particles; contacts are missing at {without} of {} steps \
             (`output.contacts_every` writes them)",
            steps.len()
        )
    }))
}

/// The particles in a file of points, ascending by id; their template is the one of their kind that is nearest in size.
fn particles_of(setup: &Setup, file: &Path) -> Result<Vec<Particle>> {
    let template = |row: &Row| {
        let of_kind = (0..setup.templates.len()).filter(|template| setup.sections[*template] == row.kind);
        let off =
            |template: &usize| (setup.templates[*template].shape.equivalent_diameter() - row.diameter).abs();
        of_kind.min_by(|a, b| off(a).total_cmp(&off(b)))
    };
    let particle = |row: &Row| {
        let template = template(row).ok_or_else(|| {
            Error::Input(format!("{}: the case has no particles of kind {}", file.display(), row.kind))
        })?;
        let mut particle = Particle::at(row.id, template, setup.domain.wrap(row.position));
        // Files have the orientation of the shape as it is given.
        particle.set_orientation(&(row.orientation * setup.frames[template]));
        particle.velocity = row.velocity.into();
        particle.angular_velocity = row.angular_velocity.into();
        Ok(particle)
    };
    let mut particles = particles_in(file)?.iter().map(particle).collect::<Result<Vec<_>>>()?;
    particles.sort_unstable_by_key(|particle| particle.id);
    Ok(particles)
}

/// The contacts in a file of a run, or in its pieces, which must be of these particles, ascending by id, and of walls of the case; none if there is no
/// file, or if an older version has written it.
fn contacts_of(setup: &Setup, file: &Path, particles: &[Particle]) -> Result<Option<Vec<ContactState>>> {
    if !file.exists() && !pieces::index(file).exists() {
        return Ok(None);
    }
    let of_part = |bytes: &[u8], name: &str| {
        let arrays = positions::arrays_of_a_run(bytes, &contacts::ARRAYS);
        let read = |arrays: Vec<Vec<f64>>| contacts::from_arrays(&arrays, setup.walls.len());
        arrays.and_then(|arrays| arrays.map(read).transpose()).map_err(|what| format!("{name}: {what}"))
    };
    let Some(found) = of_parts(file, of_part)?.into_iter().collect::<Option<Vec<_>>>() else {
        return Ok(None);
    };
    let found = found.concat();
    let is_known = |id: &u64| particles.binary_search_by_key(id, |particle| particle.id).is_ok();
    match found.iter().flat_map(contacts::ids).find(|id| !is_known(id)) {
        None => Ok(Some(found)),
        Some(id) => Err(Error::Input(format!(
            "{} has a contact of particle {id}, which the file of particles of the same step lacks",
            file.display()
        ))),
    }
}

/// The particles in a file of points of a run, or in its pieces.
///
/// # Errors
/// Of reading the file, and of a file that is none of them.
pub fn particles_in(file: &Path) -> Result<Vec<Row>> {
    Ok(of_parts(file, positions::of_a_run)?.concat())
}

/// Contents of a file of points of a run, or of each of its pieces.
fn of_parts<T>(file: &Path, read: impl Fn(&[u8], &str) -> std::result::Result<T, String>) -> Result<Vec<T>> {
    let index = pieces::index(file);
    let parts: Vec<PathBuf> = if index.exists() {
        let text = input::read_unlinked(&index, input::RECORD).map_err(|e| Error::io("read", &index, e))?;
        let count = String::from_utf8_lossy(&text).matches("<Piece ").count();
        (0..count).map(|rank| pieces::piece(file, rank)).collect()
    } else {
        vec![file.to_path_buf()]
    };
    // The folder of pieces is the run's own as well.
    if let Some(folder) = parts.first().and_then(|part| part.parent()).filter(|folder| folder.is_symlink()) {
        return Err(Error::Input(format!("{} is a symbolic link, and no folder of a run", folder.display())));
    }
    let of_part = |part: &PathBuf| {
        let bytes = input::read_unlinked(part, input::TABLE).map_err(|e| Error::io("read", part, e))?;
        read(&bytes, &part.display().to_string()).map_err(|what| {
            Error::Input(format!(
                "{what}; files that this version of turbid has written hold all that is read"
            ))
        })
    };
    parts.iter().map(of_part).collect()
}
