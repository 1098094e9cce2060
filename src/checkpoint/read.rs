//! Reading of a checkpoint: whole parts of it, or only the planes that a block needs.

use super::folder::name_of;
use super::manifest::{FileEntry, Manifest, hex};
use super::part::{self, COUPLING, ENGINE, PartHead, SHARED};
use super::{CASE_FILE, CaseText, FILES, Head, MANIFEST, kept_file};
use crate::comm::{Comm, SavedParts};
use crate::domain::Block;
use crate::error::{Error, Result};
use crate::input;
use std::fs::File;
use std::path::{Path, PathBuf};
use xxhash_rust::xxh3::xxh3_64;

/// A checkpoint whose manifest, case and heads are sound; the rest is checked as it is read.
#[derive(Clone, Debug)]
pub struct Checkpoint {
    directory: PathBuf,
    head: Head,
    shared: Vec<u8>,
    /// Files and heads, by rank.
    parts: Vec<(PathBuf, PartHead)>,
}

/// Defect of a checkpoint, without its name.
pub(crate) type Damage<T> = std::result::Result<T, String>;

impl Checkpoint {
    /// Reads and checks the manifest, the case with its files, the heads of all parts, and what all ranks have in common. Errors:
    /// [`Error::Input`] with the name of the checkpoint and what is damaged or missing.
    pub fn open(directory: &Path) -> Result<Self> {
        Self::read(directory).map_err(|what| damaged(directory, &what))
    }

    fn read(directory: &Path) -> Damage<Self> {
        let bytes = input::read_unlinked(&directory.join(MANIFEST), input::RECORD)
            .map_err(|e| format!("{MANIFEST} cannot be read: {e}"))?;
        let manifest = Manifest::read(&bytes)?;
        let Manifest { step, cells, bytes_per_cell, ranks, .. } = manifest;
        let (case, files) = manifest.files.split_first().ok_or("manifest.toml names no case")?;
        let text = content(directory, case, CASE_FILE)?;
        let text = String::from_utf8(text).map_err(|_| "case.toml is no text")?;
        if !files.is_empty() && !std::fs::symlink_metadata(directory.join(FILES)).is_ok_and(|it| it.is_dir())
        {
            return Err("it has no folder `files` of its own".into());
        }
        let files = (files.iter().enumerate())
            .map(|(n, entry)| Ok((entry.name.clone(), content(directory, entry, &kept_file(n))?)))
            .collect::<Damage<Vec<_>>>()?;
        if ranks == 0 || ranks != manifest.parts.len() {
            return Err("manifest.toml names another number of parts than there were ranks".into());
        }
        let mut parts = Vec::with_capacity(ranks);
        let mut covered = 0_usize;
        for (rank, entry) in manifest.parts.iter().enumerate() {
            let of_part = |what: String| format!("part {rank}: {what}");
            let name = part::file_name(rank);
            refuse_other_name(&entry.file, &name).map_err(of_part)?;
            let path = directory.join(name);
            let mut file = open(&path).map_err(of_part)?;
            let length = file.metadata().map_err(|e| of_part(e.to_string()))?.len();
            if length != entry.bytes {
                let wanted = entry.bytes;
                return Err(of_part(format!("it has {length} bytes, not {wanted}")));
            }
            let head = PartHead::read(&mut file, (rank, ranks), &entry.head_xxh3).map_err(of_part)?;
            if !head.is_of(step, cells, bytes_per_cell) || head.file_length() != u128::from(length) {
                return Err(of_part("it is of another checkpoint".to_string()));
            }
            covered = head.block().cell_count().saturating_add(covered);
            parts.push((path, head));
        }
        if covered != cells.iter().product::<usize>() {
            return Err("its parts do not cover the box".into());
        }
        let mut checkpoint = Self {
            directory: directory.to_path_buf(),
            head: Head {
                step,
                cells,
                bytes_per_cell,
                case: CaseText { name: manifest.case, text, files, resolved: manifest.resolved },
            },
            shared: Vec::new(),
            parts,
        };
        checkpoint.shared = checkpoint.section(0, SHARED)?;
        Ok(checkpoint)
    }

    /// Identity of the state.
    pub fn head(&self) -> &Head {
        &self.head
    }

    /// Name of the checkpoint, `step-0000000100`.
    pub fn name(&self) -> String {
        name_of(&self.directory)
    }

