//! Positions files: what `turbid pack` writes of a case or of a run, and what a case reads of it.

use crate::common::child::{Guard, poll};
use crate::common::{Place, has};
use turbid::case::Setup;
use turbid::output::OutputFiles;
use turbid::output::directory::PARTICLES;
use turbid::packing::positions::{self, Row};

/// Spheres of two sizes and cubes that fall in a box; `MEDIUM` is air or water, the rest says where they are.
const CASE: &str = r#"
[domain]
size = [6e-3, 6e-3, 8e-3]
periodic = [true, true, false]
MEDIUM
[[particles]]
shape = { sphere = { diameter = 1e-3 } }
density = 2500.0
sizes = [{ scale = 1, share = 1 }, { scale = 0.8, share = 1 }]
SPHERES
[[particles]]
shape = { polyhedron = { vertices = [[0, 0, 0], [1e-3, 0, 0], [0, 1.2e-3, 0], [0, 0, 1.4e-3]] } }
density = 2500.0
STONES
[contact]
youngs_modulus = 5e6
[run]
end = { steps = 400 }
[output]
picture_every = "never"
"#;
const DRY: &str = "[dry]\nimpact_speed = 0.3\nenlargement = 2.5e-5";
const WET: &str =
    "[fluid]\ndensity = 1000.0\nviscosity = 1e-5\n[lattice]\ncells_per_diameter = 8\nrelaxation_time = 0.55";

fn case(medium: &str, spheres: &str, stones: &str) -> String {
    (CASE.replace("MEDIUM", medium)).replace("SPHERES", spheres).replace("STONES", stones)
}

/// A folder with a case that reads `packed.csv` for all its particles.
fn reader(packed: &str) -> Place {
    let file = "file = \"packed.csv\"";
    let place = Place::empty();
    place.write("wet.toml", case(WET, file, file));
    place.write("packed.csv", packed);
    place
}

/// The particles in a file of points, ascending by id.
fn points(place: &Place, out: &str, step: u64) -> Vec<Row> {
    let file = OutputFiles::new(place.path(out)).file(PARTICLES, step);
    let mut rows = positions::of_a_run(&std::fs::read(file).unwrap(), out).unwrap();
    rows.sort_unstable_by_key(|row| row.id);
    rows
}

fn load(place: &Place) -> Setup {
    turbid::case::load(&place.path("wet.toml"), &[]).unwrap()
}

#[test]
fn a_dry_packing_of_a_mixture_becomes_a_wet_run_with_the_same_particles() {
    let place = reader("");
    place.write("dry.toml", case(DRY, "count = 24", "count = 12\nseed = 2"));
    place.well(&["run", "dry.toml", "--quiet"]);
    let said = place.well(&["pack", "--from", "out/dry", "--out", "packed.csv"]);
    assert!(said.contains("36 particles") && said.contains("step 400"), "{said}");
    let last = points(&place, "out/dry", 400);
    let wet = load(&place);
    assert_eq!(last.len(), 36);
    for (there, here) in last.iter().zip(&wet.particles) {
        assert_eq!((there.id, there.position), (here.id, here.position()));
        assert_eq!(there.velocity, here.velocity());
        assert_eq!(there.angular_velocity, here.angular_velocity());
        assert!(there.velocity.norm() > 0.0);
        let template = here.template as usize;
        assert_eq!(there.kind, wet.sections[template]);
        let given = here.orientation_given(&wet.frames[template]);
        assert!(given.angle_to(&there.orientation) < 1e-7, "{given} {}", there.orientation);
        let diameter = wet.templates[template].shape.equivalent_diameter();
        assert!((diameter / there.diameter - 1.0).abs() < 1e-12);
    }
    let kinds: std::collections::BTreeSet<u64> = wet.particles.iter().map(|p| p.template).collect();
    assert_eq!(kinds.len(), 3, "two sizes of spheres, and stones");
    // And the wet run begins with them.
    place.well(&["run", "wet.toml", "--quiet", "--set", "run.end.steps=1"]);
    let first = points(&place, "out/wet", 0);
    assert!(
        first
            .iter()
            .zip(&last)
            .all(|(a, b)| (a.id, a.position, a.velocity) == (b.id, b.position, b.velocity))
    );
    // An earlier step, and one that is not there.
    place.well(&["pack", "--from", "out/dry", "--step", "0", "--out", "first.csv"]);
    let text = place.text("first.csv");
    assert_eq!(text.lines().count(), 37);
    let arguments = ["pack", "--from", "out/dry", "--step", "3", "--out", "none.csv"];
    place.refused(&arguments, &["no particles of step 3", "from 0 to 400", "the nearest of them 0"]);
    place.refused(
        &["pack", "--from", "out", "--out", "none.csv"],
        &["holds no files of particles", "particles_every"],
    );
    assert!(!place.path("none.csv").exists());
}

