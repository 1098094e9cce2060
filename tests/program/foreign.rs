//! Input of other programs: meshes with the defects of their exports, and particles that overlap at the start.

use crate::common::case::viscous;
use crate::common::{Place, has, in_tree};
use std::fmt::Write;

/// A facet of a binary STL file without its normal: three corners.
type Facet = [[f32; 3]; 3];

/// The stone of the cases, from text.
fn stone() -> Vec<Facet> {
    let text = std::fs::read_to_string(in_tree("cases/stone.stl")).unwrap();
    let number = |word: &str| word.parse::<f32>().unwrap();
    let corners: Vec<[f32; 3]> = (text.lines())
        .filter_map(|line| line.trim().strip_prefix("vertex "))
        .map(|line| <[f32; 3]>::try_from(line.split_whitespace().map(number).collect::<Vec<_>>()).unwrap())
        .collect();
    corners.chunks_exact(3).map(|corners| corners.try_into().unwrap()).collect()
}

fn binary_stl(facets: &[Facet]) -> Vec<u8> {
    let mut bytes = vec![b' '; 80];
    bytes.extend((facets.len() as u32).to_le_bytes());
    for facet in facets {
        bytes.extend([0; 12]);
        bytes.extend(facet.iter().flatten().flat_map(|x| x.to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

const OUTPUT: &str = "series_every = { steps = 10 }
fields_every = \"never\"
particles_every = \"never\"
picture_every = \"never\"";

/// A dozen stones for twenty steps; `hull` and the like go into the braces of the mesh.
fn stones(more: &str) -> String {
    let stone =
        format!("{{ mesh = {{ file = \"stone.stl\", unit = \"mm\", equivalent_diameter = 5e-4{more} }} }}");
    let particles = format!("[[particles]]\nshape = {stone}\ndensity = 2600.0\ncount = 12\nseed = 7");
    viscous("size = [2e-3, 2e-3, 2e-3]", &particles, 20, OUTPUT)
}

#[test]
fn a_mesh_with_facets_that_are_there_twice_runs_like_the_clean_one_and_says_so() {
    let clean = stone();
    let mut twice = clean.clone();
    let [a, b, c] = clean[5];
    let fold = [a, b, [9.0, 9.0, 9.0]];
    twice.extend([[b, c, a], clean[11], fold, [fold[1], fold[0], fold[2]], [c, c, a]]);
    let place = Place::new(&stones(""));
    let hash = |facets: &[Facet], dropped: bool| {
        place.write("stone.stl", binary_stl(facets));
        let words =
            ["note: ", "stone.stl: dropped 4 duplicated facets", "and 1 degenerate facet", "case.toml:10:27"];
        for arguments in [&["check", "case.toml"][..], &["run", "case.toml", "--overwrite", "--quiet"]] {
            let said = place.well(arguments);
            if dropped {
                has(&said, &words);
            }
            assert_eq!(said.contains("note: "), dropped, "{said}");
        }
        place.summary("out")["state_hash"].clone()
    };
    assert_eq!(hash(&clean, false), hash(&twice, true));
}

#[test]
fn the_hull_of_a_concave_mesh_says_how_much_volume_it_adds() {
    // A cube with a funnel in its lid, a tenth of its edge deep.
    let ring = [[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 1.0, 1.0], [0.0, 1.0, 1.0]];
    let floor = ring.map(|[x, y, _]| [x, y, 0.0]);
    let middle = [0.5, 0.5, 0.9];
    let mut facets = vec![[floor[0], floor[2], floor[1]], [floor[0], floor[3], floor[2]]];
    for n in 0..4 {
        let m = (n + 1) % 4;
        facets.extend([
            [floor[n], floor[m], ring[m]],
            [floor[n], ring[m], ring[n]],
            [ring[n], ring[m], middle],
        ]);
    }
    let place = Place::new(&stones(""));
    place.write("stone.stl", binary_stl(&facets));
    // The funnel takes 1/30 of the cube.
    let words = ["stone.stl: the body is concave", "hull = true", "adds 3.448 % to the volume"];
    place.refused(&["check", "case.toml"], &words);
    place.write("case.toml", stones(", hull = true"));
    for arguments in [["check", "case.toml"], ["run", "case.toml"]] {
        has(&place.well(&arguments), &["note: ", "the convex hull adds 3.448 % to the volume of the mesh"]);
    }
}

/// Spheres and stones on a lattice so narrow that neighbours overlap, between a floor and a lid.
fn crowd(more: &str) -> String {
    let mut particles = String::new();
    let shapes =
        ["sphere = { diameter = 5e-4 }", "mesh = { file = \"stone.stl\", equivalent_diameter = 5e-4 }"];
    for (kind, shape) in shapes.iter().enumerate() {
        let mut list = String::new();
        for n in (kind..64).step_by(2) {
            let at = [n % 4, n / 4 % 4, n / 16].map(|i| 2e-4 + 4.9e-4 * i as f64);
            let turn = format!("{{ axis = [1, {n}, 2], angle = {} }}", 37 * n);
            writeln!(list, "{{ position = {at:?}, orientation = {turn} }},").unwrap();
        }
        writeln!(
            particles,
            "[[particles]]\nshape = {{ {shape} }}\ndensity = 2600.0\nlist = [\n{list}]\n{more}"
        )
        .unwrap();
    }
    viscous("size = [2.4e-3, 2.4e-3, 2.4e-3]\nperiodic = [true, true, false]", &particles, 40, OUTPUT)
}

#[test]
fn relaxed_spheres_and_stones_have_the_same_bits_on_any_ranks_and_when_resumed() {
    let place = Place::new(&crowd(""));
    place.write("stone.stl", binary_stl(&stone()));
    place.refused(
        &["check", "case.toml"],
        &["pairs of particles overlap at the start", "overlaps = \"relax\""],
    );
    place.write("case.toml", crowd("overlaps = \"relax\"\nrelax_distance = { diameters = 0.8 }"));
    let said = place.well(&["check", "case.toml"]);
    has(&said, &["note: ", " of 64 particles were moved apart, by ", " m at most, with turns of up to "]);
    let hash = |arguments: &[&str]| {
        place.well(arguments);
        place.summary("out")["state_hash"].clone()
    };
    let run = ["run", "case.toml", "--overwrite", "--quiet", "--threads"];
    let one = hash(&[&run[..], &["1"]].concat());
    for threads in ["2", "3", "4"] {
        assert_eq!(hash(&[&run[..], &[threads]].concat()), one, "{threads} threads");
    }
    let half = ["2", "--set", "run.end.steps=20", "--set", "output.checkpoint_every.steps=20"];
    let half = hash(&[&run[..], &half].concat());
    assert_ne!(half, one);
    assert_eq!(hash(&["resume", "out", "--set", "run.end.steps=40", "--threads", "3"]), one);
    // Written and read again, nothing is left to relax.
    place.well(&["pack", "case.toml", "--out", "apart.csv"]);
    let text = place.text("apart.csv");
    assert_eq!(text.lines().count(), 65);
}
