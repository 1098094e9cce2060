//! Velocities that a case will reach, as far as they can be told beforehand, against what the lattice can follow.
//!
//! ```text
//! settling    u* of Schiller and Naumann; at most a t, and sqrt(2 a H) where walls bear the weight,
//!             with a = (g |s - 1| + F / m_f) / (s + 1/2), the acceleration from rest against the added mass of a sphere
//! driven flow a t, or the largest integral of an `a` that varies; through bodies at rest that of [their drag](super::array); between walls at most a h^2 / (8 nu) in the middle of a slit of width h, a D^2 / (16 nu) in a pipe;
//!             turbulent (Re = u h / nu above 3000) u_tau (2.5 ln(u_tau h / (2 nu)) + 5.5) with u_tau^2 = a h / 2
//! impacts     of each kind that forces move, at its u*, the shear rate times D, prescribed speeds and the differences of those at the
//!             start; the shear rate is the difference of the velocities of walls, or twice that of the driven flow, over h;
//!             without a fluid after a fall through the box, and at the speed of walls
//! ```
//!
//! Reference: Pope (2000), Turbulent Flows, section 7.1.

use super::array::HeldBodies;
use super::placed::Totals;
use super::scales::Reference;
use super::{FluidSetup, Insertion, Setup};
use crate::contact::{ContactModel, SpherePair};
use crate::coupling::Resistance;
use crate::domain::Face;
use crate::math::{TimeFunction, Vec3};
use crate::particle::Template;
use crate::wall::{Surface, Wall};

/// Steps of the particles in which a contact is resolved.
pub(super) const STEPS_PER_CONTACT: f64 = 50.0;

/// Steps that a contact should last to be stable, where little depends on how bodies rebound: pressed together by shear (the viscosity of
/// `cases/shear_cell.toml` is the same to 3e-6 with 10 and with 52 steps), or after the longest fall.
const STABLE_STEPS: f64 = 10.0;

/// Reynolds number of the gap from which a driven flow is taken as turbulent (-).
const TURBULENT_REYNOLDS: f64 = 3000.0;

/// A flow that a body acceleration drives along periodic directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DrivenFlow {
    /// Largest velocity over the run (m/s).
    pub speed: f64,
    /// Smallest distance of walls across the flow (m); the diameter of the particles where these bound it, or nothing does.
    pub length: f64,
    /// The obstacle that keeps the flow from getting faster.
    pub bound: Bound,
}

/// Bound of a driven flow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bound {
    /// The end of the run alone.
    Run,
    /// The walls of the box.
    Walls,
    /// Bodies at rest all over the box.
    Bodies,
}

/// An impact of two particles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Impact {
    /// Template of the particles that meet, as two spheres of their volume.
    pub template: usize,
    /// Relative speed (m/s).
    pub speed: f64,
    /// The cause for which they meet.
    pub cause: &'static str,
    /// Steps of the particles that it lasts.
    pub steps: f64,
    /// Steps that it should last.
    pub needed: f64,
}

impl Impact {
    /// Sub-steps that resolve it, of a case with `given` ones.
    pub fn substeps(&self, given: u32) -> f64 {
        (f64::from(given) * self.needed / self.steps).ceil()
    }

    /// Steps that it lasts over those that it should last (-).
    pub fn resolved(&self) -> f64 {
        self.steps / self.needed
    }
}

impl Setup {
    /// The flow that the body acceleration drives, if there is one.
    pub fn driven_flow(&self) -> Option<DrivenFlow> {
        let fluid = self.fluid.as_ref()?;
        let mut flow = DrivenFlow { speed: 0.0, length: self.diameter, bound: Bound::Run };
        for axis in (0..3).filter(|&axis| self.drives(axis)) {
            let acceleration = fluid.body_acceleration.largest()[axis];
            let width = self.width_across(axis);
            let between_walls = steady_speed(acceleration, width, fluid.viscosity);
            let among_bodies = self
                .fixed_array
                .map_or(f64::INFINITY, |array| array.largest_speed(acceleration, fluid.viscosity));
            let speed = between_walls
                .min(among_bodies)
                .min(fluid.body_acceleration.largest_integral(self.end_time())[axis]);
            if speed > flow.speed {
                (flow.length, flow.bound) = match self.fixed_array {
                    Some(array) if among_bodies < between_walls => (array.diameter, Bound::Bodies),
                    _ if width.is_finite() => (width, Bound::Walls),
                    _ => (self.diameter, Bound::Run),
                };
            }
            flow.speed = libm::hypot(flow.speed, speed);
        }
        (flow.speed > 0.0).then_some(flow)
    }

