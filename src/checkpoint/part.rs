//! The file of one rank: `part-00000.bin`.
//!
//! ```text
//! head      168 bytes: see [`PartHead`]
//! sections  engine, coupling, shared; their lengths and checksums are in the head
//! planes    for each z of the block, ascending: for y, for x, the bytes of the cell; then xxh3 of them, 8 bytes
//! ```
//!
//! The checksum of a plane is seeded by that of the head plus z, so that no plane can be mistaken for another one.

use super::{Head, Part};
use crate::domain::Block;
use crate::memory;

use bytemuck::{Pod, Zeroable};
use std::fs::File;
use std::io::{self, BufWriter, Read, Seek, SeekFrom, Write};
use xxhash_rust::xxh3::{xxh3_64, xxh3_64_with_seed};

/// Begins every part; the last byte is the version.
const MAGIC: [u8; 8] = *b"turbidP\x01";

const SECTIONS: usize = 3;
pub(super) const ENGINE: usize = 0;
pub(super) const COUPLING: usize = 1;
pub(super) const SHARED: usize = 2;
const SECTION_NAMES: [&str; SECTIONS] = ["state of the engine", "state of the coupling", "common state"];

/// Length of the checksum of a plane (bytes).
const SEAL: u128 = 8;

#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
struct Section {
    length: u64,
    checksum: u64,
}

/// Begins the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct PartHead {
    magic: [u8; 8],
    /// Of all bytes of the head that follow this number.
    checksum: u64,
    step: u64,
    rank: u64,
    ranks: u64,
    bytes_per_cell: u64,
    cells: [u64; 3],
    lo: [u64; 3],
    hi: [u64; 3],
    sections: [Section; SECTIONS],
}

/// End of [`PartHead::checksum`].
const UNCHECKED: usize = 16;

pub(super) fn file_name(rank: usize) -> String {
    format!("part-{rank:05}.bin")
}

impl PartHead {
    fn new(head: &Head, part: &Part, rank: usize, ranks: usize) -> Self {
        let wide = |cell: [usize; 3]| cell.map(|i| i as u64);
        let mut new = Self {
            magic: MAGIC,
            checksum: 0,
            step: head.step,
            rank: rank as u64,
            ranks: ranks as u64,
            bytes_per_cell: head.bytes_per_cell as u64,
            cells: wide(head.cells),
            lo: wide(part.block.lo),
            hi: wide(part.block.hi),
            sections: [part.engine, part.coupling, part.shared]
                .map(|bytes| Section { length: bytes.len() as u64, checksum: xxh3_64(bytes) }),
        };
        new.checksum = new.own_checksum();
        new
    }

    fn own_checksum(&self) -> u64 {
        xxh3_64(&bytemuck::bytes_of(self)[UNCHECKED..])
    }

    /// Checksum of the whole head, for the manifest.
    pub(super) fn seal(&self) -> u64 {
        xxh3_64(bytemuck::bytes_of(self))
    }

    /// Reads the head of the part of `rank` of `ranks`, or returns its defect.
    pub(super) fn read(file: &mut File, (rank, ranks): (usize, usize), seal: &str) -> Result<Self, String> {
        let mut bytes = [0; size_of::<Self>()];
        file.read_exact(&mut bytes).map_err(|_| "its head cannot be read")?;
        let head: Self = bytemuck::pod_read_unaligned(&bytes);
        if super::manifest::hex(head.seal()) != seal || head.checksum != head.own_checksum() {
            return Err("its head is damaged".into());
        }
        if head.magic != MAGIC {
            return Err(format!("it is of version {}, not {}", head.magic[7], MAGIC[7]));
        }
        let fits = (0..3).all(|i| head.lo[i] < head.hi[i] && head.hi[i] <= head.cells[i])
            && head.cells.iter().try_fold(1_usize, |all, &n| all.checked_mul(n as usize)).is_some();
        if (head.rank, head.ranks) != (rank as u64, ranks as u64) || !fits {
            return Err("it is another part than its name says".into());
        }
        Ok(head)
    }

    /// Returns true if this is a part of that state.
    pub(super) fn is_of(&self, step: u64, cells: [usize; 3], bytes_per_cell: usize) -> bool {
        let of = (step, cells.map(|n| n as u64), bytes_per_cell as u64);
        (self.step, self.cells, self.bytes_per_cell) == of
    }

