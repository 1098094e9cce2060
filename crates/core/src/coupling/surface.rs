//! Cells that the surface of a body cuts, evaluated several at a time.
//!
//! A row of cells through a body has cut cells, solid ones, and cut cells. The cut ones of both ends go into one
//! register.

use crate::fluid::{CHUNK, Real};

/// Cells on a surface that are evaluated together: a register of double precision, where they are widest.
pub(super) const BLOCK: usize = 8;

/// The cells `0..start` and `end..count` of a window, side by side: those between are wholly solid.
#[derive(Clone, Copy, Debug)]
pub(super) struct Surface {
    pub(super) start: usize,
    pub(super) end: usize,
    pub(super) count: usize,
}

/// Volume fractions of cells on the surface, side by side, from index [`CHUNK`] on; before are zeros, for windows
/// that begin in front of them.
pub(super) type Shares<T> = [T; 2 * CHUNK];

impl Surface {
    /// Number of cells.
    #[inline(always)]
    pub(super) fn cells(self) -> usize {
        self.start + (self.count - self.end)
    }

    /// Positions of the cells from `first` on, from the centre of the body, `offset` being that of the first of the
    /// window; the last one again where there are no more.
    #[inline(always)]
    pub(super) fn places(self, first: usize, offset: f64, centre: f64) -> [f64; BLOCK] {
        let mut x = [0.0; BLOCK];
        for (k, x) in x.iter_mut().enumerate() {
            let lane = (first + k).min(self.cells() - 1);
            let lane = if lane < self.start { lane } else { lane + (self.end - self.start) };
            *x = (offset + lane as f64) - centre;
        }
        x
    }

    /// Copies volume fractions to the positions of the cells in the window.
    #[inline(always)]
    pub(super) fn add<T: Real>(self, shares: &Shares<T>, fraction: &mut [T; CHUNK]) {
        let gap = self.end - self.start;
        let head = &shares[CHUNK..2 * CHUNK];
        let tail = &shares[CHUNK - gap..2 * CHUNK - gap];
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
pub(super) fn put<T: Real>(shares: &mut Shares<T>, first: usize, some: &[f64; BLOCK]) {
    let to = &mut shares[CHUNK + first..CHUNK + first + BLOCK];
    for k in 0..BLOCK {
        to[k] = T::from_f64(some[k]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_of_both_ends_of_a_window_come_to_their_cells_and_to_no_others() {
        for count in 0..=CHUNK {
            for end in 0..=count {
                for start in 0..=end {
                    let surface = Surface { start, end, count };
                    let solid = |k: usize| (start..end).contains(&k);
                    let cut = |k: usize| k < count && !solid(k);
                    let mut shares = [0.0; 2 * CHUNK];
                    for first in (0..surface.cells()).step_by(BLOCK) {
                        put(&mut shares, first, &surface.places(first, 0.25, -0.5));
                    }
                    let mut fraction: [f64; CHUNK] = std::array::from_fn(|k| f64::from(u8::from(solid(k))));
                    surface.add(&shares, &mut fraction);
                    for (k, share) in fraction.into_iter().enumerate() {
                        let expected = if cut(k) { 0.75 + k as f64 } else { f64::from(u8::from(solid(k))) };
                        assert_eq!(share.to_bits(), expected.to_bits(), "{surface:?} {k}");
                    }
                }
            }
        }
    }
}
