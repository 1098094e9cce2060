//! A failure of one rank, as the others get it.

use crate::case::{Impact, Insertion, Setup};
use crate::error::Error;
use crate::math::Vec3;
use serde::{Deserialize, Serialize};

/// Accelerations and velocities that drive a case, and the remedy, for the message of a divergence.
pub(super) fn hint(setup: &Setup) -> String {
    let fluid = setup.fluid.as_ref();
    let vector = |a: Vec3| format!("[{}, {}, {}] m/s^2", a.x, a.y, a.z);
    let lattice = |name: &str, speed: f64| {
        let cells = speed / setup.units().velocity();
        if fluid.is_some() && cells > 0.0 {
            format!(" ({name}{cells:.3} cells per step)")
        } else {
            String::new()
        }
    };
    let mut drives = Vec::new();
    if setup.gravity != Vec3::zeros() {
        let settling = lattice("u* ", fluid.map_or(0.0, |fluid| fluid.scales.schiller_naumann_velocity));
        drives.push(format!("gravity {}{settling}", vector(setup.gravity)));
    }
    if let Some(fluid) = fluid.filter(|fluid| !fluid.body_acceleration.is_zero()) {
        let flow = setup.driven_flow().map_or(String::new(), |flow| lattice("up to ", flow.speed));
        let steady = fluid.body_acceleration.constant();
        let up_to = if steady.is_some() { "" } else { "of up to " };
        let drive = steady.unwrap_or_else(|| fluid.body_acceleration.largest());
        drives.push(format!("body_acceleration {up_to}{}{flow}", vector(drive)));
    }
    if setup.walls.iter().any(|wall| !wall.motion.rests()) {
        drives.push("moving walls".to_string());
    }
    let started = setup.totals().fastest;
    let inserted = setup.insertions.iter().map(Insertion::speed).fold(0.0, f64::max);
    if inserted > 0.0 {
        drives.push(format!("insertion at up to {inserted:.3e} m/s{}", lattice("", inserted)));
    }
    if started > 0.0 {
        drives.push(format!("start velocities up to {started:.3e} m/s{}", lattice("", started)));
    }
    let prescribed = (0..setup.templates.len()).map(|n| setup.prescribed_speed(n)).fold(0.0, f64::max);
    if prescribed > 0.0 {
        drives.push(format!("prescribed motion up to {prescribed:.3e} m/s{}", lattice("", prescribed)));
    }
    if drives.is_empty() {
        drives.push("nothing but contacts".to_string());
    }
    let drives = drives.join(", ");
    let is_mended = |impact: &Impact| impact.resolved() < 1.0 && impact.substeps(setup.substeps).is_finite();
    let unresolved = setup.impact().filter(is_mended);
    let contacts = unresolved.map_or_else(String::new, |impact| {
        format!(
            "; an impact at {} lasts {:.1} steps of the particles: contact.substeps = {:.0} resolves it",
            impact.cause,
            impact.steps,
            impact.substeps(setup.substeps)
        )
    });
    match setup.too_light() {
        Some(light) => format!("; {light}; driven by {drives}{contacts}"),
        None if fluid.is_none() => format!("; driven by {drives}{contacts}"),
        None => format!(
            "; driven by {drives}: a smaller time step (relaxation time) lowers all velocities on the lattice{contacts}"
        ),
    }
}

/// Part that failed.
#[derive(Serialize, Deserialize)]
enum Kind {
    Divergence,
    Engine,
    Device,
}

/// A failure for a message, with its step; `step` is that of failures that have none of their own.
pub(super) fn to_bytes(error: Error, step: u64) -> Vec<u8> {
    let failure = match error {
        Error::Engine { step, what, .. } => (Kind::Engine, step, what),
        Error::Device { what, .. } => (Kind::Device, step, what),
        Error::Diverged { step, what } => (Kind::Divergence, step, what),
        other => (Kind::Divergence, step, other.to_string()),
    };
    serde_json::to_vec(&failure).expect("plain JSON")
}

/// The first failure of all ranks, of several at one step that of the lowest rank; those without one sent nothing. `engine` is the
/// name of the engine of all, and `hint` says what may have caused a divergence.
pub(super) fn first(all: &[Vec<u8>], engine: &'static str, hint: &str) -> Error {
    let failures = all.iter().filter(|bytes| !bytes.is_empty());
    let failures = failures.map(|bytes| serde_json::from_slice(bytes).expect("made by to_bytes"));
    let first = failures.min_by_key(|&(_, step, _): &(Kind, u64, String)| step);
    match first.expect("called when a rank has failed") {
        (Kind::Engine, step, what) => Error::Engine { engine, step, what },
        (Kind::Device, step, what) => Error::Device { step, what },
        (Kind::Divergence, step, what) => Error::Diverged { step, what: what + hint },
    }
}

