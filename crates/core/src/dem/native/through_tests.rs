//! Claims about bodies that go through the box and move freely: discs and prisms of a flow in the plane.

use super::tests::advance;
use super::wall_tests::{MATERIAL, plane};
use super::*;
use crate::comm::on_threads;
use crate::contact::{FrictionLaw, PairParams};
use crate::math::Quat;
use crate::shape::{Cuboid, Cylinder, Through};

const DX: f64 = 0.25e-3;
const RADIUS: f64 = 0.8e-3;
const DT: f64 = 2e-6;

fn templates() -> Arc<[Template]> {
    let length = 8.0 * DX;
    let of = |piece: Arc<dyn Shape>| {
        let shape = Through::new(piece, 2, Vec3::z()).unwrap();
        Template { shape: Arc::new(shape), density: 2500.0, material: 0 }
    };
    [
        of(Arc::new(Cylinder::new(RADIUS, length).unwrap())),
        of(Arc::new(Cuboid::new(Vec3::new(1.3e-3, 0.9e-3, length)).unwrap())),
    ]
    .into()
}

/// Nine bodies in a box of 24 by 24 by 8 cells that collide with each other and with a floor and a ceiling in y.
fn crowd(ranks: usize) -> (Vec<Particle>, u64) {
    let domain = Domain { faces: Domain::faces([true, false, true]), cells: [24, 24, 8], dx: DX };
    let cut = Decomposition::new(domain, ranks).unwrap();
    let bodies: Vec<Particle> = (0..9_u64)
        .map(|id| {
            let [i, j] = [id % 3, id / 3].map(|n| n as f64);
            let at =
                Vec3::new(0.02e-3 + 2e-3 * i, 1e-3 + 2e-3 * j, domain.size().z * (0.07 + 0.1 * id as f64));
            let mut body = Particle::at(id, (id % 2) as usize, domain.wrap(at));
            body.velocity = [1.0 - 0.9 * i + 0.3 * j, 0.8 * j - 1.1 + 0.2 * i, 0.0];
            body.angular_velocity = [0.0, 0.0, 200.0 * (i - j)];
            body.set_orientation(&Quat::from_scaled_axis(Vec3::z() * (0.4 * id as f64)));
            body
        })
        .collect();
    let contact = ContactModel { friction: FrictionLaw::Mindlin, ..MATERIAL.into() };
    let params = NativeParams {
        contact: Some(contact),
        substeps: 1,
        walls: vec![plane("y-", Vec3::zeros(), Vec3::y()), plane("y+", domain.size(), -Vec3::y())],
        ..NativeParams::default()
    };
    let parts = on_threads(ranks, |comm| {
        let mut engine = Native::new(params.clone(), cut.clone(), comm.rank(), templates(), &bodies).unwrap();
        (0..3000).for_each(|_| advance(&mut engine, &comm, DT).unwrap());
        (engine.particles().owned().to_vec(), engine.contacts().begun)
    });
    let begun = parts.iter().map(|part| part.1).sum();
    let mut particles: Vec<Particle> = parts.into_iter().flat_map(|part| part.0).collect();
    particles.sort_by_key(|particle| particle.id);
    (particles, begun)
}

#[test]
fn discs_and_prisms_stay_in_their_plane_and_upright_with_the_same_bits_on_1_2_and_4_ranks() {
    let (alone, begun) = crowd(1);
    assert!(begun > 30, "{begun}");
    for ranks in [2, 4] {
        let (shared, again) = crowd(ranks);
        assert_eq!(begun, again, "{ranks} ranks");
        assert_eq!(bytemuck::cast_slice::<_, u8>(&alone), bytemuck::cast_slice::<_, u8>(&shared));
    }
    for body in &alone {
        let [x, y, z] = body.angular_velocity;
        assert!(x.abs().max(y.abs()) < 1e-9 * z.abs().max(1.0), "{body:?}");
        assert!(body.velocity[2].abs() < f64::MIN_POSITIVE);
        assert!((body.orientation() * Vec3::z() - Vec3::z()).norm() < 1e-9);
    }
}

#[test]
fn discs_rebound_from_each_other_with_their_coefficient_of_restitution() {
    let domain = Domain { faces: Domain::faces([true; 3]), cells: [32, 16, 8], dx: DX };
    let cut = Decomposition::new(domain, 1).unwrap();
    let mut contact: ContactModel = MATERIAL.into();
    contact.pairs = vec![PairParams { restitution: 0.7, ..contact.pairs[0] }];
    let params = NativeParams { contact: Some(contact), substeps: 1, ..NativeParams::default() };
    let body = |id, x: f64, z: f64, speed: f64| {
        let mut body = Particle::at(id, 0, Vec3::new(x, 2e-3, z));
        body.velocity = [speed, 0.0, 0.0];
        body
    };
    let pair = [body(0, 3e-3, 0.1e-3, 0.05), body(1, 4.65e-3, 1.9e-3, -0.05)];
    let mut engine = Native::new(params, cut, 0, templates(), &pair).unwrap();
    (0..4000).for_each(|_| advance(&mut engine, &Comm::Solo, DT).unwrap());
    let [a, b] = [0, 1].map(|k| engine.particles().owned()[k].velocity());
    assert_eq!((engine.contacts().begun, engine.contacts().count), (1, 0));
    assert!((a + b).norm() < 1e-15, "{a} {b}");
    assert!(((b - a).x / 0.1 - 0.7).abs() < 0.02, "{}", (b - a).x / 0.1);
}
