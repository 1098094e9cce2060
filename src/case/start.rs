//! Flows with which a run may start.
//!
//! ```text
//! couette, shear   u = u_0 + G x                          linear along a direction
//! poiseuille       u = 6 U s (1 - s),  s = x / H          between two plates, of the mean velocity U
//!                  u = 2 U (1 - r^2 / R^2)                in a pipe
//! taylor_green     u_x = U sin(k x) cos(l y) cos(m z),  u_y = -U (k / l) cos(k x) sin(l y) cos(m z),  m = 0 in a plane
//!                  p / rho = U^2 / 8 (A(k) cos(2 k x) + (k / l)^2 A(l) cos(2 l y)),  A(k) = 1 + cos(2 m z) k^2 / (k^2 + m^2)
//! ```
//!
//! Each but the vortices of three dimensions is a solution of the equations of Navier and Stokes; one wave of the vortices in each direction of
//! the box. All but "couette" start with the pressure and the viscous stress of the flow, that is with the part of the populations that is not in
//! equilibrium.
//!
//! Reference: Taylor and Green (1937), doi:10.1098/rspa.1937.0036.

use super::checks::Document;
use super::file::{Axis, FluidStart, PoiseuilleSection, ShearSection, TaylorGreenSection};
use super::placement::Placer;
use super::walls::PlacedWall;
use crate::domain::{Domain, Face};
use crate::error::Result;
use crate::math::{Mat3, Vec3};
use crate::particle::{Particle, PrescribedMotion};
use crate::wall::{Surface, Wall};
use std::f64::consts::TAU;

/// Flow at the start of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StartFlow {
    /// Linear along a direction.
    Linear {
        /// The direction.
        axis: usize,
        /// Velocity (m/s) at its lower end.
        lower: Vec3,
        /// Rise of the velocity along it (1/s).
        gradient: Vec3,
        /// The viscous stress is there from the start.
        stressed: bool,
    },
    /// Between two plates.
    Slit {
        /// The direction from plate to plate.
        axis: usize,
        /// Their distance (m).
        height: f64,
        /// Mean velocity (m/s).
        mean: Vec3,
    },
    /// In a pipe.
    Pipe {
        /// A point of its axis (m), and a unit vector along it.
        axis: [Vec3; 2],
        /// Radius (m).
        radius: f64,
        /// Mean velocity (m/s).
        mean: Vec3,
    },
    /// Vortices.
    TaylorGreen {
        /// The directions of their plane, and the one across.
        axes: [usize; 3],
        /// Wave numbers (1/m) along these; 0 across if all planes are alike.
        waves: [f64; 3],
        /// Largest velocity along the first (m/s).
        speed: f64,
    },
}

impl StartFlow {
    /// Velocity (m/s) at a position (m).
    pub fn velocity(&self, position: Vec3) -> Vec3 {
        match self {
            Self::Linear { axis, lower, gradient, .. } => lower + gradient * position[*axis],
            Self::Slit { axis, height, mean } => {
                let s = (position[*axis] / height).clamp(0.0, 1.0);
                mean * (6.0 * s * (1.0 - s))
            }
            Self::Pipe { axis, radius, mean } => {
                let r = across(position, axis).norm() / radius;
                mean * (2.0 * (1.0 - r * r).max(0.0))
            }
            Self::TaylorGreen { axes: [a, b, c], waves: [k, l, m], speed } => {
                let ((sx, cx), (sy, cy)) = (libm::sincos(k * position[*a]), libm::sincos(l * position[*b]));
                let speed = speed * libm::cos(m * position[*c]);
                let mut velocity = Vec3::zeros();
                velocity[*a] = speed * sx * cy;
                velocity[*b] = -speed * (k / l) * cx * sy;
                velocity
            }
        }
    }