    /// Number of ranks that wrote it.
    pub fn ranks(&self) -> usize {
        self.parts.len()
    }

    /// Data common to all ranks.
    pub fn shared(&self) -> &[u8] {
        &self.shared
    }

    /// States of the engine and of the coupling in the parts that this rank [reads](SavedParts::indices), and in no others; or
    /// [`Error::Input`] with the part that is damaged. Not collective.
    pub fn states(&self, comm: &Comm) -> Result<[SavedParts; 2]> {
        let count = self.ranks();
        let of = |section| -> Damage<SavedParts> {
            let read = |n| Ok((n, self.section(n, section)?));
            Ok(SavedParts { own: SavedParts::indices(comm, count).map(read).collect::<Damage<_>>()?, count })
        };
        let states = of(ENGINE).and_then(|engine| Ok([engine, of(COUPLING)?]));
        states.map_err(|what| damaged(&self.directory, &what))
    }

    /// Calls `visit(piece, bytes)` with all cells of `block`, once each: `piece` is what one stored block has of one plane of
    /// `block`, and `bytes` are those of its cells, for y, for x. Nothing in a dry run. Errors: [`Error::Input`] with the part and
    /// plane that is damaged or that `visit` refuses, or if some cells are in no part; what was visited until then was sound.
    pub fn planes(&self, block: Block, visit: impl FnMut(Block, &[u8]) -> Damage<()>) -> Result<()> {
        self.read_planes(block, visit).map_err(|what| damaged(&self.directory, &what))
    }

    fn read_planes(&self, block: Block, mut visit: impl FnMut(Block, &[u8]) -> Damage<()>) -> Damage<()> {
        if self.head.bytes_per_cell == 0 {
            return Ok(());
        }
        let (mut plane, mut bytes) = (Vec::new(), Vec::new());
        let mut met: Vec<Block> = Vec::new();
        for (rank, (path, head)) in self.parts.iter().enumerate() {
            let stored = head.block();
            let Some(common) = block.common(&stored) else {
                continue;
            };
            let of_part = |what: String| format!("part {rank}, {what}");
            if met.iter().any(|other| other.common(&common).is_some()) {
                return Err(of_part("which has cells of another part".to_string()));
            }
            met.push(common);
            let mut file = open(path).map_err(of_part)?;
            for z in common.lo[2]..common.hi[2] {
                head.read_plane(&mut file, z, &mut plane).map_err(of_part)?;
                let mut piece = common;
                (piece.lo[2], piece.hi[2]) = (z, z + 1);
                bytes.clear();
                stored.cut_plane(&plane, &piece, self.head.bytes_per_cell, &mut bytes);
                visit(piece, &bytes).map_err(|what| of_part(format!("plane z = {z}: {what}")))?;
            }
        }
        let covered: usize = met.iter().map(Block::cell_count).sum();
        if covered < block.cell_count() {
            return Err(format!("{} cells are in no part", block.cell_count() - covered));
        }
        Ok(())
    }

    fn section(&self, rank: usize, section: usize) -> Damage<Vec<u8>> {
        let (path, head) = &self.parts[rank];
        open(path)
            .and_then(|mut file| head.read_section(&mut file, section))
            .map_err(|what| format!("part {rank}: {what}"))
    }
}

fn damaged(directory: &Path, what: &str) -> Error {
    Error::Input(format!("checkpoint {}: {what}", name_of(directory)))
}

fn open(path: &Path) -> Damage<File> {
    input::open_unlinked(path).map_err(|e| format!("{} cannot be read: {e}", name_of(path)))
}

/// A manifest may name no files but those that this program writes beside it.
fn refuse_other_name(given: &str, name: &str) -> Damage<()> {
    if given == name {
        return Ok(());
    }
    let given = input::word(given);
    Err(format!("manifest.toml names the file `{given}` where {name} belongs"))
}

/// A file of the case, which this program calls `name`.
fn content(directory: &Path, entry: &FileEntry, name: &str) -> Damage<Vec<u8>> {
    refuse_other_name(&entry.file, name)?;
    let bytes = input::read_unlinked(&directory.join(name), input::POSITIONS)
        .map_err(|e| format!("{name} cannot be read: {e}"))?;
    if bytes.len() as u64 != entry.bytes || hex(xxh3_64(&bytes)) != entry.xxh3 {
        return Err(format!("{name} is damaged"));
    }
    Ok(bytes)
}
