//! Contact histories, stored by the rank that evaluates the contact.

use crate::comm::Comm;
use bytemuck::{Pod, Zeroable};

/// Memory of one contact. Plain data, so that it travels and is hashed as bytes.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Record {
    /// Lower id.
    pub first: u64,
    /// Higher id, or what stands for a wall, see [`ContactState::of_wall`](super::ContactState::of_wall).
    pub second: u64,
    /// Damping constant (s/m); negative until the bodies approach, see [`crate::contact::PairLaw::latch`].
    pub damping: f64,
    /// Sub-steps since the contact began.
    pub age: u64,
}

impl Record {
    /// The ids of the pair.
    pub(super) fn key(&self) -> (u64, u64) {
        (self.first, self.second)
    }
}

/// The records of one rank. In each sub-step those that are [kept](Self::keep) live on, the others are dropped by
/// [`advance`](Self::advance).
#[derive(Clone, Debug, Default)]
pub struct History {
    /// Ascending by `(first, second)`.
    current: Vec<Record>,
    next: Vec<Record>,
    /// Index in `current` from which [`get`](Self::get) searches.
    cursor: usize,
}

impl History {
    /// With these records, in any order.
    pub fn new(mut records: Vec<Record>) -> Self {
        records.sort_unstable_by_key(Record::key);
        Self { current: records, ..Self::default() }
    }

    /// The records, ascending by `(first, second)`.
    pub fn records(&self) -> &[Record] {
        &self.current
    }

    /// The record of a pair, if the contact existed. Fast for pairs in ascending order.
    pub fn get(&mut self, first: u64, second: u64) -> Option<Record> {
        let key = (first, second);
        if self.cursor > 0 && self.current[self.cursor - 1].key() >= key {
            self.cursor = 0;
        }
        while self.current.get(self.cursor).is_some_and(|r| r.key() < key) {
            self.cursor += 1;
        }
        self.current.get(self.cursor).filter(|r| r.key() == key).copied()
    }

    /// Stores a contact for the next sub-step.
    pub fn keep(&mut self, record: Record) {
        self.next.push(record);
    }

    /// Ends a sub-step.
    pub fn advance(&mut self) {
        // Two ascending runs, those of pairs and of walls: a stable sort merges them.
        self.next.sort_by_key(Record::key);
        std::mem::swap(&mut self.current, &mut self.next);
        self.next.clear();
        self.cursor = 0;
    }

    /// Sends the records of contacts whose evaluating rank has changed to that rank.
    ///
    /// `evaluating_rank` gives the evaluating rank of a record; one without a rank is dropped. Collective.
    pub fn hand_over(
        &mut self,
        comm: &Comm,
        peers: &[usize],
        mut evaluating_rank: impl FnMut(&Record) -> Option<usize>,
    ) {
        if peers.is_empty() {
            return;
        }
        let rank = comm.rank();
        let mut messages: Vec<Vec<u8>> = vec![Vec::new(); peers.len()];
        self.current.retain(|record| {
            let to = evaluating_rank(record);
            if let Some(link) = to.and_then(|to| peers.binary_search(&to).ok()) {
                messages[link].extend_from_slice(bytemuck::bytes_of(record));
            }
            to == Some(rank)
        });
        let before = self.current.len();
        for message in comm.exchange(peers, messages) {
            self.current.extend(bytemuck::pod_collect_to_vec::<u8, Record>(&message));
        }
        if self.current.len() > before {
            self.current.sort_unstable_by_key(Record::key);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::on_threads;

    fn record(first: u64, second: u64) -> Record {
        Record { first, second, damping: first as f64, age: second }
    }

    #[test]
    fn a_contact_is_remembered_while_it_is_kept_and_forgotten_after() {
        let mut history = History::new(vec![record(3, 4), record(1, 9)]);
        assert_eq!(history.get(1, 2), None);
        assert_eq!(history.get(1, 9), Some(record(1, 9)));
        history.keep(record(1, 9));
        history.advance();
        assert_eq!(history.get(1, 9), Some(record(1, 9)));
        assert_eq!(history.get(3, 4), None);
        history.advance();
        assert!(history.records().is_empty());
    }

    #[test]
    fn a_second_round_is_remembered_along_with_the_first() {
        let mut history = History::default();
        let rounds = [[(1, 2), (5, 6)], [(1, 90), (3, 90)]].concat();
        for &(first, second) in &rounds {
            assert_eq!(history.get(first, second), None);
            history.keep(record(first, second));
        }
        history.advance();
        assert_eq!(history.records(), [record(1, 2), record(1, 90), record(3, 90), record(5, 6)]);
        for (first, second) in rounds {
            assert_eq!(history.get(first, second), Some(record(first, second)));
        }
    }

    #[test]
    fn records_follow_the_responsibility_round_a_ring_of_3_ranks_and_come_back_whole() {
        on_threads(3, |comm| {
            let peers: Vec<usize> = (0..3).filter(|&p| p != comm.rank()).collect();
            let own: Vec<Record> = (0..5).map(|n| record(comm.rank() as u64, 10 + n)).collect();
            let mut history = History::new(own.clone());
            for round in 1..=3_u64 {
                history.hand_over(&comm, &peers, |r| Some(((r.first + round) % 3) as usize));
                assert_eq!(history.records().len(), 5);
            }
            assert_eq!(history.records(), own);
        });
    }
}
