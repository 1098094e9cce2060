//! Particle-resolved suspension dynamics.
//!
//! A homogenised lattice Boltzmann fluid ([`fluid`]), rigid convex particles ([`shape`], [`particle`]) with a
//! discrete contact model based on overlap volume ([`contact`], [`dem`]), and a coupling layer ([`coupling`])
//! through which all particle data moves. [`simulation`] puts them together; [`case`] reads what to simulate from
//! a TOML file in SI units; [`output`] writes what came out, and [`checkpoint`] what a run needs to go on.
//!
//! Modules are layers: arrows point down only, and `tests/architecture.rs` holds the table.
//!
//! ```text
//! front     main -> cli
//! whole     validate   report   study   crosscheck   checks   simulation   case   output   packing   checkpoint
//! border    coupling                the only place where lattice units meet SI at run time
//! physics   fluid             |     dem
//! parts     lattice           |     contact -> particle -> shape   wall
//! space     domain            comm
//! words     math   units   input   error   memory   timing
//! ```

pub mod case;
pub mod checkpoint;
pub mod checks;
pub mod cli;
pub mod crosscheck;
pub mod engine;
pub mod input;
pub mod memory;
pub mod mesh;
pub mod output;
pub mod packing;
pub mod report;
pub mod simulation;
pub mod study;
pub mod validate;

pub use turbid_core::{Error, Result};
pub use turbid_core::{
    comm, contact, coupling, dem, domain, error, fluid, lattice, math, particle, shape, timing, units, wall,
};
