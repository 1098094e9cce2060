//! Ranks that are MPI processes, started by `mpirun`, `srun` or the like.
//!
//! MPI is initialised only under such a launcher: alone it would cost a third of a second and start a daemon.
//! Patterns of messages are persistent requests; everything else is a few collectives and one message for each
//! neighbour. One thread at a time calls MPI: the one that has the [`MpiComm`]. MPI runs from the first of them to
//! the exit of the process, since it cannot be started twice.
//!
//! A rank that panics aborts all, because the others would wait for it for ever.

use super::traffic::Counters;
use super::{Halo, UNDER_WAY, buffers, sent};
use crate::error::Result;
use ::mpi::environment::Threading;
use ::mpi::ffi;
use bytemuck::Pod;
use std::cell::Cell;
use std::os::raw::{c_int, c_void};
use std::process;
use std::ptr::{self, NonNull};
use std::slice;
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

    pub(super) fn counters(&self) -> &Counters {
        &self.counters
    }

    pub(super) fn barrier(&self) {
        // SAFETY: the communicator is alive.
        done(unsafe { ffi::MPI_Barrier(self.raw()) });
    }

    pub(super) fn sum(&self, values: &mut [i64]) {
        let mine = values.to_vec();
        // Unsigned integers wrap.
        // SAFETY: both arrays have that many numbers of 64 bits, the same on every rank.
        done(unsafe {
            ffi::MPI_Allreduce(
                mine.as_ptr().cast(),
                values.as_mut_ptr().cast(),
                count(mine.len()),
                ffi::RSMPI_UINT64_T,
                ffi::RSMPI_SUM,
                self.raw(),
            )
        });
    }

    pub(super) fn max(&self, values: &mut [f64]) {
        let mine = values.to_vec();
        // SAFETY: both arrays have that many numbers, the same on every rank.
        done(unsafe {
            ffi::MPI_Allreduce(
                mine.as_ptr().cast(),
                values.as_mut_ptr().cast(),
                count(mine.len()),
                ffi::RSMPI_DOUBLE,
                ffi::RSMPI_MAX,
                self.raw(),
            )
        });
    }

    pub(super) fn all_gather(&self, bytes: &[u8]) -> Vec<Vec<u8>> {
        let lengths = self.lengths(bytes);
        let Some((counts, starts)) = places(&lengths, self.limit) else {
            return self.all_gather_much(bytes, &lengths);
        };
        let mut all = vec![0_u8; lengths.iter().sum()];
        // SAFETY: every rank has a part of its length in the array.
        done(unsafe {
            ffi::MPI_Allgatherv(
                start(bytes),
                count(bytes.len()),
                ffi::RSMPI_UINT8_T,
                start_mut(&mut all),
                counts.as_ptr(),
                starts.as_ptr(),
                ffi::RSMPI_UINT8_T,
                self.raw(),
            )
        });
        split(&all, &lengths)
    }

    pub(super) fn gather(&self, bytes: &[u8]) -> Vec<Vec<u8>> {
        let lengths = self.lengths(bytes);
        let Some((counts, starts)) = places(&lengths, self.limit) else {
            return self.gather_much(bytes, &lengths);
        };
        let first = self.rank == 0;
        let mut all = vec![0_u8; if first { lengths.iter().sum() } else { 0 }];
        // SAFETY: every rank has a part of its length in the array of rank 0.
        done(unsafe {
            ffi::MPI_Gatherv(
                start(bytes),
                count(bytes.len()),
                ffi::RSMPI_UINT8_T,
                start_mut(&mut all),
                counts.as_ptr(),
                starts.as_ptr(),
                ffi::RSMPI_UINT8_T,
                0,
                self.raw(),
            )
        });
        split(&all, if first { &lengths } else { &[] })
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

    /// As [`all_gather`](Self::all_gather), for any amount: every rank in turn shows its bytes, piece by piece.
    fn all_gather_much(&self, bytes: &[u8], lengths: &[usize]) -> Vec<Vec<u8>> {
        let mut all: Vec<Vec<u8>> = (lengths.iter().enumerate())
            .map(|(rank, &length)| if rank == self.rank { bytes.to_vec() } else { vec![0; length] })
            .collect();
        for (rank, part) in all.iter_mut().enumerate() {
            for piece in part.chunks_mut(self.limit) {
                // SAFETY: the piece has the same length on every rank; it is read on that rank and written on the
                // others.
                done(unsafe {
                    ffi::MPI_Bcast(
                        piece.as_mut_ptr().cast(),
                        count(piece.len()),
                        ffi::RSMPI_UINT8_T,
                        count(rank),
                        self.raw(),
                    )
                });
            }
        }
        all
    }

    /// As [`gather`](Self::gather), for any amount: rank 0 takes the bytes of one rank after the other, piece by piece.
    fn gather_much(&self, bytes: &[u8], lengths: &[usize]) -> Vec<Vec<u8>> {
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
        let mut all = vec![bytes.to_vec()];
        for (peer, &length) in lengths.iter().enumerate().skip(1) {
            let mut part = Vec::with_capacity(length);
            while part.len() < length {
                part.extend(self.receive(peer));
            }
            all.push(part);
        }
        all
    }

    pub(super) fn exchange(&self, peers: &[usize], messages: &[Vec<u8>]) -> Vec<Vec<u8>> {
        // SAFETY: a null request is a value that the library gives.
        let mut requests = vec![unsafe { ffi::RSMPI_REQUEST_NULL }; peers.len()];
        for ((&peer, message), request) in peers.iter().zip(messages).zip(&mut requests) {
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

    pub(super) fn halo<T: Pod + Send>(&self, peers: &[usize], lengths: &[usize]) -> Result<Box<dyn Halo<T>>> {
        self.plans.set(self.plans.get() + 1);
        let halo = MpiHalo::<T>::new(self, self.plans.get(), peers, lengths)?;
        Ok(Box::new(halo))
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

/// Lengths and starts of parts of these lengths, unless all of them together have more than `limit` bytes.
fn places(lengths: &[usize], limit: usize) -> Option<(Vec<c_int>, Vec<c_int>)> {
    let mut starts = Vec::with_capacity(lengths.len());
    let mut total = 0_usize;
    for &length in lengths {
        starts.push(count(total));
        total = total.checked_add(length).filter(|&total| total <= limit)?;
    }
    Some((lengths.iter().map(|&length| count(length)).collect(), starts))
}

fn split(all: &[u8], lengths: &[usize]) -> Vec<Vec<u8>> {
    let mut rest = all;
    lengths
        .iter()
        .map(|&length| {
            let (part, after) = rest.split_at(length);
            rest = after;
            part.to_vec()
        })
        .collect()
}

fn wait_all(requests: &mut [ffi::MPI_Request]) {
    // SAFETY: the requests are alive, and their statuses not needed.
    done(unsafe {
        ffi::MPI_Waitall(count(requests.len()), requests.as_mut_ptr(), ffi::RSMPI_STATUSES_IGNORE)
    });
}

/// Memory that MPI reads and writes through the address it was once given: a reference to it lives only between
/// transfers, and derives from that address, so that none is made void by what MPI does.
struct Shared<T> {
    start: NonNull<T>,
    len: usize,
}

impl<T> Shared<T> {
    fn new(buffer: Vec<T>) -> Self {
        let buffer = Box::leak(buffer.into_boxed_slice());
        Self { len: buffer.len(), start: NonNull::from(buffer).cast() }
    }

    fn address(&self) -> *mut c_void {
        self.start.as_ptr().cast()
    }

    /// The numbers.
    ///
    /// # Safety
    /// MPI has no transfer to here under way, as long as the slice lives.
    unsafe fn get(&self) -> &[T] {
        // SAFETY: a buffer of this length begins there, and by the contract nobody writes to it.
        unsafe { slice::from_raw_parts(self.start.as_ptr(), self.len) }
    }

    /// As [`get`](Self::get), to write.
    ///
    /// # Safety
    /// MPI has no transfer from or to here under way, as long as the slice lives.
    unsafe fn get_mut(&mut self) -> &mut [T] {
        // SAFETY: a buffer of this length begins there, the borrow is unique, and by the contract MPI does not use it.
        unsafe { slice::from_raw_parts_mut(self.start.as_ptr(), self.len) }
    }
}

impl<T> Drop for Shared<T> {
    fn drop(&mut self) {
        let buffer = ptr::slice_from_raw_parts_mut(self.start.as_ptr(), self.len);
        // SAFETY: leaked by `new`, once, with this length.
        drop(unsafe { Box::from_raw(buffer) });
    }
}

/// Persistent requests, and the buffers that they name. The requests end first: see `drop`.
struct MpiHalo<T> {
    outgoing: Vec<Shared<T>>,
    incoming: Vec<Shared<T>>,
    requests: Vec<ffi::MPI_Request>,
    /// Messages to others, and bytes in them.
    sent: [usize; 2],
    counters: Arc<Counters>,
    /// MPI has the buffers.
    under_way: bool,
    /// Ends after the requests.
    _turn: Arc<Turn>,
}

// SAFETY: the requests name buffers that move with them; whoever has them has the turn to call MPI.
unsafe impl<T: Send> Send for MpiHalo<T> {}

impl<T: Pod> MpiHalo<T> {
    fn new(comm: &MpiComm, plan: c_int, peers: &[usize], lengths: &[usize]) -> Result<Self> {
        let shared = || -> Result<Vec<Shared<T>>> {
            let buffers = buffers(lengths)?.into_iter();
            Ok(buffers.map(Shared::new).collect())
        };
        let (outgoing, incoming) = (shared()?, shared()?);
        // SAFETY: a null request is a value that the library gives.
        let mut requests = vec![unsafe { ffi::RSMPI_REQUEST_NULL }; 2 * peers.len()];
        let (receives, sends) = requests.split_at_mut(peers.len());
        for (link, &peer) in peers.iter().enumerate() {
            let bytes = count(lengths[link] * size_of::<T>());
            // SAFETY: the buffers stay where they are and live as long as the requests, which are freed before them.
            unsafe {
                done(ffi::MPI_Recv_init(
                    incoming[link].address(),
                    bytes,
                    ffi::RSMPI_UINT8_T,
                    count(peer),
                    plan,
                    comm.raw(),
                    &raw mut receives[link],
                ));
                done(ffi::MPI_Send_init(
                    outgoing[link].address().cast_const(),
                    bytes,
                    ffi::RSMPI_UINT8_T,
                    count(peer),
                    plan,
                    comm.raw(),
                    &raw mut sends[link],
                ));
            }
        }
        Ok(Self {
            outgoing,
            incoming,
            requests,
            sent: sent::<T>(comm.rank, peers, lengths),
            counters: comm.counters.clone(),
            under_way: false,
            _turn: comm.turn.clone(),
        })
    }
}

impl<T: Pod + Send> Halo<T> for MpiHalo<T> {
    fn send(&mut self, link: usize) -> &mut [T] {
        assert!(!self.under_way, "{UNDER_WAY}");
        // SAFETY: nothing is under way, and `start`, which ends the borrow, lets MPI begin.
        unsafe { self.outgoing[link].get_mut() }
    }

    fn start(&mut self) {
        assert!(!self.under_way, "{UNDER_WAY}");
        self.under_way = true;
        self.counters.halo.add(self.sent[0], self.sent[1]);
        let requests = &mut self.requests;
        // SAFETY: the requests are persistent, complete, and their buffers in place and out of reach until they are
        // complete again.
        self.counters
            .halo
            .time(|| done(unsafe { ffi::MPI_Startall(count(requests.len()), requests.as_mut_ptr()) }));
    }

    fn progress(&mut self) {
        if !self.under_way {
            return;
        }
        let (requests, mut all) = (&mut self.requests, 0);
        self.counters.halo.time(|| {
            // SAFETY: the requests are alive, and may be complete; their statuses are not needed.
            done(unsafe {
                ffi::MPI_Testall(
                    count(requests.len()),
                    requests.as_mut_ptr(),
                    &raw mut all,
                    ffi::RSMPI_STATUSES_IGNORE,
                )
            });
        });
    }

    fn finish(&mut self) {
        let requests = &mut self.requests;
        self.counters.halo.time(|| wait_all(requests));
        self.under_way = false;
    }

    fn received(&self, link: usize) -> &[T] {
        assert!(!self.under_way, "{UNDER_WAY}");
        // SAFETY: nothing is under way, and `start`, which ends the borrow, lets MPI begin.
        unsafe { self.incoming[link].get() }
    }
}

impl<T> Drop for MpiHalo<T> {
    fn drop(&mut self) {
        if self.under_way {
            wait_all(&mut self.requests);
        }
        for request in &mut self.requests {
            // SAFETY: a complete persistent request, freed once, while MPI runs: it ends with the process.
            unsafe { ffi::MPI_Request_free(request) };
        }
    }
}
