//! Bodies near a position, while bodies move one by one.

use crate::domain::Domain;
use crate::math::Vec3;

/// Bodies of a class are at most this many times as wide as each other.
const CLASS: f64 = 2.0;
/// Width of a bin in reaches of the widest body of its class: few bins are near a body, and their bodies lie side by side in memory.
const WIDTH: f64 = 4.0;
/// Bodies of a bin that are compared at once.
const LANES: usize = 4;
/// A place without a body: its coordinates are infinite, so that it is near nothing.
const NOBODY: u32 = u32::MAX;
/// Bound of the error of a distance between coordinates in single precision, relative to the largest coordinate: two
/// coordinates are rounded in each of three directions.
const ROUNDING: f64 = 4e-7;
/// The same of the square of a distance, relative to it.
const ROUNDING_OF_SQUARES: f64 = 1e-6;
/// Bins by which no range reaches beyond the box.
const BEYOND: f64 = (1_u64 << 20) as f64;

/// Bodies sorted into bins, those of about the same size into bins of their own.
///
/// Bins hold coordinates in single precision, by which nearly all bodies are ruled out.
#[derive(Debug)]
pub(super) struct Bins {
    layers: Vec<Layer>,
    /// Class of each body.
    class_of: Vec<u16>,
}

/// Bodies of one class.
#[derive(Debug)]
struct Layer {
    size: Vec3,
    periodic: [bool; 3],
    /// Reach (m) of the widest one.
    widest: f64,
    /// One over it (1/m).
    unit: f64,
    /// Bound (m) of the errors of distances.
    rounding: f64,
    /// Bins along each axis, and per metre.
    counts: [isize; 3],
    per_metre: Vec3,
    /// Groups of a bin, one after another, and all of them.
    groups_per_bin: usize,
    groups: Vec<Group>,
}

/// Some bodies of a bin, in one line of the cache: their coordinates in units of the widest reach, and their numbers.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct Group {
    at: [[f32; LANES]; 3],
    numbers: [u32; LANES],
}

const EMPTY: Group = Group { at: [[f32::INFINITY; LANES]; 3], numbers: [NOBODY; LANES] };

impl Bins {
    /// Bins with these bodies: wrapped positions, and how far (m) each reaches.
    pub(super) fn new(domain: &Domain, bodies: impl Iterator<Item = (Vec3, f64)> + Clone) -> Self {
        let mut reaches: Vec<f64> = bodies.clone().map(|(_, reach)| reach).collect();
        reaches.sort_unstable_by(|a, b| b.total_cmp(a));
        let furthest =
            bodies.clone().map(|(position, _)| position.amax()).fold(domain.size().max(), f64::max);
        let mut layers: Vec<Layer> = Vec::new();
        let mut rest = &reaches[..];
        while let Some(&widest) = rest.first() {
            let count = rest.partition_point(|reach| reach * CLASS >= widest);
            layers.push(Layer::new(domain, widest, count, ROUNDING * furthest));
            rest = &rest[count..];
        }
        let class = |reach: f64| layers.partition_point(|layer| reach * CLASS < layer.widest) as u16;
        let class_of = bodies.clone().map(|(_, reach)| class(reach)).collect();
        let mut bins = Self { layers, class_of };
        for (number, (position, _)) in bodies.enumerate() {
            bins.layer(number).add(number as u32, &position);
        }
        bins
    }

    fn layer(&mut self, number: usize) -> &mut Layer {
        &mut self.layers[usize::from(self.class_of[number])]
    }

    /// The body with this number has moved.
    pub(super) fn shift(&mut self, number: usize, from: &Vec3, to: &Vec3) {
        self.layer(number).shift(number as u32, from, to);
    }

    /// True if `meets` is true for the number of a body. It is asked for all whose spheres, or images of them, meet one
    /// with this `reach` (m) about a wrapped `position`, and for few others.
    pub(super) fn any(&self, position: &Vec3, reach: f64, mut meets: impl FnMut(usize) -> bool) -> bool {
        self.layers.iter().any(|layer| layer.any(position, reach, &mut meets))
    }
}

