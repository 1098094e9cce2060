//! A slice through the middle of the box: velocity magnitude in colour, particles as outlines.

use super::axis::{Ticks, rounded_range};
use super::canvas::{Align, Canvas, Pencil};
use super::colour::{INK, viridis};
use super::outline;
use super::text::{Span, above, italic, roman, width};
use super::write_png;
use crate::domain::Domain;
use crate::error::Result;
use crate::math::Vec3;
use crate::particle::{Particle, Template};
use std::path::Path;

/// What a velocity slice shows.
#[derive(Clone, Copy, Debug)]
pub struct VelocitySlice<'a> {
    /// Name of the case, for the title.
    pub case: &'a str,
    /// Time over `D / u_Stokes` (-), for the title.
    pub t_star: f64,
    /// Box and cells.
    pub domain: Domain,
    /// Velocity (m/s) of all cells, x fastest.
    pub velocity: &'a [[f32; 3]],
    /// Geometries and materials.
    pub templates: &'a [Template],
    /// All particles.
    pub particles: &'a [Particle],
    /// Gravity; its largest component points down in the picture. If zero, z points up.
    pub gravity: Vec3,
    /// Velocity at the upper end of the colours (m/s); `None` takes the largest in this slice. Give the same one
    /// to all pictures of a film.
    pub largest_speed: Option<f64>,
}

/// Height of the slice in pixels unless it is very wide.
const PANEL: f64 = 1000.0;
/// Largest width of the slice in pixels.
const WIDEST: f64 = 2200.0;
/// Space left of the slice for the name of the axis, beside the numbers.
const NAME_SPACE: f32 = 80.0;
/// Space right of the slice for the colour bar and its name, beside the numbers.
const BAR_SPACE: f32 = BAR.0 + BAR.1 + 84.0;
const TOP: u32 = 90;
const BOTTOM: u32 = 110;
/// Smallest height of a picture in pixels.
const LOWEST: u32 = 900;
const TITLE: f32 = 30.0;
const LABEL: f32 = 28.0;
const NUMBER: f32 = 24.0;
const TICK: f32 = 9.0;
/// Cuts smaller than this many pixels look like dirt and are left out.
const SMALLEST_OUTLINE: f32 = 5.0;
/// Left edge and width of the colour bar, from the right edge of the slice.
const BAR: (f32, f32) = (36.0, 30.0);

/// Draws the plane through the middle of the box that holds the direction of gravity and, if it can, x: the x-z
/// plane for gravity along z. Lengths are in diameters of the first kind of particle, in metres without particles.
///
/// # Panics
/// If there is not one velocity per cell.
pub fn write_slice(path: &Path, picture: &VelocitySlice) -> Result<()> {
    assert_eq!(
        picture.velocity.len(),
        picture.domain.cell_count(),
        "one velocity per cell"
    );
    write_png(path, &draw(picture))
}

