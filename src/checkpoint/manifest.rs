//! `manifest.toml`: identity and files of a checkpoint, in readable form.

use serde::{Deserialize, Serialize};
use xxhash_rust::xxh3::xxh3_64;

/// Number of the form of checkpoints that this program writes and reads.
const FORMAT: u64 = 10;

/// Begins the last line, which is a comment for TOML.
const SEAL: &str = "# xxh3 of all lines above: ";

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Manifest {
    /// Version of the program that wrote it.
    pub(super) program: String,
    pub(super) step: u64,
    pub(super) cells: [usize; 3],
    pub(super) bytes_per_cell: usize,
    pub(super) ranks: usize,
    /// Name of the case.
    pub(super) case: String,
    /// The case as resolved by the program, as JSON.
    pub(super) resolved: String,
    /// The case and the files that it names; the first is the case itself.
    pub(super) files: Vec<FileEntry>,
    /// By rank.
    pub(super) parts: Vec<PartEntry>,
}

/// A file of the case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FileEntry {
    /// Below the directory of the checkpoint.
    pub(super) file: String,
    /// As it is called in the case.
    pub(super) name: String,
    pub(super) bytes: u64,
    pub(super) xxh3: String,
}

/// The file of a rank.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PartEntry {
    pub(super) file: String,
    pub(super) bytes: u64,
    /// Checksum of its head, which has the others.
    pub(super) head_xxh3: String,
}

/// A checksum as it is written.
pub(super) fn hex(checksum: u64) -> String {
    format!("{checksum:016x}")
}

impl Manifest {
    /// The text, sealed by its checksum.
    pub(super) fn to_text(&self) -> String {
        let body = toml::to_string(self).expect("plain data can be written");
        let text =
            format!("# State of a run of turbid; `turbid resume` resumes it.\nformat = {FORMAT}\n{body}");
        let seal = hex(xxh3_64(text.as_bytes()));
        format!("{text}{SEAL}{seal}\n")
    }

    pub(super) fn read(bytes: &[u8]) -> Result<Self, String> {
        const DAMAGED: &str = "manifest.toml is damaged";
        let text = std::str::from_utf8(bytes).map_err(|_| DAMAGED)?;
        let (above, seal) = text.rfind(SEAL).map(|at| text.split_at(at)).ok_or(DAMAGED)?;
        if seal != format!("{SEAL}{}\n", hex(xxh3_64(above.as_bytes()))) {
            return Err(DAMAGED.into());
        }
        // A manifest with a right checksum is as written: if it cannot be parsed, another version wrote it.
        let mut table: toml::Table = toml::from_str(above).map_err(|_| DAMAGED)?;
        let format = table.remove("format").and_then(|format| format.as_integer());
        let read = table.clone().try_into();
        match (format, read) {
            (Some(format), Ok(manifest)) if format == FORMAT as i64 => Ok(manifest),
            _ => {
                let by = table.get("program").and_then(|by| by.as_str()).unwrap_or("another version");
                let format = format.map_or("unknown".to_string(), |format| format.to_string());
                Err(format!(
                    "it was written by turbid {by} in format {format}, and this program reads format {FORMAT}"
                ))
            }
        }
    }
}
