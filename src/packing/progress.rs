//! Progress of dense packings, and states from which they continue.

use super::relax::Pose;
use crate::domain::Domain;
use crate::math::{Quat, Vec3, nalgebra::Quaternion};
use serde::{Deserialize, Serialize};
use xxhash_rust::xxh3::xxh3_64;

/// A dense packing after some rounds of pushing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// Mark of its start: the same for the same bodies in the same box.
    pub mark: u64,
    /// Number of rounds.
    pub rounds: usize,
    /// Least sum of the overlaps so far (in units of the reach of bodies), and its round.
    pub(super) least_sum: (f64, usize),
    /// Of each body: position (m), orientation (x, y, z, w), and the position at which its neighbours were looked for.
    pub(super) bodies: Vec<[f64; 10]>,
}

/// A follower of a dense packing, which may take long.
pub trait Follow {
    /// A state of the packing with this mark to continue from; `None` begins anew.
    fn kept(&mut self, _mark: u64) -> Option<State> {
        None
    }

    /// Called after each round with the number of rounds and of overlaps, and a function that gives the state.
    fn round(&mut self, _rounds: usize, _overlaps: usize, _state: &dyn Fn() -> State) {}
}

/// Nobody.
pub struct Unfollowed;

impl Follow for Unfollowed {}

/// Mark of bodies of these reaches (m) that begin in a box.
pub(super) fn mark(domain: &Domain, reaches: &[f64], poses: &[Pose]) -> u64 {
    let size: [f64; 3] = domain.size().into();
    let numbers = size.into_iter().chain(reaches.iter().copied()).chain(poses.iter().flat_map(numbers));
    xxh3_64(&numbers.flat_map(|x| x.to_bits().to_le_bytes()).collect::<Vec<u8>>())
}

/// Position and orientation.
fn numbers(pose: &Pose) -> [f64; 7] {
    let ([x, y, z], [i, j, k, w]) = (pose.position.into(), pose.orientation.coords.into());
    [x, y, z, i, j, k, w]
}

/// A body of a [`State`].
pub(super) fn body(pose: &Pose, found_at: &Vec3) -> [f64; 10] {
    let [x, y, z, i, j, k, w] = numbers(pose);
    [x, y, z, i, j, k, w, found_at.x, found_at.y, found_at.z]
}

/// Moves a body to where it was, and returns the position at which its neighbours were looked for.
pub(super) fn restore(pose: &mut Pose, &[x, y, z, i, j, k, w, a, b, c]: &[f64; 10]) -> Vec3 {
    pose.position = Vec3::new(x, y, z);
    pose.orientation = Quat::new_unchecked(Quaternion::new(w, i, j, k));
    Vec3::new(a, b, c)
}
