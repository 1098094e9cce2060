//! The output directory and the names of its files.
//!
//! ```text
//! DIRECTORY/
//!   summary.json  series.csv  particle_series.csv  settling_velocity.png  walls.vtp  open.py  run.id
//!   liggghts.log  lammps.log  process.log
//!   profiles.csv  profile_means.csv  fronts.csv  structure.csv  pair_distribution.csv  pair_distribution_means.csv
//!   contact_forces.csv  contact_force_means.csv  structure_factor.csv  structure_factor_means.csv  dynamics.csv  dynamics_means.csv
//!   fields.pvd        fields/fields_0000001000.vti ...
//!   particles.pvd     particles/particles_0000001000.vtp ...
//!   surfaces.pvd      surfaces/surfaces_0000001000.vtp ...
//!   contacts.pvd      contacts/contacts_0000001000.vtp ...
//!   force_chains.pvd  force_chains/force_chains_0000001000.vtp ...
//!   wear.pvd          wear/wear_0000001000.vtp ...
//!   pictures/NAME_0000001000.png ...
//!   checkpoints/step-0000001000/ ...
//! ```
//!
//! Where ranks are processes, each writes its own [piece](super::pieces) of every file for VTK, and the collection lists the index
//! of the pieces:
//!
//! ```text
//!   fields.pvd        fields/fields_0000001000.pvti ...
//!                     fields/fields_0000001000/fields_0000001000_p00000.vti ...
//! ```
//!
//! The folders appear with their first file. A run owns these names and no others: [`claim`] refuses symbolic links of these names,
//! [`refuse_inputs`] a file that the run reads, [`refuse_results`] results of an earlier run; then [`clear`] removes what an earlier
//! run left, and [`clear_after`] what the run itself left after the step from which it resumes. Other files are never touched.

mod own;

use super::pieces;
use crate::checkpoint;
use crate::error::{Error, Result};
use crate::input;
use crate::output::write_bytes;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io::{self, Write};
use std::os::unix::fs::MetadataExt;
#[cfg(target_os = "linux")]
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};

/// Names of all files of a run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OutputFiles {
    directory: PathBuf,
}

/// Files directly in the output directory, beside the collections.
const TOP: [&str; 19] = [
    SUMMARY,
    SERIES,
    SETTLING,
    WALLS,
    PATHS,
    PROFILES,
    PROFILE_MEANS,
    FRONTS,
    STRUCTURE,
    PAIR_DISTRIBUTION,
    PAIR_DISTRIBUTION_MEANS,
    CONTACT_FORCES,
    CONTACT_FORCE_MEANS,
    STRUCTURE_FACTOR,
    STRUCTURE_FACTOR_MEANS,
    DYNAMICS,
    DYNAMICS_MEANS,
    SCRIPT,
    RUN,
];
const SUMMARY: &str = "summary.json";
const SERIES: &str = "series.csv";
const SETTLING: &str = "settling_velocity.png";
const WALLS: &str = "walls.vtp";
const PATHS: &str = "particle_series.csv";
/// Profiles over time.
pub const PROFILES: &str = "profiles.csv";
/// Means of the profiles.
pub const PROFILE_MEANS: &str = "profile_means.csv";
/// Heights of the front and of the bed over time.
pub const FRONTS: &str = "fronts.csv";
/// Numbers of the structure of the particles over time.
pub const STRUCTURE: &str = "structure.csv";
/// Pair distributions over time.
pub const PAIR_DISTRIBUTION: &str = "pair_distribution.csv";
/// Their means.
pub const PAIR_DISTRIBUTION_MEANS: &str = "pair_distribution_means.csv";
/// Distributions of the contact forces over time.
pub const CONTACT_FORCES: &str = "contact_forces.csv";
/// Their means.
pub const CONTACT_FORCE_MEANS: &str = "contact_force_means.csv";
/// Structure factors over time.
pub const STRUCTURE_FACTOR: &str = "structure_factor.csv";
/// Their means.
pub const STRUCTURE_FACTOR_MEANS: &str = "structure_factor_means.csv";
/// Displacements and memory of velocities, block by block.
pub const DYNAMICS: &str = "dynamics.csv";
/// Their means.
pub const DYNAMICS_MEANS: &str = "dynamics_means.csv";
const SCRIPT: &str = "open.py";
/// Id of the run whose files these are.
const RUN: &str = "run.id";
/// Most bytes of it.
const RUN_BYTES: u64 = 64;
const LOGS: [&str; 3] = ["liggghts.log", "lammps.log", "process.log"];
/// Cells of the fluid.
pub const FIELDS: Numbered = Numbered::new("fields", "fields_", ".vti");
/// Particles as points.
pub const PARTICLES: Numbered = Numbered::new("particles", "particles_", ".vtp");
/// Surfaces of particles.
pub const SURFACES: Numbered = Numbered::new("surfaces", "surfaces_", ".vtp");
/// Contacts.
pub const CONTACTS: Numbered = Numbered::new("contacts", "contacts_", ".vtp");
/// Force chains.
pub const FORCE_CHAINS: Numbered = Numbered::new("force_chains", "force_chains_", ".vtp");
/// Wear of walls from meshes.
pub const WEAR: Numbered = Numbered::new("wear", "wear_", ".vtp");
/// Pictures, each kind with a [name](Numbered::named_file) of its own.
pub const PICTURES: Numbered = Numbered::new("pictures", "", ".png");
const NUMBERED: [Numbered; 7] = [FIELDS, PARTICLES, SURFACES, CONTACTS, FORCE_CHAINS, WEAR, PICTURES];

