//! The case file: what a user writes ([`Case`](file::Case)), and what it means ([`Setup`]).
//!
//! [`load`] does all of it: read, apply `--set` options, type, check, derive. Whatever is wrong ends as
//! [`Error::Case`](crate::Error::Case) or [`Error::Parse`](crate::Error::Parse) with file, line, key, value and remedy:
//!
//! ```
//! use turbid::{Error, case};
//! let wrong = "domain.size = [1e-3, 1e-3, 1e-3]\nrun.end.steps = 0.5";
//! let Err(Error::Case { key, .. }) = case::from_text(wrong, "wrong", &[]) else { panic!() };
//! assert_eq!(key, "run.end.steps");
//! ```

mod array;
mod checks;
mod dry;
mod engine;
pub mod file;
mod files;
mod filled;
mod granular;
pub mod insertion;
mod kinds;
mod laws;
mod listed;
mod materials;
mod motion;
mod open;
mod physics;
mod pictures;
mod placed;
mod placement;
mod plausible;
mod resolve;
mod scales;
mod schedule;
mod sizes;
mod space;
mod speeds;
mod start;
mod statistics;
mod walls;

use crate::contact::ContactModel;
use crate::coupling::{ForceBalance, Method};
use crate::domain::Domain;
use crate::engine::EngineChoice;
use crate::fluid::Collision;
use crate::math::{Quat, TimeFunction, Vec3};
use crate::particle::{Particle, PrescribedMotion, Template};
use crate::units::Units;
use crate::wall::{Inlet, Wall};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

pub use file::{BodyColour, Quantity};
pub use file::{free_keys, schema};
pub use insertion::{Insertion, Removal};
pub use pictures::{PicturePlan, SlicePlan, ViewPlan};
pub(crate) use placed::Placed;
pub use plausible::TooLight;
pub use resolve::{Origin, read_alone};
pub use resolve::{from_saved, from_text, load, load_followed, outline};
pub(crate) use resolve::{from_saved_anew, read_from, with_shapes};
pub(crate) use schedule::of_machine;
pub use schedule::{CHECKPOINT_INTERVAL, CheckpointSpacing, OutputPlan, RunPlan, Steady};
pub use speeds::{Bound, DrivenFlow, Impact};
pub use start::StartFlow;
pub(crate) use statistics::LAGS;
pub use statistics::{Dynamics, Profile, Rings, Structure};

/// A case resolved to numbers, all of them checked: the physics, and apart from it the [plan](Self::plan) of the run and
/// [where it comes from](Self::provenance).
#[derive(Clone, Debug)]
pub struct Setup {
    /// Box and cells; without a fluid the cells of the decomposition only.
    pub domain: Domain,
    /// Time step (s).
    pub time_step: f64,
    /// The fluid; `None` for particles, contacts and walls alone.
    pub fluid: Option<FluidSetup>,
    /// Geometries and materials.
    pub templates: Arc<[Template]>,
    /// Constant force (N) and torque (N m) on each body of each template, besides all else.
    pub applied: Vec<[Vec3; 2]>,
    /// The `[[particles]]` section that each template is of, counted from 0.
    pub sections: Vec<usize>,
    /// Motion of the bodies of each template, as far as it is prescribed.
    pub motions: Vec<PrescribedMotion>,
    /// From the axes of the body to those in which the case gives its shape, for each template.
    pub frames: Vec<Quat>,
    /// State of all particles at the start, ascending ids; during a run ask the simulation. In a case that several processes have
    /// [read together](crate::simulation::read_together) those of this process.
    pub particles: Vec<Particle>,
    /// Particles that come during the run.
    pub insertions: Vec<Insertion>,
    /// Particles that go during the run.
    pub removals: Vec<Removal>,
    /// Diameter of the sphere of equal volume, of the first kind of particle (m).
    pub diameter: f64,
    /// Solid volume of the particles at the start over volume of the box (-).
    pub volume_fraction: f64,
    /// Volume of the box that is in no wall (m^3).
    pub free_volume: f64,
    /// The same as the case asks for it, before numbers of particles were rounded up to whole ones (-).
    pub requested_volume_fraction: f64,
    /// Walls: the closed faces of the box, and those the case lists.
    pub walls: Vec<Wall>,
    /// Faces of the box through which fluid comes in, by their numbers in `walls`.
    pub inlets: BTreeMap<usize, Inlet>,
    /// Pressures (Pa, along x) over time of outlets that vary it, by their numbers in `walls`.
    pub pressures: BTreeMap<usize, TimeFunction>,
    /// Contact model; `None` if contacts are off.
    pub contact: Option<ContactModel>,
    /// The engine that moves the particles.
    pub engine: EngineChoice,
    /// DEM sub-steps per time step.
    pub substeps: u32,
    /// Gravity (m/s^2).
    pub gravity: Vec3,
    /// Bodies at rest all over the box, where something drives a flow through them.
    fixed_array: Option<array::FixedArray>,
    /// Factors on the shape of each section that has the sizes of its positions file.
    scales: Vec<Option<Vec<f64>>>,
    /// Numbers that follow from the particles of all processes, if this one has only its own.
    pub(crate) placed: Option<Arc<Placed>>,
    /// Length of the run, hardware and output.
    pub plan: RunPlan,
    /// Text and files of the case.
    pub provenance: Provenance,
}

