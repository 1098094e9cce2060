//! Ranks that are MPI processes, started by `mpirun`, `srun` or the like.
//!
//! MPI is initialised only under such a launcher: alone it would cost a third of a second and start a daemon.
//! Patterns of messages are persistent requests; everything else is a few collectives and one message for each
//! neighbour. One thread at a time calls MPI: the one that has the [`MpiComm`]. MPI runs from the first of them to
//! the exit of the process, since it cannot be started twice.
//!
//! A rank that panics aborts all, because the others would wait for it for ever.

mod pattern;

use super::traffic::Counters;
use super::{Pattern, Transport};
use crate::error::Result;
use ::mpi::environment::Threading;
use ::mpi::ffi;
use bytemuck::Pod;
use pattern::MpiPattern;
use std::cell::Cell;
use std::os::raw::{c_int, c_void};
use std::process;
use std::ptr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Once};

/// Exit code of all ranks after the panic of one.
const PANICKED: c_int = 101;

/// Tag of [`MpiComm::exchange`]; patterns have the tags above.
const POST: c_int = 0;

/// Most bytes that one call gathers: the library counts them with 31 bits.
const MOST: usize = 1 << 30;

/// Starts MPI.
static START: Once = Once::new();

/// True while somebody has a [`Turn`].
static AT_WORK: AtomicBool = AtomicBool::new(false);

/// True once this process has told MPI to abort.
static ABORTED: AtomicBool = AtomicBool::new(false);

/// The right to call MPI, until the last communicator and pattern of a run are gone.
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

/// One of several ranks that are processes of an MPI job.
pub struct MpiComm {
    turn: Arc<Turn>,
    rank: usize,
    size: usize,
    plans: Cell<c_int>,
    counters: Arc<Counters>,
    /// Bytes that one call of MPI may gather.
    limit: usize,
}

/// Panics if MPI reports a failure; its default is to end the job before that.
fn done(code: c_int) {
    assert_eq!(code, 0, "an MPI call failed");
}

fn count(length: usize) -> c_int {
    c_int::try_from(length).expect("a message of less than 2 GiB")
}

/// Address of the first byte. An empty vector has the address 1, which in Open MPI is `MPI_IN_PLACE`.
fn start(bytes: &[u8]) -> *const c_void {
    if bytes.is_empty() { ptr::null() } else { bytes.as_ptr().cast() }
}

/// Address for received bytes, like [`start`].
fn start_mut(bytes: &mut [u8]) -> *mut c_void {
    if bytes.is_empty() { ptr::null_mut() } else { bytes.as_mut_ptr().cast() }
}

impl MpiComm {
    /// The ranks of the job this process is one of. Their first call starts MPI, the exit of the process ends it.
    /// Collective.
    ///
    /// # Panics
    /// If the communicator or a pattern of an earlier call is alive, or if others in this process have started MPI.
    pub fn world() -> Self {
        let turn = Arc::new(Turn::take());
        START.call_once(initialise);
        let (mut rank, mut size) = (0, 0);
        // SAFETY: MPI runs, and the numbers are valid for writing.
        unsafe {
            done(ffi::MPI_Comm_rank(ffi::RSMPI_COMM_WORLD, &raw mut rank));
            done(ffi::MPI_Comm_size(ffi::RSMPI_COMM_WORLD, &raw mut size));
        }
        Self {
            turn,
            rank: rank as usize,
            size: size as usize,
            plans: Cell::new(POST),
            counters: Arc::default(),
            limit: MOST,
        }
    }

    /// The same with less in one call of MPI, to try what large amounts do; equal on all ranks.
    #[cfg(test)]
    pub(super) fn with_limit(self, limit: usize) -> Self {
        Self { limit, ..self }
    }

    /// Another handle for collectives of the same ranks, for the same thread. Only one of both may make patterns.
    #[must_use]
    pub fn twin(&self) -> Self {
        Self { turn: self.turn.clone(), plans: Cell::new(POST), counters: self.counters.clone(), ..*self }
    }

    #[expect(clippy::unused_self, reason = "who has a communicator knows that MPI runs")]
    fn raw(&self) -> ffi::MPI_Comm {
        // SAFETY: a constant of the library.
        unsafe { ffi::RSMPI_COMM_WORLD }
    }

    /// Number of this rank, as MPI has it.
    pub fn rank(&self) -> usize {
        self.rank
    }

    /// Number of ranks, as MPI has it.
    pub fn size(&self) -> usize {
        self.size
    }

    /// Replaces `values` by the result of an operation on those of all ranks.
    fn reduce<T: Copy>(&self, values: &mut [T], kind: ffi::MPI_Datatype, operation: ffi::MPI_Op) {
        let mine = values.to_vec();
        // SAFETY: both arrays have that many numbers of this kind, the same on every rank.
        done(unsafe {
            ffi::MPI_Allreduce(
                mine.as_ptr().cast(),
                values.as_mut_ptr().cast(),
                count(mine.len()),
                kind,
                operation,
                self.raw(),
            )
        });
    }

