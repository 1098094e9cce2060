//! Where output goes, and the names of its files.
//!
//! ```text
//! DIRECTORY/
//!   summary.json  series.csv  particle_series.csv  settling_velocity.png  walls.vtp  liggghts.log
//!   fields.pvd        fields/fields_0000001000.vti ...
//!   particles.pvd     particles/particles_0000001000.vtp ...
//!   surfaces.pvd      surfaces/surfaces_0000001000.vtp ...
//!   contacts.pvd      contacts/contacts_0000001000.vtp ...
//!   force_chains.pvd  force_chains/force_chains_0000001000.vtp ...
//!   pictures/velocity_0000001000.png ...
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
//! The folders appear with their first file. A run owns these names and no others. [`clear`] removes what an earlier
//! run left under them, so that frames of two runs never mix, and [`clear_after`] what a run left that goes on from before it; files
//! with other names are never touched.

use super::atomic::PARTIAL_SUFFIX;
use super::pieces;
use crate::checkpoint;
use crate::error::{Error, Result};
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Names of all files of a run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OutputFiles {
    directory: PathBuf,
}

/// Files directly in the output directory.
const TOP: [&str; 10] = [
    "summary.json",
    "series.csv",
    "settling_velocity.png",
    "fields.pvd",
    "particles.pvd",
    "contacts.pvd",
    "force_chains.pvd",
    "walls.vtp",
    "particle_series.csv",
    "surfaces.pvd",
];
/// What an external engine says.
const LOG: &str = "liggghts.log";
/// Directory, prefix and extension of the numbered files.
const FIELDS: (&str, &str, &str) = ("fields", "fields_", ".vti");
const PARTICLES: (&str, &str, &str) = ("particles", "particles_", ".vtp");
const SURFACES: (&str, &str, &str) = ("surfaces", "surfaces_", ".vtp");
const CONTACTS: (&str, &str, &str) = ("contacts", "contacts_", ".vtp");
const FORCE_CHAINS: (&str, &str, &str) = ("force_chains", "force_chains_", ".vtp");
const PICTURES: (&str, &str, &str) = ("pictures", "velocity_", ".png");
const FOLDERS: [(&str, &str, &str); 6] = [FIELDS, PARTICLES, SURFACES, CONTACTS, FORCE_CHAINS, PICTURES];

impl OutputFiles {
    /// The files of a run whose output goes to `directory`.
    pub fn new(directory: impl Into<PathBuf>) -> Self {
        Self {
            directory: directory.into(),
        }
    }

    /// The output directory.
    pub fn directory(&self) -> &Path {
        &self.directory
    }

    /// The result in numbers.
    pub fn summary(&self) -> PathBuf {
        self.directory.join(TOP[0])
    }

    /// The time series.
    pub fn series(&self) -> PathBuf {
        self.directory.join(TOP[1])
    }

    /// The plot of settling velocity over time.
    pub fn settling_plot(&self) -> PathBuf {
        self.directory.join(TOP[2])
    }

    /// The collection of all field files.
    pub fn fields_collection(&self) -> PathBuf {
        self.directory.join(TOP[3])
    }

    /// The collection of all particle files.
    pub fn particles_collection(&self) -> PathBuf {
        self.directory.join(TOP[4])
    }

    /// The collection of all files of surfaces.
    pub fn surfaces_collection(&self) -> PathBuf {
        self.directory.join(TOP[9])
    }

    /// The collection of all contact files.
    pub fn contacts_collection(&self) -> PathBuf {
        self.directory.join(TOP[5])
    }

    /// The collection of all files of force chains.
    pub fn force_chains_collection(&self) -> PathBuf {
        self.directory.join(TOP[6])
    }

    /// The walls.
    pub fn walls(&self) -> PathBuf {
        self.directory.join(TOP[7])
    }

    /// The time series of single particles.
    pub fn particle_series(&self) -> PathBuf {
        self.directory.join(TOP[8])
    }

    /// What LIGGGHTS prints.
    pub fn liggghts_log(&self) -> PathBuf {
        self.directory.join(LOG)
    }

    /// The fluid fields at `step`.
    pub fn fields(&self, step: u64) -> PathBuf {
        self.numbered(FIELDS, step)
    }

    /// The surfaces of the particles at `step`.
    pub fn surfaces(&self, step: u64) -> PathBuf {
        self.numbered(SURFACES, step)
    }

    /// The particles at `step`, a point each.
    pub fn particles(&self, step: u64) -> PathBuf {
        self.numbered(PARTICLES, step)
    }

