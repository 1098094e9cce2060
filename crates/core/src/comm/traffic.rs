//! Counts of what a rank sends.

use std::ops::{Add, Sub};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

/// Messages and bytes that a rank has sent since it began, by kind. Messages to itself are not counted.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Traffic {
    /// Fixed patterns, [`Comm::halo`](super::Comm::halo).
    pub halo: Tally,
    /// Messages of any length between neighbours, [`Comm::exchange`](super::Comm::exchange); empty ones are messages.
    pub exchange: Tally,
    /// Reductions, gatherings and barriers of all ranks: one message for each call, with the bytes that this rank
    /// puts in.
    pub collective: Tally,
}

/// Messages of one kind.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tally {
    /// Number of messages.
    pub messages: u64,
    /// Bytes in them.
    pub bytes: u64,
    /// Time (s) in the calls that send and wait.
    pub seconds: f64,
}

macro_rules! by_fields {
    ($kind:ident { $($field:ident),* }) => {
        impl Add for $kind {
            type Output = Self;
            fn add(self, more: Self) -> Self {
                Self { $($field: self.$field + more.$field),* }
            }
        }
        impl Sub for $kind {
            type Output = Self;
            fn sub(self, before: Self) -> Self {
                Self { $($field: self.$field - before.$field),* }
            }
        }
    };
}
by_fields!(Tally { messages, bytes, seconds });
by_fields!(Traffic { halo, exchange, collective });

/// Counts messages of one kind. Only one thread writes at a time, so the numbers are exact.
#[derive(Debug, Default)]
pub(super) struct Counter {
    messages: AtomicU64,
    bytes: AtomicU64,
    nanoseconds: AtomicU64,
}

impl Counter {
    /// Notes messages that are about to go.
    pub(super) fn add(&self, messages: usize, bytes: usize) {
        self.messages.fetch_add(messages as u64, Ordering::Relaxed);
        self.bytes.fetch_add(bytes as u64, Ordering::Relaxed);
    }

    /// Does what takes time to send or to wait.
    pub(super) fn time<R>(&self, work: impl FnOnce() -> R) -> R {
        let start = Instant::now();
        let result = work();
        let spent = start.elapsed().as_nanos() as u64;
        self.nanoseconds.fetch_add(spent, Ordering::Relaxed);
        result
    }

    fn tally(&self) -> Tally {
        Tally {
            messages: self.messages.load(Ordering::Relaxed),
            bytes: self.bytes.load(Ordering::Relaxed),
            seconds: self.nanoseconds.load(Ordering::Relaxed) as f64 / 1e9,
        }
    }
}

/// The counters of a rank.
#[derive(Debug, Default)]
pub(super) struct Counters {
    pub(super) halo: Counter,
    pub(super) exchange: Counter,
    pub(super) collective: Counter,
}

impl Counters {
    pub(super) fn traffic(&self) -> Traffic {
        Traffic {
            halo: self.halo.tally(),
            exchange: self.exchange.tally(),
            collective: self.collective.tally(),
        }
    }
}
