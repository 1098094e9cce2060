//! Bodies that are fixed, or moved as prescribed, where they overlap each other and walls.

use crate::case::{Setup, from_saved_anew, from_text};
use crate::error::Result;

const TEXT: &str = "domain = { size = [4e-3, 4e-3, 4e-3], periodic = [true, true, false] }\n\
                    fluid = { density = 1000, viscosity = 1e-5 }\n\
                    lattice = { cells_per_diameter = 8, relaxation_time = 0.8 }\n\
                    driving.gravity = 0\n\
                    run.end.steps = 1\n\
                    [[particles]]\n\
                    shape.sphere.diameter = 1e-3\n\
                    density = 2500.0\n\
                    motion = \"fixed\"\n\
                    list = [[1e-3, 2e-3, 2e-3], [1.5e-3, 2e-3, 2e-3], [3e-3, 3e-3, 0]]\n";

fn load(options: &[&str]) -> Result<Setup> {
    let options: Vec<String> = options.iter().map(ToString::to_string).collect();
    from_text(TEXT, "bed", &options)
}

#[test]
fn bodies_that_no_force_moves_may_overlap_each_other_and_walls_and_others_may_not() {
    assert_eq!(load(&[]).unwrap().particles.len(), 3);
    load(&[
        "particles.0.motion={ velocity = [1e-4, 0, 0] }",
        "particles.0.list=[[1e-3, 2e-3, 2e-3], [1.5e-3, 2e-3, 2e-3]]",
    ])
    .unwrap();
    for motion in ["free", "{ free = [\"x\"] }", "{ free = [\"rotation\"] }"] {
        let refused = load(&[&format!("particles.0.motion={motion}")]).unwrap_err().to_string();
        assert!(refused.contains("1 pair of particles overlap"), "{motion}: {refused}");
    }
    let loose = "particles=[{ shape.sphere.diameter = 1e-3, density = 2500, motion = \"fixed\", list = [[3e-3, 3e-3, 0]] }, \
                 { shape.sphere.diameter = 5e-4, density = 2500, list = [[3e-3, 3e-3, 6e-4]] }]";
    let refused = load(&[loose]).unwrap_err().to_string();
    assert!(refused.contains("particles 0 and 1"), "{refused}");
}

#[test]
fn a_fixed_body_that_is_wholly_in_a_wall_is_refused() {
    let wall = "walls=[{ name = \"step\", plane = { point = [0, 0, 1.2e-3], normal = [0, 0, 1] } }]";
    let refused = load(&[wall]).unwrap_err().to_string();
    assert!(refused.contains("a wall at the start") && refused.contains("\"step\""), "{refused}");
    load(&[wall, "particles.0.list=[[1e-3, 2e-3, 1e-3]]"]).unwrap();
}

#[test]
fn what_overlapping_bodies_share_and_what_is_in_a_wall_counts_once_in_the_volume_fraction() {
    let fraction = |list: &str| load(&[&format!("particles.0.list={list}")]).unwrap().volume_fraction;
    let ball = std::f64::consts::PI / 6.0 / 64.0;
    let near = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 0.02, "{a} is not {b}");
    assert!((fraction("[[1e-3, 1e-3, 2e-3]]") / ball - 1.0).abs() < 1e-12);
    near(fraction("[[1e-3, 1e-3, 2e-3], [1e-3, 1e-3, 2e-3]]"), ball);
    near(fraction("[[1e-3, 1e-3, 0]]"), 0.5 * ball);
    // The lens of two spheres of radius R at a distance of R has 5/16 of the volume of one.
    near(fraction("[[1e-3, 1e-3, 2e-3], [1.5e-3, 1e-3, 2e-3]]"), (2.0 - 5.0 / 16.0) * ball);
}

#[test]
fn overlapping_bodies_beside_random_ones_have_the_same_volume_fraction_before_those_are_placed() {
    let sections = "particles=[{ shape.sphere.diameter = 1e-3, density = 2500, motion = \"fixed\", \
                    list = [[1e-3, 2e-3, 2e-3], [1.5e-3, 2e-3, 2e-3]] }, \
                    { shape.sphere.diameter = 5e-4, density = 2500, motion = \"fixed\", count = 20 }]";
    let options = [sections.to_string()];
    let fraction = |places: bool| {
        from_saved_anew("bed", TEXT, &[], &options, places).unwrap_or_else(|e| panic!("{e}")).volume_fraction
    };
    let (counted, placed) = (fraction(false), fraction(true));
    assert!((counted / placed - 1.0).abs() < 1e-12, "{counted} is not {placed}");
}

#[test]
fn random_particles_find_room_beside_a_rough_bed_that_fills_half_of_the_box() {
    // 5 x 5 x 4 spheres at distances of 0.8 diameters: 0.6 of the lower half.
    let bed: Vec<String> = (0..100)
        .map(|n| format!("[{}e-4, {}e-4, {}e-4]", 8 * (n % 5), 8 * (n / 5 % 5), 6 * (n / 25)))
        .collect();
    let random = format!(
        "particles=[{{ shape.sphere.diameter = 1e-3, density = 2500, motion = \"fixed\", list = [{}] }}, \
         {{ shape.sphere.diameter = 5e-4, density = 2500, count = 30 }}]",
        bed.join(", ")
    );
    let setup = load(&[&random, "lattice.cells_per_diameter=10"]).unwrap_or_else(|e| panic!("{e}"));
    let (fixed, free) = setup.particles.split_at(100);
    assert_eq!(free.len(), 30);
    for one in free {
        for other in fixed {
            let apart = setup.domain.nearest_image(one.position() - other.position()).norm();
            assert!(apart >= 0.75e-3, "{apart}");
        }
    }
    assert!(setup.provenance.warnings.is_empty(), "{:?}", setup.provenance.warnings);
}
