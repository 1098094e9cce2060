//! Patterns of messages as persistent requests of MPI.

use super::{MpiComm, Ranks, count};
use crate::comm::{Pattern, buffers};
use crate::error::Result;
use ::mpi::traits::AsRaw;
use ::mpi::{environment, ffi};
use bytemuck::Pod;
use std::os::raw::c_int;
use std::sync::Arc;

/// Panics if MPI reports a failure; its default is to end the job before that.
fn done(code: c_int) {
    assert_eq!(code, 0, "an MPI call failed");
}

fn wait_all(requests: &mut [ffi::MPI_Request]) {
    // SAFETY: the requests are alive, and their statuses not needed.
    done(unsafe {
        ffi::MPI_Waitall(count(requests.len()), requests.as_mut_ptr(), ffi::RSMPI_STATUSES_IGNORE)
    });
}

/// Persistent requests, and the buffers that they name. The requests end first: see `drop`.
///
/// MPI reads and writes the buffers through the addresses it was once given; a slice of them lives only between
/// transfers, which [`Halo`](crate::comm::Halo) asserts.
pub(super) struct MpiPattern<T> {
    outgoing: Vec<Vec<T>>,
    incoming: Vec<Vec<T>>,
    requests: Vec<ffi::MPI_Request>,
    /// Ends after the requests.
    _ranks: Arc<Ranks>,
}

// SAFETY: the requests name buffers that move with them; whoever has them may call MPI.
unsafe impl<T: Send> Send for MpiPattern<T> {}

impl<T: Pod> MpiPattern<T> {
    pub(super) fn new(comm: &MpiComm, plan: c_int, peers: &[usize], lengths: &[usize]) -> Result<Self> {
        let (mut outgoing, mut incoming) = (buffers::<T>(lengths)?, buffers::<T>(lengths)?);
        // SAFETY: a null request is a value that the library gives.
        let mut requests = vec![unsafe { ffi::RSMPI_REQUEST_NULL }; 2 * peers.len()];
        let (receives, sends) = requests.split_at_mut(peers.len());
        for (link, &peer) in peers.iter().enumerate() {
            let bytes = count(lengths[link] * size_of::<T>());
            // SAFETY: the buffers stay where they are and live as long as the requests, which are freed before them.
            unsafe {
                done(ffi::MPI_Recv_init(
                    incoming[link].as_mut_ptr().cast(),
                    bytes,
                    ffi::RSMPI_UINT8_T,
                    count(peer),
                    plan,
                    comm.ranks().as_raw(),
                    &raw mut receives[link],
                ));
                done(ffi::MPI_Send_init(
                    outgoing[link].as_mut_ptr().cast_const().cast(),
                    bytes,
                    ffi::RSMPI_UINT8_T,
                    count(peer),
                    plan,
                    comm.ranks().as_raw(),
                    &raw mut sends[link],
                ));
            }
        }
        Ok(Self { outgoing, incoming, requests, _ranks: comm.ranks.clone() })
    }
}

impl<T: Pod + Send> Pattern<T> for MpiPattern<T> {
    fn send(&mut self, link: usize) -> &mut [T] {
        &mut self.outgoing[link]
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
        &self.incoming[link]
    }
}

impl<T> Drop for MpiPattern<T> {
    fn drop(&mut self) {
        // A caller may have ended MPI, and with it the requests.
        if environment::is_finalized() {
            return;
        }
        // Returns at once for requests that are not under way.
        wait_all(&mut self.requests);
        for request in &mut self.requests {
            // SAFETY: a complete persistent request, freed once, while MPI runs.
            unsafe { ffi::MPI_Request_free(request) };
        }
    }
}
