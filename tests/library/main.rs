//! The library, called in this process. One test program for all of it: each would link the whole library.

#[path = "../common/mod.rs"]
mod common;

mod cases;
mod determinism;
mod examples;
mod falling_sphere;
mod fixed_bodies;
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
