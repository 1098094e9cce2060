//! Triangles in depth order: each pixel keeps what is nearest to the eye.
//!
//! Drawn at twice the size and averaged, so that edges are smooth.

use crate::image::Image;

/// Pixels drawn per pixel shown, along each side.
const FINER: u32 = 2;
/// Brightness of the line between surfaces.
const LINE: f32 = 0.3;

/// An image of solid bodies: of their triangles, each pixel shows the nearest.
pub struct Raster {
    width: u32,
    height: u32,
    /// Row by row from the top.
    pixels: Vec<Pixel>,
}

/// Content of a pixel: distance towards the eye, number of the surface (0 for none), colour.
#[derive(Clone, Copy)]
struct Pixel {
    near: f32,
    surface: u32,
    colour: [u8; 3],
}

/// A corner of a triangle.
#[derive(Clone, Copy, Debug)]
pub struct Corner {
    /// Position in pixels from the left, from the top, and towards the eye.
    pub at: [f64; 3],
    /// Brightness, 0 to 1.
    pub light: f64,
}

impl Raster {
    /// An empty picture that shows `width` by `height` pixels.
    pub fn new(width: u32, height: u32, background: [u8; 3]) -> Self {
        let (width, height) = (width * FINER, height * FINER);
        let empty = Pixel { near: f32::NEG_INFINITY, surface: 0, colour: background };
        Self { width, height, pixels: vec![empty; (width * height) as usize] }
    }

    /// Draws a triangle of a surface; lines separate surfaces of different numbers. One that shows its back is left out.
    pub fn triangle(&mut self, corners: [Corner; 3], colour: [u8; 3], surface: u32) {
        let finer = f64::from(FINER);
        let [a, b, c] = corners.map(|corner| corner.at.map(|at| at * finer));
        // Downwards is positive here, so the front runs clockwise.
        let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        if area >= 0.0 {
            return;
        }
        let range = |axis: usize, pixels: u32| {
            let (p, q, r) = (a[axis], b[axis], c[axis]);
            let lo = p.min(q).min(r).floor().max(0.0) as u32;
            let hi = p.max(q).max(r).ceil().clamp(0.0, f64::from(pixels)) as u32;
            lo..hi
        };
        let columns = range(0, self.width);
        for y in range(1, self.height) {
            for x in columns.clone() {
                let (px, py) = (f64::from(x) + 0.5, f64::from(y) + 0.5);
                let part = |p: &[f64; 3], q: &[f64; 3]| {
                    ((q[0] - p[0]) * (py - p[1]) - (q[1] - p[1]) * (px - p[0])) / area
                };
                let parts = [part(&b, &c), part(&c, &a), part(&a, &b)];
                if parts.iter().any(|&part| part < 0.0) {
                    continue;
                }
                let [u, v, w] = parts;
                let near = (u * a[2] + v * b[2] + w * c[2]) as f32;
                let pixel = &mut self.pixels[(y * self.width + x) as usize];
                if near > pixel.near {
                    let light = u * corners[0].light + v * corners[1].light + w * corners[2].light;
                    let colour = colour.map(|c| (f64::from(c) * light).clamp(0.0, 255.0) as u8);
                    *pixel = Pixel { near, surface, colour };
                }
            }
        }
    }

    /// The picture, with lines where surfaces meet.
    pub fn image(self) -> Image {
        let (width, height) = (self.width / FINER, self.height / FINER);
        let pixel = |x: u32, y: u32| self.pixels[(y * self.width + x) as usize];
        let is_line = |x: u32, y: u32| {
            let own = pixel(x, y).surface;
            let (left, top) = (x.saturating_sub(1), y.saturating_sub(1));
            let (right, bottom) = ((x + 1).min(self.width - 1), (y + 1).min(self.height - 1));
            let around = [(left, y), (right, y), (x, top), (x, bottom)];
            own > 0 && around.iter().any(|&(x, y)| pixel(x, y).surface != own)
        };
        let average = |(x, y): (u32, u32)| {
            let mut sum = [0.0_f32; 3];
            for (i, j) in (0..FINER).flat_map(|j| (0..FINER).map(move |i| (i, j))) {
                let (x, y) = (FINER * x + i, FINER * y + j);
                let shade = if is_line(x, y) { LINE } else { 1.0 };
                for (sum, c) in sum.iter_mut().zip(pixel(x, y).colour) {
                    *sum += shade * f32::from(c);
                }
            }
            sum.map(|sum| (sum / (FINER * FINER) as f32).round() as u8)
        };
        let shown = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(average);
        Image::new(width, height, &shown.collect::<Vec<_>>())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle(near: f64) -> [Corner; 3] {
        [(2.0, 2.0), (2.0, 18.0), (18.0, 2.0)].map(|(x, y)| Corner { at: [x, y, near], light: 1.0 })
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
            let image = raster.image();
            assert_eq!(image.colour(6, 6), blue);
            assert_eq!(image.colour(16, 16), white);
            let edge = image.colour(2, 8);
            assert!(edge[2] < 150, "a dark line: {edge:?}");
        }
    }
}
