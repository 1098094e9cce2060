//! Velocities that a case will reach, as far as they can be told beforehand, against what the lattice can follow.
//!
//! ```text
//! settling    u* of Schiller and Naumann; at most a t, and sqrt(2 a H) where walls bear the weight,
//!             with a = g |s - 1| / (s + 1/2), the acceleration from rest against the added mass of a sphere
//! driven flow a t; between walls at most a h^2 / (8 nu) in the middle of a slit of width h, a D^2 / (16 nu) in a pipe;
//!             turbulent (Re = u h / nu above 3000) u_tau (2.5 ln(u_tau h / (2 nu)) + 5.5) with u_tau^2 = a h / 2
//! impacts     at u*, the shear rate times D, prescribed speeds and those at the start; the shear rate is the difference of
//!             the velocities of walls, or twice the velocity of the driven flow, over h
//! ```
//!
//! Reference: Pope (2000), Turbulent Flows, section 7.1.

use super::hertz::{Hertz, STEPS_PER_CONTACT};
use super::scales::Reference;
use super::{FluidSetup, Setup};
use crate::math::Vec3;
use crate::wall::{Surface, Wall};

/// Steps that a contact should last where shear presses particles together: enough to be stable. Nothing depends on how they
/// rebound: the viscosity of `cases/shear_cell.toml` is the same to 3e-6 with 10 and with 52 steps.
const STEPS_IN_SHEAR: f64 = 10.0;

/// Reynolds number of the gap from which a driven flow is taken as turbulent (-).
const TURBULENT_REYNOLDS: f64 = 3000.0;

/// A flow that a body acceleration drives along periodic directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DrivenFlow {
    /// Largest velocity over the run (m/s).
    pub speed: f64,
    /// Smallest distance of walls across the flow (m); the diameter of the particles where there are none.
    pub length: f64,
    /// Walls hold the flow back.
    pub between_walls: bool,
}

/// The usual impact of two particles that most needs short steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Impact {
    /// Relative speed (m/s).
    pub speed: f64,
    /// What makes them meet.
    pub cause: &'static str,
    /// Steps of the particles that it lasts, as one of two spheres of the first kind.
    pub steps: f64,
    /// Steps that it should last.
    pub needed: f64,
}

impl Impact {
    /// Sub-steps that resolve it, of a case with so many.
    pub fn substeps(&self, given: u32) -> f64 {
        (f64::from(given) * self.needed / self.steps).ceil()
    }
}

impl Setup {
    /// The flow that the body acceleration drives, if there is one.
    pub fn driven_flow(&self) -> Option<DrivenFlow> {
        let fluid = self.fluid.as_ref()?;
        let mut flow = DrivenFlow { speed: 0.0, length: f64::INFINITY, between_walls: false };
        for axis in (0..3).filter(|&i| self.domain.periodic[i] && fluid.body_acceleration[i] != 0.0) {
            let acceleration = fluid.body_acceleration[axis].abs();
            let width = self.width_across(axis);
            let steady = steady_speed(acceleration, width, fluid.viscosity);
            let speed = steady.min(acceleration * self.end_time());
            if speed > flow.speed {
                flow.length = width;
            }
            flow.speed = libm::hypot(flow.speed, speed);
        }
        if flow.length.is_infinite() {
            flow.length = self.diameter;
        } else {
            flow.between_walls = true;
        }
        (flow.speed > 0.0).then_some(flow)
    }

    /// Width (m) of the slit whose flow along an axis is at least as fast as that between the walls of the case.
    fn width_across(&self, axis: usize) -> f64 {
        let size = self.domain.size();
        let widths = self.walls.iter().map(|wall| match wall.surface {
            Surface::Plane { normal, .. } => size.dot(&normal.abs()),
            Surface::Cylinder { radius, pipe: true, .. } => 2.0_f64.sqrt() * radius,
            // It leaves no wider a gap than the box.
            Surface::Cylinder { .. } => size[(axis + 1) % 3].min(size[(axis + 2) % 3]),
        });
        widths.fold(f64::INFINITY, f64::min)
    }

