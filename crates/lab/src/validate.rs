//! Cases of the literature, each with the question it answers, the case files, the reference and what counts as agreement.
//!
//! `validation/<name>/` holds what a case is made of: its texts are part of this program, so that it validates itself
//! anywhere. The module of a case here says how it is run, what is measured and how far it may be off; the `README.md` of its
//! folder says why.

mod agglomerate;
mod channel;
mod cohesion;
mod column_collapse;
mod composites;
mod context;
mod cylinder;
mod drafting;
mod drum;
mod flow_past_sphere;
mod fluidised_bed;
mod friction;
mod hard_sphere_gas;
mod heap;
mod hertz;
mod hindered_settling;
mod hopper;
mod liggghts;
mod mesh_walls;
mod net_flux;
mod open_faces;
mod oscillating_flow;
mod packed_bed;
mod packings;
mod periodic_settling;
mod prescribed_motion;
mod random_array;
mod reference;
mod repose;
mod restitution;
mod rising_sphere;
mod rolling;
mod round_walls;
mod settling_front;
mod settling_tank;
mod shear;
mod shear_viscosity;
mod shear_wave;
mod slope;
mod sphere_array;
mod taylor_green;
mod turbulence;
mod vessels;
mod watch;
mod wet_impact;

pub use crate::checks::Findings;
use crate::checks::suite;
pub use crate::checks::suite::{Level, run};
pub use context::{SuiteContext, list};

mod prelude {
    pub(super) use super::context::{SuiteContext, unsteady};
    pub(super) use super::reference::{Table, interpolated};
    pub(super) use super::watch::{Watch, sphere_course};
    pub(super) use super::{Case, Findings, Part};
    pub(super) use crate::checks::{measured, overlaid, reference};
    pub(super) use turbid::case::Setup;
    pub(super) use turbid::error::Result;
    pub(super) use turbid::math::Vec3;
    pub(super) use turbid::particle::Particle;
    pub(super) use turbid::simulation::Simulation;
}

pub type Case = suite::Case<SuiteContext>;
pub type Part = suite::Part<SuiteContext>;

pub const CASES: &[Case] = &[
    shear_wave::CASE,
    taylor_green::CASE,
    channel::CASE,
    round_walls::CASE,
    mesh_walls::CASE,
    open_faces::CASE,
    cylinder::CASE,
    flow_past_sphere::CASE,
    packed_bed::CASE,
    fluidised_bed::CASE,
    sphere_array::CASE,
    oscillating_flow::CASE,
    net_flux::CASE,
    periodic_settling::CASE,
    rising_sphere::CASE,
    rolling::CASE,
    prescribed_motion::CASE,
    shear::CASE,
    settling_tank::CASE,
    settling_front::CASE,
    restitution::CASE,
    friction::CASE,
    composites::CASE,
    hard_sphere_gas::CASE,
    packings::CASE,
    slope::CASE,
    cohesion::CASE,
    agglomerate::CASE,
    column_collapse::CASE,
    repose::CASE,
    hopper::CASE,
    drum::CASE,
    hertz::CASE,
    liggghts::CASE,
    wet_impact::CASE,
    drafting::CASE,
    turbulence::CASE,
    random_array::CASE,
    shear_viscosity::CASE,
    hindered_settling::CASE,
];

#[cfg(test)]
mod tests;
