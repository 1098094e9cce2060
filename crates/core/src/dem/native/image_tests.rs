//! Claims about boxes so narrow that a body meets several images of another, and its own.

use super::cube_tests::cubes;
use super::tests::advance;
use super::wall_tests::MATERIAL;
use super::*;
use crate::comm::on_threads;
use crate::contact::lubrication::Unresolved;
use crate::contact::{FrictionLaw, Lubrication};
use crate::math::Quat;
use crate::shape::composite::tests::dumbbell;
use crate::shape::{Cuboid, Cylinder, Sphere, Through};

/// Bodies that overlap their images a little in a box of this many metres.
const DX: f64 = 0.2475e-3;
const EDGE: f64 = 8.0 * DX;
const RADIUS: f64 = 1e-3;
const DT: f64 = 1e-6;

fn templates() -> Arc<[Template]> {
    let of = |shape| Template { shape, density: 2500.0, material: 0 };
    [
        of(Arc::new(Sphere { radius: RADIUS })),
        of(dumbbell(0.5 * RADIUS)),
        cubes(1.4e-3)[0].clone(),
        of(Arc::new(Sphere { radius: 0.98 * RADIUS })),
    ]
    .into()
}

fn params(lubricated: bool) -> NativeParams {
    let mut contact = ContactModel { friction: FrictionLaw::Mindlin, ..MATERIAL.into() };
    if lubricated {
        let unresolved = Unresolved { range: 0.5, ..Unresolved::saturated() };
        contact = MATERIAL.into();
        contact.lubrication = Some(Lubrication { viscosity: 1.0, roughness: 1e-6, cell: DX, unresolved });
    }
    NativeParams { contact: Some(contact), substeps: 1, ..NativeParams::default() }
}

fn body(id: u64, template: usize, position: [f64; 3], velocity: [f64; 3], spin: [f64; 3]) -> Particle {
    let mut body = Particle::at(id, template, Vec3::from(position) * EDGE);
    (body.velocity, body.angular_velocity) = (velocity, spin);
    body
}

