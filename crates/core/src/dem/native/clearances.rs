//! Parts of bodies that were so far from a mesh that they cannot touch it yet: searches that are left out. No result depends on them.

use crate::math::Vec3;
use crate::wall::WallMesh;

/// Distance (reaches of the part) up to which a mesh is looked for.
const FAR: f64 = 4.0;

/// A part that was free to move.
#[derive(Clone, Copy, Debug, Default)]
struct Clearance {
    /// Id of the particle, and index of the part.
    of: (u64, u32),
    /// Position in the frame of the mesh (m).
    at: Vec3,
    /// Square of the way without a contact from there (m^2).
    free: f64,
}

/// By wall and owned part.
#[derive(Clone, Debug, Default)]
pub(super) struct Clearances(Vec<Vec<Clearance>>);

impl Clearances {
    /// True if a part, the `number`-th, that reaches this far (m) from a position in the frame of the mesh, which is the wall of this index, is
    /// clear of it.
    #[inline]
    pub(super) fn is_clear(
        &mut self,
        (wall, mesh): (usize, &WallMesh),
        (number, of): (usize, (u64, u32)),
        at: &Vec3,
        reach: f64,
    ) -> bool {
        if self.0.len() <= wall {
            self.0.resize(wall + 1, Vec::new());
        }
        let known = &mut self.0[wall];
        if known.len() <= number {
            known.resize(number + 1, Clearance::default());
        }
        let clearance = &mut known[number];
        if clearance.of == of && (at - clearance.at).norm_squared() < clearance.free {
            return true;
        }
        let free = mesh.clearance(at, FAR * reach) - reach;
        *clearance = Clearance { of, at: *at, free: if free > 0.0 { free * free } else { 0.0 } };
        free > 0.0
    }
}
