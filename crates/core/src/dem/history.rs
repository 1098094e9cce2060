//! Contact histories, stored by the rank that evaluates the contact.
//!
//! What a law remembers of a contact is plain data of its own: numbers that travel, are saved and end with the contact, whatever they
//! mean. [`ContactModel::memory`](crate::contact::ContactModel::memory) is how many there are.

use super::ContactKey;
use crate::comm::Comm;

/// Contacts with what their law remembers of each, as plain data.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Records {
    /// Numbers that the law remembers of a contact.
    memory: usize,
    /// Of each contact its key, and these numbers.
    rows: Vec<u64>,
}

/// Words of a [`ContactKey`].
const KEY: usize = size_of::<ContactKey>() / 8;

impl Records {
    /// None yet, of a law that remembers `memory` numbers of a contact.
    pub fn new(memory: usize) -> Self {
        Self { memory, rows: Vec::new() }
    }

    /// Those that [`bytes`](Self::bytes) wrote.
    pub fn from_bytes(memory: usize, bytes: &[u8]) -> Self {
        Self { memory, rows: bytemuck::pod_collect_to_vec(bytes) }
    }

    /// All contacts as bytes.
    pub fn bytes(&self) -> &[u8] {
        bytemuck::cast_slice(&self.rows)
    }

    /// Numbers that the law remembers of a contact.
    pub fn memory(&self) -> usize {
        self.memory
    }

    /// Number of contacts.
    pub fn len(&self) -> usize {
        self.rows.len() / self.stride()
    }

    /// True if there are no contacts.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Each contact with what its law remembers of it.
    pub fn iter(&self) -> impl Iterator<Item = (ContactKey, &[f64])> {
        self.rows.chunks_exact(self.stride()).map(|row| {
            let (key, memory) = row.split_at(KEY);
            (bytemuck::cast_slice(key)[0], bytemuck::cast_slice(memory))
        })
    }

    /// Adds a contact.
    pub fn push(&mut self, key: ContactKey, memory: &[f64]) {
        assert_eq!(memory.len(), self.memory);
        self.rows.extend_from_slice(bytemuck::cast_slice(&[key]));
        self.rows.extend_from_slice(bytemuck::cast_slice(memory));
    }

    /// Adds those of others, of the same law.
    pub fn extend(&mut self, others: &Self) {
        debug_assert!(self.memory == others.memory || others.is_empty());
        self.rows.extend_from_slice(&others.rows);
    }

    /// Keeps those for which this is true, in their order.
    pub fn retain(&mut self, mut keeps: impl FnMut(&ContactKey, &[f64]) -> bool) {
        let (stride, mut kept) = (self.stride(), 0);
        for at in (0..self.rows.len()).step_by(stride) {
            let (key, memory) = self.rows[at..at + stride].split_at(KEY);
            if keeps(&bytemuck::cast_slice(key)[0], bytemuck::cast_slice(memory)) {
                self.rows.copy_within(at..at + stride, kept);
                kept += stride;
            }
        }
        self.rows.truncate(kept);
    }

    fn stride(&self) -> usize {
        KEY + self.memory
    }

    fn row(&self, index: usize) -> Option<&[u64]> {
        self.rows.get(index * self.stride()..(index + 1) * self.stride())
    }

    #[inline]
    fn key(&self, index: usize) -> Option<ContactKey> {
        self.row(index).map(|row| bytemuck::cast_slice(&row[..KEY])[0])
    }

    /// The first index from `low` on, at most their number, whose key is not below this one; keys ascend. Fast if it is near.
    fn first_from(&self, low: usize, key: &ContactKey) -> usize {
        let is_below = |index: usize| self.key(index).is_some_and(|at| at < *key);
        let (mut low, mut step) = (low, 1);
        while is_below(low + step - 1) {
            (low, step) = (low + step, 2 * step);
        }
        let mut high = (low + step - 1).min(self.len());
        while low < high {
            let middle = low.midpoint(high);
            (low, high) = if is_below(middle) { (middle + 1, high) } else { (low, middle) };
        }
        low
    }
}

/// The records of one rank. In each sub-step those that are [remembered](Self::remember) live on, the others are dropped by
/// [`advance`](Self::advance).
#[derive(Clone, Debug, Default)]
pub struct History {
    /// Ascending by key.
    current: Records,
    /// Those of `current` that are remembered in this sub-step.
    lives: Vec<bool>,
    remembered: usize,
    /// Those that have begun in this sub-step.
    begun: Records,
    /// Index in `current` from which records are searched.
    cursor: usize,
    /// Order of `begun`, and rows of the next `current`: buffers.
    order: Vec<u32>,
    rows: Vec<u64>,
}