    /// Derivatives of the velocity (1/s): of component `i` along `j` at `(i, j)`.
    pub fn gradient(&self, position: Vec3) -> Mat3 {
        let mut matrix = Mat3::zeros();
        match self {
            Self::Linear { axis, gradient, .. } => matrix.set_column(*axis, gradient),
            Self::Slit { axis, height, mean } => {
                let s = position[*axis] / height;
                if (0.0..=1.0).contains(&s) {
                    matrix.set_column(*axis, &(mean * (6.0 * (1.0 - 2.0 * s) / height)));
                }
            }
            Self::Pipe { axis, radius, mean } => {
                let arm = across(position, axis);
                if arm.norm() < *radius {
                    matrix = mean * arm.transpose() * (-4.0 / (radius * radius));
                }
            }
            Self::TaylorGreen { axes: [a, b, c], waves: [k, l, m], speed } => {
                let ((sx, cx), (sy, cy)) = (libm::sincos(k * position[*a]), libm::sincos(l * position[*b]));
                let (sz, cz) = libm::sincos(m * position[*c]);
                let (along, speed) = (-speed * m * sz, speed * cz);
                matrix[(*a, *c)] = along * sx * cy;
                matrix[(*b, *c)] = -along * (k / l) * cx * sy;
                matrix[(*a, *a)] = speed * k * cx * cy;
                matrix[(*a, *b)] = -speed * l * sx * sy;
                matrix[(*b, *a)] = speed * (k * k / l) * sx * sy;
                matrix[(*b, *b)] = -speed * k * cx * cy;
            }
        }
        matrix
    }

    /// Rate of strain (1/s) whose stress is there from the start: `xx`, `yy`, `zz`, `xy`, `xz`, `yz`.
    pub fn strain(&self, position: Vec3) -> [f64; 6] {
        if matches!(self, Self::Linear { stressed: false, .. }) {
            return [0.0; 6];
        }
        let g = self.gradient(position);
        let mean = |i, j| 0.5 * (g[(i, j)] + g[(j, i)]);
        [mean(0, 0), mean(1, 1), mean(2, 2), mean(0, 1), mean(0, 2), mean(1, 2)]
    }

    /// Pressure over the density (m^2/s^2), without its mean.
    pub fn pressure(&self, position: Vec3) -> f64 {
        match self {
            Self::TaylorGreen { axes: [a, b, c], waves: [k, l, m], speed } => {
                let across = libm::cos(2.0 * m * position[*c]);
                let [px, py] = [(k, a), (l, b)].map(|(k, a)| {
                    libm::cos(2.0 * k * position[*a]) * (0.5 * (1.0 + across * (k * k / (k * k + m * m))))
                });
                0.25 * speed * speed * (px + (k / l) * (k / l) * py)
            }
            _ => 0.0,
        }
    }

    /// Angular velocity of the fluid (1/s), half its vorticity.
    pub fn angular_velocity(&self, position: Vec3) -> Vec3 {
        if let Self::Linear { axis, gradient, .. } = self {
            return 0.5 * Vec3::ith(*axis, 1.0).cross(gradient);
        }
        let g = self.gradient(position);
        0.5 * Vec3::new(g[(2, 1)] - g[(1, 2)], g[(0, 2)] - g[(2, 0)], g[(1, 0)] - g[(0, 1)])
    }

    /// Mean velocity (m/s) over the fluid in a box of edges `size`.
    pub fn mean(&self, size: Vec3) -> Vec3 {
        match self {
            Self::Linear { .. } => self.velocity(0.5 * size),
            Self::Slit { mean, .. } | Self::Pipe { mean, .. } => *mean,
            Self::TaylorGreen { .. } => Vec3::zeros(),
        }
    }

    /// Bound of the speed (m/s) in a box of edges `size`.
    pub fn largest(&self, size: Vec3) -> f64 {
        match self {
            Self::Linear { lower, gradient, axis, .. } => {
                lower.norm().max((lower + gradient * size[*axis]).norm())
            }
            Self::Slit { mean, .. } => 1.5 * mean.norm(),
            Self::Pipe { mean, .. } => 2.0 * mean.norm(),
            Self::TaylorGreen { waves: [k, l, _], speed, .. } => speed.abs() * (k / l).max(1.0),
        }
    }

    /// The flow that a case starts with; none of a fluid at rest.
    pub(super) fn of(document: &Document, domain: &Domain, walls: &[PlacedWall]) -> Result<Option<Self>> {
        let start = document.case.fluid.as_ref().map_or(FluidStart::Rest, |fluid| fluid.start);
        Ok(Some(match start {
            FluidStart::Rest => return Ok(None),
            FluidStart::Couette => couette(document, domain, walls)?,
            FluidStart::Uniform(velocity) => uniform(document, domain, velocity.into())?,
            FluidStart::Shear(section) => shear(document, domain, &section)?,
            FluidStart::Poiseuille(section) => poiseuille(document, domain, walls, &section)?,
            FluidStart::TaylorGreen(section) => taylor_green(document, domain, walls, &section)?,
        }))
    }

