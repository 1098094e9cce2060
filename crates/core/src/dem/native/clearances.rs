//! Facets that parts of bodies may touch until they have moved: searches that are left out. No result depends on them.

use crate::math::Vec3;
use crate::wall::WallMesh;

/// Distance (reaches of the part) up to which a mesh is looked for.
const FAR: f64 = 4.0;
/// Way (reaches of the part) for which the facets near to a part are kept.
const KEPT: f64 = 0.05;

/// A part, and what it may touch.
#[derive(Clone, Debug, Default)]
struct Clearance {
    /// Id of the particle, and index of the part.
    of: (u64, u32),
    /// Position in the frame of the mesh (m).
    at: Vec3,
    /// Square of the way from there on which it touches no other facets (m^2).
    free: f64,
    /// Facets that it may touch on the way, ascending.
    facets: Vec<u32>,
}

/// By wall and owned part.
#[derive(Clone, Debug, Default)]
pub(super) struct Clearances(Vec<Vec<Clearance>>);

impl Clearances {
    /// The facets that a part, the `number`-th, may touch, ascending; it reaches this far (m) from a position in the frame of the mesh, which is
    /// the wall of this index.
    #[inline]
    pub(super) fn facets(
        &mut self,
        (wall, mesh): (usize, &WallMesh),
        (number, of): (usize, (u64, u32)),
        at: &Vec3,
        reach: f64,
    ) -> &[u32] {
        if self.0.len() <= wall {
            self.0.resize(wall + 1, Vec::new());
        }
        let known = &mut self.0[wall];
        if known.len() <= number {
            known.resize(number + 1, Clearance::default());
        }
        let clearance = &mut known[number];
        if clearance.of != of || (at - clearance.at).norm_squared() >= clearance.free {
            let (clear, kept) = (mesh.clearance(at, FAR * reach) - reach, KEPT * reach);
            let free = if clear > kept { clear } else { kept };
            let limit = reach + 1.01 * kept;
            let mut facets = if clear > kept { Vec::new() } else { mesh.facets_near(at, limit) };
            facets.retain(|&facet| mesh.nearest_on(facet, at).square <= limit * limit);
            *clearance = Clearance { of, at: *at, free: free * free, facets };
        }
        &clearance.facets
    }
}
