//! Messages between ranks, behind one contract for every transport.
//!
//! A rank owns one block. All calls are collective unless said otherwise: every rank makes the same calls in the same
//! order. If a rank panics, the others panic out of their waits, or are ended, instead of hanging.

mod fetch;
#[cfg(feature = "mpi")]
mod mpi;
mod parts;
mod records;
#[cfg(test)]
mod tests;
mod threads;
mod traffic;

use crate::error::{Error, Result};
use crate::memory;
use bytemuck::Pod;
pub use fetch::Fetched;
#[cfg(feature = "mpi")]
pub use mpi::{MpiComm, abort};
pub use parts::SavedParts;
use std::sync::Arc;
pub use threads::{ThreadComm, on_threads, try_on_threads};
use traffic::Counters;
pub use traffic::{Tally, Traffic};

/// A process started by an MPI launcher, from its environment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Launched {
    /// Number of this process.
    pub rank: usize,
    /// Number of processes.
    pub size: usize,
    /// Number of those on this machine; all of them if the launcher does not say.
    pub here: usize,
}

/// Rank and size that an MPI launcher gives this process; `None` without a launcher.
pub fn launched() -> Option<Launched> {
    // Open MPI; MPICH and Intel MPI; srun with PMIx.
    const NAMES: [[&str; 4]; 3] = [
        [
            "OMPI_COMM_WORLD_RANK",
            "OMPI_COMM_WORLD_RANK",
            "OMPI_COMM_WORLD_SIZE",
            "OMPI_COMM_WORLD_LOCAL_SIZE",
        ],
        ["PMI_RANK", "PMI_RANK", "PMI_SIZE", "MPI_LOCALNRANKS"],
        ["PMIX_RANK", "SLURM_PROCID", "SLURM_NTASKS", "SLURM_NTASKS_PER_NODE"],
    ];
    let number = |name: &str| std::env::var(name).ok()?.parse().ok();
    NAMES.iter().find_map(|[mark, rank, size, here]| {
        std::env::var_os(mark)?;
        Some(Launched {
            rank: number(rank)?,
            size: number(size)?,
            here: number(here).or_else(|| number(size))?,
        })
    })
}

/// Common part of the transports of several ranks, see the methods of [`Comm`].
trait Transport {
    fn rank(&self) -> usize;
    fn size(&self) -> usize;
    fn counters(&self) -> &Arc<Counters>;
    fn barrier(&self);
    fn sum(&self, values: &mut [i64]);
    fn max(&self, values: &mut [f64]);
    fn all_gather(&self, bytes: Vec<u8>) -> Vec<Vec<u8>>;
    fn gather(&self, bytes: Vec<u8>) -> Vec<Vec<u8>>;
    fn exchange(&self, peers: &[usize], messages: Vec<Vec<u8>>) -> Vec<Vec<u8>>;
    fn route(&self, messages: Vec<Routed>) -> Vec<Routed>;
}

/// A message of [`Comm::route`], with the rank that it goes to or comes from.
pub type Routed = (usize, Vec<u8>);

/// The messages of a [`Halo`], which makes sure that buffers are used only while nothing is under way.
trait Pattern<T>: Send {
    fn send(&mut self, link: usize) -> &mut [T];
    fn start(&mut self);
    /// Lets a transport without its own thread move data.
    fn progress(&mut self) {}
    fn finish(&mut self);
    fn received(&self, link: usize) -> &[T];
}

/// A fixed pattern of messages, at most one per ordered pair of ranks, repeated every step.
///
/// Fill all of [`send`](Self::send), then [`start`](Self::start), do other work, [`finish`](Self::finish), read
/// [`received`](Self::received). Buffers are out of reach between start and finish. After an exchange the send
/// buffers hold stale data and must be overwritten wholly. Several patterns may be under way at once, if every rank
/// starts and finishes them in the same order.
pub struct Halo<T> {
    pattern: Box<dyn Pattern<T>>,
    /// Messages to other ranks, and bytes in them, of each exchange.
    sent: [usize; 2],
    counters: Arc<Counters>,
    under_way: bool,
}

impl<T> Halo<T> {
    fn assert_at_rest(&self) {
        assert!(!self.under_way, "the messages of this pattern are on their way");
    }

    /// Buffer for the message to `peers[link]`, of the length agreed at creation.
    ///
    /// # Panics
    /// Between start and finish.
    pub fn send(&mut self, link: usize) -> &mut [T] {
        self.assert_at_rest();
        self.pattern.send(link)
    }

