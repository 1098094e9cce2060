//! Light from many directions: that of the sky from all sides, for soft shade between bodies, and that of a sun of some width.
//!
//! Each direction has a map of what is nearest to it (Williams 1978); light that many of them do not reach is ambient occlusion
//! (Tarini, Cignoni, Montani 2006, "Ambient occlusion and edge cueing").

use super::camera::Camera;
use super::fill::{area, fill};
use super::vector::{Vector, add, combine, cross, dot, scale, screen, unit};
use super::{Item, Mesh, in_parallel};
use std::ops::Range;

/// Directions of the sky of a small scene, and the fewest of a large one.
const SKY: usize = 112;
const LEAST_SKY: usize = 32;
/// As many triangles as the maps of the sky take together.
const SKY_TRIANGLES: usize = 16_000_000;
/// Cells along the edge of a map of the sky.
const SKY_CELLS: u32 = 224;
/// Directions of the sun, the sine of the angle that it is wide, and cells along the edge of its maps.
const SUN: usize = 16;
const SUN_WIDTH: f32 = 0.06;
const SUN_CELLS: u32 = 640;
/// Cells by which what shades is nearer to the light, since a map is coarse.
const SLACK: f32 = 1.5;
/// Part of a distance by which rounding cannot bring a point nearer.
const ROUNDED: f32 = 1e-5;
/// Cosine and sine of the golden angle, which spreads directions evenly.
const GOLDEN: [f32; 2] = [-0.737_368_9, 0.675_490_3];

pub(super) struct Lights {
    sky: Vec<Light>,
    sun: Vec<Light>,
    /// Middle of the sun.
    pub(super) towards_sun: Vector,
}

/// Light that arrives at a surface, each 1 where nothing shades a surface that lies flat or faces the sun.
#[derive(Clone, Copy)]
pub(super) struct Arriving {
    pub(super) sky: f32,
    pub(super) sun: f32,
    /// Part of the sun that is seen, whatever the surface faces.
    pub(super) seen: f32,
}

struct Light {
    towards: Vector,
    right: Vector,
    up: Vector,
    weight: f32,
    /// Of the cells: the corner of the first, and cells per unit of length.
    corner: [f32; 2],
    scale: f32,
    /// Cells that anything may shade.
    columns: Range<u32>,
    rows: Range<u32>,
    /// In these, row by row, distance towards the light and number of what is nearest to it.
    map: Vec<(f32, u32)>,
}

impl Lights {
    /// The light in a scene with a vertical `up`; `centre` and `radius` are of a ball that holds all items.
    pub(super) fn new(
        meshes: &[Mesh],
        items: &[Item],
        (up, camera): (Vector, Camera),
        (centre, radius): (Vector, f32),
        threads: usize,
    ) -> Self {
        let back = camera.back;
        // Also from above or below, where the camera alone knows what is right.
        let level = unit(cross(camera.right, up));
        let right = cross(up, level);
        let sides = [right, level, up];
        let triangles: usize =
            items.iter().filter_map(|item| Some(meshes[item.shade?].triangles.len())).sum();
        let count = (SKY_TRIANGLES / triangles.max(1)).clamp(LEAST_SKY, SKY);
        let mut turn = [1.0, 0.0];
        let mut spread = |radius: f32| {
            turn = [turn[0] * GOLDEN[0] - turn[1] * GOLDEN[1], turn[0] * GOLDEN[1] + turn[1] * GOLDEN[0]];
            [radius * turn[0], radius * turn[1]]
        };
        let mut directions = Vec::new();
        for i in 0..count {
            let z = 1.0 - (2 * i + 1) as f32 / count as f32;
            let [x, y] = spread((1.0 - z * z).max(0.0).sqrt());
            directions.push((combine(&sides, [x, y, z]), 0.3 + 0.7 * (0.5 + 0.5 * z), SKY_CELLS));
        }
        let towards_sun = unit(add(add(scale(up, 0.75), scale(right, -0.4)), scale(back, 0.55)));
        let (across, along) = screen(towards_sun, if dot(towards_sun, up) > 0.95 { level } else { up });
        for i in 0..SUN {
            let [x, y] = spread(SUN_WIDTH * ((i as f32 + 0.5) / SUN as f32).sqrt());
            let direction = unit(add(towards_sun, add(scale(across, x), scale(along, y))));
            directions.push((direction, 1.0 / SUN as f32, SUN_CELLS));
        }
        let flat = |(towards, weight, _): &(Vector, f32, u32)| weight * dot(up, *towards).max(0.0);
        let whole: f32 = directions[..count].iter().map(flat).sum();
        for (_, weight, _) in &mut directions[..count] {
            *weight /= whole;
        }
        let shading = items.iter().filter_map(|item| Some(item.ball(&meshes[item.shade?])));
        let balls: Vec<(Vector, f32)> = shading.collect();
        let mut sky = in_parallel(threads, directions.len(), |i| {
            let (towards, weight, cells) = directions[i];
            let helper = if dot(towards, up).abs() > 0.95 { level } else { up };
            Light::new((towards, helper), weight, cells, (centre, radius), (meshes, items, &balls))
        });
        let sun = sky.split_off(count);
        Self { sky, sun, towards_sun }
    }

