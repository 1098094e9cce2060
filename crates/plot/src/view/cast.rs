//! The pixels of a scene: which item each shows, and the light on it.

use super::camera::Camera;
use super::fill::{area, fill};
use super::light::Lights;
use super::vector::{Vector, add, cross, dot, length, scale, sub, unit};
use super::{Item, Mesh, Paint, in_parallel};
use std::cmp::Reverse;
use std::ops::Range;

/// Samples per pixel along each side.
const FINER: u32 = 3;
/// Rows of pixels of a band, which one thread makes.
const BAND: u32 = 30;
/// Number of the item of a sample that shows none.
const NOTHING: u32 = u32::MAX;
/// Light of the sky and of the sun on a surface that faces them, and of the shine of the sun.
const SKY: f32 = 0.58;
const SUN: f32 = 0.62;
const SHINE: f32 = 0.07;
/// Least light on a picture in space, so that its colours can be read, and on what shades nothing.
const READABLE: f32 = 0.72;
const BRIGHT: f32 = 0.5;
/// Factor on the nearness of a ball by which rounding cannot bring a point of it nearer.
const ROUNDED: f32 = 1.000_01;
/// Least opacity of what is seen through bodies.
const FAINT: f32 = 0.12;

pub(super) struct Cast<'a> {
    pub(super) camera: Camera,
    pub(super) meshes: &'a [Mesh],
    pub(super) lights: Lights,
    /// Depth behind a surface at which what is seen through it has half its colour.
    pub(super) depth: f32,
}

/// Pixels that an item may reach, and the largest nearness that a point of it may have.
#[derive(Clone, Debug)]
struct Reach {
    rows: Range<u32>,
    columns: Range<u32>,
    nearest: f32,
    number: usize,
}

/// Content of a sample: nearness, item and triangle.
#[derive(Clone, Copy)]
struct Sample {
    near: f32,
    item: u32,
    triangle: u32,
}

const EMPTY: Sample = Sample { near: 0.0, item: NOTHING, triangle: 0 };

