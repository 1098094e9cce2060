//! The readers of files that may come from strangers, each as a function of bytes that must return, whatever they are: `true` if
//! the bytes were accepted. The fuzz targets call them with what libFuzzer comes up with, `tests/library/seeds.rs` with the files in
//! `seeds/`.

#![allow(dead_code, reason = "each fuzz target uses one of them")]

use std::fs;
use std::path::Path;
use std::sync::OnceLock;
use turbid::checkpoint::{self, CaseText, Checkpoint, Head, Part};
use turbid::comm::Comm;
use turbid::domain::Block;
use turbid::output::contacts;
use turbid::packing::positions::{self, Columns};
use turbid::wall::FreeSide;
use turbid::{case as cases, mesh};
use xxhash_rust::xxh3::{xxh3_64, xxh3_64_with_seed};

/// Larger meshes only take longer (bytes).
const MESH: usize = 8 << 10;

/// A case file, and behind a zero byte each a `--set` option.
pub(crate) fn case(data: &[u8]) -> bool {
    let mut parts = data.split(|&byte| byte == 0);
    let text = parts.next().unwrap_or_default();
    let options: Vec<String> = parts.map(|option| String::from_utf8_lossy(option).into_owned()).collect();
    let folder = tempfile::tempdir().expect("a folder for the case");
    let path = folder.path().join("case.toml");
    fs::write(&path, text).expect("room for the case");
    cases::outline(&path, &options).is_ok()
}

/// A text or binary STL file.
pub(crate) fn stl(data: &[u8]) -> bool {
    mesh("body.stl", data)
}

/// An OBJ file.
pub(crate) fn obj(data: &[u8]) -> bool {
    mesh("body.obj", data)
}

/// A body as it is, and the hull of its points; a wall.
fn mesh(name: &str, data: &[u8]) -> bool {
    if data.len() <= MESH {
        let _ = [None, Some(FreeSide::Inside)].map(|free| mesh::wall(Path::new(name), data, 1e-3, free));
    }
    data.len() <= MESH
        && [false, true].map(|hull| mesh::parse(Path::new(name), data, 1e-3, hull).is_ok()).contains(&true)
}

/// A table of positions.
pub(crate) fn positions(data: &[u8]) -> bool {
    places("places.csv", data)
}

/// A file of positions of the kind XYZ.
pub(crate) fn xyz(data: &[u8]) -> bool {
    places("places.xyz", data)
}

/// A dump or a data file of LAMMPS.
pub(crate) fn lammps(data: &[u8]) -> bool {
    places("places.lammps", data)
}

/// Points of VTK.
pub(crate) fn vtk(data: &[u8]) -> bool {
    if let Ok(Some(arrays)) = positions::arrays_of_a_run(data, &contacts::ARRAYS) {
        let _ = contacts::from_arrays(&arrays, 2);
    }
    places("places.vtp", data)
}

/// A file as it is, and with columns of other names.
fn places(name: &str, data: &[u8]) -> bool {
    let map = [("diameter", "2*radius"), ("x", "1e-3*Points:0 [mm] + 1")];
    let texts = map.map(|(column, text)| (column.to_string(), text.to_string()));
    let columns = Columns::new(&texts.into()).expect("texts of columns");
    let read = |columns: &Columns| positions::parse(data, name, columns, true).is_ok();
    [read(&Columns::default()), read(&columns)].contains(&true)
}

/// The manifest of a checkpoint, with the checksum that it must have, beside the part of [`sample`].
pub(crate) fn manifest(data: &[u8]) -> bool {
    let folder = tempfile::tempdir().expect("a folder for the checkpoint");
    fs::write(folder.path().join("case.toml"), "").expect("room for the case");
    fs::write(folder.path().join("part-00000.bin"), &sample().1).expect("room for the part");
    fs::write(folder.path().join("manifest.toml"), sealed(data)).expect("room for the manifest");
    read_all(folder.path())
}

