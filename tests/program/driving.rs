//! Driven flows and cases that cannot work, end to end.

use crate::common::{Place, column, has};

/// A slit with a neutral sphere in a flow that a body acceleration drives along x.
const SLIT: &str = r#"
[domain]
size = { diameters = [4, 4, 6] }
periodic = [true, true, false]

[fluid]
density = 1000.0
viscosity = 1e-5

[lattice]
cells_per_diameter = 4
relaxation_time = 1.0

[[particles]]
shape = { sphere = { diameter = 2e-4 } }
density = 1000.0
list = [[4e-4, 4e-4, 6e-4]]

[driving]
gravity = 0
body_acceleration = [2.0, 0, 0]

[run]
end = { steps = 2000 }
threads = 1

[output]
series_every = { steps = 2000 }
fields_every = "never"
particles_every = "never"
picture_every = "never"
"#;

/// Output of a command on a case, `case.toml`, that ends with this exit code.
fn said(case: &str, code: i32, arguments: &[&str]) -> String {
    Place::new(case).ends(code, &[&arguments[..1], &["case.toml"], &arguments[1..]].concat())
}

#[test]
fn a_body_acceleration_drives_a_slit_at_the_flux_of_poiseuille_with_the_defaults() {
    let place = Place::new(SLIT);
    place.well(&["run", "case.toml", "--quiet"]);
    let flux = *column(&place.path("out/case/series.csv"), "net_flux_x").last().unwrap();
    let height = 1.2e-3;
    let expected = 2.0 * height * height / 12.0 / 1e-5;
    assert!((flux / expected - 1.0).abs() < 0.04, "{flux} is not {expected}");
    let control = &place.summary("out/case")["net_flux_control"];
    assert_eq!(control["directions"], serde_json::json!([false, true, false]));
    assert_eq!(control["mean_acceleration"][0], 0.0);
    // Nothing drives the flow across.
    assert!(control["largest_acceleration"].as_f64().unwrap() < 1e-3);
}

#[test]
fn a_driven_flow_with_a_controller_that_takes_it_away_is_refused_with_both_places() {
    for command in ["check", "run"] {
        let text = said(SLIT, 2, &[command, "--set", "driving.zero_net_flux=true"]);
        has(
            &text,
            &["`driving.zero_net_flux` = true", "along x", "leave `zero_net_flux` out", "case.toml:21"],
        );
    }
    let across =
        ["check", "--set", "driving.zero_net_flux=true", "--set", "driving.body_acceleration=[0, 0, 2.0]"];
    has(&said(SLIT, 0, &across), &["zero_net_flux", "x, y"]);
}

#[test]
fn check_tells_the_driven_flow_the_controller_and_the_gaps_that_are_not_resolved() {
    let text = said(SLIT, 0, &["check"]);
    has(
        &text,
        &[
            "driven flow",
            "3.600000e-2 m/s",
            "Re of that flow",
            "4.3200",
            "zero_net_flux",
            "unresolved gaps",
            "5.000e-5 m",
        ],
    );
    has(&text, &["0.40 cells"]);
}

#[test]
fn a_length_in_millimetres_is_refused_by_check_and_run_with_the_likely_mistake() {
    let metres = ["--set", "particles.0.shape.sphere.diameter=1", "--set", "driving.gravity=9.81", "--set"];
    let rest = ["particles.0.density=2500", "--set", "driving.body_acceleration=[0,0,0]", "--set"];
    for command in ["check", "run"] {
        let arguments = [&[command], &metres[..], &rest[..], &["particles.0.list=[[2, 2, 2]]"]].concat();
        let text = said(SLIT, 2, &arguments);
        has(&text, &["cells per time step, above 0.3", "lengths are in metres", "1.0000e-3 m meant"]);
    }
}

#[test]
fn a_flow_that_would_become_too_fast_is_refused_at_its_key() {
    let text = said(SLIT, 2, &["run", "--set", "driving.body_acceleration=[2000, 0, 0]"]);
    has(&text, &["driving.body_acceleration", "1.748", "above 0.3", "is 2.0000 meant"]);
    let text = said(SLIT, 2, &["check", "--set", "domain.faces.z+={ velocity = [5.0, 0, 0] }"]);
    has(&text, &["the wall \"z+\" is 5", "take lattice.relaxation_time"]);
    let list = "particles.0.list=[{ position = [4e-4, 4e-4, 6e-4], velocity = [0, 50, 0] }]";
    has(&said(SLIT, 2, &["check", "--set", list]), &["at the start is 5", "velocities are in m/s"]);
}

#[test]
fn a_dynamic_viscosity_and_a_density_in_grams_are_asked_about() {
    let text = said(SLIT, 0, &["check", "--set", "fluid.viscosity=1e-3"]);
    has(&text, &["is it the dynamic viscosity, in Pa s?", "1.0000e-6 m^2/s"]);
    let text = said(SLIT, 0, &["check", "--set", "particles.0.density=2.5"]);
    has(&text, &["is 2500 meant, 2.5 g/cm^3?", "added mass"]);
}

#[test]
fn light_particles_are_warned_of_and_blamed_for_a_divergence() {
    let light = ["--set", "particles.0.density=0.01", "--set", "driving.gravity=9.81"];
    let longer = ["--set", "run.end.steps=20000"];
    let text = said(SLIT, 0, &[&["check"], &light[..]].concat());
    has(&text, &["`particles.0.density`: particles of 1.0e-5 times", "tested down to 0.05", "added mass"]);
    let text = said(SLIT, 3, &[&["run", "--quiet"], &light[..], &longer[..]].concat());
    has(&text, &["diverged at step", "added mass", "driven by gravity", "body_acceleration [2, 0, 0] m/s^2"]);
    assert!(!text.contains("relaxation time"), "{text}");
}
