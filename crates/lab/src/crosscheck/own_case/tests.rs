//! Claims about recording, replaying and comparing; with two native engines, where LIGGGHTS is not the question.

use super::*;
use turbid::case::from_text;

/// Three spheres in a line, the outer ones on their way to the one in the middle.
const DRY: &str = r#"
[domain]
size = [0.01, 0.01, 0.01]
[dry]
time_step = 2e-5
[[particles]]
shape = { sphere = { diameter = 1e-3 } }
density = 2500.0
list = [
    { position = [2e-3, 5e-3, 5e-3], velocity = [0.1, 0.0, 0.0] },
    { position = [5e-3, 5e-3, 5e-3] },
    { position = [8.5e-3, 5e-3, 5e-3], velocity = [-0.1, 0.0, 0.0] },
]
[contact]
youngs_modulus = 1e6
friction_static = 0.0
friction_kinetic = 0.0
restitution = 1.0
law = "hertz"
[driving]
gravity = 0.0
[run]
end = { time = 0.04 }
"#;

/// Spheres in a periodic box of fluid.
const WET: &str = r"
[domain]
size = { diameters = [4, 4, 4] }
[fluid]
density = 1000.0
archimedes = 1000
[lattice]
cells_per_diameter = 6
relaxation_time = 0.6
[[particles]]
shape = { sphere = { diameter = 1.5e-3 } }
density = 3300.0
count = 20
[run]
end = { steps = 24 }
";

fn setup(text: &str, options: &[&str]) -> Setup {
    let options: Vec<String> = options.iter().map(ToString::to_string).collect();
    from_text(text, "test", &options).unwrap_or_else(|e| panic!("{e}"))
}

fn compare(a: &Setup, b: &Setup) -> Pair {
    let mut pair = Pair::new(a, [a, b].map(|of| native(of).unwrap()));
    pair.run(a.plan.end_step, None);
    assert!(pair.failures.is_empty());
    pair
}

#[test]
fn an_engine_does_not_part_from_itself() {
    let one = setup(DRY, &[]);
    let found = compare(&one, &one);
    assert_eq!(found.parting, [None; 3]);
    assert!(found.largest.iter().all(|largest| *largest == 0.0));
    assert_eq!(found.steps, [one.plan.end_step; 2]);
    // The one in the middle is thrown to the right and back.
    assert!(found.begun().iter().all(|begun| (begun - 3.0).abs() < 0.5));
    let text = parting(&one, &found);
    assert_eq!(text.matches("never").count(), 3, "{text}");
}

#[test]
fn engines_of_different_laws_part_with_the_impact_and_the_first_particle_is_named() {
    let hertz = setup(DRY, &[]);
    let damped = setup(DRY, &["contact.restitution=0.5"]);
    let found = compare(&hertz, &damped);
    // The left pair has a way of 2 mm to go, the right one of 2.5 mm, and it takes some steps to part.
    let contact = (2e-3 / 0.1 / hertz.time_step).round() as u64;
    for first in found.first_contact {
        assert!(first.unwrap().abs_diff(contact) <= 2, "{:?}", found.first_contact);
    }
    let [position, velocity, spin] = found.parting;
    let apart = position.unwrap();
    assert!(apart.id < 2 && apart.value > PARTED, "{apart:?}");
    assert!((contact + 2..contact + 100).contains(&apart.step), "{apart:?}");
    assert!((apart.position[0] - 4.5e-3).abs() < 1e-3, "{apart:?}");
    assert!(velocity.unwrap().touching && velocity.unwrap().step < apart.step && spin.is_none());
    assert!(found.largest[0] > apart.value);
    let text = parting(&hertz, &found);
    assert!(text.contains(&format!("particle {} then is at", apart.id)), "{text}");
}

#[test]
fn engines_that_part_in_free_flight_are_said_to_do_so_without_a_contact() {
    let slow = setup(DRY, &[]);
    let mut other = slow.clone();
    other.particles[0].velocity[0] *= 1.01;
    other.particles[1].angular_velocity[2] = 1e-9;
    let [position, velocity, spin] = compare(&slow, &other).parting.map(Option::unwrap);
    assert!([position, velocity, spin].iter().all(|apart| !apart.touching));
    assert_eq!((velocity.step, velocity.id, spin.step, spin.id), (0, 0, 0, 1));
    assert!(position.id == 0 && position.step > 0, "{position:?}");
}

#[test]
fn recorded_loads_are_the_same_on_1_2_and_4_ranks_and_repeat_the_run_to_the_bit() {
    let one = Recording::of(&setup(WET, &["run.threads=1"]), 24).unwrap();
    for threads in [2, 4] {
        let several = Recording::of(&setup(WET, &[&format!("run.threads={threads}")]), 24).unwrap();
        assert_eq!(several.last, one.last);
        assert_eq!(several.loads, one.loads);
    }
    let setup = setup(WET, &[]);
    assert!(one.loads[23].iter().any(|load| load.force.norm() > 0.0));
    let mut pair = Pair::new(&setup, [(); 2].map(|()| native(&setup).unwrap()));
    pair.run(24, Some(&one));
    let mut findings = Findings::default();
    pair.check_repeats(&mut findings, &one);
    assert!(findings.checks[0].pass && pair.particles(0) == one.last, "{findings:?}");
}

#[test]
fn a_time_is_rounded_up_to_steps_and_one_that_is_none_is_refused() {
    let setup = setup(DRY, &[]);
    assert_eq!(steps(&setup, None).unwrap(), 2000);
    assert_eq!(steps(&setup, Some(3.1e-5)).unwrap(), 2);
    assert_eq!(steps(&setup, Some(1e-9)).unwrap(), 1);
    for time in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert_eq!(steps(&setup, Some(time)).unwrap_err().exit_code(), 2);
    }
}

#[test]
fn a_record_that_would_not_fit_is_refused_with_the_longest_time_that_does() {
    let setup = setup(WET, &[]);
    let text = steps(&setup, Some(1e6)).unwrap_err().to_string();
    let most: f64 = text.rsplit("--time ").next().unwrap().parse().unwrap();
    assert!(steps(&setup, Some(0.99 * most)).is_ok() && most < 1e6, "{text}");
}

#[test]
fn other_bodies_than_spheres_are_refused() {
    let cubes = setup(DRY, &["particles.0.shape.cube.edge=1e-3"]);
    let error = run(&cubes, None, &Against::liggghts()).unwrap_err();
    assert_eq!(error.exit_code(), 2);
    assert!(error.to_string().contains("spheres"), "{error}");
}