fn draw(picture: &VelocitySlice) -> Canvas {
    let plane = Plane::new(&picture.domain, picture.gravity);
    let scale = (PANEL / plane.size.1).min(WIDEST / plane.size.0);
    let pixels = (
        (plane.size.0 * scale).round().max(1.0) as u32,
        (plane.size.1 * scale).round().max(1.0) as u32,
    );
    let field = plane.speeds(picture.velocity, pixels);
    let largest = picture
        .largest_speed
        .unwrap_or_else(|| f64::from(field.iter().copied().fold(0.0, f32::max)));
    let (prefix, factor) = unit_prefix(largest);
    // A fluid at rest but for rounding gets a scale on which that vanishes.
    let top = if largest > 1e-9 && largest.is_finite() {
        rounded_range(0.0, largest * factor, 10.0).1
    } else {
        1.0
    };

    let colours: Vec<[u8; 3]> = field
        .iter()
        .map(|&speed| viridis(f64::from(speed) * factor / top))
        .collect();
    let mut panel = Canvas::from_pixels(pixels.0, pixels.1, &colours);
    draw_particles(&mut panel, picture, &plane, scale);

    let axes = Axes::new(picture, &plane, pixels, top);
    let time = format!(" = {:.1}", picture.t_star);
    let time = [italic("t"), above("*"), roman(&time)];
    let title = [roman(picture.case)];
    let title_width = width(&title, TITLE) + width(&time, TITLE) + 2.0 * TITLE;
    let (left, right) = axes.margins();
    let page = (
        left + right + pixels.0.max(title_width as u32),
        (TOP + pixels.1 + BOTTOM).max(LOWEST),
    );
    let mut canvas = Canvas::new(page.0, page.1);
    let corner = (
        left + (page.0 - left - right - pixels.0) / 2,
        TOP + (page.1 - TOP - BOTTOM - pixels.1) / 2,
    );
    canvas.paste(&panel, corner.0, corner.1);
    let (l, t) = (corner.0 as f32, corner.1 as f32);
    let area = (l, t, l + pixels.0 as f32, t + pixels.1 as f32);
    canvas.frame(area, Pencil::new(INK, 2.0));

    let inset = 0.5 * (title_width - pixels.0 as f32).max(0.0);
    canvas.text(&title, TITLE, (l - inset, t - 26.0), Align::Start, INK);
    canvas.text(&time, TITLE, (area.2 + inset, t - 26.0), Align::End, INK);
    axes.draw_axes(&mut canvas, &plane, area);
    axes.draw_bar(&mut canvas, area, prefix);
    canvas
}

/// The plane of a slice: which axes of the box run across and up.
struct Plane {
    domain: Domain,
    across: usize,
    up: usize,
    normal: usize,
    /// Whether the coordinate grows downwards in the picture, because gravity points along it.
    flipped: bool,
    /// Width and height (m).
    size: (f64, f64),
}

impl Plane {
    fn new(domain: &Domain, gravity: Vec3) -> Self {
        let up = if gravity.norm() > 0.0 { gravity.iamax() } else { 2 };
        let across = usize::from(up == 0);
        let normal = 3 - up - across;
        let size = domain.size();
        Self {
            domain: *domain,
            across,
            up,
            normal,
            flipped: gravity[up] > 0.0,
            size: (size[across], size[up]),
        }
    }

    /// Distance from the top of the picture of a coordinate along `up`, both in metres.
    fn down(&self, up: f64) -> f64 {
        if self.flipped { up } else { self.size.1 - up }
    }

