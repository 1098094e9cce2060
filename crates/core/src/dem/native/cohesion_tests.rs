//! Claims about cohesion: what hangs, what falls, what sticks, and what it leaves alone.

use super::wall_tests::{MATERIAL, RADIUS, TANK, alone, first, mass, plane, run};
use super::*;
use crate::contact::{CohesionLaw, ContactParams, ElasticLaw, PairParams};
use crate::shape::Sphere;
use std::f64::consts::PI;

const DT: f64 = 1e-6;

fn cohesive(cohesion: CohesionLaw, pair: PairParams) -> ContactModel {
    let law = ElasticLaw::Hertz;
    ContactModel { cohesion, ..ContactParams { pair, law, ..MATERIAL }.into() }
}

/// Spheres at these places (m), with the velocities (m/s), in a box with a ceiling.
fn spheres(contact: ContactModel, gravity: f64, all: &[(Vec3, Vec3)]) -> Native {
    let all: Vec<Particle> = (0..)
        .zip(all)
        .map(|(id, (position, velocity))| {
            let mut sphere = Particle::at(id, 0, *position);
            sphere.velocity = (*velocity).into();
            sphere
        })
        .collect();
    let ceiling = plane("ceiling", Vec3::z() * 0.012, -Vec3::z());
    let templates: Arc<[Template]> =
        [Template { shape: Arc::new(Sphere { radius: RADIUS }), density: 2500.0, material: 0 }].into();
    alone(TANK, contact, vec![ceiling], Vec3::z() * -gravity, templates, &all)
}

#[test]
fn a_sphere_hangs_from_a_ceiling_up_to_the_force_that_pulls_it_off() {
    let weight = mass() * 9.81;
    // The largest force of k A against Hertz, K = 2 pi k R, is 4/27 K^3 / c^2.
    let c = 4.0 / 3.0 * super::wall_tests::modulus() * RADIUS.sqrt();
    let density = |force: f64| (6.75 * force * c * c).cbrt() / (2.0 * PI * RADIUS);
    for (cohesion, part, hangs) in [
        (CohesionLaw::Dmt, 1.005, true),
        (CohesionLaw::Dmt, 0.995, false),
        (CohesionLaw::Sjkr, 1.01, true),
        (CohesionLaw::Sjkr, 0.99, false),
    ] {
        let pull = part * weight;
        let pair = PairParams {
            restitution: 0.3,
            work_of_adhesion: pull / (2.0 * PI * RADIUS),
            cohesion_density: density(pull),
            ..MATERIAL.pair
        };
        // Pressed on where the force is largest, so that it holds if anything does.
        let depth = match cohesion {
            CohesionLaw::Sjkr => (2.0 * 2.0 * PI * RADIUS * density(pull) / (3.0 * c)).powi(2),
            _ => 1e-9,
        };
        let at = Vec3::new(6e-3, 6e-3, 0.012 - RADIUS + depth);
        let mut engine = spheres(cohesive(cohesion, pair), 9.81, &[(at, Vec3::zeros())]);
        run(&mut engine, 45_000, DT);
        let fallen = at.z - first(&engine).position[2];
        println!("{cohesion:?}, pull {part} of the weight: fallen {fallen:.2e} m");
        assert_eq!(fallen < 1e-5, hangs, "{cohesion:?} {part}");
    }
}

#[test]
fn spheres_that_meet_slowly_stick_and_rest_where_cohesion_and_elasticity_balance() {
    for cohesion in [CohesionLaw::Dmt, CohesionLaw::Sjkr] {
        let pair =
            PairParams { restitution: 0.5, work_of_adhesion: 0.05, cohesion_density: 2e5, ..MATERIAL.pair };
        let contact = cohesive(cohesion, pair);
        let depth = crate::contact::SpherePair::new(&contact, 0, 2.0 * RADIUS, mass()).static_depth(0.0);
        let half = Vec3::x() * (RADIUS + 1e-7);
        let middle = Vec3::repeat(6e-3);
        let all = [(middle - half, Vec3::x() * 1e-3), (middle + half, Vec3::x() * -1e-3)];
        let mut engine = spheres(contact, 0.0, &all);
        run(&mut engine, 300_000, DT);
        let [a, b] = [0, 1].map(|i| engine.particles().particles[i].position());
        let overlap = 2.0 * RADIUS - (b - a).norm();
        println!("{cohesion:?}: depth {overlap:.4e} for {depth:.4e} m");
        assert!((overlap / depth - 1.0).abs() < 0.01, "{cohesion:?}");
        assert_eq!(engine.contacts().count, 1, "also where the forces balance to the last bit");
    }
}