    /// True if the body acceleration drives the fluid along an axis.
    pub(super) fn drives(&self, axis: usize) -> bool {
        let fluid = self.fluid.as_ref();
        self.domain.is_open(axis) && fluid.is_some_and(|fluid| fluid.body_acceleration.largest()[axis] != 0.0)
    }

    /// Rate (1/s) at which what is held, bodies or walls, stops a net flux along an axis; none if nothing is.
    pub fn resistance_rate(&self, fluid: &FluidSetup, axis: usize) -> Option<f64> {
        match self.resistance(fluid, axis) {
            Resistance::Held { rate, .. } => Some(rate),
            Resistance::None { .. } => None,
        }
    }

    /// Resistance against a net flux along an axis: bodies that are held, by the drag of an array of theirs, and walls, as a slit does, at
    /// `12 nu / h^2`.
    pub(crate) fn resistance(&self, fluid: &FluidSetup, axis: usize) -> Resistance {
        let bodies = match &self.placed {
            Some(placed) => placed.totals.held[axis],
            None => HeldBodies::of(self, axis),
        };
        let width = self.width_across(axis);
        if bodies.is_none() && width.is_infinite() {
            return Resistance::None { rate: fluid.control_rate };
        }
        let walls = 12.0 * fluid.viscosity / (width * width);
        let target = fluid.net_flux[axis].unwrap_or_default();
        let rate = bodies.map_or(0.0, |bodies| bodies.resistance(fluid.viscosity, target));
        Resistance::Held { rate: rate + walls, fraction: bodies.map_or(0.0, |bodies| bodies.fraction) }
    }

    /// Width (m) of the slit whose flow along an axis is at least as fast as that between the walls of the case.
    pub(super) fn width_across(&self, axis: usize) -> f64 {
        let (size, faces) = (self.domain.size(), self.domain.faces);
        let widths = self.walls.iter().map(|wall| {
            let face = Self::face_of(wall);
            let width = match &wall.surface {
                Surface::Plane { normal, .. } => size.dot(&normal.abs()),
                Surface::Cylinder { radius, pipe: true, .. } => 2.0_f64.sqrt() * *radius,
                // It leaves no wider a gap than the box.
                Surface::Cylinder { .. } | Surface::Mesh(_) => size[(axis + 1) % 3].min(size[(axis + 2) % 3]),
            };
            match face.map(|n| [faces[n], faces[n ^ 1]]) {
                Some([Face::FreeSlip, _]) => f64::INFINITY,
                Some([own, _]) if own.is_open() => f64::INFINITY,
                // A plane of symmetry is in the middle.
                Some([_, Face::FreeSlip]) => 2.0 * width,
                _ => width,
            }
        });
        widths.fold(f64::INFINITY, f64::min)
    }

    /// The usual impact that most needs short steps; none without contacts, or where nothing moves or meets.
    pub fn impact(&self) -> Option<Impact> {
        self.impacts().into_iter().min_by(|a, b| a.resolved().total_cmp(&b.resolved()))
    }

