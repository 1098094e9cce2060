//! The files for `ParaView` have the same content from one thread, several, or the processes of an MPI job, each of which writes
//! its own piece.

use crate::common::case::viscous;
use crate::common::{Place, files_below};
use std::path::{Path, PathBuf};

const STEPS: [u64; 3] = [0, 20, 40];

const OUTPUT: &str = "series_every = { steps = 20 }
checkpoint_at_end = false
fields_every = { steps = 20 }
particles_every = { steps = 20 }
contacts_every = { steps = 20 }
picture_every = { steps = 40 }
pictures = [
    { slice = { normal = \"z\", quantity = \"vorticity\" } },
    { slice = { quantity = \"pressure\" } },
    { view = { force_chains = true, size = [500, 400] } },
]";

fn case(domain: &str, particles: &str) -> String {
    viscous(domain, &format!("{particles}\n[driving]\ngravity = [0.0, -60.0, -60.0]"), 40, OUTPUT)
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

/// Output of a run on `threads` threads.
fn on_threads(place: &Place, threads: &str, out: &str) -> PathBuf {
    let run = ["run", "case.toml", "--quiet", "--overwrite", "--threads", threads, "--out", out];
    place.well(&run);
    place.path(out)
}

#[test]
fn three_threads_leave_the_very_files_of_one() {
    let place = Place::new(&crowd());
    let one = files_below(&on_threads(&place, "1", "one"));
    let three = files_below(&on_threads(&place, "3", "three"));
    assert!(one.keys().eq(three.keys()), "{one:?} {three:?}");
    // Fields, particles, surfaces, contacts, force chains; pictures; and what there is once.
    assert_eq!(one.len(), 5 * STEPS.len() + 3 + 12, "{one:?}");
    for (name, path) in one.iter().filter(|(name, _)| *name != Path::new("summary.json")) {
        assert!(std::fs::read(path).unwrap() == std::fs::read(&three[name]).unwrap(), "{}", name.display());
    }
}

#[cfg(feature = "mpi")]
mod processes {
    use super::*;
    use crate::common::vtk::{Image, attribute};
    use crate::common::{vtk, words};
    use std::collections::BTreeMap;
    use std::fmt::Write;
    use std::process::Output;
    use turbid::output::directory::{CONTACTS, FIELDS, FORCE_CHAINS, PARTICLES, SURFACES};
    use turbid::output::{OutputFiles, pieces};
    use vtkio::model::{Attribute, PolyDataPiece, VertexNumbers};

    /// The case on several processes.
    fn run(place: &Place, processes: usize, more: &[&str]) -> Output {
        let run = ["run", "case.toml", "--overwrite", "--quiet"];
        mpirun(place, processes, &[&run, more].concat())
    }

    /// Messages of several processes; a job that hangs is ended, and fails.
    fn mpirun(place: &Place, processes: usize, arguments: &[&str]) -> Output {
        place.limited_job(processes, arguments).output().unwrap()
    }

    /// The values of the cells of an image of 32-bit numbers, by array and cell.
    type Cells = BTreeMap<(String, [usize; 3]), Vec<u32>>;

    fn image(path: &Path, cells: &mut Cells) {
        let image = Image::read(path);
        let header = image.header();
        let piece = header.lines().find(|line| line.starts_with("<Piece ")).unwrap();
        let extent: Vec<usize> =
            (attribute(piece, "Extent").split(' ')).map(|n| n.parse().unwrap()).collect();
        for line in header.lines().filter(|line| line.contains("format=\"appended\"")) {
            let components: usize = attribute(line, "NumberOfComponents").parse().unwrap();
            let values: Vec<u32> = image.array(line);
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
            let extent = format!("<Piece Extent=\"{}\">", attribute(line, "Extent"));
            assert!(Image::read(&piece).header().contains(&extent), "{line}");
            assert!(cells.len() > before);
        }
        cells
    }

    /// Contents of a file of polygons or of the pieces of its index, as far as it does not depend on the order: for every cell its
    /// points, with all that is known of each.
    fn polygons(path: &Path) -> (usize, Vec<String>) {
        let pieces = vtk::polygons(path);
        let mut all: Vec<String> = pieces.iter().flat_map(cells_of).collect();
        all.sort();
        (pieces.len(), all)
    }

    fn cells_of(piece: &PolyDataPiece) -> Vec<String> {
        let mut points: Vec<String> =
            (piece.points.cast_into::<f64>().unwrap().chunks(3)).map(|point| format!("{point:?}")).collect();
        for attribute in &piece.data.point {
            let Attribute::DataArray(array) = attribute else { panic!("no array") };
            let values = array.data.cast_into::<f64>().unwrap();
            assert_eq!(values.len(), points.len() * array.num_comp(), "{}", array.name);
            for (point, values) in points.iter_mut().zip(values.chunks(array.num_comp())) {
                write!(point, " {} {values:?}", array.name).unwrap();
            }
        }
        let mut cells = Vec::new();
        for (kind, topology) in [&piece.verts, &piece.lines, &piece.polys].into_iter().enumerate() {
            let Some(VertexNumbers::XML { connectivity, offsets }) = topology.clone() else {
                continue;
            };
            let mut first = 0;
            for end in offsets {
                let names = connectivity[first..end as usize].iter().map(|&p| points[p as usize].as_str());
                cells.push(format!("{kind}: {}", names.collect::<Vec<_>>().join("; ")));
                first = end as usize;
            }
        }
        cells
    }

    /// Compares the output of several processes with that of one thread; cells of the files of surfaces and contacts at the end.
    fn compare(place: &Place, processes: usize, expected: &Path) -> [usize; 2] {
        let output = run(place, processes, &[]);
        assert!(output.status.success(), "{}", words(&output));
        let found = place.path("out");
        let (one, many) = (OutputFiles::new(expected), OutputFiles::new(&found));
        let mut sizes = [0; 2];
        for step in STEPS {
            let index = pieces::index(&many.file(FIELDS, step));
            let expected = cells(&one.file(FIELDS, step));
            assert!(expected.len() > 1000 && cells(&index) == expected, "fields at {step}");
            assert!(!many.file(FIELDS, step).exists());
            let numbered = [SURFACES, CONTACTS, PARTICLES, FORCE_CHAINS];
            for (kind, of) in numbered.into_iter().enumerate() {
                let (file, index) = (one.file(of, step), pieces::index(&many.file(of, step)));
                let (count, all) = polygons(&index);
                assert_eq!(count, processes, "{}", index.display());
                assert!(all == polygons(&file).1, "{}", index.display());
                if let Some(size) = sizes.get_mut(kind) {
                    *size = all.len();
                }
            }
        }
        let names = files_below(&found);
        for (name, path) in files_below(expected) {
            let extension = name.extension().unwrap();
            if extension == "csv" || extension == "png" {
                let same = std::fs::read(path).unwrap() == std::fs::read(&names[&name]).unwrap();
                assert!(same, "{}", name.display());
            } else if extension == "pvd" {
                // The same times, and each file is there.
                let text = std::fs::read_to_string(path).unwrap();
                let (vti, vtp) = (".vti\"", ".vtp\"");
                let listed = text.replace(vti, ".pvti\"").replace(vtp, ".pvtp\"");
                assert_eq!(std::fs::read_to_string(&names[&name]).unwrap(), listed);
            }
        }
        let pieces = (names.keys()).filter(|name| name.to_string_lossy().contains("_p0000")).count();
        assert_eq!(pieces, 5 * STEPS.len() * processes);
        sizes
    }

    #[test]
    fn the_pieces_of_two_and_three_processes_are_the_files_of_one_thread() {
        let place = Place::new(&crowd());
        let expected = on_threads(&place, "1", "one");
        for processes in [2, 3] {
            let [polygons, contacts] = compare(&place, processes, &expected);
            assert!(polygons > 60 && contacts > 3, "{polygons} {contacts}");
        }
        // Threads after processes: nothing of the pieces is left.
        let again = on_threads(&place, "2", "out");
        assert!(files_below(&again).keys().eq(files_below(&expected).keys()));
        assert!(!place.path("out/fields/fields_0000000000").exists());
    }

    #[test]
    fn three_processes_of_which_some_have_no_particles_write_pieces_that_can_be_read() {
        let place = Place::new(&sparse());
        let expected = on_threads(&place, "1", "one");
        let [polygons, contacts] = compare(&place, 3, &expected);
        assert!(polygons == 2 * 320 && contacts == 0);
    }

    #[test]
    fn a_piece_that_cannot_be_written_ends_all_processes_and_there_is_no_index() {
        let place = Place::new(&sparse());
        let piece = "out/particles/particles_0000000020/particles_0000000020_p00001.vtp";
        // A folder in its place.
        std::fs::create_dir_all(place.path(piece)).unwrap();
        let output = run(&place, 3, &[]);
        let said = words(&output);
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert_eq!(said.matches("error:").count(), 1, "{said}");
        assert!(said.contains("cannot write") && said.contains(piece), "{said}");
        let found = files_below(&place.path("out"));
        assert!(found.contains_key(Path::new("particles/particles_0000000000.pvtp")));
        assert!(!found.contains_key(Path::new("particles/particles_0000000020.pvtp")));
        assert!((found.keys()).all(|name| !name.to_string_lossy().contains(".tmp")), "{found:?}");
        let listed = std::fs::read_to_string(&found[Path::new("particles.pvd")]).unwrap();
        assert_eq!(listed.matches("<DataSet").count(), 1, "{listed}");
    }

    #[test]
    fn a_run_of_three_processes_that_two_take_up_leaves_no_piece_of_the_third_after_that() {
        let place = Place::new(&crowd());
        let expected = OutputFiles::new(on_threads(&place, "1", "one"));
        let checkpoints = "output.checkpoint_every.steps=30";
        let output = run(&place, 3, &["--set", checkpoints, "--set", "output.checkpoint_at_end=true"]);
        assert!(output.status.success(), "{}", words(&output));
        let found = place.path("out");
        // As if it had been killed after its last files.
        std::fs::remove_dir_all(found.join("checkpoints/step-0000000040")).unwrap();
        std::fs::remove_file(found.join("summary.json")).unwrap();
        let output = mpirun(&place, 2, &["resume", "out", "--quiet"]);
        assert!(output.status.success(), "{}", words(&output));
        let many = OutputFiles::new(&found);
        for (step, processes) in [(0, 3), (20, 3), (40, 2)] {
            let (count, all) = polygons(&pieces::index(&many.file(PARTICLES, step)));
            assert_eq!(count, processes, "particles at {step}");
            assert!(all == polygons(&expected.file(PARTICLES, step)).1, "particles at {step}");
            let fields = pieces::index(&many.file(FIELDS, step));
            assert!(cells(&fields) == cells(&expected.file(FIELDS, step)), "fields at {step}");
            let third = pieces::piece(&many.file(FIELDS, step), 2).exists();
            assert_eq!(third, processes == 3, "{step}");
        }
        let listed = std::fs::read_to_string(many.collection(FIELDS)).unwrap();
        assert_eq!(listed.matches(".pvti\"").count(), 3, "{listed}");
    }

    #[cfg(feature = "liggghts")]
    #[test]
    fn chains_lead_to_the_centres_of_all_particles_although_one_process_has_all_contacts() {
        let spheres = "[[particles]]\nshape = { sphere = { diameter = 5e-4 } }\ndensity = 2600.0\ncount = 60\nseed = 1\n\
                       [dem]\nengine = \"liggghts\"";
        let place = Place::new(&case("size = [2.4e-3, 2.5e-3, 2.7e-3]", spheres));
        let expected = on_threads(&place, "1", "one");
        let [_, contacts] = compare(&place, 3, &expected);
        assert!(contacts > 3, "{contacts}");
    }
}
