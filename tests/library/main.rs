//! The library, called in this process. One test program for all of it: each would link the whole library.

#[path = "../common/mod.rs"]
mod common;

mod cases;
mod determinism;
mod examples;
mod falling_sphere;
mod fixed_bodies;
mod lammps;
#[cfg(feature = "liggghts")]
mod liggghts;
mod output;
mod pages;
mod population;
mod profiles;
mod random_cases;
mod reference;
mod same_body;
mod schema;
mod seeds;
mod session;
mod starts;
mod statistics;
mod stress;
mod tables;
mod walls;
mod writers;

use turbid::output::OutputFiles;

/// Runs a case text, with options, in a folder.
fn written(root: &std::path::Path, text: &str, options: &[String]) -> (turbid::case::Setup, OutputFiles) {
    let directory = format!("output.directory={:?}", root.display().to_string());
    let options = [options, &[directory]].concat();
    let setup = turbid::case::from_text(text, "case", &options).unwrap_or_else(|e| panic!("{e}"));
    turbid::simulation::run(&setup, &turbid::simulation::RunOptions::default()).unwrap();
    (setup, OutputFiles::new(root))
}
