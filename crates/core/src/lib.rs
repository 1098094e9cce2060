//! Numerics of [Turbid](https://docs.rs/turbid): everything between a set of parameters and the next time step.
//!
//! A lattice Boltzmann fluid ([`fluid`]), rigid convex particles ([`shape`], [`particle`]) with a discrete contact
//! model based on overlap volume ([`contact`], [`dem`]), and the coupling between them ([`coupling`]), on any number
//! of ranks ([`domain`], [`comm`]). No file is read or written here, nothing is printed, and no case is parsed: the
//! crate `turbid` does that, and re-exports these modules.
//!
//! Modules are layers: arrows point down only.
//!
//! ```text
//! border    coupling                the only place where lattice units meet SI at run time
//! physics   fluid             |     dem
//! parts     lattice           |     contact -> particle -> shape   wall
//! space     domain            comm
//! words     math   units   error   memory   timing   device
//! ```

pub mod comm;
pub mod contact;
pub mod coupling;
pub mod dem;
pub mod device;
pub mod domain;
pub mod error;
pub mod fluid;
pub mod lattice;
pub mod math;
pub mod memory;
pub mod particle;
pub mod shape;
pub mod timing;
pub mod units;
pub mod wall;

pub use error::{Error, Result};