#[test]
fn the_initial_positions_of_a_mixture_are_read_back_to_the_last_bit() {
    let place = reader("");
    place.write("random.toml", case(WET, "count = 20", "count = 9\nseed = 2"));
    place.well(&["pack", "random.toml", "--out", "packed.csv"]);
    let random = turbid::case::load(&place.path("random.toml"), &[]).unwrap();
    let read = load(&place);
    assert_eq!(random.particles.len(), 29);
    for (a, b) in random.particles.iter().zip(&read.particles) {
        assert_eq!((a.id, a.template, a.position), (b.id, b.template, b.position));
        assert!(a.orientation().angle_to(&b.orientation()) < 1e-7);
    }
}

const HEADER: &str = "x,y,z,kind,diameter";
/// Of the stone, a corner of a box.
const STONE: f64 = 8.1e-4;

#[test]
fn kinds_and_diameters_that_the_case_does_not_have_are_refused_with_line_column_and_remedy() {
    let stone = format!("{:?}", (6.0 / std::f64::consts::PI * 1e-3 * 1.2e-3 * 1.4e-3 / 6.0_f64).cbrt());
    assert!((stone.parse::<f64>().unwrap() - STONE).abs() < 1e-5);
    let first = "3e-3,3e-3,3e-3,0,1e-3";
    let second = format!("1e-3,1e-3,1e-3,1,{stone}");
    let place = reader(&format!("{HEADER}\n{first}\n{second}\n"));
    assert_eq!(load(&place).particles.len(), 2);
    let both = |line: &str| format!("{HEADER}\n{first}\n{second}\n{line}\n");
    for (text, words) in [
        (both("1e-3,2e-3,3e-3,2,1e-3"), ["packed.csv:4:16: `kind` is 2", "2 [[particles]] sections"]),
        (both("1e-3,2e-3,3e-3,0,9e-4"), ["packed.csv:4:18: `diameter` is 0.0009 m", "list it in `sizes`"]),
        (both("1e-3,2e-3,3e-3,x,1e-3"), ["packed.csv:4:16: `kind` is `x`", "whole number"]),
        (format!("{HEADER}\n{first}\n"), ["no particles of kind 1", "count = 0"]),
        (
            "x,y,z,diameter\n3e-3,3e-3,3e-3,1e-3\n".to_owned(),
            ["no column `kind`", "2 [[particles]] sections read it"],
        ),
        ("x,y,z,kind\n3e-3,3e-3,3e-3,0\n1,1,1,1\n".to_owned(), ["no column `diameter`", "has 2 sizes"]),
    ] {
        place.write("packed.csv", text);
        place.refused(&["check", "wet.toml"], &words);
    }
    // A kind whose section has other positions.
    let file = "file = \"packed.csv\"";
    place.write("packed.csv", both(""));
    place.write("wet.toml", case(WET, file, "count = 1"));
    place.refused(
        &["check", "wet.toml"],
        &["packed.csv:3:16: `kind` is 1", "`particles.1` does not read this file"],
    );
}

