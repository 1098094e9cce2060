//! The box in perspective: bodies in light and shade, walls, a slice of the flow, force chains.

use super::plane::Plane;
use super::slice::Slice;
use super::snapshot::{Scale, Snapshot, unit_prefix};
use super::{Format, write_figure};
use crate::dem::ContactState;
use crate::error::Result;
use crate::math::{Quat, Vec3};
use crate::output::contacts::arms;
use crate::output::walls::{normals_of, polygons};
use crate::particle::Template;
use crate::shape::Shape;
use crate::wall::Surface;
use std::path::Path;
use turbid_plot::{Item, Mesh, Paint, Triangle, View};

/// Contents of a view besides the box.
#[derive(Clone, Debug)]
pub struct Scene<'a> {
    /// Direction from the middle of the box to the eye, not zero; by default from the right and above.
    pub from: Option<Vec3>,
    /// Factor by which all is larger than with the whole box on the page.
    pub zoom: f64,
    /// Width and height of the page (pixels).
    pub size: [u32; 2],
    /// A colour for each of the particles.
    pub bodies: Vec<[u8; 3]>,
    /// Values that these colours mean, if they mean any.
    pub scale: Option<Scale>,
    /// A slice, before the part of the box behind it with the particles there, and those that it cuts.
    pub slice: Option<Slice>,
    /// Contacts, as lines.
    pub chains: Option<Chains<'a>>,
    /// Threads that draw; the picture does not depend on them.
    pub threads: usize,
}

/// Contacts, drawn as lines from the centres of the particles to the points of contact.
#[derive(Clone, Debug)]
pub struct Chains<'a> {
    /// The contacts.
    pub contacts: &'a [ContactState],
    /// Colours of their forces (N), the width of a line being that of the root of its force.
    pub scale: Scale,
}

/// Default direction to the eye: to the right, upwards, and to the front.
pub(super) const FROM: [f64; 3] = [0.6, 0.5, 1.0];
/// Colour of walls.
const WALLS: [u8; 3] = [226, 228, 231];
/// Refinements of the meshes of curved bodies, by the largest radius on the page (pixels).
const REFINEMENTS: [(f64, u32); 3] = [(9.0, 2), (36.0, 3), (160.0, 4)];
const FINEST: u32 = 5;
/// Refinement of the meshes that shade others.
const SHADING: u32 = 1;
/// Distance from a corner at which its normal is taken, as part of the way to the middle of the triangle.
const INSIDE: f64 = 1e-3;
/// Radius of the line of the largest force, over the reference diameter, and the least force that is drawn, over
/// the largest.
const LINE: f64 = 0.16;
const LEAST: f64 = 0.02;
/// Longest scale bar, over the diagonal of the box.
const SCALE: f64 = 0.2;

/// Draws a view of the box.
///
/// Periodic particles are drawn once, whole, where their centre is in the box. Walls that are seen from behind are left out. Panics
/// unless there is one colour for each particle.
pub fn write_view(path: &Path, snapshot: &Snapshot, scene: &Scene) -> Result<()> {
    write_figure(path, &view(snapshot, scene).figure(), Format::Png)
}

fn view(snapshot: &Snapshot, scene: &Scene) -> View {
    let frame = Plane::new(&snapshot.domain, snapshot.gravity, None).frame();
    let from = scene.from.unwrap_or_else(|| frame.iter().zip(FROM).map(|(axis, part)| part * axis).sum());
    let mut edges = [Vec3::zeros(), snapshot.domain.size()];
    if let Some(slice) = &scene.slice {
        let plane = &slice.plane;
        // The side that is cut off is that of the eye.
        edges[usize::from(from[plane.normal] >= 0.0)][plane.normal] = plane.height();
    }
    let mut view = View {
        title: snapshot.case.to_string(),
        caption: snapshot.time_text(),
        size: scene.size,
        from: single(from),
        up: single(frame[1]),
        zoom: scene.zoom as f32,
        edges: edges.map(single),
        meshes: Vec::new(),
        items: Vec::new(),
        seen_through: Vec::new(),
        bars: Vec::new(),
        scale: scale_bar(SCALE * snapshot.domain.size().norm() / scene.zoom),
        threads: scene.threads,
    };
    add_bodies(&mut view, snapshot, scene, from);
    for wall in snapshot.walls {
        add_wall(&mut view, &wall.surface_at(snapshot.time), edges);
    }
    view.bars.extend(scene.scale.as_ref().map(Scale::bar));
    if let Some(slice) = &scene.slice {
        add_slice(&mut view, slice, snapshot);
        let bar = slice.scale.bar();
        if !view.bars.contains(&bar) {
            view.bars.push(bar);
        }
    }
    if let Some(chains) = &scene.chains {
        add_chains(&mut view, chains, snapshot);
        view.bars.push(chains.scale.bar());
    }
    view
}

