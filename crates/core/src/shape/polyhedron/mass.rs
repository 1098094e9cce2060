//! Volume, centre of mass and principal axes of a closed surface of triangles, by the divergence theorem.
//!
//! Each triangle spans a tetrahedron with a reference point; the tetrahedron `(0, a, b, c)` with `det = a . (b x c)`
//! has the volume `det / 6`, the first moment `det / 24 (a + b + c)` and the second moment
//! `int x x^T dV = det / 120 (s s^T + a a^T + b b^T + c c^T)`, `s = a + b + c`. Signed sums over all triangles are
//! those of the body (Tonon 2004, doi:10.3844/jmssp.2005.8.11, in matrix form).

use crate::math::{Mat3, Quat, Vec3, nalgebra};

/// Off-diagonal elements of the tensor of inertia below this part of the largest diagonal element are rounding: axes
/// that are principal up to then stay, and bodies with equal moments keep the axes they are given in.
const ALREADY_DIAGONAL: f64 = 1e-12;

/// Integrals over a body.
#[derive(Clone, Copy, Debug)]
pub struct Mass {
    /// Volume (m^3).
    pub volume: f64,
    /// Centre of mass (m).
    pub centre: Vec3,
    /// `int x x^T dV / volume` about the centre of mass (m^2).
    pub spread: Mat3,
}

/// Integrals over the body that triangles, counter-clockwise from outside, enclose.
pub fn mass(triangles: impl Iterator<Item = [Vec3; 3]>, reference: Vec3) -> Mass {
    let (mut volume, mut first, mut second) = (0.0, Vec3::zeros(), Mat3::zeros());
    for corners in triangles {
        let [a, b, c] = corners.map(|corner| corner - reference);
        let det = a.dot(&b.cross(&c));
        let sum = a + b + c;
        volume += det / 6.0;
        first += sum * (det / 24.0);
        second += (sum * sum.transpose() + a * a.transpose() + b * b.transpose() + c * c.transpose())
            * (det / 120.0);
    }
    let centre = first / volume;
    Mass { volume, centre: reference + centre, spread: second / volume - centre * centre.transpose() }
}

/// Moments of inertia per unit of mass along the axes (m^2), and products of inertia, from [`Mass::spread`].
pub fn inertia(spread: &Mat3) -> Mat3 {
    Mat3::identity() * spread.trace() - spread
}

/// Rotation whose columns are the principal axes of a symmetric tensor: as close to the identity as Jacobi's
/// rotations lead (Golub and Van Loan 1996, section 8.4), and the identity if the tensor is diagonal up to rounding.
///
/// Own, as it needs only operations that are rounded alike everywhere: the general solver in nalgebra reaches for
/// kernels that depend on the processor.
pub fn principal_axes(tensor: &Mat3) -> Quat {
    let mut tensor = *tensor;
    let mut axes = Mat3::identity();
    let largest = tensor.diagonal().amax();
    let is_small = |x: f64| x.abs() <= ALREADY_DIAGONAL * largest;
    if is_small(tensor[(0, 1)]) && is_small(tensor[(0, 2)]) && is_small(tensor[(1, 2)]) {
        return Quat::identity();
    }
    // Each sweep squares the error: six are plenty.
    for (i, j) in [(0, 1), (0, 2), (1, 2)].repeat(8) {
        if tensor[(i, j)] == 0.0 {
            continue;
        }
        let theta = (tensor[(j, j)] - tensor[(i, i)]) / (2.0 * tensor[(i, j)]);
        let tangent = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
        let cosine = 1.0 / (tangent * tangent + 1.0).sqrt();
        let mut turn = Mat3::identity();
        (turn[(i, i)], turn[(j, j)]) = (cosine, cosine);
        (turn[(i, j)], turn[(j, i)]) = (cosine * tangent, -cosine * tangent);
        tensor = turn.transpose() * tensor * turn;
        axes *= turn;
    }
    Quat::from_rotation_matrix(&nalgebra::Rotation3::from_matrix_unchecked(axes))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn principal_axes_turn_a_tensor_diagonal() {
        let moments = Vec3::new(1.0, 2.0, 4.0);
        for turn in [Vec3::new(0.3, -0.2, 0.9), Vec3::new(2.0, 1.0, -1.0), Vec3::new(0.0, 0.0, 0.1)] {
            let turn = Quat::from_scaled_axis(turn).to_rotation_matrix();
            let tensor = turn * Mat3::from_diagonal(&moments) * turn.transpose();
            let axes = principal_axes(&tensor).to_rotation_matrix();
            let mut diagonal = axes.transpose() * tensor * axes;
            let mut found: Vec<f64> = diagonal.diagonal().iter().copied().collect();
            found.sort_by(f64::total_cmp);
            for k in 0..3 {
                assert!((found[k] - moments[k]).abs() < 1e-14 * 4.0, "{found:?}");
                diagonal[(k, k)] = 0.0;
            }
            assert!(diagonal.amax() < 1e-14, "{diagonal}");
        }
    }

    #[test]
    fn axes_that_are_principal_already_stay_as_they_are() {
        let tensor = Mat3::new(3.0, 1e-13, 0.0, 1e-13, 3.0, 0.0, 0.0, 0.0, 1.0);
        assert_eq!(principal_axes(&tensor), Quat::identity());
    }
}
