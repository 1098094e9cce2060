//! A case without a file: what a program says in SI units becomes the text of a case, and that a [`Setup`] with all checks.

mod bodies;
mod walls;

use crate::case::file::{Coupling, SolidOperator};
use crate::case::{self, Setup};
use crate::coupling::ForceBalance;
use crate::error::{Error, Result};
use crate::fluid::Precision;
use crate::shape::Shape;
use crate::simulation::Simulation;
pub use bodies::Particles;
use serde::Serialize;
use std::path::Path;
use std::sync::Arc;
use toml::{Table, Value};
pub use walls::Wall;

/// Name of the case, for messages and for the folder of its output.
const NAME: &str = "builder";

/// Builds a [`Setup`] or a [`Simulation`] step by step. Lengths are in m, masses in kg, times in s.
///
/// Every method sets the key of the [case file](crate::case::file) that it names, with the same defaults, limits and messages:
/// an [`Error::Case`] has that `key`, the value and a remedy.
///
/// ```
/// use turbid::{Builder, Error, Particles};
/// let glass = Particles::spheres(1e-3, 2500.0).count(5);
/// let builder = Builder::new([4e-3, 4e-3, 8e-3]).fluid(1000.0, 1e-5).particles(glass);
/// let setup = builder.clone().lattice(4.0, 0.6).setup()?;
/// assert_eq!((setup.domain.cells, setup.particles.len()), ([16, 16, 32], 5));
///
/// let Err(Error::Case { key, what, .. }) = builder.lattice(4.0, 0.4).setup() else { panic!() };
/// assert_eq!(key, "lattice.relaxation_time");
/// assert_eq!(what, "`lattice.relaxation_time` is 0.4, but must be a finite number above 0.5");
/// # Ok::<(), Error>(())
/// ```
#[derive(Clone, Debug)]
#[must_use]
pub struct Builder {
    case: Keys,
    shapes: Vec<(String, Arc<dyn Shape>)>,
}

impl Builder {
    /// A periodic box with these edges (m): `domain.size`. Without [`end`](Self::end) a run of it is one step.
    pub fn new(size: impl Into<[f64; 3]>) -> Self {
        Self { case: Keys::default(), shapes: Vec::new() }.set("domain.size", size.into())
    }

    /// The smallest case: a sphere of 1 mm settles in a periodic box of 16 x 16 x 16 cells. For first tries.
    pub fn example() -> Self {
        let sphere = Particles::spheres(1e-3, 2500.0).at([2e-3; 3]);
        Self::new([4e-3; 3]).fluid(1000.0, 1e-5).lattice(4.0, 0.6).particles(sphere)
    }

    /// Periodic directions: `domain.periodic`. The others are closed, by walls at rest where nothing else is set.
    pub fn periodic(self, periodic: [bool; 3]) -> Self {
        self.set("domain.periodic", periodic)
    }

    /// Velocity (m/s) of a closed face, along itself: `domain.faces`. Faces are `"x-"`, `"x+"` to `"z+"`.
    ///
    /// ```
    /// let lid = turbid::Builder::example().periodic([true, true, false]);
    /// let setup = lid.face_velocity("z+", [1e-2, 0.0, 0.0]).setup()?;
    /// assert_eq!((setup.walls.len(), setup.walls[1].motion.velocity.at(0.0).x), (2, 1e-2));
    /// # Ok::<(), turbid::Error>(())
    /// ```
    pub fn face_velocity(self, face: &str, velocity: impl Into<[f64; 3]>) -> Self {
        self.set(&format!("domain.faces.{face}.velocity"), velocity.into())
    }

    /// A fluid of this density (kg/m^3) and kinematic viscosity (m^2/s): `fluid.density`, `fluid.viscosity`.
    pub fn fluid(self, density: f64, viscosity: f64) -> Self {
        self.set("fluid.density", density).set("fluid.viscosity", viscosity)
    }

    /// Cells per diameter of the first kind of particle and relaxation time (time steps): `lattice.cells_per_diameter`,
    /// `lattice.relaxation_time`. They decide cell size and time step.
    pub fn lattice(self, cells_per_diameter: f64, relaxation_time: f64) -> Self {
        self.set("lattice.cells_per_diameter", cells_per_diameter)
            .set("lattice.relaxation_time", relaxation_time)
    }

