//! The same bits on any number of ranks, threads of one process or processes of an MPI job: scenes of spheres, cubes, walls,
//! sub-steps, and particles that cross every kind of border of blocks and box, 300 steps each, in all precisions.

use crate::common::case::viscous;
use crate::common::{Place, column_of};
use std::fmt::Write;

const RANKS: [usize; 6] = [2, 3, 4, 5, 6, 8];

const OUTPUT: &str = "series_every = { steps = 20 }
fields_every = \"never\"
particles_every = \"never\"
contacts_every = \"never\"
picture_every = \"never\"";

/// A case of 300 steps.
fn case(domain: &str, particles: &str, more: &str) -> String {
    viscous(domain, &format!("{particles}\n{more}"), 300, OUTPUT)
}

/// 200 spheres that touch and settle at an angle to the box.
fn spheres() -> String {
    case(
        "size = [3e-3, 3.5e-3, 4e-3]",
        "[[particles]]\nshape = { sphere = { diameter = 5e-4 } }\ndensity = 3300.0\ncount = 200\nseed = 7",
        "[driving]\ngravity = [2.0, -3.0, -9.0]",
    )
}

/// 100 cubes, with sub-steps.
fn cubes() -> String {
    case(
        "size = [3e-3, 3e-3, 3.1e-3]",
        "[[particles]]\nshape = { cube = { edge = 4e-4 } }\ndensity = 3300.0\ncount = 100\nseed = 3",
        "[contact]\nsubsteps = 3\n[driving]\ngravity = [40.0, 10.0, -60.0]",
    )
}

/// Spheres and cubes that are thrown at walls, of which one moves; sub-steps.
fn walls() -> String {
    let mut particles = String::new();
    for (n, shape) in ["sphere = { diameter = 5e-4 }", "cube = { edge = 4e-4 }"].iter().enumerate() {
        write!(particles, "[[particles]]\nshape = {{ {shape} }}\ndensity = 2600.0\ncount = 30\nseed = {n}\n")
            .unwrap();
    }
    case(
        "size = [2.4e-3, 2.5e-3, 2.7e-3]\nperiodic = [true, false, false]\nfaces = { \"y+\" = { velocity = [0.02, 0, 0] } }",
        &particles,
        "[contact]\nsubsteps = 2\n[driving]\ngravity = [0.0, -60.0, -60.0]",
    )
}

/// A sphere flies through each of 4 x 4 x 4 points where the borders of 2 x 2 x 2 blocks and of the box cross, across
/// as many borders at once as meet there.
fn crossing() -> String {
    let mut positions = String::new();
    for n in 0..64_usize {
        let node = [n % 4, n / 4 % 4, n / 16];
        let sign = |a: usize| if (n * 7 + 3 * a) % 4 < 2 { 1.0 } else { -1.0 };
        let onward = |a: usize| if node[a] % 2 == 0 { sign(a) } else { 0.0 };
        let at: [f64; 3] =
            std::array::from_fn(|a| (1e-3 * node[a] as f64 - 0.6e-4 * onward(a)).rem_euclid(4e-3));
        let velocity: [f64; 3] = std::array::from_fn(|a| 0.04 * onward(a));
        writeln!(positions, "{{ position = {at:?}, velocity = {velocity:?} }},").unwrap();
    }
    let particles = format!(
        "[[particles]]\nshape = {{ sphere = {{ diameter = 5e-4 }} }}\ndensity = 9000.0\nlist = [\n{positions}]"
    );
    case("size = [4e-3, 4e-3, 4e-3]", &particles, "[driving]\ngravity = 0.0")
}