impl Layer {
    /// Empty, for about `count` bodies.
    fn new(domain: &Domain, widest: f64, count: usize, rounding: f64) -> Self {
        let size = domain.size();
        let mut counts: [isize; 3] = std::array::from_fn(|i| ((size[i] / (WIDTH * widest)) as isize).max(1));
        // At most two bins per body, else a large dilute box would be mostly empty bins.
        while counts.iter().map(|&n| n as f64).product::<f64>() > (2 * count) as f64 {
            let longest = (1..3).fold(0, |best, i| if counts[i] > counts[best] { i } else { best });
            counts[longest] = (counts[longest] + 1) / 2;
        }
        let per_metre = Vec3::from_fn(|i, _| counts[i] as f64 / size[i]);
        let groups = vec![EMPTY; counts.iter().product::<isize>() as usize];
        Self {
            size,
            periodic: domain.periodic(),
            widest,
            unit: 1.0 / widest,
            rounding,
            counts,
            per_metre,
            groups_per_bin: 1,
            groups,
        }
    }

    /// The groups of the bin of a wrapped position.
    fn bin(&self, position: &Vec3) -> std::ops::Range<usize> {
        let place: [usize; 3] = std::array::from_fn(|i| {
            ((position[i] * self.per_metre[i]) as usize).min(self.counts[i] as usize - 1)
        });
        let first = self.groups_per_bin * self.index(place.map(|n| n as isize));
        first..first + self.groups_per_bin
    }

    fn index(&self, place: [isize; 3]) -> usize {
        (place[0] + self.counts[0] * (place[1] + self.counts[1] * place[2])) as usize
    }

    fn find(&self, bin: std::ops::Range<usize>, number: u32) -> Option<(usize, usize)> {
        bin.flat_map(|group| (0..LANES).map(move |lane| (group, lane)))
            .find(|&(group, lane)| self.groups[group].numbers[lane] == number)
    }

    fn set(&mut self, (group, lane): (usize, usize), number: u32, position: &Vec3) {
        for i in 0..3 {
            self.groups[group].at[i][lane] = (position[i] * self.unit) as f32;
        }
        self.groups[group].numbers[lane] = number;
    }

    fn add(&mut self, number: u32, position: &Vec3) {
        let place = loop {
            match self.find(self.bin(position), NOBODY) {
                Some(place) => break place,
                None => self.grow(),
            }
        };
        self.set(place, number, position);
    }

    /// Makes room in all bins.
    fn grow(&mut self) {
        let grown =
            self.groups.chunks(self.groups_per_bin).flat_map(|bin| bin.iter().copied().chain([EMPTY]));
        self.groups = grown.collect();
        self.groups_per_bin += 1;
    }

    fn shift(&mut self, number: u32, from: &Vec3, to: &Vec3) {
        let bin = self.bin(from);
        let place = self.find(bin.clone(), number).expect("it is where it was put");
        if bin == self.bin(to) {
            self.set(place, number, to);
            return;
        }
        // The last one of the bin takes its place.
        let mut lanes = bin.rev().flat_map(|group| (0..LANES).rev().map(move |lane| (group, lane)));
        let last = lanes.find(|&(group, lane)| self.groups[group].numbers[lane] != NOBODY);
        let last = last.expect("there is one");
        for i in 0..3 {
            self.groups[place.0].at[i][place.1] = self.groups[last.0].at[i][last.1];
            self.groups[last.0].at[i][last.1] = f32::INFINITY;
        }
        self.groups[place.0].numbers[place.1] = self.groups[last.0].numbers[last.1];
        self.groups[last.0].numbers[last.1] = NOBODY;
        self.add(number, to);
    }