    /// The usual impacts of each kind of particle that forces move.
    pub fn impacts(&self) -> Vec<Impact> {
        let movable = self.movable();
        if self.contact.is_none() || movable.is_empty() {
            return Vec::new();
        }
        let prescribed = (0..self.templates.len()).map(|template| self.prescribed_speed(template));
        let sheared = if self.expected_particles() > 1 { self.shear_rate() * self.diameter } else { 0.0 };
        let of_all = [
            (prescribed.fold(0.0, f64::max), "the prescribed speed", STEPS_PER_CONTACT),
            (self.starting_speed(), "the speed at the start", STEPS_PER_CONTACT),
            (sheared, "shear rate times D", STABLE_STEPS),
            (self.dry_wall_speed(), "the speed of a wall", STEPS_PER_CONTACT),
        ];
        let of_each = movable.into_iter().flat_map(|template| {
            let falls = self.falls(template);
            let own = match &self.fluid {
                Some(fluid) => (self.terminal_speed(fluid, template), "u*", STEPS_PER_CONTACT),
                None => (self.fall_speed(template), "the speed of a fall through the box", STABLE_STEPS),
            };
            of_all.into_iter().chain(falls.then_some(own)).map(move |impact| (template, impact))
        });
        let moves = of_each.filter(|(_, (speed, ..))| *speed > 0.0);
        let impacts = moves.filter_map(|(template, (speed, cause, needed))| {
            let steps = self.spheres(template)?.duration(speed) / self.time_step * f64::from(self.substeps);
            Some(Impact { template, speed, cause, steps, needed })
        });
        impacts.collect()
    }

    /// Two particles of a template in contact, as spheres of their volume; none without contacts.
    pub fn spheres(&self, template: usize) -> Option<SpherePair> {
        let template = &self.templates[template];
        Some(spheres(self.contact.as_ref()?, template.material, template))
    }

    /// Templates of particles that gravity presses onto others, and the depth (m) of a contact under the weight of one of them minus its
    /// buoyancy, along the directions in which it is free.
    pub fn resting_depths(&self) -> Vec<(usize, f64)> {
        let depth =
            |template: usize| Some((template, self.spheres(template)?.static_depth(self.weight(template))));
        self.movable().into_iter().filter_map(depth).filter(|(_, depth)| *depth > 0.0).collect()
    }

    /// Weight (N) of a particle of a template minus its buoyancy, along the directions in which it is free.
    pub fn weight(&self, template: usize) -> f64 {
        let (kind, free) = (&self.templates[template], self.motions[template].free);
        let gravity = Vec3::from_fn(|axis, _| if free[axis] { self.gravity[axis] } else { 0.0 });
        (kind.density - self.fluid_density()).abs() * kind.shape.volume() * gravity.norm()
    }

    /// Templates, ascending, whose particles forces or torques move.
    pub fn movable(&self) -> Vec<usize> {
        let mut present: Vec<usize> = self.expected_counts().map(|(template, _)| template).collect();
        present.sort_unstable();
        present.dedup();
        present.retain(|&template| !self.motions[template].is_complete());
        present
    }

    /// True if gravity, or a force that the case applies, moves the particles of a template.
    pub(super) fn falls(&self, template: usize) -> bool {
        let pull = self.pull(template);
        (0..3).any(|axis| self.motions[template].free[axis] && pull[axis] != 0.0)
    }

    /// Acceleration (m/s^2) of a particle of a template by gravity and the force that the case applies, without a fluid.
    fn pull(&self, template: usize) -> Vec3 {
        self.gravity + self.applied[template][0] / self.templates[template].mass()
    }

    /// Bound (m/s) of the difference of the velocities of surfaces at the start, beside that of the flow, or of inserted particles.
    fn starting_speed(&self) -> f64 {
        let Totals { velocities, rim, .. } = self.totals();
        // Walls are at rest.
        let rest = (!self.walls.is_empty()).then_some([Vec3::zeros(); 2]);
        let of_particles = velocities.map(|of| of.map(Vec3::from));
        let all = rest.into_iter().chain(of_particles).reduce(|a, b| [a[0].inf(&b[0]), a[1].sup(&b[1])]);
        let (mut low, mut high) = (all.map(|[low, _]| low), all.map(|[_, high]| high));
        for Insertion { bodies, .. } in &self.insertions {
            let [mean, spread] = bodies.velocity;
            let ([slow, fast], least) = ([mean - spread, mean + spread], Vec3::zeros());
            // Some are inserted while others have come to rest.
            low = Some(low.unwrap_or(least).inf(&slow));
            high = Some(high.unwrap_or(least).sup(&fast));
        }
        low.zip(high).map_or(0.0, |(low, high)| (high - low).norm() + rim)
    }

