//! Patterns of messages as persistent requests of MPI.

use super::{MpiComm, Turn, count, done, wait_all};
use crate::comm::{Pattern, buffers};
use crate::error::Result;
use ::mpi::ffi;
use bytemuck::Pod;
use std::os::raw::{c_int, c_void};
use std::ptr::{self, NonNull};
use std::slice;
use std::sync::Arc;

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
pub(super) struct MpiPattern<T> {
    outgoing: Vec<Shared<T>>,
    incoming: Vec<Shared<T>>,
    requests: Vec<ffi::MPI_Request>,
    /// Ends after the requests.
    _turn: Arc<Turn>,
}

// SAFETY: the requests name buffers that move with them; whoever has them has the turn to call MPI.
unsafe impl<T: Send> Send for MpiPattern<T> {}

impl<T: Pod> MpiPattern<T> {
    pub(super) fn new(comm: &MpiComm, plan: c_int, peers: &[usize], lengths: &[usize]) -> Result<Self> {
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
        Ok(Self { outgoing, incoming, requests, _turn: comm.turn.clone() })
    }
}

impl<T: Pod + Send> Pattern<T> for MpiPattern<T> {
    fn send(&mut self, link: usize) -> &mut [T] {
        // SAFETY: nothing is under way, and `start`, which ends the borrow, lets MPI begin.
        unsafe { self.outgoing[link].get_mut() }
    }

    fn start(&mut self) {
        let requests = &mut self.requests;
        // SAFETY: the requests are persistent, complete, and their buffers in place and out of reach until they are
        // complete again.
        done(unsafe { ffi::MPI_Startall(count(requests.len()), requests.as_mut_ptr()) });
    }

    fn progress(&mut self) {
        let (requests, mut all) = (&mut self.requests, 0);
        // SAFETY: the requests are alive, and may be complete; their statuses are not needed.
        done(unsafe {
            ffi::MPI_Testall(
                count(requests.len()),
                requests.as_mut_ptr(),
                &raw mut all,
                ffi::RSMPI_STATUSES_IGNORE,
            )
        });
    }

    fn finish(&mut self) {
        wait_all(&mut self.requests);
    }

    fn received(&self, link: usize) -> &[T] {
        // SAFETY: nothing is under way, and `start`, which ends the borrow, lets MPI begin.
        unsafe { self.incoming[link].get() }
    }
}

impl<T> Drop for MpiPattern<T> {
    fn drop(&mut self) {
        // Returns at once for requests that are not under way.
        wait_all(&mut self.requests);
        for request in &mut self.requests {
            // SAFETY: a complete persistent request, freed once, while MPI runs: it ends with the process.
            unsafe { ffi::MPI_Request_free(request) };
        }
    }
}
