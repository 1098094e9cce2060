//! Hindered settling: how much more slowly 24 spheres settle than one sphere in slow flow.
//!
//! `cargo run --release --example hindered_settling` prints
//!
//! ```text
//! t*    velocity / Stokes velocity
//!  2.0  0.298
//!  4.0  0.349
//!  6.0  0.363
//!  8.0  0.366
//! ```

use turbid::{Builder, Particles, Result};

/// Returns the mean settling velocity over the Stokes velocity (-).
pub(crate) fn run() -> Result<f64> {
    let spheres = Particles::spheres(1e-3, 2500.0).volume_fraction(0.1);
    let setup = Builder::new([5e-3; 3]).fluid(1000.0, 1e-5).lattice(6.0, 0.6).particles(spheres).setup()?;
    let mut simulation = turbid::Simulation::solo(&setup)?;
    let scales = setup.expect_fluid().scales;
    println!("t*    velocity / Stokes velocity");
    let mut ratio = 0.0;
    for n in 1..=4 {
        simulation.run_until(f64::from(2 * n) * scales.stokes_time)?;
        let particles = simulation.particles();
        let sum: f64 = particles.iter().map(|particle| particle.velocity().z).sum();
        ratio = -sum / particles.len() as f64 / scales.stokes_velocity;
        println!("{:4.1}  {ratio:.3}", simulation.time() / scales.stokes_time);
    }
    Ok(ratio)
}

fn main() -> Result<()> {
    run().map(|_| ())
}
