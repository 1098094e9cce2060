//! Tree of bounding boxes over the facets of a mesh, halved at the median along the longest edge of the box of their middles.
//!
//! Nodes lie in depth-first order, each with the number of the first node after its branch, so that a search needs no stack and
//! allocates nothing. Results do not depend on the tree: callers sort what they find by facet.

use crate::math::Vec3;

/// Most facets of a leaf.
const LEAF: usize = 4;

/// A box along the axes, its lower and its upper corner.
pub(super) type Bounds = [Vec3; 2];

/// A node: a branch, whose first child follows it, or a leaf.
#[derive(Clone, Debug)]
struct Node {
    bounds: Bounds,
    /// Number of the first node after those below this one.
    after: u32,
    /// First of the facets of a leaf in `order`, and their number; none of a branch.
    first: u32,
    count: u32,
}

/// Bounding boxes of facets.
#[derive(Clone, Debug, Default)]
pub(super) struct Tree {
    nodes: Vec<Node>,
    order: Vec<u32>,
}

/// The box that holds others.
fn union(boxes: impl Iterator<Item = Bounds>) -> Bounds {
    let empty = [Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY)];
    boxes.fold(empty, |all, one| [all[0].inf(&one[0]), all[1].sup(&one[1])])
}

/// Square of the distance of a point from a box (m^2).
fn square_to(bounds: &Bounds, at: &Vec3) -> f64 {
    let square = |i: usize| {
        let beyond = (bounds[0][i] - at[i]).max(at[i] - bounds[1][i]).max(0.0);
        beyond * beyond
    };
    square(0) + square(1) + square(2)
}

impl Tree {
    /// Over these boxes.
    pub(super) fn new(boxes: &[Bounds]) -> Self {
        let mut tree = Self { nodes: Vec::new(), order: (0..boxes.len() as u32).collect() };
        if !boxes.is_empty() {
            tree.build(boxes, 0, boxes.len());
        }
        tree
    }

    fn build(&mut self, boxes: &[Bounds], from: usize, to: usize) {
        let here = self.nodes.len();
        let of = |&facet: &u32| boxes[facet as usize];
        let middle = |facet: &u32| boxes[*facet as usize][0] + boxes[*facet as usize][1];
        let order = &mut self.order[from..to];
        let bounds = union(order.iter().map(of));
        let is_leaf = order.len() <= LEAF;
        let count = if is_leaf { order.len() as u32 } else { 0 };
        self.nodes.push(Node { bounds, after: 0, first: from as u32, count });
        if !is_leaf {
            let [low, high] = union(order.iter().map(|facet| [middle(facet); 2]));
            let axis = (high - low).imax();
            let half = order.len() / 2;
            let place = |facet: &u32| middle(facet)[axis];
            order.select_nth_unstable_by(half, |a, b| place(a).total_cmp(&place(b)).then(a.cmp(b)));
            self.build(boxes, from, from + half);
            self.build(boxes, from + half, to);
        }
        self.nodes[here].after = self.nodes.len() as u32;
    }

    /// The upper end of the ray along x from a point, beyond all facets.
    pub(super) fn far(&self, at: &Vec3) -> Vec3 {
        let end = self.nodes.first().map_or(at.x, |root| root.bounds[1].x.max(at.x));
        Vec3::new(end, at.y, at.z)
    }

    /// Visits each facet whose leaf has a box that meets the given one.
    #[inline]
    pub(super) fn each(&self, [low, high]: &Bounds, mut visit: impl FnMut(u32)) {
        let mut at = 0;
        while let Some(node) = self.nodes.get(at) {
            let [lower, upper] = &node.bounds;
            let meets = (0..3).all(|i| lower[i] <= high[i] && low[i] <= upper[i]);
            if !meets {
                at = node.after as usize;
                continue;
            }
            let leaf = node.first as usize..(node.first + node.count) as usize;
            self.order[leaf].iter().for_each(|&facet| visit(facet));
            at += 1;
        }
    }

    /// Visits each facet whose leaf has a box that a segment meets, and some beside it.
    pub(super) fn along(&self, from: &Vec3, to: &Vec3, mut visit: impl FnMut(u32)) {
        let way = to - from;
        // Boxes are thicker by far more than rounding.
        let slack = 1e-12 * (from.amax() + to.amax());
        let mut at = 0;
        while let Some(node) = self.nodes.get(at) {
            let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
            for i in 0..3 {
                let [low, high] = [node.bounds[0][i] - slack, node.bounds[1][i] + slack];
                if way[i] == 0.0 {
                    leave = if from[i] < low || from[i] > high { -1.0 } else { leave };
                    continue;
                }
                let ends = [(low - from[i]) / way[i], (high - from[i]) / way[i]];
                enter = enter.max(ends[0].min(ends[1]));
                leave = leave.min(ends[0].max(ends[1]));
            }
            if enter > leave + 1e-12 {
                at = node.after as usize;
                continue;
            }
            let leaf = node.first as usize..(node.first + node.count) as usize;
            self.order[leaf].iter().for_each(|&facet| visit(facet));
            at += 1;
        }
    }

    /// The facet with the least square (m^2) of those whose square is below a bound, of equal ones the first; `square` is that of the
    /// distance of a facet from the point.
    pub(super) fn nearest(&self, at: &Vec3, bound: f64, mut square: impl FnMut(u32) -> f64) -> Option<u32> {
        let mut best = (bound, None);
        let mut look = |node: &Node, best: &mut (f64, Option<u32>)| {
            for &facet in &self.order[node.first as usize..(node.first + node.count) as usize] {
                let found = square(facet);
                if found < best.0 || found <= best.0 && best.1.is_some_and(|known| facet < known) {
                    *best = (found, Some(facet));
                }
            }
        };
        // First down to the leaf whose boxes are nearest, for a bound.
        let mut node = 0;
        while self.nodes.get(node).is_some_and(|node| node.count == 0) {
            let (one, other) = (node + 1, self.nodes[node + 1].after as usize);
            let [near, far] = [one, other].map(|child| square_to(&self.nodes[child].bounds, at));
            node = if far < near { other } else { one };
        }
        if let Some(leaf) = self.nodes.get(node) {
            look(leaf, &mut best);
        }
        let mut node = 0;
        while let Some(here) = self.nodes.get(node) {
            if square_to(&here.bounds, at) > best.0 {
                node = here.after as usize;
                continue;
            }
            look(here, &mut best);
            node += 1;
        }
        best.1
    }
}
