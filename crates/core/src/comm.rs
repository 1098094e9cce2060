//! Messages between ranks, behind one contract for every transport.
//!
//! A rank owns one block and lives in its own thread. [`Comm::Solo`] is the only rank; [`Comm::Threads`] connects
//! the threads of one process by swapping buffers. All calls are collective unless said otherwise: every rank makes
//! the same calls in the same order. If a rank panics, the others panic out of their waits instead of hanging.

#[cfg(feature = "mpi")]
mod mpi;
mod threads;
mod traffic;

use crate::error::{Error, Result};
use crate::memory;
use bytemuck::Pod;
#[cfg(feature = "mpi")]
pub use mpi::{MpiComm, abort};
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

/// A fixed pattern of messages, at most one per ordered pair of ranks, repeated every step.
///
/// Fill all of [`send`](Self::send), then [`start`](Self::start), do other work, [`finish`](Self::finish), read
/// [`received`](Self::received). Buffers are out of reach between start and finish. After an exchange the send
/// buffers hold stale data and must be overwritten wholly. Several patterns may be under way at once, if every rank
/// starts and finishes them in the same order.
pub trait Halo<T>: Send {
    /// Buffer for the message to `peers[link]`, of the length agreed at creation.
    ///
    /// # Panics
    /// Between start and finish.
    fn send(&mut self, link: usize) -> &mut [T];
    /// Sends all messages, which travel while the caller works.
    fn start(&mut self);
    /// Lets a transport without its own thread move data; between start and finish.
    fn progress(&mut self) {}
    /// Waits for all messages that are due.
    fn finish(&mut self);
    /// The message from `peers[link]`.
    ///
    /// # Panics
    /// Between start and finish.
    fn received(&self, link: usize) -> &[T];
    /// Sends all messages and waits for all that are due.
    fn exchange(&mut self) {
        self.start();
        self.finish();
    }
}

/// Of calls between start and finish.
const UNDER_WAY: &str = "the messages of this pattern are on their way";

impl Comm {
    /// Number of this rank, `0 <= rank < size`.
    pub fn rank(&self) -> usize {
        match self {
            Self::Solo => 0,
            Self::Threads(comm) => comm.rank(),
            #[cfg(feature = "mpi")]
            Self::Mpi(comm) => comm.rank(),
        }
    }

    /// Number of ranks.
    pub fn size(&self) -> usize {
        match self {
            Self::Solo => 1,
            Self::Threads(comm) => comm.size(),
            #[cfg(feature = "mpi")]
            Self::Mpi(comm) => comm.size(),
        }
    }

    fn counters(&self) -> Option<&Counters> {
        match self {
            Self::Solo => None,
            Self::Threads(comm) => Some(comm.counters()),
            #[cfg(feature = "mpi")]
            Self::Mpi(comm) => Some(comm.counters()),
        }
    }

    /// Traffic of this rank so far.
    pub fn traffic(&self) -> Traffic {
        self.counters().map_or_else(Traffic::default, Counters::traffic)
    }

    /// A call of all ranks, counted, to which this rank contributes this number of bytes.
    fn collective<R>(&self, bytes: usize, call: impl FnOnce() -> R) -> R {
        match self.counters() {
            None => call(),
            Some(counters) => {
                counters.collective.add(1, bytes);
                counters.collective.time(call)
            }
        }
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
        self.collective(0, || match self {
            Self::Solo => {}
            Self::Threads(comm) => comm.barrier(),
            #[cfg(feature = "mpi")]
            Self::Mpi(comm) => comm.barrier(),
        });
    }

    /// Replaces `values` by their (wrapping) sums over all ranks; `values.len()` is the same on every rank.
    pub fn sum(&self, values: &mut [i64]) {
        self.collective(size_of_val(values), || match self {
            Self::Solo => {}
            Self::Threads(comm) => comm.sum(values),
            #[cfg(feature = "mpi")]
            Self::Mpi(comm) => comm.sum(values),
        });
    }

    /// Replaces `values` by their maxima over all ranks.
    pub fn max(&self, values: &mut [f64]) {
        self.collective(size_of_val(values), || match self {
            Self::Solo => {}
            Self::Threads(comm) => {
                for bytes in comm.all_gather(bytemuck::cast_slice(values).to_vec()) {
                    for (value, theirs) in
                        values.iter_mut().zip(bytemuck::pod_collect_to_vec::<u8, f64>(&bytes))
                    {
                        *value = value.max(theirs);
                    }
                }
            }
            #[cfg(feature = "mpi")]
            Self::Mpi(comm) => comm.max(values),
        });
    }

