//! What a picture of the box shows besides the fluid.

use super::plane::Plane;
use super::text::{Span, above, italic, roman};
use crate::math::Vec3;
use crate::particle::{Particle, Template};
use crate::wall::Wall;

/// The box and what is in it at one time.
#[derive(Clone, Copy, Debug)]
pub struct Scene<'a> {
    /// Name of the case, for the title.
    pub case: &'a str,
    /// Time, for the title and for where moving walls are.
    pub clock: Clock,
    /// What is cut, or seen along the normal of; with the box and its cells.
    pub plane: Plane,
    /// Geometries and materials.
    pub templates: &'a [Template],
    /// All particles.
    pub particles: &'a [Particle],
    /// All walls.
    pub walls: &'a [Wall],
    /// Speed at the upper end of the colours (m/s); `None` takes the largest there is to see. Give the same one to all
    /// pictures of a film.
    pub largest_speed: Option<f64>,
}

/// A time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clock {
    /// Since the start (s).
    pub time: f64,
    /// Unit of `t*`, `D / u_Stokes` (s); `None` tells the time in seconds.
    pub stokes_time: Option<f64>,
}

impl Clock {
    /// The time as text without its name.
    pub(super) fn text(&self) -> String {
        match self.stokes_time {
            Some(unit) => format!(" = {:.1}", self.time / unit),
            None if self.time > 0.0 && self.time < 0.1 => format!(" = {:.2} ms", 1e3 * self.time),
            None => format!(" = {:.3} s", self.time),
        }
    }

    /// The time with its name.
    pub(super) fn spans<'a>(&self, text: &'a str) -> Vec<Span<'a>> {
        match self.stokes_time {
            Some(_) => vec![italic("t"), above("*"), roman(text)],
            None => vec![italic("t"), roman(text)],
        }
    }
}

impl Scene<'_> {
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
}
