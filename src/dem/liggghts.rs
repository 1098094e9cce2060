//! LIGGGHTS behind the engine trait: spheres, one instance, in a worker process or in this one.

use super::LiggghtsOptions;
use crate::contact::ContactModel;
use crate::math::Vec3;
use crate::wall::Wall;
use std::path::PathBuf;

/// Parameters of the LIGGGHTS engine.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LiggghtsParams {
    /// Materials and model of the contacts; without, particles pass through each other and through walls.
    pub contact: Option<ContactModel>,
    /// Walls.
    pub walls: Vec<Wall>,
    /// Acceleration of every particle (m/s^2); buoyancy is part of the loads.
    pub gravity: Vec3,
    /// Sub-steps per call of [`advance`](super::DemEngine::advance), at least one.
    pub substeps: u32,
    /// Where it runs, and commands of the user.
    pub options: LiggghtsOptions,
    /// File for all that LIGGGHTS prints; without, it is thrown away.
    pub log: Option<PathBuf>,
    /// The turbid program, to be started as the worker; without, the program that runs now.
    pub program: Option<PathBuf>,
}

/// The LIGGGHTS engine.
#[derive(Debug)]
pub struct Liggghts {}
