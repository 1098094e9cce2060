//! Dense random packings: bodies in the equilibrium of a fluid of volume fraction 0.4 in a wider box are put into the wanted box at once, and pushed and
//! rotated apart. Pushed so quickly they stay random: spheres come to 0.63, close to random close packing.
//!
//! # Reference
//! O'Hern, Silbert, Liu, Nagel (2003), doi:10.1103/PhysRevE.68.011306: random packings are where soft bodies stop to overlap, spheres at 0.64.

use super::progress::Follow;
use super::relax::{Pose, Pushing, Way, relax_by};
use crate::contact::GrownShape;
use crate::domain::Domain;
use crate::wall::Surface;

/// 2000 spheres take 3000 rounds at 0.62 and 6000 to 20 000 at 0.63. Pushes too far by a half get there in a third of the rounds.
const PUSHING: Pushing = Pushing { rounds: 60_000, patience: 6000, overshoot: 0.6, margin: 2e-4, skin: 0.05 };

/// A wall in a box that is `by` times as wide; none of a mesh.
pub fn widened(wall: &Surface, by: f64) -> Option<Surface> {
    match *wall {
        Surface::Plane { point, normal } => Some(Surface::Plane { point: point * by, normal }),
        Surface::Cylinder { point, axis, radius, pipe } => {
            Some(Surface::Cylinder { point: point * by, axis, radius: radius * by, pipe })
        }
        Surface::Mesh(_) => None,
    }
}