    /// The steps of which there are files of particles, ascending.
    ///
    /// # Errors
    /// [`Error::Io`] if the folder of the run cannot be read.
    pub fn steps_of_particles(&self) -> Result<Vec<u64>> {
        let (folder, prefix, extension) = PARTICLES;
        let folder = self.directory.join(folder);
        let entries = match fs::read_dir(&folder) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
            entries => entries.map_err(|source| Error::io("read", &folder, source))?,
        };
        let index = extension.replacen('.', ".p", 1);
        let step = |name: &str| {
            let frame = name
                .strip_suffix(extension)
                .or_else(|| name.strip_suffix(&index))?;
            frame.strip_prefix(prefix)?.parse().ok()
        };
        let mut steps: Vec<u64> = (entries.filter_map(std::result::Result::ok))
            .filter_map(|entry| step(entry.file_name().to_str()?))
            .collect();
        steps.sort_unstable();
        Ok(steps)
    }

    /// The contacts at `step`.
    pub fn contacts(&self, step: u64) -> PathBuf {
        self.numbered(CONTACTS, step)
    }

    /// The force chains at `step`.
    pub fn force_chains(&self, step: u64) -> PathBuf {
        self.numbered(FORCE_CHAINS, step)
    }

    /// The velocity slice at `step`.
    pub fn picture(&self, step: u64) -> PathBuf {
        self.numbered(PICTURES, step)
    }

    /// The checkpoints.
    pub fn checkpoints(&self) -> PathBuf {
        self.directory.join(checkpoint::FOLDER)
    }

    fn numbered(&self, (folder, prefix, extension): (&str, &str, &str), step: u64) -> PathBuf {
        self.directory
            .join(folder)
            .join(format!("{prefix}{step:010}{extension}"))
    }
}

/// Creates the output directory, keeps other runs out of it as long as the lock lives (`None` on a file system without
/// locks), and proves that files can be written; the log of an earlier run goes.
///
/// Called before anything is computed, so that a run cannot fail at its first output after hours.
///
/// # Errors
/// [`Error::Input`] if nothing can be written there, or if another run does.
pub fn create(directory: &Path) -> Result<Option<Lock>> {
    fs::create_dir_all(directory).map_err(|source| refused(directory, &source))?;
    let lock = lock(directory)?;
    let attempt = || -> io::Result<()> {
        remove_matching(directory, |name| name == LOG)?;
        for folder in FOLDERS
            .iter()
            .map(|(folder, ..)| *folder)
            .chain([checkpoint::FOLDER])
        {
            let folder = directory.join(folder);
            if fs::symlink_metadata(&folder).is_ok() {
                let named = |e: io::Error| io::Error::new(e.kind(), format!("{}: {e}", folder.display()));
                probe(&folder).map_err(named)?;
            }
        }
        probe(directory)
    };
    attempt().map_err(|source| refused(directory, &source))?;
    Ok(lock)
}

/// Removes what an earlier run has left in a directory that [`create`] has made, but the log, which is of this run.
///
/// Called when nothing can refuse the run any more.
pub fn clear(directory: &Path) -> Result<()> {
    let attempt = || -> io::Result<()> {
        remove_matching(directory, |name| TOP.contains(&name))?;
        remove_frames(directory, |_, _, _| true)
    };
    attempt().map_err(|source| refused(directory, &source))?;
    checkpoint::clear(&directory.join(checkpoint::FOLDER))
}

/// Removes what a run has left that goes on after `step`: files of later steps, those of this step that are not in `kept` (full
/// paths; that of a file stands for its pieces and their index), what it was writing, and what tells of its end. All else stays,
/// checkpoints too.
///
/// Called when nothing can refuse to go on any more.
pub fn clear_after(directory: &Path, step: u64, kept: &[PathBuf]) -> Result<()> {
    let attempt = || -> io::Result<()> {
        for partial in TOP.map(|name| directory.join(format!("{name}{PARTIAL_SUFFIX}"))) {
            remove_if_there(&partial)?;
        }
        for end in [TOP[0], TOP[2]] {
            remove_if_there(&directory.join(end))?;
        }
        remove_frames(directory, |file, of, partial| {
            partial || of > step || of == step && !kept.iter().any(|kept| kept == file)
        })
    };
    attempt().map_err(|source| refused(directory, &source))
}

