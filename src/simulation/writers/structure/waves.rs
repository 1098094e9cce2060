//! Structure factor: sums of plane waves over the centres, for all wave vectors of the periodic axes up to a length.
//!
//! ```text
//! S(k) = |sum exp(i k x)|^2 / N      k = 2 pi (n_x / L_x, n_y / L_y, n_z / L_z), n = 0 along closed axes
//! ```
//!
//! in the mean over the `k` of a shell as thick as `2 pi / L` of the longest periodic edge. The sums are fixed-point numbers, the same bits on any ranks.

use crate::domain::Domain;
use crate::math::{Vec3, to_fixed};
use crate::simulation::observe::Sums;
use std::f64::consts::TAU;

/// Particles whose fixed-point numbers, of order one, can be added in 64 bits.
const FITTING: usize = 1 << 20;

/// The wave vectors, of each two of opposite direction one: rows along x of one `n_y`, `n_z`.
pub(super) struct Waves {
    domain: Domain,
    /// Largest `n` along each axis.
    most: [i32; 3],
    /// `n_y` and `n_z` of a row, and its first and last `n_x`.
    rows: Vec<([i32; 2], [i32; 2])>,
    /// Shell of each wave vector.
    shells: Vec<usize>,
    /// Mean wave number (1/m) and number of the wave vectors of each shell.
    means: Vec<(f64, f64)>,
}

impl Waves {
    /// Those down to a wavelength (m).
    pub(super) fn new(domain: Domain, shortest: f64) -> Self {
        let size = domain.size();
        let edge = |axis: usize| if domain.is_periodic(axis) { size[axis] } else { 0.0 };
        let longest = (0..3).map(edge).fold(0.0, f64::max);
        let most = [0, 1, 2].map(|axis| (edge(axis) / shortest) as i32);
        let number = |n: [i32; 3]| {
            let squares = [0, 1, 2].map(|axis| f64::from(n[axis]) / size[axis]).map(|k| k * k);
            (squares[0] + squares[1] + squares[2]).sqrt()
        };
        let mut waves = Self { domain, most, rows: Vec::new(), shells: Vec::new(), means: Vec::new() };
        let [of_x, of_y, of_z] = most;
        for (z, y) in (0..=of_z).flat_map(|z| (-of_y..=of_y).map(move |y| (z, y))) {
            // The opposite of a vector is left out, and so is zero.
            let from = if z > 0 || y > 0 { -of_x } else { 1 };
            if z == 0 && y < 0 {
                continue;
            }
            let all = (from..=of_x).map(|x| (x, number([x, y, z])));
            let within: Vec<(i32, f64)> = all.filter(|of| of.1 * shortest <= 1.0 + 1e-9).collect();
            let (Some(first), Some(last)) = (within.first(), within.last()) else { continue };
            waves.rows.push(([y, z], [first.0, last.0]));
            for (_, number) in within {
                let shell = (number * longest).round() as usize;
                waves.means.resize(waves.means.len().max(shell + 1), (0.0, 0.0));
                waves.means[shell].0 += TAU * number;
                waves.means[shell].1 += 1.0;
                waves.shells.push(shell);
            }
        }
        for (sum, count) in &mut waves.means {
            *sum /= *count;
        }
        waves
    }

    /// Number of sums: of cosines, then of sines, of each wave vector.
    pub(super) fn sums(&self) -> usize {
        2 * self.shells.len()
    }

    /// Number of shells.
    pub(super) fn shells(&self) -> usize {
        self.means.len()
    }

    /// Adds the waves of some centres (m) to the sums from `first` on.
    pub(super) fn add(&self, centres: &[Vec3], sums: &mut Sums, first: usize) {
        for centres in centres.chunks(FITTING) {
            let mut own = vec![0_i64; self.sums()];
            let (cosines, sines) = own.split_at_mut(self.shells.len());
            for centre in centres {
                self.add_one(centre, cosines, sines);
            }
            sums.add_integers(first, &own);
        }
    }

    fn add_one(&self, centre: &Vec3, mut cosines: &mut [i64], mut sines: &mut [i64]) {
        let size = self.domain.size();
        // exp(i n 2 pi x / L) for n from the lowest on.
        let powers = [0, 1, 2].map(|axis| {
            let (sin, cos) = libm::sincos(TAU * centre[axis] / size[axis]);
            let upwards = std::iter::successors(Some((1.0, 0.0)), move |&(re, im)| {
                Some((re * cos - im * sin, re * sin + im * cos))
            });
            let positive: Vec<(f64, f64)> = upwards.take(self.most[axis] as usize + 1).collect();
            let negative = positive.iter().skip(1).rev().map(|&(re, im)| (re, -im));
            negative.chain(positive.iter().copied()).collect::<Vec<_>>()
        });
        let power = |axis: usize, n: i32| (n + self.most[axis]) as usize;
        for ([y, z], [low, high]) in &self.rows {
            let ((a, b), (c, d)) = (powers[1][power(1, *y)], powers[2][power(2, *z)]);
            let (re, im) = (a * c - b * d, a * d + b * c);
            let along = &powers[0][power(0, *low)..=power(0, *high)];
            let (own_cosines, other_cosines) = cosines.split_at_mut(along.len());
            let (own_sines, other_sines) = sines.split_at_mut(along.len());
            for (((x, y), cosine), sine) in along.iter().zip(own_cosines).zip(own_sines) {
                *cosine += to_fixed(x * re - y * im);
                *sine += to_fixed(x * im + y * re);
            }
            (cosines, sines) = (other_cosines, other_sines);
        }
    }

    /// Wave number (1/m) and structure factor of each shell with wave vectors, from the sums over `count` particles.
    pub(super) fn factors(&self, sums: &[f64], count: f64) -> Vec<[f64; 2]> {
        let (cosines, sines) = sums.split_at(self.shells.len());
        let mut totals = vec![0.0; self.means.len()];
        for ((shell, re), im) in self.shells.iter().zip(cosines).zip(sines) {
            totals[*shell] += re * re + im * im;
        }
        let shells = self.means.iter().zip(totals).filter(|((_, vectors), _)| *vectors > 0.0);
        shells.map(|((k, vectors), total)| [*k, total / (vectors * count)]).collect()
    }
}
