//! Kinds of particles for the builder.

use super::Keys;
use crate::math::{Quat, Vec3};
use crate::shape::Shape;
use serde::Serialize;
use std::sync::Arc;
use toml::Value;

/// Particles of one shape and density, for [`Builder::particles`](super::Builder::particles): listed one by one
/// ([`at`](Self::at), [`moving`](Self::moving), [`posed`](Self::posed)) or at random ([`count`](Self::count),
/// [`volume_fraction`](Self::volume_fraction)). Lengths are in m, densities in kg/m^3.
///
/// ```
/// use turbid::{Builder, Particles};
/// let rods = Particles::cylinders(4e-4, 2e-3, 2500.0).volume_fraction(0.02).set("seed", 7);
/// let setup = Builder::new([6e-3; 3]).fluid(1000.0, 1e-5).lattice(8.0, 0.6).particles(rods).setup()?;
/// assert!((setup.volume_fraction - 0.02).abs() < 2e-3);
/// # Ok::<(), turbid::Error>(())
/// ```
#[derive(Clone, Debug)]
#[must_use]
pub struct Particles {
    keys: Keys,
    list: Vec<Value>,
    own: Option<Arc<dyn Shape>>,
}

impl Particles {
    fn new(density: f64) -> Self {
        Self { keys: Keys::default(), list: Vec::new(), own: None }.set("density", density)
    }

    /// Spheres of this diameter.
    pub fn spheres(diameter: f64, density: f64) -> Self {
        Self::new(density).set("shape.sphere.diameter", diameter)
    }

    /// Boxes with edges along x, y and z.
    pub fn cuboids(edges: impl Into<[f64; 3]>, density: f64) -> Self {
        Self::new(density).set("shape.cuboid.edges", edges.into())
    }

    /// Ellipsoids with axes along x, y and z, from end to end.
    pub fn ellipsoids(axes: impl Into<[f64; 3]>, density: f64) -> Self {
        Self::new(density).set("shape.ellipsoid.axes", axes.into())
    }

    /// Circular cylinders along z, of this diameter and length.
    pub fn cylinders(diameter: f64, length: f64, density: f64) -> Self {
        Self::new(density).set("shape.cylinder.diameter", diameter).set("shape.cylinder.length", length)
    }

    /// Cylinders along z with half spheres as ends, of this diameter and length from tip to tip.
    pub fn capsules(diameter: f64, length: f64, density: f64) -> Self {
        Self::new(density).set("shape.capsule.diameter", diameter).set("shape.capsule.length", length)
    }

    /// Superellipsoids with axes along x, y and z, from end to end, and [exponents](crate::case::file::ShapeSection::Superellipsoid).
    pub fn superellipsoids(axes: impl Into<[f64; 3]>, exponents: [f64; 2], density: f64) -> Self {
        let sized = Self::new(density).set("shape.superellipsoid.axes", axes.into());
        sized.set("shape.superellipsoid.exponents", exponents)
    }

    /// Convex hulls of these points.
    pub fn polyhedra(points: &[[f64; 3]], density: f64) -> Self {
        Self::new(density).set("shape.polyhedron.vertices", points).set("shape.polyhedron.hull", true)
    }

    /// Convex bodies from an STL or OBJ file in metres.
    pub fn mesh(file: &str, density: f64) -> Self {
        Self::new(density).set("shape.mesh.file", file)
    }

    /// Bodies of a shape of the caller's own. Contacts are sampled.
    ///
    /// ```
    /// use turbid::{Builder, Particles, shape::Sphere};
    /// let own = std::sync::Arc::new(Sphere { radius: 5e-4 });
    /// let bodies = Particles::of_shape(own, 2500.0).at([2e-3; 3]);
    /// let setup = Builder::new([4e-3; 3]).fluid(1000.0, 1e-5).lattice(4.0, 0.6).particles(bodies).setup()?;
    /// assert_eq!(setup.templates[0].shape.as_sphere(), Some(5e-4));
    /// # Ok::<(), turbid::Error>(())
    /// ```
    pub fn of_shape(shape: Arc<dyn Shape>, density: f64) -> Self {
        Self { own: Some(shape), ..Self::new(density) }
    }

    /// Adds one at rest, with its centre of mass here (m) and the axes of the shape along those of the box.
    pub fn at(mut self, position: impl Into<[f64; 3]>) -> Self {
        self.list.push(position.into().to_vec().into());
        self
    }

    /// Adds one with its centre of mass here (m) and this velocity (m/s).
    pub fn moving(self, position: impl Into<[f64; 3]>, velocity: impl Into<[f64; 3]>) -> Self {
        let velocity = Vec3::from(velocity.into());
        self.posed(position, &Quat::identity(), velocity, Vec3::zeros())
    }

