use super::*;
use crate::case::from_text;
use crate::comm::on_threads;
use crate::domain::Decomposition;
use crate::simulation::Simulation;

/// A case of one kind of particle at places of its own, in a dry box of 12 mm.
fn text(periodic: &str, list: &str, more: &str) -> String {
    format!(
        r#"
domain = {{ size = [12e-3, 12e-3, 12e-3], periodic = {periodic} }}
dry.time_step = 1e-6
run.end.steps = 1
contact.youngs_modulus = 1e6
driving.gravity = 0
output = {{ directory = "out", structure = {{ reach = 4e-3, bins = 79, plane = "xz", shortest_wave = 0.7e-3 }} }}
[[particles]]
shape.cuboid.edges = [0.9e-3, 0.9e-3, 0.5e-3]
density = 2000
list = [{list}]
{more}
"#
    )
}

fn setup_in(periodic: &str, list: &str, more: &str) -> Setup {
    from_text(&text(periodic, list, more), "lattice", &[]).unwrap_or_else(|e| panic!("{e}"))
}

fn setup(list: &str, more: &str) -> Setup {
    setup_in("[true, true, true]", list, more)
}

/// Totals of the writer before the first step.
fn totals(setup: &Setup) -> (StructureWriter<'_>, Totals) {
    let writer = StructureWriter::of(setup).unwrap();
    let mut simulation = Simulation::solo(setup).unwrap();
    let sums = writer.sums(&mut RankState::new(&mut simulation));
    let totals = Totals::of(sums, simulation.comm());
    (writer, totals)
}

fn output(totals: &Totals) -> RootOutput<'_> {
    RootOutput::of(3, 3e-6, totals)
}

/// A simple cubic lattice of 1 mm, all bodies turned by 90 degrees about x, so that their short axis is y.
fn lattice() -> Setup {
    let places = (0..1728).map(|k| {
        let [x, y, z] = [k % 12, k / 12 % 12, k / 144].map(|n| f64::from(n) + 0.25);
        format!("{{ position = [{x}e-3, {y}e-3, {z}e-3], orientation = {{ axis = [1, 0, 0], angle = 90 }} }}")
    });
    setup(&places.collect::<Vec<_>>().join(", "), "")
}

#[test]
fn the_structure_factor_of_a_lattice_is_its_number_of_bodies_at_reciprocal_lattice_vectors_and_zero_elsewhere()
 {
    let setup = lattice();
    let (writer, totals) = totals(&setup);
    let factors = writer.waves.as_ref().unwrap().factors(&totals.fixed[FIXED..], 1728.0);
    // In twelfths of 1 / mm: vectors (12, 0, 0) and (12, 12, 0) and the like, three and six of the vectors of their shells.
    let number = 2.0 * PI / 12e-3;
    let mut peaks = Vec::new();
    for (shell, [k, factor]) in (1..).zip(&factors) {
        assert!((k / number - f64::from(shell)).abs() < 0.3, "{shell}: {k}");
        if *factor > 1e-6 {
            peaks.push((shell, *factor));
        }
    }
    assert_eq!(peaks.iter().map(|(shell, _)| *shell).collect::<Vec<_>>(), [12, 17]);
    for ((shell, factor), vectors) in peaks.into_iter().zip([3.0, 6.0]) {
        let range = -shell..=shell;
        let cube = range
            .clone()
            .flat_map(|z| range.clone().flat_map(move |y| (-shell..=shell).map(move |x| [x, y, z])));
        let within = cube.filter(|n| {
            let length = n.map(f64::from).map(|n| n * n).iter().sum::<f64>().sqrt();
            length.round() as i32 == shell && length * 0.7 <= 12.0
        });
        let part = 1728.0 * vectors / (0.5 * within.count() as f64);
        assert!((factor / part - 1.0).abs() < 1e-6, "{shell}: {factor} and {part}");
    }
}

