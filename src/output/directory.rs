//! Where output goes, and the names of its files.
//!
//! ```text
//! DIRECTORY/
//!   summary.json  series.csv  particle_series.csv  settling_velocity.png  walls.vtp  liggghts.log
//!   fields.pvd        fields/fields_0000001000.vti ...
//!   particles.pvd     particles/particles_0000001000.vtp ...
//!   contacts.pvd      contacts/contacts_0000001000.vtp ...
//!   force_chains.pvd  force_chains/force_chains_0000001000.vtp ...
//!   pictures/velocity_0000001000.png ...
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
//! run left under them, so that frames of two runs never mix; files with other names are never touched.

use super::atomic::PARTIAL_SUFFIX;
use super::pieces;
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
const TOP: [&str; 9] = [
    "summary.json",
    "series.csv",
    "settling_velocity.png",
    "fields.pvd",
    "particles.pvd",
    "contacts.pvd",
    "force_chains.pvd",
    "walls.vtp",
    "particle_series.csv",
];
/// What an external engine says.
const LOG: &str = "liggghts.log";
/// Directory, prefix and extension of the numbered files.
const FIELDS: (&str, &str, &str) = ("fields", "fields_", ".vti");
const PARTICLES: (&str, &str, &str) = ("particles", "particles_", ".vtp");
const CONTACTS: (&str, &str, &str) = ("contacts", "contacts_", ".vtp");
const FORCE_CHAINS: (&str, &str, &str) = ("force_chains", "force_chains_", ".vtp");
const PICTURES: (&str, &str, &str) = ("pictures", "velocity_", ".png");
const FOLDERS: [(&str, &str, &str); 5] = [FIELDS, PARTICLES, CONTACTS, FORCE_CHAINS, PICTURES];

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

    /// The particle surfaces at `step`.
    pub fn particles(&self, step: u64) -> PathBuf {
        self.numbered(PARTICLES, step)
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

    fn numbered(&self, (folder, prefix, extension): (&str, &str, &str), step: u64) -> PathBuf {
        self.directory
            .join(folder)
            .join(format!("{prefix}{step:010}{extension}"))
    }
}

/// Creates the output directory, and proves that files can be written; the log of an earlier run goes.
///
/// Called before anything is computed, so that a run cannot fail at its first output after hours.
pub fn create(directory: &Path) -> Result<()> {
    let attempt = || -> io::Result<()> {
        fs::create_dir_all(directory)?;
        remove_matching(directory, |name| name == LOG)?;
        for (folder, ..) in FOLDERS {
            let folder = directory.join(folder);
            if folder.is_dir() {
                probe(&folder)?;
            }
        }
        probe(directory)
    };
    attempt().map_err(|source| refused(directory, &source))
}

/// Removes what an earlier run has left in a directory that [`create`] has made, but the log, which is of this run.
///
/// Called when nothing can refuse the run any more.
pub fn clear(directory: &Path) -> Result<()> {
    let attempt = || -> io::Result<()> {
        remove_matching(directory, |name| TOP.contains(&name))?;
        for (folder, prefix, extension) in FOLDERS {
            let folder = directory.join(folder);
            if !folder.is_dir() {
                continue;
            }
            let index = extension.replacen('.', ".p", 1);
            remove_matching(&folder, |name| {
                [extension, &index].into_iter().any(|extension| {
                    name.strip_suffix(extension)
                        .is_some_and(|stem| is_frame(stem, prefix))
                })
            })?;
            remove_pieces(&folder, prefix, extension)?;
        }
        Ok(())
    };
    attempt().map_err(|source| refused(directory, &source))
}

/// Whether this is the name of a frame, but for its extension.
fn is_frame(stem: &str, prefix: &str) -> bool {
    stem.strip_prefix(prefix).is_some_and(pieces::is_number)
}

/// Removes the pieces of all frames in a folder, and the folders that are empty then.
fn remove_pieces(folder: &Path, prefix: &str, extension: &str) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let name = entry.file_name();
        let frame = name.to_str().filter(|name| is_frame(name, prefix));
        if let (Some(frame), true) = (frame, entry.file_type()?.is_dir()) {
            remove_matching(&entry.path(), |name| pieces::is_piece(name, frame, extension))?;
            match fs::remove_dir(entry.path()) {
                Err(error) if error.kind() != io::ErrorKind::DirectoryNotEmpty => return Err(error),
                _ => {}
            }
        }
    }
    Ok(())
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
    for entry in fs::read_dir(directory)? {
        let entry = entry?;
        let name = entry.file_name();
        let Some(name) = name.to_str() else { continue };
        if own(name.strip_suffix(PARTIAL_SUFFIX).unwrap_or(name)) && !entry.file_type()?.is_dir() {
            fs::remove_file(entry.path())?;
        }
    }
    Ok(())
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
        assert_eq!(left, 7, "five folders, two foreign files, no probe");
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
    }
}