    /// Gives the velocity and the angular velocity of the flow to the bodies that are free and have none of their own.
    pub(super) fn carry(&self, placer: &Placer, motions: &[PrescribedMotion], particles: &mut [Particle]) {
        let sections = placer.kinds.of_each(|section, _| section);
        let still = Vec3::zeros();
        for particle in particles {
            let template = particle.template as usize;
            let rests = particle.velocity() == still && particle.angular_velocity() == still;
            if rests && motions[sections[template]].is_free() {
                let pose = (particle.position(), particle.orientation());
                let motion = [self.velocity(pose.0), self.angular_velocity(pose.0)];
                *particle = placer.particle(particle.id, template, pose, motion);
            }
        }
    }
}

/// From the axis of a pipe to a point.
fn across(position: Vec3, [point, along]: &[Vec3; 2]) -> Vec3 {
    let arm = position - point;
    arm - along * arm.dot(along)
}

/// The flow between the faces that move.
fn couette(document: &Document, domain: &Domain, walls: &[PlacedWall]) -> Result<StartFlow> {
    let face = |axis: usize, upper: usize| {
        let name = super::file::FACES[2 * axis + upper];
        walls.iter().find(|placed| placed.is_face && placed.wall.name == name).map(|placed| &placed.wall)
    };
    let slides = |wall: &Wall| !wall.motion.velocity.is_zero();
    let moving: Vec<(usize, [&Wall; 2])> = (0..3)
        .filter_map(|axis| Some((axis, [face(axis, 0)?, face(axis, 1)?])))
        .filter(|(axis, faces)| {
            let are_walls = domain.faces[2 * axis..2 * axis + 2] == [Face::Wall; 2];
            are_walls && faces.iter().any(|face| slides(face))
        })
        .collect();
    let turns = walls.iter().any(|placed| !placed.wall.motion.angular_velocity.is_zero());
    let varies = walls.iter().any(|placed| !placed.wall.motion.is_steady());
    let what = match moving[..] {
        _ if turns => "a wall turns",
        _ if varies => "the velocity of a wall varies",
        [] => "no closed face of the box, one of two walls, has a velocity",
        [(axis, [lower, upper])] => {
            let [lower, upper] = [lower, upper].map(|wall| wall.motion.velocity.at(0.0));
            let gradient = (upper - lower) / domain.size()[axis];
            return Ok(StartFlow::Linear { axis, lower, gradient, stressed: false });
        }
        _ => "faces move in more than one direction of the box",
    };
    let title = format!("`fluid.start` is \"couette\", the flow between two faces that slide, but {what}");
    let remedy = "give `domain.faces` of one direction a velocity, e.g. \"z+\" = { velocity = [1e-3, 0, 0] }, or \
                  remove `fluid.start`";
    Err(document.error("fluid.start", &title, "not between two plates", remedy))
}

/// Refuses a velocity that has no way through the closed faces of the box.
fn refuse_closed(document: &Document, domain: &Domain, key: &str, velocity: Vec3) -> Result<()> {
    match (0..3).find(|&axis| velocity[axis] != 0.0 && !domain.is_open(axis)) {
        None => Ok(()),
        Some(axis) => {
            let title = format!("`{key}` flows along {}, which is closed", ["x", "y", "z"][axis]);
            let remedy = "take 0 there, or open the direction by `domain.periodic` or an inlet and an outlet";
            Err(document.error(key, &title, "no way through", remedy))
        }
    }
}

fn uniform(document: &Document, domain: &Domain, velocity: Vec3) -> Result<StartFlow> {
    refuse_closed(document, domain, "fluid.start.uniform", velocity)?;
    Ok(StartFlow::Linear { axis: 0, lower: velocity, gradient: Vec3::zeros(), stressed: true })
}

fn shear(document: &Document, domain: &Domain, section: &ShearSection) -> Result<StartFlow> {
    let (key, axis) = ("fluid.start.shear", index(section.along));
    let (gradient, velocity) = (Vec3::from(section.gradient), Vec3::from(section.velocity));
    if domain.faces[2 * axis..2 * axis + 2] != [Face::Wall; 2] {
        let title = format!("`{key}` rises along {}, which has no wall at both ends", ["x", "y", "z"][axis]);
        let remedy = "close the direction by `domain.periodic`, or take another one for `along`";
        return Err(document.error(key, &title, "not between walls", remedy));
    }
    refuse_closed(document, domain, &format!("{key}.gradient"), gradient)?;
    refuse_closed(document, domain, &format!("{key}.velocity"), velocity)?;
    let lower = velocity - gradient * (0.5 * domain.size()[axis]);
    Ok(StartFlow::Linear { axis, lower, gradient, stressed: true })
}

