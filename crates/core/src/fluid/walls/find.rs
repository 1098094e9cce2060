//! Finding the links of a block to its walls.

use super::interpolated::{Cell, Link, Shapes};
use super::{Boundary, LinkRule, NO_WALL, PartOfLink, RowEnds, Run, WallRow, Walls};
use crate::domain::{Block, Domain, Face};
use crate::error::Result;
use crate::fluid::layout::Layout;
use crate::fluid::{Population, Real};
use crate::lattice::{C, Q, opposite};
use crate::memory;
use std::collections::BTreeMap;

/// The wall of every cell of a block and its ghosts.
pub(super) struct Map {
    domain: Domain,
    size: [usize; 3],
    lo: [usize; 3],
    walls: Vec<u16>,
    /// Walls that links of cells of fluid meet, by direction, where there are any.
    between: BTreeMap<[isize; 3], Box<[u16; Q]>>,
    /// The wall of each closed face of the box.
    pub(super) faces: [u16; 6],
}

/// Origin of a population that arrives in a fluid cell from a wall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Back {
    /// From the cell itself, off this wall.
    Bounced(u16),
    /// From a cell beside a face of the box, which is a neighbour or the cell itself and has sent it in this direction.
    Neighbour { face: usize, source: [isize; 3], sent: usize },
}

/// Place beyond a link.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Beyond {
    /// A cell of a wall.
    Wall,
    /// A face that sends populations to a neighbour.
    Face,
    /// A cell of fluid of the block, on the other side of a sheet.
    Fluid,
    /// The same of another block, or the same one beyond its periodic faces.
    OtherBlock,
}

impl Map {
    pub(super) fn new(domain: &Domain, block: Block, boundary: &Boundary) -> Result<Self> {
        assert!(boundary.motions.len() < NO_WALL.into());
        let size = block.size();
        let cells = domain.cells.map(|n| n as i64);
        let cells_with_ghosts = size.iter().map(|n| n + 2).product();
        let mut walls = memory::with_capacity(cells_with_ghosts, "the map of the walls")?;
        let mut between = BTreeMap::new();
        let [xs, ys, zs]: [_; 3] = std::array::from_fn(|a| block.lo[a] as i64 - 1..block.hi[a] as i64 + 1);
        for z in zs {
            for y in ys.clone() {
                for x in xs.clone() {
                    let (mut cell, mut beyond) = ([x, y, z], false);
                    for a in 0..3 {
                        if domain.is_periodic(a) {
                            cell[a] = cell[a].rem_euclid(cells[a]);
                        } else {
                            beyond |= !(0..cells[a]).contains(&cell[a]);
                        }
                    }
                    let wall = (boundary.wall_of)(cell);
                    assert!(wall.is_some() || !beyond, "{cell:?} lies in a wall");
                    assert!(wall.is_none_or(|wall| wall < boundary.motions.len()));
                    walls.push(wall.map_or(NO_WALL, |wall| wall as u16));
                    if let (None, Some(met)) = (wall, (boundary.between)(cell)) {
                        let own = std::array::from_fn(|a| ([x, y, z][a] - block.lo[a] as i64) as isize);
                        between
                            .insert(own, Box::new(met.map(|wall| wall.map_or(NO_WALL, |wall| wall as u16))));
                    }
                }
            }
        }
        let middle = domain.cells.map(|n| n as i64 / 2);
        let faces = std::array::from_fn(|n| {
            let mut cell = middle;
            cell[n / 2] = if n.is_multiple_of(2) { -1 } else { cells[n / 2] };
            let wall = if domain.is_periodic(n / 2) { None } else { (boundary.wall_of)(cell) };
            wall.map_or(NO_WALL, |wall| wall as u16)
        });
        Ok(Self { domain: *domain, size, lo: block.lo, walls, between, faces })
    }

    /// Returns true if the block lies at a face of the box.
    pub(super) fn is_at(&self, face: usize) -> bool {
        let axis = face / 2;
        let end = self.lo[axis] + self.size[axis] == self.domain.cells[axis];
        if face.is_multiple_of(2) { self.lo[axis] == 0 } else { end }
    }