    /// No fluid: particles, contacts and walls alone, with this time step (s): `dry.time_step`.
    ///
    /// ```
    /// use turbid::{Builder, Particles};
    /// let ball = Particles::spheres(1e-3, 2500.0).at([5e-3; 3]);
    /// let mut simulation = Builder::new([1e-2; 3]).dry(1e-5).particles(ball).build()?;
    /// simulation.run_until(1e-2)?;
    /// assert!((simulation.particles()[0].velocity().z + 9.80665e-2).abs() < 1e-9);
    /// # Ok::<(), turbid::Error>(())
    /// ```
    pub fn dry(self, time_step: f64) -> Self {
        self.set("dry.time_step", time_step)
    }

    /// Storage of the fluid, two, four or eight bytes per number: `fluid.precision`.
    ///
    /// ```
    /// use turbid::fluid::Precision;
    /// let setup = turbid::Builder::example().precision(Precision::F64).setup()?;
    /// assert_eq!(setup.plan.precision, Precision::F64);
    /// # Ok::<(), turbid::Error>(())
    /// ```
    pub fn precision(self, precision: Precision) -> Self {
        self.set("fluid.precision", precision)
    }

    /// Coupling of particles and fluid: `lattice.coupling`.
    ///
    /// ```
    /// use turbid::case::file::Coupling;
    /// let setup = turbid::Builder::example().coupling(Coupling::Homogenised).setup()?;
    /// assert_eq!(setup.expect_fluid().coupling.name(), "homogenised");
    /// # Ok::<(), turbid::Error>(())
    /// ```
    pub fn coupling(self, coupling: Coupling) -> Self {
        self.set("lattice.coupling", coupling)
    }

    /// Operator of partially saturated cells: `lattice.solid_operator`.
    pub fn solid_operator(self, operator: SolidOperator) -> Self {
        self.set("lattice.solid_operator", operator)
    }

    /// Adds a kind of particles: `particles`. The diameter of the first kind is the reference length.
    pub fn particles(mut self, particles: Particles) -> Self {
        let kind = particles.into_keys(&mut self.shapes);
        self.case.push("particles", kind);
        self
    }

    /// Adds a wall: `walls`.
    pub fn wall(mut self, wall: Wall) -> Self {
        self.case.push("walls", wall.keys);
        self
    }

    /// Young's modulus (Pa) and Poisson's ratio (-) of all bodies: `contact.youngs_modulus`, `contact.poisson_ratio`.
    pub fn elasticity(self, youngs_modulus: f64, poisson_ratio: f64) -> Self {
        self.set("contact.youngs_modulus", youngs_modulus).set("contact.poisson_ratio", poisson_ratio)
    }

    /// Coefficient of restitution (-): `contact.restitution`.
    pub fn restitution(self, restitution: f64) -> Self {
        self.set("contact.restitution", restitution)
    }

    /// Coefficients of static and kinetic friction (-): `contact.friction_static`, `contact.friction_kinetic`.
    pub fn friction(self, statics: f64, kinetic: f64) -> Self {
        self.set("contact.friction_static", statics).set("contact.friction_kinetic", kinetic)
    }

    /// Contacts between particles and with walls: `contact.enabled`, true by default.
    pub fn contacts(self, enabled: bool) -> Self {
        self.set("contact.enabled", enabled)
    }

    /// Gravity (m/s^2): `driving.gravity`, 9.80665 along -z by default.
    pub fn gravity(self, gravity: impl Into<[f64; 3]>) -> Self {
        self.set("driving.gravity", gravity.into())
    }

    /// Uniform acceleration of the fluid besides all else (m/s^2): `driving.body_acceleration`.
    pub fn body_acceleration(self, acceleration: impl Into<[f64; 3]>) -> Self {
        self.set("driving.body_acceleration", acceleration.into())
    }

    /// Region in which the force acts that balances the submerged weight in a periodic box: `driving.force_balance`.
    pub fn force_balance(self, balance: ForceBalance) -> Self {
        self.set("driving.force_balance", balance)
    }

    /// Length of a run (s): `run.end`. For [`simulation::run`](crate::simulation::run()); a [`Simulation`] runs as long as it is
    /// stepped.
    pub fn end(self, time: f64) -> Self {
        let end: Table = [("time".to_string(), Value::from(time))].into_iter().collect();
        self.set("run.end", end)
    }