#[test]
fn an_elastic_impact_of_cohesive_spheres_gives_back_the_speed_and_keeps_the_momentum() {
    for cohesion in [CohesionLaw::Dmt, CohesionLaw::Sjkr] {
        let pair =
            PairParams { restitution: 1.0, work_of_adhesion: 0.05, cohesion_density: 2e5, ..MATERIAL.pair };
        let half = Vec3::x() * (RADIUS + 1e-7);
        let middle = Vec3::repeat(6e-3);
        let all = [(middle - half, Vec3::x() * 0.2), (middle + half, Vec3::x() * -0.1)];
        let mut engine = spheres(cohesive(cohesion, pair), 0.0, &all);
        run(&mut engine, 60_000, 1e-8);
        assert_eq!(engine.contacts().count, 0, "they have parted");
        let [a, b] = [0, 1].map(|i| engine.particles().particles[i].velocity());
        println!("{cohesion:?}: {} and {} m/s", a.x, b.x);
        assert!((a.x + 0.1).abs() < 2e-4 && (b.x - 0.2).abs() < 2e-4, "{cohesion:?}");
        assert!((a + b - Vec3::x() * 0.1).norm() < 1e-15, "{cohesion:?}");
    }
}

/// Effective radius (m) and modulus (Pa) of two of the spheres; `w` of [`necks`] is 0.05 J/m^2.
fn reduced() -> [f64; 2] {
    [0.5 * RADIUS, super::wall_tests::modulus()]
}

/// Spheres that hold on to each other, without damping.
fn necks() -> ContactModel {
    let pair = PairParams { restitution: 1.0, work_of_adhesion: 0.05, ..MATERIAL.pair };
    cohesive(CohesionLaw::Jkr, pair)
}

/// The energy (J) that a cycle of touching and parting takes, `1.34 pi^2 w a_c^2`: Thornton and Ning (1998), `7.09 (w^5 R^4 / E^2)^(1/3)`.
fn cycle(work: f64, radius: f64, modulus: f64) -> f64 {
    let root = 4.0_f64.cbrt();
    let square = (PI * work * radius * radius / (8.0 * modulus)).cbrt().powi(2);
    PI * work * square * (2.4 * root + 0.4)
}

#[test]
fn an_impact_with_a_neck_takes_the_energy_that_parting_costs_and_below_it_spheres_stick() {
    let [radius, modulus] = reduced();
    let energy = cycle(0.05, radius, modulus);
    assert!(
        (energy / (7.09 * (0.05_f64.powi(5) * radius.powi(4) / modulus.powi(2)).cbrt()) - 1.0).abs() < 1e-3
    );
    let slowest = (2.0 * energy / (0.5 * mass())).sqrt();
    for (speed, parts) in [(0.97, false), (1.03, true), (3.0, true)] {
        let speed = speed * slowest;
        let half = Vec3::x() * (RADIUS + 1e-8);
        let middle = Vec3::repeat(6e-3);
        let all = [(middle - half, Vec3::x() * speed), (middle + half, Vec3::zeros())];
        let mut engine = spheres(necks(), 0.0, &all);
        run(&mut engine, 100_000, 2e-8);
        let [a, b] = [0, 1].map(|i| engine.particles().particles[i].velocity());
        assert_eq!(engine.contacts().count == 0, parts, "{speed}");
        if parts {
            let lost = 0.25 * mass() * (speed * speed - (b.x - a.x).powi(2));
            println!(
                "{:.2} of the slowest: lost {:.5} of the energy of parting",
                speed / slowest,
                lost / energy
            );
            assert!((lost / energy - 1.0).abs() < 5e-3, "{speed}");
        }
        assert!((a + b - Vec3::x() * speed).norm() < 1e-15);
    }
}