    /// Speed (m/s) at which walls of a run without a fluid come nearer at most; with one they slide along themselves.
    fn dry_wall_speed(&self) -> f64 {
        let size = self.domain.size();
        let walls = self.walls.iter().filter(|_| self.fluid.is_none());
        walls.map(|wall| approach_speed(wall, &size)).fold(0.0, f64::max)
    }

    /// Speed (m/s) after a fall through the box, or over the whole run.
    fn fall_speed(&self, template: usize) -> f64 {
        let pull = self.pull(template);
        let drop = pull.abs().dot(&self.domain.size());
        (2.0 * drop).sqrt().min(pull.norm() * self.end_time())
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
                    let slides = |wall: &Wall| {
                        wall.motion.velocity.constant().filter(|_| wall.motion.angular_velocity.is_zero())
                    };
                    match slides(wall).zip(slides(other)) {
                        Some((one, other)) => (one - other).norm(),
                        None => wall_speed(wall, &size) + wall_speed(other, &size),
                    }
                })
                .chain(alone)
        });
        let driven =
            self.driven_flow().filter(|flow| flow.bound == Bound::Walls).map_or(0.0, |flow| 2.0 * flow.speed);
        differences.fold(driven, f64::max) / width
    }

    /// Bound (m/s) of the speed that prescribed motion gives to the surface of particles of a template.
    pub(crate) fn prescribed_speed(&self, template: usize) -> f64 {
        self.motions[template].largest_speed(self.templates[template].shape.circumradius())
    }

    /// Weight less buoyancy of a particle of a template, and the force that the case applies, over the mass of the fluid that it displaces
    /// (m/s^2): `(s - 1) g` with the ratio `s` of densities.
    fn submerged_pull(&self, fluid: &FluidSetup, template: usize) -> Vec3 {
        let Template { shape, density, .. } = &self.templates[template];
        (density / fluid.density - 1.0) * self.gravity
            + self.applied[template][0] / (fluid.density * shape.volume())
    }

    /// Terminal velocity (m/s) of one particle of a template, by Schiller and Naumann.
    fn terminal_speed(&self, fluid: &FluidSetup, template: usize) -> f64 {
        let pull = self.submerged_pull(fluid, template).norm();
        // That of a ratio of densities of 2 at this gravity.
        let diameter = self.templates[template].shape.equivalent_diameter();
        let reference = Reference { diameter, density_ratio: 2.0, gravity: pull };
        reference.scales(fluid.viscosity).schiller_naumann_velocity
    }

    /// Largest speed (m/s) that particles of a template reach as they settle.
    pub(super) fn settling_speed(&self, fluid: &FluidSetup, template: usize) -> f64 {
        let density_ratio = self.templates[template].density / fluid.density;
        let from_rest = self.submerged_pull(fluid, template) / (density_ratio + 0.5);
        // The acceleration times the way along it.
        let drop: f64 = (0..3)
            .filter(|&i| from_rest[i] != 0.0)
            .map(|i| {
                let way = if self.domain.is_periodic(i) { f64::INFINITY } else { self.domain.size()[i] };
                from_rest[i].abs() * way
            })
            .sum();
        (self.terminal_speed(fluid, template))
            .min(from_rest.norm() * self.end_time())
            .min((2.0 * drop).sqrt())
    }
}

/// Two bodies of a template in contact, as spheres of their volume and of one material.
pub(super) fn spheres(model: &ContactModel, material: usize, template: &Template) -> SpherePair {
    SpherePair::new(model, material, template.shape.equivalent_diameter(), template.mass())
}

/// Speed in the middle of a slit (m/s), laminar at any Reynolds number.
pub(super) fn laminar_speed(acceleration: f64, width: f64, viscosity: f64) -> f64 {
    acceleration * width * width / (8.0 * viscosity)
}

/// Speed in the middle of a slit (m/s).
fn steady_speed(acceleration: f64, width: f64, viscosity: f64) -> f64 {
    let laminar = laminar_speed(acceleration, width, viscosity);
    if width.is_infinite() || laminar * width / viscosity < TURBULENT_REYNOLDS {
        return laminar;
    }
    let friction = (0.5 * acceleration * width).sqrt();
    friction * (2.5 * libm::log(0.5 * friction * width / viscosity) + 5.5)
}

