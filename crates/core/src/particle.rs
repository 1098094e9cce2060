//! One particle, its template, and the particles of a rank, ghosts included.

mod motion;

use crate::math::{Quat, Vec3, nalgebra::Quaternion};
use crate::shape::{Part, Shape};
use bytemuck::{Pod, Zeroable};
pub use motion::PrescribedMotion;
use std::sync::Arc;

/// Geometry and material common to many particles.
#[derive(Clone, Debug)]
pub struct Template {
    /// Geometry.
    pub shape: Arc<dyn Shape>,
    /// Density (kg/m^3).
    pub density: f64,
    /// Index of its material in the contact model.
    pub material: usize,
}

impl Template {
    /// Mass (kg).
    pub fn mass(&self) -> f64 {
        self.density * self.shape.volume()
    }

    /// The convex parts of the geometry, each with its pose in the body; without one if it is the only part.
    pub fn parts(&self) -> impl Iterator<Item = (&Arc<dyn Shape>, Option<&Part>)> {
        let parts = self.shape.parts();
        let whole = parts.is_empty().then_some((&self.shape, None));
        whole.into_iter().chain(parts.iter().map(|part| (&part.shape, Some(part))))
    }

    /// Principal moments of inertia (kg m^2).
    pub fn inertia(&self) -> Vec3 {
        self.mass() * self.shape.inertia_per_mass()
    }
}

/// Largest deviation of the length of an orientation from one.
const UNIT: f64 = 1e-6;

/// State of one particle, SI units, world frame. Plain data, so that it travels and is hashed as bytes.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Particle {
    /// Unique number, never reused.
    pub id: u64,
    /// Index into [`ParticleStore::templates`].
    pub template: u64,
    /// Centre of mass (m), wrapped into the domain.
    pub position: [f64; 3],
    /// Unit quaternion `(i, j, k, w)` that maps the body frame to the world frame.
    pub orientation: [f64; 4],
    /// Velocity of the centre of mass (m/s).
    pub velocity: [f64; 3],
    /// Angular velocity (1/s), derived from the angular momentum.
    pub angular_velocity: [f64; 3],
    /// Angular momentum about the centre of mass (kg m^2/s).
    pub angular_momentum: [f64; 3],
    /// Sum of the contact forces of the sub-step before (N): the integrator is second order.
    pub contact_force: [f64; 3],
    /// Sum of their torques about the centre of mass (N m).
    pub contact_torque: [f64; 3],
}

impl Particle {
    /// A particle at rest with the axes of its body along those of the world.
    pub fn at(id: u64, template: usize, position: Vec3) -> Self {
        Self {
            id,
            template: template as u64,
            position: position.into(),
            orientation: [0.0, 0.0, 0.0, 1.0],
            ..Self::zeroed()
        }
    }

    /// Position (m).
    pub fn position(&self) -> Vec3 {
        self.position.into()
    }

    /// Velocity (m/s).
    pub fn velocity(&self) -> Vec3 {
        self.velocity.into()
    }

    /// Angular velocity (1/s).
    pub fn angular_velocity(&self) -> Vec3 {
        self.angular_velocity.into()
    }

    /// Orientation.
    pub fn orientation(&self) -> Quat {
        let [i, j, k, w] = self.orientation;
        Quat::new_unchecked(Quaternion::new(w, i, j, k))
    }

    /// Orientation of the shape as the case gives it; `frame` leads from the axes of the body to those of the case.
    pub fn orientation_given(&self, frame: &Quat) -> Quat {
        // Without the product a shape that is given along its own axes keeps every bit.
        if *frame == Quat::identity() { self.orientation() } else { self.orientation() * frame.inverse() }
    }

    /// Sets the orientation.
    pub fn set_orientation(&mut self, orientation: &Quat) {
        self.orientation = orientation.coords.into();
    }

    /// Reason why this cannot be the state of a particle in a box of this size (m), if there is one.
    pub fn flaw(&self, size: Vec3) -> Option<String> {
        let fields: [(&str, &[f64]); 7] = [
            ("position", &self.position),
            ("orientation", &self.orientation),
            ("velocity", &self.velocity),
            ("angular velocity", &self.angular_velocity),
            ("angular momentum", &self.angular_momentum),
            ("contact force", &self.contact_force),
            ("contact torque", &self.contact_torque),
        ];
        let is_finite = |numbers: &[f64]| numbers.iter().all(|x| x.is_finite());
        if let Some((name, _)) = fields.iter().find(|(_, numbers)| !is_finite(numbers)) {
            return Some(format!("the {name} of particle {} is not finite", self.id));
        }
        let length = self.orientation().quaternion().norm();
        if (length - 1.0).abs() > UNIT {
            return Some(format!("the orientation of particle {} has the length {length}", self.id));
        }
        let outside = (0..3).any(|i| !(0.0..=size[i]).contains(&self.position[i]));
        outside.then(|| format!("the position of particle {} is not in the box", self.id))
    }

    /// Returns true if every number of the state is finite.
    pub fn is_finite(&self) -> bool {
        [self.position, self.velocity, self.angular_velocity, self.angular_momentum]
            .iter()
            .all(|v| v.iter().all(|x| x.is_finite()))
    }
}

/// The particles that touch one rank's block.
#[derive(Clone, Debug)]
pub struct ParticleStore {
    /// Shared geometries and materials, the same list on every rank.
    pub templates: Arc<[Template]>,
    /// Owned particles first, ghosts after; each group in ascending order of id.
    pub particles: Vec<Particle>,
    /// Number of owned particles.
    pub owned: usize,
    /// Rank that owns each particle; `owners.len() == particles.len()`.
    pub owners: Vec<u32>,
}

impl ParticleStore {
    /// The owned particles.
    pub fn owned(&self) -> &[Particle] {
        &self.particles[..self.owned]
    }

    /// Template of a particle.
    pub fn template(&self, particle: &Particle) -> &Template {
        &self.templates[particle.template as usize]
    }
}
