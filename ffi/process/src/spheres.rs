//! Common parts of engines of spheres: kinds, ids from 1, planes across the axes, and files without a name.

use crate::message::{AppliedLoad, Outcome};
use crate::setup::{SetUp, ShapeSection, TemplateSection, WallSection};
use std::fs::File;
use std::os::fd::AsRawFd;

/// Most that a unit vector of an axis differs from it.
const ALIGNED: f64 = 1e-9;

/// Names of the axes.
pub const AXES: [&str; 3] = ["x", "y", "z"];

/// Kind of spheres.
#[derive(Clone, Copy, Debug)]
pub struct SphereKind {
    /// Of contacts (m).
    pub radius: f64,
    /// Mass (kg).
    pub mass: f64,
    /// Moment of inertia of a homogeneous sphere of the radius of contacts over that of the particle (-).
    pub inertia_ratio: f64,
    /// Index of the material.
    pub material: usize,
}

/// The kind of each template.
///
/// # Errors
/// A template that is no sphere.
pub fn kinds(case: &SetUp) -> Outcome<Vec<SphereKind>> {
    let kind = |template: &TemplateSection| {
        let ShapeSection::Sphere { radius } = template.shape else {
            return Err("it has spheres only".to_owned());
        };
        let grown = radius + case.contact.as_ref().map_or(0.0, |contact| contact.enlargement);
        // Without an enlargement exactly one.
        let ratio = grown / radius;
        let (mass, material) = (template.mass, template.material);
        Ok(SphereKind { radius: grown, mass, inertia_ratio: ratio * ratio, material })
    };
    case.templates.iter().map(kind).collect()
}

/// The id, from 1, that an engine has for a particle.
///
/// # Errors
/// An id of more than 31 bits.
pub fn tag(id: u64) -> Outcome<i32> {
    i32::try_from(id.saturating_add(1)).map_err(|_| format!("it has no numbers for ids as large as {id}"))
}

/// The id of a particle, of which the engine has this one.
pub fn id_of(tag: i32) -> u64 {
    tag as u64 - 1
}

/// Indices of the particles of this process in the engine's arrays.
#[derive(Debug, Default)]
pub struct Order {
    /// As they were.
    ids: Vec<i32>,
    /// By ascending id.
    pub places: Vec<u32>,
}

impl Order {
    /// Takes note of the ids.
    pub fn note(&mut self, ids: &[i32]) {
        if self.ids != ids {
            self.ids = ids.to_vec();
            self.places = (0..ids.len() as u32).collect();
            self.places.sort_unstable_by_key(|&k| ids[k as usize]);
        }
    }

    /// Takes note of the ids, which must be those of the loads, one for each particle by ascending id.
    ///
    /// # Errors
    /// Loads of other particles.
    pub fn note_loaded(&mut self, ids: &[i32], loads: &[AppliedLoad]) -> Outcome<()> {
        self.note(ids);
        let places = self.places.iter().map(|&k| k as usize);
        let are_those =
            ids.len() == loads.len() && places.zip(loads).all(|(k, load)| id_of(ids[k]) == load.id);
        if are_those { Ok(()) } else { Err("the loads are not those of its particles".to_owned()) }
    }
}

/// The axis that a unit vector lies along, either way.
pub fn axis_of(direction: [f64; 3]) -> Option<usize> {
    (0..3).find(|&i| (direction[i].abs() - 1.0).abs() < ALIGNED)
}

/// The axis across which a plane stands, and the words for a wall that slides along one of the others: ` shear x 0.1`.
///
/// # Errors
/// The reason why it is no such plane.
pub fn sliding_plane(wall: &WallSection, normal: [f64; 3]) -> Result<(usize, String), &'static str> {
    let axis = axis_of(normal).ok_or("planes stand across x, y or z")?;
    let along: Vec<usize> = (0..3).filter(|&i| wall.velocity[i] != 0.0).collect();
    match along[..] {
        [] => Ok((axis, String::new())),
        [i] => Ok((axis, format!(" shear {} {:e}", AXES[i], wall.velocity[i]))),
        _ => Err("planes slide along one axis only"),
    }
}

/// A file that an engine and turbid exchange. It has no name, so that nobody else finds it, and ends with its handle.
///
/// # Errors
/// The reason why there is none.
pub fn exchange_file() -> Outcome<File> {
    tempfile::tempfile()
        .map_err(|e| format!("cannot make a file in {}: {e}; set TMPDIR", std::env::temp_dir().display()))
}

/// A path to an open file of this process, for an engine: without blanks, whatever the name of the file, and even if it has none.
pub fn path_of(file: &File) -> String {
    format!("/proc/self/fd/{}", file.as_raw_fd())
}
