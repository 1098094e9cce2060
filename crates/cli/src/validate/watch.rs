//! Runs that are looked at from time to time, that can be stopped and gone on with, and that are not repeated once they have
//! ended.
//!
//! ```text
//! DIRECTORY/kept/<case>_<key>/    one for each run of the full level; the key is that of what is below
//!   rows.json                     version of the program, the case, and what was seen: of a run that has ended
//!   checkpoints/                  of one that has not, with what was seen so far
//! ```

use super::Trial;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::fs;
use std::path::{Path, PathBuf};
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
use turbid::simulation;
use turbid::simulation::Simulation;
use xxhash_rust::xxh3::xxh3_64;

/// Time between two checkpoints, unless the run is stopped.
const INTERVAL: Duration = Duration::from_secs(300);
/// A slow disk (bytes per second), for the time that a checkpoint may take.
const SLOW_DISK: f64 = 1e8;

/// How a run is watched.
pub(super) struct Watch<'a> {
    /// With what all are run.
    pub(super) trial: &'a Trial,
    /// What is run.
    pub(super) setup: &'a Setup,
    /// On how many ranks at most.
    pub(super) threads: usize,
    /// Steps between two looks.
    pub(super) every: u64,
    /// Whether the particles are held where they are.
    pub(super) held: bool,
}

/// What was seen of a run that has ended, and of which.
#[derive(Serialize, Deserialize)]
struct Kept<R> {
    of: Identity,
    rows: Vec<R>,
}

/// What makes two runs the same.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Identity {
    version: String,
    /// Checksum of the program: other physics are another run.
    program: u64,
    setup: serde_json::Value,
    case: String,
}

impl Watch<'_> {
    /// Runs until the end of the case, or until a look says that it has seen enough; what all ranks have seen, in no particular order
    /// of the ranks.
    ///
    /// `look(run, rows)` is called on all ranks after every so many steps, with what this rank has seen so far (rank 0 also has
    /// what all had seen when the run was stopped), and adds to it. What it answers must be the same on all ranks.
    ///
    /// # Errors
    /// [`Error::Interrupted`] if it was stopped; failures of the run, and of reading and writing what is kept.
    pub(super) fn rows<R>(
        &self,
        look: impl Fn(&mut Simulation, &mut Vec<R>) -> Result<bool> + Sync,
    ) -> Result<Vec<R>>
    where
        R: Serialize + DeserializeOwned + Send,
    {
        let Some(kept) = &self.trial.kept else {
            return self.run(None, look);
        };
        let of = self.identity();
        let key = xxh3_64(serde_json::to_string(&of).expect("plain data is always JSON").as_bytes());
        let folder = kept.join("kept").join(format!("{}_{key:016x}", self.setup.provenance.name));
        let file = folder.join("rows.json");
        if let Some(known) = read::<R>(&file)
            && known.of == of
        {
            self.trial.read.fetch_add(1, Ordering::Relaxed);
            return Ok(known.rows);
        }
        let _lock = directory::create(&folder)?;
        // What cannot be gone on with, of another version or damaged, is only in the way.
        let checkpoints = folder.join(checkpoint::FOLDER);
        let usable = checkpoint::newest_sound(&checkpoints, &Comm::Solo, |_| Ok(())).is_ok();
        if !usable && checkpoints.exists() {
            checkpoint::clear(&checkpoints)?;
        }
        let kept = Kept { of, rows: self.run(Some(&checkpoints), look)? };
        let text = serde_json::to_string(&kept).expect("plain data is always JSON");
        write_bytes(&file, text.as_bytes())?;
        checkpoint::clear(&checkpoints)?;
        Ok(kept.rows)
    }

    fn identity(&self) -> Identity {
        Identity {
            version: env!("CARGO_PKG_VERSION").to_string(),
            program: program(),
            setup: simulation::identity(self.setup),
            case: self.setup.provenance.text.clone(),
        }
    }

    fn run<R>(
        &self,
        checkpoints: Option<&Path>,
        look: impl Fn(&mut Simulation, &mut Vec<R>) -> Result<bool> + Sync,
    ) -> Result<Vec<R>>
    where
        R: Serialize + DeserializeOwned + Send,
    {
        let ranks = Decomposition::max_ranks(self.setup.domain, self.threads.max(1));
        let decomposition = Decomposition::new(self.setup.domain, ranks).expect("so many have room");
        let all = try_on_threads(ranks, |comm| {
            let mut run = self.begin(&decomposition, comm)?;
            let mut keeper = Keeper::new(self, checkpoints);
            let mut rows = keeper.take_up(&mut run)?;
            while run.steps_done() < self.setup.plan.end_step {
                run.advance(self.every)?;
                if look(&mut run, &mut rows)? {
                    break;
                }
                keeper.keep(&mut run, &rows)?;
            }
            Ok(rows)
        })?;
        let all: Result<Vec<Vec<R>>> = all.into_iter().collect();
        Ok(all?.into_iter().flatten().collect())
    }

    fn begin(&self, decomposition: &Decomposition, comm: Comm) -> Result<Simulation> {
        if self.held {
            return Simulation::with_prescribed_motion(self.setup, decomposition, comm);
        }
        Simulation::new(self.setup, decomposition, comm)
    }
}