#[test]
fn the_picture_of_a_packing_is_the_view_of_its_run_at_the_start() {
    let place = Place::empty();
    let shown = "pictures = [{ name = \"all\", view = { size = [600, 450], colour = \"kind\" } }]";
    let every = "picture_every = { steps = 400 }";
    let text = case(DRY, "count = 24", "count = 12\nseed = 2");
    let text = text.replace("picture_every = \"never\"", &format!("{every}\n{shown}"));
    place.write("dry.toml", text.replace("steps = 400", "steps = 1"));
    place.well(&["pack", "dry.toml", "--out", "packed.csv", "--picture", "packed.png"]);
    place.well(&["run", "dry.toml", "--quiet"]);
    let picture = |name: &str| std::fs::read(place.path(name)).unwrap();
    assert!(picture("packed.png") == picture("out/dry/pictures/all_0000000000.png"));
    place.refused(&["pack", "dry.toml", "--out", "p.csv", "--picture", "p.jpg"], &["ends in .png"]);
    place.refused(&["pack", "dry.toml", "--out", "p.csv", "--picture", "dry.toml"], &[".png"]);
}

#[test]
fn a_dense_packing_that_was_killed_continues_to_the_same_positions() {
    let place = Place::empty();
    let text = "domain.size.diameters = [12, 12, 12]\n\
                particles = [{ shape.sphere.diameter = 1e-3, density = 2500, volume_fraction = 0.62 }]\n\
                contact = { youngs_modulus = 1e6 }\ndry.impact_speed = 0.1\nrun.end.steps = 1\n";
    place.write("dense.toml", text);
    let pack = |out| ["pack", "dense.toml", "--out", out];
    let child = Guard::of(place.turbid(&pack("packed.csv")));
    let part = place.path("packed.csv.part");
    poll("the state of the packing", || part.exists().then_some(()));
    child.send(libc::SIGKILL);
    drop(child);
    assert!(!place.path("packed.csv").exists(), "it was killed before its end");
    let kept = std::fs::read(&part).unwrap();
    let said = place.well(&pack("packed.csv"));
    has(&said, &["note: continues from round ", "in packed.csv.part"]);
    assert!(!part.exists());
    place.well(&pack("whole.csv"));
    assert_eq!(place.text("packed.csv"), place.text("whole.csv"));

    // A state of another packing is replaced, any other file is left alone.
    place.write("dense.toml", text.replace("12, 12, 12", "7, 7, 7"));
    place.write("packed.csv.part", kept);
    has(&place.well(&pack("packed.csv")), &["note: packed.csv.part was of another packing: began anew"]);
    assert!(!part.exists());
    place.write("packed.csv.part", "mine");
    has(
        &place.well(&pack("packed.csv")),
        &["packed.csv.part is no state of a packing, and was left as it is"],
    );
    assert_eq!(place.text("packed.csv.part"), "mine");
}

#[test]
fn the_points_of_a_run_are_a_positions_file() {
    let place = reader("");
    place.write("dry.toml", case(DRY, "count = 24", "count = 12\nseed = 2"));
    place.well(&["run", "dry.toml", "--quiet"]);
    place.well(&["pack", "--from", "out/dry", "--out", "packed.csv"]);
    let table = load(&place);
    let file = OutputFiles::new(place.path("out/dry")).file(PARTICLES, 400);
    place.write("wet.toml", place.text("wet.toml").replace("packed.csv", file.to_str().unwrap()));
    let points = load(&place);
    assert_eq!(points.particles.len(), 36);
    assert_eq!(points.particles, table.particles);
}

/// A case of spheres of a millimetre, of which `packed.csv` says the positions.
fn spheres(packed: &str) -> Place {
    let place = reader(packed);
    let text = case(WET, "file = \"packed.csv\"", "count = 0");
    let sizes = text.lines().filter(|line| !line.starts_with("sizes"));
    place.write("wet.toml", sizes.collect::<Vec<_>>().join("\n"));
    place
}

