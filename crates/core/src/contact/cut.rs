//! Convex parts of bodies cut by planes across the axes of the box: in closed form for spheres and polyhedra, else by lines along the axis.

use super::Geometry;
use super::overlap::{Body, GrownShape, overlap_wall};
use crate::math::{Quat, Vec3, nalgebra::Quaternion};
use crate::shape::{Part, Shape};
use crate::wall::Surface;
use std::f64::consts::PI;
use std::sync::Arc;

/// Lines along the axis, each way across it.
const LINES: u32 = 32;

/// A convex part of a body; of one that goes through the box the piece in it.
#[derive(Clone, Debug)]
pub struct CutPart {
    /// Its geometry.
    pub shape: Arc<dyn Shape>,
    /// Its centre in the body (m).
    pub position: Vec3,
    /// Its orientation in the body.
    pub orientation: Quat,
    grown: GrownShape,
}

impl CutPart {
    /// A part with its pose in the body, if it is not the only part.
    pub fn new((shape, pose): (&Arc<dyn Shape>, Option<&Part>)) -> Self {
        let shape = shape.piece().unwrap_or_else(|| shape.clone());
        let (position, orientation) =
            pose.map_or((Vec3::zeros(), Quat::identity()), |pose| (pose.position, pose.orientation));
        Self { grown: GrownShape::new(shape.clone(), 0.0), shape, position, orientation }
    }

    /// The volume (m^3) of the part, in an orientation, below a height (m) over its centre along an axis of the box. Without a closed form it is
    /// made of lines along the axis, scaled so that all of it is the volume; none are made where it is not `cut`.
    pub fn below(&self, orientation: Quat, axis: usize, cut: bool) -> impl Fn(f64) -> f64 {
        let sphere = self.shape.as_sphere();
        let (mut lines, mut area) = (Vec::new(), 0.0);
        if cut && sphere.is_none() && !self.grown.is_solid() {
            let turned = onto_x(axis) * orientation;
            let (low, high) = self.shape.bounds(&turned);
            let step = (high - low) / f64::from(LINES);
            let at = |n: u32, a: usize| low[a] + (f64::from(n) + 0.5) * step[a];
            for (j, k) in (0..LINES).flat_map(|j| (0..LINES).map(move |k| (j, k))) {
                lines.extend(self.shape.row_interval(&turned, at(j, 1), at(k, 2), 0.0));
            }
            let length: f64 = lines.iter().map(|(from, to)| to - from).sum();
            area = self.shape.volume() / length;
        }
        let up = Vec3::ith(axis, 1.0);
        move |height: f64| {
            if let Some(radius) = sphere {
                let h = height.clamp(-radius, radius);
                return PI * (2.0 / 3.0 * radius * radius * radius + h * (radius * radius - h * h / 3.0));
            }
            if lines.is_empty() {
                let plane = Surface::Plane { point: up * height, normal: up };
                let body = Body { grown: &self.grown, orientation };
                return overlap_wall(Geometry::Exact, &body, &plane).map_or(0.0, |overlap| overlap.volume);
            }
            lines.iter().map(|(from, to)| height.clamp(*from, *to) - from).sum::<f64>() * area
        }
    }
}

/// The rotation that leads an axis of the box to x.
fn onto_x(axis: usize) -> Quat {
    let turn = |s: f64| Quat::new_unchecked(Quaternion::new(0.5, s, s, s));
    match axis {
        0 => Quat::identity(),
        1 => turn(-0.5),
        _ => turn(0.5),
    }
}
