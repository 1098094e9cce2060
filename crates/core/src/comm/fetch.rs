//! Records by id, for ranks that do not know who has them.
//!
//! Every id has a rank that keeps its record for the duration of a call, found from the id alone. Ranks send their records there, and what
//! they want to know; the answers come back in a second message. No rank has more than its share.

use super::{Comm, Routed};
use bytemuck::{Pod, bytes_of, cast_slice, pod_collect_to_vec, pod_read_unaligned};
use std::collections::BTreeMap;

/// Answer of [`Comm::fetch`].
#[derive(Clone, Debug, PartialEq)]
pub struct Fetched<T> {
    /// The records, in the order of the ids that this rank wants; none where no rank offers one.
    pub found: Vec<Option<T>>,
    /// An id of which two records are offered, on one of the ranks, if there is one.
    pub twice: Option<u64>,
    /// An id of which a record is offered that no rank wants, on one of the ranks, if there is one.
    pub unwanted: Option<u64>,
}

/// Number of bytes of an id.
const ID: usize = size_of::<u64>();

impl Comm {
    /// The records with the ids that this rank wants, among those that all ranks offer. Two calls of [`route`](Self::route).
    pub fn fetch<T: Pod>(&self, offered: &[(u64, T)], wanted: &[u64]) -> Fetched<T> {
        self.fetch_merged(offered, wanted, |_, _| ())
    }

    /// The same of ids of which several ranks may offer a record each: these become one by `merge`, which adds the second to the first and
    /// whose result does not depend on their order.
    pub fn fetch_merged<T: Pod>(
        &self,
        offered: &[(u64, T)],
        wanted: &[u64],
        merge: impl Fn(&mut T, &T),
    ) -> Fetched<T> {
        let ranks = self.size() as u64;
        let place = |id: u64| (id % ranks) as usize;
        // Of each rank the records that it keeps, and the ids that it is asked for.
        let mut sorted: BTreeMap<usize, (Vec<u8>, Vec<u64>)> = BTreeMap::new();
        for (id, record) in offered {
            let (records, _) = sorted.entry(place(*id)).or_default();
            records.extend_from_slice(bytes_of(id));
            records.extend_from_slice(bytes_of(record));
        }
        for &id in wanted {
            sorted.entry(place(id)).or_default().1.push(id);
        }
        let message = |(records, ids): (Vec<u8>, Vec<u64>)| {
            [bytes_of(&(records.len() as u64)), &records, cast_slice(&ids)].concat()
        };
        let sent = sorted.into_iter().map(|(to, of)| (to, message(of))).collect();
        let (answers, twice, unwanted) = answers::<T>(&self.route(sent), merge);
        let mut answers: BTreeMap<usize, std::vec::IntoIter<Option<T>>> =
            self.route(answers).iter().map(|(from, bytes)| (*from, read(bytes).into_iter())).collect();
        let mut next = |id: &u64| answers.get_mut(&place(*id)).and_then(Iterator::next).flatten();
        Fetched { found: wanted.iter().map(&mut next).collect(), twice, unwanted }
    }
}