impl History {
    /// With these records, in any order.
    pub fn new(records: Records) -> Self {
        let mut history = Self { current: Records::new(records.memory), begun: records, ..Self::default() };
        history.advance();
        history
    }

    /// The records, ascending by key.
    pub fn records(&self) -> &Records {
        &self.current
    }

    /// Forgets all contacts but those for which this is true.
    pub fn retain(&mut self, mut keeps: impl FnMut(&ContactKey) -> bool) {
        self.current.retain(|key, _| keeps(key));
        self.lives.truncate(self.current.len());
    }

    /// Gives contacts other keys, each one of its own.
    pub fn rename(&mut self, name: impl Fn(&ContactKey) -> ContactKey) {
        let stride = self.current.stride();
        let mut renamed = false;
        for row in self.current.rows.chunks_exact_mut(stride) {
            let key: &mut ContactKey = &mut bytemuck::cast_slice_mut(&mut row[..KEY])[0];
            let now = name(key);
            renamed |= now != *key;
            *key = now;
        }
        if renamed {
            *self = Self::new(std::mem::take(&mut self.current));
        }
    }

    /// Moves the cursor to the first record whose key is not below this one. Fast for keys in ascending order.
    fn seek(&mut self, key: &ContactKey) {
        let is_past = self.cursor > 0 && self.current.key(self.cursor - 1) >= Some(*key);
        self.cursor = self.current.first_from(if is_past { 0 } else { self.cursor }, key);
    }

    /// Index of the record of a contact, if it existed. Fast for contacts in ascending order.
    #[inline]
    fn find(&mut self, key: &ContactKey) -> Option<usize> {
        if self.current.key(self.cursor) != Some(*key) {
            self.seek(key);
            if self.current.key(self.cursor) != Some(*key) {
                return None;
            }
        }
        self.cursor += 1;
        Some(self.cursor - 1)
    }

    /// True of a contact of the sub-step before. Fast for contacts in ascending order.
    #[inline]
    pub fn knows(&mut self, key: &ContactKey) -> bool {
        let found = self.find(key);
        self.cursor = found.unwrap_or(self.cursor);
        found.is_some()
    }

