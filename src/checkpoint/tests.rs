//! Written by uneven ranks, read by others, and damaged in every way.

use super::manifest::Manifest;
use super::*;
use crate::comm::{Comm, SavedParts, on_threads};
use std::collections::BTreeSet;
use std::fs::OpenOptions;
use std::io;
use std::path::PathBuf;
use tempfile::TempDir;

const CELLS: [usize; 3] = [7, 6, 9];
const BYTES: usize = 5;
const WHOLE: Block = Block { lo: [0; 3], hi: CELLS };

/// Four blocks of different sizes that fill the box.
const UNEVEN: [Block; 4] = [
    Block { lo: [0, 0, 0], hi: [3, 6, 4] },
    Block { lo: [3, 0, 0], hi: [7, 6, 4] },
    Block { lo: [0, 0, 4], hi: [7, 1, 9] },
    Block { lo: [0, 1, 4], hi: [7, 6, 9] },
];

/// The box in `n` slices along x.
fn slice(n: usize, rank: usize) -> Block {
    let mut block = WHOLE;
    (block.lo[0], block.hi[0]) = (CELLS[0] * rank / n, CELLS[0] * (rank + 1) / n);
    block
}

/// Bytes of a cell at a step.
fn cell(step: u64, [x, y, z]: [usize; 3]) -> [u8; BYTES] {
    let number = (step << 32) + (x + CELLS[0] * (y + CELLS[1] * z)) as u64;
    let bytes = xxhash_rust::xxh3::xxh3_64(&number.to_le_bytes()).to_le_bytes();
    std::array::from_fn(|i| bytes[i])
}

fn head(step: u64) -> Head {
    Head {
        step,
        cells: CELLS,
        bytes_per_cell: BYTES,
        case: CaseText {
            name: "stones".to_string(),
            text: "# a case\n[run]\nend.steps = 7\n".to_string(),
            files: vec![
                ("../meshes/stone.stl".to_string(), vec![7; 30]),
                ("positions.csv".to_string(), b"1,2,3\n".to_vec()),
            ],
            resolved: r#"{"coupling":"saturated"}"#.to_string(),
        },
    }
}

fn sections(rank: usize) -> [Vec<u8>; 3] {
    let shared = if rank == 0 { b"all of us".to_vec() } else { Vec::new() };
    [vec![rank as u8; 11 + rank], vec![0x40 + rank as u8; rank], shared]
}

/// One rank's part of writing a step.
fn write_as(directory: &Path, comm: &Comm, block: Block, head: &Head, create: &write::Create) -> Result<()> {
    let [engine, coupling, shared] = sections(comm.rank());
    let part = Part { block, engine: &engine, coupling: &coupling, shared: &shared };
    let plane = |z, out: &mut Vec<u8>| {
        for y in block.lo[1]..block.hi[1] {
            for x in block.lo[0]..block.hi[0] {
                out.extend_from_slice(&cell(head.step, [x, y, z]));
            }
        }
    };
    // The one before, as of a run that continues; else that of the same step.
    let before = list(directory).unwrap_or_default();
    let sound = (before.iter().map(|found| found.step))
        .filter(|&step| step <= head.step)
        .max_by_key(|&step| (step < head.step, step));
    write::write(directory, comm, sound, head, &part, plane, create)
}

/// Writes a step by the four uneven ranks; their results.
fn write_with(
    directory: &Path,
    head: &Head,
    create: impl Fn(&Path) -> io::Result<File> + Sync,
) -> Vec<Result<()>> {
    on_threads(4, |comm| write_as(directory, &comm, UNEVEN[comm.rank()], head, &create))
}

fn write_step(directory: &Path, step: u64) {
    for result in write_with(directory, &head(step), |path| File::create_new(path)) {
        result.unwrap();
    }
}

/// All that a rank with this block reads, and whether it is what was written.
fn read_as(checkpoint: &Checkpoint, block: Block) -> Result<()> {
    let step = checkpoint.head().step;
    let parts: Vec<_> = (0..checkpoint.ranks()).map(sections).collect();
    let expected = [0, 1].map(|i| parts.iter().map(|part| part[i].clone()).collect::<Vec<_>>());
    for ranks in 1..=5 {
        let own = on_threads(ranks, |comm| {
            let divided = expected.each_ref().map(|parts| SavedParts::divided(&comm, parts));
            checkpoint.states(&comm).map(|states| assert_eq!(states, divided))
        });
        own.into_iter().collect::<Result<()>>()?;
    }
    assert_eq!((checkpoint.head(), checkpoint.shared()), (&head(step), &parts[0][2][..]));
    let mut seen = BTreeSet::new();
    checkpoint.planes(block, |piece, bytes| {
        assert_eq!(piece.size()[2], 1);
        let mut cells = bytes.chunks_exact(BYTES);
        for y in piece.lo[1]..piece.hi[1] {
            for x in piece.lo[0]..piece.hi[0] {
                let at = [x, y, piece.lo[2]];
                assert_eq!(cells.next().unwrap(), cell(step, at));
                assert!(seen.insert(at), "{at:?} came twice");
            }
        }
        assert!(cells.next().is_none());
        Ok(())
    })?;
    assert_eq!(seen.len(), block.cell_count());
    Ok(())
}

