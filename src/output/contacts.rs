//! Contacts as VTK points (`contacts_NNN.vtp`), and the lines between them and the particles (`force_chains_NNN.vtp`).
//!
//! A contact is one point with the arrays `first`, `second` (ids of the particles; `-1 - i` for wall `i`), `normal` (from the first body
//! to the second), `force` (N, on the first body), `force_magnitude` (N), its part `normal_force` (N, positive where it pushes the bodies
//! apart) and the rest, `tangential_force` (N, a vector), `depth` (m) and `volume` (m^3) of the overlap, `parts` (which of each body touch) and `image`
//! (of the second body that touches, in boxes from the one nearest to the first). A neck has the depth minus its gap.
//!
//! Force chains are lines from the centre of each particle to the points where it is touched, with `force_magnitude` (N) and `id` on both
//! ends. A line belongs to one particle and sticks out of the box where that does, as in the files of the surfaces.

use super::polydata::PolyData;
use crate::dem::{ContactKey, ContactState};
use crate::domain::Domain;
use crate::math::Vec3;
use crate::particle::Particle;

/// Ids of the particles of a contact, of one with a wall only the first.
pub fn ids(contact: &ContactState) -> impl Iterator<Item = u64> + use<> {
    let second = contact.wall().is_none().then_some(contact.second);
    [Some(contact.first), second].into_iter().flatten()
}

/// Of each particle of a contact, which are among `particles`, ascending by id: its id, centre and point of contact (m).
pub fn arms(
    domain: &Domain,
    contact: &ContactState,
    particles: &[Particle],
) -> impl Iterator<Item = (u64, [Vec3; 2])> + use<> {
    let find = |id: u64| particles.binary_search_by_key(&id, |p| p.id).ok();
    let centres = [contact.first, contact.second]
        .map(|id| find(id).map(|index| domain.wrap(particles[index].position())));
    let known = centres[0].or(centres[1]).unwrap_or_default();
    let levers = contact.levers(domain, centres.map(|centre| centre.unwrap_or(known)));
    let of = move |k: usize| centres[k].map(|centre| [centre, centre + levers[k]]);
    [(contact.first, of(0)), (contact.second, of(1))].into_iter().filter_map(|(id, ends)| Some((id, ends?)))
}

/// One point per contact, in double precision: overlaps are differences of positions.
pub fn contacts(contacts: &[ContactState]) -> PolyData {
    let mut data = PolyData::double();
    for contact in contacts {
        let point = data.point(contact.point.into());
        data.vertex(point);
    }
    let force = |c: &ContactState| Vec3::from(c.force);
    let normal_part = |c: &ContactState| force(c).dot(&Vec3::from(c.normal));
    data.scalars("force_magnitude (N)", contacts.iter().map(|c| force(c).norm()));
    data.integers("first", contacts.iter().map(|c| c.first as i64).collect());
    // `ContactState::of_wall` counts down from the largest number: this gives -1 - i.
    data.integers("second", contacts.iter().map(|c| c.second as i64).collect());
    data.vectors("force (N)", contacts.iter().map(force));
    data.vectors("normal", contacts.iter().map(|c| c.normal.into()));
    data.scalars("normal_force (N)", contacts.iter().map(|c| -normal_part(c)));
    data.vectors(
        "tangential_force (N)",
        contacts.iter().map(|c| force(c) - normal_part(c) * Vec3::from(c.normal)),
    );
    data.scalars("depth (m)", contacts.iter().map(|c| c.depth));
    data.scalars("volume (m^3)", contacts.iter().map(|c| c.volume));
    data.tuples("parts", contacts.iter().map(|c| c.key().indices().map(f64::from)));
    data.vectors("image", contacts.iter().map(|c| c.key().shift().map(f64::from).into()));
    data
}

/// Numbers above are not whole in double precision.
const LARGEST_ID: f64 = (1_u64 << 53) as f64;

/// Arrays with their numbers of components from which [`from_arrays`] gets contacts; `Points` are the points.
pub const ARRAYS: [(&str, usize); 9] = [
    ("first", 1),
    ("second", 1),
    ("depth", 1),
    ("volume", 1),
    ("parts", 2),
    ("Points", 3),
    ("normal", 3),
    ("force", 3),
    ("image", 3),
];