/// Files of one kind that are numbered by steps: `FOLDER/PREFIX0000001000.EXTENSION` (`FOLDER/NAME_0000001000.EXTENSION` with any name
/// where the prefix is empty), and `FOLDER.pvd`, the collection of those for
/// VTK.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Numbered {
    folder: &'static str,
    prefix: &'static str,
    extension: &'static str,
}

impl Numbered {
    /// The extension with its dot.
    pub const fn new(folder: &'static str, prefix: &'static str, extension: &'static str) -> Self {
        Self { folder, prefix, extension }
    }

    /// The folder.
    pub fn name(&self) -> &'static str {
        self.folder
    }

    /// The file of a step.
    pub fn file(&self, directory: &Path, step: u64) -> PathBuf {
        let name = format!("{}{step:010}{}", self.prefix, self.extension);
        directory.join(self.folder).join(name)
    }

    /// The file of a step whose name begins with one of its own, where the prefix is empty.
    pub fn named_file(&self, directory: &Path, name: &str, step: u64) -> PathBuf {
        directory.join(self.folder).join(format!("{name}_{step:010}{}", self.extension))
    }

    /// The collection.
    pub fn collection(&self, directory: &Path) -> PathBuf {
        directory.join(format!("{}.pvd", self.folder))
    }
}

/// Files of one writer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A file at each of its steps.
    Numbered(Numbered),
    /// One file directly in the output directory, of this name, which grows.
    Table(&'static str),
}

/// The numbered files of a run that writes `more` kinds of files.
fn numbered(more: &[Kind]) -> impl Iterator<Item = Numbered> {
    let more = more.iter().filter_map(|kind| match kind {
        Kind::Numbered(kind) => Some(*kind).filter(|kind| !NUMBERED.contains(kind)),
        Kind::Table(_) => None,
    });
    NUMBERED.into_iter().chain(more)
}

/// The files of such a run directly in its directory, but for the log.
fn top(more: &[Kind]) -> Vec<String> {
    let for_vtk = numbered(more).filter(|kind| kind.extension.starts_with(".vt"));
    let collections = for_vtk.map(|kind| format!("{}.pvd", kind.folder));
    let tables = more.iter().filter_map(|kind| match kind {
        Kind::Table(name) => Some(*name),
        Kind::Numbered(_) => None,
    });
    TOP.into_iter().chain(tables).map(str::to_owned).chain(collections).collect()
}

fn folders(more: &[Kind]) -> impl Iterator<Item = &'static str> {
    numbered(more).map(|kind| kind.folder).chain([checkpoint::FOLDER])
}

impl OutputFiles {
    /// The files of a run whose output goes to `directory`.
    pub fn new(directory: impl Into<PathBuf>) -> Self {
        Self { directory: directory.into() }
    }

    /// The output directory.
    pub fn directory(&self) -> &Path {
        &self.directory
    }

    /// The result in numbers.
    pub fn summary(&self) -> PathBuf {
        self.directory.join(SUMMARY)
    }