    /// Origin of `f_i` of a cell of the block or a ghost, if that is a fluid cell and the link leads to a wall. Where faces meet,
    /// an inlet comes first, so that its flux is exact, then walls, then outlets; free slip mirrors what the other one does.
    pub(super) fn back(&self, [x, y, z]: [isize; 3], i: usize) -> Option<Back> {
        let ([cx, cy, cz], cell) = (C[i], self.in_box([x, y, z]));
        let beyond: [isize; 3] = std::array::from_fn(|a| cell[a] - C[i][a]);
        let wall = self.at(x - cx, y - cy, z - cz);
        if wall == NO_WALL || self.at(x, y, z) != NO_WALL {
            return None;
        }
        let kind = |face: usize| self.domain.face_at(face, beyond);
        let priority = |face: usize| match kind(face) {
            Face::Inlet => 0,
            Face::Wall | Face::Periodic => 1,
            Face::Outlet { .. } => 2,
            Face::FreeSlip => 3,
        };
        let mut faces: Vec<usize> = (0..3).filter_map(|a| self.domain.face_beyond(a, beyond[a])).collect();
        faces.sort_by_key(|&face| priority(face));
        let Some(&first) = faces.first() else { return Some(Back::Bounced(wall)) };
        if !kind(first).sends_to_neighbours() {
            let same = |&&face: &&usize| priority(face) == priority(first) && self.faces[face] == wall;
            let other = faces.iter().find(same).unwrap_or(&first);
            return Some(Back::Bounced(if faces.len() == 1 { wall } else { self.faces[*other] }));
        }
        let slips = kind(first) == Face::FreeSlip;
        let mut source = [x, y, z];
        match faces[..] {
            // The population is mirrored twice.
            [_, _] if slips => return Some(Back::Bounced(wall)),
            [_] => {
                (0..3).filter(|&a| a != first / 2).for_each(|a| source[a] -= C[i][a]);
                let beside = self.at(source[0], source[1], source[2]);
                let way: [isize; 3] = std::array::from_fn(|a| [x, y, z][a] - source[a]);
                let sheet = || self.between([x, y, z], C.iter().position(|&c| c == way)?);
                if let Some(wall) = (beside != NO_WALL).then_some(beside).or_else(sheet) {
                    return Some(Back::Bounced(wall));
                }
            }
            _ => {}
        }
        // Mirrored by the face that slips: the one that comes back into the cell itself, or the only one.
        let mirror = faces[faces.len() - 1] / 2;
        let mirrors = slips || faces.len() > 1;
        let way: [isize; 3] =
            std::array::from_fn(|a| if mirrors && a == mirror { -C[i][a] } else { C[i][a] });
        let sent = C.iter().position(|&c| c == way).expect("mirrored directions are of the lattice");
        Some(Back::Neighbour { face: first, source, sent })
    }

    /// The wall that a population meets on its way along direction `i` to a cell of fluid from another one.
    fn between(&self, [x, y, z]: [isize; 3], i: usize) -> Option<u16> {
        let [cx, cy, cz] = C[i];
        let wall = self.between.get(&[x, y, z])?[opposite(i)];
        let is_fluid = self.at(x - cx, y - cy, z - cz) == NO_WALL;
        (wall != NO_WALL && is_fluid).then_some(wall)
    }

    /// True if a cell lies beside an outlet, which asks for all that the cell has sent.
    fn is_at_outlet(&self, cell: [isize; 3]) -> bool {
        let (place, cells) = (self.in_box(cell), self.domain.cells);
        (0..6).any(|face| {
            let last = if face % 2 == 0 { 0 } else { cells[face / 2] as isize - 1 };
            place[face / 2] == last && matches!(self.domain.faces[face], Face::Outlet { .. })
        })
    }

    /// The wall of a cell of the block or a ghost.
    fn at(&self, x: isize, y: isize, z: isize) -> u16 {
        let [nx, ny, _] = self.size.map(|n| n as isize + 2);
        self.walls[((x + 1) + nx * ((y + 1) + ny * (z + 1))) as usize]
    }

    /// The position in the box of a cell of the block.
    fn in_box(&self, cell: [isize; 3]) -> [isize; 3] {
        std::array::from_fn(|a| cell[a] + self.lo[a] as isize)
    }