/// Largest speed of a wall (m/s) in a box of edges `size`.
pub(super) fn wall_speed(wall: &Wall, size: &Vec3) -> f64 {
    let [velocity, turn] = [&wall.motion.velocity, &wall.motion.angular_velocity].map(TimeFunction::largest);
    velocity.norm() + turn.norm() * arm(wall, size)
}

/// Largest speed (m/s) of a wall across itself.
fn approach_speed(wall: &Wall, size: &Vec3) -> f64 {
    // Of an oscillation mean and amplitude, of a table the fastest row.
    let fastest = |of: &TimeFunction, across: &dyn Fn(Vec3) -> f64| {
        let speeds = of.span().into_iter().map(across);
        if let TimeFunction::Table(_) = of { speeds.fold(0.0, f64::max) } else { speeds.sum() }
    };
    let (axis, is_plane) = match &wall.surface {
        Surface::Plane { normal, .. } => (*normal, true),
        Surface::Cylinder { axis, .. } => (*axis, false),
        Surface::Mesh(_) => return wall_speed(wall, size),
    };
    let across = |v: Vec3| if is_plane { v.dot(&axis).abs() } else { v.cross(&axis).norm() };
    fastest(&wall.motion.velocity, &across)
        + fastest(&wall.motion.angular_velocity, &|w| w.cross(&axis).norm()) * arm(wall, size)
}

/// Length (m) by which a wall that turns moves: of a plane half the diagonal of the box along it from its pivot, of a mesh the distance of
/// its furthest vertex.
fn arm(wall: &Wall, size: &Vec3) -> f64 {
    match &wall.surface {
        Surface::Mesh(placed) => {
            let pivot = placed.to_own(&wall.motion.pivot);
            placed.mesh.vertices().iter().map(|vertex| (vertex - pivot).norm()).fold(0.0, f64::max)
        }
        Surface::Plane { normal, .. } => {
            let across = size.dot(&normal.abs());
            0.5 * (size.norm_squared() - across * across).max(0.0).sqrt()
        }
        Surface::Cylinder { radius, .. } => *radius,
    }
}

#[cfg(test)]
mod tests {
    use crate::case::{Bound, Setup, from_text};
    use crate::coupling::Resistance;

    const TEXT: &str = "domain = { size = [2e-3, 1e-3, 1e-3], periodic = [true, true, false] }\n\
                        fluid = { density = 1000, viscosity = 1e-6 }\n\
                        lattice = { cells_per_diameter = 4, relaxation_time = 0.8 }\n\
                        driving = { gravity = 0, body_acceleration = [4e-2, 0, 3.0] }\n\
                        run.end.time = 10\n\
                        [[particles]]\n\
                        shape.sphere.diameter = 2e-4\n\
                        density = 500.0\n\
                        list = [[1e-3, 5e-4, 5e-4]]\n";

    fn setup(options: &[&str]) -> Setup {
        let options: Vec<String> = options.iter().map(ToString::to_string).collect();
        from_text(TEXT, "slit", &options).unwrap_or_else(|e| panic!("{e}"))
    }

    fn close(a: f64, b: f64) {
        assert!((a / b - 1.0).abs() < 1e-9, "{a} is not {b}");
    }

    #[test]
    fn a_driven_flow_is_that_of_its_slit_or_pipe_and_no_faster_than_free_acceleration() {
        let flow = |options: &[&str]| setup(options).driven_flow().unwrap();
        let slit = flow(&[]);
        close(slit.speed, 4e-2 * 1e-6 / 8e-6);
        assert!(slit.bound == Bound::Walls && (slit.length - 1e-3).abs() < 1e-12);
        close(flow(&["run.end.time=0.01"]).speed, 4e-4);
        let open = flow(&["domain.periodic=[true, true, true]", "driving.body_acceleration=[0, 0, 1e-3]"]);
        close(open.speed, 1e-2);
        assert!(open.bound == Bound::Run && (open.length - 2e-4).abs() < 1e-12);
        let pipe =
            "walls=[{ name = \"p\", pipe = { point = [0, 5e-4, 5e-4], axis = [1, 0, 0], diameter = 8e-4 } }]";
        close(flow(&[pipe]).speed, 4e-2 * 64e-8 / 16e-6);
        // The friction Reynolds number of the half width is 180.
        let turbulent = flow(&["driving.body_acceleration=[259.2, 0, 0]", "lattice.relaxation_time=0.5003"]);
        close(turbulent.speed, 0.36 * (2.5 * libm::log(180.0) + 5.5));
        assert!(setup(&["driving.body_acceleration=[0, 0, 9]"]).driven_flow().is_none());
    }

