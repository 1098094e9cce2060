//! Profile of a velocity over a face of the box, and parts of faces.
//!
//! ```text
//! parabolic   product over the directions along the face with walls   6 s (1 - s),  s = (x - x_0) / H
//! round       2 max(0, 1 - r^2 / R^2)
//! table       linear in both directions between points of a grid
//! ```
//!
//! All but tables have a mean of 1.

use std::sync::Arc;

/// Profile of a velocity over a face, with lengths in any unit.
#[derive(Clone, Debug, Default, PartialEq)]
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
    /// Factors at the points of a grid.
    Table {
        /// The grid.
        grid: Arc<Grid>,
        /// Unit of its lengths.
        unit: f64,
    },
    /// Each patch has one of its own; zero elsewhere.
    Each(Arc<[(Patch, Self)]>),
}

impl Profile {
    /// Factor of the velocity at a position: over its mean, but for tables. Of several patches it is that which has the centre of the `cell`.
    pub fn at(&self, position: [f64; 3], cell: [f64; 3]) -> f64 {
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
            Self::Table { grid, unit } => grid.at(position.map(|x| x / unit)),
            Self::Each(parts) => {
                let part = parts.iter().find(|(patch, _)| patch.has(cell));
                part.map_or(0.0, |(_, part)| part.at(position, cell))
            }
        }
    }

    /// The same with all lengths multiplied by a factor.
    #[must_use]
    pub fn scaled(&self, by: f64) -> Self {
        match self {
            Self::Uniform => Self::Uniform,
            Self::Parabolic(walls) => Self::Parabolic(walls.map(|wall| wall.map(|n| n.map(|n| n * by)))),
            Self::Round { centre, axis, radius } => {
                Self::Round { centre: centre.map(|n| n * by), axis: *axis, radius: radius * by }
            }
            Self::Table { grid, unit } => Self::Table { grid: grid.clone(), unit: unit * by },
            Self::Each(parts) => {
                Self::Each(parts.iter().map(|(patch, part)| (patch.scaled(by), part.scaled(by))).collect())
            }
        }
    }

    /// Largest magnitude.
    pub fn largest(&self) -> f64 {
        match self {
            Self::Uniform => 1.0,
            Self::Parabolic(walls) => walls.iter().flatten().fold(1.0, |most, _| 1.5 * most),
            Self::Round { .. } => 2.0,
            Self::Table { grid, .. } => grid.values.iter().fold(0.0, |most, value| value.abs().max(most)),
            Self::Each(parts) => parts.iter().fold(0.0, |most, (_, part)| part.largest().max(most)),
        }
    }
}

/// Values at the points of a rectangular grid over a face, linear in both directions between them and constant beyond.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    /// Both axes along the face.
    pub axes: [usize; 2],
    /// Coordinates of the points along them, ascending; one point: the same everywhere along this axis.
    pub points: [Vec<f64>; 2],
    /// A value per point, those along the first axis next to each other.
    pub values: Vec<f64>,
}

impl Grid {
    /// The value at a position.
    pub fn at(&self, position: [f64; 3]) -> f64 {
        // The two points beside it, and how far it is from the first to the second.
        let [(i, s), (j, t)] = [0, 1].map(|a| {
            let (points, x) = (&self.points[a], position[self.axes[a]]);
            let [first, second] = match points.partition_point(|&point| point <= x) {
                0 => [0; 2],
                n => [n - 1, n.min(points.len() - 1)],
            };
            let width = points[second] - points[first];
            ([first, second], if width > 0.0 { (x - points[first]) / width } else { 0.0 })
        });
        let along = |j: usize| {
            let [from, to] = i.map(|i| self.values[j * self.points[0].len() + i]);
            from + s * (to - from)
        };
        let [from, to] = j.map(along);
        from + t * (to - from)
    }
}