impl Setup {
    /// Cell size, time step and density of the fluid, which is 0 without one.
    pub fn units(&self) -> Units {
        Units { dx: self.domain.dx, dt: self.time_step, density: self.fluid_density() }
    }

    /// Density of what surrounds the particles (kg/m^3); 0 without a fluid.
    pub fn fluid_density(&self) -> f64 {
        self.fluid.as_ref().map_or(0.0, |fluid| fluid.density)
    }

    /// Time (s) of [`RunPlan::averages_from`].
    pub(crate) fn averages_from(&self, last: u64) -> f64 {
        self.plan.averages_from(last) as f64 * self.time_step
    }

    /// Number of cells of the fluid; 0 without one.
    pub fn fluid_cells(&self) -> usize {
        self.fluid.as_ref().map_or(0, |_| self.domain.cell_count())
    }

    /// Weight less buoyancy (N) of all particles and the force that the case applies, in the directions in which forces move them.
    pub fn submerged_weight(&self) -> Vec3 {
        let of_each =
            self.particles.iter().map(|particle| self.submerged_weight_of(particle.template as usize));
        self.placed.as_ref().map_or_else(|| of_each.sum(), |placed| placed.totals.weight())
    }

    /// The same of a particle of a template.
    pub fn submerged_weight_of(&self, template: usize) -> Vec3 {
        let (Template { density, shape, .. }, free) =
            (&self.templates[template], self.motions[template].free);
        let mut weight = (density - self.fluid_density()) * shape.volume() * self.gravity;
        let [force, _] = self.applied[template];
        if force != Vec3::zeros() {
            weight += force;
        }
        Vec3::from_fn(|axis, _| if free[axis] { weight[axis] } else { 0.0 })
    }

    /// The face of the box that a wall has the name of.
    fn face_of(wall: &Wall) -> Option<usize> {
        file::FACES.iter().position(|face| *face == wall.name)
    }

    /// The inlets and outlets, by their numbers in `walls`, ascending.
    pub fn open_faces(&self) -> Vec<usize> {
        let is_open = |wall: &Wall| Self::face_of(wall).is_some_and(|n| self.domain.faces[n].is_open());
        // Closed faces come first.
        let walls = self.walls.iter().enumerate().take(6);
        walls.filter(|(_, wall)| is_open(wall)).map(|(n, _)| n).collect()
    }

    /// Number of the `[[particles]]` sections.
    pub(crate) fn section_count(&self) -> usize {
        self.sections.iter().map(|section| section + 1).max().unwrap_or(0)
    }

    /// The `[[particles]]` sections whose motion is prescribed, at least in part, ascending.
    pub fn prescribed_sections(&self) -> Vec<usize> {
        let of_each = self.sections.iter().zip(&self.motions);
        let mut sections: Vec<usize> =
            of_each.filter(|(_, motion)| !motion.is_free()).map(|(section, _)| *section).collect();
        sections.dedup();
        sections
    }

