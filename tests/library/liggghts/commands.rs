//! Commands of the user: each fix that is passed on acts, groups survive a restart, and nothing else gets to LIGGGHTS.

use super::{RADIUS, advanced, engine, moving, with_commands};
use turbid::comm::{Comm, SavedParts};
use turbid::dem::DemEngine;
use turbid::engine::LiggghtsOptions;
use turbid::engine::liggghts::Liggghts;
use turbid::particle::Particle;

/// Mass of a sphere (kg).
const MASS: f64 = 2500.0 * 4.0 / 3.0 * std::f64::consts::PI * RADIUS * RADIUS * RADIUS;

/// A sphere at rest at x = 4 mm, and one at x = 12 mm that moves along y at 0.1 m/s.
fn two() -> Vec<Particle> {
    vec![moving(0, [4e-3, 8e-3, 8e-3], [0.0; 3]), moving(1, [12e-3, 8e-3, 8e-3], [0.0, 0.1, 0.0])]
}

/// Velocities of both after a time (s), in steps of 10 us.
fn velocities(commands: &[&str], time: f64) -> [[f64; 3]; 2] {
    let lgg = engine(with_commands(commands), &two()).unwrap();
    let lgg = advanced(lgg, (time / 1e-5).round() as u32, 1e-5).unwrap();
    let owned = lgg.particles().owned();
    [owned[0].velocity, owned[1].velocity]
}

#[track_caller]
fn close(measured: f64, expected: f64) {
    let scale = expected.abs().max(1e-12);
    assert!((measured - expected).abs() < 1e-4 * scale, "{measured:e} {expected:e}");
}

#[test]
fn every_fix_that_is_passed_on_acts_as_theory_says_on_its_group_alone() {
    let time = 1e-2;
    // A constant force, on a group of every kind.
    for group in [
        &["group g id 1"][..],
        &["group g id 1:1:3"],
        &["region left block 0 8e-3 INF EDGE EDGE INF units box", "group g region left"],
        &["region ball sphere 4e-3 8e-3 8e-3 1e-3", "group g region ball"],
        &["region rod cylinder z 4e-3 8e-3 1e-3 INF INF", "group g region rod"],
        &["region right plane 8e-3 0 0 1 0 0 side out", "group g region right"],
        &["group other id 2", "group g subtract all other"],
        &["group few id 1", "group both type 1", "group g intersect both few"],
        &["group few id 1", "group g union few"],
    ] {
        let commands = [group, &["fix f g addforce 0 0 -1e-6"]].concat();
        let [first, second] = velocities(&commands, time);
        close(first[2], -1e-6 * time / MASS);
        assert!(second[2] == 0.0, "{commands:?}: {second:?}");
    }
    let [first, second] = velocities(
        &["region left block 0 8e-3 INF INF INF INF", "fix f all addforce 0 1e-6 0 region left"],
        time,
    );
    close(first[1], 1e-6 * time / MASS);
    close(second[1], 0.1);
    // Towards a point, in x alone.
    let [first, second] = velocities(&["fix d all drag 8e-3 NULL NULL 1e-6 0"], time);
    close(first[0], 1e-6 * time / MASS);
    close(second[0], -1e-6 * time / MASS);
    // Oscillators: the first from a displacement, the second from a velocity.
    let omega = (1e-3 / MASS).sqrt();
    let spring =
        ["group g id 1", "fix s g spring tether 1e-3 6e-3 NULL NULL 0", "fix t all spring/self 1e-3 y"];
    let [first, second] = velocities(&spring, time);
    close(first[0], 2e-3 * omega * (omega * time).sin());
    close(second[1], 0.1 * (omega * time).cos());
    let [_, second] =
        velocities(&["neigh_modify one 5000 page 100000", "fix v all viscous 1e-5 scale 1 2"], time);
    assert!((second[1] / (0.1 * (-2e-5 / MASS * time).exp()) - 1.0).abs() < 1e-2, "{second:?}");
}

#[test]
fn a_group_by_region_and_the_rest_of_a_spring_are_those_of_the_start_after_a_restart() {
    // The second sphere enters the region of the group, the first leaves it.
    let commands = [
        "region ball sphere 4e-3 8e-3 8e-3 1e-3",
        "group g region ball",
        "fix push g addforce 4e-6 0 0",
        "fix hold all spring/self 1e-4",
    ];
    let all =
        [moving(1, [4e-3, 8e-3, 8e-3], [0.0, 0.0, 0.2]), moving(2, [4e-3, 8e-3, 6e-3], [0.0, 0.0, 0.2])];
    let params = with_commands(&commands);
    let first = advanced(engine(params.clone(), &all).unwrap(), 1000, 1e-5).unwrap();
    let height = |lgg: &Liggghts| lgg.particles().owned().iter().map(|p| p.position[2]).collect::<Vec<_>>();
    let z = height(&first);
    assert!(z[0] > 9e-3 && (z[1] - 8e-3).abs() < 1e-3, "they are where they should be: {z:?}");
    let saved = first.save(&Comm::Solo).unwrap();
    let mut second = engine(params, &all).unwrap();
    second.restore(&Comm::Solo, &SavedParts::divided(&Comm::Solo, &[saved])).unwrap();
    let [first, second] = [first, second].map(|lgg| advanced(lgg, 1000, 1e-5).unwrap());
    assert_eq!(first.particles().owned(), second.particles().owned());
    let x: Vec<f64> = first.particles().owned().iter().map(|p| p.velocity[0]).collect();
    assert!(x[0] > 1e-3 && x[1] == 0.0, "the force acts on the first alone: {x:?}");
}

#[test]
fn what_the_case_would_not_pass_on_is_refused_in_a_setup_made_without_a_case_too() {
    for command in [
        "print stolen file escaped",
        "write_restart escaped",
        "fix p all print 1 text file escaped",
        "group \"x y\" type 1",
    ] {
        let options = LiggghtsOptions { commands: vec![command.to_owned()], ..LiggghtsOptions::default() };
        let text = options.params().unwrap_err().to_string();
        assert!(text.contains("LIGGGHTS refuses") && text.contains(command), "{text}");
    }
}