    pub(super) fn block(&self) -> Block {
        Block { lo: self.lo.map(|i| i as usize), hi: self.hi.map(|i| i as usize) }
    }

    /// Bytes of a plane without its checksum. Lengths are of 128 bits, since those of a file may be any numbers.
    fn plane_length(&self) -> u128 {
        let size = self.block().size();
        u128::from(self.bytes_per_cell) * size[0] as u128 * size[1] as u128
    }

    /// Start of a section; of the one behind the last, the start of the planes.
    fn section_start(&self, section: usize) -> u128 {
        let lengths = self.sections[..section].iter().map(|section| u128::from(section.length));
        size_of::<Self>() as u128 + lengths.sum::<u128>()
    }

    /// Start of a plane; of the one at `hi`, the end of the file.
    fn plane_start(&self, z: u64) -> u128 {
        let record = if self.bytes_per_cell == 0 { 0 } else { self.plane_length() + SEAL };
        record.saturating_mul(u128::from(z - self.lo[2])).saturating_add(self.section_start(SECTIONS))
    }

    pub(super) fn file_length(&self) -> u128 {
        self.plane_start(self.hi[2])
    }

    fn plane_seal(&self, z: u64, bytes: &[u8]) -> u64 {
        xxh3_64_with_seed(bytes, self.checksum.wrapping_add(z))
    }

    pub(super) fn read_section(&self, file: &mut File, section: usize) -> Result<Vec<u8>, String> {
        let name = SECTION_NAMES[section];
        let Section { length, checksum } = self.sections[section];
        // The file is as long as its head says, but a sparse file of any length takes no disk.
        let mut bytes = memory::zeroed(length as usize, &format!("the {name}")).map_err(|e| e.to_string())?;
        read_at(file, self.section_start(section), &mut bytes)
            .map_err(|e| format!("its {name} cannot be read: {e}"))?;
        if xxh3_64(&bytes) != checksum {
            return Err(format!("its {name} is damaged"));
        }
        Ok(bytes)
    }

    /// Reads a plane into `bytes`, or returns its defect.
    pub(super) fn read_plane(&self, file: &mut File, z: usize, bytes: &mut Vec<u8>) -> Result<(), String> {
        // It is that of the file, which has been checked.
        let length = self.plane_length();
        let room = ((length + SEAL) as usize).saturating_sub(bytes.len());
        memory::trying(|| bytes.try_reserve_exact(room))
            .map_err(|_| memory::refused(length as f64, &format!("plane z = {z}")).to_string())?;
        bytes.resize((length + SEAL) as usize, 0);
        read_at(file, self.plane_start(z as u64), bytes)
            .map_err(|e| format!("plane z = {z} cannot be read: {e}"))?;
        let seal = bytes.split_off(length as usize);
        if self.plane_seal(z as u64, bytes).to_ne_bytes() != seal[..] {
            return Err(format!("plane z = {z} is damaged"));
        }
        Ok(())
    }
}

fn read_at(file: &mut File, start: u128, bytes: &mut [u8]) -> io::Result<()> {
    file.seek(SeekFrom::Start(start as u64))?;
    file.read_exact(bytes)
}

/// Writes a part and brings it to disk; its head and its length (bytes).
pub(super) fn write(
    file: File,
    head: &Head,
    part: &Part,
    (rank, ranks): (usize, usize),
    mut plane: impl FnMut(usize, &mut Vec<u8>),
) -> io::Result<(PartHead, u64)> {
    let part_head = PartHead::new(head, part, rank, ranks);
    let mut file = BufWriter::with_capacity(1 << 20, file);
    file.write_all(bytemuck::bytes_of(&part_head))?;
    for section in [part.engine, part.coupling, part.shared] {
        file.write_all(section)?;
    }
    let plane_length = part_head.plane_length();
    let mut bytes = Vec::new();
    for z in (part.block.lo[2]..part.block.hi[2]).filter(|_| plane_length > 0) {
        bytes.clear();
        plane(z, &mut bytes);
        assert_eq!(bytes.len() as u128, plane_length, "plane z = {z} has another length");
        file.write_all(&bytes)?;
        file.write_all(&part_head.plane_seal(z as u64, &bytes).to_ne_bytes())?;
    }
    let file = file.into_inner().map_err(io::IntoInnerError::into_error)?;
    // Some file systems report a full disk only here.
    file.sync_all()?;
    Ok((part_head, part_head.file_length() as u64))
}
