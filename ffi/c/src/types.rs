//! Plain structs of numbers that cross the border.

use turbid::Setup;
use turbid::math::{Quat, Vec3};

/// An open simulation; never 0.
pub type Handle = i64;

/// State of a particle.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct Particle {
    /// Unique number.
    pub id: u64,
    /// Kind of the case, from 0.
    pub kind: u64,
    /// Centre of mass (m).
    pub position: [f64; 3],
    /// Unit quaternion (i, j, k, w) from the principal axes of the body to those of the box.
    pub orientation: [f64; 4],
    /// Velocity of the centre of mass (m/s).
    pub velocity: [f64; 3],
    /// Angular velocity (1/s).
    pub angular_velocity: [f64; 3],
}

impl Particle {
    pub(crate) fn of(particle: &turbid::particle::Particle) -> Self {
        let turbid::particle::Particle {
            id,
            template,
            position,
            orientation,
            velocity,
            angular_velocity,
            ..
        } = *particle;
        Self { id, kind: template, position, orientation, velocity, angular_velocity }
    }

    pub(crate) fn state(&self) -> turbid::particle::Particle {
        let Self { id, kind, position, orientation, velocity, angular_velocity } = *self;
        let particle = turbid::particle::Particle::at(id, kind as usize, Vec3::zeros());
        turbid::particle::Particle { position, orientation, velocity, angular_velocity, ..particle }
    }
}

/// Load on a particle.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct Load {
    /// Force on the centre of mass (N).
    pub force: [f64; 3],
    /// Torque about the centre of mass (N m).
    pub torque: [f64; 3],
}

impl Load {
    pub(crate) fn of(load: &turbid::dem::Load) -> Self {
        Self { force: load.force.into(), torque: load.torque.into() }
    }

    pub(crate) fn state(&self) -> turbid::dem::Load {
        turbid::dem::Load { force: self.force.into(), torque: self.torque.into() }
    }
}

/// Mass and size of a particle, which do not change.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct Body {
    /// Mass (kg).
    pub mass: f64,
    /// Volume (m^3).
    pub volume: f64,
    /// Circumscribed radius (m): the radius of a sphere.
    pub radius: f64,
    /// Principal moments of inertia (kg m^2).
    pub moments: [f64; 3],
    /// Unit quaternion (i, j, k, w) from the principal axes of the body to those in which the case gives its shape.
    pub frame: [f64; 4],
}

impl Body {
    pub(crate) fn of(setup: &Setup, particle: &turbid::particle::Particle) -> Self {
        let kind = particle.template as usize;
        let template = &setup.templates[kind];
        let frame: &Quat = &setup.frames[kind];
        Self {
            mass: template.mass(),
            volume: template.shape.volume(),
            radius: template.shape.circumradius(),
            moments: template.inertia().into(),
            frame: frame.coords.into(),
        }
    }
}

/// Sizes and constants of a case.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct Info {
    /// Number of particles, of all processes.
    pub particles: usize,
    /// Number of cells along x, y, z.
    pub cells: [usize; 3],
    /// Edge of a cell (m).
    pub dx: f64,
    /// Time step (s).
    pub time_step: f64,
    /// Time at the end of the case (s).
    pub end_time: f64,
    /// Gravity (m/s^2).
    pub gravity: [f64; 3],
    /// Density of the fluid (kg/m^3); 0 without one.
    pub fluid_density: f64,
    /// Kinematic viscosity of the fluid (m^2/s); 0 without one.
    pub fluid_viscosity: f64,
    /// 1 where the box is periodic along x, y, z, else 0.
    pub periodic: [i32; 3],
}

impl Info {
    pub(crate) fn of(setup: &Setup) -> Self {
        Self {
            particles: setup.start_count(),
            cells: setup.domain.cells,
            dx: setup.domain.dx,
            time_step: setup.time_step,
            end_time: setup.end_time(),
            gravity: setup.gravity.into(),
            fluid_density: setup.fluid_density(),
            fluid_viscosity: setup.fluid.as_ref().map_or(0.0, |fluid| fluid.viscosity),
            periodic: setup.domain.periodic().map(i32::from),
        }
    }
}