/// Answers of the rank that keeps these records to those that ask for them; an id of two, and one that nobody asks for.
fn answers<T: Pod>(
    received: &[Routed],
    merge: impl Fn(&mut T, &T),
) -> (Vec<Routed>, Option<u64>, Option<u64>) {
    let mut records: Vec<(u64, T)> = Vec::new();
    let mut questions: Vec<(usize, Vec<u64>)> = Vec::new();
    for (from, bytes) in received {
        let (length, rest) = bytes.split_at(ID);
        let (offered, asked) = rest.split_at(pod_read_unaligned::<u64>(length) as usize);
        records.extend(offered.chunks_exact(ID + size_of::<T>()).map(|row| {
            let (id, record) = row.split_at(ID);
            (pod_read_unaligned(id), pod_read_unaligned(record))
        }));
        questions.push((*from, pod_collect_to_vec(asked)));
    }
    records.sort_by_key(|(id, _)| *id);
    let mut twice = None;
    records.dedup_by(|(id, later), (before, record)| {
        let is_same = id == before;
        if is_same {
            merge(record, later);
            twice.get_or_insert(*id);
        }
        is_same
    });
    let mut is_wanted = vec![false; records.len()];
    let answers = questions.into_iter().filter(|(_, ids)| !ids.is_empty()).map(|(from, ids)| {
        let mut answer = Vec::with_capacity(ids.len() * (1 + size_of::<T>()));
        for id in ids {
            match records.binary_search_by_key(&id, |(known, _)| *known) {
                Ok(at) => {
                    is_wanted[at] = true;
                    answer.push(1);
                    answer.extend_from_slice(bytes_of(&records[at].1));
                }
                Err(_) => answer.push(0),
            }
        }
        (from, answer)
    });
    let answers = answers.collect();
    let unwanted = is_wanted.iter().position(|is_wanted| !is_wanted).map(|at| records[at].0);
    (answers, twice, unwanted)
}

/// The records of an answer.
fn read<T: Pod>(mut answer: &[u8]) -> Vec<Option<T>> {
    let mut records = Vec::new();
    while let Some((&is_there, rest)) = answer.split_first() {
        let (record, rest) = rest.split_at(if is_there == 1 { size_of::<T>() } else { 0 });
        records.push((is_there == 1).then(|| pod_read_unaligned(record)));
        answer = rest;
    }
    records
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::on_threads;

    #[test]
    fn every_rank_gets_the_records_that_it_wants_whoever_offers_them_on_1_to_5_ranks() {
        for ranks in 1..=5 {
            on_threads(ranks, |comm| {
                let (rank, ranks) = (comm.rank() as u64, comm.size() as u64);
                let own = |id: &u64| id * id % ranks == rank;
                let offered: Vec<(u64, [f64; 2])> =
                    (0..40).rev().filter(own).map(|id| (id, [id as f64, -1.0])).collect();
                let wanted: Vec<u64> = (0..50).filter(|id| id / 7 % ranks == rank).collect();
                let Fetched { found, twice, unwanted } = comm.fetch(&offered, &wanted);
                let expected = wanted.iter().map(|&id| (id < 40).then_some([id as f64, -1.0]));
                assert_eq!(found, expected.collect::<Vec<_>>());
                assert_eq!((twice, unwanted), (None, None));
            });
        }
    }

    #[test]
    fn what_several_ranks_offer_of_one_id_comes_as_one_record_to_all_that_want_it_on_1_to_5_ranks() {
        let has = |rank: u64, id: u64| !(id + rank).is_multiple_of(3);
        for ranks in 1..=5_u64 {
            on_threads(ranks as usize, |comm| {
                let rank = comm.rank() as u64;
                let offered: Vec<(u64, u64)> =
                    (0..20).filter(|id| has(rank, *id)).map(|id| (id, 100 * rank + id)).collect();
                let wanted: Vec<u64> = (0..25).filter(|id| has(rank + 1, *id)).collect();
                let found = comm.fetch_merged(&offered, &wanted, |sum, other| *sum += other).found;
                let of = |id: u64| {
                    let offers = (0..ranks).filter(|rank| id < 20 && has(*rank, id));
                    offers.map(|rank| 100 * rank + id).reduce(|sum, other| sum + other)
                };
                assert!(found.into_iter().eq(wanted.into_iter().map(of)));
            });
        }
    }

    #[test]
    fn an_id_that_is_offered_twice_and_one_that_nobody_wants_are_noticed_on_one_rank() {
        on_threads(3, |comm| {
            let offered = [[(7_u64, 1_u64), (4, 2)], [(5, 3), (7, 4)], [(6, 5), (9, 6)]][comm.rank()];
            let wanted = [vec![4, 7], vec![6], vec![9]];
            let Fetched { twice, unwanted, .. } = comm.fetch(&offered, &wanted[comm.rank()]);
            assert_eq!((twice, unwanted), [(None, None), (Some(7), None), (None, Some(5))][comm.rank()]);
        });
    }
}
