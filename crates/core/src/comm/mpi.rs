//! Ranks that are MPI processes: those of a job of this program, started by `mpirun`, `srun` or the like, or those of a
//! communicator of a program that has started MPI itself.
//!
//! MPI is initialised only under a launcher: alone it would cost a third of a second and start a daemon.
//! Patterns of messages are persistent requests; everything else is a few collectives and one message for each
//! neighbour. One thread at a time calls MPI: the one that has the [`MpiComm`]. MPI runs from the first of them to
//! the exit of the process, since it cannot be started twice; a communicator of another program is copied, and MPI is that
//! program's to end.
//!
//! A rank that panics aborts all, because the others would wait for it for ever.

mod pattern;

use super::traffic::Counters;
use super::{Pattern, Routed, Transport};
use crate::error::{Error, Result};
use ::mpi::collective::SystemOperation;
use ::mpi::environment::{self, Threading};
use ::mpi::ffi;
use ::mpi::request::multiple_scope;
use ::mpi::topology::SimpleCommunicator;
use ::mpi::traits::{AsRaw, Communicator, CommunicatorCollectives, Destination, FromRaw, Root, Source};
use bytemuck::Pod;
use pattern::MpiPattern;
use std::cell::Cell;
use std::collections::BTreeMap;
use std::mem::ManuallyDrop;
use std::os::raw::c_int;
use std::process;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, Once, PoisonError};

/// Exit code of all ranks after the panic of one.
const PANICKED: c_int = 101;

/// Tag of [`MpiComm::exchange`]; patterns have the tags above those of both.
const POST: c_int = 0;
/// Tag of [`MpiComm::route`].
const ROUTE: c_int = 1;

/// Most bytes that one call gathers: the library counts them with 31 bits.
const MOST: usize = 1 << 30;

/// Starts MPI.
static START: Once = Once::new();

/// True while somebody has a [`Turn`].
static AT_WORK: AtomicBool = AtomicBool::new(false);

/// True once this process has told MPI to abort.
static ABORTED: AtomicBool = AtomicBool::new(false);

/// The right to use the communicator of all processes, until the last communicator and pattern of a run are gone.
struct Turn;

impl Turn {
    fn take() -> Self {
        assert!(
            !AT_WORK.swap(true, Ordering::AcqRel),
            "the ranks of this MPI job are at work already: one run at a time"
        );
        Self
    }
}

impl Drop for Turn {
    fn drop(&mut self) {
        AT_WORK.store(false, Ordering::Release);
    }
}

/// A communicator, until the last [`MpiComm`] and pattern of a run are gone.
struct Ranks {
    /// That of all processes, or a copy of a caller's.
    communicator: ManuallyDrop<SimpleCommunicator>,
    /// Handle of Fortran's of the communicator that it is, or of which it is a copy.
    named: i32,
    /// With that of all processes.
    _turn: Option<Turn>,
}

// SAFETY: MPI lets any thread use a handle; that one does at a time is the business of whoever has the `MpiComm`.
unsafe impl Send for Ranks {}
// SAFETY: as above.
unsafe impl Sync for Ranks {}

impl Ranks {
    /// Those of the job.
    fn world() -> Self {
        let turn = Turn::take();
        START.call_once(initialise);
        // SAFETY: MPI runs.
        let named = unsafe { ffi::MPI_Comm_c2f(ffi::RSMPI_COMM_WORLD) };
        Self { communicator: ManuallyDrop::new(SimpleCommunicator::world()), named, _turn: Some(turn) }
    }

    /// A copy of the communicator with this handle of Fortran's. Collective.
    fn copy_of(handle: i32) -> Result<Self> {
        let refuse = |what: &str| Err(Error::Input(format!("communicator {handle}: {what}")));
        if !environment::is_initialized() || environment::is_finalized() {
            return refuse("MPI does not run; start it with MPI_Init_thread first");
        }
        if environment::threading_support() < Threading::Serialized {
            return refuse(
                "Turbid calls MPI from a thread of its own, and MPI was started for one thread alone; start it with \
                 MPI_Init_thread and MPI_THREAD_SERIALIZED",
            );
        }
        // SAFETY: MPI runs; a handle that is none is an error of the caller's, which MPI reports in its own way.
        let copy = unsafe {
            let caller = ffi::MPI_Comm_f2c(handle);
            if caller == ffi::RSMPI_COMM_NULL {
                return refuse("it is the null communicator");
            }
            let mut copy = ffi::RSMPI_COMM_NULL;
            ffi::MPI_Comm_dup(caller, &raw mut copy);
            // As in a job of its own: the caller's may return errors.
            ffi::MPI_Comm_set_errhandler(copy, ffi::RSMPI_ERRORS_ARE_FATAL);
            SimpleCommunicator::from_raw(copy)
        };
        Ok(Self { communicator: ManuallyDrop::new(copy), named: handle, _turn: None })
    }
}