/// Checksum of the program that runs; 0 where it cannot be read.
fn program() -> u64 {
    static SUM: OnceLock<u64> = OnceLock::new();
    *SUM.get_or_init(|| {
        let bytes = std::env::current_exe().and_then(fs::read);
        bytes.map_or(0, |bytes| xxh3_64(&bytes))
    })
}

/// What is kept in a file, if it is there and whole.
fn read<R: DeserializeOwned>(file: &Path) -> Option<Kept<R>> {
    serde_json::from_slice(&input::read(file, input::RECORD).ok()?).ok()
}

/// Writes the checkpoints of a run, and ends it when it is told to.
struct Keeper<'a> {
    watch: &'a Watch<'a>,
    folder: Option<PathBuf>,
    written: Instant,
    /// When the look before was, and the longest time between two.
    look: Instant,
    longest: Duration,
}

impl<'a> Keeper<'a> {
    fn new(watch: &'a Watch<'a>, folder: Option<&Path>) -> Self {
        let now = Instant::now();
        Self {
            watch,
            folder: folder.map(Path::to_path_buf),
            written: now,
            look: now,
            longest: Duration::ZERO,
        }
    }

    /// Goes on from the last checkpoint, if there is one: what had been seen until then, at rank 0.
    fn take_up<R: DeserializeOwned>(&self, run: &mut Simulation) -> Result<Vec<R>> {
        let Some(folder) = &self.folder else {
            return Ok(Vec::new());
        };
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

    /// Writes a checkpoint if it is time to; ends the run if it is to end. Collective.
    fn keep<R: Serialize>(&mut self, run: &mut Simulation, rows: &[R]) -> Result<()> {
        let now = Instant::now();
        self.longest = self.longest.max(now - self.look);
        self.look = now;
        let write = Duration::from_secs_f64(Simulation::checkpoint_bytes(self.watch.setup) / SLOW_DISK);
        let stop = self.watch.trial.is_over(write + 2 * self.longest);
        let due = self.folder.is_some() && now - self.written >= INTERVAL;
        // Both in one message.
        let mut wishes = [f64::from(u8::from(stop)), f64::from(u8::from(due))];
        run.comm().max(&mut wishes);
        let [stop, due] = wishes.map(|wish| wish > 0.5);
        if let (true, Some(folder)) = (stop || due, &self.folder) {
            let mine = serde_json::to_vec(rows).expect("plain data is always JSON");
            let own = joined(&run.comm().all_gather(mine));
            run.write_checkpoint(folder, self.watch.setup, &own)?;
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
