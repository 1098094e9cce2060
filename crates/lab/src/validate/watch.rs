//! Runs that are looked at from time to time, that can be stopped and resumed, and that are not repeated once they are complete.
//!
//! ```text
//! DIRECTORY/kept/<case>_<key>/    a run of the full level; the key is a checksum of the program, the case and its text
//!   rows.json                     rows of a complete run
//!   checkpoints/                  of an incomplete run, with its rows so far
//! ```

use super::SuiteContext;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::fs;
use std::path::Path;
use std::sync::OnceLock;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};
use turbid::case::Setup;
use turbid::checkpoint;
use turbid::comm::{Comm, try_on_threads};
use turbid::domain::Decomposition;
use turbid::error::{Error, Result};
use turbid::input;
use turbid::output::{directory, write_bytes};
use turbid::simulation::{self, Simulation};
use xxhash_rust::xxh3::xxh3_64;

/// Time between two checkpoints, unless the run is stopped.
const INTERVAL: Duration = Duration::from_secs(300);
/// A slow disk (bytes per second), for the time that a checkpoint may take.
const SLOW_DISK: f64 = 1e8;

/// A run and how often it is looked at.
pub(super) struct Watch<'a> {
    pub(super) context: &'a SuiteContext,
    pub(super) setup: &'a Setup,
    /// Largest number of ranks.
    pub(super) threads: usize,
    /// Steps between two looks.
    pub(super) every: u64,
}

impl Watch<'_> {
    /// Runs until the end of the case, or until a look returns true; the rows of all ranks, in no particular order of the ranks.
    ///
    /// `look(run, rows)` is called on all ranks every [`every`](Self::every) steps, adds to the rows of this rank (rank 0 also has all rows of
    /// before a restart), and returns the same on all ranks.
    ///
    /// # Errors
    /// [`Error::Interrupted`] if it was stopped; failures of the run, and of reading and writing its files.
    pub(super) fn rows<R: Serialize + DeserializeOwned + Send>(
        &self,
        look: impl Fn(&mut Simulation, &mut Vec<R>) -> Result<bool> + Sync,
    ) -> Result<Vec<R>> {
        let Some(kept) = &self.context.kept else {
            return self.run(None, look);
        };
        let setup = self.setup;
        let identity =
            (env!("CARGO_PKG_VERSION"), program(), simulation::identity(setup), &setup.provenance.text);
        let key = xxh3_64(serde_json::to_string(&identity).expect("plain data is always JSON").as_bytes());
        let folder = kept.join("kept").join(format!("{}_{key:016x}", setup.provenance.name));
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
        let rows = self.run(Some(&checkpoints), look)?;
        let text = serde_json::to_string(&rows).expect("plain data is always JSON");
        write_bytes(&file, text.as_bytes())?;
        checkpoint::clear(&checkpoints)?;
        Ok(rows)
    }

    fn run<R: Serialize + DeserializeOwned + Send>(
        &self,
        checkpoints: Option<&Path>,
        look: impl Fn(&mut Simulation, &mut Vec<R>) -> Result<bool> + Sync,
    ) -> Result<Vec<R>> {
        let ranks = Decomposition::max_ranks(self.setup.domain, self.threads.max(1));
        let decomposition = Decomposition::new(self.setup.domain, ranks).expect("at most the largest number");
        let all = try_on_threads(ranks, |comm| {
            let mut run = Simulation::new(self.setup, &decomposition, comm)?;
            let mut checkpointer = Checkpointer::new(self, checkpoints);
            let mut rows = checkpointer.restore(&mut run)?;
            while run.steps_done() < self.setup.plan.end_step {
                run.advance(self.every)?;
                if look(&mut run, &mut rows)? {
                    break;
                }
                checkpointer.observe(&mut run, &rows)?;
            }
            Ok(rows)
        })?;
        let all: Result<Vec<Vec<R>>> = all.into_iter().collect();
        Ok(all?.into_iter().flatten().collect())
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
    let watch = Watch { context, setup, threads, every: 1 };
    let mut rows: Vec<[f64; 4]> = watch.rows(|run, rows| {
        // The rank that owns the sphere, which may change on the way down.
        let mut low = [f64::NEG_INFINITY];
        if let Some(sphere) = run.particles().first() {
            let gap = sphere.position().z / diameter - 0.5;
            let aside = (sphere.position() - start).xy().norm() / diameter;
            rows.push([run.steps_done() as f64 * setup.time_step, gap, sphere.velocity().z, aside]);
            low = [-gap];
        }
        run.comm().max(&mut low);
        Ok(-low[0] < until)
    })?;
    rows.sort_by(|a, b| a[0].total_cmp(&b[0]));
    Ok(rows)
}

