use super::*;
use crate::case;
use crate::contact::{DampingLaw, Material, PairParams};
use std::path::Path;

/// Walls that move, in a fluid; no fluid; a shape from a file. A value that changes makes every checkpoint and every finished
/// run of a study one of another set-up: raise `FORMAT` of the checkpoints, and say so in the changelog.
const GOLDEN: [(&str, &str); 3] = [
    ("shear_cell", "6c82c7c41371264d"),
    ("dry_box", "42a64c9246922edb"),
    ("stl_particles", "e98e2943ba8128c0"),
];

#[test]
fn the_identity_of_a_case_depends_on_its_numbers_and_on_no_name_in_the_program() {
    let cases = Path::new(env!("CARGO_MANIFEST_DIR")).join("cases");
    let found = GOLDEN.map(|(name, _)| {
        let path = cases.join(name).with_extension("toml");
        let setup = case::outline(&path, &[]).unwrap_or_else(|e| panic!("{e}"));
        (name, setup_hash(&setup))
    });
    assert_eq!(found, GOLDEN.map(|(name, hash)| (name, hash.to_string())));
}

#[test]
fn the_friction_that_was_the_only_one_has_the_identity_from_before_there_was_another() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("cases/shear_cell.toml");
    let setup = case::outline(&path, &["contact.friction=nassauer_kuna".to_string()]).unwrap();
    assert_eq!(setup_hash(&setup), "6e458145cc6f1a02");
}

#[test]
fn the_hash_depends_on_the_physics_and_not_on_the_run_plan() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("cases/shear_cell.toml");
    let hash = |option: &str| setup_hash(&case::outline(&path, &[option.to_string()]).unwrap());
    let as_it_is = hash("run.threads=1");
    for plan in ["run.threads=2", "run.end.steps=7", "output.series_every.steps=3"] {
        assert_eq!(hash(plan), as_it_is, "{plan}");
    }
    for physics in [
        "driving.gravity=1",
        "contact.geometry=sampled",
        "contact.restitution=0.8",
        "contact.substeps=2",
        "particles.1.density=1001",
        "particles.1.motion=fixed",
    ] {
        assert_ne!(hash(physics), as_it_is, "{physics}");
    }
}

#[test]
fn the_names_of_the_contact_model_are_these() {
    let mut model = ContactModel {
        materials: vec![Material { youngs_modulus: 5e3, poisson_ratio: 0.25 }],
        pairs: vec![PairParams {
            restitution: 0.9,
            friction_static: 0.3,
            friction_kinetic: 0.1,
            transition_velocity: 1e-3,
            rolling_friction: 0.0,
            work_of_adhesion: 0.0,
            cohesion_density: 0.0,
        }],
        enlargement: 1e-4,
        ..ContactModel::default()
    };
    let before = r#"{"damping":"hunt_crossley","enlargement":1e-4,"law":"paper","materials":"#;
    let middle = r#"[{"poisson_ratio":2.5e-1,"youngs_modulus":5e3}],"pairs":[{"friction_kinetic":1e-1,"friction_static":3e-1,"#;
    let after = r#""restitution":9e-1,"transition_velocity":1e-3}],"samples":null}"#;
    let expected = [before, middle, after].concat();
    let text = |model: &ContactModel| {
        let mut text = String::new();
        canonical(&contact(model), &mut text);
        text
    };
    assert_eq!(text(&model), expected);
    (model.damping, model.law) = (DampingLaw::Tsuji, ElasticLaw::Hertz);
    let expected = expected.replace("hunt_crossley", "tsuji").replace("paper", "hertz");
    assert_eq!(text(&model), expected);
    (model.geometry, model.law) = (Geometry::Sampled { samples: 8 }, ElasticLaw::OverlapEnergy);
    let expected = expected.replace("null", "8e0").replace("hertz", "overlap_energy");
    assert_eq!(text(&model), expected);
}

#[test]
fn the_canonical_form_sorts_keys_and_writes_numbers_in_one_way() {
    let mut text = String::new();
    let value = json!({ "b": [1, 1.0, 0.1, -0.0, 1e-300, f64::NAN], "a": { "d": "x\"y", "c": true } });
    canonical(&value, &mut text);
    let expected = r#"{"a":{"c":true,"d":"x\"y"},"b":[1e0,1e0,1e-1,0e0,1e-300,null]}"#;
    assert_eq!(text, expected);
}
