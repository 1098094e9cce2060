//! Sums of numbers of any size that are the same to the bit in any order and on any number of ranks.

/// A sum whose terms are rounded to multiples of one unit, and then added up as integers.
///
/// ```text
/// unit = 2^(e - 61)     with the largest magnitude among all terms in [2^e, 2^(e + 1))
/// |sum - exact| <= n unit / 2 <= n 2^-62 largest     for n terms, before the sum becomes an `f64`
/// ```
///
/// The largest magnitude is found first, over all ranks; every term then is an integer below 2^62, and integers have
/// no order. Terms within a factor of 2^9 of the largest enter whole. A largest magnitude below 2^-900 counts as
/// 2^-900.
///
/// # Reference
/// Demmel, Nguyen (2013), doi:10.1109/ARITH.2013.9, whose one-bin case this is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReproducibleSum {
    /// The unit is `2^-digits`; `None` if a term is not finite.
    digits: Option<i32>,
    total: i128,
}

/// Binary digits of the largest terms.
const DIGITS: i32 = 61;
/// Exponent of the least magnitude that is distinguished from zero, so that `2^digits` is a number.
const LEAST: i32 = -900;

impl ReproducibleSum {
    /// An empty sum of terms of which none is larger than `largest`, the largest [`magnitude`] of all on all ranks.
    pub fn new(largest: f64) -> Self {
        let exponent = ((largest.to_bits() >> 52) & 0x7ff) as i32 - 1023;
        Self { digits: largest.is_finite().then_some(DIGITS - exponent.max(LEAST)), total: 0 }
    }

    /// Adds a term.
    pub fn add(&mut self, term: f64) {
        if let Some(digits) = self.digits {
            self.total += i128::from((term * power_of_two(digits)).round_ties_even() as i64);
        }
    }

    /// The integer so far: those of sums with the same largest magnitude add up to that of all their terms.
    pub fn total(&self) -> i128 {
        self.total
    }

    /// The number that a total of all ranks stands for; not a number if a term was none.
    pub fn value(&self, total: i128) -> f64 {
        self.digits.map_or(f64::NAN, |digits| total as f64 * power_of_two(-digits))
    }
}

/// Magnitude of a term; infinite if it is NaN, so that the largest one shows it.
pub fn magnitude(term: f64) -> f64 {
    if term.is_nan() { f64::INFINITY } else { term.abs() }
}

/// `2^exponent`, for exponents of normal numbers.
fn power_of_two(exponent: i32) -> f64 {
    f64::from_bits(((1023 + exponent) as u64) << 52)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers in (-1, 1) of a fixed sequence, times powers of two over `span` of them.
    fn numbers(count: usize, span: i32) -> Vec<f64> {
        let mut random = 5_u64;
        let mut next = || {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            random >> 33
        };
        (0..count)
            .map(|_| {
                let part = next() as f64 / f64::from(1_u32 << 30) - 1.0;
                part * power_of_two((next() % (span as u64 + 1)) as i32 - span / 2)
            })
            .collect()
    }

    fn largest(terms: &[f64]) -> f64 {
        terms.iter().fold(0.0, |most, &x| most.max(magnitude(x)))
    }

    fn sum(terms: &[f64]) -> f64 {
        let mut sum = ReproducibleSum::new(largest(terms));
        for &x in terms {
            sum.add(x);
        }
        sum.value(sum.total())
    }

    /// The sum in units of 2^-100, exact for numbers that are multiples of it and below 2^20.
    fn exact(terms: &[f64]) -> i128 {
        terms
            .iter()
            .map(|&x| {
                let bits = x.to_bits();
                let exponent = ((bits >> 52) & 0x7ff) as i32 - 1075;
                let mantissa = i128::from((bits & ((1 << 52) - 1)) | 1 << 52);
                let shift = exponent + 100;
                let size = if shift >= 0 { mantissa << shift } else { mantissa >> -shift };
                if x < 0.0 { -size } else { size }
            })
            .sum()
    }

    #[test]
    fn the_sum_is_the_exact_one_within_its_bound() {
        for span in [0, 8, 40] {
            let terms = numbers(10_000, span);
            let (got, exact) = (sum(&terms), exact(&terms) as f64 * power_of_two(-100));
            let bound = terms.len() as f64 * largest(&terms) * power_of_two(-62) + exact.abs() * f64::EPSILON;
            assert!((got - exact).abs() <= bound, "{got} {exact} {bound}");
        }
        // Whole where all terms are of one size.
        assert_eq!(sum(&[1.0, 1e-2, -1.0, -1e-2]).to_bits(), 0);
        assert_eq!(sum(&[0.1, 0.2]).to_bits(), (0.1_f64 + 0.2).to_bits());
    }

    #[test]
    fn neither_the_order_of_the_terms_nor_how_they_are_split_changes_a_bit() {
        let terms = numbers(3000, 60);
        let whole = sum(&terms);
        let mut shuffled = terms.clone();
        shuffled.sort_by(f64::total_cmp);
        assert_eq!(sum(&shuffled).to_bits(), whole.to_bits());
        let plain = |terms: &[f64]| terms.iter().sum::<f64>().to_bits();
        assert_ne!(plain(&shuffled), plain(&terms));
        for parts in [2, 3, 7] {
            let empty = ReproducibleSum::new(largest(&terms));
            let total: i128 = (0..parts)
                .map(|part| {
                    let mut sum = empty;
                    for &x in terms.iter().skip(part).step_by(parts) {
                        sum.add(x);
                    }
                    sum.total()
                })
                .sum();
            assert_eq!(empty.value(total).to_bits(), whole.to_bits(), "{parts} parts");
        }
    }

    #[test]
    fn no_terms_zeros_and_the_smallest_and_largest_numbers_have_sums() {
        let (max, min) = (f64::MAX, f64::MIN);
        let cases: [(&[f64], f64); 6] = [
            (&[], 0.0),
            (&[0.0, -0.0], 0.0),
            (&[f64::MIN_POSITIVE, 5e-324], 0.0), // below the least unit
            (&[1e-270, 1e-270], 2e-270),
            (&[max, min, 1.0], 0.0),
            (&[max, min, max], max),
        ];
        for (terms, expected) in cases {
            assert_eq!(sum(terms).to_bits(), expected.to_bits(), "{terms:?}");
        }
        assert!(sum(&[1.0, f64::NAN]).is_nan());
        assert!(sum(&[f64::INFINITY, 1.0]).is_nan());
    }
}