#[cfg(test)]
mod tests {
    use crate::case;
    use crate::comm::{Comm, SavedParts, on_threads};
    use crate::dem::{Ballistic, ContactState, ContactSummary, DemEngine, Load};
    use crate::domain::Decomposition;
    use crate::error::{Error, Result};
    use crate::particle::ParticleStore;
    use crate::shape::Shape;
    use crate::simulation::{CONTROL_INTERVAL, Simulation};

    /// Particles that keep their velocity, until a step from which one rank has nothing but this error.
    struct Failing {
        engine: Ballistic,
        steps: u64,
        error: Option<fn() -> Error>,
    }

    /// The step at which [`Failing`] fails; no multiple of the interval of controls.
    const FAILS_AT: u64 = 3;

    impl DemEngine for Failing {
        fn name(&self) -> &'static str {
            "failing"
        }

        fn supports(&self, _: &dyn Shape) -> bool {
            true
        }

        fn particles(&self) -> &ParticleStore {
            self.engine.particles()
        }

        fn advance(&mut self, comm: &Comm, loads: &[Load], dt: f64) -> Result<()> {
            self.engine.advance(comm, loads, dt)?;
            self.steps += 1;
            match self.error {
                Some(error) if self.steps > FAILS_AT => Err(error()),
                _ => Ok(()),
            }
        }

        fn contacts(&self) -> ContactSummary {
            self.engine.contacts()
        }

        fn contact_states(&self, comm: &Comm) -> Vec<ContactState> {
            self.engine.contact_states(comm)
        }

        fn save(&self, comm: &Comm) -> Result<Vec<u8>> {
            self.engine.save(comm)
        }

        fn restore(&mut self, comm: &Comm, parts: &SavedParts) -> Result<()> {
            self.engine.restore(comm, parts)
        }
    }

    #[test]
    fn an_engine_whose_particles_neither_come_nor_go_says_so() {
        let setup = crate::Builder::example().setup().unwrap();
        let cut = Decomposition::solo(setup.domain);
        let engine = Ballistic::new(cut.clone(), 0, setup.templates.clone(), &setup.particles);
        let engine = Box::new(Failing { engine, steps: 0, error: None });
        let mut simulation = Simulation::with_engine(&setup, &cut, Comm::Solo, engine).unwrap();
        let particle = setup.particles[0];
        for refused in [simulation.insert(&[particle]).map(|_| ()), simulation.remove(&[particle.id])] {
            let said = refused.unwrap_err().to_string();
            assert!(said.contains("failing") && said.contains("particles that come or go"), "{said}");
        }
    }

    /// Error with which each of three ranks ends if the engine of the second fails with this.
    fn outcomes(error: fn() -> Error) -> Vec<Error> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("case.toml");
        let text = "domain.size = [6e-3, 6e-3, 6e-3]\n\
                    fluid = { density = 1000.0, viscosity = 1e-5 }\n\
                    lattice = { cells_per_diameter = 3, relaxation_time = 0.6 }\n\
                    run.end.steps = 100\n\
                    [[particles]]\n\
                    shape.sphere.diameter = 1e-3\n\
                    density = 2000.0\n\
                    list = [[3e-3, 3e-3, 3e-3]]\n";
        std::fs::write(&path, text).unwrap();
        let setup = case::load(&path, &[]).unwrap();
        let cut = Decomposition::new(setup.domain, 3).unwrap();
        on_threads(3, |comm| {
            let error = (comm.rank() == 1).then_some(error);
            let particles = &setup.particles;
            let engine = Failing {
                engine: Ballistic::new(cut.clone(), comm.rank(), setup.templates.clone(), particles),
                steps: 0,
                error,
            };
            let mut simulation = Simulation::with_engine(&setup, &cut, comm, Box::new(engine)).unwrap();
            for _ in 0..=FAILS_AT {
                simulation.step().unwrap();
            }
            let failed = (FAILS_AT..FAILS_AT + CONTROL_INTERVAL).find_map(|_| simulation.step().err());
            failed.expect("a failure is known to all ranks at the next control")
        })
    }

    #[test]
    fn a_failed_engine_ends_three_ranks_as_such_with_its_step_and_words() {
        let ends =
            outcomes(|| Error::Engine { engine: "failing", step: 0, what: "killed by signal 9".to_string() });
        for end in ends {
            assert_eq!(end.exit_code(), 3);
            let words = "the failing engine failed at step 3: killed by signal 9";
            assert_eq!(end.to_string(), words);
        }
    }

    #[test]
    fn a_divergence_on_one_of_three_ranks_stays_one_on_all() {
        let ends = outcomes(|| Error::Diverged { step: 0, what: "too deep".to_string() });
        for end in ends {
            assert!(
                matches!(&end, Error::Diverged { what, .. } if what.starts_with("too deep; driven by gravity")),
                "{end}"
            );
        }
    }
}
