//! Fields of the fluid, and a file of one's own: the profile of a flow between two walls, as CSV.
//!
//! `cargo run --release --example fields` writes `turbid_profile.csv` to the folder for temporary files and prints
//!
//! ```text
//!    z (mm)  velocity (mm/s)  parabola (mm/s)
//!     0.125            7.187            7.266
//!     0.375           20.311           20.391
//!     0.625           31.560           31.641
//!     0.875           40.934           41.016
//!     1.125           48.433           48.516
//!     1.375           54.057           54.141
//!     1.625           57.807           57.891
//!     1.875           59.682           59.766
//!     2.125           59.682           59.766
//!     2.375           57.807           57.891
//!     2.625           54.057           54.141
//!     2.875           48.433           48.516
//!     3.125           40.934           41.016
//!     3.375           31.560           31.641
//!     3.625           20.311           20.391
//!     3.875            7.187            7.266
//! ```

use std::io::Write;
use turbid::{Builder, Error, Particles, Result};

/// Returns the largest deviation from the parabola over its largest velocity (-).
pub(crate) fn run() -> Result<f64> {
    let (height, viscosity, acceleration) = (4e-3, 1e-5, 0.3);
    // No particle: their diameter sizes the cells.
    let none = Particles::spheres(1e-3, 2500.0).count(0);
    let mut simulation = Builder::new([2e-3, 2e-3, height])
        .periodic([true, true, false])
        .fluid(1000.0, viscosity)
        .lattice(4.0, 0.6)
        .particles(none)
        .body_acceleration([acceleration, 0.0, 0.0])
        .build()?;
    simulation.run_until(1.5)?;

    let fields = simulation.fields()?;
    let [nx, ny, nz] = simulation.block().size();
    let mut layers = vec![0.0; nz];
    for ([_, _, z], velocity) in simulation.block().cells().zip(&fields.velocity) {
        layers[z] += f64::from(velocity[0]) / (nx * ny) as f64;
    }

    let path = std::env::temp_dir().join("turbid_profile.csv");
    let failed = |source| Error::io("write", &path, source);
    let mut file = std::fs::File::create(&path).map_err(failed)?;
    writeln!(file, "z (m),velocity (m/s),parabola (m/s)").map_err(failed)?;
    println!("   z (mm)  velocity (mm/s)  parabola (mm/s)");
    let fastest = acceleration * height * height / (8.0 * viscosity);
    let mut deviation = 0.0_f64;
    for (layer, &velocity) in layers.iter().enumerate() {
        let z = (layer as f64 + 0.5) * height / nz as f64;
        let parabola = 4.0 * fastest * z * (height - z) / (height * height);
        writeln!(file, "{z:e},{velocity:e},{parabola:e}").map_err(failed)?;
        println!("{:9.3}  {:15.3}  {:15.3}", 1e3 * z, 1e3 * velocity, 1e3 * parabola);
        deviation = deviation.max((velocity - parabola).abs() / fastest);
    }
    Ok(deviation)
}

fn main() -> Result<()> {
    run().map(|_| ())
}