    /// The usual impact in a fluid that most needs short steps; none without contacts, or where nothing moves.
    pub fn impact(&self) -> Option<Impact> {
        let (fluid, contact, template) =
            (self.fluid.as_ref()?, self.contact.as_ref()?, self.templates.first()?);
        let hertz = Hertz::new(template, &contact.materials[template.material]);
        let flow = |at| fluid.start.map_or(Vec3::zeros(), |flow| flow.velocity(at));
        let started = self.particles.iter().map(|p| (p.velocity() - flow(p.position())).norm());
        let prescribed = (0..self.templates.len()).map(|template| self.prescribed_speed(template));
        let sheared = if self.particles.len() > 1 { self.shear_rate() * self.diameter } else { 0.0 };
        let impacts = [
            (fluid.scales.schiller_naumann_velocity, "u*", STEPS_PER_CONTACT),
            (prescribed.fold(0.0, f64::max), "the prescribed speed", STEPS_PER_CONTACT),
            (started.fold(0.0, f64::max), "the speed at the start", STEPS_PER_CONTACT),
            (sheared, "shear rate times D", STEPS_IN_SHEAR),
        ];
        let impacts = impacts.into_iter().filter(|&(speed, ..)| speed > 0.0).map(|(speed, cause, needed)| {
            let steps = hertz.duration(speed) / self.time_step * f64::from(self.substeps);
            Impact { speed, cause, steps, needed }
        });
        impacts.min_by(|a, b| (a.steps / a.needed).total_cmp(&(b.steps / b.needed)))
    }

    /// Shear rate (1/s) that moving walls or a driven flow between walls make at most, in the mean over the gap.
    fn shear_rate(&self) -> f64 {
        let size = self.domain.size();
        let width = (0..3).map(|axis| self.width_across(axis)).fold(f64::INFINITY, f64::min);
        let differences = self.walls.iter().enumerate().flat_map(|(first, wall)| {
            let others = self.walls[first + 1..].iter();
            let alone = (self.walls.len() == 1).then(|| wall_speed(wall, &size));
            others
                .map(move |other| {
                    let turns = wall.motion.angular_velocity != Vec3::zeros()
                        || other.motion.angular_velocity != Vec3::zeros();
                    if turns {
                        wall_speed(wall, &size) + wall_speed(other, &size)
                    } else {
                        (wall.motion.velocity - other.motion.velocity).norm()
                    }
                })
                .chain(alone)
        });
        let driven =
            self.driven_flow().filter(|flow| flow.between_walls).map_or(0.0, |flow| 2.0 * flow.speed);
        differences.fold(driven, f64::max) / width
    }

    /// Bound (m/s) of the speed that prescribed motion gives to the surface of particles of a template.
    pub(crate) fn prescribed_speed(&self, template: usize) -> f64 {
        self.motions[template].largest_speed(self.templates[template].shape.circumradius())
    }

    /// Largest speed (m/s) that particles of a template reach as they settle.
    pub(super) fn settling_speed(&self, fluid: &FluidSetup, template: usize) -> f64 {
        let template = &self.templates[template];
        let density_ratio = template.density / fluid.density;
        let reference = Reference {
            diameter: template.shape.equivalent_diameter(),
            density_ratio,
            gravity: self.gravity.norm(),
        };
        let terminal = reference.scales(fluid.viscosity).schiller_naumann_velocity;
        let from_rest = (density_ratio - 1.0).abs() / (density_ratio + 0.5);
        // Gravity times the way along it.
        let drop: f64 = (0..3)
            .filter(|&i| self.gravity[i] != 0.0)
            .map(|i| {
                let way = if self.domain.periodic[i] { f64::INFINITY } else { self.domain.size()[i] };
                self.gravity[i].abs() * way
            })
            .sum();
        terminal.min(from_rest * self.gravity.norm() * self.end_time()).min((2.0 * from_rest * drop).sqrt())
    }
}

/// Speed in the middle of a slit (m/s).
fn steady_speed(acceleration: f64, width: f64, viscosity: f64) -> f64 {
    let laminar = acceleration * width * width / (8.0 * viscosity);
    if width.is_infinite() || laminar * width / viscosity < TURBULENT_REYNOLDS {
        return laminar;
    }
    let friction = (0.5 * acceleration * width).sqrt();
    friction * (2.5 * libm::log(0.5 * friction * width / viscosity) + 5.5)
}

/// Largest speed of a wall (m/s) in a box of edges `size`: of a plane that turns, half the diagonal of the box along it from its
/// pivot.
pub(super) fn wall_speed(wall: &Wall, size: &Vec3) -> f64 {
    let arm = match wall.surface {
        Surface::Plane { normal, .. } => {
            let across = size.dot(&normal.abs());
            0.5 * (size.norm_squared() - across * across).max(0.0).sqrt()
        }
        Surface::Cylinder { radius, .. } => radius,
    };
    wall.motion.velocity.norm() + wall.motion.angular_velocity.norm() * arm
}

#[cfg(test)]
mod tests {
    use crate::case::{Setup, from_text};

    fn setup(options: &[&str]) -> Setup {
        let text = "domain = { size = [2e-3, 1e-3, 1e-3], periodic = [true, true, false] }\n\
                    fluid = { density = 1000, viscosity = 1e-6 }\n\
                    lattice = { cells_per_diameter = 4, relaxation_time = 0.8 }\n\
                    driving = { gravity = 0, body_acceleration = [4e-2, 0, 3.0] }\n\
                    run.end.time = 10\n\
                    [[particles]]\n\
                    shape.sphere.diameter = 2e-4\n\
                    density = 500.0\n\
                    list = [[1e-3, 5e-4, 5e-4]]\n";
        let options: Vec<String> = options.iter().map(ToString::to_string).collect();
        from_text(text, "slit", &options).unwrap_or_else(|e| panic!("{e}"))
    }

