//! Solid bodies in a box, seen in perspective with light and shade, with colour bars.

mod camera;
mod cast;
mod fill;
mod light;
#[cfg(test)]
mod tests;
mod vector;

use crate::colour::INK;
use crate::drawing::{Align, Drawing, Figure, Mark, Readings, Stroke};
use crate::image::Image;
use crate::markup::literal;
use crate::picture::{Bar, LABEL, TITLE};
use camera::{Camera, corners};
use cast::Cast;
use light::Lights;
use std::sync::atomic::{AtomicUsize, Ordering};
use vector::{add, cross, length, scale, sub, unit};

/// A surface of triangles.
#[derive(Clone, Debug)]
pub struct Mesh {
    /// Corners of the triangles.
    pub points: Vec<[f32; 3]>,
    /// The triangles.
    pub triangles: Vec<Triangle>,
    /// True if it is seen from both sides.
    pub open: bool,
}

/// A triangle of a mesh, its corners counter-clockwise seen from outside.
#[derive(Clone, Copy, Debug)]
pub struct Triangle {
    /// Indices of its points.
    pub corners: [u32; 3],
    /// Normals of the surface there, outwards.
    pub normals: [[f32; 3]; 3],
    /// Number of the smooth face that it belongs to.
    pub face: u32,
}

/// A mesh somewhere in space: its point `p` is at `at + p[0] axes[0] + p[1] axes[1] + p[2] axes[2]`.
#[derive(Clone, Debug)]
pub struct Item {
    /// Index of the mesh that is seen.
    pub mesh: usize,
    /// Index of the mesh that shades other items, a coarser one; none if it shades nothing.
    pub shade: Option<usize>,
    /// Three vectors at right angles.
    pub axes: [[f32; 3]; 3],
    /// Position of the origin of the mesh.
    pub at: [f32; 3],
    /// Its looks.
    pub paint: Paint,
}

/// Looks of an item.
#[derive(Clone, Debug)]
pub enum Paint {
    /// A colour in light and shade.
    Solid([u8; 3]),
    /// A colour, whatever the light.
    Flat([u8; 3]),
    /// An image whose colours stay readable; its left edge lies at 0 of the first axis, its upper edge at 0 of the second, the others
    /// at 1.
    Image(Image),
}

/// Contents of a view.
#[derive(Clone, Debug)]
pub struct View {
    /// Name above, on the left; no symbols.
    pub title: String,
    /// Above, on the right.
    pub caption: String,
    /// Width and height of the page (pixels).
    pub size: [u32; 2],
    /// Direction from the middle of the box to the eye, not zero.
    pub from: [f32; 3],
    /// Unit vector upwards, along an axis.
    pub up: [f32; 3],
    /// Factor by which all is larger than it would fill the page.
    pub zoom: f32,
    /// The lower and the upper corner of a box, which fills the page.
    pub edges: [[f32; 3]; 2],
    /// Surfaces.
    pub meshes: Vec<Mesh>,
    /// Solid items.
    pub items: Vec<Item>,
    /// Items that are seen through the solid ones, the fainter the deeper; they cast no shade.
    pub seen_through: Vec<Item>,
    /// From the top.
    pub bars: Vec<Bar>,
    /// A length for comparison, as long as it is in the middle of the box, and its name.
    pub scale: (f32, String),
    /// Threads that draw; the picture does not depend on them.
    pub threads: usize,
}

/// Colour of the edges of the box.
const EDGE: [u8; 3] = [120, 124, 130];
/// Width of the edges (pixels).
const EDGE_WIDTH: f32 = 1.7;
/// Sides of a tube.
const SIDES: u32 = 10;
/// Smallest page whose labels, bars and margins have their usual size (pixels), and how small they become on smaller ones.
const FULL: [f32; 2] = [1000.0, 750.0];
const LEAST_PART: f32 = 0.45;
/// Margin of the page, and length of the cross of axes (pixels).
const MARGIN: f32 = 28.0;
const CROSS: f32 = 46.0;
/// Half the length of the lines at the ends of the scale (pixels).
const SCALE_END: f32 = 7.0;
/// Depth at which what is seen through bodies has half its colour, over the diagonal of the box.
const DEPTH: f32 = 0.12;

