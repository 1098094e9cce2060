//! The samples that a triangle covers.

use std::ops::Range;

/// Twice the area of a triangle on the screen (x to the right, y downwards), negative if it is seen from the side from which its
/// corners run counter-clockwise.
pub(super) fn area([a, b, c]: &[[f32; 3]; 3]) -> f32 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Calls `visit` with the column, the row and the third coordinate of every sample in a triangle, between those of its corners; samples lie
/// in the middle of cells of size one.
pub(super) fn fill(
    corners: &[[f32; 3]; 3],
    columns: &Range<u32>,
    rows: &Range<u32>,
    mut visit: impl FnMut(u32, u32, f32),
) {
    let area = area(corners);
    if area == 0.0 {
        return;
    }
    let [a, b, c] = corners;
    let range = |axis: usize, within: &Range<u32>| {
        let [lo, hi] = [f32::min, f32::max].map(|of| of(a[axis], of(b[axis], c[axis])));
        let clamped = |x: f32| x.clamp(within.start as f32, within.end as f32) as u32;
        clamped((lo - 0.5).ceil())..clamped((hi + 0.5).floor())
    };
    let columns = range(0, columns);
    let slope = |p: &[f32; 3], q: &[f32; 3]| [(p[1] - q[1]) / area, (q[0] - p[0]) / area];
    let [u, v, w] = [slope(b, c), slope(c, a), slope(a, b)];
    // Of a triangle that is seen from its edge rounding may be larger than the triangle.
    let [least, most] = [f32::min, f32::max].map(|of| of(a[2], of(b[2], c[2])));
    for y in range(1, rows) {
        let down = y as f32 + 0.5;
        let start = |p: &[f32; 3], slope: [f32; 2]| slope[0] * (0.5 - p[0]) + slope[1] * (down - p[1]);
        let starts = [start(b, u), start(c, v), start(a, w)];
        for x in columns.clone() {
            let right = x as f32;
            let parts = [starts[0] + u[0] * right, starts[1] + v[0] * right, starts[2] + w[0] * right];
            if parts[0] >= 0.0 && parts[1] >= 0.0 && parts[2] >= 0.0 {
                let third = parts[0] * a[2] + parts[1] * b[2] + parts[2] * c[2];
                visit(x, y, third.clamp(least, most));
            }
        }
    }
}