    /// Returns true on all ranks if the argument is true on any rank.
    pub fn any(&self, so: bool) -> bool {
        let mut ranks = [i64::from(so)];
        self.sum(&mut ranks);
        ranks[0] > 0
    }

    /// Agrees on an operation that every rank does for itself: the result if all have succeeded; else the error of
    /// this rank, or [`Error::OtherRank`]. Collective.
    ///
    /// # Errors
    /// On every rank, if one of them has failed.
    pub fn agree<R>(&self, result: Result<R>) -> Result<R> {
        let any = self.any(result.is_err());
        result.and_then(|result| if any { Err(Error::OtherRank) } else { Ok(result) })
    }

    /// Everybody's bytes, by rank.
    pub fn all_gather(&self, bytes: Vec<u8>) -> Vec<Vec<u8>> {
        self.collective(bytes.len(), || match self {
            Self::Solo => vec![bytes],
            Self::Threads(comm) => comm.all_gather(bytes),
            #[cfg(feature = "mpi")]
            Self::Mpi(comm) => comm.all_gather(&bytes),
        })
    }

    /// Everybody's bytes by rank, on rank 0; an empty list elsewhere.
    pub fn gather(&self, bytes: Vec<u8>) -> Vec<Vec<u8>> {
        self.collective(bytes.len(), || match self {
            Self::Solo => vec![bytes],
            Self::Threads(comm) => comm.gather(bytes),
            #[cfg(feature = "mpi")]
            Self::Mpi(comm) => comm.gather(&bytes),
        })
    }

    /// Sends `messages[i]` to `peers[i]` and returns what `peers[i]` sent here.
    ///
    /// The relation is mutual (if a is a peer of b then b is a peer of a) and `peers` has no duplicate and not this
    /// rank.
    pub fn exchange(&self, peers: &[usize], messages: Vec<Vec<u8>>) -> Vec<Vec<u8>> {
        assert_eq!(peers.len(), messages.len());
        let Some(counters) = self.counters() else {
            return Vec::new();
        };
        counters.exchange.add(messages.len(), messages.iter().map(Vec::len).sum());
        counters.exchange.time(|| match self {
            Self::Solo => Vec::new(),
            Self::Threads(comm) => comm.exchange(peers, messages),
            #[cfg(feature = "mpi")]
            Self::Mpi(comm) => comm.exchange(peers, &messages),
        })
    }

    /// Sets up a fixed pattern: message lengths `lengths[i]` with `peers[i]`, in both directions. A rank may be its
    /// own peer.
    ///
    /// # Errors
    /// [`Error::Memory`] on a rank that has no room for the buffers; then no rank may [start](Halo::start) the pattern.
    pub fn halo<T: Pod + Send>(&self, peers: &[usize], lengths: &[usize]) -> Result<Box<dyn Halo<T>>> {
        assert_eq!(peers.len(), lengths.len());
        match self {
            Self::Solo => Ok(Box::new(SoloHalo::<T>::new(lengths)?)),
            Self::Threads(comm) => comm.halo(peers, lengths),
            #[cfg(feature = "mpi")]
            Self::Mpi(comm) => comm.halo(peers, lengths),
        }
    }
}

/// Zeroed buffers of these lengths.
fn buffers<T: Pod>(lengths: &[usize]) -> Result<Vec<Vec<T>>> {
    let zeroed = |&length: &usize| memory::zeroed(length, "the messages between neighbouring blocks");
    lengths.iter().map(zeroed).collect()
}

/// Numbers of messages and bytes that a start of a pattern sends to others.
fn sent<T>(rank: usize, peers: &[usize], lengths: &[usize]) -> [usize; 2] {
    let others = || peers.iter().zip(lengths).filter(|(peer, _)| **peer != rank);
    [others().count(), others().map(|(_, length)| length * size_of::<T>()).sum()]
}

/// Messages of the only rank to itself.
struct SoloHalo<T> {
    outgoing: Vec<Vec<T>>,
    incoming: Vec<Vec<T>>,
    under_way: bool,
}

impl<T: Pod> SoloHalo<T> {
    fn new(lengths: &[usize]) -> Result<Self> {
        Ok(Self { outgoing: buffers(lengths)?, incoming: buffers(lengths)?, under_way: false })
    }
}

impl<T: Pod + Send> Halo<T> for SoloHalo<T> {
    fn send(&mut self, link: usize) -> &mut [T] {
        assert!(!self.under_way, "{UNDER_WAY}");
        &mut self.outgoing[link]
    }

    fn start(&mut self) {
        assert!(!self.under_way, "{UNDER_WAY}");
        self.under_way = true;
    }

    fn finish(&mut self) {
        std::mem::swap(&mut self.outgoing, &mut self.incoming);
        self.under_way = false;
    }

