//! Stepping beside an external program: a controller in another process reads where a sphere is and says how to pull it.
//!
//! `cargo run --release --example external_program` prints
//!
//! ```text
//! time (s)  height (um)  force (nN)
//!    0.000         1000        5000
//!    0.019         1264        3680
//!    0.037         1599        2005
//!    0.056         1833         835
//!    0.074         1955         225
//!    0.093         1997          15
//! ```

use std::cell::Cell;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::rc::Rc;
use turbid::dem::Load;
use turbid::math::Vec3;
use turbid::{Builder, Error, Particles, Result};

/// Reads heights (um) and answers with forces (nN), 5 nN per um below 2000 um.
const CONTROLLER: &str = "while read height; do echo $(( (2000 - height) * 5 )); done";

/// Returns the height of the sphere at the end (m): the force of the controller bears its submerged weight.
pub(crate) fn run() -> Result<f64> {
    let failed = |source| Error::io("talk to", Path::new("sh"), source);
    let mut controller = Command::new("sh")
        .args(["-c", CONTROLLER])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .map_err(failed)?;
    let mut to = controller.stdin.take().expect("it is piped");
    let mut from = BufReader::new(controller.stdout.take().expect("it is piped")).lines();

    let sphere = Particles::spheres(1e-3, 1100.0).at([2e-3, 2e-3, 1e-3]);
    let mut simulation =
        Builder::new([4e-3; 3]).fluid(1000.0, 1e-5).lattice(6.0, 0.6).particles(sphere).build()?;
    let force = Rc::new(Cell::new(0.0));
    let given = Rc::clone(&force);
    simulation.set_external_load(move |_time, _particle| Load {
        force: Vec3::new(0.0, 0.0, given.get()),
        ..Load::default()
    });

    println!("time (s)  height (um)  force (nN)");
    let mut height = 0.0;
    for n in 0..=100 {
        height = simulation.particles()[0].position().z;
        writeln!(to, "{:.0}", 1e6 * height).map_err(failed)?;
        let line = from.next().transpose().map_err(failed)?.unwrap_or_default();
        let answer = line.trim().parse::<f64>().unwrap_or(f64::NAN);
        force.set(1e-9 * answer);
        if n % 20 == 0 {
            println!("{:8.3}  {:11.0}  {answer:10.0}", simulation.time(), 1e6 * height);
        }
        simulation.advance(10)?;
    }
    drop(to);
    controller.wait().map_err(failed)?;
    Ok(height)
}

fn main() -> Result<()> {
    run().map(|_| ())
}
