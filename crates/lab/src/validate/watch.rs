//! Runs that are looked at from time to time, that can be stopped and resumed, and that are not repeated once they are complete.
//!
//! ```text
//! DIRECTORY/kept/<case>_<key>/    a run of the full level; the key is a checksum of the program, the case and its text
//!   rows.json                     rows of a complete run
//!   checkpoints/                  of an incomplete run, with its rows so far
//! ```

use super::SuiteContext;
use crate::checks::suite::Context;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};
use turbid::case::Setup;
use turbid::checkpoint;
use turbid::comm::Comm;
use turbid::domain::Decomposition;
use turbid::error::{Error, Result};
use turbid::input;
use turbid::output::{directory, write_bytes};
use turbid::simulation::{self, Session, Simulation};
use xxhash_rust::xxh3::xxh3_64;

/// Time between two checkpoints, unless the run is stopped.
const INTERVAL: Duration = Duration::from_secs(300);
/// A slow disk (bytes per second), for the time that a checkpoint may take.
const SLOW_DISK: f64 = 1e8;

/// A run on at most this number of ranks, and the steps between two looks at it.
pub(super) struct Watch<'a> {
    pub(super) context: &'a SuiteContext,
    pub(super) setup: &'a Setup,
    pub(super) threads: usize,
    pub(super) every: u64,
}

impl Watch<'_> {
    /// The rows that `look(run, rows)` has added until the end of the case, or until it returned true.
    ///
    /// # Errors
    /// [`Error::Interrupted`] if it was stopped; failures of the run, and of reading and writing its files.
    pub(super) fn rows<R: Serialize + DeserializeOwned>(
        &self,
        look: impl FnMut(&Session, &mut Vec<R>) -> Result<bool>,
    ) -> Result<Vec<R>> {
        let Some(kept) = &self.context.kept else { return self.run(None, look) };
        let provenance = &self.setup.provenance;
        let identity =
            (env!("CARGO_PKG_VERSION"), program(), simulation::identity(self.setup), &provenance.text);
        let key = xxh3_64(serde_json::to_string(&identity).expect("plain data is always JSON").as_bytes());
        let folder = kept.join("kept").join(format!("{}_{key:016x}", provenance.name));
        let file = folder.join("rows.json");
        if let Ok(bytes) = input::read(&file, input::RECORD)
            && let Ok(rows) = serde_json::from_slice(&bytes)
        {
            self.context.read.fetch_add(1, Ordering::Relaxed);
            return Ok(rows);
        }
        let _lock = directory::create(&folder)?;
        // Checkpoints of another version, or damaged ones, are of no use.
        let checkpoints = folder.join(checkpoint::FOLDER);
        let usable = checkpoint::newest_sound(&checkpoints, &Comm::Solo, |_| Ok(())).is_ok();
        if !usable && checkpoints.exists() {
            checkpoint::clear(&checkpoints)?;
        }
        let rows = self.run(Some((&checkpoints, usable)), look)?;
        write_bytes(&file, &json(&rows))?;
        checkpoint::clear(&checkpoints)?;
        Ok(rows)
    }

    /// Runs, with checkpoints in a folder, which may have one already.
    fn run<R: Serialize + DeserializeOwned>(
        &self,
        checkpoints: Option<(&Path, bool)>,
        mut look: impl FnMut(&Session, &mut Vec<R>) -> Result<bool>,
    ) -> Result<Vec<R>> {
        let mut setup = self.setup.clone();
        setup.plan.threads = Decomposition::max_ranks(setup.domain, self.threads.max(1));
        let (session, setup) = (Session::new(setup)?, Arc::new(self.setup.clone()));
        let mut rows = match checkpoints {
            Some((folder, true)) => {
                let (from, setup) = (folder.to_owned(), setup.clone());
                let bytes = session.on_root(move |run| run.read_checkpoint(&from, &setup))?;
                serde_json::from_slice(&bytes)
                    .map_err(|error| Error::Input(format!("{}: {error}; remove it", folder.display())))?
            }
            _ => Vec::new(),
        };
        let write = Duration::from_secs_f64(Simulation::checkpoint_bytes(&setup) / SLOW_DISK);
        let (mut written, mut longest) = (Instant::now(), Duration::ZERO);
        while session.steps_done()? < setup.plan.end_step {
            let start = Instant::now();
            session.advance(self.every)?;
            if look(&session, &mut rows)? {
                break;
            }
            longest = longest.max(start.elapsed());
            let stop = self.context.is_over(write + 2 * longest);
            if let (true, Some((folder, _))) = (stop || written.elapsed() >= INTERVAL, checkpoints) {
                let (to, setup, rows) = (PathBuf::from(folder), setup.clone(), json(&rows));
                session.on_ranks(move |run| run.write_checkpoint(&to, &setup, &rows))?;
                written = Instant::now();
            }
            if stop {
                return Err(Error::Interrupted);
            }
        }
        Ok(rows)
    }
}

/// Time (s), gap to the floor (diameters), vertical velocity (m/s) and move to the side (diameters) of the only sphere after every
/// step, until the gap is below `until`.
pub(super) fn sphere_course(
    context: &SuiteContext,
    setup: &Setup,
    threads: usize,
    until: f64,
) -> Result<Vec<[f64; 4]>> {
    let (start, diameter) = (setup.particles[0].position(), setup.diameter);
    Watch { context, setup, threads, every: 1 }.rows(|run, rows: &mut Vec<[f64; 4]>| {
        let sphere = &run.particles()?[0];
        let gap = sphere.position().z / diameter - 0.5;
        let aside = (sphere.position() - start).xy().norm() / diameter;
        rows.push([run.steps_done()? as f64 * setup.time_step, gap, sphere.velocity().z, aside]);
        Ok(gap < until)
    })
}

/// Checksum of the program that runs; 0 where it cannot be read.
fn program() -> u64 {
    static SUM: OnceLock<u64> = OnceLock::new();
    *SUM.get_or_init(|| std::env::current_exe().and_then(fs::read).map_or(0, |bytes| xxh3_64(&bytes)))
}

fn json(rows: &impl Serialize) -> Vec<u8> {
    serde_json::to_vec(rows).expect("plain data is always JSON")
}