impl Cast<'_> {
    /// The pixels of a picture row by row from the top: the solid `items`, and what is `seen_through` them.
    pub(super) fn pixels(
        &self,
        (width, height): (u32, u32),
        items: &[Item],
        seen_through: &[Item],
        threads: usize,
    ) -> Vec<[u8; 3]> {
        let layers = [items, seen_through].map(|items| (items, self.in_order(items)));
        let bands = in_parallel(threads, height.div_ceil(BAND) as usize, |band| {
            let rows = band as u32 * BAND..((band as u32 + 1) * BAND).min(height);
            let [solid, through] =
                layers.each_ref().map(|(items, order)| self.band(items, order, width, &rows));
            let mut pixels = Vec::with_capacity((width * (rows.end - rows.start)) as usize);
            for y in 0..rows.end - rows.start {
                for x in 0..width {
                    pixels.push(self.pixel((x, rows.start + y), [items, seen_through], |layer, at| {
                        let samples = [&solid, &through][layer];
                        let index = (y * FINER + at / FINER) * width * FINER + x * FINER + at % FINER;
                        samples.get(index as usize).copied().unwrap_or(EMPTY)
                    }));
                }
            }
            pixels
        });
        bands.concat()
    }

    /// The items, the nearest first: what is behind them is passed over sooner.
    fn in_order(&self, items: &[Item]) -> Vec<Reach> {
        let mut order: Vec<(u32, Reach)> = Vec::with_capacity(items.len());
        for (number, item) in items.iter().enumerate() {
            let mesh = &self.meshes[item.mesh];
            let (centre, radius) = item.ball(mesh);
            let [x, y, near] = self.camera.place(centre);
            // Of a small ball its outline; of a large one all rows.
            let reach = radius * near;
            let half = if reach < 0.2 { 1.1 * reach * self.camera.focus + 2.0 } else { f32::INFINITY };
            // Away from the middle of the page an outline is longer.
            let (tangents, focus) = (self.camera.off_middle([x, y]), self.camera.focus);
            let wide = half * (1.0 + dot(tangents, tangents) / (focus * focus));
            let pixels = |at: f32| (at - wide).max(0.0) as u32..(at + wide).max(0.0) as u32;
            // Nearness is the inverse of a distance.
            let nearest = if reach < 0.2 { ROUNDED * near / (1.0 - reach) } else { f32::INFINITY };
            let reach = Reach { rows: pixels(y), columns: pixels(x), nearest, number };
            order.push(((near + radius * near * near).max(0.0).to_bits(), reach));
        }
        order.sort_by_key(|(near, reach)| (Reverse(*near), reach.number));
        order.into_iter().map(|(_, reach)| reach).collect()
    }

    /// The samples of some rows; none where there are no items.
    fn band(&self, items: &[Item], order: &[Reach], width: u32, rows: &Range<u32>) -> Vec<Sample> {
        if items.is_empty() {
            return Vec::new();
        }
        let camera = self.camera.finer(FINER as f32);
        let (columns, lines) = (0..width * FINER, rows.start * FINER..rows.end * FINER);
        let mut samples = vec![EMPTY; (columns.end * (lines.end - lines.start)) as usize];
        let mut places = Vec::new();
        for Reach { rows: own, columns: across, nearest, number } in order {
            if own.end < rows.start || own.start > rows.end {
                continue;
            }
            let finer = |pixels: &Range<u32>, within: &Range<u32>| {
                let [start, end] =
                    [pixels.start, pixels.end.saturating_add(1)].map(|at| at.saturating_mul(FINER));
                start.clamp(within.start, within.end)..end.clamp(within.start, within.end)
            };
            let across = finer(across, &columns);
            let mut own = finer(own, &lines);
            let is_behind = own.all(|line| {
                let first = ((line - lines.start) * columns.end) as usize;
                let line = &samples[first + across.start as usize..first + across.end as usize];
                line.iter().all(|sample| sample.near > *nearest)
            });
            if is_behind {
                continue;
            }
            let (item, mesh) = (&items[*number], &self.meshes[items[*number].mesh]);
            places.clear();
            places.extend(mesh.points.iter().map(|&point| camera.place(item.place(point))));
            for (i, triangle) in mesh.triangles.iter().enumerate() {
                let corners = triangle.corners.map(|corner| places[corner as usize]);
                // Rows run downwards: the front is negative.
                if !mesh.open && area(&corners) >= 0.0 {
                    continue;
                }
                fill(&corners, &columns, &lines, |x, y, near| {
                    let sample = &mut samples[((y - lines.start) * columns.end + x) as usize];
                    if near > sample.near {
                        *sample = Sample { near, item: *number as u32, triangle: i as u32 };
                    }
                });
            }
        }
        samples
    }

    /// The colour of a pixel: the mean over its samples. Samples of the same face of the same item share their light.
    fn pixel(
        &self,
        (x, y): (u32, u32),
        layers: [&[Item]; 2],
        sample: impl Fn(usize, u32) -> Sample,
    ) -> [u8; 3] {
        const COUNT: usize = (FINER * FINER) as usize;
        let solid: [Sample; COUNT] = std::array::from_fn(|at| sample(0, at as u32));
        let through = if layers[1].is_empty() {
            [EMPTY; COUNT]
        } else {
            std::array::from_fn(|at| sample(1, at as u32))
        };
        if solid.iter().chain(&through).all(|sample| sample.item == NOTHING) {
            return [u8::MAX; 3];
        }
        // Layer, item and face, and their colour.
        let (mut known, mut colours) = ([None; 2 * COUNT], [[0.0; 3]; 2 * COUNT]);
        let mut colour = |layer: usize, at: u32, found: Sample| {
            let item = &layers[layer][found.item as usize];
            let key =
                Some((layer, found.item, self.meshes[item.mesh].triangles[found.triangle as usize].face));
            let slot = known.iter().position(|other| *other == key || other.is_none()).unwrap_or(0);
            if known[slot].is_none() {
                let middle = |pixel: u32, at: u32| pixel as f32 + (at as f32 + 0.5) / FINER as f32;
                let place = [middle(x, at % FINER), middle(y, at / FINER), found.near];
                known[slot] = key;
                colours[slot] = self.shade(item, found, self.camera.point(place), layer);
            }
            colours[slot]
        };
        let mut sum = [0.0; 3];
        for i in 0..COUNT as u32 {
            // From the middle of the pixel outwards, for the sample that stands for the others.
            let at = (i + COUNT as u32 / 2) % COUNT as u32;
            let (solid, through) = (solid[at as usize], through[at as usize]);
            let mut seen = if solid.item == NOTHING { [1.0; 3] } else { colour(0, at, solid) };
            if through.item != NOTHING {
                let behind = if solid.item == NOTHING { 0.0 } else { 1.0 / through.near - 1.0 / solid.near };
                let part = self.depth / (self.depth + behind.max(0.0));
                let opacity = FAINT + (1.0 - FAINT) * part * part;
                seen = add(scale(seen, 1.0 - opacity), scale(colour(1, at, through), opacity));
            }
            sum = add(sum, seen);
        }
        // Light is the square of what a pixel stores, nearly.
        sum.map(|light| (255.0 * (light / COUNT as f32).clamp(0.0, 1.0).sqrt() + 0.5) as u8)
    }

    /// The light that comes from a point of an item to the eye.
    fn shade(&self, item: &Item, sample: Sample, point: Vector, layer: usize) -> Vector {
        let mesh = &self.meshes[item.mesh];
        let local = item.local(point);
        let normal = item.turn(mesh.normal(sample.triangle, local));
        let eye = unit(sub(self.camera.eye, point));
        let normal = if mesh.open && dot(normal, eye) < 0.0 { scale(normal, -1.0) } else { normal };
        let square = |colour: [f32; 3]| colour.map(|c| c / 255.0 * (c / 255.0));
        // What is seen through bodies is not in the maps of the lights.
        let number = if layer == 0 { sample.item } else { NOTHING };
        let light = || self.lights.at(point, normal, number);
        match &item.paint {
            Paint::Flat(colour) => square(colour.map(f32::from)),
            Paint::Image(image) => {
                let light = light();
                let factor = SKY * light.sky + SUN * light.seen;
                scale(
                    square(image.between(local[0], local[1])),
                    READABLE + (1.0 - READABLE) * factor.min(1.0),
                )
            }
            Paint::Solid(colour) if layer == 1 => {
                let facing = 0.45 + 0.55 * dot(normal, self.lights.towards_sun).max(0.0);
                scale(square(colour.map(f32::from)), facing)
            }
            Paint::Solid(colour) => {
                let light = light();
                let half = dot(normal, unit(add(eye, self.lights.towards_sun))).max(0.0);
                let shine = (0..5).fold(half, |power, _| power * power);
                let factor = SKY * light.sky + SUN * light.sun;
                let (factor, white) = match item.shade {
                    Some(_) => (factor, SHINE * shine * light.seen),
                    None => (BRIGHT + (1.0 - BRIGHT) * factor, 0.0),
                };
                add(scale(square(colour.map(f32::from)), factor), [white; 3])
            }
        }
    }
}