/// Numbers of an array of [`ARRAYS`].
struct Column<'a> {
    name: &'a str,
    numbers: &'a [f64],
}

impl Column<'_> {
    /// Those of the n-th contact.
    fn of<const N: usize>(&self, n: usize) -> Result<[f64; N], String> {
        let found: [f64; N] = std::array::from_fn(|k| self.numbers[n * N + k]);
        let sound = found.iter().all(|number| number.is_finite());
        sound
            .then_some(found)
            .ok_or_else(|| format!("the array `{}` has a number that is not finite", self.name))
    }

    /// Those of the n-th contact, which are whole and in a range.
    fn whole<const N: usize>(&self, n: usize, from: f64, to: f64) -> Result<[f64; N], String> {
        let found = self.of(n)?;
        let fits = |x: &f64| (from..=to).contains(x) && (x - x.trunc()).abs() <= 0.0;
        match found.iter().find(|x| !fits(x)) {
            None => Ok(found),
            Some(x) => Err(format!("the array `{}` has {x}, which no contact has", self.name)),
        }
    }
}

/// The contacts that [`contacts`] has written, from the numbers in [`ARRAYS`], between particles and `walls` walls.
///
/// # Errors
/// Names an array with numbers that no contact has.
pub fn from_arrays(arrays: &[Vec<f64>], walls: usize) -> Result<Vec<ContactState>, String> {
    let [first, second, depth, volume, parts, points, normals, forces, images] =
        std::array::from_fn(|k| Column { name: ARRAYS[k].0, numbers: &arrays[k] });
    let last_part = f64::from(ContactKey::MOST_PARTS - 1);
    let contact = |n: usize| {
        let [id] = first.whole(n, 0.0, LARGEST_ID)?;
        let [other] = second.whole(n, -(walls as f64), LARGEST_ID)?;
        let key = ContactKey {
            first: id as u64,
            second: if other < 0.0 { ContactState::of_wall((-1.0 - other) as usize) } else { other as u64 },
            parts: parts.whole::<2>(n, 0.0, last_part)?.map(|part| part as u32),
        };
        let shift = images.whole::<3>(n, -1.0, 1.0)?.map(|along| along as i8);
        let ContactKey { first, second, parts } = key.with_shift(shift);
        let ([depth], [volume]) = (depth.of(n)?, volume.of(n)?);
        let [point, normal, force] = [points.of(n)?, normals.of(n)?, forces.of(n)?];
        Ok(ContactState { first, second, parts, point, normal, force, depth, volume })
    };
    (0..first.numbers.len()).map(contact).collect()
}

/// The lines from the centres of the particles, ascending by id, to their contacts.
pub fn force_chains(domain: &Domain, particles: &[Particle], contacts: &[ContactState]) -> PolyData {
    let mut data = PolyData::default();
    let (mut magnitudes, mut ends_of) = (Vec::new(), Vec::new());
    for contact in contacts {
        for (id, [centre, end]) in arms(domain, contact, particles) {
            let ends = [data.point(centre), data.point(end)];
            data.line(ends);
            magnitudes.extend([Vec3::from(contact.force).norm(); 2]);
            ends_of.extend([id; 2]);
        }
    }
    data.scalars("force_magnitude (N)", magnitudes);
    data.integers("id", ends_of);
    data
}

#[cfg(test)]
mod tests {
    use super::super::vtk_reader::{piece as read, point_data as array};
    use super::*;

    const BOX: Domain = Domain { faces: Domain::faces([true, true, false]), cells: [10, 10, 20], dx: 0.1 };

    /// Two particles that touch across a periodic face, and one on the floor.
    fn example() -> ([Particle; 3], [ContactState; 2]) {
        let particles = [
            Particle::at(3, 0, Vec3::new(0.1, 0.5, 1.0)),
            Particle::at(5, 0, Vec3::new(0.8, 0.5, 1.0)),
            Particle::at(9, 0, Vec3::new(0.5, 0.5, 0.125)),
        ];
        let contact = |first, second, point, normal: Vec3| ContactState {
            first,
            second,
            parts: [0; 2],
            point,
            normal: normal.into(),
            force: (-2.0 * normal + 0.25 * Vec3::y()).into(),
            depth: 0.125,
            volume: 0.5,
        };
        let contacts = [
            contact(3, 5, [0.95, 0.5, 1.0], -Vec3::x()),
            contact(9, ContactState::of_wall(4), [0.5, 0.5, 0.0], -Vec3::z()),
        ];
        (particles, contacts)
    }