    /// Contacts of the sub-step before of the same two bodies and the same part of the first one, ascending. Fast for contacts in ascending order.
    pub fn alike(&mut self, key: &ContactKey) -> impl Iterator<Item = ContactKey> + '_ {
        let key = *key;
        self.seek(&ContactKey { parts: [key.parts[0], 0], ..key });
        let is_alike = move |other: &ContactKey| {
            (other.first, other.parts[0], other.second) == (key.first, key.parts[0], key.second)
        };
        (self.cursor..).map_while(|index| self.current.key(index)).take_while(is_alike)
    }

    /// Memory of a contact, to be changed for the next sub-step; and whether the contact has just begun, with what `begin` made of
    /// zeros. One that is not known continues with the memory of the contact `from` of the sub-step before.
    #[inline]
    pub fn remember(
        &mut self,
        key: ContactKey,
        from: Option<&ContactKey>,
        begin: impl FnOnce(&mut [f64]),
    ) -> (&mut [f64], bool) {
        let stride = self.current.stride();
        if let Some(index) = self.find(&key) {
            self.remembered += usize::from(!self.lives[index]);
            self.lives[index] = true;
            let row = &mut self.current.rows[index * stride..(index + 1) * stride];
            return (bytemuck::cast_slice_mut(&mut row[KEY..]), false);
        }
        let old = from.and_then(|from| self.find(from));
        let rows = &mut self.begun.rows;
        let start = rows.len() + KEY;
        rows.extend_from_slice(bytemuck::cast_slice(&[key]));
        if let Some(index) = old {
            rows.extend_from_slice(&self.current.rows[index * stride + KEY..(index + 1) * stride]);
            return (bytemuck::cast_slice_mut(&mut rows[start..]), false);
        }
        rows.resize(start + self.begun.memory, 0);
        let memory = bytemuck::cast_slice_mut(&mut rows[start..]);
        begin(memory);
        (memory, true)
    }

    /// Ends a sub-step.
    pub fn advance(&mut self) {
        let Self { current, lives, remembered, begun, cursor, order, rows } = self;
        let (stride, count) = (current.stride(), current.len());
        *cursor = 0;
        if *remembered < count || !begun.is_empty() {
            rows.clear();
            // Rows of `current` from one index to another, without those that have ended.
            let keep = |rows: &mut Vec<u64>, mut from: usize, to: usize| {
                while from < to {
                    let run = lives[from..to].iter().position(|lives| !lives).unwrap_or(to - from);
                    rows.extend_from_slice(&current.rows[from * stride..(from + run) * stride]);
                    from += run + 1;
                }
            };
            order.clear();
            order.extend(0..begun.len() as u32);
            order.sort_unstable_by_key(|&index| begun.key(index as usize));
            let mut kept = 0;
            for &index in &*order {
                let (row, key) =
                    begun.row(index as usize).zip(begun.key(index as usize)).expect("one of them");
                let low = current.first_from(kept, &key);
                keep(rows, kept, low);
                rows.extend_from_slice(row);
                kept = low;
            }
            keep(rows, kept, count);
            std::mem::swap(&mut current.rows, rows);
            begun.rows.clear();
        }
        *remembered = 0;
        lives.clear();
        lives.resize(current.len(), false);
    }

    /// Sends the records of contacts whose evaluating rank has changed to that rank.
    ///
    /// `evaluating_rank` gives the evaluating rank of a contact; one without a rank is dropped. Collective.
    pub fn hand_over(
        &mut self,
        comm: &Comm,
        peers: &[usize],
        mut evaluating_rank: impl FnMut(&ContactKey) -> Option<usize>,
    ) {
        if peers.is_empty() {
            return;
        }
        let rank = comm.rank();
        let mut messages: Vec<Vec<u8>> = vec![Vec::new(); peers.len()];
        self.current.retain(|key, memory| {
            let to = evaluating_rank(key);
            if to == Some(rank) {
                return true;
            }
            if let Some(link) = to.and_then(|to| peers.binary_search(&to).ok()) {
                messages[link].extend_from_slice(bytemuck::bytes_of(key));
                messages[link].extend_from_slice(bytemuck::cast_slice(memory));
            }
            false
        });
        let before = self.current.rows.len();
        for message in comm.exchange(peers, messages) {
            self.current.rows.extend(bytemuck::pod_collect_to_vec::<u8, u64>(&message));
        }
        if self.current.rows.len() > before {
            *self = Self::new(std::mem::take(&mut self.current));
        }
        self.lives.truncate(self.current.len());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::on_threads;
    use crate::contact::{ContactModel, FrictionLaw, RollingLaw, TwistingLaw};

    /// Two numbers that tell whose they are.
    const WIDTH: usize = 2;

    fn key(first: u64, second: u64) -> ContactKey {
        ContactKey { first, second, parts: [0; 2] }
    }

    fn records(keys: &[(u64, u64)]) -> Records {
        let mut records = Records::new(WIDTH);
        for &(first, second) in keys {
            records.push(key(first, second), &[first as f64, second as f64]);
        }
        records
    }

    /// The memory of a contact, kept for the next sub-step; none if it has just begun.
    fn kept(history: &mut History, (first, second): (u64, u64)) -> Option<Vec<f64>> {
        let begin = |memory: &mut [f64]| memory.copy_from_slice(&[first as f64, second as f64]);
        let (memory, begun) = history.remember(key(first, second), None, begin);
        (!begun).then(|| memory.to_vec())
    }

    #[test]
    fn a_contact_takes_at_most_96_bytes_with_torques_and_all_frictions_but_that_which_slips_at_its_edge() {
        for (friction, bytes) in [
            (FrictionLaw::NassauerKuna, 64),
            (FrictionLaw::MindlinDisplacement, 96),
            (FrictionLaw::Mindlin, 96),
            (FrictionLaw::MindlinDeresiewicz, 152),
        ] {
            let (rolling, twisting) = (RollingLaw::ElasticPlastic, TwistingLaw::Marshall);
            let memory = ContactModel { friction, rolling, twisting, ..ContactModel::default() }.memory();
            let mut records = Records::new(memory);
            records.push(key(1, 2), &vec![0.0; memory]);
            assert_eq!(records.bytes().len(), bytes, "{friction:?}");
        }
    }

    #[test]
    fn a_contact_is_remembered_while_it_is_kept_and_forgotten_after() {
        let mut history = History::new(records(&[(3, 4), (1, 9)]));
        assert_eq!(kept(&mut history, (1, 2)), None);
        assert_eq!(kept(&mut history, (1, 9)), Some(vec![1.0, 9.0]));
        history.advance();
        assert_eq!(history.records(), &records(&[(1, 2), (1, 9)]));
        history.advance();
        assert!(history.records().is_empty());
    }

    #[test]
    fn a_contact_is_known_from_the_sub_step_before_until_it_is_not_kept() {
        let mut history = History::new(records(&[(1, 9), (3, 4)]));
        assert!(!history.knows(&key(1, 8)) && history.knows(&key(1, 9)) && history.knows(&key(1, 9)));
        assert_eq!(kept(&mut history, (1, 9)), Some(vec![1.0, 9.0]));
        assert_eq!(kept(&mut history, (2, 9)), None);
        assert!(!history.knows(&key(2, 9)), "it begins in this one");
        history.advance();
        assert!(!history.knows(&key(3, 4)) && history.knows(&key(2, 9)) && history.knows(&key(1, 9)));
    }

    #[test]
    fn what_a_law_changes_is_there_in_the_next_sub_step() {
        let mut history = History::new(records(&[(1, 9)]));
        history.remember(key(1, 9), None, |_| panic!("not begun")).0[1] = 0.5;
        history.advance();
        assert_eq!(history.records().iter().next(), Some((key(1, 9), &[1.0, 0.5][..])));
    }

    #[test]
    fn a_second_round_is_remembered_along_with_the_first() {
        let mut history = History::new(Records::new(WIDTH));
        let rounds = [[(1, 2), (5, 6)], [(1, 90), (3, 90)]].concat();
        for &pair in &rounds {
            assert_eq!(kept(&mut history, pair), None);
        }
        history.advance();
        assert_eq!(history.records(), &records(&[(1, 2), (1, 90), (3, 90), (5, 6)]));
        for (first, second) in rounds {
            assert_eq!(kept(&mut history, (first, second)), Some(vec![first as f64, second as f64]));
        }
    }

    #[test]
    fn contacts_of_several_parts_of_two_bodies_have_a_memory_each() {
        let mut history = History::new(Records::new(1));
        let parts = [[0, 0], [0, 1], [1, 0], [1, 1]].map(|parts| ContactKey { parts, ..key(1, 2) });
        for (n, part) in parts.into_iter().enumerate() {
            history.remember(part, None, |memory| memory[0] = n as f64);
        }
        history.remember(key(1, 3), None, |_| ());
        history.advance();
        let order = [parts[0], parts[1], key(1, 3), parts[2], parts[3]];
        assert_eq!(history.records().iter().map(|(key, _)| key).collect::<Vec<_>>(), order);
        for (n, part) in parts.into_iter().enumerate() {
            assert_eq!(history.remember(part, None, |_| panic!("not begun")), (&mut [n as f64][..], false));
        }
    }

    #[test]
    fn a_contact_continues_with_the_memory_of_the_one_that_it_follows_once() {
        let mut history = History::new(Records::new(1));
        let facets = [3, 7, 9].map(|facet| ContactKey { parts: [0, facet], ..key(1, 9) });
        history.remember(facets[0], None, |memory| memory[0] = 0.5);
        history.remember(key(2, 9), None, |_| ());
        history.advance();
        assert_eq!(history.alike(&facets[1]).collect::<Vec<_>>(), [facets[0]]);
        let begun = |_: &mut [f64]| panic!("not begun");
        assert_eq!(history.remember(facets[1], Some(&facets[0]), begun), (&mut [0.5][..], false));
        assert_eq!(history.remember(facets[2], Some(&key(5, 9)), |memory| memory[0] = 0.1).0, [0.1]);
        history.advance();
        let rows: Vec<_> = history.records().iter().map(|(key, memory)| (key, memory[0])).collect();
        assert_eq!(rows, [(facets[1], 0.5), (facets[2], 0.1)]);
    }

    #[test]
    fn a_law_without_memory_has_the_contacts_alone() {
        let mut history = History::new(Records::new(0));
        assert_eq!(
            history.remember(key(1, 2), None, |memory| assert!(memory.is_empty())),
            (&mut [][..], true)
        );
        history.advance();
        assert_eq!((history.records().len(), history.records().bytes().len()), (1, size_of::<ContactKey>()));
    }

    #[test]
    fn records_follow_the_responsibility_round_a_ring_of_3_ranks_and_come_back_whole() {
        on_threads(3, |comm| {
            let peers: Vec<usize> = (0..3).filter(|&p| p != comm.rank()).collect();
            let keys: Vec<(u64, u64)> = (0..5).map(|n| (comm.rank() as u64, 10 + n)).collect();
            let own = records(&keys);
            let mut history = History::new(own.clone());
            for round in 1..=3_u64 {
                history.hand_over(&comm, &peers, |key| Some(((key.first + round) % 3) as usize));
                assert_eq!(history.records().len(), 5);
            }
            assert_eq!(history.records(), &own);
        });
    }
}