    /// Number of bytes of each rank.
    fn lengths(&self, bytes: &[u8]) -> Vec<usize> {
        let mine = bytes.len() as u64;
        let mut lengths = vec![0_u64; self.size];
        // SAFETY: one number goes out, and one from every rank comes in.
        done(unsafe {
            ffi::MPI_Allgather(
                (&raw const mine).cast(),
                1,
                ffi::RSMPI_UINT64_T,
                lengths.as_mut_ptr().cast(),
                1,
                ffi::RSMPI_UINT64_T,
                self.raw(),
            )
        });
        lengths.into_iter().map(|length| length as usize).collect()
    }

    /// The next message of a peer, of any length.
    fn receive(&self, peer: usize) -> Vec<u8> {
        let mut length = 0;
        // SAFETY: the status is filled by the probe before it is read, and the buffer has the length it tells;
        // messages of one peer do not overtake each other.
        unsafe {
            let mut status = std::mem::zeroed::<ffi::MPI_Status>();
            done(ffi::MPI_Probe(count(peer), POST, self.raw(), &raw mut status));
            done(ffi::MPI_Get_count(&raw const status, ffi::RSMPI_UINT8_T, &raw mut length));
            let mut message = vec![0_u8; length as usize];
            done(ffi::MPI_Recv(
                start_mut(&mut message),
                length,
                ffi::RSMPI_UINT8_T,
                count(peer),
                POST,
                self.raw(),
                &raw mut status,
            ));
            message
        }
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
        // SAFETY: the communicator is alive.
        done(unsafe { ffi::MPI_Barrier(self.raw()) });
    }

    fn sum(&self, values: &mut [i64]) {
        // SAFETY: constants of the library. Unsigned integers wrap.
        let (kind, operation) = unsafe { (ffi::RSMPI_UINT64_T, ffi::RSMPI_SUM) };
        self.reduce(values, kind, operation);
    }

    fn max(&self, values: &mut [f64]) {
        // SAFETY: constants of the library.
        let (kind, operation) = unsafe { (ffi::RSMPI_DOUBLE, ffi::RSMPI_MAX) };
        self.reduce(values, kind, operation);
    }

    /// Rank 0 gathers the bytes and shows them to all, piece by piece.
    fn all_gather(&self, bytes: Vec<u8>) -> Vec<Vec<u8>> {
        let lengths = self.lengths(&bytes);
        let mut all = self.gather(bytes).concat();
        all.resize(lengths.iter().sum(), 0);
        for piece in all.chunks_mut(self.limit) {
            // SAFETY: the piece has the same length on every rank; it is read on rank 0 and written on the others.
            done(unsafe {
                ffi::MPI_Bcast(
                    piece.as_mut_ptr().cast(),
                    count(piece.len()),
                    ffi::RSMPI_UINT8_T,
                    0,
                    self.raw(),
                )
            });
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
                // SAFETY: the piece is not touched before the call returns.
                done(unsafe {
                    ffi::MPI_Send(
                        piece.as_ptr().cast(),
                        count(piece.len()),
                        ffi::RSMPI_UINT8_T,
                        0,
                        POST,
                        self.raw(),
                    )
                });
            }
            return Vec::new();
        }
        let mut all = vec![bytes];
        for (peer, &length) in lengths.iter().enumerate().skip(1) {
            let mut part = Vec::with_capacity(length);
            while part.len() < length {
                part.extend(self.receive(peer));
            }
            all.push(part);
        }
        all
    }

    fn exchange(&self, peers: &[usize], messages: Vec<Vec<u8>>) -> Vec<Vec<u8>> {
        // SAFETY: a null request is a value that the library gives.
        let mut requests = vec![unsafe { ffi::RSMPI_REQUEST_NULL }; peers.len()];
        for ((&peer, message), request) in peers.iter().zip(&messages).zip(&mut requests) {
            // SAFETY: the message is not touched before all requests are complete.
            done(unsafe {
                ffi::MPI_Isend(
                    start(message),
                    count(message.len()),
                    ffi::RSMPI_UINT8_T,
                    count(peer),
                    POST,
                    self.raw(),
                    request,
                )
            });
        }
        let received = peers.iter().map(|&peer| self.receive(peer)).collect();
        wait_all(&mut requests);
        received
    }
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

fn wait_all(requests: &mut [ffi::MPI_Request]) {
    // SAFETY: the requests are alive, and their statuses not needed.
    done(unsafe {
        ffi::MPI_Waitall(count(requests.len()), requests.as_mut_ptr(), ffi::RSMPI_STATUSES_IGNORE)
    });
}