    /// Sends all messages, which travel while the caller works.
    pub fn start(&mut self) {
        self.assert_at_rest();
        self.under_way = true;
        self.counters.halo.add(self.sent[0], self.sent[1]);
        self.counters.halo.time(|| self.pattern.start());
    }

    /// Lets a transport without its own thread move data; between start and finish.
    pub fn progress(&mut self) {
        if self.under_way {
            self.counters.halo.time(|| self.pattern.progress());
        }
    }

    /// Waits for all messages that are due.
    pub fn finish(&mut self) {
        self.counters.halo.time(|| self.pattern.finish());
        self.under_way = false;
    }

    /// The message from `peers[link]`.
    ///
    /// # Panics
    /// Between start and finish.
    pub fn received(&self, link: usize) -> &[T] {
        self.assert_at_rest();
        self.pattern.received(link)
    }

    /// Sends all messages and waits for all that are due.
    pub fn exchange(&mut self) {
        self.start();
        self.finish();
    }
}

/// Connects a rank to the others.
pub enum Comm {
    /// The only rank.
    Solo,
    /// One of several ranks that are threads of this process.
    Threads(ThreadComm),
    /// One of several ranks that are processes of an MPI job.
    #[cfg(feature = "mpi")]
    Mpi(MpiComm),
}

impl Comm {
    fn transport(&self) -> Option<&dyn Transport> {
        match self {
            Self::Solo => None,
            Self::Threads(comm) => Some(comm),
            #[cfg(feature = "mpi")]
            Self::Mpi(comm) => Some(comm),
        }
    }

    /// Number of this rank, `0 <= rank < size`.
    pub fn rank(&self) -> usize {
        self.transport().map_or(0, Transport::rank)
    }

    /// Number of ranks.
    pub fn size(&self) -> usize {
        self.transport().map_or(1, Transport::size)
    }

    /// Messages and bytes that this rank has sent since it began. Not collective.
    pub fn traffic(&self) -> Traffic {
        self.transport().map_or_else(Traffic::default, |transport| transport.counters().traffic())
    }

    /// Counts and times a collective call with this number of bytes, if there are several ranks.
    fn collective<R>(&self, bytes: usize, call: impl FnOnce(&dyn Transport) -> R) -> Option<R> {
        let transport = self.transport()?;
        let counter = &transport.counters().collective;
        counter.add(1, bytes);
        Some(counter.time(|| call(transport)))
    }

    /// Number of ranks in this process: all, or one if they are processes.
    pub fn ranks_per_process(&self) -> usize {
        match self {
            Self::Solo | Self::Threads(_) => self.size(),
            #[cfg(feature = "mpi")]
            Self::Mpi(_) => 1,
        }
    }

    /// Waits until every rank is here.
    pub fn barrier(&self) {
        self.collective(0, |transport| transport.barrier());
    }

    /// Replaces `values` by their (wrapping) sums over all ranks; `values.len()` is the same on every rank.
    pub fn sum(&self, values: &mut [i64]) {
        self.collective(size_of_val(values), |transport| transport.sum(values));
    }

    /// Replaces `values` by their maxima over all ranks.
    pub fn max(&self, values: &mut [f64]) {
        self.collective(size_of_val(values), |transport| transport.max(values));
    }

    /// Returns true on all ranks if the argument is true on any rank.
    pub fn any(&self, so: bool) -> bool {
        let mut ranks = [i64::from(so)];
        self.sum(&mut ranks);
        ranks[0] > 0
    }

    /// Agrees on an operation that every rank does for itself: the result if all have succeeded; else the error of
    /// this rank, or [`Error::OtherRank`].
    ///
    /// # Errors
    /// On every rank, if one of them has failed.
    pub fn agree<R>(&self, result: Result<R>) -> Result<R> {
        let any = self.any(result.is_err());
        result.and_then(|result| if any { Err(Error::OtherRank) } else { Ok(result) })
    }

    /// The result of this rank if all have succeeded; else, on every rank, the words of the lowest one that has failed.
    ///
    /// # Errors
    /// These words.
    pub fn agree_words<R>(&self, result: std::result::Result<R, String>) -> std::result::Result<R, String> {
        if !self.any(result.is_err()) {
            return result;
        }
        let words = self.all_gather(result.err().unwrap_or_default().into_bytes());
        let first = words.into_iter().find(|words| !words.is_empty()).unwrap_or_default();
        Err(String::from_utf8_lossy(&first).into_owned())
    }

