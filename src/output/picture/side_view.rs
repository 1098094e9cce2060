//! The particles from the side, coloured by their speeds: what there is to see without a fluid.

use super::plane::Plane;
use super::slice::draw_walls;
use super::snapshot::{AXES, Snapshot, SpeedRange};
use super::{Format, write_figure};
use crate::error::Result;
use crate::math::{Quat, Vec3};
use crate::particle::Template;
use crate::wall::Surface;
use std::path::Path;
use turbid_plot::{BACKGROUND, Corner, Image, Raster};

/// Up to this many particles get finer meshes.
const FEW: usize = 300;
/// Distance from a corner at which its normal is taken, as part of the way to the middle of the triangle.
const INSIDE: f64 = 1e-3;
/// Light in the shade, over that of full light.
const SHADE: f64 = 0.45;
/// Sine of the largest angle to the line of sight of a direction that counts as along it.
const ALONG: f64 = 1e-6;

/// Draws all particles as seen from the side, along the axis of the box that
/// [`write_slice`](super::write_slice) cuts across.
///
/// Walls that are seen edge on and pipes are drawn, too; others would hide what is behind them.
pub fn write_side_view(path: &Path, snapshot: &Snapshot) -> Result<()> {
    let (image, range) = draw(snapshot);
    let caption = format!("seen along {}", AXES[snapshot.plane.normal]);
    let figure = snapshot.figure(image, &caption, "speed of particles |v|", &range);
    write_figure(path, &figure, Format::Png)
}

fn draw(snapshot: &Snapshot) -> (Image, SpeedRange) {
    let plane = snapshot.plane;
    let (pixels, scale) = snapshot.pixels();
    let fastest = || (snapshot.particles.iter()).fold(0.0, |most: f64, p| most.max(p.velocity().norm()));
    let range = SpeedRange::up_to(snapshot.largest_speed.unwrap_or_else(fastest));
    let refinement = if snapshot.particles.len() <= FEW { 3 } else { 2 };
    let bodies: Vec<Body> = snapshot.templates.iter().map(|t| Body::new(t, refinement)).collect();
    let mut raster = Raster::new(pixels.0, pixels.1, BACKGROUND);
    let mut surface = 1;
    for particle in snapshot.particles {
        let body = &bodies[particle.template as usize];
        let reach = snapshot.templates[particle.template as usize].shape.circumradius();
        let colour = range.colour(particle.velocity().norm());
        for centre in snapshot.images(particle.position(), reach, &[plane.across, plane.up]) {
            let at = (centre, particle.orientation());
            surface = body.draw(&mut raster, snapshot, at, colour, surface);
        }
    }
    let mut image = raster.image();
    draw_walls(&mut image, &plane, scale, &walls_edge_on(snapshot, &plane));
    (image, range)
}

/// The walls whose edge is seen, in the middle of the box: planes along the line of sight, and pipes by their outline.
fn walls_edge_on(snapshot: &Snapshot, plane: &Plane) -> Vec<Surface> {
    let [_, _, towards] = plane.frame();
    let across = |v: Vec3| v.dot(&towards).abs() < ALONG;
    let seen = |surface: Surface| match surface {
        Surface::Plane { normal, .. } => across(normal).then_some(surface),
        Surface::Cylinder { axis, .. } if axis.cross(&towards).norm() < ALONG => Some(surface),
        Surface::Cylinder { point, axis, radius, pipe } => {
            (pipe && across(axis)).then(|| Surface::Cylinder {
                // The widest part is seen, that beside the axis.
                point: point + towards * (plane.point(0.0, 0.0) - point).dot(&towards),
                axis,
                radius,
                pipe,
            })
        }
    };
    let walls = snapshot.walls.iter().map(|wall| wall.surface_at(snapshot.time));
    walls.filter_map(seen).collect()
}

/// A body to draw: triangles with the normals of their corners, by the piece of surface they belong to.
struct Body {
    triangles: Vec<([(Vec3, Vec3); 3], u32)>,
    pieces: u32,
}

impl Body {
    fn new(template: &Template, refinement: u32) -> Self {
        let shape = &*template.shape;
        if let Some(body) = shape.as_polyhedron() {
            let mut triangles = Vec::new();
            for (piece, face) in body.faces.iter().enumerate() {
                let corner = |i: usize| (body.vertices[face.corners[i] as usize], face.normal);
                let fan = 1..face.corners.len() - 1;
                triangles.extend(fan.map(|i| ([corner(0), corner(i), corner(i + 1)], piece as u32)));
            }
            let pieces = body.faces.len() as u32;
            return Self { triangles, pieces };
        }
        let mesh = shape.surface_mesh(refinement);
        // Normals from just inside of each triangle: on an edge of the body they are those of its side.
        let one = |triangle: &[u32; 3]| {
            let corners = triangle.map(|i| mesh.points[i as usize]);
            let middle = corners.iter().sum::<Vec3>() / 3.0;
            let normal = |corner: &Vec3| shape.gradient(corner.lerp(&middle, INSIDE));
            (corners.map(|corner| (corner, normal(&corner))), 0)
        };
        Self { triangles: mesh.triangles.iter().map(one).collect(), pieces: 1 }
    }

    /// Draws the body of a particle at one of its images, with pieces from number `first` on; returns the next free number.
    fn draw(
        &self,
        raster: &mut Raster,
        snapshot: &Snapshot,
        at: (Vec3, Quat),
        colour: [u8; 3],
        first: u32,
    ) -> u32 {
        let (plane, (_, scale), (centre, orientation)) = (&snapshot.plane, snapshot.pixels(), at);
        let [right, up, towards] = plane.frame();
        let sun = (0.6 * up - 0.45 * right + 0.7 * towards).normalize();
        for (corners, piece) in &self.triangles {
            let corner = |(arm, normal): (Vec3, Vec3)| {
                let at = centre + orientation * arm;
                let light = (orientation * normal).dot(&sun).max(0.0);
                let [x, y, z] = [at[plane.across], plane.down(at[plane.up]), at.dot(&towards)];
                Corner { at: [x * scale, y * scale, z * scale], light: SHADE + (1.0 - SHADE) * light }
            };
            raster.triangle(corners.map(corner), colour, first + piece);
        }
        first + self.pieces
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::domain::Domain;
    use crate::particle::Particle;
    use crate::shape::Sphere;
    use std::sync::Arc;

    #[test]
    fn the_nearer_particle_is_seen_in_the_colour_of_its_speed() {
        let templates = [Template { shape: Arc::new(Sphere { radius: 0.3 }), density: 1.0, material: 0 }];
        let moving = |y, speed| {
            let mut particle = Particle::at(0, 0, Vec3::new(0.5, y, 0.5));
            particle.velocity = [0.0, 0.0, speed];
            particle
        };
        let open = Domain { periodic: [false; 3], cells: [10; 3], dx: 0.1 };
        // Seen along y with x to the right and z upwards: small y is near.
        for (near, far) in [(1.0, 0.0), (0.0, 1.0)] {
            let particles = [moving(0.9, far), moving(0.2, near)];
            let (image, _) = draw(&Snapshot {
                case: "",
                time: 0.0,
                stokes_time: None,
                plane: Plane::new(&open, -Vec3::z(), None),
                templates: &templates,
                particles: &particles,
                walls: &[],
                largest_speed: Some(1.0),
            });
            let [r, _, b] = image.colour(image.width() / 2, image.height() / 2);
            assert_eq!(r > b, near > 0.5, "yellow is fast, violet is slow");
        }
    }
}
