//! The viscosity that two plates measure.

use crate::case::Setup;
use crate::math::Vec3;
use crate::output::SeriesRow;
use crate::wall::Surface;

/// Two parallel plates that face and pass each other, the only walls of a case.
pub(super) struct Plates {
    /// Direction in which the second one moves as seen from the first.
    along: Vec3,
    /// Stress of the fluid alone, viscosity times shear rate (Pa).
    plain: f64,
}

impl Plates {
    /// Those of a case, if its walls are such plates.
    pub(super) fn of(setup: &Setup) -> Option<Self> {
        let [first, second] = &setup.walls[..] else {
            return None;
        };
        let (Surface::Plane { point: a, normal: up }, Surface::Plane { point: b, normal: down }) =
            (first.surface, second.surface)
        else {
            return None;
        };
        let turns = |wall: &crate::wall::Wall| wall.motion.angular_velocity != Vec3::zeros();
        let passes = second.motion.velocity - first.motion.velocity;
        let along = passes.try_normalize(0.0)?;
        let gap = (b - a).dot(&up);
        let parallel = (up + down).norm() < 1e-9 && gap > 0.0;
        let fluid = setup.fluid.as_ref()?;
        (parallel && !turns(first) && !turns(second))
            .then(|| Self { along, plain: fluid.density * fluid.viscosity * passes.norm() / gap })
    }

    /// Mean shear stress on both plates over that of the fluid alone: what drives the fluid along the plates drops out.
    pub(super) fn relative_viscosity(&self, row: &SeriesRow) -> f64 {
        // Of each wall the force of the fluid, then the stress.
        let stress = |wall: usize| Vec3::from_column_slice(&row.walls[6 * wall + 3..][..3]);
        0.5 * (stress(0) - stress(1)).dot(&self.along) / self.plain
    }
}