    /// A link to a wall that it meets elsewhere than half-way. Not where the next cell on the other side is wall, too: there is
    /// nothing to interpolate with.
    fn interpolated(&self, part_of: PartOfLink, [x, y, z]: [isize; 3], i: usize) -> Option<Link> {
        let [cx, cy, cz] = C[i];
        let (wall, cell) = (self.at(x - cx, y - cy, z - cz), self.in_box([x, y, z]));
        let beyond = |a: usize| {
            !self.domain.is_periodic(a) && !(0..self.domain.cells[a] as isize).contains(&(cell[a] - C[i][a]))
        };
        if (0..3).any(beyond)
            || self.at(x + cx, y + cy, z + cz) != NO_WALL
            || self.between([x, y, z], opposite(i)).is_some()
        {
            return None;
        }
        let part = part_of(wall.into(), cell.map(|c| c as i64), C[opposite(i)]);
        Link::is_needed(part).then_some(Link { direction: i, wall, part })
    }
}

impl<S: Population> Walls<S> {
    /// Links across the ends of rows that are `closed`, low and high.
    pub(super) fn find_ends(&mut self, layout: &Layout, map: &Map, closed: [bool; 2]) {
        let [nx, ny, nz] = self.size.map(|n| n as isize);
        for (last, ghost, _) in [(0, -1, closed[0]), (nx - 1, nx, closed[1])].into_iter().filter(|end| end.2)
        {
            let inwards: Vec<usize> = (1..Q).filter(|&i| C[i][0] == last - ghost).collect();
            let directions = inwards.try_into().expect("five of them");
            let mut ends = RowEnds {
                directions,
                last,
                ghost,
                inner: RowEnds::<S::Number>::inner_links(directions, [last, ghost], layout),
                rule: LinkRule::Moving,
                numbers: Vec::new(),
                walls: Vec::new(),
            };
            let mut varies = false;
            for (z, y) in (0..nz).flat_map(|z| (0..ny).map(move |y| (z, y))) {
                for i in directions {
                    let back = map.back([last, y, z], i);
                    let wall = match back {
                        Some(Back::Bounced(wall)) => wall,
                        _ => map.at(ghost, y - C[i][1], z - C[i][2]),
                    };
                    ends.walls.push(if back.is_some() { wall } else { NO_WALL });
                    let motion = &self.motions[usize::from(wall)];
                    ends.numbers.push(motion.correction(map.in_box([last, y, z]), i, &self.domain));
                    varies |= motion.varies;
                }
            }
            if !varies && ends.numbers.iter().all(|&c| c == S::Number::ZERO) {
                ends.numbers.clear();
                ends.rule = LinkRule::Resting;
            }
            self.ends.push(ends);
        }
    }

