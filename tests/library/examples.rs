//! The programs in `examples/` run, and come to what they should.

/// Includes programs as modules.
macro_rules! examples {
    ($($name:ident: $path:literal),*) => {
        $(
            #[path = $path]
            #[allow(dead_code, reason = "their main functions")]
            mod $name;
        )*
    };
}

examples! {
    checkpoint: "../../examples/checkpoint.rs",
    external_program: "../../examples/external_program.rs",
    fields: "../../examples/fields.rs",
    fixed_body_drag: "../../examples/fixed_body_drag.rs",
    hindered_settling: "../../examples/hindered_settling.rs",
    own_engine: "../../examples/own_engine.rs",
    own_shape: "../../examples/own_shape.rs"
}

#[test]
fn a_suspension_settles_more_slowly_than_a_sphere_in_slow_flow() {
    let ratio = hindered_settling::run().unwrap();
    assert!((0.2..0.8).contains(&ratio), "{ratio}");
}

#[test]
fn the_drag_of_a_fixed_sphere_is_that_of_the_literature() {
    let factor = fixed_body_drag::run().unwrap();
    assert!((factor / 2.810 - 1.0).abs() < 0.02, "{factor}");
}

#[test]
fn an_engine_of_its_own_feels_more_than_the_added_mass() {
    let force = own_engine::run().unwrap();
    assert!((0.5..5.0).contains(&force), "{force}");
}

#[test]
fn a_tablet_turns_towards_its_broad_side() {
    let angle = own_shape::run().unwrap();
    assert!(angle < 35.0, "it began at 45: {angle}");
}

#[test]
fn the_profile_between_walls_is_a_parabola() {
    let deviation = fields::run().unwrap();
    assert!(deviation < 0.01, "{deviation}");
}

#[test]
fn a_controller_in_another_process_holds_a_sphere() {
    let height = external_program::run().unwrap();
    assert!((1.8e-3..2e-3).contains(&height), "{height}");
}

#[test]
fn a_checkpoint_resumes_to_the_bit_on_other_ranks() {
    assert!(checkpoint::run().unwrap());
}