/// Spheres and cubes that come into two jets from an inlet to an outlet, parts of their faces, and go at the outlet, whose pressure varies; more
/// fluid comes in through the top, the faster the further it is along x.
fn open() -> String {
    let faces = "x- = { inlet = { velocity = [0.05, 0, 0], profile = \"parabolic\", patch = [{ disc = { centre = [0, 1.2e-3, 1.2e-3], diameter = 1.8e-3 } }, \
                 { rectangle = { lower = [0, 0, 2.1e-3], upper = [0, 1e-3, 2.3e-3] } }] } }, \
                 \"x+\" = { outlet = { pressure = { table = [[0, 0], [0.01, 2], [0.02, -1]] }, absorbs_sound = true, \
                 patch = { rectangle = { lower = [0, 2e-4, 4e-4], upper = [0, 2.2e-3, 2e-3] } } } }, z- = { free_slip = true }, \
                 \"z+\" = { inlet = { velocity = [0, 0, -0.02], profile = { table = [[0, 0, 0], [4e-3, 0, 1]] } } }";
    let insertion = |kind: usize, rate: f64| {
        format!(
            "[[insertion]]\nkind = {kind}\nregion = {{ lower = [1e-3, 4e-4, 4e-4], upper = [3.4e-3, 2e-3, 2e-3] }}\n\
             particle_rate = {rate}\nvelocity = [0.06, 0, 0]\nvelocity_spread = [0.01, 0.01, 0.01]\n"
        )
    };
    let kind = |shape: &str| {
        format!("[[particles]]\nshape = {{ {shape} }}\ndensity = 2600.0\ncount = 3\nseed = 2\n")
    };
    let particles = kind("sphere = { diameter = 5e-4 }") + &kind("cube = { edge = 4e-4 }");
    let more = insertion(0, 1500.0) + &insertion(1, 700.0) + "[[removal]]\noutlet = \"x+\"\n";
    let domain = "size = [4e-3, 2.4e-3, 2.4e-3]\nperiodic = [false, true, false]\nfaces = { ";
    case(&format!("{domain}{faces} }}"), &particles, &more)
}

/// Spheres that come into a suspension with lubrication at its top and go at its bottom.
fn coming() -> String {
    case(
        "size = [2e-3, 2e-3, 4e-3]\nperiodic = [true, true, false]",
        "[[particles]]\nshape = { sphere = { diameter = 5e-4 } }\ndensity = 3000.0\ncount = 20",
        "[contact]\nlubrication = {}\nsubsteps = 2\n\
         [[insertion]]\nregion = { lower = [0, 0, 2e-3], upper = [2e-3, 2e-3, 3.6e-3] }\nvolume_fraction = 0.15\n\
         velocity = [0, 0, -3e-2]\n[[removal]]\nplane = { point = [0, 0, 1e-3], normal = [0, 0, 1] }",
    )
}

