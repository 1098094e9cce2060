//! LIGGGHTS as an engine: spheres, behind the messages of the engine protocol. One instance in a worker process or in this one, or one in all
//! processes of an MPI job, where each has the spheres of a block of LIGGGHTS's own.
//!
//! The worker is this program with a hidden verb. Friction is limited to Coulomb's, as LIGGGHTS adds a dashpot to it that did not act
//! if the contact slid.

mod deck;
mod instance;
mod restart;
mod session;
pub mod worker;

pub use instance::end;
/// The LIGGGHTS engine, for [`LiggghtsParams`].
pub use turbid_process::External as Liggghts;

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use turbid_core::contact::ContactModel;
use turbid_core::math::Vec3;
use turbid_core::wall::Wall;
use turbid_process::{ExternalParams, Host, Program};

/// Parameters of the LIGGGHTS engine.
#[derive(Clone, Debug, Default)]
pub struct LiggghtsParams {
    /// Elasticity, restitution, kinetic friction and enlargement; without, particles pass through each other and through walls.
    pub contact: Option<ContactModel>,
    /// Walls.
    pub walls: Vec<Wall>,
    /// Acceleration of every particle (m/s^2); buoyancy is part of the loads.
    pub gravity: Vec3,
    /// Sub-steps per call of [`advance`](turbid_core::dem::DemEngine::advance), at least one.
    pub substeps: u32,
    /// True if LIGGGHTS runs in this process instead of a worker; in all processes, if the ranks are processes of MPI.
    pub in_this_process: bool,
    /// Commands of the user, given after all others of the set-up and before the first step. The caller checks them: a
    /// command of LIGGGHTS can read and write any file.
    pub commands: Vec<String>,
    /// Longest time that a worker may take to answer (s), 60 if not given; ten times as long for the set-up and for
    /// saving.
    pub timeout: Option<f64>,
    /// File to which LIGGGHTS's log of the set-up, and all that a worker prints, is appended.
    pub log: Option<PathBuf>,
    /// True if LIGGGHTS is set up when the engine is restored.
    pub resumes: bool,
    /// The turbid program, to be started as the worker; without, the program that runs now.
    pub program: Option<PathBuf>,
    /// Set when the run is told to stop: then a worker that does not answer is not waited for much longer.
    pub stop: Arc<AtomicBool>,
}

impl From<LiggghtsParams> for ExternalParams {
    fn from(params: LiggghtsParams) -> Self {
        let host = if params.in_this_process {
            Host::Here(|seat| Box::new(session::Engine::new(seat)))
        } else {
            let timeout = (params.timeout, "dem.liggghts.timeout");
            let program = (params.program, worker::VERB);
            Host::Process(Program::worker(program, timeout, params.log.clone(), params.stop))
        };
        Self {
            name: "liggghts",
            label: "LIGGGHTS".to_owned(),
            contact: params.contact,
            walls: params.walls,
            gravity: params.gravity,
            substeps: params.substeps,
            options: serde_json::json!({
                "commands": params.commands,
                "log_file": params.log.map(|log| log.to_string_lossy().into_owned()),
            }),
            host,
            resumes: params.resumes,
            memory: u64::MAX,
            regroups: true,
        }
    }
}