    pub(super) fn at(&self, point: Vector, normal: Vector, item: u32) -> Arriving {
        let facing = |light: &Light| {
            let cosine = dot(normal, light.towards);
            if cosine > 0.0 && light.reaches(point, item) { cosine } else { 0.0 }
        };
        let seen = self.sun.iter().map(|light| if facing(light) > 0.0 { light.weight } else { 0.0 }).sum();
        Arriving {
            sky: self.sky.iter().map(|light| light.weight * facing(light)).sum(),
            sun: seen * dot(normal, self.towards_sun).max(0.0),
            seen,
        }
    }
}

impl Light {
    fn new(
        (towards, helper): (Vector, Vector),
        weight: f32,
        cells: u32,
        (centre, radius): (Vector, f32),
        (meshes, items, balls): (&[Mesh], &[Item], &[(Vector, f32)]),
    ) -> Self {
        let (right, up) = screen(towards, helper);
        let corner = [dot(centre, right) - radius, dot(centre, up) - radius];
        let scale = cells as f32 / (2.0 * radius);
        let mut light =
            Self { towards, right, up, weight, corner, scale, columns: 0..0, rows: 0..0, map: Vec::new() };
        let places = || balls.iter().map(|&(centre, radius)| (light.place(centre), radius * scale));
        [light.columns, light.rows] = [0, 1].map(|axis| {
            let lo = places().map(|(at, reach)| at[axis] - reach).fold(cells as f32, f32::min) - 1.0;
            let hi = places().map(|(at, reach)| at[axis] + reach).fold(0.0, f32::max) + 1.0;
            lo.max(0.0) as u32..(hi.ceil() as u32).min(cells)
        });
        let (columns, rows) = (light.columns.clone(), light.rows.clone());
        light.map = vec![(f32::NEG_INFINITY, u32::MAX); columns.len() * rows.len()];
        let mut points = Vec::new();
        // The nearest first: what is behind them is passed over.
        let shading = items.iter().enumerate().filter_map(|(number, item)| Some((number, item, item.shade?)));
        let mut order: Vec<_> =
            shading.zip(balls).map(|(of, ball)| (light.place(ball.0)[2], ball, of)).collect();
        order.sort_by(|(a, ..), (b, ..)| b.total_cmp(a));
        for (_, ball, (number, item, mesh)) in order {
            if light.hides(ball) {
                continue;
            }
            let mesh = &meshes[mesh];
            points.clear();
            points.extend(mesh.points.iter().map(|&point| light.place(item.place(point))));
            for triangle in &mesh.triangles {
                let corners = triangle.corners.map(|i| points[i as usize]);
                // Rows of the map run upwards: what faces the light turns the other way round than on the screen.
                if area(&corners) > 0.0 || mesh.open {
                    fill(&corners, &columns, &rows, |x, y, near| {
                        let cell = &mut light.map
                            [light.columns.len() * (y - rows.start) as usize + (x - columns.start) as usize];
                        let number = number as u32;
                        if near > cell.0 || (near >= cell.0 && number < cell.1) {
                            *cell = (near, number);
                        }
                    });
                }
            }
        }
        light
    }

