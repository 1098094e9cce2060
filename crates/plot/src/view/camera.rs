//! The eye, and where it sees things on the page.

use super::vector::{Vector, add, dot, length, scale, screen, sub, unit};
use crate::drawing::Area;

/// Distance of the eye from the middle of the box over half its diagonal.
const DISTANCE: f32 = 4.5;
/// Cosine from which on two directions count as parallel.
const ALONG: f32 = 0.999;

/// Projection of a point in space to a page.
#[derive(Clone, Copy, Debug)]
pub(super) struct Camera {
    pub(super) eye: Vector,
    pub(super) right: Vector,
    pub(super) up: Vector,
    /// Towards the eye.
    pub(super) back: Vector,
    /// Pixels for a length at distance one, and the pixel that the eye looks at.
    pub(super) focus: f32,
    centre: [f32; 2],
}

impl Camera {
    /// The eye in the direction `from` of a box between two corners, which fills an area of the page.
    pub(super) fn new(from: Vector, up: Vector, edges: [Vector; 2], zoom: f32, (l, t, r, b): Area) -> Self {
        let (middle, back) = (scale(add(edges[0], edges[1]), 0.5), unit(from));
        // Seen along the vertical, y points up.
        let helper =
            if dot(back, up).abs() > ALONG { [0.0, f32::from(up[1] == 0.0), up[1].abs()] } else { up };
        let (right, up) = screen(back, helper);
        let eye = add(middle, scale(back, DISTANCE * 0.5 * length(sub(edges[1], edges[0]))));
        let mut camera = Self { eye, right, up, back, focus: 1.0, centre: [0.0; 2] };
        let (mut lo, mut hi) = ([f32::INFINITY; 2], [f32::NEG_INFINITY; 2]);
        for corner in corners(edges) {
            let at = camera.place(corner);
            for i in 0..2 {
                lo[i] = lo[i].min(at[i]);
                hi[i] = hi[i].max(at[i]);
            }
        }
        camera.focus = zoom * ((r - l) / (hi[0] - lo[0])).min((b - t) / (hi[1] - lo[1]));
        let shift = |i: usize, middle: f32| middle - 0.5 * (lo[i] + hi[i]) * camera.focus;
        camera.centre = [shift(0, 0.5 * (l + r)), shift(1, 0.5 * (t + b))];
        camera
    }

    /// Column and row of a point, and the inverse of its distance along the line of sight.
    pub(super) fn place(&self, point: Vector) -> Vector {
        let arm = sub(point, self.eye);
        let near = -1.0 / dot(arm, self.back);
        let [x, y] = [dot(arm, self.right), -dot(arm, self.up)].map(|x| x * near * self.focus);
        [x + self.centre[0], y + self.centre[1], near]
    }

    /// A place on the page from where the camera looks.
    pub(super) fn off_middle(&self, [x, y]: [f32; 2]) -> Vector {
        [x - self.centre[0], y - self.centre[1], 0.0]
    }

    /// The point that is seen at a [place](Self::place).
    pub(super) fn point(&self, [x, y, near]: Vector) -> Vector {
        let [right, down] = [x - self.centre[0], y - self.centre[1]].map(|x| x / (near * self.focus));
        let across = add(scale(self.right, right), scale(self.up, -down));
        add(self.eye, sub(across, scale(self.back, 1.0 / near)))
    }

    /// The same on a page with a multiple of the pixels along each side.
    pub(super) fn finer(self, times: f32) -> Self {
        Self { focus: times * self.focus, centre: self.centre.map(|x| times * x), ..self }
    }
}

/// The corners of a box between two of them; bit `i` of the number of a corner is its side along axis `i`.
pub(super) fn corners(edges: [Vector; 2]) -> [Vector; 8] {
    std::array::from_fn(|n| std::array::from_fn(|i| edges[n >> i & 1][i]))
}