    /// Adds one with its centre of mass here (m), turned from the axes of the box, with a velocity (m/s) and an angular velocity
    /// (1/s).
    ///
    /// ```
    /// use turbid::{Builder, Particles, math::{Quat, Vec3}};
    /// let turned = Quat::from_euler_angles(0.0, 0.5, 0.0);
    /// let rod = Particles::capsules(5e-4, 1e-3, 2500.0).posed([2e-3; 3], &turned, Vec3::zeros(), Vec3::z());
    /// let setup = Builder::new([4e-3; 3]).fluid(1000.0, 1e-5).lattice(8.0, 0.6).particles(rod).setup()?;
    /// assert!(setup.particles[0].orientation().angle_to(&turned) < 1e-12);
    /// # Ok::<(), turbid::Error>(())
    /// ```
    pub fn posed(
        mut self,
        position: impl Into<[f64; 3]>,
        orientation: &Quat,
        velocity: Vec3,
        angular_velocity: Vec3,
    ) -> Self {
        let mut entry = Keys::default();
        if *orientation != Quat::identity() {
            entry.put("orientation.quaternion", <[f64; 4]>::from(orientation.coords));
        }
        entry.put("position", position.into());
        entry.put("velocity", <[f64; 3]>::from(velocity));
        entry.put("angular_velocity", <[f64; 3]>::from(angular_velocity));
        self.list.push(entry.table.into());
        self
    }

    /// Keeps all where they are, whatever acts on them: `motion = "fixed"`.
    ///
    /// ```
    /// use turbid::{Builder, Particles, math::Vec3};
    /// let sphere = Particles::spheres(1e-3, 2500.0).at([2e-3; 3]).fixed();
    /// let mut simulation = Builder::new([4e-3; 3]).fluid(1000.0, 1e-5).lattice(4.0, 0.6).particles(sphere).build()?;
    /// simulation.advance(8)?;
    /// assert_eq!(simulation.particles()[0].position, [2e-3; 3]);
    /// let buoyancy = 1000.0 * 9.80665 * std::f64::consts::PI / 6.0 * 1e-9;
    /// assert!(simulation.loads().all(|(_, load)| (load.force.z / buoyancy - 1.0).abs() < 1e-9));
    /// # Ok::<(), turbid::Error>(())
    /// ```
    pub fn fixed(self) -> Self {
        self.set("motion", "fixed")
    }

    /// Prescribes constant velocities (m/s) and angular velocities (1/s), whatever acts on them. [`set`](Self::set) of `"motion"`
    /// takes [all other forms](crate::case::file::MotionSection).
    ///
    /// ```
    /// use turbid::{Builder, Particles};
    /// let sphere = Particles::spheres(1e-3, 2500.0).at([2e-3; 3]).prescribed([0.0, 0.0, 1e-3], [0.0; 3]);
    /// let mut simulation = Builder::new([4e-3; 3]).dry(1e-4).particles(sphere).build()?;
    /// simulation.advance(10)?;
    /// assert!((simulation.particles()[0].position[2] - 2.001e-3).abs() < 1e-15);
    /// # Ok::<(), turbid::Error>(())
    /// ```
    pub fn prescribed(self, velocity: impl Into<[f64; 3]>, angular_velocity: impl Into<[f64; 3]>) -> Self {
        self.set("motion.velocity", velocity.into()).set("motion.angular_velocity", angular_velocity.into())
    }

    /// As many at random positions, with random orientations.
    pub fn count(self, count: u64) -> Self {
        self.set("count", count)
    }

    /// As many at random positions as take up this part of the box (-), with random orientations.
    pub fn volume_fraction(self, fraction: f64) -> Self {
        self.set("volume_fraction", fraction)
    }

    /// Any other key of a section `[[particles]]`: `"seed"`, `"minimum_gap"`, `"sizes"`, `"material"`, `"file"`, `"overlaps"`,
    /// `"motion"`.
    pub fn set(mut self, key: &str, value: impl Serialize) -> Self {
        self.keys.put(key, value);
        self
    }

    /// The keys of the section; a shape of the caller's own goes to `shapes` under a name.
    pub(super) fn into_keys(mut self, shapes: &mut Vec<(String, Arc<dyn Shape>)>) -> Keys {
        if let Some(shape) = self.own {
            let name = format!("own shape {} ({})", shapes.len(), shape.kind());
            self.keys.put("shape.mesh.file", &name);
            shapes.push((name, shape));
        }
        if !self.list.is_empty() {
            self.keys.put("list", &self.list);
        }
        self.keys
    }
}