fn read_all(directory: &Path) -> Result<()> {
    read_as(&Checkpoint::open(directory)?, WHOLE)
}

fn folder() -> (TempDir, PathBuf) {
    let root = tempfile::tempdir().unwrap();
    let directory = root.path().join(FOLDER);
    (root, directory)
}

/// Names in a folder, sorted.
fn names(directory: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(directory).unwrap();
    let mut names: Vec<_> = entries.map(|entry| folder::name_of(&entry.unwrap().path())).collect();
    names.sort();
    names
}

/// All files of a checkpoint.
fn files(checkpoint: &Path) -> Vec<PathBuf> {
    let of = |folder: &Path| names(folder).into_iter().map(|name| folder.join(name)).collect();
    let (folders, mut files): (Vec<PathBuf>, Vec<PathBuf>) =
        Vec::into_iter(of(checkpoint)).partition(|path| path.is_dir());
    files.extend(folders.iter().flat_map(|folder| Vec::into_iter(of(folder))));
    files
}

#[test]
fn what_four_uneven_ranks_wrote_is_read_by_1_2_3_and_5_bit_by_bit() {
    let (_root, directory) = folder();
    write_step(&directory, 100);
    for ranks in [1, 2, 3, 5] {
        on_threads(ranks, |comm| {
            let read = |checkpoint: &Checkpoint| read_as(checkpoint, slice(ranks, comm.rank()));
            let ((), skipped) = newest_sound(&directory, &comm, read).unwrap();
            assert!(skipped.is_empty());
        });
    }
    assert_eq!(
        names(&directory.join("step-0000000100")),
        [
            "case.toml",
            "files",
            "manifest.toml",
            "part-00000.bin",
            "part-00001.bin",
            "part-00002.bin",
            "part-00003.bin"
        ]
    );
}

#[test]
fn a_flip_of_any_byte_is_found_and_the_checkpoint_named() {
    let (_root, directory) = folder();
    write_step(&directory, 100);
    let checkpoint = directory.join("step-0000000100");
    let mut flips = 0;
    for path in files(&checkpoint) {
        let sound = std::fs::read(&path).unwrap();
        for at in 0..sound.len() {
            let mut bytes = sound.clone();
            bytes[at] ^= 1 << (at % 8);
            std::fs::write(&path, &bytes).unwrap();
            let place = format!("byte {at} of {}", path.display());
            let error = read_all(&checkpoint).expect_err(&place).to_string();
            assert!(error.starts_with("checkpoint step-0000000100: "), "{place}: {error}");
            flips += 1;
        }
        std::fs::write(&path, sound).unwrap();
    }
    read_all(&checkpoint).unwrap();
    assert!(flips > 3500, "only {flips} places");
}

#[test]
fn a_file_cut_short_too_long_or_missing_is_found() {
    let (_root, directory) = folder();
    write_step(&directory, 100);
    let checkpoint = directory.join("step-0000000100");
    for path in files(&checkpoint) {
        let sound = std::fs::read(&path).unwrap();
        let mut longer = sound.clone();
        longer.push(0);
        for bytes in [&sound[..0], &sound[..sound.len() / 2], &sound[..sound.len() - 1], &longer] {
            std::fs::write(&path, bytes).unwrap();
            let what = format!("{} with {} bytes", path.display(), bytes.len());
            read_all(&checkpoint).expect_err(&what);
        }
        std::fs::remove_file(&path).unwrap();
        let error = read_all(&checkpoint).unwrap_err().to_string();
        assert!(error.contains(&folder::name_of(&path)), "{error}");
        std::fs::write(&path, sound).unwrap();
    }
    read_all(&checkpoint).unwrap();
}

