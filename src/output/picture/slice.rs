//! A slice through the box: velocity magnitude in colour, particles as outlines, walls in grey.

use super::outline::{REFINEMENT, cut, lines};
use super::plane::Plane;
use super::snapshot::{AXES, Scale, Snapshot};
use super::{Format, write_figure};
use crate::error::Result;
use crate::math::Vec3;
use crate::particle::Particle;
use crate::shape::SurfaceMesh;
use crate::wall::Surface;
use std::cell::LazyCell;
use std::path::Path;
use turbid_plot::{Image, WALL};

/// Cuts smaller than this many pixels look like dirt and are left out.
const SMALLEST_OUTLINE: f32 = 5.0;

/// A slice of a flow.
#[derive(Clone, Debug)]
pub struct Slice {
    /// Its position.
    pub plane: Plane,
    /// The values at its points, in the order of [`Plane::add`].
    pub values: Vec<f32>,
    /// Their colours.
    pub scale: Scale,
}

/// Draws a slice with lengths in reference diameters. Of the particles those are enough that the plane [cuts](Plane::cuts). Panics if there are not [as many values](Plane::values) as the plane has points.
pub fn write_slice(path: &Path, snapshot: &Snapshot, slice: &Slice) -> Result<()> {
    let mut image = slice.flow(snapshot);
    draw_particles(&mut image, snapshot, &slice.plane);
    draw_walls(&mut image, snapshot, &slice.plane);
    let plane = &slice.plane;
    let caption = format!("{} = {:.2} D", AXES[plane.normal], plane.height() / snapshot.diameter);
    let figure = snapshot.figure(plane, image, &caption, &slice.scale);
    write_figure(path, &figure, Format::Png)
}

impl Slice {
    /// The flow in its colours, and the walls.
    pub(super) fn image(&self, snapshot: &Snapshot) -> Image {
        let mut image = self.flow(snapshot);
        draw_walls(&mut image, snapshot, &self.plane);
        image
    }

    fn flow(&self, snapshot: &Snapshot) -> Image {
        debug_assert_eq!(self.plane.domain, snapshot.domain);
        let (pixels, _) = self.plane.page();
        let values = self.plane.pixels(&self.values, pixels);
        let colours: Vec<[u8; 3]> = values.iter().map(|&value| self.scale.colour(f64::from(value))).collect();
        Image::new(pixels.0, pixels.1, &colours)
    }
}

/// Covers the inside of walls with grey, as far as the picture shows them.
///
/// A pixel on the edge is covered in part.
fn draw_walls(image: &mut Image, snapshot: &Snapshot, plane: &Plane) {
    let walls: Vec<Surface> = (snapshot.walls.iter()).map(|wall| wall.surface_at(snapshot.time)).collect();
    if walls.is_empty() {
        return;
    }
    let (_, scale) = plane.page();
    image.blend(WALL, |x, y| {
        let at = plane.point((f64::from(x) + 0.5) / scale, (f64::from(y) + 0.5) / scale);
        let covered = |wall: &Surface| match wall.mesh() {
            // The lines in which the plane cuts its facets are drawn besides.
            Some(_) => f64::from(u8::from(wall.is_wall(at))),
            None => (0.5 - wall.distance(at) * scale).clamp(0.0, 1.0),
        };
        walls.iter().map(covered).fold(0.0, f64::max) as f32
    });
    for placed in walls.iter().filter_map(Surface::mesh) {
        for facet in 0..placed.mesh.facets().len() as u32 {
            let ends = cut_facet(&placed.corners(facet), plane.normal, plane.height());
            if let [a, b] = ends[..] {
                let at = |point: Vec3| {
                    ((point[plane.across] * scale) as f32, (plane.down(point[plane.up]) * scale) as f32)
                };
                image.outline(&[at(a), at(b)]);
            }
        }
    }
}

/// Ends of the line in which a plane across an axis, at a height (m), cuts a facet.
fn cut_facet(corners: &[Vec3; 3], axis: usize, height: f64) -> Vec<Vec3> {
    let ends = (0..3).filter_map(|k| {
        let [from, to] = [corners[k], corners[(k + 1) % 3]];
        let [below, above] = [from[axis] - height, to[axis] - height];
        ((below < 0.0) != (above < 0.0)).then(|| from.lerp(&to, below / (below - above)))
    });
    ends.collect()
}

/// Outlines of all particles and their periodic images that the plane cuts.
fn draw_particles(image: &mut Image, snapshot: &Snapshot, plane: &Plane) {
    let (_, scale) = plane.page();
    let (across, up) = (Vec3::ith(plane.across, 1.0), Vec3::ith(plane.up, 1.0));
    let middle = Vec3::ith(plane.normal, plane.height());
    let mut particles: Vec<&Particle> = snapshot.particles.iter().collect();
    particles.sort_by_key(|particle| particle.template);
    for group in particles.chunk_by(|a, b| a.template == b.template) {
        let shape = &*snapshot.templates[group[0].template as usize].shape;
        let mesh = LazyCell::new(|| shape.surface_mesh(REFINEMENT));
        let of_parts: Vec<SurfaceMesh> =
            shape.parts().iter().map(|part| part.shape.surface_mesh(REFINEMENT)).collect();
        let on_page = |(a, b): (f64, f64)| ((a * scale) as f32, (plane.down(b) * scale) as f32);
        for particle in group {
            for centre in snapshot.images(particle.position(), shape.circumradius(), &[0, 1, 2]) {
                let turn = particle.orientation();
                if !of_parts.is_empty() {
                    for line in lines(shape, &of_parts, &turn, middle - centre, [across, up]) {
                        image.outline(&line.map(on_page));
                    }
                    continue;
                }
                let outline = cut(shape, &mesh, &turn, middle - centre, across, up);
                let points: Vec<(f32, f32)> = outline.into_iter().map(on_page).collect();
                if extent(&points) >= SMALLEST_OUTLINE {
                    image.outline(&points);
                }
            }
        }
    }
}

