//! Particle-resolved suspension dynamics: rigid convex bodies in a lattice Boltzmann fluid, coupled both ways.
//!
//! The program `turbid` (the package `turbid-cli`) runs case files (see `docs/`); this is the library behind it. Everything is in SI units.
//!
//! ```
//! use turbid::{Builder, Particles};
//!
//! let glass = Particles::spheres(1e-3, 2500.0).volume_fraction(0.1); // diameter (m), density (kg/m^3)
//! let mut simulation = Builder::new([4e-3, 4e-3, 4e-3])              // edges of a periodic box (m)
//!     .fluid(1000.0, 1e-5)                                           // density (kg/m^3), viscosity (m^2/s)
//!     .lattice(6.0, 0.6)                                             // cells per diameter, relaxation time
//!     .particles(glass)
//!     .build()?;
//! simulation.run_until(5e-3)?;                                       // time (s)
//! for particle in simulation.particles() {
//!     assert!(particle.velocity().norm() < 0.1);                     // m/s
//! }
//! # Ok::<(), turbid::Error>(())
//! ```
//!
//! Begin with [`Builder`] or [`case::load`]; both end in a [`Setup`]. [`Simulation`] steps it in your program, on one rank or on
//! many; [`simulation::run()`] runs it to its end and writes all files, as the program does. Engines of your own implement
//! [`dem::DemEngine`], bodies [`shape::Shape`], files [`simulation::Writer`]. The folder `examples/` has short programs.
//!
//! | module | what it has |
//! |---|---|
//! | [`case`] | the case file ([`case::file`]: every key) and the [`Setup`] that it resolves to |
//! | [`simulation`] | [`Simulation`], whole runs with their files, benchmarks |
//! | [`output`], [`checkpoint`] | files of results; saved states |
//! | [`coupling`] | solid volume fractions, momentum exchange, driving; [`AnyFluid`](coupling::AnyFluid) |
//! | [`engine`] | which engine moves the particles of a case |
//! | [`fluid`], [`lattice`] | the lattice Boltzmann fluid of one rank, in lattice units |
//! | [`device`] | GPUs that compute the fluid |
//! | [`dem`], [`contact`] | engines that move particles, contact forces |
//! | [`particle`], [`shape`], [`wall`] | bodies and walls |
//! | [`packing`], [`mesh`] | random positions; bodies from STL and OBJ files |
//! | [`domain`], [`comm`] | the box, its blocks, and messages between ranks |
//! | [`math`], [`units`], [`error`] | vectors, units, errors |
//!
//! The numerics are the crate [`turbid_core`]. Modules are layers: arrows point down only (`ARCHITECTURE.md`).

pub mod builder;
pub mod case;
pub mod checkpoint;
#[doc(hidden)]
pub mod engine;
#[doc(hidden)]
pub mod memory;
pub mod mesh;
pub mod output;
pub mod packing;
pub mod simulation;

pub use builder::{Builder, Particles, Wall};
pub use case::Setup;
pub use simulation::Simulation;
pub use turbid_core::{Error, Result};
pub use turbid_core::{
    comm, contact, coupling, dem, device, domain, error, fluid, lattice, math, particle, shape, timing,
    units, wall,
};
#[doc(hidden)]
pub use turbid_input::{document, input};
