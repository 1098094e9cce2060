//! Contacts as VTK points (`contacts_NNN.vtp`), and the lines between them and the particles (`force_chains_NNN.vtp`).
//!
//! A contact is one point with the arrays `first`, `second` (ids of the particles; `-1 - i` for wall `i`, so that
//! `second < 0` picks the contacts with walls), `normal` (from the first body to the second), `force` (N, on the first
//! body), `force_magnitude` (N), `depth` (m) and `volume` (m^3) of the overlap. In `ParaView`, glyphs show the vectors.
//!
//! Force chains are lines from the centre of each particle to the points where it is touched, with `force_magnitude`
//! (N) and `id` on both ends; the filter *Tube* with the magnitude as radius shows where a packing carries its load. A
//! line belongs to one particle and sticks out of the box where that does, as in the files of the surfaces.

use super::polydata::PolyData;
use crate::domain::Domain;
use crate::error::Result;
use crate::math::Vec3;
use crate::particle::Particle;
use std::path::{Path, PathBuf};

/// One contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Id of the first particle.
    pub first: u64,
    /// What it touches.
    pub second: Partner,
    /// Where the force acts (m), wrapped into the domain.
    pub point: Vec3,
    /// Unit normal, from the first body to the second.
    pub normal: Vec3,
    /// Force on the first body (N).
    pub force: Vec3,
    /// Depth of the overlap (m).
    pub depth: f64,
    /// Volume of the overlap (m^3).
    pub volume: f64,
}

/// What a particle touches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Partner {
    /// Another particle, by its id.
    Particle(u64),
    /// A wall, by its index.
    Wall(usize),
}

impl Partner {
    /// Id of a particle; `-1 - i` for wall `i`.
    fn number(self) -> i64 {
        match self {
            Self::Particle(id) => id as i64,
            Self::Wall(index) => -1 - index as i64,
        }
    }
}

/// Writes one point per contact.
pub fn write_contacts(path: &Path, contacts: &[Contact]) -> Result<()> {
    points(contacts).write(path)
}

/// Writes the index of a `file` of contacts whose [pieces](super::pieces::piece) are all written; the path of the index.
pub fn write_contacts_index(file: &Path, pieces: usize) -> Result<PathBuf> {
    points(&[]).write_index(file, pieces)
}

fn points(contacts: &[Contact]) -> PolyData {
    let mut data = PolyData::default();
    for contact in contacts {
        let point = data.point(contact.point);
        data.vertex(point);
    }
    data.scalars("force_magnitude", contacts.iter().map(|c| c.force.norm()));
    data.integers("first", contacts.iter().map(|c| c.first as i64).collect());
    data.integers("second", contacts.iter().map(|c| c.second.number()).collect());
    data.vectors("force", contacts.iter().map(|c| c.force));
    data.vectors("normal", contacts.iter().map(|c| c.normal));
    data.scalars("depth", contacts.iter().map(|c| c.depth));
    data.scalars("volume", contacts.iter().map(|c| c.volume));
    data
}

/// Writes the lines from the centres of the particles, ascending by id, to their contacts.
pub fn write_force_chains(
    path: &Path,
    domain: &Domain,
    particles: &[Particle],
    contacts: &[Contact],
) -> Result<()> {
    lines(domain, particles, contacts).write(path)
}

/// Writes the index of a `file` of force chains whose [pieces](super::pieces::piece) are all written; the path of the index.
pub fn write_force_chains_index(file: &Path, domain: &Domain, pieces: usize) -> Result<PathBuf> {
    lines(domain, &[], &[]).write_index(file, pieces)
}

fn lines(domain: &Domain, particles: &[Particle], contacts: &[Contact]) -> PolyData {
    let mut data = PolyData::default();
    let (mut magnitudes, mut ids) = (Vec::new(), Vec::new());
    for contact in contacts {
        let partner = match contact.second {
            Partner::Particle(id) => Some(id),
            Partner::Wall(_) => None,
        };
        for id in [Some(contact.first), partner].into_iter().flatten() {
            let Ok(index) = particles.binary_search_by_key(&id, |p| p.id) else {
                continue;
            };
            let centre = domain.wrap(particles[index].position());
            let arm = domain.nearest_image(contact.point - centre);
            let ends = [data.point(centre), data.point(centre + arm)];
            data.line(ends);
            magnitudes.extend([contact.force.norm(); 2]);
            ids.extend([id; 2]);
        }
    }
    data.scalars("force_magnitude", magnitudes);
    data.integers("id", ids);
    data
}

#[cfg(test)]
mod tests {
    use super::super::vtk_reader::{piece as read, point_data as array};
    use super::*;

    const BOX: Domain = Domain { periodic: [true, true, false], cells: [10, 10, 20], dx: 0.1 };

    /// Two particles that touch across a periodic face, and one on the floor.
    fn scene() -> ([Particle; 3], [Contact; 2]) {
        let particles = [
            Particle::at(3, 0, Vec3::new(0.1, 0.5, 1.0)),
            Particle::at(5, 0, Vec3::new(0.8, 0.5, 1.0)),
            Particle::at(9, 0, Vec3::new(0.5, 0.5, 0.125)),
        ];
        let contact = |first, second, point, normal: Vec3| Contact {
            first,
            second,
            point,
            normal,
            force: -2.0 * normal,
            depth: 0.125,
            volume: 0.5,
        };
        let contacts = [
            contact(3, Partner::Particle(5), Vec3::new(0.95, 0.5, 1.0), -Vec3::x()),
            contact(9, Partner::Wall(4), Vec3::new(0.5, 0.5, 0.0), -Vec3::z()),
        ];
        (particles, contacts)
    }

    #[test]
    fn a_contact_is_a_point_with_its_partners_and_its_force() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("contacts.vtp");
        write_contacts(&path, &scene().1).unwrap();
        let piece = read(&path);
        assert_eq!((piece.num_points(), piece.num_verts()), (2, 2));
        assert_eq!(array(&piece, "first"), [3.0, 9.0]);
        assert_eq!(array(&piece, "second"), [5.0, -5.0]);
        assert_eq!(array(&piece, "force"), [2.0, 0.0, 0.0, 0.0, 0.0, 2.0]);
        assert_eq!(array(&piece, "force_magnitude"), [2.0, 2.0]);
        assert_eq!(array(&piece, "normal")[..3], [-1.0, 0.0, 0.0]);
        assert_eq!(array(&piece, "depth"), [0.125; 2]);
        assert_eq!(array(&piece, "volume"), [0.5; 2]);
    }

    #[test]
    fn chains_lead_from_centres_to_contacts_and_never_through_the_whole_box() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("force_chains.vtp");
        let (particles, contacts) = scene();
        write_force_chains(&path, &BOX, &particles, &contacts).unwrap();
        let piece = read(&path);
        assert_eq!(piece.num_lines(), 3);
        assert_eq!(array(&piece, "id"), [3.0, 3.0, 5.0, 5.0, 9.0, 9.0]);
        let points: Vec<f64> = piece.points.cast_into().unwrap();
        for ends in points.chunks(6) {
            let length = (Vec3::from_row_slice(&ends[..3]) - Vec3::from_row_slice(&ends[3..])).norm();
            assert!((length - 0.15).abs() < 0.03, "{length}");
        }
    }

    #[test]
    fn no_contacts_make_readable_empty_files() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("contacts.vtp");
        write_contacts(&path, &[]).unwrap();
        assert_eq!(read(&path).num_points(), 0);
        write_force_chains(&path, &BOX, &scene().0, &[]).unwrap();
        assert_eq!(read(&path).num_points(), 0);
    }
}
