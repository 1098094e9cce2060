//! Parts of a saved state, divided among the ranks that read them.

use super::Comm;

/// Bytes that the ranks of an earlier run have saved, one part each, as the ranks of this one have read them: all ranks together have every
/// part once, so that none has more than its share.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SavedParts {
    /// The parts that this rank has read, ascending by index.
    pub own: Vec<(usize, Vec<u8>)>,
    /// Number of parts of all ranks, the same on every rank; `own` has indices below it.
    pub count: usize,
}

impl SavedParts {
    /// Indices of the parts that this rank reads, of this number: n with n mod ranks = rank. With as many ranks as before each reads its own.
    pub fn indices(comm: &Comm, count: usize) -> impl Iterator<Item = usize> + use<> {
        (comm.rank()..count).step_by(comm.size())
    }

    /// Those of all `parts`, the same on every rank, that this rank reads.
    pub fn divided(comm: &Comm, parts: &[Vec<u8>]) -> Self {
        let own = Self::indices(comm, parts.len()).map(|n| (n, parts[n].clone())).collect();
        Self { own, count: parts.len() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::on_threads;

    #[test]
    fn one_rank_has_each_part_and_none_has_more_than_one_above_the_others_on_1_to_8_ranks() {
        let all: Vec<Vec<u8>> = (0..7).map(|n| vec![n; 3]).collect();
        for ranks in 1..=8 {
            let divided = on_threads(ranks, |comm| SavedParts::divided(&comm, &all));
            assert!(divided.iter().all(|of| of.count == 7 && of.own.len() <= 7_usize.div_ceil(ranks)));
            let mut seen: Vec<(usize, Vec<u8>)> = divided.into_iter().flat_map(|of| of.own).collect();
            seen.sort();
            assert!(seen.into_iter().eq(all.iter().cloned().enumerate()));
        }
    }
}
