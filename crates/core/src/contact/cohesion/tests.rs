//! Claims about cohesion.

use crate::contact::clip::Plane;
use crate::contact::{
    CohesionLaw, ContactModel, DampingLaw, ElasticLaw, FrictionLaw, Material, PairLaw, PairParams,
    PairProperties, RelativeMotion, SpherePair, sphere_plane, sphere_sphere,
};
use crate::math::Vec3;
use std::f64::consts::PI;

const RADIUS: f64 = 1e-3;
const MASS: f64 = 1e-5;
const PAIR: PairProperties = PairProperties { radii: [RADIUS; 2], masses: [MASS; 2], dt: 1e-7 };
/// Work of adhesion (J/m^2) and density of energy (J/m^3).
const WORK: f64 = 0.05;
const DENSITY: f64 = 3e4;

fn model(cohesion: CohesionLaw, law: ElasticLaw) -> ContactModel {
    ContactModel {
        materials: vec![Material { youngs_modulus: 5e6, poisson_ratio: 0.25 }],
        pairs: vec![PairParams {
            restitution: 1.0,
            friction_static: 0.5,
            friction_kinetic: 0.3,
            transition_velocity: 1e-3,
            work_of_adhesion: WORK,
            cohesion_density: DENSITY,
            ..PairParams::default()
        }],
        law,
        damping: DampingLaw::Tsuji,
        friction: FrictionLaw::NassauerKuna,
        cohesion,
        ..ContactModel::default()
    }
}

/// Force (N) on the first of two spheres along x, which overlap by a depth (m) and slide at a speed (m/s).
fn force(model: &ContactModel, depth: f64, speed: f64) -> Vec3 {
    let (law, offset) = (PairLaw::new(model, 0, 0), Vec3::x() * (2.0 * RADIUS - depth));
    let overlap = sphere_sphere::overlap(RADIUS, RADIUS, offset).unwrap();
    let velocity = Vec3::y() * speed;
    let motion = RelativeMotion { velocity, before: velocity, elapsed: PAIR.dt, ..RelativeMotion::default() };
    law.act(&overlap, offset, &PAIR, &motion, &mut vec![0.0; model.memory()]).force
}

const LAWS: [ElasticLaw; 3] = [ElasticLaw::OverlapVolume, ElasticLaw::OverlapEnergy, ElasticLaw::Hertz];

#[test]
fn spheres_are_pulled_apart_by_the_force_of_derjaguin_muller_and_toporov() {
    for law in LAWS {
        let most = (1..2000)
            .map(|k| force(&model(CohesionLaw::Dmt, law), 1e-9 * f64::from(k), 0.0).x)
            .fold(f64::NEG_INFINITY, f64::max);
        assert!((most / (2.0 * PI * WORK * 0.5 * RADIUS) - 1.0).abs() < 5e-3, "{law:?} {most}");
    }
}

#[test]
fn the_pull_by_density_of_energy_goes_with_the_disc_in_which_spheres_meet() {
    for (law, depth) in LAWS.into_iter().flat_map(|law| [1e-6, 1e-5].map(|depth| (law, depth))) {
        let [with, without] =
            [CohesionLaw::Sjkr, CohesionLaw::None].map(|cohesion| force(&model(cohesion, law), depth, 0.0).x);
        let disc = PI * (RADIUS * RADIUS - (RADIUS - 0.5 * depth).powi(2));
        assert!(((with - without) / (DENSITY * disc) - 1.0).abs() < 1e-9, "{law:?}");
    }
}

#[test]
fn friction_keeps_to_the_force_without_cohesion() {
    for cohesion in [CohesionLaw::Dmt, CohesionLaw::Sjkr] {
        let [with, without] = [cohesion, CohesionLaw::None]
            .map(|cohesion| force(&model(cohesion, ElasticLaw::Hertz), 1e-5, 0.3));
        assert!(with.x > without.x);
        assert_eq!([with.y, with.z].map(f64::to_bits), [without.y, without.z].map(f64::to_bits));
    }
}

#[test]
fn spheres_come_to_rest_at_the_depth_where_the_forces_balance() {
    for (cohesion, load) in
        [CohesionLaw::Dmt, CohesionLaw::Sjkr].into_iter().flat_map(|law| [(law, 0.0), (law, 1e-4)])
    {
        let model = model(cohesion, ElasticLaw::Hertz);
        let depth = SpherePair::new(&model, 0, 2.0 * RADIUS, MASS).static_depth(load);
        let out_of_balance = force(&model, depth, 0.0).x + load;
        let pull = force(&model, depth, 0.0).x
            + force(&self::model(CohesionLaw::None, ElasticLaw::Hertz), depth, 0.0).x.abs();
        assert!(
            depth > 1e-7 && out_of_balance.abs() < 0.02 * pull,
            "{cohesion:?} {load}: {depth} {out_of_balance}"
        );
    }
}

#[test]
fn cohesion_alone_presses_spheres_and_walls_to_the_depth_that_a_case_is_refused_for() {
    let walls = PairProperties { radii: [RADIUS, f64::INFINITY], masses: [MASS, f64::INFINITY], ..PAIR };
    for cohesion in [CohesionLaw::Dmt, CohesionLaw::Sjkr] {
        let model = model(cohesion, ElasticLaw::Hertz);
        for pair in [PAIR, walls] {
            let depth = model.cohesive_depth([0, 0], pair.radii);
            let apart = pair.radii.iter().filter(|radius| radius.is_finite()).sum::<f64>() - depth;
            let overlap = if pair == PAIR {
                sphere_sphere::overlap(RADIUS, RADIUS, Vec3::x() * apart)
            } else {
                sphere_plane::overlap(RADIUS, &Plane { normal: -Vec3::x(), offset: -apart })
            };
            let (overlap, offset) = (overlap.unwrap(), Vec3::x() * apart);
            let motion = RelativeMotion { elapsed: PAIR.dt, ..RelativeMotion::default() };
            let of = |model: &ContactModel| {
                let mut memory = vec![0.0; model.memory()];
                PairLaw::new(model, 0, 0).act(&overlap, offset, &pair, &motion, &mut memory).force.x
            };
            let elastic = of(&self::model(CohesionLaw::None, ElasticLaw::Hertz));
            assert!(depth > 1e-7 && (of(&model) / elastic).abs() < 0.01, "{cohesion:?} {depth}");
        }
        let without = self::model(CohesionLaw::None, ElasticLaw::Hertz).cohesive_depth([0, 0], PAIR.radii);
        assert!(without.abs() < f64::MIN_POSITIVE);
    }
}