    #[test]
    fn a_flow_that_an_oscillation_drives_is_bounded_by_what_a_half_period_gives() {
        let open = "domain.periodic=[true, true, true]";
        let shaken = |frequency: &str| {
            let drive = format!(
                "driving.body_acceleration={{ oscillation = {{ amplitude = [4e-2, 0, 0], frequency = {frequency}, phase = 90 }} }}"
            );
            setup(&[open, &drive]).driven_flow().unwrap().speed
        };
        close(shaken("2"), 4e-2 / (4.0 * std::f64::consts::PI));
        close(shaken("20"), 4e-2 / (40.0 * std::f64::consts::PI));
        let pulse = "driving.body_acceleration={ table = [[0, 0, 0, 0], [0.1, 4e-2, 0, 0], [0.2, 0, 0, 0]] }";
        close(setup(&[open, pulse]).driven_flow().unwrap().speed, 0.1 * 4e-2);
    }

    #[test]
    fn what_is_held_resists_the_net_flux_and_bodies_that_the_fluid_carries_do_not() {
        let along = |options: &[&str], axis: usize| {
            let setup = setup(&[&["driving.body_acceleration=[0, 0, 0]"], options].concat());
            setup.resistance(setup.expect_fluid(), axis)
        };
        let open = "domain.periodic=[true, true, true]";
        assert!(matches!(along(&[open], 0), Resistance::None { .. }));
        let Resistance::Held { rate, fraction } = along(&[], 0) else { panic!() };
        close(rate, 12.0 * 1e-6 / 1e-6);
        assert!(fraction < 1e-12);
        let fixed = "particles.0={ shape.sphere.diameter = 2e-4, density = 500, volume_fraction = 0.2, motion = \"fixed\" }";
        let Resistance::Held { rate, fraction } = along(&[open, fixed], 2) else { panic!() };
        assert!((fraction - 0.2).abs() < 2e-3);
        let drag = rate * 4e-8 / (18.0 * fraction * 1e-6);
        assert!((3.5..5.5).contains(&drag), "{drag}");
        let sideways = fixed.replace("\"fixed\"", "{ free = [\"x\"] }");
        assert!(matches!(along(&[open, &sideways], 0), Resistance::None { .. }));
        assert!(matches!(along(&[open, &sideways], 1), Resistance::Held { .. }));
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
    fn a_flow_through_fixed_bodies_is_bounded_by_their_drag_and_not_refused_for_what_it_would_be_without() {
        // Without drag 0.01 m/s, 0.5 cells per step.
        let free = ["domain.periodic=[true, true, true]", "driving.body_acceleration=[0, 0, 1e-3]"];
        let random = "particles.0={ shape.sphere.diameter = 2e-4, density = 500, volume_fraction = 0.2, motion = \"fixed\" }";
        let bounded = setup(&[&free[..], &[random]].concat());
        let flow = bounded.driven_flow().unwrap();
        assert!(flow.bound == Bound::Bodies && flow.speed < 3e-5, "{flow:?}");
        let options = [&free[..], &[random, "driving.body_acceleration=[0, 0, 0.1]"]].concat();
        let warnings = setup(&options).provenance.warnings;
        assert!(!warnings.iter().any(|warning| warning.contains("cells per time step")), "{warnings:?}");
        let text = TEXT.replace("list = [[1e-3, 5e-4, 5e-4]]", "count = 20");
        let options =
            ["domain.periodic=[true, true, true]", "driving.body_acceleration=[0, 0, 0.1]"].map(String::from);
        let refused = from_text(&text, "free", &options).unwrap_err().to_string();
        assert!(refused.contains("cells per time step"), "{refused}");
    }

    #[test]
    fn what_no_force_moves_has_no_contacts_and_a_body_that_moves_meets_what_is_fixed() {
        let fixed = "particles.0.motion=fixed";
        let pair = "particles.0.list=[[1e-3, 5e-4, 5e-4], [5e-4, 5e-4, 5e-4]]";
        assert_eq!(setup(&[fixed, pair, "driving.gravity=9.81"]).impact(), None);
        assert!(setup(&[fixed, pair, "driving.gravity=9.81"]).resting_depths().is_empty());
        let sideways = "particles.0.motion={ free = [\"x\"] }";
        let carried = setup(&[sideways, pair, "driving.gravity=1e-3", "driving.body_acceleration=[0, 0, 0]"]);
        assert_eq!((carried.impact(), carried.resting_depths()), (None, Vec::new()), "gravity is along z");
    }

    #[test]
    fn the_smallest_particles_have_the_shortest_contacts() {
        let sizes = "particles=[{ shape.sphere.diameter = 2e-4, density = 2000, list = [[1e-3, 5e-4, 5e-4]] }, \
                     { shape.sphere.diameter = 1e-4, density = 2000, list = [[5e-4, 5e-4, 5e-4]] }]";
        let thrown = sizes.replace(
            "list = [[1e-3, 5e-4, 5e-4]]",
            "list = [{ position = [1e-3, 5e-4, 5e-4], velocity = [1e-3, 0, 0] }]",
        );
        let impact =
            setup(&[&thrown, "driving.gravity=0", "driving.body_acceleration=[0, 0, 0]"]).impact().unwrap();
        assert_eq!((impact.template, impact.cause), (1, "the speed at the start"));
    }

    #[test]
    fn without_a_fluid_the_speeds_at_the_start_of_walls_and_of_a_fall_count() {
        let dry = |options: &[&str]| {
            let text = "domain = { size = [2e-3, 1e-3, 1e-3], periodic = [true, true, false] }\n\
                        dry.time_step = 1e-6\nrun.end.time = 1\ndriving.gravity = 0\n\
                        [[particles]]\nshape.sphere.diameter = 2e-4\ndensity = 500.0\n\
                        list = [[1e-3, 5e-4, 5e-4]]\n";
            let options: Vec<String> = options.iter().map(ToString::to_string).collect();
            from_text(text, "dry", &options).unwrap_or_else(|e| panic!("{e}")).impact()
        };
        assert_eq!(dry(&[]), None);
        let thrown = "particles.0.list=[{ position = [1e-3, 5e-4, 5e-4], velocity = [0, 0, 2] }]";
        let started = dry(&[thrown]).unwrap();
        assert_eq!((started.speed, started.cause), (2.0, "the speed at the start"));
        let opposite = "particles.0.list=[{ position = [1e-3, 5e-4, 5e-4], velocity = [0, 0, 2] }, \
                        { position = [1e-3, 5e-4, 8e-4], velocity = [0, 0, -2] }]";
        close(dry(&[opposite]).unwrap().speed, 4.0);
        let piston = dry(&["domain.faces={ \"z+\" = { velocity = [5, 0, -3] } }"]).unwrap();
        assert_eq!((piston.speed, piston.cause), (3.0, "the speed of a wall"));
        let fall = dry(&["driving.gravity=10"]).unwrap();
        close(fall.speed, (2.0 * 10.0 * 1e-3_f64).sqrt());
        assert_eq!(fall.cause, "the speed of a fall through the box");
    }

    #[test]
    fn a_force_on_a_particle_counts_as_its_weight_does() {
        let at = |options: &[&str]| {
            let setup = setup(options);
            (setup.settling_speed(setup.expect_fluid(), 0), setup.submerged_weight())
        };
        let (speed, weight) = at(&["driving.gravity=1e-3"]);
        let force = format!("particles.0.force=[0, 0, {:e}]", weight.z);
        let (by_force, applied) = at(&["driving.gravity=0", &force]);
        close(by_force, speed);
        close(applied.z, weight.z);
        assert!(setup(&["driving.gravity=0", &force]).falls(0) && !setup(&[]).falls(0));
        let held = at(&["driving.gravity=0", &force, "particles.0.motion={ free = [\"z\"] }"]);
        close(held.1.z, weight.z);
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
