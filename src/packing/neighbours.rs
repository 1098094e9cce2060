//! Bodies near a position, while bodies move one by one.

use crate::domain::Domain;
use crate::math::Vec3;

/// Positions sorted into bins at least as wide as the furthest that neighbours reach.
#[derive(Debug)]
pub(super) struct Bins {
    size: Vec3,
    counts: [usize; 3],
    members: Vec<Vec<usize>>,
}

impl Bins {
    /// Empty, for `count` positions whose neighbours are within `widest` (m).
    pub(super) fn new(domain: &Domain, widest: f64, count: usize) -> Self {
        let size = domain.size();
        let mut counts: [usize; 3] = std::array::from_fn(|i| ((size[i] / widest) as usize).max(1));
        // At most two bins per particle, else a large dilute box would be mostly empty bins.
        while counts.iter().map(|&n| n as f64).product::<f64>() > (2 * count.max(1)) as f64 {
            let longest = (1..3).fold(0, |best, i| if counts[i] > counts[best] { i } else { best });
            counts[longest] = counts[longest].div_ceil(2);
        }
        Self { size, counts, members: vec![Vec::new(); counts.iter().product()] }
    }

    fn place(&self, position: &Vec3) -> [usize; 3] {
        std::array::from_fn(|i| {
            let n = self.counts[i];
            ((position[i] / self.size[i] * n as f64) as usize).min(n - 1)
        })
    }

    fn index(&self, place: [usize; 3]) -> usize {
        place[0] + self.counts[0] * (place[1] + self.counts[1] * place[2])
    }

    /// Takes the one with this number, at a wrapped position.
    pub(super) fn add(&mut self, number: usize, position: &Vec3) {
        let bin = self.index(self.place(position));
        self.members[bin].push(number);
    }

    /// The one with this number has moved.
    pub(super) fn shift(&mut self, number: usize, from: &Vec3, to: &Vec3) {
        let [from, to] = [from, to].map(|position| self.index(self.place(position)));
        if from != to {
            let at = self.members[from].iter().position(|n| *n == number);
            self.members[from].swap_remove(at.expect("it is where it was put"));
            self.members[to].push(number);
        }
    }

    /// The bins that hold all that is near a position.
    pub(super) fn around(&self, position: &Vec3) -> impl Iterator<Item = &[usize]> {
        let home = self.place(position);
        let bins = self.counts;
        // With fewer than three bins in a direction, neighbours on both sides are the same bin: visit it once.
        let near = move |i: usize| {
            (0..bins[i].min(3)).map(move |d| (home[i] + bins[i] + d - usize::from(bins[i] > 2)) % bins[i])
        };
        near(2).flat_map(move |z| {
            near(1).flat_map(move |y| near(0).map(move |x| self.members[self.index([x, y, z])].as_slice()))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn in_a_long_box_a_position_has_no_more_near_it_than_in_a_cube() {
        let nearby = |cells: [usize; 3]| {
            let domain = Domain { faces: Domain::faces([true; 3]), cells, dx: 1.0 };
            let mut bins = Bins::new(&domain, 1.0, domain.cell_count());
            for n in 0..domain.cell_count() {
                let [x, y, _] = cells;
                let cell = [n % x, n / x % y, n / (x * y)];
                bins.add(n, &Vec3::from(cell.map(|i| i as f64 + 0.5)));
            }
            bins.around(&Vec3::repeat(2.5)).map(<[usize]>::len).sum::<usize>()
        };
        assert_eq!(nearby([20, 20, 20]), 27);
        assert_eq!(nearby([4, 4, 500]), 27);
    }
}