#[test]
fn the_pairs_of_a_cubic_lattice_are_those_of_its_shells_and_directions() {
    let setup = lattice();
    let (writer, totals) = totals(&setup);
    let rows = writer.pair_rows(&output(&totals));
    assert_eq!(rows.len(), 79);
    // Neighbours at 1, sqrt(2), sqrt(3) and 2 mm: 6, 12, 8 and 6.
    let expected = 1727.0 / 12.0_f64.powi(3);
    let count = |at: f64| {
        let half = 2.0 / 79.0;
        let row = &rows[(0.5 * at / half) as usize];
        let r = row[2].unwrap() * 1e3;
        assert!((r - at).abs() < half);
        let shell = 4.0 / 3.0 * PI * ((r + half).powi(3) - (r - half).powi(3));
        (row[3].unwrap() * shell * expected, row[4..].iter().map(|g| g.unwrap() * shell * expected).collect())
    };
    for (at, neighbours) in [(1.0, 6.0), (2.0_f64.sqrt(), 12.0), (3.0_f64.sqrt(), 8.0), (2.0, 6.0)] {
        let (found, _): (f64, Vec<f64>) = count(at);
        assert!((found / neighbours - 1.0).abs() < 1e-9, "{at}: {found}");
    }
    assert_eq!(rows[10][3], Some(0.0));
    // Two neighbours along x, in the first sector, and two along z, at 90 degrees, each in one of 36 parts of the sphere.
    let (_, sectors): (f64, Vec<f64>) = count(1.0);
    assert!((sectors[0] - 2.0 * 36.0).abs() < 1e-6 && (sectors[9] - 2.0 * 36.0).abs() < 1e-6, "{sectors:?}");
    assert!((sectors.iter().sum::<f64>() - 144.0).abs() < 1e-6);
    let numbers = writer.numbers(&output(&totals));
    let column = |name: &str| numbers[COLUMNS.iter().position(|head| head.starts_with(name)).unwrap()];
    assert!((column("nearest_neighbour").unwrap() - 1e-3).abs() < 1e-12);
    let touching = ["coordination (", "rattlers"].map(|name| column(name).map(f64::to_bits));
    assert_eq!(touching, [0.0, 1.0].map(|number: f64| Some(number.to_bits())));
    assert_eq!([column("fabric_xx"), column("normal_force"), column("coordination_without")], [None; 3]);
    let axis = ["xx", "yy", "zz", "xy"].map(|of| column(&format!("orientation_{of}")).unwrap());
    assert!(axis.iter().zip([0.0, 1.0, 0.0, 0.0]).all(|(a, b)| (a - b).abs() < 1e-12), "{axis:?}");
}

#[test]
fn bodies_whose_moments_are_alike_have_no_axis() {
    let of = |shape: &str| {
        let text = format!("[[particles]]\nshape.{shape}\ndensity = 2000\nlist = [[6e-3, 6e-3, 6e-3]]");
        let setup = setup("[1e-3, 1e-3, 1e-3]", &text);
        axis_of(&setup.templates[1])
    };
    assert_eq!(of("sphere.diameter = 1e-3"), None);
    assert_eq!(of("cube.edge = 1e-3"), None);
    // Along the axis of a rod and across a plate; bodies have the axes of their moments.
    for shape in
        ["cylinder = { diameter = 1e-3, length = 3e-3 }", "cylinder = { diameter = 3e-3, length = 1e-3 }"]
    {
        assert!(of(shape).is_some(), "{shape}");
    }
}

#[test]
fn the_part_of_a_shell_in_a_box_with_walls_is_that_of_random_points() {
    let closed = |periodic: [bool; 3]| Domain { cells: [10, 8, 6], dx: 1.0, faces: Domain::faces(periodic) };
    for periodic in [[true; 3], [true, true, false], [false, true, false], [false; 3]] {
        let domain = closed(periodic);
        for r in [0.5, 2.5] {
            // Mean over directions of the product of what is left along each closed axis, on a fine grid.
            let (mut sum, n) = (0.0, 400);
            for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
                let [u, v] = [i, j].map(|k| (f64::from(k) + 0.5) / f64::from(n));
                let (cos, angle) = (2.0 * u - 1.0, 2.0 * PI * v);
                let sin = (1.0 - cos * cos).sqrt();
                let way = Vec3::new(sin * angle.cos(), sin * angle.sin(), cos);
                let left = (0..3).filter(|axis| !domain.is_periodic(*axis));
                sum += left.map(|axis| 1.0 - r * way[axis].abs() / domain.size()[axis]).product::<f64>();
            }
            let mean = sum / f64::from(n * n);
            assert!((in_box(&domain, r) / mean - 1.0).abs() < 1e-4, "{periodic:?} {r}");
        }
    }
}

