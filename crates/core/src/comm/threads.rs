//! Ranks that are threads of one process: messages are exchanged by swapping buffers.

use super::traffic::Counters;
use super::{Comm, Pattern, Routed, Transport, buffers};
use crate::error::{Error, Result};
use crate::memory;
use bytemuck::Pod;
use std::any::Any;
use std::collections::{HashMap, VecDeque};
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, OnceLock, PoisonError};
use std::thread::Builder;
use std::time::Duration;

/// Polls before a waiting rank starts to yield, and yields before it sleeps: a wake-up from sleep costs some 30 us.
const POLLS: u32 = 2000;
const YIELDS: u32 = 200;

/// A [`Mailbox`], or a value that ranks share, of any type.
type AnyMailbox = Arc<dyn Any + Send + Sync>;

/// State common to all ranks of a run.
struct Shared {
    failed: AtomicBool,
    /// Mailboxes by (plan, from, to); plans are counted alike on every rank.
    mailboxes: Mutex<HashMap<(usize, usize, usize), AnyMailbox>>,
    arrived: AtomicUsize,
    generation: AtomicUsize,
    /// Of each rank, for the current collective.
    slots: Vec<Mutex<Vec<u8>>>,
    /// Messages to each rank, for the current [`Comm::route`].
    routed: Vec<Mutex<Vec<Routed>>>,
}

/// One of several ranks that are threads of this process.
pub struct ThreadComm {
    rank: usize,
    shared: Arc<Shared>,
    plans: AtomicUsize,
    counters: Arc<Counters>,
    /// Mailboxes of [`Comm::exchange`], by peer.
    post: Mutex<HashMap<usize, [Arc<Mailbox<u8>>; 2]>>,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Shared {
    fn new(ranks: usize) -> Self {
        Self {
            failed: AtomicBool::new(false),
            mailboxes: Mutex::default(),
            arrived: AtomicUsize::new(0),
            generation: AtomicUsize::new(0),
            slots: (0..ranks).map(|_| Mutex::default()).collect(),
            routed: (0..ranks).map(|_| Mutex::default()).collect(),
        }
    }

    /// Waits until `ready`, politely; panics if another rank has failed.
    fn wait(&self, mut ready: impl FnMut() -> bool) {
        let mut tries = 0_u32;
        while !ready() {
            assert!(!self.failed.load(Ordering::Relaxed), "{ANOTHER_RANK}");
            tries = tries.saturating_add(1);
            if tries < POLLS {
                std::hint::spin_loop();
            } else {
                std::thread::yield_now();
            }
        }
    }
}

const ANOTHER_RANK: &str = "another rank failed";

/// Most messages in a mailbox: a rank that is a step ahead need not wait for a late one before it has sent.
const ROOM: usize = 2;

/// Holds messages on their way from one rank to another, in order.
struct Mailbox<T> {
    messages: Mutex<VecDeque<Vec<T>>>,
    /// Number of ranks.
    count: AtomicUsize,
    changed: Condvar,
}

impl<T> Mailbox<T> {
    fn new() -> Self {
        Self {
            messages: Mutex::new(VecDeque::with_capacity(ROOM)),
            count: AtomicUsize::new(0),
            changed: Condvar::new(),
        }
    }

    fn put(&self, message: Vec<T>, shared: &Shared) {
        self.wait_until(|count| count < ROOM, shared);
        let mut messages = lock(&self.messages);
        messages.push_back(message);
        self.count.store(messages.len(), Ordering::Release);
        drop(messages);
        self.changed.notify_one();
    }

    fn take(&self, shared: &Shared) -> Vec<T> {
        self.wait_until(|count| count > 0, shared);
        let mut messages = lock(&self.messages);
        let message = messages.pop_front().expect("a mailbox with a message");
        self.count.store(messages.len(), Ordering::Release);
        drop(messages);
        self.changed.notify_one();
        message
    }

    /// Polls, then yields, then sleeps until the number of messages is as requested. Only one rank puts and only one
    /// takes.
    fn wait_until(&self, wanted: impl Fn(usize) -> bool, shared: &Shared) {
        for tries in 0..POLLS + YIELDS {
            if wanted(self.count.load(Ordering::Acquire)) {
                return;
            }
            if tries < POLLS {
                std::hint::spin_loop();
            } else {
                std::thread::yield_now();
            }
        }
        let mut guard = lock(&self.messages);
        while !wanted(self.count.load(Ordering::Acquire)) {
            assert!(!shared.failed.load(Ordering::Relaxed), "{ANOTHER_RANK}");
            // A notification may slip in before the sleep, so sleep shortly.
            guard = self
                .changed
                .wait_timeout(guard, Duration::from_micros(500))
                .unwrap_or_else(PoisonError::into_inner)
                .0;
        }
    }
}

impl ThreadComm {
    fn new(rank: usize, shared: &Arc<Shared>) -> Self {
        Self {
            rank,
            shared: shared.clone(),
            plans: AtomicUsize::new(0),
            counters: Arc::default(),
            post: Mutex::default(),
        }
    }