    #[test]
    fn the_chains_of_a_body_that_touches_its_own_image_end_at_both_of_its_sides() {
        let centre = Vec3::new(0.9, 0.5, 1.0);
        let own = ContactState { second: 3, point: [0.4, 0.5, 1.0], ..example().1[0] };
        let key = own.key().with_shift([1, 0, 0]);
        let particles = [Particle::at(3, 0, centre)];
        let ends: Vec<_> = arms(&BOX, &ContactState { parts: key.parts, ..own }, &particles).collect();
        let at = [0.5, -0.5].map(|arm| (3, [centre, centre + Vec3::x() * arm]));
        for ((id, [from, to]), (same, [centre, end])) in ends.into_iter().zip(at) {
            assert!(id == same && from == centre && (to - end).norm() < 1e-15, "{to}");
        }
    }

    #[test]
    fn a_contact_is_a_point_with_its_partners_and_its_force() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("contacts.vtp");
        contacts(&example().1).write(&path).unwrap();
        let piece = read(&path);
        assert_eq!((piece.num_points(), piece.num_verts()), (2, 2));
        assert_eq!(array(&piece, "first"), [3.0, 9.0]);
        assert_eq!(array(&piece, "second"), [5.0, -5.0]);
        assert_eq!(array(&piece, "force"), [2.0, 0.25, 0.0, 0.0, 0.25, 2.0]);
        assert_eq!(array(&piece, "force_magnitude"), [4.0625_f64.sqrt(); 2]);
        assert_eq!(array(&piece, "normal")[..3], [-1.0, 0.0, 0.0]);
        assert_eq!(array(&piece, "depth"), [0.125; 2]);
        assert_eq!(array(&piece, "volume"), [0.5; 2]);
    }

    #[test]
    fn contacts_are_read_as_they_were_written_and_numbers_that_none_has_are_refused() {
        let mut states = example().1.to_vec();
        let key = ContactKey { parts: [3, 4], ..states[0].key() }.with_shift([-1, 0, 1]);
        states.push(ContactState { parts: key.parts, volume: 0.1, ..states[0] });
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("contacts.vtp");
        contacts(&states).write(&path).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let arrays = crate::packing::positions::arrays_of_a_run(&bytes, &ARRAYS).unwrap().unwrap();
        assert_eq!(from_arrays(&arrays, 5).unwrap(), states);
        assert!(from_arrays(&arrays, 4).unwrap_err().contains("`second` has -5"), "a wall that is not there");
        for (array, value) in
            [(0, -1.0), (0, 0.5), (1, 1e30), (2, f64::NAN), (4, 1e9), (6, f64::INFINITY), (8, 2.0)]
        {
            let mut bad = arrays.clone();
            bad[array][0] = value;
            let what = from_arrays(&bad, 5).unwrap_err();
            assert!(what.contains(ARRAYS[array].0), "{what}");
        }
        let unknown = crate::packing::positions::arrays_of_a_run(&bytes, &[("first", 2)]);
        assert_eq!(unknown, Ok(None));
    }

    #[test]
    fn the_force_of_a_contact_is_its_normal_part_that_pushes_apart_and_the_rest() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("contacts.vtp");
        contacts(&example().1).write(&path).unwrap();
        let piece = read(&path);
        assert_eq!(array(&piece, "normal_force"), [2.0; 2]);
        assert_eq!(array(&piece, "tangential_force"), [0.0, 0.25, 0.0, 0.0, 0.25, 0.0]);
    }

    #[test]
    fn chains_lead_from_centres_to_contacts_and_never_through_the_whole_box() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("force_chains.vtp");
        let (particles, contacts) = example();
        force_chains(&BOX, &particles, &contacts).write(&path).unwrap();
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
        contacts(&[]).write(&path).unwrap();
        assert_eq!(read(&path).num_points(), 0);
        force_chains(&BOX, &example().0, &[]).write(&path).unwrap();
        assert_eq!(read(&path).num_points(), 0);
    }
}