    /// The time series.
    pub fn series(&self) -> PathBuf {
        self.directory.join(SERIES)
    }

    /// The plot of settling velocity over time.
    pub fn settling_plot(&self) -> PathBuf {
        self.directory.join(SETTLING)
    }

    /// The collection of numbered files.
    pub fn collection(&self, kind: Numbered) -> PathBuf {
        kind.collection(&self.directory)
    }

    /// The walls.
    pub fn walls(&self) -> PathBuf {
        self.directory.join(WALLS)
    }

    /// The script that opens everything in `ParaView`.
    pub fn script(&self) -> PathBuf {
        self.directory.join(SCRIPT)
    }

    /// Returns true if the [script](Self::script) is that of a run; another file of this name is the user's.
    pub fn has_own_script(&self) -> bool {
        own::is_own_script(&self.script())
    }

    /// The time series of single particles.
    pub fn particle_series(&self) -> PathBuf {
        self.directory.join(PATHS)
    }

    /// A table of statistics by its name, as [`PROFILES`].
    pub fn table(&self, name: &str) -> PathBuf {
        self.directory.join(name)
    }

    /// Log of the external engine of this name.
    pub fn engine_log(&self, engine: &str) -> PathBuf {
        self.directory.join(format!("{engine}.log"))
    }

    /// A numbered file.
    pub fn file(&self, kind: Numbered, step: u64) -> PathBuf {
        kind.file(&self.directory, step)
    }

    /// The steps with files of a kind, ascending, or [`Error::Io`] if its folder cannot be read.
    pub fn steps(&self, kind: Numbered) -> Result<Vec<u64>> {
        let all = own::frames(&self.directory, kind);
        let all = all.map_err(|source| Error::io("read", &self.directory.join(kind.folder), source))?;
        let whole = all.iter().filter(|own| own.of.exists() || pieces::index(&own.of).exists());
        Ok(whole.filter_map(|own| own.step).collect::<BTreeSet<_>>().into_iter().collect())
    }

    /// The checkpoints.
    pub fn checkpoints(&self) -> PathBuf {
        self.directory.join(checkpoint::FOLDER)
    }
}

/// Pictures that are named alike: step, file and its length in bytes, ascending by step.
pub type PicturesOfName = Vec<(u64, PathBuf, u64)>;

/// The pictures in an output directory by name, regular files only; [`Error::Io`] if their folder cannot be read.
pub fn pictures(directory: &Path) -> Result<BTreeMap<String, PicturesOfName>> {
    let all = own::frames(directory, PICTURES);
    let all = all.map_err(|source| Error::io("read", &directory.join(PICTURES.folder), source))?;
    let mut pictures: BTreeMap<_, PicturesOfName> = BTreeMap::new();
    for own in all.into_iter().filter(|own| own.path == own.of) {
        let name = own.of.file_stem().and_then(|stem| Some(stem.to_str()?.rsplit_once('_')?.0.to_owned()));
        let data = fs::symlink_metadata(&own.path).ok().filter(fs::Metadata::is_file);
        if let (Some(name), Some(step), Some(data)) = (name, own.step, data) {
            pictures.entry(name).or_default().push((step, own.path, data.len()));
        }
    }
    for frames in pictures.values_mut() {
        frames.sort();
    }
    Ok(pictures)
}

/// [`claim`] and [`prepare`], before anything is computed, so that a run cannot fail at its first output after hours. Errors:
/// [`Error::Input`] if nothing can be written there, if another run does, or if one of the names of a run is a symbolic link.
pub fn create(directory: &Path) -> Result<Option<Lock>> {
    let lock = claim(directory, &[])?;
    prepare(directory, &[])?;
    Ok(lock)
}

/// Creates the output directory of a run that writes `more` kinds of files, and keeps other runs out of it as long as the lock
/// lives (`None` on a file system without locks).
pub fn claim(directory: &Path, more: &[Kind]) -> Result<Option<Lock>> {
    fs::create_dir_all(directory).map_err(|source| refused(directory, &source))?;
    let lock = lock(directory)?;
    match own::link(directory, more) {
        None => Ok(lock),
        // What it leads to is not this run's to write or to remove.
        Some(link) => Err(Error::Input(format!(
            "{} is a symbolic link, and a run writes and removes files of this name\n  remove the link, or choose another \
             output directory with --out DIR or the key output.directory",
            link.display()
        ))),
    }
}