    /// All other links.
    pub(super) fn find_runs(&mut self, layout: &Layout, map: &Map, closed: [bool; 2], part_of: PartOfLink) {
        let [nx, ny, nz] = self.size.map(|n| n as isize);
        self.early.resize_with((ny * nz) as usize, Vec::new);
        let (mut shapes, domain) = (Shapes::new(), self.domain);
        for (z, y) in (0..nz).flat_map(|z| (0..ny).map(move |y| (z, y))) {
            let mut interpolated = BTreeMap::<isize, Vec<Link>>::new();
            for i in 1..Q {
                let [cx, cy, cz] = C[i];
                let other = self.order.row(y - cy, z - cz);
                // The later of the two rows.
                let own = [y as usize, z as usize];
                let later = other.filter(|&other| self.order.is_before(own, other)).unwrap_or(own);
                let completed = later[1] * ny as usize + later[0];
                // The others are done at the ends of rows.
                let first = isize::from(closed[0] && cx > 0);
                let end = nx - isize::from(closed[1] && cx < 0);
                // First cell, wall, whether it is beyond the block, and what lies beyond.
                let link = |x: isize| {
                    let late = other.is_none() || !(0..nx).contains(&(x - cx));
                    let (cell, next) = ([x, y, z], [x - cx, y - cy, z - cz]);
                    let (wall, beyond) = match map.back(cell, i) {
                        Some(Back::Bounced(wall)) => (wall, Beyond::Wall),
                        Some(Back::Neighbour { face, .. }) => (map.faces[face], Beyond::Face),
                        // Blocks that share a link see one side each; within a block it is one link.
                        None => match map.between(cell, i)? {
                            wall if late => (wall, Beyond::OtherBlock),
                            // What outlets ask for must still be there.
                            wall if i < opposite(i) => {
                                let late = map.is_at_outlet(cell) || map.is_at_outlet(next);
                                return Some((x, wall, late, Beyond::Fluid));
                            }
                            _ => return None,
                        },
                    };
                    Some((x, wall, late, beyond))
                };
                let mut links: Vec<_> = (first..end).filter_map(link).collect();
                links.retain(|&(x, _, _, beyond)| {
                    if matches!(beyond, Beyond::Fluid | Beyond::OtherBlock) {
                        return true;
                    }
                    let link = map.interpolated(part_of, [x, y, z], i);
                    link.inspect(|link| interpolated.entry(x).or_default().push(*link)).is_none()
                });
                for links in links.chunk_by(|a, b| a.0 + 1 == b.0 && (a.1, a.2, a.3) == (b.1, b.2, b.3)) {
                    let (x, wall, late, beyond) = links[0];
                    let motion = &self.motions[usize::from(wall)];
                    let run = Run {
                        near: i * layout.stride + layout.cell(x, y, z),
                        count: links.len() as u32,
                        rule: match beyond {
                            Beyond::Wall if motion.moves() => LinkRule::Moving,
                            Beyond::Fluid => LinkRule::TwoSided,
                            _ => LinkRule::Resting,
                        },
                        numbers: self.numbers.len() as u32,
                        wall,
                        direction: i as u8,
                    };
                    if run.rule == LinkRule::Moving {
                        let of = |link: &(isize, u16, bool, Beyond)| {
                            motion.correction::<S::Number>(map.in_box([link.0, y, z]), i, &domain)
                        };
                        self.numbers.extend(links.iter().map(of));
                    }
                    if beyond == Beyond::Fluid {
                        let far = self.far(&run);
                        for k in 0..links.len() {
                            self.exchanged.extend([(run.near + k, far + k), (far + k, run.near + k)]);
                        }
                    }
                    match (beyond, late) {
                        (Beyond::Face, _) => &mut self.face_runs,
                        (_, true) => &mut self.late,
                        (_, false) => &mut self.early[completed],
                    }
                    .push(run);
                }
            }
            let cell = |(x, links): (isize, Vec<Link>)| Cell {
                slot: layout.cell(x, y, z),
                completed: self.completed([x, y, z], &links),
                links,
            };
            let cells: Vec<_> = interpolated.into_iter().map(cell).collect();
            self.interpolated.add(&cells, &self.motions, &mut shapes);
        }
        assert!(u32::try_from(self.numbers.len()).is_ok());
        if self.early.iter().all(Vec::is_empty) {
            self.early.clear();
        }
    }

    /// The last row that is swept before links of a cell can be interpolated: of itself and its neighbours on both sides. None if one of
    /// them is beyond the block.
    fn completed(&self, [x, y, z]: [isize; 3], links: &[Link]) -> Option<usize> {
        let (nx, mut last) = (self.size[0] as isize, [y as usize, z as usize]);
        for link in links {
            for [cx, cy, cz] in [C[link.direction], C[opposite(link.direction)]] {
                let row = self.order.row(y + cy, z + cz).filter(|_| (0..nx).contains(&(x + cx)))?;
                last = if self.order.is_before(last, row) { row } else { last };
            }
        }
        Some(last[1] * self.size[1] + last[0])
    }

    /// Wall cells of the block.
    pub(super) fn find_cells(&mut self, map: &Map) {
        let [nx, ny, nz] = self.size;
        for (z, y) in (0..nz).flat_map(|z| (0..ny).map(move |y| (z, y))) {
            let walls: Vec<u16> = (0..nx).map(|x| map.at(x as isize, y as isize, z as isize)).collect();
            self.fluid_cells -= walls.iter().filter(|&&wall| wall != NO_WALL).count();
            self.rows.push(WallRow::new(&walls).map(Box::new));
        }
        if self.rows.iter().all(Option::is_none) {
            self.rows.clear();
        }
    }
}