    /// The only rank.
    pub(super) fn solo() -> Self {
        Self::new(0, &Arc::new(Shared::new(1)))
    }

    /// Replaces `values` by what `join` makes of those of all ranks.
    fn reduce<T: Pod>(&self, values: &mut [T], join: impl Fn(T, T) -> T) {
        for (rank, bytes) in self.all_gather(bytemuck::cast_slice(values).to_vec()).iter().enumerate() {
            for (value, part) in values.iter_mut().zip(bytemuck::pod_collect_to_vec::<u8, T>(bytes)) {
                *value = if rank == 0 { part } else { join(*value, part) };
            }
        }
    }

    /// The mailbox of a plan for one direction; the first caller makes it.
    fn mailbox<T: Send + 'static>(&self, plan: usize, from: usize, to: usize) -> Arc<Mailbox<T>> {
        let mut boxes = lock(&self.shared.mailboxes);
        let entry = boxes.entry((plan, from, to)).or_insert_with(|| Arc::new(Mailbox::<T>::new()));
        entry.clone().downcast().expect("all ranks make the same plans")
    }

    /// Everybody's value, by rank.
    pub(super) fn share<T: Send + Sync + 'static>(&self, value: Arc<T>) -> Vec<Arc<T>> {
        let plan = self.plans.fetch_add(1, Ordering::Relaxed) + 1;
        lock(&self.shared.mailboxes).insert((plan, self.rank, self.rank), value);
        self.barrier();
        let of = |rank| {
            let value = lock(&self.shared.mailboxes)[&(plan, rank, rank)].clone();
            value.downcast().expect("all ranks share values of one type")
        };
        let all = (0..self.size()).map(of).collect();
        self.barrier();
        lock(&self.shared.mailboxes).remove(&(plan, self.rank, self.rank));
        all
    }

    pub(super) fn pattern<T: Pod + Send>(
        &self,
        peers: &[usize],
        lengths: &[usize],
    ) -> Result<Box<dyn Pattern<T>>> {
        let plan = self.plans.fetch_add(1, Ordering::Relaxed) + 1;
        let links = peers
            .iter()
            .zip(buffers(lengths)?.into_iter().zip(buffers(lengths)?))
            .map(|(&peer, (outgoing, incoming))| Link {
                outgoing,
                incoming,
                out: self.mailbox(plan, self.rank, peer),
                back: self.mailbox(plan, peer, self.rank),
            })
            .collect();
        Ok(Box::new(ThreadPattern { links, shared: self.shared.clone() }))
    }
}

impl Transport for ThreadComm {
    fn rank(&self) -> usize {
        self.rank
    }

    fn size(&self) -> usize {
        self.shared.slots.len()
    }

    fn counters(&self) -> &Arc<Counters> {
        &self.counters
    }

    fn barrier(&self) {
        let shared = &*self.shared;
        let generation = shared.generation.load(Ordering::Acquire);
        if shared.arrived.fetch_add(1, Ordering::AcqRel) + 1 == self.size() {
            shared.arrived.store(0, Ordering::Release);
            shared.generation.fetch_add(1, Ordering::AcqRel);
        } else {
            shared.wait(|| shared.generation.load(Ordering::Acquire) != generation);
        }
    }

    fn sum(&self, values: &mut [i64]) {
        self.reduce(values, i64::wrapping_add);
    }

    fn max(&self, values: &mut [f64]) {
        self.reduce(values, f64::max);
    }

    fn all_gather(&self, bytes: Vec<u8>) -> Vec<Vec<u8>> {
        *lock(&self.shared.slots[self.rank]) = bytes;
        self.barrier();
        let all = self.shared.slots.iter().map(|slot| lock(slot).clone()).collect();
        self.barrier();
        all
    }

    fn gather(&self, bytes: Vec<u8>) -> Vec<Vec<u8>> {
        *lock(&self.shared.slots[self.rank]) = bytes;
        self.barrier();
        let mut all = Vec::new();
        if self.rank == 0 {
            all = self.shared.slots.iter().map(|slot| std::mem::take(&mut *lock(slot))).collect();
        }
        self.barrier();
        all
    }

    fn exchange(&self, peers: &[usize], messages: Vec<Vec<u8>>) -> Vec<Vec<u8>> {
        const PLAN: usize = 0;
        let mut post = lock(&self.post);
        for (&peer, message) in peers.iter().zip(messages) {
            let [out, _] = post.entry(peer).or_insert_with(|| {
                [self.mailbox(PLAN, self.rank, peer), self.mailbox(PLAN, peer, self.rank)]
            });
            out.put(message, &self.shared);
        }
        peers.iter().map(|peer| post[peer][1].take(&self.shared)).collect()
    }

    fn route(&self, messages: Vec<Routed>) -> Vec<Routed> {
        for (to, message) in messages {
            lock(&self.shared.routed[to]).push((self.rank, message));
        }
        self.barrier();
        let received = std::mem::take(&mut *lock(&self.shared.routed[self.rank]));
        self.barrier();
        received
    }
}