    /// Ranks that are threads, for [`Simulation::on_ranks`] and [`simulation::run`](crate::simulation::run()): `run.threads`. 0,
    /// one per core, by default.
    pub fn threads(self, threads: usize) -> Self {
        self.set("run.threads", threads)
    }

    /// Directory for the files of [`simulation::run`](crate::simulation::run()): `output.directory`.
    pub fn output(self, directory: impl AsRef<Path>) -> Self {
        let directory = directory.as_ref().to_string_lossy().into_owned();
        self.set("output.directory", directory)
    }

    /// Any other key of the case file, by its path: numbers, texts, lists, and types of the case file.
    ///
    /// ```
    /// use turbid::{Builder, Error};
    /// let setup = Builder::example().set("contact.substeps", 4).setup()?;
    /// assert_eq!(setup.substeps, 4);
    ///
    /// let Err(Error::Case { key, remedy, .. }) = Builder::example().set("lattice.tau", 0.6).setup() else { panic!() };
    /// assert_eq!(key, "lattice.tau");
    /// assert!(remedy.starts_with("write relaxation_time"));
    /// # Ok::<(), Error>(())
    /// ```
    pub fn set(mut self, key: &str, value: impl Serialize) -> Self {
        self.case.put(key, value);
        self
    }

    /// The case as the text of a case file; a [shape of its own](Particles::of_shape) stands in it by name only.
    ///
    /// ```
    /// let text = turbid::Builder::example().to_toml();
    /// let setup = turbid::case::from_text(&text, "example", &[])?;
    /// assert_eq!(setup.particles.len(), 1);
    /// # Ok::<(), turbid::Error>(())
    /// ```
    pub fn to_toml(&self) -> String {
        let mut case = self.case.clone();
        if case.table.get("run").is_none_or(|run| run.get("end").is_none()) {
            case.put("run.end.steps", 1);
        }
        toml::to_string(&case.table).expect("plain values have a text")
    }

    /// The case resolved to numbers, all of them checked.
    ///
    /// # Errors
    /// [`Error::Case`] with the key, the value and a remedy.
    pub fn setup(&self) -> Result<Setup> {
        if let Some((key, why)) = self.case.refused.clone() {
            let what = format!("`{key}` has no value that a case can have: {why}");
            return Err(Error::Case { key, text: what.clone(), what, remedy: String::new() });
        }
        case::with_shapes(&self.to_toml(), NAME, &[], &self.shapes)
    }

    /// The whole case on one rank, at rest; see [`Simulation`] for all that comes after.
    ///
    /// # Errors
    /// As [`setup`](Self::setup) and [`Simulation::solo`].
    pub fn build(&self) -> Result<Simulation> {
        Simulation::solo(&self.setup()?)
    }
}

/// Values by their keys, and the first value that has no form in a case.
#[derive(Clone, Debug, Default)]
struct Keys {
    table: Table,
    refused: Option<(String, String)>,
}

impl Keys {
    /// Sets the value of a key by its path, `"lattice.relaxation_time"`.
    fn put(&mut self, path: &str, value: impl Serialize) {
        match Value::try_from(value) {
            Ok(value) => *self.slot(path) = value,
            Err(error) => {
                self.refused.get_or_insert((path.to_string(), error.to_string()));
            }
        }
    }

    /// Adds a section to a list of sections.
    fn push(&mut self, list: &str, section: Self) {
        let sections = self.slot(list);
        let mut all = sections.as_array().cloned().unwrap_or_default();
        let index = all.len();
        all.push(section.table.into());
        *sections = all.into();
        if let Some((key, why)) = section.refused {
            self.refused.get_or_insert((format!("{list}.{index}.{key}"), why));
        }
    }

    /// The value at a path, which tables lead to.
    fn slot(&mut self, path: &str) -> &mut Value {
        let (outer, last) = path.rsplit_once('.').unwrap_or(("", path));
        let mut table = &mut self.table;
        for key in outer.split('.').filter(|key| !key.is_empty()) {
            let inner = table.entry(key).or_insert_with(|| Table::new().into());
            if !inner.is_table() {
                *inner = Table::new().into();
            }
            table = inner.as_table_mut().expect("made one above");
        }
        table.entry(last).or_insert(Value::Boolean(false))
    }
}

#[cfg(test)]
mod tests;