    fn received(&self, link: usize) -> &[T] {
        assert!(!self.under_way, "{UNDER_WAY}");
        &self.incoming[link]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicBool, Ordering};
    use std::time::Duration;

    /// The contract, on any transport.
    fn contract(comm: &Comm) {
        let (rank, size) = (comm.rank(), comm.size());
        let mut sums = [1, rank as i64, i64::MAX];
        comm.sum(&mut sums);
        let n = size as i64;
        assert_eq!(sums, [n, n * (n - 1) / 2, i64::MAX.wrapping_mul(n)]);
        assert!(comm.any(rank == size - 1) && !comm.any(false));
        let mut most = [rank as f64, -(rank as f64)];
        comm.max(&mut most);
        assert_eq!(most.map(|x| x as i64), [n - 1, 0]);
        let all = comm.all_gather(vec![rank as u8; rank]);
        assert!(all.iter().enumerate().all(|(r, bytes)| *bytes == vec![r as u8; r]) && all.len() == size);
        let gathered = comm.gather(vec![7, rank as u8]);
        assert_eq!(gathered.len(), if rank == 0 { size } else { 0 });
        assert!(gathered.iter().enumerate().all(|(r, bytes)| *bytes == [7, r as u8]));
        let peers: Vec<usize> = (0..size).filter(|&p| p != rank).collect();
        for round in 0..50_usize {
            let messages = peers.iter().map(|&p| vec![(rank * 16 + p) as u8; round % 3 * p]).collect();
            for (&peer, got) in peers.iter().zip(comm.exchange(&peers, messages)) {
                assert_eq!(got, vec![(peer * 16 + rank) as u8; round % 3 * rank]);
            }
        }
        let everybody: Vec<usize> = (0..size).collect();
        // The longest are too long for MPI to send before the receiver is ready.
        let lengths: Vec<usize> =
            everybody.iter().map(|&p| 3 + 40_000 * usize::from(p + rank == 1) + p + rank).collect();
        let (mut a, mut b) = (
            comm.halo::<f32>(&everybody, &lengths).unwrap(),
            comm.halo::<f64>(&everybody, &lengths).unwrap(),
        );
        for round in 0..100_u16 {
            for &peer in &everybody {
                a.send(peer).fill(f32::from(round) + peer as f32);
                b.send(peer).fill(f64::from(round) - rank as f64);
            }
            // Both under way at once, while other messages travel and this rank works.
            a.start();
            let mut ranks = [1];
            comm.sum(&mut ranks);
            b.start();
            for _ in 0..round % 4 {
                a.progress();
                b.progress();
            }
            let posted = comm.exchange(&peers, peers.iter().map(|&p| vec![p as u8; p]).collect());
            assert!(posted.iter().all(|got| *got == vec![rank as u8; rank]));
            if round % 2 == 0 {
                a.finish();
            }
            b.finish();
            if round % 2 == 1 {
                a.finish();
            }
            assert_eq!(ranks, [n]);
            for &peer in &everybody {
                assert_eq!(a.received(peer), vec![f32::from(round) + rank as f32; lengths[peer]]);
                assert_eq!(b.received(peer), vec![f64::from(round) - peer as f64; lengths[peer]]);
            }
        }
        // A pattern that is given up on its way leaves others alone.
        let mut given_up = comm.halo::<f32>(&everybody, &lengths).unwrap();
        given_up.start();
        given_up.progress();
        drop(given_up);
        a.exchange();
        comm.barrier();
    }

    /// Every call once, and its counts.
    fn traffic(comm: &Comm) {
        let (rank, size) = (comm.rank(), comm.size());
        let all: Vec<usize> = (0..size).collect();
        let others: Vec<usize> = (0..size).filter(|&p| p != rank).collect();
        let before = comm.traffic();
        let mut pattern = comm.halo::<f64>(&all, &vec![10; size]).unwrap();
        assert_eq!(comm.traffic() - before, Traffic::default());
        pattern.exchange();
        pattern.exchange();
        comm.exchange(&others, others.iter().map(|&p| vec![0; p]).collect());
        comm.sum(&mut [1, 2]);
        comm.max(&mut [1.0]);
        comm.any(false);
        comm.all_gather(vec![0; 5]);
        comm.gather(vec![0; 7]);
        comm.barrier();
        let traffic = comm.traffic() - before;
        let count = |tally: Tally| [tally.messages, tally.bytes].map(|n| n as usize);
        assert_eq!(count(traffic.halo), [2 * others.len(), 160 * others.len()]);
        assert_eq!(count(traffic.exchange), [others.len(), others.iter().sum()]);
        let calls = if size > 1 { [6, 16 + 8 + 8 + 5 + 7] } else { [0, 0] };
        assert_eq!(count(traffic.collective), calls);
    }

