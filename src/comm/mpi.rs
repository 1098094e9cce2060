//! Ranks that are MPI processes, started by `mpirun`, `srun` or the like.
//!
//! MPI is initialised only under such a launcher: alone it would cost a third of a second and start a daemon. Patterns of
//! messages are persistent requests; all else is a handful of collectives and one message for each neighbour. Only the thread
//! that has initialised MPI calls it.
//!
//! A rank that panics aborts all: otherwise the others would wait for it for ever.

use super::Halo;
use ::mpi::environment::{Threading, Universe};
use ::mpi::ffi;
use ::mpi::raw::AsRaw;
use ::mpi::topology::SimpleCommunicator;
use bytemuck::Pod;
use std::cell::Cell;
use std::os::raw::{c_int, c_void};
use std::process;
use std::ptr;
use std::sync::Arc;

/// Exit code of all ranks after the panic of one.
const PANICKED: c_int = 101;

/// Tag of [`MpiComm::exchange`]; patterns have the tags above.
const POST: c_int = 0;

/// MPI, until the last communicator and pattern are gone.
struct Session {
    world: SimpleCommunicator,
    /// Dropped last: this ends MPI.
    _universe: Universe,
}

// SAFETY: MPI is used by the thread that has initialised it alone; the session is shared by what this thread holds. The
// bounds are those of a trait whose other implementations do move between threads.
unsafe impl Send for Session {}
// SAFETY: as above.
unsafe impl Sync for Session {}

/// One of several ranks that are processes of an MPI job.
pub struct MpiComm {
    session: Arc<Session>,
    rank: usize,
    size: usize,
    plans: Cell<c_int>,
}

/// Panics if MPI reports a failure; its default is to end the job before that.
fn done(code: c_int) {
    assert_eq!(code, 0, "an MPI call failed");
}

fn count(length: usize) -> c_int {
    c_int::try_from(length).expect("a message of less than 2 GiB")
}

/// Where bytes begin. An empty vector has the address 1, which in Open MPI is `MPI_IN_PLACE`.
fn start(bytes: &[u8]) -> *const c_void {
    if bytes.is_empty() {
        ptr::null()
    } else {
        bytes.as_ptr().cast()
    }
}

/// Where bytes are to go, as [`start`].
fn start_mut(bytes: &mut [u8]) -> *mut c_void {
    if bytes.is_empty() {
        ptr::null_mut()
    } else {
        bytes.as_mut_ptr().cast()
    }
}

