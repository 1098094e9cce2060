//! Inlets and outlets in a part of their face.

use crate::case::checks::Document;
use crate::case::file::{FACES, PatchSection, PatchesSection};
use crate::case::walls::PlacedWall;
use crate::domain::{Domain, Face};
use crate::error::Result;
use crate::math::{Patch, Profile, Vec3};
use std::collections::BTreeMap;

/// Most parts of a list: each link looks for its own.
const MOST: usize = 256;

/// The part of a face that an inlet or outlet has, lengths in m.
pub(super) fn patch(
    document: &Document,
    domain: &Domain,
    walls: &[PlacedWall],
    (face, key): (usize, &str),
    section: &PatchesSection,
) -> Result<Patch> {
    let sections = match section {
        PatchesSection::One(section) => return part(document, domain, walls, (face, key), section),
        PatchesSection::Several(sections) => sections,
    };
    if sections.is_empty() {
        let title = format!("`{key}` is an empty list");
        return Err(document.error(key, &title, "no part", "remove it for the whole face"));
    }
    if sections.len() > MOST {
        let remedy = "join some to rectangles; a profile by a table has any number of jets";
        return Err(document.error(key, &format!("`{key}` has more than {MOST} parts"), "too long", remedy));
    }
    let (mut parts, mut owners) = (Vec::new(), BTreeMap::new());
    for (n, section) in sections.iter().enumerate() {
        let key = format!("{key}.{n}");
        let part = part(document, domain, walls, (face, &key), section)?;
        for cell in cells(domain, face, &part.scaled(1.0 / domain.dx)) {
            if let Some(other) = owners.insert(cell.map(f64::to_bits), n) {
                let title = format!("`{key}` has cells that part {other} of the list has, too");
                return Err(document.error(&key, &title, "shared", "move it, or make it smaller"));
            }
        }
        parts.push(part);
    }
    Ok(Patch::Several(parts))
}

/// A disc or rectangle on a face, which must be in the face and have cells; beyond a plane of symmetry it may go on.
fn part(
    document: &Document,
    domain: &Domain,
    walls: &[PlacedWall],
    (face, key): (usize, &str),
    section: &PatchSection,
) -> Result<Patch> {
    let (normal, size, axes) = (face / 2, domain.size(), ["x", "y", "z"]);
    let patch = match section {
        PatchSection::Disc(disc) => {
            Patch::Disc { centre: disc.centre, axis: normal, radius: 0.5 * disc.diameter }
        }
        PatchSection::Rectangle(of) => Patch::Rectangle { lower: of.lower, upper: of.upper, axis: normal },
    };
    for a in (0..3).filter(|&a| a != normal) {
        let [from, to] = patch.along(a);
        if from >= to {
            let title = format!("`{key}` begins at {} = {from} m and ends at {to} m", axes[a]);
            return Err(document.error(key, &title, "no area", "the lower corner comes first"));
        }
        let margin = 1e-9 * size[a];
        let open = |side: usize| domain.faces[2 * a + side] == Face::FreeSlip;
        if (from < -margin && !open(0)) || (to > size[a] + margin && !open(1)) {
            let title = format!(
                "`{key}` reaches from {} = {from:.4e} m to {to:.4e} m, but the face \"{}\" from 0 to {:.4e} m",
                axes[a], FACES[face], size[a]
            );
            let remedy = "move it, or make it smaller; only beyond a plane of symmetry it may go on";
            return Err(document.error(key, &title, "beyond the face", remedy));
        }
    }
    let free = |cell: [f64; 3]| {
        let at = Vec3::from(cell) * domain.dx;
        walls.iter().all(|placed| placed.is_face || placed.wall.surface.distance(at) > 0.0)
    };
    if cells(domain, face, &patch.scaled(1.0 / domain.dx)).any(free) {
        return Ok(patch);
    }
    let title = format!("`{key}` has no cell: no centre of a cell outside of walls is in it");
    let remedy = format!("move it, make it larger than a cell of {:.3e} m, or take smaller cells", domain.dx);
    Err(document.error(key, &title, "empty", &remedy))
}

/// Centres of the cells beside a face that are in a part of it, lengths in cells.
pub(super) fn cells(domain: &Domain, face: usize, patch: &Patch) -> impl Iterator<Item = [f64; 3]> {
    let (normal, counts) = (face / 2, domain.cells);
    let [b, c] = [(normal + 1) % 3, (normal + 2) % 3];
    let along = |a: usize| {
        let [from, to] = patch.along(a).map(|end| end.clamp(0.0, counts[a] as f64));
        from.floor() as usize..to.ceil() as usize
    };
    let (inner, outer) = (along(b), along(c));
    let all = outer.flat_map(move |n| inner.clone().map(move |m| (m, n))).map(move |(m, n)| {
        let mut at = [0.5; 3];
        at[normal] = if face.is_multiple_of(2) { 0.5 } else { counts[normal] as f64 - 0.5 };
        (at[b], at[c]) = (m as f64 + 0.5, n as f64 + 0.5);
        at
    });
    all.filter(|at| patch.has(*at))
}

/// The flow in a pipe or duct that has a part of a face as its cross-section; along a periodic direction that it fills it does not vary.
pub(super) fn parabola_of(domain: &Domain, patch: &Patch) -> Profile {
    match patch {
        &Patch::Disc { centre, axis, radius } => Profile::Round { centre, axis, radius },
        Patch::Several(parts) => {
            Profile::Each(parts.iter().map(|part| (part.clone(), parabola_of(domain, part))).collect())
        }
        &Patch::Rectangle { axis, .. } => Profile::Parabolic(std::array::from_fn(|a| {
            let ([from, to], size) = (patch.along(a), domain.size()[a]);
            let fills = domain.is_periodic(a) && to - from > (1.0 - 1e-9) * size;
            (a != axis && !fills).then_some([from, to - from])
        })),
    }
}
