//! Discrete contacts of convex bodies: overlap geometry, force law, material.
//!
//! A contact is measured by the volume, depth, centre and normal of the overlap of the two (enlarged) bodies
//! ([`overlap`]): in closed form for spheres ([`sphere_sphere`]), by samples for any other pair ([`sampled`]). The
//! force follows from these four and from the relative velocity at the centre ([`law`]). [`pairs`] says which pairs
//! are near enough to be measured. Nothing here has a memory; the engine keeps the damping of each contact.

pub mod law;
pub mod overlap;
pub mod pairs;
pub mod sampled;
pub mod sphere_sphere;

pub use law::PairLaw;
pub use overlap::{Body, Overlap, measure};
pub use pairs::PairFinder;
use serde::{Deserialize, Serialize};

/// Material and model of all particle contacts, SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactParams {
    /// Young's modulus (Pa).
    pub youngs_modulus: f64,
    /// Poisson's ratio (-).
    pub poisson_ratio: f64,
    /// Coefficient of restitution (-), `0 < e <= 1`.
    pub restitution: f64,
    /// Static friction coefficient (-).
    pub friction_static: f64,
    /// Kinetic friction coefficient (-).
    pub friction_kinetic: f64,
    /// Speed of transition from static to kinetic friction (m/s).
    pub transition_velocity: f64,
    /// By how much every surface is grown for contacts (m).
    pub enlargement: f64,
    /// How overlaps are measured.
    pub geometry: Geometry,
}

/// How overlaps are measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Geometry {
    /// Closed forms where they exist.
    Exact,
    /// The sampled scheme of Marquardt et al. (2024), with this many samples per direction.
    Sampled {
        /// Samples per direction, `N_c`.
        samples: u32,
    },
}