#[test]
fn without_sizes_every_particle_has_the_size_that_its_file_gives_it() {
    let place = spheres("x [mm] y [mm] z [mm] radius [um]\n1 1 1 400\n3 3 3 500\n5 5 5 450\n1 5 5 400\n");
    let said = place.well(&["check", "wet.toml"]);
    assert!(
        said.contains("packed.csv: the shape is scaled to 3 diameters from 8.0000e-4 to 1.0000e-3 m"),
        "{said}"
    );
    let setup = load(&place);
    let diameters: Vec<f64> = (setup.particles.iter())
        .map(|p| setup.templates[p.template as usize].shape.equivalent_diameter())
        .collect();
    for (has, wanted) in diameters.iter().zip([8e-4, 1e-3, 9e-4, 8e-4]) {
        assert!((has / wanted - 1.0).abs() < 1e-12, "{diameters:?}");
    }
    // Three of spheres, one of stones.
    assert_eq!((setup.templates.len(), setup.diameter), (4, 1e-3));
    place.well(&["run", "wet.toml", "--quiet", "--set", "run.end.steps=1"]);
}

#[test]
fn columns_of_a_file_are_mapped_by_the_case() {
    let place = spheres("\"Points:0\",\"Points:1\",\"Points:2\",size,speed\n1,2,3,0.5,7\n");
    let text = place.text("wet.toml");
    let with =
        |columns: &str| text.replacen("\"packed.csv\"", &format!("\"packed.csv\"\ncolumns = {columns}"), 1);
    place.write(
        "wet.toml",
        with("{ x = \"1e-3*Points:0\", y = \"Points:1 [mm]\", z = \"1e-3*Points:2 - 1e-3\", radius = \"1e-3*size\" }"),
    );
    let setup = load(&place);
    let off = setup.particles[0].position() - turbid::math::Vec3::new(1e-3, 2e-3, 2e-3);
    assert!(off.norm() < 1e-15, "{off}");
    for (columns, words) in [
        ("{ x = \"2*\" }", ["wet.toml:15:", "`particles.0.columns.x` is \"2*\", which names no column"]),
        ("{ colour = \"speed\" }", ["wet.toml:15:", "unknown key `colour` in `particles.0.columns`"]),
        ("{ x = \"a\" }", ["packed.csv:1: no column `a`", "the columns are points:0, points:1"]),
    ] {
        place.write("wet.toml", with(columns));
        place.refused(&["check", "wet.toml"], &words);
    }
}

#[test]
fn more_sizes_than_are_kept_and_sizes_in_another_unit_are_refused_with_a_remedy() {
    let line = |n: usize| format!("3e-3;3e-3;3e-3;{}\n", 1e-3 * (1.0 + 1e-4 * n as f64));
    let place = spheres(&format!("x;y;z;diameter\n{}", (0..10_001).map(line).collect::<String>()));
    place.refused(&["check", "wet.toml"], &["10001 sizes", "at most 10000", "fewer digits"]);
    place.write("packed.csv", "x;y;z;diameter\n3e-3;3e-3;3e-3;1\n");
    let words = ["packed.csv:2:16: `diameter` is 1 m, more than a factor of 100", "`diameter [mm]`"];
    place.refused(&["check", "wet.toml"], &words);
}

#[test]
fn contacts_may_overlap_in_the_state_of_a_run_and_nowhere_else() {
    // Spheres of a millimetre, and the floor.
    let pair =
        |z: f64, motion: &str| format!("3e-3,3e-3,3e-3,0,1e-3{motion}\n3e-3,3e-3,{z},0,1e-3{motion}\n");
    let moving = format!("{HEADER},vz");
    let only = |header: &str, rows: &str| {
        let place = reader(&format!("{header}\n{rows}"));
        place.write("wet.toml", case(WET, "file = \"packed.csv\"", "count = 0"));
        place
    };
    let accepted = only(&moving, &pair(3.97e-3, ",0.01"));
    let velocity = load(&accepted).particles[1].velocity();
    assert_eq!(velocity.map(f64::to_bits), turbid::math::Vec3::new(0.0, 0.0, 0.01).map(f64::to_bits));
    let spinning = load(&only(&format!("{HEADER},wx"), "3e-3,3e-3,3e-3,0,1e-3,5\n"));
    let inertia = 0.4 * spinning.templates[0].mass() * 0.25e-6;
    assert!((spinning.particles[0].angular_momentum[0] / (5.0 * inertia) - 1.0).abs() < 1e-12);
    load(&only(&moving, "3e-3,3e-3,4.8e-4,0,1e-3,0\n"));
    for (header, rows, words) in [
        (HEADER, pair(3.97e-3, ""), "of particles overlap"),
        (&moving, pair(3.9e-3, ",0.01"), "of particles overlap"),
        (HEADER, "3e-3,3e-3,4.8e-4,0,1e-3\n".to_owned(), "a wall at the start"),
        (&moving, "3e-3,3e-3,4.4e-4,0,1e-3,0\n".to_owned(), "a wall at the start"),
    ] {
        only(header, &rows).refused(&["check", "wet.toml"], &[words]);
    }
}