/// Moves bodies that do not overlap in a box `wide` times the `domain` into it; returns false if they do not come apart there.
pub fn squeeze(
    domain: &Domain,
    walls: &[Surface],
    contours: &[GrownShape],
    poses: &mut [Pose],
    fixed: usize,
    wide: f64,
    follow: &mut dyn Follow,
) -> bool {
    for pose in poses.iter_mut() {
        pose.position /= wide;
    }
    relax_by(&PUSHING, *domain, walls, contours, poses, fixed, Way::Followed(follow))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Quat, Vec3};
    use crate::packing::mix::mix;
    use crate::packing::progress::{State, Unfollowed};
    use crate::packing::relax::tests::overlaps;
    use crate::packing::relax::{random_orientations, relax};
    use crate::packing::{Ball, count_for_volume_fraction, pack};
    use crate::shape::{Cuboid, Ellipsoid, Shape, Sphere};
    use std::sync::Arc;

    /// Bodies of the volume of a sphere of diameter 1 that begin loosely in a box wider than a periodic cube, by what factor, and the cube.
    fn begun(shape: &Arc<dyn Shape>, edge: usize, fraction: f64) -> (Domain, Vec<Pose>, f64) {
        let domain = Domain { faces: Domain::faces([true; 3]), cells: [edge; 3], dx: 0.1 };
        let count = count_for_volume_fraction(domain.volume(), fraction, shape.volume()) as usize;
        let wide = libm::cbrt(fraction / 0.4);
        let start = Domain { dx: domain.dx * wide, ..domain };
        let ball = Ball { radius: 0.5, half_gap: 0.0 };
        let positions = pack(&start, &[], &[], &vec![ball; count], 1).unwrap();
        let turns = random_orientations(count, 1).into_iter();
        let is_sphere = shape.as_sphere().is_some();
        let turns = turns.map(|turn| if is_sphere { Quat::identity() } else { turn });
        let poses = positions.into_iter().zip(turns);
        let mut poses: Vec<Pose> =
            poses.map(|(position, orientation)| Pose { contour: 0, position, orientation }).collect();
        let contours = vec![GrownShape::new(shape.clone(), 0.0)];
        assert!(relax(start, &[], &contours, &mut poses, 0, None));
        mix(&start, &[], &contours, &mut poses, 0, 1);
        (domain, poses, wide)
    }

    /// The same, densely packed, clear of each other.
    fn packed(shape: &Arc<dyn Shape>, edge: usize, fraction: f64) -> (Domain, Vec<Pose>) {
        let (domain, mut poses, wide) = begun(shape, edge, fraction);
        let contours = vec![GrownShape::new(shape.clone(), 0.0)];
        assert!(squeeze(&domain, &[], &contours, &mut poses, 0, wide, &mut Unfollowed), "{fraction}");
        assert_eq!(overlaps(&domain, &[], shape, &poses), 0);
        (domain, poses)
    }

    #[test]
    fn spheres_pack_to_sixty_two_per_cent_and_do_not_crystallise() {
        let sphere: Arc<dyn Shape> = Arc::new(Sphere { radius: 0.5 });
        let (domain, poses) = packed(&sphere, 70, 0.62);
        // In crystals there are many neighbours at sqrt(2) diameters, in random packings there is a gap before sqrt(3).
        let mut near = [0_i32; 3];
        for (i, a) in poses.iter().enumerate() {
            for b in &poses[..i] {
                let r = domain.nearest_image(a.position - b.position).norm();
                near[0] += i32::from(r < 1.1);
                near[1] += i32::from((1.36..1.46).contains(&r));
                near[2] += i32::from((1.68..1.78).contains(&r));
            }
        }
        let per_sphere = near.map(|n: i32| 2.0 * f64::from(n) / poses.len() as f64);
        assert!((6.0..9.0).contains(&per_sphere[0]) && per_sphere[1] < 2.5, "{per_sphere:?}");
        assert!(per_sphere[2] > per_sphere[1], "{per_sphere:?}");
    }

    #[test]
    fn cubes_and_ellipsoids_pack_far_beyond_random_positions() {
        let edge = libm::cbrt(std::f64::consts::PI / 6.0);
        let cube: Arc<dyn Shape> = Arc::new(Cuboid::new(Vec3::repeat(edge)).unwrap());
        let grain: Arc<dyn Shape> = Arc::new(Ellipsoid::new(Vec3::new(0.625, 0.5, 0.4)).unwrap());
        for (shape, fraction) in [(cube, 0.58), (grain, 0.64)] {
            packed(&shape, 40, fraction);
        }
    }

    /// Keeps the state after some rounds, or continues from it.
    struct Probe {
        after: usize,
        state: Option<State>,
        rounds: usize,
    }

    impl Follow for Probe {
        fn kept(&mut self, _: u64) -> Option<State> {
            self.state.clone()
        }

        fn round(&mut self, rounds: usize, overlaps: usize, state: &dyn Fn() -> State) {
            assert!(overlaps > 0);
            self.rounds += 1;
            if rounds == self.after {
                self.state = Some(state());
            }
        }
    }

    #[test]
    fn a_packing_continues_from_a_kept_state_to_the_same_bits_and_another_one_begins_anew() {
        let shape: Arc<dyn Shape> = Arc::new(Ellipsoid::new(Vec3::new(0.625, 0.5, 0.4)).unwrap());
        let contours = vec![GrownShape::new(shape.clone(), 0.0)];
        let (domain, poses, wide) = begun(&shape, 40, 0.64);
        let squeezed = |probe: &mut Probe, domain: &Domain| {
            let mut poses = poses.clone();
            assert!(squeeze(domain, &[], &contours, &mut poses, 0, wide, probe));
            poses
        };
        let mut probe = Probe { after: 0, state: None, rounds: 0 };
        let truth = squeezed(&mut probe, &domain);
        let all = probe.rounds;
        assert!(all > 10, "{all}");
        for after in [1, all / 2, all - 1] {
            let mut probe = Probe { after, state: None, rounds: 0 };
            squeezed(&mut probe, &domain);
            let text = serde_json::to_string(&probe.state.unwrap()).unwrap();
            let state = Some(serde_json::from_str(&text).unwrap());
            let mut probe = Probe { after: 0, state, rounds: 0 };
            assert_eq!(squeezed(&mut probe, &domain), truth);
            assert_eq!(probe.rounds, all - after);
            let wider = Domain { dx: 1.01 * domain.dx, ..domain };
            let anew = squeezed(&mut Probe { after: 0, state: None, rounds: 0 }, &wider);
            assert_eq!(squeezed(&mut probe, &wider), anew);
        }
    }
}