/// Bodies that fill a box of `long` edges in x; all drift through its faces.
fn scenes() -> [(&'static str, f64, bool, Vec<Particle>); 5] {
    let drift = [1.0, -0.7, 0.4];
    let spin = [60.0, -40.0, 20.0];
    // With films a little apart, and so slow that they stay so.
    let row = |lubricated| {
        let (template, speed) = if lubricated { (3, 0.02) } else { (0, 0.08) };
        let (one, other) = ([1.0 + speed, -0.7, 0.4], [1.0 - speed, -0.7, 0.4]);
        let bodies = vec![
            body(0, template, [0.5, 0.01, 0.99], one, spin),
            body(1, template, [1.5, 0.01, 0.99], other, [-30.0, 50.0, 10.0]),
        ];
        ("a row of two spheres", 2.0, lubricated, bodies)
    };
    let mut dumbbell = body(0, 1, [0.99, 0.5, 0.5], drift, spin);
    dumbbell.set_orientation(&Quat::from_scaled_axis(Vec3::new(0.0, -0.03, 0.04)));
    let mut cube = body(0, 2, [0.99, 0.5, 0.01], drift, [0.0, 10.0, 20.0]);
    cube.set_orientation(&Quat::from_scaled_axis(Vec3::new(0.01, 0.02, 0.785)));
    [
        ("a sphere", 1.0, false, vec![body(0, 0, [0.99, 0.5, 0.01], drift, spin)]),
        row(false),
        row(true),
        ("a dumbbell", 1.0, false, vec![dumbbell]),
        ("a sphere beside a cube", 2.0, false, vec![body(4, 0, [1.99, 0.5, 0.01], drift, spin), cube]),
    ]
}

/// A box of `long` edges in x, `copies` of it in each direction, and the bodies in all of them.
fn copied(long: f64, copies: usize, bodies: &[Particle]) -> (Domain, Vec<Particle>) {
    let edges = [long as usize * 8, 8, 8];
    let domain = Domain { faces: Domain::faces([true; 3]), cells: edges.map(|n| copies * n), dx: DX };
    let mut all = Vec::new();
    for n in 0..copies.pow(3) {
        let cell = [n % copies, n / copies % copies, n / copies / copies];
        let shift = Vec3::from_fn(|i, _| (cell[i] * edges[i]) as f64 * DX);
        all.extend(bodies.iter().map(|body| {
            let mut copy = *body;
            copy.id += 10 * n as u64;
            copy.position = domain.wrap(body.position() + shift).into();
            copy
        }));
    }
    (domain, all)
}

/// Owned particles after `steps`, ascending by id, and contacts begun.
fn run(
    (domain, all): &(Domain, Vec<Particle>),
    lubricated: bool,
    ranks: usize,
    steps: usize,
) -> (Vec<Particle>, u64) {
    let cut = Decomposition::new(*domain, ranks).unwrap();
    let parts = on_threads(ranks, |comm| {
        let mut engine = Native::new(params(lubricated), cut.clone(), comm.rank(), templates(), all).unwrap();
        (0..steps).for_each(|_| advance(&mut engine, &comm, DT).unwrap());
        (engine.particles().owned().to_vec(), engine.contacts().begun)
    });
    let begun = parts.iter().map(|part| part.1).sum();
    let mut particles: Vec<Particle> = parts.into_iter().flat_map(|part| part.0).collect();
    particles.sort_by_key(|particle| particle.id);
    (particles, begun)
}

#[test]
fn bodies_in_a_narrow_box_move_as_their_copies_in_a_box_three_times_as_wide() {
    for (what, long, lubricated, bodies) in scenes() {
        let (one, many) = (copied(long, 1, &bodies), copied(long, 3, &bodies));
        let (alone, begun) = run(&one, lubricated, 1, 400);
        let (copies, begun_there) = run(&many, lubricated, 1, 400);
        assert_eq!(begun_there, 27 * begun, "{what}");
        let started = run(&one, lubricated, 1, 0).0;
        for (particle, start) in alone.iter().zip(started) {
            let changed = (particle.angular_velocity() - start.angular_velocity()).norm();
            println!("{what}: turning changed by {changed:.1} 1/s, {begun} contacts");
            assert!(changed > 0.1);
            for copy in copies.iter().filter(|copy| copy.id % 10 == particle.id) {
                let apart = one.0.nearest_image(one.0.wrap(copy.position()) - particle.position());
                assert!(apart.norm() < 1e-9 * RADIUS, "{what}: {apart}");
                assert!((copy.velocity() - particle.velocity()).norm() < 1e-9, "{what}");
                let spins = [copy, particle].map(Particle::angular_velocity);
                assert!((spins[0] - spins[1]).norm() < 1e-7 * changed.max(1.0), "{what}: {spins:?}");
            }
        }
    }
}

#[test]
fn a_narrow_box_gives_the_same_bits_on_1_to_8_ranks_and_when_it_is_saved_and_resumed_on_others() {
    for (what, long, lubricated, bodies) in scenes() {
        let system = copied(long, 1, &bodies);
        let expected = run(&system, lubricated, 1, 400);
        for ranks in [2, 4, 8] {
            assert_eq!(run(&system, lubricated, ranks, 400), expected, "{what} on {ranks} ranks");
        }
        let engine = |comm: &Comm| {
            let cut = Decomposition::new(system.0, comm.size()).unwrap();
            Native::new(params(lubricated), cut, comm.rank(), templates(), &system.1).unwrap()
        };
        let saved = on_threads(2, |comm| {
            let mut engine = engine(&comm);
            (0..150).for_each(|_| advance(&mut engine, &comm, DT).unwrap());
            engine.save(&Comm::Solo).unwrap()
        });
        let resumed = on_threads(4, |comm| {
            let mut engine = engine(&comm);
            engine.restore(&comm, &SavedParts::divided(&comm, &saved)).unwrap();
            (0..250).for_each(|_| advance(&mut engine, &comm, DT).unwrap());
            engine.particles().owned().to_vec()
        });
        let mut resumed = resumed.concat();
        resumed.sort_by_key(|particle| particle.id);
        assert_eq!(resumed, expected.0, "{what}");
    }
}

#[test]
fn a_sphere_that_touches_its_own_images_feels_no_force_and_only_loses_its_spin() {
    let (_, _, _, bodies) = scenes()[0].clone();
    let (domain, all) = copied(1.0, 1, &bodies);
    let cut = Decomposition::new(domain, 1).unwrap();
    let mut engine = Native::new(params(false), cut, 0, templates(), &all).unwrap();
    let start = engine.particles().particles[0];
    let (whole, mut least) = (start.angular_velocity().norm(), f64::INFINITY);
    for _ in 0..400 {
        advance(&mut engine, &Comm::Solo, DT).unwrap();
        let sphere = engine.particles().particles[0];
        assert_eq!((sphere.velocity, sphere.contact_force), (start.velocity, [0.0; 3]));
        let spin = sphere.angular_velocity().norm();
        // Springs of friction give some of it back.
        assert!(spin <= whole, "{spin}");
        least = spin.min(least);
    }
    assert!(least < 0.9 * whole, "{least} of {whole}");
    let states = engine.contact_states(&Comm::Solo);
    let shifts: Vec<[i8; 3]> = states.iter().map(|state| state.key().shift()).collect();
    assert_eq!(shifts, [[1, 0, 0], [0, 1, 0], [0, 0, 1]]);
    assert_eq!((engine.contacts().count, engine.contacts().begun, engine.records().len()), (3, 3, 3));
    let centre = Vec3::from(engine.particles().particles[0].position);
    for state in &states {
        let shift = Vec3::from(state.key().shift().map(f64::from));
        assert!((state.first, state.second) == (0, 0) && (Vec3::from(state.normal) - shift).norm() < 1e-12);
        let [first, second] = state.levers(&domain, [centre; 2]);
        assert!((first - second - shift * EDGE).norm() < 1e-12, "{first} {second}");
    }
}

#[test]
fn a_box_too_narrow_for_the_images_that_the_engine_looks_at_is_refused_in_words() {
    let cells = [8, 5, 8];
    let narrow = Decomposition::new(Domain { faces: Domain::faces([true; 3]), cells, dx: DX }, 1).unwrap();
    let at = |template| [Particle::at(0, template, Vec3::zeros())];
    let refused = Native::new(params(false), narrow.clone(), 0, templates(), &at(0)).unwrap_err().to_string();
    assert!(refused.contains("too narrow for the periodic images"), "{refused}");
    let dry = NativeParams { contact: None, ..params(false) };
    assert!(Native::new(dry, narrow, 0, templates(), &at(0)).is_ok(), "without contacts any may be");
}

#[test]
fn a_sphere_meets_a_body_that_goes_through_the_box_once_and_alike_wherever_it_is_along_it() {
    let cylinder: Arc<dyn Shape> = Arc::new(Cylinder::new(RADIUS, 24.0 * DX).unwrap());
    let prism: Arc<dyn Shape> = Arc::new(Cuboid::new(Vec3::new(2.0 * RADIUS, 1.6e-3, 24.0 * DX)).unwrap());
    for (piece, precision) in [(cylinder, 4e-3), (prism, 1e-9)] {
        let of = |shape| Template { shape, density: 2500.0, material: 0 };
        let long: Arc<dyn Shape> = Arc::new(Through::new(piece, 2, Vec3::z()).unwrap());
        let templates: Arc<[Template]> = [of(long), of(Arc::new(Sphere { radius: 0.5 * RADIUS }))].into();
        let domain = Domain { faces: Domain::faces([true; 3]), cells: [16, 16, 24], dx: DX };
        let cut = Decomposition::new(domain, 1).unwrap();
        let motions = vec![PrescribedMotion::fixed(), PrescribedMotion::default()];
        let params = NativeParams { motions, ..params(false) };
        let force = |z: f64| {
            let body = |id, template, position| Particle::at(id, template, domain.wrap(position));
            let middle = Vec3::new(0.1e-3, 2e-3, 1.1e-3);
            let all = [body(0, 0, middle), body(1, 1, middle + Vec3::new(-1.49 * RADIUS, 0.0, z))];
            let mut engine = Native::new(params.clone(), cut.clone(), 0, templates.clone(), &all).unwrap();
            advance(&mut engine, &Comm::Solo, DT).unwrap();
            let states = engine.contact_states(&Comm::Solo);
            assert_eq!((states.len(), engine.contacts().count), (1, 1), "{z}");
            Vec3::from(states[0].force)
        };
        let here = force(0.0);
        assert!(here.x.abs() > 0.999 * here.norm() && here.norm() > 0.0, "{here}");
        for z in [1e-3, 2.9e-3, 12.0 * DX, 3e-3, 5.5e-3] {
            let there = force(z);
            assert!((there - here).norm() < precision * here.norm(), "{z}: {there} {here}");
        }
    }
}