impl Mesh {
    /// The normal at a point of a triangle, between those of its corners.
    fn normal(&self, triangle: u32, point: Vector) -> Vector {
        let triangle = &self.triangles[triangle as usize];
        let [a, b, c] = triangle.corners.map(|i| self.points[i as usize]);
        let (ab, ac, arm) = (sub(b, a), sub(c, a), sub(point, a));
        let across = cross(ab, ac);
        let area = dot(across, across);
        let v = dot(cross(arm, ac), across) / area;
        let w = dot(cross(ab, arm), across) / area;
        let [p, q, r] = triangle.normals;
        add(scale(p, 1.0 - v - w), add(scale(q, v), scale(r, w)))
    }
}

impl Item {
    /// Position of a point of its mesh.
    pub(super) fn place(&self, point: Vector) -> Vector {
        add(self.at, super::vector::combine(&self.axes, point))
    }

    /// The point of its mesh that is at `point`; its axes are at right angles.
    fn local(&self, point: Vector) -> Vector {
        let arm = sub(point, self.at);
        self.axes.map(|axis| dot(arm, axis) / dot(axis, axis))
    }

    /// The unit normal that one of its mesh becomes.
    fn turn(&self, normal: Vector) -> Vector {
        let along = |i: usize| normal[i] / dot(self.axes[i], self.axes[i]);
        unit(super::vector::combine(&self.axes, [along(0), along(1), along(2)]))
    }

    /// Centre and radius of a ball that holds it.
    pub(super) fn ball(&self, mesh: &Mesh) -> (Vector, f32) {
        let half = |of: fn(f32, f32) -> f32, start: f32| -> Vector {
            let axis = |i: usize| mesh.points.iter().fold(start, |most, point| of(most, point[i]));
            [axis(0), axis(1), axis(2)]
        };
        let (lo, hi) = (half(f32::min, f32::INFINITY), half(f32::max, f32::NEG_INFINITY));
        let longest = self.axes.iter().map(|&axis| length(axis)).fold(0.0, f32::max);
        (self.place(scale(add(lo, hi), 0.5)), 0.5 * longest * length(sub(hi, lo)))
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{heap, view};
    use super::*;

    #[test]
    fn a_sample_shows_the_nearest_of_all_bodies_though_most_are_passed_over() {
        let items = heap();
        let scene = view(items.clone());
        let camera = scene.camera();
        let lights = Lights::new(&scene.meshes, &items, (scene.up, camera), ([5.0; 3], 9.0), 1);
        let cast = Cast { camera, meshes: &scene.meshes, lights, depth: 1.0 };
        let (width, rows) = (400, 170..230);
        let whole = cast.band(&items, &cast.in_order(&items), width, &rows);
        let mut nearest = vec![EMPTY; whole.len()];
        for reach in cast.in_order(&items) {
            let alone = cast.band(&items, std::slice::from_ref(&reach), width, &rows);
            for (sample, own) in nearest.iter_mut().zip(alone) {
                if own.near > sample.near {
                    *sample = own;
                }
            }
        }
        let content = |of: &Sample| (of.near.to_bits(), of.item, of.triangle);
        assert!(whole.iter().map(content).eq(nearest.iter().map(content)));
    }
}
