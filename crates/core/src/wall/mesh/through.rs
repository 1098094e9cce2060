//! Places where a mesh runs through itself: an edge that crosses a facet with which it shares no vertex, by exact predicates.

use super::WallMesh;
use super::crossing::exact;
use crate::math::Vec3;
use robust::orient3d;

/// Edges of a mesh that run through its facets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SelfCrossing {
    /// Number of pairs of an edge and a facet.
    pub count: usize,
    /// Position of the first (m).
    pub at: Vec3,
}

impl WallMesh {
    /// Edges that run through the interior of a facet; those that only touch one, or lie in its plane, are none. None if there are none.
    pub fn self_crossing(&self) -> Option<SelfCrossing> {
        let mut found: Option<SelfCrossing> = None;
        for ends in &self.edges.ends {
            let [from, to] = ends.map(|vertex| self.vertices[vertex as usize]);
            let [start, end] = [from, to].each_ref().map(exact);
            self.tree.along(&from, &to, |facet| {
                if self.facets[facet as usize].vertices.iter().any(|vertex| ends.contains(vertex)) {
                    return;
                }
                let [a, b, c] = self.corners(facet).each_ref().map(exact);
                let [near, far] = [start, end].map(|at| orient3d(a, b, c, at));
                if near * far >= 0.0 {
                    return;
                }
                let around = [(a, b), (b, c), (c, a)].map(|(a, b)| orient3d(start, end, a, b));
                if around.iter().all(|side| *side > 0.0) || around.iter().all(|side| *side < 0.0) {
                    let at = from + (to - from) * (near / (near - far));
                    found.get_or_insert(SelfCrossing { count: 0, at }).count += 1;
                }
            });
        }
        found
    }
}
