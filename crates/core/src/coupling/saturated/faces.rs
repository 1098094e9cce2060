//! Volume fractions of cells that flat faces cut.

use super::cut_cells::BLOCK;
use super::volume_fraction::{behind_both, behind_plane};
use crate::coupling::faces::FacePlane;

/// Volume fractions behind all of `planes` of cells with their centres at `x, y, z` (cells, from the centre of
/// the body).
#[inline(always)]
pub(super) fn fractions(planes: &[FacePlane], x: &[f64; BLOCK], y: f64, z: f64) -> [f64; BLOCK] {
    let together = if planes.len() <= MANY { together(planes, x, y, z) } else { None };
    // No closure: it would not be compiled for the instruction set of the sweep.
    match together {
        Some(fractions) => fractions,
        None => one_by_one(planes, x, y, z),
    }
}

/// Most faces that reach into the same [`BLOCK`] of cells to be evaluated together.
const MEETING: usize = 8;

/// Bodies with more faces than this have more than [`MEETING`] in most places.
const MANY: usize = 40;

/// The same, or none if more faces meet there than can be evaluated together. Each is combined with the fraction behind the
/// previous ones, at the cosine to the most similar of them.
#[inline(always)]
fn together(planes: &[FacePlane], x: &[f64; BLOCK], y: f64, z: f64) -> Option<[f64; BLOCK]> {
    let (mut fraction, mut outside) = ([1.0_f64; BLOCK], [false; BLOCK]);
    // Faces before that reach into some of the cells, and which.
    let (mut met, mut count) = ([([0.0; 3], [false; BLOCK]); MEETING], 0);
    for plane in planes {
        let rest = plane.rest(y, z);
        let (mut reached, mut any) = ([false; BLOCK], false);
        let mut height = [0.0; BLOCK];
        for k in 0..BLOCK {
            height[k] = plane.height(x[k], rest);
            reached[k] = height[k] > -plane.reach;
            any |= reached[k];
        }
        if !any {
            continue;
        }
        if count == MEETING {
            return None;
        }
        let n = plane.normal;
        let mut cosine = [-1.0_f64; BLOCK];
        for (other, before) in &met[..count] {
            let c = n[0] * other[0] + n[1] * other[1] + n[2] * other[2];
            for k in 0..BLOCK {
                cosine[k] = if before[k] && c > cosine[k] { c } else { cosine[k] };
            }
        }
        for k in 0..BLOCK {
            let behind = behind_plane(height[k], n);
            let both = behind_both(fraction[k], behind, cosine[k]);
            let next = if fraction[k] >= 1.0 { behind } else { both };
            fraction[k] = if reached[k] { next } else { fraction[k] };
            outside[k] |= height[k] >= plane.reach;
        }
        met[count] = (n, reached);
        count += 1;
    }
    for k in 0..BLOCK {
        fraction[k] = if outside[k] { 0.0 } else { fraction[k] };
    }
    Some(fraction)
}

#[inline(always)]
fn one_by_one(planes: &[FacePlane], x: &[f64; BLOCK], y: f64, z: f64) -> [f64; BLOCK] {
    let mut all = [0.0; BLOCK];
    for (fraction, x) in all.iter_mut().zip(x) {
        *fraction = alone(planes, *x, y, z);
    }
    all
}

/// Volume fraction of one cell.
#[inline(always)]
fn alone(planes: &[FacePlane], x: f64, y: f64, z: f64) -> f64 {
    let mut fraction = 1.0;
    for (at, plane) in planes.iter().enumerate() {
        let height = plane.height(x, plane.rest(y, z));
        if height >= plane.reach {
            return 0.0;
        }
        if height > -plane.reach {
            let n = plane.normal;
            let behind = behind_plane(height, n);
            if fraction >= 1.0 {
                fraction = behind;
                continue;
            }
            // The face before that is most like this one.
            let cosine = planes[..at]
                .iter()
                .filter(|other| other.height(x, other.rest(y, z)) > -other.reach)
                .map(|other| n[0] * other.normal[0] + n[1] * other.normal[1] + n[2] * other.normal[2])
                .fold(-1.0, f64::max);
            fraction = behind_both(fraction, behind, cosine);
        }
    }
    fraction
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Quat, Vec3};
    use crate::shape::{Cuboid, Polyhedron, Shape, Sphere};

    #[test]
    fn cells_looked_at_together_have_the_fractions_that_each_has_alone() {
        // Up to three faces meet in a cell of the one, more of the other.
        let cuboid = Cuboid::new(Vec3::new(4.3, 5.1, 6.2)).unwrap();
        let round = Sphere { radius: 4.0 }.surface_mesh(0);
        let hull = Polyhedron::hull(&round.points, 1e-9).unwrap().0;
        let bodies: [(&dyn Shape, usize); 2] = [(&cuboid, 3), (&hull, 5)];
        for (shape, most) in bodies {
            let turn = Quat::from_euler_angles(0.3, -0.7, 1.1).to_rotation_matrix();
            let planes = FacePlane::all(shape.as_polyhedron().unwrap(), turn.matrix(), 1.0, -0.1);
            let (mut cut, mut meeting, mut too_many) = (0, 0, 0);
            for row in 0..256 {
                let [y, z] = [row % 16, row / 16].map(|n| f64::from(n) - 7.6);
                for first in [-8.3, -4.3, -0.3] {
                    let x: [f64; BLOCK] = std::array::from_fn(|k| first + k as f64);
                    let Some(fractions) = together(&planes, &x, y, z) else {
                        too_many += 1;
                        continue;
                    };
                    let alone = one_by_one(&planes, &x, y, z);
                    assert_eq!(fractions.map(f64::to_bits), alone.map(f64::to_bits));
                    cut += fractions.iter().filter(|share| **share > 0.0 && **share < 1.0).count();
                    for x in x {
                        let cuts = |plane: &&FacePlane| plane.height(x, plane.rest(y, z)).abs() < plane.reach;
                        meeting = meeting.max(planes.iter().filter(cuts).count());
                    }
                }
            }
            assert!(cut > 100 && meeting >= most, "{cut} {meeting}");
            assert_eq!(too_many > 0, planes.len() > MEETING);
        }
    }
}