    /// True if nothing in a ball is nearer to the light than what the map has there: most of many bodies.
    fn hides(&self, (centre, radius): &(Vector, f32)) -> bool {
        let [x, y, near] = self.place(*centre);
        let (reach, nearest) = (radius * self.scale, near + radius + ROUNDED * (near.abs() + radius));
        let cells = |at: f32, within: &Range<u32>| {
            let clamped = |x: f32| x.clamp(within.start as f32, within.end as f32) as u32;
            clamped(at - reach - 1.0)..clamped(at + reach + 2.0)
        };
        let (columns, width) = (cells(x, &self.columns), self.columns.len());
        cells(y, &self.rows).all(|row| {
            let start = width * (row - self.rows.start) as usize;
            let at = |column: u32| start + (column - self.columns.start) as usize;
            self.map[at(columns.start)..at(columns.end)].iter().all(|(found, _)| *found > nearest)
        })
    }

    /// Column, row, and distance towards the light.
    fn place(&self, point: Vector) -> Vector {
        let [x, y] = [dot(point, self.right) - self.corner[0], dot(point, self.up) - self.corner[1]];
        [x * self.scale, y * self.scale, dot(point, self.towards)]
    }

    /// True if nothing but the item itself stands between a point of it and the light.
    fn reaches(&self, point: Vector, item: u32) -> bool {
        let [x, y, near] = self.place(point);
        let within = |x: f32, cells: &Range<u32>| x >= cells.start as f32 && x < cells.end as f32;
        if !within(x, &self.columns) || !within(y, &self.rows) {
            return true;
        }
        let (row, column) = (y as u32 - self.rows.start, x as u32 - self.columns.start);
        let (nearest, number) = self.map[self.columns.len() * row as usize + column as usize];
        number == item || nearest <= near + SLACK / self.scale
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{heap, view};
    use super::*;

    #[test]
    fn a_map_has_the_nearest_of_all_bodies_though_most_are_passed_over() {
        let items = heap();
        let scene = view(items.clone());
        let ball = ([5.0; 3], 9.0);
        let lights = |items: &[Item]| Lights::new(&scene.meshes, items, (scene.up, scene.camera()), ball, 1);
        let all = lights(&items);
        let some: Vec<(usize, &Light)> = all.sky.iter().chain(&all.sun).enumerate().step_by(17).collect();
        let mut nearest: Vec<_> =
            some.iter().map(|(_, whole)| vec![(f32::NEG_INFINITY, u32::MAX); whole.map.len()]).collect();
        let mut passed_over = vec![0; some.len()];
        for (number, item) in items.iter().enumerate() {
            let alone = lights(std::slice::from_ref(item));
            let alone: Vec<&Light> = alone.sky.iter().chain(&alone.sun).collect();
            for (k, (n, whole)) in some.iter().enumerate() {
                passed_over[k] += usize::from(whole.hides(&item.ball(&scene.meshes[0])));
                let alone = alone[*n];
                for (y, row) in alone.rows.clone().zip(alone.map.chunks_exact(alone.columns.len())) {
                    for (x, (near, _)) in alone.columns.clone().zip(row) {
                        let line = whole.columns.len() * (y - whole.rows.start) as usize;
                        let cell = &mut nearest[k][line + (x - whole.columns.start) as usize];
                        if *near > cell.0 {
                            *cell = (*near, number as u32);
                        }
                    }
                }
            }
        }
        for (((n, whole), nearest), passed_over) in some.iter().zip(&nearest).zip(&passed_over) {
            assert!(whole.map == *nearest, "direction {n}");
            assert!(*passed_over > 50, "direction {n}: {passed_over}");
        }
    }
}