    fn close(a: f64, b: f64) {
        assert!((a / b - 1.0).abs() < 1e-9, "{a} is not {b}");
    }

    #[test]
    fn a_driven_flow_is_that_of_its_slit_or_pipe_and_no_faster_than_free_acceleration() {
        let flow = |options: &[&str]| setup(options).driven_flow().unwrap();
        let slit = flow(&[]);
        close(slit.speed, 4e-2 * 1e-6 / 8e-6);
        assert!(slit.between_walls && (slit.length - 1e-3).abs() < 1e-12);
        close(flow(&["run.end.time=0.01"]).speed, 4e-4);
        let open = flow(&["domain.periodic=[true, true, true]", "driving.body_acceleration=[0, 0, 1e-3]"]);
        close(open.speed, 1e-2);
        assert!(!open.between_walls && (open.length - 2e-4).abs() < 1e-12);
        let pipe =
            "walls=[{ name = \"p\", pipe = { point = [0, 5e-4, 5e-4], axis = [1, 0, 0], diameter = 8e-4 } }]";
        close(flow(&[pipe]).speed, 4e-2 * 64e-8 / 16e-6);
        // The friction Reynolds number of the half width is 180.
        let turbulent = flow(&["driving.body_acceleration=[259.2, 0, 0]", "lattice.relaxation_time=0.5003"]);
        close(turbulent.speed, 0.36 * (2.5 * libm::log(180.0) + 5.5));
        assert!(setup(&["driving.body_acceleration=[0, 0, 9]"]).driven_flow().is_none());
    }

    #[test]
    fn the_impact_that_needs_the_shortest_steps_is_that_of_settling_shear_or_the_start() {
        let pair = "particles.0.list=[[1e-3, 5e-4, 5e-4], [5e-4, 5e-4, 5e-4]]";
        let impact = |options: &[&str]| setup(&[&[pair], options].concat()).impact();
        let at_rest = "driving.body_acceleration=[0, 0, 0]";
        assert_eq!(impact(&[at_rest]), None);
        let plates =
            r#"domain.faces={ "z-" = { velocity = [-1e-3, 0, 0] }, "z+" = { velocity = [2e-3, 0, 0] } }"#;
        assert_eq!(setup(&[at_rest, plates]).impact(), None, "one particle meets nobody");
        let sheared = impact(&[at_rest, plates]).unwrap();
        close(sheared.speed, 3e-3 / 1e-3 * 2e-4);
        assert_eq!(sheared.cause, "shear rate times D");
        close(impact(&[at_rest, plates, "contact.substeps=4"]).unwrap().steps, 4.0 * sheared.steps);
        let resolved = format!("contact.substeps={}", sheared.substeps(1));
        let resolved = impact(&[at_rest, plates, &resolved]).unwrap();
        assert!(
            sheared.steps < sheared.needed && resolved.steps >= resolved.needed,
            "{sheared:?} {resolved:?}"
        );
        assert_eq!(impact(&[at_rest, plates, "contact.enabled=false"]), None);
        close(impact(&[]).unwrap().speed, 2.0 * setup(&[]).driven_flow().unwrap().speed / 1e-3 * 2e-4);
        let thrown = "particles.0.list=[{ position = [1e-3, 5e-4, 5e-4], velocity = [0, 0, 1e-3] }]";
        let started = setup(&[at_rest, plates, thrown]).impact().unwrap();
        assert_eq!((started.speed, started.cause), (1e-3, "the speed at the start"));
        assert_eq!(impact(&[at_rest, "driving.gravity=1e-3"]).unwrap().cause, "u*");
    }

    #[test]
    fn a_particle_settles_no_faster_than_it_can_fall() {
        let at = |options: &[&str]| {
            let setup = setup(options);
            setup.settling_speed(setup.expect_fluid(), 0)
        };
        let terminal = setup(&["driving.gravity=1e-3"]).expect_fluid().scales.schiller_naumann_velocity;
        close(at(&["driving.gravity=1e-3"]), terminal);
        close(at(&["driving.gravity=1e-3", "run.end.steps=1"]), 5e-4 * setup(&[]).time_step);
        let heavy = ["driving.gravity=10", "particles.0.density=1e8", "lattice.relaxation_time=0.5003"];
        close(at(&heavy), (2.0 * 10.0 * 1e-3 * 99999.0 / 100_000.5_f64).sqrt());
    }
}