    /// Unit of `t*` (s): `D / u_Stokes`, if something settles.
    pub fn stokes_time(&self) -> Option<f64> {
        let time = self.fluid.as_ref()?.scales.stokes_time;
        (time.is_finite() && time > 0.0).then_some(time)
    }

    /// The fluid of a case that is known to have one.
    ///
    /// # Panics
    /// Without a fluid.
    pub fn expect_fluid(&self) -> &FluidSetup {
        self.fluid.as_ref().expect("this case has a fluid")
    }

    /// Velocity of the fluid at the start (m/s), by position (m).
    pub fn flow_at_start(&self) -> impl Fn(Vec3) -> Vec3 {
        let start = self.fluid.as_ref().and_then(|fluid| fluid.start);
        move |position| start.map_or(Vec3::zeros(), |flow| flow.velocity(position))
    }

    /// Mean velocity of the fluid at the start (m/s).
    pub fn mean_flow_at_start(&self) -> Vec3 {
        let start = self.fluid.as_ref().and_then(|fluid| fluid.start);
        start.map_or(Vec3::zeros(), |flow| flow.mean(self.domain.size()))
    }

    /// Time at the end of the run (s).
    pub fn end_time(&self) -> f64 {
        self.plan.end_step as f64 * self.time_step
    }
}

/// The fluid of a case, its coupling to the particles, and what drives it.
#[derive(Clone, Debug, PartialEq)]
pub struct FluidSetup {
    /// Density (kg/m^3).
    pub density: f64,
    /// Kinematic viscosity (m^2/s).
    pub viscosity: f64,
    /// Relaxation time (time steps).
    pub relaxation_time: f64,
    /// Collision operator.
    pub collision: Collision,
    /// Solid fraction and collision of cells that particles cover.
    pub coupling: Method,
    /// Region in which the balancing force acts.
    pub force_balance: ForceBalance,
    /// Mean volume flux (m/s) that a controller keeps, in the directions in which it does.
    pub net_flux: [Option<f64>; 3],
    /// Rate at which it does (1/s) where nothing holds the fluid back: the paper's `u_Stokes / D`, or the viscous rate `nu / D^2` where
    /// that is faster.
    pub control_rate: f64,
    /// Uniform acceleration of the fluid in addition to all else (m/s^2), for driven flows.
    pub body_acceleration: TimeFunction,
    /// Flow at the start; `None` is a fluid at rest.
    pub start: Option<StartFlow>,
    /// Reference velocities and dimensionless numbers.
    pub scales: Scales,
}

/// The text that a [`Setup`] was resolved from, and its files.
#[derive(Clone, Debug, Default)]
pub struct Provenance {
    /// Name of the case (file stem).
    pub name: String,
    /// Text of the case file with overrides applied, echoed into the summary.
    pub text: String,
    /// The files that the case names: the name as it stands there, and the contents.
    pub files: Vec<(String, Vec<u8>)>,
    /// Paths of the case and of these files; empty for a text or a case that was saved.
    pub inputs: Vec<PathBuf>,
    /// Warnings about a valid case, ready to print.
    pub warnings: Vec<String>,
    /// Notes on what was done with its files and particles, ready to print.
    pub notes: Vec<String>,
}

/// Reference velocities and dimensionless numbers of a settling problem, for the first kind of particle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scales {
    /// Particle density over fluid density (-).
    pub density_ratio: f64,
    /// Archimedes number `g |s - 1| D^3 / nu^2` (-).
    pub archimedes: f64,
    /// Stokes velocity `g |s - 1| D^2 / (18 nu)` (m/s).
    pub stokes_velocity: f64,
    /// Unit of `t*`: `D / u_Stokes` (s); infinite where nothing settles.
    pub stokes_time: f64,
    /// Terminal velocity of one particle with the drag of Schiller and Naumann (m/s).
    pub schiller_naumann_velocity: f64,
    /// Reynolds number at that velocity (-).
    pub schiller_naumann_reynolds: f64,
}
