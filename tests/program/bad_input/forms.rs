//! Values of another type, lists of another length, other names of keys: key and remedy, and no word of the language that reads them.

use crate::common::case::{SPHERES, changed};
use crate::common::{self, Place};

/// Words of a reader of TOML in Rust for those who write Rust.
const NOT_SAID: [&str; 12] = [
    "variant",
    "sequence",
    "newtype",
    "tuple",
    "struct",
    "f64",
    "u64",
    "u32",
    "usize",
    "map,",
    "invalid type",
    "Section",
];

#[test]
fn a_value_of_another_form_is_named_with_its_key_and_a_remedy() {
    let table: &[(&str, &[&str])] = &[
        (
            "fluid.viscosity=\"1e-5\"",
            &["option --set:1:17", "`fluid.viscosity` is the text \"1e-5\"", "write 1e-5 without quotes"],
        ),
        ("fluid.viscosity=\"1,5\"", &["`fluid.viscosity` is the text \"1,5\"", "write 1.5 with a point"]),
        ("fluid.viscosity=1,5e-6", &["option --set:1:17", "decimal comma", "write 1.5e-6"]),
        (
            "particles.0.shape=sphere",
            &["option --set:1:19", "`particles.0.shape` is the text \"sphere\"", "{ sphere = { ... } }"],
        ),
        ("particles.0.shape=2", &["`particles.0.shape` is 2, but must be { sphere"]),
        (
            "particles.0.shape={sphere=[1]}",
            &["`particles.0.shape.sphere` is a list, but must be { diameter = ... }"],
        ),
        (
            "particles.0.shape.sphere.radius=1",
            &["unknown key `radius` in `particles.0.shape.sphere`", "write diameter = 2 radius"],
        ),
        ("lattice={tau=0.6, cells_per_diameter=8}", &["unknown key `tau`", "write relaxation_time ="]),
        ("particles.0.shape={sphere={}}", &["the key `diameter` is missing", "Diameter (m)"]),
        ("particles.0.shape={sphere={diameter=1}, cube={edge=1}}", &["exactly one", "{ cube = { ... } }"]),
        (
            "domain.periodic=[true,true]",
            &["`domain.periodic` has 2 values, but must have 3", "one for each of x, y, z"],
        ),
        ("domain.size=[1,5, 2,5, 3]", &["`domain.size` has 5 values, but must have 3", "decimal commas"]),
        ("driving.body_acceleration=[1,2,3,4]", &["has 4 values, but must have 3"]),
        ("driving.zero_net_flux=\"true\"", &["must be true or false", "write true without quotes"]),
        ("driving.gravity=true", &["`driving.gravity` is true", "a number or a list of 3 values"]),
        ("driving.gravity=[1,2,\"a\"]", &["`driving.gravity.2` is the text \"a\"", "must be a number"]),
        (
            "particles.0.count=1e3",
            &["`particles.0.count` is 1e3", "whole number of at least 0", "write 1000"],
        ),
        ("run.threads=-3", &["`run.threads` is -3", "whole number of at least 0"]),
        ("run.end=steps", &["`run.end` is the text \"steps\"", "{ steps = 100 }"]),
        ("run.end=\"never\"", &["`run.end` is the text \"never\"", "{ steps = 100 }"]),
        ("output.fields_every={never=1}", &["unknown choice `never`"]),
        ("output.fields_every=\"sometimes\"", &["unknown choice `sometimes`", "never"]),
        ("fluid.density=1979-05-27", &["`fluid.density` is the date 1979-05-27", "a number"]),
        ("fluid.density={a=1}", &["`fluid.density` is a table", "Density (kg/m^3)"]),
        ("contact.samples=5000000000", &["`contact.samples` is 5000000000", "at least 2 and at most 64"]),
        ("contact.samples=4", &["option --set:1:17", "`contact.samples`", "\"exact\"", "remove it"]),
        ("fluid=1", &["`fluid` is 1, but must be a table"]),
        ("particles=[1]", &["`particles.0` is 1, but must be a table"]),
        ("particles.0.list=1", &["`particles.0.list` is 1, but must be a list"]),
        ("domain.faces.\"z+\".velocity=[1]", &["`domain.faces.z+.velocity` has 1 value, but must have 3"]),
    ];
    let place = Place::new(SPHERES);
    for (option, words) in table {
        let arguments = ["check", "case.toml", "--set", option];
        place.refused(&arguments, words);
        let said = common::words(&place.output(&arguments));
        for word in NOT_SAID {
            assert!(!said.contains(word), "{option}: `{word}` is in\n{said}");
        }
    }
}

#[test]
fn a_decimal_comma_in_the_file_is_found_where_the_reader_stumbles_behind_it() {
    super::all_refused(&[
        ("1.5e-3", "1,5e-3", &["bad.toml:14:33", "decimal comma", "write 1.5e-3"]),
        ("1000.0", "1000,0", &["bad.toml:6:11", "decimal comma", "write 1000.0"]),
    ]);
}

#[test]
fn keys_of_options_are_quoted_as_in_toml() {
    let closed = ("[fluid]", "periodic = [true, true, false]\n[fluid]");
    let place = Place::new(&changed(SPHERES, &[closed]));
    for option in ["domain.faces.\"z+\".velocity=[1e-3, 0, 0]", "domain.faces.z+.velocity=[1e-3, 0, 0]"] {
        place.well(&["check", "case.toml", "--set", option]);
    }
}