/// The file of a rank, with the checksums that it must have, and a manifest that fits.
pub(crate) fn part(data: &[u8]) -> bool {
    const HEAD: usize = 168;
    if data.len() < HEAD {
        return false;
    }
    let mut bytes = data.to_vec();
    let at = |bytes: &[u8], place: usize| {
        u64::from_le_bytes(bytes[place..place + 8].try_into().expect("eight bytes"))
    };
    bytes[..8].copy_from_slice(b"turbidP\x01");
    bytes[24..40].copy_from_slice(&[0_u64.to_le_bytes(), 1_u64.to_le_bytes()].concat());
    let mut start = HEAD;
    for section in [120, 136, 152] {
        let length = usize::try_from(at(&bytes, section)).unwrap_or(usize::MAX);
        let Some(content) = start.checked_add(length).and_then(|end| bytes.get(start..end)) else {
            break;
        };
        let checksum = xxh3_64(content);
        start += length;
        bytes[section + 8..section + 16].copy_from_slice(&checksum.to_le_bytes());
    }
    let checksum = xxh3_64(&bytes[16..HEAD]);
    bytes[8..16].copy_from_slice(&checksum.to_le_bytes());
    let [lo, hi] = [72, 96].map(|place| [0, 8, 16].map(|i| at(&bytes, place + i)));
    let across = |i: usize| hi[i].saturating_sub(lo[i]);
    let plane = at(&bytes, 40).saturating_mul(across(0)).saturating_mul(across(1));
    let plane = usize::try_from(plane).unwrap_or(usize::MAX);
    for z in lo[2]..hi[2] {
        let end = start.saturating_add(plane);
        if plane == 0 || bytes.len() < end.saturating_add(8) {
            break;
        }
        let seal = xxh3_64_with_seed(&bytes[start..end], checksum.wrapping_add(z));
        bytes[end..end + 8].copy_from_slice(&seal.to_le_bytes());
        start = end + 8;
    }

    let folder = tempfile::tempdir().expect("a folder for the checkpoint");
    let [step, bytes_per_cell, x, y, z] = [16, 40, 48, 56, 64].map(|place| at(&bytes, place));
    let (nothing, head, length) = (xxh3_64(b""), xxh3_64(&bytes[..HEAD]), bytes.len());
    let format = sample().0.lines().find(|line| line.starts_with("format = "));
    let text = format!(
        "{}\nprogram = \"0\"\nstep = {step}\ncells = [{x}, {y}, {z}]\nbytes_per_cell = {bytes_per_cell}\nranks = 1\n\
         case = \"c\"\nresolved = \"{{}}\"\n\
         [[files]]\nfile = \"case.toml\"\nname = \"c\"\nbytes = 0\nxxh3 = \"{nothing:016x}\"\n\
         [[parts]]\nfile = \"part-00000.bin\"\nbytes = {length}\nhead_xxh3 = \"{head:016x}\"\n",
        format.expect("the number of the form")
    );
    fs::write(folder.path().join("case.toml"), "").expect("room for the case");
    fs::write(folder.path().join("part-00000.bin"), &bytes).expect("room for the part");
    fs::write(folder.path().join("manifest.toml"), sealed(text.as_bytes())).expect("room for the manifest");
    read_all(folder.path())
}

/// A manifest with its last line.
fn sealed(body: &[u8]) -> Vec<u8> {
    let seal = format!("# xxh3 of all lines above: {:016x}\n", xxh3_64(body));
    [body, seal.as_bytes()].concat()
}

/// The files of a small checkpoint: the manifest without its last line, and the part.
pub(crate) fn sample() -> &'static (String, Vec<u8>) {
    static SAMPLE: OnceLock<(String, Vec<u8>)> = OnceLock::new();
    SAMPLE.get_or_init(|| {
        let folder = tempfile::tempdir().expect("a folder for checkpoints");
        let head = Head {
            step: 7,
            cells: [2, 1, 1],
            bytes_per_cell: 0,
            case: CaseText {
                name: "c".to_string(),
                text: String::new(),
                files: Vec::new(),
                resolved: "{}".to_string(),
            },
        };
        let part = Part {
            block: Block { lo: [0; 3], hi: head.cells },
            engine: b"engine",
            coupling: b"coupling",
            shared: b"shared",
        };
        checkpoint::write(folder.path(), &Comm::Solo, None, &head, &part, |_, _| {}).expect("a checkpoint");
        let found = &checkpoint::list(folder.path()).expect("the checkpoint")[0].path;
        let manifest = fs::read_to_string(found.join("manifest.toml")).expect("its manifest");
        let body = manifest.rfind('#').map_or("", |seal| &manifest[..seal]);
        let part = fs::read(found.join("part-00000.bin")).expect("its part");
        (body.to_string(), part)
    })
}

/// All that a checkpoint has.
fn read_all(folder: &Path) -> bool {
    let Ok(checkpoint) = Checkpoint::open(folder) else {
        return false;
    };
    let sections = checkpoint.states(&Comm::Solo);
    let whole = Block { lo: [0; 3], hi: checkpoint.head().cells };
    sections.is_ok() && checkpoint.planes(whole, |_, _| Ok(())).is_ok()
}

/// Messages between the program and an engine in a process of its own.
pub(crate) fn protocol(data: &[u8]) -> bool {
    turbid::engine::process::read_messages(data)
}