    /// Velocity magnitude (m/s) at every pixel, row by row from the top; linear between cell centres.
    fn speeds(&self, velocity: &[[f32; 3]], (width, height): (u32, u32)) -> Vec<f32> {
        let n = self.domain.cells;
        // The middle lies between two layers of cells if their number is even.
        let layers = [(n[self.normal] - 1) / 2, n[self.normal] / 2];
        let cell = |a: usize, b: usize| -> [f32; 3] {
            let mut sum = [0.0; 3];
            for layer in layers {
                let mut at = [0; 3];
                (at[self.across], at[self.up], at[self.normal]) = (a, b, layer);
                let u = velocity[at[0] + n[0] * (at[1] + n[1] * at[2])];
                for i in 0..3 {
                    sum[i] += 0.5 * u[i];
                }
            }
            sum
        };
        let (na, nb) = (n[self.across], n[self.up]);
        let layer: Vec<[f32; 3]> = (0..na * nb).map(|i| cell(i % na, i / na)).collect();
        // Cells on both sides of a pixel, and how far it is from the first to the second.
        let neighbours = |pixel: u32, pixels: u32, cells: usize| {
            let place = (f64::from(pixel) + 0.5) / f64::from(pixels) * cells as f64 - 0.5;
            let first = place.floor();
            let index = (first as isize).rem_euclid(cells as isize) as usize;
            (index, (index + 1) % cells, (place - first) as f32)
        };
        let columns: Vec<_> = (0..width).map(|x| neighbours(x, width, na)).collect();
        let mut speeds = Vec::with_capacity((width * height) as usize);
        for y in 0..height {
            let row = if self.flipped { y } else { height - 1 - y };
            let (b0, b1, t) = neighbours(row, height, nb);
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

/// Outlines of all particles and their periodic images that the plane cuts, under a light veil.
fn draw_particles(panel: &mut Canvas, picture: &VelocitySlice, plane: &Plane, scale: f64) {
    let size = plane.domain.size();
    let unit = |axis: usize| Vec3::from_fn(|i, _| f64::from(u8::from(i == axis)));
    let (across, up) = (unit(plane.across), unit(plane.up));
    let middle = 0.5 * size[plane.normal] * unit(plane.normal);
    for particle in picture.particles {
        let shape = &*picture.templates[particle.template as usize].shape;
        let reach = shape.circumradius();
        let position = plane.domain.wrap(particle.position());
        for image in 0..27 {
            let shift = Vec3::new(
                f64::from(image % 3 - 1),
                f64::from(image / 3 % 3 - 1),
                f64::from(image / 9 - 1),
            );
            let centre = position + shift.component_mul(&size);
            let outside = |axis: usize| centre[axis] < -reach || centre[axis] > size[axis] + reach;
            if outside(plane.across) || outside(plane.up) {
                continue;
            }
            let outline = outline::cut(shape, &particle.orientation(), middle - centre, across, up);
            let points: Vec<(f32, f32)> = outline
                .iter()
                .map(|&(a, b)| ((a * scale) as f32, (plane.down(b) * scale) as f32))
                .collect();
            if extent(&points) < SMALLEST_OUTLINE {
                continue;
            }
            panel.fill(&points, [255, 255, 255], 0.22);
            panel.polygon(&points, Pencil::new([20, 20, 20], 2.0));
        }
    }
}

/// Larger of width and height.
fn extent(points: &[(f32, f32)]) -> f32 {
    let range = |of: fn(&(f32, f32)) -> f32| {
        let (lo, hi) = points
            .iter()
            .map(of)
            .fold((f32::INFINITY, f32::NEG_INFINITY), |(lo, hi), x| {
                (lo.min(x), hi.max(x))
            });
        hi - lo
    };
    range(|p| p.0).max(range(|p| p.1))
}

/// The numbers around the slice.
struct Axes {
    across: Ticks,
    up: Ticks,
    bar: Ticks,
    /// Value at the upper end of the colour bar.
    top: f64,
    /// Unit of length of the axes (m), and what it is called if it is not the diameter.
    unit: (f64, Option<&'static str>),
}

impl Axes {
    fn new(picture: &VelocitySlice, plane: &Plane, (width, height): (u32, u32), top: f64) -> Self {
        let unit = match picture.templates.first() {
            Some(template) => (template.shape.equivalent_diameter(), None),
            None => match unit_prefix(plane.size.0.max(plane.size.1)) {
                ("m", factor) => (1.0 / factor, Some("mm")),
                ("", factor) => (1.0 / factor, Some("m")),
                (_, factor) => (1.0 / factor, Some("\u{b5}m")),
            },
        };
        let ticks =
            |length: f64, pixels: u32| Ticks::new(0.0, length / unit.0, (f64::from(pixels) / 110.0).max(2.0));
        Self {
            across: ticks(plane.size.0, width),
            up: ticks(plane.size.1, height),
            bar: Ticks::new(0.0, top, (f64::from(height) / 60.0).clamp(2.0, 9.0)),
            top,
            unit,
        }
    }

    /// Space that numbers and names take left and right of the slice.
    fn margins(&self) -> (u32, u32) {
        let left = NAME_SPACE + self.up.widest(NUMBER);
        let right = BAR_SPACE + self.bar.widest(NUMBER);
        (left.ceil() as u32, right.ceil() as u32)
    }

    fn axis_name(&self, axis: usize) -> Vec<Span<'static>> {
        let name = italic(["x", "y", "z"][axis]);
        match self.unit.1 {
            None => vec![name, roman(" / "), italic("D")],
            Some(unit) => vec![name, roman(" ("), roman(unit), roman(")")],
        }
    }

    fn draw_axes(&self, canvas: &mut Canvas, plane: &Plane, (l, t, r, b): (f32, f32, f32, f32)) {
        let pencil = Pencil::new(INK, 2.0);
        let pixels_per_metre = f64::from(b - t) / plane.size.1;
        for &value in &self.across.values {
            let x = l + (value * self.unit.0 * pixels_per_metre) as f32;
            canvas.line((x, b + 2.0), (x, b + 2.0 + TICK), pencil);
            let text = self.across.label(value);
            canvas.text(&[roman(&text)], NUMBER, (x, b + 38.0), Align::Middle, INK);
        }
        for &value in &self.up.values {
            let y = t + (plane.down(value * self.unit.0) * pixels_per_metre) as f32;
            canvas.line((l - 2.0, y), (l - 2.0 - TICK, y), pencil);
            let text = self.up.label(value);
            let place = (l - 18.0, y + 0.36 * NUMBER);
            canvas.text(&[roman(&text)], NUMBER, place, Align::End, INK);
        }
        let below = (0.5 * (l + r), b + 82.0);
        canvas.text(&self.axis_name(plane.across), LABEL, below, Align::Middle, INK);
        let beside = (l - 36.0 - self.up.widest(NUMBER), 0.5 * (t + b));
        canvas.text_upwards(&self.axis_name(plane.up), LABEL, beside, INK);
    }

    fn draw_bar(&self, canvas: &mut Canvas, (_, t, r, b): (f32, f32, f32, f32), prefix: &str) {
        let (left, right) = (r + BAR.0, r + BAR.0 + BAR.1);
        let rows = (b - t).round() as u32;
        let colours: Vec<[u8; 3]> = (0..rows)
            .flat_map(|y| {
                let colour = viridis(1.0 - (f64::from(y) + 0.5) / f64::from(rows));
                std::iter::repeat_n(colour, BAR.1 as usize)
            })
            .collect();
        let bar = Canvas::from_pixels(BAR.1 as u32, rows, &colours);
        canvas.paste(&bar, left as u32, t as u32);
        canvas.frame((left, t, right, b), Pencil::new(INK, 2.0));
        for &value in &self.bar.values {
            let y = b - (value / self.top) as f32 * (b - t);
            canvas.line((right + 2.0, y), (right + 2.0 + TICK, y), Pencil::new(INK, 2.0));
            let text = self.bar.label(value);
            let place = (right + 18.0, y + 0.36 * NUMBER);
            canvas.text(&[roman(&text)], NUMBER, place, Align::Start, INK);
        }
        let unit = format!("| ({prefix}m/s)");
        let label = [roman("speed |"), italic("u"), roman(&unit)];
        let place = (right + 60.0 + self.bar.widest(NUMBER), 0.5 * (t + b));
        canvas.text_upwards(&label, LABEL, place, INK);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::Sphere;
    use std::sync::Arc;

    const BOX: Domain = Domain {
        cells: [20, 11, 40],
        dx: 0.1,
    };

    /// Speed grows with z from 0 at the bottom to 1 at the top; y velocity outside of the middle layer.
    fn velocity() -> Vec<[f32; 3]> {
        (0..BOX.cell_count())
            .map(|index| {
                let (y, z) = (index / 20 % 11, index / 220);
                let u = z as f32 / 39.0;
                if y == 5 { [u, 0.0, 0.0] } else { [0.0, 100.0, 0.0] }
            })
            .collect()
    }

    fn templates() -> [Template; 1] {
        [Template {
            shape: Arc::new(Sphere { radius: 0.3 }),
            density: 1.0,
        }]
    }

    fn draw_with(gravity: Vec3, particles: &[Particle]) -> Canvas {
        draw(&VelocitySlice {
            case: "a rather long name of a case",
            t_star: 12.3,
            domain: BOX,
            velocity: &velocity(),
            templates: &templates(),
            particles,
            gravity,
            largest_speed: Some(1.0),
        })
    }

    /// Colour at a place of the box; the panel is 500 by 1000 pixels and centred.
    fn colour_at(canvas: &Canvas, x: f64, down: f64) -> [u8; 3] {
        let plane = Plane::new(&BOX, Vec3::zeros());
        let picture = VelocitySlice {
            case: "",
            t_star: 0.0,
            domain: BOX,
            velocity: &[],
            templates: &templates(),
            particles: &[],
            gravity: Vec3::zeros(),
            largest_speed: None,
        };
        let (before, after) = Axes::new(&picture, &plane, (500, 1000), 1.0).margins();
        let left = before + (canvas.width() - before - after - 500) / 2;
        let (px, py) = (f64::from(left) + 250.0 * x, f64::from(TOP) + 250.0 * down);
        let first = 3 * (py as usize * canvas.width() as usize + px as usize);
        canvas.rgb()[first..first + 3].try_into().unwrap()
    }

    fn close(a: [u8; 3], b: [u8; 3]) -> bool {
        a.iter().zip(b).all(|(a, b)| a.abs_diff(b) <= 3)
    }

    #[test]
    fn colours_are_those_of_the_middle_layer_with_gravity_pointing_down() {
        for (gravity, flipped) in [(-9.81, false), (0.0, false), (9.81, true)] {
            let canvas = draw_with(Vec3::new(0.0, 0.0, gravity), &[]);
            for z in [0.5, 1.0, 2.0, 3.5] {
                let down = if flipped { z } else { 4.0 - z };
                let speed = (z / 0.1 - 0.5) / 39.0;
                let (got, expected) = (colour_at(&canvas, 1.3, down), viridis(speed));
                assert!(close(got, expected), "{gravity} {z}: {got:?} {expected:?}");
            }
        }
    }

    #[test]
    fn a_particle_across_a_corner_is_outlined_on_all_four_corners_of_the_slice() {
        let corner = Particle::at(0, 0, Vec3::new(0.1, 0.55, 3.9));
        let with = draw_with(Vec3::zeros(), &[corner]);
        let without = draw_with(Vec3::zeros(), &[]);
        let differs = |x: f64, z: f64| colour_at(&with, x, 4.0 - z) != colour_at(&without, x, 4.0 - z);
        for (x, z) in [(0.05, 3.95), (1.95, 3.95), (0.05, 0.05), (1.95, 0.05)] {
            assert!(differs(x, z), "image at {x} {z}");
        }
        assert!(!differs(1.0, 2.0) && !differs(0.6, 3.9));
        // The outline itself is dark, one radius from the centre.
        let edge = colour_at(&with, 0.4, 0.1);
        assert!(edge.iter().all(|&c| c < 90), "{edge:?}");
    }

    #[test]
    fn gravity_along_another_axis_turns_the_plane() {
        let plane = Plane::new(&BOX, Vec3::new(-1.0, 0.0, 0.1));
        assert_eq!((plane.across, plane.up, plane.normal), (1, 0, 2));
        let plane = Plane::new(&BOX, Vec3::new(0.0, 2.0, 0.0));
        assert_eq!((plane.across, plane.up, plane.normal), (0, 1, 2));
        assert!(plane.flipped);
    }

    #[test]
    fn a_fluid_at_rest_and_flat_or_tall_boxes_make_pictures_at_least_900_pixels_high() {
        for cells in [[64, 2, 4], [4, 2, 64], [4, 4, 4]] {
            let domain = Domain { cells, dx: 1e-3 };
            let canvas = draw(&VelocitySlice {
                case: "rest",
                t_star: 0.0,
                domain,
                velocity: &vec![[0.0; 3]; domain.cell_count()],
                templates: &[],
                particles: &[],
                gravity: Vec3::zeros(),
                largest_speed: None,
            });
            assert!(canvas.height() >= 900 && canvas.width() < 2600);
        }
    }
}
