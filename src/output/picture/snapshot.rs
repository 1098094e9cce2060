//! Contents of a picture of the box besides the fluid, and the page round it.

use super::plane::Plane;
use crate::domain::Domain;
use crate::math::Vec3;
use crate::particle::{Particle, Template};
use crate::wall::Wall;
use turbid_plot::{Bar, Colours, Figure, Image, Picture};

/// The box and what is in it at one time.
#[derive(Clone, Copy, Debug)]
pub struct Snapshot<'a> {
    /// Name of the case, for the title.
    pub case: &'a str,
    /// Time (s).
    pub time: f64,
    /// Unit of `t*`, `D / u_Stokes` (s); `None` gives the time in seconds.
    pub stokes_time: Option<f64>,
    /// The box and its cells.
    pub domain: Domain,
    /// Reference diameter `D` (m), the unit of length of the axes.
    pub diameter: f64,
    /// Its gravity (m/s^2), which points down.
    pub gravity: Vec3,
    /// Geometries and materials.
    pub templates: &'a [Template],
    /// All particles.
    pub particles: &'a [Particle],
    /// All walls.
    pub walls: &'a [Wall],
}

impl Snapshot<'_> {
    pub(super) fn time_text(&self) -> String {
        match self.stokes_time {
            Some(unit) => format!("t* = {:.1}", self.time / unit),
            None if self.time > 0.0 && self.time < 0.1 => format!("t = {:.2} ms", 1e3 * self.time),
            None => format!("t = {:.3} s", self.time),
        }
    }

    /// Images of a wrapped position that can be seen within `reach` of the box, along the periodic ones of `axes`.
    pub(super) fn images(&self, position: Vec3, reach: f64, axes: &[usize]) -> Vec<Vec3> {
        let size = self.domain.size();
        let mut images = vec![self.domain.wrap(position)];
        for &axis in axes.iter().filter(|&&axis| self.domain.is_periodic(axis)) {
            for image in std::mem::take(&mut images) {
                images.extend([-1.0, 0.0, 1.0].map(|turn| image + Vec3::ith(axis, turn * size[axis])));
            }
            images.retain(|image| image[axis] > -reach && image[axis] < size[axis] + reach);
        }
        images
    }

    /// The page with a finished image of a plane on it, with a caption.
    pub(super) fn figure(&self, plane: &Plane, image: Image, caption: &str, scale: &Scale) -> Figure {
        let label = |axis: usize| format!("{} / D", AXES[axis]);
        let closed = |axis: usize| !plane.domain.is_periodic(axis);
        let picture = Picture {
            title: self.case.to_string(),
            caption: format!("{caption}     {}", self.time_text()),
            image,
            x: (label(plane.across), plane.size.0 / self.diameter),
            y: (label(plane.up), plane.size.1 / self.diameter),
            downwards: plane.flipped,
            bar: scale.bar(),
            closed: [closed(plane.across), closed(plane.up)],
        };
        picture.figure()
    }
}

/// Points of the picture of a plane.
impl Plane {
    /// Distance from the top of the picture of a coordinate along `up`, both in metres; and the other way round.
    pub(super) fn down(&self, up: f64) -> f64 {
        if self.flipped { up } else { self.size.1 - up }
    }

    /// Unit vectors to the right, upwards in the picture, and towards the viewer.
    pub(super) fn frame(&self) -> [Vec3; 3] {
        let right = Vec3::ith(self.across, 1.0);
        let up = Vec3::ith(self.up, if self.flipped { -1.0 } else { 1.0 });
        [right, up, right.cross(&up)]
    }

    /// The point of the slice at a position in the picture (m from its top left corner).
    pub(super) fn point(&self, right: f64, down: f64) -> Vec3 {
        Vec3::ith(self.across, right)
            + Vec3::ith(self.up, self.down(down))
            + Vec3::ith(self.normal, self.height())
    }

    /// Width and height of the picture in pixels, and pixels per metre.
    pub(super) fn page(&self) -> ((u32, u32), f64) {
        let (width, height) = self.size;
        let scale = (HEIGHT / height).min(WIDEST / width);
        let pixels = |length: f64| (length * scale).round().max(1.0) as u32;
        ((pixels(width), pixels(height)), scale)
    }

    /// The value at every pixel, row by row from the top: linear between `values`, those at the points of the plane.
    pub(super) fn pixels(&self, values: &[f32], (width, height): (u32, u32)) -> Vec<f32> {
        assert_eq!(values.len(), self.values(), "one value per point of the plane");
        let (n, na) = (self.domain.cells, self.domain.cells[self.across]);
        // Cells on both sides of a pixel, and how far it is from the first to the second.
        let neighbours = |pixel: u32, pixels: u32, axis: usize| {
            let cells = n[axis];
            let place = (f64::from(pixel) + 0.5) / f64::from(pixels) * cells as f64 - 0.5;
            let first = place.floor();
            let index = |cell: f64| {
                if self.domain.is_periodic(axis) {
                    (cell as isize).rem_euclid(cells as isize) as usize
                } else {
                    (cell.max(0.0) as usize).min(cells - 1)
                }
            };
            (index(first), index(first + 1.0), (place - first) as f32)
        };
        let columns: Vec<_> = (0..width).map(|x| neighbours(x, width, self.across)).collect();
        let mut pixels = Vec::with_capacity((width * height) as usize);
        for y in 0..height {
            let row = if self.flipped { y } else { height - 1 - y };
            let (b0, b1, t) = neighbours(row, height, self.up);
            pixels.extend(columns.iter().map(|&(a0, a1, s)| {
                let [p, q, r, w] = [(a0, b0), (a1, b0), (a0, b1), (a1, b1)].map(|(a, b)| values[a + na * b]);
                (1.0 - t) * ((1.0 - s) * p + s * q) + t * ((1.0 - s) * r + s * w)
            }));
        }
        pixels
    }
}

pub(super) const AXES: [&str; 3] = ["x", "y", "z"];
/// Height of a picture in pixels unless it is very wide, and its largest width.
const HEIGHT: f64 = 1000.0;
const WIDEST: f64 = 2200.0;

/// Values that colours mean.
#[derive(Clone, Debug, PartialEq)]
pub struct Scale {
    /// Quantity, for the colour bar.
    pub label: &'static str,
    /// Its unit in SI.
    pub unit: &'static str,
    /// Values at both ends of the colours; those outside have the colours of the ends.
    pub range: (f64, f64),
    /// Colours.
    pub colours: Colours,
}

impl Scale {
    /// The colour of a value.
    pub fn colour(&self, value: f64) -> [u8; 3] {
        self.colours.of(value, self.range)
    }

    /// The colour bar, its numbers of order one to a thousand.
    pub(super) fn bar(&self) -> Bar {
        let (lo, hi) = self.range;
        // "1/s" takes no prefix.
        let takes = !self.unit.starts_with('1');
        let (prefix, factor) = if takes { unit_prefix(lo.abs().max(hi.abs())) } else { ("", 1.0) };
        let label = format!("{} ({prefix}{})", self.label, self.unit);
        Bar { label, range: (lo * factor, hi * factor), colours: self.colours }
    }
}

/// Prefix of the unit that makes the numbers of order one to a thousand, and the factor to it.
pub(super) fn unit_prefix(largest: f64) -> (&'static str, f64) {
    match largest {
        x if x >= 1.0 || x <= 0.0 || x.is_nan() => ("", 1.0),
        x if x >= 1e-3 => ("m", 1e3),
        x if x < 1e-6 => ("n", 1e9),
        _ => ("\u{b5}", 1e6),
    }
}
