//! Claims about the suite.

use super::*;
use crate::case::Setup;

/// What can be wrong with the physics.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Fault {
    /// The lattice relaxes as if half a step more had to be taken off: 0.02 on the relaxation time.
    Viscosity,
}

impl Fault {
    /// Makes a case wrong in this way.
    pub(super) fn spoil(self, setup: &mut Setup) {
        match self {
            Self::Viscosity => setup.relaxation_time += 0.02,
        }
    }
}
