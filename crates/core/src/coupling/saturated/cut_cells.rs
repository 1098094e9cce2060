//! Cells that the surface of a body cuts, evaluated several at a time.
//!
//! A row of cells through a body has cut cells, solid ones, and cut cells. The cut ones of both ends go into one
//! register.

use crate::fluid::{CHUNK, Real, Window};

/// Cells on a surface that are evaluated together: a register of double precision, where they are widest.
pub(super) const BLOCK: usize = 8;

/// The cells `0..start` and `end..count` of a window, side by side: those between are wholly solid.
#[derive(Clone, Copy, Debug)]
pub(super) struct CutCells {
    start: usize,
    end: usize,
    count: usize,
}

impl CutCells {
    #[inline(always)]
    pub(super) fn new(window: &Window) -> Self {
        Self { start: window.full.start, end: window.full.end, count: window.count }
    }

    /// Number of cells.
    #[inline(always)]
    pub(super) fn cells(self) -> usize {
        self.start + (self.count - self.end)
    }

    /// Positions of the cells from `first` on, from the centre of the body, `offset` being that of the first of the
    /// window; the last one again where there are no more.
    #[inline(always)]
    pub(super) fn positions(self, first: usize, offset: f64, centre: f64) -> [f64; BLOCK] {
        let mut x = [0.0; BLOCK];
        for (k, x) in x.iter_mut().enumerate() {
            let lane = (first + k).min(self.cells() - 1);
            let lane = if lane < self.start { lane } else { lane + (self.end - self.start) };
            *x = (offset + lane as f64) - centre;
        }
        x
    }

    /// Adds volume fractions to those of the cells in the window. The `fractions` are side by side from index [`CHUNK`] on;
    /// before are zeros, for windows that begin in front of them.
    #[inline(always)]
    pub(super) fn add<T: Real>(self, fractions: &[T; 2 * CHUNK], fraction: &mut [T; CHUNK]) {
        let gap = self.end - self.start;
        let head = &fractions[CHUNK..2 * CHUNK];
        let tail = &fractions[CHUNK - gap..2 * CHUNK - gap];
        // One from a lane on, zero before.
        let begun = &T::STEP[CHUNK - self.start..2 * CHUNK - self.start];
        let ended = &T::STEP[CHUNK - self.end..2 * CHUNK - self.end];
        let over = &T::STEP[CHUNK - self.count..2 * CHUNK - self.count];
        for k in 0..CHUNK {
            let (before, after) = (T::ONE - begun[k], ended[k] - over[k]);
            fraction[k] = fraction[k] + (head[k] * before + tail[k] * after);
        }
    }
}

/// Puts the volume fractions of some cells from the `first` on beside those of others.
#[inline(always)]
pub(super) fn put<T: Real>(fractions: &mut [T; 2 * CHUNK], first: usize, some: &[f64; BLOCK]) {
    let to = &mut fractions[CHUNK + first..CHUNK + first + BLOCK];
    for k in 0..BLOCK {
        to[k] = T::from_f64(some[k]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fractions_of_both_ends_of_a_window_come_to_their_cells_and_to_no_others() {
        for count in 0..=CHUNK {
            for end in 0..=count {
                for start in 0..=end {
                    let cut = CutCells { start, end, count };
                    let solid = |k: usize| (start..end).contains(&k);
                    let is_cut = |k: usize| k < count && !solid(k);
                    let mut fractions = [0.0; 2 * CHUNK];
                    for first in (0..cut.cells()).step_by(BLOCK) {
                        put(&mut fractions, first, &cut.positions(first, 0.25, -0.5));
                    }
                    let mut fraction: [f64; CHUNK] = std::array::from_fn(|k| f64::from(u8::from(solid(k))));
                    cut.add(&fractions, &mut fraction);
                    for (k, found) in fraction.into_iter().enumerate() {
                        let expected =
                            if is_cut(k) { 0.75 + k as f64 } else { f64::from(u8::from(solid(k))) };
                        assert_eq!(found.to_bits(), expected.to_bits(), "{cut:?} {k}");
                    }
                }
            }
        }
    }
}