/// Removes the numbered files, finished or partial, that `goes` chooses by the file that they are or are a part of, its step, and
/// whether they are partial; and folders of pieces that are empty then.
fn remove_frames(directory: &Path, goes: impl Fn(&Path, u64, bool) -> bool) -> io::Result<()> {
    for (folder, prefix, extension) in FOLDERS {
        let folder = directory.join(folder);
        if !folder.is_dir() {
            continue;
        }
        let goes = |frame: &str, partial: bool| {
            let digits = frame
                .strip_prefix(prefix)
                .filter(|digits| pieces::is_number(digits));
            let whole = || folder.join(format!("{frame}{extension}"));
            digits
                .and_then(|digits| digits.parse().ok())
                .is_some_and(|step| goes(&whole(), step, partial))
        };
        let index = extension.replacen('.', ".p", 1);
        remove_chosen(&folder, |name, partial| {
            let frame = name.strip_suffix(extension).or_else(|| name.strip_suffix(&index));
            frame.is_some_and(|frame| goes(frame, partial))
        })?;
        for entry in fs::read_dir(&folder)? {
            let entry = entry?;
            let (path, name) = (entry.path(), entry.file_name());
            let Some(frame) = name.to_str() else { continue };
            if entry.file_type()?.is_dir() {
                remove_chosen(&path, |name, partial| {
                    pieces::is_piece(name, frame, extension) && goes(frame, partial)
                })?;
                if goes(frame, false) {
                    remove_if_empty(&path)?;
                }
            }
        }
    }
    Ok(())
}

/// Keeps other runs out of an output directory until it is dropped, or its process ends in any way.
#[derive(Debug)]
pub struct Lock {
    _directory: fs::File,
}

/// Takes hold of a directory, unless another run has it: two that write the same files would spoil them.
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

fn refused(directory: &Path, source: &io::Error) -> Error {
    Error::Input(format!(
        "cannot write to the output directory {}: {source}\n  \
         choose another one with --out DIR or the key output.directory",
        directory.display()
    ))
}

/// Removes the files, finished or partial, whose final name is `own`.
fn remove_matching(directory: &Path, own: impl Fn(&str) -> bool) -> io::Result<()> {
    remove_chosen(directory, |name, _| own(name))
}

/// Removes the files that `goes` chooses by their final name and whether they are partial.
fn remove_chosen(directory: &Path, goes: impl Fn(&str, bool) -> bool) -> io::Result<()> {
    for entry in fs::read_dir(directory)? {
        let entry = entry?;
        let name = entry.file_name();
        let Some(name) = name.to_str() else { continue };
        let finished = name.strip_suffix(PARTIAL_SUFFIX);
        if goes(finished.unwrap_or(name), finished.is_some()) && !entry.file_type()?.is_dir() {
            fs::remove_file(entry.path())?;
        }
    }
    Ok(())
}

fn remove_if_empty(folder: &Path) -> io::Result<()> {
    match fs::remove_dir(folder) {
        Err(error) if error.kind() == io::ErrorKind::DirectoryNotEmpty => Ok(()),
        removed => removed,
    }
}

/// Removes a file of an earlier run, if it is there.
///
/// # Errors
/// [`Error::Io`] if it cannot be removed.
pub fn remove(path: &Path) -> Result<()> {
    remove_if_there(path).map_err(|source| Error::io("remove", path, source))
}

fn remove_if_there(path: &Path) -> io::Result<()> {
    match fs::remove_file(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        removed => removed,
    }
}