#[test]
fn a_damaged_plane_is_named_by_part_and_place() {
    let (_root, directory) = folder();
    write_step(&directory, 100);
    let checkpoint = directory.join("step-0000000100");
    let path = checkpoint.join("part-00002.bin");
    let mut bytes = std::fs::read(&path).unwrap();
    // The last but one of five planes, each with a checksum of eight bytes behind it.
    let record = 7 * BYTES + 8;
    let at = bytes.len() - 2 * record;
    bytes[at] ^= 1;
    std::fs::write(&path, bytes).unwrap();
    let error = read_all(&checkpoint).unwrap_err().to_string();
    assert_eq!(error, "checkpoint step-0000000100: part 2, plane z = 7 is damaged");
}

#[test]
fn a_plane_in_the_place_of_another_is_damage() {
    let (_root, directory) = folder();
    write_step(&directory, 100);
    let checkpoint = directory.join("step-0000000100");
    let path = checkpoint.join("part-00002.bin");
    let mut bytes = std::fs::read(&path).unwrap();
    let record = 7 * BYTES + 8;
    let planes = bytes.len() - 5 * record;
    bytes[planes..].rotate_left(record);
    std::fs::write(&path, bytes).unwrap();
    let error = read_all(&checkpoint).unwrap_err().to_string();
    assert!(error.contains("part 2, plane z = 4 is damaged"), "{error}");
}

#[test]
fn a_part_of_another_checkpoint_is_no_part_of_this_one() {
    let (_root, directory) = folder();
    write_step(&directory, 100);
    write_step(&directory, 200);
    let [old, new] = ["step-0000000100", "step-0000000200"].map(|name| directory.join(name));
    std::fs::copy(old.join("part-00001.bin"), new.join("part-00001.bin")).unwrap();
    let error = read_all(&new).unwrap_err().to_string();
    assert!(error.contains("part 1: its head is damaged"), "{error}");
}

