//! Counts of what a rank sends.

use std::ops::{Add, Sub};
use std::sync::{Mutex, MutexGuard, PoisonError};
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

impl Traffic {
    /// Time (s) in the calls that send and wait.
    pub fn seconds(&self) -> f64 {
        self.halo.seconds + self.exchange.seconds + self.collective.seconds
    }
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

/// Counts messages of one kind.
#[derive(Debug, Default)]
pub(super) struct Counter(Mutex<Tally>);

impl Counter {
    fn tally(&self) -> MutexGuard<'_, Tally> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Counts messages that are about to go.
    pub(super) fn add(&self, messages: usize, bytes: usize) {
        let mut tally = self.tally();
        tally.messages += messages as u64;
        tally.bytes += bytes as u64;
    }

    /// Times a call that sends or waits.
    pub(super) fn time<R>(&self, work: impl FnOnce() -> R) -> R {
        let start = Instant::now();
        let result = work();
        self.tally().seconds += start.elapsed().as_secs_f64();
        result
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
        let [halo, exchange, collective] = [&self.halo, &self.exchange, &self.collective].map(|c| *c.tally());
        Traffic { halo, exchange, collective }
    }
}