impl Drop for Ranks {
    fn drop(&mut self) {
        if !environment::is_finalized() {
            // SAFETY: it is not used after this.
            unsafe { ManuallyDrop::drop(&mut self.communicator) };
        }
    }
}

/// One of several ranks that are processes of an MPI job.
pub struct MpiComm {
    ranks: Arc<Ranks>,
    rank: usize,
    size: usize,
    plans: Cell<c_int>,
    counters: Arc<Counters>,
    /// Bytes that one call of MPI may gather.
    limit: usize,
}

fn count(length: usize) -> c_int {
    c_int::try_from(length).expect("a message of less than 2 GiB")
}

impl MpiComm {
    /// The ranks of the job this process is one of. Their first call starts MPI, the exit of the process ends it.
    /// Collective.
    ///
    /// # Panics
    /// If the communicator or a pattern of an earlier call is alive, or if others in this process have started MPI.
    pub fn world() -> Self {
        Self::of(Ranks::world())
    }

    /// The ranks of a communicator of a program that has started MPI, given by its handle of Fortran's: a copy, until this one and its
    /// patterns are gone. Collective.
    ///
    /// # Errors
    /// [`Error::Input`] if MPI does not run, or for one thread alone, or if there is no such communicator.
    pub fn of_caller(handle: i32) -> Result<Self> {
        Ranks::copy_of(handle).map(Self::of)
    }

    fn of(ranks: Ranks) -> Self {
        Self {
            rank: ranks.communicator.rank() as usize,
            size: ranks.communicator.size() as usize,
            ranks: Arc::new(ranks),
            plans: Cell::new(ROUTE),
            counters: Arc::default(),
            limit: MOST,
        }
    }

    fn ranks(&self) -> &SimpleCommunicator {
        &self.ranks.communicator
    }

    /// The same with less in one call of MPI, to try what large amounts do; equal on all ranks.
    #[cfg(test)]
    pub(super) fn with_limit(self, limit: usize) -> Self {
        Self { limit, ..self }
    }

    /// Another handle for collectives of the same ranks, for the same thread. Only one of both may make patterns.
    #[must_use]
    pub fn twin(&self) -> Self {
        Self { ranks: self.ranks.clone(), plans: Cell::new(ROUTE), counters: self.counters.clone(), ..*self }
    }

    /// Number of this rank, as MPI has it.
    pub fn rank(&self) -> usize {
        self.rank
    }

    /// Number of ranks, as MPI has it.
    pub fn size(&self) -> usize {
        self.size
    }

    /// Number of bytes of each rank.
    fn lengths(&self, bytes: &[u8]) -> Vec<usize> {
        let mut lengths = vec![0_u64; self.size];
        self.ranks().all_gather_into(&(bytes.len() as u64), &mut lengths);
        lengths.into_iter().map(|length| length as usize).collect()
    }

    /// A copy of the communicator, as a handle of Fortran's: one for all libraries of this process.
    pub(super) fn duplicate(&self) -> i32 {
        static COPIES: Mutex<BTreeMap<i32, i32>> = Mutex::new(BTreeMap::new());
        *COPIES.lock().unwrap_or_else(PoisonError::into_inner).entry(self.ranks.named).or_insert_with(|| {
            let mut copy = std::mem::MaybeUninit::uninit();
            // SAFETY: MPI runs, every rank calls this, and the copy is where it goes.
            unsafe {
                ffi::MPI_Comm_dup(self.ranks().as_raw(), copy.as_mut_ptr());
                ffi::MPI_Comm_c2f(copy.assume_init())
            }
        })
    }

    pub(super) fn pattern<T: Pod + Send>(
        &self,
        peers: &[usize],
        lengths: &[usize],
    ) -> Result<Box<dyn Pattern<T>>> {
        self.plans.set(self.plans.get() + 1);
        Ok(Box::new(MpiPattern::<T>::new(self, self.plans.get(), peers, lengths)?))
    }
}

impl Transport for MpiComm {
    fn rank(&self) -> usize {
        self.rank
    }

    fn size(&self) -> usize {
        self.size
    }

    fn counters(&self) -> &Arc<Counters> {
        &self.counters
    }

    fn barrier(&self) {
        self.ranks().barrier();
    }

    fn sum(&self, values: &mut [i64]) {
        // Unsigned integers wrap.
        let values: &mut [u64] = bytemuck::cast_slice_mut(values);
        self.ranks().all_reduce_into(&values.to_vec(), values, SystemOperation::sum());
    }

