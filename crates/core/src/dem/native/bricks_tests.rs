//! Claims about bodies that are not spheres: sampled contacts, unequal moments of inertia.

use super::*;
use crate::comm::on_threads;
use crate::contact::{ContactParams, DampingLaw, ElasticLaw, Geometry, Material, PairParams};
use crate::domain::Domain;
use crate::math::Quat;
use crate::shape::Cuboid;

const BOX: Domain = Domain { faces: Domain::faces([true; 3]), cells: [12, 12, 12], dx: 1e-3 };

fn engine(samples: u32, ranks: usize, rank: usize, all: &[Particle]) -> Native {
    let contact = ContactParams {
        material: Material { youngs_modulus: 5e6, poisson_ratio: 0.25 },
        pair: PairParams {
            restitution: 0.7,
            friction_static: 0.32,
            friction_kinetic: 0.16,
            transition_velocity: 1e-3,
            rolling_friction: 0.0,
            work_of_adhesion: 0.0,
            cohesion_density: 0.0,
        },
        enlargement: 0.05e-3,
        geometry: Geometry::Sampled { samples },
        law: ElasticLaw::OverlapVolume,
        damping: DampingLaw::HuntCrossley,
    };
    let params = NativeParams { contact: Some(contact.into()), substeps: 1, ..NativeParams::default() };
    let templates = [Template {
        shape: Arc::new(Cuboid::new(Vec3::new(1.7e-3, 1.2e-3, 1.0e-3)).unwrap()),
        material: 0,
        density: 2500.0,
    }];
    let cut = Decomposition::new(BOX, ranks).unwrap();
    Native::new(params, cut, rank, templates.into(), all).unwrap()
}

fn run(engine: &mut Native, comm: &Comm, steps: usize, dt: f64) {
    for _ in 0..steps {
        let loads = vec![Load::default(); engine.particles().owned];
        engine.advance(comm, &loads, dt).unwrap();
    }
}

/// Layers of bricks, turned and thrown through the corners of the box.
fn wall() -> Vec<Particle> {
    (0..6 * 6 * 3_u64)
        .map(|n| {
            let wave = |k: u64| ((n * k % 37) as f64 / 18.0 - 1.0) * 0.5;
            let place = Vec3::new((n % 6) as f64, (n / 6 % 6) as f64, (n / 36) as f64 * 1.2) * 2e-3;
            let mut particle = Particle::at(n, 0, BOX.wrap(place));
            let turn = Vec3::new(wave(3), wave(5), wave(11));
            particle.set_orientation(&integrator::turned(&Quat::identity(), turn, 1.0));
            particle.velocity = [8.0 + wave(7), wave(13) - 5.0, 6.0 + wave(17)];
            particle.angular_velocity = [300.0 * wave(19), 300.0 * wave(23), 300.0 * wave(29)];
            particle
        })
        .collect()
}

#[test]
fn tumbling_bricks_move_to_the_same_bits_on_1_3_and_8_ranks() {
    let all = wall();
    let tumbled = |ranks: usize| {
        let results = on_threads(ranks, |comm| {
            let mut engine = engine(3, ranks, comm.rank(), &all);
            run(&mut engine, &comm, 20, 2.5e-5);
            let owned = engine.particles().owned().to_vec();
            (owned, engine.contacts().begun)
        });
        let begun: u64 = results.iter().map(|(_, begun)| begun).sum();
        let mut together: Vec<Particle> = results.into_iter().flat_map(|(owned, _)| owned).collect();
        together.sort_unstable_by_key(|p| p.id);
        (bytemuck::cast_slice::<Particle, u8>(&together).to_vec(), begun)
    };
    let (alone, begun) = tumbled(1);
    assert!(begun > 50, "they do touch: {begun}");
    for ranks in [3, 8] {
        assert!(tumbled(ranks) == (alone.clone(), begun), "{ranks} ranks differ");
    }
}

#[test]
fn an_oblique_impact_of_two_bricks_conserves_angular_momentum() {
    let middle = Vec3::repeat(6e-3);
    let offset = Vec3::new(1.15e-3, 0.5e-3, 0.2e-3);
    let mut pair = [Particle::at(0, 0, middle - offset), Particle::at(1, 0, middle + offset)];
    pair[0].velocity = [0.2, 0.0, 0.0];
    pair[1].velocity = [-0.1, 0.02, 0.0];
    pair[0].angular_velocity = [20.0, 5.0, -30.0];
    let angular = |engine: &Native| -> Vec3 {
        let store = engine.particles();
        let of = |p: &Particle| {
            let orbital = (p.position() - middle).cross(&p.velocity()) * store.template(p).mass();
            orbital + Vec3::from(p.angular_momentum)
        };
        store.particles.iter().map(of).sum()
    };
    let mut engine = engine(5, 1, 0, &pair);
    let before = angular(&engine);
    run(&mut engine, &Comm::Solo, 200, 2.5e-5);
    let contacts = engine.contacts();
    assert!(contacts.begun > 0 && contacts.count == 0, "met and parted: {contacts:?}");
    assert!((angular(&engine) - before).norm() < 1e-12 * before.norm());
    let spin = engine.particles().particles[1].angular_velocity();
    assert!(spin.norm() > 1.0, "the second one turns");
}
