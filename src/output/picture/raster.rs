//! Triangles in depth order: each pixel keeps what is nearest to the eye.
//!
//! Drawn at twice the size and averaged, so that edges are smooth.

use super::canvas::Canvas;
use crate::math::Vec3;

/// Pixels drawn per pixel shown, along each side.
const FINER: u32 = 2;
/// How dark the line is where one surface ends and another begins.
const LINE: f32 = 0.3;

/// A picture in the making.
pub(super) struct Raster {
    width: u32,
    height: u32,
    /// How near each pixel is; the largest is seen.
    near: Vec<f32>,
    /// Which surface is seen, 0 for none.
    surface: Vec<u32>,
    colours: Vec<[u8; 3]>,
}

/// A corner of a triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    /// Place in pixels from the left, from the top, and towards the eye.
    pub(super) at: Vec3,
    /// How light it is, 0 to 1.
    pub(super) light: f64,
}

impl Raster {
    /// An empty picture that shows `width` by `height` pixels.
    pub(super) fn new(width: u32, height: u32, background: [u8; 3]) -> Self {
        let (width, height) = (width * FINER, height * FINER);
        let pixels = (width * height) as usize;
        Self {
            width,
            height,
            near: vec![f32::NEG_INFINITY; pixels],
            surface: vec![0; pixels],
            colours: vec![background; pixels],
        }
    }

    /// Draws a triangle of a surface; lines separate surfaces of different numbers. One that shows its back is left out.
    pub(super) fn triangle(&mut self, corners: [Corner; 3], colour: [u8; 3], surface: u32) {
        let finer = f64::from(FINER);
        let [a, b, c] = corners.map(|corner| corner.at * finer);
        // Downwards is positive here, so the front runs clockwise.
        let area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
        if area >= 0.0 {
            return;
        }
        let range = |of: fn(&Vec3) -> f64, pixels: u32| {
            let (p, q, r) = (of(&a), of(&b), of(&c));
            let lo = p.min(q).min(r).floor().max(0.0) as u32;
            let hi = p.max(q).max(r).ceil().clamp(0.0, f64::from(pixels)) as u32;
            lo..hi
        };
        let columns = range(|p| p.x, self.width);
        for y in range(|p| p.y, self.height) {
            for x in columns.clone() {
                let (px, py) = (f64::from(x) + 0.5, f64::from(y) + 0.5);
                let part = |p: &Vec3, q: &Vec3| ((q.x - p.x) * (py - p.y) - (q.y - p.y) * (px - p.x)) / area;
                let parts = [part(&b, &c), part(&c, &a), part(&a, &b)];
                if parts.iter().any(|&part| part < 0.0) {
                    continue;
                }
                let [u, v, w] = parts;
                let near = (u * a.z + v * b.z + w * c.z) as f32;
                let index = (y * self.width + x) as usize;
                if near > self.near[index] {
                    let light = u * corners[0].light + v * corners[1].light + w * corners[2].light;
                    self.near[index] = near;
                    self.surface[index] = surface;
                    self.colours[index] = colour.map(|c| (f64::from(c) * light).clamp(0.0, 255.0) as u8);
                }
            }
        }
    }

    /// The picture, with lines where surfaces meet.
    pub(super) fn canvas(self) -> Canvas {
        let (width, height) = (self.width / FINER, self.height / FINER);
        let at = |x: u32, y: u32| (y * self.width + x) as usize;
        let is_line = |x: u32, y: u32| {
            let own = self.surface[at(x, y)];
            let (left, top) = (x.saturating_sub(1), y.saturating_sub(1));
            let (right, bottom) = ((x + 1).min(self.width - 1), (y + 1).min(self.height - 1));
            let around = [at(left, y), at(right, y), at(x, top), at(x, bottom)];
            own > 0 && around.iter().any(|&other| self.surface[other] != own)
        };
        let mut shown = Vec::with_capacity((width * height) as usize);
        for y in 0..height {
            for x in 0..width {
                let mut sum = [0.0_f32; 3];
                for (i, j) in (0..FINER).flat_map(|j| (0..FINER).map(move |i| (i, j))) {
                    let (x, y) = (FINER * x + i, FINER * y + j);
                    let shade = if is_line(x, y) { LINE } else { 1.0 };
                    for (sum, c) in sum.iter_mut().zip(self.colours[at(x, y)]) {
                        *sum += shade * f32::from(c);
                    }
                }
                shown.push(sum.map(|sum| (sum / (FINER * FINER) as f32).round() as u8));
            }
        }
        Canvas::from_pixels(width, height, &shown)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle(near: f64) -> [Corner; 3] {
        [(2.0, 2.0), (2.0, 18.0), (18.0, 2.0)].map(|(x, y)| Corner {
            at: Vec3::new(x, y, near),
            light: 1.0,
        })
    }

    fn colour(canvas: &Canvas, x: usize, y: usize) -> [u8; 3] {
        let first = 3 * (y * 20 + x);
        canvas.rgb()[first..first + 3].try_into().unwrap()
    }

    #[test]
    fn the_nearest_is_seen_whatever_is_drawn_first_and_backs_are_not() {
        let (red, blue, white) = ([200, 0, 0], [0, 0, 200], [255; 3]);
        for order in [[0, 1], [1, 0]] {
            let mut raster = Raster::new(20, 20, white);
            for i in order {
                raster.triangle(triangle([1.0, 2.0][i]), [red, blue][i], 1 + i as u32);
            }
            let [a, b, c] = triangle(3.0);
            raster.triangle([a, c, b], red, 3);
            let canvas = raster.canvas();
            assert_eq!(colour(&canvas, 6, 6), blue);
            assert_eq!(colour(&canvas, 16, 16), white);
            let edge = colour(&canvas, 2, 8);
            assert!(edge[2] < 150, "a dark line: {edge:?}");
        }
    }
}
