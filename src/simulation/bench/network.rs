//! What the transport between ranks costs, measured beside the steps: a message, a byte, a reduction.

use crate::comm::Comm;
use serde::Serialize;
use std::time::Instant;

/// Repetitions of which the best counts, and exchanges in each.
const REPEATS: usize = 20;
const ROUNDS: u32 = 20;

/// Numbers in a long message: 1 MiB.
const LONG: usize = 1 << 17;

/// Numbers that the control of the flow adds up over all ranks.
const CONTROL_WORDS: usize = 13;

/// Cost of the transport; two ranks at a time exchange messages, all at once.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Network {
    /// Seconds that a short message takes, there and back at once.
    pub seconds_per_message: f64,
    /// Seconds for each byte more, packed from and unpacked into memory.
    pub seconds_per_byte: f64,
    /// Seconds that the sum of thirteen integers over all ranks takes.
    pub seconds_per_reduction: f64,
}

impl Network {
    /// Measures; nothing to measure on one rank. Collective.
    pub(super) fn measure(comm: &Comm) -> Option<Self> {
        if comm.size() == 1 {
            return None;
        }
        let (short, long) = (exchange(comm, 1), exchange(comm, LONG));
        let mut words = [1; CONTROL_WORDS];
        let reduction = best(comm, || comm.sum(&mut words));
        let bytes = ((LONG - 1) * size_of::<f64>()) as f64;
        Some(Self {
            seconds_per_message: short,
            seconds_per_byte: (long - short).max(0.0) / bytes,
            seconds_per_reduction: reduction,
        })
    }
}

/// Seconds for an exchange of `numbers` numbers with the partner rank; the last of an odd number of ranks has none.
fn exchange(comm: &Comm, numbers: usize) -> f64 {
    let partner = Some(comm.rank() ^ 1).filter(|&partner| partner < comm.size());
    let peers: Vec<usize> = partner.into_iter().collect();
    let mut pattern = (comm.halo::<f64>(&peers, &vec![numbers; peers.len()])).expect("room for one message");
    let (source, mut target) = (vec![1.0; numbers], vec![0.0; numbers]);
    best(comm, || {
        for link in 0..peers.len() {
            pattern.send(link).copy_from_slice(&source);
        }
        pattern.exchange();
        for link in 0..peers.len() {
            target.copy_from_slice(std::hint::black_box(pattern.received(link)));
        }
    })
}

/// Seconds per call, the best of some; of the slowest rank.
fn best(comm: &Comm, mut call: impl FnMut()) -> f64 {
    let mut least = f64::INFINITY;
    for _ in 0..REPEATS {
        comm.barrier();
        let start = Instant::now();
        for _ in 0..ROUNDS {
            call();
        }
        let mut seconds = [start.elapsed().as_secs_f64() / f64::from(ROUNDS)];
        comm.max(&mut seconds);
        least = least.min(seconds[0]);
    }
    least
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::on_threads;

    #[test]
    fn messages_and_reductions_take_some_time_on_3_ranks_and_none_on_one() {
        assert!(Network::measure(&Comm::Solo).is_none());
        for network in on_threads(3, |comm| Network::measure(&comm).unwrap()) {
            let Network { seconds_per_message, seconds_per_byte, seconds_per_reduction } = network;
            assert!(seconds_per_message > 1e-8 && seconds_per_reduction > 1e-8);
            // On a busy machine a long message may be no slower than a short one.
            assert!((0.0..1e-6).contains(&seconds_per_byte), "{network:?}");
        }
    }
}