    /// Everybody's bytes, by rank.
    pub fn all_gather(&self, bytes: Vec<u8>) -> Vec<Vec<u8>> {
        if matches!(self, Self::Solo) {
            return vec![bytes];
        }
        self.collective(bytes.len(), |transport| transport.all_gather(bytes)).unwrap_or_default()
    }

    /// Everybody's bytes by rank, on rank 0; an empty list elsewhere.
    pub fn gather(&self, bytes: Vec<u8>) -> Vec<Vec<u8>> {
        if matches!(self, Self::Solo) {
            return vec![bytes];
        }
        self.collective(bytes.len(), |transport| transport.gather(bytes)).unwrap_or_default()
    }

    /// Everybody's value, by rank; `None` if ranks are in other processes.
    pub(crate) fn share<T: Send + Sync + 'static>(&self, value: Arc<T>) -> Option<Vec<Arc<T>>> {
        let all = match self {
            Self::Solo => vec![value],
            Self::Threads(comm) => comm.share(value),
            #[cfg(feature = "mpi")]
            Self::Mpi(_) => vec![value],
        };
        (all.len() == self.size()).then_some(all)
    }

    /// Sends `messages[i]` to `peers[i]` and returns what `peers[i]` sent here.
    ///
    /// The relation is mutual (if a is a peer of b then b is a peer of a) and `peers` has no duplicate and not this
    /// rank.
    pub fn exchange(&self, peers: &[usize], messages: Vec<Vec<u8>>) -> Vec<Vec<u8>> {
        assert_eq!(peers.len(), messages.len());
        let Some(transport) = self.transport() else {
            return Vec::new();
        };
        let counter = &transport.counters().exchange;
        counter.add(messages.len(), messages.iter().map(Vec::len).sum());
        counter.time(|| transport.exchange(peers, messages))
    }

    /// Sends each message to its rank, at most one to each, and returns those sent here with their senders, ascending: for ranks that do not
    /// know who sends to them. What a rank sends to itself is not copied.
    ///
    /// Costs a sum over all ranks, of a number for each, besides the messages.
    pub fn route(&self, mut messages: Vec<Routed>) -> Vec<Routed> {
        let Some(transport) = self.transport() else {
            return messages;
        };
        let own = messages.iter().position(|(to, _)| *to == self.rank()).map(|at| messages.swap_remove(at));
        let counters = transport.counters();
        counters.collective.add(1, size_of::<u64>() * self.size());
        counters.exchange.add(messages.len(), messages.iter().map(|(_, message)| message.len()).sum());
        let mut received = counters.exchange.time(|| transport.route(messages));
        received.extend(own);
        received.sort_unstable_by_key(|&(from, _)| from);
        received
    }

    /// A copy of the communicator of these ranks for a library that uses MPI itself, as a handle of Fortran's, which every language
    /// has; the same in each call. None if the ranks are no processes. Collective.
    pub fn duplicate(&self) -> Option<i32> {
        match self {
            #[cfg(feature = "mpi")]
            Self::Mpi(comm) => Some(comm.duplicate()),
            _ => None,
        }
    }

    /// Sets up a fixed pattern: message lengths `lengths[i]` with `peers[i]`, in both directions. A rank may be its
    /// own peer.
    ///
    /// # Errors
    /// [`Error::Memory`] on a rank that has no room for the buffers; then no rank may [start](Halo::start) the pattern.
    pub fn halo<T: Pod + Send>(&self, peers: &[usize], lengths: &[usize]) -> Result<Halo<T>> {
        assert_eq!(peers.len(), lengths.len());
        let others = || peers.iter().zip(lengths).filter(|(peer, _)| **peer != self.rank());
        Ok(Halo {
            pattern: match self {
                Self::Solo => ThreadComm::solo().pattern(peers, lengths)?,
                Self::Threads(comm) => comm.pattern(peers, lengths)?,
                #[cfg(feature = "mpi")]
                Self::Mpi(comm) => comm.pattern(peers, lengths)?,
            },
            sent: [others().count(), others().map(|(_, length)| length * size_of::<T>()).sum()],
            counters: self.transport().map_or_else(Arc::default, |transport| transport.counters().clone()),
            under_way: false,
        })
    }
}

/// Zeroed buffers of these lengths.
fn buffers<T: Pod>(lengths: &[usize]) -> Result<Vec<Vec<T>>> {
    let zeroed = |&length: &usize| memory::zeroed(length, "the messages between neighbouring blocks");
    lengths.iter().map(zeroed).collect()
}
