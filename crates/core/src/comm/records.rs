//! Records of one kind that go to other ranks.

use super::Comm;
use bytemuck::{Pod, bytes_of, pod_collect_to_vec};
use std::collections::BTreeMap;

/// Number of records that a rank sends at a time, where it may have very many.
const ROUND: usize = 1 << 15;

impl Comm {
    /// Sends each record to its rank, and returns those sent here, in no order; a rank sends some at a time, so that there are never copies
    /// of all of them.
    pub fn hand_over<T: Pod>(&self, records: impl IntoIterator<Item = (usize, T)>) -> Vec<T> {
        let mut records = records.into_iter().peekable();
        let mut here = Vec::new();
        while self.any(records.peek().is_some()) {
            let received = self.route_records(records.by_ref().take(ROUND));
            here.extend(received.into_iter().flat_map(|(_, records)| records));
        }
        here
    }

    /// Sends each record to its rank, and returns those sent here with their senders, each sender once and its records in their order. A
    /// call of [`route`](Self::route); what a rank sends to itself is not copied.
    pub fn route_records<T: Pod>(
        &self,
        records: impl IntoIterator<Item = (usize, T)>,
    ) -> Vec<(usize, Vec<T>)> {
        let mut own = Vec::new();
        let mut others: BTreeMap<usize, Vec<u8>> = BTreeMap::new();
        for (to, record) in records {
            if to == self.rank() {
                own.push(record);
            } else {
                others.entry(to).or_default().extend_from_slice(bytes_of(&record));
            }
        }
        let received = self.route(others.into_iter().collect());
        let read = |(from, bytes): (usize, Vec<u8>)| (from, pod_collect_to_vec(&bytes));
        std::iter::once((self.rank(), own)).chain(received.into_iter().map(read)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::ROUND;
    use crate::comm::on_threads;

    #[test]
    fn more_records_than_go_at_a_time_come_to_their_ranks_each_once_on_1_to_3_ranks() {
        for ranks in 1..=3 {
            on_threads(ranks, |comm| {
                let count = if comm.rank() == 0 { 2 * ROUND + 5 } else { comm.rank() };
                let mut here = comm.hand_over((0..count).map(|n| (n % ranks, [n, comm.rank()])));
                here.sort_unstable();
                let due = (0..2 * ROUND + 5).flat_map(|n| (0..ranks).map(move |from| [n, from]));
                let due = due.filter(|[n, from]| n % ranks == comm.rank() && (*from == 0 || n < from));
                assert!(here.into_iter().eq(due));
            });
        }
    }

    #[test]
    fn records_come_to_their_ranks_in_the_order_in_which_each_sender_has_them_on_1_to_5_ranks() {
        for ranks in 1..=5_u64 {
            on_threads(ranks as usize, |comm| {
                let rank = comm.rank() as u64;
                let sent =
                    (0..20_u64).filter(|n| n * n % ranks == rank).map(|n| ((n % ranks) as usize, [n, rank]));
                let mut senders = Vec::new();
                let mut found = Vec::new();
                for (from, records) in comm.route_records(sent) {
                    assert!(records.is_sorted() && records.iter().all(|[_, by]| *by == from as u64));
                    senders.push(from);
                    found.extend(records.iter().map(|[n, _]| *n));
                }
                senders.sort_unstable();
                assert!(senders.windows(2).all(|pair| pair[0] < pair[1]));
                found.sort_unstable();
                assert!(found.into_iter().eq((0..20).filter(|n| n % ranks == rank)));
            });
        }
    }
}
