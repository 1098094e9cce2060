//! Validation against the literature: one folder per case, with the question, the case file, the reference and the
//! acceptance.
//!
//! `cargo test --release --test validation -- --nocapture` prints measured value, reference and tolerance.

mod periodic_settling;
mod settling_tank;
mod shear;
mod sphere_array;
mod support;
