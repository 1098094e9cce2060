//! A shape of one's own: a tablet, which is a disc grown by a rounded rim, turns its broad side to the flow as it settles.
//!
//! `cargo run --release --example own_shape` prints
//!
//! ```text
//! time (s)  velocity (mm/s)  angle to the vertical (degrees)
//!     0.02           -15.60                             44.6
//!     0.04           -21.37                             42.3
//!     0.06           -24.15                             37.9
//!     0.08           -25.23                             31.9
//!     0.10           -25.45                             24.8
//!     0.12           -25.46                             17.7
//! ```

use std::f64::consts::PI;
use std::sync::Arc;
use turbid::math::{Quat, Vec3};
use turbid::shape::Shape;
use turbid::{Builder, Particles, Result};

/// All points within `rim` (m) of a flat disc of the radius `disc` (m) across z.
#[derive(Debug)]
struct Tablet {
    disc: f64,
    rim: f64,
    volume: f64,
    inertia_per_mass: Vec3,
}

impl Tablet {
    /// Volume and moments of inertia are added up over thin slices across z.
    fn new(disc: f64, rim: f64) -> Self {
        const SLICES: u32 = 10_000;
        let (mut volume, mut across, mut along) = (0.0, 0.0, 0.0);
        let thickness = 2.0 * rim / f64::from(SLICES);
        for slice in 0..SLICES {
            let z = (f64::from(slice) + 0.5) * thickness - rim;
            let radius = disc + (rim * rim - z * z).sqrt();
            let part = PI * radius * radius * thickness;
            volume += part;
            along += part * 0.5 * radius * radius;
            across += part * (0.25 * radius * radius + z * z);
        }
        Self { disc, rim, volume, inertia_per_mass: Vec3::new(across, across, along) / volume }
    }

    /// From the nearest point of the disc.
    fn offset_of_disc(&self, point: Vec3) -> Vec3 {
        let flat = Vec3::new(point.x, point.y, 0.0);
        let radius = flat.norm();
        point - flat * if radius > self.disc { self.disc / radius } else { 1.0 }
    }
}

impl Shape for Tablet {
    fn kind(&self) -> &'static str {
        "tablet"
    }

    fn volume(&self) -> f64 {
        self.volume
    }

    fn inertia_per_mass(&self) -> Vec3 {
        self.inertia_per_mass
    }

    fn circumradius(&self) -> f64 {
        self.disc + self.rim
    }

    fn thickness(&self) -> f64 {
        2.0 * self.rim
    }

    fn signed_distance(&self, point: Vec3) -> f64 {
        self.offset_of_disc(point).norm() - self.rim
    }

    fn gradient(&self, point: Vec3) -> Vec3 {
        self.offset_of_disc(point).try_normalize(0.0).unwrap_or_else(Vec3::z)
    }

    fn support(&self, direction: Vec3) -> Vec3 {
        let flat = Vec3::new(direction.x, direction.y, 0.0);
        let edge = flat.try_normalize(0.0).unwrap_or_else(Vec3::zeros);
        edge * self.disc + direction.normalize() * self.rim
    }
}

/// Returns the angle between the axis of the tablet and the vertical at the end (degrees).
pub(crate) fn run() -> Result<f64> {
    let tilted = Quat::from_euler_angles(0.0, 0.25 * PI, 0.0);
    let tablet = Particles::of_shape(Arc::new(Tablet::new(6e-4, 2e-4)), 1500.0);
    let still = Vec3::zeros();
    let mut simulation = Builder::new([5e-3; 3])
        .fluid(1000.0, 5e-6)
        .lattice(8.0, 0.6)
        .particles(tablet.posed([2.5e-3; 3], &tilted, still, still))
        .build()?;
    println!("time (s)  velocity (mm/s)  angle to the vertical (degrees)");
    let mut angle = 0.0;
    for n in 1..=6 {
        simulation.run_until(0.02 * f64::from(n))?;
        let tablet = &simulation.particles()[0];
        let axis = tablet.orientation() * Vec3::z();
        angle = axis.z.abs().min(1.0).acos().to_degrees();
        let velocity = 1e3 * tablet.velocity().z;
        println!("{:8.2}  {velocity:15.2}  {angle:31.1}", simulation.time());
    }
    Ok(angle)
}

fn main() -> Result<()> {
    run().map(|_| ())
}