/// Removes the log of an earlier run and proves that files can be written.
pub fn prepare(directory: &Path, more: &[Kind]) -> Result<()> {
    let attempt = || -> io::Result<()> {
        own::remove(own::there(directory, &LOGS))?;
        for folder in folders(more) {
            let folder = directory.join(folder);
            if fs::symlink_metadata(&folder).is_ok() {
                let named = |e: io::Error| io::Error::new(e.kind(), format!("{}: {e}", folder.display()));
                probe(&folder).map_err(named)?;
            }
        }
        probe(directory)
    };
    attempt().map_err(|source| refused(directory, &source))
}

/// Refuses, by name and with the ways out, a directory with results of an earlier run, which [`clear`] would remove.
pub fn refuse_results(directory: &Path, more: &[Kind]) -> Result<()> {
    let mut files = own::all(directory, more).map_err(|source| refused(directory, &source))?;
    files.retain(|own| !own.partial && !own.folder);
    // A folder that cannot be read is found by [`prepare`].
    let saved = checkpoint::list(&directory.join(checkpoint::FOLDER)).unwrap_or_default();
    let mut there = Vec::new();
    if let Some(first) = files.first() {
        there.push(first.below(directory).display().to_string());
    }
    match files.len() {
        0 | 1 => {}
        2 => there.push("another file".to_string()),
        n => there.push(format!("{} other files", n - 1)),
    }
    match (saved.len(), saved.first()) {
        (1, Some(last)) => there.push(format!("a checkpoint of step {}", last.step)),
        (n, Some(last)) => there.push(format!("{n} checkpoints, the last of step {}", last.step)),
        _ => {}
    }
    if there.is_empty() {
        return Ok(());
    }
    let shown = directory.display();
    let resume =
        if saved.is_empty() { String::new() } else { format!("`turbid resume {shown}` resumes it; ") };
    Err(Error::Input(format!(
        "the output directory {shown} holds the results of an earlier run: {}\n  {resume}--out DIR or the key \
         output.directory keeps it and writes elsewhere; --overwrite removes it",
        there.join(", ")
    )))
}

/// Refuses, by name, a file that a run reads and [`clear`] would remove.
pub fn refuse_inputs(directory: &Path, more: &[Kind], inputs: &[PathBuf]) -> Result<()> {
    let attempt = || -> io::Result<Option<&PathBuf>> {
        let mut doomed: Vec<PathBuf> = (own::all(directory, more)?.into_iter())
            .chain(own::there(directory, &LOGS))
            .map(|own| own.below(directory).to_path_buf())
            .collect();
        doomed.push(checkpoint::FOLDER.into());
        let directory = fs::canonicalize(directory)?;
        Ok(inputs.iter().find(|input| {
            let input = fs::canonicalize(input).ok();
            let below = input.as_deref().and_then(|input| input.strip_prefix(&directory).ok());
            below.is_some_and(|below| doomed.iter().any(|doomed| below.starts_with(doomed)))
        }))
    };
    match attempt().map_err(|source| refused(directory, &source))? {
        None => Ok(()),
        Some(input) => Err(Error::Input(format!(
            "{} is read by this run, and has the name of a file that it would replace in its output directory {}\n  move \
             that file, or choose another directory with --out DIR or the key output.directory",
            input.display(),
            directory.display()
        ))),
    }
}

/// Refuses to write a file over one of these, which were read to make it.
pub fn refuse_input(file: &Path, inputs: &[PathBuf]) -> Result<()> {
    let same = |input: &PathBuf| {
        fs::canonicalize(file).is_ok_and(|file| fs::canonicalize(input).is_ok_and(|input| input == file))
    };
    match inputs.iter().find(|input| same(input)) {
        None => Ok(()),
        Some(input) => Err(Error::Input(format!(
            "{} would replace {}, which was read to make it: choose another name with --out",
            file.display(),
            input.display()
        ))),
    }
}

/// Removes what an earlier run has left, but the log, which is of this run; called when nothing can refuse the run any more.
pub fn clear(directory: &Path, more: &[Kind]) -> Result<()> {
    let removed = own::all(directory, more).and_then(own::remove);
    removed.map_err(|source| refused(directory, &source))?;
    checkpoint::clear(&directory.join(checkpoint::FOLDER))
}

