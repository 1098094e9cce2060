//! Drag on one fixed body: a sphere in a periodic box is a simple-cubic array, whose drag Zick and Homsy (1982) give.
//!
//! `cargo run --release --example fixed_body_drag` prints
//!
//! ```text
//! time (s)  force on the sphere (N)  drag factor
//!    0.075                2.2227e-8       3.8650
//!    0.150                2.7301e-8       3.0343
//!    0.225                2.8710e-8       2.8635
//!    0.300                2.9100e-8       2.8195
//! Zick and Homsy: 2.810
//! ```

use std::f64::consts::PI;
use turbid::coupling::ForceBalance;
use turbid::fluid::Precision;
use turbid::{Builder, Particles, Result};

/// Drag factor of a simple-cubic array at the volume fraction 0.064 (-), doi:10.1017/S0022112082000627.
const ZICK_HOMSY: f64 = 2.810;

/// Returns the drag factor `K = F / (6 pi rho nu R U)` with the superficial velocity `U` (-).
pub(crate) fn run() -> Result<f64> {
    let (edge, radius, viscosity, acceleration) = (2.5e-3, 6.2035e-4, 1e-5, 2e-3);
    let sphere = Particles::spheres(2.0 * radius, 1000.0).at([0.5 * edge; 3]).fixed();
    let mut simulation = Builder::new([edge; 3])
        .fluid(1000.0, viscosity)
        .lattice(12.407, 1.0)
        .precision(Precision::F64)
        .particles(sphere)
        .gravity([0.0; 3])
        .body_acceleration([0.0, 0.0, acceleration])
        .force_balance(ForceBalance::FluidOnly)
        .build()?;
    println!("time (s)  force on the sphere (N)  drag factor");
    let mut factor = 0.0;
    for n in 1..=4 {
        simulation.run_until(0.075 * f64::from(n))?;
        let velocity = simulation.measure().mean.velocity.z;
        let force = simulation.loads().map(|(_, load)| load.force.z).sum::<f64>();
        factor = acceleration * edge.powi(3) / (6.0 * PI * viscosity * radius * velocity);
        println!("{:8.3}  {force:23.4e}  {factor:11.4}", simulation.time());
    }
    println!("Zick and Homsy: {ZICK_HOMSY:.3}");
    Ok(factor)
}

fn main() -> Result<()> {
    run().map(|_| ())
}
