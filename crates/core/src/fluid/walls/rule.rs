//! Rules of links: what comes back, within the step, for the population that a link takes to a wall.
//!
//! A rule is a variant with its arm in each of these functions, and one in `copy_links` of `device/kernels.cl`, where it has the same
//! name; `find` says which links have it. Links are stored in runs of one rule.

use super::CHUNK;
use crate::fluid::Population;

/// Rule of a link.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LinkRule {
    /// Half-way bounce-back off a wall at rest: what was sent.
    Resting,
    /// Off a moving wall: what was sent, and the number of the link, `6 w_i c_i . u_w`.
    Moving,
    /// Half-way bounce-back off both sides of a sheet at rest between two cells of fluid: what both have sent.
    TwoSided,
}

impl LinkRule {
    /// All rules, in the order of their numbers.
    pub(crate) const ALL: [Self; 3] = [Self::Resting, Self::Moving, Self::TwoSided];

    /// Name in the kernels of a device.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Resting => "RESTING",
            Self::Moving => "MOVING",
            Self::TwoSided => "TWO_SIDED",
        }
    }

    /// Numbers that each link has.
    #[inline(always)]
    pub(crate) fn numbers(self) -> usize {
        match self {
            Self::Resting | Self::TwoSided => 0,
            Self::Moving => 1,
        }
    }

    /// Applies the rule to `count` links with their numbers, from the slots at `from` to those at `to`.
    #[inline(always)]
    pub(super) fn apply<S: Population>(
        self,
        populations: &mut [S],
        [from, to]: [usize; 2],
        count: usize,
        numbers: &[S::Number],
    ) {
        match self {
            Self::Resting if count < CHUNK => {
                for k in 0..count {
                    populations[to + k] = populations[from + k];
                }
            }
            Self::Resting => populations.copy_within(from..from + count, to),
            Self::Moving => {
                for (k, &number) in numbers.iter().enumerate() {
                    populations[to + k] = S::round(populations[from + k].read() + number);
                }
            }
            Self::TwoSided => (0..count).for_each(|k| populations.swap(from + k, to + k)),
        }
    }

    /// Population that was sent along a link with its numbers, if this came back.
    pub(super) fn sent<S: Population>(self, returned: S, numbers: &[S::Number]) -> S {
        match self {
            Self::Resting | Self::TwoSided => returned,
            Self::Moving => S::round(returned.read() - numbers[0]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rule_returns_what_it_was_asked_to_return_for_what_it_says_was_sent() {
        for rule in LinkRule::ALL {
            for count in [1, CHUNK - 1, CHUNK, 3 * CHUNK] {
                // Sums of these are exact.
                let numbers: Vec<f64> = (0..rule.numbers() * count).map(|n| n as f64 / 64.0).collect();
                let returned: Vec<f64> = (0..count).map(|n| 0.5 - n as f64 / 128.0).collect();
                let mut populations = vec![0.0; 2 * count];
                for (k, &back) in returned.iter().enumerate() {
                    populations[k] = rule.sent(back, &numbers[rule.numbers() * k..]);
                }
                rule.apply(&mut populations, [0, count], count, &numbers);
                assert_eq!(populations[count..], returned, "{rule:?}, {count} links");
            }
        }
    }

    #[test]
    fn rules_have_the_numbers_of_their_order_and_an_arm_in_the_kernels() {
        for (number, rule) in LinkRule::ALL.into_iter().enumerate() {
            assert_eq!(rule as usize, number);
            let arm = format!("case {}:", rule.name());
            assert!(crate::fluid::device::KERNELS.contains(&arm), "{arm}");
        }
    }
}