fn poiseuille(
    document: &Document,
    domain: &Domain,
    walls: &[PlacedWall],
    section: &PoiseuilleSection,
) -> Result<StartFlow> {
    let (key, mean) = ("fluid.start.poiseuille", Vec3::from(section.velocity));
    refuse_closed(document, domain, key, mean)?;
    let slips = |axis: usize| domain.faces[2 * axis..2 * axis + 2].contains(&Face::FreeSlip);
    let closed: Vec<usize> = (0..3).filter(|&axis| !domain.is_open(axis)).collect();
    let listed: Vec<&Surface> =
        walls.iter().filter(|placed| !placed.is_face).map(|placed| &placed.wall.surface).collect();
    match (&closed[..], &listed[..]) {
        (&[axis], []) if !slips(axis) => Ok(StartFlow::Slit { axis, height: domain.size()[axis], mean }),
        (_, &[&Surface::Cylinder { point, axis, radius, pipe: true }])
            if mean.cross(&axis).norm() <= 1e-9 * mean.norm() =>
        {
            Ok(StartFlow::Pipe { axis: [point, axis], radius, mean })
        }
        _ => {
            let title = format!(
                "`{key}` is the flow between two plates, or along one pipe, which this case does not have"
            );
            let remedy = "close one direction by `domain.periodic` without other walls, or give one wall, a `pipe` along the \
                          velocity";
            Err(document.error(key, &title, "no slit or pipe", remedy))
        }
    }
}

fn taylor_green(
    document: &Document,
    domain: &Domain,
    walls: &[PlacedWall],
    section: &TaylorGreenSection,
) -> Result<StartFlow> {
    let (key, normal) = ("fluid.start.taylor_green", index(section.normal));
    let axes = [(normal + 1) % 3, (normal + 2) % 3, normal];
    let varied = if section.three_dimensional { 3 } else { 2 };
    if !walls.is_empty() || axes[..varied].iter().any(|&axis| !domain.is_periodic(axis)) {
        let title = format!("`{key}` needs a box that is periodic in all directions");
        let remedy = "open the directions by `domain.periodic`, and remove walls";
        return Err(document.error(key, &title, "between walls", remedy));
    }
    let mut waves = axes.map(|axis| TAU / domain.size()[axis]);
    waves[varied..].fill(0.0);
    Ok(StartFlow::TaylorGreen { axes, waves, speed: section.velocity })
}

