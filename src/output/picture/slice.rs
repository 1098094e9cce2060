//! A slice through the middle of the box: velocity magnitude in colour, particles as outlines.

use super::axis::rounded_range;
use super::canvas::{Align, Canvas, Pencil};
use super::colour::{INK, viridis};
use super::outline;
use super::plane::Plane;
use super::scales::{Axes, unit_prefix};
use super::text::{above, italic, roman, width};
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
const TOP: u32 = 90;
const BOTTOM: u32 = 110;
/// Smallest height of a picture in pixels.
const LOWEST: u32 = 900;
const TITLE: f32 = 30.0;
/// Cuts smaller than this many pixels look like dirt and are left out.
const SMALLEST_OUTLINE: f32 = 5.0;

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

    let diameter = picture.templates.first().map(|t| t.shape.equivalent_diameter());
    let axes = Axes::new(diameter, &plane, pixels, top);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::Sphere;
    use std::sync::Arc;

    const BOX: Domain = Domain {
        periodic: [true; 3],
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
            material: 0,
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
        let (before, after) = Axes::new(Some(0.6), &plane, (500, 1000), 1.0).margins();
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
    fn a_fluid_at_rest_and_flat_or_tall_boxes_make_pictures_at_least_900_pixels_high() {
        for cells in [[64, 2, 4], [4, 2, 64], [4, 4, 4]] {
            let domain = Domain {
                periodic: [true; 3],
                cells,
                dx: 1e-3,
            };
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