/// All scenes.
#[cfg(feature = "gpu")]
pub(crate) fn scenes() -> [(&'static str, String); 5] {
    [
        ("spheres", spheres()),
        ("cubes", cubes()),
        ("walls", walls()),
        ("crossing", crossing()),
        ("open", open()),
    ]
}

/// Results of a run that must be the same: the hash of its state, and the rows of its series and paths.
fn outcome(place: &Place) -> [Vec<u8>; 3] {
    let summary = place.summary("out");
    assert_eq!(summary["steps"], 300);
    let [series, paths] = ["out/series.csv", "out/particle_series.csv"].map(|name| place.text(name));
    [summary["state_hash"].to_string().into_bytes(), series.into_bytes(), paths.into_bytes()]
}

/// Options of a run: precision and coupling.
fn options(precision: &str, coupling: &str) -> Vec<String> {
    let run = "run case.toml --overwrite --quiet --set".split(' ').map(str::to_owned);
    let keys =
        [format!("fluid.precision={precision}"), "--set".to_owned(), format!("lattice.coupling={coupling}")];
    run.chain(keys).collect()
}

fn on_threads(place: &Place, threads: usize, options: &[&str]) -> [Vec<u8>; 3] {
    place.well(&[options, &["--threads", &threads.to_string()]].concat());
    outcome(place)
}

#[cfg(feature = "mpi")]
fn on_processes(place: &Place, processes: usize, options: &[&str]) -> [Vec<u8>; 3] {
    crate::common::well(&mut place.limited_job(processes, options));
    outcome(place)
}

/// Threads and processes by turns, so that each number of ranks has both with each coupling and in each precision; what one thread
/// leaves of the first.
fn same_on_all(case: &str) -> [Vec<u8>; 3] {
    same_on_ranks(case, &["saturated", "paper"], &["f32", "f64", "f16"])
}

/// The same with some couplings and precisions.
fn same_on_ranks(case: &str, couplings: &[&str], precisions: &[&str]) -> [Vec<u8>; 3] {
    let place = Place::new(case);
    let mut first = None;
    for (c, coupling) in couplings.iter().enumerate() {
        for (p, precision) in precisions.iter().enumerate() {
            let options = options(precision, coupling);
            let options: Vec<&str> = options.iter().map(String::as_str).collect();
            let expected = on_threads(&place, 1, &options);
            for (r, ranks) in RANKS.into_iter().enumerate() {
                let by_threads = (c + p + r) % 2 == 0;
                if by_threads {
                    let found = on_threads(&place, ranks, &options);
                    assert!(found == expected, "{options:?} on {ranks} threads");
                }
                #[cfg(feature = "mpi")]
                if !by_threads {
                    let found = on_processes(&place, ranks, &options);
                    assert!(found == expected, "{options:?} on {ranks} processes");
                }
            }
            first.get_or_insert(expected);
        }
    }
    first.unwrap()
}

#[test]
fn touching_spheres_have_the_same_bits_on_any_ranks() {
    let [_, series, _] = same_on_all(&spheres());
    let contacts: f64 = column_of(&series[..], "contacts").iter().sum();
    assert!(contacts > 100.0, "they touch");
}

#[test]
fn cubes_with_sub_steps_have_the_same_bits_on_any_ranks() {
    let [_, series, _] = same_on_all(&cubes());
    let contacts: f64 = column_of(&series[..], "contacts").iter().sum();
    assert!(contacts > 100.0, "they touch");
}

#[test]
fn contacts_with_walls_have_the_same_bits_on_any_ranks() {
    let [_, series, _] = same_on_all(&walls());
    let forces = column_of(&series[..], "wall_force_z");
    assert!(forces.iter().any(|&force| force < 0.0), "they meet the wall");
}

#[test]
fn particles_that_come_into_a_flow_through_parts_of_faces_and_go_with_it_have_the_same_bits_on_any_ranks() {
    let [_, series, _] = same_on_ranks(&open(), &["saturated"], &["f32", "f64", "f16"]);
    let last = |name: &str| column_of(&series[..], name).last().copied().unwrap();
    let counts = ["inserted_particles.0", "inserted_particles.1", "removed_particles.0"].map(last);
    assert!(counts[0] > 20.0 && counts[1] > 8.0 && counts[2] > 1.0, "{counts:?}");
    assert!(last("mass_flow_x+") < 0.0 && last("mass_flow_x-") > 0.0);
}

#[test]
fn particles_that_come_into_a_suspension_with_lubrication_have_the_same_bits_on_any_ranks() {
    let [_, series, _] = same_on_ranks(&coming(), &["saturated"], &["f32"]);
    let last = |name: &str| column_of(&series[..], name).last().copied().unwrap();
    let counts = ["inserted_particles.0", "removed_particles.0"].map(last);
    assert!(counts[0] > 5.0 && counts[1] > 2.0, "{counts:?}");
}

#[test]
fn particles_that_cross_faces_edges_and_corners_have_the_same_bits_on_any_ranks() {
    let [_, _, paths] = same_on_all(&crossing());
    let mut reader = csv::Reader::from_reader(&paths[..]);
    let rows: Vec<Vec<f64>> = reader.deserialize().map(Result::unwrap).collect();
    // Of the first 16 particles (plane z = 0): how many borders, half a box apart, each has crossed in all.
    let (first, last) = (&rows[..16], &rows[rows.len() - 16..]);
    let borders = |before: &[f64], after: &[f64]| {
        (3..6).filter(|&a| (before[a] / 2e-3).floor() as i64 != (after[a] / 2e-3).floor() as i64).count()
    };
    let mut crossed = [0; 4];
    for (before, after) in first.iter().zip(last) {
        crossed[borders(before, after)] += 1;
    }
    assert_eq!(crossed, [0, 4, 8, 4], "faces, edges and corners");
}
