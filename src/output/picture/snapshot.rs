//! Contents of a picture of the box besides the fluid, and the page round it.

use super::plane::Plane;
use crate::math::Vec3;
use crate::particle::{Particle, Template};
use crate::wall::Wall;
use turbid_plot::{Figure, Image, Picture, round_up, viridis};

/// The box and what is in it at one time.
#[derive(Clone, Copy, Debug)]
pub struct Snapshot<'a> {
    /// Name of the case, for the title.
    pub case: &'a str,
    /// Time (s).
    pub time: f64,
    /// Unit of `t*`, `D / u_Stokes` (s); `None` gives the time in seconds.
    pub stokes_time: Option<f64>,
    /// Plane that is cut, or along whose normal the box is seen; with the box and its cells.
    pub plane: Plane,
    /// Geometries and materials.
    pub templates: &'a [Template],
    /// All particles.
    pub particles: &'a [Particle],
    /// All walls.
    pub walls: &'a [Wall],
    /// Speed at the upper end of the colours (m/s), the same for all pictures of a film; `None` takes the largest in the picture.
    pub largest_speed: Option<f64>,
}

impl Snapshot<'_> {
    /// The time as text.
    fn time_text(&self) -> String {
        match self.stokes_time {
            Some(unit) => format!("t* = {:.1}", self.time / unit),
            None if self.time > 0.0 && self.time < 0.1 => format!("t = {:.2} ms", 1e3 * self.time),
            None => format!("t = {:.3} s", self.time),
        }
    }

    /// Images of a wrapped position that can be seen within `reach` of the box, along the periodic ones of `axes`.
    pub(super) fn images(&self, position: Vec3, reach: f64, axes: &[usize]) -> Vec<Vec3> {
        let size = self.plane.domain.size();
        let mut images = vec![self.plane.domain.wrap(position)];
        for &axis in axes.iter().filter(|&&axis| self.plane.domain.periodic[axis]) {
            for image in std::mem::take(&mut images) {
                images.extend([-1.0, 0.0, 1.0].map(|turn| image + Vec3::ith(axis, turn * size[axis])));
            }
            images.retain(|image| image[axis] > -reach && image[axis] < size[axis] + reach);
        }
        images
    }

    /// Width and height of the picture in pixels, and pixels per metre.
    pub(super) fn pixels(&self) -> ((u32, u32), f64) {
        let (width, height) = self.plane.size;
        let scale = (HEIGHT / height).min(WIDEST / width);
        let pixels = |length: f64| (length * scale).round().max(1.0) as u32;
        ((pixels(width), pixels(height)), scale)
    }

    /// Unit of length of the axes (m) and its name: the diameter of the first kind of particle, or a unit that suits the box.
    pub(super) fn unit(&self) -> (f64, &'static str) {
        if let Some(template) = self.templates.first() {
            return (template.shape.equivalent_diameter(), "D");
        }
        match unit_prefix(self.plane.size.0.max(self.plane.size.1)) {
            ("m", factor) => (1.0 / factor, "mm"),
            ("", factor) => (1.0 / factor, "m"),
            (_, factor) => (1.0 / factor, "\u{b5}m"),
        }
    }

    /// The page with a finished image on it: a caption, and the name of the speed that colours mean.
    pub(super) fn figure(&self, image: Image, caption: &str, speed: &str, range: &SpeedRange) -> Figure {
        let (plane, (length, unit)) = (&self.plane, self.unit());
        let label = |axis: usize| match unit {
            "D" => format!("{} / D", AXES[axis]),
            unit => format!("{} ({unit})", AXES[axis]),
        };
        let closed = |axis: usize| !plane.domain.periodic[axis];
        let picture = Picture {
            title: self.case.to_string(),
            caption: format!("{caption}     {}", self.time_text()),
            image,
            x: (label(plane.across), plane.size.0 / length),
            y: (label(plane.up), plane.size.1 / length),
            downwards: plane.flipped,
            bar: (format!("{speed} ({}m/s)", range.prefix), range.top),
            closed: [closed(plane.across), closed(plane.up)],
        };
        picture.figure()
    }
}

