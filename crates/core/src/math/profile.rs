//! Profile of a velocity over a face of the box, with a mean of 1, and parts of faces.
//!
//! ```text
//! parabolic   product over the directions along the face with walls   6 s (1 - s),  s = (x - x_0) / H
//! round       2 max(0, 1 - r^2 / R^2)
//! ```

/// Profile of a velocity over a face, with lengths in any unit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Profile {
    /// The same everywhere.
    #[default]
    Uniform,
    /// That of a flow between walls, in each direction that has some: position of the lower one, and the distance to the upper one. A plane
    /// of symmetry is half-way between two.
    Parabolic([Option<[f64; 2]>; 3]),
    /// That of a flow in a pipe.
    Round {
        /// A point of its axis.
        centre: [f64; 3],
        /// Direction of the axis.
        axis: usize,
        /// Radius.
        radius: f64,
    },
}

impl Profile {
    /// Velocity over its mean at a position.
    pub fn at(&self, position: [f64; 3]) -> f64 {
        match self {
            Self::Uniform => 1.0,
            Self::Parabolic(walls) => (0..3).fold(1.0, |product, a| match walls[a] {
                None => product,
                Some([lower, distance]) => {
                    let s = (position[a] - lower) / distance;
                    product * (6.0 * s * (1.0 - s)).max(0.0)
                }
            }),
            Self::Round { centre, axis, radius } => {
                let squares = (0..3).filter(|a| a != axis).map(|a| {
                    let r = (position[a] - centre[a]) / radius;
                    r * r
                });
                2.0 * (1.0 - squares.sum::<f64>()).max(0.0)
            }
        }
    }

    /// The same with all lengths multiplied by a factor.
    #[must_use]
    pub fn scaled(&self, by: f64) -> Self {
        match *self {
            Self::Uniform => Self::Uniform,
            Self::Parabolic(walls) => Self::Parabolic(walls.map(|wall| wall.map(|n| n.map(|n| n * by)))),
            Self::Round { centre, axis, radius } => {
                Self::Round { centre: centre.map(|n| n * by), axis, radius: radius * by }
            }
        }
    }

    /// Largest value.
    pub fn largest(&self) -> f64 {
        match self {
            Self::Uniform => 1.0,
            Self::Parabolic(walls) => walls.iter().flatten().fold(1.0, |most, _| 1.5 * most),
            Self::Round { .. } => 2.0,
        }
    }
}

/// Part of a face, which has the cells whose centres it has; lengths in any unit. Coordinates along the normal do not matter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Patch {
    /// A disc.
    Disc {
        /// Its middle.
        centre: [f64; 3],
        /// Axis of the normal.
        axis: usize,
        /// Radius.
        radius: f64,
    },
    /// A rectangle.
    Rectangle {
        /// Lower corner.
        lower: [f64; 3],
        /// Upper corner.
        upper: [f64; 3],
        /// Axis of the normal.
        axis: usize,
    },
}

impl Patch {
    /// True of a position in it.
    pub fn has(&self, at: [f64; 3]) -> bool {
        match self {
            Self::Disc { centre, axis, radius } => {
                let squares = (0..3).filter(|a| a != axis).map(|a| (at[a] - centre[a]) * (at[a] - centre[a]));
                squares.sum::<f64>() <= radius * radius
            }
            Self::Rectangle { lower, upper, axis } => {
                (0..3).filter(|a| a != axis).all(|a| (lower[a]..upper[a]).contains(&at[a]))
            }
        }
    }

    /// Interval that it has along an axis.
    pub fn along(&self, a: usize) -> [f64; 2] {
        match self {
            Self::Disc { centre, radius, .. } => [centre[a] - radius, centre[a] + radius],
            Self::Rectangle { lower, upper, .. } => [lower[a], upper[a]],
        }
    }

    /// The same with all lengths multiplied by a factor.
    #[must_use]
    pub fn scaled(&self, by: f64) -> Self {
        let scaled = |lengths: [f64; 3]| lengths.map(|length| length * by);
        match *self {
            Self::Disc { centre, axis, radius } => {
                Self::Disc { centre: scaled(centre), axis, radius: radius * by }
            }
            Self::Rectangle { lower, upper, axis } => {
                Self::Rectangle { lower: scaled(lower), upper: scaled(upper), axis }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_patch_has_what_is_in_it_wherever_along_the_normal() {
        let disc = Patch::Disc { centre: [0.0, 2.0, 3.0], axis: 0, radius: 1.0 };
        let rectangle = Patch::Rectangle { lower: [9.0, 1.0, 2.0], upper: [9.0, 3.0, 4.0], axis: 0 };
        for (corner, patch) in [(false, disc), (true, rectangle)] {
            assert!(patch.has([5.0, 2.9, 3.0]) && !patch.has([5.0, 2.0, 4.1]), "{patch:?}");
            assert!(patch.has([5.0, 2.9, 3.9]) == corner && patch.scaled(2.0).has([5.0, 5.8, 6.0]));
            assert_eq!([1, 2].map(|a| patch.along(a).map(|x| x as i32)), [[1, 3], [2, 4]]);
        }
    }

    #[test]
    fn the_mean_of_a_profile_is_1_and_it_vanishes_at_walls() {
        let half = Profile::Parabolic([Some([0.0, 2.0]), None, None]);
        let duct = Profile::Parabolic([Some([0.0, 1.0]), Some([-1.0, 2.0]), None]);
        let round = Profile::Round { centre: [0.5, 0.5, 0.0], axis: 2, radius: 0.5 };
        let n = 200;
        for (profile, area) in [
            (Profile::Uniform, 1.0),
            (half, 1.0),
            (duct, 1.0),
            (round, std::f64::consts::FRAC_PI_4),
            (round.scaled(2.0).scaled(0.5), std::f64::consts::FRAC_PI_4),
        ] {
            let at = |k: i32| (f64::from(k) + 0.5) / f64::from(n);
            let all = (0..n * n).map(|k| profile.at([at(k % n), at(k / n), 7.0]));
            let mean = all.clone().sum::<f64>() / f64::from(n * n) / area;
            assert!((mean - 1.0).abs() < 1e-4, "{profile:?}: {mean}");
            let most = all.fold(0.0, f64::max);
            assert!((profile.largest() / most - 1.0).abs() < 1e-4, "{profile:?}");
        }
        for at in [[0.0, 0.3, 0.0], [0.4, 1.0, 0.0], [1.0, 1.0, 0.0]] {
            assert!(duct.at(at).abs() < 1e-15 && round.at([at[0], 1.0, 0.0]).abs() < 1e-15);
        }
    }
}
