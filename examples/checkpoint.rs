//! A checkpoint: half a run on one rank, the other half on two, and the same bits as in one go.
//!
//! `cargo run --release --example checkpoint` prints
//!
//! ```text
//! checkpoint: half way
//! in one go:  a3cdc591e90317dc after 200 steps
//! resumed:    a3cdc591e90317dc on 2 ranks
//! ```

use turbid::{Builder, Particles, Result, Simulation};

/// Returns whether both ways end in the same state.
pub(crate) fn run() -> Result<bool> {
    let cubes = Particles::cuboids([8e-4; 3], 2000.0).count(8);
    let setup =
        Builder::new([4e-3; 3]).fluid(1000.0, 1e-5).lattice(6.0, 0.6).particles(cubes).threads(2).setup()?;
    let folder = std::env::temp_dir().join(format!("turbid_checkpoint_{}", std::process::id()));

    let mut whole = Simulation::solo(&setup)?;
    whole.advance(100)?;
    whole.write_checkpoint(&folder, &setup, b"half way")?;
    whole.advance(100)?;

    let (note, resumed) = Simulation::on_ranks(&setup, |mut simulation| {
        let note = simulation.read_checkpoint(&folder, &setup)?;
        simulation.advance(100)?;
        Ok((note, simulation.state_hash()))
    })?;
    let _ = std::fs::remove_dir_all(&folder);
    println!("checkpoint: {}", String::from_utf8_lossy(&note));
    println!("in one go:  {:016x} after {} steps", whole.state_hash(), whole.steps_done());
    println!("resumed:    {resumed:016x} on 2 ranks");
    Ok(whole.state_hash() == resumed)
}

fn main() -> Result<()> {
    run().map(|_| ())
}