fn index(axis: Axis) -> usize {
    match axis {
        Axis::X => 0,
        Axis::Y => 1,
        Axis::Z => 2,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::{Setup, from_text};

    const SHEAR: &str = "domain.size.diameters = [6, 6, 6]\n\
                         domain.periodic = [true, true, false]\n\
                         domain.faces = { z-.velocity = [-1e-3, 0, 0], \"z+\".velocity = [2e-3, 0, 0] }\n\
                         fluid = { density = 1000, viscosity = 1e-6, start = \"couette\" }\n\
                         lattice = { cells_per_diameter = 4, relaxation_time = 0.8 }\n\
                         driving.gravity = 0\n\
                         run.end.steps = 10\n\
                         [[particles]]\n\
                         shape.cuboid.edges = [1e-3, 1e-3, 2e-3]\n\
                         density = 1000.0\n\
                         list = [[2e-3, 2e-3, 1.5e-3], { position = [2e-3, 2e-3, 6e-3], velocity = [0, 1e-3, 0] }]\n";

    #[test]
    fn bodies_start_with_the_velocity_and_half_the_vorticity_of_the_flow_or_their_own() {
        let setup = from_text(SHEAR, "shear", &[]).unwrap_or_else(|e| panic!("{e}"));
        let Some(StartFlow::Linear { gradient, .. }) = setup.expect_fluid().start else { panic!() };
        let rate = 3e-3 / setup.domain.size().z;
        assert!((gradient - Vec3::new(rate, 0.0, 0.0)).norm() < 1e-12 * rate);
        let [carried, own] = &setup.particles[..] else { panic!() };
        assert!((carried.velocity() - Vec3::new(-1e-3 + 1.5e-3 * rate, 0.0, 0.0)).norm() < 1e-18);
        // The fluid turns about y from z to x.
        assert!((carried.angular_velocity() - Vec3::new(0.0, 0.5 * rate, 0.0)).norm() < 1e-15);
        let inertia = setup.templates[0].inertia();
        let spin = carried.orientation().inverse_transform_vector(&carried.angular_velocity());
        let momentum = carried.orientation().transform_vector(&inertia.component_mul(&spin));
        assert_eq!(Vec3::from(carried.angular_momentum), momentum);
        assert_eq!((own.velocity(), own.angular_velocity()), (Vec3::new(0.0, 1e-3, 0.0), Vec3::zeros()));
    }

    #[test]
    fn bodies_that_start_with_the_flow_meet_at_the_shear_rate() {
        let carried = "particles.0.list=[[2e-3, 2e-3, 1.5e-3], [2e-3, 2e-3, 5e-3]]".to_string();
        let impact = from_text(SHEAR, "shear", &[carried]).unwrap().impact().unwrap();
        assert_eq!(impact.cause, "shear rate times D");
    }

    #[test]
    fn of_a_flow_that_is_too_fast_the_wall_is_named_and_not_the_bodies_that_it_carries() {
        let options = ["domain.faces={\"z+\"={velocity=[2, 0, 0]}}", "particles.0.list=[[2e-3, 2e-3, 5e-3]]"];
        let error = from_text(SHEAR, "shear", &options.map(String::from)).unwrap_err().to_string();
        assert!(error.contains("the wall \"z+\"") && !error.contains("particles.0"), "{error}");
    }

    #[test]
    fn a_flow_that_is_not_between_two_sliding_faces_is_refused() {
        for (option, what) in [
            ("domain.faces={}", "no closed face of the box, one of two walls, has a velocity"),
            ("domain.faces={\"z-\"={velocity=[1,0,0]},\"x-\"={velocity=[0,1,0]}}", "more than one direction"),
            ("domain.faces={\"z-\"={rotation=1}}", "a wall turns"),
            ("domain.faces={\"z-\"={velocity.table=[[0,1,0,0]]}}", "the velocity of a wall varies"),
        ] {
            let options = [option.to_string(), "domain.periodic=[false, false, false]".to_string()];
            let error = from_text(SHEAR, "shear", &options).unwrap_err().to_string();
            assert!(error.contains(what), "{error}");
        }
    }

    /// A case of a fluid alone in a box that is closed in z, changed.
    fn fluid(options: &[&str]) -> crate::error::Result<Setup> {
        let text = "domain = { size = [1e-3, 1.5e-3, 2e-3], periodic = [true, true, false] }\n\
                    fluid = { density = 1000, viscosity = 1e-6 }\n\
                    lattice = { cells_per_diameter = 2, relaxation_time = 0.8 }\n\
                    driving.gravity = 0\n\
                    run.end.steps = 10\n\
                    particles = [{ shape.sphere.diameter = 1e-4, density = 1000, list = [] }]\n";
        from_text(text, "start", &options.iter().map(ToString::to_string).collect::<Vec<_>>())
    }

    const OPEN: &str = "domain.periodic=[true, true, true]";
    const PIPE: &str =
        "walls=[{ name = \"p\", pipe = { point = [0, 7.5e-4, 1e-3], axis = [1, 0, 0], diameter = 1e-3 } }]";

    fn flows() -> Vec<StartFlow> {
        let cases: [&[&str]; 6] = [
            &["fluid.start={ uniform = [1e-3, -2e-3, 0] }"],
            &["fluid.start={ shear = { gradient = [3, -1, 0], along = \"z\", velocity = [1e-3, 0, 0] } }"],
            &["fluid.start={ poiseuille = { velocity = [2e-3, 1e-3, 0] } }"],
            &[
                "fluid.start={ poiseuille = { velocity = [2e-3, 0, 0] } }",
                PIPE,
                "domain.periodic=[true, false, false]",
            ],
            &["fluid.start={ taylor_green = { velocity = 4e-3, normal = \"x\" } }", OPEN],
            &["fluid.start={ taylor_green = { velocity = 4e-3, three_dimensional = true } }", OPEN],
        ];
        cases.iter().map(|options| fluid(options).unwrap().expect_fluid().start.unwrap()).collect()
    }

    #[test]
    fn the_gradient_is_that_of_the_velocity_without_divergence_and_the_vorticity_its_curl() {
        for flow in flows() {
            for at in [Vec3::new(3e-4, 5.5e-4, 1.2e-3), Vec3::new(9e-4, 8e-4, 7e-4)] {
                let (gradient, h) = (flow.gradient(at), 1e-8);
                for j in 0..3 {
                    let step = Vec3::ith(j, h);
                    let slope = (flow.velocity(at + step) - flow.velocity(at - step)) / (2.0 * h);
                    assert!((slope - gradient.column(j)).norm() < 1e-6 * (1.0 + slope.norm()), "{flow:?}");
                }
                assert!(gradient.trace().abs() < 1e-12, "{flow:?}");
                let curl = Vec3::new(
                    gradient[(2, 1)] - gradient[(1, 2)],
                    gradient[(0, 2)] - gradient[(2, 0)],
                    gradient[(1, 0)] - gradient[(0, 1)],
                );
                assert!((2.0 * flow.angular_velocity(at) - curl).norm() < 1e-12, "{flow:?}");
            }
        }
    }

    #[test]
    fn a_flow_has_the_mean_velocity_that_it_says_and_none_faster_than_its_bound() {
        let size = Vec3::new(1e-3, 1.5e-3, 2e-3);
        for flow in flows() {
            let in_fluid = |at: Vec3| match flow {
                StartFlow::Pipe { axis, radius, .. } => across(at, &axis).norm() < radius,
                _ => true,
            };
            let n = 48_usize;
            let all = (0..n * n * n).map(|k| {
                let cell = Vec3::new((k % n) as f64, (k / n % n) as f64, (k / n / n) as f64);
                (cell.add_scalar(0.5) / n as f64).component_mul(&size)
            });
            let velocities: Vec<Vec3> = all.filter(|at| in_fluid(*at)).map(|at| flow.velocity(at)).collect();
            let mean = velocities.iter().sum::<Vec3>() / velocities.len() as f64;
            let bound = flow.largest(size);
            assert!((mean - flow.mean(size)).norm() < 5e-3 * bound, "{flow:?}: {mean}");
            let fastest = velocities.iter().map(Vec3::norm).fold(0.0, f64::max);
            assert!(fastest <= bound * (1.0 + 1e-12) && fastest > 0.9 * bound, "{flow:?}");
        }
    }

    #[test]
    fn the_pressure_of_vortices_keeps_them_free_of_divergence() {
        for flow in &flows()[4..] {
            for at in [Vec3::new(1e-4, 3e-4, 5e-4), Vec3::new(2e-4, 1.1e-3, 1.7e-3)] {
                let h = 1e-6;
                let curvature = (0..3).map(|j| {
                    let step = Vec3::ith(j, h);
                    (flow.pressure(at + step) + flow.pressure(at - step) - 2.0 * flow.pressure(at)) / (h * h)
                });
                let (curvature, gradient) = (curvature.sum::<f64>(), flow.gradient(at));
                let source = (gradient * gradient).trace();
                assert!((curvature + source).abs() < 1e-4 * gradient.norm_squared(), "{curvature} {source}");
            }
        }
    }

    #[test]
    fn the_pressure_of_vortices_in_a_plane_balances_their_inertia() {
        let flow = flows()[4];
        for at in [Vec3::new(1e-4, 3e-4, 5e-4), Vec3::new(2e-4, 1.1e-3, 1.7e-3)] {
            let h = 1e-8;
            let slope = Vec3::from_fn(|j, _| {
                (flow.pressure(at + Vec3::ith(j, h)) - flow.pressure(at - Vec3::ith(j, h))) / (2.0 * h)
            });
            let inertia = flow.gradient(at) * flow.velocity(at);
            assert!((slope + inertia).norm() < 1e-6 * inertia.norm(), "{slope} {inertia}");
        }
    }

    #[test]
    fn flows_that_do_not_fit_the_box_are_refused_with_their_key() {
        for (options, what) in [
            (vec!["fluid.start={ uniform = [0, 0, 1e-3] }"], "which is closed"),
            (vec!["fluid.start={ shear = { gradient = [1, 0, 0], along = \"y\" } }"], "no wall at both ends"),
            (vec!["fluid.start={ shear = { gradient = [0, 0, 1], along = \"z\" } }"], "which is closed"),
            (
                vec!["fluid.start={ poiseuille = { velocity = [1e-3, 0, 0] } }", OPEN],
                "between two plates, or along one pipe",
            ),
            (vec!["fluid.start={ taylor_green = { velocity = 1e-3 } }"], "periodic in all directions"),
            (vec!["fluid.start={ uniform = [9, 0, 0] }"], "cells per time step"),
        ] {
            let error = fluid(&options).unwrap_err().to_string();
            assert!(error.contains("fluid.start") && error.contains(what), "{error}");
        }
    }
}