/// Writes a file that does not exist yet, and removes it again.
fn probe(directory: &Path) -> io::Result<()> {
    let path = directory.join(format!(".turbid-probe-{}", std::process::id()));
    let written = fs::File::create_new(&path).and_then(|mut file| {
        file.write_all(b"probe")?;
        file.sync_all()
    });
    // A probe of another run of the same number is not ours to remove.
    match written {
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => Err(error),
        written => written.and(fs::remove_file(&path)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_earlier_run_is_cleared_and_foreign_files_stay() {
        let root = tempfile::tempdir().unwrap();
        let directory = root.path().join("a/b");
        create(&directory).unwrap();
        let files = OutputFiles::new(&directory);
        let own = [
            files.summary(),
            files.series(),
            files.settling_plot(),
            files.fields_collection(),
            files.particles_collection(),
            files.fields(3),
            files.particles(12_345_678_901),
            files.surfaces_collection(),
            files.surfaces(12),
            files.picture(0),
            files.particle_series(),
            files.contacts_collection(),
            files.contacts(3),
            files.force_chains_collection(),
            files.force_chains(3),
            files.walls(),
            files.fields(4).with_extension("vti.tmp"),
            pieces::index(&files.fields(5)),
            pieces::piece(&files.fields(5), 0),
            pieces::piece(&files.fields(5), 12_345).with_extension("vti.tmp"),
            pieces::index(&files.contacts(5)),
            pieces::piece(&files.contacts(5), 1),
            pieces::piece(&files.contacts(6), 1),
        ];
        let foreign = [
            directory.join("notes.txt"),
            directory.join("fields/fields_best.vti"),
            directory.join("particles/fields_0000000001.vti"),
            directory.join("summary.json.bak"),
            directory.join("contacts/contacts_0000000006/notes.txt"),
            directory.join("contacts/contacts_best/contacts_best_p00001.vtp"),
            directory.join("fields/fields_0000000005.pvtp"),
        ];
        for path in own.iter().chain(&foreign) {
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, "x").unwrap();
        }
        for name in [
            "step-0000000100",
            "step-0000000200.partial",
            "step-0000000100.replaced",
            "mine",
        ] {
            fs::create_dir_all(files.checkpoints().join(name)).unwrap();
        }
        create(&directory).unwrap();
        let summary = files.summary();
        assert!(summary.exists(), "a run may be refused yet");
        clear(&directory).unwrap();
        for path in own {
            assert!(!path.exists(), "{} is stale", path.display());
        }
        for path in foreign {
            assert!(path.exists(), "{} is not ours", path.display());
        }
        assert!(
            !directory.join("fields/fields_0000000005").exists(),
            "an empty folder"
        );
        let left = fs::read_dir(&directory).unwrap().count();
        assert_eq!(left, 9, "seven folders, two foreign files, no probe");
        let left: Vec<_> = fs::read_dir(files.checkpoints())
            .unwrap()
            .map(|e| e.unwrap().file_name())
            .collect();
        assert_eq!(left, ["mine"]);
    }

    #[test]
    fn a_run_that_goes_on_keeps_what_is_before_its_step_and_what_it_is_told_to_keep() {
        let root = tempfile::tempdir().unwrap();
        let directory = root.path();
        let files = OutputFiles::new(directory);
        let partial = |path: PathBuf| PathBuf::from(format!("{}.tmp", path.display()));
        let stays = [
            files.series(),
            files.particle_series(),
            files.fields_collection(),
            files.walls(),
            files.fields(3),
            files.fields(5),
            files.particles(4),
            files.liggghts_log(),
            pieces::index(&files.fields(3)),
            pieces::piece(&files.fields(3), 1),
            pieces::index(&files.force_chains(5)),
            pieces::piece(&files.force_chains(5), 0),
            directory.join("fields/fields_0000000009.txt"),
            directory.join("summary.json.bak"),
        ];
        let goes = [
            files.summary(),
            files.settling_plot(),
            files.particles(5),
            files.contacts(6),
            files.force_chains(7),
            files.picture(12_345_678_901),
            partial(files.fields(2)),
            partial(files.series()),
            pieces::index(&files.particles(5)),
            pieces::piece(&files.particles(5), 2),
            pieces::index(&files.fields(6)),
            pieces::piece(&files.fields(6), 7),
            partial(pieces::piece(&files.fields(3), 0)),
        ];
        for path in stays.iter().chain(&goes) {
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, "x").unwrap();
        }
        let checkpoint = files.checkpoints().join("step-0000000009");
        fs::create_dir_all(&checkpoint).unwrap();
        let kept = [files.fields(5), files.force_chains(5), files.contacts(6)];
        clear_after(directory, 5, &kept).unwrap();
        for path in stays.iter().chain([&checkpoint]) {
            assert!(path.exists(), "{} is needed", path.display());
        }
        for path in goes {
            assert!(
                !path.exists(),
                "{} is of a course that was given up",
                path.display()
            );
        }
        assert!(!directory.join("fields/fields_0000000006").exists());
    }

    #[test]
    fn a_directory_that_a_run_writes_to_is_refused_until_that_ends() {
        let root = tempfile::tempdir().unwrap();
        let held = lock(root.path()).unwrap();
        assert!(held.is_some());
        let refused = lock(root.path()).unwrap_err().to_string();
        assert!(
            refused.contains("another run") && refused.contains("--out"),
            "{refused}"
        );
        drop(held);
        assert!(lock(root.path()).unwrap().is_some());
    }

    #[test]
    fn a_place_where_nothing_can_be_written_is_named_with_a_remedy() {
        let root = tempfile::tempdir().unwrap();
        let file = root.path().join("file");
        fs::write(&file, "x").unwrap();
        for directory in [file.join("out"), PathBuf::from("/proc/turbid")] {
            let error = create(&directory).unwrap_err();
            assert_eq!(error.exit_code(), 2);
            let text = error.to_string();
            assert!(
                text.contains(&directory.display().to_string()) && text.contains("--out"),
                "{text}"
            );
        }
        assert_eq!(fs::read(&file).unwrap(), b"x");
        fs::write(root.path().join(checkpoint::FOLDER), "x").unwrap();
        let text = create(root.path()).unwrap_err().to_string();
        assert!(text.contains(checkpoint::FOLDER), "{text}");
    }
}