/// Points of the picture of a plane.
impl Plane {
    /// Distance from the top of the picture of a coordinate along `up`, both in metres.
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
        let up = if self.flipped { down } else { self.size.1 - down };
        Vec3::ith(self.across, right) + Vec3::ith(self.up, up) + Vec3::ith(self.normal, self.height())
    }

    /// Velocity magnitude (m/s) at every pixel, row by row from the top; linear between cell centres. `layer` is the velocity of
    /// the plane, as [`add`](Self::add) makes it.
    pub(super) fn speeds(&self, layer: &[[f32; 3]], (width, height): (u32, u32)) -> Vec<f32> {
        assert_eq!(layer.len(), self.values(), "one velocity per point of the plane");
        let (n, na) = (self.domain.cells, self.domain.cells[self.across]);
        // Cells on both sides of a pixel, and how far it is from the first to the second.
        let neighbours = |pixel: u32, pixels: u32, axis: usize| {
            let cells = n[axis];
            let place = (f64::from(pixel) + 0.5) / f64::from(pixels) * cells as f64 - 0.5;
            let first = place.floor();
            let index = |cell: f64| {
                if self.domain.periodic[axis] {
                    (cell as isize).rem_euclid(cells as isize) as usize
                } else {
                    (cell.max(0.0) as usize).min(cells - 1)
                }
            };
            (index(first), index(first + 1.0), (place - first) as f32)
        };
        let columns: Vec<_> = (0..width).map(|x| neighbours(x, width, self.across)).collect();
        let mut speeds = Vec::with_capacity((width * height) as usize);
        for y in 0..height {
            let row = if self.flipped { y } else { height - 1 - y };
            let (b0, b1, t) = neighbours(row, height, self.up);
            for &(a0, a1, s) in &columns {
                let corners = [(a0, b0), (a1, b0), (a0, b1), (a1, b1)].map(|(a, b)| layer[a + na * b]);
                let u: [f32; 3] = std::array::from_fn(|i| {
                    let [p, q, r, w] = corners.map(|u| u[i]);
                    (1.0 - t) * ((1.0 - s) * p + s * q) + t * ((1.0 - s) * r + s * w)
                });
                speeds.push(u.iter().map(|x| x * x).sum::<f32>().sqrt());
            }
        }
        speeds
    }
}

/// Names of the axes.
pub(super) const AXES: [&str; 3] = ["x", "y", "z"];
/// Height of a picture in pixels unless it is very wide, and its largest width.
const HEIGHT: f64 = 1000.0;
const WIDEST: f64 = 2200.0;

/// The speeds that colours mean.
#[derive(Clone, Copy, Debug)]
pub(super) struct SpeedRange {
    /// Prefix of m/s in the numbers, and the factor to it.
    prefix: &'static str,
    factor: f64,
    /// Number at the upper end.
    top: f64,
}

impl SpeedRange {
    /// From zero to a round number above `largest` (m/s).
    pub(super) fn up_to(largest: f64) -> Self {
        let (prefix, factor) = unit_prefix(largest);
        // A fluid at rest but for rounding gets a range on which that vanishes.
        let seen = largest > 1e-9 && largest.is_finite();
        let top = if seen { round_up(largest * factor) } else { 1.0 };
        Self { prefix, factor, top }
    }

    /// The colour of a speed (m/s).
    pub(super) fn colour(&self, speed: f64) -> [u8; 3] {
        viridis(speed * self.factor / self.top)
    }
}

/// Prefix of the unit that makes the numbers of order one to a thousand, and the factor to it.
fn unit_prefix(largest: f64) -> (&'static str, f64) {
    match largest {
        x if x >= 1.0 || x <= 0.0 || x.is_nan() => ("", 1.0),
        x if x >= 1e-3 => ("m", 1e3),
        _ => ("\u{b5}", 1e6),
    }
}