#[test]
fn a_sphere_is_held_over_a_gap_only_if_it_has_touched() {
    let gap = 0.9 * 3.0 * (PI * 0.05 * RADIUS * RADIUS / (8.0 * reduced()[1])).cbrt().powi(2) / RADIUS;
    let at = Vec3::new(6e-3, 6e-3, 0.012 - RADIUS - gap);
    let mut engine = spheres(necks(), 0.0, &[(at, Vec3::zeros())]);
    run(&mut engine, 1, DT);
    assert_eq!((engine.contacts().count, first(&engine).contact_force), (0, [0.0; 3]));
    // It touches the ceiling, and is drawn away over the gap.
    let mut engine = spheres(necks(), 0.0, &[(at + Vec3::z() * (gap + 1e-9), Vec3::zeros())]);
    run(&mut engine, 1, 1e-9);
    let bound = engine.save(&Comm::Solo).unwrap();
    let mut held = Saved::load(
        "native",
        &Comm::Solo,
        &SavedParts::divided(&Comm::Solo, &[bound]),
        (&engine.context.near, &engine.context.local, &engine.context.params.walls),
        engine.context.params.memory(),
    )
    .unwrap()
    .state;
    held.particles[0].position = at.into();
    engine.restore(&Comm::Solo, &SavedParts::divided(&Comm::Solo, &[held.write("native")])).unwrap();
    run(&mut engine, 1, DT);
    let [state] = engine.contact_states(&Comm::Solo)[..] else { panic!("one contact") };
    assert!((state.depth + gap).abs() < 1e-15 && state.volume == 0.0, "{state:?}");
    let pull = state.force[2] / (1.5 * PI * 0.05 * RADIUS);
    assert!(pull > 5.0 / 9.0 && pull < 1.0, "{pull}");
    assert_eq!((engine.contacts().count, engine.contacts().begun), (1, 1));
}

#[test]
fn a_sphere_with_a_neck_hangs_from_a_ceiling_up_to_the_force_that_pulls_it_off() {
    let weight = mass() * 9.81;
    for (part, hangs) in [(1.005, true), (0.995, false)] {
        let work_of_adhesion = part * weight / (1.5 * PI * RADIUS);
        let pair = PairParams { restitution: 0.3, work_of_adhesion, ..MATERIAL.pair };
        // The gap at which it hangs is a ninth of the widest one.
        let contact = cohesive(CohesionLaw::Jkr, pair);
        let square = (9.0 * PI * work_of_adhesion * RADIUS * RADIUS / (8.0 * reduced()[1])).cbrt().powi(2);
        let touching = Vec3::new(6e-3, 6e-3, 0.012 - RADIUS + 1e-9);
        let mut engine = spheres(contact, 9.81, &[(touching, Vec3::zeros())]);
        run(&mut engine, 1, 1e-9);
        let (near, local) = (&engine.context.near, &engine.context.local);
        let parts = [engine.save(&Comm::Solo).unwrap()];
        let mut hung = Saved::load(
            "native",
            &Comm::Solo,
            &SavedParts::divided(&Comm::Solo, &parts),
            (near, local, &engine.context.params.walls),
            engine.context.params.memory(),
        )
        .unwrap()
        .state;
        let at = touching - Vec3::z() * (1e-9 + square / (3.0 * RADIUS));
        (hung.particles[0].position, hung.particles[0].velocity) = (at.into(), [0.0; 3]);
        engine.restore(&Comm::Solo, &SavedParts::divided(&Comm::Solo, &[hung.write("native")])).unwrap();
        run(&mut engine, 60_000, DT);
        let fallen = at.z - first(&engine).position[2];
        println!("pull {part} of the weight: fallen {fallen:.2e} m");
        assert_eq!(fallen < 1e-5, hangs, "{part}");
    }
}

/// Sizes of the groups of spheres that hold together, the largest first.
fn groups(engine: &Native) -> Vec<usize> {
    let mut of: Vec<usize> = (0..engine.particles().owned().len()).collect();
    for state in engine.contact_states(&Comm::Solo) {
        let (one, other) = (of[state.first as usize], of[state.second as usize]);
        of.iter_mut().filter(|group| **group == other).for_each(|group| *group = one);
    }
    let mut sizes: Vec<usize> =
        (0..of.len()).map(|group| of.iter().filter(|of| **of == group).count()).collect();
    sizes.sort_unstable_by(|a, b| b.cmp(a));
    sizes.into_iter().take_while(|size| *size > 0).collect()
}