/// Checksum of the program that runs; 0 where it cannot be read.
fn program() -> u64 {
    static SUM: OnceLock<u64> = OnceLock::new();
    *SUM.get_or_init(|| {
        let bytes = std::env::current_exe().and_then(fs::read);
        bytes.map_or(0, |bytes| xxh3_64(&bytes))
    })
}

/// Writes the checkpoints of a run, and stops it.
struct Checkpointer<'a> {
    watch: &'a Watch<'a>,
    folder: Option<&'a Path>,
    written: Instant,
    /// Time of the last look, and the longest time between two.
    look: Instant,
    longest: Duration,
}

impl<'a> Checkpointer<'a> {
    fn new(watch: &'a Watch<'a>, folder: Option<&'a Path>) -> Self {
        let now = Instant::now();
        Self { watch, folder, written: now, look: now, longest: Duration::ZERO }
    }

    /// Restores the last checkpoint, if there is one; all rows so far are then on rank 0.
    fn restore<R: DeserializeOwned>(&self, run: &mut Simulation) -> Result<Vec<R>> {
        let Some(folder) = self.folder else { return Ok(Vec::new()) };
        if checkpoint::list(folder)?.is_empty() {
            return Ok(Vec::new());
        }
        let bytes = run.read_checkpoint(folder, self.watch.setup)?;
        if run.comm().rank() > 0 {
            return Ok(Vec::new());
        }
        serde_json::from_slice(&bytes)
            .map_err(|error| Error::Input(format!("{}: {error}; remove it", folder.display())))
    }

    /// Writes a checkpoint if one is due; stops the run if it must. Collective.
    fn observe<R: Serialize>(&mut self, run: &mut Simulation, rows: &[R]) -> Result<()> {
        let now = Instant::now();
        self.longest = self.longest.max(now - self.look);
        self.look = now;
        let write = Duration::from_secs_f64(Simulation::checkpoint_bytes(self.watch.setup) / SLOW_DISK);
        let stop = self.watch.context.is_over(write + 2 * self.longest);
        let due = self.folder.is_some() && now - self.written >= INTERVAL;
        // Both in one message.
        let mut requests = [stop, due].map(|request| f64::from(u8::from(request)));
        run.comm().max(&mut requests);
        let [stop, due] = requests.map(|request| request > 0.5);
        if let (true, Some(folder)) = (stop || due, self.folder) {
            let mine = serde_json::to_vec(rows).expect("plain data is always JSON");
            let all = joined(&run.comm().all_gather(mine));
            run.write_checkpoint(folder, self.watch.setup, &all)?;
            self.written = Instant::now();
            self.look = self.written;
        }
        if stop { Err(Error::Interrupted) } else { Ok(()) }
    }
}

/// Lists of JSON, one after the other in one.
fn joined(lists: &[Vec<u8>]) -> Vec<u8> {
    let inner = lists.iter().map(|list| &list[1..list.len() - 1]);
    let filled: Vec<&[u8]> = inner.filter(|list| !list.is_empty()).collect();
    [&b"["[..], &filled.join(&b","[..]), b"]"].concat()
}