    #[test]
    fn every_message_to_another_rank_is_counted_once_with_its_bytes_on_1_to_4_ranks() {
        traffic(&Comm::Solo);
        for ranks in 2..=4 {
            on_threads(ranks, |comm| traffic(&comm));
        }
    }

    #[test]
    fn the_time_of_waiting_for_a_late_rank_is_counted_on_2_ranks() {
        let begun = AtomicBool::new(false);
        let waited = on_threads(2, |comm| {
            let mut pattern = comm.halo::<f32>(&[1 - comm.rank()], &[4]).unwrap();
            if comm.rank() == 0 {
                begun.store(true, Ordering::Release);
            } else {
                while !begun.load(Ordering::Acquire) {
                    std::thread::yield_now();
                }
                std::thread::sleep(Duration::from_millis(150));
            }
            pattern.exchange();
            comm.traffic().halo.seconds
        });
        // Less than the delay, for the machine may be busy.
        assert!(waited[0] > 0.05, "{waited:?}");
    }

    #[test]
    fn the_only_rank_keeps_the_contract() {
        contract(&Comm::Solo);
    }

    #[test]
    fn one_to_eight_thread_ranks_keep_the_contract() {
        for ranks in 1..=8 {
            on_threads(ranks, |comm| contract(&comm));
        }
    }

    /// Runs a test of this program that is ignored, on the ranks of an MPI job; the output and whether it passed.
    #[cfg(feature = "mpi")]
    fn under_mpirun(ranks: usize, test: &str) -> (bool, String) {
        let output = std::process::Command::new("timeout")
            .args(["--kill-after=5", "60", "mpirun", "-n", &ranks.to_string()])
            .arg(std::env::current_exe().unwrap())
            .args([test, "--exact", "--ignored", "--nocapture"])
            .envs([
                ("OMPI_ALLOW_RUN_AS_ROOT", "1"),
                ("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1"),
                ("OMPI_MCA_rmaps_base_oversubscribe", "1"),
                ("OMPI_MCA_mpi_yield_when_idle", "1"),
                ("OMPI_MCA_hwloc_base_binding_policy", "none"),
            ])
            .output()
            .expect("mpirun and timeout are there");
        let said = [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
        (output.status.success(), said.concat())
    }

    #[cfg(feature = "mpi")]
    #[test]
    #[ignore = "a rank of the test below"]
    fn as_an_mpi_rank() {
        // Two runs of one process, one after the other.
        contract(&Comm::Mpi(MpiComm::world()));
        contract(&Comm::Mpi(MpiComm::world()));
        // Gathered data travel in many pieces.
        contract(&Comm::Mpi(MpiComm::world().with_limit(1)));
        let comm = Comm::Mpi(MpiComm::world());
        if comm.size() > 1 {
            traffic(&comm);
        }
    }

    #[cfg(feature = "mpi")]
    #[test]
    fn one_to_four_mpi_ranks_keep_the_contract() {
        for ranks in 1..=4 {
            let (passed, said) = under_mpirun(ranks, "comm::tests::as_an_mpi_rank");
            assert!(passed, "{ranks} ranks: {said}");
            assert_eq!(said.matches("1 passed").count(), ranks, "{said}");
        }
    }

    #[cfg(feature = "mpi")]
    #[test]
    #[ignore = "a rank of the test below"]
    fn as_an_mpi_rank_that_panics() {
        let comm = Comm::Mpi(MpiComm::world());
        assert!(comm.rank() != 1, "the words of the rank that panics");
        comm.barrier();
    }

    #[cfg(feature = "mpi")]
    #[test]
    fn a_panicking_mpi_rank_ends_the_job_with_its_own_words() {
        let (passed, said) = under_mpirun(3, "comm::tests::as_an_mpi_rank_that_panics");
        assert!(!passed && said.contains("the words of the rank that panics"), "{said}");
    }

    #[test]
    fn a_panicking_rank_ends_the_others_and_its_own_message_is_the_one_reported() {
        let said = std::panic::catch_unwind(|| {
            on_threads(3, |comm| {
                assert_ne!(comm.rank(), 1, "rank one has had enough");
                comm.barrier();
            });
        })
        .unwrap_err();
        let text = said.downcast_ref::<String>().expect("an assertion message");
        assert!(text.contains("had enough"), "{text}");
    }

    #[test]
    fn results_come_back_by_rank() {
        assert_eq!(on_threads(4, |comm| comm.rank() * comm.size()), [0, 4, 8, 12]);
    }
}