struct Link<T> {
    outgoing: Vec<T>,
    incoming: Vec<T>,
    out: Arc<Mailbox<T>>,
    back: Arc<Mailbox<T>>,
}

/// A message is the sender's buffer itself; the buffer that comes back in the other direction replaces it, so
/// nothing is copied and, lengths being equal both ways, nothing allocated.
struct ThreadPattern<T> {
    links: Vec<Link<T>>,
    shared: Arc<Shared>,
}

impl<T: Pod + Send> Pattern<T> for ThreadPattern<T> {
    fn send(&mut self, link: usize) -> &mut [T] {
        &mut self.links[link].outgoing
    }

    fn start(&mut self) {
        for link in &mut self.links {
            link.out.put(std::mem::take(&mut link.outgoing), &self.shared);
        }
    }

    fn finish(&mut self) {
        for link in &mut self.links {
            link.outgoing = std::mem::replace(&mut link.incoming, link.back.take(&self.shared));
        }
    }

    fn received(&self, link: usize) -> &[T] {
        &self.links[link].incoming
    }
}

/// As [`try_on_threads`], where this many threads can be created.
///
/// # Panics
/// If not; and as there.
pub fn on_threads<R: Send>(ranks: usize, body: impl Fn(Comm) -> R + Sync) -> Vec<R> {
    try_on_threads(ranks, body).unwrap_or_else(|error| panic!("{error}"))
}

/// Runs `body` on `ranks` threads, one rank each, and returns their results by rank.
///
/// # Errors
/// [`Error::Input`] if not all threads can be had; then none has begun.
///
/// # Panics
/// With the first rank's panic that is not merely "another rank failed".
pub fn try_on_threads<R: Send>(ranks: usize, body: impl Fn(Comm) -> R + Sync) -> Result<Vec<R>> {
    start(ranks, |_| Builder::new(), body)
}

/// The same, each thread as `thread` would have it.
fn start<R: Send>(
    ranks: usize,
    thread: impl Fn(usize) -> Builder,
    body: impl Fn(Comm) -> R + Sync,
) -> Result<Vec<R>> {
    let shared = Arc::new(Shared::new(ranks));
    let run = &|rank: usize| {
        let comm = ThreadComm::new(rank, &shared);
        let result = catch_unwind(AssertUnwindSafe(|| body(Comm::Threads(comm))));
        if result.is_err() {
            shared.failed.store(true, Ordering::Relaxed);
        }
        result
    };
    // Signalled when all threads exist, or when one cannot be created.
    let complete: &OnceLock<bool> = &OnceLock::new();
    let results: Vec<_> = std::thread::scope(|scope| {
        let threads: Result<Vec<_>> = (0..ranks)
            .map(|rank| {
                let start = |starting| {
                    thread(rank).spawn_scoped(scope, move || {
                        drop(starting);
                        complete.wait().then(|| run(rank))
                    })
                };
                memory::start_thread(start).map_err(|error| no_thread((rank, ranks), &error))
            })
            .collect();
        complete.set(threads.is_ok()).expect("told once");
        let results = threads?.into_iter().map(|thread| {
            let result = thread.join().expect("panics are caught inside");
            result.expect("all threads are there")
        });
        Ok::<_, Error>(results.collect())
    })?;
    let follows = |panic: &Box<dyn Any + Send>| {
        let text = panic.downcast_ref::<String>().map(String::as_str);
        text.or(panic.downcast_ref::<&str>().copied()).is_some_and(|text| text.contains(ANOTHER_RANK))
    };
    let (good, mut bad): (Vec<_>, Vec<_>) = results.into_iter().partition(std::result::Result::is_ok);
    bad.sort_by_key(|result| result.as_ref().is_err_and(follows));
    match bad.into_iter().next() {
        Some(Err(panic)) => resume_unwind(panic),
        _ => Ok(good.into_iter().flatten().collect()),
    }
}

/// The error for thread `rank` of `ranks`.
fn no_thread((rank, ranks): (usize, usize), error: &io::Error) -> Error {
    Error::Input(format!(
        "cannot start thread {} of {ranks}: {error}; use --threads {}, or raise the limits on processes and memory (ulimit \
         -u, ulimit -v, pids of the control group)",
        rank + 1,
        rank.max(1)
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn where_the_nth_thread_cannot_be_had_no_rank_begins_and_the_number_to_use_is_named() {
        for (n, remedy) in [(0, "--threads 1,"), (1, "--threads 1,"), (3, "--threads 3,")] {
            // No address space has room for such a stack, so the system itself refuses.
            let thread = |rank| match rank {
                _ if rank == n => Builder::new().stack_size(1 << 60),
                _ => Builder::new(),
            };
            let error = start(5, thread, |_| panic!("a rank has begun")).unwrap_err();
            let text = error.to_string();
            let start = format!("cannot start thread {} of 5: ", n + 1);
            assert!(text.starts_with(&start) && text.contains(remedy), "{text}");
            assert_eq!(error.exit_code(), 2);
        }
    }
}