/// A dense agglomerate of 100 spheres in simple shear: a thin fluid that flows through it drags each by `m / T (u - v)`. In its frame, which turns at half the rate of shear `g`,
/// the flow pulls the two halves apart along the diagonal with `sum m g |x| / (2 T)` over one half; the pull-off forces of the contacts across the middle, along
/// the same direction, hold against it.
#[test]
fn an_agglomerate_of_a_hundred_spheres_survives_a_tenth_of_the_shear_of_the_estimate_and_breaks_in_ten_times_it()
 {
    let domain = Domain { faces: Domain::faces([true, true, false]), cells: [40; 3], dx: 1e-3 };
    let (centre, response, dt) = (Vec3::repeat(20e-3), 5e-3, 1e-5);
    let pair = PairParams { restitution: 0.3, work_of_adhesion: 0.05, ..MATERIAL.pair };
    let mut contact = cohesive(CohesionLaw::Jkr, pair);
    contact.friction = crate::contact::FrictionLaw::Mindlin;
    let depth = crate::contact::SpherePair::new(&contact, 0, 2.0 * RADIUS, mass()).static_depth(0.0);
    // The hundred places of a face-centred lattice next to its centre.
    let edge = (2.0 * RADIUS - depth) * 2.0_f64.sqrt();
    let mut places: Vec<Vec3> = (0..4 * 7 * 7 * 7)
        .map(|n| {
            let cell = Vec3::from([n / 4 % 7, n / 28 % 7, n / 196].map(|i| f64::from(i) - 3.0));
            let basis = [[0.0, 0.0, 0.0], [0.0, 0.5, 0.5], [0.5, 0.0, 0.5], [0.5, 0.5, 0.0]];
            (cell + Vec3::from(basis[n as usize % 4]) - Vec3::new(0.11, 0.07, 0.03)) * edge
        })
        .collect();
    places.sort_by(|a, b| a.norm().total_cmp(&b.norm()));
    places.truncate(100);
    let diagonal = Vec3::new(1.0, 0.0, 1.0).normalize();
    let along = |place: &Vec3| place.dot(&diagonal);
    let held: f64 = places
        .iter()
        .enumerate()
        .flat_map(|(n, a)| places[..n].iter().map(move |b| (a, b)))
        .filter(|(a, b)| (*a - *b).norm() < 2.0 * RADIUS && along(a) * along(b) < 0.0)
        .map(|(a, b)| (1.5 * PI * 0.05 * 0.5 * RADIUS) * (along(a) - along(b)).abs() / (a - b).norm())
        .sum();
    let lever: f64 = places.iter().map(|place| along(place).max(0.0)).sum();
    let critical = held * 2.0 * response / (mass() * lever);
    let mut ends = Vec::new();
    for (part, strain) in [(0.1, 1.5), (10.0, 6.0)] {
        let rate = part * critical;
        let all: Vec<Particle> = (0..)
            .zip(&places)
            .map(|(id, place)| {
                let mut sphere = Particle::at(id, 0, centre + place);
                let spin = Vec3::y() * (0.5 * rate);
                (sphere.velocity, sphere.angular_velocity) = (spin.cross(place).into(), spin.into());
                sphere
            })
            .collect();
        let templates: Arc<[Template]> =
            [Template { shape: Arc::new(Sphere { radius: RADIUS }), density: 2500.0, material: 0 }].into();
        let mut engine = alone(domain, contact.clone(), Vec::new(), Vec3::zeros(), templates, &all);
        run(&mut engine, 1, dt);
        assert_eq!(groups(&engine), [100]);
        for _ in 0..(strain / rate / dt) as usize {
            let drag = |sphere: &Particle| {
                let flow = Vec3::x() * (rate * (sphere.position() - centre).z);
                Load { force: (flow - sphere.velocity()) * (mass() / response), torque: Vec3::zeros() }
            };
            let loads: Vec<Load> = engine.particles().owned().iter().map(drag).collect();
            engine.advance(&Comm::Solo, &loads, dt).unwrap();
        }
        let groups = groups(&engine);
        println!("{part} of {critical:.1} 1/s: groups {groups:?}");
        ends.push(groups);
    }
    assert_eq!(ends[0], [100], "it survives");
    assert!(ends[1].len() > 5 && ends[1][0] < 60, "it breaks");
}
