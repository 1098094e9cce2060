//! The D3Q19 velocity set, numbered so that opposite directions are neighbours.
//!
//! Direction 0 rests; `2k - 1` and `2k` (`k = 1..=9`) are opposite. Axes come first, then diagonals:
//!
//! ```text
//!  1  2   +x -x      7  8   +x+y -x-y     11 12   +x+z -x-z     15 16   +y+z -y-z
//!  3  4   +y -y      9 10   +x-y -x+y     13 14   +x-z -x+z     17 18   +y-z -y+z
//!  5  6   +z -z
//! ```
//!
//! Weights: 1/3 at rest, 1/18 along axes, 1/36 along diagonals; speed of sound squared 1/3.
//! Reference: Qian, d'Humieres, Lallemand (1992), doi:10.1209/0295-5075/17/6/001.

/// Number of populations of a cell.
pub const Q: usize = 19;

/// Velocities (cells per time step).
#[rustfmt::skip]
pub const C: [[isize; 3]; Q] = [
    [0, 0, 0],
    [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1],
    [1, 1, 0], [-1, -1, 0], [1, -1, 0], [-1, 1, 0],
    [1, 0, 1], [-1, 0, -1], [1, 0, -1], [-1, 0, 1],
    [0, 1, 1], [0, -1, -1], [0, 1, -1], [0, -1, 1],
];

/// Weights.
pub const W: [f64; Q] = {
    let mut w = [1.0 / 36.0; Q];
    w[0] = 1.0 / 3.0;
    let mut i = 1;
    while i < 7 {
        w[i] = 1.0 / 18.0;
        i += 1;
    }
    w
};

/// Number of the opposite direction.
#[inline]
pub const fn opposite(i: usize) -> usize {
    if i == 0 { 0 } else { i + 2 * (i % 2) - 1 }
}

/// Equilibrium populations at density `rho` and velocity `u`, minus the weights:
/// `w_i (rho (1 + 3 c.u + 4.5 (c.u)^2 - 1.5 u.u) - 1)`.
pub fn shifted_equilibrium(rho: f64, u: [f64; 3]) -> [f64; Q] {
    let uu = u[0] * u[0] + u[1] * u[1] + u[2] * u[2];
    std::array::from_fn(|i| {
        let cu: f64 = (0..3).map(|a| C[i][a] as f64 * u[a]).sum();
        W[i] * (rho * (1.0 + 3.0 * cu + 4.5 * cu * cu - 1.5 * uu) - 1.0)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn opposite_directions_cancel_and_are_mutual() {
        for i in 0..Q {
            assert_eq!(opposite(opposite(i)), i);
            assert!((0..3).all(|a| C[i][a] == -C[opposite(i)][a]));
        }
    }

    #[test]
    fn weights_are_isotropic_to_fourth_order() {
        let moment = |axes: &[usize]| -> f64 {
            (0..Q).map(|i| W[i] * axes.iter().map(|&a| C[i][a] as f64).product::<f64>()).sum()
        };
        let delta = |a: usize, b: usize| f64::from(u8::from(a == b));
        assert!((moment(&[]) - 1.0).abs() < 1e-15);
        for a in 0..3 {
            assert!(moment(&[a]).abs() < 1e-15);
            for b in 0..3 {
                assert!((moment(&[a, b]) - delta(a, b) / 3.0).abs() < 1e-15);
                for c in 0..3 {
                    assert!(moment(&[a, b, c]).abs() < 1e-15);
                    for d in 0..3 {
                        let isotropic =
                            delta(a, b) * delta(c, d) + delta(a, c) * delta(b, d) + delta(a, d) * delta(b, c);
                        assert!((moment(&[a, b, c, d]) - isotropic / 9.0).abs() < 1e-15);
                    }
                }
            }
        }
    }

    #[test]
    fn the_equilibrium_has_the_moments_it_was_given() {
        let (rho, u) = (1.03, [0.04, -0.02, 0.05]);
        let f = shifted_equilibrium(rho, u);
        assert!((1.0 + f.iter().sum::<f64>() - rho).abs() < 1e-14);
        for a in 0..3 {
            let momentum: f64 = (0..Q).map(|i| C[i][a] as f64 * f[i]).sum();
            assert!((momentum - rho * u[a]).abs() < 1e-14);
        }
    }
}