#[test]
fn a_later_format_is_named_with_the_program_that_wrote_it() {
    let (_root, directory) = folder();
    write_step(&directory, 100);
    let path = directory.join("step-0000000100/manifest.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    let (above, _) = text.rsplit_once("# xxh3").unwrap();
    let above = above.replace("format = 10\n", "format = 11\nsomething = \"else\"\n");
    let seal = xxhash_rust::xxh3::xxh3_64(above.as_bytes());
    std::fs::write(&path, format!("{above}# xxh3 of all lines above: {seal:016x}\n")).unwrap();
    let error = read_all(&directory.join("step-0000000100")).unwrap_err().to_string();
    let version = env!("CARGO_PKG_VERSION");
    let said = format!("written by turbid {version} in format 11, and this program reads format 10");
    assert!(error.contains(&said), "{error}");
}

#[test]
fn a_manifest_that_names_other_files_is_refused_though_its_seal_is_right() {
    let (root, directory) = folder();
    std::fs::write(root.path().join("secret"), "secret").unwrap();
    write_step(&directory, 100);
    let path = directory.join("step-0000000100/manifest.toml");
    let good = Manifest::read(&std::fs::read(&path).unwrap()).unwrap();
    let refused = |spoil: &dyn Fn(&mut Manifest)| {
        let mut manifest = good.clone();
        spoil(&mut manifest);
        std::fs::write(&path, manifest.to_text()).unwrap();
        read_all(path.parent().unwrap()).unwrap_err().to_string()
    };
    for name in ["../../secret", "/etc/passwd", "part-00001.bin", "files/../case.toml"] {
        for spoil in [
            &|m: &mut Manifest| m.files[0].file = name.into(),
            &|m: &mut Manifest| m.files[1].file = name.into(),
            &|m: &mut Manifest| m.parts[0].file = name.into(),
        ] as [&dyn Fn(&mut Manifest); 3]
        {
            let said = refused(spoil);
            assert!(said.contains(&format!("names the file `{name}`")), "{said}");
        }
    }
}

#[test]
fn a_link_or_a_fifo_in_the_place_of_any_file_of_a_checkpoint_is_refused() {
    let (root, directory) = folder();
    write_step(&directory, 100);
    let checkpoint = directory.join("step-0000000100");
    let aside = root.path().join("aside");
    for path in files(&checkpoint).into_iter().chain([checkpoint.join("files")]) {
        std::fs::rename(&path, &aside).unwrap();
        std::os::unix::fs::symlink(&aside, &path).unwrap();
        let said = read_all(&checkpoint).unwrap_err().to_string();
        assert!(said.contains("symbolic link") || said.contains("no folder"), "{said}");
        std::fs::remove_file(&path).unwrap();
        std::fs::rename(&aside, &path).unwrap();
    }
    read_all(&checkpoint).unwrap();
    let part = checkpoint.join("part-00000.bin");
    std::fs::remove_file(&part).unwrap();
    let name = std::ffi::CString::new(part.to_str().unwrap()).unwrap();
    // SAFETY: a path that ends with a zero byte.
    assert_eq!(unsafe { libc::mkfifo(name.as_ptr(), 0o600) }, 0);
    let said = read_all(&checkpoint).unwrap_err().to_string();
    assert!(said.contains("part-00000.bin cannot be read: it is a FIFO"), "{said}");
}

#[test]
fn a_dry_run_has_sections_and_no_planes() {
    let (_root, directory) = folder();
    let head = Head { bytes_per_cell: 0, ..head(5) };
    on_threads(2, |comm| {
        let part = Part { block: slice(2, comm.rank()), engine: b"particles", coupling: b"", shared: b"" };
        let plane = |_, _: &mut Vec<u8>| panic!("there is none");
        write(&directory, &comm, None, &head, &part, plane).unwrap();
    });
    let checkpoint = Checkpoint::open(&directory.join("step-0000000005")).unwrap();
    let [engine, _] = checkpoint.states(&Comm::Solo).unwrap();
    assert_eq!(engine.own, [(0, b"particles".to_vec()), (1, b"particles".to_vec())]);
    checkpoint.planes(WHOLE, |_, _| panic!("there is none")).unwrap();
}

/// A file that takes no byte, as on a full disk.
#[cfg(target_os = "linux")]
fn full() -> io::Result<File> {
    OpenOptions::new().write(true).open("/dev/full")
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_leaves_the_previous_checkpoint_and_nothing_else_whichever_file_it_hits() {
    let (_root, directory) = folder();
    write_step(&directory, 50);
    for name in ["part-00000.bin", "part-00003.bin", "case.toml", "00001", "manifest.toml"] {
        let create = |path: &Path| {
            if path.ends_with(name) { full() } else { File::create_new(path) }
        };
        for result in write_with(&directory, &head(100), create) {
            let error = result.unwrap_err();
            let text = error.to_string();
            assert!(matches!(error, Error::Agreed { code: 2, .. }), "{text}");
            assert!(text.starts_with("the checkpoint of step 100 failed: cannot write "), "{text}");
            assert!(text.contains(name) && text.contains("No space left"), "{text}");
            assert!(text.ends_with("; the checkpoint of step 50 is intact"), "{text}");
        }
        assert_eq!(names(&directory), ["step-0000000050"], "{name}");
        read_all(&directory.join("step-0000000050")).unwrap();
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_step_that_cannot_be_written_again_keeps_its_first_checkpoint() {
    let (_root, directory) = folder();
    write_step(&directory, 100);
    for result in write_with(&directory, &head(100), |_| full()) {
        let text = result.unwrap_err().to_string();
        assert!(text.ends_with("the checkpoint of step 100 is intact"), "{text}");
    }
    assert_eq!(names(&directory), ["step-0000000100"]);
    read_all(&directory.join("step-0000000100")).unwrap();
}

#[test]
fn a_place_where_no_folder_can_be_is_an_error_on_every_rank() {
    let (_root, directory) = folder();
    std::fs::write(&directory, "a file").unwrap();
    for result in write_with(&directory, &head(100), |path| File::create_new(path)) {
        let text = result.unwrap_err().to_string();
        assert!(text.contains(&directory.display().to_string()), "{text}");
        assert!(text.ends_with("; there is no earlier one"), "{text}");
    }
    assert_eq!(std::fs::read(&directory).unwrap(), b"a file");
}

#[test]
fn two_are_kept_and_what_is_not_ours_stays() {
    let (_root, directory) = folder();
    let foreign = ["step-7", "step-0000000001.bak", "notes", "step-0000000100-best"];
    for name in foreign {
        std::fs::create_dir_all(directory.join(name)).unwrap();
    }
    // Of a run that was killed while it wrote.
    let stale = directory.join("step-0000000300.partial");
    std::fs::create_dir(&stale).unwrap();
    std::fs::write(stale.join("part-00000.bin"), "half").unwrap();
    for step in [100, 200, 300] {
        write_step(&directory, step);
    }
    let with = |ours: &[&'static str]| {
        let mut all = [&foreign[..], ours].concat();
        all.sort_unstable();
        all
    };
    assert_eq!(names(&directory), with(&["step-0000000200", "step-0000000300"]));
    let steps: Vec<u64> = list(&directory).unwrap().iter().map(|found| found.step).collect();
    assert_eq!(steps, [300, 200]);
    // A run that was resumed from an earlier step than the newest one.
    write_step(&directory, 250);
    assert_eq!(names(&directory), with(&["step-0000000200", "step-0000000250"]));
    clear(&directory).unwrap();
    assert_eq!(names(&directory), with(&[]));
}

#[test]
fn only_the_one_before_that_is_known_to_be_sound_is_kept() {
    let (_root, directory) = folder();
    for step in [40, 60] {
        write_step(&directory, step);
    }
    let head = Head { bytes_per_cell: 0, ..head(70) };
    let part = Part { block: WHOLE, engine: b"", coupling: b"", shared: b"" };
    // The run was resumed from step 40, since 60 is damaged.
    write(&directory, &Comm::Solo, Some(40), &head, &part, |_, _| ()).unwrap();
    assert_eq!(names(&directory), ["step-0000000040", "step-0000000070"]);
}

#[test]
fn the_same_step_is_written_again_in_place_of_the_old_one() {
    let (_root, directory) = folder();
    write_step(&directory, 50);
    write_step(&directory, 100);
    let mut other = head(100);
    other.case.text = "[run]\nend.steps = 9\n".to_string();
    for result in write_with(&directory, &other, |path| File::create_new(path)) {
        result.unwrap();
    }
    assert_eq!(names(&directory), ["step-0000000050", "step-0000000100"]);
    let checkpoint = Checkpoint::open(&directory.join("step-0000000100")).unwrap();
    assert_eq!(checkpoint.head(), &other);
}

#[test]
fn one_that_was_moved_aside_when_the_run_was_killed_is_found_and_later_removed() {
    let (_root, directory) = folder();
    write_step(&directory, 100);
    let [whole, aside] = ["step-0000000100", "step-0000000100.replaced"].map(|name| directory.join(name));
    std::fs::rename(&whole, &aside).unwrap();
    std::fs::create_dir(directory.join("step-0000000100.partial")).unwrap();
    let ((), skipped) = newest_sound(&directory, &Comm::Solo, |found| read_as(found, WHOLE)).unwrap();
    assert!(skipped.is_empty());
    write_step(&directory, 100);
    assert_eq!(names(&directory), ["step-0000000100"]);
    read_all(&whole).unwrap();
}

#[test]
fn a_damaged_checkpoint_is_skipped_by_all_of_three_ranks_though_one_alone_reads_the_plane() {
    let (_root, directory) = folder();
    write_step(&directory, 100);
    write_step(&directory, 200);
    let path = directory.join("step-0000000200/part-00001.bin");
    let mut bytes = std::fs::read(&path).unwrap();
    // In the last plane of the second of two blocks along x; only ranks from x = 3 read it.
    let last = bytes.len() - 9;
    bytes[last] ^= 0x80;
    std::fs::write(&path, bytes).unwrap();
    let steps = on_threads(3, |comm| {
        let read = |checkpoint: &Checkpoint| {
            read_as(checkpoint, slice(3, comm.rank())).map(|()| checkpoint.head().step)
        };
        let first = Checkpoint::open(&directory.join("step-0000000200")).unwrap();
        assert_eq!(read(&first).is_ok(), comm.rank() == 0);
        let (step, skipped) = newest_sound(&directory, &comm, read).unwrap();
        assert_eq!(skipped, ["checkpoint step-0000000200: part 1, plane z = 3 is damaged"]);
        step
    });
    assert_eq!(steps, [100; 3]);
}

#[test]
fn if_none_is_sound_each_is_named_with_its_reason() {
    let (_root, directory) = folder();
    write_step(&directory, 100);
    write_step(&directory, 200);
    std::fs::remove_file(directory.join("step-0000000200/manifest.toml")).unwrap();
    std::fs::write(directory.join("step-0000000100/case.toml"), "").unwrap();
    let errors = on_threads(2, |comm| {
        newest_sound(&directory, &comm, |checkpoint| read_as(checkpoint, WHOLE)).unwrap_err().to_string()
    });
    assert_eq!(errors[0], errors[1]);
    assert!(
        errors[0].contains("checkpoint step-0000000200: manifest.toml cannot be read")
            && errors[0].contains("checkpoint step-0000000100: case.toml is damaged"),
        "{}",
        errors[0]
    );
}

#[test]
fn where_there_is_none_the_message_says_what_to_name() {
    let (_root, directory) = folder();
    let error = newest_sound(&directory, &Comm::Solo, |_| Ok(())).unwrap_err();
    assert!(error.to_string().contains("output.checkpoint_every"), "{error}");
}
