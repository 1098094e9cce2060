//! What the files for `ParaView` hold does not depend on who writes them: one thread, several, or the processes of an MPI job,
//! each its own piece.

#[cfg(feature = "mpi")]
#[path = "common/job.rs"]
mod job;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const STEPS: [u64; 3] = [0, 20, 40];

fn case(domain: &str, particles: &str) -> String {
    format!(
        r#"
[domain]
{domain}
[fluid]
density = 1000.0
viscosity = 2e-6
[lattice]
cells_per_diameter = 5
relaxation_time = 0.55
{particles}
[driving]
gravity = [0.0, -60.0, -60.0]
[run]
end = {{ steps = 40 }}
[output]
directory = "out"
series_every = {{ steps = 20 }}
fields_every = {{ steps = 20 }}
particles_every = {{ steps = 20 }}
contacts_every = {{ steps = 20 }}
picture_every = {{ steps = 40 }}
"#
    )
}

/// Spheres and cubes that touch each other and walls, across the borders of blocks and of the box.
fn crowd() -> String {
    case(
        "size = [2.4e-3, 2.5e-3, 2.7e-3]\nperiodic = [true, false, false]",
        "[[particles]]\nshape = { sphere = { diameter = 5e-4 } }\ndensity = 2600.0\ncount = 40\nseed = 1\n\
         [[particles]]\nshape = { cube = { edge = 4e-4 } }\ndensity = 2600.0\ncount = 20\nseed = 2",
    )
}

/// Two spheres at the lower end of a tall box: most blocks have none.
#[cfg(feature = "mpi")]
fn sparse() -> String {
    case(
        "size = [1.2e-3, 1.2e-3, 4e-3]",
        "[[particles]]\nshape = { sphere = { diameter = 5e-4 } }\ndensity = 2600.0\n\
         list = [[6e-4, 5e-4, 9e-4], [1e-4, 6e-4, 3.5e-3]]",
    )
}

/// A folder with the case.
fn folder(case: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("case.toml"), case).unwrap();
    folder
}

fn words(output: &Output) -> String {
    [&output.stdout, &output.stderr]
        .map(|bytes| String::from_utf8_lossy(bytes))
        .concat()
}

/// What so many threads write into `out` of the folder.
fn on_threads(folder: &Path, threads: &str, out: &str) -> PathBuf {
    let output = Command::new("timeout")
        .args(["--kill-after=5", "120", env!("CARGO_BIN_EXE_turbid")])
        .args([
            "run",
            "case.toml",
            "--quiet",
            "--overwrite",
            "--threads",
            threads,
            "--out",
            out,
        ])
        .current_dir(folder)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", words(&output));
    folder.join(out)
}

/// All files below a folder, by their paths in it.
fn files(root: &Path) -> BTreeMap<String, PathBuf> {
    let (mut open, mut found) = (vec![root.to_path_buf()], BTreeMap::new());
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                open.push(path);
            } else {
                let name = path.strip_prefix(root).unwrap().to_str().unwrap();
                found.insert(name.to_owned(), path);
            }
        }
    }
    found
}

#[test]
fn three_threads_leave_the_very_files_of_one() {
    let folder = folder(&crowd());
    let one = files(&on_threads(folder.path(), "1", "one"));
    let three = files(&on_threads(folder.path(), "3", "three"));
    assert!(one.keys().eq(three.keys()), "{one:?} {three:?}");
    // Fields, particles, surfaces, contacts, force chains; pictures; and what there is once.
    assert_eq!(one.len(), 5 * STEPS.len() + 1 + 10, "{one:?}");
    for (name, path) in one.iter().filter(|(name, _)| *name != "summary.json") {
        assert!(
            std::fs::read(path).unwrap() == std::fs::read(&three[name]).unwrap(),
            "{name}"
        );
    }
}

#[cfg(feature = "mpi")]
mod processes {
    use super::*;
    use std::fmt::Write;
    use turbid::output::OutputFiles;
    use turbid::output::pieces;
    use vtkio::Vtk;
    use vtkio::model::{Attribute, DataSet, Piece, PolyDataPiece, VertexNumbers};

