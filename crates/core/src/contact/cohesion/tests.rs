//! Claims about cohesion.

use crate::contact::clip::Plane;
use crate::contact::{
    CohesionLaw, ContactModel, DampingLaw, ElasticLaw, FrictionLaw, Material, Overlap, PairLaw, PairParams,
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

/// [`model`] of Johnson, Kendall and Roberts.
fn jkr() -> ContactModel {
    model(CohesionLaw::Jkr, ElasticLaw::Hertz)
}

/// Pull (N) between two spheres with an overlap of this depth (m), or a gap where it is negative.
fn neck(model: &ContactModel, depth: f64, speed: f64) -> Vec3 {
    let offset = Vec3::x() * (2.0 * RADIUS - depth);
    let overlap = Overlap::neck(offset * 0.5, Vec3::x(), depth);
    let velocity = Vec3::y() * speed;
    let motion = RelativeMotion { velocity, before: velocity, elapsed: PAIR.dt, ..RelativeMotion::default() };
    let mut memory = vec![0.0; model.memory()];
    PairLaw::new(model, 0, 0).act(&overlap, offset, &PAIR, &motion, &mut memory).force
}

#[test]
fn the_neck_of_two_spheres_pulls_as_johnson_kendall_and_roberts_have_it() {
    let law = PairLaw::new(&jkr(), 0, 0);
    let (radius, widest) = (PAIR.radius(), law.cohesion.stretch(PAIR.radius()));
    let pull_off = 1.5 * PI * WORK * radius;
    let most = (0..=20_000)
        .map(|k| neck(&jkr(), widest * (1e-4 * f64::from(k) - 1.0), 0.0).x)
        .fold(f64::NEG_INFINITY, f64::max);
    assert!((most / pull_off - 1.0).abs() < 1e-6, "{most} of {pull_off}");
    // Where they part, and where they first touch.
    for (depth, part) in [(-widest, 5.0 / 9.0), (0.0, 8.0 / 9.0)] {
        assert!((neck(&jkr(), depth, 0.0).x / (part * pull_off) - 1.0).abs() < 1e-6, "{depth}");
    }
    // An overlap and a neck of one depth have one force.
    let (one, other) = (neck(&jkr(), 1e-6, 0.0).x, force(&jkr(), 1e-6, 0.0).x);
    assert!((one / other - 1.0).abs() < 1e-9, "{one} {other}");
}

#[test]
fn the_disc_of_a_neck_is_that_of_its_depth_from_where_spheres_part_to_where_cohesion_is_nothing() {
    for work in [1e-200, 1e-12, 1e-3, 1.0] {
        let mut model = jkr();
        model.pairs[0].work_of_adhesion = work;
        let law = PairLaw::new(&model, 0, 0);
        let (radius, widest) = (1e-3, law.cohesion.stretch(1e-3));
        for depth in (-40..60).map(|k| widest * 0.025 * f64::from(k)).chain([1e-7, 1e-5, 1e-4]) {
            let square = law.cohesion.pressed(depth, radius) * radius;
            let back = square / radius - (2.0 * PI * work / law.modulus * square.sqrt()).sqrt();
            assert!((back - depth).abs() <= 1e-13 * (square / radius), "{work}: {depth} {back}");
        }
    }
    let [without, hertz] = [0.0, 1e-5].map(|depth| {
        PairLaw::new(&model(CohesionLaw::None, ElasticLaw::Hertz), 0, 0).cohesion.pressed(depth, 1e-3)
    });
    assert_eq!([without, hertz].map(f64::to_bits), [0.0, 1e-5_f64].map(f64::to_bits));
}

#[test]
fn friction_of_a_neck_is_limited_by_its_force_and_twice_that_which_pulls_it_off() {
    let pull_off = 1.5 * PI * WORK * PAIR.radius();
    for depth in [-1e-7, 1e-6, 1e-5] {
        let force = neck(&jkr(), depth, 0.3);
        // Far beyond the speed of transition the coefficient is the kinetic one.
        let limit = 0.3 * (2.0 * pull_off - force.x);
        assert!((force.y / -limit - 1.0).abs() < 1e-2, "{depth}: {} for {limit}", force.y);
    }
}

#[test]
fn spheres_with_a_neck_come_to_rest_under_a_load_where_the_forces_balance() {
    for load in [0.0, 1e-4, 1e-2] {
        let depth = SpherePair::new(&jkr(), 0, 2.0 * RADIUS, MASS).static_depth(load);
        let out_of_balance = neck(&jkr(), depth, 0.0).x + load;
        assert!(
            depth > 1e-7 && out_of_balance.abs() < 1e-9 * (load + 1e-4),
            "{load}: {depth} {out_of_balance}"
        );
    }
    let walls = [RADIUS, f64::INFINITY];
    assert!(jkr().cohesive_depth([0, 0], walls) > jkr().cohesive_depth([0, 0], [RADIUS; 2]));
}

#[test]
fn a_pair_of_materials_without_work_of_adhesion_has_the_law_of_the_model_and_no_neck() {
    let mut model = model(CohesionLaw::Jkr, ElasticLaw::OverlapVolume);
    assert_eq!(PairLaw::new(&model, 0, 0).elastic, ElasticLaw::Hertz);
    assert!(model.stretch(RADIUS) > 0.0);
    model.pairs[0].work_of_adhesion = 0.0;
    assert_eq!(PairLaw::new(&model, 0, 0).elastic, ElasticLaw::OverlapVolume);
    assert_eq!(model.stretch(RADIUS).to_bits(), 0);
}