#[test]
fn a_packing_of_a_run_says_that_its_fluid_starts_at_rest_and_whether_the_run_was_complete() {
    let place = Place::empty();
    place.write("wet.toml", case(WET, "count = 4", "count = 1"));
    place.write("dry.toml", case(DRY, "count = 4", "count = 1"));
    for name in ["wet", "dry"] {
        place.well(&["run", &format!("{name}.toml"), "--quiet", "--set", "run.end.steps=2"]);
    }
    let said = |name: &str| place.well(&["pack", "--from", &format!("out/{name}"), "--out", "packed.csv"]);
    let (rest, early) = (
        "the fluid starts at rest; turbid resume out/wet --out NEW continues",
        "was interrupted after 2 steps",
    );
    let wet = said("wet");
    assert!(wet.contains(rest) && !wet.contains("interrupted"), "{wet}");
    assert!(!said("dry").contains("note:"));
    let stopped =
        place.text("out/wet/summary.json").replace("\"interrupted\": false", "\"interrupted\": true");
    place.write("out/wet/summary.json", stopped);
    let wet = said("wet");
    assert!(wet.contains(rest) && wet.contains(early), "{wet}");
    std::fs::remove_file(place.path("out/wet/summary.json")).unwrap();
    assert!(said("wet").contains("has left no summary"));
}

#[test]
fn particles_are_not_read_through_a_link_and_no_word_of_another_file_is_told() {
    let place = Place::empty();
    std::fs::create_dir_all(place.path("out/particles")).unwrap();
    place.write("secret", "a secret\nand more");
    let file = place.path("out/particles/particles_0000000004.vtp");
    let arguments = ["pack", "--from", "out", "--out", "packed.csv"];
    std::os::unix::fs::symlink(place.path("secret"), &file).unwrap();
    place.refused(&arguments, &["particles_0000000004.vtp: it is a symbolic link"]);
    std::fs::remove_file(&file).unwrap();
    std::fs::copy(place.path("secret"), &file).unwrap();
    let said = place.ends(2, &arguments);
    assert!(said.contains("no file of VTK") && !said.contains("secret"), "{said}");
}

#[test]
fn a_file_of_points_that_is_cut_off_anywhere_is_refused_by_name() {
    let place = Place::empty();
    place.write("dry.toml", case(DRY, "count = 4", "count = 1"));
    place.well(&["run", "dry.toml", "--quiet", "--set", "run.end.steps=2"]);
    let file = OutputFiles::new(place.path("out/dry")).file(PARTICLES, 2);
    let whole = std::fs::read(&file).unwrap();
    let end = whole.windows(5).rposition(|window| window == b"</Pie").unwrap();
    for length in (0..end).step_by(97) {
        let found = positions::of_a_run(&whole[..length], "cut.vtp");
        assert!(
            found.as_ref().map_or_else(|what| what.contains("cut.vtp"), Vec::is_empty),
            "{length}: {found:?}"
        );
    }
    std::fs::write(&file, &whole[..whole.len() / 2]).unwrap();
    place.refused(
        &["pack", "--from", "out/dry", "--out", "packed.csv"],
        &["particles_0000000002.vtp", "that this version of turbid has written"],
    );
}
