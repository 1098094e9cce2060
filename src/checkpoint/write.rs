//! Writing of a checkpoint: parts by all ranks, the rest and the final name by rank 0.

use super::folder;
use super::manifest::{FileEntry, Manifest, PartEntry, hex};
use super::{CASE_FILE, FILES, Head, MANIFEST, Part, agreed, in_rank_0, kept_file, part};
use crate::comm::Comm;
use crate::error::{Error, Result};
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::Path;
use xxhash_rust::xxh3::xxh3_64;

/// Opens a file to write that is not there yet.
pub(super) type Create<'a> = dyn Fn(&Path) -> io::Result<File> + 'a;

/// As [`super::write()`]; `create` makes the files.
pub(super) fn write(
    directory: &Path,
    comm: &Comm,
    sound: Option<u64>,
    head: &Head,
    part: &Part,
    plane: impl FnMut(usize, &mut Vec<u8>),
    create: &Create,
) -> Result<()> {
    assert!(part.shared.is_empty() || comm.rank() == 0, "shared data are of rank 0");
    let partial = folder::partial(directory, head.step);
    let prepare = || {
        if !directory.is_dir() {
            fs::create_dir_all(directory).map_err(|e| Error::io("make", directory, e))?;
            if let Some(parent) = directory.parent().filter(|parent| parent.is_dir()) {
                folder::sync_folder(parent)?;
            }
        }
        folder::clear_partial(directory)?;
        fs::create_dir(&partial).map_err(|e| Error::io("make", &partial, e))
    };
    let attempt = || {
        agreed(comm, in_rank_0(comm, prepare))?;
        let path = partial.join(part::file_name(comm.rank()));
        let ranks = (comm.rank(), comm.size());
        let written = create(&path).and_then(|file| part::write(file, head, part, ranks, plane));
        let (part_head, length) = agreed(comm, written.map_err(|e| Error::io("write", &path, e)))?;
        let parts = comm.gather(bytemuck::bytes_of(&[part_head.seal(), length]).to_vec());
        let finished = in_rank_0(comm, || {
            finish(&partial, head, &parts, create)?;
            folder::put_in_place(directory, head.step)?;
            folder::thin_out(directory, head.step, sound)
        });
        agreed(comm, finished)
    };
    attempt().map_err(|why| {
        if comm.rank() == 0 {
            // The error at hand matters more than a failure to clean up after it; the folder stays if others are in it.
            let _ = fs::remove_dir_all(&partial);
            let _ = fs::remove_dir(directory);
        }
        let before = match sound {
            Some(step) => format!("the checkpoint of step {step} is intact"),
            None => "there is no earlier one".to_string(),
        };
        Error::Agreed {
            code: 2,
            text: format!("the checkpoint of step {} failed: {why}; {before}", head.step),
        }
    })
}

/// Writes all that is not a part, and brings the names of all files to disk.
fn finish(partial: &Path, head: &Head, parts: &[Vec<u8>], create: &Create) -> Result<()> {
    let put = |name: &str, bytes: &[u8]| {
        let path = partial.join(name);
        let attempt = || -> io::Result<()> {
            let mut file = create(&path)?;
            file.write_all(bytes)?;
            file.sync_all()
        };
        attempt().map_err(|e| Error::io("write", &path, e))
    };
    let case = &head.case;
    let mut contents = vec![(CASE_FILE.to_string(), case.name.as_str(), case.text.as_bytes())];
    if !case.files.is_empty() {
        let files = partial.join(FILES);
        fs::create_dir(&files).map_err(|e| Error::io("make", &files, e))?;
    }
    for (n, (name, bytes)) in case.files.iter().enumerate() {
        contents.push((kept_file(n), name, bytes));
    }
    let mut files = Vec::new();
    for (file, name, bytes) in contents {
        put(&file, bytes)?;
        files.push(FileEntry {
            file,
            name: name.to_string(),
            bytes: bytes.len() as u64,
            xxh3: hex(xxh3_64(bytes)),
        });
    }
    let manifest = Manifest {
        program: env!("CARGO_PKG_VERSION").to_string(),
        step: head.step,
        cells: head.cells,
        bytes_per_cell: head.bytes_per_cell,
        ranks: parts.len(),
        case: case.name.clone(),
        resolved: case.resolved.clone(),
        files,
        parts: (parts.iter().enumerate())
            .map(|(rank, sums)| {
                let [seal, bytes] = bytemuck::pod_read_unaligned(sums);
                PartEntry { file: part::file_name(rank), bytes, head_xxh3: hex(seal) }
            })
            .collect(),
    };
    put(MANIFEST, manifest.to_text().as_bytes())?;
    if !case.files.is_empty() {
        folder::sync_folder(&partial.join(FILES))?;
    }
    folder::sync_folder(partial)
}