impl View {
    /// Draws the view.
    pub fn figure(&self) -> Figure {
        let [width, height] = self.size;
        let (camera, right, part) = (self.camera(), self.right(), self.part());
        let (margin, size) = (part * MARGIN, part * TITLE);
        let mut drawing = Drawing::default();
        drawing.0.push(Mark::Image(self.image(camera), (0, 0)));
        drawing.text(&literal(&self.title), size, (margin, margin + 0.8 * size), Align::Start, INK);
        let end = (width as f32 - margin, margin + 0.8 * size);
        drawing.text(&self.caption, size, end, Align::End, INK);
        self.draw_axes(&mut drawing, camera);
        self.draw_scale(&mut drawing, camera);
        let bar_height = self.bar_height();
        for (i, bar) in self.bars.iter().enumerate() {
            let top = 3.2 * margin + i as f32 * (bar_height + 1.5 * margin);
            bar.draw(&mut drawing, right, (top, top + bar_height), (part, bar_height + margin));
        }
        let title = format!("{}: {}", self.title, self.caption);
        Figure { size: (width as f32, height as f32), title, drawing, readings: Readings::default() }
    }

    /// Size of labels, bars and margins over the usual one.
    fn part(&self) -> f32 {
        let [across, along] = [0, 1].map(|i| self.size[i] as f32 / FULL[i]);
        across.min(along).clamp(LEAST_PART, 1.0)
    }

    /// Right edge of the space for the box.
    fn right(&self) -> f32 {
        let (height, part) = (self.bar_height(), self.part());
        let space = self.bars.iter().map(|bar| bar.space(height, part)).fold(0.0, f32::max);
        self.size[0] as f32 - space - part * MARGIN
    }

    fn bar_height(&self) -> f32 {
        let (margin, bars) = (self.part() * MARGIN, self.bars.len().max(1) as f32);
        ((self.size[1] as f32 - 5.0 * margin) / bars - 1.5 * margin).max(1.0)
    }

    fn middle(&self) -> [f32; 3] {
        scale(add(self.edges[0], self.edges[1]), 0.5)
    }

    fn camera(&self) -> Camera {
        let margin = self.part() * MARGIN;
        let (left, top) = (1.5 * margin, 2.6 * margin);
        let (right, bottom) = (self.right() - margin, self.size[1] as f32 - 1.5 * margin);
        // A page too small for its bars still has the box upright.
        let area = (left, top, right.max(left + 1.0), bottom.max(top + 1.0));
        Camera::new(self.from, self.up, self.edges, self.zoom, area)
    }

    /// The eye, and a point that is seen at a position on the page (pixels).
    pub fn line_of_sight(&self, [x, y]: [f32; 2]) -> [[f32; 3]; 2] {
        let camera = self.camera();
        [camera.eye, camera.point([x, y, camera.place(self.middle())[2]])]
    }

    /// The box and what is in it.
    fn image(&self, camera: Camera) -> Image {
        let threads = self.threads.max(1);
        let (mut meshes, mut items) = (self.meshes.clone(), self.items.clone());
        meshes.push(Mesh::tube());
        items.extend(self.box_edges(camera, meshes.len() - 1));
        let diagonal = length(sub(self.edges[1], self.edges[0]));
        let middle = self.middle();
        let radius = items.iter().filter(|item| item.shade.is_some()).fold(0.5 * diagonal, |most, item| {
            let (centre, radius) = item.ball(&meshes[item.mesh]);
            most.max(length(sub(centre, middle)) + radius)
        });
        let lights = Lights::new(&meshes, &items, (self.up, camera), (middle, radius), threads);
        let cast = Cast { camera, meshes: &meshes, lights, depth: DEPTH * diagonal };
        let [width, height] = self.size;
        let pixels = cast.pixels((width, height), &items, &self.seen_through, threads);
        Image::new(width, height, &pixels)
    }

    /// The edges of the box as tubes of the same width on the page.
    fn box_edges(&self, camera: Camera, tube: usize) -> Vec<Item> {
        let corners = corners(self.edges);
        let pairs =
            (0..8).flat_map(|n| [1, 2, 4].map(|bit| (n, n | bit)).into_iter().filter(|(a, b)| a != b));
        let edge = |(a, b): (usize, usize)| {
            let middle = scale(add(corners[a], corners[b]), 0.5);
            let radius = 0.5 * EDGE_WIDTH / (camera.place(middle)[2] * camera.focus);
            Item::tube(tube, corners[a], corners[b], radius, Paint::Flat(EDGE))
        };
        pairs.map(edge).collect()
    }