    fn any(&self, position: &Vec3, reach: f64, meets: &mut impl FnMut(usize) -> bool) -> bool {
        let range = reach + self.widest + self.rounding;
        // Bins, and images of them, that the range touches.
        let bins: [[isize; 2]; 3] = std::array::from_fn(|i| {
            // Rounds down where `as` alone rounds to zero.
            let bin = |x: f64| (x * self.per_metre[i] + BEYOND) as isize - BEYOND as isize;
            let ends = [-range, range].map(|d| bin(position[i] + d));
            if self.periodic[i] { ends } else { ends.map(|bin| bin.clamp(0, self.counts[i] - 1)) }
        });
        // The bin of an image, and the position as seen from there.
        let seen = |i: usize, mut bin: isize| {
            let mut x = position[i];
            while bin < 0 {
                bin += self.counts[i];
                x += self.size[i];
            }
            while bin >= self.counts[i] {
                bin -= self.counts[i];
                x -= self.size[i];
            }
            (bin, (x * self.unit) as f32)
        };
        let limit = (range * self.unit * (range * self.unit) * (1.0 + ROUNDING_OF_SQUARES)) as f32;
        let [xs, ys, zs] = bins.map(|[first, last]| first..=last);
        for z in zs {
            let (bz, z) = seen(2, z);
            for y in ys.clone() {
                let (by, y) = seen(1, y);
                for x in xs.clone() {
                    let (bx, x) = seen(0, x);
                    let first = self.groups_per_bin * self.index([bx, by, bz]);
                    for group in &self.groups[first..first + self.groups_per_bin] {
                        if group.any(&[x, y, z], limit, meets) {
                            return true;
                        }
                        if group.numbers[LANES - 1] == NOBODY {
                            break;
                        }
                    }
                }
            }
        }
        false
    }
}

impl Group {
    /// True if `meets` is true for the number of one whose squared distance is within the limit.
    fn any(&self, seen: &[f32; 3], limit: f32, meets: &mut impl FnMut(usize) -> bool) -> bool {
        let mut square = [0.0; LANES];
        for (at, seen) in self.at.iter().zip(seen) {
            for (square, at) in square.iter_mut().zip(at) {
                *square += (at - seen) * (at - seen);
            }
        }
        let mut near = (0..LANES).fold(0_u32, |near, lane| near | u32::from(square[lane] <= limit) << lane);
        while near != 0 {
            if meets(self.numbers[near.trailing_zeros() as usize] as usize) {
                return true;
            }
            near &= near - 1;
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::packing::Uniform;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;

    #[test]
    fn all_that_may_meet_are_asked_while_bodies_of_many_sizes_move_and_few_others() {
        for (cells, periodic) in
            [([9, 11, 30], [true; 3]), ([4, 3, 5], [true, false, true]), ([2, 2, 2], [true; 3])]
        {
            let domain = Domain { faces: Domain::faces(periodic), cells, dx: 0.5 };
            let mut random = Uniform(ChaCha8Rng::seed_from_u64(3));
            let size = domain.size();
            let mut place = || domain.wrap(Vec3::from_fn(|i, _| random.next() * size[i]));
            let mut positions: Vec<Vec3> = (0..400).map(|_| place()).collect();
            let reaches: Vec<f64> = (0..400).map(|n| 0.6 / f64::from(1 + n % 20)).collect();
            let mut bins = Bins::new(&domain, positions.iter().copied().zip(reaches.iter().copied()));
            let (mut meeting, mut asked) = (0, 0);
            for n in 0..2000 {
                let (number, to) = (n * 7 % 400, place());
                let reach = reaches[number];
                let mut seen = vec![false; positions.len()];
                assert!(!bins.any(&to, reach, |other| {
                    seen[other] = true;
                    false
                }));
                for (other, position) in positions.iter().enumerate() {
                    let near = reach + reaches[other];
                    let meets = domain.images(position - to, near).any(|offset| offset.norm() <= near);
                    assert!(seen[other] || !meets, "{other} near {number}");
                    meeting += usize::from(meets);
                    asked += usize::from(seen[other]);
                }
                bins.shift(number, &positions[number], &to);
                positions[number] = to;
            }
            assert!(meeting > 400 && asked < 4 * meeting, "{meeting} of {asked}");
        }
    }

    #[test]
    fn in_a_long_box_a_bin_has_no_more_bodies_than_in_a_cube() {
        let groups = |cells: [usize; 3]| {
            let domain = Domain { faces: Domain::faces([true; 3]), cells, dx: 1.0 };
            let at = |n: usize| {
                let [x, y, _] = cells;
                Vec3::from([n % x, n / x % y, n / (x * y)].map(|i| i as f64 + 0.5))
            };
            let bins = Bins::new(&domain, (0..domain.cell_count()).map(|n| (at(n), 0.5)));
            bins.layers[0].groups_per_bin
        };
        assert_eq!(groups([20, 20, 20]), 2);
        assert_eq!(groups([4, 4, 500]), 2);
    }
}