/// Clusters, their size, the largest one, and whether they reach along x, y and z, on several ranks. The bodies move to `places` (mm) first, since a
/// case refuses bodies that overlap.
fn of_clusters(setup: &Setup, places: &[Vec3], grid: [usize; 3]) -> Vec<f64> {
    let cut = Decomposition::with_grid(setup.domain, grid);
    let mut found = on_threads(cut.ranks(), |comm| {
        let writer = StructureWriter::of(setup).unwrap();
        let mut simulation = Simulation::new(setup, &cut, comm).unwrap();
        let mut particles = simulation.particles().to_vec();
        for particle in &mut particles {
            if let Some(place) = places.get(particle.id as usize) {
                particle.position = (place * 1e-3).into();
            }
        }
        simulation.set_particles(&particles).unwrap();
        simulation.advance(1).unwrap();
        let sums = writer.sums(&mut RankState::new(&mut simulation));
        let totals = Totals::of(sums, simulation.comm());
        let numbers = writer.numbers(&output(&totals));
        let first = COLUMNS.iter().position(|head| head.starts_with("clusters")).unwrap();
        numbers[first..].iter().map(|number| number.unwrap()).collect::<Vec<_>>()
    });
    let first = found.swap_remove(0);
    assert!(found.iter().all(|other| close(other, &first)), "{found:?}");
    first
}

fn close(found: &[f64], expected: &[f64]) -> bool {
    found.len() == expected.len() && found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12)
}

/// A list of the places (mm).
fn list(places: impl Iterator<Item = Vec3>) -> String {
    places.map(|at| format!("[{}e-3, {}e-3, {}e-3]", at.x, at.y, at.z)).collect::<Vec<_>>().join(", ")
}

#[test]
fn a_row_of_bodies_reaches_through_a_periodic_box_until_one_is_taken_out_on_any_ranks() {
    let check = |without: &[usize], expected: [f64; 6]| {
        // As far apart as they fit into the box, which therefore touch; and a pair that touches across a face.
        let row = (0..14).filter(|k| !without.contains(k));
        let row = row.map(|k| (Vec3::new((k as f64 + 0.3) * 12.0 / 14.0, 3.0, 3.0), (k % 2) as f64 * 3.0));
        let pair = [(Vec3::new(6.0, 9.0, 11.9), 0.0), (Vec3::new(6.0, 9.0, 0.35), 0.3)];
        let places: Vec<(Vec3, f64)> = row.chain(pair).collect();
        let setup = setup(&list(places.iter().map(|(at, off)| at + Vec3::new(0.0, *off, *off))), "");
        let places: Vec<Vec3> = places.into_iter().map(|(at, _)| at).collect();
        for grid in [[1, 1, 1], [2, 1, 1], [3, 1, 2], [1, 2, 2]] {
            let found = of_clusters(&setup, &places, grid);
            assert!(close(&found, &expected), "{grid:?}: {found:?} {expected:?}");
        }
    };
    check(&[], [2.0, (14.0 * 14.0 + 4.0) / 16.0, 14.0 / 16.0, 1.0, 0.0, 0.0]);
    check(&[5], [2.0, (13.0 * 13.0 + 4.0) / 15.0, 13.0 / 15.0, 0.0, 0.0, 0.0]);
    // A single body between two gaps is no cluster, but counts as one of size 1.
    check(&[5, 7], [2.0, (11.0 * 11.0 + 4.0 + 1.0) / 14.0, 11.0 / 14.0, 0.0, 0.0, 0.0]);
}