    /// A length for comparison, right of the cross of axes and below the box.
    fn draw_scale(&self, drawing: &mut Drawing, camera: Camera) {
        let (part, (length, name)) = (self.part(), &self.scale);
        let left = part * (2.0 * (MARGIN + CROSS) + MARGIN);
        let right = left + length * camera.place(self.middle())[2] * camera.focus;
        let (y, end, label) =
            (self.size[1] as f32 - 0.75 * part * MARGIN, part * SCALE_END, part * 0.8 * LABEL);
        let stroke = Stroke::new(INK, 2.5 * part.max(0.6));
        drawing.line(&[(left, y), (right, y)], stroke);
        for x in [left, right] {
            drawing.line(&[(x, y - end), (x, y + end)], stroke);
        }
        drawing.text(name, label, (right + 2.0 * end, y + 0.36 * label), Align::Start, INK);
    }

    /// A small cross of the axes in the lower left corner.
    fn draw_axes(&self, drawing: &mut Drawing, camera: Camera) {
        let middle = self.middle();
        let [x, y, near] = camera.place(middle);
        let part = self.part();
        let (corner, cross) = (part * (MARGIN + CROSS), part * CROSS);
        let origin = (corner, self.size[1] as f32 - corner);
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            let mut step = [0.0; 3];
            step[axis] = 0.01 / (near * camera.focus);
            let at = camera.place(add(middle, step));
            let arm = [at[0] - x, at[1] - y].map(|x| 100.0 * cross * x);
            let size = length([arm[0], arm[1], 0.0]);
            // One that points at the eye is left out.
            if size > 0.15 * cross {
                let end = (origin.0 + arm[0], origin.1 + arm[1]);
                drawing.line(&[origin, end], Stroke::new(INK, 2.5));
                let (gap, label) = (part * 13.0 / size, part * LABEL);
                let text = (end.0 + gap * arm[0], end.1 + gap * arm[1] + 0.3 * label);
                drawing.text(name, 0.8 * label, text, Align::Middle, INK);
            }
        }
    }
}

impl Mesh {
    /// A polygon, its corners counter-clockwise round its normals, one for each corner.
    pub fn polygon(points: Vec<[f32; 3]>, normals: &[[f32; 3]], open: bool) -> Self {
        let fan = 1..points.len().saturating_sub(1);
        let triangle = |i: usize| Triangle {
            corners: [0, i as u32, i as u32 + 1],
            normals: [normals[0], normals[i], normals[i + 1]],
            face: 0,
        };
        Self { triangles: fan.map(triangle).collect(), points, open }
    }

    /// The side of a cylinder of radius 1 from 0 to 1 along the third axis.
    pub fn tube() -> Self {
        let turn = unit([0.809_017, 0.587_785_25, 0.0]);
        let (mut arm, mut points) = ([1.0, 0.0, 0.0], Vec::new());
        for _ in 0..SIDES {
            points.extend([arm, [arm[0], arm[1], 1.0]]);
            arm = [arm[0] * turn[0] - arm[1] * turn[1], arm[0] * turn[1] + arm[1] * turn[0], 0.0];
        }
        let side = |n: u32| {
            let [a, b] = [2 * n, 2 * ((n + 1) % SIDES)];
            [[a, b, b + 1], [a, b + 1, a + 1]]
        };
        let normal = |i: u32| [points[i as usize][0], points[i as usize][1], 0.0];
        let triangle = |corners: [u32; 3]| Triangle { corners, normals: corners.map(normal), face: 0 };
        let triangles = (0..SIDES).flat_map(side).map(triangle).collect();
        Self { points, triangles, open: false }
    }
}

impl Item {
    /// A [tube](Mesh::tube) between two points, which casts no shade.
    pub fn tube(mesh: usize, from: [f32; 3], to: [f32; 3], radius: f32, paint: Paint) -> Self {
        let along = sub(to, from);
        let helper = if along[0].abs() < 0.6 * length(along) { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
        let across = unit(cross(helper, along));
        let axes = [scale(across, radius), scale(unit(cross(along, across)), radius), along];
        Self { mesh, shade: None, axes, at: from, paint }
    }
}

/// Results of `work` for the numbers below `count`, in order, on `threads` threads.
fn in_parallel<T: Send>(threads: usize, count: usize, work: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let next = AtomicUsize::new(0);
    let one = || {
        let mine = || Some(next.fetch_add(1, Ordering::Relaxed)).filter(|&i| i < count);
        std::iter::from_fn(mine).map(|i| (i, work(i))).collect::<Vec<_>>()
    };
    let mut all = if threads < 2 {
        one()
    } else {
        std::thread::scope(|scope| {
            let handles: Vec<_> = (0..threads.min(count)).map(|_| scope.spawn(one)).collect();
            handles.into_iter().flat_map(|handle| handle.join().expect("no thread panics")).collect()
        })
    };
    all.sort_by_key(|&(i, _)| i);
    all.into_iter().map(|(_, value)| value).collect()
}