pub(super) fn single(v: Vec3) -> [f32; 3] {
    v.map(|x| x as f32).into()
}

/// All particles, or those behind a slice and those that it cuts.
fn add_bodies(view: &mut View, snapshot: &Snapshot, scene: &Scene, from: Vec3) {
    let page = f64::from(scene.size[0].max(scene.size[1])) * scene.zoom;
    let scale = page / snapshot.domain.size().norm();
    for template in snapshot.templates {
        let shape = &*template.shape;
        let radius = scale * shape.circumradius();
        let fits = REFINEMENTS.iter().find(|(largest, _)| radius <= *largest);
        view.meshes.push(mesh(shape, fits.map_or(FINEST, |(_, refinement)| *refinement)));
        view.meshes.push(mesh(shape, SHADING));
    }
    assert_eq!(scene.bodies.len(), snapshot.particles.len(), "one colour for each particle");
    for (particle, &colour) in snapshot.particles.iter().zip(&scene.bodies) {
        let (at, turn) = (snapshot.domain.wrap(particle.position()), particle.orientation());
        let template = &snapshot.templates[particle.template as usize];
        if scene.slice.as_ref().is_some_and(|slice| is_before(&slice.plane, from, template, (at, turn))) {
            continue;
        }
        let mesh = 2 * particle.template as usize;
        view.items.push(Item {
            mesh,
            shade: Some(mesh + 1),
            axes: [Vec3::x(), Vec3::y(), Vec3::z()].map(|axis| single(turn * axis)),
            at: single(at),
            paint: Paint::Solid(colour),
        });
    }
}

/// The longest of 1, 2 or 5 times a power of ten metres up to `longest` (m), and its name.
pub(super) fn scale_bar(longest: f64) -> (f32, String) {
    let power = libm::pow(10.0, longest.log10().floor());
    let length = [5.0, 2.0, 1.0].map(|digit| digit * power).into_iter().find(|length| *length <= longest);
    let length = length.unwrap_or(power);
    let (prefix, factor) = unit_prefix(1.001 * length);
    (length as f32, format!("{:.0} {prefix}m", length * factor))
}

/// True if a body lies wholly between a plane and the eye.
fn is_before(plane: &Plane, from: Vec3, template: &Template, (at, turn): (Vec3, Quat)) -> bool {
    let (lo, hi) = template.shape.bounds(&turn);
    let distance = at[plane.normal] - plane.height();
    if from[plane.normal] >= 0.0 {
        distance + lo[plane.normal] > 0.0
    } else {
        distance + hi[plane.normal] < 0.0
    }
}

