//! The program, end to end, as a user runs it. One test program for all of it: each would link the whole library.

#[path = "../common/mod.rs"]
mod common;

mod bad_input;
mod check;
#[cfg(feature = "liggghts")]
mod crosscheck;
#[cfg(feature = "gpu")]
mod device;
mod driving;
mod film;
mod foreign;
mod golden;
#[cfg(feature = "liggghts")]
mod liggghts;
mod limits;
mod mesh;
#[cfg(feature = "mpi")]
mod mpi;
mod pack;
mod pages;
mod paraview;
mod pieces;
mod process;
mod resume;
mod run;
mod same_bits;
mod slurm;
mod study;
mod tutorials;
mod wear;