impl MpiComm {
    /// The ranks of the job this process is one of. To be called once, by the thread that will do the work.
    ///
    /// # Panics
    /// If MPI runs already.
    pub fn world() -> Self {
        let (universe, _) =
            ::mpi::initialize_with_threading(Threading::Funneled).expect("MPI is not running yet");
        let world = universe.world();
        let session = Arc::new(Session {
            world,
            _universe: universe,
        });
        let mut comm = Self {
            session,
            rank: 0,
            size: 0,
            plans: Cell::new(POST),
        };
        let (mut rank, mut size) = (0, 0);
        // SAFETY: the communicator is alive, and the numbers are there to be set.
        unsafe {
            done(ffi::MPI_Comm_rank(comm.raw(), &raw mut rank));
            done(ffi::MPI_Comm_size(comm.raw(), &raw mut size));
        }
        (comm.rank, comm.size) = (rank as usize, size as usize);
        let before = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |information| {
            before(information);
            abort(PANICKED);
        }));
        comm
    }

    /// Another handle for collectives of the same ranks. Only one of both may make patterns.
    #[must_use]
    pub fn twin(&self) -> Self {
        Self {
            session: self.session.clone(),
            plans: Cell::new(POST),
            ..*self
        }
    }

    fn raw(&self) -> ffi::MPI_Comm {
        self.session.world.as_raw()
    }

    pub(super) fn rank(&self) -> usize {
        self.rank
    }

    pub(super) fn size(&self) -> usize {
        self.size
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
        let length = count(bytes.len());
        let mut lengths = vec![0; self.size];
        // SAFETY: one number goes out, and one from every rank comes in.
        done(unsafe {
            ffi::MPI_Allgather(
                (&raw const length).cast(),
                1,
                ffi::RSMPI_INT32_T,
                lengths.as_mut_ptr().cast(),
                1,
                ffi::RSMPI_INT32_T,
                self.raw(),
            )
        });
        let (starts, total) = places(&lengths);
        let mut all = vec![0_u8; total];
        // SAFETY: every rank has a place of its length in the array.
        done(unsafe {
            ffi::MPI_Allgatherv(
                start(bytes),
                length,
                ffi::RSMPI_UINT8_T,
                start_mut(&mut all),
                lengths.as_ptr(),
                starts.as_ptr(),
                ffi::RSMPI_UINT8_T,
                self.raw(),
            )
        });
        split(&all, &lengths)
    }

    pub(super) fn gather(&self, bytes: &[u8]) -> Vec<Vec<u8>> {
        let length = count(bytes.len());
        let mut lengths = vec![0; if self.rank == 0 { self.size } else { 0 }];
        // SAFETY: one number goes out, and one from every rank comes in on rank 0, where there is room.
        done(unsafe {
            ffi::MPI_Gather(
                (&raw const length).cast(),
                1,
                ffi::RSMPI_INT32_T,
                lengths.as_mut_ptr().cast(),
                1,
                ffi::RSMPI_INT32_T,
                0,
                self.raw(),
            )
        });
        let (starts, total) = places(&lengths);
        let mut all = vec![0_u8; total];
        // SAFETY: every rank has a place of its length in the array of rank 0.
        done(unsafe {
            ffi::MPI_Gatherv(
                start(bytes),
                length,
                ffi::RSMPI_UINT8_T,
                start_mut(&mut all),
                lengths.as_ptr(),
                starts.as_ptr(),
                ffi::RSMPI_UINT8_T,
                0,
                self.raw(),
            )
        });
        split(&all, &lengths)
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
        // SAFETY: the status is filled by the probe before it is read, and the buffer has the length it tells; messages of
        // one peer do not overtake each other.
        unsafe {
            let mut status = std::mem::zeroed::<ffi::MPI_Status>();
            done(ffi::MPI_Probe(count(peer), POST, self.raw(), &raw mut status));
            done(ffi::MPI_Get_count(
                &raw const status,
                ffi::RSMPI_UINT8_T,
                &raw mut length,
            ));
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

    pub(super) fn halo<T: Pod + Send>(&self, peers: &[usize], lengths: &[usize]) -> Box<dyn Halo<T>> {
        self.plans.set(self.plans.get() + 1);
        Box::new(MpiHalo::<T>::new(self, self.plans.get(), peers, lengths))
    }
}

/// Ends all ranks of the job.
pub fn abort(code: i32) -> ! {
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

/// Starts of parts of these lengths, and the length of all.
fn places(lengths: &[c_int]) -> (Vec<c_int>, usize) {
    let mut starts = Vec::with_capacity(lengths.len());
    let mut total = 0_usize;
    for &length in lengths {
        starts.push(count(total));
        total += length as usize;
    }
    (starts, total)
}

fn split(all: &[u8], lengths: &[c_int]) -> Vec<Vec<u8>> {
    let mut rest = all;
    lengths
        .iter()
        .map(|&length| {
            let (part, after) = rest.split_at(length as usize);
            rest = after;
            part.to_vec()
        })
        .collect()
}

fn wait_all(requests: &mut [ffi::MPI_Request]) {
    // SAFETY: the requests are alive, and their statuses not wanted.
    done(unsafe {
        ffi::MPI_Waitall(
            count(requests.len()),
            requests.as_mut_ptr(),
            ffi::RSMPI_STATUSES_IGNORE,
        )
    });
}

/// Persistent requests. The buffers are boxed, so that they stay where MPI knows them to be.
struct MpiHalo<T> {
    outgoing: Vec<Box<[T]>>,
    incoming: Vec<Box<[T]>>,
    requests: Vec<ffi::MPI_Request>,
    /// Lives at least as long as the requests.
    _session: Arc<Session>,
}

// SAFETY: as for the session.
unsafe impl<T: Send> Send for MpiHalo<T> {}

impl<T: Pod> MpiHalo<T> {
    fn new(comm: &MpiComm, plan: c_int, peers: &[usize], lengths: &[usize]) -> Self {
        let buffers = || -> Vec<Box<[T]>> {
            lengths
                .iter()
                .map(|&length| vec![T::zeroed(); length].into_boxed_slice())
                .collect()
        };
        let (mut outgoing, mut incoming) = (buffers(), buffers());
        // SAFETY: a null request is a value that the library gives.
        let mut requests = vec![unsafe { ffi::RSMPI_REQUEST_NULL }; 2 * peers.len()];
        let (receives, sends) = requests.split_at_mut(peers.len());
        for (link, &peer) in peers.iter().enumerate() {
            let bytes = count(lengths[link] * size_of::<T>());
            // SAFETY: the buffers are boxed and live as long as the requests, which are freed before them.
            unsafe {
                done(ffi::MPI_Recv_init(
                    incoming[link].as_mut_ptr().cast(),
                    bytes,
                    ffi::RSMPI_UINT8_T,
                    count(peer),
                    plan,
                    comm.raw(),
                    &raw mut receives[link],
                ));
                done(ffi::MPI_Send_init(
                    outgoing[link].as_mut_ptr().cast_const().cast(),
                    bytes,
                    ffi::RSMPI_UINT8_T,
                    count(peer),
                    plan,
                    comm.raw(),
                    &raw mut sends[link],
                ));
            }
        }
        Self {
            outgoing,
            incoming,
            requests,
            _session: comm.session.clone(),
        }
    }
}

impl<T: Pod + Send> Halo<T> for MpiHalo<T> {
    fn send(&mut self, link: usize) -> &mut [T] {
        &mut self.outgoing[link]
    }

    fn exchange(&mut self) {
        // SAFETY: the requests are persistent, complete, and their buffers in place.
        done(unsafe { ffi::MPI_Startall(count(self.requests.len()), self.requests.as_mut_ptr()) });
        wait_all(&mut self.requests);
    }

    fn received(&self, link: usize) -> &[T] {
        &self.incoming[link]
    }
}

impl<T> Drop for MpiHalo<T> {
    fn drop(&mut self) {
        for request in &mut self.requests {
            // SAFETY: a complete persistent request, freed once, while MPI runs: the session is still alive.
            unsafe { ffi::MPI_Request_free(request) };
        }
    }
}