    fn max(&self, values: &mut [f64]) {
        self.ranks().all_reduce_into(&values.to_vec(), values, SystemOperation::max());
    }

    /// Rank 0 gathers the bytes and shows them to all, piece by piece.
    fn all_gather(&self, bytes: Vec<u8>) -> Vec<Vec<u8>> {
        let lengths = self.lengths(&bytes);
        let mut all = self.gather(bytes).concat();
        all.resize(lengths.iter().sum(), 0);
        for piece in all.chunks_mut(self.limit) {
            self.ranks().process_at_rank(0).broadcast_into(piece);
        }
        let mut rest = &all[..];
        let part = |length| rest.split_off(..length).expect("a sum of all lengths").to_vec();
        lengths.into_iter().map(part).collect()
    }

    /// Rank 0 takes the bytes of one rank after the other, piece by piece.
    fn gather(&self, bytes: Vec<u8>) -> Vec<Vec<u8>> {
        let lengths = self.lengths(&bytes);
        if self.rank > 0 {
            for piece in bytes.chunks(self.limit) {
                self.ranks().process_at_rank(0).send_with_tag(piece, POST);
            }
            return Vec::new();
        }
        let mut all = vec![bytes];
        for (peer, &length) in lengths.iter().enumerate().skip(1) {
            let mut part = Vec::with_capacity(length);
            while part.len() < length {
                part.extend(receive(self.ranks(), peer));
            }
            all.push(part);
        }
        all
    }

    fn exchange(&self, peers: &[usize], messages: Vec<Vec<u8>>) -> Vec<Vec<u8>> {
        let ranks = self.ranks();
        multiple_scope(peers.len(), |scope, requests| {
            for (&peer, message) in peers.iter().zip(&messages) {
                let peer = ranks.process_at_rank(count(peer));
                requests.add(peer.immediate_send_with_tag(scope, &message[..], POST));
            }
            let received = peers.iter().map(|&peer| receive(self.ranks(), peer)).collect();
            requests.wait_all(&mut Vec::new());
            received
        })
    }

    fn route(&self, messages: Vec<Routed>) -> Vec<Routed> {
        let (ranks, mut due, mut received) = (self.ranks(), 0_u64, Vec::new());
        let mut sent = vec![0_u64; self.size];
        for &(to, _) in &messages {
            sent[to] = 1;
        }
        // Once it returns, every rank has received all of the call before.
        ranks.reduce_scatter_block_into(&sent[..], &mut due, SystemOperation::sum());
        multiple_scope(messages.len(), |scope, requests| {
            for (to, message) in &messages {
                let to = ranks.process_at_rank(count(*to));
                requests.add(to.immediate_send_with_tag(scope, &message[..], ROUTE));
            }
            for _ in 0..due {
                let (message, status) = ranks.any_process().receive_vec_with_tag(ROUTE);
                received.push((status.source_rank() as usize, message));
            }
            requests.wait_all(&mut Vec::new());
        });
        received
    }
}

/// The next message of a peer, of any length.
fn receive(ranks: &SimpleCommunicator, peer: usize) -> Vec<u8> {
    ranks.process_at_rank(count(peer)).receive_vec_with_tag(POST).0
}

/// Starts MPI, to be ended at the exit of this process, or of all processes when this one panics.
fn initialise() {
    let (universe, _) =
        ::mpi::initialize_with_threading(Threading::Serialized).expect("nobody else has started MPI");
    std::mem::forget(universe);
    // SAFETY: the function takes nothing and does not unwind.
    let registered = unsafe { libc::atexit(finalise) };
    assert_eq!(registered, 0, "there is room for a function to be called at the exit");
    let before = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |information| {
        before(information);
        abort(PANICKED);
    }));
}

/// Ends MPI in this process. Waits for the other ranks.
extern "C" fn finalise() {
    if ABORTED.load(Ordering::Acquire) {
        return;
    }
    let mut over = 0;
    // SAFETY: MPI may be queried at any time; it is finalised once, when nothing else of this program calls it any
    // more.
    unsafe {
        ffi::MPI_Finalized(&raw mut over);
        if over == 0 {
            ffi::MPI_Finalize();
        }
    }
}

/// Ends all ranks of the job.
pub fn abort(code: i32) -> ! {
    ABORTED.store(true, Ordering::Release);
    // SAFETY: MPI may be told to abort at any time while it runs.
    unsafe {
        let mut running = 0;
        ffi::MPI_Initialized(&raw mut running);
        if running != 0 {
            ffi::MPI_Abort(ffi::RSMPI_COMM_WORLD, code);
        }
    }
    process::exit(code)
}