/// Part of a face, which has the cells whose centres it has; lengths in any unit. Coordinates along the normal do not matter.
#[derive(Clone, Debug, PartialEq)]
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
    /// Several of the others.
    Several(Vec<Self>),
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
            Self::Several(parts) => parts.iter().any(|part| part.has(at)),
        }
    }

    /// Interval that it has along an axis.
    pub fn along(&self, a: usize) -> [f64; 2] {
        match self {
            Self::Disc { centre, radius, .. } => [centre[a] - radius, centre[a] + radius],
            Self::Rectangle { lower, upper, .. } => [lower[a], upper[a]],
            Self::Several(parts) => parts
                .iter()
                .map(|part| part.along(a))
                .fold([f64::INFINITY, f64::NEG_INFINITY], |[from, to], [start, end]| {
                    [from.min(start), to.max(end)]
                }),
        }
    }

    /// The same with all lengths multiplied by a factor.
    #[must_use]
    pub fn scaled(&self, by: f64) -> Self {
        let scaled = |lengths: [f64; 3]| lengths.map(|length| length * by);
        match self {
            Self::Disc { centre, axis, radius } => {
                Self::Disc { centre: scaled(*centre), axis: *axis, radius: radius * by }
            }
            Self::Rectangle { lower, upper, axis } => {
                Self::Rectangle { lower: scaled(*lower), upper: scaled(*upper), axis: *axis }
            }
            Self::Several(parts) => Self::Several(parts.iter().map(|part| part.scaled(by)).collect()),
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
    fn several_patches_have_what_one_of_them_has_and_each_its_own_profile() {
        let slot =
            |from: f64| Patch::Rectangle { lower: [from, 0.0, 0.0], upper: [from + 1.0, 4.0, 0.0], axis: 2 };
        let parts = [0.0, 3.0].map(|from| (slot(from), Profile::Parabolic([Some([from, 1.0]), None, None])));
        let patch = Patch::Several(parts.iter().map(|(patch, _)| patch.clone()).collect()).scaled(2.0);
        let profile = Profile::Each(parts.into()).scaled(2.0);
        for (x, factor) in [(1.0, Some(1.5)), (3.0, None), (7.0, Some(1.5)), (6.5, Some(1.125)), (9.0, None)]
        {
            let at = [x, 3.0, 9.0];
            assert_eq!(patch.has(at), factor.is_some(), "{x}");
            assert!((profile.at(at, at) - factor.unwrap_or(0.0)).abs() < 1e-15, "{x}");
        }
        assert!((profile.largest() - 1.5).abs() < 1e-15);
        assert_eq!(patch.along(0).map(|x| x as i32), [0, 8]);
    }

    #[test]
    fn a_table_is_linear_between_its_points_and_constant_beyond() {
        // 1 + 2 y + 3 z + 4 y z is linear along each axis.
        let exact = |y: f64, z: f64| 1.0 + 2.0 * y + 3.0 * z + 4.0 * y * z;
        let points = [vec![0.0, 0.25, 1.0], vec![-1.0, 2.0]];
        let values = points[1].iter().flat_map(|&z| points[0].iter().map(move |&y| exact(y, z))).collect();
        let table = Profile::Table { grid: Arc::new(Grid { axes: [1, 2], points, values }), unit: 1.0 };
        for (y, z) in [(0.0, -1.0), (0.1, 0.3), (0.7, 1.9), (1.0, 2.0), (-3.0, 0.5), (5.0, 7.0)] {
            let expected = exact(f64::clamp(y, 0.0, 1.0), f64::clamp(z, -1.0, 2.0));
            for scale in [1.0, 8.0] {
                let found = table.scaled(scale).at([7.0, y * scale, z * scale], [0.0; 3]);
                assert!((found - expected).abs() < 1e-13, "{y} {z}: {found} {expected}");
            }
        }
        assert!((table.largest() - exact(1.0, 2.0)).abs() < 1e-14);
        let line = Grid { axes: [1, 2], points: [vec![3.0], vec![0.0, 1.0]], values: vec![0.0, 2.0] };
        for y in [-1.0, 3.0, 9.0] {
            assert!((line.at([0.0, y, 0.25]) - 0.5).abs() < 1e-15);
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
            (duct.clone(), 1.0),
            (round.clone(), std::f64::consts::FRAC_PI_4),
            (round.scaled(2.0).scaled(0.5), std::f64::consts::FRAC_PI_4),
        ] {
            let at = |k: i32| (f64::from(k) + 0.5) / f64::from(n);
            let all = (0..n * n).map(|k| profile.at([at(k % n), at(k / n), 7.0], [0.0; 3]));
            let mean = all.clone().sum::<f64>() / f64::from(n * n) / area;
            assert!((mean - 1.0).abs() < 1e-4, "{profile:?}: {mean}");
            let most = all.fold(0.0, f64::max);
            assert!((profile.largest() / most - 1.0).abs() < 1e-4, "{profile:?}");
        }
        for at in [[0.0, 0.3, 0.0], [0.4, 1.0, 0.0], [1.0, 1.0, 0.0]] {
            assert!(duct.at(at, at).abs() < 1e-15 && round.at([at[0], 1.0, 0.0], at).abs() < 1e-15);
        }
    }
}
