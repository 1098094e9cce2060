//! LIGGGHTS behind the engine trait, in processes of its own: motion, contacts, saving, and every way to fail.
#![cfg(feature = "liggghts")]

use std::path::PathBuf;
use std::sync::Arc;
use turbid::comm::Comm;
use turbid::contact::{ContactModel, ContactParams, DampingLaw, ElasticLaw, Geometry, Material, PairParams};
use turbid::dem::{DemEngine, Liggghts, LiggghtsParams, Load};
use turbid::domain::{Decomposition, Domain};
use turbid::math::Vec3;
use turbid::particle::{Particle, Template};
use turbid::shape::Sphere;

/// Radius of all spheres (m).
const RADIUS: f64 = 0.5e-3;

/// A periodic box of 16 diameters.
const DOMAIN: Domain = Domain {
    periodic: [true; 3],
    cells: [32; 3],
    dx: RADIUS,
};

fn contact(youngs_modulus: f64, restitution: f64, friction: f64) -> ContactModel {
    ContactParams {
        material: Material {
            youngs_modulus,
            poisson_ratio: 0.22,
        },
        pair: PairParams {
            restitution,
            friction_static: friction,
            friction_kinetic: friction,
            transition_velocity: 1e-6,
        },
        enlargement: 0.0,
        geometry: Geometry::Exact,
        law: ElasticLaw::Hertz,
        damping: DampingLaw::Tsuji,
    }
    .into()
}

fn params(contact: Option<ContactModel>) -> LiggghtsParams {
    LiggghtsParams {
        contact,
        substeps: 1,
        program: Some(PathBuf::from(env!("CARGO_BIN_EXE_turbid"))),
        ..LiggghtsParams::default()
    }
}

fn templates() -> Arc<[Template]> {
    Arc::new([Template {
        shape: Arc::new(Sphere { radius: RADIUS }),
        density: 2500.0,
        material: 0,
    }])
}

fn engine(params: LiggghtsParams, all: &[Particle]) -> turbid::Result<Liggghts> {
    let cut = Decomposition::new(DOMAIN, 1).unwrap();
    Liggghts::new(params, cut, &Comm::Solo, templates(), all)
}

fn moving(id: u64, position: [f64; 3], velocity: [f64; 3]) -> Particle {
    let mut particle = Particle::at(id, 0, Vec3::from(position));
    particle.velocity = velocity;
    particle
}

/// Three spheres that meet obliquely, one of them through the face x = 0.
fn three() -> Vec<Particle> {
    let (d, l) = (2.0 * RADIUS, 16e-3);
    vec![
        moving(3, [0.1 * d, 0.5 * l, 0.5 * l], [0.0, 0.1, 0.0]),
        moving(10, [1.05 * d, 0.5 * l, 0.5 * l], [-0.2, 0.0, 0.05]),
        moving(12, [l - 0.88 * d, 0.5 * l, 0.51 * l], [0.3, 0.0, 0.0]),
    ]
}

const REST: Load = Load {
    force: Vec3::new(0.0, 0.0, 0.0),
    torque: Vec3::new(0.0, 0.0, 0.0),
};

#[test]
fn asking_for_contacts_and_saving_do_not_disturb_the_motion_and_what_is_saved_goes_on_as_before() {
    let run = |ask: bool, split: bool| {
        let mut lgg = engine(params(Some(contact(1e7, 0.7, 0.3))), &three()).unwrap();
        let (mut seen, mut touching) = (0, 0);
        for step in 0..1000 {
            lgg.advance(&Comm::Solo, &[REST; 3], 1e-6).unwrap();
            if ask {
                seen += lgg.contact_states().len();
            }
            touching += usize::from(lgg.contacts().count > 0);
            if split && touching == 20 {
                println!("{step}");
                touching += 1;
                let saved = lgg.save().unwrap();
                lgg = engine(params(Some(contact(1e7, 0.7, 0.3))), &three()).unwrap();
                lgg.restore(&Comm::Solo, &[saved]).unwrap();
            }
        }
        println!("{seen} {:?}", lgg.contacts());
        lgg.particles().owned().to_vec()
    };
    let plain = run(false, false);
    assert_eq!(plain, run(true, false));
    let resumed = run(false, true);
    for (a, b) in plain.iter().zip(&resumed) {
        println!("{:?}\n{:?}", a.velocity, b.velocity);
        println!("{:?}\n{:?}", a.angular_velocity, b.angular_velocity);
    }
    assert_eq!(plain, resumed);
}