/// Largest distance along an axis from the first point.
fn extent(points: &[(f32, f32)]) -> f32 {
    let apart = |p: &(f32, f32)| (p.0 - points[0].0).abs().max((p.1 - points[0].1).abs());
    points.iter().map(apart).fold(0.0, f32::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::domain::Domain;
    use crate::particle::Template;
    use crate::shape::Sphere;
    use crate::wall::{Motion, Wall};
    use std::sync::Arc;
    use turbid_plot::Colours;

    const BOX: Domain = Domain { faces: Domain::faces([true; 3]), cells: [20, 11, 40], dx: 0.1 };

    /// Speed grows with z from 0 at the bottom to 1 at the top.
    fn values() -> Vec<f32> {
        (0..800).map(|place| (place / 20) as f32 / 39.0).collect()
    }

    fn templates() -> [Template; 1] {
        [Template { shape: Arc::new(Sphere { radius: 0.3 }), material: 0, density: 1.0 }]
    }

    const SPEED: Scale =
        Scale { label: "speed |u|", unit: "m/s", range: (0.0, 1.0), colours: Colours::Viridis };

    fn draw_with(gravity: Vec3, particles: &[Particle], walls: &[Wall]) -> Image {
        let snapshot = Snapshot {
            case: "a rather long name of a case",
            time: 12.3,
            stokes_time: Some(1.0),
            domain: BOX,
            diameter: 0.6,
            gravity,
            templates: &templates(),
            particles,
            walls,
        };
        let (values, plane) = (values(), Plane::new(&BOX, gravity, None));
        let mut image = Slice { plane, values, scale: SPEED }.flow(&snapshot);
        draw_particles(&mut image, &snapshot, &plane);
        draw_walls(&mut image, &snapshot, &plane);
        image
    }

    /// Colour at a position in the box; the image is 500 by 1000 pixels.
    fn colour_at(image: &Image, x: f64, down: f64) -> [u8; 3] {
        image.colour((250.0 * x) as u32, (250.0 * down) as u32)
    }

    fn close(a: [u8; 3], b: [u8; 3]) -> bool {
        a.iter().zip(b).all(|(a, b)| a.abs_diff(b) <= 3)
    }

    #[test]
    fn colours_are_those_of_the_middle_layer_with_gravity_pointing_down() {
        for (gravity, flipped) in [(-9.81, false), (0.0, false), (9.81, true)] {
            let image = draw_with(Vec3::new(0.0, 0.0, gravity), &[], &[]);
            for z in [0.5, 1.0, 2.0, 3.5] {
                let down = if flipped { z } else { 4.0 - z };
                let speed = (z / 0.1 - 0.5) / 39.0;
                let (got, expected) = (colour_at(&image, 1.3, down), SPEED.colour(speed));
                assert!(close(got, expected), "{gravity} {z}: {got:?} {expected:?}");
            }
        }
    }

    #[test]
    fn a_particle_across_a_corner_is_outlined_on_all_four_corners_of_the_slice() {
        let corner = Particle::at(0, 0, Vec3::new(0.1, 0.55, 3.9));
        let with = draw_with(Vec3::zeros(), &[corner], &[]);
        let without = draw_with(Vec3::zeros(), &[], &[]);
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
    fn what_lies_in_a_wall_is_grey() {
        let wall = Wall {
            name: "pipe".to_owned(),
            surface: Surface::Cylinder {
                point: Vec3::new(1.0, 0.55, 0.0),
                axis: Vec3::z(),
                radius: 0.75,
                pipe: true,
            },
            motion: Motion::default(),
            material: 0,
        };
        let (with, without) = (draw_with(Vec3::zeros(), &[], &[wall]), draw_with(Vec3::zeros(), &[], &[]));
        for x in [0.1, 0.24, 1.76, 1.9] {
            assert_eq!(colour_at(&with, x, 2.0), WALL);
        }
        for x in [0.26, 1.0, 1.74] {
            assert_eq!(colour_at(&with, x, 2.0), colour_at(&without, x, 2.0));
        }
    }

    #[test]
    fn a_fluid_at_rest_and_flat_or_tall_boxes_make_pictures() {
        for cells in [[64, 2, 4], [4, 2, 64], [4, 4, 4]] {
            let domain = Domain { faces: Domain::faces([true; 3]), cells, dx: 1e-3 };
            let snapshot = Snapshot {
                case: "rest",
                time: 12.3,
                stokes_time: Some(1.0),
                domain,
                diameter: 1e-3,
                gravity: Vec3::zeros(),
                templates: &[],
                particles: &[],
                walls: &[],
            };
            let plane = Plane::new(&domain, Vec3::zeros(), None);
            let values = vec![0.0; plane.values()];
            let image = Slice { plane, values, scale: SPEED }.image(&snapshot);
            assert_eq!(image.colour(0, 0), SPEED.colour(0.0));
            let page = snapshot.figure(&plane, image, "", &SPEED).image();
            assert!(page.height() >= 900 && page.width() < 2600);
        }
    }
}