/// The surface of a body; its flat faces have numbers of their own.
fn mesh(shape: &dyn Shape, refinement: u32) -> Mesh {
    if let Some(body) = shape.as_polyhedron() {
        let mut triangles = Vec::new();
        for (number, face) in body.faces.iter().enumerate() {
            let normals = [single(face.normal); 3];
            let corners = |i: usize| [face.corners[0], face.corners[i], face.corners[i + 1]];
            triangles.extend((1..face.corners.len() - 1).map(|i| Triangle {
                corners: corners(i),
                normals,
                face: number as u32,
            }));
        }
        return Mesh { points: body.vertices.iter().map(|&v| single(v)).collect(), triangles, open: false };
    }
    if !shape.parts().is_empty() {
        let mut all = Mesh { points: Vec::new(), triangles: Vec::new(), open: false };
        for part in shape.parts() {
            let own = mesh(&*part.shape, refinement);
            let (first, faces) = (all.points.len() as u32, all.triangles.iter().map(|t| t.face + 1).max());
            let faces = faces.unwrap_or(0);
            let turned = |v: [f32; 3]| part.orientation * Vec3::from(v.map(f64::from));
            all.points.extend(own.points.iter().map(|&point| single(part.position + turned(point))));
            all.triangles.extend(own.triangles.iter().map(|t| Triangle {
                corners: t.corners.map(|corner| first + corner),
                normals: t.normals.map(|normal| single(turned(normal))),
                face: faces + t.face,
            }));
        }
        return all;
    }
    let surface = shape.surface_mesh(refinement);
    let ends = shape.as_cylinder().is_some();
    let triangle = |corners: &[u32; 3]| {
        let points = corners.map(|i| surface.points[i as usize]);
        let middle = points.iter().sum::<Vec3>() / 3.0;
        // Just inside of the triangle: on an edge of the body it is the normal of its side.
        let normals = points.map(|point| shape.gradient(point.lerp(&middle, INSIDE)));
        let face = if ends && normals[0].z.abs() > 0.9 { 1 + u32::from(normals[0].z > 0.0) } else { 0 };
        Triangle { corners: *corners, normals: normals.map(single), face }
    };
    let triangles = surface.triangles.iter().map(triangle).collect();
    Mesh { points: surface.points.iter().map(|&point| single(point)).collect(), triangles, open: false }
}

/// The part of a wall between two corners of a box. Rods shade what is behind them.
fn add_wall(view: &mut View, surface: &Surface, [lo, hi]: [Vec3; 2]) {
    let mut mesh = Mesh { points: Vec::new(), triangles: Vec::new(), open: false };
    for mut polygon in polygons(&surface.seen_from(lo), &(hi - lo)) {
        for point in &mut polygon {
            *point += lo;
        }
        let normals: Vec<[f32; 3]> = normals_of(surface, &polygon).into_iter().map(single).collect();
        let part = Mesh::polygon(polygon.into_iter().map(single).collect(), &normals, false);
        let first = mesh.points.len() as u32;
        mesh.points.extend(part.points);
        mesh.triangles.extend(
            part.triangles.iter().map(|t| Triangle { corners: t.corners.map(|corner| first + corner), ..*t }),
        );
    }
    view.meshes.push(mesh);
    let mesh = view.meshes.len() - 1;
    let shade = matches!(surface, Surface::Cylinder { pipe: false, .. }).then_some(mesh);
    view.items.push(Item { mesh, shade, ..whole(Paint::Solid(WALLS)) });
}

/// An item whose mesh lies where it says.
pub(super) fn whole(paint: Paint) -> Item {
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    Item { mesh: 0, shade: None, axes, at: [0.0; 3], paint }
}

fn add_slice(view: &mut View, slice: &Slice, snapshot: &Snapshot) {
    let plane = &slice.plane;
    let origin = plane.point(0.0, 0.0);
    let sides = [plane.point(plane.size.0, 0.0) - origin, plane.point(0.0, plane.size.1) - origin];
    let square = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    view.meshes.push(Mesh::polygon(square, &[[0.0, 0.0, 1.0]; 4], true));
    view.items.push(Item {
        mesh: view.meshes.len() - 1,
        axes: [sides[0], sides[1], sides[0].cross(&sides[1])].map(single),
        at: single(origin),
        ..whole(Paint::Image(slice.image(snapshot)))
    });
}

fn add_chains(view: &mut View, chains: &Chains, snapshot: &Snapshot) {
    view.meshes.push(Mesh::tube());
    let tube = view.meshes.len() - 1;
    let (top, diameter) = (chains.scale.range.1, snapshot.diameter);
    for contact in chains.contacts {
        let force = Vec3::from(contact.force).norm();
        if force < LEAST * top {
            continue;
        }
        let radius = LINE * diameter * (force / top).min(1.0).sqrt();
        for (_, [centre, end]) in arms(&snapshot.domain, contact, snapshot.particles) {
            let paint = Paint::Solid(chains.scale.colour(force));
            view.seen_through.push(Item::tube(tube, single(centre), single(end), radius as f32, paint));
        }
    }
}

#[cfg(test)]
mod tests;