/// Writes the id of the run that owns a directory.
pub fn sign(directory: &Path, run: &str) -> Result<()> {
    write_bytes(&directory.join(RUN), format!("{run}\n").as_bytes())
}

/// Refuses a directory that is signed by another run than this one; `None` is one of a version that signed none. Nothing is known of a
/// directory without a signature.
pub fn refuse_another_run(directory: &Path, run: Option<&str>) -> Result<()> {
    let file = directory.join(RUN);
    let signed = match input::read_unlinked(&file, RUN_BYTES) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        read => read.map_err(|source| Error::io("read", &file, source))?,
    };
    let signed = String::from_utf8_lossy(&signed);
    if run == Some(signed.trim()) {
        return Ok(());
    }
    Err(Error::Input(format!(
        "{} names the run {}, and the checkpoint is that of another run, {}",
        file.display(),
        input::word(&signed),
        run.unwrap_or("of an older version")
    )))
}

/// Removes what a run that resumes after `step` has left: files of later steps, those of this step that are not of the `kept` kinds, partial ones, the summary and the settling plot. Called when nothing can refuse to
/// resume any more.
pub fn clear_after(directory: &Path, more: &[Kind], step: u64, kept: &[Numbered]) -> Result<()> {
    let is_later = |own: &own::Own| match own.step {
        None => [SUMMARY, SETTLING].iter().any(|end| own.path.ends_with(end)),
        Some(at) => {
            at > step
                || at == step
                    && !kept.iter().any(|kind| own.of.parent() == Some(&directory.join(kind.folder)))
        }
    };
    let removed = own::all(directory, more).and_then(|mut all| {
        all.retain(|own| own.partial || is_later(own));
        own::remove(all)
    });
    removed.map_err(|source| refused(directory, &source))
}

/// Keeps other runs out of an output directory until it is dropped or its process ends.
#[derive(Debug)]
pub struct Lock {
    _directory: fs::File,
}

/// Locks a directory: two runs that write the same files would spoil them.
fn lock(directory: &Path) -> Result<Option<Lock>> {
    let file = fs::File::open(directory).map_err(|source| refused(directory, &source))?;
    match file.try_lock() {
        Ok(()) => Ok(Some(Lock { _directory: file })),
        Err(fs::TryLockError::WouldBlock) => Err(Error::Input(format!(
            "another run is writing to the output directory {}\n  wait for its end, or choose another one with --out DIR or \
             the key output.directory",
            directory.display()
        ))),
        // Some file systems have no locks.
        Err(fs::TryLockError::Error(_)) => Ok(None),
    }
}

/// True if an open directory still has this name. While it is open, no other one gets its number.
pub fn is_named(open: &fs::File, path: &Path) -> bool {
    let number = |told: fs::Metadata| [told.dev(), told.ino()];
    open.metadata().is_ok_and(|own| fs::metadata(path).is_ok_and(|named| number(named) == number(own)))
}

fn refused(directory: &Path, source: &io::Error) -> Error {
    Error::Input(format!(
        "cannot write to the output directory {}: {source}\n  \
         choose another one with --out DIR or the key output.directory",
        directory.display()
    ))
}

/// Removes a file of an earlier run, if it is there.
pub fn remove(path: &Path) -> Result<()> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(Error::io("remove", path, error)),
        _ => Ok(()),
    }
}

/// Writes a file without a name, of which nothing can be left.
fn probe(directory: &Path) -> io::Result<()> {
    let mut file = nameless(directory)?;
    file.write_all(b"probe")?;
    file.sync_all()
}

/// A new file without a name.
fn nameless(directory: &Path) -> io::Result<fs::File> {
    #[cfg(target_os = "linux")]
    if let Ok(file) = fs::File::options().write(true).custom_flags(libc::O_TMPFILE).open(directory) {
        return Ok(file);
    }
    // Not every file system has such files: one with a name tells what is wrong otherwise.
    let path = directory.join(".turbid-probe");
    // As the directory is locked, one of the same name is a left-over.
    let _ = fs::remove_file(&path);
    let file = fs::File::create_new(&path)?;
    fs::remove_file(&path).map(|()| file)
}

#[cfg(test)]
mod tests;