    /// The case on so many processes.
    fn run(folder: &Path, processes: usize, more: &[&str]) -> Output {
        mpirun(
            folder,
            processes,
            &[&["run", "case.toml", "--overwrite", "--quiet"], more].concat(),
        )
    }

    /// What so many processes say; a job that hangs is ended, and fails.
    fn mpirun(folder: &Path, processes: usize, arguments: &[&str]) -> Output {
        job::limited(folder, 120, processes, arguments).output().unwrap()
    }

    /// An attribute of a line of XML.
    fn attribute<'a>(line: &'a str, name: &str) -> &'a str {
        let (_, rest) = line.split_once(&format!("{name}=\"")).unwrap();
        rest.split_once('"').unwrap().0
    }

    /// The values of the cells of an image of 32-bit numbers, by array and cell, by the description of the format.
    type Cells = BTreeMap<(String, [usize; 3]), Vec<u32>>;

    fn image(path: &Path, cells: &mut Cells) {
        let file = std::fs::read(path).unwrap();
        let marker = b"<AppendedData encoding=\"raw\">\n_";
        let data = file.windows(marker.len()).position(|w| w == marker).unwrap();
        let header = std::str::from_utf8(&file[..data]).unwrap();
        let piece = header.lines().find(|line| line.starts_with("<Piece ")).unwrap();
        let extent: Vec<usize> = (attribute(piece, "Extent").split(' '))
            .map(|n| n.parse().unwrap())
            .collect();
        for line in header.lines().filter(|line| line.contains("format=\"appended\"")) {
            let offset: usize = attribute(line, "offset").trim().parse().unwrap();
            let components: usize = attribute(line, "NumberOfComponents").parse().unwrap();
            let mut at = data + marker.len() + offset;
            let mut number = || {
                at += 8;
                u64::from_ne_bytes(file[at - 8..at].try_into().unwrap()) as usize
            };
            let (count, size, last) = (number(), number(), number());
            let lengths: Vec<usize> = (0..count).map(|_| number()).collect();
            let mut bytes = Vec::new();
            for (i, length) in lengths.into_iter().enumerate() {
                let full = if i + 1 == count && last != 0 { last } else { size };
                bytes.extend(lz4_flex::block::decompress(&file[at..at + length], full).unwrap());
                at += length;
            }
            let values: Vec<u32> = bytemuck::pod_collect_to_vec(&bytes);
            let mut values = values.chunks_exact(components);
            for z in extent[4]..extent[5] {
                for y in extent[2]..extent[3] {
                    for x in extent[0]..extent[1] {
                        let key = (attribute(line, "Name").to_owned(), [x, y, z]);
                        let before = cells.insert(key, values.next().unwrap().to_vec());
                        assert!(before.is_none(), "{x} {y} {z} is in two pieces");
                    }
                }
            }
            assert!(values.next().is_none());
        }
    }

    /// The cells of a file, or of the pieces that an index names.
    fn cells(path: &Path) -> Cells {
        let mut cells = Cells::new();
        if path.extension().unwrap() == "vti" {
            image(path, &mut cells);
            return cells;
        }
        let index = std::fs::read_to_string(path).unwrap();
        for line in index.lines().filter(|line| line.starts_with("<Piece ")) {
            let piece = path.parent().unwrap().join(attribute(line, "Source"));
            let before = cells.len();
            image(&piece, &mut cells);
            let text = std::fs::read(&piece).unwrap();
            let text = String::from_utf8_lossy(&text[..1000]);
            let extent = attribute(line, "Extent");
            assert!(text.contains(&format!("<Piece Extent=\"{extent}\">")), "{line}");
            assert!(cells.len() > before);
        }
        cells
    }

    /// What is in a file of polygons or in the pieces of its index, as far as it does not depend on the order: for every cell its
    /// points, with all that is known of each.
    fn polygons(path: &Path) -> (usize, Vec<String>) {
        let mut vtk = Vtk::import(path).unwrap();
        vtk.load_all_pieces().unwrap();
        let DataSet::PolyData { pieces, .. } = vtk.data else {
            panic!("no polygons")
        };
        let count = pieces.len();
        let mut all = Vec::new();
        for piece in pieces {
            let Piece::Inline(piece) = piece else {
                panic!("no inline piece")
            };
            all.extend(cells_of(&piece));
        }
        all.sort();
        (count, all)
    }

    fn cells_of(piece: &PolyDataPiece) -> Vec<String> {
        let mut points: Vec<String> = (piece.points.cast_into::<f64>().unwrap().chunks(3))
            .map(|point| format!("{point:?}"))
            .collect();
        for attribute in &piece.data.point {
            let Attribute::DataArray(array) = attribute else {
                panic!("no array")
            };
            let values = array.data.cast_into::<f64>().unwrap();
            assert_eq!(values.len(), points.len() * array.num_comp(), "{}", array.name);
            for (point, values) in points.iter_mut().zip(values.chunks(array.num_comp())) {
                write!(point, " {} {values:?}", array.name).unwrap();
            }
        }
        let mut cells = Vec::new();
        for (kind, topology) in [&piece.verts, &piece.lines, &piece.polys].into_iter().enumerate() {
            let Some(VertexNumbers::XML {
                connectivity,
                offsets,
            }) = topology.clone()
            else {
                continue;
            };
            let mut first = 0;
            for end in offsets {
                let names = connectivity[first..end as usize]
                    .iter()
                    .map(|&p| points[p as usize].as_str());
                cells.push(format!("{kind}: {}", names.collect::<Vec<_>>().join("; ")));
                first = end as usize;
            }
        }
        cells
    }

    /// Compares the output of so many processes with that of one thread; cells of the files of surfaces and contacts at the end.
    fn compare(folder: &Path, processes: usize, expected: &Path) -> [usize; 2] {
        let output = run(folder, processes, &[]);
        assert!(output.status.success(), "{}", words(&output));
        let found = folder.join("out");
        let (one, many) = (OutputFiles::new(expected), OutputFiles::new(&found));
        let mut sizes = [0; 2];
        for step in STEPS {
            let index = pieces::index(&many.fields(step));
            let expected = cells(&one.fields(step));
            assert!(
                expected.len() > 1000 && cells(&index) == expected,
                "fields at {step}"
            );
            assert!(!many.fields(step).exists());
            let numbered = [
                OutputFiles::surfaces,
                OutputFiles::contacts,
                OutputFiles::particles,
                OutputFiles::force_chains,
            ];
            for (kind, of) in numbered.into_iter().enumerate() {
                let (file, index) = (of(&one, step), pieces::index(&of(&many, step)));
                let (count, all) = polygons(&index);
                assert_eq!(count, processes, "{}", index.display());
                assert!(all == polygons(&file).1, "{}", index.display());
                if let Some(size) = sizes.get_mut(kind) {
                    *size = all.len();
                }
            }
        }
        let names = files(&found);
        for (name, path) in files(expected) {
            let extension = Path::new(&name).extension().unwrap();
            if extension == "csv" || extension == "png" {
                let same = std::fs::read(path).unwrap() == std::fs::read(&names[&name]).unwrap();
                assert!(same, "{name}");
            } else if extension == "pvd" {
                // The same times, and each file is there.
                let text = std::fs::read_to_string(path).unwrap();
                let (vti, vtp) = (".vti\"", ".vtp\"");
                let listed = text.replace(vti, ".pvti\"").replace(vtp, ".pvtp\"");
                assert_eq!(std::fs::read_to_string(&names[&name]).unwrap(), listed);
            }
        }
        let pieces = names.keys().filter(|name| name.contains("_p0000")).count();
        assert_eq!(pieces, 5 * STEPS.len() * processes);
        sizes
    }

    #[test]
    fn the_pieces_of_two_and_three_processes_are_the_files_of_one_thread() {
        let folder = folder(&crowd());
        let expected = on_threads(folder.path(), "1", "one");
        for processes in [2, 3] {
            let [polygons, contacts] = compare(folder.path(), processes, &expected);
            assert!(polygons > 60 && contacts > 3, "{polygons} {contacts}");
        }
        // Threads after processes: nothing of the pieces is left.
        let again = on_threads(folder.path(), "2", "out");
        assert!(files(&again).keys().eq(files(&expected).keys()));
        assert!(!folder.path().join("out/fields/fields_0000000000").exists());
    }

    #[test]
    fn three_processes_of_which_some_have_no_particles_write_pieces_that_can_be_read() {
        let folder = folder(&sparse());
        let expected = on_threads(folder.path(), "1", "one");
        let [polygons, contacts] = compare(folder.path(), 3, &expected);
        assert!(polygons == 2 * 320 && contacts == 0);
    }

    #[test]
    fn a_piece_that_cannot_be_written_ends_all_processes_and_there_is_no_index() {
        let folder = folder(&sparse());
        let piece = "out/particles/particles_0000000020/particles_0000000020_p00001.vtp";
        // A folder in its place.
        std::fs::create_dir_all(folder.path().join(piece)).unwrap();
        let output = run(folder.path(), 3, &[]);
        let said = words(&output);
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert_eq!(said.matches("error:").count(), 1, "{said}");
        assert!(said.contains("cannot write") && said.contains(piece), "{said}");
        let found = files(&folder.path().join("out"));
        assert!(found.contains_key("particles/particles_0000000000.pvtp"));
        assert!(!found.contains_key("particles/particles_0000000020.pvtp"));
        assert!(found.keys().all(|name| !name.contains(".tmp")), "{found:?}");
        let listed = std::fs::read_to_string(&found["particles.pvd"]).unwrap();
        assert_eq!(listed.matches("<DataSet").count(), 1, "{listed}");
    }

    #[test]
    fn a_run_of_three_processes_that_two_take_up_leaves_no_piece_of_the_third_after_that() {
        let folder = folder(&crowd());
        let expected = OutputFiles::new(on_threads(folder.path(), "1", "one"));
        let output = run(folder.path(), 3, &["--set", "output.checkpoint_every.steps=30"]);
        assert!(output.status.success(), "{}", words(&output));
        let found = folder.path().join("out");
        // As if it had been killed after its last files.
        std::fs::remove_dir_all(found.join("checkpoints/step-0000000040")).unwrap();
        let output = mpirun(folder.path(), 2, &["resume", "out", "--quiet"]);
        assert!(output.status.success(), "{}", words(&output));
        let many = OutputFiles::new(&found);
        for (step, processes) in [(0, 3), (20, 3), (40, 2)] {
            let (count, all) = polygons(&pieces::index(&many.particles(step)));
            assert_eq!(count, processes, "particles at {step}");
            assert!(
                all == polygons(&expected.particles(step)).1,
                "particles at {step}"
            );
            let fields = pieces::index(&many.fields(step));
            assert!(
                cells(&fields) == cells(&expected.fields(step)),
                "fields at {step}"
            );
            let third = pieces::piece(&many.fields(step), 2).exists();
            assert_eq!(third, processes == 3, "{step}");
        }
        let listed = std::fs::read_to_string(many.fields_collection()).unwrap();
        assert_eq!(listed.matches(".pvti\"").count(), 3, "{listed}");
    }

    #[cfg(feature = "liggghts")]
    #[test]
    fn chains_lead_to_the_centres_of_all_particles_although_one_process_has_all_contacts() {
        let spheres = "[[particles]]\nshape = { sphere = { diameter = 5e-4 } }\ndensity = 2600.0\ncount = 60\nseed = 1\n\
                       [dem]\nengine = \"liggghts\"";
        let folder = folder(&case("size = [2.4e-3, 2.5e-3, 2.7e-3]", spheres));
        let expected = on_threads(folder.path(), "1", "one");
        let [_, contacts] = compare(folder.path(), 3, &expected);
        assert!(contacts > 3, "{contacts}");
    }
}