#[test]
fn a_column_of_bodies_reaches_from_floor_to_lid_and_a_body_through_the_box_is_its_own_continuation() {
    let check = |without: Option<usize>, expected: [f64; 6]| {
        let heights = (0..25).filter(|k| Some(*k) != without).map(|k| (k, 0.24 + 0.48 * k as f64));
        let places: Vec<Vec3> = heights.clone().map(|(_, z)| Vec3::new(3.0, 3.0, z)).collect();
        let apart = heights.map(|(k, z)| Vec3::new(3.0, 3.0 + (k % 2) as f64 * 3.0, 6.0 + 0.95 * (z - 6.0)));
        let bar = "[[particles]]\nshape.cuboid.edges = [0.4e-3, 0.5e-3, 12e-3]\nthrough = \"x\"\ndensity = 2000\n\
                   list = [[6e-3, 9e-3, 6e-3]]";
        // Wider than the bar is long.
        let text = text("[true, true, false]", &list(apart), bar).replace("[12e-3, 12e-3,", "[12e-3, 14e-3,");
        let setup = from_text(&text, "column", &[]).unwrap_or_else(|e| panic!("{e}"));
        for grid in [[1, 1, 1], [1, 1, 3]] {
            let found = of_clusters(&setup, &places, grid);
            assert!(close(&found, &expected), "{grid:?}: {found:?} {expected:?}");
        }
    };
    check(None, [1.0, 626.0 / 26.0, 25.0 / 26.0, 1.0, 0.0, 1.0]);
    check(Some(12), [2.0, (144.0 + 144.0 + 1.0) / 25.0, 12.0 / 25.0, 1.0, 0.0, 0.0]);
}

#[test]
fn bodies_that_pull_each_other_over_a_gap_are_no_cluster_and_have_no_contact() {
    let spheres = "shape.sphere.diameter = 1e-3";
    let more = "[contact.van_der_waals]\nhamaker_constant = 1e-14\nsmallest_gap = 2e-6\ncut_off = 5e-5";
    let text = text("[true, true, true]", "[3e-3, 3e-3, 3e-3], [4.02e-3, 3e-3, 3e-3]", more);
    let text = text.replace("shape.cuboid.edges = [0.9e-3, 0.9e-3, 0.5e-3]", spheres);
    let setup = from_text(&text, "gap", &[]).unwrap_or_else(|e| panic!("{e}"));
    let mut simulation = Simulation::solo(&setup).unwrap();
    simulation.advance(1).unwrap();
    assert_eq!(RankState::new(&mut simulation).contacts().len(), 1);
    let found = of_clusters(&setup, &[], [1, 1, 1]);
    assert!(close(&found, &[0.0, 1.0, 0.5, 0.0, 0.0, 0.0]), "{found:?}");
    let writer = StructureWriter::of(&setup).unwrap();
    let sums = writer.sums(&mut RankState::new(&mut simulation));
    let totals = Totals::of(sums, simulation.comm());
    assert!(totals.sums[CONTACTS].abs() < 0.5 && totals.sums[TOUCHES].abs() < 0.5);
}

#[test]
fn pairs_of_sections_add_up_to_those_of_all_and_have_places_of_their_own() {
    let more = "[[particles]]\nshape.sphere.diameter = 0.2e-3\ndensity = 2000\nlist = [[2e-3, 2e-3, 2e-3], [4e-3, 2e-3, 2e-3]]";
    let setup = setup("[2e-3, 3e-3, 2e-3], [9e-3, 9e-3, 9e-3], [9e-3, 9e-3, 6.1e-3]", more);
    let (writer, totals) = totals(&setup);
    let rows = writer.pair_rows(&output(&totals));
    let width = 4e-3 / 79.0;
    let first = rows[0].len() - 3;
    // Ordered pairs of the five bodies: one of cuboids at 2.9 mm, one of spheres at 2 mm, two of both at 1 mm and sqrt(5) mm.
    let volume = 12e-3_f64.powi(3);
    for (kind, at, pairs, of) in
        [(0, 2.9, 2.0, 6.0), (1, 1.0, 2.0, 12.0), (1, 5_f64.sqrt(), 2.0, 12.0), (2, 2.0, 2.0, 2.0)]
    {
        let bin = (at * 1e-3 / width) as usize;
        let ends = [bin, bin + 1].map(|end| (end as f64 * width).powi(3));
        let expected = pairs * volume / (of * 4.0 / 3.0 * PI * (ends[1] - ends[0]));
        let found: Vec<f64> = rows[bin][first..].iter().map(|g| g.unwrap()).collect();
        assert!((found[kind] / expected - 1.0).abs() < 1e-9, "{at}: {found:?} {expected}");
        assert!(found.iter().enumerate().all(|(other, g)| other == kind || *g == 0.0), "{at}: {found:?}");
    }
}
